//! Boxes as Gmsh meshes, by closed forms.

use std::fmt::Write as _;

use intrados_stage::Job;

use super::*;
use crate::{
    linear::{parse, solve::Solved},
    read::solids::{self, HEX, TET, WEDGE},
};

/// A box in metres: nodes, and elements by Gmsh's type, physical tag and nodes.
#[derive(Default)]
struct Body {
    nodes: Vec<DVec3>,
    elements: Vec<(u32, u32, Vec<usize>)>,
}

/// Gmsh's types of a solid and of its faces, and pairs of corners in the order of its middles.
struct Type {
    solid: u32,
    /// Elements that a brick is cut into, by its corners.
    parts: &'static [&'static [usize]],
    edges: &'static [[usize; 2]],
    /// Type of the faces across the axis, and what a face of four corners is cut into.
    face: u32,
    faces: &'static [&'static [usize]],
    face_edges: &'static [[usize; 2]],
}

const TRIANGLES: &[&[usize]] = &[&[0, 1, 2], &[0, 2, 3]];
const TRIANGLE_EDGES: &[[usize; 2]] = &[[0, 1], [1, 2], [2, 0]];

const HEX8: Type = Type {
    solid: 5,
    parts: HEX.parts,
    edges: &[],
    face: 3,
    faces: &[&[0, 1, 2, 3]],
    face_edges: &[],
};
const HEX20: Type = Type {
    solid: 17,
    parts: HEX.parts,
    edges: HEX.gmsh,
    face: 16,
    faces: &[&[0, 1, 2, 3]],
    face_edges: &[[0, 1], [1, 2], [2, 3], [3, 0]],
};
const TET10: Type = Type {
    solid: 11,
    parts: TET.parts,
    edges: TET.gmsh,
    face: 9,
    faces: TRIANGLES,
    face_edges: TRIANGLE_EDGES,
};
const WEDGE15: Type = Type {
    solid: 18,
    parts: WEDGE.parts,
    edges: WEDGE.gmsh,
    face: 9,
    faces: TRIANGLES,
    face_edges: TRIANGLE_EDGES,
};

impl Body {
    fn element(&mut self, kind: u32, tag: u32, corners: &[DVec3], edges: &[[usize; 2]]) {
        let nodes = solids::element(&mut self.nodes, corners, edges);
        self.elements.push((kind, tag, nodes));
    }

    /// A box from 0 to `size` in so many bricks, each cut as its type is: volume `core`, surfaces
    /// `foot` (z = 0) and `head`, line `rim` (the edge of the head at y = 0), point `tip` (its end).
    fn new(kind: &Type, size: DVec3, parts: [u32; 3]) -> Self {
        let mut body = Self::default();
        for ([_, j, k], corners) in solids::bricks([DVec3::ZERO, size], parts) {
            let (low, high) = corners.split_at(4);
            let of = |from: &[DVec3], part: &[usize]| -> Vec<DVec3> {
                part.iter().map(|&c| from[c]).collect()
            };
            for part in kind.parts {
                body.element(kind.solid, 1, &of(&corners, part), kind.edges);
            }
            for (is_there, tag, side) in [(k == 0, 2, low), (k + 1 == parts[2], 3, high)] {
                for part in kind.faces.iter().filter(|_| is_there) {
                    body.element(kind.face, tag, &of(side, part), kind.face_edges);
                }
            }
            if k + 1 == parts[2] && j == 0 {
                let is_quadratic = !kind.edges.is_empty();
                let (line, middle): (u32, &[[usize; 2]]) =
                    if is_quadratic { (8, &[[0, 1]]) } else { (1, &[]) };
                body.element(line, 4, &high[..2], middle);
            }
        }
        body.element(15, 5, &[DVec3::new(size.x, 0.0, size.z)], &[]);
        body
    }

    /// Version 2.2, in metres.
    fn text(&self) -> String {
        let mut text = String::from(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n5\n3 1 \"core\"\n2 2 \"foot\"\n\
             2 3 \"head\"\n1 4 \"rim\"\n0 5 \"tip\"\n$EndPhysicalNames\n$Nodes\n",
        );
        writeln!(text, "{}", self.nodes.len()).unwrap();
        for (i, p) in self.nodes.iter().enumerate() {
            writeln!(text, "{} {:?} {:?} {:?}", i + 1, p.x, p.y, p.z).unwrap();
        }
        writeln!(text, "$EndNodes\n$Elements\n{}", self.elements.len()).unwrap();
        for (i, (kind, tag, nodes)) in self.elements.iter().enumerate() {
            write!(text, "{} {kind} 2 {tag} {tag}", i + 1).unwrap();
            nodes.iter().for_each(|n| write!(text, " {}", n + 1).unwrap());
            text.push('\n');
        }
        text + "$EndElements\n"
    }
}

/// What there is beside the loads: no Poisson's ratio, so that bars are bars.
const BAR: &str = "materials: [(group: \"core\", modulus_gpa: 30, poisson: 0, density_kg_m3: 2500, \
                   expansion_1e6_k: 10)], supports: [(group: \"foot\", x: true, y: true, z: true)]";

fn groups(text: &str) -> Result<Groups, String> {
    let text = format!("(schema: \"intrados.groups/1\", {text})");
    Groups::parse(text.as_bytes(), Path::new("a.groups.ron")).map_err(|e| e.to_string())
}

fn deck(body: &Body, said: &str) -> Result<Deck, String> {
    let (text, name) = (body.text(), Path::new("a.msh"));
    parse_mesh(text.as_bytes(), name, Units::MetreNewton, &groups(said)?).map_err(|e| e.to_string())
}

fn solve(body: &Body, said: &str) -> Solved {
    let solved = deck(body, said).unwrap().solve(&Job::default()).unwrap();
    assert_eq!(solved.len(), 1);
    solved.into_iter().next().unwrap()
}

fn near(a: f64, b: f64, by: f64) {
    assert!((a - b).abs() <= by, "{a} is not {b} within {by}");
}

const SIZE: DVec3 = DVec3::new(0.5, 0.4, 3.0);

/// A bar under its own weight, u = −ρg(Lz − z²/2)/E: quadratic elements have it everywhere.
#[test]
fn bars_shorten_under_their_own_weight() {
    let said = BAR.to_owned() + ", loads: [(action: Weight(gravity_m_s2: (0, 0, -9.81)))]";
    for kind in [HEX8, HEX20, TET10, WEDGE15] {
        let body = Body::new(&kind, SIZE, [1, 1, 3]);
        let solved = solve(&body, &said);
        for (p, u) in body.nodes.iter().zip(&solved.displacements) {
            let exact = -2500.0 * 9.81 * (SIZE.z * p.z - 0.5 * p.z * p.z) / 30e9;
            near(u.z, exact, 1e-9 * 2500.0 * 9.81 * 4.5 / 30e9);
            near(u.x.hypot(u.y), 0.0, 1e-14);
        }
    }
}

/// A cantilever under a force at its end: P L³/(3 E I) and the shear of Timoshenko, κ = 5/6.
#[test]
fn cantilevers_bend_as_beams_do() {
    let said = BAR.to_owned() + ", loads: [(group: \"head\", action: Force(force_kn: (20, 0, 0)))]";
    let [width, depth, length] = [SIZE.y, SIZE.x, 3.0];
    let second = width * depth.powi(3) / 12.0;
    let shear = 15e9 * 5.0 / 6.0 * width * depth;
    let exact = 20e3 * (length.powi(3) / (3.0 * 30e9 * second) + length / shear);
    for (kind, parts) in [(HEX20, [1, 1, 8]), (TET10, [2, 1, 8]), (HEX8, [2, 1, 12])] {
        let body = Body::new(&kind, SIZE, parts);
        let solved = solve(&body, &said);
        let tip = body.nodes.iter().position(|p| p.distance(SIZE) < 1e-9).unwrap();
        let off = solved.displacements[tip].x / exact - 1.0;
        assert!(off.abs() < 0.01, "type {}: {off}", kind.solid);
    }
}

/// The same pull as a pressure, a traction, and a force on the same surface.
#[test]
fn pressures_tractions_and_forces_are_one() {
    let force = format!("Force(force_kn: (0, 0, {}))", 1e3 * SIZE.x * SIZE.y);
    for kind in [HEX8, HEX20, TET10, WEDGE15] {
        let body = Body::new(&kind, SIZE, [2, 1, 2]);
        for action in
            ["Pressure(pressure_kpa: -1000)", "Traction(traction_kpa: (0, 0, 1000))", &force]
        {
            let said = format!("{BAR}, loads: [(group: \"head\", action: {action})]");
            let solved = solve(&body, &said);
            for (p, u) in body.nodes.iter().zip(&solved.displacements) {
                near(u.distance(1e6 / 30e9 * p.z * DVec3::Z), 0.0, 1e-13);
            }
            for stress in solved.stresses.iter().flatten() {
                near(stress[2], 1e6, 1e-2);
            }
        }
    }
}

/// Free swelling α ΔT of what is held in one corner; a moved end, without stress across.
#[test]
fn solids_swell_and_follow_their_supports() {
    let warm =
        BAR.replace("poisson: 0", "poisson: 0.2").replace("x: true, y: true, z: true", "z: true")
            + ", loads: [(action: Temperature(uniform_k: 40))]";
    let warm = warm.replace(
        "supports: [",
        "supports: [(group: \"tip\", x: true, y: true), (group: \"rim\", y: true), ",
    );
    let moved = BAR
        .replace("supports: [", "supports: [(group: \"head\", z: true, moved_mm: (0, 0, 1.5)), ");
    for kind in [HEX8, HEX20, TET10, WEDGE15] {
        let body = Body::new(&kind, SIZE, [1, 1, 2]);
        let corner = DVec3::new(SIZE.x, 0.0, 0.0);
        for (p, u) in body.nodes.iter().zip(&solve(&body, &warm).displacements) {
            near(u.distance(4e-4 * (*p - corner)), 0.0, 1e-12);
        }
        for (p, u) in body.nodes.iter().zip(&solve(&body, &moved).displacements) {
            near(u.z, 1.5e-3 * p.z / SIZE.z, 1e-12);
        }
    }
}

/// Forces on a line and on a point are those at their nodes, in all what was said; loads add up.
#[test]
fn forces_on_lines_and_points_come_whole() {
    let said = BAR.to_owned()
        + ", loads: [(group: \"rim\", action: Force(force_kn: (0, 6, 0))), (group: \"tip\", action: Force(force_kn: (0, 1, 2)))]";
    for (kind, ends) in [(HEX8, [1.5e3, 3e3]), (HEX20, [500.0, 1e3])] {
        let body = Body::new(&kind, SIZE, [2, 1, 1]);
        let deck = deck(&body, &said).unwrap();
        let forces = &deck.steps[0].forces;
        let sum = |axis: u8| forces.iter().filter(|f| f.0.1 == axis).map(|f| f.1).sum::<f64>();
        near(sum(1), 7e3, 1e-9);
        near(sum(2), 2e3, 1e-9);
        let at = |place: DVec3| {
            let node = body.nodes.iter().position(|n| n.distance(place) < 1e-9).unwrap() as u32;
            forces[&(node, 1)]
        };
        let [end, middle] = ends;
        near(at(DVec3::new(0.0, 0.0, SIZE.z)), end, 1e-9);
        near(at(DVec3::new(0.5 * SIZE.x, 0.0, SIZE.z)), middle, 1e-9);
        near(at(DVec3::new(SIZE.x, 0.0, SIZE.z)), end + 1e3, 1e-9);
    }
}

/// The bricks of a mesh, and the deck that says the same.
#[test]
fn a_mesh_and_a_deck_of_the_same_say_the_same() {
    let body = Body::new(&HEX8, SIZE, [2, 1, 4]);
    let said = BAR.replace("poisson: 0", "poisson: 0.2")
        + ", loads: [(group: \"tip\", action: Force(force_kn: (3, 2, 1))), (action: Weight(gravity_m_s2: (0, 0, -9.81)))]";
    let ours = solve(&body, &said);
    let mut text = String::from("*NODE\n");
    for (i, p) in body.nodes.iter().enumerate() {
        writeln!(text, "{},{:?},{:?},{:?}", i + 1, p.x, p.y, p.z).unwrap();
    }
    text += "*ELEMENT,TYPE=C3D8I,ELSET=ALL\n";
    for (i, (_, _, nodes)) in body.elements.iter().enumerate().filter(|e| e.1.0 == 5) {
        let nodes: Vec<String> = nodes.iter().map(|n| (n + 1).to_string()).collect();
        writeln!(text, "{},{}", i + 1, nodes.join(",")).unwrap();
    }
    text += "*MATERIAL,NAME=M\n*ELASTIC\n30e9,.2\n*DENSITY\n2500.\n*SOLID SECTION,ELSET=ALL,MATERIAL=M\n*BOUNDARY\n";
    for (i, _) in body.nodes.iter().enumerate().filter(|n| n.1.z < 1e-9) {
        writeln!(text, "{},1,3", i + 1).unwrap();
    }
    let tip =
        1 + body.nodes.iter().position(|p| p.distance(DVec3::new(0.5, 0.0, 3.0)) < 1e-9).unwrap();
    writeln!(text, "*STEP\n*STATIC\n*CLOAD\n{tip},1,3e3\n{tip},2,2e3\n{tip},3,1e3\n*DLOAD\nALL,GRAV,9.81,0,0,-1\n*END STEP").unwrap();
    let deck = parse(text.as_bytes(), Path::new("a.inp"), Units::MetreNewton).unwrap();
    let theirs = &deck.solve(&Job::default()).unwrap()[0];
    for (a, b) in ours.displacements.iter().zip(&theirs.displacements) {
        near(a.distance(*b), 0.0, 1e-12);
    }
}

#[test]
fn all_groups_that_do_not_fit_are_named_at_once() {
    let body = Body::new(&HEX8, SIZE, [1, 1, 2]);
    let bare = BAR
        .replace("group: \"core\", ", "")
        .replace(", density_kg_m3: 2500, expansion_1e6_k: 10", "");
    let said = bare.replace(
        "supports: [",
        "supports: [(group: \"fuss\", x: true), (group: \"foot\", z: true, moved_mm: (0, 0, 1)), ",
    ) + ", loads: [(group: \"rim\", action: Pressure(pressure_kpa: 1)), (action: Weight(gravity_m_s2: (0, 0, -9.81))), (action: Temperature(uniform_k: 1))]";
    let error = deck(&body, &said).unwrap_err();
    for part in [
        "a.groups.ron: supports[0]: no physical group \"fuss\"; the mesh has \"tip\", \"rim\", \"foot\", \"head\", \"core\"",
        "supports[2]: node 1 is moved elsewhere by another support",
        "loads[0]: \"rim\" is a line, and needed is a surface",
        "loads[1]: weight acts on materials[0], which has no density_kg_m3",
        "loads: a temperature acts on materials[0], which has no expansion_1e6_k",
    ] {
        assert!(error.contains(part), "{part}: {error}");
    }
    assert_eq!(error.lines().count(), 1, "{error}");
    // Values beside names, and all names where a material's is wrong; no more, since it is not known
    // what is solid.
    let wrong = BAR
        .replace("modulus_gpa: 30", "modulus_gpa: 30e9")
        .replace("\"core\"", "\"kern\"")
        .replace("\"foot\"", "\"fuss\"")
        + ", loads: [(group: \"tip\", action: Pressure(pressure_kpa: 1)), (group: \"head\", action: Pressure(pressure_kpa: inf)), (action: Force(force_kn: (0, 0, 1)))]";
    let error = deck(&body, &wrong).unwrap_err();
    for part in [
        "a.groups.ron: materials[0].modulus_gpa is 30000000000.0",
        "loads[1].pressure_kpa is inf",
        "loads[2] needs a group",
        "materials[0]: no physical group \"kern\"",
        "element 1 and 1 more are in no volume",
        "supports[0]: no physical group \"fuss\"",
        "loads[0]: \"tip\" is a point, and needed is a surface",
    ] {
        assert!(error.contains(part), "{part}: {error}");
    }
    assert!(!error.contains("belong to no solid"), "{error}");
    // Where only values are wrong, what rests on the solids is looked at, too.
    let error = deck(&body, &said.replace("modulus_gpa: 30", "modulus_gpa: 0")).unwrap_err();
    assert!(error.contains("modulus_gpa is 0.0") && error.contains("no density_kg_m3"), "{error}");
    // What is of two materials, and of none.
    let twice = BAR.replace("materials: [", "materials: [(modulus_gpa: 1, poisson: 0), ")
        + ", loads: [(action: Temperature(uniform_k: 1))]";
    assert!(deck(&body, &twice).unwrap_err().contains("is of materials[0] already"));
    let none =
        BAR.replace("\"core\"", "\"head\"") + ", loads: [(action: Temperature(uniform_k: 1))]";
    let error = deck(&body, &none).unwrap_err();
    assert!(error.contains("\"head\" is a surface, and needed is a volume"), "{error}");
    assert!(error.contains("element 1 and 1 more are in no volume"), "{error}");
}

/// Between two solids a pressure has no side; a surface beside all solids has nothing behind it.
#[test]
fn surfaces_need_a_solid_on_one_side() {
    let mut body = Body::new(&HEX8, SIZE, [1, 1, 2]);
    let load = |action: &str| format!("{BAR}, loads: [(group: \"head\", action: {action})]");
    let middle: Vec<DVec3> = [[0.0, 0.0], [0.5, 0.0], [0.5, 0.4], [0.0, 0.4]]
        .map(|[x, y]| DVec3::new(x, y, 1.5))
        .to_vec();
    body.element(3, 3, &middle, &[]);
    let error = deck(&body, &load("Pressure(pressure_kpa: 1)")).unwrap_err();
    assert!(error.contains("1 of 2 faces of \"head\" lie between two solids"), "{error}");
    assert!(deck(&body, &load("Traction(traction_kpa: (0, 0, 1))")).is_ok());
    let beside: Vec<DVec3> = middle.iter().map(|p| *p + DVec3::X).collect();
    body.element(3, 3, &beside, &[]);
    let error = deck(&body, &load("Traction(traction_kpa: (0, 0, 1))")).unwrap_err();
    assert!(error.contains("1 of 3 faces of \"head\" belong to no solid"), "{error}");
}

/// Groups of which nothing is said are told; a body that nothing holds along z is no result.
#[test]
fn idle_groups_are_noted_and_loose_bodies_refused() {
    let body = Body::new(&HEX20, SIZE, [1, 1, 1]);
    let said = BAR.to_owned() + ", loads: [(group: \"head\", action: Pressure(pressure_kpa: 1))]";
    let deck_of = deck(&body, &said).unwrap();
    assert!(deck_of.notes.iter().any(|n| n == "nothing is said of the line \"rim\""));
    assert!(deck_of.grid().is_some());
    let loose = said.replace("x: true, y: true, z: true", "x: true, y: true");
    let why = deck(&body, &loose).unwrap().solve(&Job::default()).unwrap_err().to_string();
    assert!(why.contains("can move freely"), "{why}");
}
