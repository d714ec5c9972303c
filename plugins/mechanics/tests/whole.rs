//! Scenes as one frame: from deck to ground.

#![allow(clippy::unwrap_used, reason = "a test may end by a panic")]

mod modelled;

use glam::{DVec3, Vec3};
use intrados_mechanics::{
    frame::{MemberForces, SectionForces, Whole, whole},
    member::{Meshing, Prepared, prepare_within},
    model::Action,
};
use intrados_scene::{
    MemberKind, Mesh, Scene,
    import::{Told, import},
};
use intrados_stage::{Access, Job};
use modelled::alone;

/// A scene of this text.
fn scene(text: &str) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("whole.ron");
    std::fs::write(&path, format!("(schema: \"intrados.scene/1\", {text})")).unwrap();
    Scene::load(&path, &Job::default()).unwrap()
}

fn computed(text: &str, redundancy: bool) -> Whole {
    let found = whole(&scene(text), redundancy, &Job::default()).unwrap();
    assert!(found.unbalanced < 1e-9, "unbalanced {}", found.unbalanced);
    found
}

fn column(id: &str, x: f64) -> String {
    format!(
        "(id: \"{id}\", at: ({x}, 0, 0), concrete: \"C30/37\", body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3))"
    )
}

/// A beam of .3 × .6 m whose soffit is on the columns' heads.
fn beam(id: &str, from: f64, to: f64) -> String {
    format!(
        "(id: \"{id}\", at: ({from}, 3.3, 0), concrete: \"C30/37\", body: Beam(section: Rectangle(width_m: 0.3, depth_m: 0.6), length_m: {}))",
        to - from
    )
}

fn held(ids: &[&str]) -> String {
    let each = ids.iter().map(|id| format!("(member: \"{id}\", place: Bottom, hold: Fixed)"));
    format!("supports: [{}],", each.collect::<Vec<_>>().join(", "))
}

const LINE: &str =
    "loads: [(name: \"deck\", members: [\"B\"], action: Line(force_kn_m: (0, -20, 0)))],";

fn member<'a>(whole: &'a Whole, id: &str) -> &'a MemberForces {
    whole.members.iter().find(|m| m.name == id).unwrap()
}

fn at(member: &MemberForces, x: f64) -> SectionForces {
    let off = |s: &&SectionForces| (s.at_m - x).abs();
    *member.along.iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap()
}

fn up(whole: &Whole, id: &str) -> f64 {
    whole.reactions.iter().filter(|r| r.member == id).map(|r| r.force_n[1]).sum()
}

fn near(found: f64, expected: f64, share: f64) -> bool {
    (found - expected).abs() <= share * expected.abs()
}

/// On a hinge and a bearing: q l²/8 − q a²/2 with l between the columns and a beyond them, and
/// nothing pushes the columns aside.
#[test]
fn a_beam_on_bearings_is_a_simple_beam() {
    let text = format!(
        "members: [{}, {}, {}], joints: [(of: (\"B\", \"A\"), kind: Hinge), (of: (\"B\", \"C\"), kind: Bearing)], {} {LINE}",
        column("A", 0.0),
        column("C", 8.0),
        beam("B", -0.2, 8.2),
        held(&["A", "C"])
    );
    let found = computed(&text, false);
    assert!(near(up(&found, "A"), 84e3, 1e-6) && near(up(&found, "C"), 84e3, 1e-6));
    let middle = at(member(&found, "B"), 4.2).m_z;
    assert!(near(middle, 20e3 * (8.0 - 0.5 * 0.04), 1e-3), "{middle}");
    assert!(found.reactions.iter().all(|r| r.force_n[0].abs() < 1.0), "{:?}", found.reactions);
    let pressures: Vec<f64> = found.joints.iter().filter_map(|j| j.pressure_n).collect();
    assert_eq!(pressures.len(), 2);
    assert!(pressures.iter().all(|p| near(*p, 84e3, 1e-4)), "{pressures:?}");
}

/// Poured in one, the frame pushes its feet apart: H = q l²/(4 h (k + 2)) of a frame with clamped
/// feet (Kleinlogel), k = I_b h/(I_c l), but for the rigid corners.
#[test]
fn what_touches_is_one_frame() {
    let text = format!(
        "members: [{}, {}, {}], {} {LINE}",
        column("A", 0.0),
        column("C", 8.0),
        beam("B", -0.2, 8.2),
        held(&["A", "C"])
    );
    let found = computed(&text, false);
    assert!(near(up(&found, "A") + up(&found, "C"), 168e3, 1e-6));
    let thrust = found.reactions[0].force_n[0];
    let (h, l) = (3.3, 8.0);
    let k = 0.3 * 0.6f64.powi(3) * h / (0.4f64.powi(4) * l);
    assert!(near(thrust, 20e3 * l * l / (4.0 * h * (k + 2.0)), 0.15), "{thrust}");
    assert!(found.notes.iter().any(|n| n.contains("2 joints by touching")), "{:?}", found.notes);
    assert!(found.joints.iter().all(|j| !j.is_given && j.kind == "Monolithic"));
}

/// Without the middle one of three columns, a beam of two spans becomes one of twice the span:
/// q (2 l)²/8 instead of q l²/8. Without an outer one nothing holds its end but the other span.
#[test]
fn a_column_that_is_gone_hands_its_load_on() {
    let ids = ["A", "M", "C"];
    let joint = |id: &str| {
        let kind = if id == "A" { "Hinge" } else { "Bearing" };
        format!("(of: (\"B\", \"{id}\"), kind: {kind})")
    };
    let joints = ids.map(joint).join(", ");
    let text = format!(
        "members: [{}, {}, {}, {}], joints: [{joints}], {} {LINE}",
        column("A", 0.0),
        column("M", 6.0),
        column("C", 12.0),
        beam("B", -0.2, 12.2),
        held(&ids)
    );
    let found = computed(&text, true);
    assert!(near(up(&found, "M"), 1.25 * 120e3, 0.01), "{}", up(&found, "M"));
    let without = |id: &str| found.redundancy.iter().find(|r| r.without == id).unwrap();
    let middle = without("M");
    assert!(middle.stands && middle.falls.is_empty());
    let rise = middle.largest_rise.clone().unwrap();
    assert!(rise.member == "B" && near(rise.after_pa / rise.before_pa, 4.0, 0.05), "{rise:?}");
    assert!(without("B").stands);
}

#[test]
fn what_hangs_in_the_air_is_told_and_what_nothing_holds_is_refused() {
    let text = format!(
        "members: [{}, {}, {}], {}",
        column("A", 0.0),
        column("C", 8.0),
        beam("far", 20.0, 24.0),
        held(&["A", "C"])
    );
    let found = computed(&text, false);
    assert_eq!(found.hanging, ["far"]);
    assert!(near(up(&found, "A"), 0.16 * 3.0 * 2400.0 * 9.81, 1e-6), "{}", up(&found, "A"));
    let loose = scene(&format!("members: [{}]", column("A", 0.0)));
    let refused = whole(&loose, false, &Job::default()).unwrap_err().to_string();
    assert!(refused.contains("add a support") && refused.contains("\"A\""), "{refused}");
    let sways = format!(
        "members: [{}, {}], joints: [(of: (\"B\", \"A\"), kind: Hinge)], {}",
        column("A", 0.0),
        beam("B", 0.0, 8.0),
        held(&["A"])
    );
    let refused = whole(&scene(&sways), false, &Job::default()).unwrap_err().to_string();
    assert!(refused.contains("moves freely") && refused.contains("joints"), "{refused}");
}

/// Loads change with the days, and ends with them.
#[test]
fn end_forces_follow_the_history_of_loads() {
    let loads = "loads: [(name: \"dead\", action: SelfWeight), (name: \"live\", members: [\"B\"], action: Line(force_kn_m: (0, -20, 0)), history: [(100, 0), (200, 1)])],";
    let text = format!(
        "members: [{}, {}, {}], {} {loads}",
        column("A", 0.0),
        column("C", 8.0),
        beam("B", -0.2, 8.2),
        held(&["A", "C"])
    );
    let found = computed(&text, false);
    assert_eq!(found.times_s.len(), 2);
    let foot: Vec<f64> = member(&found, "A").ends.iter().map(|e| e[0].n).collect();
    assert!(near(foot[0] - foot[1], 84e3, 1e-6), "{foot:?}");
    assert!(found.csv().lines().count() > 6);
}

/// Force and moment that all loads of a member leave, and the sum of their amounts.
fn balance(prepared: &Prepared) -> (DVec3, DVec3, f64) {
    let (mut force, mut moment, mut all) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for load in &prepared.model.loads {
        let Action::Nodes(nodes) = &load.action else { panic!("{}", load.name) };
        for (node, f) in nodes {
            force += *f;
            moment += prepared.model.mesh.nodes[*node as usize].cross(*f);
            all += f.length();
        }
    }
    (force, moment, all)
}

/// What the others do to a member balances its own loads, on the nodes of its bricks, to rounding.
#[test]
fn a_member_takes_what_the_others_do_to_it() {
    let text = format!(
        "members: [{}, {}, {}], {} {LINE}",
        column("A", 0.0),
        column("C", 8.0),
        beam("B", -0.2, 8.2),
        held(&["A", "C"])
    );
    let scene = scene(&text);
    let job = Job::default();
    let found = whole(&scene, false, &job).unwrap();
    for id in ["A", "B", "C"] {
        let assembly = scene.structure.assembly(id).unwrap();
        let meshing = Meshing { element: Some(0.1) };
        let handed = found.handed(id).unwrap();
        let prepared = prepare_within(&scene, assembly, Some(handed), meshing, &job).unwrap();
        assert_eq!(prepared.model.holds.len(), 6);
        let (force, moment, all) = balance(&prepared);
        assert!(
            force.length() < 1e-6 * all && moment.length() < 1e-5 * all,
            "{id} {force} {moment}"
        );
        assert!(all > 80e3, "{id} {all}");
    }
}

/// Half of the beam on bearings, its middle at the end of the axis: what holds it there turns
/// nowhere and lifts nothing, q l²/8 − q a²/2 as a moment alone; the bricks of the half take it, too.
#[test]
fn half_of_a_beam_bears_as_all_of_it_does() {
    let text = format!(
        "members: [{}, {}], joints: [(of: (\"B\", \"A\"), kind: Bearing)],
         supports: [(member: \"A\", place: Bottom, hold: Fixed), (member: \"B\", place: End, hold: Symmetry)], {LINE}",
        column("A", 0.0),
        beam("B", -0.2, 4.0)
    );
    let found = computed(&text, false);
    let moment = 20e3 * (8.0 - 0.5 * 0.04);
    assert!(near(up(&found, "A"), 84e3, 1e-6), "{}", up(&found, "A"));
    assert!(near(at(member(&found, "B"), 4.2).m_z, moment, 1e-3));
    let plane = found.reactions.iter().find(|r| r.member == "B").unwrap();
    assert!(near(plane.moment_nm[2].abs(), moment, 1e-3), "{plane:?}");
    assert!(plane.force_n.iter().all(|f| f.abs() < 1.0), "{plane:?}");
    assert!(found.notes.iter().any(|n| n.contains("plane of symmetry")), "{:?}", found.notes);
    let (scene, job) = (scene(&text), Job::default());
    let assembly = scene.structure.assembly("B").unwrap();
    let meshing = Meshing { element: Some(0.1) };
    let prepared = prepare_within(&scene, assembly, found.handed("B"), meshing, &job).unwrap();
    let (force, moment, all) = balance(&prepared);
    assert!(force.length() < 1e-6 * all && moment.length() < 1e-5 * all, "{force} {moment}");
}

/// A pier with a head, as a model brings it: 3 m of .6 × .6 m, and .8 m of 2.4 × .6 m on top.
fn pier() -> Scene {
    let outline = [
        [-0.3, 0.0],
        [0.3, 0.0],
        [0.3, 3.0],
        [1.2, 3.0],
        [1.2, 3.8],
        [-1.2, 3.8],
        [-1.2, 3.0],
        [-0.3, 3.0],
    ];
    let n = outline.len() as u32;
    let at = |z: f32| outline.map(|[x, y]| Vec3::new(x, y, z));
    // Stem and head, split where they meet.
    let face: [[u32; 3]; 6] = [[0, 1, 2], [0, 2, 7], [6, 7, 2], [6, 2, 3], [6, 3, 4], [6, 4, 5]];
    let back = face.map(|[a, b, c]| [a, c, b]);
    let front = face.map(|t| t.map(|i| i + n));
    let sides = (0..n).flat_map(|i| {
        let k = (i + 1) % n;
        [[i, k, k + n], [i, k + n, i + n]]
    });
    let mesh = Mesh {
        positions: [at(-0.3), at(0.3)].concat(),
        triangles: back.into_iter().chain(front).chain(sides).collect(),
        ..Mesh::default()
    };
    alone("P", MemberKind::Column, mesh, PIER)
}

/// Volume of that pier, m³.
const PIER: f64 = 0.6 * (0.6 * 3.0 + 2.4 * 0.8);

/// What its sections in the middles of its pieces make of a pier is not its volume; what the ground
/// bears is, to the rounding of the model's coordinates.
#[test]
fn a_ragged_body_weighs_what_its_volume_does() {
    let scene = pier();
    let found = whole(&scene, false, &Job::default()).unwrap();
    let weight = PIER * 2400.0 * 9.81;
    assert!(near(up(&found, "P"), weight, 1e-5), "{} of {weight}", up(&found, "P"));
}

/// A box as an OBJ file, from the origin: beams and slabs as other programs write them.
fn block(name: &str, [a, b, c]: [f64; 3]) -> String {
    let mut text = format!("o {name}\n");
    for z in [0.0, c] {
        for [x, y] in [[0.0, 0.0], [a, 0.0], [a, b], [0.0, b]] {
            text += &format!("v {x} {y} {z}\n");
        }
    }
    text + "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
}

/// What import assumes of a lone beam is two bearings: of W = 2400 kg/m³ g l b h each has half, upward,
/// and none clamps it: no moment about the line across. By hand for a girder, a shallow beam and a
/// slab, along x and along z.
#[test]
fn what_import_assumes_of_a_lone_beam_are_bearings() {
    for (name, size) in [
        ("Beam_1", [28.0, 1.2, 0.6]),
        ("Beam_2", [6.0, 0.5, 0.3]),
        ("Beam_3", [0.3, 0.5, 9.0]),
        ("Slab_1", [7.0, 0.25, 4.0]),
    ] {
        let place = tempfile::tempdir().unwrap();
        let (file, folder) = (place.path().join("beam.obj"), place.path().join("out"));
        std::fs::write(&file, block(name, size)).unwrap();
        let job = Job::default();
        import(&file, &folder, &Told::default(), &Access::default(), &job).unwrap();
        let scene = Scene::load(&folder.join("scene.ron"), &job).unwrap();
        let found = whole(&scene, false, &job).unwrap();
        let weight = found.reactions.iter().map(|r| r.force_n[1]).sum::<f64>();
        let by_hand = 9.81 * 2400.0 * size.iter().product::<f64>();
        assert!((weight / by_hand - 1.0).abs() < 0.01, "{name}: {weight} N for {by_hand}");
        let along = if size[0] > size[2] { 0 } else { 2 };
        let middle = 0.5 * size[along];
        for half in [false, true] {
            let there = found.reactions.iter().filter(|r| (r.at_m[along] > middle) == half);
            let [force, moment] = there.fold([0.0; 2], |[f, m], r| {
                assert!(r.force_n[1] > 0.0, "{name}: {r:?}");
                [f + r.force_n[1], m + r.moment_nm[2 - along].abs()]
            });
            assert!((force / by_hand - 0.5).abs() < 0.01, "{name}: {force} N");
            assert!(moment < 1e-3 * by_hand * size[along], "{name}: {moment} N m");
        }
    }
}

/// A prism along x as an OBJ file: its outline across (y up), moved by `place`.
fn prism(outline: &[[f64; 2]], length: f64, place: impl Fn(DVec3) -> DVec3) -> String {
    let n = outline.len();
    let mut text = "o Beam_1\n".to_owned();
    for x in [0.0, length] {
        for [z, y] in outline {
            let [x, y, z] = place(DVec3::new(x, *y, *z)).to_array();
            text += &format!("v {x} {y} {z}\n");
        }
    }
    let list =
        |of: &mut dyn Iterator<Item = usize>| of.map(|i| format!(" {}", i + 1)).collect::<String>();
    text += &format!("f{}\nf{}\n", list(&mut (0..n)), list(&mut (n..2 * n).rev()));
    for i in 0..n {
        let k = (i + 1) % n;
        text += &format!("f {} {} {} {}\n", k + 1, i + 1, i + n + 1, k + n + 1);
    }
    text
}

/// However a lone beam is shaped and lies, what import assumes of it turns with it: of an I, a T, and
/// of a beam that rises by half a per cent or lies askew, half of the weight at each end and no moment
/// about the line across.
#[test]
fn bearings_of_any_section_and_direction_do_not_clamp() {
    let i: [[f64; 2]; 12] = [
        [-0.3, 0.0],
        [0.3, 0.0],
        [0.3, 0.2],
        [0.1, 0.2],
        [0.1, 0.8],
        [0.3, 0.8],
        [0.3, 1.0],
        [-0.3, 1.0],
        [-0.3, 0.8],
        [-0.1, 0.8],
        [-0.1, 0.2],
        [-0.3, 0.2],
    ];
    let t: [[f64; 2]; 8] = [
        [-0.2, 0.0],
        [0.2, 0.0],
        [0.2, 0.9],
        [1.0, 0.9],
        [1.0, 1.1],
        [-1.0, 1.1],
        [-1.0, 0.9],
        [-0.2, 0.9],
    ];
    let box_ = [[-0.2, 0.0], [0.2, 0.0], [0.2, 0.6], [-0.2, 0.6]];
    let level = |p: DVec3| p;
    let rising = |p: DVec3| p + 0.005 * p.x * DVec3::Y;
    let askew = |p: DVec3| DVec3::new(0.8 * p.x - 0.6 * p.z, p.y, 0.6 * p.x + 0.8 * p.z);
    let length = 10.0;
    for (name, text, along) in [
        ("I", prism(&i, length, level), DVec3::X),
        ("T", prism(&t, length, level), DVec3::X),
        ("rising", prism(&box_, length, rising), DVec3::X),
        ("askew", prism(&box_, length, askew), DVec3::new(0.8, 0.0, 0.6)),
    ] {
        let place = tempfile::tempdir().unwrap();
        let (file, folder) = (place.path().join("beam.obj"), place.path().join("out"));
        std::fs::write(&file, text).unwrap();
        let job = Job::default();
        import(&file, &folder, &Told::default(), &Access::default(), &job).unwrap();
        let scene = Scene::load(&folder.join("scene.ron"), &job).unwrap();
        let found = whole(&scene, false, &job).unwrap();
        let weight: f64 = found.reactions.iter().map(|r| r.force_n[1]).sum();
        let across = along.cross(DVec3::Y);
        for half in [false, true] {
            let is_there = |at: [f64; 3]| (DVec3::from_array(at).dot(along) > 0.5 * length) == half;
            let there: Vec<_> = found.reactions.iter().filter(|r| is_there(r.at_m)).collect();
            let force: f64 = there.iter().map(|r| r.force_n[1]).sum();
            let moment: f64 =
                there.iter().map(|r| DVec3::from_array(r.moment_nm).dot(across).abs()).sum();
            assert!((force / weight - 0.5).abs() < 0.01, "{name}: {force} N of {weight}");
            assert!(moment < 1e-3 * weight * length, "{name}: {moment} N m");
        }
    }
}
