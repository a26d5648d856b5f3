//! Long functions in parts of bounded length, each to be a function of its own: compilers take more
//! than proportional time for a long block.
//!
//! What one part computes and later ones need goes through an array, whose cells are used again as
//! soon as nobody needs what is in them.

use std::collections::{BTreeSet, HashMap};

use crate::program::{Function, Op, Slot, Value};

/// Instructions of a function that is written as one: rustc 1.95 with optimisation and debug
/// information overflows its stack at some 8,000 `let`s one after the other.
const WHOLE: usize = 4000;

/// Instructions of a part at most: shorter ones move more values through memory, longer ones take
/// more time per instruction to compile.
const PART: usize = 1000;

/// A part, by its values.
#[derive(Clone, Debug, Default)]
pub struct Part {
    /// Values of earlier parts that are used here, and the cells they are in: to be read before
    /// anything else.
    pub takes: Vec<(Value, usize)>,
    /// Values that later parts use, and the cells they are to be put in.
    pub leaves: Vec<(Value, usize)>,
    /// What is read here.
    pub reads: BTreeSet<Slot>,
}

/// A function cut into parts.
#[derive(Clone, Debug)]
pub struct Parts {
    /// In order; one where the function is short.
    pub list: Vec<Part>,
    /// Of each value, the part that computes it. Constants and reads are of every part.
    pub home: Vec<usize>,
    /// Of each value, the last part that uses it.
    last: Vec<usize>,
    /// Cells of the array.
    pub cells: usize,
}

impl Parts {
    /// A function as one.
    pub fn whole(function: &Function) -> Self {
        Self::new(function, usize::MAX)
    }

    /// One part where the function is short, else parts of about equal length.
    pub fn bounded(function: &Function) -> Self {
        let is_short = function.instructions.len() <= WHOLE;
        Self::new(function, if is_short { WHOLE } else { PART })
    }

    /// Parts of about equal length, of so many instructions at most.
    fn new(function: &Function, longest: usize) -> Self {
        let instructions = function.instructions.len();
        let count = instructions.div_ceil(longest).max(1);
        let length = instructions.div_ceil(count).max(1);
        let mut parts = Self {
            list: vec![Part::default(); count],
            home: (0..instructions).map(|index| index / length).collect(),
            last: vec![0; instructions],
            cells: 0,
        };
        parts.join_angles(function);
        parts.find_uses(function);
        parts.give_cells(function);
        parts
    }

    /// Whether only the part that computes a value uses it.
    pub fn is_local(&self, value: Value) -> bool {
        self.last[value.index()] == self.home[value.index()]
    }

    /// Sine and cosine of one angle are computed together; those of what is read, first of all.
    fn join_angles(&mut self, function: &Function) {
        for pair in angles(function) {
            let known = if is_read(function, pair.angle) {
                0
            } else {
                pair.members().map(|value| self.home[value.index()]).min().unwrap_or(0)
            };
            pair.members().for_each(|value| self.home[value.index()] = known);
        }
    }

    fn find_uses(&mut self, function: &Function) {
        self.last.copy_from_slice(&self.home);
        for (index, instruction) in function.instructions.iter().enumerate() {
            let home = self.home[index];
            for operand in instruction.op.operands() {
                let last = &mut self.last[operand.index()];
                *last = home.max(*last);
                if let Op::Load(slot) = function.instructions[operand.index()].op {
                    self.list[home].reads.insert(slot);
                }
            }
        }
        for &entry in function.outputs.iter().flat_map(|output| &output.entries) {
            if let Op::Load(slot) = function.instructions[entry.index()].op {
                self.list[self.home[entry.index()]].reads.insert(slot);
            }
        }
    }

    fn give_cells(&mut self, function: &Function) {
        let count = self.list.len();
        // By part: what is used there of earlier parts, what is computed there for later ones.
        let mut uses = vec![BTreeSet::new(); count];
        for (index, instruction) in function.instructions.iter().enumerate() {
            let earlier = |value: &Value| {
                !is_free(function, *value) && self.home[value.index()] < self.home[index]
            };
            uses[self.home[index]].extend(instruction.op.operands().filter(earlier));
        }
        let mut made = vec![Vec::new(); count];
        for index in 0..function.instructions.len() {
            if !is_free(function, Value(index)) && !self.is_local(Value(index)) {
                made[self.home[index]].push(Value(index));
            }
        }
        let mut cell_of = vec![usize::MAX; function.instructions.len()];
        let mut free = BTreeSet::new();
        for part in 0..count {
            for &value in &uses[part] {
                let cell = cell_of[value.index()];
                self.list[part].takes.push((value, cell));
                if self.last[value.index()] == part {
                    free.insert(cell);
                }
            }
            for &value in &made[part] {
                let cell = free.pop_first().unwrap_or_else(|| {
                    self.cells += 1;
                    self.cells - 1
                });
                cell_of[value.index()] = cell;
                self.list[part].leaves.push((value, cell));
            }
        }
    }
}

/// The sine and the cosine of one angle, as far as they are wanted.
#[derive(Clone, Copy, Debug)]
pub struct Angle {
    /// The angle.
    pub angle: Value,
    /// Its sine.
    pub sine: Option<Value>,
    /// Its cosine.
    pub cosine: Option<Value>,
}

impl Angle {
    /// What there is of sine and cosine.
    pub fn members(self) -> impl Iterator<Item = Value> {
        self.sine.into_iter().chain(self.cosine)
    }
}

/// Every angle whose sine or cosine is wanted, in the order in which they are.
pub fn angles(function: &Function) -> Vec<Angle> {
    let mut angles: Vec<Angle> = Vec::new();
    let mut known = HashMap::new();
    for (index, instruction) in function.instructions.iter().enumerate() {
        let (Op::Sin(angle) | Op::Cos(angle)) = instruction.op else { continue };
        let position = *known.entry(angle).or_insert_with(|| {
            angles.push(Angle { angle, sine: None, cosine: None });
            angles.len() - 1
        });
        match instruction.op {
            Op::Sin(_) => angles[position].sine = Some(Value(index)),
            _ => angles[position].cosine = Some(Value(index)),
        }
    }
    angles
}

/// Whether a value is read, not computed.
pub fn is_read(function: &Function, value: Value) -> bool {
    matches!(function.instructions[value.index()].op, Op::Load(_))
}

/// Whether a value can be had anywhere.
fn is_free(function: &Function, value: Value) -> bool {
    matches!(function.instructions[value.index()].op, Op::Load(_) | Op::Const(_))
}
