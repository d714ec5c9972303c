//! `intrados new`: a parametric scene to start from.

use std::path::{Path, PathBuf};

use intrados_scene::{
    Scene,
    parametric::{evidence_template, template, write_glb},
};
use serde::Serialize;

use crate::{
    args,
    failure::{Failure, Outcome},
    output,
    session::Session,
};

/// Schema `intrados.new/1`.
#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    version: &'static str,
    kind: String,
    files: Vec<String>,
}

pub(crate) fn run(session: &Session, args: &args::New) -> Result<Outcome, Failure> {
    let path = args.file.clone().unwrap_or_else(|| PathBuf::from(format!("{}.ron", args.kind)));
    let text = template(&args.kind)
        .ok_or_else(|| Failure::Usage(format!("there is no template {}", args.kind)))?;
    let is_scene = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ron"));
    // Read with the scene: a command that names that reads this, too.
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let evidence = evidence_template(&args.kind, &name).filter(|_| is_scene);
    let beside = path.with_extension("evidence.ron");
    let is_there = |place: &Path| std::fs::symlink_metadata(place).is_ok();
    let taken = |place: &Path| is_there(place) && !args.force;
    if let Some(place) =
        [&path, &beside].into_iter().take(1 + usize::from(is_scene)).find(|p| taken(p))
    {
        return Err(Failure::cannot_write(place, "it is there already; --force replaces it"));
    }
    match path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).as_deref() {
        Some("ron") => {
            let evidence = evidence.as_deref().unwrap_or_default();
            let was_there = is_there(&beside);
            output::put(&beside, evidence.as_bytes())?;
            output::put(&path, text.as_bytes()).inspect_err(|_| {
                if !was_there {
                    let _ = std::fs::remove_file(&beside);
                }
            })?;
        }
        Some("glb") => {
            // The template is a scene like any other: it is loaded from a folder of its own and
            // written as a model.
            let folder = tempfile::tempdir().map_err(|e| Failure::cannot_write(&path, e))?;
            let ron = folder.path().join(format!("{}.ron", args.kind));
            output::put(&ron, text.as_bytes())?;
            output::may_write(&path)?;
            let scene = Scene::load(&ron, &session.job)?;
            write_glb(&path, &scene).map_err(|e| Failure::cannot_write(&path, e))?;
        }
        _ => {
            return Err(Failure::Usage(format!(
                "{}: end its name in .ron (a scene to edit) or .glb (a model)",
                path.display()
            )));
        }
    }
    let report = Report {
        schema: "intrados.new/1",
        version: env!("CARGO_PKG_VERSION"),
        kind: args.kind.clone(),
        files: output::names(&if is_scene { vec![path, beside] } else { vec![path] }),
    };
    session.print(&report, || {
        report.files.iter().map(|file| format!("file {file}")).collect::<Vec<_>>().join("\n")
    })?;
    Ok(Outcome::Done)
}
