//! Motions that leave the range in which a hinge is elastic.

use std::fmt;

use super::mechanism::Mechanism;
use crate::source::Expression;

/// The first time a hinge is bent beyond its linear range, and the most it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Excursion {
    /// The joint.
    pub joint: String,
    /// When it leaves the range, s.
    pub since: f64,
    /// When it is bent most, s.
    pub worst: f64,
    /// The bend then over what is allowed.
    pub ratio: f64,
    /// What is allowed, rad.
    pub allowed: f64,
}

impl fmt::Display for Excursion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { joint, since, worst, ratio, allowed } = self;
        let degrees = allowed.to_degrees();
        write!(
            f,
            "`{joint}` leaves its linear range of {degrees:.2} deg at t = {since:.3} s; at {worst:.3} s it is \
             bent {ratio:.2} times that far"
        )
    }
}

/// The hinges that sampled angles (times in s, q in rad by joint) bend beyond their linear range,
/// under the values of the parameters and inputs.
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
