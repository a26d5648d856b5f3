//! Reads and writes DXF, AutoCAD's Drawing Exchange Format.
//!
//! LINE, LWPOLYLINE, POLYLINE, ARC, CIRCLE, ELLIPSE and SPLINE are lines; INSERT draws its block, with scale,
//! rotation, arrays, and blocks within blocks. [`Format::Dxf`](crate::Format::Dxf) says what a line means. All
//! else (TEXT, HATCH, DIMENSION, ...) is counted as ignored, as are lines on layers that are frozen or off, in
//! paper space, or not parallel to the plane of the drawing. The unit is `$INSUNITS`.
//!
//! # Why not the crate `dxf`
//!
//! Its entities have no position in the text, which each message here has; it has no limit on what it stores,
//! and it brings time zones, image formats and random identifiers with it, which a build script would compile
//! for the few entities that are lines.

mod draw;
mod entity;
mod file;
mod pairs;
mod roles;
mod spline;
#[cfg(test)]
mod tests;
mod write;

use std::collections::BTreeSet;

pub(crate) use pairs::SENTINEL;
pub use write::write;

use crate::affine::Affine;
use crate::drawing::{Drawing, Role};
use crate::fault::Fault;
use crate::sketch::{Sketch, Step};
use draw::{Context, Draw};
use entity::Colour;
use roles::Roles;

/// Lengths of `$INSUNITS`, m, from 1: inch, foot, mile, mm, cm, m, km, microinch, mil, yard, angstrom, nm,
/// micron, dm, dam, hm. Larger ones are astronomical.
const UNITS: [f64; 16] = [
    0.0254, 0.3048, 1609.344, 1e-3, 1e-2, 1.0, 1e3, 2.54e-8, 2.54e-5, 0.9144, 1e-10, 1e-9, 1e-6,
    0.1, 10.0, 100.0,
];

/// Reads a drawing. `layers` are the roles of its layers, `flatness` is the tolerance of curves in units of the
/// drawing.
///
/// # Errors
///
/// All that is wrong with it, up to [`crate::limits::FAULTS`].
pub(crate) fn read(
    bytes: &[u8],
    layers: &[(Role, String)],
    flatness: Option<f64>,
) -> Result<Drawing, Vec<Fault>> {
    let file = file::parse(bytes).map_err(|fault| vec![fault])?;
    let inside = file.blocks.values().flat_map(|block| &block.entities);
    let mut used: BTreeSet<usize> =
        file.entities.iter().chain(inside).map(|entity| entity.layer).collect();
    used.extend(file.layers.keys());
    let used: Vec<usize> = used.into_iter().collect();
    let roles = Roles::of(layers, &file, &used)?;
    let zero = used.iter().copied().find(|number| file.names.name(*number) == "0");
    let mut sketch = Sketch::default();
    let mut draw =
        Draw { file: &file, roles: &roles, sketch: &mut sketch, zero, open: Vec::new(), work: 0 };
    let context = Context { transform: Affine::IDENTITY, layer: None, colour: Colour::Index(7) };
    // A stop has its fault in the sketch, which `finish` returns.
    let _: Step = draw.entities(&file.entities, &context);
    let unit =
        file.units.and_then(|code| UNITS.get(usize::try_from(code.checked_sub(1)?).ok()?).copied());
    sketch.finish(flatness, unit)
}
