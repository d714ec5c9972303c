//! `intrados measure`: readings of camera and meters from both sides.

use std::{path::Path, sync::Arc, time::Duration};

use intrados_light::{
    Culprit, Guide, Measurement, MeterReading, Sensor, Sides, false_colours, readings,
};
use intrados_scene::{Camera, Scene};
use intrados_stage::file::{Set, file_name};
use intrados_transport::{Converged, Round, Side, WalkRule};
use serde::Serialize;

use super::{render::MapRows, walks};
use crate::{
    accumulator::{Accumulator, Content, Shards},
    args,
    drive::{self, Rules, Stopped, Work},
    failure::{Failure, Outcome},
    output::{self, Files},
    picture,
    session::Session,
};

/// All readings. Schema `intrados.measure/1`.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    schema: &'static str,
    version: &'static str,
    scene: String,
    scene_hash: String,
    seed: u64,
    /// `None`: unlimited.
    max_depth: Option<u32>,
    /// Which rule ended it; `None` for merged shards.
    stop: Option<Stopped>,
    target_rel_error: Option<f64>,
    target_reached: Option<bool>,
    /// When an error bar counts as converged.
    thresholds: Thresholds,
    pub(crate) meters: Vec<MeterReading>,
    /// Where the variance of steered walks comes from, worst first; only if asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    explain: Option<Vec<Culprit>>,
    /// How learning went, round by round.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    learning: Vec<Learnt>,
    setup_cpu_seconds: f64,
    shards: Shards,
    files: Vec<String>,
}

/// One round of learning on one side.
#[derive(Debug, Serialize)]
struct Learnt {
    side: Side,
    steered: bool,
    walks: u64,
    mean: f64,
    rel_var_per_walk: f64,
    events_per_walk: f64,
    cpu_seconds: f64,
    /// Of the field that was built from it.
    cells: usize,
}

impl Learnt {
    fn of(round: &Round) -> Self {
        let reading = round.scores.reading();
        Self {
            side: round.side,
            steered: round.steered,
            walks: reading.walks,
            mean: reading.mean,
            rel_var_per_walk: reading.rel_var_per_walk(),
            events_per_walk: round.events as f64 / reading.walks as f64,
            cpu_seconds: round.cpu_seconds.iter().sum(),
            cells: round.cells,
        }
    }
}

#[derive(Debug, Serialize)]
struct Thresholds {
    /// The largest score is less than this share of the sum,
    largest_share: f64,
    /// the halves differ by less than so many standard errors,
    halves_z: f64,
    /// and the tail index of the largest scores is above this.
    tail_index: f64,
}

const THRESHOLDS: Thresholds = Thresholds {
    largest_share: Converged::LARGEST_SHARE,
    halves_z: Converged::HALVES_Z,
    tail_index: Converged::TAIL_INDEX,
};

/// Readings in progress, and where their state goes.
struct Readings<'a> {
    measurement: Measurement,
    scene: &'a Scene,
    checkpoint: Option<&'a Path>,
}

impl Readings<'_> {
    fn accumulator(&self) -> Accumulator {
        let Measurement { sensors, primal, dual, .. } = &self.measurement;
        let training = self.measurement.guide().map_or(0.0, |guide| guide.cpu_seconds);
        let (sensors, primal, dual) = (sensors.clone(), primal.clone(), dual.clone());
        Accumulator::new(self.scene, Content::Readings { sensors, primal, dual, training })
    }
}

impl Work for Readings<'_> {
    fn passes(&self) -> u64 {
        self.measurement.rounds()
    }

    fn advance(&mut self, n: u32) -> bool {
        self.measurement.advance_all(n)
    }

    fn done(&self) -> f64 {
        let all = self.measurement.primal.iter().chain(&self.measurement.dual);
        let n = all.clone().count().max(1) as f64;
        all.map(intrados_light::Exposure::done).sum::<f64>() / n
    }

    /// Of the worst reading.
    fn error(&self) -> (f64, bool) {
        let error = |r: &MeterReading| r.combined.std_error / r.combined.mean.abs();
        let all = self.measurement.readings();
        // A NaN (nothing found yet) is no error that any target allows.
        let worst = all
            .iter()
            .map(error)
            .fold(0.0, |a: f64, b| if b.is_nan() { f64::INFINITY } else { a.max(b) });
        // Of one side alone nothing can be certified: its own scores must do.
        let may_stop = |r: &MeterReading| match (&r.primal, &r.dual) {
            (Some(one), None) | (None, Some(one)) => one.evidence.holds(),
            _ => r.combined.converged,
        };
        (worst, all.iter().all(may_stop))
    }

    fn label(&self) -> String {
        format!("measuring {}: worst reading ± {:.3} %", self.scene.name, 100.0 * self.error().0)
    }

    fn save(&self) -> Result<(), Failure> {
        self.checkpoint.map_or(Ok(()), |path| self.accumulator().write(path))
    }
}

pub(crate) fn run(session: &Session, args: &args::Measure) -> Result<Outcome, Failure> {
    let opened = walks::open(session, &args.scene)?;
    let sensors = sensors(&opened.scene, args)?;
    let is_sized = args.size.width.is_some() || args.size.height.is_some();
    if is_sized && !sensors.iter().any(|sensor| matches!(sensor, Sensor::Camera(_))) {
        return Err(Failure::Usage(
            "--width and --height do nothing with meters alone: leave them out, or name a camera (--sensor)"
                .into(),
        ));
    }
    let rule = walks::rule(&opened.scene, &args.light);
    let sides = args.light.side.map_or(Sides::Both, Into::into);
    let shard = walks::shard(&args.keep);
    let out = args.out.clone().or_else(|| (shard.of > 1).then(|| "out".into()));
    if let Some(out) = &out {
        output::folder(out)?;
        output::may_write(&out.join("measure.json"))?;
    }
    args.keep.checkpoint.as_deref().map_or(Ok(()), output::may_write)?;

    let default = Rules {
        spp: None,
        time: Some(Duration::from_secs(30)),
        target: Some(0.01),
        must_reach: false,
    };
    let rules = Rules::new(&args.stop, default);
    let mut guide = walks::guide(session, &opened.lit, &sensors, rule, &args.light, &rules)?;
    if args.light.learn_only {
        return Ok(Outcome::Done);
    }
    // A guide that shards share was learnt once and is charged once.
    if args.light.guide_from.is_some() && shard.index > 0 {
        guide.iter_mut().for_each(|guide| guide.cpu_seconds = 0.0);
    }
    let guide = guide.map(Arc::new);
    let measurement = Measurement::new(
        opened.lit.clone(),
        sensors,
        sides,
        rule,
        args.light.seed,
        shard,
        rules.spp,
    );
    let measurement = match &guide {
        Some(guide) => measurement.guided(guide.clone()),
        None => measurement,
    };
    let mut work =
        Readings { measurement, scene: &opened.scene, checkpoint: args.keep.checkpoint.as_deref() };
    if let Some(path) = &args.keep.resume {
        resume(&mut work, path)?;
    }
    let stopped = drive::drive(
        session,
        &mut work,
        &rules,
        args.keep.checkpoint.as_ref().map(|_| args.keep.checkpoint_every),
    );
    let accumulator = work.accumulator();
    let mut report = Report::of(&accumulator)?;
    report.setup_cpu_seconds = opened.setup_cpu_seconds;
    report.stop = Some(stopped);
    report.learning = guide.iter().flat_map(|guide| guide.rounds()).map(Learnt::of).collect();
    if args.explain {
        report.explain = guide.as_ref().map(|guide| guide.explain(&opened.lit));
        if report.explain.is_none() {
            tracing::warn!(
                "--explain: no field was learnt (--guide off, or another estimator than next-event), so there is nothing to explain"
            );
        }
    }
    report.target_rel_error = rules.target;
    report.target_reached = rules.reached(&work);
    if let Some(out) = &out {
        if shard.of > 1 {
            let path = out.join(format!(
                "{}.{}of{}.acc",
                file_name(&opened.scene.name),
                shard.index,
                shard.of
            ));
            accumulator.write(&path)?;
            report.files = output::names(&[path]);
        } else {
            let camera = sensors_of(&accumulator)
                .iter()
                .find_map(|s| if let Sensor::Camera(c) = s { Some(c) } else { None });
            let mut files = output::begin(out)?;
            if let (Some(guide), Some(camera), true) = (&guide, camera, args.explain) {
                field_pictures(guide, &opened, camera, &mut files)?;
            }
            report.write(files)?;
        }
    }
    session.print(&report, || report.table())?;
    Ok(rules.outcome(stopped, report.target_reached))
}

fn sensors_of(accumulator: &Accumulator) -> &[Sensor] {
    match &accumulator.content {
        Content::Readings { sensors, .. } => sensors,
        Content::Picture { .. } => &[],
    }
}

/// Writes what the fields say of the surfaces that a camera sees, in false colours.
fn field_pictures(
    guide: &Guide,
    opened: &walks::Opened,
    camera: &Camera,
    files: &mut Set,
) -> Result<(), Failure> {
    for (side, name, unit) in
        [(Side::Primal, "radiance", "W/m2"), (Side::Dual, "importance", "1/m2")]
    {
        let values = guide.picture(&opened.lit, camera, side);
        let (colours, [lo, hi]) = false_colours(&values);
        let facts = vec![
            ("Scene", opened.scene.hash.clone()),
            ("Field", format!("{name}: what arrives by flights, {unit}")),
            ("Range", format!("viridis, logarithmic, {lo:.3e} to {hi:.3e} {unit}; grey: unknown")),
        ];
        files.write(
            format!("field-{name}.png"),
            &picture::png_of_colours([camera.width, camera.height], &colours, &facts)?,
        )?;
    }
    Ok(())
}

/// The first camera (or all) and all meters, or those of the given names.
fn sensors(scene: &Scene, args: &args::Measure) -> Result<Vec<Sensor>, Failure> {
    let cameras =
        scene.cameras.iter().map(|c| Ok(Sensor::Camera(walks::sized(c.clone(), &args.size)?)));
    let meters = scene.meters.iter().cloned().map(Sensor::Meter);
    if args.sensor.is_empty() {
        let some = if args.all { usize::MAX } else { 1 };
        let all = cameras.take(some).chain(meters.map(Ok)).collect::<Result<Vec<_>, Failure>>()?;
        if all.is_empty() {
            return Err(Failure::BadInput(format!(
                "{} has neither a camera nor a meter: add one to its file",
                scene.name
            )));
        }
        return Ok(all);
    }
    let all = cameras.chain(meters.map(Ok)).collect::<Result<Vec<_>, Failure>>()?;
    let find = |name: &String| {
        all.iter().find(|s| s.name() == name).cloned().ok_or_else(|| {
            let names: Vec<&str> = all.iter().map(Sensor::name).collect();
            Failure::Usage(format!(
                "{} has no camera or meter \"{name}\": there are {}",
                scene.name,
                names.join(", ")
            ))
        })
    };
    args.sensor.iter().map(find).collect()
}

fn resume(work: &mut Readings, path: &Path) -> Result<(), Failure> {
    let accumulator = Accumulator::read(path)?;
    accumulator.check_scene(path, work.scene)?;
    let Content::Readings { sensors, primal, dual, .. } = accumulator.content else {
        return Err(Failure::BadInput(format!(
            "{}: holds a picture, not readings: resume it with `render`",
            path.display()
        )));
    };
    let why =
        |why: String| Failure::BadInput(format!("{}: cannot go on from it: {why}", path.display()));
    if sensors != work.measurement.sensors {
        return Err(why("it is of other cameras or meters".into()));
    }
    work.measurement.restore(primal, dual).map_err(|mismatch| why(mismatch.to_string()))
}

impl Report {
    /// What an accumulator of readings says.
    pub(crate) fn of(accumulator: &Accumulator) -> Result<Self, Failure> {
        let Content::Readings { sensors, primal, dual, training } = &accumulator.content else {
            return Err(Failure::Internal("a picture has no readings".into()));
        };
        let first = primal.iter().chain(dual).next();
        let rule = first.map_or_else(WalkRule::default, |e| e.rule);
        Ok(Self {
            schema: "intrados.measure/1",
            version: env!("CARGO_PKG_VERSION"),
            scene: accumulator.scene.clone(),
            scene_hash: accumulator.scene_hash.clone(),
            seed: first.map_or(0, |e| e.seed),
            max_depth: (rule.max_order < u32::MAX).then_some(rule.max_order),
            stop: None,
            target_rel_error: None,
            target_reached: None,
            thresholds: THRESHOLDS,
            meters: readings(sensors, primal, dual.as_ref(), None, *training),
            explain: None,
            learning: Vec::new(),
            setup_cpu_seconds: 0.0,
            shards: accumulator.shards(),
            files: Vec::new(),
        })
    }

    /// Writes measure.json and names all files.
    pub(crate) fn write(&mut self, mut files: Set) -> Result<(), Failure> {
        const LIST: &str = "measure.json";
        self.files = files.listed(LIST);
        files.finish(LIST, self)
    }

    pub(crate) fn table(&self) -> String {
        let mut rows = vec![
            [
                "meter",
                "side",
                "mean",
                "std error",
                "unit",
                "walks",
                "CPU s",
                "merit",
                "converged",
                "gap",
            ]
            .map(String::from),
        ];
        let number = |x: f64, digits: usize| {
            if x.is_finite() { format!("{x:.digits$e}") } else { "-".into() }
        };
        let yes = |ok: bool| if ok { "yes" } else { "no" }.to_owned();
        for meter in &self.meters {
            let gap = meter.duality_z.map_or("-".into(), |z| format!("{z:.2}"));
            for (name, side) in [("primal", &meter.primal), ("dual", &meter.dual)] {
                let Some(side) = side else { continue };
                rows.push([
                    meter.name.clone(),
                    name.into(),
                    number(side.mean, 5),
                    number(side.std_error, 1),
                    meter.unit.into(),
                    side.walks.to_string(),
                    format!("{:.2}", side.cpu_seconds),
                    number(side.figure_of_merit, 2),
                    yes(side.converged),
                    String::new(),
                ]);
            }
            let both = &meter.combined;
            let heavier = if both.side == Side::Primal { "primal" } else { "dual" };
            let name = if meter.primal.is_some() && meter.dual.is_some() {
                format!("both ({heavier})")
            } else {
                continue;
            };
            rows.push([
                meter.name.clone(),
                name,
                number(both.mean, 5),
                number(both.std_error, 1),
                meter.unit.into(),
                String::new(),
                format!("{:.2}", both.cpu_seconds),
                number(both.figure_of_merit, 2),
                yes(both.converged),
                gap,
            ]);
        }
        let mut text = output::table(&rows.map_rows());
        for meter in &self.meters {
            for (name, side) in [("primal", &meter.primal), ("dual", &meter.dual)] {
                if let Some(side) = side.as_ref().filter(|s| !s.complaint.is_empty()) {
                    text += &format!("{}, {name}: not converged: {}\n", meter.name, side.complaint);
                }
            }
            if meter.primal.is_some() && meter.dual.is_some() && !meter.combined.converged {
                text +=
                    &format!("{}, both: not converged: {}\n", meter.name, meter.combined.complaint);
            }
        }
        if let Some(culprits) = &self.explain {
            text += &explanation(culprits);
        }
        if let Some(stop) = self.stop {
            text += &format!("stopped by {}\n", stop.words());
        }
        if let Some(complaint) = self.shards.complaint() {
            text += &format!("shards: {complaint}\n");
        }
        self.files.iter().for_each(|f| text += &format!("file {f}\n"));
        text
    }
}

/// Most surfaces that a table names.
const CULPRITS: usize = 16;

/// The surfaces that bring most of the variance of each side, in the last round of learning.
fn explanation(culprits: &[Culprit]) -> String {
    let mut text = String::new();
    for side in Side::BOTH {
        let of: Vec<&Culprit> = culprits.iter().filter(|c| c.side == side).collect();
        let total: f64 = of.iter().map(|c| c.rel_var).sum();
        let name = if side == Side::Primal { "primal" } else { "dual" };
        let mut rows = vec![
            [name, "share", "relVar", "mean ratio", "largest", "steps a walk"].map(String::from),
        ];
        rows.extend(of.iter().take(CULPRITS).map(|c| {
            [
                c.surface.clone(),
                format!("{:.1} %", 100.0 * c.rel_var / total),
                format!("{:.3}", c.rel_var),
                format!("{:.3}", c.mean),
                format!("{:.1}", c.largest),
                format!("{:.3}", c.steps),
            ]
        }));
        if of.len() > CULPRITS {
            rows.push([
                format!("{} more", of.len() - CULPRITS),
                String::new(),
                String::new(),
                String::new(),
                String::new(),
                String::new(),
            ]);
        }
        text += &output::table(&rows.map_rows());
    }
    text
}
