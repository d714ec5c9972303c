//! Experiments with concrete, recomputed. Slow, and it writes the plots of plugins/mechanics/docs:
//!
//! ```text
//! INTRADOS_DATA=… cargo test --release -p intrados-mechanics --test experiments -- --ignored --nocapture --test-threads 1
//! ```
//!
//! Chosen beforehand for all of them, and tuned to none of the curves:
//!
//! * strengths, moduli and dimensions from the source; what it does not measure by MC2010 from f_c,
//!   printed;
//! * cracks by the largest tension, which compression across helps (Kupfer; for one damage the
//!   modified von Mises strain with k = f_c/f_t); softening over the band that a crack has in its
//!   brick, by MC2010's two lines for cracks that know directions (the law of members), exponential
//!   for one damage;
//! * bars of 200 GPa, hardening E/100, bonded without slip;
//! * one brick across the width, free to bulge; half of what is symmetric;
//! * equilibrium within 1 % of all that acts, or, where a step's iterations run out, 3 %.
//!
//! Other choices can be tried, for all at once: `EXPERIMENT_SIZES=.05,.025` (m),
//! `EXPERIMENT_DIFFUSE=1` (one damage for all directions instead of cracks in planes: what had been
//! declared at first; plots of its own),
//! `EXPERIMENT_BOND=1` (bars slip by the CEB law, anchored at their ends),
//! `EXPERIMENT_STRENGTH=mean` (f_ct from the mean strength of the cylinders, as if it were
//! characteristic), `EXPERIMENT_PLATE=1` (beams are moved by a plate that stays flat instead of
//! pressed evenly), `EXPERIMENT_TOLERANCE=.001`. The others write no plots. `EXPERIMENT_TALK=1`
//! tells each step.
//!
//! `record.rs` holds every figure to what it was when it was last run (2 %), and to the list of
//! gates that are known to be missed: a test fails where a figure leaves its value, newly misses its
//! gate, or reaches one that is listed as missed. `EXPERIMENT_COARSE=1` runs the first mesh of each,
//! `EXPERIMENT_ONLY=A1` one specimen of a series. Of other choices nothing is recorded.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test may panic, and tells its figures"
)]

mod band;
mod column;
mod columns;
mod flexure;
mod interaction;
mod membrane;
mod panel;
mod prestressed;
mod record;
mod series;
mod shear;
mod slender;

use std::{
    f64::consts::PI,
    ffi::OsStr,
    path::{Path, PathBuf},
};

use glam::DVec3;
use intrados_mechanics::{
    Meshing,
    analysis::{Observer, Outcome},
    analyze,
    element::embed::embed,
    material::{
        bond::Bond,
        concrete::{Code, Properties, tensile_strength},
        law::Cracks,
        steel::Bar,
    },
    member::Along,
    mesh::Locator,
    model::{History, Point, Slipping, Steel, SteelKind, Step},
    prelude::*,
    prepare,
    write::{Curve, plot},
};
use intrados_scene::Scene;
use intrados_stage::Job;

/// Set: one damage for all directions.
const DIFFUSE: &str = "EXPERIMENT_DIFFUSE";

/// What was measured: (abscissa, ordinate) in the units of the file.
fn measured(file: &str) -> Vec<(f64, f64)> {
    let data =
        std::env::var_os("INTRADOS_DATA").expect("INTRADOS_DATA must name the folder of test data");
    let text = std::fs::read_to_string(PathBuf::from(data).join("experiments").join(file)).unwrap();
    let pair = |line: &str| {
        line.split_once(',').map(|(a, b)| (a.trim().parse().unwrap(), b.trim().parse().unwrap()))
    };
    text.lines().filter(|line| !line.starts_with('#')).filter_map(pair).collect()
}

/// Draws plugins/mechanics/docs/`name`.svg, or `name`-diffuse.svg for one damage for all
/// directions, unless other choices are tried.
fn draw(name: &str, title: &str, axes: [&str; 2], curves: &[Curve]) {
    let other = |name: &OsStr| {
        name.to_string_lossy().starts_with("EXPERIMENT_")
            && name != "EXPERIMENT_TALK"
            && name != DIFFUSE
    };
    if std::env::vars_os().any(|(name, _)| other(&name)) {
        return;
    }
    let suffix = if std::env::var_os(DIFFUSE).is_some() { "-diffuse" } else { "" };
    let file = format!("{name}{suffix}.svg");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    plot(&folder.join(file), title, axes, curves).unwrap();
}

/// f_ct, Pa, where it is asked for by the mean strength of the cylinders (`EXPERIMENT_STRENGTH`).
fn tried_strength(fcm: f64) -> Option<f64> {
    std::env::var_os("EXPERIMENT_STRENGTH").map(|_| tensile_strength(fcm))
}

/// The meshes asked for by `EXPERIMENT_SIZES` (m, with commas), or these.
fn sizes(usual: &[f64]) -> Vec<f64> {
    std::env::var("EXPERIMENT_SIZES")
        .map_or(usual.to_vec(), |sizes| sizes.split(',').map(|h| h.parse().unwrap()).collect())
}

/// A concrete of mean strength `fcm`, all else by MC2010, and what that was.
fn concrete(given: Given) -> Properties {
    let mut given = Given { code: Code::Mc2010, ..given };
    given.fctm = given.fctm.or(given.fcm.and_then(tried_strength));
    let properties = given.complete().unwrap();
    let assumed: Vec<String> = properties
        .assumed
        .iter()
        .map(|a| format!("{} {:.4e} ({})", a.quantity, a.value, a.source))
        .collect();
    println!("  assumed: {}", assumed.join(", "));
    properties
}

/// A model of one concrete.
fn model(mesh: Mesh, concrete: Properties) -> Model {
    let cracks = if std::env::var_os(DIFFUSE).is_some() { Cracks::Diffuse } else { Cracks::Planes };
    let matter =
        Matter::Concrete(Box::new((concrete, Setting { cracks, ..Setting::short_term(0.1) })));
    Model { mesh, bodies: vec![Body { matter, birth: f64::NEG_INFINITY }], ..Model::default() }
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-6
}

/// Nodes where `keep`.
fn nodes(mesh: &Mesh, keep: impl Fn(DVec3) -> bool) -> Vec<u32> {
    (0..mesh.nodes.len() as u32).filter(|&n| keep(mesh.nodes[n as usize])).collect()
}

/// Holds a component of the nodes where `keep`.
fn hold(model: &mut Model, component: u8, keep: impl Fn(DVec3) -> bool) {
    model.holds.extend(nodes(&model.mesh, keep).into_iter().map(|n| (n, component)));
}

/// `count` straight bars of `area` m² together that yield at `yielding` Pa.
fn lay(model: &mut Model, name: &str, ends: [DVec3; 2], [count, area]: [f64; 2], yielding: f64) {
    let locator = Locator::new(&model.mesh);
    let find = |p: DVec3| locator.locate(p).map(|host| (host.hex as usize, host.natural));
    let pieces = embed(&ends, find, |h| model.mesh.corners(h as u32)).unwrap();
    let kind = SteelKind::Bar(Bar::new(yielding).unwrap());
    let bond = std::env::var_os("EXPERIMENT_BOND").map(|_| {
        let fcm =
            model
                .bodies
                .iter()
                .find_map(|body| {
                    if let Matter::Concrete(mix) = &body.matter { Some(mix.0.fcm) } else { None }
                })
                .unwrap();
        let diameter = (4.0 * area / count / PI).sqrt();
        Slipping {
            bond: Bond::good(fcm, 0.6 * diameter),
            perimeter: count * PI * diameter,
            anchored: [true; 2],
        }
    });
    model.steel.push(Steel {
        name: name.into(),
        pieces,
        area,
        count,
        kind,
        rust: None,
        gone: Vec::new(),
        bond,
        displaces: true,
    });
}

/// Forces along `direction` at nodes, 1 kN together.
fn kilonewton(nodes: &[u32], direction: DVec3) -> Load {
    let each = direction * 1e3 / nodes.len() as f64;
    Load {
        name: "force".into(),
        action: Action::Nodes(nodes.iter().map(|&n| (n, each)).collect()),
        history: vec![(0.0, 0.0)],
    }
}

/// The mean displacement of nodes along `direction`.
fn mean(nodes: &[u32], component: u8, sign: f64) -> Vec<(u32, u8, f64)> {
    nodes.iter().map(|&n| (n, component, sign / nodes.len() as f64)).collect()
}

/// Raises one load along a weighted sum of displacements.
fn raised(load: usize, row: Vec<(u32, u8, f64)>) -> Drive {
    Drive::Raised { loads: vec![(load, 1.0)], control: Control::Row(row) }
}

/// The life of the first member of a scene, whose load `jack` is then raised to failure.
fn jacked(text: &str, element: Option<f64>, watch: &mut impl Observer) -> Outcome {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("test.ron");
    std::fs::write(&path, text).unwrap();
    let scene = Scene::load(&path, &Job::default()).unwrap();
    let assembly = &scene.structure.assemblies[0];
    let mut prepared = prepare(&scene, assembly, Meshing { element }, &Job::default()).unwrap();
    assert!(prepared.raise(&["jack"], Along::Automatic));
    for body in &mut prepared.model.bodies {
        if let Matter::Concrete(mix) = &mut body.matter {
            mix.1.transverse = std::env::var_os("EXPERIMENT_UNSOFTENED").is_none();
            mix.1.bonded = std::env::var_os("EXPERIMENT_UNBONDED").is_none();
            mix.1.dilation = std::env::var_os("EXPERIMENT_DILATION").is_some();
        }
    }
    analyze(&prepared, MarchSettings::of_life(), &Job::default(), watch).unwrap().0
}

/// What became of a member that was pushed.
struct Pushed {
    /// (controlled displacement, m; factor of the load).
    curve: Vec<(f64, f64)>,
    /// Where a bar yielded first.
    yields: Option<(f64, f64)>,
}

/// Pushes in steps up to `last`, or until a third of the peak is left, or nothing balances any
/// more; the factor of the load `load` is found. The first unit of time is for loads that come
/// before.
fn pushed(model: &Model, load: usize, row: Vec<(u32, u8, f64)>, step: f64, last: f64) -> Pushed {
    pushed_in(model, load, row, [step, last], false)
}

/// The same of second order: equilibrium where things have moved to.
fn pushed_where_it_has_moved_to(
    model: &Model,
    load: usize,
    row: Vec<(u32, u8, f64)>,
    step: f64,
    last: f64,
) -> Pushed {
    pushed_in(model, load, row, [step, last], true)
}

fn pushed_in(
    model: &Model,
    load: usize,
    row: Vec<(u32, u8, f64)>,
    [step, last]: [f64; 2],
    turned: bool,
) -> Pushed {
    let clock = std::time::Instant::now();
    let structure = System::new(model).unwrap();
    let tolerance = std::env::var("EXPERIMENT_TOLERANCE").map_or(1e-2, |t| t.parse().unwrap());
    let settings =
        MarchSettings { tolerance, loose: 3.0, iterations: 40, ..MarchSettings::default() };
    let drive = raised(load, row.clone());
    let mut rest = structure.rest(0.0);
    rest.turned = turned;
    let mut march = March::new(&structure, rest, drive, settings);
    let (mut curve, mut yields, mut peak, mut steps, mut jumps) =
        (vec![(0.0, 0.0)], None, 0.0_f64, 0, 0);
    if model.loads.len() > 1 {
        march.advance(1.0, 0.0, &Job::default(), |_, _| Ok(())).unwrap();
        curve[0].1 = march.history.factor;
    }
    for k in 1..=(last / step).round() as usize {
        let went = march.advance(1.0 + k as f64, step, &Job::default(), |history, step| {
            let at: f64 =
                row.iter().map(|&(n, c, w)| w * history.x[3 * n as usize + c as usize]).sum();
            (steps, jumps) = (steps + 1, jumps + usize::from(step.avalanche > 0));
            peak = peak.max(history.factor);
            curve.push((at, history.factor));
            if yields.is_none()
                && history.steel.iter().flatten().any(|piece| piece.bar.accumulated > 0.0)
            {
                yields = Some((at, history.factor));
            }
            Ok(())
        });
        if std::env::var_os("EXPERIMENT_TALK").is_some() {
            let &(at, force) = curve.last().unwrap();
            println!(
                "    {:.3} mm {force:.2}, {steps} steps, {jumps} avalanches, {:.0} s",
                1e3 * at,
                clock.elapsed().as_secs_f64()
            );
        }
        if let Err(why) = went {
            println!("  ends: {why}");
            break;
        }
        if curve.last().unwrap().1 < peak / 3.0 {
            break;
        }
    }
    println!(
        "  {} unknowns, {steps} steps, of them {jumps} avalanches, {:.0} s",
        structure.unknowns(),
        clock.elapsed().as_secs_f64()
    );
    Pushed { curve, yields }
}

/// The highest point.
fn peak(curve: &[(f64, f64)]) -> (f64, f64) {
    curve.iter().fold((0.0, f64::NEG_INFINITY), |m, &p| if p.1 > m.1 { p } else { m })
}

/// The highest point before the first fall of more than a tenth: where the member breaks, whatever
/// it bears afterwards.
fn break_point(curve: &[(f64, f64)]) -> (f64, f64) {
    let mut top = curve[0];
    for &p in curve {
        if p.1 < 0.9 * top.1 {
            break;
        }
        top = if p.1 > top.1 { p } else { top };
    }
    top
}

/// The ordinate where the abscissa first reaches `at`.
fn ordinate(curve: &[(f64, f64)], at: f64) -> f64 {
    let after = curve.iter().position(|p| p.0 >= at).unwrap_or(curve.len() - 1).max(1);
    let [(a, f), (b, g)] = [curve[after - 1], curve[after]];
    if a == b { g } else { f + (g - f) * ((at - a) / (b - a)).clamp(0.0, 1.0) }
}
