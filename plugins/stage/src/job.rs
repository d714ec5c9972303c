use std::{
    panic::AssertUnwindSafe,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, AtomicU32, Ordering},
        mpsc,
    },
};

use bevy_ecs::resource::Resource;

/// The handle that long work and its watcher share: progress out, cancel in. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub struct Job(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    label: Mutex<String>,
    /// Done share in 1/10 000.
    done: AtomicU32,
    cancelled: AtomicBool,
    finished: AtomicBool,
}

/// Somebody asked the work to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("cancelled")]
pub struct Cancelled;

impl Job {
    /// A job that says what it does, for example `"importing bridge.glb"`.
    pub fn new(label: impl Into<String>) -> Self {
        let job = Self::default();
        job.relabel(label);
        job
    }

    /// What the work does at the moment.
    pub fn label(&self) -> String {
        self.0.label.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Names the next part of the work.
    pub fn relabel(&self, label: impl Into<String>) {
        *self.0.label.lock().unwrap_or_else(PoisonError::into_inner) = label.into();
    }

    /// Reports `done` of `total` parts and asks whether to go on. Call it at least ten times a second.
    ///
    /// # Errors
    /// [`Cancelled`] once [`Job::cancel`] was called: return at once and leave nothing half written.
    pub fn step(&self, done: usize, total: usize) -> Result<(), Cancelled> {
        let share = if total == 0 { 0.0 } else { done as f64 / total as f64 };
        self.0.done.store((share.clamp(0.0, 1.0) * 1e4) as u32, Ordering::Relaxed);
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }

    /// Share done, 0 to 1.
    pub fn done(&self) -> f32 {
        self.0.done.load(Ordering::Relaxed) as f32 / 1e4
    }

    /// Asks the work to stop.
    pub fn cancel(&self) {
        self.0.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether [`Job::cancel`] was called.
    pub fn is_cancelled(&self) -> bool {
        self.0.cancelled.load(Ordering::Relaxed)
    }

    /// Whether the work has ended, well or not.
    pub fn is_finished(&self) -> bool {
        self.0.finished.load(Ordering::Relaxed)
    }
}

/// Work on a thread of its own, off the frame. Dropping the task asks the work to stop.
#[derive(Debug)]
pub struct Task<T> {
    job: Job,
    result: Mutex<mpsc::Receiver<T>>,
}

impl<T: Send + 'static> Task<T> {
    /// Starts `work` and lists its job in `jobs`.
    pub fn spawn(jobs: &mut Jobs, label: impl Into<String>, work: impl FnOnce(&Job) -> T + Send + 'static) -> Self {
        let job = Job::new(label);
        let (send, receive) = mpsc::channel();
        let theirs = job.clone();
        std::thread::spawn(move || {
            // A panic in the work must not leave the window waiting: the channel closes and `poll` says so.
            let result = std::panic::catch_unwind(AssertUnwindSafe(|| work(&theirs)));
            theirs.0.finished.store(true, Ordering::Relaxed);
            if let Ok(result) = result {
                // The receiver is gone when nobody wants the result any more.
                let _ = send.send(result);
            }
        });
        jobs.list.push(job.clone());
        Self { job, result: Mutex::new(receive) }
    }

    /// The handle for progress and cancel.
    pub fn job(&self) -> &Job {
        &self.job
    }

    /// `None` while the work goes on, then once `Some(Ok(result))`, or `Some(Err(Cancelled))` if it died.
    pub fn poll(&self) -> Option<Result<T, Cancelled>> {
        let receiver = self.result.lock().unwrap_or_else(PoisonError::into_inner);
        match receiver.try_recv() {
            Ok(result) => Some(Ok(result)),
            Err(mpsc::TryRecvError::Empty) => None,
            Err(mpsc::TryRecvError::Disconnected) => Some(Err(Cancelled)),
        }
    }
}

/// Does `work` in a pool of one thread that gives way to others, where the system lets threads (Linux): for a [`Task`] that nobody waits for.
/// In the common pool the walks of a frame would wait for it, and as an equal of theirs it would take one of two cores from them.
pub fn aside<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let give_way = |_| {
        #[cfg(target_os = "linux")]
        // Of this thread alone; elsewhere it would be of the whole process. Only a wish: nothing depends on it.
        let _ = rustix::process::setpriority_process(None, 10);
    };
    apart(give_way, work)
}

/// Does `work` in a pool of one thread, as an equal of others: for a [`Task`] that somebody waits for. In the common pool the walks of a frame would wait for it.
pub fn alone<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    apart(|_| {}, work)
}

fn apart<T: Send>(start: impl Fn(usize) + Send + Sync + 'static, work: impl FnOnce() -> T + Send) -> T {
    match rayon::ThreadPoolBuilder::new().num_threads(1).start_handler(start).build() {
        Ok(pool) => pool.install(work),
        Err(_) => work(),
    }
}

impl<T> Drop for Task<T> {
    fn drop(&mut self) {
        self.job.cancel();
    }
}

/// The jobs that run now, for whoever shows them.
#[derive(Resource, Debug, Default)]
pub struct Jobs {
    list: Vec<Job>,
}

impl Jobs {
    /// Running jobs, oldest first; forgets those that have ended.
    pub fn running(&mut self) -> &[Job] {
        self.list.retain(|job| !job.is_finished());
        &self.list
    }

    /// Asks all of them to stop.
    pub fn cancel_all(&self) {
        self.list.iter().for_each(Job::cancel);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cancelled_task_stops_and_says_so() {
        let mut jobs = Jobs::default();
        let task = Task::spawn(&mut jobs, "counting", |job| {
            let mut n = 0_u64;
            while job.step(0, 1).is_ok() {
                n += 1;
            }
            n
        });
        assert_eq!(jobs.running().len(), 1);
        task.job().cancel();
        let result = loop {
            if let Some(result) = task.poll() {
                break result;
            }
        };
        assert!(result.is_ok());
        assert!(jobs.running().is_empty());
    }

    #[test]
    fn a_panicking_task_ends() {
        let mut jobs = Jobs::default();
        let task: Task<()> = Task::spawn(&mut jobs, "falling over", |_| panic!("on purpose"));
        let result = loop {
            if let Some(result) = task.poll() {
                break result;
            }
        };
        assert_eq!(result, Err(Cancelled));
    }
}
