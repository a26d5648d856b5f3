//! Changes of a model that a command makes: it locks joints, removes forces, chooses the joints at
//! which loops are cut, and gives inputs as functions of time.

use super::controllers::Controller;
use super::diagnostic::Spanned;
use super::expression::Expression;
use super::formula::Scope;
use super::ids::{JointId, ParameterId};
use super::model::{SourceModel, Spring};
use super::names::alternatives;
use super::tunable::Tunable;
use super::vocabulary;

/// Error of a change that is not possible in this model.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EditError {
    /// The model has no entry with this name.
    #[error("there is no {what} `{name}`: {hint}")]
    #[allow(missing_docs, reason = "the message explains the fields")]
    Unknown { what: &'static str, name: String, hint: String },
    /// The text is not an expression of t and the parameters.
    #[error("`{text}`: {reason}")]
    #[allow(missing_docs, reason = "the message explains the fields")]
    Expression { text: String, reason: String },
    /// A controller drives the input.
    #[error("the controller `{controller}` drives the input `{input}`: it cannot be given as well")]
    #[allow(missing_docs, reason = "the message explains the fields")]
    Controlled { input: String, controller: String },
}

/// Scope of an input's expression, which may depend on t and parameters.
struct Parameters<'m>(&'m SourceModel);

impl Scope for Parameters<'_> {
    fn symbol(&self, name: &str) -> Option<Expression> {
        let index = self.0.parameters.iter().position(|parameter| parameter.name.value == name)?;
        Some(Expression::Parameter(ParameterId(index)))
    }

    fn symbols(&self) -> Vec<&str> {
        let names = self.0.parameters.iter().map(|parameter| parameter.name.value.as_str());
        names.chain(["t"]).collect()
    }

    fn joint(&self, name: &str) -> Option<JointId> {
        self.0.joints.iter().position(|joint| joint.name.value == name).map(JointId)
    }

    fn joints(&self) -> Vec<&str> {
        self.0.joints.iter().map(|joint| joint.name.value.as_str()).collect()
    }

    fn motion_refused(&self) -> Option<&'static str> {
        Some(
            "an input is independent of the motion: it may depend on t and parameters, not on q \
              or u",
        )
    }
}

impl SourceModel {
    /// Holds a joint at an angle (rad): this angle replaces the joint's `drive`.
    ///
    /// # Errors
    /// Returns an error if no joint has this name.
    pub fn lock(&mut self, joint: &str, angle: f64) -> Result<(), EditError> {
        let joint = self.joint(joint)?;
        let entry = &mut self.joints[joint.index()];
        entry.drive = Some(Spanned { value: Expression::Number(angle), span: entry.span });
        entry.torque.value = Expression::ZERO;
        self.elements.motors.retain(|motor| motor.joint.value != joint);
        Ok(())
    }

    /// Cuts a loop at this joint. The choice changes the number of operations, but not the motion.
    ///
    /// # Errors
    /// Returns an error if no joint has this name.
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

    /// Turns constants of every joint (body) into parameters, as `tunable` in the file does.
    pub fn tune(&mut self, kind: Tunable) {
        if self.tunable.iter().all(|known| known.value != kind) {
            self.tunable.push(Spanned { value: kind, span: self.name.span });
        }
    }

    /// Removes a force, or the `torque` and the `drive` of a joint.
    ///
    /// # Errors
    /// Returns an error if neither a force nor a joint has this name.
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

    /// Replaces an input by an expression of t and the parameters.
    ///
    /// # Errors
    /// Returns an error if no input has this name or the expression cannot be read.
    pub fn prescribe(&mut self, input: &str, text: &str) -> Result<(), EditError> {
        let Some(id) = self.input(input) else {
            let names: Vec<&str> = self.inputs.iter().map(|input| input.value.as_str()).collect();
            let hint = alternatives(input, &names, "inputs");
            return Err(EditError::Unknown { what: "input", name: input.to_owned(), hint });
        };
        let drives = |controller: &&Controller| {
            controller.commands.iter().any(|command| command.input == id)
        };
        if let Some(controller) = self.controllers.iter().find(drives) {
            let controller = controller.name.clone();
            return Err(EditError::Controlled { input: input.to_owned(), controller });
        }
        let given = vocabulary::read(text, &Parameters(self))
            .map_err(|reason| EditError::Expression { text: text.to_owned(), reason })?;
        for expression in self.expressions_mut() {
            expression.replace(&Expression::Input(id), &given);
        }
        Ok(())
    }

    /// Visits every expression of the model.
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
        let contacts = self.contacts.iter_mut().flat_map(|contact| {
            let laws = [&mut contact.dissipation, &mut contact.friction];
            laws.into_iter().chain(&mut contact.stiffness)
        });
        let laws = air.chain(contacts).map(|expression| &mut expression.value);
        let elements = self.elements.laws_mut().map(|(law, _)| &mut law.value);
        let controllers = self.controllers.iter_mut().flat_map(|controller| {
            let memory = controller.memory.iter_mut().map(|memory| &mut memory.next);
            memory.chain(controller.commands.iter_mut().map(|command| &mut command.value))
        });
        let others = laws.chain(elements).chain(controllers);
        self.gravity.iter_mut().chain(joints).chain(forces).chain(others)
    }
}
