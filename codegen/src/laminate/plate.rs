//! Mass properties of bodies: polygon plates stacked by the layup, point masses, rigid parts.
//!
//! The moments of a polygon with vertices (x_i, y_i) follow from Green's theorem; with the cross
//! product c_i = x_i y_{i+1} - x_{i+1} y_i (Steger, "On the calculation of arbitrary moments of
//! polygons", 1996):
//!
//! ```text
//! A        = 1/2  sum c_i
//! int x    = 1/6  sum c_i (x_i + x_{i+1})
//! int x^2  = 1/12 sum c_i (x_i^2 + x_i x_{i+1} + x_{i+1}^2)
//! int x y  = 1/24 sum c_i (2 x_i y_i + x_i y_{i+1} + x_{i+1} y_i + 2 x_{i+1} y_{i+1})
//! ```

use nalgebra::{Matrix3, Vector2, Vector3};

use super::mechanism::{Body, MassProperties, Sheet};
use super::{air, check, outline};
use crate::source::{Diagnostics, Plate, Shape, SourceModel};

/// One sheet of the layup.
pub struct Layer<'a> {
    /// Its material's name.
    pub material: &'a str,
    /// Height of its lower face, m.
    pub bottom: f64,
    /// Thickness, m.
    pub thickness: f64,
    /// Density, kg/m^3.
    pub density: f64,
}

/// Returns the sheets of the layup, bottom (z = 0) to top.
pub fn stack(model: &SourceModel) -> impl Iterator<Item = Layer<'_>> {
    model.layup.iter().scan(0.0, |top, material| {
        let material = &model.materials[*material];
        let bottom = *top;
        *top += material.thickness.value;
        let thickness = material.thickness.value;
        let density = material.density.value;
        Some(Layer { material: &material.name.value, bottom, thickness, density })
    })
}

/// Derives a body with its mass properties; errors of its geometry or mass go to `found`.
pub fn body(model: &SourceModel, source: &crate::source::Body, found: &mut Diagnostics) -> Body {
    let before = found.0.len();
    let mut parts = Vec::new();
    let mut sheets = Vec::new();
    match &source.shape {
        Shape::None => {}
        Shape::Plates(layers) => {
            for (layer, plates) in stack(model).zip(layers) {
                outline::check(plates, found);
                parts.extend(plates.iter().map(|plate| moments(plate).extrude(&layer)));
                sheets.extend(plates.iter().map(|plate| sheet(plate, &layer)));
            }
        }
        Shape::Rigid { mass, com, inertia } => {
            check::positive("mass", mass, "kg", found);
            let given = Matrix3::from_fn(|i, j| inertia.value[i][j]);
            check::rigid_inertia(&given, inertia.span, found);
            let inertia = (given + given.transpose()) / 2.0;
            parts.push(MassProperties { mass: mass.value, com: com.value.into(), inertia });
        }
    }
    for point in &source.point_masses {
        check::positive("mass", &point.mass, "kg", found);
        parts.push(MassProperties::point(point.mass.value, point.at.into()));
    }
    let mass_properties = MassProperties::sum(&parts);
    let clean = !found.0[before..].iter().any(|d| d.severity == crate::source::Severity::Error);
    let sheets_are_physical =
        model.layup.iter().all(|material| check::is_physical(&model.materials[*material]));
    // An impossible mass is reported only if no mistake above explains it.
    let explained = !clean || (matches!(source.shape, Shape::Plates(_)) && !sheets_are_physical);
    if !source.fixed && !explained {
        check::moving_body(source, &mass_properties, found);
    }
    let surface = match &source.shape {
        Shape::Plates(layers) if clean && !source.fixed && model.air.is_some() => {
            air::surface(layers)
        }
        _ => Vec::new(),
    };
    Body {
        name: source.name.value.clone(),
        fixed: source.fixed,
        mass_properties,
        mass_parameter: None,
        sheets,
        point_masses: source.point_masses.iter().map(|point| point.at.into()).collect(),
        surface,
        span: source.span,
    }
}

/// A plate at its height.
fn sheet(plate: &Plate, layer: &Layer<'_>) -> Sheet {
    Sheet {
        material: layer.material.to_owned(),
        z: [layer.bottom, layer.bottom + layer.thickness],
        outline: plate.outline.value.clone(),
        holes: plate.holes.iter().map(|hole| hole.value.clone()).collect(),
    }
}

/// Moments of a plane figure about a point near it.
pub struct Moments {
    /// The point, in the flat state, m.
    pub origin: Vector2<f64>,
    /// Area, m^2.
    pub area: f64,
    /// Integral of (x, y) from the origin, m^3.
    pub first: Vector2<f64>,
    /// Integrals of x^2, y^2, x y from the origin, m^4.
    pub second: [f64; 3],
}

/// Moments of plates that do not overlap, about a point near the first.
pub fn area_moments(plates: &[Plate]) -> Moments {
    let mut parts = plates.iter().map(moments);
    let none =
        Moments { origin: Vector2::zeros(), area: 0.0, first: Vector2::zeros(), second: [0.0; 3] };
    let mut total = parts.next().unwrap_or(none);
    for part in parts {
        let d = part.origin - total.origin;
        let shifted = [
            part.second[0] + 2.0 * d.x * part.first.x + d.x * d.x * part.area,
            part.second[1] + 2.0 * d.y * part.first.y + d.y * d.y * part.area,
            part.second[2] + d.x * part.first.y + d.y * part.first.x + d.x * d.y * part.area,
        ];
        for (sum, part) in total.second.iter_mut().zip(shifted) {
            *sum += part;
        }
        total.first += part.first + d * part.area;
        total.area += part.area;
    }
    total
}

/// Returns the moments of a plate: outline minus holes, whatever their orientation.
fn moments(plate: &Plate) -> Moments {
    let outline = &plate.outline.value;
    // The moments are about the middle of the bounding box, because digits would cancel far from
    // the drawing's origin.
    let low = outline.iter().fold([f64::INFINITY; 2], |a, b| [a[0].min(b[0]), a[1].min(b[1])]);
    let high = outline.iter().fold([f64::NEG_INFINITY; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])]);
    let origin = Vector2::new(low[0] + (high[0] - low[0]) / 2.0, low[1] + (high[1] - low[1]) / 2.0);
    let mut total = ring(outline, origin);
    for hole in &plate.holes {
        let hole = ring(&hole.value, origin);
        total.area -= hole.area;
        total.first -= hole.first;
        for (sum, part) in total.second.iter_mut().zip(hole.second) {
            *sum -= part;
        }
    }
    total
}

/// Returns the moments of the region inside a closed line.
fn ring(vertices: &[[f64; 2]], origin: Vector2<f64>) -> Moments {
    let mut area = 0.0;
    let mut first = Vector2::zeros();
    let mut second = [0.0; 3];
    for (i, from) in vertices.iter().enumerate() {
        let a = Vector2::from(*from) - origin;
        let b = Vector2::from(vertices[(i + 1) % vertices.len()]) - origin;
        let cross = a.x * b.y - b.x * a.y;
        area += cross / 2.0;
        first += (a + b) * (cross / 6.0);
        second[0] += cross / 12.0 * (a.x * a.x + a.x * b.x + b.x * b.x);
        second[1] += cross / 12.0 * (a.y * a.y + a.y * b.y + b.y * b.y);
        second[2] += cross / 24.0 * (2.0 * a.x * a.y + a.x * b.y + b.x * a.y + 2.0 * b.x * b.y);
    }
    let turn = if area < 0.0 { -1.0 } else { 1.0 };
    let second = second.map(|moment| moment * turn);
    Moments { origin, area: area * turn, first: first * turn, second }
}

impl Moments {
    /// Returns the mass properties of the figure as a sheet of a layer.
    fn extrude(&self, layer: &Layer<'_>) -> MassProperties {
        if self.area == 0.0 {
            return MassProperties::ZERO;
        }
        let surface = layer.density * layer.thickness;
        let mass = surface * self.area;
        let d = self.first / self.area;
        let [xx, yy, xy] = self.second;
        let xx = surface * (xx - self.area * d.x * d.x);
        let yy = surface * (yy - self.area * d.y * d.y);
        let xy = surface * (xy - self.area * d.x * d.y);
        let zz = mass * layer.thickness * layer.thickness / 12.0;
        let middle = layer.bottom + layer.thickness / 2.0;
        MassProperties {
            mass,
            com: Vector3::new(self.origin.x + d.x, self.origin.y + d.y, middle),
            inertia: Matrix3::new(yy + zz, -xy, 0.0, -xy, xx + zz, 0.0, 0.0, 0.0, xx + yy),
        }
    }
}
