//! A motion as CSV: one line per sample, a header with names and units.

use std::fmt::Write;

use lamc::source::free::{COORDINATE_NAMES, COORDINATE_UNITS, SPEED_NAMES, SPEED_UNITS, SPEEDS};
use lamc_runtime::Energy;

use super::Motion;

impl Motion {
    /// Time, coordinates, speeds, accelerations, energies, closure, points, contacts, tensions and driven inputs. Numbers are
    /// written so that they read back as they are.
    pub fn to_csv(&self) -> String {
        let mut text = "t [s]".to_owned();
        let accelerations = ["m/s^2", "m/s^2", "m/s^2", "rad/s^2", "rad/s^2", "rad/s^2"];
        let speeds = |units: [_; SPEEDS]| SPEED_NAMES.into_iter().zip(units).collect();
        let columns: [(&str, &str, Vec<_>); 3] = [
            ("q", "rad", COORDINATE_NAMES.into_iter().zip(COORDINATE_UNITS).collect()),
            ("u", "rad/s", speeds(SPEED_UNITS)),
            ("a", "rad/s^2", speeds(accelerations)),
        ];
        for (symbol, unit, parts) in columns {
            for joint in &self.joints {
                let _ = write!(text, ",{symbol}.{joint} [{unit}]");
            }
            for (body, (part, unit)) in
                self.free.iter().flat_map(|b| parts.iter().map(move |p| (b, p)))
            {
                let _ = write!(text, ",{symbol}.{body}.{part} [{unit}]");
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
        for tension in &self.tensions {
            let _ = write!(text, ",{tension}.tension [N]");
        }
        for input in &self.inputs {
            let _ = write!(text, ",{input} [SI]");
        }
        text.push('\n');
        for sample in &self.samples {
            let Energy { kinetic, potential } = sample.energy;
            let joints = sample.q.iter().chain(&sample.u).chain(&sample.acceleration);
            let whole = [kinetic, potential, sample.closure];
            let _ = write!(text, "{:?}", sample.t);
            let places = sample.points.as_flattened().iter().chain(sample.contacts.as_flattened());
            let forces = sample.tensions.iter().chain(&sample.inputs);
            for number in joints.chain(&whole).chain(places).chain(forces) {
                let _ = write!(text, ",{number:?}");
            }
            text.push('\n');
        }
        text
    }
}
