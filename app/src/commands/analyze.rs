//! `intrados analyze`: the members of a scene through their life, or a deck through its steps.

use intrados_stage::time::{DAY, YEAR};
use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use intrados_mechanics::{
    analysis::{
        GaugeOutcome, MemberOutcome, Moment, Outcome as Life, Pictures, analyze,
        analyze_until_stopped,
    },
    deck::Case,
    frame::Whole,
    linear::{Groups, concerns, parse, parse_mesh},
    material::law::Cracks,
    member::{Along, Axes, MemberError, Meshing, Prepared, prepare_within},
    mesh::voxel::VoxelError,
    model::{self, MarchSettings, Matter, Regularisation},
    read::{self, ReadError, Units},
    skin::{Looking, Seen},
    strength::{CurvePoint, Strength},
    stretch::Stretch,
};
use intrados_predict::unused_conditions;
use intrados_scene::{Assembly, Damage, Scene, SurfaceDamage, SurfaceFile};
use intrados_stage::{
    cpu_seconds,
    file::{Set, WriteError, file_name, file_names},
};
use serde::Serialize;

use super::{linear, walks, whole};
use crate::{
    args::{self, CrackLaw, Regularise},
    failure::{Failure, Outcome},
    output::{self, Files},
    session::Session,
};

/// Pa in a megapascal.
const MPA: f64 = 1e6;
/// The file that names the others.
const LIST: &str = "analyze.json";
/// Folder, within that of the results, of what there is where somebody stops it.
const STOPPED: &str = "stopped";

/// All members. Schema `intrados.analyze/1`.
#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    version: &'static str,
    scene: String,
    scene_hash: String,
    dof: usize,
    elements: usize,
    solver: String,
    iterations: usize,
    cpu_seconds: f64,
    peak_memory_bytes: Option<u64>,
    /// Steps of the model that ends last.
    steps: Vec<Moment>,
    members: Vec<MemberOutcome>,
    gauges: Vec<GaugeOutcome>,
    models: Vec<Life>,
    /// What the scene says and nothing here uses, with the reasons.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    notes: Vec<String>,
    /// All members as one, where that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    whole: Option<Whole>,
    /// Whether somebody stopped it: then it is not all.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    stopped: bool,
    files: Vec<String>,
}

/// What is to be computed, and what it is called.
struct Work {
    name: String,
    /// BLAKE3 of the files.
    hash: String,
    is_scene: bool,
    /// Names of the scene's loads that may be raised until members fail.
    loads: Vec<String>,
    /// What the scene says and nothing here uses.
    notes: Vec<String>,
    prepared: Vec<Prepared>,
    /// Of one member of which a stretch is wanted: all of it in the stretch's bricks, and its axes.
    fine: Option<Box<(Prepared, Axes)>>,
    /// Beginnings of the names of their files, by id.
    names: BTreeMap<String, String>,
}

pub(crate) fn run(session: &Session, args: &args::Analyze) -> Result<Outcome, Failure> {
    if args.whole && args.member.is_empty() {
        return as_one(session, args);
    }
    let mut work = match extension(&args.scene).as_deref() {
        Some(kind @ ("inp" | "msh")) => match deck(args, kind)? {
            Read::Members(work) => work,
            Read::Linear(deck) => return linear::run(session, args, &deck),
        },
        _ => scene(session, args)?,
    };
    if args.regularise == Regularise::Gradient {
        work.models().for_each(|p| {
            p.model.regularisation = Regularisation::Gradient { length: args.length }
        });
    }
    let usual = (args.regularise == Regularise::Gradient).then_some(CrackLaw::Diffuse);
    if let Some(law) = args.crack_law.or(usual) {
        let cracks = match law {
            CrackLaw::Diffuse => Cracks::Diffuse,
            CrackLaw::Planes => Cracks::Planes,
        };
        work.models().for_each(|p| p.model.crack(cracks));
    }
    if let Some(load) = &args.to_failure {
        work.raise(load)?;
    }
    let begin = cpu_seconds();
    if let Some(between) = args.fine {
        work.stretch(session, args, between)?;
    }
    let Some(out) = &args.out else {
        let lives = work.prepared.iter().enumerate().map(|(i, prepared)| {
            let _progress = session.watch(work.label(i));
            analyze(prepared, work.settings(args), &session.job, &mut ())
                .map(|(life, _)| life)
                .map_err(|why| refused(args, prepared, why))
        });
        let lives = lives.collect::<Result<Vec<_>, _>>()?;
        return told(session, &Report::new(&work, lives, cpu_seconds() - begin));
    };
    let key = (
        &work.hash,
        args.element,
        args.fine,
        args.fine_element,
        args.tolerance,
        args.regularise,
        args.length,
        args.crack_law,
        args.whole,
        &args.to_failure,
        args.units.map(|u| format!("{u:?}")),
    );
    let (mut files, lives) = output::in_parts(session, out, &key, |files| {
        drawn_lives(session, args, &work, files, begin)
    })?;
    let (lives, damage): (Vec<Life>, Vec<Vec<SurfaceDamage>>) = lives.into_iter().unzip();
    // For `render --cracks` and `scan --cracks`; a deck is no scene that either could take.
    if work.is_scene {
        let surface = SurfaceFile::new(&work.hash, damage.into_iter().flatten().collect());
        files.write("cracks.json", output::json(&surface)?.as_bytes())?;
    }
    let mut report = Report::new(&work, lives, cpu_seconds() - begin);
    report.files = files.listed(LIST);
    files.finish(LIST, &report)?;
    told(session, &report)
}

/// All members of a scene as one frame.
fn as_one(session: &Session, args: &args::Analyze) -> Result<Outcome, Failure> {
    if let Some(out) = &args.out {
        output::may_begin(out)?;
    }
    let begin = cpu_seconds();
    let scene = walks::load(session, &args.scene)?;
    let found = whole::computed(session, &scene, args.redundancy)?;
    let mut report = Report {
        scene: scene.name.clone(),
        scene_hash: scene.hash.clone(),
        notes: unused_truth(&scene).into_iter().collect(),
        dof: found.unknowns,
        elements: found.beams + found.plates,
        solver: "direct".into(),
        cpu_seconds: cpu_seconds() - begin,
        peak_memory_bytes: peak_memory(),
        ..Report::default()
    };
    if let Some(out) = &args.out {
        let mut files = output::begin(out)?;
        files.write("end_forces.csv", found.csv().as_bytes())?;
        let [bars, plates] = ["whole_bars.vtu", "whole_plates.vtu"].map(|name| files.place(name));
        let folder = files.folder().to_owned();
        let written = found.write_vtu(&bars, &plates, &scene.hash);
        written.map_err(|e| not_written(&folder, e))?;
        report.files = files.listed(LIST);
        report.whole = Some(found);
        files.finish(LIST, &report)?;
    } else {
        report.whole = Some(found);
    }
    session.print(&report, || {
        let mut text = report.whole.as_ref().map_or_else(String::new, |w| whole::table(w, &scene));
        report.notes.iter().for_each(|n| text += &format!("note: {n}\n"));
        report.files.iter().for_each(|f| text += &format!("file {f}\n"));
        text
    })?;
    Ok(Outcome::Done)
}

/// What a scene says that no life here depends on.
fn unused(scene: &Scene) -> Vec<String> {
    unused_truth(scene).into_iter().chain(unused_conditions(scene)).collect()
}

/// Planted damage, which nothing here is computed with.
fn unused_truth(scene: &Scene) -> Option<String> {
    let mut planted = scene.members.iter().filter(|m| !m.truth.is_empty());
    let first = planted.next()?;
    let more = match planted.count() {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    let kinds: BTreeSet<&str> = scene.members.iter().flat_map(|m| &m.truth).map(kind_of).collect();
    Some(format!(
        "The truth of {}{more} ({}) is not used, because members are computed as they are drawn, sound at first: give loads and exposure that damage them, or `predict`, which holds its result against the truth.",
        first.name,
        Vec::from_iter(kinds).join(", ")
    ))
}

fn kind_of(damage: &Damage) -> &'static str {
    match damage {
        Damage::Crack { .. } => "cracks",
        Damage::Voids { .. } => "voids",
        Damage::Honeycomb { .. } => "honeycomb",
        Damage::Spall { .. } => "spalls",
        Damage::Corrosion { .. } => "corrosion",
        Damage::Softened { .. } => "lost stiffness",
    }
}

fn told(session: &Session, report: &Report) -> Result<Outcome, Failure> {
    for model in &report.models {
        model.warnings.iter().for_each(|w| tracing::warn!("{}: {w}", model.id));
    }
    session.print(report, || report.table())?;
    Ok(if report.models.iter().any(|m| !m.complaint.is_empty()) {
        Outcome::TargetNotReached
    } else {
        Outcome::Done
    })
}

impl Work {
    /// How it is computed unless somebody asks otherwise.
    fn usual(&self) -> MarchSettings {
        if self.is_scene || self.prepared.iter().any(cracks) {
            MarchSettings::of_life()
        } else {
            MarchSettings::of_deck()
        }
    }

    fn settings(&self, args: &args::Analyze) -> MarchSettings {
        let usual = self.usual();
        MarchSettings { tolerance: args.tolerance.unwrap_or(usual.tolerance), ..usual }
    }

    /// All that is going to be computed.
    fn models(&mut self) -> impl Iterator<Item = &mut Prepared> {
        self.prepared.iter_mut().chain(self.fine.as_mut().map(|fine| &mut fine.0))
    }

    /// Computes all of a member, and puts in its place what lies `between` two shares of its axis.
    fn stretch(
        &mut self,
        session: &Session,
        args: &args::Analyze,
        between: [f64; 2],
    ) -> Result<(), Failure> {
        let ([whole], Some((fine, axes))) = (&self.prepared[..], self.fine.as_deref()) else {
            return Err(Failure::Usage(
                "--fine is for one member of a scene: name it with --member".into(),
            ));
        };
        let _progress = session.watch(format!("{}, all of it", whole.id));
        let stretch = Stretch::of(whole, fine, axes, between);
        let mut driven = stretch.map_err(|why| Failure::BadInput(why.to_string()))?.driven();
        let (life, _) = analyze(whole, self.settings(args), &session.job, &mut driven)
            .map_err(|why| refused(args, whole, why))?;
        let mut part = driven.prepared();
        if !life.complaint.is_empty() {
            part.warnings.push(format!(
                "all of it ended early, and the stretch is followed as far: {}",
                life.complaint
            ));
        }
        self.prepared = vec![part];
        Ok(())
    }

    /// Raises a load of the scene, or all that may be, until members fail.
    fn raise(&mut self, load: &str) -> Result<(), Failure> {
        if !self.is_scene {
            let why = "--to-failure is for scenes: a deck's steps say what acts";
            return Err(Failure::Usage(why.into()));
        }
        let known: Vec<&str> = self.loads.iter().map(String::as_str).collect();
        if !load.is_empty() && !known.contains(&load) {
            let known = if known.is_empty() { "none".into() } else { known.join(", ") };
            let why = format!("--to-failure={load}: the scene's loads that can be raised: {known}");
            return Err(Failure::Usage(why));
        }
        let names = if load.is_empty() { known } else { vec![load] };
        let mut any = false;
        for prepared in &mut self.prepared {
            let raised = prepared.raise(&names, Along::Automatic);
            any |= raised;
            if !raised {
                prepared.notes.push("none of the loads that are raised acts on it".into());
            }
        }
        match any {
            true => Ok(()),
            false => Err(Failure::BadInput(format!(
                "{}: no force, pressure or displacement acts on what is to be raised to failure: add a load to the scene",
                self.name
            ))),
        }
    }

    /// What is done when model `i` is computed.
    fn label(&self, i: usize) -> String {
        format!("{} ({} of {})", self.prepared[i].id, i + 1, self.prepared.len())
    }
}

fn extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_ascii_lowercase())
}

/// The members of a scene.
fn scene(session: &Session, args: &args::Analyze) -> Result<Work, Failure> {
    let scene = walks::load(session, &args.scene)?;
    let structure = &scene.structure;
    let known: BTreeSet<&str> = structure.assemblies.iter().map(|a| a.id.as_str()).collect();
    let asked = args.member.iter().map(|word| asked_for(&scene, &known, word));
    let asked = asked.collect::<Result<BTreeSet<&str>, Failure>>()?;
    if known.is_empty() {
        return Err(Failure::BadInput(format!("{}: no member to analyze", scene.path.display())));
    }
    let whole = whole_of(session, &scene, args.whole)?;
    let handed = |id: &str| whole.as_ref().and_then(|whole| whole.handed(id));
    // An imported model has many members that bear nothing of interest: those that nothing holds
    // are left out unless asked for.
    let imported =
        structure.assemblies.iter().filter(|a| a.body.is_none() && args.member.is_empty());
    let loose: Vec<&str> = imported
        .map(|a| a.id.as_str())
        .filter(|id| !structure.is_held(id) && handed(id).is_none())
        .collect();
    if let [first, ..] = loose[..] {
        if loose.len() == known.len() {
            let path = scene.path.display();
            return Err(Failure::BadInput(format!(
                "{path}: no member is held: add supports to a scene with this model, such as (member: \"{first}\", place: Bottom, hold: Fixed)"
            )));
        }
        tracing::warn!(
            "{}: {} members are left out because nothing holds them, {} the first",
            scene.name,
            loose.len(),
            scene.name_of(first)
        );
    }
    let wanted = |id: &str| {
        if asked.is_empty() { !loose.contains(&id) } else { asked.contains(id) }
    };
    let meshing = Meshing { element: args.element };
    let chosen = structure.assemblies.iter().filter(|a| wanted(&a.id));
    let made = |a: &Assembly, meshing: Meshing| {
        let handed = handed(&a.id);
        if args.whole && handed.is_none() {
            let why = format!("member {}: it is no part of what bears as a whole", a.id);
            return Err(Failure::BadInput(why));
        }
        Ok(prepare_within(&scene, a, handed, meshing, &session.job)?)
    };
    let chosen: Vec<&Assembly> = chosen.collect();
    let prepared = chosen.iter().map(|a| made(a, meshing)).collect::<Result<Vec<_>, Failure>>()?;
    let fine = match (args.fine, &chosen[..], &prepared[..]) {
        (Some(_), [one], [whole]) => {
            let mesh = &whole.model.mesh;
            let longest = (0..mesh.hexes.len() as u32).map(|hex| mesh.longest(hex));
            let half = 0.5 * longest.fold(0.0, f64::max);
            let meshing = Meshing { element: Some(args.fine_element.unwrap_or(half)) };
            Some(Box::new((made(one, meshing)?, Axes::of(&one.frame))))
        }
        _ => None,
    };
    let names =
        known.iter().map(|id| (*id).to_owned()).zip(file_names(&Vec::from_iter(&known))).collect();
    let loads = structure.loads.iter().filter(|l| l.action.can_be_raised());
    let loads = loads.map(|l| l.name.clone()).collect();
    let notes = unused(&scene);
    let (name, hash) = (scene.name, scene.hash);
    Ok(Work { name, hash, is_scene: true, loads, notes, prepared, fine, names })
}

/// The assembly that somebody calls so, by id or name.
fn asked_for<'a>(
    scene: &'a Scene,
    known: &BTreeSet<&'a str>,
    word: &str,
) -> Result<&'a str, Failure> {
    let named = known.get(word).copied().or_else(|| {
        let id = scene.id_of(word).ok()?;
        known.get(id).copied()
    });
    named.ok_or_else(|| {
        let all: Vec<&str> = known.iter().map(|id| scene.name_of(id)).collect();
        let why = match scene.id_of(word) {
            Err(several @ 2..) => format!("{several} members have that name: give an id"),
            _ => format!("the scene has {}", all.join(", ")),
        };
        Failure::Usage(format!("--member {word}: {why}"))
    })
}

/// The whole of a scene: `asked` for, or where its members bear as one. There a whole that cannot
/// be computed leaves every member to its own supports.
fn whole_of(session: &Session, scene: &Scene, asked: bool) -> Result<Option<Whole>, Failure> {
    if !asked && !scene.bears_as_one() {
        return Ok(None);
    }
    match whole::computed(session, scene, false) {
        Err(Failure::BadInput(why)) if !asked => {
            tracing::warn!("each member is computed by itself, since {why}");
            Ok(None)
        }
        found => found.map(Some),
    }
}

/// Whether any of it is concrete that may crack: an equilibrium is found as those of a life are.
fn cracks(prepared: &Prepared) -> bool {
    prepared.model.bodies.iter().any(|body| matches!(body.matter, Matter::Concrete(_)))
}

/// What a deck is.
enum Read {
    /// Bricks, shells and bars, as members have them.
    Members(Work),
    /// Any solids, without members.
    Linear(Box<linear::Read>),
}

/// A deck or a mesh of another program.
fn deck(args: &args::Analyze, kind: &str) -> Result<Read, Failure> {
    let path = &args.scene;
    let Some(units) = args.units else {
        return Err(Failure::Usage(format!(
            "{}: a deck or mesh says no units: give --units m,N or --units mm,N",
            path.display()
        )));
    };
    let bytes = read::bytes(path)?;
    let hash = blake3::hash(&bytes).to_hex().to_string();
    let name =
        path.file_stem().map_or_else(|| "deck".into(), |stem| stem.to_string_lossy().into_owned());
    if kind == "msh" {
        return mesh(args, units, &bytes, name);
    }
    if concerns(&bytes) {
        let deck = parse(&bytes, path, units)?;
        return Ok(Read::Linear(Box::new(linear::Read { deck, name, hash })));
    }
    let deck = read::abaqus::parse(&bytes, path, units)?;
    let case =
        Case::new(deck).map_err(|why| Failure::BadInput(format!("{}: {why}", path.display())))?;
    let prepared = vec![case.prepared(&name)];
    let names = prepared.iter().map(|p| (p.id.clone(), file_name(&p.id))).collect();
    Ok(Read::Members(Work {
        prepared,
        fine: None,
        names,
        name,
        hash,
        is_scene: false,
        loads: Vec::new(),
        notes: Vec::new(),
    }))
}

/// A mesh of Gmsh, and what its groups are.
fn mesh(args: &args::Analyze, units: Units, bytes: &[u8], name: String) -> Result<Read, Failure> {
    let path = &args.scene;
    let beside = path.with_extension("groups.ron");
    if args.groups.is_none() && !beside.exists() {
        return Err(Failure::NoInput(format!(
            "{}: a mesh brings no materials, supports or loads: say in {} what its physical groups are, or give --groups FILE",
            path.display(),
            beside.display()
        )));
    }
    let said = args.groups.as_ref().unwrap_or(&beside);
    let text = read::bytes(said)?;
    let groups = Groups::parse(&text, said)?;
    let deck = parse_mesh(bytes, path, units, &groups)?;
    let hash = blake3::Hasher::new().update(bytes).update(&text).finalize();
    Ok(Read::Linear(Box::new(linear::Read { deck, name, hash: hash.to_hex().to_string() })))
}

/// All lives with their files; where they are stopped, what there is until then is published.
fn drawn_lives(
    session: &Session,
    args: &args::Analyze,
    work: &Work,
    files: &mut Set,
    begin: f64,
) -> Result<Vec<(Life, Vec<SurfaceDamage>)>, Failure> {
    let (mut lives, mut stopped) = (Vec::new(), None);
    for (i, prepared) in work.prepared.iter().enumerate() {
        let progress = session.watch(work.label(i));
        let life = files.part(&prepared.id, |files| {
            let (life, damage) = drawn_life(session, args, work, prepared, files)?;
            if life.stopped {
                stopped = Some(life);
                return Err(Failure::Interrupted);
            }
            Ok((life, damage))
        });
        drop(progress);
        match life {
            Ok(life) => lives.push(life),
            Err(Failure::Interrupted) => {
                let lives = lives.into_iter().map(|(life, _)| life).chain(stopped).collect();
                keep_so_far(session, files, Report::new(work, lives, cpu_seconds() - begin))?;
                return Err(Failure::Interrupted);
            }
            Err(other) => return Err(other),
        }
    }
    Ok(lives)
}

/// Publishes what there is of lives that were stopped, in a folder of its own: the result, to which
/// the same command goes on, is whole or not there.
fn keep_so_far(session: &Session, files: &Set, mut report: Report) -> Result<(), Failure> {
    if report.models.is_empty() || session.is_embedded() {
        return Ok(());
    }
    let folder = output::inner(files.folder(), STOPPED)?;
    let mut so_far = output::begin(&folder)?;
    files.copy_into(&mut so_far).map_err(|e| Failure::cannot_write(&folder, e))?;
    report.stopped = true;
    report.files = so_far.listed(LIST);
    so_far.finish(LIST, &report)?;
    session.note(format_args!("interrupted: what was reached is in {}", folder.display()));
    Ok(())
}

/// A life with its files, and what is seen of it from outside.
fn drawn_life(
    session: &Session,
    args: &args::Analyze,
    work: &Work,
    prepared: &Prepared,
    files: &mut Set,
) -> Result<(Life, Vec<SurfaceDamage>), Failure> {
    let name = &work.names[&prepared.id];
    let series = files.place(format!("{name}.pvd"));
    let mut pictures = Pictures::new(series, prepared.axis, &work.hash);
    let mut looking = Looking::new(prepared, Seen::default());
    let mut both = (&mut pictures, &mut looking);
    let (life, _) = analyze_until_stopped(prepared, work.settings(args), &session.job, &mut both)
        .map_err(|why| refused(args, prepared, why))?;
    let folder = files.folder().to_owned();
    let cannot = |e| not_written(&folder, e);
    life.write_steps(&files.place(format!("{name}.csv"))).map_err(cannot)?;
    if let Some(strength) = &life.strength {
        strength.write_curve(&files.place(format!("{name}-strength.csv"))).map_err(cannot)?;
        let plot = files.place(format!("{name}-strength.svg"));
        strength.plot_curve(&plot, &prepared.id).map_err(cannot)?;
    }
    for drawn in pictures.finish().map_err(cannot)? {
        files.place(drawn.file_name().unwrap_or_default().to_string_lossy());
    }
    Ok((life, looking.last().into_iter().filter(|d| !d.is_empty()).collect()))
}

/// A file of a set, named where it would have come to lie.
pub(super) fn not_written(folder: &Path, error: WriteError) -> Failure {
    Failure::cannot_write(&folder.join(error.path.file_name().unwrap_or_default()), error.source)
}

/// Bricks that are too large for their concrete are of the user's choosing.
fn refused(args: &args::Analyze, prepared: &Prepared, why: model::Failure) -> Failure {
    match (&why, args.element) {
        (model::Failure::Material { .. }, Some(edge)) => Failure::BadInput(format!(
            "member {}: {why}: give less than --element {edge}, or nothing for one that suits the section",
            prepared.id
        )),
        _ => why.into(),
    }
}

impl Default for Report {
    /// Of nothing.
    fn default() -> Self {
        Self {
            schema: "intrados.analyze/1",
            version: env!("CARGO_PKG_VERSION"),
            scene: String::new(),
            scene_hash: String::new(),
            dof: 0,
            elements: 0,
            solver: String::new(),
            iterations: 0,
            cpu_seconds: 0.0,
            peak_memory_bytes: None,
            steps: Vec::new(),
            members: Vec::new(),
            gauges: Vec::new(),
            models: Vec::new(),
            notes: Vec::new(),
            whole: None,
            stopped: false,
            files: Vec::new(),
        }
    }
}

impl Report {
    fn new(work: &Work, models: Vec<Life>, cpu_seconds: f64) -> Self {
        let longest =
            models.iter().max_by(|a, b| a.steps.len().cmp(&b.steps.len())).map(|m| m.steps.clone());
        let solved = models.iter().flat_map(|m| m.solver.split(", ")).filter(|s| !s.is_empty());
        let solved = match &Vec::from_iter(solved.collect::<BTreeSet<_>>())[..] {
            [] => "nothing had to be solved".into(),
            names => names.join(", "),
        };
        Self {
            scene: work.name.clone(),
            scene_hash: work.hash.clone(),
            dof: models.iter().map(|m| m.dof).sum(),
            elements: models.iter().map(|m| m.elements).sum(),
            solver: format!("{solved} (rule: {})", work.usual().method.words()),
            iterations: models.iter().map(|m| m.iterations).sum(),
            cpu_seconds,
            peak_memory_bytes: peak_memory(),
            steps: longest.unwrap_or_default(),
            members: models.iter().flat_map(|m| m.members.clone()).collect(),
            gauges: models.iter().flat_map(|m| m.gauges.clone()).collect(),
            models,
            notes: work.notes.clone(),
            ..Self::default()
        }
    }

    fn table(&self) -> String {
        let head = [
            "member",
            "tension MPa",
            "compression MPa",
            "bars MPa",
            "damage",
            "damaged volume",
            "crack mm",
        ];
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
                t.name.strip_prefix("tendon ").unwrap_or(&t.name),
                t.final_stress_pa / MPA,
                t.losses.friction_and_slip_pa / MPA,
                t.losses.relaxation_pa / MPA,
                t.losses.concrete_pa / MPA
            );
        }
        for (m, pipe) in self.members.iter().filter_map(|m| Some((m, m.pipe?))) {
            text += &format!(
                "{}, its steel pipe: {:.0} MPa around and {:.0} along at most, {:.0} and {:.0} on average at the end\n",
                m.name,
                pipe.around_pa / MPA,
                pipe.along_pa / MPA,
                pipe.final_around_pa / MPA,
                pipe.final_along_pa / MPA
            );
        }
        for m in &self.members {
            if let Some(rust) = m.corrosion {
                let begins = rust
                    .begins_s
                    .map_or("never".into(), |s| format!("after {:.1} years", s / YEAR));
                let share = 100.0 * rust.max_section_loss;
                text += &format!(
                    "{}: bars begin to rust {begins}; at the end up to {share:.1} % of a section is lost\n",
                    m.name
                );
            }
            if m.concrete_assumed {
                text += &format!("{}: its concrete is assumed\n", m.name);
            }
        }
        self.gauges
            .iter()
            .for_each(|g| text += &format!("gauge {}: {:.4e} {}\n", g.name, g.value, g.unit));
        for m in &self.models {
            let days = m.steps.last().map_or(0.0, |s| s.time_s / DAY);
            text += &format!(
                "{}: {} unknowns, {} elements, {} steps to day {days:.0}\n",
                m.id,
                m.dof,
                m.elements,
                m.steps.len()
            );
            m.cracks.iter().for_each(|cracks| text += &format!("  cracks: {cracks}\n"));
            m.strength.iter().for_each(|strength| text += &bears(strength));
            let loose = m.steps.iter().filter(|s| !s.converged && s.residual.is_finite());
            if let Some(worst) = loose.clone().map(|s| s.residual).reduce(f64::max) {
                text += &format!(
                    "  {} of its steps were taken with up to {worst:.1e} of all that acts out of balance\n",
                    loose.count()
                );
            }
            if !m.complaint.is_empty() {
                text += &format!("{} ended early: {}\n", m.id, m.complaint);
            }
            m.warnings.iter().for_each(|w| text += &format!("  WARNING: {w}\n"));
            m.notes.iter().for_each(|n| text += &format!("  note: {n}\n"));
        }
        self.notes.iter().for_each(|n| text += &format!("note: {n}\n"));
        text += &format!("{:.1} CPU-seconds\n", self.cpu_seconds);
        self.files.iter().for_each(|f| text += &format!("file {f}\n"));
        text
    }
}

/// What a member bears, in lines.
fn bears(strength: &Strength) -> String {
    let at = |p: &CurvePoint| {
        let [kn, mm] = [1e-3 * p.load_n, 1e3 * p.displacement_m];
        format!("{kn:.1} kN at {mm:.2} mm (factor {:.3})", p.load_factor)
    };
    let mut text = format!("  raised: {}\n", strength.loads.join(", "));
    strength.yielding.iter().for_each(|y| text += &format!("  a bar yields first at {}\n", at(y)));
    text += &format!("  it bears {}\n", at(&strength.peak));
    text += &format!("  failure: {}: {}\n", strength.mode.words(), strength.because);
    if let Some(ultimate) = &strength.ultimate {
        let ductility = strength.ductility.map_or(String::new(), |d| format!(", ductility {d:.1}"));
        text += &format!("  a fifth is lost, or steel breaks, at {}{ductility}\n", at(ultimate));
    }
    text + &format!("  followed until {}\n", strength.ended)
}

/// The most memory that this process has held, where the system says.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib * 1024)
}

impl From<MemberError> for Failure {
    fn from(error: MemberError) -> Self {
        match error {
            MemberError::Surface { source: VoxelError::Cancelled(_), .. } => Self::Interrupted,
            MemberError::Heat { source, .. } if matches!(*source, model::Failure::Cancelled(_)) => {
                Self::Interrupted
            }
            other => Self::BadInput(other.to_string()),
        }
    }
}

impl From<model::Failure> for Failure {
    fn from(error: model::Failure) -> Self {
        match error {
            why if why.is_cancelled() => Self::Interrupted,
            other => Self::BadInput(other.to_string()),
        }
    }
}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        if error.is_missing() {
            Self::NoInput(error.to_string())
        } else {
            Self::BadInput(error.to_string())
        }
    }
}
