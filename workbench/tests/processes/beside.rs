//! Commands that write the same file at the same time.

use std::fs;
use std::process::Stdio;

use super::common::{example, files, folder, lamc, text};

/// Processes at a time.
const TOGETHER: usize = 6;

#[test]
fn the_file_is_that_of_one_of_them() {
    let (_guard, folder) = folder();
    let write = |model: &str, file: &str| {
        let mut command = lamc();
        command.args([&example(model), "-o", file]).current_dir(&folder);
        command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let models = ["sixbar.yaml", "fourbar.yaml"];
    let wholes = models.map(|model| {
        assert!(write(model, "whole.rs").wait().unwrap().success());
        fs::read(folder.join("whole.rs")).unwrap()
    });
    for _ in 0..5 {
        let running: Vec<_> = (0..TOGETHER).map(|k| write(models[k % 2], "m.rs")).collect();
        for process in running {
            let output = process.wait_with_output().unwrap();
            assert!(output.status.success(), "{}", text(&output.stderr));
            let found = fs::read(folder.join("m.rs")).unwrap();
            assert!(wholes.contains(&found), "{} bytes", found.len());
        }
    }
    let mut there = files(&folder);
    there.sort();
    assert_eq!(there, ["m.rs", "whole.rs"]);
}
