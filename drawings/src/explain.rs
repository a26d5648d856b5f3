//! A picture of a drawing that shows what is wrong with it, what is doubtful, and what was mended.

use std::collections::HashSet;
use std::fmt::Write;

use crate::drawing::Drawing;
use crate::pattern::{LARGEST_COORDINATE, Pattern, bounds};
use crate::svg::{color, line};

/// The most circles of one message: a picture with more shows nothing.
const MOST_CIRCLES: usize = 200;

/// So many numbers have room beside each other.
const NUMBERS: usize = 8;

/// Parts of the larger extent of the drawing.
const LINE: f64 = 1.0 / 400.0;
const RADIUS: f64 = 1.0 / 50.0;
const TEXT: f64 = 1.0 / 50.0;

/// The mean width of a letter, as a part of its height, and the letters before and after a message.
const LETTER: f64 = 0.55;
const LABEL: usize = 45;

/// What a picture shows for one reason.
#[derive(Clone, Debug)]
pub struct Mark {
    /// How bad it is.
    pub kind: MarkKind,
    /// Message of one line.
    pub message: String,
    /// How to correct it.
    pub hint: Option<String>,
    /// Points of the drawing at which it is, in units of the drawing.
    pub at: Vec<[f64; 2]>,
}

/// How bad is what a mark shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarkKind {
    /// The drawing is wrong; red.
    Error,
    /// It is doubtful; orange.
    Warning,
    /// It was mended, or is worth to know; blue-green.
    Note,
}

impl MarkKind {
    /// The colour, which no role has, and the word.
    fn shown(self) -> (&'static str, &'static str) {
        match self {
            Self::Error => ("#b00020", "error"),
            Self::Warning => ("#e07b00", "warning"),
            Self::Note => ("#007a87", "note"),
        }
    }
}

/// Returns an SVG of a drawing, and of its facets if they are known, with circles at the points of the
/// marks; below the drawing are the messages, by number.
pub fn explain(drawing: &Drawing, pattern: Option<&Pattern>, marks: &[Mark]) -> String {
    let strokes: Vec<_> =
        drawing.strokes.iter().filter(|stroke| stroke.ends.iter().all(usable)).collect();
    let points = strokes.iter().flat_map(|stroke| stroke.ends);
    let (low, high) = bounds(points.chain(marks.iter().flat_map(|mark| distinct(&mark.at))));
    let size = (high[0] - low[0]).max(high[1] - low[1]);
    // Without points, the size is not a finite number.
    let empty = size <= 0.0 || !size.is_finite();
    let (low, size) = if empty { ([0.0; 2], 1.0) } else { (low, size) };
    let high = if empty { [1.0; 2] } else { high };
    let margin = 2.0 * RADIUS * size;
    let rows = marks.iter().map(|mark| 1 + usize::from(mark.hint.is_some())).sum::<usize>();
    let legend = (rows + 1) as f64 * 1.5 * TEXT * size;
    let [x, y] = [low[0] - margin, -high[1] - margin];
    let [w, h] = [0, 1].map(|axis| high[axis] - low[axis] + 2.0 * margin);
    // Messages are longer than a small drawing is wide.
    let longest = marks.iter().map(|mark| mark.message.chars().count()).max().unwrap_or(0);
    let w = w.max((longest + LABEL) as f64 * LETTER * TEXT * size);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{x} {y} {w} {}\">\n\
         <rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{}\" fill=\"white\"/>\n",
        h + legend,
        h + legend
    );
    if let Some(pattern) = pattern {
        facets(&mut text, pattern);
    }
    _ = writeln!(text, "<g fill=\"none\" stroke-width=\"{}\">", LINE * size);
    for stroke in strokes {
        _ = writeln!(text, "{}", line(stroke.ends, &format!("stroke=\"{}\"", color(stroke.role))));
    }
    text.push_str("</g>\n");
    for (index, mark) in marks.iter().enumerate() {
        circles(&mut text, index + 1, mark, size);
    }
    messages(&mut text, marks, [x + margin, y + h], TEXT * size);
    text.push_str("</svg>\n");
    text
}

/// Whether a point can be drawn.
fn usable(point: &[f64; 2]) -> bool {
    point.iter().all(|value| value.abs() <= LARGEST_COORDINATE)
}

/// Returns the points that can be drawn, each once: several ends that were joined are at one place.
fn distinct(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut seen = HashSet::new();
    let new = |point: &[f64; 2]| seen.insert(point.map(f64::to_bits));
    points.iter().copied().filter(usable).filter(new).collect()
}

/// Draws the facets in grey, so that holes are seen.
fn facets(text: &mut String, pattern: &Pattern) {
    text.push_str("<path fill=\"#eeeeee\" fill-rule=\"evenodd\" d=\"");
    for boundary in
        pattern.facets.iter().flat_map(|facet| std::iter::once(&facet.outline).chain(&facet.holes))
    {
        for (index, [x, y]) in pattern.coordinates(boundary).enumerate() {
            let command = if index == 0 { 'M' } else { 'L' };
            _ = write!(text, "{command}{x} {}", -y + 0.0);
        }
        text.push('Z');
    }
    text.push_str("\"/>\n");
}

fn circles(text: &mut String, number: usize, mark: &Mark, size: f64) {
    let (color, _) = mark.kind.shown();
    _ = writeln!(
        text,
        "<g fill=\"none\" stroke=\"{color}\" stroke-width=\"{}\">\n<title>{number}: {}</title>",
        LINE * size,
        escaped(&mark.message)
    );
    for [x, y] in distinct(&mark.at).into_iter().take(MOST_CIRCLES) {
        let y = -y + 0.0;
        let radius = RADIUS * size;
        _ = writeln!(text, "<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\"/>");
        _ = writeln!(
            text,
            "<text x=\"{}\" y=\"{}\" font-size=\"{}\" fill=\"{color}\" stroke=\"none\">{number}</text>",
            // Numbers of different messages at one place stand beside each other.
            x + radius * (1.0 + 0.5 * (number % NUMBERS) as f64),
            y - radius,
            0.7 * TEXT * size
        );
    }
    text.push_str("</g>\n");
}

fn messages(text: &mut String, marks: &[Mark], [x, mut y]: [f64; 2], height: f64) {
    _ = writeln!(text, "<g font-family=\"sans-serif\" font-size=\"{height}\">");
    for (index, mark) in marks.iter().enumerate() {
        let hidden = distinct(&mark.at).len().saturating_sub(MOST_CIRCLES);
        let more =
            if hidden > 0 { format!(" ({hidden} more are not circled)") } else { String::new() };
        y += 1.5 * height;
        let (color, kind) = mark.kind.shown();
        _ = writeln!(
            text,
            "<text x=\"{x}\" y=\"{y}\" fill=\"{}\">{}, {}: {}{more}</text>",
            color,
            index + 1,
            kind,
            escaped(&mark.message)
        );
        if let Some(hint) = &mark.hint {
            y += 1.5 * height;
            let hint = escaped(hint);
            _ = writeln!(
                text,
                "<text x=\"{}\" y=\"{y}\" fill=\"#555555\">{hint}</text>",
                x + height
            );
        }
    }
    text.push_str("</g>\n");
}

/// Returns text for SVG. Characters that XML does not allow become a question mark.
fn escaped(text: &str) -> String {
    let mut result = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => result.push_str("&amp;"),
            '<' => result.push_str("&lt;"),
            '>' => result.push_str("&gt;"),
            '"' => result.push_str("&quot;"),
            '\n' | '\t' => result.push(' '),
            character if character.is_control() || matches!(character, '\u{fffe}' | '\u{ffff}') => {
                result.push('?');
            }
            character => result.push(character),
        }
    }
    result
}
