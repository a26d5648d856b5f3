//! How far a point passes from given ones while a joint is turned.
//!
//! For a path that is timed, the error of a target is the vector from it to the point. Else it is the distance from the
//! nearest point of the path, where (x - target) . dx/dq_d = 0: with the design, the distance changes as the path moves
//! across itself, n . dx, whatever the angle of the nearest point does. In a plane the distance has a sign, so that it is
//! smooth where it vanishes.

use lamc_runtime::Mechanism as _;
use nalgebra::{DMatrix, RowDVector};

use super::design::Design;
use super::drive::{Closed, Driven};
use super::goals::{Path, Target};
use super::number::Number;

/// Samples of a path among which the nearest to a target is looked for are at most this far apart, rad.
pub const STEP: f64 = 0.05;

/// A path as it is.
#[derive(Clone, Debug)]
pub struct Traced {
    /// For each target the parts of its error, m.
    pub errors: Vec<Vec<Number>>,
    /// How far joints exceed their limits, at most, rad; not positive if they keep them.
    pub limits: Vec<(usize, Number)>,
}

/// A state on the path.
struct Place {
    state: Closed,
    /// The point, by the axes of the path, m.
    at: Vec<f64>,
    /// Its derivative by the angle of the joint, m/rad.
    along: Vec<f64>,
}

/// Turns the joint of a path.
///
/// # Errors
/// The mechanism does not close in the whole range; the text says where.
pub fn trace(path: &Path, design: &Design<'_>) -> Result<Traced, String> {
    let driven = Driven::new(&design.system, path.joint);
    let tracer = Tracer { path, design, driven };
    match path.timed {
        true => tracer.timed(),
        false => tracer.untimed(),
    }
}

struct Tracer<'t> {
    path: &'t Path,
    design: &'t Design<'t>,
    driven: Driven<'t>,
}

impl Tracer<'_> {
    fn timed(&self) -> Result<Traced, String> {
        let angles: Vec<f64> = self.path.targets.iter().map(|target| target.angle).collect();
        let states = self.driven.states(&self.driven.start()?, &angles)?;
        let mut errors = Vec::with_capacity(states.len());
        for (state, target) in states.iter().zip(&self.path.targets) {
            errors.push(self.error(state, target)?);
        }
        Ok(Traced { errors, limits: self.limits(&states)? })
    }

    /// The vector from a target to the point.
    fn error(&self, state: &Closed, target: &Target) -> Result<Vec<Number>, String> {
        let follows = self.driven.follows(self.design, state)?;
        let (at, moves) = self.design.point(self.path.point, &state.q, &follows);
        let wanted = self.path.axes.iter().zip(&target.at).filter(|(_, wanted)| !wanted.is_nan());
        let part = |(axis, wanted): (&usize, &f64)| Number {
            value: at[*axis] - wanted,
            slope: moves.row(*axis).into_owned(),
        };
        Ok(wanted.map(part).collect())
    }

    fn untimed(&self) -> Result<Traced, String> {
        let states = self.driven.sweep(self.path.angles, STEP)?;
        let places: Vec<Place> =
            states.iter().map(|state| self.place(state)).collect::<Result<_, _>>()?;
        let mut errors = Vec::with_capacity(self.path.targets.len());
        for target in &self.path.targets {
            errors.push(self.distance(&places, target)?);
        }
        Ok(Traced { errors, limits: self.limits(&states)? })
    }

    fn place(&self, state: &Closed) -> Result<Place, String> {
        let tangent = self.driven.tangent(state).ok_or("the mechanism is in a singular state")?;
        let (at, along) = self.design.point_along(self.path.point, &state.q, &tangent);
        let axes = || self.path.axes.iter();
        Ok(Place {
            state: state.clone(),
            at: axes().map(|axis| at[*axis]).collect(),
            along: axes().map(|axis| along[(*axis, 0)]).collect(),
        })
    }

    /// The distance of a target from the path between these places.
    fn distance(&self, places: &[Place], target: &Target) -> Result<Vec<Number>, String> {
        let away =
            |place: &Place| offset(place, target).iter().map(|part| part * part).sum::<f64>();
        let nearest =
            (0..places.len()).min_by(|a, b| away(&places[*a]).total_cmp(&away(&places[*b])));
        let nearest = nearest.ok_or("the path is empty")?;
        // On the way of the joint, the target is ahead or behind.
        let forward = (self.path.angles[1] - self.path.angles[0]).signum();
        let is_ahead = forward * slope(&places[nearest], target) < 0.0;
        let other = if is_ahead { nearest + 1 } else { nearest.wrapping_sub(1) };
        let (place, is_inside) = match places.get(other) {
            Some(other) => {
                let ends = [&places[nearest].state, &other.state];
                // The other place may lie behind a maximum of the distance: then the nearest sample is as good.
                let root =
                    self.driven.root(ends, |state| Ok(slope(&self.place(state)?, target)))?;
                (self.place(&root)?, true)
            }
            None => (self.place(&places[nearest].state)?, false),
        };
        let follows = self.driven.follows(self.design, &place.state)?;
        let (_, moves) = self.design.point(self.path.point, &place.state.q, &follows);
        let moves = moves.select_rows(&self.path.axes);
        Ok(apart(&place, &offset(&place, target), &moves, is_inside))
    }

    /// The largest excess of each joint with limits.
    fn limits(&self, states: &[Closed]) -> Result<Vec<(usize, Number)>, String> {
        let system = &self.design.system;
        let mut limits = Vec::new();
        for joint in 0..system.dimensions().joints {
            let [lower, upper] = system.limits(joint);
            let mut ends = Vec::new();
            ends.extend(lower.is_finite().then_some((-1.0, lower)));
            ends.extend(upper.is_finite().then_some((1.0, upper)));
            for (sign, end) in ends {
                let excess = |state: &Closed| sign * (state.q[joint] - end);
                let worst = states.iter().max_by(|a, b| excess(a).total_cmp(&excess(b)));
                let Some(worst) = worst else { continue };
                let follows = self.driven.follows(self.design, worst)?;
                let slope = sign * follows.row(joint);
                limits.push((joint, Number { value: excess(worst), slope }));
            }
        }
        Ok(limits)
    }
}

/// The vector from a target to a place.
fn offset(place: &Place, target: &Target) -> Vec<f64> {
    place.at.iter().zip(&target.at).map(|(at, wanted)| at - wanted).collect()
}

/// Half the derivative of the squared distance by the angle.
fn slope(place: &Place, target: &Target) -> f64 {
    offset(place, target).iter().zip(&place.along).map(|(part, along)| part * along).sum()
}

/// The distance of a place from its target; in a plane with a sign, in space as a vector.
fn apart(place: &Place, offset: &[f64], moves: &DMatrix<f64>, is_inside: bool) -> Vec<Number> {
    let speed = place.along.iter().map(|along| along * along).sum::<f64>().sqrt();
    let row = |weights: &[f64]| -> RowDVector<f64> {
        let mut sum = RowDVector::zeros(moves.ncols());
        weights.iter().enumerate().for_each(|(axis, weight)| sum += *weight * moves.row(axis));
        sum
    };
    let &[ex, ey] = offset else {
        // What the path moves along itself does not count.
        let along: Vec<f64> = place.along.iter().map(|along| along / speed).collect();
        let share = if is_inside { row(&along) } else { RowDVector::zeros(moves.ncols()) };
        let parts = offset.iter().enumerate().map(|(axis, value)| Number {
            value: *value,
            slope: moves.row(axis) - along[axis] * &share,
        });
        return parts.collect();
    };
    let normal = [-place.along[1] / speed, place.along[0] / speed];
    let across = normal[0] * ex + normal[1] * ey;
    if is_inside {
        return vec![Number { value: across, slope: row(&normal) }];
    }
    let distance = ex.hypot(ey).copysign(across);
    let weights = if distance == 0.0 { normal } else { [ex / distance, ey / distance] };
    vec![Number { value: distance, slope: row(&weights) }]
}
