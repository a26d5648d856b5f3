//! Long functions in parts of bounded length, each to be a function of its own: compilers take more
//! than proportional time for a long block.
//!
//! Values that one part computes and later parts need are stored in an array. A cell is used again
//! by a later part than the last one that reads it, so that within a part values may be read and
//! put into cells in any order. The backends and the machine code of the workbench cut functions by
//! this.

use std::collections::{BTreeSet, HashMap};

use super::ir::{Function, Op, Slot, Value};

/// A part, by its values.
#[derive(Clone, Debug, Default)]
pub struct Part {
    /// Values of earlier parts that are used here, and the cells they are in.
    pub takes: Vec<(Value, usize)>,
    /// Values that later parts use, and the cells they are to be put in.
    pub leaves: Vec<(Value, usize)>,
    /// Values that are read here.
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
        Self::of_at_most(function, usize::MAX)
    }

    /// Parts of about equal length, of so many instructions at most.
    pub fn of_at_most(function: &Function, longest: usize) -> Self {
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

    /// The instructions of each part, in order.
    pub fn instructions(&self) -> Vec<Vec<Value>> {
        let mut lists = vec![Vec::new(); self.list.len()];
        for (index, &home) in self.home.iter().enumerate() {
            lists[home].push(Value(index));
        }
        lists
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
                self.list[part].takes.push((value, cell_of[value.index()]));
            }
            for &value in &made[part] {
                let cell = free.pop_first().unwrap_or_else(|| {
                    self.cells += 1;
                    self.cells - 1
                });
                cell_of[value.index()] = cell;
                self.list[part].leaves.push((value, cell));
            }
            let read_here = uses[part].iter().filter(|value| self.last[value.index()] == part);
            free.extend(read_here.map(|value| cell_of[value.index()]));
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
    /// Which of sine and cosine are available.
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

/// Whether every part has the value without a cell.
fn is_free(function: &Function, value: Value) -> bool {
    matches!(function.instructions[value.index()].op, Op::Load(_) | Op::Const(_))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::program::tests::random::functions;

    proptest! {
        /// Every value is found where a part looks for it, however the parts order what they do.
        #[test]
        fn cells_hold_what_parts_take(function in functions(), longest in 1_usize..20) {
            let parts = Parts::of_at_most(&function, longest);
            let mut cells = vec![None; parts.cells];
            let lists = parts.instructions();
            prop_assert_eq!(lists.iter().map(Vec::len).sum::<usize>(), function.instructions.len());
            for (index, (part, list)) in parts.list.iter().zip(&lists).enumerate() {
                let taken: BTreeSet<_> = part.takes.iter().map(|(value, _)| *value).collect();
                let of_pairs = list.iter().filter(|value| {
                    matches!(function.instructions[value.index()].op, Op::Sin(_) | Op::Cos(_))
                });
                prop_assert!(list.len() <= longest + of_pairs.count());
                for &(value, cell) in &part.takes {
                    prop_assert_eq!(cells[cell], Some(value));
                }
                for &value in list {
                    for operand in function.instructions[value.index()].op.operands() {
                        let here = parts.home[operand.index()] == index;
                        prop_assert!(here || is_free(&function, operand) || taken.contains(&operand));
                        if let Op::Load(slot) = function.instructions[operand.index()].op {
                            prop_assert!(part.reads.contains(&slot));
                        }
                    }
                }
                for &(value, cell) in &part.leaves {
                    prop_assert!(!part.takes.iter().any(|&(_, taken)| taken == cell));
                    cells[cell] = Some(value);
                }
            }
        }

        #[test]
        fn sine_and_cosine_of_one_angle_are_in_one_part(function in functions()) {
            let parts = Parts::of_at_most(&function, 5);
            for pair in angles(&function) {
                let homes: BTreeSet<_> =
                    pair.members().map(|value| parts.home[value.index()]).collect();
                prop_assert_eq!(homes.len(), 1);
            }
        }
    }
}
