//! `intrados analyze`: the members of a scene through their life.

use std::{collections::BTreeSet, path::PathBuf};

use intrados_mechanics::{
    analysis::{GaugeOutcome, MemberOutcome, Moment, Outcome as Life, Pictures, analyze},
    member::{MemberError, Meshing, Prepared, prepare},
    model::{self, Settings},
    skin::{Looking, Seen},
};
use intrados_scene::{SurfaceDamage, SurfaceFile};
use intrados_stage::cpu_seconds;
use serde::Serialize;

use super::walks;
use crate::{
    args,
    failure::{Failure, Outcome},
    output,
    session::Session,
};

/// How many times the tolerance a step may be off when its iterations have run out.
const LOOSE: f64 = 10.0;
/// Pa in a megapascal.
const MPA: f64 = 1e6;
/// Seconds in a day.
const DAY: f64 = 86_400.0;

/// All members. Schema `intrados.analyze/1`.
#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    version: &'static str,
    scene: String,
    scene_hash: String,
    dof: usize,
    elements: usize,
    solver: &'static str,
    iterations: usize,
    cpu_seconds: f64,
    peak_memory_bytes: Option<u64>,
    /// Steps of the model that ends last.
    steps: Vec<Moment>,
    members: Vec<MemberOutcome>,
    gauges: Vec<GaugeOutcome>,
    models: Vec<Life>,
    files: Vec<String>,
}

pub(crate) fn run(session: &Session, args: &args::Analyze) -> Result<Outcome, Failure> {
    let scene = walks::load(session, &args.scene)?;
    let wanted: Vec<_> = scene.file.members.iter().filter(|m| args.member.is_empty() || args.member.contains(&m.id)).collect();
    let known: BTreeSet<&str> = scene.file.members.iter().map(|m| m.id.as_str()).collect();
    if let Some(unknown) = args.member.iter().find(|id| !known.contains(id.as_str())) {
        return Err(Failure::Usage(format!("--member {unknown}: the scene has {}", known.into_iter().collect::<Vec<_>>().join(", "))));
    }
    if wanted.is_empty() {
        return Err(Failure::BadInput(format!(
            "{}: no parametric member to analyze: members of glTF files have no reinforcement yet",
            scene.path.display()
        )));
    }
    if let Some(out) = &args.out {
        output::folder(out)?;
        output::may_write(&out.join("analyze.json"))?;
    }
    let meshing = Meshing { element: args.element };
    let prepared = wanted.iter().map(|m| prepare(&scene, m, meshing).map_err(Failure::from)).collect::<Result<Vec<_>, _>>()?;

    let begin = cpu_seconds();
    let (mut models, mut files, mut damage) = (Vec::new(), Vec::new(), Vec::new());
    for (i, prepared) in prepared.iter().enumerate() {
        let progress = session.watch(format!("{} ({} of {})", prepared.id, i + 1, wanted.len()));
        let settings = Settings { tolerance: args.tolerance, loose: LOOSE, ..Settings::default() };
        models.push(life(session, args, prepared, settings, &mut files, &mut damage)?);
        drop(progress);
    }
    let mut report = Report::new(&scene, models, cpu_seconds() - begin);
    if let Some(out) = &args.out {
        // For `render --cracks` and `scan --cracks`.
        let cracks = out.join("cracks.json");
        output::put(&cracks, output::json(&SurfaceFile::new(&scene.hash, damage))?.as_bytes())?;
        files.extend([cracks, out.join("analyze.json")]);
        report.files = output::names(&files);
        output::put(&out.join("analyze.json"), output::json(&report)?.as_bytes())?;
    }
    session.print(&report, || report.table())?;
    Ok(if report.models.iter().any(|m| !m.complaint.is_empty()) { Outcome::TargetNotReached } else { Outcome::Done })
}

fn life(
    session: &Session,
    args: &args::Analyze,
    prepared: &Prepared,
    settings: Settings,
    files: &mut Vec<PathBuf>,
    damage: &mut Vec<SurfaceDamage>,
) -> Result<Life, Failure> {
    let Some(out) = &args.out else {
        return Ok(analyze(prepared, settings, &session.job, &mut ())?.0);
    };
    let mut pictures = Pictures::new(out, &prepared.id, prepared.axis);
    let mut looking = Looking::new(prepared, Seen::default());
    let (life, _) = analyze(prepared, settings, &session.job, &mut (&mut pictures, &mut looking))?;
    damage.extend(looking.damage.into_iter().filter(|d| !d.is_empty()));
    let cannot = |e: intrados_mechanics::write::WriteError| Failure::CannotWrite(e.to_string());
    let drawn = pictures.finish().map_err(cannot)?;
    if let Some(series) = drawn.first() {
        let steps = series.with_extension("csv");
        life.write_steps(&steps).map_err(cannot)?;
        files.push(steps);
    }
    files.extend(drawn);
    Ok(life)
}

impl Report {
    fn new(scene: &intrados_scene::Scene, models: Vec<Life>, cpu_seconds: f64) -> Self {
        let longest = models.iter().max_by(|a, b| a.steps.len().cmp(&b.steps.len())).map(|m| m.steps.clone());
        Self {
            schema: "intrados.analyze/1",
            version: env!("CARGO_PKG_VERSION"),
            scene: scene.name.clone(),
            scene_hash: scene.hash.clone(),
            dof: models.iter().map(|m| m.dof).sum(),
            elements: models.iter().map(|m| m.elements).sum(),
            solver: "auto (direct below 6000 unknowns, else multigrid)",
            iterations: models.iter().map(|m| m.iterations).sum(),
            cpu_seconds,
            peak_memory_bytes: peak_memory(),
            steps: longest.unwrap_or_default(),
            members: models.iter().flat_map(|m| m.members.clone()).collect(),
            gauges: models.iter().flat_map(|m| m.gauges.clone()).collect(),
            models,
            files: Vec::new(),
        }
    }

    fn table(&self) -> String {
        let head = ["member", "tension MPa", "compression MPa", "bars MPa", "damage", "damaged volume", "crack mm"];
        let mut rows = vec![head.map(String::from).to_vec()];
        rows.extend(self.members.iter().map(|m| {
            vec![
                m.name.clone(),
                format!("{:.2}", m.peak_tension_pa / MPA),
                format!("{:.1}", m.peak_compression_pa / MPA),
                format!("{:.0}", m.peak_bar_stress_pa / MPA),
                format!("{:.2}", m.max_damage),
                format!("{:.1} %", 100.0 * m.damaged_volume_fraction),
                format!("{:.2}", 1e3 * m.max_crack_width_m),
            ]
        }));
        let mut text = output::table(&rows);
        for t in self.members.iter().flat_map(|m| &m.tendons) {
            text += &format!(
                "tendon {}: {:.0} MPa at the end; lost {:.0} to friction and slip, {:.0} to relaxation, {:.0} to the concrete\n",
                t.name,
                t.final_stress_pa / MPA,
                t.losses.friction_and_slip_pa / MPA,
                t.losses.relaxation_pa / MPA,
                t.losses.concrete_pa / MPA
            );
        }
        self.gauges.iter().for_each(|g| text += &format!("gauge {}: {:.4e} {}\n", g.name, g.value, g.unit));
        for m in &self.models {
            let days = m.steps.last().map_or(0.0, |s| s.time_s / DAY);
            text += &format!("{}: {} unknowns, {} elements, {} steps to day {days:.0}\n", m.id, m.dof, m.elements, m.steps.len());
            let loose = m.steps.iter().filter(|s| !s.converged && s.residual.is_finite());
            if let Some(worst) = loose.clone().map(|s| s.residual).reduce(f64::max) {
                text += &format!("  {} of its steps were taken with up to {worst:.1e} of all that acts out of balance\n", loose.count());
            }
            if !m.complaint.is_empty() {
                text += &format!("{} ended early: {}\n", m.id, m.complaint);
            }
            m.notes.iter().for_each(|n| text += &format!("  note: {n}\n"));
        }
        text += &format!("{:.1} CPU-seconds\n", self.cpu_seconds);
        self.files.iter().for_each(|f| text += &format!("file {f}\n"));
        text
    }
}

/// The most memory that this process has held, where the system says.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib * 1024)
}

impl From<MemberError> for Failure {
    fn from(error: MemberError) -> Self {
        Self::BadInput(error.to_string())
    }
}

impl From<model::Failure> for Failure {
    fn from(error: model::Failure) -> Self {
        match error {
            model::Failure::Cancelled(_) | model::Failure::Solve(intrados_mechanics::sparse::SolveError::Cancelled(_)) => Self::Interrupted,
            other => Self::BadInput(other.to_string()),
        }
    }
}
