//! What is found in the cache, what is not, and how much it holds.

use lamc::pipeline;
use lamc::source::{EditError, SourceFile, SourceModel};
use tempfile::TempDir;

use super::*;

const PENDULUM: &str = "
bodies:
  base: { fixed: true }
  rod: { mass: 2 g, com: [0, -0.02, 0], inertia: [[3e-7, 0, 0], [0, 1e-9, 0], [0, 0, 3e-7]] }
joints:
  hinge: { bodies: [base, rod], axis: [[0, 0], [1, 0]], stiffness: 1e-3, damping: 4e-6 }
";

fn cache(most_bytes: u64) -> (TempDir, Cache) {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::at(folder.path().join("models"), most_bytes).unwrap();
    (folder, cache)
}

fn file(text: &str) -> SourceFile {
    SourceFile { path: "models/pendulum.yaml".to_owned(), text: text.to_owned() }
}

/// Asks for what is derived from a model: it, and whether it had to be derived.
fn ask(cache: &Cache, file: &SourceFile) -> (Derived, bool) {
    ask_edited(cache, file, |_| Ok(()))
}

fn ask_edited(
    cache: &Cache,
    file: &SourceFile,
    edit: impl FnOnce(&mut SourceModel) -> Result<(), EditError>,
) -> (Derived, bool) {
    let read = pipeline::read(file, edit).unwrap();
    let mut is_derived = false;
    let derived = cache.derived(&read, || read.derive(|_, _| is_derived = true)).unwrap();
    (derived, is_derived)
}

/// The entries, the one that was not used for longest first.
fn entries(cache: &Cache) -> Vec<PathBuf> {
    let entries = fs::read_dir(&cache.folder).unwrap().flatten();
    let mut entries: Vec<_> =
        entries.map(|it| (it.metadata().unwrap().modified().unwrap(), it.path())).collect();
    entries.sort();
    entries.into_iter().map(|(_, path)| path).collect()
}

#[test]
fn a_model_is_derived_once() {
    let (_folder, cache) = cache(MOST_BYTES);
    let (first, is_derived) = ask(&cache, &file(PENDULUM));
    assert!(is_derived);
    let (second, is_derived) = ask(&cache, &file(PENDULUM));
    assert!(!is_derived);
    assert_eq!(format!("{first:?}"), format!("{second:?}"));
    assert_eq!(entries(&cache).len(), 1);
}

#[test]
fn what_changes_the_model_is_derived_anew() {
    let (_folder, cache) = cache(MOST_BYTES);
    let is_new = |text: &str, path: &str| {
        ask(&cache, &SourceFile { path: path.to_owned(), text: text.to_owned() }).1
    };
    assert!(is_new(PENDULUM, "a.yaml"));
    // The folder is in no result.
    assert!(!is_new(PENDULUM, "models/a.yaml"));
    assert!(is_new(PENDULUM, "b.yaml"));
    assert!(is_new(&PENDULUM.replace("1e-3", "1.0000000000000002e-3"), "a.yaml"));
    assert!(is_new(&format!("{PENDULUM}# a comment\n"), "a.yaml"));
    let lock = |angle: f64| {
        let model = SourceFile { path: "a.yaml".to_owned(), text: PENDULUM.to_owned() };
        ask_edited(&cache, &model, |model| model.lock("hinge", angle)).1
    };
    assert!(lock(0.0) && lock(0.5) && !lock(0.5));
    // Another build of lamc.
    let other = Cache { compiler: [1; 32], ..cache.clone() };
    assert!(ask(&other, &file(PENDULUM)).1);
}

#[test]
fn damaged_entries_are_replaced() {
    let (_folder, cache) = cache(MOST_BYTES);
    ask(&cache, &file(PENDULUM));
    let [path] = &entries(&cache)[..] else { panic!("one entry") };
    let whole = fs::read(path).unwrap();
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    let mut older = whole.clone();
    older[8] ^= 1;
    // As another file system might leave it after a crash.
    let zeros = vec![0; whole.len()];
    let longer = [&whole[..], b"\0"].concat();
    for damaged in [&whole[..whole.len() / 2], &flipped, &older, &zeros, &longer, b""] {
        fs::write(path, damaged).unwrap();
        assert!(ask(&cache, &file(PENDULUM)).1);
        assert_eq!(fs::read(path).unwrap(), whole);
    }
    // The entry of another model.
    ask(&cache, &file(&PENDULUM.replace("1e-3", "2e-3")));
    let others = entries(&cache).into_iter().find(|other| other != path).unwrap();
    fs::copy(others, path).unwrap();
    assert!(ask(&cache, &file(PENDULUM)).1);
}

#[test]
fn the_entries_that_were_not_used_for_longest_go_first() {
    let (_folder, all) = cache(MOST_BYTES);
    let models: Vec<SourceFile> =
        (1..5).map(|k| file(&PENDULUM.replace("1e-3", &format!("{k}e-3")))).collect();
    ask(&all, &models[0]);
    let bytes = fs::metadata(&entries(&all)[0]).unwrap().len();
    // A process that was killed left this.
    let half = all.folder.join(".lamc-half");
    fs::write(&half, vec![0; bytes as usize / 2]).unwrap();
    let long_ago = SystemTime::now() - std::time::Duration::from_secs(3600);
    File::options().append(true).open(&half).unwrap().set_modified(long_ago).unwrap();
    let three = Cache { most_bytes: 3 * bytes + bytes / 4, ..all };
    ask(&three, &models[1]);
    assert!(half.exists());
    // The first is used again.
    assert!(!ask(&three, &models[0]).1);
    ask(&three, &models[2]);
    assert!(!half.exists() && entries(&three).len() == 3);
    ask(&three, &models[3]);
    assert_eq!(entries(&three).len(), 3);
    assert!(!ask(&three, &models[0]).1);
    assert!(!ask(&three, &models[3]).1);
    assert!(ask(&three, &models[1]).1);
    let none = Cache { most_bytes: bytes / 2, ..three };
    let before = entries(&none);
    assert!(ask(&none, &file(&PENDULUM.replace("1e-3", "9e-3"))).1);
    assert_eq!(entries(&none), before);
}

#[test]
fn a_folder_that_cannot_be_used_is_no_error() {
    let (folder, _) = cache(MOST_BYTES);
    let blocked = folder.path().join("file");
    fs::write(&blocked, "").unwrap();
    let cache = Cache::at(blocked.join("models"), MOST_BYTES).unwrap();
    assert!(ask(&cache, &file(PENDULUM)).1);
    assert!(ask(&cache, &file(PENDULUM)).1);
    // A folder is where the entry would be.
    let cache = Cache::at(folder.path().join("models"), MOST_BYTES).unwrap();
    let model = file(PENDULUM);
    let key = cache.key(&pipeline::read(&model, |_| Ok(())).unwrap());
    fs::create_dir_all(cache.path(&key)).unwrap();
    assert!(ask(&cache, &model).1);
}
