//! `intrados render`: pictures.

use std::{path::Path, sync::Arc};

use intrados_light::{Plate, Render, RenderSettings, Sensor, Sides, Summary, View, replay};
use intrados_scene::{Camera, Scene};
use intrados_stage::file::file_name;
use intrados_transport::{Estimator, Side, Steering, WalkRule};
use serde::Serialize;

use super::walks::{self, estimator_name};
use crate::{
    accumulator::{Accumulator, Content, Shards},
    args::{self, Exposure, Replay},
    drive::{self, Rules, Stopped, Work},
    failure::{Failure, Outcome},
    output::{self, Files},
    picture::{self, Facts},
    session::Session,
};

/// Unit of the values.
const UNIT: &str = "W/(m2 sr)";

/// What is known of a picture. Schema `intrados.render/1`.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    schema: &'static str,
    version: &'static str,
    scene: String,
    scene_hash: String,
    camera: String,
    width: u32,
    height: u32,
    seed: u64,
    side: Sides,
    estimator: &'static str,
    /// `None`: unlimited.
    max_depth: Option<u32>,
    /// Walks a pixel.
    samples: f64,
    /// Mean luminance over the pixels, and its standard error.
    mean: f64,
    std_error: f64,
    /// Of the mean.
    rel_error: f64,
    /// Of the pixels: root mean square over the mean. `None` where some pixel has too few walks to
    /// tell.
    pixel_rel_error: Option<f64>,
    unit: &'static str,
    /// Whether the scores have converged and the other side vouches for what they have not met:
    /// never from one side alone.
    converged: bool,
    /// Why it is not.
    complaint: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    duality_z: Option<f64>,
    cpu_seconds: f64,
    setup_cpu_seconds: f64,
    /// Which rule ended it; `None` for merged shards.
    stop: Option<Stopped>,
    target_rel_error: Option<f64>,
    target_reached: Option<bool>,
    shards: Shards,
    pub(crate) files: Vec<String>,
}

/// A picture in progress, and where its state goes.
struct Picture<'a> {
    render: Render,
    scene: &'a Scene,
    exposure: Exposure,
    checkpoint: Option<&'a Path>,
}

impl Picture<'_> {
    fn accumulator(&self) -> Accumulator {
        Accumulator::new(
            self.scene,
            Content::Picture { plate: self.render.plate().clone(), exposure: self.exposure },
        )
    }
}

impl Work for Picture<'_> {
    fn passes(&self) -> u64 {
        self.render.plate().passes()
    }

    fn advance(&mut self, n: u32) -> bool {
        self.render.advance(n)
    }

    fn done(&self) -> f64 {
        self.render.done()
    }

    fn error(&self) -> (f64, bool) {
        let plate = self.render.plate();
        (
            picture::pixel_error(&plate.image(View::Combined, None)),
            plate.summary().trust.is_settled(),
        )
    }

    fn label(&self) -> String {
        let spp = self.render.samples_per_pixel();
        format!("rendering {}: {spp:.1} samples per pixel", self.scene.name)
    }

    fn save(&self) -> Result<(), Failure> {
        self.checkpoint.map_or(Ok(()), |path| self.accumulator().write(path))
    }
}

pub(crate) fn run(session: &Session, args: &args::Render) -> Result<Outcome, Failure> {
    let shown = match &args.cracks {
        Some(file) => walks::Shown::File(file),
        None if args.planted => walks::Shown::Planted,
        None => walks::Shown::Nothing,
    };
    let opened = walks::open_damaged(session, &args.scene, shown, args.widen)?;
    let camera = walks::sized(walks::camera(&opened.scene, args.camera.as_deref())?, &args.size)?;
    let rule = walks::rule(&opened.scene, &args.light);
    let sides = args.light.side.map_or(Sides::Primal, Into::into);
    if let Some(wanted) = args.replay {
        return print_replay(session, args, &opened, &camera, rule, wanted);
    }
    if sides.has(Side::Dual) && rule.estimator != Estimator::NextEvent {
        tracing::warn!(
            "walks from the lamps find the pinhole of a camera by links alone: with this estimator the dual picture stays black"
        );
    }
    output::folder(&args.out)?;
    output::may_write(&args.out.join("result.json"))?;
    args.keep.checkpoint.as_deref().map_or(Ok(()), output::may_write)?;

    // A model says how bright its lamps are, but not how it wants to be seen.
    let is_bare = opened.scene.path.extension().is_some_and(|e| e != "ron");
    let rules = Rules::new(
        &args.stop,
        Rules { spp: Some(64), time: None, target: None, must_reach: false },
    );
    let settings = RenderSettings {
        sides,
        rule,
        seed: args.light.seed,
        samples: rules.spp,
        shard: walks::shard(&args.keep),
        orders: true,
    };
    let sensors = [Sensor::Camera(camera.clone())];
    let is_steered = is_long(args, &rules, &camera);
    if let (Some(file), false) = (&args.light.guide_from, is_steered) {
        session.note(format_args!(
            "{}: nothing is learnt into it, since so few walks would not pay for it: --guide on learns all the same",
            file.display()
        ));
    }
    let guide = if is_steered {
        walks::guide(session, &opened.lit, &sensors, rule, &args.light, &rules)?
            .map(|guide| Arc::new(guide.for_picture()))
    } else {
        None
    };
    if args.light.learn_only {
        return Ok(Outcome::Done);
    }
    let mut work = Picture {
        render: Render::guided(opened.lit.clone(), &camera, &settings, guide.as_ref()),
        scene: &opened.scene,
        exposure: args.exposure.unwrap_or(if is_bare {
            Exposure::Auto
        } else {
            Exposure::Stops(camera.exposure)
        }),
        checkpoint: args.keep.checkpoint.as_deref(),
    };
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
    let mut report = Report::of(&accumulator, work.render.plate());
    report.setup_cpu_seconds = opened.setup_cpu_seconds;
    report.stop = Some(stopped);
    report.target_rel_error = rules.target;
    report.target_reached = rules.reached(&work);
    match settings.shard {
        shard if shard.of > 1 => {
            let path = args.out.join(format!(
                "{}.{}of{}.acc",
                file_name(&opened.scene.name),
                shard.index,
                shard.of
            ));
            accumulator.write(&path)?;
            report.files = output::names(&[path]);
        }
        _ => write(&mut report, work.render.plate(), work.exposure, &args.out)?,
    }
    session.print(&report, || report.table())?;
    Ok(rules.outcome(stopped, report.target_reached))
}

/// Fewest walks of a picture for which it may pay to learn what steers them, unless the user says
/// so.
const LONG: u64 = 1 << 24;

/// Whether learning a field is small beside the picture itself.
fn is_long(args: &args::Render, rules: &Rules, camera: &Camera) -> bool {
    let pixels = u64::from(camera.width) * u64::from(camera.height);
    let walks = rules.spp.map_or(u64::MAX, |spp| spp.saturating_mul(pixels));
    Steering::from(args.light.guide) == Steering::On
        || args.light.guide_from.as_deref().is_some_and(Path::exists)
        || (walks >= LONG && rules.time.is_none_or(|t| t.as_secs() >= 10))
}

fn resume(work: &mut Picture, path: &Path) -> Result<(), Failure> {
    let accumulator = Accumulator::read(path)?;
    accumulator.check_scene(path, work.scene)?;
    let Content::Picture { plate, .. } = accumulator.content else {
        return Err(Failure::BadInput(format!(
            "{}: holds readings, not a picture: resume it with `measure`",
            path.display()
        )));
    };
    work.render.restore(plate).map_err(|why| {
        Failure::BadInput(format!("{}: cannot go on from it: {why}", path.display()))
    })
}

/// Writes PNG, EXR and result.json, and names them in the report.
pub(crate) fn write(
    report: &mut Report,
    plate: &Plate,
    exposure: Exposure,
    out: &Path,
) -> Result<(), Failure> {
    const LIST: &str = "result.json";
    let (stem, facts) = (file_name(&report.scene), report.facts());
    let mut files = output::begin(out)?;
    files.write(
        format!("{stem}.png"),
        &picture::png(&plate.image(View::Combined, None), exposure, &facts)?,
    )?;
    files.write(format!("{stem}.exr"), &picture::exr(plate, &facts)?)?;
    report.files = files.listed(LIST);
    files.finish(LIST, report)
}

impl Report {
    pub(crate) fn of(accumulator: &Accumulator, plate: &Plate) -> Self {
        let camera = plate.camera();
        let Summary { combined: reading, duality_z, trust, .. } = plate.summary();
        let first = plate.exposures().iter().flatten().next();
        let rule = first.map_or_else(WalkRule::default, |e| e.rule);
        let side = match plate.exposures() {
            [Some(_), Some(_)] => Sides::Both,
            [None, Some(_)] => Sides::Dual,
            _ => Sides::Primal,
        };
        Self {
            schema: "intrados.render/1",
            version: env!("CARGO_PKG_VERSION"),
            scene: accumulator.scene.clone(),
            scene_hash: accumulator.scene_hash.clone(),
            camera: camera.name.clone(),
            width: camera.width,
            height: camera.height,
            seed: first.map_or(0, |e| e.seed),
            side,
            estimator: estimator_name(rule.estimator),
            max_depth: (rule.max_order < u32::MAX).then_some(rule.max_order),
            samples: plate.samples_per_pixel(),
            mean: reading.mean,
            std_error: reading.std_error,
            rel_error: reading.rel_error(),
            pixel_rel_error: Some(picture::pixel_error(&plate.image(View::Combined, None)))
                .filter(|e| e.is_finite()),
            unit: UNIT,
            converged: trust.is_certified(),
            complaint: trust.words(),
            duality_z,
            cpu_seconds: plate.cpu_seconds(),
            setup_cpu_seconds: 0.0,
            stop: None,
            target_rel_error: None,
            target_reached: None,
            shards: accumulator.shards(),
            files: Vec::new(),
        }
    }

    /// What the files say of themselves.
    fn facts(&self) -> Facts {
        let side = match self.side {
            Sides::Primal => "primal",
            Sides::Dual => "dual",
            Sides::Both => "both",
        };
        let mut facts = vec![
            ("intrados.version", self.version.into()),
            ("intrados.scene", self.scene.clone()),
            ("intrados.sceneHash", self.scene_hash.clone()),
            ("intrados.camera", self.camera.clone()),
            ("intrados.seed", self.seed.to_string()),
            ("intrados.samples", self.samples.to_string()),
            ("intrados.side", side.into()),
            ("intrados.estimator", self.estimator.into()),
            ("intrados.maxDepth", self.max_depth.map_or("unlimited".into(), |d| d.to_string())),
            ("intrados.unit", self.unit.into()),
            ("intrados.mean", self.mean.to_string()),
            ("intrados.relError", self.rel_error.to_string()),
        ];
        // A picture that is not all that was asked for says so.
        facts.extend(
            (self.stop == Some(Stopped::Interrupted))
                .then(|| ("intrados.stop", "interrupted".into())),
        );
        facts.extend(self.shards.complaint().map(|complaint| ("intrados.shards", complaint)));
        facts
    }

    pub(crate) fn table(&self) -> String {
        let per_cent =
            |x: f64| if x.is_finite() { format!("{:.3} %", 100.0 * x) } else { "unknown".into() };
        let mut rows = vec![
            [
                "scene".into(),
                format!(
                    "{} ({} by {}, camera {})",
                    self.scene, self.width, self.height, self.camera
                ),
            ],
            ["mean".into(), format!("{:.6e} ± {:.1e} {}", self.mean, self.std_error, self.unit)],
            ["error of the mean".into(), per_cent(self.rel_error)],
            ["error of the pixels".into(), self.pixel_rel_error.map_or("unknown".into(), per_cent)],
            ["samples per pixel".into(), format!("{:.2}", self.samples)],
            ["CPU time".into(), format!("{:.2} s", self.cpu_seconds)],
        ];
        rows.extend(
            self.duality_z.map(|z| ["duality gap".into(), format!("{z:.2} standard errors")]),
        );
        rows.extend(self.stop.map(|s| ["stopped by".to_owned(), s.words().to_owned()]));
        rows.extend(self.shards.complaint().map(|complaint| ["shards".to_owned(), complaint]));
        rows.extend(
            (!self.converged).then(|| ["not certified".to_owned(), self.complaint.clone()]),
        );
        rows.extend(self.files.iter().map(|f| ["file".into(), f.clone()]));
        output::table(&rows.map_rows())
    }
}

/// Fixed rows as table rows.
pub(crate) trait MapRows {
    fn map_rows(self) -> Vec<Vec<String>>;
}

impl<const N: usize> MapRows for Vec<[String; N]> {
    fn map_rows(self) -> Vec<Vec<String>> {
        self.into_iter().map(Vec::from).collect()
    }
}

/// One sample, walked again. Schema `intrados.replay/1`.
#[derive(Debug, Serialize)]
struct Replayed {
    schema: &'static str,
    scene: String,
    scene_hash: String,
    seed: u64,
    sides: Vec<ReplayedSide>,
}

#[derive(Debug, Serialize)]
struct ReplayedSide {
    side: Side,
    pixel: [u32; 2],
    sample: u64,
    scores: Vec<intrados_light::Scored>,
    /// Sum of the scores, added in their order: what went into the picture.
    sum: [f32; 3],
    unit: &'static str,
}

fn print_replay(
    session: &Session,
    args: &args::Render,
    opened: &walks::Opened,
    camera: &Camera,
    rule: WalkRule,
    wanted: Replay,
) -> Result<Outcome, Failure> {
    let sides: Sides = args.light.side.map_or(Sides::Primal, Into::into);
    let [x, y] = wanted.pixel;
    if x >= camera.width || y >= camera.height {
        return Err(Failure::Usage(format!(
            "pixel {x},{y} is outside the picture of {} by {} pixels",
            camera.width, camera.height
        )));
    }
    let one = |side| {
        let scores =
            replay(&opened.lit, camera, side, &rule, args.light.seed, wanted.pixel, wanted.sample);
        let sum = scores.iter().fold([0.0; 3], |sum: [f32; 3], s| {
            [sum[0] + s.value[0], sum[1] + s.value[1], sum[2] + s.value[2]]
        });
        ReplayedSide { side, pixel: wanted.pixel, sample: wanted.sample, scores, sum, unit: UNIT }
    };
    let result = Replayed {
        schema: "intrados.replay/1",
        scene: opened.scene.name.clone(),
        scene_hash: opened.scene.hash.clone(),
        seed: args.light.seed,
        sides: Side::BOTH.into_iter().filter(|&s| sides.has(s)).map(one).collect(),
    };
    session.print(&result, || {
        let colour = |c: [f32; 3]| c.map(|x| format!("{x:e}"));
        let mut rows = vec![["side", "order", "pixel", "R", "G", "B"].map(String::from)];
        for side in &result.sides {
            let name = if side.side == Side::Primal { "primal" } else { "dual" };
            for score in &side.scores {
                let pixel =
                    format!("{},{}", score.pixel % camera.width, score.pixel / camera.width);
                let [r, g, b] = colour(score.value);
                rows.push([name.into(), score.order.to_string(), pixel, r, g, b]);
            }
            let [r, g, b] = colour(side.sum);
            rows.push([name.into(), "sum".into(), String::new(), r, g, b]);
        }
        output::table(&rows.map_rows())
    })?;
    Ok(Outcome::Done)
}
