//! Lengths with units, the size of the page, and the maps of nested viewports.

use std::str::FromStr;

use roxmltree::Node;
use svgtypes::{Align, AspectRatio, Length, LengthUnit, ViewBox};

use crate::affine::Affine;
use crate::curve::Point;

/// CSS pixels of an inch: <https://www.w3.org/TR/css-values-3/#absolute-lengths>.
const PIXELS_OF_AN_INCH: f64 = 96.0;

/// The length of a CSS pixel, m.
const PIXEL: f64 = 0.0254 / PIXELS_OF_AN_INCH;

/// What a percentage refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axis {
    X,
    Y,
    /// Neither: the diagonal over the square root of two.
    Both,
}

/// Returns a length in user units, which are CSS pixels if nothing scales them.
///
/// # Errors
///
/// What is wrong with it.
pub(super) fn length(text: &str, axis: Axis, viewport: Option<Point>) -> Result<f64, String> {
    let Length { number, unit } =
        Length::from_str(text.trim()).map_err(|_| format!("`{text}` is not a length"))?;
    let scale = match unit {
        LengthUnit::None | LengthUnit::Px => return Ok(number),
        LengthUnit::In => PIXELS_OF_AN_INCH,
        LengthUnit::Cm => PIXELS_OF_AN_INCH / 2.54,
        LengthUnit::Mm => PIXELS_OF_AN_INCH / 25.4,
        LengthUnit::Pt => PIXELS_OF_AN_INCH / 72.0,
        LengthUnit::Pc => PIXELS_OF_AN_INCH / 6.0,
        LengthUnit::Em | LengthUnit::Ex => return Err(format!("`{text}` depends on a font")),
        LengthUnit::Percent => {
            let [width, height] =
                viewport.ok_or_else(|| format!("`{text}` refers to a page without size"))?;
            match axis {
                Axis::X => width / 100.0,
                Axis::Y => height / 100.0,
                Axis::Both => (0.5 * (width * width + height * height)).sqrt() / 100.0,
            }
        }
    };
    Ok(number * scale)
}

/// The page: the outermost `<svg>`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Page {
    /// The length of a user unit, m. None if the file names no physical unit.
    pub unit: Option<f64>,
    /// Width and height in user units.
    pub viewport: Option<Point>,
    /// From user units to coordinates of the drawing: the identity, except for `preserveAspectRatio="none"`.
    pub transform: Affine,
}

/// Reads the size of the page.
///
/// Millimetres, centimetres, inches, points and picas are a statement of the size. Pixels and numbers are
/// not: Illustrator's pixel is 1/72 in, Inkscape's was 1/90 in and is 1/96 in, and scripts mean anything.
pub(super) fn page(root: Node) -> Page {
    let sides = [side(root, "width"), side(root, "height")];
    let Some(view) = view_box(root) else {
        let physical = sides.iter().flatten().any(|side| side.physical);
        let viewport = match sides {
            [Some(width), Some(height)] => Some([width.pixels, height.pixels]),
            _ => None,
        };
        return Page { unit: physical.then_some(PIXEL), viewport, transform: Affine::IDENTITY };
    };
    let per_unit = |side: Option<Side>, length: f64| {
        side.filter(|s| s.physical).map(|s| s.number / length * s.metre)
    };
    let (across, along) = (per_unit(sides[0], view.w), per_unit(sides[1], view.h));
    let ratio = aspect(root);
    let (unit, transform) = match (across, along) {
        (Some(x), Some(y)) if ratio.align == Align::None && (x - y).abs() > SAME * x => {
            (Some(x), Affine::scaling(1.0, y / x))
        }
        (Some(x), Some(y)) if (x - y).abs() > SAME * x => {
            (Some(if ratio.slice { x.max(y) } else { x.min(y) }), Affine::IDENTITY)
        }
        (x, y) => (x.or(y), Affine::IDENTITY),
    };
    Page { unit, viewport: Some([view.w, view.h]), transform }
}

/// Programs round width, height and view box to a few digits; scales closer than this are the same.
const SAME: f64 = 1e-3;

#[derive(Clone, Copy)]
struct Side {
    number: f64,
    /// The length of its unit, m.
    metre: f64,
    pixels: f64,
    physical: bool,
}

fn side(root: Node, name: &str) -> Option<Side> {
    let text = root.attribute(name)?;
    let Length { number, unit } = Length::from_str(text.trim()).ok()?;
    let (metre, physical) = match unit {
        LengthUnit::None | LengthUnit::Px => (PIXEL, false),
        LengthUnit::In => (0.0254, true),
        LengthUnit::Cm => (0.01, true),
        LengthUnit::Mm => (0.001, true),
        LengthUnit::Pt => (0.0254 / 72.0, true),
        LengthUnit::Pc => (0.0254 / 6.0, true),
        LengthUnit::Em | LengthUnit::Ex | LengthUnit::Percent => return None,
    };
    let pixels = length(text, Axis::X, None).ok()?;
    (number > 0.0).then_some(Side { number, metre, pixels, physical })
}

fn view_box(node: Node) -> Option<ViewBox> {
    ViewBox::from_str(node.attribute("viewBox")?).ok()
}

fn aspect(node: Node) -> AspectRatio {
    node.attribute("preserveAspectRatio")
        .and_then(|text| AspectRatio::from_str(text).ok())
        .unwrap_or_default()
}

/// The map from inside of a nested `<svg>` or a `<symbol>` with its `viewBox` into a viewport.
/// The equivalent transform of SVG 2, section 8.2. Also returns what percentages inside refer to.
pub(super) fn nested(node: Node, at: Point, size: [Option<f64>; 2]) -> (Affine, Option<Point>) {
    let Some(view) = view_box(node) else {
        let viewport = size[0].zip(size[1]).map(|(width, height)| [width, height]);
        return (Affine::translation(at), viewport);
    };
    let [width, height] = [size[0].unwrap_or(view.w), size[1].unwrap_or(view.h)];
    let ratio = aspect(node);
    let (mut x, mut y) = (width / view.w, height / view.h);
    if ratio.align != Align::None {
        let both = if ratio.slice { x.max(y) } else { x.min(y) };
        (x, y) = (both, both);
    }
    let (left, top) = match ratio.align {
        Align::None | Align::XMinYMin => (0.0, 0.0),
        Align::XMidYMin => (0.5, 0.0),
        Align::XMaxYMin => (1.0, 0.0),
        Align::XMinYMid => (0.0, 0.5),
        Align::XMidYMid => (0.5, 0.5),
        Align::XMaxYMid => (1.0, 0.5),
        Align::XMinYMax => (0.0, 1.0),
        Align::XMidYMax => (0.5, 1.0),
        Align::XMaxYMax => (1.0, 1.0),
    };
    let o = [
        at[0] - view.x * x + left * (width - view.w * x),
        at[1] - view.y * y + top * (height - view.h * y),
    ];
    (Affine { o, ..Affine::scaling(x, y) }, Some([view.w, view.h]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(attributes: &str, unit: Option<f64>, transform: Affine) {
        let text = format!("<svg {attributes}/>");
        let document = roxmltree::Document::parse(&text).unwrap();
        let page = page(document.root_element());
        assert_eq!(page.unit, unit, "{attributes}");
        assert_eq!(page.transform, transform, "{attributes}");
    }

    #[test]
    fn physical_units_say_the_size() {
        let same = Affine::IDENTITY;
        check("width='210mm' height='297mm' viewBox='0 0 210 297'", Some(0.001), same);
        check("width='21cm' height='29.7cm' viewBox='0 0 210 297'", Some(0.01 * 0.1), same);
        check("width='2in' viewBox='0 0 144 72'", Some(2.0 / 144.0 * 0.0254), same);
        check("width='72pt' viewBox='0 0 72 72'", Some(0.0254 / 72.0), same);
        check("width='10mm' height='10mm'", Some(0.0254 / 96.0), same);
        check("width='595.28px' height='841.89px' viewBox='0 0 595.28 841.89'", None, same);
        check("width='100' height='100'", None, same);
        check("width='100%' height='100%' viewBox='0 0 10 10'", None, same);
        check("viewBox='0 0 612 792'", None, same);
        check("width='20mm' height='10mm' viewBox='0 0 10 10'", Some(0.001), same);
        check(
            "width='20mm' height='10mm' viewBox='0 0 10 10' preserveAspectRatio='xMinYMin slice'",
            Some(0.002),
            same,
        );
        let stretched = Affine::scaling(1.0, 0.5);
        check(
            "width='20mm' height='10mm' viewBox='0 0 10 10' preserveAspectRatio='none'",
            Some(0.002),
            stretched,
        );
        check("width='-5mm' viewBox='0 0 5 5'", None, same);
        check("width='5mm' viewBox='0 0 0 0'", Some(0.0254 / 96.0), same);
    }
}
