//! Files that are written: which, where, and which never.

use std::fs;
use std::path::Path;
use std::process::Stdio;

use super::common::{example, files, folder, lamc, run, text};

/// Links are followed, devices stay devices.
#[cfg(unix)]
#[test]
fn what_is_no_plain_file_stays_what_it_is() {
    let (_guard, folder) = folder();
    let (link, target) = (folder.join("link.csv"), folder.join("target.csv"));
    fs::write(&target, "old").ok();
    std::os::unix::fs::symlink(&target, &link).ok();
    let write = |path: &Path| {
        let path = path.display().to_string();
        run(&["simulate", &example("pendulum.yaml"), "--duration", "0.05", "--csv", &path])
    };
    assert_eq!(write(&link).status.code(), Some(0));
    assert!(fs::symlink_metadata(&link).is_ok_and(|data| data.is_symlink()));
    assert!(fs::read_to_string(&target).unwrap_or_default().starts_with("t [s]"));
    assert_eq!(write(Path::new("/dev/full")).status.code(), Some(1));
    let missing = write(&folder.join("nowhere").join("out.csv"));
    assert_eq!(missing.status.code(), Some(1));
    assert_eq!(files(&folder).len(), 2);
}

/// Said before the work, not after it.
#[test]
fn where_nothing_can_be_written() {
    let (_guard, folder) = folder();
    let locked = folder.join("nowhere/m.npz").display().to_string();
    for (path, reason) in
        [(locked.as_str(), "there is no folder"), (&folder.display().to_string(), "directory")]
    {
        let begin = std::time::Instant::now();
        let long = ["simulate", &example("sixbar.yaml"), "--duration", "10000", "--rate", "1"];
        let output = run(&[&long[..], &["--npz", path]].concat());
        assert_eq!(output.status.code(), Some(1));
        assert!(text(&output.stderr).contains(reason), "{}", text(&output.stderr));
        assert!(begin.elapsed().as_secs() < 20);
    }
    assert!(files(&folder).is_empty());
}

#[test]
fn outputs_are_what_their_names_say_and_apart() {
    let (_guard, folder) = folder();
    let at = |name: &str| folder.join(name).display().to_string();
    let model = example("pendulum.yaml");
    let (one, avi, jpg) = (at("one.csv"), at("one.avi"), at("one.jpg"));
    for arguments in [
        &["simulate", &model, "--csv", "-", "--plot", "-"][..],
        &["simulate", &model, "--csv", &one, "--npz", &one],
        &["simulate", &model, "--video", &avi],
        &["simulate", &model, "--png", &jpg],
        &["fit", &model, "--data", &one, "--free", "damping", "--plot", &jpg],
        &["mocap", &one, "--model", &model, "--plot", &jpg],
        &["hinge", "family", &one, "--name", "a b", "--output", &jpg],
        &["hinge", "family", &one, "--name", "beam", "--output", &jpg],
    ] {
        let output = run(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", text(&output.stderr));
    }
    assert!(files(&folder).is_empty());
}

/// By what it is, not by how it is written.
#[cfg(unix)]
#[test]
fn no_output_takes_the_place_of_another_file() {
    use std::os::unix::fs::symlink;

    let (_guard, folder) = folder();
    let at = |name: &str| folder.join(name);
    fs::copy(example("pendulum.yaml"), at("s.yaml")).unwrap();
    fs::write(at("run.csv"), "t [s],q.hinge [rad]\n0,0.1\n1,0.2\n").unwrap();
    symlink("s.yaml", at("link.yaml")).unwrap();
    symlink("link.yaml", at("linked.yaml")).unwrap();
    fs::hard_link(at("s.yaml"), at("hard.yaml")).unwrap();
    symlink("later", at("one.svg")).unwrap();
    symlink("one.svg", at("two")).unwrap();
    symlink("s.yaml", at("3.png")).unwrap();
    fs::create_dir(at("sub")).unwrap();
    symlink(".", at("here")).unwrap();
    let before = files(&folder).len();
    let [model, run] = ["s.yaml", "run.csv"].map(|name| fs::read(at(name)).unwrap());
    let swing = ["--inertia", "1kg*m^2", "--mass", "1kg", "--arm", "1m"];
    for (arguments, names) in [
        (&["s.yaml", "-o", "s.yaml"][..], ["--output s.yaml", "the model s.yaml"]),
        (&["s.yaml", "-o", "sub/../s.yaml"], ["--output sub/../s.yaml", "the model s.yaml"]),
        (&["s.yaml", "-o", "here/s.yaml"], ["--output here/s.yaml", "the model s.yaml"]),
        (&["linked.yaml", "--c", "a.c", "--header", "s.yaml"], ["--header s.yaml", "the model"]),
        (&["s.yaml", "-o", "a.rs", "--fmu", "./a.rs"], ["--fmu ./a.rs", "--output a.rs"]),
        (&["simulate", "s.yaml", "--csv", "linked.yaml"], ["--csv linked.yaml", "s.yaml"]),
        (&["simulate", "s.yaml", "--npz", "hard.yaml"], ["--npz hard.yaml", "s.yaml"]),
        (&["simulate", "s.yaml", "--view", "./s.yaml"], ["--view ./s.yaml", "s.yaml"]),
        (&["simulate", "s.yaml", "--csv", "a", "--npz", "./a"], ["--npz ./a", "--csv a"]),
        (&["simulate", "s.yaml", "--csv", "a", "--npz", "here/a"], ["--npz here/a", "--csv a"]),
        (&["simulate", "s.yaml", "--csv", "two", "--plot", "one.svg"], ["--plot", "--csv two"]),
        (&["simulate", "s.yaml", "--csv", "later", "--npz", "two"], ["--npz two", "--csv later"]),
        (&["simulate", "s.yaml", "--csv", "-", "--view", "-"], ["--view -", "--csv -"]),
        (&["simulate", "s.yaml", "--png", "#.png"], ["--png #.png", "the model s.yaml"]),
        (&["simulate", "s.yaml", "--png", "p##.png", "--plot", "p07.png"], ["--png", "--plot"]),
        (
            &["fit", "s.yaml", "--data", "run.csv", "--csv", "./run.csv", "--free", "damping"],
            ["--csv ./run.csv", "--data run.csv"],
        ),
        (
            &["fit", "s.yaml", "--data", "run.csv", "--csv", "s.yaml", "--free", "damping"],
            ["--csv s.yaml", "the model s.yaml"],
        ),
        (
            &["mocap", "run.csv", "--model", "s.yaml", "--output", "run.csv"],
            ["--output run.csv", "the quaternions run.csv"],
        ),
        (
            &["mocap", "s.yaml", "--model", "link.yaml", "--synthesize", "1"],
            ["the quaternions s.yaml", "the model link.yaml"],
        ),
        (
            &["hinge", "family", "run.csv", "--name", "a", "--output", "run.csv"],
            ["--output run.csv", "the table run.csv"],
        ),
        (
            &[&["hinge", "fit", "run.csv", "--csv", "run.csv"][..], &swing].concat(),
            ["--csv run.csv", "the swing run.csv"],
        ),
        (&["import", "s.yaml", "-o", "link.yaml"], ["--output link.yaml", "the design s.yaml"]),
        (&["fit", "-", "--data", "-", "--free", "damping"], ["the model and --data", "input"]),
    ] {
        let output = lamc().args(arguments).current_dir(&folder).output().unwrap();
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(names.iter().all(|name| said.contains(name)), "{arguments:?}: {said}");
    }
    // Where standard streams come from and go to.
    let read = fs::File::open(at("s.yaml")).unwrap();
    let mut piped = lamc();
    piped.args(["-", "-o", "link.yaml"]).current_dir(&folder).stdin(read);
    let piped = piped.output().unwrap();
    assert_eq!(piped.status.code(), Some(2), "{}", text(&piped.stderr));
    let write = fs::File::options().append(true).open(at("s.yaml")).unwrap();
    let mut printed = lamc();
    printed.args(["simulate", "s.yaml", "--csv", "-"]).current_dir(&folder);
    let printed = printed.stdout(write).stderr(Stdio::piped()).output().unwrap();
    assert_eq!(printed.status.code(), Some(2), "{}", text(&printed.stderr));
    for (name, bytes) in [("s.yaml", &model), ("run.csv", &run)] {
        assert_eq!(fs::read(at(name)).unwrap(), *bytes);
    }
    assert_eq!(files(&folder).len(), before);
    // What writes nothing overwrites nothing.
    let check = ["s.yaml", "-o", "s.yaml", "--check"];
    let check = lamc().args(check).current_dir(&folder).output().unwrap();
    assert!(check.status.code() == Some(1) && text(&check.stderr).contains("out of date"));
    // A link to nothing is followed, and others of a series are not in its way.
    let apart = ["simulate", "s.yaml", "--duration", "0.05", "--csv", "two", "--png", "x#.png"];
    let apart = lamc().args(apart).args(["--plot", "xy.png"]).current_dir(&folder).output();
    let apart = apart.unwrap();
    assert_eq!(apart.status.code(), Some(0), "{}", text(&apart.stderr));
    assert!(fs::symlink_metadata(at("one.svg")).unwrap().is_symlink() && at("later").is_file());
    assert!(at("x0.png").is_file() && at("x1.png").is_file() && at("xy.png").is_file());
}
