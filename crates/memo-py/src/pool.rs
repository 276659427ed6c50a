//! The threads of this process that the core computes with.
//!
//! A child made by `fork` has a copy of its parent's memory but none of its threads: what waits for them waits for
//! ever. Rayon's global pool is made once, so the core never runs on it from here; it runs on a pool that knows its
//! process.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::{Mutex, PoisonError};

/// The pool and the process whose threads it has. A parent's pool is leaked in the child: its threads are not there
/// to be joined.
///
/// Locked only by a thread that is attached to the interpreter and does not detach meanwhile. Python forks on such a
/// thread too, so no child finds it locked.
static POOL: Mutex<Option<(u32, &'static ThreadPool)>> = Mutex::new(None);

/// A thread that waits for a part of its work takes up that of other calls, on top of its own. Unused, it costs nothing.
const STACK_BYTES: usize = 16 << 20;

/// The pool of this process; `RAYON_NUM_THREADS` sets its size.
pub fn pool(_attached: Python<'_>) -> PyResult<&'static ThreadPool> {
    let mut known = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    match *known {
        Some((owner, pool)) if owner == process => Ok(pool),
        _ => {
            let pool: &ThreadPool = Box::leak(Box::new(build()?));
            *known = Some((process, pool));
            Ok(pool)
        }
    }
}

fn build() -> PyResult<ThreadPool> {
    let pool = ThreadPoolBuilder::new()
        .thread_name(|index| format!("memo-{index}"))
        .stack_size(STACK_BYTES)
        .build()
        .map_err(|error| PyRuntimeError::new_err(format!("no threads to compute with: {error}")))?;
    // What the threads initialise once for the whole process is done before anybody can fork.
    pool.broadcast(|_| ());
    Ok(pool)
}
