//! `intrados predict`: all evidence, damage per member, report.

use std::path::Path;

use intrados_damage::{
    Prediction, detect, forecast,
    grading::{Profile, ProfileError},
    ledger::Group,
    predict::{Settings, predict},
    report::Record,
};
use intrados_scene::Scene;

use super::{info::kind_name, render::MapRows, walks};
use crate::{
    args,
    failure::{Failure, Outcome},
    output,
    session::Session,
};

pub(crate) fn run(session: &Session, args: &args::Predict) -> Result<Outcome, Failure> {
    let opened = walks::open(session, &args.scene)?;
    let scene = &opened.scene;
    let settings = Settings {
        detect: detect::Settings { method: args.method.into(), ..detect::Settings::default() },
        profile: profile(scene, args.profile.as_deref())?,
        forecast: (!args.no_forecast).then_some(forecast::Settings { ahead_years: args.ahead, element_m: args.element }),
        strict: args.strict,
        ..Settings::default()
    };
    output::folder(&args.out)?;
    output::may_write(&args.out.join("report.html"))?;
    let mut prediction = {
        let _progress = session.watch(format!("the evidence of {}", scene.name));
        predict(scene, settings, &[], &session.job)?
    };
    {
        let _progress = session.watch("the report");
        let record = Record { command: std::env::args().collect::<Vec<_>>().join(" "), samples: args.spp, seed: args.seed };
        record.make(&args.out, &opened.lit, &mut prediction, &session.job)?;
    }
    session.print(&prediction, || table(&prediction))?;
    Ok(Outcome::Done)
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

fn table(prediction: &Prediction) -> String {
    let mut rows = vec![["member", "kind", "damage", "std error", "state", "basis", "truth", "evidence"].map(String::from)];
    let number = |x: Option<f64>| x.map_or("-".into(), |x| format!("{x:.3}"));
    for m in &prediction.members {
        rows.push([
            m.name.clone(),
            kind_name(m.kind),
            number(m.damage),
            number(m.damage_std_error),
            m.state.clone(),
            m.basis.name().to_owned(),
            number(m.truth.as_ref().map(|t| t.damage)),
            m.evidence.values().map(|e| format!("{} {:.2}", e.source, e.damage)).collect::<Vec<_>>().join(", "),
        ]);
    }
    let mut text = output::table(&rows.map_rows());
    text += &ledger(prediction);
    for m in &prediction.members {
        m.conflicts.iter().for_each(|c| text += &format!("conflict {}, {c}\n", m.name));
        if let Some(check) = m.crack_check.as_ref().filter(|c| c.exceeded) {
            text += &format!(
                "crack {}: {:.2} mm ({}), limit {} mm in {}\n",
                m.name, check.width_mm, check.source, check.limit_mm, check.exposure
            );
        }
    }
    prediction.limits.iter().for_each(|l| text += &format!("note: {l}\n"));
    prediction.files.iter().for_each(|f| text += &format!("file {f}\n"));
    text
}

/// Every item of evidence and what became of it; items alike share a line.
fn ledger(prediction: &Prediction) -> String {
    let mut rows = vec![["member", "source", "evidence", "used"].map(String::from)];
    for group in Group::all(&prediction.items) {
        let first = group.first();
        rows.push([first.member.clone(), first.source.to_owned(), group.name(), first.verdict()]);
    }
    if rows.len() > 1 { format!("\n{}\n", output::table(&rows.map_rows())) } else { String::new() }
}
