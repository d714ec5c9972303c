//! Commands within another program, such as Python: the same work, settings and JSON as on a command
//! line. Nothing is printed, and no signal is listened to.

use std::{
    ffi::OsString,
    sync::{Arc, Mutex, PoisonError},
};

use clap::error::ErrorKind;
use intrados_ct::SliceError;
use intrados_scene::Scene;
use intrados_stage::{Access, Job, catch};

use crate::{
    args::{Cli, Command, Common},
    commands,
    console::one_line,
    failure::{Failure, Outcome},
    options::{self, Unread},
    processor,
    session::Session,
};

/// Why a command has not done its work.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{line}")]
pub struct Refusal {
    /// The exit code that the program would end with: 1 internal error, 2 wrong usage, 65 bad input,
    /// 66 no input, 73 cannot write, 130 cancelled.
    pub code: u8,
    /// What it would say, one line.
    pub line: String,
}

impl From<Failure> for Refusal {
    fn from(failure: Failure) -> Self {
        Self { code: failure.code(), line: one_line(&failure.to_string()) }
    }
}

impl From<SliceError> for Refusal {
    fn from(error: SliceError) -> Self {
        Failure::from(error).into()
    }
}

/// Loads a scene as commands do. Files that it names may lie beside it, in `INTRADOS_DATA` and in
/// the folders that are `allowed`.
///
/// # Errors
/// The scene or a file that it names is missing or wrong, or the job was cancelled.
pub fn open(
    path: &std::path::Path,
    allowed: Vec<std::path::PathBuf>,
    job: &Job,
) -> Result<Scene, Refusal> {
    guarded(|| Ok(Scene::open_within(path, &Access::new(allowed), job)?))
}

/// Runs `info`, `predict`, `measure`, `analyze` or `detect` by the words of the command line that
/// follow the program's name, and gives what `--format json` prints. A `scene` that is given is
/// taken in the place of the file that the words name.
///
/// # Errors
/// As the command's own, and any other command: it would print, ask or listen.
pub fn answer(
    words: &[OsString],
    scene: Option<&Arc<Scene>>,
    job: &Job,
) -> Result<String, Refusal> {
    let words: Vec<OsString> =
        std::iter::once("intrados".into()).chain(words.iter().cloned()).collect();
    let cli = options::read(words.clone()).map_err(|why| match why {
        Unread::Words(error) => Refusal::from(usage(&error)),
        Unread::Unused(line) => Failure::Usage(line).into(),
    })?;
    guarded(|| {
        let heard = Arc::new(Mutex::new(String::new()));
        let session =
            Session::embedded(&cli.common, job, words.clone(), scene.map(Arc::clone), &heard);
        match commands::run(answering(&cli)?, &session)? {
            // What there was is told to people who wait; a program gets all or nothing.
            Outcome::Interrupted => Err(Failure::Interrupted),
            _ => Ok(std::mem::take(&mut *heard.lock().unwrap_or_else(PoisonError::into_inner))),
        }
    })
}

/// Does work that may fail, on a processor that knows its instructions; a panic is an internal
/// error.
fn guarded<T>(work: impl FnOnce() -> Result<T, Failure>) -> Result<T, Refusal> {
    if !processor::is_known() {
        return Err(Failure::Internal(processor::TOO_OLD.into()).into());
    }
    match catch(work) {
        Ok(done) => done.map_err(Refusal::from),
        Err(fault) => Err(Failure::Internal(format!("{fault}: please report it")).into()),
    }
}

/// The command line, where its command answers in JSON and asks nobody.
fn answering(cli: &Cli) -> Result<&Cli, Failure> {
    match (&cli.command, &cli.common) {
        (_, Common { threads: Some(_), .. }) => {
            Err(Failure::Usage("--threads: set RAYON_NUM_THREADS before the first call".into()))
        }
        (
            Some(
                Command::Info(_)
                | Command::Predict(_)
                | Command::Measure(_)
                | Command::Analyze(_)
                | Command::Detect(_),
            ),
            _,
        ) => Ok(cli),
        _ => Err(Failure::Usage(
            "within another program there are info, predict, measure, analyze and detect".into(),
        )),
    }
}

/// What clap says, without its hints on how to type.
fn usage(why: &clap::Error) -> Failure {
    let said = why.to_string();
    let line = match why.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => "there is no help here".into(),
        _ => said.split("\n\n").next().unwrap_or_default().replacen("error: ", "", 1),
    };
    Failure::Usage(line)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(words: &[&str]) -> Result<String, Refusal> {
        let words: Vec<OsString> = words.iter().map(OsString::from).collect();
        answer(&words, None, &Job::default())
    }

    #[test]
    fn a_command_answers_in_json_or_refuses_in_a_line() {
        let told = asked(&["info", "room"]).expect("a bundled scene");
        assert!(told.starts_with('{') && told.contains("intrados.info/1"), "{told}");
        let refused = |words: &[&str]| asked(words).expect_err("refused");
        assert_eq!(refused(&["info", "nowhere.ron"]).code, 66);
        assert_eq!(refused(&["view"]).code, 2);
        let wrong = refused(&["predict", "room", "--ahead", "soon"]);
        assert!(wrong.code == 2 && !wrong.line.contains('\n'), "{wrong}");
    }

    #[test]
    fn a_scene_that_is_given_is_taken_and_a_cancelled_job_ends() {
        let scene = open(std::path::Path::new("room"), Vec::new(), &Job::default());
        let scene = Arc::new(scene.expect("a bundled scene"));
        let words = ["info", "no such file"].map(OsString::from);
        assert!(answer(&words, Some(&scene), &Job::default()).is_ok());
        let job = Job::default();
        job.cancel();
        let words = ["measure", "room", "--spp", "1"].map(OsString::from);
        assert_eq!(answer(&words, Some(&scene), &job).expect_err("cancelled").code, 130);
    }
}
