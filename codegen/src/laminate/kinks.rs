//! Formulas that are not smooth at an equilibrium: the derivatives on the two sides differ.
//!
//! A formula is evaluated shortly before and shortly after the state along a direction. If the two
//! one-sided derivatives differ by the same amount at a tenth of the distance, the difference is a
//! kink and not curvature.

use std::fmt;

use super::elements::Tension;
use super::mechanism::Mechanism;
use crate::source::Expression;

/// Distance from the state at which derivatives are taken, rad or rad/s of the joint that moves
/// most.
const NEAR: f64 = 1e-5;
/// Ratio of the second distance to the first.
const FARTHER: f64 = 10.0;
/// Relative difference of the derivatives below which it is rounding, as is this many units in the
/// last place of the value.
const ROUNDING: (f64, f64) = (1e-6, 100.0);

/// A formula with a kink.
#[derive(Clone, Debug, PartialEq)]
pub struct Kink {
    /// What the formula gives, such as "the torque of `j`".
    pub law: String,
    /// Whether the kink is in the speeds and not in the angles.
    pub by_speed: bool,
    /// The direction, by joint; its largest component is 1.
    pub direction: Vec<f64>,
    /// The derivatives along this direction before and after the state, SI.
    pub derivatives: [f64; 2],
}

impl fmt::Display for Kink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [before, behind] = self.derivatives;
        let by = if self.by_speed { "speed" } else { "angle" };
        write!(
            f,
            "{} has a kink at rest: its derivative by the {by} is {before:.6} on one side and \
             {behind:.6} on the other",
            self.law
        )
    }
}

impl Kink {
    /// Distance from the state beyond which the kink has been passed, rad.
    pub const REACH: f64 = NEAR;
}

/// Returns the torques and forces with a kink at rest at q (rad) and t (s), each along the
/// direction in which it is sharpest. Directions have one component for each joint.
pub fn kinks(
    mechanism: &Mechanism,
    (parameters, inputs): (&[f64], &[f64]),
    t: f64,
    q: &[f64],
    directions: &[Vec<f64>],
) -> Vec<Kink> {
    let torques = mechanism.joints.iter();
    let torques = torques.map(|joint| (format!("the torque of `{}`", joint.name), &joint.torque));
    let forces = mechanism.forces.iter().flat_map(|force| {
        force.force.iter().map(move |law| (format!("the force `{}`", force.name), law))
    });
    let tensions = mechanism.elements.tendons.iter().filter_map(|tendon| match &tendon.tension {
        Tension::Given(law) => Some((format!("the tension of `{}`", tendon.name), law)),
        Tension::Elastic { .. } => None,
    });
    let motors = mechanism.elements.motors.iter();
    let voltages = motors.map(|motor| (format!("the voltage of `{}`", motor.name), &motor.voltage));
    let mut found: Vec<Kink> = Vec::new();
    for (name, law) in torques.chain(forces).chain(tensions).chain(voltages) {
        if law.constant().is_some() {
            continue;
        }
        for by_speed in [false, true] {
            let value = |direction: &[f64], distance: f64| {
                law.evaluate(&|leaf: &Expression| match *leaf {
                    Expression::Time => t,
                    Expression::Parameter(id) => parameters[id.index()],
                    Expression::Input(id) => inputs[id.index()],
                    Expression::Position(id) if by_speed => q[id.index()],
                    Expression::Position(id) => q[id.index()] + distance * direction[id.index()],
                    Expression::Rate(id) if by_speed => distance * direction[id.index()],
                    _ => 0.0,
                })
            };
            let sharpest = directions.iter().filter_map(|direction| {
                let derivatives = derivatives(|distance| value(direction, distance))?;
                Some(Kink {
                    law: name.clone(),
                    by_speed,
                    direction: direction.clone(),
                    derivatives,
                })
            });
            let jump = |kink: &Kink| (kink.derivatives[1] - kink.derivatives[0]).abs();
            found.extend(sharpest.max_by(|a, b| jump(a).total_cmp(&jump(b))));
        }
    }
    found
}

/// Returns the one-sided derivatives at 0, if they differ.
fn derivatives(value: impl Fn(f64) -> f64) -> Option<[f64; 2]> {
    let here = value(0.0);
    let at = |h: f64| [(here - value(-h)) / h, (value(h) - here) / h];
    let jump = |[before, behind]: [f64; 2]| (behind - before).abs();
    let (near, far) = (at(NEAR), at(NEAR * FARTHER));
    let size = near[0].abs() + near[1].abs();
    let rounding = ROUNDING.0 * size + ROUNDING.1 * f64::EPSILON * here.abs() / NEAR;
    (jump(near) > rounding && jump(near) > 0.5 * jump(far)).then_some(near)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinks_and_curves() {
        assert_eq!(derivatives(|x| 3.0 * x * x - x), None);
        assert_eq!(derivatives(|x| x.sin() + 1e3), None);
        assert_eq!(derivatives(|x| x * x.abs()), None);
        assert_eq!(derivatives(f64::abs), Some([-1.0, 1.0]));
        let [before, behind] = derivatives(|x| x.max(-2.0 * x)).unwrap();
        assert!((before + 2.0).abs() < 1e-9 && (behind - 1.0).abs() < 1e-9);
        // A step does not become smaller at a smaller distance.
        assert!(derivatives(|x| if x < 0.0 { 0.0 } else { 1.0 }).is_some());
    }
}
