use std::{fmt::Write as _, path::Path};

use glam::DVec3;
use intrados_stage::Job;

use super::{mesh, parse, read::Kind, shape::Shape, solve::Solved};
use crate::{
    deck::Case,
    model::MarchSettings,
    read::{
        Units, abaqus,
        solids::{self, HEX, TET, WEDGE},
    },
};

/// The body's law in all tests.
const LAW: &str = "*MATERIAL,NAME=M\n*ELASTIC\n200.,.3\n*DENSITY\n3.\n*EXPANSION\n1e-3\n\
                   *SOLID SECTION,ELSET=ALL,MATERIAL=M\n.1\n";

fn solve(deck: &str) -> Vec<Solved> {
    let deck = parse(deck.as_bytes(), Path::new("deck.inp"), Units::MetreNewton).unwrap();
    assert!(deck.notes.is_empty(), "{:?}", deck.notes);
    deck.solve(&Job::default()).unwrap()
}

fn refusal(deck: &str) -> String {
    let found = parse(deck.as_bytes(), Path::new("deck.inp"), Units::MetreNewton);
    let error = found.unwrap_err().to_string();
    assert_eq!(error.lines().count(), 1, "{error}");
    error
}

/// Nodes and elements of a body, numbered as they come.
#[derive(Default)]
struct Body {
    nodes: Vec<DVec3>,
    elements: Vec<Vec<usize>>,
}

impl Body {
    /// An element by its corners; middles of edges are where its shape has them.
    fn element(&mut self, shape: Shape, corners: &[DVec3]) {
        let edges: &[[usize; 2]] = match shape {
            Shape::Hex20 | Shape::Hex20Reduced => HEX.abaqus,
            Shape::Tet10 => TET.abaqus,
            Shape::Wedge15 => WEDGE.abaqus,
            _ => &[],
        };
        let nodes = solids::element(&mut self.nodes, corners, edges);
        self.elements.push(nodes);
    }

    /// A box of elements of a type, so many along each axis.
    fn fill(&mut self, kind: &str, within: [DVec3; 2], parts: [u32; 3]) -> Shape {
        let Some(Kind::Solid(shape)) = mesh::kind(kind) else { panic!("{kind} is no solid") };
        let cut = match shape.nodes() {
            8 | 20 => HEX,
            6 | 15 => WEDGE,
            _ => TET,
        };
        for (_, corners) in solids::bricks(within, parts) {
            for part in cut.parts {
                let corners: Vec<DVec3> = part.iter().map(|&c| corners[c]).collect();
                self.element(shape, &corners);
            }
        }
        shape
    }

    fn text(&self, kind: &str) -> String {
        let mut text = String::from("*NODE,NSET=ALL\n");
        for (n, p) in self.nodes.iter().enumerate() {
            writeln!(text, "{},{:?},{:?},{:?}", n + 1, p.x, p.y, p.z).unwrap();
        }
        writeln!(text, "*ELEMENT,TYPE={kind},ELSET=ALL").unwrap();
        for (e, nodes) in self.elements.iter().enumerate() {
            write!(text, "{}", e + 1).unwrap();
            for (i, n) in nodes.iter().enumerate() {
                write!(text, "{}{}", if i % 10 == 9 { ",\n" } else { "," }, n + 1).unwrap();
            }
            text.push('\n');
        }
        text
    }

    /// Faces whose nodes all satisfy a test, as rows of a surface.
    fn faces(&self, shape: Shape, test: impl Fn(DVec3) -> bool) -> String {
        let mut rows = String::new();
        for (e, nodes) in self.elements.iter().enumerate() {
            for (f, face) in shape.faces().enumerate() {
                if face.iter().all(|&i| test(self.nodes[nodes[i]])) {
                    writeln!(rows, "{},S{}", e + 1, f + 1).unwrap();
                }
            }
        }
        assert!(!rows.is_empty());
        rows
    }

    /// Rows of supports of the nodes that satisfy a test.
    fn held(&self, component: u8, test: impl Fn(DVec3) -> bool) -> String {
        let nodes = self.nodes.iter().enumerate().filter(|(_, p)| test(**p));
        nodes.map(|(n, _)| format!("{},{component}\n", n + 1)).collect()
    }

    /// Symmetry about the three planes through the origin.
    fn corner(&self) -> String {
        format!(
            "*BOUNDARY\n{}{}{}",
            self.held(1, |p| p.x.abs() < 1e-9),
            self.held(2, |p| p.y.abs() < 1e-9),
            self.held(3, |p| p.z.abs() < 1e-9)
        )
    }
}

const UNIT: [DVec3; 2] = [DVec3::ZERO, DVec3::ONE];
const SOLIDS: [&str; 8] = ["C3D4", "C3D6", "C3D8", "C3D8R", "C3D10", "C3D15", "C3D20", "C3D20R"];

fn near(a: f64, b: f64, by: f64) {
    assert!((a - b).abs() <= by, "{a} is not {b} within {by}");
}

/// Tension of 1 Pa along x, over E = 200, on half-turned axes where asked.
#[test]
fn every_solid_stretches_as_a_bar_does() {
    for kind in SOLIDS {
        let mut body = Body::default();
        let shape = body.fill(kind, UNIT, [2, 1, 1]);
        let deck = body.text(kind)
            + LAW
            + &body.corner()
            + "*SURFACE,NAME=END\n"
            + &body.faces(shape, |p| p.x > 1.0 - 1e-9)
            + "*STEP\n*STATIC\n*DSLOAD\nEND,P,-1.\n*END STEP\n";
        let solved = solve(&deck);
        for (p, u) in body.nodes.iter().zip(&solved[0].displacements) {
            let expected = DVec3::new(p.x, -0.3 * p.y, -0.3 * p.z) / 200.0;
            near(u.distance(expected), 0.0, 1e-12);
        }
        for stress in solved[0].stresses.iter().flatten() {
            near(stress[0], 1.0, 1e-10);
            stress[1..].iter().for_each(|s| near(*s, 0.0, 1e-10));
        }
    }
}

/// E A/L of a bar pulled by a moved end; then warm and free: α ΔT everywhere and no stress; then
/// both, and what earlier steps left dropped.
#[test]
fn steps_follow_one_another() {
    for kind in SOLIDS {
        let mut body = Body::default();
        body.fill(kind, UNIT, [1, 1, 2]);
        let top = body.held(3, |p| p.z > 1.0 - 1e-9).replace(",3\n", ",3,3,.01\n");
        let deck = body.text(kind)
            + LAW
            + &body.corner()
            + "*AMPLITUDE,NAME=A\n0.,0.,4.,2.\n*STEP\n*STATIC\n.1,2.\n*BOUNDARY,AMPLITUDE=A\n"
            + &top
            + "*END STEP\n*STEP\n*STATIC\n*BOUNDARY,OP=NEW\n"
            + &body.corner()
            + "*TEMPERATURE\nALL,20.\n*END STEP\n";
        let deck = deck.replace("OP=NEW\n*BOUNDARY\n", "OP=NEW\n");
        let [pulled, warm] = solve(&deck).try_into().unwrap();
        for ((p, u), v) in body.nodes.iter().zip(&pulled.displacements).zip(&warm.displacements) {
            near(u.z, 0.01 * p.z, 1e-12);
            near(v.distance(0.02 * *p), 0.0, 1e-12);
        }
        pulled.stresses.iter().flatten().for_each(|s| near(s[2], 2.0, 1e-9));
        warm.stresses.iter().flatten().flatten().for_each(|s| near(*s, 0.0, 1e-9));
    }
}

/// A cantilever of C3D8R with one brick across bends as far as CalculiX says (2.20): what keeps it
/// is its stiffness against hourglasses alone.
#[test]
fn bricks_of_mean_strain_bend_as_the_peers_do() {
    let mut body = Body::default();
    body.fill("C3D8R", [DVec3::ZERO, DVec3::new(4.0, 1.0, 1.0)], [4, 1, 1]);
    let held: String = (1..=3).map(|c| body.held(c, |p| p.x < 1e-9)).collect();
    let pushed = body.held(3, |p| p.x > 4.0 - 1e-9).replace(",3\n", ",3,.01\n");
    let deck = body.text("C3D8R")
        + LAW
        + "*BOUNDARY\n"
        + &held
        + "*STEP\n*STATIC\n*CLOAD\n"
        + &pushed
        + "*END STEP\n";
    let solved = solve(&deck);
    let ends = body.nodes.iter().zip(&solved[0].displacements).filter(|(p, _)| p.x > 4.0 - 1e-9);
    ends.for_each(|(_, u)| near(u.z / 1.402_08, 1.0, 1e-6));
}

/// Bricks of mean strain that are out of shape bear a constant strain.
#[test]
fn bricks_of_mean_strain_pass_the_patch_test() {
    let mut body = Body::default();
    body.fill("C3D8R", UNIT, [2, 2, 2]);
    let middle = |p: DVec3| p.distance(DVec3::splat(0.5)) < 1e-9;
    let inside = body.nodes.iter().position(|p| middle(*p)).unwrap();
    body.nodes[inside] += DVec3::new(0.1, -0.15, 0.2);
    let field = |p: DVec3| 1e-3 * DVec3::new(p.x + 2.0 * p.y, p.z - p.x, 3.0 * p.z + p.y);
    let mut moved = String::new();
    for (n, p) in body.nodes.iter().enumerate().filter(|(n, _)| *n != inside) {
        for (c, u) in (1..).zip(field(*p).to_array()) {
            writeln!(moved, "{},{c},{c},{u:?}", n + 1).unwrap();
        }
    }
    let deck = body.text("C3D8R") + LAW + "*STEP\n*STATIC\n*BOUNDARY\n" + &moved + "*END STEP\n";
    for (p, u) in body.nodes.iter().zip(&solve(&deck)[0].displacements) {
        near(u.distance(field(*p)), 0.0, 1e-12);
    }
}

/// Four bars to a point, under a force, then under their weight and warmth: as CalculiX has it
/// (2.20), whose bars are solids with hinges. Its frequencies are those of three springs.
#[test]
fn bars_bear_along_themselves() {
    let deck = "*NODE,NSET=N\n1,0,0,0\n2,1000,0,0\n3,1000,800,0\n4,0,800,0\n5,300,300,900\n\
        *ELEMENT,TYPE=T3D2,ELSET=E\n1,1,5\n2,2,5\n3,3,5\n4,4,5\n*MATERIAL,NAME=S\n*ELASTIC\n210e3,.3\n*DENSITY\n7.85e-9\n\
        *EXPANSION\n1.2e-5\n*SOLID SECTION,ELSET=E,MATERIAL=S\n120.\n*BOUNDARY\n1,1,3\n2,1,3\n3,1,3\n4,1,3\n\
        *STEP\n*STATIC\n*CLOAD\n5,1,1000\n5,2,500\n5,3,-3000\n*END STEP\n\
        *STEP\n*STATIC\n*CLOAD,OP=NEW\n*DLOAD\nE,GRAV,9810,0,0,-1\n*TEMPERATURE\nN,30\n*END STEP\n\
        *STEP\n*FREQUENCY\n3\n*END STEP\n";
    let read = parse(deck.as_bytes(), Path::new("deck.inp"), Units::MillimetreNewton).unwrap();
    let solved = read.solve(&Job::default()).unwrap();
    for (step, theirs) in solved.iter().zip([
        DVec3::new(4.105809e-2, 2.472989e-2, -4.436240e-2),
        DVec3::new(-1.441061e-1, -7.211517e-2, 4.676386e-1),
    ]) {
        near((1e3 * step.displacements[4]).distance(theirs) / theirs.length(), 0.0, 1e-6);
    }
    let stress = solved[0].stresses[0][0];
    near(stress[0] / -3.893344e5, 1.0, 1e-6);
    near(stress[2] / -3.504009e6, 1.0, 1e-6);
    let hertz = [458.914_816, 558.618_601, 1_049.656_491];
    for (value, hertz) in solved[2].eigenvalues.iter().zip(hertz) {
        near(value.sqrt() / (std::f64::consts::TAU * hertz), 1.0, 1e-6);
    }
    assert!(refusal(&deck.replace("120.\n", "")).contains("area of their section"));
}

/// The same bricks by the solver of members.
#[test]
fn bricks_bend_as_those_of_members_do() {
    let mut body = Body::default();
    body.fill("C3D8", [DVec3::ZERO, DVec3::new(3.0, 1.0, 0.5)], [6, 2, 2]);
    let end = body.nodes.iter().position(|p| p.distance(DVec3::new(3.0, 1.0, 0.5)) < 1e-9).unwrap();
    let held: String = (1..=3).map(|c| body.held(c, |p| p.x < 1e-9)).collect();
    let deck = body.text("C3D8")
        + LAW.strip_suffix(".1\n").unwrap()
        + "*BOUNDARY\n"
        + &held
        + &format!(
            "*STEP\n*STATIC\n*CLOAD\n{},3,.02\n*DLOAD\nALL,GRAV,.01,0,0,-1\n*END STEP\n",
            end + 1
        );
    let ours = solve(&deck);
    let case = abaqus::parse(deck.as_bytes(), Path::new("deck.inp"), Units::MetreNewton).unwrap();
    let case = Case::new(case).unwrap();
    let history = case.run(MarchSettings::of_deck(), &Job::default(), |_, _, _| Ok(())).unwrap();
    let theirs: Vec<DVec3> =
        history.x.as_chunks::<3>().0.iter().copied().map(DVec3::from_array).collect();
    let most = theirs.iter().map(|u| u.length()).fold(0.0, f64::max);
    assert!(most > 1e-3);
    for (a, b) in ours[0].displacements.iter().zip(&theirs) {
        near(a.distance(*b), 0.0, 1e-6 * most);
    }
}

/// A law along turned axes: the constants of an isotropic one, written as engineering constants,
/// say the same whatever the axes; a law that is stiff along one axis stretches least along it.
#[test]
fn laws_turn_with_their_axes() {
    let mut body = Body::default();
    let shape = body.fill("C3D20R", UNIT, [1, 1, 1]);
    let pulled = |law: &str, section: &str| {
        let deck = body.text("C3D20R")
            + "*ORIENTATION,NAME=O\n.6,.8,0.,-.8,.6,0.\n*ORIENTATION,NAME=Q\n0.,0.,1.,1.,0.,0.\n*MATERIAL,NAME=M\n"
            + law
            + &format!("*SOLID SECTION,ELSET=ALL,MATERIAL=M,ORIENTATION={section}\n")
            + &body.corner()
            + "*SURFACE,NAME=END\n"
            + &body.faces(shape, |p| p.z > 1.0 - 1e-9)
            + "*STEP\n*STATIC\n*DSLOAD\nEND,P,-1.\n*END STEP\n";
        let solved = solve(&deck);
        let end = body.nodes.iter().position(|p| p.distance(DVec3::ONE) < 1e-9).unwrap();
        solved[0].displacements[end]
    };
    let g = 200.0 / 2.6;
    let same =
        format!("*ELASTIC,TYPE=ENGINEERING CONSTANTS\n200.,200.,200.,.3,.3,.3,{g},{g},\n{g}\n");
    near(pulled(&same, "O").distance(DVec3::new(-0.3, -0.3, 1.0) / 200.0), 0.0, 1e-12);
    // Along z lies the material's first axis, of 500.
    let stiff = "*ELASTIC,TYPE=ENGINEERING CONSTANTS\n500.,200.,100.,0.,0.,0.,80.,80.,\n80.\n";
    near(pulled(stiff, "Q").distance(DVec3::new(0.0, 0.0, 0.002)), 0.0, 1e-12);
}

/// Two boxes, one twice as fine as the other, tied: nodes that follow a face carry a constant stress
/// where the finer mesh refines the coarser one, and where it is moved to it across a gap.
#[test]
fn ties_carry_tension_between_a_mesh_and_a_finer_one() {
    for gap in [0.0, 0.2] {
        let mut body = Body::default();
        let shape = body.fill("C3D20", UNIT, [1, 4, 2]);
        let lower = body.elements.len();
        // The upper box has its nodes to itself: it is made far away, and put in its place.
        let far = DVec3::new(10.0, 0.0, 0.0);
        body.fill("C3D20", [DVec3::X + far, 2.0 * DVec3::X + DVec3::Y + DVec3::Z + far], [1, 2, 2]);
        body.nodes.iter_mut().filter(|p| p.x > 5.0).for_each(|p| *p += gap * DVec3::X - far);
        let rows = |test: fn(DVec3) -> bool, wanted: std::ops::Range<usize>| -> String {
            let all = body.faces(shape, test);
            let own = all.lines().filter(|l| {
                let e: usize = l.split(',').next().unwrap().parse().unwrap();
                wanted.contains(&(e - 1))
            });
            own.map(|l| format!("{l}\n")).collect()
        };
        let joint = |p: DVec3| (p.x - 1.0).abs() < 0.3;
        let upper = lower..body.elements.len();
        let deck = body.text("C3D20")
            + LAW
            + &body.corner()
            + &format!("*SURFACE,NAME=S\n{}", rows(joint, 0..lower))
            + &format!("*SURFACE,NAME=T\n{}", rows(joint, upper.clone()))
            + &format!("*SURFACE,NAME=END\n{}", rows(|p| p.x > 2.0 - 1e-9, upper))
            + "*TIE,NAME=J,POSITION TOLERANCE=.3\nS,T\n*STEP\n*STATIC\n*DSLOAD\nEND,P,-1.\n*END STEP\n";
        let solved = solve(&deck);
        for (p, u) in body.nodes.iter().zip(&solved[0].displacements) {
            let moved = if (p.x - 1.0).abs() < 1e-9 { gap } else { 0.0 };
            near(u.x, (p.x + moved) / 200.0, 1e-10);
        }
        solved[0].stresses.iter().flatten().for_each(|s| near(s[0], 1.0, 1e-8));
    }
}

/// Supports along and around an axis hold a ring as planes of symmetry do; equations that tie two
/// nodes do as a support of both.
#[test]
fn transformed_supports_and_equations_hold_as_written() {
    let mut body = Body::default();
    let shape = body.fill("C3D20R", UNIT, [1, 1, 1]);
    let mut text = body.text("C3D20R") + LAW;
    // The cube turned by 30° about z, with all that holds it given in turned axes.
    let (sin, cos) = (0.5, 0.75f64.sqrt());
    let turned: Vec<DVec3> = body
        .nodes
        .iter()
        .map(|p| DVec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z))
        .collect();
    for (n, (p, q)) in body.nodes.iter().zip(&turned).enumerate() {
        let [old, new] = [p, q].map(|p| format!("\n{},{:?},{:?},{:?}\n", n + 1, p.x, p.y, p.z));
        text = text.replacen(&old, &new, 1);
    }
    // All nodes of the end move alike along x′, and one of them is pulled.
    let end: Vec<usize> = (0..20).filter(|&n| body.nodes[n].x > 1.0 - 1e-9).collect();
    let equations: String = end[1..]
        .iter()
        .map(|n| format!("*EQUATION\n2\n{},1,1.,{},1,-1.\n", n + 1, end[0] + 1))
        .collect();
    text += &format!("*TRANSFORM,NSET=ALL\n{cos:?},{sin:?},0.,{:?},{cos:?},0.\n", -sin);
    text += &body.corner();
    text += &equations;
    text += &format!("*STEP\n*STATIC\n*CLOAD\n{0},1,.25\n{0},1,.75\n*END STEP\n", end[0] + 1);
    let solved = solve(&text);
    assert_eq!(shape.nodes(), 20);
    for (p, u) in body.nodes.iter().zip(&solved[0].displacements) {
        let own = DVec3::new(cos * u.x + sin * u.y, -sin * u.x + cos * u.y, u.z);
        near(own.distance(DVec3::new(p.x, -0.3 * p.y, -0.3 * p.z) / 200.0), 0.0, 1e-12);
    }
}

#[test]
fn all_that_is_not_computed_is_named_at_once() {
    let deck = "*NODE\n1,0,0\n*ELEMENT,TYPE=F3D8,ELSET=ALL\n1,1\n*MATERIAL,NAME=M\n*CREEP\n1,2\n*STEP\n*COMPLEX FREQUENCY\n3\n*END STEP\n";
    let line = refusal(deck);
    for part in
        ["deck.inp:3: elements of type \"F3D8\"", "line 6: *CREEP", "line 9: *COMPLEX FREQUENCY"]
    {
        assert!(line.contains(part), "{line}");
    }
}

/// Cards, elements and parameters that other programs compute and this one does not.
#[test]
fn what_is_not_computed_is_refused_by_its_name() {
    for card in [
        "DYNAMIC",
        "MODAL DYNAMIC",
        "STEADY STATE DYNAMICS",
        "MODAL DAMPING",
        "DAMPING",
        "DASHPOT",
        "CYCLIC SYMMETRY MODEL",
        "SELECT CYCLIC SYMMETRY MODES",
        "RIGID BODY",
        "MPC",
        "DISTRIBUTING COUPLING",
        "PRE-TENSION SECTION",
        "GAP",
        "PLASTIC",
        "CYCLIC HARDENING",
        "HYPERELASTIC",
        "HYPERFOAM",
        "DEFORMATION PLASTICITY",
        "COUPLED TEMPERATURE-DISPLACEMENT",
        "UNCOUPLED TEMPERATURE-DISPLACEMENT",
        "CHANGE SOLID SECTION",
        "NODAL THICKNESS",
        "MEMBRANE",
    ] {
        let line = refusal(&format!("*NODE\n1,0,0\n*{card}\n"));
        assert!(line.contains(&format!("deck.inp:3: *{card} is not computed")), "{line}");
    }
    for kind in ["DASHPOTA", "GAPUNI", "DCOUP3D", "CPS4", "CPE8R", "CAX8"] {
        let line = refusal(&format!("*NODE\n1,0,0\n*ELEMENT,TYPE={kind}\n1,1\n"));
        assert!(line.contains(&format!("elements of type \"{kind}\" are not computed")), "{line}");
    }
    let mut body = Body::default();
    let shape = body.fill("C3D8", UNIT, [1, 1, 1]);
    let good = body.text("C3D8")
        + LAW
        + &body.corner()
        + "*NODE\n90,2,0,0\n*ELEMENT,TYPE=SPRINGA,ELSET=S\n90,1,90\n*SPRING,ELSET=S\n1.\n*BOUNDARY\n90,1,3\n\
           *SURFACE,NAME=END\n"
        + &body.faces(shape, |p| p.x > 1.0 - 1e-9)
        + "*TIE,NAME=T\nEND,END\n*INITIAL CONDITIONS,TYPE=STRESS\n1,1,0.,0.,0.,0.,0.,0.\n\
           *AMPLITUDE,NAME=A\n0.,1.\n*STEP\n*STATIC\n*CLOAD,AMPLITUDE=A\n3,1,1.\n*END STEP\n";
    assert!(parse(good.as_bytes(), Path::new("deck.inp"), Units::MetreNewton).is_ok());
    for (old, new, named) in [
        ("*STEP\n", "*STEP,NLGEOM\n", "*STEP, NLGEOM"),
        ("*SPRING,", "*SPRING,NONLINEAR,", "*SPRING: parameter \"NONLINEAR\""),
        ("*TIE,", "*TIE,CYCLIC SYMMETRY,", "*TIE: parameter \"CYCLIC SYMMETRY\""),
        ("*CLOAD,", "*CLOAD,LOAD CASE=2,", "*CLOAD: parameter \"LOAD CASE\""),
        ("*CLOAD,", "*CLOAD,TIME DELAY=1.,", "*CLOAD: parameter \"TIME DELAY\""),
        ("*STATIC\n", "*HEAT TRANSFER,FREQUENCY\n", "*HEAT TRANSFER: parameter \"FREQUENCY\""),
        ("*CLOAD,", "*DLOAD\nALL,CENTRIF,5.,0.,0.,0.,0.,1.,0.\n*CLOAD,", "load \"CENTRIF\""),
        (
            "*STEP\n",
            "*SHELL SECTION,ELSET=S,COMPOSITE\n1.,,M\n*STEP\n",
            "*SHELL SECTION: parameter \"COMPOSITE\"",
        ),
        ("TYPE=STRESS", "TYPE=PLASTIC STRAIN", "TYPE=\"PLASTIC STRAIN\""),
    ] {
        let line = refusal(&good.replacen(old, new, 1));
        assert!(line.contains(named), "{line}");
    }
    let small = good.replace("*STEP\n", "*STEP,NLGEOM=NO\n");
    assert!(parse(small.as_bytes(), Path::new("deck.inp"), Units::MetreNewton).is_ok());
}

#[test]
fn faults_are_named_with_their_lines() {
    let mut body = Body::default();
    body.fill("C3D20", UNIT, [1, 1, 1]);
    let good =
        body.text("C3D20") + LAW + &body.corner() + "*STEP\n*STATIC\n*CLOAD\n3,1,1.\n*END STEP\n";
    assert!(parse(good.as_bytes(), Path::new("deck.inp"), Units::MetreNewton).is_ok());
    let line = refusal(&good.replace("3,1,1.\n", "99,1,1.\n3,7,1.\n"));
    // A card ends at its first fault; the next card is read all the same.
    assert!(line.contains("node 99 is not defined"), "{line}");
    let more = good.replace("*STEP\n", "*NODE\n500,3,3,3\n501,4,3,3\n502,5,3,3\n*ELEMENT,TYPE=SPRINGA,ELSET=S\n900,500,501,502\n*SPRING,ELSET=S\n1.\n*STEP\n");
    let deck = parse(more.as_bytes(), Path::new("deck.inp"), Units::MetreNewton).unwrap();
    assert!(deck.notes.iter().any(|n| n.contains("the first 2 are its own")), "{:?}", deck.notes);
    let noted = good.replace("*STEP\n", "*NSET,NSET=ASKED\n3,99\n*STEP\n");
    let deck = parse(noted.as_bytes(), Path::new("deck.inp"), Units::MetreNewton).unwrap();
    assert!(deck.notes.iter().any(|n| n.contains("node 99 is not defined")), "{:?}", deck.notes);
    let line = refusal(&good.replace("200.,.3", "200.,.6").replace("*DENSITY\n3.", "*DENSITY\nx"));
    assert!(line.contains("Poisson") && line.contains("\"x\" is not a number"), "{line}");
    assert!(refusal(&good.replace("*END STEP\n", "")).contains("without *END STEP"));
    let two = "*EQUATION\n1\n3,1,1.\n*EQUATION\n1\n3,1,2.\n";
    let moved = good.replace("*BOUNDARY", &format!("{two}*BOUNDARY"));
    assert!(parse(moved.as_bytes(), Path::new("deck.inp"), Units::MetreNewton).is_ok());
    let free = good.replace(&body.corner(), "*BOUNDARY\n1,1\n");
    let deck = parse(free.as_bytes(), Path::new("deck.inp"), Units::MetreNewton).unwrap();
    let why = deck.solve(&Job::default()).unwrap_err().to_string();
    assert!(why.contains("can move freely"), "{why}");
}
