//! Nested dissection (George 1973): the nodes are cut in two at the median of their longest axis, the nodes of one side that touch the other
//! come last, and each half is cut again. The factor of a grid of n³ nodes then has O(n⁴) entries.

use super::{Pattern, Place};

/// Parts of this many nodes are not cut further.
const LEAF: usize = 24;

/// An order of elimination: which node comes first, second, …
pub(super) fn nested_dissection(pattern: &Pattern) -> Vec<u32> {
    let mut order: Vec<u32> = (0..pattern.nodes() as u32).collect();
    let mut side = vec![0_u32; pattern.nodes()];
    // Parts still to be cut, each a range of `order`: a stack rather than recursion, since a degenerate mesh may cut badly.
    let mut parts = vec![0..order.len()];
    let mut tag = 0;
    while let Some(part) = parts.pop() {
        if part.len() <= LEAF {
            continue;
        }
        let nodes = &mut order[part.clone()];
        tag += 2;
        let (left, right) = cut(nodes, pattern, &mut side, tag);
        // A side that is all border leaves nothing to gain.
        if left > 0 && right > 0 {
            parts.push(part.start..part.start + left);
            parts.push(part.start + left..part.start + left + right);
        }
    }
    order
}

/// Sorts `nodes` into left, right and separator; returns how many are left and right.
fn cut(nodes: &mut [u32], pattern: &Pattern, side: &mut [u32], tag: u32) -> (usize, usize) {
    let half = halves(nodes, &pattern.places);
    for (k, &n) in nodes.iter().enumerate() {
        side[n as usize] = if k < half { tag } else { tag + 1 };
    }
    let touches = |n: u32, other: u32| pattern.row(n as usize).iter().any(|&j| side[j as usize] == other);
    let (mut a, mut border_a): (Vec<u32>, Vec<u32>) = (Vec::with_capacity(half), Vec::new());
    let (mut b, mut border_b): (Vec<u32>, Vec<u32>) = (Vec::with_capacity(half + 1), Vec::new());
    nodes[..half].iter().for_each(|&n| if touches(n, tag + 1) { border_a.push(n) } else { a.push(n) });
    nodes[half..].iter().for_each(|&n| if touches(n, tag) { border_b.push(n) } else { b.push(n) });
    let separator = if border_a.len() <= border_b.len() {
        b.extend(border_b);
        border_a
    } else {
        a.extend(border_a);
        border_b
    };
    for (to, from) in nodes.iter_mut().zip(a.iter().chain(&b).chain(&separator)) {
        *to = *from;
    }
    (a.len(), b.len())
}

/// Sorts `nodes` into two halves along the longest axis and says where the second begins: where the coordinate changes, if that is near the
/// middle, since a plane of the mesh makes the smallest separator.
fn halves(nodes: &mut [u32], places: &[Place]) -> usize {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for &n in nodes.iter() {
        for (c, x) in places[n as usize].position.iter().enumerate() {
            low[c] = low[c].min(*x);
            high[c] = high[c].max(*x);
        }
    }
    let axis = (0..3).fold(0, |best, c| if high[c] - low[c] > high[best] - low[best] { c } else { best });
    let at = |n: u32| places[n as usize].position[axis];
    nodes.sort_unstable_by(|&a, &b| at(a).total_cmp(&at(b)).then(a.cmp(&b)));
    let (middle, same) = (nodes.len() / 2, 1e-9 * (high[axis] - low[axis]));
    let plane = at(nodes[middle]);
    let before = nodes.partition_point(|&n| at(n) < plane - same);
    let after = nodes.partition_point(|&n| at(n) <= plane + same);
    let near = |k: usize| 4 * k > nodes.len() && 4 * k < 3 * nodes.len();
    match (near(before), near(after)) {
        (true, true) if after - middle < middle - before => after,
        (true, _) => before,
        (false, true) => after,
        (false, false) => middle,
    }
}
