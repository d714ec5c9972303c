//! glTF files: what each file of the folder becomes, and relatives of our own making.

use std::fs;

use serde_json::{Value, json};

use crate::{
    hostile,
    obj::{Case, check, import},
};

const COLUMN: [f64; 4] = [4.0, 0.4, 0.4, 0.64];
const QUIET: &[&str] = &["!is z up", "!--unit", "!left out"];

#[test]
#[ignore = "with_data: reads INTRADOS_DATA/hostile"]
fn every_file_of_the_folder_with_data() {
    let one: &[(&str, [f64; 4])] = &[("COL_1", COLUMN)];
    let cases: &[Case] = &[
        ("plain.gltf", &[], one, QUIET),
        ("plain.glb", &[], one, QUIET),
        (
            "blender_names.gltf",
            &[],
            &[("Column.000", COLUMN), ("Column.001", COLUMN), ("Column.002", COLUMN)],
            &["!no structural members"],
        ),
        ("camera_aspect0.gltf", &[], one, &["aspectRatio"]),
        ("camera_yfov0.gltf", &[], one, &["yfov"]),
        (
            "cm_no_scale.gltf",
            &[],
            &[("COL_1", [400.0, 40.0, 40.0, 640_000.0])],
            &["\"COL_1\" is 400.00 m long", "cm (4.00 m)", "--unit"],
        ),
        ("cm_no_scale.gltf", &["--unit", "cm"], one, QUIET),
        ("double_faces.gltf", &[], one, QUIET),
        ("draco_optional_with_fallback.gltf", &[], one, QUIET),
        ("draco_required.gltf", &[], &[], &["KHR_draco_mesh_compression", "Draco"]),
        ("ext_space.gltf", &[], one, QUIET),
        ("fan_six_primitives.gltf", &[], one, QUIET),
        ("idx_u32.gltf", &[], one, QUIET),
        ("idx_u8.gltf", &[], one, QUIET),
        ("index_out.gltf", &[], &[], &["is not below the 8 vertices"]),
        (
            "instancing_optional.gltf",
            &[],
            &[("COL_1", COLUMN), ("COL_1 #2", COLUMN), ("COL_1 #3", COLUMN)],
            QUIET,
        ),
        ("interleaved.gltf", &[], one, QUIET),
        (
            "large_root.gltf",
            &[],
            &[("COL_0", COLUMN), ("COL_1", COLUMN), ("COL_2", COLUMN)],
            &["!single precision", "!keeps them"],
        ),
        (
            "large_vertices.gltf",
            &[],
            &[
                ("COL_0", [4.0, 0.38, 0.39, 0.586]),
                ("COL_1", [4.0, 0.38, 0.39, 0.586]),
                ("COL_2", [4.0, 0.38, 0.41, 0.609]),
            ],
            &["the file keeps them to 31 mm only"],
        ),
        ("mm_no_scale.gltf", &[], &[], &["4.0 km long", "--unit mm"]),
        ("mm_no_scale.gltf", &["--unit", "mm"], one, QUIET),
        ("morph.gltf", &[], one, &["morph targets are not applied"]),
        ("neg_matrix.gltf", &[], one, QUIET),
        ("neg_scale.gltf", &[], one, QUIET),
        ("no_indices.gltf", &[], one, QUIET),
        ("quantized.gltf", &[], one, QUIET),
        ("root_scale_mm.gltf", &[], one, QUIET),
        ("same_names.gltf", &[], &[("COL", COLUMN), ("COL #2", COLUMN), ("COL #3", COLUMN)], &[]),
        ("scene1.gltf", &[], &[("COL_2", COLUMN)], &["2 scenes; only the default one is read"]),
        ("soup_gaps.gltf", &[], one, QUIET),
        ("sparse.gltf", &[], &[("COL_1", [6.0, 0.4, 0.4, 0.96])], QUIET),
        ("strip.gltf", &[], one, QUIET),
        ("strip_restart.gltf", &[], &[], &["restart"]),
        ("two_primitives.gltf", &[], one, QUIET),
        ("unlit.gltf", &[], one, QUIET),
    ];
    for case in cases {
        check(&hostile("public/gltf").join(case.0), case);
    }
    // Columns stand as far from each other as their nodes say, wherever their root is.
    let found = import(&hostile("public/gltf/large_root.gltf"), &[]);
    assert!((found.extent[0] - 5.14).abs() < 1e-4, "{:?}", found.extent);
    assert_eq!(found.offset.map(f64::round), found.offset);
    assert!((found.offset[2] + 5_934_567.0).abs() < 2.0, "{:?}", found.offset);
    let found = import(&hostile("public/gltf/instancing_optional.gltf"), &[]);
    assert!(found.extent[0] > 3.0, "{:?}", found.extent);
    let files = fs::read_dir(hostile("public/gltf")).unwrap();
    let known = files.filter(|f| {
        let name = f.as_ref().unwrap().file_name();
        !name.to_string_lossy().ends_with(".bin")
    });
    let seen: std::collections::BTreeSet<&str> = cases.iter().map(|c| c.0).collect();
    assert_eq!(seen.len(), known.count(), "a file of the folder is in no case");
}

/// A glTF file of one unit cube's mesh, with further accessors of single precision; nodes, what is
/// of the root besides.
struct Model {
    bytes: Vec<u8>,
    accessors: Vec<Value>,
    views: Vec<Value>,
}

impl Model {
    /// A cuboid from the origin.
    fn new(size: [f32; 3]) -> Self {
        let mut model = Self { bytes: Vec::new(), accessors: Vec::new(), views: Vec::new() };
        let corners: Vec<[f32; 3]> = (0..8)
            .map(|k| [0, 1, 2].map(|i| if k >> i & 1 == 1 { size[i] } else { 0.0 }))
            .collect();
        model.put("VEC3", &corners.concat(), json!({ "min": [0, 0, 0], "max": size }));
        let quads = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5_u16],
        ];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]);
        let at = model.bytes.len();
        triangles.for_each(|i| model.bytes.extend(i.to_le_bytes()));
        model.views.push(json!({ "buffer": 0, "byteOffset": at, "byteLength": 72 }));
        model
            .accessors
            .push(json!({ "componentType": 5123, "type": "SCALAR", "count": 36, "bufferView": 1 }));
        model
    }

    /// A further accessor; gives its index.
    fn put(&mut self, kind: &str, values: &[f32], more: Value) -> usize {
        let (at, width) = (self.bytes.len(), if kind == "VEC4" { 4 } else { 3 });
        values.iter().for_each(|x| self.bytes.extend(x.to_le_bytes()));
        self.views.push(json!({ "buffer": 0, "byteOffset": at, "byteLength": 4 * values.len() }));
        let mut accessor = json!({
            "componentType": 5126, "type": kind, "count": values.len() / width,
            "bufferView": self.views.len() - 1
        });
        if let (Some(own), Some(more)) = (accessor.as_object_mut(), more.as_object()) {
            own.extend(more.clone());
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn text(&self, nodes: Value, used: &[&str]) -> String {
        let roots: Vec<usize> = (0..nodes.as_array().unwrap().len())
            .filter(|i| {
                !nodes
                    .as_array()
                    .unwrap()
                    .iter()
                    .any(|n| n["children"].as_array().is_some_and(|c| c.contains(&json!(i))))
            })
            .collect();
        json!({
            "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": roots }],
            "nodes": nodes,
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
            "accessors": self.accessors, "bufferViews": self.views,
            "buffers": [{ "byteLength": self.bytes.len(), "uri": "cube.bin" }],
            "extensionsUsed": used,
        })
        .to_string()
    }
}

/// Relatives: instances that turn and are scaled, of an assembly, required; roots far off above other
/// nodes; what is hidden, alone and with what is below it; slabs that stand.
#[test]
fn relatives_of_the_folder() {
    let place = tempfile::tempdir().unwrap();
    let column = || Model::new([0.4, 4.0, 0.4]);
    let three: &[(&str, [f64; 4])] =
        &[("COL_1", COLUMN), ("COL_1 #2", COLUMN), ("COL_1 #3", COLUMN)];
    let mut turned = column();
    let moved = turned.put("VEC3", &[0., 0., 0., 3., 0., 0., 6., 0., 0.], json!({}));
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let quarter = [0., 0., 0., 1., 0., half, 0., half, 0., 1., 0., 0.];
    let turn = turned.put("VEC4", &quarter, json!({}));
    let mut tall = column();
    let scale = tall.put("VEC3", &[1., 1., 1., 1., 1.5, 1.], json!({}));
    let step = tall.put("VEC3", &[0., 0., 0., 5., 0., 0.], json!({}));
    let instances =
        |attributes: Value| json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    let hide = json!({ "KHR_node_visibility": { "visible": false } });
    let far = json!([
        { "name": "site", "translation": [652469.031, 212.5, -6862035.187], "children": [1] },
        { "name": "storey", "rotation": [0, half, 0, half], "children": [2, 3] },
        { "name": "COL_1", "mesh": 0 },
        { "name": "COL_2", "mesh": 0, "translation": [7.31, 0, 0] }
    ]);
    let hidden = json!([
        { "name": "COL_1", "mesh": 0 },
        { "name": "formwork", "extensions": hide, "children": [2] },
        { "name": "COL_2", "mesh": 0, "translation": [3, 0, 0] },
        { "name": "COL_3", "mesh": 0, "translation": [6, 0, 0], "extensions": hide }
    ]);
    let cases: Vec<(&str, String, Model, Case)> = vec![
        (
            "turned",
            turned.text(
                json!([{ "name": "COL_1", "mesh": 0,
                    "extensions": instances(json!({ "TRANSLATION": moved, "ROTATION": turn })) }]),
                &["EXT_mesh_gpu_instancing"],
            ),
            turned,
            ("", &[], three, QUIET),
        ),
        (
            "scaled",
            tall.text(
                json!([{ "name": "Column A", "mesh": 0,
                    "extensions": instances(json!({ "TRANSLATION": step, "SCALE": scale })) }]),
                &["EXT_mesh_gpu_instancing"],
            ),
            tall,
            ("", &[], &[("Column A", COLUMN), ("Column A #2", [6.0, 0.4, 0.4, 0.96])], QUIET),
        ),
        (
            "far",
            column().text(far, &[]),
            column(),
            ("", &[], &[("COL_1", COLUMN), ("COL_2", COLUMN)], &["!single precision"]),
        ),
        (
            "hidden",
            column().text(hidden, &["KHR_node_visibility"]),
            column(),
            ("", &[], &[("COL_1", COLUMN)], &["2 nodes, \"formwork\" the first, are hidden"]),
        ),
        (
            "z up",
            Model::new([6.0, 5.0, 0.2]).text(json!([{ "name": "SLAB_1", "mesh": 0 }]), &[]),
            Model::new([6.0, 5.0, 0.2]),
            ("", &["--up", "z"], &[("SLAB_1", [6.0, 0.2, 5.0, 6.0])], QUIET),
        ),
        (
            "nothing named",
            column().text(json!([{ "name": "Mesh.001", "mesh": 0 }]), &[]),
            column(),
            ("", &[], &[], &["scenery", "Mesh.001", "name nodes for what they are"]),
        ),
    ];
    for (name, text, model, case) in cases {
        fs::write(place.path().join("cube.bin"), &model.bytes).unwrap();
        let path = place.path().join(format!("{name}.gltf"));
        fs::write(&path, text).unwrap();
        check(&path, &(name, case.1, case.2, case.3));
        if name == "far" {
            let found = import(&path, &[]);
            assert!((found.extent[2] - 7.71).abs() < 1e-4, "{:?}", found.extent);
        }
        if name == "z up" {
            let said = import(&path, &[]).said;
            assert!(said.contains("stands") && said.contains("--up z"), "{said}");
        }
    }
    // A table of instances whose columns are not as long as each other is refused.
    let mut uneven = column();
    let three = uneven.put("VEC3", &[0.0; 9], json!({}));
    let two = uneven.put("VEC3", &[1.0; 6], json!({}));
    let nodes = json!([{ "name": "COL_1", "mesh": 0,
        "extensions": instances(json!({ "TRANSLATION": three, "SCALE": two })) }]);
    fs::write(place.path().join("cube.bin"), &uneven.bytes).unwrap();
    let path = place.path().join("uneven.gltf");
    fs::write(&path, uneven.text(nodes, &["EXT_mesh_gpu_instancing"])).unwrap();
    check(&path, &("uneven", &[], &[], &["type or count"]));
}
