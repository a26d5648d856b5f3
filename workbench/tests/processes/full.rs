//! File systems without room, and those that may only be read. Each is a small one in memory, in a mount namespace of
//! its own (`unshare` of util-linux), so that no rights of an administrator are needed.

use std::path::Path;
use std::process::{Command, Output};

use super::common::{folder, text};
use super::outputs::{ALL, Written};

/// Runs a command in a folder with such a file system; the shell has made it ready, and looks at it afterwards.
fn within(written: &Written, options: &str, before: &str, after: &str) -> Output {
    let (_guard, folder) = folder();
    let command = written.command(&folder);
    let script = format!(
        "mount -t tmpfs -o {options} none \"$PWD\" && cd \"$PWD\" && {before} && {{ \"$0\" \"$@\"; code=$?; {after}; exit $code; }}"
    );
    let mut shell = Command::new("unshare");
    shell.args(["--map-root-user", "--mount", "sh", "-c", &script]).arg(command.get_program());
    shell.args(command.get_args()).current_dir(&folder);
    for (name, value) in command.get_envs() {
        match value {
            Some(value) => shell.env(name, value),
            None => shell.env_remove(name),
        };
    }
    shell.output().unwrap_or_else(|error| panic!("unshare: {error}"))
}

/// Whether a command has failed because of this, and has said so of one of its files.
fn failed(written: &Written, output: &Output, reasons: &[&str]) {
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{:?}: {said}", written.arguments);
    let named = written.files.iter().any(|name| said.contains(&format!("cannot write {name}: ")));
    assert!(
        named && reasons.iter().any(|reason| said.contains(reason)),
        "{:?}: {said}",
        written.arguments
    );
}

#[test]
fn a_full_file_system() {
    for written in &ALL {
        let olds: Vec<_> =
            written.files.iter().map(|name| format!("echo as it was > {name}")).collect();
        let before = format!(
            "{} && {{ head -c 1000000 /dev/zero > fill 2> /dev/null || true; }}",
            olds.join(" && ")
        );
        let output = within(written, "size=64k", &before, "echo; echo \"== $(ls -A)\" && cat m.*");
        failed(written, &output, &["no storage space", "No space left"]);
        // The files are as they were, and there is no other.
        let out = text(&output.stdout);
        let (_, there) = out.split_once("== ").unwrap();
        assert!(there.starts_with("fill\n") && !there.contains(".lamc-"), "{there}");
        assert_eq!(
            there.matches("as it was\n").count(),
            written.files.iter().filter(|name| name.starts_with("m.")).count()
        );
    }
}

#[test]
fn a_file_system_that_may_only_be_read() {
    for written in &ALL {
        let output = within(written, "ro", "true", "ls -A");
        failed(written, &output, &["ead-only"]);
    }
}

/// Neither a cache nor temporary files are needed.
#[test]
fn no_room_for_a_cache() {
    let (_guard, folder) = folder();
    let run = |options: &str, fill: &str| {
        let script = format!(
            "mount -t tmpfs -o {options} none \"$PWD\" && cd \"$PWD\" && {fill}; exec \"$0\" check \"$1\""
        );
        let mut shell = Command::new("unshare");
        shell.args(["--map-root-user", "--mount", "sh", "-c", &script]);
        shell.arg(env!("CARGO_BIN_EXE_lamc")).arg(super::common::example("fourbar.yaml"));
        shell.env("TMPDIR", &folder).current_dir(&folder);
        shell.env("XDG_CACHE_HOME", Path::new(&folder)).env_remove("XDG_RUNTIME_DIR");
        shell.output().unwrap()
    };
    let whole = run("size=1m", "true");
    assert_eq!(whole.status.code(), Some(0), "{}", text(&whole.stderr));
    let full =
        run("size=64k", "mkdir -p symbolica/locks && { head -c 40000 /dev/zero > fill; true; }");
    assert_eq!(full.stdout, whole.stdout, "{}", text(&full.stderr));
    // The engine needs a file there.
    let output = run("ro", "true");
    assert_eq!(output.status.code(), Some(1));
    assert!(
        text(&output.stderr).contains("set HOME or XDG_CACHE_HOME"),
        "{}",
        text(&output.stderr)
    );
}
