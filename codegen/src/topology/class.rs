//! Classes of loops (planar, spherical, spatial), and the points and directions of their closure
//! equations.
//!
//! Parallel hinge lines allow three relative motions (planar), lines through one point three
//! rotations (spherical): three closure rows are then equivalent to all nine. A loop whose hinge
//! lines are almost, but not exactly, parallel or concurrent jams or breaks its hinges, so it is
//! reported.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::graph::{LoopClass, Row};
use crate::arithmetic::{asin, larger, largest};
use crate::laminate::{Joint, Mechanism};
use crate::source::codes;
use crate::source::{Diagnostic, JointId};

/// Largest sine of the angle between lines that count as parallel.
pub(super) const PARALLEL: f64 = 1e-12;
/// Largest distance of lines that count as concurrent, relative to the mechanism's size.
pub(super) const CONCURRENT: f64 = 1e-10;
/// Deviations up to this, in rad or relative to the loop's extent, are regarded as drawing errors.
const NEAR: f64 = 1e-2;

/// Points, directions and rows of a loop's closure equations; see [`super::Loop`].
pub struct Writing {
    pub points: [Vector3<f64>; 3],
    pub frame: Matrix3<f64>,
    pub rows: Vec<Row>,
}

/// The hinges around a loop, the closing one first.
pub struct HingeLines<'a> {
    hinges: Vec<&'a Joint>,
    size: f64,
}

impl<'a> HingeLines<'a> {
    /// Returns the hinge lines of these joints.
    pub fn new(mechanism: &'a Mechanism, joints: &[JointId]) -> Self {
        let hinges = joints.iter().map(|joint| &mechanism.joints[joint.index()]).collect();
        Self { hinges, size: mechanism.size }
    }

    /// Returns the class of the lines in the flat state.
    pub fn class(&self) -> LoopClass {
        let normal = self.hinges[0].direction;
        if self.hinges.iter().all(|hinge| angle(hinge.direction, normal) <= PARALLEL) {
            return LoopClass::Planar { normal };
        }
        match nearest_point(&self.hinges) {
            Some(centre) if miss(&self.hinges, &centre) <= CONCURRENT * self.size => {
                LoopClass::Spherical { centre: self.drawn_point(centre) }
            }
            _ => LoopClass::Spatial,
        }
    }

    /// Returns the end of a hinge line at a computed point, if there is one, because it has no
    /// rounding error.
    fn drawn_point(&self, computed: Vector3<f64>) -> Vector3<f64> {
        let ends = self.hinges.iter().flat_map(|hinge| ends(hinge));
        let mut near = ends.filter(|end| (end - computed).norm() <= PARALLEL * self.size);
        near.next().unwrap_or(computed)
    }

    /// Returns half the diagonal of the box around the hinge lines, m. With this length, rotations
    /// and translations of the cut body have similar weights.
    fn length(&self) -> f64 {
        let (mut low, mut high) = (self.hinges[0].point, self.hinges[0].point);
        for end in self.hinges.iter().flat_map(|hinge| ends(hinge)) {
            (low, high) = (low.inf(&end), high.sup(&end));
        }
        ((high - low).norm() / 2.0).max(1e-9 * self.size)
    }

    /// Returns a remark on a planar loop whose longest link is as long as the others together.
    pub fn locked_by_length(&self) -> Option<String> {
        let n = self.hinges.len();
        let links = (0..n).map(|i| distance(self.hinges[i], &self.hinges[(i + 1) % n].point));
        let (sum, longest) = links.fold((0.0, 0.0_f64), |(s, l), link| (s + link, l.max(link)));
        let planar = matches!(self.class(), LoopClass::Planar { .. });
        (planar && longest > 0.0 && 2.0 * longest >= sum * (1.0 - 1e-9)).then(|| {
            let length = millimetres(longest);
            format!("its longest link, {length}, is as long as the others together")
        })
    }

    /// Returns the points and rows of the closure equations of a loop of this class; `sense` is the
    /// ghost's.
    pub fn writing(&self, class: &LoopClass, sense: f64) -> Writing {
        let closing = self.hinges[0];
        let (origin, rows): (_, &[(usize, usize)]) = match class {
            // The normal is z; P1 moves in the plane and P2 across.
            LoopClass::Planar { .. } => (closing.point, &[(0, 0), (0, 1), (1, 1)]),
            // P1 stays; P2 and P3 turn about it.
            LoopClass::Spherical { centre } => (*centre, &[(1, 1), (1, 2), (2, 2)]),
            LoopClass::Spatial => {
                (closing.point, &[(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)])
            }
        };
        let (points, frame) = class.places(&(closing.direction * sense), &origin, self.length());
        Writing {
            points,
            frame,
            rows: rows.iter().map(|(point, axis)| Row { point: *point, axis: *axis }).collect(),
        }
    }

    /// Warns of a spatial loop that is almost planar, spherical or in line.
    pub fn near_miss(&self, class: &LoopClass) -> Option<Diagnostic> {
        let n = self.hinges.len();
        let extent = 2.0 * self.length();
        let closing = self.hinges[0];
        let warn = |miss: String, worst: &Joint, hint: &str| {
            let (loop_of, name) = (&closing.name, &worst.name);
            let message = format!("the loop closed by `{loop_of}` misses {miss}, by `{name}`");
            Some(
                Diagnostic::warning(codes::NEAR_MISS, worst.span, message)
                    .label("this hinge line deviates most")
                    .hint(hint),
            )
        };
        if n == 2 {
            // Two hinges between the same two bodies can turn only if they are in line.
            let [a, b] = [self.hinges[0], self.hinges[1]];
            let turn = angle(a.direction, b.direction);
            let shift = larger(distance(a, &b.point), distance(a, &ends(b)[1]));
            let exact = turn <= PARALLEL && shift <= CONCURRENT * self.size;
            if !exact && turn <= NEAR && shift <= NEAR * extent {
                let miss = format!("being one hinge line by {}", millimetres(shift));
                return warn(miss, b, "give both hinges points on the same line");
            }
            return None;
        }
        if !matches!(class, LoopClass::Spatial) || n < 4 {
            return None;
        }
        let (odd, off) = odd_one_out(n, |i, others| {
            let direction = self.hinges[others[0]].direction;
            let worst = others.iter().map(|k| angle(self.hinges[*k].direction, direction));
            Some((largest(worst), angle(self.hinges[i].direction, direction)))
        })?;
        let spread =
            self.hinges.iter().map(|h| angle(h.direction, self.hinges[(odd + 1) % n].direction));
        if largest(spread) <= NEAR {
            let miss = format!("being planar by {:.3e} deg", off.to_degrees());
            return warn(
                miss,
                self.hinges[odd],
                "draw all hinge lines of a planar loop parallel; if they are not parallel \
                 because of rounding, give the rounding error as `tolerance`",
            );
        }
        let (odd, off) = odd_one_out(n, |i, others| {
            let others: Vec<_> = others.iter().map(|k| self.hinges[*k]).collect();
            let centre = nearest_point(&others)?;
            Some((miss(&others, &centre), distance(self.hinges[i], &centre)))
        })?;
        let centre = nearest_point(&self.hinges)?;
        if miss(&self.hinges, &centre) <= NEAR * extent {
            let miss = format!("being spherical by {}", millimetres(off));
            let hint = "draw all hinge lines of a spherical loop through one point; if they miss \
                        the point because of rounding, give the rounding error as `tolerance`";
            return warn(miss, self.hinges[odd], hint);
        }
        None
    }
}

pub(super) fn millimetres(length: f64) -> String {
    let length = length * 1e3;
    if length < 1e-3 { format!("{length:.3e} mm") } else { format!("{length:.3} mm") }
}

pub(super) fn ends(hinge: &Joint) -> [Vector3<f64>; 2] {
    [hinge.point, hinge.point + hinge.direction * hinge.length]
}

/// Returns the sine of the angle between two lines, whatever their sense. All lines lie flat, so
/// the cross product is along z.
pub(super) fn angle(a: Vector3<f64>, b: Vector3<f64>) -> f64 {
    asin(a.cross(&b).norm().min(1.0))
}

/// Returns the distance of a point from a hinge line.
pub(super) fn distance(hinge: &Joint, point: &Vector3<f64>) -> f64 {
    (point - hinge.point).cross(&hinge.direction).norm()
}

/// Returns the largest distance of the lines from a point.
pub(super) fn miss(hinges: &[&Joint], point: &Vector3<f64>) -> f64 {
    largest(hinges.iter().map(|hinge| distance(hinge, point)))
}

/// Returns the point nearest to all lines: sum (1 - d d^T) (x - p) = 0, which for flat lines
/// separates into a problem in the plane and the mean height. `None` for parallel lines.
pub(super) fn nearest_point(hinges: &[&Joint]) -> Option<Vector3<f64>> {
    // Positions are relative to one of the lines to keep digits.
    let near = hinges[0].point;
    let (mut matrix, mut right, mut height) = (Matrix2::zeros(), Vector2::zeros(), 0.0);
    for hinge in hinges {
        let across = Vector2::new(-hinge.direction.y, hinge.direction.x);
        let offset = hinge.point - near;
        matrix += across * across.transpose();
        right += across * across.dot(&offset.xy());
        height += offset.z / hinges.len() as f64;
    }
    // The trace is the number of lines, so the determinant is compared with 1.
    if matrix.determinant() <= PARALLEL * PARALLEL {
        return None;
    }
    let plane = matrix.try_inverse()? * right;
    Some(near + Vector3::new(plane.x, plane.y, height))
}

/// Returns the member without which the others agree best, and its deviation. `judge(i, others)`
/// gives the disagreement of the others and the deviation of i from them.
fn odd_one_out(
    n: usize,
    judge: impl Fn(usize, &[usize]) -> Option<(f64, f64)>,
) -> Option<(usize, f64)> {
    let judged = (0..n).filter_map(|i| {
        let others: Vec<usize> = (0..n).filter(|k| *k != i).collect();
        judge(i, &others).map(|(disagreement, off)| (i, disagreement, off))
    });
    judged.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _, off)| (i, off))
}
