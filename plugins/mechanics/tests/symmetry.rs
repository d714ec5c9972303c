//! Planes of symmetry: half of a member answers as all of it does.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::DVec3;
use intrados_mechanics::{
    material::DAY,
    member::{MemberError, Meshing, Prepared, prepare},
    model::{CONDUCTED, Steel, SteelKind},
    prelude::*,
};
use intrados_scene::Scene;
use intrados_stage::Job;

/// The first member of a scene of this text.
fn prepared(text: &str, element: f64) -> Result<Prepared, MemberError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    std::fs::write(&path, format!("(schema: \"intrados.scene/1\", {text})")).unwrap();
    let scene = Scene::load(&path, &Job::default()).unwrap();
    let meshing = Meshing { element: Some(element) };
    prepare(&scene, &scene.structure.assemblies[0], meshing, &Job::default())
}

/// What holds the end of a beam.
fn end(hold: &str) -> String {
    format!("(member: \"B\", place: End, hold: {hold})")
}

/// How far an elastic beam moves up 2 m from its start, m, and what its nodes take at the bearing
/// .25 m from there, N: under its own weight, and a force (kN) at a share of its axis.
fn answer(length: f64, held: &str, force: f64, at: f64) -> [f64; 2] {
    let bearing = 0.25 / length;
    let text = format!(
        "members: [(id: \"B\", at: (0, 0, 0), concrete: \"C30/37\", body: Beam(section: Rectangle(width_m: 0.2, depth_m: 0.4), length_m: {length}))],
         supports: [(member: \"B\", place: Surface(from: {bearing}, to: {bearing}, side_deg: 180), hold: Directions(x: false, y: true, z: true)), {held}],
         loads: [(name: \"weight\", action: SelfWeight, history: [(0, 0), (1, 1)]),
            (name: \"jack\", action: Force(place: Section({at}), force_kn: (0, {force}, 0)), history: [(0, 0), (1, 1)])]"
    );
    let mut model = prepared(&text, 0.11).unwrap().model;
    let elastic = Elastic { modulus: 30e9, poisson: 0.2, expansion: 1e-5, density: 2400.0 };
    model.bodies = vec![Body { matter: Matter::Elastic(elastic), birth: f64::NEG_INFINITY }];
    let system = System::new(&model).unwrap();
    let settings = MarchSettings { tolerance: 1e-9, ..MarchSettings::default() };
    let mut march = March::new(&system, system.rest(0.0), Drive::Loads, settings);
    march.advance(DAY, 0.0, &Job::default(), |_, _| Ok(())).unwrap();
    let nodes = &model.mesh.nodes;
    let middle = (0..nodes.len()).filter(|&n| (nodes[n].x - 2.0).abs() < 1e-6);
    let [sum, count] = middle.fold([0.0; 2], |[s, c], n| [s + march.history.x[3 * n + 1], c + 1.0]);
    let held = system.prescribed(DAY);
    let bearing = held.iter().filter(|h| h.1 == 1 && nodes[h.0 as usize].x < 1.0);
    let taken = bearing.map(|h| march.history.force[3 * h.0 as usize + 1]).sum();
    [sum / count, taken]
}

/// A simple beam under its weight and a force in its middle, of which half acts on the half: on the
/// same bricks the halves do the same. By hand 5 w l⁴/(384 E I) + P l³/(48 E I), and some shear.
#[test]
fn half_of_a_beam_bends_as_all_of_it_does() {
    let other = "(member: \"B\", place: Surface(from: 0.9375, to: 0.9375, side_deg: 180), hold: Directions(x: true, y: true, z: true))";
    let whole = answer(4.0, other, -10.0, 0.5);
    let half = answer(2.0, &end("Symmetry"), -5.0, 1.0);
    for (half, whole) in half.iter().zip(whole) {
        assert!((half / whole - 1.0).abs() < 1e-6, "{half} {whole}");
    }
    let (stiffness, span, weight) =
        (30e9 * 0.2 * 0.4_f64.powi(3) / 12.0, 3.5_f64, 0.08 * 2400.0 * 9.81);
    let by_hand =
        5.0 * weight * span.powi(4) / (384.0 * stiffness) + 1e4 * span.powi(3) / (48.0 * stiffness);
    assert!((0.95..1.1).contains(&(-half[0] / by_hand)), "{} {by_hand}", half[0]);
}

/// Places of a thick column that hardens and cools, and how much warmer they are at every moment.
fn cooling(height: f64, held: &str) -> (Vec<DVec3>, Vec<Vec<f64>>) {
    let text = format!(
        "concretes: [(name: \"mass\", fck_mpa: 30, hydration: Some((cement_kg_m3: 400)))],
         members: [(id: \"B\", at: (0, 0, 0), concrete: \"mass\", body: Column(section: Rectangle(width_m: 1.2, depth_m: 1.2), height_m: {height}))],
         supports: [(member: \"B\", place: Bottom, hold: Fixed), {held}],
         loads: [(name: \"weight\", action: SelfWeight, history: [(3, 0), (4, 1), (40, 1)])]"
    );
    // A little more than a quarter of the half, so that rounding adds no brick.
    let model = prepared(&text, 0.31).unwrap().model;
    let of = |load: Load| match load.action {
        Action::Temperature(field) if load.name == CONDUCTED => Some(field),
        _ => None,
    };
    (model.mesh.nodes, model.loads.into_iter().filter_map(of).collect())
}

/// Nothing warm leaves through the plane: the half cools as that half of the whole does, and else
/// by degrees faster near its end.
#[test]
fn half_of_a_member_cools_as_all_of_it_does() {
    let (places, whole) = cooling(2.4, "");
    let off = |held: &str| {
        let (own, half) = cooling(1.2, held);
        assert!(half.len() == whole.len() && !whole.is_empty(), "{} {}", half.len(), whole.len());
        let same = |p: &DVec3| places.iter().position(|q| q.distance(*p) < 1e-6).unwrap();
        let same: Vec<usize> = own.iter().map(same).collect();
        let each = half.iter().zip(&whole).flat_map(|(half, whole)| {
            half.iter().zip(&same).map(move |(warmer, &n)| (warmer - whole[n]).abs())
        });
        each.fold(0.0, f64::max)
    };
    let mirrored = off(&end("Symmetry"));
    assert!(mirrored < 1e-4, "{mirrored}");
    let open = off(&end("Directions(x: false, y: true, z: false)"));
    assert!(open > 1.0, "{open}");
}

/// A bar's first and last place along the beam, m.
fn reach(steel: &Steel) -> [f64; 2] {
    [steel.pieces[0].ends[0].x, steel.pieces[steel.pieces.len() - 1].ends[1].x]
}

/// Whatever a bar's end is like, it is none in the plane; where bars end before it, they do.
#[test]
fn bars_run_on_through_the_plane_and_do_not_slip_there() {
    for (ends, first) in [
        ("(Anchored, Anchored)", true),
        ("(Hooked, Hooked)", true),
        ("(Straight, Straight)", false),
    ] {
        let text = format!(
            "members: [(id: \"B\", at: (0, 0, 0), concrete: \"C30/37\", body: Beam(section: Rectangle(width_m: 0.3, depth_m: 0.5), length_m: 2,
                reinforcement: (cover_mm: 40, bond: Slip, bars: [
                    Row(side_deg: 180, count: 2, diameter_mm: 16, ends: {ends}),
                    Row(side_deg: 0, count: 2, diameter_mm: 16, to: 0.5, ends: {ends}),
                ])))],
             supports: [(member: \"B\", place: Bottom, hold: Directions(x: false, y: true, z: true)), {}]",
            end("Symmetry")
        );
        let steel = prepared(&text, 0.1).unwrap().model.steel;
        let [through, _, short, _] = &steel[..] else { panic!("{}", steel.len()) };
        let anchored = |steel: &Steel| steel.bond.as_ref().unwrap().anchored;
        assert_eq!([anchored(through), anchored(short)], [[first, true], [first; 2]], "{ends}");
        let off = |steel: &Steel, at: f64| (reach(steel)[1] - at).abs();
        assert!(off(through, 2.0) < 1e-4 && off(short, 1.0) < 1e-4, "{ends}");
        assert!((reach(through)[0] - 0.04).abs() < 1e-4, "{ends}: {:?}", reach(through));
    }
}

/// A beam with a straight tendon whose duct wobbles.
fn stressed(length: f64, held: &str, both_ends: bool) -> Result<Prepared, MemberError> {
    let text = format!(
        "members: [(id: \"B\", at: (0, 0, 0), concrete: \"C30/37\", body: Beam(section: Rectangle(width_m: 0.3, depth_m: 0.6), length_m: {length},
            tendons: [(name: \"T\", duct_mm: 45, line: [(0, -0.13, 0), (0.5, -0.13, 0), (1, -0.13, 0)],
                prestress: (strands: 4, strand_mm2: 100, stress_mpa: 1300, at_days: 14, both_ends: {both_ends}))]))],
         supports: [(member: \"B\", place: Bottom, hold: Directions(x: false, y: true, z: true)), {held}]"
    );
    prepared(&text, 0.1)
}

/// Of its tendon: where the middles of its pieces are, m, with their stress, Pa, and whether its ends
/// press on plates.
fn tendon(prepared: &Prepared) -> (Vec<(f64, f64)>, [bool; 2]) {
    let tendon = |steel: &Steel| {
        let SteelKind::Tendon(tendon) = &steel.kind else { return None };
        let middles = steel.pieces.iter().map(|p| 0.5 * (p.ends[0].x + p.ends[1].x));
        let plates = [0, 1].map(|end| tendon.plates[end].is_some());
        Some((middles.zip(tendon.stress.iter().copied()).collect::<Vec<_>>(), plates))
    };
    prepared.model.steel.iter().find_map(tendon).unwrap()
}

/// A tendon that is stressed from both ends loses most in the middle, P = P₀ e^(−μ k s) with s from
/// the end that is nearer: its halves are stressed from their own ends alone, and nothing anchors
/// them in the plane.
#[test]
fn half_of_a_tendon_is_stressed_from_its_own_end() {
    let middle =
        "(member: \"B\", place: Section(0.5), hold: Directions(x: true, y: false, z: false))";
    let from_start = |at: f64, _: f64| at;
    let from_end = |at: f64, length: f64| length - at;
    let nearer = |at: f64, length: f64| from_start(at, length).min(from_end(at, length));
    let is = |length: f64, held: &str, way: &dyn Fn(f64, f64) -> f64, wanted: [bool; 2]| {
        let (pieces, plates) = tendon(&stressed(length, held, true).unwrap());
        assert_eq!(plates, wanted, "{held}");
        for (at, stress) in pieces {
            let by_hand = 1300e6 * (-0.19 * 0.005 * way(at, length)).exp();
            assert!((stress / by_hand - 1.0).abs() < 1e-5, "{held} {at}: {stress} {by_hand}");
        }
    };
    is(4.0, middle, &nearer, [true; 2]);
    is(2.0, &end("Symmetry"), &from_start, [true, false]);
    is(2.0, "(member: \"B\", place: Start, hold: Symmetry)", &from_end, [false, true]);
}

#[test]
fn what_is_not_symmetric_is_refused() {
    let refused = |held: &str, both_ends: bool| {
        stressed(2.0, held, both_ends).map(drop).unwrap_err().to_string()
    };
    let one = refused(&end("Symmetry"), false);
    assert!(one.contains("T: it runs through") && one.contains("both_ends: true"), "{one}");
    let start = "(member: \"B\", place: Start, hold: Symmetry)";
    let both = refused(&format!("{start}, {}", end("Symmetry")), true);
    assert!(both.contains("from one plane of symmetry to another"), "{both}");
    let askew = format!(
        "members: [(id: \"B\", turn_deg: 30, body: Beam(section: Rectangle(width_m: 0.3, depth_m: 0.6), length_m: 2))], supports: [{start}]"
    );
    let askew = prepared(&askew, 0.2).map(drop).unwrap_err().to_string();
    assert!(askew.contains("(Start) lies askew") && askew.contains("along x, y or z"), "{askew}");
}

/// Who reads its forces is told once of what they are.
#[test]
fn a_half_says_that_it_is_one() {
    let notes = stressed(2.0, &end("Symmetry"), true).unwrap().notes;
    assert_eq!(notes.iter().filter(|n| n.contains("plane of symmetry")).count(), 1, "{notes:?}");
    let middle = "(member: \"B\", place: Start, hold: Directions(x: true, y: false, z: false))";
    let notes = stressed(2.0, middle, true).unwrap().notes;
    assert!(notes.iter().all(|n| !n.contains("symmetry")), "{notes:?}");
}
