//! The forces of one plane on the points of one body, in the body's frame.
//!
//! The body's frame has its z axis along the normal of the sheet, so the corners of one face of a plate have
//! the same z: what depends on z is computed once for a face.
//!
//! ```text
//! height over the plane:  h + n_z z   + n_x x + n_y y
//! velocity:               v_x + w_y z - w_z y,   v_y - w_x z + w_z x,   v_z + w_x y - w_y x
//! ```

use super::binder::Binder;
use super::contact::{Carrier, Seen, Touching};
use super::facts::AXES;
use super::vector::{Vector, add, dot, scale, sub, zero};
use super::wrench::Wrench;
use crate::laminate::{Contact, PlateOutline};
use crate::program::{Fact, Phase, Section, Subject};
use crate::symbolic::{Expr, Function};

/// The numbers of a contact's law.
pub struct Law {
    /// k, N/m.
    pub stiffness: Expr,
    /// c, s/m.
    dissipation: Expr,
    /// mu.
    pub friction: Expr,
    /// s^2, m^2/s^2.
    slip: Expr,
}

/// The forces on the points of one body.
pub struct Touched {
    /// Each point, m, and the force on it, N, in the body's frame.
    pub forces: Vec<(Vector, Vector)>,
    /// Their wrench about the body's origin.
    pub wrench: Wrench,
    /// Sum of the squares of the depths, m^2.
    pub squares: Expr,
    /// Each point and its plane.
    pub gaps: Vec<PointGap>,
}

/// A point and its plane.
pub struct PointGap {
    /// Height over the plane, m.
    pub height: Expr,
    /// Distance from the edges and the back of the plate that carries the plane, m, positive inside; if it ends.
    pub within: Option<Expr>,
    /// Velocity relative to the body of the plane, in the point's body, m/s.
    pub velocity: Vector,
}

/// What the points of one face have in common.
struct Face {
    z: Expr,
    /// Height and velocity of the face's points at x = y = 0.
    height: Expr,
    velocity: Vector,
    force: Vector,
    /// The moment but for what the arm z adds.
    moment: Vector,
}

impl Law {
    /// Reads the law of a contact.
    pub fn new(binder: &mut Binder, contact: &Contact) -> Self {
        let name = &contact.name;
        let mut law = |what: &str, law| binder.formula(law, &format!("{what}_{name}"), None);
        let stiffness = law("contact_stiffness", &contact.stiffness);
        let dissipation = law("contact_dissipation", &contact.dissipation);
        let friction = law("contact_friction", &contact.friction);
        let value = contact.slip_speed * contact.slip_speed;
        let fact = format!("slip_speed_squared_{name}");
        binder.name(Fact { name: fact, quantity: None, subject: Subject::Mechanism, value });
        Self { stiffness, dissipation, friction, slip: binder.constant(value) }
    }
}

/// Derives the forces on the points of one body.
pub fn touch(
    binder: &mut Binder,
    contact: &Contact,
    law: &Law,
    body: &Carrier,
    seen: &Seen,
    points: &[Touching],
) -> Touched {
    let size = binder.mechanism().size;
    let mut faces: Vec<Face> = Vec::new();
    let (mut forces, mut gaps, mut squares) = (Vec::new(), Vec::new(), Expr::zero());
    for (point, flat) in points {
        let name = point.name.replace('.', "_");
        let meaning = "coordinates of a contact point in this body's frame, m";
        let at = body.facts(binder, "contact_point", meaning, body.frame.coordinates(flat, size));
        let index = faces.iter().position(|face| face.z == at[2]).unwrap_or_else(|| {
            faces.push(Face::new(binder, body, seen, &contact.name, faces.len(), &at[2]));
            faces.len() - 1
        });
        let section = body.section(Phase::Contact);
        let mut of = Point { binder, section, name, at: &at, seen, face: &faces[index] };
        let (gap, depth) = of.gap(contact.plane.outline.as_ref());
        let force = of.force(law, &gap.velocity, &depth);
        squares = &squares + &depth.power(2);
        faces[index].carry(&at, &force);
        forces.push((at, force));
        gaps.push(gap);
    }
    let sums = faces.iter().map(Face::wrench);
    let wrench = sums.fold(Wrench::zero(), |sum, wrench| sum.plus(&wrench));
    let contact = &contact.name;
    let wrench = Wrench {
        force: body.vector(binder, &format!("force_{contact}"), wrench.force),
        moment: body.vector(binder, &format!("moment_{contact}"), wrench.moment),
    };
    Touched { forces, wrench, squares, gaps }
}

impl Face {
    fn new(
        binder: &mut Binder,
        body: &Carrier,
        seen: &Seen,
        contact: &str,
        index: usize,
        z: &Expr,
    ) -> Self {
        let [_, _, nz] = &seen.normal;
        let ([wx, wy, _], [vx, vy, vz]) = (&seen.omega, &seen.velocity);
        let height = &seen.height + &(nz * z);
        let height =
            body.bind(binder, Phase::Contact, &format!("face{index}_height_{contact}"), height);
        let velocity = [vx + &(wy * z), vy - &(wx * z), vz.clone()];
        let velocity = body.vector(binder, &format!("face{index}_velocity_{contact}"), velocity);
        Self { z: z.clone(), height, velocity, force: zero(), moment: zero() }
    }

    /// Adds the force on a point.
    fn carry(&mut self, [x, y, _]: &Vector, force: &Vector) {
        let [fx, fy, fz] = force;
        self.force = add(&self.force, force);
        let moment = [y * fz, -&(x * fz), &(x * fy) - &(y * fx)];
        self.moment = add(&self.moment, &moment);
    }

    fn wrench(&self) -> Wrench {
        let [fx, fy, _] = &self.force;
        let lifted = [-&(&self.z * fy), &self.z * fx, Expr::zero()];
        Wrench { force: self.force.clone(), moment: add(&self.moment, &lifted) }
    }
}

/// A contact point and what its force depends on.
struct Point<'p, 'b> {
    binder: &'p mut Binder<'b>,
    section: Section,
    name: String,
    at: &'p Vector,
    seen: &'p Seen,
    face: &'p Face,
}

impl Point<'_, '_> {
    /// Derives where the point is over the plane, and its depth d, which is 0 outside: the distance to the plane or, if
    /// that is less, to an edge of the plate or to its back.
    fn gap(&mut self, outline: Option<&PlateOutline>) -> (PointGap, Expr) {
        let [x, y, z] = self.at;
        let Seen { normal: [nx, ny, _], sheet, omega: [wx, wy, wz], .. } = self.seen;
        let height = &self.face.height + &(&(nx * x) + &(ny * y));
        let below = self.bind("below", -&height);
        let within = match (outline, sheet) {
            (Some(outline), Some(sheet)) => {
                let thickness = self.binder.constant(outline.thickness);
                let at = sheet.each_ref().map(|([ex, ey, ez], origin)| {
                    let along = &(&(ex * x) + &(ey * y)) + &(ez * z);
                    self.bind("in_plate", origin + &along)
                });
                let back = self.bind("to_edge", &thickness - &below);
                let edges = outline.edges().map(|(inward, product)| {
                    let [mx, my, product] =
                        [inward[0], inward[1], product].map(|x| self.binder.constant(x));
                    &(&(&mx * &at[0]) + &(&my * &at[1])) - &product
                });
                let edges: Vec<Expr> = edges.collect();
                Some(edges.into_iter().fold(back, |within, edge| self.least(within, edge)))
            }
            _ => None,
        };
        let depth = match &within {
            Some(within) => self.least(below.clone(), within.clone()),
            None => below.clone(),
        };
        let depth = self.positive("depth", depth);
        let [vx, vy, vz] = &self.face.velocity;
        let velocity = [vx - &(wz * y), vy + &(wz * x), vz + &(&(wx * y) - &(wy * x))];
        let velocity = self.vector("velocity", velocity);
        (PointGap { height: -&below, within, velocity }, depth)
    }

    /// Derives the force on the body.
    fn force(&mut self, law: &Law, velocity: &Vector, depth: &Expr) -> Vector {
        let Seen { normal, .. } = self.seen;
        let leaving = self.bind("normal_speed", dot(normal, velocity));
        let damped = &Expr::one() - &(&law.dissipation * &leaving);
        let damped = self.positive("damping", damped);
        let push = self.bind("push", &(&law.stiffness * depth) * &damped);
        if law.friction.is_zero() {
            return self.vector("force", scale(&push, normal));
        }
        let sliding = self.vector("sliding", sub(velocity, &scale(&leaving, normal)));
        let square = self.bind("sliding_square", &dot(&sliding, &sliding) + &law.slip);
        let speed = self.bind("sliding_speed", Expr::apply(Function::Sqrt, &[square]));
        let drag = &(&law.friction * &push) * &speed.power(-1);
        let drag = self.bind("friction", drag);
        let force = sub(&scale(&push, normal), &scale(&drag, &sliding));
        self.vector("force", force)
    }

    /// Returns the lesser of a depth and another distance.
    fn least(&mut self, depth: Expr, other: Expr) -> Expr {
        let other = self.bind("to_edge", other);
        let least = Expr::apply(Function::Min, &[depth, other]);
        self.bind("within", least)
    }

    /// Returns the value, or 0 if it is negative.
    fn positive(&mut self, what: &str, value: Expr) -> Expr {
        let value = self.bind(what, value);
        let positive = Expr::apply(Function::Max, &[value, Expr::zero()]);
        self.bind(what, positive)
    }

    fn bind(&mut self, what: &str, value: Expr) -> Expr {
        self.binder.bind(self.section, format!("{what}_{}", self.name), value)
    }

    fn vector(&mut self, what: &str, value: Vector) -> Vector {
        let mut axes = AXES.into_iter();
        value.map(|component| {
            let axis = axes.next().unwrap_or_default();
            self.bind(&format!("{what}_{axis}"), component)
        })
    }
}
