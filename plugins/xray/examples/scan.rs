//! A member of a bundled scene, scanned:
//! `cargo run --release -p intrados-xray --example scan -- scenes/column.ron C2 0.35 512 720 out.raw`.

#![allow(clippy::print_stdout, reason = "that is what it is for")]

use std::time::Instant;

use intrados_scene::Scene;
use intrados_stage::{Job, cpu_seconds};
use intrados_xray::{
    physics::Library,
    recon::Window,
    scan::*,
    specimen::concrete::{Subject, substances},
    volume::{Depth, Writer},
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let a: Vec<String> = std::env::args().collect();
    let (job, begin) = (Job::default(), Instant::now());
    let scene = Scene::open(a[1].as_ref(), &job)?;
    let member = Subject::of(&scene, &a[2])?;
    let protocol = Protocol::of_scene(
        &scene.structure.scanners[0],
        Some(a[5].parse()?),
        Some(a[4].parse()?),
        Detector::default(),
    )?
    .slit(4, 0.56);
    let say = |what: &str| {
        println!("{:7.1} s {:7.1} CPU-s {what}", begin.elapsed().as_secs_f64(), cpu_seconds())
    };
    let target = Target::of_member(member, a[3].parse()?, &protocol, 4, 1, &job)?;
    say(&format!(
        "grown: {} bodies, {:.3} aggregate; {:?} voxels, slices {:?}",
        target.concrete.bodies.len(),
        target.concrete.aggregate,
        target.painted.grid.size,
        target.slices.size
    ));
    let energies = Energies::new(&protocol, substances(&target.concrete, &Library::builtin()?)?);
    let known = Known {
        protocol: protocol.clone(),
        drawing: Drawing::of_recipe(&target.concrete.recipe),
        slices: target.slices,
    };
    let (drawn, made) = (known.drawing.solids(&protocol)?, target.solids(&protocol)?);
    let bodies = [
        Behind { specimen: &drawn, protocol: &protocol, seed: 2 },
        Behind { specimen: &made, protocol: &protocol, seed: 1 },
    ];
    let [guess, truth] = ScatterMap::cast(bodies, &ScatterSettings::default(), &job)?;
    say(&format!("scatter: {:.2} of primary, error {:.3}", truth.to_primary, truth.rel_error));
    let rays = Rays::new(&target.painted);
    let exposure = expose(&rays, &energies, Some(&truth), &protocol, 3, &job)?;
    say(&format!("exposed: open {:.3e}", exposure.open));
    for (name, corrections) in [("all", Corrections::ALL), ("none", Corrections::NONE)] {
        let restored = restore(&exposure, &known, Some(&guess), corrections, Window::Hann, &job)?;
        say(&format!("restored {name}: {:.0} keV, starved {:.4}", restored.kev, restored.starved));
        let mut w = Writer::create(
            format!("{}-{name}.tif", a[6]).as_ref(),
            restored.volume.grid,
            Depth::Float,
        )?;
        w.write_slab(&restored.volume.data)?;
        w.finish()?;
        if name == "all" {
            let mut w = Writer::create(
                format!("{}-truth.tif", a[6]).as_ref(),
                restored.volume.grid,
                Depth::Float,
            )?;
            w.write_slab(&target.attenuation(restored.kev)?)?;
            w.finish()?;
        }
    }
    Ok(())
}
