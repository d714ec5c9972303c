//! Cracks by the implicit gradient: what the crack band cannot do.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::DVec3;
use intrados_mechanics::{model::Regularisation, prelude::*};
use intrados_stage::Job;

const LENGTH: f64 = 0.24;
const GRADIENT: Regularisation = Regularisation::Gradient { length: 0.02 };

/// For elements that are not cubes.
const WIDER: Regularisation = Regularisation::Gradient { length: 0.024 };

/// f_t of the weak part.
const WEAK: f64 = 2.85e6;

fn concrete(strength: f64) -> Body {
    let given = Given {
        fcm: Some(30e6),
        fctm: Some(strength),
        modulus: Some(30e9),
        poisson: Some(0.0),
        fracture_energy: Some(100.0),
        ..Given::default()
    };
    Body {
        matter: Matter::Concrete(Box::new((given.complete().unwrap(), Setting::short_term(0.1)))),
        birth: f64::NEG_INFINITY,
    }
}

/// A plate that is pulled along x by displacements of its ends; in its middle is a square (half its
/// side, its strength) that is weak.
fn plate(mut mesh: Mesh, weak: [f64; 2], regularisation: Regularisation) -> Model {
    let middle = mesh.bounds().unwrap().into_iter().sum::<DVec3>() / 2.0;
    mesh.assign("weak", |c| (c - middle).truncate().abs().max_element() < weak[0]);
    let mut model = Model {
        bodies: vec![concrete(3e6), concrete(weak[1])],
        regularisation,
        ..Model::default()
    };
    let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
    let nodes = |keep: &dyn Fn(DVec3) -> bool| {
        (0..mesh.nodes.len() as u32).filter(|&n| keep(mesh.nodes[n as usize])).collect::<Vec<_>>()
    };
    model.holds.extend(nodes(&|p| near(p.x, 0.0)).into_iter().map(|n| (n, 0)));
    model.holds.extend(nodes(&|p| near(p.z, 0.0)).into_iter().map(|n| (n, 2)));
    model.holds.extend(nodes(&|p| near(p.x, 0.0) && near(p.y, 0.0)).into_iter().map(|n| (n, 1)));
    let pulled = nodes(&|p| near(p.x, LENGTH)).into_iter().map(|n| (n, 0, 1e-3)).collect();
    let load = Load {
        name: "pull".into(),
        action: Action::Displacement(pulled),
        history: vec![(0.0, 0.0), (1.0, 1.0)],
    };
    model.loads.push(load);
    model.mesh = mesh;
    model
}

/// A bar of `n` bricks torn apart: strength, work done per area, J/m², and how far from the middle
/// it is damaged by more than half, m.
fn torn(n: usize) -> [f64; 3] {
    let h = LENGTH / n as f64;
    let model = plate(
        block(&divide(0.0, LENGTH, &[], h), &[0.0, h], &[0.0, h], "bar").unwrap(),
        [0.021, WEAK],
        GRADIENT,
    );
    let structure = System::new(&model).unwrap();
    let settings = MarchSettings { tolerance: 1e-5, ..MarchSettings::default() };
    let mut march = March::new(&structure, structure.rest(0.0), Drive::Loads, settings);
    let (mut work, mut peak, mut before) = (0.0, 0.0_f64, [0.0; 2]);
    for k in 1..=30 {
        // To .3 mm, nine times G_f/f_t, in steps that grow.
        let time = 0.3 * f64::from(k * k) / 900.0;
        march
            .advance(time, 0.0, &Job::default(), |history, _| {
                let force: f64 = (0..model.mesh.nodes.len())
                    .filter(|&n| model.mesh.nodes[n].x > LENGTH - 1e-9)
                    .map(|n| history.force[3 * n])
                    .sum();
                let now = [force / (h * h), 1e-3 * history.time];
                work += 0.5 * (now[0] + before[0]) * (now[1] - before[1]);
                (peak, before) = (peak.max(now[0]), now);
                Ok(())
            })
            .unwrap();
    }
    let points = structure.all_points(&march.history).unwrap();
    let damaged =
        (0..n).filter(|&e| points[e].iter().map(|p| p.damage[0]).sum::<f64>() > 4.0).count();
    [peak, work, damaged as f64 * h]
}

/// One crack of one width, whatever the mesh: its work tends to G_f, and elements of half the
/// length are a tenth off.
#[test]
fn a_bar_tears_with_the_same_work_on_finer_meshes() {
    let [coarse, fine, finest] = [24, 48, 96].map(torn);
    for [peak, _, width] in [coarse, fine, finest] {
        assert!((peak / WEAK - 1.0).abs() < 0.06 && peak < 3e6, "{peak}");
        assert!((width - finest[2]).abs() < 0.0201, "{width}");
    }
    let work = [coarse, fine, finest].map(|bar| bar[1] / 100.0 - 1.0);
    assert!(work[0].abs() < 0.13 && work[1].abs() < 0.04 && work[2].abs() < 0.02, "{work:?}");
}

/// A plate whose lines of elements across are inclined by 30 degrees in the middle.
fn inclined(h: f64, slope: f64) -> Mesh {
    let mut mesh =
        block(&divide(0.0, LENGTH, &[], h), &divide(0.0, 0.1, &[], h), &[0.0, h], "plate").unwrap();
    mesh.transform(|p| {
        // All in the middle third or so, nothing at the ends.
        let share = (1.6 * (1.0 - (2.0 * p.x / LENGTH - 1.0).abs())).clamp(0.0, 1.0);
        p + DVec3::X * share * slope * (p.y - 0.05)
    });
    mesh
}

/// Inclination of the crack to the direction across, degrees: dx/dy of its points weighed by their
/// opening.
fn inclination(slope: f64, regularisation: Regularisation) -> f64 {
    let model = plate(inclined(0.01, slope), [0.016, 1e6], regularisation);
    let structure = System::new(&model).unwrap();
    let settings = MarchSettings { tolerance: 1e-3, loose: 10.0, ..MarchSettings::default() };
    let mut march = March::new(&structure, structure.rest(0.0), Drive::Loads, settings);
    for k in 1..=5 {
        march.advance(0.01 * f64::from(k), 0.0, &Job::default(), |_, _| Ok(())).unwrap();
    }
    let points = structure.all_points(&march.history).unwrap();
    let weighed = |value: &dyn Fn(DVec3) -> f64| {
        let of = |e: usize| {
            value(model.mesh.centre(e as u32)) * points[e].iter().map(|p| p.crack).sum::<f64>()
        };
        (0..points.len()).map(of).sum::<f64>()
    };
    let weight = weighed(&|_| 1.0);
    let (x, y) = (weighed(&|p| p.x) / weight, weighed(&|p| p.y) / weight);
    (weighed(&|p| (p.x - x) * (p.y - y)) / weighed(&|p| (p.y - y).powi(2))).atan().to_degrees()
}

/// Pulled along x it cracks across, whichever way the elements lie; a crack band nearly so.
#[test]
fn a_crack_does_not_follow_the_mesh() {
    let slope = 30_f64.to_radians().tan();
    let [straight, found, band] = [(0.0, WIDER), (slope, WIDER), (slope, Regularisation::Band)]
        .map(|(slope, how)| inclination(slope, how));
    assert!(straight.abs() < 1.0 && found.abs() < 5.0, "{straight} {found}");
    assert!(band.abs() < 8.0, "{band}");
}

/// A length that the elements cannot resolve, or at which a crack would be too brittle, is refused
/// with what it may be.
#[test]
fn a_length_that_does_not_suit_is_refused() {
    let refused = |length: f64| {
        let mesh =
            block(&divide(0.0, LENGTH, &[], 0.01), &[0.0, 0.01], &[0.0, 0.01], "bar").unwrap();
        let model = plate(mesh, [0.021, WEAK], Regularisation::Gradient { length });
        let Err(why @ Failure::Length { .. }) = System::new(&model) else {
            panic!("{length} is taken")
        };
        why.to_string()
    };
    for length in [0.019, 0.2, f64::NAN] {
        let why = refused(length);
        assert!(
            why.contains("at least") && why.contains("0.020 m") && why.contains("smaller elements"),
            "{why}"
        );
    }
}
