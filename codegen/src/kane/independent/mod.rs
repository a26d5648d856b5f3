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
//! a joint that closes a loop carries only its own torque. A projection takes from q and u the x with J x = r and J x = J u for which
//! x^T M x is least, M being that of whole bodies. Of u, p needs no rows of J: it is what the dependent joints have beside the u_i of the
//! independent ones.
//!
//! ```text
//! x = p - N y,    N^T M N y = N^T M p          J p = r,    or    p = u - N u_i
//! ```

mod elimination;
mod factor;
mod free;
mod inertia;
mod sparsity;
mod terms;

use std::collections::BTreeMap;

use lamc_runtime::constants::WEIGHT_OF_ENTRY;

pub use self::elimination::Elimination;
use self::elimination::transposed;
use self::free::FreeInertia;
use self::inertia::{Inertia, Metric};
pub use self::sparsity::Sparsity;
pub use self::terms::Parts;
use super::binder::Binder;
use super::closure::Closure;
use super::forces::{along_speeds, gathered};
use super::frame::Frames;
use super::free::Free;
use super::inertia::Inertias;
use super::inverse::{Given, GivenMotion};
use super::kinematics::Kinematics;
use super::loads::{Loads, WrenchNames};
use super::vector::{add, zero};
use super::wrench::Wrench;
use crate::program::{Phase, Section, Subject};
use crate::source::free::SPEEDS;
use crate::symbolic::{Expr, Function};
use crate::topology::{NodeId, Pivot, Reduction};

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
    pub fn new(
        binder: &mut Binder,
        phases: &Phases,
        reduction: &Reduction,
        elimination: Elimination,
    ) -> Self {
        let elimination = elimination.with_null_space(binder, reduction);
        match binder.mechanism().free.is_empty() {
            true => Self::of_joints(binder, phases, reduction, &elimination),
            false => Self::with_free_bodies(binder, phases, reduction, &elimination),
        }
    }

    fn of_joints(
        binder: &mut Binder,
        phases: &Phases,
        reduction: &Reduction,
        elimination: &Elimination,
    ) -> Self {
        let Phases { frames, kinematics, closure, .. } = phases;
        let inertias = Inertias::of_whole_bodies(binder, frames);
        let inertia = Inertia::new(binder, kinematics, &inertias, &elimination.null_space);
        let given = elimination.solve(binder, &opening(closure), "given");
        let loads = Imbalance::new(binder, phases, &inertias, given.clone());
        let reduced = inertia.forces(binder, kinematics, &elimination.null_space, loads);
        let y = inertia.factor.solve(binder, reduced, "independent");
        let accelerations = elimination.combined(binder, &given, &y, "acceleration", 1.0);
        let trust = trust(binder, elimination);
        let margin = |least: Expr| [least].into_iter().chain(trust.clone()).collect();
        let of_accelerations = margin(inertia.factor.least_inverse_pivot(binder));
        let Metric { products, factor } =
            Metric::new(binder, kinematics, &inertias, &elimination.null_space);
        let across = |binder: &mut Binder, given: &[Expr], name: &str| {
            let y = factor.solve(binder, transposed(&products, given), &format!("along_{name}"));
            elimination.combined(binder, given, &y, &format!("correction_{name}"), -1.0)
        };
        let closing = elimination.solve(binder, &closure.row_residual, "closing_q");
        let positions = across(binder, &closing, "q");
        let opened = elimination.opened(binder, reduction);
        let speeds = across(binder, &opened, "u");
        let projection_margin = margin(factor.least_inverse_pivot(binder));
        Self { accelerations, margin: of_accelerations, positions, speeds, projection_margin }
    }

    fn with_free_bodies(
        binder: &mut Binder,
        phases: &Phases,
        reduction: &Reduction,
        elimination: &Elimination,
    ) -> Self {
        let Phases { frames, kinematics, loads, closure, .. } = phases;
        let table = &elimination.null_space;
        let inertias = Inertias::of_whole_bodies(binder, frames);
        let inertia = FreeInertia::new(binder, kinematics, &inertias, table);
        let given = elimination.solve(binder, &opening(closure), "given");
        let at_rest = vec![Expr::zero(); given.len()];
        let imbalance = Imbalance::new(binder, phases, &inertias, at_rest);
        let (forces, beyond) = imbalance.by_speed(binder, kinematics);
        let reduced = transposed(table, &forces);
        let on_root = |node: NodeId| beyond[node.index()].clone();
        let solution = inertia.solve(binder, &given, reduced, on_root, "independent");
        let mut accelerations =
            elimination.combined(binder, &given, &solution.joints, "acceleration", 1.0);
        let bias = |node, free: &Free| kinematics.motion(node).relative_acceleration(&free.centre);
        for (first, [linear, alpha]) in inertia.accelerations(&solution, bias) {
            let linear = add(&linear, loads.gravity());
            accelerations.splice(first..first + SPEEDS, linear.into_iter().chain(alpha));
        }
        let trust = trust(binder, elimination);
        let least = inertia.factor.least_inverse_pivot(binder);
        let margin: Vec<Expr> = [least].into_iter().chain(trust).collect();
        let across = |binder: &mut Binder, given: &[Expr], name: &str| {
            let none = vec![Expr::zero(); table.first().map_or(0, Vec::len)];
            let along = format!("along_{name}");
            let solution = inertia.solve(binder, given, none, |_| Wrench::zero(), &along);
            let name = format!("correction_{name}");
            let mut correction = elimination.combined(binder, given, &solution.joints, &name, 1.0);
            for (first, [linear, alpha]) in inertia.accelerations(&solution, |_, _| zero()) {
                correction.splice(first..first + SPEEDS, linear.into_iter().chain(alpha));
            }
            correction
        };
        let closing = elimination.solve(binder, &closure.row_residual, "closing_q");
        let positions = across(binder, &closing, "q");
        let opened = elimination.opened(binder, reduction);
        let speeds = across(binder, &opened, "u");
        Self { accelerations, projection_margin: margin.clone(), margin, positions, speeds }
    }
}

/// Returns b of the accelerations: -gamma.
fn opening(closure: &Closure) -> Vec<Expr> {
    closure.gamma.iter().map(|gamma| -gamma).collect()
}

/// f - M a of the joints at given a of the joints and the accelerations of a free body that falls with its origin.
struct Imbalance {
    /// The wrench on each node.
    wrenches: Vec<Wrench>,
    /// What the joints themselves add, by speed.
    torques: Vec<Expr>,
}

impl Imbalance {
    fn new(
        binder: &mut Binder,
        phases: &Phases,
        inertias: &Inertias,
        accelerations: Vec<Expr>,
    ) -> Self {
        let Phases { kinematics, loads, .. } = phases;
        let given = Given::of(accelerations);
        let motion = GivenMotion::on_tree(binder, kinematics, &given);
        let phase = Phase::InverseDynamics;
        let names = WrenchNames { gravity_phase: phase, phase, name: "net" };
        let motion_of = |node| motion.of(node);
        let wrenches =
            loads.on_falling_bodies(binder, kinematics, inertias.minimal(), motion_of, &names);
        let mut torques = vec![Expr::zero(); binder.mechanism().speeds()];
        for link in kinematics.links().iter().filter(|link| link.hinge().is_some()) {
            for speed in link.speeds() {
                let rotor = &link.rotor * &given.accelerations()[speed];
                torques[speed] = loads.torque(link.node) - &rotor;
            }
        }
        Self { wrenches, torques }
    }

    /// Returns f - M a by speed, and the wrenches on each node and all beyond it.
    fn by_speed(self, binder: &mut Binder, kinematics: &Kinematics) -> (Vec<Expr>, Vec<Wrench>) {
        let Self { wrenches, torques: mut imbalance } = self;
        let phase = Phase::InverseDynamics;
        let beyond = gathered(binder, kinematics, phase, "balance", wrenches);
        for link in kinematics.links().iter().filter(|link| link.hinge().is_some()) {
            for (speed, along) in along_speeds(kinematics, link.node, &beyond[link.node.index()]) {
                let name = format!("imbalance_{}", binder.speed_name(speed));
                let value = &along + &imbalance[speed];
                imbalance[speed] = binder.bind(Section::body(link.node, phase), name, value);
            }
        }
        (imbalance, beyond)
    }
}

/// Returns by how much the elimination can be trusted: what the largest entry of N counts as, and the smallest pivot of the
/// closure over its loop's length. Pivots become zero where the mechanism is singular, as the smallest singular value of J
/// does.
fn trust(binder: &mut Binder, elimination: &Elimination) -> [Expr; 2] {
    let topology = binder.topology();
    if topology.loops.is_empty() {
        return [Expr::one(), Expr::one()];
    }
    let phase = Phase::EliminationMargin;
    let mut sizes = Groups::new();
    for (Pivot { row, joint }, _) in elimination.pivots() {
        let entries = elimination.speeds_by(joint).iter().filter(|entry| !entry.is_zero());
        let entries = entries.map(|entry| Expr::apply(Function::Abs, std::slice::from_ref(entry)));
        let subject = Subject::Loop(elimination.loop_of(row));
        sizes.entry(subject).or_default().extend(entries);
    }
    let largest = folded(binder, phase, Function::Max, "entry", sizes);
    let weighted = &binder.constant(WEIGHT_OF_ENTRY) * &largest;
    let sizes = inverse_pivots(binder, elimination);
    let smallest = folded(binder, phase, Function::Max, "inverse_pivot", sizes);
    [weighted.power(-2), smallest.power(-1)]
}

/// Returns the magnitudes of the inverse pivots times the lengths of their loops.
fn inverse_pivots(binder: &mut Binder, elimination: &Elimination) -> Groups {
    let topology = binder.topology();
    let mut sizes = Groups::new();
    for (Pivot { row, .. }, inverse) in elimination.pivots() {
        let id = elimination.loop_of(row);
        let closed = &topology.loops[id.index()];
        let length = binder.constant((closed.points[1] - closed.points[0]).norm());
        let size = Expr::apply(Function::Abs, &[&length * inverse]);
        sizes.entry(Subject::Loop(id)).or_default().push(size);
    }
    sizes
}

/// Values by what they belong to.
type Groups = BTreeMap<Subject, Vec<Expr>>;

/// Binds the largest or smallest of several values: first of each group, then of two groups, of four, and so on, so that none
/// waits for all the others.
fn folded(
    binder: &mut Binder,
    phase: Phase,
    function: Function,
    name: &str,
    groups: Groups,
) -> Expr {
    let mut step = 0;
    let mut extreme = |section: Section, values: &[Expr]| match values {
        [value] => value.clone(),
        values => {
            step += 1;
            binder.bind(section, format!("{name}_to_{step}"), Expr::apply(function, values))
        }
    };
    let mut values: Vec<Expr> = Vec::new();
    for (subject, of_group) in groups {
        let section = Section { subject, phase };
        let of_group = of_group.into_iter();
        values.extend(of_group.reduce(|found, value| extreme(section, &[found, value])));
    }
    while values.len() > 1 {
        let pairs = values.chunks(2);
        values = pairs.map(|pair| extreme(Section::mechanism(phase), pair)).collect();
    }
    values.pop().unwrap_or_else(Expr::one)
}
