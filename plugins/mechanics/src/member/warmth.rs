//! Heat that a member makes while it hardens and that air brings it, conducted through its mesh;
//! its temperatures become loads.
//!
//! The field of every moment is a load of its own that grows from the moment before and goes until
//! the next, so that temperatures are linear in between. Until the forms are struck the member
//! follows its heat freely; what it cools afterwards, it is hindered from. Heat does not cross
//! joints.

use intrados_scene::structure;
use intrados_stage::Job;

use super::{Draft, MemberError, body::SEGMENTS};
use crate::{
    heat::{Conduction, Conductor, Film, Heat, Warmth},
    material::{
        DAY,
        thermal::{CONDUCTIVITY, Hydration, SPECIFIC_HEAT},
    },
    mesh::HexFace,
    model::{Action, CONDUCTED, Load, Matter, interpolate},
};

/// Warmer air.
pub(crate) struct Air {
    /// At the side at 0 degrees or the inside, and at all others, K.
    pub(crate) warmer: [f64; 2],
    /// (s, factor).
    pub(crate) history: Vec<(f64, f64)>,
}

/// Films of air inside and outside, W/(m²K): EN ISO 6946, 1/.13 and 1/.04.
const EXCHANGE: [f64; 2] = [7.7, 25.0];
/// Longest step of conduction, s, as long as there are not too many.
const STEP: f64 = 0.1 * DAY;
/// Steps of conduction from one moment to the next.
const STEPS: f64 = 40.0;
/// Heat capacity of what is no concrete (ground), J/(m³K).
const CAPACITY: f64 = 2e6;

impl Draft<'_> {
    /// Adds the temperatures of all moments to the loads, where there is heat.
    pub(super) fn warm(&mut self, times: &[f64], job: &Job) -> Result<(), MemberError> {
        let hydration = self.hydration()?;
        if self.air.is_empty() && hydration.is_none() {
            return Ok(());
        }
        let Some((&begin, &end)) = times.first().zip(times.last()) else { return Ok(()) };
        let bodies = self.conductors(hydration);
        let films = self.films([begin.min(self.birth()), end]);
        let conduction = Conduction { bodies, films, kept: Vec::new(), theta: 1.0 };
        let id = self.id();
        let failed = |source| MemberError::Heat { id: id.clone(), source: Box::new(source) };
        let mut heat = Heat::new(&self.model.mesh, &conduction).map_err(failed)?;
        let mut now = heat.rest(begin.min(self.birth()), self.model.temperature);
        for (warm, body) in self
            .model
            .mesh
            .hexes
            .iter()
            .map(|hex| (hex.nodes, &conduction.bodies[hex.region as usize]))
        {
            if body.birth <= now.time && body.birth.is_finite() {
                warm.into_iter().for_each(|n| now.temperature[n as usize] = body.fresh);
            }
        }
        let mut fields = Vec::with_capacity(times.len());
        for &time in times {
            now = flow(&mut heat, now, time, job).map_err(failed)?;
            fields.push(
                now.temperature.iter().map(|t| t - self.model.temperature).collect::<Vec<f64>>(),
            );
        }
        for (k, field) in fields.into_iter().enumerate() {
            let before = k.checked_sub(1).map(|k| (times[k], 0.0));
            let after = times.get(k + 1).map(|&t| (t, 0.0));
            let history = before.into_iter().chain([(times[k], 1.0)]).chain(after).collect();
            self.model.loads.push(Load {
                name: CONDUCTED.into(),
                action: Action::Temperature(field),
                history,
            });
        }
        Ok(())
    }

    /// Heat of the member's own concrete.
    fn hydration(&self) -> Result<Option<Hydration>, MemberError> {
        let mix = self.scene.structure.concrete(&self.member.concrete);
        let Some(structure::Hydration { cement_kg_m3, heat_kj_kg, time_days }) =
            mix.and_then(|c| c.hydration)
        else {
            return Ok(None);
        };
        let [cement, heat, time] = [cement_kg_m3, heat_kj_kg, time_days].map(f64::from);
        let hydration = Hydration::new(cement, 1e3 * heat, time * DAY);
        hydration.map(Some).map_err(|source| MemberError::Material { id: self.id(), source })
    }

    fn conductors(&self, hydration: Option<Hydration>) -> Vec<Conductor> {
        let fresh = |region: &str| {
            let pour = region
                .rsplit_once("/pour ")
                .and_then(|(_, number)| number.parse::<usize>().ok())
                .unwrap_or(1);
            self.member
                .pours
                .get(pour - 1)
                .map_or(self.model.temperature, |p| 273.15 + f64::from(p.temperature_c))
        };
        let one = |(region, body): (&String, &crate::model::Body)| {
            let concrete = matches!(body.matter, Matter::Concrete(_));
            Conductor {
                conductivity: CONDUCTIVITY,
                capacity: if concrete { body.matter.density() * SPECIFIC_HEAT } else { CAPACITY },
                hydration: hydration.filter(|_| concrete && region != SEGMENTS),
                birth: if region == SEGMENTS { f64::NEG_INFINITY } else { body.birth },
                fresh: fresh(region),
            }
        };
        self.model.mesh.regions.iter().zip(&self.model.bodies).map(one).collect()
    }

    /// Air on all faces; planes of symmetry, and the portals of a tunnel, which goes on there, let
    /// no heat through.
    fn films(&self, span: [f64; 2]) -> Vec<Film> {
        let mesh = &self.model.mesh;
        let sided: Vec<(HexFace, usize)> = if self.is_tunnel() {
            let set = |name: &str, side: usize| {
                mesh.face_sets.get(name).into_iter().flatten().map(move |&face| (face, side))
            };
            set("inner", 0).chain(set("outer", 1)).collect()
        } else {
            let side = |face: HexFace| {
                usize::from(
                    mesh.face_middle(face).1.normalize_or_zero().dot(self.axes.unit[0]) < 0.7,
                )
            };
            let mirrored = self.mirrored();
            let open = mesh.outer_faces().into_iter();
            open.filter(|face| mirrored.binary_search(face).is_err())
                .map(|face| (face, side(face)))
                .collect()
        };
        let mut moments: Vec<f64> =
            self.air.iter().flat_map(|a| a.history.iter().map(|h| h.0)).chain(span).collect();
        moments.sort_unstable_by(f64::total_cmp);
        moments.dedup();
        let course = |side: usize| -> Vec<(f64, f64)> {
            let warmer = |time: f64| {
                self.air
                    .iter()
                    .map(|a| a.warmer[side] * interpolate(&a.history, time).unwrap_or(1.0))
                    .sum::<f64>()
            };
            moments.iter().map(|&time| (time, self.model.temperature + warmer(time))).collect()
        };
        let courses = [course(0), course(1)];
        sided
            .into_iter()
            .map(|(face, side)| Film { face, exchange: EXCHANGE[side], air: courses[side].clone() })
            .collect()
    }
}

/// To a later time by equal steps.
fn flow(
    heat: &mut Heat,
    mut now: Warmth,
    to: f64,
    job: &Job,
) -> Result<Warmth, crate::model::Failure> {
    let (from, span) = (now.time, to - now.time);
    if span <= 0.0 {
        return Ok(now);
    }
    let steps = (span / STEP).ceil().clamp(1.0, STEPS) as u32;
    for k in 1..=steps {
        let time = if k == steps { to } else { from + span * f64::from(k) / f64::from(steps) };
        now = heat.step(&now, time, job)?;
    }
    Ok(now)
}
