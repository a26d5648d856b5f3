//! Deviations of one configuration from another, and how they change.
//!
//! A deviation has one number for each speed: the step of [`Mechanism::advance`] from one q to the other, with the
//! displacements of free bodies divided by the mechanism's size, so that all numbers are angles. The orientation of
//! a free body deviates by the rotation vector s, in the body's frame, of the shorter way around. If the body turns
//! by a small vector x in its own frame, then with the angle a = |s|
//!
//! ```text
//! of the turn exp(s):   x  = ds - (1 - cos a) / a^2  s x ds + (a - sin a) / a^3  s x (s x ds)
//! of the vector s:      ds = x + (s x x) / 2 + (1 - (a / 2) cot(a / 2)) / a^2  s x (s x x)
//! ```
//!
//! (J. Sola, J. Deray, D. Atchuthan, "A micro Lie theory for state estimation in robotics", 2018, equations 143 and
//! 144: the right Jacobian of SO(3) and its inverse.)

use lamc_runtime::Mechanism;
use lamc_runtime::free_body::{COORDINATES, SPEEDS};

/// Below this angle, rad, the coefficients are those of their series: what is left out is less than rounding.
const SMALL: f64 = 1e-2;

/// Writes the deviation of `to` from `from`, rad.
pub fn write_deviation<Y: Mechanism<Scalar = f64>>(
    system: &Y,
    from: &[f64],
    to: &[f64],
    out: &mut [f64],
) {
    system.write_difference(from, to, out);
    let (joints, size) = (system.dimensions().joints, system.size());
    for body in out[joints..].as_chunks_mut::<SPEEDS>().0 {
        body[..3].iter_mut().for_each(|part| *part /= size);
    }
}

/// How component `k` of a deviation changes if the second configuration moves along `direction`, NU.
pub fn deviation_rate<Y: Mechanism<Scalar = f64>>(
    system: &Y,
    deviation: &[f64],
    direction: &[f64],
    k: usize,
) -> f64 {
    match part_of(system, k) {
        Part::Joint => direction[k],
        Part::Displacement => direction[k] / system.size(),
        Part::Turn { first } => {
            let (s, x) = (vector(deviation, first), vector(direction, first));
            let once = cross(s, x);
            let twice = cross(s, once);
            let c = k - first;
            x[c] + once[c] / 2.0 + of_vector(norm(s)) * twice[c]
        }
    }
}

/// The direction, NU, along which a configuration moves that is a `step` from another, if component `k` of the step
/// changes.
pub fn step_rate<Y: Mechanism<Scalar = f64>>(system: &Y, step: &[f64], k: usize) -> Vec<f64> {
    let mut direction = vec![0.0; step.len()];
    direction[k] = 1.0;
    if let Part::Turn { first } = part_of(system, k) {
        let (s, ds) = (vector(step, first), vector(&direction, first));
        let once = cross(s, ds);
        let twice = cross(s, once);
        let [by_once, by_twice] = of_turn(norm(s));
        for c in 0..3 {
            direction[first + c] = ds[c] - by_once * once[c] + by_twice * twice[c];
        }
    }
    direction
}

/// d/dt of a direction along q, NU, that a motion carries with it: du, and less w x dq where a body turns, since w is
/// in the body's own frame.
pub fn write_direction_rate(u: &[f64], dq: &[f64], du: &[f64], joints: usize, out: &mut [f64]) {
    out.copy_from_slice(du);
    for first in turns(joints, u.len()) {
        let turned = cross(vector(u, first), vector(dq, first));
        for c in 0..3 {
            out[first + c] -= turned[c];
        }
    }
}

/// The coordinate that must have been measured for component `k` of a deviation. An orientation is measured as a
/// whole or not at all.
pub fn coordinate_of(k: usize, joints: usize) -> usize {
    let Some(beyond) = k.checked_sub(joints) else { return k };
    joints + COORDINATES * (beyond / SPEEDS) + (beyond % SPEEDS).min(3)
}

/// What a component of a deviation or a direction belongs to.
enum Part {
    Joint,
    Displacement,
    /// `first` is the first of the three components of the orientation.
    Turn {
        first: usize,
    },
}

fn part_of<Y: Mechanism<Scalar = f64>>(system: &Y, k: usize) -> Part {
    match k.checked_sub(system.dimensions().joints) {
        None => Part::Joint,
        Some(beyond) if beyond % SPEEDS < 3 => Part::Displacement,
        Some(beyond) => Part::Turn { first: k - (beyond % SPEEDS - 3) },
    }
}

/// The first components of the orientations.
fn turns(joints: usize, speeds: usize) -> impl Iterator<Item = usize> {
    (joints + 3..speeds).step_by(SPEEDS)
}

fn vector(all: &[f64], first: usize) -> [f64; 3] {
    [all[first], all[first + 1], all[first + 2]]
}

fn cross([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

fn norm(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// (1 - cos a) / a^2 and (a - sin a) / a^3.
fn of_turn(a: f64) -> [f64; 2] {
    let square = a * a;
    if a < SMALL {
        return [
            0.5 - square / 24.0 + square * square / 720.0,
            1.0 / 6.0 - square / 120.0 + square * square / 5040.0,
        ];
    }
    let half = (a / 2.0).sin();
    [2.0 * half * half / square, (a - a.sin()) / (square * a)]
}

/// (1 - (a / 2) cot(a / 2)) / a^2.
fn of_vector(a: f64) -> f64 {
    let square = a * a;
    if a < SMALL {
        return 1.0 / 12.0 + square / 720.0 + square * square / 30240.0;
    }
    (1.0 - a / 2.0 / (a / 2.0).tan()) / square
}
