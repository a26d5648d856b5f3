//! The tree of elements: groups, transforms, clones, and what is not drawn.

use std::collections::HashMap;

use roxmltree::{Document, Node, NodeId};
use svgtypes::{TransformListParser, TransformListToken};

use super::shapes::{self, Bad, SHAPES, attribute, place_of};
use super::sheet::{Sheet, declarations};
use super::size::{self, Axis};
use super::style::Style;
use crate::affine::Affine;
use crate::curve::Point;
use crate::drawing::Place;
use crate::fault::{Cause, Fault};
use crate::limits;
use crate::sketch::{Pen, Sketch, Step, Stop};

/// Elements that hold what others use, or say something about the file. They draw nothing and are no loss.
const SILENT: [&str; 8] =
    ["defs", "symbol", "style", "title", "desc", "metadata", "script", "view"];

/// Elements whose children are drawn.
const GROUPS: [&str; 5] = ["g", "a", "svg", "switch", "use"];

/// The walk through a document.
pub(super) struct Walk<'a, 'i> {
    sheet: &'a Sheet<'a>,
    sketch: &'a mut Sketch,
    identifiers: HashMap<&'a str, Node<'a, 'i>>,
    /// Elements that are drawn as clones at the moment.
    cloned: Vec<NodeId>,
    namespace: Option<&'a str>,
    work: usize,
}

/// What an element gets from those around it.
#[derive(Clone, Copy)]
struct Context<'a> {
    style: Style<'a>,
    transform: Affine,
    viewport: Option<Point>,
    depth: usize,
}

/// The size of a viewport that a `<use>` demands.
type Demand = [Option<f64>; 2];

impl<'a, 'i> Walk<'a, 'i> {
    pub(super) fn new(
        document: &'a Document<'i>,
        sheet: &'a Sheet<'a>,
        sketch: &'a mut Sketch,
    ) -> Self {
        let mut identifiers = HashMap::new();
        for node in document.descendants() {
            if let Some(id) = node.attribute("id") {
                identifiers.entry(id).or_insert(node);
            }
        }
        let namespace = document.root_element().tag_name().namespace();
        Walk { sheet, sketch, identifiers, cloned: Vec::new(), namespace, work: 0 }
    }

    /// Draws the outermost `<svg>`.
    pub(super) fn root(&mut self, root: Node<'a, 'i>, page: &size::Page) -> Step {
        let context = Context {
            style: Style::default(),
            transform: page.transform,
            viewport: page.viewport,
            depth: 0,
        };
        let Some(inside) = self.enter(root, &context)? else { return Ok(()) };
        self.children(root, &inside)
    }

    fn children(&mut self, node: Node<'a, 'i>, context: &Context<'a>) -> Step {
        for child in node.children().filter(Node::is_element) {
            self.element(child, context, None)?;
        }
        Ok(())
    }

    fn element(
        &mut self,
        node: Node<'a, 'i>,
        around: &Context<'a>,
        demand: Option<Demand>,
    ) -> Step {
        let name = node.tag_name().name();
        let is_used_symbol = demand.is_some() && name == "symbol";
        if node.tag_name().namespace() != self.namespace {
            return Ok(());
        }
        if SILENT.contains(&name) && !is_used_symbol {
            if name == "defs" {
                self.definitions(node);
            }
            return Ok(());
        }
        let Some(context) = self.enter(node, around)? else { return Ok(()) };
        match name {
            "g" | "a" => self.children(node, &context),
            "svg" | "symbol" => self.viewport(node, &context, demand.unwrap_or_default()),
            "switch" => match node.children().find(|child| child.is_element() && is_chosen(*child))
            {
                Some(child) => self.element(child, &context, None),
                None => Ok(()),
            },
            "use" => self.clone(node, &context),
            shape if SHAPES.contains(&shape) => match context.style.role() {
                Ok((role, fold)) => {
                    let pen = Pen { role, fold, place: place(node) };
                    shapes::draw(node, context.viewport, context.transform, pen, self.sketch)
                }
                Err(why) => {
                    self.sketch.ignore(&format!("{name} {why}"), place(node));
                    Ok(())
                }
            },
            _ => {
                self.sketch.ignore(name, place(node));
                Ok(())
            }
        }
    }

    /// Counts gradients, clip paths, markers and the like, which change how lines look.
    fn definitions(&mut self, node: Node<'a, 'i>) {
        for child in node.children().filter(Node::is_element) {
            let name = child.tag_name().name();
            let known = SHAPES.contains(&name) || GROUPS.contains(&name) || SILENT.contains(&name);
            if !known && child.tag_name().namespace() == self.namespace {
                self.sketch.ignore(name, place(child));
            }
        }
    }

    /// Applies style and transform of an element. None if it is not displayed, or its transform is wrong.
    fn enter(
        &mut self,
        node: Node<'a, 'i>,
        around: &Context<'a>,
    ) -> Result<Option<Context<'a>>, Stop> {
        if around.depth >= limits::DEPTH {
            let message = format!("elements are nested deeper than {}", limits::DEPTH);
            return self.sketch.stop(fault(Cause::Limit, message, start(node)));
        }
        let (style, tried) = around.style.cascade(node, self.sheet);
        let text: usize = node.attributes().map(|a| a.value().len() + 1).sum();
        let again = if self.cloned.is_empty() { 1 } else { limits::WORK_OF_A_CLONE };
        let work = limits::WORK_OF_AN_ELEMENT + again * text + tried * limits::WORK_OF_A_RULE;
        self.work = self.work.saturating_add(work);
        if self.work > limits::WORK {
            let message =
                "the clones or the style sheet of this file are too much work".to_string();
            return self.sketch.stop(fault(Cause::Limit, message, start(node)));
        }
        if !style.displayed {
            self.sketch
                .ignore(&format!("{} with display:none", node.tag_name().name()), place(node));
            return Ok(None);
        }
        match transform(node) {
            Ok(own) => Ok(Some(Context {
                style,
                transform: around.transform.after(&own),
                viewport: around.viewport,
                depth: around.depth + 1,
            })),
            Err(bad) => {
                self.sketch.fault(bad.fault())?;
                Ok(None)
            }
        }
    }

    /// A nested `<svg>`, or a `<symbol>` that is used.
    fn viewport(&mut self, node: Node<'a, 'i>, context: &Context<'a>, demand: Demand) -> Step {
        let [x, y, width, height] = match rectangle(node, context.viewport) {
            Ok(found) => found,
            Err(bad) => return self.sketch.fault(bad.fault()),
        };
        let whole = context.viewport.map_or([None; 2], |v| v.map(Some));
        let size = [demand[0].or(width).or(whole[0]), demand[1].or(height).or(whole[1])];
        let at = [x.unwrap_or(0.0), y.unwrap_or(0.0)];
        let (inner, viewport) = size::nested(node, at, size);
        let transform = context.transform.after(&inner);
        let inside = Context { transform, viewport, ..*context };
        self.children(node, &inside)
    }

    fn clone(&mut self, node: Node<'a, 'i>, context: &Context<'a>) -> Step {
        const XLINK: &str = "http://www.w3.org/1999/xlink";
        let link =
            node.attribute("href").or_else(|| node.attribute((XLINK, "href"))).unwrap_or_default();
        let Some(target) =
            link.trim().strip_prefix('#').and_then(|id| self.identifiers.get(id).copied())
        else {
            self.sketch.ignore("use of something that is not in the file", place(node));
            return Ok(());
        };
        if self.cloned.contains(&target.id()) || node.ancestors().any(|a| a == target) {
            return self.sketch.stop(fault(
                Cause::Syntax,
                format!("`{link}` is a clone of itself"),
                place(node),
            ));
        }
        let [x, y, width, height] = match rectangle(node, context.viewport) {
            Ok(found) => found,
            Err(bad) => return self.sketch.fault(bad.fault()),
        };
        let moved = Affine::translation([x.unwrap_or(0.0), y.unwrap_or(0.0)]);
        let inside = Context { transform: context.transform.after(&moved), ..*context };
        self.cloned.push(target.id());
        let done = self.element(target, &inside, Some([width, height]));
        self.cloned.pop();
        done
    }
}

/// The attributes x, y, width and height.
fn rectangle(node: Node, viewport: Option<Point>) -> Result<[Option<f64>; 4], Bad> {
    let get = |name, axis| attribute(node, viewport, name, axis);
    Ok([get("x", Axis::X)?, get("y", Axis::Y)?, get("width", Axis::X)?, get("height", Axis::Y)?])
}

/// Whether a `<switch>` takes this child. Illustrator puts its own data first, which require an extension.
fn is_chosen(node: Node) -> bool {
    let absent = |name| node.attribute(name).is_none_or(|text: &str| text.trim().is_empty());
    absent("requiredExtensions")
        && node.attribute("systemLanguage").is_none_or(|text| text.starts_with("en"))
}

/// The transform of an element, user units inside to user units outside.
fn transform(node: Node) -> Result<Affine, Bad> {
    let bad = |name: &str, message: String| Bad {
        cause: Cause::Syntax,
        message,
        place: place_of(node, name),
    };
    let styled = |name: &str| {
        declarations(node.attribute("style").unwrap_or_default()).any(|d| d.name == name)
    };
    if styled("transform") || styled("transform-origin") || node.has_attribute("transform-origin") {
        let message = "lamc reads transforms from the attribute `transform`, without an origin, not from a style";
        return Err(bad(
            if styled("transform") { "style" } else { "transform-origin" },
            message.into(),
        ));
    }
    let mut whole = Affine::IDENTITY;
    for token in TransformListParser::from(node.attribute("transform").unwrap_or_default()) {
        let token =
            token.map_err(|error| bad("transform", format!("this transform is wrong: {error}")))?;
        whole = whole.after(&match token {
            TransformListToken::Matrix { a, b, c, d, e, f } => {
                Affine { x: [a, b], y: [c, d], o: [e, f] }
            }
            TransformListToken::Translate { tx, ty } => Affine::translation([tx, ty]),
            TransformListToken::Scale { sx, sy } => Affine::scaling(sx, sy),
            TransformListToken::Rotate { angle } => Affine::rotation(angle),
            TransformListToken::SkewX { angle } => {
                Affine { y: [tangent(angle), 1.0], ..Affine::IDENTITY }
            }
            TransformListToken::SkewY { angle } => {
                Affine { x: [1.0, tangent(angle)], ..Affine::IDENTITY }
            }
        });
    }
    Ok(whole)
}

fn tangent(degrees: f64) -> f64 {
    libm::tan(degrees.to_radians())
}

fn place(node: Node) -> Place {
    let range = node.range();
    Place { start: range.start, end: range.end }
}

/// The position of the opening tag's name.
fn start(node: Node) -> Place {
    let start = node.range().start;
    Place { start, end: start + 1 + node.tag_name().name().len() }
}

fn fault(cause: Cause, message: String, place: Place) -> Fault {
    Fault { cause, message, place: Some(place), at: Vec::new(), hint: None }
}
