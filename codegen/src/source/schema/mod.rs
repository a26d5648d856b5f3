//! The keys of the model file, as data: one table for each kind of mapping.
//!
//! These tables tell the reader which keys exist, which are required, which quantities they have
//! and what a formula may depend on. The reference page and the JSON Schema are generated from the
//! same tables, so the three always agree.

pub use super::names::{Kind, reserved_names};
use super::tunable::Tunable;
pub use super::units::{
    ANGLE, FREQUENCY, LENGTH, NUMBER, QUANTITIES, Quantity, SHARE, TIME, all_units, units_of,
};

mod contacts;
mod controllers;
mod elements;
mod forces;
mod initial;
mod joints;
mod model;
mod parts;
mod pattern;

pub(crate) use contacts::{ALL, BODIES_FORM, CORNERS, OUTLINE, POINTS_FORM};
pub use contacts::{CONTACT, PLANE};
pub(crate) use controllers::ONE_SAMPLE;
pub use controllers::{CONTROLLER, MEMORY, PWM};
pub use elements::{BAND, MOTOR, TENDON, TWIST};
pub use forces::{AIR, FORCE, POINT};
pub use initial::{FREE_BODY, INITIAL};
pub use joints::{CREASE_JOINT, FRICTION, JOINT};
pub use model::{HINGE_MODEL, MATERIAL, MODEL, PARAMETER, UNITS};
pub(super) use model::{SPECIMEN, TERM};
pub use parts::{BODY, HINGE_BEAM, HINGE_FAMILY, HINGE_SHARIFZADEH2018, PLATE, POINT_MASS};
pub(super) use parts::{
    FIXED_VERTEX, HINGES, INERTIA_ROW, MAX_LAYERS, PLATES, RING, SHAPES, SLIT, VERTEX,
};
pub use pattern::{CREASE, CREASE_HINGE, FOLD, LAYERS, PATTERN};
#[cfg(feature = "drawings")]
pub(super) use pattern::{DRAWN, LAYER_NAMES};

/// A mapping with a fixed set of keys.
#[derive(Debug)]
pub struct Mapping {
    /// Short name: `joint`.
    pub name: &'static str,
    /// The heading of its section in the reference.
    pub title: &'static str,
    /// Path in the file: `joints.<joint>`.
    pub path: &'static str,
    /// Description, in whole sentences.
    pub doc: &'static str,
    /// The keys, in the order in which messages list them.
    pub keys: &'static [Key],
    /// Keys that exclude each other.
    pub choices: &'static [Choice],
}

/// Alternatives, each a list of keys that belong together. At most one of them is used.
pub type Choice = &'static [&'static [&'static str]];

/// A key of a mapping.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// The key as it is written in the file.
    pub name: &'static str,
    /// Type of its value.
    pub value: Value,
    /// Whether it is required, or its default.
    pub presence: Presence,
    /// The range of its numbers.
    pub range: Range,
    /// An example value, as YAML.
    pub example: &'static str,
    /// Its meaning, in whole sentences or as a noun phrase.
    pub doc: &'static str,
}

/// Whether a key is required, or its default.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presence {
    /// The key is required.
    Required,
    /// The key is required unless this other key is given.
    Without(&'static str),
    /// The key is required together with the other keys of its alternative in a [`Choice`].
    Together,
    /// The default is this value (YAML).
    Default(&'static str),
    /// The text describes the default.
    Optional(&'static str),
}

/// The range of a key's numbers. Later stages check it, with the values of parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Range {
    /// All numbers.
    Any,
    /// Numbers greater than 0.
    Positive,
    /// Numbers that are 0 or greater.
    NotNegative,
}

/// Type of a key's value.
#[derive(Clone, Copy, Debug)]
pub enum Value {
    /// A name that is declared here.
    Name(Kind),
    /// The name of an entry of another mapping.
    Reference {
        /// What the name refers to: `body`.
        to: &'static str,
        /// The key of the model under which it is declared: `bodies`.
        among: &'static str,
    },
    /// Any text.
    Text,
    /// `true` or `false`.
    Boolean,
    /// One of these words.
    Word(&'static [&'static str]),
    /// The name of a unit of this quantity.
    Unit(&'static Quantity),
    /// A number, with or without a unit.
    Number(&'static Quantity),
    /// A number, with or without a unit, or a formula.
    Formula(&'static Quantity, Uses),
    /// A number with or without a unit; the unit determines the dimension of the parameter.
    Parameter,
    /// A value of the one or of the other type.
    Either(&'static Value, &'static Value),
    /// A list of fixed length.
    Array {
        /// Type of each item.
        of: &'static Value,
        /// Number of items.
        length: usize,
        /// What is expected, for messages: `` `[x, y, z]` ``.
        form: &'static str,
    },
    /// A list.
    List {
        /// Type of each item.
        of: &'static Value,
        /// Smallest and largest number of items.
        items: [usize; 2],
        /// What is expected, for messages: `a list of materials, bottom to top`.
        form: &'static str,
    },
    /// A mapping with fixed keys.
    Mapping(&'static Mapping),
    /// A mapping from names that are declared here to values.
    Named(Kind, &'static Value),
    /// A mapping from names of joints, or of other entries of this kind, to values.
    Per(&'static str, &'static Value),
    /// A mapping whose fixed keys depend on the value of one of them.
    OneOf {
        /// The key whose value determines the other keys.
        by: &'static str,
        /// The keys for each of its values; an entry without a name is for all other values.
        variants: &'static [(Option<&'static str>, &'static Mapping)],
    },
}

/// What a formula may depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Uses {
    /// Parameters.
    Parameters,
    /// Parameters, inputs and t; the text says why nothing else.
    Constants(&'static str),
    /// Parameters, inputs, t, `q.<joint>` and `u.<joint>`.
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
    &PARAMETER,
    &MATERIAL,
    &BODY,
    &PLATE,
    &POINT_MASS,
    &JOINT,
    &FRICTION,
    &HINGE_BEAM,
    &HINGE_SHARIFZADEH2018,
    &HINGE_FAMILY,
    &PATTERN,
    &CREASE,
    &CREASE_HINGE,
    &FOLD,
    &CREASE_JOINT,
    &LAYERS,
    &INITIAL,
    &FREE_BODY,
    &POINT,
    &FORCE,
    &BAND,
    &TWIST,
    &TENDON,
    &MOTOR,
    &CONTACT,
    &PLANE,
    &CONTROLLER,
    &MEMORY,
    &PWM,
    &AIR,
    &HINGE_MODEL,
];

impl Mapping {
    /// Returns the key with this name.
    pub fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys.iter().find(|key| key.name == name)
    }

    /// Returns the keys that belong together with this one.
    pub fn beside(&self, name: &str) -> impl Iterator<Item = &'static str> {
        let ways = self.choices.iter().copied().flatten();
        let way = ways.copied().find(|way| way.contains(&name)).unwrap_or_default();
        way.iter().copied().filter(move |other| *other != name)
    }

    /// Returns the names of all keys.
    pub fn names(&self) -> Vec<&'static str> {
        self.keys.iter().map(|key| key.name).collect()
    }
}

impl Presence {
    /// Returns whether the key is required, always, without another key or together with others.
    pub fn may_be_required(self) -> bool {
        matches!(self, Self::Required | Self::Without(_) | Self::Together)
    }
}

impl Value {
    /// Returns the quantity of its numbers, if it is a number or a list of numbers.
    pub fn quantity(&self) -> Option<&'static Quantity> {
        match self {
            Self::Number(quantity) | Self::Formula(quantity, _) => Some(quantity),
            Self::Array { of, .. } | Self::List { of, .. } | Self::Per(_, of) => of.quantity(),
            _ => None,
        }
    }

    /// Returns the quantity of its numbers, and what a formula may depend on.
    pub(super) fn measured(&self) -> (&'static Quantity, Uses) {
        (self.quantity().unwrap_or(&NUMBER), self.uses())
    }

    fn uses(&self) -> Uses {
        match self {
            Self::Formula(_, uses) => *uses,
            Self::Array { of, .. } | Self::List { of, .. } => of.uses(),
            _ => Uses::Motion,
        }
    }

    /// Returns what is expected, for messages.
    pub(super) fn form(&self) -> &'static str {
        match self {
            Self::Array { form, .. } | Self::List { form, .. } => form,
            _ => "a value",
        }
    }
}

impl Key {
    /// Returns the same key with a range for its numbers.
    const fn range(self, range: Range) -> Self {
        Self { range, ..self }
    }
}

/// Returns a key for numbers of any range.
pub const fn key(
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
