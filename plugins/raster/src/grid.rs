//! Pixels in rows, and the few operations on them that detection is made of.

use std::collections::BTreeMap;

use intrados_stage::Job;
use rayon::prelude::*;

/// A picture's worth of values, row-major from the top left.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Grid<T> {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// `width · height` values.
    pub data: Vec<T>,
}

/// Which pixels.
pub type Mask = Grid<bool>;

impl<T: Copy> Grid<T> {
    /// The same value everywhere.
    #[must_use]
    pub fn new(width: usize, height: usize, value: T) -> Self {
        Self { width, height, data: vec![value; width * height] }
    }

    /// A value from each value.
    #[must_use]
    pub fn map<U>(&self, f: impl Fn(T) -> U) -> Grid<U> {
        Grid {
            width: self.width,
            height: self.height,
            data: self.data.iter().map(|&v| f(v)).collect(),
        }
    }

    /// Whether another grid has as many pixels in each direction.
    #[must_use]
    pub fn fits<U>(&self, other: &Grid<U>) -> bool {
        self.width == other.width && self.height == other.height
    }

    /// Column and row of pixel `index`.
    #[must_use]
    pub fn place(&self, index: usize) -> (usize, usize) {
        (index % self.width, index / self.width)
    }

    /// The four edge neighbours of pixel `index`, `None` beyond the border: left, right, up, down.
    #[must_use]
    pub fn neighbours(&self, index: usize) -> [Option<usize>; 4] {
        let (x, y) = self.place(index);
        [
            (x > 0).then(|| index - 1),
            (x + 1 < self.width).then_some(index + 1),
            (y > 0).then(|| index - self.width),
            (y + 1 < self.height).then_some(index + self.width),
        ]
    }
}

impl Grid<f32> {
    /// Convolution with a Gaussian of `sigma` pixels, cut off at 3 σ; what lies beyond the border
    /// is as at the border. Of a job that was cancelled it is unfinished: the next step ends it.
    #[must_use]
    pub fn blurred(&self, sigma: f64, job: &Job) -> Self {
        if sigma < 0.05 {
            return self.clone();
        }
        let reach = (3.0 * sigma).ceil() as usize;
        let weight = |i: usize| (-0.5 * (i.abs_diff(reach) as f64 / sigma).powi(2)).exp() as f32;
        let kernel: Vec<f32> = (0..=2 * reach).map(weight).collect();
        let total: f32 = kernel.iter().sum();
        let kernel: Vec<f32> = kernel.into_iter().map(|weight| weight / total).collect();
        self.convolved(&kernel, job)
    }

    /// Convolution with the same kernel along rows and columns, an odd number of weights; what lies
    /// beyond the border is as at the border.
    #[must_use]
    pub fn convolved(&self, kernel: &[f32], job: &Job) -> Self {
        self.along_rows(kernel, job).along_columns(kernel, job)
    }

    /// The same along rows alone.
    pub(crate) fn along_rows(&self, kernel: &[f32], job: &Job) -> Self {
        let reach = kernel.len() / 2;
        let [w, h] = [self.width, self.height];
        let mut across = Self::new(w, h, 0.0);
        let lines = self.data.par_chunks(w.max(1)).zip(across.data.par_chunks_mut(w.max(1)));
        let lines = lines.filter(|_| !job.is_cancelled());
        lines.for_each_init(Vec::new, |line: &mut Vec<f32>, (row, out)| {
            line.clear();
            line.extend((0..w + 2 * reach).map(|x| row[x.saturating_sub(reach).min(w - 1)]));
            weigh(kernel, out, |k, at| &line[at + k..]);
        });
        across
    }

    /// The same along columns alone.
    pub(crate) fn along_columns(&self, kernel: &[f32], job: &Job) -> Self {
        let reach = kernel.len() / 2;
        let [w, h] = [self.width, self.height];
        let mut down = Self::new(w, h, 0.0);
        let lines = down.data.par_chunks_mut(w.max(1)).enumerate();
        lines.filter(|_| !job.is_cancelled()).for_each(|(y, out)| {
            weigh(kernel, out, |k, at| {
                let from = (y + k).saturating_sub(reach).min(h - 1);
                &self.data[from * w + at..]
            });
        });
        down
    }
}

/// Adds to each pixel of a row what `line(k, at)` gives for it times weight k; `line` begins with
/// pixel `at`.
fn weigh<'a>(kernel: &[f32], row: &mut [f32], line: impl Fn(usize, usize) -> &'a [f32]) {
    // As many sums as registers hold, so that they are loaded and stored once and not once a
    // weight.
    const TOGETHER: usize = 32;
    let (many, rest) = row.as_chunks_mut::<TOGETHER>();
    let done = many.len() * TOGETHER;
    for (n, out) in many.iter_mut().enumerate() {
        for (k, weight) in kernel.iter().enumerate() {
            let Some(values) = line(k, n * TOGETHER).first_chunk::<TOGETHER>() else { continue };
            out.iter_mut().zip(values).for_each(|(v, a)| *v += weight * a);
        }
    }
    for (k, weight) in kernel.iter().enumerate() {
        rest.iter_mut().zip(line(k, done)).for_each(|(v, a)| *v += weight * a);
    }
}

impl Mask {
    /// Number of pixels set.
    #[must_use]
    pub fn count(&self) -> usize {
        self.data.iter().filter(|&&v| v).count()
    }

    /// The pixels that are set, in reading order.
    #[must_use]
    pub fn pixels(&self) -> Vec<usize> {
        (0..self.data.len()).filter(|&i| self.data[i]).collect()
    }

    /// Sets every pixel that `other` (of the same size) has set.
    pub fn unite(&mut self, other: &Self) {
        for (a, &b) in self.data.iter_mut().zip(&other.data) {
            *a |= b;
        }
    }

    /// Opening by the cross of five pixels; beyond the border nothing is set.
    #[must_use]
    pub fn opened(&self) -> Self {
        let eroded: Vec<bool> = (0..self.data.len())
            .map(|i| {
                self.data[i] && self.neighbours(i).iter().all(|n| n.is_some_and(|n| self.data[n]))
            })
            .collect();
        let data = (0..self.data.len())
            .map(|i| eroded[i] || self.neighbours(i).iter().any(|n| n.is_some_and(|n| eroded[n])))
            .collect();
        Self { data, ..*self }
    }

    /// 4-connected components, numbered from 1 in the order of their first pixels; 0 is background.
    #[must_use]
    pub fn components(&self) -> Components {
        let mut labels = Grid::new(self.width, self.height, 0_u32);
        let mut members = Vec::new();
        let mut stack = Vec::new();
        for seed in 0..self.data.len() {
            if !self.data[seed] || labels.data[seed] != 0 {
                continue;
            }
            let mut pixels = Vec::new();
            let label = members.len() as u32 + 1;
            labels.data[seed] = label;
            stack.push(seed);
            while let Some(i) = stack.pop() {
                pixels.push(i);
                for n in self.neighbours(i).into_iter().flatten() {
                    if self.data[n] && labels.data[n] == 0 {
                        labels.data[n] = label;
                        stack.push(n);
                    }
                }
            }
            members.push(pixels);
        }
        Components { labels, members }
    }

    /// Sets the enclosed gaps of at most `largest` pixels; a gap that touches the border is not
    /// enclosed.
    pub fn fill_gaps(&mut self, largest: usize) {
        let gaps = self.map(|v| !v).components();
        for pixels in gaps.members {
            let enclosed =
                || pixels.iter().all(|&i| self.neighbours(i).iter().all(Option::is_some));
            if pixels.len() <= largest && enclosed() {
                pixels.into_iter().for_each(|i| self.data[i] = true);
            }
        }
    }

    /// Distance of each set pixel's centre to the nearest centre of one that is not set, in pixels;
    /// beyond the border nothing is set.
    ///
    /// The exact Euclidean distance map by two passes of lower envelopes of parabolas (Felzenszwalb
    /// and Huttenlocher 2012).
    #[must_use]
    pub fn distance(&self) -> Grid<f32> {
        self.distance_to(0.0)
    }

    /// The same, but nothing is known beyond the border.
    #[must_use]
    pub fn distance_within(&self) -> Grid<f32> {
        let far = (self.width + self.height) as f64;
        self.distance_to(far * far)
    }

    /// The distance map where what lies beyond the border has the square `beyond`.
    fn distance_to(&self, beyond: f64) -> Grid<f32> {
        let far = (self.width + self.height) as f64;
        let (w, h) = (self.width, self.height);
        // Columns as lines, some side by side: one alone would take a line of memory for every
        // pixel.
        let mut columns = vec![0.0; w * h];
        columns.par_chunks_mut(BESIDE * h.max(1)).enumerate().for_each_init(
            Scratch::default,
            |scratch, (n, some)| {
                let x0 = n * BESIDE;
                for y in 0..h {
                    let row = &self.data[y * w + x0..];
                    some.chunks_mut(h)
                        .zip(row)
                        .for_each(|(column, &set)| column[y] = if set { far * far } else { 0.0 });
                }
                some.chunks_mut(h).for_each(|column| scratch.lower(column, beyond));
            },
        );
        let mut distance = Grid::new(w, h, 0.0_f32);
        let bands = distance.data.par_chunks_mut(BESIDE * w.max(1)).enumerate();
        bands.for_each_init(
            || (Scratch::default(), Vec::new()),
            |(scratch, rows): &mut (Scratch, Vec<f64>), (n, out)| {
                let y0 = n * BESIDE;
                rows.clear();
                rows.resize(out.len(), 0.0);
                for (x, column) in columns.chunks(h.max(1)).enumerate() {
                    rows.iter_mut()
                        .skip(x)
                        .step_by(w)
                        .zip(&column[y0..])
                        .for_each(|(v, square)| *v = *square);
                }
                rows.chunks_mut(w.max(1)).for_each(|row| scratch.lower(row, beyond));
                out.iter_mut().zip(rows).for_each(|(v, square)| *v = square.sqrt() as f32);
            },
        );
        distance
    }
}

/// Lines of a distance map that are worked on together: a line of memory's worth.
const BESIDE: usize = 8;

/// Memory for the lower envelopes of many lines.
#[derive(Default)]
struct Scratch {
    envelope: Envelope,
    line: Vec<f64>,
}

impl Scratch {
    /// The lower envelope of the parabolas over `values`, in their place; `beyond` is what lies
    /// before and after them.
    fn lower(&mut self, values: &mut [f64], beyond: f64) {
        self.line.clear();
        self.line.push(beyond);
        self.line.extend_from_slice(values);
        self.line.push(beyond);
        let Self { envelope, line } = self;
        envelope.lower(line, |at, v| {
            if let Some(value) = at.checked_sub(1).and_then(|at| values.get_mut(at)) {
                *value = v;
            }
        });
    }
}

/// The first and the last column of every row that holds some of `pixels`, by row from the top.
pub fn row_ends(pixels: &[usize], width: usize) -> BTreeMap<usize, [usize; 2]> {
    let mut rows = BTreeMap::new();
    for &i in pixels {
        let (x, y) = (i % width, i / width);
        let row: &mut [usize; 2] = rows.entry(y).or_insert([x, x]);
        *row = [row[0].min(x), row[1].max(x)];
    }
    rows
}

/// One side of the convex hull of points that come in order: those at which the way turns by
/// `sign`, or goes straight on (Andrew 1979).
pub fn hull_side(points: impl IntoIterator<Item = [f64; 2]>, sign: f64) -> Vec<[f64; 2]> {
    let mut chain: Vec<[f64; 2]> = Vec::new();
    for p in points {
        while let [.., a, b] = chain.as_slice() {
            if sign * ((b[0] - a[0]) * (p[1] - a[1]) - (p[0] - a[0]) * (b[1] - a[1])) >= 0.0 {
                break;
            }
            chain.pop();
        }
        chain.push(p);
    }
    chain
}

/// The lower envelope of parabolas along a line; kept between lines for its memory only.
#[derive(Default)]
struct Envelope {
    roots: Vec<usize>,
    from: Vec<f64>,
}

impl Envelope {
    /// Calls `set(q, min_p (q−p)² + f(p))` for every place q.
    fn lower(&mut self, f: &[f64], mut set: impl FnMut(usize, f64)) {
        self.roots.clear();
        self.from.clear();
        for (q, &fq) in f.iter().enumerate() {
            let mut start = f64::NEG_INFINITY;
            while let Some(&p) = self.roots.last() {
                let (pf, qf) = (p as f64, q as f64);
                start = ((fq + qf * qf) - (f[p] + pf * pf)) / (2.0 * (qf - pf));
                if self.from.last().is_some_and(|&s| start <= s) {
                    self.roots.pop();
                    self.from.pop();
                    start = f64::NEG_INFINITY;
                } else {
                    break;
                }
            }
            self.roots.push(q);
            self.from.push(start);
        }
        let mut k = 0;
        for q in 0..f.len() {
            while k + 1 < self.roots.len() && self.from[k + 1] < q as f64 {
                k += 1;
            }
            let d = q as f64 - self.roots[k] as f64;
            set(q, d * d + f[self.roots[k]]);
        }
    }
}

/// Connected components of a mask.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Components {
    /// Number of the component that each pixel belongs to, from 1; 0 is background.
    pub labels: Grid<u32>,
    /// The pixels of each component (that of label 1 first).
    pub members: Vec<Vec<usize>>,
}

/// The middle value (the upper one of two).
#[must_use]
pub fn median(values: impl Iterator<Item = f32>) -> Option<f32> {
    let mut values: Vec<f32> = values.collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}

impl Mask {
    /// A mask as it looks, rows of one length: set where there is a `#`.
    ///
    /// ```
    /// let mask = intrados_raster::Mask::drawn(&["##.", "..#"]);
    /// assert_eq!(mask.pixels(), [0, 1, 5]);
    /// ```
    #[must_use]
    pub fn drawn(rows: &[&str]) -> Self {
        let data = rows.iter().flat_map(|r| r.bytes().map(|b| b == b'#')).collect();
        Self { width: rows.first().map_or(0, |row| row.len()), height: rows.len(), data }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_join_over_edges_only() {
        let c = Mask::drawn(&["##..", "..#.", "#.##"]).components();
        assert_eq!(c.members.iter().map(Vec::len).collect::<Vec<_>>(), [2, 3, 1]);
        assert_eq!(c.labels.data, [1, 1, 0, 0, 0, 0, 2, 0, 3, 0, 2, 2]);
    }

    #[test]
    fn distance_equals_brute_force() {
        let mask =
            Mask { width: 23, height: 17, data: (0..23 * 17).map(|i| (i * i) % 11 != 3).collect() };
        let distance = mask.distance();
        for i in 0..mask.data.len() {
            let (x, y) = mask.place(i);
            let mut best =
                if mask.data[i] { (x + 1).min(y + 1).min(23 - x).min(17 - y).pow(2) } else { 0 };
            for j in (0..mask.data.len()).filter(|&j| !mask.data[j]) {
                let (u, v) = mask.place(j);
                best = best.min(x.abs_diff(u).pow(2) + y.abs_diff(v).pow(2));
            }
            assert!((distance.data[i] - (best as f32).sqrt()).abs() < 1e-5, "at {x},{y}");
        }
    }

    #[test]
    fn only_small_enclosed_gaps_are_filled() {
        let mut mask = Mask::drawn(&["#####.", "#.#.##", "###..#", "#.####"]);
        mask.fill_gaps(2);
        assert_eq!(mask, Mask::drawn(&["#####.", "###.##", "###..#", "#.####"]));
    }

    #[test]
    fn opening_removes_specks_and_keeps_crosses() {
        let mask = Mask::drawn(&["..#...", ".###.#", "..#...", "......"]);
        assert_eq!(mask.opened(), Mask::drawn(&["..#...", ".###..", "..#...", "......"]));
    }
}
