//! The C backend: freestanding C99, a source and its header, in `double` or `float`.
//!
//! The algorithms are those of the runtime, written for fixed sizes in C files of their own, which are
//! pasted in behind the mechanism's functions; these are written here. What is not public is static and
//! ends in no suffix of a public name, so that no model's name can clash with it.

mod algorithms;
mod body;
mod constants;
mod description;
mod offered;

use lamc_runtime::constants::{ALL, Constant};
use tera::{Context, Tera};

use crate::program::Program;
pub(super) use body::constant;
pub use body::helpers;
pub(super) use description::fields;
pub use description::{MACROS, STATUS, Status};
pub use offered::OFFERED;

/// The number type of C.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Real {
    /// `double`.
    Double,
    /// `float`.
    Float,
}

impl Real {
    /// The type's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Double => "double",
            Self::Float => "float",
        }
    }

    /// What the library's functions and the literals of this type end in.
    fn suffix(self) -> &'static str {
        match self {
            Self::Double => "",
            Self::Float => "f",
        }
    }

    /// Bytes of a number.
    pub fn bytes(self) -> usize {
        match self {
            Self::Double => 8,
            Self::Float => 4,
        }
    }
}

/// The header: types, constants, and the functions' declarations with units.
pub fn header(program: &Program, real: Real) -> String {
    let mut context = description::of(program, real);
    context.insert("offered", &offered::offered(program, real.name()));
    render(lamc_templates::C_HEADER, &context)
}

/// The source, which includes its header by this name.
pub fn source(program: &Program, real: Real, header_name: &str) -> String {
    source_with(program, real, header_name, ALL)
}

/// As [`source`], with these values of the constants that are the runtime's as well.
pub fn source_with(
    program: &Program,
    real: Real,
    header_name: &str,
    constants: &[Constant],
) -> String {
    let mut context = description::of(program, real);
    context.insert("header_name", header_name);
    context.insert("offered", &offered::offered(program, "real"));
    body::insert(&mut context, program, real, &header(program, real));
    algorithms::insert(&mut context, program, real, constants);
    render(lamc_templates::C_SOURCE, &context)
}

/// The constants as macros, each under its meaning.
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
