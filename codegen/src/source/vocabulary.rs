//! Formulas that stand outside of a model file, such as the event of a simulation.

use super::expression::Expression;
use super::formula::{self, Scope};
use super::ids::{InputId, JointId, ParameterId};

/// The names of a model that a formula may use, in the order of their indices.
#[derive(Clone, Debug, Default)]
pub struct Vocabulary<'m> {
    /// Parameters.
    pub parameters: Vec<&'m str>,
    /// Inputs.
    pub inputs: Vec<&'m str>,
    /// Joints, of which a formula may use the angle `q.<joint>` and the speed `u.<joint>`.
    pub joints: Vec<&'m str>,
}

impl Vocabulary<'_> {
    /// Reads a formula of t and of these names, in SI units and radians.
    ///
    /// # Errors
    /// The text is no such formula; the reason is in one line.
    pub fn read(&self, text: &str) -> Result<Expression, String> {
        read(text, self).map_err(|reason| format!("`{text}`: {reason}"))
    }
}

/// Reads a formula; the mistakes in it are one line.
pub(super) fn read(text: &str, scope: &dyn Scope) -> Result<Expression, String> {
    formula::parse(text, scope).map_err(|problems| {
        let lines = problems.into_iter().map(|problem| match problem.hint {
            Some(hint) => format!("{} ({hint})", problem.message),
            None => problem.message,
        });
        lines.collect::<Vec<_>>().join("; ")
    })
}

fn position(names: &[&str], name: &str) -> Option<usize> {
    names.iter().position(|known| *known == name)
}

impl Scope for Vocabulary<'_> {
    fn symbol(&self, name: &str) -> Option<Expression> {
        let parameter =
            position(&self.parameters, name).map(ParameterId).map(Expression::Parameter);
        parameter.or_else(|| position(&self.inputs, name).map(InputId).map(Expression::Input))
    }

    fn symbols(&self) -> Vec<&str> {
        self.parameters.iter().chain(&self.inputs).copied().collect()
    }

    fn joint(&self, name: &str) -> Option<JointId> {
        position(&self.joints, name).map(JointId)
    }

    fn joints(&self) -> Vec<&str> {
        self.joints.clone()
    }

    fn motion_refused(&self) -> Option<&'static str> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 2] = ["left", "right"];

    /// t = 2, k = 3, motor = 5, q = 7 and 11, u = 13 and 17.
    fn value(leaf: &Expression) -> f64 {
        match leaf {
            Expression::Time => 2.0,
            Expression::Parameter(ParameterId(0)) => 3.0,
            Expression::Input(InputId(0)) => 5.0,
            Expression::Position(joint) => [7.0, 11.0][joint.index()],
            Expression::Rate(joint) => [13.0, 17.0][joint.index()],
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn formulas_use_the_names_of_the_model() {
        let names =
            Vocabulary { parameters: vec!["k"], inputs: vec!["motor"], joints: NAMES.to_vec() };
        let read = names.read("t*k - motor + q.right*u.left").unwrap();
        assert_eq!(read.evaluate(&value), 2.0 * 3.0 - 5.0 + 11.0 * 13.0);
        let unknown = names.read("q.rigth - stiffness").unwrap_err();
        assert!(unknown.starts_with("`q.rigth - stiffness`: "), "{unknown}");
        assert!(unknown.contains("`rigth`") && unknown.contains("`stiffness`"), "{unknown}");
        assert!(names.read("q.right +").is_err());
    }
}
