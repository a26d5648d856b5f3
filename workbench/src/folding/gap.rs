//! How far two triangles in space are apart.

use nalgebra::Vector3;

use super::contact::Triangle;

/// The edges of a triangle, by its corners.
const EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];
/// The sine of an angle between two directions below which their product is no axis.
const PARALLEL: f64 = 1e-9;

/// The distance of two triangles, m; where they pass through each other, minus the shortest way by which one comes apart from
/// the other.
///
/// Convex bodies are apart exactly if they are so along a normal of one of them or along the product of two of their edges
/// (S. Gottschalk, "Separating axis theorem", 1996); a flat triangle has normals of its edges in its plane, too.
pub fn gap(a: &Triangle, b: &Triangle) -> f64 {
    let apart = separation(a, b);
    if apart > 0.0 { distance(a, b) } else { apart }
}

/// The largest gap along an axis; negative if there is none.
fn separation(a: &Triangle, b: &Triangle) -> f64 {
    let edges = |of: &Triangle| EDGES.map(|[from, to]| of[to] - of[from]);
    let (of_a, of_b) = (edges(a), edges(b));
    let normals = [of_a[0].cross(&of_a[1]), of_b[0].cross(&of_b[1])];
    let across = of_a.iter().flat_map(|x| of_b.iter().map(move |y| (*x, *y)));
    let inside = of_a.iter().map(|x| (*x, normals[0])).chain(of_b.iter().map(|y| (*y, normals[1])));
    let products = across
        .chain(inside)
        .filter_map(|(x, y)| x.cross(&y).try_normalize(PARALLEL * x.norm() * y.norm()));
    let axes = normals.iter().filter_map(|normal| normal.try_normalize(0.0)).chain(products);
    axes.map(|axis| along(&axis, a, b)).fold(f64::NEG_INFINITY, f64::max)
}

/// The gap along an axis; negative where the triangles overlap along it.
fn along(axis: &Vector3<f64>, a: &Triangle, b: &Triangle) -> f64 {
    let span = |of: &Triangle| {
        let [x, y, z] = of.map(|corner| axis.dot(&corner));
        [x.min(y).min(z), x.max(y).max(z)]
    };
    let ([low, high], [least, greatest]) = (span(a), span(b));
    (least - high).max(low - greatest)
}

/// The distance of two triangles that are apart: of a corner from an edge or from an inside, or of two edges.
fn distance(a: &Triangle, b: &Triangle) -> f64 {
    let corners = [(a, b), (b, a)].into_iter().flat_map(|(of, other)| {
        of.iter().flat_map(move |corner| {
            let edges = EDGES.map(|[from, to]| to_edge(corner, other[from], other[to]));
            edges.into_iter().chain(to_inside(corner, other))
        })
    });
    let edges = EDGES.into_iter().flat_map(|[p, q]| {
        EDGES.into_iter().filter_map(move |[r, s]| between([a[p], a[q]], [b[r], b[s]]))
    });
    corners.chain(edges).fold(f64::INFINITY, f64::min)
}

/// The distance of a point from a line between two others.
fn to_edge(point: &Vector3<f64>, from: Vector3<f64>, to: Vector3<f64>) -> f64 {
    let edge = to - from;
    let share = (point - from).dot(&edge) / edge.norm_squared();
    (point - from - edge * share.clamp(0.0, 1.0)).norm()
}

/// The distance of a point from a triangle that it is above.
fn to_inside(point: &Vector3<f64>, [origin, b, c]: &Triangle) -> Option<f64> {
    let (x, y, z) = (b - origin, c - origin, point - origin);
    let normal = x.cross(&y);
    let area = normal.norm_squared();
    let shares = [z.cross(&y).dot(&normal) / area, x.cross(&z).dot(&normal) / area];
    let is_inside = shares.iter().all(|share| *share >= 0.0) && shares[0] + shares[1] <= 1.0;
    is_inside.then(|| z.dot(&normal).abs() / area.sqrt())
}

/// The distance of two lines between points, if the places that are nearest are between their ends.
fn between([a, b]: [Vector3<f64>; 2], [c, d]: [Vector3<f64>; 2]) -> Option<f64> {
    let (x, y, z) = (b - a, d - c, c - a);
    let normal = x.cross(&y);
    let square = normal.norm_squared();
    let places = [z.cross(&y).dot(&normal) / square, z.cross(&x).dot(&normal) / square];
    let is_between = places.iter().all(|place| (0.0..=1.0).contains(place));
    is_between.then(|| z.dot(&normal).abs() / square.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLAT: Triangle =
        [Vector3::new(0.0, 0.0, 0.0), Vector3::new(4.0, 0.0, 0.0), Vector3::new(0.0, 4.0, 0.0)];

    /// Turns and moves both, which must not matter.
    fn check(other: Triangle, expected: f64) {
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, -1.1, 2.0);
        let shift = Vector3::new(0.4, -2.0, 1.0);
        let [a, b] = [FLAT, other].map(|it| it.map(|corner| turn * corner + shift));
        for found in [gap(&a, &b), gap(&b, &a)] {
            assert!((found - expected).abs() < 1e-12, "{found} for {expected}");
        }
    }

    #[test]
    fn distances_of_triangles_that_are_apart() {
        let lifted = |by: f64| FLAT.map(|corner| corner + Vector3::new(0.0, 0.0, by));
        check(lifted(0.3), 0.3);
        // A corner above the inside, a corner beside a corner, and edges that cross.
        let spike = |x: f64, y: f64, z: f64| {
            [Vector3::new(x, y, z), Vector3::new(x, y, z + 3.0), Vector3::new(x + 0.5, y, z + 3.0)]
        };
        check(spike(1.0, 1.0, 0.25), 0.25);
        check(spike(7.0, -4.0, 0.0), 5.0);
        let beam = [
            Vector3::new(-1.0, 2.0, 0.5),
            Vector3::new(5.0, 2.0, 0.5),
            Vector3::new(2.0, 2.0, 4.0),
        ];
        check(beam, 0.5);
        // In one plane, beside the long edge.
        let beside = FLAT.map(|corner| Vector3::new(5.0, 5.0, 0.0) - corner * 0.25);
        check(beside, 5.0 * 2.0_f64.sqrt() - 2.0_f64.sqrt() * 0.5 - 2.0 * 2.0_f64.sqrt());
    }

    #[test]
    fn the_way_apart_of_triangles_that_cross() {
        // A spike through the inside comes out by its depth, which is less than the way to any edge.
        let spike = |depth: f64| {
            [
                Vector3::new(1.0, 1.0, -depth),
                Vector3::new(1.0, 1.0, 3.0),
                Vector3::new(1.2, 1.0, 3.0),
            ]
        };
        check(spike(0.1), -0.1);
        check(spike(0.01), -0.01);
    }
}
