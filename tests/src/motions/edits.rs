//! Changes of a model after which more must hold.

use lamc::arithmetic::hypot;
use lamc::pipeline::Compiled;
use lamc::source::elements::{Tendon, Tension};
use lamc::source::{
    Body, BodyId, Expression, Joint, Operator, Shape, SourceModel, Span, Spanned, Spring,
};

/// The time at which laws are frozen, s, and what inputs are then.
const FROZEN: f64 = 0.5;
const INPUT: f64 = 1e-3;

/// Directions of the turntable's axis in the plane: neither along a side of the drawing nor through its origin.
const TABLE: [[f64; 2]; 2] = [[-0.3, 0.2], [0.5, 0.6]];

/// A value that no file has.
pub fn spanned<T>(value: T) -> Spanned<T> {
    Spanned { value, span: Span::default() }
}

/// All laws of a model.
pub fn laws(model: &mut SourceModel) -> impl Iterator<Item = &mut Expression> {
    let joints = model.joints.iter_mut().flat_map(|joint| {
        let stiffness = match &mut joint.spring {
            Spring::Stiffness(stiffness) => Some(stiffness),
            Spring::Beam { .. } | Spring::Sharifzadeh2018 { .. } | Spring::Family { .. } => None,
        };
        let friction = joint.friction.as_mut().map(|friction| &mut friction.torque);
        let always = [&mut joint.damping, &mut joint.rest, &mut joint.torque];
        let others = [stiffness, friction, joint.drive.as_mut(), Some(&mut joint.cubic_stiffness)];
        let laws = always.into_iter().chain(others.into_iter().flatten());
        laws.map(|law| &mut law.value)
    });
    let forces = model.forces.iter_mut().flat_map(|force| &mut force.force);
    let air = model.air.iter_mut().flat_map(|air| [&mut air.density.value, &mut air.drag.value]);
    let contacts = model.contacts.iter_mut().flat_map(|contact| {
        let laws = [&mut contact.dissipation, &mut contact.friction];
        laws.into_iter().chain(&mut contact.stiffness).map(|law| &mut law.value)
    });
    let elements = model.elements.laws_mut().map(|(law, _)| &mut law.value);
    let laws = joints.chain(forces).chain(air).chain(elements).chain(contacts);
    laws.chain(&mut model.gravity)
}

/// A law with some of its leaves changed.
pub fn changed(law: &Expression, leaf: &dyn Fn(&Expression) -> Expression) -> Expression {
    let same = |x: &Expression| changed(x, leaf);
    match law {
        Expression::Unary(function, x) => Expression::Unary(*function, same(x).into()),
        Expression::Binary(function, x, y) => {
            Expression::Binary(*function, same(x).into(), same(y).into())
        }
        Expression::Chain(first, rest) => {
            let rest = rest.iter().map(|(operator, x)| (*operator, same(x)));
            Expression::Chain(same(first).into(), rest.collect())
        }
        other => leaf(other),
    }
}

/// The laws as they are from a time (s) on, which becomes zero: next to a large time, short steps are rounded.
pub fn from_time(model: &mut SourceModel, begin: f64) {
    replace_time(model, &plus(Expression::Time, Expression::Number(begin)));
}

/// Only a share of damping, friction, dissipation and air is left; models of hinges become the laws that they led to.
pub fn damped(model: &mut SourceModel, compiled: &Compiled, share: f64) {
    let mechanism = &compiled.topology.mechanism;
    let fixed = |law: &Expression| {
        changed(law, &|leaf| match leaf {
            Expression::Parameter(id) => Expression::Number(mechanism.parameters[id.index()].value),
            other => other.clone(),
        })
    };
    model.tunable.clear();
    for (joint, law) in model.joints.iter_mut().zip(&mechanism.joints) {
        joint.spring = Spring::Stiffness(spanned(fixed(&law.stiffness)));
        joint.damping.value = times(fixed(&law.damping), share);
        if let Some(friction) = &mut joint.friction {
            friction.torque.value = times(friction.torque.value.clone(), share);
        }
    }
    let air = model.air.iter_mut().map(|air| &mut air.density.value);
    air.for_each(|law| *law = times(law.clone(), share));
    for contact in &mut model.contacts {
        for law in [&mut contact.dissipation, &mut contact.friction] {
            law.value = times(law.value.clone(), share);
        }
    }
    for law in dampings(model) {
        *law = times(law.clone(), share);
    }
    for motor in &mut model.elements.motors {
        motor.resistance.value = times(motor.resistance.value.clone(), 1.0 / share);
    }
}

/// The dampings of springs and tendons.
fn dampings(model: &mut SourceModel) -> impl Iterator<Item = &mut Expression> {
    let elements = &mut model.elements;
    let tendons = elements.bands.iter_mut().chain(&mut elements.tendons);
    let tendons = tendons.filter_map(|tendon| match &mut tendon.tension {
        Tension::Given(_) => None,
        Tension::Elastic { damping, .. } => Some(&mut damping.value),
    });
    tendons.chain(elements.twists.iter_mut().map(|twist| &mut twist.damping.value))
}

fn replace_time(model: &mut SourceModel, new: &Expression) {
    for law in laws(model) {
        *law = changed(law, &|leaf| match leaf {
            Expression::Time => new.clone(),
            other => other.clone(),
        });
    }
}

/// Only gravity, springs and smooth contacts without edges are left, as they are at one time; driven joints are held.
pub fn conservative(model: &mut SourceModel, compiled: &Compiled) {
    let mechanism = &compiled.topology.mechanism;
    let frozen = |law: &Expression| {
        let leaf = |leaf: &Expression| match leaf {
            Expression::Time => FROZEN,
            Expression::Input(_) => INPUT,
            Expression::Parameter(id) => mechanism.parameters[id.index()].value,
            _ => f64::NAN,
        };
        Expression::Number(law.evaluate(&leaf))
    };
    model.tunable.clear();
    model.forces.clear();
    model.air = None;
    for (contact, law) in model.contacts.iter_mut().zip(&mechanism.contacts) {
        contact.stiffness = Some(spanned(frozen(&law.stiffness)));
        contact.dissipation.value = Expression::ZERO;
        contact.friction.value = Expression::ZERO;
        contact.plane.within = None;
    }
    model.gravity = mechanism.gravity.each_ref().map(frozen);
    for (joint, law) in model.joints.iter_mut().zip(&mechanism.joints) {
        joint.spring = Spring::Stiffness(spanned(frozen(&law.stiffness)));
        joint.cubic_stiffness.value = frozen(&law.cubic_stiffness);
        joint.rest.value = frozen(&law.rest);
        joint.damping.value = Expression::ZERO;
        joint.torque.value = Expression::ZERO;
        joint.friction = None;
        joint.limits = None;
        joint.drive = law.drive.as_ref().map(|drive| spanned(frozen(drive)));
    }
    model.elements.tendons.retain(|it| matches!(it.tension, Tension::Elastic { .. }));
    for motor in &mut model.elements.motors {
        // No current flows.
        let constant = times(motor.torque_constant.value.clone(), motor.gear.value);
        let rate = Expression::Rate(motor.joint.value);
        motor.voltage.value = Expression::Chain(Box::new(constant), vec![(Operator::Mul, rate)]);
        (motor.max_voltage, motor.max_current) = (None, None);
    }
    dampings(model).for_each(|law| *law = Expression::ZERO);
    let elements = &mut model.elements;
    for Tendon { tension, .. } in elements.bands.iter_mut().chain(&mut elements.tendons) {
        let Tension::Elastic { stiffness, rest_length, tension_only, .. } = tension else {
            continue;
        };
        stiffness.value = frozen(&stiffness.value);
        // Taut all the time: where a line becomes slack, no method has its order.
        *rest_length = match (&rest_length, *tension_only) {
            (Some(length), false) => Some(spanned(frozen(&length.value))),
            (None, false) => None,
            (_, true) => Some(spanned(Expression::ZERO)),
        };
    }
    for twist in &mut elements.twists {
        twist.stiffness.value = frozen(&twist.stiffness.value);
        twist.rest.value = frozen(&twist.rest.value);
    }
}

/// The ground itself turns freely about a line in the plane. Nothing acts from outside but gravity along this
/// line; the laws inside do not change with time.
pub fn turntable(model: &mut SourceModel, compiled: &Compiled) {
    let size = compiled.topology.mechanism.size;
    let Some(ground) = model.bodies.iter().position(|body| body.fixed) else { return };
    model.bodies[ground].fixed = false;
    let fixed: Vec<bool> = model.bodies.iter().map(|body| body.fixed).collect();
    // All fixed bodies are one: now the one that turns.
    for body in model.joints.iter_mut().flat_map(|joint| &mut joint.bodies) {
        if fixed[body.value.index()] {
            body.value = BodyId(ground);
        }
    }
    for contact in &mut model.contacts {
        let body = &mut contact.plane.body;
        if body.as_ref().is_none_or(|body| fixed[body.value.index()]) {
            *body = Some(spanned(BodyId(ground)));
        }
    }
    let points = model.points.iter_mut().map(|point| &mut point.body);
    let twists = model.elements.twists.iter_mut().flat_map(|twist| &mut twist.bodies);
    for body in points.chain(twists.map(|body| &mut body.value)) {
        if fixed[body.index()] {
            *body = BodyId(ground);
        }
    }
    let earth = BodyId(model.bodies.len());
    let (name, point_masses) = (spanned("earth".to_owned()), Vec::new());
    let span = Span::default();
    let (shape, slits) = (Shape::None, Vec::new());
    model.bodies.push(Body { name, fixed: true, free: false, shape, slits, point_masses, span });
    let axis = TABLE.map(|point| point.map(|share| share * size));
    model.joints.push(Joint {
        name: spanned("turntable".to_owned()),
        bodies: [earth, BodyId(ground)].map(spanned),
        axis: spanned(axis).into(),
        z: spanned(0.0).into(),
        spring: Spring::Stiffness(spanned(Expression::ZERO)),
        damping: spanned(Expression::ZERO),
        rest: spanned(Expression::ZERO),
        cubic_stiffness: spanned(Expression::ZERO),
        friction: None,
        limits: None,
        torque: spanned(Expression::ZERO),
        drive: None,
        fold: None,
        span: Span::default(),
    });
    model.forces.clear();
    model.air = None;
    replace_time(model, &Expression::Number(FROZEN));
    let along = [0, 1].map(|i| axis[1][i] - axis[0][i]);
    let length = hypot(along[0], along[1]);
    let strength = model.gravity[0].clone();
    let component = |share: f64| times(strength.clone(), share / length);
    model.gravity = [component(along[0]), component(along[1]), Expression::ZERO];
}

/// A law times a number.
pub fn times(law: Expression, factor: f64) -> Expression {
    Expression::Chain(Box::new(law), vec![(Operator::Mul, Expression::Number(factor))])
}

/// A law plus another.
pub fn plus(law: Expression, other: Expression) -> Expression {
    Expression::Chain(Box::new(law), vec![(Operator::Add, other)])
}
