//! Stage 2: [`SourceModel`](crate::source::SourceModel) -> [`Mechanism`]: plates become mass
//! properties, hinges become springs; what is physically impossible is refused.

mod body;
mod build;
mod hinge;
mod mechanism;
mod moments;
mod plate;

#[cfg(test)]
mod tests;

pub use build::build;
pub use mechanism::*;
