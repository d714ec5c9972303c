//! Surface-area heuristic over 32 bins on each axis, then the cheapest eight-wide tree over it.
//!
//! Binning: Wald, "On fast construction of SAH-based bounding volume hierarchies" (2007). Cost of a
//! set of n triangles is its area times ⌈n/8⌉, because a leaf block of eight costs the same however
//! full it is. Between the two, `reinsert.rs`. Collapse by dynamic programming: Ylitie, Karras,
//! Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs" (2017), §3.1.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Vec3, Vec3A};
use intrados_stage::{Cancelled, Job};
use wide::f32x8;

use super::{
    Kernel, LARGEST,
    reinsert::reinserted,
    tree::{Block, Face, Fan, LEAF, MAX_DEPTH, Node, Tree},
};

const BINS: usize = 32;

/// Triangles from this index on are left out: indices must stay below [`LEAF`] and, as bits of a
/// float, below infinity.
const MOST: u32 = 0x7f00_0000;
const _: () = assert!(MOST < LEAF);

/// Deeper, sets are halved by count, which adds at most 31 levels (2³¹ triangles).
const SAH_DEPTH: usize = 60;
const _: () = assert!(SAH_DEPTH + 32 < MAX_DEPTH);

/// Share of its largest extent by which a triangle's box is widened. A kernel sees corner p off its
/// place by at most u (3 |s z| + 2 |p − o|) on each axis (u = ε/2; s, z as in `single.rs`), and its
/// edges by 2 u of their length more. Where the triangle is hit, this is 5 u of the way along that
/// axis, for which `single::NEARER` stands, and 7 u of the triangle. Coordinates do not come in:
/// the offset of `offset.rs` takes a start on a flat wall along an axis out of the boxes of that
/// wall.
const PAD: f64 = 4.0 * f32::EPSILON as f64;

/// Subtrees up to this size are one piece of work.
const GRAIN: usize = 4096;

/// What the builder minimises, in units of one node visit.
pub(super) struct Cost {
    /// The binary tree is split down to sets of this size.
    set: usize,
    /// Of a leaf with n triangles: `leaf + triangle * n`.
    leaf: f32,
    triangle: f32,
}

impl Cost {
    /// A single ray tests all triangles of a block at once; a packet one after the other.
    pub(super) const fn of(kernel: Kernel) -> Self {
        match kernel {
            Kernel::Single => Self { set: 8, leaf: 1.0, triangle: 0.0 },
            Kernel::Packet => Self { set: 2, leaf: 1.0, triangle: 0.1 },
        }
    }

    fn sets(&self, triangles: u32) -> f32 {
        triangles.div_ceil(self.set as u32) as f32
    }
}

#[derive(Clone, Copy)]
pub(super) struct Bounds {
    pub(super) lo: Vec3A,
    pub(super) hi: Vec3A,
}

impl Bounds {
    pub(super) const EMPTY: Self = Self { lo: Vec3A::INFINITY, hi: Vec3A::NEG_INFINITY };

    fn point(self, p: Vec3A) -> Self {
        Self { lo: self.lo.min(p), hi: self.hi.max(p) }
    }

    pub(super) fn join(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// Wider by at least `pad` on all sides, and by less than one unit in the last place more.
    fn pad(self, pad: f64) -> Self {
        let below = |x: f32| {
            let low = f64::from(x) - pad;
            let near = low as f32;
            if f64::from(near) > low { near.next_down() } else { near }
        };
        let each = |v: Vec3A| Vec3A::from_array(v.to_array().map(below));
        Self { lo: each(self.lo), hi: -each(-self.hi) }
    }

    fn half_area(self) -> f32 {
        let d = (self.hi - self.lo).max(Vec3A::ZERO);
        d.x * (d.y + d.z) + d.y * d.z
    }
}

/// A triangle while its place is sought.
#[derive(Clone, Copy)]
pub(super) struct Item {
    pub(super) bounds: Bounds,
    pub(super) id: u32,
}

impl Item {
    /// Twice the centre of the box.
    fn centre(&self) -> Vec3A {
        self.bounds.lo + self.bounds.hi
    }
}

/// A node of the binary tree. The left child is the next one in the list.
#[derive(Clone, Copy)]
pub(super) struct Branch {
    pub(super) bounds: Bounds,
    /// Its items are `first..first + count`; 0 marks an unused place in the list.
    pub(super) first: u32,
    pub(super) count: u32,
    /// The right child is so many places further on; 0 marks a leaf.
    pub(super) right: u32,
}

/// Builds the tree; `job` sees the share of triangles that have found their place.
///
/// Reinsertion is left to trees of single rays: among the few triangles that are fit for packets it
/// changes hardly any test of a node.
pub(super) fn build(triangles: &[[Vec3; 3]], kernel: Kernel, job: &Job) -> Result<Tree, Cancelled> {
    build_with(triangles, kernel, kernel == Kernel::Single, job)
}

/// [`build`] with reinsertion or without it. Rays meet the same in either tree.
pub(super) fn build_with(
    triangles: &[[Vec3; 3]],
    kernel: Kernel,
    reinsert: bool,
    job: &Job,
) -> Result<Tree, Cancelled> {
    let cost = Cost::of(kernel);
    let (mut branches, mut items) = binary(triangles, &cost, job)?;
    if items.is_empty() {
        return Ok(Tree { node: vec![Node::empty()], ..Tree::default() });
    }
    let mut plans = plan(&branches, &cost);
    if reinsert && let Some((other, order)) = reinserted(&branches, &items, job)? {
        let others = plan(&other, &cost);
        // What is cheaper as a binary tree need not be so as a wide one.
        if others[0].cost[0] < plans[0].cost[0] {
            (branches, items, plans) = (other, order, others);
        }
    }
    let fans = kernel == Kernel::Packet;
    let mut collapse = Collapse {
        triangles,
        items: &items,
        branches: &branches,
        plans,
        fans,
        tree: Tree::default(),
    };
    collapse.root();
    job.step(1, 1)?;
    Ok(collapse.tree)
}

/// The binary tree by the surface-area heuristic, and its items in the order of its leaves.
pub(super) fn binary(
    triangles: &[[Vec3; 3]],
    cost: &Cost,
    job: &Job,
) -> Result<(Vec<Branch>, Vec<Item>), Cancelled> {
    let mut items: Vec<Item> =
        triangles.iter().enumerate().filter_map(|(i, t)| item(i, t)).collect();
    job.step(0, items.len())?;
    let unused = Branch { bounds: Bounds::EMPTY, first: 0, count: 0, right: 0 };
    let mut branches = vec![unused; (2 * items.len()).saturating_sub(1)];
    let progress = Progress { done: AtomicUsize::new(0), total: items.len(), job };
    grow(&mut items, 0, &mut branches, 0, cost, &progress)?;
    Ok((branches, items))
}

/// `None` for a triangle that no ray can hit: not finite, or so far out that products overflow.
fn item(index: usize, corners: &[Vec3; 3]) -> Option<Item> {
    let id = u32::try_from(index).ok().filter(|&i| i < MOST)?;
    let fits = |p: &Vec3| p.is_finite() && p.abs().max_element() <= LARGEST;
    let bounds = corners.iter().fold(Bounds::EMPTY, |b, &p| b.point(p.into()));
    corners.iter().all(fits).then(|| Item {
        bounds: bounds.pad(PAD * f64::from((bounds.hi - bounds.lo).max_element())),
        id,
    })
}

struct Progress<'a> {
    done: AtomicUsize,
    total: usize,
    job: &'a Job,
}

impl Progress<'_> {
    fn add(&self, placed: usize) -> Result<(), Cancelled> {
        self.job.step(self.done.fetch_add(placed, Ordering::Relaxed) + placed, self.total)
    }
}

/// Writes the binary tree over `items` to `out`, which has two places an item less one, wherever
/// the threads are.
fn grow(
    items: &mut [Item],
    first: usize,
    out: &mut [Branch],
    depth: usize,
    cost: &Cost,
    progress: &Progress,
) -> Result<(), Cancelled> {
    let n = items.len();
    let (mut bounds, mut centres) = (Bounds::EMPTY, Bounds::EMPTY);
    for item in &*items {
        bounds = bounds.join(item.bounds);
        centres = centres.point(item.centre());
    }
    let leaf = n <= cost.set;
    let left = if leaf { 0 } else { part(items, centres, depth, cost) };
    let [branch, below @ ..] = out else { return Ok(()) };
    *branch = Branch { bounds, first: first as u32, count: n as u32, right: 2 * left as u32 };
    if leaf {
        return Ok(());
    }
    let (a, b) = items.split_at_mut(left);
    let (below_a, below_b) = below.split_at_mut(2 * left - 1);
    let half = |items: &mut [Item], first, out: &mut [Branch]| {
        grow(items, first, out, depth + 1, cost, progress)?;
        // The largest pieces that one thread does alone report when they are done.
        if n > GRAIN && items.len() <= GRAIN { progress.add(items.len()) } else { Ok(()) }
    };
    if n > GRAIN {
        progress.add(0)?;
        let (a, b) = rayon::join(|| half(a, first, below_a), || half(b, first + left, below_b));
        a.and(b)
    } else {
        half(a, first, below_a)?;
        half(b, first + left, below_b)
    }
}

/// Reorders the items so that the first of two sets comes first; returns its size, neither 0 nor
/// all.
fn part(items: &mut [Item], centres: Bounds, depth: usize, cost: &Cost) -> usize {
    if depth < SAH_DEPTH
        && let Some(cut) = best_cut(items, centres, cost)
    {
        return cut.apply(items);
    }
    // All centres in one place, or a tree that degenerates: halve by count. The index makes the
    // order a total one.
    let axis = axis_of_most(centres);
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| {
        a.centre()[axis].total_cmp(&b.centre()[axis]).then(a.id.cmp(&b.id))
    });
    middle
}

fn axis_of_most(b: Bounds) -> usize {
    let d = b.hi - b.lo;
    if d.x >= d.y && d.x >= d.z {
        0
    } else if d.y >= d.z {
        1
    } else {
        2
    }
}

/// A plane between two bins.
struct Cut {
    axis: usize,
    origin: f32,
    scale: f32,
    /// First bin of the second set.
    bin: usize,
}

impl Cut {
    fn apply(&self, items: &mut [Item]) -> usize {
        let is_left =
            |item: &Item| bin(item.centre()[self.axis], self.origin, self.scale) < self.bin;
        let (mut i, mut j) = (0, items.len());
        while i < j {
            if is_left(&items[i]) {
                i += 1;
            } else {
                j -= 1;
                items.swap(i, j);
            }
        }
        i
    }
}

/// Casts saturate: NaN (no extent) becomes 0, infinity the last bin.
fn bin(centre: f32, origin: f32, scale: f32) -> usize {
    (((centre - origin) * scale) as usize).min(BINS - 1)
}

/// The cheapest of 3 × 31 planes; `None` where all centres coincide.
fn best_cut(items: &[Item], centres: Bounds, cost: &Cost) -> Option<Cut> {
    let scale = BINS as f32 * (1.0 - 1e-6) / (centres.hi - centres.lo);
    let mut bins = [[(Bounds::EMPTY, 0_u32); BINS]; 3];
    for item in items {
        let centre = item.centre();
        for axis in 0..3 {
            let (bounds, count) = &mut bins[axis][bin(centre[axis], centres.lo[axis], scale[axis])];
            *bounds = bounds.join(item.bounds);
            *count += 1;
        }
    }
    let mut best = (f32::INFINITY, None);
    for (axis, bins) in bins.iter().enumerate() {
        let mut right = [(0.0, 0_u32); BINS];
        let mut sum = (Bounds::EMPTY, 0);
        for i in (1..BINS).rev() {
            sum = (sum.0.join(bins[i].0), sum.1 + bins[i].1);
            right[i] = (sum.0.half_area() * cost.sets(sum.1), sum.1);
        }
        let mut left = (Bounds::EMPTY, 0);
        for i in 1..BINS {
            left = (left.0.join(bins[i - 1].0), left.1 + bins[i - 1].1);
            let total = left.0.half_area() * cost.sets(left.1) + right[i].0;
            if left.1 > 0 && right[i].1 > 0 && total < best.0 {
                best = (
                    total,
                    Some(Cut { axis, origin: centres.lo[axis], scale: scale[axis], bin: i }),
                );
            }
        }
    }
    best.1
}

/// The cheapest ways to represent the triangles below a branch as 1, 2, … 7 trees.
#[derive(Clone, Copy)]
struct Plan {
    /// `cost[j - 1]`: as at most j trees.
    cost: [f32; 7],
    /// `share[j - 1]`, j = 2…8: how many of j trees the left child gets; 0: do as for j - 1 trees.
    share: [u8; 8],
    /// Whether one tree means one leaf.
    leaf: bool,
}

fn plan(branches: &[Branch], cost: &Cost) -> Vec<Plan> {
    let mut plans = vec![Plan { cost: [0.0; 7], share: [0; 8], leaf: true }; branches.len()];
    // Children come after their parent: backwards, they are known.
    for (k, branch) in branches.iter().enumerate().rev().filter(|(_, b)| b.count > 0) {
        let area = branch.bounds.half_area();
        let as_leaf = if branch.count <= 8 {
            area * (cost.leaf + cost.triangle * branch.count as f32)
        } else {
            f32::INFINITY
        };
        plans[k].cost = [as_leaf; 7];
        if branch.right > 0 {
            let (left, right) = (plans[k + 1], plans[k + branch.right as usize]);
            let spread = |trees: usize| {
                (1..trees)
                    .map(|i| {
                        (left.cost[i.min(7) - 1] + right.cost[(trees - i).min(7) - 1], i as u8)
                    })
                    .min_by(|a, b| a.0.total_cmp(&b.0))
            };
            let plan = &mut plans[k];
            let (below, share) = spread(8).unwrap_or_default();
            plan.share[7] = share;
            // Areas may be infinite or zero; a set that fits no leaf must open all the same.
            plan.leaf = branch.count <= 8 && as_leaf <= area + below;
            plan.cost[0] = if plan.leaf { as_leaf } else { area + below };
            for trees in 2..8 {
                let (cost, share) = spread(trees).unwrap_or_default();
                (plan.cost[trees - 1], plan.share[trees - 1]) = if cost < plan.cost[trees - 2] {
                    (cost, share)
                } else {
                    (plan.cost[trees - 2], 0)
                };
            }
        }
    }
    plans
}

/// Writes the wide tree.
struct Collapse<'a> {
    triangles: &'a [[Vec3; 3]],
    items: &'a [Item],
    branches: &'a [Branch],
    plans: Vec<Plan>,
    fans: bool,
    tree: Tree,
}

impl Collapse<'_> {
    fn root(&mut self) {
        if self.plans[0].leaf {
            self.tree.node.push(Node::empty());
            self.fill(0, &[0]);
        } else {
            self.node(0);
        }
    }

    /// Adds the node of branch `k` and all below; returns its index.
    fn node(&mut self, k: usize) -> u32 {
        let index = self.tree.node.len();
        self.tree.node.push(Node::empty());
        let mut below = Vec::with_capacity(8);
        self.gather(k, 8, &mut below);
        self.fill(index, &below);
        index as u32
    }

    /// The branches that represent `k` as `trees` trees; with eight it is opened in any case.
    fn gather(&self, k: usize, trees: usize, out: &mut Vec<usize>) {
        let share = self.plans[k].share[trees - 1] as usize;
        if trees == 1 || self.branches[k].right == 0 {
            out.push(k);
        } else if share == 0 {
            self.gather(k, trees - 1, out);
        } else {
            self.gather(k + 1, share.min(7), out);
            self.gather(k + self.branches[k].right as usize, (trees - share).min(7), out);
        }
    }

    fn fill(&mut self, index: usize, below: &[usize]) {
        if self.fans {
            self.tree.fans.order.resize(self.tree.node.len(), [[0; 8]; 8]);
            self.tree.fans.order[index] = self.order(below);
        }
        let mut planes = [[[1e30_f32; 8], [-1e30; 8]]; 3];
        let mut child = [0; 8];
        for (lane, &k) in below.iter().enumerate() {
            let bounds = self.branches[k].bounds;
            for (axis, [lo, hi]) in planes.iter_mut().enumerate() {
                lo[lane] = bounds.lo[axis];
                hi[lane] = bounds.hi[axis];
            }
            child[lane] = if self.plans[k].leaf { self.block(k) } else { self.node(k) };
        }
        self.tree.node[index] = Node {
            planes: planes.map(|p| p.map(f32x8::from)),
            child,
            children: below.len() as u32,
        };
    }

    /// Lanes by the nearest corner of their boxes, for rays along the diagonal of each octant.
    fn order(&self, below: &[usize]) -> [[u8; 8]; 8] {
        let mut order = [[0, 1, 2, 3, 4, 5, 6, 7]; 8];
        for (octant, lanes) in order.iter_mut().enumerate() {
            let depth = |&lane: &u8| {
                let Bounds { lo, hi } = self.branches[below[lane as usize]].bounds;
                (0..3).map(|a| if octant >> a & 1 == 1 { -hi[a] } else { lo[a] }).sum::<f32>()
            };
            lanes[..below.len()].sort_by(|a, b| depth(a).total_cmp(&depth(b)));
        }
        order
    }

    fn block(&mut self, k: usize) -> u32 {
        let Branch { first, count, .. } = self.branches[k];
        let items = &self.items[first as usize..(first + count) as usize];
        let mut corner = [[[0.0_f32; 8]; 3]; 3];
        let mut id = [0; 8];
        for (lane, item) in items.iter().enumerate() {
            id[lane] = item.id;
            for (i, p) in self.triangles[item.id as usize].iter().enumerate() {
                for (axis, x) in p.to_array().into_iter().enumerate() {
                    corner[axis][i][lane] = x;
                }
            }
        }
        let index = self.tree.block.len() as u32;
        self.tree.block.push(Block { corner: corner.map(|c| c.map(f32x8::from)), id });
        if self.fans {
            self.fan(items);
        }
        LEAF | index
    }

    fn fan(&mut self, items: &[Item]) {
        let fans = &mut self.tree.fans;
        let start = [fans.vertex.len(), fans.face.len()];
        let mut items = items.to_vec();
        items.sort_by_key(|item| item.id);
        for item in items {
            let corner = self.triangles[item.id as usize].map(|p| {
                let p = p.to_array();
                let seen = fans.vertex[start[0]..]
                    .iter()
                    .position(|q| q.map(f32::to_bits) == p.map(f32::to_bits));
                seen.unwrap_or_else(|| {
                    fans.vertex.push(p);
                    fans.vertex.len() - 1 - start[0]
                }) as u8
            });
            fans.face.push(Face { corner, id: item.id });
        }
        let end = [fans.vertex.len(), fans.face.len()];
        fans.leaf.push(Fan {
            vertex: [start[0] as u32, end[0] as u32],
            face: [start[1] as u32, end[1] as u32],
        });
    }
}
