//! The state in which a motion starts: closed, and where it differs from what was asked for, with a warning.

use std::f64::consts::{PI, TAU};

use lamc::arithmetic::largest;
use lamc::program::{Interface, JointInfo};
use lamc::topology::Topology;
use lamc_runtime::{Mechanism as _, State, assemble, project};

use super::{Infinitesimal, describe};
use crate::execution::Jit;
use crate::inertia::Digits;

/// A joint that assembly moves from where it was asked to be by more than this is reported, rad.
const FAR: f64 = 5.0 * PI / 180.0;
/// So is one that is bent the other way, from this angle on, rad.
const BENT: f64 = 1e-3;
/// A speed that changes by more than this share of the largest given one is reported.
const OTHER_SPEED: f64 = 0.05;
/// A fold is lost if the state is farther from it than this share of it.
const LOST: f64 = 0.5;
/// Joints that start elsewhere are named one by one up to this number.
const MOST_NAMED: usize = 6;

/// What is asked of the start.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// A guess of q, and u.
    pub state: State<Vec<f64>, f64>,
    /// For each joint, whether its angle is to be kept if the loops can close that way.
    pub pinned: Vec<bool>,
    /// Whether the other angles are a share of the finished fold.
    pub is_folded: bool,
}

impl Asked {
    /// The model's initial state. If there are guesses of angles (rad), only these are to be kept.
    pub fn of(system: &Jit, guess: &[(usize, f64)]) -> Self {
        let mut state = system.initial();
        let joints = system.interface().joints.len();
        let is_pinned = |joint| guess.is_empty() && system.is_pinned(joint);
        let mut pinned: Vec<bool> = (0..joints).map(is_pinned).collect();
        for &(joint, angle) in guess {
            (state.q[joint], pinned[joint]) = (angle, true);
        }
        Self { state, pinned, is_folded: guess.is_empty() }
    }
}

/// Whether a joint may start near an angle, rad.
///
/// # Errors
/// It is driven, or the angle is outside its limits; the text says so.
pub fn allowed(joint: &JointInfo, angle: f64) -> Result<(), String> {
    let name = &joint.name;
    if joint.driven {
        return Err(format!("`{name}` is driven: its angle is prescribed"));
    }
    let [least, greatest] = joint.limits;
    if (least..=greatest).contains(&angle) {
        return Ok(());
    }
    let [angle, least, greatest] = [angle, least, greatest].map(f64::to_degrees);
    Err(format!(
        "the initial angle of `{name}` is outside its limits: {angle:.4} deg is not within {least:.4} .. \
         {greatest:.4} deg"
    ))
}

/// The closed state nearest to what is asked, at consistent speeds; `warn` is told where it differs.
///
/// # Errors
/// No closed state was found, or there are small motions in it that do not exist ([`Infinitesimal`]); the text says so.
pub fn start(
    topology: &Topology,
    system: &Jit,
    asked: &Asked,
    mut warn: impl FnMut(String),
) -> Result<State<Vec<f64>, f64>, String> {
    let interface = system.interface();
    let Asked { state: wanted, pinned, is_folded } = asked;
    let mut state = wanted.clone();
    let mut workspace = system.workspace();
    assemble(system, state.t, &mut state.q, pinned, &mut workspace).map_err(|error| {
        let reason = describe(&error, interface);
        format!("no closed configuration near the initial one: {reason}")
    })?;
    moves(interface, pinned, &wanted.q, &state.q).into_iter().for_each(&mut warn);
    if *is_folded {
        lost_fold(interface, pinned, &wanted.q, &state.q).into_iter().for_each(&mut warn);
    }
    project(system, state.t, &mut state.q, &mut state.u, &mut workspace)
        .map_err(|error| describe(&error, interface))?;
    speeds(interface, &wanted.u, &state.u).into_iter().for_each(&mut warn);
    let few = Digits::at(system, interface, &state).and_then(|digits| digits.warning());
    few.into_iter().for_each(warn);
    match Infinitesimal::find(topology, system, &state.q) {
        Some(found) => Err(found.to_string()),
        None => Ok(state),
    }
}

/// Warnings of joints with a given guess (rad) that start elsewhere: of each, or of a sheet's in one line.
pub fn moves(interface: &Interface, given: &[bool], asked: &[f64], q: &[f64]) -> Vec<String> {
    const REASON: &str = "the loops do not close with this angle and the other given angles";
    let joints = interface.joints.iter().zip(given).zip(asked.iter().zip(q));
    let mut moves = Vec::new();
    for ((joint, given), (asked, q)) in joints {
        let moved = turn(*asked, *q);
        let is_flipped =
            asked.abs().min(q.abs()) > BENT && asked * q < 0.0 && (q - asked).abs() < PI;
        if *given && !joint.driven && (moved.abs() > FAR || is_flipped) {
            let text = format!(
                "`{}` should start at {:.4} deg but starts at {:.4} deg",
                joint.name,
                asked.to_degrees(),
                q.to_degrees()
            );
            moves.push((moved.abs(), text));
        }
    }
    tell(&moves, REASON, |count| {
        format!(
            "{count} of {} joints do not start at the angle that is given, because the loops do not close \
             with these angles",
            q.len()
        )
    })
}

/// Warnings of joints with a given speed (rad/s, not 0) that start at another one.
fn speeds(interface: &Interface, asked: &[f64], u: &[f64]) -> Vec<String> {
    const REASON: &str = "the loops do not stay closed with this speed and the other given speeds";
    let allowed = OTHER_SPEED * largest(asked);
    let joints = interface.joints.iter().zip(asked.iter().zip(u));
    let given = joints.filter(|(joint, (asked, _))| **asked != 0.0 && !joint.driven);
    let changed = given.map(|(joint, (asked, u))| {
        let text = format!(
            "`{}` should start with {:.4} deg/s but starts with {:.4} deg/s",
            joint.name,
            asked.to_degrees(),
            u.to_degrees()
        );
        ((u - asked).abs(), text)
    });
    let changed: Vec<_> = changed.filter(|(change, _)| *change > allowed).collect();
    tell(&changed, REASON, |count| {
        format!(
            "{count} of {} joints do not start with the speed that is given, because the loops do not stay \
             closed with these speeds",
            u.len()
        )
    })
}

/// A warning of a share of the finished fold (rad, of the joints whose angle is not given) near which no closed
/// state was found.
pub fn lost_fold(
    interface: &Interface,
    given: &[bool],
    asked: &[f64],
    q: &[f64],
) -> Option<String> {
    let joints = interface.joints.iter().zip(given).zip(asked.iter().zip(q));
    // What has no fold is not asked to be anywhere.
    let folded =
        joints.filter(|((joint, given), (asked, _))| !**given && !joint.driven && **asked != 0.0);
    let folded: Vec<_> = folded.map(|((joint, _), (asked, q))| (joint, asked, q)).collect();
    let norm = |lengths: &mut dyn Iterator<Item = f64>| lengths.map(|x| x * x).sum::<f64>().sqrt();
    let whole = norm(&mut folded.iter().map(|(_, asked, _)| **asked));
    let away = norm(&mut folded.iter().map(|(_, asked, q)| turn(**asked, **q)));
    let far = |(_, asked, q): &(_, &f64, &f64)| turn(**asked, **q).abs();
    let farthest = folded.iter().max_by(|a, b| far(a).total_cmp(&far(b)));
    let (joint, asked, q) = farthest.filter(|_| away > LOST * whole)?;
    Some(format!(
        "the motion does not start near the initial fold, because no closed state was found there: the angles \
         are {:.0} % of it away; the farthest: `{}` should start at {:.4} deg but starts at {:.4} deg (give \
         angles of a closed state under `initial.q`, as `lamc fold` finds them)",
        100.0 * away / whole,
        joint.name,
        asked.to_degrees(),
        q.to_degrees()
    ))
}

/// How far a joint turns from one angle to another, rad: whole turns do not matter.
fn turn(from: f64, to: f64) -> f64 {
    (to - from + PI).rem_euclid(TAU) - PI
}

/// A warning of each change, or of all in one line.
fn tell(changes: &[(f64, String)], reason: &str, all: impl FnOnce(usize) -> String) -> Vec<String> {
    if changes.len() <= MOST_NAMED {
        return changes.iter().map(|(_, text)| format!("{text}: {reason}")).collect();
    }
    let farthest = changes.iter().max_by(|(a, _), (b, _)| a.total_cmp(b));
    let farthest = farthest.map_or("", |(_, text)| text);
    vec![format!("{}; the farthest: {farthest}", all(changes.len()))]
}
