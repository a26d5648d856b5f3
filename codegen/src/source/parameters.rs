//! The model at other values of its parameters.

use super::drawn::{Drawn, Places};
use super::expression::Expression;
use super::ids::ParameterId;
use super::model::{Shape, SourceModel, Spring};

/// What is done with each number of the drawing.
trait Visit {
    fn visit<T: Places>(&mut self, drawn: &mut Drawn<T>);
}

/// Evaluates formulas at values of the parameters.
struct Evaluate<'a>(&'a [f64]);

impl Visit for Evaluate<'_> {
    fn visit<T: Places>(&mut self, drawn: &mut Drawn<T>) {
        drawn.evaluate(self.0);
    }
}

/// Puts numbers in place of formulas.
struct Fix;

impl Visit for Fix {
    fn visit<T: Places>(&mut self, drawn: &mut Drawn<T>) {
        drawn.formulas.clear();
    }
}

/// Collects which parameters formulas contain.
struct Used(Vec<bool>);

impl Visit for Used {
    fn visit<T: Places>(&mut self, drawn: &mut Drawn<T>) {
        for (_, formula) in &drawn.formulas {
            for (index, used) in self.0.iter_mut().enumerate() {
                *used |= formula.contains(&Expression::Parameter(ParameterId(index)));
            }
        }
    }
}

impl SourceModel {
    /// Returns the model with other defaults of its parameters, in their order, SI.
    pub fn at(&self, parameters: &[f64]) -> Self {
        let mut model = self.clone();
        for (parameter, value) in model.parameters.iter_mut().zip(parameters) {
            parameter.value = *value;
        }
        model.visit(&mut Evaluate(parameters));
        model
    }

    /// Returns the model at these values, with numbers in place of the formulas of the drawing.
    pub fn fixed_at(&self, parameters: &[f64]) -> Self {
        let mut model = self.at(parameters);
        model.visit(&mut Fix);
        model
    }

    /// Returns which parameters numbers of the drawing depend on.
    pub fn drawn_by(&self) -> Vec<bool> {
        let mut used = Used(vec![false; self.parameters.len()]);
        self.clone().visit(&mut used);
        used.0
    }

    /// Returns whether numbers of the drawing depend on parameters.
    pub fn is_parametric(&self) -> bool {
        self.drawn_by().contains(&true)
    }

    fn visit(&mut self, visit: &mut impl Visit) {
        for material in &mut self.materials {
            visit.visit(&mut material.density);
            visit.visit(&mut material.thickness);
            material.youngs_modulus.iter_mut().for_each(|modulus| visit.visit(modulus));
        }
        for body in &mut self.bodies {
            match &mut body.shape {
                Shape::None => {}
                Shape::Plates(layers) => {
                    for plate in layers.iter_mut().flatten() {
                        visit.visit(&mut plate.outline);
                        plate.holes.iter_mut().for_each(|hole| visit.visit(hole));
                    }
                }
                Shape::Rigid { mass, com, .. } => {
                    visit.visit(mass);
                    visit.visit(com);
                }
            }
            for point in &mut body.point_masses {
                visit.visit(&mut point.mass);
                visit.visit(&mut point.at);
            }
        }
        for joint in &mut self.joints {
            visit.visit(&mut joint.axis);
            visit.visit(&mut joint.z);
            if let Spring::Beam { length, width, gaps, .. } = &mut joint.spring {
                [length, width].into_iter().chain(gaps).for_each(|drawn| visit.visit(drawn));
            }
        }
        self.points.iter_mut().for_each(|point| visit.visit(&mut point.at));
        self.contacts.iter_mut().for_each(|contact| visit.visit(&mut contact.plane.point));
    }
}
