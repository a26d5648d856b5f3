//! The codes of diagnostics: the cause of each, and how to correct it.
//!
//! A diagnostic is made with one of these constants, so every code that a stage can report is
//! explained here. `docs/ERRORS.md` and `lamc explain` print these texts.

use std::fmt;
use std::ops::Deref;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// Code of a diagnostic.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Code(&'static Entry);

/// Explanation of a code.
#[derive(PartialEq, Eq)]
pub struct Entry {
    /// The stable identifier that a diagnostic shows: `unknown-key`.
    pub name: &'static str,
    /// Cause of the diagnostic, in whole sentences.
    pub cause: &'static str,
    /// How to correct it, in whole sentences.
    pub cure: &'static str,
    /// Why there is no short example model, if there is none.
    pub no_example: Option<&'static str>,
}

impl Deref for Code {
    type Target = Entry;

    fn deref(&self) -> &Entry {
        self.0
    }
}

impl fmt::Debug for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// A code is serialised as its name.
impl Serialize for Code {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        self.name.serialize(to)
    }
}

impl<'de> Deserialize<'de> for Code {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let name = String::deserialize(from)?;
        find(&name).ok_or_else(|| de::Error::custom("no code has this name"))
    }
}

/// Declares codes, each as `NAME "name" "cause" "cure";`, with `no example "reason"` at the end if
/// there is no short example model. `ALL` holds all of them.
macro_rules! codes {
    ($($id:ident $name:literal $cause:literal $cure:literal $(no example $reason:literal)?;)*) => {
        $(
            #[doc = $cause]
            pub const $id: $crate::source::codes::Code =
                $crate::source::codes::Code(&$crate::source::codes::Entry {
                    name: $name,
                    cause: $cause,
                    cure: $cure,
                    no_example: codes!(@reason $($reason)?),
                });
        )*
        pub(super) const ALL: &[$crate::source::codes::Code] = &[$($id),*];
    };
    (@reason) => { None };
    (@reason $reason:literal) => { Some($reason) };
}

mod contacts;
mod controllers;
mod drawing;
mod elements;
mod keys;
mod mechanism;
mod names;
mod pattern;
mod physics;
mod plans;
mod popupcad;
mod tables;
mod text;
mod values;

pub use contacts::*;
pub use controllers::*;
pub use drawing::*;
pub use elements::*;
pub use keys::*;
pub use mechanism::*;
pub use names::*;
pub use pattern::*;
pub use physics::*;
pub use plans::*;
pub use popupcad::*;
pub use tables::*;
pub use text::*;
pub use values::*;

/// Every code, in groups with a title.
pub const GROUPS: &[(&str, &[Code])] = &[
    ("The text of the file", text::ALL),
    ("Keys", keys::ALL),
    ("Names", names::ALL),
    ("Numbers and formulas", values::ALL),
    ("The drawing", drawing::ALL),
    ("Masses, springs and angles", physics::ALL),
    ("Springs, tendons and motors", elements::ALL),
    ("Contacts", contacts::ALL),
    ("Controllers", controllers::ALL),
    ("The mechanism", mechanism::ALL),
    ("Patterns", pattern::ALL),
    ("Files of popupCAD", popupcad::ALL),
    ("Measurements, configurations and states", tables::ALL),
    ("Plans of sweeps, and goals", plans::ALL),
];

/// Returns the code with this name.
pub fn find(name: &str) -> Option<Code> {
    all().find(|code| code.name == name)
}

/// Iterates over all codes.
pub fn all() -> impl Iterator<Item = Code> {
    GROUPS.iter().flat_map(|(_, codes)| codes.iter().copied())
}
