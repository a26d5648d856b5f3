//! Random sheets, drawn as people draw: with noise, in pieces, twice, with crossings and T-junctions
//! without a vertex. What they consist of is known by construction.

mod round_trip;
mod sheet;

use std::collections::BTreeMap;

use lamc_drawings::{Drawing, Edge, Pattern, Role, fold};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::sheet::{Sheet, TOLERANCE};

/// What is counted of a pattern.
#[derive(Debug, PartialEq)]
struct Counts {
    vertices: usize,
    facets: usize,
    holes: usize,
    edges: BTreeMap<Role, usize>,
}

impl Counts {
    fn of(pattern: &Pattern) -> Self {
        let mut edges = BTreeMap::new();
        for edge in &pattern.edges {
            *edges.entry(edge.role).or_default() += 1;
        }
        Self {
            vertices: pattern.vertices.len(),
            facets: pattern.facets.len(),
            holes: pattern.facets.iter().map(|facet| facet.holes.len()).sum(),
            edges,
        }
    }
}

fn areas(pattern: &Pattern) -> Vec<f64> {
    let mut areas: Vec<f64> = pattern.facets.iter().map(|facet| pattern.area(facet)).collect();
    areas.sort_by(f64::total_cmp);
    areas
}

fn pattern(drawing: &Drawing, case: u64) -> Pattern {
    Pattern::of(drawing, Some(TOLERANCE)).unwrap_or_else(|faults| panic!("case {case}: {faults:?}"))
}

/// What an edge says, without the order of its ends: they are given by their exact coordinates.
type Content = ([[u64; 2]; 2], Role);

/// Returns what all edges say, sorted, with their target angles.
fn contents(pattern: &Pattern) -> (Vec<Content>, Vec<Option<f64>>) {
    let content = |edge: &Edge| {
        let mut ends =
            edge.vertices.map(|vertex| pattern.vertices[vertex.index()].map(f64::to_bits));
        ends.sort_unstable();
        ((ends, edge.role), edge.fold)
    };
    let mut all: Vec<(Content, Option<f64>)> = pattern.edges.iter().map(content).collect();
    all.sort_by_key(|(content, _)| *content);
    all.into_iter().unzip()
}

#[test]
fn random_sheets_are_read_as_what_was_drawn() {
    let (mut facets, mut holes, mut slits) = (0, 0, 0);
    for case in 0..1000 {
        let mut rng = ChaCha8Rng::seed_from_u64(case);
        let sheet = Sheet::random(&mut rng);
        let drawn = pattern(&sheet.draw(&mut rng), case);
        let expected = Counts {
            vertices: sheet.vertices(),
            facets: sheet.facets,
            holes: sheet.holes.len() + sheet.slits.len(),
            edges: sheet.edges(),
        };
        assert_eq!(Counts::of(&drawn), expected, "case {case}");
        assert!(drawn.doubts.is_empty(), "case {case}: {:?}", drawn.doubts);

        // Euler's formula. The regions are the facets, the insides of holes, and the outside.
        let components = 1 + sheet.holes.len() + sheet.slits.len();
        let regions = drawn.facets.len() + sheet.holes.len() + 1;
        assert_eq!(
            drawn.vertices.len() + regions,
            drawn.edges.len() + 1 + components,
            "case {case}"
        );

        // Ends move by less than the tolerance, so areas change by less than it times the outline.
        let total: f64 = areas(&drawn).iter().sum();
        let allowed = TOLERANCE * sheet.perimeter();
        assert!((total - sheet.area()).abs() < allowed, "case {case}: {total}, {}", sheet.area());
        facets += sheet.facets;
        holes += sheet.holes.len();
        slits += sheet.slits.len();
    }
    // The sheets are worth reading.
    assert!(facets > 5_000 && holes > 500 && slits > 500, "{facets}, {holes}, {slits}");
}

#[test]
fn export_and_import_change_nothing() {
    for case in 0..1000 {
        let mut rng = ChaCha8Rng::seed_from_u64(case);
        let first = pattern(&Sheet::random(&mut rng).draw(&mut rng), case);
        let text = fold::write(&first, Some(1e-3));
        let read =
            fold::read(&text, None).unwrap_or_else(|faults| panic!("case {case}: {faults:?}"));
        assert_eq!(read.unit, Some(1e-3));
        let second = pattern(&read, case);
        assert_eq!(Counts::of(&second), Counts::of(&first), "case {case}");
        let ((edges, folds), (first_edges, first_folds)) = (contents(&second), contents(&first));
        assert_eq!(edges, first_edges, "case {case}");
        for (a, b) in folds.into_iter().zip(first_folds) {
            assert_eq!(a.is_some(), b.is_some(), "case {case}");
            let (a, b) = a.zip(b).unwrap_or_default();
            assert!((a - b).abs() < 1e-12, "case {case}: {a}, {b}");
        }
        for (a, b) in areas(&second).into_iter().zip(areas(&first)) {
            // The outline may begin at another vertex.
            assert!((a - b).abs() < 1e-9, "case {case}: {a}, {b}");
        }
        assert!(second.mended.is_empty(), "case {case}: {:?}", second.mended);
        assert!(second.doubts.is_empty(), "case {case}: {:?}", second.doubts);
    }
}
