//! Forces as they are drawn: contact points, the planes they touch, springs and tendons, and the scale of arrows.

use lamc::laminate::{Mechanism, Tension};
use nalgebra::Vector3;

use super::{Marker, Scene, box_around};
use crate::motion::Motion;

/// A spring or tendon: straight lines between points.
#[derive(Clone, Debug)]
pub struct Band {
    /// Its name.
    pub name: String,
    /// Places in [`Scene::points`], from one end to the other.
    pub through: Vec<usize>,
    /// Up to this length, m, it is slack; 0 if it never is.
    pub slack: f64,
}

impl Band {
    /// Whether it is under tension where its points are so far apart altogether, m.
    pub fn is_taut(&self, length: f64) -> bool {
        length > self.slack
    }
}

/// A plane that points touch.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactPlane {
    /// The body that carries it; none if it is fixed to the ground.
    pub body: Option<usize>,
    /// One of its points, flat coordinates, m.
    pub point: Vector3<f64>,
    /// Its unit normal, flat coordinates.
    pub normal: Vector3<f64>,
}

/// A part of a plane as a grid of lines.
#[derive(Clone, Debug)]
pub struct Wall {
    /// The body that carries it; none if it is fixed to the ground.
    pub body: Option<usize>,
    /// Ends of the lines, flat coordinates, m.
    pub lines: Vec<[Vector3<f64>; 2]>,
}

/// How long arrows of forces are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceScale {
    /// Length of an arrow, m, ...
    pub length: f64,
    /// ... that stands for this force, N.
    pub force: f64,
}

/// The length for which a scale gives a force is at least this share of the size of the mechanism.
const ARROW: f64 = 0.2;
/// That force is at least what so many of the samples with contact stay below: an impact may be much larger.
const USUAL: f64 = 0.9;
/// Lines across a wall in each direction.
const ACROSS: usize = 9;
/// A normal that differs from the vertical by less, in each component, belongs to a level floor.
const LEVEL: f64 = 1e-9;

impl ForceScale {
    /// A scale on which the usual contact forces of a motion have a length that can be seen; none if nothing touches.
    pub fn of(motion: &Motion) -> Option<Self> {
        let of_sample = |contacts: &Vec<[f64; 6]>| {
            contacts.iter().map(|[.., x, y, z]| x.hypot(*y).hypot(*z)).fold(0.0, f64::max)
        };
        let mut found: Vec<f64> = motion
            .samples
            .iter()
            .map(|sample| of_sample(&sample.contacts))
            .filter(|force| *force > 0.0)
            .collect();
        found.sort_by(f64::total_cmp);
        let usual =
            found.get(((found.len() as f64 * USUAL) as usize).min(found.len().max(1) - 1))?;
        Some(Self { length: round_up(ARROW * motion.size), force: round_up(*usual) })
    }

    /// The force for which the scale gives a length, with its unit.
    pub fn label(&self) -> String {
        const UNITS: [(f64, &str); 5] =
            [(1e3, "kN"), (1.0, "N"), (1e-3, "mN"), (1e-6, "uN"), (1e-9, "nN")];
        let fits = |unit: &&(f64, &str)| self.force >= unit.0 * (1.0 - 1e-9);
        let (unit, name) = UNITS.iter().find(fits).unwrap_or(&UNITS[4]);
        format!("{:.0} {name}", self.force / unit)
    }
}

/// The nearest of 1, 2, 5, 10, ... (powers of ten) not below a number.
pub fn round_up(number: f64) -> f64 {
    let decade = 10.0_f64.powf(number.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .map(|step| step * decade)
        .into_iter()
        .find(|step| *step >= number)
        .unwrap_or(number)
}

/// Returns the springs between points and the tendons of a mechanism.
pub fn bands(mechanism: &Mechanism) -> Vec<Band> {
    let values: Vec<f64> = mechanism.parameters.iter().map(|parameter| parameter.value).collect();
    let slack = |tension: &Tension| match tension {
        Tension::Elastic { rest_length, tension_only: true, .. } => {
            rest_length.at(&values).unwrap_or(0.0)
        }
        _ => 0.0,
    };
    let bands = mechanism.elements.tendons.iter().map(|tendon| Band {
        name: tendon.name.clone(),
        through: tendon.through.iter().map(|point| point.index()).collect(),
        slack: slack(&tendon.tension),
    });
    bands.collect()
}

/// Returns the contact points of a mechanism, in the order of [`Sample::contacts`](crate::motion::Sample::contacts).
pub fn contacts(mechanism: &Mechanism) -> Vec<Marker> {
    let points = mechanism.contacts.iter().flat_map(|contact| {
        contact.points.iter().map(|point| Marker {
            name: point.name.clone(),
            body: point.body.index(),
            at: point.at,
        })
    });
    points.collect()
}

/// Returns the planes that a mechanism touches, each once. A plane within the outline of a plate is that plate.
pub fn planes(mechanism: &Mechanism) -> Vec<ContactPlane> {
    let mut found: Vec<ContactPlane> = Vec::new();
    for contact in mechanism.contacts.iter().filter(|contact| contact.plane.outline.is_none()) {
        let body = contact.plane.body.map(|body| body.index());
        let plane = ContactPlane {
            body: body.filter(|body| !mechanism.bodies[*body].fixed),
            point: contact.plane.point,
            normal: contact.plane.normal,
        };
        if !found.contains(&plane) {
            found.push(plane);
        }
    }
    found
}

impl ContactPlane {
    /// Whether it is a floor of the ground, on which things can stand.
    fn is_floor(&self) -> bool {
        self.body.is_none() && (self.normal - Vector3::z()).amax() < LEVEL
    }

    /// A square part of it about the place nearest to `middle`, m, that reaches as far as `reach`, m.
    fn wall(&self, middle: &Vector3<f64>, reach: f64) -> Wall {
        let centre = middle - self.normal * self.normal.dot(&(middle - self.point));
        let aside = if self.normal.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
        let first = self.normal.cross(&aside).normalize();
        let second = self.normal.cross(&first);
        let mut lines = Vec::new();
        for line in 0..ACROSS {
            let away = reach * (2.0 * line as f64 / (ACROSS - 1) as f64 - 1.0);
            for [across, along] in [[first, second], [second, first]] {
                let place = centre + across * away;
                lines.push([place - along * reach, place + along * reach]);
            }
        }
        Wall { body: self.body, lines }
    }
}

impl Scene {
    /// The height of the ground, m: that of the lowest floor that points touch; otherwise a little below everything in
    /// the box around a motion.
    pub fn ground(&self, [low, _]: &[Vector3<f64>; 2]) -> f64 {
        let floors = self.planes.iter().filter(|plane| plane.is_floor()).map(|plane| plane.point.z);
        floors.reduce(f64::min).unwrap_or(low.z - 0.02 * self.size)
    }

    /// The planes that points touch, but for the ground, as far as they are near to a motion in this box.
    pub fn walls(&self, extent: &[Vector3<f64>; 2]) -> Vec<Wall> {
        let ground = self.ground(extent);
        let shown = self.planes.iter().filter(|plane| !plane.is_floor() || plane.point.z > ground);
        let walls = shown.map(|plane| {
            let [low, high] = match plane.body {
                Some(body) => box_around(&self.bodies[body].mesh.vertices),
                None => *extent,
            };
            plane.wall(&((low + high) / 2.0), (high - low).norm() / 2.0)
        });
        walls.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_round_numbers_with_units() {
        for (force, label) in [(0.1, "100 mN"), (2.0, "2 N"), (5e-6, "5 uN"), (2e4, "20 kN")] {
            assert_eq!(ForceScale { length: 0.05, force }.label(), label);
        }
        for (number, rounded) in [(0.03, 0.05), (0.05, 0.05), (7.0, 10.0), (110.0, 200.0)] {
            assert!((round_up(number) / rounded - 1.0_f64).abs() < 1e-12, "{number}");
        }
    }

    #[test]
    fn a_wall_lies_in_its_plane() {
        let normal = Vector3::new(2.0, -1.0, 2.0) / 3.0;
        let plane = ContactPlane { body: None, point: Vector3::new(0.1, 0.2, 0.3), normal };
        let wall = plane.wall(&Vector3::new(5.0, 4.0, 3.0), 2.0);
        assert_eq!(wall.lines.len(), 2 * ACROSS);
        for end in wall.lines.iter().flatten() {
            assert!(normal.dot(&(end - plane.point)).abs() < 1e-12, "{end}");
        }
    }
}
