//! The bundled column scene, from its file to a prediction.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::path::Path;

use intrados_damage::predict::{Settings, predict};
use intrados_scene::Scene;
use intrados_stage::Job;

/// Seeds are fixed: nothing here fails by chance.
#[test]
fn the_columns_are_told_apart() {
    let scene = Scene::open(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/column.ron"), &Job::default()).unwrap();
    let prediction = predict(&scene, Settings::default(), &[], &Job::default()).unwrap();
    let mut order = Vec::new();
    for member in &prediction.members {
        let (d, se, truth) = (member.damage.unwrap(), member.damage_std_error.unwrap(), member.truth.as_ref().unwrap().damage);
        println!("{:30} {d:.3} ± {se:.3}, truly {truth:.3}, {}", member.name, member.state);
        assert!((d - truth).abs() <= 3.0 * se, "{}: {d} ± {se}, truly {truth}", member.name);
        order.push((d, truth));
    }
    assert_eq!(order.len(), 4);
    assert!(order.iter().all(|a| order.iter().all(|b| a.1 + 0.1 >= b.1 || a.0 < b.0)), "{order:?}");
}
