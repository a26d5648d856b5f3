//! The published designs against independently computed mass properties (shapely and NumPy).

use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use wkt::{Wkt, types::LineString};

use super::{body, material, mechanism, model};
use crate::source::{Plate, Shape, Spanned};

const DESIGNS: [&str; 4] = ["W_3.5", "pendulum2", "newMechanism", "4th_Design"];

/// What this test needs of a design: the plates of its bodies and the sheets of its layup.
#[derive(Deserialize)]
struct Design {
    connected_items: Vec<Item>,
    material_properties: Vec<Sheet>,
}

#[derive(Deserialize)]
struct Item {
    layers: Vec<Geometries>,
}

#[derive(Deserialize)]
struct Geometries {
    geoms: Vec<String>,
}

#[derive(Deserialize)]
struct Sheet {
    density: f64,
    thickness: f64,
}

#[derive(Deserialize)]
struct Reference {
    bodies: Vec<Properties>,
}

#[derive(Deserialize)]
struct Properties {
    mass: f64,
    com: [f64; 3],
    inertia: [[f64; 3]; 3],
}

fn plate(text: &str) -> Plate {
    let Ok(Wkt::Polygon(polygon)) = text.parse::<Wkt<f64>>() else { panic!("not a polygon") };
    let ring = |line: &LineString<f64>| {
        let mut vertices: Vec<_> = line.coords().iter().map(|c| [c.x, c.y]).collect();
        vertices.pop();
        Spanned { value: vertices, span: Default::default() }
    };
    let rings: Vec<_> = polygon.rings().iter().map(ring).collect();
    Plate { outline: rings[0].clone(), holes: rings[1..].to_vec() }
}

#[test]
fn published_designs_have_the_reference_mass_properties() {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared");
    if !shared.is_dir() {
        eprintln!("NOT TESTED: the published designs are not here");
        return;
    }
    for name in DESIGNS {
        let read = |path: String| std::fs::read_to_string(shared.join(path)).unwrap();
        let design: Design =
            serde_saphyr::from_str(&read(format!("designs/{name}.cad.joints"))).unwrap();
        let reference: Reference =
            serde_json::from_str(&read(format!("reference/{name}.json"))).unwrap();
        let materials =
            design.material_properties.iter().map(|s| material(s.density, s.thickness)).collect();
        let bodies = design.connected_items.iter().enumerate().map(|(i, item)| {
            let layer = |layer: &Geometries| layer.geoms.iter().map(|text| plate(text)).collect();
            body(&format!("b{i}"), Shape::Plates(item.layers.iter().map(layer).collect()))
        });
        let built = mechanism(&model(materials, bodies.collect()));
        assert_eq!(built.bodies.len(), reference.bodies.len() + 1);
        for (found, expected) in built.bodies[1..].iter().zip(&reference.bodies) {
            let found = &found.mass_properties;
            let com = Vector3::from(expected.com);
            let inertia = Matrix3::from_fn(|i, j| expected.inertia[i][j]);
            let worst = [
                (found.mass - expected.mass).abs() / expected.mass,
                (found.com - com).amax() / com.amax(),
                (found.inertia - inertia).amax() / inertia.amax(),
            ];
            assert!(worst.iter().all(|error| *error < 1e-12), "{name}: {worst:?}");
        }
    }
}
