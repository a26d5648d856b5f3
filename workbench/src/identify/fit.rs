//! Least squares between a recorded and a simulated motion.
//!
//! Unknown are the free parameters and where the motion starts: independent coordinates and speeds.
//! What was not recorded of a free body starts as the model says. The sum of squares of the errors is brought to its minimum by the method of Levenberg
//! and Marquardt (J. J. More, "The Levenberg-Marquardt algorithm: implementation and theory",
//! 1978).

use lamc::laminate;
use lamc::source::{Expression, ParameterId};
use lamc_runtime::plumbing::Dimensions;
use lamc_runtime::{Error, Mechanism, assemble};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, TerminationReason};
use nalgebra::DVector;

use super::candidate::Candidate;
use super::record::{Record, is_orientation};
use super::start::Start;
use super::tangent::coordinate_of;
use super::trajectory::enough_steps;
use crate::execution::Jit;

/// The error of integration that is allowed at first, rad.
const COARSE: f64 = 1e-5;
/// The error of integration that is allowed, as a share of the residuals.
const BESIDE: f64 = 1e-4;
/// A motion is near the measured one if the residuals are less than this share of it.
pub const NEAR: f64 = 0.3;
/// A joint keeps its measured angle if the assembled angle is this near to it, rad.
const SEEN: f64 = 1e-6;
/// The largest number of evaluations per unknown.
const PATIENCE: usize = 60;

/// A problem of identification.
#[derive(Clone, Debug)]
pub struct Problem<'r> {
    /// The mechanism; its parameters are the first guess.
    pub system: Jit,
    /// What was measured.
    pub record: &'r Record,
    /// Indices of the free parameters.
    pub free: Vec<usize>,
    /// Whether the motion starts from rest. If not, the initial speeds are unknowns, too.
    pub from_rest: bool,
    /// The error of integration that is allowed, rad.
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

/// The result of a fit.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The free parameters.
    pub estimates: Vec<Estimate>,
    /// Correlations of the estimates, row-major.
    pub correlations: Vec<f64>,
    /// The root mean square of the residuals, rad. Displacements of free bodies count by their share of the mechanism's
    /// size.
    pub rms: f64,
    /// The same divided by the extent of the motion. If it is near 1, the model does not move as measured at all.
    pub share: f64,
    /// The fitted motion at the record's times, rad; m and quaternions of free bodies.
    pub q: Vec<Vec<f64>>,
    /// Measured minus fitted, by sample, then by speed of the model, rad; displacements divided by the mechanism's size.
    /// NaN was not measured.
    pub residuals: Vec<Vec<f64>>,
    /// The fitted speeds at the start, rad/s; m/s of free bodies.
    pub u: Vec<f64>,
    /// The speeds that started as the model says, and their coordinates, because the record does not contain them: indices
    /// of u.
    pub kept: Vec<usize>,
    /// The number of motions that were integrated.
    pub evaluations: usize,
}

/// Whether a prescribed angle depends on a parameter, by its index: such a parameter cannot be free.
pub fn prescribes(mechanism: &laminate::Mechanism, parameter: usize) -> bool {
    let parameter = Expression::Parameter(ParameterId(parameter));
    let mut drives = mechanism.joints.iter().filter_map(|joint| joint.drive.as_ref());
    drives.any(|drive| drive.contains(&parameter))
}

/// Why a fit failed.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// No parameter is free.
    #[error("no parameter is free")]
    NothingFree,
    /// The loops do not close near what was measured, or the motion cannot be integrated.
    #[error("the motion cannot be simulated from the first sample: {0}")]
    Motion(#[from] Error),
    /// The motion is too stiff for fixed steps.
    #[error(
        "the motion from the first sample is too stiff to be fitted, or passes a singular state, \
         such as the flat one: it would need more steps between samples than lamc takes"
    )]
    Stiff,
    /// A quaternion that was measured is no unit quaternion.
    #[error("sample {sample} has an orientation that is no unit quaternion")]
    Quaternion {
        /// Counted from 0.
        sample: usize,
    },
    /// There are fewer measured values than unknowns.
    #[error("{values} measured values are not enough to determine {unknowns} unknowns")]
    TooFew {
        /// Measured; three for each orientation.
        values: usize,
        /// Free parameters and initial values.
        unknowns: usize,
    },
    /// A change of some unknowns has no effect on what was measured.
    #[error("the record does not determine {0}: keep one of them fixed")]
    Indistinct(String),
    /// The method stopped before it reached a minimum.
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

impl Problem<'_> {
    /// Finds the parameters.
    ///
    /// # Errors
    /// [`FitError`].
    pub fn solve(&self) -> Result<Fit, FitError> {
        if self.free.is_empty() {
            return Err(FitError::NothingFree);
        }
        self.check_orientations()?;
        let near = self.first_state()?;
        let mut start = Start::near(&self.system, self.record.t[0], &near)?;
        start.keep(&self.kept());
        let mut x = self.first_guess(&start, &near)?;
        let mut evaluations = 0;
        let mut steps = self.first_steps(&start, &near, &x)?;
        // Short pieces first: over a long piece, a wrong guess leads to an arbitrary phase.
        let whole = self.record.t.len();
        let mut pieces = vec![whole / 2, whole / 4, whole / 8];
        pieces.retain(|samples| self.measured(*samples).count() > 2 * x.len());
        loop {
            let piece = pieces.pop();
            let mut at = Candidate::new(self, &start, &near, steps, &x);
            if let Some(samples) = piece {
                if at.share() < NEAR {
                    pieces.clear();
                    continue;
                }
                at.shorten(samples);
            }
            let method = LevenbergMarquardt::new().with_patience(PATIENCE).with_tol(1e-11);
            let (solved, report) = method.minimize(at);
            evaluations += report.number_of_evaluations;
            x = solved.params();
            if piece.is_some() {
                continue;
            }
            check(&report.termination, &solved, evaluations)?;
            // The error of integration must be small beside the residuals; the motion found may also
            // need more steps than that of the guess.
            let begun = solved.begun()?;
            let allowed = self.tolerance.max(BESIDE * solved.rms());
            let from = (begun.q.as_slice(), begun.u.as_slice());
            let needed = enough_steps(solved.system(), &self.record.t, from, allowed);
            let needed = needed.ok_or(FitError::Stiff)?;
            if needed <= steps {
                return solved.report(evaluations);
            }
            steps = needed;
        }
    }

    /// The unknowns to begin with: free parameters as given, independent coordinates as measured,
    /// speeds of joints zero.
    fn first_guess(&self, start: &Start, near: &[f64]) -> Result<DVector<f64>, FitError> {
        let freedoms = start.independent.len();
        let speeds = if self.from_rest { 0 } else { freedoms };
        let unknowns = self.free.len() + freedoms + speeds;
        let values = self.measured(self.record.t.len()).count();
        if values <= unknowns {
            return Err(FitError::TooFew { values, unknowns });
        }
        let mut x = DVector::zeros(unknowns);
        for (place, &parameter) in self.free.iter().enumerate() {
            x[place] = self.system.parameters()[parameter];
        }
        let joints = self.system.dimensions().joints;
        let guess = self.first_speeds();
        for (place, &k) in start.independent.iter().enumerate() {
            let place = self.free.len() + place;
            if k < joints {
                x[place] = near[k];
            } else if !self.from_rest {
                x[place + freedoms] = guess[k];
            }
        }
        Ok(x)
    }

    /// Steps between samples that are enough for the first guess.
    fn first_steps(
        &self,
        start: &Start,
        near: &[f64],
        x: &DVector<f64>,
    ) -> Result<usize, FitError> {
        let freedoms = start.independent.len();
        let (coordinates, speeds) = x.as_slice()[self.free.len()..].split_at(freedoms);
        let rest = vec![0.0; freedoms];
        let speeds = if self.from_rest { &rest } else { speeds };
        let t = self.record.t[0];
        let begun = start.at(&self.system, t, near, coordinates, speeds)?;
        let from = (begun.q.as_slice(), begun.u.as_slice());
        enough_steps(&self.system, &self.record.t, from, COARSE).ok_or(FitError::Stiff)
    }

    /// The closed configuration nearest to the first sample; joints that were not seen there are
    /// where they were given, if the loops close that way.
    fn first_state(&self) -> Result<Vec<f64>, Error> {
        let first = &self.record.q[0];
        let given = self.system.initial().q;
        let seen: Vec<bool> = first.iter().map(|q| !q.is_nan()).collect();
        let guess: Vec<f64> = first
            .iter()
            .zip(&given)
            .map(|(q, given)| if q.is_nan() { *given } else { *q })
            .collect();
        let joints = self.system.dimensions().joints;
        let both = (0..joints).map(|joint| seen[joint] || self.system.is_pinned(joint));
        let assembled = |pinned: &[bool]| {
            let mut q = guess.clone();
            let t = self.record.t[0];
            assemble(&self.system, t, &mut q, pinned, &mut self.system.workspace()).map(|_| q)
        };
        let q = assembled(&both.collect::<Vec<_>>())?;
        let is_as_seen =
            q.iter().zip(first).all(|(q, seen)| seen.is_nan() || (q - seen).abs() <= SEEN);
        if is_as_seen { Ok(q) } else { assembled(&seen[..joints]) }
    }

    /// The speeds of free bodies to begin with, NU: those between the first two samples where both were measured, and those
    /// of the model where not.
    fn first_speeds(&self) -> Vec<f64> {
        let [first, second, ..] = self.record.q.as_slice() else { return self.system.initial().u };
        let mut speeds = self.system.speeds();
        self.system.write_difference(first, second, &mut speeds);
        let dt = self.record.t[1] - self.record.t[0];
        let given = self.system.initial().u;
        let both = speeds.iter().zip(&given);
        both.map(|(step, given)| if step.is_nan() { *given } else { step / dt }).collect()
    }

    /// The components of the free bodies that the record does not contain, with their speeds at the start.
    pub(super) fn kept(&self) -> Vec<(usize, f64)> {
        let Dimensions { joints, speeds, .. } = self.system.dimensions();
        let given = self.system.initial().u;
        let is_seen = |k: usize| {
            let coordinate = coordinate_of(k, joints);
            self.record.q.iter().any(|q| !q[coordinate].is_nan())
        };
        let kept = (joints..speeds).filter(|k| !is_seen(*k));
        kept.map(|k| (k, if self.from_rest { 0.0 } else { given[k] })).collect()
    }

    /// Fails if an orientation is not measured as a whole, or is no unit quaternion.
    fn check_orientations(&self) -> Result<(), FitError> {
        let joints = self.system.dimensions().joints;
        let is_wrong = |q: &Vec<f64>| !q[joints..].as_chunks().0.iter().all(is_orientation);
        match self.record.q.iter().position(is_wrong) {
            Some(sample) => Err(FitError::Quaternion { sample }),
            None => Ok(()),
        }
    }

    /// Sample and component along u of everything that was seen within the first samples.
    pub(super) fn measured(&self, samples: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let Dimensions { joints, speeds, .. } = self.system.dimensions();
        let rows = self.record.q.iter().enumerate().take(samples);
        rows.flat_map(move |(sample, q)| {
            let seen = (0..speeds).filter(move |&k| !q[coordinate_of(k, joints)].is_nan());
            seen.map(move |k| (sample, k))
        })
    }
}

/// Fails if the method ended before it reached a minimum.
fn check(
    termination: &TerminationReason,
    solved: &Candidate<'_>,
    evaluations: usize,
) -> Result<(), FitError> {
    // If rounding permits no further progress, this is a minimum, too.
    if termination.was_successful()
        || matches!(termination, TerminationReason::NoImprovementPossible(_))
    {
        return Ok(());
    }
    // An unknown that the record does not determine has no minimum.
    if let Err(told @ FitError::Indistinct(_)) = solved.report(evaluations) {
        return Err(told);
    }
    let reason = match termination {
        TerminationReason::LostPatience => "the residuals were still decreasing".to_owned(),
        TerminationReason::User(_) => "an intermediate motion cannot be integrated".to_owned(),
        other => format!("{other:?}"),
    };
    Err(FitError::NoMinimum { evaluations, reason })
}
