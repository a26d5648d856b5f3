//! A layer's geometry: polygons as well-known text (OGC 06-103r4), as shapely writes them.

use std::str::FromStr;

use wkt::Wkt;
use wkt::types::{LineString, Polygon};

use super::{Import, head};
use crate::source::codes::{self, Code};
use crate::source::diagnostic::{Diagnostic, Span, Spanned};
use crate::source::drawn::Drawn;
use crate::source::fields::items;
use crate::source::model::{MAX_VERTICES, Plate};
use crate::source::yaml::Node;

/// Deepest nesting of parentheses, because the reader is recursive. A collection of multipolygons
/// has five levels.
const MAX_DEPTH: usize = 8;

/// Why a text is not read as polygons.
struct Refusal {
    code: Code,
    reason: String,
}

impl<T: Into<String>> From<T> for Refusal {
    fn from(reason: T) -> Self {
        Self { code: codes::BAD_POLYGON, reason: reason.into() }
    }
}

impl Import {
    /// Returns all plates of a layer, in file order.
    pub(super) fn layer(&mut self, node: &Node) -> Option<Vec<Plate>> {
        let geometries = self.require(node, head(node), "geoms")?;
        let texts = items(geometries, "a list of polygons as text", &mut self.diagnostics)?;
        let plates: Vec<_> = texts.iter().map(|text| self.geometry(text)).collect();
        plates.into_iter().collect::<Option<Vec<_>>>().map(|plates| plates.concat())
    }

    fn geometry(&mut self, node: &Node) -> Option<Vec<Plate>> {
        let text = node.scalar().map_or("", |scalar| &scalar.text);
        let read = balanced(text).and_then(|()| Wkt::<f64>::from_str(text));
        let read = read.map_err(Refusal::from).and_then(|geometry| {
            let mut plates = Vec::new();
            collect(geometry, node, &mut plates).map(|()| plates)
        });
        match read {
            Ok(plates) => {
                let is_number = |c: char| c.is_ascii_digit() || "+-.eE".contains(c);
                let numbers = text.split(|c| !is_number(c)).filter(|word| word.contains('.'));
                numbers.for_each(|number| self.decimals.note(number, self.length));
                Some(plates)
            }
            Err(refusal) => {
                let hint = "a layer holds `POLYGON ((x y, ..))` or `MULTIPOLYGON`, with holes";
                self.refuse(refusal, node.span, hint)
            }
        }
    }

    /// Reads a ring of vertices.
    pub(super) fn ring(
        &mut self,
        vertices: Vec<[f64; 2]>,
        node: &Node,
    ) -> Option<Spanned<Vec<[f64; 2]>>> {
        let hint = "a layer holds polygons, with holes";
        ring(vertices, node).map_or_else(|refusal| self.refuse(refusal, node.span, hint), Some)
    }

    fn refuse<T>(&mut self, refusal: Refusal, at: Span, hint: &str) -> Option<T> {
        let message = format!("not a polygon: {}", refusal.reason);
        self.diagnostics.push(Diagnostic::error(refusal.code, at, message).hint(hint));
        None
    }
}

/// Reads one geometry, which must be the whole text, with limited nesting.
fn balanced(text: &str) -> Result<(), &'static str> {
    let mut depth = 0_usize;
    let mut closed = false;
    for character in text.chars() {
        match character {
            _ if closed && !character.is_whitespace() => return Err("text after the geometry"),
            '(' => depth += 1,
            ')' if depth == 0 => return Err("there is one `)` too many"),
            ')' => {
                depth -= 1;
                closed = depth == 0;
            }
            _ => {}
        }
        if depth > MAX_DEPTH {
            return Err("nested too deeply");
        }
    }
    Ok(())
}

/// Adds the geometry's polygons.
fn collect(geometry: Wkt<f64>, node: &Node, plates: &mut Vec<Plate>) -> Result<(), Refusal> {
    match geometry {
        Wkt::Polygon(polygon) => plates.extend(plate(&polygon, node)?),
        Wkt::MultiPolygon(polygons) => {
            for polygon in polygons.polygons() {
                plates.extend(plate(polygon, node)?);
            }
        }
        Wkt::GeometryCollection(collection) => {
            for geometry in collection.into_inner().0 {
                collect(geometry, node, plates)?;
            }
        }
        // shapely writes points and lines for a plate that shrank to zero area. They have no mass.
        Wkt::Point(_) | Wkt::MultiPoint(_) | Wkt::LineString(_) | Wkt::MultiLineString(_) => {
            return Err("points and lines have no area".into());
        }
    }
    Ok(())
}

/// Reads a polygon with its holes; `None` if it is empty.
fn plate(polygon: &Polygon<f64>, node: &Node) -> Result<Option<Plate>, Refusal> {
    let Some((outline, holes)) = polygon.rings().split_first() else { return Ok(None) };
    if outline.coords().is_empty() {
        return Ok(None);
    }
    let corners = |line: &LineString<f64>| line.coords().iter().map(|c| [c.x, c.y]).collect();
    let drawn = |line| ring(corners(line), node).map(Drawn::from);
    let holes = holes.iter().map(drawn).collect::<Result<_, _>>()?;
    Ok(Some(Plate { outline: drawn(outline)?, holes }))
}

/// Reads the vertices without repetitions: the first vertex at the end, and equal neighbours, which
/// shapely may write.
fn ring(mut vertices: Vec<[f64; 2]>, node: &Node) -> Result<Spanned<Vec<[f64; 2]>>, Refusal> {
    vertices.dedup();
    if vertices.len() > 1 && vertices.first() == vertices.last() {
        vertices.pop();
    }
    if vertices.len() < 3 {
        return Err(format!(
            "a ring needs at least three vertices, this one has {}",
            vertices.len()
        )
        .into());
    }
    if vertices.len() > MAX_VERTICES {
        let reason = format!("{} vertices, but lamc reads at most {MAX_VERTICES}", vertices.len());
        return Err(Refusal { code: codes::TOO_MANY_VERTICES, reason });
    }
    if !vertices.iter().flatten().all(|x| x.is_finite()) {
        return Err("a vertex is not finite".into());
    }
    Ok(Spanned { value: vertices, span: node.span })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::{units, yaml};

    fn plates(wkt: &str) -> Result<Vec<Plate>, String> {
        let (node, _) = yaml::parse(&format!("geoms: ['{wkt}']")).unwrap();
        let mut import = Import::new(units::SI);
        import.layer(&node).ok_or_else(|| import.diagnostics.to_string())
    }

    #[test]
    fn every_kind_of_layer() {
        const SQUARE: &str = "(0 0, 4 0, 4 4, 0 4, 0 0)";
        const HOLE: &str = "(1 1, 2 1, 2 2, 1 1)";
        for (wkt, holes) in [
            (format!("POLYGON ({SQUARE})"), vec![0]),
            (format!("POLYGON ({SQUARE}, {HOLE})"), vec![1]),
            (format!("MULTIPOLYGON (({SQUARE}, {HOLE}), ({SQUARE}))"), vec![1, 0]),
            (
                format!("GEOMETRYCOLLECTION (POLYGON ({SQUARE}), MULTIPOLYGON (({SQUARE})))"),
                vec![0, 0],
            ),
            ("GEOMETRYCOLLECTION EMPTY".into(), vec![]),
            ("POLYGON EMPTY".into(), vec![]),
            ("MULTIPOLYGON EMPTY".into(), vec![]),
        ] {
            let plates = plates(&wkt).unwrap();
            assert_eq!(plates.iter().map(|p| p.holes.len()).collect::<Vec<_>>(), holes, "{wkt}");
            for plate in plates {
                assert_eq!(plate.outline.value, [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]);
            }
        }
    }

    #[test]
    fn what_is_no_layer() {
        for (wkt, words) in [
            ("LINESTRING (0 0, 1 1)", "no area"),
            ("POLYGON ((0 0, 1 0, 0 0))", "this one has 2"),
            ("POLYGON ((0 0, 1 0, 1 1, 0 0)) and more", "text after"),
            ("POLYGON ((0 0, 1 0, 1 1, 0 0", "not a polygon"),
            ("POLYGON ((0 0, 1e999 0, 1 1, 0 0))", "not finite"),
            ("POLYGON ((0 0, one 0, 1 1, 0 0))", "not a polygon"),
            ("", "not a polygon"),
        ] {
            let error = plates(wkt).unwrap_err();
            assert!(error.contains(words), "{wkt}: {error}");
        }
        let deep = "GEOMETRYCOLLECTION (".repeat(100_000);
        assert!(plates(&deep).unwrap_err().contains("too deeply"));
    }
}
