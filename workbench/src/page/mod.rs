//! The viewer: one HTML file that contains a model, a motion, and the script that shows them.

use std::f64::consts::PI;

use lamc_templates::{THREE, VIEWER, VIEWER_SCRIPT, VIEWER_STYLE};
use nalgebra::Vector3;
use serde::Serialize;
use tera::{Context, Tera};

use crate::motion::{Motion, Sample};
use crate::picture::View;
use crate::scene::{ForceScale, Marker, Placement, Rgb, Scene};
use lamc::laminate::Mechanism;

/// The data of a page. Lengths are in m and angles in rad; most numbers have single precision.
#[derive(Serialize)]
struct Shown<'a> {
    view: ViewFrom,
    model: Model<'a>,
    motion: Curves<'a>,
    /// The parameters and joints that can be changed in a live page.
    controls: Controls<'a>,
}

#[derive(Serialize)]
struct ViewFrom {
    azimuth: f64,
    elevation: f64,
    zoom: f64,
}

#[derive(Serialize)]
struct Controls<'a> {
    parameters: Vec<Parameter<'a>>,
    initial: Vec<Initial<'a>>,
}

#[derive(Serialize)]
struct Parameter<'a> {
    name: &'a str,
    /// SI.
    value: f64,
    doc: &'a str,
}

/// A joint whose initial angle is given.
#[derive(Serialize)]
struct Initial<'a> {
    joint: &'a str,
    angle: f64,
    limits: [f64; 2],
}

#[derive(Serialize)]
struct Model<'a> {
    name: &'a str,
    size: f64,
    bodies: Vec<Body<'a>>,
    hinges: Vec<Hinge<'a>>,
    points: Vec<Point<'a>>,
    /// Materials with their colours.
    materials: Vec<(&'a str, String)>,
    /// Colours of triangles.
    colors: Vec<String>,
    bands: Vec<Band<'a>>,
    contacts: Vec<Point<'a>>,
    /// How long arrows of contact forces are.
    scale: Option<Scale>,
    /// Lower and upper corner of the box around the whole motion.
    extent: [[f32; 3]; 2],
    /// Height of the ground.
    ground: f64,
    /// Other planes that are touched.
    walls: Vec<Wall>,
}

#[derive(Serialize)]
struct Body<'a> {
    name: &'a str,
    /// Three corners of each triangle.
    corners: Vec<f32>,
    /// Of each triangle, an index.
    colors: Vec<usize>,
}

#[derive(Serialize)]
struct Hinge<'a> {
    name: &'a str,
    body: usize,
    ends: [[f32; 3]; 2],
}

#[derive(Serialize)]
struct Point<'a> {
    name: &'a str,
    body: usize,
    at: [f32; 3],
}

/// A spring or tendon.
#[derive(Serialize)]
struct Band<'a> {
    name: &'a str,
    /// Indices of points.
    through: &'a [usize],
    slack: f64,
}

/// A part of a plane.
#[derive(Serialize)]
struct Wall {
    body: Option<usize>,
    /// Both ends of each line.
    lines: Vec<[f32; 3]>,
}

#[derive(Serialize)]
struct Scale {
    length: f64,
    force: f64,
    label: String,
}

/// Lists by sample, one list for each joint or body.
#[derive(Serialize)]
struct Curves<'a> {
    /// What `t` is measured in, and how much of it a second shows.
    unit: &'static str,
    rate: f64,
    joints: &'a [String],
    t: Vec<f64>,
    q: Vec<Vec<f32>>,
    u: Vec<Vec<f32>>,
    kinetic: Vec<f32>,
    potential: Vec<f32>,
    /// Quaternion (x, y, z, w) and origin, seven numbers per sample.
    poses: Vec<Vec<f32>>,
    /// Forces on contact points, three numbers per sample.
    forces: Vec<Vec<f32>>,
    /// Whether the motion was simulated to its end.
    complete: bool,
}

/// Returns the data of a page for a motion, first seen from `view`, as JSON. It contains no `<`, so that it may
/// stand in a script element.
pub fn data(scene: &Scene, motion: &Motion, mechanism: &Mechanism, view: View) -> String {
    let View { azimuth, elevation, zoom } = view;
    json(&Shown {
        view: ViewFrom { azimuth, elevation, zoom },
        model: model(scene, motion),
        motion: curves(motion),
        controls: controls(mechanism),
    })
}

/// Returns the page that shows such data.
pub fn write(title: &str, data: &str) -> String {
    fill_in(title, data, false)
}

/// Returns the page that requests its data from the server.
pub fn live(title: &str) -> String {
    fill_in(title, "null", true)
}

fn fill_in(title: &str, data: &str, live: bool) -> String {
    let mut context = Context::new();
    context.insert("title", title);
    context.insert("style", VIEWER_STYLE);
    context.insert("three", THREE);
    context.insert("script", VIEWER_SCRIPT);
    context.insert("data", data);
    context.insert("live", &live);
    match Tera::one_off(VIEWER, &context, true) {
        Ok(page) => page,
        // The template is part of lamc, and tests render it.
        Err(error) => unreachable!("the viewer's template: {error:?}"),
    }
}

fn json(shown: &Shown<'_>) -> String {
    match serde_json::to_string(shown) {
        Ok(text) => text.replace('<', "\\u003c"),
        Err(error) => unreachable!("plain data: {error}"),
    }
}

/// All parameters, and the joints whose guess is given; if none is given, all joints that are not driven.
fn controls(mechanism: &Mechanism) -> Controls<'_> {
    let is_free = |joint: &usize| mechanism.joints[*joint].drive.is_none();
    let given = mechanism.initial_given.iter().map(|joint| joint.index());
    let mut joints: Vec<usize> = given.filter(is_free).collect();
    if joints.is_empty() {
        joints = (0..mechanism.joints.len()).filter(is_free).collect();
    }
    let initial = joints.into_iter().map(|joint| Initial {
        joint: &mechanism.joints[joint].name,
        angle: mechanism.initial_q[joint],
        limits: mechanism.joints[joint].limits.map(|limit| limit.clamp(-PI, PI)),
    });
    let parameters = mechanism.parameters.iter().map(|parameter| Parameter {
        name: &parameter.name,
        value: parameter.value,
        doc: &parameter.doc,
    });
    Controls { parameters: parameters.collect(), initial: initial.collect() }
}

fn model<'a>(scene: &'a Scene, motion: &Motion) -> Model<'a> {
    let mut colors: Vec<Rgb> = Vec::new();
    let bodies = scene
        .bodies
        .iter()
        .map(|body| {
            let mut index = |color: Rgb| {
                colors.iter().position(|known| *known == color).unwrap_or_else(|| {
                    colors.push(color);
                    colors.len() - 1
                })
            };
            let mesh = &body.mesh;
            let corners = mesh.triangles.iter().flat_map(|triangle| triangle.corners);
            Body {
                name: &body.name,
                colors: mesh.triangles.iter().map(|triangle| index(triangle.color)).collect(),
                corners: corners.flat_map(|corner| single(&mesh.vertices[corner])).collect(),
            }
        })
        .collect();
    let hinges = scene.hinges.iter().map(|hinge| Hinge {
        name: &hinge.name,
        body: hinge.body,
        ends: [single(&hinge.ends[0]), single(&hinge.ends[1])],
    });
    let extent = scene.extent(motion);
    let scale = ForceScale::of(motion).map(|scale| Scale {
        length: scale.length,
        force: scale.force,
        label: scale.label(),
    });
    let walls = scene.walls(&extent).into_iter().map(|wall| Wall {
        body: wall.body,
        lines: wall.lines.iter().flatten().map(single).collect(),
    });
    let bands = scene.bands.iter().map(|band| Band {
        name: &band.name,
        through: &band.through,
        slack: band.slack,
    });
    Model {
        name: &scene.name,
        size: scene.size,
        bodies,
        hinges: hinges.collect(),
        points: marked(&scene.points),
        bands: bands.collect(),
        contacts: marked(&scene.contacts),
        scale,
        materials: scene.materials.iter().map(|(name, color)| (&**name, hex(*color))).collect(),
        colors: colors.into_iter().map(hex).collect(),
        extent: extent.each_ref().map(single),
        ground: scene.ground(&extent),
        walls: walls.collect(),
    }
}

fn marked(markers: &[Marker]) -> Vec<Point<'_>> {
    let points = markers.iter().map(|marker| Point {
        name: &marker.name,
        body: marker.body,
        at: single(&marker.at),
    });
    points.collect()
}

fn curves(motion: &Motion) -> Curves<'_> {
    let samples = &motion.samples;
    let each = |number: &dyn Fn(&Sample) -> f64| -> Vec<f32> {
        samples.iter().map(|sample| number(sample) as f32).collect()
    };
    let joints = 0..motion.joints.len();
    Curves {
        unit: motion.course.unit(),
        rate: motion.course.per_second(),
        complete: motion.complete,
        joints: &motion.joints,
        t: samples.iter().map(|sample| sample.t).collect(),
        q: joints.clone().map(|joint| each(&|sample| sample.q[joint])).collect(),
        u: joints.map(|joint| each(&|sample| sample.u[joint])).collect(),
        kinetic: each(&|sample| sample.energy.kinetic),
        potential: each(&|sample| sample.energy.potential),
        forces: (0..motion.contacts.len())
            .map(|contact| samples.iter().flat_map(|sample| force(sample, contact)).collect())
            .collect(),
        poses: (0..motion.bodies.len())
            .map(|body| samples.iter().flat_map(|sample| pose(sample, body)).collect())
            .collect(),
    }
}

/// The force on a contact point; a fold knows none.
fn force(sample: &Sample, contact: usize) -> [f32; 3] {
    let [.., x, y, z] = sample.contacts.get(contact).copied().unwrap_or_default();
    [x, y, z].map(|number| number as f32)
}

/// The quaternion and the origin of a body.
fn pose(sample: &Sample, body: usize) -> [f32; 7] {
    let placement = Placement::of(&sample.poses, body);
    let q = placement.quaternion();
    let p = placement.position;
    [q.i, q.j, q.k, q.w, p.x, p.y, p.z].map(|number| number as f32)
}

fn single(point: &Vector3<f64>) -> [f32; 3] {
    [point.x, point.y, point.z].map(|number| number as f32)
}

fn hex([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}
