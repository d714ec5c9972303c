//! One ray against eight boxes or eight triangles at a time, sixteen rays in flight.
//!
//! # Why in flight
//! A ray alone waits: for a box from memory, then for the test of it, and then for the branch that
//! hangs on the test. So the rays in flight take each step together, in two stages: first all
//! tests, which have no branch and nothing to do with each other, so that their waits overlap; then
//! where each ray goes. A ray that is done makes room for the next of the batch.
//!
//! # Watertight without double precision
//! In coordinates sheared along the ray, with the ray as origin, a triangle is hit where its three
//! edge functions have one sign. u = x₂y₁ − y₂x₁ is computed from two products that are **rounded
//! separately**, never by a fused multiply-add. Rounding is monotonic, so the difference of the
//! rounded products has the sign of the exact difference or is zero, and the neighbour across the
//! edge computes exactly −u. Zero counts as inside. So a ray through a shared edge hits at least
//! one of the two.

use wide::f32x8;

use super::{
    Hit, Ray,
    tree::{Block, LEAF, Node, STACK, Tree},
};

/// Rays in flight, a power of two, so that a mask replaces the bounds check. Measured: 8 are 7 %
/// slower, 32 and 64 are no faster.
const FLIGHT: usize = 16;
const _: () = assert!(FLIGHT.is_power_of_two() && FLIGHT <= 256);

/// Leaves are tested when so many rays stand before one, or all do.
const LEAVES: usize = FLIGHT / 2;

/// A ray on its way.
#[derive(Debug, Clone, Copy)]
struct Cursor {
    origin: [f32; 3],
    /// The plane at x is met at `(x - origin) * inverse`, within 3 u of that distance (u = ε/2).
    /// Fused, as `x * inverse - origin * inverse`, it would be within u of the origin's, which may
    /// be far more.
    inverse: [f32; 3],
    /// −d[kx]/d[kz], −d[ky]/d[kz], 1/d[kz].
    shear: [f32; 3],
    /// Axis of the largest component of the direction, and the two next to it.
    axes: [usize; 3],
    /// Which of two planes is nearer.
    side: [usize; 3],
    /// The first hit so far.
    best: Hit,
    /// Node or leaf that it stands before.
    current: u32,
    /// Entries on its stack.
    top: usize,
    /// Its place in the batch.
    ray: usize,
}

/// Axis of the largest component and the next two.
#[inline(always)]
pub(super) fn axes(d: [f32; 3]) -> [usize; 3] {
    let [x, y, z] = d.map(f32::abs);
    if x > y && x > z {
        [1, 2, 0]
    } else if y > z {
        [2, 0, 1]
    } else {
        [0, 1, 2]
    }
}

/// Components of the direction nearer to zero than this share of the largest are taken as this
/// share, for boxes only: over the length of the ray it moves the ray by far less than rounding
/// does, and no plane lies at 0·∞.
pub(super) const FLAT: f32 = 1e-20;

/// Boxes count as entered at this share of the distance: 3 u of either plane's and 5 u of what
/// either axis of a triangle is seen off its place (`build::PAD`), and some more for the distance
/// of the hit itself. (On the planes: Ize, "Robust BVH ray traversal", JCGT 2:2, 2013.)
pub(super) const NEARER: f32 = 1.0 - 10.0 * f32::EPSILON;

impl Cursor {
    const NONE: Self = Self {
        origin: [0.0; 3],
        inverse: [0.0; 3],
        shear: [0.0; 3],
        axes: [0; 3],
        side: [0; 3],
        best: Hit::MISS,
        current: 0,
        top: 0,
        ray: 0,
    };

    #[inline(always)]
    fn new(ray: &Ray, index: usize) -> Self {
        let (o, d) = (ray.origin, ray.direction);
        let axes = axes(d);
        let [kx, ky, kz] = axes;
        let floor = FLAT * d[kz].abs();
        Self {
            origin: o,
            inverse: d.map(|d| 1.0 / d.abs().max(floor).copysign(d)),
            shear: [-d[kx] / d[kz], -d[ky] / d[kz], 1.0 / d[kz]],
            axes,
            side: d.map(|d| usize::from(d.is_sign_negative())),
            // No index is lower than 0: a hit exactly at `t_max` is none.
            best: Hit { t: ray.t_max, triangle: 0 },
            current: 0,
            top: 0,
            ray: index,
        }
    }

    /// Where the eight boxes are entered, and which of them before the best hit.
    #[inline(always)]
    fn boxes(&self, node: &Node) -> (f32x8, u32) {
        let along = |a: usize, side: usize| {
            (node.planes[a][side & 1] - f32x8::splat(self.origin[a]))
                * f32x8::splat(self.inverse[a])
        };
        let enter = |a: usize| along(a, self.side[a]);
        let leave = |a: usize| along(a, self.side[a] ^ 1);
        let first = enter(0).fast_max(enter(1)).fast_max(enter(2).fast_max(f32x8::ZERO))
            * f32x8::splat(NEARER);
        let last =
            leave(0).fast_min(leave(1)).fast_min(leave(2).fast_min(f32x8::splat(self.best.t)));
        (first, first.simd_le(last).to_bitmask())
    }

    /// Distances of the eight triangles, and which of them are hit at a positive one, not beyond
    /// the best.
    #[inline(always)]
    fn triangles(&self, block: &Block) -> (f32x8, u32) {
        let [kx, ky, kz] = self.axes.map(|a| a.min(2));
        let origin = self.axes.map(|a| f32x8::splat(self.origin[a.min(2)]));
        let shear = self.shear.map(f32x8::splat);
        let z = [0, 1, 2].map(|i| block.corner[kz][i] - origin[2]);
        let x = [0, 1, 2].map(|i| shear[0].mul_add(z[i], block.corner[kx][i] - origin[0]));
        let y = [0, 1, 2].map(|i| shear[1].mul_add(z[i], block.corner[ky][i] - origin[1]));
        let (t, hit) = meet(x, y, z, shear[2]);
        (t, (hit & t.simd_le(f32x8::splat(self.best.t))).to_bitmask())
    }
}

/// The watertight test: distance along the ray, and a mask of where there is a hit at a positive
/// one. A determinant of zero gives NaN or infinity, which the comparisons with 0 and with a finite
/// or infinite `t_max` reject.
#[inline(always)]
pub(super) fn meet(x: [f32x8; 3], y: [f32x8; 3], z: [f32x8; 3], inverse: f32x8) -> (f32x8, f32x8) {
    let u = x[2] * y[1] - y[2] * x[1];
    let v = x[0] * y[2] - y[0] * x[2];
    let w = x[1] * y[0] - y[1] * x[0];
    let det = u + (v + w);
    // All of the determinant's sign, or zero.
    let sign = det & -f32x8::ZERO;
    let inside = (u ^ sign).fast_min(v ^ sign).fast_min(w ^ sign).simd_ge(f32x8::ZERO);
    let t = u.mul_add(z[0], v.mul_add(z[1], w * z[2])) / det * inverse;
    (t, inside & t.simd_gt(f32x8::ZERO))
}

/// Takes the lowest lane out of a mask that is not empty.
#[inline(always)]
fn next(mask: &mut u32) -> usize {
    let lane = mask.trailing_zeros() as usize & 7;
    *mask &= mask.wrapping_sub(1);
    lane
}

/// Places in the columns of [`Flight`].
#[derive(Debug, Clone, Copy)]
struct List {
    slot: [u8; FLIGHT],
    len: usize,
}

impl List {
    const EMPTY: Self = Self { slot: [0; FLIGHT], len: 0 };

    /// Adds a slot where `so`, without a branch.
    #[inline(always)]
    fn push(&mut self, slot: usize, so: bool) {
        self.slot[self.len % FLIGHT] = slot as u8;
        self.len += usize::from(so);
    }

    /// The slots in the list, which is empty then.
    #[inline(always)]
    fn take(&mut self) -> impl Iterator<Item = usize> + Clone + use<> {
        let Self { slot, len } = *self;
        self.len = 0;
        (0..len.min(FLIGHT)).map(move |i| slot[i] as usize % FLIGHT)
    }
}

/// Rays of a batch that have not started.
struct Waiting<'a> {
    rays: &'a [Ray],
    next: usize,
}

/// What the kernel works in, a column for each ray in flight.
#[derive(Debug)]
pub(super) struct Flight {
    cursor: [Cursor; FLIGHT],
    /// What is left to visit, level by level. Entries are the distance at which a box is entered
    /// (high half; floats that are not negative sort as integers) and the child.
    stack: Vec<[u64; FLIGHT]>,
    /// Outcome of the last test: distances of the eight boxes or triangles, and which of them are
    /// met.
    at: [[f32; 8]; FLIGHT],
    mask: [u32; FLIGHT],
    /// Who stands before a node, and who before a leaf.
    node: List,
    leaf: List,
}

impl Default for Flight {
    fn default() -> Self {
        Self {
            cursor: [Cursor::NONE; FLIGHT],
            stack: vec![[0; FLIGHT]; STACK],
            at: [[0.0; 8]; FLIGHT],
            mask: [0; FLIGHT],
            node: List::EMPTY,
            leaf: List::EMPTY,
        }
    }
}

impl Flight {
    /// Sends all rays through the tree; with `ANY` a ray is done at whatever it hits first.
    /// `answer` learns each ray's place in the batch and its hit.
    #[inline(always)]
    fn fly<const ANY: bool>(
        &mut self,
        tree: &Tree,
        rays: &[Ray],
        mut answer: impl FnMut(usize, Hit),
    ) {
        let mut waiting = Waiting { rays, next: 0 };
        (self.node.len, self.leaf.len) = (0, 0);
        for slot in 0..FLIGHT {
            self.start(slot, &mut waiting, &mut answer);
        }
        while self.node.len + self.leaf.len > 0 {
            let slots = self.node.take();
            for slot in slots.clone() {
                let cursor = &self.cursor[slot];
                let (at, mask) = cursor.boxes(&tree.node[cursor.current as usize]);
                (self.at[slot], self.mask[slot]) = (at.to_array(), mask);
            }
            for slot in slots {
                let to = self.enter::<ANY>(tree, slot).or_else(|| self.back::<ANY>(slot));
                self.go(slot, to, &mut waiting, &mut answer);
            }
            if self.leaf.len < LEAVES && self.node.len > 0 {
                continue;
            }
            let slots = self.leaf.take();
            for slot in slots.clone() {
                let cursor = &self.cursor[slot];
                let (at, mask) = cursor.triangles(&tree.block[(cursor.current & !LEAF) as usize]);
                (self.at[slot], self.mask[slot]) = (at.to_array(), mask);
            }
            for slot in slots {
                let hit = self.hit(tree, slot);
                let to = if ANY && hit { None } else { self.back::<ANY>(slot) };
                self.go(slot, to, &mut waiting, &mut answer);
            }
        }
    }

    /// The next ray that can hit anything starts here, if there is one.
    #[inline(always)]
    fn start(&mut self, slot: usize, waiting: &mut Waiting, answer: &mut impl FnMut(usize, Hit)) {
        while let Some(ray) = waiting.rays.get(waiting.next) {
            let place = waiting.next;
            waiting.next += 1;
            if ray.is_valid() {
                self.cursor[slot] = Cursor::new(ray, place);
                self.node.push(slot, true);
                return;
            }
            answer(place, Hit::MISS);
        }
    }

    /// On to a node or leaf; with nowhere to go the ray is done, and the next one starts here.
    #[inline(always)]
    fn go(
        &mut self,
        slot: usize,
        to: Option<u32>,
        waiting: &mut Waiting,
        answer: &mut impl FnMut(usize, Hit),
    ) {
        let cursor = &mut self.cursor[slot];
        if let Some(to) = to {
            cursor.current = to;
            self.node.push(slot, to & LEAF == 0);
            self.leaf.push(slot, to & LEAF != 0);
        } else {
            let Cursor { best, ray, .. } = *cursor;
            answer(ray, if best.t < waiting.rays[ray].t_max { best } else { Hit::MISS });
            self.start(slot, waiting, answer);
        }
    }

    /// The last child left behind that may hold something nearer than the best hit.
    #[inline(always)]
    fn back<const ANY: bool>(&mut self, slot: usize) -> Option<u32> {
        let cursor = &mut self.cursor[slot];
        while cursor.top > 0 {
            cursor.top -= 1;
            let entry = self.stack[cursor.top % STACK][slot];
            if ANY || f32::from_bits((entry >> 32) as u32) <= cursor.best.t {
                return Some(entry as u32);
            }
        }
        None
    }

    /// The nearest child that is entered (with `ANY`, any); the others go onto the stack, nearest
    /// on top.
    #[inline(always)]
    fn enter<const ANY: bool>(&mut self, tree: &Tree, slot: usize) -> Option<u32> {
        let (cursor, at, mut mask) = (&mut self.cursor[slot], &self.at[slot], self.mask[slot]);
        if mask == 0 {
            return None;
        }
        let child = &tree.node[cursor.current as usize].child;
        let first = next(&mut mask);
        if mask == 0 {
            return Some(child[first]);
        }
        let mut push = |top: usize, entry: u64| self.stack[top % STACK][slot] = entry;
        if ANY {
            while mask != 0 {
                push(cursor.top, u64::from(child[next(&mut mask)]));
                cursor.top += 1;
            }
            return Some(child[first]);
        }
        let entry = |lane: usize| u64::from(at[lane].to_bits()) << 32 | u64::from(child[lane]);
        let (a, b) = (entry(first), entry(next(&mut mask)));
        let base = cursor.top;
        push(base, a.max(b));
        cursor.top += 1;
        let mut nearest = a.min(b);
        while mask != 0 {
            let c = entry(next(&mut mask));
            // The nearest is not on the stack: the farther of it and the new one is sorted in.
            let farther = nearest.max(c);
            nearest = nearest.min(c);
            let mut i = cursor.top;
            while i > base && self.stack[(i - 1) % STACK][slot] < farther {
                self.stack[i % STACK][slot] = self.stack[(i - 1) % STACK][slot];
                i -= 1;
            }
            self.stack[i % STACK][slot] = farther;
            cursor.top += 1;
        }
        Some(nearest as u32)
    }

    /// Takes the best of the triangles hit; whether there is one.
    #[inline(always)]
    fn hit(&mut self, tree: &Tree, slot: usize) -> bool {
        let (cursor, mut mask) = (&mut self.cursor[slot], self.mask[slot]);
        let block = &tree.block[(cursor.current & !LEAF) as usize];
        let mut found = false;
        while mask != 0 {
            let lane = next(&mut mask);
            let (t, triangle) = (self.at[slot][lane], block.id[lane]);
            if t < cursor.best.t || t == cursor.best.t && triangle < cursor.best.triangle {
                cursor.best = Hit { t, triangle };
                found = true;
            }
        }
        found
    }
}

pub(super) fn closest(tree: &Tree, rays: &[Ray], hits: &mut [Hit], flight: &mut Flight) {
    if tree.node.is_empty() {
        hits.fill(Hit::MISS);
        return;
    }
    flight.fly::<false>(tree, rays, |ray, hit| hits[ray] = hit);
}

pub(super) fn any(tree: &Tree, rays: &[Ray], blocked: &mut [bool], flight: &mut Flight) {
    if tree.node.is_empty() {
        blocked.fill(false);
        return;
    }
    flight.fly::<true>(tree, rays, |ray, hit| blocked[ray] = hit.is_hit());
}
