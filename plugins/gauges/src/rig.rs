//! What a member's gauges can feel: its elastic model under the load tests, cut into zones that may
//! be softened.

use std::sync::Arc;

use glam::DVec3;
use intrados_mechanics::{
    element::hex8,
    frame::joined,
    material::{DAY, steel::Bar},
    member::{Axes, Meshing, prepare_within},
    mesh::Locator,
    model::{Body, Elastic, Gauge, Linear, Matter, Model, SteelKind, System},
};
use intrados_scene::{
    Assembly, Scene, Structure,
    structure::{Load, Test},
};
use intrados_stage::Job;

use crate::{GaugeError, heard::improper};

/// Zones along the axis.
pub const TENTHS: usize = 10;
/// Zones around it: the quarters of the section at 0, 90, 180 and 270 degrees.
pub const FACES: usize = 4;
/// How long a strain gauge is, m: those for concrete bridge its aggregate.
const GAUGE_LENGTH: f64 = 0.1;
/// Points at which it is read.
const GAUGE_POINTS: usize = 10;
/// Points per direction at which a brick is asked in which zone it lies.
const POINTS: usize = 5;

/// The elastic model of one member, its load tests, gauges and zones.
#[derive(Debug)]
pub struct Rig {
    /// Id of the member.
    pub member: String,
    /// What is computed: linear, steel bonded, nothing acts for long.
    pub model: Model,
    /// Names of the load tests.
    pub tests: Vec<String>,
    /// Gauges of strain and displacement.
    pub gauges: Vec<(String, Gauge)>,
    /// Of every zone the bricks that its damage softens and by which share; zone = tenth × 4 +
    /// face. Damage fades towards the ends of a tenth (see [`mean_share`]); where neighbours are
    /// damaged alike it does not.
    pub zones: Vec<Vec<(u32, f64)>>,
    /// Of the borders between zones along the axis, tenth by tenth and face by face, the bricks
    /// within [`BORDER`] of a tenth: a damage may end sooner or later.
    pub borders: Vec<Vec<(u32, f64)>>,
    /// What a user should know.
    pub notes: Vec<String>,
    /// Of what is held, what may give: bearings do, planes of symmetry do not.
    pub(crate) giving: Vec<(u32, u8)>,
    measures: Measures,
}

/// How far on either side of its ends the damage of a zone fades from all to nothing, in tenths of
/// the axis.
const FADE: f64 = 0.15;

/// Mean over a zone of the damage that a group of zones, all of severity 1, has there. Alone a zone
/// has 0.925 of its peak: damage fades over 0.15 of a tenth to either side of where the zone ends,
/// and the shares of neighbours sum to 1.
#[must_use]
pub(crate) fn mean_share(group: &[usize], zone: usize) -> f64 {
    let beside = [zone.checked_sub(FACES), Some(zone + FACES).filter(|&z| z < TENTHS * FACES)];
    let own = if group.contains(&zone) { 1.0 } else { 0.0 };
    let lost = 0.25 * FADE;
    // Of the strip inside each end a quarter is the neighbour's; at the ends of the member there is
    // none.
    beside
        .into_iter()
        .flatten()
        .fold(own, |sum, z| sum + lost * (f64::from(u8::from(group.contains(&z))) - own))
}

/// How far a border reaches to each side, in tenths of the axis.
pub(crate) const BORDER: f64 = 0.125;

/// A member's own measures.
#[derive(Debug, Clone, Copy)]
struct Measures {
    axes: Axes,
    /// Middle and half of the section's box towards 0 and 90 degrees.
    middle: [f64; 2],
    half: [f64; 2],
}

impl Measures {
    /// The section's box is that of the mesh.
    fn of(assembly: &Assembly, model: &Model) -> Self {
        let axes = Axes::of(&assembly.frame);
        let boxed = |k: usize| {
            let across = model.mesh.nodes.iter().map(|p| axes.local(*p)[k]);
            let (low, high) =
                across.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            [0.5 * (low + high), (0.5 * (high - low)).max(1e-9)]
        };
        let [[a, b], [c, d]] = [boxed(0), boxed(1)];
        Self { axes, middle: [a, c], half: [b, d] }
    }

    /// Along the axis 0 to 1, across it −1 to 1 towards 0 and 90 degrees.
    fn local(&self, world: DVec3) -> DVec3 {
        let p = self.axes.local(world);
        let across = |k: usize| (p[k] - self.middle[k]) / self.half[k];
        DVec3::new(p.z / self.axes.length, across(0), across(1))
    }
}

/// The zone of a place in the member's own measures, as of [`Rig::softening`].
#[must_use]
pub fn zone_at(place: DVec3) -> usize {
    let tenth = ((place.x * TENTHS as f64) as usize).min(TENTHS - 1);
    FACES * tenth + face_at(place)
}

/// The quarter of the section: 0 towards 0 degrees, 1 towards 90, and so on.
#[must_use]
pub fn face_at(place: DVec3) -> usize {
    match (place.y.abs() >= place.z.abs(), place.y >= 0.0, place.z >= 0.0) {
        (true, true, _) => 0,
        (true, false, _) => 2,
        (false, _, true) => 1,
        (false, _, false) => 3,
    }
}

/// What is held of a model, without the planes of symmetry where its axis starts and ends.
fn giving(planes: [bool; 2], model: &Model, axes: Axes) -> Vec<(u32, u8)> {
    let is_of_plane = |&(node, component): &(u32, u8)| {
        let along = axes.local(model.mesh.nodes[node as usize]).z / axes.length;
        let is_there = |face: f64| (along - face).abs() < 1e-6;
        let is_across = axes.unit[2][usize::from(component)].abs() > 0.5;
        is_across && planes.into_iter().zip([0.0, 1.0]).any(|(is, face)| is && is_there(face))
    };
    model.holds.iter().copied().filter(|held| !is_of_plane(held)).collect()
}

impl Rig {
    /// The rig of a member; none where no load test acts on it or no gauge sits on it.
    ///
    /// # Errors
    /// [`GaugeError`].
    pub fn new(scene: &Scene, member: &str, meshing: Meshing) -> Result<Option<Self>, GaugeError> {
        let structure = &scene.structure;
        let tests: Vec<&Test> = structure
            .tests
            .iter()
            .filter(|t| t.member == member && improper(t).is_none())
            .collect();
        let is_known = |a: &&Assembly| a.body.is_some() || !a.steel.is_empty();
        let Some(body) = structure.assembly(member).filter(is_known) else { return Ok(None) };
        let measured = structure.gauges.iter().any(|g| g.member == member);
        if tests.is_empty() || !measured || body.is_tunnel() {
            return Ok(None);
        }
        let (testing, job) = (testing(scene, &tests), Job::default());
        // As part of a structure it feels what the others hand to it, and its own supports hold
        // nothing.
        let whole = joined(&testing, &job)?;
        let handed = whole.as_ref().and_then(|whole| whole.handed(&body.id));
        let prepared = prepare_within(&testing, body, handed, meshing.elastic(body), &job)?;
        let notes = prepared.notes;
        let mut model = prepared.model;
        stiffen(&mut model);
        let mut gauges = prepared.gauges;
        gauges.retain(|(_, gauge)| !matches!(gauge, Gauge::Stress(..)));
        let measures = Measures::of(body, &model);
        let giving = giving(structure.mirrored(&body.id), &model, measures.axes);
        let tests = tests.iter().map(|t| t.name.clone()).collect();
        let mut rig = Self {
            member: member.to_owned(),
            model,
            tests,
            gauges,
            zones: Vec::new(),
            borders: Vec::new(),
            notes,
            giving,
            measures,
        };
        (rig.zones, rig.borders) = rig.cut();
        Ok(Some(rig))
    }

    /// The linear response of its structure to its tests.
    ///
    /// # Errors
    /// [`GaugeError`].
    pub fn linear<'s, 'm>(
        &self,
        structure: &'s System<'m>,
        job: &Job,
    ) -> Result<Linear<'s, 'm>, GaugeError> {
        let cases = (0..self.tests.len())
            .map(|i| structure.loads(moment(i)))
            .collect::<Result<Vec<_>, _>>()?;
        let locator = Locator::new(&structure.model.mesh);
        let gauges: Vec<Vec<Gauge>> = self.gauges.iter().map(|g| stretch(g.1, &locator)).collect();
        Ok(structure.linear(0.0, cases, &gauges, job)?)
    }

    /// The modulus of its concrete, Pa.
    #[must_use]
    pub fn modulus(&self) -> f64 {
        let of = |body: &Body| {
            if let Matter::Elastic(law) = &body.matter { Some(law.modulus) } else { None }
        };
        self.model.bodies.iter().find_map(of).unwrap_or(0.0)
    }

    /// The longest edge of its elements, m.
    #[must_use]
    pub fn edge(&self) -> f64 {
        (0..self.model.mesh.hexes.len() as u32)
            .map(|h| self.model.mesh.longest(h))
            .fold(0.0, f64::max)
    }

    /// Softening of every brick from a field over the member: along the axis 0 to 1, across −1 to 1
    /// towards 0 and 90 degrees. The mean over the brick.
    #[must_use]
    pub fn softening(&self, damage: &dyn Fn(DVec3) -> f64) -> Vec<f64> {
        let mut sums = vec![0.0; self.model.mesh.hexes.len()];
        for (hex, sum) in sums.iter_mut().enumerate() {
            self.each_point(hex as u32, |place| {
                *sum += damage(place) / (POINTS * POINTS * POINTS) as f64
            });
        }
        sums
    }

    /// Softening of every brick from damage of the zones.
    #[must_use]
    pub fn soften(&self, damage: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; self.model.mesh.hexes.len()];
        for (zone, d) in self.zones.iter().zip(damage) {
            zone.iter().for_each(|&(hex, share)| all[hex as usize] += share * d);
        }
        all
    }

    fn cut(&self) -> (Vec<Vec<(u32, f64)>>, Vec<Vec<(u32, f64)>>) {
        const SHARE: f64 = 1.0 / (POINTS * POINTS * POINTS) as f64;
        let mut zones = vec![Vec::new(); TENTHS * FACES];
        let mut borders = vec![Vec::new(); (TENTHS + 1) * FACES];
        for hex in 0..self.model.mesh.hexes.len() as u32 {
            let mut shares = [0.0; TENTHS * FACES];
            let mut near = [0.0; (TENTHS + 1) * FACES];
            self.each_point(hex, |place| {
                let (zone, within) =
                    (zone_at(place), (place.x * TENTHS as f64).rem_euclid(1.0) - 0.5);
                let next = if within < 0.0 {
                    zone.checked_sub(FACES)
                } else {
                    Some(zone + FACES).filter(|&z| z < TENTHS * FACES)
                };
                let faded =
                    next.map_or(0.0, |_| ((within.abs() - 0.5 + FADE) / (2.0 * FADE)).max(0.0));
                shares[zone] += (1.0 - faded) * SHARE;
                next.into_iter().for_each(|next| shares[next] += faded * SHARE);
                let (along, border) = (place.x * TENTHS as f64, (place.x * TENTHS as f64).round());
                if (along - border).abs() < BORDER {
                    near[FACES * (border as usize).min(TENTHS) + face_at(place)] += SHARE;
                }
            });
            let put = |shares: &[f64], lists: &mut [Vec<(u32, f64)>]| {
                shares
                    .iter()
                    .enumerate()
                    .filter(|(_, s)| **s > 0.0)
                    .for_each(|(z, &s)| lists[z].push((hex, s)));
            };
            put(&shares, &mut zones);
            put(&near, &mut borders);
        }
        (zones, borders)
    }

    fn each_point(&self, hex: u32, mut each: impl FnMut(DVec3)) {
        let corners = self.model.mesh.corners(hex);
        let at = |k: usize| (2 * k + 1) as f64 / POINTS as f64 - 1.0;
        for k in 0..POINTS * POINTS * POINTS {
            let natural =
                DVec3::new(at(k % POINTS), at(k / POINTS % POINTS), at(k / POINTS / POINTS));
            each(self.measures.local(hex8::position(&corners, natural)));
        }
    }
}

/// When load test `i` acts, s.
fn moment(i: usize) -> f64 {
    DAY * i as f64
}

/// The scene in which nothing acts but the tests, one after the other.
fn testing(scene: &Scene, tests: &[&Test]) -> Scene {
    let mut loads = Vec::new();
    for (i, test) in tests.iter().enumerate() {
        let day = i as f32;
        for action in &test.actions {
            let history = vec![(day - 1.0, 0.0), (day, 1.0), (day + 1.0, 0.0)];
            loads.push(Load {
                name: test.name.clone(),
                members: vec![test.member.clone()],
                action: action.clone(),
                history,
                loading: None,
            });
        }
    }
    let structure = Structure { loads, ..Structure::clone(&scene.structure) };
    Scene { structure: Arc::new(structure), ..scene.clone() }
}

/// The points of a gauge: those of strain have a length, along which they are read. (So the reading
/// also changes smoothly where elements meet.)
fn stretch(gauge: Gauge, locator: &Locator) -> Vec<Gauge> {
    let Gauge::Strain(host, along) = gauge else { return vec![gauge] };
    let middle = hex8::position(&locator.mesh().corners(host.hex), host.natural);
    let at =
        |k: usize| middle + along * (GAUGE_LENGTH * ((k as f64 + 0.5) / GAUGE_POINTS as f64 - 0.5));
    let points: Vec<Gauge> = (0..GAUGE_POINTS)
        .filter_map(|k| Some(Gauge::Strain(locator.locate(at(k))?, along)))
        .collect();
    if points.is_empty() { vec![gauge] } else { points }
}

/// Makes everything elastic and always there: a test is short and small.
fn stiffen(model: &mut Model) {
    for body in &mut model.bodies {
        body.birth = f64::NEG_INFINITY;
        if let Matter::Concrete(mix) = &body.matter {
            let mix = &mix.0;
            let law = Elastic {
                modulus: mix.modulus,
                poisson: mix.poisson,
                expansion: mix.expansion,
                density: mix.density,
            };
            body.matter = Matter::Elastic(law);
        }
    }
    model.steel.retain(|s| !matches!(&s.kind, SteelKind::Tendon(t) if !t.bonded));
    for steel in &mut model.steel {
        (steel.rust, steel.bond) = (None, None);
        match &steel.kind {
            SteelKind::Tendon(t) => {
                steel.kind = SteelKind::Bar(Bar::elastic(t.strand.modulus));
            }
            SteelKind::Stressed(bar, _) => steel.kind = SteelKind::Bar(*bar),
            SteelKind::Bar(_) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_that_are_damaged_alike_do_not_fade() {
        assert!(
            (mean_share(&[9], 9) - 0.925).abs() < 1e-12
                && (mean_share(&[9], 5) - 0.0375).abs() < 1e-12
        );
        assert!(
            (mean_share(&[5, 9, 13], 9) - 1.0).abs() < 1e-12
                && (mean_share(&[0], 0) - 0.9625).abs() < 1e-12
        );
    }

    #[test]
    fn places_have_zones() {
        assert_eq!(zone_at(DVec3::new(0.0, 0.9, 0.1)), 0);
        assert_eq!(zone_at(DVec3::new(0.25, 0.1, 0.9)), 9);
        assert_eq!(zone_at(DVec3::new(0.999, -0.9, 0.1)), 38);
        assert_eq!(zone_at(DVec3::new(1.0, 0.0, -0.5)), 39);
    }

    /// What else holds the nodes of a plane of symmetry may give.
    #[test]
    fn planes_of_symmetry_do_not_give() {
        let unit = [0.0, 1.0];
        let mesh = intrados_mechanics::mesh::block(&unit, &unit, &unit, "beam").unwrap();
        let holds = (0..8).flat_map(|node| (0..3).map(move |c| (node, c))).collect();
        let model = Model { mesh, holds, ..Model::default() };
        let axes = Axes { start: DVec3::ZERO, unit: [DVec3::Y, DVec3::Z, DVec3::X], length: 1.0 };
        let left = |planes| giving(planes, &model, axes).len();
        assert_eq!([left([false; 2]), left([true, false]), left([true; 2])], [24, 20, 16]);
    }
}
