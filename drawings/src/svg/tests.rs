//! Small drawings.

use std::f64::consts::PI;

use super::*;
use crate::drawing::{Role, Stroke};

const HEAD: &str =
    "<svg xmlns='http://www.w3.org/2000/svg' xmlns:xlink='http://www.w3.org/1999/xlink'>";

fn drawing(inside: &str) -> Drawing {
    whole(&format!("{HEAD}{inside}</svg>"))
}

fn whole(text: &str) -> Drawing {
    read(text, Some(0.01)).unwrap_or_else(|faults| panic!("{text}: {faults:?}"))
}

/// The ends of the strokes, exactly.
fn check(inside: &str, wanted: &[[[f64; 2]; 2]]) {
    let found: Vec<_> = drawing(inside).strokes.iter().map(|s| s.ends).collect();
    assert_eq!(found, wanted, "{inside}");
}

/// The role and the target angle, in shares of pi, of the only stroke.
fn check_role(inside: &str, role: Role, fold: Option<f64>) {
    let drawing = drawing(inside);
    let [Stroke { role: found, fold: angle, .. }] = drawing.strokes[..] else {
        panic!("{inside}: {drawing:?}")
    };
    assert_eq!(found, role, "{inside}");
    let near = |a: f64, b: f64| (a - b * PI).abs() < 1e-12;
    assert!(
        angle.is_some() == fold.is_some() && angle.zip(fold).is_none_or(|(a, b)| near(a, b)),
        "{inside}: {angle:?}"
    );
}

/// What is ignored beside one line.
fn check_ignored(inside: &str, wanted: &[(&str, usize)]) {
    let drawing = drawing(&format!("{inside}<line stroke='red' x2='1'/>"));
    let found: Vec<_> = drawing.ignored.iter().map(|i| (i.what.as_str(), i.count)).collect();
    assert_eq!((found.as_slice(), drawing.strokes.len()), (wanted, 1), "{inside}");
}

fn refuse(inside: &str, cause: Cause, message: &str, excerpt: &str) {
    let text = format!("{HEAD}{inside}</svg>");
    let faults = read(&text, None).unwrap_err();
    let place = faults[0].place.unwrap_or_default();
    assert!(
        faults[0].cause == cause && faults[0].message.contains(message),
        "{inside}: {faults:?}"
    );
    assert_eq!(&text[place.start..place.end], excerpt, "{inside}");
}

#[test]
fn coordinates_keep_their_bits() {
    let (x, y) = (0.1 + 0.2, 1e9 / 3.0);
    check(
        &format!("<line stroke='red' x1='{x}' y1='{y}' x2=' 1 ' y2='0'/>"),
        &[[[x, -y], [1.0, 0.0]]],
    );
    check(&format!("<path stroke='red' d='M{x},{y}L1 0'/>"), &[[[x, -y], [1.0, 0.0]]]);
    let zero = drawing("<line stroke='red' x2='1'/>").strokes[0].ends[0][1];
    assert_eq!(zero.to_bits(), 0.0_f64.to_bits());
}

#[test]
fn every_shape_of_straight_lines() {
    let square = [[0.0, 0.0], [2.0, 0.0], [2.0, -3.0], [0.0, -3.0], [0.0, 0.0]];
    let sides: Vec<_> = square.windows(2).map(|w| [w[0], w[1]]).collect();
    check("<rect stroke='#000' width='2' height='3'/>", &sides);
    check("<polygon stroke='#000' points='0,0 2,0 2,3 0,3'/>", &sides);
    check("<polygon stroke='#000' points='0,0 2,0 2,3 0,3 7'/>", &sides);
    check("<polyline stroke='#000' points=' 0 0,2,0 2,3 0,3'/>", &sides[..3]);
    check("<path stroke='#000' d='M0 0H2V3H0Z'/>", &sides);
    check("<path stroke='#000' d='m0 0 2 0 0 3-2 0z'/>", &sides);
    check("<path stroke='#000' d='m0 0h2v3h-2z'/>", &sides);
    check("<path stroke='#000' d='M0 0L2 0 2 3 0 3 0 0z'/>", &sides);
    let thirds =
        drawing("<path stroke='#000' d='M889.1 3456.7h-490.3l110.1 0.7 380.2-0.7z'/>").strokes;
    assert_eq!(thirds.len(), 3, "{thirds:?}");
    let two = [sides[0], [[0.0, 0.0], [1.0, -1.0]]];
    check("<path stroke='#000' d='M0 0H2M0 0L1 1'/>", &two);
    check("<path stroke='#000' d='M0 0H2zl1 1'/>", &[two[0], [[2.0, 0.0], [0.0, 0.0]], two[1]]);
    check("<path stroke='#000' d='M0 0C0 0 2 0 2 0'/>", &sides[..1]);
    check("<path stroke='#000' d='M0 0A0 5 0 0 1 2 0'/>", &sides[..1]);
}

/// The ends must be at distance `radius` from the centre, the first and the last where `ends` says.
fn check_arc(
    inside: &str,
    centre: [f64; 2],
    radius: f64,
    ends: [[f64; 2]; 2],
    lines: std::ops::RangeInclusive<usize>,
) {
    let strokes = drawing(inside).strokes;
    assert!(lines.contains(&strokes.len()), "{inside}: {} lines", strokes.len());
    for stroke in &strokes {
        for p in stroke.ends {
            let distance = (p[0] - centre[0]).hypot(p[1] - centre[1]);
            assert!((distance - radius).abs() < 1e-12, "{inside}: {p:?}");
        }
    }
    assert_eq!([strokes[0].ends[0], strokes[strokes.len() - 1].ends[1]], ends, "{inside}");
    assert!(strokes.windows(2).all(|w| w[0].ends[1] == w[1].ends[0]), "{inside} has gaps");
}

#[test]
fn arcs_and_circles() {
    let start = [[5.0, 0.0], [5.0, 0.0]];
    check_arc("<circle stroke='#000' r='5'/>", [0.0, 0.0], 5.0, start, 48..=64);
    check_arc("<ellipse stroke='#000' rx='5'/>", [0.0, 0.0], 5.0, start, 48..=64);
    check_arc(
        "<circle stroke='#000' cx='1' r='1e-3'/>",
        [1.0, 0.0],
        1e-3,
        [[1.001, 0.0], [1.001, 0.0]],
        8..=8,
    );
    // Upwards on the screen is negative y of SVG, and positive y of the drawing.
    let arc = |large, sweep, ends: &str| {
        format!("<path stroke='#000' d='M3 4A5 5 0 {large} {sweep} {ends}'/>")
    };
    check_arc(&arc(0, 1, "-3 4"), [0.0, 0.0], 5.0, [[3.0, -4.0], [-3.0, -4.0]], 8..=14);
    check_arc(&arc(1, 0, "-3 4"), [0.0, 0.0], 5.0, [[3.0, -4.0], [-3.0, -4.0]], 38..=44);
    check_arc(&arc(0, 0, "-3 4"), [0.0, -8.0], 5.0, [[3.0, -4.0], [-3.0, -4.0]], 8..=14);
    check_arc(&arc(1, 1, "-3 4"), [0.0, -8.0], 5.0, [[3.0, -4.0], [-3.0, -4.0]], 38..=44);
    // Radii that are too small grow.
    check_arc(
        "<path stroke='#000' d='M-5 0A1 1 30 0 1 5 0'/>",
        [0.0, 0.0],
        5.0,
        [[-5.0, 0.0], [5.0, 0.0]],
        24..=32,
    );
    let round = drawing("<rect stroke='#000' width='10' height='6' rx='2'/>").strokes;
    assert_eq!(round[0].ends, [[2.0, 0.0], [8.0, 0.0]]);
    assert_eq!(round.last().unwrap().ends[1], [2.0, 0.0]);
    let corner = |x: f64, y: f64| (x.clamp(2.0, 8.0) - x).hypot(y.clamp(-4.0, -2.0) - y);
    assert!(round.iter().all(|s| (corner(s.ends[0][0], s.ends[0][1]) - 2.0).abs() < 1e-12));
    assert!(round.windows(2).all(|w| w[0].ends[1] == w[1].ends[0]));
}

#[test]
fn smooth_curves_go_on_in_their_direction() {
    let explicit = drawing("<path stroke='red' d='M0 0C0 5 5 5 5 0C5 -5 10 -5 10 0'/>").strokes;
    let smooth = drawing("<path stroke='red' d='M0 0C0 5 5 5 5 0S10 -5 10 0'/>").strokes;
    let relative = drawing("<path stroke='red' d='m0 0c0 5 5 5 5 0s5 -5 5 0'/>").strokes;
    let ends = |strokes: &[Stroke]| strokes.iter().map(|s| s.ends).collect::<Vec<_>>();
    assert_eq!(ends(&smooth), ends(&explicit));
    assert_eq!(ends(&relative), ends(&explicit));
    let explicit = drawing("<path stroke='red' d='M0 0Q5 5 10 0Q15 -5 20 0'/>").strokes;
    let smooth = drawing("<path stroke='red' d='M0 0Q5 5 10 0T20 0'/>").strokes;
    assert_eq!(ends(&smooth), ends(&explicit));
}

#[test]
fn transforms_and_groups() {
    let line = "<line stroke='red' x1='1' y1='2' x2='3' y2='4'/>";
    let within = |transform: &str| format!("<g transform='{transform}'>{line}</g>");
    check(&within("translate(10)"), &[[[11.0, -2.0], [13.0, -4.0]]]);
    check(&within("scale(2,3)"), &[[[2.0, -6.0], [6.0, -12.0]]]);
    check(&within("rotate(90)"), &[[[-2.0, -1.0], [-4.0, -3.0]]]);
    check(&within("rotate(180 1 2)"), &[[[1.0, -2.0], [-1.0, 0.0]]]);
    check(&within("matrix(1 2 3 4 5 6)"), &[[[12.0, -16.0], [20.0, -28.0]]]);
    check(&within("translate(10,20) scale(2)"), &[[[12.0, -24.0], [16.0, -28.0]]]);
    check(
        &format!("<g transform='scale(2)'><a>{}</a></g>", within("translate(1,1)")),
        &[[[4.0, -6.0], [8.0, -10.0]]],
    );
    check(&within("skewX(0) skewY(0)"), &[[[1.0, -2.0], [3.0, -4.0]]]);
    check(&within(""), &[[[1.0, -2.0], [3.0, -4.0]]]);
    check("<line stroke='red' x2='1in' y2='1pc'/>", &[[[0.0, 0.0], [96.0, -16.0]]]);
    let svg = "<svg x='1' y='1' width='20' height='10' viewBox='0 0 4 4'>";
    check(&format!("{svg}{line}</svg>"), &[[[8.5, -6.0], [13.5, -11.0]]]);
    check(&format!("{svg}<line stroke='red' x2='50%'/></svg>"), &[[[6.0, -1.0], [11.0, -1.0]]]);
}

#[test]
fn clones_and_symbols() {
    let line = "<line id='a' x1='1' y1='2' x2='3' y2='4'/>";
    let place = [[1.0, -2.0], [3.0, -4.0]];
    let moved = [[11.0, -2.0], [13.0, -4.0]];
    check(&format!("<g stroke='red'>{line}<use href='#a' x='10'/></g>"), &[place, moved]);
    check(
        &format!(
            "<defs>{line}</defs><use stroke='red' xlink:href='#a' transform='translate(10)'/>"
        ),
        &[moved],
    );
    let symbol = "<symbol id='s' viewBox='0 0 4 4'><line x1='1' y1='2' x2='3' y2='4'/></symbol>";
    check(
        &format!("{symbol}<use stroke='red' href='#s' width='8' height='8'/>"),
        &[[[2.0, -4.0], [6.0, -8.0]]],
    );
    let twice = "<defs><g id='g'><use href='#a'/></g></defs>";
    check(
        &format!("<g display='none'>{line}</g>{twice}<use stroke='red' href='#g' x='10'/>"),
        &[moved],
    );
    let switch = "<switch><foreignObject requiredExtensions='x'/><g><line stroke='red' x2='1'/></g><g/></switch>";
    check(switch, &[[[0.0, 0.0], [1.0, 0.0]]]);
}

#[test]
fn colours_come_from_attributes_styles_and_classes() {
    let line = |words: &str| format!("<line x2='1' {words}/>");
    let sheet = "<style>/* c */ @media print { .b { stroke: red } } .b, .c > .x { stroke: blue } line { stroke: lime }
                 #i { stroke: yellow !important } g .d.e { stroke: magenta } .f { stroke: red; opacity: 25% }</style>";
    let styled = |words: &str| format!("{sheet}{}", line(words));
    check_role(&line("stroke='#ED1C24'"), Role::Mountain, None);
    check_role(&line("stroke='rgb(0, 0, 255)' opacity='.5'"), Role::Valley, Some(0.5));
    check_role(
        &line("stroke='hsl(240, 100%, 50%)' stroke-opacity='50%' opacity='0.5'"),
        Role::Valley,
        Some(0.25),
    );
    check_role(&line("stroke='#f008'"), Role::Mountain, Some(-136.0 / 255.0));
    check_role(&line("stroke='#000' opacity='.5'"), Role::Border, None);
    check_role(&line("stroke='red' opacity='0'"), Role::Mountain, Some(0.0));
    check_role(&line("stroke='red' opacity='7'"), Role::Mountain, Some(-1.0));
    check_role(&line("stroke='currentColor' color='blue'"), Role::Valley, None);
    check_role(
        &line("style='stroke : blue ;; opacity: 0.5' stroke='red'"),
        Role::Valley,
        Some(0.5),
    );
    check_role(&line("stroke='red' style='stroke:nonsense'"), Role::Mountain, None);
    check_role(&line("stroke='#ff0000 icc-color(a, 1)'"), Role::Mountain, None);
    check_role(
        &format!("<g opacity='.5' stroke='red'><g opacity='.5'>{}</g></g>", line("")),
        Role::Mountain,
        Some(-0.25),
    );
    check_role(&styled(""), Role::Cut, None);
    check_role(&styled("stroke='red'"), Role::Cut, None);
    check_role(&styled("class='a b'"), Role::Valley, None);
    check_role(&styled("class='b' style='stroke:red'"), Role::Mountain, None);
    check_role(&styled("class='b' id='i' style='stroke:red'"), Role::Flat, None);
    check_role(&styled("class='f'"), Role::Mountain, Some(-0.25));
    check_role(&format!("{sheet}<g>{}</g>", line("class='e d'")), Role::Hinge, None);
    check_role(&styled("class='e d'"), Role::Cut, None);
    check_role(&format!("{sheet}<g class='c'>{}</g>", line("class='x'")), Role::Valley, None);
    check_role(&format!("{sheet}<g class='c'><g>{}</g></g>", line("class='x'")), Role::Cut, None);
}

#[test]
fn only_an_opacity_that_is_written_is_an_angle() {
    let line = |words: &str| format!("<line x2='1' {words}/>");
    for (words, share) in [
        ("stroke='red'", None),
        ("stroke='rgb(255, 0, 0)'", None),
        ("stroke='rgb(100%, 0%, 0%)'", None),
        ("stroke='red' opacity='nonsense'", None),
        ("stroke='red' opacity='1'", Some(-1.0)),
        ("stroke='red' stroke-opacity='1'", Some(-1.0)),
        // CSS Color 4: an alpha is a number or a percentage, and not one of 256 steps.
        ("stroke='rgba(255, 0, 0, 0.5)'", Some(-0.5)),
        ("stroke='rgba(255,0,0,.25)'", Some(-0.25)),
        ("stroke='hsla(0, 100%, 50%, 30%)'", Some(-0.3)),
        ("stroke='rgb(255 0 0 / 0.1)'", Some(-0.1)),
        ("stroke='hsla(0, 100%, 50%, 0.5)'", Some(-0.5)),
        ("stroke='rgba(255, 0, 0, 0.5)' stroke-opacity='0.5'", Some(-0.25)),
        ("stroke='currentColor' color='rgba(255, 0, 0, 0.5)'", Some(-0.5)),
        ("stroke='url(#a) rgba(255, 0, 0, 0.5)'", Some(-0.5)),
        ("stroke='#ff000080'", Some(-128.0 / 255.0)),
    ] {
        check_role(&line(words), Role::Mountain, share);
    }
    // Of a group without a stroke of its own, too.
    let inside = line("stroke='inherit'");
    check_role(&format!("<g stroke='rgba(0, 0, 255, 0.5)'>{inside}</g>"), Role::Valley, Some(0.5));
}

#[test]
fn what_is_no_line_is_counted() {
    check_ignored(
        "<text>a</text><text/><image/><linearGradient/>",
        &[("text", 2), ("image", 1), ("linearGradient", 1)],
    );
    check_ignored("<rect width='9' height='9' fill='red'/>", &[("rect without stroke", 1)]);
    check_ignored("<path d='M0 0L1 1' stroke='#ccc'/>", &[("path with stroke #cccccc", 1)]);
    check_ignored("<path d='M0 0L1 1' stroke='#f80'/>", &[("path with stroke #ff8800", 1)]);
    check_ignored(
        "<path d='M0 0L1 1' stroke='url(#a)'/>",
        &[("path with a stroke of no single colour", 1)],
    );
    check_ignored(
        "<g style='display:none'><path d='nonsense'/></g>",
        &[("g with display:none", 1)],
    );
    check_ignored(
        "<g visibility='hidden' stroke='red'><circle r='1'/></g>",
        &[("circle that is hidden", 1)],
    );
    check_ignored("<use href='#none'/>", &[("use of something that is not in the file", 1)]);
    check_ignored("<style>a:hover {}</style>", &[("style a:hover", 1)]);
    check_ignored(
        "<title>x</title><desc/><defs><path/></defs><symbol/><metadata/><x:y xmlns:x='z'/>",
        &[],
    );
    let many: String = (0..200).map(|i| format!("<x{i}/>")).collect();
    assert_eq!(
        drawing(&format!("{many}<line stroke='red' x2='1'/>")).ignored.len(),
        limits::KINDS + 1
    );
}

#[test]
fn mistakes_have_a_position() {
    refuse("<line stroke='red' x2='NaN'/>", Cause::Number, "`x2`", "NaN");
    refuse("<line stroke='red' x2='1em'/>", Cause::Number, "font", "1em");
    refuse("<line stroke='red' x2='10%'/>", Cause::Number, "page without size", "10%");
    refuse(
        "<line stroke='red' x2='1e300'/>",
        Cause::Number,
        "1e300",
        "<line stroke='red' x2='1e300'/>",
    );
    refuse("<polygon stroke='red' points='1 2 x'/>", Cause::Number, "points", "1 2 x");
    refuse("<path stroke='red' d='M0 0L1'/>", Cause::Syntax, "data", "M0 0L1");
    refuse("<path stroke='red' d='M0 0L1 1e999'/>", Cause::Number, "data", "M0 0L1 1e999");
    refuse("<circle stroke='red' r='-1'/>", Cause::Number, "negative", "-1");
    refuse("<g transform='spin(3)'><path/></g>", Cause::Syntax, "transform", "spin(3)");
    refuse("<g style='transform: none'/>", Cause::Syntax, "attribute", "transform: none");
    let scaled = "<line stroke='red' x2='1e200' transform='scale(1e200)'/>";
    refuse(scaled, Cause::Number, "inf", scaled);
    refuse("<g id='a'><use href='#a'/></g>", Cause::Syntax, "itself", "<use href='#a'/>");
    let cycle = "<g id='a'><use href='#b'/></g><g id='b'><use href='#a'/></g>";
    refuse(cycle, Cause::Syntax, "itself", "<use href='#b'/>");
    refuse("<g></x>", Cause::Syntax, "XML", "<");
    refuse("<ä ö", Cause::Syntax, "XML", "<");
    let two =
        read(&format!("{HEAD}<line stroke='red' x2='a'/><line stroke='red' y2='b'/></svg>"), None)
            .unwrap_err();
    assert_eq!(two.len(), 2);
    let many = read(&format!("{HEAD}{}</svg>", "<line stroke='red' x2='a'/>".repeat(99)), None)
        .unwrap_err();
    assert_eq!(many.len(), limits::FAULTS);
    assert_eq!(read("<html/>", None).unwrap_err()[0].cause, Cause::Syntax);
    let empty = read(&format!("{HEAD}<text/></svg>"), None).unwrap_err().remove(0);
    assert!(
        empty.cause == Cause::Empty && empty.hint.is_some_and(|hint| hint.contains("1 x text"))
    );
}

#[test]
fn the_page_says_the_unit() {
    let line = "<line stroke='red' x2='50%' y2='10'/>";
    let read = whole(&format!("<svg width='20mm' height='20mm' viewBox='5 5 10 10'>{line}</svg>"));
    assert_eq!((read.unit, read.strokes[0].ends), (Some(0.002), [[0.0, 0.0], [5.0, -10.0]]));
    let flat = format!(
        "<svg width='20mm' height='10mm' viewBox='5 5 10 10' preserveAspectRatio='none'>{line}</svg>"
    );
    let read = whole(&flat);
    assert_eq!((read.unit, read.strokes[0].ends), (Some(0.002), [[0.0, 0.0], [5.0, -5.0]]));
}
