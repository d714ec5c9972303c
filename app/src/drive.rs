//! Progressive work from its first pass to the stop rule that ends it.

use std::time::{Duration, Instant};

use serde::Serialize;

use crate::{
    args,
    failure::{Failure, Outcome},
    session::Session,
};

/// Work that goes on pass by pass and gets better.
pub(crate) trait Work {
    /// Passes done, as the schedule counts them.
    fn passes(&self) -> u64;
    /// Does `n` passes. False once its samples are all taken.
    fn advance(&mut self, n: u32) -> bool;
    /// Share of its samples taken, 0 to 1; 0 where there is no limit.
    fn done(&self) -> f64;
    /// The relative error that a target is compared with, and whether it may be trusted.
    fn error(&self) -> (f64, bool);
    /// One line for the progress.
    fn label(&self) -> String;
    /// Writes the state of the work.
    fn save(&self) -> Result<(), Failure>;
}

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rules {
    pub(crate) spp: Option<u64>,
    pub(crate) time: Option<Duration>,
    pub(crate) target: Option<f64>,
    /// Whether it matters to the user that the target is reached.
    pub(crate) must_reach: bool,
}

/// Which rule stopped the work.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Stopped {
    Spp,
    TimeLimit,
    TargetRelError,
    Interrupted,
}

impl Stopped {
    /// For people.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Spp => "--spp: all samples taken",
            Self::TimeLimit => "--time-limit",
            Self::TargetRelError => "--target-rel-error: reached",
            Self::Interrupted => "a signal: not all that was asked for",
        }
    }
}

impl Rules {
    /// What the user asked for, or `default` where that is nothing.
    pub(crate) fn new(stop: &args::Stop, default: Self) -> Self {
        match stop {
            args::Stop { spp: None, time_limit: None, target_rel_error: None } => default,
            &args::Stop { spp, time_limit, target_rel_error: target } => {
                Self { spp, time: time_limit, target, must_reach: target.is_some() }
            }
        }
    }

    /// How a command ends whose work was stopped so.
    pub(crate) fn outcome(&self, stopped: Stopped, reached: Option<bool>) -> Outcome {
        match stopped {
            Stopped::Interrupted => Outcome::Interrupted,
            _ if self.must_reach && reached == Some(false) => Outcome::TargetNotReached,
            _ => Outcome::Done,
        }
    }

    /// Whether the work has an error at most the target that may be trusted; `None` without a
    /// target.
    pub(crate) fn reached(&self, work: &impl Work) -> Option<bool> {
        self.target.map(|target| matches!(work.error(), (error, true) if error <= target))
    }
}

/// Longest way between two looks at the error, in passes.
const LONGEST: u64 = 64;

/// The pass at which the error is looked at next: 1, 2, 4 … 64, 128, 192 …: fixed, so that whether
/// a target is reached depends on no clock and no number of threads, and resuming changes nothing.
fn next_look(passes: u64) -> u64 {
    if passes < LONGEST {
        (passes + 1).next_power_of_two()
    } else {
        (passes / LONGEST + 1) * LONGEST
    }
}

/// Runs `work` until a rule or a signal stops it; saves it every `save_every`, and at the end.
/// Something of it is always done.
pub(crate) fn drive(
    session: &Session,
    work: &mut impl Work,
    rules: &Rules,
    save_every: Option<Duration>,
) -> Stopped {
    let begin = Instant::now();
    let mut saved = Instant::now();
    // Enough batches that no thread waits long for the last one.
    let chunk = 4 * rayon::current_num_threads() as u64;
    let progress = session.watch(work.label());
    let stopped = 'looks: loop {
        if rules.reached(work) == Some(true) {
            break Stopped::TargetRelError;
        }
        let look = next_look(work.passes());
        while work.passes() < look {
            let more = work.advance(chunk.min(look - work.passes()) as u32);
            session.job.relabel(work.label());
            if !more {
                break 'looks Stopped::Spp;
            }
            if session.job.step((1e4 * share(work, rules, begin)) as usize, 10_000).is_err() {
                break 'looks Stopped::Interrupted;
            }
            if rules.time.is_some_and(|limit| begin.elapsed() >= limit) {
                break 'looks Stopped::TimeLimit;
            }
            if save_every.is_some_and(|every| saved.elapsed() >= every) {
                save(work);
                saved = Instant::now();
            }
        }
    };
    drop(progress);
    if save_every.is_some() {
        save(work);
    }
    if stopped == Stopped::Interrupted {
        session.note(format_args!("interrupted: what was reached by then is kept, and says so"));
    }
    stopped
}

/// That its state cannot be kept is no reason to end healthy work.
fn save(work: &impl Work) {
    if let Err(why) = work.save() {
        tracing::warn!("{why}; the work goes on without this checkpoint");
    }
}

/// How far the work is towards the rule that will probably stop it, 0 to 1.
fn share(work: &impl Work, rules: &Rules, begin: Instant) -> f64 {
    let time = rules
        .time
        .map_or(0.0, |limit| begin.elapsed().as_secs_f64() / limit.as_secs_f64().max(1e-9));
    // The error falls with the root of the work.
    let error = rules.target.map_or(0.0, |target| (target / work.error().0).powi(2));
    [work.done(), time, error].into_iter().filter(|x| x.is_finite()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looks_do_not_depend_on_where_one_begins() {
        let mut looks = vec![next_look(0)];
        while looks[looks.len() - 1] < 300 {
            looks.push(next_look(looks[looks.len() - 1]));
        }
        assert_eq!(looks, [1, 2, 4, 8, 16, 32, 64, 128, 192, 256, 320]);
        for begin in 0..300 {
            assert!(looks.contains(&next_look(begin)), "{begin}");
        }
    }
}
