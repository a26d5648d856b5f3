//! Pictures of a mechanism, drawn in software: a z-buffer with two by two
//! samples per pixel, sunlight with shadows, edges between faces, hinge lines, springs, contact forces.

mod annotations;
mod camera;
mod canvas;
mod light;
mod raster;
mod video;

pub use camera::{Camera, View};
pub use video::{Encoder, VideoError};

use nalgebra::Vector3;

use self::canvas::{Canvas, Linear, linear};
use self::light::Light;
use self::raster::{NOTHING, Raster};
use crate::motion::{Motion, Pose};
use crate::scene::{ForceScale, Moment, Placement, Scene, Wall, box_around};

/// Samples per pixel in each direction.
const FINE: usize = 2;

/// A picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Pixels.
    pub width: usize,
    /// Pixels.
    pub height: usize,
    /// Red, green, blue (sRGB) of each pixel, by rows from the top.
    pub rgb: Vec<u8>,
}

/// Draws a scene as a camera sees it.
#[derive(Clone, Debug)]
pub struct Renderer<'a> {
    scene: &'a Scene,
    /// The camera.
    pub camera: Camera,
    light: Light,
    /// Height of the ground, m.
    ground: f64,
    walls: Vec<Wall>,
    /// Of the arrows of contact forces, and how far from the eye it holds, m.
    scale: Option<(ForceScale, f64)>,
    background: Vec<Linear>,
    seen: Raster,
    /// Of the bodies' triangles, in order: colour, unit normal, face.
    surfaces: Vec<Surface>,
}

/// A triangle of one picture.
#[derive(Clone, Copy, Debug)]
struct Surface {
    color: Linear,
    normal: Vector3<f64>,
    face: u32,
}

impl<'a> Renderer<'a> {
    /// A renderer that shows the whole of a motion, for pictures of a size in pixels.
    pub fn new(scene: &'a Scene, motion: &Motion, view: View, size: [usize; 2]) -> Self {
        Self::around(scene, motion, scene.swept(motion), view, size)
    }

    /// As [`new`](Self::new), but shows all of these points, m.
    pub fn around(
        scene: &'a Scene,
        motion: &Motion,
        mut points: Vec<Vector3<f64>>,
        view: View,
        size: [usize; 2],
    ) -> Self {
        let extent = box_around(&points);
        let (ground, walls) = (scene.ground(&extent), scene.walls(&extent));
        let camera = Camera::framing(&points, view, size);
        let depth = camera.project(&((extent[0] + extent[1]) / 2.0))[2];
        let scale = ForceScale::of(motion).map(|scale| (scale, depth));
        // Shadows fall on the ground, too.
        let (azimuth, elevation) = (view.azimuth - 0.7, 0.95);
        let light = Light::new(azimuth, elevation, &points);
        let direction = light.direction;
        let shadows =
            points.iter().map(|point| point - direction * ((point.z - ground) / direction.z));
        points = shadows.collect();
        let background = canvas::background(&camera, &points, ground);
        let mut surfaces = Vec::new();
        let mut faces = 0;
        for body in &scene.bodies {
            surfaces.extend(body.mesh.triangles.iter().map(|triangle| Surface {
                color: linear(triangle.color),
                normal: triangle.normal,
                face: (faces + triangle.face) as u32,
            }));
            faces += body.mesh.faces();
        }
        let [width, height] = size;
        let seen = Raster::new(FINE * width, FINE * height);
        Self { scene, camera, light, ground, walls, scale, background, seen, surfaces }
    }

    /// The picture of a moment.
    pub fn draw(&mut self, moment: &Moment) -> Picture {
        self.rasterise(&moment.poses);
        let [width, height] = self.camera.size;
        let mut canvas = Canvas::new(width, height);
        for y in 0..height {
            for x in 0..width {
                canvas.pixels[y * width + x] = self.pixel(x, y);
            }
        }
        self.annotate(&mut canvas, moment);
        canvas.picture()
    }

    /// Determines which triangle is seen at each sample, and which one the light hits.
    fn rasterise(&mut self, poses: &[Pose]) {
        self.seen.clear();
        self.light.clear();
        let mut what = 0;
        for (index, body) in self.scene.bodies.iter().enumerate() {
            let pose = Placement::of(poses, index);
            let at: Vec<_> = body.mesh.vertices.iter().map(|vertex| pose.apply(vertex)).collect();
            let seen: Vec<_> = at.iter().map(|point| self.sample(point)).collect();
            for triangle in &body.mesh.triangles {
                let normal = pose.rotation * triangle.normal;
                self.surfaces[what].normal = normal;
                let corners = triangle.corners.map(|corner| at[corner]);
                if normal.dot(&(self.camera.eye - corners[0])) > 0.0 {
                    self.seen.triangle(&triangle.corners.map(|corner| seen[corner]), what as u32);
                }
                if normal.dot(&self.light.direction) > 0.0 {
                    self.light.cast(&corners);
                }
                what += 1;
            }
        }
    }

    /// A point on the grid of samples: nearness is 1 / depth, which is linear across a picture.
    fn sample(&self, point: &Vector3<f64>) -> [f64; 3] {
        let [x, y, depth] = self.camera.project(point);
        [FINE as f64 * x, FINE as f64 * y, 1.0 / depth]
    }

    /// The colour of a pixel: the mean of its samples.
    fn pixel(&self, x: usize, y: usize) -> Linear {
        if let Some(what) = self.alone(x, y) {
            return self.color(what, x, y, self.seen.near[FINE * (y * self.seen.width + x)]);
        }
        let mut sum = Linear::zeros();
        let mut last: Option<(u32, Linear)> = None;
        for row in FINE * y..FINE * (y + 1) {
            for column in FINE * x..FINE * (x + 1) {
                let at = row * self.seen.width + column;
                let what = self.seen.what[at];
                let color = match last {
                    Some((known, color)) if known == what => color,
                    _ => self.color(what, x, y, self.seen.near[at]),
                };
                last = Some((what, color));
                sum += if self.is_edge(column, row) { color * 0.35 } else { color };
            }
        }
        sum / (FINE * FINE) as f32
    }

    /// The triangle at all samples of a pixel and at those to the right of it and below it, or [`NOTHING`], if it is
    /// the same at all of them: there is no edge.
    fn alone(&self, x: usize, y: usize) -> Option<u32> {
        let [column, row] = [x, y].map(|at| FINE * at);
        let width = self.seen.width;
        let what = self.seen.what[row * width + column];
        let is_same = |row: usize| {
            let samples = self.seen.what.get(row * width + column..row * width + column + FINE + 1);
            samples.is_some_and(|samples| samples.iter().all(|here| *here == what))
        };
        (column + FINE < width && (row..=row + FINE).all(is_same)).then_some(what)
    }

    /// The colour of what is seen at a pixel.
    fn color(&self, what: u32, x: usize, y: usize, near: f32) -> Linear {
        match what {
            NOTHING => self.background(x, y),
            _ => self.shade(what, x, y, near),
        }
    }

    /// Whether another face begins to the right of a sample or below it.
    fn is_edge(&self, column: usize, row: usize) -> bool {
        let width = self.seen.width;
        let face = |what: u32| self.surfaces.get(what as usize).map(|surface| surface.face);
        let here = self.seen.what[row * width + column];
        let differs = |there: u32| there != here && face(there) != face(here);
        (column + 1 < width && differs(self.seen.what[row * width + column + 1]))
            || (row + 1 < self.seen.height && differs(self.seen.what[(row + 1) * width + column]))
    }

    /// The colour of a surface, seen at a pixel: Lambert's law, with less light from below.
    fn shade(&self, what: u32, x: usize, y: usize, near: f32) -> Linear {
        let surface = self.surfaces[what as usize];
        let ambient = 0.34 + 0.14 * surface.normal.z as f32;
        let facing = surface.normal.dot(&self.light.direction) as f32;
        if facing <= 0.0 {
            return surface.color * ambient;
        }
        let ray = self.camera.ray(x as f64 + 0.5, y as f64 + 0.5);
        let point = self.camera.eye + ray / f64::from(near);
        surface.color * (ambient + 0.72 * facing * self.light.reaches(&point, facing))
    }

    /// The ground with its shadows, or the sky.
    fn background(&self, x: usize, y: usize) -> Linear {
        let color = self.background[y * self.camera.size[0] + x];
        match canvas::on_ground(&self.camera, x as f64 + 0.5, y as f64 + 0.5, self.ground) {
            Some(point) => {
                color * (0.55 + 0.45 * self.light.reaches(&point, self.light.direction.z as f32))
            }
            None => color,
        }
    }
}

impl Picture {
    /// This picture with another of the same height to its right.
    pub fn beside(self, right: Self) -> Self {
        let [left_row, right_row] = [self.width, right.width].map(|width| 3 * width.max(1));
        let rows = self.rgb.chunks_exact(left_row).zip(right.rgb.chunks_exact(right_row));
        let rgb = rows.flat_map(|(left, right)| left.iter().chain(right)).copied().collect();
        Self { width: self.width + right.width, height: self.height.min(right.height), rgb }
    }

    /// Encodes the picture as a PNG file.
    ///
    /// # Errors
    /// If the picture is too large for a PNG file.
    pub fn png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut file = Vec::new();
        let [width, height] = [self.width, self.height].map(|pixels| pixels as u32);
        let mut encoder = png::Encoder::new(&mut file, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgb)?;
        writer.finish()?;
        Ok(file)
    }
}
