//! Progress and cancellation of long calls.
//!
//! The caller keeps one [`Progress`], passes it to a call whose name ends in `_with_progress`, and reads it from
//! another thread. Work is counted in units of about the same duration, such as frames. The count does not change
//! the result.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use thiserror::Error;

/// The call ended because [`Progress::stop`] was called.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("stopped before the end")]
pub struct Stopped;

/// Units of work done, units in all, and whether the call is cancelled.
#[derive(Debug, Default)]
pub struct Progress {
    done: AtomicUsize,
    total: AtomicUsize,
    is_stopped: AtomicBool,
}

impl Progress {
    /// No unit done, total not known, not cancelled.
    pub fn new() -> Self {
        Self::default()
    }

    /// Cancels the call: it returns [`Stopped`] as soon as it can.
    pub fn stop(&self) {
        self.is_stopped.store(true, Ordering::Relaxed);
    }

    /// Number of units done.
    pub fn done(&self) -> usize {
        self.done.load(Ordering::Relaxed)
    }

    /// Number of units in all; 0 while it is not known.
    pub fn total(&self) -> usize {
        self.total.load(Ordering::Relaxed)
    }

    /// Sets the number of units in all.
    pub(crate) fn expect(&self, total: usize) {
        self.total.store(total, Ordering::Relaxed);
    }

    /// Adds units to the number in all.
    pub(crate) fn expect_more(&self, units: usize) {
        self.total.fetch_add(units, Ordering::Relaxed);
    }

    /// Counts units as done; [`Stopped`] if the call is cancelled.
    pub(crate) fn advance(&self, units: usize) -> Result<(), Stopped> {
        self.done.fetch_add(units, Ordering::Relaxed);
        if self.is_stopped.load(Ordering::Relaxed) { Err(Stopped) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_counted_until_it_is_stopped() {
        let progress = Progress::new();
        assert_eq!((progress.done(), progress.total()), (0, 0));
        progress.expect(5);
        assert_eq!(progress.advance(2), Ok(()));
        assert_eq!((progress.done(), progress.total()), (2, 5));
        progress.expect_more(4);
        assert_eq!(progress.total(), 9);
        progress.stop();
        assert_eq!(progress.advance(1), Err(Stopped));
    }
}
