//! What is drawn over the bodies: hinge lines, points, springs, planes, contact forces, and the scales of these.

use nalgebra::Vector3;

use super::canvas::{Canvas, Linear, linear};
use super::{FINE, Renderer};
use crate::scene::{Moment, Placement, Rgb};

const HINGE: Rgb = [214, 48, 49];
const POINT: Rgb = [20, 60, 120];
const BAND: Rgb = [196, 112, 20];
const WALL: Rgb = [150, 160, 172];
/// Of contact points and the forces on them.
const TOUCH: Rgb = [22, 140, 72];

/// Length of an arrow's head as a share of the arrow, and at most, in the unit of the canvas; half its width as a share
/// of its length.
const HEAD: [f64; 3] = [0.3, 14.0, 0.4];

/// A place in the picture: x and y, pixels, and nearness, 1/m.
type Place = [f64; 3];

impl Renderer<'_> {
    /// Draws everything over the bodies of a moment.
    pub(super) fn annotate(&self, canvas: &mut Canvas, moment: &Moment) {
        let pose = |body: usize| Placement::of(&moment.poses, body);
        let shown = |at: &Place| self.visible(at);
        for wall in &self.walls {
            for ends in &wall.lines {
                let ends = ends.map(|end| wall.body.map_or(end, |body| pose(body).apply(&end)));
                canvas.line(ends.map(|end| self.see(&end)), 1.0, linear(WALL), shown);
            }
        }
        for hinge in &self.scene.hinges {
            let ends = hinge.ends.map(|end| self.see(&pose(hinge.body).apply(&end)));
            canvas.line(ends, 2.0, linear(HINGE), shown);
        }
        let points = self.scene.points.iter().map(|point| pose(point.body).apply(&point.at));
        let points: Vec<_> = points.collect();
        for point in &points {
            let at = self.see(point);
            canvas.line([at, at], 7.0, linear(POINT), shown);
        }
        for band in &self.scene.bands {
            let through: Vec<_> = band.through.iter().map(|point| points[*point]).collect();
            let length = through.windows(2).map(|ends| (ends[1] - ends[0]).norm()).sum();
            let thickness = if band.is_taut(length) { 3.0 } else { 1.2 };
            for ends in through.windows(2) {
                let ends = [ends[0], ends[1]].map(|end| self.see(&end));
                canvas.line(ends, thickness, linear(BAND), shown);
            }
        }
        self.contacts(canvas, moment);
        canvas.axes(&self.camera);
    }

    /// Draws contact points, the forces on them, and the scale of these.
    fn contacts(&self, canvas: &mut Canvas, moment: &Moment) {
        let Some((scale, depth)) = self.scale else { return };
        let color = linear(TOUCH);
        for (index, contact) in self.scene.contacts.iter().enumerate() {
            let at = Placement::of(&moment.poses, contact.body).apply(&contact.at);
            let place = self.see(&at);
            canvas.line([place, place], 5.0, color, |at| self.visible(at));
            let force = moment.forces.get(index).map_or_else(Vector3::zeros, |f| (*f).into());
            if force.norm() > 0.0 {
                let tip = self.see(&(at + force * (scale.length / scale.force)));
                arrow(canvas, [place, tip], color);
            }
        }
        let [width, height] = self.camera.size.map(|pixels| pixels as f64);
        let unit = canvas.unit();
        let length = self.camera.focal * scale.length / depth;
        let end = [width - 30.0 * unit, height - 30.0 * unit, 0.0];
        arrow(canvas, [[end[0] - length, end[1], 0.0], end], color);
        canvas.label(&scale.label(), [end[0], end[1] - 20.0 * unit], color);
    }

    /// The place of a point in the picture. Hinge lines lie inside their sheet: all is brought forward by about its
    /// thickness.
    fn see(&self, point: &Vector3<f64>) -> Place {
        let forward = self.camera.back * (0.01 * self.scene.size);
        let [x, y, _] = self.camera.project(point);
        [x, y, 1.0 / self.camera.project(&(point + forward))[2]]
    }

    /// How much of a pixel something is seen at, given where it is and its nearness; what is
    /// hidden shines through a little.
    fn visible(&self, [x, y, near]: &Place) -> f32 {
        let [column, row] = [x, y].map(|at| FINE * at.floor() as usize);
        let mut free = 0;
        for row in row..row + FINE {
            for column in column..column + FINE {
                let index = row * self.seen.width + column;
                free += usize::from(f64::from(self.seen.near[index]) <= *near);
            }
        }
        0.12 + 0.88 * free as f32 / (FINE * FINE) as f32
    }
}

/// Draws an arrow over everything.
fn arrow(canvas: &mut Canvas, [from, to]: [Place; 2], color: Linear) {
    let [x, y] = [to[0] - from[0], to[1] - from[1]];
    canvas.line([from, to], 2.0, color, |_| 1.0);
    let [share, most, aside] = HEAD;
    let back = share.min(most * canvas.unit() / x.hypot(y));
    for side in [-aside * back, aside * back] {
        let end = [to[0] - back * x - side * y, to[1] - back * y + side * x, 0.0];
        canvas.line([end, to], 2.0, color, |_| 1.0);
    }
}
