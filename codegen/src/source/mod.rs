//! Stage 1: text -> [`SourceModel`], with spans and diagnostics.

pub mod diagnostic;
pub mod expression;
pub mod ids;
mod model;

pub use diagnostic::{Diagnostic, Diagnostics, Severity, SourceFile, Span, Spanned};
pub use expression::{Binary, Expression, Unary};
pub use ids::{BodyId, InputId, JointId, ParameterId, PointId};
pub use model::*;
