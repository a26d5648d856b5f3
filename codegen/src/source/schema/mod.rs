//! The keys of the model file, as data: one table for each kind of mapping.
//!
//! The reader takes from these tables which keys there are, which of them are required, what they
//! measure and what a formula may depend on. The reference page and the JSON Schema are written from
//! the same tables, so none of the three can say something that the others do not.

use super::model::Tunable;
pub use super::names::{Kind, reserved_names};
use super::units::NUMBER;
pub use super::units::{QUANTITIES, Quantity, all_units, units_of};

mod model;
mod parts;

pub use model::{AIR, FORCE, HINGE_MODEL, INITIAL, MATERIAL, MODEL, POINT, UNITS};
pub(super) use model::{SPECIMEN, TERM};
pub use parts::{
    BODY, FRICTION, HINGE_BEAM, HINGE_FAMILY, HINGE_SHARIFZADEH2018, JOINT, PLATE, POINT_MASS,
};
pub(super) use parts::{HINGES, INERTIA_ROW, MAX_LAYERS, PLATES, RING, VERTEX};

/// A mapping with a fixed set of keys.
#[derive(Debug)]
pub struct Mapping {
    /// What it describes, in a word or two: `joint`.
    pub name: &'static str,
    /// The heading of its section in the reference.
    pub title: &'static str,
    /// Where it stands in the file, as a path: `joints.<joint>`.
    pub place: &'static str,
    /// What it describes, in whole sentences.
    pub doc: &'static str,
    /// The keys, in the order in which messages list them.
    pub keys: &'static [Key],
    /// Keys that exclude each other.
    pub choices: &'static [Choice],
}

/// Ways to say one thing, each a list of keys that belong together. At most one way is taken.
pub type Choice = &'static [&'static [&'static str]];

/// A key of a mapping.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// As it is written in the file.
    pub name: &'static str,
    /// What its value may be.
    pub value: Value,
    /// What holds when the key is left out.
    pub presence: Presence,
    /// The numbers it takes.
    pub range: Range,
    /// A value, as YAML.
    pub example: &'static str,
    /// What it means, in whole sentences or as a noun phrase.
    pub doc: &'static str,
}

/// What holds when a key is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presence {
    /// The key must be there.
    Required,
    /// The key must be there with the other keys of its way of a [`Choice`].
    Together,
    /// It is as if this value (YAML) were written.
    Default(&'static str),
    /// What the text says.
    Optional(&'static str),
}

/// Which numbers a key takes. The physical stages check it, with the values of parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Range {
    /// All.
    Any,
    /// More than 0.
    Positive,
    /// 0 or more.
    NotNegative,
}

/// What the value of a key may be.
#[derive(Clone, Copy, Debug)]
pub enum Value {
    /// A name that is declared here.
    Name(Kind),
    /// The name of an entry of another mapping.
    Reference {
        /// What is named: `body`.
        to: &'static str,
        /// The key of the model under which it is declared: `bodies`.
        among: &'static str,
    },
    /// `true` or `false`.
    Boolean,
    /// One of these words.
    Word(&'static [&'static str]),
    /// The name of a unit that measures this.
    Unit(&'static Quantity),
    /// A number, with or without a unit.
    Number(&'static Quantity),
    /// A number, with or without a unit, or a formula.
    Formula(&'static Quantity, Uses),
    /// A number with any unit or none, which says what the parameter measures.
    Parameter,
    /// A list of so many values.
    Array {
        /// Each of them.
        of: &'static Value,
        /// How many.
        length: usize,
        /// What is expected, for messages: `` `[x, y, z]` ``.
        form: &'static str,
    },
    /// A list.
    List {
        /// Each item.
        of: &'static Value,
        /// The least and the largest number of items.
        items: [usize; 2],
        /// What is expected, for messages: `a list of materials, bottom to top`.
        form: &'static str,
    },
    /// A mapping with fixed keys.
    Mapping(&'static Mapping),
    /// A mapping from names that are declared here to values.
    Named(Kind, &'static Value),
    /// A mapping from names of joints to values.
    PerJoint(&'static Value),
    /// A mapping whose fixed keys depend on the value of one of them.
    OneOf {
        /// The key that decides.
        by: &'static str,
        /// The keys for each of its values; those for any other value have no name.
        variants: &'static [(Option<&'static str>, &'static Mapping)],
    },
}

/// What a formula may depend on, besides parameters, inputs and t.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Uses {
    /// Nothing else, for this reason.
    Constants(&'static str),
    /// `q.<joint>` and `u.<joint>`.
    Motion,
}

/// The words of `tunable`.
const TUNABLE: &[&str] = &{
    let [a, b, c, d] = Tunable::ALL;
    [a.name(), b.name(), c.name(), d.name()]
};

/// Every mapping, in the order of the reference.
pub const MAPPINGS: &[&Mapping] = &[
    &MODEL,
    &UNITS,
    &MATERIAL,
    &BODY,
    &PLATE,
    &POINT_MASS,
    &JOINT,
    &FRICTION,
    &HINGE_BEAM,
    &HINGE_SHARIFZADEH2018,
    &HINGE_FAMILY,
    &INITIAL,
    &POINT,
    &FORCE,
    &AIR,
    &HINGE_MODEL,
];

impl Mapping {
    /// The key of this name.
    pub fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys.iter().find(|key| key.name == name)
    }

    /// The keys that belong together with this one.
    pub fn beside(&self, name: &str) -> impl Iterator<Item = &'static str> {
        let ways = self.choices.iter().copied().flatten();
        let way = ways.copied().find(|way| way.contains(&name)).unwrap_or_default();
        way.iter().copied().filter(move |other| *other != name)
    }

    /// The names of all keys.
    pub fn names(&self) -> Vec<&'static str> {
        self.keys.iter().map(|key| key.name).collect()
    }
}

impl Presence {
    /// Whether the key must be there, at least beside certain others.
    pub fn may_be_required(self) -> bool {
        matches!(self, Self::Required | Self::Together)
    }
}

impl Value {
    /// What the numbers in it measure, where it is a number or holds a list of numbers.
    pub fn quantity(&self) -> Option<&'static Quantity> {
        match self {
            Self::Number(quantity) | Self::Formula(quantity, _) => Some(quantity),
            Self::Array { of, .. } | Self::List { of, .. } | Self::PerJoint(of) => of.quantity(),
            _ => None,
        }
    }

    /// What the numbers in it measure, and what a formula in their place may depend on.
    pub(super) fn measured(&self) -> (&'static Quantity, Uses) {
        (self.quantity().unwrap_or(&NUMBER), self.uses())
    }

    fn uses(&self) -> Uses {
        match self {
            Self::Formula(_, uses) => *uses,
            Self::Array { of, .. } => of.uses(),
            _ => Uses::Motion,
        }
    }

    /// What is expected, for messages.
    pub(super) fn form(&self) -> &'static str {
        match self {
            Self::Array { form, .. } | Self::List { form, .. } => form,
            _ => "a value",
        }
    }
}

impl Key {
    /// The same key with a bound on its numbers.
    const fn range(self, range: Range) -> Self {
        Self { range, ..self }
    }
}

const fn key(
    name: &'static str,
    value: Value,
    presence: Presence,
    example: &'static str,
    doc: &'static str,
) -> Key {
    Key { name, value, presence, range: Range::Any, example, doc }
}

const fn required(
    name: &'static str,
    value: Value,
    example: &'static str,
    doc: &'static str,
) -> Key {
    key(name, value, Presence::Required, example, doc)
}

const fn optional(
    name: &'static str,
    value: Value,
    without: &'static str,
    example: &'static str,
    doc: &'static str,
) -> Key {
    key(name, value, Presence::Optional(without), example, doc)
}
