//! Energies as sums over the bodies and springs, and how far the hinges are open.

use lamc::arithmetic::{larger, largest};
use lamc::laminate::Joint;

use super::System;
use crate::verify::placement::{Motion, turn};

impl System<'_> {
    pub(super) fn kinetic_energy(&self) -> f64 {
        let of = |&body: &usize| {
            let Motion { omega, velocity, .. } = self.motions[body];
            0.5 * self.mass(body) * velocity.norm_squared()
                + 0.5 * omega.dot(&(self.inertia(body) * omega))
        };
        self.moving().iter().map(of).sum::<f64>() + self.place().rotor_energy(self.values)
    }

    pub(super) fn potential_energy(&self) -> f64 {
        let gravity = self.gravity();
        let weight = |&body: &usize| -self.mass(body) * gravity.dot(&self.com(body));
        let spring = |(joint, q): (&Joint, &f64)| {
            let square = (q - self.values.of(&joint.rest)).powi(2);
            let [linear, cubic] =
                [&joint.stiffness, &joint.cubic_stiffness].map(|law| self.values.of(law));
            linear * square / 2.0 + cubic * square * square / 4.0
        };
        self.moving().iter().map(weight).sum::<f64>()
            + self.mechanism.joints.iter().zip(&self.values.q).map(spring).sum::<f64>()
            + self.place().energy()
            + self.contacts().iter().map(|touched| touched.stored).sum::<f64>()
    }

    /// Largest disagreement over any hinge: of positions, of speeds.
    pub(super) fn mismatch(&self) -> (f64, f64) {
        let mut open = (0.0_f64, 0.0_f64);
        let size = self.mechanism.size;
        let fastest = larger(largest(&self.values.u), f64::MIN_POSITIVE);
        for (j, joint) in self.mechanism.joints.iter().enumerate() {
            let [a, b] = joint.bodies.map(|id| id.index());
            let (first, second) = (&self.motions[a], &self.motions[b]);
            let turned = first.rotation * turn(&joint.direction, self.values.q[j]);
            open.0 = larger(open.0, largest(&(second.rotation - turned)));
            let gap = second.rotation * joint.point + second.position
                - first.rotation * joint.point
                - first.position;
            open.0 = larger(open.0, largest(&gap) / size);
            let hinge = self.hinge(j);
            let spin = second.omega - first.omega - hinge.direction * self.values.u[j];
            let slip = second.velocity + second.omega.cross(&hinge.arms[1])
                - first.velocity
                - first.omega.cross(&hinge.arms[0]);
            open.1 = larger(open.1, larger(largest(&spin), largest(&slip) / size) / fastest);
        }
        open
    }
}
