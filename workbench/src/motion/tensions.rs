//! The tensions of springs between points and of tendons, from the formulas of the model and the places of its points,
//! independent of the equations of motion:
//!
//! ```text
//! T = k (l - l0) + b dl/dt     or a given law     0 where it cannot push
//! ```
//!
//! dl/dt is the derivative of the length l along the speeds, by central differences of order 6.

use lamc::laminate::{self, Tendon, Tension};
use lamc::source::Expression;
use lamc::source::free::SPEEDS;
use lamc_runtime::{Error, Mechanism, State};

/// By how much the joints and bodies turn altogether, rad, from the state to the nearest place of a difference. The
/// seventh derivative of a length adds 4e-13 of the first, and rounding as little.
const TURN: f64 = 0.02;
/// The weights of these differences, from near to far.
const WEIGHTS: [f64; 3] = [45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0];

/// The springs between points and the tendons of a mechanism, in the order of the file.
#[derive(Clone, Debug, Default)]
pub struct Tensions {
    tendons: Vec<Tendon>,
}

impl Tensions {
    /// Those of a mechanism.
    pub fn new(mechanism: &laminate::Mechanism) -> Self {
        Self { tendons: mechanism.elements.tendons.clone() }
    }

    /// Their names, with the key under which they stand in the file: `springs.band`, `tendons.flexor`.
    pub fn names(&self) -> impl Iterator<Item = String> {
        self.tendons.iter().map(|tendon| {
            let key = if tendon.is_spring { "springs" } else { "tendons" };
            format!("{key}.{}", tendon.name)
        })
    }

    /// The tensions at a state with these parameters and inputs, N; negative where a spring pushes.
    ///
    /// # Errors
    /// Those of [`points`](lamc_runtime::Mechanism::points).
    pub fn at<Y>(
        &self,
        system: &Y,
        settings: (&[f64], &[f64]),
        state: &State<Vec<f64>, f64>,
    ) -> Result<Vec<f64>, Error>
    where
        Y: Mechanism<Scalar = f64, Coordinates = Vec<f64>, Speeds = Vec<f64>>,
    {
        if self.tendons.is_empty() {
            return Ok(Vec::new());
        }
        let points = system.points(&state.q)?;
        let tensions = self.tendons.iter().map(|tendon| {
            let of = |law: &Expression| value(law, settings, state);
            match &tendon.tension {
                Tension::Given(law) => Ok(of(law).max(0.0)),
                Tension::Elastic { stiffness, damping, rest_length, tension_only } => {
                    let stretch = length(tendon, points.as_ref()) - of(rest_length);
                    let viscous = match *damping == Expression::ZERO {
                        true => 0.0,
                        false => of(damping) * rate(tendon, system, state)?,
                    };
                    let tension = of(stiffness) * stretch + viscous;
                    Ok(match tension_only {
                        true if stretch < 0.0 => 0.0,
                        true => tension.max(0.0),
                        false => tension,
                    })
                }
            }
        });
        tensions.collect()
    }
}

fn value(
    law: &Expression,
    (parameters, inputs): (&[f64], &[f64]),
    State { t, q, u }: &State<Vec<f64>, f64>,
) -> f64 {
    law.evaluate(&|leaf: &Expression| match *leaf {
        Expression::Time => *t,
        Expression::Parameter(id) => parameters[id.index()],
        Expression::Input(id) => inputs[id.index()],
        Expression::Position(id) => q[id.index()],
        Expression::Rate(id) => u[id.index()],
        _ => f64::NAN,
    })
}

/// The length of a line through points (m), m.
fn length(tendon: &Tendon, points: &[[f64; 3]]) -> f64 {
    let distance = |[from, to]: [&[f64; 3]; 2]| {
        (0..3).map(|axis| (to[axis] - from[axis]).powi(2)).sum::<f64>().sqrt()
    };
    let at = |place: usize| &points[tendon.through[place].index()];
    (1..tendon.through.len()).map(|end| distance([at(end - 1), at(end)])).sum()
}

/// The rate of change of the length of a line, m/s.
fn rate<Y>(tendon: &Tendon, system: &Y, state: &State<Vec<f64>, f64>) -> Result<f64, Error>
where
    Y: Mechanism<Scalar = f64, Coordinates = Vec<f64>, Speeds = Vec<f64>>,
{
    let (joints, size) = (system.dimensions().joints, system.size());
    let turns = state.u.iter().enumerate().map(|(speed, u)| {
        let is_linear = speed >= joints && (speed - joints) % SPEEDS < SPEEDS / 2;
        if is_linear { u.abs() / size } else { u.abs() }
    });
    let speed: f64 = turns.sum();
    if speed == 0.0 {
        return Ok(0.0);
    }
    let h = TURN / speed;
    let length_after = |dt: f64| {
        let mut q = state.q.clone();
        let step: Vec<f64> = state.u.iter().map(|u| dt * u).collect();
        system.advance(&mut q, &step);
        Ok(length(tendon, system.points(&q)?.as_ref()))
    };
    let mut rate = 0.0;
    for (number, weight) in WEIGHTS.into_iter().enumerate() {
        let dt = (number + 1) as f64 * h;
        rate += weight * (length_after(dt)? - length_after(-dt)?) / h;
    }
    Ok(rate)
}
