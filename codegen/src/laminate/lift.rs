//! Numbers of the drawing as the numbers that a computation uses.

use nalgebra::{Vector2, Vector3};

use super::number::{Number, POINTS, Real};
use crate::source::{Drawn, Places};

/// Takes numbers of the drawing out of the model.
pub trait Lift {
    /// What the numbers become.
    type Real: Real;

    /// Returns the number at a place.
    fn number<D: Places>(&self, drawn: &Drawn<D>, place: usize) -> Self::Real;

    /// Returns a point in space.
    fn point(&self, drawn: &Drawn<[f64; 3]>) -> Vector3<Self::Real> {
        Vector3::from_fn(|axis, _| self.number(drawn, axis))
    }

    /// Returns the vertices of a line.
    fn vertices(&self, drawn: &Drawn<Vec<[f64; 2]>>) -> Vec<Vector2<Self::Real>> {
        let vertices = 0..drawn.value.len();
        vertices
            .map(|index| Vector2::from_fn(|axis, _| self.number(drawn, 2 * index + axis)))
            .collect()
    }
}

/// The values at the defaults of the parameters.
pub struct Values;

impl Lift for Values {
    type Real = f64;

    fn number<D: Places>(&self, drawn: &Drawn<D>, place: usize) -> f64 {
        drawn.value.number(place)
    }
}

/// Numbers with their formulas, known at these points in the space of the parameters, of which the first is that of
/// the defaults.
pub struct Formulas(pub [Vec<f64>; POINTS]);

impl Lift for Formulas {
    type Real = Number;

    fn number<D: Places>(&self, drawn: &Drawn<D>, place: usize) -> Number {
        let value = drawn.value.number(place);
        let Some(formula) = drawn.formula(place) else { return value.into() };
        let at = |parameters: &Vec<f64>| formula.at(parameters).unwrap_or(f64::NAN);
        Number::given(formula, self.0.each_ref().map(at))
    }
}
