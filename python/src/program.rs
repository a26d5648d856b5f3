//! A compiled model with values for its parameters.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use lamc::laminate::verdicts;
use lamc::pipeline::Compiled;
use lamc::program::{Executable, Interface};
use lamc::source::Severity;
use lamc_runtime::{Error as RuntimeError, Mechanism as _};
use lamc_workbench::check::Check;
use lamc_workbench::execution::Jit;
use lamc_workbench::simulation::describe;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::error;

/// A compiled model. It does not change; calls from several threads run beside each other.
#[pyclass(frozen, module = "lamc._lamc")]
pub struct Program {
    pub compiled: Arc<Compiled>,
    /// Copied by each call. The copies share the machine code.
    system: Mutex<Jit>,
}

impl Program {
    /// A copy to run.
    pub fn system(&self) -> Jit {
        self.system.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// A copy with these inputs, SI.
    pub fn system_with(&self, inputs: &[f64]) -> PyResult<Jit> {
        let mut system = self.system();
        let count = self.interface().inputs.len();
        if inputs.len() != count {
            return Err(error(format_args!(
                "{} inputs are given, the model has {count}",
                inputs.len()
            )));
        }
        system.set_inputs(inputs);
        Ok(system)
    }

    pub fn interface(&self) -> &Interface {
        &self.compiled.program.interface
    }

    /// An error of the runtime, with the name of the joint.
    pub fn failure(&self, failure: &RuntimeError) -> PyErr {
        error(describe(failure, self.interface()))
    }
}

#[pymethods]
impl Program {
    /// Reads what `lamc derive` wrote.
    #[new]
    fn new(bytes: &[u8]) -> PyResult<Self> {
        let compiled = Compiled::from_bytes(bytes).map_err(error)?;
        let system = Mutex::new(Executable::new(&compiled.program));
        Ok(Self { compiled: Arc::new(compiled), system })
    }

    /// The bytes from which it can be read again, without the values of `with_parameters`.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.compiled.to_bytes())
    }

    /// Names, numbers and settings of the model.
    fn description<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let interface = self.interface();
        let about = PyDict::new(py);
        about.set_item("name", &interface.name)?;
        let joints = interface.joints.iter();
        about.set_item("joints", joints.clone().map(|joint| &joint.name).collect::<Vec<_>>())?;
        about.set_item(
            "joint_bodies",
            joints.clone().map(|joint| &joint.bodies).collect::<Vec<_>>(),
        )?;
        let free = interface.free.iter();
        about.set_item("free_bodies", free.map(|body| &body.name).collect::<Vec<_>>())?;
        let coordinates = interface.coordinate_columns().map(|(name, _)| name);
        about.set_item("coordinates", coordinates.collect::<Vec<_>>())?;
        let speeds = interface.speed_columns().map(|(name, _)| name);
        about.set_item("speeds", speeds.collect::<Vec<_>>())?;
        // Of the mechanism whose loops were made exact.
        let hinges = self.compiled.topology.mechanism.joints.iter();
        let origins = hinges.clone().map(|joint| <[f64; 3]>::from(joint.point));
        about.set_item("hinge_origins", origins.collect::<Vec<_>>())?;
        let axes = hinges.map(|joint| <[f64; 3]>::from(joint.direction));
        about.set_item("hinge_axes", axes.collect::<Vec<_>>())?;
        about.set_item("limits", joints.clone().map(|joint| joint.limits).collect::<Vec<_>>())?;
        about.set_item("driven", joints.clone().map(|joint| joint.driven).collect::<Vec<_>>())?;
        let start = self.system().initial();
        about.set_item("initial_q", start.q)?;
        about.set_item("initial_u", start.u)?;
        about.set_item("pinned", joints.map(|joint| joint.initial_given).collect::<Vec<_>>())?;
        about.set_item(
            "bodies",
            interface.bodies.iter().map(|body| &body.name).collect::<Vec<_>>(),
        )?;
        about.set_item("points", &interface.points)?;
        about.set_item("contacts", &interface.contacts)?;
        about.set_item("inputs", &interface.inputs)?;
        let memory = interface.controllers.iter().flat_map(|controller| {
            let named =
                |(name, first): &(String, f64)| (format!("{}.{name}", controller.name), *first);
            controller.memory.iter().map(named).collect::<Vec<_>>()
        });
        about.set_item("memory", memory.collect::<Vec<_>>())?;
        let commanded = interface.commands().map(|input| &interface.inputs[input.index()]);
        about.set_item("commanded", commanded.collect::<Vec<_>>())?;
        about.set_item("loops", &interface.loops)?;
        about.set_item("mobility", interface.mobility)?;
        about.set_item("rank", interface.rank)?;
        about.set_item("rows", interface.rows)?;
        about.set_item("size", interface.size)?;
        let system = self.system();
        let parameters = PyDict::new(py);
        for (parameter, value) in interface.parameters.iter().zip(system.parameters()) {
            parameters.set_item(&parameter.name, value)?;
        }
        about.set_item("parameters", parameters)?;
        Ok(about)
    }

    /// The report of `lamc check`, and its warnings.
    fn check(&self, py: Python<'_>) -> (String, Vec<String>) {
        let compiled = &self.compiled;
        py.detach(|| {
            let check = Check::new(compiled);
            (check.report(), check.warnings())
        })
    }

    /// A model with other values of some parameters (SI), which shares the machine code, and the
    /// warnings that these values give rise to.
    fn with_parameters(&self, values: BTreeMap<String, f64>) -> PyResult<(Self, Vec<String>)> {
        let mut system = self.system();
        for (name, value) in &values {
            system.set_parameter(name, *value).map_err(error)?;
        }
        let mut warnings = Vec::new();
        let known = verdicts(&self.compiled.topology.mechanism, self.system().parameters());
        let compiled = match self.compiled.topology_at(system.parameters()).map_err(error)? {
            Cow::Borrowed(_) => self.compiled.clone(),
            Cow::Owned(topology) => Arc::new(Compiled { topology, ..(*self.compiled).clone() }),
        };
        for verdict in verdicts(&compiled.topology.mechanism, system.parameters()) {
            match verdict.severity {
                Severity::Error => return Err(error(verdict)),
                Severity::Warning if !known.contains(&verdict) => {
                    warnings.push(verdict.to_string())
                }
                Severity::Warning | Severity::Note => {}
            }
        }
        Ok((Self { compiled, system: Mutex::new(system) }, warnings))
    }
}
