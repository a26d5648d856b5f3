//! Splines: from the control points of a rational B-spline to those of its Bézier pieces.
//!
//! A control point of a piece is the polar form (blossom) of the spline at the ends of the piece, which de
//! Boor's algorithm evaluates with another argument in each round: L. Piegl, W. Tiller, The NURBS Book, 2nd
//! ed., section 5.3; L. Ramshaw, Blossoms are polar forms, 1989.

use crate::curve::Weighted;
use crate::limits;

/// A rational B-spline.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Spline {
    pub degree: usize,
    pub knots: Vec<f64>,
    /// Control points in homogeneous coordinates.
    pub points: Vec<Weighted>,
}

impl Spline {
    /// Says what is wrong with a spline that is none.
    pub(super) fn check(&self) -> Result<(), String> {
        let Spline { degree, knots, points } = self;
        if !(1..=limits::DEGREE).contains(degree) {
            return Err(format!("its degree is {degree}; lamc reads 1 to {}", limits::DEGREE));
        }
        if points.len() <= *degree {
            return Err(format!(
                "it has {} control points; degree {degree} needs more",
                points.len()
            ));
        }
        if knots.len() != points.len() + degree + 1 {
            let wanted = points.len() + degree + 1;
            return Err(format!(
                "it has {} knots instead of {wanted}, control points plus degree plus 1",
                knots.len()
            ));
        }
        if knots.windows(2).any(|w| w[0] > w[1]) {
            return Err("its knots decrease".into());
        }
        if points.iter().any(|p| p[2] <= 0.0) {
            return Err("it has a weight that is not positive".into());
        }
        Ok(())
    }

    /// The effort of [`Spline::pieces`], in steps of de Boor's algorithm.
    pub(super) fn work(&self) -> usize {
        self.points.len() * self.degree * self.degree
    }

    /// Returns its Bézier pieces, in order.
    pub(super) fn pieces(&self) -> impl Iterator<Item = Box<[Weighted]>> {
        (self.degree..self.points.len()).filter(|k| self.knots[*k] < self.knots[k + 1]).map(|k| {
            let point = |i| {
                let arguments = |round| {
                    if round <= self.degree - i { self.knots[k] } else { self.knots[k + 1] }
                };
                self.blossom(k, arguments)
            };
            (0..=self.degree).map(point).collect()
        })
    }

    /// The polar form on the span that begins with knot `k`, with one argument for each round from 1.
    fn blossom(&self, k: usize, arguments: impl Fn(usize) -> f64) -> Weighted {
        let p = self.degree;
        let mut points = self.points[k - p..=k].to_vec();
        for round in 1..=p {
            let u = arguments(round);
            for j in (round..=p).rev() {
                let (low, high) = (self.knots[k - p + j], self.knots[k + 1 + j - round]);
                let share = (u - low) / (high - low);
                points[j] = std::array::from_fn(|i| {
                    (1.0 - share) * points[j - 1][i] + share * points[j][i]
                });
            }
        }
        points[p]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spline(degree: usize, knots: &[f64], points: &[Weighted]) -> Spline {
        Spline { degree, knots: knots.to_vec(), points: points.to_vec() }
    }

    #[test]
    fn a_bezier_curve_is_its_own_piece() {
        let points = [[0.1, 0.2, 1.0], [0.3, 5.0, 1.0], [7.0, 1.0, 1.0], [2.0, 0.7, 1.0]];
        let whole = spline(3, &[0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], &points);
        assert_eq!(whole.check(), Ok(()));
        let pieces: Vec<_> = whole.pieces().collect();
        assert_eq!(pieces, [Box::from(points)]);
    }

    /// A full circle as a quadratic spline with weights; every point of its pieces must be on the circle.
    #[test]
    fn a_circle_of_a_rational_spline_is_round() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let corners = [
            [1.0, 0.0],
            [1.0, 1.0],
            [0.0, 1.0],
            [-1.0, 1.0],
            [-1.0, 0.0],
            [-1.0, -1.0],
            [0.0, -1.0],
            [1.0, -1.0],
            [1.0, 0.0],
        ];
        let weighted = |(i, [x, y]): (usize, [f64; 2])| {
            if i % 2 == 0 { [x, y, 1.0] } else { [x * half, y * half, half] }
        };
        let points: Vec<_> = corners.into_iter().enumerate().map(weighted).collect();
        let circle =
            spline(2, &[0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0, 4.0], &points);
        assert_eq!(circle.check(), Ok(()));
        let mut pieces = 0;
        for piece in circle.pieces() {
            pieces += 1;
            for t in [0.0, 0.2, 0.5, 0.9, 1.0] {
                let b = [(1.0 - t) * (1.0 - t), 2.0 * t * (1.0 - t), t * t];
                let at: Weighted = std::array::from_fn(|i| {
                    b[0] * piece[0][i] + b[1] * piece[1][i] + b[2] * piece[2][i]
                });
                let radius = (at[0] * at[0] + at[1] * at[1]).sqrt() / at[2];
                assert!((radius - 1.0).abs() < 1e-15, "{radius}");
            }
        }
        assert_eq!(pieces, 4);
    }

    /// Basis functions by the recursion of Cox and de Boor, independent of polar forms.
    fn basis(knots: &[f64], i: usize, p: usize, u: f64) -> f64 {
        if p == 0 {
            return f64::from(u8::from(knots[i] <= u && u < knots[i + 1]));
        }
        let part = |a: f64, b: f64, n: f64| if b > a { n * (u - a) / (b - a) } else { 0.0 };
        let rest = |a: f64, b: f64, n: f64| if b > a { n * (b - u) / (b - a) } else { 0.0 };
        part(knots[i], knots[i + p], basis(knots, i, p - 1, u))
            + rest(knots[i + 1], knots[i + p + 1], basis(knots, i + 1, p - 1, u))
    }

    #[test]
    fn pieces_follow_the_basis_functions() {
        let knots = [0.0, 0.0, 0.0, 0.0, 0.3, 1.0, 1.0, 2.5, 3.0, 3.0, 3.0, 3.0];
        let points: Vec<Weighted> =
            (0..8_i32).map(|i| [f64::from(i * i % 5), f64::from(i * 3 % 7), 1.0]).collect();
        let whole = spline(3, &knots, &points);
        assert_eq!(whole.check(), Ok(()));
        let spans = [(0.0, 0.3), (0.3, 1.0), (1.0, 2.5), (2.5, 3.0)];
        let pieces: Vec<_> = whole.pieces().collect();
        assert_eq!(pieces.len(), spans.len());
        for (piece, (low, high)) in pieces.iter().zip(spans) {
            for t in [0.0, 0.25, 0.5, 0.75] {
                let (s, u) = (1.0 - t, low + (high - low) * t);
                let b = [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t];
                for c in 0..3 {
                    let by_piece: f64 = (0..4).map(|i| b[i] * piece[i][c]).sum();
                    let by_basis: f64 = (0..8).map(|i| basis(&knots, i, 3, u) * points[i][c]).sum();
                    assert!(
                        (by_piece - by_basis).abs() < 1e-12,
                        "{by_piece} is not {by_basis} at {u}"
                    );
                }
            }
        }
    }

    #[test]
    fn what_is_no_spline_is_named() {
        let points = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0]];
        let check = |degree, knots: &[f64], points: &[Weighted], what: &str| {
            let reason = spline(degree, knots, points).check().unwrap_err();
            assert!(reason.contains(what), "{reason} is not about {what}");
        };
        check(0, &[], &points, "degree");
        check(30, &[], &points, "degree");
        check(3, &[0.0; 7], &points, "control points");
        check(2, &[0.0; 5], &points, "knots");
        check(2, &[0.0, 0.0, 0.0, 1.0, 1.0, 0.5], &points, "decrease");
        check(2, &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0], &points.map(|p| [p[0], p[1], 0.0]), "weight");
    }
}
