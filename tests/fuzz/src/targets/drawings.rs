//! Drawings: any bytes as SVG, FOLD and DXF, with all that `lamc import` does with them, and any text as what
//! a model says of a drawing.

use std::sync::OnceLock;

use lamc::source::pattern::{Options, import};
use lamc::source::{self, SourceFile};
use lamc_drawings::{Drawing, Format, Pattern, Reading, fold, svg};
use tempfile::TempDir;

use super::{parsed, read, text};

/// Any text as an SVG.
pub(super) fn read_svg(input: &[u8]) {
    drawing(Format::Svg, "drawing.svg", input);
}

/// Any text as a FOLD file.
pub(super) fn read_fold(input: &[u8]) {
    drawing(Format::Fold, "drawing.fold", input);
}

/// Any bytes as a DXF file.
pub(super) fn read_dxf(input: &[u8]) {
    drawing(Format::Dxf, "drawing.dxf", input);
}

/// Any text as the key `pattern` of a model.
pub(super) fn pattern(input: &[u8]) {
    /// A square with a diagonal, and a square beside it with a hole.
    const SHEET: &str = "<svg width=\"40mm\" viewBox=\"0 0 40 20\">\
        <path stroke=\"#000\" d=\"M0 0H40V20H0ZM25 5V15H35V5Z\"/>\
        <path stroke=\"red\" opacity=\".5\" d=\"M0 0 20 20\"/>\
        <path stroke=\"blue\" d=\"M20 0V20\"/></svg>";
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("a.svg"), SHEET).expect("a file");
        folder
    });
    let path = folder.path().join("model.yaml").display().to_string();
    let text = format!(
        "materials: {{ card: {{ density: 700, thickness: 3e-4, youngs_modulus: 2e9 }} }}
layup: [card]
pattern:
  file: a.svg
{}",
        text(input)
    );
    let file = SourceFile { path, text };
    // What a pattern becomes has no drawing any more, and is read again in `parsed`.
    let _ = parsed(&file);
}

fn drawing(format: Format, path: &str, input: &[u8]) {
    let Ok(drawing) = lamc_drawings::read(format, input, &Reading::default()) else {
        // By its contents it may be a drawing of another format.
        assert!(imported(path, input).is_none_or(|_| Format::of(path, input) != Some(format)));
        return;
    };
    if let Ok(pattern) = Pattern::of(&drawing, None) {
        // In units of the drawing, coordinates keep their bits.
        same_lines(&pattern, Format::Fold, &fold::write(&pattern, None));
        same_lines(&pattern, Format::Svg, &svg::write(&pattern));
    }
    if let Some(model) = imported(path, input) {
        let file = SourceFile { path: "model.yaml".into(), text: model.clone() };
        assert!(source::parse(&file).is_ok(), "what was imported cannot be read:\n{model}");
        read(&model);
    }
}

/// Returns the model that `lamc import` writes.
fn imported(path: &str, input: &[u8]) -> Option<String> {
    let imported = import(path, input.to_vec(), "drawing", &Options::default());
    assert!(imported.yaml.is_some() || imported.found.has_errors(), "a refusal says why");
    imported.yaml
}

/// What was written has the lines of the pattern.
fn same_lines(pattern: &Pattern, format: Format, text: &str) {
    let Drawing { strokes, .. } = lamc_drawings::read(format, text.as_bytes(), &Reading::default())
        .unwrap_or_else(|faults| panic!("what was written cannot be read:\n{text}\n{faults:?}"));
    assert_eq!(strokes.len(), pattern.edges.len(), "{text}");
    for (stroke, edge) in strokes.iter().zip(&pattern.edges) {
        assert_eq!(stroke.role, edge.role, "{text}");
        assert_eq!(stroke.ends, edge.vertices.map(|vertex| pattern.vertices[vertex.index()]));
    }
}
