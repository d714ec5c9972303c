//! Damaged on purpose: files of our own writer with flipped bytes, missing ends and exchanged
//! values neither panic nor come in wrong.

use std::{
    fs,
    path::Path,
    sync::{Arc, LazyLock},
};

use glam::{Mat4, Vec2, Vec3};
use intrados_scene::{
    Camera, Lamp, LampKind, Material, Mesh, Object, Part, Texture, TextureRef, Wrap,
    gltf::{self, ImportError, Model, Severity},
};
use intrados_stage::Job;
use proptest::{collection::vec, prelude::*, sample::Index};
use serde_json::{Value, json};
use tempfile::TempDir;

/// A small file with every kind of list.
fn seed() -> Model {
    let quad = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X + Vec3::Y],
        normals: vec![Vec3::Z; 4],
        tangents: vec![Vec3::X.extend(1.0); 4],
        uv: [vec![Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE], Vec::new()],
        colours: vec![Vec3::ONE; 4],
        triangles: vec![[0, 1, 2], [2, 1, 3]],
    };
    let texture = TextureRef { texture: 0, set: 0, transform: glam::Affine2::IDENTITY };
    let material = Material {
        assumed: false,
        base_texture: Some(texture),
        emission: Vec3::ONE,
        ..Material::default()
    };
    let object = |name: &str, transform| Object {
        name: name.into(),
        mesh: 0,
        transform,
        material: 0,
        member: None,
        part: Part::Scenery,
    };
    Model {
        meshes: vec![Arc::new(quad)],
        objects: vec![
            object("COL_1", Mat4::IDENTITY),
            object("BEAM_1", Mat4::from_scale(Vec3::splat(-2.0))),
        ],
        materials: vec![material],
        textures: vec![Texture {
            width: 1,
            height: 2,
            texels: vec![Vec3::ONE, Vec3::ZERO],
            wrap: [Wrap::Clamp; 2],
        }],
        lamps: vec![Lamp {
            name: "l".into(),
            kind: LampKind::Point { position: Vec3::Y, intensity: Vec3::ONE },
        }],
        cameras: vec![Camera {
            name: "c".into(),
            position: Vec3::Z,
            target: Vec3::ZERO,
            up: Vec3::Y,
            fov_deg: 40.0,
            width: 16,
            height: 9,
            exposure: 0.0,
            lens: None,
        }],
        ..Model::default()
    }
}

static SEED: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("seed.glb");
    gltf::write_glb(&path, &seed()).expect("written");
    fs::read(path).expect("read")
});

/// The JSON of the seed as an object of its own, with its binary chunk embedded, and with skins and
/// animations besides.
fn seed_json() -> Value {
    let bytes = &*SEED;
    let size = u32::from_le_bytes(bytes[12..16].try_into().expect("four")) as usize;
    let mut json: Value = serde_json::from_slice(&bytes[20..20 + size]).expect("JSON");
    use base64::Engine;
    let data = base64::prelude::BASE64_STANDARD.encode(&bytes[28 + size..]);
    json["buffers"][0]["uri"] = format!("data:application/octet-stream;base64,{data}").into();
    let accessors = json["accessors"].as_array_mut().expect("a list");
    let first = accessors.len();
    accessors.push(
        json!({ "componentType": 5126, "count": 1, "type": "SCALAR", "min": [0], "max": [0] }),
    );
    accessors
        .push(json!({ "componentType": 5126, "count": 1, "type": "VEC3", "sparse": { "count": 1,
        "indices": { "bufferView": 0, "componentType": 5121 }, "values": { "bufferView": 0 } } }));
    json["animations"] = json!([{ "samplers": [{ "input": first, "output": first + 1 }],
        "channels": [{ "sampler": 0, "target": { "node": 2, "path": "translation" } }] }]);
    json["skins"] = json!([{ "joints": [0] }]);
    json
}

/// Imports and validates; what comes in holds together, what does not is said in one line.
fn examine(path: &Path) -> Result<(), TestCaseError> {
    let problems =
        gltf::validate(path, &Job::default()).map_err(|e| TestCaseError::fail(e.to_string()))?;
    match gltf::import(path, &Job::default()) {
        Ok(model) => {
            prop_assert!(!problems.iter().any(|p| p.blocks_geometry()), "{problems:?}");
            for mesh in &model.meshes {
                let n = mesh.positions.len();
                prop_assert!(mesh.triangles.iter().flatten().all(|&v| (v as usize) < n));
                prop_assert!(mesh.positions.iter().all(|p| p.is_finite()));
                for length in [
                    mesh.normals.len(),
                    mesh.tangents.len(),
                    mesh.uv[0].len(),
                    mesh.uv[1].len(),
                    mesh.colours.len(),
                ] {
                    prop_assert!(length == 0 || length == n);
                }
            }
            for object in &model.objects {
                prop_assert!(
                    object.mesh < model.meshes.len()
                        && object.material < model.materials.len()
                        && object.transform.is_finite()
                );
                prop_assert!(object.member.is_none_or(|m| m < model.members.len()));
            }
            for texture in &model.textures {
                prop_assert_eq!(texture.texels.len(), texture.width * texture.height);
            }
            for lamp in &model.lamps {
                if let LampKind::Point { position, intensity } = lamp.kind {
                    prop_assert!(
                        position.is_finite()
                            && intensity.is_finite()
                            && intensity.min_element() >= 0.0
                    );
                }
            }
        }
        Err(ImportError::Damaged { problem, .. }) => {
            prop_assert!(
                problem.severity == Severity::Error && !problem.to_string().contains('\n'),
                "{problem}"
            );
        }
        Err(error) => prop_assert!(false, "{error}"),
    }
    Ok(())
}

/// Pointers to all values of a document.
fn pointers(json: &Value, at: String, found: &mut Vec<String>) {
    match json {
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(i, v)| pointers(v, format!("{at}/{i}"), found))
        }
        Value::Object(map) => map.iter().for_each(|(k, v)| {
            pointers(v, format!("{at}/{}", k.replace('~', "~0").replace('/', "~1")), found)
        }),
        _ => {}
    }
    found.push(at);
}

fn value() -> impl Strategy<Value = Value> {
    prop_oneof![
        Just(Value::Null),
        any::<bool>().prop_map(Value::from),
        (-3_i64..20).prop_map(Value::from),
        any::<u64>().prop_map(Value::from),
        any::<f64>().prop_map(Value::from),
        prop_oneof![
            Just(5120),
            Just(5121),
            Just(5123),
            Just(5125),
            Just(5126),
            Just(34962),
            Just(34963)
        ]
        .prop_map(Value::from),
        prop_oneof!["", "[a-z:/%.]{0,8}", "data:[a-z/;,]{0,12}", "VEC[234]", "MAT[234]", "SCALAR"]
            .prop_map(Value::from),
        Just(json!([])),
        Just(json!({})),
        vec(-2.0..2.0_f64, 1..17).prop_map(Value::from),
        vec(0_u32..4, 1..5).prop_map(Value::from),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(7), ..ProptestConfig::default() })]

    #[test]
    fn flipped_and_missing_bytes(flips in vec((any::<Index>(), any::<u8>()), 0..6), end in any::<Index>(), cut in any::<bool>()) {
        let mut bytes = SEED.clone();
        for (at, value) in &flips {
            let at = at.index(bytes.len());
            bytes[at] = *value;
        }
        if cut {
            bytes.truncate(end.index(bytes.len()));
        }
        let folder = TempDir::new().expect("a folder");
        let path = folder.path().join("damaged.glb");
        fs::write(&path, bytes).expect("written");
        examine(&path)?;
    }

    #[test]
    fn exchanged_values(changes in vec((any::<Index>(), value()), 1..4)) {
        let mut json = seed_json();
        for (at, value) in changes {
            let mut places = Vec::new();
            pointers(&json, String::new(), &mut places);
            if let Some(place) = json.pointer_mut(&places[at.index(places.len())]) {
                *place = value;
            }
        }
        let folder = TempDir::new().expect("a folder");
        let path = folder.path().join("damaged.gltf");
        fs::write(&path, json.to_string()).expect("written");
        examine(&path)?;
    }
}

#[test]
fn the_seeds_are_legal() {
    let folder = TempDir::new().expect("a folder");
    for (name, bytes) in
        [("seed.glb", SEED.clone()), ("seed.gltf", seed_json().to_string().into_bytes())]
    {
        let path = folder.path().join(name);
        fs::write(&path, bytes).expect("written");
        let problems = gltf::validate(&path, &Job::default()).expect("readable");
        assert!(problems.iter().all(|p| p.severity == Severity::Warning), "{problems:?}");
        assert_eq!(gltf::import(&path, &Job::default()).expect("legal").objects.len(), 2);
    }
}
