//! Meshes: attributes of the right names and formats, indices that point at vertices, data that is
//! what its name says.

use std::collections::{HashMap, HashSet};

use intrados_stage::Cancelled;
use serde_json::Value;

use super::{Check, buffer::INDICES};
use crate::gltf::{
    accessor::{
        Component::{self, F32, I8, I16, U8, U16, U32},
        Layout,
        Shape::{self, Scalar, Vec2, Vec3, Vec4},
    },
    json::{Json, escaped},
    problem::remedy::EXPORT,
};

/// What buffer views were used for so far.
#[derive(Default)]
struct Uses {
    /// Vertices or indices, per view.
    purpose: HashMap<usize, bool>,
    /// The first vertex accessor of a view without a stride.
    first: HashMap<usize, usize>,
    /// Data that was looked at.
    seen: HashSet<Vec<usize>>,
    /// Joints of the smallest skin that moves a mesh.
    joints: HashMap<usize, usize>,
}

pub(super) fn check(check: &mut Check) -> Result<(), Cancelled> {
    let root = &check.document.root;
    let mut uses = Uses::default();
    for node in root.list("nodes") {
        let joints = node
            .index("skin")
            .and_then(|s| root.list("skins").get(s))
            .map(|s| s.list("joints").len());
        if let (Some(mesh), Some(joints)) = (node.index("mesh"), joints) {
            let least = uses.joints.entry(mesh).or_insert(joints);
            *least = joints.min(*least);
        }
    }
    for (m, mesh) in root.list("meshes").iter().enumerate() {
        check.job.step(5, 10)?;
        let at = format!("/meshes/{m}");
        let primitives = mesh.list("primitives");
        let targets = primitives.first().map_or(0, |p| p.list("targets").len());
        for (p, primitive) in primitives.iter().enumerate() {
            let at = format!("{at}/primitives/{p}");
            if primitive.list("targets").len() != targets {
                check.error(
                    format!("{at}/targets"),
                    "MORPH_TARGETS",
                    "the primitives of a mesh must have equally many morph targets",
                    EXPORT,
                );
            }
            let joints = uses.joints.get(&m).copied();
            self::primitive(check, &mut uses, primitive, joints, &at)?;
        }
        let weights = mesh.list("weights").len();
        if weights > 0 && weights != targets {
            check.error(
                format!("{at}/weights"),
                "WEIGHTS",
                format!("{weights} weights for {targets} morph targets"),
                EXPORT,
            );
        }
    }
    Ok(())
}

fn accessor<'a>(check: &Check<'a>, index: usize) -> Option<&'a Value> {
    check.document.root.list("accessors").get(index)
}

/// Names and accessors of a set of attributes.
fn attributes(json: &Value) -> impl Iterator<Item = (&str, usize)> {
    json.as_object()
        .into_iter()
        .flatten()
        .filter_map(|(name, value)| Some((name.as_str(), crate::gltf::json::as_index(value)?)))
}

fn primitive(
    check: &mut Check,
    uses: &mut Uses,
    json: &Value,
    joints: Option<usize>,
    at: &str,
) -> Result<(), Cancelled> {
    let base = json.field("attributes");
    let count = base
        .index("POSITION")
        .or_else(|| attributes(base).next().map(|(_, a)| a))
        .and_then(|a| accessor(check, a)?.index("count"));
    for (name, index) in attributes(base) {
        let at = format!("{at}/attributes/{}", escaped(name));
        attribute(check, uses, name, index, false, &at);
        let same = accessor(check, index)
            .and_then(|a| a.index("count"))
            .zip(count)
            .is_none_or(|(a, b)| a == b);
        if !same {
            check.error(
                &*at,
                "ATTRIBUTE_COUNT",
                "the attributes of a primitive must have equally many elements",
                EXPORT,
            );
        }
        contents(check, uses, name, index, &at)?;
    }
    numbering(check, base, &format!("{at}/attributes"));
    for (t, target) in json.list("targets").iter().enumerate() {
        for (name, index) in attributes(target) {
            let at = format!("{at}/targets/{t}/{}", escaped(name));
            attribute(check, uses, name, index, true, &at);
            if base.get(name).is_none() {
                check.error(
                    &*at,
                    "MORPH_TARGETS",
                    "the primitive itself has no such attribute",
                    EXPORT,
                );
            } else if accessor(check, index)
                .and_then(|a| a.index("count"))
                .zip(count)
                .is_some_and(|(a, b)| a != b)
            {
                check.error(
                    &*at,
                    "ATTRIBUTE_COUNT",
                    "a morph target must have as many elements as the primitive",
                    EXPORT,
                );
            }
        }
    }
    if let Some(index) = json.index("indices") {
        indices(check, uses, index, count, &format!("{at}/indices"))?;
    }
    coordinates(check, json, at);
    skinning(check, uses, base, joints, &format!("{at}/attributes"))
}

/// The stem of an indexed name such as `TEXCOORD_1`, and its number.
fn numbered(name: &str) -> Option<(&str, usize)> {
    let (stem, digits) = name.split_once('_')?;
    let plain =
        digits.bytes().all(|b| b.is_ascii_digit()) && (digits == "0" || !digits.starts_with('0'));
    Some((stem, digits.parse().ok().filter(|_| plain)?))
}

/// Formats that an attribute may have (glTF 2.0 §3.7.2.1 and, if declared,
/// `KHR_mesh_quantization`). `None`: no such attribute.
fn formats(
    name: &str,
    morph: bool,
    quantised: bool,
) -> Option<(&'static [Shape], Vec<(Component, bool)>)> {
    let stem = numbered(name).map(|(stem, _)| stem);
    const PLAIN: &[(Component, bool)] = &[(F32, false)];
    const SHARES: &[(Component, bool)] = &[(F32, false), (U8, true), (U16, true)];
    const SIGNED: &[(Component, bool)] = &[(F32, false), (I8, true), (I16, true)];
    const SMALL: &[(Component, bool)] = &[
        (I8, false),
        (I8, true),
        (U8, false),
        (U8, true),
        (I16, false),
        (I16, true),
        (U16, false),
        (U16, true),
    ];
    let (shapes, plain, packed): (&'static [Shape], _, &[(Component, bool)]) = match (name, stem) {
        ("POSITION", _) => (&[Vec3], PLAIN, SMALL),
        ("NORMAL", _) => (&[Vec3], PLAIN, SIGNED),
        ("TANGENT", _) if morph => (&[Vec3], PLAIN, SIGNED),
        ("TANGENT", _) => (&[Vec4], PLAIN, SIGNED),
        (_, Some("TEXCOORD")) => (&[Vec2], SHARES, SMALL),
        (_, Some("COLOR")) if morph => {
            (&[Vec3, Vec4], &[(F32, false), (U8, true), (U16, true), (I8, true), (I16, true)], &[])
        }
        (_, Some("COLOR")) => (&[Vec3, Vec4], SHARES, &[]),
        (_, Some("JOINTS")) if !morph => (&[Vec4], &[(U8, false), (U16, false)], &[]),
        (_, Some("WEIGHTS")) if !morph => (&[Vec4], SHARES, &[]),
        _ => return None,
    };
    Some((shapes, if quantised { [plain, packed].concat() } else { plain.to_vec() }))
}

/// Name, format, bounds, alignment and place of one attribute.
fn attribute(check: &mut Check, uses: &mut Uses, name: &str, index: usize, morph: bool, at: &str) {
    let root = &check.document.root;
    let quantised = root.list("extensionsUsed").iter().any(|e| e == "KHR_mesh_quantization");
    let allowed = formats(name, morph, quantised);
    if allowed.is_none() && !name.starts_with('_') {
        check.error(
            at,
            "ATTRIBUTE_NAME",
            "glTF knows no such attribute",
            "begin the names of own attributes with an underscore",
        );
    }
    let Some(json) = accessor(check, index) else { return };
    let Some(layout) = Layout::of(json) else { return };
    let normalised = json.field("normalized").as_bool().unwrap_or(false);
    match allowed {
        Some((shapes, components))
            if !shapes.contains(&layout.shape)
                || !components.contains(&(layout.component, normalised)) =>
        {
            check.error(
                at,
                "ACCESSOR_FORMAT",
                "the accessor's type does not fit this attribute",
                EXPORT,
            );
        }
        None if layout.component == U32 => {
            check.error(at, "ACCESSOR_FORMAT", "attributes cannot be 32-bit integers", EXPORT)
        }
        _ => {}
    }
    if name == "POSITION" && (json.get("min").is_none() || json.get("max").is_none()) {
        check.error(at, "BOUNDS_MISSING", "positions must declare min and max", EXPORT);
    }
    let Some(number) = json.index("bufferView") else { return };
    let Some(view) = root.list("bufferViews").get(number) else { return };
    let stride = view.index("byteStride");
    if json.index("byteOffset").unwrap_or(0) % 4 != 0
        || (stride.is_none() && layout.element_bytes() % 4 != 0)
    {
        check.error(
            at,
            "ALIGNMENT",
            "vertex attributes must begin at multiples of 4 bytes",
            EXPORT,
        );
    }
    if stride.is_none() && *uses.first.entry(number).or_insert(index) != index {
        check.error(
            at,
            "STRIDE",
            format!("buffer view {number} holds several attributes and needs a byteStride"),
            EXPORT,
        );
    }
    purpose(check, uses, number, false, at);
}

/// A buffer view holds vertices or indices, never both.
fn purpose(check: &mut Check, uses: &mut Uses, view: usize, indices: bool, at: &str) {
    let declared = check
        .document
        .root
        .list("bufferViews")
        .get(view)
        .and_then(|v| v.index("target"))
        .map(|target| target == INDICES);
    let first = *uses.purpose.entry(view).or_insert(declared.unwrap_or(indices));
    if first != indices {
        check.error(
            at,
            "VIEW_PURPOSE",
            format!("buffer view {view} serves vertices and indices at once"),
            EXPORT,
        );
    }
}

/// Numbered attributes count from 0 without gaps; joints and weights come in pairs.
fn numbering(check: &mut Check, attributes: &Value, at: &str) {
    let mut sets: HashMap<&str, Vec<usize>> = HashMap::new();
    for (stem, number) in
        attributes.as_object().into_iter().flatten().filter_map(|(name, _)| numbered(name))
    {
        sets.entry(stem).or_default().push(number);
    }
    for (stem, numbers) in ["TEXCOORD", "COLOR", "JOINTS", "WEIGHTS"]
        .iter()
        .filter_map(|stem| Some((stem, sets.get(stem)?)))
    {
        if numbers.iter().any(|&n| n >= numbers.len()) {
            check.error(
                at,
                "ATTRIBUTE_NUMBERS",
                format!("{stem} attributes must be numbered from 0 without gaps"),
                EXPORT,
            );
        }
    }
    let count = |stem| sets.get(stem).map_or(0, Vec::len);
    if count("JOINTS") != count("WEIGHTS") {
        check.error(
            at,
            "ATTRIBUTE_NUMBERS",
            "there must be as many sets of joints as of weights",
            EXPORT,
        );
    }
}

/// Indices are unsigned, lie close, and point at vertices.
fn indices(
    check: &mut Check,
    uses: &mut Uses,
    index: usize,
    vertices: Option<usize>,
    at: &str,
) -> Result<(), Cancelled> {
    let Some(json) = accessor(check, index) else { return Ok(()) };
    let Some(layout) = Layout::of(json) else { return Ok(()) };
    if layout.shape != Scalar
        || !matches!(layout.component, U8 | U16 | U32)
        || json.field("normalized").as_bool() == Some(true)
    {
        check.error(at, "ACCESSOR_FORMAT", "indices must be unsigned integers", EXPORT);
        return Ok(());
    }
    if let Some(number) = json.index("bufferView") {
        if check
            .document
            .root
            .list("bufferViews")
            .get(number)
            .is_some_and(|v| v.get("byteStride").is_some())
        {
            check.error(at, "STRIDE", "indices must lie close, without a stride", EXPORT);
        }
        purpose(check, uses, number, true, at);
    }
    let largest = match check.extremes.get(&index) {
        Some(&largest) => largest,
        None => {
            let Some(accessor) = check.data(index) else { return Ok(()) };
            let mut largest = 0.0_f64;
            check.visit(&accessor, |_, element| {
                largest = element.iter().fold(largest, |a, &b| a.max(b))
            })?;
            check.extremes.insert(index, largest);
            largest
        }
    };
    if largest == layout.component.max() {
        check.error(
            at,
            "INDEX_RESTART",
            format!("index {largest} means a restart, which glTF forbids"),
            EXPORT,
        );
    } else if let Some(vertices) = vertices.filter(|&n| largest >= n as f64) {
        check.error(
            at,
            "INDEX_OUT_OF_RANGE",
            format!("index {largest} is not below the {vertices} vertices"),
            EXPORT,
        );
    }
    Ok(())
}

/// The texture coordinates that the material asks for are there.
fn coordinates(check: &mut Check, json: &Value, at: &str) {
    let Some(material) =
        json.index("material").and_then(|m| check.document.root.list("materials").get(m))
    else {
        return;
    };
    let pbr = material.field("pbrMetallicRoughness");
    let old = material.extension("KHR_materials_pbrSpecularGlossiness").unwrap_or(&Value::Null);
    let textures = [
        (pbr, "baseColorTexture"),
        (pbr, "metallicRoughnessTexture"),
        (material, "normalTexture"),
        (material, "occlusionTexture"),
        (material, "emissiveTexture"),
        (old, "diffuseTexture"),
        (old, "specularGlossinessTexture"),
    ];
    for info in
        textures.map(|(object, key)| object.field(key)).into_iter().filter(|info| info.is_object())
    {
        let moved = info.extension("KHR_texture_transform").and_then(|t| t.index("texCoord"));
        let set = moved.or_else(|| info.index("texCoord")).unwrap_or(0);
        if json.field("attributes").get(format!("TEXCOORD_{set}")).is_none() {
            check.error(
                format!("{at}/material"),
                "TEXTURE_COORDINATES",
                format!("the material needs TEXCOORD_{set}"),
                EXPORT,
            );
        }
    }
}

/// Normals and tangents are unit, colours within 0 to 1. Khronos's tolerance for unit vectors.
fn contents(
    check: &mut Check,
    uses: &mut Uses,
    name: &str,
    index: usize,
    at: &str,
) -> Result<(), Cancelled> {
    let (rule, colour) = match (name, numbered(name)) {
        ("NORMAL", _) => (0, false),
        ("TANGENT", _) => (1, false),
        (_, Some(("COLOR", _))) => (2, true),
        _ => return Ok(()),
    };
    let Some(accessor) = check.data(index).filter(|_| uses.seen.insert(vec![rule, index])) else {
        return Ok(());
    };
    let mut damaged = None;
    check.visit(&accessor, |i, element| {
        let fault = if colour {
            element
                .iter()
                .any(|&c| !(0.0..=1.0).contains(&accessor.real(c)))
                .then_some("is not within 0 to 1")
        } else {
            let length =
                element.iter().take(3).map(|&x| accessor.real(x).powi(2)).sum::<f64>().sqrt();
            let tolerance = if accessor.layout.component == I8 { 0.02 } else { 0.00674 };
            let sign = element.get(3).is_none_or(|&w| accessor.real(w).abs() == 1.0);
            if (length - 1.0).abs() <= tolerance {
                (!sign).then_some("has a sign other than 1 or -1")
            } else {
                Some("is no unit vector")
            }
        };
        if let (Some(fault), None) = (fault, &damaged) {
            damaged = Some((i, fault));
        }
    })?;
    if let Some((i, fault)) = damaged {
        check.error(at, "ATTRIBUTE_DATA", format!("element {i} {fault}"), EXPORT);
    }
    Ok(())
}

/// Weights are shares that make 1; joints exist and none counts twice.
fn skinning(
    check: &mut Check,
    uses: &mut Uses,
    base: &Value,
    joints: Option<usize>,
    at: &str,
) -> Result<(), Cancelled> {
    let set = |stem: &str| {
        (0_usize..4).map_while(|n| base.index(&format!("{stem}_{n}"))).collect::<Vec<_>>()
    };
    let (joint_sets, weight_sets) = (set("JOINTS"), set("WEIGHTS"));
    let key: Vec<usize> = [3, joints.unwrap_or(usize::MAX)]
        .into_iter()
        .chain(joint_sets.iter().copied())
        .chain(weight_sets.iter().copied())
        .collect();
    if weight_sets.is_empty() || joint_sets.len() != weight_sets.len() || !uses.seen.insert(key) {
        return Ok(());
    }
    let fours = |list: &[usize]| {
        let open = list.iter().map(|&i| check.data(i).filter(|a| a.layout.shape == Vec4));
        open.collect::<Option<Vec<_>>>().filter(|list| {
            list.windows(2).all(|w| w.iter().map(|a| a.count).is_sorted_by(|a, b| a == b))
        })
    };
    let (Some(joint_data), Some(weight_data)) = (fours(&joint_sets), fours(&weight_sets)) else {
        return Ok(());
    };
    let vertices = weight_data.first().map_or(0, |a| a.count);
    if joint_data.first().is_none_or(|a| a.count != vertices)
        || check.document.spend(vertices.saturating_mul(64 * weight_data.len())).is_err()
    {
        return Ok(());
    }
    // Vertex after vertex: all its weights, all its joints.
    let width = 4 * weight_data.len();
    let mut weights = vec![0.0; vertices * width];
    let mut bones = weights.clone();
    for (list, table) in [(&weight_data, &mut weights), (&joint_data, &mut bones)] {
        for (s, accessor) in list.iter().enumerate() {
            let mut rows = table.chunks_exact_mut(width);
            check.visit(accessor, |_, element| {
                let row = rows.next().and_then(|row| row.get_mut(4 * s..4 * s + 4));
                row.into_iter()
                    .flatten()
                    .zip(element)
                    .for_each(|(slot, &x)| *slot = accessor.real(x));
            })?;
        }
    }
    let mut report = |vertex: usize, message: &str| {
        check.error(
            format!("{at}/WEIGHTS_0"),
            "SKIN_WEIGHTS",
            format!("vertex {vertex}: {message}"),
            EXPORT,
        )
    };
    for (vertex, (weights, bones)) in
        weights.chunks_exact(width).zip(bones.chunks_exact(width)).enumerate()
    {
        let sum: f64 = weights.iter().sum();
        let heavy = || bones.iter().zip(weights).filter(|(_, w)| **w > 0.0).map(|(b, _)| *b);
        let fault = if weights.iter().any(|&w| w < 0.0) {
            "a weight is negative"
        } else if sum > 0.0 && (sum - 1.0).abs() > 0.02 {
            "the weights do not make 1"
        } else if joints.is_some_and(|n| bones.iter().any(|&b| b >= n as f64)) {
            "a joint is not in the skin"
        } else if heavy().enumerate().any(|(i, b)| heavy().skip(i + 1).any(|other| other == b)) {
            "a joint counts twice"
        } else {
            continue;
        };
        report(vertex, fault);
        break;
    }
    Ok(())
}
