//! Motions that break off keep what is done.

use std::fs;
use std::io::{Cursor, Read};
use std::process::{Command, Stdio};

use super::common::{SWING, example, files, folder, lamc, run, text};

/// An interrupt keeps what has been simulated, whole, and says so.
#[cfg(unix)]
#[test]
fn an_interrupt_keeps_what_is_done() {
    let (_guard, folder) = folder();
    let (model, csv) = (folder.join("swing.yaml"), folder.join("m.csv"));
    // It never comes to rest.
    fs::write(&model, SWING.replace("TORQUE", "0").replace(", damping: 4e-6", "")).ok();
    let child = lamc()
        .args(["simulate", &model.display().to_string(), "--duration", "1e6", "--rate", "1"])
        .args(["--initial", "hinge=1", "--csv", &csv.display().to_string()])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap_or_else(|error| panic!("{error}"));
    std::thread::sleep(std::time::Duration::from_secs(3));
    assert_eq!(files(&folder), ["swing.yaml"], "a file before its time");
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(kill.is_ok_and(|status| status.success()));
    let output = child.wait_with_output().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("interrupted"), "{}", text(&output.stdout));
    assert_eq!(files(&folder).len(), 2);
    let table = fs::read_to_string(&csv).unwrap_or_default();
    let columns = table.lines().next().map_or(0, |header| header.split(',').count());
    let lines = table.lines().count();
    assert!(lines > 2 && lines < 1_000_000 && table.ends_with('\n'), "{lines} lines");
    assert!(table.lines().all(|line| line.split(',').count() == columns));
}

/// A six-bar of which two joints are held and one is driven beyond where its loop lets it.
#[test]
fn a_failure_keeps_what_is_done() {
    let (_guard, folder) = folder();
    let at = |name: &str| folder.join(name).display().to_string();
    let six = fs::read_to_string(example("sixbar.yaml")).unwrap();
    let (before, joint) = six.split_once("  ground_west:").unwrap();
    let drive = joint.replacen("limits: [-180, 180]", "drive: \"-0.5 - t\"", 1);
    let drive = drive.replacen("stiffness: 0.0114, damping: 3.5e-06, ", "", 1);
    fs::write(at("six.yaml"), format!("{before}  ground_west:{drive}")).unwrap();
    let names = ["m.csv", "m.npz", "m.svg", "m.html", "m.png", "m.mp4"].map(at);
    let [csv, npz, plot, view, png, video] = &names;
    let simulate = |duration: &str| {
        let held = ["--lock", "west_south_west=-40deg", "--lock", "south_east_east=35deg"];
        let output = ["--csv", csv, "--npz", npz, "--plot", plot, "--view", view, "--png", png];
        let output = [&output[..], &["--video", video, "--size", "64x48"]].concat();
        let what = ["simulate", &at("six.yaml"), "--duration", duration, "--rate", "20"];
        run(&[&what[..], &held, &output].concat())
    };
    let is_complete = || {
        let archive = zip::ZipArchive::new(Cursor::new(fs::read(npz).unwrap()));
        let mut bytes = Vec::new();
        archive.unwrap().by_name("complete.npy").unwrap().read_to_end(&mut bytes).unwrap();
        let page = fs::read_to_string(view).unwrap();
        let says = |complete: bool| page.contains(&format!("\"complete\":{complete}"));
        assert!(says(true) != says(false));
        assert_eq!(bytes.last(), Some(&u8::from(says(true))));
        says(true)
    };
    let last = || {
        let table = fs::read_to_string(csv).unwrap();
        let columns = table.lines().next().map_or(0, |header| header.split(',').count());
        assert!(table.ends_with('\n') && table.lines().all(|l| l.split(',').count() == columns));
        let row = table.lines().next_back().unwrap();
        row.split(',').next().and_then(|t| t.parse::<f64>().ok()).unwrap()
    };
    let whole = simulate("1");
    assert_eq!(whole.status.code(), Some(0), "{}", text(&whole.stderr));
    assert!(is_complete() && last() == 1.0);
    names.iter().for_each(|name| fs::remove_file(name).unwrap());
    let broken = simulate("5");
    let (said, shown) = (text(&broken.stderr), text(&broken.stdout));
    assert_eq!(broken.status.code(), Some(1), "{said}");
    assert!(said.contains("t = 1.5") && said.contains("`ground_west`"), "{said}");
    assert!(shown.contains("failed: what was written ends at t = 1.5 s"), "{shown}");
    assert!(!is_complete() && last() == 1.5);
    assert!(fs::read(video).unwrap().len() > 1000 && fs::read(png).unwrap().starts_with(b"\x89"));
    assert_eq!(files(&folder).len(), 7);
}

#[test]
fn a_failure_before_the_first_sample_writes_nothing() {
    let (_guard, folder) = folder();
    let at = |name: &str| folder.join(name).display().to_string();
    fs::write(at("m.yaml"), SWING.replace("TORQUE", "1e-3/t")).unwrap();
    let failed = run(&["simulate", &at("m.yaml"), "--csv", &at("m.csv"), "--npz", &at("m.npz")]);
    assert_eq!(failed.status.code(), Some(1));
    let said = text(&failed.stderr);
    assert!(said.contains("`hinge`") && said.contains("t = 0 s"), "{said}");
    assert_eq!(files(&folder), ["m.yaml"]);
}
