//! What readings of gauges say of a member's zones.

use intrados_damage::{
    evidence::{Cause, Evidence},
    fusion::chi2_point,
    zone::Zones,
};
use intrados_mechanics::{
    frame::FrameError,
    member::{MemberError, Meshing},
    model::{Failure, System},
};
use intrados_scene::{Scene, structure::Reading};
use intrados_stage::{Cancelled, Estimate, Job};
use intrados_transport::Perturbed;
use serde::{Deserialize, Serialize};

use crate::{
    Simulation, grip,
    heard::{member_of, refusal},
    inverse::{self, Datum, Forward, invert},
    misfit::{self, ONCE_IN_A_THOUSAND},
    reduced::Reduced,
    rig::{FACES, Rig, TENTHS},
    simulate::simulate,
    unknown::{Unknown, unknowns},
};

/// How to invert.
pub type GaugeSettings = inverse::InverseSettings;

/// The source name of evidence from gauges.
pub const GAUGES: &str = "gauges";

/// Why gauges say nothing.
#[derive(Debug, thiserror::Error)]
pub enum GaugeError {
    /// The member cannot be computed.
    #[error(transparent)]
    Member(#[from] MemberError),
    /// What the rest of the structure does to it under a load test cannot be computed.
    #[error(transparent)]
    Whole(FrameError),
    /// Its equations cannot be solved.
    #[error("the response to a load test cannot be computed: {0}")]
    Solve(Failure),
    /// The reduced model is not positive definite.
    #[error("the member's stiffness is not positive: its supports let it move")]
    Broken,
    /// Somebody asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<FrameError> for GaugeError {
    fn from(error: FrameError) -> Self {
        match error {
            FrameError::Cancelled(cancelled) => Self::Cancelled(cancelled),
            other => Self::Whole(other),
        }
    }
}

impl From<Failure> for GaugeError {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Cancelled(cancelled) => Self::Cancelled(cancelled),
            other => Self::Solve(other),
        }
    }
}

/// What gauges say of a member.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FromGauges {
    /// Zones, a tenth of the axis × a quarter of the section each.
    pub zones: Vec<Zone>,
    /// Damage of the worst zone.
    pub worst: Estimate,
    /// Probability that anything is damaged.
    pub probability: f64,
    /// The hypotheses that explain the readings, most probable first.
    pub hypotheses: Vec<Explained>,
    /// The gauges' readings.
    pub readings: Vec<GaugeReading>,
    /// χ² of the most probable hypothesis, model error included.
    pub chi2: f64,
    /// How many readings there are.
    pub count: usize,
    /// Systems of equations that were solved.
    pub solutions: usize,
    /// What besides damage was not known exactly: before and after the readings.
    pub unknowns: Vec<Learnt>,
    /// Why it is no evidence, where no damage explains the readings: χ² beyond its 99.9 % point.
    pub refused: Option<String>,
    /// Whether the readings were made from the planted truth.
    pub simulated: bool,
    /// Readings of its gauges that could not be inverted: their numbers, and why.
    pub unused: Vec<(usize, String)>,
    /// What a user should know.
    pub notes: Vec<String>,
}

/// Something that was not known exactly, before and after the readings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Learnt {
    /// What is unknown, for people.
    pub what: String,
    /// Unit; `"1"`: a factor on what the scene says.
    pub unit: &'static str,
    /// What the scene says, and how far off it may be.
    pub assumed: Estimate,
    /// What the readings say.
    pub found: Estimate,
}

impl Learnt {
    /// `z`: mean and standard deviation, in those of the prior.
    fn new(rig: &Rig, (unknown, sd): (Unknown, f64), [z, spread]: [f64; 2]) -> Self {
        let factor = |z: f64, spread: f64| Estimate {
            value: (sd * z).exp(),
            std_error: (sd * z).exp() * sd * spread,
        };
        let times =
            |r: Estimate, by: f64| Estimate { value: by * r.value, std_error: by * r.std_error };
        let (before, after) = (factor(0.0, 1.0), factor(z, spread));
        let new = |what: String, unit, assumed, found| Self { what, unit, assumed, found };
        match unknown {
            Unknown::Modulus => {
                let gpa = 1e-9 * rig.modulus();
                new("modulus of the concrete".into(), "GPa", times(before, gpa), times(after, gpa))
            }
            Unknown::Load(test) => {
                new(format!("load of test {}", rig.tests[test]), "1", before, after)
            }
            Unknown::Springs(k) => new(
                format!("springs of {:.0}, {:.0}, {:.0} MPa/m", 1e-6 * k.x, 1e-6 * k.y, 1e-6 * k.z),
                "1",
                before,
                after,
            ),
            Unknown::Give => {
                let share =
                    |z: f64, spread: f64| Estimate { value: sd * z, std_error: sd * spread };
                new(
                    "energy in supports over that in the member".into(),
                    "1",
                    share(0.0, 1.0),
                    share(z, spread),
                )
            }
        }
    }
}

/// A tenth of the axis × a quarter of the section.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Zone {
    /// From, on the axis, 0 to 1.
    pub from: f64,
    /// To, on the axis, 0 to 1.
    pub to: f64,
    /// Side, degrees about the axis.
    pub face_deg: f64,
    /// Probability that it is damaged.
    pub probability: f64,
    /// Damage d, 0 to 1, and its standard error, whether it is damaged or not.
    pub damage: Estimate,
    /// Damage, given that it is damaged.
    pub severity: Estimate,
}

impl Zone {
    /// Whether it is more likely damaged than not.
    #[must_use]
    pub fn is_found(&self) -> bool {
        self.probability > 0.5
    }
}

/// A hypothesis: which zones are damaged, and by how much.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explained {
    /// Groups of zones and the damage of each.
    pub damage: Vec<(Vec<usize>, f64)>,
    /// Posterior probability.
    pub probability: f64,
    /// χ².
    pub chi2: f64,
}

/// One reading and what the model says of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GaugeReading {
    /// Name of the gauge.
    pub gauge: String,
    /// Name of the load test.
    pub test: String,
    /// Of the numbers.
    pub unit: String,
    /// What was read.
    pub read: f64,
    /// Its standard error.
    pub std_error: f64,
    /// What a sound member would show, all being as the scene says.
    pub sound: f64,
    /// What the most probable damage would show.
    pub damaged: f64,
    /// (read − damaged) over the standard error, model error included.
    pub z: f64,
}

/// What the gauges of a member say of its damage, from the readings of the scene that name a load
/// test. None: there are no such readings.
///
/// # Errors
/// [`GaugeError`].
pub fn from_gauges(
    scene: &Scene,
    member: usize,
    settings: &GaugeSettings,
    job: &Job,
) -> Result<Option<FromGauges>, GaugeError> {
    felt_from(scene, member, &scene.structure.readings, false, settings, job)
}

/// The same from readings made of the planted truth ([`simulate`]), and marked so. None: no load
/// tests, no gauges.
///
/// # Errors
/// [`GaugeError`].
pub fn felt_simulated(
    scene: &Scene,
    member: usize,
    simulation: &Simulation,
    settings: &GaugeSettings,
    job: &Job,
) -> Result<Option<FromGauges>, GaugeError> {
    let Some(readings) = simulate(scene, member, simulation, job)? else { return Ok(None) };
    felt_from(scene, member, &readings, true, settings, job)
}

/// The same from given readings.
///
/// # Errors
/// [`GaugeError`].
pub fn felt_from(
    scene: &Scene,
    member: usize,
    readings: &[Reading],
    simulated: bool,
    settings: &GaugeSettings,
    job: &Job,
) -> Result<Option<FromGauges>, GaugeError> {
    let Some(id) = scene.members.get(member).map(|m| m.id.as_str()) else { return Ok(None) };
    let Some(rig) = Rig::new(scene, id, Meshing::default())? else { return Ok(None) };
    let (data, unused) = sort(scene, &rig, readings);
    if data.is_empty() {
        return Ok(None);
    }
    let structure = System::new(&rig.model)?;
    let priors = settings.priors.measured(scene, id);
    let mut reduced = Reduced::new(&rig, rig.linear(&structure, job)?, &priors, job)?;
    let ([sound, given], finer_solutions) = finer(scene, &rig, job)?;
    reduced.correct(&sound, &given);
    let expected = reduced.read(&[], &[], &[]).ok_or(GaugeError::Broken)?.0;
    let found = invert(&mut reduced, &data, settings, job)?;
    let best = found.fits.first().ok_or(GaugeError::Broken)?;
    let damage: Vec<(usize, f64)> = best
        .hypothesis
        .groups
        .iter()
        .zip(&best.severity)
        .flat_map(|(g, &d)| g.iter().map(move |&z| (z, d)))
        .collect();
    let damaged = reduced.read(&damage, &[], &best.z).ok_or(GaugeError::Broken)?.0;
    let reading = |[value, std_error]: [f64; 2]| Estimate { value, std_error };
    let zone = |z: usize| Zone {
        from: (z / FACES) as f64 / TENTHS as f64,
        to: (z / FACES + 1) as f64 / TENTHS as f64,
        face_deg: 90.0 * (z % FACES) as f64,
        probability: found.probability[z],
        damage: reading(found.damage[z]),
        severity: reading(found.severity[z]),
    };
    let told = |(datum, sd): (&Datum, &f64)| {
        let (gauge, kind) = &rig.gauges[datum.reading % rig.gauges.len()];
        GaugeReading {
            gauge: gauge.clone(),
            test: rig.tests[datum.reading / rig.gauges.len()].clone(),
            unit: kind.unit().into(),
            read: datum.value,
            std_error: datum.std_error,
            sound: expected[datum.reading],
            damaged: damaged[datum.reading],
            z: (datum.value - damaged[datum.reading]) / sd,
        }
    };
    let explained = |fit: &inverse::Fit| Explained {
        damage: fit.hypothesis.groups.iter().cloned().zip(fit.severity.iter().copied()).collect(),
        probability: fit.probability,
        chi2: fit.chi2,
    };
    let told: Vec<GaugeReading> = data.iter().zip(&found.std_errors).map(told).collect();
    let freedom = data.len().saturating_sub(best.severity.len()).max(1) as f64;
    let most = chi2_point(freedom, ONCE_IN_A_THOUSAND);
    let refused = (best.chi2 > most).then(|| {
        format!(
            "no damage explains its {} readings, whatever modulus, loads and supports are within reason: their squared misfit is {:.3e}, and more than {most:.0} comes by chance once in a thousand. Likely: {}",
            data.len(),
            best.chi2,
            misfit::reason(&told)
        )
    });
    Ok(Some(FromGauges {
        zones: (0..TENTHS * FACES).map(zone).collect(),
        worst: reading(found.worst),
        probability: found
            .fits
            .iter()
            .filter(|f| !f.hypothesis.groups.is_empty())
            .map(|f| f.probability)
            .sum(),
        hypotheses: found.fits.iter().take(12).map(explained).collect(),
        readings: told,
        chi2: best.chi2,
        count: data.len(),
        solutions: reduced.solutions() + finer_solutions,
        unknowns: unknowns(&rig, &priors)
            .into_iter()
            .zip(found.unknowns)
            .map(|(u, z)| Learnt::new(&rig, u, z))
            .collect(),
        refused,
        simulated,
        unused,
        notes: rig.notes.clone(),
    }))
}

/// What a mesh of half the edge reads of the sound member, and what supports that give add to it,
/// and how many systems that took: near loads and supports the inverse's own mesh is a few noises
/// off.
fn finer(scene: &Scene, rig: &Rig, job: &Job) -> Result<([Vec<f64>; 2], usize), GaugeError> {
    let Some(fine) = Rig::new(scene, &rig.member, Meshing { element: Some(0.5 * rig.edge()) })?
    else {
        return Err(GaugeError::Broken);
    };
    let structure = System::new(&fine.model)?;
    let mut linear = fine.linear(&structure, job)?;
    let readings = linear.readings(&vec![0.0; fine.model.mesh.hexes.len()])?;
    let given = grip::given(&fine, &mut linear)?;
    Ok(([readings, given], linear.solutions()))
}

/// The readings of the rig's gauges under its tests, and those that cannot be used: each by its
/// number, and why.
fn sort(scene: &Scene, rig: &Rig, readings: &[Reading]) -> (Vec<Datum>, Vec<(usize, String)>) {
    let (mut data, mut unused) = (Vec::new(), Vec::new());
    for (number, reading) in
        readings.iter().enumerate().filter(|(_, r)| member_of(scene, r) == Some(&rig.member))
    {
        match refusal(scene, reading).or_else(|| rig.refusal(reading)) {
            Some(why) => unused.push((number, why)),
            None => data.extend(rig.datum(reading)),
        }
    }
    (data, unused)
}

impl FromGauges {
    /// What it says of the member: of a tenth of the axis the mean of its four quarters, whose
    /// errors are taken to go together. None where it was refused.
    #[must_use]
    pub fn evidence(&self) -> Option<Evidence> {
        if self.refused.is_some() {
            return None;
        }
        let zones: Zones = Zones(std::array::from_fn(|tenth| {
            let quarters = self.zones.get(FACES * tenth..FACES * (tenth + 1))?;
            let mean = |of: fn(&Zone) -> f64| quarters.iter().map(of).sum::<f64>() / FACES as f64;
            Some(Estimate {
                value: mean(|z| z.damage.value),
                std_error: mean(|z| z.damage.std_error),
            })
        }));
        let mark = if self.simulated {
            " (simulated from the planted truth, no site was read)"
        } else {
            ""
        };
        let found: Vec<String> = self.zones.chunks(FACES).flat_map(places).collect();
        let what = if found.is_empty() {
            "no zone is more likely damaged than not".into()
        } else {
            found.join("; ")
        };
        let modulus = self.unknowns.iter().find(|u| u.unit == "GPa");
        let modulus = modulus.map_or(String::new(), |u| {
            format!("; E {:.1} ± {:.1} GPa", u.found.value, u.found.std_error)
        });
        let basis = format!("{} readings of gauges{mark}; {what}{modulus}", self.count);
        let evidence = Evidence::new(GAUGES, true, [(Cause::Stiffness, zones)].into(), basis)?;
        let serde_json::Value::Object(details) = serde_json::to_value(self).ok()? else {
            return None;
        };
        Some(Evidence { details, ..evidence })
    }
}

/// What was found in a tenth of the axis, for people: its quarters one by one, or all of them at
/// once.
fn places(quarters: &[Zone]) -> Vec<String> {
    let percent = |share: f64| (100.0 * share).round();
    let told = |z: &Zone, side: String| {
        let Estimate { value, std_error } = z.severity;
        format!(
            "{} to {} % of the axis, {side}: {value:.2} ± {std_error:.2}",
            percent(z.from),
            percent(z.to)
        )
    };
    match quarters {
        [first, ..] if quarters.iter().all(Zone::is_found) => {
            vec![told(first, "all around".into())]
        }
        _ => quarters
            .iter()
            .filter(|z| z.is_found())
            .map(|z| told(z, format!("side at {}°", z.face_deg)))
            .collect(),
    }
}

impl Rig {
    /// Why a reading that [`refusal`] lets pass cannot be inverted all the same.
    #[must_use]
    pub fn refusal(&self, reading: &Reading) -> Option<String> {
        let why = || {
            "its gauge lies outside of the member: look at its `along`, `angle_deg` and `depth_mm`"
                .to_owned()
        };
        self.datum(reading).is_none().then(why)
    }

    /// A reading as a datum of this rig; none where it has no such gauge or test.
    #[must_use]
    pub(crate) fn datum(&self, reading: &Reading) -> Option<Datum> {
        let gauge = self.gauges.iter().position(|g| g.0 == reading.of)?;
        let test = self.tests.iter().position(|t| Some(t) == reading.test.as_ref())?;
        Some(Datum {
            reading: test * self.gauges.len() + gauge,
            value: reading.value,
            std_error: reading.std_error,
        })
    }
}
