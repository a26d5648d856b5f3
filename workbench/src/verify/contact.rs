//! Forces between points and planes, in the base frame: each from the poses and velocities of two bodies.

use lamc::laminate::{Contact, ContactPoint};
use nalgebra::Vector3;

use super::maximal::System;

/// The force on a point that touches a plane.
pub struct Touched {
    /// The point's body.
    pub body: usize,
    /// The plane's body; `None` for the ground.
    pub plane: Option<usize>,
    /// Where the force acts, m.
    pub at: Vector3<f64>,
    /// The force on the point's body, N.
    pub force: Vector3<f64>,
    /// Stored energy k d^2 / 2, J.
    pub stored: f64,
}

impl System<'_> {
    /// The forces on all contact points.
    pub fn contacts(&self) -> Vec<Touched> {
        let contacts = self.mechanism.contacts.iter();
        let pairs = contacts.flat_map(|contact| contact.points.iter().map(move |it| (contact, it)));
        pairs.map(|(contact, point)| self.touched(contact, point)).collect()
    }

    fn touched(&self, contact: &Contact, point: &ContactPoint) -> Touched {
        let body = point.body.index();
        let plane = contact.plane.body.map(|body| body.index());
        let at = self.placed(Some(body), &point.at);
        let normal = match plane {
            Some(plane) => self.motions[plane].rotation * contact.plane.normal,
            None => contact.plane.normal,
        };
        let below = normal.dot(&(self.placed(plane, &contact.plane.point) - at));
        let depth = self.within(contact, plane, &at, below).max(0.0);
        let velocity = self.velocity(Some(body), &at) - self.velocity(plane, &at);
        let leaving = normal.dot(&velocity);
        let of = |formula| self.values.of(formula);
        let stiffness = of(&contact.stiffness);
        let push = stiffness * depth * (1.0 - of(&contact.dissipation) * leaving).max(0.0);
        let sliding = velocity - normal * leaving;
        let speed = (sliding.norm_squared() + contact.slip_speed.powi(2)).sqrt();
        let force = normal * push - sliding * (of(&contact.friction) * push / speed);
        Touched { body, plane, at, force, stored: stiffness * depth * depth / 2.0 }
    }

    /// How deep a point is in a plate that ends: its distance to the nearest face or edge.
    fn within(
        &self,
        contact: &Contact,
        plane: Option<usize>,
        at: &Vector3<f64>,
        below: f64,
    ) -> f64 {
        let Some(outline) = &contact.plane.outline else { return below };
        let drawn = plane.map_or(*at, |plane| {
            let motion = &self.motions[plane];
            motion.rotation.transpose() * (at - motion.position)
        });
        let ends = outline.vertices.iter().zip(outline.vertices.iter().cycle().skip(1));
        let inside = |([x, y], [to_x, to_y]): (&[f64; 2], &[f64; 2])| {
            let along = nalgebra::Vector2::new(to_x - x, to_y - y);
            along.perp(&(drawn.xy() - nalgebra::Vector2::new(*x, *y))) / along.norm()
        };
        ends.map(inside).fold(below.min(outline.thickness - below), f64::min)
    }

    /// Where a point of a body, or of the ground, is.
    fn placed(&self, body: Option<usize>, drawn: &Vector3<f64>) -> Vector3<f64> {
        body.map_or(*drawn, |body| {
            let motion = &self.motions[body];
            motion.rotation * drawn + motion.position
        })
    }

    /// The velocity of a body, or of the ground, at a place.
    fn velocity(&self, body: Option<usize>, at: &Vector3<f64>) -> Vector3<f64> {
        body.map_or(Vector3::zeros(), |body| {
            let motion = &self.motions[body];
            motion.velocity + motion.omega.cross(&(at - self.com(body)))
        })
    }
}
