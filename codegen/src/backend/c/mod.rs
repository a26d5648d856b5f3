//! The C backend: freestanding C99, a source and its header, in `double` or `float`.
//!
//! The algorithms are those of the runtime, written for fixed sizes in the template; the
//! mechanism's functions are written here. Functions of the template are static and end in no
//! suffix of a public function, so that no model's name can clash with them.

mod body;
mod description;

use tera::{Context, Tera};

use crate::program::Program;
pub(super) use body::constant;
pub(super) use description::fields;
pub use description::{STATUS, Status};

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
    render(lamc_templates::C_HEADER, &description::of(program, real))
}

/// The source, which includes its header by this name.
pub fn source(program: &Program, real: Real, header_name: &str) -> String {
    let mut context = description::of(program, real);
    context.insert("header_name", header_name);
    body::insert(&mut context, program, real);
    render(lamc_templates::C_SOURCE, &context)
}

fn render(template: &str, context: &Context) -> String {
    match Tera::one_off(template, context, false) {
        Ok(text) => text,
        Err(error) => unreachable!("the template is at fault: {error:?}"),
    }
}
