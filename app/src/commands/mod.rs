//! One file a command.

mod analyze;
mod attach;
mod campaign;
mod detach;
mod detect;
mod experiment;
mod import;
mod info;
pub(crate) mod linear;
mod measure;
mod merge;
mod new;
mod photo;
mod predict;
mod render;
mod scan;
mod schema;
mod screenshot;
mod validate;
mod verify;
mod view;
mod walks;
mod whole;

use crate::{
    args::{Cli, Command},
    failure::{Failure, Outcome},
    session::Session,
};

/// Runs what the command line says; without a command, the window.
pub(crate) fn run(cli: &Cli, session: &Session) -> Result<Outcome, Failure> {
    match &cli.command {
        None => view::run(session, &crate::args::View::default()),
        Some(Command::View(args)) => view::run(session, args),
        Some(Command::Screenshot(args)) => screenshot::run(session, args),
        Some(Command::Info(args)) => info::run(session, args),
        Some(Command::Validate(args)) => validate::run(session, args),
        Some(Command::New(args)) => new::run(session, args),
        Some(Command::Import(args)) => import::run(session, args),
        Some(Command::Attach(args)) => attach::run(session, args),
        Some(Command::Detach(args)) => detach::run(session, args),
        Some(Command::Schema(args)) => schema::run(args),
        Some(Command::Render(args)) => render::run(session, args),
        Some(Command::Measure(args)) => measure::run(session, args),
        Some(Command::Analyze(args)) => analyze::run(session, args),
        Some(Command::Scan(args)) => scan::run(session, args),
        Some(Command::Detect(args)) => detect::run(session, args),
        Some(Command::Photo(args)) => photo::run(session, args),
        Some(Command::Predict(args)) => predict::run(session, args),
        Some(Command::Experiment(args)) => experiment::run(session, args),
        Some(Command::Verify) => verify::run(session),
        Some(Command::Merge(args)) => merge::run(session, args),
        Some(Command::Campaign(args)) => campaign::run(session, args),
    }
}
