//! Stage 3: [`Mechanism`] -> [`Topology`]: makes the hinge lines of rounded drawings exact, grows a
//! spanning tree, and finds its loops and the mobility.

pub mod choice;
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
mod unlock;
mod warnings;

pub use graph::*;
pub use sparse::{Echelon, Row as SparseRow};

use nalgebra::DVector;

use crate::laminate::Mechanism;
use crate::source::codes;
use crate::source::{Diagnostic, Diagnostics, Expression, JointId};
use class::HingeLines;
use closure::Closure;
use infinitesimal::Infinitesimal;
use mobility::mobility;
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
    let unlocked = unlock::unlocked(&mechanism, &drawn, &nodes, &found.loops);
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
        comparison: None,
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
        folds * unlock::SHARES[0]
    } else {
        of_each(closure, |joint| rest(mechanism, joint)) * unlock::SHARES[0]
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
