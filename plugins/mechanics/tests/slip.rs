//! Bars that slip.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::f64::consts::PI;

use glam::DVec3;
use intrados_mechanics::{
    analysis::{Outcome, analyze},
    element::embed::embed,
    material::{bond::Bond, steel::Bar},
    member::{Meshing, prepare},
    mesh::Locator,
    model::{Slipping, Steel, SteelKind},
    prelude::*,
};
use intrados_scene::Scene;
use intrados_stage::Job;

/// A bar of 16 mm pulled out of rigid concrete at one end, the other free: s = F/(E A λ tanh λL)
/// with λ² = k U/(E A) while bond is linear; under a larger force it is pulled through, and no more
/// than bond bears can be carried.
#[test]
fn a_bar_is_pulled_out() {
    let (length, diameter) = (0.4, 0.016);
    let mesh = block(&divide(0.0, length, &[], 0.01), &[0.0, 0.1], &[0.0, 0.1], "block").unwrap();
    let elastic = Elastic { modulus: 30e9, poisson: 0.2, expansion: 1e-5, density: 0.0 };
    let mut model = Model {
        bodies: vec![Body { matter: Matter::Elastic(elastic), birth: f64::NEG_INFINITY }],
        ..Model::default()
    };
    model.holds = (0..mesh.nodes.len() as u32).flat_map(|n| (0..3).map(move |c| (n, c))).collect();
    let ends = [DVec3::new(1e-9, 0.05, 0.05), DVec3::new(length - 1e-9, 0.05, 0.05)];
    let pieces = {
        let locator = Locator::new(&mesh);
        embed(
            &ends,
            |p| locator.locate(p).map(|h| (h.hex as usize, h.natural)),
            |h| mesh.corners(h as u32),
        )
        .unwrap()
    };
    let (area, perimeter) = (0.25 * PI * diameter * diameter, PI * diameter);
    let bond = Bond::good(38e6, 8e-3);
    let slipping = Slipping { bond, perimeter, anchored: [false; 2] };
    let bar = Bar { yielding: f64::MAX, ..Bar::new(500e6).unwrap() };
    model.mesh = mesh;
    model.steel.push(Steel {
        name: "bar".into(),
        pieces,
        area,
        kind: SteelKind::Bar(bar),
        rust: None,
        gone: Vec::new(),
        bond: Some(slipping),
        displaces: false,
    });
    let end = System::new(&model).unwrap().slip_node(0, model.steel[0].pieces.len()).unwrap();
    let force = 100.0;
    let most = bond.strength * perimeter * length;
    model.loads.push(Load {
        name: "pull".into(),
        action: Action::Nodes(vec![(end, force * DVec3::X)]),
        history: vec![(0.0, 0.0), (1.0, 1.0), (2.0, 0.5 * most / force), (3.0, 1.1 * most / force)],
    });
    let structure = System::new(&model).unwrap();
    let mut march = March::new(
        &structure,
        structure.rest(0.0),
        Drive::Loads,
        MarchSettings { tolerance: 1e-9, ..MarchSettings::default() },
    );
    march.advance(1.0, 0.0, &Job::default(), |_, _| Ok(())).unwrap();
    let stiffness: f64 = 200e9 * area;
    let lambda = (bond.stiffness * perimeter / stiffness).sqrt();
    let (slip, expected) = (
        march.history.x[3 * end as usize],
        force / (stiffness * lambda * (lambda * length).tanh()),
    );
    assert!((slip / expected - 1.0).abs() < 0.01, "{slip} {expected}");
    let mut march = March::new(
        &structure,
        march.history,
        Drive::Loads,
        MarchSettings { tolerance: 1e-4, ..MarchSettings::default() },
    );
    march.advance(2.0, 0.0, &Job::default(), |_, _| Ok(())).unwrap();
    // Half of what it can carry: bond is past its line near the end, and softer than at first.
    let (found, linear) = (march.history.x[3 * end as usize], slip * 0.5 * most / force);
    assert!(found > 1.1 * linear && found < 3.0 * linear, "{found} {linear}");
    let carried: f64 = march.history.steel[0].iter().map(|w| w.stress * area).fold(0.0, f64::max);
    assert!((carried / (0.5 * most) - 1.0).abs() < 0.05, "{carried}");
    assert!(march.advance(3.0, 0.0, &Job::default(), |_, _| Ok(())).is_err());
}

fn scene_of(text: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    std::fs::write(&path, text).unwrap();
    Scene::load(&path, &Job::default()).unwrap()
}

/// The steel of a column of 2 m on a footing, cover 40 mm, with these bars.
fn column(reinforcement: &str) -> Vec<Steel> {
    let scene = scene_of(&format!(
        "(schema: \"intrados.scene/1\",
          members: [(id: \"C\", concrete: Some(\"C30/37\"), body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 2,
            reinforcement: (cover_mm: 40, {reinforcement})))],
          supports: [(member: \"C\", place: Start, hold: Fixed)])"
    ));
    let assembly = &scene.structure.assemblies[0];
    prepare(&scene, assembly, Meshing::default(), &Job::default()).unwrap().model.steel
}

/// Where a bar begins and ends above the footing, m.
fn heights(steel: &Steel) -> [f64; 2] {
    [steel.pieces[0].ends[0].y, steel.pieces[steel.pieces.len() - 1].ends[1].y]
}

/// Anchored and hooked ends do not slip and go on into the footing; straight ones slip, and end
/// where they are told.
#[test]
fn ends_of_bars_hold_as_the_scene_says() {
    for (ends, anchored, reaches) in [
        ("", [true, true], [0.0, 1.96]),
        (", ends: (Hooked, Straight)", [true, false], [0.0, 1.96]),
        (", ends: (Straight, Anchored)", [false, true], [0.04, 1.96]),
    ] {
        let bars = format!("bond: Slip, bars: [Around(count: 4, diameter_mm: 20{ends})]");
        for steel in column(&bars) {
            assert_eq!(steel.bond.as_ref().unwrap().anchored, anchored, "{ends}");
            let off = heights(&steel).into_iter().zip(reaches).map(|(a, b)| (a - b).abs());
            assert!(off.fold(0.0, f64::max) < 1e-4, "{ends}: {:?}", heights(&steel));
        }
    }
    // Where nothing slips, ends are all the same.
    let perfect = column("bars: [Around(count: 4, diameter_mm: 20, ends: (Straight, Straight))]");
    assert!(perfect.len() == 4 && perfect.iter().all(|steel| steel.bond.is_none()));
}

/// Starter bars come out of the footing and end above it; the bars of the column stand on it.
#[test]
fn starter_bars_begin_in_the_footing_and_end_above_it() {
    let steel = column(
        "bond: Slip, bars: [
            Around(count: 4, diameter_mm: 20, to: 0.4, ends: (Anchored, Straight)),
            Around(count: 4, diameter_mm: 16, from: 0.1, ends: (Straight, Anchored)),
        ]",
    );
    assert_eq!(steel.len(), 8);
    for (steel, wanted) in steel.iter().zip([[0.0, 0.8]; 4].into_iter().chain([[0.2, 1.96]; 4])) {
        let off = heights(steel).into_iter().zip(wanted).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-4, "{}: {:?}", steel.name, heights(steel));
    }
}

/// A beam of a scene that cracks, 3 m long, three bars of 16 mm.
fn cracked(bond: &str, element: f64) -> Outcome {
    let scene = scene_of(&format!(
        "(schema: \"intrados.scene/1\",
          members: [(id: \"B\", concrete: Some(\"C30/37\"), at: (0, 0, 0), body: Beam(section: Rectangle(width_m: 0.2, depth_m: 0.3), length_m: 3,
            reinforcement: (cover_mm: 30, bond: {bond}, bars: [Row(side_deg: 180, count: 3, diameter_mm: 16)])))],
          supports: [(member: \"B\", place: Surface(from: 0, to: 0, side_deg: 180), hold: Fixed),
            (member: \"B\", place: Surface(from: 1, to: 1, side_deg: 180), hold: Directions(x: false, y: true, z: true))],
          loads: [(name: \"load\", action: Line(force_kn_m: (0, -15, 0)), history: [(28, 0), (29, 1)])])"
    ));
    let prepared = prepare(
        &scene,
        &scene.structure.assemblies[0],
        Meshing { element: Some(element) },
        &Job::default(),
    )
    .unwrap();
    analyze(&prepared, MarchSettings::of_life(), &Job::default(), &mut ()).unwrap().0
}

/// Bars that may slip converge like bars that may not, and the beam deflects as much: bond is stiff
/// against what cracks do. No bar yields.
#[test]
fn a_scene_with_slipping_bars_finds_its_equilibria() {
    for element in [0.15, 0.1] {
        let [perfect, slipping] = ["Perfect", "Slip"].map(|bond| cracked(bond, element));
        for (bond, outcome) in [("perfect", &perfect), ("slip", &slipping)] {
            assert!(outcome.complaint.is_empty(), "{element}, {bond}: {}", outcome.complaint);
            assert!(
                outcome.members[0].max_damage > 0.5
                    && outcome.members[0].peak_bar_stress_pa < 500e6,
                "{:?}",
                outcome.members[0]
            );
        }
        let [stiff, soft] =
            [&perfect, &slipping].map(|o| o.steps.last().unwrap().max_displacement_m);
        assert!((soft / stiff - 1.0).abs() < 0.2, "{stiff} {soft}");
    }
}
