//! Files that mean harm, or were made in a hurry: what they name, what their extensions say, what
//! they ask for.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::{fs, path::Path};

use intrados_scene::{
    LoadError, Scene,
    gltf::{self, Severity},
};
use intrados_stage::{Access, Job};
use serde_json::{Value, json};
use tempfile::TempDir;

/// A model of one triangle, with `change` made to its JSON.
fn triangle(change: impl FnOnce(&mut Value)) -> Value {
    let mut model = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] }], "materials": [{}],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" }],
    });
    change(&mut model);
    model
}

/// A material with an extension.
fn material(name: &str, extension: Value) -> Value {
    triangle(|model| {
        model["extensionsUsed"] = json!([name]);
        model["materials"][0]["extensions"] = json!({ name: extension });
    })
}

/// A light at the node.
fn light(light: Value) -> Value {
    triangle(|model| {
        model["extensionsUsed"] = json!(["KHR_lights_punctual"]);
        model["extensions"] = json!({ "KHR_lights_punctual": { "lights": [light] } });
        model["nodes"][0]["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
    })
}

fn write(folder: &Path, model: &Value) -> std::path::PathBuf {
    let path = folder.join("model.gltf");
    fs::write(&path, model.to_string()).unwrap();
    path
}

/// Places of the errors that `validate` names; the import must tell of each too.
fn errors(model: &Value) -> Vec<String> {
    let folder = TempDir::new().unwrap();
    let path = write(folder.path(), model);
    let problems = gltf::validate(&path, &Job::default()).unwrap();
    let errors: Vec<_> = problems.iter().filter(|p| p.severity == Severity::Error).collect();
    match gltf::import(&path, &Job::default()) {
        Ok(model) => assert!(
            errors.iter().all(|p| model.warnings.contains(&p.to_string())),
            "{errors:?} {:?}",
            model.warnings
        ),
        Err(error) => assert!(errors.iter().any(|p| p.blocks_geometry()), "{error}"),
    }
    errors.into_iter().map(|p| p.place.to_string()).collect()
}

#[test]
fn faults_in_extensions_are_named() {
    let materials = "/materials/0/extensions";
    for (name, extension, place) in [
        ("KHR_materials_emissive_strength", json!({ "emissiveStrength": -1 }), "/emissiveStrength"),
        ("KHR_materials_ior", json!({ "ior": 0.5 }), "/ior"),
        ("KHR_materials_ior", json!({ "ior": -3 }), "/ior"),
        ("KHR_materials_transmission", json!({ "transmissionFactor": 7 }), "/transmissionFactor"),
        (
            "KHR_materials_transmission",
            json!({ "transmissionTexture": { "index": 3 } }),
            "/transmissionTexture/index",
        ),
        ("KHR_materials_volume", json!({ "attenuationDistance": 0 }), "/attenuationDistance"),
        ("KHR_materials_volume", json!({ "thicknessFactor": -0.1 }), "/thicknessFactor"),
        ("KHR_materials_specular", json!({ "specularFactor": 2 }), "/specularFactor"),
        (
            "KHR_materials_specular",
            json!({ "specularColorFactor": [1, 1] }),
            "/specularColorFactor",
        ),
        ("KHR_materials_clearcoat", json!({ "clearcoatFactor": "much" }), "/clearcoatFactor"),
        ("KHR_materials_sheen", json!({ "sheenColorFactor": [0, 2, 0] }), "/sheenColorFactor/1"),
        ("KHR_materials_iridescence", json!({ "iridescenceIor": 0.9 }), "/iridescenceIor"),
        ("KHR_materials_anisotropy", json!({ "anisotropyStrength": -1 }), "/anisotropyStrength"),
        ("KHR_materials_dispersion", json!({ "dispersion": -1 }), "/dispersion"),
        (
            "KHR_materials_pbrSpecularGlossiness",
            json!({ "diffuseFactor": [1, 1, 1] }),
            "/diffuseFactor",
        ),
        ("KHR_materials_unlit", json!([]), ""),
    ] {
        assert_eq!(errors(&material(name, extension)), [format!("{materials}/{name}{place}")]);
    }
    let lights = "/extensions/KHR_lights_punctual/lights/0";
    for (json, place) in [
        (json!({ "type": "laser" }), "/type"),
        (json!({ "type": "point", "intensity": -5 }), "/intensity"),
        (json!({ "type": "point", "range": 0 }), "/range"),
        (json!({ "type": "point", "color": [0.5, 2, 0] }), "/color/1"),
        (json!({ "type": "spot" }), ""),
        (
            json!({ "type": "spot", "spot": { "innerConeAngle": 1, "outerConeAngle": 0.5 } }),
            "/spot",
        ),
        (json!({ "type": "spot", "spot": { "outerConeAngle": 2 } }), "/spot/outerConeAngle"),
        (json!({}), ""),
    ] {
        assert_eq!(errors(&light(json)), [format!("{lights}{place}")]);
    }
    let mut lost = light(json!({ "type": "point" }));
    lost["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = json!(99);
    assert_eq!(errors(&lost), ["/nodes/0/extensions/KHR_lights_punctual/light"]);
    // Our own words have types too.
    let extras = triangle(|model| {
        model["nodes"][0]["extras"] = json!({ "intrados": { "member": 7, "note": "anything" } })
    });
    assert_eq!(errors(&extras), ["/nodes/0/extras/intrados/member"]);
}

#[test]
fn what_extensions_may_say_is_fine() {
    for (name, extension) in [
        ("KHR_materials_ior", json!({ "ior": 0 })),
        ("KHR_materials_ior", json!({ "ior": 1 })),
        ("KHR_materials_emissive_strength", json!({ "emissiveStrength": 1e6 })),
        ("KHR_materials_volume", json!({ "attenuationDistance": 0.01, "extras": { "own": 1 } })),
        ("KHR_materials_unlit", json!({})),
    ] {
        assert_eq!(errors(&material(name, extension)), [""; 0]);
    }
    // A right angle in single precision is more than one in double precision.
    let wide = json!({ "type": "spot", "spot": { "innerConeAngle": 0, "outerConeAngle": std::f32::consts::FRAC_PI_2 }, "intensity": 0 });
    assert_eq!(errors(&light(wide)), [""; 0]);
}

#[test]
fn what_is_not_checked_is_said() {
    let folder = TempDir::new().unwrap();
    let path = write(folder.path(), &material("ACME_paint", json!({ "thickness": -1 })));
    let problems = gltf::validate(&path, &Job::default()).unwrap();
    let notes: Vec<_> = problems.iter().filter(|p| p.severity == Severity::Note).collect();
    assert!(
        problems.len() == 1 && notes[0].message.contains("ACME_paint is neither read nor checked"),
        "{problems:?}"
    );
}

/// Three hundred million zeros that no byte stands for took eleven seconds to look at: they are
/// refused before the first.
#[test]
fn zeros_that_no_byte_stands_for_are_few() {
    let zeros = |count: u64| {
        triangle(|model| {
            let sparse = json!({ "count": 1, "indices": { "bufferView": 0, "componentType": 5125 }, "values": { "bufferView": 0 } });
            model["accessors"][0] = json!({ "componentType": 5126, "count": count, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0], "sparse": sparse });
        })
    };
    assert_eq!(errors(&zeros(300_000_000)), ["/"]);
    assert_eq!(errors(&zeros(300_000)), [""; 0]);
}

/// A scene beside which nothing lies but what `body` names.
fn scene(folder: &Path, body: &str) -> std::path::PathBuf {
    let path = folder.join("scene.ron");
    fs::write(&path, format!("(schema: \"intrados.scene/1\", {body})")).unwrap();
    path
}

fn refusal(path: &Path, access: &Access) -> String {
    match Scene::open_within(path, access, &Job::default()) {
        Err(LoadError::BadInput(problems)) => problems[0].to_string(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_scene_reads_beside_itself_and_where_it_is_allowed() {
    let (ours, theirs) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let far = theirs.path().join("mesh.obj");
    fs::write(&far, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    fs::copy(&far, ours.path().join("mesh.obj")).unwrap();
    fs::write(theirs.path().join("s1.png"), "no picture").unwrap();
    fs::write(theirs.path().join("own.ron"), "()").unwrap();
    let strict = Access::default();
    let mesh = |file: &str| {
        format!("shapes: [Quad(corner: (0,0,0), u: (1,0,0), v: (0,1,0)), Mesh(file: {file:?})]")
    };
    assert!(Scene::open(&scene(ours.path(), &mesh("mesh.obj")), &Job::default()).is_ok());

    let column =
        "id: \"C\", body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3)";
    let of = |name: &str| theirs.path().join(name).display().to_string();
    let slices = format!(
        "members: [({column}, slices: [Files(name: \"a\", images: [{:?}], pixel_mm: 0.1)])]",
        of("*.png")
    );
    for (body, place) in [
        (mesh(&of("mesh.obj")), "shapes[1]"),
        (format!("materials: [(name: \"m\", texture: {:?})]", of("s1.png")), "materials[0]"),
        (format!("models: [(file: {:?})]", of("own.ron")), "models[0]"),
        (format!("lamps: [Environment(image: {:?})]", of("s1.png")), "lamps[0]"),
        (slices, "members[0]"),
        (format!("grading: (profile: {:?})", of("own.ron")), "grading"),
    ] {
        let refused = refusal(&scene(ours.path(), &body), &strict);
        let folder = theirs.path().canonicalize().unwrap();
        assert!(
            refused.contains(place) && refused.contains(&format!("--allow {}", folder.display())),
            "{refused}"
        );
    }
    // Up and down again is the same place, and so is a link.
    let round = format!("../{}/mesh.obj", theirs.path().file_name().unwrap().to_string_lossy());
    assert!(refusal(&scene(ours.path(), &mesh(&round)), &strict).contains("lies outside"));
    let allowed = Access::new(vec![theirs.path().into()]);
    assert!(
        Scene::open_within(&scene(ours.path(), &mesh(&round)), &allowed, &Job::default()).is_ok()
    );
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_keep_nobody_waiting() {
    let folder = TempDir::new().unwrap();
    let pipe = folder.path().join("pipe.obj");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let everything = Access::new(vec!["/".into()]);
    for file in ["pipe.obj", "/dev/urandom", "/dev/zero"] {
        let path = scene(folder.path(), &format!("shapes: [Mesh(file: {file:?})]"));
        assert!(refusal(&path, &everything).contains("no plain file"));
        let path = scene(folder.path(), &format!("models: [(file: {file:?})]"));
        assert!(refusal(&path, &everything).contains("no plain file"));
    }
    // Nor where the user names them, nor as properties beside a model.
    let given = folder.path().join("given.ron");
    fs::rename(&pipe, &given).unwrap();
    assert!(refusal(&given, &everything).contains("no plain file"));
    fs::rename(&given, folder.path().join("model.props.json")).unwrap();
    let model = gltf::import(&write(folder.path(), &triangle(|_| {})), &Job::default()).unwrap();
    assert!(
        model.warnings.iter().any(|w| w.contains("model.props.json is no plain file")),
        "{:?}",
        model.warnings
    );
}

/// A packed picture of some hundred kilobytes can have a thousand million texels.
#[test]
fn a_picture_cannot_ask_for_much_memory() {
    let folder = TempDir::new().unwrap();
    // A PNG header alone: what it says is enough to refuse it.
    let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x40\0\0\0\x40\0\x08\0\0\0\0".to_vec();
    let mut crc = !0_u32;
    for &byte in &png[12..] {
        crc ^= u32::from(byte);
        (0..8).for_each(|_| crc = if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 });
    }
    png.extend((!crc).to_be_bytes());
    png.extend(b"\0\0\0\0IDAT\x35\xaf\x06\x1e");
    fs::write(folder.path().join("bomb.png"), png).unwrap();
    let path = scene(folder.path(), "materials: [(name: \"m\", texture: \"bomb.png\")]");
    let refused = refusal(&path, &Access::default());
    assert!(refused.contains("16384 × 16384 texels, beyond the limit"), "{refused}");
}

/// Ignored, since nothing can be said without them:
/// `INTRADOS_DATA=… cargo test --release --workspace -- --ignored with_data`.
mod with_data {
    use super::*;

    /// Faults in extensions that validators passed, as others wrote them.
    #[test]
    #[ignore = "needs INTRADOS_DATA"]
    fn files_that_were_passed_are_refused() {
        let data = std::env::var_os("INTRADOS_DATA")
            .expect("INTRADOS_DATA must name the folder of test data");
        let mut refused = 0;
        for path in Path::new(&data)
            .join("hostile/files")
            .read_dir()
            .unwrap()
            .map(|entry| entry.unwrap().path())
        {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if name.ends_with(".gltf") {
                let problems = gltf::validate(&path, &Job::default()).unwrap();
                assert!(
                    problems.iter().any(|p| p.severity == Severity::Error),
                    "{name}: {problems:?}"
                );
                refused += 1;
            }
        }
        assert_eq!(refused, 11);
    }
}
