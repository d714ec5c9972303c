//! The readers, each from a file to the end of the way that a user takes with it, and what they are
//! fed with.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{Arc, LazyLock},
};

use glam::{Mat4, Vec2, Vec3};
use intrados_damage::grading::Profile;
use intrados_light::{LitScene, Render, RenderSettings, Sensor, learn, scene_rule};
use intrados_mechanics::{
    deck::Case,
    linear::{Groups, parse_mesh},
    member::{Meshing, prepare},
    read::{Units, abaqus},
};
use intrados_scene::{
    Camera, CrackSurface, Lamp, LampKind, Material, Member, MemberKind, Mesh, Mouth, Object, Part,
    Scene, Spalled, Surface, SurfaceDamage, SurfaceFile, Texture, TextureRef, Wrap, bundled,
    gltf::{self, Model},
    parametric,
};
use intrados_stage::Job;
use intrados_transport::{Schedule, Steering};
use intrados_xray::volume::{Depth, Grid, Reader as Volumes, Writer};

/// One way of bytes into the program.
pub(crate) struct Reader {
    pub(crate) name: &'static str,
    /// Of the file that the bytes are put into.
    pub(crate) extension: &'static str,
    /// Reads the file. Whatever comes of it is right, so long as something does.
    pub(crate) reads: fn(&Path),
    /// What is good, and what once went wrong.
    pub(crate) corpus: fn() -> Vec<Vec<u8>>,
    /// Damaged inputs in the gate.
    pub(crate) cases: u64,
}

pub(crate) const READERS: [Reader; 21] = [
    Reader { name: "scene", extension: "ron", reads: scene, corpus: scenes, cases: 300 },
    Reader { name: "model", extension: "glb", reads: model, corpus: models, cases: 300 },
    Reader {
        name: "properties",
        extension: "props.json",
        reads: properties,
        corpus: lists_of_properties,
        cases: 100,
    },
    Reader { name: "mesh", extension: "obj", reads: mesh, corpus: meshes, cases: 200 },
    Reader { name: "picture", extension: "png", reads: picture, corpus: pictures, cases: 200 },
    Reader { name: "slices", extension: "tif", reads: volume, corpus: slices, cases: 400 },
    Reader { name: "volume", extension: "mha", reads: volume, corpus: volumes, cases: 400 },
    Reader { name: "evidence", extension: "ron", reads: evidence, corpus: skeletons, cases: 300 },
    Reader { name: "table", extension: "csv", reads: table, corpus: tables, cases: 300 },
    Reader { name: "profile", extension: "ron", reads: profile, corpus: profiles, cases: 200 },
    Reader {
        name: "cracks",
        extension: "json",
        reads: cracks,
        corpus: lists_of_cracks,
        cases: 100,
    },
    Reader { name: "deck", extension: "inp", reads: deck, corpus: decks, cases: 400 },
    Reader {
        name: "gmsh",
        extension: "msh",
        reads: mesh_of_gmsh,
        corpus: meshes_of_gmsh,
        cases: 400,
    },
    Reader {
        name: "photograph",
        extension: "jpg",
        reads: photograph,
        corpus: photographs,
        cases: 300,
    },
    Reader { name: "dicom", extension: "dcm", reads: volume, corpus: dicoms, cases: 400 },
    Reader { name: "sinogram", extension: "tif", reads: sinogram, corpus: sinograms, cases: 200 },
    Reader { name: "picks", extension: "csv", reads: picks, corpus: lists_of_picks, cases: 300 },
    Reader { name: "colmap", extension: "txt", reads: colmap, corpus: lists_of_poses, cases: 300 },
    Reader { name: "spans", extension: "csv", reads: spans, corpus: lists_of_spans, cases: 300 },
    Reader { name: "guide", extension: "guide", reads: guide, corpus: guides, cases: 100 },
    Reader {
        name: "groups",
        extension: "groups.ron",
        reads: groups,
        corpus: lists_of_groups,
        cases: 300,
    },
];

/// Triangles of a scene that is looked at as well as loaded: more take seconds.
const MAX_TRIANGLES: usize = 20_000;

/// What comes after loading: a summary, a picture, a mesh of every member.
fn whole(scene: Scene) {
    let job = Job::default();
    let _ = (scene.summary(), scene.bounds());
    let scene = Arc::new(scene);
    if scene.triangle_count() > MAX_TRIANGLES {
        return;
    }
    let lit = Arc::new(LitScene::build(Arc::clone(&scene), &job).unwrap());
    if let Some(camera) = scene.cameras.first() {
        let camera = Camera { width: 8, height: 6, ..camera.clone() };
        let (sensor, little) = (Sensor::Camera(camera.clone()), Schedule { first: 256, rounds: 2 });
        learn(&lit, &[sensor], scene_rule(&scene), 1, Steering::On, little, &job).unwrap();
        Render::new(lit, &camera, &RenderSettings::default()).step();
    }
    for assembly in scene.structure.assemblies.iter().filter(|a| a.body.is_none()).take(2) {
        let _ = prepare(&scene, assembly, Meshing::default(), &job);
    }
}

fn scene(path: &Path) {
    if let Ok(scene) = Scene::open(path, &Job::default()) {
        whole(scene);
    }
}

/// A GLB, or the JSON of one that has no container.
fn model(path: &Path) {
    let mut path = path.to_owned();
    if fs::read(&path).unwrap().starts_with(b"{") {
        let text = path.with_extension("gltf");
        fs::rename(&path, &text).unwrap();
        path = text;
    }
    let _ = gltf::validate(&path, &Job::default()).unwrap();
    scene(&path);
}

/// A model with these properties beside it.
fn properties(path: &Path) {
    let beside = path.with_file_name("input.glb");
    gltf::write_glb(&beside, &block(Vec3::ONE, Mat4::IDENTITY)).unwrap();
    scene(&beside);
}

/// A scene that names the file.
fn named(path: &Path, body: impl Fn(&str) -> String) {
    let scene_file = path.with_file_name("scene.ron");
    let name = path.file_name().unwrap().to_string_lossy().into_owned();
    fs::write(&scene_file, format!("(schema: \"intrados.scene/1\", {})", body(&name))).unwrap();
    scene(&scene_file);
}

fn mesh(path: &Path) {
    named(path, |name| format!("shapes: [Mesh(file: {name:?})], {LOOK}"));
}

fn picture(path: &Path) {
    named(path, |name| {
        format!(
            "materials: [(name: \"m\", texture: {name:?})], shapes: [Quad(corner: (0,0,0), u: (1,0,0), v: (0,1,0), material: \"m\")], {LOOK}"
        )
    });
}

pub(crate) const LOOK: &str = "cameras: [(name: \"c\", position: (0.5,0.5,3), target: (0.5,0.5,0), fov_deg: 40, width: 8, height: 6)], \
    lamps: [Point(name: \"l\", position: (1,2,3), strength: Lumen(500))]";

/// Mean of a scene's picture.
pub(crate) fn brightness(path: &Path) -> f64 {
    let scene = Arc::new(Scene::open(path, &Job::default()).unwrap());
    let camera = scene.cameras[0].clone();
    let mut render = Render::new(
        Arc::new(LitScene::build(scene, &Job::default()).unwrap()),
        &camera,
        &RenderSettings::default(),
    );
    render.advance(2);
    render.plate().summary().combined.mean
}

fn volume(path: &Path) {
    if let Ok(mut reader) = Volumes::open(path, Some([1e-4; 3])) {
        let last = reader.grid().size[2];
        for z in [0, last - 1] {
            let _ = reader.read_slab(z..z + 1, &Job::default());
        }
    }
}

/// The scene beside a file with this in place of its end.
fn beside(path: &Path, evidence: &str) {
    let column = parametric::template("column").unwrap();
    let end = column.rfind(')').unwrap();
    let scene = path.with_extension("scene.ron");
    fs::write(&scene, format!("{}evidence: [{evidence:?}])", &column[..end])).unwrap();
    if let Ok(scene) = Scene::load(&scene, &Job::default()) {
        let _ = intrados_scene::attach::listed(&scene);
    }
}

fn evidence(path: &Path) {
    beside(path, &path.file_name().unwrap().to_string_lossy());
}

fn table(path: &Path) {
    let file = path.file_name().unwrap().to_string_lossy();
    let named = path.with_extension("evidence.ron");
    let text = format!(
        "(schema: \"intrados.evidence/1\", tables: [(file: {file:?}, member: \"C1\", name: \"t\", unit: \"ue\")])"
    );
    fs::write(&named, text).unwrap();
    beside(path, &named.file_name().unwrap().to_string_lossy());
}

fn profile(path: &Path) {
    if let Ok(profile) = Profile::read(path) {
        let _ = (profile.state(0.3, 0.2), profile.crack_limit("XC4", true), profile.damaged_from());
    }
}

static COLUMN: LazyLock<Scene> =
    LazyLock::new(|| Scene::load_bundled("column", &Job::default()).unwrap());

fn cracks(path: &Path) {
    if let Ok(file) = SurfaceFile::read(path, &COLUMN) {
        let _ = COLUMN.marked(&file.members, 10.0);
    }
}

fn deck(path: &Path) {
    if let Ok(deck) = abaqus::read(path, Units::MillimetreNewton) {
        let _ = Case::new(deck);
    }
}

fn mesh_of_gmsh(path: &Path) {
    let said = lists_of_groups().swap_remove(0);
    let groups = Groups::parse(&said, Path::new("said.ron")).unwrap();
    let _ = parse_mesh(&fs::read(path).unwrap(), path, Units::MetreNewton, &groups);
}

fn groups(path: &Path) {
    if let Ok(groups) = Groups::parse(&fs::read(path).unwrap(), path) {
        for mesh in meshes_of_gmsh() {
            if let Ok(deck) = parse_mesh(&mesh, path, Units::MetreNewton, &groups) {
                let _ = deck.solve(&Job::default());
            }
        }
    }
}

/// The bytes of a file that somebody writes.
fn written(name: &str, write: impl FnOnce(&Path)) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    write(&path);
    fs::read(path).unwrap()
}

fn scenes() -> Vec<Vec<u8>> {
    let bundled = bundled()
        .iter()
        .filter(|(name, _)| ["cornell", "room", "slit"].contains(name))
        .map(|(_, text)| text.as_bytes().to_vec());
    let templates = ["column", "beam"]
        .iter()
        .map(|kind| parametric::template(kind).unwrap().as_bytes().to_vec());
    let mut scenes: Vec<_> = bundled.chain(templates).collect();
    scenes.push(
        br#"(schema: "intrados.scene/1", materials: [(name: "m", colour: (0.5, 0.4, 0.3), surface: Metallic(metallic: 0.5, roughness: 0.2)),
            (name: "g", surface: Dielectric(ior: 1.5, roughness: 0.1))],
            shapes: [Box(centre: (0, 0, 0), size: (1, 2, 3), turn_deg: 30, material: "m"), Quad(corner: (0, 5, 0), u: (1, 0, 0), v: (0, 0, 1), emission: (9, 9, 9))],
            lamps: [Spot(name: "s", position: (0, 4, 0), target: (0, 0, 0), strength: Candela(100), inner_deg: 10, outer_deg: 20),
                Directional(name: "d", direction: (0, -1, 0.1), strength: Lux(100)), Environment(radiance: (1, 1, 1))],
            cameras: [(name: "c", position: (4, 3, 5), target: (0, 0, 0), fov_deg: 40, width: 8, height: 6)],
            meters: [Patch(name: "p", corner: (0, 3, 0), u: (1, 0, 0), v: (0, 0, 1))])"#
            .to_vec(),
    );
    scenes
}

/// Closed boxes, each by its middle and its edges; negative edges make a void.
fn boxes(list: &[(Vec3, Vec3)]) -> Mesh {
    let corner =
        |i: usize| 0.5 * Vec3::from([0, 1, 2].map(|k| if i >> k & 1 == 1 { 1.0 } else { -1.0 }));
    let faces =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces = || faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    let n = 8 * list.len();
    Mesh {
        positions: list
            .iter()
            .flat_map(|&(middle, size)| (0..8).map(move |i| middle + size * corner(i)))
            .collect(),
        uv: [(0..n).map(|i| Vec2::new((i & 1) as f32, (i >> 1) as f32)).collect(), Vec::new()],
        colours: vec![Vec3::ONE; n],
        triangles: (0..list.len() as u32)
            .flat_map(|b| faces().map(move |t| t.map(|i| i + 8 * b)))
            .collect(),
        ..Mesh::default()
    }
}

/// A body with a camera, lamps and a name that makes it a member.
fn block(size: Vec3, transform: Mat4) -> Model {
    body(boxes(&[(Vec3::ZERO, size)]), size, transform)
}

fn body(shape: Mesh, size: Vec3, transform: Mat4) -> Model {
    let object = |name: &str, member, part, material| Object {
        name: name.into(),
        mesh: 0,
        transform,
        material,
        member,
        part,
    };
    let texture =
        TextureRef { texture: 0, set: 0, transform: glam::Affine2::from_scale(Vec2::splat(2.0)) };
    let shiny = Surface::Metallic { metallic: 0.5, roughness: 0.3, texture: Some(texture.clone()) };
    Model {
        meshes: vec![Arc::new(shape)],
        objects: vec![
            object("COL_1", Some(0), Part::Concrete, 0),
            object("bulb", None, Part::Scenery, 1),
            object("glass", None, Part::Scenery, 2),
        ],
        materials: vec![
            Material {
                base_texture: Some(texture.clone()),
                surface: shiny,
                normal_texture: Some((texture, 1.0)),
                ..Material::default()
            },
            Material { emission: Vec3::ONE, ..Material::default() },
            Material {
                surface: Surface::Dielectric { ior: 1.5, roughness: 0.1 },
                ..Material::default()
            },
        ],
        textures: vec![Texture {
            width: 2,
            height: 2,
            texels: vec![Vec3::splat(0.5); 4],
            wrap: [Wrap::Repeat; 2],
        }],
        lamps: vec![
            Lamp {
                name: "p".into(),
                kind: LampKind::Point { position: 2.0 * size, intensity: Vec3::ONE },
            },
            Lamp {
                name: "s".into(),
                kind: LampKind::Spot {
                    position: 2.0 * size,
                    direction: Vec3::NEG_Y,
                    intensity: Vec3::ONE,
                    inner: 0.2,
                    outer: 0.4,
                },
            },
            Lamp {
                name: "d".into(),
                kind: LampKind::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::ONE },
            },
        ],
        cameras: vec![Camera {
            name: "c".into(),
            position: 3.0 * size,
            target: Vec3::ZERO,
            up: Vec3::Y,
            fov_deg: 40.0,
            width: 8,
            height: 6,
            exposure: 0.0,
            lens: None,
        }],
        members: vec![Member {
            id: "C1".into(),
            name: "C1".into(),
            kind: MemberKind::Column,
            concrete: "C30/37".into(),
            ..COLUMN.members[0].clone()
        }],
        ..Model::default()
    }
}

/// What our writer does not write: sparse data, skins, animations, morph targets, strips, spots,
/// scenes, a tree of nodes, packed materials.
const FEATURES: &str = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}, {"nodes": [0]}],
"extensionsUsed": ["KHR_lights_punctual", "KHR_materials_transmission", "KHR_materials_ior", "KHR_materials_emissive_strength", "KHR_texture_transform", "KHR_materials_pbrSpecularGlossiness"],
"extensions": {"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 40, "range": 9, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.6}}, {"type": "directional", "color": [1, 0.5, 0]}]}},
"nodes": [{"name": "COL_1", "mesh": 0, "skin": 0, "children": [1, 2], "rotation": [0, 0.6, 0, 0.8], "scale": [1, 2, 0.5], "extras": {"intrados": {"member": "C", "kind": "column", "concrete": "C30/37"}}},
{"name": "joint", "translation": [0, 1, 0], "extensions": {"KHR_lights_punctual": {"light": 0}}, "children": [3]},
{"mesh": 1, "matrix": [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 3, 2, 1, 1], "weights": [0.5]}, {"camera": 0, "translation": [0, 0, 4], "extensions": {"KHR_lights_punctual": {"light": 1}}}],
"cameras": [{"type": "perspective", "perspective": {"aspectRatio": 1.5, "yfov": 0.7, "znear": 0.01}}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}, "material": 0}]},
{"primitives": [{"attributes": {"POSITION": 1, "TEXCOORD_0": 4}, "indices": 5, "mode": 5, "material": 1, "targets": [{"POSITION": 0}]}]}],
"materials": [{"emissiveFactor": [1, 1, 0.5], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 50}}},
{"extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.9}, "KHR_materials_ior": {"ior": 1.33}, "KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0.5, 0.5, 0.5, 1]}},
"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0.1, 0], "rotation": 0.4, "scale": [3, 3]}}}, "roughnessFactor": 0.2}}],
"textures": [{"source": 0}], "images": [{"uri": "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/pLvAAAAAElFTkSuQmCC"}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
{"bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0], "sparse": {"count": 1, "indices": {"bufferView": 1, "componentType": 5121}, "values": {"bufferView": 0}}},
{"componentType": 5121, "count": 3, "type": "VEC4"}, {"componentType": 5126, "count": 3, "type": "VEC4"}, {"componentType": 5126, "count": 3, "type": "VEC2"},
{"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"}, {"componentType": 5126, "count": 1, "type": "SCALAR", "min": [0], "max": [0]}, {"componentType": 5126, "count": 1, "type": "VEC3"}],
"skins": [{"joints": [1]}], "animations": [{"samplers": [{"input": 6, "output": 7}], "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}]}],
"bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 3}, {"buffer": 0, "byteLength": 36}],
"buffers": [{"byteLength": 39, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAEC"}]}"#;

/// Boxes of every size and shape that numbers hold, and models of other people.
fn models() -> Vec<Vec<u8>> {
    let glb = |model: &Model| written("model.glb", |path| gltf::write_glb(path, model).unwrap());
    let sizes = [
        Vec3::new(0.4, 3.0, 0.4),
        Vec3::splat(1e-3),
        Vec3::splat(1e-20),
        Vec3::splat(1e-38),
        Vec3::splat(1e9),
        Vec3::splat(1e18),
        Vec3::splat(3e37),
        Vec3::new(1.0, 1.0, 0.0),
        Vec3::new(1.0, 0.0, 0.0),
        Vec3::ZERO,
        Vec3::new(1e-20, 1.0, 1e20),
        Vec3::new(1e4, 1e-4, 1e4),
    ];
    let mut models: Vec<_> = sizes.iter().map(|&size| glb(&block(size, Mat4::IDENTITY))).collect();
    let transforms = [
        Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0)),
        Mat4::from_scale(Vec3::splat(1e-5)),
        Mat4::from_scale(Vec3::new(1e-12, 1e6, 1e-12)),
        Mat4::from_scale(Vec3::new(1e20, 1e-20, 1.0)),
        Mat4::from_translation(Vec3::splat(1e30)),
        Mat4::from_cols_array(&[
            1.0, 0.0, 0.0, 0.0, 0.7, 1e-3, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0,
        ]),
    ];
    models.extend(transforms.iter().map(|&transform| glb(&block(Vec3::ONE, transform))));
    // Bodies that cross, touch along an edge or at a corner, have a void, a lid of no thickness, or
    // stand where numbers are coarse.
    let unit = Vec3::ONE;
    let bodies = [
        vec![(Vec3::ZERO, unit), (Vec3::splat(0.5), unit)],
        vec![(Vec3::ZERO, unit), (Vec3::new(1.0, 1.0, 0.0), unit)],
        vec![(Vec3::ZERO, unit), (unit, unit)],
        vec![(Vec3::ZERO, unit), (Vec3::X, unit), (Vec3::X, unit)],
        vec![(Vec3::ZERO, 4.0 * unit), (Vec3::ZERO, -unit)],
        vec![(Vec3::ZERO, unit), (Vec3::Y, Vec3::new(1.0, 0.0, 1.0))],
        vec![(Vec3::splat(1e7), unit), (Vec3::splat(-1e7), unit)],
        (0..60)
            .map(|i| (0.3 * i as f32 * Vec3::new(1.0, 0.1, 0.0), Vec3::new(0.3, 0.02, 2.0)))
            .collect(),
    ];
    let turned = Mat4::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
    models.extend(
        bodies.iter().flat_map(|list| {
            [Mat4::IDENTITY, turned].map(|turn| glb(&body(boxes(list), unit, turn)))
        }),
    );
    models.push(FEATURES.as_bytes().to_vec());
    if let Some(data) = std::env::var_os("INTRADOS_DATA") {
        let folder = PathBuf::from(data).join("models");
        models.extend(
            ["CornellBox.glb", "IrradianceVolumeExample.glb"]
                .iter()
                .filter_map(|name| fs::read(folder.join(name)).ok()),
        );
    }
    models
}

fn lists_of_properties() -> Vec<Vec<u8>> {
    vec![
        br#"{"COL_1": {"type": "IfcColumn", "name": "pier", "materials": ["Concrete C30/37", "steel"]}, "bulb": {"type": "IfcSpace"}}"#
            .to_vec(),
    ]
}

fn meshes() -> Vec<Vec<u8>> {
    vec![
        b"# a pyramid\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 1\nvt 0 0\nf 1 2 5\nf 2/1 3/1 5/1\nf 3//1 4//1 5//1\nf -2 -5 -1\nf 1 4 3 2\n".to_vec(),
        b"v 1e6 1e6 1e6\nv 1e6 1e6 1e6\nv -1e6 0 1e-30\nf 1 2 3\n".to_vec(),
    ]
}

fn pictures() -> Vec<Vec<u8>> {
    let colours =
        image::RgbImage::from_fn(7, 5, |x, y| image::Rgb([x as u8 * 30, y as u8 * 40, 99]));
    let exr = image::Rgb32FImage::from_fn(7, 5, |x, y| image::Rgb([x as f32, y as f32, 0.5]));
    let greys = image::GrayImage::from_fn(9, 3, |x, y| image::Luma([(x * y) as u8]));
    let mut pictures = vec![
        written("p.png", |path| colours.save(path).unwrap()),
        written("p.jpg", |path| colours.save(path).unwrap()),
        written("g.png", |path| greys.save(path).unwrap()),
    ];
    // Where the codec is part of the build.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.exr");
    if exr.save(&path).is_ok() {
        pictures.push(fs::read(path).unwrap());
    }
    pictures
}

fn stack(name: &str, depth: Depth, size: [usize; 3]) -> Vec<u8> {
    written(name, |path| {
        let grid = Grid::centred(size, [1e-4; 3]);
        let mut writer = Writer::create(path, grid, depth).unwrap();
        writer.write_slab(&(0..grid.len()).map(|i| i as f32).collect::<Vec<_>>()).unwrap();
        writer.finish().unwrap();
    })
}

fn slices() -> Vec<Vec<u8>> {
    let deep = image::ImageBuffer::<image::Luma<u16>, Vec<u16>>::from_fn(9, 7, |x, y| {
        image::Luma([(x * y * 700) as u16])
    });
    vec![
        stack("s.tif", Depth::Float, [6, 5, 3]),
        stack("s.tif", Depth::Sixteen { low: 0.0, high: 100.0 }, [8, 8, 1]),
        written("s.png", |path| deep.save(path).unwrap()),
        written("s.png", |path| image::GrayImage::new(16, 16).save(path).unwrap()),
    ]
}

fn volumes() -> Vec<Vec<u8>> {
    let header = |rest: &str| {
        format!("ObjectType = Image\nNDims = 3\nDimSize = 4 3 2\nElementSpacing = 0.1 0.1 0.2\nElementType = MET_USHORT\n{rest}")
            .into_bytes()
    };
    let mut local = header("ElementByteOrderMSB = False\nElementDataFile = LOCAL\n");
    local.extend([7; 48]);
    vec![
        local,
        header("HeaderSize = -1\nElementDataFile = input.mha\n"),
        header("ElementDataFile = LIST\ninput.mha\ninput.mha\n"),
        // What once could name any file.
        header("ElementDataFile = /dev/urandom\n"),
        header("ElementDataFile = ../../../../../../etc/passwd\n"),
    ]
}

/// The examples of an empty file of evidence, taken for real.
fn skeletons() -> Vec<Vec<u8>> {
    let skeleton = include_str!("../../../plugins/scene/src/file/evidence/skeleton.ron");
    vec![skeleton.replace("// (", "(").into_bytes(), skeleton.into()]
}

fn tables() -> Vec<Vec<u8>> {
    [
        "along,mV,face,date\n0.2,-310,Front,2026-05-03\n0.8,-120.5,Back,2026-05-03\n",
        "\u{feff}along;depth_mm;chloride_percent_cement;std_error\r\n0,2;5;1,1;0,1\r\n0,2;15;0,5;0,1\r\n",
        "gauge\tvalue\ttest\nSG1\t41.5\ttruck\n",
    ]
    .map(|t| t.as_bytes().to_vec())
    .into()
}

fn profiles() -> Vec<Vec<u8>> {
    [
        include_str!("../../../assets/grading/four_states.ron"),
        include_str!("../../../assets/grading/tight_cracks.ron"),
    ]
    .map(|t| t.as_bytes().to_vec())
    .into()
}

fn lists_of_cracks() -> Vec<Vec<u8>> {
    let outward = Vec3::Z;
    let mouth = (0..4)
        .map(|i| Mouth { at: Vec3::new(0.1 * i as f32, 1.0, 0.2), outward, width: 3e-4 })
        .collect();
    let damage = SurfaceDamage {
        member: COLUMN.members[0].id.clone(),
        cracks: vec![CrackSurface { mouth, normal: Vec3::Y, depth: 0.05 }],
        spalls: vec![Spalled {
            centre: Vec3::new(0.1, 2.0, 0.2),
            outward,
            radius: 0.05,
            depth: 0.02,
        }],
    };
    vec![serde_json::to_vec_pretty(&SurfaceFile::new(&COLUMN.hash, vec![damage])).unwrap()]
}

/// A cube that is held below, and what a deck may say of it.
fn decks() -> Vec<Vec<u8>> {
    let cube = "*NODE, NSET=NALL\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n*ELEMENT, TYPE=C3D8, ELSET=EALL\n1,1,2,3,4,5,6,7,8\n\
        *MATERIAL,NAME=C\n*ELASTIC\n30000.0,0.2\n*DENSITY\n2.5e-9\n*EXPANSION\n1e-5\n*SOLID SECTION,ELSET=EALL,MATERIAL=C\n*BOUNDARY\n1,1,3\n2,1,3\n3,3\n4,3\n";
    let step = "*STEP\n*STATIC\n0.1,1.0\n*CLOAD\n7,3,-0.25\n*DLOAD\n1,P6,1.0\nEALL,GRAV,9810.,0,0,-1\n*END STEP\n";
    let more = "*NSET, NSET=TOP, GENERATE\n5,8,1\n*AMPLITUDE, NAME=A\n0,0,1,1\n*STEP, INC=100\n*STATIC\n*BOUNDARY, AMPLITUDE=A\nTOP,3,3,0.001\n*TEMPERATURE\nNALL,20\n*END STEP\n";
    vec![format!("{cube}{step}").into_bytes(), format!("{cube}{more}{step}").into_bytes()]
}

/// What the groups of [`meshes_of_gmsh`] are.
fn lists_of_groups() -> Vec<Vec<u8>> {
    let said = r#"(
    schema: "intrados.groups/1",
    materials: [(group: "core", modulus_gpa: 33, poisson: 0.2, density_kg_m3: 2500, expansion_1e6_k: 10)],
    supports: [(group: "left", x: true, y: true, z: true, moved_mm: (0, 0, 0.5))],
    loads: [
        (action: Weight(gravity_m_s2: (0, 0, -9.81))),
        (group: "left", action: Pressure(pressure_kpa: 100)),
        (group: "left", action: Traction(traction_kpa: (20, 0, 0))),
        (group: "left", action: Force(force_kn: (0, 0, -10))),
        (group: "core", action: Temperature(uniform_k: 15)),
    ],
)"#;
    vec![said.into()]
}

fn meshes_of_gmsh() -> Vec<Vec<u8>> {
    let nodes = ["0 0 0", "1 0 0", "1 1 0", "0 1 0", "0 0 1", "1 0 1", "1 1 1", "0 1 1"];
    let groups = "$PhysicalNames\n2\n2 3 \"left\"\n3 1 \"core\"\n$EndPhysicalNames\n";
    let numbers: String = (1..=8).map(|i| format!("{i}\n")).collect();
    let new = format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n{groups}$Entities\n0 0 1 1\n1 0 0 0 0 1 1 1 3 0\n1 0 0 0 1 1 1 1 1 0\n$EndEntities\n$Nodes\n1 8 1 8\n3 1 0 8\n{numbers}{}\n$EndNodes\n\
         $Elements\n2 2 1 2\n2 1 3 1\n1 1 4 8 5\n3 1 5 1\n2 1 2 3 4 5 6 7 8\n$EndElements\n",
        nodes.join("\n")
    );
    let numbered: String =
        nodes.iter().enumerate().map(|(i, n)| format!("{} {n}\n", i + 1)).collect();
    let old = format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{groups}$Nodes\n8\n{numbered}$EndNodes\n$Elements\n2\n1 3 2 3 1 1 4 8 5\n2 5 2 1 1 1 2 3 4 5 6 7 8\n$EndElements\n"
    );
    vec![new.into_bytes(), old.into_bytes()]
}

/// Segments of a JPEG, EXIF with all kinds of tags, and without the end of its list.
fn photographs() -> Vec<Vec<u8>> {
    let colours =
        image::RgbImage::from_fn(40, 30, |x, y| image::Rgb([x as u8 * 6, y as u8 * 8, 99]));
    let plain = written("p.jpg", |path| colours.save(path).unwrap());
    let with = |exif: &[u8]| {
        let length = (exif.len() as u16 + 8).to_be_bytes();
        [&plain[..2], &[0xff, 0xe1], &length, b"Exif\0\0", exif, &plain[2..]].concat()
    };
    let entry = |tag: u16, kind: u16, count: u32, value: u32| {
        [&tag.to_le_bytes()[..], &kind.to_le_bytes(), &count.to_le_bytes(), &value.to_le_bytes()]
            .concat()
    };
    let head = [&b"II*\0"[..], &8_u32.to_le_bytes(), &2_u16.to_le_bytes()].concat();
    let own = [entry(0x112, 3, 1, 6), entry(0x8769, 4, 1, 38)].concat();
    let sub = [
        5_u16.to_le_bytes().to_vec(),
        entry(0x920a, 5, 1, 104),
        entry(0xa002, 4, 1, 40),
        entry(0xa003, 4, 1, 30),
        entry(0xa405, 3, 1, 28),
        entry(0x9000, 7, 4, 0x3132_3330),
    ]
    .concat();
    let exif = [&head[..], &own, &[0; 4], &sub, &[0; 4], &[50, 0, 0, 0, 10, 0, 0, 0]].concat();
    let tiff = written("p.tif", |path| colours.save(path).unwrap());
    let png = written("p.png", |path| colours.save(path).unwrap());
    vec![
        plain.clone(),
        with(&exif),
        with(&exif[..36]),
        plain[..plain.len() / 2].to_vec(),
        tiff,
        png,
    ]
}

fn photograph(path: &Path) {
    if let Ok(photograph) = intrados_photo::Photograph::open(path) {
        let _ = photograph.taken.focal(photograph.size);
    }
    let _ = intrados_ct::picture::Picture::read(path, 64);
}

/// Explicit and implicit elements, packed and plain pixels, nested groups.
fn dicoms() -> Vec<Vec<u8>> {
    let file = |syntax: &str, elements: &[Vec<u8>]| {
        let mut name = syntax.as_bytes().to_vec();
        name.resize(name.len().next_multiple_of(2), 0);
        let facts =
            [&[2, 0, 0x10, 0][..], b"UI", &(name.len() as u16).to_le_bytes(), &name].concat();
        let length = (facts.len() as u32).to_le_bytes();
        [&[0; 128][..], b"DICM", &[2, 0, 0, 0], b"UL", &[4, 0], &length, &facts, &elements.concat()]
            .concat()
    };
    let tag = |group: u16, element: u16| [group.to_le_bytes(), element.to_le_bytes()].concat();
    let short = |g: u16, e: u16, kind: &str, value: &[u8]| {
        [&tag(g, e)[..], kind.as_bytes(), &(value.len() as u16).to_le_bytes(), value].concat()
    };
    let long = |g: u16, e: u16, kind: &str, length: Option<u32>, value: &[u8]| {
        let length = length.unwrap_or(value.len() as u32).to_le_bytes();
        [&tag(g, e)[..], kind.as_bytes(), &[0, 0], &length, value].concat()
    };
    let item = |value: &[u8]| {
        [&tag(0xfffe, 0xe000)[..], &(value.len() as u32).to_le_bytes(), value].concat()
    };
    let us = |g, e, n: u16| short(g, e, "US", &n.to_le_bytes());
    let head = |bits: u16| {
        vec![
            short(8, 0x60, "CS", b"CT"),
            short(0x20, 0x13, "IS", b"1 "),
            short(0x20, 0x32, "DS", b"0\\0\\1.5 "),
            us(0x28, 2, 1),
            short(0x28, 4, "CS", b"MONOCHROME2 "),
            us(0x28, 0x10, 8),
            us(0x28, 0x11, 8),
            short(0x28, 0x30, "DS", b"0.3\\0.3 "),
            us(0x28, 0x100, bits),
            us(0x28, 0x101, bits),
            us(0x28, 0x102, bits - 1),
            us(0x28, 0x103, 1),
            short(0x28, 0x120, "SS", &(-2000_i16).to_le_bytes()),
            short(0x28, 0x1052, "DS", b"-1024 "),
        ]
    };
    let with =
        |syntax: &str, bits: u16, last: Vec<u8>| file(syntax, &[&head(bits)[..], &[last]].concat());
    let plain = long(0x7fe0, 0x10, "OW", None, &[7; 128]);
    let packed = |frame: &[u8]| {
        let end = [&tag(0xfffe, 0xe0dd)[..], &[0; 4]].concat();
        let all = [item(&[]), item(frame), end].concat();
        long(0x7fe0, 0x10, "OB", Some(u32::MAX), &all)
    };
    let mut runs = [2_u32, 64, 68].iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<_>>();
    runs.resize(64, 0);
    runs.extend([0xc1, 5, 0, 0, 0xc1, 9, 0, 0]);
    let jpeg = written("g.jpg", |path| {
        image::GrayImage::from_fn(8, 8, |x, y| image::Luma([(x * y) as u8])).save(path).unwrap();
    });
    let spacing = short(0x28, 0x30, "DS", b"0.3\\0.3 ");
    let measures = long(0x28, 0x9110, "SQ", None, &item(&spacing));
    let shared = long(0x5200, 0x9229, "SQ", None, &item(&measures));
    let enhanced =
        [shared, us(0x28, 0x10, 8), us(0x28, 0x11, 4), short(0x28, 8, "IS", b"2 "), plain.clone()];
    vec![
        with("1.2.840.10008.1.2.1", 16, plain),
        with("1.2.840.10008.1.2.5", 16, packed(&runs)),
        with("1.2.840.10008.1.2.4.50", 8, packed(&jpeg)),
        file("1.2.840.10008.1.2.1", &enhanced),
    ]
}

fn sinograms() -> Vec<Vec<u8>> {
    vec![
        stack("s.tif", Depth::Float, [16, 12, 1]),
        stack("s.tif", Depth::Sixteen { low: 0.0, high: 100.0 }, [16, 4, 9]),
    ]
}

/// A sinogram to what speaks against it and its slices.
fn sinogram(path: &Path) {
    use intrados_xray::{
        correct::{mend_dead_bins, no_integrals, sinogram_doubts},
        recon::{Window, fbp},
        volume::{Beam, Orbit, Sinogram},
    };
    let Ok(mut reader) = Volumes::open(path, Some([1e-4; 3])) else { return };
    let [bins, rows, pages] = reader.grid().size;
    if bins * rows * pages > 100_000 {
        return;
    }
    for by_row in [true, false] {
        let (views, rows) = if by_row { (rows, pages) } else { (pages, rows) };
        let orbit =
            Orbit::circle(Beam::Parallel, views, std::f64::consts::PI, [rows, bins], [1e-4; 2]);
        let job = Job::default();
        let Ok(mut read) = Sinogram::read(&mut reader, &orbit, by_row, 0..rows, &job) else {
            continue;
        };
        let _ = (no_integrals(&read), mend_dead_bins(&mut read), sinogram_doubts(&read, false));
        let grid = Grid::centred([bins.min(32), bins.min(32), rows], [1e-4; 3]);
        let _ = fbp(&read, &grid, Window::SheppLogan, &job);
    }
}

fn lists_of_picks() -> Vec<Vec<u8>> {
    [
        "photo,u,v,x,y,z\na.jpg,819.5,1019.3,0.2,0,0.2\na.jpg,871.8,988.8,0.2,0,-0.2\n",
        "\u{feff}u;v;member;corner\n819,5;1019,3;C1;1\n871,8;988,8;C1;2\n",
        "tag\tsize_mm\tmember\tface\talong\tacross_mm\tturn_deg\n3\t120\tC1\tFront\t0.5\t10\t90\n",
    ]
    .map(|t| t.as_bytes().to_vec())
    .into()
}

fn picks(path: &Path) {
    static SITE: LazyLock<intrados_photo::Site> =
        LazyLock::new(|| intrados_photo::Site::new(&COLUMN, &Job::default()).unwrap());
    let _ = intrados_photo::picks::read(path, &COLUMN, &SITE);
}

fn lists_of_poses() -> Vec<Vec<u8>> {
    let cameras = "# cameras\n1 SIMPLE_PINHOLE 1600 1200 1294.3 800 600\n2 OPENCV 80 60 90 90 40 30 0.1 -0.1 0 0\n";
    let images = "# images\n1 0.0099 -0.9641 -0.0027 0.2652 -0.796 1.459 6.906 1 cam1/a.jpg\n1 2 -1\n2 0.03 -0.84 -0.02 0.54 0.5 1.3 6.4 2 b.jpg\n\n";
    vec![format!("{cameras}%\n{images}").into_bytes()]
}

/// Both files of COLMAP, divided by a line.
fn colmap(path: &Path) {
    let text = String::from_utf8_lossy(&fs::read(path).unwrap()).into_owned();
    let (cameras, images) = text.split_once("%\n").unwrap_or((&text, &text));
    let folder = path.parent().unwrap();
    fs::write(folder.join("cameras.txt"), cameras).unwrap();
    fs::write(folder.join("images.txt"), images).unwrap();
    if let Ok(series) = intrados_photo::series::Series::read(folder) {
        let pick = |photo: &str, x: f64, place: glam::DVec3| intrados_photo::picks::PickedIn {
            photo: Some(photo.into()),
            pick: intrados_photo::Pick { pixel: [x, 500.0], place },
        };
        let places = [glam::DVec3::X, glam::DVec3::Y, glam::DVec3::Z];
        let picks: Vec<_> = places
            .iter()
            .zip([400.0, 600.0, 700.0])
            .flat_map(|(place, x)| [pick("a.jpg", x, *place), pick("b.jpg", x - 380.0, *place)])
            .collect();
        let _ = series.placed(&picks).map(|placed| placed.located("a.jpg", &[]));
    }
}

fn lists_of_spans() -> Vec<Vec<u8>> {
    let head = "id,name,lat,lon,year,material,system,spans_m,width_m,environment\n";
    vec![
        format!("{head}B1,Mill,52.1,11.6,1967,concrete,beam,12;15;12,9.5,XD3\n").into_bytes(),
        format!("\u{feff}{}B2;Süd;51,2;7,1;1980;concrete;slab;10;8;XC4\n", head.replace(',', ";"))
            .into_bytes(),
    ]
}

fn spans(path: &Path) {
    let Ok(bridges) = intrados_forecast::span::parse(&fs::read(path).unwrap()) else { return };
    for bridge in bridges.bridges.iter().take(4) {
        let _ = intrados_forecast::span::spans(bridge);
    }
}

/// What steers the walks of a small scene, as text: every number in it can be exchanged.
fn guided() -> (Arc<LitScene>, Vec<Sensor>) {
    let scene = Arc::new(Scene::load_bundled("cornell", &Job::default()).unwrap());
    let camera = Camera { width: 8, height: 6, ..scene.cameras[0].clone() };
    let lit = Arc::new(LitScene::build(scene, &Job::default()).unwrap());
    (lit, vec![Sensor::Camera(camera)])
}

fn guides() -> Vec<Vec<u8>> {
    let (lit, sensors) = guided();
    let little = Schedule { first: 256, rounds: 2 };
    let rule = scene_rule(&lit.scene);
    let guide = learn(&lit, &sensors, rule, 1, Steering::On, little, &Job::default()).unwrap();
    vec![ron::to_string(&guide).unwrap().into_bytes()]
}

fn guide(path: &Path) {
    static LIT: LazyLock<(Arc<LitScene>, Vec<Sensor>)> = LazyLock::new(guided);
    let (lit, sensors) = &*LIT;
    let text = fs::read_to_string(path).unwrap_or_default();
    if let Ok(guide) = ron::from_str::<intrados_light::Guide>(&text) {
        let _ = guide.back(lit, sensors);
    }
}
