//! Springs, tendons and motors.

use crate::arithmetic::hypot;
use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Spanned};
use crate::source::elements::{Elements, Motor, Tendon, Tension, Twist};
use crate::source::expression::Expression;
use crate::source::fields::{Fields, array, items};
use crate::source::ids::{JointId, PointId};
use crate::source::model::Point;
use crate::source::schema::{BAND, FIXED_VERTEX, MOTOR, TENDON, TWIST};
use crate::source::yaml::{Entry, Node, shorten};

use super::Lowering;
use super::references::Declared;

impl Lowering<'_> {
    /// Reads all force elements. `points` are those of the model, if all could be read.
    pub(super) fn elements(
        &mut self,
        declared: &Declared,
        points: Option<&[Point]>,
        fixed: &[bool],
    ) -> Option<Elements> {
        // The keys tell which kind of spring an entry is.
        let is_twist =
            |entry: &&Entry| ["bodies", "axis"].iter().any(|key| entry.value.get(key).is_some());
        let (mut bands, mut twists) = (Vec::new(), Vec::new());
        for entry in declared.springs {
            match is_twist(&entry) {
                true => twists.push(self.twist(entry, fixed)),
                false => bands.push(self.band(entry)),
            }
        }
        let tendons: Vec<_> = declared.tendons.iter().map(|entry| self.tendon(entry)).collect();
        let motors = self.each(declared.motors, Self::motor);
        let lines = bands.iter().chain(&tendons).flatten();
        lines.for_each(|line| self.refuse_idle(line, points.unwrap_or_default(), fixed));
        Some(Elements {
            bands: bands.into_iter().collect::<Option<_>>()?,
            twists: twists.into_iter().collect::<Option<_>>()?,
            tendons: tendons.into_iter().collect::<Option<_>>()?,
            motors: motors?,
        })
    }

    fn band(&mut self, entry: &Entry) -> Option<Tendon> {
        let owner = format!("spring `{}`", shorten(&entry.key.value));
        let found = &mut self.diagnostics;
        let fields = Fields::new(&entry.value, entry.key.span, owner, &BAND, found)?;
        let ends = ["from", "to"].map(|key| {
            let node = fields.read(key, &mut self.diagnostics);
            node.and_then(|node| self.point_at(node))
        });
        let tension_only = self.truth(&fields, "tension_only");
        let tension = self.elastic(&fields, tension_only);
        let [from, to] = ends;
        Some(Tendon { name: entry.key.clone(), through: vec![from?, to?], tension: tension? })
    }

    fn tendon(&mut self, entry: &Entry) -> Option<Tendon> {
        let owner = format!("tendon `{}`", shorten(&entry.key.value));
        let found = &mut self.diagnostics;
        let fields = Fields::new(&entry.value, entry.key.span, owner, &TENDON, found)?;
        let through = fields.read("through", &mut self.diagnostics);
        let form = fields.expected("through").form();
        let through = through.and_then(|node| self.points_of(node, form));
        let elastic = ["stiffness", "damping", "rest_length"];
        let elastic = elastic.into_iter().find_map(|key| fields.entry(key));
        let tension = match (fields.entry("tension"), elastic) {
            (Some(given), Some(other)) => {
                let message = format!("both `tension` and `{}`", other.key.value);
                let error = Diagnostic::error(codes::TWO_TENSIONS, other.key.span, message);
                self.note(
                    error
                        .label("a property of an elastic tendon")
                        .also(given.key.span, "the tension is given here")
                        .hint("keep one of them"),
                );
                None
            }
            (Some(given), None) => {
                self.expression(&given.value, fields.expected("tension")).map(Tension::Given)
            }
            (None, _) => self.elastic(&fields, Some(true)),
        };
        Some(Tendon { name: entry.key.clone(), through: through?, tension: tension? })
    }

    /// Reads the keys of an elastic line.
    fn elastic(&mut self, fields: &Fields, tension_only: Option<bool>) -> Option<Tension> {
        let stiffness = self.required_law(fields, "stiffness");
        let damping = self.law(fields, "damping");
        let rest_length = self.optional_law(fields, "rest_length");
        Some(Tension::Elastic {
            stiffness: stiffness?,
            damping: damping?,
            rest_length: rest_length?,
            tension_only: tension_only?,
        })
    }

    /// Reads the formula of an optional key: `Some(None)` if the key is missing.
    #[allow(
        clippy::option_option,
        reason = "a missing value and a wrong value are different cases"
    )]
    fn optional_law(&mut self, fields: &Fields, key: &str) -> Option<Option<Spanned<Expression>>> {
        match fields.get(key) {
            None => Some(None),
            Some(node) => self.expression(node, fields.expected(key)).map(Some),
        }
    }

    fn point_at(&mut self, node: &Node) -> Option<Spanned<PointId>> {
        self.point_named(node).map(|value| Spanned { value, span: node.span })
    }

    /// Reads the points of a tendon.
    fn points_of(&mut self, node: &Node, form: &str) -> Option<Vec<Spanned<PointId>>> {
        let nodes = items(node, form, &mut self.diagnostics)?;
        if nodes.len() < 2 {
            let error = Diagnostic::error(
                codes::FEW_POINTS,
                node.span,
                "a tendon needs two points or more",
            );
            let label = if nodes.is_empty() { "no points" } else { "one point" };
            self.note(error.label(label).hint("name its points from one end to the other"));
            return None;
        }
        let points: Vec<_> = nodes.iter().map(|node| self.point_at(node)).collect();
        points.into_iter().collect()
    }

    /// Reports a line that goes from a point to the same point, or whose length cannot change.
    fn refuse_idle(&mut self, line: &Tendon, points: &[Point], fixed: &[bool]) {
        let name = shorten(&line.name.value);
        if let Some(pair) = line.through.windows(2).find(|pair| pair[0].value == pair[1].value) {
            let message = format!("`{name}` runs from a point to the same point");
            let error = Diagnostic::error(codes::SAME_POINT, pair[1].span, message);
            self.note(
                error
                    .label("the same point")
                    .also(pair[0].span, "from here")
                    .hint("name another point"),
            );
            return;
        }
        // All fixed bodies are one. A point that could not be read has been reported.
        let body = |point: &Spanned<PointId>| {
            let body = points.get(point.value.index())?.body;
            let is_fixed = fixed.get(body.index()).copied().unwrap_or_default();
            Some((!is_fixed).then_some(body))
        };
        let bodies: Option<Vec<_>> = line.through.iter().map(body).collect();
        let is_idle = |bodies: &Vec<_>| bodies.windows(2).all(|pair| pair[0] == pair[1]);
        if let Some(bodies) = bodies.filter(is_idle) {
            let on = if bodies.contains(&None) { "on the ground" } else { "on the same body" };
            let message = format!("all points of `{name}` are {on}");
            let error = Diagnostic::error(codes::ONE_BODY, line.name.span, message);
            self.note(
                error
                    .label("its length never changes")
                    .hint("name points on at least two bodies, of which one is not fixed"),
            );
        }
    }

    fn twist(&mut self, entry: &Entry, fixed: &[bool]) -> Option<Twist> {
        let owner = format!("spring `{}`", shorten(&entry.key.value));
        let found = &mut self.diagnostics;
        let fields = Fields::new(&entry.value, entry.key.span, owner, &TWIST, found)?;
        let bodies = self.two_bodies(&fields, fixed, "spring");
        let axis = self.twist_axis(&fields);
        let stiffness = self.required_law(&fields, "stiffness");
        let damping = self.law(&fields, "damping");
        let rest = self.law(&fields, "rest");
        Some(Twist {
            name: entry.key.clone(),
            bodies: bodies?,
            axis: axis?,
            stiffness: stiffness?,
            damping: damping?,
            rest: rest?,
        })
    }

    fn twist_axis(&mut self, fields: &Fields) -> Option<Spanned<[[f64; 2]; 2]>> {
        let node = fields.read("axis", &mut self.diagnostics)?;
        let form = fields.expected("axis").form();
        let nodes: &[Node; 2] = array(node, form, &mut self.diagnostics)?;
        let [from, to] = nodes.each_ref().map(|node| self.numbers::<2>(node, &FIXED_VERTEX));
        let (from, to) = (from?, to?);
        if hypot(to[0] - from[0], to[1] - from[1]) < f64::MIN_POSITIVE {
            let error = Diagnostic::error(codes::ZERO_AXIS, node.span, "the axis has no length");
            self.note(error.label("the same point twice").hint(
                "give two different points; the angle is about the direction from the first to the second",
            ));
            return None;
        }
        Some(Spanned { value: [from, to], span: node.span })
    }

    fn motor(&mut self, entry: &Entry) -> Option<Motor> {
        let owner = format!("motor `{}`", shorten(&entry.key.value));
        let found = &mut self.diagnostics;
        let fields = Fields::new(&entry.value, entry.key.span, owner, &MOTOR, found)?;
        let joint = fields.read("joint", &mut self.diagnostics);
        let joint = joint.and_then(|node| {
            let name = self.text(node, "the name of a joint")?;
            let id = self.look_up(&name, "joint", "joints", |names| &names.joints)?;
            Some(Spanned { value: JointId(id), span: node.span })
        });
        let torque_constant = self.required_law(&fields, "torque_constant");
        let resistance = self.required_law(&fields, "resistance");
        let gear = self.required(&fields, "gear");
        let inertia = self.optional(&fields, "inertia");
        let voltage = self.required_law(&fields, "voltage");
        let max_voltage = self.optional_law(&fields, "max_voltage");
        let max_current = self.optional_law(&fields, "max_current");
        Some(Motor {
            name: entry.key.clone(),
            joint: joint?,
            torque_constant: torque_constant?,
            resistance: resistance?,
            gear: gear?,
            inertia: inertia?.unwrap_or(Spanned { value: 0.0, span: entry.span() }),
            voltage: voltage?,
            max_voltage: max_voltage?,
            max_current: max_current?,
        })
    }
}
