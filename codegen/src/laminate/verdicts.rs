//! Checks of hinges, bodies and air for impossible values, at given values of the parameters.
//!
//! The same checks are used for constants, for the defaults of parameters and for parameters that
//! are set later. Values that depend on time, inputs or the motion are not checked.

use std::fmt;

use super::elements::{Elements, Tension};
use super::mechanism::{Contact, Joint, Mechanism};
use crate::source::codes::{self, Code};
use crate::source::elements as given;
use crate::source::{
    BodyId, ContactId, Diagnostic, Expression, JointId, Severity, SourceModel, Span, Spring,
};

/// An impossible or unusual value of a formula.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Error or warning.
    pub severity: Severity,
    code: Code,
    message: String,
    /// The value, if it depends on parameters.
    label: String,
    hint: Option<String>,
    law: Law,
}

/// Position of a formula in the model.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Law {
    Stiffness(JointId),
    Damping(JointId),
    Rest(JointId),
    Cubic(JointId),
    Friction(JointId),
    Drive(JointId),
    Mass(BodyId),
    ContactStiffness(ContactId),
    ContactDissipation(ContactId),
    ContactFriction(ContactId),
    AirDensity,
    Drag,
    /// Part of a spring between points or of a tendon: 0 its stiffness or given tension, 1 damping, 2 rest length.
    Tendon(usize, usize),
    /// Part of a torsion spring: 0 stiffness, 1 damping, 2 rest angle.
    Twist(usize, usize),
    /// Part of a motor: 0 torque constant, 1 resistance, 2 and 3 limits of voltage and current.
    Motor(usize, usize),
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)?;
        if !self.label.is_empty() {
            write!(f, " ({})", self.label)?;
        }
        self.hint.iter().try_for_each(|hint| write!(f, "; {hint}"))
    }
}

impl Verdict {
    /// Converts it to a diagnostic with its position in the file.
    pub(super) fn diagnostic(self, model: &SourceModel) -> Diagnostic {
        let span = self.law.span(model);
        let found = Diagnostic::error(self.code, span, self.message).label(self.label);
        Diagnostic { severity: self.severity, hint: self.hint, ..found }
    }
}

impl Law {
    fn span(self, model: &SourceModel) -> Span {
        let joint = |id: JointId| &model.joints[id.index()];
        let whole = model.name.span;
        match self {
            Self::Stiffness(id) => match &joint(id).spring {
                Spring::Stiffness(stiffness) => stiffness.span,
                Spring::Beam { .. } => joint(id).name.span,
                Spring::Sharifzadeh2018 { span, .. } | Spring::Family { span, .. } => *span,
            },
            Self::Damping(id) => match &joint(id).spring {
                Spring::Stiffness(_) | Spring::Beam { .. } => joint(id).damping.span,
                Spring::Sharifzadeh2018 { span, .. } | Spring::Family { span, .. } => *span,
            },
            Self::Rest(id) => joint(id).rest.span,
            Self::Cubic(id) => joint(id).cubic_stiffness.span,
            Self::Friction(id) => joint(id).friction.as_ref().map_or(whole, |it| it.torque.span),
            Self::Drive(id) => joint(id).drive.as_ref().map_or(whole, |drive| drive.span),
            Self::Mass(id) => model.bodies[id.index()].name.span,
            Self::ContactStiffness(id) => {
                let contact = &model.contacts[id.index()];
                contact.stiffness.as_ref().map_or(contact.name.span, |law| law.span)
            }
            Self::ContactDissipation(id) => model.contacts[id.index()].dissipation.span,
            Self::ContactFriction(id) => model.contacts[id.index()].friction.span,
            Self::AirDensity => model.air.as_ref().map_or(whole, |air| air.density.span),
            Self::Drag => model.air.as_ref().map_or(whole, |air| air.drag.span),
            Self::Tendon(index, part) => of_tendon(model, index, part).unwrap_or(whole),
            Self::Twist(index, part) => {
                let twist = &model.elements.twists[index];
                [&twist.stiffness, &twist.damping, &twist.rest][part].span
            }
            Self::Motor(index, part) => {
                let motor = &model.elements.motors[index];
                let limits = [&motor.max_voltage, &motor.max_current];
                let limits = limits.map(|limit| limit.as_ref().unwrap_or(&motor.voltage));
                [&motor.torque_constant, &motor.resistance, limits[0], limits[1]][part].span
            }
        }
    }
}

/// Returns where a part of a tendon is in the file.
fn of_tendon(model: &SourceModel, index: usize, part: usize) -> Option<Span> {
    let tendon = model.elements.bands.iter().chain(&model.elements.tendons).nth(index)?;
    Some(match &tendon.tension {
        given::Tension::Given(tension) => tension.span,
        given::Tension::Elastic { stiffness, damping, rest_length, .. } => {
            let rest_length = rest_length.as_ref().map_or(tendon.name.span, |length| length.span);
            [stiffness.span, damping.span, rest_length][part]
        }
    })
}

/// Returns all impossible or unusual values for these values of the parameters (SI, in their
/// order).
pub fn verdicts(mechanism: &Mechanism, parameters: &[f64]) -> Vec<Verdict> {
    let mut judge = Judge { parameters, found: Vec::new() };
    for (index, joint) in mechanism.joints.iter().enumerate() {
        judge.coefficients(JointId(index), joint);
        judge.friction_and_drive(JointId(index), joint);
    }
    for (index, body) in mechanism.bodies.iter().enumerate() {
        let Some(parameter) = body.mass_parameter else { continue };
        let law = Expression::Parameter(parameter);
        let is_none = |mass: f64| !(mass > 0.0 && mass.is_finite());
        judge.refuse(&law, Law::Mass(BodyId(index)), codes::NOT_POSITIVE, is_none, || {
            let hint = "it must be finite and greater than zero".to_owned();
            (format!("the mass of `{}` is not positive", body.name), Some(hint))
        });
    }
    for (index, contact) in mechanism.contacts.iter().enumerate() {
        judge.contact(ContactId(index), contact);
    }
    if let Some(air) = &mechanism.air {
        for (what, law, place) in [
            ("density of the air", &air.density, Law::AirDensity),
            ("drag coefficient", &air.drag, Law::Drag),
        ] {
            judge.refuse(law, place, codes::NEGATIVE_DRAG, is_negative, || {
                (format!("the {what} is negative or not finite"), None)
            });
        }
    }
    judge.elements(&mechanism.elements);
    judge.found
}

fn is_negative(value: f64) -> bool {
    !(value >= 0.0 && value.is_finite())
}

struct Judge<'p> {
    parameters: &'p [f64],
    found: Vec<Verdict>,
}

impl Judge<'_> {
    /// Checks stiffness, damping, rest angle and cubic stiffness of a joint.
    fn coefficients(&mut self, id: JointId, joint: &Joint) {
        let name = &joint.name;
        for (what, law, place) in [
            ("stiffness", &joint.stiffness, Law::Stiffness(id)),
            ("damping", &joint.damping, Law::Damping(id)),
            ("rest angle", &joint.rest, Law::Rest(id)),
            ("cubic stiffness", &joint.cubic_stiffness, Law::Cubic(id)),
        ] {
            self.refuse(
                law,
                place,
                codes::NOT_FINITE,
                |value| !value.is_finite(),
                || (format!("the {what} of `{name}` is not finite"), None),
            );
        }
        self.refuse(
            &joint.damping,
            Law::Damping(id),
            codes::NEGATIVE_DAMPING,
            |b| b < 0.0,
            || (format!("the damping of `{name}` is negative: it would add energy"), None),
        );
        self.refuse(
            &joint.stiffness,
            Law::Stiffness(id),
            codes::NEGATIVE_STIFFNESS,
            |k| k < 0.0,
            || {
                let message = format!(
                    "the stiffness of `{name}` is negative: the spring pushes it away \
                             from its rest angle"
                );
                (message, Some("this is correct only for a bistable hinge".to_owned()))
            },
        );
    }

    /// Checks friction and prescribed angle of a joint.
    fn friction_and_drive(&mut self, id: JointId, joint: &Joint) {
        let (name, parameters) = (&joint.name, self.parameters);
        if let Some(friction) = &joint.friction {
            let place = Law::Friction(id);
            self.refuse(&friction.torque, place, codes::NEGATIVE_FRICTION, is_negative, || {
                let message = format!("the friction of `{name}` is negative or not finite");
                (message, Some("friction acts against the motion: give its magnitude".to_owned()))
            });
        }
        if let Some(drive) = &joint.drive {
            let [low, high] = joint.limits;
            let is_outside = |angle: f64| angle < low || angle > high;
            self.refuse(drive, Law::Drive(id), codes::DRIVEN_OUTSIDE_LIMITS, is_outside, || {
                let angle = drive.at(parameters).unwrap_or(f64::NAN);
                let [angle, low, high] = [angle, low, high].map(f64::to_degrees);
                let hint = format!("{angle:.4} deg is not within {low:.4} .. {high:.4} deg");
                (format!("the angle of `{name}` is outside its limits"), Some(hint))
            });
        }
    }

    /// Checks the laws of a contact.
    fn contact(&mut self, id: ContactId, contact: &Contact) {
        let Contact { name, stiffness, dissipation, friction, .. } = contact;
        let is_soft = |stiffness: f64| !(stiffness > 0.0 && stiffness.is_finite());
        let what = |what: &str| format!("the {what} of contact `{name}`");
        let place = Law::ContactStiffness(id);
        self.refuse(stiffness, place, codes::NEGATIVE_CONTACT, is_soft, || {
            (what("stiffness") + " is not positive: it would pull, or not push at all", None)
        });
        for (key, law, place) in [
            ("dissipation", dissipation, Law::ContactDissipation(id)),
            ("friction", friction, Law::ContactFriction(id)),
        ] {
            self.refuse(law, place, codes::NEGATIVE_CONTACT, is_negative, || {
                (what(key) + " is negative or not finite: it would add energy", None)
            });
        }
    }

    /// Checks springs, tendons and motors.
    fn elements(&mut self, elements: &Elements) {
        const NEGATIVE: (Code, fn(f64) -> bool, &str) =
            (codes::NEGATIVE_ELEMENT, is_negative, "is negative or not finite");
        const NOT_POSITIVE: (Code, fn(f64) -> bool, &str) =
            (codes::NOT_POSITIVE, |value| !(value > 0.0 && value.is_finite()), "is not positive");
        const NOT_FINITE: (Code, fn(f64) -> bool, &str) =
            (codes::NOT_FINITE, |value| !value.is_finite(), "is not finite");
        let mut refuse =
            |what, law, name: &str, place, (code, is_wrong, why): (_, fn(f64) -> bool, _)| {
                let say = || (format!("the {what} of `{name}` {why}"), None);
                self.refuse(law, place, code, is_wrong, say);
            };
        for (index, tendon) in elements.tendons.iter().enumerate() {
            let laws = match &tendon.tension {
                Tension::Given(tension) => vec![("tension", tension)],
                Tension::Elastic { stiffness, damping, rest_length, .. } => {
                    vec![
                        ("stiffness", stiffness),
                        ("damping", damping),
                        ("rest length", rest_length),
                    ]
                }
            };
            for (part, (what, law)) in laws.into_iter().enumerate() {
                refuse(what, law, &tendon.name, Law::Tendon(index, part), NEGATIVE);
            }
        }
        for (index, twist) in elements.twists.iter().enumerate() {
            let name = &twist.name;
            refuse("stiffness", &twist.stiffness, name, Law::Twist(index, 0), NEGATIVE);
            refuse("damping", &twist.damping, name, Law::Twist(index, 1), NEGATIVE);
            refuse("rest angle", &twist.rest, name, Law::Twist(index, 2), NOT_FINITE);
        }
        for (index, motor) in elements.motors.iter().enumerate() {
            let laws = [
                ("torque constant", Some(&motor.torque_constant)),
                ("resistance", Some(&motor.resistance)),
                ("largest voltage", motor.max_voltage.as_ref()),
                ("largest current", motor.max_current.as_ref()),
            ];
            for (part, (what, law)) in laws.into_iter().enumerate() {
                let Some(law) = law else { continue };
                refuse(what, law, &motor.name, Law::Motor(index, part), NOT_POSITIVE);
            }
        }
    }

    /// Reports a formula whose value is known and wrong; `say` gives the message and a hint.
    fn refuse(
        &mut self,
        law: &Expression,
        place: Law,
        code: Code,
        is_wrong: impl Fn(f64) -> bool,
        say: impl Fn() -> (String, Option<String>),
    ) {
        let Some(value) = law.at(self.parameters).filter(|value| is_wrong(*value)) else { return };
        let label = match law.constant() {
            Some(_) => String::new(),
            None => format!("with these parameters it is {value}"),
        };
        let (message, hint) = say();
        // A negative stiffness may be intended.
        let severity = match code == codes::NEGATIVE_STIFFNESS {
            true => Severity::Warning,
            false => Severity::Error,
        };
        self.found.push(Verdict { severity, code, message, label, hint, law: place });
    }
}
