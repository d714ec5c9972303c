//! Simulated slices that the network has not seen: bodies and bars of any size, none of them like
//! the core of the labelled slices.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic")]

use intrados_ct::{
    detect::{DetectSettings, Method, detect},
    network::{
        simulate::{Noise, Plan, Section, sections},
        train::{Recipe, noisy},
    },
    score::Tally,
    slice::Slice,
};
use intrados_raster::grid::Mask;
use intrados_stage::{Job, random::Key};

/// Seed that training did not use.
const SEED: u64 = 78;

/// Where the grey lacks what the recipe of training calls the end of a pore.
fn truth(section: &Section) -> Mask {
    let level = Recipe::default().level;
    let dark = |i: usize| {
        section.solid.data[i]
            && section.pore.data[i].max(section.crack.data[i]) > 0.5 * (level[0] + level[1])
    };
    let free = |i: usize| section.steel.data[i] < 0.5;
    Mask {
        data: (0..section.solid.data.len()).map(|i| dark(i) && free(i)).collect(),
        ..section.solid
    }
}

/// Pooled over slices; porosity error as the mean of |p − t|/t.
fn read(method: Method, sections: &[Section], noise: &Noise) -> Tally {
    let mut tally = Tally::default();
    for (n, section) in sections.iter().enumerate() {
        let slice = Slice {
            name: format!("simulated {n}"),
            grey: noisy(section, noise, Key::new(SEED, 1 << 33 | n as u64)),
            pixel_mm: 0.1,
        };
        let found = detect(
            &slice,
            &DetectSettings { method, ..DetectSettings::default() },
            &Job::default(),
        )
        .unwrap();
        let one = Tally::of(&found.mask(), &truth(section)).unwrap();
        let score = one.score();
        println!(
            "{method:?} {n:2}: body {:6} F1 {:.3} Dice {:.3}",
            section.solid.count(),
            score.f1.unwrap(),
            score.dice.unwrap()
        );
        tally += one;
    }
    println!("{method:?}: {:?}", tally.score());
    tally
}

#[test]
fn network_reads_bodies_of_any_size() {
    let noise = Noise::new(Plan::Any, 4, SEED, &Job::default()).unwrap();
    let sections = sections(Plan::Any, 24, SEED, &Job::default()).unwrap();
    let [network, threshold] =
        [Method::Network, Method::Classical].map(|method| read(method, &sections, &noise).score());
    let [ours, theirs] = [network, threshold].map(|s| [s.f1.unwrap(), s.dice.unwrap()]);
    assert!(ours[0] > 0.8 && ours[1] > 0.9, "{ours:?}");
    assert!(ours[0] > theirs[0] && ours[1] > theirs[1], "{ours:?} {theirs:?}");
}
