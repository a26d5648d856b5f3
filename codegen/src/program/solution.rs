//! The functions that solve: by which elimination, and whether at all.

use super::eliminate::{self, ByBody, ByEntry, Code, Reduced};
use super::fold;
use super::ir::{Function, FunctionKind, Output, Value};
use super::lowering;
use crate::kane::Equations;

/// Operations beyond which a solution is left to the runtime's loops: such a function would be
/// larger than the processor's caches.
const MOST_OPERATIONS: usize = 60_000;

/// Terms of a factor by entry beyond which it is not tried: an elimination by body is cheaper.
const MOST_ENTRIES: usize = 4_000;

/// [`FunctionKind::Acceleration`] and [`FunctionKind::Projection`], optimised.
pub fn functions(equations: &Equations, optimise: impl Fn(Function) -> Function) -> [Function; 2] {
    let topology = &equations.topology;
    let none = |kind| Function { kind, instructions: Vec::new(), outputs: Vec::new() };
    let driven = topology.mechanism.joints.iter().any(|joint| joint.drive.is_some());
    // Rows that depend on each other everywhere need the runtime's decision everywhere.
    let regular = topology.rank == equations.gamma.len() && !driven;
    let solved = |kind, wanted: bool| {
        let candidates = wanted.then(|| candidates(equations, kind)).into_iter().flatten();
        // Operations, and what they wait for each other.
        let time = |function: &Function| function.cost().total() as u32 + function.critical_path();
        let best = candidates.map(&optimise).min_by_key(time);
        best.filter(|function| function.cost().total() <= MOST_OPERATIONS)
            .unwrap_or_else(|| none(kind))
    };
    let closed = regular && !topology.loops.is_empty();
    [solved(FunctionKind::Acceleration, regular), solved(FunctionKind::Projection, closed)]
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
    let nodes = &equations.topology.nodes;
    let mut depths: Vec<usize> = Vec::with_capacity(nodes.len());
    for node in nodes {
        let above = node.parent.map_or(0, |parent| depths[parent.index()]);
        depths.push(above + 1);
    }
    depths.iter().map(|depth| depth * depth).sum()
}

fn by_entry(equations: &Equations, kind: FunctionKind) -> Function {
    let topology = &equations.topology;
    let order: Vec<usize> = topology.nodes.iter().map(|node| node.joint.index()).collect();
    let names: Vec<&str> =
        topology.mechanism.joints.iter().map(|joint| joint.name.as_str()).collect();
    let (mut code, outputs) = Code::after(fold::fold(lowering::by_entry(equations, kind)));
    let of = |name| entries_of(&outputs, name);
    let factor = ByEntry::of(&mut code, of("mass"), &order, &names);
    let jacobian = of("jacobian").chunks_exact(order.len().max(1));
    let rows: Vec<Vec<Value>> = jacobian.map(|row| factor.reduce(&mut code, row)).collect();
    match kind {
        FunctionKind::Acceleration => {
            let forcing = factor.reduce(&mut code, of("forcing"));
            let reduced = Reduced { forcing, rows, gamma: of("gamma").to_vec() };
            let outputs = eliminate::acceleration(&mut code, &factor, &reduced);
            code.finish(kind, outputs.into())
        }
        _ => {
            let open = [of("misfit"), of("speeds")];
            let solved = eliminate::corrections(&mut code, &factor, &rows, open);
            projection(code, &outputs, solved)
        }
    }
}

fn by_body(equations: &Equations, kind: FunctionKind) -> Function {
    let [function, substitution] = lowering::by_body(equations, kind).map(fold::fold);
    let (mut code, outputs) = Code::after(function);
    let of = |name| entries_of(&outputs, name);
    let inverse_pivots = of("inverse_pivots").to_vec();
    let n = inverse_pivots.len();
    let factor = ByBody { inverse_pivots, substitution };
    let rows: Vec<Vec<Value>> = of("rows").chunks_exact(n.max(1)).map(<[_]>::to_vec).collect();
    match kind {
        FunctionKind::Acceleration => {
            let (forcing, gamma) = (of("reduced").to_vec(), of("gamma").to_vec());
            let reduced = Reduced { forcing, rows, gamma };
            let outputs = eliminate::acceleration(&mut code, &factor, &reduced);
            code.finish(kind, outputs.into())
        }
        _ => {
            let open = [of("misfit"), of("speeds")];
            let solved = eliminate::corrections(&mut code, &factor, &rows, open);
            projection(code, &outputs, solved)
        }
    }
}

fn projection(code: Code, given: &[Output], solved: [Output; 3]) -> Function {
    let residual = given.iter().filter(|output| output.name == "residual").cloned();
    code.finish(FunctionKind::Projection, residual.chain(solved).collect())
}

fn entries_of<'a>(outputs: &'a [Output], name: &str) -> &'a [Value] {
    let output = outputs.iter().find(|output| output.name == name);
    output.map(|output| output.entries.as_slice()).unwrap_or_default()
}
