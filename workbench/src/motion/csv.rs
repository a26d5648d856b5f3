//! A motion as CSV: one line per sample, a header with names and units.

use std::fmt::Write;

use lamc_runtime::Energy;

use super::Motion;

impl Motion {
    /// Time, angles, rates, accelerations, energies, closure and points. Numbers are written so
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
        text.push('\n');
        for sample in &self.samples {
            let Energy { kinetic, potential } = sample.energy;
            let joints = sample.q.iter().chain(&sample.u).chain(&sample.acceleration);
            let whole = [kinetic, potential, sample.closure];
            let _ = write!(text, "{:?}", sample.t);
            for number in joints.chain(&whole).chain(sample.points.as_flattened()) {
                let _ = write!(text, ",{number:?}");
            }
            text.push('\n');
        }
        text
    }
}
