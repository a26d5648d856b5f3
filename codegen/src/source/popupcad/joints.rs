//! Connections: hinge lines between two bodies, with their properties.

use std::f64::consts::PI;

use super::{Ids, Import, head};
use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Span, Spanned};
use crate::source::expression::Expression;
use crate::source::fields::array;
use crate::source::ids::BodyId;
use crate::source::model::{Joint, Spring};
use crate::source::units;
use crate::source::yaml::Node;

impl Import {
    /// Reads a connection: hinge line, two bodies, properties.
    pub(super) fn joint(
        &mut self,
        i: usize,
        node: &Node,
        ids: &Ids,
        fixed: &[BodyId],
    ) -> Option<Joint> {
        let what = "a connection: hinge line, two bodies' ids, `JointProps`";
        let [line, bodies, properties]: &[Node; 3] = array(node, what, &mut self.diagnostics)?;
        let axis = self.axis(line);
        let bodies = array(bodies, "two bodies' ids", &mut self.diagnostics)
            .and_then(|nodes: &[Node; 2]| {
                let [first, second] = nodes.each_ref().map(|node| self.body_of(node, ids));
                Some([first?, second?])
            })
            .and_then(|pair| self.distinct(bodies.span, pair, fixed));
        let at = properties.tag.as_ref().map_or(head(properties), |tag| tag.span);
        let known = ["damping", "limit_neg", "limit_pos", "preload", "stiffness", "z_pos"];
        self.warn_of_others(properties, &known);
        let units = [units::SI, units::SI, units::SI, units::SI, units::SI, self.length];
        let mut read = known
            .into_iter()
            .zip(units)
            .map(|(key, unit)| self.required_number(properties, at, key, unit));
        let [damping, low, high, preload, stiffness, z] =
            std::array::from_fn(|_| read.next().flatten());
        drop(read);
        let height = properties.get("z_pos").and_then(Node::scalar);
        height.into_iter().for_each(|text| self.decimals.note(&text.text, self.length));
        let laws = Laws {
            stiffness: stiffness?,
            damping: damping?,
            preload: preload?,
            limits: self.limits(low?, high?)?,
            z: z?.value,
        };
        Some(hinge(i, node, bodies?, axis?, laws))
    }

    /// Returns the two limits, given in degrees, rad.
    pub(super) fn limits(
        &mut self,
        low: Spanned<f64>,
        high: Spanned<f64>,
    ) -> Option<Spanned<[f64; 2]>> {
        if low.value >= high.value {
            let error =
                Diagnostic::error(codes::EMPTY_LIMITS, low.span, "these limits allow no angle");
            self.diagnostics.push(error.label("must be less than the upper limit"));
            return None;
        }
        let span = Span { start: low.span.start, end: low.span.end };
        Some(Spanned { value: [radians(low.value), radians(high.value)], span })
    }

    /// Reads a hinge line as two points `[x, y]`.
    fn axis(&mut self, line: &Node) -> Option<Spanned<[[f64; 2]; 2]>> {
        let points: &[Node; 2] = array(line, "two points", &mut self.diagnostics)?;
        let [from, to] = points.each_ref().map(|point| {
            let [x, y] = array(point, "`[x, y]`", &mut self.diagnostics)?;
            self.coordinate(x).zip(self.coordinate(y)).map(<[f64; 2]>::from)
        });
        self.line([from?, to?], line.span)
    }

    /// Refuses a hinge line without length.
    pub(super) fn line(
        &mut self,
        [from, to]: [[f64; 2]; 2],
        at: Span,
    ) -> Option<Spanned<[[f64; 2]; 2]>> {
        if crate::arithmetic::hypot(to[0] - from[0], to[1] - from[1]) < f64::MIN_POSITIVE {
            let error = Diagnostic::error(codes::ZERO_AXIS, at, "the hinge line has no length");
            self.diagnostics.push(error.label("the same point twice"));
            return None;
        }
        Some(Spanned { value: [from, to], span: at })
    }

    /// Refuses a joint that cannot turn.
    pub(super) fn distinct(
        &mut self,
        at: Span,
        pair: [Spanned<BodyId>; 2],
        fixed: &[BodyId],
    ) -> Option<[Spanned<BodyId>; 2]> {
        let (code, message) = if pair[0].value == pair[1].value {
            (codes::SAME_BODY, "a joint between a body and itself")
        } else if pair.iter().all(|body| fixed.contains(&body.value)) {
            (codes::BOTH_FIXED, "a joint between two fixed bodies")
        } else {
            return Some(pair);
        };
        self.diagnostics.push(Diagnostic::error(code, at, message));
        None
    }
}

/// The numbers of a hinge.
pub(super) struct Laws {
    /// Stiffness, N m/rad.
    pub stiffness: Spanned<f64>,
    /// Damping, N m s/rad.
    pub damping: Spanned<f64>,
    /// Angle at which the spring is relaxed, deg.
    pub preload: Spanned<f64>,
    /// Allowed angles, rad.
    pub limits: Spanned<[f64; 2]>,
    /// Height of the hinge line, m.
    pub z: f64,
}

/// Returns joint `i`.
pub(super) fn hinge(
    i: usize,
    node: &Node,
    bodies: [Spanned<BodyId>; 2],
    axis: Spanned<[[f64; 2]; 2]>,
    laws: Laws,
) -> Joint {
    let number = |x: Spanned<f64>| Spanned { value: Expression::Number(x.value), span: x.span };
    let Laws { stiffness, damping, preload, limits, z } = laws;
    Joint {
        name: Spanned { value: format!("j{i}"), span: head(node) },
        bodies,
        axis: axis.into(),
        z: Spanned { value: z, span: head(node) }.into(),
        spring: Spring::Stiffness(number(stiffness)),
        damping: number(damping),
        rest: number(Spanned { value: radians(preload.value), span: preload.span }),
        limits: Some(limits),
        cubic_stiffness: Spanned { value: Expression::ZERO, span: head(node) },
        friction: None,
        torque: Spanned { value: Expression::ZERO, span: head(node) },
        drive: None,
        fold: None,
        span: node.span,
    }
}

fn radians(degrees: f64) -> f64 {
    degrees * (PI / 180.0)
}
