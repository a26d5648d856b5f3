//! Force elements of the mechanism: springs, tendons and motors.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::hinge::direction;
use super::mechanism::Mechanism;
use crate::source::codes;
use crate::source::elements as given;
use crate::source::{
    BodyId, Diagnostic, Diagnostics, Expression, JointId, Operator, PointId, SourceModel, Spanned,
    Unary,
};

/// The force elements of a mechanism.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Elements {
    /// Springs between two points, then tendons.
    pub tendons: Vec<Tendon>,
    /// Torsion springs between two bodies.
    pub twists: Vec<Twist>,
    /// Motors, at most one for each joint.
    pub motors: Vec<Motor>,
}

/// A line under tension that slides without friction through points. A spring between two points is a tendon
/// through both.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Tendon {
    /// Its name.
    pub name: String,
    /// Whether it is one of the file's `springs`.
    pub is_spring: bool,
    /// The points, from one end to the other.
    pub through: Vec<PointId>,
    /// What its tension depends on.
    pub tension: Tension,
}

/// What the tension of a tendon depends on.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Tension {
    /// The tension, N; 0 where the formula is negative.
    Given(Expression),
    /// A spring and a damper along the line of length l: k (l - l0) + b dl/dt.
    Elastic {
        /// k, N/m.
        stiffness: Expression,
        /// b, N s/m.
        damping: Expression,
        /// l0, m.
        rest_length: Expression,
        /// Whether the tension is 0 where l is less than l0, and where it would be negative.
        tension_only: bool,
    },
}

/// A torsion spring between two bodies, about an axis that is fixed to both in the flat state.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Twist {
    /// Its name.
    pub name: String,
    /// The angle turns the second body relative to the first.
    pub bodies: [BodyId; 2],
    /// Unit vector of the axis in the flat state; its z component is exactly 0.
    pub direction: Vector3<f64>,
    /// Stiffness, N m/rad.
    pub stiffness: Expression,
    /// Damping, N m s/rad.
    pub damping: Expression,
    /// Angle at which the spring is relaxed, rad.
    pub rest: Expression,
}

/// A direct-current motor that turns a joint through a gear. With the current i, the torque on the joint's second
/// body is `gear` `torque_constant` i.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Motor {
    /// Its name.
    pub name: String,
    /// The joint.
    pub joint: JointId,
    /// Torque of the rotor per current, N m/A, which is the voltage per speed of the rotor, V s/rad.
    pub torque_constant: Expression,
    /// Resistance of the winding, ohm.
    pub resistance: Expression,
    /// Turns of the rotor per turn of the joint.
    pub gear: f64,
    /// Moment of inertia of the rotor about its axis, kg m^2.
    pub inertia: f64,
    /// Voltage at the motor, V.
    pub voltage: Expression,
    /// Largest magnitude of the voltage, V.
    pub max_voltage: Option<Expression>,
    /// Largest magnitude of the current, A.
    pub max_current: Option<Expression>,
}

impl Motor {
    /// Returns the inertia that the rotor adds to that of the joint's coordinate, kg m^2.
    pub fn reflected_inertia(&self) -> f64 {
        self.gear * self.gear * self.inertia
    }
}

impl Mechanism {
    /// Returns the motor of a joint.
    pub fn motor(&self, joint: JointId) -> Option<&Motor> {
        self.elements.motors.iter().find(|motor| motor.joint == joint)
    }

    /// Returns what the rotor of a joint's motor adds to the inertia of its coordinate, kg m^2.
    pub fn rotor_inertia(&self, joint: JointId) -> f64 {
        self.motor(joint).map_or(0.0, Motor::reflected_inertia)
    }
}

/// Returns the force elements of a model.
pub fn elements(model: &SourceModel) -> Elements {
    let given::Elements { bands, twists, tendons, motors } = &model.elements;
    let bands = bands.iter().map(|band| tendon(model, band, true));
    let tendons = tendons.iter().map(|it| tendon(model, it, false));
    Elements {
        tendons: bands.chain(tendons).collect(),
        twists: twists.iter().map(twist).collect(),
        motors: motors.iter().map(motor).collect(),
    }
}

fn tendon(model: &SourceModel, tendon: &given::Tendon, is_spring: bool) -> Tendon {
    let through: Vec<PointId> = tendon.through.iter().map(|point| point.value).collect();
    let tension = match &tendon.tension {
        given::Tension::Given(tension) => Tension::Given(tension.value.clone()),
        given::Tension::Elastic { stiffness, damping, rest_length, tension_only } => {
            let drawn = || drawn_length(model, &through);
            let rest_length = rest_length.as_ref().map(|length| length.value.clone());
            Tension::Elastic {
                stiffness: stiffness.value.clone(),
                damping: damping.value.clone(),
                rest_length: rest_length.unwrap_or_else(drawn),
                tension_only: *tension_only,
            }
        }
    };
    Tendon { name: tendon.name.value.clone(), is_spring, through, tension }
}

/// Returns the length of a line in the flat drawing, m.
fn drawn_length(model: &SourceModel, through: &[PointId]) -> Expression {
    let at = |id: &PointId| &model.points[id.index()].at;
    if through.iter().all(|id| at(id).is_fixed()) {
        let at = |id: &PointId| Vector3::from(at(id).value);
        let parts = through.windows(2).map(|ends| (at(&ends[1]) - at(&ends[0])).norm());
        return Expression::Number(parts.sum());
    }
    let coordinate = |id: &PointId, axis: usize| {
        let formula = at(id).formula(axis).cloned();
        formula.unwrap_or(Expression::Number(at(id).value[axis]))
    };
    let part = |ends: &[PointId]| {
        let square = |axis: usize| {
            let (to, from) = (coordinate(&ends[1], axis), coordinate(&ends[0], axis));
            let along = Box::new(Expression::Chain(Box::new(to), vec![(Operator::Sub, from)]));
            Expression::Chain(along.clone(), vec![(Operator::Mul, *along)])
        };
        let sum = [1, 2].map(|axis| (Operator::Add, square(axis)));
        let sum = Expression::Chain(Box::new(square(0)), sum.to_vec());
        Expression::Unary(Unary::Sqrt, Box::new(sum))
    };
    let parts = through.windows(2).map(|ends| (Operator::Add, part(ends)));
    Expression::Chain(Box::new(Expression::ZERO), parts.collect())
}

fn twist(twist: &given::Twist) -> Twist {
    let [from, to] = twist.axis.value;
    Twist {
        name: twist.name.value.clone(),
        bodies: twist.bodies.each_ref().map(|body| body.value),
        direction: direction(to[0] - from[0], to[1] - from[1]),
        stiffness: twist.stiffness.value.clone(),
        damping: twist.damping.value.clone(),
        rest: twist.rest.value.clone(),
    }
}

fn motor(motor: &given::Motor) -> Motor {
    let limit = |limit: &Option<Spanned<Expression>>| limit.as_ref().map(|it| it.value.clone());
    Motor {
        name: motor.name.value.clone(),
        joint: motor.joint.value,
        torque_constant: motor.torque_constant.value.clone(),
        resistance: motor.resistance.value.clone(),
        gear: motor.gear.value,
        inertia: motor.inertia.value,
        voltage: motor.voltage.value.clone(),
        max_voltage: limit(&motor.max_voltage),
        max_current: limit(&motor.max_current),
    }
}

/// Checks the numbers of motors and the joints that they turn.
pub fn check_motors(model: &SourceModel, found: &mut Diagnostics) {
    let motors = &model.elements.motors;
    for (index, motor) in motors.iter().enumerate() {
        let name = &motor.name.value;
        super::check::positive(&format!("gear of `{name}`"), &motor.gear, "turns per turn", found);
        if motor.inertia.value < 0.0 {
            let message = format!("the inertia of `{name}` is negative");
            found.push(Diagnostic::error(codes::NEGATIVE_ELEMENT, motor.inertia.span, message));
        }
        let joint = &model.joints[motor.joint.value.index()];
        if let Some(drive) = &joint.drive {
            let message =
                format!("`{name}` turns `{}`, whose angle is prescribed", joint.name.value);
            found.push(
                Diagnostic::error(codes::DRIVEN_MOTOR, motor.joint.span, message)
                    .label("the motor has no effect")
                    .also(drive.span, "the angle is prescribed here")
                    .hint("keep one of them: the torque that `drive` needs is computed"),
            );
        }
        if let Some(first) = motors[..index].iter().find(|it| it.joint.value == motor.joint.value) {
            let message = format!("two motors turn `{}`", joint.name.value);
            found.push(
                Diagnostic::error(codes::SECOND_MOTOR, motor.joint.span, message)
                    .label("the second motor")
                    .also(first.joint.span, "the first motor")
                    .hint("remove one of them"),
            );
        }
    }
}
