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

/// Entries are the distance at which a box is entered (high half; floats that are not negative sort as integers) and the child.
/// Made once, not zeroed for each ray: that alone cost 8 to 15 % of the time.
pub(super) type Stack = [u64; STACK];

/// What a ray is to boxes and triangles.
struct Setup {
    origin: [f32x8; 3],
    /// Axis of the largest component of the direction, and the two next to it.
    axes: [usize; 3],
    /// −d[kx]/d[kz], −d[ky]/d[kz], 1/d[kz].
    shear: [f32x8; 3],
    /// The plane at x is met at `(x - origin) * inverse`, within 3 u of that distance (u = ε/2). Fused, as `x * inverse - origin * inverse`,
    /// it would be within u of the origin's, which may be far more.
    inverse: [f32x8; 3],
    /// Which of the two planes is nearer.
    side: [usize; 3],
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

impl Setup {
    #[inline(always)]
    fn new(ray: &Ray) -> Self {
        let (o, d) = (ray.origin, ray.direction);
        let axes = axes(d);
        let [kx, ky, kz] = axes;
        let floor = FLAT * d[kz].abs();
        let inverse = d.map(|d| 1.0 / d.abs().max(floor).copysign(d));
        Self {
            origin: o.map(f32x8::splat),
            axes,
            shear: [-d[kx] / d[kz], -d[ky] / d[kz], 1.0 / d[kz]].map(f32x8::splat),
            inverse: inverse.map(f32x8::splat),
            side: d.map(|d| usize::from(d.is_sign_negative())),
        }
    }

    /// Where the eight boxes are entered, and which of them before `t_max`.
    #[inline(always)]
    fn boxes(&self, node: &Node, t_max: f32) -> (f32x8, u32) {
        let enter = |a: usize| (node.planes[a][self.side[a] & 1] - self.origin[a]) * self.inverse[a];
        let leave = |a: usize| (node.planes[a][(self.side[a] & 1) ^ 1] - self.origin[a]) * self.inverse[a];
        let first = enter(0).fast_max(enter(1)).fast_max(enter(2).fast_max(f32x8::ZERO)) * f32x8::splat(NEARER);
        let last = leave(0).fast_min(leave(1)).fast_min(leave(2).fast_min(f32x8::splat(t_max)));
        (first, first.simd_le(last).to_bitmask())
    }

    /// Distances of the eight triangles, and which of them are hit at a positive one.
    #[inline(always)]
    fn triangles(&self, block: &Block) -> (f32x8, f32x8) {
        let [kx, ky, kz] = self.axes;
        let z = [0, 1, 2].map(|i| block.corner[kz][i] - self.origin[kz]);
        let x = [0, 1, 2].map(|i| self.shear[0].mul_add(z[i], block.corner[kx][i] - self.origin[kx]));
        let y = [0, 1, 2].map(|i| self.shear[1].mul_add(z[i], block.corner[ky][i] - self.origin[ky]));
        meet(x, y, z, self.shear[2])
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

pub(super) fn closest(tree: &Tree, ray: &Ray, stack: &mut Stack) -> Hit {
    if !ray.is_valid() || tree.node.is_empty() {
        return Hit::MISS;
    }
    let setup = Setup::new(ray);
    // No index is lower than 0: a hit exactly at `t_max` is none.
    let (mut best, mut id) = (ray.t_max, 0);
    let (mut top, mut current) = (0, 0_u32);
    loop {
        if current & LEAF == 0 {
            let node = &tree.node[current as usize];
            let (enter, mut mask) = setup.boxes(node, best);
            if mask != 0 {
                let first = next(&mut mask);
                if mask == 0 {
                    // Not by way of `enter`: the next node can be loaded before that has gone through memory.
                    current = node.child[first];
                    continue;
                }
                let enter = enter.to_array();
                let entry = |lane: usize| u64::from(enter[lane].to_bits()) << 32 | u64::from(node.child[lane]);
                let second = next(&mut mask);
                let (a, b) = (entry(first), entry(second));
                if mask == 0 {
                    stack[top % STACK] = a.max(b);
                    top += 1;
                    current = if a < b { node.child[first] } else { node.child[second] };
                    continue;
                }
                // Three or more: sorted onto the stack, nearest on top.
                let base = top;
                stack[top % STACK] = a.max(b);
                stack[(top + 1) % STACK] = a.min(b);
                top += 2;
                while mask != 0 {
                    let c = entry(next(&mut mask));
                    let mut i = top;
                    while i > base && stack[(i - 1) % STACK] < c {
                        stack[i % STACK] = stack[(i - 1) % STACK];
                        i -= 1;
                    }
                    stack[i % STACK] = c;
                    top += 1;
                }
                top -= 1;
                current = stack[top % STACK] as u32;
                continue;
            }
        } else {
            let block = &tree.block[(current & !LEAF) as usize];
            let (t, hit) = setup.triangles(block);
            let mut mask = (hit & t.simd_le(f32x8::splat(best))).to_bitmask();
            if mask != 0 {
                let t = t.to_array();
                while mask != 0 {
                    let lane = next(&mut mask);
                    if t[lane] < best || t[lane] == best && block.id[lane] < id {
                        (best, id) = (t[lane], block.id[lane]);
                    }
                }
            }
        }
        loop {
            if top == 0 {
                return if best < ray.t_max { Hit { t: best, triangle: id } } else { Hit::MISS };
            }
            top -= 1;
            let entry = stack[top % STACK];
            if f32::from_bits((entry >> 32) as u32) <= best {
                current = entry as u32;
                break;
            }
        }
    }
}

pub(super) fn any(tree: &Tree, ray: &Ray, stack: &mut Stack) -> bool {
    if !ray.is_valid() || tree.node.is_empty() {
        return false;
    }
    let setup = Setup::new(ray);
    let t_max = f32x8::splat(ray.t_max);
    let (mut top, mut current) = (0, 0_u32);
    loop {
        if current & LEAF == 0 {
            let node = &tree.node[current as usize];
            let (_, mut mask) = setup.boxes(node, ray.t_max);
            if mask != 0 {
                current = node.child[next(&mut mask)];
                while mask != 0 {
                    stack[top % STACK] = u64::from(node.child[next(&mut mask)]);
                    top += 1;
                }
                continue;
            }
        } else {
            let (t, hit) = setup.triangles(&tree.block[(current & !LEAF) as usize]);
            if (hit & t.simd_lt(t_max)).any() {
                return true;
            }
        }
        if top == 0 {
            return false;
        }
        top -= 1;
        current = stack[top % STACK] as u32;
    }
}
