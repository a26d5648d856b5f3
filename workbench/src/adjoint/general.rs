//! The acceleration and the projection where elimination does not serve: by the [saddle](Saddle) system.
//!
//! M, f, J and gamma come from the equations of motion, J of the projection from all nine rows of each loop, and each driven joint
//! adds a row. Their adjoints follow from those of the solution (see [`Saddle`]), and go back through the functions that
//! wrote them.

use lamc::arithmetic::{larger, largest};
use lamc::program::FunctionKind;
use lamc_runtime::constants::{CLOSED, CLOSED_EPSILONS, PROJECTION_STEPS};
use lamc_runtime::plumbing::EquationsMut;
use lamc_runtime::{Mechanism as _, State, acceleration_in_motion};

use super::differentiated::{Adjoints, At, Differentiated, Undifferentiable};
use super::orientation;
use super::saddle::Saddle;
use super::tape::Tape;

/// By how much the solution of the saddle system may differ from the acceleration of the runtime, which passes singular states: more
/// is not the same function.
const SAME: f64 = 1e-6;

/// Computes accelerations and projections, and goes back.
pub struct General {
    joints: usize,
    /// The driven joints.
    driven: Vec<usize>,
    /// Rows of the closure in the equations of motion, and independent ones among them.
    rows: usize,
    rank: usize,
    loops: usize,
    workspace: Vec<f64>,
}

/// The equations of motion at a state.
struct Equations {
    mass: Vec<f64>,
    forcing: Vec<f64>,
    /// With a row for each driven joint, as `gamma`.
    jacobian: Vec<f64>,
    gamma: Vec<f64>,
}

impl General {
    /// With storage.
    pub fn new(differentiated: &Differentiated) -> Self {
        let interface = differentiated.system.interface();
        Self {
            joints: interface.joints.len(),
            driven: interface.driven().iter().map(|joint| joint.index()).collect(),
            rows: interface.rows,
            rank: interface.rank,
            loops: interface.loops.len(),
            workspace: differentiated.system.workspace(),
        }
    }

    /// du/dt as integrators of the runtime have it; and whether a row of the closure has nearly faded.
    ///
    /// # Errors
    /// [`Undifferentiable`].
    pub fn accelerate(
        &mut self,
        on: &Differentiated,
        at: At<'_>,
        out: &mut [f64],
    ) -> Result<bool, Undifferentiable> {
        let At { t, q, u } = at;
        let system = &on.system;
        let found = acceleration_in_motion(system, t, q, u, &mut self.workspace, out)
            .map_err(|error| Undifferentiable::Motion { t, error })?;
        let (own, _, _) = self.solved(on, at)?;
        let scale = own.iter().map(|x| x.abs()).fold(f64::MIN_POSITIVE, larger);
        if !own.iter().zip(&*out).all(|(own, found)| (own - found).abs() <= SAME * scale) {
            return Err(Undifferentiable::Singular { t });
        }
        Ok(found.is_weak && self.loops > 0)
    }

    /// du/dt and lambda, with the system that they solve.
    fn solved(
        &self,
        on: &Differentiated,
        at: At<'_>,
    ) -> Result<(Vec<f64>, Vec<f64>, Saddle), Undifferentiable> {
        let equations = self.equations(on, at)?;
        let nu = at.u.len();
        let rank = self.rank + self.driven.len();
        let saddle = Saddle::new(&equations.mass, &equations.jacobian, nu, rank);
        let saddle = saddle.ok_or(Undifferentiable::Singular { t: at.t })?;
        let wanted: Vec<f64> = equations.gamma.iter().map(|gamma| -gamma).collect();
        let (acceleration, lambda) = saddle.solve(&equations.forcing, &wanted);
        Ok((acceleration, lambda, saddle))
    }

    fn equations(&self, on: &Differentiated, at: At<'_>) -> Result<Equations, Undifferentiable> {
        let At { t, q, u } = at;
        let (nu, rows) = (u.len(), self.rows);
        let system = &on.system;
        let mut equations = Equations {
            mass: vec![0.0; nu * nu],
            forcing: vec![0.0; nu],
            jacobian: vec![0.0; rows * nu],
            gamma: vec![0.0; rows],
        };
        let Equations { mass, forcing, jacobian, gamma } = &mut equations;
        system
            .write_equations(t, q, u, EquationsMut { mass, forcing, jacobian, gamma })
            .map_err(|error| Undifferentiable::Motion { t, error })?;
        let size = system.size();
        system.drives(t, |drive| {
            let row = (0..nu).map(|joint| if joint == drive.joint { size } else { 0.0 });
            jacobian.extend(row);
            gamma.push(-size * drive.acceleration);
        });
        Ok(equations)
    }

    /// Adds to the adjoints, with those of du/dt.
    pub fn pull_acceleration(
        &self,
        on: &Differentiated,
        at: At<'_>,
        of_acceleration: &[f64],
        adjoints: &mut Adjoints,
    ) {
        // It was solved on the way forth.
        let Ok((acceleration, lambda, saddle)) = self.solved(on, at) else {
            return adjoints.spoil();
        };
        let none = vec![0.0; lambda.len()];
        let (m, n) = saddle.solve(of_acceleration, &none);
        let mut weights = Vec::new();
        weights.extend(m.iter().flat_map(|m| acceleration.iter().map(move |a| -m * a)));
        weights.extend(&m);
        let rows = || lambda.iter().zip(&n).take(self.rows);
        weights.extend(rows().flat_map(|(lambda, n)| {
            m.iter().zip(&acceleration).map(move |(m, a)| lambda * m + n * a)
        }));
        weights.extend(rows().map(|(_, n)| n));
        on.pull(FunctionKind::Equations, at, &weights, adjoints);
        let size = on.system.size();
        let of_drive = |n: &f64| [0.0, 0.0, -size * n, 0.0];
        let weights: Vec<f64> = n[self.rows..].iter().flat_map(of_drive).collect();
        on.pull(FunctionKind::Drives, at, &weights, adjoints);
    }

    /// Projects a state. Records u and q before, each move of q with what it leads to, and how many there are.
    ///
    /// # Errors
    /// [`Undifferentiable`].
    pub fn project(
        &mut self,
        on: &Differentiated,
        state: &mut State<Vec<f64>, f64>,
        tape: &mut Tape,
    ) -> Result<(), Undifferentiable> {
        tape.push(&state.u);
        tape.push(&state.q);
        let t = state.t;
        let size = on.system.size();
        let rounding = CLOSED_EPSILONS * f64::EPSILON * size;
        let mass = self.equations(on, At { t, q: &state.q, u: &state.u })?.mass;
        let mut before = f64::INFINITY;
        let mut moves = 0;
        let closure = loop {
            let closure = self.closure(on, t, &mass, &state.q)?;
            let open = largest(&closure.residual);
            // Written so that NaN is no progress.
            let gets_on = 2.0 * open < before && moves < PROJECTION_STEPS;
            if open <= rounding || (!gets_on && open <= CLOSED.of::<f64>() * size) {
                break closure;
            }
            if !gets_on {
                return Err(Undifferentiable::Singular { t });
            }
            before = open;
            let step = closure.step(&closure.residual).0;
            on.system.advance(&mut state.q, &step);
            tape.push(&step);
            tape.push(&state.q);
            moves += 1;
        };
        let change = closure.step(&closure.rates(&state.u)).0;
        state.u.iter_mut().zip(change).for_each(|(u, change)| *u += change);
        tape.push(&[f64::from(u32::try_from(moves).unwrap_or(u32::MAX))]);
        Ok(())
    }

    /// Goes back over the last projection of the record, at the time `t`, s.
    pub fn pull_projection(
        &self,
        on: &Differentiated,
        t: f64,
        tape: &mut Tape,
        adjoints: &mut Adjoints,
    ) {
        let layout = on.layout;
        let (nq, nu) = (layout.coordinates, layout.speeds);
        let moves = tape.pop(1)[0] as usize;
        let numbers = tape.pop(nu + nq + moves * (nu + nq));
        let u = &numbers[..nu];
        let q = |index: usize| &numbers[nu + index * (nu + nq)..][..nq];
        let step = |index: usize| &numbers[(index + 1) * (nu + nq)..][..nu];
        let begin = At { t, q: q(0), u };
        let Ok(Equations { mass, .. }) = self.equations(on, begin) else { return adjoints.spoil() };
        // The mass matrix belongs to q before the moves, which has no adjoint yet.
        let mut of_mass = vec![0.0; nu * nu];
        let Ok(closure) = self.closure(on, t, &mass, q(moves)) else { return adjoints.spoil() };
        let of_change = adjoints.state[nq..].to_vec();
        let rates = closure.rates(u);
        closure.pull(&rates, &of_change, &mut of_mass, |closure, of_rows, of_residual| {
            // r = J u - size ds/dt
            for (row, share) in of_rows.chunks_exact_mut(nu).zip(of_residual) {
                row.iter_mut().zip(u).for_each(|(weight, u)| *weight += share * u);
            }
            for (row, share) in closure.jacobian.chunks_exact(nu).zip(of_residual) {
                let speeds = adjoints.state[nq..].iter_mut().zip(row);
                speeds.for_each(|(sum, entry)| *sum += share * entry);
            }
            let none = vec![0.0; of_residual.len()];
            self.pull_closure(on, At { t, q: q(moves), u }, of_rows, &none, of_residual, adjoints);
        });
        for index in (0..moves).rev() {
            let Ok(closure) = self.closure(on, t, &mass, q(index)) else { return adjoints.spoil() };
            let mut of_step = vec![0.0; nu];
            let of_q = &mut adjoints.state[..nq];
            orientation::advance(q(index), step(index), self.joints, of_q, &mut of_step);
            let residual = &closure.residual;
            closure.pull(residual, &of_step, &mut of_mass, |_, of_rows, of_residual| {
                let none = vec![0.0; of_residual.len()];
                self.pull_closure(
                    on,
                    At { t, q: q(index), u },
                    of_rows,
                    of_residual,
                    &none,
                    adjoints,
                );
            });
        }
        on.pull(FunctionKind::Equations, begin, &of_mass, adjoints);
    }

    /// Adds to the adjoints, with those of the rows of the closure, of the residuals, and of the rates.
    fn pull_closure(
        &self,
        on: &Differentiated,
        at: At<'_>,
        of_rows: &[f64],
        of_residual: &[f64],
        of_rates: &[f64],
        adjoints: &mut Adjoints,
    ) {
        let (rows, nu) = (9 * self.loops, at.u.len());
        let weights = [&of_residual[..rows], &of_rows[..rows * nu]].concat();
        on.pull(FunctionKind::Closure, at, &weights, adjoints);
        // r = size (q - s(t))
        let size = on.system.size();
        let driven = self.driven.iter().zip(&of_residual[rows..]);
        driven.clone().for_each(|(joint, share)| adjoints.state[*joint] += size * share);
        let of_drives = of_residual[rows..].iter().zip(&of_rates[rows..]);
        let weights: Vec<f64> =
            of_drives.flat_map(|(angle, rate)| [-size * angle, -size * rate, 0.0, 0.0]).collect();
        on.pull(FunctionKind::Drives, at, &weights, adjoints);
    }

    /// All rows of the closure at q, with a mass matrix as the metric.
    fn closure(
        &self,
        on: &Differentiated,
        t: f64,
        mass: &[f64],
        q: &[f64],
    ) -> Result<Closure, Undifferentiable> {
        let system = &on.system;
        let (rows, nu) = (9 * self.loops, on.layout.speeds);
        let (mut residual, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * nu]);
        system
            .write_closure(q, &mut residual, &mut jacobian)
            .map_err(|error| Undifferentiable::Motion { t, error })?;
        let size = system.size();
        let mut prescribed = vec![0.0; rows];
        system.drives(t, |drive| {
            residual.push(size * (q[drive.joint] - drive.position));
            jacobian.extend((0..nu).map(|joint| if joint == drive.joint { size } else { 0.0 }));
            prescribed.push(size * drive.speed);
        });
        let rank = self.rank + self.driven.len();
        let saddle = Saddle::new(mass, &jacobian, nu, rank);
        let saddle = saddle.ok_or(Undifferentiable::Singular { t })?;
        Ok(Closure { residual, jacobian, prescribed, saddle })
    }
}

/// The closure, linearised.
struct Closure {
    residual: Vec<f64>,
    jacobian: Vec<f64>,
    /// What J u should be.
    prescribed: Vec<f64>,
    saddle: Saddle,
}

impl Closure {
    /// The step x of least length with J x = -r, and the y that belongs to it.
    fn step(&self, residual: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let nu = self.jacobian.len() / residual.len().max(1);
        let wanted: Vec<f64> = residual.iter().map(|r| -r).collect();
        self.saddle.solve(&vec![0.0; nu], &wanted)
    }

    /// J u less what it should be.
    fn rates(&self, u: &[f64]) -> Vec<f64> {
        let rows = self.jacobian.chunks_exact(u.len().max(1)).zip(&self.prescribed);
        rows.map(|(row, wanted)| row.iter().zip(u).map(|(j, u)| j * u).sum::<f64>() - wanted)
            .collect()
    }

    /// From the adjoint of the step for a residual: adds that of M, and hands those of J and of the residual to `visit`.
    fn pull(
        &self,
        residual: &[f64],
        of_step: &[f64],
        of_mass: &mut [f64],
        visit: impl FnOnce(&Self, &mut [f64], &[f64]),
    ) {
        let (x, y) = self.step(residual);
        let (m, n) = self.saddle.solve(of_step, &vec![0.0; residual.len()]);
        let products = m.iter().flat_map(|m| x.iter().map(move |x| m * x));
        of_mass.iter_mut().zip(products).for_each(|(sum, product)| *sum -= product);
        let rows = y.iter().zip(&n);
        let mut of_rows: Vec<f64> =
            rows.flat_map(|(y, n)| m.iter().zip(&x).map(move |(m, x)| y * m + n * x)).collect();
        visit(self, &mut of_rows, &n);
    }
}
