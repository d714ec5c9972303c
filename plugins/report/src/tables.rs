//! Comma-separated tables: UTF-8, RFC 4180, a decimal point, units in the header, members joined by
//! their id.

use std::collections::BTreeMap;

use intrados_damage::{
    evidence::Cause,
    zone::{ZONES, Zones},
};
use intrados_forecast::FORECAST;
use intrados_predict::{MemberPrediction, Origin, Prediction};
use intrados_stage::csv::{Table, number};

/// All tables of a prediction but those of pores, by their names.
#[must_use]
pub fn tables(prediction: &Prediction) -> [(&'static str, String); 5] {
    [
        ("members", members_csv(prediction)),
        ("zones", zones_csv(prediction)),
        ("defects", defects_csv(prediction)),
        ("slices", slices_csv(prediction)),
        ("evidence", evidence_csv(prediction)),
    ]
}

/// One row a member.
#[must_use]
pub(crate) fn members_csv(prediction: &Prediction) -> String {
    let mut table = Table::new(&[
        "member_id",
        "name",
        "kind",
        "concrete",
        "damage [1]",
        "damage_std_error [1]",
        "state",
        "basis",
        "p_states [1]",
        "rust",
        "conflict",
        "slices",
        "slices_drawn",
        "crack_width_max [mm]",
        "true_damage [1]",
        "true_state",
        "truth",
        "graded_by",
        "raised_loads",
        "load_factor [1]",
        "load_factor_std_error [1]",
        "fails_by",
        "strength_cost [1]",
        "strength_cost_std_error [1]",
        "failure",
    ]);
    for m in prediction.failing_first() {
        let borne = m.capacity.as_ref();
        let width = m.evidence.values().filter_map(|e| e.crack_width_mm).reduce(f64::max);
        let kind = serde_json::to_value(m.kind)
            .ok()
            .and_then(|v| v.as_str().map(str::to_owned))
            .unwrap_or_default();
        table.row(&[
            m.id.clone(),
            m.name.clone(),
            kind,
            m.concrete.clone(),
            number(m.damage),
            number(m.damage_std_error),
            m.state.clone(),
            m.basis.name().to_owned(),
            prediction
                .profile
                .states
                .iter()
                .filter_map(|s| {
                    Some(format!("{} {:.2}", s.name, m.state_probability.get(&s.name)?))
                })
                .collect::<Vec<_>>()
                .join("; "),
            rust(m).to_owned(),
            m.conflict.to_string(),
            m.slices.len().to_string(),
            m.slices.iter().filter(|s| s.origin == Origin::Drawn).count().to_string(),
            number(width),
            number(m.truth.as_ref().map(|t| t.damage)),
            m.truth.as_ref().map(|t| t.state.clone()).unwrap_or_default(),
            m.truth.as_ref().map(|t| t.origin.to_owned()).unwrap_or_default(),
            if m.by_strength { "strength" } else { "worst zone" }.to_owned(),
            borne.map(|c| c.loads.join("; ")).unwrap_or_default(),
            number(borne.map(|c| c.load_factor.value)),
            number(borne.map(|c| c.load_factor.std_error)),
            borne.map(|c| c.mode.words().to_owned()).unwrap_or_default(),
            number(borne.map(|c| c.cost.value)),
            number(borne.map(|c| c.cost.std_error)),
            m.failure.as_ref().map(|end| end.sentence()).unwrap_or_default(),
        ]);
    }
    table.text()
}

/// What the rust of a member's bars rests on.
fn rust(m: &MemberPrediction) -> &'static str {
    let Some(told) = m.evidence.get(FORECAST).and_then(|e| e.details.get("rust")) else {
        return "not computed";
    };
    match told["computed"] == true {
        false => "not computed",
        true if told["assumed"].as_array().is_some_and(|a| !a.is_empty()) => {
            "assumed by exposure class"
        }
        true => "given",
    }
}

/// One row a zone that anything is known of: fused, and by source.
#[must_use]
pub(crate) fn zones_csv(prediction: &Prediction) -> String {
    let mut table = Table::new(&[
        "member_id",
        "from [1]",
        "to [1]",
        "source",
        "cause",
        "damage [1]",
        "damage_std_error [1]",
        "true_damage [1]",
    ]);
    for m in &prediction.members {
        let causes = |source: &'static str, e: &BTreeMap<Cause, Zones>| {
            e.iter().map(move |(cause, z)| (source, cause.name(), *z)).collect::<Vec<_>>()
        };
        let sources = m.evidence.iter().flat_map(|(source, e)| causes(source, &e.zones));
        let fused = causes("fused", &m.causes);
        for (source, cause, zones) in
            std::iter::once(("fused", "all", m.zones)).chain(fused).chain(sources)
        {
            for (zone, reading) in
                zones.0.iter().enumerate().filter_map(|(zone, r)| Some((zone, (*r)?)))
            {
                let truth = m
                    .truth
                    .as_ref()
                    .and_then(|t| t.zones)
                    .map(|z| z[zone])
                    .filter(|_| cause == "all");
                table.row(&[
                    m.id.clone(),
                    (zone as f64 / ZONES as f64).to_string(),
                    ((zone + 1) as f64 / ZONES as f64).to_string(),
                    source.to_owned(),
                    cause.to_owned(),
                    number(Some(reading.value)),
                    number(Some(reading.std_error)),
                    number(truth),
                ]);
            }
        }
    }
    table.text()
}

/// One row a slice.
#[must_use]
pub(crate) fn slices_csv(prediction: &Prediction) -> String {
    let mut table = Table::new(&[
        "member_id",
        "core",
        "slice",
        "origin",
        "pixel [mm]",
        "body_area [mm2]",
        "pores",
        "porosity [1]",
        "porosity_std_error [1]",
        "porosity_sampling_error [1]",
        "cracks",
        "crack_length [mm]",
        "crack_width_max [mm]",
        "damage [1]",
        "damage_std_error [1]",
        "fallen_off [1]",
        "fallen_off_std_error [1]",
        "bars",
        "bars_laid",
        "steel_area [mm2]",
        "steel_laid [mm2]",
        "steel_loss [1]",
        "steel_loss_std_error [1]",
        "true_porosity [1]",
        "true_damage [1]",
        "dice [1]",
        "f1 [1]",
    ]);
    for (m, s) in prediction.members.iter().flat_map(|m| m.slices.iter().map(move |s| (m, s))) {
        let truth = s.truth.as_ref();
        table.row(&[
            m.id.clone(),
            s.core.clone(),
            s.name.clone(),
            s.origin.name().to_owned(),
            s.pixel_mm.to_string(),
            number(Some(s.body_mm2)),
            s.pores.to_string(),
            number(Some(s.porosity.value)),
            number(Some(s.porosity.std_error)),
            number(Some(s.sampling_error)),
            s.cracks.len().to_string(),
            number(Some(s.cracks.iter().map(|c| c.length_mm).sum())),
            number(s.cracks.iter().map(|c| c.width_mm).reduce(f64::max)),
            number(Some(s.damage.value)),
            number(Some(s.damage.std_error)),
            number(s.lost.map(|l| l.value)),
            number(s.lost.map(|l| l.std_error)),
            s.steel.map(|s| s.bars.to_string()).unwrap_or_default(),
            s.steel.map(|s| s.laid.to_string()).unwrap_or_default(),
            number(s.steel.map(|s| s.area_mm2)),
            number(s.steel.map(|s| s.laid_mm2)),
            number(s.steel.map(|s| s.loss.value)),
            number(s.steel.map(|s| s.loss.std_error)),
            number(truth.map(|t| t.porosity)),
            number(truth.map(|t| t.damage)),
            number(truth.and_then(|t| t.score.dice)),
            number(truth.and_then(|t| t.score.f1)),
        ]);
    }
    table.text()
}

/// One row an item of evidence: the ledger.
#[must_use]
pub fn evidence_csv(prediction: &Prediction) -> String {
    let mut table = Table::new(&["member_id", "source", "item", "used", "why_not"]);
    for i in &prediction.items {
        table.row(&[
            i.member.clone(),
            i.source.to_owned(),
            i.item.clone(),
            i.used.to_string(),
            i.why.clone().unwrap_or_default(),
        ]);
    }
    table.text()
}

/// One row a defect.
#[must_use]
pub(crate) fn defects_csv(prediction: &Prediction) -> String {
    let mut table = Table::new(&[
        "member_id",
        "member",
        "defect",
        "from [1]",
        "to [1]",
        "angle [deg]",
        "size",
        "width [mm]",
        "length [m]",
        "area [m2]",
        "source",
        "item",
        "date",
        "course",
    ]);
    for (m, d) in prediction.members.iter().flat_map(|m| m.defects.iter().map(move |d| (m, d))) {
        table.row(&[
            m.id.clone(),
            m.name.clone(),
            d.kind.to_owned(),
            number(d.along.map(|a| a[0])),
            number(d.along.map(|a| a[1])),
            number(d.angle_deg),
            d.size.clone(),
            number(d.width_mm),
            number(d.length_m),
            number(d.area_m2),
            d.source.to_owned(),
            d.item.clone(),
            d.date.clone().unwrap_or_default(),
            d.change().unwrap_or_default(),
        ]);
    }
    table.text()
}
