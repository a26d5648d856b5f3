//! Writes a pattern as SVG.

use std::f64::consts::PI;
use std::fmt::Write;

use crate::drawing::Role;
use crate::pattern::{Pattern, bounds};

/// The width of lines and of the margin, as parts of the larger extent of the pattern.
const LINE: f64 = 1.0 / 300.0;
const MARGIN: f64 = 1.0 / 50.0;

/// Returns a pattern as SVG: one line for each edge, in units of the drawing.
///
/// Borders are black, mountains red, valleys blue, cuts green, flat lines yellow, undriven hinges
/// magenta. The opacity of a mountain or valley is its target angle over 180 deg; a crease without a
/// target has no opacity. The y axis of SVG points down: y changes its sign.
pub fn write(pattern: &Pattern) -> String {
    let (low, high) = bounds(pattern.vertices.iter().copied());
    let size = (high[0] - low[0]).max(high[1] - low[1]).max(0.0);
    let (margin, width) = (MARGIN * size, LINE * size);
    let [x, y] = [low[0] - margin, -high[1] - margin];
    let [w, h] = [0, 1].map(|axis| high[axis] - low[axis] + 2.0 * margin);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{x} {y} {w} {h}\">\n\
         <g fill=\"none\" stroke-width=\"{width}\">\n"
    );
    for edge in &pattern.edges {
        let ends = edge.vertices.map(|vertex| pattern.vertices[vertex.index()]);
        let crease = matches!(edge.role, Role::Mountain | Role::Valley);
        let opacity = edge
            .fold
            .filter(|_| crease)
            .map_or(String::new(), |fold| format!(" opacity=\"{:?}\"", fold.abs() / PI));
        let style = format!("stroke=\"{}\"{opacity}", color(edge.role));
        _ = writeln!(text, "{}", line(ends, &style));
    }
    text.push_str("</g>\n</svg>\n");
    text
}

/// Returns a line of SVG with these attributes.
pub(crate) fn line([[x1, y1], [x2, y2]]: [[f64; 2]; 2], attributes: &str) -> String {
    // Adding zero turns -0 into 0.
    let (y1, y2) = (-y1 + 0.0, -y2 + 0.0);
    format!("<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\" {attributes}/>")
}

/// Returns the colour of a role.
pub(crate) fn color(role: Role) -> &'static str {
    match role {
        Role::Border => "#000000",
        Role::Mountain => "#ff0000",
        Role::Valley => "#0000ff",
        Role::Flat => "#ffff00",
        Role::Hinge => "#ff00ff",
        Role::Cut => "#00ff00",
    }
}
