//! Test whether a point lies within the convex hull of other points.
//!
//! The point lies within the hull if it is a weighted mean of the others, sum c_i p_i = p, sum c_i
//! = 1, c_i >= 0: a least-squares problem with non-negative weights (C. L. Lawson, R. J. Hanson,
//! "Solving Least Squares Problems", 1974, chapter 23).

use nalgebra::{DMatrix, DVector};

/// Tolerance for rounding, relative to the range of the coordinates.
const ROUNDING: f64 = 1e-7;

/// Returns whether `at` lies within the hull of `points` or on its boundary.
pub fn contains<const K: usize>(points: &[[f64; K]], at: [f64; K]) -> bool {
    let of = |k: usize| points.iter().map(move |point| point[k]);
    // Each coordinate is divided by its range or, if the range is zero, by its magnitude.
    let scale: [f64; K] = std::array::from_fn(|k| {
        let range = of(k).fold(f64::MIN, f64::max) - of(k).fold(f64::MAX, f64::min);
        let size = of(k).fold(at[k].abs(), |most, x| most.max(x.abs()));
        if range > ROUNDING * size { range } else { size.max(f64::MIN_POSITIVE) }
    });
    let a = DMatrix::from_fn(K + 1, points.len(), |k, i| match k {
        k if k < K => (points[i][k] - at[k]) / scale[k],
        _ => 1.0,
    });
    let mut b = DVector::zeros(K + 1);
    b[K] = 1.0;
    nonnegative(&a, &b) <= ROUNDING
}

/// Returns the minimum of |A c - b| over c >= 0.
fn nonnegative(a: &DMatrix<f64>, b: &DVector<f64>) -> f64 {
    let n = a.ncols();
    let mut c = DVector::zeros(n);
    let mut free: Vec<usize> = Vec::new();
    // Every iteration frees a weight and lowers the residual. Further iterations would only follow
    // rounding errors.
    for _ in 0..10 * (n + 1) {
        let gradient = a.transpose() * (b - a * &c);
        let best = (0..n)
            .filter(|i| !free.contains(i))
            .max_by(|i, j| gradient[*i].total_cmp(&gradient[*j]))
            .filter(|i| gradient[*i] > ROUNDING * ROUNDING);
        let Some(best) = best else { break };
        free.push(best);
        loop {
            let columns = a.select_columns(&free);
            let Ok(wanted) = columns.svd(true, true).solve(b, 1e-12) else { return f64::INFINITY };
            // The step towards the solution is limited so that all weights stay positive.
            let mut step = 1.0_f64;
            for (place, &i) in free.iter().enumerate() {
                if wanted[place] <= 0.0 {
                    step = step.min(c[i] / (c[i] - wanted[place]).max(f64::MIN_POSITIVE));
                }
            }
            for (place, &i) in free.iter().enumerate() {
                c[i] += step * (wanted[place] - c[i]);
            }
            if step >= 1.0 {
                break;
            }
            for &i in &free {
                if c[i] <= 1e-14 {
                    c[i] = 0.0;
                }
            }
            free.retain(|&i| c[i] > 0.0);
            if free.is_empty() {
                break;
            }
        }
    }
    (a * c - b).norm()
}

#[cfg(test)]
mod tests {
    use super::contains;

    #[test]
    fn a_square_and_what_is_around_it() {
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [1.0, 1.0]];
        for (at, inside) in [
            ([1.0, 1.0], true),
            ([0.01, 1.99], true),
            ([0.0, 0.0], true),
            ([2.0, 1.0], true),
            ([2.01, 1.0], false),
            ([-0.01, -0.01], false),
            ([1.0, 2.5], false),
        ] {
            assert_eq!(contains(&square, at), inside, "{at:?}");
        }
    }

    /// Simplices: inside where all barycentric coordinates are positive.
    #[test]
    fn tetrahedra_by_barycentric_coordinates() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1e-3]];
        let mut counts = [0, 0];
        for i in 0..1000_u32 {
            // A low-discrepancy sequence (M. Roberts).
            let [x, y, z] = [0.8191725134, 0.6710436067, 0.5497004779]
                .map(|step: f64| (0.5 + step * f64::from(i)).fract());
            let rest = 1.0 - x - y - z;
            if rest.abs() < 1e-6 {
                continue;
            }
            let inside = contains(&corners, [x, 2.0 * y, 1e-3 * z]);
            assert_eq!(inside, rest > 0.0, "{x} {y} {z}");
            counts[usize::from(inside)] += 1;
        }
        assert!(counts[0] > 100 && counts[1] > 100, "{counts:?}");
    }

    /// Specimens that differ in one dimension only.
    #[test]
    fn a_line_of_points() {
        let line = [[1e-3, 0.05], [2e-3, 0.05], [4e-3, 0.05]];
        assert!(contains(&line, [3e-3, 0.05]));
        assert!(!contains(&line, [5e-3, 0.05]));
        assert!(!contains(&line, [3e-3, 0.051]));
    }
}
