//! What popupCAD exported from July 2015 until it wrote `DynamicsInfo`: a tuple of four lists.
//!
//! ```text
//! - bodies:        GenericLaminate { geoms: { material: [GenericPoly] }, layerdef: { layers: [material] } }
//! - connections:   (GenericPolyline of two vertices, [body, body])
//! - fixed bodies:  [body]
//! - properties:    (stiffness, damping, preload, lower limit, upper limit, height of the hinge line)
//! ```
//!
//! Bodies and materials are objects that the file names again by aliases; an object is known by its
//! place in the text. Layers are listed from the bottom to the top, and properties in the order of the
//! connections. Lengths are in millimetres, angles in degrees, everything else in SI
//! (github.com/danaukes/popupcad, `manufacturing/joint_operation3.py`, `save_joint_def_old`, and how
//! `save_joint_def` converts the same numbers).

use std::collections::HashMap;

use super::joints::{Laws, hinge};
use super::{Import, Parts, head, laminate};
use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, SourceFile, Span, Spanned};
use crate::source::drawn::Drawn;
use crate::source::fields::{array, items};
use crate::source::ids::BodyId;
use crate::source::model::{Body, Joint, Plate, SourceModel};
use crate::source::units;
use crate::source::yaml::{Content, Node, shorten};

/// Tags of vertices whose coordinates are in millimetres.
const VERTICES: [&str; 2] = ["!ShapeVertex_1", "!DrawnPoint_1"];

/// The contents of a `GenericLaminate`.
const LAMINATE: &[&str] = &["geoms", "id", "layerdef"];
/// The contents of a shape.
const SHAPE: &[&str] = &["construction", "exterior", "id", "interiors"];

/// Bodies by their places in the text.
type Places = HashMap<usize, BodyId>;

impl Import {
    /// Reads the four lists.
    pub(super) fn older(&mut self, root: &Node, file: &SourceFile) -> Option<SourceModel> {
        let what = "an older export of popupCAD: lists of bodies, connections, fixed bodies, and \
                    properties of the joints";
        let lists: &[Node; 4] = array(root, what, &mut self.diagnostics)?;
        let list = lists[2].span;
        let names = ["bodies", "connections", "fixed bodies", "properties of the joints"];
        let mut lists = lists
            .iter()
            .zip(names)
            .map(|(list, name)| items(list, &format!("a list of {name}"), &mut self.diagnostics));
        let [items, connections, newtonian, properties] =
            std::array::from_fn(|_| lists.next().flatten());
        drop(lists);
        let (items, connections, newtonian, properties) =
            (items?, connections?, newtonian?, properties?);

        let layers = items.first().and_then(|body| self.layers(body));
        let stack = layers.and_then(|layers| self.materials(layers));
        let places: Places =
            items.iter().enumerate().map(|(i, item)| (item.span.start, BodyId(i))).collect();
        let fixed: Vec<_> =
            newtonian.iter().filter_map(|node| self.body_at(node, list, &places)).collect();
        let fixed: Vec<BodyId> = fixed.into_iter().map(|body| body.value).collect();
        let bodies = (items.iter().enumerate())
            .map(|(i, item)| self.older_body(i, item, layers?, fixed.contains(&BodyId(i))))
            .collect();
        if connections.len() != properties.len() {
            let (joints, given) = (connections.len(), properties.len());
            let at = root.span.start.max(head_of(properties, root).start);
            let message = format!("{given} properties of joints for {joints} connections");
            let error =
                Diagnostic::error(codes::WRONG_LENGTH, Span { start: at, end: at + 1 }, message);
            self.diagnostics
                .push(error.hint("number i belongs to connection i: export the design again"));
            return None;
        }
        let joints = (connections.iter().zip(properties).enumerate())
            .map(|(i, (connection, laws))| self.older_joint(i, [connection, laws], &places, &fixed))
            .collect();
        let parts = Parts {
            at: tag_of(root),
            layers: layers.map(<[Node]>::len),
            stack,
            complete: true,
            bodies,
            joints,
            fixed,
            listed: Some(newtonian.len()),
            list: "the third list",
        };
        self.assembled(parts, file)
    }

    /// Reports what is no object of this class.
    fn object(&mut self, node: &Node, class: &str) -> Option<()> {
        if is_object(node, class) {
            return Some(());
        }
        let (at, found) = match &node.tag {
            Some(tag) => {
                (tag.span, format!("`{}`", shorten(&tag.value.replace("tag:yaml.org,2002:", "!!"))))
            }
            None => (head(node), node.describe()),
        };
        let error = Diagnostic::error(codes::OTHER_OBJECT, at, format!("expected a `{class}`"));
        self.diagnostics.push(error.label(format!("this is {found}")));
        None
    }

    /// Returns the layers of a laminate, bottom to top: its materials.
    fn layers<'n>(&mut self, body: &'n Node) -> Option<&'n [Node]> {
        self.object(body, "GenericLaminate")?;
        let stack = self.require(body, head(body), "layerdef")?;
        self.list(stack, head(stack), "layers")
    }

    fn older_body(&mut self, i: usize, item: &Node, layers: &[Node], fixed: bool) -> Option<Body> {
        self.object(item, "GenericLaminate")?;
        self.warn_of_others(item, LAMINATE);
        let geometries = self.require(item, head(item), "geoms")?;
        let Content::Mapping(entries) = &geometries.content else {
            let error = Diagnostic::error(
                codes::WRONG_TYPE,
                geometries.span,
                "expected a mapping from materials to polygons",
            );
            self.diagnostics.push(error.label(format!("this is {}", geometries.describe())));
            return None;
        };
        let mut plates = Vec::with_capacity(layers.len());
        for (number, layer) in layers.iter().enumerate() {
            let of_layer = |key: &Node| key.span.start == layer.span.start;
            let mut found =
                entries.iter().filter(|entry| entry.object.as_deref().is_some_and(of_layer));
            let Some(entry) = found.next() else {
                let message = format!("this body has no entry for layer {}", number + 1);
                let error = Diagnostic::error(codes::MISSING_KEY, head(item), message);
                self.diagnostics.push(error.also(head(layer), "the layer"));
                return None;
            };
            let shapes = items(&entry.value, "a list of polygons", &mut self.diagnostics)?;
            let read: Vec<_> = shapes.iter().map(|shape| self.polygon(shape)).collect();
            plates.push(read.into_iter().collect::<Option<Vec<Plate>>>()?);
        }
        Some(laminate(i, item, plates, fixed))
    }

    fn polygon(&mut self, node: &Node) -> Option<Plate> {
        if ["GenericPolyline", "GenericLine"].iter().any(|class| is_object(node, class)) {
            let message = "not a polygon: lines have no area";
            self.report(
                codes::BAD_POLYGON,
                head(node),
                message,
                "a layer holds polygons, with holes",
            );
            return None;
        }
        self.object(node, "GenericPoly")?;
        self.warn_of_others(node, SHAPE);
        let outline =
            self.require(node, head(node), "exterior").and_then(|ring| self.older_ring(ring));
        let holes = self.list(node, head(node), "interiors")?;
        let holes = holes.iter().map(|ring| self.older_ring(ring).map(Drawn::from));
        let holes: Vec<_> = holes.collect();
        Some(Plate { outline: outline?.into(), holes: holes.into_iter().collect::<Option<_>>()? })
    }

    fn older_ring(&mut self, node: &Node) -> Option<Spanned<Vec<[f64; 2]>>> {
        let vertices = items(node, "a list of vertices", &mut self.diagnostics)?;
        let vertices: Vec<_> = vertices.iter().map(|vertex| self.vertex(vertex)).collect();
        self.ring(vertices.into_iter().collect::<Option<_>>()?, node)
    }

    /// Reads a vertex: its number, x, y.
    fn vertex(&mut self, node: &Node) -> Option<[f64; 2]> {
        let tag = node.tag.as_ref().map_or("", |tag| &tag.value);
        if !VERTICES.contains(&tag) {
            let at = node.tag.as_ref().map_or(node.span, |tag| tag.span);
            let error =
                Diagnostic::error(codes::OTHER_OBJECT, at, "expected a vertex, `!ShapeVertex_1`");
            let hint =
                "before July 2015 popupCAD wrote vertices in another unit: export the design again";
            self.diagnostics.push(error.hint(hint));
            return None;
        }
        let [_, x, y] = array(node, "a vertex: its number, x, y", &mut self.diagnostics)?;
        self.coordinate(x).zip(self.coordinate(y)).map(<[f64; 2]>::from)
    }

    fn older_joint(
        &mut self,
        i: usize,
        [connection, laws]: [&Node; 2],
        places: &Places,
        fixed: &[BodyId],
    ) -> Option<Joint> {
        let what = "a connection: hinge line, two bodies";
        let parts: Option<&[Node; 2]> = array(connection, what, &mut self.diagnostics);
        let laws = self.laws(laws);
        let [line, pair] = parts?;
        let axis = self.older_axis(line);
        let bodies = array(pair, "two bodies", &mut self.diagnostics)
            .and_then(|nodes: &[Node; 2]| {
                let [first, second] =
                    nodes.each_ref().map(|node| self.body_at(node, pair.span, places));
                Some([first?, second?])
            })
            .and_then(|bodies| self.distinct(tag_of(connection), bodies, fixed));
        Some(hinge(i, connection, bodies?, axis?, laws?))
    }

    fn older_axis(&mut self, node: &Node) -> Option<Spanned<[[f64; 2]; 2]>> {
        if !is_object(node, "GenericLine") {
            self.object(node, "GenericPolyline")?;
        }
        self.warn_of_others(node, SHAPE);
        let line = self.require(node, head(node), "exterior")?;
        let ends: &[Node; 2] = array(line, "two vertices", &mut self.diagnostics)?;
        let [from, to] = ends.each_ref().map(|end| self.vertex(end));
        self.line([from?, to?], line.span)
    }

    fn laws(&mut self, node: &Node) -> Option<Laws> {
        let what = "six numbers: stiffness, damping, preload, lower limit, upper limit, height";
        let numbers: &[Node; 6] = array(node, what, &mut self.diagnostics)?;
        let [stiffness, damping, preload, low, high, height] = numbers;
        let mut number = |node: &Node| {
            let value = self.number(node, units::SI);
            value.map(|value| Spanned { value, span: node.span })
        };
        let [stiffness, damping, preload, low, high] =
            [stiffness, damping, preload, low, high].map(&mut number);
        let z = self.coordinate(height);
        let limits = self.limits(low?, high?);
        Some(Laws {
            stiffness: stiffness?,
            damping: damping?,
            preload: preload?,
            limits: limits?,
            z: z?,
        })
    }

    /// Returns the body that an alias in the list at `list` stands for.
    fn body_at(&mut self, node: &Node, list: Span, places: &Places) -> Option<Spanned<BodyId>> {
        let body = places.get(&node.span.start);
        if body.is_none() {
            // The position of an alias is not known, only that of what it stands for.
            let message = "this list names something that is not in the first list of the file";
            let error = Diagnostic::error(codes::UNKNOWN_BODY, list, message);
            self.diagnostics.push(error.also(head(node), "this is none of the bodies"));
        }
        body.map(|&value| Spanned { value, span: head(node) })
    }
}

/// Returns whether a node is an object of this class, in any module.
fn is_object(node: &Node, class: &str) -> bool {
    let tag = node.tag.as_ref().map_or("", |tag| &tag.value);
    let name =
        tag.strip_prefix("tag:yaml.org,2002:python/object:").map(|path| path.rsplit('.').next());
    name.flatten() == Some(class)
}

/// Returns the place of a node's tag; the beginning of the node if it has none.
fn tag_of(node: &Node) -> Span {
    node.tag.as_ref().map_or(head(node), |tag| tag.span)
}

/// Returns where a list begins; where the file begins if it is empty.
fn head_of(list: &[Node], root: &Node) -> Span {
    list.first().map_or(root.span, head)
}
