//! The C backend: freestanding C99, a source and its header, in `double` or `float`.
//!
//! The algorithms are those of the runtime, written for fixed sizes in C files of their own. They are
//! pasted in after the mechanism's functions, which this backend writes. Everything that is not public
//! is static, and its name does not end in a suffix of a public name, so that it cannot clash with the
//! name of any model.

mod algorithms;
mod body;
mod constants;
mod description;
mod offered;
mod tables;

use lamc_runtime::constants::{ALL, Constant};
use tera::{Context, Tera};

use crate::program::Program;
pub(super) use body::constant;
pub use body::{helpers, offered};
pub(super) use description::fields;
pub use description::{MACROS, STATUS, Status};
pub use offered::OFFERED;

/// The number type of a C module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Real {
    /// The type `double`.
    Double,
    /// The type `float`.
    Float,
}

impl Real {
    /// Returns the name of the type.
    pub fn name(self) -> &'static str {
        match self {
            Self::Double => "double",
            Self::Float => "float",
        }
    }

    /// Returns the suffix of the library's functions and of the literals for this type.
    fn suffix(self) -> &'static str {
        match self {
            Self::Double => "",
            Self::Float => "f",
        }
    }

    /// Returns the size of a number in bytes.
    pub fn bytes(self) -> usize {
        match self {
            Self::Double => 8,
            Self::Float => 4,
        }
    }
}

/// Returns the header: types, constants, and the declarations of the functions with units.
pub fn header(program: &Program, real: Real) -> String {
    let program = &program.without_reduction();
    let mut context = description::of(program, real);
    context.insert("offered", &offered::offered(program, real.name()));
    render(lamc_templates::C_HEADER, &context)
}

/// Returns the source, which includes its header by the name `header_name`.
pub fn source(program: &Program, real: Real, header_name: &str) -> String {
    source_with(program, real, header_name, ALL)
}

/// Returns the same text as [`source`], but with these values of the constants that are shared with the
/// runtime.
pub fn source_with(
    program: &Program,
    real: Real,
    header_name: &str,
    constants: &[Constant],
) -> String {
    let program = &program.without_reduction();
    let mut context = description::of(program, real);
    context.insert("header_name", header_name);
    context.insert("offered", &offered::offered(program, "real"));
    body::insert(&mut context, program, real, &header(program, real));
    algorithms::insert(&mut context, program, real, constants);
    render(lamc_templates::C_SOURCE, &context)
}

/// Returns the constants as macros, each below a comment with its meaning.
pub fn constants<'a>(constants: impl IntoIterator<Item = &'a Constant>, real: Real) -> String {
    let definitions: Vec<_> =
        constants.into_iter().map(|constant| constants::define(constant, real)).collect();
    let mut context = Context::new();
    context.insert("constants", &definitions);
    render(lamc_templates::C_CONSTANTS, &context)
}

fn render(template: &str, context: &Context) -> String {
    match Tera::one_off(template, context, false) {
        Ok(text) => text,
        Err(error) => unreachable!("the template is at fault: {error:?}"),
    }
}
