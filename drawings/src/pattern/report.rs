//! What was mended in a drawing, and what is doubtful in it.

use super::Mended;
use super::network::Point;
use crate::drawing::Place;
use crate::fault::{Cause, Fault};

/// Collects what the stages of [`Pattern::of`](super::Pattern::of) report.
#[derive(Debug, Default)]
pub(super) struct Report {
    pub(super) mended: Vec<Mended>,
    pub(super) doubts: Vec<Fault>,
}

impl Report {
    /// Reports what was mended, unless it is nothing.
    pub(super) fn mended(&mut self, sites: Sites, message: impl FnOnce(&Sites) -> String) {
        if let Some(place) = sites.place {
            let message = message(&sites);
            self.mended.push(Mended { message, at: sites.at, place });
        }
    }

    /// Reports a doubt, unless there is none.
    pub(super) fn doubt(
        &mut self,
        cause: Cause,
        sites: Sites,
        hint: &str,
        message: impl FnOnce(&Sites) -> String,
    ) {
        if let Some(place) = sites.place {
            let message = message(&sites);
            let hint = Some(hint.to_owned());
            self.doubts.push(Fault { cause, message, place: Some(place), at: sites.at, hint });
        }
    }
}

/// Where something of one kind was found.
#[derive(Debug, Default)]
pub(super) struct Sites {
    pub(super) at: Vec<Point>,
    place: Option<Place>,
    /// The largest distance that a point was moved by, in units of the drawing.
    pub(super) farthest: f64,
}

impl Sites {
    /// Notes a site, with the position of its stroke in the text.
    pub(super) fn note(&mut self, at: Point, place: Place) {
        self.at.push(at);
        self.place = Some(self.place.map_or(place, |first| first.min(place)));
    }

    /// Notes a point that was moved.
    pub(super) fn moved(&mut self, to: Point, away: f64, place: Place) {
        self.note(to, place);
        self.farthest = self.farthest.max(away);
    }

    /// Returns how many there are, with the right form of a word: `1 end`, `2 ends`.
    pub(super) fn count(&self, word: &str) -> String {
        let count = self.at.len();
        if count == 1 { format!("{count} {word}") } else { format!("{count} {word}s") }
    }

    /// Returns `was` or `were`, for [`Sites::count`].
    pub(super) fn was(&self) -> &'static str {
        if self.at.len() == 1 { "was" } else { "were" }
    }
}

/// Writes a point for a message.
pub(super) fn point([x, y]: Point) -> String {
    // Enough to find it in a drawing.
    const DIGITS: usize = 6;
    format!("({}, {})", significant(x, DIGITS), significant(y, DIGITS))
}

/// Writes a distance for a message.
pub(super) fn number(value: f64) -> String {
    const DIGITS: usize = 3;
    significant(value, DIGITS)
}

/// Writes a number with so many significant digits, without zeros at the end.
fn significant(value: f64, digits: usize) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-5..1e9).contains(&size) {
        return format!("{value:.*e}", digits - 1);
    }
    // Digits before the decimal point; negative for zeros after it.
    let whole = if size == 0.0 { 1 } else { size.log10().floor() as i32 + 1 };
    let decimals = usize::try_from(digits as i32 - whole).unwrap_or(0);
    let text = format!("{value:.decimals$}");
    if !text.contains('.') {
        return text;
    }
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}
