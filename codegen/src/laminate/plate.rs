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
use num_traits::Zero;

use super::lift::{Lift, Values};
use super::mechanism::{Body, MassProperties, Sheet};
use super::number::Real;
use super::{air, check, outline};
use crate::source::{Diagnostics, Plate, Shape, SourceModel};

/// One sheet of the layup.
pub struct Layer<'a, T = f64> {
    /// Its material's name.
    pub material: &'a str,
    /// Height of its lower face, m.
    pub bottom: T,
    /// Thickness, m.
    pub thickness: T,
    /// Density, kg/m^3.
    pub density: T,
}

/// Returns the sheets of the layup, bottom (z = 0) to top.
pub fn stack(model: &SourceModel) -> impl Iterator<Item = Layer<'_>> {
    stack_of(model, &Values)
}

/// As [`stack`], in the numbers of a lift.
fn stack_of<'a, L: Lift>(
    model: &'a SourceModel,
    lift: &'a L,
) -> impl Iterator<Item = Layer<'a, L::Real>> {
    model.layup.iter().scan(L::Real::zero(), move |top, material| {
        let material = &model.materials[*material];
        let bottom = top.clone();
        let thickness = lift.number(&material.thickness, 0);
        *top += thickness.clone();
        let density = lift.number(&material.density, 0);
        Some(Layer { material: &material.name.value, bottom, thickness, density })
    })
}

/// Returns the mass properties of a body that has no mistakes.
pub fn mass_properties<L: Lift>(
    model: &SourceModel,
    source: &crate::source::Body,
    lift: &L,
) -> MassProperties<L::Real> {
    let mut parts = Vec::new();
    match &source.shape {
        Shape::None => {}
        Shape::Plates(layers) => {
            for (layer, plates) in stack_of(model, lift).zip(layers) {
                parts.extend(plates.iter().map(|plate| moments(plate, lift).extrude(&layer)));
            }
        }
        Shape::Rigid { mass, com, inertia } => {
            let given = Matrix3::from_fn(|i, j| inertia.value[i][j]);
            let inertia = (given + given.transpose()) / 2.0;
            parts.push(MassProperties {
                mass: lift.number(mass, 0),
                com: lift.point(com),
                inertia: inertia.map(L::Real::from),
            });
        }
    }
    for point in &source.point_masses {
        parts.push(MassProperties::point(lift.number(&point.mass, 0), lift.point(&point.at)));
    }
    MassProperties::sum(&parts)
}

/// Derives a body with its mass properties; errors of its geometry or mass go to `found`.
pub fn body(model: &SourceModel, source: &crate::source::Body, found: &mut Diagnostics) -> Body {
    let before = found.0.len();
    let mut sheets = Vec::new();
    match &source.shape {
        Shape::None => {}
        Shape::Plates(layers) => {
            for (layer, plates) in stack(model).zip(layers) {
                outline::check(plates, found);
                sheets.extend(plates.iter().map(|plate| sheet(plate, &layer)));
            }
        }
        Shape::Rigid { mass, inertia, .. } => {
            check::positive("mass", mass, "kg", found);
            let given = Matrix3::from_fn(|i, j| inertia.value[i][j]);
            check::rigid_inertia(&given, inertia.span, found);
        }
    }
    for point in &source.point_masses {
        check::positive("mass", &point.mass, "kg", found);
    }
    let mass_properties = mass_properties(model, source, &Values);
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
        point_masses: source.point_masses.iter().map(|point| point.at.value.into()).collect(),
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
pub struct Moments<T = f64> {
    /// The point, in the flat state, m.
    pub origin: Vector2<f64>,
    /// Area, m^2.
    pub area: T,
    /// Integral of (x, y) from the origin, m^3.
    pub first: Vector2<T>,
    /// Integrals of x^2, y^2, x y from the origin, m^4.
    pub second: [T; 3],
}

/// Moments of plates that do not overlap, about a point near the first.
pub fn area_moments(plates: &[Plate]) -> Moments {
    let mut parts = plates.iter().map(|plate| moments(plate, &Values));
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
fn moments<L: Lift>(plate: &Plate, lift: &L) -> Moments<L::Real> {
    let outline = &plate.outline.value;
    // The moments are about the middle of the bounding box, because digits would cancel far from
    // the drawing's origin.
    let low = outline.iter().fold([f64::INFINITY; 2], |a, b| [a[0].min(b[0]), a[1].min(b[1])]);
    let high = outline.iter().fold([f64::NEG_INFINITY; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])]);
    let origin = Vector2::new(low[0] + (high[0] - low[0]) / 2.0, low[1] + (high[1] - low[1]) / 2.0);
    let mut total = ring(&lift.vertices(&plate.outline), origin);
    for hole in &plate.holes {
        let hole = ring(&lift.vertices(hole), origin);
        total.area -= hole.area;
        total.first -= hole.first;
        for (sum, part) in total.second.iter_mut().zip(hole.second) {
            *sum -= part;
        }
    }
    total
}

/// Returns the moments of the region inside a closed line.
fn ring<T: Real>(vertices: &[Vector2<T>], origin: Vector2<f64>) -> Moments<T> {
    let origin_of_ring = origin.map(T::from);
    let mut area = T::zero();
    let mut first = Vector2::zeros();
    let mut second = [T::zero(), T::zero(), T::zero()];
    for (i, from) in vertices.iter().enumerate() {
        let a = from - &origin_of_ring;
        let b = &vertices[(i + 1) % vertices.len()] - &origin_of_ring;
        let ([[ax, ay]], [[bx, by]]) = (a.data.0.clone(), b.data.0.clone());
        let times = |x: &T, y: &T| x.clone() * y.clone();
        let cross = times(&ax, &by) - times(&bx, &ay);
        let share = |divisor: f64| cross.clone() / T::from(divisor);
        area += share(2.0);
        first += (a + b) * share(6.0);
        second[0] += share(12.0) * (times(&ax, &ax) + times(&ax, &bx) + times(&bx, &bx));
        second[1] += share(12.0) * (times(&ay, &ay) + times(&ay, &by) + times(&by, &by));
        let twice = |x: &T, y: &T| T::from(2.0) * x.clone() * y.clone();
        let mixed = twice(&ax, &ay) + times(&ax, &by) + times(&bx, &ay) + twice(&bx, &by);
        second[2] += share(24.0) * mixed;
    }
    let turn = T::from(if area.value() < 0.0 { -1.0 } else { 1.0 });
    let second = second.map(|moment| moment * turn.clone());
    Moments { origin, area: area * turn.clone(), first: first * turn, second }
}

impl<T: Real> Moments<T> {
    /// Returns the mass properties of the figure as a sheet of a layer.
    fn extrude(&self, layer: &Layer<'_, T>) -> MassProperties<T> {
        if self.area.is_zero() {
            return MassProperties::none();
        }
        let (thickness, area) = (&layer.thickness, &self.area);
        let surface = layer.density.clone() * thickness.clone();
        let mass = surface.clone() * area.clone();
        let d = &self.first / area.clone();
        let [[dx, dy]] = d.data.0.clone();
        let [xx, yy, xy] = self.second.clone();
        let central = |about: T, x: &T, y: &T| {
            surface.clone() * (about - area.clone() * x.clone() * y.clone())
        };
        let (xx, yy, xy) = (central(xx, &dx, &dx), central(yy, &dy, &dy), central(xy, &dx, &dy));
        let zz = mass.clone() * thickness.clone() * thickness.clone() / T::from(12.0);
        let middle = layer.bottom.clone() + thickness.clone() / T::from(2.0);
        let zero = T::zero;
        let [origin_x, origin_y] = [self.origin.x, self.origin.y].map(T::from);
        MassProperties {
            mass,
            com: Vector3::new(origin_x + dx, origin_y + dy, middle),
            inertia: Matrix3::from_row_slice(&[
                yy.clone() + zz.clone(),
                -xy.clone(),
                zero(),
                -xy,
                xx.clone() + zz,
                zero(),
                zero(),
                zero(),
                xx + yy,
            ]),
        }
    }
}
