//! Values of a JSON text with their positions, so that a wrong one is reported where it is.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{Deserialize, Deserializer, SeqAccess, Visitor};
use serde_json::value::RawValue;

use crate::drawing::Place;
use crate::fault::{Cause, Fault};

/// The most elements that a list may have: ten times a pattern with a hundred thousand lines.
const MOST_ELEMENTS: usize = 1_000_000;

/// The text of a file.
#[derive(Clone, Copy)]
pub(super) struct Text<'a>(pub(super) &'a str);

impl<'a> Text<'a> {
    /// Returns the position of a part of the text.
    pub(super) fn place(self, raw: &RawValue) -> Place {
        let start = (raw.get().as_ptr() as usize).saturating_sub(self.0.as_ptr() as usize);
        Place { start, end: start + raw.get().len() }
    }

    /// Reads a value, which has a name for messages.
    pub(super) fn value<T: Deserialize<'a>>(
        self,
        name: &str,
        raw: &'a RawValue,
    ) -> Result<T, Fault> {
        serde_json::from_str(raw.get()).map_err(|error| {
            let within = offset(raw.get(), &error);
            let Place { start, end } = self.place(raw);
            let at = (start + within).min(end);
            syntax(format!("{name}: {}", reason(&error)), Place { start: at, end: at })
        })
    }

    /// Reads a list. A wrong element is reported with its name, such as `edges_vertices[12]`.
    pub(super) fn list<T: Deserialize<'a>>(
        self,
        name: &str,
        raw: Option<&'a RawValue>,
    ) -> Result<Vec<(T, Place)>, Fault> {
        self.short_list(name, raw, MOST_ELEMENTS)
    }

    /// Reads a list of at most so many elements.
    pub(super) fn short_list<T: Deserialize<'a>>(
        self,
        name: &str,
        raw: Option<&'a RawValue>,
        most: usize,
    ) -> Result<Vec<(T, Place)>, Fault> {
        let Some(raw) = raw else { return Ok(Vec::new()) };
        let Bounded(elements) = self.value::<Bounded<&RawValue>>(name, raw)?;
        if elements.len() > most {
            let message =
                format!("{name} has {} elements; at most {most} are read", elements.len());
            return Err(Fault { cause: Cause::Limit, ..syntax(message, self.place(raw)) });
        }
        let mut list = Vec::with_capacity(elements.len());
        for (index, element) in elements.into_iter().enumerate() {
            let place = self.place(element);
            let value = serde_json::from_str(element.get()).map_err(|error| {
                let reason = reason(&error);
                let large = reason == "number out of range";
                let cause = if large { Cause::Number } else { Cause::Syntax };
                Fault { cause, ..syntax(format!("{name}[{index}]: {reason}"), place) }
            })?;
            list.push((value, place));
        }
        Ok(list)
    }
}

/// Returns the byte at which an error of serde_json is.
pub(super) fn offset(text: &str, error: &serde_json::Error) -> usize {
    let line = error.line().saturating_sub(1);
    let start: usize = text.split_inclusive('\n').take(line).map(str::len).sum();
    (start + error.column().saturating_sub(1)).min(text.len())
}

/// Returns the message of serde_json without its position, which counts from the part that was read, and
/// without names of Rust's types.
pub(super) fn reason(error: &serde_json::Error) -> String {
    let text = error.to_string();
    let end = text.rfind(" at line ").unwrap_or(text.len());
    text[..end]
        .replace("expected f64", "expected a number")
        .replace("expected usize", "expected an index: a whole number from 0")
        .replace("invalid type: sequence", "invalid type: list")
}

/// Returns a fault of the syntax.
pub(super) fn syntax(message: String, place: Place) -> Fault {
    let hint = Some("FOLD is specified at https://github.com/edemaine/fold".to_owned());
    Fault { cause: Cause::Syntax, message, place: Some(place), at: Vec::new(), hint }
}

/// A list that is not too long: a hostile file must not fill the memory.
pub(super) struct Bounded<T>(pub(super) Vec<T>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Bounded<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Elements<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for Elements<T> {
            type Value = Bounded<T>;

            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(formatter, "a list of at most {MOST_ELEMENTS} elements")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut elements: A) -> Result<Bounded<T>, A::Error> {
                let mut list = Vec::new();
                while let Some(element) = elements.next_element()? {
                    if list.len() == MOST_ELEMENTS {
                        return Err(serde::de::Error::invalid_length(MOST_ELEMENTS + 1, &self));
                    }
                    list.push(element);
                }
                Ok(Bounded(list))
            }
        }

        deserializer.deserialize_seq(Elements(PhantomData))
    }
}
