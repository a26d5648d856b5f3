//! What a free base costs: the time of an acceleration of the six-bar with a fixed and with a free base, in turns.
//! `bash tests/peers/bench` writes the modules; `cargo bench --bench cost` runs this. A time is the median of the rounds,
//! and the ratio is the median of the rounds' ratios.

#[path = "../src/uniform.rs"]
#[allow(dead_code, reason = "a benchmark uses its part")]
mod uniform;

/// In a macro, so that these files are not looked for before they are written.
macro_rules! modules {
    ($($module:ident $path:literal),+) => {
        $(
            #[allow(dead_code, reason = "not all of a module is measured")]
            #[path = $path]
            mod $module;
        )+
    };
}

modules! {
    sixbar "../../target/peers/bench/sixbar.rs",
    free_sixbar "../../target/peers/bench/free_sixbar.rs"
}

use std::hint::black_box;
use std::time::Instant;

use lamc_runtime::{Mechanism, StateOf, project};
use uniform::Random;

const ROUNDS: usize = 61;
const STATES: usize = 64;
/// Calls of every state in a round, which takes some two milliseconds.
const PASSES: usize = 50;

/// Closed states in motion near the assembled one.
fn states<M: Mechanism<Scalar = f64>>(model: &M) -> Vec<StateOf<M>> {
    let mut random = Random::new(2026);
    let mut workspace = model.workspace();
    let mut state = || {
        let mut state = model.assembled().expect("the example closes");
        let mut step = state.u.clone();
        step.as_mut().iter_mut().for_each(|step| *step = random.range(-0.2, 0.2));
        model.advance(state.q.as_mut(), step.as_ref());
        state.u.as_mut().iter_mut().for_each(|u| *u = random.range(-1.0, 1.0));
        let (q, u) = (state.q.as_mut(), state.u.as_mut());
        project(model, 0.0, q, u, workspace.as_mut()).expect("it projects");
        state
    };
    (0..STATES).map(|_| state()).collect()
}

/// Nanoseconds per call of one batch.
fn batch(mut call: impl FnMut(usize)) -> f64 {
    let start = Instant::now();
    for _ in 0..PASSES {
        (0..STATES).for_each(&mut call);
    }
    start.elapsed().as_secs_f64() * 1e9 / (PASSES * STATES) as f64
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() {
    let fixed = sixbar::Sixbar::default();
    let free = free_sixbar::Sixbar::default();
    let (of_fixed, of_free) = (states(&fixed), states(&free));
    let fixed = |k: usize| {
        let state = black_box(&of_fixed[k]);
        black_box(fixed.acceleration(0.0, &state.q, &state.u).expect("it is regular"));
    };
    let free = |k: usize| {
        let state = black_box(&of_free[k]);
        black_box(free.acceleration(0.0, &state.q, &state.u).expect("it is regular"));
    };
    let mut times = [Vec::new(), Vec::new()];
    for round in 0..ROUNDS {
        let first = round % 2;
        for which in [first, 1 - first] {
            times[which].push(if which == 0 { batch(fixed) } else { batch(free) });
        }
    }
    let ratios = times[0].iter().zip(&times[1]).map(|(fixed, free)| free / fixed).collect();
    let [fixed, free] = times.map(median);
    println!("fixed {fixed:.0} ns, free {free:.0} ns, ratio {:.2}", median(ratios));
}
