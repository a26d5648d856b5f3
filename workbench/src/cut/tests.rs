//! Cuts of models whose areas and lengths are known.

use lamc::source::{SourceFile, parse};

use super::*;

/// Two squares of 20 mm, hinged along their common edge; a layer of card ends 1 mm before it.
const BOOK: &str = "name: book
units: { length: mm }
materials: { card: { density: 700, thickness: 0.3 }, film: { density: 1400, thickness: 0.05 } }
layup: [card, film]
bodies:
  left:
    fixed: true
    layers:
      - - outline: [[0, 0], [19, 0], [19, 20], [0, 20]]
          holes: [[[5, 5], [9, 5], [9, 9], [5, 9]]]
      - - outline: [[0, 0], [20, 0], [20, 20], [0, 20]]
  right:
    layers:
      - - outline: [[21, 0], [40, 0], [40, 20], [21, 20]]
      - - outline: [[20, 0], [40, 0], [40, 20], [20, 20]]
joints: { fold: { bodies: [left, right], axis: [[20, 0], [20, 20]] } }
";

fn model(text: &str) -> SourceModel {
    let file = SourceFile { path: "book.yaml".into(), text: text.into() };
    parse(&file).unwrap_or_else(|errors| panic!("{}", errors.render(&file, false))).0
}

fn cut_of(text: &str, options: &Options) -> Cut {
    cut(&model(text), options).unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} is not {expected}");
}

/// 2 x 19 x 20 - 4^2 of card in two pieces, 40 x 20 of film in one.
#[test]
fn film_is_one_piece() {
    let cut = cut_of(BOOK, &Options::default());
    let [card, film] = cut.layers.as_slice() else { panic!("{cut:?}") };
    assert_eq!((card.name(), film.name()), ("1_card".into(), "2_film".into()));
    assert_eq!((card.pieces.len(), film.pieces.len()), (2, 1));
    assert_eq!(film.pieces[0].outline.len(), 4, "{:?}", film.pieces);
    near(card.area(), 2.0 * 19.0 * 20.0 - 16.0, 1e-6);
    near(film.area(), 800.0, 1e-5);
    near(film.length(), 120.0, 1e-5);
    assert_eq!((cut.corner, cut.size), ([-5.0; 2], [50.0, 30.0]));
    assert!(cut.loose.is_empty() && cut.empty.is_empty() && film.slits.is_empty());
}

/// A square of side a becomes one of side a + k, and its hole of side b one of side b - k.
#[test]
fn kerf_moves_every_line_by_half_of_it() {
    let kerf = 0.2;
    let cut = cut_of(BOOK, &Options { kerf, ..Options::default() });
    let [card, film] = cut.layers.as_slice() else { panic!("{cut:?}") };
    near(card.area(), 2.0 * (19.0 + kerf) * (20.0 + kerf) - (4.0 - kerf) * (4.0 - kerf), 1e-5);
    near(film.area(), (40.0 + kerf) * (20.0 + kerf), 1e-5);
    let hole = card.pieces.iter().flat_map(|piece| &piece.holes).flatten();
    let least = hole.map(|[x, _]| *x).fold(f64::INFINITY, f64::min);
    near(least, 5.0 + kerf / 2.0, 1e-6);
}

#[test]
fn kerfs_that_destroy_parts_are_refused() {
    let fails = |text: &str, options: Options| cut(&model(text), &options).unwrap_err();
    let with = |kerf: f64| Options { kerf, ..Options::default() };
    assert!(matches!(fails(BOOK, with(4.5)), CutError::KerfOfHole { layer: 1, .. }));
    assert!(matches!(fails(BOOK, with(19.5)), CutError::KerfOfPiece { layer: 1, .. }));
    assert!(matches!(fails(BOOK, with(2.5)), CutError::KerfOfGap { layer: 1, .. }));
    let perforation = Some(Perforation { cut: 0.1, bridge: 1.0 });
    let fine = Options { kerf: 0.1, perforation, ..Options::default() };
    assert!(matches!(fails(BOOK, fine), CutError::KerfOfPerforation { .. }));
    let holes = Options { kerf: 1.0, registration: Some(0.5), ..Options::default() };
    assert!(matches!(fails(BOOK, holes), CutError::KerfOfRegistration { .. }));
}

#[test]
fn a_model_without_plates_is_refused() {
    let massive = "bodies: { a: { fixed: true }, b: { mass: 1, com: [1, 0, 0], inertia: \
                   [[1, 0, 0], [0, 1, 0], [0, 0, 1]] } }\n\
                   joints: { j: { bodies: [a, b], axis: [[0, 0], [0, 1]] } }";
    assert_eq!(cut(&model(massive), &Options::default()).unwrap_err(), CutError::NoPlates);
}

/// 20 mm: n cuts of 2 mm and n + 1 bridges of 1 mm are at most 20 mm for n = 6, which leaves 1.5 mm at
/// both ends.
#[test]
fn perforation_leaves_bridges() {
    let perforation = Some(Perforation { cut: 2.0, bridge: 1.0 });
    for kerf in [0.0, 0.1] {
        let cut = cut_of(BOOK, &Options { perforation, kerf, ..Options::default() });
        let [card, film] = cut.layers.as_slice() else { panic!("{cut:?}") };
        assert!(card.perforation.is_empty());
        assert_eq!(film.perforation.len(), 6);
        for (number, [from, to]) in film.perforation.iter().enumerate() {
            let start = 1.5 + 3.0 * number as f64;
            near(from[0], 20.0, 1e-9);
            near(from[1], start + kerf / 2.0, 1e-9);
            near(to[1], start + 2.0 - kerf / 2.0, 1e-9);
        }
    }
    let [fits, just, short] =
        [20.0, 4.0, 3.9].map(|length| Perforation { cut: 2.0, bridge: 1.0 }.count(length));
    assert_eq!((fits, just, short), (6, 1, 0));
}

/// A slit within a body is cut in each layer in which the body has plates, whatever the kerf.
#[test]
fn slits_of_bodies_are_cut() {
    let with = BOOK
        .replace("  left:\n", "  left:\n    slits: [[[2, 12], [12, 15]]]\n")
        .replace("  right:\n", "  right:\n    slits: [[[25, 5], [35, 5]]]\n")
        .replace("- - outline: [[21, 0], [40, 0], [40, 20], [21, 20]]", "- []");
    for kerf in [0.0, 0.2] {
        let options = Options { kerf, ..Options::default() };
        let cut = cut_of(&with, &options);
        let [card, film] = cut.layers.as_slice() else { panic!("{cut:?}") };
        let [left, right] = [[[2.0, 12.0], [12.0, 15.0]], [[25.0, 5.0], [35.0, 5.0]]];
        for (layer, expected) in [(card, &[left][..]), (film, &[left, right])] {
            assert_eq!(layer.slits.len(), expected.len());
            for (found, expected) in layer.slits.as_flattened().iter().zip(expected.as_flattened())
            {
                near(found[0], expected[0], 1e-12);
                near(found[1], expected[1], 1e-12);
            }
        }
        let around = 2.0 * (40.0 + kerf) + 2.0 * (20.0 + kerf);
        near(film.length(), around + 109_f64.sqrt() + 10.0, 1e-5);
    }
}

/// Without the hinge the common edge is cut; with a hinge on one half of it, the other half is.
#[test]
fn edges_without_a_hinge_are_slits() {
    let half = BOOK.replace("axis: [[20, 0], [20, 20]]", "axis: [[20, 0], [20, 12]]");
    let cut = cut_of(&half, &Options::default());
    let film = &cut.layers[1];
    assert_eq!((film.pieces.len(), film.slits.len()), (1, 1));
    let [a, b] = film.slits[0];
    let mut ends = [a[1], b[1]];
    ends.sort_by(f64::total_cmp);
    near(ends[0], 12.0, 1e-9);
    near(ends[1], 20.0, 1e-9);
    near(film.length(), 128.0, 1e-5);
}

/// An outline that fills both layers: the card has to be cut along the hinge, the film not.
#[test]
fn one_layer_bridges_a_hinge() {
    let filled = BOOK.replace("[19, 0], [19, 20]", "[20, 0], [20, 20]");
    let filled = filled.replace(
        "[[21, 0], [40, 0], [40, 20], [21, 20]]",
        "[[20, 0], [40, 0], [40, 20], [20, 20]]",
    );
    for (film, slits) in [(None, [1, 0]), (Some("film"), [1, 0]), (Some("card"), [0, 1])] {
        let options = Options { film: film.map(str::to_owned), ..Options::default() };
        let cut = cut_of(&filled, &options);
        let found: Vec<_> = cut.layers.iter().map(|layer| layer.slits.len()).collect();
        assert_eq!(found, slits, "{film:?}");
    }
    let options = Options { film: Some("foil".into()), ..Options::default() };
    assert_eq!(cut(&model(BOOK), &options).unwrap_err(), CutError::UnknownFilm("foil".into()));
    // The height of the hinge line counts before the thickness.
    let low = filled.replace("axis: [[20, 0], [20, 20]]", "z: 0.1, axis: [[20, 0], [20, 20]]");
    let cut = cut_of(&low, &Options::default());
    assert_eq!(cut.layers.iter().map(|layer| layer.slits.len()).collect::<Vec<_>>(), [0, 1]);
}

/// popupCAD leaves a narrow gap at each hinge: closed on demand, and reported otherwise.
#[test]
fn gaps_at_hinges_are_closed() {
    let split =
        BOOK.replace("[20, 0], [20, 20], [0, 20]]", "[19.99, 0], [19.99, 20], [0, 20]]").replace(
            "[[20, 0], [40, 0], [40, 20], [20, 20]]",
            "[[20.01, 0], [40, 0], [40, 20], [20.01, 20]]",
        );
    let open = cut_of(&split, &Options::default());
    assert_eq!(open.layers[1].pieces.len(), 2);
    let [Loose { joint, gap: Some((gap, layer)) }] = open.loose.as_slice() else {
        panic!("{open:?}")
    };
    assert_eq!((joint.as_str(), *layer), ("fold", 2));
    near(*gap, 0.02, 1e-9);
    let closed = cut_of(&split, &Options { bridge: Some(0.05), ..Options::default() });
    assert!(closed.loose.is_empty());
    assert_eq!(closed.layers[1].pieces.len(), 1);
    near(closed.layers[1].area(), 800.0, 1e-4);
}

#[test]
fn registration_holes_are_two_diameters_away() {
    let options = Options { registration: Some(3.0), kerf: 0.1, ..Options::default() };
    let cut = cut_of(BOOK, &options);
    // The pieces are larger by half the kerf on each side.
    let near_corner = |hole: &Hole, [x, y]: [f64; 2]| {
        near(hole.center[0], x, 1e-6);
        near(hole.center[1], y, 1e-6);
        near(hole.diameter, 2.9, 1e-12);
    };
    let [a, b, c, d] = cut.registration.as_slice() else { panic!("{cut:?}") };
    near_corner(a, [-6.05, -6.05]);
    near_corner(b, [46.05, -6.05]);
    near_corner(c, [46.05, 26.05]);
    near_corner(d, [-6.05, 26.05]);
    near(cut.size[0], 52.1 + 2.9 + 10.0, 1e-6);
    let ring = a.ring();
    assert_eq!(ring.len(), 64);
}

#[test]
fn svg_says_its_size_and_points_upwards() {
    let options =
        Options { perforation: Some(Perforation { cut: 18.0, bridge: 1.0 }), ..Options::default() };
    let cut = cut_of(BOOK, &Options { registration: Some(2.0), ..options });
    let text = svg(&cut, &[&cut.layers[1]], "a < b");
    assert!(text.contains("width=\"60mm\" height=\"40mm\" viewBox=\"0 0 60 40\""), "{text}");
    assert!(text.contains("<title>a &lt; b</title>"), "{text}");
    // The lower end of the cut, at (20, 1), is at 40 - 10 - 1 from the top.
    assert!(text.contains("M30,29 L30,11"), "{text}");
    assert_eq!(text.matches("<circle").count(), 4);
    let document = resvg::usvg::Tree::from_str(&text, &resvg::usvg::Options::default()).unwrap();
    near(f64::from(document.size().width()), 60.0 * 96.0 / 25.4, 1e-3);
}
