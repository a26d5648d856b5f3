//! Phase 11, independent speeds: du/dt of mechanisms whose loops depend on each other, without closure
//! forces.
//!
//! The closure J a = b is solved by the elimination that [`Reduction`] describes: a = N y + p, where y
//! belongs to the independent joints, N solves it for b = 0, and p has zeros for y. Kane's equations of
//! the independent speeds have no closure forces, because N^T J^T = 0:
//!
//! ```text
//! J du/dt = -gamma       du/dt = N y + p
//! N^T M N y = N^T (f - M p)
//! ```
//!
//! f - M p is one pass of inverse dynamics at du/dt = p (J. Wittenburg, "Dynamics of Multibody Systems",
//! 2008, 5.5; for the choice of y R. A. Wehage, E. J. Haug, "Generalized coordinate partitioning for
//! dimension reduction in analysis of constrained dynamic systems", 1982). The cut bodies are whole here:
//! a joint that closes a loop carries only its own torque. What closes the loops, to be taken from q or u,
//! is the x with J x = b for which x^T M x is least:
//!
//! ```text
//! x = p - N y,    N^T M N y = N^T M p
//! ```

mod elimination;
mod inertia;

use self::elimination::{Elimination, transposed};
use self::inertia::Inertia;
use super::binder::Binder;
use super::closure::Closure;
use super::forces::{along_hinge, gathered};
use super::frame::Frames;
use super::inertia::Inertias;
use super::inverse::{Given, GivenMotion};
use super::kinematics::Kinematics;
use super::loads::{Loads, WrenchNames};
use crate::program::{Phase, Section};
use crate::symbolic::{Expr, Function};
use crate::topology::{Pivot, Reduction};

/// Entries of N whose size makes a margin as small as a pivot of a hundredth: 20.
const GROWTH: f64 = 5.0;

/// Results of the reduction; see [`Reduced`](super::Reduced) for shapes.
pub struct IndependentSpeeds {
    pub accelerations: Vec<Expr>,
    pub margin: Vec<Expr>,
    pub positions: Vec<Expr>,
    pub speeds: Vec<Expr>,
    pub projection_margin: Vec<Expr>,
}

/// The phases that the reduction needs.
pub struct Phases<'a> {
    pub frames: &'a Frames,
    pub kinematics: &'a Kinematics,
    pub inertias: &'a Inertias,
    pub loads: &'a Loads,
    pub closure: &'a Closure,
}

impl IndependentSpeeds {
    /// Derives the reduction.
    pub fn new(binder: &mut Binder, phases: &Phases, reduction: &Reduction) -> Self {
        let Phases { frames, kinematics, inertias: shared, loads, closure } = phases;
        let inertias = Inertias::of_whole_bodies(binder, frames);
        let elimination = Elimination::new(binder, closure, reduction);
        let inertia = Inertia::new(binder, kinematics, &inertias, &elimination, reduction);
        let wanted: Vec<Expr> = closure.gamma.iter().map(|gamma| -gamma).collect();
        let given = elimination.solve(binder, &wanted, "given");
        let forces = imbalance(binder, kinematics, &inertias, loads, given.clone());
        let reduced = transposed(&elimination.null_space, &forces);
        let y = inertia.solve(binder, reduced, "independent");
        let accelerations = elimination.combined(binder, &given, &y, "acceleration", 1.0);
        let conditioning = conditioning(binder, closure, &elimination);
        let margin = vec![inertia.least_inverse_pivot(binder), conditioning.clone()];
        // The metric of a projection is that of M, also where the loops are open.
        let inertia = Inertia::new(binder, kinematics, shared, &elimination, reduction);
        let mut correct = |wanted: &[Expr], name: &str| {
            let given = elimination.solve(binder, wanted, &format!("closing_{name}"));
            let reduced =
                inertia.momentum(binder, kinematics, &elimination.null_space, &given, name);
            let y = inertia.solve(binder, reduced, &format!("along_{name}"));
            elimination.combined(binder, &given, &y, &format!("correction_{name}"), -1.0)
        };
        let positions = correct(&closure.row_residual, "q");
        let speeds = correct(&closure.row_velocity, "u");
        let projection_margin = vec![inertia.least_inverse_pivot(binder), conditioning];
        Self { accelerations, margin, positions, speeds, projection_margin }
    }
}

/// Returns f - M a at given a, by joint.
fn imbalance(
    binder: &mut Binder,
    kinematics: &Kinematics,
    inertias: &Inertias,
    loads: &Loads,
    accelerations: Vec<Expr>,
) -> Vec<Expr> {
    let given = Given::of(accelerations);
    let motion = GivenMotion::on_tree(binder, kinematics, &given);
    let phase = Phase::InverseDynamics;
    let names = WrenchNames { gravity_phase: phase, phase, name: "net" };
    let motion_of = |node| motion.of(node);
    let wrenches = loads.on_bodies(binder, kinematics, inertias.minimal(), motion_of, &names);
    let beyond = gathered(binder, kinematics, phase, "balance", wrenches);
    let mut imbalance = vec![Expr::zero(); beyond.len()];
    for link in kinematics.links() {
        let along = along_hinge(kinematics, link.node, &beyond[link.node.index()]);
        let name = format!("imbalance_{}", binder.joint_name(link.node));
        let rotor = &link.rotor * given.acceleration(link.joint);
        let value = &(&along + loads.torque(link.node)) - &rotor;
        imbalance[link.joint.index()] = binder.bind(Section::body(link.node, phase), name, value);
    }
    imbalance
}

/// Returns by how much the elimination can be trusted: the square of the smallest pivot of the closure over
/// its loop's length, or less where entries of N are large. Pivots become zero where the mechanism is
/// singular, as the smallest singular value of J does.
fn conditioning(binder: &mut Binder, closure: &Closure, elimination: &Elimination) -> Expr {
    let topology = binder.topology();
    let mut sizes = Vec::new();
    for (Pivot { row, .. }, inverse) in elimination.pivots() {
        let closed = &topology.loops[closure.rows()[row].closed.index()];
        let length = binder.constant((closed.points[1] - closed.points[0]).norm());
        sizes.push(Expr::apply(Function::Abs, &[&length * inverse]));
    }
    let smallest = folded(binder, Function::Max, "inverse_pivot", sizes);
    let entries = elimination.pivots().flat_map(|(pivot, _)| elimination.speeds_by(pivot.joint));
    let entries = entries.filter(|entry| !entry.is_zero());
    let sizes =
        entries.map(|entry| Expr::apply(Function::Abs, std::slice::from_ref(entry))).collect();
    let largest = folded(binder, Function::Max, "entry", sizes);
    let largest = &binder.constant(GROWTH) * &largest;
    let worst = folded(binder, Function::Max, "worst", vec![smallest, largest]);
    worst.power(-2)
}

/// Binds the largest or smallest of several values, step by step.
fn folded(binder: &mut Binder, function: Function, name: &str, values: Vec<Expr>) -> Expr {
    let section = Section::mechanism(Phase::EliminationMargin);
    let mut values = values.into_iter().enumerate();
    let Some((_, first)) = values.next() else { return Expr::one() };
    values.fold(first, |extreme, (index, value)| {
        let value = Expr::apply(function, &[extreme, value]);
        binder.bind(section, format!("{name}_to_{index}"), value)
    })
}
