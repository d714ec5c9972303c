//! Straight ways through regular grids (Amanatides and Woo 1987).

use glam::{DVec3, UVec3};

/// A regular grid of cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    /// Lowest corner, m.
    pub origin: DVec3,
    /// Size of a cell, m.
    pub spacing: DVec3,
    /// Cells along x, y, z.
    pub cells: UVec3,
}

impl Lattice {
    /// Number of cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cells.as_u64vec3().element_product() as usize
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Lowest and highest corner, m.
    #[must_use]
    pub fn bounds(&self) -> [DVec3; 2] {
        [self.origin, self.origin + self.spacing * self.cells.as_dvec3()]
    }

    /// Index of the cell at `p`, x fastest; None outside.
    #[inline]
    #[must_use]
    pub(crate) fn cell(&self, p: DVec3) -> Option<usize> {
        let at = (p - self.origin) / self.spacing;
        let inside = at.cmpge(DVec3::ZERO).all() && at.cmplt(self.cells.as_dvec3()).all();
        inside.then(|| self.index(at.as_uvec3()))
    }

    /// Index of a cell.
    #[inline]
    #[must_use]
    pub fn index(&self, c: UVec3) -> usize {
        (c.z as usize * self.cells.y as usize + c.y as usize) * self.cells.x as usize + c.x as usize
    }

    /// Centre of cell `index`, m.
    #[must_use]
    pub fn centre(&self, index: usize) -> DVec3 {
        self.corner(index) + 0.5 * self.spacing
    }

    /// Lowest corner of cell `index`, m.
    #[must_use]
    pub(crate) fn corner(&self, index: usize) -> DVec3 {
        let (x, y) = (self.cells.x as usize, self.cells.y as usize);
        let c = UVec3::new((index % x) as u32, (index / x % y) as u32, (index / (x * y)) as u32);
        self.origin + self.spacing * c.as_dvec3()
    }

    /// Calls `visit(cell, from, to)` for every cell that the way from `origin` along the unit
    /// vector `way` passes between distances `from` and `to`, in order, until it says false.
    #[inline]
    pub(crate) fn march(
        &self,
        origin: DVec3,
        way: DVec3,
        from: f64,
        to: f64,
        mut visit: impl FnMut(usize, f64, f64) -> bool,
    ) {
        let Some([enter, leave]) = slab(self.bounds(), origin, way) else { return };
        let (mut s, end) = (enter.max(from), leave.min(to));
        if s >= end {
            return;
        }
        // Where it enters, rounded to a cell that exists.
        let at = (origin + s * way - self.origin) / self.spacing;
        let mut cell =
            at.floor().as_ivec3().clamp(glam::IVec3::ZERO, self.cells.as_ivec3() - 1).to_array();
        let (spacing, way3, low, start) =
            (self.spacing.to_array(), way.to_array(), self.origin.to_array(), origin.to_array());
        let count = self.cells.as_ivec3().to_array();
        let stride =
            [1_isize, self.cells.x as isize, self.cells.x as isize * self.cells.y as isize];
        let mut index = self.index(UVec3::from_array(cell.map(|c| c as u32))) as isize;
        let (mut next, mut delta, mut step) = ([f64::INFINITY; 3], [f64::INFINITY; 3], [0_i32; 3]);
        for k in 0..3 {
            if way3[k] != 0.0 {
                step[k] = if way3[k] > 0.0 { 1 } else { -1 };
                delta[k] = spacing[k] / way3[k].abs();
                let face = low[k] + spacing[k] * f64::from(cell[k] + i32::from(step[k] > 0));
                next[k] = (face - start[k]) / way3[k];
            }
        }
        loop {
            let k = if next[0] <= next[1] && next[0] <= next[2] {
                0
            } else if next[1] <= next[2] {
                1
            } else {
                2
            };
            let out = next[k].min(end);
            if out > s && !visit(index as usize, s, out) {
                return;
            }
            if next[k] >= end {
                return;
            }
            s = s.max(out);
            cell[k] += step[k];
            if cell[k] < 0 || cell[k] >= count[k] {
                return;
            }
            index += stride[k] * step[k] as isize;
            next[k] += delta[k];
        }
    }
}

/// Where a way is inside a box.
#[inline]
#[must_use]
pub fn slab([low, high]: [DVec3; 2], origin: DVec3, way: DVec3) -> Option<[f64; 2]> {
    let inverse = way.recip();
    let (a, b) = ((low - origin) * inverse, (high - origin) * inverse);
    // A way along a face: 0 · ∞ is no number, and min and max pass it over.
    let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
    for k in 0..3 {
        if way[k] == 0.0 {
            if origin[k] < low[k] || origin[k] > high[k] {
                return None;
            }
            continue;
        }
        enter = enter.max(a[k].min(b[k]));
        leave = leave.min(a[k].max(b[k]));
    }
    (enter < leave).then_some([enter, leave])
}

#[cfg(test)]
mod tests {
    use super::*;
    use intrados_stage::random::Key;

    /// Pieces follow each other without a gap, add up to the chord, and their middles lie in their
    /// cells. 2000 random ways, some along axes.
    #[test]
    fn pieces_make_the_chord() {
        let lattice = Lattice {
            origin: DVec3::new(-1.0, 0.5, 2.0),
            spacing: DVec3::new(0.1, 0.2, 0.05),
            cells: UVec3::new(17, 9, 33),
        };
        let [low, high] = lattice.bounds();
        let mut hits = 0;
        for i in 0..2000 {
            let u = |d| Key::new(3, i).unit64(d);
            let origin = low + (high - low) * (3.0 * DVec3::new(u(0), u(1), u(2)) - 1.0);
            let mut way = DVec3::new(u(3) - 0.5, u(4) - 0.5, u(5) - 0.5);
            if i % 10 == 0 {
                way = DVec3::new(0.0, way.y, 0.0);
            }
            let way = way.normalize();
            let mut sum = 0.0;
            let mut last = f64::NAN;
            lattice.march(origin, way, 0.0, f64::INFINITY, |cell, a, b| {
                assert!(last.is_nan() || (a - last).abs() < 1e-12, "gap");
                let middle = origin + 0.5 * (a + b) * way;
                assert!(b - a < 1e-9 || lattice.cell(middle) == Some(cell));
                sum += b - a;
                last = b;
                true
            });
            let chord = slab(lattice.bounds(), origin, way).map_or(0.0, |[a, b]| b - a);
            assert!((sum - chord).abs() < 1e-9, "{sum} {chord}");
            hits += u32::from(chord > 0.0);
        }
        assert!(hits > 150, "{hits}");
    }

    #[test]
    fn pieces_can_be_cut_short() {
        let lattice = Lattice { origin: DVec3::ZERO, spacing: DVec3::ONE, cells: UVec3::splat(4) };
        let mut seen = Vec::new();
        lattice.march(DVec3::new(-1.0, 0.5, 0.5), DVec3::X, 1.5, 3.25, |cell, a, b| {
            seen.push((cell, a, b));
            true
        });
        assert_eq!(seen, [(0, 1.5, 2.0), (1, 2.0, 3.0), (2, 3.0, 3.25)]);
    }
}
