//! Names of local values. The program may have named a value; otherwise the name says what the value is
//! part of, or from which operands it is computed.
//!
//! Most values have a name from the derivation. The others are terms of a sum or factors of a product
//! that became too long for one line (`omega_left_x_sum`), entries of an output (`mass_2_1`), or common
//! subexpressions that are used in several places (`cos_left_times_u_left`).

use crate::program::{Function, Moving, Op, Program, Slot, Value};

/// Maximum number of letters in a name that joins the names of two operands.
const LONGEST_PAIR: usize = 48;

/// The users of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Users {
    /// The value has no user.
    None,
    /// The only user is an addition or subtraction.
    Sum(Value),
    /// The only user is an instruction of another kind.
    One(Value),
    /// The only user is an entry of an output.
    Entry,
    /// The value has several users.
    Many,
}

/// Returns the users of each value.
pub fn users(function: &Function) -> Vec<Users> {
    let mut users = vec![Users::None; function.instructions.len()];
    let mut note = |value: Value, user: Users| {
        let users = &mut users[value.index()];
        *users = if *users == Users::None { user } else { Users::Many };
    };
    for (index, instruction) in function.instructions.iter().enumerate() {
        let is_sum = matches!(instruction.op, Op::Add(..) | Op::Sub(..));
        let user = if is_sum { Users::Sum } else { Users::One };
        instruction.op.operands().for_each(|operand| note(operand, user(Value(index))));
    }
    let entries = function.outputs.iter().flat_map(|output| &output.entries);
    entries.for_each(|&entry| note(entry, Users::Entry));
    users
}

/// Chooses the names of a function's values.
pub struct Naming<'a> {
    program: &'a Program,
    function: &'a Function,
    users: &'a [Users],
}

impl<'a> Naming<'a> {
    /// Prepares to name the values of a function.
    pub fn new(program: &'a Program, function: &'a Function, users: &'a [Users]) -> Self {
        Self { program, function, users }
    }

    /// Returns the name of a value.
    pub fn of(&self, value: Value) -> String {
        let instruction = &self.function.instructions[value.index()];
        if let Some(name) = &instruction.name {
            return name.clone();
        }
        if let Some(entry) = self.entry(value) {
            return entry;
        }
        match self.users[value.index()] {
            Users::Sum(user) | Users::One(user) => self.within(user, self.kind(value)),
            _ => self.made_of(value),
        }
    }

    /// Returns the first entry of an output that is equal to a value: `mass_2_1`.
    fn entry(&self, value: Value) -> Option<String> {
        self.function.outputs.iter().find_map(|output| {
            let index = output.entries.iter().position(|&entry| entry == value)?;
            let (row, column) = (index / output.columns, index % output.columns);
            Some(match (output.rows, output.columns) {
                (1, 1) => output.name.to_owned(),
                (_, 1) => format!("{}_{row}", output.name),
                _ => format!("{}_{row}_{column}", output.name),
            })
        })
    }

    /// Returns the name of a value as a part of the nearest named value that uses it.
    fn within(&self, user: Value, kind: &str) -> String {
        format!("{}_{kind}", self.whole(user))
    }

    /// Returns the name of the nearest named value that a value is part of.
    pub fn whole(&self, value: Value) -> String {
        let mut at = value;
        loop {
            let name = &self.function.instructions[at.index()].name;
            if let Some(name) = name.clone().or_else(|| self.entry(at)) {
                return name;
            }
            match self.users[at.index()] {
                Users::Sum(next) | Users::One(next) => at = next,
                _ => return self.made_of(at),
            }
        }
    }

    /// Returns the kind of expression that computes a value.
    fn kind(&self, value: Value) -> &'static str {
        match self.function.instructions[value.index()].op {
            Op::Add(..) | Op::Sub(..) => "sum",
            Op::Mul(..) => "product",
            Op::Div(..) => "quotient",
            op => op.mnemonic(),
        }
    }

    /// Returns a name made of the operation and its operands.
    fn made_of(&self, value: Value) -> String {
        let (x, y) = match self.function.instructions[value.index()].op {
            Op::Mul(x, y) if x == y => {
                return self
                    .operand(x)
                    .map_or_else(|| self.subject(value), |x| format!("{x}_squared"));
            }
            Op::Neg(x) => {
                return self
                    .operand(x)
                    .map_or_else(|| self.subject(value), |x| format!("minus_{x}"));
            }
            op => {
                let mut operands = op.operands();
                match (operands.next(), operands.next()) {
                    (Some(x), Some(y)) => (x, y),
                    (Some(x), None) => {
                        let name = self.operand(x);
                        return name.map_or_else(
                            || self.subject(value),
                            |x| format!("{}_{x}", op.mnemonic()),
                        );
                    }
                    _ => return self.subject(value),
                }
            }
        };
        let word = match self.function.instructions[value.index()].op {
            Op::Add(..) => "plus",
            Op::Sub(..) => "minus",
            Op::Mul(..) => "times",
            Op::Div(..) => "over",
            op => op.mnemonic(),
        };
        let pair = match (self.operand(x), self.operand(y)) {
            (Some(x), Some(y)) => format!("{x}_{word}_{y}"),
            (Some(x), None) | (None, Some(x)) => format!("{x}_{}", self.kind(value)),
            (None, None) => self.subject(value),
        };
        if pair.len() <= LONGEST_PAIR { pair } else { self.subject(value) }
    }

    /// Returns the name of an operand, if it has one.
    fn operand(&self, value: Value) -> Option<String> {
        let instruction = &self.function.instructions[value.index()];
        match instruction.op {
            Op::Const(_) => None,
            Op::Load(slot) => Some(self.slot(slot)),
            _ => instruction.name.clone(),
        }
    }

    /// Returns a name made of the body or loop that the value belongs to and the kind of its
    /// expression.
    fn subject(&self, value: Value) -> String {
        let subject = self.function.instructions[value.index()].section.subject;
        let subject = subject.name(&self.program.interface.nodes).replace(' ', "");
        format!("{subject}_{}", self.kind(value))
    }

    fn slot(&self, slot: Slot) -> String {
        let interface = &self.program.interface;
        let coordinate = |id| interface.coordinate_name(id).replace('.', "_");
        let speed = |id| interface.speed_name(id).replace('.', "_");
        match slot {
            Slot::Time => "t".to_owned(),
            Slot::Position(id) => format!("q_{}", coordinate(id)),
            Slot::Rate(id) => format!("u_{}", speed(id)),
            Slot::Parameter(id) => interface.parameters[id.index()].name.replace('.', "_"),
            Slot::Input(id) => interface.inputs[id.index()].clone(),
            Slot::Drawn(place) => format!("drawing_{place}"),
            Slot::Acceleration(id) => format!("acceleration_{}", speed(id)),
            Slot::Multiplier(row) => format!("lambda_{row}"),
            Slot::Memory(id) => format!("memory_{}", id.index()),
            Slot::Change(Moving::Position(id)) => format!("d_q_{}", speed(id)),
            Slot::Change(Moving::Time) => format!("d_{}", self.slot(Slot::Time)),
            Slot::Change(Moving::Rate(id)) => format!("d_{}", self.slot(Slot::Rate(id))),
            Slot::Change(Moving::Parameter(id)) => format!("d_{}", self.slot(Slot::Parameter(id))),
            Slot::Change(Moving::Input(id)) => format!("d_{}", self.slot(Slot::Input(id))),
        }
    }
}
