//! A cut as SVG: one unit is one millimetre, and width and height say so.

use std::fmt::Write;

use super::{Cut, Hole, Layer, Line, Ring};

/// Colours by Origami Simulator's convention: black is the border of the sheet, green is a cut.
const BORDER: &str = "#000000";
const CUT: &str = "#00ff00";
/// Width of lines, mm: many lasers cut only what is this thin.
const STROKE: f64 = 0.1;

/// Writes layers on one sheet, each as a group.
pub fn svg(cut: &Cut, layers: &[&Layer], title: &str) -> String {
    let [width, height] = cut.size.map(number);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" \
         viewBox=\"0 0 {width} {height}\">\n<title>{}</title>\n",
        escaped(title)
    );
    let frame = Frame { left: cut.corner[0], top: cut.corner[1] + cut.size[1] };
    for layer in layers {
        let name = escaped(&layer.name());
        let pieces = layer.pieces.iter().map(|piece| {
            let rings = std::iter::once(&piece.outline).chain(&piece.holes);
            rings.map(|ring| frame.ring(ring)).collect::<Vec<_>>().join(" ")
        });
        group(&mut svg, &name, BORDER, pieces);
        for (kind, lines) in [("slits", &layer.slits), ("perforation", &layer.perforation)] {
            if !lines.is_empty() {
                group(
                    &mut svg,
                    &format!("{name}-{kind}"),
                    CUT,
                    lines.iter().map(|line| frame.line(line)),
                );
            }
        }
    }
    if !cut.registration.is_empty() {
        // Writing to a string cannot fail.
        let _ = writeln!(svg, "<g id=\"registration\" {}>", style(BORDER));
        for Hole { center, diameter } in &cut.registration {
            let [x, y] = frame.place(*center);
            let _ =
                writeln!(svg, "<circle cx=\"{x}\" cy=\"{y}\" r=\"{}\"/>", number(diameter / 2.0));
        }
        svg.push_str("</g>\n");
    }
    svg + "</svg>\n"
}

fn group(svg: &mut String, id: &str, color: &str, paths: impl Iterator<Item = String>) {
    let _ = writeln!(svg, "<g id=\"{id}\" {}>", style(color));
    for path in paths {
        let _ = writeln!(svg, "<path d=\"{path}\"/>");
    }
    svg.push_str("</g>\n");
}

fn style(color: &str) -> String {
    format!("fill=\"none\" stroke=\"{color}\" stroke-width=\"{STROKE}\"")
}

/// The sheet: in SVG, y points downwards.
struct Frame {
    left: f64,
    top: f64,
}

impl Frame {
    fn place(&self, [x, y]: [f64; 2]) -> [String; 2] {
        [number(x - self.left), number(self.top - y)]
    }

    fn points<'a>(&self, points: impl IntoIterator<Item = &'a [f64; 2]>) -> String {
        let places = points.into_iter().map(|point| self.place(*point).join(","));
        places.collect::<Vec<_>>().join(" L")
    }

    fn ring(&self, ring: &Ring) -> String {
        format!("M{} Z", self.points(ring))
    }

    fn line(&self, line: &Line) -> String {
        format!("M{}", self.points(line))
    }
}

/// A length, mm, to a tenth of a micrometre.
fn number(x: f64) -> String {
    let text = format!("{x:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
