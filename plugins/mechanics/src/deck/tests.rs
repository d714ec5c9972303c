use std::path::Path;

use super::*;
use crate::read::{Units, abaqus};

const CUBE: &str = "*NODE, NSET=ALL\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n\
    *ELEMENT, TYPE=C3D8, ELSET=BOX\n1,1,2,3,4,5,6,7,8\n*MATERIAL, NAME=C\n*ELASTIC\n30000,0.2\n*DENSITY\n2\n*EXPANSION\n1e-5\n\
    *SOLID SECTION, ELSET=BOX, MATERIAL=C\n*BOUNDARY\n1,1,3\n4,1\n5,1\n8,1\n2,2\n5,2\n6,2\n2,3\n3,3\n4,3\n";

fn case(text: &str) -> Result<Case, String> {
    let deck = abaqus::parse(text.as_bytes(), Path::new("deck.inp"), Units::MetreNewton)
        .map_err(|e| e.to_string())?;
    Case::new(deck).map_err(|e| e.to_string())
}

fn ends(case: &Case) -> Vec<History> {
    let mut ends = Vec::new();
    let marks: Vec<f64> = case.steps.iter().map(|s| s.1).collect();
    let settings = MarchSettings { tolerance: 1e-9, ..MarchSettings::default() };
    case.run(settings, &Job::default(), |_, history, step| {
        ends.extend(marks.contains(&step.time).then(|| history.clone()));
        Ok(())
    })
    .unwrap();
    ends
}

fn stress(case: &Case, history: &History) -> f64 {
    System::new(&case.model).unwrap().points(0, history).unwrap()[0].stress[0]
}

/// Pressure, then a force beside it, then the pressure alone at half its size, by two ramps and a
/// jump.
#[test]
fn steps_follow_each_other() {
    let text = format!(
        "{CUBE}*STEP\n*STATIC\n1,2\n*DLOAD\n1,P4,10\n*END STEP\n*STEP\n*STATIC\n*CLOAD\n2,1,-4\n3,1,-4\n6,1,-4\n7,1,-4\n*END STEP\n\
         *STEP, AMPLITUDE=STEP\n*STATIC\n*DLOAD\n1,P4,5\n*CLOAD, OP=NEW\n*END STEP\n"
    );
    let case = case(&text).unwrap();
    assert_eq!(case.steps.iter().map(|s| s.1).collect::<Vec<_>>(), [2.0, 3.0, 4.0]);
    let found: Vec<f64> = ends(&case).iter().map(|h| stress(&case, h)).collect();
    assert!(found.iter().zip([-10.0, -26.0, -5.0]).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?}");
    let pressure = case.model.loads.iter().find(|l| matches!(l.action, Action::Faces(_))).unwrap();
    let near = |t: f64, f: f64| {
        assert!((pressure.factor(t) - f).abs() < 1e-9, "{t} {}", pressure.factor(t))
    };
    [(0.0, 0.0), (1.0, 0.5), (2.0, 1.0), (2.5, 1.0), (3.0, 1.0), (3.5, 0.5)]
        .iter()
        .for_each(|&(t, f)| near(t, f));
}

/// A support that moves by an amplitude, heat that pushes against it, weight.
#[test]
fn amplitudes_heat_and_weight() {
    let text = format!(
        "{CUBE}*AMPLITUDE, NAME=UP\n0,0,1,1,2,0.5\n*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL,20\n*STEP\n*STATIC\n1,2\n*BOUNDARY, AMPLITUDE=UP\n2,1,1,1e-3\n3,1,1,1e-3\n6,1,1,1e-3\n7,1,1,1e-3\n\
         *TEMPERATURE\nALL,70\n*END STEP\n"
    );
    let case = case(&text).unwrap();
    // Strain 5e-4 moved, 50 K free: nothing is left.
    let end = ends(&case);
    assert!(stress(&case, &end[0]).abs() < 1e-6, "{}", stress(&case, &end[0]));
    let weight = format!("{CUBE}*STEP\n*STATIC\n*DLOAD\nBOX,GRAV,9.81,0,0,-1\n*END STEP\n");
    let case = super::tests::case(&weight).unwrap();
    let Action::Nodes(forces) = &case.model.loads[0].action else { panic!() };
    let sum: DVec3 = forces.iter().map(|f| f.1).sum();
    assert!((sum + 2.0 * 9.81 * DVec3::Z).length() < 1e-12, "{sum}");
}

/// An embedded bar with initial stress: it and the brick share so that nothing is left over: σ_s
/// A_s + σ_c A_c = 0, both shortened alike.
#[test]
fn embedded_bars_bring_their_stress() {
    let bar = "*NODE\n11,0,0.5,0.5\n12,1,0.5,0.5\n*ELEMENT, TYPE=T3D2, ELSET=BAR\n7,11,12\n*MATERIAL, NAME=S\n*ELASTIC\n200000,0.3\n\
        *SOLID SECTION, ELSET=BAR, MATERIAL=S\n0.01\n*EMBEDDED ELEMENT, HOST ELSET=BOX\nBAR\n*INITIAL CONDITIONS, TYPE=STRESS\nBAR,1000\n";
    let text = format!("{CUBE}{bar}*STEP\n*STATIC\n*END STEP\n").replace("30000,0.2", "30000,0.0");
    let case = case(&text).unwrap();
    assert!(case.model.mesh.rods.is_empty() && case.model.steel.len() == 1);
    let end = ends(&case);
    let strain = -1000.0 * 0.01 / (30_000.0 + 200_000.0 * 0.01);
    assert!((stress(&case, &end[0]) / (30_000.0 * strain) - 1.0).abs() < 1e-8);
    assert!((end[0].steel[0][0].stress / (1000.0 + 200_000.0 * strain) - 1.0).abs() < 1e-8);
}

/// Two bricks in a row, the second put in when the first is loaded already: it feels only what
/// comes later.
#[test]
fn elements_are_born_free_of_stress() {
    let second = "*NODE\n9,2,0,0\n10,2,1,0\n13,2,0,1\n14,2,1,1\n*ELEMENT, TYPE=C3D8, ELSET=NEW\n2,2,9,10,3,6,13,14,7\n*SOLID SECTION, ELSET=NEW, MATERIAL=C\n";
    let hold = "*BOUNDARY\n9,2,3\n13,2\n10,3\n";
    let text = format!(
        "{CUBE}{second}{hold}*STEP\n*STATIC\n*MODEL CHANGE, REMOVE\nNEW\n*DLOAD\n1,P4,10\n*END STEP\n*STEP\n*STATIC\n*MODEL CHANGE, ADD\nNEW\n*DLOAD\n2,P4,4\n*END STEP\n"
    );
    let case = case(&text).unwrap();
    let ends = ends(&case);
    let structure = System::new(&case.model).unwrap();
    let at = |hex: usize, k: usize| structure.points(hex, &ends[k]).unwrap()[0].stress[0];
    let near =
        |found: f64, expected: f64| assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    near(at(0, 0), -10.0);
    near(at(1, 0), 0.0);
    near(at(0, 1), -14.0);
    near(at(1, 1), -4.0);
}

#[test]
fn what_cannot_be_computed_is_named() {
    let step = "*STEP\n*STATIC\n*DLOAD\n1,P4,10\n*END STEP\n";
    for (text, reason) in [
        (CUBE.to_owned(), "no *STEP"),
        (
            format!("{CUBE}{step}*STEP\n*STATIC\n*BOUNDARY, OP=NEW\n1,1,3\n*END STEP\n"),
            "supports must stay the same",
        ),
        (
            format!("{CUBE}{step}*STEP\n*STATIC\n*MODEL CHANGE, REMOVE\nBOX\n*END STEP\n"),
            "hex 1 is taken out",
        ),
        (format!("{CUBE}{step}").replace("*ELASTIC\n30000,0.2\n", ""), "material"),
        (format!("{CUBE}*STEP\n*STATIC\n*CLOAD\n7,4,1\n*END STEP\n"), "a moment at node 7"),
        (
            format!("{CUBE}*STEP\n*STATIC\n*DLOAD\nBOX,GRAV,9.81,0,0,-1\n*END STEP\n")
                .replace("*DENSITY\n2\n", ""),
            "no *DENSITY",
        ),
    ] {
        let why = case(&text).unwrap_err();
        assert!(why.contains(reason), "{why} / {reason}");
    }
    // Unheld: said with the label that the deck uses.
    let loose =
        format!("{CUBE}{step}").replace("*BOUNDARY\n1,1,3\n4,1\n5,1\n8,1\n", "*BOUNDARY\n1,2,3\n");
    let why = case(&loose)
        .unwrap()
        .run(MarchSettings::default(), &Job::default(), |_, _, _| Ok(()))
        .unwrap_err()
        .to_string();
    assert!(why.contains("around node 1 is free to move along (1.00, 0.00, 0.00)"), "{why}");
}

/// A cube of 1 m whose far face is drawn away, of concrete that cracks.
fn drawn(stiffening: &str, by: f64) -> String {
    let law = format!(
        "*CONCRETE DAMAGED PLASTICITY\n36,.1,1.16,.667,0\n*CONCRETE COMPRESSION HARDENING\n20e6,0\n30e6,1e-3\n5e6,1e-2\n*CONCRETE TENSION STIFFENING, {stiffening}*SOLID SECTION"
    );
    let moved: String = [2, 3, 6, 7].iter().map(|n| format!("{n},1,1,{by}\n")).collect();
    CUBE.replacen("*SOLID SECTION", &law, 1)
        .replace("30000,0.2", "30e9,0.0")
        .replace("*DENSITY\n2\n", "*DENSITY\n2400\n")
        + &format!("*STEP\n*STATIC\n.005,1\n*BOUNDARY\n{moved}*END STEP\n")
}

/// Drawn apart, it bears what its table of tension says it does, and what all of its cracks took is
/// its fracture energy, however the table is written.
#[test]
fn damaged_plasticity_cracks() {
    for stiffening in [
        "TYPE=DISPLACEMENT\n2.5e6,0\n0,1.6e-4\n",
        "TYPE=GFI\n2.5e6,200\n",
        "TYPE=STRAIN\n2.5e6,0\n0,1.6e-4\n",
    ] {
        let case = case(&drawn(stiffening, 6e-4)).unwrap();
        assert!(case.notes.iter().any(|n| n.contains("f_ct 2.5000 MPa, G_f 200.0000 N/m")));
        let settings = MarchSettings::of_life();
        let (mut work, mut last, mut most) = (0.0, (0.0, 0.0), 0.0_f64);
        case.run(settings, &Job::default(), |_, history, step| {
            let now = (6e-4 * step.time, stress(&case, history));
            work += 0.5 * (now.0 - last.0) * (now.1 + last.1);
            most = most.max(now.1);
            last = now;
            Ok(())
        })
        .unwrap();
        assert!(most > 2.4e6 && most < 2.5e6 * 1.001, "{most}");
        assert!((work / 200.0 - 1.0).abs() < 0.03, "{work} {last:?}");
    }
}

#[test]
fn concrete_that_nobody_can_crack_is_refused() {
    let text = drawn("TYPE=GFI\n2.5e6,200\n", 1e-4);
    for (from, to, reason) in [
        ("2.5e6,200", "25e6,200", "tensile strength"),
        ("30e9,0.0", "30e9,0.48", "Poisson's ratio"),
        ("2.5e6,200", "2.5e6,.2", "fracture energy"),
    ] {
        let why = case(&text.replace(from, to)).unwrap_err();
        assert!(why.contains("line 19: material C") && why.contains(reason), "{why} / {reason}");
    }
}

/// A bar that yields by its table: what it bears is capped.
#[test]
fn bars_in_concrete_yield() {
    let bar = steel::bar(200e9, &[(400e6, 0.0), (450e6, 0.05)]);
    assert_eq!(bar.yielding, 400e6);
    assert!((1.0 / (1.0 / bar.hardening - 1.0 / bar.modulus) / 1e9 - 1.0).abs() < 1e-9);
    assert_eq!(steel::bar(200e9, &[]), crate::material::steel::Bar::elastic(200e9));
}

/// Nodes of a grid of bricks of C3D8I at places from the unit cube, bricks, E = 200 GPa.
fn grid(size: [usize; 3], place: impl Fn([f64; 3]) -> [f64; 3]) -> (String, Vec<[f64; 3]>) {
    let [nx, ny, nz] = size;
    let number = |i: usize, j: usize, k: usize| 1 + i + (nx + 1) * (j + (ny + 1) * k);
    let (mut nodes, mut elements) = (String::from("*NODE\n"), String::new());
    let mut places = Vec::new();
    for (k, j, i) in all([nx + 1, ny + 1, nz + 1]) {
        let at = place([i as f64 / nx as f64, j as f64 / ny as f64, k as f64 / nz as f64]);
        nodes += &format!("{},{:?},{:?},{:?}\n", number(i, j, k), at[0], at[1], at[2]);
        places.push(at);
    }
    for (e, (k, j, i)) in all(size).enumerate() {
        let face = |k| {
            [number(i, j, k), number(i + 1, j, k), number(i + 1, j + 1, k), number(i, j + 1, k)]
        };
        let corners = [face(k), face(k + 1)].concat();
        let corners: Vec<String> = corners.iter().map(usize::to_string).collect();
        elements += &format!("{},{}\n", e + 1, corners.join(","));
    }
    let law = "*MATERIAL,NAME=S\n*ELASTIC\n200e9,.3\n*SOLID SECTION,ELSET=ALL,MATERIAL=S\n";
    (format!("{nodes}*ELEMENT,TYPE=C3D8I,ELSET=ALL\n{elements}{law}"), places)
}

/// (k, j, i), i fastest.
fn all([nx, ny, nz]: [usize; 3]) -> impl Iterator<Item = (usize, usize, usize)> {
    (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (k, j, i))))
}

/// Rows that name the nodes which satisfy a test.
fn rows(places: &[[f64; 3]], what: &str, test: impl Fn(&[f64; 3]) -> bool) -> String {
    let chosen = (1..).zip(places).filter(|(_, at)| test(at));
    chosen.map(|(n, _)| format!("{n},{what}\n")).collect()
}

fn solved(text: &str) -> Vec<f64> {
    let case = case(text).unwrap();
    case.run(MarchSettings::of_deck(), &Job::default(), |_, _, _| Ok(())).unwrap().x
}

/// A needle of five bricks 100:1 in its length bends as five bricks can, within .5 %. The curvature
/// of each is that of its middle, so that the end sinks by P L³/3EI (1 − 1/4n²), n = 5, where nothing
/// narrows (ν = 0). With ν the held end cannot narrow, and the first brick, which has half of the
/// sag, is stiffer along all of its metre, where a beam recovers within its depth. Lateral curvatures
/// k vary linearly between nodes (k = 0 where it is held), with ξ = ± 1 at a brick's ends and
/// c = 2/((1 + ν)(1 − 2ν)) the energy of a brick is h EI/2 times
/// κ² + c (mean k − ν κ)² + c/(1 + c ν²) (Δk)²/12, the last with C3D8I's own mode along ξ; the
/// least of all bricks' energies together less the work of P gives .9482 for ν = .3.
/// (One of 20 m bends by so much that rounding alone leaves more than 1e-6 of its load out of
/// balance.)
#[test]
fn needles_bend_as_their_bricks_can() {
    let (text, places) = grid([5, 12, 12], |[x, y, z]| [5.0 * x, 0.12 * y, 0.12 * z]);
    let held = rows(&places, "1,3", |at| at[0] == 0.0);
    let pushed = rows(&places, "3,1", |at| at[0] == 5.0);
    let beam = 169.0 * 5f64.powi(3) / (3.0 * 200e9 * 0.12f64.powi(4) / 12.0);
    for (poisson, share) in [("0.", 1.0 - 1.0 / 100.0), (".3", 0.9482)] {
        let text = text.replace("200e9,.3", &format!("200e9,{poisson}"));
        let x =
            solved(&format!("{text}*BOUNDARY\n{held}*STEP\n*STATIC\n*CLOAD\n{pushed}*END STEP\n"));
        let found = x[x.len() - 1] / beam;
        assert!((found / share - 1.0).abs() < 5e-3, "ν = {poisson}: {found}, not {share}");
    }
}

/// A quarter of a pipe of R/t = 2000 widens under inner pressure by p R²/E t.
#[test]
fn thin_pipes_widen_as_rings() {
    let (radius, thick) = (2.0, 0.001);
    let (text, places) = grid([60, 40, 1], |[t, z, r]| {
        let (sin, cos) = (t * std::f64::consts::FRAC_PI_2).sin_cos();
        let r = radius + thick * (r - 0.5);
        // The ends of the quarter lie in its planes to the bit.
        [if t == 1.0 { 0.0 } else { r * cos }, r * sin, z]
    });
    let held = [0, 1, 2].map(|c| rows(&places, &(c + 1).to_string(), |at| at[c] == 0.0)).concat();
    let text = format!("{text}*BOUNDARY\n{held}*STEP\n*STATIC\n*DLOAD\nALL,P1,1e3\n*END STEP\n");
    let expected = 1e3 * radius * radius / (200e9 * thick);
    for (at, u) in places.iter().zip(solved(&text).as_chunks::<3>().0) {
        let wide = (at[0] * u[0] + at[1] * u[1]) / at[0].hypot(at[1]);
        assert!((wide / expected - 1.0).abs() < 0.01, "{at:?}: {wide} {expected}");
    }
}
