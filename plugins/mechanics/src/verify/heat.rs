//! Heat and what it does.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;
use intrados_stage::Job;

use super::solids::{hold_quarter, quarter};
use super::{Checks, Trouble, check, elastic, model, node, order, solve, steps, stress, within};
use crate::{
    heat::{Conduction, Conductor, Heat, Kept},
    mesh::{Mesh, block},
    model::{Action, Elastic, Load, Matter, System},
};

/// A body that is there from the beginning.
fn conductor(conductivity: f64, capacity: f64) -> Conductor {
    Conductor { conductivity, capacity, hydration: None, birth: f64::NEG_INFINITY, fresh: 0.0 }
}

/// The tube a = 1, b = 2, E = 30000, ν = .2, α = 1e-5, 20 K warmer inside than outside: T = 20
/// ln(b/r)/ln(b/a), found by conduction, then its stress σ_θ = E α ΔT/(2(1 − ν) ln(b/a))
/// [1 − ln(b/r) − a²/(b² − a²)(1 + b²/r²) ln(b/a)].
pub(super) fn cylinder(job: &Job) -> Checks {
    let mesh = quarter(steps(1.0, 2.0, 40), 40, 0.1)?;
    let kept = |set: &str, value: f64| {
        mesh.node_sets[set].iter().map(move |&node| Kept { node, history: vec![(0.0, value)] })
    };
    let conduction = Conduction {
        bodies: vec![conductor(1.6, 2.4e6)],
        films: vec![],
        kept: kept("inner", 20.0).chain(kept("outer", 0.0)).collect(),
        theta: 1.0,
    };
    let mut heat = Heat::new(&mesh, &conduction)?;
    let rest = heat.rest(0.0, 0.0);
    let warmth = heat.steady(&rest, job)?.temperature;
    let middle = warmth[node(&mesh, 1.5 * DVec3::X)? as usize];

    let law = Elastic { expansion: 1e-5, ..elastic(30_000.0, 0.2) };
    let mut model = model(mesh, Matter::Elastic(law));
    hold_quarter(&mut model, true);
    model.loads.push(Load {
        name: "heat".into(),
        action: Action::Temperature(warmth),
        history: vec![],
    });
    let structure = System::new(&model)?;
    let history = solve(&structure, 1.0, job)?;
    let (angle, radius) = (FRAC_PI_2 / 80.0, 1.5125 * (FRAC_PI_2 / 80.0).cos());
    let along = DVec3::new(angle.cos(), angle.sin(), 0.0);
    let radial = stress(&structure, &history, radius * along + 0.05 * DVec3::Z, along)?;
    // σ_r = −E α ΔT/(2(1 − ν) ln(b/a)) [ln(b/r) + a²/(b² − a²)(1 − b²/r²) ln(b/a)]
    let exact = -0.3 * 20.0 / (1.6 * 2f64.ln())
        * ((2.0 / radius).ln() + (1.0 - 4.0 / radius.powi(2)) / 3.0 * 2f64.ln());
    let hoop = |r: f64| stress(&structure, &history, r * DVec3::X, DVec3::Y);
    Ok(vec![
        within(
            "heat",
            "tube: temperature at r = 1.5",
            middle,
            20.0 * (2.0_f64 / 1.5).ln() / 2f64.ln(),
            1e-3,
        ),
        within("heat", "warm tube: hoop stress at the inner face", hoop(1.0)?, -4.589_89, 0.02),
        within("heat", "warm tube: hoop stress at the outer face", hoop(2.0)?, 2.910_11, 0.02),
        within("heat", format!("warm tube: radial stress at r = {radius:.3}"), radial, exact, 5e-3),
    ])
}

/// T at x = .08 of a bar of .1 m, T(0) = 0, T(.1) = 100 sin(πt/40), at 32 s; `n` bricks and 16 n
/// steps.
fn bar(n: usize, job: &Job) -> Result<f64, Trouble> {
    let mesh: Mesh = block(&steps(0.0, 0.1, n), &[0.0, 0.01], &[0.0, 0.01], "bar")?;
    let count = 16 * n;
    let times = steps(0.0, 32.0, count);
    let sine: Vec<_> = times.iter().map(|&t| (t, 100.0 * (PI * t / 40.0).sin())).collect();
    let cold = mesh.node_sets["x0"].iter().map(|&node| Kept { node, history: vec![(0.0, 0.0)] });
    let warm = mesh.node_sets["x1"].iter().map(|&node| Kept { node, history: sine.clone() });
    let conduction = Conduction {
        bodies: vec![conductor(35.0, 7200.0 * 440.5)],
        films: vec![],
        kept: cold.chain(warm).collect(),
        theta: 0.5,
    };
    let mut heat = Heat::new(&mesh, &conduction)?;
    let mut now = heat.rest(0.0, 0.0);
    for &t in &times[1..] {
        now = heat.step(&now, t, job)?;
    }
    Ok(now.temperature[node(&mesh, DVec3::new(0.08, 0.0, 0.0))? as usize])
}

/// The exact solution by Duhamel's integral over the sine series: with ω = π/40, λ = κ(kπ/L)², T =
/// 100 sin(ωt) x/L + Σ 200 (−1)^k/(kπ) sin(kπx/L) ω [λ cos ωt + ω sin ωt − λ e^(−λt)]/(λ² + ω²).
fn exact(x: f64, t: f64) -> f64 {
    let (diffusivity, omega) = (35.0 / (7200.0 * 440.5), PI / 40.0);
    let series = (1..=400).map(|k| {
        let wave = f64::from(k) * PI;
        let lambda = diffusivity * (wave / 0.1).powi(2);
        let response = omega
            * (lambda * (omega * t).cos() + omega * (omega * t).sin()
                - lambda * (-lambda * t).exp())
            / (lambda.powi(2) + omega.powi(2));
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        200.0 * sign / wave * (wave * x / 0.1).sin() * response
    });
    100.0 * (omega * t).sin() * x / 0.1 + series.sum::<f64>()
}

/// NAFEMS T3: 36.60 °C.
pub(super) fn t3(job: &Job) -> Checks {
    let (reference, [coarse, fine]) = (exact(0.08, 32.0), [bar(10, job)?, bar(20, job)?]);
    Ok(vec![
        within("NAFEMS", "T3, 20 bricks: temperature at 32 s", fine, 36.60, 0.01),
        within("NAFEMS", "T3: the series", reference, 36.60, 2e-3),
        check(
            "NAFEMS",
            "T3: order of the error against the series, 10 to 20 bricks and steps",
            order(coarse - reference, fine - reference),
            2.0,
            0.3,
        ),
    ])
}
