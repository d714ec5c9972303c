//! The steel pipe of a lining: what it bears of the inner pressure, and what heat and moved ends do
//! to it, by hand.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use intrados_mechanics::{
    analysis::{PipeOutcome, analyze},
    member::{Meshing, prepare},
    model::{Elastic, MarchSettings, Matter},
};
use intrados_scene::Scene;
use intrados_stage::Job;

/// Intrados, extrados, length, wall and cushion, m.
const INNER: f64 = 2.75;
const OUTER: f64 = 3.25;
const LENGTH: f64 = 4.0;
const WALL: f64 = 0.02;
const CUSHION: f64 = 0.05;
/// Steel (EN 1993-1-1, 3.2.6), and the concrete of these tests, Pa.
const STEEL: f64 = 210e9;
const CONCRETE: f64 = 30e9;

/// What becomes of the pipe of a tunnel whose ends, and those of the pipe, stay where they are
/// along it, under a load from day 10 to 11; its concrete is elastic. The start of the lining is held
/// in all directions where the pipe hands nothing on to it.
fn pipe(cushion_mpa: f64, action: &str, holds_end: bool) -> PipeOutcome {
    let hold = |place: &str| {
        format!("(member: \"T\", place: {place}, hold: Directions(x: false, y: false, z: true))")
    };
    let mut places = vec!["Start", "End", "Pipe(0)"];
    places.extend(holds_end.then_some("Pipe(1)"));
    let mut supports: Vec<String> = places.into_iter().map(hold).collect();
    if cushion_mpa < 1.0 {
        supports[0] = "(member: \"T\", place: Start, hold: Fixed)".into();
    }
    let text = format!(
        "(schema: \"intrados.scene/1\", members: [(id: \"T\", at: (0, 0, 0), concrete: \"C30/37\", body: Tunnel(radius_m: {INNER}, length_m: {LENGTH}, \
         inner_lining: (thickness_m: {}), pipe: (thickness_mm: {}, cushion_mm: {}, cushion_mpa: {cushion_mpa}), \
         ground: (model: Springs(radial_mpa_m: 0.001, tangential_mpa_m: 0.001))))], supports: [{}], \
         loads: [(name: \"it\", action: {action}, history: [(10, 0), (11, 1)])])",
        OUTER - INNER,
        1e3 * WALL,
        1e3 * CUSHION,
        supports.join(", ")
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tunnel.ron");
    std::fs::write(&path, text).unwrap();
    let job = Job::default();
    let scene = Scene::load(&path, &job).unwrap();
    let tunnel = scene.structure.assembly("T").unwrap();
    let mut prepared = prepare(&scene, tunnel, Meshing { element: Some(0.25) }, &job).unwrap();
    for body in &mut prepared.model.bodies {
        if matches!(body.matter, Matter::Concrete(_)) {
            let law = Elastic { modulus: CONCRETE, poisson: 0.2, expansion: 0.0, density: 0.0 };
            body.matter = Matter::Elastic(law);
        }
    }
    let (outcome, _) = analyze(&prepared, MarchSettings::default(), &job, &mut ()).unwrap();
    assert!(outcome.complaint.is_empty(), "{}", outcome.complaint);
    outcome.members[0].pipe.unwrap()
}

/// Nothing moves along it. The wall, E t/(1 − ν²) u/r; the cushion, E_c/t_c; the lining, Lamé.
#[test]
fn pipe_cushion_and_lining_share_the_inner_pressure() {
    let pressure = 1e6;
    let [radius, middle] = [INNER - CUSHION - 0.5 * WALL, INNER - 0.5 * CUSHION - 0.25 * WALL];
    for cushion_mpa in [5.0, 500.0] {
        let found = pipe(cushion_mpa, "InnerPressure(pressure_kpa: 1000)", true);
        // Displacement by traction between, the pressure q a on the lining being q_m r_m.
        let lame = (1.0 + 0.2) / CONCRETE * (0.6 * INNER * INNER + OUTER * OUTER)
            / (OUTER * OUTER - INNER * INNER);
        let gives = CUSHION / (cushion_mpa * 1e6) + middle * lame;
        let wall = STEEL * WALL / (1.0 - 0.09) / radius;
        // p r − q r_m = E t/(1 − ν²) u/r and q = u/gives.
        let moved = pressure * radius / (wall + middle / gives);
        let around = wall * moved / WALL;
        let off = found.final_around_pa / around - 1.0;
        assert!(
            off.abs() < 0.01,
            "{cushion_mpa} MPa: {} and not {around} Pa",
            found.final_around_pa
        );
        let share = around * WALL / radius / pressure;
        println!(
            "cushion {cushion_mpa} MPa: the pipe bears {:.1} %, off {:.2} %",
            1e2 * share,
            1e2 * off
        );
        // Along it only Poisson's ratio acts.
        assert!((found.final_along_pa / (0.3 * around) - 1.0).abs() < 0.01, "{found:?}");
    }
}

/// The cushion hands on next to nothing: E α ΔT, and E δ/L.
#[test]
fn a_pipe_that_is_held_is_stressed_by_heat_and_by_its_ends() {
    let warm = pipe(0.1, "PipeTemperature(warmer_k: 20)", true);
    let by_hand = -STEEL * 1.2e-5 * 20.0;
    assert!((warm.final_along_pa / by_hand - 1.0).abs() < 0.01, "{warm:?} and not {by_hand}");
    assert!(warm.final_around_pa.abs() < 0.01 * by_hand.abs(), "{warm:?}");
    let pulled = "Displacement(place: Pipe(1), displacement_mm: (0, 0, 1))";
    let pulled = pipe(0.1, pulled, false);
    let by_hand = STEEL * 1e-3 / LENGTH;
    assert!((pulled.final_along_pa / by_hand - 1.0).abs() < 0.01, "{pulled:?} and not {by_hand}");
}

/// The bundled tunnel with a pipe until its water is in: the wall bears what is left to it by a
/// cushion that gives 6 mm a MPa, 83.5 MPa on a rigid lining and 84.1 on one of 33 GPa.
#[test]
fn the_pipe_of_the_bundled_tunnel_takes_the_water() {
    let job = Job::default();
    let scene = Scene::load_bundled("tunnel-pipe", &job).unwrap();
    let tunnel = scene.structure.assembly("T1").unwrap();
    let mut prepared = prepare(&scene, tunnel, Meshing { element: Some(0.4) }, &job).unwrap();
    prepared.times.retain(|&t| t < 120.5 * 86_400.0);
    let (outcome, _) = analyze(&prepared, MarchSettings::of_life(), &job, &mut ()).unwrap();
    assert!(outcome.complaint.is_empty(), "{}", outcome.complaint);
    let found = outcome.members[0].pipe.unwrap();
    assert!((80e6..90e6).contains(&found.final_around_pa), "{found:?}");
}
