//! `intrados import`: a user's own model to a project folder.

use std::path::PathBuf;

use intrados_scene::{
    MemberKind,
    import::{self, Imported, Told, UpAxis},
};
use serde::Serialize;

use super::{info::kind_name, render::MapRows};
use crate::{
    args,
    failure::{Failure, Outcome},
    output,
    session::Session,
};

/// Schema `intrados.import/1`.
#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    version: &'static str,
    folder: String,
    scene: String,
    #[serde(flatten)]
    imported: Imported,
}

pub(crate) fn run(session: &Session, args: &args::Import) -> Result<Outcome, Failure> {
    let folder = args
        .out
        .clone()
        .unwrap_or_else(|| PathBuf::from(args.model.file_stem().unwrap_or("imported".as_ref())));
    let told = Told {
        metres: args.unit.as_deref().map(metres),
        up: args.up.as_deref().map(|up| if up == "z" { UpAxis::Z } else { UpAxis::Y }),
        year: args.year,
        exposure: args.exposure.clone(),
        imposed_kpa: args.imposed,
        kinds: args.kinds.clone(),
    };
    let progress = session.watch(format!("importing {}", args.model.display()));
    let imported = import::import(&args.model, &folder, &told, &session.access, &session.job)?;
    drop(progress);
    imported.notes.iter().for_each(|note| session.note(note));
    if args.imposed.is_some() && !imported.members.contains_key(&MemberKind::Slab) {
        session.note("--imposed is not used, because the model has no slab that it could lie on: add loads to scene.ron");
    }
    let report = Report {
        schema: "intrados.import/1",
        version: env!("CARGO_PKG_VERSION"),
        folder: folder.display().to_string(),
        scene: folder.join("scene.ron").display().to_string(),
        imported,
    };
    session.print(&report, || report.table())?;
    Ok(Outcome::Done)
}

fn metres(unit: &str) -> f64 {
    match unit {
        "mm" => 1e-3,
        "cm" => 1e-2,
        "in" => 0.0254,
        "ft" => 0.3048,
        _ => 1.0,
    }
}

impl Report {
    fn table(&self) -> String {
        let told = &self.imported;
        let kinds = told.members.iter().map(|(kind, count)| {
            let volume = told.volume_m3.get(kind).copied().unwrap_or(0.0);
            [format!("  {}", kind_name(*kind)), count.to_string(), format!("{volume:.3} m³")]
        });
        let rows = [
            ["scene".into(), self.scene.clone(), String::new()],
            ["read".into(), told.format.clone(), String::new()],
            ["members".into(), told.members.values().sum::<usize>().to_string(), String::new()],
        ];
        let steel = [
            [
                "steel lines".into(),
                told.steel_lines.to_string(),
                format!("{} loose", told.loose_steel),
            ],
            ["scenery".into(), told.scenery.values().sum::<usize>().to_string(), String::new()],
            ["concrete assumed".into(), told.concrete_assumed.to_string(), "members".into()],
            [
                "reinforcement assumed".into(),
                told.reinforcement_assumed.to_string(),
                "members".into(),
            ],
        ];
        let materials = told.materials.iter().map(|material| {
            [
                format!("material {}", material.name),
                material.elements.to_string(),
                material.taken_for.clone(),
            ]
        });
        let all: Vec<[String; 3]> =
            rows.into_iter().chain(kinds).chain(steel).chain(materials).collect();
        output::table(&all.map_rows())
    }
}
