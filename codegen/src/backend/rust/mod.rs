//! The Rust backend: a module generic over the runtime's `Scalar`, or for one float type.
//!
//! Items are tokens, formatted by prettyplease; bodies of functions are text, put in afterwards
//! where the tokens say `__body!(index);`, and the header is put in front.

mod body;
mod exports;
mod header;
mod implementation;
mod items;
mod methods;
mod straight_line;

use crate::backend::c::Real;
use crate::program::{Program, Selection};
pub use body::HELPERS;

/// The number type of a generated module.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ScalarChoice {
    /// `struct Model<S>`, for every `lamc_runtime::Scalar`.
    #[default]
    Generic,
    /// `f64` throughout.
    F64,
    /// `f32` throughout.
    F32,
}

/// How to write a module.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// The number type.
    pub scalar: ScalarChoice,
    /// Whether the module exports the functions of the C header; a generic one in `f64`.
    pub extern_c: bool,
    /// Which of the functions that solve the module has: where one is left out, the runtime solves
    /// by its own algorithms, in more time.
    pub functions: Selection,
}

impl Options {
    /// The number type of the C interface.
    pub fn c_real(&self) -> Real {
        match self.scalar {
            ScalarChoice::F32 => Real::Float,
            ScalarChoice::Generic | ScalarChoice::F64 => Real::Double,
        }
    }
}

/// The module's text: the same bytes for the same program and options.
///
/// # Panics
/// When the tokens are not Rust: a bug of this backend.
pub fn write(program: &Program, options: &Options) -> String {
    let program = &program.only(options.functions);
    let (tokens, bodies) = items::module(program, options);
    let file: syn::File = match syn::parse2(tokens) {
        Ok(file) => file,
        Err(error) => unreachable!("the generated module is not Rust: {error}"),
    };
    let code = prettyplease::unparse(&file);
    let mut text = header::header(program, options);
    let mut within_item = false;
    for line in code.lines() {
        // prettyplease sets items close together: a blank line before each, documented or not.
        let begins = line.starts_with(|c: char| !c.is_whitespace() && c != '}' && c != ')');
        if begins && !within_item {
            text.push('\n');
        }
        within_item = if begins {
            line.starts_with("///") || line.starts_with('#') || !line.ends_with([';', '}'])
        } else {
            within_item && !line.starts_with('}')
        };
        text.push_str(body(&bodies, line).unwrap_or(line));
        text.push('\n');
    }
    text
}

/// The text a line stands for.
fn body<'a>(bodies: &'a [String], line: &str) -> Option<&'a str> {
    let index = line.trim_start().strip_prefix("__body!(")?.strip_suffix(");")?;
    bodies.get(index.parse::<usize>().ok()?).map(String::as_str)
}
