//! Where small displacements end: what an equilibrium must not be believed beyond.

use glam::DVec3;
use intrados_stage::Job;
use intrados_stage::time::DAY;
use serde::{Deserialize, Serialize};

use crate::{
    model::{Equations, Failure, History, Point, Step, System},
    tensor::Principal,
};

/// Share of a model's longest measure that its parts may move against each other. Loading tests of
/// reinforced beams and columns end below a fiftieth of their length; at a twentieth sections have
/// turned by .05 to .1, and what was a member lies broken, whatever forces balance.
const LARGEST: f64 = 0.05;
/// Loads over those of buckling of the sound elastic member from which second order is computed.
/// EN 1992-1-1, 5.8.2 (6) lets it be left out where it adds less than a tenth; cracks and creep may
/// take three quarters of the stiffness.
const SECOND_ORDER: f64 = 0.025;
/// The same, from which a user is told where it is not computed.
const TOLD: f64 = 0.1;
/// Below this, loads may double before buckling is looked at anew.
const FAR: f64 = 0.03;
/// By so much compression grows between two looks from there on.
const NEXT: f64 = 1.1;

/// How near the loads came to buckling.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stability {
    /// Loads over those under which the structure buckles while it is elastic and without cracks.
    pub load_over_critical: f64,
    /// When, s.
    pub time_s: f64,
}

/// Watches equilibria for displacements and loads that a theory of small displacements cannot tell.
pub(crate) struct Limits {
    /// Longest measure of the model, m.
    length: f64,
    /// Whether all of it is elastic: then displacements are in proportion to loads, and what they
    /// are is the user's choice.
    elastic: bool,
    /// Compression (N m, see [`pressed`]) when buckling was last looked at, and the loads over the
    /// critical ones then.
    looked: [f64; 2],
    /// The nearest so far; none: nobody could tell.
    pub(crate) nearest: Option<Stability>,
    /// The largest displacement, over the length.
    pub(crate) moved: f64,
    /// Since when second order is computed, s.
    since: Option<f64>,
}

impl Limits {
    pub(crate) fn new(structure: &System) -> Self {
        Self {
            length: longest(structure),
            elastic: structure.model.is_elastic(),
            looked: [0.0; 2],
            nearest: None,
            moved: 0.0,
            since: None,
        }
    }

    /// Sees an equilibrium that was found with these equations.
    ///
    /// # Errors
    /// [`Failure::Beyond`]: the member has moved too far or has buckled; and whatever else fails.
    pub(crate) fn see(
        &mut self,
        structure: &System,
        history: &History,
        step: &Step,
        points: &[[Point; 8]],
        is_last: bool,
        equations: &mut Equations,
        job: &Job,
    ) -> Result<(), Failure> {
        self.moved = self.moved.max(spread(structure, history) / self.length);
        if self.moved > LARGEST && !self.elastic {
            let [found, most] = [self.moved * self.length, LARGEST * self.length];
            return Err(Failure::Beyond(format!(
                "its parts have moved {found:.2} m against each other on day {:.0}, more than a twentieth of its length ({most:.2} m): it has failed, or its \
                 loads or supports are not what is meant",
                step.time / DAY
            )));
        }
        let pressed = pressed(structure, points);
        let [before, share] = self.looked;
        let due = if share < FAR { 2.0 } else { NEXT };
        if pressed > 0.0 && (before == 0.0 || pressed > due * before || is_last) {
            self.look(structure, history, step, points, equations, job)?;
            self.looked = [pressed.max(before), self.nearest.map_or(0.0, |s| s.load_over_critical)];
        }
        Ok(())
    }

    fn look(
        &mut self,
        structure: &System,
        history: &History,
        step: &Step,
        points: &[[Point; 8]],
        equations: &mut Equations,
        job: &Job,
    ) -> Result<(), Failure> {
        let Some(now) = structure.nearness_to_buckling(history, points, equations, job)? else {
            return Ok(());
        };
        if self.nearest.is_none_or(|nearest| now > nearest.load_over_critical) {
            self.nearest = Some(Stability { load_over_critical: now, time_s: step.time });
        }
        if now >= 1.0 && !self.elastic {
            return Err(Failure::Beyond(format!(
                "it buckles before it bears all that on day {:.0}: its loads are {now:.2} times those under which it loses its stability even \
                 without cracks and creep: make it stiffer, shorter or hold it, or take loads off",
                step.time / DAY
            )));
        }
        Ok(())
    }

    /// Whether loads have come so near to buckling that second order counts. A deck of elastic
    /// bodies asks for a theory of small displacements, and gets it.
    pub(crate) fn needs_second_order(&mut self) -> bool {
        let near = self.nearest.filter(|s| s.load_over_critical > SECOND_ORDER && !self.elastic);
        self.since = self.since.or(near.map(|s| s.time_s));
        near.is_some()
    }

    /// Warnings, and what a user should know of it.
    pub(crate) fn told(&self) -> (Vec<String>, Vec<String>) {
        let (mut warnings, mut notes) = (Vec::new(), Vec::new());
        let [share, day] =
            self.nearest.map_or([0.0; 2], |s| [s.load_over_critical, s.time_s / DAY]);
        if let Some(since) = self.since {
            notes.push(format!(
                "its loads are up to {share:.2} of those under which it buckles (day {day:.0}): from day {:.0} on equilibrium is found where things \
                 have moved to (second order; bricks and the steel in them turn, joints and springs do not)",
                since / DAY
            ));
        } else if share >= 1.0 {
            warnings.push(format!(
                "its loads are {share:.2} times those under which it buckles (day {day:.0}): its displacements are those of a structure that cannot"
            ));
        } else if share > TOLD {
            warnings.push(format!(
                "its loads are {share:.2} of those under which it buckles (day {day:.0}): second order, which is not computed, makes deflections some \
                 {:.0} % larger (EN 1992-1-1, 5.8.2)",
                100.0 * share / (1.0 - share)
            ));
        }
        if self.moved > LARGEST && self.elastic {
            let share = 1.0 / self.moved;
            warnings.push(format!("its parts move by 1/{share:.1} of its length: displacements are computed as if they were small"));
        }
        (warnings, notes)
    }
}

/// Longest measure of a model, m.
pub(crate) fn longest(structure: &System) -> f64 {
    structure.model.mesh.bounds().map_or(0.0, |[low, high]| (high - low).max_element())
}

/// How far nodes are from where the whole has moved on average, at most, m: a footing that sinks
/// bends nothing.
fn spread(structure: &System, history: &History) -> f64 {
    let count = structure.model.mesh.nodes.len();
    let moved = || history.x.as_chunks::<3>().0.iter().take(count).map(|&u| DVec3::from_array(u));
    let mean = moved().sum::<DVec3>() / count.max(1) as f64;
    moved().map(|u| u.distance(mean)).fold(0.0, f64::max)
}

/// ∫ max(0, −σ₃) dV, N m: in proportion to the loads while the structure answers in proportion.
fn pressed(structure: &System, points: &[[Point; 8]]) -> f64 {
    let of_brick = |(hex, points): (usize, &[Point; 8])| {
        let volume = structure.model.mesh.hex_volume(hex as u32) / 8.0;
        points
            .iter()
            .map(|p| volume * (-Principal::of_stress(&p.stress).values[2]).max(0.0))
            .sum::<f64>()
    };
    points.iter().enumerate().map(of_brick).sum()
}
