//! What drawings mean, and what is mended or refused in them.

use lamc_drawings::{Cause, Drawing, Fault, Mark, MarkKind, Pattern, Place, Role, Stroke, explain};

const B: Role = Role::Border;
const M: Role = Role::Mountain;
const V: Role = Role::Valley;
const F: Role = Role::Flat;
const U: Role = Role::Hinge;
const C: Role = Role::Cut;

/// Polylines with roles: points in a row.
type Polylines<'a> = &'a [(Role, &'a [[f64; 2]])];

const SQUARE: [[f64; 2]; 5] = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0], [0.0, 0.0]];

fn square(low: f64, high: f64) -> [[f64; 2]; 5] {
    [[low, low], [high, low], [high, high], [low, high], [low, low]]
}

fn drawing(polylines: Polylines<'_>) -> Drawing {
    let mut strokes = Vec::new();
    for (role, points) in polylines {
        for ends in points.windows(2) {
            let place = Place { start: strokes.len(), end: strokes.len() + 1 };
            let ends = [ends[0], ends[1]];
            strokes.push(Stroke { ends, role: *role, fold: None, angle: None, place });
        }
    }
    Drawing { strokes, ..Drawing::default() }
}

fn read(polylines: Polylines<'_>) -> Pattern {
    Pattern::of(&drawing(polylines), Some(0.1)).unwrap_or_else(|faults| panic!("{faults:?}"))
}

fn refused(polylines: Polylines<'_>) -> Vec<Fault> {
    let pattern = Pattern::of(&drawing(polylines), Some(0.1));
    pattern.expect_err("the drawing is wrong")
}

fn roles(pattern: &Pattern) -> String {
    let mut roles: Vec<Role> = pattern.edges.iter().map(|edge| edge.role).collect();
    roles.sort();
    let letter = |role: &Role| match role {
        Role::Border => 'B',
        Role::Mountain => 'M',
        Role::Valley => 'V',
        Role::Flat => 'F',
        Role::Hinge => 'U',
        Role::Cut => 'C',
    };
    roles.iter().map(letter).collect()
}

/// Checks the roles of the edges, and the facets: their areas, and after a comma the number of their
/// holes.
#[track_caller]
fn check(polylines: Polylines<'_>, edges: &str, facets: &[(f64, usize)]) -> Pattern {
    let pattern = read(polylines);
    assert_eq!(roles(&pattern), edges);
    let mut found: Vec<(f64, usize)> = pattern
        .facets
        .iter()
        .map(|facet| ((pattern.area(facet) * 1e6).round() / 1e6, facet.holes.len()))
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert_eq!(found, facets);
    pattern
}

#[test]
fn a_loop_inside_a_facet_is_a_hole() {
    for (outer, inner) in [(B, B), (B, C), (C, C), (C, B)] {
        let inside = square(4.0, 6.0);
        let mut edges = [[outer; 4], [inner; 4]].concat();
        edges.sort();
        let pattern = read(&[(outer, &SQUARE), (inner, &inside)]);
        let roles: Vec<Role> = pattern.edges.iter().map(|edge| edge.role).collect();
        assert_eq!(roles, [[outer; 4], [inner; 4]].concat());
        assert_eq!(pattern.facets.len(), 1);
        assert_eq!(pattern.facets[0].holes.len(), 1);
        assert_eq!(pattern.area(&pattern.facets[0]), 96.0);
        assert!(pattern.doubts.is_empty() && pattern.mended.is_empty());
    }
}

#[test]
fn holes_pieces_and_frames() {
    let crease: &[[f64; 2]] = &[[5.0, 0.0], [5.0, 10.0]];
    // A hole in one of two facets.
    check(
        &[(B, &SQUARE), (V, crease), (B, &square(1.0, 2.0))],
        "BBBBBBBBBBV",
        &[(49.0, 1), (50.0, 0)],
    );
    // A hole on a crease: the crease ends at it.
    let hole = [[4.0, 4.0], [5.0, 4.0], [6.0, 4.0], [6.0, 6.0], [5.0, 6.0], [4.0, 6.0], [4.0, 4.0]];
    let parts: [&[[f64; 2]]; 2] = [&[[5.0, 0.0], [5.0, 4.0]], &[[5.0, 6.05], [5.0, 10.0]]];
    let edges = "BBBBBBBBBBBBVV";
    check(
        &[(B, &SQUARE), (V, parts[0]), (V, parts[1]), (B, &hole)],
        edges,
        &[(48.0, 0), (48.0, 0)],
    );
    // A plate in a hole.
    check(
        &[(B, &SQUARE), (B, &square(2.0, 8.0)), (B, &square(4.0, 6.0))],
        "BBBBBBBBBBBB",
        &[(4.0, 0), (64.0, 1)],
    );
    // What cuts with creases inside surround is a piece of its own.
    let inner: &[[f64; 2]] = &[[4.0, 2.0], [4.0, 8.0]];
    check(
        &[(B, &SQUARE), (C, &square(2.0, 8.0)), (M, inner)],
        "BBBBMCCCCCC",
        &[(12.0, 0), (24.0, 0), (64.0, 1)],
    );
    // A frame around the sheet is not sheet.
    let frame = check(
        &[(B, &square(-5.0, 15.0)), (B, &SQUARE), (V, crease)],
        "BBBBBBV",
        &[(50.0, 0), (50.0, 0)],
    );
    assert_eq!(frame.doubts[0].cause, Cause::Dangling);
}

#[test]
fn cuts_and_slits() {
    // From border to border: two facets.
    check(&[(B, &SQUARE), (C, &[[5.0, 0.0], [5.0, 10.0]])], "BBBBBBC", &[(50.0, 0), (50.0, 0)]);
    check(&[(B, &SQUARE), (B, &[[5.0, 0.0], [5.0, 10.0]])], "BBBBBBB", &[(50.0, 0), (50.0, 0)]);
    // A slit leaves one facet, whose outline runs along both sides of it.
    let slit = check(&[(B, &SQUARE), (C, &[[5.0, 0.0], [5.0, 4.0]])], "BBBBBC", &[(100.0, 0)]);
    assert_eq!(slit.facets[0].outline.len(), 7);
    let cut = slit.edges.iter().find(|edge| edge.role == C).expect("the slit is an edge");
    assert_eq!(cut.facets[0], cut.facets[1]);
    let inside = check(&[(B, &SQUARE), (C, &[[5.0, 3.0], [5.0, 4.0]])], "BBBBC", &[(100.0, 1)]);
    assert_eq!(inside.facets[0].holes[0].len(), 2);
}

#[test]
fn near_ends_are_joined() {
    let gap: &[[f64; 2]] = &[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0], [0.0, 0.05]];
    let pattern = check(&[(B, gap)], "BBBB", &[(100.0, 0)]);
    assert_eq!(pattern.mended.len(), 1);
    assert_eq!(
        pattern.mended[0].message,
        "1 end was joined with an end near by, at most 0.05 away"
    );
    assert_eq!(pattern.mended[0].at, [[0.0, 0.0]]);
}

#[test]
fn what_needs_no_mending_keeps_its_bits() {
    let third = 1.0 / 3.0;
    let crease: &[[f64; 2]] = &[[third, 0.0], [10.0 * third, 10.0]];
    let pattern = read(&[(B, &SQUARE), (V, crease)]);
    for point in crease.iter().chain(&SQUARE) {
        assert!(pattern.vertices.contains(point), "{point:?}");
    }
    assert!(pattern.mended.is_empty(), "{:?}", pattern.mended);
}

#[test]
fn ends_move_onto_lines_so_that_these_stay_straight() {
    let crease: &[[f64; 2]] = &[[5.0, 0.05], [5.0, 9.96]];
    let pattern = check(&[(B, &SQUARE), (V, crease)], "BBBBBBV", &[(50.0, 0), (50.0, 0)]);
    assert!(pattern.vertices.contains(&[5.0, 0.0]) && pattern.vertices.contains(&[5.0, 10.0]));
    assert_eq!(
        pattern.mended[0].message,
        "2 ends were moved onto the line on which they end, by at most 0.05"
    );
}

#[test]
fn crossings_get_a_vertex() {
    let cross: Polylines<'_> = &[
        (B, &SQUARE),
        (M, &[[0.0, 0.0], [10.0, 10.0]]),
        (V, &[[0.0, 10.0], [10.0, 0.0]]),
        // Through the same point, but for an error within the tolerance.
        (U, &[[0.0, 5.04], [10.0, 5.04]]),
    ];
    let pattern = check(
        cross,
        "BBBBBBMMVVUU",
        &[(12.4, 0), (12.4, 0), (12.6, 0), (12.6, 0), (25.0, 0), (25.0, 0)],
    );
    assert!(pattern.vertices.contains(&[5.0, 5.0]));
}

#[test]
fn lines_drawn_twice_count_once() {
    let line: &[[f64; 2]] = &[[5.0, 0.0], [5.0, 10.0]];
    let part: &[[f64; 2]] = &[[5.0, 8.0], [5.0, 0.0]];
    let halves = [(50.0, 0), (50.0, 0)];
    let once = check(&[(B, &SQUARE), (V, line), (V, part)], "BBBBBBV", &halves);
    assert_eq!(once.mended[0].message, "1 line that was drawn twice was kept once");
    for (one, two, kept) in [(V, F, 'V'), (F, U, 'U'), (U, M, 'M'), (M, B, 'B'), (B, C, 'C')] {
        for [one, two] in [[one, two], [two, one]] {
            let pattern = read(&[(B, &SQUARE), (one, line), (two, line)]);
            assert_eq!(roles(&pattern).replace('B', "").trim(), format!("{kept}").replace('B', ""));
            assert_eq!(pattern.facets.len(), 2);
        }
    }
    let doubtful = check(&[(B, &SQUARE), (V, line), (M, line)], "BBBBBBV", &halves);
    assert_eq!(doubtful.doubts[0].cause, Cause::Contradiction);
    assert_eq!(doubtful.doubts[0].at, [[5.0, 5.0]]);
}

#[test]
fn a_straight_line_in_pieces_is_one_edge() {
    let pieces: &[[f64; 2]] = &[[5.0, 0.0], [5.0, 2.0], [5.0, 7.0], [5.0, 10.0]];
    check(&[(B, &SQUARE), (V, pieces)], "BBBBBBV", &[(50.0, 0), (50.0, 0)]);
    let roles: Polylines<'_> = &[(B, &SQUARE), (V, &pieces[..2]), (M, &pieces[1..])];
    check(roles, "BBBBBBMV", &[(50.0, 0), (50.0, 0)]);
    let bent: &[[f64; 2]] = &[[5.0, 0.0], [5.3, 5.0], [5.0, 10.0]];
    check(&[(B, &SQUARE), (V, bent)], "BBBBBBVV", &[(48.5, 0), (51.5, 0)]);
    // A ring keeps its corners wherever it begins.
    let ring = [[5.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0], [0.0, 0.0], [5.0, 0.0]];
    check(&[(B, &ring)], "BBBB", &[(100.0, 0)]);
}

#[test]
fn lines_that_bound_no_facet_are_left_out() {
    let inside: &[[f64; 2]] = &[[5.0, 0.0], [5.0, 4.0]];
    let pattern = check(&[(B, &SQUARE), (V, inside)], "BBBB", &[(100.0, 0)]);
    assert_eq!(pattern.doubts[0].cause, Cause::Dangling);
    assert_eq!(
        pattern.doubts[0].message,
        "1 piece of creases that end inside a facet was left out"
    );
    let legend: &[[f64; 2]] = &[[12.0, 0.0], [12.0, 4.0]];
    let beyond: &[[f64; 2]] = &[[5.0, -3.0], [5.0, 13.0]];
    let pattern =
        check(&[(B, &SQUARE), (V, legend), (M, beyond)], "BBBBBBM", &[(50.0, 0), (50.0, 0)]);
    assert_eq!(pattern.doubts[0].message, "3 lines outside of the sheet were left out");
}

#[test]
fn an_open_outline_is_refused_with_both_ends() {
    let open: &[[f64; 2]] = &[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0], [0.0, 1.0]];
    for crease in [[[5.0, 0.0], [5.0, 10.0]], [[0.0, 5.0], [10.0, 5.0]]] {
        let faults = refused(&[(B, open), (V, &crease)]);
        assert_eq!(faults.len(), 1);
        assert_eq!(faults[0].cause, Cause::OpenOutline);
        assert_eq!(faults[0].message, "the outline of the sheet is open between (0, 0) and (0, 1)");
        assert_eq!(faults[0].at, [[0.0, 0.0], [0.0, 1.0]]);
    }
    // Lines that cross at the corners close an outline.
    let cross: Polylines<'_> = &[
        (B, &[[-1.0, 0.0], [11.0, 0.0]]),
        (B, &[[-1.0, 10.0], [11.0, 10.0]]),
        (B, &[[0.0, -1.0], [0.0, 11.0]]),
        (B, &[[10.0, -1.0], [10.0, 11.0]]),
        (V, &[[5.0, 0.0], [5.0, 10.0]]),
    ];
    check(cross, "BBBBBBV", &[(50.0, 0), (50.0, 0)]);
    assert_eq!(refused(&[(V, &[[0.0, 0.0], [1.0, 1.0]])])[0].cause, Cause::OpenOutline);
}

#[test]
fn a_pattern_without_border() {
    let crease: &[[f64; 2]] = &[[5.0, 0.0], [5.0, 10.0]];
    check(&[(U, &SQUARE), (V, crease)], "BBBBBBV", &[(50.0, 0), (50.0, 0)]);
    let drawn = check(&[(M, &SQUARE), (V, crease)], "MMMMMMV", &[(50.0, 0), (50.0, 0)]);
    assert_eq!(drawn.doubts[0].cause, Cause::Rim);
    assert_eq!(drawn.doubts[0].at.len(), 6);
}

#[test]
fn slivers_are_reported() {
    let pattern = read(&[(B, &[[0.0, 0.0], [10.0, 0.0], [5.0, 0.15], [0.0, 0.0]])]);
    assert_eq!(pattern.doubts[0].cause, Cause::Thin);
}

#[test]
fn facets_are_joined_over_flat_lines() {
    let polylines: Polylines<'_> = &[
        (B, &SQUARE),
        (V, &[[5.0, 0.0], [5.0, 10.0]]),
        (F, &[[0.0, 0.0], [5.0, 10.0]]),
        (F, &[[5.0, 0.0], [10.0, 10.0]]),
    ];
    let pattern = check(polylines, "BBBBBBVFF", &[(25.0, 0), (25.0, 0), (25.0, 0), (25.0, 0)]);
    let joined = pattern.merged(F);
    assert_eq!(roles(&joined), "BBBBBBV");
    assert_eq!(joined.facets.len(), 2);
    assert!(joined.facets.iter().all(|facet| joined.area(facet) == 50.0));
    let rigid = pattern.merged(F).merged(V);
    assert_eq!((roles(&rigid).as_str(), rigid.facets.len()), ("BBBBBB", 1));
    assert_eq!(pattern.merged(M), pattern);
}

#[test]
fn numbers_that_cannot_be_used_are_refused() {
    for bad in [f64::NAN, f64::INFINITY, 2e9, -1e300] {
        let faults = refused(&[(B, &[[0.0, 0.0], [bad, 1.0]])]);
        assert_eq!(faults[0].cause, Cause::Number);
        assert_eq!(faults[0].place, Some(Place { start: 0, end: 1 }));
    }
    for tolerance in [0.0, -1.0, f64::NAN, 100.0, 1e-30] {
        let faults = Pattern::of(&drawing(&[(B, &SQUARE)]), Some(tolerance)).unwrap_err();
        assert_eq!(faults[0].cause, Cause::Number, "{tolerance}");
    }
    assert_eq!(Pattern::of(&Drawing::default(), None).unwrap_err()[0].cause, Cause::Empty);
    assert_eq!(refused(&[(B, &[[1.0, 1.0], [1.0, 1.0]])])[0].cause, Cause::Empty);
}

#[test]
fn large_and_hostile_drawings() {
    // A grid of unit squares: 99,904 strokes.
    const SIDE: usize = 223;
    let mut strokes = Vec::new();
    for (i, j) in (0..=SIDE).flat_map(|i| (0..=SIDE).map(move |j| (i, j))) {
        let at = |i: usize, j: usize| [i as f64, j as f64];
        if i < SIDE {
            let role = if j == 0 || j == SIDE { B } else { V };
            strokes.push((role, [at(i, j), at(i + 1, j)]));
        }
        if j < SIDE {
            let role = if i == 0 || i == SIDE { B } else { M };
            strokes.push((role, [at(i, j), at(i, j + 1)]));
        }
    }
    let polylines: Vec<_> = strokes.iter().map(|(role, ends)| (*role, ends.as_slice())).collect();
    let pattern = Pattern::of(&drawing(&polylines), None).expect("the drawing is right");
    assert_eq!(pattern.facets.len(), SIDE * SIDE);
    assert_eq!(pattern.vertices.len(), (SIDE + 1) * (SIDE + 1));
    // Each line crosses each other one.
    let lines: Vec<[[f64; 2]; 2]> =
        (0..100_000).map(|i| [[f64::from(i), 0.0], [1e5 - f64::from(i), 1e5]]).collect();
    let polylines: Vec<_> = lines.iter().map(|ends| (V, ends.as_slice())).collect();
    let faults = Pattern::of(&drawing(&polylines), Some(0.1)).expect_err("too many crossings");
    assert_eq!(faults[0].cause, Cause::Limit);
    assert!(!faults[0].at.is_empty(), "{faults:?}");
}

#[test]
fn lines_on_one_straight_line_enclose_nothing() {
    for end in [[8.0, 0.0], [0.0, 8.0], [8.0, 8.0]] {
        let at = |part: f64| end.map(|x| part * x);
        let lines = [[at(0.0), at(0.2)], [at(0.4), at(0.6)], [at(0.8), at(1.0)]];
        let polylines: Vec<_> = lines.iter().map(|ends| (M, ends.as_slice())).collect();
        let faults = Pattern::of(&drawing(&polylines), None).expect_err("no facets");
        assert_eq!(faults[0].cause, Cause::OpenOutline, "{faults:?}");
    }
}

#[test]
fn pictures_of_faults_are_whole() {
    let wrong = drawing(&[(B, &SQUARE), (V, &[[f64::NAN, 0.0], [1.0, f64::INFINITY]])]);
    let mark = Mark {
        kind: MarkKind::Error,
        message: "a < b & \"c\"\u{1}".to_owned(),
        at: vec![[5.0, 5.0], [f64::NAN, 0.0]],
        hint: None,
    };
    let picture = explain(&wrong, None, &[mark]);
    assert_eq!(picture.matches("<circle").count(), 1);
    assert!(picture.contains("a &lt; b &amp; &quot;c&quot;?"));
    assert!(!picture.contains("NaN") && !picture.contains("inf"));
    let mended = drawing(&[(B, &SQUARE), (V, &[[5.0, 0.05], [5.0, 10.0]])]);
    let pattern = Pattern::of(&mended, Some(0.1)).expect("the drawing is right");
    let [end] = pattern.mended.as_slice() else { panic!("{:?}", pattern.mended) };
    let mark = Mark {
        kind: MarkKind::Note,
        message: end.message.clone(),
        at: end.at.clone(),
        hint: Some("draw it longer".into()),
    };
    let picture = explain(&mended, Some(&pattern), &[mark]);
    assert_eq!(picture.matches("<circle").count(), 1);
    assert!(picture.contains("1, note: 1 end was moved") && picture.contains("draw it longer"));
    assert!(explain(&Drawing::default(), None, &[]).contains("</svg>"));
}
