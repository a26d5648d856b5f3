//! Impulses that keep one-sided constraints: projected Gauss-Seidel, and what it decides made exact.
//!
//! For each point in turn, with w its velocity and b its bound,
//!
//! ```text
//! P_n = max(0, P_n - (w_n - b) / W_n W_n^T)          0 <= P_n  and  w_n >= b, one of them an equality
//! P_t = (P_t - w_t / lambda) shortened to mu P_n     against the sliding velocity where that is not zero
//! ```
//!
//! where lambda is the larger eigenvalue of the tangents' W_t W_t^T. What this leaves unchanged is Coulomb's law with its
//! round cone, not its convex relaxation (F. Jourdan, P. Alart, M. Jean, "A Gauss-Seidel like algorithm to solve
//! frictional contact problems", 1998). Redundant points, as the four corners of a plate on a plane, share the force in
//! one of many ways.
//!
//! Where many points touch, sweeps converge slowly. After a few of them, y goes where everything would be exact if what
//! touches, sticks and slides were known to go on (`exact`), or as far as impulses stay in their cones; the next sweep
//! shows whether that was so. It is a step of Newton's method for the equations of the projections, which are smooth
//! between changes of what touches (P. Alart, A. Curnier, "A mixed formulation for frictional contact problems prone to
//! Newton like solution methods", 1991).
//!
//! Sweeps end at a tolerance, and a tolerance is a creep for what should stick. Therefore the same equations are solved
//! once more at the end.

use super::Unilateral;
use crate::Scalar;
use crate::linear::{add_scaled, dot, tolerance};

/// The most sweeps. Most steps need one or two, since they start from the forces of the step before.
const SWEEPS: usize = 1000;
/// Sweeps end where they change y by less than this share of what it was. In `f32`, this many epsilons.
const ENOUGH: (f64, f64) = (1e-11, 8.0);
/// What slides more slowly than this many times what sweeps leave sticks.
const STICKING: f64 = 1e2;
/// Impulses shorter than this share of the radius of their cone are inside of it.
const INSIDE: f64 = 1.0 - 1e-9;
/// Sweeps before the first guess at what touches and sticks.
const FIRST: usize = 4;

impl<S: Scalar> Unilateral<'_, S> {
    /// Changes y by impulses, which start from those that are there. Returns whether sweeps found them.
    pub(super) fn solve(&mut self, y: &mut [S], rubs: bool) -> bool {
        let enough: S = tolerance(ENOUGH.0, ENOUGH.1);
        let square = enough * enough * self.scale(y);
        self.push(y);
        let mut is_found = false;
        for sweep in 0..SWEEPS {
            // Written so that NaN ends it.
            is_found = !(self.sweep(y, rubs) > square);
            if is_found {
                break;
            }
            if sweep >= FIRST {
                self.guess(y, rubs);
            }
        }
        self.settle(y, rubs, Some(S::from_f64(STICKING * STICKING) * square));
        self.credit(y, S::ONE);
        is_found
    }

    /// The square of the size of y and of what is wanted.
    fn scale(&self, y: &[S]) -> S {
        let points = self.points.gaps.iter().zip(&*self.points.inertias);
        let points = points.map(|(&[_, bound], &[inertia, _])| (bound.max(S::ZERO), inertia));
        let stops = self.stops.bounds.iter().zip(&*self.stops.inertias);
        let stops = stops
            .map(|(&[least, most], &inertia)| (least.max(S::ZERO) - most.min(S::ZERO), inertia));
        points.chain(stops).fold(dot(y, y), |sum, (wanted, inertia)| match inertia > S::ZERO {
            true => sum + wanted * wanted * inertia,
            false => sum,
        })
    }

    /// Adds what the impulses change; those of what is held become zero.
    fn push(&mut self, y: &mut [S]) {
        let n = self.n.max(1);
        let points = &mut self.points;
        let rows = points.rows.chunks_exact(3 * n).zip(&*points.inertias);
        for (impulse, (rows, [normal, tangent])) in points.impulses.iter_mut().zip(rows) {
            let [push, first, second] = impulse;
            if !(*normal > S::ZERO) {
                *push = S::ZERO;
            }
            if !(*tangent > S::ZERO && *normal > S::ZERO) {
                (*first, *second) = (S::ZERO, S::ZERO);
            }
            for (row, &part) in rows.chunks_exact(n).zip(&*impulse) {
                if part != S::ZERO {
                    add_scaled(y, part, row);
                }
            }
        }
        let stops = &mut self.stops;
        let rows = stops.rows.chunks_exact(n).zip(&*stops.inertias);
        for (impulse, (row, &inertia)) in stops.impulses.iter_mut().zip(rows) {
            if inertia > S::ZERO {
                add_scaled(y, *impulse, row);
            } else {
                *impulse = S::ZERO;
            }
        }
    }

    /// Every constraint once; returns the square of the largest change of y.
    fn sweep(&mut self, y: &mut [S], rubs: bool) -> S {
        let n = self.n.max(1);
        let mut most = S::ZERO;
        let points = &mut self.points;
        let laws = points.gaps.iter().zip(&*points.friction).zip(&*points.inertias);
        let rows = points.rows.chunks_exact(3 * n).zip(laws);
        for (impulse, (rows, ((&[_, bound], &friction), &[normal, tangent]))) in
            points.impulses.iter_mut().zip(rows)
        {
            let mut rows = rows.chunks_exact(n);
            let (Some(along), Some(first), Some(second)) = (rows.next(), rows.next(), rows.next())
            else {
                continue;
            };
            if !(normal > S::ZERO) {
                continue;
            }
            let [push, a, b] = *impulse;
            let pushed = (push - (dot(along, y) - bound) * normal).max(S::ZERO);
            let change = pushed - push;
            if change != S::ZERO {
                add_scaled(y, change, along);
                most = most.max(change * change / normal);
            }
            *impulse = [pushed, a, b];
            let radius = if rubs { friction * pushed } else { S::ZERO };
            if !(tangent > S::ZERO) || (radius == S::ZERO && a == S::ZERO && b == S::ZERO) {
                continue;
            }
            let [x, z] = [a - dot(first, y) * tangent, b - dot(second, y) * tangent];
            let length = (x * x + z * z).sqrt();
            let share = if length > radius { radius / length } else { S::ONE };
            let [x, z] = [share * x, share * z];
            *impulse = [pushed, x, z];
            add_scaled(y, x - a, first);
            add_scaled(y, z - b, second);
            most = most.max(((x - a) * (x - a) + (z - b) * (z - b)) / tangent);
        }
        let stops = &mut self.stops;
        let laws = stops.bounds.iter().zip(&*stops.inertias);
        let rows = stops.rows.chunks_exact(n).zip(laws);
        for (impulse, (row, (&[least, greatest], &inertia))) in stops.impulses.iter_mut().zip(rows)
        {
            if inertia > S::ZERO {
                let free = dot(row, y) - *impulse / inertia;
                let wanted = (least - free).max(S::ZERO) + (greatest - free).min(S::ZERO);
                let change = wanted * inertia - *impulse;
                *impulse = wanted * inertia;
                add_scaled(y, change, row);
                most = most.max(change * change / inertia);
            }
        }
        most
    }

    /// The impulses that move y to the nearest one at which everything that touches has its bound, and what sticks does not
    /// slide. With `little`, the square of what sweeps may leave of y, that sticks as well which
    /// hardly slides, and nothing changes y by more.
    fn settle(&mut self, y: &[S], rubs: bool, little: Option<S>) {
        let n = self.n.max(1);
        self.exact.begin(y, little);
        let (exact, points) = (&mut self.exact, &mut self.points);
        let laws = points.gaps.iter().zip(&*points.friction).zip(&*points.inertias);
        let rows = points.rows.chunks_exact(3 * n).zip(laws);
        let impulses = points.impulses.iter().zip(&mut *points.places);
        for ((&[push, x, z], places), (rows, ((&[_, bound], &friction), &[_, tangent]))) in
            impulses.zip(rows)
        {
            *places = [S::ZERO; 3];
            let mut rows = rows.chunks_exact(n);
            let (Some(along), Some(first), Some(second)) = (rows.next(), rows.next(), rows.next())
            else {
                continue;
            };
            if !(push > S::ZERO) {
                continue;
            }
            let radius = S::from_f64(INSIDE) * friction * push;
            let [a, b] = [dot(first, exact.y), dot(second, exact.y)];
            let rests = little.is_some_and(|little| (a * a + b * b) * tangent <= little);
            let sticks = rubs && tangent > S::ZERO && radius > S::ZERO;
            if sticks && (rests || x * x + z * z < radius * radius) {
                let alone = [(S::ZERO, along); 2];
                places[0] = exact.hold(along, alone, bound);
                places[1] = exact.hold(first, alone, S::ZERO);
                places[2] = exact.hold(second, alone, S::ZERO);
            } else {
                places[0] = exact.hold(along, [(x / push, first), (z / push, second)], bound);
                places[1] = -S::ONE;
            }
        }
        let stops = &mut self.stops;
        let rows = stops.rows.chunks_exact(n).zip(&*stops.bounds);
        let impulses = stops.impulses.iter().zip(&mut *stops.places);
        for ((&impulse, place), (row, &[least, greatest])) in impulses.zip(rows) {
            *place = S::ZERO;
            if impulse != S::ZERO {
                let value = if impulse > S::ZERO { least } else { greatest };
                *place = exact.hold(row, [(S::ZERO, row); 2], value);
            }
        }
        self.exact.impulses();
    }

    /// Goes where y would be if everything went on to touch and to stick as it does, or as far as impulses stay in their
    /// cones.
    fn guess(&mut self, y: &mut [S], rubs: bool) {
        self.settle(y, rubs, None);
        let mut share = S::ONE;
        let points = self.points.impulses.iter().zip(&*self.points.places);
        for ((impulse, places), &friction) in points.zip(&*self.points.friction) {
            let change = places.map(|place| self.exact.impulse(place));
            share = share.min(within_cone(*impulse, change, friction));
        }
        for (&impulse, &place) in self.stops.impulses.iter().zip(&*self.stops.places) {
            let change = self.exact.impulse(place);
            if impulse * (impulse + change) < S::ZERO {
                share = share.min(-impulse / change);
            }
        }
        self.credit(y, share);
    }

    /// Adds a share of what moves y to the impulses, and to y.
    fn credit(&mut self, y: &mut [S], share: S) {
        let n = self.n.max(1);
        let (exact, points, stops) = (&self.exact, &mut self.points, &mut self.stops);
        let rows = points.rows.chunks_exact(3 * n).zip(&*points.places);
        for (impulse, (rows, places)) in points.impulses.iter_mut().zip(rows) {
            let mut change = places.map(|place| share * exact.impulse(place));
            let ([push, a, b], [more, ..]) = (*impulse, change);
            if places[1] < S::ZERO && more != S::ZERO {
                change = [more, a / push * more, b / push * more];
            }
            for ((impulse, change), row) in impulse.iter_mut().zip(change).zip(rows.chunks_exact(n))
            {
                if change != S::ZERO {
                    *impulse += change;
                    add_scaled(y, change, row);
                }
            }
        }
        let rows = stops.rows.chunks_exact(n).zip(&*stops.places);
        for (impulse, (row, &place)) in stops.impulses.iter_mut().zip(rows) {
            let change = share * exact.impulse(place);
            *impulse += change;
            add_scaled(y, change, row);
        }
    }
}

/// The share, at most 1, of a change with which an impulse stays in its cone; its end is on the cone if it leaves it.
fn within_cone<S: Scalar>([p, a, b]: [S; 3], [dp, da, db]: [S; 3], friction: S) -> S {
    let mut share = S::ONE;
    if p + dp < S::ZERO {
        share = -p / dp;
    }
    if da == S::ZERO && db == S::ZERO {
        return share;
    }
    // |a + s da|^2 = mu^2 (p + s dp)^2: the only root above zero, as it starts inside.
    let square = friction * friction;
    let [x, y, z] = [
        da * da + db * db - square * dp * dp,
        a * da + b * db - square * p * dp,
        a * a + b * b - square * p * p,
    ];
    let outside = x + y + y + z > S::ZERO;
    if !outside {
        return share;
    }
    let root = (y * y - x * z).max(S::ZERO).sqrt();
    let end = if y > S::ZERO { -z / (y + root) } else { (root - y) / x };
    share.min(end.max(S::ZERO))
}
