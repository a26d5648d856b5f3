//! Sheets of many speeds that leave the flat state, where all their vertices are singular: accelerations along the branch of
//! Miura-ori, which do not depend on how near to flat it is.

use lamc::program::Interpreter;
use lamc_runtime::{Mechanism, acceleration_in_motion, assemble};
use lamc_tests::compare::largest;
use lamc_tests::sheets::miura;
use lamc_tests::{compile_text, relative_error};

/// Distance from flat, rad, of the accelerations that the others are compared with.
const BESIDE: f64 = 1e-4;

#[test]
fn a_sheet_passes_the_flat_state_along_its_branch() {
    let compiled = compile_text(&miura(6, 6));
    let system = Interpreter::new(&compiled.program);
    let decomposed = Interpreter::new(&compiled.program.without_reduction());
    let mut branch: Vec<f64> = system.initial().q.iter().map(|q| BESIDE * q).collect();
    let pinned = vec![false; branch.len()];
    assemble(&system, 0.0, &mut branch, &pinned, &mut system.workspace()).unwrap();
    let size = largest(&branch);
    branch.iter_mut().for_each(|q| *q /= size);
    let accelerated = |system: &Interpreter, distance: f64, speed: f64| {
        let [q, u] = [distance, speed].map(|share| branch.iter().map(|x| share * x).collect());
        let (q, u): (Vec<f64>, Vec<f64>) = (q, u);
        let (mut found, mut workspace) = (system.speeds(), system.workspace());
        let constraint =
            acceleration_in_motion(system, 0.0, &q, &u, &mut workspace, &mut found).unwrap();
        (constraint.rank, found)
    };
    let rank = compiled.topology.rank;
    for speed in [1.0, 1e-4, 0.0] {
        let (_, expected) = accelerated(&system, BESIDE, speed);
        for distance in [1e-5, 1e-6, 1e-7, 1e-8, 1e-12, 0.0] {
            let (found_rank, found) = accelerated(&system, distance, speed);
            let error = relative_error(&found, &expected);
            println!("{distance:e} rad, {speed:e} rad/s: {error:.1e}");
            if speed > 0.0 || distance >= 1e-7 {
                assert_eq!(found_rank, rank, "at {distance:e} rad, {speed:e} rad/s");
                // The acceleration changes with the angle by some such share.
                assert!(error < BESIDE, "at {distance:e} rad, {speed:e} rad/s: {error:e}");
            } else {
                // At rest and flat, rows that follow from others elsewhere do not.
                let (flat_rank, expected) = accelerated(&decomposed, distance, speed);
                assert_eq!((found_rank, found), (flat_rank, expected), "at {distance:e} rad");
                assert!(flat_rank < rank, "{flat_rank} rows");
            }
        }
    }
}
