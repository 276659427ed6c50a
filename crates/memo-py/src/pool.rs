//! Thread pool of this process.
//!
//! A child made by `fork` has a copy of its parent's memory but none of its threads, so waiting for them never
//! ends. Rayon's global pool is made only once. So the core does not use it from here, but a pool that knows its
//! process.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::{Mutex, PoisonError};

/// The pool and the process that has its threads. In a forked child the parent's pool is leaked, because its
/// threads do not exist there and cannot be joined.
///
/// Locked only by a thread that is attached to the interpreter and does not detach in that time. Python forks on
/// such a thread too, so no child finds it locked.
static POOL: Mutex<Option<(u32, &'static ThreadPool)>> = Mutex::new(None);

/// A thread that waits for a part of its work runs work of other calls on the same stack. An unused stack costs
/// nothing.
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
    // Runs the threads' one-time initialisation of the process before any fork.
    pool.broadcast(|_| ());
    Ok(pool)
}
