//! What an expression may name, and what is wrong with one.

use std::ops::Range;

use crate::source::codes::Code;
use crate::source::expression::Expression;
use crate::source::ids::{JointId, PointId};

/// A mistake in an expression; the range is in bytes of its text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::source) struct Problem {
    pub code: Code,
    pub range: Range<usize>,
    pub message: String,
    pub label: String,
    pub hint: Option<String>,
}

/// The meaning of the names in an expression.
pub(in crate::source) trait Scope {
    /// A name without prefix that is neither `pi` nor `t`.
    fn symbol(&self, name: &str) -> Option<Expression>;
    /// Every name that is allowed here, but for `pi`.
    fn symbols(&self) -> Vec<&str>;
    /// The joint of this name.
    fn joint(&self, name: &str) -> Option<JointId>;
    /// Every joint.
    fn joints(&self) -> Vec<&str>;
    /// Why the expression must not depend on `q` and `u`; `None` if it may.
    fn motion_refused(&self) -> Option<&'static str>;
    /// Why a name that exists cannot be used; `None` if it can.
    fn symbol_refused(&self, _: &str) -> Option<String> {
        None
    }
    /// The output point of this name.
    fn point(&self, _: &str) -> Option<PointId> {
        None
    }
    /// Every output point; `None` if the expression must not depend on them.
    fn points(&self) -> Option<Vec<&str>> {
        None
    }
    /// The number of mistakes that were found in the file before this expression.
    fn earlier_mistakes(&self) -> usize {
        0
    }
}
