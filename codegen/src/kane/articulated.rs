//! Phase 10, articulated bodies: M du/dt = b without M, by elimination body by body from the leaves to
//! the root and back.
//!
//! The subtree beyond a hinge behaves like one body with articulated inertia, which is eliminated
//! along the hinge's x axis and then transformed to the parent (R. Featherstone, "Rigid Body
//! Dynamics Algorithms", 2008, 7.3). With moment n and force f about the node's origin,
//!
//! ```text
//! n = I alpha + H a      D = I_xx     W = (I, H) row x / D      y = tau + n_x
//! f = H^T alpha + M a    I - D W W^T is carried on, and (n, f) - W y
//! du/dt = y / D - W . (alpha, a) of the parent's motion
//! ```
//!
//! The rotor of a motor adds its inertia to D (2008, 9.6), so that the first entry of W is less than 1.
//!
//! W of a hinge is carried to the parent separately, so that no sweep has to wait for the y or the
//! du/dt of one joint before it continues with the next.
//!
//! This is M = L^T D L, y = L^-T b, du/dt = L^-1 (y / D), at a cost that grows as N. Velocities enter
//! only through b: the accelerations at du/dt = 0 are in the bias forces of [`loads`](super::loads).

use super::binder::Binder;
use super::closure::Closure;
use super::equations::Elimination;
use super::floating::{self, EliminatedBody};
use super::inertia::{Inertias, SpatialInertia};
use super::inverse::Given;
use super::kinematics::Kinematics;
use super::link::{Freedom, Link};
use super::loads::Loads;
use super::unit_rows::{row_loads, row_torques};
use super::vector::{Tensor, Vector, add, cross, dot, scale, sub, zero};
use super::wrench::{Wrench, accumulate};
use crate::program::{Phase, Section};
use crate::symbolic::Expr;
use crate::topology::NodeId;

/// Results of the elimination; see [`Elimination`](super::Elimination) for shapes.
pub struct ArticulatedBodies {
    inverse_pivots: Vec<Expr>,
    reduced: Vec<Expr>,
    reduced_rows: Vec<Expr>,
    accelerations: Vec<Expr>,
}

/// Articulated inertia of the subtree beyond a hinge, about the node's origin.
#[derive(Clone)]
struct ArticulatedInertia {
    /// I: moment per angular acceleration.
    inertia: Tensor,
    /// H: moment per acceleration, by rows.
    coupling: [Vector; 3],
    /// M: force per acceleration.
    mass: Tensor,
}

/// The result of eliminating a node's speeds.
enum Eliminated {
    Hinge(EliminatedHinge),
    Body(EliminatedBody),
}

/// The result of eliminating a node's hinge.
struct EliminatedHinge {
    /// W: row x of (I, H) divided by D, with its first entry reduced by 1.
    pivot_row: Wrench,
    /// W about the parent's origin, in the parent's frame; zero if the parent is the ground.
    in_parent: Wrench,
    /// 1 / D.
    inverse_pivot: Expr,
    /// Share of the motor's rotor in D: 1 - I_xx / D.
    rotor_share: Expr,
}

impl ArticulatedBodies {
    /// Derives the elimination.
    pub fn new(
        binder: &mut Binder,
        kinematics: &Kinematics,
        inertias: &Inertias,
        loads: &Loads,
        closure: &Closure,
        given: &Given,
    ) -> Self {
        let eliminated = eliminated(binder, kinematics, inertias.minimal());
        let links = kinematics.links();
        let mut inverse_pivots = vec![Expr::zero(); binder.mechanism().speeds()];
        let mut torques = inverse_pivots.clone();
        for (link, eliminated) in links.iter().zip(&eliminated) {
            let first = link.speeds().start;
            match eliminated {
                Eliminated::Hinge(hinge) => {
                    inverse_pivots[first] = hinge.inverse_pivot.clone();
                    let section = Section::body(link.node, Phase::JointTorque);
                    let name = format!("joint_torque_{}", binder.speed_name(first));
                    torques[first] = binder.bind(section, name, loads.torque(link.node).clone());
                }
                Eliminated::Body(body) => {
                    for (row, inverse) in body.inverse_pivots.iter().enumerate() {
                        inverse_pivots[first + floating::place(row)] = inverse.clone();
                    }
                }
            }
        }
        let bias = loads.bias().iter().cloned().map(Some).collect();
        let sweep = Sweep {
            kinematics,
            eliminated: &eliminated,
            phase: Phase::ArticulatedBiasForce,
            load: "articulated_bias".to_owned(),
            reduced: "reduced_torque".to_owned(),
        };
        let reduced = sweep.run(binder, torques, bias);
        let mut reduced_rows = Vec::new();
        for (number, row) in closure.rows().iter().enumerate() {
            let sweep = Sweep {
                kinematics,
                eliminated: &eliminated,
                phase: Phase::ReducedClosureJacobian,
                load: format!("row{number}"),
                reduced: format!("reduced_jacobian_{number}"),
            };
            let torques = vec![Expr::zero(); inverse_pivots.len()];
            let (torques, loads) = match kinematics.closed(row.closed).is_in_tree {
                true => (torques, row_loads(binder, kinematics, row, number)),
                false => row_torques(kinematics, closure, number, torques.len()),
            };
            reduced_rows.extend(sweep.run(binder, torques, loads));
        }
        let accelerations = substituted(binder, kinematics, &eliminated, given);
        Self { inverse_pivots, reduced, reduced_rows, accelerations }
    }
}

impl ArticulatedBodies {
    /// Returns the results as plain data.
    pub fn elimination(&self, binder: &Binder) -> Elimination {
        Elimination {
            inverse_pivots: binder.trees(&self.inverse_pivots),
            reduced: binder.trees(&self.reduced),
            reduced_rows: binder.trees(&self.reduced_rows),
            accelerations: binder.trees(&self.accelerations),
        }
    }
}

impl ArticulatedInertia {
    fn of(body: &SpatialInertia) -> Self {
        let [x, y, z] = &body.first_moment;
        let zero = Expr::zero;
        let m = &body.mass;
        Self {
            inertia: body.rotational(),
            coupling: [[zero(), -z, y.clone()], [z.clone(), zero(), -x], [-y, x.clone(), zero()]],
            mass: [m.clone(), zero(), zero(), m.clone(), zero(), m.clone()],
        }
    }

    fn bound(self, binder: &mut Binder, node: NodeId, name: &str) -> Self {
        let phase = Phase::ArticulatedInertia;
        let [inertia, coupling, mass] =
            ["inertia", "coupling", "mass"].map(|part| format!("{name}_{part}"));
        Self {
            inertia: binder.tensor(node, phase, &inertia, self.inertia),
            coupling: binder.matrix(node, phase, &coupling, self.coupling),
            mass: binder.tensor(node, phase, &mass, self.mass),
        }
    }

    fn plus(&self, other: &Self) -> Self {
        Self {
            inertia: add(&self.inertia, &other.inertia),
            coupling: [0, 1, 2].map(|row| add(&self.coupling[row], &other.coupling[row])),
            mass: add(&self.mass, &other.mass),
        }
    }

    /// Returns the same inertia about a point from which this inertia's reference point is at `r`:
    /// H' = H + [r]x M, I' = I - H' [r]x + [r]x H^T.
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

/// Eliminates the speeds of every node, from the leaves to the root.
fn eliminated(
    binder: &mut Binder,
    kinematics: &Kinematics,
    inertias: &[SpatialInertia],
) -> Vec<Eliminated> {
    let phase = Phase::ArticulatedInertia;
    let mut bodies: Vec<_> = inertias.iter().map(ArticulatedInertia::of).collect();
    let mut eliminated = Vec::with_capacity(bodies.len());
    for link in kinematics.links().iter().rev() {
        let node = link.node;
        let body = bodies[node.index()].clone().bound(binder, node, "articulated");
        if let Freedom::Free(_) = &link.freedom {
            let ArticulatedInertia { inertia, coupling, mass } = &body;
            let body = EliminatedBody::new(binder, node, inertia, coupling, mass);
            eliminated.push(Eliminated::Body(body));
            continue;
        }
        let [own, y, z, ..] = body.inertia.clone();
        let pivot = &own + &link.rotor;
        let inverse_pivot = binder.scalar(node, phase, "inverse_pivot", pivot.power(-1));
        let rotor_share = &link.rotor * &inverse_pivot;
        let rotor_share = binder.scalar(node, phase, "rotor_share", rotor_share);
        let mut moment = scale(&inverse_pivot, &[Expr::zero(), y, z]);
        moment[0] = -&rotor_share;
        let pivot_row = Wrench { force: scale(&inverse_pivot, &body.coupling[0]), moment };
        let pivot_row = binder.wrench(node, phase, "pivot_row", pivot_row);
        let in_parent = Wrench::zero();
        let mut hinge = EliminatedHinge { pivot_row, in_parent, inverse_pivot, rotor_share };
        if let Some(parent) = link.parent {
            hinge.in_parent = link.carry_wrench(binder, phase, "pivot_row", &hinge.pivot_row);
            let carried = carried(binder, link, &body, &hinge);
            bodies[parent.index()] = bodies[parent.index()].plus(&carried);
        }
        eliminated.push(Eliminated::Hinge(hinge));
    }
    eliminated.reverse();
    eliminated
}

/// Returns what a node with a free hinge contributes to its parent, about the parent's origin.
fn carried(
    binder: &mut Binder,
    link: &Link,
    body: &ArticulatedInertia,
    hinge: &EliminatedHinge,
) -> ArticulatedInertia {
    let ArticulatedInertia { inertia: [xx, xy, xz, yy, yz, zz], coupling, mass } = body;
    let Wrench { force: w, moment: [_, wy, wz] } = &hinge.pivot_row;
    let row = &coupling[0];
    // Only a rotor that resists the turn lets a part of row x through.
    let left = |x: &Expr| &hinge.rotor_share * x;
    let [yy, yz, zz] = [yy - &(xy * wy), yz - &(xy * wz), zz - &(xz * wz)];
    let inertia = [left(xx), left(xy), left(xz), yy, yz, zz];
    let coupling = [
        scale(&hinge.rotor_share, row),
        sub(&coupling[1], &scale(xy, w)),
        sub(&coupling[2], &scale(xz, w)),
    ];
    let pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
    let mut terms = pairs.map(|(i, k)| &row[i] * &w[k]).into_iter();
    let mass = mass.clone().map(|m| &m - &terms.next().unwrap_or_else(Expr::zero));
    let phase = Phase::ArticulatedInertia;
    let projected = ArticulatedInertia { inertia, coupling, mass };
    let projected = projected.bound(binder, link.node, "projected");
    let turned = ArticulatedInertia {
        inertia: link.turn_tensor(binder, phase, "projected_inertia", &projected.inertia),
        coupling: link.turn_matrix(binder, phase, "projected_coupling", &projected.coupling),
        mass: link.turn_tensor(binder, phase, "projected_mass", &projected.mass),
    };
    turned.bound(binder, link.node, "projected_in_parent").about(&link.offset)
}

/// A sweep from the leaves to the root that reduces torques and loads to y. It holds the names of the
/// intermediates that it binds.
struct Sweep<'a> {
    kinematics: &'a Kinematics,
    eliminated: &'a [Eliminated],
    phase: Phase,
    load: String,
    reduced: String,
}

impl Sweep<'_> {
    /// Returns y by speed, for torques by speed and loads by node.
    fn run(
        &self,
        binder: &mut Binder,
        torques: Vec<Expr>,
        mut loads: Vec<Option<Wrench>>,
    ) -> Vec<Expr> {
        let phase = self.phase;
        let mut reduced = torques;
        for link in self.kinematics.links().iter().rev() {
            let node = link.node;
            let Some(load) = loads[node.index()].take() else { continue };
            let load = binder.wrench(node, phase, &self.load, load);
            let first = link.speeds().start;
            let [x, y, z] = load.moment;
            let hinge = match &self.eliminated[node.index()] {
                Eliminated::Hinge(hinge) => hinge,
                Eliminated::Body(body) => {
                    let [fx, fy, fz] = load.force;
                    let b = [x, y, z, fx, fy, fz];
                    let values = body.reduce(binder, node, phase, &self.reduced, b);
                    for (row, value) in values.into_iter().enumerate() {
                        reduced[first + floating::place(row)] = value;
                    }
                    continue;
                }
            };
            let torque = reduced[first].clone();
            let value = binder.scalar(node, phase, &self.reduced, &torque + &x);
            if let Some(parent) = link.parent {
                // After the elimination, the moment along the hinge is the negative torque.
                let load = Wrench { force: load.force, moment: [-&torque, y, z] };
                let load = link.carry_wrench(binder, phase, &self.load, &load);
                let carried = load.minus(&hinge.in_parent.times(&value));
                accumulate(&mut loads[parent.index()], carried);
            }
            reduced[first] = value;
        }
        reduced
    }
}

/// Returns du/dt, computed from the root to the leaves. The given accelerations are y / D.
fn substituted(
    binder: &mut Binder,
    kinematics: &Kinematics,
    eliminated: &[Eliminated],
    given: &Given,
) -> Vec<Expr> {
    let phase = Phase::JointAcceleration;
    let given = given.accelerations();
    let mut accelerations = vec![Expr::zero(); given.len()];
    let mut motions: Vec<[Vector; 2]> = Vec::with_capacity(eliminated.len());
    for (link, eliminated) in kinematics.links().iter().zip(eliminated) {
        let (node, first) = (link.node, link.speeds().start);
        let hinge = match (eliminated, &link.freedom) {
            (Eliminated::Hinge(hinge), _) => hinge,
            (Eliminated::Body(body), freedom) => {
                let own = std::array::from_fn(|row| given[first + floating::place(row)].clone());
                let [alpha, a] = body.substitute(binder, node, phase, own);
                if let Freedom::Free(free) = freedom {
                    let linear = free.acceleration_of_centre(&alpha, &a);
                    for (k, value) in linear.iter().chain(&alpha).enumerate() {
                        accelerations[first + k] = value.clone();
                    }
                }
                motions.push([alpha, a]);
                continue;
            }
        };
        let ([alpha, a], held) = match link.parent {
            None => ([zero(), zero()], Expr::zero()),
            Some(parent) => {
                let [alpha, a] = &motions[parent.index()];
                let held = &dot(&hinge.in_parent.moment, alpha) + &dot(&hinge.in_parent.force, a);
                let a = add(a, &cross(alpha, &link.offset));
                let a = binder.vector(node, phase, "acceleration_in_parent", a);
                let alpha = link.down(binder, phase, "parent_alpha", alpha);
                let a = link.down(binder, phase, "acceleration", &a);
                let alpha = binder.vector(node, phase, "parent_alpha", alpha);
                ([alpha, binder.vector(node, phase, "acceleration", a)], held)
            }
        };
        let [x, y, z] = alpha;
        let [along] = binder.components(node, phase, "alpha", ["x"], [&given[first] - &held]);
        accelerations[first] = &along - &x;
        motions.push([[along, y, z], a]);
    }
    accelerations
}
