//! The time until a motion stays near its state of rest, with derivatives by the variables.
//!
//! With w(t, x) = value(t, x) - value at rest(x), the time t of the last crossing of |w| = b changes as
//! dt/dx = -w_x / w_t. It jumps where another crossing becomes the last.

use lamc::pipeline::Compiled;
use lamc_runtime::State;
use nalgebra::DMatrix;

use super::balance::Resting;
use super::design::Design;
use super::goals::{Moving, OfState, Settle};
use super::motion::{TOLERANCE, accurate, at, begin};
use super::number::Number;
use crate::adjoint::{Differentiated, Sample};

/// The motion is looked at so many times; between them it counts as a cubic, which is looked at
const SAMPLES: usize = 512;
/// so many times.
const LOOKS: usize = 8;
/// A crossing is found within this share of the time between two samples.
const NEAREST: f64 = 1e-10;
/// Steps of that search at most.
const SEARCH: usize = 60;

/// When an angle or a position comes to rest, s.
///
/// # Errors
/// It does not until the end, or the motion has no derivatives; the text says so.
pub fn settle(
    compiled: &Compiled,
    differentiated: &Differentiated,
    design: &Design<'_>,
    resting: &Resting,
    goal: &Settle,
) -> Result<Number, String> {
    let at_rest = resting.number(design, goal.of);
    let start = begin(compiled, differentiated)?;
    let watch = Watch { design, of: goal.of, at_rest: at_rest.value };
    let times: Vec<f64> =
        (1..=SAMPLES).map(|index| start.t + goal.until * index as f64 / SAMPLES as f64).collect();
    let samples = accurate(differentiated, &start, &times)?.samples;
    let outside =
        |index: &usize| watch.leaves([&samples[*index], &samples[index + 1]], goal.within);
    if watch.at(&samples[SAMPLES])[0].abs() > goal.within {
        return Err(format!("the motion has not settled after {} s", goal.until));
    }
    let Some(last) = (0..SAMPLES).rev().find(outside) else {
        return Ok(Number::constant(0.0, design.variables()));
    };
    let crossed =
        watch.crossing(differentiated, [&samples[last], &samples[last + 1]], goal.within)?;
    let moving = Moving { of: goal.of, at: crossed.t - start.t };
    let there = at(compiled, differentiated, design, moving)?;
    let rate = watch.at(&crossed)[1];
    let slope = (at_rest.slope - there.slope) / rate;
    Ok(Number { value: moving.at, slope })
}

/// What is looked at.
struct Watch<'d> {
    design: &'d Design<'d>,
    of: OfState,
    at_rest: f64,
}

impl Watch<'_> {
    /// w and its rate.
    fn at(&self, State { q, u, .. }: &Sample) -> [f64; 2] {
        match self.of {
            OfState::Position { point, axis } => {
                let rates = DMatrix::from_column_slice(u.len(), 1, u);
                let (at, moves) = self.design.point_along(point, q, &rates);
                [at[axis] - self.at_rest, moves[(axis, 0)]]
            }
            OfState::Angle(joint) => [q[joint] - self.at_rest, u[joint]],
            // There is no such goal.
            OfState::Energy(_) => [f64::NAN; 2],
        }
    }

    /// Whether |w| is larger than `within` at the first of two samples or between them.
    fn leaves(&self, [first, second]: [&Sample; 2], within: f64) -> bool {
        let cubic = self.cubic([first, second]);
        (0..LOOKS).any(|look| cubic(look as f64 / LOOKS as f64).abs() > within)
    }

    /// The cubic with w and its rate at two samples, by the share of the time between them.
    fn cubic(&self, [first, second]: [&Sample; 2]) -> impl Fn(f64) -> f64 {
        let span = second.t - first.t;
        let ([a, slope_a], [b, slope_b]) = (self.at(first), self.at(second));
        move |share: f64| {
            let rest = 1.0 - share;
            let ends =
                rest * rest * (1.0 + 2.0 * share) * a + share * share * (1.0 + 2.0 * rest) * b;
            ends + span * share * rest * (rest * slope_a - share * slope_b)
        }
    }

    /// The state between two samples after which |w| stays within.
    fn crossing(
        &self,
        differentiated: &Differentiated,
        ends: [&Sample; 2],
        within: f64,
    ) -> Result<Sample, String> {
        let span = ends[1].t - ends[0].t;
        let cubic = self.cubic(ends);
        let last = (0..LOOKS).rev().map(|look| look as f64 / LOOKS as f64);
        let outside = last.into_iter().find(|share| cubic(*share).abs() > within).unwrap_or(0.0);
        // The side on which |w| is too large, and the one on which it is not.
        let (mut outside, mut inside) = (outside, outside + 1.0 / LOOKS as f64);
        let state = |share: f64| match share {
            0.0 => Ok(ends[0].clone()),
            1.0 => Ok(ends[1].clone()),
            _ => accurate(differentiated, ends[0], &[ends[0].t + share * span])
                .map(|course| course.samples[1].clone()),
        };
        let mut found = state(inside)?;
        for _ in 0..SEARCH {
            if inside - outside <= NEAREST {
                break;
            }
            let [w, rate] = self.at(&found);
            // Newton's step where it stays between both, else the middle.
            let newton = (found.t - ends[0].t - (w.abs() - within) / (rate * w.signum())) / span;
            let next = match newton {
                next if next > outside && next < inside => next,
                _ => 0.5 * (outside + inside),
            };
            found = state(next)?;
            let over = self.at(&found)[0].abs() - within;
            if over.abs() <= TOLERANCE * within {
                break;
            }
            if over > 0.0 { outside = next } else { inside = next }
        }
        Ok(found)
    }
}
