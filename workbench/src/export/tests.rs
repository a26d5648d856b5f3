//! A book of two pages, whose folded states are known; and what readers find again.

use std::collections::BTreeMap;

use lamc::laminate::Mechanism;
use lamc::pipeline::analyse;
use lamc::source::SourceFile;
use lamc_drawings::{Pattern, Role, fold as drawn};
use lamc_runtime::Energy;
use serde_json::Value;

use super::*;
use crate::motion::{Course, Motion, Pose, Sample};
use crate::scene::Scene;

/// Two squares of 20 mm of film, 0.1 mm thick, hinged along their common edge at half the thickness.
const BOOK: &str = "name: book
units: { length: mm }
materials: { film: { density: 1400, thickness: 0.1 } }
layup: [film]
bodies:
  left: { fixed: true, outline: [[0, 0], [20, 0], [20, 20], [0, 20]] }
  right: { outline: [[20, 0], [40, 0], [40, 20], [20, 20]] }
joints: { crease: { bodies: [left, right], z: 0.05, axis: [[20, 0], [20, 20]] } }
";

fn mechanism(text: &str) -> Mechanism {
    let file = SourceFile { path: "book.yaml".into(), text: text.into() };
    analyse(&file).unwrap_or_else(|errors| panic!("{}", errors.render(&file, false))).0.mechanism
}

/// The pose of the right page that is turned by `q` about the crease, which points along y.
fn turned(q: f64) -> Pose {
    let (s, c) = q.sin_cos();
    let [x, z] = [0.02, 0.05e-3];
    Pose {
        rotation: [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]],
        translation: [x - c * x - s * z, 0.0, z + s * x - c * z],
    }
}

fn motion(angles: &[f64]) -> Motion {
    let sample = |(number, q): (usize, &f64)| Sample {
        t: number as f64,
        q: vec![*q],
        u: vec![0.0],
        acceleration: vec![0.0],
        energy: Energy { kinetic: 0.0, potential: 0.0 },
        closure: 0.0,
        points: Vec::new(),
        contacts: Vec::new(),
        tensions: Vec::new(),
        inputs: Vec::new(),
        poses: vec![turned(0.0), turned(*q)],
    };
    Motion {
        course: Course::Time,
        name: "book".into(),
        free: Vec::new(),
        joints: vec!["crease".into()],
        bodies: vec!["left".into(), "right".into()],
        points: Vec::new(),
        contacts: Vec::new(),
        tensions: Vec::new(),
        inputs: Vec::new(),
        size: 0.05,
        samples: angles.iter().enumerate().map(sample).collect(),
        complete: true,
    }
}

fn json(text: &str, angles: &[f64]) -> Value {
    let folded = fold(&mechanism(text), &motion(angles)).unwrap();
    assert_eq!(folded.missing, Vec::<String>::new());
    serde_json::from_str(&folded.text).unwrap()
}

fn list(value: &Value) -> &Vec<Value> {
    value.as_array().unwrap()
}

#[track_caller]
fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} is not {expected}");
}

#[test]
fn a_folded_page_is_where_it_must_be() {
    let q = 0.7;
    let file = json(BOOK, &[0.0, q]);
    assert_eq!(
        [&file["vertices_coords"], &file["edges_vertices"], &file["faces_vertices"]]
            .map(|l| list(l).len()),
        [6, 7, 2]
    );
    assert_eq!(file["frame_unit"], "m");
    let joints = list(&file["lamc:edges_joint"]);
    let crease = joints.iter().position(|joint| joint == "crease").unwrap();
    // The second body is to the right of the hinge line: a positive angle is a mountain.
    assert_eq!(file["edges_assignment"][crease], "M");
    let frame = &file["file_frames"][1];
    near(frame["edges_foldAngle"][crease].as_f64().unwrap(), -q.to_degrees(), 1e-12);
    let (s, c) = q.sin_cos();
    for (flat, folded) in list(&file["vertices_coords"]).iter().zip(list(&frame["vertices_coords"]))
    {
        let [x, y] = [0, 1].map(|axis| flat[axis].as_f64().unwrap());
        let beyond = (x - 0.02).max(0.0);
        let expected = [x.min(0.02) + beyond * c, y, 0.05e-3 - beyond * s];
        for (axis, expected) in expected.into_iter().enumerate() {
            near(folded[axis].as_f64().unwrap(), expected, 1e-15);
        }
    }
}

#[test]
fn assignments_follow_the_hinge_line() {
    let reversed = BOOK.replace("[[20, 0], [20, 20]] }", "[[20, 20], [20, 0]] }");
    let swapped = BOOK.replace("bodies: [left, right]", "bodies: [right, left]");
    for (text, q, expected) in [
        (BOOK, 0.5, "M"),
        (BOOK, -0.5, "V"),
        (BOOK, 0.0, "U"),
        (&reversed, 0.5, "V"),
        (&swapped, 0.5, "V"),
    ] {
        let file = json(text, &[q]);
        let creases = list(&file["edges_assignment"]).iter().filter(|it| *it != "B");
        assert_eq!(creases.collect::<Vec<_>>(), [expected], "{text}");
    }
}

/// On a slit the vertices are doubled; a hinge may end within an edge, and plates may be of different
/// widths.
#[test]
fn slits_and_shorter_hinges() {
    let half = BOOK.replace("[[20, 0], [20, 20]] }", "[[20, 0], [20, 12]] }");
    let file = json(&half, &[0.0]);
    let count =
        |kind: &str| list(&file["edges_assignment"]).iter().filter(|it| *it == kind).count();
    assert_eq!([count("U"), count("C"), count("B")], [1, 2, 6]);
    // Six corners and the end of the hinge, and the upper corner of the crease twice.
    assert_eq!(list(&file["vertices_coords"]).len(), 8);
    let wider = BOOK.replace("[40, 0], [40, 20], [20, 20]", "[40, 0], [40, 30], [20, 30]");
    let file = json(&wider, &[0.0]);
    assert_eq!(list(&file["vertices_coords"]).len(), 7);
    assert_eq!(list(&file["faces_vertices"]).iter().map(|face| list(face).len()).sum::<usize>(), 9);
}

#[test]
fn what_is_no_sheet_is_refused() {
    let over = BOOK.replace(
        "[[20, 0], [40, 0], [40, 20], [20, 20]]",
        "[[15, 0], [40, 0], [40, 20], [15, 20]]",
    );
    let error = fold(&mechanism(&over), &motion(&[0.0])).err().unwrap();
    assert_eq!(error, FoldError::Overlap("left".into(), "right".into()));
    let apart = BOOK.replace(
        "[[20, 0], [40, 0], [40, 20], [20, 20]]",
        "[[21, 0], [40, 0], [40, 20], [21, 20]]",
    );
    assert_eq!(fold(&mechanism(&apart), &motion(&[0.0])).unwrap().missing, ["crease"]);
}

fn example(name: &str) -> Mechanism {
    let path = format!("{}/../examples/{name}.yaml", env!("CARGO_MANIFEST_DIR"));
    let file = SourceFile::read(&path).unwrap();
    analyse(&file).unwrap_or_else(|errors| panic!("{}", errors.render(&file, false))).0.mechanism
}

/// A reader finds the facets and creases of a sheet again, at exactly the same places.
#[test]
fn readers_find_the_same_sheet() {
    let miura = example("miura");
    let mut flat = motion(&[0.0]);
    // A state with alternating signs; the poses do not matter here.
    flat.samples[0].q =
        (0..miura.joints.len()).map(|joint| if joint % 3 == 0 { 0.2 } else { -0.1 }).collect();
    let folded = fold(&miura, &flat).unwrap();
    assert_eq!(folded.missing, Vec::<String>::new());
    let drawing = drawn::read(&folded.text, None).unwrap();
    assert_eq!(drawing.unit, Some(1.0));
    let pattern = Pattern::of(&drawing, None).unwrap();
    assert_eq!((pattern.facets.len(), pattern.vertices.len(), pattern.edges.len()), (16, 25, 40));
    // The second body is to the left of the hinge line where its centre of mass is.
    let mut roles = BTreeMap::from([(Role::Border, 16)]);
    for (joint, q) in miura.joints.iter().zip(&flat.samples[0].q) {
        let way = miura.bodies[joint.bodies[1].index()].mass_properties.com - joint.point;
        let is_valley = (joint.direction.cross(&way).z > 0.0) == (*q > 0.0);
        *roles.entry(if is_valley { Role::Valley } else { Role::Mountain }).or_default() += 1;
    }
    assert_eq!(roles.len(), 3);
    let mut found: BTreeMap<Role, usize> = BTreeMap::new();
    for edge in &pattern.edges {
        *found.entry(edge.role).or_default() += 1;
    }
    assert_eq!(found, roles);
    // Every hinge line is a crease, to the last bit of its ends.
    let of_model = |at: [f64; 2]| pattern.vertices.contains(&at);
    let file: Value = serde_json::from_str(&folded.text).unwrap();
    for vertex in list(&file["vertices_coords"]) {
        assert!(of_model([0, 1].map(|axis| vertex[axis].as_f64().unwrap())));
    }
    for edge in pattern.edges.iter().filter(|edge| edge.role != Role::Border) {
        let angle = edge.angle.unwrap();
        near(angle.abs(), if (angle.abs() - 0.2).abs() < 0.01 { 0.2 } else { 0.1 }, 1e-9);
        assert_eq!(edge.role == Role::Valley, angle > 0.0);
    }
}

/// A closed surface has the volume of its bodies, by the divergence theorem: 1/6 sum a . (b x c).
#[test]
fn solids_have_their_volume() {
    let book = mechanism(BOOK);
    let scene = Scene::new(&book);
    let expected = 2.0 * 20.0 * 20.0 * 0.1;
    for q in [0.0, 1.2] {
        let motion = motion(&[q]);
        let poses = &motion.samples[0].poses;
        let bytes = stl(&scene, poses);
        let count = u32::from_le_bytes(bytes[80..84].try_into().unwrap()) as usize;
        assert_eq!(bytes.len(), 84 + 50 * count);
        assert!(!bytes.starts_with(b"solid"));
        let number =
            |at: usize| f64::from(f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
        let vector = |at: usize| nalgebra::Vector3::from_fn(|axis, _| number(at + 4 * axis));
        let mut volume = 0.0;
        for triangle in 0..count {
            let [normal, a, b, c] = [0, 1, 2, 3].map(|k| vector(84 + 50 * triangle + 12 * k));
            volume += a.dot(&b.cross(&c)) / 6.0;
            near((b - a).cross(&(c - a)).normalize().dot(&normal), 1.0, 1e-5);
        }
        near(volume, expected, 1e-3);

        let text = obj(&scene, poses);
        let numbers = |line: &str| {
            line[2..].split(' ').map(|word| word.parse::<f64>().unwrap()).collect::<Vec<_>>()
        };
        let vertices: Vec<_> =
            text.lines().filter(|line| line.starts_with("v ")).map(numbers).collect();
        let faces: Vec<_> =
            text.lines().filter(|line| line.starts_with("f ")).map(numbers).collect();
        assert_eq!(faces.len(), count);
        let corner =
            |index: f64| nalgebra::Vector3::from_column_slice(&vertices[index as usize - 1]);
        let part =
            |face: &Vec<f64>| corner(face[0]).dot(&corner(face[1]).cross(&corner(face[2]))) / 6.0;
        near(faces.iter().map(part).sum(), expected, 1e-9);
    }
}
