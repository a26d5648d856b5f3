//! Pictures against the poses they show: corners by another projection, bodies by rays; videos
//! against the pictures they are made of, by another decoder.

use super::compare::{largest, maximum};
use super::not_checked::is_there;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use lamc::laminate::Mechanism;
use lamc::pipeline;
use lamc::program::Interpreter;
use lamc::source::SourceFile;
use lamc_runtime::{Mechanism as _, assemble};
use lamc_workbench::motion::{Motion, Pose};
use lamc_workbench::picture::{Camera, Picture, Renderer, View};
use lamc_workbench::scene::{Placement, Scene};
use nalgebra::{Isometry3, Perspective3, Point3, Vector3};
use proptest::prelude::*;

const SIZE: [usize; 2] = [400, 300];

/// Colours that stay distinguishable in any light, each without a part of it. The background has
/// all three parts everywhere.
const PURE: [[u8; 3]; 6] =
    [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 0], [255, 0, 255], [0, 255, 255]];

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(name)
}

/// An example, and a few of its poses, assembled from guesses far apart.
fn folded(name: &str) -> (Mechanism, Motion) {
    let file = SourceFile::read(&example(name).display().to_string()).expect("an example");
    let compiled = pipeline::compile(&file).expect("an example compiles");
    let system = Interpreter::new(&compiled.program);
    let mut motion = Motion::new(system.interface());
    for scale in [1.0, 0.4, -0.7] {
        let mut state = system.initial();
        state.q.iter_mut().for_each(|angle| *angle *= scale);
        let pinned: Vec<_> = (0..state.q.len()).map(|joint| system.is_pinned(joint)).collect();
        assemble(&system, 0.0, &mut state.q, &pinned, &mut system.workspace()).expect("it closes");
        motion.record(&system, &state).expect("it moves");
    }
    (compiled.topology.mechanism, motion)
}

/// Where a point is seen, pixels, by the matrices of computer graphics: look-at and perspective,
/// then the square from -1 to 1 stretched over the picture.
fn seen(renderer: &Renderer<'_>, point: &Vector3<f64>) -> [f64; 2] {
    let camera = &renderer.camera;
    let [width, height] = SIZE.map(|pixels| pixels as f64);
    let eye = Point3::from(camera.eye);
    let view = Isometry3::look_at_rh(&eye, &(eye - camera.back), &camera.up);
    let angle = 2.0 * (height / 2.0 / camera.focal).atan();
    let at = Perspective3::new(width / height, angle, 1e-3, 1e3)
        .project_point(&(view * Point3::from(*point)));
    [(at.x + 1.0) / 2.0 * width, (1.0 - at.y) / 2.0 * height]
}

/// Pixels that show something of a colour with these parts and no others.
fn has_color(picture: &Picture, pixel: usize, color: [u8; 3]) -> bool {
    let parts = &picture.rgb[3 * pixel..3 * pixel + 3];
    parts.iter().zip(color).all(|(part, pure)| (*part > 0) == (pure > 0))
}

/// Corners of a body's sheets at a pose, base frame, m, from the drawing.
fn corners(mechanism: &Mechanism, body: usize, pose: &Placement) -> Vec<Vector3<f64>> {
    let sheets = &mechanism.bodies[body].sheets;
    let flat = sheets.iter().flat_map(|sheet| {
        sheet.outline.iter().flat_map(|[x, y]| sheet.z.map(|z| Vector3::new(*x, *y, z)))
    });
    flat.map(|corner| pose.apply(&corner)).collect()
}

/// A body alone, on which only the parts of the background are missing, reaches as far in every
/// direction of the picture as its corners do.
#[test]
fn corners_are_where_the_poses_say() {
    for name in ["sixbar.yaml", "pendulum.yaml", "fourbar.yaml"] {
        let (mechanism, motion) = folded(name);
        for body in 0..mechanism.bodies.len() {
            let mut scene = Scene::new(&mechanism);
            (scene.hinges, scene.points) = (Vec::new(), Vec::new());
            for (index, solid) in scene.bodies.iter_mut().enumerate() {
                if index != body {
                    solid.mesh.triangles.clear();
                }
                for triangle in &mut solid.mesh.triangles {
                    triangle.color = PURE[0];
                }
            }
            let mut renderer = Renderer::new(&scene, &motion, View::default(), SIZE);
            for sample in &motion.samples {
                let picture = renderer.draw(&sample.into());
                // The background has no more red than green. The axes in the corner have.
                let shown: Vec<[f64; 2]> = (0..SIZE[0] * SIZE[1])
                    .map(|pixel| [pixel % SIZE[0], pixel / SIZE[0]])
                    .filter(|[x, y]| *x > 60 || *y < SIZE[1] - 60)
                    .filter(|[x, y]| {
                        let parts = &picture.rgb[3 * (y * SIZE[0] + x)..];
                        parts[0] > parts[1] + 1
                    })
                    .map(|pixel| pixel.map(|at| at as f64 + 0.5))
                    .collect();
                let placement = Placement::of(&sample.poses, body);
                let expected: Vec<[f64; 2]> = corners(&mechanism, body, &placement)
                    .iter()
                    .map(|corner| seen(&renderer, corner))
                    .collect();
                for direction in 0..24 {
                    let (s, c) = (f64::from(direction) * std::f64::consts::PI / 12.0).sin_cos();
                    let reach =
                        |places: &[[f64; 2]]| maximum(places.iter().map(|[x, y]| c * x + s * y));
                    let (found, wanted) = (reach(&shown), reach(&expected));
                    assert!(
                        (found - wanted).abs() < 1.3,
                        "{name}, body {body}, direction {direction}: {found} is not {wanted}"
                    );
                }
            }
        }
    }
}

/// The distance along a ray to a triangle, by Möller and Trumbore.
fn hit(eye: &Vector3<f64>, ray: &Vector3<f64>, [a, b, c]: [Vector3<f64>; 3]) -> Option<f64> {
    let (ab, ac, from) = (b - a, c - a, eye - a);
    let across = ray.cross(&ac);
    let volume = ab.dot(&across);
    let around = from.cross(&ab);
    let (u, v) = (from.dot(&across) / volume, ray.dot(&around) / volume);
    let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
    inside.then(|| ac.dot(&around) / volume).filter(|distance| *distance > 0.0)
}

/// The body a ray meets first.
fn first_hit(
    scene: &Scene,
    poses: &[Pose],
    eye: &Vector3<f64>,
    ray: &Vector3<f64>,
) -> Option<usize> {
    let mut nearest = (f64::INFINITY, None);
    for (index, body) in scene.bodies.iter().enumerate() {
        let placement = Placement::of(poses, index);
        for triangle in &body.mesh.triangles {
            let at = triangle.corners.map(|corner| placement.apply(&body.mesh.vertices[corner]));
            if let Some(distance) = hit(eye, ray, at)
                && distance < nearest.0
            {
                nearest = (distance, Some(index));
            }
        }
    }
    nearest.1
}

/// Every pixel asked for shows the body that a ray through it meets first.
#[test]
fn bodies_hide_each_other_as_rays_say() {
    let (mechanism, motion) = folded("sixbar.yaml");
    let mut scene = Scene::new(&mechanism);
    (scene.hinges, scene.points) = (Vec::new(), Vec::new());
    for (body, color) in scene.bodies.iter_mut().zip(PURE) {
        body.mesh.triangles.iter_mut().for_each(|triangle| triangle.color = color);
    }
    for view in ["-60,30", "20,10", "130,65,1.4", "200,-25"] {
        let view: View = view.parse().expect("a view");
        let mut renderer = Renderer::new(&scene, &motion, view, SIZE);
        let (mut asked, mut of_bodies) = (0, [0; 6]);
        for sample in &motion.samples {
            let picture = renderer.draw(&sample.into());
            for pixel in (0..SIZE[0] * SIZE[1]).step_by(53) {
                let [x, y] = [pixel % SIZE[0], pixel / SIZE[0]];
                // Left out: the axes in the corner.
                if x < 60 && y > SIZE[1] - 60 {
                    continue;
                }
                let at = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.5, 0.5]];
                let found = at.map(|[right, down]| {
                    let ray = renderer.camera.ray(x as f64 + right, y as f64 + down);
                    first_hit(&scene, &sample.poses, &renderer.camera.eye, &ray)
                });
                // On the border between bodies a pixel shows both.
                if found.iter().any(|body| *body != found[0]) {
                    continue;
                }
                asked += 1;
                match found[0] {
                    Some(body) => {
                        of_bodies[body] += 1;
                        assert!(has_color(&picture, pixel, PURE[body]), "({x}, {y}): not {body}");
                    }
                    None => assert!(has_color(&picture, pixel, [1; 3]), "({x}, {y}): not empty"),
                }
            }
        }
        assert!(asked > 3000 && of_bodies.iter().all(|pixels| *pixels > 10), "{of_bodies:?}");
    }
}

/// From wherever it is seen, the whole motion is in the picture and fills it one way.
#[test]
fn everything_is_in_the_picture() {
    let (mechanism, motion) = folded("pendulum.yaml");
    let scene = Scene::new(&mechanism);
    let swept = scene.swept(&motion);
    proptest!(|(azimuth in -360.0..360.0_f64, elevation in -90.0..90.0_f64)| {
        let view = View { azimuth: azimuth.to_radians(), elevation: elevation.to_radians(), zoom: 1.0 };
        let camera = Camera::framing(&swept, view, SIZE);
        let share = |axis: usize| {
            let middle = SIZE[axis] as f64 / 2.0;
            let places = swept.iter().map(|point| camera.project(point)[axis]);
            largest(places.map(|place| (place - middle) / middle))
        };
        let (across, along) = (share(0), share(1));
        prop_assert!(across < 0.95 && along < 0.95, "{} {}", across, along);
        prop_assert!(across.max(along) > 0.85, "{} {}", across, along);
    });
}

fn lamc(arguments: &[&str]) -> Output {
    super::common::lamc().args(arguments).output().expect("lamc runs")
}

fn simulate(folder: &Path, arguments: &[&str]) -> Output {
    let model = example("sixbar.yaml").display().to_string();
    let mut command = super::common::lamc();
    command.current_dir(folder).args(["simulate", &model]).args(arguments);
    command.output().expect("lamc runs")
}

pub fn read_png(path: &Path) -> (u32, u32, Vec<u8>) {
    let file = std::io::BufReader::new(fs::File::open(path).expect("a picture"));
    let mut reader = png::Decoder::new(file).read_info().expect("PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a size")];
    let info = reader.next_frame(&mut pixels).expect("a picture");
    (info.width, info.height, pixels)
}

#[test]
fn a_video_is_its_pictures() {
    let has = |program| is_there(program, &["-version"], "videos");
    if !has("ffmpeg") || !has("ffprobe") {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    fs::create_dir(path.join("drawn")).expect("a folder");
    fs::create_dir(path.join("decoded")).expect("a folder");
    let done = simulate(
        path,
        &["--duration", "0.5", "--size", "320x240", "--video", "a.mp4", "--png", "drawn/####.png"],
    );
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let probe = Command::new("ffprobe")
        .args([
            "-v",
            "error",
            "-count_frames",
            "-of",
            "default=noprint_wrappers=1",
            "-show_entries",
        ])
        .arg("stream=codec_name,width,height,nb_read_frames,r_frame_rate,color_space,duration")
        .arg(path.join("a.mp4"))
        .output()
        .expect("ffprobe runs");
    let told = String::from_utf8_lossy(&probe.stdout).into_owned();
    for line in [
        "codec_name=h264",
        "width=320",
        "height=240",
        "nb_read_frames=16",
        "r_frame_rate=30/1",
        "color_space=smpte170m",
    ] {
        assert!(told.contains(line) && probe.stderr.is_empty(), "no {line} in {told}");
    }
    let decode = Command::new("ffmpeg")
        .args(["-v", "error", "-i"])
        .arg(path.join("a.mp4"))
        .args(["-start_number", "0"])
        .arg(path.join("decoded/%04d.png"))
        .output()
        .expect("ffmpeg runs");
    assert!(decode.status.success() && decode.stderr.is_empty());
    for picture in 0..16 {
        let name = format!("{picture:04}.png");
        let drawn = read_png(&path.join("drawn").join(&name));
        let decoded = read_png(&path.join("decoded").join(&name));
        assert_eq!((drawn.0, drawn.1), (decoded.0, decoded.1));
        let squares = drawn.2.iter().zip(&decoded.2).map(|(a, b)| {
            let apart = f64::from(*a) - f64::from(*b);
            apart * apart
        });
        let mean = squares.sum::<f64>() / drawn.2.len() as f64;
        let decibels = 10.0 * (255.0 * 255.0 / mean).log10();
        assert!(decibels > 36.0, "picture {picture}: {decibels} dB");
    }
}

#[test]
fn what_cannot_be_written_is_said_and_nothing_is_left() {
    let folder = tempfile::tempdir().expect("a folder");
    let refused = |arguments: &[&str], code: i32, reason: &str| {
        let done = simulate(folder.path(), &[&["--duration", "0.1"], arguments].concat());
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(code), "{arguments:?}: {said}");
        assert!(said.contains(reason), "{arguments:?}: {said}");
        assert_eq!(fs::read_dir(folder.path()).map(Iterator::count).ok(), Some(0), "{arguments:?}");
    };
    for flag in ["--video", "--png", "--view"] {
        refused(&[flag, "no/such/file"], 1, "there is no folder `no/such`");
        refused(&[flag, "/dev/full"], 1, "cannot write /dev/full: No space left on device");
    }
    refused(&["--png", "missing/##.png"], 1, "cannot write missing/##.png: ");
    refused(&["--video", "a.mp4", "--size", "321x240"], 2, "must be even, not 321 x 240");
    refused(&["--png", "a.png", "--size", "5x5"], 2, "`800x600`, each 16 to 4096");
    refused(&["--png", "a.png", "--camera", "45"], 2, "`azimuth,elevation`");
    refused(&["--png", "a.png", "--camera", "45,91"], 2, "elevation in -90..90");
    refused(&["--png", "a.png", "--camera", "nan,inf"], 2, "azimuth is in -360..360");
    refused(&["--video", "a.mp4", "--speed", "0"], 2, "--speed must be a positive number");
    refused(&["--video", "a.mp4", "--speed", "1e-9"], 2, "frames are too many");
}

/// Every example can be drawn, and a body without sheets is drawn as its inertia.
#[test]
fn masses_without_shape_are_seen() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = folder.path().join("ball.yaml");
    let text = "bodies:\n  base: { fixed: true }\n  ball: { mass: 0.1, com: [0.1, 0, 0], \
                inertia: [[4e-5, 0, 0], [0, 4e-5, 0], [0, 0, 4e-5]] }\n\
                joints: { hinge: { bodies: [base, ball], axis: [[0, 0], [0, 0.02]] } }\n";
    fs::write(&model, text).expect("a file");
    let picture = folder.path().join("ball.png");
    let path = |file: &Path| file.display().to_string();
    let done = lamc(&["simulate", &path(&model), "--duration", "0.1", "--png", &path(&picture)]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let file = SourceFile::read(&path(&model)).expect("the model");
    let mechanism = pipeline::analyse(&file).expect("it is sound").0.mechanism;
    let scene = Scene::new(&mechanism);
    // The homogeneous ball of this mass and inertia: I = 2/5 m r^2.
    let radius = (2.5_f64 * 4e-5 / 0.1).sqrt();
    let vertices = &scene.bodies[1].mesh.vertices;
    let center = Vector3::new(0.1, 0.0, 0.0);
    let on_ball = vertices.iter().filter(|x| ((*x - center).norm() - radius).abs() < 1e-12);
    assert!(on_ball.count() > 100);
    let (width, height, pixels) = read_png(&picture);
    assert_eq!((width, height), (800, 600));
    let dark = pixels.as_chunks::<3>().0.iter().filter(|rgb| rgb[0] < 150 && rgb[2] > rgb[0]);
    assert!(dark.count() > 2000);
}

/// The closed surfaces enclose the volume of the drawing, by the divergence theorem.
#[test]
fn solids_have_the_volume_of_their_sheets() {
    let holed = "units: { length: mm }\nmaterials: { card: { density: 700, thickness: 2 } }\n\
                 layup: [card]\nbodies:\n  base: { fixed: true }\n  plate:\n    \
                 outline: [[0, 0], [0, 40], [30, 40], [30, 20], [60, 20], [60, 0]]\n    \
                 holes: [[[5, 5], [15, 5], [15, 15], [5, 15]], [[10, 25], [20, 25], [15, 35]]]\n\
                 joints: { hinge: { bodies: [base, plate], axis: [[0, 0], [0, 40]] } }\n";
    let file = SourceFile { path: "plate.yaml".to_owned(), text: holed.to_owned() };
    let mechanism = pipeline::analyse(&file).expect("it is sound").0.mechanism;
    let mesh = &Scene::new(&mechanism).bodies[1].mesh;
    let volume: f64 = mesh
        .triangles
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.corners.map(|corner| mesh.vertices[corner]);
            assert!((b - a).cross(&(c - a)).dot(&triangle.normal) > 0.0);
            a.dot(&b.cross(&c)) / 6.0
        })
        .sum();
    let mass = mechanism.bodies[1].mass_properties.mass;
    assert!((volume * 700.0 - mass).abs() < 1e-12 * mass, "{volume} m^3 is not {mass} kg");
}
