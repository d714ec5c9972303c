//! The bundled column scene, from its file to a prediction.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test may panic, and tells its figures"
)]

use std::path::Path;

use intrados_damage::Sources;
use intrados_predict::{PredictSettings, predict};
use intrados_scene::Scene;
use intrados_stage::Job;

/// Predicts a bundled scene, and says what came of it: every member with a known truth within three
/// of its error bars. Gives damage and truth.
fn told(name: &str) -> Vec<(f64, f64)> {
    let scene = Scene::open(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../scenes/{name}.ron")),
        &Job::default(),
    )
    .unwrap();
    let prediction =
        predict(&scene, PredictSettings::default(), &Sources::default(), &Job::default()).unwrap();
    let mut order = Vec::new();
    for member in &prediction.members {
        let (Some(d), Some(se), Some(truth)) =
            (member.damage, member.damage_std_error, &member.truth)
        else {
            continue;
        };
        println!(
            "{:30} {d:.3} ± {se:.3}, truly {:.3}, {}, not visible: {}",
            member.name,
            truth.damage,
            member.state,
            truth.not_visible.join("; ")
        );
        for (cause, zones) in &member.causes {
            let zone = |z: &Option<_>| {
                z.map_or("-".into(), |r: intrados_stage::Estimate| {
                    format!("{:.2}±{:.2}", r.value, r.std_error)
                })
            };
            println!(
                "    {:10} {}",
                cause.name(),
                zones.0.iter().map(zone).collect::<Vec<_>>().join(" ")
            );
        }
        println!(
            "    truly      {}",
            truth.zones.iter().flatten().map(|z| format!("{z:.2}     ")).collect::<String>()
        );
        assert!(
            (d - truth.damage).abs() <= 3.0 * se,
            "{}: {d} ± {se}, truly {}",
            member.name,
            truth.damage
        );
        order.push((d, truth.damage));
    }
    order
}

/// Seeds are fixed: nothing here fails by chance.
#[test]
fn the_columns_are_told_apart() {
    let order = told("column");
    assert_eq!(order.len(), 4);
    assert!(order.iter().all(|a| order.iter().all(|b| a.1 + 0.1 >= b.1 || a.0 < b.0)), "{order:?}");
}

#[test]
#[ignore = "ten CPU-minutes; by hand"]
fn error_bars_of_beams_and_lining_hold() {
    assert_eq!(told("beam").len(), 4);
    assert!(!told("tunnel").is_empty());
}
