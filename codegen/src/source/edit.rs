//! Changes of a model that a command asks for: joints locked, forces released.

use super::diagnostic::Spanned;
use super::expression::Expression;
use super::model::{SourceModel, Tunable};
use super::names::alternatives;

/// No such name in the model.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no {what} `{name}`: {hint}")]
pub struct UnknownEntry {
    what: &'static str,
    name: String,
    hint: String,
}

impl SourceModel {
    /// Holds a joint at an angle (rad): it is driven there, whatever drove it before.
    ///
    /// # Errors
    /// When there is no joint of this name.
    pub fn lock(&mut self, joint: &str, angle: f64) -> Result<(), UnknownEntry> {
        let names: Vec<&str> = self.joints.iter().map(|joint| joint.name.value.as_str()).collect();
        let Some(index) = names.iter().position(|name| *name == joint) else {
            let hint = alternatives(joint, &names, "joints");
            return Err(UnknownEntry { what: "joint", name: joint.to_owned(), hint });
        };
        let entry = &mut self.joints[index];
        entry.drive = Some(Spanned { value: Expression::Number(angle), span: entry.span });
        entry.torque.value = Expression::ZERO;
        Ok(())
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
    pub fn release(&mut self, name: &str) -> Result<(), UnknownEntry> {
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
        Err(UnknownEntry { what: "force or joint", name: name.to_owned(), hint })
    }
}
