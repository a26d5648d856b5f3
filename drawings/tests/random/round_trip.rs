//! Random sheets that are written as SVG, and their facets as DXF, and read again.

use std::f64::consts::PI;

use lamc_drawings::{Format, Pattern, Reading, Role, dxf, read, svg};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::sheet::Sheet;
use crate::{Counts, contents, pattern};

fn drawing_of(format: Format, text: &str, reading: &Reading, case: u64) -> lamc_drawings::Drawing {
    read(format, text.as_bytes(), reading)
        .unwrap_or_else(|faults| panic!("case {case}: {faults:?}"))
}

#[test]
fn svg_keeps_all_but_angles_to_the_bit() {
    for case in 0..300 {
        let mut rng = ChaCha8Rng::seed_from_u64(case);
        let mut sheet = Sheet::random(&mut rng).draw(&mut rng);
        // Also the angles at the ends of the range.
        let size = [None, Some(0.0), Some(1e-9), Some(PI)][rng.random_range(0..4)];
        for fold in sheet.strokes.iter_mut().filter_map(|stroke| stroke.fold.as_mut()) {
            *fold = size.map_or(*fold, |size| size.copysign(*fold));
        }
        let first = pattern(&sheet, case);
        let read = drawing_of(Format::Svg, &svg::write(&first), &Reading::default(), case);
        assert!(read.ignored.is_empty(), "case {case}: {:?}", read.ignored);
        let second = pattern(&read, case);
        assert_eq!(Counts::of(&second), Counts::of(&first), "case {case}");
        let ((edges, folds), (first_edges, first_folds)) = (contents(&second), contents(&first));
        assert_eq!(edges, first_edges, "case {case}");
        for (a, b) in folds.into_iter().zip(first_folds) {
            assert_eq!(a.is_some(), b.is_some(), "case {case}");
            let (a, b) = a.zip(b).unwrap_or_default();
            assert!((a - b).abs() < 1e-15, "case {case}: {a}, {b}");
        }
        assert!(second.mended.is_empty(), "case {case}: {:?}", second.mended);
        assert!(second.doubts.is_empty(), "case {case}: {:?}", second.doubts);
    }
}

/// The boundaries of the facets, as coordinates.
fn boundaries(pattern: &Pattern) -> Vec<Vec<[f64; 2]>> {
    let facets = pattern.facets.iter();
    let all = facets.flat_map(|facet| std::iter::once(&facet.outline).chain(&facet.holes));
    let points = all.map(|boundary| boundary.iter().map(|v| pattern.vertices[v.index()]).collect());
    points.collect()
}

#[test]
fn outlines_survive_dxf() {
    for case in 0..300 {
        let mut rng = ChaCha8Rng::seed_from_u64(case);
        let first = pattern(&Sheet::random(&mut rng).draw(&mut rng), case);
        let outlines = boundaries(&first);
        let name = format!("Schnitt ä/{case}");
        let text = dxf::write(&[(name, outlines.clone())], 1e-3);
        let layers = vec![(Role::Border, format!("schnitt ä_{case}"))];
        let reading = Reading { layers, ..Reading::default() };
        let drawing = drawing_of(Format::Dxf, &text, &reading, case);
        assert_eq!(drawing.unit, Some(1e-3));
        // Line by line, to the bit. A slit has two points and is one line.
        let sides = outlines.iter().flat_map(|points| {
            let lines = if points.len() == 2 { 1 } else { points.len() };
            (0..lines).map(|k| [points[k], points[(k + 1) % points.len()]])
        });
        let read: Vec<[[f64; 2]; 2]> = drawing.strokes.iter().map(|stroke| stroke.ends).collect();
        assert_eq!(read, sides.collect::<Vec<_>>(), "case {case}");
    }
}
