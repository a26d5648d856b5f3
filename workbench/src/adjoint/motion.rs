//! A whole motion with fixed steps, and the way back over it.

use std::cell::RefCell;

use lamc::program::FunctionKind;
use lamc_runtime::State;

use super::differentiated::{Adjoints, At, Differentiated, Undifferentiable};
use super::steps::{Method, Stepper};

/// Numbers of the record that are kept at most: 64 MB. A longer motion is repeated in pieces on the way back.
const MOST_NUMBERS: usize = 8_000_000;

/// The state of a motion.
type Sample = State<Vec<f64>, f64>;

/// A motion at samples, which can be differentiated.
pub struct Course<'d> {
    differentiated: &'d Differentiated,
    /// With the record of the motion, if it has one piece only.
    stepper: RefCell<Stepper<'d>>,
    /// The time of each step's end after the initial time, s.
    times: Vec<f64>,
    /// The steps after which there is a sample, ascending.
    marks: Vec<usize>,
    /// The states at the samples; the first is the initial state.
    pub samples: Vec<Sample>,
    /// Steps before which the record was forgotten, and the states there, beginning with the first.
    pieces: Vec<(usize, Sample)>,
    most: usize,
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
    /// By the inputs, in their order.
    pub inputs: Vec<f64>,
}

impl Gradient {
    /// Adds another one.
    pub(super) fn add(&mut self, other: &Self) {
        let parts = [
            (&mut self.q, &other.q),
            (&mut self.u, &other.u),
            (&mut self.parameters, &other.parameters),
            (&mut self.inputs, &other.inputs),
        ];
        for (sums, shares) in parts {
            sums.iter_mut().zip(shares).for_each(|(sum, share)| *sum += share);
        }
    }
}

impl<'d> Course<'d> {
    /// Integrates from a state whose loops are closed, after its speeds were projected, with samples at ascending times, s, and so many equal steps between two of them.
    ///
    /// # Errors
    /// [`Undifferentiable`].
    pub fn new(
        differentiated: &'d Differentiated,
        method: Method,
        start: Sample,
        samples: &[f64],
        steps: usize,
    ) -> Result<Self, Undifferentiable> {
        let mut times = Vec::with_capacity(samples.len() * steps);
        let mut begin = start.t;
        for end in samples {
            for step in 1..steps {
                times.push(begin + (end - begin) * step as f64 / steps as f64);
            }
            times.push(*end);
            begin = *end;
        }
        let marks = (1..=samples.len()).map(|index| index * steps).collect();
        let course = Self {
            differentiated,
            stepper: RefCell::new(Stepper::new(differentiated, method)),
            times,
            marks,
            samples: vec![start.clone()],
            pieces: vec![(0, start)],
            most: MOST_NUMBERS,
        };
        course.run()
    }

    fn run(mut self) -> Result<Self, Undifferentiable> {
        let stepper = self.stepper.get_mut();
        let mut state = self.samples[0].clone();
        stepper.project(&mut state)?;
        self.samples[0].clone_from(&state);
        let mut marks = self.marks.iter().copied().peekable();
        for (index, time) in self.times.iter().enumerate() {
            if stepper.recorded() > self.most {
                stepper.forget();
                self.pieces.push((index, state.clone()));
            }
            step(stepper, &mut state, *time)?;
            if marks.next_if_eq(&(index + 1)).is_some() {
                self.samples.push(state.clone());
            }
        }
        Ok(self)
    }

    /// The derivatives of some numbers, from those of each number by q and by u at each sample: NQ and then NU entries.
    ///
    /// # Errors
    /// [`Undifferentiable::NotFinite`].
    pub fn pull(&self, numbers: &[Vec<Vec<f64>>]) -> Result<Vec<Gradient>, Undifferentiable> {
        let differentiated = self.differentiated;
        let mut adjoints = vec![Adjoints::zeros(differentiated.layout); numbers.len()];
        let add = |adjoints: &mut [Adjoints], sample: usize| {
            for (adjoints, by_samples) in adjoints.iter_mut().zip(numbers) {
                let sums = adjoints.state.iter_mut().zip(&by_samples[sample]);
                sums.for_each(|(sum, share)| *sum += share);
            }
        };
        let mut stepper = self.stepper.borrow_mut();
        stepper.rewind();
        let mut end = self.times.len();
        let mut samples = self.marks.iter().enumerate().rev().peekable();
        for (begin, state) in self.pieces.iter().rev() {
            if self.pieces.len() > 1 {
                stepper.forget();
                let mut state = state.clone();
                if *begin == 0 {
                    stepper.project(&mut state)?;
                }
                for time in &self.times[*begin..end] {
                    step(&mut stepper, &mut state, *time)?;
                }
            }
            for index in (*begin..end).rev() {
                if let Some((sample, _)) = samples.next_if(|(_, mark)| **mark == index + 1) {
                    add(&mut adjoints, sample + 1);
                }
                stepper.pull(&mut adjoints);
            }
            end = *begin;
        }
        add(&mut adjoints, 0);
        stepper.pull(&mut adjoints);
        adjoints.into_iter().map(|adjoints| differentiated.gradient(adjoints)).collect()
    }
}

/// A step that ends at a time, s.
fn step(stepper: &mut Stepper<'_>, state: &mut Sample, time: f64) -> Result<(), Undifferentiable> {
    stepper.step(state, time - state.t)?;
    state.t = time;
    Ok(())
}

impl Differentiated {
    /// The adjoints as derivatives; those of the drawing as derivatives by the parameters.
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
        let inputs = rest.split_off(layout.parameters);
        let (q, u) = state.split_at(layout.coordinates);
        Ok(Gradient { q: q.to_vec(), u: u.to_vec(), parameters: rest, inputs })
    }
}
