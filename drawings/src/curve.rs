//! Curves as straight lines within a tolerance.
//!
//! A Bézier curve lies in the convex hull of its control points. It is halved by de Casteljau's algorithm until
//! this hull is not further from the chord than the tolerance. The halves of a reversed curve have the same
//! bits, so that a crease which is drawn twice in opposite directions stays one crease. An arc of an ellipse is
//! divided evenly in its eccentric anomaly: with steps of `d`, the chord is within `s (1 - cos(d / 2))`, which
//! is `2 s sin(d / 4)^2`, of the arc, where `s` is the longer semi-axis. Sines come from libm, whose bits are the same on every machine.

/// A point or a vector of the plane.
pub(crate) type Point = [f64; 2];

/// A control point in homogeneous coordinates: `w x`, `w y` and the weight `w`, which is positive.
pub(crate) type Weighted = [f64; 3];

/// A curve.
#[derive(Clone, Debug)]
pub(crate) enum Curve {
    /// A cubic Bézier curve.
    Cubic([Point; 4]),
    /// A rational Bézier curve of any degree.
    Rational(Box<[Weighted]>),
    /// An arc of an ellipse.
    Arc(Box<Arc>),
}

/// The arc `centre + axes[0] cos(t) + axes[1] sin(t)`, with `t` from `from` to `from + sweep`, rad.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arc {
    /// Its centre.
    pub centre: Point,
    /// Two conjugate semi-axes.
    pub axes: [Point; 2],
    /// The parameter of its first end, rad.
    pub from: f64,
    /// How far it goes, rad; positive from `axes[0]` to `axes[1]`.
    pub sweep: f64,
    /// Its ends as the file writes them.
    pub ends: [Point; 2],
}

/// Halvings of a Bézier curve, at most: a million pieces.
const HALVINGS: usize = 20;

/// The longest step of an arc: a circle has at least eight corners, however small it is.
const STEP: f64 = std::f64::consts::FRAC_PI_4;

impl Curve {
    /// A quadratic Bézier curve, as a cubic one.
    pub(crate) fn quadratic([a, b, c]: [Point; 3]) -> Curve {
        let near = |end: Point| [(end[0] + 2.0 * b[0]) / 3.0, (end[1] + 2.0 * b[1]) / 3.0];
        Curve::Cubic([a, near(a), near(c), c])
    }

    /// Returns the first point.
    pub(crate) fn start(&self) -> Point {
        match self {
            Curve::Cubic(points) => points[0],
            Curve::Rational(points) => points.first().map_or([0.0; 2], |p| plain(*p)),
            Curve::Arc(arc) => arc.ends[0],
        }
    }

    /// Calls `out` with points around the curve: it lies within their bounding box.
    pub(crate) fn bounds(&self, mut out: impl FnMut(Point)) {
        match self {
            Curve::Cubic(points) => points.iter().for_each(|p| out(*p)),
            Curve::Rational(points) => points.iter().for_each(|p| out(plain(*p))),
            Curve::Arc(arc) => arc.bounds(out),
        }
    }

    /// Calls `out` with the points after the first one, the last one as the file writes it. Ends early if `out`
    /// returns an error.
    pub(crate) fn flatten<E>(
        &self,
        flatness: f64,
        out: &mut impl FnMut(Point) -> Result<(), E>,
    ) -> Result<(), E> {
        match self {
            Curve::Cubic(points) => {
                halve(&points.map(|p| [p[0], p[1], 1.0]), flatness, HALVINGS, out)
            }
            Curve::Rational(points) => halve(points, flatness, HALVINGS, out),
            Curve::Arc(arc) => arc.flatten(flatness, out),
        }
    }
}

impl Arc {
    /// The ends, and the extreme points between them. Also the centre or the size of the ellipse if it is not a
    /// finite number, so that it is refused as a coordinate is.
    fn bounds(&self, mut out: impl FnMut(Point)) {
        self.ends.iter().for_each(|p| out(*p));
        let [a, b] = self.axes;
        let longer = longer_axis(self.axes);
        if !(longer + self.centre[0] + self.centre[1]).is_finite() {
            return out([longer + self.centre[0], longer + self.centre[1]]);
        }
        for i in 0..2 {
            let extreme = libm::atan2(b[i], a[i]);
            for turns in -4..=4 {
                let t = extreme + f64::from(turns) * std::f64::consts::PI;
                let along = (t - self.from.rem_euclid(std::f64::consts::TAU)) * self.sweep.signum();
                if (0.0..=self.sweep.abs()).contains(&along) {
                    let (sine, cosine) = libm::sincos(t);
                    out([0, 1].map(|k| self.centre[k] + a[k] * cosine + b[k] * sine));
                }
            }
        }
    }

    fn flatten<E>(
        &self,
        flatness: f64,
        out: &mut impl FnMut(Point) -> Result<(), E>,
    ) -> Result<(), E> {
        // `min` turns the NaN of an arc without size into 1. The arc cosine of 1 - s would be 0 below 1e-16: an
        // almost straight arc of a huge circle would have steps without end.
        let sagitta = (flatness / longer_axis(self.axes)).min(1.0);
        let step = (4.0 * libm::asin((0.5 * sagitta).sqrt())).clamp(f64::MIN_POSITIVE, STEP);
        let steps = (self.sweep.abs() / step).ceil().max(1.0);
        let mut k = 1.0;
        while k < steps {
            let (sine, cosine) = libm::sincos(self.from + self.sweep * (k / steps));
            let [a, b] = self.axes;
            out([
                self.centre[0] + a[0] * cosine + b[0] * sine,
                self.centre[1] + a[1] * cosine + b[1] * sine,
            ])?;
            k += 1.0;
        }
        out(self.ends[1])
    }
}

/// The longer semi-axis of the ellipse with two conjugate semi-axes: the larger singular value of their matrix.
fn longer_axis(axes: [Point; 2]) -> f64 {
    // Over the largest component, so that squares neither overflow nor vanish.
    let scale = axes.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    if scale == 0.0 || axes.iter().flatten().any(|x| !x.is_finite()) {
        return axes.iter().flatten().sum();
    }
    let [a, b] = axes.map(|axis| axis.map(|x| x / scale));
    let (aa, bb, ab) = (dot(a, a), dot(b, b), dot(a, b));
    let spread = (0.25 * (aa - bb) * (aa - bb) + ab * ab).sqrt();
    scale * (0.5 * (aa + bb) + spread).sqrt()
}

fn halve<E>(
    points: &[Weighted],
    flatness: f64,
    halvings: usize,
    out: &mut impl FnMut(Point) -> Result<(), E>,
) -> Result<(), E> {
    let (Some(first), Some(last)) = (points.first(), points.last()) else { return Ok(()) };
    if halvings == 0 || is_flat(plain(*first), plain(*last), points, flatness) {
        return out(plain(*last));
    }
    let mut right = points.to_vec();
    let mut left = Vec::with_capacity(points.len());
    for known in (1..=points.len()).rev() {
        left.push(right[0]);
        for i in 0..known - 1 {
            right[i] = middle(right[i], right[i + 1]);
        }
    }
    // The last entries of each round are the right half, from its start to its end.
    halve(&left, flatness, halvings - 1, out)?;
    halve(&right, flatness, halvings - 1, out)
}

/// Whether all points are within `flatness` of the chord, and none is before its start or after its end by
/// more.
fn is_flat(first: Point, last: Point, points: &[Weighted], flatness: f64) -> bool {
    let chord = minus(last, first);
    let length = dot(chord, chord).sqrt();
    points.iter().all(|p| {
        let from_start = minus(plain(*p), first);
        if length <= flatness {
            return dot(from_start, from_start).sqrt() <= flatness;
        }
        let along = dot(from_start, chord) / length;
        let across = (chord[0] * from_start[1] - chord[1] * from_start[0]) / length;
        across.abs() <= flatness && along >= -flatness && along <= length + flatness
    })
}

fn plain(p: Weighted) -> Point {
    [p[0] / p[2], p[1] / p[2]]
}

fn middle(a: Weighted, b: Weighted) -> Weighted {
    [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2])]
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(curve: &Curve, flatness: f64) -> Vec<Point> {
        let mut found = vec![curve.start()];
        let done: Result<(), ()> = curve.flatten(flatness, &mut |p| {
            found.push(p);
            Ok(())
        });
        assert_eq!(done, Ok(()));
        found
    }

    /// The largest distance of points of the curve from the polygon, and the number of lines.
    fn check(
        curve: &Curve,
        exact: impl Fn(f64) -> Point,
        flatness: f64,
        lines: std::ops::RangeInclusive<usize>,
    ) {
        let polygon = points(curve, flatness);
        assert!(lines.contains(&(polygon.len() - 1)), "{} lines, not {lines:?}", polygon.len() - 1);
        for k in 0..=1000 {
            let p = exact(f64::from(k) / 1000.0);
            let distance =
                polygon.windows(2).map(|w| distance(p, w[0], w[1])).fold(f64::INFINITY, f64::min);
            assert!(distance <= flatness * (1.0 + 1e-9), "{p:?} is {distance} from the polygon");
        }
    }

    fn distance(p: Point, a: Point, b: Point) -> f64 {
        let (d, v) = (minus(b, a), minus(p, a));
        let t = (dot(d, v) / dot(d, d)).clamp(0.0, 1.0);
        let off = minus(v, [d[0] * t, d[1] * t]);
        dot(off, off).sqrt()
    }

    fn bezier(p: [Point; 4]) -> impl Fn(f64) -> Point {
        move |t| {
            let s = 1.0 - t;
            std::array::from_fn(|i| {
                s * s * s * p[0][i]
                    + 3.0 * s * s * t * p[1][i]
                    + 3.0 * s * t * t * p[2][i]
                    + t * t * t * p[3][i]
            })
        }
    }

    #[test]
    fn curves_stay_within_the_tolerance() {
        let bow = [[0.0, 0.0], [0.0, 10.0], [10.0, 10.0], [10.0, 0.0]];
        let loops = [[0.0, 0.0], [30.0, 20.0], [-20.0, 20.0], [10.0, 0.0]];
        let straight = [[0.0, 0.0], [0.0, 0.0], [9.0, 3.0], [9.0, 3.0]];
        let overshoots = [[0.0, 0.0], [30.0, 0.0], [-20.0, 0.0], [10.0, 0.0]];
        check(&Curve::Cubic(bow), bezier(bow), 0.01, 16..=64);
        check(&Curve::Cubic(bow), bezier(bow), 1.0, 2..=8);
        check(&Curve::Cubic(loops), bezier(loops), 0.01, 16..=128);
        check(&Curve::Cubic(straight), bezier(straight), 0.01, 1..=1);
        check(&Curve::Cubic(overshoots), bezier(overshoots), 0.01, 3..=32);
        let arc = Arc {
            centre: [1.0, 2.0],
            axes: [[10.0, 1.0], [3.0, 4.0]],
            from: 0.3,
            sweep: -4.0,
            ends: [[0.0; 2]; 2],
        };
        let at = |t: f64| {
            let (sine, cosine) = libm::sincos(0.3 - 4.0 * t);
            [1.0 + 10.0 * cosine + 3.0 * sine, 2.0 + cosine + 4.0 * sine]
        };
        let arc = Curve::Arc(Box::new(Arc { ends: [at(0.0), at(1.0)], ..arc }));
        check(&arc, at, 0.01, 32..=64);
        check(&arc, at, 100.0, 6..=6);
    }

    #[test]
    fn bounds_are_those_of_the_arc_not_of_the_ellipse() {
        let check = |from: f64, sweep: f64, low: Point, high: Point| {
            let at = |t: f64| [3.0 + 2.0 * libm::cos(t), 1.0 + libm::sin(t)];
            let ends = [at(from), at(from + sweep)];
            let arc = Arc { centre: [3.0, 1.0], axes: [[2.0, 0.0], [0.0, 1.0]], from, sweep, ends };
            let (mut least, mut most) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
            Curve::Arc(Box::new(arc)).bounds(|p| {
                least = [least[0].min(p[0]), least[1].min(p[1])];
                most = [most[0].max(p[0]), most[1].max(p[1])];
            });
            for (found, wanted) in least.iter().chain(&most).zip(low.iter().chain(&high)) {
                assert!(
                    (found - wanted).abs() < 1e-12,
                    "{least:?} to {most:?}, not {low:?} to {high:?}"
                );
            }
        };
        let quarter = std::f64::consts::FRAC_PI_2;
        check(0.0, quarter, [3.0, 1.0], [5.0, 2.0]);
        check(quarter, -quarter, [3.0, 1.0], [5.0, 2.0]);
        check(-quarter, 2.0 * quarter, [3.0, 0.0], [5.0, 2.0]);
        check(40.0 * quarter, -4.0 * quarter, [1.0, 0.0], [5.0, 2.0]);
        check(7.0 * quarter, 2.0 * quarter, [3.0, 0.0], [5.0, 2.0]);
    }

    #[test]
    fn a_reversed_curve_has_the_same_points() {
        let there = [[0.1, 0.2], [0.7, 10.3], [9.4, 8.5], [10.6, 0.7]];
        let mut back = there;
        back.reverse();
        let mut reversed = points(&Curve::Cubic(back), 1e-4);
        reversed.reverse();
        assert_eq!(points(&Curve::Cubic(there), 1e-4), reversed);
    }
}
