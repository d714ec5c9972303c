//! `intrados validate`: every problem in a file.

use std::path::Path;

use intrados_damage::{evidence::called, ledger};
use intrados_predict::{doubted, foreseen};
use intrados_scene::{ErrorKind, Problem, Scene, Severity, gltf, structure::Observation};
use intrados_survey::{Beforehand, beforehand};
use serde::Serialize;

use super::render::MapRows;
use crate::{
    args,
    console::one_line,
    failure::{Failure, Outcome},
    output,
    session::Session,
};

/// All files. Schema `intrados.validate/1`.
#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    version: &'static str,
    files: Vec<Findings>,
    errors: usize,
    warnings: usize,
}

#[derive(Debug, Serialize)]
struct Findings {
    file: String,
    errors: usize,
    warnings: usize,
    problems: Vec<Problem>,
    #[serde(skip)]
    missing: bool,
}

pub(crate) fn run(session: &Session, args: &args::Files) -> Result<Outcome, Failure> {
    let mut files = Vec::new();
    for file in &args.files {
        let _progress = session.watch(format!("checking {}", file.display()));
        files.push(check(session, file)?);
    }
    let sum = |count: fn(&Findings) -> usize| files.iter().map(count).sum();
    let report = Report {
        schema: "intrados.validate/1",
        version: env!("CARGO_PKG_VERSION"),
        errors: sum(|f| f.errors),
        warnings: sum(|f| f.warnings),
        files,
    };
    session.print(&report, || report.table())?;
    let missing = |f: &&Findings| f.missing;
    Ok(match report.files.iter().find(missing) {
        _ if report.files.iter().any(|f| !f.missing && f.errors > 0) => Outcome::Faulty,
        Some(_) => Outcome::Missing,
        None => Outcome::Done,
    })
}

fn check(session: &Session, file: &Path) -> Result<Findings, Failure> {
    let extension =
        file.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let is_model = matches!(extension.as_str(), "glb" | "gltf") && file.is_file();
    let (mut problems, missing) =
        if is_model { model(session, file)? } else { scene(session, file)? };
    problems.iter_mut().for_each(|p| p.message = one_line(&p.message));
    let count = |severity| problems.iter().filter(|p| p.severity == severity).count();
    Ok(Findings {
        file: file.display().to_string(),
        errors: count(Severity::Error),
        warnings: count(Severity::Warning),
        problems,
        missing,
    })
}

/// The rules of glTF, one by one.
fn model(session: &Session, file: &Path) -> Result<(Vec<Problem>, bool), Failure> {
    match gltf::validate_within(file, &session.access, &session.job) {
        Ok(problems) => Ok((problems.into_iter().map(Problem::from).collect(), false)),
        Err(gltf::ImportError::Cancelled(_)) => Err(Failure::Interrupted),
        Err(gltf::ImportError::Damaged { problem, .. }) => {
            Ok((vec![Problem::from(*problem)], false))
        }
        Err(gltf::ImportError::Read { source, .. }) => {
            Ok((vec![Problem::error("", "NO_INPUT", source.to_string())], source.is_missing()))
        }
    }
}

/// A scene and all that it names.
fn scene(session: &Session, file: &Path) -> Result<(Vec<Problem>, bool), Failure> {
    match Scene::open_within(file, &session.access, &session.job) {
        Ok(scene) => {
            let mut problems: Vec<Problem> =
                scene.warnings.iter().map(|w| Problem::warning("", "WARNING", w)).collect();
            let not_used = |(place, item): (String, ledger::Item)| {
                Problem::warning(
                    place,
                    "NOT_USED",
                    format!("{} ({}): {}", item.item, called(item.source), item.verdict()),
                )
            };
            problems.extend(foreseen(&scene, &session.job)?.into_iter().map(not_used));
            problems.extend(unheard(&scene));
            let doubts = doubted(&scene).into_iter();
            problems
                .extend(doubts.map(|(place, doubt)| Problem::warning(place, "PIXEL_SIZE", doubt)));
            Ok((problems, false))
        }
        Err(error) => match error.kind() {
            ErrorKind::Cancelled => Err(Failure::Interrupted),
            kind => Ok((error.problems().to_vec(), kind == ErrorKind::NoInput)),
        },
    }
}

/// Observations that a prediction will not hear, or hear as of concrete, since their member has no
/// such steel or is of another matter: what can be told without computing. Those of one member and
/// one reason are one warning.
fn unheard(scene: &Scene) -> Vec<Problem> {
    let mut found: Vec<(&str, Beforehand, Vec<&Observation>)> = Vec::new();
    for observation in &scene.structure.observations {
        let Some(assembly) = scene.structure.assembly_of(&observation.member) else { continue };
        let Some(why) = beforehand(assembly, observation) else { continue };
        match found.iter_mut().find(|(m, w, _)| *m == observation.member && *w == why) {
            Some((_, _, all)) => all.push(observation),
            None => found.push((&observation.member, why, vec![observation])),
        }
    }
    let told = |(member, why, all): (&str, Beforehand, Vec<&Observation>)| {
        let (code, why) = match why {
            Beforehand::AsConcrete(why) => ("NOT_CONCRETE", why),
            Beforehand::NotUsed(why) => ("NOT_USED", format!("not used, because {why}")),
        };
        let first = all.first().map_or(String::new(), |o| intrados_survey::name(o));
        let more = match all.len() {
            0 | 1 => String::new(),
            n => format!(" and {} more", n - 1),
        };
        let place = format!("evidence of {}", scene.name_of(member));
        Problem::warning(place, code, format!("{first}{more}: {why}"))
    };
    found.into_iter().map(told).collect()
}

impl Report {
    fn table(&self) -> String {
        let mut text = String::new();
        for file in &self.files {
            let word = |p: &Problem| match p.severity {
                Severity::Note => "note",
                Severity::Warning => "warning",
                Severity::Error => "error",
            };
            text += &match (file.errors, file.warnings) {
                (0, 0) => format!("{}: fine\n", file.file),
                (errors, warnings) => {
                    format!("{}: {errors} errors, {warnings} warnings\n", file.file)
                }
            };
            let row = |p: &Problem| [format!("  {}", word(p)), p.code.to_owned(), p.to_string()];
            text += &output::table(&file.problems.iter().map(row).collect::<Vec<_>>().map_rows());
        }
        text
    }
}
