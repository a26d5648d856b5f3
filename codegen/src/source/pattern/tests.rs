//! Drawings of our own, as models: names, signs, outlines, springs, and what is left out.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::fs;

use proptest::prelude::*;

mod folds;
mod slits;

use super::{Ground, Options, import};
use crate::source::{
    Body, Diagnostics, Expression, Joint, Shape, SourceFile, SourceModel, Spring, parse, to_yaml,
};

/// A line: its colour and its ends, in mm, with y upwards.
type Stroke = (&'static str, [f64; 4]);

const BORDER: &str = "#000";
const MOUNTAIN: &str = "#f00";
const VALLEY: &str = "#00f";
const CUT: &str = "#0f0";
const FLAT: &str = "#ff0";
const UNDRIVEN: &str = "#f0f";

/// Materials and layers of the models, and what follows in them.
const SHEET: &str = "units: { length: mm, angle: deg }\n\
    materials:\n  card: { density: 700, thickness: 0.4, youngs_modulus: 2 GPa }\n  \
    film: { density: 1400, thickness: 0.1, youngs_modulus: 4 GPa }\n";

fn svg(strokes: &[Stroke]) -> String {
    let mut text = String::from(
        "<svg xmlns='http://www.w3.org/2000/svg' width='100mm' height='100mm' viewBox='0 0 100 100'>\n\
         <g transform='scale(1 -1)'>\n",
    );
    for (colour, [x1, y1, x2, y2]) in strokes {
        let _ = writeln!(text, "<line stroke='{colour}' x1='{x1}' y1='{y1}' x2='{x2}' y2='{y2}'/>");
    }
    text + "</g></svg>\n"
}

fn rectangle(colour: &'static str, [x, y, w, h]: [f64; 4]) -> Vec<Stroke> {
    let corners = [[x, y], [x + w, y], [x + w, y + h], [x, y + h], [x, y]];
    corners
        .windows(2)
        .map(|side| (colour, [side[0][0], side[0][1], side[1][0], side[1][1]]))
        .collect()
}

/// A strip of 40 x 20 mm, with these lines in it.
fn strip(inside: &[Stroke]) -> Vec<Stroke> {
    let mut strokes = rectangle(BORDER, [0.0, 0.0, 40.0, 20.0]);
    strokes.extend(inside);
    strokes
}

/// The model with a drawing beside it; `more` are keys of the model besides `pattern` and materials.
fn read(
    strokes: &[Stroke],
    more: &str,
    pattern: &str,
) -> Result<(SourceModel, Diagnostics), String> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("sheet.svg"), svg(strokes)).unwrap();
    let path = folder.path().join("model.yaml").display().to_string();
    let text = format!("{SHEET}{more}\npattern: {{ file: sheet.svg{pattern} }}\n");
    let file = SourceFile { path, text };
    parse(&file).map_err(|errors| errors.render(&file, false))
}

/// As [`read`], with a layup of card alone and nothing to report.
fn model(strokes: &[Stroke], pattern: &str) -> SourceModel {
    let (model, found) =
        read(strokes, "layup: [card]", pattern).unwrap_or_else(|it| panic!("{it}"));
    assert_eq!(found, Diagnostics::default());
    model
}

fn names(model: &SourceModel) -> (Vec<&str>, Vec<&str>) {
    let bodies = model.bodies.iter().map(|body| body.name.value.as_str()).collect();
    (bodies, model.joints.iter().map(|joint| joint.name.value.as_str()).collect())
}

fn number(law: &Expression) -> f64 {
    law.as_number().unwrap()
}

fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-9 * expected.abs(), "{found}, not {expected}");
}

fn area(ring: &[[f64; 2]]) -> f64 {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|([ax, ay], [bx, by])| (ax * by - ay * bx) / 2.0).sum()
}

/// The area of each layer of a body, m^2.
fn areas(body: &Body) -> Vec<f64> {
    let Shape::Plates(layers) = &body.shape else { panic!("no plates") };
    let plate = |plate: &crate::source::Plate| {
        let holes: f64 = plate.holes.iter().map(|hole| area(&hole.value).abs()).sum();
        area(&plate.outline.value) - holes
    };
    layers.iter().map(|plates| plates.iter().map(plate).sum()).collect()
}

/// How far to the left of the way along the axis the centroid of a body is, m.
fn left_of(joint: &Joint, body: &Body) -> f64 {
    let Shape::Plates(layers) = &body.shape else { panic!("no plates") };
    let ring = &layers[0][0].outline.value;
    let count = ring.len() as f64;
    let middle = [0, 1].map(|axis| ring.iter().map(|point| point[axis]).sum::<f64>() / count);
    let [[ax, ay], [bx, by]] = joint.axis.value;
    ((bx - ax) * (middle[1] - ay) - (by - ay) * (middle[0] - ax)) / (bx - ax).hypot(by - ay)
}

#[test]
fn facets_become_bodies_and_creases_joints() {
    let strokes = strip(&[(VALLEY, [15.0, 0.0, 15.0, 20.0])]);
    let model = model(&strokes, ", crease: { stiffness: 0.1 N/rad, damping: 1e-4 }");
    assert_eq!(names(&model), (vec!["facet_8_10", "facet_28_10"], vec!["crease_15_10"]));
    let [small, large] = model.bodies.as_slice() else { panic!() };
    assert!(large.fixed && !small.fixed);
    close(areas(small)[0], 300e-6);
    let joint = &model.joints[0];
    // The body that is nearer to the ground is the first.
    assert_eq!(joint.bodies.each_ref().map(|body| body.value.index()), [1, 0]);
    assert_eq!(joint.axis.value, [[0.015, 0.0], [0.015, 0.02]]);
    assert_eq!((joint.z.value, joint.fold.as_ref().map(|fold| fold.value)), (0.2e-3, Some(PI)));
    let Spring::Stiffness(stiffness) = &joint.spring else { panic!() };
    close(number(&stiffness.value), 0.1 * 0.02);
    close(number(&joint.damping.value), 1e-4 * 0.02);
}

#[test]
fn pieces_of_a_line_are_one_joint() {
    let cut = [
        (MOUNTAIN, [15.0, 0.0, 15.0, 4.0]),
        (CUT, [15.0, 4.0, 15.0, 15.0]),
        (MOUNTAIN, [15.0, 20.0, 15.0, 15.0]),
    ];
    let model = model(&strip(&cut), ", crease: { stiffness: 0.1 N/rad }");
    assert_eq!(names(&model).1, ["crease_15_10"]);
    assert_eq!(model.joints[0].axis.value, [[0.015, 0.0], [0.015, 0.02]]);
    let Spring::Stiffness(stiffness) = &model.joints[0].spring else { panic!() };
    close(number(&stiffness.value), 0.1 * 0.009);
}

#[test]
fn what_is_found_is_said() {
    let crease = (VALLEY, [15.0, 0.0, 15.0, 20.0]);
    let mut apart = strip(&[crease]);
    apart.extend(rectangle(BORDER, [50.0, 0.0, 10.0, 10.0]));
    let island = [vec![crease], rectangle(VALLEY, [20.0, 5.0, 10.0, 10.0])].concat();
    let mixed = [(MOUNTAIN, [15.0, 0.0, 15.0, 12.0]), (VALLEY, [15.0, 12.0, 15.0, 20.0])];
    for (strokes, code, shown) in [
        (
            apart,
            "loose-piece",
            "a facet is not connected with the ground and is left out, at (55, 5)",
        ),
        (strip(&island), "locked-facets", "at (25, 5), (20, 10), (30, 10), (25, 15)"),
        (
            strip(&mixed),
            "mixed-crease",
            "the pieces of a crease have different angles, at (15, 10)",
        ),
    ] {
        let (_, found) = read(&strokes, "layup: [card]", "").unwrap();
        let found: Vec<_> = found.0.iter().map(|it| (it.code.name, it.message.as_str())).collect();
        assert!(
            matches!(found.as_slice(), [(name, message)] if *name == code && message.ends_with(shown)),
            "{found:?}"
        );
    }
}

#[test]
fn the_ground_may_be_chosen() {
    let strokes = strip(&[(VALLEY, [15.0, 0.0, 15.0, 20.0])]);
    let fixed = |pattern: &str| {
        let model = model(&strokes, pattern);
        let fixed = model.bodies.iter().filter(|body| body.fixed);
        fixed.map(|body| body.name.value.clone()).collect::<Vec<_>>()
    };
    assert_eq!(fixed(", ground: largest"), ["facet_28_10"]);
    assert_eq!(fixed(", ground: [2, 3]"), ["facet_8_10"]);
    let more = "layup: [card]\nbodies: { base: { fixed: true } }\n\
                joints: { motor: { bodies: [base, facet_8_10], axis: [[0, 0], [0, 20]] } }";
    let (model, found) = read(&strokes, more, ", ground: none").unwrap();
    assert_eq!(found, Diagnostics::default());
    assert_eq!(names(&model).0, ["base", "facet_8_10", "facet_28_10"]);
    assert_eq!(model.joints[1].bodies.each_ref().map(|body| body.value.index()), [1, 2]);
    // Without the joint, nothing holds the sheet.
    let alone =
        read(&strokes, "layup: [card]\nbodies: { base: { fixed: true } }", ", ground: none");
    assert!(alone.unwrap_err().contains("[no-ground]"));
    assert!(
        read(&strokes, "layup: [card]", ", ground: none").unwrap_err().contains("no-fixed-body")
    );
    assert!(
        read(&strokes, "layup: [card]", ", ground: [50, 0]").unwrap_err().contains("[no-ground]")
    );
}

#[test]
fn flat_lines_are_rigid_or_bend() {
    let lines = [(VALLEY, [20.0, 0.0, 20.0, 20.0]), (FLAT, [20.0, 0.0, 40.0, 20.0])];
    assert_eq!(names(&model(&strip(&lines), "")).0, ["facet_10_10", "facet_30_10"]);
    let model = model(&strip(&lines), ", triangulate: true, crease: { damping: 1e-4 }");
    let flat = &model.joints[1];
    assert_eq!((flat.name.value.as_str(), flat.fold.is_none()), ("crease_30_10", true));
    let Spring::Stiffness(stiffness) = &flat.spring else { panic!() };
    let length = 0.02 * 2_f64.sqrt();
    let rigidity = 2e9 * 0.4e-3_f64.powi(3) / (12.0 * (1.0 - 0.09));
    // Both triangles have the height length / 2, and so has the span.
    close(number(&stiffness.value), rigidity * length / (length / 2.0));
}

#[test]
fn plates_end_before_the_crease_in_layers_that_do_not_bend() {
    let lines = [(VALLEY, [15.0, 0.0, 15.0, 20.0])];
    let pattern = ", crease: { width: 2, hinge: { model: beam, material: film } }";
    let (model, found) = read(&strip(&lines), "layup: [card, film, card]", pattern).unwrap();
    assert_eq!(found, Diagnostics::default());
    for (body, [rigid, film]) in model.bodies.iter().zip([[280e-6, 300e-6], [480e-6, 500e-6]]) {
        for (found, expected) in areas(body).into_iter().zip([rigid, film, rigid]) {
            close(found, expected);
        }
    }
    let joint = &model.joints[0];
    close(joint.z.value, 0.45e-3);
    let Spring::Beam { material, length, width, gaps: None } = &joint.spring else { panic!() };
    assert_eq!(material.value, 1);
    close(length.value, 2e-3);
    close(width.value, 20e-3);
}

#[test]
fn gaps_of_facets_with_holes_and_reflex_corners() {
    // An L with a crease along its inner corner, and a frame around an island that folds up.
    let corner: Vec<Stroke> = vec![
        (BORDER, [0.0, 0.0, 20.0, 0.0]),
        (BORDER, [20.0, 0.0, 20.0, 20.0]),
        (BORDER, [20.0, 20.0, 0.0, 20.0]),
        (BORDER, [0.0, 20.0, 0.0, 0.0]),
        (VALLEY, [10.0, 20.0, 10.0, 10.0]),
        (CUT, [10.0, 10.0, 20.0, 10.0]),
    ];
    let island: Vec<Stroke> = [
        rectangle(BORDER, [0.0, 0.0, 20.0, 20.0]),
        rectangle(CUT, [5.0, 5.0, 10.0, 10.0])[..3].to_vec(),
        vec![(VALLEY, [5.0, 5.0, 5.0, 15.0])],
    ]
    .concat();
    let pattern = ", crease: { width: 2, hinge: { model: beam, material: film } }";
    for (strokes, whole, gaps) in [
        // The gap passes the end of the crease by half its width.
        (corner, [100e-6, 300e-6], [10e-6, 12e-6]),
        (island, [100e-6, 300e-6], [10e-6, 14e-6]),
    ] {
        let (model, _) = read(&strokes, "layup: [card, film]", pattern).unwrap();
        let mut found: Vec<Vec<f64>> = model.bodies.iter().map(areas).collect();
        found.sort_by(|a, b| a[1].total_cmp(&b[1]));
        for ((areas, whole), gap) in found.iter().zip(whole).zip(gaps) {
            close(areas[1], whole);
            assert!((areas[0] - (whole - gap)).abs() < 1e-3 * gap, "{areas:?}: {whole} - {gap}");
        }
    }
}

/// A crease that another one meets is one line of the facet on its other side.
#[test]
fn gaps_along_creases_that_others_meet() {
    for turn in 0..90 {
        let angle = f64::from(turn).to_radians();
        let lines = [
            (VALLEY, [15.0, 0.0, 15.0, 20.0]),
            (MOUNTAIN, [15.0, 7.0, 40.0, 7.0]),
            (MOUNTAIN, [15.0, 13.0, 40.0, 13.0]),
        ];
        let turned = |(colour, [x1, y1, x2, y2]): Stroke| -> Stroke {
            let at = |x: f64, y: f64| {
                [x * angle.cos() - y * angle.sin(), x * angle.sin() + y * angle.cos()]
            };
            let ([ax, ay], [bx, by]) = (at(x1, y1), at(x2, y2));
            (colour, [ax, ay, bx, by])
        };
        let strokes: Vec<Stroke> = strip(&lines).into_iter().map(turned).collect();
        let pattern = ", crease: { width: 2, hinge: { model: beam, material: film } }";
        let (model, _) = read(&strokes, "layup: [card, film]", pattern).unwrap();
        let largest = model.bodies.iter().map(areas).max_by(|a, b| a[1].total_cmp(&b[1])).unwrap();
        close(largest[0], 280e-6);
        let text = to_yaml(&model);
        parse(&SourceFile { path: "m.yaml".into(), text })
            .unwrap_or_else(|it| panic!("{turn}: {it}"));
    }
}

#[test]
fn a_gap_wider_than_a_facet_leaves_its_film() {
    let lines = [(VALLEY, [15.0, 0.0, 15.0, 20.0]), (VALLEY, [16.0, 0.0, 16.0, 20.0])];
    let pattern = ", crease: { width: 2, hinge: { model: beam, material: film } }";
    let (model, found) = read(&strip(&lines), "layup: [card, film]", pattern).unwrap();
    assert_eq!(found.0.iter().map(|it| it.code.name).collect::<Vec<_>>(), ["wide-crease"]);
    let narrow = model.bodies.iter().find(|body| body.name.value == "facet_16_10").unwrap();
    assert_eq!(areas(narrow)[0], 0.0);
    close(areas(narrow)[1], 20e-6);
}

#[test]
fn a_pattern_is_written_as_it_was_read() {
    let strokes = strip(&[(VALLEY, [15.0, 0.0, 15.0, 20.0]), (MOUNTAIN, [25.0, 0.0, 25.0, 20.0])]);
    let more = "layup: [card, film]\nparameters: { k: 0.1 N/rad }\ninitial: { q: { crease_15_10: 30 } }\n\
                points: { tip: { body: facet_33_10, at: [40, 10, 0] } }\ntunable: [damping]";
    let pattern = ", crease: { stiffness: \"2*k\", damping: 1e-4 }";
    let (model, _) = read(&strokes, more, pattern).unwrap();
    let yaml = to_yaml(&model);
    assert!(yaml.contains("stiffness: \"2*k*0.02\""), "{yaml}");
    let (again, _) = parse(&SourceFile { path: "again.yaml".into(), text: yaml.clone() }).unwrap();
    assert_eq!(to_yaml(&again).replace("name: again", "name: model"), yaml);
}

/// A sheet of squares with sides of 10 mm whose inner corners are moved by these lengths, and the kinds of its
/// inner sides.
fn squares(columns: usize, moves: &[[f64; 2]], kinds: &[usize]) -> Vec<Stroke> {
    let rows = moves.len() / (columns + 1) - 1;
    let corner = |i: usize, j: usize| {
        let is_inner = i > 0 && i < columns && j > 0 && j < rows;
        let [dx, dy] = if is_inner { moves[j * (columns + 1) + i] } else { [0.0; 2] };
        [10.0 * i as f64 + dx, 10.0 * j as f64 + dy]
    };
    let mut kinds = kinds.iter().map(|kind| [MOUNTAIN, VALLEY, UNDRIVEN, CUT, FLAT][*kind]).cycle();
    let mut strokes = Vec::new();
    let mut side = |is_border: bool, [ax, ay]: [f64; 2], [bx, by]: [f64; 2]| {
        let colour = if is_border { BORDER } else { kinds.next().unwrap_or(VALLEY) };
        strokes.push((colour, [ax, ay, bx, by]));
    };
    for j in 0..=rows {
        for i in 0..=columns {
            if i < columns {
                side(j == 0 || j == rows, corner(i, j), corner(i + 1, j));
            }
            if j < rows {
                side(i == 0 || i == columns, corner(i, j), corner(i, j + 1));
            }
        }
    }
    strokes
}

/// A model without what depends on where outlines begin.
fn skeleton(yaml: &str) -> String {
    let (model, _) = parse(&SourceFile { path: "m.yaml".into(), text: yaml.into() })
        .unwrap_or_else(|it| panic!("{it}"));
    let mut text = String::new();
    for body in &model.bodies {
        let _ = writeln!(text, "{} {} {:.9?}", body.name.value, body.fixed, areas(body));
    }
    for joint in &model.joints {
        let bodies = joint.bodies.each_ref().map(|body| body.value.index());
        let fold = joint.fold.as_ref().map(|fold| fold.value);
        let axis = joint.axis.value.map(|point| point.map(|x| (x * 1e9).round()));
        let _ = writeln!(text, "{} {bodies:?} {axis:?} {fold:?}", joint.name.value);
    }
    text
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The area of all bodies is that of the sheet but for what was left out, each joint has its second body to
    /// the left, and nothing depends on the order of the lines or on their directions.
    #[test]
    fn any_sheet_of_squares(
        moves in prop::collection::vec(prop::array::uniform2(-3.0..3.0_f64), 30),
        kinds in prop::collection::vec(0..5_usize, 37),
        order in any::<u64>(),
        triangulate in any::<bool>(),
    ) {
        let strokes = squares(5, &moves, &kinds);
        let options = Options { triangulate, ground: Ground::Largest, ..Options::default() };
        let imported = |strokes: &[Stroke]| import("m.svg", svg(strokes).into_bytes(), "m", &options);
        let first = imported(&strokes);
        let Some(yaml) = first.yaml else {
            // All sides may be cuts.
            prop_assert!(first.found.has_errors());
            return Ok(());
        };
        let mut others = strokes.clone();
        let mut state = order;
        for index in (1..others.len()).rev() {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            others.swap(index, (state >> 33) as usize % (index + 1));
            if state & (1 << 40) != 0 {
                let [x1, y1, x2, y2] = others[index].1;
                others[index].1 = [x2, y2, x1, y1];
            }
        }
        let other = imported(&others);
        prop_assert_eq!(skeleton(&yaml), skeleton(&other.yaml.unwrap()));
        let file = SourceFile { path: "m.yaml".into(), text: yaml };
        let (model, _) = parse(&file).unwrap();
        let total: f64 = model.bodies.iter().map(|body| areas(body)[0]).sum();
        let left_out = first.found.0.iter().any(|it| it.code.name == "loose-piece");
        prop_assert!(total <= 2000e-6 * (1.0 + 1e-9));
        prop_assert!(left_out || (total / 2000e-6 - 1.0).abs() < 1e-9, "{total}");
        for joint in &model.joints {
            let [first, second] =
                joint.bodies.each_ref().map(|body| left_of(joint, &model.bodies[body.value.index()]));
            // Facets that are joined along flat lines may reach around a crease.
            if triangulate {
                prop_assert!(first < 0.0 && second > 0.0, "{}: {first} {second}", joint.name.value);
            }
        }
    }
}
