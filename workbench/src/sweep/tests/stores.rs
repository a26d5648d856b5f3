//! The file: the same bytes whoever computes it, also in pieces and after interruptions.

use std::fs;
use std::path::Path;
use std::sync::atomic::AtomicU64;

use tempfile::tempdir;

use super::*;

const PLAN: &str = "
    vary: { initial.crank_rocker: { uniform: 1deg } }
    samples: { count: 150, method: latin_hypercube }
    duration: 20 ms
    record: [end, energy, motion]";

/// The model's own joint for [`PLAN`].
fn model() -> (Arc<Compiled>, Jit) {
    compiled(FOURBAR)
}

fn begun(sweep: &Sweep, file: &Path, resumes: bool) -> Store {
    match sweep.open(file, resumes).unwrap() {
        Opened::Begun(store) => store,
        Opened::Complete => panic!("it is complete"),
    }
}

fn whole(model: &(Arc<Compiled>, Jit), file: &Path, threads: usize, shard: Shard) -> Vec<u8> {
    let sweep = sweep(model, &plan(model), shard);
    let store = begun(&sweep, file, false);
    let (mut runs, parts) = (0, store.missing());
    sweep.execute(&parts, threads, &model.1, &store, || false, |part| runs += part.runs).unwrap();
    assert_eq!(runs as u64, sweep.runs());
    store.join().unwrap();
    fs::read(file).unwrap()
}

/// The plan, with the name of a joint of the model.
fn plan(model: &(Arc<Compiled>, Jit)) -> String {
    PLAN.replace("crank_rocker", &model.1.interface().joints[0].name)
}

#[test]
fn threads_interruptions_and_resumption_change_no_byte() {
    let (folder, model) = (tempdir().unwrap(), model());
    let at = |name: &str| folder.path().join(name);
    let expected = whole(&model, &at("one.parquet"), 1, Shard::ALL);
    assert!(whole(&model, &at("two.parquet"), 2, Shard::ALL) == expected);
    let sweep = sweep(&model, &plan(&model), Shard::ALL);
    let file = at("pieces.parquet");
    for patience in [0, 40, 2000, u64::MAX] {
        let store = begun(&sweep, &file, file.with_extension("parquet.parts").exists());
        let asked = AtomicU64::new(0);
        let is_interrupted = || asked.fetch_add(1, Ordering::Relaxed) >= patience;
        let missing = store.missing();
        sweep.execute(&missing, 2, &model.1, &store, is_interrupted, |_| ()).unwrap();
        assert!(!file.exists());
        if patience == u64::MAX {
            store.join().unwrap();
        }
    }
    assert!(fs::read(&file).unwrap() == expected);
    assert!(matches!(sweep.open(&file, true), Ok(Opened::Complete)));
}

#[test]
fn a_part_that_is_damaged_or_missing_is_computed_again() {
    let (folder, model) = (tempdir().unwrap(), model());
    let expected = whole(&model, &folder.path().join("whole.parquet"), 2, Shard::ALL);
    let file = folder.path().join("damaged.parquet");
    let sweep = sweep(&model, &plan(&model), Shard::ALL);
    let store = begun(&sweep, &file, false);
    let parts = store.missing();
    sweep.execute(&parts, 2, &model.1, &store, || false, |_| ()).unwrap();
    drop(store);
    let part =
        |part: usize| file.with_extension("parquet.parts").join(format!("{part:08}.parquet"));
    let bytes = fs::read(part(1)).unwrap();
    fs::write(part(1), &bytes[..bytes.len() / 2]).unwrap();
    fs::remove_file(part(3)).unwrap();
    fs::write(part(2), "").unwrap();
    let store = begun(&sweep, &file, true);
    assert_eq!(store.missing(), [1, 2, 3]);
    sweep.execute(&[1, 2, 3], 2, &model.1, &store, || false, |_| ()).unwrap();
    store.join().unwrap();
    assert!(fs::read(&file).unwrap() == expected);
}

#[test]
fn what_is_of_another_sweep_is_not_resumed() {
    let (folder, model) = (tempdir().unwrap(), model());
    let file = folder.path().join("out.parquet");
    let plan = plan(&model);
    let first = sweep(&model, &plan, Shard::ALL);
    let store = begun(&first, &file, false);
    let refused = |sweep: &Sweep, resumes: bool| {
        sweep.open(&file, resumes).map(|_| ()).unwrap_err().to_string()
    };
    assert!(refused(&first, true).contains("another process"), "{}", refused(&first, true));
    drop(store);
    assert!(refused(&first, false).contains("--resume"));
    let longer = plan.replace("20 ms", "30 ms");
    for other in [(longer.as_str(), Shard::ALL), (&plan, Shard { index: 1, of: 2 })] {
        let other = sweep(&model, other.0, other.1);
        assert!(refused(&other, true).contains("another sweep"), "{}", refused(&other, true));
    }
    // A comment changes nothing.
    let commented = format!("# the same\n{plan}");
    begun(&sweep(&model, &commented, Shard::ALL), &file, true);
}

#[test]
fn shards_have_the_rows_of_the_whole() {
    use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
    let (folder, model) = (tempdir().unwrap(), model());
    let rows = |bytes: Vec<u8>| {
        let reader = ParquetRecordBatchReaderBuilder::try_new(bytes::Bytes::from(bytes)).unwrap();
        reader.with_batch_size(1 << 20).build().unwrap().map(Result::unwrap).collect::<Vec<_>>()
    };
    let all = rows(whole(&model, &folder.path().join("all.parquet"), 2, Shard::ALL));
    let mut begin = 0;
    for index in 1..=4 {
        let file = folder.path().join(format!("{index}.parquet"));
        let [shard] = &rows(whole(&model, &file, 1, Shard { index, of: 4 }))[..] else { panic!() };
        assert_eq!(*shard, all[0].slice(begin, shard.num_rows()));
        begin += shard.num_rows();
    }
    assert_eq!(begin, 150);
}
