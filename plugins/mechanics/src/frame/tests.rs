//! Frames and plates against closed forms.

use glam::{DQuat, DVec3};
use intrados_stage::Job;

use super::{
    beam::{Along, Beam, Forces},
    model::{Case, End, Equilibrium, Link, Model, System},
    section::Section,
};
use crate::element::shell::Shell;

const E: f64 = 30e9;

/// Slender and stiff against shear and stretching, as in the formulas of textbooks.
fn slender(second: f64) -> Section {
    Section {
        area: 1e3 * second,
        shear: [f64::INFINITY; 2],
        second: [second; 2],
        torsion: second,
        reach: [0.5; 2],
    }
}

fn at(node: u32) -> End {
    End { node, arm: DVec3::ZERO }
}

/// A model that grows beam by beam.
#[derive(Default)]
struct Draft {
    model: Model,
    case: Case,
}

impl Draft {
    fn node(&mut self, x: f64, y: f64, z: f64) -> u32 {
        self.model.nodes.push(DVec3::new(x, y, z));
        self.model.nodes.len() as u32 - 1
    }

    fn beam(&mut self, ends: [End; 2], section: Section, load: DVec3) {
        let places = ends.map(|e| self.model.nodes[e.node as usize] + e.arm);
        let along = places[1] - places[0];
        let across = if along.normalize().y.abs() < 0.9 { DVec3::Y } else { DVec3::Z };
        let moduli = [E, E / 2.4];
        let beam = Beam { ends: places, across, section, moduli, released: [[false; 6]; 2] };
        let number = self.model.beams.len() as u32;
        self.model.beams.push((beam, ends));
        self.case.beams.push((number, Along { force: load, ..Along::default() }));
    }

    fn hold(&mut self, node: u32, moves: &[DVec3], turns: &[DVec3]) {
        self.model.holds.extend(moves.iter().map(|&d| (node, false, d)));
        self.model.holds.extend(turns.iter().map(|&d| (node, true, d)));
    }

    fn solve(&self) -> Equilibrium {
        let job = Job::default();
        let found = System::new(&self.model, &job).unwrap().solve(&self.case, &job).unwrap();
        assert!(found.unbalanced < 1e-9, "unbalanced {}", found.unbalanced);
        found
    }

    fn section(&self, found: &Equilibrium, beam: usize, share: f64) -> Forces {
        let number = beam as u32;
        let along =
            self.case.beams.iter().find(|b| b.0 == number).map_or(Along::default(), |b| b.1);
        let own = &self.model.beams[beam].0;
        let held = self.model.held(beam, &found.x, &along);
        own.forces(&held, &along, share * own.length())
    }

    fn moved(&self, found: &Equilibrium, node: u32) -> DVec3 {
        at(node).moved(&self.model, &found.x)[0]
    }
}

fn near(found: f64, expected: f64, share: f64) -> bool {
    (found - expected).abs() <= share * expected.abs()
}

const ALL: [DVec3; 3] = [DVec3::X, DVec3::Y, DVec3::Z];

/// Reactions 3/8, 10/8 and 3/8 q L, moment −q L²/8 over the middle, 9/128 q L² in the spans.
#[test]
fn a_beam_of_two_spans_leans_on_its_middle_support() {
    let (mut draft, q, l) = (Draft::default(), 12e3, 6.0);
    let nodes: Vec<u32> = (0..5).map(|i| draft.node(0.5 * l * f64::from(i), 0.0, 0.0)).collect();
    for pair in nodes.windows(2) {
        draft.beam([at(pair[0]), at(pair[1])], slender(1e-3), -q * DVec3::Y);
    }
    draft.hold(0, &ALL, &[DVec3::X]);
    draft.hold(2, &[DVec3::Y, DVec3::Z], &[]);
    draft.hold(4, &[DVec3::Y, DVec3::Z], &[]);
    let found = draft.solve();
    let up: Vec<f64> = found.reactions.iter().map(|r| r.1[0].y).collect();
    let expected = [0.375, 1.25, 0.375].map(|r| r * q * l);
    assert!((0..3).all(|i| near(up[i], expected[i], 1e-9)), "{up:?}");
    assert!(near(draft.section(&found, 1, 1.0).moment.z, -q * l * l / 8.0, 1e-9));
    // 3/8 L from the outer support the shear force is nought.
    let most = draft.section(&found, 0, 0.75);
    assert!(near(most.moment.z, 9.0 / 128.0 * q * l * l, 1e-9) && most.force.y.abs() < 1e-6 * q);
}

/// Kleinlogel, frame 1: feet that turn, k = I_b h/(I_c L), H = q L²/(4 h (2 k + 3)).
#[test]
fn a_portal_frame_pushes_its_feet_apart_as_in_kleinlogel() {
    let (q, l, h, beam, column) = (20e3, 8.0, 5.0, 4e-3, 2e-3);
    let mut draft = Draft::default();
    let places = [(0.0, 0.0), (0.0, h), (l, h), (l, 0.0)];
    let n = places.map(|(x, y)| draft.node(x, y, 0.0));
    let stiff = |second| Section { area: 1e6 * second, ..slender(second) };
    for (pair, second, load) in [([0, 1], column, 0.0), ([1, 2], beam, -q), ([2, 3], column, 0.0)] {
        draft.beam(pair.map(|i| at(n[i])), stiff(second), load * DVec3::Y);
    }
    for foot in [0, 3] {
        draft.hold(n[foot], &ALL, &[DVec3::X, DVec3::Y]);
    }
    let found = draft.solve();
    let k = beam * h / (column * l);
    let thrust = q * l * l / (4.0 * h * (2.0 * k + 3.0));
    assert!(near(found.reactions[0].1[0].x, thrust, 1e-5), "{:?}", found.reactions);
    assert!(near(draft.section(&found, 1, 0.0).moment.z, -thrust * h, 1e-5));
    assert!(near(draft.section(&found, 1, 0.5).moment.z, q * l * l / 8.0 - thrust * h, 1e-5));
}

/// Beams that cross share a force by 48 E I/L³, and what they share sinks alike.
#[test]
fn a_grillage_shares_a_force_by_stiffness() {
    let (p, [a, b], [i, j]) = (100e3, [6.0, 9.0], [2e-3, 3e-3]);
    let mut draft = Draft::default();
    let cross = draft.node(0.0, 0.0, 0.0);
    let ends = [
        draft.node(-0.5 * a, 0.0, 0.0),
        draft.node(0.5 * a, 0.0, 0.0),
        draft.node(0.0, 0.0, -0.5 * b),
        draft.node(0.0, 0.0, 0.5 * b),
    ];
    // Without torsion, as the formula.
    let beam = |second| Section { torsion: 1e-9 * second, ..slender(second) };
    for (n, &end) in ends.iter().enumerate() {
        draft.beam([at(end), at(cross)], beam(if n < 2 { i } else { j }), DVec3::ZERO);
        draft.hold(end, &[DVec3::Y], &[]);
    }
    draft.hold(ends[0], &[DVec3::X, DVec3::Z], &[]);
    draft.hold(ends[2], &[DVec3::X, DVec3::Z], &[]);
    draft.case.points.push((0, at(cross), [-p * DVec3::Y, DVec3::ZERO]));
    let found = draft.solve();
    let [k, m] = [(a, i), (b, j)].map(|(l, second): (f64, f64)| 48.0 * E * second / l.powi(3));
    assert!(near(draft.moved(&found, cross).y, -p / (k + m), 1e-7));
    assert!(near(draft.section(&found, 0, 1.0).moment.z, p * k / (k + m) * a / 4.0, 1e-7));
}

/// Timoshenko's cantilever 10 × 1 × 1, E 30 GPa, ν .2: P L³/3EI + 6 P L/5GA.
#[test]
fn a_cantilever_bends_and_shears_in_any_direction() {
    let turns = [DQuat::IDENTITY, DQuat::from_euler(glam::EulerRot::XYZ, 0.4, -0.7, 1.1)];
    for (turn, down) in turns.into_iter().flat_map(|t| [(t, DVec3::Y), (t, DVec3::Z)]) {
        let mut draft = Draft::default();
        let tip = turn * (10.0 * DVec3::X);
        let nodes = [draft.node(0.0, 0.0, 0.0), draft.node(tip.x, tip.y, tip.z)];
        draft.beam(nodes.map(at), Section::rectangle(1.0, 1.0), DVec3::ZERO);
        draft.model.beams[0].0.moduli = [30e3, 12.5e3];
        draft.model.beams[0].0.across = turn * DVec3::Y;
        draft.hold(nodes[0], &ALL, &ALL);
        draft.case.points.push((0, at(nodes[1]), [turn * down, DVec3::ZERO]));
        let found = draft.solve();
        let moved = draft.moved(&found, nodes[1]);
        assert!(near(moved.dot(turn * down), 0.13333333 + 0.00096, 1e-6), "{moved}");
    }
}

/// A cantilever that is rigid for its first metre bends over the rest alone; a force beside its
/// axis twists it by P e L/GJ.
#[test]
fn rigid_ends_bend_nothing_and_offsets_twist() {
    let mut draft = Draft::default();
    let [root, tip] = [draft.node(0.0, 0.0, 0.0), draft.node(5.0, 0.0, 0.0)];
    let inner = End { node: root, arm: DVec3::X };
    let section = slender(1e-3);
    draft.beam([inner, at(tip)], section, DVec3::ZERO);
    draft.hold(root, &ALL, &ALL);
    let beside = End { node: tip, arm: 0.3 * DVec3::Z };
    draft.case.points.push((0, beside, [-1e3 * DVec3::Y, DVec3::ZERO]));
    let found = draft.solve();
    assert!(near(draft.moved(&found, tip).y, -1e3 * 64.0 / (3.0 * E * 1e-3), 1e-9));
    let turned = at(tip).moved(&draft.model, &found.x)[1].x;
    assert!(near(turned, 1e3 * 0.3 * 4.0 / (E / 2.4 * 1e-3), 1e-9), "{turned}");
    let [force, moment] = found.reactions[0].1;
    assert!(near(force.y, 1e3, 1e-9) && near(moment.z, 5e3, 1e-9));
    assert!(near(moment.x.abs(), 300.0, 1e-9));
}

/// A beam between walls with hinges at its ends has q L²/8; one with a hinge in the middle q L²/4
/// … at the walls: each half is a cantilever under its own load.
#[test]
fn ends_that_let_go_bear_no_moment() {
    let (q, l) = (5e3, 4.0);
    let mut draft = Draft::default();
    let nodes = [0.0, 0.5, 1.0].map(|s| draft.node(s * l, 0.0, 0.0));
    draft.beam([at(nodes[0]), at(nodes[1])], slender(1e-4), -q * DVec3::Y);
    draft.beam([at(nodes[1]), at(nodes[2])], slender(1e-4), -q * DVec3::Y);
    draft.hold(nodes[0], &ALL, &ALL);
    draft.hold(nodes[2], &ALL, &ALL);
    let clamped = draft.solve();
    assert!(near(draft.section(&clamped, 0, 0.0).moment.z, -q * l * l / 12.0, 1e-9));
    assert!(near(draft.section(&clamped, 0, 1.0).moment.z, q * l * l / 24.0, 1e-9));
    let mut hinged = Draft { model: draft.model.clone(), case: draft.case.clone() };
    hinged.model.beams[0].0.released[0][5] = true;
    hinged.model.beams[1].0.released[1][5] = true;
    let found = hinged.solve();
    assert!(near(hinged.section(&found, 0, 1.0).moment.z, q * l * l / 8.0, 1e-9));
    assert!(hinged.section(&found, 0, 0.0).moment.z.abs() < 1e-6);
    draft.model.beams[0].0.released[1][5] = true;
    let found = draft.solve();
    assert!(near(draft.section(&found, 0, 0.0).moment.z, -q * l * l / 8.0, 1e-9));
    assert!(draft.section(&found, 1, 0.0).moment.z.abs() < 1e-6);
}

/// Held at both ends and 20 K warmer: −E A α T; warmer on top alone: M = E I κ all along.
#[test]
fn warmth_that_is_held_back_presses_and_bends() {
    let mut draft = Draft::default();
    let nodes = [draft.node(0.0, 0.0, 0.0), draft.node(6.0, 0.0, 0.0)];
    let section = Section::rectangle(0.5, 0.3);
    draft.beam(nodes.map(at), section, DVec3::ZERO);
    nodes.iter().for_each(|&n| draft.hold(n, &ALL, &ALL));
    draft.case.beams[0].1.strain = [2e-4, 4e-4];
    let found = draft.solve();
    let middle = draft.section(&found, 0, 0.5);
    assert!(near(middle.force.x, -E * section.area * 2e-4, 1e-9));
    // Free, its top would be longer: held, the top is pressed.
    assert!(near(middle.moment.z, E * section.second[1] * 4e-4, 1e-9));
}

/// A link that turns about z joins two cantilevers: it hands over force and no moment.
#[test]
fn a_hinge_between_members_hands_over_force_alone() {
    let (mut draft, p, l) = (Draft::default(), 3e3, 4.0);
    let nodes = [0.0, l, l, 2.0 * l].map(|x| draft.node(x, 0.0, 0.0));
    draft.beam([at(nodes[0]), at(nodes[1])], slender(1e-3), DVec3::ZERO);
    draft.beam([at(nodes[2]), at(nodes[3])], slender(1e-3), DVec3::ZERO);
    draft.hold(nodes[0], &ALL, &ALL);
    draft.hold(nodes[3], &ALL, &ALL);
    let stiff = 1e5 * 12.0 * E * 1e-3 / l.powi(3);
    draft.model.links.push(Link {
        ends: [Some(at(nodes[1])), Some(at(nodes[2]))],
        axes: ALL,
        stiffness: [stiff, stiff, stiff, stiff, stiff, 0.0],
    });
    draft.case.points.push((0, at(nodes[1]), [-p * DVec3::Y, DVec3::ZERO]));
    let found = draft.solve();
    assert!(near(draft.section(&found, 0, 0.0).moment.z, -0.5 * p * l, 1e-4));
    assert!(near(draft.section(&found, 1, 1.0).moment.z, -0.5 * p * l, 1e-4));
    let [force, moment] = draft.model.links[0].forces(&draft.model, &found.x);
    assert!(near(force.y, 0.5 * p, 1e-4) && moment.z.abs() < 1e-6);
}

/// A square plate under even pressure, n × n plates on a quarter of it; `clamped` or simply
/// supported. Its deflection in the middle over q a⁴/D, and moments there over q a².
fn square(n: u32, clamped: bool) -> [f64; 2] {
    let (a, t, q, nu): (f64, f64, f64, f64) = (4.0, 0.04, 1e3, 0.3);
    let rigidity = E * t.powi(3) / (12.0 * (1.0 - nu * nu));
    let mut draft = Draft::default();
    let step = 0.5 * a / f64::from(n);
    for k in 0..(n + 1) * (n + 1) {
        let [i, j] = [k % (n + 1), k / (n + 1)];
        let node = draft.node(step * f64::from(i), 0.0, step * f64::from(j));
        // The middle of the plate is the corner at i = j = 0.
        let symmetry = [(i == 0, DVec3::X, DVec3::Z), (j == 0, DVec3::Z, DVec3::X)];
        for (_, across, along) in symmetry.into_iter().filter(|e| e.0) {
            draft.hold(node, &[across], &[along]);
        }
        let edges = [(i == n, DVec3::X), (j == n, DVec3::Z)];
        for (_, across) in edges.into_iter().filter(|e| e.0) {
            // Hard: the edge does not tilt along itself.
            draft.hold(node, &[DVec3::Y], if clamped { &ALL } else { &[] });
            draft.hold(node, &[], &[across]);
        }
    }
    draft.hold(0, &[], &[DVec3::Y]);
    for k in 0..n * n {
        let first = k % n + (n + 1) * (k / n);
        let ends = [first, first + n + 1, first + n + 2, first + 1].map(at);
        let nodes = ends.map(|e| draft.model.nodes[e.node as usize]);
        let plate = Shell { nodes, thickness: t, young: E, poisson: nu };
        draft.model.plates.push((plate, ends));
        draft.case.plates.push((k, -q * DVec3::Y));
    }
    let found = draft.solve();
    let middle = draft.model.resultants(0, &found.x).unwrap();
    let w = -draft.moved(&found, 0).y;
    [w * rigidity / (q * a.powi(4)), -middle.bending[0] / (q * a * a)]
}

/// Timoshenko and Woinowsky-Krieger, tables 8 and 35, ν = .3: .00406 q a⁴/D and .0479 q a², simply
/// supported; .00126 and .0231, clamped.
#[test]
fn square_plates_sag_as_in_timoshenkos_tables() {
    for (clamped, [w, m]) in [(false, [0.00406, 0.0479]), (true, [0.00126, 0.0231])] {
        let found = square(16, clamped);
        assert!(near(found[0], w, 0.01) && near(found[1].abs(), m, 0.015), "{clamped} {found:?}");
    }
}
