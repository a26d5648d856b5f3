//! Build scripts: the files that `lamc::Config` writes, and its errors.

use std::fs;
use std::path::Path;

use lamc::{BuildError, Config, Precision, Tunable};

fn example(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(name).display().to_string()
}

#[test]
fn modules_are_named_after_their_files_and_left_alone_when_unchanged() {
    let folder = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
    let config = Config::new().precision(Precision::F32).out_dir(folder.path());
    let models = ["pendulum.yaml", "fourbar.yaml"].map(example);
    let paths = config.compile_all(&models).unwrap_or_else(|error| panic!("{error}"));
    let names: Vec<_> =
        paths.iter().map(|path| path.file_name().and_then(|n| n.to_str())).collect();
    assert_eq!(names, [Some("pendulum.rs"), Some("fourbar.rs")]);
    let text = fs::read_to_string(&paths[0]).unwrap_or_default();
    assert!(text.contains("--scalar f32") && text.contains("pub struct Pendulum"), "{text}");
    let time = |path: &Path| fs::metadata(path).and_then(|data| data.modified()).ok();
    let before = time(&paths[0]);
    config.compile(&models[0]).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(time(&paths[0]), before, "an unchanged module was written again");
    let tunable = config.tunable([Tunable::Stiffness, Tunable::Mass]);
    let path = tunable.compile(&models[1]).unwrap_or_else(|error| panic!("{error}"));
    let text = fs::read_to_string(path).unwrap_or_default();
    assert!(text.contains("stiffness_crank_hinge") && text.contains("mass_coupler"), "{text}");
}

#[test]
fn headers_and_cuts() {
    let folder = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
    let config = Config::new().extern_c(true).cut(["ground_west"]).out_dir(folder.path());
    let path = config.compile(example("sixbar.yaml")).unwrap_or_else(|error| panic!("{error}"));
    let text = fs::read_to_string(&path).unwrap_or_default();
    assert!(text.contains("--extern-c --cut ground_west") && text.contains("fn sixbar_step_rk4("));
    let header = fs::read_to_string(path.with_extension("h")).unwrap_or_default();
    assert!(header.contains("int sixbar_step_rk4(double *t, double q[6]"), "{header}");
    let wrong = Config::new().cut(["ground_wst"]).out_dir(folder.path());
    let Err(error) = wrong.compile(example("sixbar.yaml")) else { panic!("cut at no joint") };
    assert!(error.to_string().contains("did you mean `ground_west`?"), "{error}");
}

#[test]
fn the_limit_of_hinges_can_be_moved() {
    let folder = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
    let compile = |most: usize| {
        let config = Config::new().max_hinges(most).out_dir(folder.path());
        config.compile(example("triple_pendulum.yaml"))
    };
    let Err(error) = compile(2) else { panic!("three hinges are not two") };
    assert!(error.to_string().contains("3 hinges are more than the 2"), "{error}");
    assert!(compile(3).is_ok());
}

#[test]
fn failures_read_well_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
    let wrong = folder.path().join("wrong.yaml");
    fs::write(&wrong, "bodies: { a: { fixed: true } }\njonts: {}\n").ok();
    let config = Config::new().out_dir(folder.path());
    let Err(error) = config.compile(&wrong) else { panic!("a wrong model was compiled") };
    // The text that cargo shows for an error returned by `main`.
    let report = format!("{error:?}");
    assert!(report.contains("wrong.yaml:2:1\n") && report.contains("joints"), "{report}");
    assert!(matches!(config.compile(folder.path().join("none.yaml")), Err(BuildError::Read(_))));
    let nowhere = Config::new().out_dir(folder.path().join("nowhere"));
    let outcome = nowhere.compile(example("pendulum.yaml"));
    assert!(matches!(outcome, Err(BuildError::Write { .. })), "{outcome:?}");
    assert_eq!(fs::read_dir(folder.path()).map(Iterator::count).unwrap_or(0), 1);
}
