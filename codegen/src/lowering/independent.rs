//! Functions that solve for independent speeds, and those that the runtime needs to do so.

use super::functions::function;
use crate::kane::{Equations, Reduced, Terms};
use crate::program::{Function, FunctionKind};
use crate::symbolic::Tree;

/// The solution for independent speeds.
pub fn reduced(equations: &Equations, reduced: &Reduced, kind: FunctionKind) -> Function {
    let n = equations.mechanism().speeds();
    match kind {
        FunctionKind::Acceleration => {
            let accelerations = reduced.accelerations.as_slice();
            let margin = ("margin", 3, 1, reduced.margin.as_slice());
            function(equations, kind, &[("acceleration", n, 1, accelerations), margin])
        }
        _ => {
            let residual = ("residual", equations.residual.len(), 1, equations.residual.as_slice());
            let positions = ("positions", n, 1, reduced.positions.as_slice());
            let speeds = ("speeds", n, 1, reduced.speeds.as_slice());
            let margin = ("margin", 3, 1, reduced.projection_margin.as_slice());
            function(equations, kind, &[residual, positions, speeds, margin])
        }
    }
}

/// What the runtime needs to solve for independent speeds.
pub fn terms(equations: &Equations, terms: &Terms, kind: FunctionKind) -> Function {
    let n = equations.mechanism().speeds();
    let branches = terms.pattern.branches.len();
    let projects = kind == FunctionKind::ProjectionReduction;
    let momenta = if projects { &terms.projection_momenta } else { &terms.momenta };
    let mut axes = terms.axes.clone();
    for (axis, momentum) in axes.chunks_mut(6).zip(momenta.chunks(6)) {
        // Where nothing moves with a hinge, as with one that closes a loop, nobody asks how it moves.
        if momentum.iter().all(|part| matches!(part, Tree::Rational(0, _))) {
            axis.clone_from_slice(momentum);
        }
    }
    let mut outputs: Vec<(_, _, _, &[_])> = vec![
        ("axes", branches, 6, &axes),
        ("momenta", branches, 6, momenta),
        ("rotors", branches, 1, &terms.rotors),
        ("closure", terms.closure.len(), 1, &terms.closure),
    ];
    if projects {
        outputs.push(("residual", equations.residual.len(), 1, &equations.residual));
        outputs.push(("row_residual", terms.row_residual.len(), 1, &terms.row_residual));
        outputs.push(("row_velocity", terms.row_velocity.len(), 1, &terms.row_velocity));
    } else {
        outputs.push(("opening", terms.opening.len(), 1, &terms.opening));
        outputs.push(("forces", n, 1, &terms.forces));
    }
    function(equations, kind, &outputs)
}
