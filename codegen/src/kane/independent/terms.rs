//! What the runtime needs to solve for many independent speeds, or with driven joints.
//!
//! The elimination of a large sheet fills in, and N and N^T M N take some operations for each joint and each independent
//! speed. In straight-line code that outgrows the caches, and it is the same few operations again and again: the
//! runtime does it in loops ([`lamc_runtime::plumbing::Reduction`]). Here is what grows with the number of joints only. Hinges and
//! momenta are about the origin of the base frame, so that the runtime need not carry them from frame to frame:
//!
//! ```text
//! s = (A e_x, p x A e_x)        F = (A n + p x A f, A f)        M_ij = s_j . F_i
//! ```

use std::collections::BTreeMap;

use super::sparsity::{Row, Sparsity, Step};
use super::{Imbalance, Phases};
use crate::kane::binder::Binder;
use crate::kane::closure::Closure;
use crate::kane::inertia::Inertias;
use crate::kane::kinematics::Kinematics;
use crate::kane::mass::{at_ground, bind_composite, carry_composite};
use crate::kane::vector::cross;
use crate::kane::wrench::Wrench;
use crate::program::{Phase, ReductionInfo, Section, SparseRows};
use crate::source::JointId;
use crate::symbolic::Expr;
use crate::topology::{NodeId, Reduction};

/// The parts of a reduction that the runtime puts together; see [`Terms`](crate::kane::Terms) for shapes.
pub struct Parts {
    pub pattern: ReductionInfo,
    pub axes: Vec<Expr>,
    pub rotors: Vec<Expr>,
    pub closure: Vec<Expr>,
    pub momenta: Vec<Expr>,
    pub opening: Vec<Expr>,
    pub forces: Vec<Expr>,
    pub projection_momenta: Vec<Expr>,
    pub row_residual: Vec<Expr>,
    pub row_velocity: Vec<Expr>,
}

impl Parts {
    /// Derives the parts of a mechanism without free bodies.
    pub fn new(
        binder: &mut Binder,
        phases: &Phases,
        reduction: &Reduction,
        sparsity: &Sparsity,
    ) -> Self {
        let Phases { frames, kinematics, inertias: shared, closure, .. } = phases;
        let order = branches(kinematics);
        let whole = Inertias::of_whole_bodies(binder, frames);
        let at_rest = vec![Expr::zero(); binder.mechanism().speeds()];
        let imbalance = Imbalance::new(binder, phases, &whole, at_rest);
        let (forces, _) = imbalance.by_speed(binder, kinematics);
        let places = Places::new(binder, &order);
        let rotors = order.iter().map(|(node, _)| kinematics.link(*node).rotor.clone()).collect();
        let mut of_rows = |phase: Phase, what: &str, values: &[Expr], sign: f64| {
            let value = |Row { pivot, .. }: &Row| {
                let section = Section::closure(closure.rows()[pivot.row].closed, phase);
                let scale = binder.constant(sign / length(binder, closure, pivot.row));
                let name = format!("{what}_row{}", pivot.row);
                binder.bind(section, name, &scale * &values[pivot.row])
            };
            sparsity.rows().map(value).collect()
        };
        Self {
            opening: of_rows(Phase::ClosureBias, "opening", &closure.gamma, -1.0),
            row_residual: of_rows(Phase::ClosureResidual, "gap", &closure.row_residual, 1.0),
            row_velocity: of_rows(Phase::ClosureBias, "velocity", &closure.row_velocity, 1.0),
            axes: axes(binder, kinematics, &order),
            rotors,
            closure: entries(binder, closure, &places, sparsity),
            momenta: momenta(binder, kinematics, &whole, &order),
            forces,
            // The metric of a projection is that of M: next to a singular state rows may be left out, and a joint that leads to a
            // copy of a cut body alone has no inertia if whole bodies are elsewhere.
            projection_momenta: momenta(binder, kinematics, shared, &order),
            pattern: pattern(&places, &order, reduction, sparsity),
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

/// The places of the joints in the order of the tree.
struct Places(Vec<u16>);

impl Places {
    fn new(binder: &Binder, order: &[(NodeId, usize)]) -> Self {
        let topology = binder.topology();
        let joints = order.iter().filter_map(|(node, _)| topology.node(*node).joint());
        let mut places = vec![0; order.len()];
        for (place, joint) in joints.enumerate() {
            places[joint.index()] = short(place);
        }
        Self(places)
    }

    fn of(&self, joint: JointId) -> u16 {
        self.0[joint.index()]
    }

    /// Returns rows of some joints, in the order of the tree.
    fn rows<'r>(&self, sparsity: &'r Sparsity) -> Vec<Option<&'r Row>> {
        let mut rows = vec![None; self.0.len()];
        for row in sparsity.rows() {
            rows[usize::from(self.of(row.pivot.joint))] = Some(row);
        }
        rows
    }

    /// Returns where each of some rows has entries.
    fn sparse<'r>(&self, rows: impl Iterator<Item = &'r [JointId]>) -> SparseRows {
        let mut sparse = SparseRows::default();
        for row in rows {
            sparse.columns.extend(row.iter().map(|&joint| self.of(joint)));
            sparse.ends.push(sparse.columns.len() as u32);
        }
        sparse
    }
}

/// Returns what the runtime knows of the reduction.
fn pattern(
    places: &Places,
    order: &[(NodeId, usize)],
    reduction: &Reduction,
    sparsity: &Sparsity,
) -> ReductionInfo {
    let mut joints: Vec<u16> = vec![0; order.len()];
    for (joint, &place) in places.0.iter().enumerate() {
        joints[usize::from(place)] = short(joint);
    }
    let depths = order.iter().map(|(_, depth)| short(*depth));
    let rows = places.rows(sparsity);
    let of_joints =
        rows.iter().map(|row| row.map(|row| row.closure.as_slice()).unwrap_or_default());
    let step = |step: &Step| step.rows.iter().map(|row| places.of(row.pivot.joint)).collect();
    ReductionInfo {
        branches: joints.into_iter().zip(depths).collect(),
        independent: reduction.independent.iter().map(|joint| places.of(*joint)).collect(),
        steps: sparsity.0.iter().map(step).collect(),
        rows: sparsity.rows().map(|row| row.pivot.row as u32).collect(),
        closure: places.sparse(of_joints),
        lower: places.sparse(sparsity.0.iter().map(|step| step.lower.as_slice())),
        upper: places.sparse(sparsity.0.iter().map(|step| step.upper.as_slice())),
    }
}

/// Returns the entries of the rows of J over their loops' lengths, in the order of the tree.
fn entries(
    binder: &mut Binder,
    closure: &Closure,
    places: &Places,
    sparsity: &Sparsity,
) -> Vec<Expr> {
    let speeds = binder.mechanism().speeds();
    let mut entries = Vec::new();
    for Row { pivot, closure: columns, .. } in places.rows(sparsity).into_iter().flatten() {
        let scale = binder.constant(1.0 / length(binder, closure, pivot.row));
        let closed = closure.rows()[pivot.row].closed;
        for joint in columns {
            let name = format!("share_row{}_{}", pivot.row, binder.joint_name(*joint));
            let entry = &closure.jacobian[pivot.row * speeds + joint.index()];
            let section = Section::closure(closed, Phase::ClosureJacobian);
            entries.push(binder.bind(section, name, &scale * entry));
        }
    }
    entries
}

/// Returns the length of the loop of a row, m.
fn length(binder: &Binder, closure: &Closure, row: usize) -> f64 {
    let closed = &binder.topology().loops[closure.rows()[row].closed.index()];
    (closed.points[1] - closed.points[0]).norm()
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
