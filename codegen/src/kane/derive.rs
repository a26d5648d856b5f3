//! The derivation, which runs all phases in order.
//!
//! A phase is a type whose constructor takes the phases that it needs, so the compiler checks the
//! order.

use lamc_runtime::plumbing::{ReductionSizes, may_be_reduced};

use super::articulated::ArticulatedBodies;
use super::binder::{Binder, Label};
use super::closure::Closure;
use super::contact::Gaps;
use super::energy::Energy;
use super::equations::{Elimination, Equations, GapTrees, Leaf, Reduced, Terms};
use super::forces::GeneralizedForces;
use super::frame::Frames;
use super::independent::{self, IndependentSpeeds, Parts, Phases};
use super::inertia::Inertias;
use super::inverse::{Given, InverseDynamics};
use super::kinematics::Kinematics;
use super::loads::Loads;
use super::mass::MassMatrix;
use super::momentum::Momentum;
use super::outputs::Outputs;
use crate::laminate::Geometry;
use crate::source::{Diagnostics, JointId};
use crate::symbolic::{self, Algebra, Expr, SessionError};
use crate::topology::{Reduction, Topology};

/// Entries of J up to which its rows are reduced one by one although independent speeds are known.
const MOST_ROW_ENTRIES: usize = 600;

/// Joints of a tree on free bodies up to which the reduction is tried: its cost grows as their third power.
const MOST_FREE_JOINTS: usize = 12;

/// Products of two entries of N for the same joint above which the runtime forms N^T M N in loops: straight-line code
/// outgrows the caches. Yoshimura's pattern of 4 x 4 pairs of triangles has 1,800, and is as fast either way; that of 4 x 5 has
/// 3,300.
const MOST_PAIRS: usize = 2_500;

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

/// Derives the equations of motion. `geometry` has the numbers of the drawing that depend on parameters.
///
/// # Errors
/// Returns an error if the symbolic engine cannot be started, or if a formula of the model divides by
/// zero or is not finite for all values of what it depends on.
pub fn derive(topology: &Topology, geometry: &Geometry) -> Result<Equations, DeriveError> {
    symbolic::session(|algebra| equations(topology, geometry, algebra))?.map_err(DeriveError::Model)
}

fn equations(
    topology: &Topology,
    geometry: &Geometry,
    algebra: &mut Algebra<Leaf, Label>,
) -> Result<Equations, Diagnostics> {
    let b = &mut Binder::new(topology, geometry, algebra);
    let frames = Frames::new(topology, geometry);
    let inertias = Inertias::new(b, &frames);
    let kinematics = Kinematics::new(b, &frames);
    let loads = Loads::new(b, &kinematics, &inertias);
    let forces = GeneralizedForces::new(b, &kinematics, &loads);
    let mass = MassMatrix::new(b, &kinematics, &inertias);
    let energy = Energy::new(b, &kinematics, &inertias, &loads);
    let momentum = momentum(b, &kinematics, &inertias);
    let (closure, outputs) = (Closure::new(b, &kinematics), Outputs::new(b, &kinematics));
    let (control, given) = (control(b, &outputs), Given::new(b, &closure));
    let inverse = InverseDynamics::new(b, &kinematics, &inertias, &loads, &closure, &given);
    let phases = Phases {
        frames: &frames,
        kinematics: &kinematics,
        inertias: &inertias,
        loads: &loads,
        closure: &closure,
    };
    let (reduced, terms) = independent(b, &phases);
    let by_rows = reduced.as_ref().map_or(terms.is_none(), |_| by_rows(topology, &closure));
    let elimination = by_rows.then(|| elimination(b, &phases, &given));
    defined(b)?;
    Ok(Equations {
        topology: topology.clone(),
        is_parametric: !geometry.is_fixed(),
        mass: b.trees(mass.entries()),
        forcing: b.trees(&forces.forcing),
        jacobian: b.trees(&closure.jacobian),
        gamma: b.trees(&closure.gamma),
        elimination,
        reduced,
        terms,
        row_residual: b.trees(&closure.row_residual),
        row_velocity: b.trees(&closure.row_velocity),
        residual: b.trees(&closure.residual),
        residual_jacobian: b.trees(&closure.residual_jacobian),
        poses: b.trees(&outputs.poses),
        points: b.trees(&outputs.points),
        contacts: b.trees(loads.contacts().outputs()),
        gaps: gaps(b, &loads.contacts().gaps),
        drives: b.trees(&outputs.drives),
        imbalance: b.trees(&inverse.imbalance),
        opening: b.trees(&inverse.opening),
        reactions: b.trees(&inverse.reactions),
        momentum: momentum.map(|components| b.trees(&components)),
        control: control.map(|parts| parts.map(|part| b.trees(&part))),
        kinetic_energy: b.tree(&energy.kinetic),
        potential_energy: b.tree(&energy.potential),
        bindings: b.bindings(),
        facts: b.facts(),
    })
}

/// Derives the solution body by body.
fn elimination(binder: &mut Binder, phases: &Phases, given: &Given) -> Elimination {
    let Phases { kinematics, inertias, loads, closure, .. } = phases;
    ArticulatedBodies::new(binder, kinematics, inertias, loads, closure, given).elimination(binder)
}

/// Derives the momenta of a mechanism with free bodies.
fn momentum(
    binder: &mut Binder,
    kinematics: &Kinematics,
    inertias: &Inertias,
) -> Option<Vec<Expr>> {
    let is_free = !binder.topology().mechanism.free.is_empty();
    is_free.then(|| Momentum::new(binder, kinematics, inertias).components)
}

/// Derives what the controllers remember and command.
fn control(binder: &mut Binder, outputs: &Outputs) -> Option<[Vec<Expr>; 2]> {
    let controllers = &binder.topology().mechanism.controllers;
    if controllers.is_empty() {
        return None;
    }
    binder.know_points(&outputs.points);
    let (mut next, mut commands) = (Vec::new(), Vec::new());
    for controller in controllers {
        for memory in &controller.memory {
            let what = format!("{}_{}", controller.name, memory.name);
            next.push(binder.formula(&memory.next, &what, Some(memory.span)));
        }
        for command in &controller.commands {
            let input = &binder.mechanism().inputs[command.input.index()];
            let what = format!("{}_{input}", controller.name);
            commands.push(binder.formula(&command.value, &what, Some(command.span)));
        }
    }
    Some([next, commands])
}

fn gaps(binder: &mut Binder, gaps: &Gaps) -> GapTrees {
    GapTrees {
        gap: binder.trees(&gaps.gap),
        friction: binder.trees(&gaps.friction),
        normal: binder.trees(&gaps.normal),
        velocity: binder.trees(&gaps.velocity),
    }
}

/// Returns the errors in the formulas of the model, if there are any.
fn defined(binder: &mut Binder) -> Result<(), Diagnostics> {
    let problems = binder.problems();
    if problems.has_errors() { Err(problems) } else { Ok(()) }
}

/// Derives the solution for independent speeds or, for many of them and for driven joints, its parts: for mechanisms of
/// several loops or with free bodies. Joints with limits are driven while they are held there, and next to the singular states of many
/// speeds the runtime goes on where straight-line code ends, so that both are derived.
fn independent(binder: &mut Binder, phases: &Phases) -> (Option<Reduced>, Option<Terms>) {
    let topology = binder.topology();
    let mechanism = &topology.mechanism;
    let has_free = !mechanism.free.is_empty();
    if topology.loops.is_empty() {
        let joints = mechanism.joints.len();
        if !has_free || joints > MOST_FREE_JOINTS {
            return (None, None);
        }
        // Without loops every joint is independent.
        let independent = (0..joints).map(JointId).collect();
        let reduction = Reduction { independent, pivots: Vec::new() };
        let elimination = independent::Elimination::new(binder, phases.closure, &reduction);
        return (Some(solved(binder, phases, &reduction, elimination)), None);
    }
    let suits = may_be_reduced(topology.loops.len(), has_free);
    let Some(reduction) = topology.reduction.as_ref().filter(|_| suits) else {
        return (None, None);
    };
    let sparsity = independent::Sparsity::new(phases.closure, reduction, mechanism.speeds());
    let is_driven = mechanism.joints.iter().any(|joint| joint.drive.is_some());
    let has_many = sparsity.pairs(reduction) > MOST_PAIRS;
    let has_stops = mechanism.joints.iter().any(|joint| joint.limits.iter().any(|x| x.is_finite()));
    let has_parts = !has_free && !reduction.independent.is_empty();
    let is_in_parts = has_parts && (is_driven || has_many);
    let is_large = ReductionSizes::may_leave_out(mechanism.speeds());
    let terms = (is_in_parts || has_parts && (has_stops || is_large))
        .then(|| parts(binder, phases, reduction, &sparsity));
    let reduced = (!is_in_parts).then(|| {
        let elimination = independent::Elimination::new(binder, phases.closure, reduction);
        solved(binder, phases, reduction, elimination)
    });
    (reduced, terms)
}

fn solved(
    binder: &mut Binder,
    phases: &Phases,
    reduction: &Reduction,
    elimination: independent::Elimination,
) -> Reduced {
    let reduced = IndependentSpeeds::new(binder, phases, reduction, elimination);
    Reduced {
        accelerations: binder.trees(&reduced.accelerations),
        positions: binder.trees(&reduced.positions),
        speeds: binder.trees(&reduced.speeds),
        margin: binder.trees(&reduced.margin),
        projection_margin: binder.trees(&reduced.projection_margin),
    }
}

fn parts(
    binder: &mut Binder,
    phases: &Phases,
    reduction: &Reduction,
    sparsity: &independent::Sparsity,
) -> Terms {
    let parts = Parts::new(binder, phases, reduction, sparsity);
    Terms {
        axes: binder.trees(&parts.axes),
        rotors: binder.trees(&parts.rotors),
        closure: binder.trees(&parts.closure),
        momenta: binder.trees(&parts.momenta),
        opening: binder.trees(&parts.opening),
        forces: binder.trees(&parts.forces),
        projection_momenta: binder.trees(&parts.projection_momenta),
        row_residual: binder.trees(&parts.row_residual),
        row_velocity: binder.trees(&parts.row_velocity),
        pattern: parts.pattern,
    }
}

/// Returns whether the rows of J are worth reducing one by one although independent speeds are known.
/// Rows that depend on each other have no factor, and each row of a large sheet is carried through many
/// bodies.
fn by_rows(topology: &Topology, closure: &Closure) -> bool {
    topology.rank == closure.rows().len() && closure.jacobian.len() <= MOST_ROW_ENTRIES
}
