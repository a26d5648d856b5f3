//! The tolerance, and how much of a drawing is read.

use super::network::{Point, distance};
use super::report::number;
use crate::drawing::Drawing;
use crate::fault::{Cause, Fault};

/// The largest coordinate that is read, in units of the drawing: in micrometres a sheet of 1 km.
pub const LARGEST_COORDINATE: f64 = 1e9;

/// The most edges that a pattern may have after its lines are divided where they cross.
const MOST_EDGES: usize = 500_000;

/// The most pairs of lines near each other that are compared for a pattern: one to three seconds of work. Lines of which
/// each crosses all others reach it with two thousand; patterns compare some ten pairs for each line.
const MOST_PAIRS: usize = 6_000_000;

/// How near is the same.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tolerance {
    /// The tolerance, in units of the drawing.
    pub(super) distance: f64,
    /// A distance that comes from rounding: it is neither mended nor reported.
    pub(super) rounding: f64,
}

impl Tolerance {
    /// The default, as a part of the diagonal of the drawing ([`Pattern::of`](super::Pattern::of)).
    const DEFAULT: f64 = 1e-3;

    /// Strokes of which half are shorter than ten tolerances are a fine drawing, with a finer tolerance.
    const OF_MEDIAN: f64 = 0.1;

    /// But curves are drawn as short strokes: it is at least this part of the diagonal.
    const FINEST: f64 = 1e-4;

    /// Some units in the last place of the largest coordinate: the error of a computed crossing.
    const ROUNDING: f64 = 16.0 * f64::EPSILON;

    /// Checks the coordinates of a drawing, and returns its tolerance.
    pub(super) fn of(drawing: &Drawing, distance: Option<f64>) -> Result<Self, Vec<Fault>> {
        let faults: Vec<Fault> =
            drawing.strokes.iter().filter_map(check).take(MOST_FAULTS).collect();
        if !faults.is_empty() {
            return Err(faults);
        }
        let (low, high) = bounds(drawing.strokes.iter().flat_map(|stroke| stroke.ends));
        let diagonal = (high[0] - low[0]).hypot(high[1] - low[1]);
        if drawing.strokes.is_empty() || diagonal == 0.0 {
            return Err(vec![fault(
                Cause::Empty,
                "the drawing has no lines".to_owned(),
                "lines in the colours or layers of roles make a pattern",
            )]);
        }
        let largest =
            low.into_iter().chain(high).fold(0.0_f64, |largest, at| largest.max(at.abs()));
        let rounding = Self::ROUNDING * largest;
        let distance = distance.unwrap_or_else(|| Self::default_distance(drawing, diagonal));
        // Below, neither a crossing nor the grid of near points can be computed.
        let smallest = 4.0 * rounding;
        if !(distance >= smallest && distance < diagonal) {
            return Err(vec![fault(
                Cause::Number,
                format!(
                    "the tolerance of {} units of the drawing cannot be used",
                    number(distance)
                ),
                &format!(
                    "a tolerance for this drawing is between {} and its diagonal of {} units",
                    number(smallest),
                    number(diagonal)
                ),
            )]);
        }
        Ok(Self { distance, rounding })
    }

    /// Returns the tolerance of a drawing that says none.
    fn default_distance(drawing: &Drawing, diagonal: f64) -> f64 {
        let mut lengths: Vec<f64> =
            drawing.strokes.iter().map(|stroke| distance(stroke.ends[0], stroke.ends[1])).collect();
        let middle = lengths.len() / 2;
        let (_, median, _) = lengths.select_nth_unstable_by(middle, f64::total_cmp);
        let finest = (Self::OF_MEDIAN * *median).max(Self::FINEST * diagonal);
        finest.min(Self::DEFAULT * diagonal)
    }

    /// Returns twice the tolerance.
    pub(super) fn coarser(self) -> Self {
        Self { distance: 2.0 * self.distance, ..self }
    }
}

/// So many faults of one kind are reported; more do not help.
const MOST_FAULTS: usize = 20;

/// Returns what is wrong with the numbers of a stroke.
fn check(stroke: &crate::drawing::Stroke) -> Option<Fault> {
    let bad = stroke
        .ends
        .iter()
        .flatten()
        .find(|value| value.is_nan() || value.abs() > LARGEST_COORDINATE)?;
    Some(Fault {
        cause: Cause::Number,
        message: format!("the coordinate {bad:e} is not a number that can be used"),
        place: Some(stroke.place),
        at: Vec::new(),
        hint: Some(format!(
            "coordinates are numbers from {:e} to {LARGEST_COORDINATE:e}",
            -LARGEST_COORDINATE
        )),
    })
}

/// Returns the lower left and the upper right corner of points.
pub(crate) fn bounds(points: impl IntoIterator<Item = Point>) -> (Point, Point) {
    points.into_iter().fold(([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]), |(low, high), point| {
        (
            [low[0].min(point[0]), low[1].min(point[1])],
            [high[0].max(point[0]), high[1].max(point[1])],
        )
    })
}

/// How much was done so far: a hostile drawing ends with a message and not with a hang.
#[derive(Debug, Default)]
pub(super) struct Work {
    pairs: usize,
}

impl Work {
    /// Counts pairs of lines that are compared. The last of them are near a point, which is reported.
    pub(super) fn pairs(&mut self, count: usize, near: Point) -> Result<(), Fault> {
        self.pairs += count;
        if self.pairs <= MOST_PAIRS {
            return Ok(());
        }
        let [x, y] = near.map(number);
        let fault = fault(
            Cause::Limit,
            format!(
                "the drawing has too many long lines close to each other, some of them near ({x}, {y})"
            ),
            "leave out hatches and pictures, and keep the lines of the pattern",
        );
        Err(Fault { at: vec![near], ..fault })
    }

    /// Checks the number of edges.
    pub(super) fn edges(&self, count: usize) -> Result<(), Fault> {
        if count <= MOST_EDGES {
            return Ok(());
        }
        Err(fault(
            Cause::Limit,
            format!(
                "the lines of the drawing have more than {MOST_EDGES} pieces between crossings"
            ),
            "leave out hatches and pictures, and keep the lines of the pattern",
        ))
    }
}

/// Returns a fault of the drawing as a whole.
pub(super) fn fault(cause: Cause, message: String, hint: &str) -> Fault {
    Fault { cause, message, place: None, at: Vec::new(), hint: Some(hint.to_owned()) }
}
