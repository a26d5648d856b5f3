//! The frame of a free body, and how its coordinates and speeds move it.
//!
//! The frame has the axes of the drawing. Its origin O is not the centre of mass C that q and u describe,
//! where the hinges of a loop meet elsewhere. Let A be the rotation of the unit quaternion (w, x, y, z), d the
//! displacement of C from its drawn place c, r the constant vector from O to C in the frame, and V, w the
//! speeds:
//!
//! ```text
//! p = c + d - A r       v = A^T V + r x w       a = A^T dV/dt - E r       alpha = dw/dt
//!     1 - s (y^2 + z^2)   s (x y - w z)       s (x z + w y)
//! A = s (x y + w z)       1 - s (x^2 + z^2)   s (y z - w x)
//!     s (x z - w y)       s (y z + w x)       1 - s (x^2 + y^2)
//! ```
//!
//! (J. Diebel, "Representing Attitude", 2006, section 6.4.) s is 2 / (w^2 + x^2 + y^2 + z^2) and not 2: A is a
//! rotation also between the normalisations of the quaternion, within the steps of an integrator.

use super::binder::Binder;
use super::facts::AXES;
use super::frame::Frame;
use super::vector::{Vector, add, cross, dot, sub};
use crate::laminate::FreeId;
use crate::program::{Phase, Quantity, Subject};
use crate::symbolic::Expr;
use crate::topology::NodeId;

const CENTRE: Quantity = Quantity::new("centre", "centre of mass in its frame, m");

const DRAWN_CENTRE: Quantity = Quantity::new("drawn_centre", "centre of mass as drawn, m");

/// A free body.
#[derive(Clone)]
pub struct Free {
    /// The place of its first speed in u.
    pub first: usize,
    /// r: from the origin to the centre of mass, in the frame, m.
    pub centre: Vector,
    /// Position of the centre of mass in the base frame, m.
    pub position: Vector,
    /// The columns of A: the axes of the frame in the base frame.
    pub axes: [Vector; 3],
    /// V: velocity of the centre of mass in the base frame, m/s.
    pub velocity: Vector,
    /// w: angular velocity in the frame, rad/s.
    pub omega: Vector,
}

impl Free {
    /// Binds the rotation of a free body.
    pub fn new(binder: &mut Binder, node: NodeId, frame: &Frame, id: FreeId) -> Self {
        let mechanism = binder.mechanism();
        let (place, first) = (mechanism.coordinate_of(id).index(), mechanism.speed_of(id).index());
        let body = mechanism.free[id.index()].body;
        let com = binder.geometry().mass_properties(mechanism, body).com;
        let name = &mechanism.bodies[body.index()].name;
        let centre = frame.coordinates(&com, mechanism.size);
        let centre = binder.facts_of(node, CENTRE, AXES, centre);
        let subject = Subject::Body(node);
        let drawn = binder.facts_about(subject, name, DRAWN_CENTRE, AXES, com.into());
        let [dx, dy, dz, w, x, y, z] = std::array::from_fn(|k| binder.coordinate(place + k));
        let [vx, vy, vz, wx, wy, wz] = std::array::from_fn(|k| binder.speed(first + k));
        let axes = axes(binder, node, &[w, x, y, z]);
        let position = add(&drawn, &[dx, dy, dz]);
        let position = binder.vector(node, Phase::Placement, "centre_of_mass", position);
        Self { first, centre, position, axes, velocity: [vx, vy, vz], omega: [wx, wy, wz] }
    }

    /// Returns A^T x: the components in the frame of a vector of the base frame.
    pub fn down(&self, v: &Vector) -> Vector {
        self.axes.each_ref().map(|axis| dot(axis, v))
    }

    /// Returns A x.
    pub fn up(&self, v: &Vector) -> Vector {
        std::array::from_fn(|row| {
            let column = |k: usize| &self.axes[k][row] * &v[k];
            &(&column(0) + &column(1)) + &column(2)
        })
    }

    /// Returns p: the position of the origin in the base frame, m.
    pub fn origin(&self) -> Vector {
        sub(&self.position, &self.up(&self.centre))
    }

    /// Returns the velocity of the origin in the frame at given speeds V and w, m/s.
    pub fn velocity_of_origin(&self, velocity: &Vector, omega: &Vector) -> Vector {
        add(&self.down(velocity), &cross(&self.centre, omega))
    }

    /// Returns dV/dt in the base frame from the accelerations of the origin (without E r of the velocities)
    /// and of the rotation in the frame: A (a + alpha x r).
    pub fn acceleration_of_centre(&self, alpha: &Vector, a: &Vector) -> Vector {
        self.up(&add(a, &cross(alpha, &self.centre)))
    }
}

/// Binds the columns of A.
fn axes(binder: &mut Binder, node: NodeId, [w, x, y, z]: &[Expr; 4]) -> [Vector; 3] {
    let (one, phase) = (Expr::one(), Phase::Orientation);
    let square = |x: &Expr| x * x;
    let norm = &(&square(w) + &square(x)) + &(&square(y) + &square(z));
    let scale = &binder.constant(2.0) * &norm.power(-1);
    let scale = binder.scalar(node, phase, "scale", scale);
    let [x2, y2, z2] = [x, y, z].map(|x| &scale * x);
    let [x2, y2, z2] = binder.components(node, phase, "scaled", ["x", "y", "z"], [x2, y2, z2]);
    let products =
        [&x2 * x, &x2 * y, &x2 * z, &y2 * y, &y2 * z, &z2 * z, &x2 * w, &y2 * w, &z2 * w];
    let names = ["xx", "xy", "xz", "yy", "yz", "zz", "wx", "wy", "wz"];
    let [xx, xy, xz, yy, yz, zz, wx, wy, wz] =
        binder.components(node, phase, "scaled", names, products);
    let columns = [
        [&one - &(&yy + &zz), &xy + &wz, &xz - &wy],
        [&xy - &wz, &one - &(&xx + &zz), &yz + &wx],
        [&xz + &wy, &yz - &wx, &one - &(&xx + &yy)],
    ];
    let mut names = ["axis_x", "axis_y", "axis_z"].into_iter();
    columns.map(|axis| binder.vector(node, phase, names.next().unwrap_or_default(), axis))
}
