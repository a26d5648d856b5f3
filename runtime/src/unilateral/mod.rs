//! One-sided constraints at a state: contact points that do not enter planes, joints that stay within their limits.
//!
//! ```text
//! gap_i >= 0             G_i u: the velocity of point i relative to the body of its plane
//! least <= q_j <= greatest
//! ```
//!
//! Their rows are weighted as those of the closure are, W = G L^-T with M = L L^T, and what they have in common with the
//! closure's is taken out: impulses P change y = L^T u by W^T P, and the loops do not see them.

mod exact;
mod solve;

use exact::{Exact, exact_len};

use crate::linear::{add_scaled, dot, forward, tolerance};
use crate::plumbing::{Dimensions, GapsMut};
use crate::workspace::split;
use crate::{Error, Mechanism, Scalar};

/// A row that is shorter than this share of what it was before the closure was taken out is rounding: the loops hold
/// the point or the joint. In `f32`, this many epsilons.
const HELD: (f64, f64) = (1e-10, 64.0);
/// A gap that is negative by this share of the mechanism's size is rounding, and is not corrected. In `f32`, this many
/// epsilons.
const TOUCHING: (f64, f64) = (1e-14, 4.0);

/// Numbers per contact point, besides its rows.
const PER_POINT: usize = 23;
/// Numbers per joint, besides its row.
const PER_JOINT: usize = 8;

/// How many numbers [`Unilateral`] needs beside two matrices.
pub(crate) const fn unilateral_len(d: Dimensions) -> usize {
    let n = d.speeds;
    d.contacts * (3 * n + PER_POINT) + d.joints * (n + PER_JOINT) + exact_len(n)
}

/// The one-sided constraints of a mechanism at a state.
pub(crate) struct Unilateral<'a, S> {
    n: usize,
    /// Of each contact point, kept from step to step: the force on its body in the base frame, N.
    forces: &'a mut [[S; 3]],
    /// Of each joint, kept from step to step: the torque of its stop, N m.
    torques: &'a mut [S],
    points: Points<'a, S>,
    stops: Stops<'a, S>,
    /// Room to make products of rows with y exact.
    exact: Exact<'a, S>,
    /// What the compliant law of the contacts says: position and force of each point.
    law: &'a mut [S],
}

/// Contact points. The three components of a vector are along the normal and two tangents of the plane.
struct Points<'a, S> {
    /// Height over the plane, m, infinite beyond the edges of the plane; then the least velocity along the normal, m/s,
    /// or the least displacement, m.
    gaps: &'a mut [[S; 2]],
    /// mu.
    friction: &'a mut [S],
    /// Unit normals, in the base frame.
    normals: &'a mut [[S; 3]],
    /// 1 / |w|^2 of the normal's row, and 1 / the larger eigenvalue of the tangents' w w^T, kg; 0 of what the loops hold.
    inertias: &'a mut [[S; 2]],
    /// P, N s; of displacements kg m.
    impulses: &'a mut [[S; 3]],
    /// The place of each row among those of [`Exact`], from 1 on; 0 if it is not there.
    places: &'a mut [[S; 3]],
    /// W, 3 x N for each point.
    rows: &'a mut [S],
}

/// Limits of joints.
struct Stops<'a, S> {
    /// How far the joint may turn, rad: down to the least angle, up to the greatest.
    ranges: &'a mut [[S; 2]],
    /// The least and the greatest velocity, rad/s, or displacement, rad.
    bounds: &'a mut [[S; 2]],
    /// 1 / |w|^2, kg m^2; 0 without limits, or if the loops hold the joint.
    inertias: &'a mut [S],
    /// P, N m s, positive at the least angle.
    impulses: &'a mut [S],
    /// As of points.
    places: &'a mut [S],
    /// W, a row of N for each joint.
    rows: &'a mut [S],
}

/// Cuts vectors of three (or two) off a workspace.
fn split_vectors<'a, S, const K: usize>(
    workspace: &mut &'a mut [S],
    count: usize,
) -> Result<&'a mut [[S; K]], Error> {
    Ok(split(workspace, K * count)?.as_chunks_mut().0)
}

impl<'a, S: Scalar> Unilateral<'a, S> {
    /// Divides [`unilateral_len`] numbers, the first of which are those that [`forces`](Self::forces) shows. The
    /// matrices are N x N.
    pub fn new(
        d: Dimensions,
        mut storage: &'a mut [S],
        matrices: [&'a mut [S]; 2],
    ) -> Result<Self, Error> {
        let (n, k, joints) = (d.speeds, d.contacts, d.joints);
        let storage = &mut storage;
        Ok(Self {
            n,
            forces: split_vectors(storage, k)?,
            torques: split(storage, joints)?,
            points: Points {
                gaps: split_vectors(storage, k)?,
                friction: split(storage, k)?,
                normals: split_vectors(storage, k)?,
                inertias: split_vectors(storage, k)?,
                impulses: split_vectors(storage, k)?,
                places: split_vectors(storage, k)?,
                rows: split(storage, 3 * k * n)?,
            },
            stops: Stops {
                ranges: split_vectors(storage, joints)?,
                bounds: split_vectors(storage, joints)?,
                inertias: split(storage, joints)?,
                impulses: split(storage, joints)?,
                places: split(storage, joints)?,
                rows: split(storage, joints * n)?,
            },
            exact: Exact::new(n, storage, matrices)?,
            law: split(storage, 6 * k)?,
        })
    }

    /// Reads gaps and rows at a state, and takes the compliant law of the contacts out of the generalised forces.
    pub fn read<Y: Mechanism<Scalar = S>>(
        &mut self,
        system: &Y,
        (t, q, u): (S, &[S], &[S]),
        forcing: &mut [S],
    ) -> Result<(), Error> {
        let Points { gaps, friction, normals, rows, .. } = &mut self.points;
        let normal = normals.as_flattened_mut();
        let out = GapsMut { gap: gaps.as_flattened_mut(), friction, normal, rows };
        system.write_gaps(t, q, out)?;
        system.write_contacts(t, q, u, self.law)?;
        let law = self.law.as_chunks::<6>().0.iter();
        let points = self.points.rows.chunks_exact_mut((3 * self.n).max(1));
        for ((rows, normal), &[_, _, _, force @ ..]) in points.zip(&*self.points.normals).zip(law) {
            for (row, force) in rows.chunks_exact(self.n.max(1)).zip(force) {
                add_scaled(forcing, -force, row);
            }
            turn(rows, axes(*normal));
        }
        for gap in &mut *self.points.gaps {
            let [height, within] = *gap;
            // Behind an edge, or nearer to an edge or to the back of a plate than to its face, nothing touches.
            let is_over = within > S::ZERO && height + within > S::ZERO;
            *gap = [if is_over { height } else { S::from_f64(f64::INFINITY) }, S::ZERO];
        }
        for (joint, (range, &q)) in self.stops.ranges.iter_mut().zip(q).enumerate() {
            *range = system.limits(joint).map(|limit| limit - q);
        }
        self.stops.rows.fill(S::ZERO);
        let rows = self.stops.rows.chunks_exact_mut(self.n.max(1));
        for (joint, row) in rows.enumerate() {
            if let Some(entry) = row.get_mut(joint) {
                *entry = S::ONE;
            }
        }
        Ok(())
    }

    /// Weights the rows with the factor of M, and takes orthogonal rows of the closure out of them.
    pub fn weigh(&mut self, mass: &[S], closure: &[S]) {
        let n = self.n;
        let points = &mut self.points;
        let rows = points.rows.chunks_exact_mut((3 * n).max(1));
        for ((rows, inertia), &[gap, _]) in rows.zip(&mut *points.inertias).zip(&*points.gaps) {
            *inertia = [S::ZERO; 2];
            if !gap.is_finite() {
                continue;
            }
            rows.chunks_exact_mut(n.max(1)).for_each(|row| weigh(row, mass, closure));
            let mut rows = rows.chunks_exact(n.max(1));
            let (Some(normal), Some(first), Some(second)) = (rows.next(), rows.next(), rows.next())
            else {
                continue;
            };
            let [a, b, c] = [dot(first, first), dot(first, second), dot(second, second)];
            let half = S::from_f64(0.5);
            let largest = half * (a + c + ((a - c) * (a - c) + S::from_f64(4.0) * b * b).sqrt());
            *inertia = [reciprocal(dot(normal, normal)), reciprocal(largest)];
        }
        let stops = &mut self.stops;
        let rows = stops.rows.chunks_exact_mut(n.max(1));
        for ((row, inertia), range) in rows.zip(&mut *stops.inertias).zip(&*stops.ranges) {
            *inertia = S::ZERO;
            if range.iter().any(|limit| limit.is_finite()) {
                weigh(row, mass, closure);
                *inertia = reciprocal(dot(row, row));
            }
        }
    }

    /// Whether something is where it must not be, by more than rounding.
    pub fn overlaps(&self, size: S) -> bool {
        let (length, angle) = (touching::<S>() * size, touching::<S>());
        self.points.gaps.iter().any(|&[gap, _]| gap < -length)
            || self.stops.ranges.iter().any(|&[least, most]| least > angle || most < -angle)
    }

    /// The least displacement, by y = L^T dq from zero on, after which nothing overlaps, without friction.
    pub fn separate(&mut self, y: &mut [S]) {
        y.fill(S::ZERO);
        self.points.gaps.iter_mut().for_each(|[gap, bound]| *bound = -*gap);
        let bounds = self.stops.bounds.iter_mut().zip(&*self.stops.ranges);
        bounds.for_each(|(bound, range)| *bound = *range);
        self.rest();
        self.solve(y, false);
    }

    /// Changes y = L^T u by the impulses of contacts and stops in a step of `dt` (s), which starts from the forces of the
    /// step before. Returns whether they fulfil all conditions.
    pub fn meet(&mut self, y: &mut [S], dt: S) -> bool {
        for [gap, bound] in &mut *self.points.gaps {
            *bound = -gap.max(S::ZERO) / dt;
        }
        for (bound, &[least, most]) in self.stops.bounds.iter_mut().zip(&*self.stops.ranges) {
            *bound = [least.min(S::ZERO) / dt, most.max(S::ZERO) / dt];
        }
        let guesses = self.forces.iter().zip(&*self.points.normals);
        for (impulse, (force, normal)) in self.points.impulses.iter_mut().zip(guesses) {
            let local = axes(*normal).map(|axis| dt * dot(&axis, force));
            *impulse = if local.iter().all(|x| x.is_finite()) { local } else { [S::ZERO; 3] };
        }
        for (impulse, &torque) in self.stops.impulses.iter_mut().zip(&*self.torques) {
            *impulse = if torque.is_finite() { dt * torque } else { S::ZERO };
        }
        let is_found = self.solve(y, true);
        self.forces.fill([S::ZERO; 3]);
        self.torques.fill(S::ZERO);
        self.add_forces(dt);
        is_found
    }

    /// After [`meet`](Self::meet): what met with at least `threshold` over the restitution, m/s or rad/s, leaves again.
    /// `before` is L^T u of before the step. Returns whether the impulses fulfil all conditions.
    pub fn rebound(
        &mut self,
        y: &mut [S],
        before: &[S],
        [restitution, threshold]: [S; 2],
        dt: S,
    ) -> bool {
        let n = self.n;
        let away = |row: &[S]| {
            let away = -restitution * dot(row, before);
            (away.abs() > threshold).then_some(away)
        };
        let rows = self.points.rows.chunks_exact((3 * n).max(1));
        for ((rows, impulse), [_, bound]) in
            rows.zip(&*self.points.impulses).zip(&mut *self.points.gaps)
        {
            let [push, ..] = *impulse;
            if push > S::ZERO {
                let away = rows.get(..n).and_then(away).unwrap_or(S::ZERO);
                *bound = away.max(*bound);
            }
        }
        let rows = self.stops.rows.chunks_exact(n.max(1));
        for ((row, &impulse), [least, most]) in
            rows.zip(&*self.stops.impulses).zip(&mut *self.stops.bounds)
        {
            let away = away(row).unwrap_or(S::ZERO);
            if impulse > S::ZERO {
                *least = away.max(*least);
            } else if impulse < S::ZERO {
                *most = away.min(*most);
            }
        }
        self.rest();
        let is_found = self.solve(y, true);
        self.add_forces(dt);
        is_found
    }

    /// The force on the body of each point in the base frame, N, and the torque of each stop, N m, that the storage holds.
    pub fn forces(d: Dimensions, mut storage: &[S]) -> (&[[S; 3]], &[S]) {
        let points = storage.get(..3 * d.contacts).unwrap_or_default();
        storage = storage.get(3 * d.contacts..).unwrap_or_default();
        (points.as_chunks().0, storage.get(..d.joints).unwrap_or_default())
    }

    /// Impulses become zero.
    fn rest(&mut self) {
        self.points.impulses.fill([S::ZERO; 3]);
        self.stops.impulses.fill(S::ZERO);
    }

    /// Adds the forces that have the present impulses in a time.
    fn add_forces(&mut self, dt: S) {
        let points = self.points.impulses.iter().zip(&*self.points.normals);
        for (force, (impulse, normal)) in self.forces.iter_mut().zip(points) {
            for (axis, &part) in axes(*normal).iter().zip(impulse) {
                add_scaled(force, part / dt, axis);
            }
        }
        for (torque, &impulse) in self.torques.iter_mut().zip(&*self.stops.impulses) {
            *torque += impulse / dt;
        }
    }
}

fn touching<S: Scalar>() -> S {
    tolerance(TOUCHING.0, TOUCHING.1)
}

/// 1 / x, and 0 of 0.
fn reciprocal<S: Scalar>(x: S) -> S {
    if x > S::ZERO { S::ONE / x } else { S::ZERO }
}

/// A row becomes L^-1 row without what it has in common with the orthogonal rows of the closure; zero if they hold it.
fn weigh<S: Scalar>(row: &mut [S], mass: &[S], closure: &[S]) {
    forward(mass, row);
    let before = dot(row, row);
    for held in closure.chunks_exact(row.len().max(1)) {
        add_scaled(row, -dot(row, held) / dot(held, held), held);
    }
    let least: S = tolerance(HELD.0, HELD.1);
    if dot(row, row) <= least * least * before {
        row.fill(S::ZERO);
    }
}

/// The normal and two tangents (T. Duff and others, "Building an Orthonormal Basis, Revisited", 2017).
fn axes<S: Scalar>(normal: [S; 3]) -> [[S; 3]; 3] {
    let [x, y, z] = normal;
    let sign = if z < S::ZERO { -S::ONE } else { S::ONE };
    let a = -S::ONE / (sign + z);
    let b = x * y * a;
    [normal, [S::ONE + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y]]
}

/// Three rows along the axes of the base frame become rows along these axes.
fn turn<S: Scalar>(rows: &mut [S], axes: [[S; 3]; 3]) {
    let n = rows.len() / 3;
    let mut rows = rows.chunks_exact_mut(n.max(1));
    let (Some(first), Some(second), Some(third)) = (rows.next(), rows.next(), rows.next()) else {
        return;
    };
    for ((a, b), c) in first.iter_mut().zip(second).zip(third) {
        let [x, y, z] = axes.map(|axis| dot(&axis, &[*a, *b, *c]));
        (*a, *b, *c) = (x, y, z);
    }
}
