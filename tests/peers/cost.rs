//! What a free base costs, and what a drawing costs whose lengths are parameters: the times of an acceleration of two
//! modules, in turns. `bash tests/peers/bench` writes the modules; `cargo bench --bench cost` runs this. A time is the median of the rounds,
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
    free_sixbar "../../target/peers/bench/free_sixbar.rs",
    plates "../../target/peers/bench/sixbar_plates.rs",
    fixed_plates "../../target/peers/bench/fixed_plates.rs"
}

use std::hint::black_box;
use std::time::Instant;

use lamc_runtime::{Mechanism, StateOf, acceleration, project};
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

/// Compares two modules.
fn compare<A, B>([name_a, name_b]: [&str; 2], a: &A, b: &B)
where
    A: Mechanism<Scalar = f64>,
    B: Mechanism<Scalar = f64>,
{
    let (of_a, of_b) = (states(a), states(b));
    let mut times = [Vec::new(), Vec::new()];
    for round in 0..ROUNDS {
        let first = round % 2;
        for which in [first, 1 - first] {
            times[which].push(if which == 0 { time(a, &of_a) } else { time(b, &of_b) });
        }
    }
    let ratios = times[0].iter().zip(&times[1]).map(|(a, b)| b / a).collect();
    let [a, b] = times.map(median);
    println!("{name_a} {a:.0} ns, {name_b} {b:.0} ns, ratio {:.2}", median(ratios));
}

/// Nanoseconds of an acceleration.
fn time<M: Mechanism<Scalar = f64>>(model: &M, states: &[StateOf<M>]) -> f64 {
    let (mut rates, mut workspace) = (model.speeds(), model.workspace());
    batch(|k| {
        let StateOf::<M> { t, q, u } = black_box(&states[k]);
        let out = rates.as_mut();
        acceleration(model, *t, q.as_ref(), u.as_ref(), workspace.as_mut(), out)
            .expect("it is regular");
        black_box(out);
    })
}

fn main() {
    let (fixed, free) = (sixbar::Sixbar::default(), free_sixbar::Sixbar::default());
    compare(["fixed base", "free base"], &fixed, &free);
    let fixed = fixed_plates::SixbarPlates::default();
    let plates = plates::SixbarPlates::default();
    compare(["fixed lengths", "lengths as parameters"], &fixed, &plates);
}
