//! Files of popupCAD / foldable_robotics: a pickled `DynamicsInfo` -> [`SourceModel`]. `older` reads
//! what popupCAD wrote before that.
//!
//! Bodies `b0..` and joints `j0..` in file order, layer `i` of material `i`, bodies of
//! `newtonian_ids` fixed, angles in degrees, everything else SI (github.com/idealabasu,
//! `foldable_robotics/dynamics_info.py`). Young's moduli are ignored, because the program writes 1
//! for all of them. `orientation` explains the order of a joint's bodies.

use std::collections::HashMap;

use super::argument::AngleUnit;
use super::codes::{self, Code};
use super::diagnostic::{Diagnostic, Diagnostics, SourceFile, Span, Spanned};
use super::expression::Expression;
use super::fields::items;
use super::ids::BodyId;
use super::lower::STANDARD_GRAVITY;
use super::model::{Body, Joint, MAX_HINGES, Material, Plate, Shape, SourceModel};
use super::names;
use super::rounding::Decimals;
use super::units::{self, Unit};
use super::yaml::{Content, Node, shorten};

mod joints;
mod materials;
mod older;
mod orientation;
mod origin;
mod polygons;

pub(super) use origin::{Origin, beginning, no_model, origin, other_object};

/// Reads a `DynamicsInfo`. Errors are in the diagnostics; without errors there is a model.
pub(super) fn import(root: &Node, file: &SourceFile) -> (Option<SourceModel>, Diagnostics) {
    let mut import = Import::new(units::SI);
    let model = import.model(root, file);
    (model, import.diagnostics)
}

/// Reads an export of popupCAD from before `DynamicsInfo`, as [`import`] does.
pub(super) fn import_older(root: &Node, file: &SourceFile) -> (Option<SourceModel>, Diagnostics) {
    let mut import = Import::new(units::MILLIMETRE);
    let model = import.older(root, file);
    (model, import.diagnostics)
}

struct Import {
    diagnostics: Diagnostics,
    /// The unit of lengths.
    length: Unit,
    /// The decimals of the coordinates read so far.
    decimals: Decimals,
}

/// Bodies by their number in the file.
type Ids = HashMap<String, BodyId>;

/// Returns a model with the gravity of the Earth and defaults for everything that such files do not
/// contain.
pub(super) fn empty(name: String) -> SourceModel {
    SourceModel {
        cuts: Vec::new(),
        max_hinges: MAX_HINGES,
        name: Spanned { value: name, span: Span::default() },
        angle: AngleUnit::default(),
        gravity: [0.0, 0.0, -STANDARD_GRAVITY].map(Expression::Number),
        materials: Vec::new(),
        layup: Vec::new(),
        bodies: Vec::new(),
        joints: Vec::new(),
        parameters: Vec::new(),
        inputs: Vec::new(),
        tunable: Vec::new(),
        initial_q: Vec::new(),
        initial_u: Vec::new(),
        initial_fold: None,
        initial_bodies: Vec::new(),
        points: Vec::new(),
        forces: Vec::new(),
        elements: Default::default(),
        contacts: Vec::new(),
        controllers: Vec::new(),
        hinge_models: Vec::new(),
        air: None,
        tolerance: 0.0,
        drawing: None,
    }
}

/// What a file holds, of which parts may be missing or wrong.
struct Parts<'n> {
    /// Where the file begins.
    at: Span,
    /// The number of layers, if there is a list of them.
    layers: Option<usize>,
    /// The materials and the layup, if they could be read.
    stack: Option<(Vec<Material>, Vec<usize>)>,
    /// Whether there are lists of bodies, of joints and of fixed bodies.
    complete: bool,
    /// Each body, if it could be read.
    bodies: Vec<Option<Body>>,
    /// Each joint, if it could be read.
    joints: Vec<Option<Joint>>,
    fixed: Vec<BodyId>,
    /// How many fixed bodies are listed, also those that are unknown; None without a list.
    listed: Option<usize>,
    /// What the file calls this list.
    list: &'n str,
}

impl Import {
    fn new(length: Unit) -> Self {
        Self { diagnostics: Diagnostics::default(), length, decimals: Decimals::default() }
    }

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
        let joints: Vec<_> = connections
            .iter()
            .enumerate()
            .map(|(i, connection)| self.joint(i, connection, &ids, &fixed))
            .collect();
        let (listed, list) = (newtonian.map(<[Node]>::len), "`newtonian_ids`");
        let parts = Parts { at, layers, stack, complete, bodies, joints, fixed, listed, list };
        self.assembled(parts, file)
    }

    /// Makes a model of the parts, or reports which of them are empty.
    fn assembled(&mut self, parts: Parts<'_>, file: &SourceFile) -> Option<SourceModel> {
        let Parts { at, layers, stack, complete, bodies, joints, fixed, listed, list } = parts;
        if layers == Some(0) {
            let hint = "without layers no body has mass: export the design again";
            self.report(codes::EMPTY_LAYUP, at, "the design has no layers", hint);
        }
        if listed == Some(0) {
            let hint = format!("list the ground in {list}");
            self.report(codes::NO_FIXED_BODY, at, "no body is fixed", &hint);
        }
        if complete && joints.is_empty() {
            let hint = "nothing can move: a mechanism needs a joint";
            self.report(codes::NO_JOINTS, at, "the design has no connections", hint);
        }
        let mut joints: Vec<Joint> = joints.into_iter().collect::<Option<_>>()?;
        orientation::orient(&mut joints, &fixed, bodies.len());
        let (materials, layup) = stack.filter(|_| complete)?;
        let name = names::identifier_from(file.stem());
        let bodies: Vec<Body> = bodies.into_iter().collect::<Option<_>>()?;
        let tolerance = self.decimals.tolerance(&bodies, &joints);
        Some(SourceModel { materials, layup, bodies, joints, tolerance, ..empty(name) })
    }

    fn report(&mut self, code: Code, at: Span, message: &str, hint: &str) {
        self.diagnostics.push(Diagnostic::error(code, at, message).hint(hint));
    }

    /// Warns of unknown keys, which newer programs may write; they are no error.
    fn warn_of_others(&mut self, node: &Node, known: &[&str]) {
        let Content::Mapping(entries) = &node.content else { return };
        for entry in entries.iter().filter(|entry| !known.contains(&entry.key.value.as_str())) {
            let key = &entry.key;
            let message = format!("`{}` is not known to lamc", key.value);
            self.diagnostics
                .push(Diagnostic::warning(codes::UNKNOWN_KEY, key.span, message).label("ignored"));
        }
    }

    /// Returns the value of a required key.
    fn require<'n>(&mut self, node: &'n Node, at: Span, key: &str) -> Option<&'n Node> {
        let value = node.get(key).filter(|value| !value.is_null());
        if value.is_none() {
            let error = Diagnostic::error(codes::MISSING_KEY, at, format!("`{key}` is missing"));
            self.diagnostics.push(error.label(format!("this must contain `{key}`")));
        }
        value
    }

    fn list<'n>(&mut self, node: &'n Node, at: Span, key: &str) -> Option<&'n [Node]> {
        let value = self.require(node, at, key)?;
        items(value, &format!("`{key}` as a list"), &mut self.diagnostics)
    }

    fn number(&mut self, node: &Node, unit: Unit) -> Option<f64> {
        let text = node.scalar().map_or("", |scalar| &scalar.text);
        let value = match units::split_number(text) {
            Some((number, "")) => unit.to_si(number),
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

    /// Reads a coordinate, whose decimals determine the tolerance of the drawing.
    fn coordinate(&mut self, node: &Node) -> Option<f64> {
        let value = self.number(node, self.length)?;
        let text = node.scalar().map_or("", |scalar| &scalar.text);
        self.decimals.note(text, self.length);
        Some(value)
    }

    fn required_number(
        &mut self,
        node: &Node,
        at: Span,
        key: &str,
        unit: Unit,
    ) -> Option<Spanned<f64>> {
        let node = self.require(node, at, key)?;
        Some(Spanned { value: self.number(node, unit)?, span: node.span })
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

    /// Returns the text of a body's number.
    fn id(&mut self, node: &Node) -> Option<String> {
        if let Some(scalar) = node.scalar() {
            return Some(scalar.text.to_string());
        }
        let error = Diagnostic::error(codes::WRONG_TYPE, node.span, "expected a body's id");
        self.diagnostics.push(error.label(format!("this is {}", node.describe())));
        None
    }

    /// Returns the body with this number.
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
        let plates = plates.into_iter().collect::<Option<_>>()?;
        Some(laminate(i, item, plates, fixed))
    }
}

/// Returns body `i` with these plates, a list for each layer.
fn laminate(i: usize, node: &Node, plates: Vec<Vec<Plate>>, fixed: bool) -> Body {
    Body {
        name: Spanned { value: format!("b{i}"), span: head(node) },
        fixed,
        free: false,
        shape: Shape::Plates(plates),
        slits: Vec::new(),
        point_masses: Vec::new(),
        span: node.span,
    }
}

/// Returns the start of a node, for diagnostics that concern the whole node.
fn head(node: &Node) -> Span {
    match &node.content {
        Content::Mapping(entries) => entries.first().map_or(node.span, |entry| entry.key.span),
        _ => Span { start: node.span.start, end: node.span.end.min(node.span.start + 1) },
    }
}
