//! What is seen of a cracked beam from outside.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::{DVec3, Vec3};
use intrados_mechanics::{
    analysis::analyze,
    material::durability::CorrosionError,
    member::{Part, Prepared},
    prelude::*,
    skin::{Looking, Seen, Skin},
};
use intrados_scene::MemberKind;
use intrados_stage::Job;

const SPAN: f64 = 0.75;
/// Width and depth, m; y is up.
const SECTION: [f64; 2] = [0.1, 0.2];
/// Edge of an element, m.
const EDGE: f64 = 0.05;

/// A beam of plain concrete in three-point bending, 15 × 4 × 2 bricks, the column of bricks in the
/// middle a little weaker; pushed down by .12 mm.
fn beam() -> Prepared {
    let [width, depth] = SECTION;
    let lines = |to: f64| divide(0.0, to, &[], EDGE);
    let mut mesh = block(&lines(SPAN), &lines(depth), &lines(width), "beam").unwrap();
    mesh.assign("weak", |c| (c.x - 0.5 * SPAN).abs() < 0.5 * EDGE);
    let concrete = |fctm: f64| {
        let given = Given {
            fcm: Some(38e6),
            fctm: Some(fctm),
            modulus: Some(32e9),
            fracture_energy: Some(120.0),
            ..Given::default()
        };
        Body {
            matter: Matter::Concrete(Box::new((
                given.complete().unwrap(),
                Setting::short_term(EDGE),
            ))),
            birth: f64::NEG_INFINITY,
        }
    };
    let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
    let nodes = |keep: &dyn Fn(DVec3) -> bool| {
        (0..mesh.nodes.len() as u32).filter(|&n| keep(mesh.nodes[n as usize])).collect::<Vec<_>>()
    };
    let mut holds: Vec<_> = nodes(&|p| near(p.y, 0.0) && (near(p.x, 0.0) || near(p.x, SPAN)))
        .into_iter()
        .map(|n| (n, 1))
        .collect();
    holds.extend(nodes(&|p| near(p.y, 0.0) && near(p.x, 0.0)).into_iter().map(|n| (n, 0)));
    holds.extend(
        nodes(&|p| near(p.y, 0.0) && near(p.z, 0.0) && (near(p.x, 0.0) || near(p.x, SPAN)))
            .into_iter()
            .map(|n| (n, 2)),
    );
    let top = nodes(&|p| near(p.y, depth) && (p.x - 0.5 * SPAN).abs() < 0.51 * EDGE);
    let push = Action::Displacement(top.into_iter().map(|n| (n, 1, -1.2e-4)).collect());
    let part = Part {
        id: "B".into(),
        kind: MemberKind::Beam,
        hexes: (0..mesh.hexes.len() as u32).collect(),
        has_steel: false,
        assumed: false,
        geometry: None,
    };
    let loads =
        vec![Load { name: "push".into(), action: push, history: vec![(0.0, 0.0), (1.0, 1.0)] }];
    let model = Model {
        bodies: vec![concrete(3.0e6), concrete(2.7e6)],
        mesh,
        holds,
        loads,
        ..Model::default()
    };
    let times = (0..=12).map(|k| f64::from(k) / 12.0).collect();
    Prepared {
        id: "B".into(),
        model,
        begin: 0.0,
        times,
        parts: vec![part],
        axis: None,
        direction: DVec3::X,
        mirrored: vec![],
        raised: None,
        gauges: vec![],
        corrosion: Err(CorrosionError::NoBars),
        attacked: 0.0,
        warnings: vec![],
        notes: vec![],
    }
}

/// One crack, where moment and weakness are, across the axis: up one side, through the soffit, up
/// the other side; as wide as its bricks say, as deep as they are cracked, and nothing before the
/// load.
#[test]
fn a_bent_beam_shows_one_crack() {
    let prepared = beam();
    let mesh = &prepared.model.mesh;
    let mut looking = Looking::new(&prepared, Seen::default());
    let settings = MarchSettings { tolerance: 1e-4, ..MarchSettings::default() };
    let (outcome, history) = analyze(&prepared, settings, &Job::default(), &mut looking).unwrap();
    assert!(outcome.complaint.is_empty(), "{}", outcome.complaint);
    let points = System::new(&prepared.model).unwrap().all_points(&history).unwrap();
    let left = looking.last();
    let [damage] = &left[..] else { panic!("{left:?}") };
    assert!(damage.member == "B" && damage.spalls.is_empty());
    // Traces of soffit and sides are one crack, not one a face.
    let [crack] = &damage.cracks[..] else { panic!("{:#?}", damage.cracks) };
    assert!(crack.normal.x.abs() > 0.99, "{}", crack.normal);
    let within = |p: Vec3| (f64::from(p.x) - 0.5 * SPAN).abs() <= 0.5 * EDGE;
    assert!(crack.mouth.iter().all(|m| within(m.at)), "{crack:?}");
    let reached = |outward: Vec3| crack.mouth.iter().any(|m| m.outward.dot(outward) > 0.9);
    assert!(
        reached(Vec3::NEG_Y) && reached(Vec3::Z) && reached(Vec3::NEG_Z) && !reached(Vec3::Y),
        "{crack:?}"
    );
    let high = |z: f32| {
        crack.mouth.iter().filter(|m| (m.at.z - z).abs() < 1e-6).map(|m| m.at.y).fold(0.0, f32::max)
    };
    assert!(
        high(0.0) >= 0.05
            && (high(0.0) - high(SECTION[0] as f32)).abs() < 1e-6
            && high(0.0) < SECTION[1] as f32,
        "{crack:?}"
    );
    // Bricks of the weak column from below: mean opening of all their points, and of the four at
    // the soffit.
    let column = |j: usize| {
        let centre = DVec3::new(0.5 * SPAN, (j as f64 + 0.5) * EDGE, 0.5 * EDGE);
        (0..mesh.hexes.len()).find(|&h| mesh.centre(h as u32).distance(centre) < 1e-6).unwrap()
    };
    let opening = |j: usize| points[column(j)].iter().map(|p| p.crack).sum::<f64>() / 8.0;
    let widest = points.iter().flatten().map(|p| p.crack).fold(0.0, f64::max);
    let soffit = crack
        .mouth
        .iter()
        .filter(|m| m.outward.y < -0.99)
        .map(|m| f64::from(m.width))
        .fold(0.0, f64::max);
    assert!(
        soffit >= opening(0) && soffit <= widest * (1.0 + 1e-6),
        "{soffit} {} {widest}",
        opening(0)
    );
    // As deep as bricks are cracked at half of what can be seen.
    let cracked = (0..4).take_while(|&j| opening(j) >= 0.5 * 5e-5).count();
    let expected = (cracked as f64 * EDGE).max(SECTION[0]);
    assert!(
        (1..4).contains(&cracked) && (f64::from(crack.depth) - expected).abs() < 1e-6,
        "{} {cracked}",
        crack.depth
    );
    assert!(
        Skin::new(&prepared).surface_damage(
            &prepared,
            0.0,
            &vec![Default::default(); mesh.hexes.len()]
        )[0]
        .is_empty()
    );
}
