//! The bodies as closed surfaces of triangles, as pictures show them, in millimetres.

use std::fmt::Write;

use nalgebra::Vector3;

use crate::motion::Pose;
use crate::scene::{Placement, Scene};

/// Millimetres in a metre.
const MM: f64 = 1e3;
/// Length of the text at the beginning of a binary STL file.
const HEADER: usize = 80;

/// Writes a state as Wavefront OBJ: one object for each body, base frame, mm.
pub fn obj(scene: &Scene, poses: &[Pose]) -> String {
    let mut text = format!("# {}: lengths in millimetres\n", scene.name);
    // Indices count through all objects, from 1.
    let mut first = 1;
    for (index, body) in scene.bodies.iter().enumerate() {
        if body.mesh.triangles.is_empty() {
            continue;
        }
        let placement = Placement::of(poses, index);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "o {}", body.name);
        for vertex in &body.mesh.vertices {
            let [x, y, z] = (placement.apply(vertex) * MM).into();
            let _ = writeln!(text, "v {x} {y} {z}");
        }
        for triangle in &body.mesh.triangles {
            let [a, b, c] = triangle.corners.map(|corner| first + corner);
            let _ = writeln!(text, "f {a} {b} {c}");
        }
        first += body.mesh.vertices.len();
    }
    text
}

/// Writes a state as binary STL, base frame, mm, with outward normals.
pub fn stl(scene: &Scene, poses: &[Pose]) -> Vec<u8> {
    let mut header = [b' '; HEADER];
    // A file that begins with `solid` would be taken for the text form of the format.
    let title = format!("lamc: {}, mm", scene.name);
    let length = title.len().min(HEADER);
    header[..length].copy_from_slice(&title.as_bytes()[..length]);
    let count: usize = scene.bodies.iter().map(|body| body.mesh.triangles.len()).sum();
    let mut bytes = header.to_vec();
    bytes.extend((count as u32).to_le_bytes());
    for (index, body) in scene.bodies.iter().enumerate() {
        let placement = Placement::of(poses, index);
        for triangle in &body.mesh.triangles {
            let normal = placement.rotation * triangle.normal;
            let corners =
                triangle.corners.map(|corner| placement.apply(&body.mesh.vertices[corner]) * MM);
            for vector in std::iter::once(normal).chain(corners) {
                put(&mut bytes, &vector);
            }
            bytes.extend([0; 2]);
        }
    }
    bytes
}

fn put(bytes: &mut Vec<u8>, vector: &Vector3<f64>) {
    vector.iter().for_each(|x| bytes.extend((*x as f32).to_le_bytes()));
}
