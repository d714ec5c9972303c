//! What a program that reads BCF finds in the topics of a prediction.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::{
    collections::BTreeMap,
    io::{Cursor, Read},
};

use intrados_ct::Picture;
use intrados_damage::Sources;
use intrados_forecast as forecast;
use intrados_predict::{PredictSettings, Prediction, predict};
use intrados_report::{Basis, Document, Provenance, Version, bcf, write};
use intrados_scene::Scene;
use intrados_stage::Job;
use serde::{Deserialize, de::DeserializeOwned};
use zip::ZipArchive;

/// A pier with an IFC GlobalId, and an old post in salt that nobody looked at.
const SCENE: &str = r#"(
    schema: "intrados.scene/1",
    project: (inspected: "2026-05-03"),
    members: [
        (
            id: "2O2Fr$t4X7Zf8NOew3FLOH", name: "Pier <1> & \"north\"", at: (10, 0, 4),
            body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3), concrete: "C30/37",
        ),
        (
            id: "W", name: "Post", at: (0, 0, 0), concrete: "C30/37", exposure: (class: "XC4, XD3", years: 60),
            body: Column(
                section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3,
                reinforcement: (cover_mm: 15, bars: [Around(count: 12, diameter_mm: 20)]),
            ),
        ),
    ],
    supports: [(member: "W", place: Start, hold: Fixed)],
)"#;

const EVIDENCE: &str = r#"(
    schema: "intrados.evidence/1",
    items: [
        (
            member: "2O2Fr$t4X7Zf8NOew3FLOH", name: "crack <a>", date: "2026-05-02", along: 0.5, angle_deg: 90,
            shows: Crack(width_mm: 0.4, course: Across),
        ),
        (member: "2O2Fr$t4X7Zf8NOew3FLOH", name: "b", shows: Spall(area_m2: 0.2, depth_mm: 40)),
    ],
)"#;

fn predicted() -> (Scene, Prediction) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.ron"), SCENE).unwrap();
    std::fs::write(folder.path().join("evidence.ron"), EVIDENCE).unwrap();
    let scene = Scene::load(&folder.path().join("scene.ron"), &Job::default()).unwrap();
    let forecast = forecast::ForecastSettings {
        element_m: Some(0.2),
        ..forecast::ForecastSettings::default()
    };
    let settings = PredictSettings { forecast: Some(forecast), ..PredictSettings::default() };
    let prediction = predict(&scene, settings, &Sources::default(), &Job::default()).unwrap();
    (scene, prediction)
}

#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct Markup {
    topic: Topic,
    viewpoints: Option<ViewPoint>,
}

#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct Topic {
    #[serde(rename = "@Guid")]
    guid: String,
    #[serde(rename = "@TopicType")]
    kind: String,
    title: String,
    priority: Option<String>,
    creation_date: String,
    due_date: Option<String>,
    description: String,
    viewpoints: Option<Viewpoints>,
}

#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct Viewpoints {
    view_point: ViewPoint,
}

#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct ViewPoint {
    #[serde(rename = "@Guid")]
    guid: String,
    viewpoint: String,
}

#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct View {
    #[serde(rename = "@Guid")]
    guid: String,
    components: Components,
    perspective_camera: Camera,
}

#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct Components {
    selection: Selection,
}

#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct Selection {
    component: Component,
}

#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct Component {
    #[serde(rename = "@IfcGuid")]
    ifc_guid: Option<String>,
    authoring_tool_id: Option<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct Camera {
    camera_view_point: Vector,
    camera_direction: Vector,
    camera_up_vector: Vector,
    field_of_view: f64,
    aspect_ratio: Option<f64>,
}

#[derive(Debug, Deserialize, PartialEq)]
#[serde(rename_all = "PascalCase")]
struct Vector {
    x: f64,
    y: f64,
    z: f64,
}

/// Names and texts of a zip file.
fn unpacked(bytes: &[u8]) -> BTreeMap<String, String> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).unwrap();
    let mut files = BTreeMap::new();
    for n in 0..archive.len() {
        let mut file = archive.by_index(n).unwrap();
        let mut text = String::new();
        file.read_to_string(&mut text).unwrap();
        let name = file.name().unwrap().into_owned();
        assert!(!files.contains_key(&name), "{name} is there twice");
        files.insert(name, text);
    }
    files
}

fn read<T: DeserializeOwned>(files: &BTreeMap<String, String>, name: &str) -> T {
    quick_xml::de::from_str(&files[name]).unwrap_or_else(|why| panic!("{name}: {why}"))
}

/// Topics with their views, by title; ids, folders and references agree.
fn topics(files: &BTreeMap<String, String>, version: Version) -> BTreeMap<String, (Topic, View)> {
    let folders = files.keys().filter_map(|name| name.strip_suffix("/markup.bcf"));
    let one = |folder: &str| {
        let Markup { mut topic, viewpoints } = read(files, &format!("{folder}/markup.bcf"));
        let within = topic.viewpoints.take().map(|v| v.view_point);
        assert_eq!(within.is_some(), version == Version::V3_0);
        let point = within.or(viewpoints).unwrap();
        let view: View = read(files, &format!("{folder}/{}", point.viewpoint));
        assert_eq!((topic.guid.as_str(), &point.guid), (folder, &view.guid));
        let guid = uuid::Uuid::parse_str(folder).unwrap();
        assert_eq!(guid.get_version_num(), 8, "{guid}");
        (topic.title.clone(), (topic, view))
    };
    folders.map(one).collect()
}

#[test]
fn every_defect_is_a_topic_and_so_is_a_member_that_may_be_bad_though_none_was_found() {
    let (scene, prediction) = predicted();
    let basis = Basis::of(&scene);
    let [pier, post] = &prediction.members[..] else { panic!("two members") };
    assert_eq!((pier.defects.len(), post.defects.len()), (2, 0));
    let states = prediction.profile.states.len();
    assert!(post.state_run.unwrap()[1] >= states / 2, "{:?}", post.state_run);
    for version in [Version::V2_1, Version::V3_0] {
        let write =
            |date: &str| unpacked(&bcf(&scene, &prediction, &basis, date, version).unwrap());
        let files = write("2026-05-04 14:20 UTC");
        let edition = if version == Version::V2_1 { "2.1" } else { "3.0" };
        assert!(files["bcf.version"].contains(&format!("VersionId=\"{edition}\"")));
        assert_eq!(files.contains_key("extensions.xml"), version == Version::V3_0);
        let topics = topics(&files, version);
        assert_eq!(topics.len(), 3, "{:?}", topics.keys());

        let (crack, view) = topics
            .get("Pier <1> & \"north\": crack across, 0.40 ± 0.05 mm wide")
            .unwrap_or_else(|| panic!("{:?}", topics.keys()));
        assert_eq!((&*crack.kind, &*crack.creation_date), ("Defect", "2026-05-04T14:20:00Z"));
        let due = pier.within_months.and_then(|m| basis.until(m));
        assert_eq!(crack.due_date, due.map(|day| format!("{day}T00:00:00Z")));
        assert!(crack.priority.is_some());
        for line in [
            "Place: 1.50 m of 3.00 m along the axis",
            "Side: 90° about the axis",
            "Source: survey, crack <a>, 2026-05-02",
            &format!("To do: {}", pier.advice),
        ] {
            assert!(crack.description.contains(line), "{line}: {}", crack.description);
        }
        assert_eq!(
            view.components.selection.component.ifc_guid.as_deref(),
            Some("2O2Fr$t4X7Zf8NOew3FLOH")
        );
        // Our (10.2, 1.5, 4) seen from 1.5 m along x; IFC's y is our −z.
        let camera = &view.perspective_camera;
        let expected = [11.7, -4.0, 1.5];
        let eye = &camera.camera_view_point;
        for (is, should) in [eye.x, eye.y, eye.z].into_iter().zip(expected) {
            assert!((is - should).abs() < 1e-3, "{eye:?}");
        }
        assert_eq!(camera.camera_direction, Vector { x: -1.0, y: 0.0, z: 0.0 });
        assert_eq!(camera.camera_up_vector, Vector { x: 0.0, y: 0.0, z: 1.0 });
        assert!(camera.field_of_view == 60.0);
        assert_eq!(camera.aspect_ratio.is_some(), version == Version::V3_0);

        let (state, view) = topics.values().find(|(topic, _)| topic.kind == "Issue").unwrap();
        assert!(state.title.starts_with("Post: loss of"), "{}", state.title);
        assert!(state.description.contains("\nWorst at: "), "{}", state.description);
        let component = &view.components.selection.component;
        assert_eq!(
            (&component.ifc_guid, component.authoring_tool_id.as_deref()),
            (&None, Some("W"))
        );

        // Another day: the same file but for the date of its making.
        let later = write("2026-06-01 09:00 UTC");
        let same = |text: &String| text.replace("2026-06-01T09:00:00Z", "2026-05-04T14:20:00Z");
        assert_eq!(
            later.iter().map(|(k, v)| (k.clone(), same(v))).collect::<BTreeMap<_, _>>(),
            files
        );
    }
}

#[test]
fn the_report_comes_with_its_topics_and_names_them() {
    let (scene, prediction) = predicted();
    let folder = tempfile::tempdir().unwrap();
    let mut document = Document::of(&scene, prediction);
    let provenance = Provenance { date: "2026-05-04 14:20 UTC".into(), ..Provenance::default() };
    write(folder.path(), &scene, &mut document, &[], None, &provenance, None).unwrap();
    let bytes = std::fs::read(folder.path().join("damage.bcf")).unwrap();
    let (prediction, basis) = (&document.prediction, &document.basis);
    let again = bcf(&scene, prediction, basis, &provenance.date, Version::default()).unwrap();
    assert!(bytes == again, "{} and {} bytes", bytes.len(), again.len());
    assert!(document.files.iter().any(|file| file.ends_with("damage.bcf")));
}

/// A program that lists topics shows what each looks like.
#[test]
fn a_defect_with_a_photograph_has_a_snapshot() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let grey = Picture { width: 8, height: 6, rgb: vec![90; 144], caption: String::new() };
    std::fs::write(at("crack.png"), grey.png().unwrap()).unwrap();
    std::fs::write(at("scene.ron"), SCENE).unwrap();
    let evidence = EVIDENCE.replace("along: 0.5,", "along: 0.5, picture: \"crack.png\",");
    std::fs::write(at("evidence.ron"), evidence).unwrap();
    let scene = Scene::load(&at("scene.ron"), &Job::default()).unwrap();
    let settings = PredictSettings { forecast: None, ..PredictSettings::default() };
    let prediction = predict(&scene, settings, &Sources::default(), &Job::default()).unwrap();
    let basis = Basis::of(&scene);
    for version in [Version::V2_1, Version::V3_0] {
        let bytes = bcf(&scene, &prediction, &basis, "2026-05-04 14:20 UTC", version).unwrap();
        let mut archive = ZipArchive::new(Cursor::new(bytes)).unwrap();
        let names: Vec<String> =
            archive.file_names().map(|name| name.unwrap().into_owned()).collect();
        let shown: Vec<&String> = names.iter().filter(|n| n.ends_with("/snapshot.png")).collect();
        let [snapshot] = shown[..] else { panic!("{names:?}") };
        let mut png = Vec::new();
        archive.by_name(snapshot).unwrap().read_to_end(&mut png).unwrap();
        assert_eq!(png[1..4], *b"PNG");
        let named = |folder: &str, archive: &mut ZipArchive<Cursor<Vec<u8>>>| {
            let mut text = String::new();
            let mut file = archive.by_name(&format!("{folder}/markup.bcf")).unwrap();
            file.read_to_string(&mut text).unwrap();
            text.contains("<Snapshot>snapshot.png</Snapshot>")
        };
        for name in names.iter().filter(|n| n.ends_with("/markup.bcf")) {
            let folder = name.trim_end_matches("/markup.bcf");
            assert_eq!(named(folder, &mut archive), snapshot.starts_with(folder));
        }
    }
}

/// Nobody looked at the post's neighbour without salt: that is no high priority.
#[test]
fn what_is_to_be_inspected_is_of_normal_priority() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("scene.ron"), SCENE).unwrap();
    let seen = r#"(schema: "intrados.evidence/1", items: [
        (member: "2O2Fr$t4X7Zf8NOew3FLOH", name: "a look", along: (0.0, 0.5), shows: Intact),
    ])"#;
    std::fs::write(at("evidence.ron"), seen).unwrap();
    let scene = Scene::load(&at("scene.ron"), &Job::default()).unwrap();
    let settings = PredictSettings { forecast: None, ..PredictSettings::default() };
    let prediction = predict(&scene, settings, &Sources::default(), &Job::default()).unwrap();
    let pier = &prediction.members[0];
    assert!(pier.to_inspect && pier.state_run.unwrap()[1] >= 2, "{pier:?}");
    let basis = Basis::of(&scene);
    let bytes = bcf(&scene, &prediction, &basis, "", Version::V2_1).unwrap();
    let topics = topics(&unpacked(&bytes), Version::V2_1);
    let [(topic, _)] = topics.values().collect::<Vec<_>>()[..] else { panic!("one topic") };
    assert_eq!(topic.priority.as_deref(), Some("Medium"));
    assert!(topic.title.contains("nothing found") && topic.description.contains("Inspect:"));
    assert!(!topic.description.contains("as poor"), "{}", topic.description);
}

/// Other programs know a crack again after the next inspection.
#[test]
fn a_defect_that_is_found_again_keeps_its_topic() {
    let again = r#"(
            member: "2O2Fr$t4X7Zf8NOew3FLOH", name: "crack, later", date: "2027-05-02", confirmed: true, along: 0.5, angle_deg: 90,
            shows: Crack(width_mm: 0.6, course: Across),
        ),
    ],
)"#;
    let later = EVIDENCE.trim_end().trim_end_matches(')').trim_end().trim_end_matches("],");
    let guids = |evidence: &str| {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("scene.ron"), SCENE).unwrap();
        std::fs::write(at("evidence.ron"), evidence).unwrap();
        let scene = Scene::load(&at("scene.ron"), &Job::default()).unwrap();
        let settings = PredictSettings { forecast: None, ..PredictSettings::default() };
        let prediction = predict(&scene, settings, &Sources::default(), &Job::default()).unwrap();
        let basis = Basis::of(&scene);
        let bytes = bcf(&scene, &prediction, &basis, "", Version::V2_1).unwrap();
        let topics = topics(&unpacked(&bytes), Version::V2_1);
        let defects = topics.into_values().filter(|(topic, _)| topic.kind == "Defect");
        let mut found: Vec<(String, String)> = defects.map(|(t, _)| (t.guid, t.title)).collect();
        found.sort();
        found
    };
    let [before, after] = [guids(EVIDENCE), guids(&format!("{later}{again}"))];
    let ids = |found: &[(String, String)]| found.iter().map(|f| f.0.clone()).collect::<Vec<_>>();
    assert_eq!((before.len(), ids(&before)), (2, ids(&after)));
    assert!(after.iter().any(|(_, title)| title.contains("0.60 mm (2027)")), "{after:?}");
}
