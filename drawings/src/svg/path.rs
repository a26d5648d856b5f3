//! The data of `<path>`: lines, Bézier curves and arcs.

use svgtypes::{PathParser, PathSegment};

use crate::affine::{Affine, sine_cosine};
use crate::curve::{Arc, Curve, Point};
use crate::sketch::{Pen, Sketch, Step};

/// How far a closed path may be open, as a share of its coordinates: each relative command rounds by 1e-16.
const ROUNDING: f64 = 1e-12;

/// Draws in user units onto a sketch.
pub(super) struct Pencil<'s> {
    sketch: &'s mut Sketch,
    /// From user units to the page; y is downwards on both sides.
    transform: Affine,
    pen: Pen,
    start: Point,
    current: Point,
}

impl<'s> Pencil<'s> {
    pub(super) fn new(sketch: &'s mut Sketch, transform: Affine, pen: Pen) -> Self {
        Pencil { sketch, transform, pen, start: [0.0; 2], current: [0.0; 2] }
    }

    pub(super) fn move_to(&mut self, point: Point) {
        self.start = point;
        self.current = point;
    }

    pub(super) fn line_to(&mut self, point: Point) -> Step {
        let ends = [self.place(self.current), self.place(point)];
        self.current = point;
        self.sketch.line(ends, self.pen)
    }

    /// Draws the line back to the start, unless only rounding errors of relative coordinates are between.
    pub(super) fn close(&mut self) -> Step {
        let near =
            |i: usize| (self.start[i] - self.current[i]).abs() <= ROUNDING * self.start[i].abs();
        if near(0) && near(1) {
            self.current = self.start;
            return Ok(());
        }
        self.line_to(self.start)
    }

    fn curve_to(&mut self, [b, c, d]: [Point; 3]) -> Step {
        let points = [self.current, b, c, d].map(|p| self.place(p));
        self.current = d;
        self.sketch.curve(Curve::Cubic(points), self.pen)
    }

    fn quadratic_to(&mut self, [b, c]: [Point; 2]) -> Step {
        let points = [self.current, b, c].map(|p| self.place(p));
        self.current = c;
        self.sketch.curve(Curve::quadratic(points), self.pen)
    }

    /// Draws an arc whose sizes are in user units, from the current point.
    pub(super) fn arc(
        &mut self,
        centre: Point,
        axes: [Point; 2],
        from: f64,
        sweep: f64,
        end: Point,
    ) -> Step {
        let arc = Arc {
            centre: self.place(centre),
            axes: axes.map(|axis| up(self.transform.vector(axis))),
            from,
            sweep,
            ends: [self.place(self.current), self.place(end)],
        };
        self.current = end;
        self.sketch.curve(Curve::Arc(Box::new(arc)), self.pen)
    }

    /// An arc by its end: SVG 2, appendix B.2.4.
    fn arc_to(&mut self, radii: Point, degrees: f64, large: bool, sweep: bool, end: Point) -> Step {
        let [mut rx, mut ry] = radii.map(f64::abs);
        if rx == 0.0 || ry == 0.0 || self.current == end {
            return self.line_to(end);
        }
        let (sine, cosine) = sine_cosine(degrees);
        let half = [0.5 * (self.current[0] - end[0]), 0.5 * (self.current[1] - end[1])];
        // The half chord in the frame of the axes, over the radii.
        let u = (cosine * half[0] + sine * half[1]) / rx;
        let v = (cosine * half[1] - sine * half[0]) / ry;
        let square = u * u + v * v;
        let (mut across, stretch) = if square > 1.0 {
            (0.0, square.sqrt())
        } else {
            (((1.0 - square) / square).sqrt(), 1.0)
        };
        rx *= stretch;
        ry *= stretch;
        if large == sweep {
            across = -across;
        }
        let (u, v) = (u / stretch, v / stretch);
        // The centre in the same frame, seen from the middle of the chord.
        let (cu, cv) = (across * v, -across * u);
        let axes = [[rx * cosine, rx * sine], [-ry * sine, ry * cosine]];
        let centre = [
            0.5 * (self.current[0] + end[0]) + axes[0][0] * cu + axes[1][0] * cv,
            0.5 * (self.current[1] + end[1]) + axes[0][1] * cu + axes[1][1] * cv,
        ];
        let from = libm::atan2(v - cv, u - cu);
        let to = libm::atan2(-v - cv, -u - cu);
        let turn = std::f64::consts::TAU;
        let angle = match to - from {
            angle if sweep && angle < 0.0 => angle + turn,
            angle if !sweep && angle > 0.0 => angle - turn,
            angle => angle,
        };
        self.arc(centre, axes, from, angle, end)
    }

    /// The point of the drawing: y upwards. A zero stays a positive zero.
    fn place(&self, point: Point) -> Point {
        up(self.transform.point(point))
    }
}

fn up([x, y]: Point) -> Point {
    [x, 0.0 - y]
}

/// The control point that a smooth curve takes over, mirrored.
#[derive(Clone, Copy, PartialEq)]
enum Smooth {
    None,
    Cubic(Point),
    Quadratic(Point),
}

/// Draws the data of a path.
///
/// # Errors
///
/// The outer result: what is wrong with the data. The inner one: the sketch wants no more.
pub(super) fn draw(data: &str, pencil: &mut Pencil) -> Result<Step, svgtypes::Error> {
    let mut smooth = Smooth::None;
    for segment in PathParser::from(data) {
        let mut next = Smooth::None;
        let step = segment_to(pencil, segment?, smooth, &mut next);
        if step.is_err() {
            return Ok(step);
        }
        smooth = next;
    }
    Ok(Ok(()))
}

fn segment_to(
    pencil: &mut Pencil,
    segment: PathSegment,
    smooth: Smooth,
    next: &mut Smooth,
) -> Step {
    let base = if segment.is_abs() { [0.0; 2] } else { pencil.current };
    // A coordinate that is absolute keeps its bits.
    let at = |x: f64, y: f64| if segment.is_abs() { [x, y] } else { [base[0] + x, base[1] + y] };
    let current = pencil.current;
    let mirrored = |point: Point| [2.0 * current[0] - point[0], 2.0 * current[1] - point[1]];
    match segment {
        PathSegment::MoveTo { x, y, .. } => {
            pencil.move_to(at(x, y));
            Ok(())
        }
        PathSegment::LineTo { x, y, .. } => pencil.line_to(at(x, y)),
        PathSegment::HorizontalLineTo { x, .. } => pencil.line_to([at(x, 0.0)[0], current[1]]),
        PathSegment::VerticalLineTo { y, .. } => pencil.line_to([current[0], at(0.0, y)[1]]),
        PathSegment::CurveTo { x1, y1, x2, y2, x, y, .. } => {
            *next = Smooth::Cubic(at(x2, y2));
            pencil.curve_to([at(x1, y1), at(x2, y2), at(x, y)])
        }
        PathSegment::SmoothCurveTo { x2, y2, x, y, .. } => {
            let first = if let Smooth::Cubic(point) = smooth { mirrored(point) } else { current };
            *next = Smooth::Cubic(at(x2, y2));
            pencil.curve_to([first, at(x2, y2), at(x, y)])
        }
        PathSegment::Quadratic { x1, y1, x, y, .. } => {
            *next = Smooth::Quadratic(at(x1, y1));
            pencil.quadratic_to([at(x1, y1), at(x, y)])
        }
        PathSegment::SmoothQuadratic { x, y, .. } => {
            let control =
                if let Smooth::Quadratic(point) = smooth { mirrored(point) } else { current };
            *next = Smooth::Quadratic(control);
            pencil.quadratic_to([control, at(x, y)])
        }
        PathSegment::EllipticalArc { rx, ry, x_axis_rotation, large_arc, sweep, x, y, .. } => {
            pencil.arc_to([rx, ry], x_axis_rotation, large_arc, sweep, at(x, y))
        }
        PathSegment::ClosePath { .. } => pencil.close(),
    }
}
