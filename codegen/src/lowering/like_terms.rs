//! Like terms of sums, and signs.
//!
//! ```text
//! 2 x + y + 3 x  ->  5 x + y
//! -(x - y)       ->  y - x          -(2 x)     ->  -2 x
//! ```
//!
//! Only values that nothing else uses are taken apart, so no step takes more operations than it
//! saves. A coefficient that is only the rounding error of a sum is replaced by zero: such terms
//! cancel in exact arithmetic.
//!
//! Common factors stay where they are. To write a x + a y as a (x + y) saves a multiplication where
//! products are not fused with sums, and none where they are; there the six-bar's acceleration
//! takes 15 to 25 % longer with common factors taken, because the compiler finds fewer operations
//! of one kind side by side.
//!
//! Postcondition: no sum has two terms that are multiples of the same value. Sums are re-associated,
//! so results may differ in rounding.

use crate::program::{Function, Instruction, Op, Value};
use std::collections::HashMap;
use std::collections::hash_map::Entry;

use crate::arithmetic::is_same;

/// Merges the like terms of every sum.
pub fn merge(function: Function) -> Function {
    let uses = uses(&function);
    let absorbed = absorbed(&function, &uses);
    let mut merging = Merging {
        old: function.instructions,
        uses,
        absorbed,
        instructions: Vec::new(),
        map: Vec::new(),
    };
    for index in 0..merging.old.len() {
        let value = merging.rewritten(index);
        merging.map.push(value);
    }
    let Merging { map, instructions, .. } = merging;
    Function::renumbered(function.kind, instructions, function.outputs, &map)
}

/// How often each value is used.
pub fn uses(function: &Function) -> Vec<usize> {
    let mut uses = vec![0; function.instructions.len()];
    let operands = function.instructions.iter().flat_map(|i| i.op.operands());
    let entries = function.outputs.iter().flat_map(|o| o.entries.iter().copied());
    operands.chain(entries).for_each(|value| uses[value.index()] += 1);
    uses
}

/// Values that are sums and are used only as a term of one other sum.
pub fn absorbed(function: &Function, uses: &[usize]) -> Vec<bool> {
    let mut absorbed = vec![false; function.instructions.len()];
    for instruction in &function.instructions {
        if let Op::Add(x, y) | Op::Sub(x, y) = instruction.op {
            for term in [x, y] {
                let op = function.instructions[term.index()].op;
                let is_sum = matches!(op, Op::Add(..) | Op::Sub(..));
                absorbed[term.index()] = is_sum && uses[term.index()] == 1;
            }
        }
    }
    absorbed
}

/// A term of a sum: `coefficient` times the product of `factors`.
#[derive(Clone, Debug)]
struct Term {
    coefficient: f64,
    factors: Vec<Value>,
    /// The value as it is and whether it is subtracted, where the term was not changed.
    whole: Option<(Value, bool)>,
}

impl Term {
    /// The factors in an order that does not depend on that of the multiplications.
    fn key(&self) -> Vec<Value> {
        let mut key = self.factors.clone();
        key.sort_unstable();
        key
    }

    /// Whether it is subtracted.
    fn is_negative(&self) -> bool {
        self.whole.map_or(self.coefficient < 0.0, |(_, is_subtracted)| is_subtracted)
    }
}

/// The number and the value of which a product is a multiple.
fn multiple(instructions: &[Instruction], x: Value, y: Value) -> Option<(f64, Value)> {
    match (instructions[x.index()].op, instructions[y.index()].op) {
        (Op::Const(number), _) => Some((number, y)),
        (_, Op::Const(number)) => Some((number, x)),
        _ => None,
    }
}

struct Merging {
    old: Vec<Instruction>,
    /// How often each old value is used.
    uses: Vec<usize>,
    absorbed: Vec<bool>,
    instructions: Vec<Instruction>,
    /// The new value of each old one.
    map: Vec<Value>,
}

impl Merging {
    /// The new value of an old one; those before it have theirs.
    fn rewritten(&mut self, index: usize) -> Value {
        let instruction = self.old[index].clone();
        let op = match instruction.op {
            Op::Add(..) | Op::Sub(..) if !self.absorbed[index] => {
                if let Some(terms) = merged(self.terms(Value(index))) {
                    let value = self.sum(terms, &instruction);
                    self.instructions[value.index()].name = instruction.name;
                    return value;
                }
                instruction.op
            }
            Op::Neg(x) if self.uses[x.index()] == 1 => return self.opposite(x, instruction),
            op => op,
        };
        let op = op.map(|operand| self.map[operand.index()]);
        self.named(instruction, op)
    }

    /// The opposite of an old value that nothing else uses.
    fn opposite(&mut self, x: Value, instruction: Instruction) -> Value {
        let x = self.map[x.index()];
        let op = match self.instructions[x.index()].op {
            Op::Sub(a, b) => Op::Sub(b, a),
            Op::Mul(a, b) => match multiple(&self.instructions, a, b) {
                Some((number, rest)) => Op::Mul(self.push(&instruction, Op::Const(-number)), rest),
                None => Op::Neg(x),
            },
            _ => Op::Neg(x),
        };
        self.named(instruction, op)
    }

    fn named(&mut self, instruction: Instruction, op: Op) -> Value {
        self.instructions.push(Instruction { op, ..instruction });
        Value(self.instructions.len() - 1)
    }

    /// An operation without a name, in the section of `like`.
    fn push(&mut self, like: &Instruction, op: Op) -> Value {
        self.named(Instruction { name: None, ..like.clone() }, op)
    }

    /// The terms of a sum and of the sums that are its terms, from left to right. Sums may be long, so this
    /// does not recurse.
    fn terms(&self, sum: Value) -> Vec<Term> {
        let mut terms = Vec::new();
        let mut left = vec![(sum, 1.0)];
        while let Some((value, sign)) = left.pop() {
            let is_sum = value == sum || self.absorbed[value.index()];
            match self.old[value.index()].op {
                Op::Add(x, y) if is_sum => left.extend([(y, sign), (x, sign)]),
                Op::Sub(x, y) if is_sum => left.extend([(y, -sign), (x, sign)]),
                _ => terms.push(self.term(value, sign)),
            }
        }
        terms
    }

    fn term(&self, value: Value, sign: f64) -> Term {
        let whole = Some((self.map[value.index()], sign < 0.0));
        let mut term = Term { coefficient: sign, factors: Vec::new(), whole };
        match self.old[value.index()].op {
            Op::Mul(..) if self.uses[value.index()] == 1 => self.flatten(value, &mut term),
            Op::Const(number) => term.coefficient *= number,
            // The multiple of a value is like other multiples of it, whoever uses it.
            Op::Mul(x, y) => match multiple(&self.old, x, y) {
                Some((number, rest)) => {
                    term.coefficient *= number;
                    term.factors.push(self.map[rest.index()]);
                }
                None => term.factors.push(self.map[value.index()]),
            },
            _ => term.factors.push(self.map[value.index()]),
        }
        term
    }

    /// The factors of a product and of the products in it that nothing else uses, from left to right.
    fn flatten(&self, product: Value, term: &mut Term) {
        let mut left = vec![product];
        while let Some(value) = left.pop() {
            match self.old[value.index()].op {
                Op::Mul(x, y) if self.uses[value.index()] == 1 => left.extend([y, x]),
                Op::Const(number) => term.coefficient *= number,
                _ => term.factors.push(self.map[value.index()]),
            }
        }
    }

    /// The sum of combined terms, positive ones first.
    fn sum(&mut self, mut terms: Vec<Term>, like: &Instruction) -> Value {
        if terms.is_empty() {
            return self.push(like, Op::Const(0.0));
        }
        if let Some(first) = terms.iter().position(|term| !term.is_negative()) {
            let positive = terms.remove(first);
            terms.insert(0, positive);
        }
        let mut sum = None;
        for term in terms {
            let is_negative = term.is_negative();
            let value = self.product(term, like);
            let op = match (sum, is_negative) {
                (None, false) => {
                    sum = Some(value);
                    continue;
                }
                (None, true) => Op::Neg(value),
                (Some(sum), false) => Op::Add(sum, value),
                (Some(sum), true) => Op::Sub(sum, value),
            };
            sum = Some(self.push(like, op));
        }
        sum.unwrap_or_else(|| unreachable!("there is a term"))
    }

    /// The magnitude of a term.
    fn product(&mut self, term: Term, like: &Instruction) -> Value {
        if let Some((whole, _)) = term.whole {
            return whole;
        }
        let mut factors = term.factors;
        let magnitude = term.coefficient.abs();
        if magnitude != 1.0 || factors.is_empty() {
            factors.insert(0, self.push(like, Op::Const(magnitude)));
        }
        let mut factors = factors.into_iter();
        let first = factors.next();
        let first = first.unwrap_or_else(|| unreachable!("a product has a factor"));
        factors.fold(first, |product, factor| self.push(like, Op::Mul(product, factor)))
    }
}

/// The terms with like ones merged; none where there are none, or where a coefficient overflows.
fn merged(terms: Vec<Term>) -> Option<Vec<Term>> {
    let count = terms.len();
    let mut merged: Vec<(Term, f64)> = Vec::with_capacity(count);
    let mut places = HashMap::with_capacity(count);
    for term in terms {
        let magnitude = term.coefficient.abs();
        match places.entry(term.key()) {
            Entry::Occupied(place) => {
                let (other, largest): &mut (Term, f64) = &mut merged[*place.get()];
                other.coefficient += term.coefficient;
                *largest = largest.max(magnitude);
                other.whole = None;
            }
            Entry::Vacant(place) => {
                place.insert(merged.len());
                merged.push((term, magnitude));
            }
        }
    }
    // The product of coefficients may overflow where no product with the values does.
    if merged.iter().any(|(term, _)| term.whole.is_none() && !term.coefficient.is_finite()) {
        return None;
    }
    let remains = |(term, largest): &(Term, f64)| !is_same(largest + term.coefficient, *largest);
    (merged.len() < count)
        .then(|| merged.into_iter().filter(remains).map(|(term, _)| term).collect())
}
