//! Scatter over a scan, with error bars.
//!
//! Scatter is smooth, so it is estimated (by Monte Carlo) at a few views and on a coarse grid of
//! the detector, and interpolated, and so is its standard error. All intensities are in units of
//! the open beam.

use std::f64::consts::TAU;

/// Scatter at one view: a coarse image of the detector.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    /// Angle of the view, rad.
    pub angle: f64,
    /// Intensity over the open beam's, `[row][bin]` of the coarse grid.
    pub value: Vec<f32>,
    /// Its standard error.
    pub error: Vec<f32>,
}

/// Scatter at some views of a turn.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Coarse rows and bins; each patch covers the whole detector with patches of equal size.
    pub size: [usize; 2],
    patches: Vec<Patch>,
}

impl Estimate {
    /// From patches at different angles of a full turn, in any order; `None` where there are none,
    /// or one has another size, or a value that is negative or not finite.
    #[must_use]
    pub fn new(size: [usize; 2], mut patches: Vec<Patch>) -> Option<Self> {
        let n = size[0] * size[1];
        let proper = |p: &Patch| {
            let all = |v: &[f32]| v.len() == n && v.iter().all(|v| v.is_finite() && *v >= 0.0);
            p.angle.is_finite() && all(&p.value) && all(&p.error)
        };
        if n == 0 || patches.is_empty() || !patches.iter().all(proper) {
            return None;
        }
        patches.iter_mut().for_each(|p| p.angle = p.angle.rem_euclid(TAU));
        patches.sort_by(|a, b| a.angle.total_cmp(&b.angle));
        Some(Self { size, patches })
    }

    /// Scatter and its variance on a detector of `rows` × `bins` in the view at `angle`: linear
    /// between the two nearest views of the turn and between the centres of the patches.
    #[must_use]
    pub fn view(&self, angle: f64, [rows, bins]: [usize; 2]) -> (Vec<f32>, Vec<f32>) {
        let angle = angle.rem_euclid(TAU);
        let n = self.patches.len();
        let next = self.patches.partition_point(|p| p.angle <= angle) % n;
        let before = (next + n - 1) % n;
        let [a, b] = [&self.patches[before], &self.patches[next]];
        let gap = (b.angle - a.angle).rem_euclid(TAU);
        let share = if n == 1 || gap == 0.0 {
            0.0
        } else {
            ((angle - a.angle).rem_euclid(TAU) / gap) as f32
        };
        let coarse = |i: usize| {
            let value = (1.0 - share) * a.value[i] + share * b.value[i];
            (value, ((1.0 - share) * a.error[i]).powi(2) + (share * b.error[i]).powi(2))
        };
        let tap = |i: usize, fine: usize, coarse: usize| {
            let place = ((i as f64 + 0.5) * coarse as f64 / fine as f64 - 0.5)
                .clamp(0.0, (coarse - 1) as f64);
            let first = (place as usize).min(coarse.saturating_sub(2));
            (first, (first + 1).min(coarse - 1), (place - first as f64) as f32)
        };
        let columns: Vec<_> = (0..bins).map(|i| tap(i, bins, self.size[1])).collect();
        let mut values = Vec::with_capacity(rows * bins);
        let mut variances = Vec::with_capacity(rows * bins);
        for row in 0..rows {
            let (r, s, q) = tap(row, rows, self.size[0]);
            for &(k, l, p) in &columns {
                let corners = [
                    (r, k, (1.0 - q) * (1.0 - p)),
                    (r, l, (1.0 - q) * p),
                    (s, k, q * (1.0 - p)),
                    (s, l, q * p),
                ];
                let (mut value, mut variance) = (0.0, 0.0);
                for (r, k, weight) in corners {
                    let (v, e) = coarse(r * self.size[1] + k);
                    value += weight * v;
                    // Errors of neighbouring patches are taken as one, not as independent: a
                    // patch's walks overlap its neighbours'.
                    variance += weight * e;
                }
                values.push(value);
                variances.push(variance);
            }
        }
        (values, variances)
    }
}
