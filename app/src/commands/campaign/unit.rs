//! One unit of a campaign, from its command to its place among those that are done.

use std::{path::Path, time::Instant};

use intrados_stage::{access, catch, cpu_seconds};
use serde_json::{Value, json};

use super::{
    folder::{Folder, Held, Record},
    network,
    plan::{self, Plan, Structure, Unit},
    table::Rows,
};
use crate::{
    accumulator::Accumulator,
    args, commands,
    failure::{Failure, Outcome},
    output,
    session::Session,
};

/// Walks of a unit; they are its checkpoint while it works.
pub(super) const WALKS: &str = "walks.acc";
/// Rows of a unit.
pub(super) const ROWS: &str = "rows.json";
/// Files of a unit's command.
const FILES: &str = "files";
/// Longest result of a command that is read, bytes.
const LONGEST: u64 = 1 << 30;

/// What became of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Did {
    /// It was done before.
    Before,
    /// It is done now.
    Now,
    /// It is to be started again: a signal came.
    Stopped,
    /// Another worker has it.
    Elsewhere,
}

/// Does unit `k` of a plan, unless it is done.
pub(crate) fn run(
    session: &Session,
    folder: &Folder,
    plan: &Plan,
    k: usize,
) -> Result<Did, Failure> {
    let unit = plan.units.get(k).ok_or_else(|| {
        Failure::Usage(format!("there is no unit {k}: the plan has 0 to {}", plan.units.len() - 1))
    })?;
    if folder.is_done(&unit.id) {
        return Ok(Did::Before);
    }
    let Some(held) = folder.hold(&unit.id)? else { return Ok(Did::Elsewhere) };
    if folder.is_done(&unit.id) {
        folder.drop_work(&held);
        return Ok(Did::Before);
    }
    let begin = Instant::now();
    let cpu = cpu_seconds();
    let worked = catch(|| work(session, folder, plan, unit, &held)).unwrap_or_else(|fault| {
        Err(Failure::Internal(format!("internal error: please report it: {fault}")))
    });
    let done = worked.and_then(|digest| match digest {
        None => Ok(Did::Stopped),
        Some(digest) => {
            let record = Record {
                schema: "intrados.unit/1".into(),
                id: unit.id.clone(),
                digest,
                seconds: begin.elapsed().as_secs_f64(),
                cpu_seconds: cpu_seconds() - cpu,
            };
            folder.publish(&held, &record).map(|()| Did::Now)
        }
    });
    match done {
        Err(Failure::Interrupted) => Ok(Did::Stopped),
        Err(failure) => {
            folder.fail(&unit.id, &failure);
            Err(failure)
        }
        done => done,
    }
}

/// The work itself; its digest, or none where it was stopped.
fn work(
    session: &Session,
    folder: &Folder,
    plan: &Plan,
    unit: &Unit,
    held: &Held,
) -> Result<Option<String>, Failure> {
    let structure = plan.structure(unit)?;
    if let Some(network) = &plan.network {
        let rows = network::rows(session, network, structure, unit.part, &held.folder)?;
        return keep(&held.folder, &rows).map(Some);
    }
    if plan.walks() {
        return walk(session, folder, plan, unit, held);
    }
    let files = output::inner(&held.folder, FILES)?;
    let mut words = plan.words_of(unit)?;
    words.extend(["--out".to_owned(), text(&files)?]);
    if command(session, &words)? == Outcome::Interrupted {
        return Ok(None);
    }
    let (list, rows): (_, fn(&Structure, &Value) -> Rows) = match plan.command {
        args::Job::Scan => ("scan.json", scanned),
        args::Job::Analyze => ("analyze.json", analysed),
        args::Job::Experiment => ("table-3-1.json", judged),
        _ => ("predict.json", predicted),
    };
    let list = files.join(list);
    let bytes = access::read(&list, LONGEST).map_err(|why| Failure::denied(&list, &why))?;
    let report: Value = serde_json::from_slice(&bytes)
        .map_err(|e| Failure::Internal(format!("{}: cannot be read: {e}", list.display())))?;
    // An experiment is of no scene.
    if plan.command != args::Job::Experiment {
        check_scene(structure, report["scene_hash"].as_str().unwrap_or_default())?;
    }
    keep(&held.folder, &rows(structure, &report)).map(Some)
}

/// Runs a command as a part of this one.
fn command(session: &Session, words: &[String]) -> Result<Outcome, Failure> {
    let cli = args::Cli { command: Some(plan::parse(words)?), common: args::Common::default() };
    commands::run(&cli, &session.within())
}

/// Learns what steers the walks of every structure, once for all of its units.
pub(crate) fn learn(session: &Session, folder: &Folder, plan: &Plan) -> Result<(), Failure> {
    for structure in 0..if plan.walks() { plan.structures.len() } else { 0 } {
        let Some(unit) = plan.units.iter().find(|unit| unit.structure == structure) else {
            continue;
        };
        if !is_guided(&plan::parse(&plan.words_of(unit)?)?) {
            continue;
        }
        let guide = folder.guide(structure);
        output::folder(&output::inner(folder.path(), "guides")?)?;
        let mut words = plan.words_of(unit)?;
        let scratch = tempfile::tempdir()
            .map_err(|e| Failure::Internal(format!("a temporary folder: {e}")))?;
        words.extend(["--out".to_owned(), text(scratch.path())?, "--learn-only".to_owned()]);
        words.extend(["--guide-from".to_owned(), text(&guide)?]);
        command(session, &words)?;
    }
    Ok(())
}

/// Whether something may steer the walks of a command.
fn is_guided(command: &args::Command) -> bool {
    let light = match command {
        args::Command::Measure(measure) => &measure.light,
        args::Command::Render(render) => &render.light,
        _ => return false,
    };
    light.guide != args::GuideArg::Off && light.estimator == args::EstimatorArg::NextEvent
}

/// Walks, whose checkpoint is their result.
fn walk(
    session: &Session,
    folder: &Folder,
    plan: &Plan,
    unit: &Unit,
    held: &Held,
) -> Result<Option<String>, Failure> {
    let (files, state) = (output::inner(&held.folder, FILES)?, held.folder.join(WALKS));
    let guide = folder.guide(unit.structure);
    let mut words = plan.words_of(unit)?;
    if guide.is_file() {
        words.extend(["--guide-from".to_owned(), text(&guide)?]);
    }
    words.extend(["--out".to_owned(), text(&files)?, "--checkpoint".to_owned(), text(&state)?]);
    if state.is_file() {
        words.extend(["--resume".to_owned(), text(&state)?]);
    }
    if command(session, &words)? == Outcome::Interrupted {
        return Ok(None);
    }
    let accumulator = Accumulator::read(&state)?;
    check_scene(plan.structure(unit)?, &accumulator.scene_hash)?;
    if !accumulator.is_whole() {
        return Err(Failure::CannotWrite(format!(
            "{}: does not hold all walks of the unit: its last checkpoint could not be written; \
             make room and start it again",
            state.display()
        )));
    }
    // The accumulator has all that pictures and lists say.
    _ = std::fs::remove_dir_all(&files);
    accumulator.digest().map(Some)
}

fn check_scene(structure: &Structure, hash: &str) -> Result<(), Failure> {
    if hash == structure.hash {
        return Ok(());
    }
    Err(Failure::BadInput(format!(
        "{}: has changed since the campaign was planned: plan a new one, or bring back the old file",
        structure.path.display()
    )))
}

fn text(path: &Path) -> Result<String, Failure> {
    path.to_str().map(str::to_owned).ok_or_else(|| {
        Failure::BadInput(format!("{}: its path is no text: rename it", path.display()))
    })
}

/// Keeps the rows of a unit; their digest.
fn keep(folder: &Path, rows: &Rows) -> Result<String, Failure> {
    let text = output::json(rows)?;
    output::put(&folder.join(ROWS), text.as_bytes())?;
    Ok(digest_of(text.as_bytes()))
}

pub(super) fn digest_of(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

/// A row for every member that `intrados predict` speaks of.
fn predicted(structure: &Structure, report: &Value) -> Rows {
    // The states of the profile, mildest first.
    let states: Vec<&str> = list(&report["profile"]["states"])
        .iter()
        .filter_map(|state| state["name"].as_str())
        .collect();
    let mut columns: Vec<String> =
        ["structure", "member_id", "name", "kind", "damage [1]", "damage_std_error [1]", "state"]
            .map(String::from)
            .into();
    columns.extend(states.iter().map(|state| format!("p_{state} [1]")));
    columns.extend(["basis", "advice", "within_months"].map(String::from));
    let row = |m: &Value| {
        let mut row = vec![json!(structure.name)];
        row.extend(
            ["id", "name", "kind", "damage", "damage_std_error", "state"].map(|k| m[k].clone()),
        );
        row.extend(states.iter().map(|state| m["state_probability"][*state].clone()));
        row.extend(["basis", "advice", "within_months"].map(|k| m[k].clone()));
        row
    };
    Rows { columns, rows: list(&report["members"]).iter().map(row).collect() }
}

/// A row for every member that `intrados analyze` computed.
fn analysed(structure: &Structure, report: &Value) -> Rows {
    const OF: [(&str, &str); 7] = [
        ("name", "member_id"),
        ("kind", "kind"),
        ("peak_tension_pa", "peak_tension [Pa]"),
        ("peak_compression_pa", "peak_compression [Pa]"),
        ("max_damage", "max_damage [1]"),
        ("damaged_volume_fraction", "damaged_volume [1]"),
        ("max_crack_width_m", "max_crack_width [m]"),
    ];
    of(structure, &report["members"], &OF)
}

/// A row for every place that `intrados scan` scanned.
fn scanned(structure: &Structure, report: &Value) -> Rows {
    const OF: [(&str, &str); 8] = [
        ("member", "member_id"),
        ("along", "along [1]"),
        ("voxel_mm", "voxel [mm]"),
        ("scatter_to_primary", "scatter_to_primary [1]"),
        ("rel_error", "rel_error [1]"),
        ("nrmse", "nrmse [1]"),
        ("porosity", "porosity [1]"),
        ("pores", "pores"),
    ];
    of(structure, &report["scans"], &OF)
}

/// A row for every case of `intrados experiment table-3-1`, without the times it took.
fn judged(structure: &Structure, report: &Value) -> Rows {
    const OF: [(&str, &str); 12] = [
        ("id", "case"),
        ("kind", "kind"),
        ("ours", "ours"),
        ("reference", "reference"),
        ("strong_reference", "strong_reference"),
        ("otsu_corrected", "otsu_corrected"),
        ("kv", "voltage [kV]"),
        ("pixel_mm", "pixel [mm]"),
        ("pores", "pores"),
        ("crack_pixels", "crack_pixels"),
        ("scatter_to_primary", "scatter_to_primary [1]"),
        ("transmission", "transmission [1]"),
    ];
    let mut rows = of(structure, &report["cases"], &OF);
    for name in ["ours", "reference", "strong_reference"] {
        rows.columns.extend(["low", "high"].map(|end| format!("{name}_95_{end}")));
        let interval = format!("{name}_ci95");
        for (row, case) in rows.rows.iter_mut().zip(list(&report["cases"])) {
            row.extend([0, 1].map(|end: usize| case[interval.as_str()][end].clone()));
        }
    }
    rows
}

fn of(structure: &Structure, items: &Value, of: &[(&str, &str)]) -> Rows {
    let columns = ["structure"].into_iter().chain(of.iter().map(|(_, column)| *column));
    let row = |item: &Value| {
        let cells = of.iter().map(|(key, _)| item[*key].clone());
        [json!(structure.name)].into_iter().chain(cells).collect()
    };
    Rows {
        columns: columns.map(String::from).collect(),
        rows: list(items).iter().map(row).collect(),
    }
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}
