//! One crack, whatever the shape of the bricks and wherever they look: work G_f A.

use glam::DMat3;
use intrados_mechanics::{material::law::reach, prelude::*};

use super::*;

const LENGTH: f64 = 0.1;
const FRACTURE: f64 = 100.0;
const STRENGTH: f64 = 2.97e6;

/// Work over G_f A (1 − e⁻⁵) of a bar of `n` bricks as wide as `slim` times their length, turned by
/// `angle` about z and torn to 5 G_f/f_t.
fn torn(n: usize, slim: f64, angle: f64) -> f64 {
    let (h, turn) = (LENGTH / n as f64, DMat3::from_rotation_z(angle));
    let along = turn.x_axis;
    let lines: Vec<f64> = (0..=n).map(|k| k as f64 * h).collect();
    let side = slim * h;
    let mut mesh = block(&lines, &[0.0, side], &[0.0, side], "bar").unwrap();
    let weak = (n / 2) as f64 * h;
    mesh.assign("weak", |c| c.x > weak && c.x < weak + h);
    let at = |x: f64| nodes(&mesh, |p| near(p.x, x));
    let (first, last, crack) = (at(0.0), at(LENGTH), [at(weak), at(weak + h)]);
    mesh.nodes.iter_mut().for_each(|p| *p = turn * *p);
    let concrete = |strength: f64| {
        let given = Given {
            fctm: Some(strength),
            modulus: Some(30e9),
            poisson: Some(0.0),
            fracture_energy: Some(FRACTURE),
            ..Given::default()
        };
        let properties = Given { fcm: Some(30e6), ..given }.complete().unwrap();
        Body {
            matter: Matter::Concrete(Box::new((properties, Setting::short_term(0.1)))),
            birth: f64::NEG_INFINITY,
        }
    };
    let mut model =
        Model { bodies: vec![concrete(3e6), concrete(STRENGTH)], mesh, ..Model::default() };
    model.holds = first.iter().flat_map(|&n| (0..3).map(move |c| (n, c))).collect();
    // Its end is moved as one, by a metre: free, it would turn, and tear on one side first.
    model.holds.extend(last.iter().map(|&n| (n, 2)));
    let both = last.iter().flat_map(|&n| (0..2).map(move |c| (n, c, along[usize::from(c)])));
    model.loads.push(Load {
        name: "moved".into(),
        action: Action::Displacement(both.collect()),
        history: vec![(0.0, 0.0)],
    });
    let component = |nodes: &[u32], sign: f64| -> Vec<(u32, u8, f64)> {
        (0..2).flat_map(|c| mean(nodes, c, sign * along[usize::from(c)])).collect()
    };
    let row = [component(&crack[1], 1.0), component(&crack[0], -1.0)].concat();
    let structure = System::new(&model).unwrap();
    let settings = MarchSettings { tolerance: 1e-5, ..MarchSettings::default() };
    let mut march = March::new(&structure, structure.rest(0.0), raised(0, row), settings);
    let (mut work, mut opened, mut before) = (0.0, 0.0, [0.0; 2]);
    for k in 0..=100 {
        let opening = 1e-7 * f64::powf(5.0 * FRACTURE / STRENGTH / 1e-7, f64::from(k) / 100.0);
        march
            .advance(f64::from(k + 1), opening - opened, &Job::default(), |history, _| {
                let sum = |of: &[f64]| -> f64 {
                    let each = component(&last, 1.0).into_iter();
                    each.map(|(n, c, w)| w * of[3 * n as usize + usize::from(c)]).sum()
                };
                let now = [sum(&history.force) * last.len() as f64, sum(&history.x)];
                work += 0.5 * (now[0] + before[0]) * (now[1] - before[1]);
                before = now;
                Ok(())
            })
            .unwrap();
        opened = opening;
    }
    work / (FRACTURE * side * side * (1.0 - (-5f64).exp()))
}

#[test]
fn work_is_that_of_the_crack_for_bricks_of_any_shape() {
    let mut worst = 0.0_f64;
    for (n, slim) in [(4, 0.4), (10, 1.0), (10, 3.0), (20, 0.5)] {
        for angle in [0.0, std::f64::consts::FRAC_PI_4] {
            let work = torn(n, slim, angle);
            println!(
                "{n} bricks, {slim} times as wide as long, turned by {angle:.2}: work/(G_f A) {work:.4}"
            );
            worst = worst.max((work - 1.0).abs());
        }
    }
    assert!(worst < 0.01, "{worst}");
}

#[test]
fn a_brick_reaches_as_far_as_its_corners() {
    let edges = [[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.5]];
    let half = 0.5f64.sqrt();
    for (n, far) in [
        ([1.0, 0.0, 0.0], 2.0),
        ([0.0, 0.0, -1.0], 0.5),
        ([half, half, 0.0], 3.0 * half),
        ([half, -half, 0.0], 3.0 * half),
    ] {
        assert!((reach(&edges, &n) - far).abs() < 1e-12);
    }
}
