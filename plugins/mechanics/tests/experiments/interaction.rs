//! Bending with axial force: a column of .4 × .4 m on the mesh that a user gets, against its section
//! by fibres. Half of a member on two supports is computed: pressed along its axis first, then
//! pushed at a third of its span, so that nothing but its own moment acts on its middle.

use super::{
    record::{FigureCheck, MOMENT, recorded_meshes},
    *,
};

/// Side of the section; half of the span, and from the support to the jack, m.
const SIDE: f64 = 0.4;
const HALF: f64 = 2.2;
const ARM: f64 = 1.5;
/// Of the member beyond its support, and half of what the jack presses on, m.
const BEYOND: f64 = 0.2;
const PLATE: f64 = 0.1;
/// Bars: depth from the pressed face, m, and how many of 20 mm.
const ROWS: [(f64, f64); 3] = [(0.05, 3.0), (0.2, 2.0), (0.35, 3.0)];
/// B500B: yield strength, and how it hardens, to 1.08 times that at 5 %, Pa.
const YIELD: f64 = 500e6;
const HARDENS: f64 = 0.08 * YIELD / 0.05;
/// MPa.
pub(super) const FCM: f64 = 38.0;

/// Angles about a column begin at +z and go to +x, along which it is pushed.
fn scene(axial: f64) -> String {
    let long = HALF + BEYOND;
    let support = BEYOND / long;
    let [from, to] = [-PLATE, PLATE].map(|by| (BEYOND + ARM + by) / long);
    let fck = FCM - 8.0;
    let bond = if std::env::var_os("EXPERIMENT_BOND").is_some() { "bond: Slip, " } else { "" };
    format!(
        r#"(schema: "intrados.scene/1", title: "N and M",
        concretes: [(name: "tested", fck_mpa: {fck}, fcm_mpa: {FCM})],
        members: [(id: "C", concrete: "tested", at: (0, 0, 0), body: Column(
            section: Rectangle(width_m: {SIDE}, depth_m: {SIDE}), height_m: {long},
            reinforcement: (cover_mm: 32, {bond}bars: [
                Row(side_deg: 270, count: 3, diameter_mm: 20),
                Row(side_deg: 270, count: 2, diameter_mm: 20, inset_mm: 150),
                Row(side_deg: 90, count: 3, diameter_mm: 20),
            ], stirrups: (diameter_mm: 8, spacing_mm: 100))))],
        supports: [
            (member: "C", place: Surface(from: {support}, to: {support}, side_deg: 90), hold: Directions(x: true, y: false, z: true)),
            (member: "C", place: End, hold: Symmetry),
        ],
        loads: [
            (name: "axial", action: Force(place: Start, force_kn: (0, {axial}, 0)), history: [(27.9, 0), (28, 1)]),
            (name: "jack", action: Force(place: Surface(from: {from}, to: {to}, side_deg: 270), force_kn: (20, 0, 0)), history: [(28, 0)]),
        ])"#
    )
}

/// Stress of concrete under a compressive strain, Pa: EN 1992-1-1 (3.14), nothing from .0035 on.
pub(super) fn pressed(strain: f64) -> f64 {
    let first = 0.7e-3 * FCM.powf(0.31);
    let k = 1.05 * 22e3 * (0.1 * FCM).powf(0.3) * first / FCM;
    let eta = strain / first;
    if (0.0..=3.5e-3).contains(&strain) {
        1e6 * FCM * (k * eta - eta * eta) / (1.0 + (k - 2.0) * eta)
    } else {
        0.0
    }
}

/// The largest moment of the section under an axial force, N m; N is compression.
fn by_fibres(axial: f64) -> f64 {
    const STRIPS: u32 = 400;
    let bar = 0.25 * PI * 0.02_f64.powi(2);
    // Force and moment about the middle at a strain of the upper edge and a curvature.
    let of = |top: f64, curvature: f64| {
        let strain = |depth: f64| top - curvature * depth;
        let strips = (0..STRIPS).map(|i| {
            let depth = SIDE * (f64::from(i) + 0.5) / f64::from(STRIPS);
            (depth, pressed(strain(depth)) * SIDE * SIDE / f64::from(STRIPS))
        });
        let bars = ROWS.iter().map(|&(depth, count)| {
            let trial = 200e9 * strain(depth);
            let more = HARDENS * (strain(depth).abs() - YIELD / 200e9);
            let steel = if more > 0.0 { (YIELD + more).copysign(trial) } else { trial };
            (depth, count * bar * (steel - pressed(strain(depth))))
        });
        let add =
            |sum: [f64; 2], (depth, f): (f64, f64)| [sum[0] + f, sum[1] + f * (0.5 * SIDE - depth)];
        strips.chain(bars).fold([0.0; 2], add)
    };
    let moment = |curvature: f64| {
        // The least strain on top that gives the force.
        let tops = (0..=400).map(|k| 3.6e-3 * f64::from(k) / 400.0);
        let [mut low, mut high] = [0.0, tops.clone().find(|&t| of(t, curvature)[0] >= axial)?];
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if of(middle, curvature)[0] < axial { low = middle } else { high = middle }
        }
        Some(of(high, curvature)[1])
    };
    (1..600).filter_map(|k| moment(1e-4 * f64::from(k))).fold(0.0, f64::max)
}

/// How far the middle has gone from the pressed end at the highest load, m: the end lies beyond
/// its support and goes the other way, and the force with it.
#[derive(Default)]
struct Sag {
    factor: f64,
    sag: f64,
}

impl Observer for Sag {
    fn see(
        &mut self,
        structure: &System,
        history: &History,
        step: &Step,
        _: &[[Point; 8]],
    ) -> Result<(), Failure> {
        if step.factor > self.factor {
            let nodes = &structure.model.mesh.nodes;
            // Of the axis, by the mean of a section's nodes.
            let gone = |y: f64| {
                let at = (0..nodes.len()).filter(|&n| (nodes[n].y - y).abs() < 1e-6);
                let [sum, count] = at.fold([0.0; 2], |[s, c], n| [s + history.x[3 * n], c + 1.0]);
                sum / count
            };
            (self.factor, self.sag) = (step.factor, gone(HALF + BEYOND) - gone(0.0));
        }
        Ok(())
    }
}

#[test]
#[ignore = "minutes"]
fn bending_with_axial_force() {
    let only: Option<f64> = std::env::var("EXPERIMENT_ONLY").ok().map(|n| n.parse().unwrap());
    let mut check = FigureCheck::default();
    for axial in [0.0, 1000.0, 2000.0, 3500.0] {
        if only.is_some_and(|n| n != axial) {
            continue;
        }
        let specimen = format!("N {axial:.0}");
        let element = recorded_meshes(&specimen)[0];
        let mut sag = Sag::default();
        let life = jacked(&scene(axial), (element > 0.0).then_some(element), &mut sag);
        let found = life.strength.unwrap();
        let moment = found.peak.load_n * ARM + 1e3 * axial * sag.sag;
        let section = by_fibres(1e3 * axial);
        println!(
            "  N {axial:.0} kN: {:.1} kNm, {:.1} mm, by fibres {:.1}: {:.3}; {} ({}); {}",
            1e-3 * moment,
            1e3 * sag.sag,
            1e-3 * section,
            moment / section,
            found.mode.words(),
            found.because,
            found.ended
        );
        check.compare(&specimen, MOMENT, element, 1e-3 * moment);
    }
    check.finish();
}
