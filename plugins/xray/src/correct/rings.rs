//! Rings: pixels that read too much or too little make stripes in the sinogram and rings in the
//! slice.
//!
//! Sorting, fitting and the treatment of large and dead stripes follow Vo, Atwood and Drakopoulos
//! (2018), "Superior techniques for eliminating ring artifacts in X-ray micro-tomography", Opt.
//! Express 26, 28396. All work on the sinogram of one slice, `[view][bin]` of line integrals.

use super::{bridge, least_squares, median, running_median};

/// How hard stripes are looked for; the defaults are Savu's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stripes {
    /// A stripe stands out by this many times the noise.
    pub limit: f32,
    /// Bins of the widest stripe, times two or three.
    pub large: usize,
    /// The same for narrow stripes.
    pub small: usize,
}

impl Default for Stripes {
    fn default() -> Self {
        Self { limit: 3.0, large: 71, small: 31 }
    }
}

/// A sinogram by columns: `[bin][view]`.
struct Columns {
    columns: Vec<Vec<f32>>,
}

impl Columns {
    fn of(sinogram: &[f32], bins: usize) -> Self {
        Self {
            columns: (0..bins)
                .map(|bin| sinogram.iter().skip(bin).step_by(bins).copied().collect())
                .collect(),
        }
    }

    fn write(&self, sinogram: &mut [f32]) {
        let bins = self.columns.len();
        for (i, v) in sinogram.iter_mut().enumerate() {
            *v = self.columns[i % bins][i / bins];
        }
    }

    /// Each column sorted, and the order that it had.
    fn sorted(&self) -> (Self, Vec<Vec<usize>>) {
        let orders: Vec<Vec<usize>> = self
            .columns
            .iter()
            .map(|column| {
                let mut order: Vec<usize> = (0..column.len()).collect();
                order.sort_by(|a, b| column[*a].total_cmp(&column[*b]));
                order
            })
            .collect();
        let columns = self
            .columns
            .iter()
            .zip(&orders)
            .map(|(column, order)| order.iter().map(|&i| column[i]).collect())
            .collect();
        (Self { columns }, orders)
    }

    /// Each rank (or view) smoothed along the bins by a running median.
    fn smooth(&self, size: usize) -> Self {
        let mut smooth = self.columns.clone();
        for rank in 0..self.columns.first().map_or(0, Vec::len) {
            let line: Vec<f32> = self.columns.iter().map(|column| column[rank]).collect();
            smooth
                .iter_mut()
                .zip(running_median(&line, size))
                .for_each(|(column, v)| column[rank] = v);
        }
        Self { columns: smooth }
    }

    fn unsort(&mut self, bin: usize, sorted: &[f32], order: &[usize]) {
        order.iter().zip(sorted).for_each(|(&i, v)| self.columns[bin][i] = *v);
    }
}

/// All of Vo's: dead stripes, then large ones, then the rest by sorting. For data with every kind
/// of ring.
pub fn remove_stripes(sinogram: &mut [f32], bins: usize, stripes: Stripes) {
    if bins < 8 || sinogram.len() < 8 * bins {
        return;
    }
    remove_dead(sinogram, bins, stripes);
    remove_large(sinogram, bins, stripes);
    remove_stripes_by_sorting(sinogram, bins, stripes.small);
}

/// Partial and full stripes of up to about half of `size` bins: in sorted columns a stripe stays a
/// stripe and structure becomes smooth, so a running median across takes the one and leaves the
/// other.
pub(crate) fn remove_stripes_by_sorting(sinogram: &mut [f32], bins: usize, size: usize) {
    let mut columns = Columns::of(sinogram, bins);
    let (sorted, orders) = columns.sorted();
    let smooth = sorted.smooth(size);
    for (bin, order) in orders.iter().enumerate() {
        columns.unsort(bin, &smooth.columns[bin], order);
    }
    columns.write(sinogram);
}

/// Stripes whose strength changes slowly with the view: each column loses what its polynomial of
/// degree `degree` differs from the running median of the neighbours' polynomials. For specimens of
/// which each column sees much the same in all views.
pub fn remove_stripes_by_fit(sinogram: &mut [f32], bins: usize, degree: usize, size: usize) {
    let mut columns = Columns::of(sinogram, bins);
    let views = columns.columns.first().map_or(0, Vec::len);
    let basis = |view: usize| {
        let x = 2.0 * view as f64 / (views.max(2) - 1) as f64 - 1.0;
        (0..=degree).map(|k| x.powi(k as i32)).collect::<Vec<f64>>()
    };
    let fit = |column: &Vec<f32>| {
        let c = least_squares(
            degree + 1,
            column.iter().enumerate().map(|(view, v)| (basis(view), f64::from(*v))),
        )
        .unwrap_or_default();
        (0..views)
            .map(|view| c.iter().zip(basis(view)).map(|(c, b)| c * b).sum::<f64>() as f32)
            .collect::<Vec<f32>>()
    };
    let fits = Columns { columns: columns.columns.iter().map(fit).collect() };
    let smooth = fits.smooth(size);
    for (column, (fit, smooth)) in
        columns.columns.iter_mut().zip(fits.columns.iter().zip(&smooth.columns))
    {
        column
            .iter_mut()
            .zip(fit.iter().zip(smooth))
            .for_each(|(v, (fit, smooth))| *v += smooth - fit);
    }
    columns.write(sinogram);
}

/// Wide stripes. Vo finds them where sorted columns stand off from a running median across; but so
/// do the edges of what is in the specimen. Of these only a stripe has two steps, one up and one
/// down, of much the same height and at most `large`/2 bins apart. Rank by rank it loses what it
/// has, on average over its columns, beyond the line between its neighbours.
fn remove_large(sinogram: &mut [f32], bins: usize, stripes: Stripes) {
    let mut columns = Columns::of(sinogram, bins);
    let (mut sorted, orders) = columns.sorted();
    let views = sinogram.len() / bins;
    // The tenths of smallest and largest values hold what only some views see.
    let middle = views / 10..views - views / 10;
    let level: Vec<f32> = sorted
        .columns
        .iter()
        .map(|column| column[middle.clone()].iter().sum::<f32>() / middle.len() as f32)
        .collect();
    let rises: Vec<f32> = (0..bins).map(|i| level[i] - level[i.saturating_sub(1)]).collect();
    let steps: Vec<f32> =
        rises.iter().zip(running_median(&rises, 9)).map(|(rise, usual)| rise - usual).collect();
    let slopes = running_median(&rises.iter().map(|r| r.abs()).collect::<Vec<f32>>(), 9);
    // A step is also steeper than what is around it: the rim of a body is not.
    let found: Vec<bool> = stand_out(&steps, stripes.limit)
        .into_iter()
        .zip(steps.iter().zip(&slopes))
        .map(|(odd, (step, slope))| odd && step.abs() > stripes.limit * slope)
        .collect();
    let mut first = 1;
    while first < bins {
        let fits = |last: &usize| {
            found[*last]
                && steps[first] * steps[*last] < 0.0
                && (0.5..2.0).contains(&(steps[first] / steps[*last]).abs())
        };
        let end = (first + 2..=(first + stripes.large / 2).min(bins - 1)).find(fits);
        let Some(end) = end.filter(|_| found[first]) else {
            first += 1;
            continue;
        };
        for rank in 0..views {
            let (before, after) = (sorted.columns[first - 1][rank], sorted.columns[end][rank]);
            let line = |i: usize| {
                before + (after - before) * (i + 1 - first) as f32 / (end + 1 - first) as f32
            };
            let beyond = (first..end).map(|i| sorted.columns[i][rank] - line(i)).sum::<f32>()
                / (end - first) as f32;
            (first..end).for_each(|i| sorted.columns[i][rank] -= beyond);
        }
        (first..end).for_each(|bin| columns.unsort(bin, &sorted.columns[bin], &orders[bin]));
        first = end + 1;
    }
    columns.write(sinogram);
}

/// Pixels that do not respond, or flicker: found where a column is much smoother or rougher along
/// the views than its neighbours (by a factor of 3 at least: structure does less), and bridged.
fn remove_dead(sinogram: &mut [f32], bins: usize, stripes: Stripes) {
    let columns = Columns::of(sinogram, bins);
    let rough = |column: &Vec<f32>| {
        let views = column.len() as isize;
        let mean = |i: isize| {
            (-5..=5).map(|k| column[(i + k).clamp(0, views - 1) as usize]).sum::<f32>() / 11.0
        };
        column.iter().enumerate().map(|(i, v)| (v - mean(i as isize)).abs()).sum::<f32>()
    };
    let roughness: Vec<f32> = columns.columns.iter().map(rough).collect();
    let usual = running_median(&roughness, stripes.large);
    let floor = 1e-3 * median(&mut usual.clone()).max(f32::MIN_POSITIVE);
    let ratio: Vec<f32> =
        roughness.iter().zip(&usual).map(|(r, u)| ((r + floor) / (u + floor)).ln()).collect();
    let odd = stand_out(&ratio, stripes.limit);
    let found = widened(
        odd.iter().zip(&ratio).map(|(odd, ratio)| *odd && ratio.abs() > 3.0_f32.ln()).collect(),
        1,
    );
    for line in sinogram.chunks_mut(bins) {
        bridge(line, |bin| found[bin]);
    }
}

/// Which values stand out: the middle half of the sorted values defines a line; a value beyond the
/// line's end by more than `limit` times its rise does.
fn stand_out(values: &[f32], limit: f32) -> Vec<bool> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f32::total_cmp);
    let n = sorted.len();
    let middle = n / 4..n - n / 4;
    let line =
        least_squares(2, middle.map(|i| (vec![1.0, i as f64 / n as f64], f64::from(sorted[i]))))
            .unwrap_or(vec![1.0, 0.0]);
    let (low, high) = (line[0] as f32, (line[0] + line[1]) as f32);
    let rise = (high - low).max(1e-6 * high.abs()).max(f32::MIN_POSITIVE);
    values.iter().map(|v| *v > high + 0.5 * limit * rise || *v < low - 0.5 * limit * rise).collect()
}

fn widened(found: Vec<bool>, by: usize) -> Vec<bool> {
    (0..found.len())
        .map(|i| found[i.saturating_sub(by)..(i + by + 1).min(found.len())].iter().any(|f| *f))
        .collect()
}
