//! Steering measured:
//! `cargo run --release -p intrados-xray --example steer -- [walks] [first] [rounds] [mm] [seeds]`.
//! Scatter on a patch of 2×2 cm behind 300 mm, 450 kV behind 3 mm of copper, both sides; learning
//! is charged, and done anew for every seed.

#![allow(clippy::print_stdout, reason = "that is what it is for")]

#[path = "../tests/bench/mod.rs"]
mod bench;

use bench::{Tube, cylinder, patch};
use intrados_stage::{Cancelled, Job, cpu_seconds};
use intrados_transport::{
    Estimator, Schedule, Scores, Side, Steering, TransportProblem, WalkEstimate, WalkRule,
    figure_of_merit, measure,
};
use intrados_xray::{
    physics::Model,
    primary::primary_at,
    problem::PhotonProblem,
    scanner::Scanner,
    specimen::Specimen,
    steer::{Guide, learn, rule},
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1).map(|a| a.parse::<u64>());
    let mut next = |default: u64| arguments.next().unwrap_or(Ok(default));
    let (walks, first, rounds, mm, seeds) =
        (next(200_000)?, next(4096)?, next(4)? as u32, next(300)?, next(1)?);
    let specimen = cylinder(mm as f64 * 1e-3, Model::Bound)?;
    let scanner = patch(mm as f64 * 1e-3, 0.2, Tube::Kv450.spectrum()?);
    let [through, _] = primary_at(&specimen, &scanner, scanner.panel.centre);
    let case = Case { specimen, scanner, through, walks, schedule: Schedule { first, rounds } };
    let mut ratios = Vec::new();
    for seed in 1..=seeds {
        println!("seed {seed}");
        ratios.push(case.once(seed)?);
    }
    let n = ratios.len() as f64;
    let mean = ratios.iter().sum::<f64>() / n;
    let error = (ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt();
    println!(
        "walks from the tube, learning charged, over next-event unsteered: {mean:.1} +- {error:.1} ({seeds} seeds)"
    );
    if seeds == 1 {
        let analog = WalkRule { estimator: Estimator::Analog, ..WalkRule::default() };
        case.run("Dual analog", &case.plain(), Side::Dual, &analog, (7, 50 * walks));
    }
    Ok(())
}

struct Case {
    specimen: Specimen,
    scanner: Scanner,
    /// Primary of the patch.
    through: f64,
    walks: u64,
    schedule: Schedule,
}

impl Case {
    fn plain(&self) -> PhotonProblem<'_> {
        PhotonProblem::new(&self.specimen, &self.scanner)
    }

    /// Learns and measures, both sides: merit from the tube with learning charged, over that of
    /// next-event unsteered.
    fn once(&self, seed: u64) -> Result<f64, Cancelled> {
        let guide = learn(
            &self.specimen,
            &self.scanner,
            1,
            seed,
            self.schedule,
            Steering::On,
            &Job::default(),
        )?;
        self.tell(&guide);
        let mut merits = [0.0; 2];
        for side in Side::BOTH {
            let (reading, seconds) = self.run(
                &format!("{side:?} steered"),
                &guide.steer(self.plain(), side),
                side,
                &rule(),
                (seed, self.walks),
            );
            let (all, seconds) = (guide.with_learning(side, reading), seconds + guide.cpu_seconds);
            let steered = figure_of_merit(all.rel_error(), seconds);
            let percent = 100.0 * all.rel_error();
            println!(
                "  with learning: {:.4}, {percent:.2} % in {seconds:.2} CPU-s, FoM {steered:.3e}",
                all.mean / self.through
            );
            let (reading, seconds) = self.run(
                &format!("{side:?} unsteered"),
                &self.plain(),
                side,
                &rule(),
                (seed, 5 * self.walks),
            );
            merits = [steered, figure_of_merit(reading.rel_error(), seconds)];
        }
        Ok(merits[0] / merits[1])
    }

    fn tell(&self, guide: &Guide) {
        for r in &guide.course.rounds {
            let s = r.scores.reading();
            println!(
                "  {:?} steered {} walks {} SPR {:.4} +- {:.4} relVar {:.2} events/walk {:.1} CPU {:.2} + {:.2} s",
                r.side,
                r.steered,
                s.walks,
                s.mean / self.through,
                s.std_error / self.through,
                s.rel_var_per_walk(),
                r.events as f64 / s.walks as f64,
                r.cpu_seconds[0],
                r.cpu_seconds[1]
            );
        }
        println!("  learning {:.2} CPU-s, {} kB", guide.cpu_seconds, guide.bytes() / 1024);
    }

    fn run<P: TransportProblem<Value = f64>>(
        &self,
        name: &str,
        problem: &P,
        side: Side,
        rule: &WalkRule,
        (seed, walks): (u64, u64),
    ) -> (WalkEstimate, f64) {
        let begin = cpu_seconds();
        let scores: Scores = measure(problem, side, rule, seed, 0..walks);
        let seconds = cpu_seconds() - begin;
        let r = scores.reading();
        println!(
            "  {name}: {:.4} +- {:.4}, relVar {:.2}, {seconds:.2} s, {:.2} us/walk, FoM {:.3e}; {}",
            r.mean / self.through,
            r.std_error / self.through,
            r.rel_var_per_walk(),
            1e6 * seconds / r.walks as f64,
            figure_of_merit(r.rel_error(), seconds),
            scores.converged().complaint()
        );
        (r, seconds)
    }
}
