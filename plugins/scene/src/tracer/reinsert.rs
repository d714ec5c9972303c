//! Reinsertion: subtrees of the binary tree move to where they cost less, before it is collapsed.
//!
//! Meister and Bittner, "Parallel reinsertion for bounding volume hierarchy optimization" (2018),
//! by the crate `obvhs`. Of that crate nothing else is used, and without its feature `parallel`:
//! nothing promises that its unstable sorts order nodes of one area alike on any number of threads.

use intrados_stage::{Cancelled, Job};
use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, node::Bvh2Node, reinsertion::ReinsertionOptimizer},
};

use super::{
    build::{Bounds, Branch, Item},
    tree::MAX_DEPTH,
};

/// Share of the nodes that are tried in the first round; the others try a third of it, a fifth, a
/// seventh …, of what is nearest to the root. Measured (bench `tracer`, nodes tested by a ray,
/// without and with it): scene `tunnel` 11.0 and 9.6, whether anything is hit 6.7 and 3.5; `beam`
/// 3.6 and 2.9; `specimens` 2.3 and 2.0; 7.4 and 7.4 in a smooth mesh of 100 000 triangles. The
/// build takes 1.1 to 2 times as long. A share of .5 makes that 1.2 to 2 and the expected cost of a
/// ray another .4 % lower.
const SHARE: f32 = 0.15;
const ROUNDS: usize = 16;

/// The same sets of items in a cheaper tree; `None` where that would be too deep for the traversal
/// stacks: the tree that was given is not.
pub(super) fn reinserted(
    branches: &[Branch],
    items: &[Item],
    job: &Job,
) -> Result<Option<(Vec<Branch>, Vec<Item>)>, Cancelled> {
    let mut tree = Bvh2 { nodes: nodes(branches), ..Bvh2::default() };
    let mut optimizer = ReinsertionOptimizer::default();
    for round in 0..ROUNDS {
        job.step(items.len(), items.len())?;
        optimizer.run(&mut tree, SHARE, Some(vec![1.0 / (2 * round + 1) as f32]));
    }
    Ok(back(&tree.nodes, branches, items))
}

/// The nodes level by level, as the optimizer wants those near the root first. A leaf's
/// `first_index` is its branch.
fn nodes(branches: &[Branch]) -> Vec<Bvh2Node> {
    let leaf = |k: usize| {
        let Branch { bounds, count, .. } = branches[k];
        Bvh2Node::new(Aabb::new(bounds.lo, bounds.hi), count, k as u32)
    };
    let mut nodes = vec![leaf(0)];
    let mut next = 0;
    while let Some(&node) = nodes.get(next) {
        let k = node.first_index as usize;
        if branches[k].right > 0 {
            let first = nodes.len() as u32;
            nodes[next].make_inner(first);
            nodes.extend([leaf(k + 1), leaf(k + branches[k].right as usize)]);
        }
        next += 1;
    }
    nodes
}

/// The tree as a list of branches, each followed by its left child, and the items in the order of
/// their leaves; `None` where it is too deep.
fn back(
    nodes: &[Bvh2Node],
    branches: &[Branch],
    items: &[Item],
) -> Option<(Vec<Branch>, Vec<Item>)> {
    let mut list: Vec<Branch> = Vec::with_capacity(nodes.len());
    let mut placed = Vec::with_capacity(items.len());
    // A node, its depth, and the branch of which it is the right child.
    let mut waiting = vec![(0, 0, None)];
    while let Some((node, depth, parent)) = waiting.pop() {
        if depth >= MAX_DEPTH {
            return None;
        }
        let k = list.len();
        if let Some(parent) = parent {
            let parent: usize = parent;
            list[parent].right = (k - parent) as u32;
        }
        let Bvh2Node { prim_count, first_index, .. } = nodes[node];
        let first = placed.len() as u32;
        if prim_count > 0 {
            let leaf = branches[first_index as usize];
            list.push(Branch { first, ..leaf });
            placed
                .extend_from_slice(&items[leaf.first as usize..(leaf.first + leaf.count) as usize]);
        } else {
            list.push(Branch { bounds: Bounds::EMPTY, first, count: 0, right: 0 });
            let left = first_index as usize;
            waiting.extend([(left + 1, depth + 1, Some(k)), (left, depth + 1, None)]);
        }
    }
    debug_assert_eq!(placed.len(), items.len());
    // Children come after their parent: backwards, they are known.
    for k in (0..list.len()).rev().filter(|&k| list[k].right > 0).collect::<Vec<_>>() {
        let (left, right) = (list[k + 1], list[k + list[k].right as usize]);
        (list[k].bounds, list[k].count) =
            (left.bounds.join(right.bounds), left.count + right.count);
    }
    Some((list, placed))
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, Vec3A, vec3};
    use intrados_stage::random::Key;

    use super::*;
    use crate::tracer::{Hit, Kernel, Ray, Scratch, Tracer, build, tree};

    const ONE: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

    /// Each around the next.
    fn nested(count: i32, factor: f32) -> Vec<[Vec3; 3]> {
        (0..count).map(|i| ONE.map(|p| p * factor.powi(-i))).collect()
    }

    /// Triangles of all sizes, and long thin ones among them as bars are.
    fn soup(count: u64) -> Vec<[Vec3; 3]> {
        let triangle = |i| {
            let key = Key::new(21, i);
            let at = |k| 2.0 * vec3(key.unit(k), key.unit(k + 1), key.unit(k + 2)) - 1.0;
            let mut side = at(3) * 10.0_f32.powf(-3.0 * key.unit(9));
            side[(3.0 * key.unit(10)) as usize] *= if i % 4 == 0 { 20.0 } else { 1.0 };
            [at(0), at(0) + side, at(0) + vec3(side.y, side.z, side.x) * 0.1 + at(6) * 0.01]
        };
        (0..count).map(triangle).collect()
    }

    fn rays(count: u64) -> Vec<Ray> {
        let ray = |i| {
            let key = Key::new(22, i);
            let at = |k| 3.0 * vec3(key.unit(k), key.unit(k + 1), key.unit(k + 2)) - 1.5;
            Ray::new(at(0), at(3) - at(0), f32::INFINITY)
        };
        (0..count).map(ray).collect()
    }

    fn hits(tree: tree::Tree, kernel: Kernel, rays: &[Ray]) -> Vec<(u32, u32)> {
        let mut hits = vec![Hit::MISS; rays.len()];
        Tracer { tree, kernel, triangles: 0 }.closest(rays, &mut hits, &mut Scratch::default());
        hits.iter().map(|hit| (hit.t.to_bits(), hit.triangle)).collect()
    }

    /// Levels of the wide tree.
    fn depth(tree: &tree::Tree, node: u32) -> usize {
        let tree::Node { child, children, .. } = &tree.node[node as usize];
        let below = child[..*children as usize].iter().filter(|&c| c & tree::LEAF == 0);
        1 + below.map(|&c| depth(tree, c)).max().unwrap_or(0)
    }

    #[test]
    fn a_ray_meets_the_same_in_either_tree() {
        for count in [1, 9, 100, 3000, 20_000] {
            // Half of them twice: at one distance the lower index must win in either tree.
            let mut triangles = soup(count);
            triangles.extend_from_within(..triangles.len() / 2);
            let rays = rays(20_000);
            for kernel in [Kernel::Single, Kernel::Packet] {
                let [plain, better] = [false, true].map(|reinsert| {
                    let tree = build::build_with(&triangles, kernel, reinsert, &Job::default())
                        .expect("nobody cancels");
                    hits(tree, kernel, &rays)
                });
                assert!(
                    count < 100
                        || plain.iter().filter(|(_, triangle)| *triangle != Hit::NONE).count()
                            > 100
                );
                assert_eq!(plain, better, "{kernel:?}, {count} triangles");
            }
        }
    }

    /// A list of leaves, one in each level.
    fn chain(levels: u32) -> (Vec<Branch>, Vec<Item>) {
        let bounds =
            |i: u32| Bounds { lo: -Vec3A::splat((i + 1) as f32), hi: Vec3A::splat((i + 1) as f32) };
        let items = (0..levels).rev().map(|id| Item { bounds: bounds(id), id }).collect();
        let leaf =
            |first: u32| Branch { bounds: bounds(levels - 1 - first), first, count: 1, right: 0 };
        let inner = |first: u32| Branch { count: levels - first, right: 2, ..leaf(first) };
        let branches =
            (0..levels - 1).flat_map(|i| [inner(i), leaf(i)]).chain([leaf(levels - 1)]).collect();
        (branches, items)
    }

    #[test]
    fn a_tree_goes_there_and_back_unless_it_is_too_deep() {
        let (branches, items) = chain(MAX_DEPTH as u32);
        let (list, placed) = back(&nodes(&branches), &branches, &items).expect("as deep as may be");
        let all = |list: &[Branch]| {
            list.iter()
                .map(|b| (b.bounds.lo, b.bounds.hi, b.first, b.count, b.right))
                .collect::<Vec<_>>()
        };
        assert_eq!(all(&list), all(&branches));
        assert!(placed.iter().map(|item| item.id).eq(items.iter().map(|item| item.id)));
        let (branches, items) = chain(MAX_DEPTH as u32 + 1);
        assert!(back(&nodes(&branches), &branches, &items).is_none());
    }

    /// Many triangles in one place, and each around the next: what reinsertion makes too deep is
    /// not taken.
    #[test]
    fn no_tree_is_deeper_than_the_stacks() {
        let mut too_deep = 0;
        for triangles in [
            vec![ONE; 4000],
            nested(4000, 1.05),
            nested(4000, 1.02),
            nested(20_000, 1.003),
            nested(100_000, 1.0002),
        ] {
            let [plain, better] = [false, true].map(|r| {
                build::build_with(&triangles, Kernel::Single, r, &Job::default())
                    .expect("no cancel")
            });
            assert!(depth(&better, 0) < MAX_DEPTH);
            let (branches, items) =
                build::binary(&triangles, &build::Cost::of(Kernel::Single), &Job::default())
                    .expect("no cancel");
            too_deep += usize::from(
                reinserted(&branches, &items, &Job::default()).expect("no cancel").is_none(),
            );
            let rays = rays(1000);
            assert_eq!(hits(plain, Kernel::Single, &rays), hits(better, Kernel::Single, &rays));
        }
        assert!(too_deep > 0, "nothing tries the guard");
    }
}
