//! A tunnel that came as segments bears as the ring that they close: against the thin ring by hand.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::{f64::consts::TAU, fmt::Write};

use intrados_mechanics::{
    analysis::analyze,
    member::{Axes, Meshing, Prepared, prepare},
    model::{MarchSettings, Point, System},
    tensor::{cylindrical, rotate_stress},
};
use intrados_scene::{
    MemberKind, Scene,
    import::{Told, import},
};
use intrados_stage::{Access, Job};

/// Intrados and extrados, m, and the length of a ring.
const INNER: f64 = 2.75;
const OUTER: f64 = 3.0;
const RING: f64 = 1.5;
/// From inside, Pa: no more than concrete bears in tension.
const PRESSURE: f64 = 100e3;

/// Segments of a ring as an OBJ file has them, each a closed body of its own, from `z` on; `open`
/// leaves so many out.
fn segments(ring: usize, count: usize, open: usize) -> String {
    const STEPS: usize = 12;
    let mut text = String::new();
    let z = ring as f64 * RING;
    for s in 0..count - open {
        let _ = writeln!(text, "o tunnel segment {} {}", ring + 1, s + 1);
        for k in 0..=STEPS {
            let turn = TAU * (s as f64 + k as f64 / STEPS as f64) / count as f64;
            for (radius, at) in [(INNER, z), (OUTER, z), (OUTER, z + RING), (INNER, z + RING)] {
                let _ = writeln!(text, "v {} {} {at}", radius * turn.cos(), radius * turn.sin());
            }
        }
        let first = 4 * (STEPS + 1) * (ring * (count - open) + s) + 1;
        let mut quad = |[a, b, c, d]: [usize; 4]| {
            let _ = writeln!(text, "f {} {} {} {}", first + a, first + b, first + c, first + d);
        };
        for k in (0..4 * STEPS).step_by(4) {
            for side in 0..4 {
                let next = (side + 1) % 4;
                quad([k + side, k + 4 + side, k + 4 + next, k + next]);
            }
        }
        quad([0, 1, 2, 3]);
        quad([3, 2, 1, 0].map(|corner| 4 * STEPS + corner));
    }
    text
}

/// Imported, with what the ground does replaced by an even pressure and by springs that hardly hold
/// the ring from turning.
fn imported(model: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let (path, out) = (folder.path().join("tunnel.obj"), folder.path().join("out"));
    std::fs::write(&path, model).unwrap();
    let told = Told { metres: Some(1.0), ..Told::default() };
    let job = Job::default();
    import(&path, &out, &told, &Access::default(), &job).unwrap();
    let scene = std::fs::read_to_string(out.join("scene.ron")).unwrap();
    let (start, rest) = scene.split_once("    loads: [").unwrap();
    let (_, end) = rest.split_once("    ],\n").unwrap();
    let ground = ", ground: (model: Springs(radial_mpa_m: 40, tangential_mpa_m: 13))";
    let springs = "Springs(stiffness_mpa_m: (1, 1, 100))";
    let start =
        start.replace(ground, "").replace("Directions(x: false, y: false, z: true)", springs);
    let pressure = format!(
        "(name: \"water\", action: InnerPressure(pressure_kpa: {}), history: [(28, 0), (29, 1)])",
        1e-3 * PRESSURE
    );
    std::fs::write(out.join("scene.ron"), format!("{start}    loads: [{pressure}],\n{end}"))
        .unwrap();
    Scene::load(&out.join("scene.ron"), &job).unwrap()
}

/// Mean hoop stress over the wall, Pa: bricks are alike in thickness, angle and length.
fn hoop(prepared: &Prepared, axes: &Axes) -> f64 {
    let settings = MarchSettings::default();
    let (outcome, history) = analyze(prepared, settings, &Job::default(), &mut ()).unwrap();
    assert!(outcome.complaint.is_empty(), "{}", outcome.complaint);
    let system = System::new(&prepared.model).unwrap();
    let mesh = &prepared.model.mesh;
    let [start, along] = [axes.start, axes.unit[2]].map(|v| v.to_array());
    let of_brick = |(hex, points): (u32, [Point; 8])| {
        let frame = cylindrical(mesh.centre(hex).to_array(), start, along);
        points.map(|point| rotate_stress(&point.stress, &frame)[1]).iter().sum::<f64>() / 8.0
    };
    let points = system.all_points(&history).unwrap();
    let count = points.len() as f64;
    (0..).zip(points).map(of_brick).sum::<f64>() / count
}

/// Whatever the wall is made of, half a ring is pulled apart by N = p r of each metre: over the
/// wall's thickness that is its mean hoop stress.
#[test]
fn a_ring_of_segments_carries_pressure_as_hoop_force() {
    let scene = imported(&[segments(0, 6, 0), segments(1, 6, 0)].concat());
    let rings: Vec<_> = scene.members.iter().map(|m| (m.kind, m.frame.axis.length())).collect();
    assert_eq!(rings.len(), 2, "{rings:?}");
    for (kind, length) in &rings {
        assert!(*kind == MemberKind::Lining && (length - 1.5).abs() < 1e-4, "{rings:?}");
    }
    let assembly = &scene.structure.assemblies[0];
    assert!(assembly.is_tunnel());
    let mut prepared = prepare(&scene, assembly, Meshing::default(), &Job::default()).unwrap();
    // Concrete bears all, on the day after the pressure has come.
    prepared.model.steel.clear();
    prepared.times.retain(|&t| t <= 29.5 * 86_400.0);
    let mean = hoop(&prepared, &Axes::of(&assembly.frame));
    let by_hand = PRESSURE * INNER / (OUTER - INNER);
    assert!((mean / by_hand - 1.0).abs() < 0.01, "{mean} {by_hand}");
}

/// Five of six segments close no ring: each is what it was.
#[test]
fn an_open_ring_stays_in_its_segments() {
    let scene = imported(&segments(0, 6, 1));
    assert_eq!(scene.members.len(), 5);
    assert!(scene.members.iter().all(|m| m.kind == MemberKind::Segment));
}
