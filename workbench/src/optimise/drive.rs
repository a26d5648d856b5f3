//! The mechanism while one joint is turned: its states, and how they follow the design.
//!
//! With the residuals r(q, x) of the loops, q_d the driven joint and q_s the others,
//!
//! ```text
//! Newton   J_s dq_s = -r            turning   J_s dq_s/dq_d = -J_d            design   J_s dq_s/dx = -r_x
//! ```
//!
//! in the sense of least squares: the nine equations of a loop depend on each other, and agree where it can close.

use std::rc::Rc;

use lamc::arithmetic::largest;
use lamc_runtime::{Mechanism as _, assemble};
use nalgebra::{DMatrix, Dyn, QR};

use super::design::Design;
use crate::execution::Jit;

/// The joint is turned by at most this before the loops are closed again, rad.
const LONGEST: f64 = 0.1;
/// Steps are halved so often before a mechanism counts as stuck: the last is 0.1 mrad.
const HALVINGS: usize = 10;
/// Newton's steps for one angle; it converges quadratically from a tangent.
const NEWTON: usize = 8;
/// A loop is closed within this share of the size. Where the motion branches, as where all hinge lines are in one plane,
/// Newton's method does not come so far: there the mechanism counts as stuck, because it may go on in several ways.
const CLOSED: f64 = 1e-13;
/// A joint that turns by more than this in the corrections of one angle has jumped to another branch, rad.
const JUMP: f64 = 0.3;
/// Extremes along the motion are found within this, rad: its square is what they are wrong by.
const NEAREST: f64 = 1e-7;
/// Steps of that search at most.
const SEARCH: usize = 60;
/// The smallest diagonal entry of R, as a share of the largest, with which directions count as independent.
const SINGULAR: f64 = 1e-7;

/// A mechanism of mobility 1 whose motion is that of one joint.
pub struct Driven<'s> {
    system: &'s Jit,
    joint: usize,
    /// The joints that follow.
    others: Vec<usize>,
}

/// A closed state of the mechanism.
#[derive(Clone)]
pub struct Closed {
    /// The angles of the joints, rad.
    pub q: Vec<f64>,
    /// The equations of the joints that follow; `None` where these are not determined.
    equations: Option<Rc<Equations>>,
    /// The angle (rad) of the driven joint and the equations in the state from which this one was reached.
    before: Option<(f64, Rc<Equations>)>,
}

/// The equations of the joints that follow, J_s dq_s = rhs, factored.
struct Equations {
    /// J_s, 9 L x (N - 1).
    others: DMatrix<f64>,
    /// J_s = Q R; `None` if no joints follow.
    factors: Option<QR<f64, Dyn, Dyn>>,
    /// R, (N - 1) x (N - 1).
    r: DMatrix<f64>,
    /// 9 L x 1.
    residual: DMatrix<f64>,
    /// dq_s/dq_d, (N - 1) x 1.
    tangent: DMatrix<f64>,
}

impl Equations {
    fn solve(&self, mut rhs: DMatrix<f64>) -> Option<DMatrix<f64>> {
        let Some(factors) = &self.factors else { return Some(DMatrix::zeros(0, rhs.ncols())) };
        factors.q_tr_mul(&mut rhs);
        self.r.solve_upper_triangular(&rhs.rows(0, self.r.nrows()))
    }

    /// Whether an odd number of singular states lies between this state and a near one: det(J_s^T J_s') has changed its
    /// sign. There the motion may branch, and a step would go on by chance.
    fn is_apart(&self, other: &Self) -> bool {
        let product = self.others.tr_mul(&other.others).lu();
        let signs = product.u().diagonal().iter().map(|it| it.signum()).product::<f64>();
        signs * product.p().determinant::<f64>() < 0.0
    }
}

impl<'s> Driven<'s> {
    /// The mechanism driven at this joint.
    pub fn new(system: &'s Jit, joint: usize) -> Self {
        let others = (0..system.dimensions().joints).filter(|other| *other != joint).collect();
        Self { system, joint, others }
    }

    /// The closed state near the model's initial one.
    ///
    /// # Errors
    /// There is none; the text says so.
    pub fn start(&self) -> Result<Closed, String> {
        let system = self.system;
        let mut q = system.initial().q;
        let pinned: Vec<bool> = (0..q.len()).map(|joint| system.is_pinned(joint)).collect();
        let assembled = assemble(system, 0.0, &mut q, &pinned, &mut system.workspace());
        match assembled {
            Ok(_) => Ok(Closed { equations: self.equations(&q).map(Rc::new), before: None, q }),
            Err(_) => Err("the loops do not close near the initial state".to_owned()),
        }
    }

    /// The states at these angles (rad) of the joint, one after the other, from a closed state.
    ///
    /// # Errors
    /// The mechanism cannot go on; the text says where.
    pub fn states(&self, start: &Closed, angles: &[f64]) -> Result<Vec<Closed>, String> {
        let mut state = start.clone();
        let each = angles.iter().map(|angle| {
            self.turn(&mut state, *angle)?;
            Ok(state.clone())
        });
        each.collect()
    }

    /// Turns the joint to an angle, rad.
    ///
    /// # Errors
    /// As [`states`](Self::states).
    fn turn(&self, state: &mut Closed, angle: f64) -> Result<(), String> {
        let shortest = LONGEST * 0.5_f64.powi(HALVINGS as i32);
        let mut longest = LONGEST;
        while state.q[self.joint] != angle {
            let at = state.q[self.joint];
            let left = angle - at;
            let to = if left.abs() <= longest { angle } else { at + longest.copysign(left) };
            match self.step(state, to) {
                Some(next) => {
                    *state = next;
                    longest = (2.0 * longest).min(LONGEST);
                }
                None if longest > shortest => longest *= 0.5,
                None => {
                    let at = at.to_degrees();
                    return Err(format!(
                        "the mechanism does not move beyond {at:.1} deg of the driven joint"
                    ));
                }
            }
        }
        Ok(())
    }

    /// The closed state at an angle next to that of a closed state.
    fn step(&self, from: &Closed, angle: f64) -> Option<Closed> {
        let here = from.equations.as_ref()?;
        let predicted = self.predicted(from, here, angle);
        let mut q = predicted.clone();
        let allowed = CLOSED * self.system.size();
        for _ in 0..NEWTON {
            let at = self.equations(&q)?;
            if largest(&at.residual) <= allowed {
                let moved = q.iter().zip(&predicted).map(|(q, then)| q - then);
                let is_next = largest(moved) < JUMP && !here.is_apart(&at);
                let before = Some((from.q[self.joint], Rc::clone(here)));
                return is_next.then(|| Closed { q, equations: Some(Rc::new(at)), before });
            }
            let step = at.solve(at.residual.clone())?;
            self.others.iter().zip(step.iter()).for_each(|(joint, by)| q[*joint] -= by);
        }
        None
    }

    /// The state at an angle as a parabola along the motion has it, or the tangent of the first step.
    fn predicted(&self, from: &Closed, here: &Equations, angle: f64) -> Vec<f64> {
        let by = angle - from.q[self.joint];
        let mut slope = here.tangent.clone();
        if let Some((earlier, before)) = &from.before {
            let bend = 0.5 * by / (from.q[self.joint] - earlier);
            slope += bend * (&here.tangent - &before.tangent);
        }
        let mut q = from.q.clone();
        self.others.iter().zip(slope.iter()).for_each(|(joint, slope)| q[*joint] += by * slope);
        q[self.joint] = angle;
        q
    }

    /// The states from the first to the last angle (rad), at most so far apart.
    ///
    /// # Errors
    /// As [`states`](Self::states).
    pub fn sweep(&self, [from, to]: [f64; 2], step: f64) -> Result<Vec<Closed>, String> {
        let steps = ((to - from).abs() / step).ceil().max(2.0);
        let angle = |number: usize| from + (to - from) * number as f64 / steps;
        let angles: Vec<f64> = (0..=steps as usize).map(angle).collect();
        self.states(&self.start()?, &angles)
    }

    /// A state between two others at which a function changes its sign; the first one if it has the same sign at both. By the
    /// method of false position in the variant of Illinois (M. Dowell and P. Jarratt, BIT 11, 1971).
    ///
    /// # Errors
    /// As [`states`](Self::states).
    pub fn root(
        &self,
        ends: [&Closed; 2],
        function: impl Fn(&Closed) -> Result<f64, String>,
    ) -> Result<Closed, String> {
        let [mut a, mut b] = ends.map(|end| end.q[self.joint]);
        let [mut at_a, mut at_b] = [function(ends[0])?, function(ends[1])?];
        let mut state = ends[0].clone();
        if at_a * at_b >= 0.0 {
            return Ok(state);
        }
        for _ in 0..SEARCH {
            let angle = (a * at_b - b * at_a) / (at_b - at_a);
            self.turn(&mut state, angle)?;
            let here = function(&state)?;
            if here * at_b < 0.0 {
                (a, at_a) = (b, at_b);
            } else {
                at_a *= 0.5;
            }
            let moved = (angle - b).abs();
            (b, at_b) = (angle, here);
            if here == 0.0 || moved < NEAREST || (a - b).abs() < NEAREST {
                break;
            }
        }
        Ok(state)
    }

    /// dq/dq_d, NQ x 1; `None` where it is not unique.
    pub fn tangent(&self, state: &Closed) -> Option<DMatrix<f64>> {
        let at = state.equations.as_ref()?;
        Some(self.spread(state.q.len(), &at.tangent, 1.0))
    }

    /// dq/dx at a constant angle of the joint, NQ x K.
    ///
    /// # Errors
    /// The state is singular.
    pub fn follows(&self, design: &Design<'_>, state: &Closed) -> Result<DMatrix<f64>, String> {
        let at = state.equations.as_ref();
        let others = at.and_then(|at| at.solve(-design.closure(&state.q)));
        let others = others.ok_or("the mechanism is in a singular state")?;
        Ok(self.spread(state.q.len(), &others, 0.0))
    }

    /// The rows of all joints from those of the others; `own` is the row of the driven joint.
    fn spread(&self, joints: usize, others: &DMatrix<f64>, own: f64) -> DMatrix<f64> {
        let mut all = DMatrix::from_element(joints, others.ncols(), own);
        for (row, joint) in self.others.iter().enumerate() {
            all.set_row(*joint, &others.row(row));
        }
        all
    }

    /// The equations at a state; `None` where the joints that follow are not determined.
    fn equations(&self, q: &[f64]) -> Option<Equations> {
        let dimensions = self.system.dimensions();
        let (rows, speeds) = (9 * dimensions.loops, dimensions.speeds);
        let (mut residual, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * speeds]);
        self.system.write_closure(q, &mut residual, &mut jacobian).ok()?;
        let all = DMatrix::from_row_slice(rows, speeds, &jacobian);
        let others = all.select_columns(&self.others);
        let factors = (!others.is_empty()).then(|| others.clone().qr());
        let r = factors.as_ref().map_or_else(|| DMatrix::zeros(0, 0), QR::r);
        let diagonal = r.diagonal();
        let most = largest(&diagonal);
        if !(most.is_finite() && diagonal.iter().all(|it| it.abs() > SINGULAR * most)) {
            return None;
        }
        let (residual, tangent) = (DMatrix::from_vec(rows, 1, residual), DMatrix::zeros(0, 1));
        let mut equations = Equations { others, factors, r, residual, tangent };
        equations.tangent = equations.solve(-all.select_columns([&self.joint]))?;
        Some(equations)
    }
}
