//! Motions that leave the range in which a hinge is elastic.

use std::fmt;

use super::mechanism::Mechanism;
use crate::source::Expression;

/// A hinge that bends beyond its linear range: when it does so first, and its largest bend.
#[derive(Clone, Debug, PartialEq)]
pub struct Excursion {
    /// Name of the joint.
    pub joint: String,
    /// Time at which it leaves the range, s.
    pub since: f64,
    /// Time of its largest bend, s.
    pub worst: f64,
    /// Ratio of its largest bend to the linear range.
    pub ratio: f64,
    /// Its linear range, rad.
    pub allowed: f64,
}

impl fmt::Display for Excursion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { joint, since, worst, ratio, allowed } = self;
        let degrees = allowed.to_degrees();
        write!(
            f,
            "`{joint}` leaves its linear range of {degrees:.2} deg at t = {since:.3} s; at \
             {worst:.3} s its bend is {ratio:.2} times this angle"
        )
    }
}

/// Returns the hinges that bend beyond their linear range in a sampled motion (times in s, q in rad
/// by joint), for these values of the parameters and inputs.
pub fn excursions<'q>(
    mechanism: &Mechanism,
    parameters: &[f64],
    inputs: &[f64],
    samples: impl Iterator<Item = (f64, &'q [f64])>,
) -> Vec<Excursion> {
    let mut found: Vec<Option<Excursion>> = vec![None; mechanism.joints.len()];
    for (t, q) in samples {
        for ((joint, q), found) in mechanism.joints.iter().zip(q).zip(&mut found) {
            let allowed = joint.linear_range;
            if allowed.is_infinite() {
                continue;
            }
            let rest = joint.rest.evaluate(&|leaf: &Expression| match *leaf {
                Expression::Time => t,
                Expression::Parameter(id) => parameters[id.index()],
                Expression::Input(id) => inputs[id.index()],
                // A rest angle does not depend on the motion.
                _ => f64::NAN,
            });
            let ratio = (q - rest).abs() / allowed;
            if ratio.is_nan() || ratio <= 1.0 {
                continue;
            }
            let name = joint.name.clone();
            let worst =
                found.get_or_insert(Excursion { joint: name, since: t, worst: t, ratio, allowed });
            if ratio > worst.ratio {
                (worst.worst, worst.ratio) = (t, ratio);
            }
        }
    }
    found.into_iter().flatten().collect()
}
