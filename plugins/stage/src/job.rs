use std::sync::{
    Arc, Mutex, PoisonError,
    atomic::{AtomicBool, AtomicU32, Ordering},
    mpsc,
};

use bevy_ecs::resource::Resource;

use crate::{Fault, catch};

/// The handle that long work and its watcher share: progress out, cancel in. Cheap to clone.
#[derive(Debug, Clone, Default)]
pub struct Job {
    shared: Arc<Shared>,
    /// Which share of the whole this handle reports; none: all of it.
    part: Option<[f64; 2]>,
}

#[derive(Debug, Default)]
struct Shared {
    label: Mutex<String>,
    /// Done share in 1/10 000.
    done: AtomicU32,
    cancelled: AtomicBool,
    finished: AtomicBool,
    fault: Mutex<Option<Fault>>,
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
        self.shared.label.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Names the next part of the work.
    pub fn relabel(&self, label: impl Into<String>) {
        *self.shared.label.lock().unwrap_or_else(PoisonError::into_inner) = label.into();
    }

    /// Reports `done` of `total` parts and asks whether to go on. Call it at least ten times a
    /// second.
    ///
    /// # Errors
    /// [`Cancelled`] once [`Job::cancel`] was called: return at once and leave nothing half
    /// written.
    pub fn step(&self, done: usize, total: usize) -> Result<(), Cancelled> {
        let share = if total == 0 { 0.0 } else { (done as f64 / total as f64).clamp(0.0, 1.0) };
        let stored = |share: f64| (share * 1e4) as u32;
        match self.part {
            None => self.shared.done.store(stored(share), Ordering::Relaxed),
            // Parts that run side by side must not take back each other's progress.
            Some([from, to]) => {
                _ = self
                    .shared
                    .done
                    .fetch_max(stored(from + share * (to - from)), Ordering::Relaxed)
            }
        }
        self.check()
    }

    /// The same where nothing is to be told of progress.
    ///
    /// # Errors
    /// [`Cancelled`], as of [`Job::step`].
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }

    /// A handle for the part of this work that lies between the shares `from` and `to` of it. The
    /// same label, the same cancel.
    #[must_use]
    pub fn part(&self, from: f64, to: f64) -> Self {
        let [low, high] = self.part.unwrap_or([0.0, 1.0]);
        let within = |share: f64| low + share.clamp(0.0, 1.0) * (high - low);
        Self { shared: Arc::clone(&self.shared), part: Some([within(from), within(to)]) }
    }

    /// Share done, 0 to 1.
    pub fn done(&self) -> f32 {
        self.shared.done.load(Ordering::Relaxed) as f32 / 1e4
    }

    /// Asks the work to stop.
    pub fn cancel(&self) {
        self.shared.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether [`Job::cancel`] was called.
    pub fn is_cancelled(&self) -> bool {
        self.shared.cancelled.load(Ordering::Relaxed)
    }

    /// Whether the work has ended, well or not.
    pub fn is_finished(&self) -> bool {
        self.shared.finished.load(Ordering::Acquire)
    }

    /// What it broke off with, if it did.
    pub fn fault(&self) -> Option<Fault> {
        self.shared.fault.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Work on a thread of its own, off the frame. Dropping the task asks the work to stop.
#[derive(Debug)]
pub struct Task<T> {
    job: Job,
    result: Mutex<mpsc::Receiver<Result<T, Fault>>>,
}

impl<T: Send + 'static> Task<T> {
    /// Starts `work` and lists its job in `jobs`.
    pub fn spawn(
        jobs: &mut Jobs,
        label: impl Into<String>,
        work: impl FnOnce(&Job) -> T + Send + 'static,
    ) -> Self {
        let task = Self::start(label, work);
        jobs.list.push(task.job.clone());
        task
    }

    /// Starts `work` that nobody needs to see, because it is over at once or waits for the user. If
    /// it panics, `jobs` knows.
    pub fn spawn_unlisted(
        jobs: &mut Jobs,
        label: impl Into<String>,
        work: impl FnOnce(&Job) -> T + Send + 'static,
    ) -> Self {
        let task = Self::start(label, work);
        jobs.unlisted.push(task.job.clone());
        task
    }

    fn start(label: impl Into<String>, work: impl FnOnce(&Job) -> T + Send + 'static) -> Self {
        let job = Job::new(label);
        let (send, receive) = mpsc::channel();
        let theirs = job.clone();
        std::thread::spawn(move || {
            // A panic in the work must not leave the window waiting.
            let result = catch(|| work(&theirs));
            if let Err(fault) = &result {
                *theirs.shared.fault.lock().unwrap_or_else(PoisonError::into_inner) =
                    Some(fault.clone());
            }
            theirs.shared.finished.store(true, Ordering::Release);
            // The receiver is gone when nobody wants the result any more.
            let _ = send.send(result);
        });
        Self { job, result: Mutex::new(receive) }
    }

    /// The handle for progress and cancel.
    pub fn job(&self) -> &Job {
        &self.job
    }

    /// `None` while the work goes on, then once its result, or what it broke off with.
    pub fn poll(&self) -> Option<Result<T, Fault>> {
        let receiver = self.result.lock().unwrap_or_else(PoisonError::into_inner);
        match receiver.try_recv() {
            Ok(result) => Some(result),
            Err(mpsc::TryRecvError::Empty) => None,
            Err(mpsc::TryRecvError::Disconnected) => {
                Some(Err(Fault { what: "its result was taken before".into(), place: None }))
            }
        }
    }
}

impl<T: Send + 'static> Task<T> {
    /// What came of the task in `slot`, which is empty from then on; `None` while it goes on, and
    /// where there is none.
    pub fn take(slot: &mut Option<Self>) -> Option<Result<T, Fault>> {
        let done = slot.as_ref()?.poll()?;
        *slot = None;
        Some(done)
    }
}

/// How work off the frame stands, and what came of it.
#[derive(Debug)]
pub enum Work<T> {
    /// It goes on.
    Running(Task<Result<T, Unfinished>>),
    /// It is there.
    Done(T),
    /// It could not be done: why.
    Failed(String),
    /// Somebody stopped it.
    Cancelled,
}

/// Why work has come to nothing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unfinished {
    /// Somebody stopped it.
    Cancelled,
    /// It could not be done: why.
    Because(String),
}

impl<T: Send + 'static> Work<T> {
    /// Whether it goes on.
    pub const fn is_running(&self) -> bool {
        matches!(self, Self::Running(_))
    }

    /// Asks it to stop, where it goes on.
    pub fn cancel(&self) {
        if let Self::Running(task) = self {
            task.job().cancel();
        }
    }

    /// Takes what has come of it; whether it has just ended.
    pub fn settle(&mut self) -> bool {
        let Self::Running(task) = self else { return false };
        let Some(done) = task.poll() else { return false };
        *self = match done {
            Ok(Ok(done)) => Self::Done(done),
            Ok(Err(Unfinished::Cancelled)) => Self::Cancelled,
            Ok(Err(Unfinished::Because(why))) => Self::Failed(why),
            Err(_) => {
                Self::Failed(format!("the {} broke off: please report it", task.job().label()))
            }
        };
        true
    }
}

/// Does `work` in a pool of one thread that gives way to others, where the system lets threads
/// (Linux): for a [`Task`] that nobody waits for. In the common pool the walks of a frame would
/// wait for it, and as an equal of theirs it would take one of two cores from them.
pub fn aside<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let give_way = |_| {
        #[cfg(target_os = "linux")]
        // Of this thread alone; elsewhere it would be of the whole process. Only a wish: nothing
        // depends on it.
        let _ = rustix::process::setpriority_process(None, 10);
    };
    apart(give_way, work)
}

/// Does `work` in a pool of one thread, as an equal of others: for a [`Task`] that somebody waits
/// for. In the common pool the walks of a frame would wait for it.
pub fn alone<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    apart(|_| {}, work)
}

fn apart<T: Send>(
    start: impl Fn(usize) + Send + Sync + 'static,
    work: impl FnOnce() -> T + Send,
) -> T {
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

/// The jobs that run now, for whoever shows them, and what those that panicked broke off with.
#[derive(Resource, Debug, Default)]
pub struct Jobs {
    list: Vec<Job>,
    unlisted: Vec<Job>,
    faults: Vec<(String, Fault)>,
}

impl Jobs {
    /// Running jobs, oldest first; forgets those that have ended.
    pub fn running(&mut self) -> &[Job] {
        self.sweep();
        &self.list
    }

    /// Asks all of them to stop.
    pub fn cancel_all(&self) {
        self.list.iter().for_each(Job::cancel);
    }

    /// What has broken off since this was asked last, each with what it was doing.
    pub fn take_faults(&mut self) -> Vec<(String, Fault)> {
        self.sweep();
        std::mem::take(&mut self.faults)
    }

    fn sweep(&mut self) {
        let Self { list, unlisted, faults } = self;
        for jobs in [list, unlisted] {
            jobs.retain(|job| {
                let ended = job.is_finished();
                faults.extend(job.fault().filter(|_| ended).map(|fault| (job.label(), fault)));
                !ended
            });
        }
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
    fn parts_fill_their_share_and_take_nothing_back() {
        let job = Job::new("whole");
        let (first, second) = (job.part(0.0, 0.5), job.part(0.5, 1.0));
        assert!(second.step(1, 2).is_ok());
        assert!((job.done() - 0.75).abs() < 1e-3);
        assert!(first.step(1, 1).is_ok());
        assert!((job.done() - 0.75).abs() < 1e-3);
        assert!(second.part(0.5, 1.0).step(1, 2).is_ok());
        assert!((job.done() - 0.875).abs() < 1e-3);
        job.cancel();
        assert!(first.step(0, 1).is_err());
    }

    /// Listed or not: its owner gets the message, and whoever shows jobs gets it once.
    #[test]
    fn a_panicking_task_ends_and_says_why() {
        let mut jobs = Jobs::default();
        for spawn in [Task::spawn, Task::spawn_unlisted] {
            let task: Task<()> = spawn(&mut jobs, "falling over", |_: &Job| panic!("on purpose"));
            let result = loop {
                if let Some(result) = task.poll() {
                    break result;
                }
            };
            assert_eq!(result.map_err(|fault| fault.what), Err("on purpose".into()));
            let faults = jobs.take_faults();
            assert_eq!(
                faults
                    .iter()
                    .map(|(label, fault)| (label.as_str(), fault.what.as_str()))
                    .collect::<Vec<_>>(),
                [("falling over", "on purpose")]
            );
            assert!(jobs.take_faults().is_empty() && jobs.running().is_empty());
        }
    }
}
