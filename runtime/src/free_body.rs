//! The coordinates of free bodies: how steps and speeds change them.
//!
//! The angles of the joints come first in q and u. Each free body adds the displacement r of its centre of
//! mass and its orientation p, a unit quaternion w x y z from the body's frame to the base frame, to q; and the
//! velocity v of that centre in the base frame and the angular velocity w in the body's frame to u:
//!
//! ```text
//! dr/dt = v        dp/dt = p (0, w) / 2        p turned by s: p (cos |s| / 2, s / |s| sin |s| / 2)
//! ```
//!
//! Quaternions multiply as Hamilton's (J. Diebel, "Representing Attitude", 2006, sections 6.1 to 6.9).

use crate::Arithmetic;
use crate::constants::LEAST_TURN;

/// Coordinates of a free body: r, then p.
pub const COORDINATES: usize = 7;
/// Speeds of a free body: v, then w.
pub const SPEEDS: usize = 6;

/// The rows of W numbers behind those of the joints: of q or of u, one for each free body. Vectors that end before have
/// none: nothing here can panic, so that firmware does not contain what panics.
fn rows<S, const W: usize>(vector: &[S], joints: usize) -> &[[S; W]] {
    vector.get(joints..).unwrap_or_default().as_chunks().0
}

/// As [`rows`].
fn rows_mut<S, const W: usize>(vector: &mut [S], joints: usize) -> &mut [[S; W]] {
    vector.get_mut(joints..).unwrap_or_default().as_chunks_mut().0
}

/// The part of a vector along q that belongs to the free bodies.
fn coordinates<S>(q: &mut [S], joints: usize) -> &mut [[S; COORDINATES]] {
    rows_mut(q, joints)
}

/// The part of a vector along u that belongs to the free bodies.
fn speeds<S>(u: &[S], joints: usize) -> &[[S; SPEEDS]] {
    rows(u, joints)
}

/// q goes on by a step, as [`Mechanism::advance`](crate::Mechanism::advance) does.
pub fn advance<S: Arithmetic>(q: &mut [S], step: &[S], joints: usize) {
    for (q, &step) in q.iter_mut().zip(step).take(joints) {
        *q += step;
    }
    for (q, step) in coordinates(q, joints).iter_mut().zip(speeds(step, joints)) {
        let [rx, ry, rz, p @ ..] = *q;
        let [vx, vy, vz, turn @ ..] = *step;
        let [w, x, y, z] = product(p, quaternion(turn));
        *q = [rx + vx, ry + vy, rz + vz, w, x, y, z];
    }
    normalise(q, joints);
}

/// dq/dt, as [`Mechanism::write_rates`](crate::Mechanism::write_rates) does.
pub fn write_rates<S: Arithmetic>(q: &[S], u: &[S], out: &mut [S], joints: usize) {
    for (out, &u) in out.iter_mut().zip(u).take(joints) {
        *out = u;
    }
    let half = S::from_f64(0.5);
    let bodies = rows::<S, COORDINATES>(q, joints).iter().zip(speeds(u, joints));
    for (out, (q, u)) in coordinates(out, joints).iter_mut().zip(bodies) {
        let [_, _, _, p @ ..] = *q;
        let [vx, vy, vz, a, b, c] = *u;
        let [w, x, y, z] = product(p, [S::ZERO, half * a, half * b, half * c]);
        *out = [vx, vy, vz, w, x, y, z];
    }
}

/// The step from one q to another, as [`Mechanism::write_difference`](crate::Mechanism::write_difference)
/// does: the shorter way around.
pub fn write_difference<S: Arithmetic>(from: &[S], to: &[S], out: &mut [S], joints: usize) {
    for ((out, &from), &to) in out.iter_mut().zip(from).zip(to).take(joints) {
        *out = to - from;
    }
    let bodies = |q| rows::<S, COORDINATES>(q, joints);
    let pairs = bodies(from).iter().zip(bodies(to));
    for (out, (from, to)) in rows_mut::<S, SPEEDS>(out, joints).iter_mut().zip(pairs) {
        let ([fx, fy, fz, p @ ..], [tx, ty, tz, other @ ..]) = (*from, *to);
        let [a, b, c] = rotation(product(conjugate(p), other));
        *out = [tx - fx, ty - fy, tz - fz, a, b, c];
    }
}

/// Brings the quaternions to norm one, as [`Mechanism::normalise`](crate::Mechanism::normalise) does.
pub fn normalise<S: Arithmetic>(q: &mut [S], joints: usize) {
    for [_, _, _, p @ ..] in coordinates(q, joints) {
        let norm = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]).sqrt();
        p.iter_mut().for_each(|p| *p = *p / norm);
    }
}

/// The largest component of a step or of speeds: of angles in rad, and of the translations of free bodies over a
/// length, m.
pub fn extent<S: Arithmetic>(step: &[S], joints: usize, length: S) -> S {
    let angles = step.get(..joints).unwrap_or(step);
    let largest = |parts: &[S], unit: S| {
        parts.iter().fold(S::ZERO, |most, &part| most.max((part / unit).abs()))
    };
    speeds(step, joints).iter().fold(largest(angles, S::ONE), |most, body| {
        let [vx, vy, vz, turn @ ..] = *body;
        most.max(largest(&[vx, vy, vz], length)).max(largest(&turn, S::ONE))
    })
}

/// Hamilton's product of two quaternions w x y z.
fn product<S: Arithmetic>(a: [S; 4], b: [S; 4]) -> [S; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

fn conjugate<S: Arithmetic>([w, x, y, z]: [S; 4]) -> [S; 4] {
    [w, -x, -y, -z]
}

/// The length of a vector, but not zero.
fn length<S: Arithmetic>([x, y, z]: [S; 3]) -> S {
    (x * x + y * y + z * z).sqrt().max(S::from_f64(LEAST_TURN))
}

/// The unit quaternion of a rotation vector, rad.
fn quaternion<S: Arithmetic>(turn: [S; 3]) -> [S; 4] {
    let angle = length(turn);
    let (sine, cosine) = (angle * S::from_f64(0.5)).sin_cos();
    let [x, y, z] = turn.map(|x| x * (sine / angle));
    [cosine, x, y, z]
}

/// The rotation vector of a unit quaternion, of at most half a turn, rad.
fn rotation<S: Arithmetic>([w, x, y, z]: [S; 4]) -> [S; 3] {
    // A quaternion and its negative are the same rotation.
    let sign = S::from_f64(2.0) * w.step() - S::ONE;
    let sine = length([x, y, z]);
    let angle = S::from_f64(2.0) * sine.atan2(sign * w);
    [x, y, z].map(|x| sign * x * (angle / sine))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint and two free bodies.
    fn state(turns: [[f64; 3]; 2]) -> [f64; 15] {
        let mut q = [0.5, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0];
        q[4..8].copy_from_slice(&quaternion(turns[0]));
        q[11..].copy_from_slice(&quaternion(turns[1]));
        q
    }

    #[test]
    fn a_difference_is_the_step_that_was_taken() {
        let step = [0.2, 1.0, -2.0, 0.5, 0.3, -1.2, 2.0, 0.0, 0.0, 0.0, -0.1, 0.2, -1e-9];
        let from = state([[1.0, 0.4, -2.0], [0.0; 3]]);
        let mut to = from;
        advance(&mut to, &step, 1);
        let mut back = [f64::NAN; 13];
        write_difference(&from, &to, &mut back, 1);
        for (back, step) in back.iter().zip(step) {
            assert!((back - step).abs() <= 1e-15, "{back} {step}");
        }
        // The negative quaternion is the same orientation.
        to[4..8].iter_mut().for_each(|p| *p = -*p);
        let mut same = [f64::NAN; 13];
        write_difference(&from, &to, &mut same, 1);
        for (same, back) in same.iter().zip(back) {
            assert!((same - back).abs() <= 1e-15, "{same} {back}");
        }
    }

    #[test]
    fn rates_are_the_limit_of_small_steps() {
        let u = [0.7, 1.0, -2.0, 0.5, 0.3, -1.2, 2.0, 3.0, 4.0, 5.0, -0.1, 0.2, 0.9];
        let q = state([[1.0, 0.4, -2.0], [-0.3, 0.1, 0.2]]);
        let mut rates = [f64::NAN; 15];
        write_rates(&q, &u, &mut rates, 1);
        let h = 1e-5;
        let at = |h: f64| {
            let mut q = q;
            advance(&mut q, &u.map(|u| h * u), 1);
            q
        };
        let (before, after) = (at(-h), at(h));
        for i in 0..15 {
            let difference = (after[i] - before[i]) / (2.0 * h);
            assert!((rates[i] - difference).abs() <= 1e-9, "{i}: {} {difference}", rates[i]);
        }
    }

    /// Firmware contains no code that panics; lengths are checked where a module is called.
    #[test]
    fn vectors_that_are_too_short_do_not_panic() {
        for len in 0..3 {
            let (mut out, short) = ([f64::NAN; 3], [0.5; 3]);
            advance(&mut out[..len], &short[..len], 2);
            write_rates(&short[..len], &short[..len], &mut out[..len], 2);
            write_difference(&short[..len], &short[..len], &mut out[..len], 2);
            normalise(&mut out[..len], 2);
            assert_eq!(extent(&short[..len], 2, 1.0), if len == 0 { 0.0 } else { 0.5 });
        }
    }

    #[test]
    fn turns_add_about_one_axis_and_keep_norm_one() {
        let mut q = state([[0.0; 3]; 2]);
        for _ in 0..1000 {
            advance(&mut q, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 1);
        }
        let [w, z] = [q[4], q[7]];
        assert!((w - 5.0_f64.cos()).abs() <= 1e-13 && (z - 5.0_f64.sin()).abs() <= 1e-13);
        assert_eq!((q[5], q[6]), (0.0, 0.0));
    }
}
