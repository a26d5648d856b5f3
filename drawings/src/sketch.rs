//! What a reader collects: lines, curves, what it ignores, and what is wrong.

use std::collections::HashMap;

use crate::curve::{Curve, Point};
use crate::drawing::{Drawing, Ignored, Place, Role, Stroke};
use crate::fault::{Cause, Fault};
use crate::limits;

/// The tolerance of curves, as a share of the larger side of the drawing, if the user gives none: a circle as
/// large as the drawing has about 70 corners, a hole of a thirtieth of it has 13.
const FLATNESS: f64 = 1.0 / 2000.0;

/// There is no use to read on: the faults say why.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stop;

/// The result of a step of a reader.
pub(crate) type Step = Result<(), Stop>;

/// What all lines of an element have in common.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pen {
    pub role: Role,
    /// The target angle, rad.
    pub fold: Option<f64>,
    pub place: Place,
}

/// A drawing in the making.
#[derive(Default)]
pub(crate) struct Sketch {
    strokes: Vec<Stroke>,
    /// Curves, each with the number of lines before it.
    curves: Vec<(usize, Curve, Pen)>,
    ignored: Vec<Ignored>,
    kinds: HashMap<String, usize>,
    faults: Vec<Fault>,
    /// Faults that repeat an earlier one: the same kind at the same place.
    repeated: usize,
}

impl Sketch {
    /// Adds a line. A line without length is none.
    pub(crate) fn line(&mut self, ends: [Point; 2], pen: Pen) -> Step {
        if !self.is_within(&ends, pen.place)? || ends[0] == ends[1] {
            return Ok(());
        }
        self.strokes.push(stroke(ends, pen));
        self.check_count(pen.place)
    }

    /// Adds a curve.
    pub(crate) fn curve(&mut self, curve: Curve, pen: Pen) -> Step {
        let mut points = Vec::new();
        curve.bounds(|p| points.push(p));
        if !self.is_within(&points, pen.place)? {
            return Ok(());
        }
        self.curves.push((self.strokes.len(), curve, pen));
        self.check_count(pen.place)
    }

    /// Counts something that is not a line of the pattern.
    pub(crate) fn ignore(&mut self, what: &str, place: Place) {
        let what = if self.kinds.len() < limits::KINDS || self.kinds.contains_key(what) {
            what
        } else {
            "others"
        };
        match self.kinds.get(what) {
            Some(i) => self.ignored[*i].count += 1,
            None => {
                self.kinds.insert(what.to_string(), self.ignored.len());
                self.ignored.push(Ignored { what: what.to_string(), count: 1, place });
            }
        }
    }

    /// Reports a fault. The reader goes on to find others, until there are too many. An element with several
    /// faults of one kind, such as a path with two coordinates that are too large, is reported once.
    pub(crate) fn fault(&mut self, fault: Fault) -> Step {
        let same = |known: &Fault| known.cause == fault.cause && known.place == fault.place;
        if fault.place.is_some() && self.faults.iter().any(same) {
            self.repeated += 1;
        } else {
            self.faults.push(fault);
        }
        if self.faults.len() + self.repeated < limits::FAULTS { Ok(()) } else { Err(Stop) }
    }

    /// Reports a fault that makes it useless to read on.
    pub(crate) fn stop<T>(&mut self, fault: Fault) -> Result<T, Stop> {
        self.faults.push(fault);
        Err(Stop)
    }

    /// Returns the drawing, with its curves flattened to a tolerance in its units, and the length of the unit,
    /// m.
    ///
    /// # Errors
    ///
    /// The faults; or that there is no line, or too many.
    pub(crate) fn finish(
        mut self,
        flatness: Option<f64>,
        unit: Option<f64>,
    ) -> Result<Drawing, Vec<Fault>> {
        if !self.faults.is_empty() {
            return Err(self.faults);
        }
        let (low, high) = self.box_around();
        let size = (high[0] - low[0]).max(high[1] - low[1]).max(0.0);
        // Points nearer than the last digit of the coordinates are the same: a finer tolerance would divide
        // curves without end.
        let largest = low.iter().chain(&high).fold(0.0, |most: f64, x| most.max(x.abs()));
        let flatness = flatness.unwrap_or(FLATNESS * size).max(f64::EPSILON * largest);
        let curves = std::mem::take(&mut self.curves);
        if !curves.is_empty() {
            let lines = std::mem::take(&mut self.strokes);
            if self.join(&lines, &curves, flatness).is_err() {
                return Err(self.faults);
            }
        }
        if self.strokes.is_empty() {
            return Err(vec![self.empty()]);
        }
        let Self { strokes, ignored, .. } = self;
        Ok(Drawing { strokes, unit, ignored, ..Drawing::default() })
    }

    /// Collects lines and flattened curves in the order of the file.
    fn join(&mut self, lines: &[Stroke], curves: &[(usize, Curve, Pen)], flatness: f64) -> Step {
        let mut done = 0;
        for (before, curve, pen) in curves {
            self.strokes.extend_from_slice(&lines[done..*before]);
            done = *before;
            let mut last = curve.start();
            curve.flatten(flatness, &mut |point| {
                if point != last {
                    self.strokes.push(stroke([last, point], *pen));
                }
                last = point;
                self.check_count(pen.place)
            })?;
        }
        self.strokes.extend_from_slice(&lines[done..]);
        Ok(())
    }

    /// The lower left and the upper right corner of the box around the drawing; not finite if it is empty.
    fn box_around(&self) -> (Point, Point) {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut include = |p: Point| {
            for i in 0..2 {
                low[i] = low[i].min(p[i]);
                high[i] = high[i].max(p[i]);
            }
        };
        self.strokes.iter().for_each(|s| s.ends.iter().for_each(|p| include(*p)));
        self.curves.iter().for_each(|(_, curve, _)| curve.bounds(&mut include));
        (low, high)
    }

    fn is_within(&mut self, points: &[Point], place: Place) -> Result<bool, Stop> {
        let outside = |x: &&f64| x.is_nan() || x.abs() > limits::COORDINATE;
        match points.iter().flatten().find(outside) {
            None => Ok(true),
            Some(coordinate) => {
                self.fault(Fault {
                    cause: Cause::Number,
                    message: format!(
                        "a coordinate is {coordinate:e}; lamc reads up to {:e}",
                        limits::COORDINATE
                    ),
                    place: Some(place),
                    at: Vec::new(),
                    hint: Some("check the element and its transforms".into()),
                })?;
                Ok(false)
            }
        }
    }

    fn check_count(&mut self, place: Place) -> Step {
        if self.strokes.len() + self.curves.len() <= limits::STROKES {
            return Ok(());
        }
        self.stop(Fault {
            cause: Cause::Limit,
            message: format!(
                "the drawing has more than {} straight lines, curves included",
                limits::STROKES
            ),
            place: Some(place),
            at: Vec::new(),
            hint: Some("give curves a larger flatness, or simplify the drawing".into()),
        })
    }

    fn empty(&self) -> Fault {
        let list: Vec<String> =
            self.ignored.iter().take(8).map(|i| format!("{} x {}", i.count, i.what)).collect();
        let hint =
            if list.is_empty() { None } else { Some(format!("ignored were: {}", list.join(", "))) };
        Fault {
            cause: Cause::Empty,
            message: "the file has no line of a pattern".into(),
            place: None,
            at: Vec::new(),
            hint,
        }
    }
}

fn stroke(ends: [Point; 2], pen: Pen) -> Stroke {
    Stroke { ends, role: pen.role, fold: pen.fold, angle: None, place: pen.place }
}
