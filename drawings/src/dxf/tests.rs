//! Small drawings, each written as `code=value` words.

use super::write;
use crate::drawing::{Drawing, Role};
use crate::fault::Cause;
use crate::reading::{Format, Reading};

/// A file of sections; words are `code=value`, and `_` in a value is a space.
pub(super) fn text(words: &str) -> String {
    words.split_whitespace().fold(String::new(), |text, word| {
        let (code, value) = word.split_once('=').unwrap();
        text + code + "\n" + &value.replace('_', " ") + "\n"
    })
}

pub(super) fn file(tables: &str, blocks: &str, entities: &str) -> String {
    text(&format!(
        "0=SECTION 2=HEADER 9=$ACADVER 1=AC1015 9=$INSUNITS 70=4 0=ENDSEC
         0=SECTION 2=TABLES 0=TABLE 2=LAYER {tables} 0=ENDTAB 0=ENDSEC
         0=SECTION 2=BLOCKS {blocks} 0=ENDSEC 0=SECTION 2=ENTITIES {entities} 0=ENDSEC 0=EOF"
    ))
}

fn drawing(text: &str, reading: &Reading) -> Drawing {
    crate::read(Format::Dxf, text.as_bytes(), reading).unwrap_or_else(|faults| panic!("{faults:?}"))
}

fn ends(drawing: &Drawing) -> Vec<[[f64; 2]; 2]> {
    drawing.strokes.iter().map(|s| s.ends).collect()
}

/// The strokes of entities, to a tolerance of 1e-12.
fn check(blocks: &str, entities: &str, wanted: &[[[f64; 2]; 2]]) {
    let found = ends(&drawing(&file("", blocks, entities), &Reading::default()));
    assert_eq!(found.len(), wanted.len(), "{entities}: {found:?}");
    for (a, b) in found.iter().flatten().flatten().zip(wanted.iter().flatten().flatten()) {
        assert!((a - b).abs() < 1e-12, "{entities}: {found:?} is not {wanted:?}");
    }
}

#[test]
fn lines_and_polylines() {
    check("", "0=LINE 8=0 10=0.1 20=0.2 30=5 11=3 21=4 31=5", &[[[0.1, 0.2], [3.0, 4.0]]]);
    let open = [[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [1.0, 1.0]]];
    let closed = [open[0], open[1], [[1.0, 1.0], [0.0, 0.0]]];
    check("", "0=LWPOLYLINE 90=3 70=0 10=0 20=0 10=1 20=0 10=1 20=1", &open);
    check("", "0=LWPOLYLINE 90=3 70=1 10=0 20=0 10=1 20=0 10=1 20=1", &closed);
    let vertices = "0=VERTEX 10=0 20=0 0=VERTEX 10=9 20=9 70=16 0=VERTEX 10=1 20=0 0=VERTEX 10=1 20=1 0=SEQEND";
    check("", &format!("0=POLYLINE 66=1 10=0 20=0 30=0 70=1 {vertices}"), &closed);
    check("", &format!("0=POLYLINE 66=1 70=8 {vertices}"), &open);
    let mirrored = open.map(|ends| ends.map(|[x, y]| [-x, y]));
    check("", "0=LWPOLYLINE 70=0 10=0 20=0 10=1 20=0 10=1 20=1 210=0 220=0 230=-1", &mirrored);
    check("", "0=LINE 10=0 20=0 11=1 21=0 210=0 220=0 230=-1", &open[..1]);
    let trash = file("", "", "0=LINE 10=0 20=0 11=1 21=0") + "trash\n";
    assert_eq!(ends(&drawing(&trash, &Reading::default())), open[..1]);
}

#[test]
fn blocks_are_moved_turned_scaled_and_repeated() {
    let arrow = "0=BLOCK 2=Arrow 10=1 20=1 0=LINE 8=0 10=1 20=1 11=2 21=1 0=ENDBLK";
    check(arrow, "0=INSERT 2=ARROW 10=5 20=6", &[[[5.0, 6.0], [6.0, 6.0]]]);
    check(arrow, "0=INSERT 2=arrow 10=5 20=6 50=90 41=2 42=-3", &[[[5.0, 6.0], [5.0, 8.0]]]);
    check(arrow, "0=INSERT 2=arrow 10=5 20=6 230=-1", &[[[-5.0, 6.0], [-6.0, 6.0]]]);
    let cells = [
        [[0.0, 0.0], [2.0, 0.0]],
        [[10.0, 0.0], [12.0, 0.0]],
        [[0.0, 7.0], [2.0, 7.0]],
        [[10.0, 7.0], [12.0, 7.0]],
    ];
    check(arrow, "0=INSERT 2=arrow 41=2 70=2 71=2 44=10 45=7", &cells);
    let nested = format!("{arrow} 0=BLOCK 2=Two 0=INSERT 2=arrow 10=1 20=0 50=90 0=ENDBLK");
    check(&nested, "0=INSERT 2=Two 10=10 20=0 50=90", &[[[10.0, 1.0], [9.0, 1.0]]]);
    check(arrow, "0=LINE 10=0 20=0 11=1 21=0 0=INSERT 2=none", &[[[0.0, 0.0], [1.0, 0.0]]]);
}

/// All ends of the strokes must be where `distance` is zero, and their middles nearly; they must add up to a
/// length.
fn check_curve(entity: &str, flatness: f64, distance: impl Fn([f64; 2]) -> f64, length: f64) {
    let reading = Reading { flatness: Some(flatness), ..Reading::default() };
    let drawing = drawing(&file("", "", entity), &reading);
    let mut sum = 0.0;
    for [a, b] in ends(&drawing) {
        let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        assert!(distance(a).abs() < 1e-9 && distance(b).abs() < 1e-9, "{entity}: {a:?} {b:?}");
        assert!(distance(middle).abs() < 1.01 * flatness, "{entity}: {a:?} {b:?}");
        sum += (b[0] - a[0]).hypot(b[1] - a[1]);
    }
    assert!((sum - length).abs() < 1e-2 * length, "{entity}: the length is {sum}, not {length}");
}

#[test]
fn arcs_circles_ellipses_and_splines() {
    let pi = std::f64::consts::PI;
    let circle = |x: f64, y: f64, r: f64| move |p: [f64; 2]| (p[0] - x).hypot(p[1] - y) - r;
    check_curve("0=CIRCLE 10=1 20=2 40=5", 0.01, circle(1.0, 2.0, 5.0), 10.0 * pi);
    check_curve("0=CIRCLE 10=1 20=2 40=5 230=-1", 0.01, circle(-1.0, 2.0, 5.0), 10.0 * pi);
    check_curve("0=ARC 10=1 20=2 40=5 50=350 51=80", 0.01, circle(1.0, 2.0, 5.0), 2.5 * pi);
    check_curve("0=ARC 10=0 20=0 40=5 50=0 51=90 230=-1", 0.01, circle(0.0, 0.0, 5.0), 2.5 * pi);
    check_curve(
        "0=LWPOLYLINE 70=1 10=-5 20=0 42=1 10=5 20=0 42=1",
        0.01,
        circle(0.0, 0.0, 5.0),
        10.0 * pi,
    );
    let quarter = "0=LWPOLYLINE 70=0 10=5 20=0 42=0.41421356237309503 10=0 20=5";
    check_curve(quarter, 0.01, circle(0.0, 0.0, 5.0), 2.5 * pi);
    let clockwise = "0=LWPOLYLINE 70=0 10=0 20=5 42=-0.41421356237309503 10=5 20=0";
    check_curve(clockwise, 0.01, circle(0.0, 0.0, 5.0), 2.5 * pi);
    let ellipse = |p: [f64; 2]| ((p[0] / 3.0).hypot(p[1] / 5.0) - 1.0) * 3.0;
    check_curve("0=ELLIPSE 10=0 20=0 11=0 21=5 40=0.6 41=0 42=6.283185", 0.01, ellipse, 25.527);
    check_curve(
        "0=ELLIPSE 10=0 20=0 11=0 21=5 40=0.6 41=0 42=3.141592653589793",
        0.01,
        ellipse,
        12.763,
    );
    let parabola = |p: [f64; 2]| p[1] - p[0] * (10.0 - p[0]) / 10.0;
    let spline =
        "0=SPLINE 70=8 71=2 72=6 73=3 40=0 40=0 40=0 40=1 40=1 40=1 10=0 20=0 10=5 20=5 10=10 20=0";
    check_curve(spline, 0.01, parabola, 11.479);
}

#[test]
fn layers_and_colours_say_roles() {
    let tables = "0=LAYER 2=Cut_lines 70=0 62=7 0=LAYER 2=reds 62=1 0=LAYER 2=creases 62=5 0=LAYER 2=off 62=-1
                  0=LAYER 2=ice 70=1 62=1 0=LAYER 2=true 62=7 420=255";
    let line = |words: &str| format!("0=LINE {words} 10=0 20=0 11=1 21=0 ");
    let block = format!("0=BLOCK 2=B {} {} 0=ENDBLK", line("8=0"), line("8=0 62=0"));
    let roles = |entities: &str, layers: &[(Role, &str)]| -> Vec<Role> {
        let layers = layers.iter().map(|(role, name)| (*role, name.to_string())).collect();
        let reading = Reading { layers, ..Reading::default() };
        drawing(&file(tables, &block, entities), &reading).strokes.iter().map(|s| s.role).collect()
    };
    use Role::*;
    let convention: [(&str, &[Role]); 11] = [
        ("8=cut_LINES 62=1", &[Cut]),
        ("8=reds", &[Mountain]),
        ("8=reds 62=256", &[Mountain]),
        ("8=reds 62=5", &[Valley]),
        ("8=creases", &[Valley]),
        ("8=creases 62=3", &[Hinge]),
        ("8=true", &[Valley]),
        ("8=unknown", &[Border]),
        ("8=0 420=16711680", &[Mountain]),
        ("8=0 62=2", &[Flat]),
        ("8=0 62=6", &[Hinge]),
    ];
    for (words, wanted) in convention {
        assert_eq!(roles(&line(words), &[]), wanted, "{words}");
    }
    assert_eq!(roles("0=INSERT 2=B 8=reds 62=5", &[]), [Mountain, Valley]);
    assert_eq!(roles("0=INSERT 2=B 8=cut_lines", &[]), [Cut, Cut]);
    let two = line("8=reds") + &line("8=creases") + &line("8=0 62=3");
    assert_eq!(roles(&two, &[(Cut, "REDS")]), [Cut]);
    assert_eq!(roles(&two, &[(Cut, "reds"), (Flat, "green")]), [Cut, Flat]);
    assert_eq!(roles(&two, &[(Cut, "5")]), [Cut]);
    let hidden = line("8=off")
        + &line("8=ice")
        + &line("8=0 60=1")
        + &line("8=0 67=1")
        + &line("8=0 62=4")
        + &line("8=reds");
    let read = drawing(
        &file(tables, &block, &(hidden + "0=TEXT 8=0 1=x 0=TEXT 8=0")),
        &Reading::default(),
    );
    let ignored: Vec<_> = read.ignored.iter().map(|i| (i.what.as_str(), i.count)).collect();
    let wanted = [
        ("LINE on hidden layer off", 1),
        ("LINE on hidden layer ice", 1),
        ("LINE that is invisible", 1),
        ("LINE in paper space", 1),
        ("LINE on layer 0 in colour 4", 1),
        ("TEXT", 2),
    ];
    assert_eq!((ignored.as_slice(), read.strokes.len()), (wanted.as_slice(), 1));
}

#[test]
fn what_leaves_the_plane_is_ignored() {
    let entities = "0=LINE 10=0 20=0 11=1 21=0 0=LINE 10=0 20=0 30=0 11=1 21=0 31=2 0=CIRCLE 10=0 20=0 40=1 210=1 220=0 230=0
        0=POLYLINE 70=8 0=VERTEX 10=0 20=0 30=0 0=VERTEX 10=1 20=0 30=1 0=SEQEND 0=POLYLINE 70=64 0=VERTEX 10=0 20=0 0=SEQEND
        0=SPLINE 71=3 11=0 21=0 0=CIRCLE 10=1 20=1 40=0";
    let read = drawing(&file("", "", entities), &Reading::default());
    let ignored: Vec<_> = read.ignored.iter().map(|i| i.what.as_str()).collect();
    let wanted = [
        "LINE with ends at different heights",
        "CIRCLE in an inclined plane",
        "POLYLINE with vertices at different heights",
        "POLYLINE that is a mesh",
        "SPLINE without control points",
        "CIRCLE without radius",
    ];
    assert_eq!((ignored.as_slice(), read.strokes.len()), (wanted.as_slice(), 1));
}

fn refuse(text: &str, reading: &Reading, cause: Cause, message: &str, excerpt: Option<&str>) {
    let faults = crate::read(Format::Dxf, text.as_bytes(), reading).unwrap_err();
    assert!(faults[0].cause == cause && faults[0].message.contains(message), "{faults:?}");
    let found = faults[0].place.map(|p| &text[p.start..p.end]);
    match (found, excerpt) {
        (Some(found), Some(excerpt)) => {
            assert!(found.starts_with(excerpt), "{found} is not {excerpt}")
        }
        (found, excerpt) => assert_eq!(found, excerpt),
    }
}

#[test]
fn mistakes_have_a_position() {
    let none = Reading::default();
    let entity = |words: &str| file("", "", words);
    refuse(&entity("0=LINE 10=nan 20=0"), &none, Cause::Number, "group 10", Some("nan"));
    refuse(&entity("0=LINE 10=1,5 20=0"), &none, Cause::Number, "group 10", Some("1,5"));
    refuse(&entity("0=LINE 10=0 20=0 11=1e300 21=0"), &none, Cause::Number, "1e300", Some("LINE"));
    refuse(
        &entity("0=SPLINE 71=3 40=0 10=0 20=0"),
        &none,
        Cause::Syntax,
        "control points",
        Some("SPLINE"),
    );
    refuse(&entity("0=TEXT"), &none, Cause::Empty, "no line", None);
    let cycle = "0=BLOCK 2=A 0=INSERT 2=B 0=ENDBLK 0=BLOCK 2=B 0=INSERT 2=A 0=ENDBLK";
    refuse(
        &file("", cycle, "0=INSERT 2=A"),
        &none,
        Cause::Syntax,
        "contains itself",
        Some("INSERT"),
    );
    refuse("0\nSECTION\n2\nENTITIES\n0\nLINE\n", &none, Cause::Syntax, "ends before", Some(""));
    refuse("0\nLINE\n0\nEOF\n", &none, Cause::Syntax, "outside of sections", Some("LINE"));
    let mapped = Reading { layers: vec![(Role::Cut, "CUTS".into())], ..Reading::default() };
    refuse(
        &entity("0=LINE 8=cut 10=0 20=0 11=1 21=0"),
        &mapped,
        Cause::Empty,
        "no layer `CUTS`",
        None,
    );
}

#[test]
fn bombs_of_blocks_are_refused() {
    let mut blocks = "0=BLOCK 2=0 0=LINE 10=0 20=0 11=1 21=0 0=ENDBLK".to_string();
    for i in 1..30 {
        blocks += &format!(" 0=BLOCK 2={i} 0=INSERT 2={} 0=INSERT 2={} 0=ENDBLK", i - 1, i - 1);
    }
    let none = Reading::default();
    refuse(&file("", &blocks, "0=INSERT 2=29"), &none, Cause::Limit, "", Some("LINE"));
    let array = "0=BLOCK 2=e 0=ENDBLK";
    refuse(
        &file("", array, "0=INSERT 2=e 70=30000 71=30000"),
        &none,
        Cause::Limit,
        "work",
        Some("INSERT"),
    );
}

#[test]
fn what_is_written_is_read() {
    let square = vec![[0.0, 0.0], [0.1, 0.0], [0.1, 0.05], [0.0, 0.05]];
    let hole = vec![[0.01, 0.01], [0.01, 0.02], [0.02 / 3.0, 0.02]];
    let layers = [
        ("cut: ä/1".to_string(), vec![square.clone(), hole.clone(), vec![[0.0, 0.0]]]),
        ("fold".into(), vec![]),
    ];
    let text = write(&layers, 1.0);
    let reading = Reading { layers: vec![(Role::Cut, "CUT_ Ä_1".into())], ..Reading::default() };
    let read = drawing(&text, &reading);
    assert_eq!((read.unit, read.ignored.len()), (Some(0.001), 0));
    let wanted: Vec<_> = [square, hole]
        .iter()
        .flat_map(|points| (0..points.len()).map(|i| [points[i], points[(i + 1) % points.len()]]))
        .map(|ends| ends.map(|p| p.map(|x| x * 1000.0)))
        .collect();
    assert_eq!(ends(&read), wanted);
}
