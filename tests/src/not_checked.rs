//! How all tests report a program that is not installed. Crates below this one include the file by its path.

use std::process::Command;

/// Says that a check needs something that this machine does not have.
///
/// # Panics
/// In continuous integration (`CI` is set), where everything must be checked: `tests/needs` installs it.
pub fn not_checked(what: &str) {
    assert!(std::env::var_os("CI").is_none(), "not checked: {what}");
    eprintln!("NOT CHECKED: {what}");
}

/// Returns whether a command succeeds here. If it does not, the check is reported as left out.
///
/// # Panics
/// As [`not_checked`].
pub fn is_there(program: &str, arguments: &[&str], what: &str) -> bool {
    let output = Command::new(program).args(arguments).output();
    let found = output.is_ok_and(|output| output.status.success());
    if !found {
        not_checked(&format!("{what}: `{program} {}` does not work", arguments.join(" ")));
    }
    found
}
