//! Ctrl-C during long computations: Python learns of it only when it is asked.

use std::panic::resume_unwind;
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

/// How often Python is asked whether it has been interrupted.
const PATIENCE: Duration = Duration::from_millis(50);

/// How soon a short computation is noticed to have ended.
const FIRST: Duration = Duration::from_micros(50);

/// Runs a computation without the GIL, in a thread of its own. If Python is interrupted, the call ends at once; the thread
/// ends when it is done, and its result is dropped.
///
/// # Errors
/// What Python raises when it is interrupted.
pub fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    compute: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let thread = thread::spawn(compute);
    let mut wait = FIRST;
    while !thread.is_finished() {
        py.detach(|| thread::sleep(wait));
        py.check_signals()?;
        wait = (2 * wait).min(PATIENCE);
    }
    thread.join().or_else(|panic| resume_unwind(panic))
}
