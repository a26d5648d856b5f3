//! The inputs of the fuzzer (`tests/fuzz`): those that it kept because each reaches other code, and those that
//! once failed. Each must be read or refused, and what is read must be written and read again.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use lamc_tests::workspace;

#[path = "../../fuzz/src/corpus.rs"]
mod corpus;
#[path = "../../fuzz/src/targets/mod.rs"]
mod targets;

/// An input that takes longer is a fault; the fuzzer has the same limit.
const LONGEST: Duration = Duration::from_secs(2);

/// Runs a target on inputs, each with its name, and returns what is wrong.
fn failures(target: targets::Target, inputs: &[(String, Vec<u8>)]) -> Vec<String> {
    let mut failures = Vec::new();
    for (name, input) in inputs {
        let begin = Instant::now();
        if catch_unwind(AssertUnwindSafe(|| target(input))).is_err() {
            failures.push(format!("{name} panics: {}", corpus::line(input)));
        }
        if begin.elapsed() > LONGEST {
            failures.push(format!("{name} takes {:?}", begin.elapsed()));
        }
    }
    failures
}

fn kept(path: &Path) -> Vec<(String, Vec<u8>)> {
    let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{path:?}: {error}"));
    let named = |(number, line)| {
        let name = format!("{}:{}", path.display(), number + 1);
        let input = corpus::input(line).unwrap_or_else(|| panic!("{name} is no input"));
        assert_eq!(corpus::line(&input), line, "{name}");
        (name, input)
    };
    text.lines().enumerate().map(named).collect()
}

#[test]
fn inputs_that_the_fuzzer_kept_are_read_or_refused() {
    let mut wrong = Vec::new();
    for (name, target) in targets::TARGETS {
        let inputs = kept(&workspace().join(format!("tests/fuzz/corpus/{name}.txt")));
        assert!(inputs.len() >= 20, "{name} has only {} inputs", inputs.len());
        wrong.extend(failures(target, &inputs));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn inputs_that_once_failed_are_read_or_refused() {
    let (mut wrong, mut count) = (Vec::new(), 0);
    for entry in fs::read_dir(workspace().join("tests/fuzz/regressions")).unwrap() {
        let folder = entry.unwrap().path();
        let name = folder.file_name().unwrap().to_str().unwrap();
        let target = targets::TARGETS.iter().find(|(known, _)| *known == name);
        let (_, target) = target.unwrap_or_else(|| panic!("there is no target {name}"));
        let files = fs::read_dir(&folder).unwrap().map(|file| file.unwrap().path());
        let inputs: Vec<_> =
            files.map(|file| (file.display().to_string(), fs::read(&file).unwrap())).collect();
        count += inputs.len();
        wrong.extend(failures(*target, &inputs));
    }
    assert!(count > 0, "there are no regressions");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
