//! Numbers of the drawing, which may be formulas of parameters.

use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Spanned};
use crate::source::drawn::Drawn;
use crate::source::expression::Expression;
use crate::source::fields::{Fields, array};
use crate::source::schema::{VERTEX, Value};
use crate::source::yaml::{Node, shorten};

use super::Lowering;

/// A number at the defaults of the parameters, and its formula if it depends on them.
type Measure = (f64, Option<Expression>);

/// Formulas by the place of their number.
type Formulas = Vec<(usize, Expression)>;

/// Returns numbers, and those that have formulas, by place.
fn apart<const K: usize>(read: [Measure; K]) -> ([f64; K], Formulas) {
    let value = read.each_ref().map(|(value, _)| *value);
    let formulas = read.into_iter().map(|(_, formula)| formula).enumerate();
    (value, formulas.filter_map(|(place, formula)| Some((place, formula?))).collect())
}

impl Lowering<'_> {
    /// Reads a number of the drawing.
    pub(super) fn drawn(&mut self, node: &Node, value: &Value) -> Option<Drawn<f64>> {
        let (value, formula) = self.measure(node, value)?;
        let formulas = formula.map(|formula| (0, formula)).into_iter().collect();
        Some(Drawn { value, span: node.span, formulas })
    }

    /// Reads the number of a required key.
    pub(super) fn required_drawn(&mut self, fields: &Fields, key: &str) -> Option<Drawn<f64>> {
        let node = fields.require(key, &mut self.diagnostics)?;
        self.drawn(node, fields.expected(key))
    }

    /// Reads the number of an optional key: `Some(None)` if the key is missing.
    #[allow(
        clippy::option_option,
        reason = "a missing value and a wrong value are different cases"
    )]
    pub(super) fn optional_drawn(
        &mut self,
        fields: &Fields,
        key: &str,
    ) -> Option<Option<Drawn<f64>>> {
        match fields.get(key) {
            None => Some(None),
            Some(node) => self.drawn(node, fields.expected(key)).map(Some),
        }
    }

    /// Reads the numbers of a required key.
    pub(super) fn required_place<const K: usize>(
        &mut self,
        fields: &Fields,
        key: &str,
    ) -> Option<Drawn<[f64; K]>> {
        let node = fields.require(key, &mut self.diagnostics)?;
        let (value, formulas) = apart(self.measures_of(node, fields.expected(key))?);
        Some(Drawn { value, span: node.span, formulas })
    }

    /// Reads points of the drawing, whose decimals determine the tolerance.
    pub(super) fn drawn_points(
        &mut self,
        list: &Node,
        nodes: &[Node],
    ) -> Option<Drawn<Vec<[f64; 2]>>> {
        let read: Vec<_> = nodes.iter().map(|node| self.drawn_point(node)).collect();
        let read: Vec<_> = read.into_iter().collect::<Option<_>>()?;
        let formulas = read.iter().enumerate().flat_map(|(row, (_, formulas))| {
            formulas.iter().map(move |(place, formula)| (2 * row + place, formula.clone()))
        });
        let formulas = formulas.collect();
        let value = read.into_iter().map(|(point, _)| point).collect();
        Some(Drawn { value, span: list.span, formulas })
    }

    /// Reads a point of the drawing, whose decimals determine the tolerance.
    fn drawn_point(&mut self, node: &Node) -> Option<([f64; 2], Formulas)> {
        let point = apart(self.measures_of(node, &VERTEX)?);
        self.note_decimals_of(node);
        Some(point)
    }

    /// Reads a list of numbers of known length.
    fn measures_of<const K: usize>(&mut self, node: &Node, value: &Value) -> Option<[Measure; K]> {
        let nodes: &[Node; K] = array(node, value.form(), &mut self.diagnostics)?;
        let read = nodes.each_ref().map(|node| self.measure(node, value));
        let complete = read.iter().all(Option::is_some);
        complete.then(|| read.map(|measure| measure.unwrap_or((f64::NAN, None))))
    }

    fn measure(&mut self, node: &Node, value: &Value) -> Option<Measure> {
        let Spanned { value: expression, span } = self.expression(node, value)?;
        // A parameter that could not be read has been reported.
        let defaults: Option<Vec<f64>> =
            self.parameters.iter().map(|read| read.as_ref().map(|known| known.value)).collect();
        let value = expression.at(&defaults?)?;
        if !value.is_finite() {
            let text = node.scalar().map_or("", |scalar| &scalar.text);
            let message = format!("`{}` is not a finite number", shorten(text));
            let error = Diagnostic::error(codes::NOT_FINITE, span, message);
            self.note(error.label(format!("this is {value} with the defaults of the parameters")));
            return None;
        }
        let formula = expression.constant().is_none().then_some(expression);
        Some((value, formula))
    }
}
