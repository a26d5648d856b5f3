//! Files of popupCAD / foldable_robotics: a pickled `DynamicsInfo` -> [`SourceModel`].
//!
//! Bodies `b0..` and joints `j0..` in file order, layer `i` of material `i`, bodies of
//! `newtonian_ids` fixed, angles in degrees, everything else SI (github.com/idealabasu,
//! `foldable_robotics/dynamics_info.py`). Young's moduli are left out: the program writes 1 for
//! all. What a joint's file order of bodies means is said in `orientation`.

use std::collections::HashMap;
use std::f64::consts::PI;

use super::codes;
use super::diagnostic::{Diagnostic, Diagnostics, SourceFile, Span, Spanned};
use super::expression::Expression;
use super::fields::{array, items};
use super::given::AngleUnit;
use super::ids::BodyId;
use super::lower::STANDARD_GRAVITY;
use super::model::{Body, Joint, MAX_HINGES, Shape, SourceModel, Spring};
use super::names;
use super::rounding::Decimals;
use super::units;
use super::yaml::{Content, Node, shorten};

mod materials;
mod orientation;
mod polygons;

/// The end of the tag of the file's root.
const ROOT_TAG: &str = ".DynamicsInfo";

/// Which program wrote a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Origin {
    /// A person, in our schema.
    Schema,
    /// foldable_robotics, with `DynamicsInfo`.
    DynamicsInfo,
    /// popupCAD, before `DynamicsInfo`: bare Python objects, without names for what is in them.
    OlderExport,
    /// Another object of a Python program, such as popupCAD's own design.
    OtherObject,
    /// Nothing that is known.
    Unknown,
}

/// The start of the tags of Python's objects.
const PYTHON_TAG: &str = "tag:yaml.org,2002:python/";

/// Tells files apart by the root's tag, and by what they hold where it has none.
pub(super) fn origin(root: &Node) -> Origin {
    let tag = root.tag.as_ref().map_or("", |tag| &tag.value);
    match (tag.strip_prefix(PYTHON_TAG), &root.content) {
        (Some(object), _) if object.starts_with("object:") && object.ends_with(ROOT_TAG) => {
            Origin::DynamicsInfo
        }
        (Some(object), _) if object.starts_with("object") => Origin::OtherObject,
        (Some(_), _) => Origin::OlderExport,
        (None, Content::Mapping(_)) if root.get("bodies").is_some() => Origin::Schema,
        (None, _) if holds_python(root) => Origin::OlderExport,
        (None, Content::Sequence(_)) => Origin::Unknown,
        (None, _) => Origin::Schema,
    }
}

/// Whether there are Python's objects in it.
fn holds_python(node: &Node) -> bool {
    node.tag.as_ref().is_some_and(|tag| tag.value.starts_with(PYTHON_TAG))
        || match &node.content {
            Content::Scalar(_) => false,
            Content::Sequence(items) => items.iter().any(holds_python),
            Content::Mapping(entries) => entries.iter().any(|entry| holds_python(&entry.value)),
        }
}

/// Whether a text that is not valid YAML for an alias without an anchor, at this byte, is an older
/// export: PyYAML wrote `*id003: 600.0`, in which the colon belongs to the name by now.
pub(super) fn is_older_export(text: &str, alias: usize) -> bool {
    let name = text.get(alias..).map_or("", |rest| rest.trim_start_matches('*'));
    let digits = name.strip_prefix("id").unwrap_or_default();
    let number = digits.bytes().take_while(u8::is_ascii_digit).count();
    let is_key = number >= 3 && digits[number..].starts_with(':');
    is_key || (text.contains("!!python/") && !text.contains(ROOT_TAG))
}

const EXPORT_AGAIN: &str = "export the design with foldable_robotics' `DynamicsInfo`, or describe \
                            the mechanism in lamc's own schema (see README.md)";

/// The error for [`Origin::OlderExport`].
pub(super) fn older_export(span: Span) -> Diagnostic {
    Diagnostic::error(
        codes::OLD_EXPORT,
        span,
        "this is an older export of popupCAD, which lamc cannot read yet",
    )
    .label("lamc reads the `DynamicsInfo` of foldable_robotics")
    .hint(EXPORT_AGAIN)
}

/// The error for [`Origin::OtherObject`].
pub(super) fn other_object(span: Span) -> Diagnostic {
    let message = "this is a Python object that lamc cannot read";
    Diagnostic::error(codes::OTHER_OBJECT, span, message)
        .label("lamc reads the `DynamicsInfo` of foldable_robotics")
        .hint(EXPORT_AGAIN)
}

/// The error for [`Origin::Unknown`].
pub(super) fn no_model(span: Span) -> Diagnostic {
    let message = "this is neither a model nor a `DynamicsInfo` of foldable_robotics";
    Diagnostic::error(codes::NO_MODEL, span, message)
        .label("expected a mapping, or the tag of `DynamicsInfo`")
        .hint("a model needs at least `bodies` and `joints`")
}

/// Where a file that is no model begins.
pub(super) fn beginning(root: &Node) -> Span {
    let start = root.span.start;
    root.tag.as_ref().map_or(Span { start, end: start + 1 }, |tag| tag.span)
}

/// Reads a `DynamicsInfo`. Errors are in the diagnostics, without any there is a model.
pub(super) fn import(root: &Node, file: &SourceFile) -> (Option<SourceModel>, Diagnostics) {
    let mut import = Import { diagnostics: Diagnostics::default(), decimals: Decimals::default() };
    let model = import.model(root, file);
    (model, import.diagnostics)
}

struct Import {
    diagnostics: Diagnostics,
    /// Of the coordinates read so far.
    decimals: Decimals,
}

/// Bodies by the number the file gives them.
type Ids = HashMap<String, BodyId>;

impl Import {
    fn model(&mut self, root: &Node, file: &SourceFile) -> Option<SourceModel> {
        let known = ["connected_items", "connections", "material_properties", "newtonian_ids"];
        self.warn_of_others(root, &known);
        let at = root.tag.as_ref().map_or(root.span, |tag| tag.span);
        let [items, connections, properties, newtonian] = known.map(|key| self.list(root, at, key));
        let complete = items.is_some() && connections.is_some() && newtonian.is_some();
        let items = items.unwrap_or_default();
        let connections = connections.unwrap_or_default();

        let stack = properties.and_then(|properties| self.materials(properties));
        let layers = properties.map(<[Node]>::len);
        let ids = self.ids(items);
        let fixed = self.fixed(newtonian.unwrap_or_default(), &ids);
        let bodies: Vec<_> = items
            .iter()
            .enumerate()
            .map(|(i, item)| self.body(i, item, layers, fixed.contains(&BodyId(i))))
            .collect();
        let mut joints = Vec::new();
        for (i, connection) in connections.iter().enumerate() {
            joints.push(self.joint(i, connection, &ids, &fixed));
        }
        if layers == Some(0) {
            let error = Diagnostic::error(
                codes::EMPTY_LAYUP,
                at,
                "the design has no `material_properties`",
            );
            self.diagnostics
                .push(error.hint("without layers nothing has mass: export the design again"));
        }
        if newtonian.is_some_and(<[Node]>::is_empty) {
            let error = Diagnostic::error(codes::NO_FIXED_BODY, at, "no body is fixed");
            self.diagnostics.push(error.hint("list the ground's id in `newtonian_ids`"));
        }
        if complete && connections.is_empty() {
            let error = Diagnostic::error(codes::NO_JOINTS, at, "the design has no `connections`");
            self.diagnostics.push(error.hint("nothing can move: a mechanism needs a joint"));
        }
        let mut joints: Vec<Joint> = joints.into_iter().collect::<Option<_>>()?;
        orientation::orient(&mut joints, &fixed, items.len());

        let (materials, layup) = stack.filter(|_| complete)?;
        let name = names::identifier_from(file.stem());
        let bodies: Vec<Body> = bodies.into_iter().collect::<Option<_>>()?;
        let tolerance = self.decimals.tolerance(&bodies, &joints);
        Some(SourceModel {
            cuts: Vec::new(),
            max_hinges: MAX_HINGES,
            name: Spanned { value: name, span: Span::default() },
            angle: AngleUnit::default(),
            gravity: [0.0, 0.0, -STANDARD_GRAVITY].map(Expression::Number),
            materials,
            layup,
            bodies,
            joints,
            parameters: Vec::new(),
            inputs: Vec::new(),
            tunable: Vec::new(),
            initial_q: Vec::new(),
            initial_u: Vec::new(),
            points: Vec::new(),
            forces: Vec::new(),
            hinge_models: Vec::new(),
            air: None,
            tolerance,
        })
    }

    /// Newer programs may write more than we know of: that is said, not refused.
    fn warn_of_others(&mut self, node: &Node, known: &[&str]) {
        let Content::Mapping(entries) = &node.content else { return };
        for entry in entries.iter().filter(|entry| !known.contains(&entry.key.value.as_str())) {
            let key = &entry.key;
            let message = format!("`{}` is not known to lamc", key.value);
            self.diagnostics
                .push(Diagnostic::warning(codes::UNKNOWN_KEY, key.span, message).label("ignored"));
        }
    }

    /// A key that must be there.
    fn require<'n>(&mut self, node: &'n Node, at: Span, key: &str) -> Option<&'n Node> {
        let value = node.get(key).filter(|value| !value.is_null());
        if value.is_none() {
            let error = Diagnostic::error(codes::MISSING_KEY, at, format!("`{key}` is missing"));
            self.diagnostics.push(error.label(format!("expected `{key}` in this")));
        }
        value
    }

    fn list<'n>(&mut self, node: &'n Node, at: Span, key: &str) -> Option<&'n [Node]> {
        let value = self.require(node, at, key)?;
        items(value, &format!("`{key}` as a list"), &mut self.diagnostics)
    }

    fn number(&mut self, node: &Node) -> Option<f64> {
        let text = node.scalar().map_or("", |scalar| &scalar.text);
        let value = match units::split_number(text) {
            Some((number, "")) => units::SI.to_si(number),
            _ => f64::NAN,
        };
        if !value.is_finite() {
            let error =
                Diagnostic::error(codes::NOT_A_NUMBER, node.span, "expected a finite number");
            self.diagnostics.push(error.label(format!("this is {}", node.describe())));
            return None;
        }
        Some(value)
    }

    /// A coordinate, whose decimals count for the drawing's tolerance.
    fn coordinate(&mut self, node: &Node) -> Option<f64> {
        let value = self.number(node)?;
        let text = node.scalar().map_or("", |scalar| &scalar.text);
        self.decimals.note(text, units::SI);
        Some(value)
    }

    fn required_number(&mut self, node: &Node, at: Span, key: &str) -> Option<Spanned<f64>> {
        let node = self.require(node, at, key)?;
        Some(Spanned { value: self.number(node)?, span: node.span })
    }

    fn ids(&mut self, items: &[Node]) -> Ids {
        let mut ids = Ids::new();
        let mut places: HashMap<BodyId, Span> = HashMap::new();
        for (i, item) in items.iter().enumerate() {
            let Some(id) = self.require(item, head(item), "id") else { continue };
            let Some(text) = self.id(id) else { continue };
            if let Some(first) = ids.get(&text).and_then(|body| places.get(body)) {
                let message = format!("two bodies have the id {text}");
                let error = Diagnostic::error(codes::DUPLICATE_NAME, id.span, message);
                self.diagnostics.push(error.label("second").also(*first, "first"));
                continue;
            }
            places.insert(BodyId(i), id.span);
            ids.insert(text, BodyId(i));
        }
        ids
    }

    /// The text of a body's number.
    fn id(&mut self, node: &Node) -> Option<String> {
        if let Some(scalar) = node.scalar() {
            return Some(scalar.text.to_string());
        }
        let error = Diagnostic::error(codes::WRONG_TYPE, node.span, "expected a body's id");
        self.diagnostics.push(error.label(format!("this is {}", node.describe())));
        None
    }

    /// The body with this number.
    fn body_of(&mut self, node: &Node, ids: &Ids) -> Option<Spanned<BodyId>> {
        let id = self.id(node)?;
        let body = ids.get(&id).map(|&value| Spanned { value, span: node.span });
        if body.is_none() {
            let message = format!("no body has the id {}", shorten(&id));
            self.diagnostics.push(
                Diagnostic::error(codes::UNKNOWN_BODY, node.span, message)
                    .label("not among `connected_items`"),
            );
        }
        body
    }

    fn fixed(&mut self, nodes: &[Node], ids: &Ids) -> Vec<BodyId> {
        nodes.iter().filter_map(|node| self.body_of(node, ids)).map(|body| body.value).collect()
    }

    fn body(&mut self, i: usize, item: &Node, layers: Option<usize>, fixed: bool) -> Option<Body> {
        let nodes = self.list(item, head(item), "layers")?;
        if layers.is_some_and(|layers| layers != nodes.len()) {
            let message = format!(
                "this body has {} layers, but there are {} `material_properties`",
                nodes.len(),
                layers.unwrap_or_default()
            );
            let error = Diagnostic::error(codes::WRONG_LENGTH, head(item), message);
            self.diagnostics.push(error.hint("layer i is of material i: export the design again"));
        }
        let plates: Vec<_> = nodes.iter().map(|layer| self.layer(layer)).collect();
        Some(Body {
            name: Spanned { value: format!("b{i}"), span: head(item) },
            fixed,
            shape: Shape::Plates(plates.into_iter().collect::<Option<_>>()?),
            point_masses: Vec::new(),
            span: item.span,
        })
    }

    /// A connection: hinge line, two bodies, properties.
    fn joint(&mut self, i: usize, node: &Node, ids: &Ids, fixed: &[BodyId]) -> Option<Joint> {
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
                Diagnostic::error(codes::EMPTY_LIMITS, low.span, "no angle is within these limits");
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
            self.diagnostics.push(error.label("twice the same point"));
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

/// The start of a node, for what concerns all of it.
fn head(node: &Node) -> Span {
    match &node.content {
        Content::Mapping(entries) => entries.first().map_or(node.span, |entry| entry.key.span),
        _ => Span { start: node.span.start, end: node.span.end.min(node.span.start + 1) },
    }
}

fn radians(degrees: f64) -> f64 {
    degrees * (PI / 180.0)
}
