//! How the start of a motion depends on what is asked for, and on the parameters.
//!
//! Assembly moves the angles that are asked for until the residuals r of the closure vanish; pinned joints stay, as rows more.
//! With J and its pseudo-inverse, the closed state follows as the nearest one does,
//!
//! ```text
//! dq = (1 - J^+ J) dq_asked + J_pinned^+ dq_asked - J^+ dr
//! ```
//!
//! so that of an adjoint q', J^+^T q' is that of the residuals. Prescribed angles may depend on parameters. Angles that neither loops nor pins determine move by the shortest way.

use lamc::program::FunctionKind;
use lamc_runtime::{Mechanism as _, State};
use nalgebra::{DMatrix, DVector};

use super::differentiated::{Adjoints, At, Differentiated, Undifferentiable};
use super::motion::Gradient;

/// Singular values of J below this share of the largest belong to rows that depend on others.
const SINGULAR: f64 = 1e-7;

impl Differentiated {
    /// The derivatives by the state that was asked for, from those by the closed state that assembly made of it; `pinned` says
    /// which joints assembly was to leave where they are.
    ///
    /// # Errors
    /// An error of the mechanism.
    pub fn assembled(
        &self,
        start: &State<Vec<f64>, f64>,
        pinned: &[bool],
        gradient: &Gradient,
    ) -> Result<Gradient, Undifferentiable> {
        let system = &self.system;
        let (joints, loops) = (system.interface().joints.len(), system.interface().loops.len());
        let nu = self.layout.speeds;
        let motion = |error| Undifferentiable::Motion { t: start.t, error };
        let (mut residual, mut jacobian) = (vec![0.0; 9 * loops], vec![0.0; 9 * loops * nu]);
        system.write_closure(&start.q, &mut residual, &mut jacobian).map_err(motion)?;
        let size = system.size();
        let row = |joint: usize| (0..nu).map(move |k| if k == joint { size } else { 0.0 });
        let driven: Vec<usize> = system.interface().driven().iter().map(|it| it.index()).collect();
        let held: Vec<usize> =
            (0..joints).filter(|joint| pinned[*joint] && !driven.contains(joint)).collect();
        jacobian.extend(driven.iter().chain(&held).flat_map(|joint| row(*joint)));
        let rows = jacobian.len() / nu.max(1);
        if rows == 0 {
            return Ok(gradient.clone());
        }
        let matrix = DMatrix::from_row_slice(rows, nu, &jacobian);
        let cut = SINGULAR * matrix.norm();
        let inverse = matrix.clone().pseudo_inverse(cut).unwrap_or_else(|_| matrix.transpose());
        // Coordinates of free bodies behind the angles are in no loop.
        let mut along = DVector::zeros(nu);
        along.rows_mut(0, joints).copy_from_slice(&gradient.q[..joints]);
        let of_rows = inverse.tr_mul(&along);
        let free = along - matrix.tr_mul(&of_rows);
        let mut all = gradient.clone();
        all.q[..joints].copy_from_slice(&free.as_slice()[..joints]);
        let of_held = &of_rows.as_slice()[9 * loops + driven.len()..];
        held.iter().zip(of_held).for_each(|(joint, share)| all.q[*joint] += size * share);
        let mut adjoints = Adjoints::zeros(self.layout);
        let at = At { t: start.t, q: &start.q, u: &start.u };
        let weights: Vec<f64> = of_rows.iter().take(9 * loops).map(|share| -share).collect();
        self.pull(FunctionKind::Closure, at, &weights, &mut adjoints);
        let of_drives = of_rows.iter().skip(9 * loops).take(driven.len());
        let weights: Vec<f64> = of_drives.flat_map(|share| [size * share, 0.0, 0.0, 0.0]).collect();
        self.pull(FunctionKind::Drives, at, &weights, &mut adjoints);
        // What the functions read of q is not asked for.
        adjoints.state.fill(0.0);
        let share = self.gradient(adjoints)?;
        let inputs = all.inputs.iter_mut().flatten().zip(share.inputs.into_iter().flatten());
        let parameters = all.parameters.iter_mut().zip(share.parameters);
        parameters.chain(inputs).for_each(|(sum, share)| *sum += share);
        Ok(all)
    }
}
