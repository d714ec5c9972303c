//! Nodes: transforms that are transforms, a forest without loops, scenes of its roots.

use glam::DMat4;
use serde_json::Value;

use super::Check;
use crate::gltf::{
    MAX_DEPTH,
    json::{Json, as_index},
    problem::remedy::EXPORT,
};

pub(super) fn check(check: &mut Check) {
    let root = &check.document.root;
    let nodes = root.list("nodes");
    for (i, node) in nodes.iter().enumerate() {
        transform(check, i, node);
        uses(check, i, node);
    }
    for (i, child, _) in children(root)
        .filter(|&(i, child, parent)| parent.is_some_and(|p| p != i) && child < nodes.len())
    {
        check.error(
            format!("/nodes/{i}/children"),
            "NODE_PARENTS",
            format!("node {child} has another parent already"),
            EXPORT,
        );
    }
    let forest = Forest::of(root);
    for i in 0..nodes.len() {
        match forest.depth.get(i) {
            Some(None) => check.error(
                format!("/nodes/{i}"),
                "NODE_LOOP",
                "the node is its own ancestor",
                "break the loop",
            ),
            Some(Some(depth)) if *depth == MAX_DEPTH + 1 => {
                check.error(
                    format!("/nodes/{i}"),
                    "NODE_DEPTH",
                    format!("nodes are nested more than {MAX_DEPTH} deep"),
                    "flatten the hierarchy",
                );
            }
            _ => {}
        }
    }
    for (s, scene) in root.list("scenes").iter().enumerate() {
        for (k, node) in scene.list("nodes").iter().enumerate() {
            if as_index(node).and_then(|n| *forest.parent.get(n)?).is_some() {
                check.error(
                    format!("/scenes/{s}/nodes/{k}"),
                    "SCENE_NOT_ROOT",
                    "a scene lists roots, this node has a parent",
                    EXPORT,
                );
            }
        }
    }
}

/// Parent, child, and the parent that the child has already.
fn children(root: &Value) -> impl Iterator<Item = (usize, usize, Option<usize>)> {
    let mut parents = vec![None; root.list("nodes").len()];
    let pairs = root.list("nodes").iter().enumerate();
    let pairs = pairs.flat_map(|(i, node)| {
        node.list("children").iter().filter_map(move |c| Some((i, as_index(c)?)))
    });
    pairs.map(move |(i, child)| {
        let known = parents.get_mut(child).and_then(|parent| {
            let known = *parent;
            parent.get_or_insert(i);
            known
        });
        (i, child, known)
    })
}

/// Who is whose parent.
pub(super) struct Forest {
    pub parent: Vec<Option<usize>>,
    /// From 1 at roots; `None` on or below a loop.
    pub depth: Vec<Option<usize>>,
}

impl Forest {
    /// Each node's first parent counts.
    pub(super) fn of(root: &Value) -> Self {
        let count = root.list("nodes").len();
        let mut parent = vec![None; count];
        let mut below = vec![Vec::new(); count];
        for (i, child, known) in children(root) {
            if let (Some(slot), None) = (parent.get_mut(child), known) {
                *slot = Some(i);
                if let Some(list) = below.get_mut(i) {
                    list.push(child);
                }
            }
        }
        let mut depth = vec![None; count];
        let mut open: Vec<(usize, usize)> =
            (0..count).filter(|&i| parent.get(i) == Some(&None)).map(|i| (i, 1)).collect();
        while let Some((i, d)) = open.pop() {
            if let Some(slot) = depth.get_mut(i) {
                *slot = Some(d);
            }
            open.extend(below.get(i).into_iter().flatten().map(|&child| (child, d + 1)));
        }
        Self { parent, depth }
    }

    /// A node and its ancestors, up to the root; nothing for a node on or below a loop.
    pub(super) fn line(&self, node: usize) -> impl Iterator<Item = usize> {
        let start = self.depth.get(node).copied().flatten().map(|_| node);
        std::iter::successors(start, |&n| self.parent.get(n).copied().flatten())
    }
}

fn transform(check: &mut Check, index: usize, node: &Value) {
    let at = |key: &str| format!("/nodes/{index}{key}");
    if let Some(matrix) = node.numbers::<16>("matrix") {
        if ["translation", "rotation", "scale"].iter().any(|key| node.get(key).is_some()) {
            check.error(
                at("/matrix"),
                "NODE_TRANSFORM",
                "a node has a matrix or translation, rotation and scale, not both",
                "keep one of them",
            );
        }
        if !decomposable(&DMat4::from_cols_array(&matrix)) {
            check.error(
                at("/matrix"),
                "NODE_TRANSFORM",
                "the matrix is no translation, rotation and scale: it shears or projects",
                EXPORT,
            );
        }
    }
    // Khronos's tolerance for unit quaternions.
    if node
        .numbers::<4>("rotation")
        .is_some_and(|q| (glam::DVec4::from_array(q).length() - 1.0).abs() > 0.00769)
    {
        check.error(
            at("/rotation"),
            "NODE_TRANSFORM",
            "the rotation is no unit quaternion",
            "normalise it",
        );
    }
}

/// Whether a matrix is affine and its axes stand square on each other, within single precision.
fn decomposable(m: &DMat4) -> bool {
    let square = |a: glam::DVec3, b: glam::DVec3| a.dot(b).abs() <= 1e-4 * a.length() * b.length();
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(glam::DVec4::truncate);
    let last = glam::DVec4::new(m.x_axis.w, m.y_axis.w, m.z_axis.w, m.w_axis.w);
    last.abs_diff_eq(glam::DVec4::W, 1e-6) && square(x, y) && square(y, z) && square(z, x)
}

/// Mesh, skin and morph weights of a node fit together.
fn uses(check: &mut Check, index: usize, node: &Value) {
    let at = |key: &str| format!("/nodes/{index}{key}");
    for key in ["skin", "weights"] {
        if node.get(key).is_some() && node.get("mesh").is_none() {
            check.error(
                at(&format!("/{key}")),
                "MISSING",
                format!("{key} is of no use without a mesh"),
                EXPORT,
            );
        }
    }
    let Some(mesh) = node.index("mesh").and_then(|m| check.document.root.list("meshes").get(m))
    else {
        return;
    };
    let targets = mesh.list("primitives").first().map_or(0, |p| p.list("targets").len());
    let weights = node.list("weights").len();
    if weights > 0 && weights != targets {
        check.error(
            at("/weights"),
            "WEIGHTS",
            format!("{weights} weights for {targets} morph targets"),
            EXPORT,
        );
    }
    let joints =
        mesh.list("primitives").iter().any(|p| p.field("attributes").get("JOINTS_0").is_some());
    if node.get("skin").is_some() && !joints {
        check.error(
            at(""),
            "SKIN_JOINTS",
            "the node has a skin but its mesh has no joints",
            EXPORT,
        );
    } else if node.get("skin").is_none() && joints {
        check.warn(at(""), "SKIN_JOINTS", "the mesh has joints but the node has no skin", EXPORT);
    }
}
