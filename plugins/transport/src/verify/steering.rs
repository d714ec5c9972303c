//! Walks that split and play roulette, and walks of both sides that teach each other.

use intrados_stage::Job;

use super::{problem, sidak_z, spread_of, steer, wrong};
use crate::{
    Check, Estimator, Scores, Side, WalkRule,
    matrix::{Learns, MatrixProblem, Trainer},
    process::{Course, Schedule, Steering, alternate},
};

/// No bias, whatever the field holds and whatever reading the windows are told: exactly, over all
/// ways of short walks.
pub(super) fn windows(rho: f64) -> Vec<Check> {
    let mut checks = Vec::new();
    let small = MatrixProblem::chain(4, rho, 3);
    let rule = WalkRule {
        estimator: Estimator::LastEvent,
        max_order: 6,
        roulette_from: 2,
        ..WalkRule::default()
    };
    let truth = small.reading_up_to(rule.max_order);
    for side in Side::BOTH {
        for (name, field) in wrong(small.len()) {
            checks.push(Check::run(
                "windows",
                format!(
                    "largest |expectation/I − 1| by what is drawn, field {name}, reading told 1e-2 to 1e2 of what it is, {side:?}, ρ {rho}"
                ),
                0.0,
                1e-11,
                || {
                    let told = |factor: f64| steer(&small, side, field.clone(), 0.1).windowed(factor * truth).expectation_of_walks(&rule);
                    [0.01, 0.3, 1.0, 30.0, 100.0].map(|factor| (told(factor) / truth - 1.0).abs()).into_iter().fold(0.0, f64::max)
                },
            ));
        }
    }
    checks
}

/// The same by walks without end, on the shallow chain, where the variance stays finite.
pub(super) fn windows_of_walks(rho: f64) -> Vec<Check> {
    if rho > 0.5 {
        return Vec::new();
    }
    let problem = MatrixProblem::chain(6, rho, 2);
    let reading = problem.solve().reading;
    let mut checks = Vec::new();
    for side in Side::BOTH {
        for (name, field) in &wrong(problem.len())[..2] {
            for estimator in [Estimator::LastEvent, Estimator::Collision] {
                let steered = steer(&problem, side, field.clone(), 0.3).windowed(reading);
                let name = format!(
                    "z of the mean, field {name}, {side:?} {estimator:?}, ρ {rho}, 1e6 walks"
                );
                checks.push(Check::run("windows", name, 0.0, sidak_z(8), || {
                    let got = spread_of(&steered, side, estimator, reading, 1_000_000);
                    (got.score.mean - 1.0) / got.score.std_error()
                }));
            }
        }
    }
    checks
}

/// Walks of each side in the first round, and rounds.
pub(super) const SCHEDULE: Schedule = Schedule { first: 1024, rounds: 6 };

/// The alternation from nothing.
pub(super) fn learn(problem: &MatrixProblem, seed: u64, learns: Learns) -> (Trainer<'_>, Course) {
    let mut trainer = Trainer::new(problem, seed, learns);
    // A job of its own: nobody can cancel it.
    let course =
        alternate(&mut trainer, SCHEDULE, Steering::On, &Job::default()).unwrap_or_default();
    (trainer, course)
}

/// Mean of (score/I − 1)²: relVar that a wrong mean does not flatter.
fn error_of_walk(scores: &Scores, reading: f64) -> f64 {
    let variance = scores.std_error().powi(2) * scores.walks() as f64;
    (variance + (scores.mean() - reading).powi(2)) / (reading * reading)
}

/// The complementary dual process from nothing to nearly zero variance, on chains as deep as I =
/// 2e-10.
pub(super) fn process(rho: f64) -> Vec<Check> {
    let (problem, exact) = problem(rho);
    let (trainer, course) = learn(&problem, 1, Learns::Both);
    let mut checks = Vec::new();
    let from_nothing = format!("ρ {rho}, I {:.1e}, from nothing", exact.reading);
    for side in Side::BOTH {
        let rounds: Vec<_> = course.rounds.iter().filter(|round| round.side == side).collect();
        let errors: Vec<f64> =
            rounds.iter().map(|round| error_of_walk(&round.scores, exact.reading)).collect();
        checks.push(Check::run(
            "process",
            format!("{side:?} rounds until a walk errs by less than I for good, {from_nothing}"),
            2.0,
            1.0,
            || {
                errors
                    .iter()
                    .rposition(|&e| e.is_nan() || e >= 1.0)
                    .map_or(0.0, |last| last as f64 + 1.0)
            },
        ));
        checks.push(Check::run(
            "process",
            format!("log10 relVar of a {side:?} walk at the end (exact), {from_nothing}"),
            -5.0,
            1.0,
            || trainer.steer(side).rel_var().log10(),
        ));
        let residuals = trainer.residuals(side);
        checks.push(Check::run(
            "process",
            format!("largest ratio of the {side:?} residual to the round before, last 4 rounds, {from_nothing}"),
            0.4,
            0.39,
            || residuals[residuals.len().saturating_sub(4)..].windows(2).map(|pair| pair[1] / pair[0]).fold(0.0, f64::max),
        ));
        let z = rounds.last().map_or(f64::NAN, |round| {
            (round.scores.mean() - exact.reading) / round.scores.std_error()
        });
        checks.push(Check::run(
            "process",
            format!("z of the {side:?} walks of the last round, {from_nothing}"),
            0.0,
            sidak_z(6),
            || z,
        ));
    }
    checks.push(Check::run(
        "process",
        format!("one side taught by photons of an unsteered other: 1/(1 + relVar) of a walk (exact), ρ {rho}, the same rounds"),
        0.0,
        0.1,
        || 1.0 / (1.0 + learn(&problem, 1, Learns::OneSided).0.steer(Side::Primal).rel_var().max(0.0)),
    ));
    checks
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Why both: on the chain with I = 2e-10 suffix scores alone never begin, photons of an
    /// unsteered side never arrive, photons alone remain noisy. Exact relVar of a walk after the
    /// same rounds, for three seeds.
    #[test]
    fn half_a_process_does_not_do() {
        let (problem, _) = problem(0.5);
        for seed in 1..4 {
            let rel_var = |learns| learn(&problem, seed, learns).0.steer(Side::Primal).rel_var();
            let both = rel_var(Learns::Both);
            assert!(both < 1e-4, "both: {both}");
            assert!(rel_var(Learns::Photons) > 20.0 * both);
            assert!(rel_var(Learns::Suffixes) > 1e6);
            assert!(rel_var(Learns::OneSided) > 1e3);
        }
    }

    /// The same bits on one thread and on four.
    #[test]
    fn learning_is_reproducible() {
        let (problem, _) = problem(0.8);
        let tables = [1, 4].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let (trainer, _) = pool.install(|| learn(&problem, 2, Learns::Both));
            Side::BOTH.map(|side| trainer.field(side).table().clone())
        });
        assert_eq!(tables[0], tables[1]);
    }
}
