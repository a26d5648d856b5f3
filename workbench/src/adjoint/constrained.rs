//! The acceleration and the projection onto the closure, with a record of how they were computed, and their adjoints.
//!
//! The projection is that of [`project`](lamc_runtime::project()): Newton's method on q, then one change of u,
//!
//! ```text
//! q <- q - p(q, u)   until the loops are closed,   u <- u - s(q, u)
//! ```
//!
//! Both are computed by elimination in straight-line code; where this does not hold, because the state is near to a singular one or
//! joints are driven, as [`General`] does.

use lamc::arithmetic::largest;
use lamc::program::FunctionKind;
use lamc_runtime::constants::{ACCEPTABLE, CLOSED, PROJECTION_STEPS};
use lamc_runtime::plumbing::ProjectionMut;
use lamc_runtime::{Mechanism as _, State};

use super::differentiated::{Adjoints, At, Differentiated, Undifferentiable};
use super::general::General;
use super::orientation;
use super::tape::Tape;

/// How something was computed, as a number on the tape.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    /// By elimination.
    Direct,
    /// Generally, at the state itself.
    General,
    /// Generally, at the state that a projection leads to.
    Beside,
}

impl Way {
    const ALL: [Self; 3] = [Self::Direct, Self::General, Self::Beside];

    fn record(self, tape: &mut Tape) {
        tape.push(&[f64::from(self as u8)]);
    }

    fn take(tape: &mut Tape) -> Self {
        Self::ALL[tape.pop(1)[0] as usize]
    }
}

/// Computes accelerations and projections, and goes back.
pub struct Constrained {
    joints: usize,
    /// Whether elimination is not tried.
    is_driven: bool,
    general: General,
    residual: Vec<f64>,
    positions: Vec<f64>,
    speeds: Vec<f64>,
    /// Adjoints of residuals, positions and speeds.
    weights: Vec<f64>,
}

impl Constrained {
    /// With storage.
    pub fn new(differentiated: &Differentiated) -> Self {
        let interface = differentiated.system.interface();
        let (rows, nu) = (9 * interface.loops.len(), interface.speeds());
        Self {
            joints: interface.joints.len(),
            is_driven: !interface.driven().is_empty(),
            general: General::new(differentiated),
            residual: vec![0.0; rows],
            positions: vec![0.0; nu],
            speeds: vec![0.0; nu],
            weights: vec![0.0; rows + 2 * nu],
        }
    }

    /// du/dt. Records the state.
    ///
    /// # Errors
    /// [`Undifferentiable`].
    pub fn accelerate(
        &mut self,
        on: &Differentiated,
        at: At<'_>,
        tape: &mut Tape,
        out: &mut [f64],
    ) -> Result<(), Undifferentiable> {
        let At { t, q, u } = at;
        if !self.is_driven && on.accelerate(at, out)? {
            tape.push(q);
            tape.push(u);
            Way::Direct.record(tape);
            return Ok(());
        }
        let is_weak = self.general.accelerate(on, at, out)?;
        if !is_weak {
            tape.push(q);
            tape.push(u);
            Way::General.record(tape);
            return Ok(());
        }
        // As the integrators of the runtime do: where a constraint is weak, an open loop would make a large error.
        let mut beside = State { t, q: q.to_vec(), u: u.to_vec() };
        self.general.project(on, &mut beside, tape)?;
        self.general.accelerate(on, At { t, q: &beside.q, u: &beside.u }, out)?;
        tape.push(&beside.q);
        tape.push(&beside.u);
        Way::Beside.record(tape);
        Ok(())
    }

    /// Goes back over the last acceleration of the record: adds to the adjoints, with those of du/dt at the time `t`, s.
    pub fn pull_acceleration(
        &mut self,
        on: &Differentiated,
        t: f64,
        tape: &mut Tape,
        of_acceleration: &[f64],
        adjoints: &mut Adjoints,
    ) {
        let layout = on.layout;
        let way = Way::take(tape);
        let (q, u) = tape.pop(layout.state()).split_at(layout.coordinates);
        let at = At { t, q, u };
        match way {
            Way::Direct => {
                on.pull(FunctionKind::Acceleration, at, of_acceleration, adjoints);
            }
            Way::General => self.general.pull_acceleration(on, at, of_acceleration, adjoints),
            Way::Beside => {
                let mut beside = Adjoints::zeros(layout);
                self.general.pull_acceleration(on, at, of_acceleration, &mut beside);
                self.general.pull_projection(on, t, tape, &mut beside);
                adjoints.add(&beside);
            }
        }
    }

    /// Projects a state until loops are open by no more than `enough`, m. Records what it goes through.
    ///
    /// # Errors
    /// [`Undifferentiable`].
    pub fn project(
        &mut self,
        on: &Differentiated,
        state: &mut State<Vec<f64>, f64>,
        enough: f64,
        tape: &mut Tape,
    ) -> Result<(), Undifferentiable> {
        if self.residual.is_empty() && !self.is_driven {
            return Ok(());
        }
        let begin = tape.len();
        if !self.is_driven {
            if let Some(moves) = self.project_directly(on, state, enough, tape)? {
                tape.push(&[moves as f64]);
                Way::Direct.record(tape);
                return Ok(());
            }
            // u and then q were recorded first.
            let q = tape.from(begin + state.u.len());
            state.q.copy_from_slice(&q[..on.layout.coordinates]);
            tape.truncate(begin);
        }
        self.general.project(on, state, tape)?;
        Way::General.record(tape);
        Ok(())
    }

    /// The moves of q; `None` where elimination does not hold.
    fn project_directly(
        &mut self,
        on: &Differentiated,
        state: &mut State<Vec<f64>, f64>,
        enough: f64,
        tape: &mut Tape,
    ) -> Result<Option<usize>, Undifferentiable> {
        let Self { residual, positions, speeds, .. } = self;
        let system = &on.system;
        tape.push(&state.u);
        tape.push(&state.q);
        let size = system.size();
        let [closed, acceptable] = [CLOSED, ACCEPTABLE].map(|share| share.of::<f64>() * size);
        let mut before = f64::INFINITY;
        for moves in 0..PROJECTION_STEPS {
            let at = At { t: state.t, q: &state.q, u: &state.u };
            if !on.project(at, ProjectionMut { residual, positions, speeds })? {
                return Ok(None);
            }
            // Written so that NaN is not closed, and no progress.
            let within = |values: &[f64], most: f64| values.iter().all(|x| x.abs() <= most);
            let open = largest(&*residual);
            let gets_on = 2.0 * open < before;
            if within(residual, enough)
                || (within(residual, acceptable) && within(positions, enough / size))
                || (!gets_on && within(residual, closed))
            {
                state.u.iter_mut().zip(&*speeds).for_each(|(u, change)| *u -= change);
                return Ok(Some(moves));
            }
            if !gets_on {
                return Ok(None);
            }
            before = open;
            positions.iter_mut().for_each(|step| *step = -*step);
            system.advance(&mut state.q, positions);
            tape.push(positions);
            tape.push(&state.q);
        }
        Ok(None)
    }

    /// Goes back over the last projection of the record, at the time `t`, s: the adjoints of what it led to become those of
    /// the state before.
    pub fn pull_projection(
        &mut self,
        on: &Differentiated,
        t: f64,
        tape: &mut Tape,
        adjoints: &mut Adjoints,
    ) {
        if self.residual.is_empty() && !self.is_driven {
            return;
        }
        if Way::take(tape) != Way::Direct {
            return self.general.pull_projection(on, t, tape, adjoints);
        }
        let moves = tape.pop(1)[0] as usize;
        let Self { positions, weights, residual, joints, .. } = self;
        let layout = on.layout;
        let (nq, nu) = (layout.coordinates, layout.speeds);
        let numbers = tape.pop(nu + nq + moves * (nu + nq));
        let u = &numbers[..nu];
        let q = |index: usize| &numbers[nu + index * (nu + nq)..][..nq];
        let step = |index: usize| &numbers[(index + 1) * (nu + nq)..][..nu];
        let (of_positions, of_speeds) = (residual.len(), residual.len() + nu);
        weights.fill(0.0);
        let changes = weights[of_speeds..].iter_mut().zip(&adjoints.state[nq..]);
        changes.for_each(|(weight, adjoint)| *weight = -adjoint);
        let at = At { t, q: q(moves), u };
        on.pull(FunctionKind::Projection, at, weights, adjoints);
        weights.fill(0.0);
        for index in (0..moves).rev() {
            let of_q = &mut adjoints.state[..nq];
            orientation::advance(q(index), step(index), *joints, of_q, positions);
            let steps = weights[of_positions..of_speeds].iter_mut().zip(&*positions);
            steps.for_each(|(weight, adjoint)| *weight = -adjoint);
            let at = At { t, q: q(index), u };
            on.pull(FunctionKind::Projection, at, weights, adjoints);
        }
    }
}
