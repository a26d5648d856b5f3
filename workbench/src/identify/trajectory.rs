//! A motion and its derivatives by parameters and by the initial state.
//!
//! With z any of these, the variational equations of dq/dt = u, du/dt = a(t, q, u, p)
//!
//! ```text
//! d/dt dq/dz = du/dz
//! d/dt du/dz = (da/dq) dq/dz + (da/du) du/dz + da/dp dp/dz
//! ```
//!
//! are integrated together with the motion. The program computes the derivatives of a, and the classical
//! Runge-Kutta method takes fixed steps, so that the result is a smooth function of z, which least
//! squares need. After each step the state is projected onto the closed loops; the derivatives
//! are tangential to them up to the error of the method.
//!
//! dq/dz has one number for each speed. For the orientation of a free body it is a small turn in the body's frame,
//! which turns with the angular velocity w: d/dt dq/dz = dw/dz - w x dq/dz.

use lamc::arithmetic::largest;
use lamc_runtime::{Change, Error, Mechanism, derivatives_along, project};

use super::tangent::{write_deviation, write_direction_rate};

/// The largest number of steps between two samples.
const MOST_STEPS: usize = 256;

/// A direction in which a motion may change.
#[derive(Clone, Debug)]
pub struct Direction {
    /// dq/dz at the start, NU.
    pub q: Vec<f64>,
    /// du/dz at the start, NU.
    pub u: Vec<f64>,
    /// dp/dz, by parameter.
    pub parameters: Vec<f64>,
}

/// Coordinates at the samples and their derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// By sample, NQ each: rad, for free bodies m and quaternions.
    pub q: Vec<Vec<f64>>,
    /// By sample, then direction after direction, NU each.
    pub derivatives: Vec<Vec<f64>>,
}

/// Integrates the motion from (q, u) at the first of some ascending times (s), with `steps` steps between two of
/// them.
///
/// # Errors
/// As [`lamc_runtime::acceleration`] and [`project`].
pub fn integrate<Y: Mechanism<Scalar = f64>>(
    system: &Y,
    times: &[f64],
    start: (&[f64], &[f64]),
    directions: &[Direction],
    steps: usize,
) -> Result<Trajectory, Error> {
    let (coordinates, n) = (start.0.len(), start.1.len());
    let mut sensitivities = Sensitivities {
        system,
        directions,
        workspace: system.workspace(),
        inputs: vec![0.0; system.dimensions().inputs],
        accelerations: vec![0.0; n * (1 + directions.len())],
    };
    // q, u, then dq, du of each direction.
    let mut y: Vec<f64> = [start.0, start.1].concat();
    for direction in directions {
        y.extend(direction.q.iter().chain(&direction.u));
    }
    let mut trajectory = Trajectory { q: Vec::new(), derivatives: Vec::new() };
    let mut record = |y: &[f64]| {
        trajectory.q.push(y[..coordinates].to_vec());
        let of = y[coordinates + n..].chunks_exact(2 * n).flat_map(|part| &part[..n]);
        trajectory.derivatives.push(of.copied().collect());
    };
    record(&y);
    let (mut stage, mut rate, mut sum) = (y.clone(), vec![0.0; y.len()], vec![0.0; y.len()]);
    for pair in times.windows(2) {
        let h = (pair[1] - pair[0]) / steps as f64;
        for step in 0..steps {
            let t = pair[0] + h * step as f64;
            sum.fill(0.0);
            for (place, weight) in [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
                for ((stage, y), rate) in stage.iter_mut().zip(&y).zip(&rate) {
                    *stage = if place == 0.0 { *y } else { y + h * place * rate };
                }
                sensitivities.write_rates(t + h * place, &stage, &mut rate)?;
                for (sum, rate) in sum.iter_mut().zip(&rate) {
                    *sum += weight * rate;
                }
            }
            for (y, sum) in y.iter_mut().zip(&sum) {
                *y += h / 6.0 * sum;
            }
            let (q, u) = y[..coordinates + n].split_at_mut(coordinates);
            system.normalise(q);
            project(system, t + h, q, u, sensitivities.workspace.as_mut())?;
        }
        record(&y);
    }
    Ok(trajectory)
}

/// The motion together with its derivatives along directions.
struct Sensitivities<'a, Y: Mechanism<Scalar = f64>> {
    system: &'a Y,
    directions: &'a [Direction],
    workspace: Y::Workspace,
    /// No direction changes an input.
    inputs: Vec<f64>,
    /// du/dt, then its derivative along each direction.
    accelerations: Vec<f64>,
}

impl<Y: Mechanism<Scalar = f64>> Sensitivities<'_, Y> {
    /// dy/dt, where y is q, u, then dq, du of each direction.
    fn write_rates(&mut self, t: f64, y: &[f64], rates: &mut [f64]) -> Result<(), Error> {
        let n = self.accelerations.len() / (1 + self.directions.len());
        let joints = self.system.dimensions().joints;
        let (state, along) = y.split_at(y.len() - 2 * n * self.directions.len());
        let (q, u) = state.split_at(state.len() - n);
        let changes =
            along.chunks_exact(2 * n).zip(self.directions).map(|(part, direction)| Change {
                t: 0.0,
                q: &part[..n],
                u: &part[n..],
                parameters: &direction.parameters,
                inputs: &self.inputs,
            });
        let (workspace, out) = (self.workspace.as_mut(), &mut self.accelerations);
        derivatives_along(self.system, t, q, u, changes, workspace, out)?;
        let (of_state, of_directions) = rates.split_at_mut(state.len());
        let (of_q, of_u) = of_state.split_at_mut(q.len());
        self.system.write_rates(q, u, of_q);
        let (a, changed) = self.accelerations.split_at(n);
        of_u.copy_from_slice(a);
        let parts = of_directions.chunks_exact_mut(2 * n).zip(along.chunks_exact(2 * n));
        for ((rates, part), a) in parts.zip(changed.chunks_exact(n)) {
            let ((dq, du), (of_dq, of_du)) = (part.split_at(n), rates.split_at_mut(n));
            write_direction_rate(u, dq, du, joints, of_dq);
            of_du.copy_from_slice(a);
        }
        Ok(())
    }
}

/// The number of steps between samples that keeps the error of the angles, and of displacements over the mechanism's
/// size, within `tolerance` (rad), found by comparison with twice as many. `None` if even [`MOST_STEPS`] are too few: the
/// motion is too stiff.
pub fn enough_steps<Y: Mechanism<Scalar = f64>>(
    system: &Y,
    times: &[f64],
    start: (&[f64], &[f64]),
    tolerance: f64,
) -> Option<usize> {
    let at = |steps: usize| integrate(system, times, start, &[], steps).ok();
    let mut steps = 1;
    let mut coarse = at(1);
    while steps < MOST_STEPS {
        let fine = at(2 * steps);
        if let (Some(coarse), Some(fine)) = (&coarse, &fine) {
            let mut deviation = vec![0.0; start.1.len()];
            let error = largest(coarse.q.iter().zip(&fine.q).map(|(coarse, fine)| {
                write_deviation(system, coarse, fine, &mut deviation);
                largest(&deviation)
            }));
            // The method has order 4: the error of the coarse motion is 16/15 of the difference.
            if error * 16.0 / 15.0 <= tolerance {
                return Some(steps);
            }
        }
        (steps, coarse) = (2 * steps, fine);
    }
    None
}
