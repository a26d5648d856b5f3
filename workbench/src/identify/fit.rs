//! Least squares between a recorded and a simulated motion.
//!
//! Unknown are the free parameters and where the motion starts: independent coordinates and speeds.
//! The sum of squares of the angles' errors is brought to its minimum by the method of Levenberg
//! and Marquardt (J. J. More, "The Levenberg-Marquardt algorithm: implementation and theory",
//! 1978), with derivatives from the variational equations. The covariance of the unknowns is
//! s^2 (J^T J)^-1, s^2 = (sum of squares) / (residuals - unknowns).

use lamc_runtime::{Error, State, System, assemble};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, TerminationReason};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn, U1};

use super::record::Record;
use super::start::{Begun, Start};
use super::trajectory::{Direction, Trajectory, enough_steps, integrate};
use crate::execution::Jit;

/// A residual no motion has, where one cannot be integrated, rad: such steps are taken back.
const REFUSED: f64 = 1e3;
/// Singular values less than this fraction of the largest, columns of length one: the unknowns
/// cannot be told apart.
const TELLING: f64 = 1e-9;
/// An unknown that moves the angles by less than this, rad, root mean square, moves nothing.
const IDLE: f64 = 1e-10;
/// Error of integration for a start, rad.
const COARSE: f64 = 1e-5;
/// Error of integration over what is left of the angles.
const BESIDE: f64 = 1e-4;
/// A motion is near the measured one when it leaves less than this share of it.
pub const NEAR: f64 = 0.3;
/// How near, rad, a joint is to where it was seen, when the loops close with it there.
const SEEN: f64 = 1e-6;
/// Evaluations per unknown before giving up.
const PATIENCE: usize = 60;

/// What is to be found.
#[derive(Clone, Debug)]
pub struct Problem<'r> {
    /// The mechanism, its parameters as a first guess.
    pub system: Jit,
    /// What was measured.
    pub record: &'r Record,
    /// Indices of the free parameters.
    pub free: Vec<usize>,
    /// Whether the motion starts from rest; else its speeds are unknown too.
    pub from_rest: bool,
    /// Error of integration allowed, rad.
    pub tolerance: f64,
}

/// A number with its standard error.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Of the parameter.
    pub name: String,
    /// SI.
    pub value: f64,
    /// SI.
    pub standard_error: f64,
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The free parameters.
    pub estimates: Vec<Estimate>,
    /// Correlations of the estimates, row-major.
    pub correlations: Vec<f64>,
    /// Root of the mean square of what is left, rad.
    pub rms: f64,
    /// That, over how far the motion goes: near 1 the model does not move as measured at all.
    pub share: f64,
    /// The fitted motion at the record's times, rad.
    pub q: Vec<Vec<f64>>,
    /// The fitted speeds at the start, rad/s.
    pub u: Vec<f64>,
    /// Motions that were integrated.
    pub evaluations: usize,
}

/// Why nothing was found.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// No parameter is free.
    #[error("no parameter is free")]
    NothingFree,
    /// The loops do not close near what was measured, or the motion cannot be integrated.
    #[error("the motion cannot be simulated from the first sample: {0}")]
    Motion(#[from] Error),
    /// Fixed steps are too long for it.
    #[error(
        "the motion from the first sample is too stiff to be fitted, or passes a singular state, as \
         the flat one is: more steps between samples would be needed than are taken"
    )]
    Stiff,
    /// Fewer angles than unknowns.
    #[error("{angles} angles cannot determine {unknowns} unknowns")]
    TooFew {
        /// Measured.
        angles: usize,
        /// Free parameters and initial values.
        unknowns: usize,
    },
    /// A change of some unknowns changes nothing that was measured.
    #[error("the record does not tell {0}: keep one of them fixed")]
    Indistinct(String),
    /// The method stopped elsewhere than at a minimum.
    #[error(
        "no minimum was found after {evaluations} motions: {reason}; start from a better guess"
    )]
    NoMinimum {
        /// Motions integrated.
        evaluations: usize,
        /// Of the method.
        reason: String,
    },
}

/// The problem at one set of unknowns: free parameters, coordinates, speeds.
struct At<'p> {
    problem: &'p Problem<'p>,
    system: Jit,
    start: &'p Start,
    near: &'p [f64],
    steps: usize,
    unknowns: DVector<f64>,
    /// Samples that count.
    samples: usize,
    motion: Option<Trajectory>,
}

impl Problem<'_> {
    /// Finds the parameters.
    ///
    /// # Errors
    /// [`FitError`].
    pub fn solve(&self) -> Result<Fit, FitError> {
        if self.free.is_empty() {
            return Err(FitError::NothingFree);
        }
        let near = self.first_state()?;
        let t = self.record.t[0];
        let start = Start::near(&self.system, t, &near);
        let freedoms = start.independent.len();
        let speeds = if self.from_rest { 0 } else { freedoms };
        let unknowns = self.free.len() + freedoms + speeds;
        let angles = self.measured(self.record.t.len()).count();
        if angles <= unknowns {
            return Err(FitError::TooFew { angles, unknowns });
        }
        let mut x = DVector::zeros(unknowns);
        for (place, &parameter) in self.free.iter().enumerate() {
            x[place] = self.system.parameters()[parameter];
        }
        for (place, &joint) in start.independent.iter().enumerate() {
            x[self.free.len() + place] = near[joint];
        }
        let begun = start.at(
            &self.system,
            t,
            &near,
            &x.as_slice()[self.free.len()..][..freedoms],
            &vec![0.0; freedoms],
        )?;
        let from = (begun.q.as_slice(), begun.u.as_slice());
        let mut steps =
            enough_steps(&self.system, &self.record.t, from, COARSE).ok_or(FitError::Stiff)?;
        let mut evaluations = 0;
        // Short pieces first: over a long one the phase of a wrong guess is anything.
        let whole = self.record.t.len();
        let mut pieces = vec![whole / 2, whole / 4, whole / 8];
        pieces.retain(|samples| self.measured(*samples).count() > 2 * unknowns);
        loop {
            let piece = pieces.pop();
            let mut at = At {
                problem: self,
                system: self.system.clone(),
                start: &start,
                near: &near,
                steps,
                unknowns: x.clone(),
                samples: whole,
                motion: None,
            };
            at.set_params(&x);
            if let Some(samples) = piece {
                if at.share() < NEAR {
                    pieces.clear();
                    continue;
                }
                at.samples = samples;
                at.set_params(&x);
            }
            let method = LevenbergMarquardt::new().with_patience(PATIENCE).with_tol(1e-11);
            let (solved, report) = method.minimize(at);
            evaluations += report.number_of_evaluations;
            x = solved.unknowns.clone();
            if piece.is_some() {
                continue;
            }
            if !report.termination.was_successful() && !stalled(&report.termination) {
                // What the record does not tell has no minimum.
                if let Err(told @ FitError::Indistinct(_)) = solved.report(evaluations) {
                    return Err(told);
                }
                let reason = match report.termination {
                    TerminationReason::LostPatience => "it went on without end".to_owned(),
                    TerminationReason::User(_) => {
                        "a motion on the way cannot be integrated".to_owned()
                    }
                    other => format!("{other:?}"),
                };
                return Err(FitError::NoMinimum { evaluations, reason });
            }
            // The method's error is to be small beside what is left; the motion found may also need
            // more steps than that of the guess.
            let begun = solved.begun()?;
            let allowed = self.tolerance.max(BESIDE * solved.rms());
            let from = (begun.q.as_slice(), begun.u.as_slice());
            let needed = enough_steps(&solved.system, &self.record.t, from, allowed);
            let needed = needed.ok_or(FitError::Stiff)?;
            if needed <= steps {
                return solved.report(evaluations);
            }
            steps = needed;
        }
    }

    /// The closed configuration nearest to the first sample; joints that were not seen there are
    /// where they were given, if the loops close that way.
    fn first_state(&self) -> Result<Vec<f64>, Error> {
        let first = &self.record.q[0];
        let given = State::initial(&self.system).q;
        let seen: Vec<bool> = first.iter().map(|q| !q.is_nan()).collect();
        let guess: Vec<f64> = first
            .iter()
            .zip(&given)
            .map(|(q, given)| if q.is_nan() { *given } else { *q })
            .collect();
        let both = (0..guess.len()).map(|joint| seen[joint] || self.system.is_pinned(joint));
        let assembled = |pinned: &[bool]| {
            let mut q = guess.clone();
            let t = self.record.t[0];
            assemble(&self.system, t, &mut q, pinned, &mut self.system.workspace()).map(|_| q)
        };
        let q = assembled(&both.collect::<Vec<_>>())?;
        let is_as_seen =
            q.iter().zip(first).all(|(q, seen)| seen.is_nan() || (q - seen).abs() <= SEEN);
        if is_as_seen { Ok(q) } else { assembled(&seen) }
    }

    /// Sample and joint of every angle that was seen within the first samples.
    fn measured(&self, samples: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let rows = self.record.q.iter().enumerate().take(samples);
        rows.flat_map(|(sample, q)| {
            let seen = q.iter().enumerate().filter(|(_, q)| !q.is_nan());
            seen.map(move |(joint, _)| (sample, joint))
        })
    }
}

/// Whether the method stopped because numbers have no more digits: that is a minimum, too.
fn stalled(termination: &TerminationReason) -> bool {
    matches!(termination, TerminationReason::NoImprovementPossible(_))
}

impl At<'_> {
    /// Root of the mean square of what is left, rad.
    fn rms(&self) -> f64 {
        let residuals = self.residuals().unwrap_or_default();
        (residuals.norm_squared() / residuals.len().max(1) as f64).sqrt()
    }

    /// What is left over how far the measured motion goes from its first sample, root mean square.
    fn share(&self) -> f64 {
        let first = &self.problem.record.q[0];
        let measured = self.problem.measured(self.samples);
        let gone = measured.map(|(sample, joint)| {
            let gone = self.problem.record.q[sample][joint] - first[joint];
            if gone.is_nan() { 0.0 } else { gone * gone }
        });
        let count = self.problem.measured(self.samples).count().max(1) as f64;
        self.rms() / (gone.sum::<f64>() / count).sqrt()
    }

    fn begun(&self) -> Result<Begun, Error> {
        let (free, freedoms) = (self.problem.free.len(), self.start.independent.len());
        let (coordinates, speeds) = self.unknowns.as_slice()[free..].split_at(freedoms);
        let rest = vec![0.0; freedoms];
        let speeds = if self.problem.from_rest { &rest } else { speeds };
        let t = self.problem.record.t[0];
        self.start.at(&self.system, t, self.near, coordinates, speeds)
    }

    fn integrate(&self) -> Result<Trajectory, Error> {
        let begun = self.begun()?;
        let (n, parameters) = (begun.q.len(), self.system.parameters().len());
        let by_parameter = self.problem.free.iter().map(|&free| Direction {
            q: vec![0.0; n],
            u: vec![0.0; n],
            parameters: (0..parameters).map(|k| f64::from(u8::from(k == free))).collect(),
        });
        let kept = self.unknowns.len() - self.problem.free.len();
        let by_start = begun.directions.iter().take(kept).map(|(q, u)| Direction {
            q: q.clone(),
            u: u.clone(),
            parameters: vec![0.0; parameters],
        });
        let directions: Vec<Direction> = by_parameter.chain(by_start).collect();
        let times = &self.problem.record.t[..self.samples];
        integrate(&self.system, times, (&begun.q, &begun.u), &directions, self.steps)
    }

    /// Estimates with their errors at the minimum.
    fn report(&self, evaluations: usize) -> Result<Fit, FitError> {
        let (Some(residuals), Some(jacobian)) = (self.residuals(), self.jacobian()) else {
            let reason = "the motion found cannot be integrated".into();
            return Err(FitError::NoMinimum { evaluations, reason });
        };
        let motion = self.integrate()?;
        let lengths: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
        let names: Vec<String> = self.names();
        // How far, root mean square, angles go with an unknown as large as it is or was.
        let given = self.problem.free.iter().map(|&k| self.problem.system.parameters()[k].abs());
        let sizes = given.chain(std::iter::repeat(1.0)).zip(self.unknowns.iter());
        let rows = (residuals.len() as f64).sqrt();
        let is_idle = |(length, (given, found)): (&f64, (f64, &f64))| {
            *length == 0.0 || (given > 0.0 && length * found.abs().max(given) < IDLE * rows)
        };
        if let Some(idle) = lengths.iter().zip(sizes).position(is_idle) {
            return Err(FitError::Indistinct(format!("`{}`", names[idle])));
        }
        let mut scaled = jacobian;
        for (mut column, length) in scaled.column_iter_mut().zip(&lengths) {
            column /= *length;
        }
        let eigen = (scaled.transpose() * &scaled).symmetric_eigen();
        let least = eigen.eigenvalues.imin();
        if eigen.eigenvalues[least] <= TELLING * eigen.eigenvalues.amax() {
            let vector = eigen.eigenvectors.column(least);
            let mixed = names.iter().zip(vector.iter()).filter(|(_, part)| part.abs() > 0.1);
            let mixed: Vec<String> = mixed.map(|(name, _)| format!("`{name}`")).collect();
            return Err(FitError::Indistinct(format!("{} apart", mixed.join(", "))));
        }
        let spread = residuals.len() - self.unknowns.len();
        let variance = residuals.norm_squared() / spread as f64;
        let inverse = DMatrix::from_diagonal(&eigen.eigenvalues.map(|value| 1.0 / value));
        let covariance = &eigen.eigenvectors * inverse * eigen.eigenvectors.transpose();
        let free = self.problem.free.len();
        let estimate = |k: usize| Estimate {
            name: names[k].clone(),
            value: self.unknowns[k],
            standard_error: (variance * covariance[(k, k)]).sqrt() / lengths[k],
        };
        let correlation = |i: usize, j: usize| {
            covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt()
        };
        Ok(Fit {
            estimates: (0..free).map(estimate).collect(),
            correlations: (0..free * free).map(|k| correlation(k / free, k % free)).collect(),
            rms: self.rms(),
            share: self.share(),
            q: motion.q,
            u: self.begun()?.u,
            evaluations,
        })
    }

    /// Of the unknowns.
    fn names(&self) -> Vec<String> {
        let interface = self.system.interface();
        let free = self.problem.free.iter().map(|&k| interface.parameters[k].name.clone());
        let joints = |symbol: &'static str| {
            let joints = self.start.independent.iter();
            joints.map(move |&joint| {
                format!("{symbol}.{} at the start", interface.joints[joint].name)
            })
        };
        free.chain(joints("q")).chain(joints("u")).take(self.unknowns.len()).collect()
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for At<'_> {
    type ResidualStorage = Owned<f64, Dyn, U1>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn, U1>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.unknowns.copy_from(x);
        let free: Vec<String> = self.names().into_iter().take(self.problem.free.len()).collect();
        for (name, value) in free.iter().zip(x.iter()) {
            // The names are those of the system itself.
            let _ = self.system.set_parameter(name, *value);
        }
        self.motion = self.integrate().ok();
    }

    fn params(&self) -> DVector<f64> {
        self.unknowns.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let measured = self.problem.measured(self.samples);
        let residuals = measured.map(|(sample, joint)| match &self.motion {
            Some(motion) => motion.q[sample][joint] - self.problem.record.q[sample][joint],
            None => REFUSED,
        });
        Some(DVector::from_vec(residuals.collect()))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let motion = self.motion.as_ref()?;
        let measured: Vec<_> = self.problem.measured(self.samples).collect();
        let n = self.near.len();
        Some(DMatrix::from_fn(measured.len(), self.unknowns.len(), |row, column| {
            let (sample, joint) = measured[row];
            motion.derivatives[sample][column * n + joint]
        }))
    }
}
