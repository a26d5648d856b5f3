//! Reads and writes SVG in the convention of Origami Simulator (`colour.rs`).
//!
//! The elements `path`, `line`, `polyline`, `polygon`, `rect`, `circle` and `ellipse` are lines if they have a
//! stroke, however thin; their fill does not matter. A shape without stroke, or with one in white, grey, cyan or
//! orange, is not a line of the pattern, and neither is what is hidden or not displayed. All that is counted as
//! ignored, as are text, images, gradients, clip paths and markers. Lines that a clip path or a mask would hide
//! are read. The opacity of a mountain or valley line, times that of the groups around it, is its target angle
//! over 180 degrees; without an opacity that is written (as `opacity`, `stroke-opacity` or the alpha of a colour)
//! a line has no target angle.
//!
//! Coordinates are those of the page's user units with y upwards: without transforms they keep their bits
//! (`size.rs` says what the unit is).
//!
//! # Why not usvg
//!
//! usvg resolves styles and clones too, but it computes in `f32`, which moves points by 1e-7 of the size of the
//! drawing; it drops what cannot be seen, where this reader says what it ignored; and its tree has no positions
//! in the text, which each message here has. So this reader takes roxmltree for the syntax, svgtypes for the
//! syntax of attributes, and has rules for styles of its own (`sheet.rs`, `style.rs`).

mod guard;
mod path;
mod shapes;
mod sheet;
mod size;
mod style;
mod walk;
mod write;

#[cfg(test)]
mod tests;

pub use write::write;
pub(crate) use write::{color, line};

use roxmltree::{Document, ParsingOptions};

use crate::drawing::{Drawing, Place};
use crate::fault::{Cause, Fault};
use crate::limits;
use crate::sketch::{Sketch, Step};

/// Reads a drawing. `flatness` is the tolerance of curves in units of the drawing.
///
/// # Errors
///
/// All that is wrong with it, up to [`limits::FAULTS`].
pub(crate) fn read(text: &str, flatness: Option<f64>) -> Result<Drawing, Vec<Fault>> {
    guard::check(text).map_err(|fault| vec![fault])?;
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    let document =
        Document::parse_with_options(text, options).map_err(|error| vec![syntax(text, &error)])?;
    let root = document.root_element();
    if root.tag_name().name() != "svg" {
        let start = root.range().start;
        let name = root.tag_name().name();
        return Err(vec![Fault {
            cause: Cause::Syntax,
            message: format!(
                "the file is not an SVG: its outermost element is `{name}`, not `svg`"
            ),
            place: Some(Place { start, end: start + 1 + name.len() }),
            at: Vec::new(),
            hint: None,
        }]);
    }
    let page = size::page(root);
    let mut sketch = Sketch::default();
    // A stop has its fault in the sketch, which `finish` returns.
    let _: Step = draw(&document, &page, &mut sketch);
    sketch.finish(flatness, page.unit)
}

fn draw(document: &Document, page: &size::Page, sketch: &mut Sketch) -> Step {
    let is_sheet = |node: &roxmltree::Node| node.is_element() && node.tag_name().name() == "style";
    let texts = document
        .descendants()
        .filter(is_sheet)
        .flat_map(|node| node.children())
        .filter_map(|n| n.text());
    let css = sheet::without_comments(&texts.collect::<Vec<_>>().join("\n"));
    let place = document.descendants().find(is_sheet).map(|node| node.range()).unwrap_or_default();
    let place = Place { start: place.start, end: place.end };
    let too_large = |what| Fault {
        cause: Cause::Limit,
        message: format!("the style sheets of this file have more than {what}"),
        place: Some(place),
        at: Vec::new(),
        hint: Some(
            "write colours as attributes: in Illustrator, save with `Presentation Attributes`"
                .into(),
        ),
    };
    if css.len() > limits::STYLES {
        return sketch.stop(too_large(format!("{} bytes", limits::STYLES)));
    }
    let sheet = sheet::Sheet::of(&css);
    if sheet.len() > limits::RULES {
        return sketch.stop(too_large(format!("{} rules", limits::RULES)));
    }
    for selector in &sheet.unread {
        let short: String = selector.chars().take(40).collect();
        sketch.ignore(&format!("style {short}"), place);
    }
    walk::Walk::new(document, &sheet, sketch).root(document.root_element(), page)
}

/// An error of the XML reader, with the position in bytes.
fn syntax(text: &str, error: &roxmltree::Error) -> Fault {
    let at = error.pos();
    let mut lines = text.split_inclusive('\n');
    let before: usize = lines.by_ref().take(at.row.saturating_sub(1) as usize).map(str::len).sum();
    let line = lines.next().unwrap_or_default();
    let column: usize =
        line.chars().take(at.col.saturating_sub(1) as usize).map(char::len_utf8).sum();
    let start = (before + column).min(text.len());
    let end = (start + 1..=text.len()).find(|i| text.is_char_boundary(*i)).unwrap_or(start);
    Fault {
        cause: Cause::Syntax,
        message: format!("the file is not valid XML: {error}"),
        place: Some(Place { start, end }),
        at: Vec::new(),
        hint: None,
    }
}
