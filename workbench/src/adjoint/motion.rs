//! A whole motion with fixed steps, and the way back over it.

use std::cell::RefCell;

use lamc::arithmetic::larger;
use lamc::program::FunctionKind;
use lamc_runtime::State;

use super::differentiated::{Adjoints, At, Differentiated, Undifferentiable};
use super::steps::{Method, Stepper};

/// Numbers of the record that are kept at most: 64 MB. A longer motion is repeated in pieces on the way back.
const MOST_NUMBERS: usize = 8_000_000;

/// Most steps from one sample to the next that [`Course::accurate`] takes.
pub const MOST_STEPS: usize = 4096;

/// The state of a motion.
pub type Sample = State<Vec<f64>, f64>;

/// What is integrated.
#[derive(Clone, Copy, Debug)]
pub struct Schedule<'a> {
    /// How.
    pub method: Method,
    /// The times of the samples after the initial time, ascending, s.
    pub samples: &'a [f64],
    /// Equal steps from one sample to the next.
    pub steps: usize,
    /// The inputs until each sample, from the one before; those of the mechanism if there are none.
    pub inputs: &'a [Vec<f64>],
}

/// A motion at samples, which can be differentiated.
pub struct Course {
    differentiated: Differentiated,
    /// With the record of the motion, if it has one piece only.
    stepper: RefCell<Stepper>,
    /// The time at each step's end, s.
    times: Vec<f64>,
    /// From one sample to the next.
    steps: usize,
    /// Until each sample.
    inputs: Vec<Vec<f64>>,
    /// The states at the samples; the first is the initial state.
    pub samples: Vec<Sample>,
    /// Steps before which the record was forgotten, and the states there, beginning with the first.
    pieces: Vec<(usize, Sample)>,
}

/// How a number depends on a motion directly: its derivatives by what there is at each sample. An empty list stands for zeros.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Slopes {
    /// By q and then by u, NQ + NU for each sample.
    pub states: Vec<Vec<f64>>,
    /// By the output points, three for each point, for each sample.
    pub points: Vec<Vec<f64>>,
    /// By the kinetic and the potential energy, for each sample.
    pub energies: Vec<[f64; 2]>,
}

/// The derivatives of a number that depends on a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Gradient {
    /// By the initial coordinates, NQ, 1/rad. Those of a quaternion are by its four numbers.
    pub q: Vec<f64>,
    /// By the initial speeds before they were projected, NU.
    pub u: Vec<f64>,
    /// By the parameters, in their order, also through the drawing.
    pub parameters: Vec<f64>,
    /// By the inputs until each sample, in their order. Their sum is the derivative by constant inputs.
    pub inputs: Vec<Vec<f64>>,
}

impl Course {
    /// Integrates from a state whose loops are closed, after its speeds were projected.
    ///
    /// # Errors
    /// [`Undifferentiable`].
    pub fn new(
        differentiated: &Differentiated,
        start: Sample,
        schedule: Schedule<'_>,
    ) -> Result<Self, Undifferentiable> {
        let Schedule { method, samples, steps, inputs } = schedule;
        let mut times = Vec::with_capacity(samples.len() * steps);
        let mut begin = start.t;
        for end in samples {
            times.extend((1..steps).map(|step| {
                let share = step as f64 / steps as f64;
                begin + (end - begin) * share
            }));
            times.push(*end);
            begin = *end;
        }
        let held = || differentiated.system.inputs().to_vec();
        let given = |index: usize| inputs.get(index).cloned().unwrap_or_else(held);
        let mut course = Self {
            differentiated: differentiated.clone(),
            stepper: RefCell::new(Stepper::new(differentiated.clone(), method)),
            times,
            steps,
            inputs: (0..samples.len()).map(given).collect(),
            samples: Vec::with_capacity(samples.len() + 1),
            pieces: vec![(0, start)],
        };
        course.run(MOST_NUMBERS)?;
        Ok(course)
    }

    /// As [`new`](Self::new), with as many steps as keep the error at the samples within a tolerance, rad and rad/s: twice as many, until
    /// that changes no more than it allows.
    ///
    /// # Errors
    /// [`Undifferentiable`]; [`Undifferentiable::TooManySteps`].
    pub fn accurate(
        differentiated: &Differentiated,
        start: &Sample,
        schedule: Schedule<'_>,
        tolerance: f64,
    ) -> Result<Self, Undifferentiable> {
        let order = match schedule.method {
            Method::Rk4 | Method::Rodas => 4,
            Method::Euler => 1,
        };
        // The error of the finer motion, of the difference of both.
        let share = 1.0 / f64::from((1 << order) - 1);
        let at = |steps| Self::new(differentiated, start.clone(), Schedule { steps, ..schedule });
        let mut coarse = at(1);
        let mut steps = 2;
        while steps <= MOST_STEPS {
            let fine = at(steps);
            if let (Ok(coarse), Ok(found)) = (&coarse, &fine) {
                let pairs = coarse.samples.iter().zip(&found.samples);
                let error = pairs.map(|(a, b)| difference(a, b)).fold(0.0, larger);
                if share * error <= tolerance {
                    return fine;
                }
            }
            (coarse, steps) = (fine, 2 * steps);
        }
        coarse.and(Err(Undifferentiable::TooManySteps))
    }

    /// Runs, and begins a new piece when the record has `most` numbers.
    pub(super) fn run(&mut self, most: usize) -> Result<(), Undifferentiable> {
        self.pieces.truncate(1);
        self.samples.clear();
        let mut state = self.pieces[0].1.clone();
        let mut stepper = self.stepper.borrow_mut();
        stepper.forget();
        stepper.project(&mut state)?;
        self.samples.push(state.clone());
        for index in 0..self.times.len() {
            if stepper.recorded() > most {
                stepper.forget();
                self.pieces.push((index, state.clone()));
            }
            self.step(&mut stepper, &mut state, index)?;
            if (index + 1) % self.steps == 0 {
                self.samples.push(state.clone());
            }
        }
        Ok(())
    }

    /// Takes a step.
    fn step(
        &self,
        stepper: &mut Stepper,
        state: &mut Sample,
        index: usize,
    ) -> Result<(), Undifferentiable> {
        stepper.set_inputs(&self.inputs[index / self.steps]);
        stepper.step(state, self.times[index] - state.t)?;
        state.t = self.times[index];
        Ok(())
    }

    /// The derivatives of some numbers.
    ///
    /// # Errors
    /// [`Undifferentiable::NotFinite`].
    pub fn pull(&self, numbers: &[Slopes]) -> Result<Vec<Gradient>, Undifferentiable> {
        let layout = self.differentiated.layout;
        let mut pulled: Vec<Pulled> = numbers
            .iter()
            .map(|_| Pulled {
                adjoints: Adjoints::zeros(layout),
                inputs: vec![Vec::new(); self.inputs.len()],
            })
            .collect();
        let mut stepper = self.stepper.borrow_mut();
        stepper.rewind();
        let mut end = self.times.len();
        for (begin, state) in self.pieces.iter().rev() {
            if self.pieces.len() > 1 {
                stepper.forget();
                let mut state = state.clone();
                if *begin == 0 {
                    stepper.project(&mut state)?;
                }
                (*begin..end).try_for_each(|index| self.step(&mut stepper, &mut state, index))?;
            }
            for index in (*begin..end).rev() {
                let interval = index / self.steps;
                if (index + 1) % self.steps == 0 {
                    stepper.set_inputs(&self.inputs[interval]);
                    self.add(&stepper, interval + 1, numbers, &mut pulled);
                }
                stepper.pull(pulled.iter_mut().map(|pulled| &mut pulled.adjoints));
                if index % self.steps == 0 {
                    for Pulled { adjoints, inputs } in &mut pulled {
                        let own = &mut adjoints.rest[layout.parameters..][..layout.inputs];
                        inputs[interval] = own.to_vec();
                        own.fill(0.0);
                    }
                }
            }
            end = *begin;
        }
        self.add(&stepper, 0, numbers, &mut pulled);
        stepper.pull(pulled.iter_mut().map(|pulled| &mut pulled.adjoints));
        let gradient = |Pulled { adjoints, inputs }| {
            let mut gradient = self.differentiated.gradient(adjoints)?;
            gradient.inputs = inputs;
            match gradient.inputs.iter().flatten().all(|x| x.is_finite()) {
                true => Ok(gradient),
                false => Err(Undifferentiable::NotFinite),
            }
        };
        pulled.into_iter().map(gradient).collect()
    }
}

impl Course {
    /// Adds the direct derivatives at a sample to the adjoints.
    fn add(&self, stepper: &Stepper, sample: usize, numbers: &[Slopes], pulled: &mut [Pulled]) {
        let State { t, q, u } = &self.samples[sample];
        let at = At { t: *t, q, u };
        let on = stepper.differentiated();
        for (Pulled { adjoints, .. }, Slopes { states, points, energies }) in
            pulled.iter_mut().zip(numbers)
        {
            if let Some(slopes) = states.get(sample) {
                adjoints.state.iter_mut().zip(slopes).for_each(|(sum, slope)| *sum += slope);
            }
            if let Some(slopes) = points.get(sample) {
                on.pull(FunctionKind::Points, at, slopes, adjoints);
            }
            if let Some(slopes) = energies.get(sample) {
                on.pull(FunctionKind::Energy, at, slopes, adjoints);
            }
        }
    }
}

/// The largest difference of two states.
fn difference(a: &Sample, b: &Sample) -> f64 {
    let pairs = a.q.iter().zip(&b.q).chain(a.u.iter().zip(&b.u));
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, larger)
}

/// What is known of a number on the way back.
struct Pulled {
    adjoints: Adjoints,
    /// Derivatives by the inputs, until each sample.
    inputs: Vec<Vec<f64>>,
}

impl Differentiated {
    /// The adjoints as derivatives, with one row for the inputs; those of the drawing as derivatives by the parameters.
    pub(super) fn gradient(&self, mut adjoints: Adjoints) -> Result<Gradient, Undifferentiable> {
        let layout = self.layout;
        let drawing = adjoints.rest.split_off(layout.parameters + layout.inputs);
        adjoints.rest.resize(layout.rest(), 0.0);
        let at = At { t: 0.0, q: &[], u: &[] };
        self.pull(FunctionKind::Drawing, at, &drawing, &mut adjoints);
        if adjoints.state.iter().chain(&adjoints.rest).any(|x| !x.is_finite()) {
            return Err(Undifferentiable::NotFinite);
        }
        let Adjoints { state, mut rest } = adjoints;
        rest.truncate(layout.parameters + layout.inputs);
        let inputs = vec![rest.split_off(layout.parameters)];
        let (q, u) = state.split_at(layout.coordinates);
        Ok(Gradient { q: q.to_vec(), u: u.to_vec(), parameters: rest, inputs })
    }
}
