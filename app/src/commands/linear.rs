//! `intrados analyze` of a deck of any solids that is none of members.

use std::fmt::Write as _;

use intrados_mechanics::{
    linear::{Deck, LinearError, Solved},
    tensor::von_mises,
    write::Field,
};
use intrados_stage::{cpu_seconds, file::Set};
use serde::Serialize;

use super::analyze::not_written;
use crate::{
    args,
    failure::{Failure, Outcome},
    output::{self, Files},
    session::Session,
};

/// A deck that was read.
pub(crate) struct Read {
    pub(crate) deck: Deck,
    pub(crate) name: String,
    /// BLAKE3 of the file.
    pub(crate) hash: String,
}

/// Schema `intrados.deck/1`.
#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    version: &'static str,
    deck: String,
    deck_hash: String,
    nodes: usize,
    elements: usize,
    cpu_seconds: f64,
    steps: Vec<Step>,
    notes: Vec<String>,
    files: Vec<String>,
}

/// The end of a step.
#[derive(Debug, Serialize)]
struct Step {
    name: String,
    unknowns: usize,
    max_displacement_m: f64,
    max_von_mises_pa: f64,
    /// Where the step is one of heat.
    #[serde(skip_serializing_if = "Option::is_none")]
    max_temperature: Option<f64>,
    /// Where the step asks for them: 1/s², of heat 1/s, of buckling factors of the loads.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    eigenvalues: Vec<f64>,
}

/// Computes it and writes what came out.
pub(crate) fn run(
    session: &Session,
    args: &args::Analyze,
    read: &Read,
) -> Result<Outcome, Failure> {
    if let Some(option) = args.of_members.first() {
        return Err(Failure::Usage(format!(
            "{option} does nothing with {}, a deck of solids, which is computed as linear: leave {option} out",
            args.scene.display()
        )));
    }
    if let Some(out) = &args.out {
        output::may_begin(out)?;
    }
    let begin = cpu_seconds();
    let _progress = session.watch(read.name.clone());
    let solved = read.deck.solve(&session.job).map_err(|why| match why {
        LinearError::Cancelled(_) => Failure::Interrupted,
        why => Failure::BadInput(format!("{}: {why}", args.scene.display())),
    })?;
    let mut report = Report {
        schema: "intrados.deck/1",
        version: env!("CARGO_PKG_VERSION"),
        deck: read.name.clone(),
        deck_hash: read.hash.clone(),
        nodes: read.deck.labels().len(),
        elements: read.deck.elements().count(),
        cpu_seconds: cpu_seconds() - begin,
        steps: solved.iter().map(step).collect(),
        notes: read.deck.notes.clone(),
        files: Vec::new(),
    };
    if let Some(out) = &args.out {
        const LIST: &str = "analyze.json";
        let mut files = output::begin(out)?;
        files.write("displacements.csv", displacements(&read.deck, &solved).as_bytes())?;
        files.write("stresses.csv", stresses(&read.deck, &solved).as_bytes())?;
        if solved.iter().any(|s| !s.temperatures.is_empty()) {
            files.write("temperatures.csv", temperatures(&read.deck, &solved).as_bytes())?;
        }
        if solved.iter().any(|s| !s.eigenvalues.is_empty()) {
            files.write("eigenvalues.csv", eigenvalues(&solved).as_bytes())?;
        }
        pictures(&mut files, &read.deck, &solved)?;
        report.files = files.listed(LIST);
        files.finish(LIST, &report)?;
    }
    session.print(&report, || table(&report))?;
    Ok(Outcome::Done)
}

fn step(solved: &Solved) -> Step {
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
    Step {
        name: solved.name.clone(),
        unknowns: solved.unknowns,
        max_displacement_m: largest(&mut solved.displacements.iter().map(|u| u.length())),
        max_von_mises_pa: largest(&mut solved.stresses.iter().flatten().map(von_mises)),
        max_temperature: solved.temperatures.iter().copied().reduce(f64::max),
        eigenvalues: solved.eigenvalues.clone(),
    }
}

/// A VTU a step that ends in displacements or temperatures; stresses are the means of each element.
fn pictures(files: &mut Set, deck: &Deck, solved: &[Solved]) -> Result<(), Failure> {
    let Some(grid) = deck.grid() else { return Ok(()) };
    for (k, step) in solved.iter().enumerate() {
        let moved: Vec<f64> = step.displacements.iter().flat_map(|u| u.to_array()).collect();
        let mean = |points: &Vec<[f64; 6]>| -> [f64; 6] {
            let count = points.len().max(1) as f64;
            std::array::from_fn(|c| points.iter().map(|s| s[c]).sum::<f64>() / count)
        };
        let stress: Vec<f64> = step.stresses.iter().flat_map(mean).collect();
        let point = [("displacement_m", 3, &moved), ("temperature", 1, &step.temperatures)];
        let points = point.map(|(name, components, values)| Field { name, components, values });
        let points: Vec<Field<'_>> = points.into_iter().filter(|f| !f.values.is_empty()).collect();
        let cell = Field { name: "stress_pa", components: 6, values: &stress };
        let cells: Vec<Field<'_>> = [cell].into_iter().filter(|f| !f.values.is_empty()).collect();
        if points.is_empty() {
            continue;
        }
        let place = files.place(format!("step_{:04}.vtu", k + 1));
        let folder = files.folder().to_owned();
        grid.write(&place, &points, &cells).map_err(|e| not_written(&folder, e))?;
    }
    Ok(())
}

/// One row a node and step. Writing to a string cannot fail.
fn displacements(deck: &Deck, solved: &[Solved]) -> String {
    let mut text = String::from("step,node,x_m,y_m,z_m\n");
    for (k, step) in solved.iter().enumerate() {
        for (label, u) in deck.labels().iter().zip(&step.displacements) {
            let _ = writeln!(text, "{},{label},{:?},{:?},{:?}", k + 1, u.x, u.y, u.z);
        }
    }
    text
}

/// One row a node and step of heat.
fn temperatures(deck: &Deck, solved: &[Solved]) -> String {
    let mut text = String::from("step,node,temperature\n");
    for (k, step) in solved.iter().enumerate() {
        for (label, t) in deck.labels().iter().zip(&step.temperatures) {
            let _ = writeln!(text, "{},{label},{t:?}", k + 1);
        }
    }
    text
}

/// One row an eigenvalue and step.
fn eigenvalues(solved: &[Solved]) -> String {
    let mut text = String::from("step,mode,eigenvalue\n");
    for (k, step) in solved.iter().enumerate() {
        for (i, value) in step.eigenvalues.iter().enumerate() {
            let _ = writeln!(text, "{},{},{value:?}", k + 1, i + 1);
        }
    }
    text
}

/// One row a point of integration and step.
fn stresses(deck: &Deck, solved: &[Solved]) -> String {
    let mut text = String::from("step,element,point,xx_pa,yy_pa,zz_pa,xy_pa,yz_pa,zx_pa\n");
    for (k, step) in solved.iter().enumerate() {
        for (label, points) in deck.elements().zip(&step.stresses) {
            for (p, s) in points.iter().enumerate() {
                let [xx, yy, zz, xy, yz, zx] = s;
                let _ = writeln!(
                    text,
                    "{},{label},{},{xx:?},{yy:?},{zz:?},{xy:?},{yz:?},{zx:?}",
                    k + 1,
                    p + 1
                );
            }
        }
    }
    text
}

fn table(report: &Report) -> String {
    let mut text =
        format!("{}: {} nodes, {} elements\n", report.deck, report.nodes, report.elements);
    for step in &report.steps {
        if let Some(warmest) = step.max_temperature {
            let (name, unknowns) = (&step.name, step.unknowns);
            let _ = writeln!(text, "{name}: {unknowns} unknowns, largest temperature {warmest:.6}");
            continue;
        }
        if let (Some(first), Some(last)) = (step.eigenvalues.first(), step.eigenvalues.last()) {
            let count = step.eigenvalues.len();
            let _ = writeln!(
                text,
                "{}: {} unknowns, {count} eigenvalues from {first:.6e} to {last:.6e}",
                step.name, step.unknowns
            );
            continue;
        }
        let _ = writeln!(
            text,
            "{}: {} unknowns, largest displacement {:.4e} m, largest von Mises stress {:.4e} Pa",
            step.name, step.unknowns, step.max_displacement_m, step.max_von_mises_pa
        );
    }
    report.notes.iter().for_each(|note| text += &format!("note {note}\n"));
    report.files.iter().for_each(|file| text += &format!("file {file}\n"));
    text
}
