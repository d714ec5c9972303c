//! Second order: columns that buckle and beams that bend far, against the elastica.

use glam::DVec3;
use intrados_stage::Job;

use super::{
    Checks, STRICT, Trouble, elastic, hold, model, near, node, steps,
    time::{chained, of_modulus},
    within,
};
use crate::{
    material::concrete::Given,
    mesh::block,
    model::{Action, Control, Drive, History, Load, March, MarchSettings, Matter, Model, System},
};

/// A strip that is a hundred times as long as thick is out of balance by far more than acts on it
/// after each long step, before it finds its length again: shorter steps.
const SETTINGS: MarchSettings = MarchSettings { cuts: 10, linear: 1e-7, tolerance: 1e-8, ..STRICT };
/// Length, thickness, modulus of a strip along x; its width is 1.
const LENGTH: f64 = 10.0;
const THICK: f64 = 0.1;
const MODULUS: f64 = 12e9;
/// E I.
const STIFFNESS: f64 = MODULUS * THICK * THICK * THICK / 12.0;

/// A strip of `n` bricks, clamped at x = 0, with forces (N in all) at its end.
fn strip(n: usize, forces: &[DVec3]) -> Result<Model, Trouble> {
    strip_of(Matter::Elastic(elastic(MODULUS, 0.0)), n, forces)
}

fn strip_of(matter: Matter, n: usize, forces: &[DVec3]) -> Result<Model, Trouble> {
    let mesh = block(&steps(0.0, LENGTH, n), &[0.0, THICK], &[0.0, 1.0], "strip")?;
    let mut model = model(mesh, matter);
    (0..3).for_each(|c| hold(&mut model, c, |p| near(p.x, 0.0)));
    hold(&mut model, 2, |p| near(p.z, 0.0));
    for force in forces {
        let end = model.mesh.node_sets["x1"].iter().map(|&n| (n, 0.25 * *force)).collect();
        let name = "end".into();
        model.loads.push(Load { name, action: Action::Nodes(end), history: vec![] });
    }
    Ok(model)
}

/// Displacement of the middle of the end, m.
fn end(model: &Model, history: &History) -> Result<DVec3, Trouble> {
    let of = |y: f64| -> Result<DVec3, Trouble> {
        let n = 3 * node(&model.mesh, DVec3::new(LENGTH, y, 0.0))? as usize;
        Ok(DVec3::new(history.x[n], history.x[n + 1], history.x[n + 2]))
    };
    Ok(0.5 * (of(0.0)? + of(THICK)?))
}

/// Complete elliptic integrals K and E of the modulus k, by the arithmetic-geometric mean.
fn elliptic(k: f64) -> [f64; 2] {
    let (mut a, mut b, mut sum, mut power) = (1.0, (1.0 - k * k).sqrt(), 0.5 * k * k, 1.0);
    for _ in 0..40 {
        let c: f64 = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), f64::sqrt(a * b));
        sum += power * c * c;
        power *= 2.0;
    }
    let whole = std::f64::consts::FRAC_PI_2 / a;
    [whole, whole * (1.0 - sum)]
}

/// A column pressed by half of Euler's load bends (tan u − u)/(u³/3) times as far under a force
/// across it, u = L √(P/EI), as it does without (Timoshenko and Gere 1961, §1.3).
pub(super) fn beam_column(job: &Job) -> Checks {
    let critical = (0.5 * std::f64::consts::PI / LENGTH).powi(2) * STIFFNESS;
    let mut checks = Vec::new();
    for share in [0.5, 0.9] {
        let across = 1e-4 * STIFFNESS / LENGTH.powi(2);
        let model = strip(20, &[-share * critical * DVec3::X, across * DVec3::Y])?;
        let structure = System::new(&model)?;
        let history = solve_turned(&structure, job)?;
        let u = 0.5 * std::f64::consts::PI * share.sqrt();
        let first = across * LENGTH.powi(3) / (3.0 * STIFFNESS);
        checks.push(within(
            "second order",
            format!("column under {share} of Euler's load: deflection over that of first order"),
            end(&model, &history)?.y / first,
            3.0 * (u.tan() - u) / u.powi(3),
            0.01 / (1.0 - share),
        ));
    }
    Ok(checks)
}

/// Equilibrium of second order under the loads as they are.
fn solve_turned(structure: &System, job: &Job) -> Result<History, Trouble> {
    let start = History { turned: true, ..structure.rest(0.0) };
    let mut march = March::new(structure, start, Drive::Loads, SETTINGS);
    march.advance(1.0, 0.0, job, |_, _| Ok(()))?;
    Ok(march.history)
}

/// P–Δ with creep: a column pressed by .3 of Euler's load and bent by a force P across its end, of a
/// standard solid that yields twice as much in the end (a spring E, a Kelvin unit E and τ).
///
/// Its deflection is Σ aₙ(t) (1 − cos kₙx), kₙ = nπ/2L, n odd: slopes and curvatures of these are
/// orthogonal, so that each aₙ obeys kₙ² I aₙ = J ∗ d(N aₙ + 2P/L kₙ²) by itself, and goes from
/// aₙ(0) to aₙ(∞), those of the moduli E and E/2, with the rate (1 − (N/E)/(kₙ² I − N/E))/τ.
pub(super) fn creeping(job: &Job) -> Checks {
    const DELAY: f64 = 100.0;
    let euler = (0.5 * std::f64::consts::PI / LENGTH).powi(2) * STIFFNESS;
    let (axial, across) = (0.3 * euler, 1e-4 * STIFFNESS / LENGTH.powi(2));
    let inertia = STIFFNESS / MODULUS;
    let exact = |time: f64| -> f64 {
        let mode = |n: u32| {
            let k2 = (0.5 * std::f64::consts::PI * f64::from(n) / LENGTH).powi(2);
            let of = |modulus: f64| 2.0 * across / (LENGTH * k2 * (modulus * inertia * k2 - axial));
            let soft = axial / MODULUS;
            let rate = (1.0 - soft / (k2 * inertia - soft)) / DELAY;
            let last = of(0.5 * MODULUS);
            last + (of(MODULUS) - last) * (-rate * time).exp()
        };
        (0..50).map(|k| mode(2 * k + 1)).sum()
    };
    // Tough, so that a brick may be as wide as the strip; it does not crack.
    let given = Given { poisson: Some(0.0), fracture_energy: Some(2000.0), ..of_modulus(MODULUS) };
    let matter = chained(given, &[(MODULUS, DELAY)])?;
    let model = strip_of(matter, 20, &[-axial * DVec3::X, across * DVec3::Y])?;
    let structure = System::new(&model)?;
    let start = History { turned: true, ..structure.rest(0.0) };
    let mut march = March::new(&structure, start, Drive::Loads, SETTINGS);
    let mut checks = Vec::new();
    for step in 0..=100 {
        let time = 0.05 * DELAY * f64::from(step);
        march.advance(time, 0.0, job, |_, _| Ok(()))?;
        if [0, 20, 100].contains(&step) {
            checks.push(within(
                "second order",
                format!("column under .3 of Euler's load that creeps: its end after {} τ, over that at once", step / 20),
                end(&model, &march.history)?.y / exact(0.0),
                exact(time) / exact(0.0),
                0.01,
            ));
        }
    }
    Ok(checks)
}

/// A cantilever under a dead load P across its end, P L²/E I = 2 and 5: Mattiasson (1981).
pub(super) fn elastica(job: &Job) -> Checks {
    let mut checks = Vec::new();
    for (load, across, along) in [(2.0, 0.49346, 0.16064), (5.0, 0.71379, 0.38763)] {
        let mut model = strip(40, &[load * STIFFNESS / LENGTH.powi(2) * DVec3::Y])?;
        model.loads[0].history = vec![(0.0, 0.0), (1.0, 1.0)];
        let structure = System::new(&model)?;
        let start = History { turned: true, ..structure.rest(0.0) };
        let mut march = March::new(&structure, start, Drive::Loads, SETTINGS);
        for k in 1..=8 {
            march.advance(f64::from(k) / 8.0, 0.0, job, |_, _| Ok(()))?;
        }
        let end = end(&model, &march.history)?;
        for (what, value, expected) in
            [("across", end.y / LENGTH, across), ("along", -end.x / LENGTH, along)]
        {
            checks.push(within(
                "second order",
                format!("elastica, P L²/E I = {load}: the end's way {what}, over L"),
                value,
                expected,
                0.01,
            ));
        }
    }
    Ok(checks)
}

/// A column pressed beyond Euler's load, followed by arc length: when its end has turned by 2 asin
/// k the load is (2 K(k)/π)² of Euler's, and the end has moved 2 k L/K across.
pub(super) fn buckled(job: &Job) -> Checks {
    let critical = (0.5 * std::f64::consts::PI / LENGTH).powi(2) * STIFFNESS;
    let mut model = strip(40, &[-critical * DVec3::X, 1e-3 * critical * DVec3::Y])?;
    model.loads[0].history = vec![(0.0, 0.0)];
    let structure = System::new(&model)?;
    let start = History { turned: true, ..structure.rest(0.0) };
    let drive = Drive::Raised { loads: vec![(0, 1.0)], control: Control::Arc };
    let mut march = March::new(&structure, start, drive, SETTINGS);
    // Lengths of arc over all nodes.
    let (mut curve, whole) = (vec![], (model.mesh.nodes.len() as f64).sqrt() * LENGTH);
    // Small steps at first: one longer than the shortening at which it buckles lands on the straight
    // column beyond.
    let mut step = 2e-6 * whole;
    for k in 0..80 {
        march.advance(f64::from(k), step, job, |_, _| Ok(()))?;
        step = (1.3 * step).min(0.02 * whole);
        let at = end(&model, &march.history)?;
        curve.push((march.history.factor, at.y));
        if at.y > 0.65 * LENGTH {
            break;
        }
    }
    let at = end(&model, &march.history)?.y / LENGTH;
    // k of that way across.
    let (mut low, mut high) = (1e-6, 0.9);
    for _ in 0..60 {
        let k = 0.5 * (low + high);
        (low, high) = if 2.0 * k / elliptic(k)[0] < at { (k, high) } else { (low, k) };
    }
    let [whole, _] = elliptic(low);
    // Southwell (1932): deflections over loads against deflections are a straight line of slope
    // 1/P_E, whatever bent it first.
    let beyond = |way: f64| curve.iter().find(|p| p.1 > way * LENGTH).copied();
    let euler = beyond(0.005).zip(beyond(0.02)).map(|((p, y), (q, z))| (z - y) / (z / q - y / p));
    Ok(vec![
        within(
            "second order",
            "column's load of buckling by Southwell's line, over Euler's",
            euler.unwrap_or(f64::NAN),
            1.0,
            0.01,
        ),
        within(
            "second order",
            format!("column that has buckled {at:.2} of its length aside: its load over Euler's"),
            march.history.factor,
            (2.0 * whole / std::f64::consts::PI).powi(2),
            0.01,
        ),
    ])
}

#[cfg(test)]
mod tests {
    use super::{super::solve, *};

    /// Without turning, no column buckles: the checks must be able to tell.
    #[test]
    fn first_order_is_found_out() {
        let critical = (0.5 * std::f64::consts::PI / LENGTH).powi(2) * STIFFNESS;
        let across = 1e-4 * STIFFNESS / LENGTH.powi(2);
        let model = strip(20, &[-0.5 * critical * DVec3::X, across * DVec3::Y]).unwrap();
        let structure = System::new(&model).unwrap();
        let history = solve(&structure, 1.0, &Job::default()).unwrap();
        let first = across * LENGTH.powi(3) / (3.0 * STIFFNESS);
        assert!((end(&model, &history).unwrap().y / first - 1.0).abs() < 0.01);
    }

    #[test]
    fn elliptic_integrals() {
        let [k, e] = elliptic(0.5);
        assert!((k - 1.685_750_354_812_596).abs() < 1e-14);
        assert!((e - 1.467_462_209_339_427).abs() < 1e-14);
    }

    #[test]
    fn second_order_is_exact() {
        let parts =
            [beam_column, creeping, elastica, buckled].map(|part| part(&Job::default()).unwrap());
        for check in parts.concat() {
            println!("{} {} {}", check.name, check.value, check.expected);
            assert!(check.passed, "{check:?}");
        }
    }
}
