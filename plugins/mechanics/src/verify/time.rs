//! Creep, ageing, birth.

use glam::DVec3;
use intrados_stage::Job;

use super::{
    Checks, STRICT, Trouble, always, check, elastic, hold, model, near, order, steps, within,
};
use crate::{
    element::embed::embed,
    material::{DAY, chain::Chain, concrete::Given, creep::Creep, law::Setting, steel::Bar},
    mesh::{Hex, Locator, block},
    model::{Action, Body, Drive, History, Load, March, Matter, Model, Steel, SteelKind, System},
};

/// m.
const LENGTH: f64 = 0.4;

/// A bar of one brick along x, its planes x = 0, y = 0, z = 0 held.
fn brick(matter: Matter, area: f64) -> Result<Model, Trouble> {
    let mut model = model(block(&[0.0, LENGTH], &[0.0, area / 0.4], &[0.0, 0.4], "brick")?, matter);
    hold(&mut model, 0, |p| near(p.x, 0.0));
    hold(&mut model, 1, |p| near(p.y, 0.0));
    hold(&mut model, 2, |p| near(p.z, 0.0));
    Ok(model)
}

/// A strong concrete of this modulus, Pa.
pub(super) fn of_modulus(modulus: f64) -> Given {
    Given { fcm: Some(60e6), modulus: Some(modulus), ..Given::default() }
}

/// Concrete of constant modulus and strength that creeps by a chain of its own.
pub(super) fn chained(given: Given, units: &[(f64, f64)]) -> Result<Matter, Trouble> {
    let setting = Setting { chain: Some(Chain::constant(units)), ..Setting::short_term(0.5) };
    Ok(Matter::Concrete(Box::new((given.complete()?, setting))))
}

fn end(model: &Model) -> Vec<u32> {
    model.mesh.node_sets.get("x1").cloned().unwrap_or_default()
}

/// A force along x, spread over the end.
fn push(model: &Model, newton: f64) -> Load {
    let nodes = end(model).into_iter().map(|n| (n, 0.25 * newton * DVec3::X)).collect();
    Load { name: "push".into(), action: Action::Nodes(nodes), history: vec![] }
}

/// Goes through all times, the first of them at once.
fn march(
    structure: &System,
    times: &[f64],
    job: &Job,
    mut see: impl FnMut(&History),
) -> Result<History, Trouble> {
    let mut march = March::new(structure, structure.rest(0.0), Drive::Loads, STRICT);
    for &time in times {
        march.advance(time, 0.0, job, |_, _| Ok(()))?;
        see(&march.history);
    }
    Ok(march.history)
}

fn stress_of(structure: &System, history: &History, hex: usize) -> Result<f64, Trouble> {
    Ok(structure.points(hex, history)?[0].stress[0])
}

/// Spring 30 GPa and a Kelvin unit 20 GPa, 100 s at constant strain: σ = ε [12 + 18 e^(−t/40)] GPa.
pub(super) fn standard_solid(job: &Job) -> Checks {
    let strain = -1e-4;
    let relaxed = |n: usize| -> Result<f64, Trouble> {
        let mut model = brick(chained(of_modulus(30e9), &[(20e9, 100.0)])?, 0.16)?;
        let moved = end(&model).into_iter().map(|n| (n, 0, LENGTH * strain)).collect();
        model.loads.push(Load {
            name: "strain".into(),
            action: Action::Displacement(moved),
            history: vec![],
        });
        let structure = System::new(&model)?;
        let history = march(&structure, &steps(0.0, 40.0, n), job, |_| {})?;
        stress_of(&structure, &history, 0)
    };
    let exact = strain * 1e9 * (12.0 + 18.0 * (-1f64).exp());
    let [coarse, fine] = [relaxed(10)?, relaxed(20)?];
    Ok(vec![
        within(
            "creep",
            "standard linear solid relaxes in 20 steps: σ(40 s) = 18.62183 ε",
            fine,
            exact,
            1e-4,
        ),
        check(
            "creep",
            "standard linear solid: order of the error in the step",
            order(coarse - exact, fine - exact),
            2.0,
            0.1,
        ),
    ])
}

/// x with 1/(1 − e^(−x)) − 1/x = χ.
fn duration_of(chi: f64) -> f64 {
    let (mut low, mut high) = (1e-3, 1e3);
    for _ in 0..100 {
        let x: f64 = 0.5 * (low + high);
        if 1.0 / (1.0 - (-x).exp()) - 1.0 / x < chi { low = x } else { high = x }
    }
    0.5 * (low + high)
}

/// Column .4 × .4 m with 12 bars of 16 mm under 1.6 MN, φ = 2, shrinkage −.3 ‰. The age-adjusted
/// effective modulus E/(1 + χφ) is the exponential algorithm with one Kelvin unit in one step of x
/// = Δt/τ: stress changes linearly, and χ = 1/(1 − e^(−x)) − 1/x. For χ = .8, x = 4.80.
pub(super) fn column(job: &Job) -> Checks {
    let (modulus, phi, chi, end_time) = (32e9, 2.0, 0.8, 1e6);
    let steel_area = 12.0 * std::f64::consts::PI * 0.016_f64.powi(2) / 4.0;
    let x = duration_of(chi);
    let unit = (modulus * (1.0 - (-x).exp()) / phi, end_time / x);
    let mut model = brick(chained(of_modulus(modulus), &[unit])?, 0.16 - steel_area)?;
    let axis = [0.0, LENGTH].map(|x| DVec3::new(x, 0.5 * (0.16 - steel_area) / 0.4, 0.2));
    let locator = Locator::new(&model.mesh);
    let pieces = embed(
        &axis,
        |p| locator.locate(p).map(|h| (h.hex as usize, h.natural)),
        |hex| model.mesh.corners(hex as u32),
    )?;
    model.steel.push(Steel {
        name: "bars".into(),
        pieces,
        area: steel_area,
        count: 12.0,
        kind: SteelKind::Bar(Bar::new(500e6)?),
        rust: None,
        gone: Vec::new(),
        bond: None,
        displaces: false,
    });
    model.loads.push(push(&model, -1.6e6));
    let shrinkage = Action::Temperature(vec![-30.0; model.mesh.nodes.len()]);
    model.loads.push(Load {
        name: "shrinkage".into(),
        action: shrinkage,
        history: vec![(0.0, 0.0), (end_time, 1.0)],
    });
    let structure = System::new(&model)?;
    let mut seen = Vec::new();
    march(&structure, &[0.0, end_time], job, |history| seen.push(history.clone()))?;
    let mut checks = Vec::new();
    for (when, history, concrete, steel) in
        [("at once", &seen[0], -9.2664, -57.915), ("in the end", &seen[1], -7.1107, -198.715)]
    {
        checks.push(within(
            "creep",
            format!("column, φ = 2, χ = .8: concrete {when}, MPa"),
            stress_of(&structure, history, 0)? / 1e6,
            concrete,
            1e-5,
        ));
        checks.push(within(
            "creep",
            format!("column, φ = 2, χ = .8: bars {when}, MPa"),
            history.steel[0][0].stress / 1e6,
            steel,
            1e-5,
        ));
    }
    Ok(checks)
}

/// OOFEM's values for its deck `EC2creep.in` (f_cm 30 MPa, loaded at 7 d, RH 50 %, h₀ 100 mm, N),
/// strain under 1 MPa.
pub(super) fn compliance(job: &Job) -> Checks {
    let concrete = Given { fcm: Some(30e6), ..Given::default() }.complete()?;
    let setting = Setting::long_term(0.5, Creep::new(concrete.clone(), 0.5, 0.1)?);
    let quoted = [(0.1, 4.5603e-5), (5.0, 6.8940e-5), (1e4, 1.592_03e-4)];
    // Decades from a minute on, in which the quoted days are points.
    let mut days: Vec<f64> = (0..=72)
        .map(|k| 1e-3 * 10f64.powf(f64::from(k) / 10.0))
        .filter(|d| *d <= 1e4)
        .chain([5.0])
        .collect();
    days.sort_by(f64::total_cmp);
    let times: Vec<f64> = std::iter::once(0.0).chain(days.iter().map(|d| d * DAY)).collect();
    // What shrinks is not under load.
    let strains = [-0.16e6, 0.0].map(|newton| -> Result<Vec<f64>, Trouble> {
        let mut model =
            brick(Matter::Concrete(Box::new((concrete.clone(), setting.clone()))), 0.16)?;
        model.bodies[0].birth = -7.0 * DAY;
        model.loads.push(push(&model, newton));
        let structure = System::new(&model)?;
        let (mut strains, end) = (Vec::new(), end(&model)[0] as usize);
        march(&structure, &times, job, |history| strains.push(history.x[3 * end]))?;
        Ok(strains)
    });
    let [loaded, free] = strains;
    let (loaded, free) = (loaded?, free?);
    let strain_at = |day: f64| {
        let at = times.iter().position(|t| (t / DAY / day - 1.0).abs() < 1e-6);
        at.map_or(f64::NAN, |i| (free[i] - loaded[i]) / LENGTH)
    };
    Ok(quoted
        .map(|(day, strain)| {
            within(
                "creep",
                format!("EC2, loaded at 7 d for {day} d: compliance, 1/MPa"),
                strain_at(day),
                strain,
                5e-3,
            )
        })
        .into())
}

/// A bar under load, then a second one at the same nodes, born without stress: of what comes later
/// each takes half.
pub(super) fn born(job: &Job) -> Checks {
    let law = || Matter::Elastic(elastic(30e9, 0.0));
    let mut model = brick(law(), 0.16)?;
    let region = model.mesh.region("second");
    let twin = Hex { region, ..model.mesh.hexes[0] };
    model.mesh.hexes.push(twin);
    model.bodies = vec![always(law()), Body { matter: law(), birth: 1.5 }];
    model.loads.push(Load {
        history: vec![(0.0, 0.0), (1.0, 1.0), (2.0, 1.0), (3.0, 3.0)],
        ..push(&model, 0.32e6)
    });
    let structure = System::new(&model)?;
    let mut checks = Vec::new();
    let mut seen = Vec::new();
    march(&structure, &[1.0, 2.0, 3.0], job, |history| seen.push(history.clone()))?;
    for (history, [first, second]) in seen[1..].iter().zip([[2e6, 0.0], [4e6, 2e6]]) {
        let when = if second == 0.0 { "when born" } else { "under the rest of the load" };
        checks.push(check(
            "birth",
            format!("first bar {when}, Pa"),
            stress_of(&structure, history, 0)?,
            first,
            1e-3,
        ));
        checks.push(check(
            "birth",
            format!("second bar {when}, Pa"),
            stress_of(&structure, history, 1)?,
            second,
            1e-3,
        ));
    }
    Ok(checks)
}
