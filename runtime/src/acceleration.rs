//! Constrained acceleration: Kane's equations with closure forces, through the factored M.
//!
//! ```text
//! M = L L^T,  y = L^-1 f,  W = J L^-T
//! du/dt = M^-1 (f + J^T lambda),  lambda = (W W^T)^+ (-gamma - W y)
//!       = L^-T (y + W^+ (-gamma - W y))
//! ```
//!
//! Driven joints are rows more: e_j du/dt = d2s/dt2, scaled by the mechanism's size so that they
//! weigh as closure rows do.
//!
//! This is the pseudo-inverse solution of F. E. Udwadia and R. E. Kalaba, "A new perspective on
//! constrained motion", 1992: finite at every state, also where closure equations are redundant
//! or the mechanism is singular.

use crate::linear::{
    Spectrum, add_scaled, backward, combine, conditioning, dot, factor, forward, orthogonalise,
    tolerance,
};
use crate::workspace::{check, split};
use crate::{Arithmetic, Dimensions, EquationsMut, Error, Margin, Scalar, System};

/// Eigenvalues of J M^-1 J^T below this share of the largest are dropped. `f32` drops below
/// 8 epsilon, about 1e-6: singular values are the square roots of these, so that what is kept
/// stands a thousandfold above the rounding of J.
pub const RANK_TOLERANCE: f64 = 1e-7;

/// The spectrum of a plain pseudo-inverse with the [`RANK_TOLERANCE`].
pub(crate) fn plain<S: Scalar>() -> Spectrum<S> {
    Spectrum { cut: tolerance(RANK_TOLERANCE, 8.0), damping: S::ZERO }
}

/// The spectrum that drops rounding only: near a singular state, where a direction of the closure
/// fades, it is kept to within 1e-7 rad of it (in `f32` as far as the plain one keeps it). At rest
/// the closure carries load in that direction, however close.
pub(crate) fn fine<S: Scalar>() -> Spectrum<S> {
    Spectrum { cut: tolerance(1e-14, 8.0), damping: S::ZERO }
}

/// What is known of the closure equations at a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Constraint {
    /// Independent rows among the C of the acceleration and the D driven joints.
    pub rank: usize,
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
    solve(system, (t, q, u), plain(), workspace, out, None)
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
    solve(system, (t, q, u), plain(), workspace, out, Some(lambda))
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
    good.then_some(Constraint { rank: rows })
}

/// du/dt at (t, q, u) with this spectrum, and lambda if there is a place for it.
#[inline]
pub(crate) fn solve<Y: System>(
    system: &Y,
    state: (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    spectrum: Spectrum<Y::Scalar>,
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
    general(system, dimensions, state, spectrum, workspace, out, lambda)
}

/// By the factor of M, with a decision on the rank. Much code, seldom needed: not to be inlined.
#[inline(never)]
fn general<Y: System>(
    system: &Y,
    dimensions: Dimensions,
    (t, q, u): (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    spectrum: Spectrum<Y::Scalar>,
    mut workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
    lambda: Option<&mut [Y::Scalar]>,
) -> Result<Constraint, Error> {
    let (n, c) = (dimensions.coordinates, dimensions.rows + dimensions.drives);
    let mass = split(&mut workspace, n * n)?;
    let jacobian = split(&mut workspace, c * n)?;
    let gamma = split(&mut workspace, c)?;
    write(system, t, q, u, EquationsMut { mass, forcing: out, jacobian, gamma });
    factor(mass, n).map_err(|joint| blame(&[q, u], mass, joint))?;
    let failure = not_finite(&[q, u, out]);
    forward(mass, out);
    let rank = if c == 0 {
        0
    } else {
        let (weighted, rhs) = (jacobian, gamma);
        weigh(mass, weighted, n);
        for (i, value) in rhs.iter_mut().enumerate() {
            *value = -*value - dot(&weighted[i * n..(i + 1) * n], out);
        }
        let scratch = split(&mut workspace, c * n)?;
        let multipliers = split(&mut workspace, c)?;
        let vector = split(&mut workspace, n)?;
        let wanted = lambda.is_some();
        let mut closure = Rows { weighted, rhs, scratch, multipliers, vector };
        let rank = match closure.direct(out) {
            Some(rank) => rank,
            None => closure.general(wanted, spectrum, out),
        };
        if let Some(lambda) = lambda {
            lambda.copy_from_slice(closure.multipliers);
            for torque in &mut lambda[dimensions.rows..] {
                *torque *= system.size();
            }
        }
        rank
    };
    backward(mass, out);
    match failure.or_else(|| not_finite(&[out])) {
        Some(joint) => Err(Error::NotFinite { joint }),
        None => Ok(Constraint { rank }),
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

/// The weighted closure equations W x = b and room to solve them in.
struct Rows<'a, S> {
    /// W, C x N.
    weighted: &'a [S],
    /// b, C.
    rhs: &'a [S],
    /// C x N.
    scratch: &'a mut [S],
    /// lambda, C.
    multipliers: &'a mut [S],
    /// N.
    vector: &'a mut [S],
}

impl<S: Scalar> Rows<'_, S> {
    #[inline]
    fn row(&self, i: usize) -> &[S] {
        let n = self.vector.len();
        &self.weighted[i * n..(i + 1) * n]
    }

    /// Adds W^+ b to `y` by the Cholesky factor of W W^T, if that is safe: rows certainly
    /// independent and far from dependence.
    fn direct(&mut self, y: &mut [S]) -> Option<usize> {
        let (c, n) = (self.rhs.len(), y.len());
        if c > n {
            return None;
        }
        let mut trace = S::ZERO;
        for i in 0..c {
            for j in 0..=i {
                self.scratch[i * c + j] = dot(self.row(i), self.row(j));
            }
            trace += self.scratch[i * c + i];
        }
        factor(self.scratch, c).ok()?;
        if !(conditioning(self.scratch, c, trace) > safe()) {
            return None;
        }
        self.multipliers.copy_from_slice(self.rhs);
        forward(self.scratch, self.multipliers);
        backward(self.scratch, self.multipliers);
        for i in 0..c {
            add_scaled(y, self.multipliers[i], self.row(i));
        }
        Some(c)
    }

    /// Adds W^+ b to `y` whatever the rank.
    fn general(&mut self, wanted: bool, spectrum: Spectrum<S>, y: &mut [S]) -> usize {
        let n = y.len();
        self.scratch.copy_from_slice(self.weighted);
        self.multipliers.copy_from_slice(self.rhs);
        let k = orthogonalise(self.scratch, self.multipliers, self.rhs.len(), n);
        let rhs = &self.multipliers[..k];
        let rank = combine(self.scratch, rhs, spectrum, 1, self.vector);
        add_scaled(y, S::ONE, self.vector);
        if wanted {
            combine(self.scratch, rhs, spectrum, 2, self.vector);
            for i in 0..self.rhs.len() {
                self.multipliers[i] = dot(self.row(i), self.vector);
            }
        }
        rank
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::test_matrix;

    /// Solution, multipliers and rank of W x = b by one of the two ways.
    fn solution(w: &[f64], b: &[f64], n: usize, direct: bool) -> Option<(Vec<f64>, Vec<f64>)> {
        let c = b.len();
        let (mut scratch, mut multipliers) = (vec![0.0; c * n], vec![0.0; c]);
        let (mut vector, mut y) = (vec![0.0; n], vec![0.0; n]);
        let mut rows = Rows {
            weighted: w,
            rhs: b,
            scratch: &mut scratch,
            multipliers: &mut multipliers,
            vector: &mut vector,
        };
        if direct {
            rows.direct(&mut y)?;
        } else {
            assert_eq!(rows.general(true, plain(), &mut y), c);
        }
        Some((y, multipliers))
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
