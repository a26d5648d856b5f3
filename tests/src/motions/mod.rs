//! Random mechanisms in motion, and the same mechanism described in another way: what must hold whatever the
//! equations are.
//!
//! | check | what must hold |
//! |---|---|
//! | energy | T + V changes by the work of everything (`work`) |
//! | conserved | T + V stays, where nothing does work |
//! | momentum | the mechanism on a turntable keeps its angular momentum about the table's axis |
//! | reversed | where nothing dissipates, the motion goes back the way it came |
//! | dopri5, rodas | the adaptive methods, as they are used, end where a precise motion ends |
//! | rk4, euler | the methods of fixed step converge to it with their order |
//! | derivative | u is the derivative of q along a motion, and du/dt that of u |
//! | rotated, reordered, swapped, units, other cut | accelerations, energies and reactions do not depend on the description |
//!
//! Every check compares a model that moves with a model that says what must hold. They are the same, but for
//! tests of the checks themselves, which spoil the second.

mod along;
mod conserved;
mod descriptions;
mod edits;
mod path;
mod same;
mod subject;
mod touch;
mod work;

use lamc_workbench::verify::{Check, Remark};

use along::{convergence, derivative, methods, reversed};
use conserved::{conserved, energy, momentum};
use path::Path;
use subject::{NOTHING_MOVES, Pair};

/// Errors above this share decide nothing: a check that allows more is not made.
const VAGUE: f64 = 1e-3;

/// Dampers are weakened so often, while a motion lasts for less than this share of the time in which its fastest
/// joint turns.
const WEAKENED: usize = 2;
const SHORT: f64 = 0.02;

/// Why a motion says nothing.
const VAGUELY: &str =
    "what errors of integration and rounding change is as large as what is compared";

/// The names of all checks.
pub const NAMES: [&str; 14] = [
    "energy",
    "conserved",
    "momentum",
    "reversed",
    "dopri5",
    "rodas",
    "rk4",
    "euler",
    "derivative",
    "rotated",
    "reordered",
    "swapped",
    "units",
    "other cut",
];

/// An error, and what is allowed.
#[derive(Clone, Copy, Debug)]
struct Found {
    cases: usize,
    error: f64,
    allowed: f64,
}

impl Found {
    const NONE: Self = Self { cases: 0, error: 0.0, allowed: f64::MIN_POSITIVE };

    /// Adds a comparison; of all, that with the largest share of what is allowed is kept. NaN is larger than
    /// any.
    fn add(&mut self, error: f64, allowed: f64) {
        self.cases += 1;
        let share = error / allowed;
        let is_worse = share.is_nan() || share > self.error / self.allowed;
        if is_worse {
            (self.error, self.allowed) = (error, allowed);
        }
    }
}

/// The check, or why it could not be made.
fn check(name: &'static str, found: Result<Found, String>) -> Check {
    match found {
        Ok(Found { cases, error, allowed }) => Check::new(name, cases, error, allowed),
        Err(reason) => Check::without(name, Remark::NotChecked(reason)),
    }
}

/// As [`check`], of a motion: not if more is allowed than [`VAGUE`].
fn clear(name: &'static str, found: Result<Found, String>) -> Check {
    let found = found.and_then(|found| match found.allowed <= VAGUE {
        true => Ok(found),
        false => Err(VAGUELY.to_owned()),
    });
    check(name, found)
}

/// All checks that apply to a model.
///
/// # Errors
/// Why lamc refuses the model, or that it has no closed state.
pub fn checks(text: &str) -> Result<Vec<Check>, String> {
    compared(text, text)
}

/// As [`checks`]; what must hold is said by another model with the same bodies and joints.
///
/// # Errors
/// As [`checks`].
pub fn compared(moves: &str, says: &str) -> Result<Vec<Check>, String> {
    let plain = Pair::new(moves, says)?;
    let mut checks = in_motion(&plain);
    checks.extend(descriptions::checks(&plain));
    Ok(checks)
}

fn in_motion(plain: &Pair) -> Vec<Check> {
    let all = Motion::with_dampers(plain);
    let lossless = Motion::of(plain.edited(edits::conservative));
    let along = |check: Along| all.check(check);
    let without_loss = |check: Along| lossless.check(check);
    let mut checks = vec![
        clear(NAMES[0], along(energy)),
        clear(NAMES[1], without_loss(conserved)),
        clear(NAMES[2], momentum(plain)),
        clear(NAMES[3], without_loss(reversed)),
        clear(NAMES[4], along(methods::dopri5)),
        clear(NAMES[5], along(methods::rodas)),
        check(NAMES[6], without_loss(convergence::rk4)),
        check(NAMES[7], without_loss(convergence::euler)),
        clear(NAMES[8], along(derivative)),
    ];
    let does_not_apply = Some(Remark::NotChecked(NOTHING_MOVES.to_owned()));
    checks.retain(|check| check.remark != does_not_apply);
    checks
}

/// A check along a motion.
type Along = fn(&Pair, &Path) -> Result<Found, String>;

/// A model and its motion, or why there is none.
struct Motion(Result<(Pair, Path), String>);

impl Motion {
    fn of(pair: Result<Pair, String>) -> Self {
        Self(pair.and_then(|pair| {
            let path = Path::of(&pair)?;
            Ok((pair, path))
        }))
    }

    /// The motion with dampers. Those that stop a joint within steps that are too short for anything else to move
    /// are weakened until the motion takes a time in which its fastest joint turns.
    fn with_dampers(plain: &Pair) -> Self {
        let mut share = 1.0;
        let mut motion = Self::of(plain.begun(share));
        for _ in 0..WEAKENED {
            let Ok((_, path)) = &motion.0 else { break };
            if path.duration > SHORT * path.intended {
                break;
            }
            share *= path.duration / path.intended / path::ENOUGH_STEPS as f64;
            let weaker = Self::of(plain.begun(share));
            if weaker.0.is_err() {
                break;
            }
            motion = weaker;
        }
        motion
    }

    fn check(&self, check: Along) -> Result<Found, String> {
        let (pair, path) = self.0.as_ref().map_err(Clone::clone)?;
        check(pair, path)
    }
}
