//! What follows from states: arrays in, arrays out, a row for each state.

use lamc_runtime::plumbing::{Balance, EquationsMut};
use lamc_runtime::{
    Change, Controlled as _, Error as RuntimeError, JacobianMut, Mechanism as _, Rk4,
    acceleration_and_forces, derivatives_along, jacobian, project,
};
use lamc_workbench::execution::Jit;
use lamc_workbench::simulation::describe;
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, ToPyArray as _};
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;

use crate::error;
use crate::program::Program;

/// Time, q, u and inputs of each state, as Python gives them: contiguous rows.
pub struct States<'py> {
    t: PyReadonlyArray1<'py, f64>,
    q: PyReadonlyArray2<'py, f64>,
    u: PyReadonlyArray2<'py, f64>,
    inputs: PyReadonlyArray2<'py, f64>,
}

impl<'py> FromPyObject<'_, 'py> for States<'py> {
    type Error = PyErr;

    /// From the tuple (t, q, u, inputs).
    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let (t, q, u, inputs) = object.extract()?;
        Ok(Self { t, q, u, inputs })
    }
}

/// A state and the system at its inputs.
struct State<'a> {
    row: usize,
    t: f64,
    q: &'a [f64],
    u: &'a [f64],
}

/// Rows, or steps, between two looks at whether Python has been interrupted.
const PATIENCE: usize = 1 << 14;

/// Why the evaluation of a state ends.
enum Halt {
    Failed(RuntimeError),
    Interrupted(PyErr),
}

impl From<RuntimeError> for Halt {
    fn from(failure: RuntimeError) -> Self {
        Self::Failed(failure)
    }
}

/// Asks Python whether it has been interrupted.
fn check_interrupt() -> PyResult<()> {
    Python::attach(|py| py.check_signals())
}

/// Flat arrays.
type Outputs<'py> = Vec<Bound<'py, PyArray1<f64>>>;

/// Evaluates each state without the GIL. `widths` are the numbers per state of each output.
fn each<'py>(
    py: Python<'py>,
    program: &Program,
    states: &States<'py>,
    widths: &[usize],
    mut evaluate: impl FnMut(&Jit, &State<'_>, &mut [f64], &mut [Vec<f64>]) -> Result<(), Halt> + Send,
) -> PyResult<Outputs<'py>> {
    let mut system = program.system();
    let (d, inputs) = (system.dimensions(), system.inputs().len());
    let (t, q, u) = (states.t.as_slice()?, states.q.as_slice()?, states.u.as_slice()?);
    let held = states.inputs.as_slice()?;
    let count = t.len();
    for (name, given, expected) in [
        ("q", q.len(), count * d.coordinates),
        ("u", u.len(), count * d.speeds),
        ("inputs", held.len(), count * inputs),
    ] {
        if given != expected {
            return Err(error(format_args!("`{name}` has {given} numbers, not {expected}")));
        }
    }
    let mut outputs = Vec::new();
    for width in widths {
        outputs.push(room_for(count.checked_mul(*width))?);
    }
    let outputs = py.detach(|| {
        let mut room = system.workspace();
        for row in 0..count {
            if row % PATIENCE == PATIENCE - 1 {
                check_interrupt()?;
            }
            if inputs > 0 {
                system.set_inputs(&held[row * inputs..][..inputs]);
            }
            let q = &q[row * d.coordinates..][..d.coordinates];
            let u = &u[row * d.speeds..][..d.speeds];
            let state = State { row, t: t[row], q, u };
            evaluate(&system, &state, &mut room, &mut outputs).map_err(|halt| match halt {
                Halt::Failed(failure) => {
                    error(format_args!("state {row}: {}", describe(&failure, program.interface())))
                }
                Halt::Interrupted(raised) => raised,
            })?;
        }
        PyResult::Ok(outputs)
    })?;
    Ok(outputs.into_iter().map(|numbers| PyArray1::from_vec(py, numbers)).collect())
}

/// So many numbers, or Python's error that there is no memory for them.
fn room_for(count: Option<usize>) -> PyResult<Vec<f64>> {
    let none = || PyMemoryError::new_err("the results do not fit in memory");
    let (count, mut room) = (count.ok_or_else(none)?, Vec::new());
    room.try_reserve_exact(count).map_err(|_| none())?;
    room.resize(count, f64::NAN);
    Ok(room)
}

/// du/dt and the multipliers. Next to a singular state, they are those of the nearest closed state.
fn solve(
    system: &Jit,
    state: &State<'_>,
    room: &mut [f64],
    rates: &mut [f64],
    forces: &mut [f64],
) -> Result<(), RuntimeError> {
    let State { t, q, u, .. } = *state;
    let found = acceleration_and_forces(system, t, q, u, room, rates, forces)?;
    if found.is_weak {
        let (mut q, mut u) = (q.to_vec(), u.to_vec());
        if project(system, t, &mut q, &mut u, room).is_ok() {
            acceleration_and_forces(system, t, &q, &u, room, rates, forces)?;
        }
    }
    Ok(())
}

#[pymethods]
impl Program {
    /// du/dt, NU.
    fn acceleration<'py>(&self, py: Python<'py>, states: States<'py>) -> PyResult<Outputs<'py>> {
        let d = self.system().dimensions();
        let n = d.speeds;
        each(py, self, &states, &[n], |system, state, room, out| {
            let rates = &mut out[0][state.row * n..][..n];
            let found = lamc_runtime::acceleration(system, state.t, state.q, state.u, room, rates)?;
            match found.is_weak {
                true => Ok(solve(system, state, room, rates, &mut vec![0.0; d.rows + d.drives])?),
                false => Ok(()),
            }
        })
    }

    /// du/dt, NU; the multipliers, C + D; the reactions of N joints, 6 N.
    fn reactions<'py>(&self, py: Python<'py>, states: States<'py>) -> PyResult<Outputs<'py>> {
        let d = self.system().dimensions();
        let (n, m, width) = (d.speeds, d.rows + d.drives, 6 * d.joints);
        each(py, self, &states, &[n, m, width], |system, state, room, out| {
            let [rates, forces, reactions] = out else { return Ok(()) };
            let rates = &mut rates[state.row * n..][..n];
            let forces = &mut forces[state.row * m..][..m];
            solve(system, state, room, rates, forces)?;
            let State { t, q, u, .. } = *state;
            let at = Balance { t, q, u, acceleration: rates, multipliers: &forces[..d.rows] };
            Ok(system.write_reactions(at, &mut reactions[state.row * width..][..width])?)
        })
    }

    /// Position and force of each contact point, 6 K.
    fn contacts<'py>(&self, py: Python<'py>, states: States<'py>) -> PyResult<Outputs<'py>> {
        let width = 6 * self.system().dimensions().contacts;
        each(py, self, &states, &[width], |system, state, _, out| {
            let out = &mut out[0][state.row * width..][..width];
            Ok(system.write_contacts(state.t, state.q, state.u, out)?)
        })
    }

    /// M, NU x NU; f, NU; J, C x NU; gamma, C.
    fn equations<'py>(&self, py: Python<'py>, states: States<'py>) -> PyResult<Outputs<'py>> {
        let d = self.system().dimensions();
        let (n, c) = (d.speeds, d.rows);
        each(py, self, &states, &[n * n, n, c * n, c], |system, state, _, out| {
            let [mass, forcing, jacobian, gamma] = out else { return Ok(()) };
            let out = EquationsMut {
                mass: &mut mass[state.row * n * n..][..n * n],
                forcing: &mut forcing[state.row * n..][..n],
                jacobian: &mut jacobian[state.row * c * n..][..c * n],
                gamma: &mut gamma[state.row * c..][..c],
            };
            Ok(system.write_equations(state.t, state.q, state.u, out)?)
        })
    }

    /// The closure residual, 9 L; its derivatives by q, 9 L x NU.
    fn closure<'py>(&self, py: Python<'py>, states: States<'py>) -> PyResult<Outputs<'py>> {
        let d = self.system().dimensions();
        let (n, rows) = (d.speeds, 9 * d.loops);
        each(py, self, &states, &[rows, rows * n], |system, state, _, out| {
            let [residual, jacobian] = out else { return Ok(()) };
            let residual = &mut residual[state.row * rows..][..rows];
            let jacobian = &mut jacobian[state.row * rows * n..][..rows * n];
            Ok(system.write_closure(state.q, residual, jacobian)?)
        })
    }

    /// du/dt, NU; its derivatives by q, NU x NU, by u, NU x NU, and by t, NU.
    fn jacobian<'py>(&self, py: Python<'py>, states: States<'py>) -> PyResult<Outputs<'py>> {
        let n = self.system().dimensions().speeds;
        each(py, self, &states, &[n, n * n, n * n, n], |system, state, room, out| {
            let [acceleration, dq, du, dt] = out else { return Ok(()) };
            let out = JacobianMut {
                acceleration: &mut acceleration[state.row * n..][..n],
                dq: &mut dq[state.row * n * n..][..n * n],
                du: &mut du[state.row * n * n..][..n * n],
                dt: &mut dt[state.row * n..][..n],
            };
            Ok(jacobian(system, state.t, state.q, state.u, room, out)?)
        })
    }

    /// du/dt, NU; its derivatives by each input, I x NU.
    fn by_inputs<'py>(&self, py: Python<'py>, states: States<'py>) -> PyResult<Outputs<'py>> {
        let system = self.system();
        let (n, inputs) = (system.dimensions().speeds, system.inputs().len());
        let (still, parameters) = (vec![0.0; n], vec![0.0; system.parameters().len()]);
        let units: Vec<Vec<f64>> = (0..inputs)
            .map(|k| (0..inputs).map(|j| f64::from(u8::from(j == k))).collect())
            .collect();
        let width = n * (1 + inputs);
        each(py, self, &states, &[width], |system, state, room, out| {
            let changes = units.iter().map(|inputs| Change {
                t: 0.0,
                q: &still,
                u: &still,
                parameters: &parameters,
                inputs,
            });
            let out = &mut out[0][state.row * width..][..width];
            Ok(derivatives_along(system, state.t, state.q, state.u, changes, room, out)?)
        })
    }

    /// q and u after some steps of this length, s, of the classical Runge-Kutta method, each with a projection.
    fn step<'py>(
        &self,
        py: Python<'py>,
        states: States<'py>,
        step: f64,
        steps: usize,
    ) -> PyResult<Outputs<'py>> {
        let d = self.system().dimensions();
        let (n, m) = (d.coordinates, d.speeds);
        let mut integrator = Rk4::new(&self.system());
        let mut since = 0;
        each(py, self, &states, &[n, m], |system, state, _, out| {
            let mut moved =
                lamc_runtime::State { t: state.t, q: state.q.to_vec(), u: state.u.to_vec() };
            for _ in 0..steps {
                since += 1;
                if since == PATIENCE {
                    since = 0;
                    check_interrupt().map_err(Halt::Interrupted)?;
                }
                integrator.step(system, &mut moved, step)?;
            }
            out[0][state.row * n..][..n].copy_from_slice(&moved.q);
            out[1][state.row * m..][..m].copy_from_slice(&moved.u);
            Ok(())
        })
    }

    /// Kinetic and potential energy, J.
    fn energy<'py>(&self, py: Python<'py>, states: States<'py>) -> PyResult<Outputs<'py>> {
        each(py, self, &states, &[2], |system, state, _, out| {
            let (q, u) = (state.q.to_vec(), state.u.to_vec());
            let energy = system.energy(state.t, &q, &u)?;
            out[0][state.row * 2..][..2].copy_from_slice(&[energy.kinetic, energy.potential]);
            Ok(())
        })
    }

    /// Centre of mass, linear and angular momentum of a mechanism with a free body, 9.
    fn momentum<'py>(&self, py: Python<'py>, states: States<'py>) -> PyResult<Outputs<'py>> {
        each(py, self, &states, &[9], |system, state, _, out| {
            let (q, u) = (state.q.to_vec(), state.u.to_vec());
            let found = system.momentum(&q, &u)?;
            let numbers = [found.centre, found.linear, found.angular];
            out[0][state.row * 9..][..9].copy_from_slice(numbers.as_flattened());
            Ok(())
        })
    }

    /// What controllers command, and what they remember at their next sample; `memory` is what they remember now, a row for
    /// each state.
    fn control<'py>(
        &self,
        py: Python<'py>,
        states: States<'py>,
        memory: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Outputs<'py>> {
        let system = self.system();
        let (kept, count) = (system.memory().len(), system.commands().len());
        let memory = memory.as_slice()?;
        let expected = kept * states.t.len()?;
        if memory.len() != expected {
            let given = memory.len();
            return Err(error(format_args!("`memory` has {given} numbers, not {expected}")));
        }
        each(py, self, &states, &[count, kept], |system, state, _, out| {
            let [commands, next] = out else { return Ok(()) };
            let State { row, t, q, u } = *state;
            let next = &mut next[row * kept..][..kept];
            let commands = &mut commands[row * count..][..count];
            Ok(system.write_control(t, q, u, &memory[row * kept..][..kept], next, commands)?)
        })
    }

    /// The pose of each body, 12: R row by row, then p; the points, 3.
    fn places<'py>(&self, py: Python<'py>, states: States<'py>) -> PyResult<Outputs<'py>> {
        let d = self.system().dimensions();
        let widths = [12 * d.bodies, 3 * d.points];
        each(py, self, &states, &widths, |system, state, _, out| {
            let q = state.q.to_vec();
            let [poses, points] = out else { return Ok(()) };
            poses[state.row * widths[0]..][..widths[0]]
                .copy_from_slice(system.poses(&q)?.as_flattened());
            points[state.row * widths[1]..][..widths[1]]
                .copy_from_slice(system.points(&q)?.as_flattened());
            Ok(())
        })
    }
}

/// A list of numbers as an array.
pub fn array<'py>(py: Python<'py>, numbers: &[f64]) -> Bound<'py, PyArray1<f64>> {
    numbers.to_pyarray(py)
}
