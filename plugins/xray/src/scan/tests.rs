use std::f64::consts::TAU;

use glam::DVec3;
use intrados_scene::Scene;
use intrados_stage::Job;

use super::*;
use crate::{
    physics::{Matter, Model},
    primary::primary_at,
    recon::{Window, nrmse_in},
    scanner::Response,
    specimen::{
        Specimen, Substance,
        concrete::{Air, Bar, FULL, Label, Outline},
    },
    volume::{Beam, Orbit},
};

/// A bench-top scanner: 225 kV behind 1 mm of copper, 0.3 + 0.2 m, a panel of 0.16 m.
fn protocol(views: usize, [rows, bins]: [usize; 2], mas: f64) -> Protocol {
    let tube = Tube { kv: 225.0, filters: vec![("copper".to_owned(), 1e-3)], scintillator: 2e-3 };
    let beam = Beam::Cone { source_axis: 0.3, axis_detector: 0.2 };
    Protocol {
        spectrum: tube.radiation().unwrap().0,
        tube,
        // Photons per m² and mAs at 1 m, roughly what is left of the table.
        fluence: 4e12 * mas,
        focus: 2e-4,
        orbit: Orbit::circle(beam, views, TAU, [rows, bins], [0.16 / bins as f64; 2]),
        detector: Detector::default(),
        response: Response::Energy,
    }
}

/// A core of 80 mm with pores, and three bars if there is `steel`.
fn recipe(protocol: &Protocol, seed: u64, steel: bool) -> Recipe {
    let mut recipe =
        Recipe::sound(Outline::Round(0.04), protocol.height(0.08), protocol.voxel(), seed);
    recipe.air.push(Air {
        from: -1.0,
        to: 1.0,
        porosity: 0.05,
        median: 4.0 * protocol.voxel(),
        spread: 0.3,
        entrapped: 0.2,
    });
    if steel {
        recipe.bars = [[0.02, 0.0], [-0.012, 0.018], [-0.01, -0.02]]
            .map(|[x, y]| Bar {
                line: vec![DVec3::new(x, y, -0.2), DVec3::new(x, y, 0.2)],
                radius: 5e-3,
                ribbed: true,
                loss: 0.0,
            })
            .to_vec();
    }
    recipe
}

fn target(protocol: &Protocol, recipe: &Recipe, slices: usize) -> Target {
    Target::grown(recipe, None, protocol, slices, &Job::default()).unwrap()
}

fn energies(protocol: &Protocol, target: &Target) -> Energies {
    Energies::new(protocol, substances(&target.concrete, &Library::builtin().unwrap()).unwrap())
}

/// Ways and spectrum against the exact primary of the same voxels, traced one by one with all bins
/// of energy: single voxels are all mortar, rock or steel.
#[test]
fn rays_are_what_the_tracer_finds() {
    let protocol = protocol(8, [6, 40], 1.0);
    let mut target = target(&protocol, &recipe(&protocol, 1, true), 1);
    let mu = substances(&target.concrete, &Library::builtin().unwrap()).unwrap();
    // One substance a voxel.
    for s in &mut target.painted.shares {
        let largest = (0..3).max_by_key(|k| s[*k]).unwrap();
        *s = std::array::from_fn(|k| if k == largest && s[k] > FULL / 4 { FULL } else { 0 });
    }
    let library = Library::builtin().unwrap();
    let names = ["mortar", "quartz", "steel"];
    let materials: Vec<Matter> =
        names.iter().map(|n| Matter::new(&library, n, Model::Bound).unwrap()).collect();
    let density =
        |k: usize| mu(150.0)[k] / library.material(names[k]).unwrap().attenuation(150.0).total();
    let mut palette: Vec<Substance> =
        (0..3).map(|k| Substance { material: k, density: density(k) }).collect();
    palette.insert(0, Substance { material: 0, density: 0.0 });
    let grid = target.painted.grid;
    let lattice = crate::march::Lattice {
        origin: DVec3::from_array(std::array::from_fn(|k| grid.origin[k] - 0.5 * grid.voxel[k])),
        spacing: DVec3::from_array(grid.voxel),
        cells: glam::UVec3::from_array(grid.size.map(|n| n as u32)),
    };
    let label = |s: &[u8; 4]| (0..3).find(|k| s[*k] == FULL).map_or(0, |k| k as u8 + 1);
    let labels = target.painted.shares.iter().map(label).collect();
    let specimen = Specimen::voxels(materials, palette, lattice, labels).unwrap();
    let (rays, energies) = (Rays::new(&target.painted), energies(&protocol, &target));
    let angle = 0.6;
    let scanner = protocol.scanner([40, 6], angle);
    let lengths = rays.view(&protocol.orbit, angle, protocol.distances());
    let (mut worst, mut sum, mut n): (f64, f64, f64) = (0.0, 0.0, 0.0);
    for row in 0..6 {
        for bin in 0..40 {
            let p = scanner.panel.place(row * 40 + (39 - bin), [0.5; 2]);
            let [primary, open] = primary_at(&specimen, &scanner, p);
            let ours = f64::from(energies.behind(lengths[(row * 40 + bin) as usize])[0])
                / energies.open[0];
            let off = (ours / (primary / open)).ln();
            worst = worst.max(off.abs());
            (sum, n) = (sum + off * off, n + 1.0);
        }
    }
    let rms = (sum / n).sqrt();
    println!("line integrals: rms difference {rms:.1e}, worst {worst:.1e}");
    // Groups of energy cost 1e-3; rays that pass a voxel's edge in a cell take one of its
    // neighbours.
    assert!(rms < 0.01 && worst < 0.08, "{rms} {worst}");
}

/// One number for how well concrete is seen: nRMSE within 0.95 of the radius, bars and their rims
/// left out, against the attenuation of the slices' own energy.
fn error(protocol: &Protocol, target: &Target, restored: &Restored) -> f64 {
    let truth = target.attenuation(restored.kev).unwrap();
    let grid = &target.slices;
    let [nx, ny, _] = grid.size;
    let reach = 0.95 * target.concrete.recipe.outline.reach();
    let bars = &target.concrete.recipe.bars;
    let counts = |i: usize| {
        let (x, y) = (grid.at(0, i % nx), grid.at(1, i / nx % ny));
        x.hypot(y) < reach
            && bars.iter().all(|b| {
                (x - b.line[0].x).hypot(y - b.line[0].y) > b.radius + 2.0 * protocol.voxel()
            })
    };
    let peak = truth
        .iter()
        .enumerate()
        .filter(|(i, _)| counts(*i))
        .map(|(_, v)| f64::from(*v))
        .fold(0.0, f64::max);
    let all = truth.iter().map(|v| f64::from(*v)).fold(0.0, f64::max);
    nrmse_in(&restored.volume.data, &truth, counts) * all / peak
}

struct Scan {
    target: Target,
    known: Known,
    energies: Energies,
    exposure: Exposure,
    guess: ScatterMap,
}

fn scan(protocol: &Protocol, recipe: &Recipe, slices: usize, walks: u64) -> Scan {
    let job = Job::default();
    let target = target(protocol, recipe, slices);
    let energies = energies(protocol, &target);
    let settings = ScatterSettings { views: 4, columns: 12, walks, links: 4 };
    let known = Known {
        protocol: protocol.clone(),
        drawing: Drawing::of_recipe(recipe),
        slices: target.slices,
    };
    let (drawn, made) = (known.drawing.solids(protocol).unwrap(), target.solids(protocol).unwrap());
    let bodies = [
        Behind { specimen: &drawn, protocol, seed: 2 },
        Behind { specimen: &made, protocol, seed: 1 },
    ];
    let [guess, truth] = ScatterMap::cast(bodies, &settings, &job).unwrap();
    let exposure =
        expose(&Rays::new(&target.painted), &energies, Some(&truth), protocol, 3, &job).unwrap();
    Scan { target, known, energies, exposure, guess }
}

fn restored(scan: &Scan, corrections: Corrections) -> Restored {
    restore(
        &scan.exposure,
        &scan.known,
        Some(&scan.guess),
        corrections,
        Window::Hann,
        &Job::default(),
    )
    .unwrap()
}

/// A small scan with everything wrong and everything corrected: pores are darker than the matrix by
/// more than four standard deviations of the matrix, the matrix has its attenuation, and the
/// pictures of one thread and of many are the same.
#[test]
fn pores_are_seen() {
    let protocol = protocol(180, [12, 128], 20.0);
    let scan = scan(&protocol, &recipe(&protocol, 2, false), 2, 1 << 14);
    let restored = restored(&scan, Corrections::ALL);
    let labels = &scan.target.truth.labels;
    let [nx, ny, _] = scan.target.slices.size;
    let of = |label: Label| -> Vec<f64> {
        let inner = |i: &usize| {
            // Not at a border: all four neighbours are the same.
            let (x, y) = (i % nx, i / nx % ny);
            let same = |j: usize| labels[j] == label as u8;
            x > 0
                && y > 0
                && x + 1 < nx
                && y + 1 < ny
                && [*i, i - 1, i + 1, i - nx, i + nx].into_iter().all(same)
        };
        (0..labels.len()).filter(inner).map(|i| f64::from(restored.volume.data[i])).collect()
    };
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (pores, matrix) = (of(Label::Pore), of(Label::Matrix));
    let spread = (matrix.iter().map(|v| (v - mean(&matrix)).powi(2)).sum::<f64>()
        / matrix.len() as f64)
        .sqrt();
    let contrast = (mean(&matrix) - mean(&pores)) / spread;
    let truth = scan.target.attenuation(restored.kev).unwrap();
    let expected: Vec<f64> = (0..labels.len())
        .filter(|i| labels[*i] == Label::Matrix as u8)
        .map(|i| f64::from(truth[i]))
        .collect();
    println!(
        "{} pore voxels; matrix {:.2} (true {:.2}) ± {spread:.2}, pores {:.2}, contrast {contrast:.1}; nRMSE {:.4}; scatter/primary {:.3} ± {:.1} %; {:.0} keV",
        pores.len(),
        mean(&matrix),
        mean(&expected),
        mean(&pores),
        error(&protocol, &scan.target, &restored),
        scan.guess.to_primary,
        100.0 * scan.guess.rel_error,
        restored.kev
    );
    assert!(pores.len() > 50 && contrast > 4.0, "{} {contrast}", pores.len());
    assert!((mean(&matrix) / mean(&expected) - 1.0).abs() < 0.03);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let alone = one.install(|| {
        let again = expose(
            &Rays::new(&scan.target.painted),
            &scan.energies,
            None,
            &protocol,
            3,
            &Job::default(),
        )
        .unwrap();
        again.frames
    });
    let together = expose(
        &Rays::new(&scan.target.painted),
        &scan.energies,
        None,
        &protocol,
        3,
        &Job::default(),
    )
    .unwrap();
    assert!(alone == together.frames);
}

/// Rust, air, honeycomb and a spall make other readings; what corrects them is the same to the bit:
/// data sheet, drawing, and walks through what the drawing shows. Only the readings and the
/// specimen know what was cast, and the tube that lit it is not quite that of its data sheet.
#[test]
fn corrections_do_not_know_what_made_the_readings() {
    let scene = Scene::load_bundled("specimens", &Job::default()).unwrap();
    let protocol =
        Protocol::of_scene(&scene.structure.scanners[0], Some(24), Some(40), Detector::default())
            .unwrap();
    let protocol = protocol.clone().slit(1, protocol.field());
    let worn = Subject::of(&scene, "P3").unwrap();
    let [a, b] = [worn, worn.as_built()].map(|m| {
        Acquisition::take(m, 0.75, &protocol, 1, 5, &Forming::default(), &Job::default()).unwrap()
    });
    assert!(
        a.target.concrete.recipe.bars.iter().any(|bar| bar.loss > 0.0)
            && a.exposure.frames != b.exposure.frames
    );
    assert!(
        a.known.drawing == b.known.drawing
            && a.known.drawing.bars.iter().all(|bar| bar.loss == 0.0)
    );
    assert!(a.scatter_map.estimate == b.scatter_map.estimate);
    let [lines, same] = [&a, &b].map(|of| {
        let alike = Exposure { frames: b.exposure.frames.clone(), ..of.exposure.clone() };
        restore(
            &alike,
            &of.known,
            Some(&of.scatter_map),
            Corrections::ALL,
            Window::Hann,
            &Job::default(),
        )
        .unwrap()
    });
    assert!(lines.volume.data == same.volume.data && lines.kev == same.kev);
    let real = protocol.as_it_is(intrados_stage::random::Key::new(5, 7)).unwrap();
    assert!(real.tube != protocol.tube && (real.tube.kv / protocol.tube.kv - 0.99).abs() <= 0.01);
    // A drawing alone gives the same as the drawing of what was grown.
    assert_eq!(Drawing::of_member(worn, 0.75, &protocol).unwrap(), a.known.drawing);
}

/// `cargo test --release -p intrados-xray --lib scan::tests::corrections -- --ignored --nocapture`:
/// what every correction earns, on ten specimens.
#[test]
#[ignore = "prints a table; two minutes"]
fn corrections_earn_their_keep() {
    let cases = [
        ("all", Corrections::ALL),
        ("without scatter", Corrections { scatter: false, ..Corrections::ALL }),
        ("without hardening", Corrections { hardening: false, ..Corrections::ALL }),
        ("without rings", Corrections { rings: false, ..Corrections::ALL }),
        ("without metal", Corrections { metal: false, ..Corrections::ALL }),
        ("none", Corrections::NONE),
    ];
    let protocol = protocol(360, [24, 256], 40.0);
    let mut sums = [[0.0; 2]; 6];
    for seed in 0..10 {
        let steel = seed % 2 == 0;
        let scan = scan(&protocol, &recipe(&protocol, 100 + seed, steel), 2, 1 << 15);
        for (sum, (_, corrections)) in sums.iter_mut().zip(cases) {
            sum[usize::from(steel)] +=
                error(&protocol, &scan.target, &restored(&scan, corrections)) / 5.0;
        }
    }
    println!("| corrections | nRMSE, plain | with bars |\n|---|---|---|");
    for ((name, _), [plain, steel]) in cases.iter().zip(sums) {
        println!("| {name} | {plain:.4} | {steel:.4} |");
    }
    // Every correction that has something to correct lowers the error.
    let worse = |case: usize, steel: usize| sums[case][steel] > sums[0][steel];
    assert!(
        (1..6).all(|case| worse(case, 1)) && [1, 2, 3, 5].into_iter().all(|case| worse(case, 0)),
        "{sums:?}"
    );
}

#[test]
fn what_cannot_be_scanned_is_refused() {
    let scene = Scene::load_bundled("column", &Job::default()).unwrap();
    let scanner = &scene.structure.scanners[0];
    let ok = Protocol::of_scene(scanner, None, None, Detector::default()).unwrap();
    // 512 pixels of 1.6 mm, magnified 1.42 times.
    assert!(
        (ok.voxel() - 1.6e-3 * 1.2 / 1.7).abs() < 1e-9 && (ok.field() - 0.56).abs() < 0.02,
        "{} {}",
        ok.voxel(),
        ok.field()
    );
    let small = Protocol::of_scene(scanner, Some(90), Some(64), Detector::default()).unwrap();
    assert!(small.orbit.detector == [8, 64] && (small.field() / ok.field() - 1.0).abs() < 0.02);
    assert!(Protocol::of_scene(scanner, Some(1 << 20), None, Detector::default()).is_err());
    let mut wrong = scanner.clone();
    wrong.tube.filters.push(("kryptonite".to_owned(), 1.0));
    assert!(
        matches!(Protocol::of_scene(&wrong, None, None, Detector::default()), Err(ScanError::Bad(text)) if text.contains("kryptonite"))
    );
    wrong = scanner.clone();
    wrong.tube.voltage_kv = 9000.0;
    assert!(Protocol::of_scene(&wrong, None, None, Detector::default()).is_err());
    let wide = Recipe::sound(Outline::Round(1.0), 0.05, 4e-3, 1);
    assert!(Target::grown(&wide, None, &small, 1, &Job::default()).is_err());
}
