//! A motion as CSV: one line per sample, a header with names and units.

use std::fmt::Write;

use lamc_runtime::Energy;

use super::Motion;

impl Motion {
    /// Time, angles, rates, accelerations, energies, closure, points and contacts. Numbers are written so
    /// that they read back as they are.
    pub fn to_csv(&self) -> String {
        let mut text = "t [s]".to_owned();
        for (symbol, unit) in [("q", "rad"), ("u", "rad/s"), ("a", "rad/s^2")] {
            for joint in &self.joints {
                let _ = write!(text, ",{symbol}.{joint} [{unit}]");
            }
        }
        text.push_str(",kinetic [J],potential [J],closure [m]");
        for point in &self.points {
            for axis in ["x", "y", "z"] {
                let _ = write!(text, ",{point}.{axis} [m]");
            }
        }
        for contact in &self.contacts {
            for axis in ["x", "y", "z"] {
                let _ = write!(text, ",{contact}.{axis} [m]");
            }
            for axis in ["x", "y", "z"] {
                let _ = write!(text, ",{contact}.f{axis} [N]");
            }
        }
        text.push('\n');
        for sample in &self.samples {
            let Energy { kinetic, potential } = sample.energy;
            let joints = sample.q.iter().chain(&sample.u).chain(&sample.acceleration);
            let whole = [kinetic, potential, sample.closure];
            let _ = write!(text, "{:?}", sample.t);
            let places = sample.points.as_flattened().iter().chain(sample.contacts.as_flattened());
            for number in joints.chain(&whole).chain(places) {
                let _ = write!(text, ",{number:?}");
            }
            text.push('\n');
        }
        text
    }
}
