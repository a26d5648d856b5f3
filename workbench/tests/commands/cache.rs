//! The cache of derived models, as a user meets it: same results, no waiting, no harm.

use std::fs::{self, File};
use std::path::Path;
use std::process::{Output, Stdio};
use std::time::Duration;
use std::{env, thread};

use super::common::{example, files, folder, lamc, text};

/// What the command answers with its cache in this folder.
fn with_cache(cache: &Path, arguments: &[&str]) -> Output {
    let output = lamc().env("XDG_CACHE_HOME", cache).args(arguments).output();
    let output = output.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", text(&output.stderr));
    output
}

/// The names of the entries; none if there is no folder.
fn entries(cache: &Path) -> Vec<String> {
    let models = cache.join("lamc/models");
    if models.exists() { files(&models) } else { Vec::new() }
}

/// Output, but for how long the simulation took, and what was said but for the progress.
fn said(output: &Output) -> (String, String) {
    let is_timing = |line: &&str| line.contains("times real time");
    let is_progress = |line: &&str| line.starts_with("waiting for") || line.ends_with(" ..");
    let lines = |bytes: &[u8]| {
        let all = text(bytes);
        all.lines()
            .filter(|line| !is_timing(line) && !is_progress(line))
            .collect::<Vec<_>>()
            .join("\n")
    };
    (lines(&output.stdout), lines(&output.stderr))
}

#[test]
fn results_do_not_depend_on_the_cache() {
    let models = ["sixbar.yaml", "triple_pendulum.yaml", "fold/pop_up.yaml", "miura.yaml"];
    for model in models.map(example) {
        let (_guard, cache) = folder();
        for command in [
            &["simulate", &model, "--duration", "0.02"][..],
            &["check", &model],
            &["equilibrium", &model],
            &[&model, "-o", "-", "--functions", "all"],
            &[&model, "--c", "-", "--header", "/dev/null"],
        ] {
            // Some models have no equilibrium nearby.
            let run = |more: &[&str]| {
                let output = lamc().env("XDG_CACHE_HOME", &cache).args(command).args(more).output();
                let output = output.unwrap_or_else(|error| panic!("{error}"));
                (output.status.code(), said(&output))
            };
            let anew = run(&["--no-cache"]);
            assert!(!anew.1.0.is_empty() || anew.0 == Some(1), "{command:?}");
            assert_eq!(run(&[]), anew, "{command:?}");
            assert_eq!(run(&[]), anew, "{command:?}");
        }
        // All commands derive the same.
        assert_eq!(entries(&cache).len(), 1, "{model}");
    }
}

#[test]
fn no_cache_leaves_no_trace() {
    let (_guard, cache) = folder();
    with_cache(&cache, &["check", &example("pendulum.yaml"), "--no-cache"]);
    // The symbolic engine has a folder of its own there.
    assert!(!cache.join("lamc").exists());
}

#[test]
fn locks_inputs_and_drawings_are_part_of_the_model() {
    let (_guard, cache) = folder();
    let count = |arguments: &[&str]| {
        with_cache(&cache, arguments);
        entries(&cache).len()
    };
    let sixbar = example("sixbar.yaml");
    assert_eq!(count(&["equilibrium", &sixbar]), 1);
    let text_of = fs::read_to_string(&sixbar).unwrap();
    let joint = text_of.lines().skip_while(|line| !line.starts_with("joints:")).nth(1).unwrap();
    let joint = joint.trim().split(':').next().unwrap();
    let lock = |angle: &str| format!("--lock={joint}={angle}");
    assert_eq!(count(&["simulate", &sixbar, "--duration", "0.01", &lock("0deg")]), 2);
    assert_eq!(count(&["simulate", &sixbar, "--duration", "0.01", &lock("1deg")]), 3);
    assert_eq!(count(&["simulate", &sixbar, "--duration", "0.02", &lock("1deg")]), 3);
    // A drawing beside its model.
    let (_guard, models) = folder();
    let [model, drawing] = ["pop_up.yaml", "pop_up.svg"].map(|name| models.join(name));
    fs::copy(example("fold/pop_up.yaml"), &model).unwrap();
    let svg = fs::read_to_string(example("fold/pop_up.svg")).unwrap();
    fs::write(&drawing, &svg).unwrap();
    let model = model.display().to_string();
    assert_eq!(count(&["check", &model]), 4);
    assert_eq!(count(&["check", &model]), 4);
    fs::write(&drawing, svg + "<!-- changed -->").unwrap();
    assert_eq!(count(&["check", &model]), 5);
}

/// A setting of a parameter does not change the equations, but the results.
#[test]
fn parameters_are_set_in_what_was_derived() {
    let (_guard, folder) = folder();
    let model = folder.join("swing.yaml");
    fs::write(&model, super::common::SWING.replace("TORQUE", "gain")).unwrap();
    let model = model.display().to_string();
    let angles = |setting: &str, more: &[&str]| {
        let arguments = ["equilibrium", &model, "--set", setting];
        said(&with_cache(&folder, &[&arguments, more].concat())).0
    };
    let [small, large] = ["gain=1e-4", "gain=3e-4"].map(|setting| angles(setting, &[]));
    assert_ne!(small, large);
    assert_eq!(large, angles("gain=3e-4", &["--no-cache"]));
    assert_eq!(entries(&folder).len(), 1);
}

#[test]
fn processes_share_an_empty_cache() {
    let (_guard, cache) = folder();
    let start = |_| {
        let mut command = lamc();
        command.env("XDG_CACHE_HOME", &cache).args([&example("sixbar.yaml"), "-o", "-"]);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let processes: Vec<_> = (0..8).map(start).collect();
    let outputs: Vec<_> = processes.into_iter().map(|it| it.wait_with_output().unwrap()).collect();
    for output in &outputs {
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        assert!(!output.stdout.is_empty() && output.stdout == outputs[0].stdout);
    }
    assert_eq!(entries(&cache).len(), 1);
}

/// Wherever a process ends, what it leaves does no harm.
#[test]
fn killed_processes_leave_nothing_that_is_read() {
    let (_guard, cache) = folder();
    let model = example("sixbar.yaml");
    let arguments = [model.as_str(), "-o", "-"];
    let expected = with_cache(&cache, &[&model, "-o", "-", "--no-cache"]).stdout;
    for milliseconds in (10..200).step_by(10) {
        let mut command = lamc();
        command.env("XDG_CACHE_HOME", &cache).args(arguments);
        let mut process = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        thread::sleep(Duration::from_millis(milliseconds));
        // It may have ended.
        let _ = process.kill();
        process.wait().unwrap();
        let whole = entries(&cache).into_iter().filter(|name| !name.starts_with(".lamc-")).count();
        if whole > 0 {
            assert_eq!(with_cache(&cache, &arguments).stdout, expected);
            fs::remove_dir_all(cache.join("lamc")).unwrap();
        }
    }
    assert_eq!(with_cache(&cache, &arguments).stdout, expected);
}

#[cfg(unix)]
#[test]
fn a_folder_that_cannot_be_written_is_read() {
    use std::os::unix::fs::PermissionsExt;
    let (_guard, cache) = folder();
    let (sixbar, pendulum) = (example("sixbar.yaml"), example("pendulum.yaml"));
    let first = with_cache(&cache, &[&sixbar, "-o", "-"]).stdout;
    let models = cache.join("lamc/models");
    let permit = |mode| fs::set_permissions(&models, fs::Permissions::from_mode(mode)).unwrap();
    permit(0o555);
    assert_eq!(with_cache(&cache, &[&sixbar, "-o", "-"]).stdout, first);
    with_cache(&cache, &["check", &pendulum]);
    permit(0o755);
    // No folder can be made here, whoever asks.
    fs::remove_dir_all(cache.join("lamc")).unwrap();
    fs::write(cache.join("lamc"), "").unwrap();
    assert_eq!(with_cache(&cache, &[&sixbar, "-o", "-"]).stdout, first);
}

/// What is in the cache needs no turn with the symbolic engine.
#[test]
fn who_derives_nothing_does_not_wait() {
    let (_guard, cache) = folder();
    let model = example("pendulum.yaml");
    with_cache(&cache, &["check", &model]);
    let home = env::home_dir().map(|home| home.join(".cache").join("lamc"));
    let lock = home.unwrap_or_else(env::temp_dir).join("symbolic.lock");
    let lock = File::options().read(true).write(true).open(lock).unwrap();
    lock.lock().unwrap();
    let mut command = lamc();
    command.env("XDG_CACHE_HOME", &cache).args(["check", &model]).stdout(Stdio::null());
    let mut process = command.spawn().unwrap();
    let mut outcome = None;
    for _ in 0..100 {
        outcome = process.try_wait().unwrap();
        if outcome.is_some() {
            break;
        }
        thread::sleep(Duration::from_millis(50));
    }
    drop(lock);
    process.wait().unwrap();
    assert!(outcome.is_some_and(|status| status.success()), "it waited");
}
