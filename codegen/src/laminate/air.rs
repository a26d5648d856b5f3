//! Air drag on plates: density drag |v| v / 2 per area against the speed v along the normal.
//!
//! The area A of a body's plates, seen along the normal of the sheet, is replaced by four points
//! with a quarter of A each, at the centroid +- r1 e1 +- r2 e2, where e1, e2 are the principal axes
//! of the area and r^2 = (second moment) / A. The points have the same moments as the area up to
//! the second order (for a rectangle up to the third: they are the points of Gauss-Legendre
//! quadrature), and v is linear in the position. If v has the same sign everywhere, the force is
//! exact, and for a rectangle its moment too.

use nalgebra::{Matrix2, Vector3};

use super::mechanism::{Air, SurfacePoint};
use super::{check, outline, plate};
use crate::source::Plate;

/// The air.
pub fn air(air: &crate::source::Air) -> Air {
    Air { density: air.density.value.clone(), drag: air.drag.value.clone() }
}

/// Returns the points that replace the area of valid plates.
pub fn surface(layers: &[Vec<Plate>]) -> Vec<SurfacePoint> {
    let seen = outline::silhouette(layers);
    let moments = plate::area_moments(&seen);
    if !(moments.area > 0.0 && check::all_finite(&moments.second)) {
        return Vec::new();
    }
    let centroid = moments.first / moments.area;
    let [xx, yy, xy] = moments.second.map(|moment| moment / moments.area);
    let spread = Matrix2::new(
        xx - centroid.x * centroid.x,
        xy - centroid.x * centroid.y,
        xy - centroid.x * centroid.y,
        yy - centroid.y * centroid.y,
    );
    let principal = spread.symmetric_eigen();
    let arm =
        |k: usize| principal.eigenvectors.column(k) * principal.eigenvalues[k].max(0.0).sqrt();
    let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)];
    let point = |(i, j): (f64, f64)| {
        let at = moments.origin + centroid + arm(0) * i + arm(1) * j;
        SurfacePoint { at: Vector3::new(at.x, at.y, 0.0), area: moments.area / 4.0 }
    };
    corners.map(point).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laminate::tests::plate;

    /// Quarters of a rectangle of 40 mm x 20 mm at (10, 5) mm, in two layers of which one has a
    /// hole: the points of Gauss and Legendre, which hold third moments too; to the digits of the
    /// union.
    #[test]
    fn a_rectangle_has_the_points_of_gauss() {
        let outline = [[0.01, 0.005], [0.05, 0.005], [0.05, 0.025], [0.01, 0.025]];
        let hole = [[0.02, 0.01], [0.03, 0.01], [0.03, 0.02]];
        let layers = [vec![plate(&outline, &[&hole])], vec![plate(&outline, &[])]];
        let mut points = surface(&layers);
        points.sort_by(|a, b| a.at.x.total_cmp(&b.at.x).then(a.at.y.total_cmp(&b.at.y)));
        let (rx, ry) = (0.02 / 3.0_f64.sqrt(), 0.01 / 3.0_f64.sqrt());
        let expected =
            [(-rx, -ry), (-rx, ry), (rx, -ry), (rx, ry)].map(|(x, y)| (0.03 + x, 0.015 + y));
        for (point, (x, y)) in points.iter().zip(expected) {
            assert!((point.at - Vector3::new(x, y, 0.0)).norm() < 1e-9 * 0.04, "{point:?}");
            assert!((point.area - 2e-4).abs() < 1e-9 * 2e-4);
        }
    }

    /// An L: area, first and second moments as integrals over its two rectangles.
    #[test]
    fn any_outline_keeps_its_moments() {
        let outline = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        let points = surface(&[vec![plate(&outline, &[])]]);
        let sum = |of: fn(f64, f64) -> f64| -> f64 {
            points.iter().map(|point| point.area * of(point.at.x, point.at.y)).sum()
        };
        // [0, 3] x [0, 1] and [0, 1] x [1, 2].
        type Integrand = fn(f64, f64) -> f64;
        let cases: [(Integrand, f64); 6] = [
            (|_, _| 1.0, 3.0 + 1.0),
            (|x, _| x, 4.5 + 0.5),
            (|_, y| y, 1.5 + 1.5),
            (|x, _| x * x, 9.0 + 1.0 / 3.0),
            (|_, y| y * y, 1.0 + 7.0 / 3.0),
            (|x, y| x * y, 2.25 + 0.75),
        ];
        for (of, expected) in cases {
            assert!((sum(of) - expected).abs() < 1e-12, "{} is not {expected}", sum(of));
        }
    }
}
