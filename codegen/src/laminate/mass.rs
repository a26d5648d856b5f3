//! Sums of mass properties: the parallel-axis theorem.
//!
//! ```text
//! m = sum m_i,   m c = sum m_i c_i,   I = sum I_i + m_i (|d_i|^2 1 - d_i d_i^T),   d_i = c_i - c
//! ```

use nalgebra::{Matrix3, Vector3};

use super::mechanism::MassProperties;

impl MassProperties {
    /// Zero mass.
    pub const ZERO: Self = Self {
        mass: 0.0,
        com: Vector3::new(0.0, 0.0, 0.0),
        inertia: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    /// Creates a mass without extent: kg, position in the flat state in m.
    pub fn point(mass: f64, at: Vector3<f64>) -> Self {
        Self { mass, com: at, ..Self::ZERO }
    }

    /// Combines the parts to one rigid body.
    pub fn sum(parts: &[Self]) -> Self {
        let mass: f64 = parts.iter().map(|part| part.mass).sum();
        if parts.is_empty() || mass == 0.0 {
            return Self::ZERO;
        }
        // Positions are relative to one of the parts, so that no digits are lost far from the
        // drawing's origin.
        let near = parts[0].com;
        let moment: Vector3<f64> = parts.iter().map(|part| (part.com - near) * part.mass).sum();
        let com = near + moment / mass;
        let inertia = parts.iter().map(|part| part.inertia_about(&com)).sum();
        Self { mass, com, inertia }
    }

    /// Returns the inertia about a point in the flat state, along the axes of the flat state, kg
    /// m^2.
    pub fn inertia_about(&self, point: &Vector3<f64>) -> Matrix3<f64> {
        let d = self.com - point;
        self.inertia + (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * self.mass
    }
}
