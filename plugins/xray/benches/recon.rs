//! Reconstruction: `cargo bench -p intrados-xray`.
//!
//! First a table of CPU-seconds, which a busy machine disturbs little, and of nRMSE inside the disc
//! of .44 of the width, on a disc with 250 holes: the sizes and the count that ASTRA is measured
//! with. If `INTRADOS_PEER` names a folder with `sino_N.raw` and `phantom_N.raw` (f32; y of the
//! phantom downwards), these are reconstructed, so that both programs see the same numbers. Then
//! divan's wall-clock figures.
#![allow(clippy::print_stdout, reason = "a bench reports")]

use std::{path::Path, time::Instant};

use divan::Bencher;
use intrados_stage::{Job, random::Key};
use intrados_xray::{
    recon::{Projector, Window, cgls, fbp, nrmse, sirt},
    volume::{Beam, Grid, Orbit, Sinogram, Volume},
};

const SIZES: [(usize, usize); 2] = [(512, 720), (1024, 1440)];

fn main() {
    println!("parallel beam          CPU-s  wall s   nRMSE");
    for (n, views) in SIZES {
        let (sinogram, phantom) = case(n, views);
        let truth = &phantom.data;
        for window in [Window::Ramp, Window::SheppLogan, Window::Hann] {
            let image = timed(&format!("{n}² × {views} {window:?}"), || {
                fbp(&sinogram, &phantom.grid, window, &Job::default())
                    .expect("the orbit is sound")
                    .data
            });
            println!("   {:.4}", nrmse(&image, truth, &phantom.grid, 0.88));
        }
        let projector = Projector::new(&sinogram.orbit, &phantom.grid).expect("the orbit is sound");
        timed("  forward", || {
            projector.forward(truth, &Job::default()).expect("nobody cancels it")
        });
        println!();
        timed("  backward", || {
            projector.backward(&sinogram.data, &Job::default()).expect("nobody cancels it")
        });
        println!();
        let image = timed("  CGLS, 10 iterations", || {
            cgls(&sinogram, &projector, 10, &Job::default(), |_, _| true)
                .expect("nobody cancels it")
                .data
        });
        println!("   {:.4}", nrmse(&image, truth, &phantom.grid, 0.88));
        let image = timed("  SIRT, 20 iterations", || {
            sirt(&sinogram, &projector, 20, false, &Job::default(), |_, _| true)
                .expect("nobody cancels it")
                .data
        });
        println!("   {:.4}", nrmse(&image, truth, &phantom.grid, 0.88));
    }
    for beam in [
        Beam::Fan { source_axis: 1024.0, axis_detector: 512.0, curved: false },
        Beam::Fan { source_axis: 1024.0, axis_detector: 512.0, curved: true },
    ] {
        let (sinogram, grid) = divergent(beam, 512, [1, 512], 720);
        timed("fan 512² × 720", || {
            fbp(&sinogram, &grid, Window::Ramp, &Job::default()).expect("the orbit is sound")
        });
        println!();
    }
    let (sinogram, grid) =
        divergent(Beam::Cone { source_axis: 512.0, axis_detector: 256.0 }, 128, [128, 128], 180);
    timed("cone 128³ × 180", || {
        fbp(&sinogram, &grid, Window::Ramp, &Job::default()).expect("the orbit is sound")
    });
    println!();
    divan::main();
}

/// A full turn of ones, and a cube (or a slice, for one detector row) that it sees.
fn divergent(beam: Beam, n: usize, detector: [usize; 2], views: usize) -> (Sinogram, Grid) {
    let orbit = Orbit::circle(beam, views, std::f64::consts::TAU, detector, [1.6; 2]);
    (Sinogram { data: vec![1.0; orbit.len()], orbit }, Grid::centred([n, n, detector[0]], [1.0; 3]))
}

/// Prints what `work` took, without ending the line.
fn timed<T>(name: &str, work: impl FnOnce() -> T) -> T {
    let (cpu, wall) = (cpu_seconds(), Instant::now());
    let result = work();
    print!("{name:<22} {:>5.2}  {:>6.3}", cpu_seconds() - cpu, wall.elapsed().as_secs_f64());
    result
}

/// CPU time of this process so far, to a hundredth (Linux; elsewhere 0).
fn cpu_seconds() -> f64 {
    let Ok(stat) = std::fs::read_to_string("/proc/self/stat") else { return 0.0 };
    let ticks = stat.rsplit(')').next().unwrap_or_default().split_whitespace().skip(11).take(2);
    ticks.filter_map(|t| t.parse::<f64>().ok()).sum::<f64>() / 100.0
}

fn case(n: usize, views: usize) -> (Sinogram, Volume) {
    let orbit = Orbit::circle(Beam::Parallel, views, std::f64::consts::PI, [1, n], [1.0; 2]);
    let grid = Grid::centred([n, n, 1], [1.0; 3]);
    let phantom = Volume { grid, data: phantom(n) };
    if let Some(folder) = std::env::var_os("INTRADOS_PEER") {
        let read = |name: String| {
            std::fs::read(Path::new(&folder).join(name)).map(|bytes| {
                bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
            })
        };
        let (data, image): (Vec<f32>, Vec<f32>) = (
            read(format!("sino_{n}.raw")).expect("a sinogram"),
            read(format!("phantom_{n}.raw")).expect("a phantom"),
        );
        return (
            Sinogram { orbit, data },
            Volume { grid, data: image.chunks(n).rev().flatten().copied().collect() },
        );
    }
    let projector = Projector::new(&orbit, &grid).expect("the orbit is sound");
    let data = projector.forward(&phantom.data, &Job::default()).expect("nobody cancels it");
    (Sinogram { orbit, data }, phantom)
}

/// A disc with 250 round holes of 2 pixels to a sixtieth of the width.
fn phantom(n: usize) -> Vec<f32> {
    let width = n as f32;
    let inside = |x: usize, y: usize, [cx, cy, r]: [f32; 3]| {
        (x as f32 - cx).powi(2) + (y as f32 - cy).powi(2) < r * r
    };
    let disc = [width / 2.0, width / 2.0, 0.45 * width];
    let mut image: Vec<f32> = (0..n * n)
        .map(|i| if inside(i % n, i / n, disc) { 0.008 * 512.0 / width } else { 0.0 })
        .collect();
    for hole in 0..250 {
        let [a, b, c] = [0, 1, 2].map(|d| Key::new(7, hole).unit(d));
        let hole =
            [(0.15 + 0.7 * a) * width, (0.15 + 0.7 * b) * width, 2.0 + c * (width / 60.0 - 2.0)];
        let reach =
            |at: f32| (at - hole[2]).max(0.0) as usize..((at + hole[2]) as usize + 2).min(n);
        for y in reach(hole[1]) {
            reach(hole[0]).filter(|&x| inside(x, y, hole)).for_each(|x| image[y * n + x] = 0.0);
        }
    }
    image
}

#[divan::bench(args = [512, 1024], sample_count = 10)]
fn parallel(bencher: Bencher, n: usize) {
    let (sinogram, phantom) = case(n, n * 45 / 32);
    bencher.bench(|| fbp(&sinogram, &phantom.grid, Window::Ramp, &Job::default()));
}

#[divan::bench(args = [512], sample_count = 5)]
fn fan(bencher: Bencher, n: usize) {
    let beam = Beam::Fan { source_axis: 2.0 * n as f64, axis_detector: n as f64, curved: false };
    let (sinogram, grid) = divergent(beam, n, [1, n], n * 45 / 32);
    bencher.bench(|| fbp(&sinogram, &grid, Window::Ramp, &Job::default()));
}

#[divan::bench(args = [128], sample_count = 5)]
fn cone(bencher: Bencher, n: usize) {
    let beam = Beam::Cone { source_axis: 4.0 * n as f64, axis_detector: 2.0 * n as f64 };
    let (sinogram, grid) = divergent(beam, n, [n, n], 180);
    bencher.bench(|| fbp(&sinogram, &grid, Window::Ramp, &Job::default()));
}
