//! Eight rays of a kind against one box or triangle at a time.
//!
//! A batch is sorted into 24 bins by the axis of the direction's largest component and by the signs
//! of all three, so that the rays of a packet shear along the same axis and enter every box through
//! the same faces.

use wide::f32x8;

use super::{
    Hit, LARGEST, LENGTHS, Ray,
    single::{self, FLAT, Flight, NEARER, meet},
    tree::{Fan, LEAF, Node, STACK, Tree},
};

/// What the kernels work in: stacks and the sort. Keep one a thread; a new one for each batch costs
/// more than the rays.
#[derive(Debug)]
pub struct Scratch {
    pub(super) flight: Box<Flight>,
    stack: Box<Stack>,
    /// The corners of a leaf as the packet sees them: x, y sheared, z along the ray.
    corner: Box<[[f32x8; 3]; CORNERS]>,
    sort: Sort,
}

/// More than the 24 corners that a leaf may have, and a power of two, so that a mask replaces the
/// bounds check.
const CORNERS: usize = 32;

impl Default for Scratch {
    fn default() -> Self {
        Self {
            flight: Box::default(),
            stack: Box::new([0; STACK]),
            corner: Box::new([[f32x8::ZERO; 3]; CORNERS]),
            sort: Sort::default(),
        }
    }
}

/// Nodes whose turn it is, and how many of their children have had theirs.
type Stack = [u64; STACK];

const BINS: usize = 24;

/// Counting sort of a batch.
#[derive(Debug, Default)]
struct Sort {
    bin: Vec<u8>,
    /// Indices of rays, bin after bin.
    order: Vec<u32>,
    /// Where each bin ends.
    end: [usize; BINS],
}

impl Sort {
    fn sort(&mut self, rays: &[Ray]) {
        self.bin.clear();
        self.bin.extend(rays.iter().map(bin));
        let mut next = [0; BINS];
        for &bin in &self.bin {
            next[bin as usize] += 1;
        }
        let mut sum = 0;
        for n in &mut next {
            sum += std::mem::replace(n, sum);
        }
        self.order.resize(rays.len(), 0);
        for (i, &bin) in self.bin.iter().enumerate() {
            let place = &mut next[bin as usize];
            self.order[*place] = i as u32;
            *place += 1;
        }
        self.end = next;
    }
}

/// 8 kz + octant.
fn bin(ray: &Ray) -> u8 {
    let d = ray.direction;
    let octant =
        d.iter().enumerate().fold(0, |o, (a, d)| o | usize::from(d.is_sign_negative()) << a);
    (8 * single::axes(d)[2] + octant) as u8
}

/// Eight rays that shear along axis Z.
struct Packet<const Z: usize> {
    origin: [f32x8; 3],
    shear: [f32x8; 3],
    inverse: [f32x8; 3],
    /// Which of two planes is nearer.
    side: [usize; 3],
    /// Hits must be nearer than this; −∞ in lanes that are done or were never alive.
    reach: f32x8,
}

impl<const Z: usize> Packet<Z> {
    const X: usize = (Z + 1) % 3;
    const Y: usize = (Z + 2) % 3;

    #[inline(always)]
    fn gather(rays: &[Ray], order: &[u32], octant: usize) -> Self {
        let record = |lane: usize| {
            // Lanes past the end repeat the first ray.
            let index = order[if lane < order.len() { lane } else { 0 }] as usize;
            let Ray { origin: [ox, oy, oz], t_max, direction: [dx, dy, dz], tag } = rays[index];
            // The tag comes along because thirty-two bytes are one load.
            f32x8::from([ox, oy, oz, t_max, dx, dy, dz, f32::from_bits(tag)])
        };
        let records = [
            record(0),
            record(1),
            record(2),
            record(3),
            record(4),
            record(5),
            record(6),
            record(7),
        ];
        let [ox, oy, oz, t_max, dx, dy, dz, _] = f32x8::transpose(records);
        let (o, d) = ([ox, oy, oz], [dx, dy, dz]);
        let [ax, ay, az] = d.map(f32x8::abs);
        let within = |x: f32x8, limit: f32| x.simd_le(f32x8::splat(limit));
        let lanes = f32x8::from([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        let valid = t_max.simd_gt(f32x8::ZERO)
            & within(ox.abs(), LARGEST)
            & within(oy.abs(), LARGEST)
            & within(oz.abs(), LARGEST)
            & within(ax, LENGTHS[1])
            & within(ay, LENGTHS[1])
            & within(az, LENGTHS[1])
            & d[Z].abs().simd_ge(f32x8::splat(LENGTHS[0]))
            & lanes.simd_lt(f32x8::splat(order.len() as f32));
        let side = [0, 1, 2].map(|a| octant >> a & 1);
        let floor = d[Z].abs() * f32x8::splat(FLAT);
        let one = side.map(|s| f32x8::splat(if s == 1 { -1.0 } else { 1.0 }));
        let inverse = [0, 1, 2].map(|a| one[a] / d[a].abs().fast_max(floor));
        Self {
            origin: o,
            shear: [-d[Self::X] / d[Z], -d[Self::Y] / d[Z], f32x8::ONE / d[Z]],
            inverse,
            side,
            reach: valid.select(t_max, f32x8::splat(f32::NEG_INFINITY)),
        }
    }

    /// Whether any ray enters child `lane` within its reach.
    #[inline(always)]
    fn enters(&self, node: &Node, lane: usize) -> bool {
        let plane =
            |a: usize, side: usize| f32x8::splat(node.planes[a][side & 1].as_array()[lane & 7]);
        let enter = |a: usize| (plane(a, self.side[a]) - self.origin[a]) * self.inverse[a];
        let leave = |a: usize| (plane(a, self.side[a] ^ 1) - self.origin[a]) * self.inverse[a];
        let first = enter(0).fast_max(enter(1)).fast_max(enter(2).fast_max(f32x8::ZERO))
            * f32x8::splat(NEARER);
        let last = leave(0).fast_min(leave(1)).fast_min(leave(2).fast_min(self.reach));
        first.simd_le(last).any()
    }

    /// Shears every corner of the leaf once.
    #[inline(always)]
    fn corners(&self, tree: &Tree, fan: Fan, out: &mut [[f32x8; 3]; CORNERS]) {
        let vertices = &tree.fans.vertex[fan.vertex[0] as usize..fan.vertex[1] as usize];
        for (vertex, out) in vertices.iter().zip(out) {
            let from = |a: usize| f32x8::splat(vertex[a]) - self.origin[a];
            let z = from(Z);
            *out = [
                self.shear[0].mul_add(z, from(Self::X)),
                self.shear[1].mul_add(z, from(Self::Y)),
                z,
            ];
        }
    }

    /// Visits the leaves that some ray reaches, those that lie first in the octant of the
    /// directions first, until `leaf` says that all rays are done. `leaf` may shorten the packet's
    /// reach: a box is tested when its turn has come.
    #[inline(always)]
    fn walk(
        &mut self,
        tree: &Tree,
        octant: usize,
        stack: &mut Stack,
        mut leaf: impl FnMut(&mut Self, Fan) -> bool,
    ) {
        // Nodes whose turn it is, and how many of their children have had theirs.
        let (mut node, mut turn, mut top) = (0_u32, 0_u32, 0);
        loop {
            let Node { children, child, .. } = &tree.node[node as usize];
            if turn == *children {
                if top == 0 {
                    return;
                }
                top -= 1;
                (node, turn) = ((stack[top % STACK] >> 32) as u32, stack[top % STACK] as u32);
                continue;
            }
            let lane =
                usize::from(tree.fans.order[node as usize][octant & 7][turn as usize & 7]) & 7;
            turn += 1;
            if self.enters(&tree.node[node as usize], lane) {
                if child[lane] & LEAF == 0 {
                    stack[top % STACK] = u64::from(node) << 32 | u64::from(turn);
                    top += 1;
                    (node, turn) = (child[lane], 0);
                } else if leaf(self, tree.fans.leaf[(child[lane] & !LEAF) as usize]) {
                    return;
                }
            }
        }
    }
}

/// Calls `packets` with each bin's axis, octant and rays.
fn each_bin(sort: &Sort, mut packets: impl FnMut(usize, usize, &[u32])) {
    let mut begin = 0;
    for (bin, &end) in sort.end.iter().enumerate() {
        for order in sort.order[begin..end].chunks(8) {
            packets(bin / 8, bin % 8, order);
        }
        begin = end;
    }
}

pub(super) fn closest(tree: &Tree, rays: &[Ray], hits: &mut [Hit], scratch: &mut Scratch) {
    let Scratch { stack, corner, sort, .. } = scratch;
    if tree.node.is_empty() {
        hits.fill(Hit::MISS);
        return;
    }
    sort.sort(rays);
    each_bin(sort, |axis, octant, order| match axis {
        0 => closest_packet::<0>(tree, rays, order, octant, hits, stack, corner),
        1 => closest_packet::<1>(tree, rays, order, octant, hits, stack, corner),
        _ => closest_packet::<2>(tree, rays, order, octant, hits, stack, corner),
    });
}

fn closest_packet<const Z: usize>(
    tree: &Tree,
    rays: &[Ray],
    order: &[u32],
    octant: usize,
    hits: &mut [Hit],
    stack: &mut Stack,
    corner: &mut [[f32x8; 3]; CORNERS],
) {
    let mut packet = Packet::<Z>::gather(rays, order, octant);
    let t_max = packet.reach;
    // Indices as the bits of floats: below 0x7f00_0000 they compare alike, and blending keeps them.
    // None is lower than 0: a hit exactly at t_max is none.
    let mut id = f32x8::ZERO;
    packet.walk(tree, octant, stack, |packet, fan| {
        packet.corners(tree, fan, corner);
        // Faces of a leaf come in the order of their indices. Reaching a little further finds those
        // as far as the best so far.
        let mut leaf =
            (packet.reach * f32x8::splat(1.0 + 2.0 * f32::EPSILON), f32x8::splat(f32::INFINITY));
        for face in &tree.fans.face[fan.face[0] as usize..fan.face[1] as usize] {
            let [a, b, c] = face.corner.map(|i| corner[i as usize % CORNERS]);
            let (t, hit) =
                meet([a[0], b[0], c[0]], [a[1], b[1], c[1]], [a[2], b[2], c[2]], packet.shear[2]);
            let this = f32x8::splat(f32::from_bits(face.id));
            let nearer = hit & t.simd_lt(leaf.0);
            leaf = (nearer.select(t, leaf.0), nearer.select(this, leaf.1));
        }
        let nearer =
            leaf.0.simd_lt(packet.reach) | leaf.0.simd_eq(packet.reach) & leaf.1.simd_lt(id);
        packet.reach = nearer.select(leaf.0, packet.reach);
        id = nearer.select(leaf.1, id);
        false
    });
    let found = packet.reach.simd_lt(t_max);
    let t = found.select(packet.reach, f32x8::splat(Hit::MISS.t)).to_array();
    let id = found.select(id, f32x8::splat(f32::from_bits(Hit::NONE))).to_array();
    for (lane, &ray) in order.iter().enumerate() {
        hits[ray as usize] = Hit { t: t[lane & 7], triangle: id[lane & 7].to_bits() };
    }
}

pub(super) fn any(tree: &Tree, rays: &[Ray], blocked: &mut [bool], scratch: &mut Scratch) {
    let Scratch { stack, corner, sort, .. } = scratch;
    if tree.node.is_empty() {
        blocked.fill(false);
        return;
    }
    sort.sort(rays);
    each_bin(sort, |axis, octant, order| match axis {
        0 => any_packet::<0>(tree, rays, order, octant, blocked, stack, corner),
        1 => any_packet::<1>(tree, rays, order, octant, blocked, stack, corner),
        _ => any_packet::<2>(tree, rays, order, octant, blocked, stack, corner),
    });
}

fn any_packet<const Z: usize>(
    tree: &Tree,
    rays: &[Ray],
    order: &[u32],
    octant: usize,
    blocked: &mut [bool],
    stack: &mut Stack,
    corner: &mut [[f32x8; 3]; CORNERS],
) {
    let mut packet = Packet::<Z>::gather(rays, order, octant);
    let t_max = packet.reach;
    let done = f32x8::splat(f32::NEG_INFINITY);
    packet.walk(tree, octant, stack, |packet, fan| {
        packet.corners(tree, fan, corner);
        for face in &tree.fans.face[fan.face[0] as usize..fan.face[1] as usize] {
            let [a, b, c] = face.corner.map(|i| corner[i as usize % CORNERS]);
            let (t, hit) =
                meet([a[0], b[0], c[0]], [a[1], b[1], c[1]], [a[2], b[2], c[2]], packet.shear[2]);
            packet.reach = (hit & t.simd_lt(packet.reach)).select(done, packet.reach);
        }
        packet.reach.simd_le(done).all()
    });
    let hit = packet.reach.simd_lt(t_max).to_bitmask();
    for (lane, &ray) in order.iter().enumerate().take(8) {
        blocked[ray as usize] = hit >> lane & 1 == 1;
    }
}
