//! The projection onto the closure at the end of a step, and its adjoint.
//!
//! It is [`project`](lamc_runtime::project()) by elimination: Newton's method on q, then one change of u,
//!
//! ```text
//! q <- q - p(q, u)   until the loops are closed,   u <- u - s(q, u)
//! ```

use lamc::arithmetic::largest;
use lamc::program::FunctionKind;
use lamc_runtime::constants::{ACCEPTABLE, CLOSED, PROJECTION_STEPS};
use lamc_runtime::plumbing::ProjectionMut;
use lamc_runtime::{Mechanism as _, State};

use super::differentiated::{Adjoints, At, Differentiated, Undifferentiable};
use super::orientation;
use super::tape::Tape;

/// Projects, and goes back.
pub struct Closure<'d> {
    differentiated: &'d Differentiated,
    joints: usize,
    residual: Vec<f64>,
    positions: Vec<f64>,
    speeds: Vec<f64>,
    /// Adjoints of residuals, positions and speeds.
    weights: Vec<f64>,
}

impl<'d> Closure<'d> {
    /// With storage.
    pub fn new(differentiated: &'d Differentiated) -> Self {
        let interface = differentiated.system.interface();
        let (rows, nu) = (9 * interface.loops.len(), interface.speeds());
        Self {
            differentiated,
            joints: interface.joints.len(),
            residual: vec![0.0; rows],
            positions: vec![0.0; nu],
            speeds: vec![0.0; nu],
            weights: vec![0.0; rows + 2 * nu],
        }
    }

    /// Projects a state. Records u and q before, and each move of q with what it leads to.
    ///
    /// # Errors
    /// [`Undifferentiable`].
    pub fn project(
        &mut self,
        state: &mut State<Vec<f64>, f64>,
        tape: &mut Tape,
    ) -> Result<(), Undifferentiable> {
        let Self { differentiated, residual, positions, speeds, .. } = self;
        if residual.is_empty() {
            return Ok(());
        }
        let system = &differentiated.system;
        tape.push(&state.u);
        tape.push(&state.q);
        let size = system.size();
        let [enough, acceptable] = [CLOSED, ACCEPTABLE].map(|share| share.of::<f64>() * size);
        let mut before = f64::INFINITY;
        for _ in 0..PROJECTION_STEPS {
            let at = At { t: state.t, q: &state.q, u: &state.u };
            differentiated.project(at, ProjectionMut { residual, positions, speeds })?;
            // Written so that NaN is not closed, and no progress.
            let within = |values: &[f64], most: f64| values.iter().all(|x| x.abs() <= most);
            let open = largest(&*residual);
            let is_last = !(2.0 * open < before);
            if within(residual, enough)
                || (within(residual, acceptable) && within(positions, enough / size))
            {
                state.u.iter_mut().zip(&*speeds).for_each(|(u, change)| *u -= change);
                return Ok(());
            }
            if is_last {
                break;
            }
            before = open;
            positions.iter_mut().for_each(|step| *step = -*step);
            system.advance(&mut state.q, positions);
            tape.push(positions);
            tape.push(&state.q);
            tape.add_move();
        }
        Err(Undifferentiable::Singular { t: state.t })
    }

    /// Goes back over the last projection, at the time `t`, s.
    pub fn pull(&mut self, t: f64, tape: &mut Tape, adjoints: &mut Adjoints) {
        if self.residual.is_empty() {
            return;
        }
        let Self { differentiated, positions, weights, residual, joints, .. } = self;
        let layout = differentiated.layout;
        let (nq, nu) = (layout.coordinates, layout.speeds);
        let moves = tape.moves();
        let numbers = tape.pop(nu + nq + moves * (nu + nq));
        let u = &numbers[..nu];
        let q = |index: usize| &numbers[nu + index * (nu + nq)..][..nq];
        let step = |index: usize| &numbers[(index + 1) * (nu + nq)..][..nu];
        let (of_positions, of_speeds) = (residual.len(), residual.len() + nu);
        weights.fill(0.0);
        let changes = weights[of_speeds..].iter_mut().zip(&adjoints.state[nq..]);
        changes.for_each(|(weight, adjoint)| *weight = -adjoint);
        let at = At { t, q: q(moves), u };
        differentiated.pull(FunctionKind::Projection, at, weights, adjoints);
        weights.fill(0.0);
        for index in (0..moves).rev() {
            let of_q = &mut adjoints.state[..nq];
            orientation::advance(q(index), step(index), *joints, of_q, positions);
            let steps = weights[of_positions..of_speeds].iter_mut().zip(&*positions);
            steps.for_each(|(weight, adjoint)| *weight = -adjoint);
            let at = At { t, q: q(index), u };
            differentiated.pull(FunctionKind::Projection, at, weights, adjoints);
        }
    }
}
