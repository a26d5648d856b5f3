//! How the fold leaves the flat state.
//!
//! The flat state is singular: many branches of closed states meet there. The assignments name one
//! of them, the one on which every joint bends to the side of its target. It is looked for among
//! small angles q_i = t_i y_i with y_i > 0, by steps that close the loops and change the y_i as little
//! as possible relative to their size,
//!
//! ```text
//! minimise  sum_i (d_i / q_i)^2   with   J d = -gap,
//! ```
//!
//! and that never take more than a part of the way to y_i = 0 (affine scaling, as in interior
//! point methods: I. I. Dikin, 1967).

use lamc::arithmetic::{larger, largest};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

use super::state::{CLOSED, Problem, State};
use super::system::open;

/// Largest angle where the fold begins, rad. Loops of flat sheets close to second order in it, and its
/// square is still far above rounding.
pub const BEGINNING: f64 = 0.02;
/// Iterations of one attempt.
const ITERATIONS: usize = 60;
/// Attempts, each from other angles.
const ATTEMPTS: u64 = 12;
/// Share of the way to flat that a step may take.
const TO_FLAT: f64 = 0.7;
/// A joint that is bent less than this part of the beginning stays flat.
const FLAT: f64 = 1e-4;
/// Angles that all became smaller than this part of the beginning are those of the flat state itself, in which
/// every loop closes: signs that contradict each other leave a gap of second order, which vanishes there.
const SHRUNK: f64 = 0.01;
/// Range of the factors by which the angles of further attempts differ from the targets.
const SPREAD: f64 = 4.0;

/// Why the sheet cannot leave the flat state.
#[derive(Clone, Debug, PartialEq)]
pub struct Stuck {
    /// The loops that stay open in the attempt that came nearest, the most open one first.
    pub loops: Vec<usize>,
    /// Joints that stay flat or bend to the other side.
    pub joints: Vec<usize>,
}

/// Returns a closed state next to the flat one in which all joints bend to the side of their targets.
///
/// # Errors
/// [`Stuck`] if none was found.
pub fn depart(problem: &mut Problem) -> Result<State, Stuck> {
    let most = largest(&problem.targets);
    let mut nearest: Option<(f64, Vec<f64>)> = None;
    for attempt in 0..ATTEMPTS {
        // The same sheet always folds in the same way.
        let mut random = ChaCha8Rng::seed_from_u64(attempt);
        let mut random = || f64::from(random.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
        let guess = problem.targets.iter().map(|target| {
            let factor = SPREAD.powf(if attempt == 0 { 0.0 } else { random() });
            let aside = if attempt == 0 || *target != 0.0 { 0.0 } else { 0.5 * random() };
            BEGINNING * (target / most * factor + aside)
        });
        let q: Vec<f64> = guess.collect();
        let (q, left) = closed(problem, q);
        let folding = q.iter().zip(&problem.targets).filter(|(_, target)| **target != 0.0);
        let has_left = largest(folding.map(|(q, _)| q)) >= SHRUNK * BEGINNING;
        if left <= CLOSED && has_left && stays_flat(problem, &q).is_empty() {
            return Ok(State { q, progress: BEGINNING / most, ..problem.flat() });
        }
        if nearest.as_ref().is_none_or(|(least, _)| left < *least) {
            nearest = Some((left, q));
        }
    }
    let (_, q) = nearest.unwrap_or_default();
    Err(stuck(problem, &q))
}

/// Returns what keeps the sheet flat, judged by the state that came nearest.
pub fn stuck(problem: &Problem, q: &[f64]) -> Stuck {
    let placed = problem.equations.place(q);
    let mut loops: Vec<usize> = (0..placed.len()).filter(|l| placed[*l].open > CLOSED).collect();
    loops.sort_by(|a, b| placed[*b].open.total_cmp(&placed[*a].open));
    Stuck { loops, joints: stays_flat(problem, q) }
}

/// Returns the joints with a target that do not bend to its side.
fn stays_flat(problem: &Problem, q: &[f64]) -> Vec<usize> {
    let bends = |joint: &usize| {
        let target = problem.targets[*joint];
        target != 0.0 && q[*joint] * target.signum() <= FLAT * BEGINNING
    };
    (0..q.len()).filter(bends).collect()
}

/// Closes the loops next to some angles; returns the angles, and how far the loops are open.
fn closed(problem: &mut Problem, mut q: Vec<f64>) -> (Vec<f64>, f64) {
    let none = vec![0.0; problem.equations.rows()];
    let still = vec![0.0; q.len()];
    for _ in 0..ITERATIONS {
        let placed = problem.equations.place(&q);
        if open(&placed) <= CLOSED {
            break;
        }
        // Relative to the beginning, so that the weights are about 1.
        let weights: Vec<f64> = q
            .iter()
            .zip(&problem.targets)
            .map(|(q, target)| match *target == 0.0 {
                true => 1.0,
                false => (BEGINNING / larger(q.abs(), FLAT * BEGINNING)).powi(2),
            })
            .collect();
        problem.equations.factorise(&placed, &weights, &none);
        let Some(step) = problem.equations.solve(&still, &placed, &none) else { break };
        let mut share = 1.0_f64;
        for ((q, change), target) in q.iter().zip(&step.q).zip(&problem.targets) {
            let towards_flat = -change * target.signum();
            if *target != 0.0 && towards_flat > TO_FLAT * q.abs() {
                share = share.min(TO_FLAT * q.abs() / towards_flat);
            }
            share = share.min(BEGINNING / change.abs());
        }
        q.iter_mut().zip(&step.q).for_each(|(q, change)| *q += share * change);
    }
    let left = open(&problem.equations.place(&q));
    (q, left)
}
