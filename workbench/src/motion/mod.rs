//! A sampled motion: `lamc simulate` records it, and tables, pictures and pages are made from it.

mod audit;
mod csv;
mod npz;
mod tensions;
#[cfg(test)]
mod tests;
mod work;

pub use audit::{Audit, Gain};
pub use tensions::Tensions;
pub use work::Work;

use lamc_runtime::{Energy, Error, Mechanism, State, acceleration_in_motion};

use lamc::arithmetic::largest;
use lamc::program::Interface;

/// A sampled motion. SI and radians.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// The model's name.
    pub name: String,
    /// What [`Sample::t`] is.
    pub course: Course,
    /// Joints, in the order of q and u.
    pub joints: Vec<String>,
    /// Free bodies: q and u go on with theirs.
    pub free: Vec<String>,
    /// Bodies, in the order of [`Sample::poses`].
    pub bodies: Vec<String>,
    /// Points, in the order of [`Sample::points`].
    pub points: Vec<String>,
    /// Contact points, in the order of [`Sample::contacts`].
    pub contacts: Vec<String>,
    /// Springs between points and tendons, in the order of [`Sample::tensions`].
    pub tensions: Vec<String>,
    /// Inputs that controllers drive, in the order of [`Sample::inputs`].
    pub inputs: Vec<String>,
    /// Diagonal of the flat bounding box, m.
    pub size: f64,
    /// By ascending time.
    pub samples: Vec<Sample>,
    /// Whether the samples reach the intended end. They do not if the integration failed or
    /// was interrupted.
    pub complete: bool,
}

/// What the samples of a motion follow each other by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Course {
    /// Time, s.
    #[default]
    Time,
    /// The progress of a fold, percent.
    Progress,
}

impl Course {
    /// Returns its name for labels.
    pub fn name(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Progress => "progress",
        }
    }

    /// Returns its unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Time => "s",
            Self::Progress => "%",
        }
    }

    /// Returns how much of it a second of a video shows: a whole fold takes five seconds.
    pub fn per_second(self) -> f64 {
        match self {
            Self::Time => 1.0,
            Self::Progress => 20.0,
        }
    }
}

/// The state of a mechanism at one time, with what follows from it.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Time, s, or what the motion's [`Course`] is.
    pub t: f64,
    /// q: the angles of the joints, rad, then the positions (m) and quaternions of the free bodies.
    pub q: Vec<f64>,
    /// u: the speeds of the joints, rad/s, then those of the free bodies, m/s and rad/s.
    pub u: Vec<f64>,
    /// du/dt, per second.
    pub acceleration: Vec<f64>,
    /// The energies of the whole mechanism, J.
    pub energy: Energy<f64>,
    /// Largest component of the closure residuals, m.
    pub closure: f64,
    /// Positions in the base frame, m.
    pub points: Vec<[f64; 3]>,
    /// The poses of all bodies, including the fixed ones.
    pub poses: Vec<Pose>,
    /// Position, m, of each contact point, and the force on its body, N, in the base frame.
    pub contacts: Vec<[f64; 6]>,
    /// Tension of each spring between points and each tendon, N.
    pub tensions: Vec<f64>,
    /// Each input that a controller drives, from this time on, SI.
    pub inputs: Vec<f64>,
}

/// The pose of a body: the point drawn at x lies at R x + p in the base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// R, by row.
    pub rotation: [[f64; 3]; 3],
    /// p, m.
    pub translation: [f64; 3],
}

impl Motion {
    /// Creates a motion without samples.
    pub fn new(interface: &Interface) -> Self {
        Self {
            name: interface.name.clone(),
            course: Course::Time,
            joints: interface.joints.iter().map(|joint| joint.name.clone()).collect(),
            free: interface.free.iter().map(|body| body.name.clone()).collect(),
            bodies: interface.bodies.iter().map(|body| body.name.clone()).collect(),
            points: interface.points.clone(),
            contacts: interface.contacts.clone(),
            tensions: Vec::new(),
            inputs: Vec::new(),
            size: interface.size,
            samples: Vec::new(),
            complete: true,
        }
    }

    /// Evaluates a state of the mechanism and adds it as a sample.
    ///
    /// # Errors
    /// Those of [`acceleration_in_motion`].
    pub fn record<Y>(&mut self, system: &Y, state: &State<Vec<f64>, f64>) -> Result<(), Error>
    where
        Y: Mechanism<Scalar = f64, Coordinates = Vec<f64>, Speeds = Vec<f64>>,
    {
        let State { t, q, u } = state.clone();
        let d = system.dimensions();
        let mut rates = vec![0.0; d.speeds];
        let mut workspace = system.workspace();
        acceleration_in_motion(system, t, &q, &u, workspace.as_mut(), &mut rates)?;
        let mut residual = vec![0.0; 9 * d.loops];
        system.write_closure(&q, &mut residual, &mut vec![0.0; 9 * d.loops * d.speeds])?;
        let mut contacts = vec![[0.0; 6]; d.contacts];
        system.write_contacts(t, &q, &u, contacts.as_flattened_mut())?;
        self.samples.push(Sample {
            t,
            acceleration: rates,
            energy: system.energy(t, &q, &u)?,
            closure: largest(&residual),
            points: system.points(&q)?.as_ref().to_vec(),
            poses: system.poses(&q)?.as_ref().iter().map(Pose::from).collect(),
            contacts,
            tensions: Vec::new(),
            inputs: Vec::new(),
            q,
            u,
        });
        Ok(())
    }
}

impl From<&[f64; 12]> for Pose {
    /// R row-major, then p.
    fn from(numbers: &[f64; 12]) -> Self {
        let [a, b, c, d, e, f, g, h, i, translation @ ..] = *numbers;
        Self { rotation: [[a, b, c], [d, e, f], [g, h, i]], translation }
    }
}
