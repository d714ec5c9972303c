//! Members of the bundled scenes, from the file to stresses.

use intrados_mechanics::{
    analysis::analyze,
    member::{Meshing, Prepared, prepare},
    model::{Gauge, Settings, Structure},
};
use intrados_scene::Scene;
use intrados_stage::Job;

fn prepared(scene: &str, id: &str, element: f64) -> Prepared {
    let scene = Scene::load_bundled(scene, &Job::default()).unwrap();
    let member = scene.file.members.iter().find(|m| m.id == id).unwrap();
    prepare(&scene, member, Meshing { element: Some(element) }).unwrap()
}

/// C1 carries 1.6 MN and its own weight: the foot bears just that, and in the course of 35 years concrete hands over to the bars as the age-adjusted modulus
/// foresees (some −7 MPa and −200 MPa; AAEM with φ = 2.2 and ε_sh = −4e-4).
#[test]
fn a_column_hands_its_load_to_its_bars() {
    let prepared = prepared("column", "C1", 0.2);
    let (outcome, history) = analyze(&prepared, Settings { tolerance: 1e-3, ..Settings::default() }, &Job::default(), &mut ()).unwrap();
    assert!(outcome.complaint.is_empty() && outcome.steps.iter().all(|s| s.converged), "{outcome:?}");
    let structure = Structure::new(&prepared.model).unwrap();
    let foot: f64 = structure.prescribed(history.time, None).iter().filter(|p| p.1 == 1).map(|p| history.force[3 * p.0 as usize + 1]).sum();
    let weight = 0.4 * 0.4 * 3.0 * 2400.0 * 9.81;
    assert!((foot / (1.6e6 + weight) - 1.0).abs() < 2e-3, "the foot bears {foot} N");
    let member = &outcome.members[0];
    assert!((150e6..260e6).contains(&member.peak_bar_stress_pa), "{member:?}");
    assert!((-16e6..-7e6).contains(&member.peak_compression_pa), "{member:?}");
}

/// Half of a box girder is poured a week after the other, and both tendons are stressed after two: their losses add up.
#[test]
fn tendons_tell_where_their_stress_went() {
    let mut prepared = prepared("beam", "G1", 0.5);
    // Until a week after jacking.
    prepared.times.retain(|&t| t < 21.0 * 86_400.0);
    let (outcome, _) =
        analyze(&prepared, Settings { tolerance: 1e-3, loose: 10.0, ..Settings::default() }, &Job::default(), &mut ()).unwrap();
    assert!(outcome.complaint.is_empty(), "{}", outcome.complaint);
    let tendons = &outcome.members[0].tendons;
    assert_eq!(tendons.len(), 2);
    for t in tendons {
        let lost = t.losses.friction_and_slip_pa + t.losses.relaxation_pa + t.losses.concrete_pa;
        assert!((t.final_stress_pa + lost - 1395e6).abs() < 1.0, "{t:?}");
        assert!(t.losses.friction_and_slip_pa > 50e6 && t.losses.relaxation_pa > 1e6 && t.losses.concrete_pa > 1e6, "{t:?}");
    }
}

/// Gauges sit where the scene says: on the surface, along its directions.
#[test]
fn gauges_are_found() {
    let column = prepared("column", "C4", 0.2);
    assert_eq!(column.gauges.len(), 2);
    for (name, gauge) in &column.gauges {
        let Gauge::Strain(host, direction) = gauge else { panic!("{name} is no strain gauge") };
        let corners = column.model.mesh.corners(host.hex);
        let at = intrados_mechanics::element::hex8::position(&corners, host.natural);
        let front = if name.ends_with('1') { 0.2 } else { -0.2 };
        assert!((at.z - (-1.7 + front)).abs() < 1e-4 && (at.y - 0.6).abs() < 1e-6, "{name} at {at}");
        assert!((direction.y - 1.0).abs() < 1e-9);
    }
}
