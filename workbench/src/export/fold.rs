//! FOLD 1.2 (github.com/edemaine/fold): the flat crease pattern as key frame, and a frame for each
//! sample of a motion.
//!
//! Coordinates are in metres, as in the model, so that the key frame has their exact digits. Angles are
//! in degrees: a valley is positive, a mountain negative. The keys that begin with `lamc:` hold the names
//! of bodies and joints; other programs skip them.

use serde::Serialize;

use super::FoldError;
use super::facets::facets;
use super::graph::{Graph, Kind, graph};
use crate::motion::{Motion, Sample};
use crate::scene::Placement;
use lamc::laminate::Mechanism;

/// Most coordinates of all frames: a file of some 400 MB.
const MOST_NUMBERS: usize = 20_000_000;
/// Rounded coordinates move each of two corners by at most sqrt(2) tolerances.
const ROUNDED: f64 = 3.0;
/// The least distance between two vertices, as a share of the size: rounding errors of doubles.
const LEAST: f64 = 1e-10;
/// The least angle of a mountain or a valley, rad: others are not assigned.
const FOLDED: f64 = 1e-6;

/// A motion as FOLD.
pub struct Folded {
    /// The file.
    pub text: String,
    /// The joints that the file does not have, because their bodies have no common edge.
    pub missing: Vec<String>,
}

#[derive(Serialize)]
struct File {
    file_spec: f64,
    file_creator: &'static str,
    file_title: String,
    file_classes: [&'static str; 1],
    frame_classes: [&'static str; 1],
    frame_attributes: [&'static str; 1],
    frame_unit: &'static str,
    vertices_coords: Vec<[f64; 2]>,
    edges_vertices: Vec<[usize; 2]>,
    edges_assignment: Vec<&'static str>,
    #[serde(rename = "edges_foldAngle", skip_serializing_if = "Vec::is_empty")]
    edges_fold_angle: Vec<Option<f64>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    faces_vertices: Vec<Vec<usize>>,
    #[serde(rename = "lamc:edges_joint")]
    edges_joint: Vec<Option<String>>,
    #[serde(rename = "lamc:faces_body")]
    faces_body: Vec<String>,
    file_frames: Vec<Frame>,
}

#[derive(Serialize)]
struct Frame {
    frame_title: String,
    frame_classes: [&'static str; 1],
    frame_attributes: [&'static str; 1],
    frame_parent: usize,
    frame_inherit: bool,
    vertices_coords: Vec<[f64; 3]>,
    #[serde(rename = "edges_foldAngle")]
    edges_fold_angle: Vec<Option<f64>>,
}

/// Writes a motion. The `fold` of the joints decides which crease is a mountain and which a valley; if none
/// has one, the last sample does.
///
/// # Errors
/// Those of [`FoldError`].
pub fn fold(mechanism: &Mechanism, motion: &Motion) -> Result<Folded, FoldError> {
    let reach = (ROUNDED * mechanism.tolerance).max(LEAST * mechanism.size);
    let facets = facets(mechanism, reach)?;
    let graph = graph(mechanism, &facets, reach);
    let (frames, vertices) = (motion.samples.len(), graph.vertices.len());
    if frames.saturating_mul(3 * vertices + graph.edges.len()) > MOST_NUMBERS {
        return Err(FoldError::TooLarge { frames, vertices });
    }
    let name = |joint: usize| mechanism.joints[joint].name.clone();
    let joints: Vec<Option<usize>> = graph.edges.iter().map(|edge| joint_of(edge.kind)).collect();
    let missing = (0..mechanism.joints.len()).filter(|joint| !joints.contains(&Some(*joint)));
    // A face is a single boundary: with holes, readers find the faces from the edges.
    let has_holes = facets.iter().any(|facet| !facet.holes.is_empty());
    let finished: Vec<Option<f64>> = mechanism.joints.iter().map(|joint| joint.fold).collect();
    let has_folds = finished.iter().any(Option::is_some);
    let signs = if has_folds { finished } else { motion.samples.last().map_or(Vec::new(), angles) };
    let file = File {
        file_spec: 1.2,
        file_creator: "lamc",
        file_title: mechanism.name.clone(),
        file_classes: ["animation"],
        frame_classes: ["creasePattern"],
        frame_attributes: ["2D"],
        frame_unit: "m",
        vertices_coords: graph.vertices.iter().map(|vertex| [vertex.at[0], vertex.at[1]]).collect(),
        edges_vertices: graph.edges.iter().map(|edge| edge.vertices).collect(),
        edges_assignment: graph.edges.iter().map(|edge| assignment(edge.kind, &signs)).collect(),
        edges_fold_angle: if has_folds { degrees(&graph, &signs) } else { Vec::new() },
        faces_vertices: if has_holes { Vec::new() } else { graph.faces.clone() },
        edges_joint: joints.iter().map(|joint| joint.map(name)).collect(),
        faces_body: facets.iter().map(|facet| mechanism.bodies[facet.body].name.clone()).collect(),
        file_frames: motion.samples.iter().map(|sample| frame(&graph, sample)).collect(),
    };
    // Text and finite numbers can always be written.
    let text = serde_json::to_string(&file).unwrap_or_default() + "\n";
    Ok(Folded { text, missing: missing.map(name).collect() })
}

fn joint_of(kind: Kind) -> Option<usize> {
    match kind {
        Kind::Hinge(joint, _) => Some(joint),
        Kind::Border | Kind::Slit | Kind::Flat => None,
    }
}

/// The angles of all joints, rad.
fn angles(sample: &Sample) -> Vec<Option<f64>> {
    sample.q.iter().copied().map(Some).collect()
}

/// The fold angle of an edge, rad, from those of the joints.
fn angle(kind: Kind, joints: &[Option<f64>]) -> Option<f64> {
    match kind {
        Kind::Hinge(joint, sign) => joints.get(joint).copied().flatten().map(|angle| sign * angle),
        Kind::Flat => Some(0.0),
        Kind::Border | Kind::Slit => None,
    }
}

fn degrees(graph: &Graph, joints: &[Option<f64>]) -> Vec<Option<f64>> {
    graph.edges.iter().map(|edge| angle(edge.kind, joints).map(f64::to_degrees)).collect()
}

fn assignment(kind: Kind, joints: &[Option<f64>]) -> &'static str {
    match kind {
        Kind::Border => "B",
        Kind::Slit => "C",
        Kind::Flat => "F",
        Kind::Hinge(..) => match angle(kind, joints) {
            Some(angle) if angle > FOLDED => "V",
            Some(angle) if angle < -FOLDED => "M",
            _ => "U",
        },
    }
}

fn frame(graph: &Graph, sample: &Sample) -> Frame {
    let place = |vertex: &super::graph::Vertex| {
        Placement::of(&sample.poses, vertex.body).apply(&vertex.at.into()).into()
    };
    Frame {
        frame_title: format!("t = {} s", sample.t),
        frame_classes: ["foldedForm"],
        frame_attributes: ["3D"],
        frame_parent: 0,
        frame_inherit: true,
        vertices_coords: graph.vertices.iter().map(place).collect(),
        edges_fold_angle: degrees(graph, &angles(sample)),
    }
}
