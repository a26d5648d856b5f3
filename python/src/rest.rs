//! Closed states, states of rest, and small motions about them.

use lamc_runtime::{Mechanism as _, State};
use lamc_workbench::linear::{Motions, Stability};
use lamc_workbench::rest::Rest;
use lamc_workbench::simulation::{Asked, start};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::error;
use crate::interrupt::interruptible;
use crate::program::Program;
use crate::states::array;

/// q and u, and warnings.
type Assembled<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Vec<String>);

#[pymethods]
impl Program {
    /// The closed state nearest to a guess at a time, s, and warnings: joints that are pinned keep their angles if the loops close that
    /// way. `is_folded`: the other angles are a share of the finished fold.
    fn assemble<'py>(
        &self,
        py: Python<'py>,
        t: f64,
        q: Vec<f64>,
        u: Vec<f64>,
        pinned: Vec<bool>,
        is_folded: bool,
    ) -> PyResult<Assembled<'py>> {
        let system = self.system();
        let topology = &self.compiled.topology;
        let asked = Asked { state: State { t, q, u }, pinned, is_folded };
        let mut warnings = Vec::new();
        let tell = |warning| warnings.push(warning);
        let state = py.detach(move || start(topology, &system, &asked, tell)).map_err(error)?;
        Ok((array(py, &state.q), array(py, &state.u), warnings))
    }

    /// The state of rest near a closed state at a time, s, and these inputs, and the small motions about it.
    fn rest<'py>(
        &self,
        py: Python<'py>,
        t: f64,
        q: Vec<f64>,
        inputs: Vec<f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        self.interface().without_controllers("states of rest").map_err(error)?;
        let system = self.system_with(&inputs)?;
        let compiled = self.compiled.clone();
        let state = State { t, u: system.speeds(), q };
        let rest =
            interruptible(py, move || Rest::new(&compiled.topology.mechanism, system, state));
        let Rest { found, state, potential, motions, .. } =
            rest?.map_err(|failure| self.failure(&failure))?;
        let Motions { linear, modes, stability, warnings, .. } = motions;
        let Stability { stable, statically_stable, dynamically_stable, neutral } = stability;
        let about = PyDict::new(py);
        about.set_item("q", array(py, &state.q))?;
        about.set_item("force", found.force)?;
        about.set_item("iterations", found.iterations)?;
        about.set_item("potential_energy", potential)?;
        about.set_item("stable", stable)?;
        about.set_item("statically_stable", statically_stable)?;
        about.set_item("dynamically_stable", dynamically_stable)?;
        about.set_item("neutral", neutral)?;
        about.set_item("warnings", warnings)?;
        about.set_item("basis", &linear.basis)?;
        about.set_item("a", &linear.a)?;
        about.set_item("b", &linear.b)?;
        about.set_item("neutral_directions", linear.neutral_directions())?;
        let modes = modes
            .iter()
            .map(|mode| (mode.eigenvalue, mode.frequency, mode.damping_ratio, mode.shape.clone()));
        about.set_item("modes", PyList::new(py, modes)?)?;
        Ok(about)
    }
}
