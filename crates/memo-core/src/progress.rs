//! How far a long call is, for whoever waits for it, and the wish that it stop.
//!
//! The caller keeps one [`Progress`], hands it to a call whose name ends in `_with_progress`, and looks at it
//! from another thread. Work is counted in units of about the same length, such as frames; the count changes
//! no result.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use thiserror::Error;

/// The call ended because [`Progress::stop`] was called.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("stopped before the end")]
pub struct Stopped;

/// Units of work done and to do, and whether to go on.
#[derive(Debug, Default)]
pub struct Progress {
    done: AtomicUsize,
    total: AtomicUsize,
    is_stopped: AtomicBool,
}

impl Progress {
    /// Nothing done and nothing to do.
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks the call to end with [`Stopped`] as soon as it can.
    pub fn stop(&self) {
        self.is_stopped.store(true, Ordering::Relaxed);
    }

    /// Units done.
    pub fn done(&self) -> usize {
        self.done.load(Ordering::Relaxed)
    }

    /// Units in all; 0 before the call knows.
    pub fn total(&self) -> usize {
        self.total.load(Ordering::Relaxed)
    }

    /// Says how many units there are in all.
    pub(crate) fn expect(&self, total: usize) {
        self.total.store(total, Ordering::Relaxed);
    }

    /// Counts units as done, unless the call is to end.
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
        progress.stop();
        assert_eq!(progress.advance(1), Err(Stopped));
    }
}
