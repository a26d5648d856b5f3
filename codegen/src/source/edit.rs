//! Changes of a model that a command asks for: joints locked, forces released, loops cut,
//! inputs given as functions of time.

use super::diagnostic::Spanned;
use super::expression::Expression;
use super::formula::{self, Scope};
use super::ids::{JointId, ParameterId};
use super::model::{SourceModel, Spring, Tunable};
use super::names::alternatives;

/// A change that the model does not admit.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EditError {
    /// No such name in the model.
    #[error("there is no {what} `{name}`: {hint}")]
    #[allow(missing_docs, reason = "the message says it all")]
    Unknown { what: &'static str, name: String, hint: String },
    /// Not an expression of t and the parameters.
    #[error("`{text}`: {reason}")]
    #[allow(missing_docs, reason = "the message says it all")]
    Expression { text: String, reason: String },
}

/// What an input may depend on, besides t: parameters.
struct Parameters<'m>(&'m SourceModel);

impl Scope for Parameters<'_> {
    fn symbol(&self, name: &str) -> Option<Expression> {
        let index = self.0.parameters.iter().position(|parameter| parameter.name.value == name)?;
        Some(Expression::Parameter(ParameterId(index)))
    }

    fn symbols(&self) -> Vec<&str> {
        self.0.parameters.iter().map(|parameter| parameter.name.value.as_str()).collect()
    }

    fn joint(&self, name: &str) -> Option<JointId> {
        self.0.joints.iter().position(|joint| joint.name.value == name).map(JointId)
    }

    fn joints(&self) -> Vec<&str> {
        self.0.joints.iter().map(|joint| joint.name.value.as_str()).collect()
    }

    fn motion_refused(&self) -> Option<&'static str> {
        Some("an input is given from outside: it may depend on t and parameters, not on q or u")
    }
}

impl SourceModel {
    /// Holds a joint at an angle (rad): it is driven there, whatever drove it before.
    ///
    /// # Errors
    /// When there is no joint of this name.
    pub fn lock(&mut self, joint: &str, angle: f64) -> Result<(), EditError> {
        let joint = self.joint(joint)?;
        let entry = &mut self.joints[joint.index()];
        entry.drive = Some(Spanned { value: Expression::Number(angle), span: entry.span });
        entry.torque.value = Expression::ZERO;
        Ok(())
    }

    /// Lets a joint close a loop: another choice of the tree costs other operations, and moves the
    /// same.
    ///
    /// # Errors
    /// When there is no joint of this name.
    pub fn cut(&mut self, joint: &str) -> Result<(), EditError> {
        let joint = self.joint(joint)?;
        if !self.cuts.contains(&joint) {
            self.cuts.push(joint);
        }
        Ok(())
    }

    fn joint(&self, name: &str) -> Result<JointId, EditError> {
        let names: Vec<&str> = self.joints.iter().map(|joint| joint.name.value.as_str()).collect();
        match names.iter().position(|known| *known == name) {
            Some(index) => Ok(JointId(index)),
            None => {
                let hint = alternatives(name, &names, "joints");
                Err(EditError::Unknown { what: "joint", name: name.to_owned(), hint })
            }
        }
    }

    /// Makes constants of every joint (body) parameters, as `tunable` in the file does.
    pub fn tune(&mut self, kind: Tunable) {
        if self.tunable.iter().all(|known| known.value != kind) {
            self.tunable.push(Spanned { value: kind, span: self.name.span });
        }
    }

    /// Takes away a force, or what drives a joint: its `torque` and its `drive`.
    ///
    /// # Errors
    /// When there is neither a force nor a joint of this name.
    pub fn release(&mut self, name: &str) -> Result<(), EditError> {
        if let Some(index) = self.forces.iter().position(|force| force.name.value == name) {
            self.forces.remove(index);
            return Ok(());
        }
        if let Some(joint) = self.joints.iter_mut().find(|joint| joint.name.value == name) {
            joint.torque.value = Expression::ZERO;
            joint.drive = None;
            return Ok(());
        }
        let forces = self.forces.iter().map(|force| force.name.value.as_str());
        let joints = self.joints.iter().map(|joint| joint.name.value.as_str());
        let names: Vec<&str> = forces.chain(joints).collect();
        let hint = alternatives(name, &names, "forces and joints");
        Err(EditError::Unknown { what: "force or joint", name: name.to_owned(), hint })
    }

    /// Gives an input the value of an expression of t and the parameters wherever it is used.
    ///
    /// # Errors
    /// When there is no input of this name, or the expression cannot be read.
    pub fn prescribe(&mut self, input: &str, text: &str) -> Result<(), EditError> {
        let Some(id) = self.input(input) else {
            let names: Vec<&str> = self.inputs.iter().map(|input| input.value.as_str()).collect();
            let hint = alternatives(input, &names, "inputs");
            return Err(EditError::Unknown { what: "input", name: input.to_owned(), hint });
        };
        let given = formula::parse(text, &Parameters(self)).map_err(|problems| {
            let lines = problems.into_iter().map(|problem| match problem.hint {
                Some(hint) => format!("{} ({hint})", problem.message),
                None => problem.message,
            });
            let reason = lines.collect::<Vec<_>>().join("; ");
            EditError::Expression { text: text.to_owned(), reason }
        })?;
        for expression in self.expressions_mut() {
            expression.replace(&Expression::Input(id), &given);
        }
        Ok(())
    }

    /// Every expression.
    fn expressions_mut(&mut self) -> impl Iterator<Item = &mut Expression> {
        let joints = self.joints.iter_mut().flat_map(|joint| {
            let stiffness = match &mut joint.spring {
                Spring::Stiffness(stiffness) => Some(stiffness),
                Spring::Beam { .. } | Spring::Sharifzadeh2018 { .. } | Spring::Family { .. } => {
                    None
                }
            };
            let friction = joint.friction.as_mut().map(|friction| &mut friction.torque);
            let others = [
                &mut joint.damping,
                &mut joint.rest,
                &mut joint.torque,
                &mut joint.cubic_stiffness,
            ];
            let others = others.into_iter().chain(stiffness).chain(friction);
            let expressions = others.chain(&mut joint.drive);
            expressions.map(|expression| &mut expression.value)
        });
        let forces = self.forces.iter_mut().flat_map(|force| &mut force.force);
        let air = self.air.iter_mut().flat_map(|air| [&mut air.density, &mut air.drag]);
        let air = air.map(|expression| &mut expression.value);
        self.gravity.iter_mut().chain(joints).chain(forces).chain(air)
    }
}
