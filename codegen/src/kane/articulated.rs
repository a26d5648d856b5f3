//! M du/dt = b without M: elimination body by body, from the leaves to the root and back.
//!
//! What hangs on a hinge answers like one body of articulated inertia, which is eliminated along
//! the hinge's x axis before it is carried to the parent (R. Featherstone, "Rigid Body Dynamics
//! Algorithms", 2008, 7.3). With moment n and force f about the node's origin,
//!
//! ```text
//! n = I alpha + H a      D = I_xx     w = (I, H) row x / D      y = tau + n_x
//! f = H^T alpha + M a    I - D w w^T is carried on, and (n, f) - w y
//! du/dt = y / D - w . (alpha, a) of the parent's motion
//! ```
//!
//! A hinge's w is carried to the parent by itself, so that neither sweep has to wait for the y or the
//! du/dt of one joint before it can turn to the next.
//!
//! This is M = L^T D L, y = L^-T b, du/dt = L^-1 (y / D), at a cost that grows as N. Velocities enter
//! b only: accelerations at du/dt = 0 are in the wrenches of [`dynamics`](super::dynamics).

use super::derivation::Derivation;
use super::dynamics::{Dynamics, Wrench};
use super::inertia::Inertia;
use super::section::Phase;
use super::vector::{Tensor, Vector, add, cross, dot, scale, sub, zero};
use crate::symbolic::Expr;
use crate::topology::{Loop, NodeId};

/// What [`articulated`] derives; see [`Elimination`](super::Elimination) for shapes.
pub struct Articulated {
    pub inverse_pivots: Vec<Expr>,
    pub reduced: Vec<Expr>,
    pub reduced_rows: Vec<Expr>,
    pub accelerations: Vec<Expr>,
}

/// How what hangs on a hinge answers motion, about the node's origin.
#[derive(Clone)]
struct Response {
    /// I, moment by angular acceleration.
    inertia: Tensor,
    /// H, moment by acceleration, rows.
    coupling: [Vector; 3],
    /// M, force by acceleration.
    mass: Tensor,
}

/// A node after elimination of its hinge.
struct Hinge {
    /// w: of (I, H) in row x over D, without the first, which is 1.
    share: Wrench,
    /// The same about the parent's origin, in its frame.
    share_above: Wrench,
    /// 1 / D.
    inverse_pivot: Expr,
}

/// Derives the elimination. Needs the symbols of given accelerations.
pub fn articulated(d: &mut Derivation, dynamics: &Dynamics) -> Articulated {
    let hinges = d.eliminated(&dynamics.moving);
    let nodes = || (0..hinges.len()).map(NodeId);
    let n = hinges.len();
    let mut torques = vec![Expr::zero(); n];
    let (mut inverse_pivots, mut reduced) = (torques.clone(), torques.clone());
    for id in nodes() {
        let joint = d.joint_of(id);
        inverse_pivots[joint] = hinges[id.index()].inverse_pivot.clone();
        let torque = d.joint_torque(joint);
        torques[id.index()] = d.bind_scalar(id, Phase::JointTorque, "torque", torque);
    }
    let loads = dynamics.wrenches.iter().cloned().map(Some).collect();
    for (id, y) in nodes().zip(d.reduce(Phase::ArticulatedBiasForce, &hinges, torques, loads)) {
        reduced[d.joint_of(id)] = y;
    }
    let mut reduced_rows = Vec::new();
    let topology = d.topology;
    for closed in &topology.loops {
        for row in 0..closed.rows.len() {
            let loads = d.row_loads(closed, row);
            let ys = d.reduce(Phase::ReducedClosureJacobian, &hinges, vec![Expr::zero(); n], loads);
            let mut entries = vec![Expr::zero(); n];
            for (id, y) in nodes().zip(ys) {
                entries[d.joint_of(id)] = y;
            }
            reduced_rows.extend(entries);
        }
    }
    let accelerations = d.substituted(&hinges);
    Articulated { inverse_pivots, reduced, reduced_rows, accelerations }
}

impl Response {
    fn of(inertia: &Inertia) -> Self {
        let [x, y, z] = &inertia.moment;
        let zero = Expr::zero;
        let m = &inertia.mass;
        Self {
            inertia: inertia.tensor(),
            coupling: [[zero(), -z, y.clone()], [z.clone(), zero(), -x], [-y, x.clone(), zero()]],
            mass: [m.clone(), zero(), zero(), m.clone(), zero(), m.clone()],
        }
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            inertia: add(&self.inertia, &other.inertia),
            coupling: [0, 1, 2].map(|row| add(&self.coupling[row], &other.coupling[row])),
            mass: add(&self.mass, &other.mass),
        }
    }

    /// About a point from which this one's is at `r`: H' = H + [r]x M, I' = I - H' [r]x + [r]x H^T.
    fn about(&self, r: &Vector) -> Self {
        let [xx, xy, xz, yy, yz, zz] = self.mass.clone();
        let mass = [[xx, xy.clone(), xz.clone()], [xy, yy, yz.clone()], [xz, yz, zz]];
        let columns = [0, 1, 2].map(|k| cross(r, &mass[k]));
        let coupling: [Vector; 3] =
            [0, 1, 2].map(|i| [0, 1, 2].map(|k| &self.coupling[i][k] + &columns[k][i]));
        // Row i of -H' [r]x is r x (row i of H'); column k of [r]x H^T is r x (row k of H).
        let rows = [0, 1, 2].map(|i| cross(r, &coupling[i]));
        let turned = [0, 1, 2].map(|k| cross(r, &self.coupling[k]));
        let entry = |i: usize, k: usize| &rows[i][k] + &turned[k][i];
        let shift = [entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)];
        Self { inertia: add(&self.inertia, &shift), coupling, mass: self.mass.clone() }
    }
}

impl Derivation<'_> {
    /// Hinge by hinge, from the leaves to the root.
    fn eliminated(&mut self, inertia: &[Inertia]) -> Vec<Hinge> {
        let mut responses: Vec<_> = inertia.iter().map(Response::of).collect();
        let mut hinges = Vec::with_capacity(responses.len());
        for id in (0..responses.len()).rev().map(NodeId) {
            let response = self.bind_response(id, responses[id.index()].clone());
            let [pivot, y, z, ..] = response.inertia.clone();
            let inverse_pivot =
                self.bind_scalar(id, Phase::ArticulatedInertia, "inverse_pivot", pivot.power(-1));
            let share = Wrench {
                force: scale(&inverse_pivot, &response.coupling[0]),
                moment: scale(&inverse_pivot, &[Expr::zero(), y, z]),
            };
            let share = self.bind_wrench(id, Phase::ArticulatedInertia, "share", share);
            let share_above = self.carry_wrench(id, Phase::ArticulatedInertia, &share);
            let share_above =
                self.bind_wrench(id, Phase::ArticulatedInertia, "share_above", share_above);
            let hinge = Hinge { share, share_above, inverse_pivot };
            if let Some(parent) = self.parent(id) {
                let carried = self.carry_response(id, &response, &hinge);
                responses[parent.index()] = responses[parent.index()].plus(&carried);
            }
            hinges.push(hinge);
        }
        hinges.reverse();
        hinges
    }

    /// What the parent feels of a node whose hinge gives way, about the parent's origin.
    fn carry_response(&mut self, id: NodeId, response: &Response, hinge: &Hinge) -> Response {
        let Response { inertia: [_, xy, xz, yy, yz, zz], coupling, mass } = response;
        let none = Expr::zero;
        let Wrench { force: w, moment: [_, wy, wz] } = &hinge.share;
        let row = &coupling[0];
        let inertia = [none(), none(), none(), yy - &(xy * wy), yz - &(xy * wz), zz - &(xz * wz)];
        let coupling = [zero(), sub(&coupling[1], &scale(xy, w)), sub(&coupling[2], &scale(xz, w))];
        let pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        let mut terms = pairs.map(|(i, k)| &row[i] * &w[k]).into_iter();
        let mass = mass.clone().map(|m| &m - &terms.next().unwrap_or_else(Expr::zero));
        let r = self.offset(id);
        let inertia = self.bind_tensor(id, Phase::ArticulatedInertia, "left_inertia", inertia);
        let coupling = coupling
            .map(|row| self.bind_vector(id, Phase::ArticulatedInertia, "left_coupling", row));
        let mass = self.bind_tensor(id, Phase::ArticulatedInertia, "left_mass", mass);
        let turned = Response {
            inertia: self.turn_tensor(id, Phase::ArticulatedInertia, &inertia),
            coupling: self.turn_matrix(id, Phase::ArticulatedInertia, &coupling),
            mass: self.turn_tensor(id, Phase::ArticulatedInertia, &mass),
        };
        self.bind_response(id, turned).about(&r)
    }

    fn bind_response(&mut self, id: NodeId, response: Response) -> Response {
        Response {
            inertia: self.bind_tensor(id, Phase::ArticulatedInertia, "inertia", response.inertia),
            coupling: response
                .coupling
                .map(|row| self.bind_vector(id, Phase::ArticulatedInertia, "coupling", row)),
            mass: self.bind_tensor(id, Phase::ArticulatedInertia, "mass", response.mass),
        }
    }

    /// y by node, for torques of the hinges and loads on the nodes.
    fn reduce(
        &mut self,
        phase: Phase,
        hinges: &[Hinge],
        torques: Vec<Expr>,
        mut loads: Vec<Option<Wrench>>,
    ) -> Vec<Expr> {
        let mut reduced = torques;
        for id in (0..hinges.len()).rev().map(NodeId) {
            let Some(load) = loads[id.index()].take() else { continue };
            let load = self.bind_wrench(id, phase, "load", load);
            let [x, y, z] = load.moment;
            let torque = reduced[id.index()].clone();
            let value = self.bind_scalar(id, phase, "reduced", &torque + &x);
            if let Some(parent) = self.parent(id) {
                // Of the moment along the hinge the torque's opposite is left.
                let Wrench { force, moment } = self.carry_wrench(
                    id,
                    phase,
                    &Wrench { force: load.force, moment: [-&torque, y, z] },
                );
                let share = &hinges[id.index()].share_above;
                let carried = Wrench {
                    force: sub(&force, &scale(&value, &share.force)),
                    moment: sub(&moment, &scale(&value, &share.moment)),
                };
                let sum = &mut loads[parent.index()];
                *sum = Some(match sum.take() {
                    Some(other) => other.plus(&carried),
                    None => carried,
                });
            }
            reduced[id.index()] = value;
        }
        reduced
    }

    /// The loads of a closure force of 1 along one row: on both tips, and, where their sum is none,
    /// on the node on which both sides meet.
    fn row_loads(&mut self, closed: &Loop, row: usize) -> Vec<Option<Wrench>> {
        let mut loads: Vec<Option<Wrench>> = vec![None; self.topology.nodes.len()];
        let ancestor = self.common_ancestor(closed);
        for (tip, sign) in [(closed.ghost, 1.0), (closed.original, -1.0)] {
            if Some(tip) == ancestor {
                continue;
            }
            let load = self.unit_wrench(closed, row, tip, sign);
            let Some(meeting) = ancestor else {
                loads[tip.index()] = Some(load);
                continue;
            };
            let mut balance = load.clone();
            let mut at = tip;
            while at != meeting {
                balance = self.bind_wrench(at, Phase::ClosureRowForce, "balance", balance);
                balance = self.carry_wrench(at, Phase::ClosureRowForce, &balance);
                match self.parent(at) {
                    Some(parent) => at = parent,
                    None => break,
                }
            }
            loads[tip.index()] = Some(load);
            let opposite =
                Wrench { force: balance.force.map(|x| -&x), moment: balance.moment.map(|x| -&x) };
            let sum = &mut loads[meeting.index()];
            *sum = Some(match sum.take() {
                Some(other) => other.plus(&opposite),
                None => opposite,
            });
        }
        loads
    }

    /// du/dt by joint, from the root to the leaves: given accelerations are y / D.
    fn substituted(&mut self, hinges: &[Hinge]) -> Vec<Expr> {
        let mut accelerations = vec![Expr::zero(); hinges.len()];
        let mut motions: Vec<[Vector; 2]> = Vec::with_capacity(hinges.len());
        for id in (0..hinges.len()).map(NodeId) {
            let joint = self.joint_of(id);
            let own = self.accelerations[joint].clone();
            let ([alpha, a], held) = match self.parent(id) {
                None => ([zero(), zero()], Expr::zero()),
                Some(parent) => {
                    let [alpha, a] = motions[parent.index()].clone();
                    let share = &hinges[id.index()].share_above;
                    let held = &dot(&share.moment, &alpha) + &dot(&share.force, &a);
                    let r = self.offset(id);
                    let above = add(&a, &cross(&alpha, &r));
                    let above = self.bind_vector(id, Phase::JointAcceleration, "gain_above", above);
                    let alpha = self.down(id, Phase::JointAcceleration, &alpha);
                    let a = self.down(id, Phase::JointAcceleration, &above);
                    let alpha = self.bind_vector(id, Phase::JointAcceleration, "turn_gain", alpha);
                    ([alpha, self.bind_vector(id, Phase::JointAcceleration, "gain", a)], held)
                }
            };
            let [x, y, z] = alpha;
            let along = self.bind_scalar(id, Phase::JointAcceleration, "along_hinge", &own - &held);
            accelerations[joint] = &along - &x;
            motions.push([[along, y, z], a]);
        }
        accelerations
    }
}
