//! Stage 2: [`SourceModel`](crate::source::SourceModel) -> [`Mechanism`]: plates become mass
//! properties, hinges become springs; what is physically impossible is refused.

mod mechanism;

pub use mechanism::*;
