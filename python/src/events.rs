//! Events of simulations: functions of Python, and formulas.

use std::sync::{Arc, Mutex, PoisonError};

use lamc::program::Interface;
use lamc::source::{Expression, Vocabulary};
use lamc_runtime::State;
use lamc_workbench::simulation::{Direction, Event, Watched};
use pyo3::prelude::*;

use crate::error;
use crate::states::array;

/// The first exception that a function raised.
pub type Raised = Arc<Mutex<Option<PyErr>>>;

/// The function of an event.
#[derive(FromPyObject)]
enum Function {
    Formula(String),
    /// Of (t, q, u).
    Callable(Py<PyAny>),
}

/// An event as Python describes it.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Asked {
    function: Function,
    /// Its sign says which changes count; 0: all.
    direction: f64,
    /// The motion ends at the change of this number; 0: at none.
    terminal: usize,
}

impl Asked {
    /// The event. What its function raises is kept in `raised` and interrupts the simulation.
    ///
    /// # Errors
    /// A formula that cannot be read.
    pub fn event(
        self,
        interface: &Interface,
        parameters: &[f64],
        raised: &Raised,
    ) -> PyResult<Event> {
        let function = match self.function {
            Function::Formula(text) => formula(&text, interface, parameters.to_vec())?,
            Function::Callable(callable) => called(callable, raised.clone()),
        };
        let direction = match self.direction {
            rising if rising > 0.0 => Direction::Rising,
            falling if falling < 0.0 => Direction::Falling,
            _ => Direction::Either,
        };
        Ok(Event { function, direction, ends_at: (self.terminal > 0).then_some(self.terminal) })
    }
}

fn called(callable: Py<PyAny>, raised: Raised) -> Watched {
    Box::new(move |state, _| {
        let value = Python::attach(|py| {
            let arguments = (state.t, array(py, &state.q), array(py, &state.u));
            callable.call1(py, arguments)?.extract::<f64>(py)
        });
        let keep = |exception| {
            raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(exception);
        };
        value.map_err(keep).ok()
    })
}

fn formula(text: &str, interface: &Interface, parameters: Vec<f64>) -> PyResult<Watched> {
    let vocabulary = Vocabulary {
        parameters: interface.parameters.iter().map(|parameter| &*parameter.name).collect(),
        inputs: interface.inputs.iter().map(|input| &**input).collect(),
        joints: interface.joints.iter().map(|joint| &*joint.name).collect(),
    };
    let read = vocabulary.read(text).map_err(error)?;
    Ok(Box::new(move |state, inputs| {
        Some(read.evaluate(&|leaf| value(leaf, state, &parameters, inputs)))
    }))
}

/// The value of a name in a formula, SI.
fn value(
    leaf: &Expression,
    state: &State<Vec<f64>, f64>,
    parameters: &[f64],
    inputs: &[f64],
) -> f64 {
    match leaf {
        Expression::Time => state.t,
        Expression::Position(joint) => state.q[joint.index()],
        Expression::Rate(joint) => state.u[joint.index()],
        Expression::Parameter(parameter) => parameters[parameter.index()],
        Expression::Input(input) => inputs[input.index()],
        other => other.as_number().unwrap_or(f64::NAN),
    }
}
