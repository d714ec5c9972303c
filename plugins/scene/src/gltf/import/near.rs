//! Where a model lies before any of it is read: by the bounds that its accessors state, in double
//! precision, so that what lies far off can be moved to the origin before it becomes single.

use glam::{DMat4, DVec3};
use serde_json::Value;

use super::local_transform;
use crate::gltf::{
    MAX_DEPTH,
    accessor::Component,
    json::{Json, as_index},
};

/// Farther from the origin than this a model is moved there, m.
const FAR: f64 = 1000.0;

/// Whole metres from the origin to the middle of what these nodes show, in the file's unit, where
/// that is far; zero where it is near, or not stated.
pub(super) fn offset(root: &Value, roots: &[usize], metres: f64) -> DVec3 {
    let nodes = root.list("nodes");
    let mut seen = vec![false; nodes.len()];
    let mut open: Vec<(usize, usize, DMat4)> =
        roots.iter().map(|&n| (n, 1, DMat4::IDENTITY)).collect();
    let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    // Many nodes may show one mesh of many primitives.
    let boxes: Vec<Option<[DVec3; 2]>> =
        root.list("meshes").iter().map(|mesh| box_of(root, mesh)).collect();
    while let Some((node, depth, parent)) = open.pop() {
        let Some((json, seen)) = nodes.get(node).zip(seen.get_mut(node)) else { continue };
        if std::mem::replace(seen, true) || depth > MAX_DEPTH {
            continue;
        }
        let world = parent * local_transform(json);
        let shown = json.index("mesh").and_then(|m| *boxes.get(m)?);
        for corner in shown.into_iter().flat_map(corners) {
            let p = world.transform_point3(corner);
            if p.is_finite() {
                bounds = [bounds[0].min(p), bounds[1].max(p)];
            }
        }
        let children = json.list("children").iter().filter_map(as_index);
        open.extend(children.map(|child| (child, depth + 1, world)));
    }
    let middle = 0.5 * (bounds[0] + bounds[1]);
    if middle.is_finite() && middle.length() * metres > FAR {
        (middle * metres).round() / metres
    } else {
        DVec3::ZERO
    }
}

/// The box of a mesh's primitives, as their accessors state it.
fn box_of(root: &Value, mesh: &Value) -> Option<[DVec3; 2]> {
    let positions = mesh
        .list("primitives")
        .iter()
        .filter_map(|p| root.list("accessors").get(p.field("attributes").index("POSITION")?));
    let boxes = positions.filter_map(|accessor| {
        let component = Component::from_code(accessor.index("componentType")?)?;
        let is_share = accessor.field("normalized") == &Value::Bool(true);
        let scale = if is_share { 1.0 / component.max() } else { 1.0 };
        let at = |key| accessor.numbers::<3>(key).map(|p| scale * DVec3::from_array(p));
        Some([at("min")?, at("max")?])
    });
    boxes.reduce(|[l, h], [m, n]| [l.min(m), h.max(n)])
}

fn corners([low, high]: [DVec3; 2]) -> impl Iterator<Item = DVec3> {
    (0..8).map(move |k| {
        let pick = |i: usize| if k >> i & 1 == 0 { low[i] } else { high[i] };
        DVec3::new(pick(0), pick(1), pick(2))
    })
}
