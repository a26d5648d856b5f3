//! Random closed states at which a model is checked.

use std::f64::consts::FRAC_PI_2;

use lamc::pipeline::Compiled;
use lamc::source::free::{COORDINATES, unit};
use lamc_runtime::{Mechanism, assemble, project};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};

use super::maximal::{Massless, Solution, solve};
use super::{Remark, Settings, Values};
use crate::execution::Jit;

/// The coordinates of a free body as drawn.
const DRAWN: [f64; COORDINATES] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];

/// Guesses per state that is asked for.
const GUESSES: usize = 30;

/// Largest angle of a guess where the joint has no limits, rad, and largest speed, rad/s.
const ANGLE: f64 = 1.2;
const SPEED: f64 = 3.0;

/// Decades between the largest and the smallest angles of every other guess: designs start flat.
const DECADES: f64 = 4.0;

/// Largest input: inputs have any unit.
const INPUT: f64 = 1e-3;

/// States with a singular value of the hinges' equations between these shares of the largest are left out:
/// there the rank is a decision, not a fact.
const DOUBTFUL: std::ops::Range<f64> = 1e-13..1e-5;

/// States at which the loops are closed, with what the independent formulation says there.
pub fn closed(compiled: &Compiled, settings: &Settings) -> Result<Vec<(Values, Solution)>, Remark> {
    let mut draw = Draw::new(compiled, settings.seed);
    let mut states = Vec::new();
    let mut add = |values: Option<Values>| {
        let Some(values) = values else { return Ok(()) };
        let solution = solve(&compiled.topology.mechanism, &values).map_err(|massless| {
            let Massless(body) = massless;
            let name = &compiled.topology.mechanism.bodies[body].name;
            Remark::NotChecked(format!(
                "`{name}` has no moment of inertia about some axis, which the comparison needs"
            ))
        })?;
        let is_doubtful = solution.spectrum.iter().any(|value| DOUBTFUL.contains(value));
        // Where a formula of the model has no value, there is nothing to compare.
        if !is_doubtful && solution.acceleration.iter().all(|value| value.is_finite()) {
            states.push((values, solution));
        }
        Ok(())
    };
    add(draw.flat())?;
    for _ in 0..GUESSES * settings.states {
        add(draw.state())?;
        if draw.found >= settings.states {
            break;
        }
    }
    if states.is_empty() {
        return Err(Remark::NotChecked(
            "no closed state was found away from singular ones at which all formulas have a value"
                .into(),
        ));
    }
    Ok(states)
}

/// Draws states of a model.
struct Draw<'a> {
    compiled: &'a Compiled,
    system: Jit,
    random: ChaCha8Rng,
    /// States found so far.
    found: usize,
}

impl<'a> Draw<'a> {
    fn new(compiled: &'a Compiled, seed: u64) -> Self {
        let (system, random) = (Jit::new(&compiled.program), ChaCha8Rng::seed_from_u64(seed));
        Self { compiled, system, random, found: 0 }
    }

    /// A uniform number.
    fn between(&mut self, least: f64, greatest: f64) -> f64 {
        let share = (self.random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        least + (greatest - least) * share
    }

    fn values(&self, t: f64, q: Vec<f64>, u: Vec<f64>) -> Values {
        let parameters = self.compiled.topology.mechanism.parameters.iter();
        Values {
            parameters: parameters.map(|parameter| parameter.value).collect(),
            inputs: self.system.inputs().to_vec(),
            t,
            q,
            u,
        }
    }

    /// The flat state at rest at t = 0, if the model can be there.
    fn flat(&mut self) -> Option<Values> {
        let n = self.system.interface().joints.len();
        let moves = |joint: usize| {
            let [least, greatest] = self.system.limits(joint);
            !(least..=greatest).contains(&0.0)
        };
        let is_driven = !self.system.interface().driven().is_empty();
        let d = self.system.dimensions();
        let free = self.system.interface().free.iter().flat_map(|_| DRAWN);
        let q = std::iter::repeat_n(0.0, n).chain(free).collect();
        (!is_driven && !(0..n).any(moves)).then(|| self.values(0.0, q, vec![0.0; d.speeds]))
    }

    /// A random closed state; none where this guess leads nowhere.
    fn state(&mut self) -> Option<Values> {
        let n = self.system.interface().joints.len();
        let names = self.system.interface().inputs.clone();
        for name in names {
            let value = self.between(-INPUT, INPUT);
            // The name is the program's own.
            let _ = self.system.set_input(&name, value);
        }
        let t = self.between(0.0, 1.0);
        let near_flat = self.found % 2 == 1;
        let exponent = if near_flat { self.between(-DECADES, 0.0) } else { 0.0 };
        let angle = ANGLE * 10_f64.powf(exponent);
        let mut q: Vec<f64> = (0..n)
            .map(|joint| {
                let [least, greatest] = self.system.limits(joint);
                let (least, greatest) = (least.max(-FRAC_PI_2), greatest.min(FRAC_PI_2));
                match least < greatest {
                    true => self
                        .between(least.max(-angle).min(greatest), greatest.min(angle).max(least)),
                    false => least,
                }
            })
            .collect();
        let d = self.system.dimensions();
        for _ in 0..self.system.interface().free.len() {
            let orientation: [f64; 4] = std::array::from_fn(|_| self.between(-1.0, 1.0));
            let place: [f64; 3] = std::array::from_fn(|_| self.between(-1.0, 1.0));
            let size = self.system.interface().size;
            q.extend(place.map(|x| x * size));
            q.extend(unit(orientation).unwrap_or([1.0, 0.0, 0.0, 0.0]));
        }
        let mut u: Vec<f64> = (0..d.speeds).map(|_| self.between(-SPEED, SPEED)).collect();
        let mut workspace = self.system.workspace();
        assemble(&self.system, t, &mut q, &vec![false; n], &mut workspace).ok()?;
        project(&self.system, t, &mut q, &mut u, &mut workspace).ok()?;
        self.found += 1;
        Some(self.values(t, q, u))
    }
}
