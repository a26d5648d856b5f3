//! Throughput of lanes beside that of the scalar module: the table of `docs/LANES.md`.
//!
//! `cargo run --release -p lamc-generated --features simd --example lanes`, with
//! `RUSTFLAGS="-C target-cpu=native"`.

use std::hint::black_box;
use std::time::Instant;

use lamc_generated::{
    fourbar::Fourbar, pendulum::Pendulum, sixbar::Sixbar, triple_pendulum::TriplePendulum,
};
use lamc_runtime::{Arithmetic, Batch, LaneError, Lanes, Mechanism, Rk4, State, f32x8, f64x4};

fn main() -> Result<(), LaneError> {
    println!(
        "| mechanism | lanes | acceleration alone, ns | in a lane | ratio | step alone | in a lane | ratio |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    row::<f64x4, Pendulum<_>, _>("pendulum", "4 of `f64`")?;
    row::<f64x4, TriplePendulum<_>, _>("triple pendulum", "4 of `f64`")?;
    row::<f64x4, Fourbar<_>, _>("four-bar", "4 of `f64`")?;
    row::<f64x4, Sixbar<_>, _>("six-bar", "4 of `f64`")?;
    row::<f32x8, Sixbar<_>, _>("six-bar", "8 of `f32`")
}

/// A line of the table, for states along a motion.
fn row<V: Lanes, B, const N: usize>(name: &str, lanes: &str) -> Result<(), LaneError>
where
    B: Batch<V, Coordinates = [V; N], Speeds = [V; N]> + Default,
    B::Lane: Mechanism<Scalar = V::Number, Coordinates = [V::Number; N], Speeds = [V::Number; N]>,
{
    let (batch, dt) = (B::default(), V::Number::from_f64(1e-4));
    let mut states = batch.assembled()?;
    for count in 0..V::COUNT {
        for _ in 0..50 {
            batch.step(&mut states, dt)?;
        }
        let state = states.lane(0);
        (count..V::COUNT).for_each(|lane| states.set_lane(lane, &state));
    }
    let one = batch.lane(0);
    let alone: Vec<State<[V::Number; N], V::Number>> =
        (0..V::COUNT).map(|lane| states.lane(lane)).collect();
    let mut rk4 = Rk4::new(&one);
    let accelerations = medians(
        || {
            for state in &alone {
                let _ = black_box(one.acceleration(state.t, black_box(&state.q), &state.u));
            }
        },
        || {
            let _ = black_box(batch.acceleration(states.t, black_box(&states.q), &states.u));
        },
    );
    let steps = medians(
        || {
            for state in &alone {
                let mut state = black_box(*state);
                let _ = black_box(rk4.step(&one, &mut state, dt));
            }
        },
        || {
            let mut states = black_box(states);
            let _ = black_box(batch.step(&mut states, dt));
        },
    );
    let cells = [accelerations, steps].map(|[alone, together]| {
        let each = 1e9 / V::COUNT as f64;
        format!("{:.0} | {:.0} | {:.2}", alone * each, together * each, alone / together)
    });
    println!("| {name} | {lanes} | {} |", cells.join(" | "));
    Ok(())
}

/// Seconds a call takes, the median of each, measured in turn.
fn medians(mut first: impl FnMut(), mut second: impl FnMut()) -> [f64; 2] {
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..101 {
        times[0].push(time(&mut first));
        times[1].push(time(&mut second));
    }
    times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    })
}

fn time(call: &mut impl FnMut()) -> f64 {
    const CALLS: u32 = 500;
    let begin = Instant::now();
    (0..CALLS).for_each(|_| call());
    begin.elapsed().as_secs_f64() / f64::from(CALLS)
}
