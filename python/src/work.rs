//! Long work: the GIL is released, Ctrl-C is answered, and progress is told.
use crate::errors::{raise, unusable};
use handeye::Error;
use handeye::calibrate::{self, Observer};
use pyo3::prelude::*;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::time::Duration;

/// What a calibration is doing.
#[pyclass(module = "handeye", frozen, get_all)]
pub struct Progress {
    /// Name of the stage.
    stage: String,
    /// Iterations or trials done in it.
    done: usize,
    /// Of how many at most.
    of: usize,
    /// Root mean square pixel distance [px], where there is one.
    rms_px: Option<f64>,
}

#[pymethods]
impl Progress {
    fn __repr__(&self) -> String {
        let rms = self.rms_px.map_or_else(String::new, |rms| format!(", {rms:.3} px rms"));
        format!("<handeye.Progress {}: {} of at most {}{rms}>", self.stage, self.done, self.of)
    }
}

/// How often signals are looked for: Ctrl-C is answered within this and an iteration.
const SIGNALS: Duration = Duration::from_millis(20);

/// Stack of the working thread, as large as that of a main thread.
const STACK: usize = 8 << 20;

/// Does work on a thread of its own. The calling thread meanwhile calls `progress`, and looks for signals: what either raises cancels the
/// work at its next iteration and is raised then.
pub fn run<T: Send>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    threads: Option<usize>,
    work: impl FnOnce(Observer<'_>) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let pool = match threads {
        None => None,
        Some(0) => return Err(unusable("threads: at least 1 is needed")),
        Some(threads) => {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            Some(pool.map_err(|error| unusable(format!("threads: {error}")))?)
        }
    };
    let is_cancelled = AtomicBool::new(false);
    let tells = progress.is_some();
    let mut raised = None;
    let done = py.detach(|| {
        let (sender, receiver) = sync_channel(1);
        std::thread::scope(|scope| {
            let is_cancelled = &is_cancelled;
            let observed = move || {
                let mut observer = |progress: &calibrate::Progress<'_>| observe(progress, is_cancelled, &sender, tells);
                work(&mut observer)
            };
            let on_pool = move || match pool {
                Some(pool) => pool.install(observed),
                None => observed(),
            };
            let worker = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, on_pool)?;
            // Until the other end is dropped, which the end of the work does. What is told after something was raised is nobody's concern.
            loop {
                let told = match receiver.recv_timeout(SIGNALS) {
                    Ok(told) => Some(told),
                    Err(RecvTimeoutError::Timeout) => None,
                    Err(RecvTimeoutError::Disconnected) => break,
                };
                if raised.is_none() {
                    raised = Python::attach(|py| tell(py, progress, told)).err();
                    is_cancelled.store(raised.is_some(), Ordering::Relaxed);
                }
            }
            Ok(worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
        })
    });
    match (raised, done) {
        (Some(raised), _) => Err(raised),
        (None, Ok(done)) => done.map_err(raise),
        (None, Err(error)) => Err(error),
    }
}

fn observe(
    progress: &calibrate::Progress<'_>,
    is_cancelled: &AtomicBool,
    sender: &SyncSender<Progress>,
    tells: bool,
) -> ControlFlow<()> {
    if tells {
        let &calibrate::Progress { stage, done, of, rms_px } = progress;
        // The receiver outlives the work.
        let _ = sender.send(Progress { stage: stage.to_owned(), done, of, rms_px });
    }
    if is_cancelled.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

fn tell(py: Python<'_>, callback: Option<&Py<PyAny>>, told: Option<Progress>) -> PyResult<()> {
    py.check_signals()?;
    if let (Some(callback), Some(told)) = (callback, told) {
        callback.call1(py, (told,))?;
    }
    Ok(())
}
