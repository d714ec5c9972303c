//! Readings made from a known damage, for scenes whose truth is planted and for experiments.
//!
//! They come from another mesh than the inverse's, finer and not nested in it, from a damage that
//! is a field and follows no element, with noise.

use glam::DVec3;
use intrados_mechanics::{member::Meshing, model::System};
use intrados_scene::{Damage, Scene, structure::Reading};
use intrados_stage::{Job, random::Key};
use intrados_transport::Perturbed;

use crate::{
    GaugeError,
    rig::{FACES, Rig, face_at},
    unknown::{Priors, Truth},
};

/// How readings are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Simulation {
    /// Of the noise.
    pub seed: u64,
    /// Standard deviation of the noise over the reading of the sound member.
    pub noise: f64,
    /// What a strain gauge resolves: no smaller noise.
    pub strain: f64,
    /// What a gauge of displacement resolves, m.
    pub displacement_m: f64,
    /// Edge of elements over that of the inverse's mesh.
    pub finer: f64,
    /// The modulus of the concrete over what the scene says.
    pub modulus: f64,
    /// How far off modulus, loads and supports are drawn besides.
    pub off: Priors,
}

impl Default for Simulation {
    fn default() -> Self {
        Self {
            seed: 1,
            noise: 0.01,
            strain: 0.5e-6,
            displacement_m: 2e-6,
            finer: 0.62,
            modulus: 1.0,
            off: Priors::KNOWN,
        }
    }
}

/// What the gauges of a member would read of its planted truth; none where there are no tests or no
/// gauges. Softened zones are felt; of cracks, voids and spalls too little is known of what they do
/// to stiffness: `Err` never, but they are not in it.
///
/// # Errors
/// [`GaugeError`].
pub(crate) fn simulate(
    scene: &Scene,
    member: usize,
    simulation: &Simulation,
    job: &Job,
) -> Result<Option<Vec<Reading>>, GaugeError> {
    let Some(of) = scene.members.get(member) else { return Ok(None) };
    let softened: Vec<(f64, f64, Option<usize>, f64)> =
        of.truth.iter().filter_map(softened).collect();
    let damage = |place: DVec3| {
        let within = |s: &&(f64, f64, Option<usize>, f64)| {
            (s.0..s.1).contains(&place.x) && s.2.is_none_or(|face| face == face_at(place))
        };
        1.0 - softened.iter().filter(within).map(|s| 1.0 - s.3).product::<f64>()
    };
    simulate_with(scene, &of.id, &damage, simulation, job)
}

/// A softened zone of the truth: from, to, face, damage.
fn softened(damage: &Damage) -> Option<(f64, f64, Option<usize>, f64)> {
    let &Damage::Softened { from, to, damage, side_deg } = damage else { return None };
    let face = side_deg
        .map(|deg| ((f64::from(deg) / 90.0).round() as i64).rem_euclid(FACES as i64) as usize);
    Some((f64::from(from), f64::from(to), face, f64::from(damage)))
}

/// The same for a field of damage over the member: along its axis 0 to 1, across −1 to 1 towards 0
/// and 90 degrees.
///
/// # Errors
/// [`GaugeError`].
pub fn simulate_with(
    scene: &Scene,
    member: &str,
    damage: &dyn Fn(DVec3) -> f64,
    simulation: &Simulation,
    job: &Job,
) -> Result<Option<Vec<Reading>>, GaugeError> {
    let Some(coarse) = Rig::new(scene, member, Meshing::default())? else { return Ok(None) };
    let edge = coarse.edge();
    let Some(mut rig) =
        Rig::new(scene, member, Meshing { element: Some(simulation.finer * edge) })?
    else {
        return Ok(None);
    };
    let truth = Truth::draw(
        &mut rig,
        &simulation.off.measured(scene, member),
        simulation.modulus,
        simulation.seed,
    );
    let structure = System::new(&rig.model)?;
    let mut linear = rig.linear(&structure, job)?;
    let sound = linear.readings(&vec![0.0; rig.model.mesh.hexes.len()])?;
    job.step(1, 2)?;
    let mut found = linear.readings(&rig.softening(damage))?;
    truth.change(&rig, &mut linear, &mut found)?;
    let mut readings = Vec::with_capacity(found.len());
    for (i, (found, sound)) in found.into_iter().zip(sound).enumerate() {
        let (test, (gauge, kind)) =
            (&rig.tests[i / rig.gauges.len()], &rig.gauges[i % rig.gauges.len()]);
        let floor = if kind.unit() == "m" { simulation.displacement_m } else { simulation.strain };
        let std_error = (simulation.noise * sound.abs()).max(floor);
        let value = found + std_error * Key::new(simulation.seed, i as u64).normal(0);
        readings.push(Reading {
            of: gauge.clone(),
            test: Some(test.clone()),
            value,
            std_error,
            at_days: 0.0,
        });
    }
    Ok(Some(readings))
}
