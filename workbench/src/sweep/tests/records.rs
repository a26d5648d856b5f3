//! What is recorded of a run, against closed forms of one hinge.

use arrow_array::RecordBatch;
use arrow_array::cast::AsArray as _;
use arrow_array::types::Float64Type;
use arrow_select::concat::concat_batches;
use bytes::Bytes;
use lamc::arithmetic::larger;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

use super::*;

/// All rows of a sweep.
fn rows(model: &str, plan: &str) -> RecordBatch {
    let model = compiled(model);
    let sweep = sweep(&model, plan, Shard::ALL);
    let parts = (0..sweep.parts()).map(|part| {
        let part = sweep.part(part, &model.1, &|| false).unwrap().unwrap();
        let reader = ParquetRecordBatchReaderBuilder::try_new(Bytes::from(part.bytes)).unwrap();
        reader.build().unwrap().next().unwrap().unwrap()
    });
    let parts: Vec<_> = parts.collect();
    concat_batches(&parts[0].schema(), &parts).unwrap()
}

fn column(rows: &RecordBatch, name: &str) -> Vec<Option<f64>> {
    let column = rows.column_by_name(name).unwrap_or_else(|| panic!("no column `{name}`"));
    column.as_primitive::<Float64Type>().iter().collect()
}

fn numbers(rows: &RecordBatch, name: &str) -> Vec<f64> {
    column(rows, name).into_iter().map(|cell| cell.expect("a number")).collect()
}

/// q and u of I q'' + b q' + k q = torque from rest at `start`, underdamped.
fn swing(k: f64, b: f64, torque: f64, start: f64, t: f64) -> [f64; 2] {
    let (rest, decay) = (torque / k, b / (2.0 * INERTIA));
    let frequency = (k / INERTIA - decay * decay).sqrt();
    let (sin, cos) = (frequency * t).sin_cos();
    let amplitude = (start - rest) * (-decay * t).exp();
    let q = rest + amplitude * (cos + decay / frequency * sin);
    [q, -amplitude * (frequency + decay * decay / frequency) * sin]
}

const SWINGS: &str = "
    grid: { k: [0.5e-3, 2e-3], b: [1e-5, 3e-5], initial.hinge: [-0.3, 0.4], input.motor: [0, 1e-4] }
    record: [end, extremes, settling, energy, motion]
    duration: 2 s
    rate: 500 Hz
    tolerance: 1e-11";

#[test]
fn motions_are_those_of_the_closed_form() {
    let rows = rows(ROD, SWINGS);
    assert_eq!(rows.num_rows(), 16);
    let of = |name: &str| numbers(&rows, name);
    let values = ["k", "b", "input.motor", "initial.hinge"].map(of);
    let runs = (0..rows.num_rows()).map(|row| (row, values.each_ref().map(|column| column[row])));
    for (row, [k, b, torque, start]) in runs {
        let samples: Vec<[f64; 2]> = (0..=1000)
            .map(|sample| swing(k, b, torque, start, f64::from(sample) / 500.0))
            .collect();
        let near = |name: &str, expected: f64| {
            let found = of(name)[row];
            assert!(
                (found - expected).abs() < 1e-7 * (1.0 + expected.abs()),
                "{name}: {found}, {expected}"
            );
        };
        let [q, u] = samples[1000];
        near("q.hinge", q);
        near("u.hinge", u);
        let all =
            |pick: &dyn Fn(&[f64; 2]) -> f64| samples.iter().map(pick).reduce(larger).unwrap();
        near("q_max.hinge", all(&|sample| sample[0]));
        near("q_min.hinge", -all(&|sample| -sample[0]));
        near("u_max.hinge", all(&|sample| sample[1].abs()));
        near("kinetic_start", 0.0);
        near("potential_start", 0.5 * k * start * start);
        near("kinetic", 0.5 * INERTIA * u * u);
        near("potential", 0.5 * k * q * q);
        near("tip.x", 0.0);
        near("tip.y", -0.03 * q.cos());
        near("tip.z", -0.03 * q.sin());
        let away = |sample: &[f64; 2]| (sample[0] - torque / k).abs();
        let last = samples.iter().rposition(|sample| away(sample) > 0.02 * all(&away)).unwrap();
        near("settling_time", (last + 1) as f64 / 500.0);
        let series = |name: &str| {
            let list = rows.column_by_name(name).unwrap().as_list::<i32>().value(row);
            list.as_primitive::<Float64Type>().values().to_vec()
        };
        let [t, q, u] = ["motion.t", "motion.q.hinge", "motion.u.hinge"].map(series);
        assert_eq!((t.len(), q.len(), u.len(), t[250]), (1001, 1001, 1001, 0.5));
        for (sample, (q, u)) in samples.iter().zip(q.iter().zip(&u)) {
            assert!((sample[0] - q).abs() + 1e-2 * (sample[1] - u).abs() < 1e-7);
        }
    }
}

#[test]
fn a_motion_that_has_not_settled_has_no_time_to_settle() {
    let times = column(
        &rows(
            ROD,
            "{ grid: { b: [0, 1e-6, 3e-5] }, record: [settling], duration: 1 s, rate: 1 kHz }",
        ),
        "settling_time",
    );
    assert_eq!([times[0], times[1]], [None, None]);
    assert!(times[2].is_some());
}

#[test]
fn equilibria_and_frequencies_are_those_of_the_closed_form() {
    let rows = rows(
        ROD,
        "{ task: equilibrium, grid: { k: [0.5e-3, 2e-3], input.motor: [0, 1e-4] }, record: [end, frequencies] }",
    );
    let [k, torque, q] = ["k", "input.motor", "q.hinge"].map(|name| numbers(&rows, name));
    let series = rows.column_by_name("frequencies").unwrap().as_list::<i32>().clone();
    for row in 0..4 {
        assert!((q[row] - torque[row] / k[row]).abs() < 1e-12);
        let expected = (k[row] / INERTIA).sqrt() / std::f64::consts::TAU;
        let found = series.value(row).as_primitive::<Float64Type>().value(0);
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} is not {expected}");
    }
    assert!(rows.column_by_name("stable").unwrap().as_boolean().iter().all(|it| it == Some(true)));
}

#[test]
fn a_run_that_fails_has_its_reason_and_no_numbers() {
    let plan = "{ grid: { initial.hinge: [0.4, 2.0], b: [4e-6, -4e-6] }, duration: 10 ms }";
    let rows = rows(ROD, plan);
    let text = |name: &str| {
        let texts = rows.column_by_name(name).unwrap().as_string::<i32>();
        texts.iter().map(|it| it.map(str::to_owned)).collect::<Vec<_>>()
    };
    let failures = text("failure");
    assert_eq!(failures[0], None);
    assert!(failures[1].as_ref().is_some_and(|it| it.contains("damping")), "{failures:?}");
    assert!(
        failures[2].as_ref().is_some_and(|it| it.contains("outside its limits")),
        "{failures:?}"
    );
    for (failure, q) in failures.iter().zip(column(&rows, "q.hinge")) {
        assert_eq!(failure.is_some(), q.is_none());
    }
    assert_eq!(numbers(&rows, "initial.hinge"), [0.4, 0.4, 2.0, 2.0]);
}
