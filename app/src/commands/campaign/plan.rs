//! What is to be done: the units of a campaign, and their ids.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use intrados_forecast::span;
use intrados_stage::access;
use serde::{Deserialize, Serialize};

use super::network::Network;
use crate::{
    args::{self, Command},
    commands::walks,
    failure::Failure,
    options::{self, Unread},
    session::Session,
};

const SCHEMA: &str = "intrados.campaign/1";
/// Most units of a campaign.
const MOST: usize = 1_000_000;
/// The experiment whose cases stand each by itself, and how many they are.
const TABLE: &str = "table-3-1";
const CASES: u64 = 20;
/// Longest plan that is read, bytes.
const LONGEST: u64 = 1 << 30;
/// What a campaign says itself, and what would make results depend on a clock.
const OURS: [&str; 13] = [
    "--out",
    "--shard",
    "--checkpoint",
    "--checkpoint-every",
    "--resume",
    "--time-limit",
    "--target-rel-error",
    "--replay",
    "--guide-from",
    "--learn-only",
    "--format",
    "--threads",
    "--ifc",
];

/// Units of work, in their order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Plan {
    schema: String,
    pub(crate) version: String,
    pub(crate) command: args::Job,
    /// What goes to the command as it is.
    pub(crate) words: Vec<String>,
    /// How spans live, where the structures are a table of bridges.
    pub(crate) network: Option<Network>,
    pub(crate) structures: Vec<Structure>,
    pub(crate) units: Vec<Unit>,
}

/// A scene, or a table of bridges.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Structure {
    /// Unlike all others of the plan.
    pub(crate) name: String,
    /// A file, or the name of a scene or an experiment that comes with the program.
    pub(crate) path: PathBuf,
    /// Of the scene and every file it names; of the table; none of an experiment, which comes with
    /// the program, whose version every id has.
    pub(crate) hash: String,
}

/// One piece of work.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Unit {
    /// Hash of all that its result depends on.
    pub(crate) id: String,
    /// Number of its structure.
    pub(crate) structure: usize,
    /// Of one member alone.
    pub(crate) member: Option<String>,
    /// Part I of N: of the walks, of the rows of a table, or of the cases of an experiment.
    pub(crate) part: [u64; 2],
}

impl Plan {
    /// Reads a plan and refuses one that was changed by hand or is of another version.
    pub(crate) fn read(path: &Path) -> Result<Self, Failure> {
        let bad = |why: &str| Failure::BadInput(format!("{}: {why}", path.display()));
        let bytes = access::read(path, LONGEST).map_err(|why| Failure::denied(path, &why))?;
        let plan: Self = serde_json::from_slice(&bytes)
            .map_err(|e| bad(&format!("is no plan of a campaign: {e}")))?;
        if plan.schema != SCHEMA {
            return Err(bad(&format!("its schema is {}, not {SCHEMA}", plan.schema)));
        }
        if plan.version != env!("CARGO_PKG_VERSION") {
            return Err(bad(&format!(
                "was planned by version {}, and this is {}: its units would be others; plan it again",
                plan.version,
                env!("CARGO_PKG_VERSION")
            )));
        }
        let sound = |unit: &Unit| {
            unit.part[0] < unit.part[1]
                && unit.structure < plan.structures.len()
                && plan.id(unit) == unit.id
        };
        match plan.units.iter().position(|unit| !sound(unit)) {
            Some(k) => Err(bad(&format!(
                "unit {k} is not what its id says: the plan was changed; plan it again"
            ))),
            None if plan.units.is_empty() => Err(bad("has no units: plan it again")),
            None => Ok(plan),
        }
    }

    /// The id of a unit: BLAKE3 of all that its result depends on.
    fn id(&self, unit: &Unit) -> String {
        let mut hash = blake3::Hasher::new();
        // Lengths first, so that no two lists of words run into the same bytes.
        let mut add = |text: &str| {
            hash.update(&(text.len() as u64).to_le_bytes());
            hash.update(text.as_bytes());
        };
        add(&self.version);
        add(&format!("{:?}", self.command));
        add(&format!("{:?}", self.network));
        add(self.structures.get(unit.structure).map_or("", |s| &s.hash));
        add(unit.member.as_deref().unwrap_or_default());
        add(&format!("{:?}", unit.part));
        self.words.iter().for_each(|word| add(word));
        hash.finalize().to_hex().chars().take(32).collect()
    }

    /// The structure of a unit.
    pub(crate) fn structure(&self, unit: &Unit) -> Result<&Structure, Failure> {
        self.structures
            .get(unit.structure)
            .ok_or_else(|| Failure::Internal("a unit without a structure".into()))
    }

    /// The command line of a unit without what says where its files go.
    pub(crate) fn words_of(&self, unit: &Unit) -> Result<Vec<String>, Failure> {
        let path = &self.structure(unit)?.path;
        let path = path.to_str().ok_or_else(|| {
            Failure::BadInput(format!("{}: its path is no text: rename it", path.display()))
        })?;
        let mut words = vec!["intrados".to_owned(), name(self.command).to_owned(), path.to_owned()];
        words.extend(unit.member.iter().flat_map(|id| ["--member".to_owned(), id.clone()]));
        if self.command == args::Job::Experiment {
            let [part, of] = unit.part;
            let (first, last) = (CASES * part / of + 1, CASES * (part + 1) / of);
            words.extend(["--cases".to_owned(), format!("{first}..{last}")]);
        }
        words.extend(self.words.iter().cloned());
        if self.walks() && unit.part[1] > 1 {
            words.extend(["--shard".to_owned(), format!("{}/{}", unit.part[0], unit.part[1])]);
        }
        Ok(words)
    }

    /// Whether its results are walks that are added up.
    pub(crate) fn walks(&self) -> bool {
        matches!(self.command, args::Job::Measure | args::Job::Render)
    }
}

/// The word of a command.
pub(crate) fn name(command: args::Job) -> &'static str {
    match command {
        args::Job::Predict => "predict",
        args::Job::Measure => "measure",
        args::Job::Render => "render",
        args::Job::Scan => "scan",
        args::Job::Analyze => "analyze",
        args::Job::Experiment => "experiment",
    }
}

/// Plans a campaign.
pub(crate) fn plan(session: &Session, args: &args::CampaignNew) -> Result<Plan, Failure> {
    let is_table = |path: &Path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"));
    let mut plan = Plan {
        schema: SCHEMA.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        command: args.command,
        words: args.rest.clone(),
        network: None,
        structures: Vec::new(),
        units: Vec::new(),
    };
    match args.over.iter().find(|path| is_table(path)) {
        Some(table) if args.over.len() == 1 => of_table(session, &mut plan, args, table)?,
        Some(table) => {
            return Err(Failure::Usage(format!(
                "{}: a table of bridges goes alone: plan a campaign for each",
                table.display()
            )));
        }
        None if args.command == args::Job::Experiment => of_cases(&mut plan, args)?,
        None => of_scenes(session, &mut plan, args)?,
    }
    for k in 0..plan.units.len() {
        plan.units[k].id = plan.id(&plan.units[k]);
    }
    let ids: BTreeSet<&str> = plan.units.iter().map(|unit| unit.id.as_str()).collect();
    if ids.len() < plan.units.len() {
        return Err(Failure::Usage("the same structure is named twice: name it once".into()));
    }
    Ok(plan)
}

/// One unit, whose id is not known yet.
fn unit(structure: usize, member: Option<String>, part: [u64; 2]) -> Unit {
    Unit { id: String::new(), structure, member, part }
}

fn of_table(
    session: &Session,
    plan: &mut Plan,
    args: &args::CampaignNew,
    path: &Path,
) -> Result<(), Failure> {
    if args.command != args::Job::Predict || !args.rest.is_empty() || args.each_member {
        return Err(Failure::Usage(
            "a table of bridges can only be predicted, and its options stand before --".into(),
        ));
    }
    let path = std::path::absolute(path).map_err(|e| Failure::no_input(path, &e))?;
    let (table, hash) = super::network::read(&path)?;
    for doubt in &table.doubts {
        session.note(format!("{}: {doubt}", path.display()));
    }
    let rows = table.bridges.len().min(args.first.unwrap_or(usize::MAX));
    if rows == 0 {
        return Err(Failure::BadInput(format!("{}: no bridges in it", path.display())));
    }
    let of = args.split.min(rows as u64);
    let built = table.bridges.iter().filter_map(|bridge| bridge.year);
    let late = built.filter(|year| *year > args.now).count();
    if late > 0 {
        let now = args.now;
        session.note(format!(
            "{}: {late} bridges were built after --now {now}: they are taken as new then",
            path.display()
        ));
    }
    let settings = span::Settings { now: args.now, ahead_years: args.ahead };
    plan.network = Some(Network { rows, life: args.life, settings });
    plan.structures.push(Structure { name: "network".into(), path, hash });
    plan.units = (0..of).map(|k| unit(0, None, [k, of])).collect();
    Ok(())
}

/// Cases of the one experiment that has some. What calibration finds is of all plantings together,
/// and what an experiment leaves out by equal time depends on a clock.
fn of_cases(plan: &mut Plan, args: &args::CampaignNew) -> Result<(), Failure> {
    if args.over != [PathBuf::from(TABLE)] || args.each_member {
        return Err(Failure::Usage(format!(
            "of experiments only {TABLE} has cases to deal out: --command experiment --over {TABLE} --split {CASES}"
        )));
    }
    let other = |word: &String| word.starts_with('-') && flag(word) != "--rehearsal";
    if let Some(word) = args.rest.iter().find(|word| other(word)) {
        return Err(Failure::Usage(format!(
            "{word} after --: units of an experiment take --rehearsal alone"
        )));
    }
    let of = args.split.min(CASES);
    plan.structures.push(Structure { name: TABLE.into(), path: TABLE.into(), hash: String::new() });
    plan.units = (0..of).map(|k| unit(0, None, [k, of])).collect();
    parse(&plan.words_of(&plan.units[0])?)?;
    Ok(())
}

/// A word without the value that it may carry.
fn flag(word: &str) -> &str {
    word.split('=').next().unwrap_or_default()
}

fn of_scenes(session: &Session, plan: &mut Plan, args: &args::CampaignNew) -> Result<(), Failure> {
    check_words(plan, args)?;
    let progress = session.watch("reading the structures");
    for (k, path) in args.over.iter().enumerate() {
        session.job.step(k, args.over.len())?;
        let path = if path.is_dir() { path.join("scene.ron") } else { path.clone() };
        let scene = walks::load(&session.within(), &path)?;
        // The name of a scene that comes with the program is no path.
        let path = if path.exists() {
            std::path::absolute(&path).map_err(|e| Failure::no_input(&path, &e))?
        } else {
            path
        };
        let members: Vec<Option<String>> = match args.each_member {
            true => scene.members.iter().map(|m| Some(m.id.clone())).collect(),
            false => vec![None],
        };
        let taken = plan.structures.iter().any(|s| s.name == scene.name);
        let name = if taken { path.display().to_string() } else { scene.name.clone() };
        plan.structures.push(Structure { name, path, hash: scene.hash.clone() });
        for member in members {
            plan.units.extend((0..args.split).map(|i| unit(k, member.clone(), [i, args.split])));
        }
        if plan.units.len() > MOST {
            return Err(Failure::Usage(format!(
                "more than {MOST} units: plan several campaigns, or split less"
            )));
        }
    }
    drop(progress);
    // What is wrong with a word is said now, not by every unit.
    for k in 0..plan.units.len().min(1) {
        parse(&plan.words_of(&plan.units[k])?)?;
    }
    Ok(())
}

fn check_words(plan: &Plan, args: &args::CampaignNew) -> Result<(), Failure> {
    if let Some(ours) = args.rest.iter().map(|w| flag(w)).find(|w| OURS.contains(w)) {
        return Err(Failure::Usage(format!(
            "{ours} after --: the campaign says that itself, or results would depend on a clock; \
             leave it out (threads: `campaign run --threads`)"
        )));
    }
    if args.each_member && !matches!(args.command, args::Job::Scan | args::Job::Analyze) {
        return Err(Failure::Usage("--each-member goes with scan and analyze alone".into()));
    }
    if args.each_member && args.rest.iter().any(|w| flag(w) == "--member") {
        return Err(Failure::Usage("--each-member or --member, not both".into()));
    }
    if args.split > 1 && !plan.walks() {
        return Err(Failure::Usage(
            "--split goes with measure, render and a table; scan and analyze have --each-member"
                .into(),
        ));
    }
    if plan.walks() && !args.rest.iter().any(|w| flag(w) == "--spp") {
        return Err(Failure::Usage(
            "say after -- how many samples: -- --spp N (a time limit would give every run other bits)"
                .into(),
        ));
    }
    Ok(())
}

/// The command of a unit.
pub(crate) fn parse(words: &[String]) -> Result<Command, Failure> {
    let parsed = options::read(words.iter().map(Into::into)).map_err(|why| match why {
        Unread::Words(e) => {
            let text = e.to_string();
            let first = text.lines().next().unwrap_or_default();
            Failure::Usage(first.trim_start_matches("error: ").to_owned())
        }
        Unread::Unused(line) => Failure::Usage(line),
    })?;
    parsed.command.ok_or_else(|| Failure::Internal("a unit without a command".into()))
}
