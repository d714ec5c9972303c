//! `intrados predict`: all evidence, damage per member, report.

use std::{ffi::OsString, path::Path, sync::Arc, time::Duration};

use bevy_app::App;
use intrados_ct::detect;
use intrados_damage::{
    evidence::called,
    grading::{Profile, ProfileError},
    ledger::Group,
};
use intrados_forecast as forecast;
use intrados_light::{LitScene, plugin::Lit};
use intrados_predict::{PredictSettings, Predicting, Prediction, Progress};
use intrados_report::{Document, Record, RecordError, check_model, pdf};
use intrados_scene::{
    Scene,
    plugin::install,
    structure::{Date, Project},
};
use intrados_stage::{Job, Jobs, Pace};

use super::{info::kind_name, render::MapRows, walks};
use crate::{
    args,
    failure::{Failure, Outcome},
    output::{self, Shared},
    predicting,
    session::Session,
};

pub(crate) fn run(session: &Session, args: &args::Predict) -> Result<Outcome, Failure> {
    let mut scene = walks::load(session, &args.scene)?;
    put_on(&mut Arc::make_mut(&mut scene.structure).project, &args.cover);
    check_inspected(&scene, args.cover.inspected)?;
    if let Some(model) = &args.ifc {
        check_model(model, &scene, &session.job)?;
    }
    // Not after an hour's work.
    if args.pdf && pdf::printer().is_none() {
        return Err(pdf::PdfError::NoPrinter.into());
    }
    let settings = PredictSettings {
        detect: detect::DetectSettings {
            method: args.method.into(),
            ..detect::DetectSettings::default()
        },
        profile: profile(&scene, args.profile.as_deref())?,
        forecast: (!args.no_forecast).then_some(forecast::ForecastSettings {
            ahead_years: args.ahead,
            element_m: args.element,
            ..forecast::ForecastSettings::default()
        }),
        strength: args.strength,
        strict: args.strict,
        ..predicting()
    };
    let key = (
        scene.hash.clone(),
        settings.profile.rule,
        settings.detect,
        settings.forecast,
        settings.simulation,
        settings.strict,
    );
    let (parts, document) = output::in_shared_parts(session, &args.out, &key, |parts| {
        let _progress = session.watch(format!("the evidence of {}", scene.name));
        let (prediction, lit) = predicted(session, scene, settings.clone(), parts)?;
        session.job.relabel("the report");
        let record = Record {
            command: command(&session.words),
            samples: args.spp,
            seed: args.seed,
            ifc: args.ifc.clone(),
            pdf: args.pdf,
        };
        Ok(record.make(&args.out, &lit, prediction, &session.job.part(EVIDENCE, 1.0))?)
    })?;
    output::locked(&parts).forget();
    session.print(&document, || table(&document))?;
    Ok(Outcome::Done)
}

/// Says on the cover what the command line says.
fn put_on(project: &mut Project, cover: &args::Cover) {
    let args::Cover { structure, owner, inspector, place, purpose, inspected } = cover;
    let said = [
        (&mut project.structure, structure),
        (&mut project.owner, owner),
        (&mut project.inspector, inspector),
        (&mut project.place, place),
        (&mut project.purpose, purpose),
    ];
    for (on_cover, said) in said {
        if let Some(said) = said {
            said.trim().clone_into(on_cover);
        }
    }
    project.inspected = inspected.or(project.inspected);
}

/// Refuses a day of inspection that has not come, and doubts one before what was seen.
fn check_inspected(scene: &Scene, day: Option<Date>) -> Result<(), Failure> {
    let Some(day) = day else { return Ok(()) };
    if day.is_to_come() {
        return Err(Failure::Usage(format!("--inspected: {}", day.to_come())));
    }
    if let Some(last) = scene.structure.dates().pop().filter(|last| *last > day) {
        tracing::warn!(
            "--inspected: {day} is before {last}, when something of it was still seen or read: is the day right? all ages count from it"
        );
    }
    Ok(())
}

/// Share of the progress that reading the evidence takes; the rest is the report's.
const EVIDENCE: f64 = 0.9;

/// Between two looks at the app's queue.
const FRAME: Duration = Duration::from_millis(2);

/// Puts the scene into the app and updates that until its queue is empty: what the window does,
/// without anybody who looks at frames. The prediction, and the scene as light sees it.
fn predicted(
    session: &Session,
    scene: Scene,
    settings: PredictSettings,
    parts: &Shared,
) -> Result<(Prediction, Arc<LitScene>), Failure> {
    let sources = scene.sources.clone();
    let mut app = (session.build)();
    let profile = Some(settings.profile.clone());
    app.insert_resource(Pace::Unwatched).insert_resource(session.access.clone());
    app.insert_resource(Predicting {
        settings,
        profile,
        parts: Some(Arc::clone(parts)),
        ..Predicting::default()
    });
    install(app.world_mut(), scene);
    let drained = drain(session, &mut app);
    // What was kept of files that are others by now is of no use to the next run.
    if let (Err(Failure::Interrupted), Ok(Some(path))) =
        (&drained, sources.first_changed(&Job::default()))
    {
        return Err(RecordError::Changed(path.to_owned()).into());
    }
    drained?;
    session.job.check()?;
    let prediction = app.world().resource::<Progress>().prediction();
    let lit = app.world().get_resource::<Lit>().map(|lit| Arc::clone(&lit.0));
    prediction
        .zip(lit)
        .ok_or_else(|| Failure::Internal("the app has no scene: a plugin has taken it away".into()))
}

/// Updates the app until nothing is left to predict and the scene is ready for light.
fn drain(session: &Session, app: &mut App) -> Result<(), Failure> {
    // A part of a job never goes back, and every piece begins with a job of its own.
    let whole = session.job.part(0.0, EVIDENCE);
    loop {
        app.update();
        let has_light = app.world().contains_resource::<Lit>();
        let mut progress = app.world_mut().resource_mut::<Progress>();
        let job = progress.job().cloned();
        if let Some(job) = &job {
            session.job.relabel(job.label());
            if whole.step((1e4 * job.done()) as usize, 10_000).is_err() {
                job.cancel();
            }
        }
        if let Some(failure) = progress.take_failures().into_iter().next() {
            return Err(failure.into());
        }
        let is_cancelled = progress.is_cancelled();
        let is_done = !progress.is_busy();
        // Whatever else broke off, the scene's preparation for light among it, would be waited for
        // in vain.
        if let Some((work, fault)) =
            app.world_mut().resource_mut::<Jobs>().take_faults().into_iter().next()
        {
            return Err(Failure::Internal(format!("{work}: {fault}")));
        }
        if is_cancelled || job.is_none() && session.job.is_cancelled() {
            return Err(Failure::Interrupted);
        }
        if is_done && has_light {
            return Ok(());
        }
        std::thread::sleep(FRAME);
    }
}

/// The profile of the command line, a file or the name of one that is built in; or the scene's.
fn profile(scene: &Scene, asked: Option<&Path>) -> Result<Profile, Failure> {
    let profile = match asked {
        None => Profile::of(scene).map(Option::unwrap_or_default),
        Some(path) => match path.to_str().and_then(Profile::built_in).filter(|_| !path.is_file()) {
            Some(built_in) => Ok(built_in),
            None => Profile::read(path),
        },
    };
    profile.map_err(|why| match why {
        ProfileError::Unread { path, why } => Failure::denied(&path, &why),
        other => Failure::BadInput(other.to_string()),
    })
}

/// A command as a shell takes it again. What is no text in it cannot be shown as it is.
fn command(words: &[OsString]) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=,:+@%".contains(c);
    let word = |word: &OsString| {
        let word = word.to_string_lossy().into_owned();
        if !word.is_empty() && word.chars().all(plain) {
            word
        } else {
            format!("'{}'", word.replace('\'', r"'\''"))
        }
    };
    words.iter().map(word).collect::<Vec<_>>().join(" ")
}

fn table(document: &Document) -> String {
    let prediction = &document.prediction;
    let mut rows = vec![
        ["member", "kind", "damage", "std error", "state", "basis", "truth", "evidence"]
            .map(String::from),
    ];
    let number = |x: Option<f64>| x.map_or("-".into(), |x| format!("{x:.3}"));
    for m in prediction.failing_first() {
        rows.push([
            m.name.clone(),
            kind_name(m.kind),
            number(m.damage),
            number(m.damage_std_error),
            m.state.clone(),
            m.basis.name().to_owned(),
            number(m.truth.as_ref().map(|t| t.damage)),
            m.evidence
                .values()
                .map(|e| format!("{} {:.2}", called(e.source), e.damage))
                .collect::<Vec<_>>()
                .join(", "),
        ]);
    }
    let mut text = output::table(&rows.map_rows());
    for failure in &prediction.failures {
        text += &format!("failure {}: {}\n", failure.name, failure.reason);
    }
    for line in &prediction.assumptions_to_check {
        text += &format!("check {line}\n");
    }
    text += &ledger(prediction);
    for m in &prediction.members {
        m.conflicts.iter().for_each(|c| text += &format!("conflict {}, {c}\n", m.name));
        if let Some(seen) = m.photographed() {
            text += &format!("faces {}: {seen}\n", m.name);
        }
        if let Some(capacity) = &m.capacity {
            text += &format!("strength {}: {}\n", m.name, capacity.told());
        }
        if let Some(check) = m.crack_check.as_ref().filter(|c| c.exceeded) {
            text += &format!(
                "crack {}: {:.2} mm ({}), limit {} mm in {}\n",
                m.name,
                check.width_mm,
                called(check.source),
                check.limit_mm,
                check.exposure
            );
        }
    }
    prediction.limits.iter().for_each(|l| text += &format!("note: {l}\n"));
    document.files.iter().for_each(|f| text += &format!("file {f}\n"));
    text
}

/// Every item of evidence and what became of it; items alike share a line.
fn ledger(prediction: &Prediction) -> String {
    let mut rows = vec![["member", "source", "evidence", "used"].map(String::from)];
    for group in Group::all(&prediction.items) {
        let first = group.first();
        let member = prediction.name_of(&first.member).to_owned();
        rows.push([member, called(first.source).to_owned(), group.name(), first.verdict()]);
    }
    if rows.len() > 1 { format!("\n{}\n", output::table(&rows.map_rows())) } else { String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_can_be_given_again() {
        let words = ["intrados", "predict", "Brücke.ron", "--out", "two words", "it's", ""]
            .map(OsString::from);
        assert_eq!(command(&words), r"intrados predict Brücke.ron --out 'two words' 'it'\''s' ''");
    }

    #[cfg(unix)]
    #[test]
    fn words_need_not_be_text() {
        use std::os::unix::ffi::OsStringExt;
        assert_eq!(command(&[OsString::from_vec(vec![b'a', 0xff])]), "'a\u{fffd}'");
    }
}
