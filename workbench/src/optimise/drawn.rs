//! Numbers of a design that need no state: what is drawn, at values of the parameters; and differences where there are no
//! derivatives.

use std::borrow::Cow;

use lamc::laminate;
use lamc::source::Diagnostics;
use nalgebra::RowDVector;

use super::evaluate::Problem;
use super::number::Number;

/// Step of the differences, as a share of a range. Five points are exact for polynomials up to degree 4, as masses and
/// lengths are in most numbers of a drawing; else the error is about the fourth power of the step, and rounding is 1e-13.
const STEP: f64 = 2e-3;
/// For the first, the middle and the last of five points with equal steps: the steps to the others, and the weights of the
/// derivative (B. Fornberg, Mathematics of Computation 51, 1988, table 1 and 3).
const STENCILS: [([f64; 5], [f64; 5]); 3] = [
    ([0.0, 1.0, 2.0, 3.0, 4.0], [-25.0 / 12.0, 4.0, -3.0, 4.0 / 3.0, -0.25]),
    ([-2.0, -1.0, 0.0, 1.0, 2.0], [1.0 / 12.0, -2.0 / 3.0, 0.0, 2.0 / 3.0, -1.0 / 12.0]),
    ([0.0, -1.0, -2.0, -3.0, -4.0], [25.0 / 12.0, -4.0, 3.0, -4.0 / 3.0, 0.25]),
];

/// The derivatives of a number at shares of the ranges, by differences within the ranges: `number` has the shares, and by how
/// much which of them is moved.
pub fn slope(
    x: &[f64],
    number: impl Fn(&[f64], (usize, f64)) -> Result<f64, String>,
) -> Result<RowDVector<f64>, String> {
    let mut slope = RowDVector::zeros(x.len());
    for variable in 0..x.len() {
        let stencil = match x[variable] {
            low if low < 2.0 * STEP => 0,
            high if high > 1.0 - 2.0 * STEP => 2,
            _ => 1,
        };
        let (steps, weights) = STENCILS[stencil];
        for (step, weight) in steps.iter().zip(weights).filter(|(_, weight)| *weight != 0.0) {
            let mut moved = x.to_vec();
            moved[variable] += step * STEP;
            slope[variable] += weight / STEP * number(&moved, (variable, step * STEP))?;
        }
    }
    Ok(slope)
}

impl Problem<'_> {
    /// The mechanism as it is drawn at values of the parameters.
    pub(super) fn drawn(&self, values: &[f64]) -> Result<Cow<'_, laminate::Mechanism>, String> {
        let Some(model) = &self.compiled.model else {
            return Ok(Cow::Borrowed(&self.compiled.topology.mechanism));
        };
        let built = laminate::build(&model.at(values), &mut Diagnostics::default());
        built.map(Cow::Owned).map_err(|problems| problems.to_string())
    }

    /// How far the flat drawing extends along an axis, m.
    pub(super) fn extent(&self, axis: usize, x: &[f64]) -> Result<Number, String> {
        let at = |x: &[f64]| {
            let mechanism = self.drawn(&self.parameters(x))?;
            let sheets = mechanism.bodies.iter().flat_map(|body| &body.sheets);
            let places = sheets.flat_map(|sheet| &sheet.outline).map(|vertex| vertex[axis]);
            let (least, greatest) = places
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), at| (a.min(at), b.max(at)));
            Ok(greatest - least)
        };
        Ok(Number { value: at(x)?, slope: slope(x, |x, _| at(x))? })
    }

    /// The mass of a body, or of all that move, kg.
    pub(super) fn mass(&self, body: Option<usize>, x: &[f64]) -> Result<Number, String> {
        let at = |x: &[f64]| {
            let values = self.parameters(x);
            let mechanism = self.drawn(&values)?;
            let bodies = mechanism.bodies.iter().enumerate();
            let counted =
                bodies.filter(|(index, it)| body.map_or(!it.fixed, |body| body == *index));
            let mass = |it: &laminate::Body| match it.mass_parameter {
                Some(parameter) => values[parameter.index()],
                None => it.mass_properties.mass,
            };
            Ok(counted.map(|(_, it)| mass(it)).sum())
        };
        Ok(Number { value: at(x)?, slope: slope(x, |x, _| at(x))? })
    }
}
