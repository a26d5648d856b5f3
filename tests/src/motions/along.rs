//! Methods of integration against a precise motion, and the motion against its derivatives.

use lamc_runtime::{Integrator, Mechanism, Rk4, Rodas, SemiImplicitEuler, acceleration_in_motion};
use lamc_workbench::execution::Jit;

use crate::compare::{keep_largest, largest};

use super::Found;
use super::path::{BREAKS_OFF, PARTS, Path, ROUNDING, TOLERANCES, follow};
use super::subject::{Pair, Point};

/// The motion backwards: forward with the speeds of the end reversed. Compared is how far it ends from the start,
/// rad. The same with larger errors on both ways is a bound, and rounding on both ways.
pub fn reversed(pair: &Pair, path: &Path) -> Result<Found, String> {
    let back = |from: &Point, tolerance: f64| {
        let mut start = from.clone();
        start.u.iter_mut().for_each(|u| *u = -*u);
        let states = follow(&pair.says.system, &start, path.duration, tolerance)?;
        let mut end = states.last().cloned().ok_or("no motion")?;
        end.u.iter_mut().for_each(|u| *u = -*u);
        Ok::<Point, String>(end)
    };
    let [precise, rough] = [(&path.precise, TOLERANCES[0]), (&path.rough, TOLERANCES[1])]
        .map(|(states, tolerance)| back(&states[PARTS], tolerance));
    let (precise, rough) = (precise?, rough?);
    let allowed = path.distance(&precise, &rough) + 2.0 * ROUNDING * path.growth;
    let mut found = Found::NONE;
    found.add(path.distance(&precise, &path.precise[0]), allowed);
    Ok(found)
}

/// u against the derivative of q along the motion, and du/dt against that of u, by central differences over one,
/// two and four parts, extrapolated twice. Allowed are the difference between both extrapolations, what errors of
/// the integration change, and rounding.
pub fn derivative(pair: &Pair, path: &Path) -> Result<Found, String> {
    let mut found = Found::NONE;
    for middle in [PARTS / 4, PARTS / 2, 3 * PARTS / 4] {
        let at = &path.precise[middle];
        let system = &pair.says.system;
        let mut rates = vec![0.0; at.u.len()];
        let workspace = &mut system.workspace();
        acceleration_in_motion(system, at.t, &at.q, &at.u, workspace, &mut rates)
            .map_err(|error| error.to_string())?;
        let part = path.duration / PARTS as f64;
        let numbers: [(fn(&Point) -> &[f64], &[f64]); 2] =
            [(|state| &state.q, &at.u), (|state| &state.u, &rates)];
        for (of, expected) in numbers {
            let mut errors = [0.0_f64; 2];
            for (k, expected) in expected.iter().enumerate() {
                let precise = extrapolated(&path.precise, middle, part, &|state| of(state)[k]);
                let rough = extrapolated(&path.rough, middle, part, &|state| of(state)[k]);
                let doubt = (precise[1] - precise[0]).abs() + (precise[0] - rough[0]).abs();
                errors = [
                    keep_largest(errors[0], (precise[0] - expected).abs()),
                    keep_largest(errors[1], doubt),
                ];
            }
            let scale = largest(expected);
            let rounding = ROUNDING * largest(of(at)) / part;
            found.add(errors[0] / scale, (errors[1] + rounding) / scale);
        }
    }
    Ok(found)
}

/// The derivative by time after two extrapolations, and after one.
fn extrapolated(
    states: &[Point],
    middle: usize,
    part: f64,
    of: &dyn Fn(&Point) -> f64,
) -> [f64; 2] {
    let difference = |apart: usize| {
        let [before, after] = [middle - apart, middle + apart].map(|k| of(&states[k]));
        (after - before) / (2.0 * apart as f64 * part)
    };
    let [fine, middling, coarse] = [1, 2, 4].map(difference);
    let once = |fine: f64, coarse: f64| fine + (fine - coarse) / 3.0;
    let (near, far) = (once(fine, middling), once(middling, coarse));
    [near + (near - far) / 15.0, near]
}

/// The adaptive methods with their usual tolerances.
pub mod methods {
    use super::*;

    /// The explicit method.
    pub fn dopri5(pair: &Pair, path: &Path) -> Result<Found, String> {
        let mut integrator = lamc_runtime::Dopri5::new(&pair.says.system);
        let tolerances = [integrator.relative, integrator.absolute];
        adaptive(&mut integrator, tolerances, pair, path)
    }

    /// The implicit method.
    pub fn rodas(pair: &Pair, path: &Path) -> Result<Found, String> {
        let mut integrator = Rodas::new(&pair.says.system);
        let tolerances = [integrator.relative, integrator.absolute];
        adaptive(&mut integrator, tolerances, pair, path)
    }

    /// How far the method ends from the end of the precise motion, rad. Allowed is the error of one step, which
    /// is a mean over 2 N numbers, times the number of steps and the growth of errors.
    fn adaptive(
        integrator: &mut impl Integrator<Jit>,
        [relative, absolute]: [f64; 2],
        pair: &Pair,
        path: &Path,
    ) -> Result<Found, String> {
        let mut state = path.precise[0].clone();
        let mut steps = 0;
        let run = integrator.run(&pair.says.system, &mut state, path.end().t, |_| steps += 1);
        run.map_err(|_| BREAKS_OFF.to_owned())?;
        let largest_of = |of: fn(&Point) -> &[f64]| largest(path.precise.iter().flat_map(of));
        let q = absolute + relative * largest_of(|state| &state.q);
        let u = absolute + relative * largest_of(|state| &state.u);
        let mean = (2.0 * state.q.len() as f64).sqrt();
        let step = mean * q.max(u * path.duration);
        let allowed = f64::from(steps) * step * path.growth + path.doubt();
        let mut found = Found::NONE;
        found.add(path.distance(&state, path.end()), allowed);
        Ok(found)
    }
}

/// The methods of fixed step.
pub mod convergence {
    use super::*;

    /// Numbers of steps that are tried.
    const STEPS: [u32; 9] = [4, 8, 16, 32, 64, 128, 256, 512, 1024];

    /// An error is one of the method while it is so many times what the precise motion may be off.
    const CLEAR: f64 = 100.0;

    /// Extrapolation with the right order leaves less than this share of an error. If the order is lower by one
    /// it leaves more: of order 3 instead of 4, 8/15; of order 0 instead of 1, all.
    const LEFT: f64 = 0.5;

    /// The method of order 4.
    pub fn rk4(pair: &Pair, path: &Path) -> Result<Found, String> {
        let system = &pair.says.system;
        let mut method = Rk4::new(system);
        converges(4, path, &mut |state, end, dt| {
            method.run(system, state, end, dt, |_| ()).map_err(|error| error.to_string())
        })
    }

    /// The method of order 1.
    pub fn euler(pair: &Pair, path: &Path) -> Result<Found, String> {
        let system = &pair.says.system;
        let mut method = SemiImplicitEuler::new(system);
        converges(1, path, &mut |state, end, dt| {
            method.run(system, state, end, dt, |_| ()).map_err(|error| error.to_string())
        })
    }

    /// The order is that of short steps where it changes by less than this from one halving to the next.
    const STEADY: f64 = 0.5;

    type Run<'a> = &'a mut dyn FnMut(&mut Point, f64, f64) -> Result<(), String>;

    /// What extrapolation from two step lengths leaves of the error of the shorter, as a share of that. The
    /// shortest steps are compared whose error is clear and falls as steadily as before.
    fn converges(order: i32, path: &Path, run: Run<'_>) -> Result<Found, String> {
        let gain = 2_f64.powi(order) - 1.0;
        let mut last: Option<(Point, f64)> = None;
        let (mut fall, mut share) = (f64::NAN, None);
        for steps in STEPS {
            let mut state = path.precise[0].clone();
            let step = path.duration / f64::from(steps);
            if run(&mut state, path.end().t, step).is_err() {
                last = None;
                continue;
            }
            let error = path.distance(&state, path.end());
            if error < CLEAR * path.doubt() {
                break;
            }
            if let Some((longer, before)) = &last {
                let is_steady = (before / error / fall).log2().abs() < STEADY;
                fall = before / error;
                let mut better = state.clone();
                let numbers = better.q.iter_mut().chain(&mut better.u);
                let pairs = numbers.zip(longer.q.iter().chain(&longer.u));
                pairs.for_each(|(number, longer)| *number += (*number - longer) / gain);
                if is_steady {
                    share = Some(path.distance(&better, path.end()) / error);
                }
            }
            if std::env::var("DBG").is_ok() {
                eprintln!(
                    "order {order} steps {steps} error {error:.3e} doubt {:.1e} share {share:?} growth {:.1e}",
                    path.doubt(),
                    path.growth
                );
            }
            last = Some((state, error));
        }
        let share = share.ok_or("no two step lengths have clear errors of the same order")?;
        Ok(Found { cases: 1, error: share, allowed: LEFT })
    }
}
