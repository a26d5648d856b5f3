//! Simulations.

use std::sync::PoisonError;

use lamc_runtime::State;
use lamc_workbench::execution::Jit;
use lamc_workbench::motion::{Motion as Recorded, Work};
use lamc_workbench::simulation::{
    Event, Method, Reached, Settings, Simulation, SimulationError, sample_times, unfold,
};
use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::error;
use crate::events::{Asked, Raised};
use crate::motion::Motion;
use crate::program::Program;
use crate::states::array;

/// Steps between two looks at whether Python has been interrupted.
const PATIENCE: u32 = 200;

/// How the inputs change.
#[derive(FromPyObject)]
enum Inputs<'py> {
    /// Values for each sample, held until the next.
    Sampled(PyReadonlyArray2<'py, f64>),
    /// A function of (sample, t, q, u), whose result is held until the next sample.
    Controlled(Py<PyAny>),
}

/// What a simulation is asked for.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Request<'py> {
    times: Vec<f64>,
    q: Vec<f64>,
    u: Vec<f64>,
    /// Values at the start.
    held: Vec<f64>,
    inputs: Option<Inputs<'py>>,
    events: Vec<Asked>,
    method: String,
    tolerance: f64,
    restitution: f64,
    /// Whether the state was not given by the caller, so that a flat sheet may be bent a little.
    may_unfold: bool,
}

impl Request<'_> {
    fn settings(&self) -> PyResult<Settings> {
        let method = match &*self.method {
            "auto" => Method::Auto,
            "dopri5" => Method::Dopri5,
            "rodas" => Method::Rodas,
            other => {
                return Err(error(format_args!("`{other}` is not one of auto, dopri5, rodas")));
            }
        };
        if !(0.0..=1.0).contains(&self.restitution) {
            return Err(error("`restitution` must lie between 0 and 1"));
        }
        let duration = self.times.last().copied().unwrap_or_default();
        Ok(Settings { method, duration, tolerance: self.tolerance, restitution: self.restitution })
    }
}

/// Asks Python now and then whether it has been interrupted, and keeps what it says.
struct Watch {
    steps: u32,
    interrupt: Option<PyErr>,
}

impl Watch {
    fn is_interrupted(&mut self) -> bool {
        self.steps += 1;
        if self.steps >= PATIENCE {
            self.steps = 0;
            self.interrupt = Python::attach(|py| py.check_signals()).err();
        }
        self.interrupt.is_some()
    }
}

/// What is known after a run: why it ended early, and the inputs from each sample on.
struct Run {
    failure: Option<SimulationError>,
    interrupt: Option<PyErr>,
    held: Vec<f64>,
}

/// Runs with inputs that are held from sample to sample: `next` says which, if they change.
fn run(
    simulation: &mut Simulation,
    times: &[f64],
    mut next: impl FnMut(usize, &State<Vec<f64>, f64>) -> PyResult<Option<Vec<f64>>>,
) -> Run {
    let mut watch = Watch { steps: 0, interrupt: None };
    let mut all = Vec::new();
    let mut failure = None;
    for (sample, &t) in times.iter().enumerate() {
        match simulation.reach(t, || watch.is_interrupted()) {
            Ok(Reached::Time) => {}
            Ok(Reached::Interrupted) => break,
            Ok(Reached::Event) => {
                let end = simulation.state().t;
                failure = simulation.run([end], || false, |_| ()).err();
                all.extend_from_slice(simulation.system().inputs());
                break;
            }
            Err(found) => {
                failure = Some(found);
                break;
            }
        }
        match next(sample, simulation.state()) {
            Ok(None) => {}
            Ok(Some(values)) => simulation.hold_inputs(&values),
            Err(raised) => {
                watch.interrupt = Some(raised);
                break;
            }
        }
        if let Err(found) = simulation.run([t], || false, |_| ()) {
            failure = Some(found);
            break;
        }
        all.extend_from_slice(simulation.system().inputs());
    }
    Run { failure, interrupt: watch.interrupt, held: all }
}

impl Program {
    /// The events that are asked for.
    fn events(&self, asked: Vec<Asked>, system: &Jit, raised: &Raised) -> PyResult<Vec<Event>> {
        let event = |asked: Asked| asked.event(self.interface(), system.parameters(), raised);
        asked.into_iter().map(event).collect()
    }

    /// What a controller returns, as the inputs of the model.
    fn controlled(
        &self,
        py: Python<'_>,
        controller: &Py<PyAny>,
        sample: usize,
        state: &State<Vec<f64>, f64>,
    ) -> PyResult<Vec<f64>> {
        let arguments = (sample, state.t, array(py, &state.q), array(py, &state.u));
        let values: Vec<f64> = controller.call1(py, arguments)?.extract(py)?;
        let (given, expected) = (values.len(), self.interface().inputs.len());
        match given == expected {
            true => Ok(values),
            false => Err(error(format_args!(
                "the function gives {given} inputs, the model has {expected}"
            ))),
        }
    }
}

#[pymethods]
impl Program {
    /// The times at which a motion is recorded, s.
    fn sample_times<'py>(
        &self,
        py: Python<'py>,
        duration: f64,
        rate: f64,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let times = sample_times(&self.system(), duration, rate);
        let advice = |many| error(format_args!("{many}: lower `rate` or `duration`"));
        Ok(array(py, &times.map_err(advice)?))
    }

    /// A motion, why it ended early, and warnings.
    fn simulate(
        &self,
        py: Python<'_>,
        mut request: Request<'_>,
    ) -> PyResult<(Motion, Option<String>, Vec<String>)> {
        let mut system: Jit = self.system_with(&request.held)?;
        let settings = request.settings()?;
        let mut state = State { t: 0.0, q: request.q.clone(), u: request.u.clone() };
        let mut warnings = Vec::new();
        if request.may_unfold {
            warnings.extend(unfold(&system, &mut state).map(|fold| fold.warning("`initial`")));
        }
        let raised = Raised::default();
        let events = self.events(std::mem::take(&mut request.events), &system, &raised)?;
        let (samples, controller) = match &request.inputs {
            Some(Inputs::Sampled(samples)) => (samples.as_slice()?, None),
            Some(Inputs::Controlled(controller)) => (&[][..], Some(controller)),
            None => (&[][..], None),
        };
        let start = match controller {
            Some(controller) => self.controlled(py, controller, 0, &state)?,
            None if !samples.is_empty() => samples[..request.held.len()].to_vec(),
            None => request.held.clone(),
        };
        system.set_inputs(&start);
        let work =
            Work::new(&self.compiled.topology.mechanism, system.parameters(), system.inputs());
        let width = start.len();
        let times = &request.times;
        let (simulation, outcome) = py.detach(|| {
            let simulation = Simulation::new(system, state, work, &settings);
            let mut simulation = simulation.map_err(|failure| self.failure(&failure))?;
            simulation.record_tensions(&self.compiled.topology.mechanism);
            events.into_iter().for_each(|event| simulation.watch(event));
            let outcome = run(&mut simulation, times, |sample, state| match controller {
                // The first call was made before.
                Some(_) if sample == 0 => Ok(None),
                Some(controller) => {
                    Python::attach(|py| self.controlled(py, controller, sample, state)).map(Some)
                }
                None if samples.is_empty() || sample == 0 => Ok(None),
                None => Ok(Some(samples[sample * width..][..width].to_vec())),
            });
            PyResult::Ok((simulation, outcome))
        })?;
        let raised = raised.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(raised) = raised.or(outcome.interrupt) {
            return Err(raised);
        }
        let steps = simulation.steps();
        let recorded =
            Recorded { complete: outcome.failure.is_none(), ..simulation.motion().clone() };
        let motion = Motion {
            compiled: self.compiled.clone(),
            recorded,
            inputs: outcome.held,
            steps: [steps.explicit, steps.implicit],
            events: simulation.events().map(<[_]>::to_vec).collect(),
        };
        Ok((motion, outcome.failure.map(|failure| failure.to_string()), warnings))
    }
}
