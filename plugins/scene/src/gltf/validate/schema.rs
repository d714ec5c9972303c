//! The shape of every object: which properties it has, of what type, in what range, which of them
//! must be there.

use std::collections::HashSet;

use serde_json::Value;

use super::Check;
use crate::gltf::{
    json::{Json, as_index, escaped},
    problem::remedy::{EXPORT, REFERENCE},
};

/// What a property may be.
enum Kind {
    Bool,
    Text,
    /// A text out of a list; others are only warned about, extensions may add some.
    Word(&'static [&'static str]),
    /// A text out of a list, and no other.
    OneOf(&'static [&'static str]),
    /// A number out of a list, likewise.
    Code(&'static [u64]),
    /// An integer from, to.
    Whole(u64, u64),
    /// A number from, to, both included.
    Number(f64, f64),
    /// A number above.
    Above(f64),
    /// Zero, or a number from.
    ZeroOrFrom(f64),
    /// An index into a list of the root.
    Index(&'static str),
    /// An index into the lights of `KHR_lights_punctual`.
    Light,
    Object(&'static [Property]),
    /// Vertex attributes: any names, indices of accessors.
    Attributes,
    /// Elements, least and most, all different.
    List(&'static Kind, usize, usize),
    Distinct(&'static Kind),
}

/// Name, what it may be, whether it must be there.
struct Property(&'static str, Kind, bool);

use Kind::{
    Above, Attributes, Bool, Code, Distinct, Index, Light, List, Number, Object, OneOf, Text,
    Whole, Word, ZeroOrFrom,
};

const MANY: usize = usize::MAX;
const ANY: Kind = Number(f64::MIN, f64::MAX);
const SHARE: Kind = Number(0.0, 1.0);
const FROM_ZERO: Kind = Number(0.0, f64::MAX);
const SIZE: Kind = Whole(1, u64::MAX);
const OFFSET: Kind = Whole(0, u64::MAX);
const NAME: Property = Property("name", Text, false);

const ROOT: &[Property] = &[
    Property("asset", Object(ASSET), true),
    Property("extensionsUsed", Distinct(&Text), false),
    Property("extensionsRequired", Distinct(&Text), false),
    Property("scene", Index("scenes"), false),
    Property("accessors", List(&Object(ACCESSOR), 1, MANY), false),
    Property("animations", List(&Object(ANIMATION), 1, MANY), false),
    Property("buffers", List(&Object(BUFFER), 1, MANY), false),
    Property("bufferViews", List(&Object(BUFFER_VIEW), 1, MANY), false),
    Property("cameras", List(&Object(CAMERA), 1, MANY), false),
    Property("images", List(&Object(IMAGE), 1, MANY), false),
    Property("materials", List(&Object(MATERIAL), 1, MANY), false),
    Property("meshes", List(&Object(MESH), 1, MANY), false),
    Property("nodes", List(&Object(NODE), 1, MANY), false),
    Property("samplers", List(&Object(SAMPLER), 1, MANY), false),
    Property("scenes", List(&Object(SCENE), 1, MANY), false),
    Property("skins", List(&Object(SKIN), 1, MANY), false),
    Property("textures", List(&Object(TEXTURE), 1, MANY), false),
];

const ASSET: &[Property] = &[
    Property("version", Text, true),
    Property("minVersion", Text, false),
    Property("generator", Text, false),
    Property("copyright", Text, false),
];

const ACCESSOR: &[Property] = &[
    NAME,
    Property("bufferView", Index("bufferViews"), false),
    Property("byteOffset", OFFSET, false),
    Property("componentType", Code(&[5120, 5121, 5122, 5123, 5125, 5126]), true),
    Property("normalized", Bool, false),
    Property("count", SIZE, true),
    Property("type", Word(&["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"]), true),
    Property("max", List(&ANY, 1, 16), false),
    Property("min", List(&ANY, 1, 16), false),
    Property("sparse", Object(SPARSE), false),
];

const SPARSE: &[Property] = &[
    Property("count", SIZE, true),
    Property("indices", Object(SPARSE_INDICES), true),
    Property("values", Object(SPARSE_VALUES), true),
];

const SPARSE_INDICES: &[Property] = &[
    Property("bufferView", Index("bufferViews"), true),
    Property("byteOffset", OFFSET, false),
    Property("componentType", Code(&[5121, 5123, 5125]), true),
];

const SPARSE_VALUES: &[Property] =
    &[Property("bufferView", Index("bufferViews"), true), Property("byteOffset", OFFSET, false)];

const BUFFER: &[Property] =
    &[NAME, Property("uri", Text, false), Property("byteLength", SIZE, true)];

const BUFFER_VIEW: &[Property] = &[
    NAME,
    Property("buffer", Index("buffers"), true),
    Property("byteOffset", OFFSET, false),
    Property("byteLength", SIZE, true),
    Property("byteStride", Whole(4, 252), false),
    Property("target", Code(&[34962, 34963]), false),
];

const ANIMATION: &[Property] = &[
    NAME,
    Property("channels", List(&Object(CHANNEL), 1, MANY), true),
    Property("samplers", List(&Object(KEYFRAMES), 1, MANY), true),
];

const CHANNEL: &[Property] =
    &[Property("sampler", OFFSET, true), Property("target", Object(TARGET), true)];

const TARGET: &[Property] = &[
    Property("node", Index("nodes"), false),
    Property("path", Word(&["translation", "rotation", "scale", "weights", "pointer"]), true),
];

const KEYFRAMES: &[Property] = &[
    Property("input", Index("accessors"), true),
    Property("interpolation", Word(&["LINEAR", "STEP", "CUBICSPLINE"]), false),
    Property("output", Index("accessors"), true),
];

const CAMERA: &[Property] = &[
    NAME,
    Property("orthographic", Object(ORTHOGRAPHIC), false),
    Property("perspective", Object(PERSPECTIVE), false),
    Property("type", Word(&["perspective", "orthographic"]), true),
];

const ORTHOGRAPHIC: &[Property] = &[
    Property("xmag", ANY, true),
    Property("ymag", ANY, true),
    Property("zfar", Above(0.0), true),
    Property("znear", Number(0.0, f64::MAX), true),
];

const PERSPECTIVE: &[Property] = &[
    Property("aspectRatio", Above(0.0), false),
    Property("yfov", Above(0.0), true),
    Property("zfar", Above(0.0), false),
    Property("znear", Above(0.0), true),
];

const IMAGE: &[Property] = &[
    NAME,
    Property("uri", Text, false),
    Property(
        "mimeType",
        Word(&["image/jpeg", "image/png", "image/webp", "image/ktx2", "image/avif"]),
        false,
    ),
    Property("bufferView", Index("bufferViews"), false),
];

const MATERIAL: &[Property] = &[
    NAME,
    Property("pbrMetallicRoughness", Object(PBR), false),
    Property("normalTexture", Object(NORMAL_TEXTURE), false),
    Property("occlusionTexture", Object(OCCLUSION_TEXTURE), false),
    Property("emissiveTexture", Object(TEXTURE_INFO), false),
    Property("emissiveFactor", List(&SHARE, 3, 3), false),
    Property("alphaMode", Word(&["OPAQUE", "MASK", "BLEND"]), false),
    Property("alphaCutoff", Number(0.0, f64::MAX), false),
    Property("doubleSided", Bool, false),
];

const PBR: &[Property] = &[
    Property("baseColorFactor", List(&SHARE, 4, 4), false),
    Property("baseColorTexture", Object(TEXTURE_INFO), false),
    Property("metallicFactor", SHARE, false),
    Property("roughnessFactor", SHARE, false),
    Property("metallicRoughnessTexture", Object(TEXTURE_INFO), false),
];

const TEXTURE_INFO: &[Property] =
    &[Property("index", Index("textures"), true), Property("texCoord", OFFSET, false)];

const NORMAL_TEXTURE: &[Property] = &[
    Property("index", Index("textures"), true),
    Property("texCoord", OFFSET, false),
    Property("scale", ANY, false),
];

const OCCLUSION_TEXTURE: &[Property] = &[
    Property("index", Index("textures"), true),
    Property("texCoord", OFFSET, false),
    Property("strength", SHARE, false),
];

const MESH: &[Property] = &[
    NAME,
    Property("primitives", List(&Object(PRIMITIVE), 1, MANY), true),
    Property("weights", List(&ANY, 1, MANY), false),
];

const PRIMITIVE: &[Property] = &[
    Property("attributes", Attributes, true),
    Property("indices", Index("accessors"), false),
    Property("material", Index("materials"), false),
    Property("mode", Code(&[0, 1, 2, 3, 4, 5, 6]), false),
    Property("targets", List(&Attributes, 1, MANY), false),
];

const NODE: &[Property] = &[
    NAME,
    Property("camera", Index("cameras"), false),
    Property("children", Distinct(&Index("nodes")), false),
    Property("skin", Index("skins"), false),
    Property("matrix", List(&ANY, 16, 16), false),
    Property("mesh", Index("meshes"), false),
    Property("rotation", List(&Number(-1.0, 1.0), 4, 4), false),
    Property("scale", List(&ANY, 3, 3), false),
    Property("translation", List(&ANY, 3, 3), false),
    Property("weights", List(&ANY, 1, MANY), false),
];

const SAMPLER: &[Property] = &[
    NAME,
    Property("magFilter", Code(&[9728, 9729]), false),
    Property("minFilter", Code(&[9728, 9729, 9984, 9985, 9986, 9987]), false),
    Property("wrapS", Code(&[33071, 33648, 10497]), false),
    Property("wrapT", Code(&[33071, 33648, 10497]), false),
];

const SCENE: &[Property] = &[NAME, Property("nodes", Distinct(&Index("nodes")), false)];

const SKIN: &[Property] = &[
    NAME,
    Property("inverseBindMatrices", Index("accessors"), false),
    Property("skeleton", Index("nodes"), false),
    Property("joints", Distinct(&Index("nodes")), true),
];

const TEXTURE: &[Property] = &[
    NAME,
    Property("sampler", Index("samplers"), false),
    Property("source", Index("images"), false),
];

/// A right angle, as single precision writes it: 1.57079637 is a little more.
const RIGHT_ANGLE: f64 = std::f32::consts::FRAC_PI_2 as f64 + 1e-7;

const LIGHTS: &[Property] = &[Property("lights", List(&Object(LIGHT), 1, MANY), true)];

const LIGHT: &[Property] = &[
    NAME,
    Property("type", OneOf(&["directional", "point", "spot"]), true),
    Property("color", List(&SHARE, 3, 3), false),
    Property("intensity", FROM_ZERO, false),
    Property("range", Above(0.0), false),
    Property(
        "spot",
        Object(&[
            Property("innerConeAngle", Number(0.0, RIGHT_ANGLE), false),
            Property("outerConeAngle", Number(0.0, RIGHT_ANGLE), false),
        ]),
        false,
    ),
];

const PACKED_VIEW: &[Property] = &[
    Property("buffer", Index("buffers"), true),
    Property("byteOffset", OFFSET, false),
    Property("byteLength", SIZE, true),
    Property("byteStride", Whole(1, 256), true),
    Property("count", SIZE, true),
    Property("mode", OneOf(&["ATTRIBUTES", "TRIANGLES", "INDICES"]), true),
    Property("filter", OneOf(&["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL"]), false),
];

const TEXTURE_TRANSFORM: &[Property] = &[
    Property("offset", List(&ANY, 2, 2), false),
    Property("rotation", ANY, false),
    Property("scale", List(&ANY, 2, 2), false),
    Property("texCoord", OFFSET, false),
];

const SPECULAR_GLOSSINESS: &[Property] = &[
    Property("diffuseFactor", List(&SHARE, 4, 4), false),
    Property("diffuseTexture", Object(TEXTURE_INFO), false),
    Property("specularFactor", List(&SHARE, 3, 3), false),
    Property("glossinessFactor", SHARE, false),
    Property("specularGlossinessTexture", Object(TEXTURE_INFO), false),
];

const VOLUME: &[Property] = &[
    Property("thicknessFactor", FROM_ZERO, false),
    Property("thicknessTexture", Object(TEXTURE_INFO), false),
    Property("attenuationDistance", Above(0.0), false),
    Property("attenuationColor", List(&SHARE, 3, 3), false),
];

const SPECULAR: &[Property] = &[
    Property("specularFactor", SHARE, false),
    Property("specularTexture", Object(TEXTURE_INFO), false),
    Property("specularColorFactor", List(&FROM_ZERO, 3, 3), false),
    Property("specularColorTexture", Object(TEXTURE_INFO), false),
];

const CLEARCOAT: &[Property] = &[
    Property("clearcoatFactor", SHARE, false),
    Property("clearcoatTexture", Object(TEXTURE_INFO), false),
    Property("clearcoatRoughnessFactor", SHARE, false),
    Property("clearcoatRoughnessTexture", Object(TEXTURE_INFO), false),
    Property("clearcoatNormalTexture", Object(NORMAL_TEXTURE), false),
];

const SHEEN: &[Property] = &[
    Property("sheenColorFactor", List(&SHARE, 3, 3), false),
    Property("sheenColorTexture", Object(TEXTURE_INFO), false),
    Property("sheenRoughnessFactor", SHARE, false),
    Property("sheenRoughnessTexture", Object(TEXTURE_INFO), false),
];

const IRIDESCENCE: &[Property] = &[
    Property("iridescenceFactor", SHARE, false),
    Property("iridescenceTexture", Object(TEXTURE_INFO), false),
    Property("iridescenceIor", Number(1.0, f64::MAX), false),
    Property("iridescenceThicknessMinimum", FROM_ZERO, false),
    Property("iridescenceThicknessMaximum", FROM_ZERO, false),
    Property("iridescenceThicknessTexture", Object(TEXTURE_INFO), false),
];

const ANISOTROPY: &[Property] = &[
    Property("anisotropyStrength", SHARE, false),
    Property("anisotropyRotation", ANY, false),
    Property("anisotropyTexture", Object(TEXTURE_INFO), false),
];

/// Extensions whose objects are checked: name, the list of the root below which they stand
/// (`extensions`: the root itself), properties.
const EXTENSIONS: &[(&str, &str, &[Property])] = &[
    ("KHR_lights_punctual", "extensions", LIGHTS),
    ("KHR_lights_punctual", "nodes", &[Property("light", Light, true)]),
    ("EXT_mesh_gpu_instancing", "nodes", &[Property("attributes", Attributes, true)]),
    ("KHR_node_visibility", "nodes", &[Property("visible", Bool, false)]),
    ("EXT_meshopt_compression", "bufferViews", PACKED_VIEW),
    ("EXT_meshopt_compression", "buffers", &[Property("fallback", Bool, false)]),
    ("KHR_texture_basisu", "textures", &[Property("source", Index("images"), false)]),
    ("EXT_texture_webp", "textures", &[Property("source", Index("images"), false)]),
    ("KHR_texture_transform", "materials", TEXTURE_TRANSFORM),
    ("KHR_materials_anisotropy", "materials", ANISOTROPY),
    ("KHR_materials_clearcoat", "materials", CLEARCOAT),
    ("KHR_materials_dispersion", "materials", &[Property("dispersion", FROM_ZERO, false)]),
    (
        "KHR_materials_emissive_strength",
        "materials",
        &[Property("emissiveStrength", FROM_ZERO, false)],
    ),
    // Zero is a mirror for every angle, and every number from that of the vacuum up a material.
    ("KHR_materials_ior", "materials", &[Property("ior", ZeroOrFrom(1.0), false)]),
    ("KHR_materials_iridescence", "materials", IRIDESCENCE),
    ("KHR_materials_pbrSpecularGlossiness", "materials", SPECULAR_GLOSSINESS),
    ("KHR_materials_sheen", "materials", SHEEN),
    ("KHR_materials_specular", "materials", SPECULAR),
    (
        "KHR_materials_transmission",
        "materials",
        &[
            Property("transmissionFactor", SHARE, false),
            Property("transmissionTexture", Object(TEXTURE_INFO), false),
        ],
    ),
    ("KHR_materials_unlit", "materials", &[]),
    ("KHR_materials_volume", "materials", VOLUME),
];

/// Extensions that have no objects of their own and are checked where they speak.
const WITHOUT_OBJECTS: [&str; 1] = ["KHR_mesh_quantization"];

/// `extras.intrados`, below which list of the root, and what is read of it. Whoever writes more
/// into it may.
const OURS: &[(&str, &[Property])] = &[
    (
        "nodes",
        &[
            NAME,
            Property("member", Text, false),
            Property(
                "kind",
                Word(&[
                    "column", "beam", "slab", "wall", "footing", "lining", "segment", "tendon",
                    "bar", "pipe", "other",
                ]),
                false,
            ),
            Property("part", Word(&["concrete", "bar", "stirrup", "tendon"]), false),
            Property("concrete", Text, false),
        ],
    ),
    (
        "materials",
        &[
            Property("surface", Word(&["lambert", "black"]), false),
            Property("assumed", Bool, false),
        ],
    ),
];

/// Holds the whole document against the tables.
pub(super) fn check(check: &mut Check) {
    let root = &check.document.root;
    let declared = root.list("extensionsUsed").iter().filter_map(Value::as_str).collect();
    let mut walk = Walk { check, root, declared, pointer: String::new() };
    walk.object(root, ROOT);
    let required: Vec<&Value> = root.list("extensionsRequired").iter().collect();
    for (i, name) in required.into_iter().enumerate().filter_map(|(i, v)| Some((i, v.as_str()?))) {
        if !walk.declared.contains(name) {
            let message = format!("{name} is required but not listed in extensionsUsed");
            walk.check.error(
                format!("/extensionsRequired/{i}"),
                "EXTENSION_NOT_USED",
                message,
                "list it in extensionsUsed too",
            );
        }
    }
    for (i, name) in
        root.list("extensionsUsed").iter().enumerate().filter_map(|(i, v)| Some((i, v.as_str()?)))
    {
        if !EXTENSIONS.iter().any(|e| e.0 == name) && !WITHOUT_OBJECTS.contains(&name) {
            let message = format!("{name} is neither read nor checked");
            walk.check.note(
                format!("/extensionsUsed/{i}"),
                "EXTENSION_NOT_CHECKED",
                message,
                "look it over with the validator of its makers",
            );
        }
    }
}

struct Walk<'a, 'b> {
    check: &'b mut Check<'a>,
    root: &'a Value,
    declared: HashSet<&'a str>,
    pointer: String,
}

impl<'a> Walk<'a, '_> {
    /// Goes one step down, does `work` there, and comes back.
    fn at(&mut self, segment: &str, work: impl FnOnce(&mut Self)) {
        let length = self.pointer.len();
        self.pointer.push('/');
        self.pointer.push_str(&escaped(segment));
        work(self);
        self.pointer.truncate(length);
    }

    fn error(&mut self, code: &'static str, message: impl Into<String>, remedy: &'static str) {
        self.check.error(self.pointer.clone(), code, message, remedy);
    }

    fn must(&mut self, holds: bool, what: &str) {
        if !holds {
            self.error("TYPE", format!("this must be {what}"), EXPORT);
        }
    }

    fn object(&mut self, value: &'a Value, properties: &'static [Property]) {
        self.properties(value, properties);
        for (name, value) in value.as_object().into_iter().flatten() {
            match name.as_str() {
                "extensions" => self.at(name, |walk| walk.extensions(value)),
                "extras" => self.at(name, |walk| walk.extras(value)),
                _ if properties.iter().any(|p| p.0 == name) => {}
                _ => {
                    let pointer = format!("{}/{}", self.pointer, escaped(name));
                    self.check.warn(
                        pointer,
                        "UNKNOWN_PROPERTY",
                        "glTF knows no such property",
                        "put own data into extras",
                    );
                }
            }
        }
    }

    /// Those properties of an object that the table knows.
    fn properties(&mut self, value: &'a Value, properties: &'static [Property]) {
        let Some(map) = value.as_object() else { return self.must(false, "an object") };
        for Property(name, kind, required) in properties {
            match map.get(*name) {
                Some(value) => self.at(name, |walk| walk.value(value, kind)),
                None if *required => self.error("MISSING", format!("{name} is missing"), EXPORT),
                None => {}
            }
        }
    }

    /// The list of the root that we are in; `extensions` for those of the root itself.
    fn subject(&self) -> &str {
        self.pointer.split('/').nth(1).unwrap_or("")
    }

    /// What we read of an object's own data.
    fn extras(&mut self, value: &'a Value) {
        let Some((_, properties)) = OURS.iter().find(|(subject, _)| *subject == self.subject())
        else {
            return;
        };
        if let Some(ours) = value.get("intrados") {
            self.at("intrados", |walk| walk.properties(ours, properties));
        }
    }

    fn extensions(&mut self, value: &'a Value) {
        let Some(map) = value.as_object() else { return self.must(false, "an object") };
        for (name, extension) in map {
            let declared = self.declared.contains(name.as_str());
            self.at(name, |walk| {
                match EXTENSIONS.iter().find(|e| e.0 == name && e.1 == walk.subject()) {
                    Some((_, _, properties)) => walk.object(extension, properties),
                    None => walk.must(extension.is_object(), "an object"),
                }
                if !declared {
                    walk.error(
                        "EXTENSION_UNDECLARED",
                        format!("{name} is not listed in extensionsUsed"),
                        "list it in extensionsUsed",
                    );
                }
            });
        }
    }

    fn value(&mut self, value: &'a Value, kind: &'static Kind) {
        match kind {
            Bool => self.must(value.is_boolean(), "true or false"),
            Text => self.must(value.is_string(), "a text"),
            Word(words) => match value.as_str() {
                Some(word) => self.listed(words.contains(&word), word),
                None => self.must(false, "a text"),
            },
            OneOf(words) => match value.as_str() {
                Some(word) if words.contains(&word) => {}
                Some(word) => self.error(
                    "UNKNOWN_VALUE",
                    format!("{word:?} is none of {}", words.join(", ")),
                    EXPORT,
                ),
                None => self.must(false, "a text"),
            },
            Code(codes) => match as_index(value) {
                Some(code) => self.listed(codes.contains(&(code as u64)), &code.to_string()),
                None => self.must(false, "an integer"),
            },
            Whole(low, high) => match as_index(value) {
                Some(n) if (*low..=*high).contains(&(n as u64)) => {}
                Some(n) => self.error("RANGE", format!("{n} is out of range"), EXPORT),
                None => self.must(false, "a non-negative integer"),
            },
            Number(low, high) => self.number(value, |x| (*low..=*high).contains(&x)),
            Above(low) => self.number(value, |x| x > *low),
            ZeroOrFrom(low) => self.number(value, |x| x == 0.0 || x >= *low),
            Index(list) => self.index(value, list, self.root.list(list).len()),
            Light => {
                let lights = self
                    .root
                    .extension("KHR_lights_punctual")
                    .map_or(0, |e| e.list("lights").len());
                self.index(value, "the lights of KHR_lights_punctual", lights);
            }
            Object(properties) => self.object(value, properties),
            Attributes => self.attributes(value),
            List(kind, least, most) => self.list(value, kind, *least, *most),
            Distinct(kind) => {
                self.list(value, kind, 1, MANY);
                let mut seen = HashSet::new();
                let twice = value
                    .as_array()
                    .into_iter()
                    .flatten()
                    .enumerate()
                    .filter(|(_, v)| !seen.insert(v.to_string()));
                let twice: Vec<usize> = twice.map(|(i, _)| i).collect();
                for i in twice {
                    self.at(&i.to_string(), |walk| {
                        walk.error("DUPLICATE", "this entry stands twice", "remove one of them")
                    });
                }
            }
        }
    }

    fn index(&mut self, value: &Value, list: &str, length: usize) {
        match as_index(value) {
            Some(i) if i < length => {}
            Some(i) => self.error("REFERENCE", format!("there is no {i} in {list}"), REFERENCE),
            None => self.must(false, "an index"),
        }
    }

    fn listed(&mut self, known: bool, word: &str) {
        if !known {
            let message = format!("{word:?} is not known to glTF 2.0");
            self.check.warn(self.pointer.clone(), "UNKNOWN_VALUE", message, EXPORT);
        }
    }

    fn number(&mut self, value: &Value, fits: impl Fn(f64) -> bool) {
        match value.as_f64() {
            Some(x) if fits(x) => {}
            Some(x) => self.error("RANGE", format!("{x} is out of range"), EXPORT),
            None => self.must(false, "a finite number"),
        }
    }

    fn attributes(&mut self, value: &'a Value) {
        let Some(map) = value.as_object() else { return self.must(false, "an object") };
        if map.is_empty() {
            self.error("EMPTY", "this must not be empty", EXPORT);
        }
        for (name, value) in map {
            self.at(name, |walk| walk.value(value, &Index("accessors")));
        }
    }

    fn list(&mut self, value: &'a Value, kind: &'static Kind, least: usize, most: usize) {
        let Some(list) = value.as_array() else { return self.must(false, "a list") };
        if list.is_empty() {
            self.error("EMPTY", "this must not be empty", EXPORT);
        } else if !(least..=most).contains(&list.len()) {
            self.error("LENGTH", format!("{} entries are too few or too many", list.len()), EXPORT);
        }
        for (i, value) in list.iter().enumerate() {
            self.at(&i.to_string(), |walk| walk.value(value, kind));
        }
    }
}
