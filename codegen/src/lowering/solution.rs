//! The functions that solve: by which elimination, and whether at all.

use super::closure_factor::Closure;
use super::code::Code;
use super::differentiate::CHANGE_OF;
use super::eliminate::{ByBody, ByEntry, Factor, Factors};
use super::fold::{self, MINUS};
use super::functions;
use super::independent;
use super::labels::{Called, Labels};
use crate::kane::{Elimination, Equations};
use crate::program::{Function, FunctionKind, Moving, Output, Phase, Slot, Value};
use crate::source::{ParameterId, SpeedId};
use crate::topology::NodeId;

/// Operations beyond which a solution is left to the runtime's loops: such a function would be
/// larger than the processor's caches.
const MOST_OPERATIONS: usize = 60_000;

/// The same if loops depend on each other: the runtime's way costs much more for them.
const MOST_OF_SHEETS: usize = 400_000;

/// The same of derivatives, of which there are as many functions as directions.
const MOST_DERIVATIVES: usize = 10_000;

/// Terms of a factor by entry beyond which it is not tried: an elimination by body is cheaper.
const MOST_ENTRIES: usize = 4_000;

/// A function by each elimination that is worth trying, of which the fastest is taken.
pub struct Choice {
    kind: FunctionKind,
    candidates: Vec<Function>,
    /// Operations at most.
    most: usize,
}

impl Choice {
    /// Passes every candidate through `pass`.
    pub fn map(self, pass: impl FnMut(Function) -> Function) -> Self {
        Self { candidates: self.candidates.into_iter().map(pass).collect(), ..self }
    }

    /// Returns the fastest candidate, or a function without outputs where that is too large.
    pub fn best(self) -> Function {
        // Operations, and what they wait for each other.
        let time = |function: &Function| function.cost().total() as u32 + function.critical_path();
        let best = self.candidates.into_iter().min_by_key(time);
        let none = Function::none(self.kind);
        best.filter(|function| function.cost().total() <= self.most).unwrap_or(none)
    }
}

/// From [`FunctionKind::Acceleration`] to [`FunctionKind::JacobianParams`], not optimised yet; `tangent` is
/// [`FunctionKind::Tangent`].
pub fn choices(equations: &Equations, tangent: &Function) -> Vec<Choice> {
    use FunctionKind::{
        Acceleration, Jacobian, JacobianParams, Projection, ProjectionReduction, Reduction,
    };
    let topology = &equations.topology;
    let driven = topology.mechanism.joints.iter().any(|joint| joint.drive.is_some());
    // Rows that depend on each other everywhere have no factor.
    let regular = topology.rank == equations.gamma.len() && !driven;
    let solvable = match (&equations.reduced, &equations.terms) {
        (Some(_), _) => regular || !driven,
        (None, terms) => regular && terms.is_none(),
    };
    let most = if equations.reduced.is_some() { MOST_OF_SHEETS } else { MOST_OPERATIONS };
    let solved = |kind, wanted: bool| {
        let candidates = if wanted { candidates(equations, kind, regular) } else { Vec::new() };
        Choice { kind, candidates, most }
    };
    let parts = |kind| {
        let function =
            equations.terms.as_ref().map(|terms| independent::terms(equations, terms, kind));
        Choice { kind, candidates: function.into_iter().collect(), most: usize::MAX }
    };
    let speeds = topology.mechanism.speeds();
    let parameters = topology.mechanism.parameters.len();
    let derivatives = |kind, directions: usize| {
        let small = tangent.instructions.len() * directions <= 10 * MOST_DERIVATIVES;
        let differentiable =
            regular && small && directions > 0 && entries(equations) <= MOST_ENTRIES;
        let function = differentiable.then(|| jacobian(equations, tangent, kind));
        Choice { kind, candidates: function.into_iter().collect(), most: MOST_DERIVATIVES }
    };
    vec![
        solved(Acceleration, solvable),
        solved(Projection, solvable && !topology.loops.is_empty()),
        parts(Reduction),
        parts(ProjectionReduction),
        derivatives(Jacobian, 2 * speeds + 1),
        derivatives(JacobianParams, parameters),
    ]
}

/// The solution by every elimination that is worth trying; with closure forces only if the rows of the
/// closure are `regular`, that is, independent.
fn candidates(equations: &Equations, kind: FunctionKind, regular: bool) -> Vec<Function> {
    let mut candidates = Vec::new();
    let reduced = equations.reduced.as_ref();
    candidates.extend(reduced.map(|reduced| independent::reduced(equations, reduced, kind)));
    let Some(elimination) = equations.elimination.as_ref().filter(|_| regular) else {
        return candidates;
    };
    if entries(equations) <= MOST_ENTRIES {
        candidates.push(by_entry(equations, kind));
    }
    candidates.push(by_body(equations, elimination, kind));
    candidates
}

/// Entries of L, and for each closure row as many again as M^-1 has work with it.
fn entries(equations: &Equations) -> usize {
    equations.topology.depths().iter().map(|depth| depth * depth).sum()
}

fn by_entry(equations: &Equations, kind: FunctionKind) -> Function {
    let (mut code, outputs) = Code::after(fold::fold(functions::by_entry(equations, kind)));
    let labels = &Labels::of(equations);
    let (mass, closure) = factored(&mut code, equations, labels, &outputs);
    let reduced = match kind {
        FunctionKind::Acceleration => {
            reduced_force(&mut code, labels, &mass, entries_of(&outputs, "forcing"), "")
        }
        _ => Vec::new(),
    };
    let factors = Factors { mass: &mass, closure: &closure, labels };
    finished(code, kind, &outputs, &factors, &reduced)
}

/// L^-T of a force.
fn reduced_force(
    code: &mut Code,
    labels: &Labels,
    mass: &ByEntry,
    force: &[Value],
    direction: &str,
) -> Vec<Value> {
    code.enter(Phase::ReducedForce);
    let derivative = if direction.is_empty() { "" } else { "d_" };
    let name = |joint: usize| format!("{derivative}y_{}{direction}", labels.speeds[joint]);
    mass.reduce(code, force, name)
}

/// M by entry, and the closure beyond it.
fn factored(
    code: &mut Code,
    equations: &Equations,
    labels: &Labels,
    outputs: &[Output],
) -> (ByEntry, Closure) {
    let topology = &equations.topology;
    let nodes = topology.nodes.iter().enumerate();
    let order: Vec<(NodeId, usize)> = nodes
        .flat_map(|(index, node)| {
            node.speeds(&topology.mechanism).map(move |speed| (NodeId(index), speed))
        })
        .collect();
    let mass = ByEntry::of(code, entries_of(outputs, "mass"), &order, labels);
    let jacobian = entries_of(outputs, "jacobian").chunks_exact(order.len().max(1));
    code.enter(Phase::ReducedClosureJacobian);
    let mut rows = Vec::new();
    for (row, entries) in jacobian.enumerate() {
        let name = |joint: usize| format!("y{}_{}", labels.row(row), labels.speeds[joint]);
        rows.push(mass.reduce(code, entries, name));
    }
    let closure = Closure::of(code, labels, mass.inverse_pivots(), &rows);
    (mass, closure)
}

fn by_body(equations: &Equations, elimination: &Elimination, kind: FunctionKind) -> Function {
    let [function, substitution] = functions::by_body(equations, elimination, kind).map(fold::fold);
    let (mut code, outputs) = Code::after(function);
    let inverse_pivots = entries_of(&outputs, "inverse_pivots").to_vec();
    let n = inverse_pivots.len();
    let rows = entries_of(&outputs, "rows").chunks_exact(n.max(1));
    let rows: Vec<Vec<Value>> = rows.map(<[_]>::to_vec).collect();
    let labels = &Labels::of(equations);
    for (row, entries) in rows.iter().enumerate() {
        for (&value, joint) in entries.iter().zip(&labels.speeds) {
            code.rename(value, || format!("y{}_{joint}", labels.row(row)));
        }
    }
    let reduced = entries_of(&outputs, "reduced");
    for (&value, joint) in reduced.iter().zip(&labels.speeds) {
        code.rename(value, || format!("y_{joint}"));
    }
    let closure = Closure::of(&mut code, labels, &inverse_pivots, &rows);
    let factor = ByBody { inverse_pivots, substitution };
    let factors = Factors { mass: &factor, closure: &closure, labels };
    finished(code, kind, &outputs, &factors, reduced)
}

/// The outputs of `kind`, by whichever factor; `reduced` is y.
fn finished<F: Factor>(
    mut code: Code,
    kind: FunctionKind,
    given: &[Output],
    factors: &Factors<'_, F>,
    reduced: &[Value],
) -> Function {
    let of = |name| entries_of(given, name);
    let n = factors.mass.inverse_pivots().len();
    let vector = |name, entries| Output { name, rows: n, columns: 1, entries };
    let mut outputs = Vec::new();
    if kind == FunctionKind::Acceleration {
        let called = Called::itself("acceleration", "lambda");
        let [acceleration, _] = factors.solve(&mut code, &called, reduced, of("gamma"));
        outputs.push(vector("acceleration", acceleration));
    } else {
        outputs.extend(given.iter().filter(|output| output.name == "residual").cloned());
        for (name, called, open) in [
            ("positions", Called::itself("correction_q", "lambda_q"), of("misfit")),
            ("speeds", Called::itself("correction_u", "lambda_u"), of("speeds")),
        ] {
            let correction = factors.correction(&mut code, &called, open);
            outputs.push(vector(name, correction));
        }
    }
    outputs.push(factors.margin(&mut code));
    code.finish(kind, outputs)
}

/// du/dt and its derivatives, by q, u and t or by the parameters: the equations' own changes in each direction, `tangent`,
/// through the factor of the equations.
fn jacobian(equations: &Equations, tangent: &Function, kind: FunctionKind) -> Function {
    let start = functions::by_entry(equations, FunctionKind::Acceleration);
    let (mut code, outputs) = Code::after(fold::fold(start));
    let labels = &Labels::of(equations);
    let (mass, closure) = factored(&mut code, equations, labels, &outputs);
    let factors = Factors { mass: &mass, closure: &closure, labels };
    let y = reduced_force(&mut code, labels, &mass, entries_of(&outputs, "forcing"), "");
    let called = Called::itself("acceleration", "lambda");
    let [acceleration, lambda] =
        factors.solve(&mut code, &called, &y, entries_of(&outputs, "gamma"));
    let (zero, one) = (code.number(0.0), code.number(1.0));
    let n = acceleration.len();
    let mut along = |direction: Moving| {
        let given = |slot| match slot {
            Slot::Acceleration(joint) => Some(acceleration[joint.index()]),
            Slot::Multiplier(row) => Some(lambda[row]),
            Slot::Change(moving) => Some(if moving == direction { one } else { zero }),
            _ => None,
        };
        let called = Called::derivative(labels, direction);
        let changes = code.inline(tangent, given, |name| match is_derivative(name) {
            true => format!("{name}{}", called.direction),
            false => name.to_owned(),
        });
        let y = reduced_force(&mut code, labels, &mass, &changes[0], &called.direction);
        let [derivative, _] = factors.solve(&mut code, &called, &y, &changes[1]);
        derivative
    };
    let speeds = || (0..n).map(SpeedId);
    let parameters = (0..equations.topology.mechanism.parameters.len()).map(ParameterId);
    let derivatives: Vec<(&'static str, Vec<Vec<Value>>)> = match kind {
        FunctionKind::JacobianParams => {
            vec![("dp", parameters.map(|id| along(Moving::Parameter(id))).collect())]
        }
        _ => vec![
            ("dq", speeds().map(|speed| along(Moving::Position(speed))).collect()),
            ("du", speeds().map(|speed| along(Moving::Rate(speed))).collect()),
            ("dt", vec![along(Moving::Time)]),
        ],
    };
    let matrix = |name, columns: &[Vec<Value>]| {
        let entries = (0..n).flat_map(|row| columns.iter().map(move |column| column[row]));
        Output { name, rows: n, columns: columns.len(), entries: entries.collect() }
    };
    let mut outputs = vec![matrix("acceleration", std::slice::from_ref(&acceleration))];
    outputs.extend(derivatives.iter().map(|(name, columns)| matrix(*name, columns)));
    outputs.push(factors.margin(&mut code));
    code.finish(kind, outputs)
}

/// Whether a value of the tangent changes with the direction, by its name.
fn is_derivative(name: &str) -> bool {
    name.strip_prefix(MINUS).unwrap_or(name).starts_with(CHANGE_OF)
}

fn entries_of<'a>(outputs: &'a [Output], name: &str) -> &'a [Value] {
    let output = outputs.iter().find(|output| output.name == name);
    output.map(|output| output.entries.as_slice()).unwrap_or_default()
}
