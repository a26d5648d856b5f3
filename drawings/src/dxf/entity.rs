//! One entity: its layer, its colour, and its geometry in its own coordinates.
//!
//! AutoCAD DXF reference: "ENTITIES section". Planar entities (ARC, CIRCLE, LWPOLYLINE, POLYLINE, INSERT) have
//! coordinates of an "object coordinate system", which is that of the drawing, or that of the drawing seen from
//! below; other planes are not read.

use super::file::{Names, Record};
use super::pairs::fault;
use super::spline::Spline;
use crate::curve::Point;
use crate::drawing::Place;
use crate::fault::{Cause, Fault};

/// The colour of an entity or a layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Colour {
    /// That of its layer.
    ByLayer,
    /// That of the INSERT around it.
    ByBlock,
    /// An index of AutoCAD's palette, from 1 to 255.
    Index(u8),
    /// Red, green, blue.
    True([u8; 3]),
}

/// An entity.
#[derive(Clone, Debug)]
pub(super) struct Entity {
    /// The number of its name.
    pub layer: usize,
    pub colour: Colour,
    pub place: Place,
    /// Seen from below: its x axis points to the left.
    pub mirrored: bool,
    pub kind: Kind,
}

/// The geometry of an entity.
#[derive(Clone, Debug)]
pub(super) enum Kind {
    Line([Point; 2]),
    Chain(Box<Chain>),
    /// Centre, radius, and its ends in degrees, counterclockwise.
    Arc(Point, f64, [f64; 2]),
    /// Centre, radius.
    Circle(Point, f64),
    /// Centre, the two semi-axes, and the parameters of its ends, rad, from the first axis to the second.
    Ellipse(Point, [Point; 2], [f64; 2]),
    Spline(Box<Spline>),
    Insert(Box<Insert>),
    /// Something else, in the words of the format: the number of its name.
    Other(usize),
}

/// A polyline.
#[derive(Clone, Debug, Default)]
pub(super) struct Chain {
    /// Points, each with the bulge of the arc that follows: the tangent of a quarter of its angle.
    pub vertices: Vec<(Point, f64)>,
    pub closed: bool,
    /// Vertices follow as records of their own.
    pub open_for_vertices: bool,
    /// The range of the z of its vertices.
    pub heights: Option<[f64; 2]>,
}

/// A reference to a block.
#[derive(Clone, Debug)]
pub(super) struct Insert {
    /// The number of its name.
    pub block: usize,
    pub at: Point,
    pub scale: Point,
    /// Degrees, counterclockwise.
    pub rotation: f64,
    /// Numbers of columns and rows.
    pub counts: [u32; 2],
    /// Distances of columns and rows.
    pub spacing: Point,
}

impl Entity {
    /// Its share of the memory limit: the number of its points.
    pub(super) fn size(&self) -> usize {
        match &self.kind {
            Kind::Chain(chain) => 1 + chain.vertices.len(),
            Kind::Spline(spline) => 1 + spline.knots.len(),
            _ => 1,
        }
    }
}

/// How far an entity may leave its plane, as a share of its size: exporters round.
const FLAT: f64 = 1e-6;

/// Reads an entity.
pub(super) fn read(record: &Record, names: &mut Names) -> Result<Entity, Fault> {
    let colour = match (record.integer(420)?, record.integer(62)?) {
        (Some(colour), _) => true_colour(colour),
        (None, Some(index)) => indexed(index),
        (None, None) => Colour::ByLayer,
    };
    let up = [real(record, 210, 0.0)?, real(record, 220, 0.0)?, real(record, 230, 1.0)?];
    let sideways = up[0].abs().max(up[1].abs());
    let layer = names.number(&record.find(8).map_or("0".to_string(), |pair| decoded(&pair.text())));
    let reason = if record.integer(60)?.unwrap_or(0) != 0 {
        Some("that is invisible")
    } else if record.integer(67)?.unwrap_or(0) != 0 {
        Some("in paper space")
    } else if sideways > FLAT * up[2].abs() {
        Some("in an inclined plane")
    } else {
        None
    };
    let geometry = match reason {
        None => geometry(record, up[2] < 0.0, names)?,
        Some(reason) => Err(reason),
    };
    let kind = geometry.unwrap_or_else(|reason| {
        let what = if reason.is_empty() {
            record.kind.clone()
        } else {
            format!("{} {reason}", record.kind)
        };
        Kind::Other(names.number(&what))
    });
    let planar =
        matches!(kind, Kind::Chain(_) | Kind::Arc(..) | Kind::Circle(..) | Kind::Insert(_));
    Ok(Entity { layer, colour, place: record.place, mirrored: planar && up[2] < 0.0, kind })
}

/// The geometry, or why it is not read.
fn geometry(
    record: &Record,
    below: bool,
    names: &mut Names,
) -> Result<Result<Kind, &'static str>, Fault> {
    let point = |x, y| Ok([real(record, x, 0.0)?, real(record, y, 0.0)?]);
    Ok(Ok(match record.kind.as_str() {
        "LINE" => {
            let ends = [point(10, 20)?, point(11, 21)?];
            let rise = real(record, 31, 0.0)? - real(record, 30, 0.0)?;
            if rise.abs() > FLAT * extent(ends.iter()) {
                return Ok(Err("with ends at different heights"));
            }
            Kind::Line(ends)
        }
        "LWPOLYLINE" => Kind::Chain(Box::new(light_polyline(record)?)),
        "POLYLINE" => {
            const MESHES: i64 = 16 | 64;
            let flags = record.integer(70)?.unwrap_or(0);
            if flags & MESHES != 0 {
                return Ok(Err("that is a mesh"));
            }
            Kind::Chain(Box::new(Chain {
                closed: flags & 1 != 0,
                open_for_vertices: true,
                ..Chain::default()
            }))
        }
        // Programs leave circles behind whose radius became zero.
        "ARC" | "CIRCLE" if real(record, 40, 0.0)? <= 0.0 => return Ok(Err("without radius")),
        "ARC" => {
            let ends = [real(record, 50, 0.0)?, real(record, 51, 360.0)?];
            Kind::Arc(point(10, 20)?, real(record, 40, 0.0)?, ends)
        }
        "CIRCLE" => Kind::Circle(point(10, 20)?, real(record, 40, 0.0)?),
        "ELLIPSE" => {
            let major = point(11, 21)?;
            if real(record, 31, 0.0)?.abs() > FLAT * extent([major].iter()) {
                return Ok(Err("in an inclined plane"));
            }
            let ratio = if below { -1.0 } else { 1.0 } * real(record, 40, 1.0)?;
            let ends = [real(record, 41, 0.0)?, real(record, 42, std::f64::consts::TAU)?];
            Kind::Ellipse(point(10, 20)?, [major, [-major[1] * ratio, major[0] * ratio]], ends)
        }
        "SPLINE" => return spline(record),
        "INSERT" => Kind::Insert(Box::new(insert(record, names)?)),
        _ => return Ok(Err("")),
    }))
}

fn light_polyline(record: &Record) -> Result<Chain, Fault> {
    let closed = record.integer(70)?.unwrap_or(0) & 1 != 0;
    let mut chain = Chain { closed, ..Chain::default() };
    for pair in &record.pairs {
        match (pair.code, chain.vertices.last_mut()) {
            (10, _) => chain.vertices.push(([pair.real()?, 0.0], 0.0)),
            (20, Some((point, _))) => point[1] = pair.real()?,
            (42, Some((_, bulge))) => *bulge = pair.real()?,
            _ => (),
        }
    }
    Ok(chain)
}

/// Adds a VERTEX to its POLYLINE.
pub(super) fn vertex(record: &Record, chain: &mut Chain) -> Result<(), Fault> {
    /// A control point of the spline that the polyline follows, not a point of the polyline.
    const CONTROL: i64 = 16;
    if record.integer(70)?.unwrap_or(0) & CONTROL != 0 {
        return Ok(());
    }
    let z = real(record, 30, 0.0)?;
    let [low, high] = chain.heights.unwrap_or([z, z]);
    chain.heights = Some([low.min(z), high.max(z)]);
    chain.vertices.push(([real(record, 10, 0.0)?, real(record, 20, 0.0)?], real(record, 42, 0.0)?));
    Ok(())
}

impl Chain {
    /// Whether its vertices have one height.
    pub(super) fn is_flat(&self) -> bool {
        let [low, high] = self.heights.unwrap_or([0.0, 0.0]);
        high - low <= FLAT * extent(self.vertices.iter().map(|(point, _)| point))
    }
}

fn spline(record: &Record) -> Result<Result<Kind, &'static str>, Fault> {
    let mut found = Spline { degree: 0, knots: Vec::new(), points: Vec::new() };
    found.degree = usize::try_from(record.integer(71)?.unwrap_or(3)).unwrap_or(0);
    let mut weights = Vec::new();
    let mut heights = Vec::new();
    for pair in &record.pairs {
        match (pair.code, found.points.last_mut()) {
            (10, _) => found.points.push([pair.real()?, 0.0, 1.0]),
            (20, Some(point)) => point[1] = pair.real()?,
            (30, _) => heights.push(pair.real()?),
            (40, _) => found.knots.push(pair.real()?),
            (41, _) => weights.push(pair.real()?),
            _ => (),
        }
    }
    if found.points.is_empty() {
        return Ok(Err("without control points"));
    }
    let range = heights
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [z.min(low), z.max(high)]);
    let plain: Vec<Point> = found.points.iter().map(|p| [p[0], p[1]]).collect();
    if range[1] - range[0] > FLAT * extent(plain.iter()) {
        return Ok(Err("with points at different heights"));
    }
    if !weights.is_empty() && weights.len() != found.points.len() {
        let message =
            format!("this SPLINE has {} weights for {} points", weights.len(), found.points.len());
        return Err(fault(Cause::Syntax, message, record.place));
    }
    for (point, weight) in found.points.iter_mut().zip(&weights) {
        *point = [point[0] * weight, point[1] * weight, *weight];
    }
    match found.check() {
        Ok(()) => Ok(Ok(Kind::Spline(Box::new(found)))),
        Err(reason) => {
            Err(fault(Cause::Syntax, format!("this SPLINE is wrong: {reason}"), record.place))
        }
    }
}

fn insert(record: &Record, names: &mut Names) -> Result<Insert, Fault> {
    let count = |code| Ok(u32::try_from(record.integer(code)?.unwrap_or(1)).unwrap_or(1).max(1));
    Ok(Insert {
        block: names.number(&record.text(2)),
        at: [real(record, 10, 0.0)?, real(record, 20, 0.0)?],
        scale: [real(record, 41, 1.0)?, real(record, 42, 1.0)?],
        rotation: real(record, 50, 0.0)?,
        counts: [count(70)?, count(71)?],
        spacing: [real(record, 44, 0.0)?, real(record, 45, 0.0)?],
    })
}

fn real(record: &Record, code: i32, default: f64) -> Result<f64, Fault> {
    Ok(record.real(code)?.unwrap_or(default))
}

/// The largest magnitude of coordinates, and at least 1.
fn extent<'p>(points: impl Iterator<Item = &'p Point>) -> f64 {
    points.flatten().fold(1.0, |most: f64, x| most.max(x.abs()))
}

/// A colour of 24 bits, of group 420.
pub(super) fn true_colour(number: i64) -> Colour {
    let [.., red, green, blue] = number.to_be_bytes();
    Colour::True([red, green, blue])
}

/// A colour of AutoCAD's palette, of group 62. It is negative for a layer that is off.
pub(super) fn indexed(number: i64) -> Colour {
    match u8::try_from(number.unsigned_abs()) {
        Ok(0) => Colour::ByBlock,
        Ok(index) => Colour::Index(index),
        Err(_) => Colour::ByLayer,
    }
}

/// Text with the characters that are written as `\U+00E4`.
pub(super) fn decoded(text: &str) -> String {
    let mut found = String::with_capacity(text.len());
    let mut parts = text.split("\\U+");
    found.push_str(parts.next().unwrap_or_default());
    for part in parts {
        let code = part
            .get(..4)
            .and_then(|hex| u32::from_str_radix(hex, 16).ok())
            .and_then(char::from_u32);
        match code {
            Some(character) => {
                found.push(character);
                found.push_str(&part[4..]);
            }
            None => {
                found.push_str("\\U+");
                found.push_str(part);
            }
        }
    }
    found
}
