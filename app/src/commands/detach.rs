//! `intrados detach`: evidence taken away again, and the list of what is there.

use intrados_scene::attach::{Listed, Project, listed};
use serde::Serialize;

use crate::{
    args,
    failure::{Failure, Outcome},
    output,
    session::Session,
};

/// Schema `intrados.detach/1`.
#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    version: &'static str,
    evidence: String,
    member: String,
    name: String,
    removed: Vec<String>,
}

/// Schema `intrados.attached/1`.
#[derive(Debug, Serialize)]
struct List {
    schema: &'static str,
    version: &'static str,
    scene: String,
    scene_hash: String,
    attached: Vec<Listed>,
}

pub(crate) fn run(session: &Session, args: &args::Detach) -> Result<Outcome, Failure> {
    let project = Project::open(&args.project, &session.access)?;
    let (Some(member), Some(name)) = (&args.member, &args.name) else {
        return list(session, &project);
    };
    let member = &known_as(session, &project, member);
    let detached = project.detach(member, name, &session.job)?;
    let report = Report {
        schema: "intrados.detach/1",
        version: env!("CARGO_PKG_VERSION"),
        evidence: project.evidence().display().to_string(),
        member: member.clone(),
        name: name.clone(),
        removed: output::names(&detached.removed),
    };
    session.print(&report, || {
        let mut text = format!("{name} of {member}, taken out of {}\n", report.evidence);
        report.removed.iter().for_each(|file| text += &format!("removed {file}\n"));
        text
    })?;
    Ok(Outcome::Done)
}

/// The id of the member that somebody calls so; the word itself where no member has it as its name
/// alone, or where the scene cannot be read.
pub(super) fn known_as(session: &Session, project: &Project, word: &str) -> String {
    let scene = project.load(&session.job).ok();
    scene.and_then(|s| s.id_of(word).ok().map(str::to_owned)).unwrap_or_else(|| word.to_owned())
}

fn list(session: &Session, project: &Project) -> Result<Outcome, Failure> {
    let scene = project.load(&session.job)?;
    let list = List {
        schema: "intrados.attached/1",
        version: env!("CARGO_PKG_VERSION"),
        scene: scene.path.display().to_string(),
        scene_hash: scene.hash.clone(),
        attached: listed(&scene),
    };
    session.print(&list, || {
        if list.attached.is_empty() {
            "nothing is attached".into()
        } else {
            output::table(&rows(&list.attached))
        }
    })?;
    Ok(Outcome::Done)
}

/// What is known, as rows of a table.
pub(super) fn rows(all: &[Listed]) -> Vec<Vec<String>> {
    let heads = ["member", "name", "kind", "date", "along", "angle", "height", "value"];
    let mut rows = vec![heads.map(str::to_owned).to_vec()];
    rows.extend(all.iter().map(|one| {
        let along = one.along.map_or(String::new(), |[from, to]| {
            if from.to_bits() == to.to_bits() {
                format!("{from}")
            } else {
                format!("{from}–{to}")
            }
        });
        vec![
            one.member.clone(),
            one.name.clone(),
            one.kind.to_owned(),
            one.date.map_or(String::new(), |d| d.to_string()),
            along,
            one.angle_deg.map_or(String::new(), |a| format!("{a}°")),
            one.height_m.map_or(String::new(), |h| format!("{h} m")),
            one.value.clone(),
        ]
    }));
    rows
}
