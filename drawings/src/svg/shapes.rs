//! The elements that draw lines: from attributes to strokes and curves.

use std::f64::consts::FRAC_PI_2;

use roxmltree::Node;
use svgtypes::NumberListParser;

use super::path::{self, Pencil};
use super::size::{Axis, length};
use crate::affine::Affine;
use crate::curve::Point;
use crate::drawing::Place;
use crate::fault::{Cause, Fault};
use crate::sketch::{Pen, Sketch, Step, Stop};

/// Names of the elements that draw lines.
pub(super) const SHAPES: [&str; 7] =
    ["path", "line", "polyline", "polygon", "rect", "circle", "ellipse"];

/// An attribute that cannot be read.
pub(super) struct Bad {
    pub cause: Cause,
    pub message: String,
    pub place: Place,
}

/// Why a shape is not drawn.
enum Failure {
    Bad(Bad),
    Stop(Stop),
}

impl From<Stop> for Failure {
    fn from(stop: Stop) -> Self {
        Failure::Stop(stop)
    }
}

impl From<Bad> for Failure {
    fn from(bad: Bad) -> Self {
        Failure::Bad(bad)
    }
}

/// Draws a shape onto a sketch.
pub(super) fn draw(
    node: Node,
    viewport: Option<Point>,
    transform: Affine,
    pen: Pen,
    sketch: &mut Sketch,
) -> Step {
    let shape = Shape { node, viewport };
    let mut pencil = Pencil::new(sketch, transform, pen);
    let done = match node.tag_name().name() {
        "line" => shape.line(&mut pencil),
        "polyline" => shape.poly(&mut pencil, false),
        "polygon" => shape.poly(&mut pencil, true),
        "rect" => shape.rectangle(&mut pencil),
        "circle" => shape.circle(&mut pencil),
        "ellipse" => shape.ellipse(&mut pencil),
        _ => shape.path(&mut pencil),
    };
    match done {
        Ok(()) => Ok(()),
        Err(Failure::Stop(stop)) => Err(stop),
        Err(Failure::Bad(bad)) => sketch.fault(bad.fault()),
    }
}

impl Bad {
    pub(super) fn fault(self) -> Fault {
        Fault {
            cause: self.cause,
            message: self.message,
            place: Some(self.place),
            at: Vec::new(),
            hint: None,
        }
    }
}

/// The position of the value of an attribute.
pub(super) fn place_of(node: Node, name: &str) -> Place {
    let range = node.attribute_node(name).map_or(node.range(), |a| a.range_value());
    Place { start: range.start, end: range.end }
}

/// Returns a length in user units; None if there is no such attribute.
pub(super) fn attribute(
    node: Node,
    viewport: Option<Point>,
    name: &str,
    axis: Axis,
) -> Result<Option<f64>, Bad> {
    let Some(text) = node.attribute(name) else { return Ok(None) };
    length(text, axis, viewport).map(Some).map_err(|reason| Bad {
        cause: Cause::Number,
        message: format!("`{name}` of this {}: {reason}", node.tag_name().name()),
        place: place_of(node, name),
    })
}

struct Shape<'a, 'i> {
    node: Node<'a, 'i>,
    viewport: Option<Point>,
}

impl Shape<'_, '_> {
    fn get(&self, name: &str, axis: Axis) -> Result<f64, Bad> {
        Ok(attribute(self.node, self.viewport, name, axis)?.unwrap_or(0.0))
    }

    /// A radius or a side. None if it is `auto` or not there.
    fn side(&self, name: &str, axis: Axis) -> Result<Option<f64>, Bad> {
        if self.node.attribute(name).is_some_and(|text| text.trim() == "auto") {
            return Ok(None);
        }
        match attribute(self.node, self.viewport, name, axis)? {
            Some(side) if side < 0.0 => Err(Bad {
                cause: Cause::Number,
                message: format!("`{name}` of this {} is negative", self.node.tag_name().name()),
                place: place_of(self.node, name),
            }),
            side => Ok(side),
        }
    }

    fn line(&self, pencil: &mut Pencil) -> Result<(), Failure> {
        pencil.move_to([self.get("x1", Axis::X)?, self.get("y1", Axis::Y)?]);
        Ok(pencil.line_to([self.get("x2", Axis::X)?, self.get("y2", Axis::Y)?])?)
    }

    /// An odd number at the end is left out, as SVG says.
    fn poly(&self, pencil: &mut Pencil, close: bool) -> Result<(), Failure> {
        let mut numbers = NumberListParser::from(self.node.attribute("points").unwrap_or_default());
        let mut first = true;
        while let Some(x) = numbers.next() {
            let x = self.coordinate(x)?;
            let Some(y) = numbers.next() else { break };
            let point = [x, self.coordinate(y)?];
            if first {
                pencil.move_to(point);
                first = false;
            } else {
                pencil.line_to(point)?;
            }
        }
        if close && !first {
            pencil.close()?;
        }
        Ok(())
    }

    fn coordinate(&self, number: Result<f64, svgtypes::Error>) -> Result<f64, Bad> {
        number.map_err(|error| Bad {
            cause: Cause::Number,
            message: format!("`points` of this {}: {error}", self.node.tag_name().name()),
            place: place_of(self.node, "points"),
        })
    }

    fn rectangle(&self, pencil: &mut Pencil) -> Result<(), Failure> {
        let (x, y) = (self.get("x", Axis::X)?, self.get("y", Axis::Y)?);
        let width = self.side("width", Axis::X)?.unwrap_or(0.0);
        let height = self.side("height", Axis::Y)?.unwrap_or(0.0);
        let radii = [self.side("rx", Axis::X)?, self.side("ry", Axis::Y)?];
        if width == 0.0 || height == 0.0 {
            return Ok(());
        }
        let rx = radii[0].or(radii[1]).unwrap_or(0.0).min(0.5 * width);
        let ry = radii[1].or(radii[0]).unwrap_or(0.0).min(0.5 * height);
        let (right, bottom) = (x + width, y + height);
        if rx == 0.0 || ry == 0.0 {
            pencil.move_to([x, y]);
            for corner in [[right, y], [right, bottom], [x, bottom]] {
                pencil.line_to(corner)?;
            }
            return Ok(pencil.close()?);
        }
        pencil.move_to([x + rx, y]);
        pencil.line_to([right - rx, y])?;
        quarter(pencil, [right - rx, y + ry], [rx, ry], 3, [right, y + ry])?;
        pencil.line_to([right, bottom - ry])?;
        quarter(pencil, [right - rx, bottom - ry], [rx, ry], 0, [right - rx, bottom])?;
        pencil.line_to([x + rx, bottom])?;
        quarter(pencil, [x + rx, bottom - ry], [rx, ry], 1, [x, bottom - ry])?;
        pencil.line_to([x, y + ry])?;
        Ok(quarter(pencil, [x + rx, y + ry], [rx, ry], 2, [x + rx, y])?)
    }

    fn circle(&self, pencil: &mut Pencil) -> Result<(), Failure> {
        let radius = self.side("r", Axis::Both)?.unwrap_or(0.0);
        self.round(pencil, [radius, radius])
    }

    fn ellipse(&self, pencil: &mut Pencil) -> Result<(), Failure> {
        let radii = [self.side("rx", Axis::X)?, self.side("ry", Axis::Y)?];
        let rx = radii[0].or(radii[1]).unwrap_or(0.0);
        let ry = radii[1].or(radii[0]).unwrap_or(0.0);
        self.round(pencil, [rx, ry])
    }

    /// Four quarters, so that the extreme points are exact.
    fn round(&self, pencil: &mut Pencil, radii: Point) -> Result<(), Failure> {
        let centre = [self.get("cx", Axis::X)?, self.get("cy", Axis::Y)?];
        let [rx, ry] = radii;
        if rx == 0.0 || ry == 0.0 {
            return Ok(());
        }
        let [x, y] = centre;
        pencil.move_to([x + rx, y]);
        for (k, end) in [[x, y + ry], [x - rx, y], [x, y - ry], [x + rx, y]].into_iter().enumerate()
        {
            quarter(pencil, centre, radii, k, end)?;
        }
        Ok(())
    }

    fn path(&self, pencil: &mut Pencil) -> Result<(), Failure> {
        let data = self.node.attribute("d").unwrap_or_default();
        // `none` is the value of CSS for a path without data.
        if data.trim() == "none" {
            return Ok(());
        }
        match path::draw(data, pencil) {
            Ok(step) => Ok(step?),
            Err(error) => Err(Failure::Bad(Bad {
                cause: if matches!(error, svgtypes::Error::InvalidNumber(_)) {
                    Cause::Number
                } else {
                    Cause::Syntax
                },
                message: format!("the data of this path is wrong: {error}"),
                place: place_of(self.node, "d"),
            })),
        }
    }
}

/// The quarter number `k` of an ellipse, in the direction from x to y.
fn quarter(pencil: &mut Pencil, centre: Point, [rx, ry]: Point, k: usize, end: Point) -> Step {
    // The axes themselves turn, so that sines of small angles only are needed.
    let axes = match k {
        0 => [[rx, 0.0], [0.0, ry]],
        1 => [[0.0, ry], [-rx, 0.0]],
        2 => [[-rx, 0.0], [0.0, -ry]],
        _ => [[0.0, -ry], [rx, 0.0]],
    };
    pencil.arc(centre, axes, 0.0, FRAC_PI_2, end)
}
