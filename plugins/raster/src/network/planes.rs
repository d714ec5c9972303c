//! Planes of pixels, and the convolution of 3 × 3 taps that a network is made of.
//!
//! Every plane has a border of zeros, so that no tap asks where it is. A tile of sixteen pixels of
//! four output planes is kept in registers while all input planes are added to it; on AVX2 that is
//! eight fused multiply-adds to six loads.

use rayon::prelude::*;
use wide::f32x8;

/// Pixels in a tile.
const TILE: usize = 16;
/// Output planes in a tile: what planes come in multiples of.
pub const BLOCK: usize = 4;
/// Taps of a kernel.
pub(super) const TAPS: usize = 9;

/// A stack of planes of one size.
#[derive(Debug, Clone, PartialEq)]
pub struct Planes {
    width: usize,
    height: usize,
    /// Floats from one row to the next.
    stride: usize,
    data: Vec<f32>,
}

/// Memory of stacks that are no longer needed. Asked from the system anew for every convolution of
/// a large tile, it would cost a fifth of all time.
#[derive(Debug, Default)]
pub struct Spare(Vec<Vec<f32>>);

impl Spare {
    /// Takes the memory of a stack.
    pub fn give(&mut self, planes: Planes) {
        self.0.push(planes.data);
    }

    /// So many zeros, in the smallest piece of memory that holds them.
    fn zeros(&mut self, count: usize) -> Vec<f32> {
        let fitting = self.0.iter().enumerate().filter(|(_, piece)| piece.capacity() >= count);
        let Some((best, _)) = fitting.min_by_key(|(_, piece)| piece.capacity()) else {
            return vec![0.0; count];
        };
        let mut piece = self.0.swap_remove(best);
        piece.clear();
        piece.resize(count, 0.0);
        piece
    }
}

impl Planes {
    /// All zero.
    #[must_use]
    pub fn new(planes: usize, width: usize, height: usize) -> Self {
        Self::of_spare(planes, width, height, &mut Spare::default())
    }

    /// All zero, in spare memory.
    #[must_use]
    pub fn of_spare(planes: usize, width: usize, height: usize, spare: &mut Spare) -> Self {
        let stride = width.next_multiple_of(TILE) + 2;
        Self { width, height, stride, data: spare.zeros(planes * stride * (height + 2)) }
    }

    /// Pixels across.
    #[must_use]
    pub const fn width(&self) -> usize {
        self.width
    }

    /// Pixels down.
    #[must_use]
    pub const fn height(&self) -> usize {
        self.height
    }

    /// Floats of one plane.
    fn area(&self) -> usize {
        self.stride * (self.height + 2)
    }

    /// Number of planes.
    #[must_use]
    pub fn planes(&self) -> usize {
        self.data.len() / self.area()
    }

    /// Row `y` of plane `plane`.
    #[must_use]
    pub fn row(&self, plane: usize, y: usize) -> &[f32] {
        let at = plane * self.area() + (y + 1) * self.stride + 1;
        &self.data[at..at + self.width]
    }

    /// The same, to write to.
    pub fn row_mut(&mut self, plane: usize, y: usize) -> &mut [f32] {
        let at = plane * self.area() + (y + 1) * self.stride + 1;
        &mut self.data[at..at + self.width]
    }

    /// The first `planes` and the rest.
    pub(super) fn parted(mut self, planes: usize) -> (Self, Self) {
        let rest = self.data.split_off(planes * self.area());
        let rest = Self { data: rest, ..self };
        (self, rest)
    }

    /// Adds value by value.
    pub(super) fn add(&mut self, other: &Self) {
        self.data.iter_mut().zip(&other.data).for_each(|(a, b)| *a += b);
    }

    /// Zero wherever `output`, which a rectifier gave, is zero.
    pub(super) fn where_positive(mut self, output: &Self) -> Self {
        self.data
            .iter_mut()
            .zip(&output.data)
            .for_each(|(g, &v)| *g = if v > 0.0 { *g } else { 0.0 });
        self
    }

    /// The largest of each two by two.
    pub(super) fn pooled(&self, spare: &mut Spare) -> Self {
        self.of_fours(spare, |[a, b, c, d]| a.max(b).max(c).max(d))
    }

    /// One value of each two by two, which come row by row.
    fn of_fours(&self, spare: &mut Spare, value: impl Fn([f32; 4]) -> f32) -> Self {
        let mut half = Self::of_spare(self.planes(), self.width / 2, self.height / 2, spare);
        for plane in 0..self.planes() {
            for y in 0..half.height {
                let (a, b) = (self.row(plane, 2 * y), self.row(plane, 2 * y + 1));
                for (x, v) in half.row_mut(plane, y).iter_mut().enumerate() {
                    *v = value([a[2 * x], a[2 * x + 1], b[2 * x], b[2 * x + 1]]);
                }
            }
        }
        half
    }

    /// The gradient of [`Planes::pooled`] of this stack: all of it to the first largest.
    pub(super) fn unpooled(&self, gradient: &Self) -> Self {
        let mut full = Self::new(self.planes(), self.width, self.height);
        for plane in 0..self.planes() {
            for y in 0..gradient.height {
                for x in 0..gradient.width {
                    let places =
                        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| (2 * x + dx, 2 * y + dy));
                    let value = |(x, y): (usize, usize)| self.row(plane, y)[x];
                    let best = places
                        .into_iter()
                        .fold(places[0], |best, p| if value(p) > value(best) { p } else { best });
                    full.row_mut(plane, best.1)[best.0] = gradient.row(plane, y)[x];
                }
            }
        }
        full
    }

    /// Every pixel twice across and down, and after these planes those of `finer`, a stack of that
    /// size.
    pub(super) fn doubled_with(&self, finer: &Self, spare: &mut Spare) -> Self {
        let mut full =
            Self::of_spare(self.planes() + finer.planes(), 2 * self.width, 2 * self.height, spare);
        for plane in 0..self.planes() {
            for y in 0..full.height {
                let from = self.row(plane, y / 2);
                full.row_mut(plane, y).iter_mut().enumerate().for_each(|(x, v)| *v = from[x / 2]);
            }
        }
        let own = self.planes() * full.area();
        full.data[own..].copy_from_slice(&finer.data);
        full
    }

    /// The gradient of doubled pixels.
    pub(super) fn halved(&self) -> Self {
        self.of_fours(&mut Spare::default(), |[a, b, c, d]| a + b + c + d)
    }

    /// Convolution with `weights` `[output][input][tap]` (taps row by row) plus `bias`, negative
    /// values made zero if `rectify`.
    pub(super) fn convolved(
        &self,
        weights: &[f32],
        bias: &[f32],
        rectify: bool,
        spare: &mut Spare,
    ) -> Self {
        let inputs = self.planes();
        let mut out = Self::of_spare(bias.len(), self.width, self.height, spare);
        let (area, stride) = (out.area(), out.stride);
        out.data.par_chunks_mut(BLOCK * area).enumerate().for_each(|(block, planes)| {
            // The four weights of a tap side by side.
            let weight = |o: usize, i: usize, tap: usize| {
                weights[((block * BLOCK + o) * inputs + i) * TAPS + tap]
            };
            let packed: Vec<[[f32; BLOCK]; TAPS]> = (0..inputs)
                .map(|i| std::array::from_fn(|tap| std::array::from_fn(|o| weight(o, i, tap))))
                .collect();
            let bias: [f32; BLOCK] = std::array::from_fn(|o| bias[block * BLOCK + o]);
            for y in 0..self.height {
                for x in (0..self.width).step_by(TILE) {
                    let tile = self.tile(&packed, bias, y * stride + x);
                    let n = TILE.min(self.width - x);
                    for (plane, sums) in planes.chunks_mut(area).zip(tile) {
                        let low = if rectify { 0.0 } else { f32::NEG_INFINITY };
                        let at = (y + 1) * stride + 1 + x;
                        let values = sums.map(|s| s.max(f32x8::splat(low)).to_array());
                        plane[at..at + n].copy_from_slice(&values.as_flattened()[..n]);
                    }
                }
            }
        });
        out
    }

    /// Sums of one tile whose top left tap is at `at`.
    #[inline]
    fn tile(
        &self,
        packed: &[[[f32; BLOCK]; TAPS]],
        bias: [f32; BLOCK],
        at: usize,
    ) -> [[f32x8; 2]; BLOCK] {
        let mut sums = bias.map(|b| [f32x8::splat(b); 2]);
        for (plane, taps) in self.data.chunks(self.area()).zip(packed) {
            for (row, taps) in taps.chunks(3).enumerate() {
                let line = &plane[at + row * self.stride..][..TILE + 2];
                for (column, four) in taps.iter().enumerate() {
                    let [a, b] = [eight(line, column), eight(line, column + 8)];
                    for (sum, &w) in sums.iter_mut().zip(four) {
                        let w = f32x8::splat(w);
                        *sum = [a.mul_add(w, sum[0]), b.mul_add(w, sum[1])];
                    }
                }
            }
        }
        sums
    }

    /// The gradient of a convolution of this stack: adds to those of weights and bias what
    /// `gradient` of its output gives.
    pub(super) fn teach(&self, gradient: &Self, weights: &mut [f32], bias: &mut [f32]) {
        let inputs = self.planes();
        for (b, v) in bias.iter_mut().enumerate() {
            *v += (0..self.height).map(|y| gradient.row(b, y).iter().sum::<f32>()).sum::<f32>();
        }
        for block in 0..bias.len() / BLOCK {
            for input in 0..inputs {
                for row in 0..3 {
                    let sums = self.products(gradient, block, input, row);
                    for (o, three) in sums.into_iter().enumerate() {
                        let at = ((block * BLOCK + o) * inputs + input) * TAPS + 3 * row;
                        weights[at..at + 3]
                            .iter_mut()
                            .zip(three)
                            .for_each(|(w, s)| *w += s.reduce_add());
                    }
                }
            }
        }
    }

    /// Σ gradient · input for four outputs and the three taps of a row.
    #[inline]
    fn products(
        &self,
        gradient: &Self,
        block: usize,
        input: usize,
        row: usize,
    ) -> [[f32x8; 3]; BLOCK] {
        let (area, stride) = (self.area(), self.stride);
        let plane = &self.data[input * area..(input + 1) * area];
        let outs: [&[f32]; BLOCK] =
            std::array::from_fn(|o| &gradient.data[(block * BLOCK + o) * area..][..area]);
        let mut sums = [[f32x8::ZERO; 3]; BLOCK];
        for y in 0..self.height {
            let line = &plane[(y + row) * stride..][..stride];
            let rows = outs.map(|out| &out[(y + 1) * stride + 1..][..stride - 2]);
            for x in (0..self.width).step_by(8) {
                let three = [0, 1, 2].map(|column| eight(line, x + column));
                for (sum, out) in sums.iter_mut().zip(rows) {
                    let g = eight(out, x);
                    *sum = std::array::from_fn(|k| g.mul_add(three[k], sum[k]));
                }
            }
        }
        sums
    }
}

/// Eight floats from `at`.
#[inline]
fn eight(line: &[f32], at: usize) -> f32x8 {
    let mut values = [0.0; 8];
    values.copy_from_slice(&line[at..at + 8]);
    f32x8::new(values)
}

/// The weights of the adjoint convolution: inputs and outputs change places and taps are turned by
/// half a circle.
pub(super) fn adjoint(weights: &[f32], inputs: usize, outputs: usize) -> Vec<f32> {
    let weight = |i: usize| {
        let (input, output, tap) = (i / (outputs * TAPS), i / TAPS % outputs, i % TAPS);
        weights[(output * inputs + input) * TAPS + TAPS - 1 - tap]
    };
    (0..weights.len()).map(weight).collect()
}
