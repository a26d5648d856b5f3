//! Parameters from measured motions.

use lamc_workbench::identify::{Fit, NEAR, Problem, Record, prescribes};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error;
use crate::interrupt::interruptible;
use crate::program::Program;
use crate::states::array;

/// The error of integration that is allowed, rad.
const TOLERANCE: f64 = 1e-9;

#[pymethods]
impl Program {
    /// The parameters with which the motion that starts near `initial` is nearest to the measured coordinates `q`, one list
    /// for each time; NaN was not measured.
    fn fit<'py>(
        &self,
        py: Python<'py>,
        t: Vec<f64>,
        q: Vec<Vec<f64>>,
        free: Vec<String>,
        initial: Vec<(usize, f64)>,
        from_rest: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        self.interface().without_controllers("fits").map_err(error)?;
        let mut system = self.system();
        let parameters = &self.interface().parameters;
        let index = |name: &String| {
            let found = parameters.iter().position(|parameter| parameter.name == *name);
            let index =
                found.ok_or_else(|| error(format_args!("no parameter is called `{name}`")))?;
            match prescribes(&self.compiled.topology.mechanism, index) {
                true => Err(error(format_args!(
                    "`{name}` cannot be free: a prescribed angle depends on it"
                ))),
                false => Ok(index),
            }
        };
        let free = free.iter().map(index).collect::<PyResult<Vec<usize>>>()?;
        for (joint, angle) in initial {
            system.set_initial(joint, angle);
        }
        let record = Record { t, q };
        let names: Vec<String> = self.interface().speed_columns().map(|(name, _)| name).collect();
        let fit = interruptible(py, move || {
            let problem =
                Problem { system, record: &record, free, from_rest, tolerance: TOLERANCE };
            problem.solve()
        });
        let Fit { estimates, correlations, rms, share, q, kept, evaluations, .. } =
            fit?.map_err(error)?;
        let about = PyDict::new(py);
        about.set_item("names", estimates.iter().map(|it| &it.name).collect::<Vec<_>>())?;
        about.set_item("values", estimates.iter().map(|it| it.value).collect::<Vec<_>>())?;
        about
            .set_item("errors", estimates.iter().map(|it| it.standard_error).collect::<Vec<_>>())?;
        about.set_item("correlations", array(py, &correlations))?;
        about.set_item("rms", rms)?;
        about.set_item("share", share)?;
        about.set_item("is_near", share <= NEAR)?;
        about.set_item("q", q)?;
        about.set_item("kept", kept.iter().map(|&k| &names[k]).collect::<Vec<_>>())?;
        about.set_item("evaluations", evaluations)?;
        Ok(about)
    }
}
