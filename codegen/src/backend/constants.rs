//! The table of constants of a generated module: the numbers of the model, each with its name.
//!
//! A number in the code is a fact of the model, a simple combination of two facts of one body, or the
//! result of constant folding over more facts. A folded number gets a name if the code uses it in
//! several places. If the code uses it only once, a name would add nothing to the statement. The table
//! holds magnitudes; the sign is written where the number is used.

use crate::arithmetic::is_same;
use crate::program::{Fact, Function, Op, Program, Quantity, Subject, Value};
use std::collections::HashMap;

use super::identifiers::Names;
use super::naming::{Naming, users};

/// Maximum number of letters in a name that joins the names of two facts.
const LONGEST_PAIR: usize = 56;

/// A number needs no name if it is at most `PLAIN` and a multiple of `1 / PLAIN_PARTS`.
const PLAIN: f64 = 16.0;
const PLAIN_PARTS: f64 = 4.0;

/// A named constant of a generated module.
#[derive(Clone, Debug)]
pub struct Constant {
    /// Name, in upper case.
    pub name: String,
    /// Magnitude, greater than 0.
    pub value: f64,
    /// Position in the table.
    place: Place,
}

/// The order of the table: first by subject and fact, then the folded numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Place {
    Fact(Subject, usize),
    Folded,
}

/// The table of constants of a generated module.
#[derive(Debug, Default)]
pub struct Constants {
    list: Vec<Constant>,
    /// Indices into `list`, by the bits of the number and the subject of the code that uses it.
    uses: HashMap<(u64, Subject), usize>,
    /// Quantities of the facts in the table.
    legend: Vec<Quantity>,
}

/// The constants of one subject.
#[derive(Clone, Copy, Debug)]
pub struct Group<'a> {
    subject: Option<Subject>,
    /// The constants, in the order of the facts.
    pub constants: &'a [Constant],
}

impl Group<'_> {
    /// Returns one line that describes the group. `nodes` are the names of the nodes.
    pub fn heading(&self, nodes: &[String]) -> String {
        match self.subject {
            Some(subject) => subject.name(nodes),
            None => {
                "folded from several numbers, by the first value that each is part of".to_owned()
            }
        }
    }
}

impl Constants {
    /// Collects the constants that functions of a program use. No constant gets a name in `reserved`
    /// (in lower case).
    pub fn of<'a>(
        program: &Program,
        functions: impl IntoIterator<Item = &'a Function> + Clone,
        reserved: &[&str],
    ) -> Self {
        let mut table = Table {
            program,
            names: Names::reserving(reserved),
            by_name: HashMap::new(),
            by_value: HashMap::new(),
            places: HashMap::new(),
            legend: vec![false; program.facts.len()],
            constants: Self::default(),
        };
        functions.clone().into_iter().for_each(|function| table.facts(function));
        functions.clone().into_iter().for_each(|function| table.count(function));
        functions.into_iter().for_each(|function| table.folded(function));
        table.finish()
    }

    /// Collects the constants that functions use, numbered instead of named.
    pub fn numbered<'a>(functions: impl IntoIterator<Item = &'a Function>) -> Self {
        let mut constants = Self::default();
        let mut known = HashMap::new();
        for Use { magnitude, subject, .. } in functions.into_iter().flat_map(uses) {
            let index = *known.entry(magnitude.to_bits()).or_insert_with(|| {
                let (name, place) = (format!("N{}", constants.list.len()), Place::Folded);
                constants.list.push(Constant { name, value: magnitude, place });
                constants.list.len() - 1
            });
            constants.uses.insert((magnitude.to_bits(), subject), index);
        }
        constants
    }

    /// Returns the constants, grouped by subject.
    pub fn groups(&self) -> impl Iterator<Item = Group<'_>> {
        let subject = |constant: &Constant| match constant.place {
            Place::Fact(subject, _) => Some(subject),
            Place::Folded => None,
        };
        self.list
            .chunk_by(move |a, b| subject(a) == subject(b))
            .map(move |constants| Group { subject: subject(&constants[0]), constants })
    }

    /// Returns the prefixes of the facts' names, and the meaning of each prefix.
    pub fn legend(&self) -> &[Quantity] {
        &self.legend
    }

    /// Returns the name of a number in the code of a subject, or `None` if the number needs no name.
    pub fn name(&self, number: f64, subject: Subject) -> Option<&str> {
        let index = self.uses.get(&(number.abs().to_bits(), subject))?;
        Some(&self.list[*index].name)
    }
}

/// The table of constants while it is built.
struct Table<'a> {
    program: &'a Program,
    names: Names,
    /// Constants by the name that was requested for them and by their number.
    by_name: HashMap<(String, u64), usize>,
    /// Index of the first constant with each number.
    by_value: HashMap<u64, usize>,
    /// How many times the code uses each number where it is not a fact.
    places: HashMap<u64, usize>,
    /// For each fact, whether it is part of a constant.
    legend: Vec<bool>,
    constants: Constants,
}

/// A use of a number in a function.
struct Use {
    magnitude: f64,
    subject: Subject,
    /// The instruction that uses the number, or `None` if an entry of an output does.
    user: Option<Value>,
    number: Value,
}

impl Table<'_> {
    /// Names the numbers that are facts or that are computed from at most two facts.
    fn facts(&mut self, function: &Function) {
        for Use { magnitude, subject, .. } in uses(function) {
            let key = (magnitude.to_bits(), subject);
            if self.constants.uses.contains_key(&key) {
                continue;
            }
            if let Some((name, facts)) = self.combination(magnitude, subject) {
                facts.iter().for_each(|&fact| self.legend[fact] = true);
                let fact = facts[0];
                let place = Place::Fact(self.program.facts[fact].subject, fact);
                let index = self.constant(name, place, magnitude);
                self.constants.uses.insert(key, index);
            }
        }
    }

    /// Counts the uses of the other numbers.
    fn count(&mut self, function: &Function) {
        for Use { magnitude, subject, .. } in uses(function) {
            let bits = magnitude.to_bits();
            if !self.constants.uses.contains_key(&(bits, subject)) {
                *self.places.entry(bits).or_default() += 1;
            }
        }
    }

    /// Names the remaining numbers that are already in the table or are used in several places. The
    /// name says what the number is part of.
    fn folded(&mut self, function: &Function) {
        let users = users(function);
        let naming = Naming::new(self.program, function, &users);
        for Use { magnitude, subject, user, number } in uses(function) {
            let key = (magnitude.to_bits(), subject);
            if self.constants.uses.contains_key(&key) {
                continue;
            }
            let index = match self.by_value.get(&magnitude.to_bits()) {
                Some(&known) => known,
                None if self.places.get(&magnitude.to_bits()) == Some(&1) => continue,
                None => {
                    let role = match user.map(|user| function.instructions[user.index()].op) {
                        None => "entry",
                        Some(Op::Add(..) | Op::Sub(..)) => "term",
                        Some(Op::Mul(..)) => "factor",
                        Some(_) => "argument",
                    };
                    let name = format!("{}_{role}", naming.whole(user.unwrap_or(number)));
                    self.constant(name, Place::Folded, magnitude)
                }
            };
            self.constants.uses.insert(key, index);
        }
    }

    fn constant(&mut self, wanted: String, place: Place, value: f64) -> usize {
        let key = (wanted, value.to_bits());
        if let Some(&index) = self.by_name.get(&key) {
            return index;
        }
        let name = self.names.give(&key.0).to_ascii_uppercase();
        let index = self.constants.list.len();
        self.constants.list.push(Constant { name, value, place });
        self.by_value.entry(value.to_bits()).or_insert(index);
        self.by_name.insert(key, index);
        index
    }

    /// Returns the name of a number that is a fact or a simple combination of the subject's facts, and
    /// these facts.
    fn combination(&self, magnitude: f64, subject: Subject) -> Option<(String, Vec<usize>)> {
        let facts = &self.program.facts;
        let is = |value: f64| is_same(value.abs(), magnitude);
        let own = |index: &usize| facts[*index].subject == subject;
        let same = || (0..facts.len()).filter(|&index| is(facts[index].value));
        if let Some(index) = same().find(own).or_else(|| same().next()) {
            return Some((facts[index].name.clone(), vec![index]));
        }
        let is_near = |index: &usize| own(index) || facts[*index].subject == Subject::Mechanism;
        let mut near: Vec<usize> = (0..facts.len())
            .filter(is_near)
            .filter(|&index| facts[index].value != 0.0 && facts[index].value.abs() != 1.0)
            .collect();
        // The subject's own facts come first.
        near.sort_by_key(|index| !own(index));
        for &index in &near {
            let Fact { name, value, .. } = &facts[index];
            let multiples = [
                (2.0 * value, format!("twice_{name}")),
                (0.5 * value, format!("half_{name}")),
                (value * value, format!("{name}_squared")),
            ];
            if let Some((_, name)) = multiples.into_iter().find(|(multiple, _)| is(*multiple)) {
                return Some((name, vec![index]));
            }
        }
        let pairs = near.iter().enumerate().flat_map(|(place, &first)| {
            near[place + 1..].iter().map(move |&second| [first, second])
        });
        let mut found = pairs.filter_map(|[first, second]| {
            let word = relation(&facts[first], &facts[second], &is)?;
            let name = format!("{}_{word}_{}", facts[first].name, facts[second].name);
            (name.len() <= LONGEST_PAIR).then_some((name, vec![first, second]))
        });
        found.next()
    }

    fn finish(self) -> Constants {
        let Constants { list, uses, .. } = self.constants;
        let mut order: Vec<usize> = (0..list.len()).collect();
        order.sort_by_key(|&index| list[index].place);
        let mut places = vec![0; order.len()];
        order.iter().enumerate().for_each(|(place, &index)| places[index] = place);
        let mut legend: Vec<Quantity> = Vec::new();
        for (fact, _) in self.program.facts.iter().zip(self.legend).filter(|(_, used)| *used) {
            legend.extend(fact.quantity.clone().filter(|quantity| !legend.contains(quantity)));
        }
        Constants {
            list: order.iter().map(|&index| list[index].clone()).collect(),
            uses: uses.into_iter().map(|(key, index)| (key, places[index])).collect(),
            legend,
        }
    }
}

/// Returns the word that joins the names of two facts whose combination is the number, if there is one.
fn relation(first: &Fact, second: &Fact, is: &dyn Fn(f64) -> bool) -> Option<&'static str> {
    let (x, y) = (first.value, second.value);
    let alike = first.quantity.is_some() && first.quantity == second.quantity;
    match alike && first.subject == second.subject {
        _ if is(x * y) => Some("times"),
        true if is(x + y) => Some("plus"),
        true if is(x - y) => Some("minus"),
        _ => None,
    }
}

/// Returns the uses of all numbers that need a name in a function.
fn uses(function: &Function) -> impl Iterator<Item = Use> {
    let instructions = function.instructions.iter().enumerate();
    let operands = instructions.flat_map(|(user, instruction)| {
        let subject = instruction.section.subject;
        instruction.op.operands().map(move |number| (number, subject, Some(Value(user))))
    });
    let entries = function.outputs.iter().flat_map(|output| &output.entries);
    let entries = entries.map(|&entry| {
        let subject = function.instructions[entry.index()].section.subject;
        (entry, subject, None)
    });
    operands.chain(entries).filter_map(|(number, subject, user)| {
        let Op::Const(value) = function.instructions[number.index()].op else { return None };
        let magnitude = value.abs();
        (!is_plain(magnitude)).then_some(Use { magnitude, subject, user, number })
    })
}

/// Returns whether a number needs no name, for example 2 or 0.5.
fn is_plain(magnitude: f64) -> bool {
    !magnitude.is_finite() || magnitude <= PLAIN && (magnitude * PLAIN_PARTS).fract() == 0.0
}
