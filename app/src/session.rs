//! What every command needs: how to speak, the job that a signal cancels, threads, logs.

use std::{
    ffi::OsString,
    fmt::Display,
    io::IsTerminal,
    panic::{AssertUnwindSafe, catch_unwind},
    process::ExitCode,
    sync::{Arc, Mutex},
};

use intrados_scene::Scene;
use intrados_stage::{Access, Job};
use tracing_subscriber::EnvFilter;

use crate::{
    Build,
    args::{Cli, Command, Common, Format},
    console::{LogWriter, one_line, say},
    failure::{Failure, Outcome},
    progress::Progress,
};

/// One run of the program.
pub(crate) struct Session {
    pub(crate) format: Format,
    /// The work of this run; SIGINT and SIGTERM cancel it.
    pub(crate) job: Job,
    /// Where files may lie that scenes name.
    pub(crate) access: Access,
    /// Makes the app that predicts or that the window shows.
    pub(crate) build: Build,
    /// The command, word by word, as a report quotes it.
    pub(crate) words: Vec<OsString>,
    /// A scene that who runs the command has loaded already.
    pub(crate) given: Option<Arc<Scene>>,
    pub(crate) listener: Listener,
    quiet: bool,
}

/// Who hears the result of a command.
#[derive(Debug, Clone)]
pub(crate) enum Listener {
    /// Whoever reads stdout.
    User,
    /// Another command, which reads the files of this one.
    Files,
    /// Another program that runs the command within itself: JSON.
    Caller(Arc<Mutex<String>>),
}

impl Session {
    /// The same for a command that another one runs: it prints nothing.
    pub(crate) fn within(&self) -> Self {
        Self {
            format: self.format,
            job: self.job.clone(),
            access: self.access.clone(),
            build: Build::clone(&self.build),
            words: self.words.clone(),
            given: None,
            listener: Listener::Files,
            quiet: true,
        }
    }

    /// For a program that runs a command within itself and shows the job's progress its own way.
    pub(crate) fn embedded(
        common: &Common,
        job: &Job,
        words: Vec<OsString>,
        given: Option<Arc<Scene>>,
        answer: &Arc<Mutex<String>>,
    ) -> Self {
        Self {
            format: Format::Json,
            job: job.clone(),
            access: Access::new(common.allow.clone()),
            build: Arc::new(crate::simulation),
            words,
            given,
            listener: Listener::Caller(Arc::clone(answer)),
            quiet: true,
        }
    }

    /// Whether this is a command within another program.
    pub(crate) fn is_embedded(&self) -> bool {
        matches!(self.listener, Listener::Caller(_))
    }

    /// A line for the user on stderr, unless it is to be quiet.
    pub(crate) fn note(&self, line: impl Display) {
        if !self.quiet {
            say(format_args!("intrados: {line}"));
        }
    }

    /// Shows the job's progress until the guard is dropped.
    pub(crate) fn watch(&self, label: impl Into<String>) -> Progress {
        self.job.relabel(label);
        // Parts of a job never take progress back: it begins anew here. A cancel is heard at the
        // work's own next step.
        let _ = self.job.step(0, 1);
        Progress::watch(&self.job, self.quiet)
    }
}

/// Sets the program up, runs `command` and turns what comes of it into an exit code and at most one
/// line on stderr.
pub(crate) fn run(
    cli: &Cli,
    build: Build,
    command: fn(&Cli, &Session) -> Result<Outcome, Failure>,
) -> ExitCode {
    let common = &cli.common;
    start_log(common);
    let session = Session {
        format: common.format,
        job: Job::new("starting"),
        access: Access::new(common.allow.clone()),
        build,
        words: std::env::args_os().collect(),
        given: None,
        listener: Listener::User,
        quiet: common.quiet,
    };
    let result = catch_unwind(AssertUnwindSafe(|| {
        start_threads(common)?;
        // A window has nothing to write: it may be ended as any other.
        if !matches!(cli.command, None | Some(Command::View(_))) {
            heed_signals(&session.job)?;
        }
        command(cli, &session)
    }));
    let code = match result {
        Ok(Ok(outcome)) => outcome.code(),
        Ok(Err(failure)) => {
            say(format_args!("intrados: {}", one_line(&failure.to_string())));
            failure.code()
        }
        // The panic has already said where.
        Err(_) => {
            say("intrados: internal error: please report it with the lines above and the command");
            1
        }
    };
    ExitCode::from(code)
}

fn start_log(common: &Common) {
    let level = match (common.quiet, common.verbose) {
        (true, _) => "error",
        (false, 0) => "warn",
        (false, 1) => "info",
        (false, _) => "debug",
    };
    let colour = std::io::stderr().is_terminal()
        && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty());
    tracing_subscriber::fmt()
        .with_env_filter(
            EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(level)),
        )
        .with_writer(|| LogWriter)
        .with_ansi(colour)
        // Else it panics where stderr is full.
        .log_internal_errors(false)
        .without_time()
        .with_target(false)
        .init();
}

fn start_threads(common: &Common) -> Result<(), Failure> {
    let Some(threads) = common.threads else { return Ok(()) };
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads as usize)
        .build_global()
        .map_err(|e| Failure::Internal(format!("cannot start {threads} threads: {e}")))
}

/// The first signal asks the work to stop at the end of its pass, the second one ends the program.
fn heed_signals(job: &Job) -> Result<(), Failure> {
    let job = job.clone();
    ctrlc::set_handler(move || {
        if job.is_cancelled() {
            std::process::exit(130);
        }
        job.cancel();
    })
    .map_err(|e| Failure::Internal(format!("cannot listen to signals: {e}")))
}
