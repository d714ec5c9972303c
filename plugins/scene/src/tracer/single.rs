//! One ray against eight boxes or eight triangles at a time.
//!
//! # Watertight without double precision
//! In coordinates sheared along the ray, with the ray as origin, a triangle is hit where its three edge functions have one
//! sign. u = x₂y₁ − y₂x₁ is computed from two products that are **rounded separately**, never by a fused multiply-add. Rounding is
//! monotonic, so the difference of the rounded products has the sign of the exact difference or is zero, and the neighbour across the edge
//! computes exactly −u. Zero counts as inside. So a ray through a shared edge hits at least one of the two.

use wide::f32x8;

use super::{
    Hit, Ray,
    tree::{Block, LEAF, Node, STACK, Tree},
};

/// Rays in flight.
const FLIGHT: usize = 16;

/// Leaves are tested when so many rays stand before one, or all that are left do.
const LEAVES: usize = 8;

/// A ray on its way.
#[derive(Debug, Clone, Copy)]
struct Cursor {
    origin: [f32; 3],
    /// The plane at x is met at `(x - origin) * inverse`, within 3 u of that distance (u = ε/2). Fused, as `x * inverse - origin * inverse`,
    /// it would be within u of the origin's, which may be far more.
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

/// Components of the direction nearer to zero than this share of the largest are taken as this share, for boxes only: over the
/// length of the ray it moves the ray by far less than rounding does, and no plane lies at 0·∞.
pub(super) const FLAT: f32 = 1e-20;

/// Boxes count as entered at this share of the distance: 3 u of either plane's and 5 u of what either axis of a triangle is seen off its
/// place (`build::PAD`), and some more for the distance of the hit itself. (On the planes: Ize, "Robust BVH ray traversal", JCGT 2:2, 2013.)
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
        let along = |a: usize, side: usize| (node.planes[a][side & 1] - f32x8::splat(self.origin[a])) * f32x8::splat(self.inverse[a]);
        let enter = |a: usize| along(a, self.side[a]);
        let leave = |a: usize| along(a, self.side[a] ^ 1);
        let first = enter(0).fast_max(enter(1)).fast_max(enter(2).fast_max(f32x8::ZERO)) * f32x8::splat(NEARER);
        let last = leave(0).fast_min(leave(1)).fast_min(leave(2).fast_min(f32x8::splat(self.best.t)));
        (first, first.simd_le(last).to_bitmask())
    }

    /// Distances of the eight triangles, and which of them are hit at a positive one, not beyond the best.
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

/// The watertight test: distance along the ray, and a mask of where there is a hit at a positive one. A determinant of zero gives
/// NaN or infinity, which the comparisons with 0 and with a finite or infinite `t_max` reject.
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

/// Slots of [`Flight`].
#[derive(Debug, Clone, Copy)]
struct List {
    slot: [u8; FLIGHT],
    len: usize,
}

impl List {
    const EMPTY: Self = Self { slot: [0; FLIGHT], len: 0 };

    /// Adds it if `so`, without a branch.
    #[inline(always)]
    fn push(&mut self, slot: usize, so: bool) {
        self.slot[self.len % FLIGHT] = slot as u8;
        self.len += usize::from(so);
    }

    #[inline(always)]
    fn slots(&self) -> impl Iterator<Item = usize> + Clone + use<> {
        let Self { slot, len } = *self;
        (0..len.min(FLIGHT)).map(move |i| slot[i] as usize % FLIGHT)
    }
}

/// What the kernel works in.
#[derive(Debug)]
pub(super) struct Flight {
    cursor: [Cursor; FLIGHT],
    /// Level by level, each for all rays in flight.
    stack: Vec<[u64; FLIGHT]>,
    /// Where boxes are entered or triangles hit, and which.
    at: [[f32; 8]; FLIGHT],
    mask: [u32; FLIGHT],
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

/// Where a ray goes from a box or a leaf.
enum Turn {
    To(u32),
    Back,
    Done,
}

impl Flight {
    /// Sends all rays through the tree.
    #[inline(always)]
    fn fly<const ANY: bool>(&mut self, tree: &Tree, rays: &[Ray], mut answer: impl FnMut(usize, Hit)) {
        let mut next = 0;
        (self.node.len, self.leaf.len) = (0, 0);
        for slot in 0..FLIGHT {
            self.start(slot, rays, &mut next, &mut answer);
        }
        while self.node.len + self.leaf.len > 0 {
            let slots = self.node.slots();
            self.node.len = 0;
            for slot in slots.clone() {
                let c = &self.cursor[slot];
                let (at, mask) = c.boxes(&tree.node[c.current as usize]);
                (self.at[slot], self.mask[slot]) = (at.to_array(), mask);
            }
            for slot in slots {
                let turn = self.enter::<ANY>(tree, slot);
                self.route::<ANY>(slot, turn, rays, &mut next, &mut answer);
            }
            if self.leaf.len >= LEAVES || self.node.len == 0 {
                let slots = self.leaf.slots();
                self.leaf.len = 0;
                for slot in slots.clone() {
                    let c = &self.cursor[slot];
                    let (at, mask) = c.triangles(&tree.block[(c.current & !LEAF) as usize]);
                    (self.at[slot], self.mask[slot]) = (at.to_array(), mask);
                }
                for slot in slots {
                    let turn = self.judge::<ANY>(tree, slot);
                    self.route::<ANY>(slot, turn, rays, &mut next, &mut answer);
                }
            }
        }
    }

    #[inline(always)]
    fn start(&mut self, slot: usize, rays: &[Ray], next: &mut usize, answer: &mut impl FnMut(usize, Hit)) {
        while let Some(ray) = rays.get(*next) {
            let index = *next;
            *next += 1;
            if ray.is_valid() {
                self.cursor[slot] = Cursor::new(ray, index);
                self.node.push(slot, true);
                return;
            }
            answer(index, Hit::MISS);
        }
    }

    #[inline(always)]
    fn route<const ANY: bool>(&mut self, slot: usize, turn: Turn, rays: &[Ray], next: &mut usize, answer: &mut impl FnMut(usize, Hit)) {
        let c = &mut self.cursor[slot];
        let to = match turn {
            Turn::To(to) => Some(to),
            Turn::Back => loop {
                if c.top == 0 {
                    break None;
                }
                c.top -= 1;
                let entry = self.stack[c.top % STACK][slot];
                if ANY || f32::from_bits((entry >> 32) as u32) <= c.best.t {
                    break Some(entry as u32);
                }
            },
            Turn::Done => None,
        };
        if let Some(to) = to {
            c.current = to;
            self.node.push(slot, to & LEAF == 0);
            self.leaf.push(slot, to & LEAF != 0);
        } else {
            answer(c.ray, if c.best.t < rays[c.ray].t_max { c.best } else { Hit::MISS });
            self.start(slot, rays, next, answer);
        }
    }

    #[inline(always)]
    fn enter<const ANY: bool>(&mut self, tree: &Tree, slot: usize) -> Turn {
        let c = &mut self.cursor[slot];
        let mut mask = self.mask[slot];
        if mask == 0 {
            return Turn::Back;
        }
        let child = &tree.node[c.current as usize].child;
        let first = child[next(&mut mask)];
        if mask == 0 {
            return Turn::To(first);
        }
        let at = &self.at[slot];
        if ANY {
            while mask != 0 {
                self.stack[c.top % STACK][slot] = u64::from(child[next(&mut mask)]);
                c.top += 1;
            }
            return Turn::To(first);
        }
        let entry = |lane: usize| u64::from(at[lane].to_bits()) << 32 | u64::from(child[lane]);
        let first = self.mask[slot].trailing_zeros() as usize & 7;
        let (a, b) = (entry(first), entry(next(&mut mask)));
        let base = c.top;
        self.stack[c.top % STACK][slot] = a.max(b);
        c.top += 1;
        if mask == 0 {
            return Turn::To(a.min(b) as u32);
        }
        // Three or more: sorted onto the stack, nearest on top.
        self.stack[c.top % STACK][slot] = a.min(b);
        c.top += 1;
        while mask != 0 {
            let e = entry(next(&mut mask));
            let mut i = c.top;
            while i > base && self.stack[(i - 1) % STACK][slot] < e {
                self.stack[i % STACK][slot] = self.stack[(i - 1) % STACK][slot];
                i -= 1;
            }
            self.stack[i % STACK][slot] = e;
            c.top += 1;
        }
        c.top -= 1;
        Turn::To(self.stack[c.top % STACK][slot] as u32)
    }

    #[inline(always)]
    fn judge<const ANY: bool>(&mut self, tree: &Tree, slot: usize) -> Turn {
        let c = &mut self.cursor[slot];
        let mut mask = self.mask[slot];
        let block = &tree.block[(c.current & !LEAF) as usize];
        while mask != 0 {
            let lane = next(&mut mask);
            let (t, id) = (self.at[slot][lane], block.id[lane]);
            if t < c.best.t || t == c.best.t && id < c.best.triangle {
                c.best = Hit { t, triangle: id };
                if ANY {
                    return Turn::Done;
                }
            }
        }
        Turn::Back
    }
}

pub(super) fn closest(tree: &Tree, rays: &[Ray], hits: &mut [Hit], flight: &mut Flight) {
    flight.fly::<false>(tree, rays, |ray, hit| hits[ray] = hit);
}

pub(super) fn any(tree: &Tree, rays: &[Ray], blocked: &mut [bool], flight: &mut Flight) {
    flight.fly::<true>(tree, rays, |ray, hit| blocked[ray] = hit.is_hit());
}
