//! Function bodies that are independent of the target language: instructions become statements, grouped
//! by the body that they belong to.
//!
//! Plain numbers, names of constants and reads are written inline where they are used. So are unnamed
//! values that are used once, and products that only one sum uses. The remaining values have names from
//! the derivation.

use crate::program::{
    Angle, Function, Op, Parts, Program, Section, Slot, Subject, Value, angles, is_read,
};
use std::collections::HashMap;

use super::constants::Constants;
use super::identifiers::Names;
use super::naming::{Naming, Users, users};

/// Maximum number of operations in one expression.
const LONGEST_EXPRESSION: usize = 10;

/// A statement of straight-line code.
#[derive(Clone, Debug)]
pub enum Statement {
    /// A heading: the following statements belong to this body or loop and this phase.
    Section(Section),
    /// A local variable that holds a value.
    Let {
        /// Name of the variable.
        name: String,
        /// Value of the variable.
        value: Expression,
    },
    /// Local variables for sines and cosines that are computed together.
    SineCosine(Vec<SineCosine>),
}

/// Local variables for the sine, the cosine or both of an angle.
#[derive(Clone, Debug)]
pub struct SineCosine {
    /// Name of the sine, if it is needed.
    pub sine: Option<String>,
    /// Name of the cosine, if it is needed.
    pub cosine: Option<String>,
    /// The angle, rad.
    pub angle: Expression,
}

/// An expression. It has parentheses where the precedence of the operators requires them.
#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "each is the operation of its name")]
pub enum Expression {
    Constant(f64),
    /// A number by its name in the table of constants, negated if `negative` is set.
    Number {
        name: String,
        negative: bool,
    },
    Load(Slot),
    Name(String),
    Parenthesised(Box<Expression>),
    Negated(Box<Expression>),
    Infix(Box<Expression>, Infix, Box<Expression>),
    /// A call of a function, given by its mnemonic.
    Call(&'static str, Vec<Expression>),
}

/// The operator of an [`Expression::Infix`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "each is the operation of its name")]
pub enum Infix {
    Add,
    Sub,
    Mul,
    Div,
}

impl Infix {
    /// Returns the operator as Rust and C write it.
    pub fn symbol(self) -> char {
        match self {
            Self::Add => '+',
            Self::Sub => '-',
            Self::Mul => '*',
            Self::Div => '/',
        }
    }
}

/// Precedence of an expression, lowest first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Binding {
    Sum,
    Product,
    Atom,
}

impl Expression {
    fn binding(&self) -> Binding {
        match self {
            Self::Infix(_, Infix::Add | Infix::Sub, _) => Binding::Sum,
            Self::Infix(..) | Self::Negated(_) => Binding::Product,
            _ => Binding::Atom,
        }
    }

    /// Returns the expression as an operand, in parentheses if its precedence is lower than `least`.
    fn within(&self, least: Binding) -> Box<Self> {
        let operand = Box::new(self.clone());
        if self.binding() < least { Box::new(Self::Parenthesised(operand)) } else { operand }
    }

    /// Returns the number of operations in the expression.
    fn size(&self) -> usize {
        match self {
            Self::Constant(_) | Self::Number { .. } | Self::Load(_) | Self::Name(_) => 0,
            Self::Parenthesised(x) => x.size(),
            Self::Negated(x) => x.size() + 1,
            Self::Infix(x, _, y) => x.size() + y.size() + 1,
            Self::Call(_, arguments) => arguments.iter().map(Self::size).sum::<usize>() + 1,
        }
    }
}

/// The statements of a part of a function.
#[derive(Clone, Debug, Default)]
pub struct Stretch {
    /// Values from earlier parts: the name of each, and the cell from which this part reads it first.
    pub takes: Vec<(String, usize)>,
    /// The statements, in order.
    pub list: Vec<Statement>,
    /// Entries of outputs that this part computes: the output's name, the index, and the value.
    pub entries: Vec<(&'static str, usize, Expression)>,
    /// Values for later parts: the name of each, and the cell in which this part stores it.
    pub leaves: Vec<(String, usize)>,
}

/// Returns the statements for all instructions of `function`, one stretch for each of its `parts`. No
/// local variable has a name in `reserved`.
pub fn statements(
    program: &Program,
    constants: &Constants,
    function: &Function,
    parts: &Parts,
    reserved: &[&str],
) -> Vec<Stretch> {
    write(program, constants, function, parts, reserved, None)
}

/// Returns the statements as [`statements`], with numbers instead of names, and without headings. Values from
/// earlier parts are read where they are used, from the array of this name.
pub fn numbered(
    program: &Program,
    constants: &Constants,
    function: &Function,
    parts: &Parts,
    (reserved, kept): (&[&str], &'static str),
) -> Vec<Stretch> {
    write(program, constants, function, parts, reserved, Some(kept))
}

fn write(
    program: &Program,
    constants: &Constants,
    function: &Function,
    parts: &Parts,
    reserved: &[&str],
    kept: Option<&'static str>,
) -> Vec<Stretch> {
    let users = users(function);
    let leaves = parts.list.iter().flat_map(|part| &part.leaves).copied();
    let numbered = kept.map(|kept| Numbered { kept, cells: leaves.collect() });
    let mut writer = Writer {
        naming: Naming::new(program, function, &users),
        users: &users,
        constants,
        function,
        parts,
        names: Names::reserving(reserved),
        written: vec![None; function.instructions.len()],
        stretches: vec![Stretch::default(); parts.list.len()],
        section: None,
        numbered,
    };
    writer.write();
    writer.write_entries();
    writer.name_what_crosses();
    writer.stretches
}

struct Writer<'a> {
    naming: Naming<'a>,
    users: &'a [Users],
    constants: &'a Constants,
    function: &'a Function,
    parts: &'a Parts,
    names: Names,
    written: Vec<Option<Expression>>,
    stretches: Vec<Stretch>,
    /// Part and section of the last statement.
    section: Option<(usize, Section)>,
    numbered: Option<Numbered>,
}

/// A short name for a number: a letter, a digit, then digits of base 36. No keyword has a digit.
fn numbered_name(number: usize) -> String {
    let mut name = vec![b'a' + (number % 26) as u8, b'0' + (number / 26 % 10) as u8];
    let mut rest = number / 260;
    while rest > 0 {
        name.push(b"0123456789abcdefghijklmnopqrstuvwxyz"[rest % 36]);
        rest /= 36;
    }
    name.into_iter().map(char::from).collect()
}

/// How values are numbered instead of named.
struct Numbered {
    /// Name of the array of values that cross from part to part.
    kept: &'static str,
    /// Cells of these values.
    cells: HashMap<Value, usize>,
}

impl Writer<'_> {
    fn of(&self, value: Value) -> &Expression {
        match &self.written[value.index()] {
            Some(expression) => expression,
            None => unreachable!("operands precede their use"),
        }
    }

    /// Returns an operand in the code of a part and a subject. Constants of the table are replaced by their names.
    fn operand(&self, value: Value, (part, subject): (usize, Subject)) -> Expression {
        if let Some(Numbered { kept, cells }) = &self.numbered
            && self.parts.home[value.index()] != part
            && let Some(cell) = cells.get(&value)
        {
            return Expression::Name(format!("{kept}[{cell}]"));
        }
        match self.of(value) {
            Expression::Constant(number) => match self.constants.name(*number, subject) {
                Some(name) => Expression::Number { name: name.to_owned(), negative: *number < 0.0 },
                None => Expression::Constant(*number),
            },
            expression => expression.clone(),
        }
    }

    fn write(&mut self) {
        let function = self.function;
        for (index, instruction) in function.instructions.iter().enumerate() {
            self.written[index] = match instruction.op {
                Op::Const(number) => Some(Expression::Constant(number)),
                Op::Load(slot) => Some(Expression::Load(slot)),
                _ => None,
            };
        }
        let mut later = self.write_first_angles().into_iter().peekable();
        for (index, instruction) in function.instructions.iter().enumerate() {
            if let Some(angle) = later.next_if(|angle| angle.members().min() == Some(Value(index)))
            {
                let pair = self.sine_cosine(angle);
                self.push(index, Statement::SineCosine(vec![pair]));
            }
            if self.written[index].is_some() {
                continue;
            }
            let place = (self.parts.home[index], instruction.section.subject);
            let expression = self.expression(instruction.op, place);
            let inline = self.is_inline(index, &expression);
            self.written[index] = Some(if inline {
                expression
            } else {
                let name = self.name(index);
                self.push(index, Statement::Let { name: name.clone(), value: expression });
                Expression::Name(name)
            });
        }
    }

    /// Returns whether a value is written inline where it is used.
    fn is_inline(&self, index: usize, expression: &Expression) -> bool {
        let instruction = &self.function.instructions[index];
        let is_term = matches!(instruction.op, Op::Mul(..) | Op::Neg(_));
        self.parts.is_local(Value(index))
            && match self.users[index] {
                Users::Sum(_) if is_term => true,
                Users::One(_) if matches!(instruction.op, Op::Neg(_)) => true,
                Users::Sum(_) | Users::One(_) | Users::Entry => {
                    (instruction.name.is_none() || self.numbered.is_some())
                        && expression.size() <= LONGEST_EXPRESSION
                }
                Users::None | Users::Many => false,
            }
    }

    /// Writes the sines and cosines of values that are read from arguments before everything else, and
    /// returns the other angles.
    fn write_first_angles(&mut self) -> Vec<Angle> {
        let (first, later): (Vec<_>, Vec<_>) =
            angles(self.function).into_iter().partition(|a| is_read(self.function, a.angle));
        let pairs: Vec<_> = first.into_iter().map(|angle| self.sine_cosine(angle)).collect();
        if !pairs.is_empty() {
            self.stretches[0].list.push(Statement::SineCosine(pairs));
        }
        later
    }

    /// Names the sine and the cosine of an angle.
    fn sine_cosine(&mut self, Angle { angle, sine, cosine }: Angle) -> SineCosine {
        let mut give = |value: Value| {
            let name = self.name(value.index());
            self.written[value.index()] = Some(Expression::Name(name.clone()));
            name
        };
        let (sine, cosine) = (sine.map(&mut give), cosine.map(&mut give));
        SineCosine { sine, cosine, angle: self.of(angle).clone() }
    }

    /// Adds every entry of the outputs to the part that computes it.
    fn write_entries(&mut self) {
        for output in &self.function.outputs {
            for (index, &entry) in output.entries.iter().enumerate() {
                let subject = self.function.instructions[entry.index()].section.subject;
                let home = self.parts.home[entry.index()];
                let value = self.operand(entry, (home, subject));
                self.stretches[home].entries.push((output.name, index, value));
            }
        }
    }

    fn name_what_crosses(&mut self) {
        let named = |values: &[(Value, usize)]| {
            let name = |&(value, cell): &(Value, usize)| match self.of(value) {
                Expression::Name(name) => (name.clone(), cell),
                _ => unreachable!("what another part uses has a name"),
            };
            values.iter().map(name).collect::<Vec<_>>()
        };
        let crossing: Vec<_> =
            self.parts.list.iter().map(|part| (named(&part.takes), named(&part.leaves))).collect();
        for (stretch, (takes, leaves)) in self.stretches.iter_mut().zip(crossing) {
            stretch.takes = if self.numbered.is_some() { Vec::new() } else { takes };
            stretch.leaves = leaves;
        }
    }

    fn name(&mut self, index: usize) -> String {
        if self.numbered.is_some() {
            return self.names.give(&numbered_name(index));
        }
        self.names.give(&self.naming.of(Value(index)))
    }

    /// Appends a statement, after a heading if another section begins.
    fn push(&mut self, index: usize, statement: Statement) {
        let place = (self.parts.home[index], self.function.instructions[index].section);
        let list = &mut self.stretches[place.0].list;
        if self.section.replace(place) != Some(place) && self.numbered.is_none() {
            list.push(Statement::Section(place.1));
        }
        list.push(statement);
    }

    fn expression(&self, op: Op, place: (usize, Subject)) -> Expression {
        use Binding::{Atom, Product, Sum};
        let infix = |x, operator, y, [left, right]: [Binding; 2]| {
            let [x, y] = [x, y].map(|operand| self.operand(operand, place));
            Expression::Infix(x.within(left), operator, y.within(right))
        };
        match op {
            Op::Neg(x) => Expression::Negated(self.operand(x, place).within(Product)),
            Op::Add(x, y) => infix(x, Infix::Add, y, [Sum, Product]),
            Op::Sub(x, y) => infix(x, Infix::Sub, y, [Sum, Product]),
            Op::Mul(x, y) => infix(x, Infix::Mul, y, [Product, Atom]),
            Op::Div(x, y) => infix(x, Infix::Div, y, [Product, Atom]),
            op => {
                let arguments = op.operands().map(|x| self.operand(x, place)).collect();
                Expression::Call(op.mnemonic(), arguments)
            }
        }
    }
}
