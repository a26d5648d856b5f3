//! Energy and angular momentum along a motion.

use lamc_runtime::Mechanism;
use lamc_workbench::verify::motions;
use nalgebra::Vector3;

use crate::compare::{keep_largest, largest};

use super::path::{PARTS, Path, rounding_steps, steps};
use super::subject::{NOTHING_MOVES, Pair, Point, Subject};
use super::work::{angular_momentum, mass, power};
use super::{Found, edits};

/// Parts of a motion between states at which the effect of errors of the integration is evaluated.
const APART: usize = 8;

/// The largest effect of errors of the integration on a function of the state.
fn doubt(path: &Path, of: &dyn Fn(&Point) -> f64) -> f64 {
    largest((0..=PARTS).step_by(APART).map(|k| path.spread(k, of)))
}

/// What errors of the integration change in the integral of a function of the state over the motion: those of each
/// stretch, as large as the larger of its ends.
fn integral(path: &Path, of: &dyn Fn(&Point) -> f64) -> f64 {
    let ends: Vec<_> = (0..=PARTS).step_by(APART).map(|k| path.spread(k, of)).collect();
    let stretch = path.duration * APART as f64 / PARTS as f64;
    ends.windows(2).map(|ends| stretch * largest(ends)).sum()
}

/// What rounding leaves of a sum over all bodies, as a share of its terms.
fn rounded(subject: &Subject) -> f64 {
    rounding_steps(subject) as f64 * f64::EPSILON
}

fn total(subject: &Subject, at: &Point) -> f64 {
    let energy = subject.system.energy(at.t, &at.q, &at.u);
    energy.map_or(f64::NAN, |energy| energy.kinetic + energy.potential)
}

/// The magnitudes of the terms of the energy, J: their rounding is that of the energy.
fn terms(subject: &Subject, at: &Point) -> f64 {
    let mechanism = &subject.compiled.topology.mechanism;
    let values = subject.values(at);
    let motions = motions(mechanism, &values);
    let gravity = Vector3::from_fn(|i, _| values.of(&mechanism.gravity[i]));
    let bodies = mechanism.bodies.iter().zip(&motions).filter(|(body, _)| !body.fixed);
    let weights = bodies.map(|(body, motion)| {
        let arm = motion.rotation * body.mass_properties.com;
        mass(body, &values) * gravity.norm() * (arm.norm() + motion.position.norm())
    });
    let weights: f64 = weights.sum();
    let kinetic = subject.system.energy(at.t, &at.q, &at.u).map_or(f64::NAN, |e| e.kinetic);
    weights + kinetic + (total(subject, at) - kinetic).abs()
}

/// The scale of a motion's energy, J: the largest T, and how far V goes.
fn scale(subject: &Subject, path: &Path) -> f64 {
    let energies: Vec<_> = path
        .precise
        .iter()
        .map(|at| subject.system.energy(at.t, &at.q, &at.u))
        .map(|energy| energy.map_or([f64::NAN; 2], |energy| [energy.kinetic, energy.potential]))
        .collect();
    let begin = energies[0][1];
    largest(energies.iter().map(|[kinetic, _]| kinetic))
        + largest(energies.iter().map(|[_, potential]| potential - begin))
}

/// The change of T + V with the work of everything, step by step by Gauss's rule. Allowed are the effect of errors
/// of the integration on energy and power, the error of the integral, and rounding.
pub fn energy(pair: &Pair, path: &Path) -> Result<Found, String> {
    let says = &pair.says;
    let steps = steps(&pair.moves.system, path)?;
    let end = &steps.last().ok_or(NOTHING_MOVES)?[4];
    let (mut work, mut off, mut exchanged) = (0.0, 0.0, 0.0);
    for step in &steps {
        let powers = step.each_ref().map(|at| power(says, at));
        let length = step[4].t - step[0].t;
        let gauss = length * (5.0 * powers[1] + 8.0 * powers[2] + 5.0 * powers[3]) / 18.0;
        let simpson = length * (powers[0] + 4.0 * powers[2] + powers[4]) / 6.0;
        work += gauss;
        // The error of Simpson's rule, which is of a lower order.
        off += (gauss - simpson).abs();
        exchanged += gauss.abs();
    }
    let change = total(says, end) - total(says, &path.precise[0]);
    let doubt = path.spread(PARTS, &|at| total(says, at))
        + integral(path, &|at| power(says, at))
        + off
        + path.rounded(says, &|at| total(says, at))
        + rounded(says) * (terms(says, &path.precise[0]) + terms(says, end) + exchanged);
    let scale = scale(says, path) + exchanged;
    let mut found = Found::NONE;
    found.add((change - work).abs() / scale, doubt / scale);
    Ok(found)
}

/// T + V along a motion on which nothing does work. Allowed are the effect of errors of the integration, and
/// rounding.
pub fn conserved(pair: &Pair, path: &Path) -> Result<Found, String> {
    let says = &pair.says;
    let begin = total(says, &path.precise[0]);
    let off = largest(path.precise.iter().map(|at| total(says, at) - begin));
    let terms = largest([0, PARTS / 2, PARTS].map(|k| terms(says, &path.precise[k])));
    let of = |at: &Point| total(says, at);
    let allowed = doubt(path, &of) + path.rounded(says, &of) + 2.0 * rounded(says) * terms;
    let scale = scale(says, path);
    Ok(Found { cases: PARTS, error: off / scale, allowed: allowed / scale })
}

/// The angular momentum about the axis of a turntable on which the whole mechanism stands, relative to the sum of
/// the magnitudes of its terms. Allowed are the effect of errors of the integration, and rounding.
pub fn momentum(plain: &Pair) -> Result<Found, String> {
    let pair = plain.edited(edits::turntable)?;
    let path = Path::of(&pair)?;
    let joints = &pair.says.compiled.topology.mechanism.joints;
    let table = joints.last().ok_or("there are no joints")?;
    let line = [table.point, table.direction];
    let of = |at: &Point| angular_momentum(&pair.says, at, line);
    let begin = of(&path.precise[0])[0];
    let (mut off, mut scale) = (0.0, 0.0);
    for [sum, magnitude] in path.precise.iter().map(of) {
        off = keep_largest(off, (sum - begin).abs());
        scale = keep_largest(scale, magnitude);
    }
    let sum = |at: &Point| of(at)[0];
    let allowed =
        doubt(&path, &sum) + path.rounded(&pair.says, &sum) + 2.0 * rounded(&pair.says) * scale;
    Ok(Found { cases: PARTS, error: off / scale, allowed: allowed / scale })
}
