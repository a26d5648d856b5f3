//! The native half of the Python package `lamc`: compiled models run here. It contains neither the symbolic
//! engine nor what derives equations; the command `lamc` does that in a process of its own.

mod course;
mod events;
mod fit;
mod interrupt;
mod modules;
mod motion;
mod program;
mod rest;
mod simulate;
mod states;
mod sweep;

use std::fmt::Display;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

pyo3::create_exception!(
    lamc,
    Error,
    PyValueError,
    "A mistake in a model or an argument, or what went wrong with a motion."
);

/// An exception of this package with a text.
fn error(reason: impl Display) -> PyErr {
    Error::new_err(reason.to_string())
}

#[pymodule]
mod _lamc {
    #[pymodule_export]
    use super::Error;
    #[pymodule_export]
    use crate::course::Course;
    #[pymodule_export]
    use crate::motion::Motion;
    #[pymodule_export]
    use crate::program::Program;
    #[pymodule_export]
    use crate::sweep::{Store, Sweep};
}
