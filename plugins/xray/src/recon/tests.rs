use std::f64::consts::{PI, TAU};

use intrados_stage::random::Key;

use super::{
    phantom::{core, scan, truth},
    *,
};
use crate::volume::Orbit;

const FLAT: Beam = Beam::Fan { source_axis: 0.2, axis_detector: 0.1, curved: false };
const CURVED: Beam = Beam::Fan { source_axis: 0.2, axis_detector: 0.1, curved: true };
const CONE: Beam = Beam::Cone { source_axis: 0.4, axis_detector: 0.2 };

fn job() -> Job {
    Job::default()
}

/// An asymmetric core, so that a mirrored or turned picture could not pass, by each geometry. What
/// is left is edges: the same for all of them.
#[test]
fn every_beam_finds_the_core() {
    let grid = Grid::centred([128, 120, 1], [7e-4, 7.5e-4, 1e-3]);
    let flat = truth(&grid, &core(), true);
    let cases = [
        ("parallel, half turn", Beam::Parallel, PI, 192, 5e-4),
        ("parallel, full turn", Beam::Parallel, TAU, 192, 5e-4),
        ("parallel, fine bins", Beam::Parallel, PI, 384, 2.5e-4),
        ("flat fan", FLAT, TAU, 200, 7.5e-4),
        ("curved fan", CURVED, TAU, 200, 7.5e-4),
        ("flat fan, short", FLAT, PI + 0.6, 200, 7.5e-4),
        ("curved fan, short", CURVED, PI + 0.6, 200, 7.5e-4),
    ];
    for (name, beam, arc, bins, pitch) in cases {
        let orbit = Orbit::circle(beam, 360, arc, [1, bins], [pitch, 1e-3]);
        let image = fbp(&scan(&orbit, &core(), true), &grid, Window::Ramp, &job()).unwrap();
        let error = nrmse(&image.data, &flat.data, &grid, 0.98);
        // Beyond the disc that all views see, nothing is known.
        let seen = |i: usize| ((i % 128) as f64 - 63.5).hypot((i / 128) as f64 - 59.5) < 62.0;
        let mean = |v: &Volume| {
            v.data
                .iter()
                .enumerate()
                .filter(|(i, _)| seen(*i))
                .map(|(_, v)| f64::from(*v))
                .sum::<f64>()
        };
        assert!(error < 0.025, "{name}: {error}");
        assert!(
            (mean(&image) / mean(&flat) - 1.0).abs() < 2e-3,
            "{name}: mean {}",
            mean(&image) / mean(&flat)
        );
    }
}

#[test]
fn a_cone_finds_the_core_and_slabs_agree() {
    let grid = Grid::centred([64, 64, 48], [1.4e-3; 3]);
    let solid = truth(&grid, &core(), false);
    let orbit = Orbit::circle(CONE, 180, TAU, [80, 100], [1.5e-3, 1.5e-3]);
    let sinogram = scan(&orbit, &core(), false);
    let image = fbp(&sinogram, &grid, Window::Ramp, &job()).unwrap();
    let error = nrmse(&image.data, &solid.data, &grid, 0.98);
    assert!(error < 0.02, "{error}");
    let slab = fbp(&sinogram, &grid.slab(10..13), Window::Ramp, &job()).unwrap();
    let part = &image.data[10 * 64 * 64..13 * 64 * 64];
    assert!(
        slab.data.iter().zip(part).all(|(a, b)| (a - b).abs() < 1e-2),
        "a slab is a part of the whole (μ = 30 per metre)"
    );
}

/// Slab by slab from the rows that each slab needs: the whole, but for rounding. Slices beyond the
/// panel's rows are among them.
#[test]
fn slabs_of_few_rows_make_the_whole() {
    for (beam, arc, rows) in
        [(CONE, TAU, 24), (CONE, TAU, 60), (Beam::Parallel, PI, 40), (FLAT, TAU, 40)]
    {
        let orbit = Orbit::circle(beam, 90, arc, [rows, 80], [1.5e-3, 1.5e-3]);
        let grid = Grid::centred([48, 48, 40], [1.4e-3; 3]);
        let sinogram = scan(&orbit, &core(), false);
        let whole = fbp(&sinogram, &grid, Window::Ramp, &job()).unwrap();
        let most = bytes(&orbit, &grid.slab(17..22));
        let (mut data, mut first, mut slabs) = (Vec::new(), 0, 0);
        while first < grid.size[2] {
            let z = slab(&orbit, &grid, first, most);
            let part = grid.slab(z.clone());
            assert!(z.len() == 1 || bytes(&orbit, &part) <= most);
            let seen = rows_of(&sinogram, super::rows(&orbit, &part));
            data.extend(fbp(&seen, &part, Window::Ramp, &job()).unwrap().data);
            (first, slabs) = (z.end, slabs + 1);
        }
        let largest = whole.data.iter().zip(&data).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(
            slabs > 4 && data.len() == whole.data.len() && largest < 2e-3,
            "{beam:?}, {rows} rows: {slabs} slabs, {largest} (μ = 30 per metre)"
        );
    }
}

/// Some rows of a sinogram.
fn rows_of(all: &Sinogram, rows: std::ops::Range<usize>) -> Sinogram {
    let bins = all.orbit.bins();
    let data = (0..all.orbit.views())
        .flat_map(|view| &all.view(view)[rows.start * bins..rows.end * bins])
        .copied()
        .collect();
    Sinogram { orbit: all.orbit.rows_only(rows), data }
}

#[test]
fn windows_trade_noise_for_sharpness() {
    let grid = Grid::centred([96, 96, 1], [1e-3; 3]);
    let orbit = Orbit::circle(Beam::Parallel, 120, PI, [1, 110], [1e-3; 2]);
    let mut noise = Sinogram::zeros(orbit);
    noise.data.iter_mut().enumerate().for_each(|(i, v)| *v = Key::new(4, i as u64).unit(0) - 0.5);
    let power = |window| {
        fbp(&noise, &grid, window, &job())
            .unwrap()
            .data
            .iter()
            .map(|v| f64::from(v * v))
            .sum::<f64>()
    };
    let all = [Window::Ramp, Window::SheppLogan, Window::Cosine, Window::Hann].map(power);
    assert!(all.is_sorted_by(|a, b| *a > 1.15 * b), "{all:?}");
}

fn uniform(n: usize, seed: u64) -> Vec<f32> {
    (0..n).map(|i| Key::new(seed, i as u64).unit(0)).collect()
}

/// All geometries, grids off the axis and of unequal voxels.
fn projectors() -> Vec<Projector> {
    let grid =
        Grid { size: [33, 27, 5], voxel: [1e-3, 1.3e-3, 1.1e-3], origin: [-0.02, -0.014, -0.003] };
    [(Beam::Parallel, [7, 40]), (FLAT, [5, 60]), (CURVED, [5, 60]), (CONE, [9, 60])]
        .map(|(beam, detector)| {
            let mut orbit = Orbit::circle(beam, 31, TAU, detector, [1.2e-3, 1e-3]);
            orbit.centre[0] += 1.7;
            Projector::new(&orbit, &grid).unwrap()
        })
        .into()
}

#[test]
fn backward_is_the_adjoint_of_forward() {
    for projector in projectors() {
        let (x, y) = (uniform(projector.grid().len(), 1), uniform(projector.orbit().len(), 2));
        let ax = projector.forward(&x, &job()).unwrap();
        let aty = projector.backward(&y, &job()).unwrap();
        let (a, b) = (iterate::dot(&ax, &y), iterate::dot(&x, &aty));
        assert!(a > 0.0 && ((a - b) / a).abs() < 1e-6, "{:?}: {a} {b}", projector.orbit().beam);
    }
}

#[test]
fn forward_finds_the_line_integrals() {
    let grid = Grid::centred([160, 150, 1], [6e-4, 6.4e-4, 1e-3]);
    let flat = truth(&grid, &core(), true);
    for (beam, pitch) in [(Beam::Parallel, 7e-4), (FLAT, 1e-3), (CURVED, 1e-3)] {
        let orbit = Orbit::circle(beam, 45, PI, [1, 150], [pitch, 1e-3]);
        let ours = Projector::new(&orbit, &grid).unwrap().forward(&flat.data, &job()).unwrap();
        let error = nrmse_in(&ours, &scan(&orbit, &core(), true).data, |_| true);
        assert!(error < 0.0025, "{beam:?} {error}");
    }
    let grid = Grid::centred([80, 80, 60], [1.1e-3; 3]);
    let orbit = Orbit::circle(CONE, 12, PI, [60, 80], [1.8e-3; 2]);
    let ours = Projector::new(&orbit, &grid)
        .unwrap()
        .forward(&truth(&grid, &core(), false).data, &job())
        .unwrap();
    let error = nrmse_in(&ours, &scan(&orbit, &core(), false).data, |_| true);
    assert!(error < 0.005, "{error}");
}

#[test]
fn iterations_converge() {
    let grid = Grid::centred([64, 60, 1], [1.4e-3; 3]);
    let flat = truth(&grid, &core(), true);
    for beam in [Beam::Parallel, FLAT] {
        let orbit = Orbit::circle(beam, 60, TAU, [1, 100], [1.4e-3; 2]);
        let projector = Projector::new(&orbit, &grid).unwrap();
        let sinogram =
            Sinogram { orbit: orbit.clone(), data: projector.forward(&flat.data, &job()).unwrap() };
        let mut errors = Vec::new();
        cgls(&sinogram, &projector, 40, &job(), |i, x| {
            errors.push((i.residual, nrmse(x, &flat.data, &grid, 1.0)));
            true
        })
        .unwrap();
        // CGLS minimises both, so neither grows; data of the projector's own are met.
        assert!(
            errors.windows(2).all(|w| w[1].0 <= w[0].0 * 1.0001 && w[1].1 <= w[0].1 * 1.01),
            "{errors:?}"
        );
        assert!(errors[39].0 < 0.003 && errors[39].1 < 0.03, "{:?}", errors[39]);
        let mut residuals = Vec::new();
        let image = sirt(&sinogram, &projector, 60, true, &job(), |i, _| {
            residuals.push(i.residual);
            true
        })
        .unwrap();
        assert!(residuals.is_sorted_by(|a, b| a > b) && residuals[59] < 0.02, "{residuals:?}");
        assert!(image.data.iter().all(|v| *v >= 0.0));
        assert!(nrmse(&image.data, &flat.data, &grid, 1.0) < 0.1);
    }
}

#[test]
fn bits_do_not_depend_on_threads() {
    let grid = Grid::centred([70, 50, 3], [1e-3; 3]);
    for beam in [Beam::Parallel, FLAT, CURVED, CONE] {
        let orbit = Orbit::circle(beam, 37, TAU, [5, 90], [1.2e-3; 2]);
        let sinogram = Sinogram { data: uniform(orbit.len(), 5), orbit };
        let projector = Projector::new(&sinogram.orbit, &grid).unwrap();
        let work = || {
            let a = fbp(&sinogram, &grid, Window::Ramp, &job()).unwrap().data;
            let b = cgls(&sinogram, &projector, 3, &job(), |_, _| true).unwrap().data;
            (a, b)
        };
        let with = |threads| {
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work)
        };
        assert_eq!(with(1), with(3), "{beam:?}");
    }
}

#[test]
fn what_cannot_be_reconstructed_is_refused() {
    let grid = Grid::centred([16, 16, 1], [1e-3; 3]);
    let refuse = |orbit: Orbit, grid: Grid, what: &str| {
        let error =
            fbp(&Sinogram::zeros(orbit), &grid, Window::Ramp, &job()).unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    };
    refuse(Orbit::circle(FLAT, 100, PI, [1, 50], [1e-3; 2]), grid, "degrees");
    refuse(Orbit::circle(Beam::Parallel, 0, PI, [1, 50], [1e-3; 2]), grid, "empty");
    refuse(Orbit::circle(Beam::Parallel, 10, PI, [1, 50], [0.0, 1e-3]), grid, "above zero");
    refuse(
        Orbit::circle(CONE, 10, TAU, [1, 50], [1e-3; 2]),
        Grid::centred([900, 900, 1], [1e-3; 3]),
        "source",
    );
    let mut orbit = Orbit::circle(Beam::Parallel, 10, PI, [1, 50], [1e-3; 2]);
    orbit.angles[3] = f64::NAN;
    refuse(orbit, grid, "finite");
    let cancelled = job();
    cancelled.cancel();
    for beam in [Beam::Parallel, FLAT, CONE] {
        let orbit = Orbit::circle(beam, 40, TAU, [2, 50], [1e-3; 2]);
        let projector = Projector::new(&orbit, &grid).unwrap();
        let sinogram = Sinogram::zeros(orbit);
        assert!(matches!(
            fbp(&sinogram, &grid, Window::Ramp, &cancelled),
            Err(ReconError::Cancelled(_))
        ));
        assert!(matches!(
            cgls(&sinogram, &projector, 2, &cancelled, |_, _| true),
            Err(ReconError::Cancelled(_))
        ));
        assert!(matches!(
            sirt(&sinogram, &projector, 2, false, &cancelled, |_, _| true),
            Err(ReconError::Cancelled(_))
        ));
    }
}

/// Views need not come in order or evenly; a gap is left out, not filled.
#[test]
fn shares_of_a_turn_add_up() {
    let even: Vec<f64> = (0..90).map(|i| PI * i as f64 / 90.0).collect();
    assert!(shares(&even, PI).iter().all(|s| (s - PI / 90.0).abs() < 1e-12));
    let random: Vec<f64> = uniform(400, 6).iter().map(|u| f64::from(*u) * 3.0 * TAU).collect();
    let dense: f64 = shares(&random, PI).iter().sum();
    assert!(dense > 0.5 * PI && dense <= PI + 1e-9, "{dense}");
    let twice: Vec<f64> = (0..180).map(|i| TAU * i as f64 / 180.0).collect();
    assert!((shares(&twice, PI).iter().sum::<f64>() - PI).abs() < 1e-9);
    let third: Vec<f64> = (0..61).map(|i| PI * i as f64 / 180.0).collect();
    assert!((shares(&third, PI).iter().sum::<f64>() - PI * 61.0 / 180.0).abs() < 1e-9);
}
