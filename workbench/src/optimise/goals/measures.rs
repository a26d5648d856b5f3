//! Numbers of a design, and what they should be.

use lamc::source::fields::Fields;
use lamc::source::yaml::{Entry, Node};
use lamc::source::{Diagnostic, JointId, Span, codes, read_in};

use super::keys::{AXES, ENERGIES};
use super::read::Reader;
use super::{Measure, Moved, Moving, OfState, Stroke, Wanted};
use crate::reading::Terms;

/// The keys of measures.
pub(super) const MEASURES: [&str; 12] = [
    "angle",
    "position",
    "frequency",
    "stiffness",
    "torque",
    "force",
    "mass",
    "extent",
    "clearance",
    "energy",
    "stroke",
    "settle",
];
/// Makes what a number should be of its value.
type Kind = fn(f64) -> Wanted;
/// The word for the mass of all bodies that move.
const ALL: &str = "all";

impl Reader<'_> {
    /// The one number that a goal or constraint is about; `known` mistakes were there before it.
    pub(super) fn measure(&mut self, fields: &Fields, at: Span, known: usize) -> Option<Measure> {
        let given: Vec<&Entry> = MEASURES.iter().filter_map(|key| fields.entry(key)).collect();
        let [entry] = given.as_slice() else {
            let path = fields.key("path").map_or("", |_| "`path`, ");
            let (last, others) = MEASURES.split_last().unwrap_or((&"", &[]));
            let measures = format!("`{}` and `{last}`", others.join("`, `"));
            self.unless_told(at, known, format!("give one of {path}{measures}"));
            return None;
        };
        let measure = self.measured(fields, entry)?;
        let Some(at) = fields.entry("at") else {
            if matches!(measure, Measure::Moving(_)) {
                self.wrong(entry.value.span, "the kinetic energy needs a time: at rest it is 0");
                return None;
            }
            return Some(measure);
        };
        let time = self.number(fields, "at", "s");
        let of = match measure {
            Measure::Angle(joint) => OfState::Angle(joint),
            Measure::Position { point, axis } => OfState::Position { point, axis },
            Measure::Energy => OfState::Energy(1),
            Measure::Moving(Moving { of, .. }) => of,
            _ => {
                let key = &entry.key.value;
                self.wrong(at.key.span, format!("`{key}` does not depend on the time"));
                return None;
            }
        };
        Some(Measure::Moving(Moving { of, at: time? }))
    }

    /// The number of a key, at rest.
    fn measured(&mut self, fields: &Fields, entry: &Entry) -> Option<Measure> {
        let (node, text) = (&entry.value, text(&entry.value));
        match entry.key.value.as_str() {
            "angle" => self.joint(node).map(Measure::Angle),
            "force" => self.joint(node).map(Measure::Force),
            "torque" => {
                let joint = self.joint(node)?;
                if !self.interface.joints[joint].driven {
                    let message =
                        format!("no torque holds `{text}` at rest: its angle is not prescribed");
                    let error = Diagnostic::error(codes::BAD_GOALS, node.span, message);
                    let hint =
                        format!("give `{text}` a `drive` in the model, such as `drive: 30deg`");
                    self.found.push(error.hint(hint));
                    return None;
                }
                Some(Measure::Torque(joint))
            }
            "clearance" => self.clearance(entry).map(Measure::Clearance),
            "settle" => self.settle(entry).map(Measure::Settle),
            "position" => {
                let [point, axis] = self.point_and_axis(node)?;
                Some(Measure::Position { point, axis })
            }
            "stiffness" => {
                let [point, axis] = self.point_and_axis(node)?;
                Some(Measure::Stiffness { point, axis })
            }
            "frequency" => {
                let mode = self.whole(fields, "frequency")?;
                let modes = self.modes() as u64;
                if !(1..=modes).contains(&mode) {
                    let problem = match modes {
                        0 => "the mechanism has no modes: no degree of freedom is left beside its drives"
                            .to_owned(),
                        _ => format!("the mechanism has modes 1 to {modes}"),
                    };
                    self.wrong(node.span, problem);
                    return None;
                }
                Some(Measure::Frequency(mode as usize - 1))
            }
            "energy" => self.one_of(node, ENERGIES).map(|word| match word {
                "kinetic" => Measure::Moving(Moving { of: OfState::Energy(0), at: 0.0 }),
                _ => Measure::Energy,
            }),
            "extent" => {
                let bodies = &self.compiled.topology.mechanism.bodies;
                if bodies.iter().all(|body| body.sheets.is_empty()) {
                    self.wrong(node.span, "no body has an outline");
                    return None;
                }
                let axis = self.one_of(node, AXES)?;
                AXES.iter().position(|known| *known == axis).map(Measure::Extent)
            }
            "stroke" => self.stroke(entry).map(Measure::Stroke),
            _ if text == ALL => Some(Measure::Mass(None)),
            _ => self.body(node).map(|body| Measure::Mass(Some(body))),
        }
    }

    /// How many modes there are about a state of rest. Drives of joints that cannot turn take none away.
    fn modes(&self) -> usize {
        let topology = &self.compiled.topology;
        let joints = topology.mechanism.joints.iter().enumerate();
        let driven = joints.filter(|(index, joint)| {
            joint.drive.is_some() && !topology.infinitesimal.contains(&JointId(*index))
        });
        topology.mobility.saturating_sub(driven.count())
    }

    /// A point and an axis: `tip.z`.
    pub(super) fn point_and_axis(&mut self, node: &Node) -> Option<[usize; 2]> {
        let Some((point, axis)) = text(node).rsplit_once('.') else {
            self.wrong(node.span, "expected a point and a coordinate, such as `tip.z`");
            return None;
        };
        let Some(axis) = ["x", "y", "z"].iter().position(|known| *known == axis) else {
            self.wrong(node.span, "the coordinate must be `x`, `y` or `z`: `tip.z`");
            return None;
        };
        let points = self.interface.points.clone();
        Some([self.among(node, point, points, "point")?, axis])
    }

    /// A joint by its name.
    pub(super) fn joint(&mut self, node: &Node) -> Option<usize> {
        let joints = self.interface.joints.iter().map(|joint| joint.name.clone()).collect();
        self.among(node, text(node), joints, "joint")
    }

    /// A body by its name.
    pub(super) fn body(&mut self, node: &Node) -> Option<usize> {
        let bodies = self.interface.bodies.iter().map(|body| body.name.clone()).collect();
        self.among(node, text(node), bodies, "body")
    }

    pub(super) fn among(
        &mut self,
        node: &Node,
        text: &str,
        known: Vec<String>,
        kind: &str,
    ) -> Option<usize> {
        let known: Vec<&str> = known.iter().map(String::as_str).collect();
        self.name(node.span, text, &known, kind)
    }

    /// The target and the limits of a number that can be read.
    pub(super) fn wanted(&mut self, fields: &Fields, measure: Measure) -> Vec<Wanted> {
        let kinds: [(&str, Kind); 3] = [
            ("target", Wanted::Target),
            ("at_most", Wanted::AtMost),
            ("at_least", Wanted::AtLeast),
        ];
        let given = kinds.iter().filter(|(key, _)| fields.key(key).is_some());
        let mut wanted = Vec::new();
        for (key, kind) in given {
            let Some(node) = fields.get(key) else { continue };
            let Some(value) = self.number_of(measure, node) else { continue };
            // Errors are shares of these numbers.
            let wrong = match measure {
                Measure::Frequency(_)
                | Measure::Stiffness { .. }
                | Measure::Force(_)
                | Measure::Mass(_)
                | Measure::Extent(_)
                | Measure::Settle(_) => (value <= 0.0).then_some("must be more than 0"),
                Measure::Torque(_)
                | Measure::Energy
                | Measure::Moving(Moving { of: OfState::Energy(_), .. }) => {
                    (value == 0.0).then_some("must not be 0")
                }
                _ => None,
            };
            if let Some(wrong) = wrong {
                self.wrong(node.span, format!("`{key}` {wrong}"));
                continue;
            }
            wanted.push(kind(value));
        }
        wanted
    }

    /// A number of the dimension of a measure, SI.
    pub(super) fn number_of(&mut self, measure: Measure, node: &Node) -> Option<f64> {
        match measure {
            Measure::Angle(_) | Measure::Moving(Moving { of: OfState::Angle(_), .. }) => {
                self.angle(node)
            }
            Measure::Position { .. }
            | Measure::Moving(Moving { of: OfState::Position { .. }, .. }) => self.read(node, "m"),
            Measure::Frequency(_) => self.read(node, "Hz"),
            Measure::Stiffness { .. } => self.read(node, "N/m"),
            Measure::Mass(_) => self.read(node, "kg"),
            Measure::Torque(_) => self.read(node, "N*m"),
            Measure::Force(_) => self.read(node, "N"),
            Measure::Settle(_) => self.read(node, "s"),
            Measure::Extent(_) | Measure::Clearance(_) => self.read(node, "m"),
            Measure::Energy | Measure::Moving(_) => self.read(node, "J"),
            Measure::Stroke(Stroke { of: Moved::Joint(_), .. }) => self.angle(node),
            Measure::Stroke(_) => self.read(node, "m"),
        }
    }

    /// An angle, rad; one without a unit is in the unit of the model.
    pub(super) fn angle(&mut self, node: &Node) -> Option<f64> {
        let read = self.compiled.numbers.angle.read(text(node).trim());
        if read.is_none() {
            self.not_a_number(node, "expected an angle, such as `30deg`".to_owned());
        }
        read
    }

    /// A number in SI; `unit` is one of its dimension.
    pub(super) fn read(&mut self, node: &Node, unit: &str) -> Option<f64> {
        read_in(text(node), unit).map_err(|reason| self.not_a_number(node, reason)).ok()
    }
}

/// The text of a scalar; empty for anything else.
pub(super) fn text(node: &Node) -> &str {
    node.scalar().map_or("", |scalar| &scalar.text)
}
