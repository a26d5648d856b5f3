//! A rigid tree with loops, formulated independently of Kane's equations: forward kinematics by
//! products of rotations, M and f from velocity Jacobians and Newton-Euler, in nalgebra.

#![allow(dead_code, reason = "each test file uses its part")]

#[path = "../../../tests/src/compare.rs"]
pub mod compare;
pub mod designs;
pub mod failing;
pub mod free_body;
pub mod planar;
#[path = "../../../tests/src/uniform.rs"]
pub mod uniform;

use std::marker::PhantomData;

use lamc_runtime::plumbing::{Dimensions, EquationsMut, workspace_len};
use lamc_runtime::{Energy, Error, Mechanism, Scalar, State};
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

pub type V3 = Vector3<f64>;

/// A body and the hinge that carries it; flat coordinates, the hinge along `axis` through `at`.
#[derive(Clone, Debug)]
pub struct Body {
    pub parent: Option<usize>,
    pub at: V3,
    pub axis: V3,
    pub mass: f64,
    pub com: V3,
    pub inertia: Matrix3<f64>,
    pub stiffness: f64,
    pub damping: f64,
    pub guess: Option<f64>,
    pub limits: [f64; 2],
}

/// Two bodies of the tree that are one: three points drawn on both must coincide.
#[derive(Clone, Debug)]
pub struct Loop {
    pub original: Option<usize>,
    pub ghost: usize,
    pub points: [V3; 3],
}

/// Joint j carries body j; parents come first.
#[derive(Clone, Debug)]
pub struct Tree<S> {
    pub bodies: Vec<Body>,
    pub loops: Vec<Loop>,
    /// Which of the nine rows of each loop the acceleration uses.
    pub rows: Vec<usize>,
    pub gravity: V3,
    pub size: f64,
    pub scalar: PhantomData<S>,
}

/// Motion of one body.
#[derive(Clone, Copy)]
struct Motion {
    rotation: Matrix3<f64>,
    position: V3,
    omega: V3,
    velocity: V3,
    /// Accelerations without the part of du/dt.
    alpha: V3,
    acceleration: V3,
    /// World axis and a point of it.
    axis: V3,
    at: V3,
}

const GROUND: Motion = Motion {
    rotation: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
    position: V3::new(0.0, 0.0, 0.0),
    omega: V3::new(0.0, 0.0, 0.0),
    velocity: V3::new(0.0, 0.0, 0.0),
    alpha: V3::new(0.0, 0.0, 0.0),
    acceleration: V3::new(0.0, 0.0, 0.0),
    axis: V3::new(0.0, 0.0, 0.0),
    at: V3::new(0.0, 0.0, 0.0),
};

impl Motion {
    fn point(&self, drawn: V3) -> V3 {
        self.rotation * drawn + self.position
    }
    fn velocity(&self, point: V3) -> V3 {
        self.velocity + self.omega.cross(&(point - self.position))
    }
    fn acceleration(&self, point: V3) -> V3 {
        let arm = point - self.position;
        self.acceleration + self.alpha.cross(&arm) + self.omega.cross(&self.omega.cross(&arm))
    }
}

impl<S> Tree<S> {
    fn motions(&self, q: &[f64], u: &[f64]) -> Vec<Motion> {
        let mut motions: Vec<Motion> = Vec::new();
        for (j, body) in self.bodies.iter().enumerate() {
            let parent = body.parent.map_or(GROUND, |parent| motions[parent]);
            let turn = Rotation3::from_axis_angle(&Unit::new_normalize(body.axis), q[j]);
            let rotation = parent.rotation * turn.matrix();
            let at = parent.point(body.at);
            let position = at - rotation * body.at;
            let axis = parent.rotation * body.axis.normalize();
            let omega = parent.omega + axis * u[j];
            let alpha = parent.alpha + parent.omega.cross(&axis) * u[j];
            let arm = position - at;
            motions.push(Motion {
                rotation,
                position,
                omega,
                velocity: parent.velocity(at) + omega.cross(&arm),
                alpha,
                acceleration: parent.acceleration(at)
                    + alpha.cross(&arm)
                    + omega.cross(&omega.cross(&arm)),
                axis,
                at,
            });
        }
        motions
    }

    fn ancestors(&self, body: Option<usize>) -> impl Iterator<Item = usize> {
        std::iter::successors(body, |&body| self.bodies[body].parent)
    }

    /// Rows of d(point)/dq.
    fn point_jacobian(&self, motions: &[Motion], body: Option<usize>, point: V3) -> Vec<V3> {
        let mut columns = vec![V3::zeros(); self.bodies.len()];
        for j in self.ancestors(body) {
            columns[j] = motions[j].axis.cross(&(point - motions[j].at));
        }
        columns
    }

    /// Residual, its columns by q, and the bias of the second derivative, per closure point.
    fn closure_points(&self, q: &[f64], u: &[f64]) -> Vec<(V3, Vec<V3>, V3)> {
        let motions = self.motions(q, u);
        let mut points = Vec::new();
        for each in &self.loops {
            let original = each.original.map_or(GROUND, |body| motions[body]);
            let ghost = motions[each.ghost];
            for drawn in each.points {
                let (a, b) = (original.point(drawn), ghost.point(drawn));
                let first = self.point_jacobian(&motions, each.original, a);
                let second = self.point_jacobian(&motions, Some(each.ghost), b);
                let columns = second.iter().zip(first).map(|(b, a)| b - a).collect();
                points.push((b - a, columns, ghost.acceleration(b) - original.acceleration(a)));
            }
        }
        points
    }

    /// M and f, row-major.
    fn dynamics(&self, q: &[f64], u: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let n = self.bodies.len();
        let motions = self.motions(q, u);
        let (mut mass, mut forcing) = (vec![0.0; n * n], vec![0.0; n]);
        for (i, body) in self.bodies.iter().enumerate() {
            let motion = motions[i];
            let com = motion.point(body.com);
            let inertia = motion.rotation * body.inertia * motion.rotation.transpose();
            let linear = self.point_jacobian(&motions, Some(i), com);
            let mut angular = vec![V3::zeros(); n];
            for j in self.ancestors(Some(i)) {
                angular[j] = motions[j].axis;
            }
            let force = body.mass * (self.gravity - motion.acceleration(com));
            let moment = -(inertia * motion.alpha + motion.omega.cross(&(inertia * motion.omega)));
            for r in 0..n {
                for s in 0..n {
                    mass[r * n + s] += body.mass * linear[r].dot(&linear[s])
                        + angular[r].dot(&(inertia * angular[s]));
                }
                forcing[r] += linear[r].dot(&force) + angular[r].dot(&moment);
            }
            forcing[i] -= body.stiffness * q[i] + body.damping * u[i];
        }
        (mass, forcing)
    }
}

fn wide<S: Scalar>(values: &[S]) -> Vec<f64> {
    values.iter().map(|value| value.to_f64()).collect()
}

fn store<S: Scalar>(out: &mut [S], values: impl IntoIterator<Item = f64>) {
    for (out, value) in out.iter_mut().zip(values) {
        *out = S::from_f64(value);
    }
}

impl<S: Scalar> Mechanism for Tree<S> {
    type Scalar = S;
    type Coordinates = Vec<S>;
    type Speeds = Vec<S>;
    type Matrix = Vec<S>;
    type Workspace = Vec<S>;
    type Poses = Vec<[S; 12]>;
    type Points = [[S; 3]; 0];

    fn dimensions(&self) -> Dimensions {
        Dimensions {
            rows: self.rows.len() * self.loops.len(),
            rank: self.rows.len() * self.loops.len(),
            loops: self.loops.len(),
            bodies: self.bodies.len(),
            ..Dimensions::of_joints(self.bodies.len())
        }
    }
    fn matrix(&self) -> Vec<S> {
        vec![S::ZERO; self.bodies.len() * self.bodies.len()]
    }

    fn speeds(&self) -> Vec<S> {
        vec![S::ZERO; self.bodies.len()]
    }
    fn workspace(&self) -> Vec<S> {
        vec![S::ZERO; workspace_len(self.dimensions())]
    }
    fn size(&self) -> S {
        S::from_f64(self.size)
    }
    fn limits(&self, joint: usize) -> [S; 2] {
        self.bodies[joint].limits.map(S::from_f64)
    }
    fn initial(&self) -> State<Vec<S>, S> {
        let guess = |body: &Body| S::from_f64(body.guess.unwrap_or(0.0));
        State { t: S::ZERO, q: self.bodies.iter().map(guess).collect(), u: self.speeds() }
    }
    fn is_pinned(&self, joint: usize) -> bool {
        self.bodies[joint].guess.is_some()
    }
    fn write_equations(
        &self,
        _: S,
        q: &[S],
        u: &[S],
        out: EquationsMut<'_, S>,
    ) -> Result<(), Error> {
        let (q, u) = (wide(q), wide(u));
        let (mass, forcing) = self.dynamics(&q, &u);
        store(out.mass, mass);
        store(out.forcing, forcing);
        let points = self.closure_points(&q, &u);
        let rows = points
            .chunks(3)
            .flat_map(|points| self.rows.iter().map(move |row| (&points[row / 3], row % 3)));
        let jacobian = rows
            .clone()
            .flat_map(|((_, columns, _), axis)| columns.iter().map(move |column| column[axis]));
        store(out.jacobian, jacobian);
        store(out.gamma, rows.map(|((_, _, bias), axis)| bias[axis]));
        Ok(())
    }
    fn write_closure(&self, q: &[S], residual: &mut [S], jacobian: &mut [S]) -> Result<(), Error> {
        let q = wide(q);
        let points = self.closure_points(&q, &vec![0.0; q.len()]);
        store(residual, points.iter().flat_map(|(residual, ..)| residual.iter().copied()));
        let rows = points.iter().flat_map(|(_, columns, _)| {
            (0..3).flat_map(move |axis| columns.iter().map(move |column| column[axis]))
        });
        store(jacobian, rows);
        Ok(())
    }
    fn energy(&self, _: S, q: &Vec<S>, u: &Vec<S>) -> Result<Energy<S>, Error> {
        let (q, u) = (wide(q), wide(u));
        let (mut kinetic, mut potential) = (0.0, 0.0);
        for ((body, motion), q) in self.bodies.iter().zip(self.motions(&q, &u)).zip(&q) {
            let com = motion.point(body.com);
            let inertia = motion.rotation * body.inertia * motion.rotation.transpose();
            kinetic += body.mass * motion.velocity(com).norm_squared() / 2.0
                + motion.omega.dot(&(inertia * motion.omega)) / 2.0;
            potential += body.stiffness * q * q / 2.0 - body.mass * self.gravity.dot(&com);
        }
        Ok(Energy { kinetic: S::from_f64(kinetic), potential: S::from_f64(potential) })
    }
    fn poses(&self, q: &Vec<S>) -> Result<Vec<[S; 12]>, Error> {
        let q = wide(q);
        let motions = self.motions(&q, &vec![0.0; q.len()]);
        let pose = |motion: &Motion| {
            let rotation = motion.rotation.transpose();
            let numbers: Vec<f64> =
                rotation.iter().copied().chain(motion.position.iter().copied()).collect();
            std::array::from_fn(|i| S::from_f64(numbers[i]))
        };
        Ok(motions.iter().map(pose).collect())
    }
    fn points(&self, _: &Vec<S>) -> Result<Self::Points, Error> {
        Ok([])
    }
}
