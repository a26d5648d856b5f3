//! Motions with derivatives.

use std::sync::{Arc, Mutex, PoisonError};

use lamc::pipeline::Compiled;
use lamc_runtime::{Mechanism as _, State};
use lamc_workbench::adjoint::{
    Course as Recorded, Differentiated, Method, Schedule, Slopes, Undifferentiable,
};
use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error;
use crate::interrupt::interruptible;
use crate::program::Program;
use crate::states::array;

/// A motion that can be differentiated.
#[pyclass(frozen, module = "lamc._lamc")]
pub struct Course {
    compiled: Arc<Compiled>,
    differentiated: Mutex<Differentiated>,
    recorded: Arc<Mutex<Recorded>>,
    /// Whether assembly of the start moved joints, and which of them it left where they were.
    pinned: Option<Vec<bool>>,
}

/// What a motion is asked for.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Request<'py> {
    /// The times of the samples after the start, s.
    times: Vec<f64>,
    q: Vec<f64>,
    u: Vec<f64>,
    /// How many from one sample to the next; `None`: as many as the tolerance takes, rad and rad/s.
    steps: Option<usize>,
    tolerance: f64,
    method: String,
    /// The inputs until each sample.
    inputs: PyReadonlyArray2<'py, f64>,
    pinned: Option<Vec<bool>>,
}

/// Derivatives of a number at samples: rows, or nothing.
type Rows<'py> = Option<PyReadonlyArray2<'py, f64>>;

fn rows(given: Option<PyReadonlyArray2<'_, f64>>) -> Vec<Vec<f64>> {
    let rows = given.iter().flat_map(|given| {
        given.as_array().rows().into_iter().map(|it| it.to_vec()).collect::<Vec<_>>()
    });
    rows.collect()
}

#[pymethods]
impl Program {
    /// Integrates a motion with fixed steps.
    fn course(&self, py: Python<'_>, request: Request<'_>) -> PyResult<Course> {
        let Request { times, q, u, steps, tolerance, method, inputs, pinned } = request;
        self.interface().without_controllers("derivatives of motions").map_err(error)?;
        let method = match &*method {
            "rk4" => Method::Rk4,
            "euler" => Method::Euler,
            "rodas" => Method::Rodas,
            other => return Err(error(format_args!("`{other}` is not one of rk4, euler, rodas"))),
        };
        let inputs = rows(Some(inputs));
        let compiled = self.compiled.clone();
        let mut system = self.system();
        if let Some(first) = inputs.first() {
            system.set_inputs(first);
        }
        let state = State { t: 0.0, q, u };
        let (differentiated, recorded) = interruptible(py, move || {
            let differentiated = Differentiated::new(&compiled.program, system);
            let schedule = |steps| Schedule { method, samples: &times, steps, inputs: &inputs };
            let recorded = match steps {
                Some(steps) => Recorded::new(&differentiated, state, schedule(steps)),
                None => Recorded::accurate(&differentiated, &state, schedule(1), tolerance),
            };
            (differentiated, recorded)
        })?;
        let recorded = recorded.map_err(|reason| self.undifferentiable(&reason))?;
        Ok(Course {
            compiled: self.compiled.clone(),
            differentiated: Mutex::new(differentiated),
            recorded: Arc::new(Mutex::new(recorded)),
            pinned,
        })
    }
}

impl Program {
    fn undifferentiable(&self, reason: &Undifferentiable) -> PyErr {
        error(reason.describe(self.interface()))
    }
}

#[pymethods]
impl Course {
    /// Time, q, u and points of all samples, one after the other.
    fn samples<'py>(&self, py: Python<'py>) -> PyResult<[Bound<'py, PyArray1<f64>>; 4]> {
        let recorded = self.recorded.lock().unwrap_or_else(PoisonError::into_inner);
        let differentiated = self.differentiated.lock().unwrap_or_else(PoisonError::into_inner);
        let samples = &recorded.samples;
        let t: Vec<f64> = samples.iter().map(|sample| sample.t).collect();
        let q: Vec<f64> = samples.iter().flat_map(|sample| sample.q.clone()).collect();
        let u: Vec<f64> = samples.iter().flat_map(|sample| sample.u.clone()).collect();
        let mut points = Vec::new();
        if !self.compiled.program.interface.points.is_empty() {
            for sample in samples {
                let found = differentiated.system.points(&sample.q).map_err(error)?;
                points.extend(found.into_iter().flatten());
            }
        }
        Ok([array(py, &t), array(py, &q), array(py, &u), array(py, &points)])
    }

    /// The derivatives of a number, from those by states (NQ + NU), points (3 each) and energies (2) at the samples.
    fn gradient<'py>(
        &self,
        py: Python<'py>,
        states: Rows<'py>,
        points: Rows<'py>,
        energies: Rows<'py>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let slopes = Slopes {
            states: rows(states),
            points: rows(points),
            energies: rows(energies).into_iter().map(|row| [row[0], row[1]]).collect(),
        };
        let recorded = self.recorded.clone();
        let found = interruptible(py, move || {
            let recorded = recorded.lock().unwrap_or_else(PoisonError::into_inner);
            recorded.pull(&[slopes]).map(|gradients| (gradients, recorded.samples[0].clone()))
        })?;
        let describe =
            |reason: Undifferentiable| error(reason.describe(&self.compiled.program.interface));
        let (gradients, start) = found.map_err(describe)?;
        let Some(mut gradient) = gradients.into_iter().next() else { return Ok(PyDict::new(py)) };
        if let Some(pinned) = &self.pinned {
            let differentiated = self.differentiated.lock().unwrap_or_else(PoisonError::into_inner);
            gradient = differentiated.assembled(&start, pinned, &gradient).map_err(describe)?;
        }
        let inputs: Vec<f64> = gradient.inputs.into_iter().flatten().collect();
        let about = PyDict::new(py);
        for (name, values) in [
            ("q", &gradient.q),
            ("u", &gradient.u),
            ("parameters", &gradient.parameters),
            ("inputs", &inputs),
        ] {
            about.set_item(name, array(py, values))?;
        }
        Ok(about)
    }
}
