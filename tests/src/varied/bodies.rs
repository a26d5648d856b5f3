//! The bodies: plates with holes and slits, layers, given masses, point masses.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::Writer;

impl Writer {
    pub(super) fn body(&mut self, body: usize) {
        let fixed = match body < self.drawing.fixed {
            true if self.is_free => "free: true, ",
            true => "fixed: true, ",
            false => "",
        };
        let mut shape = match (self.drawing.facets.get(body).copied(), self.random.below(5)) {
            (Some(facet), _) => {
                let corners = facet.map(|corner| self.scale.drawn(corner));
                let corners = corners.map(|[x, y]| format!("[{x}, {y}]"));
                format!("outline: [{}]", corners.join(", "))
            }
            (None, 0) => self.layers(),
            // Where masses vary, most are given.
            (None, choice) if choice == 1 || self.scale.decades > 0.0 => self.rigid(),
            (None, _) => {
                let [outline, hole] = self.plate();
                let [[x, y], [to, _]] = [[0.0; 2], [0.01, 0.0]].map(|end| self.scale.drawn(end));
                format!("outline: {outline}, holes: [{hole}], slits: [[[{x}, {y}], [{to}, {y}]]]")
            }
        };
        if self.random.chance(0.4) {
            let weight = self.random.range(1e-4, 1e-3);
            let weight = self.scale.mass(&mut self.random, weight);
            let at = self.at();
            shape.push_str(&format!(", point_masses: [{{ mass: {weight:e}, at: {at} }}]"));
        }
        self.line(&format!("  b{body}: {{ {fixed}{shape} }}"));
    }

    /// A star-shaped polygon and a triangle inside it.
    fn plate(&mut self) -> [String; 2] {
        let count = 3 + self.random.below(6);
        let centre = [0.0; 2].map(|_: f64| self.random.range(-0.08, 0.08));
        let outline = self.ring(centre, count, [0.02, 0.05]);
        [outline, self.ring(centre, 3, [0.003, 0.008])]
    }

    fn layers(&mut self) -> String {
        let layers = [0, 1, 2].map(|layer| {
            let [outline, hole] = self.plate();
            match layer {
                0 => format!("[{{ outline: {outline} }}]"),
                1 if self.random.chance(0.5) => "[]".to_owned(),
                _ => format!("[{{ outline: {outline}, holes: [{hole}] }}]"),
            }
        });
        format!("layers: [{}]", layers.join(", "))
    }

    /// Principal moments of a box, turned about a random direction by a random angle.
    fn rigid(&mut self) -> String {
        let mass = self.random.range(5e-4, 3e-3);
        let mass = self.scale.mass(&mut self.random, mass);
        let [a, b, c] = [0.0; 3].map(|_: f64| {
            let edge = self.random.range(0.01, 0.05);
            self.scale.inertia(mass, edge * edge / 12.0)
        });
        let axis = Vector3::from_fn(|_, _| self.random.range(-2.0, 2.0));
        let turn = Rotation3::new(axis).into_inner();
        let principal = Matrix3::from_diagonal(&[b + c, c + a, a + b].into());
        let inertia = turn * principal * turn.transpose();
        let inertia = (inertia + inertia.transpose()) * 0.5;
        let rows = [0, 1, 2].map(|i| {
            let [x, y, z] = [0, 1, 2].map(|j| inertia[(i, j)]);
            format!("[{x:e}, {y:e}, {z:e}]")
        });
        format!("mass: {mass:e}, com: {}, inertia: [{}]", self.at(), rows.join(", "))
    }
}
