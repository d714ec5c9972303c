//! Skins: joints of one tree, a matrix for each.

use std::collections::{HashMap, HashSet};

use intrados_stage::Cancelled;
use serde_json::Value;

use super::{Check, node::Forest};
use crate::gltf::{
    MAX_DEPTH,
    accessor::{Component, Layout, Shape},
    json::{Json, as_index},
    problem::remedy::EXPORT,
};

pub(super) fn check(check: &mut Check) -> Result<(), Cancelled> {
    let root = &check.document.root;
    let forest = Forest::of(root);
    for (i, skin) in root.list("skins").iter().enumerate() {
        check.job.step(6, 10)?;
        matrices(check, i, skin)?;
        joints(check, &forest, i, skin);
    }
    scenes(check, &forest);
    Ok(())
}

/// Inverse bind matrices: one a joint, affine.
fn matrices(check: &mut Check, index: usize, skin: &Value) -> Result<(), Cancelled> {
    let root = &check.document.root;
    let Some(number) = skin.index("inverseBindMatrices") else { return Ok(()) };
    let Some(json) = root.list("accessors").get(number) else { return Ok(()) };
    let at = format!("/skins/{index}/inverseBindMatrices");
    if Layout::of(json)
        .is_some_and(|l| l != Layout { component: Component::F32, shape: Shape::Mat4 })
    {
        check.error(&*at, "SKIN_MATRICES", "inverse bind matrices must be 4 x 4 floats", EXPORT);
        return Ok(());
    }
    let joints = skin.list("joints").len();
    if json.index("count").is_some_and(|n| n < joints) {
        check.error(
            &*at,
            "SKIN_MATRICES",
            format!("there are fewer matrices than the {joints} joints"),
            EXPORT,
        );
    }
    if json
        .index("bufferView")
        .and_then(|v| root.list("bufferViews").get(v))
        .is_some_and(|v| v.get("byteStride").is_some())
    {
        check.error(
            &*at,
            "STRIDE",
            "inverse bind matrices must lie close, without a stride",
            EXPORT,
        );
    }
    let Some(accessor) = check.data(number) else { return Ok(()) };
    let mut damaged = None;
    check.visit(&accessor, |i, m| {
        let last = m.iter().skip(3).step_by(4);
        if !last.zip([0.0, 0.0, 0.0, 1.0]).all(|(a, b)| (a - b).abs() < 1e-6) {
            damaged.get_or_insert(i);
        }
    })?;
    if let Some(i) = damaged {
        check.error(
            &*at,
            "SKIN_MATRICES",
            format!("matrix {i} does not end with the row 0 0 0 1"),
            EXPORT,
        );
    }
    Ok(())
}

/// All joints hang on one root, and the skeleton, if named, is above them all.
fn joints(check: &mut Check, forest: &Forest, index: usize, skin: &Value) {
    let joints: Vec<usize> = skin.list("joints").iter().filter_map(as_index).collect();
    if check.document.work(joints.len() * MAX_DEPTH).is_err() {
        return;
    }
    let roots: HashSet<Option<usize>> = joints.iter().map(|&j| forest.line(j).last()).collect();
    if roots.len() > 1 {
        check.error(
            format!("/skins/{index}/joints"),
            "SKIN_ROOT",
            "the joints have no common root",
            EXPORT,
        );
        return;
    }
    let skeleton = skin.index("skeleton").filter(|&s| s < forest.parent.len());
    if skeleton.is_some_and(|s| joints.iter().any(|&j| !forest.line(j).any(|n| n == s))) {
        check.error(
            format!("/skins/{index}/skeleton"),
            "SKIN_ROOT",
            "the skeleton is not above all joints",
            EXPORT,
        );
    }
}

/// A scene that shows a skinned mesh holds its joints.
fn scenes(check: &mut Check, forest: &Forest) {
    let root = &check.document.root;
    let mut shown: HashMap<usize, HashSet<usize>> = HashMap::new();
    for (s, scene) in root.list("scenes").iter().enumerate() {
        for node in scene.list("nodes").iter().filter_map(as_index) {
            shown.entry(node).or_default().insert(s);
        }
    }
    let nowhere = HashSet::new();
    for (i, node) in root.list("nodes").iter().enumerate() {
        let Some(skin) = node.index("skin").and_then(|s| root.list("skins").get(s)) else {
            continue;
        };
        let Some(joint) = skin.list("joints").first().and_then(as_index) else { continue };
        let at =
            |node| forest.line(node).last().and_then(|top| shown.get(&top)).unwrap_or(&nowhere);
        let (here, there) = (at(i), at(joint));
        if check.document.work(here.len() + MAX_DEPTH).is_err() {
            return;
        }
        if !here.is_subset(there) {
            check.error(
                format!("/nodes/{i}"),
                "SKIN_SCENE",
                "a scene shows this skinned mesh but not its joints",
                EXPORT,
            );
        }
    }
}
