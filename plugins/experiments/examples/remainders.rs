//! How exact first order is, in all three physics, on the bundled column C4:
//! `cargo run --release -p intrados-experiments --example remainders`.
//!
//! Prints ‖I(δv) − I(0) − δ ∂I/∂d·v‖ over ‖I(0)‖, all readings together, for δ = 1 down to 1/64,
//! and the order by which it falls.

#![allow(clippy::print_stdout, reason = "a program for the command line")]

use std::{error::Error, sync::Arc};

use intrados_gauges::rig::Rig;
use intrados_light::{Extent, LitScene, Sensor, Stain, StainedLight, scene_rule};
use intrados_mechanics::{member::Meshing, model::System};
use intrados_scene::{Camera, Scene};
use intrados_stage::{Job, cpu_seconds};
use intrados_transport::Perturbed;
use intrados_xray::{
    perturbed::{Fault, FaultyScan, section},
    scan::{Detector, Protocol},
    specimen::concrete::{Subject, of_member},
};

/// Largest δ halved so often.
const HALVINGS: i32 = 6;

fn norm(v: impl Iterator<Item = f64>) -> f64 {
    v.map(|x| x * x).sum::<f64>().sqrt()
}

fn table<P: Perturbed>(name: &str, problem: &mut P, towards: &[f64]) -> Result<(), P::Error> {
    let begin = cpu_seconds();
    let sound = vec![0.0; problem.damages()];
    let known = problem.sensitivities(&sound)?;
    let slopes: Vec<f64> = known
        .by_damage
        .iter()
        .map(|row| row.iter().zip(towards).map(|(j, v)| j * v).sum())
        .collect();
    let all = norm(known.readings.iter().copied());
    let effect = norm(slopes.iter().copied()) / all;
    println!(
        "{name}: {} readings, {} damages, first order {effect:.3e}",
        known.readings.len(),
        sound.len()
    );
    let mut before = f64::NAN;
    for k in 0..=HALVINGS {
        let delta = 0.5_f64.powi(k);
        let found = problem.readings(&towards.iter().map(|v| delta * v).collect::<Vec<_>>())?;
        let rest = norm(
            found.iter().zip(&known.readings).zip(&slopes).map(|((f, i), s)| f - i - delta * s),
        ) / all;
        println!(
            "  δ = 1/{:<3} remainder {rest:.3e}   order {:.2}",
            1 << k,
            (before / rest).log2()
        );
        before = rest;
    }
    println!("  {:.1} CPU-s", cpu_seconds() - begin);
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let job = Job::default();
    let scene = Arc::new(Scene::load_bundled("column", &job)?);
    let id = "C4";
    let index = scene.members.iter().position(|m| m.id == id).ok_or("no C4")?;
    let member = &scene.members[index];

    let lit = LitScene::build(Arc::clone(&scene), &job)?;
    let side = member.frame.radial(90.0);
    let objects: Vec<usize> =
        (0..scene.objects.len()).filter(|&i| scene.objects[i].member == Some(index)).collect();
    let floor = scene.objects.iter().position(|o| o.name == "floor slab").ok_or("no floor")?;
    let stains = vec![
        Stain {
            objects: objects.clone(),
            extent: Extent::Ball { centre: member.frame.point(0.12) + 0.2 * side, radius: 0.15 },
            share: 0.8,
        },
        Stain { objects, extent: Extent::All, share: 0.5 },
        Stain { objects: vec![floor], extent: Extent::All, share: 0.5 },
    ];
    let camera = scene.cameras.iter().find(|c| c.name == "C4 foot").ok_or("no camera")?;
    let camera = Sensor::Camera(Camera { width: 24, height: 24, ..camera.clone() });
    let mut light = StainedLight {
        rule: scene_rule(&scene),
        ..StainedLight::new(&lit, vec![camera], stains, 64, 1)
    };
    table(
        "light, 24 × 24 pixels of camera C4 foot, a spall, all of the column, the floor",
        &mut light,
        &[1.0; 3],
    )?;

    let protocol =
        Protocol::of_scene(&scene.structure.scanners[0], None, None, Detector::default())?
            .slit(4, 0.57);
    let (recipe, _) =
        of_member(Subject::of(&scene, id)?, 0.25, protocol.field(), 0.08, protocol.voxel(), 1)?;
    let (specimen, faults) = section(&recipe)?;
    let faults: Vec<Fault> = faults.into_iter().map(|(_, fault)| fault).collect();
    let scanner = protocol.scanner([32, 4], 0.4);
    let towards = vec![0.9; faults.len()];
    let mut scan = FaultyScan::new(&specimen, &scanner, faults, 0, 1);
    table("X-rays, 32 × 4 pixels behind the cracked section, primary", &mut scan, &towards)?;
    (scan.walks, scan.links) = (100_000, 4);
    table("the same with scatter", &mut scan, &towards)?;

    let rig = Rig::new(&scene, id, Meshing::default())?.ok_or("no load tests")?;
    let structure = System::new(&rig.model)?;
    let mut linear = rig.linear(&structure, &job)?;
    let mut damage = vec![0.0; rig.zones.len()];
    (damage[5], damage[14]) = (0.8, 0.6);
    let towards = rig.soften(&damage);
    table("mechanics, gauges under the load tests, two softened zones", &mut linear, &towards)?;
    Ok(())
}
