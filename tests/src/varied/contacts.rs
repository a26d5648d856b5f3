//! Contacts: of points with the ground, far behind its plane so that no motion leaves it, and of one facet's
//! corners with the plate of another.

use crate::random::Random;

use super::Writer;

/// How far behind the plane the points are, m in a mechanism of 0.2 m.
const DEPTH: f64 = 0.6;

impl Writer {
    /// Other numbers are drawn than for the rest of the model, which so stays as it is without contacts.
    pub(super) fn contacts(&mut self, seed: u64) {
        let mut random = Random::new(seed ^ 0xc0417ac7);
        if !random.chance(0.3) {
            return;
        }
        self.line("contacts:");
        self.ground(&mut random);
        let (fixed, facets) = (self.drawing.fixed, self.drawing.facets.len());
        if facets > fixed + 1 {
            let plate = fixed + random.below(facets - fixed);
            let other = fixed + (plate - fixed + 1) % (facets - fixed);
            let stiffness = self.scale.force(0.5) / self.scale.length(1e-3);
            self.line("  plates:");
            let z = self.scale.exact(4e-4);
            let plane =
                format!("point: [0, 0, {z:e}], normal: [0, 0, 1], body: b{plate}, within: outline");
            self.line(&format!("    plane: {{ {plane} }}"));
            self.line(&format!("    bodies: [b{other}]"));
            self.line("    points: corners");
            self.line(&format!("    stiffness: {stiffness:e} N/m"));
            self.line("    friction: 0.2");
        }
    }

    fn ground(&mut self, random: &mut Random) {
        let [x, y] = [0.0; 2].map(|_: f64| random.range(-0.2, 0.2));
        let depth = self.scale.exact(DEPTH);
        let stiffness = self.scale.force(random.range(0.2, 1.0)) / self.scale.length(DEPTH);
        // The speed of what falls through the mechanism.
        let speed = (10.0 * self.scale.length(0.2)).sqrt();
        let (dissipation, slip) = (0.02 / speed, 0.3 * speed);
        self.line("  ground:");
        self.line(&format!("    plane: {{ point: [0, 0, {depth:e}], normal: [{x}, {y}, 2] }}"));
        self.line("    points: [p0, p1]");
        self.line(&format!("    stiffness: \"{stiffness:e}*(1 + swing*sin(t))\""));
        self.line(&format!("    dissipation: {dissipation:e}"));
        self.line("    friction: \"0.5 + 0.2*swing\"");
        self.line(&format!("    slip_speed: {slip:e}"));
    }
}
