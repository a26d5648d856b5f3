//! Interrupts (Ctrl-C): a long computation ends early and keeps its results.

use std::sync::atomic::{AtomicBool, Ordering};

use super::{Failed, fail};

/// The exit code of an interrupted command, by the convention of shells.
pub const EXIT_INTERRUPTED: u8 = 130;

static ASKED_FOR: AtomicBool = AtomicBool::new(false);

/// After this call an interrupt does not end the process but is recorded.
pub fn listen() -> Result<(), Failed> {
    ctrlc::set_handler(|| ASKED_FOR.store(true, Ordering::Relaxed)).map_err(fail)
}

/// Whether the user has interrupted the work.
pub fn is_asked_for() -> bool {
    ASKED_FOR.load(Ordering::Relaxed)
}

/// As [`is_asked_for`], and forgets it.
pub fn take() -> bool {
    ASKED_FOR.swap(false, Ordering::Relaxed)
}
