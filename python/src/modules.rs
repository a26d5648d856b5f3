//! The model as Rust, C, Python around C, and as an FMU.

use lamc::backend::c::Real;
use lamc::backend::fmu::Version;
use lamc::backend::rust::{Options, ScalarChoice};
use lamc::pipeline;
use lamc::program::Selection;
use lamc_workbench::archive;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::error;
use crate::program::Program;

fn selection(functions: Option<Vec<String>>) -> PyResult<Selection> {
    functions.map_or(Ok(Selection::default()), |names| Selection::named(&names).map_err(error))
}

#[pymethods]
impl Program {
    /// The Rust module.
    fn rust(
        &self,
        scalar: &str,
        extern_c: bool,
        functions: Option<Vec<String>>,
    ) -> PyResult<String> {
        let scalar = match scalar {
            "generic" => ScalarChoice::Generic,
            "f64" => ScalarChoice::F64,
            "f32" => ScalarChoice::F32,
            other => return Err(error(format_args!("`{other}` is not one of generic, f64, f32"))),
        };
        let options = Options { scalar, extern_c, functions: selection(functions)? };
        pipeline::rust_module(&self.compiled, &options).map_err(error)
    }

    /// The C module and its header, which has this name.
    fn c(
        &self,
        scalar: &str,
        header: &str,
        functions: Option<Vec<String>>,
    ) -> PyResult<(String, String)> {
        let real = match scalar {
            "f64" => Real::Double,
            "f32" => Real::Float,
            other => return Err(error(format_args!("`{other}` is not one of f64, f32"))),
        };
        let mut compiled = (*self.compiled).clone();
        compiled.program = compiled.program.only(selection(functions)?);
        let source = pipeline::c_source(&compiled, real, header).map_err(error)?;
        Ok((source, pipeline::c_header(&compiled, real)))
    }

    /// A source FMU.
    fn fmu<'py>(&self, py: Python<'py>, version: u32) -> PyResult<Bound<'py, PyBytes>> {
        let version = match version {
            2 => Version::Fmi2,
            3 => Version::Fmi3,
            other => return Err(error(format_args!("FMI {other} is not one of 2, 3"))),
        };
        let files = pipeline::fmu_files(&self.compiled, version).map_err(error)?;
        Ok(PyBytes::new(py, &archive::pack(&files)))
    }
}
