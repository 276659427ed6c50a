//! Runs the core without the interpreter lock, on the threads of this process. Ctrl-C interrupts it, and progress
//! is reported.

use crate::pool::pool;
use memo_core::Progress;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Signals are checked this often.
pub const LOOK: Duration = Duration::from_millis(50);

/// Work for another thread.
type Job = Box<dyn FnOnce() + Send>;

/// Runs short work that may use several threads. Work on one thread needs only `Python::detach`.
pub fn pooled<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let pool = pool(py)?;
    Ok(py.detach(|| pool.install(work)))
}

/// Runs longer work that does not use several threads. After Ctrl-C it keeps running detached, and its result is
/// discarded.
pub fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let start = |job: Job| Ok(std::thread::Builder::new().name("memo".into()).spawn(job).map(drop)?);
    awaited(py, None, start, |_| work())
}

/// Runs work that may take seconds and may use several threads, and calls `callback` with the units done and
/// their number when they change. After Ctrl-C, or if the callback raises, the work is cancelled and ends in the
/// background.
pub fn watched<T: Send + 'static>(
    py: Python<'_>,
    callback: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Progress) -> T + Send + 'static,
) -> PyResult<T> {
    let pool = pool(py)?;
    let start = |job: Job| {
        pool.spawn(job);
        Ok(())
    };
    awaited(py, callback, start, work)
}

/// Panics like a bug in the core, in one of the ways in which bindings call it; for tests.
#[pyfunction(name = "_panic")]
pub fn panic_on_purpose(py: Python<'_>, message: String, way: &str) -> PyResult<()> {
    match way {
        "watched" => watched(py, None, move |_| panic!("{message}")),
        "interruptible" => interruptible(py, move || panic!("{message}")),
        "pooled" => pooled(py, || panic!("{message}")),
        _ => panic!("{message}"),
    }
}

/// Starts work on another thread and waits for it.
fn awaited<T: Send + 'static>(
    py: Python<'_>,
    callback: Option<&Bound<'_, PyAny>>,
    start: impl FnOnce(Job) -> PyResult<()>,
    work: impl FnOnce(&Progress) -> T + Send + 'static,
) -> PyResult<T> {
    let process = std::process::id();
    let progress = Arc::new(Progress::new());
    let (sender, mut receiver) = channel();
    let of_worker = Arc::clone(&progress);
    // After an interrupt there is no receiver, so sending may fail.
    let job = move || drop(sender.send(catch_unwind(AssertUnwindSafe(|| work(&of_worker)))));
    start(Box::new(job))?;
    let mut told = 0;
    loop {
        let (back, result) = py.detach(move || {
            let result = receiver.recv_timeout(LOOK);
            (receiver, result)
        });
        receiver = back;
        match result {
            Ok(result) => {
                tell(callback, &progress, &mut told)?;
                return Ok(result.unwrap_or_else(|panic| resume_unwind(panic)));
            }
            Err(RecvTimeoutError::Timeout) => {
                let heard = py.check_signals().and_then(|()| tell(callback, &progress, &mut told));
                if std::process::id() != process {
                    // The callback or a signal handler has forked this process. The computing thread is the
                    // parent's, and dropping the receiver might wait for it.
                    std::mem::forget(receiver);
                    heard?;
                    let message = "the process was forked during this call: the parent has its result";
                    return Err(PyRuntimeError::new_err(message));
                }
                heard.inspect_err(|_| progress.stop())?;
            }
            Err(RecvTimeoutError::Disconnected) => unreachable!("the worker sends a result or its panic"),
        }
    }
}

fn tell(callback: Option<&Bound<'_, PyAny>>, progress: &Progress, told: &mut usize) -> PyResult<()> {
    let done = progress.done();
    if let Some(callback) = callback.filter(|_| done > *told) {
        *told = done;
        callback.call1((done, progress.total()))?;
    }
    Ok(())
}
