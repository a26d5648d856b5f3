//! Force elements as written in the file: springs between points and between bodies, tendons, motors.

use serde::{Deserialize, Serialize};

use super::diagnostic::Spanned;
use super::expression::Expression;
use super::ids::{BodyId, JointId, PointId};
use super::units::{
    ANGLE, CURRENT, DAMPING, FORCE, LENGTH, LINEAR_DAMPING, LINEAR_STIFFNESS, Quantity, RESISTANCE,
    STIFFNESS, TORQUE_CONSTANT, VOLTAGE,
};

/// The force elements of a model.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Elements {
    /// Springs between two points: tendons through two points, which may push.
    pub bands: Vec<Tendon>,
    /// Torsion springs between two bodies.
    pub twists: Vec<Twist>,
    /// Tendons.
    pub tendons: Vec<Tendon>,
    /// Motors.
    pub motors: Vec<Motor>,
}

/// A line under tension that slides without friction through points.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Tendon {
    /// Its name.
    pub name: Spanned<String>,
    /// The points, from one end to the other.
    pub through: Vec<Spanned<PointId>>,
    /// What its tension depends on.
    pub tension: Tension,
}

/// What the tension of a tendon depends on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Tension {
    /// The tension, N; 0 where the formula is negative.
    Given(Spanned<Expression>),
    /// A spring and a damper along the line.
    Elastic {
        /// Stiffness, N/m.
        stiffness: Spanned<Expression>,
        /// Damping, N s/m.
        damping: Spanned<Expression>,
        /// Length at which the spring is relaxed, m; the length in the flat drawing if it is left out.
        rest_length: Option<Spanned<Expression>>,
        /// Whether it pulls only.
        tension_only: bool,
    },
}

/// A torsion spring between two bodies.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Twist {
    /// Its name.
    pub name: Spanned<String>,
    /// The angle turns the second body relative to the first.
    pub bodies: [Spanned<BodyId>; 2],
    /// Two points of a line along the axis in the flat state, m.
    pub axis: Spanned<[[f64; 2]; 2]>,
    /// Stiffness, N m/rad.
    pub stiffness: Spanned<Expression>,
    /// Damping, N m s/rad.
    pub damping: Spanned<Expression>,
    /// Angle at which the spring is relaxed, rad.
    pub rest: Spanned<Expression>,
}

/// A direct-current motor that turns a joint through a gear.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Motor {
    /// Its name.
    pub name: Spanned<String>,
    /// The joint.
    pub joint: Spanned<JointId>,
    /// Torque of the rotor per current, N m/A, which is the voltage per speed of the rotor, V s/rad.
    pub torque_constant: Spanned<Expression>,
    /// Resistance of the winding, ohm.
    pub resistance: Spanned<Expression>,
    /// Turns of the rotor per turn of the joint.
    pub gear: Spanned<f64>,
    /// Moment of inertia of the rotor about its axis, kg m^2.
    pub inertia: Spanned<f64>,
    /// Voltage at the motor, V.
    pub voltage: Spanned<Expression>,
    /// Largest magnitude of the voltage, V.
    pub max_voltage: Option<Spanned<Expression>>,
    /// Largest magnitude of the current, A.
    pub max_current: Option<Spanned<Expression>>,
}

/// Returns the formulas of a struct's fields with their quantities, for one kind of reference.
macro_rules! visit {
    ($name:ident, $iter:ident, $as:ident $(, $mut:tt)?) => {
        /// Visits every formula with its quantity.
        pub fn $name(&$($mut)? self) -> impl Iterator<Item = (&$($mut)? Spanned<Expression>, Quantity)> {
            let Self { bands, twists, tendons, motors } = self;
            let tendons = bands.$iter().chain(tendons).flat_map(|tendon| match &$($mut)? tendon.tension {
                Tension::Given(tension) => vec![(tension, FORCE)],
                Tension::Elastic { stiffness, damping, rest_length, .. } => {
                    let laws = [(stiffness, LINEAR_STIFFNESS), (damping, LINEAR_DAMPING)];
                    laws.into_iter().chain(rest_length.$as().map(|law| (law, LENGTH))).collect()
                }
            });
            let twists = twists.$iter().flat_map(|Twist { stiffness, damping, rest, .. }| {
                [(stiffness, STIFFNESS), (damping, DAMPING), (rest, ANGLE)]
            });
            let motors = motors.$iter().flat_map(|motor| {
                let laws = [
                    (&$($mut)? motor.torque_constant, TORQUE_CONSTANT),
                    (&$($mut)? motor.resistance, RESISTANCE),
                    (&$($mut)? motor.voltage, VOLTAGE),
                ];
                let limits = [
                    motor.max_voltage.$as().map(|law| (law, VOLTAGE)),
                    motor.max_current.$as().map(|law| (law, CURRENT)),
                ];
                laws.into_iter().chain(limits.into_iter().flatten())
            });
            tendons.chain(twists).chain(motors)
        }
    };
}

impl Elements {
    visit!(laws, iter, as_ref);
    visit!(laws_mut, iter_mut, as_mut, mut);
}
