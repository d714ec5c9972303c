//! Each correction on a scan whose truth is known: what its error was before and is after.

use std::f64::consts::{PI, TAU};

use intrados_stage::{Job, random::Key};

use super::*;
use crate::{
    recon::{
        Window, fbp, nrmse,
        phantom::{Body, core, scan, truth},
    },
    volume::{Beam, Grid, Orbit, Sinogram, Volume},
};

const BINS: usize = 192;

fn orbit() -> Orbit {
    Orbit::circle(Beam::Parallel, 360, PI, [1, BINS], [5e-4, 1e-3])
}

fn grid() -> Grid {
    Grid::centred([128, 128, 1], [7e-4, 7e-4, 1e-3])
}

fn image(sinogram: &Sinogram) -> Volume {
    fbp(sinogram, &grid(), Window::SheppLogan, &Job::default()).unwrap()
}

/// nRMSE of a sinogram's slice.
fn error(sinogram: &Sinogram, truth: &Volume) -> f64 {
    nrmse(&image(sinogram).data, &truth.data, &grid(), 0.98)
}

/// A sinogram with other values.
fn with(sinogram: &Sinogram, data: Vec<f32>) -> Sinogram {
    Sinogram { orbit: sinogram.orbit.clone(), data }
}

/// Mean and variance to 4.5 standard errors (false alarm below 1e-5 for each of the 6; the keys are
/// fixed).
#[test]
fn noise_has_its_mean_and_variance() {
    for (k, mean) in [0.3, 9.0, 400.0].into_iter().enumerate() {
        let n = 40_000_u64;
        let values: Vec<f64> = (0..n).map(|i| counts(mean, 2.0, Key::new(k as u64, i))).collect();
        let m = values.iter().sum::<f64>() / n as f64;
        let v = values.iter().map(|x| (x - m).powi(2)).sum::<f64>() / n as f64;
        let variance = mean + 4.0;
        assert!((m - mean).abs() < 4.5 * (variance / n as f64).sqrt(), "{mean}: {m}");
        // Fourth cumulant of Poisson plus Gauss: λ.
        assert!(
            (v - variance).abs() < 4.5 * ((2.0 * variance * variance + mean) / n as f64).sqrt(),
            "{mean}: {v}"
        );
    }
}

/// Counts of a scan with uneven gain and a dark current, dead and hot pixels: raw to line
/// integrals.
#[test]
fn panel_faults_are_found_and_mended() {
    let clean = scan(&orbit(), &core(), true);
    let solid = truth(&grid(), &core(), true);
    let gain: Vec<f64> = (0..BINS).map(|i| 1.0 + 0.1 * Key::new(11, i as u64).normal(0)).collect();
    let faults = [(40, 0.0), (41, 0.0), (90, 3.0), (150, 0.02)];
    let panel = Panel {
        size: [1, BINS],
        dark: (0..BINS)
            .map(|i| 100.0 + if i == 120 { 900.0 } else { Key::new(12, i as u64).normal(0) } as f32)
            .collect(),
        flat: (0..BINS)
            .map(|i| {
                100.0 + (2e4 * faults.iter().find(|f| f.0 == i).map_or(gain[i], |f| f.1)) as f32
            })
            .collect(),
    };
    let frames: Vec<f32> = clean
        .data
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let pixel = i % BINS;
            // A faulty pixel does not know of the specimen.
            let open = f64::from(panel.flat[pixel] - 100.0);
            let mean =
                if faults.iter().any(|f| f.0 == pixel) { open } else { open * f64::from(-p).exp() };
            counts(mean, 5.0, Key::new(13, i as u64)) as f32 + panel.dark[pixel]
        })
        .collect();
    let bad = bad_pixels(&panel, 8.0);
    let found: Vec<usize> = (0..BINS).filter(|i| bad[*i]).collect();
    assert_eq!(found, [40, 41, 90, 120, 150]);
    let ideal = Panel { flat: vec![2e4; BINS], dark: vec![100.0; BINS], ..panel.clone() };
    let raw = error(&with(&clean, detector::line_integrals(&frames, &ideal, 2.5e-5)), &solid);
    let levelled = with(&clean, detector::line_integrals(&frames, &panel, 2.5e-5));
    let mut mended = levelled.clone();
    mend(&mut mended.data, &panel, &bad);
    let [levelled, mended] = [levelled, mended].map(|s| error(&s, &solid));
    println!("panel: raw {raw:.4} levelled {levelled:.4} mended {mended:.4}");
    assert!(
        raw > 10.0 * mended && levelled > 10.0 * mended && mended < 0.04,
        "{raw} {levelled} {mended}"
    );
}

/// What makes a stripe.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    /// Gain errors of 2 % everywhere.
    Gain,
    /// A stripe of 5 bins.
    Wide,
    /// In less than half of the views.
    Partial,
    /// A pixel that reads always the same.
    Dead,
}

fn striped(clean: &Sinogram, faults: &[Fault]) -> Sinogram {
    let mut data = clean.data.clone();
    for (i, p) in data.iter_mut().enumerate() {
        let (view, bin) = (i / BINS, i % BINS);
        *p += 0.004 * Key::new(22, i as u64).normal(0) as f32;
        for fault in faults {
            match fault {
                Fault::Gain => *p += 0.02 * Key::new(21, bin as u64).normal(0) as f32,
                Fault::Wide if (70..75).contains(&bin) => *p *= 1.06,
                Fault::Partial if bin == 110 && view < 150 => *p += 0.15,
                Fault::Dead if bin == 130 => *p = 1.0,
                _ => {}
            }
        }
    }
    with(clean, data)
}

#[test]
fn stripes_and_rings_go() {
    let clean = scan(&orbit(), &core(), true);
    let solid = truth(&grid(), &core(), true);
    let stripes = Stripes { large: 31, small: 9, ..Stripes::default() };
    let methods: [&dyn Fn(&mut [f32]); 4] = [
        &|s| remove_stripes(s, BINS, stripes),
        &|s| rings::remove_stripes_by_sorting(s, BINS, stripes.small),
        &|s| remove_stripes_by_fit(s, BINS, 4, stripes.small),
        &|_| (),
    ];
    let all = [Fault::Gain, Fault::Wide, Fault::Partial, Fault::Dead];
    for (faults, gain) in [
        (&all[..0], 1.6),
        (&all[..1], 0.75),
        (&all[1..2], 0.5),
        (&all[2..3], 1.0),
        (&all[3..], 0.15),
        (&all[..], 0.3),
    ] {
        let bad = striped(&clean, faults);
        let [all, sorted, fitted, before] = methods.map(|act| {
            let mut fixed = bad.clone();
            act(&mut fixed.data);
            error(&fixed, &solid)
        });
        println!(
            "rings {faults:?}: before {before:.4} all {all:.4} sorting {sorted:.4} fit {fitted:.4}"
        );
        // Together they never do worse than sorting alone; a scan without any stripes loses a
        // little to it.
        assert!(
            all < gain * before && all < 1.001 * sorted,
            "{faults:?}: {all} of {before}, sorting {sorted}"
        );
        assert!(
            faults.is_empty() || fitted < before && sorted < before,
            "{faults:?}: {fitted} {sorted} of {before}"
        );
    }
}

/// A spectrum of 40 to 200 keV and attenuation that falls as concrete's does, 1/m.
fn spectrum() -> (Vec<f64>, Vec<f64>) {
    (0..33)
        .map(|i| 40.0 + 5.0 * f64::from(i))
        .map(|e| ((e / 60.0) * (-e / 60.0_f64).exp(), 25.0 + 90.0 * (40.0 / e).powi(3)))
        .unzip()
}

fn hardened(way: f64) -> f64 {
    let (s, mu) = spectrum();
    -(s.iter().zip(&mu).map(|(s, m)| s * (-m * way).exp()).sum::<f64>() / s.iter().sum::<f64>())
        .ln()
}

#[test]
fn hardening_is_undone() {
    // Ways through the specimen: attenuation 1.
    let bodies: Vec<Body> = core()
        .into_iter()
        .map(|b| Body { mu: if b.mu > 0.0 { 1.0 } else { -1.0 }, ..b })
        .filter(|b| b.half[0] != 0.010)
        .collect();
    let ways = scan(&orbit(), &bodies, true);
    let reference = 35.0;
    let mut solid = truth(&grid(), &bodies, true);
    solid.data.iter_mut().for_each(|v| *v *= reference as f32);
    let measured: Vec<f32> = (ways.data.iter().enumerate())
        .map(|(i, way)| {
            -((counts(1e5 * (-hardened(f64::from(*way))).exp(), 3.0, Key::new(31, i as u64))
                .max(0.5)
                / 1e5)
                .ln()) as f32
        })
        .collect();
    let measured = with(&ways, measured);
    let (s, mu) = spectrum();
    let known = Linearisation::new(&s, &mu, reference, 0.1).unwrap();
    for way in [0.0, 1e-4, 0.03, 0.0799] {
        let straight = f64::from(known.apply(hardened(way) as f32));
        assert!(
            (straight - reference * way).abs() < 1e-4 * (1.0 + reference * way),
            "{way} {straight}"
        );
    }
    let mut by_spectrum = measured.clone();
    known.correct(&mut by_spectrum.data);
    let learnt = Polynomial::flatten(&measured, &grid(), 3, &Job::default()).unwrap();
    let mut by_itself = measured.clone();
    learnt.correct(&mut by_itself.data);
    // Without a spectrum the scale is unknown: compare shapes, each scaled to fit best.
    let shape = |sinogram: &Sinogram| {
        let image = image(sinogram).data;
        let dot =
            |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum::<f64>();
        let scale = (dot(&image, &solid.data) / dot(&image, &image)) as f32;
        nrmse(&image.iter().map(|v| v * scale).collect::<Vec<_>>(), &solid.data, &grid(), 0.98)
    };
    let [raw, known, learnt] = [&measured, &by_spectrum, &by_itself].map(shape);
    let absolute = [error(&measured, &solid), error(&by_spectrum, &solid)];
    println!(
        "hardening: raw {raw:.4} spectrum {known:.4} polynomial {learnt:.4}; absolute {absolute:.4?}"
    );
    assert!(known < 0.6 * raw && learnt < 0.7 * raw && absolute[1] < 0.5 * absolute[0]);
    assert!(
        Linearisation::new(&s, &mu[1..], 35.0, 0.1).is_err()
            && Linearisation::new(&[0.0], &[1.0], 35.0, 0.1).is_err()
    );
}

/// Scatter as strong as the primary behind the middle, known at 8 views on 6 patches to 3 %.
#[test]
fn scatter_is_taken_off_with_its_error() {
    let bodies: Vec<Body> = core().into_iter().map(|b| Body { mu: 1.6 * b.mu, ..b }).collect();
    let clean = scan(&orbit(), &bodies, true);
    let solid = truth(&grid(), &bodies, true);
    let scatter = |view: f64, bin: f64| {
        0.02 * (1.0 + 0.2 * (2.0 * view).cos())
            * (1.0 - 0.3 * ((bin - 0.5 * BINS as f64) / BINS as f64).powi(2) * 4.0)
    };
    let open = 1e5;
    let intensity: Vec<f32> = (clean.data.iter().enumerate())
        .map(|(i, p)| {
            let mean = f64::from(-p).exp() + scatter(orbit().angles[i / BINS], (i % BINS) as f64);
            (counts(open * mean, 5.0, Key::new(41, i as u64)) / open) as f32
        })
        .collect();
    let variance: Vec<f32> = intensity
        .iter()
        .map(|i| ((f64::from(*i) * open + 25.0).max(1.0) / (open * open)) as f32)
        .collect();
    let patches = (0..8_u32).map(|k| {
        let angle = TAU * f64::from(k) / 8.0;
        let at = |i: u32| scatter(angle, (f64::from(i) + 0.5) * BINS as f64 / 6.0);
        let value = |i| (at(i) * (1.0 + 0.03 * Key::new(42, u64::from(k)).normal(2 * i))) as f32;
        Patch {
            angle,
            value: (0..6).map(value).collect(),
            error: (0..6).map(|i| (0.03 * at(i)) as f32).collect(),
        }
    });
    let estimate = Estimate::new([1, 6], patches.collect()).unwrap();
    let raw = with(&clean, intensity.iter().map(|i| -i.max(1e-5).ln()).collect());
    // What is left, and its variance, of each ray.
    let left: Vec<[f32; 2]> = (orbit().angles.iter())
        .flat_map(|angle| {
            let (scatter, error) = estimate.view(*angle, [1, BINS]);
            scatter.into_iter().zip(error).collect::<Vec<_>>()
        })
        .zip(intensity.iter().zip(&variance))
        .map(|((s, e), (i, v))| [(i - s).max((v + e).sqrt()), v + e])
        .collect();
    let cleared: Vec<f32> = left.iter().map(|[rest, _]| -rest.ln()).collect();
    let [before, after] = [error(&raw, &solid), error(&with(&clean, cleared.clone()), &solid)];
    println!("scatter: before {before:.4} after {after:.4}");
    assert!(after < 0.4 * before, "{before} {after}");
    // Errors are what they are said to be: the mean of z² is 1 within 25 % (errors of a patch are
    // shared by its 32 bins and 45 views: some 48 independent ones).
    let z2: Vec<f64> = (cleared.iter().zip(&left).zip(&clean.data))
        .map(|((p, [rest, v]), truth)| (p - truth, v / (rest * rest)))
        .filter(|(_, variance)| *variance < 0.09)
        .map(|(off, variance)| f64::from(off).powi(2) / f64::from(variance))
        .collect();
    let mean = z2.iter().sum::<f64>() / z2.len() as f64;
    assert!((mean - 1.0).abs() < 0.25 && z2.len() > clean.data.len() / 2, "{mean} of {}", z2.len());
    assert!(
        Estimate::new([1, 2], vec![]).is_none()
            && Estimate::new(
                [1, 1],
                vec![Patch { angle: 0.0, value: vec![-1.0], error: vec![0.0] }]
            )
            .is_none()
    );
}

#[test]
fn the_axis_is_found() {
    let solid = truth(&grid(), &core(), true);
    let fan = Beam::Fan { source_axis: 0.2, axis_detector: 0.1, curved: false };
    let curved = Beam::Fan { source_axis: 0.2, axis_detector: 0.1, curved: true };
    for (beam, pitch) in [(Beam::Parallel, 5e-4), (fan, 7.5e-4), (curved, 7.5e-4)] {
        let mut true_orbit = Orbit::circle(beam, 360, TAU, [1, 220], [pitch, 1e-3]);
        let middle = true_orbit.centre;
        true_orbit.centre[0] += 3.37;
        let mut sinogram = scan(&true_orbit, &core(), true);
        sinogram
            .data
            .iter_mut()
            .enumerate()
            .for_each(|(i, p)| *p += 0.01 * Key::new(61, i as u64).normal(0) as f32);
        sinogram.orbit.centre = middle;
        let before = error(&sinogram, &solid);
        let found = axis_by_mirror(&sinogram, 0, 8.0).unwrap();
        assert!(
            (found - true_orbit.centre[0]).abs() < 0.05,
            "{beam:?}: {found} for {}",
            true_orbit.centre[0]
        );
        sinogram.orbit.centre[0] = found;
        let after = error(&sinogram, &solid);
        println!("axis {beam:?}: before {before:.4} after {after:.4}");
        assert!(after < 0.3 * before, "{before} {after}");
    }
}
