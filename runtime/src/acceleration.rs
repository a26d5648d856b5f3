//! Constrained acceleration: Kane's equations with closure forces, through the factored M.
//!
//! ```text
//! M = L L^T,  y = L^-1 f,  W = J L^-T
//! du/dt = M^-1 (f + J^T lambda),  lambda = (W W^T)^+ (-gamma - W y)
//!       = L^-T (y + W^+ (-gamma - W y))
//! ```
//!
//! Which rows are independent is decided on J ([`rank`](crate::rank)); orthogonal rows of unit length
//! that span the same take their place before they are weighted.
//!
//! Driven joints are rows more: e_j du/dt = d2s/dt2, scaled by the mechanism's size so that they
//! weigh as closure rows do.
//!
//! This is the pseudo-inverse solution of F. E. Udwadia and R. E. Kalaba, "A new perspective on
//! constrained motion", 1992: finite at every state, also where closure equations are redundant
//! or the mechanism is singular.

use crate::linear::{
    Kept, add_scaled, backward, combine, conditioning, dot, factor, forward, keep, max_abs,
    normalise, orthogonalise, times_lower, tolerance,
};
use crate::passage::pass;
use crate::rank::{Fading, Gap};
use crate::workspace::{check, split};
use crate::{Arithmetic, Dimensions, EquationsMut, Error, Margin, Scalar, System};

/// What rounding of a state may make of its acceleration, as a share.
const NOISE: f64 = 1e-6;

/// What is known of the closure equations at a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Constraint {
    /// Independent rows among the C of the acceleration and the D driven joints.
    pub rank: usize,
    /// Whether a direction of the closure has faded to less than a hundredth of the strongest, as
    /// within some 0.1 rad of the flat state. The acceleration there is as exact as the loops are
    /// closed: it is worth a [projection](crate::project()) first.
    pub is_weak: bool,
    /// Whether the loops are closed to rounding; not looked at where no direction is weak.
    pub(crate) is_closed: bool,
}

impl Constraint {
    /// Of a motion that passes through a singular state.
    pub(crate) fn passing(rank: usize, is_closed: bool) -> Self {
        Self { rank, is_weak: true, is_closed }
    }

    /// Rows far from dependence.
    fn strong(rank: usize) -> Self {
        Self { rank, is_weak: false, is_closed: false }
    }
}

/// du/dt at a state, into `out` (N).
///
/// # Errors
///
/// [`Error::MassMatrix`], [`Error::NotFinite`]; [`Error::Workspace`] and [`Error::Length`] for
/// slices that are too short.
#[inline]
pub fn acceleration<Y: System>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    u: &[Y::Scalar],
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
) -> Result<Constraint, Error> {
    solve(system, (t, q, u), Fading::of_rounding().lost, workspace, out, None)
}

/// As [`acceleration`], and what holds the constraints, C + D: the closure forces lambda (N), of
/// which J^T lambda acts on the coordinates, then the torque of each driven joint's motor (N m) on
/// the joint's second body. Of redundant rows it is the smallest that does.
///
/// # Errors
///
/// As [`acceleration`].
pub fn acceleration_and_forces<Y: System>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    u: &[Y::Scalar],
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
    lambda: &mut [Y::Scalar],
) -> Result<Constraint, Error> {
    let Dimensions { rows, drives, .. } = system.dimensions();
    let expected = rows + drives;
    if lambda.len() != expected {
        return Err(Error::Length { expected, given: lambda.len() });
    }
    solve(system, (t, q, u), Y::Scalar::ZERO, workspace, out, Some(lambda))
}

/// The conditioning above which rows are certainly independent and far from dependence: solving by
/// J M^-1 J^T loses as many digits as its condition number has; ten are kept.
#[inline]
pub(crate) fn safe<S: Arithmetic>() -> S {
    tolerance(1e-4, 1e5)
}

/// Whether the results of a straight-line elimination hold.
#[inline]
pub(crate) fn holds<S: Scalar>(margin: &Margin<S>) -> bool {
    (margin.inverse_pivot > S::ZERO) & (margin.conditioning > safe())
}

/// du/dt at (t, q, u) by the system's own elimination, where that holds.
#[inline]
pub(crate) fn direct<Y: System>(
    system: &Y,
    (t, q, u): (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    out: &mut [Y::Scalar],
) -> Option<Constraint> {
    let Dimensions { rows, drives, .. } = system.dimensions();
    if drives != 0 {
        return None;
    }
    let margin = system.write_acceleration(t, q, u, out);
    let good = holds(&margin) && out.iter().all(|x| x.is_finite());
    good.then_some(Constraint::strong(rows))
}

/// As [`acceleration`], at a state that a motion has reached: its speeds show where a direction of the
/// closure that has nearly faded comes from.
///
/// # Errors
///
/// As [`acceleration`].
#[inline]
pub fn acceleration_in_motion<Y: System>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    u: &[Y::Scalar],
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
) -> Result<Constraint, Error> {
    solve(system, (t, q, u), Fading::of_rounding().passing, workspace, out, None)
}

/// du/dt at (t, q, u), and lambda if there is a place for it. Directions that have faded to less than
/// `zone` of the strongest are taken along the motion.
#[inline]
fn solve<Y: System>(
    system: &Y,
    state: (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    zone: Y::Scalar,
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
    lambda: Option<&mut [Y::Scalar]>,
) -> Result<Constraint, Error> {
    let (_, q, u) = state;
    let dimensions = check(system, workspace, &[q.len(), u.len(), out.len()])?;
    if lambda.is_none()
        && let Some(constraint) = direct(system, state, out)
    {
        return Ok(constraint);
    }
    let gap = Gap::at(system, q, workspace)?;
    let (constraint, kept) = general(system, dimensions, state, gap, workspace, out, lambda)?;
    let fades = |kept: &Kept<Y::Scalar>| {
        // A direction that is kept shows itself where rounding of the state makes little of the
        // acceleration.
        let rounding = gap.uncertainty(kept.least) * dot(u, u);
        let shows = rounding <= Y::Scalar::from_f64(NOISE) * kept.least * max_abs(out);
        gap.is_below(zone, kept) && !(kept.least < zone && shows)
    };
    if zone > Y::Scalar::ZERO && kept.as_ref().is_some_and(fades) {
        let mut passing = system.vector();
        let rounding = (gap, zone);
        let found = pass(system, dimensions, state, rounding, workspace, passing.as_mut())?;
        if let Some(constraint) = found {
            out.copy_from_slice(passing.as_ref());
            return Ok(constraint);
        }
    }
    Ok(constraint)
}

/// A decision on the rank and, unless rows were far from dependence, what led to it.
type Decided<S> = (Constraint, Option<Kept<S>>);

/// By the factor of M, with a decision on the rank and what led to it. Much code, seldom needed: not to be
/// inlined.
#[inline(never)]
fn general<Y: System>(
    system: &Y,
    dimensions: Dimensions,
    (t, q, u): (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    gap: Gap<Y::Scalar>,
    mut workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
    lambda: Option<&mut [Y::Scalar]>,
) -> Result<Decided<Y::Scalar>, Error> {
    let (n, c) = (dimensions.coordinates, dimensions.rows + dimensions.drives);
    let mass = split(&mut workspace, n * n)?;
    let jacobian = split(&mut workspace, c * n)?;
    let gamma = split(&mut workspace, c)?;
    write(system, t, q, u, EquationsMut { mass, forcing: out, jacobian, gamma });
    factor(mass, n).map_err(|joint| blame(&[q, u], mass, joint))?;
    let failure = not_finite(&[q, u, out]);
    forward(mass, out);
    let found = if c == 0 {
        (Constraint::strong(0), None)
    } else {
        let weighted = split(&mut workspace, c * n)?;
        let scratch = split(&mut workspace, c * n)?;
        let rhs = split(&mut workspace, c)?;
        let push = split(&mut workspace, n)?;
        let mut rows = Rows { mass, jacobian, gamma, weighted, scratch, rhs, push };
        let found = match rows.direct(out) {
            Some(constraint) => (constraint, None),
            None => rows.general(gap, out),
        };
        if let Some(lambda) = lambda {
            rows.multipliers(gap, lambda);
            for torque in &mut lambda[dimensions.rows..] {
                *torque *= system.size();
            }
        }
        found
    };
    backward(mass, out);
    match failure.or_else(|| not_finite(&[out])) {
        Some(joint) => Err(Error::NotFinite { joint }),
        None => Ok(found),
    }
}

/// The equations with a row more for each driven joint: J is (C + D) x N, gamma C + D.
pub(crate) fn write<Y: System>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    u: &[Y::Scalar],
    out: EquationsMut<'_, Y::Scalar>,
) {
    let Dimensions { rows, coordinates: n, .. } = system.dimensions();
    let EquationsMut { mass, forcing, jacobian, gamma } = out;
    let (jacobian, driven) = jacobian.split_at_mut(rows * n);
    let (gamma, prescribed) = gamma.split_at_mut(rows);
    system.write_equations(t, q, u, EquationsMut { mass, forcing, jacobian, gamma });
    driven.fill(Y::Scalar::ZERO);
    let size = system.size();
    let mut slots = driven.chunks_exact_mut(n.max(1)).zip(prescribed);
    system.drives(t, |drive| {
        if let Some((row, gamma)) = slots.next() {
            row[drive.joint] = size;
            *gamma = -size * drive.acceleration;
        }
    });
}

/// Rows of J become rows of J L^-T.
pub(crate) fn weigh<S: Scalar>(l: &[S], rows: &mut [S], n: usize) {
    for row in rows.chunks_exact_mut(n.max(1)) {
        forward(l, row);
    }
}

/// Index of the first value that is not finite, in the first slice that has one: causes first,
/// effects last.
pub(crate) fn not_finite<S: Scalar>(slices: &[&[S]]) -> Option<usize> {
    slices.iter().find_map(|values| values.iter().position(|value| !value.is_finite()))
}

/// Why the mass matrix has no factor.
pub(crate) fn blame<S: Scalar>(state: &[&[S]], mass: &[S], pivot: usize) -> Error {
    let n = state.first().map_or(0, |values| values.len());
    match not_finite(state) {
        Some(joint) => Error::NotFinite { joint },
        None if not_finite(&[&mass[pivot * n..=pivot * n + pivot]]).is_some() => {
            Error::NotFinite { joint: pivot }
        }
        None => Error::MassMatrix { joint: pivot },
    }
}

/// Orthogonal rows of unit length that span the independent rows of `jacobian` (m x n), in its
/// place, and the right-hand sides that belong to them in that of `rhs` (m x any).
pub(crate) fn independent<S: Scalar>(
    jacobian: &mut [S],
    rhs: &mut [S],
    [m, n]: [usize; 2],
    gap: Gap<S>,
) -> Kept<S> {
    let width = rhs.len() / m.max(1);
    let k = orthogonalise(jacobian, rhs, m, n);
    let kept = keep(&mut jacobian[..k * n], &mut rhs[..k * width], k, n, gap.cut());
    normalise(&mut jacobian[..kept.rank * n], &mut rhs[..kept.rank * width], n);
    kept
}

/// The closure equations J a = -gamma and room to solve them in.
struct Rows<'a, S> {
    /// Factor of M.
    mass: &'a [S],
    /// J, C x N.
    jacobian: &'a [S],
    /// gamma, C.
    gamma: &'a [S],
    /// W or what takes its place, C x N.
    weighted: &'a mut [S],
    /// C x N.
    scratch: &'a mut [S],
    /// C.
    rhs: &'a mut [S],
    /// What the closure adds to y, N: L^-1 J^T lambda.
    push: &'a mut [S],
}

impl<S: Scalar> Rows<'_, S> {
    /// The right-hand sides become b = -gamma - W y.
    fn set_wanted(&mut self, rows: usize, y: &[S]) {
        let weighted = self.weighted.chunks_exact(y.len().max(1)).take(rows);
        for (value, row) in self.rhs.iter_mut().zip(weighted) {
            *value = -*value - dot(row, y);
        }
    }

    /// Adds W^+ b to `y` by the Cholesky factor of W W^T, if that is safe: rows certainly
    /// independent and far from dependence.
    fn direct(&mut self, y: &mut [S]) -> Option<Constraint> {
        let (c, n) = (self.gamma.len(), y.len());
        if c > n {
            return None;
        }
        self.weighted.copy_from_slice(self.jacobian);
        weigh(self.mass, self.weighted, n);
        let mut trace = S::ZERO;
        for i in 0..c {
            let row = |i: usize| &self.weighted[i * n..(i + 1) * n];
            for j in 0..=i {
                self.scratch[i * c + j] = dot(row(i), row(j));
            }
            trace += self.scratch[i * c + i];
        }
        factor(self.scratch, c).ok()?;
        if !(conditioning(self.scratch, c, trace) > safe()) {
            return None;
        }
        self.rhs.copy_from_slice(self.gamma);
        self.set_wanted(c, y);
        forward(self.scratch, self.rhs);
        backward(self.scratch, self.rhs);
        self.push.fill(S::ZERO);
        for (row, &value) in self.weighted.chunks_exact(n).zip(&*self.rhs) {
            add_scaled(self.push, value, row);
        }
        add_scaled(y, S::ONE, self.push);
        Some(Constraint::strong(c))
    }

    /// Adds W^+ b to `y` whatever the rank.
    fn general(&mut self, gap: Gap<S>, y: &mut [S]) -> Decided<S> {
        let (c, n) = (self.gamma.len(), y.len());
        self.weighted.copy_from_slice(self.jacobian);
        self.rhs.copy_from_slice(self.gamma);
        let kept = independent(self.weighted, self.rhs, [c, n], gap);
        let k = kept.rank;
        weigh(self.mass, &mut self.weighted[..k * n], n);
        self.set_wanted(k, y);
        orthogonalise(&mut self.weighted[..k * n], &mut self.rhs[..k], k, n);
        combine(&self.weighted[..k * n], &self.rhs[..k], self.push);
        add_scaled(y, S::ONE, self.push);
        let is_weak = gap.is_below(Fading::of_rounding().weak, &kept);
        (Constraint { rank: k, is_weak, is_closed: gap.is_closed() }, Some(kept))
    }

    /// The smallest lambda with J^T lambda = L push: with the orthogonal rows B of J and their lengths
    /// s, lambda = J sum_i B_i (B_i . L push) / s_i^4.
    fn multipliers(&mut self, gap: Gap<S>, lambda: &mut [S]) {
        let (c, n) = (self.gamma.len(), self.push.len());
        times_lower(self.mass, self.push);
        self.scratch.copy_from_slice(self.jacobian);
        let k = orthogonalise(self.scratch, self.rhs, c, n);
        let k = keep(&mut self.scratch[..k * n], &mut self.rhs[..k], k, n, gap.cut()).rank;
        let row = |i: usize| &self.scratch[i * n..(i + 1) * n];
        let sum = &mut self.weighted[..n];
        sum.fill(S::ZERO);
        for i in 0..k {
            let square = dot(row(i), row(i));
            add_scaled(sum, dot(row(i), self.push) / square / square, row(i));
        }
        for (value, row) in lambda.iter_mut().zip(self.jacobian.chunks_exact(n)) {
            *value = dot(row, sum);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::test_matrix;

    /// What W^+ b and the multipliers are by one of the two ways, for W = J (M = 1).
    fn solution(w: &[f64], b: &[f64], n: usize, direct: bool) -> Option<(Vec<f64>, Vec<f64>)> {
        let c = b.len();
        let mut mass = vec![0.0; n * n];
        (0..n).for_each(|i| mass[i * n + i] = 1.0);
        let gamma: Vec<f64> = b.iter().map(|b| -b).collect();
        let [mut weighted, mut scratch] = [vec![0.0; c * n], vec![0.0; c * n]];
        let (mut rhs, mut push) = (vec![0.0; c], vec![0.0; n]);
        let (mut y, mut lambda) = (vec![0.0; n], vec![0.0; c]);
        let mut rows = Rows {
            mass: &mass,
            jacobian: w,
            gamma: &gamma,
            weighted: &mut weighted,
            scratch: &mut scratch,
            rhs: &mut rhs,
            push: &mut push,
        };
        let gap = Gap::closed();
        if direct {
            rows.direct(&mut y)?;
        } else {
            assert_eq!(rows.general(gap, &mut y).0.rank, c);
        }
        rows.multipliers(gap, &mut lambda);
        Some((y, lambda))
    }

    #[test]
    fn both_ways_agree_where_the_fast_one_is_taken() {
        let mut taken = 0;
        for seed in 0..400 {
            let (c, n) = (1 + seed % 5, 6 + seed % 3);
            let w: Vec<f64> = test_matrix(c, n, seed as u64).iter().copied().collect();
            let b: Vec<f64> = (0..c).map(|i| (i as f64 + seed as f64).cos()).collect();
            let Some(fast) = solution(&w, &b, n, true) else { continue };
            let slow = solution(&w, &b, n, false).unwrap();
            taken += 1;
            for (fast, slow) in [(&fast.0, &slow.0), (&fast.1, &slow.1)] {
                let scale = slow.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
                for (fast, slow) in fast.iter().zip(slow) {
                    assert!((fast - slow).abs() <= 1e-10 * scale, "{fast} is not {slow}");
                }
            }
        }
        assert!(taken > 300, "the fast way was taken {taken} times of 400");
    }

    #[test]
    fn dependent_rows_never_take_the_fast_way() {
        for distance in [0.0, 1e-12, 1e-8, 1e-5, 1e-3] {
            let w = [1.0, 2.0, 3.0, 1.0, 2.0, 3.0 + distance];
            assert!(solution(&w, &[1.0, 1.0], 3, true).is_none(), "distance {distance}");
        }
    }
}
