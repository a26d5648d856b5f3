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
        let [damping, low, high, preload, stiffness, z] =
            known.map(|key| self.required_number(properties, at, key));
        let height = properties.get("z_pos").and_then(Node::scalar);
        height.into_iter().for_each(|text| self.decimals.note(&text.text, units::SI));
        let (low, high) = (low?, high?);
        if low.value >= high.value {
            let error =
                Diagnostic::error(codes::EMPTY_LIMITS, low.span, "these limits allow no angle");
            self.diagnostics.push(error.label("must be less than `limit_pos`"));
            return None;
        }
        let number = |x: Spanned<f64>| Spanned { value: Expression::Number(x.value), span: x.span };
        let preload = preload?;
        let limits = Span { start: low.span.start, end: low.span.end };
        Some(Joint {
            name: Spanned { value: format!("j{i}"), span: head(node) },
            bodies: bodies?,
            axis: axis?,
            z: z?.value,
            spring: Spring::Stiffness(number(stiffness?)),
            damping: number(damping?),
            rest: number(Spanned { value: radians(preload.value), span: preload.span }),
            limits: Some(Spanned {
                value: [radians(low.value), radians(high.value)],
                span: limits,
            }),
            cubic_stiffness: Spanned { value: Expression::ZERO, span: head(node) },
            friction: None,
            torque: Spanned { value: Expression::ZERO, span: head(node) },
            drive: None,
            span: node.span,
        })
    }

    fn axis(&mut self, line: &Node) -> Option<Spanned<[[f64; 2]; 2]>> {
        let points: &[Node; 2] = array(line, "two points", &mut self.diagnostics)?;
        let [from, to] = points.each_ref().map(|point| {
            let [x, y] = array(point, "`[x, y]`", &mut self.diagnostics)?;
            self.coordinate(x).zip(self.coordinate(y)).map(<[f64; 2]>::from)
        });
        let (from, to) = (from?, to?);
        if crate::arithmetic::hypot(to[0] - from[0], to[1] - from[1]) < f64::MIN_POSITIVE {
            let error =
                Diagnostic::error(codes::ZERO_AXIS, line.span, "the hinge line has no length");
            self.diagnostics.push(error.label("the same point twice"));
            return None;
        }
        Some(Spanned { value: [from, to], span: line.span })
    }

    fn distinct(
        &mut self,
        at: Span,
        pair: [Spanned<BodyId>; 2],
        fixed: &[BodyId],
    ) -> Option<[Spanned<BodyId>; 2]> {
        let (code, message) = if pair[0].value == pair[1].value {
            (codes::SAME_BODY, "a joint between a body and itself")
        } else if pair.iter().all(|body| fixed.contains(&body.value)) {
            (codes::BOTH_FIXED, "a joint between two bodies of `newtonian_ids`")
        } else {
            return Some(pair);
        };
        self.diagnostics.push(Diagnostic::error(code, at, message));
        None
    }
}

fn radians(degrees: f64) -> f64 {
    degrees * (PI / 180.0)
}
