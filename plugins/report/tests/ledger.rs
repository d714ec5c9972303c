//! Each item of evidence ends once in the ledger, whatever its kind and whatever member it belongs
//! to.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::{collections::BTreeMap, fs::File, path::Path};

use intrados_damage::{
    Cause, Evidence, EvidenceError, EvidenceSource, Said, Sources, ledger::Item, zone::Zones,
};
use intrados_forecast as forecast;
use intrados_gauges::{Simulation, simulate_with};
use intrados_predict::{PredictSettings, foreseen, predict};
use intrados_report::evidence_csv;
use intrados_scene::{
    Scene,
    gltf::{Model, write_glb},
};
use intrados_stage::{Estimate, Job};
use tiff::encoder::{TiffEncoder, colortype::Gray8};

const PARAMETRIC: [&str; 3] = ["C", "B", "G"];
/// All members of [`SCENE`]: of parametric ones, of a lining and its segments, and of a glTF file.
const MEMBERS: [&str; 8] = ["C", "B", "G", "T", "T/R1/S1", "T/R1/S2", "T/R1/S3", "COL_import"];

const SCENE: &str = r#"(
    schema: "intrados.scene/1",
    models: [(file: "imported.glb")],
    members: [
        (id: "C", body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 2), concrete: "C30/37", slices: [SLICES]),
        (id: "B", body: Beam(section: Rectangle(width_m: 0.3, depth_m: 0.4), length_m: 3), at: (2, 0, 0), concrete: "C30/37", slices: [SLICES]),
        (
            id: "G", at: (2, 0, 4), concrete: "C30/37", slices: [SLICES], body: BoxGirder(
                section: (top_width_m: 3, bottom_width_m: 1.6, depth_m: 1, top_m: 0.2, bottom_m: 0.2, web_m: 0.25), length_m: 4,
            ),
        ),
        (
            id: "T", at: (0, 0, 20), concrete: "C40/50", slices: [SLICES],
            body: Tunnel(radius_m: 2, length_m: 1, segments: (count: 3, ring_m: 1, thickness_m: 0.3), inner_lining: (thickness_m: 0.3)),
        ),
    ],
    details: [
        (member: "T/R1/S1", slices: [MADE]), (member: "T/R1/S2", slices: [MADE]), (member: "T/R1/S3", slices: [MADE]),
        (member: "COL_import", slices: [FILES]),
    ],
    scanners: [(
        name: "bench", members: ["C"], tube: (voltage_kv: 450, charge_mas: 1e-10),
        detector: (width: 32, height: 4, pixel_mm: 20), orbit: (projections: 12, source_m: 8, detector_m: 2),
    )],
    meters: [Patch(name: "lux", corner: (0, 3, 0), u: (1, 0, 0), v: (0, 0, 1))],
    supports: [(member: "C", place: Start, hold: Fixed), (member: "B", place: Start, hold: Fixed), (member: "G", place: Start, hold: Fixed)],
    tests: [TESTS
        (name: "warmth of C", member: "C", actions: [Temperature(uniform_k: 10)]),
    ],
    gauges: [GAUGES
        (name: "stress of C", member: "C", along: 0.5, angle_deg: 0, measures: Stress(Axial)),
    ],
    readings: [READINGS
        (of: "strain of C", test: "warmth of C", value: 1e-5, std_error: 1e-6),
        (of: "stress of C", test: "push on C", value: 1e6, std_error: 1e5),
        (of: "lux", value: 300, std_error: 5),
    ],
)"#;

/// What every member gets: a good and a damaged file, a drawn section, a scan through which nothing
/// comes; a reading without a test, one of another member's test.
fn scene(folder: &Path, readings: &str) -> Scene {
    let files = r#"Files(name: "core", images: ["good.tif", "bad.tif"], pixel_mm: 1)"#;
    let made = format!(r#"{files}, Drawn(name: "drawn", count: 1, size: 96, pixel_mm: 8)"#);
    let slices = format!(r#"{made}, Scanned(name: "scans", scanner: "bench", along: [0.5])"#);
    let list = |line: fn(&str) -> String| MEMBERS.map(line).concat();
    let tests = list(|m| {
        format!(
            r#"(name: "push on {m}", member: "{m}", actions: [Force(place: End, force_kn: (0, -50, 5))]),"#
        )
    });
    let gauges = list(|m| {
        format!(
            r#"(name: "strain of {m}", member: "{m}", along: 0.4, angle_deg: 0, measures: Strain(Axial)),
            (name: "move of {m}", member: "{m}", along: 0.9, angle_deg: 90, measures: Displacement((0, 0, 1))),"#
        )
    });
    let all = list(|m| {
        let other = if m == "C" { "B" } else { "C" };
        format!(
            r#"(of: "strain of {m}", value: 1e-5, std_error: 1e-6), (of: "strain of {m}", test: "push on {other}", value: 1e-5, std_error: 1e-6),
            (of: "strain of {m}", test: "push on {m}", value: VALUE, std_error: 1e-6),"#
        )
    });
    let text = SCENE
        .replace("SLICES", &slices)
        .replace("MADE", &made)
        .replace("FILES", files)
        .replace("TESTS", &tests)
        .replace("GAUGES", &gauges);
    let text = text
        .replace("READINGS", if readings.is_empty() { &all } else { readings })
        .replace("VALUE", "1e-5");
    std::fs::write(folder.join("scene.ron"), text).unwrap();
    let grey: Vec<u8> = (0..96 * 96_i32)
        .map(|i| {
            if (i % 96 - 48).pow(2) + (i / 96 - 48).pow(2) < 900 {
                140 + (i * 7 % 11) as u8
            } else {
                0
            }
        })
        .collect();
    TiffEncoder::new(File::create(folder.join("good.tif")).unwrap())
        .unwrap()
        .write_image::<Gray8>(96, 96, &grey)
        .unwrap();
    std::fs::write(folder.join("bad.tif"), "no picture").unwrap();
    let column = r#"(schema: "intrados.scene/1", members: [(id: "COL_import", body: Column(section: Rectangle(width_m: 0.3, depth_m: 0.3), height_m: 2), at: (-3, 0, 0))])"#;
    std::fs::write(folder.join("column.ron"), column).unwrap();
    let Scene { meshes, objects, materials, members, .. } =
        Scene::load(&folder.join("column.ron"), &Job::default()).unwrap();
    let model = Model { meshes, objects, materials, members, ..Model::default() };
    write_glb(&folder.join("imported.glb"), &model).unwrap();
    Scene::load(&folder.join("scene.ron"), &Job::default()).unwrap()
}

/// An outside plugin that knocks on every member, and is out of its mind on one.
#[derive(Debug)]
struct Knocked;

impl EvidenceSource for Knocked {
    fn name(&self) -> &'static str {
        "knocked"
    }

    fn items(&self, _: &Scene, _: usize) -> Vec<String> {
        vec!["a knock".into(), "a knock beside it".into()]
    }

    fn evidence(&self, scene: &Scene, index: usize, _: &Job) -> Result<Said, EvidenceError> {
        let value = if scene.members[index].id == "B" { f64::NAN } else { 0.1 };
        let zones = [(Cause::Concrete, Zones::all(Estimate { value, std_error: 0.3 }))].into();
        Ok(Said {
            evidence: Evidence::new("knocked", true, zones, String::new()),
            unused: [(1, "beside it is air".into())].into(),
        })
    }
}

fn settings(forecast: bool) -> PredictSettings {
    PredictSettings {
        forecast: forecast.then(forecast::ForecastSettings::default),
        ..PredictSettings::default()
    }
}

#[test]
fn every_kind_of_evidence_on_every_kind_of_member_ends_once() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path(), "");
    // What is to be used is what sound members show.
    for member in PARAMETRIC {
        let shown =
            simulate_with(&scene, member, &|_| 0.0, &Simulation::default(), &Job::default())
                .unwrap()
                .unwrap();
        let structure = std::sync::Arc::make_mut(&mut scene.structure);
        for reading in &mut structure.readings {
            if let Some(of_sound) =
                shown.iter().find(|s| (&s.of, &s.test) == (&reading.of, &reading.test))
            {
                *reading = of_sound.clone();
            }
        }
    }
    let mut ids: Vec<&str> = scene.members.iter().map(|m| m.id.as_str()).collect();
    ids.sort_unstable();
    let mut all = MEMBERS.to_vec();
    all.sort_unstable();
    assert_eq!(ids, all);
    let prediction = predict(
        &scene,
        settings(false),
        &Sources(vec![std::sync::Arc::new(Knocked)]),
        &Job::default(),
    )
    .unwrap();
    let mut found: BTreeMap<(&str, &str, &str), Vec<&Item>> = BTreeMap::new();
    prediction
        .items
        .iter()
        .for_each(|i| found.entry((&i.member, i.source, &i.item)).or_default().push(i));
    let mut ends = |member: &str, source: &str, item: &str, why: Option<&str>| {
        let key = *found
            .keys()
            .find(|k| k.0 == member && k.1 == source && k.2.contains(item))
            .unwrap_or_else(|| panic!("{member}, {source}, {item}"));
        let [one] = found.remove(&key).unwrap()[..] else {
            panic!("{member}, {source}, {item}: more than once")
        };
        assert_eq!(one.used, why.is_none(), "{one:?}");
        assert!(one.used || one.why.as_ref().unwrap().contains(why.unwrap()), "{one:?}: {why:?}");
    };
    for (m, member) in MEMBERS.into_iter().enumerate() {
        let parametric = PARAMETRIC.contains(&member);
        ends(member, "ct", "good.tif", None);
        ends(member, "ct", "bad.tif", Some("bad.tif"));
        if member != "COL_import" {
            ends(member, "ct", "drawn, section 1 of 1", None);
        }
        if PARAMETRIC.contains(&member) || member == "T" {
            ends(member, "ct", "scans, scanned at 0.5", Some(""));
        }
        ends(member, "knocked", "a knock beside it", Some("beside it is air"));
        ends(member, "knocked", "a knock", (member == "B").then_some("NaN"));
        let unfelt =
            if member == "COL_import" { "nothing is known of the bars" } else { "tunnel linings" };
        let why = |of_parametric| if parametric { of_parametric } else { Some(unfelt) };
        ends(
            member,
            "gauges",
            &format!("(reading {})", 3 * m + 1),
            why(Some("names no load test")),
        );
        ends(member, "gauges", &format!("(reading {})", 3 * m + 2), why(Some("acts on")));
        ends(member, "gauges", &format!("(reading {})", 3 * m + 3), why(None));
    }
    ends("C", "gauges", "(reading 25)", Some("something else acts"));
    ends("C", "gauges", "(reading 26)", Some("measures stress"));
    ends("", "gauges", "lux", Some("light meter"));
    assert!(found.is_empty(), "{found:?}");

    // What is foreseen is what happens, and silences and tables say the same.
    let foreseen = foreseen(&scene, &Job::default()).unwrap();
    assert!(
        foreseen.len() > 20 && foreseen.iter().all(|(_, item)| prediction.items.contains(item)),
        "{foreseen:?}"
    );
    let unused = prediction.items.iter().filter(|i| !i.used).count();
    assert_eq!(unused, prediction.silences.len());
    assert!(
        prediction
            .limits
            .iter()
            .any(|l| l.starts_with(&format!("{unused} of {}", prediction.items.len()))),
        "{:?}",
        prediction.limits
    );
    assert_eq!(evidence_csv(&prediction).lines().count(), 1 + prediction.items.len());
}

/// A life that cannot be computed, and one that is; readings made from planted truth; a forecast
/// damage that yields to what is measured.
#[test]
fn lives_and_simulated_readings_are_in_the_ledger() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path(), " ");
    scene.members.iter_mut().for_each(|m| m.slices.clear());
    let structure = std::sync::Arc::make_mut(&mut scene.structure);
    structure.readings.clear();
    structure.assemblies.retain(|a| ["C", "B"].contains(&a.id.as_str()));
    structure.supports.retain(|s| s.member == "C");
    scene.members[0].truth =
        vec![intrados_scene::Damage::Softened { from: 0.3, to: 0.5, damage: 0.4, side_deg: None }];
    let items =
        predict(&scene, settings(true), &Sources::default(), &Job::default()).unwrap().items;
    let told: Vec<(&str, &str, bool)> =
        items.iter().map(|i| (i.member.as_str(), i.source, i.used)).collect();
    assert_eq!(told, [("C", "forecast", true), ("C", "gauges", true), ("B", "forecast", false)]);
    assert!(items[2].why.as_ref().unwrap().contains("nothing holds it"), "{items:?}");
    assert!(items[1].item.contains("simulated"), "{items:?}");
}

/// Readings that were given but cannot be inverted are not replaced by simulated ones.
#[test]
fn truth_takes_no_place_of_readings() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path(), r#"(of: "strain of C", value: 1e-5, std_error: 1e-6),"#);
    scene.members.iter_mut().for_each(|m| m.slices.clear());
    scene.members[0].truth =
        vec![intrados_scene::Damage::Softened { from: 0.3, to: 0.5, damage: 0.4, side_deg: None }];
    let prediction =
        predict(&scene, settings(false), &Sources::default(), &Job::default()).unwrap();
    assert!(
        prediction.members[0].evidence.is_empty() && prediction.items.iter().all(|i| !i.used),
        "{:?}",
        prediction.items
    );
}

/// Two sources of one name: the first counts, the ledger says what became of the other.
#[test]
fn a_name_that_is_taken_is_told() {
    #[derive(Debug)]
    struct Twice;
    impl EvidenceSource for Twice {
        fn name(&self) -> &'static str {
            "ct"
        }

        fn items(&self, _: &Scene, _: usize) -> Vec<String> {
            vec!["another slice".into()]
        }

        fn evidence(&self, _: &Scene, _: usize, _: &Job) -> Result<Said, EvidenceError> {
            unreachable!("nobody asks it")
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path(), " ");
    scene.members.truncate(1);
    scene.members[0].slices.truncate(2);
    std::sync::Arc::make_mut(&mut scene.structure).readings.clear();
    let items = predict(
        &scene,
        settings(false),
        &Sources(vec![std::sync::Arc::new(Twice)]),
        &Job::default(),
    )
    .unwrap()
    .items;
    let told: Vec<(bool, &str)> =
        items.iter().map(|i| (i.used, i.why.as_deref().unwrap_or_default())).collect();
    assert!(
        told[0].0
            && told[2].0
            && !told[3].0
            && told[3].1.contains("give this one a name of its own"),
        "{told:?}"
    );
    assert!(!told[1].0 && told[1].1.contains("bad.tif"), "{told:?}");
}

/// A sound column that feels what it should: used, whatever its readings are called.
#[test]
fn readings_of_a_test_are_used() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scene(folder.path(), " ");
    scene.members.iter_mut().for_each(|m| m.slices.clear());
    let readings = simulate_with(&scene, "C", &|_| 0.0, &Simulation::default(), &Job::default())
        .unwrap()
        .unwrap();
    std::sync::Arc::make_mut(&mut scene.structure).readings = readings;
    let prediction =
        predict(&scene, settings(false), &Sources::default(), &Job::default()).unwrap();
    assert!(
        !prediction.items.is_empty() && prediction.items.iter().all(|i| i.used),
        "{:?}",
        prediction.items
    );
}
