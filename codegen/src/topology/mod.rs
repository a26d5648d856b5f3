//! Stage 3: [`Mechanism`] -> [`Topology`]: makes the hinge lines of rounded drawings exact, grows a
//! spanning tree, and finds its loops and the mobility.

mod class;
mod closure;
mod cycles;
mod graph;
mod inertia;
mod infinitesimal;
mod mobility;
pub mod range;
mod reduction;
mod rounded;
mod sides;
mod sparse;
#[cfg(test)]
mod tests;
mod tree;
mod warnings;

pub use graph::*;
pub use sparse::{Echelon, Row as SparseRow};

use nalgebra::DVector;

use crate::laminate::{Joint, Mechanism};
use crate::source::codes;
use crate::source::{Diagnostic, Diagnostics, Expression, JointId};
use class::HingeLines;
use closure::Closure;
use infinitesimal::Infinitesimal;
use mobility::mobility;
use rounded::Vertex;
use tree::Cut;
use warnings::{flat, jointly_immobile, overdriven, shaky, stretched};

/// Makes nearly parallel and concurrent hinge lines exact, grows a spanning tree, cuts the loops
/// and computes the mobility.
///
/// # Errors
/// Returns errors for joints that can never turn or about which nothing resists rotation, for
/// bodies that no chain of joints connects with the ground or a free body, and for free bodies that one
/// connects with either.
pub fn build(mut mechanism: Mechanism) -> Result<Topology, Diagnostics> {
    let tree = inertia::grow(&mechanism)?;
    let drawn = mechanism.joints.clone();
    rounded::straighten(&mut mechanism);
    let (cuts, copies) = sides::shortest(&mechanism, &tree);
    let nodes: Vec<Node> = tree.nodes.iter().chain(&copies).cloned().collect();
    let mut found = Found::new(&mechanism, &nodes, &cuts);
    let unlocked = unlocked(&mechanism, &drawn, &nodes, &found.loops);
    let is_unlocked = unlocked.is_some();
    if let Some(joints) = unlocked {
        mechanism.joints = joints;
        found = Found::new(&mechanism, &nodes, &cuts);
    }
    let Found { loops, whole, warnings: found } = found;
    let mut warnings = Diagnostics::default();
    warnings.extend(rounded::report(&mechanism, &drawn, is_unlocked));
    warnings.extend(found.0);
    let reduction = whole.assembled.as_ref().and_then(|q| {
        let joints: Vec<JointId> = (0..mechanism.joints.len()).map(JointId).collect();
        let closure = Closure::new(&mechanism, &nodes, &loops, joints);
        reduction::reduction(&closure, &DVector::from_column_slice(q), whole.rank)
    });
    if let Some(warning) = overdriven(&mechanism, whole.mobility, &whole.infinitesimal) {
        warnings.push(warning);
    }
    Ok(Topology {
        nodes: tree.nodes,
        copies,
        loops,
        rank: whole.rank,
        mobility: whole.mobility,
        reduction,
        assembled: whole.assembled,
        infinitesimal: whole.infinitesimal,
        is_shaky: whole.is_shaky,
        warnings,
        mechanism,
    })
}

/// The loops of a mechanism, and how they move.
struct Found {
    loops: Vec<Loop>,
    whole: Whole,
    warnings: Diagnostics,
}

impl Found {
    fn new(mechanism: &Mechanism, nodes: &[Node], cuts: &[Cut]) -> Self {
        let mut warnings = Diagnostics::default();
        let closing = |cut: &Cut| closed_loop(mechanism, nodes, cut, &mut warnings);
        let loops: Vec<Loop> = cuts.iter().map(closing).collect();
        let whole = whole(mechanism, nodes, &loops, &mut warnings);
        Self { loops, whole, warnings }
    }
}

/// Angles of the states at which a sheet that locks is made to close, over those of the file's guess.
const FOLDS: [f64; 4] = [1.0, 0.7, 0.4, 1.2];

/// Pivots of the closure that are due to rounding, as thresholds that are tried in turn.
const PIVOTS: [f64; 4] = [0.1, 0.05, 0.02, 0.01];

/// Loops are open that are open by more than this, over their length, next to the file's guess: as drawn, and after hinge
/// lines were moved.
const OPEN: f64 = 1e-12;
const STILL_OPEN: f64 = 1e-10;

/// Shares of the finished fold near which a folded state is looked for, where the file's guess leads to none.
const SHARES: [f64; 3] = [0.1, 0.05, 0.2];

/// States of a walk along the fold, and the angles of each over those of the one before.
const STEPS: usize = 7;
const STEP: f64 = 1.3;

/// A joint with a fold is folded if it is bent by this share of the guess, in its direction.
const BENT: f64 = 0.05;

/// Returns the joints after a small movement within the drawing's tolerance with which vertices move
/// that lock each other as drawn; nothing if they do not, or if no folded state is known: neither a guess nor
/// the angles of a finished fold.
fn unlocked(
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
    let joints: Vec<JointId> = (0..mechanism.joints.len()).map(JointId).collect();
    let closure = Closure::new(mechanism, nodes, chosen(loops, &moving), joints.clone());
    let folds = folds(mechanism, &closure);
    let first = guess(mechanism, &closure);
    let shares = SHARES.iter().map(|share| &folds * *share).filter(|share| *share != first);
    for guess in std::iter::once(&first).cloned().chain(shares).filter(|guess| guess.amax() > 0.0) {
        for small in PIVOTS {
            let states =
                FOLDS.map(|fold| mobility::nearly_closed(&closure, &(&guess * fold), small));
            let is_folded = |state: &DVector<f64>| is_folded(&folds, &guess, state);
            if !is_folded(&states[0]) {
                continue;
            }
            if closure.largest_residual(&states[0]) <= OPEN {
                return None;
            }
            let Some(lines) = rounded::unlocked(mechanism, drawn, &vertices, &states, small) else {
                continue;
            };
            let moved = Mechanism { joints: lines, ..mechanism.clone() };
            let closure = Closure::new(&moved, nodes, chosen(loops, &moving), joints.clone());
            let state = mobility::nearly_closed(&closure, &guess, small);
            if closure.largest_residual(&state) > STILL_OPEN || !is_folded(&state) {
                continue;
            }
            if folds.amax() == 0.0 {
                return Some(moved.joints);
            }
            // States that are folded farther determine the lines better: what is left is far below the tolerance.
            let mut farther = vec![state];
            while farther.len() < STEPS {
                let next = &farther[farther.len() - 1] * STEP;
                farther.push(mobility::nearly_closed(&closure, &next, small));
            }
            let better = farther.iter().rev().find_map(|guess| {
                let states =
                    FOLDS.map(|fold| mobility::nearly_closed(&closure, &(guess * fold), small));
                rounded::unlocked(&moved, &moved.joints, &vertices, &states, small)
            });
            return Some(better.unwrap_or(moved.joints));
        }
    }
    None
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

/// Computes the mobility of one loop alone.
fn closed_loop(
    mechanism: &Mechanism,
    nodes: &[Node],
    cut: &Cut,
    warnings: &mut Diagnostics,
) -> Loop {
    let [ghost_side, original_side] = &cut.sides;
    let joint_of = |node: &NodeId| nodes[node.index()].joint();
    let around = ghost_side.iter().rev().chain(original_side);
    let joints: Vec<JointId> = around.filter_map(joint_of).collect();
    let lines = HingeLines::new(mechanism, &joints);
    let class = lines.class();
    let writing = lines.writing(&class, nodes[cut.ghost.index()].sense);
    let mut closed = Loop {
        joint: cut.joint,
        original: cut.original,
        ghost: cut.ghost,
        sides: cut.sides.clone(),
        joints: joints.clone(),
        class,
        points: writing.points,
        frame: writing.frame,
        rows: writing.rows,
        rank: 0,
        mobility: 0,
    };
    if let Some(warning) = lines.near_miss(&class) {
        warnings.push(warning);
    }
    let mut columns = joints;
    columns.sort();
    let closure = Closure::new(mechanism, nodes, [&closed], columns);
    let found = mobility(&closure, &guess(mechanism, &closure));
    (closed.rank, closed.mobility) = (found.rank, found.mobility);
    if found.mobility == 0 {
        let name = &mechanism.joints[cut.joint.index()].name;
        let (n, rank) = (closed.joints.len(), found.rank);
        let where_closed = match found.assembled {
            Some(_) => "in isolated configurations",
            None => "in the flat state",
        };
        let message = format!(
            "the loop closed by `{name}` cannot move: its {n} hinges close only {where_closed} \
             ({rank} independent equations){}",
            lines.locked_by_length().map(|text| format!("; {text}")).unwrap_or_default()
        );
        warnings.push(
            Diagnostic::warning(codes::IMMOBILE, mechanism.joints[cut.joint.index()].span, message)
                .label("closes a loop that is rigid")
                .hint("a planar or spherical loop needs four hinges to move, any other seven"),
        );
    }
    closed
}

/// Result of the sampling for all loops together, with one angle per joint of the mechanism.
#[derive(Default)]
struct Whole {
    rank: usize,
    mobility: usize,
    assembled: Option<Vec<f64>>,
    infinitesimal: Vec<JointId>,
    is_shaky: bool,
}

/// Computes the mobility of all loops together.
///
/// Loops that cannot move alone cannot move together with others: their joints stay as drawn. The
/// others form groups that share joints, and ranks and mobilities of the groups add.
fn whole(
    mechanism: &Mechanism,
    nodes: &[Node],
    loops: &[Loop],
    warnings: &mut Diagnostics,
) -> Whole {
    let n = mechanism.joints.len();
    let mut whole = Whole { mobility: mechanism.speeds(), ..Whole::default() };
    let mut q = vec![0.0; n];
    let mut held = vec![false; n];
    let (rigid, moving): (Vec<usize>, Vec<usize>) =
        (0..loops.len()).partition(|i| loops[*i].mobility == 0);
    for group in groups(loops, &rigid, &held) {
        let closure = Closure::new(mechanism, nodes, chosen(loops, &group.loops), group.joints);
        for joint in &closure.joints {
            held[joint.index()] = true;
        }
        whole.mobility -= closure.joints.len();
        whole.rank += mobility(&closure, &DVector::zeros(closure.joints.len())).rank;
    }
    for group in groups(loops, &moving, &held) {
        let closure = Closure::new(mechanism, nodes, chosen(loops, &group.loops), group.joints);
        let found = mobility(&closure, &guess(mechanism, &closure));
        whole.rank += found.rank;
        whole.mobility = whole.mobility + found.mobility - closure.joints.len();
        if found.mobility == 0 {
            let locked = jointly_immobile(mechanism, loops, &group.loops, &closure, found.rank);
            warnings.push(locked);
        }
        let Infinitesimal { stuck, holding, .. } = found.infinitesimal;
        let joint = |column: &usize| closure.joints[*column];
        whole.infinitesimal.extend(holding.iter().map(joint));
        if holding.iter().any(|column| !closure.is_driven(*column)) {
            let is_shaky = holding.iter().any(|column| !stuck.contains(column));
            whole.is_shaky |= is_shaky;
            let stuck: Vec<_> = stuck.iter().map(joint).collect();
            warnings.push(match is_shaky {
                true => shaky(mechanism, loops, &group.loops),
                false => stretched(mechanism, &stuck),
            });
        }
        if let Some(angles) = found.assembled {
            if group.loops.len() > 1 && !is_told(mechanism, &closure) {
                warnings.0.extend(flat(mechanism, &closure, &angles, &stuck));
            }
            for (joint, angle) in closure.joints.iter().zip(angles.iter()) {
                q[joint.index()] = *angle;
            }
            whole.assembled = Some(Vec::new());
        }
    }
    whole.assembled = whole.assembled.map(|_| q);
    whole
}

/// Returns the groups of loops that share joints, with their joints that can move.
struct Group {
    loops: Vec<usize>,
    joints: Vec<JointId>,
}

fn groups(loops: &[Loop], chosen: &[usize], held: &[bool]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for index in chosen {
        let free = loops[*index].joints.iter().filter(|joint| !held[joint.index()]);
        let mut merged = Group { loops: vec![*index], joints: free.copied().collect() };
        let touches = |group: &Group| group.joints.iter().any(|j| merged.joints.contains(j));
        let (touching, apart): (Vec<_>, Vec<_>) = groups.drain(..).partition(touches);
        for group in touching {
            merged.loops.extend(group.loops);
            merged.joints.extend(group.joints);
        }
        merged.loops.sort();
        merged.joints.sort();
        merged.joints.dedup();
        groups = apart;
        groups.push(merged);
    }
    // Loops without a joint that can move are skipped.
    groups.retain(|group| !group.joints.is_empty());
    groups
}

fn chosen<'a>(loops: &'a [Loop], indices: &'a [usize]) -> impl Iterator<Item = &'a Loop> {
    indices.iter().map(|index| &loops[*index])
}

/// Returns a guess of the joints that move: that of the file, or, for a file that starts flat, a share of the finished fold,
/// and of a sheet that has none a share of the angles at which its springs rest.
fn guess(mechanism: &Mechanism, closure: &Closure) -> DVector<f64> {
    let angles = of_each(closure, |joint| mechanism.initial_q[joint]);
    let folds = folds(mechanism, closure);
    if angles.amax() > 0.0 {
        angles
    } else if folds.amax() > 0.0 || closure.loops() < 2 {
        folds * SHARES[0]
    } else {
        of_each(closure, |joint| rest(mechanism, joint)) * SHARES[0]
    }
}

/// Returns whether the file says how the joints that move fold.
fn is_told(mechanism: &Mechanism, closure: &Closure) -> bool {
    let mut joints = closure.joints.iter().map(|joint| joint.index());
    joints.any(|joint| {
        mechanism.initial_q[joint] != 0.0
            || mechanism.joints[joint].fold.is_some_and(|it| it != 0.0)
    })
}

/// Returns the angles of the finished fold of the joints that move, rad; 0 of those without.
fn folds(mechanism: &Mechanism, closure: &Closure) -> DVector<f64> {
    of_each(closure, |joint| mechanism.joints[joint].fold.unwrap_or_default())
}

/// Returns a number of each joint that moves, by the joint's index.
fn of_each(closure: &Closure, of: impl Fn(usize) -> f64) -> DVector<f64> {
    let values = closure.joints.iter().map(|joint| of(joint.index()));
    DVector::from_iterator(closure.joints.len(), values)
}

/// Returns the angle at which the spring of a joint rests, rad, with the parameters' own values; 0 if there is none.
fn rest(mechanism: &Mechanism, joint: usize) -> f64 {
    let rest = mechanism.joints[joint].rest.evaluate(&|leaf: &Expression| match leaf {
        Expression::Parameter(id) => mechanism.parameters[id.index()].value,
        _ => 0.0,
    });
    if rest.is_finite() { rest } else { 0.0 }
}
