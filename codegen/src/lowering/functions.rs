//! Trees become instructions: one function per [`FunctionKind`], each from the bindings it needs;
//! what is a derivative is differentiated here.
//!
//! Postcondition: every operand precedes its use; a named binding that is an operation carries its
//! name. A sum is a chain of additions and subtractions, a product multiplies its numbers first
//! and divides once.

use crate::kane::{Elimination, Equations, Leaf};
use crate::program::{
    Array, Function, FunctionKind, Instruction, Interface, Op, Output, Phase, Section, Slot, Value,
};
use crate::source::SpeedId;
use crate::symbolic::{Function as SymbolicFunction, Tree};

use super::dead;
use super::differentiate::{self, Directions};

/// Every function of the mechanism that is written directly from the equations, in the order of
/// [`FunctionKind`].
pub fn functions(equations: &Equations, interface: &Interface) -> Vec<Function> {
    use FunctionKind::{
        Closure, Contacts, Control, Drives, Energy, Equations as Motion, Momentum, Points, Poses,
        Reactions, Tangent,
    };
    let e = equations;
    let kinetic = std::slice::from_ref(&e.kinetic_energy);
    let potential = std::slice::from_ref(&e.potential_energy);
    let of = |kind: FunctionKind, trees: &[&[Tree<Leaf>]]| {
        let shaped = |(output, trees): (&Array, _)| {
            let [rows, columns] = output.shape.of(interface);
            (output.name, rows, columns, trees)
        };
        let outputs: Vec<_> =
            kind.signature().outputs.iter().zip(trees.iter().copied()).map(shaped).collect();
        function(e, kind, &outputs)
    };
    let angles = function(e, Drives, &[("angle", e.drives.len(), 1, &e.drives)]);
    vec![
        of(Motion, &[&e.mass, &e.forcing, &e.jacobian, &e.gamma]),
        of(Closure, &[&e.residual, &e.residual_jacobian]),
        of(Poses, &[&e.poses]),
        of(Points, &[&e.points]),
        of(Energy, &[kinetic, potential]),
        drives(angles),
        of(Contacts, &[&e.contacts]),
        gaps(e, interface),
        of(Reactions, &[&e.reactions]),
        match &e.momentum {
            Some(momentum) => of(Momentum, &[momentum]),
            None => Function::none(Momentum),
        },
        match &e.control {
            Some([next, commands]) => of(Control, &[next, commands]),
            None => Function::none(Control),
        },
        differentiate::along_changes(
            of(Tangent, &[&e.imbalance, &e.opening]),
            &Directions::of(interface),
        ),
    ]
}

/// Inputs of the elimination by entry: `mass` and `jacobian`, and either `forcing` and `gamma` or
/// what a projection wants.
pub fn by_entry(equations: &Equations, kind: FunctionKind) -> Function {
    let n = equations.mechanism().speeds();
    let rows = equations.gamma.len();
    let mut outputs: Vec<(_, _, _, &[_])> =
        vec![("mass", n, n, &equations.mass), ("jacobian", rows, n, &equations.jacobian)];
    match kind {
        FunctionKind::Acceleration => {
            outputs.push(("forcing", n, 1, &equations.forcing));
            outputs.push(("gamma", rows, 1, &equations.gamma));
        }
        _ => outputs.extend(misfit(equations)),
    }
    function(equations, kind, &outputs)
}

/// Inputs of the elimination by body: `inverse_pivots`, `rows`, and either `reduced` and `gamma` or
/// what a projection wants; and the substitution.
pub fn by_body(
    equations: &Equations,
    elimination: &Elimination,
    kind: FunctionKind,
) -> [Function; 2] {
    let n = equations.mechanism().speeds();
    let rows = equations.gamma.len();
    let mut outputs: Vec<(_, _, _, &[_])> = vec![
        ("inverse_pivots", n, 1, &elimination.inverse_pivots),
        ("rows", rows, n, &elimination.reduced_rows),
    ];
    match kind {
        FunctionKind::Acceleration => {
            outputs.push(("reduced", n, 1, &elimination.reduced));
            outputs.push(("gamma", rows, 1, &equations.gamma));
        }
        _ => outputs.extend(misfit(equations)),
    }
    let substitution = [("acceleration", n, 1, elimination.accelerations.as_slice())];
    [function(equations, kind, &outputs), function(equations, kind, &substitution)]
}

/// How far the loops are open, and how fast they open.
fn misfit(equations: &Equations) -> [(&'static str, usize, usize, &[Tree<Leaf>]); 3] {
    let (rows, loops) = (equations.gamma.len(), equations.topology.loops.len());
    [
        ("residual", 9 * loops, 1, &equations.residual),
        ("misfit", rows, 1, &equations.row_residual),
        ("speeds", rows, 1, &equations.row_velocity),
    ]
}

/// The gaps of contact points, and the derivatives of the points' velocities by u; nothing without contacts.
fn gaps(equations: &Equations, interface: &Interface) -> Function {
    let (kind, gaps) = (FunctionKind::Gaps, &equations.gaps);
    let points = interface.contacts.len();
    if points == 0 {
        return Function::none(kind);
    }
    let [gap, friction, normal] = [&gaps.gap, &gaps.friction, &gaps.normal].map(Vec::as_slice);
    let places =
        [("gap", points, 2, gap), ("friction", points, 1, friction), ("normal", points, 3, normal)];
    let velocity = function(equations, kind, &[("rows", 3 * points, 1, &equations.gaps.velocity)]);
    let by_speed = |speed| dead::dead(differentiate::by_speed(velocity.clone(), SpeedId(speed)));
    let mut parts: Vec<Function> = (0..interface.speeds()).map(by_speed).collect();
    parts.push(function(equations, kind, &places));
    let (instructions, mut outputs) = together(parts);
    let mut all = outputs.split_off(interface.speeds());
    all.push(beside("rows", &outputs));
    Function { kind, instructions, outputs: all }
}

/// Each driven angle followed by its first three derivatives by t.
fn drives(angles: Function) -> Function {
    let kind = angles.kind;
    let speeds = differentiate::by_time(angles.clone());
    let accelerations = differentiate::by_time(speeds.clone());
    let jerks = differentiate::by_time(accelerations.clone());
    let (instructions, columns) = together(vec![angles, speeds, accelerations, jerks]);
    Function { kind, instructions, outputs: vec![beside("drives", &columns)] }
}

/// The instructions of several functions, one after the other, and all their outputs.
fn together(parts: Vec<Function>) -> (Vec<Instruction>, Vec<Output>) {
    let (mut instructions, mut outputs) = (Vec::new(), Vec::new());
    for part in parts {
        let shift = instructions.len();
        let moved = |value: Value| Value(value.index() + shift);
        outputs.extend(part.outputs.into_iter().map(|output| {
            let entries = output.entries.into_iter().map(moved).collect();
            Output { entries, ..output }
        }));
        instructions.extend(
            part.instructions.into_iter().map(|i| Instruction { op: i.op.map(moved), ..i }),
        );
    }
    (instructions, outputs)
}

/// One matrix with these columns.
fn beside(name: &'static str, columns: &[Output]) -> Output {
    let rows = columns.first().map_or(0, |column| column.entries.len());
    let entries = (0..rows).flat_map(|row| columns.iter().map(move |column| column.entries[row]));
    Output { name, rows, columns: columns.len(), entries: entries.collect() }
}

/// The function with these outputs.
pub fn function(
    equations: &Equations,
    kind: FunctionKind,
    outputs: &[(&'static str, usize, usize, &[Tree<Leaf>])],
) -> Function {
    let needed = needed(equations, outputs.iter().flat_map(|output| output.3));
    let mut lowering = Lowering {
        instructions: Vec::new(),
        bound: vec![None; equations.bindings.len()],
        section: Section::mechanism(Phase::Output),
    };
    for (index, binding) in equations.bindings.iter().enumerate().filter(|(i, _)| needed[*i]) {
        lowering.section = binding.section;
        let value = lowering.tree(&binding.tree);
        lowering.bound[index] = Some(value);
        let instruction = &mut lowering.instructions[value.index()];
        if !matches!(instruction.op, Op::Const(_) | Op::Load(_)) && instruction.name.is_none() {
            instruction.name = Some(binding.name.clone());
        }
    }
    lowering.section = Section::mechanism(Phase::Output);
    let outputs = outputs
        .iter()
        .map(|&(name, rows, columns, trees)| {
            let entries = trees.iter().map(|tree| lowering.tree(tree)).collect();
            Output { name, rows, columns, entries }
        })
        .collect();
    Function { kind, instructions: lowering.instructions, outputs }
}

/// Which bindings the given trees depend on.
fn needed<'a>(equations: &Equations, trees: impl Iterator<Item = &'a Tree<Leaf>>) -> Vec<bool> {
    let mut needed = vec![false; equations.bindings.len()];
    trees.for_each(|tree| mark(tree, &mut needed));
    for index in (0..needed.len()).rev() {
        if needed[index] {
            mark(&equations.bindings[index].tree, &mut needed);
        }
    }
    needed
}

fn mark(tree: &Tree<Leaf>, needed: &mut [bool]) {
    match tree {
        Tree::Leaf(Leaf::Bound(id)) => needed[id.index()] = true,
        Tree::Rational(..) | Tree::Number(_) | Tree::Leaf(_) => {}
        Tree::Power(base, _) => mark(base, needed),
        Tree::Sum(parts) | Tree::Product(parts) | Tree::Apply(_, parts) => {
            parts.iter().for_each(|part| mark(part, needed));
        }
    }
}

struct Lowering {
    instructions: Vec<Instruction>,
    bound: Vec<Option<Value>>,
    section: Section,
}

impl Lowering {
    fn push(&mut self, op: Op) -> Value {
        self.instructions.push(Instruction { op, section: self.section, name: None });
        Value(self.instructions.len() - 1)
    }

    fn tree(&mut self, tree: &Tree<Leaf>) -> Value {
        match tree {
            Tree::Rational(numerator, denominator) => {
                self.push(Op::Const(*numerator as f64 / *denominator as f64))
            }
            Tree::Number(value) => self.push(Op::Const(*value)),
            Tree::Leaf(leaf) => self.leaf(*leaf),
            Tree::Sum(terms) => self.sum(terms),
            Tree::Product(factors) => match self.product(factors) {
                (true, value) => self.push(Op::Neg(value)),
                (false, value) => value,
            },
            Tree::Power(base, exponent) => {
                let power = self.power(base, exponent.unsigned_abs());
                if *exponent > 0 {
                    return power;
                }
                let one = self.push(Op::Const(1.0));
                self.push(Op::Div(one, power))
            }
            Tree::Apply(function, arguments) => {
                let arguments: Vec<_> = arguments.iter().map(|x| self.tree(x)).collect();
                let (x, y) = (arguments[0], arguments[arguments.len() - 1]);
                self.push(match function {
                    SymbolicFunction::Sin => Op::Sin(x),
                    SymbolicFunction::Cos => Op::Cos(x),
                    SymbolicFunction::Tan => Op::Tan(x),
                    SymbolicFunction::Exp => Op::Exp(x),
                    SymbolicFunction::Ln => Op::Ln(x),
                    SymbolicFunction::Sqrt => Op::Sqrt(x),
                    SymbolicFunction::Abs => Op::Abs(x),
                    SymbolicFunction::Step => Op::Step(x),
                    SymbolicFunction::Tanh => Op::Tanh(x),
                    SymbolicFunction::Min => Op::Min(x, y),
                    SymbolicFunction::Max => Op::Max(x, y),
                    SymbolicFunction::Pow => Op::Pow(x, y),
                    SymbolicFunction::Atan2 => Op::Atan2(x, y),
                })
            }
        }
    }

    fn leaf(&mut self, leaf: Leaf) -> Value {
        self.push(match leaf {
            Leaf::Time => Op::Load(Slot::Time),
            Leaf::Position(id) => Op::Load(Slot::Position(id)),
            Leaf::Rate(id) => Op::Load(Slot::Rate(id)),
            Leaf::Parameter(id) => Op::Load(Slot::Parameter(id)),
            Leaf::Input(id) => Op::Load(Slot::Input(id)),
            Leaf::Acceleration(id) => Op::Load(Slot::Acceleration(id)),
            Leaf::Multiplier(row) => Op::Load(Slot::Multiplier(row)),
            Leaf::Memory(id) => Op::Load(Slot::Memory(id)),
            Leaf::Bound(id) => match self.bound[id.index()] {
                Some(value) => return value,
                None => unreachable!("bindings refer to earlier ones, all of them needed"),
            },
        })
    }

    /// Positive terms first, so that the chain starts without a negation where it can.
    fn sum(&mut self, terms: &[Tree<Leaf>]) -> Value {
        let mut signed: Vec<_> = terms.iter().map(|term| self.signed(term)).collect();
        if let Some(first) = signed.iter().position(|(negative, _)| !negative) {
            let positive = signed.remove(first);
            signed.insert(0, positive);
        }
        let (negative, first) = signed[0];
        let first = if negative { self.push(Op::Neg(first)) } else { first };
        signed[1..].iter().fold(first, |sum, &(negative, term)| {
            self.push(if negative { Op::Sub(sum, term) } else { Op::Add(sum, term) })
        })
    }

    /// Whether a term is negated, and its magnitude.
    fn signed(&mut self, term: &Tree<Leaf>) -> (bool, Value) {
        match term {
            Tree::Product(factors) => self.product(factors),
            Tree::Rational(numerator, denominator) if *numerator < 0 => {
                let value = Tree::Rational(-numerator, *denominator);
                (true, self.tree(&value))
            }
            other => (false, self.tree(other)),
        }
    }

    /// Whether a product is negative, and its magnitude: numbers, then symbols, then one division.
    fn product(&mut self, factors: &[Tree<Leaf>]) -> (bool, Value) {
        let mut coefficient = 1.0;
        let (mut above, mut below) = (Vec::new(), Vec::new());
        for factor in factors {
            match factor {
                Tree::Rational(a, b) => coefficient *= *a as f64 / *b as f64,
                Tree::Number(value) => coefficient *= value,
                Tree::Power(base, exponent) if *exponent < 0 => {
                    below.push(self.power(base, exponent.unsigned_abs()));
                }
                other => above.push(self.tree(other)),
            }
        }
        let magnitude = f64::abs(coefficient);
        if magnitude != 1.0 || above.is_empty() {
            let number = self.push(Op::Const(magnitude));
            above.insert(0, number);
        }
        let mut multiply = |values: Vec<Value>| {
            values.into_iter().reduce(|product, value| self.push(Op::Mul(product, value)))
        };
        let value = match (multiply(above), multiply(below)) {
            (Some(above), Some(below)) => self.push(Op::Div(above, below)),
            (Some(above), None) => above,
            (None, _) => unreachable!("a product has a numerator"),
        };
        (coefficient < 0.0, value)
    }

    /// base^exponent by repeated squaring, exponent >= 1.
    fn power(&mut self, base: &Tree<Leaf>, exponent: u64) -> Value {
        let mut square = self.tree(base);
        let mut result = None;
        let mut left = exponent;
        loop {
            if left % 2 == 1 {
                result = Some(match result {
                    Some(product) => self.push(Op::Mul(product, square)),
                    None => square,
                });
            }
            left /= 2;
            match result {
                Some(product) if left == 0 => return product,
                _ => square = self.push(Op::Mul(square, square)),
            }
        }
    }
}
