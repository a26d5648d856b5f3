//! Cuts that end within a facet.

use super::*;

/// Slits of a body in tenths of a millimetre, in either direction.
fn slits(body: &Body) -> Vec<[[i64; 2]; 2]> {
    let tenths = |x: f64| (x * 1e4).round() as i64;
    let mut slits: Vec<_> = body.slits.iter().map(|slit| slit.map(|end| end.map(tenths))).collect();
    slits.iter_mut().for_each(|ends| ends.sort_unstable());
    slits.sort_unstable();
    slits
}

/// Cuts that end within a facet are slits of its body: free ones, those from the rim and from a crease, and
/// those that branch. They change neither the outline nor the area.
#[test]
fn cuts_that_end_within_a_facet_are_slits() {
    let crease = (VALLEY, [15.0, 0.0, 15.0, 20.0]);
    let cuts = [
        (CUT, [0.0, 5.0, 10.0, 5.0]),
        (CUT, [20.0, 10.0, 35.0, 10.0]),
        (CUT, [30.0, 10.0, 30.0, 15.0]),
        (CUT, [15.0, 3.0, 25.0, 3.0]),
    ];
    for flat in [None, Some((FLAT, [30.0, 15.0, 30.0, 20.0]))] {
        let lines: Vec<Stroke> = [crease].into_iter().chain(cuts).chain(flat).collect();
        let (cut, _) = read(&strip(&lines), "layup: [card]", "").unwrap();
        let whole = model(&strip(&[crease]), "");
        assert_eq!(names(&cut), names(&whole));
        for (cut, whole) in cut.bodies.iter().zip(&whole.bodies) {
            close(areas(cut)[0], areas(whole)[0]);
        }
        assert_eq!(slits(&cut.bodies[0]), [[[0, 50], [100, 50]]]);
        let of_the_large = [
            [[150, 30], [250, 30]],
            [[200, 100], [300, 100]],
            [[300, 100], [300, 150]],
            [[300, 100], [350, 100]],
        ];
        assert_eq!(slits(&cut.bodies[1]), of_the_large);
        let yaml = to_yaml(&cut);
        let (again, _) = parse(&SourceFile { path: "m.yaml".into(), text: yaml }).unwrap();
        for (cut, again) in cut.bodies.iter().zip(&again.bodies) {
            assert_eq!(cut.slits, again.slits);
        }
    }
}

/// Flat lines that were drawn to make triangles join the facets on both sides of a cut.
#[test]
fn cuts_between_facets_that_flat_lines_join_are_slits() {
    let lines = [
        (VALLEY, [15.0, 0.0, 15.0, 20.0]),
        (CUT, [25.0, 0.0, 25.0, 12.0]),
        (FLAT, [25.0, 12.0, 25.0, 20.0]),
    ];
    let (model, _) = read(&strip(&lines), "layup: [card]", "").unwrap();
    assert_eq!(model.bodies.iter().map(|body| body.slits.len()).collect::<Vec<_>>(), [0, 1]);
    assert_eq!(slits(&model.bodies[1]), [[[250, 0], [250, 120]]]);
    // As bodies of their own, they touch along it, and `lamc cut` finds it.
    let (model, _) = read(&strip(&lines), "layup: [card]", ", triangulate: true").unwrap();
    assert!(model.bodies.iter().all(|body| body.slits.is_empty()));
}
