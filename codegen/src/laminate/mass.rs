//! Sums of mass properties: the parallel-axis theorem.
//!
//! ```text
//! m = sum m_i,   m c = sum m_i c_i,   I = sum I_i + m_i (|d_i|^2 1 - d_i d_i^T),   d_i = c_i - c
//! ```

use nalgebra::{Matrix3, Vector3};

use super::mechanism::MassProperties;
use super::number::Real;

impl<T: Real> MassProperties<T> {
    /// Returns zero mass.
    pub fn none() -> Self {
        Self { mass: T::zero(), com: Vector3::zeros(), inertia: Matrix3::zeros() }
    }

    /// Creates a mass without extent: kg, position in the flat state in m.
    pub fn point(mass: T, at: Vector3<T>) -> Self {
        Self { mass, com: at, ..Self::none() }
    }

    /// Combines the parts to one rigid body.
    pub fn sum(parts: &[Self]) -> Self {
        let mass: T = parts.iter().map(|part| part.mass.clone()).sum();
        if parts.is_empty() || mass.is_zero() {
            return Self::none();
        }
        // Positions are relative to one of the parts, so that no digits are lost far from the
        // drawing's origin.
        let near = &parts[0].com;
        let moment = parts.iter().map(|part| (&part.com - near) * part.mass.clone());
        let com = near + moment.fold(Vector3::zeros(), |sum, part| sum + part) / mass.clone();
        let inertia = parts.iter().map(|part| part.inertia_about(&com));
        let inertia = inertia.fold(Matrix3::zeros(), |sum, part| sum + part);
        Self { mass, com, inertia }
    }

    /// Returns the inertia about a point in the flat state, along the axes of the flat state, kg
    /// m^2.
    pub fn inertia_about(&self, point: &Vector3<T>) -> Matrix3<T> {
        let d = &self.com - point;
        let square = d.dot(&d);
        let spread = Matrix3::identity() * square - &d * d.transpose();
        &self.inertia + spread * self.mass.clone()
    }
}
