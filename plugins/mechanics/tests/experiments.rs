//! Experiments with concrete, recomputed: material values from the source, what is missing by the codes from the strength, nothing tuned to the curve. Slow:
//! `cargo test --release -p intrados-mechanics --test experiments -- --ignored --nocapture`.

use glam::DVec3;
use intrados_mechanics::{
    material::{
        concrete::{Code, Given},
        law::Setting,
    },
    mesh::{Mesh, block, divide},
    model::{Action, Body, Drive, Load, March, Matter, Model, Settings, Structure},
};
use intrados_stage::Job;

/// Winkler (2001): an L of plain concrete, 500 mm, legs 250 mm, 100 mm thick; the foot held, pushed up 30 mm from the tip.
fn l_panel(h: f64) -> Vec<(f64, f64)> {
    let lines = divide(0.0, 0.5, &[0.25, 0.47], h);
    let mut mesh = block(&lines, &lines, &[0.0, h], "concrete").unwrap();
    let keep: Vec<bool> = (0..mesh.hexes.len() as u32)
        .map(|e| {
            let c = mesh.centre(e);
            c.x < 0.25 || c.y > 0.25
        })
        .collect();
    let mut i = 0;
    mesh.hexes.retain(|_| {
        i += 1;
        keep[i - 1]
    });
    let mesh = without_orphans(mesh);
    let given = Given {
        code: Code::Mc2010,
        fcm: Some(31e6),
        fctm: Some(2.7e6),
        modulus: Some(25.85e9),
        poisson: Some(0.18),
        fracture_energy: Some(65.0),
        ..Given::default()
    };
    let concrete = given.complete().unwrap();
    let mut model = Model {
        bodies: vec![Body { matter: Matter::Concrete(Box::new((concrete, Setting::short_term(h)))), birth: f64::NEG_INFINITY }],
        ..Model::default()
    };
    let near = |a: f64, b: f64| (a - b).abs() < 1e-6;
    for (i, p) in mesh.nodes.iter().enumerate() {
        if near(p.y, 0.0) {
            (0..2).for_each(|c| model.holds.push((i as u32, c)));
        }
        if near(p.z, 0.0) && near(p.y, 0.0) {
            model.holds.push((i as u32, 2));
        }
    }
    let loaded: Vec<u32> = (0..mesh.nodes.len() as u32)
        .filter(|&n| {
            let p = mesh.nodes[n as usize];
            near(p.x, 0.47) && near(p.y, 0.25)
        })
        .collect();
    assert!(!loaded.is_empty());
    let share = 1.0 / loaded.len() as f64;
    model.loads.push(Load {
        name: "push".into(),
        action: Action::Nodes(loaded.iter().map(|&n| (n, DVec3::Y * share * 1e3 * h / 0.1)).collect()),
        history: vec![],
    });
    model.mesh = mesh;
    let structure = Structure::new(&model).unwrap();
    let drive = Drive::Indirect { load: 0, row: loaded.iter().map(|&n| (n, 1, share)).collect() };
    let settings = Settings { tolerance: 1e-3, iterations: 60, ..Settings::default() };
    let mut march = March::new(&structure, structure.rest(0.0), drive, settings);
    let mut curve = vec![];
    for k in 1..=50 {
        let r = march.advance(f64::from(k), 0.02e-3, &Job::default(), |history, step| {
            println!(
                "   step {:.3} factor {:.3} iterations {} linear {} residual {:.1e}",
                step.time, step.factor, step.iterations, step.linear, step.residual
            );
            curve.push((0.02e-3 * step.time, history.factor * 1e3));
            Ok(())
        });
        if let Err(e) = r {
            println!("{e}");
            break;
        }
    }
    curve
}

fn without_orphans(mut mesh: Mesh) -> Mesh {
    let mut used = vec![false; mesh.nodes.len()];
    mesh.hexes.iter().flat_map(|h| h.nodes).for_each(|n| used[n as usize] = true);
    let mut next = 0;
    let number: Vec<u32> = used
        .iter()
        .map(|&u| {
            let n = next;
            next += u32::from(u);
            n
        })
        .collect();
    let mut i = 0;
    mesh.nodes.retain(|_| {
        i += 1;
        used[i - 1]
    });
    mesh.hexes.iter_mut().for_each(|h| h.nodes = h.nodes.map(|n| number[n as usize]));
    mesh.node_sets.clear();
    mesh.face_sets.clear();
    mesh
}

#[test]
#[ignore = "minutes"]
fn winkler_l_panel() {
    for h in [0.025] {
        let begin = std::time::Instant::now();
        let curve = l_panel(h);
        let peak = curve.iter().fold((0.0, 0.0), |m, &(u, f)| if f > m.1 { (u, f) } else { m });
        println!("h {h}: peak {:.3} kN at {:.4} mm, {:.1?}; measured 7.219 kN at .2078 mm", peak.1 / 1e3, peak.0 * 1e3, begin.elapsed());
    }
}
