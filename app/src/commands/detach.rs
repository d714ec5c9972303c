//! `intrados detach`: evidence taken away again, and the list of what is there.

use intrados_scene::attach::{Listed, Project, listed};
use serde::Serialize;

use crate::{
    args,
    console::one_line,
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
    /// What people call it.
    member_name: String,
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
    let (Some(member), Some(name)) = (&args.member, &args.name) else {
        return list(session, &Project::open(&args.project, &session.access)?);
    };
    let project = Project::edit(&args.project, &session.access, &session.job)?;
    let member = &known_as(session, &project, member)?;
    let scene = project.load(&session.job).ok();
    let member_name =
        scene.as_ref().map_or(member.clone(), |scene| scene.name_of(member).to_owned());
    drop(scene);
    let detached = project.detach(member, name, &session.job)?;
    let report = Report {
        schema: "intrados.detach/1",
        version: env!("CARGO_PKG_VERSION"),
        evidence: project.evidence().display().to_string(),
        member: member.clone(),
        member_name,
        name: name.clone(),
        removed: output::names(&detached.removed),
    };
    session.print(&report, || {
        let mut text =
            format!("{name} of {}, taken out of {}\n", report.member_name, report.evidence);
        report.removed.iter().for_each(|file| text += &format!("removed {file}\n"));
        text
    })?;
    Ok(Outcome::Done)
}

/// The id of the member that somebody calls so; the word itself where no member has it, or where
/// the scene cannot be read.
///
/// # Errors
/// Several members have that name.
pub(super) fn known_as(
    session: &Session,
    project: &Project,
    word: &str,
) -> Result<String, Failure> {
    let Ok(scene) = project.load(&session.job) else { return Ok(word.to_owned()) };
    match scene.id_of(word) {
        Ok(id) => Ok(id.to_owned()),
        Err(0) => Ok(word.to_owned()),
        Err(count) => {
            let ids = scene.members.iter().filter(|m| m.name == word).map(|m| m.id.as_str());
            let ids: Vec<&str> = ids.take(5).collect();
            Err(Failure::BadInput(format!(
                "{count} members are called \"{}\": name one by its id, such as {}",
                one_line(word),
                ids.join(" or ")
            )))
        }
    }
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
    let heads = ["member", "name", "kind", "date", "along", "side", "height", "value"];
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
            one.member_name.clone(),
            one.name.clone(),
            one.kind.to_owned(),
            one.date.map_or(String::new(), |d| d.to_string()),
            along,
            match (&one.face, one.angle_deg) {
                (Some(face), _) => face.clone(),
                (None, angle) => angle.map_or(String::new(), |a| format!("{a}°")),
            },
            one.height_m.map_or(String::new(), |h| format!("{h} m")),
            one.value.clone(),
        ]
    }));
    rows
}
