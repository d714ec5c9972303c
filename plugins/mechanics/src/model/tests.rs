use intrados_stage::Job;

use super::*;
use crate::mesh::{block, divide};

const E: f64 = 30e9;

fn elastic(birth: f64) -> Body {
    Body {
        matter: Matter::Elastic(Elastic {
            modulus: E,
            poisson: 0.0,
            expansion: 1e-5,
            density: 2500.0,
        }),
        birth,
    }
}

/// A bar along x, `n` bricks, held at x = 0 and kept straight.
fn bar(n: usize) -> Model {
    let mesh =
        block(&divide(0.0, 1.0, &[], 1.0 / n as f64), &[0.0, 0.1], &[0.0, 0.1], "bar").unwrap();
    let mut model = Model { bodies: vec![elastic(f64::NEG_INFINITY)], ..Model::default() };
    for (i, p) in mesh.nodes.iter().enumerate() {
        (0..3).filter(|&c| c > 0 || p.x == 0.0).for_each(|c| model.holds.push((i as u32, c)));
    }
    model.mesh = mesh;
    model
}

fn end(model: &Model) -> Vec<u32> {
    (0..model.mesh.nodes.len() as u32)
        .filter(|&n| model.mesh.nodes[n as usize].x > 1.0 - 1e-9)
        .collect()
}

fn pull(model: &Model, newton: f64) -> Action {
    Action::Nodes(end(model).into_iter().map(|n| (n, glam::DVec3::X * newton / 4.0)).collect())
}

#[test]
fn a_bar_is_pulled_heated_and_held() {
    let mut model = bar(4);
    let nodes = model.mesh.nodes.len();
    model.loads.push(Load {
        name: "pull".into(),
        action: pull(&model, 3e4),
        history: vec![(0.0, 0.0), (1.0, 1.0)],
    });
    model.loads.push(Load {
        name: "heat".into(),
        action: Action::Temperature(vec![20.0; nodes]),
        history: vec![(1.0, 0.0), (2.0, 1.0)],
    });
    let structure = System::new(&model).unwrap();
    let mut march =
        March::new(&structure, structure.rest(0.0), Drive::Loads, MarchSettings::default());
    let at_end = |history: &History| history.x[3 * end(&model)[0] as usize];
    for (time, expected) in [(0.5, 0.5e-4), (1.0, 1e-4), (2.0, 1e-4 + 2e-4)] {
        march.advance(time, 0.0, &Job::default(), |_, _| Ok(())).unwrap();
        assert!(
            (at_end(&march.history) / expected - 1.0).abs() < 1e-9,
            "{time} {}",
            at_end(&march.history)
        );
    }
    let stress = structure.points(2, &march.history).unwrap();
    assert!(stress.iter().all(|s| (s.stress[0] / 3e6 - 1.0).abs() < 1e-9), "{stress:?}");
}

/// A bar that is loaded, then a second one at the same nodes, born without stress: of what comes
/// later each takes half, of what was before the second none.
#[test]
fn what_is_born_late_bears_only_what_comes_later() {
    let mut model = bar(1);
    let twin = crate::mesh::Hex { region: model.mesh.region("twin"), ..model.mesh.hexes[0] };
    model.mesh.hexes.push(twin);
    model.bodies.push(elastic(1.5));
    model.loads.push(Load {
        name: "pull".into(),
        action: pull(&model, 2e4),
        history: vec![(0.0, 0.0), (1.0, 1.0), (2.0, 1.0), (3.0, 3.0)],
    });
    let structure = System::new(&model).unwrap();
    let mut march =
        March::new(&structure, structure.rest(0.0), Drive::Loads, MarchSettings::default());
    for (time, first, second) in [(1.0, 2e6, 0.0), (2.0, 2e6, 0.0), (3.0, 4e6, 2e6)] {
        march.advance(time, 0.0, &Job::default(), |_, _| Ok(())).unwrap();
        for (hex, expected) in [(0, first), (1, second)] {
            let stress = structure.points(hex, &march.history).unwrap()[0].stress[0];
            assert!((stress - expected).abs() < 1.0, "{time} {hex}: {stress}");
        }
    }
}

/// A bar is pushed against a joint behind which another one is poured later, then harder: the
/// second bears nothing of the first push, and its share of the rest. Both are held at their far
/// ends, each a spring k = E A/l; the joint is so stiff that it counts for next to nothing.
#[test]
fn what_is_poured_against_a_joint_finds_it_closed() {
    let mut mesh = block(&[0.0, 1.0, 2.0], &[0.0, 0.1], &[0.0, 0.1], "bar").unwrap();
    let far: Vec<u32> =
        (0..mesh.nodes.len() as u32).filter(|&n| mesh.nodes[n as usize].x > 1.5).collect();
    let late = mesh.region("late");
    mesh.hexes[1].region = late;
    let joint = mesh.region("joint");
    mesh.separate(|_, _| Some(joint));
    let friction = crate::element::interface::Friction {
        normal: 1e6 * E,
        shear: 1e6 * E,
        friction: 0.5,
        cohesion: 0.0,
    };
    let mut model = Model {
        bodies: vec![
            elastic(0.0),
            elastic(1.5),
            Body { matter: Matter::Joint(friction), birth: 0.0 },
        ],
        ..Model::default()
    };
    for (i, p) in (0..).zip(&mesh.nodes) {
        (0..3)
            .filter(|&c| c > 0 || p.x == 0.0 || far.contains(&i))
            .for_each(|c| model.holds.push((i, c)));
    }
    let pushed =
        mesh.interfaces[0].nodes[..4].iter().map(|&n| (n, glam::DVec3::X * 2500.0)).collect();
    model.mesh = mesh;
    model.loads.push(Load {
        name: "push".into(),
        action: Action::Nodes(pushed),
        history: vec![(0.0, 0.0), (1.0, 1.0), (2.0, 1.0), (3.0, 3.0)],
    });
    let structure = System::new(&model).unwrap();
    let mut march =
        March::new(&structure, structure.rest(0.0), Drive::Loads, MarchSettings::default());
    for (time, first, second) in [(1.0, 1e6, 0.0), (2.0, 1e6, 0.0), (3.0, 2e6, -1e6)] {
        march.advance(time, 0.0, &Job::default(), |_, _| Ok(())).unwrap();
        for (hex, expected) in [(0, first), (1, second)] {
            let stress = structure.points(hex, &march.history).unwrap()[0].stress[0];
            assert!((stress - expected).abs() < 10.0, "{time} {hex}: {stress}");
        }
    }
}

/// The factor is found that brings the end where it is wanted, for a force and for a prescribed
/// displacement.
#[test]
fn a_displacement_is_controlled() {
    for by_force in [true, false] {
        let mut model = bar(3);
        let (middle, ends) = (
            model.mesh.nodes.iter().position(|p| (p.x - 1.0 / 3.0).abs() < 1e-9).unwrap() as u32,
            end(&model),
        );
        let action = if by_force {
            pull(&model, 3e4)
        } else {
            Action::Displacement(ends.iter().map(|&n| (n, 0, 1e-4)).collect())
        };
        model.loads.push(Load { name: "drive".into(), action, history: vec![(0.0, 0.0)] });
        let structure = System::new(&model).unwrap();
        let drive =
            Drive::Raised { loads: vec![(0, 1.0)], control: Control::Row(vec![(middle, 0, 1.0)]) };
        let mut march =
            March::new(&structure, structure.rest(0.0), drive, MarchSettings::default());
        march.advance(1.0, 1e-4, &Job::default(), |_, _| Ok(())).unwrap();
        // A third of the way along, a third of the elongation at factor 1 is 1e-4/3.
        assert!((march.history.factor - 3.0).abs() < 1e-6, "{by_force} {}", march.history.factor);
    }
}

#[test]
fn what_cannot_be_is_said() {
    let mut model = bar(2);
    model.bodies.clear();
    assert!(System::new(&model).unwrap_err().to_string().contains("1 regions, but 0 materials"));
    let mut model = bar(2);
    model.holds.retain(|h| h.1 != 0);
    model.loads.push(Load { name: "pull".into(), action: pull(&model, 1.0), history: vec![] });
    let structure = System::new(&model).unwrap();
    let mut march =
        March::new(&structure, structure.rest(0.0), Drive::Loads, MarchSettings::default());
    let why = march.advance(1.0, 0.0, &Job::default(), |_, _| Ok(())).unwrap_err().to_string();
    assert!(why.contains("free to move"), "{why}");
}

/// A clamped beam, bent and pulled: what softening an element does to strain, stress and
/// deflection, by one primal and one dual solution against two full solves. The error of the first
/// order must fall as δ².
#[test]
fn the_dual_foretells_what_softening_does() {
    let mesh = block(
        &divide(0.0, 2.0, &[], 0.25),
        &divide(0.0, 0.3, &[], 0.15),
        &divide(0.0, 0.2, &[], 0.1),
        "beam",
    )
    .unwrap();
    let matter =
        Matter::Elastic(Elastic { modulus: E, poisson: 0.2, expansion: 1e-5, density: 2500.0 });
    let mut model =
        Model { bodies: vec![Body { matter, birth: f64::NEG_INFINITY }], ..Model::default() };
    for (i, p) in mesh.nodes.iter().enumerate().filter(|(_, p)| p.x == 0.0) {
        assert!(p.x == 0.0);
        (0..3).for_each(|c| model.holds.push((i as u32, c)));
    }
    model.mesh = mesh;
    model.loads.push(Load {
        name: "weight".into(),
        action: Action::Weight(glam::DVec3::new(20.0, -9.81, 3.0)),
        history: vec![],
    });
    let locator = crate::mesh::Locator::new(&model.mesh);
    let host = locator.locate(glam::DVec3::new(0.32, 0.28, 0.04)).unwrap();
    let tip = locator.locate(glam::DVec3::new(1.9, 0.1, 0.1)).unwrap();
    let slope = glam::DVec3::new(0.8, 0.6, 0.0);
    let gauges = [
        Gauge::Strain(host, slope),
        Gauge::Stress(host, slope),
        Gauge::Displacement(tip, glam::DVec3::Y),
    ];
    let solve = |model: &Model| {
        let structure = System::new(model).unwrap();
        let settings = MarchSettings { tolerance: 1e-10, ..MarchSettings::default() };
        let mut march = March::new(&structure, structure.rest(0.0), Drive::Loads, settings);
        march.advance(1.0, 0.0, &Job::default(), |_, _| Ok(())).unwrap();
        march.history
    };
    let read = |softened: &[(usize, f64)]| {
        let mut softer = model.clone();
        softer.softening = vec![0.0; model.mesh.hexes.len()];
        softened.iter().for_each(|&(e, d)| softer.softening[e] = d);
        let history = solve(&softer);
        System::new(&softer).unwrap().read(&gauges, &history).unwrap()
    };
    let history = solve(&model);
    let structure = System::new(&model).unwrap();
    let influences = structure.influences(&gauges, &history, &Job::default()).unwrap();
    // The gauge's own brick, its neighbour, one far away.
    for hex in [host.hex as usize, host.hex as usize + 1, model.mesh.hexes.len() - 1] {
        let errors = [0.02, 0.01, 0.005].map(|d| {
            let after = read(&[(hex, d)]);
            let change =
                |i: usize| after[i] - influences[i].reading - d * influences[i].by_softening[hex];
            [0, 1, 2].map(|i| change(i) / influences[i].reading)
        });
        for i in 0..3 {
            for pair in errors.windows(2) {
                // Too small to tell: the far brick says next to nothing to the strain gauge.
                if pair[0][i].abs() > 1e-9 {
                    let order = (pair[0][i] / pair[1][i]).log2();
                    assert!(
                        (order - 2.0).abs() < 0.1,
                        "brick {hex} gauge {i}: order {order}, {errors:?}"
                    );
                }
            }
        }
    }
    // The influence line is one: a unit force adds what it says.
    let node = structure.unknowns() / 3 - 1;
    let mut pushed = model.clone();
    pushed.loads.push(Load {
        name: "push".into(),
        action: Action::Nodes(vec![(node as u32, glam::DVec3::Y * 1e3)]),
        history: vec![],
    });
    let after = structure.read(&gauges, &solve(&pushed)).unwrap();
    for (i, influence) in influences.iter().enumerate() {
        let expected = influence.reading + 1e3 * influence.line[3 * node + 1];
        assert!((after[i] / expected - 1.0).abs() < 1e-8, "{i}: {} {expected}", after[i]);
    }
}

/// Bricks of 1:`flat`, their inner nodes moved about, pressed at one corner of the top:
/// displacements.
fn flat(flat: f64, method: crate::sparse::Method) -> Vec<f64> {
    let side = divide(0.0, 1.0, &[], 1.0 / 14.0);
    let mut mesh =
        block(&side, &side, &divide(0.0, 1.0 / flat, &[], 1.0 / 14.0 / flat), "plate").unwrap();
    for (i, p) in mesh.nodes.iter_mut().enumerate() {
        let inside = p.x > 0.01 && p.x < 0.99 && p.y > 0.01 && p.y < 0.99;
        let shake =
            |c: u32| 0.3 / 14.0 * (intrados_stage::random::Key::new(5, i as u64).unit64(c) - 0.5);
        *p += if inside { glam::DVec3::new(shake(0), shake(1), 0.0) } else { glam::DVec3::ZERO };
    }
    let mut model = Model { bodies: vec![elastic(f64::NEG_INFINITY)], mesh, ..Model::default() };
    let held: Vec<u32> = (0..model.mesh.nodes.len() as u32)
        .filter(|&n| model.mesh.nodes[n as usize].x < 1e-9)
        .collect();
    model.holds = held.into_iter().flat_map(|n| (0..3).map(move |c| (n, c))).collect();
    let corner = model.mesh.nodes.len() as u32 - 1;
    model.loads.push(Load {
        name: "corner".into(),
        action: Action::Nodes(vec![(corner, glam::DVec3::new(0.0, 1e3, -1e3))]),
        history: vec![],
    });
    let structure = System::new(&model).unwrap();
    let settings = MarchSettings { method, ..MarchSettings::of_deck() };
    let mut march = March::new(&structure, structure.rest(0.0), Drive::Loads, settings);
    let mut residual = f64::NAN;
    march
        .advance(1.0, 0.0, &Job::default(), |_, step| {
            residual = step.residual;
            Ok(())
        })
        .unwrap();
    assert!(residual <= 1e-8, "{residual}");
    march.history.x
}

/// As a deck is solved, flat bricks move as a factorisation says.
#[test]
fn flat_bricks_move_as_by_a_factorisation() {
    use crate::sparse::Method;
    for thin in [14.0, 100.0] {
        let exact = flat(thin, Method::Direct);
        let found = flat(thin, Method::Auto);
        let largest = exact.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let off = exact.iter().zip(&found).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
        assert!(off < 1e-6 * largest, "1:{thin}: {:e}", off / largest);
    }
}
