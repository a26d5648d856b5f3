//! Strokes between points of a small lattice: everything lies on everything. Whatever is drawn, a pattern
//! is planar, and its facets fit its edges.

use lamc_drawings::{Drawing, FacetId, Pattern, Place, Role, Stroke, fold};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const ROLES: [Role; 6] =
    [Role::Border, Role::Mountain, Role::Valley, Role::Flat, Role::Hinge, Role::Cut];

/// Draws strokes between points with integer coordinates, inside a border or without one.
fn draw(rng: &mut ChaCha8Rng) -> Drawing {
    let size = rng.random_range(2..8_i32);
    let mut strokes = Vec::new();
    let mut add = |ends: [[i32; 2]; 2], role: Role| {
        let place = Place { start: strokes.len(), end: strokes.len() + 1 };
        let ends = ends.map(|end| end.map(f64::from));
        strokes.push(Stroke { ends, role, fold: None, angle: None, place });
    };
    if rng.random_bool(0.7) {
        let corners = [[0, 0], [size, 0], [size, size], [0, size]];
        for index in 0..4 {
            add([corners[index], corners[(index + 1) % 4]], Role::Border);
        }
    }
    let roles = rng.random_range(1..=ROLES.len());
    for _ in 0..rng.random_range(1..30) {
        let mut point = || [rng.random_range(0..=size), rng.random_range(0..=size)];
        let ends = [point(), point()];
        add(ends, ROLES[rng.random_range(0..roles)]);
    }
    Drawing { strokes, ..Drawing::default() }
}

type Point = [f64; 2];

/// Twice the area of a triangle: exact for the integers and far from rounding for crossings of theirs.
fn turn(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Whether two edges have more in common than an end.
fn touch([a, b]: [Point; 2], [c, d]: [Point; 2]) -> bool {
    const ROUNDING: f64 = 1e-9;
    let within = |p: Point, [a, b]: [Point; 2]| {
        let along = (p[0] - a[0]) * (b[0] - a[0]) + (p[1] - a[1]) * (b[1] - a[1]);
        let length = (b[0] - a[0]).powi(2) + (b[1] - a[1]).powi(2);
        turn(a, b, p).abs() < ROUNDING && along > ROUNDING && along < length - ROUNDING
    };
    let on = within(a, [c, d]) || within(b, [c, d]) || within(c, [a, b]) || within(d, [a, b]);
    let opposite =
        |x: f64, y: f64| (x > ROUNDING && y < -ROUNDING) || (x < -ROUNDING && y > ROUNDING);
    let cross = opposite(turn(a, b, c), turn(a, b, d)) && opposite(turn(c, d, a), turn(c, d, b));
    on || cross
}

/// Checks what holds for each pattern.
fn verify(pattern: &Pattern, case: u64) {
    let ends =
        |index: usize| pattern.edges[index].vertices.map(|vertex| pattern.vertices[vertex.index()]);
    for one in 0..pattern.edges.len() {
        for two in 0..one {
            assert!(!touch(ends(one), ends(two)), "case {case}: {:?} {:?}", ends(one), ends(two));
        }
        let edge = &pattern.edges[one];
        let crease = !matches!(edge.role, Role::Border | Role::Cut);
        let [left, right] = edge.facets;
        assert!(left.is_some() || right.is_some(), "case {case}: edge {one} has no facet");
        assert!(!crease || left != right, "case {case}: crease {one} has one facet on both sides");
    }
    // Each side of an edge is once on the boundary of the facet on that side.
    for (index, facet) in pattern.facets.iter().enumerate() {
        let mut sides = 0;
        for boundary in std::iter::once(&facet.outline).chain(&facet.holes) {
            for (position, &from) in boundary.iter().enumerate() {
                let to = boundary[(position + 1) % boundary.len()];
                let side = |edge: &lamc_drawings::Edge| {
                    if edge.vertices == [from, to] {
                        edge.facets[0]
                    } else if edge.vertices == [to, from] {
                        edge.facets[1]
                    } else {
                        None
                    }
                };
                let found = pattern.edges.iter().filter_map(side).collect::<Vec<_>>();
                assert_eq!(found, [FacetId(index)], "case {case}");
                sides += 1;
            }
        }
        let of_facet = |edge: &lamc_drawings::Edge| {
            edge.facets.iter().filter(|side| **side == Some(FacetId(index))).count()
        };
        assert_eq!(pattern.edges.iter().map(of_facet).sum::<usize>(), sides, "case {case}");
        assert!(pattern.area(facet) > 1e-6, "case {case}: area {}", pattern.area(facet));
    }
}

#[test]
fn patterns_of_lattices_are_planar_and_survive_export() {
    let mut read = 0;
    for case in 0..2000 {
        let mut rng = ChaCha8Rng::seed_from_u64(case);
        let drawing = draw(&mut rng);
        // Crossings of a lattice of eight points are at least 1 / 200 apart.
        let Ok(pattern) = Pattern::of(&drawing, Some(1e-3)) else { continue };
        read += 1;
        verify(&pattern, case);
        let text = fold::write(&pattern, None);
        let again =
            fold::read(&text, None).unwrap_or_else(|faults| panic!("case {case}: {faults:?}"));
        let again = Pattern::of(&again, Some(1e-3))
            .unwrap_or_else(|faults| panic!("case {case}: {faults:?}"));
        let roles = |pattern: &Pattern| {
            let mut roles: Vec<Role> = pattern.edges.iter().map(|edge| edge.role).collect();
            roles.sort();
            roles
        };
        assert_eq!(roles(&again), roles(&pattern), "case {case}");
        assert_eq!(again.vertices.len(), pattern.vertices.len(), "case {case}");
        assert_eq!(again.facets.len(), pattern.facets.len(), "case {case}");
        for role in ROLES {
            let merged = pattern.merged(role);
            let area = |pattern: &Pattern| {
                pattern.facets.iter().map(|facet| pattern.area(facet)).sum::<f64>()
            };
            assert!((area(&merged) - area(&pattern)).abs() < 1e-9, "case {case}");
        }
    }
    assert!(read > 1000, "{read} drawings are patterns");
}
