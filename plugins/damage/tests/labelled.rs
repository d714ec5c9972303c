//! The eleven labelled slices of real mortar. Runs where `INTRADOS_DATA` names the folder of test data.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::path::Path;

use intrados_damage::{detect, score::Tally, slice};
use intrados_stage::Job;

/// Pooled Dice, F1 and porosity error at what `../README.md` promises, and porosity errors that the error bars cover: of eleven 95 %
/// intervals at least eight hold the truth (with honest bars fewer do so with probability 2e-3; nothing here is random).
#[test]
fn labelled_slices_are_read_as_well_as_promised() {
    let Some(data) = std::env::var_os("INTRADOS_DATA") else {
        println!("skipped: INTRADOS_DATA is not set");
        return;
    };
    let slices = slice::slices_in(&Path::new(&data).join("ct/slices")).unwrap();
    let (mut tally, mut covered) = (Tally::default(), 0);
    for (path, masks) in &slices {
        let slice = slice::Slice::read(path, 0.1).unwrap();
        let truth = slice::read_masks(masks, &slice).unwrap();
        let begin = std::time::Instant::now();
        let found = detect::detect(&slice, &detect::Settings::default(), &Job::default()).unwrap();
        let seconds = begin.elapsed().as_secs_f64();
        let one = Tally::of(&found.mask(), &truth).unwrap();
        tally += one;
        // Labels do not tell cracks from pores: all that is dark is compared with the error bar of the pores, which are most of it.
        let [p, t] = [found.mask(), truth].map(|mask| mask.count() as f64 / found.body.count() as f64);
        let p = detect::Reading { value: p, ..found.porosity };
        covered += usize::from((p.value - t).abs() <= 1.96 * p.std_error);
        println!(
            "{:52} F1 {:.3} Dice {:.3} porosity {:.4} ± {:.4} (true {t:.4}, z {:+.1}) ± {:.4} cracks {} noise {:.3} air {:.2} {seconds:.3} s",
            slice.name,
            one.score().f1.unwrap(),
            one.score().dice.unwrap(),
            p.value,
            p.std_error,
            (p.value - t) / p.std_error,
            found.sampling_error,
            found.cracks.len(),
            found.noise,
            found.air_drop
        );
    }
    let score = tally.score();
    println!("{score:?}, {covered} of {} covered", slices.len());
    assert_eq!(slices.len(), 11);
    assert!(score.dice.unwrap() >= 0.91, "{score:?}");
    assert!(score.f1.unwrap() >= 0.885, "{score:?}");
    assert!(score.porosity_error.unwrap() <= 0.045, "{score:?}");
    assert!(covered >= 8, "{covered}");
}
