//! A candidate of a fit: the simulated motion at one set of unknowns, its residuals and their
//! derivatives from the variational equations. The covariance of the unknowns is
//!
//! ```text
//! s^2 (J^T J)^-1,   s^2 = (sum of squares) / (residuals - unknowns)
//! ```

use lamc::program::Interface;
use lamc::source::SpeedId;
use lamc::source::free::{COORDINATE_NAMES, SPEEDS};
use lamc_runtime::{Error, Mechanism};
use levenberg_marquardt::LeastSquaresProblem;
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn, U1};

use super::fit::{Estimate, Fit, FitError, Problem};
use super::start::{Begun, Start};
use super::tangent::{deviation_rate, write_deviation};
use super::trajectory::{Direction, Trajectory, integrate};
use crate::execution::Jit;

/// The residual of a motion that cannot be integrated, rad. It is larger than that of any motion, so that such
/// steps are rejected.
const REFUSED: f64 = 1e3;
/// If a singular value is less than this fraction of the largest, for columns of length one, the unknowns
/// cannot be distinguished.
const TELLING: f64 = 1e-9;
/// An unknown that changes what was measured by less than this, rad, root mean square, has no effect.
const IDLE: f64 = 1e-10;

/// The problem at one set of unknowns: free parameters, independent coordinates, speeds.
pub struct Candidate<'p> {
    problem: &'p Problem<'p>,
    system: Jit,
    start: &'p Start,
    near: &'p [f64],
    steps: usize,
    unknowns: DVector<f64>,
    /// The number of samples that are compared.
    samples: usize,
    motion: Option<Trajectory>,
    /// The deviations of the motion from the record, by sample, NU each.
    deviations: Vec<Vec<f64>>,
}

impl<'p> Candidate<'p> {
    /// The motion for these unknowns, at all samples.
    pub fn new(
        problem: &'p Problem<'p>,
        start: &'p Start,
        near: &'p [f64],
        steps: usize,
        unknowns: &DVector<f64>,
    ) -> Self {
        let mut candidate = Self {
            problem,
            system: problem.system.clone(),
            start,
            near,
            steps,
            unknowns: unknowns.clone(),
            samples: problem.record.t.len(),
            motion: None,
            deviations: Vec::new(),
        };
        candidate.set_params(unknowns);
        candidate
    }

    /// Compares the first samples only.
    pub fn shorten(&mut self, samples: usize) {
        self.samples = samples;
        self.simulate();
    }

    /// Integrates the motion and compares it with the record.
    fn simulate(&mut self) {
        self.motion = self.integrate().ok();
        let motion = self.motion.iter().flat_map(|motion| &motion.q);
        let pairs = self.problem.record.q.iter().zip(motion);
        self.deviations = pairs.map(|(seen, found)| self.deviation(seen, found)).collect();
    }

    /// The deviation of one q from another, NU.
    fn deviation(&self, from: &[f64], to: &[f64]) -> Vec<f64> {
        let mut deviation = self.system.speeds();
        write_deviation(&self.system, from, to, &mut deviation);
        deviation
    }

    /// The mechanism with the parameters of the candidate.
    pub fn system(&self) -> &Jit {
        &self.system
    }

    /// The root mean square of the residuals, rad.
    pub fn rms(&self) -> f64 {
        let residuals = self.residuals().unwrap_or_default();
        (residuals.norm_squared() / residuals.len().max(1) as f64).sqrt()
    }

    /// The root mean square of the residuals, divided by that of the measured distance from the first sample.
    pub fn share(&self) -> f64 {
        let rows = self.problem.record.q.iter().take(self.samples);
        let gone: Vec<_> = rows.map(|q| self.deviation(&self.problem.record.q[0], q)).collect();
        let measured = self.problem.measured(self.samples);
        let gone = measured.map(|(sample, k)| {
            let gone = gone[sample][k];
            if gone.is_nan() { 0.0 } else { gone * gone }
        });
        let count = self.problem.measured(self.samples).count().max(1) as f64;
        self.rms() / (gone.sum::<f64>() / count).sqrt()
    }

    /// The state at the first sample, with its derivatives by the unknowns.
    pub fn begun(&self) -> Result<Begun, Error> {
        let (free, freedoms) = (self.problem.free.len(), self.start.independent.len());
        let (coordinates, speeds) = self.unknowns.as_slice()[free..].split_at(freedoms);
        let rest = vec![0.0; freedoms];
        let speeds = if self.problem.from_rest { &rest } else { speeds };
        let t = self.problem.record.t[0];
        self.start.at(&self.system, t, self.near, coordinates, speeds)
    }

    fn integrate(&self) -> Result<Trajectory, Error> {
        let begun = self.begun()?;
        let (n, parameters) = (begun.u.len(), self.system.parameters().len());
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

    /// The estimates and their standard errors at the minimum.
    pub fn report(&self, evaluations: usize) -> Result<Fit, FitError> {
        let (Some(residuals), Some(jacobian)) = (self.residuals(), self.jacobian()) else {
            let reason = "the motion found cannot be integrated".into();
            return Err(FitError::NoMinimum { evaluations, reason });
        };
        let motion = self.integrate()?;
        let names = self.names();
        let lengths: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
        self.check_effects(&lengths, residuals.len(), &names)?;
        let spread = residuals.len() - self.unknowns.len();
        let variance = residuals.norm_squared() / spread as f64;
        let covariance = covariance(jacobian, &lengths, &names)?;
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
            residuals: self.residuals_by_sample(),
            kept: self.problem.kept().into_iter().map(|(k, _)| k).collect(),
            q: motion.q,
            u: self.begun()?.u,
            evaluations,
        })
    }

    /// Measured minus fitted, by sample, NU each; NaN was not measured.
    fn residuals_by_sample(&self) -> Vec<Vec<f64>> {
        let mut all = vec![vec![f64::NAN; self.system.dimensions().speeds]; self.deviations.len()];
        for (sample, k) in self.problem.measured(self.deviations.len()) {
            all[sample][k] = -self.deviations[sample][k];
        }
        all
    }

    /// Fails where an unknown as large as it is or was hardly moves anything measured, root mean square.
    /// `lengths` are those of the Jacobian's columns.
    fn check_effects(
        &self,
        lengths: &[f64],
        rows: usize,
        names: &[String],
    ) -> Result<(), FitError> {
        let given = self.problem.free.iter().map(|&k| self.problem.system.parameters()[k].abs());
        let sizes = given.chain(std::iter::repeat(1.0)).zip(self.unknowns.iter());
        let rows = (rows as f64).sqrt();
        let is_idle = |(length, (given, found)): (&f64, (f64, &f64))| {
            *length == 0.0 || (given > 0.0 && length * found.abs().max(given) < IDLE * rows)
        };
        match lengths.iter().zip(sizes).position(is_idle) {
            Some(idle) => Err(FitError::Indistinct(format!("`{}`", names[idle]))),
            None => Ok(()),
        }
    }

    /// The names of the unknowns.
    fn names(&self) -> Vec<String> {
        let interface = self.system.interface();
        let free = self.problem.free.iter().map(|&k| interface.parameters[k].name.clone());
        let coordinates = self.start.independent.iter().map(|&k| coordinate(interface, k));
        let speeds = self.start.independent.iter().map(|&k| interface.speed_name(SpeedId(k)));
        let coordinates = coordinates.map(|name| format!("{name} at the start"));
        let speeds = speeds.map(|name| format!("u.{name} at the start"));
        free.chain(coordinates).chain(speeds).take(self.unknowns.len()).collect()
    }
}

/// The name of the coordinate that a component along u moves.
fn coordinate(interface: &Interface, k: usize) -> String {
    match k.checked_sub(interface.joints.len()).map(|beyond| (beyond / SPEEDS, beyond % SPEEDS)) {
        None => format!("q.{}", interface.joints[k].name),
        Some((body, part @ ..3)) => {
            format!("q.{}.{}", interface.free[body].name, COORDINATE_NAMES[part])
        }
        Some((body, part)) => {
            let axis = COORDINATE_NAMES[part - 3];
            format!("the orientation of {} about its {axis}", interface.free[body].name)
        }
    }
}

/// (J^T J)^-1 for columns of length one. Fails where combinations of the unknowns have no effect.
fn covariance(
    mut jacobian: DMatrix<f64>,
    lengths: &[f64],
    names: &[String],
) -> Result<DMatrix<f64>, FitError> {
    for (mut column, length) in jacobian.column_iter_mut().zip(lengths) {
        column /= *length;
    }
    let eigen = (jacobian.transpose() * &jacobian).symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    if eigen.eigenvalues[least] <= TELLING * eigen.eigenvalues.amax() {
        let vector = eigen.eigenvectors.column(least);
        let mixed = names.iter().zip(vector.iter()).filter(|(_, part)| part.abs() > 0.1);
        let mixed: Vec<String> = mixed.map(|(name, _)| format!("`{name}`")).collect();
        return Err(FitError::Indistinct(format!("{} apart", mixed.join(", "))));
    }
    let inverse = DMatrix::from_diagonal(&eigen.eigenvalues.map(|value| 1.0 / value));
    Ok(&eigen.eigenvectors * inverse * eigen.eigenvectors.transpose())
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Candidate<'_> {
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
        self.simulate();
    }

    fn params(&self) -> DVector<f64> {
        self.unknowns.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let measured = self.problem.measured(self.samples);
        let residuals = measured.map(|(sample, k)| match &self.motion {
            Some(_) => self.deviations[sample][k],
            None => REFUSED,
        });
        Some(DVector::from_vec(residuals.collect()))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let motion = self.motion.as_ref()?;
        let measured: Vec<_> = self.problem.measured(self.samples).collect();
        let n = self.system.dimensions().speeds;
        Some(DMatrix::from_fn(measured.len(), self.unknowns.len(), |row, column| {
            let (sample, k) = measured[row];
            let direction = &motion.derivatives[sample][column * n..][..n];
            deviation_rate(&self.system, &self.deviations[sample], direction, k)
        }))
    }
}
