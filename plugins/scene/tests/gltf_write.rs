//! What is written comes back: round trips, and what the reader does with every kind of legal data.

use std::{
    collections::HashSet,
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use glam::{Affine2, EulerRot, Mat4, Quat, Vec2, Vec3, Vec4};
use intrados_scene::{
    Camera, Frame, Lamp, LampKind, Material, Member, MemberKind, Mesh, Object, Part, Scene,
    SteelLine, Surface, Texture, TextureRef, Wrap, bundled,
    gltf::{self, ImportError, Model},
    structure::{BarEnd, Bond, Grade},
};
use intrados_stage::Job;
use serde_json::{Value, json};
use tempfile::TempDir;

fn folder() -> TempDir {
    TempDir::new().expect("a folder")
}

/// A box with normals, tangents, coordinates and colours.
fn cuboid(size: Vec3) -> Mesh {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let mut n = Vec3::ZERO;
            n[axis] = sign;
            let (u, v) = (n.any_orthonormal_vector(), n.cross(n.any_orthonormal_vector()));
            let first = mesh.positions.len() as u32;
            for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                mesh.positions.push(0.5 * size * (n + a * u + b * v));
                mesh.normals.push(n);
                mesh.tangents.push(u.extend(1.0));
                mesh.uv[0].push(Vec2::new(a, b));
                mesh.uv[1].push(Vec2::new(b, a));
                mesh.colours.push(Vec3::new(0.25, 0.5, 1.0));
            }
            mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
    }
    mesh
}

fn object(name: &str, mesh: usize, transform: Mat4, member: Option<usize>, part: Part) -> Object {
    Object { name: name.into(), mesh, transform, material: 0, member, part }
}

fn member(id: &str, kind: MemberKind, concrete: Option<&str>) -> Member {
    Member {
        id: id.into(),
        name: format!("Member {id}"),
        kind,
        concrete: concrete.unwrap_or("C30/37").into(),
        concrete_assumed: concrete.is_none(),
        exposure: None,
        frame: intrados_scene::Frame::of_box(kind, [Vec3::ZERO; 2]),
        bounds: [Vec3::ZERO; 2],
        volume: 0.0,
        slices: Vec::new(),
        truth: Vec::new(),
    }
}

fn texture(set: usize, transform: Affine2) -> TextureRef {
    TextureRef { texture: 0, set, transform }
}

/// A column with two bars, a tendon through a beam, every surface, lamp and camera.
fn rich() -> Model {
    let plain = |name: &str, surface| Material {
        name: name.into(),
        assumed: false,
        surface,
        ..Material::default()
    };
    let turned =
        Affine2::from_scale_angle_translation(Vec2::new(2.0, 3.0), 0.5, Vec2::new(0.25, -1.0));
    let steel = Surface::Metallic {
        metallic: 0.9,
        roughness: 0.4,
        texture: Some(TextureRef { texture: 1, ..texture(1, Affine2::IDENTITY) }),
    };
    let materials = vec![
        plain("matt", Surface::Lambert),
        Material {
            base_texture: Some(texture(0, turned)),
            normal_texture: Some((TextureRef { texture: 1, ..texture(0, Affine2::IDENTITY) }, 0.5)),
            ..plain("steel", steel)
        },
        plain("glass", Surface::Dielectric { ior: 1.33, roughness: 0.1 }),
        Material { emission: Vec3::new(3.0, 2.0, 1.0), ..plain("lamp", Surface::Black) },
        Material::default(),
    ];
    let texel = |r: f32| Vec3::new(r, 1.0, 0.0);
    let texture = |wrap| Texture {
        width: 2,
        height: 2,
        texels: [0.0, 1.0, 0.0, 1.0].map(texel).to_vec(),
        wrap,
    };
    let pose = Mat4::from_scale_rotation_translation(
        Vec3::new(1.0, 2.0, -0.5),
        Quat::from_euler(EulerRot::XYZ, 0.3, -0.2, 1.0),
        Vec3::new(1.0, 2.0, 3.0),
    );
    let mut objects = vec![
        object("column", 0, Mat4::from_translation(Vec3::Y), Some(0), Part::Concrete),
        object("bar 1", 1, Mat4::IDENTITY, Some(0), Part::Bar),
        object("bar 2", 1, Mat4::from_translation(Vec3::X), Some(0), Part::Stirrup),
        object("beam", 0, pose, Some(1), Part::Concrete),
        object("tendon", 1, pose, Some(1), Part::Tendon),
        object("ground", 0, Mat4::IDENTITY, None, Part::Scenery),
    ];
    for (i, object) in objects.iter_mut().enumerate() {
        object.material = i.min(4);
    }
    Model {
        meshes: vec![
            Arc::new(cuboid(Vec3::new(0.4, 3.0, 0.4))),
            Arc::new(cuboid(Vec3::splat(0.02))),
        ],
        objects,
        materials,
        textures: vec![texture([Wrap::Mirror, Wrap::Clamp]), texture([Wrap::Repeat; 2])],
        lamps: vec![
            Lamp {
                name: "a".into(),
                kind: LampKind::Point { position: Vec3::ONE, intensity: Vec3::new(1.0, 0.5, 0.25) },
            },
            Lamp {
                name: "b".into(),
                kind: LampKind::Spot {
                    position: Vec3::X,
                    direction: Vec3::NEG_Y,
                    intensity: Vec3::splat(7.0),
                    inner: 0.2,
                    outer: 0.6,
                },
            },
            Lamp {
                name: "c".into(),
                kind: LampKind::Directional {
                    direction: Vec3::new(0.6, -0.8, 0.0),
                    irradiance: Vec3::splat(2.0),
                },
            },
        ],
        cameras: vec![Camera {
            name: "front".into(),
            position: Vec3::new(0.0, 1.0, 8.0),
            target: Vec3::new(0.0, 1.0, 0.0),
            up: Vec3::Y,
            fov_deg: 50.0,
            width: 960,
            height: 720,
            exposure: 0.0,
            lens: None,
        }],
        members: vec![
            member("C1", MemberKind::Column, Some("C40/50")),
            member("B1", MemberKind::Beam, None),
        ],
        steel: Vec::new(),
        warnings: Vec::new(),
    }
}

fn there_and_back(model: &Model) -> Model {
    let folder = folder();
    let path = folder.path().join("model.glb");
    gltf::write_glb(&path, model).expect("written");
    let problems = gltf::validate(&path, &Job::default()).expect("readable");
    assert_eq!(problems, [], "our own file has problems");
    another_reader_agrees(&path, model);
    gltf::import(&path, &Job::default()).expect("legal")
}

/// Where a bar runs and how a member lies are said by nodes; what is damaged of it is left out.
#[test]
fn lines_of_steel_and_frames_come_back() {
    let line = SteelLine {
        name: "bar 1".into(),
        part: Part::Bar,
        diameter: 0.016,
        line: vec![Vec3::ZERO, Vec3::Y, Vec3::new(0.5, 1.25, 0.0)],
        grade: Grade::named("B500B").map(|g| g.at(Some(420.0))),
        bond: Bond::Slip,
        ends: [BarEnd::Straight, BarEnd::Hooked],
        inward: Vec3::new(0.0, 0.0, 0.25),
        prestress: None,
    };
    let frame = Frame { start: Vec3::X, axis: Vec3::new(1.5, 2.0, 0.0), zero: Vec3::Z };
    let mut model = rich();
    model.members[0].frame = frame;
    model.steel = vec![(1, line.clone())];
    let folder = folder();
    let path = folder.path().join("model.glb");
    gltf::write_glb(&path, &model).expect("written");
    let back = gltf::import(&path, &Job::default()).expect("legal");
    assert_eq!(back.members[0].frame, frame);
    assert_eq!(back.steel.len(), 1);
    assert_eq!(back.steel[0].1, line);
    assert_eq!(back.objects[back.steel[0].0].name, "bar 1");
    model.steel[0].1.diameter = 0.0;
    gltf::write_glb(&path, &model).expect("written");
    let back = gltf::import(&path, &Job::default()).expect("legal");
    assert!(back.steel.is_empty() && back.warnings.iter().any(|w| w.contains("line of steel")));
}

/// The crate `gltf` reads the file and finds every object, lamp, camera and material of the model
/// in it.
fn another_reader_agrees(path: &Path, model: &Model) {
    let ::gltf::Gltf { document, blob } =
        ::gltf::Gltf::open(path).expect("legal for the crate gltf");
    let blob = blob.unwrap_or_default();
    let mut nodes = document.default_scene().expect("a scene").nodes();
    let mut introduced = HashSet::new();
    for object in model.objects.iter().filter(|o| !model.meshes[o.mesh].triangles.is_empty()) {
        let node = nodes.next().expect("a node for each object");
        assert_eq!(node.name(), Some(object.name.as_str()));
        another_reader_has_the_mesh(&node, &blob, object, model);
        let mut extras = node
            .extras()
            .as_ref()
            .map(|raw| serde_json::from_str::<Value>(raw.get()).expect("JSON"));
        // How it lies is looked at where it comes back.
        if let Some(ours) = extras.as_mut().and_then(|e| e["intrados"].as_object_mut()) {
            ours.remove("frame");
        }
        assert_eq!(
            extras,
            object.member.map(
                |m| json!({ "intrados": identity(model, m, object.part, introduced.insert(m)) })
            )
        );
    }
    let lamps = model
        .lamps
        .iter()
        .enumerate()
        .filter(|(_, l)| !matches!(l.kind, LampKind::Environment { .. }));
    for (i, lamp) in lamps {
        let node = nodes.next().expect("a node for each lamp");
        assert_eq!(
            (node.name(), node.light().expect("a light").name()),
            (Some(&*format!("lamp {i}")), Some(&*lamp.name))
        );
    }
    for camera in &model.cameras {
        let node = nodes.next().expect("a node for each camera");
        assert_eq!(
            (node.name(), node.camera().expect("a camera").name()),
            (Some(&*camera.name), Some(&*camera.name))
        );
        let (position, ..) = node.transform().decomposed();
        assert_eq!(Vec3::from(position), camera.position);
    }
    assert!(nodes.next().is_none());
    let materials: Vec<_> = document.materials().map(|m| m.name().map(String::from)).collect();
    assert_eq!(materials, model.materials.iter().map(|m| Some(m.name.clone())).collect::<Vec<_>>());
    for (ours, theirs) in model.materials.iter().zip(document.materials()) {
        let ior = if let Surface::Dielectric { ior, .. } = ours.surface { Some(ior) } else { None };
        assert_eq!(
            (theirs.ior(), theirs.transmission().map(|t| t.transmission_factor())),
            (ior, ior.map(|_| 1.0)),
            "{}",
            ours.name
        );
        let nits = Vec3::from(theirs.emissive_factor()) * theirs.emissive_strength().unwrap_or(1.0);
        assert!(
            near(nits, 683.0 * ours.emission) && theirs.double_sided(),
            "{}: {nits}",
            ours.name
        );
        let pbr = theirs.pbr_metallic_roughness();
        let texture =
            pbr.base_color_texture().map(|t| (t.texture().index(), t.tex_coord() as usize));
        assert_eq!(
            texture,
            ours.base_texture.as_ref().map(|t| (t.texture, t.set)),
            "{}",
            ours.name
        );
        assert!(
            near(Vec4::from(pbr.base_color_factor()).truncate(), ours.base_colour),
            "{}",
            ours.name
        );
    }
}

/// Bit for bit, but for objects that are sheared: those are baked, within rounding.
fn another_reader_has_the_mesh(node: &::gltf::Node, blob: &[u8], object: &Object, model: &Model) {
    let mesh = &model.meshes[object.mesh];
    let transform = Mat4::from_cols_array_2d(&node.transform().matrix());
    let primitive = node.mesh().expect("a mesh").primitives().next().expect("a primitive");
    let default = model.materials[object.material] == Material::default();
    assert_eq!(
        primitive.material().index(),
        (!default).then_some(object.material),
        "{}",
        object.name
    );
    let reader = primitive.reader(|_| Some(blob));
    let positions: Vec<Vec3> =
        reader.read_positions().expect("positions").map(Vec3::from).collect();
    let indices: Vec<u32> = reader.read_indices().expect("indices").into_u32().collect();
    if transform == object.transform {
        assert_eq!(
            (positions, indices.as_slice()),
            (mesh.positions.clone(), mesh.triangles.as_flattened()),
            "{}",
            object.name
        );
    } else {
        let placed = mesh.positions.iter().map(|&p| object.transform.transform_point3(p));
        assert!(
            transform == Mat4::IDENTITY
                && positions.into_iter().zip(placed).all(|(a, b)| near(a, b)),
            "{}",
            object.name
        );
    }
    let normals = reader.read_normals().map_or(0, |n| n.count());
    let sets = [0, 1].map(|set| reader.read_tex_coords(set).map_or(0, |uv| uv.into_f32().count()));
    let colours = reader.read_colors(0).map_or(0, |c| c.into_rgb_f32().count());
    assert_eq!(
        (normals, sets, colours),
        (mesh.normals.len(), [mesh.uv[0].len(), mesh.uv[1].len()], mesh.colours.len()),
        "{}",
        object.name
    );
}

/// What a node says of its member.
fn identity(model: &Model, member: usize, part: Part, first: bool) -> Value {
    let member = &model.members[member];
    let mut said = json!({ "member": member.id });
    match part {
        Part::Concrete => said["part"] = "concrete".into(),
        Part::Bar => said["part"] = "bar".into(),
        Part::Stirrup => said["part"] = "stirrup".into(),
        Part::Tendon => said["part"] = "tendon".into(),
        Part::Scenery => {}
    }
    if first {
        said["name"] = member.name.as_str().into();
        said["kind"] = serde_json::to_value(member.kind).expect("a word");
        if !member.concrete_assumed {
            said["concrete"] = member.concrete.as_str().into();
        }
    }
    said
}

fn near(a: Vec3, b: Vec3) -> bool {
    a.abs_diff_eq(b, 2e-5 * (1.0 + b.length()))
}

#[test]
fn a_model_comes_back_as_it_was() {
    let model = rich();
    let back = there_and_back(&model);
    assert_eq!(back.objects.len(), model.objects.len());
    for (ours, theirs) in model.objects.iter().zip(&back.objects) {
        assert_eq!(model.meshes[ours.mesh], back.meshes[theirs.mesh], "{}", ours.name);
        let (a, b) = (&model.materials[ours.material], &back.materials[theirs.material]);
        assert_eq!(
            (&a.name, a.assumed, &a.surface, &a.base_texture.is_some()),
            (&b.name, b.assumed, &b.surface, &b.base_texture.is_some())
        );
        assert!(near(a.base_colour, b.base_colour) && near(a.emission, b.emission), "{a:?} {b:?}");
        assert_eq!(
            (&ours.name, ours.transform, ours.member, ours.part),
            (&theirs.name, theirs.transform, theirs.member, theirs.part)
        );
    }
    let (a, b) = (&model.materials[1].base_texture, &back.materials[1].base_texture);
    let (a, b) =
        (a.as_ref().expect("a texture").transform, b.as_ref().expect("a texture").transform);
    assert!(a.abs_diff_eq(b, 1e-5), "{a:?} {b:?}");
    // 0 and 1 survive eight bits and the sRGB curve.
    let wrapped =
        back.textures.iter().find(|t| t.wrap == [Wrap::Mirror, Wrap::Clamp]).expect("the texture");
    assert_eq!(wrapped.texels, model.textures[0].texels);
    for (ours, theirs) in model.members.iter().zip(&back.members) {
        assert_eq!((&ours.id, &ours.name, ours.kind), (&theirs.id, &theirs.name, theirs.kind));
        assert_eq!(
            (&ours.concrete, ours.concrete_assumed),
            (&theirs.concrete, theirs.concrete_assumed)
        );
    }
    assert!((back.members[0].volume - 0.48).abs() < 1e-6, "{}", back.members[0].volume);
    assert!(
        near(back.members[0].bounds[0], Vec3::new(-0.2, -0.5, -0.2))
            && near(back.members[0].bounds[1], Vec3::new(0.2, 2.5, 0.2))
    );
    // A scale of (1, 2, −½) keeps the volume.
    assert!((back.members[1].volume - 0.48).abs() < 1e-6, "{}", back.members[1].volume);
}

#[test]
fn lamps_and_cameras_come_back() {
    let model = rich();
    let back = there_and_back(&model);
    let shape = |lamp: &Lamp| match lamp.kind {
        LampKind::Point { position, intensity } => (position, Vec3::ZERO, intensity, [0.0; 2]),
        LampKind::Spot { position, direction, intensity, inner, outer } => {
            (position, direction, intensity, [inner, outer])
        }
        LampKind::Directional { direction, irradiance } => {
            (Vec3::ZERO, direction, irradiance, [0.0; 2])
        }
        LampKind::Environment { .. } => panic!("none was written"),
    };
    assert_eq!(back.lamps.len(), 3);
    for (ours, theirs) in model.lamps.iter().zip(&back.lamps) {
        assert_eq!(
            (&ours.name, std::mem::discriminant(&ours.kind)),
            (&theirs.name, std::mem::discriminant(&theirs.kind))
        );
        let (a, b) = (shape(ours), shape(theirs));
        assert!(
            near(a.0, b.0)
                && near(a.1, b.1)
                && near(a.2, b.2)
                && a.3.iter().zip(b.3).all(|(a, b)| (a - b).abs() < 1e-5),
            "{a:?} {b:?}"
        );
    }
    let (ours, theirs) = (&model.cameras[0], &back.cameras[0]);
    assert_eq!((theirs.width, theirs.height), (960, 720));
    assert!(
        (ours.fov_deg - theirs.fov_deg).abs() < 1e-3 && near(ours.position, theirs.position),
        "{theirs:?}"
    );
    for i in 0..3 {
        assert!(near(ours.frame()[i], theirs.frame()[i]));
    }
}

#[test]
fn shared_meshes_stay_shared_and_sheared_ones_are_baked() {
    let mut model = rich();
    model.objects.iter_mut().for_each(|o| o.material = 0);
    let back = there_and_back(&model);
    assert_eq!(back.meshes.len(), 2);
    let shear = Mat4::from_cols(Vec4::X, Vec4::new(0.5, 1.0, 0.0, 0.0), -Vec4::Z, Vec4::W);
    model.objects = vec![object("sheared", 0, shear, Some(0), Part::Concrete)];
    let back = there_and_back(&model);
    let at = |m: &Model, i| {
        m.objects[0].transform.transform_point3(m.meshes[m.objects[0].mesh].positions[i])
    };
    assert!((0..24).all(|i| near(at(&model, i), at(&back, i))));
    // Mirrored, so the winding turned round: it still encloses a positive volume.
    assert!((back.meshes[0].volume() - 0.48).abs() < 1e-6);
}

#[test]
fn bundled_scenes_come_back() {
    for (name, _) in bundled() {
        let model =
            Model::from(&Scene::load_bundled(name, &Job::default()).expect("a bundled scene"));
        let back = there_and_back(&model);
        assert_eq!(
            (back.objects.len(), back.members.len()),
            (model.objects.len(), model.members.len()),
            "{name}"
        );
    }
}

#[test]
fn nonsense_is_not_written() {
    let folder = folder();
    let path = folder.path().join("model.glb");
    let spoilers: [fn(&mut Model); 5] = [
        |m| m.objects[0].mesh = 9,
        |m| m.objects[0].material = 9,
        |m| m.objects[0].member = Some(9),
        |m| m.objects[0].transform.x_axis.x = f32::NAN,
        |m| {
            m.meshes[0] =
                Arc::new(Mesh { triangles: vec![[0, 1, 99]], ..Mesh::clone(&m.meshes[0]) })
        },
    ];
    for spoil in spoilers {
        let mut model = rich();
        spoil(&mut model);
        assert_eq!(
            gltf::write_glb(&path, &model).expect_err("nonsense").kind(),
            std::io::ErrorKind::InvalidInput
        );
        assert!(
            !path.exists() && folder.path().read_dir().expect("a folder").count() == 0,
            "something was left behind"
        );
    }
}

/// Writes a `.gltf` with one buffer file beside it.
struct Bench(TempDir);

impl Bench {
    fn new() -> Self {
        Self(folder())
    }

    fn path(&self) -> PathBuf {
        self.0.path().join("model.gltf")
    }

    fn import(&self, json: &Value, data: &[u8]) -> Result<Model, ImportError> {
        fs::write(self.0.path().join("data one.bin"), data).expect("written");
        fs::write(self.path(), json.to_string()).expect("written");
        gltf::import(&self.path(), &Job::default())
    }
}

/// A scene of one mesh with the given primitive, accessors and views.
fn scene(primitive: Value, accessors: Value, views: Value, bytes: usize) -> Value {
    json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "name": "COL_1" }],
        "meshes": [{ "primitives": [primitive] }],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{ "uri": "data%20one.bin", "byteLength": bytes }],
    })
}

fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

const SQUARE: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];

fn square_scene(mode: u32) -> Value {
    let position = json!({ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] });
    scene(
        json!({ "attributes": { "POSITION": 0 }, "mode": mode }),
        json!([position]),
        json!([{ "buffer": 0, "byteLength": 48 }]),
        48,
    )
}

#[test]
fn strips_and_fans_become_triangles() {
    let bench = Bench::new();
    let triangles = |mode| {
        bench
            .import(&square_scene(mode), &floats(&SQUARE))
            .expect("legal")
            .meshes
            .first()
            .map(|m| m.triangles.clone())
    };
    assert_eq!(triangles(4), Some(vec![[0, 1, 2]]));
    assert_eq!(triangles(5), Some(vec![[0, 1, 2], [2, 1, 3]]));
    assert_eq!(triangles(6), Some(vec![[0, 1, 2], [0, 2, 3]]));
    for wires in 0..4 {
        assert_eq!(triangles(wires), None);
    }
}

#[test]
fn names_make_members_and_sizes_are_doubted() {
    let bench = Bench::new();
    let mut json = square_scene(5);
    json["nodes"][0]["scale"] = json!([5000, 5000, 5000]);
    let model = bench.import(&json, &floats(&SQUARE)).expect("legal");
    assert_eq!(
        (model.members[0].kind, model.members[0].concrete_assumed, model.members[0].volume),
        (MemberKind::Column, true, 0.0)
    );
    assert!(
        model.warnings.iter().any(|w| w.contains("mm or m"))
            && model.warnings.iter().any(|w| w.contains("no material"))
    );
}

#[test]
fn members_without_a_surface_are_left_out_and_groups_pass_theirs_on() {
    let mut json = square_scene(5);
    json["nodes"] = json!([{ "name": "BEAM_9" }, { "name": "COL_1", "children": [2] }, { "mesh": 0 }, { "name": "COL_1", "mesh": 0 }]);
    json["scenes"] = json!([{ "nodes": [0, 1, 3] }]);
    let model = Bench::new().import(&json, &floats(&SQUARE)).expect("legal");
    assert_eq!(
        model.members.iter().map(|m| m.id.as_str()).collect::<Vec<_>>(),
        ["COL_1", "COL_1 #2"]
    );
    assert_eq!(model.objects.iter().map(|o| o.member).collect::<Vec<_>>(), [Some(0), Some(1)]);
}

#[test]
fn properties_name_members_and_drop_voids() {
    let bench = Bench::new();
    let mut json = square_scene(5);
    json["nodes"] = json!([{ "name": "room", "mesh": 0 }, { "name": "2O2Fr$t4X7Zf8NOew3FLOH", "mesh": 0 }, { "name": "fence", "mesh": 0 }]);
    json["scenes"] = json!([{ "nodes": [0, 1, 2] }]);
    let properties = json!({
        "room": { "type": "IfcSpace" },
        "2O2Fr$t4X7Zf8NOew3FLOH": { "type": "IfcColumn", "name": "pier", "materials": ["Concrete C40/50"] },
        "fence": { "type": "IfcRailing" },
    });
    fs::write(bench.0.path().join("model.props.json"), properties.to_string()).expect("written");
    let model = bench.import(&json, &floats(&SQUARE)).expect("legal");
    assert_eq!(model.objects.len(), 2);
    assert_eq!(model.members.len(), 1);
    let pier = &model.members[0];
    assert_eq!(
        (pier.name.as_str(), pier.concrete.as_str(), pier.concrete_assumed),
        ("pier", "C40/50", false)
    );
}

#[test]
fn sparse_and_absent_data_is_zeros_but_for_what_it_replaces() {
    let mut data = vec![1, 3];
    data.resize(4, 0);
    data.extend(floats(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0]));
    let sparse = json!({
        "count": 2,
        "indices": { "bufferView": 0, "componentType": 5121 },
        "values": { "bufferView": 1 },
    });
    let position = json!({ "componentType": 5126, "count": 4.0, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0], "sparse": sparse });
    let views = json!([{ "buffer": 0, "byteLength": 2 }, { "buffer": 0, "byteOffset": 4, "byteLength": 24 }]);
    let json =
        scene(json!({ "attributes": { "POSITION": 0 }, "mode": 6 }), json!([position]), views, 28);
    let model = Bench::new().import(&json, &data).expect("legal");
    assert_eq!(model.meshes[0].positions, [Vec3::ZERO, Vec3::X, Vec3::ZERO, Vec3::Y]);
}

#[test]
fn integers_are_normalised_and_vertices_may_interleave() {
    // Per vertex: position as three i16 and two bytes of padding, colour as four u8.
    let mut data = Vec::new();
    for (p, c) in [([0_i16, 0, 0], 0_u8), ([32767, 0, 0], 51), ([0, -32768, 0], 255)] {
        data.extend(p.iter().flat_map(|x| x.to_le_bytes()));
        data.extend([0, 0, c, c, c, 255]);
    }
    data.extend([0_u8, 1, 2]);
    let position = json!({ "bufferView": 0, "componentType": 5122, "normalized": true, "count": 3, "type": "VEC3", "min": [0, -32768, 0], "max": [32767, 0, 0] });
    let colour = json!({ "bufferView": 0, "byteOffset": 8, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC4" });
    let indices = json!({ "bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR" });
    let views = json!([{ "buffer": 0, "byteLength": 36, "byteStride": 12 }, { "buffer": 0, "byteOffset": 36, "byteLength": 3 }]);
    let mut json = scene(
        json!({ "attributes": { "POSITION": 0, "COLOR_0": 1 }, "indices": 2 }),
        json!([position, colour, indices]),
        views,
        39,
    );
    json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    let model = Bench::new().import(&json, &data).expect("legal");
    assert_eq!(model.meshes[0].positions, [Vec3::ZERO, Vec3::X, Vec3::NEG_Y]);
    assert_eq!(model.meshes[0].colours, [0.0, 0.2, 1.0].map(Vec3::splat));
}

#[test]
fn a_shared_vertex_buffer_is_not_copied_for_every_part() {
    let vertices = 30_000;
    let mut data = floats(&(0..3 * vertices).map(|i| (i % 7) as f32).collect::<Vec<_>>());
    let bytes = data.len();
    data.extend([5_u32, 29_000, 7].iter().flat_map(|i| i.to_le_bytes()));
    let position = json!({ "bufferView": 0, "componentType": 5126, "count": vertices, "type": "VEC3", "min": [0, 0, 0], "max": [6, 6, 6] });
    let indices = json!({ "bufferView": 1, "componentType": 5125, "count": 3, "type": "SCALAR" });
    let views = json!([{ "buffer": 0, "byteLength": bytes }, { "buffer": 0, "byteOffset": bytes, "byteLength": 12 }]);
    let json = scene(
        json!({ "attributes": { "POSITION": 0 }, "indices": 1 }),
        json!([position, indices]),
        views,
        data.len(),
    );
    let mesh = &Bench::new().import(&json, &data).expect("legal").meshes[0];
    assert_eq!((mesh.positions.len(), mesh.triangles.as_slice()), (3, &[[0, 2, 1]][..]));
    let vertex = |i: usize| {
        Vec3::new(((3 * i) % 7) as f32, ((3 * i + 1) % 7) as f32, ((3 * i + 2) % 7) as f32)
    };
    assert_eq!(mesh.positions, [vertex(5), vertex(7), vertex(29_000)]);
}

#[test]
fn meshopt_is_unpacked() {
    let vertices: Vec<[f32; 3]> = SQUARE.chunks(3).map(|p| [p[0], p[1], p[2]]).collect();
    let mut data = meshopt::encode_vertex_buffer(&vertices).expect("packed");
    let vertex_bytes = data.len();
    let indices = meshopt::encode_index_buffer(&[0, 1, 2, 2, 1, 3], 4).expect("packed");
    data.resize(vertex_bytes.next_multiple_of(4), 0);
    let offset = data.len();
    data.extend(&indices);
    let packed = |offset: usize, length: usize, stride: usize, count: usize, mode: &str| {
        let extension = json!({ "buffer": 0, "byteOffset": offset, "byteLength": length, "byteStride": stride, "count": count, "mode": mode });
        json!({ "buffer": 1, "byteLength": stride * count, "extensions": { "EXT_meshopt_compression": extension } })
    };
    let position = json!({ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] });
    let index = json!({ "bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR" });
    let views = json!([
        packed(0, vertex_bytes, 12, 4, "ATTRIBUTES"),
        packed(offset, indices.len(), 2, 6, "TRIANGLES")
    ]);
    let mut json = scene(
        json!({ "attributes": { "POSITION": 0 }, "indices": 1 }),
        json!([position, index]),
        views,
        data.len(),
    );
    json["buffers"] = json!([json["buffers"][0], { "byteLength": 64, "extensions": { "EXT_meshopt_compression": { "fallback": true } } }]);
    json["extensionsUsed"] = json!(["EXT_meshopt_compression"]);
    json["extensionsRequired"] = json["extensionsUsed"].clone();
    let bench = Bench::new();
    let model = bench.import(&json, &data).expect("legal");
    assert_eq!(
        model.meshes[0].positions,
        vertices.into_iter().map(Vec3::from_array).collect::<Vec<_>>()
    );
    let area = model.meshes[0].area();
    assert!((area - 1.0).abs() < 1e-12 && model.meshes[0].triangles.len() == 2);
    // The decoder trusts its sizes; we do not.
    for (key, value) in [
        ("count", json!(7)),
        ("byteStride", json!(3)),
        ("count", json!(u32::MAX)),
        ("mode", json!("NONSENSE")),
        ("byteLength", json!(5)),
    ] {
        let mut json = json.clone();
        json["bufferViews"][1]["extensions"]["EXT_meshopt_compression"][key] = value;
        let error = bench.import(&json, &data).expect_err("damaged").to_string();
        assert!(error.contains("/bufferViews/1"), "{error}");
    }
}

/// The one line with which a file is refused.
fn refusal(json: &Value, data: &[u8]) -> String {
    let line = Bench::new().import(json, data).expect_err("damaged").to_string();
    assert!(!line.contains('\n') && line.contains("model.gltf"), "{line}");
    line
}

#[test]
fn what_is_damaged_is_refused_with_its_place() {
    let mut json = square_scene(5);
    json["nodes"][0]["children"] = json!([0]);
    assert!(refusal(&json, &floats(&SQUARE)).contains("/nodes/0"));

    let mut json = square_scene(5);
    json["nodes"] = (0..300)
        .map(|i| if i < 299 { json!({ "children": [i + 1] }) } else { json!({ "mesh": 0 }) })
        .collect();
    assert!(refusal(&json, &floats(&SQUARE)).contains("256 deep"));

    let mut data = floats(&SQUARE);
    data.splice(4..8, f32::NAN.to_le_bytes());
    assert!(refusal(&square_scene(5), &data).contains("NaN"));

    let mut json = square_scene(5);
    json["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
    json["extensionsRequired"] = json["extensionsUsed"].clone();
    assert!(refusal(&json, &floats(&SQUARE)).contains("compressed by Draco"));

    let mut json = square_scene(5);
    json["accessors"][0]["count"] = json!(1e18);
    assert!(refusal(&json, &floats(&SQUARE)).contains("/accessors/0"));

    assert!(refusal(&square_scene(5), &floats(&SQUARE)[..40]).contains("40 bytes"));
}

#[test]
fn a_small_file_cannot_ask_for_much_memory() {
    // 2^31 vertices without a byte behind them.
    let position = json!({ "componentType": 5126, "count": 1_u64 << 31, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0] });
    let json = scene(
        json!({ "attributes": { "POSITION": 0 }, "mode": 0 }),
        json!([position]),
        json!([{ "buffer": 0, "byteLength": 4 }]),
        4,
    );
    assert!(Bench::new().import(&json, &[0; 4]).is_ok(), "points need no vertices");
    let mut json = json;
    json["meshes"][0]["primitives"][0]["mode"] = json!(4);
    assert!(refusal(&json, &[0; 4]).contains("limit"));
    // The same million zeros a thousand times.
    json["accessors"][0]["count"] = json!(3_000_000);
    let primitive = json["meshes"][0]["primitives"][0].clone();
    json["meshes"][0]["primitives"] = vec![primitive; 1000].into();
    assert!(refusal(&json, &[0; 4]).contains("limit"));
    // Text that would swell two hundredfold.
    let bench = Bench::new();
    fs::write(bench.path(), format!("[{}]", "{\"\":[0]},".repeat(2_000_000))).expect("written");
    let error = gltf::import(&bench.path(), &Job::default()).expect_err("too big").to_string();
    assert!(error.contains("too big"), "{error}");
}

#[test]
fn paths_stay_beside_the_model() {
    let bench = Bench::new();
    fs::create_dir(bench.0.path().join("inner")).expect("made");
    let inner = bench.0.path().join("inner/model.gltf");
    fs::write(bench.0.path().join("outside.bin"), floats(&SQUARE)).expect("written");
    let absolute = bench.0.path().join("outside.bin").to_string_lossy().into_owned();
    let file = format!("file://{absolute}");
    for uri in [
        "../outside.bin",
        "%2e%2e/outside.bin",
        "..\\outside.bin",
        "C:/outside.bin",
        "a/../../outside.bin",
        &absolute,
        &file,
        "",
    ] {
        let mut json = square_scene(5);
        json["buffers"][0]["uri"] = json!(uri);
        fs::write(&inner, json.to_string()).expect("written");
        let error = gltf::import(&inner, &Job::default()).expect_err("an escape").to_string();
        assert!(error.contains("/buffers/0/uri"), "{uri}: {error}");
    }
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../outside.bin", bench.0.path().join("inner/link.bin"))
            .expect("linked");
        let mut json = square_scene(5);
        json["buffers"][0]["uri"] = json!("link.bin");
        fs::write(&inner, json.to_string()).expect("written");
        assert!(gltf::import(&inner, &Job::default()).is_err());
    }
}

#[test]
fn a_lost_texture_costs_only_itself() {
    let mut json = square_scene(5);
    json["meshes"][0]["primitives"][0]["material"] = json!(0);
    json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(1);
    json["accessors"] =
        json!([json["accessors"][0], { "componentType": 5126, "count": 4, "type": "VEC2" }]);
    json["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "baseColorFactor": [1, 0, 0, 1] } }]);
    json["textures"] = json!([{ "source": 0 }]);
    json["images"] = json!([{ "uri": "lost.png" }]);
    let model = Bench::new().import(&json, &floats(&SQUARE)).expect("geometry is whole");
    assert_eq!(
        (model.materials[0].base_colour, model.materials[0].base_texture.is_none()),
        (Vec3::X, true)
    );
    assert!(model.warnings.iter().any(|w| w.contains("lost.png")), "{:?}", model.warnings);
}

#[test]
fn a_cancelled_import_stops() {
    let bench = Bench::new();
    fs::write(bench.path(), "{}").expect("written");
    let job = Job::default();
    job.cancel();
    assert!(matches!(gltf::import(&bench.path(), &job), Err(ImportError::Cancelled(_))));
    assert!(matches!(gltf::validate(&bench.path(), &job), Err(ImportError::Cancelled(_))));
}
