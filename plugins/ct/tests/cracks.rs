//! Cracks on simulated slices that the network has not seen, by width and contrast, next to the
//! ridge filter.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use intrados_ct::{
    detect::{DetectSettings, Method, detect},
    network::{
        Class, Network,
        simulate::{Noise, Plan, SIDE, Section, sections},
        train::noisy,
    },
    slice::Slice,
};
use intrados_raster::grid::{Grid, Mask};
use intrados_stage::{Job, random::Key};

/// Seed that training did not use.
const SEED: u64 = 77;
/// Pixels that a crack may be off.
const TOLERANCE: f32 = 2.0;

/// Distance of every pixel to the nearest of a mask, pixels.
fn away(mask: &Mask) -> Grid<f32> {
    mask.map(|v| !v).distance_within()
}

/// Found and near the truth, found; true and near what was found, true.
fn counts(found: &Mask, truth: &Mask) -> [usize; 4] {
    let near = |a: &Mask, b: &Mask| {
        let away = away(b);
        if b.count() == 0 {
            0
        } else {
            a.data.iter().zip(&away.data).filter(|(a, d)| **a && **d <= TOLERANCE).count()
        }
    };
    [near(found, truth), found.count(), near(truth, found), truth.count()]
}

/// Harmonic mean of precision and recall.
fn f1([near, found, reached, all]: [usize; 4]) -> f64 {
    let [p, r] = [near as f64 / found.max(1) as f64, reached as f64 / all.max(1) as f64];
    if p + r > 0.0 { 2.0 * p * r / (p + r) } else { 0.0 }
}

/// Where cracks lower the grey by half of what they do at their darkest.
fn truth(section: &Section) -> Mask {
    let deepest = section.crack.data.iter().copied().fold(0.0, f32::max);
    section.crack.map(|v| v > 0.4 * deepest && v > 0.0)
}

fn score(method: Method, width: f64, drop: f64, count: usize, noise: &Noise) -> f64 {
    let sections = sections(Plan::Cracked { width, drop }, count, SEED, &Job::default()).unwrap();
    let mut sum = [0; 4];
    for (n, section) in sections.iter().enumerate() {
        let grey = noisy(section, noise, Key::new(SEED, 1 << 33 | n as u64));
        let slice = Slice { name: format!("simulated {n}"), grey, pixel_mm: 0.1 };
        let found = detect(
            &slice,
            &DetectSettings { method, ..DetectSettings::default() },
            &Job::default(),
        )
        .unwrap();
        let one = counts(&found.crack_mask, &truth(section));
        sum.iter_mut().zip(one).for_each(|(s, v)| *s += v);
    }
    f1(sum)
}

/// Wide dark cracks are found by the network, better than by the ridge filter.
#[test]
fn network_finds_cracks() {
    let noise = Noise::new(Plan::Any, 2, SEED, &Job::default()).unwrap();
    let [network, ridges] =
        [Method::Network, Method::Classical].map(|method| score(method, 2.0, 0.35, 3, &noise));
    println!("width 2, drop .35: network {network:.3}, ridge filter {ridges:.3}");
    assert!(SIDE == 400 && network > 0.8 && network > ridges, "{network} and {ridges}");
}

/// Bars that a slice shows are steel, and hardly anything else is: pixels of six slices, pooled.
#[test]
fn network_knows_steel() {
    let noise = Noise::new(Plan::Any, 2, SEED, &Job::default()).unwrap();
    let network = Network::builtin().unwrap();
    let [mut both, mut found, mut real] = [0; 3];
    for (n, section) in sections(Plan::Any, 6, SEED, &Job::default()).unwrap().iter().enumerate() {
        let grey = noisy(section, &noise, Key::new(SEED, 1 << 33 | n as u64));
        let opinion = network.look(&grey, &section.solid, &Job::default()).unwrap();
        for (p, share) in opinion.of(Class::Steel).data.iter().zip(&section.steel.data) {
            let [said, is] = [*p, *share].map(|v| v > 0.5);
            (both, found, real) =
                (both + usize::from(said && is), found + usize::from(said), real + usize::from(is));
        }
    }
    let f1 = 2.0 * both as f64 / (found + real) as f64;
    println!("steel: F1 of pixels {f1:.3}, {real} true, {found} found");
    assert!(real > 1000 && f1 > 0.95, "{f1}, {both} of {real}, {found} found");
}

/// The table of the README.
#[test]
#[ignore = "a minute; by hand"]
fn cracks_by_width_and_contrast() {
    let noise = Noise::new(Plan::Any, 4, SEED, &Job::default()).unwrap();
    println!("| width, px | drop | network | ridge filter |\n|---|---|---|---|");
    for width in [1.0, 2.0, 3.0, 4.0, 6.0] {
        for drop in [0.1, 0.2, 0.4] {
            let [network, ridges] = [Method::Network, Method::Classical]
                .map(|method| score(method, width, drop, 6, &noise));
            println!("| {width} | {drop} | {network:.2} | {ridges:.2} |");
        }
    }
}
