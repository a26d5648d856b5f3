//! Sheets whose vertices lock each other as drawn: folded states near which their lines are moved ([`rounded::unlocked`]).

use nalgebra::DVector;

use super::closure::Closure;
use super::graph::{Loop, LoopClass, Node, NodeId};
use super::mobility::nearly_closed;
use super::rounded::{self, Vertex};
use super::{chosen, folds, guess};
use crate::laminate::{Joint, Mechanism};
use crate::source::JointId;

/// Angles of the states at which a sheet that locks is made to close, over those of the file's guess.
const FOLDS: [f64; 4] = [1.0, 0.7, 0.4, 1.2];

/// Pivots of the closure that are due to rounding, as thresholds that are tried in turn.
const PIVOTS: [f64; 4] = [0.1, 0.05, 0.02, 0.01];

/// Loops are open that are open by more than this, over their length, next to the file's guess: as drawn, and after hinge
/// lines were moved.
const OPEN: f64 = 1e-12;
const STILL_OPEN: f64 = 1e-10;

/// Shares of the finished fold near which a folded state is looked for, where the file's guess leads to none.
pub const SHARES: [f64; 3] = [0.1, 0.05, 0.2];

/// States of a walk along the fold, and the angles of each over those of the one before.
const STEPS: usize = 7;
const STEP: f64 = 1.3;

/// A joint with a fold is folded if it is bent by this share of the guess, in its direction.
const BENT: f64 = 0.05;

/// Returns the joints after a small movement within the drawing's tolerance with which vertices move
/// that lock each other as drawn; nothing if they do not, or if no folded state is known: neither a guess nor
/// the angles of a finished fold.
pub fn unlocked(
    mechanism: &Mechanism,
    drawn: &[Joint],
    nodes: &[Node],
    loops: &[Loop],
) -> Option<Vec<Joint>> {
    let moving: Vec<usize> = (0..loops.len()).filter(|index| loops[*index].mobility > 0).collect();
    if mechanism.tolerance <= 0.0 || moving.len() < 2 {
        return None;
    }
    let vertices = moving.iter().map(|index| vertex(&loops[*index], nodes));
    let vertices: Vec<Vertex> = vertices.collect::<Option<_>>()?;
    let of_drawing = closure(mechanism, nodes, loops, &moving);
    let folds = folds(mechanism, &of_drawing);
    let first = guess(mechanism, &of_drawing);
    let sheet = Sheet { mechanism, nodes, loops, moving, vertices, folds };
    let shares = SHARES.iter().map(|share| &sheet.folds * *share).filter(|share| *share != first);
    // Of lines that no state folded farther makes better, those whose loops are left open least.
    let mut least: Option<Lines> = None;
    for guess in std::iter::once(&first).cloned().chain(shares).filter(|guess| guess.amax() > 0.0) {
        for small in PIVOTS {
            match sheet.search(drawn, &guess, small) {
                Found::ClosedAsDrawn => return None,
                Found::Nothing => {}
                Found::Lines(lines) if lines.are_good => return Some(lines.joints),
                Found::Lines(lines) => {
                    if least.as_ref().is_none_or(|least| lines.residual < least.residual) {
                        least = Some(lines);
                    }
                }
            }
        }
    }
    least.map(|lines| lines.joints)
}

/// A sheet of vertices that move alone.
struct Sheet<'a> {
    mechanism: &'a Mechanism,
    nodes: &'a [Node],
    loops: &'a [Loop],
    /// The loops of the vertices.
    moving: Vec<usize>,
    vertices: Vec<Vertex>,
    /// The angles of the finished fold.
    folds: DVector<f64>,
}

/// What a search near one state finds.
enum Found {
    /// The loops close without moving lines.
    ClosedAsDrawn,
    Nothing,
    Lines(Lines),
}

/// Joints along lines with which loops close.
struct Lines {
    joints: Vec<Joint>,
    /// By how much loops are open near the guess, over their lengths.
    residual: f64,
    /// Whether no others are looked for.
    are_good: bool,
}

impl Sheet<'_> {
    fn closure<'m>(&'m self, mechanism: &'m Mechanism) -> Closure<'m> {
        closure(mechanism, self.nodes, self.loops, &self.moving)
    }

    fn search(&self, drawn: &[Joint], guess: &DVector<f64>, small: f64) -> Found {
        let Self { mechanism, vertices, folds, .. } = self;
        let states = states(&self.closure(mechanism), guess, small);
        if !is_folded(folds, guess, &states[0]) {
            return Found::Nothing;
        }
        if self.closure(mechanism).largest_residual(&states[0]) <= OPEN {
            return Found::ClosedAsDrawn;
        }
        let Some(joints) = rounded::unlocked(mechanism, drawn, vertices, &states, small) else {
            return Found::Nothing;
        };
        let moved = Mechanism { joints, ..(*mechanism).clone() };
        let closure = self.closure(&moved);
        let state = nearly_closed(&closure, guess, small);
        let residual = closure.largest_residual(&state);
        if residual > STILL_OPEN || !is_folded(folds, guess, &state) {
            return Found::Nothing;
        }
        let is_told = folds.amax() > 0.0;
        let better = is_told.then(|| self.better(&moved, &state, small)).flatten();
        let are_good = !is_told || better.is_some() || residual <= OPEN;
        let joints = better.unwrap_or_else(|| moved.joints.clone());
        Found::Lines(Lines { joints, residual, are_good })
    }

    /// Returns lines from states that are folded farther than the one of the guess, which determine them better: what is left is far
    /// below the tolerance.
    fn better(&self, moved: &Mechanism, state: &DVector<f64>, small: f64) -> Option<Vec<Joint>> {
        let closure = self.closure(moved);
        let residual = closure.largest_residual(state);
        let mut farther = vec![state.clone()];
        while farther.len() < STEPS {
            let next = &farther[farther.len() - 1] * STEP;
            farther.push(nearly_closed(&closure, &next, small));
        }
        farther.iter().rev().find_map(|farther| {
            let states = states(&closure, farther, small);
            let joints = rounded::unlocked(moved, &moved.joints, &self.vertices, &states, small)?;
            let better = Mechanism { joints, ..moved.clone() };
            let closure = self.closure(&better);
            let state = nearly_closed(&closure, state, small);
            (closure.largest_residual(&state) < residual).then_some(better.joints)
        })
    }
}

fn closure<'a>(
    mechanism: &'a Mechanism,
    nodes: &'a [Node],
    loops: &'a [Loop],
    moving: &'a [usize],
) -> Closure<'a> {
    let joints = (0..mechanism.joints.len()).map(JointId).collect();
    Closure::new(mechanism, nodes, chosen(loops, moving), joints)
}

/// Nearly closed states about a guess.
fn states(closure: &Closure, guess: &DVector<f64>, small: f64) -> [DVector<f64>; FOLDS.len()] {
    FOLDS.map(|fold| nearly_closed(closure, &(guess * fold), small))
}

/// Whether every joint with a fold is bent in its direction, as far as the guess tells. Far from closed states, the
/// search may end at one in which the sheet is bent along some straight creases only.
fn is_folded(folds: &DVector<f64>, guess: &DVector<f64>, state: &DVector<f64>) -> bool {
    let mut joints = folds.iter().zip(guess).zip(state).filter(|((fold, _), _)| **fold != 0.0);
    joints.all(|((fold, guess), state)| state * fold.signum() >= BENT * guess * fold.signum())
}

/// Returns a spherical loop as a vertex: its hinges in order, along one side and back along the other.
fn vertex(closed: &Loop, nodes: &[Node]) -> Option<Vertex> {
    let LoopClass::Spherical { centre } = closed.class else { return None };
    let hinge = |node: &NodeId, along: f64| {
        let node = &nodes[node.index()];
        Some((node.joint()?.index(), along * node.sense))
    };
    let there = closed.sides[0].iter().filter_map(|node| hinge(node, 1.0));
    let back = closed.sides[1].iter().rev().filter_map(|node| hinge(node, -1.0));
    Some(Vertex { hinges: there.chain(back).collect(), centre: centre.xy() })
}
