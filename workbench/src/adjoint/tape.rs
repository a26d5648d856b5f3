//! The record of steps: a stack of numbers.

/// What steps went through, the last on top.
#[derive(Clone, Debug, Default)]
pub struct Tape {
    numbers: Vec<f64>,
    /// How many of them have not been taken.
    height: usize,
    steps: Vec<Begun>,
}

/// A step that was begun.
#[derive(Clone, Copy, Debug)]
struct Begun {
    t: f64,
    length: f64,
    /// Moves of the projection at its end.
    moves: usize,
}

impl Tape {
    /// The number of numbers.
    pub fn len(&self) -> usize {
        self.height
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.height = 0;
        self.steps.clear();
    }

    /// Begins a step at a time, of a length, s.
    pub fn begin(&mut self, t: f64, length: f64) {
        self.steps.push(Begun { t, length, moves: 0 });
    }

    /// Time and length of the last step, s.
    pub fn last(&self) -> Option<(f64, f64)> {
        self.steps.last().map(|step| (step.t, step.length))
    }

    /// Forgets the last step, of which all numbers have been taken.
    pub fn end(&mut self) {
        self.steps.pop();
    }

    /// Counts a move of the projection of the last step.
    pub fn add_move(&mut self) {
        self.steps.last_mut().into_iter().for_each(|step| step.moves += 1);
    }

    /// The moves of the projection of the last step.
    pub fn moves(&self) -> usize {
        self.steps.last().map_or(0, |step| step.moves)
    }

    /// Puts numbers on top.
    pub fn push(&mut self, numbers: &[f64]) {
        self.numbers.truncate(self.height);
        self.numbers.extend_from_slice(numbers);
        self.height = self.numbers.len();
    }

    /// The numbers from a place on.
    pub fn from(&self, begin: usize) -> &[f64] {
        &self.numbers[begin..self.height]
    }

    /// Takes the numbers on top, of which there are at least so many.
    pub fn pop(&mut self, count: usize) -> &[f64] {
        self.height -= count;
        &self.numbers[self.height..][..count]
    }
}
