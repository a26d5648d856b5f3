//! The joints: their lines, springs, models of hinges, drives, and laws of torques.

use super::Writer;

impl Writer {
    /// Whether a joint follows a prescribed angle. A loop may have no freedom left for one.
    pub(super) fn is_driven(&self, joint: usize) -> bool {
        self.text.contains(&format!("  j{joint}: {{ drive: "))
    }

    pub(super) fn joint(&mut self, joint: usize) {
        let share = if self.drawing.closes() { 0.03 } else { 0.2 };
        let is_driven = self.random.chance(share / self.drawing.hinges.len() as f64 * 3.0);
        let mut entries = Vec::new();
        if is_driven {
            let [wide, slow] = [0.2, 0.1].map(|radians| self.scale.angle(radians));
            let input = self.scale.angle(30.0);
            entries.push(format!("drive: \"{wide}*sin(3*t) + {slow}*t^3 + motor*{input}\""));
        }
        let hinge = &self.drawing.hinges[joint];
        let [[ax, ay], [bx, by]] = hinge.axis.map(|point| self.scale.drawn(point));
        let [first, second] = hinge.bodies.map(|body| self.known(body));
        let z = self.scale.exact(hinge.z);
        entries.push(format!("bodies: [b{first}, b{second}], axis: [[{ax}, {ay}], [{bx}, {by}]]"));
        if z != 0.0 {
            entries.push(format!("z: {z:e}"));
        }
        self.spring(&mut entries);
        if self.random.chance(0.3) {
            let bounds = [-2.0, 2.2].map(|radians| self.scale.angle(radians));
            entries.push(format!("limits: {bounds:?}"));
        }
        if self.random.chance(0.2) {
            entries.push(format!("cubic_stiffness: {:e}", self.scale.torque(0.3)));
        }
        if self.random.chance(0.2) {
            let speed = self.scale.angle(self.random.range(0.05, 1.0));
            let torque = self.scale.torque(0.05);
            entries.push(format!("friction: {{ torque: {torque:e}, speed: {speed} }}"));
        }
        if joint == 0 {
            entries.push(format!("fold: {}", self.scale.angle(1.0)));
        }
        if !is_driven {
            entries.push(format!("torque: \"{}\"", self.torque(joint)));
        }
        self.line(&format!("  j{joint}: {{ {} }}", entries.join(", ")));
    }

    /// Stiffness, damping and rest angle, or a model of the hinge.
    fn spring(&mut self, entries: &mut Vec<String>) {
        // Within the specimens of both families.
        let [length, width] = [1.2e-3, 45e-3].map(|metres| self.scale.metres(metres));
        let size = format!("length: {length:e}, width: {width:e}");
        let stiffness = self.scale.torque(self.random.range(0.1, 2.0));
        let damping = self.scale.torque(self.random.range(1e-3, 2e-2));
        let has_damping = match self.random.below(8) {
            0 => {
                let gaps = self.scale.metres(5e-3);
                entries.push(format!(
                    "hinge: {{ model: beam, material: film, {size}, gaps: {gaps:e} }}"
                ));
                true
            }
            1 => {
                let area = "area: 40 cm^2";
                entries.push(match self.random.chance(0.5) {
                    true => {
                        format!("hinge: {{ model: sharifzadeh2018, {size}, {area} }}")
                    }
                    // The printed coefficients give wide hinges alone a damping above 0.
                    false => {
                        let [length, width] = [1e-3, 135e-3].map(|metres| self.scale.metres(metres));
                        format!(
                            "hinge: {{ model: sharifzadeh2018, length: {length:e}, width: {width:e}, \
                             {area}, coefficients: printed }}"
                        )
                    }
                });
                false
            }
            2 if self.text.contains("hinge_models:") => {
                entries.push(format!("hinge: {{ model: tape, {size}, area: 40 cm^2 }}"));
                false
            }
            3 => {
                entries.push("stiffness: k".to_owned());
                true
            }
            4 => true,
            _ => {
                entries.push(format!("stiffness: \"{stiffness:e}*(1 + 0.1*t)\""));
                true
            }
        };
        if has_damping && self.random.chance(0.7) {
            entries.push(format!("damping: \"{damping:e}*(1 + t)\""));
        }
        if self.random.chance(0.5) {
            let rest = self.scale.angle(self.random.range(-0.5, 0.5));
            entries.push(format!("rest: \"{rest} + swing*t/10\""));
        }
    }

    /// Stiffness and damping of a family of hinges by length, width and area.
    pub(super) fn family(&mut self) {
        let [k, b] = [0.5, 0.01].map(|share| self.scale.torque(share));
        self.line(&format!(
            "  tape: {{ stiffness: [[{k:e}, 0, 0, 0], [{k:e}, 0, 1, 0]], damping: [[{b:e}, 0, 0, 0], \
             [{b:e}, 0, 0, 1]], specimens: [[1e-3, 0.03, 3e-3], [1e-3, 0.05, 5e-3], [2e-3, 0.05, 3e-3]] }}"
        ));
    }

    /// The law of a joint's torque: of t, inputs, parameters, and what other joints do.
    fn torque(&mut self, joint: usize) -> String {
        let other = self.random.below(self.drawing.hinges.len());
        let scale = self.scale.torque(1.0);
        let law = match self.random.below(12) {
            0 => "motor - 0.2*sin(2*pi*t)".to_owned(),
            1 => format!("q.j{other}/10 - 1e-2*u.j{other}*abs(u.j{joint})"),
            2 => format!("0.1*tanh(3*u.j{other}) + k/k"),
            3 => format!("max(0.05*cos(q.j{other}), 0.02*exp(-t))"),
            4 => format!("0.1*sqrt(q.j{other}^2 + 0.01) - min(motor, 1e-3)"),
            5 => format!("0.1*atan2(q.j{other}, 1 + u.j{joint}^2) + 0.1*atan(u.j{other})"),
            6 => format!("0.1*asin(0.5*sin(q.j{other})) - 0.1*acos(0.5*cos(q.j{joint}))"),
            7 => format!("0.1*log(2 + q.j{other}^2)*step(t) + 0.01*sign(2 + q.j{joint})"),
            8 => format!("0.1*tan(q.j{other}/9) - (2 + q.j{joint})^swing/10"),
            _ => "0".to_owned(),
        };
        format!("{scale:e}*({law})")
    }
}
