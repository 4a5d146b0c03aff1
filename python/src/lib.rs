//! The Python package: scenes, flights and tables as classes, and every study as the call of its command.
//!
//! Nothing is computed here. A study answers what `--json` of its command prints (`penetrode::cli::call`); a flight is that
//! of the library; rows of a table go through the function of the command `batch`.

mod diagnose;
mod errors;
mod flight;
mod scene;
mod studies;
mod table;

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use errors::run_error;

/// How often a long call looks whether it was interrupted.
const POLL: Duration = Duration::from_millis(20);

/// The threads of this process; another process, such as a fork of this one, has its own.
fn pool(py: Python<'_>) -> PyResult<Arc<ThreadPool>> {
    static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if let Some((made_in, pool)) = &*pool
        && *made_in == process
    {
        return Ok(Arc::clone(pool));
    }
    let made = Arc::new(pool_of(py, 0)?);
    // The threads of a parent stayed there: to end them would wait for ever.
    std::mem::forget(pool.replace((process, Arc::clone(&made))));
    Ok(made)
}

/// `threads` threads, 0 for one a processor.
fn pool_of(py: Python<'_>, threads: usize) -> PyResult<ThreadPool> {
    ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| run_error(py, &error.to_string(), ""))
}

/// What `work` gives on another thread, without the lock of the interpreter; an interrupt of this thread (Ctrl-C) ends the
/// wait at once. The work then goes on to its end, which is bounded, and nobody hears of it.
fn interruptible<R: Send + 'static>(py: Python<'_>, work: impl FnOnce() -> R + Send + 'static) -> PyResult<R> {
    let (done, mut answer) = channel();
    let worker = thread::Builder::new().name("penetrode".to_owned()).stack_size(16 << 20).spawn(move || {
        // Whoever was interrupted listens no more.
        let _ = done.send(work());
    });
    worker.map_err(|error| run_error(py, &error.to_string(), "end other programs first"))?;
    loop {
        // Moved, for a receiver is not shared between threads.
        let answer = &mut answer;
        match py.detach(move || answer.recv_timeout(POLL)) {
            Ok(answer) => return Ok(answer),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => {
                return Err(run_error(py, "the computation broke off", "report it with the input that did it"));
            }
        }
    }
}

#[pymodule(gil_used = false)]
mod _penetrode {
    #[pymodule_export]
    use super::diagnose::{Problem, Stage, diagnose};
    #[pymodule_export]
    use super::flight::{Event, Flight, solve};
    #[pymodule_export]
    use super::scene::{Scene, scene_names};
    #[pymodule_export]
    use super::studies::{call, let_program_be, run};
    #[pymodule_export]
    use super::table::{Table, batch};

    /// Version of the package.
    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}
