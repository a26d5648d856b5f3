//! Faults that the fuzzer found (`tests/fuzz`): texts that once made lamc panic, or write a text
//! that it could not read.

use std::fs;

use lamc::source::{SourceFile, parse, to_yaml};
use lamc_tests::workspace;

#[test]
fn texts_that_once_failed_are_read_or_refused() {
    let mut count = 0;
    for entry in fs::read_dir(workspace().join("tests/fuzz/regressions")).unwrap() {
        let path = entry.unwrap().path();
        let bytes = fs::read(&path).unwrap();
        let file = SourceFile {
            path: path.display().to_string(),
            text: String::from_utf8(bytes).unwrap(),
        };
        count += 1;
        match parse(&file) {
            Ok((model, warnings)) => {
                let _ = warnings.render(&file, false);
                let again = SourceFile { path: "again.yaml".into(), text: to_yaml(&model) };
                if let Err(problems) = parse(&again) {
                    panic!("{}:\n{}", path.display(), problems.render(&again, false));
                }
            }
            Err(problems) => assert!(problems.render(&file, false).contains("error[")),
        }
    }
    assert!(count > 0, "there are no regressions");
}
