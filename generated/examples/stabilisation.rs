//! Drift and cost of the ways to keep a loop closed: the six-bar for ten seconds.
//!
//! `cargo run --release -p lamc-generated --example stabilisation` prints the table of
//! `docs/STABILISATION.md`.

use std::time::Instant;

use lamc_generated::sixbar::Sixbar;
use lamc_runtime::{Mechanism, Rk4, Stabilisation, State};

const DAMPING: f64 = 3.5e-6;
const DURATION: f64 = 10.0;

fn main() -> Result<(), lamc_runtime::Error> {
    let robot = Sixbar::<f64>::default();
    let start = robot.assembled()?;
    println!(
        "| step | kept closed by | open by, of the size | energy balance, of what is lost | us per step |"
    );
    println!("|---|---|---|---|---|");
    for step in [1e-3, 2e-3, 4e-3] {
        for (name, stabilisation) in [
            ("projection", Stabilisation::Projection),
            ("Baumgarte", Stabilisation::Baumgarte),
            ("nothing", Stabilisation::Off),
        ] {
            let found = run(&robot, start, step, stabilisation)?;
            println!(
                "| {:.0} ms | {name} | {:.1e} | {:.1e} | {:.2} |",
                step * 1e3,
                found.open,
                found.balance,
                found.cost
            );
        }
    }
    Ok(())
}

struct Found {
    open: f64,
    balance: f64,
    cost: f64,
}

fn run(
    robot: &Sixbar<f64>,
    start: State<[f64; 6], f64>,
    step: f64,
    stabilisation: Stabilisation,
) -> Result<Found, lamc_runtime::Error> {
    let total = |state: &State<[f64; 6], f64>| {
        let energy = robot.energy(state.t, &state.q, &state.u);
        energy.kinetic + energy.potential
    };
    let power = |state: &State<[f64; 6], f64>| DAMPING * state.u.iter().map(|u| u * u).sum::<f64>();
    let mut rk4 = Rk4::new(robot);
    rk4.stabilisation = stabilisation;
    let mut state = start;
    let (mut open, mut balance, mut lost, mut lowest) = (0.0_f64, 0.0_f64, 0.0, total(&start));
    let steps = (DURATION / step) as usize / 2;
    for _ in 0..steps {
        let begin = power(&state);
        rk4.step(robot, &mut state, step)?;
        let middle = power(&state);
        rk4.step(robot, &mut state, step)?;
        // Simpson's rule.
        lost += step / 3.0 * (begin + 4.0 * middle + power(&state));
        let residual = robot.closure(&state.q).residual;
        open = residual.iter().fold(open, |most, r| larger(most, r.abs()));
        balance = larger(balance, (total(&state) + lost - total(&start)).abs());
        lowest = lowest.min(total(&state));
    }
    // Again, for the time alone.
    let mut state = start;
    let begin = Instant::now();
    for _ in 0..2 * steps {
        rk4.step(robot, &mut state, step)?;
    }
    let cost = begin.elapsed().as_secs_f64() * 1e6 / (2 * steps) as f64;
    Ok(Found { open: open / robot.size(), balance: balance / (total(&start) - lowest), cost })
}

/// The larger of two numbers; NaN if one of them is NaN, as no motion that got lost is a good one.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}
