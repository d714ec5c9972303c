//! What units have left, added up in the plan's order.

use std::path::{Path, PathBuf};

use intrados_stage::{access, file::file_names};
use serde_json::{Value, json};

use super::{
    folder::{self, Folder, Record, State},
    plan::{Plan, Unit},
    table::Rows,
    unit::{ROWS, WALKS, digest_of},
};
use crate::{
    accumulator::{Accumulator, Content},
    commands::{measure, render},
    failure::Failure,
    session::Session,
};

/// Longest rows of a unit, bytes.
const LONGEST: u64 = 1 << 30;

/// All that a campaign has brought.
pub(crate) struct Collected {
    pub(crate) rows: Rows,
    /// Numbers of units that are not done.
    pub(crate) missing: Vec<usize>,
    /// Pictures by structure, and folders for them.
    pub(crate) pictures: Vec<(String, Accumulator)>,
    /// Of the units that are done.
    pub(crate) seconds: f64,
    pub(crate) cpu_seconds: f64,
}

/// Adds up what is done. Where units are missing and the user does not take a part, or where two
/// results of a unit differ, it fails and names them.
pub(crate) fn collect(
    session: &Session,
    folder: &Folder,
    plan: &Plan,
    partial: bool,
) -> Result<Collected, Failure> {
    check_others(folder)?;
    let undone = |k: &usize| folder.state(&plan.units[*k]) != State::Done;
    let missing: Vec<usize> = (0..plan.units.len()).filter(undone).collect();
    if !(missing.is_empty() || partial && missing.len() < plan.units.len()) {
        return Err(Failure::BadInput(format!(
            "{}: {} of {} units are missing ({}): run them, see `intrados campaign status`, or take what there is by --partial",
            folder.path().display(),
            missing.len(),
            plan.units.len(),
            few(&missing)
        )));
    }
    let mut all = Collected {
        rows: Rows::default(),
        missing,
        pictures: Vec::new(),
        seconds: 0.0,
        cpu_seconds: 0.0,
    };
    let _progress = session.watch("adding up");
    let mut sum: Option<(usize, Accumulator)> = None;
    for (k, unit) in plan.units.iter().enumerate() {
        session.job.step(k, plan.units.len())?;
        if all.missing.binary_search(&k).is_ok() {
            continue;
        }
        let record = folder.record(&unit.id)?;
        all.seconds += record.seconds;
        all.cpu_seconds += record.cpu_seconds;
        let place = folder.done(&unit.id);
        if !plan.walks() {
            all.rows.append(rows(&place, &record)?)?;
            continue;
        }
        let walks = walks(&place, &record)?;
        match &mut sum {
            Some((of, sum)) if *of == unit.structure => {
                sum.merge(&walks).map_err(|why| bad(&place.join(WALKS), &why))?;
            }
            _ => finish(&mut all, plan, sum.replace((unit.structure, walks)))?,
        }
    }
    finish(&mut all, plan, sum)?;
    Ok(all)
}

/// The first numbers of a list.
pub(crate) fn few(numbers: &[usize]) -> String {
    let text: Vec<String> = numbers.iter().take(12).map(usize::to_string).collect();
    text.join(", ") + if numbers.len() > 12 { ", …" } else { "" }
}

fn bad(path: &Path, why: &str) -> Failure {
    Failure::BadInput(format!("{}: {why}", path.display()))
}

/// Two results of one unit: if they are the same it does not matter, else nothing is right.
fn check_others(folder: &Folder) -> Result<(), Failure> {
    for name in folder.others() {
        let id = name.split('~').next().unwrap_or_default();
        let other = folder.done(&name);
        let digests = [folder.record(id), folder::read_record(&other)];
        if let [Ok(one), Ok(two)] = digests
            && one.digest == two.digest
        {
            continue;
        }
        return Err(bad(
            &other,
            &format!(
                "is another result of the unit {id} than {}: find out which machine is wrong and remove its folder",
                folder.done(id).display()
            ),
        ));
    }
    Ok(())
}

fn damaged(path: &Path) -> Failure {
    bad(path, "is not what its unit has left: remove the unit's folder and run it again")
}

fn rows(place: &Path, record: &Record) -> Result<Rows, Failure> {
    let path = place.join(ROWS);
    let bytes = access::read(&path, LONGEST).map_err(|why| Failure::denied(&path, &why))?;
    if digest_of(&bytes) != record.digest {
        return Err(damaged(&path));
    }
    serde_json::from_slice(&bytes).map_err(|_| damaged(&path))
}

fn walks(place: &Path, record: &Record) -> Result<Accumulator, Failure> {
    let path: PathBuf = place.join(WALKS);
    let walks = Accumulator::read(&path)?;
    if walks.clone().digest()? != record.digest {
        return Err(damaged(&path));
    }
    Ok(walks)
}

/// The rows of a structure whose walks are all there.
fn finish(
    all: &mut Collected,
    plan: &Plan,
    sum: Option<(usize, Accumulator)>,
) -> Result<(), Failure> {
    let Some((structure, sum)) = sum else { return Ok(()) };
    let name = plan.structures.get(structure).map_or("", |s| s.name.as_str());
    match &sum.content {
        Content::Readings { .. } => all.rows.append(readings(name, &measure::Report::of(&sum)?)),
        Content::Picture { plate, .. } => {
            all.rows.append(picture(name, &render::Report::of(&sum, plate)))?;
            all.pictures.push((name.to_owned(), sum));
            Ok(())
        }
    }
}

/// What of readings is the same in every run: nothing by a clock.
fn readings(structure: &str, report: &measure::Report) -> Rows {
    let mut rows = Rows::new(&[
        "structure",
        "meter",
        "side",
        "mean",
        "std_error",
        "unit",
        "walks",
        "converged",
        "duality_z",
    ]);
    for meter in &report.meters {
        let sides = [("primal", &meter.primal), ("dual", &meter.dual)];
        for (name, side) in sides.into_iter().filter_map(|(n, s)| Some((n, s.as_ref()?))) {
            rows.rows.push(vec![
                json!(structure),
                json!(meter.name),
                json!(name),
                json!(side.mean),
                json!(side.std_error),
                json!(meter.unit),
                json!(side.walks),
                json!(side.converged),
                Value::Null,
            ]);
        }
        if meter.primal.is_some() && meter.dual.is_some() {
            rows.rows.push(vec![
                json!(structure),
                json!(meter.name),
                json!("both"),
                json!(meter.combined.mean),
                json!(meter.combined.std_error),
                json!(meter.unit),
                Value::Null,
                json!(meter.combined.converged),
                json!(meter.duality_z),
            ]);
        }
    }
    rows
}

fn picture(structure: &str, report: &render::Report) -> Rows {
    let report = json!(report);
    const OF: [(&str, &str); 8] = [
        ("camera", "camera"),
        ("width", "width [px]"),
        ("height", "height [px]"),
        ("samples", "samples"),
        ("mean", "mean [W/m2/sr]"),
        ("std_error", "std_error [W/m2/sr]"),
        ("pixel_rel_error", "pixel_rel_error [1]"),
        ("converged", "converged"),
    ];
    let columns = ["structure"].into_iter().chain(OF.map(|(_, column)| column));
    let mut row = vec![json!(structure)];
    row.extend(OF.map(|(key, _)| report[key].clone()));
    Rows { columns: columns.map(String::from).collect(), rows: vec![row] }
}

impl Collected {
    /// Names for the folders of pictures, no two alike.
    pub(crate) fn folders(&self) -> Vec<String> {
        let names: Vec<&str> = self.pictures.iter().map(|(name, _)| name.as_str()).collect();
        file_names(&names)
    }
}

/// How many units are in each state.
pub(crate) fn states(folder: &Folder, units: &[Unit]) -> Vec<State> {
    units.iter().map(|unit| folder.state(unit)).collect()
}
