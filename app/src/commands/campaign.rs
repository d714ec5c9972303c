//! `intrados campaign`: work over many structures, or long work on one, as units that any scheduler
//! can run.
//!
//! A *plan* lists pure units; a unit's id is a hash of all that its result depends on. A unit is an
//! ordinary command that is run for a part of the work, in a folder of its own that gets its place
//! by a rename once the result is whole. So workers share nothing but a folder, need not know each
//! other, and may be killed at any moment. What is *collected* is added up in the plan's order.

mod collect;
mod folder;
mod launch;
mod network;
mod page;
mod parquet;
mod plan;
mod table;
mod unit;

use std::{path::Path, process::Command};

use intrados_report::network as page_of;
use serde::Serialize;
use serde_json::Value;

use self::{
    collect::{Collected, few},
    folder::{Folder, State},
    launch::{Engine, Wish},
    plan::Plan,
    table::Rows,
    unit::Did,
};
use super::render;
use crate::{
    accumulator::Content,
    args::{self, CampaignStep},
    failure::{Failure, Outcome},
    output::{self, Files},
    session::Session,
};

pub(crate) fn run(session: &Session, args: &args::Campaign) -> Result<Outcome, Failure> {
    match &args.step {
        CampaignStep::New(args) => new(session, args),
        CampaignStep::Run(args) => work(session, args),
        CampaignStep::Status(args) => status(session, args),
        CampaignStep::Collect(args) => collect(session, args),
        CampaignStep::Launch(args) => launch(session, args),
    }
}

/// Schema `intrados.campaign-new/1`.
#[derive(Debug, Serialize)]
struct Planned {
    schema: &'static str,
    dir: String,
    command: args::Job,
    structures: usize,
    units: usize,
}

fn new(session: &Session, args: &args::CampaignNew) -> Result<Outcome, Failure> {
    let plan = plan::plan(session, args)?;
    let folder = Folder::new(&args.dir);
    folder.may_begin(&plan)?;
    unit::learn(session, &folder, &plan)?;
    folder.begin(&plan)?;
    let planned = Planned {
        schema: "intrados.campaign-new/1",
        dir: args.dir.display().to_string(),
        command: plan.command,
        structures: plan.structures.len(),
        units: plan.units.len(),
    };
    session.print(&planned, || {
        format!(
            "{} units over {} structures in {}\n",
            planned.units, planned.structures, planned.dir
        )
    })?;
    Ok(Outcome::Done)
}

fn work(session: &Session, args: &args::CampaignRun) -> Result<Outcome, Failure> {
    let folder = Folder::new(&args.dir);
    let plan = folder.plan()?;
    let units: Vec<usize> = match (&args.unit[..], args.part) {
        ([], None) => (0..plan.units.len()).collect(),
        ([], Some(part)) => {
            (part.index as usize..plan.units.len()).step_by(part.of as usize).collect()
        }
        (named, _) => named.to_vec(),
    };
    let (mut again, mut failure) = (false, None);
    for (k, &unit) in units.iter().enumerate() {
        if session.job.is_cancelled() {
            return Ok(Outcome::ToBeContinued);
        }
        match unit::run(session, &folder, &plan, unit) {
            Ok(Did::Stopped) => {
                session.note(format_args!(
                    "unit {unit}: stopped; it goes on from here when it is started again"
                ));
                return Ok(Outcome::ToBeContinued);
            }
            Ok(Did::Elsewhere) => {
                session.note(format_args!("unit {unit}: another worker has it"));
                again = true;
            }
            Ok(Did::Before | Did::Now) => {
                session.note(format_args!("unit {unit}: done, {} of {}", k + 1, units.len()));
            }
            Err(why @ Failure::Usage(_)) => return Err(why),
            // One unit's failure is none of the others'.
            Err(why) => {
                crate::console::say(format_args!(
                    "intrados: unit {unit}: {}",
                    crate::console::one_line(&why.to_string())
                ));
                failure.get_or_insert(why);
            }
        }
    }
    match failure {
        Some(failure) => Err(failure),
        None if again => Ok(Outcome::ToBeContinued),
        None => Ok(Outcome::Done),
    }
}

/// Schema `intrados.campaign-status/1`.
#[derive(Debug, Serialize)]
struct Status {
    schema: &'static str,
    units: usize,
    done: usize,
    running: usize,
    broken_off: usize,
    failed: Vec<FailedUnit>,
    waiting: usize,
    /// Mean of the units that are done.
    seconds_per_unit: Option<f64>,
    /// With as many workers as there are now, at least one.
    seconds_to_go: Option<f64>,
}

#[derive(Debug, Serialize)]
struct FailedUnit {
    unit: usize,
    structure: String,
    code: u8,
    reason: String,
}

fn status(session: &Session, args: &args::CampaignFolder) -> Result<Outcome, Failure> {
    let folder = Folder::new(&args.dir);
    let plan = folder.plan()?;
    let status = how_far(&folder, &plan)?;
    session.print(&status, || status.table())?;
    Ok(Outcome::Done)
}

fn how_far(folder: &Folder, plan: &Plan) -> Result<Status, Failure> {
    let states = collect::states(folder, &plan.units);
    let count = |state: State| states.iter().filter(|s| **s == state).count();
    let mut seconds = Vec::new();
    let mut failed = Vec::new();
    for (k, (unit, state)) in plan.units.iter().zip(&states).enumerate() {
        match state {
            State::Done => seconds.push(folder.record(&unit.id)?.seconds),
            State::Failed => {
                let why = folder.failed(&unit.id);
                failed.push(FailedUnit {
                    unit: k,
                    structure: plan.structure(unit)?.name.clone(),
                    code: why.as_ref().map_or(1, |w| w.code),
                    reason: why.map_or_else(|| "its note cannot be read".into(), |w| w.reason),
                });
            }
            _ => {}
        }
    }
    let mean = (!seconds.is_empty()).then(|| seconds.iter().sum::<f64>() / seconds.len() as f64);
    let (done, running) = (count(State::Done), count(State::Running));
    let left = plan.units.len() - done - failed.len();
    Ok(Status {
        schema: "intrados.campaign-status/1",
        units: plan.units.len(),
        done,
        running,
        broken_off: count(State::BrokenOff),
        failed,
        waiting: count(State::Waiting),
        seconds_per_unit: mean,
        seconds_to_go: mean.map(|mean| mean * left as f64 / running.max(1) as f64),
    })
}

impl Status {
    fn table(&self) -> String {
        let mut text = format!(
            "{} of {} units done, {} running, {} broken off, {} failed, {} waiting\n",
            self.done,
            self.units,
            self.running,
            self.broken_off,
            self.failed.len(),
            self.waiting
        );
        if let (Some(each), Some(left)) = (self.seconds_per_unit, self.seconds_to_go) {
            text += &format!(
                "{each:.2} s a unit; {left:.0} s to go with {} workers\n",
                self.running.max(1)
            );
        }
        for f in &self.failed {
            text +=
                &format!("failed {} ({}, code {}): {}\n", f.unit, f.structure, f.code, f.reason);
        }
        text
    }
}

/// Schema `intrados.campaign-results/1`: nothing in it depends on who worked when.
#[derive(Debug, Serialize)]
struct Results<'a> {
    schema: &'static str,
    version: &'static str,
    command: args::Job,
    /// Units that are missing, where the user takes a part.
    missing: &'a [usize],
    columns: &'a [String],
    rows: Vec<serde_json::Map<String, Value>>,
}

/// Schema `intrados.campaign-collect/1`.
#[derive(Debug, Serialize)]
struct Summary {
    schema: &'static str,
    rows: usize,
    missing: Vec<usize>,
    unit_seconds: f64,
    unit_cpu_seconds: f64,
    files: Vec<String>,
}

fn collect(session: &Session, args: &args::CampaignCollect) -> Result<Outcome, Failure> {
    let folder = Folder::new(&args.dir);
    let plan = folder.plan()?;
    let all = collect::collect(session, &folder, &plan, args.partial)?;
    let out = match &args.out {
        Some(out) => out.clone(),
        None => output::inner(&args.dir, "collected")?,
    };
    let mut files = output::begin(&out)?;
    let results = Results {
        schema: "intrados.campaign-results/1",
        version: env!("CARGO_PKG_VERSION"),
        command: plan.command,
        missing: &all.missing,
        columns: &all.rows.columns,
        rows: all.rows.objects(),
    };
    files.write("results.csv", all.rows.csv().as_bytes())?;
    files.write("results.parquet", &parquet::parquet(&all.rows)?)?;
    if let Some(page) = page(&plan, &all)? {
        files.write("network.html", page.as_bytes())?;
    }
    let mut listed = files.listed("results.json");
    files.finish("results.json", &results)?;
    listed.extend(pictures(&all, &out)?);
    let summary = Summary {
        schema: "intrados.campaign-collect/1",
        rows: all.rows.rows.len(),
        missing: all.missing.clone(),
        unit_seconds: all.seconds,
        unit_cpu_seconds: all.cpu_seconds,
        files: listed,
    };
    if !all.missing.is_empty() {
        tracing::warn!("{} units are missing: {}", all.missing.len(), few(&all.missing));
    }
    session.print(&summary, || table(&summary, &all.rows))?;
    Ok(Outcome::Done)
}

/// The first rows, and what was written.
fn table(summary: &Summary, rows: &Rows) -> String {
    const ROWS: usize = 20;
    const COLUMNS: usize = 9;
    let columns = rows.columns.iter().take(COLUMNS).cloned().collect();
    let cells = |row: &Vec<Value>| -> Vec<String> {
        row.iter().take(COLUMNS).map(table::cell).map(|c| c.chars().take(40).collect()).collect()
    };
    let mut lines: Vec<Vec<String>> = vec![columns];
    lines.extend(rows.rows.iter().take(ROWS).map(cells));
    let mut text = output::table(&lines);
    if rows.rows.len() > ROWS {
        text += &format!("… {} rows in all\n", rows.rows.len());
    }
    text += &format!("{:.1} CPU-s of units\n", summary.unit_cpu_seconds);
    summary.files.iter().for_each(|file| text += &format!("file {file}\n"));
    text
}

fn pictures(all: &Collected, out: &Path) -> Result<Vec<String>, Failure> {
    let mut files = Vec::new();
    for ((_, sum), name) in all.pictures.iter().zip(all.folders()) {
        if let Content::Picture { plate, exposure } = &sum.content {
            let mut report = render::Report::of(sum, plate);
            render::write(&mut report, plate, *exposure, &output::inner(out, name)?)?;
            files.extend(report.files);
        }
    }
    Ok(files)
}

/// The page of a network, of predictions.
fn page(plan: &Plan, all: &Collected) -> Result<Option<String>, Failure> {
    if plan.command != args::Job::Predict {
        return Ok(None);
    }
    let items = page::items(&all.rows);
    let missing = match all.missing.len() {
        0 => None,
        n => Some(format!("{n} of {} units are missing from this page.", plan.units.len())),
    };
    let page = page_of::Page {
        title: plan.structures.first().filter(|_| plan.network.is_none()).map_or_else(
            || "A network of bridges".to_owned(),
            |s| match plan.structures.len() - 1 {
                0 => s.name.clone(),
                1 => format!("{} and another", s.name),
                others => format!("{} and {others} others", s.name),
            },
        ),
        version: env!("CARGO_PKG_VERSION").into(),
        states: page::state_names(&all.rows),
        is_assumed: plan.network.is_some(),
        ahead_years: plan.network.map(|n| n.settings.ahead_years),
        missing,
        items,
    };
    page_of::html(&page).map(Some).map_err(|e| Failure::Internal(format!("the page: {e}")))
}

/// Schema `intrados.campaign-launch/1`.
#[derive(Debug, Serialize)]
struct Launched {
    schema: &'static str,
    files: Vec<String>,
    submitted: bool,
}

fn launch(session: &Session, args: &args::CampaignLaunch) -> Result<Outcome, Failure> {
    let folder = Folder::new(&args.dir);
    let plan = folder.plan()?;
    let engine = match args.local {
        Some(processes) => Engine::Local(processes),
        None if args.slurm => Engine::Slurm,
        None if args.hyperqueue => Engine::HyperQueue,
        None => Engine::Kubernetes,
    };
    let wish = Wish {
        engine,
        tasks: args.tasks,
        cores: args.cores,
        image: args.image.clone(),
        claim: args.claim.clone(),
    };
    let job = launch::job_files(&folder, &plan, &wish)?;
    let place = output::inner(&args.dir, Path::new("launch").join(job.folder))?;
    output::folder(&place)?;
    let mut written = Vec::new();
    for (name, text) in &job.files {
        let path = place.join(name);
        output::put(&path, text.as_bytes())?;
        written.push(path);
    }
    if args.submit {
        let submit = written.last().ok_or_else(|| Failure::Internal("no job file".into()))?;
        let status = Command::new("sh").arg(submit).status();
        let status = status.map_err(|e| Failure::Internal(format!("cannot start sh: {e}")))?;
        if !status.success() {
            return Err(Failure::NoInput(format!(
                "{}: ended with {status}: see above; is the scheduler's own command there and its service up?",
                submit.display()
            )));
        }
    }
    let launched = Launched {
        schema: "intrados.campaign-launch/1",
        files: output::names(&written),
        submitted: args.submit,
    };
    session.print(&launched, || {
        if args.submit {
            return String::new();
        }
        job.files
            .iter()
            .map(|(name, text)| format!("--- {}\n{text}", place.join(name).display()))
            .collect()
    })?;
    Ok(Outcome::Done)
}
