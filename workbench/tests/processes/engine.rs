//! The symbolic engine may be used by one program of a user at a time, and ends any other.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use super::common::{example, folder, lamc, text};

/// A user with a home of their own, so that the tests do not wait for each other, and without a key.
fn derive(home: &Path, model: &str) -> Command {
    let mut command = lamc();
    command.args(["check", &example(model), "--no-cache"]).env("HOME", home);
    for variable in ["XDG_CACHE_HOME", "XDG_RUNTIME_DIR", "SYMBOLICA_LICENSE"] {
        command.env_remove(variable);
    }
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn outcome(command: &mut Command) -> (Option<i32>, String) {
    told(&command.output().unwrap())
}

fn told(output: &Output) -> (Option<i32>, String) {
    (output.status.code(), text(&output.stderr))
}

/// The file by whose lock the engine knows that it runs.
fn permit(folder: &Path) -> Option<PathBuf> {
    let entries = fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path());
    entries.into_iter().find_map(|path| match path.is_dir() {
        true => permit(&path),
        false => path.to_string_lossy().contains("symbolica-restricted").then_some(path),
    })
}

#[test]
fn another_program_that_uses_the_engine() {
    let (_guard, home) = folder();
    assert_eq!(outcome(&mut derive(&home, "pendulum.yaml")).0, Some(0));
    let permit = permit(&home).expect("the engine's permit is below the home");
    let file = File::options().write(true).open(permit).unwrap();
    file.lock().unwrap();
    let (code, said) = outcome(derive(&home, "pendulum.yaml").env("LAMC_WAIT", "1"));
    assert_eq!(code, Some(1));
    let waits = "waiting for another program that runs Symbolica, for at most 1 s\n";
    assert!(said.starts_with(waits), "{said}");
    assert!(
        said.contains("error: another program of this user has run Symbolica for 1 s"),
        "{said}"
    );
    assert!(said.contains("SYMBOLICA_LICENSE") && said.lines().count() == 2, "{said}");
    // One that ends while lamc waits.
    let waiting = derive(&home, "pendulum.yaml").spawn().unwrap();
    thread::sleep(Duration::from_millis(700));
    drop(file);
    let (code, said) = told(&waiting.wait_with_output().unwrap());
    assert_eq!((code, said.as_str()), (Some(0), waits.replace(" 1 s", " 600 s").as_str()));
}

#[test]
fn a_lamc_that_does_not_end() {
    let (_guard, home) = folder();
    assert_eq!(outcome(&mut derive(&home, "pendulum.yaml")).0, Some(0));
    let mut file = File::create(home.join(".cache/lamc/symbolic.lock")).unwrap();
    file.lock().unwrap();
    write!(file, "4711").unwrap();
    let (code, said) = outcome(derive(&home, "pendulum.yaml").env("LAMC_WAIT", "2"));
    assert_eq!(code, Some(1));
    assert!(said.contains("waiting for another lamc (pid 4711), for at most 2 s\n"), "{said}");
    let error = "error: another lamc (pid 4711) has derived equations for 2 s: end it, or let lamc wait longer with \
                 LAMC_WAIT=SECONDS\n";
    assert!(said.ends_with(error), "{said}");
}

/// The process that derives equations, as soon as there is one.
fn worker(home: &Path) -> u32 {
    let lock = home.join(".cache/lamc/symbolic.lock");
    let begin = Instant::now();
    loop {
        let worker = fs::read_to_string(&lock).ok().and_then(|text| text.parse().ok());
        if let Some(worker) = worker {
            return worker;
        }
        assert!(begin.elapsed() < Duration::from_secs(60));
        thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_command_that_is_killed_frees_the_engine() {
    let (_guard, home) = folder();
    let mut command = derive(&home, "miura_10x10.yaml").spawn().unwrap();
    worker(&home);
    command.kill().unwrap();
    command.wait().unwrap();
    // Its worker ends with it.
    let begin = Instant::now();
    let (code, said) = outcome(&mut derive(&home, "pendulum.yaml"));
    assert_eq!((code, said.as_str()), (Some(0), ""));
    assert!(begin.elapsed() < Duration::from_secs(1));
}

#[cfg(unix)]
#[test]
fn an_engine_that_aborts_does_not_take_the_command_with_it() {
    let (_guard, home) = folder();
    let command = derive(&home, "miura_10x10.yaml").spawn().unwrap();
    let worker = worker(&home);
    assert_ne!(worker, command.id());
    let killed = Command::new("kill").args(["-ABRT", &worker.to_string()]).status().unwrap();
    assert!(killed.success());
    let (code, said) = told(&command.wait_with_output().unwrap());
    assert_eq!(code, Some(1));
    let error = "error: the process that derived the equations has ended (signal: 6";
    assert!(said.contains(error), "{said}");
}

#[test]
fn without_a_home() {
    let (_guard, folder) = folder();
    let blocked = folder.join("file");
    fs::write(&blocked, "").unwrap();
    let (code, said) = outcome(&mut derive(&blocked, "pendulum.yaml"));
    assert_eq!(code, Some(1));
    assert!(said.contains("set HOME or XDG_CACHE_HOME"), "{said}");
    let (code, said) = outcome(derive(&blocked, "pendulum.yaml").env("XDG_CACHE_HOME", &folder));
    assert_eq!((code, said.as_str()), (Some(0), ""));
}

#[test]
fn a_worker_alone_says_who_runs_it() {
    let output = lamc().arg("worker").stdin(Stdio::null()).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("is run by other commands"));
    // What is no model, and one that is cut off.
    for bytes in [&b"\x01\xff\xff\xff\xff\xff\xff\xff\xff"[..], b"\x01\x04\0\0\0\0\0\0\0abcd", b"x"]
    {
        let mut child =
            lamc().arg("worker").stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        child.stdin.take().unwrap().write_all(bytes).unwrap();
        let (code, said) = told(&child.wait_with_output().unwrap());
        assert!(code == Some(1) && said.starts_with("error: "), "{said}");
    }
}
