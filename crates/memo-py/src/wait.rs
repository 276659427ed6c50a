//! Waiting for the core: Ctrl-C is heard, and progress told, while another thread computes.

use memo_core::progress::Progress;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// So often signals are looked for.
const LOOK: Duration = Duration::from_millis(50);

/// Runs what may last longer than a moment. On Ctrl-C it is left to end by itself, unheard.
pub fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    watched(py, None, |_| work())
}

/// Runs what may last for seconds, and calls `callback` with the units done and their number as they change.
/// On Ctrl-C, or when the callback raises, the work is asked to stop and left to do so by itself.
pub fn watched<T: Send + 'static>(
    py: Python<'_>,
    callback: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Progress) -> T + Send + 'static,
) -> PyResult<T> {
    let progress = Arc::new(Progress::new());
    let (sender, mut receiver) = channel();
    let of_worker = Arc::clone(&progress);
    // Nobody listens any more after an interrupt: sending may fail.
    let start = move || drop(sender.send(work(&of_worker)));
    std::thread::Builder::new().name("memo".into()).spawn(start)?;
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
                return Ok(result);
            }
            Err(RecvTimeoutError::Timeout) => {
                let heard = py.check_signals().and_then(|()| tell(callback, &progress, &mut told));
                heard.inspect_err(|_| progress.stop())?;
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the computation broke off; this is a fault of memo"));
            }
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
