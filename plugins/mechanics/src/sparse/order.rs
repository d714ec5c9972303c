//! Nested dissection (George 1973): the nodes are cut in two at the median of their longest axis,
//! the nodes of one side that touch the other come last, and each half is cut again. The factor of
//! a grid of n³ nodes then has O(n⁴) entries.

use std::cmp::Ordering;

use nalgebra::{Matrix3, Vector3};

use super::{Pattern, Place};

/// How much work a factor in this order is: Σ c² over its columns, c being their entries, all in
/// nodes. By the tree of elimination, up which each row goes from each of its entries (Davis 2005).
pub(super) fn work(pattern: &Pattern, order: &[u32]) -> f64 {
    let mut place = vec![0; order.len()];
    (0_u32..).zip(order).for_each(|(k, &node)| place[node as usize] = k);
    let mut parent = vec![u32::MAX; order.len()];
    let (mut seen, mut entries) = (parent.clone(), vec![1_u32; order.len()]);
    for (k, &node) in (0_u32..).zip(order) {
        seen[k as usize] = k;
        for &other in pattern.row(node as usize) {
            let mut at = place[other as usize];
            while at < k && seen[at as usize] != k {
                let up = &mut parent[at as usize];
                *up = k.min(*up);
                seen[at as usize] = k;
                entries[at as usize] += 1;
                at = *up;
            }
        }
    }
    entries.iter().map(|&c| f64::from(c) * f64::from(c)).sum()
}

/// Parts of this many nodes are not cut further.
const LEAF: usize = 24;

/// An order of elimination: which node comes first, second, …
pub(super) fn nested_dissection(pattern: &Pattern) -> Vec<u32> {
    let mut order: Vec<u32> = (0..pattern.nodes() as u32).collect();
    let mut side = vec![0_u32; pattern.nodes()];
    let units = layers(pattern);
    // Parts still to be cut, each a range of `order`: a stack rather than recursion, since a
    // degenerate mesh may cut badly.
    let mut parts = vec![(0, order.len())];
    let mut tag = 0;
    while let Some((start, end)) = parts.pop() {
        if end - start <= LEAF {
            continue;
        }
        tag += 2;
        let (left, right) = cut(&mut order[start..end], pattern, &units, &mut side, tag);
        // A side that is all border leaves nothing to gain.
        if left > 0 && right > 0 {
            parts.push((start, start + left));
            parts.push((start + left, start + left + right));
        }
    }
    order
}

/// Sorts `nodes` into left, right and separator; returns how many are left and right.
fn cut(
    nodes: &mut [u32],
    pattern: &Pattern,
    units: &[f64; 3],
    side: &mut [u32],
    tag: u32,
) -> (usize, usize) {
    let cuts = directions(nodes, &pattern.places, units).map(|axis| {
        let mut sorted = nodes.to_vec();
        let half = halves(&mut sorted, &pattern.places, axis);
        separate(&sorted, half, pattern, side, tag)
    });
    // A small separator between halves of like size.
    let cost = |[a, b, s]: &[Vec<u32>; 3]| {
        (s.len() + 1) as f64 / (a.len().min(b.len()) as f64).max(0.5).sqrt()
    };
    let [first, second] = cuts;
    let best = if cost(&second) < cost(&first) { second } else { first };
    nodes.iter_mut().zip(best.iter().flatten()).for_each(|(to, from)| *to = *from);
    (best[0].len(), best[1].len())
}

/// Takes from the two halves the nodes of one that touch the other.
fn separate(
    nodes: &[u32],
    half: usize,
    pattern: &Pattern,
    side: &mut [u32],
    tag: u32,
) -> [Vec<u32>; 3] {
    for (k, &n) in nodes.iter().enumerate() {
        side[n as usize] = if k < half { tag } else { tag + 1 };
    }
    let touches =
        |n: &u32, other: u32| pattern.row(*n as usize).iter().any(|&j| side[j as usize] == other);
    let (border_a, mut a): (Vec<u32>, Vec<u32>) =
        nodes[..half].iter().partition(|n| touches(n, tag + 1));
    let (border_b, mut b): (Vec<u32>, Vec<u32>) =
        nodes[half..].iter().partition(|n| touches(n, tag));
    let separator = if border_a.len() <= border_b.len() {
        b.extend(border_b);
        border_a
    } else {
        a.extend(border_a);
        border_b
    };
    [a, b, separator]
}

/// How far apart nodes that share an element are in the mean, along each axis, m.
fn layers(pattern: &Pattern) -> [f64; 3] {
    let place = |node: usize| pattern.places[node].position;
    let mut sums = [0.0; 3];
    for node in 0..pattern.nodes() {
        for &other in pattern.row(node) {
            let (a, b) = (place(node), place(other as usize));
            (0..3).for_each(|c| sums[c] += (a[c] - b[c]).abs());
        }
    }
    sums.map(|sum| if sum > 0.0 { sum / pattern.blocks() as f64 } else { 1.0 })
}

/// Across what to cut: the axis of the box that has the most layers (which meets the planes of
/// grids, however long their bricks are), and the longest axis of inertia (which meets the radial
/// planes of rings).
fn directions(nodes: &[u32], places: &[Place], units: &[f64; 3]) -> [[f64; 3]; 2] {
    let (mut low, mut high, mut mean) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3], [0.0; 3]);
    for &n in nodes {
        for (c, x) in places[n as usize].position.iter().enumerate() {
            low[c] = low[c].min(*x);
            high[c] = high[c].max(*x);
            mean[c] += x / nodes.len() as f64;
        }
    }
    let count = |c: usize| (high[c] - low[c]) / units[c];
    let axis = (0..3).fold(0, |best, c| if count(c) > count(best) { c } else { best });
    let mut inertia = Matrix3::zeros();
    for &n in nodes {
        let x = Vector3::from(places[n as usize].position) - Vector3::from(mean);
        inertia += x * x.transpose();
    }
    let eigen = inertia.symmetric_eigen();
    let along = eigen.eigenvectors.column(eigen.eigenvalues.imax());
    [std::array::from_fn(|c| if c == axis { 1.0 } else { 0.0 }), std::array::from_fn(|c| along[c])]
}

/// Sorts `nodes` along a direction and says where the second half begins: where the coordinate
/// changes, if that is near the middle, since a plane of the mesh makes the smallest separator.
fn halves(nodes: &mut [u32], places: &[Place], axis: [f64; 3]) -> usize {
    let at = |n: u32| places[n as usize].position.iter().zip(axis).map(|(x, a)| x * a).sum::<f64>();
    nodes.sort_by_cached_key(|&n| (Sorted(at(n)), n));
    let (middle, same) = (nodes.len() / 2, 1e-9 * (at(nodes[nodes.len() - 1]) - at(nodes[0])));
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

/// A coordinate in its order.
#[derive(PartialEq)]
struct Sorted(f64);

impl Eq for Sorted {}

impl PartialOrd for Sorted {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Sorted {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0)
    }
}
