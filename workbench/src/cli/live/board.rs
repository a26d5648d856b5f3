//! Requested motions and the results to show.

use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde::Deserialize;

/// Values of the sliders of a page, in SI units and radians.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// By name.
    pub parameters: BTreeMap<String, f64>,
    /// By joint.
    pub initial: BTreeMap<String, f64>,
}

/// A requested motion.
#[derive(Clone, Debug)]
pub struct Wish {
    /// Counts up.
    pub number: u64,
    /// Values of the sliders; `None` shows the model as it is written.
    pub settings: Option<Settings>,
}

/// Requests and results, shared between threads.
pub struct Board {
    notes: Mutex<Notes>,
    changed: Condvar,
}

struct Notes {
    wish: Wish,
    /// Number of the last request with a result, and the result.
    answer: (u64, Arc<str>),
}

impl Default for Board {
    /// Creates a board with a request for the first motion.
    fn default() -> Self {
        let notes = Notes { wish: Wish { number: 1, settings: None }, answer: (0, Arc::from("")) };
        Self { notes: Mutex::new(notes), changed: Condvar::new() }
    }
}

impl Board {
    fn notes(&self) -> MutexGuard<'_, Notes> {
        self.notes.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wish(&self, settings: Option<Settings>) {
        let mut notes = self.notes();
        notes.wish = Wish { number: notes.wish.number + 1, settings };
        self.changed.notify_all();
    }

    /// The file was saved: the model is shown as it is written.
    pub fn saved(&self) {
        self.wish(None);
    }

    /// The sliders were moved.
    pub fn set(&self, settings: Settings) {
        self.wish(Some(settings));
    }

    /// Returns whether there is a newer request.
    pub fn is_outdated(&self, number: u64) -> bool {
        self.notes().wish.number > number
    }

    /// Waits for the newest request without a result.
    pub fn next_wish(&self) -> Wish {
        let open = |notes: &mut Notes| notes.wish.number == notes.answer.0;
        self.changed
            .wait_while(self.notes(), open)
            .unwrap_or_else(PoisonError::into_inner)
            .wish
            .clone()
    }

    /// Stores the result of a request.
    pub fn answer(&self, number: u64, answer: String) {
        self.notes().answer = (number, answer.into());
        self.changed.notify_all();
    }

    /// Returns the newest result if its request is later than `seen`; waits for it if necessary.
    pub fn answer_after(&self, seen: u64, patience: Duration) -> Option<Arc<str>> {
        let old = |notes: &mut Notes| notes.answer.0 <= seen;
        let (notes, waited) = self
            .changed
            .wait_timeout_while(self.notes(), patience, old)
            .unwrap_or_else(PoisonError::into_inner);
        (!waited.timed_out()).then(|| notes.answer.1.clone())
    }
}
