//! `intrados validate`: every problem in a file.

use std::path::Path;

use intrados_damage::{evidence::called, ledger, zone::zone_at};
use intrados_predict::{doubted, foreseen};
use intrados_scene::{
    Assembly, ErrorKind, Part, Problem, Scene, Severity, SteelLine, gltf,
    structure::{Observation, Shows},
};
use intrados_survey::only_of_rust;
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
    let mut found: Vec<(&str, (&'static str, String), Vec<&Observation>)> = Vec::new();
    for observation in &scene.structure.observations {
        let Some(assembly) = scene.structure.assembly_of(&observation.member) else { continue };
        let Some(why) = why_unheard(assembly, observation) else { continue };
        match found.iter_mut().find(|(m, w, _)| *m == observation.member && *w == why) {
            Some((_, _, all)) => all.push(observation),
            None => found.push((&observation.member, why, vec![observation])),
        }
    }
    let told = |(member, (code, why), all): (&str, (&'static str, String), Vec<&Observation>)| {
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

/// The code of a warning, and its reason. The rules are those of the survey's and the forecast's
/// rust, by zone.
fn why_unheard(assembly: &Assembly, observation: &Observation) -> Option<(&'static str, String)> {
    let shows = &observation.shows;
    if let Some(matter) = &assembly.matter
        && matches!(
            shows,
            Shows::Rebound { .. } | Shows::Velocity { .. } | Shows::CoreStrength { .. }
        )
    {
        let why = format!("the member is of {}, and is read as if that were concrete", matter.name);
        return Some(("NOT_CONCRETE", why));
    }
    if !only_of_rust(shows) {
        return None;
    }
    let not_used = |why: String| Some(("NOT_USED", format!("not used, because {why}")));
    let is_bar = |line: &&SteelLine| line.part != Part::Tendon;
    if !assembly.steel.iter().any(|line| is_bar(&line)) {
        return not_used(match &assembly.matter {
            Some(matter) => format!("it speaks of the rust of bars, and the member is of {}", matter.name),
            None => "it speaks of the rust of bars, and none are known of the member: give reinforcement in details of the scene".into(),
        });
    }
    let Some(exposure) = &assembly.exposure else {
        return not_used("nothing says what attacks the member: give its exposure class".into());
    };
    let by_salt = exposure.chloride.is_some()
        || exposure.classes().any(|class| class.starts_with("XD") || class.starts_with("XS"));
    match shows {
        Shows::Chloride { .. } if !by_salt => {
            return not_used(
                "by its exposure class there is no salt: name an XD or XS class in exposure".into(),
            );
        }
        Shows::Carbonation { .. } if by_salt => {
            return not_used("by its exposure class salt takes its steel first, and carbonation is not computed beside it".into());
        }
        _ => {}
    }
    let [from, to] = observation.spot.along.map(|at| zone_at(f64::from(at)));
    let bars = assembly.steel.iter().filter(is_bar);
    (!assembly.is_tunnel() && !bars.flat_map(|l| l.line.windows(2)).any(|ends| runs(assembly, ends, [from, to])))
        .then(|| ("NOT_USED", "not used, because no bars run along the member there: give reinforcement in details of the scene".to_owned()))
}

/// Whether a piece of a bar runs along a member within these zones of it.
fn runs(assembly: &Assembly, ends: &[glam::Vec3], [from, to]: [usize; 2]) -> bool {
    let (axis, start) = (assembly.frame.axis, assembly.frame.start);
    let [a, b] = [ends[0], ends[1]];
    let is_along = (b - a).normalize_or_zero().dot(axis.normalize_or_zero()).abs() >= 0.9;
    let zone = |p: glam::Vec3| {
        zone_at(f64::from((p - start).dot(axis) / axis.length_squared().max(1e-12)))
    };
    let (one, other) = (zone(a), zone(b));
    is_along && one.min(other) <= to && one.max(other) >= from
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
