//! Node tree of our schema -> [`SourceModel`]: names resolved, quantities in SI and radians.
//!
//! What is wrong is noted and reading goes on, so that one run reports everything. `None` from a
//! function here always means that the reason has been noted.

use super::diagnostic::{Diagnostic, Diagnostics, SourceFile, Span, Spanned};
use super::fields::{Fields, entries, items};
use super::given::AngleUnit;
use super::ids::{BodyId, JointId, PointId};
use super::model::{Air, MAX_HINGES, Material, Parameter, SourceModel, Tunable};
use super::names::{self, Kind, alternatives};
use super::rounding::Decimals;
use super::units::{self, Unit};
use super::yaml::{Entry, Node, shorten};

mod bodies;
mod joints;
mod outputs;
mod scalars;

use scalars::Uses;

const KEYS: &[&str] = &[
    "name",
    "units",
    "gravity",
    "materials",
    "layup",
    "bodies",
    "parameters",
    "inputs",
    "tunable",
    "joints",
    "initial",
    "points",
    "forces",
    "air",
    "hinge_models",
    "tolerance",
];

/// Most layers of a layup: an outline is copied to each of them.
const MAX_LAYERS: usize = 64;

/// Earth's, along -z, m/s^2.
pub(super) const STANDARD_GRAVITY: f64 = 9.81;

/// Every name of the file, known before anything that may refer to it is read.
#[derive(Default)]
struct Names {
    materials: Vec<String>,
    bodies: Vec<String>,
    joints: Vec<String>,
    parameters: Vec<String>,
    inputs: Vec<String>,
    points: Vec<String>,
    hinge_models: Vec<String>,
}

struct Lowering<'s> {
    /// The text of the file.
    source: &'s str,
    diagnostics: Diagnostics,
    /// What bare lengths and angles are in.
    length: Unit,
    angle: Unit,
    names: Names,
    /// In file order; those that could not be read are missing.
    parameters: Vec<Option<Parameter>>,
    /// Of the coordinates read so far.
    decimals: Decimals,
}

/// Reads a model in our schema. Errors are in the diagnostics, without any there is a model.
pub(super) fn lower(root: &Node, file: &SourceFile) -> (Option<SourceModel>, Diagnostics) {
    let mut lowering = Lowering {
        source: &file.text,
        diagnostics: Diagnostics::default(),
        length: units::SI,
        angle: units::SI,
        names: Names::default(),
        parameters: Vec::new(),
        decimals: Decimals::default(),
    };
    let model = lowering.model(root, file);
    (model, lowering.diagnostics)
}

impl Lowering<'_> {
    fn model(&mut self, root: &Node, file: &SourceFile) -> Option<SourceModel> {
        let start = Span { start: root.span.start, end: root.span.start };
        let fields = Fields::new(root, start, "a model", KEYS, &mut self.diagnostics)?;
        self.units(fields.get("units"));

        let materials = entries(fields.get("materials"), "materials", &mut self.diagnostics);
        let parameters = entries(fields.get("parameters"), "parameters", &mut self.diagnostics);
        let bodies = entries(
            fields.require("bodies", &mut self.diagnostics),
            "bodies",
            &mut self.diagnostics,
        );
        let joints = entries(
            fields.require("joints", &mut self.diagnostics),
            "joints",
            &mut self.diagnostics,
        );
        let points = entries(fields.get("points"), "points", &mut self.diagnostics);
        let forces = entries(fields.get("forces"), "forces", &mut self.diagnostics);
        let models = entries(fields.get("hinge_models"), "hinge models", &mut self.diagnostics);
        let inputs = self.inputs(fields.get("inputs"));
        self.names = Names {
            materials: self.declare(materials, Kind::Other("a material")),
            bodies: self.declare(bodies, Kind::Other("a body")),
            joints: self.declare(joints, Kind::Other("a joint")),
            parameters: self.declare(parameters, Kind::Symbol("a parameter")),
            inputs: inputs.iter().map(|input| input.value.clone()).collect(),
            points: self.declare(points, Kind::Other("a point")),
            hinge_models: self.declare(models, Kind::Other("a hinge model")),
        };
        self.declare(forces, Kind::Other("a force"));

        self.parameters = parameters.iter().map(|entry| self.parameter(entry)).collect();
        let name = self.name(fields.get("name"), file);
        let gravity = self.gravity(fields.get("gravity"));
        let materials = self.each(materials, Self::material);
        let layup = self.layup(fields.get("layup"));
        let layers = fields.get("layup").map(|_| layup.as_ref().map_or(0, Vec::len));
        let lowered_bodies = self.each(bodies, |this, entry| this.body(entry, layers));
        let fixed = bodies::fixed(bodies);
        if !bodies.is_empty() && bodies::none_fixed(bodies) {
            self.no_fixed_body(&fields, bodies);
        }
        if let Some(entry) = fields.entry("joints").filter(|_| joints.is_empty()) {
            let error = Diagnostic::error("no-joints", entry.span(), "there are no joints");
            self.diagnostics.push(error.hint("nothing can move: a mechanism needs a joint"));
        }
        let hinge_models = self.each(models, Self::hinge_model);
        let joints_read = self.each(joints, |this, entry| this.joint(entry, &fixed, &materials));
        let tunable = self.tunable(fields.get("tunable"), parameters, &inputs, &fixed);
        let [initial_q, initial_u] = self.initial(fields.get("initial"));
        let points = self.each(points, Self::point);
        let forces = self.each(forces, Self::force);
        let air = self.air(fields.get("air"));
        let tolerance = self.optional(fields.get("tolerance"), &units::LENGTH);
        let (bodies, joints) = (lowered_bodies?, joints_read?);
        let tolerance = self.tolerance(tolerance?, &bodies, &joints);
        Some(SourceModel {
            cuts: Vec::new(),
            max_hinges: MAX_HINGES,
            name: name?,
            angle: AngleUnit(self.angle),
            gravity: gravity?,
            materials: materials?,
            layup: layup?,
            bodies,
            joints,
            parameters: std::mem::take(&mut self.parameters).into_iter().collect::<Option<_>>()?,
            inputs,
            tunable,
            initial_q,
            initial_u,
            points: points?,
            forces: forces?,
            hinge_models: hinge_models?,
            air: air?,
            tolerance: tolerance?,
        })
    }

    fn note(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    /// Reads every entry, also after one that fails; `None` when one did.
    fn each<T>(
        &mut self,
        entries: &[Entry],
        mut read: impl FnMut(&mut Self, &Entry) -> Option<T>,
    ) -> Option<Vec<T>> {
        let read: Vec<Option<T>> = entries.iter().map(|entry| read(self, entry)).collect();
        read.into_iter().collect()
    }

    /// Checks the names of entries.
    fn declare(&mut self, entries: &[Entry], kind: Kind) -> Vec<String> {
        for entry in entries {
            names::check(&entry.key, kind, &mut self.diagnostics);
        }
        entries.iter().map(|entry| entry.key.value.clone()).collect()
    }

    fn units(&mut self, node: Option<&Node>) {
        let Some(node) = node else { return };
        let known = ["length", "angle"];
        let Some(fields) = Fields::new(node, node.span, "`units`", &known, &mut self.diagnostics)
        else {
            return;
        };
        for (key, quantity) in [("length", &units::LENGTH), ("angle", &units::ANGLE)] {
            let Some(node) = fields.get(key) else { continue };
            let unit = node.scalar().and_then(|scalar| units::find(&scalar.text));
            match unit.filter(|unit| unit.dimension == quantity.dimension) {
                Some(unit) if key == "length" => self.length = unit,
                Some(unit) => self.angle = unit,
                None => {
                    let message = format!("{} is no unit of {key}", node.describe());
                    let error = Diagnostic::error("bad-unit", node.span, message);
                    self.note(error.hint(format!("use {}", quantity.examples)));
                }
            }
        }
    }

    fn name(&mut self, node: Option<&Node>, file: &SourceFile) -> Option<Spanned<String>> {
        let Some(node) = node else {
            let value = names::identifier_from(file.stem());
            return Some(Spanned { value, span: Span::default() });
        };
        let name = self.text(node, "the model's name")?;
        names::check(&name, Kind::Model, &mut self.diagnostics);
        Some(name)
    }

    fn material(&mut self, entry: &Entry) -> Option<Material> {
        let known = ["density", "thickness", "youngs_modulus", "yield_stress"];
        let owner = format!("material `{}`", entry.key.value);
        let fields =
            Fields::new(&entry.value, entry.key.span, owner, &known, &mut self.diagnostics)?;
        let density = fields.require("density", &mut self.diagnostics);
        let density = density.and_then(|node| self.number(node, &units::DENSITY));
        let thickness = fields.require("thickness", &mut self.diagnostics);
        let thickness = thickness.and_then(|node| self.number(node, &units::LENGTH));
        let youngs_modulus = self.optional(fields.get("youngs_modulus"), &units::PRESSURE);
        let yield_stress = self.optional(fields.get("yield_stress"), &units::PRESSURE);
        Some(Material {
            name: entry.key.clone(),
            density: density?,
            thickness: thickness?,
            youngs_modulus: youngs_modulus?,
            yield_stress: yield_stress?,
        })
    }

    fn layup(&mut self, node: Option<&Node>) -> Option<Vec<usize>> {
        let Some(node) = node else { return Some(Vec::new()) };
        let items = items(node, "a list of materials, bottom to top", &mut self.diagnostics)?;
        if items.is_empty() {
            let error = Diagnostic::error("empty-layup", node.span, "the layup has no layers");
            self.note(error.hint("list materials from bottom to top, or remove the key"));
            return None;
        }
        if items.len() > MAX_LAYERS {
            let message = format!("{} layers, more than the {MAX_LAYERS} lamc reads", items.len());
            self.note(Diagnostic::error("too-large", node.span, message));
            return None;
        }
        let found: Vec<_> = items.iter().map(|item| self.material_named(item)).collect();
        found.into_iter().collect()
    }

    fn material_named(&mut self, node: &Node) -> Option<usize> {
        self.refer(node, "material", "materials", |names| &names.materials)
    }

    fn body_named(&mut self, node: &Node) -> Option<BodyId> {
        self.refer(node, "body", "bodies", |names| &names.bodies).map(BodyId)
    }

    fn point_named(&mut self, node: &Node) -> Option<PointId> {
        self.refer(node, "point", "points", |names| &names.points).map(PointId)
    }

    /// The position of the entry a node names.
    fn refer(
        &mut self,
        node: &Node,
        kind: &str,
        plural: &str,
        list: impl Fn(&Names) -> &Vec<String>,
    ) -> Option<usize> {
        let name = self.text(node, &format!("the name of a {kind}"))?;
        self.look_up(&name, kind, plural, list)
    }

    fn look_up(
        &mut self,
        name: &Spanned<String>,
        kind: &str,
        plural: &str,
        list: impl Fn(&Names) -> &Vec<String>,
    ) -> Option<usize> {
        let names: Vec<&str> = list(&self.names).iter().map(String::as_str).collect();
        let position = names.iter().position(|known| *known == name.value);
        if position.is_none() {
            let hint = alternatives(&name.value, &names, plural);
            let message = format!("there is no {kind} `{}`", shorten(&name.value));
            let code = match kind {
                "material" => "unknown-material",
                "body" => "unknown-body",
                "joint" => "unknown-joint",
                _ => "unknown-point",
            };
            self.note(Diagnostic::error(code, name.span, message).hint(hint));
        }
        position
    }

    fn parameter(&mut self, entry: &Entry) -> Option<Parameter> {
        let (value, dimension) = self.parameter_value(&entry.value)?;
        Some(Parameter { name: entry.key.clone(), value, dimension })
    }

    fn inputs(&mut self, node: Option<&Node>) -> Vec<Spanned<String>> {
        let Some(node) = node else { return Vec::new() };
        let nodes = items(node, "a list of input names", &mut self.diagnostics).unwrap_or_default();
        let mut inputs: Vec<Spanned<String>> = Vec::new();
        for node in nodes {
            let Some(name) = self.text(node, "the name of an input") else { continue };
            names::check(&name, Kind::Symbol("an input"), &mut self.diagnostics);
            if self.once(&inputs, &name) {
                inputs.push(name);
            }
        }
        inputs
    }

    /// Reports a name that is in the list already, and returns false.
    fn once(&mut self, earlier: &[Spanned<String>], name: &Spanned<String>) -> bool {
        if let Some(first) = earlier.iter().find(|other| other.value == name.value) {
            let message = format!("`{}` is listed twice", name.value);
            let error = Diagnostic::error("duplicate-name", name.span, message);
            self.note(error.label("second time").also(first.span, "first time"));
            return false;
        }
        true
    }

    /// Reads `tunable`, and keeps apart the names of parameters, inputs and what it makes.
    fn tunable(
        &mut self,
        node: Option<&Node>,
        parameters: &[Entry],
        inputs: &[Spanned<String>],
        fixed: &[bool],
    ) -> Vec<Spanned<Tunable>> {
        let parameters: Vec<_> = parameters.iter().map(|entry| entry.key.clone()).collect();
        for input in inputs {
            if let Some(first) = parameters.iter().find(|name| name.value == input.value) {
                let message = format!("`{}` is both a parameter and an input", input.value);
                let error = Diagnostic::error("duplicate-name", input.span, message);
                self.note(error.label("the input").also(first.span, "the parameter"));
            }
        }
        let expected = "a list of `stiffness`, `damping`, `rest` and `mass`";
        let nodes = node.and_then(|node| items(node, expected, &mut self.diagnostics));
        let mut tunable: Vec<Spanned<Tunable>> = Vec::new();
        let mut seen: Vec<Spanned<String>> = Vec::new();
        for node in nodes.unwrap_or_default() {
            let Some(name) = self.text(node, "what to make tunable") else { continue };
            let known: Vec<_> = Tunable::ALL.iter().map(|kind| kind.name()).collect();
            let Some(kind) = Tunable::ALL.into_iter().find(|kind| kind.name() == name.value) else {
                let message = format!("`{}` cannot be tunable", shorten(&name.value));
                let hint = alternatives(&name.value, &known, "constants that can");
                self.note(Diagnostic::error("unknown-tunable", name.span, message).hint(hint));
                continue;
            };
            if self.once(&seen, &name) {
                seen.push(name);
                tunable.push(Spanned { value: kind, span: node.span });
            }
        }
        for kind in &tunable {
            let owners: Vec<String> = match kind.value {
                Tunable::Mass => {
                    let moving = self.names.bodies.iter().zip(fixed).filter(|(_, fixed)| !**fixed);
                    moving.map(|(name, _)| name.clone()).collect()
                }
                _ => self.names.joints.clone(),
            };
            for made in owners.iter().map(|owner| kind.value.parameter_name(owner)) {
                if let Some(clash) = parameters.iter().chain(inputs).find(|name| name.value == made)
                {
                    let message = format!("`{made}` is the name of a parameter made by `tunable`");
                    let error = Diagnostic::error("duplicate-name", clash.span, message);
                    self.note(error.label("given here").also(kind.span, "made here"));
                }
            }
        }
        tunable
    }

    fn gravity(&mut self, node: Option<&Node>) -> Option<[super::Expression; 3]> {
        use super::Expression::Number;
        let Some(node) = node else {
            return Some([Number(0.0), Number(0.0), Number(-STANDARD_GRAVITY)]);
        };
        let uses =
            Uses::Constants("gravity is the same for every pose: it may not depend on q or u");
        self.vector(node, &units::ACCELERATION, uses)
    }

    #[allow(clippy::option_option, reason = "absent and wrong are different things")]
    fn air(&mut self, node: Option<&Node>) -> Option<Option<Air>> {
        let Some(node) = node else { return Some(None) };
        let known = ["density", "drag"];
        let fields = Fields::new(node, node.span, "`air`", &known, &mut self.diagnostics)?;
        let mut read = |key: &str, quantity| {
            let node = fields.require(key, &mut self.diagnostics)?;
            let uses = Uses::Constants("the drag has the speed of the plate in it already");
            self.expression(node, quantity, uses)
        };
        let (density, drag) = (read("density", &units::DENSITY), read("drag", &units::NUMBER));
        Some(Some(Air { density: density?, drag: drag? }))
    }

    /// The joints' coordinates or speeds given under `initial`.
    fn initial(&mut self, node: Option<&Node>) -> [Vec<(JointId, f64)>; 2] {
        let none = [Vec::new(), Vec::new()];
        let Some(node) = node else { return none };
        let known = ["q", "u"];
        let Some(fields) = Fields::new(node, node.span, "`initial`", &known, &mut self.diagnostics)
        else {
            return none;
        };
        let mut read = |key: &str, quantity| {
            let entries = entries(fields.get(key), "joints", &mut self.diagnostics);
            let mut values = Vec::new();
            for entry in entries {
                let joint =
                    self.look_up(&entry.key, "joint", "joints", |names| &names.joints).map(JointId);
                let value = self.number(&entry.value, quantity);
                values.extend(joint.zip(value.map(|value| value.value)));
            }
            values
        };
        [read("q", &units::ANGLE), read("u", &units::ANGULAR_SPEED)]
    }
}
