//! Units of numbers on a command line: the unit of angles without a unit, and the dimensions of
//! parameters and inputs, from their unit in the file or from their use in the model.
//!
//! Formulas are not analysed. A name that is the whole formula of a key, or a term of a sum there,
//! has the dimension of the key.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::argument::AngleUnit;
use super::expression::{Expression, Operator, Unary};
use super::ids::{InputId, ParameterId};
use super::model::{Contact, Joint, SourceModel, Spring};
use super::tunable::Tunable;
use super::units::{
    ACCELERATION, ANGLE, CUBIC_STIFFNESS, DAMPING, DENSITY, Dimension, FORCE, LINEAR_STIFFNESS,
    NUMBER, SLOWNESS, STIFFNESS, TORQUE,
};

/// What is known of numbers that are given beside the model, as on a command line.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Numbers {
    /// Unit of angles without a unit.
    pub angle: AngleUnit,
    /// Dimensions of parameters and inputs by name, where they are known.
    pub dimensions: BTreeMap<String, Dimension>,
    /// Ranges of parameters by name, SI, where the model gives them.
    pub ranges: BTreeMap<String, [f64; 2]>,
}

impl SourceModel {
    /// What is known of numbers that are given beside the model.
    pub fn numbers(&self) -> Numbers {
        let mut dimensions = BTreeMap::new();
        for (index, parameter) in self.parameters.iter().enumerate() {
            let by_use = || self.dimension_by_use(&Expression::Parameter(ParameterId(index)));
            let dimension = parameter.dimension.or_else(by_use);
            dimensions.extend(dimension.map(|it| (parameter.name.value.clone(), it)));
        }
        for (index, input) in self.inputs.iter().enumerate() {
            let dimension = self.dimension_by_use(&Expression::Input(InputId(index)));
            dimensions.extend(dimension.map(|it| (input.value.clone(), it)));
        }
        for kind in self.tunable.iter().map(|kind| kind.value) {
            let joints = self.joints.iter().map(|joint| &joint.name.value);
            let bodies = self.bodies.iter().map(|body| &body.name.value);
            let owners: Vec<_> =
                if kind == Tunable::Mass { bodies.collect() } else { joints.collect() };
            let made =
                owners.into_iter().map(|owner| (kind.parameter_name(owner), kind.dimension()));
            dimensions.extend(made);
        }
        let ranges = self.parameters.iter().filter_map(|parameter| {
            let range = parameter.range.as_ref()?;
            Some((parameter.name.value.clone(), range.value))
        });
        Numbers { angle: self.angle, dimensions, ranges: ranges.collect() }
    }

    /// Returns the dimension of a parameter or an input (a leaf of expressions), if it is the same
    /// wherever it is a term.
    fn dimension_by_use(&self, leaf: &Expression) -> Option<Dimension> {
        let laws = self.laws();
        let mut uses = laws.into_iter().filter(|(law, _)| has_term(law, leaf));
        let (_, first) = uses.next()?;
        uses.all(|(_, dimension)| dimension == first).then_some(first)
    }

    /// Visits every expression with its dimension.
    fn laws(&self) -> Vec<(&Expression, Dimension)> {
        let mut laws: Vec<_> = self.gravity.iter().map(|law| (law, ACCELERATION)).collect();
        for joint in &self.joints {
            let Joint { spring, damping, rest, cubic_stiffness, friction, torque, drive, .. } =
                joint;
            if let Spring::Stiffness(stiffness) = spring {
                laws.push((&stiffness.value, STIFFNESS));
            }
            laws.push((&damping.value, DAMPING));
            laws.push((&rest.value, ANGLE));
            laws.push((&cubic_stiffness.value, CUBIC_STIFFNESS));
            laws.extend(friction.iter().map(|friction| (&friction.torque.value, TORQUE)));
            laws.push((&torque.value, TORQUE));
            laws.extend(drive.iter().map(|drive| (&drive.value, ANGLE)));
        }
        laws.extend(self.forces.iter().flat_map(|force| &force.force).map(|law| (law, FORCE)));
        for contact in &self.contacts {
            let Contact { stiffness, dissipation, friction, .. } = contact;
            laws.extend(stiffness.iter().map(|law| (&law.value, LINEAR_STIFFNESS)));
            laws.extend([(&dissipation.value, SLOWNESS), (&friction.value, NUMBER)]);
        }
        if let Some(air) = &self.air {
            laws.extend([(&air.density.value, DENSITY), (&air.drag.value, NUMBER)]);
        }
        laws.extend(self.elements.laws().map(|(law, quantity)| (&law.value, quantity)));
        laws.into_iter().map(|(law, quantity)| (law, quantity.dimension)).collect()
    }
}

/// Returns whether a leaf is the whole expression or a term of a sum.
fn has_term(law: &Expression, leaf: &Expression) -> bool {
    match law {
        Expression::Unary(Unary::Neg, x) => has_term(x, leaf),
        Expression::Chain(first, rest) => {
            let is_sum = |operator: &Operator| matches!(operator, Operator::Add | Operator::Sub);
            rest.iter().all(|(operator, _)| is_sum(operator))
                && (has_term(first, leaf) || rest.iter().any(|(_, next)| has_term(next, leaf)))
        }
        other => other == leaf,
    }
}
