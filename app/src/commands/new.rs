//! `intrados new`: a parametric scene to start from.

use std::path::PathBuf;

use intrados_scene::{
    Scene,
    parametric::{template, write_glb},
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
    if path.exists() && !args.force {
        return Err(Failure::cannot_write(&path, "it is there already; --force replaces it"));
    }
    match path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).as_deref() {
        Some("ron") => output::put(&path, text.as_bytes())?,
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
        files: output::names(&[path]),
    };
    session.print(&report, || format!("file {}", report.files.join(" ")))?;
    Ok(Outcome::Done)
}
