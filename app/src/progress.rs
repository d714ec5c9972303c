//! How far the work is, on stderr: a bar on a terminal, else a line every ten seconds.

use std::{
    io::IsTerminal,
    sync::mpsc::{RecvTimeoutError, Sender, channel},
    thread::JoinHandle,
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressStyle};
use intrados_stage::Job;

use crate::console::{printable, say};

/// Shows a job until it is dropped.
pub(crate) struct Progress(Option<(Sender<()>, JoinHandle<()>)>);

/// Between two looks at the job.
const TICK: Duration = Duration::from_millis(100);
/// Between two lines where there is no terminal.
const LINE: Duration = Duration::from_secs(10);
/// Steps of the bar.
const STEPS: u64 = 1000;

impl Progress {
    pub(crate) fn watch(job: &Job, quiet: bool) -> Self {
        if quiet {
            return Self(None);
        }
        let (job, (stop, stopped)) = (job.clone(), channel());
        let thread = std::thread::spawn(move || {
            let mut show: Box<dyn FnMut(&Job)> =
                if std::io::stderr().is_terminal() { bar() } else { lines() };
            while stopped.recv_timeout(TICK) == Err(RecvTimeoutError::Timeout) {
                show(&job);
            }
        });
        Self(Some((stop, thread)))
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some((stop, thread)) = self.0.take() {
            drop(stop);
            // It only shows: if it panicked, the work is none the worse.
            let _ = thread.join();
        }
    }
}

struct Bar(ProgressBar);

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

fn bar() -> Box<dyn FnMut(&Job)> {
    let style = ProgressStyle::with_template("{bar:24} {percent:>3} % {elapsed} {wide_msg}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = Bar(ProgressBar::new(STEPS).with_style(style));
    Box::new(move |job| {
        bar.0.set_position((f64::from(job.done()) * STEPS as f64) as u64);
        bar.0.set_message(printable(&job.label()).replace('\n', " "));
    })
}

fn lines() -> Box<dyn FnMut(&Job)> {
    let mut last = Instant::now();
    Box::new(move |job| {
        if last.elapsed() >= LINE {
            last = Instant::now();
            say(format_args!("{:3.0} % {}", 100.0 * job.done(), job.label()));
        }
    })
}
