//! `lamc sweep`: killed and resumed, in shards, refused.

use std::fs;
use std::path::Path;
use std::process::{Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use rand::Rng as _;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng as _;

use super::common::{SWING, files, folder, lamc, run, text};

const PLAN: &str = "
vary:
  gain: { uniform: [1e-3, 3e-3] }
  initial.hinge: { normal: [0.3, 0.1] }
samples: { count: 1500, method: sobol }
duration: 1 s
record: [end, extremes, settling, energy]
";

/// A model and a plan in a folder.
fn prepare(folder: &Path) -> [String; 2] {
    let [model, plan] = ["model.yaml", "plan.yaml"].map(|name| folder.join(name));
    fs::write(&model, SWING.replace("TORQUE", "motor + gain*sin(20*t)")).unwrap();
    fs::write(&plan, PLAN).unwrap();
    [model, plan].map(|path| path.display().to_string())
}

fn sweep(inputs: &[String; 2], output: &Path, options: &[&str]) -> Output {
    let [model, plan] = inputs;
    let output = output.display().to_string();
    run(&[&["sweep", model, plan, "-o", &output], options].concat())
}

fn succeeds(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    text(&output.stdout)
}

#[test]
fn killed_at_twenty_random_moments_the_file_is_the_same() {
    const KILLS: usize = 20;
    let (_guard, folder) = folder();
    let inputs = prepare(&folder);
    let [expected, killed] = ["whole.parquet", "killed.parquet"].map(|name| folder.join(name));
    let begin = Instant::now();
    let said = succeeds(&sweep(&inputs, &expected, &[]));
    assert!(said.contains("1500 runs, 0 failed"), "{said}");
    let expected = fs::read(expected).unwrap();
    // All kills together get about twice as far as the sweep is long.
    let longest = begin.elapsed().mul_f64(4.0 / KILLS as f64);
    let mut random = ChaCha8Rng::seed_from_u64(2026);
    let (mut kills, mut finished) = (0, 0);
    while kills < KILLS {
        let parts = folder.join("killed.parquet.parts");
        let mut command = lamc();
        let [model, plan] = &inputs;
        command.args(["sweep", model, plan, "-o", &killed.display().to_string()]);
        command.args((parts.exists() || killed.exists()).then_some("--resume"));
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        thread::sleep(longest.mul_f64(random.random_range(0.0..1.0)));
        match child.try_wait().unwrap() {
            None => {
                child.kill().unwrap();
                child.wait().unwrap();
                kills += 1;
            }
            Some(status) => {
                assert_eq!(status.code(), Some(0));
                assert!(fs::read(&killed).unwrap() == expected);
                assert!(!parts.exists());
                fs::remove_file(&killed).unwrap();
                finished += 1;
            }
        }
    }
    let said = succeeds(&sweep(&inputs, &killed, &["--resume"]));
    assert!(fs::read(&killed).unwrap() == expected, "after {finished} others: {said}");
    // A process that is killed while it writes cannot remove its temporary file.
    let left = files(&folder).into_iter().filter(|name| !name.starts_with(".lamc-"));
    assert_eq!(left.count(), 4);
}

#[test]
fn a_finished_sweep_is_complete_and_an_unfinished_one_is_not_begun_anew() {
    let (_guard, folder) = folder();
    let inputs = prepare(&folder);
    fs::write(&inputs[1], PLAN.replace("1500", "100")).unwrap();
    let output = folder.join("out.parquet");
    succeeds(&sweep(&inputs, &output, &["--threads", "1"]));
    let first = fs::metadata(&output).unwrap().modified().unwrap();
    let said = succeeds(&sweep(&inputs, &output, &["--resume"]));
    assert!(said.contains("is complete"), "{said}");
    assert_eq!(fs::metadata(&output).unwrap().modified().unwrap(), first);
    let other = sweep(&inputs, &output, &["--resume", "--set", "gain=0.004"]);
    assert_eq!(other.status.code(), Some(1));
    assert!(text(&other.stderr).contains("another sweep"), "{}", text(&other.stderr));
    fs::create_dir(folder.join("new.parquet.parts")).unwrap();
    let refused = sweep(&inputs, &folder.join("new.parquet"), &[]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(text(&refused.stderr).contains("--resume"), "{}", text(&refused.stderr));
}

#[test]
fn failures_are_counted_by_reason_and_a_sweep_of_failures_fails() {
    let (_guard, folder) = folder();
    let inputs = prepare(&folder);
    let limited = fs::read_to_string(&inputs[0])
        .unwrap()
        .replace("damping:", "limits: [-0.5, 0.5], damping:");
    fs::write(&inputs[0], limited).unwrap();
    fs::write(&inputs[1], "{ grid: { initial.hinge: [0.1, 0.6, 0.7] }, duration: 0.1 }").unwrap();
    let said = succeeds(&sweep(&inputs, &folder.join("some.parquet"), &[]));
    assert!(said.contains("3 runs, 2 failed"), "{said}");
    assert!(said.contains("2 failed as run 1 did: the initial angle of `hinge`"), "{said}");
    fs::write(&inputs[1], "{ grid: { initial.hinge: [0.6, 0.7] }, duration: 0.1 }").unwrap();
    let failed = sweep(&inputs, &folder.join("all.parquet"), &[]);
    assert_eq!(failed.status.code(), Some(1));
    assert!(text(&failed.stderr).contains("every run failed"));
}

#[test]
fn arguments_that_cannot_be_are_refused_before_work() {
    let (_guard, folder) = folder();
    let inputs = prepare(&folder);
    let to = |name: &str, options: &[&str]| sweep(&inputs, &folder.join(name), options);
    for (refused, reason) in [
        (to("out.csv", &[]), "does not end in .parquet"),
        (run(&["sweep", &inputs[0], &inputs[1], "-o", "-"]), "a sweep needs a file"),
        (to("out.parquet", &["--shard", "0/3"]), "is not of the form `3/100`"),
        (to("out.parquet", &["--shard", "4/3"]), "is not of the form `3/100`"),
        (to("out.parquet", &["--threads", "0"]), "--threads must be at least 1"),
        (to("nowhere/out.parquet", &[]), "there is no folder"),
    ] {
        assert!(matches!(refused.status.code(), Some(1 | 2)), "{reason}");
        assert!(text(&refused.stderr).contains(reason), "{}", text(&refused.stderr));
    }
    assert_eq!(files(&folder).len(), 2);
    let wait = Duration::from_secs(20);
    let begin = Instant::now();
    fs::write(&inputs[1], PLAN.replace("1500", "60_000_000")).unwrap();
    let mut child = lamc();
    child.args([
        "sweep",
        &inputs[0],
        &inputs[1],
        "-o",
        &folder.join("long.parquet").display().to_string(),
    ]);
    let mut child = child.stderr(Stdio::null()).spawn().unwrap();
    let parts = folder.join("long.parquet.parts");
    while !parts.join("00000003.parquet").exists() && begin.elapsed() < wait {
        thread::sleep(Duration::from_millis(20));
    }
    let busy = to("long.parquet", &["--resume"]);
    assert!(text(&busy.stderr).contains("another process"), "{}", text(&busy.stderr));
    #[cfg(unix)]
    {
        let kill =
            std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(kill.unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(130));
    }
    let _ = child.kill();
}
