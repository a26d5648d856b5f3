//! Changes of a model that a command asks for: joints locked, forces released, loops cut.

use super::diagnostic::Spanned;
use super::expression::Expression;
use super::ids::JointId;
use super::model::SourceModel;
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
    pub fn cut(&mut self, joint: &str) -> Result<(), UnknownEntry> {
        let joint = self.joint(joint)?;
        if !self.cuts.contains(&joint) {
            self.cuts.push(joint);
        }
        Ok(())
    }

    fn joint(&self, name: &str) -> Result<JointId, UnknownEntry> {
        let names: Vec<&str> = self.joints.iter().map(|joint| joint.name.value.as_str()).collect();
        match names.iter().position(|known| *known == name) {
            Some(index) => Ok(JointId(index)),
            None => {
                let hint = alternatives(name, &names, "joints");
                Err(UnknownEntry { what: "joint", name: name.to_owned(), hint })
            }
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
