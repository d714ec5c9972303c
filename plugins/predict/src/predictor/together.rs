//! Putting together what is known of each member.

use std::collections::BTreeMap;

use intrados_damage::{
    evidence::{Cause, Evidence, LifeEnd, all_causes},
    fusion::Whole,
    grading::Profile,
    ledger, truth,
    verdict::{Basis, Looked, Verdict},
    zone::{ZONES, together, zone_at},
};
use intrados_forecast::{Capacity, FORECAST, Losses, beyond};
use intrados_gauges as gauges;
use intrados_gauges::{
    GAUGES,
    monitoring::{self, MONITORING},
};
use intrados_mechanics::{frame, member::Handed};
use intrados_scene::{
    Damage, Member, Scene,
    structure::{Course, Observation, Shows},
};
use intrados_stage::Estimate;
use intrados_survey as survey;
use intrados_survey::{
    SURVEY,
    photographed::{self, PHOTOGRAPHED, Shown},
};

use crate::{
    CT, Origin, SliceReading, SliceTruth,
    defect::defects,
    limits::of_what,
    prediction::{CrackCheck, MemberPrediction, Truth},
    section,
};

use super::{Item, Predictor};

impl Predictor {
    /// All evidence of a member, and what becomes of it.
    pub(super) fn gather(&self, index: usize) -> Gathered {
        let mut gathered = Gathered::default();
        for evidence in self.evidence(index) {
            let fault = evidence.fault();
            gathered.fates.push((evidence.source, fault.clone()));
            if fault.is_none() {
                gathered.evidence.insert(evidence.source, evidence);
            }
        }
        gathered.whole =
            self.settings.profile.fusion.whole(&gathered.evidence.values().collect::<Vec<_>>());
        for (source, why) in gathered.fates.iter_mut().filter(|f| f.1.is_none()) {
            let counted = gathered.whole.counted.contains(source);
            *why = (!counted).then(|| match gathered.evidence[source].measured {
                true => "the grading profile declares correlations that cannot be".into(),
                false => {
                    "measurements take precedence over the forecast, which differs from them by more than chance explains".into()
                }
            });
        }
        gathered
    }

    /// The ledger, member by member.
    pub(super) fn items(&self, scene: &Scene, gathered: &[Gathered]) -> Vec<ledger::Item> {
        let place: BTreeMap<&str, usize> =
            scene.members.iter().enumerate().map(|(i, m)| (m.id.as_str(), i)).collect();
        let of = |id: &str| place.get(id).copied().unwrap_or(scene.members.len());
        let fate = |member: usize, source: &str| {
            gathered.get(member).and_then(|g| g.fates.iter().find(|f| f.0 == source))
        };
        // What becomes of a piece of work: nothing yet, nothing for a reason, or what becomes of
        // its member's evidence of that source.
        let why = |piece: usize, member: usize, source: &str| match self.fates.get(piece) {
            None => Some("it has not been looked at yet".to_owned()),
            Some(Some(why)) => Some(why.clone()),
            Some(None) => fate(member, source)
                .map_or(Some("nothing came of it for this member".into()), |f| f.1.clone()),
        };
        let mut items: Vec<(usize, ledger::Item)> = Vec::new();
        let mut put = |member: usize, id: &str, source, item: String, why| {
            items.push((member, ledger::Item::new(id, source, item, why)))
        };
        let mut invertible: BTreeMap<usize, usize> = BTreeMap::new();
        for (piece, work) in self.queue.iter().enumerate() {
            match work {
                Item::Slice(s) => put(
                    s.member,
                    &scene.members[s.member].id,
                    CT,
                    s.label(),
                    why(piece, s.member, CT),
                ),
                Item::Life(model) => {
                    let members =
                        scene.structure.assembly(model).into_iter().flat_map(|a| &a.members);
                    members.for_each(|id| {
                        put(
                            of(id),
                            id,
                            FORECAST,
                            format!("the life of {}", scene.name_of(model)),
                            why(piece, of(id), FORECAST),
                        )
                    });
                }
                Item::Gauges(member) if gauges::can_simulate(scene, *member) => {
                    let item = "readings simulated from the planted truth".to_owned();
                    put(
                        *member,
                        &scene.members[*member].id,
                        GAUGES,
                        item,
                        why(piece, *member, GAUGES),
                    );
                }
                Item::Gauges(member) => drop(invertible.insert(*member, piece)),
                Item::Survey(member) => {
                    let id = &scene.members[*member].id;
                    for (number, observation) in survey::of_member(scene, id) {
                        let own = self.unheard.get(&number).cloned();
                        let why = own.or_else(|| why(piece, *member, SURVEY));
                        put(*member, id, SURVEY, survey::name(observation), why);
                    }
                }
                Item::Photograph(photo, member) => {
                    let Some(photo) = scene.structure.photographs.get(*photo) else { continue };
                    // Where others looked, too, it is part of what they say.
                    let source = match fate(*member, PHOTOGRAPHED) {
                        Some(_) => PHOTOGRAPHED,
                        None => SURVEY,
                    };
                    let id = &scene.members[*member].id;
                    let why = why(piece, *member, source);
                    put(*member, id, PHOTOGRAPHED, photographed::name(photo), why);
                }
                // No evidence: it rests on all of that.
                Item::Strength(_) => {}
                Item::Outside(source, member, items) => {
                    for (n, item) in items.iter().enumerate() {
                        let own = self.unused.get(&(piece, n)).cloned();
                        let why = own.or_else(|| why(piece, *member, source.name()));
                        put(*member, &scene.members[*member].id, source.name(), item.clone(), why);
                    }
                }
            }
        }
        for (number, reading) in scene.structure.readings.iter().enumerate() {
            let id = gauges::member_of(scene, reading).unwrap_or_default();
            let refused =
                gauges::refusal(scene, reading).or_else(|| self.unfelt.get(&number).cloned());
            let piece = || {
                invertible
                    .get(&of(id))
                    .map_or(Some("nothing is known of its member".into()), |&piece| {
                        why(piece, of(id), GAUGES)
                    })
            };
            put(of(id), id, GAUGES, gauges::reading_name(number, reading), refused.or_else(piece));
        }
        for series in &scene.structure.series {
            let gauge = scene.structure.gauges.iter().find(|g| g.name == series.gauge);
            let id = gauge.map_or("", |g| g.member.as_str());
            let own = monitoring::refusal(scene, series)
                .or_else(|| self.unmonitored.get(&series.gauge).cloned());
            let said = || match fate(of(id), MONITORING) {
                Some((_, why)) => why.clone(),
                None => Some("its member's life is not computed, which tells creep".into()),
            };
            put(of(id), id, MONITORING, monitoring::name(series), own.or_else(said));
        }
        items.sort_by_key(|i| i.0);
        items.into_iter().map(|i| i.1).collect()
    }

    /// What is known to be lost of a member; where nobody looked, nothing, with the error that the
    /// profile declares for that.
    fn losses(&self, index: usize) -> Losses {
        let Gathered { evidence, whole, .. } = self.gather(index);
        let unknown = &self.settings.profile.fusion.unknown;
        let of = |cause: Cause, zone: usize| {
            let known = whole.causes.get(&cause).and_then(|zones| zones.0[zone]);
            let std_error = unknown.get(&cause).copied().unwrap_or(0.0);
            known.unwrap_or(Estimate { value: 0.0, std_error })
        };
        let foretold = evidence.get(FORECAST).and_then(|e| e.zones.get(&Cause::Concrete));
        let concrete = |zone: usize| {
            let foretold = foretold.and_then(|zones| zones.0[zone]).map_or(0.0, |e| e.value);
            let causes = [beyond(of(Cause::Concrete, zone), foretold), of(Cause::Stiffness, zone)];
            all_causes(causes.into_iter()).unwrap_or_default()
        };
        Losses {
            concrete: std::array::from_fn(concrete),
            steel: std::array::from_fn(|zone| of(Cause::Steel, zone)),
        }
    }

    /// What is lost of the members of a model, by their ids.
    pub(super) fn losses_of(&self, scene: &Scene, model: &str) -> BTreeMap<String, Losses> {
        let members = scene.structure.assembly(model).into_iter().flat_map(|a| &a.members);
        let of = |id: &String| {
            let index = scene.members.iter().position(|m| m.id == *id)?;
            Some((id.clone(), self.losses(index)))
        };
        members.filter_map(of).collect()
    }

    /// How a member's computed life ends: by its forecast, or since it does not carry what acts with
    /// what is known of its damage.
    fn failure(
        &self,
        scene: &Scene,
        id: &str,
        evidence: &BTreeMap<&'static str, Evidence>,
    ) -> Option<LifeEnd> {
        let of_life = evidence.values().find_map(|e| e.failure.clone());
        of_life.or_else(|| {
            let assembly = scene.structure.assembly_of(id)?;
            let why = self.overloaded.get(&assembly.id)?.clone();
            let age = evidence.get(FORECAST).and_then(|e| e.details.get("age_years")?.as_f64());
            let of = |is: bool, what: &str| is.then(|| what.to_owned());
            let assumed = [
                of(assembly.steel_assumed, "reinforcement"),
                of(assembly.concrete_assumed, "concrete"),
            ];
            Some(LifeEnd {
                age_years: age.unwrap_or(0.0),
                ahead_years: 0.0,
                why,
                assumed: assumed.into_iter().flatten().collect(),
            })
        })
    }

    /// What is known of a member's strength.
    fn capacity(&self, scene: &Scene, id: &str) -> Option<&Capacity> {
        let model = &scene.structure.assembly_of(id)?.id;
        self.strengths.get(model)?.as_ref().ok()?.as_ref()
    }

    /// Models whose strength could not be computed, and why.
    pub(super) fn unraised(&self) -> Vec<(&str, &str)> {
        let failed = self
            .strengths
            .iter()
            .filter_map(|(model, found)| Some((self.name(model), found.as_ref().err()?.as_str())));
        failed.collect()
    }

    pub(super) fn member(
        &self,
        scene: &Scene,
        index: usize,
        Gathered { evidence, whole, .. }: Gathered,
    ) -> MemberPrediction {
        let member = &scene.members[index];
        let assembly = scene.structure.assembly_of(&member.id);
        let matter = assembly.and_then(|a| a.matter.as_ref());
        let profile = &self.settings.profile;
        let said: Vec<&Evidence> =
            evidence.values().filter(|e| whole.counted.contains(e.source)).collect();
        let capacity = self.capacity(scene, &member.id).cloned();
        // Of what nothing is known damage is not nothing.
        let by_strength = profile.by_strength && whole.damage().is_some();
        let cost = capacity.as_ref().filter(|_| by_strength).map(|c| c.cost);
        let damage = cost.or_else(|| whole.damage());
        let zones = whole.zones.0.iter().flatten().copied();
        let graded: Vec<Estimate> = cost.map_or_else(|| zones.collect(), |cost| vec![cost]);
        let zone_basis = Basis::by_zone(&said);
        let found = survey::of_member(scene, &member.id).map(|(_, o)| o);
        let nothing = Shown::default();
        let photographed = self.photographed.get(&index).unwrap_or(&nothing);
        let defects = defects(scene, &member.id, photographed, &self.readings[index]);
        let limit = admitted_width(scene, index, profile);
        let counts = |width: Option<f64>| width.is_none_or(|w| limit.is_none_or(|most| w > most));
        let is_listed = defects.iter().any(|d| counts(d.width_mm));
        let looked = Looked::of(profile, &said, is_listed, limit);
        let cracks = profile.cracks(&said);
        let verdict = Verdict::of(profile, damage, &cracks, Basis::of(&zone_basis), looked);
        let failure = self.failure(scene, &member.id, &evidence);
        let verdict = match &failure {
            Some(end) => verdict.failing(profile, end),
            None => verdict,
        };
        let widest = evidence
            .values()
            .filter_map(|e| Some((e.source, e.crack_width_mm?)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let mut conflicts = whole.conflicts.clone();
        conflicts
            .extend(unforeseen(found.chain(&photographed.observations), evidence.get(FORECAST)));
        MemberPrediction {
            id: member.id.clone(),
            name: member.name.clone(),
            kind: member.kind,
            concrete: of_what(&member.concrete, matter),
            concrete_assumed: member.concrete_assumed,
            damage: damage.map(|d| d.value),
            damage_std_error: damage.map(|d| d.std_error),
            state: verdict.state,
            state_probability: verdict.probability,
            state_run: verdict.run,
            basis: verdict.basis,
            zone_basis,
            advice: verdict.advice,
            within_months: verdict.within_months,
            to_inspect: verdict.to_inspect,
            by_strength: cost.is_some(),
            states: shares(&graded, profile),
            failure,
            capacity,
            crack_check: widest.and_then(|widest| crack_check(scene, member, widest, profile)),
            conflict: !conflicts.is_empty(),
            zones: whole.zones,
            causes: whole.causes,
            worst_zone: whole.worst,
            conflicts,
            truth: self.truth(member, &self.readings[index]),
            defects,
            gauges: self.measured.get(&index).cloned().unwrap_or_default(),
            faces: photographed.faces.clone(),
            evidence,
            slices: self.readings[index].clone(),
        }
    }

    /// Where slices were drawn or scanned, the pores and cracks that are truly in them and all else
    /// that was planted; where there are none, what was planted; else what was labelled.
    pub(super) fn truth(&self, member: &Member, readings: &[SliceReading]) -> Option<Truth> {
        let profile = &self.settings.profile;
        let known: Vec<&SliceTruth> = readings.iter().filter_map(|r| r.truth.as_ref()).collect();
        let whole = !known.is_empty() && known.len() == readings.len();
        let made = whole && readings.iter().all(|r| r.origin != Origin::File);
        let zones = if made {
            // Air is what slices truly have, or what was planted where that is more, and of cracks
            // no less than the slices of a zone show; all else is planted, whether a slice meets it
            // or not.
            let air = |r: &SliceReading| {
                Some(
                    profile
                        .rule
                        .damage(
                            Estimate { value: r.truth.as_ref()?.porosity, std_error: 0.0 },
                            &[],
                            1.0,
                        )
                        .value,
                )
            };
            let of_slices = section::standing(readings, air, |d| d);
            let own = |zone| {
                let inside = readings.iter().filter(|r| r.along.map(zone_at) == Some(zone));
                inside.filter_map(|r| Some(r.truth.as_ref()?.damage)).fold(0.0, f64::max)
            };
            let [pores, cracks, besides] = truth::parts(member, &profile.rule);
            Some(std::array::from_fn(|zone| {
                let air = of_slices[zone].unwrap_or(0.0).max(pores[zone]);
                together([together([air, cracks[zone]]).max(own(zone)), besides[zone]])
            }))
        } else if readings.is_empty() && !member.truth.is_empty() {
            Some(truth::planted(member, &profile.rule))
        } else {
            None
        };
        // The truth of some sections is not that of the member's worst one.
        let labelled = || whole.then(|| known.iter().map(|t| t.damage).fold(0.0, f64::max));
        let damage =
            zones.map(|z: [f64; ZONES]| z.into_iter().fold(0.0, f64::max)).or_else(labelled)?;
        Some(Truth {
            damage,
            zones,
            state: profile.state(damage, 0.0).map(|s| s.name.clone()).unwrap_or_default(),
            porosity: (!known.is_empty())
                .then(|| known.iter().map(|t| t.porosity).sum::<f64>() / known.len() as f64),
            crack_width_mm: known.iter().filter_map(|t| t.widest_mm).reduce(f64::max),
            origin: if zones.is_some() { "planted" } else { "labelled" },
            not_visible: if zones.is_some() {
                member.truth.iter().filter_map(|d| not_visible(d, member, readings)).collect()
            } else {
                Vec::new()
            },
        })
    }
}

/// Evidence of a member, and what became of it.
#[derive(Default)]
pub(super) struct Gathered {
    /// What counts, by its source.
    evidence: BTreeMap<&'static str, Evidence>,
    /// Of every piece of evidence its source, and why it does not count.
    fates: Vec<(&'static str, Option<String>)>,
    whole: Whole,
}

/// Diagonal cracks that the member's life, as it was computed, does not open: shear that nobody
/// foretold, or ground that gave way. Each in words.
fn unforeseen<'a>(
    found: impl Iterator<Item = &'a Observation>,
    forecast: Option<&Evidence>,
) -> Vec<String> {
    let Some(forecast) = forecast else { return Vec::new() };
    let foretold = forecast.crack_width_mm.unwrap_or(0.0);
    let one = |o: &Observation| match o.shows {
        Shows::Crack { width_mm, std_error_mm, course: Course::Diagonal, .. }
            if width_mm - 1.96 * std_error_mm > foretold =>
        {
            let [from, to] = o.spot.along;
            Some(format!(
                "{}: a diagonal crack {width_mm:.2} ± {std_error_mm:.2} mm wide at {:.0} % of the length, where the forecast expects {}",
                o.name,
                50.0 * (from + to),
                if foretold < 0.005 {
                    "none".into()
                } else {
                    format!("none wider than {foretold:.2} mm")
                }
            ))
        }
        _ => None,
    };
    found.filter_map(one).collect()
}

/// What the rest of the structure does to a model; where members bear as one but this one is no
/// part of that, why it is computed by itself.
pub(super) fn part_of<'a>(
    frame: &'a Option<Result<Option<frame::Whole>, String>>,
    model: &str,
) -> (Option<&'a Handed>, Option<String>) {
    match frame {
        Some(Ok(Some(whole))) => match whole.handed(model) {
            Some(handed) => (Some(handed), None),
            None => (None, Some("it is no part of the whole and computed by itself".into())),
        },
        Some(Err(why)) => (None, Some(format!("it is computed by itself, since {why}"))),
        Some(Ok(None)) | None => (None, None),
    }
}

/// Shares of what has these damages that are to be expected in each state.
fn shares(damages: &[Estimate], profile: &Profile) -> BTreeMap<String, f64> {
    let of = |damage| Verdict::of(profile, Some(damage), &[], Basis::Measured, Looked::NOWHERE);
    let mut shares = BTreeMap::new();
    for damage in damages {
        for (state, p) in of(*damage).probability {
            *shares.entry(state).or_default() += p / damages.len() as f64;
        }
    }
    shares
}

/// The crack width that a member's exposure class admits, mm; `None` where the profile says nothing.
pub(crate) fn admitted_width(scene: &Scene, index: usize, profile: &Profile) -> Option<f64> {
    admitted(scene, scene.members.get(index)?, profile)
}

fn admitted(scene: &Scene, member: &Member, profile: &Profile) -> Option<f64> {
    let exposure = &member.exposure.as_ref()?.class;
    let prestressed =
        scene.structure.assembly_of(&member.id).is_some_and(|a| a.has_tendons(&member.id));
    profile.crack_limit(exposure, prestressed)
}

fn crack_check(
    scene: &Scene,
    member: &Member,
    (source, width_mm): (&'static str, f64),
    profile: &Profile,
) -> Option<CrackCheck> {
    let exposure = member.exposure.as_ref()?.class.clone();
    let limit_mm = admitted(scene, member, profile)?;
    Some(CrackCheck { width_mm, source, limit_mm, exposure, exceeded: width_mm > limit_mm })
}

/// Planted damage that no slice of the member shows: none shows the whole section there, or its
/// bars.
fn not_visible(damage: &Damage, member: &Member, readings: &[SliceReading]) -> Option<String> {
    let shown = |from: f32, to: f32, shows: &dyn Fn(&SliceReading) -> bool| {
        readings.iter().any(|r| {
            r.along.is_some_and(|along| (f64::from(from)..=f64::from(to)).contains(&along))
                && shows(r)
        })
    };
    match *damage {
        Damage::Spall { along, diameter_m, depth_m, .. } => {
            let reach = 0.5 * diameter_m / member.frame.axis.length().max(1e-6);
            let hidden = !shown(along - reach, along + reach, &|r| r.lost.is_some());
            hidden.then(|| format!("spall, {:.0} mm deep", 1e3 * depth_m))
        }
        Damage::Corrosion { from, to, section_loss } => {
            let hidden = !shown(from, to, &|r| r.steel.is_some());
            hidden.then(|| format!("corrosion, {:.0} % of the bars' section", 1e2 * section_loss))
        }
        Damage::Softened { damage, .. } => Some(format!("softened zone, d = {damage:.2}")),
        Damage::Crack { along, width_mm, .. } => {
            // Its rough surface wanders by centimetres along members of metres.
            let reach = 0.02;
            let hidden = !shown(along - reach, along + reach, &|r| {
                r.truth.as_ref().is_some_and(|t| t.cracks > 0)
            });
            hidden.then(|| format!("crack, {width_mm} mm wide"))
        }
        Damage::Honeycomb { along, length_m, porosity } => {
            let reach = 0.5 * length_m / member.frame.axis.length().max(1e-6);
            let hidden = !shown(along - reach, along + reach, &|_| true);
            hidden.then(|| format!("honeycomb, {:.0} % air", 1e2 * porosity))
        }
        Damage::Voids { .. } => None,
    }
}
