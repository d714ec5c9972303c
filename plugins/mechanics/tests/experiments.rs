//! Experiments with concrete, recomputed: material values from the source, what is missing by the codes from the strength, nothing tuned to the curve. Slow:
//! `cargo test --release -p intrados-mechanics --test experiments -- --ignored --nocapture`.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::DVec3;
use intrados_mechanics::{
    material::{
        concrete::{Code, Given, Properties},
        law::Setting,
    },
    mesh::{Mesh, block, divide},
    model::{Action, Body, Drive, Load, March, Matter, Model, Settings, Structure},
};
use intrados_stage::Job;

/// Thickness of the panel, m.
const THICK: f64 = 0.1;
/// Displacement of the loaded point in a step, m.
const STEP: f64 = 0.02e-3;

/// Winkler (2001), series A: E 25.85 GPa, ν .18, f_t 2.7 MPa, f_c 31 MPa. His fracture energy is quoted as 65 N/m by some who recomputed the panel, as 90 by
/// others; where it is left out MC2010 gives 135.
fn concrete(fracture_energy: Option<f64>) -> Properties {
    let given = Given {
        code: Code::Mc2010,
        fcm: Some(31e6),
        fctm: Some(2.7e6),
        modulus: Some(25.85e9),
        poisson: Some(0.18),
        fracture_energy,
        ..Given::default()
    };
    given.complete().unwrap()
}

/// An L of plain concrete, 500 mm, legs 250 mm, of which a slice as thick as an element is computed (nothing varies across): the foot held, pushed up 30 mm
/// from the tip.
fn panel(h: f64, concrete: Properties) -> (Model, Vec<u32>) {
    let lines = divide(0.0, 0.5, &[0.25, 0.47], h);
    let mut mesh = block(&lines, &lines, &[0.0, h], "concrete").unwrap();
    let centres: Vec<DVec3> = (0..mesh.hexes.len() as u32).map(|e| mesh.centre(e)).collect();
    let mut places = centres.iter();
    mesh.hexes.retain(|_| places.next().is_some_and(|c| c.x < 0.25 || c.y > 0.25));
    let mesh = without_orphans(mesh);
    let near = |a: f64, b: f64| (a - b).abs() < 1e-6;
    let nodes =
        |keep: &dyn Fn(DVec3) -> bool| -> Vec<u32> { (0..mesh.nodes.len() as u32).filter(|&n| keep(mesh.nodes[n as usize])).collect() };
    let foot = nodes(&|p| near(p.y, 0.0));
    let loaded = nodes(&|p| near(p.x, 0.47) && near(p.y, 0.25));
    let mut holds: Vec<(u32, u8)> = foot.iter().flat_map(|&n| [(n, 0), (n, 1)]).collect();
    holds.extend(foot.iter().filter(|&&n| near(mesh.nodes[n as usize].z, 0.0)).map(|&n| (n, 2)));
    let force = DVec3::Y * 1e3 * h / THICK / loaded.len() as f64;
    let load = Load { name: "push".into(), action: Action::Nodes(loaded.iter().map(|&n| (n, force)).collect()), history: vec![] };
    let matter = Matter::Concrete(Box::new((concrete, Setting::short_term(h))));
    let bodies = vec![Body { matter, birth: f64::NEG_INFINITY }];
    (Model { mesh, bodies, holds, loads: vec![load], ..Model::default() }, loaded)
}

fn without_orphans(mut mesh: Mesh) -> Mesh {
    let unused = mesh.unused_nodes();
    let mut number = vec![0; mesh.nodes.len()];
    let (mut next, mut old) = (0, 0);
    for (n, number) in number.iter_mut().enumerate() {
        *number = next;
        next += u32::from(!unused.contains(&(n as u32)));
    }
    mesh.nodes.retain(|_| {
        old += 1;
        !unused.contains(&(old - 1))
    });
    mesh.hexes.iter_mut().for_each(|h| h.nodes = h.nodes.map(|n| number[n as usize]));
    mesh.node_sets.clear();
    mesh.face_sets.clear();
    mesh
}

/// (displacement of the loaded point, m; force, N) up to .5 mm.
fn curve(h: f64, concrete: Properties) -> Vec<(f64, f64)> {
    let (model, loaded) = panel(h, concrete);
    let structure = Structure::new(&model).unwrap();
    let row = loaded.iter().map(|&n| (n, 1, 1.0 / loaded.len() as f64)).collect();
    let settings = Settings { tolerance: 1e-3, iterations: 60, ..Settings::default() };
    let mut march = March::new(&structure, structure.rest(0.0), Drive::Indirect { load: 0, row }, settings);
    let mut curve = Vec::new();
    for k in 1..=25 {
        march
            .advance(f64::from(k), STEP, &Job::default(), |history, step| {
                curve.push((STEP * step.time, history.factor * 1e3));
                Ok(())
            })
            .unwrap();
    }
    curve
}

/// Measured: 7.219 kN at .2078 mm, 5.27 kN at .30, 2.48 at .50.
#[test]
#[ignore = "minutes"]
fn winkler_l_panel() {
    for fracture_energy in [Some(65.0), Some(90.0), None] {
        for h in [0.025, 0.0125] {
            let curve = curve(h, concrete(fracture_energy));
            let peak = curve.iter().fold((0.0, 0.0), |m, &(u, f)| if f > m.1 { (u, f) } else { m });
            let at = |u: f64| curve.iter().find(|p| p.0 >= u - 1e-12).map_or(f64::NAN, |p| p.1 / 1e3);
            println!(
                "G_f {fracture_energy:?} h {h}: peak {:.3} kN at {:.3} mm, {:.2} kN at .30 mm, {:.2} at .50; measured 7.219 at .208, 5.27, 2.48",
                peak.1 / 1e3,
                1e3 * peak.0,
                at(0.3e-3),
                at(0.5e-3)
            );
            assert!(peak.1 > 5e3 && peak.1 < 9e3);
        }
    }
}
