//! Phase 3, force elements: springs between points, tendons, torsion springs between bodies, and motors.
//!
//! A tendon slides without friction through the points P_k, so its tension T is the same everywhere. With
//! d_k = P_(k+1) - P_k and its length l,
//!
//! ```text
//! l = sum |d_k|      e_k = d_k / |d_k|      dl/dt = sum e_k . (v_(k+1) - v_k)
//! force on P_k = T (e_k - e_(k-1)) = -T dl/dP_k
//! ```
//!
//! so that its generalized force is -T dl/dq (K. N. An et al., "Tendon excursion and moment arm of index finger
//! muscles", J. Biomechanics 16, 1983). |d| is the square root of d.d + c^2, where c is [`CLOSEST`]: where two points
//! meet, e becomes zero instead of undefined, and forces stay the gradient of the energy.
//!
//! The angle of a torsion spring is that of the twist about the axis d in the decomposition of the relative rotation
//! into a twist about d and the shortest swing that moves d (P. Dobrowolski, "Swing-twist decomposition in Clifford
//! algebra", 2015). With d, n, z as orthogonal unit vectors of the flat state, fixed to both bodies,
//!
//! ```text
//! angle = atan2(z1.n2 - n1.z2, n1.n2 + z1.z2)      d(angle)/dt = g . (w2 - w1)      g = (d1 + d2) / (1 + d1.d2)
//! ```
//!
//! It is not defined where d2 = -d1, and jumps where it passes half a turn.
//!
//! A motor with the voltage V gives its joint the torque c N i through a gear of N turns. The current i follows V
//! without delay, because the inductance of small motors is negligible (B. Siciliano et al., "Robotics", 2009, 5.2):
//!
//! ```text
//! i = (V - c N u) / R
//! ```

use nalgebra::Vector3;
use num_traits::Zero;

use super::binder::Binder;
use super::facts::AXES;
use super::frame::Frame;
use super::kinematics::{Kinematics, node_of};
use super::link::Hinge;
use super::placement::Placement;
use super::vector::{Vector, add, cross, dot, scale, sub, zero};
use super::wrench::Wrench;
use crate::laminate::{Number, Real, Tendon, Tension, Twist, fixed};
use crate::program::{Phase, Quantity, Section, Subject};
use crate::source::{BodyId, Expression, PointId};
use crate::symbolic::{Expr, Function};
use crate::topology::NodeId;

/// Distance below which the points of a tendon count as one, in sizes of the mechanism: lengths of a thousandth of
/// the size change by less than 1e-12 of them.
const CLOSEST: f64 = 1e-9;

const AT: &str = "in the frame of its body, m";
const DIRECTION: &str = "components of a direction in this body's frame";

/// Springs between points and bodies, and tendons.
pub struct Elements {
    /// Their wrenches, by node.
    pub wrenches: Vec<Wrench>,
    /// Their potential energy, J.
    pub energy: Expr,
}

/// A point of a tendon.
struct Point {
    body: BodyId,
    /// The node of its body; the ground has none.
    node: Option<NodeId>,
    flat: Vector3<Number>,
    /// In the frame of its body, m.
    arm: Vector,
    /// In the base frame, m.
    position: Vector,
}

impl Elements {
    /// Derives the force elements.
    pub fn new(binder: &mut Binder, kinematics: &Kinematics) -> Self {
        let wrenches = vec![Wrench::zero(); kinematics.links().len()];
        let mut elements = Self { wrenches, energy: Expr::zero() };
        let mechanism = binder.mechanism();
        for tendon in &mechanism.elements.tendons {
            elements.tendon(binder, kinematics, tendon);
        }
        for twist in &mechanism.elements.twists {
            elements.twist(binder, kinematics, twist);
        }
        elements
    }

    fn tendon(&mut self, binder: &mut Binder, kinematics: &Kinematics, tendon: &Tendon) {
        let kind = if tendon.is_spring { "band" } else { "tendon" };
        let name = format!("{kind}_{}", tendon.name);
        let points: Vec<Point> =
            tendon.through.iter().map(|id| point(binder, kinematics, &name, id.index())).collect();
        let (length, pulls) = length(binder, &name, &points);
        // The pull on each moving point in the frame of its body.
        let mut moving = Vec::new();
        for (number, (point, pull)) in points.iter().zip(pulls).enumerate() {
            let (Some(node), Some(pull)) = (point.node, pull) else { continue };
            let pull = kinematics.placement(node).axes.each_ref().map(|axis| dot(axis, &pull));
            let label = format!("{name}_pull_{number}");
            moving.push((node, point, binder.vector(node, Phase::TendonForce, &label, pull)));
        }
        let rate = |binder: &mut Binder| {
            let rates = moving.iter().map(|(node, point, pull)| {
                dot(pull, &kinematics.motion(*node).velocity_at(&point.arm))
            });
            let rate = rates.fold(Expr::zero(), |sum, rate| &sum - &rate);
            binder.bind(Section::mechanism(Phase::TendonForce), format!("{name}_rate"), rate)
        };
        let (tension, energy) = tension(binder, &name, tendon, &length, rate);
        self.energy = &self.energy + &energy;
        for (node, point, pull) in &moving {
            let force = scale(&tension, pull);
            self.add(*node, &Wrench { moment: cross(&point.arm, &force), force });
        }
    }

    fn twist(&mut self, binder: &mut Binder, kinematics: &Kinematics, twist: &Twist) {
        let name = format!("twist_{}", twist.name);
        let section = Section::mechanism(Phase::TwistAngle);
        let (d, z) = (twist.direction, Vector3::z());
        let mut ends = Vec::new();
        for (end, body) in ["first", "second"].into_iter().zip(twist.bodies) {
            let triad =
                [("axis", d), ("across", z.cross(&d)), ("normal", z)].map(|(what, flat)| {
                    let label = format!("{name}_{end}_{what}");
                    direction(binder, kinematics, body, &label, &flat)
                });
            ends.push(triad);
        }
        let ([d1, n1, z1], [d2, n2, z2]) = (&ends[0], &ends[1]);
        let sine = binder.bind(section, format!("{name}_sine"), &dot(z1, n2) - &dot(n1, z2));
        let cosine = binder.bind(section, format!("{name}_cosine"), &dot(n1, n2) + &dot(z1, z2));
        let angle = Expr::apply(Function::Atan2, &[sine, cosine]);
        let angle = binder.bind(section, format!("{name}_angle"), angle);
        let share = (&Expr::one() + &dot(d1, d2)).power(-1);
        let share = binder.bind(section, format!("{name}_share"), share);
        let axis = bound(binder, section, &format!("{name}_gradient"), scale(&share, &add(d1, d2)));

        let section = Section::mechanism(Phase::TwistTorque);
        let mut formula =
            |law: &Expression, what| binder.formula(law, &format!("{name} {what}"), None);
        let stiffness = formula(&twist.stiffness, "stiffness");
        let damping = formula(&twist.damping, "damping");
        let rest = formula(&twist.rest, "rest");
        let mut moving = Vec::new();
        let mut rate = Expr::zero();
        for (sign, body) in [(-1, twist.bodies[0]), (1, twist.bodies[1])] {
            let Some(node) = node_of(binder.topology(), body) else { continue };
            let axis = kinematics.placement(node).axes.each_ref().map(|own| dot(own, &axis));
            let axis = binder.vector(node, Phase::TwistTorque, &format!("{name}_gradient"), axis);
            let speed = dot(&axis, &kinematics.motion(node).omega);
            rate = if sign > 0 { &rate + &speed } else { &rate - &speed };
            moving.push((node, sign, axis));
        }
        let bend = binder.bind(section, format!("{name}_bend"), &angle - &rest);
        let torque = -&(&(&stiffness * &bend) + &(&damping * &rate));
        let torque = binder.bind(section, format!("{name}_torque"), torque);
        for (node, sign, axis) in moving {
            let moment = scale(&torque, &axis);
            let moment = if sign > 0 { moment } else { sub(&zero(), &moment) };
            self.add(node, &Wrench { force: zero(), moment });
        }
        let half = binder.constant(0.5);
        let energy = &(&half * &stiffness) * &(&bend * &bend);
        self.energy = &self.energy + &stored(binder, &name, energy);
    }

    fn add(&mut self, node: NodeId, wrench: &Wrench) {
        let sum = &mut self.wrenches[node.index()];
        *sum = sum.plus(wrench);
    }
}

fn stored(binder: &mut Binder, name: &str, energy: Expr) -> Expr {
    binder.bind(Section::mechanism(Phase::PotentialEnergy), format!("{name}_energy"), energy)
}

fn bound(binder: &mut Binder, section: Section, name: &str, vector: Vector) -> Vector {
    let mut axes = AXES.into_iter();
    vector.map(|x| binder.bind(section, format!("{name}_{}", axes.next().unwrap_or_default()), x))
}

/// Returns the frame of a body in the flat state, its placement, and where its numbers belong.
fn body_of(binder: &Binder, kinematics: &Kinematics, body: BodyId) -> (Frame, Placement, Subject) {
    let (frame, placement) = kinematics.body(binder.topology(), body);
    let subject = Subject::of(node_of(binder.topology(), body));
    (frame, placement, subject)
}

fn point(binder: &mut Binder, kinematics: &Kinematics, tendon: &str, index: usize) -> Point {
    let mechanism = binder.mechanism();
    let given = &mechanism.points[index];
    let (frame, placement, subject) = body_of(binder, kinematics, given.body);
    let flat = binder.geometry().point(mechanism, PointId(index));
    let at = frame.coordinates(&flat, mechanism.size);
    let arm = binder.facts_about(subject, &given.name, Quantity::new("point", AT), AXES, at);
    let section = Section::mechanism(Phase::TendonLength);
    let label = format!("{tendon}_at_{}", given.name);
    let position = bound(binder, section, &label, placement.place(&arm));
    let node = node_of(binder.topology(), given.body);
    Point { body: given.body, node, flat, arm, position }
}

/// Returns the components in the base frame of a direction of the flat state that is fixed to a body.
fn direction(
    binder: &mut Binder,
    kinematics: &Kinematics,
    body: BodyId,
    name: &str,
    flat: &Vector3<f64>,
) -> Vector {
    let (frame, placement, subject) = body_of(binder, kinematics, body);
    let own = frame.direction(&fixed(flat));
    let own = binder.facts_about(subject, name, Quantity::new("", DIRECTION), AXES, own);
    bound(binder, Section::mechanism(Phase::TwistAngle), name, placement.turn(&own))
}

/// Returns the length of a tendon, m, and e_k - e_(k-1) for each point on which it pulls, in the base frame.
/// Between points of the same body, the length is constant and nothing pulls.
fn length(binder: &mut Binder, name: &str, points: &[Point]) -> (Expr, Vec<Option<Vector>>) {
    let section = Section::mechanism(Phase::TendonLength);
    let is_fixed = |point: &Point| binder.mechanism().bodies[point.body.index()].fixed;
    let is_rigid = |a: &Point, b: &Point| a.body == b.body || (is_fixed(a) && is_fixed(b));
    let rigid: Vec<bool> = points.windows(2).map(|ends| is_rigid(&ends[0], &ends[1])).collect();
    let closest = CLOSEST * binder.mechanism().size;
    let mut constant = Number::zero();
    let mut length = Expr::zero();
    let mut pulls: Vec<Option<Vector>> = vec![None; points.len()];
    for (number, (ends, is_rigid)) in points.windows(2).zip(rigid).enumerate() {
        if is_rigid {
            let along = &ends[1].flat - &ends[0].flat;
            constant += along.dot(&along).root();
            continue;
        }
        let span = sub(&ends[1].position, &ends[0].position);
        let span = bound(binder, section, &format!("{name}_span_{number}"), span);
        let square = &dot(&span, &span) + &binder.constant(closest * closest);
        let square = binder.bind(section, format!("{name}_square_{number}"), square);
        let distance = Expr::apply(Function::Sqrt, &[square]);
        let distance = binder.bind(section, format!("{name}_distance_{number}"), distance);
        let inverse = binder.bind(section, format!("{name}_inverse_{number}"), distance.power(-1));
        let unit = scale(&inverse, &span);
        let unit = bound(binder, section, &format!("{name}_unit_{number}"), unit);
        length = &length + &distance;
        let towards = |sum: &Option<Vector>, unit: Vector| match sum {
            Some(sum) => add(sum, &unit),
            None => unit,
        };
        pulls[number] = Some(towards(&pulls[number], unit.clone()));
        pulls[number + 1] = Some(towards(&pulls[number + 1], sub(&zero(), &unit)));
    }
    if constant.value() > 0.0 {
        length = &length + &binder.number(&constant, &format!("{name}_guided"));
    }
    (binder.bind(section, format!("{name}_length"), length), pulls)
}

/// Returns the tension of a tendon, N, and its potential energy, J: none if its tension is given.
fn tension(
    binder: &mut Binder,
    name: &str,
    tendon: &Tendon,
    length: &Expr,
    rate: impl Fn(&mut Binder) -> Expr,
) -> (Expr, Expr) {
    let section = Section::mechanism(Phase::TendonForce);
    let (stiffness, damping, rest_length, tension_only) = match &tendon.tension {
        Tension::Given(law) => {
            let given = binder.formula(law, &format!("{name} tension"), None);
            let is_constant = law.constant().is_some();
            let pull = if is_constant { given } else { positive(given) };
            return (binder.bind(section, format!("{name}_tension"), pull), Expr::zero());
        }
        Tension::Elastic { stiffness, damping, rest_length, tension_only } => {
            (stiffness, damping, rest_length, *tension_only)
        }
    };
    let mut formula = |law: &Expression, what| binder.formula(law, &format!("{name} {what}"), None);
    let stiffness = formula(stiffness, "stiffness");
    let damping = formula(damping, "damping");
    let rest_length = formula(rest_length, "rest_length");
    let stretch = binder.bind(section, format!("{name}_stretch"), length - &rest_length);
    let taut = match tension_only {
        true => binder.bind(section, format!("{name}_taut"), positive(stretch.clone())),
        false => stretch.clone(),
    };
    let half = binder.constant(0.5);
    let energy = &(&half * &stiffness) * &(&taut * &taut);
    let energy = stored(binder, name, energy);
    if damping.is_zero() {
        let pull = &stiffness * &taut;
        return (binder.bind(section, format!("{name}_tension"), pull), energy);
    }
    let rate = rate(binder);
    let mut pull = &(&stiffness * &taut) + &(&damping * &rate);
    if tension_only {
        // Where it is slack, a damper would push or pull.
        let is_taut = Expr::apply(Function::Step, &[stretch]);
        let is_taut = binder.bind(section, format!("{name}_is_taut"), is_taut);
        let viscous = binder.bind(section, format!("{name}_viscous_tension"), pull);
        pull = &is_taut * &positive(viscous);
    }
    (binder.bind(section, format!("{name}_tension"), pull), energy)
}

/// Returns the larger of a value and 0.
fn positive(value: Expr) -> Expr {
    Expr::apply(Function::Max, &[value, Expr::zero()])
}

/// Returns the torque of a joint's motor along its speed, N m; 0 without a motor.
pub fn motor_torque(binder: &mut Binder, node: NodeId, hinge: &Hinge) -> Expr {
    let Some(motor) = binder.mechanism().motor(hinge.joint) else { return Expr::zero() };
    let name = format!("motor_{}", motor.name);
    let section = Section::body(node, Phase::MotorTorque);
    let mut formula = |law: &Expression, what| binder.formula(law, &format!("{name} {what}"), None);
    let constant = formula(&motor.torque_constant, "torque_constant");
    let resistance = formula(&motor.resistance, "resistance");
    let voltage = formula(&motor.voltage, "voltage");
    let limits = [(&motor.max_voltage, "max_voltage"), (&motor.max_current, "max_current")];
    let [most_voltage, most_current] =
        limits.map(|(limit, what)| limit.as_ref().map(|limit| formula(limit, what)));
    let voltage = within(binder, section, &format!("{name}_voltage"), voltage, most_voltage);
    let gear = binder.fact(
        node,
        Quantity::new("gear", "turns of the rotor per turn of its joint"),
        motor.gear,
    );
    let constant = binder.bind(section, format!("{name}_constant_of_joint"), &gear * &constant);
    let left = &voltage - &(&constant * &hinge.speed);
    let current = &left * &resistance.power(-1);
    let current = binder.bind(section, format!("{name}_current"), current);
    let current = within(binder, section, &format!("{name}_current"), current, most_current);
    binder.bind(section, format!("{name}_torque"), &constant * &current)
}

/// Returns a value within a limit of its magnitude.
fn within(
    binder: &mut Binder,
    section: Section,
    name: &str,
    value: Expr,
    limit: Option<Expr>,
) -> Expr {
    let Some(limit) = limit else { return value };
    let below = Expr::apply(Function::Min, &[value, limit.clone()]);
    let below = binder.bind(section, format!("{name}_below"), below);
    let limited = Expr::apply(Function::Max, &[below, -&limit]);
    binder.bind(section, format!("{name}_limited"), limited)
}
