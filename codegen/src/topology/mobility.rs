//! Mobility of closed loops: the rank of their closure Jacobian in closed configurations away from
//! the flat state, found by sampling.
//!
//! The flat state is not generic: there all hinge lines lie in a plane and the rank drops. Closed
//! configurations are found by damped Gauss-Newton steps from random angles
//!
//! ```text
//! (J^T J + mu 1) dq = -J^T r,     mu ~ |r|^2  (Yamashita & Fukushima, 2001: quadratic convergence
//!                                 also where solutions are not isolated)
//! ```
//!
//! and followed along the null space of J, which shows that the motion is finite and leads away
//! from special configurations. The largest rank found is the generic one, because special
//! configurations can only have a smaller rank.

use std::cmp::Ordering;
use std::f64::consts::{PI, TAU};

use nalgebra::DVector;

use super::closure::Closure;
use super::infinitesimal::Infinitesimal;
use super::sparse::{Echelon, symmetric_solution};

/// Largest residual of a closed configuration, relative to a loop's length.
const CLOSED: f64 = 1e-11;
/// What is left of a row below this fraction of the largest entry counts as zero.
const RANK_TOLERANCE: f64 = 1e-7;
/// Angles below this count as the flat state. At a double root the rounding error is its square.
pub(super) const FLAT: f64 = 1e-3;
/// Largest step along a motion, rad.
const STEP: f64 = 0.1;
/// Number of steps along a motion.
const STEPS: usize = 12;
/// The same for many joints. A large sheet that is folded far has singular values near zero, and rounding
/// errors divided by them make redundant rows seem independent.
const STEPS_OF_MANY: usize = 3;
/// Ranges of random angles, used in turn: small angles follow the motions out of the flat state,
/// large angles find closed configurations that no path connects with it.
const SPREADS: [f64; 6] = [0.3, 0.8, 1.2, 0.1, 2.0, PI];
/// Largest number of attempts. Flat sheets have motions that fold some hinges only; these have a
/// different rank and are found more easily than those that fold all.
const ATTEMPTS: usize = 120;
/// With more joints than this, the number of attempts decreases as their cost grows.
const MANY_JOINTS: usize = 64;
/// Sampling also ends after this many mobile samples of the same rank, if the best folds every
/// hinge.
const AGREEING: usize = 12;

/// Result of the sampling.
pub struct Mobility {
    /// Generic rank of the closure Jacobian.
    pub rank: usize,
    /// Degrees of freedom; 0 if all closed configurations found are isolated.
    pub mobility: usize,
    /// A closed configuration away from the flat state, one angle per column.
    pub assembled: Option<DVector<f64>>,
    /// What the rank leaves free there, although no finite motion follows.
    pub infinitesimal: Infinitesimal,
}

/// One closed configuration.
struct Sample {
    q: DVector<f64>,
    /// Where the motion ended that was followed from there, and the rank there.
    end: DVector<f64>,
    rank: usize,
    moves: bool,
    guessed: bool,
}

/// Samples closed configurations, first from `guess` if it is not the flat state.
pub fn mobility(closure: &Closure, guess: &DVector<f64>) -> Mobility {
    let n = closure.joints.len();
    let mut random = Random::new();
    let mut best: Option<Sample> = None;
    let mut agreeing = 0;
    let attempts = ATTEMPTS * MANY_JOINTS.pow(3) / n.max(MANY_JOINTS).pow(3);
    for attempt in 0..attempts.max(SPREADS.len()) {
        let guessed = attempt == 0 && guess.amax() > FLAT;
        let mut start = random_angles(closure, SPREADS[attempt % SPREADS.len()], &mut random);
        if guessed {
            start = guess.clone();
        } else if attempt % 2 == 1
            && let Some(best) = &best
        {
            keep_folded(&mut start, &best.q, &mut random);
        }
        let Some(q) = assemble(closure, &start) else { continue };
        let q = within_turn(closure, q);
        let mut sample = explore(closure, q.clone(), &mut random);
        if guessed && q.amax() > FLAT {
            // The rank is taken at the end of the motion, but the configuration is on the branch of
            // the guess.
            sample = Sample { q, guessed, ..sample };
        }
        let kind = (sample.moves, sample.rank);
        let best_kind = best.as_ref().map(|best| (best.moves, best.rank));
        match Some(kind).cmp(&best_kind) {
            Ordering::Greater => agreeing = 1,
            Ordering::Equal => agreeing += 1,
            Ordering::Less => {}
        }
        let merit = merit(closure, &sample);
        if best.as_ref().is_none_or(|best| merit > self::merit(closure, best)) {
            best = Some(sample);
        }
        let unfolded = |best: &Sample| best.moves && best.q.iter().all(|q| q.abs() > FLAT);
        // Random angles of many joints hardly ever lead to a better state than the file's.
        let enough = if guessed && n > MANY_JOINTS { 1 } else { AGREEING };
        if agreeing >= enough && best.as_ref().is_some_and(unfolded) {
            break;
        }
    }
    match best {
        Some(Sample { q, end, rank, moves: true, .. }) => {
            let infinitesimal = Infinitesimal::at(closure, &end);
            let rank = if infinitesimal.holding.is_empty() { rank } else { infinitesimal.rank };
            let mobility = n - rank - infinitesimal.holding.len();
            Mobility { rank, mobility, assembled: Some(q), infinitesimal }
        }
        // At a double root the rank drops although nothing moves; near the root the equations show
        // this.
        isolated => {
            let beside = random_angles(closure, 1.0, &mut random);
            let assembled = isolated.map(|sample| sample.q).filter(|q| q.amax() > FLAT);
            let rank = eliminated(closure, &beside).rank();
            let infinitesimal = Infinitesimal::default();
            Mobility { rank, mobility: 0, assembled, infinitesimal }
        }
    }
}

/// Gives half the hinges that a sample folds their angles in the sample.
///
/// Folding the hinges that the best sample leaves flat, and keeping most of the others, finds the motions
/// that fold all hinges. In large sheets random angles are hardly ever near these.
fn keep_folded(start: &mut DVector<f64>, best: &DVector<f64>, random: &mut Random) {
    for (angle, kept) in start.iter_mut().zip(best.iter()) {
        if kept.abs() > FLAT && random.next() < 0.5 {
            *angle = *kept;
        }
    }
}

/// The better sample compares as greater: it moves, is on the branch of a guess of the file that folds every hinge, has a
/// larger rank, is within the limits, is on the branch of another guess, and is unfolded.
fn merit(closure: &Closure, sample: &Sample) -> (bool, bool, usize, bool, bool, u64) {
    // Each joint counts up to half a radian, so that samples in which all joints are bent are
    // preferred.
    let unfolded: f64 = sample.q.iter().map(|q| q.abs().min(0.5)).sum();
    let within = inside_limits(closure, &sample.q);
    let is_asked = sample.guessed && sample.q.iter().all(|q| q.abs() > FLAT);
    (sample.moves, is_asked, sample.rank, within, sample.guessed, (unfolded * 1e6) as u64)
}

fn inside_limits(closure: &Closure, q: &DVector<f64>) -> bool {
    q.iter().enumerate().all(|(column, angle)| {
        let [low, high] = closure.limits(column);
        (low..=high).contains(angle)
    })
}

/// Follows a motion from a closed configuration, first away from the flat state, as far as the
/// limits allow.
fn explore(closure: &Closure, start: DVector<f64>, random: &mut Random) -> Sample {
    let mut q = start;
    let mut moves = false;
    let mut heading = q.clone();
    let mut in_limits = inside_limits(closure, &q);
    let steps = if q.len() > MANY_JOINTS { STEPS_OF_MANY } else { STEPS };
    for _ in 0..steps {
        let echelon = eliminated(closure, &q);
        if echelon.rank() == q.len() {
            break;
        }
        let mut stepped = None;
        for turn in 0..4 {
            if turn > 0 {
                heading = random.vector(q.len(), 1.0);
            }
            let Some(direction) = echelon.projected(&heading).try_normalize(1e-9) else { continue };
            let step = direction.scale(STEP / direction.amax());
            let Some(next) = assemble(closure, &(&q + &step)) else { continue };
            let moved = &next - &q;
            // A step that the projection reverses was not along a motion.
            if !(0.3..3.0).contains(&(moved.norm() / step.norm())) {
                continue;
            }
            moves = true;
            if in_limits && !inside_limits(closure, &next) {
                continue;
            }
            stepped = Some((moved, next));
            break;
        }
        let Some((moved, next)) = stepped else { break };
        heading = moved;
        in_limits = inside_limits(closure, &next);
        q = next;
    }
    let rank = eliminated(closure, &q).rank();
    let q = within_turn(closure, q);
    Sample { end: q.clone(), q, rank, moves, guessed: false }
}

/// Finds a closed configuration near `start` by damped Gauss-Newton steps.
pub(super) fn assemble(closure: &Closure, start: &DVector<f64>) -> Option<DVector<f64>> {
    const ITERATIONS: usize = 120;
    let n = start.len();
    if n > MANY_JOINTS
        && let Some(q) = closed_by_newton(closure, start)
    {
        return Some(q);
    }
    let mut q = start.clone();
    let mut trust = 1.0;
    for _ in 0..ITERATIONS {
        let (matrix, right, largest) = closure.normal_equations(&q);
        if largest <= CLOSED {
            return Some(polished(closure, q));
        }
        let squared = closure.squared_residual(&q);
        let mut accepted = false;
        for _ in 0..12 {
            let damping = (trust * squared).max(1e-14);
            let mut damped = matrix.clone();
            for (joint, column) in damped.iter_mut().enumerate() {
                *column.entry(joint).or_default() += damping;
            }
            let solution = symmetric_solution(&damped, right.as_slice().to_vec());
            // Rounding may have taken more from the matrix than the damping adds.
            let Some((solution, _)) = solution.filter(|(_, positive)| *positive == n) else {
                trust = trust.max(1e-6) * 10.0;
                continue;
            };
            let mut step = -DVector::from_vec(solution);
            let largest_step = step.amax();
            if largest_step > 0.5 {
                step *= 0.5 / largest_step;
            }
            let next = &q + step;
            if closure.squared_residual(&next) < squared {
                q = next;
                trust = (trust / 4.0).max(1e-6);
                accepted = true;
                break;
            }
            trust *= 8.0;
        }
        if !accepted {
            return None;
        }
    }
    None
}

/// Finds the closed configuration next to `start` by Newton's method, at a cost that grows with the number
/// of entries. Returns nothing if a step does not help.
fn closed_by_newton(closure: &Closure, start: &DVector<f64>) -> Option<DVector<f64>> {
    const ITERATIONS: usize = 12;
    let mut q = start.clone();
    let mut squared = closure.squared_residual(&q);
    for _ in 0..ITERATIONS {
        if closure.largest_residual(&q) <= CLOSED {
            return Some(polished(closure, q));
        }
        let echelon = Echelon::new(closure.gaps(&q), q.len(), RANK_TOLERANCE);
        let solution = echelon.solution();
        let step = &solution - echelon.projected(&solution);
        let next = &q - step;
        let left = closure.squared_residual(&next);
        // NaN is no progress.
        let helps = 4.0 * left < squared;
        if !helps {
            return None;
        }
        (q, squared) = (next, left);
    }
    None
}

/// Returns the configuration next to `start` in which the loops close as far as rows allow whose pivots
/// are not below `small`: rows that only rounding makes independent stay open.
pub(super) fn nearly_closed(closure: &Closure, start: &DVector<f64>, small: f64) -> DVector<f64> {
    const ITERATIONS: usize = 10;
    let mut q = start.clone();
    for _ in 0..ITERATIONS {
        let echelon = Echelon::new(closure.gaps(&q), q.len(), small);
        let solution = echelon.solution();
        q -= &solution - echelon.projected(&solution);
    }
    q
}

/// Takes Newton steps as long as they help, so that only rounding errors are left. The normal equations
/// above leave more in large sheets, whose smallest singular values are small.
fn polished(closure: &Closure, mut q: DVector<f64>) -> DVector<f64> {
    const STEPS: usize = 4;
    let mut squared = closure.squared_residual(&q);
    for _ in 0..STEPS {
        let echelon = Echelon::new(closure.gaps(&q), q.len(), RANK_TOLERANCE);
        let next = &q - echelon.solution();
        let left = closure.squared_residual(&next);
        // NaN is no progress.
        let helps = 4.0 * left < squared;
        if !helps {
            break;
        }
        (q, squared) = (next, left);
    }
    q
}

/// Wraps the angles of joints without limits to half a turn.
fn within_turn(closure: &Closure, mut q: DVector<f64>) -> DVector<f64> {
    for (column, angle) in q.iter_mut().enumerate() {
        if closure.limits(column).iter().all(|limit| limit.is_infinite()) {
            *angle -= TAU * (*angle / TAU).round();
        }
    }
    q
}

fn random_angles(closure: &Closure, spread: f64, random: &mut Random) -> DVector<f64> {
    let mut q = random.vector(closure.joints.len(), spread);
    for (column, angle) in q.iter_mut().enumerate() {
        let [low, high] = closure.limits(column);
        *angle = angle.max(low).min(high);
    }
    q
}

/// Returns the elimination of the hinges' twists.
fn eliminated(closure: &Closure, q: &DVector<f64>) -> Echelon {
    Echelon::new(closure.twists(q), closure.joints.len(), RANK_TOLERANCE)
}

/// Deterministic pseudorandom numbers (Steele, Lea & Flood, "Fast splittable pseudorandom number
/// generators", 2014): the same mechanism always gives the same report.
pub(super) struct Random(u64);

impl Random {
    /// Returns the generator at its start.
    pub fn new() -> Self {
        Self(0)
    }

    /// Returns a number between -1 and 1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        (z >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Returns numbers between -`spread` and `spread`.
    pub fn vector(&mut self, n: usize, spread: f64) -> DVector<f64> {
        DVector::from_fn(n, |_, _| spread * self.next())
    }
}
