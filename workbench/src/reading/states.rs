//! States of a model as JSON: `{"states": [{"q": [..], "u": [..], "t": 0}]}`.

use std::collections::BTreeMap;
use std::fmt;

use lamc::source::{Diagnostic, Diagnostics, Span, codes};
use serde::Deserialize;
use serde::de::{Deserializer, Error, SeqAccess, Visitor};

/// Most states of a file.
pub const MAX_STATES: usize = 100_000;
/// How the message about too many states begins.
const TOO_MANY: &str = "more than";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Input {
    #[serde(deserialize_with = "limited")]
    states: Vec<StateInput>,
}

/// A state, in SI units and radians.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StateInput {
    /// Angles of the joints, rad.
    pub q: Vec<f64>,
    /// Their rates, rad/s; zero if absent.
    pub u: Option<Vec<f64>>,
    /// Time, s.
    #[serde(default)]
    pub t: f64,
    /// Inputs that are not zero, SI.
    #[serde(default)]
    pub inputs: BTreeMap<String, f64>,
    /// Parameters that differ from the model's, SI.
    #[serde(default)]
    pub params: BTreeMap<String, f64>,
}

/// Reads the states of a text.
///
/// # Errors
/// Returns an error if the text is not JSON, has other keys, or more than [`MAX_STATES`] states.
pub fn states(text: &str) -> Result<Vec<StateInput>, Diagnostics> {
    let input: Result<Input, _> = serde_json::from_str(text);
    input.map(|input| input.states).map_err(|error| {
        let message = error.to_string();
        let place = format!(" at line {} column {}", error.line(), error.column());
        let message = message.strip_suffix(&place).unwrap_or(&message);
        let at = byte_at(text, error.line(), error.column());
        let span = Span { start: at, end: (at + 1).min(text.len()) };
        let error = if message.starts_with(TOO_MANY) {
            Diagnostic::error(codes::TOO_MANY_STATES, span, message).hint("divide the file")
        } else {
            Diagnostic::error(codes::BAD_STATES, span, format!("these are not states: {message}"))
                .hint("write {\"states\": [{\"q\": [..], \"u\": [..], \"t\": 0}]}")
        };
        error.into()
    })
}

/// Returns the byte before a line and a column in bytes, both counted from 1 (columns from 0 on an empty line).
fn byte_at(text: &str, line: usize, column: usize) -> usize {
    let lines = text.split_inclusive('\n').take(line.saturating_sub(1));
    let start: usize = lines.map(str::len).sum();
    (start + column.saturating_sub(1)).min(text.len())
}

/// Reads the list of states, up to the limit.
fn limited<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<StateInput>, D::Error> {
    struct Limited;
    impl<'de> Visitor<'de> for Limited {
        type Value = Vec<StateInput>;

        fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
            formatter.write_str("a list of states")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Self::Value, A::Error> {
            let mut states = Vec::new();
            while let Some(state) = items.next_element()? {
                if states.len() == MAX_STATES {
                    return Err(A::Error::custom(format_args!("{TOO_MANY} {MAX_STATES} states")));
                }
                states.push(state);
            }
            Ok(states)
        }
    }
    deserializer.deserialize_seq(Limited)
}
