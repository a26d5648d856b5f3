//! The functions that solve: by which elimination, and whether at all.

use super::eliminate::{self, ByBody, ByEntry, Closure, Code, Factor};
use super::fold;
use super::ir::{Function, Moving, Output, Slot, Value};
use super::lowering;
use super::signature::FunctionKind;
use crate::kane::{Equations, Phase};
use crate::source::JointId;

/// Operations beyond which a solution is left to the runtime's loops: such a function would be
/// larger than the processor's caches.
const MOST_OPERATIONS: usize = 60_000;

/// The same of derivatives, of which there are as many functions as directions.
const MOST_DERIVATIVES: usize = 10_000;

/// Terms of a factor by entry beyond which it is not tried: an elimination by body is cheaper.
const MOST_ENTRIES: usize = 4_000;

/// [`FunctionKind::Acceleration`], [`FunctionKind::Projection`] and [`FunctionKind::Jacobian`],
/// optimised; `tangent` is [`FunctionKind::Tangent`].
pub fn functions(
    equations: &Equations,
    tangent: &Function,
    optimise: impl Fn(Function) -> Function,
) -> [Function; 3] {
    use FunctionKind::{Acceleration, Jacobian, Projection};
    let topology = &equations.topology;
    let none = |kind| Function { kind, instructions: Vec::new(), outputs: Vec::new() };
    let driven = topology.mechanism.joints.iter().any(|joint| joint.drive.is_some());
    // Rows that depend on each other everywhere need the runtime's decision everywhere.
    let regular = topology.rank == equations.gamma.len() && !driven;
    let best = |kind, most: usize, candidates: Vec<Function>| {
        // Operations, and what they wait for each other.
        let time = |function: &Function| function.cost().total() as u32 + function.critical_path();
        let best = candidates.into_iter().map(&optimise).min_by_key(time);
        best.filter(|function| function.cost().total() <= most).unwrap_or_else(|| none(kind))
    };
    let solved = |kind, wanted: bool| {
        let candidates = if wanted { candidates(equations, kind) } else { Vec::new() };
        best(kind, MOST_OPERATIONS, candidates)
    };
    let directions = 2 * topology.mechanism.joints.len() + 1;
    let small = tangent.instructions.len() * directions <= 10 * MOST_DERIVATIVES;
    let differentiable = regular && small && entries(equations) <= MOST_ENTRIES;
    let derivatives = differentiable.then(|| jacobian(equations, tangent));
    [
        solved(Acceleration, regular),
        solved(Projection, regular && !topology.loops.is_empty()),
        best(Jacobian, MOST_DERIVATIVES, derivatives.into_iter().collect()),
    ]
}

/// The solution by every elimination that is worth trying.
fn candidates(equations: &Equations, kind: FunctionKind) -> Vec<Function> {
    let mut candidates = Vec::new();
    if entries(equations) <= MOST_ENTRIES {
        candidates.push(by_entry(equations, kind));
    }
    candidates.push(by_body(equations, kind));
    candidates
}

/// Entries of L, and for each closure row as many again as M^-1 has work with it.
fn entries(equations: &Equations) -> usize {
    equations.topology.depths().iter().map(|depth| depth * depth).sum()
}

fn by_entry(equations: &Equations, kind: FunctionKind) -> Function {
    let (mut code, outputs) = Code::after(fold::fold(lowering::by_entry(equations, kind)));
    let (factor, closure) = factored(&mut code, equations, &outputs);
    let reduced = match kind {
        FunctionKind::Acceleration => {
            code.enter(Phase::ReducedForce);
            factor.reduce(&mut code, entries_of(&outputs, "forcing"))
        }
        _ => Vec::new(),
    };
    finished(code, kind, &outputs, &factor, &closure, &reduced)
}

/// M by entry, and the closure beyond it.
fn factored(code: &mut Code, equations: &Equations, outputs: &[Output]) -> (ByEntry, Closure) {
    let topology = &equations.topology;
    let order: Vec<usize> = topology.nodes.iter().map(|node| node.joint.index()).collect();
    let names: Vec<&str> =
        topology.mechanism.joints.iter().map(|joint| joint.name.as_str()).collect();
    let factor = ByEntry::of(code, entries_of(outputs, "mass"), &order, &names);
    let jacobian = entries_of(outputs, "jacobian").chunks_exact(order.len().max(1));
    code.enter(Phase::ReducedClosureJacobian);
    let rows: Vec<Vec<Value>> = jacobian.map(|row| factor.reduce(code, row)).collect();
    let closure = Closure::of(code, factor.inverse_pivots(), &rows);
    (factor, closure)
}

fn by_body(equations: &Equations, kind: FunctionKind) -> Function {
    let [function, substitution] = lowering::by_body(equations, kind).map(fold::fold);
    let (mut code, outputs) = Code::after(function);
    let inverse_pivots = entries_of(&outputs, "inverse_pivots").to_vec();
    let n = inverse_pivots.len();
    let rows = entries_of(&outputs, "rows").chunks_exact(n.max(1));
    let rows: Vec<Vec<Value>> = rows.map(<[_]>::to_vec).collect();
    let closure = Closure::of(&mut code, &inverse_pivots, &rows);
    let factor = ByBody { inverse_pivots, substitution };
    finished(code, kind, &outputs, &factor, &closure, entries_of(&outputs, "reduced"))
}

/// The outputs of `kind`, by whichever factor; `reduced` is y.
fn finished(
    mut code: Code,
    kind: FunctionKind,
    given: &[Output],
    factor: &impl Factor,
    closure: &Closure,
    reduced: &[Value],
) -> Function {
    let of = |name| entries_of(given, name);
    let n = factor.inverse_pivots().len();
    let vector = |name, entries| Output { name, rows: n, columns: 1, entries };
    let mut outputs = Vec::new();
    if kind == FunctionKind::Acceleration {
        let [acceleration, _] = eliminate::solve(&mut code, factor, closure, reduced, of("gamma"));
        outputs.push(vector("acceleration", acceleration));
    } else {
        outputs.extend(given.iter().filter(|output| output.name == "residual").cloned());
        for (name, open) in [("positions", of("misfit")), ("speeds", of("speeds"))] {
            let correction = eliminate::correction(&mut code, factor, closure, open);
            outputs.push(vector(name, correction));
        }
    }
    outputs.push(eliminate::margin(&mut code, factor, closure));
    code.finish(kind, outputs)
}

/// du/dt and its derivatives by q, u and t: the equations' own changes in each direction, `tangent`,
/// through the factor of the equations.
fn jacobian(equations: &Equations, tangent: &Function) -> Function {
    let start = lowering::by_entry(equations, FunctionKind::Acceleration);
    let (mut code, outputs) = Code::after(fold::fold(start));
    let (factor, closure) = factored(&mut code, equations, &outputs);
    code.enter(Phase::ReducedForce);
    let y = factor.reduce(&mut code, entries_of(&outputs, "forcing"));
    let gamma = entries_of(&outputs, "gamma");
    let [acceleration, lambda] = eliminate::solve(&mut code, &factor, &closure, &y, gamma);
    let (zero, one) = (code.number(0.0), code.number(1.0));
    let n = acceleration.len();
    let mut along = |direction: Moving| {
        let given = |slot| match slot {
            Slot::Acceleration(joint) => Some(acceleration[joint.index()]),
            Slot::Multiplier(row) => Some(lambda[row]),
            Slot::Change(moving) => Some(if moving == direction { one } else { zero }),
            _ => None,
        };
        let changes = code.inline(tangent, given);
        code.enter(Phase::ReducedForce);
        let y = factor.reduce(&mut code, &changes[0]);
        let [derivative, _] = eliminate::solve(&mut code, &factor, &closure, &y, &changes[1]);
        derivative
    };
    let joints = || (0..n).map(JointId);
    let by_position: Vec<_> = joints().map(|joint| along(Moving::Position(joint))).collect();
    let by_speed: Vec<_> = joints().map(|joint| along(Moving::Rate(joint))).collect();
    let by_time = along(Moving::Time);
    let matrix = |name, columns: &[Vec<Value>]| {
        let entries = (0..n).flat_map(|row| columns.iter().map(move |column| column[row]));
        Output { name, rows: n, columns: columns.len(), entries: entries.collect() }
    };
    let outputs = vec![
        matrix("acceleration", std::slice::from_ref(&acceleration)),
        matrix("dq", &by_position),
        matrix("du", &by_speed),
        matrix("dt", &[by_time]),
        eliminate::margin(&mut code, &factor, &closure),
    ];
    code.finish(FunctionKind::Jacobian, outputs)
}

fn entries_of<'a>(outputs: &'a [Output], name: &str) -> &'a [Value] {
    let output = outputs.iter().find(|output| output.name == name);
    output.map(|output| output.entries.as_slice()).unwrap_or_default()
}
