//! What a prediction will not use, before anything is computed.

use intrados_ct::source::SliceSource;
use intrados_damage::ledger::Item;
use intrados_gauges::{self as gauges, GAUGES, GaugeError, rig::Rig};
use intrados_mechanics::member::Meshing;
use intrados_scene::Scene;
use intrados_stage::Job;
use intrados_survey::{self as survey, SURVEY};

use crate::{CT, PredictError};

/// What a prediction will not use, as far as can be told before anything is computed, each with its
/// place in the scene file. The rules are those of the prediction itself.
///
/// # Errors
/// The job was cancelled.
pub fn foreseen(scene: &Scene, job: &Job) -> Result<Vec<(String, Item)>, PredictError> {
    let mut refused: Vec<(String, Item)> = slices_refused(scene, job)?
        .into_iter()
        .map(|(place, member, item, why)| {
            (place, Item::new(scene.members[member].id.clone(), CT, item, Some(why)))
        })
        .collect();
    let mut rigs: Vec<(&str, Result<Option<Rig>, GaugeError>)> = Vec::new();
    for (i, reading) in scene.structure.readings.iter().enumerate() {
        job.step(i, scene.structure.readings.len())?;
        let member = gauges::member_of(scene, reading).unwrap_or_default();
        let why = gauges::refusal(scene, reading).or_else(|| {
            let known = rigs.iter().position(|r| r.0 == member).unwrap_or_else(|| {
                rigs.push((member, Rig::new(scene, member, Meshing::default())));
                rigs.len() - 1
            });
            match &rigs[known].1 {
                Ok(rig) => rig.as_ref()?.refusal(reading),
                Err(why) => Some(why.to_string()),
            }
        });
        if why.is_some() {
            refused.push((
                format!("readings[{i}]"),
                Item::new(member, GAUGES, gauges::reading_name(i, reading), why),
            ));
        }
    }
    for (i, observation) in scene.structure.observations.iter().enumerate() {
        if let Some(why) = survey::refusal(observation) {
            let item = Item::new(&observation.member, SURVEY, survey::name(observation), Some(why));
            refused.push((format!("observations[{i}]"), item));
        }
    }
    Ok(refused)
}

/// Slices of files that cannot be used, as far as can be told before damage is looked for: place in
/// the scene, number of the member, what the item is called, and why.
fn slices_refused(
    scene: &Scene,
    job: &Job,
) -> Result<Vec<(String, usize, String, String)>, PredictError> {
    let all = SliceSource::all(scene);
    let mut refused = Vec::new();
    for (n, slice) in all.iter().enumerate() {
        job.step(n, all.len())?;
        let place = || format!("slices of {}, {}", scene.members[slice.member].id, slice.core);
        refused.extend(slice.refusal(scene).map(|why| (place(), slice.member, slice.label(), why)));
    }
    Ok(refused)
}
