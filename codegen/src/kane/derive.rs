//! The derivation, which runs all phases in order.
//!
//! A phase is a type whose constructor takes the phases that it needs, so the compiler checks the
//! order.

use super::articulated::ArticulatedBodies;
use super::binder::{Binder, Label};
use super::closure::Closure;
use super::energy::Energy;
use super::equations::{Elimination, Equations, Leaf, Reduced};
use super::forces::GeneralizedForces;
use super::frame::Frames;
use super::independent::{IndependentSpeeds, Phases};
use super::inertia::Inertias;
use super::inverse::{Given, InverseDynamics};
use super::kinematics::Kinematics;
use super::loads::Loads;
use super::mass::MassMatrix;
use super::outputs::Outputs;
use crate::source::Diagnostics;
use crate::symbolic::{self, Algebra, SessionError};
use crate::topology::Topology;

/// The reason why no equations could be derived.
#[derive(Debug, thiserror::Error)]
pub enum DeriveError {
    /// The symbolic engine could not be started.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// A formula of the model is undefined.
    #[error("{0}")]
    Model(Diagnostics),
}

/// Derives the equations of motion.
///
/// # Errors
/// Returns an error if the symbolic engine cannot be started, or if a formula of the model divides by
/// zero or is not finite for all values of what it depends on.
pub fn derive(topology: &Topology) -> Result<Equations, DeriveError> {
    symbolic::session(|algebra| equations(topology, algebra))?.map_err(DeriveError::Model)
}

fn equations(
    topology: &Topology,
    algebra: &mut Algebra<Leaf, Label>,
) -> Result<Equations, Diagnostics> {
    let b = &mut Binder::new(topology, algebra);
    let frames = Frames::new(topology);
    let inertias = Inertias::new(b, &frames);
    let kinematics = Kinematics::new(b, &frames);
    let loads = Loads::new(b, &kinematics, &inertias);
    let forces = GeneralizedForces::new(b, &kinematics, &loads);
    let mass = MassMatrix::new(b, &kinematics, &inertias);
    let energy = Energy::new(b, &kinematics, &inertias, &loads);
    let closure = Closure::new(b, &kinematics);
    let outputs = Outputs::new(b, &kinematics);
    let given = Given::new(b, &closure);
    let inverse = InverseDynamics::new(b, &kinematics, &inertias, &loads, &closure, &given);
    let bodies = ArticulatedBodies::new(b, &kinematics, &inertias, &loads, &closure, &given);
    let reduction = topology.reduction.as_ref().filter(|_| topology.loops.len() > 1);
    let phases =
        Phases { frames: &frames, kinematics: &kinematics, loads: &loads, closure: &closure };
    let reduced = reduction.map(|reduction| IndependentSpeeds::new(b, &phases, reduction));
    let problems = b.problems();
    if problems.has_errors() {
        return Err(problems);
    }
    Ok(Equations {
        topology: topology.clone(),
        mass: b.trees(mass.entries()),
        forcing: b.trees(&forces.forcing),
        jacobian: b.trees(&closure.jacobian),
        gamma: b.trees(&closure.gamma),
        elimination: Elimination {
            inverse_pivots: b.trees(&bodies.inverse_pivots),
            reduced: b.trees(&bodies.reduced),
            reduced_rows: b.trees(&bodies.reduced_rows),
            accelerations: b.trees(&bodies.accelerations),
        },
        reduced: reduced.map(|reduced| Reduced {
            accelerations: b.trees(&reduced.accelerations),
            positions: b.trees(&reduced.positions),
            speeds: b.trees(&reduced.speeds),
            margin: b.trees(&reduced.margin),
        }),
        row_residual: b.trees(&closure.row_residual),
        row_velocity: b.trees(&closure.row_velocity),
        residual: b.trees(&closure.residual),
        residual_jacobian: b.trees(&closure.residual_jacobian),
        poses: b.trees(&outputs.poses),
        points: b.trees(&outputs.points),
        drives: b.trees(&outputs.drives),
        imbalance: b.trees(&inverse.imbalance),
        opening: b.trees(&inverse.opening),
        reactions: b.trees(&inverse.reactions),
        kinetic_energy: b.tree(&energy.kinetic),
        potential_energy: b.tree(&energy.potential),
        bindings: b.bindings(),
        facts: b.facts(),
    })
}
