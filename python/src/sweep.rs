//! Sweeps: parts, which any thread or process may compute, and the file they become.

use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use lamc::source::{AngleUnit, SourceFile};
use lamc_workbench::sweep::{self, Opened, Shard};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::error;
use crate::program::Program;

/// A model with a plan.
#[pyclass(frozen, module = "lamc._lamc")]
pub struct Sweep {
    sweep: sweep::Sweep,
    program: Py<Program>,
    inputs: Vec<f64>,
    is_interrupted: AtomicBool,
}

/// A plan: its name, for messages; its text; whether initial angles without a unit are in radians, and not in the model's
/// unit.
#[derive(FromPyObject)]
struct Text(String, String, bool);

/// The bytes of a part, the number of its runs, and which of them failed, with their reasons.
type Part<'py> = (Bound<'py, PyBytes>, usize, Vec<(u64, String)>);

#[pymethods]
impl Sweep {
    #[new]
    fn new(
        py: Python<'_>,
        program: Py<Program>,
        inputs: Vec<f64>,
        guess: Vec<(usize, f64)>,
        plan: Text,
        shard: (u64, u64),
    ) -> PyResult<Self> {
        let (index, of) = shard;
        let shard = Some(Shard { index, of }).filter(|_| (1..=of).contains(&index));
        let shard = shard.ok_or_else(|| {
            error(format_args!(
                "`shard` is ({index}, {of}), but must be one of (1, {of}) to ({of}, {of})"
            ))
        })?;
        let known = program.get();
        let Text(path, text, in_radians) = plan;
        let plan = SourceFile { path, text };
        let angle = if in_radians { AngleUnit::default() } else { known.compiled.numbers.angle };
        let system = known.system_with(&inputs)?;
        let sweep = py.detach(move || {
            sweep::Sweep::new(known.compiled.clone(), &system, guess, &plan, angle, shard)
                .map_err(|problems| error(problems.render(&plan, false)))
        })?;
        Ok(Self { sweep, program, inputs, is_interrupted: AtomicBool::new(false) })
    }

    /// The number of runs.
    #[getter]
    fn runs(&self) -> u64 {
        self.sweep.runs()
    }

    /// The number of parts.
    #[getter]
    fn parts(&self) -> usize {
        self.sweep.parts()
    }

    /// Computes a part; `None` if interrupted.
    fn part<'py>(&self, py: Python<'py>, part: usize) -> PyResult<Option<Part<'py>>> {
        let system = self.program.get().system_with(&self.inputs)?;
        let (sweep, flag) = (&self.sweep, &self.is_interrupted);
        let part = py.detach(move || sweep.part(part, &system, &|| flag.load(Ordering::Relaxed)));
        let part = part.map_err(error)?;
        Ok(part.map(|part| (PyBytes::new(py, &part.bytes), part.runs, part.failures)))
    }

    /// Ends parts that are being computed.
    fn interrupt(&self) {
        self.is_interrupted.store(true, Ordering::Relaxed);
    }

    /// Where to keep parts; `None` if the file is complete.
    fn open(&self, file: PathBuf, resumes: bool) -> PyResult<Option<Store>> {
        match self.sweep.open(&file, resumes).map_err(error)? {
            Opened::Complete => Ok(None),
            Opened::Begun(store) => Ok(Some(Store(Mutex::new(Some(store))))),
        }
    }
}

/// The parts that are kept, until they are joined.
#[pyclass(frozen, module = "lamc._lamc")]
pub struct Store(Mutex<Option<sweep::Store>>);

impl Store {
    /// Calls with what is kept.
    fn with<T>(&self, call: impl FnOnce(&sweep::Store) -> PyResult<T>) -> PyResult<T> {
        let store = self.0.lock().map_err(error)?;
        call(store.as_ref().ok_or_else(|| error("the parts are joined"))?)
    }
}

#[pymethods]
impl Store {
    /// The parts that are not there yet.
    fn missing(&self) -> PyResult<Vec<usize>> {
        self.with(|store| Ok(store.missing()))
    }

    /// Keeps a part.
    fn keep(&self, part: usize, bytes: &[u8]) -> PyResult<()> {
        self.with(|store| store.keep(part, bytes).map_err(error))
    }

    /// Writes the file.
    fn join(&self, py: Python<'_>) -> PyResult<()> {
        let store = self.0.lock().map_err(error)?.take();
        let store = store.ok_or_else(|| error("the parts are joined"))?;
        py.detach(|| store.join()).map_err(error)
    }
}
