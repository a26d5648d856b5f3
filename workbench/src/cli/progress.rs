//! Progress of long computations: a bar or a spinner on a terminal, plain lines elsewhere.

use std::io::{self, Write};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

/// Shorter computations are not reported.
const PATIENCE: Duration = Duration::from_secs(2);

/// How often a line on a terminal is drawn again.
const TICK: Duration = Duration::from_millis(200);

/// On a terminal, for what can be counted.
pub fn bar(steps: usize) -> ProgressBar {
    let bar = ProgressBar::new(steps as u64);
    if let Ok(style) = ProgressStyle::with_template("{wide_bar} {percent:>3} %  {eta} left") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(TICK);
    bar
}

/// Says on standard error what is being done, once it has taken two seconds; no more when dropped.
pub struct Busy {
    steps: Option<Sender<String>>,
    thread: Option<JoinHandle<()>>,
}

impl Busy {
    /// About to begin a piece of work: "deriving the equations".
    pub fn new(work: impl Into<String>) -> Self {
        let (steps, next) = mpsc::channel();
        let work = work.into();
        // Without a thread the progress is not shown.
        let thread = thread::Builder::new().spawn(move || watch(work, &next)).ok();
        Self { steps: Some(steps), thread }
    }

    /// Goes on with the next piece.
    pub fn now(&self, work: String) {
        if let Some(steps) = &self.steps {
            // If the thread has ended, the message is not needed.
            let _ = steps.send(work);
        }
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.steps = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn watch(mut work: String, next: &Receiver<String>) {
    let begin = Instant::now();
    loop {
        match next.recv_timeout(PATIENCE.saturating_sub(begin.elapsed())) {
            Ok(step) => work = step,
            Err(RecvTimeoutError::Timeout) => break,
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
    let spinner = ProgressBar::new_spinner().with_elapsed(PATIENCE);
    let say = |work: String| match spinner.is_hidden() {
        // If standard error is closed, the message is lost.
        true => drop(writeln!(io::stderr(), "{work} ..")),
        false => spinner.set_message(work),
    };
    if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}, {elapsed}") {
        spinner.set_style(style);
    }
    say(work);
    spinner.enable_steady_tick(TICK);
    next.iter().for_each(say);
    spinner.finish_and_clear();
}
