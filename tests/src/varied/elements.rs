//! Springs between points and bodies, tendons and motors.

use super::Writer;
use crate::random::Random;

/// The gear of the motors.
const GEAR: f64 = 20.0;

impl Writer {
    /// Writes force elements, each in a part of the models. Their random numbers are apart from those of everything
    /// else.
    pub(super) fn elements(&mut self, seed: u64) {
        let mut random = Random::new(seed ^ 0x5b71);
        let stiff = |this: &Self, share: f64| this.scale.force(share) / this.scale.length(0.1);
        let stretch = self.scale.exact(random.range(0.02, 0.2));
        if random.chance(0.3) {
            self.line("springs:");
            let [k, b] = [stiff(self, 3.0), stiff(self, 0.03)];
            let pulls = random.chance(0.5);
            self.line(&format!(
                "  band: {{ from: p0, to: p2, stiffness: \"{k:e}*(1 + 0.1*t)\", damping: {b:e}, \
                 rest_length: {stretch:e}, tension_only: {pulls} }}"
            ));
            let push = stiff(self, 1.0);
            self.line(&format!("  push: {{ from: p2, to: p1, stiffness: {push:e} }}"));
            let moving =
                self.drawing.fixed + random.below(self.drawing.bodies - self.drawing.fixed);
            let [[ax, ay], [bx, by]] = [[0.0; 2], [0.0; 2]].map(|_: [f64; 2]| {
                self.scale.drawn([0.0; 2].map(|_: f64| random.range(-0.1, 0.1)))
            });
            let [k, b] = [self.scale.torque(0.3), self.scale.torque(0.003)];
            let rest = self.scale.angle(0.2);
            self.line(&format!(
                "  twist: {{ bodies: [b0, b{moving}], axis: [[{ax}, {ay}], [{bx}, {by}]], stiffness: {k:e}, \
                 damping: \"{b:e}*(1 + t)\", rest: {rest} }}"
            ));
        }
        if random.chance(0.3) {
            let joint = random.below(self.drawing.hinges.len());
            let [pull, k, b] = [self.scale.force(0.5), stiff(self, 3.0), stiff(self, 0.03)];
            self.line("tendons:");
            self.line(&format!(
                "  given: {{ through: [p1, p2, p0], tension: \"{pull:e}*(1 + sin(q.j{joint}) + motor)\" }}"
            ));
            self.line(&format!(
                "  elastic: {{ through: [p2, p0, p1], stiffness: {k:e}, damping: {b:e}, \
                 rest_length: \"{:e}*(1 + 0.1*t)\" }}",
                self.scale.length(0.05)
            ));
        }
        if random.chance(0.3) {
            self.motor(&mut random);
        }
    }

    /// A motor whose speed without load, torque and damping are those of the other laws at any scale.
    fn motor(&mut self, random: &mut Random) {
        let joints = self.drawing.hinges.len();
        let joint = random.below(joints);
        if self.is_driven(joint) {
            return;
        }
        let resistance = 1.0 / self.scale.torque(5e-3);
        let inertia = self.scale.rotor(random.range(0.01, 0.3)) / (GEAR * GEAR);
        self.line("motors:");
        self.line(&format!(
            "  drive: {{ joint: j{joint}, torque_constant: {:e}, resistance: {resistance:e}, gear: {GEAR}, \
             inertia: {inertia:e}, voltage: \"20*sin(3*t) + motor - u.j{joint}\", max_voltage: 15, \
             max_current: {:e} }}",
            1.0 / GEAR,
            14.0 / resistance,
        ));
    }
}
