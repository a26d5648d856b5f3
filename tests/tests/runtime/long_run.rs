//! A motion of the six-bar over a minute, at 1 kHz.

use lamc_generated::sixbar::Sixbar;
use lamc_runtime::{Mechanism, Rk4, State};
use lamc_tests::compare::{keep_largest, largest};

/// Closure within 1e-9 of the size all the while, and energy lost to the dampers but for 1e-6 of
/// what there was to lose.
#[test]
fn sixty_seconds_at_a_kilohertz() {
    const DAMPING: f64 = 3.5e-6;
    let robot = Sixbar::<f64>::default();
    let mut state = robot.assembled().unwrap();
    let mut rk4 = Rk4::new(&robot);
    let total = |state: &State<[f64; 6], f64>| {
        let energy = robot.energy(state.t, &state.q, &state.u);
        energy.kinetic + energy.potential
    };
    let power = |state: &State<[f64; 6], f64>| -> f64 {
        DAMPING * state.u.iter().map(|u| u * u).sum::<f64>()
    };
    let begin = total(&state);
    let (mut lost, mut worst_balance, mut worst_closure) = (0.0, 0.0_f64, 0.0_f64);
    let mut lowest = begin;
    for _ in 0..30_000 {
        // Two steps, by Simpson's rule.
        let start = power(&state);
        rk4.step(&robot, &mut state, 1e-3).unwrap();
        let middle = power(&state);
        rk4.step(&robot, &mut state, 1e-3).unwrap();
        lost += 1e-3 / 3.0 * (start + 4.0 * middle + power(&state));
        let open = largest(robot.closure(&state.q).residual);
        worst_closure = keep_largest(worst_closure, open / robot.size());
        worst_balance = keep_largest(worst_balance, (total(&state) + lost - begin).abs());
        lowest = lowest.min(total(&state));
    }
    let budget = begin - lowest;
    println!(
        "closure {worst_closure:e} of the size; balance {worst_balance:e} J of {budget:e} J lost"
    );
    assert!(worst_closure < 1e-9, "{worst_closure:e}");
    assert!(worst_balance < 1e-6 * budget, "{worst_balance:e} J of {budget:e} J");
    // It has come to rest.
    assert!(state.u.iter().all(|u| u.abs() < 1e-2), "{:?}", state.u);
}
