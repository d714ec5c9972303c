//! Pearson's χ² test: does a sampling routine produce the density that it claims?
//!
//! The domain is cut into cells, samples are counted, and the counts compared with n ∫ pdf over
//! each cell. A routine may lose samples (return `None`): then its pdf integrates to less than 1,
//! and the lost ones are a cell of their own.

use std::f64::consts::PI;

use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Cells with a smaller expectation are pooled with others: below it χ² is no χ².
const LEAST_EXPECTED: f64 = 5.0;
/// Samples a task draws; fixed, though integer counts add up to the same in any order.
const CHUNK: u64 = 1 << 14;

/// The outcome of one test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chi2 {
    /// Σ (observed − expected)²/expected; infinite where a sample fell on what the density says is
    /// impossible, or where the density integrates to more than 1.
    pub statistic: f64,
    /// Degrees of freedom: cells after pooling, less one.
    pub dof: usize,
    /// Probability of a statistic this large or larger if the routine is right; 1 where fewer than
    /// two cells are left to compare.
    pub p_value: f64,
}

impl Chi2 {
    /// Counts against expectations, cell by cell. Both should sum to the number of samples.
    #[must_use]
    pub fn new(observed: &[u64], expected: &[f64]) -> Self {
        let mut cells: Vec<(f64, u64)> =
            expected.iter().copied().zip(observed.iter().copied()).collect();
        if cells.iter().any(|&(e, o)| e.is_nan() || e < 0.0 || (e == 0.0 && o > 0)) {
            return Self::refused();
        }
        cells.sort_by(|a, b| a.0.total_cmp(&b.0));
        let pools = pool(&cells);
        let statistic = pools.iter().map(|&(e, o)| (o as f64 - e).powi(2) / e).sum();
        let dof = pools.len().saturating_sub(1);
        let p_value = ChiSquared::new(dof as f64).map_or(1.0, |chi| chi.sf(statistic));
        Self { statistic, dof, p_value }
    }

    fn refused() -> Self {
        Self { statistic: f64::INFINITY, dof: 0, p_value: 0.0 }
    }

    /// Whether the routine passes as one of `family` that are tested together, at 1 % false alarms
    /// for the whole family.
    #[must_use]
    pub fn passes(&self, family: usize) -> bool {
        self.p_value >= sidak(0.01, family)
    }
}

/// Level of each of `family` independent tests that gives the whole family the level `level`
/// (Šidák): 1 − (1 − level)^(1/family).
#[must_use]
pub fn sidak(level: f64, family: usize) -> f64 {
    -((-level).ln_1p() / family.max(1) as f64).exp_m1()
}

/// Neighbours in expectation are added up until every pool expects enough; what is left over joins
/// the last pool.
fn pool(sorted: &[(f64, u64)]) -> Vec<(f64, u64)> {
    let mut pools: Vec<(f64, u64)> = Vec::new();
    let mut open = (0.0, 0);
    for &(e, o) in sorted.iter().filter(|&&(e, _)| e > 0.0) {
        open = (open.0 + e, open.1 + o);
        if open.0 >= LEAST_EXPECTED {
            pools.push(std::mem::take(&mut open));
        }
    }
    match pools.last_mut() {
        Some(last) => *last = (last.0 + open.0, last.1 + open.1),
        None => pools.push(open),
    }
    pools
}

/// A grid over a rectangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Lower and upper end of each coordinate.
    pub bounds: [[f64; 2]; 2],
    /// Cells along each coordinate.
    pub cells: [usize; 2],
}

impl Grid {
    /// θ ∈ [0, π] and φ ∈ [−π, π], in 80 × 160 cells.
    pub(crate) const SPHERE: Self = Self { bounds: [[0.0, PI], [-PI, PI]], cells: [80, 160] };

    fn len(&self) -> usize {
        self.cells[0] * self.cells[1]
    }

    /// The cell and those around it. The second coordinate closes on itself, as an azimuth does;
    /// for others that does no harm.
    fn neighbours(&self, index: usize) -> impl Iterator<Item = usize> {
        let [rows, columns] = self.cells;
        let (row, column) = (index / columns, index % columns);
        (row.saturating_sub(1)..(row + 2).min(rows)).flat_map(move |r| {
            (0..3).map(move |d| r * columns + (column + columns + d - 1) % columns)
        })
    }

    fn index(&self, p: [f64; 2]) -> usize {
        let along = |d: usize| {
            let [lo, hi] = self.bounds[d];
            ((p[d] - lo) / (hi - lo) * self.cells[d] as f64).clamp(0.0, self.cells[d] as f64 - 1.0)
                as usize
        };
        along(0) * self.cells[1] + along(1)
    }

    fn cell(&self, index: usize) -> [[f64; 2]; 2] {
        let k = [index / self.cells[1], index % self.cells[1]];
        std::array::from_fn(|d| {
            let [lo, hi] = self.bounds[d];
            let at = |k: usize| lo + (hi - lo) * k as f64 / self.cells[d] as f64;
            [at(k[d]), at(k[d] + 1)]
        })
    }
}

/// Tests `n` samples of a routine on a rectangle: `sample(i)` is the i-th, `pdf` its density per
/// unit of area.
pub fn rectangle(
    grid: Grid,
    n: u64,
    sample: impl Fn(u64) -> Option<[f64; 2]> + Sync,
    pdf: impl Fn([f64; 2]) -> f64 + Sync,
) -> Chi2 {
    let cells = grid.len();
    let mut observed = (0..n.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let mut count = vec![0_u64; cells + 1];
            for i in chunk * CHUNK..((chunk + 1) * CHUNK).min(n) {
                count[sample(i).map_or(cells, |p| grid.index(p))] += 1;
            }
            count
        })
        .reduce(
            || vec![0; cells + 1],
            |mut a, b| {
                a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
                a
            },
        );
    let mut expected = expectations(&grid, n as f64, &pdf);
    // A cell that expects nothing may still hold a sliver of the density that the quadrature
    // stepped over: ask the samples themselves.
    let impossible = |i: usize| expected[i] == 0.0 && observed[i] > 0;
    if (0..cells).any(impossible) {
        let misses = |i| sample(i).is_some_and(|p| impossible(grid.index(p)) && pdf(p) <= 0.0);
        if (0..n).into_par_iter().any(misses) {
            return Chi2::refused();
        }
        expected.iter_mut().for_each(|e| *e = e.max(f64::MIN_POSITIVE));
    }
    // Lost samples. Where the density leaves nothing to lose, quadrature noise must not turn into
    // an impossible cell.
    let lost = n as f64 - expected.iter().sum::<f64>();
    if lost < -1e-3 * n as f64 {
        return Chi2::refused();
    }
    if lost >= LEAST_EXPECTED || observed[cells] > 0 {
        expected.push(lost.max(0.1));
    } else {
        observed.pop();
    }
    Chi2::new(&observed, &expected)
}

/// Tests `n` samples of a routine on the unit sphere: `sample(i)` is the i-th direction, `pdf` its
/// density per sr.
pub fn sphere(
    n: u64,
    sample: impl Fn(u64) -> Option<[f32; 3]> + Sync,
    pdf: impl Fn([f32; 3]) -> f32 + Sync,
) -> Chi2 {
    rectangle(
        Grid::SPHERE,
        n,
        |i| {
            sample(i).map(|w| {
                let [x, y, z] = w.map(f64::from);
                [x.hypot(y).atan2(z), y.atan2(x)]
            })
        },
        |[theta, phi]| {
            let ((sin, cos), (sin_phi, cos_phi)) = (theta.sin_cos(), phi.sin_cos());
            sin * f64::from(pdf([sin * cos_phi, sin * sin_phi, cos].map(|x| x as f32)))
        },
    )
}

/// n ∫ pdf over every cell, to a hundredth of the standard deviation of the count there. Cells
/// along the edge of the density's support are cut four times at once: the nodes of an uncut cell
/// may all lie on one side of the edge.
fn expectations(grid: &Grid, n: f64, pdf: &(impl Fn([f64; 2]) -> f64 + Sync)) -> Vec<f64> {
    let coarse: Vec<f64> =
        (0..grid.len()).into_par_iter().map(|i| gauss(pdf, grid.cell(i))).collect();
    let at_edge = |i: usize| {
        let mut around = grid.neighbours(i).map(|k| coarse[k] > 0.0);
        let first = around.next();
        around.any(|positive| Some(positive) != first)
    };
    let fine = |i: usize| {
        let tolerance = 0.01 * (n * coarse[i]).max(1.0).sqrt() / n;
        n * refine(pdf, grid.cell(i), coarse[i], tolerance, if at_edge(i) { 4 } else { 0 }, 9)
    };
    (0..grid.len()).into_par_iter().map(fine).collect()
}

/// ∫ f over a box by Gauss-Legendre 3 × 3, cut in four at least `least` times, then until a box and
/// its quarters agree within `tolerance`, at most `most` times: kinks and jumps of the density cost
/// evaluations, not accuracy.
fn refine(
    f: &impl Fn([f64; 2]) -> f64,
    area: [[f64; 2]; 2],
    whole: f64,
    tolerance: f64,
    least: u32,
    most: u32,
) -> f64 {
    let [[x0, x1], [y0, y1]] = area;
    let (xm, ym) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
    let quarters =
        [[[x0, xm], [y0, ym]], [[x0, xm], [ym, y1]], [[xm, x1], [y0, ym]], [[xm, x1], [ym, y1]]];
    let parts = quarters.map(|q| gauss(f, q));
    let sum: f64 = parts.iter().sum();
    if most == 0 || (least == 0 && (sum - whole).abs() <= tolerance) {
        return sum;
    }
    let finer = |(&q, part)| refine(f, q, part, 0.5 * tolerance, least.saturating_sub(1), most - 1);
    quarters.iter().zip(parts).map(finer).sum()
}

fn gauss(f: &impl Fn([f64; 2]) -> f64, [[x0, x1], [y0, y1]]: [[f64; 2]; 2]) -> f64 {
    const NODES: [(f64, f64); 3] = [
        (-0.774_596_669_241_483_4, 5.0 / 9.0),
        (0.0, 8.0 / 9.0),
        (0.774_596_669_241_483_4, 5.0 / 9.0),
    ];
    let (hx, hy) = (0.5 * (x1 - x0), 0.5 * (y1 - y0));
    let (cx, cy) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
    let mut sum = 0.0;
    for (x, wx) in NODES {
        for (y, wy) in NODES {
            sum += wx * wy * f([cx + hx * x, cy + hy * y]);
        }
    }
    sum * hx * hy
}

#[cfg(test)]
mod tests {
    use super::*;
    use intrados_stage::random::Key;

    const UNIT: Grid = Grid { bounds: [[0.0, 1.0]; 2], cells: [51, 51] };

    fn uniform(i: u64) -> [f64; 2] {
        [Key::new(5, i).unit64(0), Key::new(5, i).unit64(1)]
    }

    /// 48 degrees of freedom in a textbook's table: the upper 5 % point is 65.171.
    #[test]
    fn p_values_are_those_of_the_table() {
        let (mut observed, expected) = (vec![100_000_000_u64; 49], vec![1e8; 49]);
        // Two cells off by ±s, all others on their expectation: 2 s²/1e8 = 65.171.
        let s = (65.171_f64 * 1e8 / 2.0).sqrt() as u64;
        observed[0] += s;
        observed[1] -= s;
        let chi = Chi2::new(&observed, &expected);
        assert_eq!(chi.dof, 48);
        assert!((chi.p_value - 0.05).abs() < 2e-5, "{chi:?}");
    }

    #[test]
    fn small_cells_are_pooled_and_none_is_lost() {
        let chi = Chi2::new(&[1, 2, 3, 4, 100], &[1.5, 2.5, 2.0, 4.0, 100.0]);
        assert_eq!(chi.dof, 1, "{chi:?}"); // {1.5 + 2 + 2.5} and {4 + 100}
    }

    #[test]
    fn a_right_routine_passes_and_wrong_ones_do_not() {
        // Density 4xy by inversion.
        let draw = |i| Some(uniform(i).map(f64::sqrt));
        assert!(rectangle(UNIT, 1_000_000, draw, |[x, y]| 4.0 * x * y).passes(1));
        assert!(
            !rectangle(UNIT, 1_000_000, draw, |[x, y]| 1.0
                + 0.02 * (2.0 * x - 1.0) * (2.0 * y - 1.0))
            .passes(1)
        );
        // Two per cent wrong.
        assert!(
            !rectangle(UNIT, 1_000_000, draw, |[x, y]| (0.98 + 0.04 * x) * 4.0 * x * y
                / (0.98 + 0.08 / 3.0))
            .passes(1)
        );
    }

    #[test]
    fn lost_samples_must_be_missing_from_the_density() {
        let draw = |i| Some(uniform(i)).filter(|p| p[0] > 0.25);
        assert!(rectangle(UNIT, 1_000_000, draw, |p| f64::from(p[0] > 0.25)).passes(1));
        assert!(!rectangle(UNIT, 1_000_000, draw, |_| 1.0).passes(1));
        assert!(
            !rectangle(UNIT, 1_000_000, |i| Some(uniform(i)), |p| f64::from(p[0] > 0.25)).passes(1),
            "samples where the density is 0"
        );
        assert!(
            !rectangle(UNIT, 1_000_000, |i| Some(uniform(i)), |_| 1.01).passes(1),
            "more than 1 in all"
        );
    }

    /// p-values of right routines are uniform: Kolmogorov-Smirnov over 200 of them, whose 1 % point
    /// is 1.63/√200.
    #[test]
    fn p_values_of_right_routines_are_uniform() {
        let grid = Grid { cells: [10, 10], ..UNIT };
        let n = 10_000;
        let mut p: Vec<f64> = (0..200)
            .map(|k| rectangle(grid, n, |i| Some(uniform(k * n + i)), |_| 1.0).p_value)
            .collect();
        p.sort_by(f64::total_cmp);
        let gap = p
            .iter()
            .enumerate()
            .map(|(i, p)| (p - (i as f64 + 0.5) / 200.0).abs())
            .fold(0.0, f64::max);
        assert!(gap < 1.63 / 200.0_f64.sqrt(), "{gap}");
    }

    #[test]
    fn sidak_keeps_the_level_of_the_family() {
        assert!((1.0 - (1.0 - sidak(0.01, 40)).powi(40) - 0.01).abs() < 1e-12);
        assert!((sidak(0.01, 1) - 0.01).abs() < 1e-15);
    }
}
