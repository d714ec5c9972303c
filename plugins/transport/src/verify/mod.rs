//! The part of the battery (theory §7) that needs no physics: everything on the matrix problem,
//! against its exact solution.

mod steering;

use intrados_stage::{Cancelled, Job, random::Key};
use nalgebra::DVector;
use rayon::prelude::*;

use crate::{
    Check, Estimator, Moments, Side, Tally, WalkRule, Workspace,
    matrix::{Exact, MatrixField, MatrixProblem, SteeredMatrix},
    measure, run,
};

/// |z| that a family of `tests` independent normal numbers exceeds by chance with probability 1 %
/// (Šidák 1967).
#[must_use]
pub fn sidak_z(tests: usize) -> f64 {
    use statrs::distribution::{ContinuousCDF, Normal};
    let each = 1.0 - 0.99_f64.powf(1.0 / tests.max(1) as f64);
    Normal::standard().inverse_cdf(1.0 - each / 2.0)
}

const RADII: [f64; 3] = [0.5, 0.8, 0.95];

/// Runs all checks on the matrix problem. False-alarm rate: 1 % for each family of z-tests; the
/// seeds are fixed.
///
/// # Errors
/// [`Cancelled`] if `job` was.
pub fn checks(job: &Job) -> Result<Vec<Check>, Cancelled> {
    let parts: [fn(f64) -> Vec<Check>; 9] = [
        zero_variance,
        law,
        bound,
        wrong_fields,
        defence,
        steering::windows,
        steering::windows_of_walks,
        steering::process,
        estimators,
    ];
    let mut all = Vec::new();
    for (i, part) in parts.into_iter().enumerate() {
        for (k, &rho) in RADII.iter().enumerate() {
            job.step(i * RADII.len() + k, parts.len() * RADII.len())?;
            all.extend(part(rho));
        }
    }
    Ok(all)
}

fn problem(rho: f64) -> (MatrixProblem, Exact) {
    let problem = MatrixProblem::chain(60, rho, 1);
    let exact = problem.solve();
    (problem, exact)
}

fn steering(exact: &Exact, side: Side) -> &DVector<f64> {
    if side == Side::Primal { &exact.field } else { &exact.importance }
}

fn steer(
    problem: &MatrixProblem,
    side: Side,
    field: DVector<f64>,
    defence: f64,
) -> SteeredMatrix<'_> {
    SteeredMatrix::new(problem, side, MatrixField::new(problem, side, field), defence)
}

/// Steered scores and events per walk.
#[derive(Default)]
struct Spread {
    score: Moments,
    fourth: f64,
    largest_error: f64,
    events: u64,
}

struct Sums(Vec<f64>);

impl Tally<f64> for Sums {
    fn score(&mut self, walk: u32, _: u32, _: u32, value: f64) {
        self.0[walk as usize] += value;
    }
}

/// Moments of score/I over `walks` steered walks.
fn spread(steered: &SteeredMatrix, side: Side, reading: f64, walks: u64) -> Spread {
    spread_of(steered, side, Estimator::LastEvent, reading, walks)
}

fn spread_of(
    steered: &SteeredMatrix,
    side: Side,
    estimator: Estimator,
    reading: f64,
    walks: u64,
) -> Spread {
    let rule = WalkRule { estimator, ..WalkRule::default() };
    let batch = 1000;
    let parts: Vec<(Vec<f64>, u64)> = (0..walks / batch)
        .into_par_iter()
        .map_init(Workspace::default, |work, b| {
            let mut sums = Sums(vec![0.0; batch as usize]);
            let events = run(steered, side, &rule, 11, b * batch..(b + 1) * batch, work, &mut sums);
            (sums.0, events)
        })
        .collect();
    let mut out = Spread::default();
    for x in parts.iter().flat_map(|(scores, _)| scores).map(|x| x / reading) {
        out.score.add(x);
        out.fourth += (x - 1.0).powi(4);
        out.largest_error = out.largest_error.max((x - 1.0).abs());
    }
    out.fourth /= walks as f64;
    // Event 0 is the start, not a visited state.
    out.events = parts.iter().map(|(_, events)| events).sum::<u64>() - walks;
    out
}

fn zero_variance(rho: f64) -> Vec<Check> {
    let (problem, exact) = problem(rho);
    let mut checks = Vec::new();
    for side in Side::BOTH {
        let steered = steer(&problem, side, steering(&exact, side).clone(), 0.0);
        let walks = 20_000;
        let got = spread(&steered, side, exact.reading, walks);
        checks.push(Check::run(
            "zero-variance",
            format!("exact field, {side:?} walk, ρ {rho}: largest |score/I − 1|"),
            0.0,
            1e-12,
            || got.largest_error,
        ));
        checks.push(Check::run(
            "zero-variance",
            format!("the same with weight windows, {side:?} walk, ρ {rho}: largest |score/I − 1|"),
            0.0,
            1e-12,
            || {
                spread(&steered.clone().windowed(exact.reading), side, exact.reading, walks)
                    .largest_error
            },
        ));
        let length = exact.zero_variance_length();
        // A walk's length has a spread of about its mean; 4 standard errors.
        let tolerance = 4.0 * length / (walks as f64).sqrt();
        checks.push(Check::run(
            "length",
            format!("mean events of the zero-variance {side:?} walk, ρ {rho}, against L*"),
            length,
            tolerance,
            || got.events as f64 / walks as f64,
        ));
    }
    checks
}

/// Relative errors in [-1, 1], fixed by seed.
fn noise(n: usize, seed: u64) -> DVector<f64> {
    DVector::from_fn(n, |i, _| 2.0 * Key::new(seed, i as u64).unit64(1) - 1.0)
}

fn law(rho: f64) -> Vec<Check> {
    let (problem, exact) = problem(rho);
    let mut checks = Vec::new();
    for side in Side::BOTH {
        let field = steering(&exact, side);
        let spoilt = |eps: f64| {
            steer(
                &problem,
                side,
                field.component_mul(&(noise(field.len(), 3) * eps).add_scalar(1.0)),
                0.0,
            )
        };
        let sizes = [0.005_f64, 0.01, 0.02, 0.05];
        checks.push(Check::run(
            "law",
            format!("slope of log relVar on log ε, {side:?}, ρ {rho}"),
            2.0,
            0.05,
            || slope(&sizes.map(|e| (e.ln(), spoilt(e).oracle().ln()))),
        ));
        checks.push(Check::run(
            "law",
            format!("V₂/exact relVar at ε .01, {side:?}, ρ {rho}"),
            1.0,
            0.02,
            || spoilt(0.01).law(&exact) / spoilt(0.01).oracle(),
        ));
        let walks = 200_000;
        let steered = spoilt(0.05);
        checks.push(Check::run(
            "oracle",
            format!("z of the sample variance against the oracle, ε .05, {side:?}, ρ {rho}"),
            0.0,
            sidak_z(6),
            || {
                let got = spread(&steered, side, exact.reading, walks);
                let variance = got.score.variance();
                (variance - steered.oracle())
                    / ((got.fourth - variance * variance) / walks as f64).sqrt()
            },
        ));
    }
    checks
}

/// Theory §5.4: relVar ≤ e²(1 + L*) for small errors within ±e, and fields whose error changes its
/// sign from state to state nearly reach it: what a walk may go on to then scatters as much as it
/// can.
fn bound(rho: f64) -> Vec<Check> {
    let (problem, exact) = problem(rho);
    let e = 0.1 * (1.0 - rho) / (1.0 + rho);
    let most = e * e * (1.0 + exact.zero_variance_length());
    let edges: Vec<_> = (1..4)
        .map(|stride| {
            DVector::from_fn(problem.len(), |i, _| if i / stride % 2 == 0 { e } else { -e })
        })
        .collect();
    let of = |side| {
        let rel_var = |edge: &DVector<f64>| {
            steer(&problem, side, steering(&exact, side).component_mul(&edge.add_scalar(1.0)), 0.0)
                .oracle()
        };
        let name = format!(
            "largest relVar over its bound e²(1 + L*), errors of ±{e:.3} in turn, {side:?}, ρ {rho}"
        );
        Check::run("bound", name, 0.95, 0.06, || {
            edges.iter().map(rel_var).fold(0.0, f64::max) / most
        })
    };
    Side::BOTH.map(of).into()
}

fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let (xy, xx) = points
        .iter()
        .fold((0.0, 0.0), |(a, b), (x, y)| (a + (x - mx) * (y - my), b + (x - mx).powi(2)));
    xy / xx
}

fn wrong_fields(rho: f64) -> Vec<Check> {
    let (problem, exact) = problem(rho);
    let allowed = 0.9 * (1.0 - exact.spectral_radius) / (1.0 + exact.spectral_radius);
    let mut checks = Vec::new();
    for side in Side::BOTH {
        let field = steering(&exact, side);
        let spoilt = field.component_mul(&(noise(field.len(), 5) * allowed).add_scalar(1.0));
        let steered = steer(&problem, side, spoilt, 0.0);
        checks.push(Check::run(
            "wrong field",
            format!("z of the mean, ε ±{allowed:.3}, {side:?}, ρ {rho}, 1e6 walks"),
            0.0,
            sidak_z(6),
            || {
                let got = spread(&steered, side, exact.reading, 1_000_000);
                if steered.oracle().is_finite() {
                    (got.score.mean - 1.0) / got.score.std_error()
                } else {
                    f64::INFINITY
                }
            },
        ));
    }
    checks
}

/// Fields that are not even nearly right.
fn wrong(n: usize) -> [(&'static str, DVector<f64>); 3] {
    [
        ("random", noise(n, 7).map(|x| (4.0 * x).exp())),
        ("zero in half the space", DVector::from_fn(n, |i, _| if i < n / 2 { 0.0 } else { 1.0 })),
        ("zero everywhere", DVector::zeros(n)),
    ]
}

fn defence(rho: f64) -> Vec<Check> {
    // Shallow, since probabilities are measured to a rounding of 1.
    let problem = MatrixProblem::chain(12, rho, 2);
    let exact = problem.solve();
    let fields = wrong(problem.len());
    let mut checks = Vec::new();
    for side in Side::BOTH {
        for (name, field) in &fields {
            let steered = steer(&problem, side, field.clone(), 0.1);
            let name = format!("expectation/I by what is drawn, field {name}, {side:?}, ρ {rho}");
            checks.push(Check::run("defence", name, 1.0, 1e-11, || {
                steered.expectation() / exact.reading
            }));
        }
    }
    checks
}

/// Every estimator from both sides on a shallow problem (the deep ones are out of reach of
/// unsteered walks).
fn estimators(rho: f64) -> Vec<Check> {
    let problem = MatrixProblem::chain(12, rho, 2);
    let exact = problem.solve();
    let mut checks = Vec::new();
    for side in Side::BOTH {
        for estimator in
            [Estimator::Analog, Estimator::Collision, Estimator::LastEvent, Estimator::NextEvent]
        {
            let rule = WalkRule { estimator, ..WalkRule::default() };
            checks.push(Check::run(
                "duality",
                format!("z of the {side:?} {estimator:?} walk against the exact reading, ρ {rho}"),
                0.0,
                sidak_z(24),
                || {
                    let scores = measure(&problem, side, &rule, 17, 0..400_000);
                    (scores.mean() - exact.reading) / scores.std_error()
                },
            ));
        }
    }
    checks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_battery_passes() {
        let checks = checks(&Job::new("verify")).unwrap();
        let failed: Vec<_> = checks.iter().filter(|c| !c.passed).collect();
        assert!(checks.len() > 60 && failed.is_empty(), "{failed:#?}");
    }

    /// The battery must be able to fail: a wrong reading is found at once.
    #[test]
    fn a_wrong_reading_is_found() {
        let (problem, exact) = problem(0.5);
        let steered = steer(&problem, Side::Primal, exact.field.clone(), 0.0);
        assert!(spread(&steered, Side::Primal, exact.reading * 1.001, 1000).largest_error > 9e-4);
    }
}
