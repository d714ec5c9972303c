//! The scatter image of a 200 mm column on 64² pixels of 6 mm:
//! `cargo run --release -p intrados-xray --example image -- [walks] [links] [first] [rounds]`.

#![allow(clippy::print_stdout, reason = "that is what it is for")]

#[path = "../tests/bench/mod.rs"]
mod bench;

use bench::{Tube, cylinder, scanner};
use intrados_stage::{Job, cpu_seconds};
use intrados_transport::{Schedule, Steering};
use intrados_xray::{physics::Model, scatter::image, steer::learn};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1).map(|a| a.parse::<u64>());
    let mut next = |default: u64| arguments.next().unwrap_or(Ok(default));
    let (walks, links, first, rounds) =
        (next(1_000_000)?, next(4)? as usize, next(8192)?, next(3)? as u32);
    let specimen = cylinder(0.2, Model::Bound)?;
    let scanner = scanner(0.2, 0.2, Tube::Kv450.spectrum()?, [64, 64], [0.006, 0.006]);
    let begin = cpu_seconds();
    let guide = learn(
        &specimen,
        &scanner,
        links,
        1,
        Schedule { first, rounds },
        Steering::On,
        &Job::default(),
    )?;
    let learning = cpu_seconds() - begin;
    for r in &guide.course.rounds {
        println!(
            "{:?} steered {} relVar {:.2} CPU {:.2} + {:.2}",
            r.side,
            r.steered,
            r.scores.reading().rel_var_per_walk(),
            r.cpu_seconds[0],
            r.cpu_seconds[1]
        );
    }
    for (name, guide) in [("steered", Some(&guide)), ("unsteered", None)] {
        let begin = cpu_seconds();
        let image = image(&specimen, &scanner, guide, links, walks, 3, &Job::default())?;
        let seconds = cpu_seconds() - begin;
        let mut relative: Vec<f64> =
            image.mean.iter().zip(&image.std_error).map(|(m, s)| s / m).collect();
        relative.sort_by(f64::total_cmp);
        println!(
            "{name}: {seconds:.1} CPU-s (learning {learning:.1}), relative error rms {:.4}, median {:.4}, 99 % {:.4}, largest {:.4}; to 2 % rms in {:.1} CPU-s; brightest over darkest {:.1}",
            image.rel_error(),
            relative[relative.len() / 2],
            relative[relative.len() * 99 / 100],
            relative[relative.len() - 1],
            seconds * (image.rel_error() / 0.02).powi(2),
            image.mean.iter().copied().fold(0.0, f64::max)
                / image.mean.iter().copied().fold(f64::INFINITY, f64::min)
        );
    }
    Ok(())
}
