//! Measures that are mappings of their own: strokes, clearances, and times to settle.

use lamc::source::Span;
use lamc::source::fields::{Fields, array};
use lamc::source::yaml::{Entry, Node};

use super::measures::text;
use super::path_keys::{CLEARANCE, SETTLE, STROKE};
use super::read::Reader;
use super::{Clearance, Moved, OfState, Settle, Stroke};
use crate::reading::Terms;

impl Reader<'_> {
    /// What moves while a joint is turned.
    pub(super) fn stroke(&mut self, entry: &Entry) -> Option<Stroke> {
        let at = entry.key.span;
        let fields = Fields::new(&entry.value, at, "a stroke", &STROKE, &mut self.found)?;
        self.moves_in_one_way(&fields);
        let of = match [fields.get("point"), fields.get("joint")] {
            [Some(node), None] => {
                let points = self.interface.points.clone();
                self.among(node, text(node), points, "point").map(Moved::Point)
            }
            [None, Some(node)] => self.joint(node).map(Moved::Joint),
            _ => {
                self.wrong(at, "give one of `point` and `joint`");
                None
            }
        };
        let drive = fields.require("drive", &mut self.found)?;
        let drive = self.joint(drive);
        let angles = fields.require("angles", &mut self.found)?;
        let angles = self.first_and_last(angles)?;
        Some(Stroke { of: of?, drive: drive?, angles })
    }

    /// The first and the last angle of a joint that is turned, rad.
    fn first_and_last(&mut self, node: &Node) -> Option<[f64; 2]> {
        let angles = self.angles_of(node)?;
        let found = angles.as_slice().try_into().ok();
        if found.is_none() {
            self.wrong(node.span, "expected `[first, last]`");
        }
        found
    }

    /// Between which bodies, and in which states.
    pub(super) fn clearance(&mut self, entry: &Entry) -> Option<Clearance> {
        let at = entry.key.span;
        let fields = Fields::new(&entry.value, at, "a clearance", &CLEARANCE, &mut self.found)?;
        let between = match fields.get("between") {
            Some(node) => Some(self.between(node)?),
            None => None,
        };
        let turned = match [fields.get("drive"), fields.get("angles")] {
            [None, None] => None,
            [Some(drive), Some(angles)] => {
                self.moves_in_one_way(&fields);
                let drive = self.joint(drive);
                let angles = self.first_and_last(angles)?;
                Some((drive?, angles))
            }
            _ => {
                self.wrong(at, "give both `drive` and `angles`, or neither: then it is at rest");
                return None;
            }
        };
        Some(Clearance { between, turned })
    }

    /// Two bodies with outlines.
    fn between(&mut self, node: &Node) -> Option<[usize; 2]> {
        let [one, other] = array(node, "`[left, right]`", &mut self.found)?;
        let found = [self.body(one), self.body(other)];
        let [Some(first), Some(second)] = found else { return None };
        let mechanism = &self.compiled.topology.mechanism;
        for (body, node) in [(first, one), (second, other)] {
            if mechanism.bodies[body].sheets.is_empty() {
                self.wrong(node.span, format!("`{}` has no outline", text(node)));
                return None;
            }
        }
        let share = |joint: &lamc::laminate::Joint| {
            let [a, b] = joint.bodies.map(|body| body.index());
            [a, b] == [first, second] || [b, a] == [first, second]
        };
        if first == second || mechanism.joints.iter().any(share) {
            self.wrong(node.span, "bodies that share a hinge touch there: take two others");
            return None;
        }
        Some([first, second])
    }

    /// What settles, and until when.
    pub(super) fn settle(&mut self, entry: &Entry) -> Option<Settle> {
        let at: Span = entry.key.span;
        let fields = Fields::new(&entry.value, at, "a time to settle", &SETTLE, &mut self.found)?;
        let of = match [fields.get("angle"), fields.get("position")] {
            [Some(node), None] => self.joint(node).map(OfState::Angle),
            [None, Some(node)] => {
                self.point_and_axis(node).map(|[point, axis]| OfState::Position { point, axis })
            }
            _ => {
                self.wrong(at, "give one of `angle` and `position`");
                None
            }
        };
        let within = match (fields.require("within", &mut self.found), of) {
            (Some(node), Some(OfState::Angle(_))) => self.angle(node),
            (Some(node), _) => self.read(node, "m"),
            (None, _) => None,
        };
        if within.is_some_and(|within| within <= 0.0) {
            self.wrong(fields.get("within")?.span, "`within` must be more than 0");
            return None;
        }
        fields.require("until", &mut self.found)?;
        let until = self.number(&fields, "until", "s");
        Some(Settle { of: of?, within: within?, until: until? })
    }
}
