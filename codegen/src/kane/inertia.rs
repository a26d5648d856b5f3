//! Inertia of the nodes, and which part of it moves a hinge.
//!
//! Mass spread along a hinge line moves the same whether it belongs to the body beyond the hinge
//! or to the one before. Such a line has three numbers (mass, first and second moment along the
//! line, of any sign): each node's are passed on to its parent, those at the ground move nothing.
//! Seven numbers of ten are left, M and f stay what they are. (The minimal inertial parameters of
//! M. Gautier and W. Khalil, "Direct calculation of minimum set of inertial parameters of serial
//! robots", 1990.)

use nalgebra::{Matrix3, Vector3};

use super::derivation::Derivation;
use super::vector::{Tensor, Vector, scale};
use crate::symbolic::Expr;
use crate::topology::NodeId;

/// Relative to the largest: moments below this are rounding of the drawing.
const ROUNDING: f64 = 1e-14;

/// Inertia of a body or a composite about its frame's origin, in its frame.
#[derive(Clone)]
pub struct Inertia {
    /// kg.
    pub mass: Expr,
    /// Mass times centre of mass, kg m.
    pub moment: Vector,
    /// int x x^T dm, kg m^2.
    pub second: Tensor,
}

impl Inertia {
    /// I = tr(S) 1 - S, kg m^2.
    pub fn tensor(&self) -> Tensor {
        let [xx, xy, xz, yy, yz, zz] = &self.second;
        [yy + zz, -xy, -xz, xx + zz, -yz, xx + yy]
    }
}

/// Moments of a distribution of mass about a frame's origin.
#[derive(Clone)]
struct Moments {
    /// kg.
    mass: f64,
    /// int x dm, kg m.
    first: Vector3<f64>,
    /// int x x^T dm, kg m^2.
    second: Matrix3<f64>,
}

impl Derivation<'_> {
    /// By node: its share of its body.
    pub fn shares(&mut self) -> Vec<Inertia> {
        let nodes = self.topology.nodes.len();
        (0..nodes).map(NodeId).map(|id| self.inertia(id, &self.moments(id))).collect()
    }

    /// By node: what is left of its share and of what its children pass on, when what moves no
    /// hinge beyond its own is passed on in turn.
    pub fn moving_parts(&mut self) -> Vec<Inertia> {
        let nodes = || (0..self.topology.nodes.len()).map(NodeId);
        let mut moments: Vec<_> = nodes().map(|id| self.moments(id)).collect();
        for id in nodes().rev() {
            let parent = self.parent(id);
            // What scales with a parameter stays where it is.
            if [Some(id), parent].into_iter().flatten().any(|id| self.scales(id)) {
                continue;
            }
            let line = moments[id.index()].take_line();
            if let Some(parent) = parent {
                let to = self.frame(Some(parent));
                let hinge = &self.frames[id.index()];
                let along = Vector3::from(to.direction(&hinge.axes.column(0).into()));
                let origin = to.coordinates(&hinge.origin, self.mechanism().size);
                moments[parent.index()].add_line(line, &Vector3::from(origin), &along);
            }
        }
        nodes().zip(&moments).map(|(id, moments)| self.inertia(id, moments)).collect()
    }

    fn scales(&self, node: NodeId) -> bool {
        let body = self.topology.nodes[node.index()].body;
        self.mechanism().bodies[body.index()].mass_parameter.is_some()
    }

    /// Moments of the node's share of its body; with a tunable mass, of one kilogram of the body.
    fn moments(&self, id: NodeId) -> Moments {
        let node = &self.topology.nodes[id.index()];
        let properties = &self.mechanism().bodies[node.body.index()].mass_properties;
        let frame = self.frame(Some(id));
        let com = Vector3::from(frame.coordinates(&properties.com, self.mechanism().size));
        let central = frame.tensor(&properties.inertia);
        let share = if self.scales(id) { node.share / properties.mass } else { node.share };
        let mass = properties.mass * share;
        let spread = Matrix3::identity() * (0.5 * central.trace()) - central;
        Moments { mass, first: com * mass, second: spread * share + com * com.transpose() * mass }
    }

    fn inertia(&mut self, id: NodeId, moments: &Moments) -> Inertia {
        let second = &moments.second;
        let least = ROUNDING * second.amax();
        let of = |at| if f64::abs(second[at]) <= least { 0.0 } else { second[at] };
        let second = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(of);
        let mass = self.constant(moments.mass);
        let moment = self.constants(moments.first.into());
        let second = self.constants(second);
        let body = self.topology.nodes[id.index()].body;
        match self.mechanism().bodies[body.index()].mass_parameter {
            None => Inertia { mass, moment, second },
            Some(parameter) => {
                let by = self.parameters[parameter.index()].clone();
                Inertia {
                    mass: &by * &mass,
                    moment: scale(&by, &moment),
                    second: scale(&by, &second),
                }
            }
        }
    }
}

impl Moments {
    /// Removes the line along x that leaves no mass, no first and no second moment along x:
    /// returns these three.
    fn take_line(&mut self) -> [f64; 3] {
        let line = [self.mass, self.first.x, self.second[(0, 0)]];
        self.mass = 0.0;
        self.first.x = 0.0;
        self.second[(0, 0)] = 0.0;
        line
    }

    /// Adds a line through `origin`.
    fn add_line(
        &mut self,
        [mass, first, second]: [f64; 3],
        origin: &Vector3<f64>,
        along: &Vector3<f64>,
    ) {
        let mixed = along * origin.transpose();
        self.mass += mass;
        self.first += origin * mass + along * first;
        self.second += origin * origin.transpose() * mass
            + (mixed + mixed.transpose()) * first
            + along * along.transpose() * second;
    }
}
