//! Steering measured: `cargo run --release -p intrados-xray --example steer -- [walks]`. Scatter on a patch of 2×2 cm behind 300 mm, 450 kV behind 3 mm of copper, both sides.

#![allow(clippy::print_stdout, reason = "that is what it is for")]

use intrados_stage::{Job, cpu_seconds};
use intrados_transport::{Estimator, Rule, Schedule, Side, Steering, figure_of_merit, measure};
use intrados_xray::{
    bench::{Tube, cylinder, patch},
    physics::Model,
    primary::primary_at,
    problem::PhotonProblem,
    steer::{learn, rule},
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1).map(|a| a.parse::<u64>());
    let walks = arguments.next().unwrap_or(Ok(200_000))?;
    let first = arguments.next().unwrap_or(Ok(16_384))?;
    let rounds = arguments.next().unwrap_or(Ok(4))? as u32;
    let diameter = arguments.next().unwrap_or(Ok(300))? as f64 * 1e-3;
    let specimen = cylinder(diameter, Model::Bound)?;
    let scanner = patch(diameter, 0.2, Tube::Kv450.spectrum()?);
    let plain = || PhotonProblem::new(&specimen, &scanner);
    let [through, _] = primary_at(&specimen, &scanner, scanner.panel.centre);
    let guide = learn(&specimen, &scanner, 1, 1, Schedule { first, rounds }, Steering::On, &Job::default())?;
    for r in &guide.course.rounds {
        let s = r.scores.reading();
        println!(
            "{:?} steered {} walks {} SPR {:.4} +- {:.4} relVar {:.2} events/walk {:.1} CPU {:.2} + {:.2} s",
            r.side,
            r.steered,
            s.walks,
            s.mean / through,
            s.std_error / through,
            s.rel_var_per_walk(),
            r.events as f64 / s.walks as f64,
            r.cpu_seconds[0],
            r.cpu_seconds[1]
        );
    }
    println!("learning {:.2} CPU-s, {} kB", guide.cpu_seconds, guide.bytes() / 1024);
    let show = |name: &str, scores: intrados_transport::Scores, seconds: f64| {
        let r = scores.reading();
        println!(
            "{name}: {:.4} +- {:.4}, relVar {:.2}, {seconds:.2} s, {:.2} us/walk, FoM {:.3e}; {}",
            r.mean / through,
            r.std_error / through,
            r.rel_var_per_walk(),
            1e6 * seconds / r.walks as f64,
            figure_of_merit(r.rel_error(), seconds),
            scores.converged().complaint()
        );
    };
    for side in Side::BOTH {
        let begin = cpu_seconds();
        let scores = measure(&guide.steer(plain(), side), side, &rule(), 7, 0..walks);
        let seconds = cpu_seconds() - begin;
        let all = guide.with_learning(side, scores.reading());
        show(&format!("{side:?} steered"), scores, seconds);
        println!(
            "  with learning: {:.4} +- {:.4}, FoM {:.3e} with all of it charged",
            all.mean / through,
            all.std_error / through,
            figure_of_merit(all.rel_error(), seconds + guide.cpu_seconds)
        );
        let begin = cpu_seconds();
        let scores = measure(&plain(), side, &rule(), 7, 0..5 * walks);
        show(&format!("{side:?} unsteered"), scores, cpu_seconds() - begin);
    }
    let begin = cpu_seconds();
    let scores = measure(&plain(), Side::Dual, &Rule { estimator: Estimator::Analog, ..Rule::default() }, 7, 0..50 * walks);
    show("Dual analog", scores, cpu_seconds() - begin);
    Ok(())
}
