//! Steps and elements by closed forms, and beams by CalculiX 2.20.

use std::{f64::consts::PI, fmt::Write as _, path::Path};

use glam::DVec3;
use intrados_stage::Job;

use super::{parse, solve::Solved};
use crate::read::Units;

const E: f64 = 200.0;

fn solve(deck: &str) -> Vec<Solved> {
    let deck = parse(deck.as_bytes(), Path::new("deck.inp"), Units::MetreNewton).unwrap();
    deck.solve(&Job::default()).unwrap()
}

fn near(a: f64, b: f64, by: f64) {
    assert!((a - b).abs() <= by, "{a} is not {b} within {by}");
}

/// A bar along x of so many C3D20 of side `width`, with sets ALL, LOW (x = 0) and HIGH (x = length).
fn bar(length: f64, parts: usize, width: f64, kind: &str) -> String {
    let mut text = String::from("*NODE,NSET=ALL\n");
    // Stations by halves of elements; nodes of a section: corners, then middles of its edges.
    let section = [[0, 0], [2, 0], [2, 2], [0, 2], [1, 0], [2, 1], [1, 2], [0, 1]];
    let number = |station: usize, k: usize| 10 * station + k + 1;
    for station in 0..=2 * parts {
        let count = if station.is_multiple_of(2) { 8 } else { 4 };
        for (k, [y, z]) in section.iter().enumerate().take(count) {
            let x = length * station as f64 / (2 * parts) as f64;
            let [y, z] = [y, z].map(|v| f64::from(*v) * 0.5 * width);
            writeln!(text, "{},{x:?},{y:?},{z:?}", number(station, k)).unwrap();
        }
    }
    writeln!(text, "*ELEMENT,TYPE={kind},ELSET=ALL").unwrap();
    for e in 0..parts {
        let at = |half: usize, k: usize| number(2 * e + half, k);
        let nodes = (0..4)
            .map(|k| at(0, k))
            .chain((0..4).map(|k| at(2, k)))
            .chain((4..8).map(|k| at(0, k)))
            .chain((4..8).map(|k| at(2, k)))
            .chain((0..4).map(|k| at(1, k)));
        let list: Vec<String> = nodes.map(|n| n.to_string()).collect();
        writeln!(text, "{},{},\n{}", e + 1, list[..10].join(","), list[10..].join(",")).unwrap();
    }
    for (set, station) in [("LOW", 0), ("HIGH", 2 * parts)] {
        let (first, last) = (number(station, 0), number(station, 7));
        writeln!(text, "*NSET,NSET={set},GENERATE\n{first},{last}").unwrap();
    }
    text + "*MATERIAL,NAME=M\n*ELASTIC\n200.,.3\n*DENSITY\n3.\n*CONDUCTIVITY\n2.\n*SPECIFIC HEAT\n5.\n\
            *SOLID SECTION,ELSET=ALL,MATERIAL=M\n"
}

/// Waves along a bar that cannot widen: λ = ((2n − 1) π/2L)² M/ρ, M = E(1 − ν)/((1 + ν)(1 − 2ν)).
#[test]
fn a_bar_vibrates_along_itself_as_waves_do() {
    let steps = "*BOUNDARY\nLOW,1\nALL,2,3\n*STEP\n*FREQUENCY\n2\n*END STEP\n";
    let found = &solve(&(bar(1.0, 8, 0.3, "C3D20") + steps))[0].eigenvalues;
    let modulus = E * 0.7 / (1.3 * 0.4);
    assert_eq!(found.len(), 2);
    for (n, value) in found.iter().enumerate() {
        let wave = (2 * n + 1) as f64 * 0.5 * PI;
        near(value / (wave * wave * modulus / 3.0), 1.0, 2e-4);
    }
}

/// Nothing holds it: six motions without strain, then what strains it.
#[test]
fn bodies_that_nothing_holds_vibrate() {
    let deck = bar(1.0, 2, 0.3, "C3D20") + "*STEP\n*FREQUENCY\n7\n*END STEP\n";
    let found = &solve(&deck)[0].eigenvalues;
    assert!(found[5].abs() < 1e-6 * found[6], "{found:?}");
}

/// Warmed through at one end, free to grow: all of it grows alike, without stress.
#[test]
fn blocks_grow_as_warm_as_they_settle() {
    let deck = cube(
        "*STEP\n*HEAT TRANSFER,STEADY STATE\n*BOUNDARY\nLOW,11,11,100.\n*END STEP\n*STEP\n*STATIC\n*END STEP\n",
    );
    let solved = solve(&deck);
    near(*solved[0].temperatures.last().unwrap(), 100.0, 1e-9);
    near(solved[1].displacements.last().unwrap().x, 0.1, 1e-9);
    solved[1].stresses.iter().flatten().flatten().for_each(|s| near(*s, 0.0, 1e-7));
}

/// A pair of blocks that an equation binds goes on alone once the equation is removed.
#[test]
fn equations_hold_until_they_are_removed() {
    let deck = bar(1.0, 1, 1.0, "C3D20")
        + "*EQUATION\n2\n21,1,1.,22,1,-1.\n*BOUNDARY\nLOW,1,3\nALL,2,3\n*STEP\n*STATIC\n*CLOAD\n21,1,1.\n*END STEP\n\
           *STEP\n*STATIC\n*EQUATION,REMOVE\n21,1\n*END STEP\n";
    let solved = solve(&deck);
    let apart = |k: usize| solved[k].displacements[12].x - solved[k].displacements[13].x;
    near(apart(0), 0.0, 1e-12);
    assert!(apart(1) > 1e-3, "{}", apart(1));
}

/// One element between planes of symmetry, with sides HIGH at x = 1.
fn cube(steps: &str) -> String {
    bar(1.0, 1, 1.0, "C3D20").replace("*DENSITY", "*EXPANSION\n1e-3\n*DENSITY")
        + "*BOUNDARY\nLOW,1\n1,2,3\n2,3\n4,2\n11,2,3\n12,3\n5,3\n8,2\n14,2\n21,2,3\n22,3\n24,2\n25,3\n28,2\n"
        + steps
}

/// Euler's column with a free end: P = π² E I/(4 L²); both planes alike, so that each factor comes
/// twice.
#[test]
fn a_column_buckles_at_the_load_of_euler() {
    let length = 20.0;
    // Over a face of eight nodes an even load is −1/12 at corners and 1/3 between them.
    let load = "*CLOAD\n241,1,.0833333333333333\n242,1,.0833333333333333\n243,1,.0833333333333333\n\
                244,1,.0833333333333333\n245,1,-.333333333333333\n246,1,-.333333333333333\n\
                247,1,-.333333333333333\n248,1,-.333333333333333\n";
    let steps = format!("*BOUNDARY\nLOW,1\n1,2,3\n2,3\n*STEP\n*BUCKLE\n2\n{load}*END STEP\n");
    let found = &solve(&(bar(length, 12, 0.5, "C3D20") + &steps))[0].eigenvalues;
    let euler = PI.powi(2) * E * 0.5f64.powi(4) / 12.0 / (4.0 * length * length);
    near(found[0] / euler, 1.0, 0.01);
    near(found[1] / found[0], 1.0, 1e-6);
}

/// Steady: linear between what is held, and a flux that radiates away. Over time: a slab that
/// cools from 1 at both ends, T = Σ 4/(nπ) sin(nπ/2) exp(−n²π²αt/L²) in its middle.
#[test]
fn slabs_conduct_radiate_and_cool_as_closed_forms_say() {
    let slab = bar(1.0, 8, 0.3, "C3D20");
    let held = slab.clone()
        + "*STEP\n*HEAT TRANSFER,STEADY STATE\n*BOUNDARY\nLOW,11,11,10.\nHIGH,11,11,30.\n*END STEP\n";
    let temperatures = &solve(&held)[0].temperatures;
    // The third section of 17, of eight, four, eight nodes …
    near(temperatures[12], 12.5, 1e-9);
    let radiating = slab.clone()
        + "*PHYSICAL CONSTANTS,ABSOLUTE ZERO=-10.,STEFAN BOLTZMANN=.01\n*STEP\n*HEAT TRANSFER,STEADY STATE\n\
           *BOUNDARY\nLOW,11,11,0.\n*RADIATE\n8,R2,-5.,.5\n*END STEP\n";
    let end = *solve(&radiating)[0].temperatures.last().unwrap();
    let flux = 0.005 * (5f64.powi(4) - (end + 10.0).powi(4));
    near(2.0 * end, flux, 1e-8);
    let cooling = slab
        + "*INITIAL CONDITIONS,TYPE=TEMPERATURE\nALL,1.\n*STEP\n*HEAT TRANSFER\n.01,1.\n\
           *BOUNDARY\nLOW,11,11,0.\nHIGH,11,11,0.\n*END STEP\n";
    let middle = solve(&cooling)[0].temperatures[8 * 5 + 4 * 4 - 8];
    let decay = PI.powi(2) * 2.0 / 15.0;
    let series: f64 =
        [1.0, -3.0, 5.0].iter().map(|n: &f64| 4.0 / (n * PI) * (-n * n * decay).exp()).sum();
    near(middle, series, 2e-4);
}

/// A law that is soft when warm; a spring in line with it; the end turned as one body.
#[test]
fn laws_follow_temperatures_and_springs_their_ends() {
    let warm = bar(1.0, 1, 1.0, "C3D20")
        .replace("*ELASTIC\n200.,.3\n", "*ELASTIC\n200.,0.,0.\n100.,0.,100.\n*EXPANSION\n0.\n")
        + "*NODE\n900,2.,0.,0.\n*ELEMENT,TYPE=SPRINGA,ELSET=S\n900,21,900\n*SPRING,ELSET=S\n50.\n\
           *BOUNDARY\nLOW,1,3\n900,1,3\n*EQUATION\n2\n22,1,1.,21,1,-1.\n*EQUATION\n2\n23,1,1.,21,1,-1.\n\
           *EQUATION\n2\n24,1,1.,21,1,-1.\n*EQUATION\n2\n25,1,1.,21,1,-1.\n*EQUATION\n2\n26,1,1.,21,1,-1.\n\
           *EQUATION\n2\n27,1,1.,21,1,-1.\n*EQUATION\n2\n28,1,1.,21,1,-1.\n*STEP\n*STATIC\n\
           *TEMPERATURE\nALL,50.\n*CLOAD\n21,1,4.\n*END STEP\n";
    let deck = parse(warm.as_bytes(), Path::new("deck.inp"), Units::MetreNewton).unwrap();
    let at = deck.labels().iter().position(|&l| l == 21).unwrap();
    // E A/L = 150 beside 50.
    near(deck.solve(&Job::default()).unwrap()[0].displacements[at].x, 0.02, 1e-10);
}

/// One S8 pulled along x by forces as two elements of a plane would share them: everywhere the same
/// stress, through the thickness too.
#[test]
fn forces_on_an_edge_of_a_shell_pull_it_evenly() {
    let deck = "*NODE\n1,0,0\n2,2,0\n3,2,1\n4,0,1\n5,1,0\n6,2,.5\n7,1,1\n8,0,.5\n\
                *ELEMENT,TYPE=S8,ELSET=ALL\n1,1,2,3,4,5,6,7,8\n*MATERIAL,NAME=M\n*ELASTIC\n200.,.3\n\
                *SHELL SECTION,ELSET=ALL,MATERIAL=M\n.1\n\
                *BOUNDARY\n1,1,6\n4,1\n8,1\n4,3\n2,3\n*STEP\n*STATIC\n\
                *CLOAD\n2,1,1.\n3,1,1.\n6,1,4.\n1,1,-1.\n4,1,-1.\n8,1,-4.\n*END STEP\n";
    let solved = solve(deck);
    near(solved[0].displacements[1].x, 60.0 / 200.0 * 2.0, 1e-9);
    for stress in solved[0].stresses.iter().flatten() {
        near(stress[0], 60.0, 1e-7);
        stress[1..].iter().for_each(|s| near(*s, 0.0, 1e-7));
    }
}

/// CalculiX 2.20 on its decks `rot1` (a moment at the end of two B32), `b31` (ten B31, a force) and
/// the tube of `simplebeampipe1` with two elements.
#[test]
fn beams_bend_as_those_of_calculix() {
    let rot = "*NODE\n10,0,0,0\n20,.2,0,0\n30,.4,0,0\n4,.6,0,0\n5,.8,0,0\n\
               *ELEMENT,TYPE=B32,ELSET=ALL\n3,10,20,30\n5,30,4,5\n*MATERIAL,NAME=M\n*ELASTIC\n210000.,.3\n\
               *BEAM SECTION,MATERIAL=M,ELSET=ALL,SECTION=RECT\n.03,.015\n0.,0.,1.\n\
               *BOUNDARY\n10,1,6\n*STEP\n*STATIC\n*CLOAD\n5,6,1.e-3\n*END STEP\n";
    let solved = solve(rot);
    near(solved[0].displacements[4].y, 0.171_399_5, 5e-7);
    near(solved[0].stresses[0][0][0], 762.4759, 5e-3);
    let mut line = String::from("*NODE\n");
    (0..=10).for_each(|i| writeln!(line, "{},0,0,{i}", i + 1).unwrap());
    line += "*ELEMENT,TYPE=B31,ELSET=ALL\n";
    (1..=10).for_each(|i| writeln!(line, "{i},{i},{}", i + 1).unwrap());
    line += "*MATERIAL,NAME=M\n*ELASTIC\n1E7,.3\n*BEAM SECTION,ELSET=ALL,MATERIAL=M,SECTION=RECT\n\
             .25,.25\n1.,0.,0.\n*BOUNDARY\n1,1,6\n*STEP\n*STATIC\n*CLOAD\n11,1,1.\n*END STEP\n";
    near(solve(&line)[0].displacements[10].x, 0.102_148_3, 5e-7);
}

/// Two beams that meet at a right angle, each of its own section, to where CalculiX 2.20 has them.
fn corner(second: &str, kind: &str, load: &str) -> Vec<DVec3> {
    let deck = format!(
        "*NODE\n1,0,0,0\n2,.5,0,0\n3,1,0,0\n4,1,.5,0\n5,1,1,0\n*ELEMENT,TYPE={kind},ELSET=A\n1,1,2,3\n\
         *ELEMENT,TYPE={kind},ELSET=B\n2,3,4,5\n*MATERIAL,NAME=M\n*ELASTIC\n200.,.3\n\
         *BEAM SECTION,ELSET=A,MATERIAL=M,SECTION=RECT\n.1,.15\n0.,0.,1.\n\
         *BEAM SECTION,ELSET=B,MATERIAL=M,{second}\n0.,0.,1.\n\
         *BOUNDARY\n1,1,6\n*STEP\n*STATIC\n*CLOAD\n{load}\n*END STEP\n"
    );
    solve(&deck).remove(0).displacements
}

#[test]
fn beams_that_meet_at_an_angle_turn_there_as_one() {
    let down = corner("SECTION=RECT\n.1,.1", "B32", "5,3,1e-4");
    near(down[2].z, 0.008_738_254, 1e-8);
    near(down[4].z, 0.060_282_43, 5e-8);
    let bent = corner("SECTION=RECT\n.1,.1", "B32", "5,6,1e-4");
    near(bent[4].x, -0.043_579_23, 5e-8);
    let beside = corner("SECTION=RECT,OFFSET1=.5,OFFSET2=-.3\n.1,.1", "B32", "5,1,1e-4");
    near(beside[4].x, 0.030_232_43, 5e-8);
    near(beside[4].z, 0.000_876_016, 1e-8);
}

/// A shell does not resist what turns it about its normal, and has a middle that is somewhere.
#[test]
fn what_a_shell_cannot_bear_is_refused_by_node() {
    let deck = "*NODE\n11,0,0,0\n12,1,0,0\n13,1,1,0\n14,0,1,0\n*ELEMENT,TYPE=S4,ELSET=E\n1,11,12,13,14\n\
                *MATERIAL,NAME=M\n*ELASTIC\n200.,.3\n*SHELL SECTION,ELSET=E,MATERIAL=M\n.2\n\
                *BOUNDARY\n11,1,6\n14,1,6\n*STEP\n*STATIC\n*CLOAD\n12,6,1.\n*END STEP\n";
    let read = |deck: &str| parse(deck.as_bytes(), Path::new("deck.inp"), Units::MetreNewton);
    let why = read(deck).unwrap().solve(&Job::default()).unwrap_err().to_string();
    assert!(why.contains("node 12 "), "{why}");
    for word in ["nan", "inf", "x"] {
        let why = read(&deck.replace("MATERIAL=M\n.2", &format!("MATERIAL=M,OFFSET={word}\n.2")));
        let why = why.unwrap_err().to_string();
        assert!(why.contains("OFFSET is a number"), "{why}");
    }
}

/// A plate on two hinges under its pressure, to where CalculiX 2.20 has it.
#[test]
fn hinges_of_shells_hold_their_middle() {
    let deck = "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,.5,0,0\n6,1,.5,0\n7,.5,1,0\n8,0,.5,0\n\
                *ELEMENT,TYPE=S8,ELSET=E\n1,1,2,3,4,5,6,7,8\n*MATERIAL,NAME=M\n*ELASTIC\n200.,.3\n\
                *SHELL SECTION,ELSET=E,MATERIAL=M\n.2\n*BOUNDARY\n1,1,3\n4,1,3\n8,1,3\n2,3\n3,3\n6,3\n\
                *STEP\n*STATIC\n*DLOAD\nE,P,1.\n*END STEP\n";
    let moved = &solve(deck)[0].displacements;
    near(moved[0].length(), 0.0, 1e-12);
    near(moved[4].z, 0.067_5, 5e-8);
}

#[test]
fn ellipses_bend_as_their_solids_do() {
    let full = corner("SECTION=CIRC\n.1,.12", "B32", "5,3,1e-4");
    near(full[4].z, 0.066_216_87, 5e-8);
    let reduced = corner("SECTION=CIRC\n.1,.12", "B32R", "5,3,1e-4");
    // CalculiX integrates reduced beams by fifty points, we by eight.
    near(reduced[4].z / 0.071_549_42, 1.0, 5e-3);
}

/// Each part stretches by F L/(E A), whatever binds them.
#[test]
fn bars_of_two_sections_stretch_as_both() {
    let deck = "*NODE\n1,0,0,0\n2,1,0,0\n3,2,0,0\n4,3,0,0\n5,4,0,0\n*ELEMENT,TYPE=B32,ELSET=A\n1,1,2,3\n\
                *ELEMENT,TYPE=B32,ELSET=B\n2,3,4,5\n*MATERIAL,NAME=M\n*ELASTIC\n200.,0.\n\
                *BEAM SECTION,ELSET=A,MATERIAL=M,SECTION=RECT\n.2,.2\n\
                *BEAM SECTION,ELSET=B,MATERIAL=M,SECTION=RECT\n.1,.1\n\
                *BOUNDARY\n1,1,6\n*STEP\n*STATIC\n*CLOAD\n5,1,.01\n*END STEP\n";
    let moved = &solve(deck)[0].displacements;
    near(moved[2].x, 0.01 * 2.0 / (200.0 * 0.04), 1e-12);
    // Its face is not even under a force at a node: so CalculiX has it, too (.012 525 05).
    let both = 0.01 * 2.0 / 200.0 * (1.0 / 0.04 + 1.0 / 0.01);
    near(moved[4].x / both, 1.0, 3e-3);
}

/// Both halves of a plate with a fold, pulled along it, stretch alike.
#[test]
fn shells_with_a_fold_stretch_along_it_as_without() {
    let deck = "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,2,0,1\n6,2,1,1\n\
                *ELEMENT,TYPE=S4,ELSET=ALL\n1,1,2,3,4\n2,2,5,6,3\n*MATERIAL,NAME=M\n*ELASTIC\n200.,0.\n\
                *SHELL SECTION,ELSET=ALL,MATERIAL=M\n.1\n*BOUNDARY\n1,1,6\n2,2\n5,2\n2,3\n4,1\n4,3\n\
                *STEP\n*STATIC\n*CLOAD\n4,2,.5\n3,2,1.2071067811865475\n6,2,.7071067811865475\n*END STEP\n";
    let moved = &solve(deck)[0].displacements;
    for node in [2, 3, 5] {
        near(moved[node].y, 1.0 / (200.0 * 0.1), 1e-9);
    }
}
