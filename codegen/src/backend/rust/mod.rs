//! The Rust backend: a module generic over the runtime's `Scalar`, or for one float type.
//!
//! Items are tokens, which prettyplease formats. The bodies of functions are text: they replace the
//! placeholders `__body!(index);` afterwards. The header comment is put in front at the end.

mod body;
mod contacts;
mod control;
mod exports;
mod fused;
mod header;
mod implementation;
mod items;
mod loops;
mod mechanism;
mod methods;
mod numbered;
mod reduction;
mod sizes;
mod solutions;
mod straight_line;
mod tables;

use std::borrow::Cow;

use crate::backend::c::Real;
use crate::program::{Program, Selection};
pub use body::HELPERS;

/// The number type of a generated module.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ScalarChoice {
    /// The struct is generic, `struct Model<S>`, for every `lamc_runtime::Scalar`.
    #[default]
    Generic,
    /// All numbers are `f64`.
    F64,
    /// All numbers are `f32`.
    F32,
}

/// Options for the generated Rust module.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// The number type.
    pub scalar: ScalarChoice,
    /// Whether the module exports the functions of the C header. A generic module exports them in
    /// `f64`.
    pub extern_c: bool,
    /// Which of the solving functions the module has. If one is left out, the runtime solves with its
    /// own algorithms instead, which takes more time.
    pub functions: Selection,
}

impl Options {
    /// Returns the number type of the C interface.
    pub fn c_real(&self) -> Real {
        match self.scalar {
            ScalarChoice::F32 => Real::Float,
            ScalarChoice::Generic | ScalarChoice::F64 => Real::Double,
        }
    }
}

/// Returns the text of the module. The same program and options always give the same bytes.
///
/// # Panics
/// Panics if the tokens are not valid Rust, which is a bug of this backend.
pub fn write(program: &Program, options: &Options) -> String {
    let chosen = program.only(options.functions);
    // Next to singular states the reduction would save time, but the modules of sheets would be twice as long.
    let program = match chosen.interface.has_stops() {
        true => &Cow::Borrowed(&chosen),
        false => &chosen.without_reduction(),
    };
    let (tokens, bodies) = items::module(program, options);
    let file: syn::File = match syn::parse2(tokens) {
        Ok(file) => file,
        Err(error) => unreachable!("the generated module is not Rust: {error}"),
    };
    let code = prettyplease::unparse(&file);
    let mut text = header::header(program, options);
    let mut within_item = false;
    for line in code.lines() {
        // prettyplease puts no blank lines between items, so one is added before each item, documented
        // or not.
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

/// Returns the text that replaces a line, if the line is a placeholder.
fn body<'a>(bodies: &'a [String], line: &str) -> Option<&'a str> {
    let index = line.trim_start().strip_prefix("__body!(")?.strip_suffix(");")?;
    bodies.get(index.parse::<usize>().ok()?).map(String::as_str)
}
