//! What the runtime needs to solve for many independent speeds, or with driven joints.
//!
//! N^T M N costs half the number of joints times the square of the number of independent speeds. In straight-line
//! code that outgrows the caches, and it is the same few operations again and again: the runtime does it in loops
//! ([`lamc_runtime::plumbing::Reduction`]). Here is what grows with the number of joints only. Hinges and momenta are
//! about the origin of the base frame, so that the runtime need not carry them from frame to frame:
//!
//! ```text
//! s = (A e_x, p x A e_x)        F = (A n + p x A f, A f)        M_ij = s_j . F_i
//! ```

use std::collections::BTreeMap;

use super::elimination::Elimination;
use super::{Imbalance, Phases, folded, inverse_pivots, opening};
use crate::kane::binder::Binder;
use crate::kane::inertia::Inertias;
use crate::kane::kinematics::Kinematics;
use crate::kane::mass::{at_ground, bind_composite, carry_composite};
use crate::kane::vector::cross;
use crate::kane::wrench::Wrench;
use crate::program::{Phase, ReductionInfo, Section};
use crate::source::JointId;
use crate::symbolic::{Expr, Function};
use crate::topology::{NodeId, Pivot, Reduction};

/// The parts of a reduction that the runtime puts together; see [`Terms`](crate::kane::Terms) for shapes.
pub struct Parts {
    pub pattern: ReductionInfo,
    pub axes: Vec<Expr>,
    pub rotors: Vec<Expr>,
    pub coefficients: Vec<Expr>,
    pub largest: Vec<Expr>,
    pub momenta: Vec<Expr>,
    pub given: Vec<Expr>,
    pub forces: Vec<Expr>,
    pub projection_momenta: Vec<Expr>,
    pub positions: Vec<Expr>,
    pub speeds: Vec<Expr>,
}

impl Parts {
    /// Derives the parts of a mechanism without free bodies.
    pub fn new(
        binder: &mut Binder,
        phases: &Phases,
        reduction: &Reduction,
        elimination: &Elimination,
    ) -> Self {
        let Phases { frames, kinematics, inertias: shared, closure, .. } = phases;
        let order = branches(kinematics);
        let whole = Inertias::of_whole_bodies(binder, frames);
        let given = elimination.solve(binder, &opening(closure), "given");
        let imbalance = Imbalance::new(binder, phases, &whole, given.clone());
        let (forces, _) = imbalance.by_speed(binder, kinematics);
        let (pattern, coefficients) = coefficients(binder, &order, reduction, elimination);
        let sizes = inverse_pivots(binder, elimination);
        let phase = Phase::EliminationMargin;
        let largest = folded(binder, phase, Function::Max, "inverse_pivot", sizes);
        let rotors = order.iter().map(|(node, _)| kinematics.link(*node).rotor.clone()).collect();
        Self {
            axes: axes(binder, kinematics, &order),
            rotors,
            coefficients,
            largest: vec![largest],
            momenta: momenta(binder, kinematics, &whole, &order),
            given,
            forces,
            // The metric of a projection is that of M, also where the loops are open.
            projection_momenta: momenta(binder, kinematics, shared, &order),
            positions: elimination.solve(binder, &closure.row_residual, "closing_q"),
            speeds: elimination.solve(binder, &closure.row_velocity, "closing_u"),
            pattern,
        }
    }
}

/// The nodes of the tree with their depths: each is followed by all nodes beyond it.
fn branches(kinematics: &Kinematics) -> Vec<(NodeId, usize)> {
    let mut beyond: BTreeMap<Option<NodeId>, Vec<NodeId>> = BTreeMap::new();
    for link in kinematics.links() {
        beyond.entry(link.parent).or_default().push(link.node);
    }
    let children = |parent: Option<NodeId>, depth: usize| {
        let children = beyond.get(&parent).into_iter().flatten().rev();
        children.map(move |&node| (node, depth)).collect::<Vec<_>>()
    };
    let mut waiting = children(None, 0);
    let mut order = Vec::new();
    while let Some((node, depth)) = waiting.pop() {
        order.push((node, depth));
        waiting.extend(children(Some(node), depth + 1));
    }
    order
}

/// Returns the pattern of the reduction, and the coefficients of the dependent speeds.
fn coefficients(
    binder: &mut Binder,
    order: &[(NodeId, usize)],
    reduction: &Reduction,
    elimination: &Elimination,
) -> (ReductionInfo, Vec<Expr>) {
    let topology = binder.topology();
    let joints: Vec<_> =
        order.iter().filter_map(|(node, _)| topology.node(*node).joint()).collect();
    let mut places = vec![0; joints.len()];
    for (place, joint) in joints.iter().enumerate() {
        places[joint.index()] = short(place);
    }
    let place = |joint: JointId| places[joint.index()];
    let depths = order.iter().map(|(_, depth)| short(*depth));
    let mut pattern = ReductionInfo {
        branches: joints.iter().map(|joint| short(joint.index())).zip(depths).collect(),
        independent: reduction.independent.iter().map(|joint| place(*joint)).collect(),
        dependent: Vec::new(),
        columns: Vec::new(),
    };
    let mut coefficients = Vec::new();
    for (Pivot { row, joint }, inverse, entries) in elimination.rows() {
        let section = Section::closure(elimination.loop_of(row), Phase::NullSpace);
        pattern.dependent.push((place(joint), short(entries.len())));
        for (&column, value) in entries {
            let [of, by] = [joint, JointId(column)].map(|joint| binder.joint_name(joint));
            let name = format!("{of}_by_{by}");
            coefficients.push(binder.bind(section, name, -&(value * inverse)));
            pattern.columns.push(place(JointId(column)));
        }
    }
    (pattern, coefficients)
}

/// A place among the joints. (A mechanism of more joints could not be derived at all.)
fn short(place: usize) -> u16 {
    match u16::try_from(place) {
        Ok(place) => place,
        Err(error) => unreachable!("the equations of {place} joints: {error}"),
    }
}

/// Returns the velocities of the hinges at unit speed about the origin of the base frame, 6 per branch.
fn axes(binder: &mut Binder, kinematics: &Kinematics, order: &[(NodeId, usize)]) -> Vec<Expr> {
    let mut axes = Vec::with_capacity(6 * order.len());
    for &(node, _) in order {
        let placement = kinematics.placement(node);
        let velocity = cross(&placement.origin, &placement.axes[0]);
        let name = "partial_velocity_at_ground";
        let velocity = binder.vector(node, Phase::MassMatrix, name, velocity);
        axes.extend(placement.axes[0].iter().cloned().chain(velocity));
    }
    axes
}

/// Returns the momenta of all that moves with each hinge at unit speed, about the origin of the base frame, 6 per
/// branch: moment and force.
fn momenta(
    binder: &mut Binder,
    kinematics: &Kinematics,
    inertias: &Inertias,
    order: &[(NodeId, usize)],
) -> Vec<Expr> {
    let mut composites = inertias.minimal().to_vec();
    let mut wrenches = vec![Wrench::zero(); composites.len()];
    for link in kinematics.links().iter().rev() {
        let composite = composites[link.node.index()].clone();
        let composite = bind_composite(binder, link, composite);
        for (speed, partial) in kinematics.partial(link.node) {
            let wrench = composite.wrench(&partial.omega, &partial.velocity);
            wrenches[link.node.index()] = at_ground(binder, kinematics, link, speed, &wrench);
        }
        if let Some(parent) = link.parent {
            let carried = carry_composite(binder, link, &composite);
            composites[parent.index()] = composites[parent.index()].plus(&carried);
        }
    }
    let of = |node: NodeId| {
        let Wrench { force, moment } = wrenches[node.index()].clone();
        moment.into_iter().chain(force)
    };
    order.iter().flat_map(|(node, _)| of(*node)).collect()
}
