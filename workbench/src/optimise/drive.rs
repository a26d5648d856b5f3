//! The mechanism while one joint is turned: its states, and how they follow the design.
//!
//! With the residuals r(q, x) of the loops, q_d the driven joint and q_s the others,
//!
//! ```text
//! Newton   J_s dq_s = -r            turning   J_s dq_s/dq_d = -J_d            design   J_s dq_s/dx = -r_x
//! ```
//!
//! in the sense of least squares: the nine equations of a loop depend on each other, and agree where it can close.

use lamc::arithmetic::largest;
use lamc_runtime::{Mechanism as _, assemble};
use nalgebra::DMatrix;

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

/// The equations of the joints that follow, factored.
struct Factored {
    q: DMatrix<f64>,
    r: DMatrix<f64>,
    /// 9 L x 1.
    residual: DMatrix<f64>,
    /// The column of the driven joint, 9 L x 1.
    driven: DMatrix<f64>,
}

impl Factored {
    fn solve(&self, rhs: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        // A single joint has no others.
        if self.r.is_empty() {
            return Some(DMatrix::zeros(0, rhs.ncols()));
        }
        self.r.solve_upper_triangular(&(self.q.transpose() * rhs))
    }

    /// Whether an odd number of singular states lies between this state and a near one: with J_s = Q R,
    /// det(Q^T J_s) has changed its sign. There the motion may branch, and a step would go on by chance.
    fn is_apart(&self, other: &Self) -> bool {
        let signs = |r: &DMatrix<f64>| r.diagonal().iter().map(|it| it.signum()).product::<f64>();
        let turned = (self.q.transpose() * &other.q).determinant();
        signs(&self.r) * turned * signs(&other.r) < 0.0
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
    pub fn start(&self) -> Result<Vec<f64>, String> {
        let system = self.system;
        let mut q = system.initial().q;
        let pinned: Vec<bool> = (0..q.len()).map(|joint| system.is_pinned(joint)).collect();
        let assembled = assemble(system, 0.0, &mut q, &pinned, &mut system.workspace());
        assembled.map(|_| q).map_err(|_| "the loops do not close near the initial state".to_owned())
    }

    /// The states at these angles (rad) of the joint, one after the other, from a closed state.
    ///
    /// # Errors
    /// The mechanism cannot go on; the text says where.
    pub fn states(&self, start: &[f64], angles: &[f64]) -> Result<Vec<Vec<f64>>, String> {
        let mut q = start.to_vec();
        let each = angles.iter().map(|angle| {
            self.turn(&mut q, *angle)?;
            Ok(q.clone())
        });
        each.collect()
    }

    /// Turns the joint to an angle, rad.
    ///
    /// # Errors
    /// As [`states`](Self::states).
    pub fn turn(&self, q: &mut Vec<f64>, angle: f64) -> Result<(), String> {
        let shortest = LONGEST * 0.5_f64.powi(HALVINGS as i32);
        let mut longest = LONGEST;
        while q[self.joint] != angle {
            let left = angle - q[self.joint];
            let to =
                if left.abs() <= longest { angle } else { q[self.joint] + longest.copysign(left) };
            match self.step(q, to) {
                Some(next) => {
                    *q = next;
                    longest = (2.0 * longest).min(LONGEST);
                }
                None if longest > shortest => longest *= 0.5,
                None => {
                    let at = q[self.joint].to_degrees();
                    return Err(format!(
                        "the mechanism does not move beyond {at:.1} deg of the driven joint"
                    ));
                }
            }
        }
        Ok(())
    }

    /// The closed state at an angle next to that of a closed state.
    fn step(&self, from: &[f64], angle: f64) -> Option<Vec<f64>> {
        let mut q = from.to_vec();
        let before = self.factored(from)?;
        let tangent = self.tangent_of(&before, from.len())?;
        let by = angle - from[self.joint];
        q.iter_mut().zip(tangent.iter()).for_each(|(q, slope)| *q += by * slope);
        q[self.joint] = angle;
        let predicted = q.clone();
        let allowed = CLOSED * self.system.size();
        for _ in 0..NEWTON {
            let at = self.factored(&q)?;
            let open = largest(&at.residual);
            if open <= allowed {
                let moved = q.iter().zip(&predicted).map(|(q, then)| q - then);
                return (largest(moved) < JUMP && !before.is_apart(&at)).then_some(q);
            }
            let step = at.solve(&at.residual)?;
            self.others.iter().zip(step.iter()).for_each(|(joint, by)| q[*joint] -= by);
        }
        None
    }

    /// The states from the first to the last angle (rad), at most so far apart.
    ///
    /// # Errors
    /// As [`states`](Self::states).
    pub fn sweep(&self, [from, to]: [f64; 2], step: f64) -> Result<Vec<Vec<f64>>, String> {
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
        ends: [&[f64]; 2],
        function: impl Fn(&[f64]) -> Result<f64, String>,
    ) -> Result<Vec<f64>, String> {
        let [mut a, mut b] = ends.map(|end| end[self.joint]);
        let [mut at_a, mut at_b] = [function(ends[0])?, function(ends[1])?];
        let mut q = ends[0].to_vec();
        if at_a * at_b >= 0.0 {
            return Ok(q);
        }
        for _ in 0..SEARCH {
            let angle = (a * at_b - b * at_a) / (at_b - at_a);
            self.turn(&mut q, angle)?;
            let here = function(&q)?;
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
        Ok(q)
    }

    /// dq/dq_d, NQ x 1; `None` where it is not unique.
    pub fn tangent(&self, q: &[f64]) -> Option<DMatrix<f64>> {
        self.tangent_of(&self.factored(q)?, q.len())
    }

    fn tangent_of(&self, at: &Factored, joints: usize) -> Option<DMatrix<f64>> {
        let others = at.solve(&at.driven)?;
        Some(self.spread(joints, &-others, 1.0))
    }

    /// dq/dx at a constant angle of the joint, NQ x K.
    ///
    /// # Errors
    /// The state is singular.
    pub fn follows(&self, design: &Design<'_>, q: &[f64]) -> Result<DMatrix<f64>, String> {
        let at = self.factored(q).ok_or("the mechanism is in a singular state")?;
        let others = at.solve(&design.closure(q)).ok_or("the mechanism is in a singular state")?;
        Ok(self.spread(q.len(), &-others, 0.0))
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
    fn factored(&self, q: &[f64]) -> Option<Factored> {
        let dimensions = self.system.dimensions();
        let (rows, speeds) = (9 * dimensions.loops, dimensions.speeds);
        let (mut residual, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * speeds]);
        self.system.write_closure(q, &mut residual, &mut jacobian).ok()?;
        let all = DMatrix::from_row_slice(rows, speeds, &jacobian);
        let driven = all.select_columns([&self.joint]);
        let others = all.select_columns(&self.others);
        let (q, r) = match others.is_empty() {
            true => (others.clone(), others),
            false => others.qr().unpack(),
        };
        let diagonal = r.diagonal();
        let most = largest(&diagonal);
        let is_clear = most.is_finite() && diagonal.iter().all(|it| it.abs() > SINGULAR * most);
        is_clear.then(|| Factored { q, r, residual: DMatrix::from_vec(rows, 1, residual), driven })
    }
}
