//! Members coloured by damage, for other programs: glTF to look at, VTU to compute with.

use glam::DVec3;
use intrados_damage::verdict::Basis;
use intrados_mechanics::write::{Field, Grid};
use intrados_predict::Prediction;
use intrados_scene::{Scene, gltf::write_glb_with};
use intrados_stage::file::{Set, WriteError};
use serde_json::{Map, Value, json};

use crate::surface::{coloured, facets};

/// Writes `damage.glb` and `damage.vtu`; nothing where no member has a surface.
pub(super) fn write(
    files: &mut Set,
    scene: &Scene,
    prediction: &Prediction,
) -> Result<(), WriteError> {
    let facets = facets(scene);
    if facets.is_empty() {
        return Ok(());
    }
    let [glb, vtu] = ["damage.glb", "damage.vtu"];
    write_glb_with(&files.place(glb), &coloured(scene, &facets, prediction), &|member| {
        extras(prediction, member)
    })
    .map_err(|source| WriteError { path: files.folder().join(glb), source })?;
    let points: Vec<DVec3> = facets.iter().flat_map(|f| f.corners.map(|c| c.as_dvec3())).collect();
    let triangles: Vec<[u32; 3]> =
        (0..facets.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let regions: Vec<u32> = facets.iter().map(|f| f.member as u32).collect();
    let reading = |f: &crate::surface::Facet| {
        prediction.members.get(f.member).and_then(|m| m.zones.0[f.zone])
    };
    // What is not known is no number.
    let damage: Vec<f64> =
        facets.iter().map(|f| reading(f).map_or(f64::NAN, |r| r.value)).collect();
    let error: Vec<f64> =
        facets.iter().map(|f| reading(f).map_or(f64::NAN, |r| r.std_error)).collect();
    let zone: Vec<f64> = facets.iter().map(|f| f.zone as f64).collect();
    // 1 measured, 0 forecast.
    let basis = |f: &crate::surface::Facet| match prediction
        .members
        .get(f.member)
        .map(|m| m.zone_basis[f.zone])
    {
        Some(Basis::Measured) => 1.0,
        Some(Basis::Forecast) => 0.0,
        _ => f64::NAN,
    };
    let measured: Vec<f64> = facets.iter().map(basis).collect();
    let truth = |f: &crate::surface::Facet| {
        prediction.members.get(f.member)?.truth.as_ref()?.zones.map(|z| z[f.zone])
    };
    let truths: Vec<f64> = facets.iter().map(|f| truth(f).unwrap_or(f64::NAN)).collect();
    let field = |name, values| Field { name, components: 1, values };
    let mut fields = vec![
        field("damage_1", damage.as_slice()),
        field("damage_std_error_1", &error),
        field("zone", &zone),
        field("measured", &measured),
    ];
    if truths.iter().any(|t| t.is_finite()) {
        fields.push(field("true_damage_1", &truths));
    }
    Grid::triangles(&points, &triangles, &regions)
        .of_scene(&scene.hash)
        .write(&files.place(vtu), &[], &fields)
        .map_err(|e| WriteError { path: files.folder().join(vtu), source: e.source })
}

/// What `extras.intrados` says of a member beyond what it is.
fn extras(prediction: &Prediction, member: usize) -> Map<String, Value> {
    let Some(m) = prediction.members.get(member) else { return Map::new() };
    let said = json!({
        "damage": m.damage, "damage_std_error": m.damage_std_error, "state": m.state, "state_probability": m.state_probability, "basis": m.basis, "zone_basis": m.zone_basis, "conflict": m.conflict,
        "zones": m.zones.0.map(|r| r.map(|r| r.value)), "profile": prediction.profile.name,
        "scene_hash": prediction.scene_hash, "version": prediction.version,
    });
    if let Value::Object(said) = said { said } else { Map::new() }
}
