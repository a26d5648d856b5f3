//! The surface of a body: its sheets, or an ellipsoid for a mass without shape.

use nalgebra::{Matrix3, Vector3};

use super::mesh::Mesh;
use super::palette::{MASS, Rgb, grounded};
use lamc::laminate::{Body, MassProperties};

/// The half axes of a mass without extent, as a share of the mechanism's size.
const DOT: f64 = 0.012;
/// The width of the rods that connect a mass with its hinges, as a share of the same size.
const ROD: f64 = 0.008;

/// Returns the sheets of a body. If it has none, the ellipsoid of its inertia with rods to the middles of its
/// hinges. Point masses are dots.
pub fn mesh(body: &Body, hinges: &[Vector3<f64>], materials: &[(String, Rgb)], size: f64) -> Mesh {
    let mut mesh = Mesh::default();
    for sheet in &body.sheets {
        let known = materials.iter().find(|(name, _)| *name == sheet.material);
        let color = known.map_or(MASS, |(_, color)| *color);
        mesh.add_sheet(sheet, if body.fixed { grounded(color) } else { color });
    }
    let dot = DOT * size;
    let mass = &body.mass_properties;
    if body.sheets.is_empty() && mass.mass > 0.0 {
        mesh.add_ellipsoid(&mass.com, &half_axes(mass, dot), MASS);
        for hinge in hinges {
            mesh.add_rod(hinge, &mass.com, ROD * size, MASS);
        }
    }
    for at in &body.point_masses {
        mesh.add_ellipsoid(at, &(Matrix3::identity() * dot), MASS);
    }
    mesh
}

/// Half axes of the homogeneous ellipsoid with these mass properties, as columns, right-handed,
/// none shorter than `least`: `a_i^2 = 5 / (2 m) (I_j + I_k - I_i)` of the principal moments.
fn half_axes(body: &MassProperties, least: f64) -> Matrix3<f64> {
    let principal = body.inertia.symmetric_eigen();
    let mut directions = principal.eigenvectors;
    if directions.determinant() < 0.0 {
        directions.column_mut(0).neg_mut();
    }
    let moments = principal.eigenvalues;
    let square = moments.map(|moment| 2.5 / body.mass * (moments.sum() - 2.0 * moment));
    let lengths = square.map(|square| square.max(0.0).sqrt().max(least));
    directions * Matrix3::from_diagonal(&lengths)
}
