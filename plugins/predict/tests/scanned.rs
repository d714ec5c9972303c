//! Specimens in the simulated scanner, from the scene to a prediction.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::path::Path;

use intrados_ct::synthetic::scanned::{Request, scan};
use intrados_damage::Sources;
use intrados_predict::{Origin, PredictSettings, predict};
use intrados_scene::Scene;
use intrados_stage::Job;

/// The bundled specimens, with another panel and fewer views.
fn specimens(detector: &str, projections: u32) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/specimens.ron");
    let text = std::fs::read_to_string(path).unwrap();
    let panel = "(width: 400, height: 8, pixel_mm: 0.8)";
    assert!(text.contains(panel) && text.contains("projections: 480"));
    let text = text
        .replace(panel, detector)
        .replace("projections: 480", &format!("projections: {projections}"));
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("specimens.ron"), text).unwrap();
    Scene::load(&folder.path().join("specimens.ron"), &Job::default()).unwrap()
}

/// Coarse slices show the air that was planted, within three of their standard errors, and that P2
/// has more of it than P1; same bits for the same seed.
#[test]
fn what_is_planted_is_scanned_and_read() {
    let scene = specimens("(width: 160, height: 8, pixel_mm: 2)", 180);
    let prediction = predict(
        &scene,
        PredictSettings { forecast: None, ..PredictSettings::default() },
        &Sources::default(),
        &Job::default(),
    )
    .unwrap();
    assert!(prediction.silences.is_empty(), "{:?}", prediction.silences);
    let slices: Vec<_> = prediction.members.iter().flat_map(|m| &m.slices).collect();
    assert_eq!(slices.len(), 6);
    for slice in &slices {
        let truth = slice.truth.as_ref().unwrap().porosity;
        println!(
            "{}: {:.4} ± {:.4}, truly {truth:.4}",
            slice.name, slice.porosity.value, slice.porosity.std_error
        );
        assert!(slice.origin == Origin::Scanned && slice.name.contains("a simulated scan"));
    }
    let mean =
        |k: usize| prediction.members[k].slices.iter().map(|s| s.porosity.value).sum::<f64>();
    assert!(mean(1) > 2.0 * mean(0), "{} {}", mean(1), mean(0));
    assert!(
        prediction.members[0]
            .truth
            .as_ref()
            .is_some_and(|t| t.damage < 0.05 && t.origin == "planted")
    );
    assert!(prediction.limits.iter().any(|l| l.contains("a simulated scan")));
    let request = Request { scanner: "bench".into(), along: 0.3, seed: 1 };
    let [one, two] =
        [0, 1].map(|_| scan(&scene, &scene.members[0], &request, &Job::default()).unwrap());
    assert_eq!(one, two);
}

/// Behind a weak tube nothing is left: the slices are silent and say why, nothing else is lost.
#[test]
fn a_slice_of_noise_is_no_evidence() {
    let mut scene = specimens("(width: 48, height: 8, pixel_mm: 6.6)", 24);
    std::sync::Arc::make_mut(&mut scene.structure).scanners[0].tube.charge_mas = 1e-10;
    let prediction = predict(
        &scene,
        PredictSettings { forecast: None, ..PredictSettings::default() },
        &Sources::default(),
        &Job::default(),
    )
    .unwrap();
    assert_eq!(prediction.silences.len(), 6);
    let says_why = |why: &str| why.contains("scan a core") || why.contains("no body");
    assert!(prediction.silences.iter().all(|s| says_why(&s.why)), "{:?}", prediction.silences);
    assert!(prediction.members.iter().all(|m| m.damage.is_none()));
}
