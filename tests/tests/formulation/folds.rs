//! The examples that are drawings fold as `docs/FOLDING.md` says. The drawings are read here a second time, by a few
//! lines that know only how these files are written, and folded states are measured from the poses of the facets.

use std::f64::consts::{PI, TAU};
use std::fs;

use lamc::laminate::Joint;
use lamc::pipeline;
use lamc::source::SourceFile;
use lamc::source::pattern::{Options, import};
use lamc_tests::{largest, largest_difference, workspace};
use lamc_workbench::folding::{End, Facets, Fold, Path};
use lamc_workbench::motion::Pose;
use nalgebra::{Matrix3, Vector2, Vector3};

/// The drawings in `examples/fold`.
const SHEETS: [&str; 4] = ["bird_base", "waterbomb_sheet", "honeycomb", "pop_up"];
/// Points of a drawing are the same up to this, m.
const SAME: f64 = 1e-9;

/// A piece of a line: its class, and its ends in m, with y upwards.
struct Stroke {
    class: String,
    ends: [Vector2<f64>; 2],
}

impl Stroke {
    fn sign(&self) -> Option<f64> {
        match self.class.split(' ').next() {
            Some("mountain") => Some(-1.0),
            Some("valley") => Some(1.0),
            _ => None,
        }
    }

    /// Where a point is along the stroke, from 0 to 1, if it is on it.
    fn along(&self, at: &Vector2<f64>) -> Option<f64> {
        let [from, to] = self.ends;
        let share = (at - from).dot(&(to - from)) / (to - from).norm_squared();
        let is_on = (from + (to - from) * share - at).norm() < SAME;
        (is_on && (-1e-6..=1.0 + 1e-6).contains(&share)).then_some(share)
    }
}

/// Reads the lines of a drawing. Its unit is 1 mm.
fn strokes(name: &str) -> Vec<Stroke> {
    let text = fs::read_to_string(workspace().join(format!("examples/fold/{name}.svg"))).unwrap();
    let mut strokes = Vec::new();
    for line in text.lines().filter(|line| line.contains("class=")) {
        let value = |key: &str| Some(line.split_once(&format!(" {key}=\""))?.1.split_once('"')?.0);
        let points = value("points").map_or_else(
            || ["x1", "y1", "x2", "y2"].map(|key| value(key).unwrap()).join(" "),
            str::to_owned,
        );
        let numbers: Vec<f64> =
            points.split([' ', ',']).map(|number| number.parse().unwrap()).collect();
        let mut points: Vec<_> =
            numbers.chunks(2).map(|at| Vector2::new(1e-3 * at[0], -1e-3 * at[1])).collect();
        if line.contains("<polygon") {
            points.push(points[0]);
        }
        let class = value("class").unwrap();
        strokes.extend(
            points
                .windows(2)
                .map(|ends| Stroke { class: class.to_owned(), ends: [ends[0], ends[1]] }),
        );
    }
    strokes
}

/// The inner vertices, with the directions, rad, and signs of their creases in order.
fn vertices(strokes: &[Stroke]) -> Vec<Vec<(f64, f64)>> {
    let mut places: Vec<Vector2<f64>> = Vec::new();
    for end in strokes.iter().flat_map(|stroke| stroke.ends) {
        if places.iter().all(|known| (known - end).norm() > SAME) {
            places.push(end);
        }
    }
    let mut vertices = Vec::new();
    for at in places {
        let meeting: Vec<_> =
            strokes.iter().filter_map(|stroke| Some((stroke, stroke.along(&at)?))).collect();
        if meeting.iter().any(|(stroke, _)| stroke.sign().is_none()) {
            continue;
        }
        let mut creases = Vec::new();
        for (stroke, along) in meeting {
            let way = stroke.ends[1] - stroke.ends[0];
            for (is_there, way) in [(along < 1.0 - 1e-6, way), (along > 1e-6, -way)] {
                if is_there {
                    creases.push((way.y.atan2(way.x), stroke.sign().unwrap()));
                }
            }
        }
        creases.sort_by(|a, b| a.0.total_cmp(&b.0));
        vertices.push(creases);
    }
    vertices
}

fn fold(name: &str) -> Fold {
    let path = workspace().join(format!("examples/fold/{name}.yaml")).display().to_string();
    let file = SourceFile::read(&path).unwrap();
    let (model, topology, found) = pipeline::analyse_edited(&file, |_| ())
        .unwrap_or_else(|errors| panic!("{}", errors.render(&file, false)));
    assert!(found.0.is_empty(), "{}", found.render(&file, false));
    Fold::new(&model, topology).unwrap()
}

fn followed(name: &str, to: f64) -> (Fold, Path) {
    let mut fold = fold(name);
    let path = fold.follow(to, 20, |_| true);
    assert_eq!(path.end, End::Reached, "{name}");
    (fold, path)
}

/// The joint whose name begins like this, at a sample.
fn angle(fold: &Fold, q: &[f64], name: &str) -> f64 {
    let joints = &fold.topology().mechanism.joints;
    let index = joints.iter().position(|joint| joint.name == name);
    q[index.unwrap_or_else(|| panic!("there is no `{name}`"))]
}

/// Facets are counted by hand; creases are pieces between vertices.
#[test]
fn drawings_have_the_facets_and_creases_that_were_drawn() {
    let expected = [
        // Four triangles at the sides; around the centre, two in each quarter. A diagonal and a line across each wing
        // are mountains, and two lines at each corner and four at the centre are valleys.
        ("bird_base", [4 + 2 * 4, 2 + 2, 2 * 4 + 4]),
        // Bases of six facets and four valleys. Fourteen of them are whole, with two mountains each; there are 4 + 5 + 4
        // mountains between them, and ten pieces of each line between the rows.
        ("waterbomb_sheet", [6 * 15, 2 * 14 + (4 + 5 + 4) + 2 * 10, 4 * 15]),
        // Four rows of nine walls, between four mountains and four valleys; two lines with three valleys, one with two
        // mountains.
        ("honeycomb", [4 * 9, 4 * 4 + 2, 4 * 4 + 2 * 3]),
        // Two pages, two faces of each step, four of the beak. The fold of the card has three pieces, and the front of the
        // first step has two.
        ("pop_up", [2 + 2 * 2 + 4, 2 + 2, 3 + (1 + 2) + 2 + 4]),
    ];
    for (name, [facets, mountains, valleys]) in expected {
        let svg = fs::read(workspace().join(format!("examples/fold/{name}.svg"))).unwrap();
        let imported = import(&format!("{name}.svg"), svg, name, &Options::default());
        assert!(imported.found.0.is_empty(), "{name}: {}", imported.found);
        let counted = format!(
            "{facets} facets, {} creases: {mountains} mountain, {valleys} valley, 0 flat;",
            mountains + valleys
        );
        let summary = imported.summary.unwrap();
        assert!(summary.starts_with(&counted), "{name}: {summary}, not {counted}");
    }
}

/// Maekawa's and Kawasaki's conditions hold at all inner vertices.
#[test]
fn drawings_are_flat_foldable() {
    for (name, count) in SHEETS.into_iter().zip([5, 32, 0, 2]) {
        let vertices = vertices(&strokes(name));
        assert_eq!(vertices.len(), count, "{name}");
        for creases in vertices {
            let signs: f64 = creases.iter().map(|crease| crease.1).sum();
            assert_eq!(signs.abs(), 2.0, "{name}: {creases:?}");
            let next = creases.iter().skip(1).chain(&creases[..1]);
            let sectors: Vec<f64> =
                creases.iter().zip(next).map(|(a, b)| (b.0 - a.0).rem_euclid(TAU)).collect();
            assert!((sectors.iter().sum::<f64>() - TAU).abs() < 1e-12, "{name}: {sectors:?}");
            let every_other: f64 = sectors.iter().step_by(2).sum();
            assert!((every_other - PI).abs() < 1e-8, "{name}: {sectors:?}");
        }
        assert_eq!(fold(name).not_flat_foldable(), [], "{name}");
    }
}

/// A pose as matrix and shift.
fn placed(pose: &Pose) -> (Matrix3<f64>, Vector3<f64>) {
    (Matrix3::from(pose.rotation).transpose(), Vector3::from(pose.translation))
}

/// The ends of a hinge line as a body carries them, and the body's normal.
fn carried(joint: &Joint, pose: &Pose) -> ([Vector3<f64>; 2], Vector3<f64>) {
    let (turn, shift) = placed(pose);
    let ends = [joint.point, joint.point + joint.direction * joint.length];
    (ends.map(|end| turn * end + shift), turn * Vector3::z())
}

/// The facets on both sides of each crease keep it, and bend to the side that is drawn.
#[test]
fn folded_states_are_those_of_the_drawn_sheet() {
    for (name, mobility) in SHEETS.into_iter().zip([Some(1), None, None, Some(1)]) {
        let strokes = strokes(name);
        let (fold, path) = followed(name, 1.0);
        let mechanism = &fold.topology().mechanism;
        let facets = Facets::new(mechanism);
        for sample in &path.samples[1..] {
            let poses = fold.poses(&sample.q);
            assert_eq!(facets.crossing(&poses), [[0; 2]; 0], "{name} at {}", sample.progress);
            for (joint, q) in mechanism.joints.iter().zip(&sample.q) {
                let [(ends, normal), (others, next)] =
                    joint.bodies.map(|body| carried(joint, &poses[body.index()]));
                let apart = largest(ends.iter().zip(&others).map(|(a, b)| (a - b).norm()));
                assert!(apart < 1e-9 * mechanism.size, "{name} {}: {apart:e} m", joint.name);
                let axis = ends[1] - ends[0];
                assert!((axis.norm() - joint.length).abs() < 1e-12, "{name} {}", joint.name);
                let bent = normal.cross(&next).dot(&axis.normalize()).atan2(normal.dot(&next));
                // Half a turn to either side is the same.
                let off = (bent - q).rem_euclid(TAU);
                assert!(off.min(TAU - off) < 1e-7, "{name} {}: {bent}, not {q}", joint.name);
                let middle = (joint.point + joint.direction * (joint.length / 2.0)).xy();
                let drawn = strokes.iter().filter(|stroke| stroke.along(&middle).is_some());
                let signs: Vec<f64> = drawn.filter_map(Stroke::sign).collect();
                let right = signs.iter().all(|sign| sign * q > 0.0);
                assert!(right, "{name} {}: {q} at {}", joint.name, sample.progress);
            }
        }
        let middle = &path.samples[10].q;
        let found = fold.mobility_of_all(middle);
        assert!(mobility.is_none_or(|mobility| mobility == found), "{name}: mobility {found}");
        let off = largest_difference(&path.samples.last().unwrap().q, fold.targets());
        assert!(off < 1e-9, "{name}: ends {off:e} rad from the finished fold");
    }
}

/// The wall angles and the angles between the rows do not depend on each other, so all follow their folds
/// exactly; in the end, cells are regular hexagons with sides of 12 mm.
#[test]
fn the_honeycomb_opens_to_hexagons() {
    let (fold, path) = followed("honeycomb", 1.0);
    for sample in &path.samples {
        let off = sample.q.iter().zip(fold.targets()).map(|(q, fold)| q - sample.progress * fold);
        assert!(largest(off) < 1e-9, "at {}", sample.progress);
    }
    let poses = fold.poses(&path.samples.last().unwrap().q);
    let bodies = &fold.topology().mechanism.bodies;
    let centre = |at: [f64; 2]| {
        let near =
            |body: usize| (1e3 * bodies[body].mass_properties.com.xy() - Vector2::from(at)).norm();
        let body = (0..bodies.len()).min_by(|a, b| near(*a).total_cmp(&near(*b))).unwrap();
        assert!(near(body) < 1e-6);
        let (turn, shift) = placed(&poses[body]);
        let com = bodies[body].mass_properties.com;
        // At the height of the hinges.
        turn * Vector3::new(com.x, com.y, fold.topology().mechanism.joints[0].point.z) + shift
    };
    let apart = |a: [f64; 2], b: [f64; 2]| 1e3 * (centre(a) - centre(b)).norm();
    for (x, lower) in [(29.0, -61.0), (77.0, -61.0), (53.0, -45.0), (29.0, -29.0)] {
        let wide = apart([x, lower], [x, lower + 16.0]);
        assert!((wide - 12.0 * 3_f64.sqrt()).abs() < 1e-6, "{wide} mm at {x}");
    }
    let joined = apart([53.0, -61.0], [53.0, -45.0]);
    assert!(joined < 1e-6, "{joined} mm");
}

/// A step is a parallelogram, so its four angles are equal. At the ends of the beak, lines at an angle of c to the
/// fold of the card meet it: two of the sides of a spherical triangle are c, so
/// tan(line / 2) = tan(fold / 2) / cos c (Napier's rules for its half).
#[test]
fn the_card_moves_by_its_closed_form() {
    let (fold, path) = followed("pop_up", 0.95);
    let cos = 24.0 / 24_f64.hypot(20.0);
    for sample in &path.samples[1..] {
        let angle = |name: &str| angle(&fold, &sample.q, name);
        let card = angle("crease_85_m65");
        for valley in ["crease_55_m29", "crease_55_m89", "crease_55_m75", "crease_55_m101"] {
            assert!((angle(valley) - card).abs() < 1e-9, "{valley}");
        }
        for mountain in ["crease_55_m53", "crease_55_m87", "crease_113_m65", "crease_137_m65"] {
            assert!((angle(mountain) + card).abs() < 1e-9, "{mountain}");
        }
        let expected = 2.0 * ((card / 2.0).tan() / cos).atan();
        for line in ["crease_113_m75", "crease_113_m55", "crease_137_m75", "crease_137_m55"] {
            assert!((angle(line) - expected).abs() < 1e-9, "{line}: not {expected}");
        }
    }
}

/// A vertex with sectors of 90, 45, 45, 90, 45 and 45 deg that folds symmetrically: the plane of symmetry through
/// the mountains and the circle of a sector of 90 deg meet 45 deg from the valley between them, so
/// tan(mountain / 2) = cos 45 deg tan(valley / 2) (Napier's rules).
fn mountain(valley: f64) -> f64 {
    -2.0 * ((valley / 2.0).tan() * 0.5_f64.sqrt()).atan()
}

#[test]
fn a_waterbomb_base_folds_by_its_closed_form() {
    let (fold, path) = followed("waterbomb", 0.95);
    for sample in &path.samples[1..] {
        let valley = angle(&fold, &sample.q, "c4_0");
        for name in ["c4_1", "c4_2", "c4_3"] {
            assert!((angle(&fold, &sample.q, name) - valley).abs() < 1e-8, "{name}");
        }
        for name in ["c4_5", "c4_6"] {
            let found = angle(&fold, &sample.q, name);
            assert!((found - mountain(valley)).abs() < 1e-8, "{found}, not {}", mountain(valley));
        }
    }
}

/// The vertices besides the centre have four creases with sectors of 45, 67.5, 135 and 112.5 deg, whose opposite
/// creases bend equally, and the ratio of the tangents of half the angles is cos((a + b) / 2) / cos((a - b) / 2) with
/// the sectors a and b beside the mountain (T. Evans, R. Lang, S. Magleby, L. Howell, "Rigidly foldable origami
/// gadgets and tessellations", 2015).
#[test]
fn the_bird_base_folds_by_its_closed_form() {
    let (fold, path) = followed("bird_base", 0.9);
    let [a, b] = [45_f64, 67.5].map(f64::to_radians);
    let ratio = ((a + b) / 2.0).cos() / ((a - b) / 2.0).cos();
    for sample in &path.samples[1..] {
        let angle = |name: &str| angle(&fold, &sample.q, name);
        let valley = angle("crease_55_m70");
        let lesser = 2.0 * (ratio * (valley / 2.0).tan()).atan();
        let expected = [
            ("crease_30_m95", valley),
            ("crease_70_m55", valley),
            ("crease_80_m95", lesser),
            ("crease_40_m70", -lesser),
            ("crease_70_m40", -lesser),
            ("crease_80_m80", mountain(valley)),
        ];
        for (name, expected) in expected {
            let found = angle(name);
            // The drawing has eight decimals.
            assert!((found - expected).abs() < 1e-6, "{name}: {found}, not {expected}");
        }
    }
}
