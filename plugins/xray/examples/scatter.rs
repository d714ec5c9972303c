//! Scatter over primary behind a concrete cylinder:
//! `cargo run --release -p intrados-xray --example scatter -- [walks]`. Both sides, three
//! estimators, CPU-seconds.

#![allow(clippy::print_stdout, reason = "that is what it is for")]

#[path = "../tests/bench/mod.rs"]
mod bench;

use bench::{Tube, cylinder, patch};
use intrados_stage::cpu_seconds;
use intrados_transport::{
    Estimator, Roulette, Side, WalkRule, duality_z, figure_of_merit, measure,
};
use intrados_xray::{physics::Model, primary::primary_at, problem::PhotonProblem};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let walks: u64 = std::env::args().nth(1).map_or(Ok(1_000_000), |w| w.parse())?;
    for model in [Model::Peer, Model::Free, Model::Bound] {
        for tube in [Tube::Kv225, Tube::Kv450] {
            for (diameter, height) in
                [(0.1, 0.002), (0.1, 0.2), (0.2, 0.002), (0.2, 0.2), (0.3, 0.002), (0.3, 0.2)]
            {
                if model != Model::Peer && height < 0.1 {
                    continue;
                }
                let specimen = cylinder(diameter, model)?;
                let scanner = patch(
                    diameter,
                    height,
                    if model == Model::Peer { tube.peer_spectrum()? } else { tube.spectrum()? },
                );
                let problem = PhotonProblem::new(&specimen, &scanner);
                let [through, _] = primary_at(&specimen, &scanner, scanner.panel.centre);
                let mut all = Vec::new();
                print!("{model:?} {tube:?} D {diameter} beam {height}:");
                for (side, estimator) in [
                    (Side::Dual, Estimator::NextEvent),
                    (Side::Primal, Estimator::NextEvent),
                    (Side::Dual, Estimator::Analog),
                ] {
                    let rule =
                        WalkRule { estimator, roulette: Roulette::Weight, ..WalkRule::default() };
                    let begin = cpu_seconds();
                    let scores = measure(&problem, side, &rule, 1, 0..walks);
                    let seconds = cpu_seconds() - begin;
                    let r = scores.reading();
                    print!(
                        "  {side:?} {estimator:?} {:.4} +- {:.4} ({seconds:.1} s, FoM {:.3})",
                        r.mean / through,
                        r.std_error / through,
                        figure_of_merit(r.rel_error(), seconds)
                    );
                    all.push(r);
                }
                println!(
                    "  z {:.2} {:.2}",
                    duality_z(all[0].mean, all[0].std_error, all[1].mean, all[1].std_error),
                    duality_z(all[0].mean, all[0].std_error, all[2].mean, all[2].std_error)
                );
            }
        }
    }
    Ok(())
}
