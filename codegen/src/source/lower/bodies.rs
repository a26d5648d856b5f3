//! Bodies: plates, rigid bodies with given mass and inertia, point masses.

use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Spanned};
use crate::source::drawn::Drawn;
use crate::source::fields::{Fields, array, items};
use crate::source::model::{Body, MAX_VERTICES, Plate, PointMass, Shape};
use crate::source::schema::{
    BODY, FIXED_VERTEX, INERTIA_ROW, PLATE, PLATES, POINT_MASS, RING, SHAPES, SLIT, Value,
};
use crate::source::yaml::{Entry, Node, shorten};

use super::Lowering;

/// Returns which bodies are `fixed: true` (or `free: true`), in file order. Other entries need this before
/// the bodies are read.
pub(super) fn marked(bodies: &[Entry], key: &str) -> Vec<bool> {
    let is_marked = |entry: &Entry| entry.value.get(key).and_then(boolean) == Some(true);
    bodies.iter().map(is_marked).collect()
}

/// Returns whether a body has the key `fixed` (or `free`) with a value other than false.
fn some_say(bodies: &[Entry], key: &str) -> bool {
    let says = |entry: &Entry| {
        entry.value.get(key).is_some() && entry.value.get(key).and_then(boolean) != Some(false)
    };
    bodies.iter().any(says)
}

/// Returns whether a body says that it is fixed or free.
pub(super) fn some_root(bodies: &[Entry]) -> bool {
    some_say(bodies, "fixed") || some_say(bodies, "free")
}

/// Reads a truth value in every spelling of YAML 1.1, which other tools write: lower case, upper
/// case, or with a capital first letter.
pub(super) fn boolean(node: &Node) -> Option<bool> {
    const TRUE: [&str; 4] = ["y", "yes", "true", "on"];
    const FALSE: [&str; 4] = ["n", "no", "false", "off"];
    let text = &*node.scalar()?.text;
    let lower = text.to_ascii_lowercase();
    let rest = text.get(1..)?;
    let is_spelling = rest == rest.to_ascii_lowercase() || text == text.to_ascii_uppercase();
    match lower.as_str() {
        _ if !is_spelling => None,
        word if TRUE.contains(&word) => Some(true),
        word if FALSE.contains(&word) => Some(false),
        _ => None,
    }
}

impl Lowering<'_> {
    /// Reads an optional truth value that is false if it is left out.
    pub(super) fn truth(&mut self, fields: &Fields, key: &str) -> Option<bool> {
        let Some(node) = fields.get(key) else { return Some(false) };
        let truth = boolean(node);
        if truth.is_none() {
            let message = format!("`{key}` must be true or false");
            let error = Diagnostic::error(codes::WRONG_TYPE, node.span, message);
            self.note(error.label(format!("this is {}", node.describe())));
        }
        truth
    }

    pub(super) fn no_fixed_body(&mut self, model: &Fields, bodies: &[Entry]) {
        let at = model.entry("bodies").map(|entry| entry.key.span).unwrap_or_default();
        let first = bodies.first().map_or("base", |entry| &entry.key.value);
        self.note(
            Diagnostic::error(codes::NO_FIXED_BODY, at, "no body is fixed or free")
                .label("none of these is the ground")
                .hint(format!(
                    "give one of them `fixed: true`, as in `{first}: {{ fixed: true, .. }}`, or \
                     `free: true` if nothing holds it"
                )),
        );
    }

    /// `layers` is the number of layers of the layup, `None` without a layup, 0 if it could not be
    /// read.
    pub(super) fn body(&mut self, entry: &Entry, layers: Option<usize>) -> Option<Body> {
        let at = entry.key.span;
        let owner = format!("body `{}`", shorten(&entry.key.value));
        let fields = Fields::new(&entry.value, at, owner, &BODY, &mut self.diagnostics)?;
        let [fixed, free] = ["fixed", "free"].map(|key| self.boolean(&fields, key));
        if let (Some(_), Some(key)) = (fields.entry("fixed"), fields.entry("free")) {
            let message = format!("body `{}` is fixed and free", shorten(&entry.key.value));
            let error = Diagnostic::error(codes::FIXED_AND_FREE, key.key.span, message);
            self.note(error.hint("remove `fixed` or `free`"));
        }
        let shape = self.shape(&fields, layers);
        let slits = match fields.get("slits") {
            None => Some(Vec::new()),
            Some(node) => self.list(node, fields.expected("slits"), Self::slit),
        };
        let point_masses = match fields.get("point_masses") {
            None => Some(Vec::new()),
            Some(node) => self.list(node, fields.expected("point_masses"), Self::point_mass),
        };
        Some(Body {
            name: entry.key.clone(),
            fixed: fixed?,
            free: free?,
            shape: shape?,
            slits: slits?,
            point_masses: point_masses?,
            span: entry.span(),
        })
    }

    /// Reads a truth value that is false if it is missing.
    pub(super) fn boolean(&mut self, fields: &Fields, key: &str) -> Option<bool> {
        let Some(node) = fields.get(key) else { return Some(false) };
        let value = boolean(node);
        if value.is_none() {
            let message = format!("`{key}` must be true or false");
            let error = Diagnostic::error(codes::WRONG_TYPE, node.span, message);
            self.note(
                error
                    .label(format!("this is {}", node.describe()))
                    .hint(format!("write `{key}: true`, or remove the key")),
            );
        }
        value
    }

    /// Reads every item, even after an error; `None` if there was an error.
    fn list<T>(
        &mut self,
        node: &Node,
        value: &Value,
        mut read: impl FnMut(&mut Self, &Node) -> Option<T>,
    ) -> Option<Vec<T>> {
        let items = items(node, value.form(), &mut self.diagnostics)?;
        let read: Vec<_> = items.iter().map(|item| read(self, item)).collect();
        read.into_iter().collect()
    }

    fn shape(&mut self, fields: &Fields, layers: Option<usize>) -> Option<Shape> {
        let ways = SHAPES.iter();
        let mut given = ways.flat_map(|way| {
            way.iter().filter_map(|key| fields.entry(key)).map(move |entry| (entry, way[0]))
        });
        let Some((first, way)) = given.next() else { return Some(Shape::None) };
        if let Some((other, _)) = given.find(|(_, other)| *other != way) {
            let message =
                format!("a body has either `{}` or `{}`", first.key.value, other.key.value);
            self.note(
                Diagnostic::error(codes::MIXED_SHAPE, other.key.span, message)
                    .label("a second shape")
                    .also(first.key.span, "the first")
                    .hint(
                        "give an `outline`, or `layers`, or `mass`, `com` and `inertia`; \
                         `point_masses` may be added to any of them",
                    ),
            );
            return None;
        }
        if way == "mass" {
            return self.rigid(fields);
        }
        let Some(layers) = layers else {
            let message = format!("`{}` needs a `layup`", first.key.value);
            self.note(
                Diagnostic::error(codes::NO_LAYUP, first.key.span, message)
                    .label("the materials of the layers are missing")
                    .hint("add `layup: [..]`, the materials from bottom to top"),
            );
            return None;
        };
        match fields.get("layers") {
            Some(node) => self.layers(node, fields.expected("layers").form(), layers),
            None => self.plate_of(fields).map(|plate| Shape::Plates(vec![vec![plate]; layers])),
        }
    }

    fn layers(&mut self, node: &Node, form: &str, layers: usize) -> Option<Shape> {
        let lists = items(node, form, &mut self.diagnostics)?;
        if layers > 0 && lists.len() != layers {
            let plural = |n: usize| if n == 1 { "layer" } else { "layers" };
            let message = format!(
                "{} {} given, but the layup has {layers}",
                lists.len(),
                plural(lists.len())
            );
            self.note(
                Diagnostic::error(codes::WRONG_LENGTH, node.span, message)
                    .label(format!("expected {layers} {}", plural(layers)))
                    .hint("one list per layer, bottom to top; a layer without plates is `[]`"),
            );
        }
        let lists: Vec<_> =
            lists.iter().map(|list| self.list(list, &PLATES, Self::plate)).collect();
        lists.into_iter().collect::<Option<_>>().map(Shape::Plates)
    }

    fn plate(&mut self, node: &Node) -> Option<Plate> {
        let fields = Fields::new(node, node.span, "a plate", &PLATE, &mut self.diagnostics)?;
        self.plate_of(&fields)
    }

    fn plate_of(&mut self, fields: &Fields) -> Option<Plate> {
        let outline = fields.require("outline", &mut self.diagnostics);
        let outline = outline.and_then(|node| self.ring(node));
        let holes = match fields.get("holes") {
            None => Some(Vec::new()),
            Some(node) => self.list(node, fields.expected("holes"), Self::ring),
        };
        Some(Plate { outline: outline?, holes: holes? })
    }

    /// A closed line; the first vertex may be repeated at the end.
    fn ring(&mut self, node: &Node) -> Option<Drawn<Vec<[f64; 2]>>> {
        let nodes = items(node, RING.form(), &mut self.diagnostics)?;
        if let Some(beyond) = nodes.get(MAX_VERTICES) {
            let message =
                format!("{} vertices, but lamc reads at most {MAX_VERTICES}", nodes.len());
            let error = Diagnostic::error(codes::TOO_MANY_VERTICES, beyond.span, message);
            self.note(error.label("the first vertex beyond the limit"));
            return None;
        }
        let mut ring = self.drawn_points(node, nodes)?;
        let vertices = &mut ring.value;
        if let Some(i) = vertices.windows(2).position(|pair| pair[0] == pair[1]) {
            self.note(
                Diagnostic::error(
                    codes::REPEATED_VERTEX,
                    nodes[i + 1].span,
                    "the same vertex twice in a row",
                )
                .label("the same as the vertex before")
                .hint("remove one of them"),
            );
            return None;
        }
        if vertices.len() > 1 && vertices.first() == vertices.last() {
            vertices.pop();
            let places = 2 * vertices.len();
            ring.formulas.retain(|(place, _)| *place < places);
        }
        if vertices.len() < 3 {
            let message = format!(
                "an outline needs at least three vertices, this one has {}",
                vertices.len()
            );
            self.note(Diagnostic::error(codes::SHORT_OUTLINE, node.span, message));
            return None;
        }
        Some(ring)
    }

    fn slit(&mut self, node: &Node) -> Option<[[f64; 2]; 2]> {
        let nodes: &[Node; 2] = array(node, SLIT.form(), &mut self.diagnostics)?;
        let [from, to] = nodes.each_ref().map(|node| {
            self.note_decimals_of(node);
            self.numbers::<2>(node, &FIXED_VERTEX)
        });
        let (from, to) = (from?, to?);
        if from != to {
            return Some([from, to]);
        }
        let message = "the slit begins where it ends";
        let error = Diagnostic::error(codes::REPEATED_VERTEX, nodes[1].span, message);
        self.note(error.label("the same point twice").hint("give two different points"));
        None
    }

    fn rigid(&mut self, fields: &Fields) -> Option<Shape> {
        let mass = self.required_drawn(fields, "mass");
        let com = self.required_place(fields, "com");
        let inertia = fields.require("inertia", &mut self.diagnostics);
        let inertia = inertia.and_then(|node| self.inertia(node, fields.expected("inertia")));
        Some(Shape::Rigid { mass: mass?, com: com?, inertia: inertia? })
    }

    /// A 3x3 matrix, by rows.
    fn inertia(&mut self, node: &Node, value: &Value) -> Option<Spanned<[[f64; 3]; 3]>> {
        let rows: &[Node; 3] = array(node, value.form(), &mut self.diagnostics)?;
        let rows = rows.each_ref().map(|row| self.numbers::<3>(row, &INERTIA_ROW));
        let [Some(x), Some(y), Some(z)] = rows else { return None };
        Some(Spanned { value: [x, y, z], span: node.span })
    }

    fn point_mass(&mut self, node: &Node) -> Option<PointMass> {
        let found = &mut self.diagnostics;
        let fields = Fields::new(node, node.span, "a point mass", &POINT_MASS, found)?;
        let mass = self.required_drawn(&fields, "mass");
        let at = self.required_place(&fields, "at");
        Some(PointMass { mass: mass?, at: at? })
    }
}
