//! Phase 1, spatial inertia: the inertia of each node's share of its body, and the part of it that
//! affects a hinge.
//!
//! Mass distributed along a hinge line moves in the same way whether it belongs to the body beyond the
//! hinge or to the body before it. Such a line has three numbers (mass, first and second moment along
//! the line, of any sign). The three numbers of each node are passed on to its parent, and at the
//! ground they have no effect. Seven of ten parameters are left per node, while M and f stay the same.
//! (The minimal inertial parameters of M. Gautier and W. Khalil, "Direct calculation of minimum set of
//! inertial parameters of serial robots", 1990.)

use crate::program::Quantity;
use nalgebra::{Matrix3, Vector3};
use num_traits::Zero;

use super::binder::Binder;
use super::facts::{AXES, SYMMETRIC};
use super::frame::Frames;
use super::vector::{Tensor, Vector, add, apply, cross, scale};
use super::wrench::Wrench;
use crate::laminate::{Number, Real};
use crate::symbolic::Expr;
use crate::topology::{Connection, Node, NodeId};

/// Moments below this, relative to the largest, are rounding errors of the drawing.
const ROUNDING: f64 = 1e-14;

/// Names of the numbers of a spatial inertia: mass, first moments and second moments.
type Quantities = [Quantity; 3];

const WHOLE: Quantities = [
    Quantity::new("mass", "mass, kg"),
    Quantity::new("first_moment", "mass times centre of mass, kg m"),
    Quantity::new("second_moment", "second moments of mass about its origin, kg m^2"),
];

const MINIMAL: Quantities = [
    Quantity::new("minimal_mass", "minimal inertial parameter: mass, kg"),
    Quantity::new(
        "minimal_first_moment",
        "minimal inertial parameters: mass times centre of mass, kg m",
    ),
    Quantity::new(
        "minimal_second_moment",
        "minimal inertial parameters: second moments of mass about its origin, kg m^2",
    ),
];

/// Spatial inertia of a body or a composite about its frame's origin, in its frame.
#[derive(Clone)]
pub struct SpatialInertia {
    /// m, kg.
    pub mass: Expr,
    /// h: mass times centre of mass, kg m.
    pub first_moment: Vector,
    /// S: int x x^T dm, kg m^2.
    pub second_moment: Tensor,
}

/// The spatial inertia of every node.
pub struct Inertias {
    whole: Vec<SpatialInertia>,
    minimal: Vec<SpatialInertia>,
}

impl SpatialInertia {
    /// Returns the rotational inertia I = tr(S) 1 - S, kg m^2.
    pub fn rotational(&self) -> Tensor {
        let [xx, xy, xz, yy, yz, zz] = &self.second_moment;
        [yy + zz, -xy, -xz, xx + zz, -yz, xx + yy]
    }

    /// Returns the sum of two inertias about the same point.
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            mass: &self.mass + &other.mass,
            first_moment: add(&self.first_moment, &other.first_moment),
            second_moment: add(&self.second_moment, &other.second_moment),
        }
    }

    /// Returns the wrench that gives a body at rest the accelerations alpha and a: f = alpha x h + m a,
    /// n = I alpha + h x a. The same formula gives the momentum at the velocities alpha and a.
    pub fn wrench(&self, alpha: &Vector, a: &Vector) -> Wrench {
        let h = &self.first_moment;
        Wrench {
            force: add(&cross(alpha, h), &scale(&self.mass, a)),
            moment: add(&apply(&self.rotational(), alpha), &cross(h, a)),
        }
    }
}

const UNDIVIDED: Quantities = [
    Quantity::new("undivided_mass", "as minimal_mass, if no body is cut, kg"),
    Quantity::new("undivided_first_moment", "as minimal_first_moment, if no body is cut, kg m"),
    Quantity::new("undivided_second_moment", "as minimal_second_moment, if no body is cut, kg m^2"),
];

impl Inertias {
    /// Derives both inertias of every node.
    pub fn new(binder: &mut Binder, frames: &Frames) -> Self {
        let share = |node: &Node| node.share;
        let shares: Vec<Moments> =
            binder.nodes().map(|node| moments(binder, frames, node, share)).collect();
        let whole = nodes(binder, &WHOLE, &shares);
        let minimal = nodes(binder, &MINIMAL, &minimal(binder, frames, shares));
        Self { whole, minimal }
    }

    /// Derives the minimal inertial parameters of every node for bodies that are not shared with their
    /// ghosts, which have none.
    pub fn of_whole_bodies(binder: &mut Binder, frames: &Frames) -> Self {
        let share = |node: &Node| if node.ghost.is_none() { 1.0 } else { 0.0 };
        let moments: Vec<Moments> =
            binder.nodes().map(|node| moments(binder, frames, node, share)).collect();
        let minimal = nodes(binder, &UNDIVIDED, &minimal(binder, frames, moments));
        Self { whole: Vec::new(), minimal }
    }

    /// Returns, by node, the inertia of its share of its body, which energies and hinge reactions need.
    pub fn whole(&self) -> &[SpatialInertia] {
        &self.whole
    }

    /// Returns, by node, the minimal inertial parameters, which suffice for M and f.
    pub fn minimal(&self) -> &[SpatialInertia] {
        &self.minimal
    }
}

/// Moments of a mass distribution about a frame's origin.
#[derive(Clone)]
struct Moments {
    /// Mass: int dm, kg.
    mass: Number,
    /// First moment: int x dm, kg m.
    first: Vector3<Number>,
    /// Second moment: int x x^T dm, kg m^2.
    second: Matrix3<Number>,
}

/// Returns the moments of a node's share of its body. If the mass is tunable, they are per kilogram of
/// the body.
fn moments(binder: &Binder, frames: &Frames, id: NodeId, share: impl Fn(&Node) -> f64) -> Moments {
    let mechanism = binder.mechanism();
    let (node, frame) = (&binder.topology().nodes[id.index()], frames.of(id));
    let properties = binder.geometry().mass_properties(mechanism, node.body);
    let com = Vector3::from(frame.coordinates(&properties.com, mechanism.size));
    let central = frame.tensor(&properties.inertia);
    let is_tunable = has_tunable_mass(binder, id);
    let share = Number::from(share(node));
    let share = if is_tunable { share / properties.mass.clone() } else { share };
    let mass = properties.mass * share.clone();
    let spread = Matrix3::identity() * (Number::from(0.5) * central.trace()) - central;
    let second = spread * share + &com * com.transpose() * mass.clone();
    Moments { first: com * mass.clone(), mass, second }
}

/// Returns the minimal moments of each node: its own moments and those that its children pass on,
/// without the part that does not affect the mass matrix, which is passed on to the parent.
fn minimal(binder: &Binder, frames: &Frames, mut moments: Vec<Moments>) -> Vec<Moments> {
    let size = binder.mechanism().size;
    for node in binder.nodes().rev() {
        let Node { parent, connection, .. } = binder.topology().nodes[node.index()];
        // No line of a free body's mass stays at rest.
        if matches!(connection, Connection::Free(_)) {
            continue;
        }
        // Nothing is passed on from or to a node whose mass scales with a parameter.
        let mut ends = [Some(node), parent].into_iter().flatten();
        if ends.any(|node| has_tunable_mass(binder, node)) {
            continue;
        }
        let line = moments[node.index()].take_line();
        if let Some(parent) = parent {
            let (hinge, to) = (frames.of(node), frames.of(parent));
            let along = Vector3::from(to.direction(&hinge.axes.column(0).into_owned()));
            let origin = to.coordinates(&hinge.origin, size);
            moments[parent.index()].add_line(line, &Vector3::from(origin), &along);
        }
    }
    moments
}

fn has_tunable_mass(binder: &Binder, node: NodeId) -> bool {
    let body = binder.topology().nodes[node.index()].body;
    binder.mechanism().bodies[body.index()].mass_parameter.is_some()
}

/// Returns the moments of every node as expressions.
fn nodes(binder: &mut Binder, names: &Quantities, moments: &[Moments]) -> Vec<SpatialInertia> {
    let nodes = binder.nodes().zip(moments);
    nodes.map(|(node, moments)| inertia(binder, names, node, moments)).collect()
}

fn inertia(
    binder: &mut Binder,
    names: &Quantities,
    node: NodeId,
    moments: &Moments,
) -> SpatialInertia {
    let second = &moments.second;
    let least = ROUNDING * second.map(|x| x.value()).amax();
    let of = |at: (usize, usize)| second[at].clone().rounded(least);
    let second = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(of);
    let [mass_name, first_name, second_name] = names.clone();
    let mass = binder.fact(node, mass_name, moments.mass.clone());
    let first_moment = binder.facts_of(node, first_name, AXES, moments.first.clone().into());
    let second_moment = binder.facts_of(node, second_name, SYMMETRIC, second);
    let body = binder.topology().nodes[node.index()].body;
    match binder.mechanism().bodies[body.index()].mass_parameter {
        None => SpatialInertia { mass, first_moment, second_moment },
        Some(parameter) => {
            let by = binder.parameter(parameter);
            SpatialInertia {
                mass: &by * &mass,
                first_moment: scale(&by, &first_moment),
                second_moment: scale(&by, &second_moment),
            }
        }
    }
}

impl Moments {
    /// Removes from the moments a line of mass along x, so that no mass and no first and second moment
    /// along x are left, and returns these three numbers.
    fn take_line(&mut self) -> [Number; 3] {
        let taken = [&mut self.mass, &mut self.first.x, &mut self.second[(0, 0)]];
        taken.map(|moment| std::mem::replace(moment, Number::zero()))
    }

    /// Adds a line of mass through `origin`.
    fn add_line(
        &mut self,
        [mass, first, second]: [Number; 3],
        origin: &Vector3<Number>,
        along: &Vector3<Number>,
    ) {
        let mixed = along * origin.transpose();
        self.mass += mass.clone();
        self.first += origin * mass.clone() + along * first.clone();
        self.second += origin * origin.transpose() * mass
            + (mixed.transpose() + mixed) * first
            + along * along.transpose() * second;
    }
}
