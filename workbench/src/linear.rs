//! Small motions about an equilibrium, and its stability.
//!
//! Static stability is that of the potential: the symmetric part of the stiffness is positive, so
//! that every small displacement is opposed. Dynamic stability is that of the motion: no mode of
//! the linearised motion grows, including torques without a potential. A follower force or a torque
//! along the speed affects only the second; if all forces have a potential and dampers remove
//! energy, both are equivalent.

mod modes;
mod neutral;

use std::f64::consts::TAU;
use std::fmt::Write;

use lamc::arithmetic::largest;
use lamc::laminate::{Kink, Mechanism, kinks};
use lamc::source::Expression;
use lamc_runtime::{Error, LinearizationMut, Mechanism as _, State, Stopped, linearize, project};
use nalgebra::{Complex, DMatrix};
use serde::Serialize;

use crate::execution::Jit;
use modes::modes;

/// A real part of an eigenvalue below this fraction of the fastest is a rounding error.
const ROUNDING: f64 = 1e-9;
/// Units in the last place that rounding makes of a stiffness, per direction.
const STIFFNESS_ROUNDING: f64 = 64.0;

/// The method of order 4 is unstable for every larger product of eigenvalue and step.
const RK4_REACH: f64 = 4.0;
/// Resolution of the search for the limit.
const RK4_STEPS: usize = 4000;

/// dx/dt = A x + B i with x = (z, dz/dt) and q = q0 + T z; of free bodies, T z are steps along their speeds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Linear {
    /// T, NU x d: a row for each speed.
    pub basis: Vec<Vec<f64>>,
    /// A, 2 d x 2 d.
    pub a: Vec<Vec<f64>>,
    /// B, 2 d x inputs.
    pub b: Vec<Vec<f64>>,
}

/// A small motion in which all joints swing or decay alike.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mode {
    /// Of the eigenvalue, 1/s; its imaginary part is not negative.
    pub eigenvalue: [f64; 2],
    /// Undamped, Hz.
    pub frequency: f64,
    /// 1: just no oscillation; more: two modes without; less than 0: it grows.
    pub damping_ratio: f64,
    /// Of the speeds, the largest made 1: real and imaginary parts.
    pub shape: Vec<[f64; 2]>,
}

/// Stability of an equilibrium.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Stability {
    /// Both.
    pub stable: bool,
    /// The potential is at a minimum.
    pub statically_stable: bool,
    /// No small motion grows.
    pub dynamically_stable: bool,
    /// The potential is at no maximum or saddle either: some small displacements change it by rounding only, as
    /// when a robot is pushed along the ground that it stands on. No small motion grows.
    pub neutral: bool,
}

/// A kink of a law, as in JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct KinkReport {
    law: String,
    by: &'static str,
    slopes: [f64; 2],
}

/// Linearised motion about an equilibrium.
#[derive(Clone, Debug, PartialEq)]
pub struct Motions {
    /// The linear system.
    pub linear: Linear,
    /// Its modes, slowest first, without those along neutral directions: nothing brings these back, and the eigenvalue
    /// that is found in place of zero is rounding.
    pub modes: Vec<Mode>,
    /// Whether the equilibrium is stable.
    pub stability: Stability,
    /// Laws that are not linear at the equilibrium.
    pub kinks: Vec<KinkReport>,
    /// What limits these results, a sentence each.
    pub warnings: Vec<String>,
}

impl Motions {
    /// About a state of rest, of which the potential says whether it is a minimum. Laws that are not
    /// linear there are warned of; where one has a kink, stable is what is so on either side.
    ///
    /// # Errors
    /// Those of [`linearize`].
    pub fn about(
        mechanism: &Mechanism,
        system: &Stopped<Jit>,
        state: &State<Vec<f64>, f64>,
        is_minimum: bool,
    ) -> Result<Self, Error> {
        let linear = linear(system, state)?;
        let modes = modes(&linear);
        let settings = (system.system.parameters(), system.system.inputs());
        let directions = linear.directions();
        let found = kinks(mechanism, settings, state.t, &state.q, &directions);
        let mut is_static = is_minimum;
        let mut is_dynamic = !grows(&linear, &modes);
        let mut warnings = Vec::new();
        for kink in &found {
            let is_decided = !kink.by_speed;
            let told = match is_decided {
                true => "it is stable only if it is stable on both sides",
                false => "modes and dynamic stability are valid for one side only",
            };
            warnings.push(format!("{kink}: {told}"));
            for side in [-1.0, 1.0].into_iter().filter(|_| is_decided) {
                let mut beside = state.clone();
                let reach = side * Kink::REACH;
                let step: Vec<f64> = kink.direction.iter().map(|by| reach * by).collect();
                let State { t, q, u } = &mut beside;
                system.advance(q, &step);
                project(system, *t, q, u, &mut system.workspace())?;
                let there = self::linear(system, &beside)?;
                is_static &= there.least_stiffness() > 1.0;
                is_dynamic &= !grows(&there, &self::modes(&there));
            }
        }
        warnings.extend(friction_at_rest(mechanism, settings.0));
        let is_flat = found.is_empty() && linear.least_stiffness() >= -1.0;
        let kinks = found.into_iter().map(|Kink { law, by_speed, derivatives, .. }| KinkReport {
            law,
            by: if by_speed { "u" } else { "q" },
            slopes: derivatives,
        });
        let stability = Stability {
            neutral: !is_static && is_dynamic && is_flat,
            stable: is_static && is_dynamic,
            statically_stable: is_static,
            dynamically_stable: is_dynamic,
        };
        let least = linear.least_eigenvalue();
        let modes = modes.into_iter().filter(|mode| mode.norm() > least).collect();
        Ok(Self { kinks: kinks.collect(), linear, modes, stability, warnings })
    }

    /// Static and dynamic stability, a line each.
    pub fn lines(&self) -> String {
        let Stability { statically_stable, dynamically_stable, neutral, .. } = self.stability;
        let mut text = match (statically_stable, neutral) {
            (true, _) => "statically stable: every small displacement is opposed\n",
            (_, true) => {
                "statically neutral: a small displacement is not opposed, and none grows\n"
            }
            _ => "statically unstable: a small displacement is not opposed\n",
        }
        .to_owned();
        let growth = |mode: &&Mode| mode.eigenvalue[0];
        let fastest = self.modes.iter().max_by(|a, b| growth(a).total_cmp(&growth(b)));
        let _ = match fastest.filter(|mode| growth(mode) > 0.0 && !dynamically_stable) {
            Some(mode) if mode.eigenvalue[1] > 0.0 => writeln!(
                text,
                "dynamically unstable: an oscillation of {:.4} Hz grows by {:.4} 1/s",
                mode.eigenvalue[1] / TAU,
                growth(&mode)
            ),
            Some(mode) => {
                writeln!(
                    text,
                    "dynamically unstable: a small motion grows by {:.4} 1/s",
                    growth(&mode)
                )
            }
            None if dynamically_stable => {
                writeln!(text, "dynamically stable: no small motion grows")
            }
            None => writeln!(text, "dynamically unstable: a small motion grows"),
        };
        text
    }
}

impl Mode {
    /// The magnitude of the eigenvalue, 1/s.
    fn norm(&self) -> f64 {
        self.eigenvalue[0].hypot(self.eigenvalue[1])
    }
}

impl Linear {
    /// The directions of z, by speed, their largest component 1.
    fn directions(&self) -> Vec<Vec<f64>> {
        let freedoms = self.a.len() / 2;
        let direction = |k: usize| {
            let column: Vec<f64> = self.basis.iter().map(|row| row[k]).collect();
            let most = largest(&column);
            column.into_iter().map(|x| x / most).collect()
        };
        (0..freedoms).map(direction).collect()
    }

    /// The longest step, s, with which the classical Runge-Kutta method of order 4 lets no motion grow
    /// that does not grow by itself: |1 + z + z^2/2 + z^3/6 + z^4/24| <= 1 for every z = eigenvalue
    /// times step. `None` where nothing swings or decays.
    pub fn longest_rk4_step(&self) -> Option<f64> {
        let factor = |z: Complex<f64>| {
            let one = Complex::from(1.0);
            (one + z * (one + z / 2.0 * (one + z / 3.0 * (one + z / 4.0)))).norm()
        };
        let longest = |mode: &Mode| {
            let [real, imaginary] = mode.eigenvalue;
            let size = real.hypot(imaginary);
            // What does not decay by more than rounding swings.
            let real = if real.abs() <= ROUNDING * size { 0.0 } else { real };
            let direction = Complex::new(real, imaginary) / size;
            let steps = (1..=RK4_STEPS).map(|i| RK4_REACH * i as f64 / RK4_STEPS as f64);
            let stable = |&reach: &f64| factor(direction * reach) <= 1.0 + ROUNDING;
            let reach = (real <= 0.0).then(|| steps.take_while(stable).last())??;
            Some(reach / size)
        };
        let moves = |mode: &&Mode| mode.eigenvalue != [0.0; 2];
        modes(self).iter().filter(moves).filter_map(longest).reduce(f64::min)
    }

    /// K, d x d.
    fn stiffness(&self) -> DMatrix<f64> {
        let d = self.a.len() / 2;
        DMatrix::from_fn(d, d, |i, k| -self.a[d + i][k])
    }

    /// The size, 1/s, up to which an eigenvalue is what rounding of K makes of zero. Two zeros that belong to one
    /// direction are the roots of such a rounding error.
    fn least_eigenvalue(&self) -> f64 {
        let sizes = self.a.len() as f64 * self.stiffness().norm();
        (STIFFNESS_ROUNDING * f64::EPSILON * sizes).sqrt()
    }

    /// The least eigenvalue of the symmetric part of K, over what is rounding; infinite where
    /// nothing can move.
    fn least_stiffness(&self) -> f64 {
        let stiffness = self.stiffness();
        if stiffness.is_empty() {
            return f64::INFINITY;
        }
        let symmetric = 0.5 * (&stiffness + stiffness.transpose());
        let rounding = STIFFNESS_ROUNDING * f64::EPSILON * stiffness.amax();
        symmetric.symmetric_eigenvalues().min() / rounding.max(f64::MIN_POSITIVE)
    }
}

/// Whether a mode grows. Of a mode whose stiffness is rounding the eigenvalue has no sign of its own:
/// there the stiffness decides.
fn grows(linear: &Linear, modes: &[Mode]) -> bool {
    let fastest = largest(modes.iter().map(Mode::norm));
    let least = linear.least_eigenvalue();
    modes.iter().any(|mode| match mode.norm() <= least {
        true => linear.least_stiffness() < -1.0,
        false => mode.eigenvalue[0] > ROUNDING * fastest,
    })
}

/// Friction is smoothed: at rest it is a damper, and nothing sticks. A sentence for each joint and each contact with
/// friction.
fn friction_at_rest<'a>(
    mechanism: &'a Mechanism,
    parameters: &'a [f64],
) -> impl Iterator<Item = String> + 'a {
    let acts = |law: &Expression| law.at(parameters).filter(|value| *value > 0.0);
    let joints = mechanism.joints.iter().filter_map(move |joint| {
        let friction = joint.friction.as_ref()?;
        let torque = acts(&friction.torque)?;
        Some(format!(
            "the friction of `{}` acts at rest as a damper of {:.3e} N m s/rad: this is valid \
             for speeds well below {:.3} deg/s",
            joint.name,
            torque / friction.speed,
            friction.speed.to_degrees()
        ))
    });
    joints.chain(mechanism.contacts.iter().filter_map(move |contact| {
        let friction = acts(&contact.friction)?;
        Some(format!(
            "the friction of the contact `{}` acts at rest as a damper of {:.3e} s/m times the normal force: this \
             is valid for points that slide well below {:.3} mm/s",
            contact.name,
            friction / contact.slip_speed,
            contact.slip_speed * 1e3
        ))
    }))
}

/// The motion about a state of rest.
///
/// # Errors
/// Those of [`linearize`].
pub fn linear(system: &Stopped<Jit>, state: &State<Vec<f64>, f64>) -> Result<Linear, Error> {
    let dimensions = system.dimensions();
    let n = dimensions.speeds;
    let (mut basis, mut stiffness, mut damping) =
        (vec![0.0; n * n], vec![0.0; n * n], vec![0.0; n * n]);
    let mut inputs = vec![0.0; n * dimensions.inputs];
    let out = LinearizationMut {
        basis: &mut basis,
        stiffness: &mut stiffness,
        damping: &mut damping,
        inputs: &mut inputs,
    };
    let d = linearize(system, state.t, &state.q, &mut system.workspace(), out)?;
    let below = |matrix: &[f64], row: usize| matrix[row * d..(row + 1) * d].to_vec();
    let negative = |row: Vec<f64>| row.into_iter().map(|x| -x).collect::<Vec<_>>();
    let mut a = Vec::new();
    for row in 0..d {
        let unit = (0..d).map(|k| f64::from(u8::from(k == row)));
        a.push(vec![0.0; d].into_iter().chain(unit).collect());
    }
    for row in 0..d {
        let mut line = negative(below(&stiffness, row));
        line.extend(negative(below(&damping, row)));
        a.push(line);
    }
    let mut b = vec![vec![0.0; dimensions.inputs]; d];
    b.extend(
        (0..d).map(|row| inputs[row * dimensions.inputs..(row + 1) * dimensions.inputs].to_vec()),
    );
    let basis = (0..n).map(|speed| (0..d).map(|k| basis[k * n + speed]).collect()).collect();
    Ok(Linear { basis, a, b })
}
