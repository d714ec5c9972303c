use std::fmt::Write as _;

use intrados_stage::random::Key;

use super::*;
use crate::read::{Fixed, Formulation, Load, Pressure, SectionKind, Stiffening};

fn parse_text(text: &str) -> Result<Deck, String> {
    parse(text.as_bytes(), Path::new("a.inp"), Units::MetreNewton).map_err(|e| e.to_string())
}

/// A cantilever of `n` cubes along x, in the form of CalculiX examples: nodes 1 + i + (n + 1)(j +
/// 2k).
fn cantilever(n: usize) -> String {
    let mut deck = String::from("*NODE, NSET=NALL\n");
    for k in 0..2 {
        for j in 0..2 {
            for i in 0..=n {
                writeln!(deck, "{},{i},{j},{k}", 1 + i + (n + 1) * (j + 2 * k)).unwrap();
            }
        }
    }
    deck += "*ELEMENT, TYPE=C3D8, ELSET=EALL\n";
    for i in 0..n {
        let id = |i: usize, j: usize, k: usize| 1 + i + (n + 1) * (j + 2 * k);
        let c = [
            id(i, 0, 0),
            id(i + 1, 0, 0),
            id(i + 1, 1, 0),
            id(i, 1, 0),
            id(i, 0, 1),
            id(i + 1, 0, 1),
            id(i + 1, 1, 1),
            id(i, 1, 1),
        ];
        writeln!(deck, "{},{}", i + 1, c.map(|c| c.to_string()).join(",")).unwrap();
    }
    deck += "*MATERIAL,NAME=C\n*ELASTIC\n30000.0,0.2\n*SOLID SECTION,ELSET=EALL,MATERIAL=C\n*BOUNDARY\n";
    for j in 0..4 {
        writeln!(deck, "{},1,3", 1 + (n + 1) * j).unwrap();
    }
    deck += "*STEP\n*STATIC,SOLVER=SPOOLES\n*CLOAD\n";
    writeln!(deck, "{},3,-0.25", n + 1).unwrap();
    deck += "*DLOAD\n1,P6,1.0\n*NODE PRINT,NSET=NALL,FREQUENCY=0\nU\n*NODE FILE\nU\n*EL FILE\nS\n*END STEP\n";
    deck
}

#[test]
fn a_deck_in_calculix_form_is_read() {
    let deck = parse_text(&cantilever(3)).unwrap();
    let mesh = &deck.mesh;
    assert_eq!((mesh.nodes.len(), mesh.hexes.len(), deck.formulations.len()), (16, 3, 3));
    assert!((mesh.volume() - 3.0).abs() < 1e-14);
    assert_eq!(deck.formulations[0], Formulation::Full);
    assert_eq!(
        (mesh.regions.as_slice(), deck.sections[0].kind),
        (["EALL".to_owned()].as_slice(), SectionKind::Solid)
    );
    assert_eq!(deck.materials[0].elastic, Some((30000.0, 0.2)));
    assert_eq!(deck.boundary.len(), 12);
    assert_eq!(deck.boundary[0], Fixed { node: 0, component: 0, value: 0.0, amplitude: None });
    let step = &deck.steps[0];
    assert_eq!((step.duration, step.ramp, &step.boundary), (1.0, true, &deck.boundary));
    assert_eq!(step.loads, [Load { node: 3, component: 2, value: -0.25, amplitude: None }]);
    assert_eq!(
        step.pressures,
        [Pressure { element: ElementId::Hex(0), face: 5, value: 1.0, amplitude: None }]
    );
    // P6 is the face ξ = −1: here x = 0.
    assert_eq!(mesh.face_middle(HexFace { hex: 0, face: 5 }).0.x, 0.0);
    assert_eq!(mesh.node_sets["NALL"].len(), 16);
    assert!(
        deck.notes.iter().any(|n| n.contains("*NODE PRINT only concerns output")),
        "{:?}",
        deck.notes
    );
    assert!(deck.notes.iter().any(|n| n.contains("SOLVER is not heeded")));
}

#[test]
fn millimetres_become_metres() {
    let deck = cantilever(1)
        .replace("*SOLID", "*DENSITY\n2.5e-9\n*SPECIFIC HEAT\n9e8\n*EXPANSION\n1e-5\n*SOLID");
    let deck = deck.replace("*DLOAD\n", "*DLOAD\nEALL,GRAV,9810.,0,0,-2\n");
    let deck = parse(deck.as_bytes(), Path::new("a.inp"), Units::MillimetreNewton).unwrap();
    let near = |a: f64, b: f64| (a - b).abs() < 1e-12 * b.abs();
    assert!(near(deck.mesh.volume(), 1e-9));
    assert!(near(deck.materials[0].elastic.unwrap().0, 30e9));
    assert!(near(deck.materials[0].density.unwrap(), 2500.0));
    assert!(near(deck.materials[0].specific_heat.unwrap(), 900.0));
    assert_eq!(deck.materials[0].expansion, Some(1e-5));
    assert_eq!(deck.steps[0].loads[0].value, -0.25);
    assert!(near(deck.steps[0].pressures[0].value, 1e6));
    assert!(near(deck.steps[0].bodies[0].acceleration.z, -9.81));
}

/// Everything at once: two cubes, a shell, an embedded rod, sets, surfaces, stages.
const FULL: &str = "*HEADING
a title
** a comment
*Node
1, 0., 0., 0.
2, 1., 0., 0.
3, 1., 1., 0.
4, 0., 1., 0.
5, 0., 0., 1.
6, 1., 0., 1.
7, 1., 1., 1.
8, 0., 1., 1.
11, 0., 0., 2.
12, 1., 0., 2.
13, 1., 1., 2.
14, 0., 1., 2.
21, 0.5, 0.5, 0.25
22, 0.5, 0.5, 1.75
*Node, nset=far, system=C
31, 2., 90., 0.
*ELEMENT, TYPE=C3D8I, ELSET=lower
1, 1,2,3,4,
5,6,7,8
*ELEMENT, TYPE=C3D8R, ELSET=upper
2, 5,6,7,8, 11,12,13,14
*ELEMENT, TYPE=S4R, ELSET=pipe
3, 11,12,13,14
*ELEMENT, TYPE=T3D2, ELSET=tendon
4, 21, 22
*ELSET, ELSET=solids
lower, upper
*ELSET, ELSET=all, GENERATE
1, 100, 1
*NSET, NSET=bottom, GENERATE
1, 4, 1
*NSET, NSET=top
11, 12, 13, 14,
*NSET, NSET=more
bottom, top
*SURFACE, NAME=inner, TYPE=ELEMENT
upper, S2
*AMPLITUDE, NAME=grow
0., 0., 10., 1.,
20., 1.5
*MATERIAL, NAME=Concrete
*ELASTIC
3.3D10, 0.2
*DENSITY
2500.
*MATERIAL, NAME=steel
*ELASTIC, TYPE=ISO
2e11, 0.3
*SOLID SECTION, ELSET=solids, MATERIAL=concrete
*SHELL SECTION, ELSET=pipe, MATERIAL=STEEL
0.01, 5
*SOLID SECTION, ELSET=tendon, MATERIAL=steel
1.4e-4
*EMBEDDED ELEMENT, HOST ELSET=solids
tendon
*INITIAL CONDITIONS, TYPE=STRESS
tendon, 1.1e9
lower, 1., 2., 3., 4., 5., 6.
*INITIAL CONDITIONS, TYPE=STRESS
2, 1, 1., 0., 0., 0., 0., 0.
2, 2, 3., 0., 0., 0., 0., 0.
*INITIAL CONDITIONS, TYPE=TEMPERATURE
more, 20.
*BOUNDARY
bottom, PINNED
1, 1, 2
*STEP, NAME=first
*STATIC
0.1, 2., , 0.5
*MODEL CHANGE, TYPE=ELEMENT, REMOVE
upper
*CLOAD
top, 3, -5.
*END STEP
*STEP, AMPLITUDE=STEP
*STATIC
*MODEL CHANGE, ADD
upper,
*CLOAD, OP=NEW, AMPLITUDE=grow
11, 1, 7.
*BOUNDARY
12, 2, , 0.001
*DSLOAD
inner, P, 3e5
*DLOAD
, GRAV, 9.81, 0, 0, -1
3, P, 100.
*TEMPERATURE
top, 35.
*OUTPUT, FIELD, VARIABLE=PRESELECT
*END STEP
";

#[test]
fn all_that_is_supported_is_read() {
    let deck = parse_text(FULL).unwrap();
    let mesh = &deck.mesh;
    assert_eq!(
        [mesh.nodes.len(), mesh.hexes.len(), mesh.shells.len(), mesh.rods.len()],
        [15, 2, 1, 1]
    );
    assert!(mesh.nodes[14].distance(glam::DVec3::new(0.0, 2.0, 0.0)) < 1e-15);
    assert_eq!(mesh.regions, ["SOLIDS", "PIPE", "TENDON"]);
    assert_eq!(deck.sections[1].kind, SectionKind::Shell { thickness: 0.01 });
    assert_eq!(deck.sections[2].kind, SectionKind::Rod { area: 1.4e-4 });
    assert_eq!((mesh.hexes[1].region, mesh.shells[0].region, mesh.rods[0].region), (0, 1, 2));
    assert_eq!(mesh.element_sets["ALL"].len(), 4);
    assert_eq!(mesh.node_sets["MORE"], [0, 1, 2, 3, 8, 9, 10, 11]);
    assert_eq!(mesh.face_sets["INNER"], [HexFace { hex: 1, face: 1 }]);
    assert_eq!(deck.amplitudes[0].points, [(0.0, 0.0), (10.0, 1.0), (20.0, 1.5)]);
    assert_eq!(deck.embedded[0].rods, [0]);
    assert_eq!(deck.embedded[0].hosts, [0, 1]);
    // 11, 22, 33, 12, 13, 23 become xx, yy, zz, xy, yz, zx.
    assert_eq!(deck.initial_stress[1].stress, [1.0, 2.0, 3.0, 4.0, 6.0, 5.0]);
    assert_eq!(deck.initial_stress[0].stress[0], 1.1e9);
    assert_eq!(deck.initial_stress[2].stress[0], 2.0);
    assert_eq!(deck.initial_temperature.len(), 8);
    assert_eq!(deck.boundary.len(), 12);

    let [first, second] = deck.steps.as_slice() else { panic!() };
    assert_eq!(
        (first.name.as_str(), first.duration, first.increments),
        ("first", 2.0, [Some(0.1), None, Some(0.5)])
    );
    assert_eq!(
        (first.changes[0].add, first.changes[0].elements.as_slice()),
        (false, [ElementId::Hex(1)].as_slice())
    );
    assert_eq!(first.loads.len(), 4);
    assert!(!second.ramp && second.changes[0].add);
    // OP=NEW dropped the forces of the first step; supports are kept and one is added.
    assert_eq!(second.loads, [Load { node: 8, component: 0, value: 7.0, amplitude: Some(0) }]);
    assert_eq!(second.boundary.len(), 13);
    assert!(second.boundary.contains(&Fixed {
        node: 9,
        component: 1,
        value: 0.001,
        amplitude: None
    }));
    assert_eq!(
        second.pressures[0],
        Pressure { element: ElementId::Hex(1), face: 1, value: 3e5, amplitude: None }
    );
    assert_eq!(second.pressures[1].element, ElementId::Shell(0));
    assert_eq!((second.bodies[0].elements.len(), second.bodies[0].acceleration.z), (4, -9.81));
    assert_eq!(second.temperatures.len(), 4);
    for note in [
        "line 24: C3D8R is computed as C3D8I",
        "S4R is computed as S4",
        "*OUTPUT only",
        "averaged",
        "1 of 15 nodes belong to no element, node 31",
    ] {
        assert!(deck.notes.iter().any(|n| n.contains(note)), "{note}: {:?}", deck.notes);
    }
}

/// What an edit of a deck is answered with.
#[track_caller]
fn refused(deck: &str, from: &str, to: &str, expected: &str) {
    assert!(deck.contains(from), "{from:?} is not in the deck");
    let error = parse_text(&deck.replacen(from, to, 1)).unwrap_err();
    assert!(error.starts_with("a.inp") && error.contains(expected), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");
}

#[test]
fn every_flaw_is_named_with_its_line() {
    let deck = cantilever(2);
    for (from, to, expected) in [
        ("2,1,0,0", "2,nan,0,0", "a.inp:3: \"nan\" is not a finite number"),
        ("2,1,0,0", "2,1,0", "a.inp:3: 4 fields are needed"),
        ("2,1,0,0", "-2,1,0,0", "a.inp:3: \"-2\" is not a number of a node"),
        ("2,1,0,0", "1,1,0,0", "a.inp:3: node 1 is defined a second time; the first is in line 2"),
        (
            "1,1,2,5,4,7,8,11,10",
            "1,1,2,5,4,7,8,11,99",
            "a.inp:15: element 1: node 99 is not defined",
        ),
        ("1,1,2,5,4,7,8,11,10", "1,1,2,5,4,7,8,11", "a.inp:15: element 1 has 7 nodes, not 8"),
        ("1,1,2,5,4,7,8,11,10", "1,1,4,5,2,7,10,11,8", "a.inp:15: hex 1: inverted or flat"),
        (
            "2,2,3,6,5,8,9,12,11",
            "2,1,2,5,4,7,8,11,10",
            "a.inp:16: hex 2: has the same nodes as hex 1",
        ),
        (
            "2,2,3,6,5,8,9,12,11",
            "1,2,3,6,5,8,9,12,11",
            "a.inp:16: element 1 is defined a second time; the first is in line 15",
        ),
        (
            "TYPE=C3D8,",
            "TYPE=C3D10,",
            "a.inp:14: elements of type \"C3D10\" are not supported; supported are C3D8",
        ),
        ("TYPE=C3D8,", "TYP=C3D8,", "a.inp:14: *ELEMENT: parameter \"TYP\" is not supported"),
        (
            "*MATERIAL",
            "*CREEP\n1,2\n*MATERIAL",
            "a.inp:17: *CREEP is not supported; supported are *NODE",
        ),
        (
            "*MATERIAL",
            "*INCLUDE, INPUT=b.inp\n*MATERIAL",
            "a.inp:17: *INCLUDE is not followed: put the other file's lines here",
        ),
        ("*MATERIAL", "*PART, NAME=p\n*MATERIAL", "write a flat input file"),
        ("30000.0,0.2", "30000.0,0.5", "Poisson's ratio must be"),
        ("30000.0,0.2", "-1,0.2", "Young's modulus must be above 0"),
        ("30000.0,0.2", "30000.0,0.2,0\n31000,0.2,100", "one line of data here; tables"),
        ("MATERIAL=C", "MATERIAL=D", "material \"D\" is not defined"),
        ("ELSET=EALL,MATERIAL", "ELSET=E,MATERIAL", "element set \"E\" is not defined"),
        ("*SOLID SECTION,ELSET=EALL,MATERIAL=C\n", "", "a.inp:15: hex 1 has no section"),
        (
            "*BOUNDARY",
            "*SOLID SECTION,ELSET=EALL,MATERIAL=C\n*BOUNDARY",
            "hex 1 has a section already",
        ),
        ("1,1,3\n", "1,1,7\n", "\"7\" is no component"),
        ("1,1,3\n", "1,3,1\n", "the last component (1) is before the first (3)"),
        (
            "1,1,3\n",
            "1,1,3\n1,2,2,0.1\n",
            "component 2 of node 1 was given another value in line 22",
        ),
        ("3,3,-0.25", "3,3,-inf", "not a finite number"),
        ("3,3,-0.25", "3,3,-0.25\n3,3,1.", "programs differ on whether that adds up"),
        ("1,P6,1.0", "1,P7,1.0", "hexahedra have P1 to P6"),
        ("1,P6,1.0", "1,TRVEC,1.0", "supported: P1 to P6"),
        ("1,P6,1.0", "9,P6,1.0", "element 9 is not defined"),
        ("*STEP\n", "*STEP, NLGEOM\n", "large displacements"),
        ("*END STEP\n", "", "*STEP without *END STEP: is the deck cut off?"),
        ("*STEP\n", "", "a.inp:26: *STATIC must stand in a *STEP"),
        ("*CLOAD\n", "*CLOAD, AMPLITUDE=none\n", "amplitude \"NONE\" is not defined"),
        ("*NODE, NSET=NALL\n", "1,0,0,0\n*NODE, NSET=NALL\n", "a.inp:1: a deck begins with a card"),
        (
            "*MATERIAL",
            "*NSET,NSET=x,GENERATE\n100,200,1\n*MATERIAL",
            "none of 100 to 200 by 1 is defined",
        ),
        ("*MATERIAL", "*NSET,NSET=x\n\u{0}\n*MATERIAL", "a.inp:18: a zero byte"),
    ] {
        refused(&deck, from, to, expected);
    }
    for (from, to, expected) in [
        ("tendon\n*INITIAL", "lower\n*INITIAL", "hex 1 cannot be embedded"),
        ("HOST ELSET=solids", "HOST ELSET=tendon", "rod 4 cannot be a host"),
        ("1.4e-4", "", "the line with the cross-section's area is missing"),
        ("1.4e-4", "0", "must be above 0"),
        ("lower, 1., 2.", "tendon, 1.\nlower, 1., 2.", "rod 4 has an initial stress already (line"),
        ("10., 1.,", "0., 1.,", "must ascend"),
        ("*MODEL CHANGE, ADD\n", "*MODEL CHANGE, ADD=WITH STRAIN\n", "born free of strain"),
        ("*MODEL CHANGE, ADD\n", "*MODEL CHANGE\n", "either ADD or REMOVE"),
        ("inner, P, 3e5", "outer, P, 3e5", "surface \"outer\" is not defined"),
        ("GRAV, 9.81, 0, 0, -1", "GRAV, 9.81, 0, 0, 0", "the direction has no length"),
        ("GRAV, 9.81, 0, 0, -1", "GRAV, 9.81, 0, 0", "and the direction x, y, z"),
        ("upper, S2", "upper, S9", "hexahedra have S1 to S6"),
    ] {
        refused(FULL, from, to, expected);
    }
}

#[test]
fn garbage_is_refused_in_one_line() {
    let read = |bytes: &[u8]| {
        parse(bytes, Path::new("a.inp"), Units::MetreNewton).unwrap_err().to_string()
    };
    assert!(read(b"").contains("no cards in it"));
    assert!(read(b"** nothing\n").contains("no cards"));
    assert!(read(b"\x7fELF\x02\x01\x01\x00").contains("a.inp:1: a zero byte"));
    assert!(read(b"*NODE\n1,0,0,\xff\n").contains("a.inp:2: not UTF-8"));
    assert!(read(&vec![b'7'; 100_000]).contains("a.inp:1: a line of 100000 bytes"));
    assert!(read(b"*NODE\n1,0,0,0\n").contains("no elements"));
    let noise: Vec<u8> = (0..4096).map(|n| Key::new(1, n).bits(0) as u8).collect();
    assert_eq!(read(&noise).lines().count(), 1);
    assert!(
        matches!(super::read(Path::new("/no/such.inp"), Units::MetreNewton), Err(e) if e.is_missing())
    );
}

/// Half a deck is no deck: cut after any byte before the end of the last card, it is refused, and
/// never panics.
#[test]
fn a_deck_that_is_cut_off_is_refused() {
    let end = FULL.len() - "*END STEP\n".len();
    for cut in 0..end {
        // A first step that is whole makes a shorter deck, which nobody can tell.
        let whole_step =
            FULL[..cut].rfind("*END STEP").is_some() && FULL[..cut].matches("*STEP, ").count() < 2;
        let result = parse(&FULL.as_bytes()[..cut], Path::new("a.inp"), Units::MetreNewton);
        let has_step = FULL[..cut].contains("*STEP, NAME");
        assert!(result.is_err() || whole_step || !has_step, "cut at {cut}");
    }
}

/// Bytes changed, taken out, put in twice, lines swapped: an answer always, in one line where it is
/// a refusal. Seeds are fixed.
#[test]
fn mutated_decks_never_panic() {
    let decks = [FULL.as_bytes().to_vec(), cantilever(2).into_bytes()];
    let (mut accepted, mut refused) = (0, 0);
    for case in 0..6000u64 {
        let key = Key::new(11, case);
        let mut deck = decks[case as usize % 2].clone();
        for m in 0..1 + key.bits(0) % 3 {
            let draw = |d: u32| key.bits(10 + 10 * m + d) as usize;
            let at = draw(0) % deck.len();
            match draw(1) % 6 {
                0 => deck[at] ^= 1 << (draw(2) % 8),
                1 => deck[at] = b"0123456789,-+.eE*=\n \"\xffNaN"[draw(2) % 25],
                2 => drop(deck.drain(at..(at + 1 + draw(2) % 8).min(deck.len()))),
                3 => {
                    let part: Vec<u8> = deck[at..(at + 1 + draw(2) % 40).min(deck.len())].to_vec();
                    let to = draw(3) % deck.len();
                    deck.splice(to..to, part);
                }
                4 => deck.truncate(at.max(1)),
                _ => {
                    let number: &[u8] =
                        [b"99999999999".as_slice(), b"4294967295", b"1e308", b"-1", b"0"]
                            [draw(2) % 5];
                    deck.splice(at..at, number.iter().copied());
                }
            }
        }
        match parse(&deck, Path::new("a.inp"), Units::MillimetreNewton) {
            Ok(deck) => {
                accepted += 1;
                // Whatever was accepted holds together.
                assert!(deck.mesh.check().is_ok());
                assert_eq!(deck.formulations.len(), deck.mesh.hexes.len());
                assert_eq!(deck.sections.len(), deck.mesh.regions.len());
                assert!(
                    deck.steps
                        .iter()
                        .flat_map(|s| &s.loads)
                        .all(|l| l.value.is_finite() && (l.node as usize) < deck.mesh.nodes.len())
                );
            }
            Err(error) => {
                refused += 1;
                assert_eq!(error.to_string().lines().count(), 1, "{error}");
            }
        }
    }
    assert!(accepted > 200 && refused > 2000, "{accepted} {refused}");
}

/// A concrete of Abaqus' damaged plasticity, in mm and N.
const DAMAGED: &str = "*CONCRETE DAMAGED PLASTICITY\n36., 0.1, 1.16, , 1e-5\n*CONCRETE COMPRESSION HARDENING\n12., 0.\n30., 1e-3\n3., 1e-2\n\
    *CONCRETE TENSION STIFFENING, TYPE=DISPLACEMENT\n3., 0.\n1., .05\n0., .2\n*CONCRETE COMPRESSION DAMAGE\n0., 0.\n.9, 1e-2\n\
    *CONCRETE TENSION DAMAGE, TYPE=DISPLACEMENT\n0., 0.\n.95, .2\n";

fn damaged(text: &str) -> Result<Deck, String> {
    let deck = cantilever(1).replace("*SOLID", &format!("{text}*SOLID"));
    parse(deck.as_bytes(), Path::new("a.inp"), Units::MillimetreNewton).map_err(|e| e.to_string())
}

#[test]
fn damaged_plasticity_is_read() {
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9 * b.abs().max(1e-9), "{a} {b}");
    let concrete = |deck: Deck| deck.materials[0].concrete.clone().unwrap();
    let read = concrete(damaged(DAMAGED).unwrap());
    assert_eq!((read.hardening.len(), read.damage), (3, true));
    near(read.hardening[1].0, 30e6);
    let Some(Stiffening::Opening(points)) = read.stiffening else { panic!() };
    near(points[1].0, 1e6);
    near(points[1].1, 5e-5);
    let table = "TYPE=DISPLACEMENT\n3., 0.\n1., .05\n0., .2\n";
    let read = concrete(damaged(&DAMAGED.replace(table, "TYPE=GFI\n3., .1\n")).unwrap());
    let Some(Stiffening::Energy { strength, energy }) = read.stiffening else { panic!() };
    near(strength, 3e6);
    near(energy, 100.0);
    let read = concrete(damaged(&DAMAGED.replace(table, "TYPE=STRAIN\n3.,0.\n.3,2e-3\n")).unwrap());
    assert_eq!(read.stiffening, Some(Stiffening::Strain(vec![(3e6, 0.0), (0.3 * 1e6, 2e-3)])));
}

/// Every fault is named with its line.
#[test]
fn tables_of_concrete_that_say_nothing_are_refused() {
    for (from, to, reason) in [
        ("*CONCRETE DAMAGED PLASTICITY\n36., 0.1, 1.16, , 1e-5\n", "", "must stand below"),
        ("12., 0.\n", "12., 1e-4\n", "inelastic strain 0"),
        ("3., 1e-2\n", "3., 1e-3\n", "must grow"),
        ("3., 1e-2\n", "3., 1e-2, 0., 20.\n", "no rate and no temperature"),
        ("30., 1e-3\n", "-30., 1e-3\n", "must not be negative"),
        ("1., .05\n", "4., .05\n", "grows up to cracking displacement"),
        ("TYPE=DISPLACEMENT\n3., 0.\n", "TYPE=WIDTH\n3., 0.\n", "STRAIN, DISPLACEMENT and GFI"),
        (".9, 1e-2\n", "1.9, 1e-2\n", "a damage of 1.9"),
        ("36., 0.1, 1.16, , 1e-5\n", "36., 0.1, 1.16, .6, 0., 20.\n", "at most five numbers"),
        ("12., 0.\n30., 1e-3\n3., 1e-2\n", "", "has no data"),
    ] {
        let why = damaged(&DAMAGED.replacen(from, to, 1)).unwrap_err();
        assert!(why.contains(reason) && why.starts_with("a.inp:"), "{why} / {reason}");
    }
    let alone = DAMAGED.split("*CONCRETE TENSION STIFFENING").next().unwrap();
    assert!(damaged(alone).unwrap_err().contains("needs *CONCRETE TENSION STIFFENING"));
    assert!(damaged(&format!("{DAMAGED}{DAMAGED}")).unwrap_err().contains("already"));
}
