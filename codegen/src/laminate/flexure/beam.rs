//! A hinge as a strip bent over its free length (Sharifzadeh, Khodambashi, Aukes,
//! DETC2018-86359).
//!
//! ```text
//! I = w t^3 / 12,  k = E I / x                        stiffness
//! F = sigma w t^2 / (6 l)                             force at the arm l at which the strip yields
//! delta = F x^2 l / (2 E I),  phi = F x l / (E I)     deflection and angle of the strip's end
//! ```
//!
//! with E Young's modulus, sigma yield stress, x free length, w width, t thickness. F l is the
//! bending moment M, and M (t / 2) / I = sigma where the outer fibre yields, hence t^2 in F. The
//! paper prints t^3, which does not have the dimension of a force. The angle depends on M only, not
//! on the arm: phi = 2 sigma x / (E t).
//!
//! The paper's polyester of 0.127 mm (E = 4383.27 MPa, sigma = 42.84 MPa) is linear up to 1.96 deg
//! according to the paper, which does not give its free length. By the formulas above the free
//! length is 0.222 mm. With t^3 as printed and lengths in millimetres the thickness cancels, phi =
//! 2 sigma x / E, and 1.96 deg corresponds to a free length of 1.75 mm, which is more plausible for
//! a hinge; by the formulas above, such a strip is linear up to 15.4 deg.

use crate::arithmetic::powi;

/// A strip in bending. SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Young's modulus E, Pa.
    pub youngs_modulus: f64,
    /// Free length x across the gap between the plates, m.
    pub length: f64,
    /// Width w along the hinge line without the parts that are cut out, m.
    pub width: f64,
    /// Thickness t, m.
    pub thickness: f64,
}

/// Limits of the range in which a strip is elastic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearRange {
    /// Force F at the arm, N.
    pub force: f64,
    /// Deflection delta of the strip's end, m.
    pub deflection: f64,
    /// Angle phi of the strip's end, rad: the largest turn of the hinge from its rest angle.
    pub angle: f64,
}

impl Beam {
    /// I = w t^3 / 12, m^4 (DETC2018-86359).
    pub fn second_moment(&self) -> f64 {
        self.width * powi(self.thickness, 3) / 12.0
    }

    /// k = E I / x, N m/rad (DETC2018-86359).
    pub fn stiffness(&self) -> f64 {
        self.youngs_modulus * self.second_moment() / self.length
    }

    /// The linear range for a yield stress (Pa) and a force that acts at `arm` (m) from the hinge
    /// (DETC2018-86359, with t^2 in F: see the head of this file).
    pub fn linear_range(&self, yield_stress: f64, arm: f64) -> LinearRange {
        let force = yield_stress * self.width * powi(self.thickness, 2) / (6.0 * arm);
        let bend = force * arm / (self.youngs_modulus * self.second_moment());
        LinearRange {
            force,
            deflection: bend * self.length * self.length / 2.0,
            angle: bend * self.length,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The strip of the paper: polyester of 0.127 mm, 20 mm wide, of this free length.
    fn polyester(length: f64) -> Beam {
        Beam { youngs_modulus: 4383.27e6, length, width: 20e-3, thickness: 0.127e-3 }
    }

    fn close(value: f64, expected: f64) {
        assert!((value / expected - 1.0).abs() < 1e-12, "{value:e} is not {expected:e}");
    }

    #[test]
    fn by_hand() {
        let beam = polyester(1e-3);
        // 0.02 * 2.048383e-12 / 12; 4383.27e6 * that / 1e-3.
        close(beam.second_moment(), 3.413_971_666_666_667e-15);
        close(beam.stiffness(), 0.014_964_359_587_35);
        // 42.84e6 * 0.02 * 1.6129e-8 / (6 * 0.05).
        let range = beam.linear_range(42.84e6, 0.05);
        close(range.force, 0.046_064_424);
        // F 0.05 / k, and half of it times the length.
        close(range.angle, 0.046_064_424 * 0.05 / 0.014_964_359_587_35);
        close(range.deflection, range.angle * 0.5e-3);
    }

    #[test]
    fn the_angle_is_that_of_the_yield_strain() {
        let beam = polyester(1.3e-3);
        // Curvature times half the thickness is the strain of the outer fibre.
        for arm in [1e-3, 0.05, 2.0] {
            let strain = beam.linear_range(42.84e6, arm).angle / beam.length * beam.thickness / 2.0;
            close(strain, 42.84 / 4383.27);
        }
    }

    #[test]
    fn the_published_limit_and_the_geometry_it_assumes() {
        let degrees =
            |length: f64| polyester(length).linear_range(42.84e6, 0.05).angle.to_degrees();
        // To the digits printed, 1.96.
        assert!((degrees(0.22225e-3) - 1.96).abs() < 0.005);
        // As printed, t^3 with lengths in millimetres: 0.127 times the force at 1.75 mm.
        assert!((0.127 * degrees(1.75e-3) - 1.96).abs() < 0.005);
        assert!((degrees(1.75e-3) - 15.43).abs() < 0.005);
    }
}
