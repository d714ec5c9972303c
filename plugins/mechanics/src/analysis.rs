//! A member through its life: what is kept of every equilibrium, and written of it.

use std::{
    borrow::Cow,
    path::{Path, PathBuf},
};

use glam::DVec3;
use intrados_scene::MemberKind;
use intrados_stage::{Cancelled, Job, file::WriteError, time::DAY};
use serde::{Deserialize, Serialize};

use crate::{
    element::hex8,
    limits::Limits,
    member::{Part, Prepared, UP_TO_SYMMETRY},
    model::{
        CONDUCTED, Drive, Failure, History, March, MarchSettings, Point, Steel, SteelKind, Step,
        System, past_peak,
    },
    strength::{self, CurvePoint, Strength},
    tensor::{Principal, Voigt, rotate_stress},
    write::{self, Curve, Field, Grid, Series, noted_csv},
};

pub(crate) use crate::limits::Stability;

/// What became of a member.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Outcome {
    /// Id of the parametric member.
    pub id: String,
    /// Unknowns.
    pub dof: usize,
    /// Bricks, pieces of steel and joints.
    pub elements: usize,
    /// Every equilibrium, the last entry possibly one that was not found.
    pub steps: Vec<Moment>,
    /// Its members.
    pub members: Vec<MemberOutcome>,
    /// What its gauges read at the end.
    pub gauges: Vec<GaugeOutcome>,
    /// Iterations of linear solvers, in all.
    pub iterations: usize,
    /// What solved its linear systems, by name.
    #[serde(default)]
    pub solver: String,
    /// What a crack leaves and what gives it its width; none where nothing can crack.
    pub cracks: Option<String>,
    /// What was asked for.
    pub tolerance: f64,
    /// Why it ended early; empty if it did not.
    pub complaint: String,
    /// Whether somebody stopped it: then it is not all of it.
    #[serde(default)]
    pub stopped: bool,
    /// How near its loads came to buckling; none: nothing is pressed, or nobody could tell.
    pub stability: Option<Stability>,
    /// What it bears, where loads are raised after its life.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strength: Option<Strength>,
    /// What a user must know before believing any of it.
    pub warnings: Vec<String>,
    /// What a user should know.
    pub notes: Vec<String>,
}

/// One moment of its life.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Moment {
    /// s.
    pub time_s: f64,
    /// Largest factor of a load.
    pub load_factor: f64,
    /// m.
    pub max_displacement_m: f64,
    /// What is out of balance, over all that acts.
    pub residual: f64,
    /// Whether that is within the tolerance.
    pub converged: bool,
}

/// One member: extremes over its whole life.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MemberOutcome {
    /// Id.
    pub name: String,
    /// What it is.
    pub kind: MemberKind,
    /// Largest principal stress, Pa.
    pub peak_tension_pa: f64,
    /// Smallest principal stress, Pa.
    pub peak_compression_pa: f64,
    /// Largest damage of tension or compression past its peak.
    pub max_damage: f64,
    /// Share of the volume that has damage above .5.
    pub damaged_volume_fraction: f64,
    /// Widest crack, m.
    pub max_crack_width_m: f64,
    /// Largest stress in a bar or stirrup, Pa, either sign.
    pub peak_bar_stress_pa: f64,
    /// Whether its concrete had to be assumed.
    pub concrete_assumed: bool,
    /// Of an imported member: how far its cubes are from its surface.
    pub geometry: Option<Geometry>,
    /// What rust has taken from its bars; none: nothing attacks them.
    pub corrosion: Option<Corrosion>,
    /// Its tendons.
    pub tendons: Vec<TendonOutcome>,
    /// The steel pipe inside of it; none: it has none.
    #[serde(default)]
    pub pipe: Option<PipeOutcome>,
}

/// The steel pipe of a lining: largest stress of either sign in the middle of its wall.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PipeOutcome {
    /// Around, Pa.
    pub around_pa: f64,
    /// Along, Pa.
    pub along_pa: f64,
    /// Mean around at the end, Pa: times thickness over radius the share of the inner pressure that
    /// it bears.
    pub final_around_pa: f64,
    /// Mean along at the end, Pa.
    pub final_along_pa: f64,
}

/// How well the cubes of an imported member agree with its surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Geometry {
    /// Enclosed by the surface, m³.
    pub surface_volume_m3: f64,
    /// Of the cubes, m³.
    pub voxel_volume_m3: f64,
    /// Of bodies that were left out because they do not hang together with the largest, m³.
    pub dropped_volume_m3: f64,
    /// Largest distance of the cubes' outer faces from the surface, m.
    pub largest_distance_m: f64,
    /// Their mean distance, m.
    pub mean_distance_m: f64,
    /// Share of the surface that has no cube nearby.
    pub missed_area_fraction: f64,
}

/// What rust has taken.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Corrosion {
    /// When the first bar begins to rust, s; none: not within its life.
    pub begins_s: Option<f64>,
    /// Largest share of a bar's section that is lost at the end.
    pub max_section_loss: f64,
    /// Share of the volume of all bars that is lost at the end.
    pub lost_fraction: f64,
}

/// One tendon.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TendonOutcome {
    /// Name.
    pub name: String,
    /// Largest stress, Pa.
    pub peak_stress_pa: f64,
    /// Mean stress at the end, Pa.
    pub final_stress_pa: f64,
    /// Mean losses, Pa.
    pub losses: Losses,
}

/// What a tendon has lost since it was jacked, means along it, Pa.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Losses {
    /// Friction and slip at the anchors.
    pub friction_and_slip_pa: f64,
    /// Relaxation.
    pub relaxation_pa: f64,
    /// Concrete that has shortened: elastic, creep, shrinkage (negative: it was stretched).
    pub concrete_pa: f64,
}

/// One gauge.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GaugeOutcome {
    /// Name.
    pub name: String,
    /// At the end of the history, SI.
    pub value: f64,
    /// Its unit.
    pub unit: Cow<'static, str>,
}

/// Whoever wants to see every equilibrium.
pub trait Observer {
    /// One was found.
    ///
    /// # Errors
    /// What stops the analysis.
    fn see(
        &mut self,
        structure: &System,
        history: &History,
        step: &Step,
        points: &[[Point; 8]],
    ) -> Result<(), Failure>;
}

/// Nobody looks.
impl Observer for () {
    fn see(&mut self, _: &System, _: &History, _: &Step, _: &[[Point; 8]]) -> Result<(), Failure> {
        Ok(())
    }
}

/// Damage from which a volume counts as damaged.
const DAMAGED: f64 = 0.5;

/// Computes a member's life.
///
/// # Errors
/// [`Failure`], but for steps that do not converge: they end the outcome, which says so.
pub fn analyze(
    prepared: &Prepared,
    settings: MarchSettings,
    job: &Job,
    observer: &mut impl Observer,
) -> Result<(Outcome, History), Failure> {
    let found = analyze_until_stopped(prepared, settings, job, observer)?;
    if found.0.stopped { Err(Cancelled.into()) } else { Ok(found) }
}

/// The same, but where the job is cancelled, what there is until then: [`Outcome::stopped`].
///
/// # Errors
/// As of [`analyze`]; [`Failure::Cancelled`] before the first equilibrium.
pub fn analyze_until_stopped(
    prepared: &Prepared,
    settings: MarchSettings,
    job: &Job,
    observer: &mut impl Observer,
) -> Result<(Outcome, History), Failure> {
    let model = &prepared.model;
    let structure = System::new(model)?;
    let pieces: usize = model.steel.iter().map(|s| s.pieces.len()).sum();
    let mut outcome = Outcome {
        id: prepared.id.clone(),
        dof: structure.unknowns(),
        elements: model.mesh.hexes.len()
            + pieces
            + model.mesh.interfaces.len()
            + model.mesh.shells.len()
            + model.mesh.rods.len(),
        steps: Vec::new(),
        members: prepared.parts.iter().map(MemberOutcome::new).collect(),
        gauges: Vec::new(),
        iterations: 0,
        solver: String::new(),
        cracks: model.cracking(),
        tolerance: settings.tolerance,
        complaint: String::new(),
        stopped: false,
        stability: None,
        strength: None,
        warnings: prepared.warnings.clone(),
        notes: prepared.notes.clone(),
    };
    let mut march = March::new(&structure, structure.rest(prepared.begin), Drive::Loads, settings);
    let (mut steel, mut limits) = (SteelPeaks::new(prepared), Limits::new(&structure));
    let last = prepared.times.last().copied().unwrap_or(prepared.begin);
    // A first moment at the beginning is a step of no duration: what is there takes its loads.
    for (i, &time) in prepared.times.iter().enumerate() {
        let result = loop {
            let goes_on = job.step(i, prepared.times.len()).map_err(Failure::from);
            let result = goes_on.and_then(|()| {
                march.advance_with(time, 0.0, job, |history, step, equations| {
                    let (points, is_last) = (structure.all_points(history)?, step.time >= last);
                    limits.see(&structure, history, step, &points, is_last, equations, job)?;
                    outcome.take(prepared, history, step, &points);
                    steel.take(&structure, history)?;
                    observer.see(&structure, history, step, &points)
                })
            });
            if result.is_err() || march.history.turned || !limits.needs_second_order() {
                break result;
            }
            // From here on, and at this moment already.
            march.history.turned = true;
        };
        match result {
            Ok(()) => {}
            Err(why) if why.is_cancelled() && !outcome.steps.is_empty() => {
                outcome.stop(&format!("on day {:.0} of its life", march.history.time / DAY));
                break;
            }
            Err(Failure::Beyond(why)) => {
                outcome.end(
                    prepared,
                    why,
                    march.history.time,
                    displacement(prepared, &march.history),
                );
                break;
            }
            Err(why @ Failure::Laborious) => {
                let history = &march.history;
                let moved = displacement(prepared, history);
                outcome.end(prepared, why.to_string(), history.time, moved);
                break;
            }
            // What has never been in equilibrium is held or loaded wrongly; what was, has failed.
            Err(why @ (Failure::NotConverged { .. } | Failure::Solve(_)))
                if !outcome.steps.is_empty() =>
            {
                let before = outcome.steps.last().map_or(0.0, |s| s.max_displacement_m);
                outcome.end(prepared, why.to_string(), time, before);
                break;
            }
            Err(other) => return Err(other),
        }
    }
    outcome.stability = limits.nearest;
    outcome.solver = march.solved_by();
    if march.fell_back() {
        outcome
            .warnings
            .push("multigrid did not converge: its systems were factorised instead".into());
    }
    // Its matrix and its factor go before others are made.
    let mut history = march.into_history();
    if let Some(raised) = prepared.raised.as_ref().filter(|_| outcome.complaint.is_empty()) {
        let each = |history: &History, step: &Step, points: &[[Point; 8]]| {
            observer.see(&structure, history, step, points)
        };
        let settings = strength::settings(settings);
        let (found, end) =
            strength::raise(&structure, prepared, raised, history, settings, job, each)?;
        if found.stopped {
            outcome.stop("while its loads were raised");
        }
        (outcome.strength, history) = (Some(found), end);
    }
    let (warnings, notes) = limits.told();
    outcome.warnings.extend(warnings);
    outcome.notes.extend(notes);
    steel.tell(prepared, &history, &mut outcome);
    let readings =
        structure.read(&prepared.gauges.iter().map(|g| g.1).collect::<Vec<_>>(), &history)?;
    outcome.gauges = prepared
        .gauges
        .iter()
        .zip(readings)
        .map(|((name, gauge), value)| GaugeOutcome {
            name: name.clone(),
            value,
            unit: gauge.unit().into(),
        })
        .collect();
    Ok((outcome, history))
}

/// The largest, m.
fn displacement(prepared: &Prepared, history: &History) -> f64 {
    let nodes = prepared.model.mesh.nodes.len();
    history
        .x
        .as_chunks::<3>()
        .0
        .iter()
        .take(nodes)
        .map(|&u| DVec3::from_array(u).length())
        .fold(0.0, f64::max)
}

fn factor(prepared: &Prepared, time: f64) -> f64 {
    prepared
        .model
        .loads
        .iter()
        .filter(|l| l.name != CONDUCTED)
        .map(|l| l.factor(time))
        .fold(0.0, f64::max)
}

impl MemberOutcome {
    fn new(part: &Part) -> Self {
        Self {
            name: part.id.clone(),
            kind: part.kind,
            peak_tension_pa: 0.0,
            peak_compression_pa: 0.0,
            max_damage: 0.0,
            damaged_volume_fraction: 0.0,
            max_crack_width_m: 0.0,
            peak_bar_stress_pa: 0.0,
            concrete_assumed: part.assumed,
            geometry: part.geometry.map(|e| Geometry {
                surface_volume_m3: e.surface_volume,
                voxel_volume_m3: e.voxel_volume,
                dropped_volume_m3: e.dropped_volume,
                largest_distance_m: e.largest_distance,
                mean_distance_m: e.mean_distance,
                missed_area_fraction: e.missed_area,
            }),
            corrosion: None,
            tendons: Vec::new(),
            pipe: None,
        }
    }
}

impl Outcome {
    fn stop(&mut self, when: &str) {
        self.stopped = true;
        self.complaint = format!("it was stopped {when}");
    }

    /// Its last entry is one that is no equilibrium.
    fn end(&mut self, prepared: &Prepared, why: String, time: f64, displacement: f64) {
        self.complaint = why;
        let load_factor = factor(prepared, time);
        self.steps.push(Moment {
            time_s: time,
            load_factor,
            max_displacement_m: displacement,
            residual: f64::NAN,
            converged: false,
        });
    }

    fn take(&mut self, prepared: &Prepared, history: &History, step: &Step, points: &[[Point; 8]]) {
        self.iterations += step.linear;
        let converged = step.residual <= self.tolerance;
        self.steps.push(Moment {
            time_s: step.time,
            load_factor: factor(prepared, step.time),
            max_displacement_m: displacement(prepared, history),
            residual: step.residual,
            converged,
        });
        for (part, member) in prepared.parts.iter().zip(&mut self.members) {
            let (mut damaged, mut whole) = (0.0, 0.0);
            for &hex in &part.hexes {
                let volume = prepared.model.mesh.hex_volume(hex);
                for point in &points[hex as usize] {
                    let principal = Principal::of_stress(&point.stress).values;
                    member.peak_tension_pa = member.peak_tension_pa.max(principal[0]);
                    member.peak_compression_pa = member.peak_compression_pa.min(principal[2]);
                    member.max_crack_width_m = member.max_crack_width_m.max(point.crack);
                    let damage = past_peak(point.damage);
                    member.max_damage = member.max_damage.max(damage);
                    damaged += if damage > DAMAGED { volume / 8.0 } else { 0.0 };
                }
                whole += volume;
            }
            member.damaged_volume_fraction =
                member.damaged_volume_fraction.max(damaged / f64::max(whole, 1e-300));
        }
    }
}

impl PipeOutcome {
    fn take(&mut self, structure: &System, axis: DVec3, history: &History) -> Result<(), Failure> {
        let count = structure.model.mesh.shells.len();
        let mut sum = [0.0; 2];
        for shell in 0..count {
            let [around, along] = structure.wall_stress(shell, axis, history)?;
            let largest = |kept: &mut f64, new: f64| {
                if new.abs() > kept.abs() {
                    *kept = new;
                }
            };
            largest(&mut self.around_pa, around);
            largest(&mut self.along_pa, along);
            sum = [sum[0] + around, sum[1] + along];
        }
        [self.final_around_pa, self.final_along_pa] = sum.map(|s| s / count.max(1) as f64);
        Ok(())
    }
}

/// Extremes of steel.
struct SteelPeaks {
    peaks: Vec<f64>,
    /// Of bars between nodes of the mesh.
    rods: f64,
    /// Axis of the pipe, and its stresses.
    pipe: Option<(DVec3, PipeOutcome)>,
}

impl SteelPeaks {
    fn new(prepared: &Prepared) -> Self {
        let has_pipe = !prepared.model.mesh.shells.is_empty();
        let axis = prepared.axis.filter(|_| has_pipe).map(|[_, axis]| axis);
        let pipe = axis.map(|axis| (axis, PipeOutcome::default()));
        Self { peaks: vec![0.0; prepared.model.steel.len()], rods: 0.0, pipe }
    }

    fn take(&mut self, structure: &System, history: &History) -> Result<(), Failure> {
        for (peak, works) in self.peaks.iter_mut().zip(&history.steel) {
            *peak = works.iter().fold(*peak, |m, w| m.max(w.stress.abs()));
        }
        for rod in 0..structure.model.mesh.rods.len() {
            self.rods = self.rods.max(structure.bar_stress(rod, history)?.abs());
        }
        if let Some((axis, pipe)) = &mut self.pipe {
            pipe.take(structure, *axis, history)?;
        }
        Ok(())
    }

    fn tell(&self, prepared: &Prepared, history: &History, outcome: &mut Outcome) {
        let Some(first) = prepared.parts.iter().position(|p| p.has_steel) else { return };
        if let Some(member) = outcome.members.get_mut(first) {
            member.peak_bar_stress_pa = self.rods;
            member.pipe = self.pipe.map(|(_, pipe)| pipe);
        }
        let model = &prepared.model;
        let owners = owners(prepared, first);
        for (part, member) in outcome.members.iter_mut().enumerate() {
            let own = model.steel.iter().zip(&owners).filter(|(_, owner)| **owner == part);
            member.corrosion = corrosion(own.map(|(steel, _)| steel), history.time);
        }
        for (((steel, &peak), works), &owner) in
            model.steel.iter().zip(&self.peaks).zip(&history.steel).zip(&owners)
        {
            let Some(member) = outcome.members.get_mut(owner) else { continue };
            let SteelKind::Tendon(tendon) = &steel.kind else {
                member.peak_bar_stress_pa = member.peak_bar_stress_pa.max(peak);
                continue;
            };
            let length: f64 = steel.pieces.iter().map(|p| p.length()).sum();
            let mean = |value: &dyn Fn(usize) -> f64| {
                steel.pieces.iter().enumerate().map(|(i, p)| p.length() * value(i)).sum::<f64>()
                    / length
            };
            let [locked, relaxed, last] = [
                mean(&|i| tendon.stress[i]),
                mean(&|i| works[i].relaxed),
                mean(&|i| works[i].stress),
            ];
            let stressed = works.iter().all(|w| !w.locked.is_nan());
            let losses = if stressed {
                Losses {
                    friction_and_slip_pa: tendon.jacking - locked,
                    relaxation_pa: relaxed,
                    concrete_pa: locked - relaxed - last,
                }
            } else {
                Losses::default()
            };
            member.tendons.push(TendonOutcome {
                name: steel.name.clone(),
                peak_stress_pa: peak,
                final_stress_pa: last,
                losses,
            });
        }
    }
}

/// The part that each steel lies in: the `first` that has steel, but for what lies in another such.
fn owners(prepared: &Prepared, first: usize) -> Vec<usize> {
    let mut part_of = vec![first; prepared.model.mesh.hexes.len()];
    for (part, own) in prepared.parts.iter().enumerate().filter(|(_, own)| own.has_steel) {
        own.hexes.iter().for_each(|&hex| part_of[hex as usize] = part);
    }
    let host = |steel: &Steel| steel.pieces.first().map_or(first, |piece| part_of[piece.host]);
    prepared.model.steel.iter().map(host).collect()
}

fn corrosion<'a>(steel: impl Iterator<Item = &'a Steel>, time: f64) -> Option<Corrosion> {
    let (mut begins, mut worst, mut lost, mut whole, mut any) =
        (f64::INFINITY, 0.0_f64, 0.0, 0.0, false);
    for bar in steel {
        let Some(rust) = &bar.rust else { continue };
        any = true;
        for (piece, &since) in bar.pieces.iter().zip(&rust.since) {
            let share = 1.0 - rust.left(since, time);
            begins = begins.min(since);
            worst = worst.max(share);
            lost += share * bar.area * piece.length();
            whole += bar.area * piece.length();
        }
    }
    let lost_fraction = lost / f64::max(whole, 1e-300);
    any.then(|| Corrosion {
        begins_s: (begins <= time).then_some(begins),
        max_section_loss: worst,
        lost_fraction,
    })
}

/// Writes every equilibrium as VTU, listed in a PVD, and a table of the steps.
pub struct Pictures {
    series: Series,
    count: usize,
    /// Files written.
    pub files: Vec<PathBuf>,
    /// Axis of r-θ-z stresses; none: no such stresses.
    axis: Option<[DVec3; 2]>,
    /// Hash of the scene, or of the deck.
    scene: String,
    error: Option<WriteError>,
}

impl Pictures {
    /// A series at `path` (`….pvd`), its files beside it, each with the hash of its scene.
    #[must_use]
    pub fn new(path: PathBuf, axis: Option<[DVec3; 2]>, scene: &str) -> Self {
        let (series, scene) = (Series::new(path.clone()), scene.to_owned());
        Self { series, count: 0, files: vec![path], axis, scene, error: None }
    }

    /// The first file that could not be written.
    ///
    /// # Errors
    /// That.
    pub fn finish(self) -> Result<Vec<PathBuf>, WriteError> {
        self.error.map_or(Ok(self.files), Err)
    }

    fn draw(
        &mut self,
        structure: &System,
        history: &History,
        step: &Step,
        points: &[[Point; 8]],
    ) -> Result<(), WriteError> {
        let mesh = &structure.model.mesh;
        let grid = Grid::solids(mesh).of_scene(&self.scene);
        let mean = |value: &dyn Fn(&Point) -> f64, hex: usize| {
            points[hex].iter().map(value).sum::<f64>() / 8.0
        };
        let rest = grid.cells() - mesh.hexes.len();
        let cell = |components: usize, values: &dyn Fn(usize, &mut Vec<f64>)| {
            let mut all = Vec::with_capacity(grid.cells() * components);
            (0..mesh.hexes.len()).for_each(|h| values(h, &mut all));
            all.resize(all.len() + rest * components, 0.0);
            all
        };
        let stress_of = |h: usize| -> Voigt { std::array::from_fn(|k| mean(&|p| p.stress[k], h)) };
        let stress = cell(6, &|h, all| all.extend(stress_of(h)));
        let largest = |value: &dyn Fn(&Point) -> f64| {
            cell(1, &|h, all| all.push(points[h].iter().map(value).fold(0.0, f64::max)))
        };
        let damage = largest(&|p| past_peak(p.damage));
        let crack = largest(&|p| p.crack);
        let alive =
            cell(1, &|h, all| all.push(f64::from(u8::from(structure.is_alive(h, history.time)))));
        let mut cells = vec![
            Field { name: "stress_pa", components: 6, values: &stress },
            Field { name: "damage", components: 1, values: &damage },
            Field { name: "crack_width_m", components: 1, values: &crack },
            Field { name: "alive", components: 1, values: &alive },
        ];
        let round = self.axis.map(|[origin, axis]| {
            cell(6, &|h, all| {
                let at = hex8::position(&mesh.corners(h as u32), DVec3::ZERO);
                all.extend(rotate_stress(
                    &stress_of(h),
                    &crate::tensor::cylindrical(at.to_array(), origin.to_array(), axis.to_array()),
                ));
            })
        });
        if let Some(values) = &round {
            cells.push(Field { name: "stress_rtz_pa", components: 6, values });
        }
        let file = self.series.place("", self.count);
        grid.write(
            &file,
            &[Field {
                name: "displacement_m",
                components: 3,
                values: &history.x[..3 * mesh.nodes.len()],
            }],
            &cells,
        )?;
        self.series.add(step.time, 0, &file)?;
        self.files.push(file);
        self.count += 1;
        Ok(())
    }
}

impl Observer for Pictures {
    fn see(
        &mut self,
        structure: &System,
        history: &History,
        step: &Step,
        points: &[[Point; 8]],
    ) -> Result<(), Failure> {
        if self.error.is_none() {
            self.error = self.draw(structure, history, step, points).err();
        }
        Ok(())
    }
}

impl Strength {
    /// Writes its curve as a table; where it was stopped or is that of a half, the last line says so.
    ///
    /// # Errors
    /// As [`write::csv`].
    pub fn write_curve(&self, path: &Path) -> Result<(), WriteError> {
        let row = |p: &CurvePoint| [p.displacement_m, p.load_factor, p.load_n, p.residual];
        let rows: Vec<[f64; 4]> = self.curve.iter().map(row).collect();
        let half = self.mirrored.then_some(UP_TO_SYMMETRY);
        let notes: Vec<&str> =
            half.into_iter().chain(self.stopped.then_some(self.ended.as_str())).collect();
        let columns = ["displacement_m", "load_factor", "load_n", "residual"];
        noted_csv(path, &columns, &rows, &notes.join("; "))
    }

    /// Draws its curve.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn plot_curve(&self, path: &Path, title: &str) -> Result<(), WriteError> {
        let points = |of: &[CurvePoint]| {
            of.iter().map(|p| (1e3 * p.displacement_m.abs(), 1e-3 * p.load_n)).collect()
        };
        let curve = |name: &str, of: &[CurvePoint], marked| Curve {
            name: name.into(),
            points: points(of),
            marked,
        };
        let mut curves = vec![curve("load", &self.curve, false)];
        curves.extend(self.yielding.map(|y| curve("a bar yields", &[y], true)));
        let (title, peak) = if self.stopped {
            (format!("{title}: {}", self.ended), "highest so far".to_owned())
        } else {
            (title.to_owned(), format!("peak: {}", self.mode.words()))
        };
        curves.push(curve(&peak, &[self.peak], true));
        let load = if self.mirrored { "load up to the plane of symmetry, kN" } else { "load, kN" };
        write::plot(path, &title, ["displacement of the loaded nodes, mm", load], &curves)
    }
}

impl Outcome {
    /// Writes the steps as a table; where they were stopped, the last line says so.
    ///
    /// # Errors
    /// As [`write::csv`].
    pub fn write_steps(&self, path: &Path) -> Result<(), WriteError> {
        let row = |s: &Moment| {
            [
                s.time_s,
                s.load_factor,
                s.max_displacement_m,
                s.residual,
                f64::from(u8::from(s.converged)),
            ]
        };
        let rows: Vec<[f64; 5]> = self.steps.iter().map(row).collect();
        let columns = ["time_s", "load_factor", "max_displacement_m", "residual", "converged"];
        noted_csv(path, &columns, &rows, if self.stopped { self.complaint.as_str() } else { "" })
    }
}
