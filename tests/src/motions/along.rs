//! Methods of integration against a precise motion, and the motion against its derivatives.

use lamc_runtime::{
    Dopri5, Integrator, Mechanism, Rk4, Rodas, SemiImplicitEuler, acceleration_in_motion,
};
use lamc_workbench::execution::Jit;
use lamc_workbench::verify::solve;

use crate::compare::{keep_largest, largest};

use super::path::{BREAKS_OFF, PARTS, Path, ROUNDING, follow, steps};
use super::subject::{Pair, Point, Subject};
use super::{Found, VAGUE, VAGUELY};

/// The motion backwards: forward with the speeds of the end reversed. Compared is how far it ends from the start,
/// rad. Allowed is the error of the end, which grows on the way back, and that of the way back.
pub fn reversed(pair: &Pair, path: &Path) -> Result<Found, String> {
    let mut start = path.end().clone();
    start.u.iter_mut().for_each(|u| *u = -*u);
    let states = follow(&pair.says.system, &start, path.duration, path.tolerances[0])?;
    let mut end = states[PARTS].clone();
    end.u.iter_mut().for_each(|u| *u = -*u);
    let mut found = Found::NONE;
    let allowed = path.doubt(PARTS) * (1.0 + path.growth);
    found.add(path.distance(&end, &path.precise[0]), allowed);
    Ok(found)
}

/// u against the derivative of q along the motion, and du/dt against that of u: central differences over parts of
/// a step of the precise motion, extrapolated twice, at a quarter, half and three quarters of all steps. Allowed
/// are the difference between both extrapolations, what errors of the integration change, and rounding.
pub fn derivative(pair: &Pair, path: &Path) -> Result<Found, String> {
    let steps = steps(&pair.moves.system, path)?;
    let mut found = Found::NONE;
    for quarter in 1..4 {
        let step = &steps[quarter * steps.len() / 4];
        let duration = step[4].t - step[0].t;
        let around = |tolerance| follow(&pair.moves.system, &step[0], duration, tolerance);
        let [precise, rough] = path.tolerances.map(around);
        differences(&pair.says, [&precise?, &rough?], duration, &mut found)?;
    }
    match found.cases {
        0 => Err(VAGUELY.to_owned()),
        _ => Ok(found),
    }
}

/// Compares the derivatives in the middle of a motion.
fn differences(
    says: &Subject,
    motions: [&[Point]; 2],
    duration: f64,
    found: &mut Found,
) -> Result<(), String> {
    let (system, at) = (&says.system, &motions[0][PARTS / 2]);
    let solution = solve(&says.compiled.topology.mechanism, &says.values(at));
    let solution = solution.map_err(|massless| massless.to_string())?;
    // What motors hold against is rounded, too.
    let rounded = ROUNDING * solution.magnitude * solution.condition();
    let mut rates = vec![0.0; at.u.len()];
    let workspace = &mut system.workspace();
    acceleration_in_motion(system, at.t, &at.q, &at.u, workspace, &mut rates)
        .map_err(|error| error.to_string())?;
    type Numbers = fn(&Point) -> &[f64];
    let numbers: [(Numbers, &[f64], f64); 2] =
        [(|state| &state.q, &at.u, 0.0), (|state| &state.u, &rates, rounded)];
    for (of, expected, rounded) in numbers {
        let (mut off, mut doubt, mut bent) = (0.0, 0.0, [0.0; 2]);
        for (k, expected) in expected.iter().enumerate() {
            let [precise, rough] =
                motions.map(|states| extrapolated(states, duration, &|state| of(state)[k]));
            off = keep_largest(off, (precise[0] - expected).abs());
            let differs = (precise[1] - precise[0]).abs() + (precise[0] - rough[0]).abs();
            doubt = keep_largest(doubt, differs);
            let bends = [PARTS / 8, PARTS / 4]
                .map(|apart| bend(motions[0], duration, apart, &|state| of(state)[k]));
            bent = [0, 1].map(|i| keep_largest(bent[i], bends[i]));
        }
        let rounding = ROUNDING * largest(of(at)) / duration + rounded;
        // A difference across a kink is no derivative.
        let [near, far] = bent;
        if near > doubt + rounding && near > STRAIGHTER * far {
            continue;
        }
        // Nor does one over a time in which rounding decides.
        let allowed = (doubt + rounding) / largest(expected);
        if allowed <= VAGUE {
            found.add(off / largest(expected), allowed);
        }
    }
    Ok(())
}

/// Where a function has two derivatives, halving the distance makes the difference of those from both sides smaller
/// by four; at a kink, it stays.
const STRAIGHTER: f64 = 0.5;

/// By how much the derivatives from both sides differ in the middle of a motion.
fn bend(states: &[Point], duration: f64, apart: usize, of: &dyn Fn(&Point) -> f64) -> f64 {
    let length = apart as f64 * duration / PARTS as f64;
    let slope = |near: usize, far: usize| {
        (4.0 * of(&states[near]) - 3.0 * of(&states[PARTS / 2]) - of(&states[far])) / (2.0 * length)
    };
    let middle = PARTS / 2;
    (slope(middle + apart, middle + 2 * apart) + slope(middle - apart, middle - 2 * apart)).abs()
}

/// The derivative by time in the middle of a motion after two extrapolations, and after one.
fn extrapolated(states: &[Point], duration: f64, of: &dyn Fn(&Point) -> f64) -> [f64; 2] {
    let difference = |apart: usize| {
        let [before, after] = [PARTS / 2 - apart, PARTS / 2 + apart].map(|k| of(&states[k]));
        (after - before) / (2.0 * apart as f64 * duration / PARTS as f64)
    };
    let [fine, middling, coarse] = [PARTS / 8, PARTS / 4, PARTS / 2].map(difference);
    let once = |fine: f64, coarse: f64| fine + (fine - coarse) / 3.0;
    let (near, far) = (once(fine, middling), once(middling, coarse));
    [near + (near - far) / 15.0, near]
}

/// The adaptive methods with their usual tolerances.
pub mod methods {
    use super::*;

    /// Larger tolerances, relative to the usual, and by how much the error falls at least from each to the one
    /// before: by the order 4 of the error estimate of a method of order 5, ten to the power of 4/5; of one of
    /// order 4, 3/4.
    const LARGER: [f64; 3] = [1.0, 10.0, 100.0];
    const FALL: f64 = 5.6;

    /// The explicit method.
    pub fn dopri5(pair: &Pair, path: &Path) -> Result<Found, String> {
        adaptive(pair, path, |factor| {
            let mut method = Dopri5::new(&pair.says.system);
            method.relative *= factor;
            method.absolute *= factor;
            method
        })
    }

    /// The implicit method.
    pub fn rodas(pair: &Pair, path: &Path) -> Result<Found, String> {
        adaptive(pair, path, |factor| {
            let mut method = Rodas::new(&pair.says.system);
            method.relative *= factor;
            method.absolute *= factor;
            method
        })
    }

    /// How far the method ends from the end of the precise motion, rad. Allowed is by how much larger tolerances
    /// change the end, each difference as a share by which errors fall, and what is left of the precise motion's
    /// error.
    fn adaptive<I: Integrator<Jit>>(
        pair: &Pair,
        path: &Path,
        method: impl Fn(f64) -> I,
    ) -> Result<Found, String> {
        let end = |factor: f64| {
            let mut state = path.precise[0].clone();
            let run = method(factor).run(&pair.says.system, &mut state, path.end().t, |_| ());
            run.map(|()| state).map_err(|error| format!("{BREAKS_OFF}: {error}"))
        };
        let [usual, larger, largest] = LARGER.map(end);
        let (usual, larger, largest) = (usual?, larger?, largest?);
        let allowed = path.distance(&usual, &larger)
            + path.distance(&larger, &largest) / FALL
            + path.doubt(PARTS);
        let mut found = Found::NONE;
        found.add(path.distance(&usual, path.end()), allowed);
        Ok(found)
    }
}

/// The methods of fixed step.
pub mod convergence {
    use super::*;

    /// Numbers of steps that are tried.
    const STEPS: [u32; 9] = [4, 8, 16, 32, 64, 128, 256, 512, 1024];

    /// An error is one of the method while it is so many times the difference of the rough motion from the precise
    /// one, whose error is a fortieth of that: the tolerance is a hundredth, to the power of 4/5.
    const CLEAR: f64 = 3.0;

    /// Extrapolation with the right order leaves less than this share of an error. If the order is lower by one
    /// it leaves more: of order 3 instead of 4, 8/15; of order 0 instead of 1, all.
    const LEFT: f64 = 0.5;

    /// The method of order 4, over a quarter of the motion: errors grow.
    pub fn rk4(pair: &Pair, path: &Path) -> Result<Found, String> {
        let system = &pair.says.system;
        let mut method = Rk4::new(system);
        converges(4, [PARTS / 4, PARTS, PARTS / 16, PARTS / 64], path, &mut |state, end, dt| {
            method.run(system, state, end, dt, |_| ()).map_err(|error| error.to_string())
        })
    }

    /// The method of order 1, over so short a part that its steps are short enough.
    pub fn euler(pair: &Pair, path: &Path) -> Result<Found, String> {
        let system = &pair.says.system;
        let mut method = SemiImplicitEuler::new(system);
        converges(
            1,
            [PARTS / 32, PARTS / 128, PARTS / 8, PARTS / 2],
            path,
            &mut |state, end, dt| {
                method.run(system, state, end, dt, |_| ()).map_err(|error| error.to_string())
            },
        )
    }

    /// The order is that of short steps where it changes by less than this from one halving to the next.
    const STEADY: f64 = 0.5;

    type Run<'a> = &'a mut dyn FnMut(&mut Point, f64, f64) -> Result<(), String>;

    /// The share that extrapolation leaves, along the first of some parts of the motion that shows an order: errors
    /// may be too small along a short one, and grow along a long one.
    fn converges(
        order: i32,
        parts: [usize; 4],
        path: &Path,
        run: Run<'_>,
    ) -> Result<Found, String> {
        for part in parts {
            if let Some(share) = left(order, part, path, run) {
                return Ok(Found { cases: 1, error: share, allowed: LEFT });
            }
        }
        Err("no two step lengths have clear errors of the same order".to_owned())
    }

    /// What extrapolation from two step lengths leaves of the error of the shorter, as a share of that. The
    /// shortest steps are compared whose error is clear and falls as steadily as before.
    fn left(order: i32, part: usize, path: &Path, run: Run<'_>) -> Option<f64> {
        let gain = 2_f64.powi(order) - 1.0;
        let end = &path.precise[part];
        let mut last: Option<(Point, f64)> = None;
        let (mut fall, mut share) = (f64::NAN, None);
        for steps in STEPS {
            let mut state = path.precise[0].clone();
            let step = (end.t - state.t) / f64::from(steps);
            if run(&mut state, end.t, step).is_err() {
                (last, fall) = (None, f64::NAN);
                continue;
            }
            let error = path.distance(&state, end);
            if error < CLEAR * path.doubt(part) {
                break;
            }
            if let Some((longer, before)) = &last {
                let is_steady = (before / error / fall).log2().abs() < STEADY;
                fall = before / error;
                // Where errors fall faster, those of higher order are still the larger part.
                let is_short = fall.log2() < f64::from(order) + STEADY;
                let mut better = state.clone();
                let numbers = better.q.iter_mut().chain(&mut better.u);
                let pairs = numbers.zip(longer.q.iter().chain(&longer.u));
                pairs.for_each(|(number, longer)| *number += (*number - longer) / gain);
                share = (is_steady && is_short).then(|| path.distance(&better, end) / error);
            }
            last = Some((state, error));
        }
        share
    }
}
