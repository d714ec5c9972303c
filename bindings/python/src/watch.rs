//! Long work without the interpreter's lock, while the thread that asked for it shows its progress
//! and listens for Ctrl-C.

use std::{
    sync::{
        Mutex, PoisonError,
        mpsc::{RecvTimeoutError, channel},
    },
    time::Duration,
};

use intrados::embedded::Refusal;
use intrados_stage::{Job, catch};
use pyo3::{exceptions::PyKeyboardInterrupt, prelude::*};

/// Between two looks at the job.
const TICK: Duration = Duration::from_millis(50);

/// Does `work` on a thread of its own, because signals reach Python in its main thread alone, which
/// must be free to hear them. Whatever Python raises meanwhile (Ctrl-C, or an error in `progress`)
/// cancels the work and is raised once that has ended, so that nothing goes on unseen.
pub(crate) fn watched<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&Job) -> Result<T, Refusal> + Send + 'static,
) -> PyResult<T> {
    let job = Job::new("starting");
    let theirs = job.clone();
    let (send, receive) = channel();
    std::thread::Builder::new().name("intrados".into()).spawn(move || {
        // Whoever waits for it has gone only if Python itself has ended.
        let _ = send.send(catch(|| work(&theirs)));
    })?;
    // Only so that it may be used while Python does something else: nobody else asks it.
    let receive = Mutex::new(receive);
    let wait = || receive.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(TICK);
    let mut raised = None;
    let done = loop {
        match py.detach(wait) {
            Err(RecvTimeoutError::Timeout) if raised.is_none() => {
                if let Err(error) = heard(py, &job, progress.as_ref()) {
                    job.cancel();
                    raised = Some(error);
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            other => break other,
        }
    };
    if let Some(error) = raised {
        return Err(error);
    }
    match done {
        Ok(Ok(Ok(value))) => {
            heard(py, &job, None)?;
            Ok(value)
        }
        Ok(Ok(Err(refusal))) if refusal.code == 130 => Err(PyKeyboardInterrupt::new_err(())),
        Ok(Ok(Err(refusal))) => Err(crate::exception(py, &refusal)),
        Ok(Err(fault)) => Err(broken(py, &fault.to_string())),
        Err(_) => Err(broken(py, "internal error: the work has left no result")),
    }
}

/// Runs what signals have asked for, and tells how far the work is.
fn heard(py: Python<'_>, job: &Job, progress: Option<&Py<PyAny>>) -> PyResult<()> {
    py.check_signals()?;
    match progress {
        Some(progress) => progress.call1(py, (f64::from(job.done()), job.label())).map(drop),
        None => Ok(()),
    }
}

fn broken(py: Python<'_>, what: &str) -> PyErr {
    let line = format!("{what}: please report it");
    crate::exception(py, &Refusal { code: 1, line })
}
