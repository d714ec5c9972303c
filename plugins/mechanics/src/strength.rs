//! Strength: after its life, a member's loads are raised until it fails and beyond, along a curve of
//! load over displacement; and by what it fails is told from what happened where.
//!
//! What is controlled is the mean displacement of the loaded nodes along their loads, u = Σ pᵢ uᵢ /
//! Σ |pᵢ|: it grows while a member yields and where it softens. Where no further equilibrium is
//! found that way, the step follows the arc of all displacements instead, which may snap back.

use intrados_stage::Job;
use serde::{Deserialize, Serialize};

use crate::{
    limits::longest,
    member::{Along, Prepared, Raised, Reach},
    model::{
        Action, Control, Drive, Equations, Failure, History, March, MarchSettings, Point,
        SteelKind, Step, System,
    },
};

/// How a member fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// Bars yield in tension before the load falls.
    Yielding,
    /// Concrete is crushed while no bar has yielded in tension.
    Crushing,
    /// A crack oblique to the axis opens, and the load falls.
    DiagonalTension,
    /// The same, and the concrete at its end is crushed.
    ShearCompression,
    /// Bars are pulled out.
    Anchorage,
    /// It leaves its shape before its materials are spent.
    Buckling,
    /// Tendons break.
    PrestressRupture,
    /// Bars break before they have yielded under the loads that it bears most.
    BarRupture,
    /// Concrete tears that no steel holds.
    Tearing,
    /// It has not failed as far as it was followed.
    None,
}

impl Mode {
    /// In the field's words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Yielding => "yielding",
            Self::Crushing => "crushing",
            Self::DiagonalTension => "diagonal tension",
            Self::ShearCompression => "shear compression",
            Self::Anchorage => "anchorage",
            Self::Buckling => "buckling",
            Self::PrestressRupture => "rupture of tendons",
            Self::BarRupture => "rupture of bars",
            Self::Tearing => "tearing of plain concrete",
            Self::None => "none as far as it was followed",
        }
    }
}

/// A point of the curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Mean displacement of the loaded nodes along their loads since these are raised, m.
    pub displacement_m: f64,
    /// Factor of the raised loads: 1 is what the scene writes.
    pub load_factor: f64,
    /// Their resultant, N; where displacements are prescribed, what these take.
    pub load_n: f64,
    /// What is out of balance, over all that acts.
    pub residual: f64,
}

/// What a member bears.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Strength {
    /// Names of the loads that were raised.
    pub loads: Vec<String>,
    /// Equilibria in their order.
    pub curve: Vec<CurvePoint>,
    /// The highest.
    pub peak: CurvePoint,
    /// Where a bar, no stirrup, yields first.
    pub yielding: Option<CurvePoint>,
    /// Where the load has fallen to [`FAILED`] of the peak, or before that steel along it breaks.
    pub ultimate: Option<CurvePoint>,
    /// Displacement there over that where a bar yields first.
    pub ductility: Option<f64>,
    /// How it fails.
    pub mode: Mode,
    /// Why that is said.
    pub because: String,
    /// Why it was followed no further.
    pub ended: String,
    /// Whether it ends in a plane of symmetry: loads are those of what is computed up to there.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub mirrored: bool,
    /// Whether that is because somebody stopped it.
    #[serde(default)]
    pub stopped: bool,
}

/// Share of the peak at which a member counts as failed (the usual definition of ultimate
/// displacement: Park 1989 takes .8).
pub const FAILED: f64 = 0.8;
/// Share of the peak from which on its mode is told by what happened since.
const FALLS: f64 = 0.9;
/// Share of the peak at which it is followed no further.
const SPENT: f64 = 0.78;
/// How far the first step goes, over the longest measure of the member.
const FIRST: f64 = 1e-6;
/// By so much steps grow while the member answers as it did at first.
const GROWTH: f64 = 1.5;
/// Up to here nothing cracks, over the longest measure: steps grow whatever they tell, which is
/// noise as long as they move less than equilibrium is exact.
const EARLY: f64 = 2e-5;
/// Stiffness over that of the beginning from which on steps are short.
const SOFT: f64 = 0.85;
/// Short steps, over how far it has moved.
const SHORT: f64 = 0.04;
/// A step that took no more iterations may be followed by a longer one.
const EASY: usize = 6;
/// Work after the peak over that up to it, and work that is always allowed, as
/// [`MarchSettings::work`] counts it: what falls apart has many equilibria to choose from.
const WORK: [f64; 2] = [1.0, 5e7];
/// The same where only how it fails is wanted.
const MODE_WORK: [f64; 2] = [0.5, 1e7];
/// The same where only the peak is wanted: what takes so much more for one step is past it.
const PEAK_WORK: [f64; 2] = [0.3, 3e6];
/// Iterations that [`WORK`] always allows, though each counts all unknowns: cracks that jump one
/// after another take as many on a fine mesh as on a coarse one.
const ROUNDS: f64 = 1.3e4;
/// Steps, at most.
const STEPS: usize = 400;
/// For so many steps it must not have risen.
const FALLING: usize = 3;
/// Share of the peak below which it is past that.
const PASSED: f64 = 0.97;
/// It is followed no further than so many times the displacement at the first yielding: until it
/// fails, and where that is not wanted (what comes after that is the hardening of bars).
const DUCTILE: [f64; 2] = [12.0, 4.0];
/// Nor than so many times the displacement at the peak, once concrete is crushed or there is no steel.
const BEYOND: f64 = 2.0;
/// How far parts may move, over the longest measure.
const FAR: f64 = 0.1;
/// A crack whose normal is so far off the axis is oblique, degrees.
const OBLIQUE: [f64; 2] = [20.0, 70.0];
/// Damage of compression past its peak from which concrete counts as crushed.
const CRUSHED: f64 = 0.3;
/// Share of a slab across the member that is pressed beyond what its curve rises to, from which that
/// is what ends it.
const PRESSED: f64 = 0.5;
/// Slabs across the member: what is pressed evenly crushes in one of them.
const SLABS: usize = 10;
/// Loads over those of elastic buckling at the peak, from which that is what ends it.
const BUCKLES: f64 = 0.5;

/// How equilibria are found while loads are raised, from how they are found in a life: many cracks
/// grow in every step, and the last per mille costs most.
pub(crate) fn settings(of_life: MarchSettings) -> MarchSettings {
    MarchSettings { tolerance: of_life.tolerance.max(5e-3), loose: 4.0, iterations: 40, ..of_life }
}

/// What is watched on the way.
struct Watch<'a, 'm> {
    structure: &'a System<'m>,
    prepared: &'a Prepared,
    raised: &'a Raised,
    /// Displacement weights of the loaded nodes.
    row: Vec<(u32, u8, f64)>,
    /// Σ wᵢ uᵢ before loads were raised.
    begin: f64,
    /// Factor of the loads then.
    base: f64,
    /// Sum of their resultants at factor 1, N; 0: displacements are prescribed.
    forces: f64,
    curve: Vec<CurvePoint>,
    yielding: Option<(CurvePoint, String)>,
    /// Number of the peak in the curve.
    peak: usize,
    /// What there was to see at the peak.
    at_peak: Vec<[Point; 8]>,
    history_at_peak: Option<History>,
    /// What there is to see now.
    last: Vec<[Point; 8]>,
    /// What was seen when the load had first fallen by a tenth since the peak: what comes later is
    /// what the failure does, not what brings it.
    fallen: Vec<[Point; 8]>,
    /// Of the last step.
    iterations: usize,
    /// What broke first.
    broken: Option<(Mode, String)>,
}

/// Raises loads from a state in equilibrium until the member has failed; `each` sees every
/// equilibrium.
///
/// # Errors
/// [`Failure`], but for steps that find no equilibrium: they end the curve, which says so.
pub(crate) fn raise(
    structure: &System,
    prepared: &Prepared,
    raised: &Raised,
    history: History,
    settings: MarchSettings,
    job: &Job,
    mut each: impl FnMut(&History, &Step, &[[Point; 8]]) -> Result<(), Failure>,
) -> Result<(Strength, History), Failure> {
    let mut watch = Watch::new(structure, prepared, raised, &history)?;
    let drive = |control: Control| Drive::Raised {
        loads: raised.loads.iter().map(|&l| (l, share_of(structure, l, history.time))).collect(),
        control,
    };
    let by_displacement = drive(Control::Row(watch.row.clone()));
    let by_arc = drive(Control::Arc);
    let arc_only = raised.along == Along::ArcLength;
    let start = History { turned: true, factor: 0.0, ..history };
    let first_drive = if arc_only { by_arc.clone() } else { by_displacement };
    let mut march = March::new(structure, start, first_drive, settings);
    let length = longest(structure);
    // An arc counts all nodes.
    let mut unit = if arc_only { nodes(structure).sqrt() } else { 1.0 };
    let (mut step, mut stiffness, mut is_arc) = (FIRST * length, None, arc_only);
    let (mut ended, mut at_peak) = (format!("{STEPS} steps were taken"), 0.0);
    let mut stopped = false;
    for _ in 0..STEPS {
        // How many steps it takes nobody knows.
        let share = watch.curve.len() as f64 / STEPS as f64;
        let goes_on = job.step(watch.curve.len().min(STEPS), STEPS).map_err(Failure::from);
        let within = job.part(share, share);
        // A second a step, for whoever looks at the pictures.
        let time = march.history.time + 1.0;
        let went = goes_on.and_then(|()| {
            march.advance(time, step * unit, &within, |history, step| {
                let points = structure.all_points(history)?;
                watch.see(history, step, &points);
                each(history, step, &points)
            })
        });
        match went {
            Ok(()) => {}
            Err(why) if why.is_cancelled() => {
                stopped = true;
                break;
            }
            Err(Failure::NotConverged { .. } | Failure::Solve(_))
                if !is_arc && raised.along == Along::Automatic && watch.curve.len() > 1 =>
            {
                is_arc = true;
                unit = nodes(structure).sqrt();
                step *= 0.25;
                march = March::new(structure, march.history, by_arc.clone(), settings);
                at_peak = 0.0;
                continue;
            }
            Err(Failure::Laborious) => {
                ended = "following it further took more work than all up to its peak".into();
                break;
            }
            Err(why @ (Failure::NotConverged { .. } | Failure::Solve(_))) => {
                ended = why.to_string();
                break;
            }
            Err(other) => return Err(other),
        }
        if watch.peak + 1 == watch.curve.len() {
            at_peak = march.spent();
        }
        let [share, least] = watch.patience();
        march.limit(at_peak + (share * at_peak).max(least));
        if let Some(why) = watch.is_spent(length) {
            ended = why;
            break;
        }
        step = watch.next(step, length, &mut stiffness);
    }
    let history = march.history;
    Ok((watch.tell(ended, stopped, job)?, history))
}

/// [`WORK`] of so many unknowns.
fn work(unknowns: usize) -> [f64; 2] {
    [WORK[0], WORK[1].max(ROUNDS * unknowns as f64)]
}

/// Whether steel of this name goes around the others.
fn is_stirrup(name: &str) -> bool {
    name.starts_with("stirrup") || name.starts_with("hoop")
}

/// How much of a load one of the factor is: what acts of it already, or all of it where nothing
/// does.
fn share_of(structure: &System, load: usize, time: f64) -> f64 {
    let factor = structure.model.loads[load].factor(time);
    if factor == 0.0 { 1.0 } else { factor }
}

/// Resultant of an action at factor 1, N.
fn resultant(structure: &System, action: &Action, time: f64) -> Result<f64, Failure> {
    let mut forces = vec![0.0; structure.unknowns()];
    structure.add_load(action, 1.0, time, &mut forces)?;
    let each = forces.as_chunks::<3>().0.iter().map(|f| glam::DVec3::from_array(*f));
    Ok(each.sum::<glam::DVec3>().length())
}

/// Of a brick's volume what its damage of compression past the peak `is` such, and all of it, m³.
fn volumes(
    structure: &System,
    hex: usize,
    points: &[Point; 8],
    is: impl Fn(f64) -> bool,
) -> [f64; 2] {
    let volume = structure.model.mesh.hex_volume(hex as u32);
    let such = points.iter().filter(|point| is(point.crushing())).count();
    [volume * such as f64 / 8.0, volume]
}

fn nodes(structure: &System) -> f64 {
    structure.model.mesh.nodes.len() as f64
}

impl<'a, 'm> Watch<'a, 'm> {
    fn new(
        structure: &'a System<'m>,
        prepared: &'a Prepared,
        raised: &'a Raised,
        history: &History,
    ) -> Result<Self, Failure> {
        let (mut pull, mut base, mut forces) = (vec![0.0; structure.unknowns()], 0.0_f64, 0.0);
        for &load in &raised.loads {
            let share = share_of(structure, load, history.time);
            let action = &structure.model.loads[load].action;
            structure.add_load(action, share, history.time, &mut pull)?;
            if let Action::Displacement(values) = action {
                values
                    .iter()
                    .for_each(|&(n, c, v)| pull[3 * n as usize + usize::from(c)] += share * v);
            }
            base = base.max(structure.model.loads[load].factor(history.time).abs());
            forces += resultant(structure, action, history.time)?;
        }
        let all: f64 = pull.iter().map(|p| p.abs()).sum();
        let row = pull.iter().enumerate().filter(|(_, p)| **p != 0.0);
        let row = row.map(|(i, p)| ((i / 3) as u32, (i % 3) as u8, p / all)).collect();
        let mut watch = Self {
            structure,
            prepared,
            raised,
            row,
            begin: 0.0,
            base: if base == 0.0 { 0.0 } else { 1.0 },
            forces,
            curve: Vec::new(),
            yielding: None,
            peak: 0,
            at_peak: Vec::new(),
            history_at_peak: None,
            last: Vec::new(),
            fallen: Vec::new(),
            iterations: 0,
            broken: None,
        };
        watch.begin = watch.displacement(history);
        let start = watch.point(&History { factor: 0.0, ..history.clone() }, 0.0);
        watch.curve.push(start);
        Ok(watch)
    }

    fn displacement(&self, history: &History) -> f64 {
        self.row.iter().map(|&(n, c, w)| w * history.x[3 * n as usize + usize::from(c)]).sum()
    }

    fn point(&self, history: &History, residual: f64) -> CurvePoint {
        let load_factor = self.base + history.factor;
        // What the nodes that are loaded or moved take, each along its load.
        let taken: f64 = self
            .row
            .chunk_by(|a, b| a.0 == b.0)
            .map(|node| {
                let size = node.iter().map(|(.., w)| w * w).sum::<f64>().sqrt();
                let force = |&(n, c, w): &(u32, u8, f64)| {
                    w * history.force[3 * n as usize + usize::from(c)]
                };
                node.iter().map(force).sum::<f64>() / size
            })
            .sum();
        CurvePoint {
            displacement_m: self.displacement(history) - self.begin,
            load_factor,
            load_n: if self.forces > 0.0 { load_factor * self.forces } else { taken },
            residual,
        }
    }

    /// By what the load of a point is judged: its factor, or where displacements are prescribed,
    /// whose factor only grows, what these take, N.
    fn bears(&self, point: &CurvePoint) -> f64 {
        if self.forces > 0.0 { point.load_factor } else { point.load_n }
    }

    /// Whether the load of a point has fallen below a share of the peak, both counted from where
    /// loads began to be raised.
    fn has_fallen(&self, point: &CurvePoint, share: f64) -> bool {
        let risen = |p: &CurvePoint| self.bears(p) - self.bears(&self.curve[0]);
        risen(point) < share * risen(&self.curve[self.peak])
    }

    /// Whether what falls when it cracks may rise again: bars wait to yield, and concrete is whole.
    fn waits(&self) -> bool {
        let is_whole = || self.crushed() == 0.0 && self.pressed() < PRESSED;
        self.yielding.is_none() && !self.structure.model.steel.is_empty() && is_whole()
    }

    /// Share of the work up to the peak that may be spent beyond it, and work that always may.
    fn patience(&self) -> [f64; 2] {
        match self.raised.to {
            Reach::Peak if !self.waits() => PEAK_WORK,
            Reach::Mode if !self.waits() && self.has_told() => MODE_WORK,
            _ => work(self.structure.unknowns()),
        }
    }

    /// Share of the slab across the member that was pressed most beyond what its curve rises to, at
    /// the peak.
    fn pressed(&self) -> f64 {
        let mesh = &self.structure.model.mesh;
        let along = |hex: usize| mesh.centre(hex as u32).dot(self.prepared.direction);
        let places: Vec<f64> = (0..self.at_peak.len()).map(along).collect();
        let from = places.iter().copied().fold(f64::INFINITY, f64::min);
        let to = places.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mut sums = [[0.0; 2]; SLABS];
        for (hex, points) in self.at_peak.iter().enumerate() {
            let share = (places[hex] - from) / (to - from).max(1e-300);
            let slab = &mut sums[((SLABS as f64 * share) as usize).min(SLABS - 1)];
            let [such, whole] = volumes(self.structure, hex, points, |past| past > 0.0);
            *slab = [slab[0] + such, slab[1] + whole];
        }
        sums.into_iter().map(|[such, whole]| such / whole.max(1e-300)).fold(0.0, f64::max)
    }

    /// Whether its load has not risen for some steps: what falls when it cracks rises again where
    /// bars take over.
    fn is_falling(&self) -> bool {
        let last = self.curve.len().saturating_sub(FALLING + 1);
        self.curve.len() > FALLING
            && self.curve[last..].windows(2).all(|w| self.bears(&w[1]) <= self.bears(&w[0]))
    }

    fn see(&mut self, history: &History, step: &Step, points: &[[Point; 8]]) {
        let point = self.point(history, step.residual);
        self.curve.push(point);
        self.iterations = step.iterations;
        tracing::debug!(
            "{:.3} of the loads: {} iterations, {} of the linear solver, avalanche {}",
            point.load_factor,
            step.iterations,
            step.linear,
            step.avalanche
        );
        if self.bears(&point) > self.bears(&self.curve[self.peak]) || self.at_peak.is_empty() {
            self.peak = self.curve.len() - 1;
            self.at_peak = points.to_vec();
            self.history_at_peak = Some(history.clone());
            self.fallen.clear();
        }
        self.last = points.to_vec();
        if self.fallen.is_empty() && self.has_fallen(&point, FALLS) {
            self.fallen = points.to_vec();
        }
        for (steel, works) in self.structure.model.steel.iter().zip(&history.steel) {
            let is_along = !is_stirrup(&steel.name);
            let (bar, tendon) = match &steel.kind {
                SteelKind::Bar(bar) | SteelKind::Stressed(bar, _) => (Some(bar), None),
                SteelKind::Tendon(tendon) => (None, Some(tendon)),
            };
            for work in works {
                if is_along && bar.is_some() && self.yielding.is_none() && work.bar.plastic > 1e-5 {
                    self.yielding = Some((point, steel.name.clone()));
                }
                // A bar that is pressed so far does not break.
                if bar.is_some_and(|bar| work.bar.plastic > bar.rupture) {
                    self.broken.get_or_insert((Mode::BarRupture, steel.name.clone()));
                }
                if tendon.is_some_and(|t| work.stress >= t.strand.strength) {
                    self.broken.get_or_insert((Mode::PrestressRupture, steel.name.clone()));
                }
            }
        }
    }

    /// Whether something has happened already that tells how it fails.
    fn has_told(&self) -> bool {
        self.yielding.is_some() || self.curve.last().is_some_and(|now| self.has_fallen(now, FALLS))
    }

    /// Why it need not be followed any further.
    fn is_spent(&self, length: f64) -> Option<String> {
        let (now, peak) = (self.curve[self.curve.len() - 1], self.curve[self.peak]);
        let moved = now.displacement_m.abs();
        if let Some((mode, name)) = &self.broken {
            return Some(format!("{}: {name}", mode.words()));
        }
        let waits = self.waits();
        let (spent, ductile) = match self.raised.to {
            Reach::Peak => (if waits { SPENT } else { PASSED }, DUCTILE[1]),
            Reach::Mode => (SPENT, DUCTILE[1]),
            Reach::Failure => (SPENT, DUCTILE[0]),
        };
        let is_far = moved > BEYOND * peak.displacement_m.abs();
        if self.has_fallen(&now, spent) && self.is_falling() && (is_far || !waits) {
            return Some(format!("the load has fallen below {spent} of its peak"));
        }
        let has_turned = self.bears(&now) < PASSED * self.bears(&peak);
        if is_far && has_turned && self.yielding.is_none() && !waits {
            return Some(format!("it has moved {BEYOND} times as far as at its peak"));
        }
        if let Along::Displacement(Some(to)) = self.raised.along
            && moved >= to * (1.0 - 1e-9)
        {
            return Some(format!("it has moved by the {:.1} mm asked for", 1e3 * to));
        }
        if let Some((at, _)) = &self.yielding
            && moved > ductile * at.displacement_m.abs()
        {
            return Some(format!("it has moved {ductile} times as far as where bars yield first"));
        }
        (moved > FAR * length).then(|| "it has moved by a tenth of its length".into())
    }

    /// How far the next step goes.
    fn next(&self, step: f64, length: f64, stiffness: &mut Option<f64>) -> f64 {
        let [before, now] = [self.curve[self.curve.len() - 2], self.curve[self.curve.len() - 1]];
        let slope = (self.bears(&now) - self.bears(&before))
            / (now.displacement_m - before.displacement_m).abs().max(1e-300);
        let moved = now.displacement_m.abs();
        let is_early = moved < EARLY * length;
        if is_early {
            *stiffness = Some(slope);
        }
        let first = *stiffness.get_or_insert(slope);
        // Near a peak steps are short, so that it is seen; where bars yield nothing is left to see.
        let is_easy = self.iterations <= EASY;
        let grows = is_early || slope > SOFT * first || (is_easy && self.yielding.is_some());
        let longer = if grows || is_easy { GROWTH * step } else { step };
        let next = if grows { longer } else { longer.min(SHORT * moved) };
        let most = match self.raised.along {
            Along::Displacement(Some(to)) => (to - moved).max(0.0),
            _ => f64::INFINITY,
        };
        if is_early {
            return next.min(most);
        }
        next.max(0.5 * SHORT * moved).min(2.5 * SHORT * moved.max(step)).min(most)
    }

    /// What it comes to.
    fn tell(self, mut ended: String, mut stopped: bool, job: &Job) -> Result<Strength, Failure> {
        let peak = self.curve[self.peak];
        let after = &self.curve[self.peak..];
        // Where steel breaks it is followed no further.
        let breaks = self.broken.as_ref().filter(|(_, name)| !is_stirrup(name));
        let fallen = after.iter().find(|p| self.has_fallen(p, FAILED));
        let ultimate = fallen.or(breaks.and(after.last())).copied();
        let yielding = self.yielding.as_ref().map(|y| y.0);
        let ductility = ultimate
            .zip(yielding)
            .map(|(u, y)| u.displacement_m / y.displacement_m)
            .filter(|d| *d >= 1.0);
        let has_failed = after.iter().any(|p| self.has_fallen(p, FALLS));
        let (mode, mut because) = match self.mode(has_failed, job) {
            // A bar that has yielded tells of no failure yet.
            Ok(_) if stopped && !has_failed => (Mode::None, "its load has not fallen".into()),
            Err(why) if why.is_cancelled() => {
                stopped = true;
                (Mode::None, "what made its load fall is not known".into())
            }
            told => told?,
        };
        if stopped {
            ended = "it was stopped".into();
        }
        if mode == Mode::None {
            because = format!("{because}; {ended}");
        }
        Ok(Strength {
            loads: self
                .raised
                .loads
                .iter()
                .map(|&l| self.structure.model.loads[l].name.clone())
                .collect(),
            peak,
            yielding,
            ultimate,
            ductility,
            mode,
            because,
            ended,
            mirrored: !self.prepared.mirrored.is_empty(),
            stopped,
            curve: self.curve,
        })
    }

    /// By what it fails, from what happened where.
    fn mode(&self, has_failed: bool, job: &Job) -> Result<(Mode, String), Failure> {
        let peak = self.curve[self.peak];
        let at =
            |p: &CurvePoint| format!("{:.0} kN, {:.1} mm", 1e-3 * p.load_n, 1e3 * p.displacement_m);
        let broken = self.broken.as_ref();
        let has_failed = has_failed || broken.is_some();
        // A peak may be that of the last crack, and bars yield right after it.
        let is_before =
            |y: &CurvePoint| y.displacement_m <= peak.displacement_m || !self.has_fallen(y, FALLS);
        let yielded = self.yielding.as_ref().filter(|(y, _)| is_before(y));
        match (broken.filter(|(_, name)| !is_stirrup(name)), yielded) {
            // Its grade tells the least strain at which a bar breaks; what yielded before has failed.
            (Some((Mode::BarRupture, name)), Some((y, first))) => {
                return Ok((
                    Mode::Yielding,
                    format!("{first} yields at {}, then {name} breaks", at(y)),
                ));
            }
            (Some((mode, name)), _) => return Ok((*mode, format!("{name} breaks"))),
            (None, _) => {}
        }
        let after =
            yielded.map_or(String::new(), |(y, name)| format!("; {name} yields at {}", at(y)));
        let opened = self.opened();
        let crushed = self.crushed();
        let oblique = opened[1] > 0.5 * opened.iter().sum::<f64>() && opened[1] > 0.0;
        // A fall that a diagonal crack brings is one even after bars have yielded.
        if has_failed && oblique {
            let mode = if crushed > 0.0 { Mode::ShearCompression } else { Mode::DiagonalTension };
            let crushes = if crushed > 0.0 { ", and concrete is crushed" } else { "" };
            return Ok((
                mode,
                format!(
                    "past the peak {:.0} % of what opens are cracks oblique to the axis{crushes}{after}",
                    100.0 * opened[1] / opened.iter().sum::<f64>()
                ),
            ));
        }
        if let Some((y, name)) = yielded {
            let crushes = if crushed > 0.0 { ", then concrete is crushed" } else { "" };
            return Ok((Mode::Yielding, format!("{name} yields at {}{crushes}", at(y))));
        }
        if let Some(history) = &self.history_at_peak
            && has_failed
        {
            let equations = &mut Equations::new(self.structure, &MarchSettings::of_deck());
            let near =
                self.structure.nearness_to_buckling(history, &self.at_peak, equations, job)?;
            if let Some(share) = near.filter(|share| *share > BUCKLES) {
                return Ok((
                    Mode::Buckling,
                    format!(
                        "at the peak its loads are {share:.2} of those under which it buckles while it is elastic"
                    ),
                ));
            }
        }
        if crushed > 0.0 {
            return Ok((
                Mode::Crushing,
                format!(
                    "{:.1} % of its concrete is crushed, no bar yields in tension",
                    100.0 * crushed
                ),
            ));
        }
        // Pressed evenly, all of it crushes at once, and no equilibrium is found after that.
        let spent = self.pressed();
        if spent > PRESSED {
            return Ok((
                Mode::Crushing,
                format!("{:.0} % of a section is pressed as hard as it can be", 100.0 * spent),
            ));
        }
        if has_failed && self.slipped() {
            return Ok((Mode::Anchorage, "bars slip from the concrete".into()));
        }
        if has_failed {
            return Ok((Mode::Tearing, "cracks open that no steel holds".into()));
        }
        Ok((Mode::None, "its load has not fallen, and no bar has yielded".into()))
    }

    /// What is to be seen while it fails.
    fn failing(&self) -> &[[Point; 8]] {
        if self.fallen.is_empty() { &self.last } else { &self.fallen }
    }

    /// Σ opening × area of cracks across the axis, oblique and along it that has come from the peak
    /// to its first fall, m³. What is crushed swells every way, which tells of no crack.
    fn opened(&self) -> [f64; 3] {
        let along = self.prepared.direction;
        let mut sums = [0.0; 3];
        for (hex, (before, now)) in self.at_peak.iter().zip(self.failing()).enumerate() {
            let area = (self.structure.model.mesh.hex_volume(hex as u32) / 8.0).powf(2.0 / 3.0);
            let whole = |point: &Point| point.crushing() <= CRUSHED;
            for (before, now) in before.iter().zip(now).filter(|(_, now)| whole(now)) {
                let cosine = glam::DVec3::from_array(now.normal).dot(along).abs().min(1.0);
                let off = cosine.acos().to_degrees();
                let class = usize::from(off > OBLIQUE[0]) + usize::from(off > OBLIQUE[1]);
                sums[class] += area * (now.crack - before.crack).max(0.0);
            }
        }
        sums
    }

    /// Share of the volume that is crushed at the end.
    fn crushed(&self) -> f64 {
        let bricks = self.last.iter().enumerate();
        let [such, whole] = bricks
            .map(|(hex, points)| volumes(self.structure, hex, points, |past| past > CRUSHED))
            .fold([0.0, 0.0], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
        such / f64::max(whole, 1e-300)
    }

    /// Whether a free end of a bar has slipped beyond what bond bears most at.
    fn slipped(&self) -> bool {
        let Some(history) = &self.history_at_peak else { return false };
        self.structure.model.steel.iter().enumerate().any(|(bar, steel)| {
            let Some(slipping) = &steel.bond else { return false };
            [0, steel.pieces.len()].into_iter().any(|end| {
                let node = self.structure.slip_node(bar, end);
                node.is_some_and(|n| history.x[3 * n as usize].abs() > slipping.bond.slips[0])
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A beam of 161 100 unknowns was given up at its first cracks, 9 kN, since that step took as
    /// much work as all the easy ones before.
    #[test]
    fn fine_meshes_may_take_as_many_iterations_as_coarse_ones() {
        let iterations = |unknowns: usize| work(unknowns)[1] / unknowns as f64;
        assert!(iterations(1620) > 3e4 && iterations(3780) > 1.3e4);
        assert!((iterations(161_100) - iterations(15_000)).abs() < 1e-6);
    }
}
