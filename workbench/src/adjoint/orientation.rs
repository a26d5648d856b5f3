//! Adjoints of what [`lamc_runtime::free_body`] does with coordinates: of joints, and of free bodies with their quaternions.
//!
//! For a product of quaternions c = a b, the adjoints are a' = c' b* and b' = a* c': the transposed matrix of a
//! multiplication is that of the multiplication by the conjugate.

use lamc_runtime::free_body::{COORDINATES, SPEEDS};

/// Turns below this are taken by their series, rad: what is left out is less than rounding.
const SMALL: f64 = 1e-3;

/// The adjoints of a step of q, q -> [`advance`](lamc_runtime::free_body::advance): `adjoint` of the new q becomes that of
/// the old one, and `of_step` is written.
pub fn advance(q: &[f64], step: &[f64], joints: usize, adjoint: &mut [f64], of_step: &mut [f64]) {
    of_step[..joints].copy_from_slice(&adjoint[..joints]);
    for ((q, step), (adjoint, of_step)) in
        bodies(q, step, joints).zip(bodies_mut(adjoint, of_step, joints))
    {
        let ([.., w, x, y, z], [.., a, b, c]) = (*q, *step);
        let (p, turn) = ([w, x, y, z], [a, b, c]);
        let turned = quaternion(turn);
        let raw = product(p, turned);
        let back = unit(raw, quaternion_of(adjoint));
        set_quaternion(adjoint, product(back, conjugate(turned)));
        of_step[..3].copy_from_slice(&adjoint[..3]);
        of_step[3..].copy_from_slice(&turn_of(turn, product(conjugate(p), back)));
    }
}

/// The adjoints of dq/dt as [`write_rates`](lamc_runtime::free_body::write_rates) gives it, added to those of q and u.
pub fn rates(
    q: &[f64],
    u: &[f64],
    joints: usize,
    of_rates: &[f64],
    of_q: &mut [f64],
    of_u: &mut [f64],
) {
    of_u.iter_mut().zip(of_rates).take(joints).for_each(|(sum, share)| *sum += share);
    let given = of_rates[joints..].as_chunks::<COORDINATES>().0;
    for (((q, u), (of_q, of_u)), of_rates) in
        bodies(q, u, joints).zip(bodies_mut(of_q, of_u, joints)).zip(given)
    {
        let ([.., w, x, y, z], [.., a, b, c]) = (*q, *u);
        let from = quaternion_of(of_rates);
        let half = product(from, [0.0, -a / 2.0, -b / 2.0, -c / 2.0]);
        let [_, turn @ ..] = product(conjugate([w, x, y, z]), from);
        of_q[3..].iter_mut().zip(half).for_each(|(sum, share)| *sum += share);
        of_u[..3].iter_mut().zip(of_rates).for_each(|(sum, share)| *sum += share);
        of_u[3..].iter_mut().zip(turn).for_each(|(sum, share)| *sum += share / 2.0);
    }
}

/// The adjoint of q before it was [normalised](lamc_runtime::free_body::normalise), from the one after.
pub fn normalise(q: &[f64], joints: usize, adjoint: &mut [f64]) {
    let given = q[joints..].as_chunks::<COORDINATES>().0;
    for (q, adjoint) in given.iter().zip(adjoint[joints..].as_chunks_mut().0) {
        set_quaternion(adjoint, unit(quaternion_of(q), quaternion_of(adjoint)));
    }
}

/// Coordinates and speeds of the free bodies.
fn bodies<'a>(
    q: &'a [f64],
    u: &'a [f64],
    joints: usize,
) -> impl Iterator<Item = (&'a [f64; COORDINATES], &'a [f64; SPEEDS])> {
    q[joints..].as_chunks().0.iter().zip(u[joints..].as_chunks().0)
}

fn bodies_mut<'a>(
    q: &'a mut [f64],
    u: &'a mut [f64],
    joints: usize,
) -> impl Iterator<Item = (&'a mut [f64; COORDINATES], &'a mut [f64; SPEEDS])> {
    q[joints..].as_chunks_mut().0.iter_mut().zip(u[joints..].as_chunks_mut().0)
}

fn quaternion_of(&[_, _, _, w, x, y, z]: &[f64; COORDINATES]) -> [f64; 4] {
    [w, x, y, z]
}

fn set_quaternion(coordinates: &mut [f64; COORDINATES], to: [f64; 4]) {
    coordinates[3..].copy_from_slice(&to);
}

/// The adjoint of p from that of p / |p|.
fn unit(p: [f64; 4], adjoint: [f64; 4]) -> [f64; 4] {
    let square = p.iter().map(|x| x * x).sum::<f64>();
    let along = p.iter().zip(adjoint).map(|(x, share)| x * share).sum::<f64>() / square;
    let norm = square.sqrt();
    std::array::from_fn(|k| (adjoint[k] - along * p[k]) / norm)
}

/// The unit quaternion of a rotation vector, rad.
fn quaternion(turn: [f64; 3]) -> [f64; 4] {
    let [_, half, cosine] = shares(turn);
    let [x, y, z] = turn.map(|x| half * x);
    [cosine, x, y, z]
}

/// The adjoint of a rotation vector from that of its quaternion.
fn turn_of(turn: [f64; 3], [real, imaginary @ ..]: [f64; 4]) -> [f64; 3] {
    let [slope, half, _] = shares(turn);
    let along = turn.iter().zip(imaginary).map(|(x, share)| x * share).sum::<f64>();
    std::array::from_fn(|k| imaginary[k] * half + turn[k] * (along * slope - real * half / 2.0))
}

/// With the angle a: d/da (sin(a/2) / a) / a, then sin(a/2) / a, then cos(a/2).
fn shares(turn: [f64; 3]) -> [f64; 3] {
    let square = turn.iter().map(|x| x * x).sum::<f64>();
    let angle = square.sqrt();
    let (sine, cosine) = (angle / 2.0).sin_cos();
    if angle < SMALL {
        [-1.0 / 24.0 + square / 960.0, 0.5 - square / 48.0, cosine]
    } else {
        [(cosine / 2.0 - sine / angle) / square, sine / angle, cosine]
    }
}

/// Hamilton's product of two quaternions w x y z.
fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

fn conjugate([w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [w, -x, -y, -z]
}
