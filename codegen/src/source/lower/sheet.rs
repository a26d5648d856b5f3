//! Properties of the whole sheet: units, materials, layup, gravity, air, the initial state and the
//! tolerance of the drawing.

use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, SourceFile, Span, Spanned};
use crate::source::expression::Expression;
use crate::source::fields::{Fields, entries, items};
use crate::source::formula::number;
use crate::source::free;
use crate::source::ids::{BodyId, JointId};
use crate::source::model::{Air, Body, InitialBody, Joint, Material};
use crate::source::names::{self, Kind};
use crate::source::schema::{self, MAX_LAYERS, Value};
use crate::source::yaml::{Entry, Node, shorten};
use crate::source::{rounding, units};

use super::{Lowering, STANDARD_GRAVITY};

/// Largest tolerance, relative to the size of the drawing: a larger one would change the drawing.
const LARGEST_TOLERANCE: f64 = 1e-2;

/// The entries of `initial`.
#[derive(Default)]
pub(super) struct Initial {
    /// Angles, rad.
    pub q: Vec<(JointId, f64)>,
    /// Speeds, rad/s.
    pub u: Vec<(JointId, f64)>,
    /// Share of the joints' folds.
    pub fold: Option<Spanned<f64>>,
    /// States of free bodies.
    pub bodies: Vec<(BodyId, InitialBody)>,
}

impl Lowering<'_> {
    /// Reads the units of numbers without a unit.
    pub(super) fn units(&mut self, model: &Fields) {
        let Some(node) = model.get("units") else { return };
        let found = &mut self.diagnostics;
        let Some(fields) = Fields::new(node, node.span, "`units`", &schema::UNITS, found) else {
            return;
        };
        for key in schema::UNITS.keys {
            let Value::Unit(quantity) = key.value else { continue };
            let key = key.name;
            let Some(node) = fields.get(key) else { continue };
            let unit = node.scalar().and_then(|scalar| units::find(&scalar.text));
            match unit.filter(|unit| unit.dimension == quantity.dimension) {
                Some(unit) if key == "length" => self.length = unit,
                Some(unit) => self.angle = unit,
                None => {
                    let message = format!("{} is not a unit of {key}", node.describe());
                    let error = Diagnostic::error(codes::BAD_UNIT, node.span, message);
                    self.note(error.hint(format!("use {}", quantity.examples)));
                }
            }
        }
    }

    pub(super) fn name(
        &mut self,
        node: Option<&Node>,
        file: &SourceFile,
    ) -> Option<Spanned<String>> {
        let Some(node) = node else {
            let value = names::identifier_from(file.stem());
            return Some(Spanned { value, span: Span::default() });
        };
        let name = self.text(node, "the model's name")?;
        names::check(&name, Kind::Other("a model"), &mut self.diagnostics);
        Some(name)
    }

    pub(super) fn material(&mut self, entry: &Entry) -> Option<Material> {
        let owner = format!("material `{}`", shorten(&entry.key.value));
        let (at, found) = (entry.key.span, &mut self.diagnostics);
        let fields = Fields::new(&entry.value, at, owner, &schema::MATERIAL, found)?;
        let density = self.required_drawn(&fields, "density");
        let thickness = self.required_drawn(&fields, "thickness");
        let youngs_modulus = self.optional_drawn(&fields, "youngs_modulus");
        let yield_stress = self.optional(&fields, "yield_stress");
        Some(Material {
            name: entry.key.clone(),
            density: density?,
            thickness: thickness?,
            youngs_modulus: youngs_modulus?,
            yield_stress: yield_stress?,
        })
    }

    pub(super) fn layup(&mut self, model: &Fields) -> Option<Vec<usize>> {
        let Some(node) = model.get("layup") else { return Some(Vec::new()) };
        let items = items(node, model.expected("layup").form(), &mut self.diagnostics)?;
        if items.is_empty() {
            let error = Diagnostic::error(codes::EMPTY_LAYUP, node.span, "the layup has no layers");
            self.note(error.hint("list materials from bottom to top, or remove the key"));
            return None;
        }
        if items.len() > MAX_LAYERS {
            let message = format!("{} layers, but lamc reads at most {MAX_LAYERS}", items.len());
            self.note(Diagnostic::error(codes::TOO_MANY_LAYERS, node.span, message));
            return None;
        }
        let found: Vec<_> = items.iter().map(|item| self.material_named(item)).collect();
        found.into_iter().collect()
    }

    pub(super) fn gravity(&mut self, model: &Fields) -> Option<[Expression; 3]> {
        use Expression::Number;
        let Some(node) = model.get("gravity") else {
            return Some([Number(0.0), Number(0.0), Number(-STANDARD_GRAVITY)]);
        };
        self.vector(node, model.expected("gravity"))
    }

    #[allow(
        clippy::option_option,
        reason = "a missing value and a wrong value are different \
                                             cases"
    )]
    pub(super) fn air(&mut self, model: &Fields) -> Option<Option<Air>> {
        let Some(node) = model.get("air") else { return Some(None) };
        let fields = Fields::new(node, node.span, "`air`", &schema::AIR, &mut self.diagnostics)?;
        let density = self.required_law(&fields, "density");
        let drag = self.required_law(&fields, "drag");
        Some(Some(Air { density: density?, drag: drag? }))
    }

    /// Reads the coordinates and speeds of joints and of free bodies under `initial`. `free` says which bodies
    /// are free.
    pub(super) fn initial(&mut self, model: &Fields, free: &[bool]) -> Initial {
        let none = Initial::default();
        let Some(node) = model.get("initial") else { return none };
        let found = &mut self.diagnostics;
        let Some(fields) = Fields::new(node, node.span, "`initial`", &schema::INITIAL, found)
        else {
            return none;
        };
        let [q, u] = ["q", "u"].map(|key| {
            let (quantity, _) = fields.expected(key).measured();
            let entries = entries(fields.get(key), "joints", &mut self.diagnostics);
            let mut values = Vec::new();
            for entry in entries {
                let joint =
                    self.look_up(&entry.key, "joint", "joints", |names| &names.joints).map(JointId);
                let value = self.number(&entry.value, quantity);
                values.extend(joint.zip(value.map(|value| value.value)));
            }
            values
        });
        Initial {
            q,
            u,
            fold: self.initial_fold(&fields),
            bodies: self.initial_bodies(&fields, free),
        }
    }

    fn initial_bodies(&mut self, initial: &Fields, free: &[bool]) -> Vec<(BodyId, InitialBody)> {
        let entries = entries(initial.get("bodies"), "bodies", &mut self.diagnostics);
        let mut bodies = Vec::new();
        for entry in entries {
            let id = self.look_up(&entry.key, "body", "bodies", |names| &names.bodies);
            let state = self.initial_body(entry);
            let (Some(id), Some(state)) = (id, state) else { continue };
            if free.get(id) == Some(&true) {
                bodies.push((BodyId(id), state));
                continue;
            }
            let message = format!("body `{}` is not free", shorten(&entry.key.value));
            let error = Diagnostic::error(codes::NOT_FREE, entry.key.span, message);
            self.note(error.hint(
                "give the body `free: true`; bodies on hinges start where `initial.q` puts them",
            ));
        }
        bodies
    }

    fn initial_body(&mut self, entry: &Entry) -> Option<InitialBody> {
        let (at, found) = (entry.key.span, &mut self.diagnostics);
        let owner = format!("the state of body `{}`", shorten(&entry.key.value));
        let fields = Fields::new(&entry.value, at, owner, &schema::FREE_BODY, found)?;
        let [position, velocity, angular_velocity] = ["position", "velocity", "angular_velocity"]
            .map(|key| match fields.get(key) {
                Some(node) => self.numbers(node, fields.expected(key)),
                None => Some([0.0; 3]),
            });
        let orientation = self.orientation(&fields);
        Some(InitialBody {
            position: position?,
            orientation: orientation?,
            velocity: velocity?,
            angular_velocity: angular_velocity?,
        })
    }

    /// Reads an orientation as a unit quaternion.
    fn orientation(&mut self, fields: &Fields) -> Option<[f64; 4]> {
        if let (Some(quaternion), Some(turn)) = (fields.entry("orientation"), fields.entry("turn"))
        {
            let message = "the orientation is given twice";
            let error = Diagnostic::error(codes::TWO_ORIENTATIONS, turn.key.span, message);
            self.note(
                error.also(quaternion.key.span, "the other").hint("give `orientation` or `turn`"),
            );
            return None;
        }
        if let Some(node) = fields.get("turn") {
            let turn: [f64; 3] = self.numbers(node, fields.expected("turn"))?;
            return Some(free::quaternion(turn));
        }
        let Some(node) = fields.get("orientation") else {
            return Some(InitialBody::DRAWN.orientation);
        };
        let given: [f64; 4] = self.numbers(node, fields.expected("orientation"))?;
        let unit = free::unit(given);
        if unit.is_none() {
            let error =
                Diagnostic::error(codes::NO_ORIENTATION, node.span, "the quaternion is zero");
            self.note(error.hint("`[1, 0, 0, 0]` is the orientation of the drawing"));
        }
        unit
    }

    /// Reads the share of the joints' folds at the start.
    fn initial_fold(&mut self, initial: &Fields) -> Option<Spanned<f64>> {
        let share = self.optional(initial, "fold")??;
        if (0.0..=1.0).contains(&share.value) {
            return Some(share);
        }
        let percent = number(100.0 * share.value);
        let message = format!("a fold of {percent} % at the start");
        let error = Diagnostic::error(codes::FOLD_SHARE, share.span, message);
        self.note(error.label("not from 0 to 100 %").hint(
            "give the share of the joints' `fold`, such as `30%` or `0.3`; `initial.q` sets the \
             angles of single joints",
        ));
        None
    }

    /// Returns how far the coordinates of hinge lines may be moved, m: the given tolerance, or one
    /// from the number of decimals.
    pub(super) fn tolerance(
        &mut self,
        given: Option<Spanned<f64>>,
        bodies: &[Body],
        joints: &[Joint],
    ) -> Option<f64> {
        let Some(Spanned { value: tolerance, span }) = given else {
            return Some(self.decimals.tolerance(bodies, joints));
        };
        let most = LARGEST_TOLERANCE * rounding::size(bodies, joints);
        if (0.0..=most).contains(&tolerance) {
            return Some(tolerance);
        }
        let message = match tolerance < 0.0 {
            true => "the tolerance is negative".to_owned(),
            false => format!(
                "the tolerance is more than a hundredth of the drawing's size, \
                              {most:.3e} m"
            ),
        };
        self.note(Diagnostic::error(codes::BAD_TOLERANCE, span, message).hint(
            "give a length: the rounding error of the coordinates of hinge lines; 0 uses them as \
             they are",
        ));
        None
    }
}
