//! FOLD files: what is read, and what is refused.

use lamc_drawings::{Cause, Drawing, Pattern, Role, fold, svg};

fn read(text: &str) -> Drawing {
    fold::read(text, None).unwrap_or_else(|faults| panic!("{faults:?}"))
}

/// A unit square with a crease along x = 1/2, as properties of a frame.
const VERTICES: &str = r#""vertices_coords": [[0,0],[0.5,0],[1,0],[1,1],[0.5,1],[0,1]]"#;
const EDGES: &str = r#""edges_vertices": [[0,1],[1,2],[2,3],[3,4],[4,5],[5,0],[1,4]]"#;
const FACES: &str = r#""faces_vertices": [[0,1,4,5],[1,2,3,4]]"#;

fn assigned(letter: &str) -> String {
    format!(r#""edges_assignment": ["B","B","B","B","B","B","{letter}"]"#)
}

#[test]
fn assignments_and_angles() {
    for (letter, role) in [
        ("M", Some(Role::Mountain)),
        ("V", Some(Role::Valley)),
        ("F", Some(Role::Flat)),
        ("U", Some(Role::Hinge)),
        ("C", Some(Role::Cut)),
        ("B", Some(Role::Border)),
        ("J", None),
    ] {
        let text = format!("{{ {VERTICES}, {EDGES}, {} }}", assigned(letter));
        let drawing = read(&text);
        assert_eq!(drawing.strokes.get(6).map(|stroke| stroke.role), role);
        assert_eq!(drawing.ignored.len(), usize::from(role.is_none()));
        let facets = Pattern::of(&drawing, None).expect("the pattern is whole").facets.len();
        assert_eq!(facets, if role.is_none() { 1 } else { 2 }, "{letter}");
        let place = drawing.strokes[3].place;
        assert_eq!(&text[place.start..place.end], "[3,4]");
    }
    for key in ["edges_foldAngle", "edges_foldAngles"] {
        let angles = format!(r#""{key}": [0,0,0,null,null,0,-90]"#);
        let drawing = read(&format!("{{ {VERTICES}, {EDGES}, {}, {angles} }}", assigned("M")));
        assert_eq!(drawing.strokes[6].fold, Some(-std::f64::consts::FRAC_PI_2));
        assert_eq!(drawing.strokes[0].fold, None);
    }
}

#[test]
fn what_a_file_leaves_out() {
    // Without assignments: an edge of one face is border; angles give the sign.
    let angles = r#""edges_foldAngle": [null,null,null,null,null,null,45]"#;
    let drawing = read(&format!("{{ {VERTICES}, {EDGES}, {FACES}, {angles} }}"));
    let roles: Vec<Role> = drawing.strokes.iter().map(|stroke| stroke.role).collect();
    assert_eq!(roles[..6], [Role::Border; 6]);
    assert_eq!(roles[6], Role::Valley);
    // Without faces either: the outermost edges become border.
    let drawing = read(&format!("{{ {VERTICES}, {EDGES} }}"));
    assert!(drawing.strokes.iter().all(|stroke| stroke.role == Role::Hinge));
    let pattern = Pattern::of(&drawing, None).expect("the pattern is whole");
    let hinges = pattern.edges.iter().filter(|edge| edge.role == Role::Hinge).count();
    assert_eq!((pattern.facets.len(), hinges), (2, 1));
    // Faces without edges.
    let drawing = read(&format!("{{ {VERTICES}, {FACES} }}"));
    assert_eq!(drawing.strokes.len(), 7);
    let hinges = drawing.strokes.iter().filter(|stroke| stroke.role == Role::Hinge).count();
    assert_eq!(hinges, 1);
}

#[test]
fn coordinates_of_space_in_one_plane_are_flat() {
    for heights in [[0.0; 3], [5.0; 3], [5.0, 5.0 + 1e-9, 5.0 - 1e-9]] {
        let [a, b, c] = heights;
        let text = format!(
            r#"{{ "vertices_coords": [[0,0,{a}],[1,0,{b}],[0,1,{c}]], "edges_vertices": [[0,1],[1,2],[2,0]] }}"#
        );
        assert_eq!(read(&text).strokes[1].ends, [[1.0, 0.0], [0.0, 1.0]]);
    }
}

#[test]
fn a_byte_order_mark_is_no_part_of_the_text() {
    let text = format!("\u{feff}{{ {VERTICES}, {EDGES} }}");
    let place = read(&text).strokes[3].place;
    assert_eq!(&text[place.start..place.end], "[3,4]");
    let fault = fold::read("\u{feff}{ 1 }", None).unwrap_err().remove(0);
    assert_eq!(fault.place.map(|place| place.start), Some("\u{feff}{ ".len()));
}

#[test]
fn units() {
    for (name, unit) in [("mm", Some(1e-3)), ("in", Some(0.0254)), ("unit", None), ("ell", None)] {
        let text = format!(r#"{{ "frame_unit": "{name}", {VERTICES}, {EDGES} }}"#);
        assert_eq!(read(&text).unit, unit, "{name}");
    }
    // FOLD defines `unit` as the name of no unit.
    for (name, said) in [("furlong", "gives its unit as `furlong`"), ("unit", "does not say")] {
        let text = format!(r#"{{ "frame_unit": "{name}", {VERTICES}, {EDGES} }}"#);
        let why = read(&text).why_no_unit();
        assert!(why.starts_with(said), "{why}");
    }
}

#[test]
fn signs_of_angles_must_be_those_of_the_assignments() {
    for (letter, angle, agrees) in [
        ("M", -45.0, true),
        ("M", 45.0, false),
        ("V", 45.0, true),
        ("V", -45.0, false),
        ("M", 0.0, true),
        ("M", 1e-9, true),
        ("U", 45.0, true),
    ] {
        let angles = format!(r#""edges_foldAngle": [0,0,0,0,0,0,{angle}]"#);
        let text = format!("{{ {VERTICES}, {EDGES}, {}, {angles} }}", assigned(letter));
        let doubts = Pattern::of(&read(&text), None).expect("the pattern is whole").doubts;
        assert_eq!(doubts.is_empty(), agrees, "{letter} {angle}: {doubts:?}");
        for doubt in doubts {
            assert_eq!((doubt.cause, doubt.at), (Cause::Contradiction, vec![[0.5, 0.5]]));
            let place = doubt.place.expect("the doubt has a place");
            assert_eq!(&text[place.start..place.end], "[1,4]");
        }
    }
}

#[test]
fn listed_faces_must_be_those_of_the_edges() {
    let base = format!("{VERTICES}, {EDGES}, {}", assigned("V"));
    for (faces, agrees) in [
        (r#""faces_vertices": [[0,1,4,5],[1,2,3,4]]"#, true),
        (r#""faces_vertices": [[5,4,1,0],[1,2,3,4]]"#, true),
        (r#""faces_vertices": [[0,1,2,3,4,5]]"#, false),
        (r#""faces_vertices": [[0,1,4],[1,2,3,4]]"#, false),
    ] {
        let pattern = Pattern::of(&read(&format!("{{ {base}, {faces} }}")), None);
        let doubts = pattern.expect("the pattern is whole").doubts;
        assert_eq!(doubts.is_empty(), agrees, "{faces}: {doubts:?}");
        assert!(doubts.iter().all(|doubt| doubt.cause == Cause::Contradiction));
    }
    // Two faces with a join between them are one facet.
    let joined = format!("{{ {VERTICES}, {EDGES}, {}, {FACES} }}", assigned("J"));
    let pattern = Pattern::of(&read(&joined), None).expect("the pattern is whole");
    assert!(pattern.doubts.is_empty(), "{:?}", pattern.doubts);
}

/// Coordinates of the square folded along its crease: the right half is turned up by an angle, deg.
fn folded(angle: f64) -> String {
    let (sin, cos) = angle.to_radians().sin_cos();
    let (x, z) = (0.5 + 0.5 * cos, 0.5 * sin);
    format!(r#""vertices_coords": [[0,0,0],[0.5,0,0],[{x},0,{z}],[{x},1,{z}],[0.5,1,0],[0,1,0]]"#)
}

#[test]
fn a_folded_form_gives_angles() {
    for (letter, angle) in [("V", 60.0), ("M", -60.0), ("V", 180.0), ("M", -180.0), ("U", -30.0)] {
        let base = format!("{EDGES}, {FACES}, {}", assigned(letter));
        let flat = r#""frame_classes": ["creasePattern"]"#;
        let state = r#""frame_classes": ["foldedForm"], "frame_inherit": true, "frame_parent": 0"#;
        let one = format!(
            "{{ {base}, {flat}, {VERTICES}, \"file_frames\": [{{ {state}, {} }}] }}",
            folded(angle)
        );
        let inherits = r#""frame_inherit": true, "frame_parent": 0"#;
        let other = format!(
            "{{ {base}, \"frame_classes\": [\"foldedForm\"], {}, \"file_frames\": \
             [{{ {flat}, {inherits}, {VERTICES} }}] }}",
            folded(angle)
        );
        // Without a crease pattern the faces are laid flat.
        let alone = format!(r#"{{ {base}, "frame_classes": ["foldedForm"], {} }}"#, folded(angle));
        for text in [one, other, alone] {
            let drawing = read(&text);
            let found = drawing.strokes[6].angle.expect("the state has an angle").to_degrees();
            assert!((found - angle).abs() < 1e-9, "{letter} {angle}: {found}");
            assert_eq!(drawing.strokes[0].angle, None);
            let pattern = Pattern::of(&drawing, None).expect("the pattern is whole");
            assert_eq!(pattern.facets.len(), 2);
            assert!(pattern.facets.iter().all(|facet| (pattern.area(facet) - 0.5).abs() < 1e-12));
            assert!(pattern.doubts.is_empty(), "{:?}", pattern.doubts);
        }
    }
}

/// A crease pattern whose file lists edges only: the faces are the regions between them.
#[test]
fn a_folded_form_needs_no_list_of_faces() {
    let state = r#""frame_classes": ["foldedForm"], "frame_inherit": true, "frame_parent": 0"#;
    for (edges, angle) in [
        // However the crease is directed.
        (EDGES.to_owned(), Some(-60.0)),
        (EDGES.replace("[1,4]", "[4,1]"), Some(-60.0)),
        // Edges that cross have no faces between them.
        (EDGES.replace("[1,4]", "[1,4],[0,3]"), None),
    ] {
        let letters = if angle.is_some() { assigned("M") } else { assigned("M\",\"M") };
        let text = format!(
            r#"{{ {edges}, {letters}, "frame_classes": ["creasePattern"], {VERTICES},
            "file_frames": [{{ {state}, {} }}] }}"#,
            folded(-60.0)
        );
        let drawing = read(&text);
        let found = drawing.strokes[6].angle.map(f64::to_degrees);
        let is_near = found.zip(angle).map(|(found, angle)| (found - angle).abs() < 1e-9);
        assert_eq!(is_near, angle.map(|_| true), "{found:?}");
        assert_eq!(drawing.ignored.len(), usize::from(angle.is_none()), "{:?}", drawing.ignored);
    }
}

#[test]
fn a_state_with_other_vertices_has_no_angles() {
    // The pattern has a vertex more, which no edge has, and a face with it.
    let flat = VERTICES.replace("[0,1]]", "[0,1],[9,9]]");
    let faces = r#""faces_vertices": [[0,1,4,5,6],[1,2,3,4]]"#;
    let state = r#""frame_classes": ["foldedForm"], "frame_inherit": true, "frame_parent": 0"#;
    let none = r#""faces_vertices": []"#;
    let text = format!(
        "{{ {flat}, {EDGES}, {faces}, {}, \"file_frames\": [{{ {state}, {none}, {} }}] }}",
        assigned("V"),
        folded(60.0)
    );
    assert!(read(&text).strokes.iter().all(|stroke| stroke.angle.is_none()));
}

#[test]
fn frames_by_number() {
    let frame = |letter: &str| format!("{{ {VERTICES}, {EDGES}, {} }}", assigned(letter));
    let inherits = r#"{ "frame_inherit": true, "frame_parent": 1 }"#;
    let text = format!(
        "{{ \"file_spec\": 1.2, {VERTICES}, {EDGES}, {}, \"file_frames\": [{}, {inherits}] }}",
        assigned("M"),
        frame("V")
    );
    let role = |number| fold::read(&text, number).map(|drawing| drawing.strokes[6].role);
    assert_eq!(role(None), Ok(Role::Mountain));
    assert_eq!(role(Some(0)), Ok(Role::Mountain));
    assert_eq!(role(Some(1)), Ok(Role::Valley));
    assert_eq!(role(Some(2)), Ok(Role::Valley));
    let message = role(Some(3)).unwrap_err().remove(0).message;
    assert_eq!(message, "the file has no frame 3: its last one is 2");
}

/// Checks the message for a wrong text, and the part of the text that it points to.
#[track_caller]
fn check(text: &str, cause: Cause, message: &str, at: &str) {
    let fault = fold::read(text, None).expect_err("the text is wrong").remove(0);
    assert_eq!((fault.cause, fault.message.as_str()), (cause, message));
    let place = fault.place.expect("the fault has a place");
    assert_eq!(&text[place.start..place.end], at, "{place:?}");
}

#[test]
fn wrong_files() {
    let with = |more: &str| format!("{{ {VERTICES}, {EDGES}, {more} }}");
    check("", Cause::Syntax, "the file is no JSON: EOF while parsing a value", "");
    let cut = "{ \"vertices_coords\": [[0,0],[1,";
    check(cut, Cause::Syntax, "the file is no JSON: EOF while parsing a value", "");
    check("{}", Cause::Empty, "the frame has no edges", "{}");
    let abstract_ = "{ \"edges_vertices\": [[0,1]] }";
    let message = "the frame has edges, but no `vertices_coords`";
    check(abstract_, Cause::Syntax, message, abstract_);
    check(
        &with(r#""edges_assignment": ["B","X"]"#),
        Cause::Syntax,
        "edges_assignment has 2 elements, and edges_vertices has 7",
        r#"["B","X"]"#,
    );
    let wrong = assigned("X");
    let message = "edges_assignment[6] is \"X\", not one of B M V F U C J";
    check(&with(&wrong), Cause::Syntax, message, "\"X\"");
    check(
        r#"{ "vertices_coords": [[0,0],[1,0]], "edges_vertices": [[0,1],[1,2]] }"#,
        Cause::Syntax,
        "edges_vertices[1] names vertex 2, and the frame has 2 vertices",
        "[1,2]",
    );
    check(
        r#"{ "vertices_coords": [[0,0],[1,0]], "edges_vertices": [[0,1],[1]] }"#,
        Cause::Syntax,
        "edges_vertices[1]: invalid length 1, expected an array of length 2",
        "[1]",
    );
    check(
        r#"{ "vertices_coords": [[0,0],[1e10,0]], "edges_vertices": [[0,1]] }"#,
        Cause::Number,
        "vertices_coords[1]: the coordinate 1e10 is too large",
        "[1e10,0]",
    );
    check(
        r#"{ "vertices_coords": [[0,0],[1]], "edges_vertices": [[0,1]] }"#,
        Cause::Syntax,
        "vertices_coords[1] has 1 coordinates, not two or three",
        "[1]",
    );
    check(
        r#"{ "vertices_coords": [[0,0],[null,0]], "edges_vertices": [[0,1]] }"#,
        Cause::Syntax,
        "vertices_coords[1]: invalid type: null, expected a number",
        "[null,0]",
    );
    check(
        &with(r#""edges_foldAngle": [0,0,0,0,0,0,270]"#),
        Cause::Number,
        "edges_foldAngle[6] is 270 degrees",
        "270",
    );
}

#[test]
fn wrong_parents() {
    let with = |more: &str| format!("{{ {VERTICES}, {EDGES}, {more} }}");
    let frame =
        r#"{ "frame_inherit": true, "frame_parent": 7, "frame_classes": ["creasePattern"] }"#;
    let frames = format!(r#""file_frames": [{frame}]"#);
    check(&with(&frames), Cause::Syntax, "frame_parent is 7, and the last frame is 1", frame);
    let circle = frame.replace('7', "1");
    let frames = format!(r#""file_frames": [{circle}]"#);
    let message = "frame 1 inherits from itself, or through more than 100 frames";
    check(&with(&frames), Cause::Syntax, message, &circle);
}

#[test]
fn folded_forms_that_cannot_be_laid_flat() {
    let class = r#""frame_classes": ["foldedForm"]"#;
    let text = format!("{{ {class}, {VERTICES}, {EDGES} }}");
    let message = "the file has a folded form and no crease pattern, and no faces to lay flat";
    check(&text, Cause::Syntax, message, &text);
    // A tetrahedron without its base.
    let text = format!(
        "{{ {class}, \"vertices_coords\": [[0,0,1],[1,0,0],[-1,1,0],[-1,-1,0]], \
         \"faces_vertices\": [[0,1,2],[0,2,3],[0,3,1]] }}"
    );
    let fault = fold::read(&text, None).expect_err("a cone").remove(0);
    assert!(fault.message.contains("comes to two places"), "{}", fault.message);
}

#[test]
fn hostile_files_are_refused() {
    let deep = "[".repeat(1_000_000);
    assert_eq!(fold::read(&deep, None).unwrap_err()[0].cause, Cause::Syntax);
    let nested = format!("{{\"vertices_coords\": {}{}}}", "[".repeat(500_000), "]".repeat(500_000));
    assert_eq!(fold::read(&nested, None).unwrap_err()[0].cause, Cause::Syntax);
    let long = format!("{{\"vertices_coords\": [{}0]}}", "0,".repeat(1_000_001));
    let fault = fold::read(&long, None).unwrap_err().remove(0);
    assert!(fault.message.contains("a list of at most 1000000 elements"), "{}", fault.message);
    let large = " ".repeat(64_000_001);
    assert_eq!(fold::read(&large, None).unwrap_err()[0].cause, Cause::Limit);
    let huge = r#"{ "vertices_coords": [[0,0],[1e999,0]], "edges_vertices": [[0,1]] }"#;
    assert_eq!(fold::read(huge, None).unwrap_err()[0].cause, Cause::Number);
}

#[test]
fn what_is_written() {
    let angles = r#""edges_foldAngle": [0,0,0,0,0,0,90]"#;
    let text = format!("{{ {VERTICES}, {EDGES}, {}, {angles} }}", assigned("V"));
    let pattern = Pattern::of(&read(&text), None).expect("the pattern is whole");
    let written = fold::write(&pattern, Some(1e-3));
    for part in
        ["\"file_spec\": 1.2", "\"frame_unit\": \"mm\"", "[0.5,0.0]", "\"V\"", "90.0", "[1,2,3,4]"]
    {
        assert!(written.contains(part), "{part} in {written}");
    }
    // A unit without a name is written in metres.
    let scaled = read(&fold::write(&pattern, Some(0.5)));
    assert_eq!(scaled.unit, Some(1.0));
    assert_eq!(scaled.strokes[1].ends, [[0.25, 0.0], [0.5, 0.0]]);
    let picture = svg::write(&pattern);
    assert!(picture.contains("viewBox=\"-0.02 -1.02 1.04 1.04\""), "{picture}");
    let crease =
        "<line x1=\"0.5\" y1=\"0\" x2=\"0.5\" y2=\"-1\" stroke=\"#0000ff\" opacity=\"0.5\"/>";
    assert!(picture.contains(crease), "{picture}");
    assert_eq!(picture.matches("stroke=\"#000000\"").count(), 6);
}
