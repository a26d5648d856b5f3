//! A command that is killed leaves each of its files as it was, or whole.

use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};
use std::{env, fs, thread};

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::common::{example, files, folder, lamc, text};
use super::outputs::{ALL, Written};

/// What files contain before a command.
const OLD: &[u8] = b"as it was\n";

/// Kills in the tests alone.
const KILLS: usize = 45;

fn kills() -> usize {
    env::var("LAMC_KILLS").map_or(KILLS, |text| text.parse().unwrap())
}

/// How a temporary file begins, which a killed process cannot remove.
const TEMPORARY: &str = ".lamc-";

#[test]
fn no_file_is_half_written() {
    let random = &mut ChaCha8Rng::seed_from_u64(1);
    let (kills, mut killed, mut temporary) = (kills(), 0, 0);
    for (index, written) in ALL.iter().enumerate() {
        let (_guard, folder) = folder();
        let begin = Instant::now();
        let output = written.command(&folder).output().unwrap();
        let duration = begin.elapsed();
        assert_eq!(
            output.status.code(),
            Some(0),
            "{:?}: {}",
            written.arguments,
            text(&output.stderr)
        );
        let whole: Vec<Vec<u8>> =
            written.files.iter().map(|name| fs::read(folder.join(name)).unwrap()).collect();
        assert_eq!(files(&folder).len(), whole.len(), "{:?}", files(&folder));
        for kill in (index..kills).step_by(ALL.len()) {
            let was_there = (kill / ALL.len()).is_multiple_of(2);
            reset(&folder, written, was_there);
            let mut child = written
                .command(&folder)
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .unwrap();
            // Files are written in the last part of the time.
            let share: f64 = random.random_range(0.0..1.05);
            let share = if kill % 4 < 2 { share } else { 0.8 + 0.25 * share };
            thread::sleep(duration.mul_f64(share));
            // One that has ended is not there to be killed.
            killed += usize::from(child.try_wait().unwrap().is_none());
            child.kill().unwrap();
            child.wait().unwrap();
            temporary += files(&folder).iter().filter(|name| name.starts_with(TEMPORARY)).count();
            check(&folder, written, &whole, was_there);
        }
    }
    println!(
        "{killed} of {kills} processes were killed before their end; {temporary} left a temporary file"
    );
    assert!(killed > kills / 3, "{killed} of {kills}");
}

fn reset(folder: &Path, written: &Written, was_there: bool) {
    for name in files(folder) {
        fs::remove_file(folder.join(name)).unwrap();
    }
    for name in written.files.iter().filter(|_| was_there) {
        fs::write(folder.join(name), OLD).unwrap();
    }
}

fn check(folder: &Path, written: &Written, whole: &[Vec<u8>], was_there: bool) {
    for (name, whole) in written.files.iter().zip(whole) {
        match fs::read(folder.join(name)) {
            Ok(found) => assert!(
                found == *whole || (was_there && found == OLD),
                "{:?}: {name} has {} bytes",
                written.arguments,
                found.len()
            ),
            Err(_) => assert!(!was_there, "{:?}: {name} is gone", written.arguments),
        }
    }
    let known =
        |name: &String| written.files.contains(&name.as_str()) || name.starts_with(TEMPORARY);
    assert!(files(folder).iter().all(known), "{:?}", files(folder));
}

/// The cache of models, too, has whole entries only: a command after the kill gives what it gave before.
#[test]
fn a_killed_command_leaves_a_cache_that_can_be_used() {
    let random = &mut ChaCha8Rng::seed_from_u64(2);
    let (_guard, folder) = folder();
    let check = || {
        let mut command = lamc();
        command.args(["check", &example("miura_sheet.yaml")]).env("XDG_CACHE_HOME", &folder);
        command
    };
    let begin = Instant::now();
    let expected = check().output().unwrap();
    let duration = begin.elapsed();
    for _ in 0..kills().div_ceil(ALL.len()) {
        fs::remove_dir_all(folder.join("lamc")).unwrap();
        let mut child = check().stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        thread::sleep(duration.mul_f64(random.random_range(0.5..1.05)));
        child.kill().unwrap();
        child.wait().unwrap();
        let output = check().output().unwrap();
        assert_eq!(output.stdout, expected.stdout);
        assert_eq!(text(&output.stderr), text(&expected.stderr));
    }
}

/// A sweep that was killed goes on, and has the rows that it has when nobody kills it.
#[test]
fn a_killed_sweep_goes_on() {
    let random = &mut ChaCha8Rng::seed_from_u64(3);
    let (_guard, folder) = folder();
    let sweep = |file: &str| {
        let mut command = lamc();
        let (model, plan) = (example("sixbar_markers.yaml"), example("sweep/tolerances.yaml"));
        command.args(["sweep", &model, &plan, "--resume", "-o", file]).current_dir(&folder);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command
    };
    let begin = Instant::now();
    assert!(sweep("whole.parquet").status().unwrap().success());
    let duration = begin.elapsed().max(Duration::from_millis(100));
    let whole = fs::read(folder.join("whole.parquet")).unwrap();
    for _ in 0..kills().div_ceil(4 * ALL.len()) {
        for _ in 0..3 {
            let mut child = sweep("killed.parquet").spawn().unwrap();
            thread::sleep(duration.mul_f64(random.random_range(0.2..0.7)));
            child.kill().unwrap();
            child.wait().unwrap();
            if let Ok(found) = fs::read(folder.join("killed.parquet")) {
                assert!(found == whole);
            }
        }
        assert!(sweep("killed.parquet").status().unwrap().success());
        assert!(fs::read(folder.join("killed.parquet")).unwrap() == whole);
        assert_eq!(files(&folder).len(), 2, "{:?}", files(&folder));
        fs::remove_file(folder.join("killed.parquet")).unwrap();
    }
}
