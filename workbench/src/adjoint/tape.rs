//! The record of steps: a stack of numbers that can be gone through again.

/// What steps went through, the last on top.
#[derive(Clone, Debug, Default)]
pub struct Tape {
    numbers: Vec<f64>,
    /// How many of them have not been taken.
    height: usize,
    steps: Vec<Begun>,
    /// How many of them have not been taken.
    left: usize,
}

/// A step that was begun.
#[derive(Clone, Copy, Debug)]
struct Begun {
    t: f64,
    length: f64,
    /// The height of the stack before.
    height: usize,
}

impl Tape {
    /// The number of numbers.
    pub fn len(&self) -> usize {
        self.height
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        *self = Self {
            numbers: std::mem::take(&mut self.numbers),
            steps: std::mem::take(&mut self.steps),
            ..Self::default()
        };
        self.numbers.clear();
        self.steps.clear();
    }

    /// Nothing has been taken.
    pub fn rewind(&mut self) {
        (self.height, self.left) = (self.numbers.len(), self.steps.len());
    }

    /// Begins a step at a time, of a length, s.
    pub fn begin(&mut self, t: f64, length: f64) {
        self.steps.truncate(self.left);
        self.steps.push(Begun { t, length, height: self.height });
        self.left += 1;
    }

    /// Time and length of the last step, s, of which nothing has been taken then.
    pub fn last(&mut self) -> Option<(f64, f64)> {
        let last = self.steps.get(self.left.checked_sub(1)?)?;
        self.height = match self.steps.get(self.left) {
            Some(next) => next.height,
            None => self.numbers.len(),
        };
        Some((last.t, last.length))
    }

    /// The last step is taken.
    pub fn end(&mut self) {
        self.left -= 1;
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

    /// The numbers on top, of which there are at least so many.
    pub fn top(&self, count: usize) -> &[f64] {
        self.from(self.height - count)
    }

    /// Forgets the numbers from a place on.
    pub fn truncate(&mut self, height: usize) {
        self.numbers.truncate(height);
        self.height = height;
    }

    /// Takes the numbers on top, of which there are at least so many.
    pub fn pop(&mut self, count: usize) -> &[f64] {
        self.height -= count;
        &self.numbers[self.height..][..count]
    }
}
