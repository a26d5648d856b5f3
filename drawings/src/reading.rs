//! Which reader reads a file, and how.

use crate::drawing::{Drawing, Place, Role};
use crate::fault::{Cause, Fault};
use crate::{dxf, fold, limits, svg};

/// How a file is read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reading {
    /// How far the lines that replace a curve may be from it, in units of the drawing. None: the 2000th part of
    /// the larger side of the drawing.
    pub flatness: Option<f64>,
    /// The roles of the layers of a DXF file. Upper and lower case are the same. If this is not empty, lines on
    /// other layers are ignored. A name that no layer has may be a colour: a name from `red` to `black`, or a
    /// number from 1 to 255.
    pub layers: Vec<(Role, String)>,
    /// The frame of a FOLD file that is read; None: the one that the file itself is.
    pub frame: Option<usize>,
}

/// A format of drawings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// Scalable Vector Graphics, in the convention of Origami Simulator: the role of a line is the hue of its
    /// stroke.
    ///
    /// | hue of the stroke, degrees | role |
    /// |---|---|
    /// | none and dark: black | [`Role::Border`] |
    /// | 330 to 30: red | [`Role::Mountain`] |
    /// | 45 to 90: yellow | [`Role::Flat`] |
    /// | 90 to 150: green | [`Role::Cut`] |
    /// | 195 to 270: blue | [`Role::Valley`] |
    /// | 270 to 330: magenta | [`Role::Hinge`] |
    ///
    /// Opacity, times that of the groups around, is the target angle of mountains and valleys over 180 degrees;
    /// a line for which no opacity is written has no target angle. Shapes without stroke, strokes in white, grey,
    /// cyan or orange, and what is hidden are counted as ignored.
    /// The unit is known if the width or height of the page is in mm, cm, in, pt or pc.
    Svg,
    /// FOLD (edemaine/fold), 1.1 and 1.2.
    Fold,
    /// AutoCAD's Drawing Exchange Format, as text or binary. The role of a line comes from [`Reading::layers`];
    /// without them from the name of its layer (such as `mountain`, `valley`, `cut`, `outline`, `crease`), and
    /// otherwise from its colour, as in SVG. The unit is `$INSUNITS`. Lines of DXF have no target angles.
    Dxf,
}

/// How far the beginning of a file is searched for `<svg`, bytes: Illustrator writes a page of comments and
/// entities before.
const HEAD: usize = 16 << 10;

impl Format {
    /// Returns the format of a file: by its contents, and if these do not tell, by the extension of its name.
    pub fn of(path: &str, bytes: &[u8]) -> Option<Format> {
        Format::of_contents(bytes).or_else(|| {
            let (_, extension) = path.rsplit_once('.')?;
            match extension.to_ascii_lowercase().as_str() {
                "svg" | "svgz" => Some(Format::Svg),
                "fold" => Some(Format::Fold),
                "dxf" => Some(Format::Dxf),
                _ => None,
            }
        })
    }

    fn of_contents(bytes: &[u8]) -> Option<Format> {
        if bytes.starts_with(dxf::SENTINEL) {
            return Some(Format::Dxf);
        }
        let head = String::from_utf8_lossy(&bytes[..bytes.len().min(HEAD)]);
        let head = head.trim_start_matches('\u{feff}').trim_start();
        if head.starts_with('<') {
            return head.contains("<svg").then_some(Format::Svg);
        }
        if head.starts_with('{') {
            return Some(Format::Fold);
        }
        let mut lines = head.lines().map(str::trim);
        let is_dxf = match (lines.next(), lines.next()) {
            (Some("0"), Some(kind)) => kind.eq_ignore_ascii_case("SECTION"),
            (Some("999"), Some(_)) => true,
            _ => false,
        };
        is_dxf.then_some(Format::Dxf)
    }
}

/// Reads a drawing.
///
/// # Errors
///
/// What is wrong with the file, or with the reading, each with its position in the text.
pub fn read(format: Format, bytes: &[u8], reading: &Reading) -> Result<Drawing, Vec<Fault>> {
    if bytes.len() > limits::BYTES {
        return Err(vec![Fault {
            cause: Cause::Limit,
            message: format!(
                "the file has {} bytes; lamc reads up to {}",
                bytes.len(),
                limits::BYTES
            ),
            place: None,
            at: Vec::new(),
            hint: Some(
                "remove embedded images, fonts and what is not a line of the pattern".into(),
            ),
        }]);
    }
    if let Some(flatness) = reading.flatness
        && !(flatness > 0.0 && flatness.is_finite())
    {
        return Err(vec![Fault {
            cause: Cause::Number,
            message: format!("the flatness is {flatness}; it must be a positive number"),
            place: None,
            at: Vec::new(),
            hint: None,
        }]);
    }
    let mut drawing = match format {
        Format::Svg => svg::read(text(bytes)?, reading.flatness),
        Format::Fold => fold::read(text(bytes)?, reading.frame),
        Format::Dxf => dxf::read(bytes, &reading.layers, reading.flatness),
    }?;
    drawing.doubts.extend(unused_layers(format, &reading.layers));
    Ok(drawing)
}

/// Returns a doubt about names of layers where layers say nothing.
fn unused_layers(format: Format, layers: &[(Role, String)]) -> Option<Fault> {
    let (what, meaning) = match format {
        Format::Svg => ("SVG", "the colour of its stroke"),
        Format::Fold => ("FOLD", "its assignment"),
        Format::Dxf => return None,
    };
    let (_, name) = layers.first()?;
    Some(Fault {
        cause: Cause::Layers,
        message: format!("the layer `{name}` changes nothing: layers of {what} are not read"),
        place: None,
        at: Vec::new(),
        hint: Some(format!("what a line of {what} means is {meaning}")),
    })
}

/// The file as text. A byte order mark stays, so that positions are those of the file.
fn text(bytes: &[u8]) -> Result<&str, Vec<Fault>> {
    std::str::from_utf8(bytes).map_err(|error| {
        let hint = match bytes {
            [0x1f, 0x8b, ..] => {
                "the file is compressed (SVGZ): save it as plain SVG, or decompress it with gunzip"
            }
            [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => "the file is UTF-16: save it as UTF-8",
            _ => "save the file as UTF-8",
        };
        let at = error.valid_up_to();
        vec![Fault {
            cause: Cause::Syntax,
            message: format!("byte {at} is not UTF-8"),
            place: Some(Place { start: at, end: at + 1 }),
            at: Vec::new(),
            hint: Some(hint.into()),
        }]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(path: &str, contents: &str, format: Option<Format>) {
        assert_eq!(Format::of(path, contents.as_bytes()), format, "{path}: {contents}");
    }

    #[test]
    fn contents_come_before_the_extension() {
        check("a", "<?xml version='1.0'?>\n<!-- x --><svg/>", Some(Format::Svg));
        check("a.dxf", "\u{feff}<svg/>", Some(Format::Svg));
        check("a.svg", " {\"file_spec\": 1.1}", Some(Format::Fold));
        check("a.txt", "  0\r\nSECTION\r\n  2\r\nHEADER\r\n", Some(Format::Dxf));
        check("a.txt", "999\nby hand\n0\nSECTION\n", Some(Format::Dxf));
        check("a.txt", "AutoCAD Binary DXF\r\n\u{1a}\0", Some(Format::Dxf));
        check("a.SVG", "<html>", Some(Format::Svg));
        check("a.fold", "", Some(Format::Fold));
        check("a.dxf", "", Some(Format::Dxf));
        check("a.yaml", "bodies:", None);
        check("svg", "", None);
    }

    #[test]
    fn layers_without_a_meaning_are_said() {
        let layers = vec![(Role::Mountain, "folds".to_owned())];
        let reading = Reading { layers, ..Reading::default() };
        let line = b"<svg xmlns='http://www.w3.org/2000/svg'><line stroke='red' x2='1'/></svg>";
        let edge = br#"{"vertices_coords": [[0,0],[1,0]], "edges_vertices": [[0,1]]}"#;
        for (format, bytes) in [(Format::Svg, &line[..]), (Format::Fold, &edge[..])] {
            assert_eq!(read(format, bytes, &Reading::default()).unwrap().doubts, []);
            let doubts = read(format, bytes, &reading).unwrap().doubts;
            assert!(doubts.len() == 1 && doubts[0].message.contains("`folds`"), "{doubts:?}");
        }
    }

    #[test]
    fn what_is_no_text_is_refused() {
        let fault =
            |bytes: &[u8]| read(Format::Svg, bytes, &Reading::default()).unwrap_err().remove(0);
        assert_eq!(fault(b"<svg>\xff</svg>").place, Some(Place { start: 5, end: 6 }));
        assert!(fault(&[0x1f, 0x8b, 8]).hint.is_some_and(|h| h.contains("SVGZ")));
        assert!(fault(&[0xff, 0xfe, 60, 0]).hint.is_some_and(|h| h.contains("UTF-16")));
        let reading = Reading { flatness: Some(f64::NAN), ..Reading::default() };
        assert_eq!(read(Format::Svg, b"<svg/>", &reading).unwrap_err()[0].cause, Cause::Number);
        let large = vec![b' '; limits::BYTES + 1];
        assert_eq!(
            read(Format::Dxf, &large, &Reading::default()).unwrap_err()[0].cause,
            Cause::Limit
        );
    }
}
