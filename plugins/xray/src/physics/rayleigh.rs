//! Coherent scattering: Thomson's (1 + c²)/2 times F²(x), and tables over x.

use intrados_stage::random::Draw;
use std::f64::consts::TAU;

use super::{Forms, transfer};

/// Step of the tables in x, 1/Å.
const STEP: f64 = 0.02;
/// Twice this is the largest x, 500 keV straight back.
const NODES: usize = 2051;

/// F²(x), linear in u = x² between nodes x = i·0.02 Å⁻¹, and its integral over u.
#[derive(Debug, Clone, PartialEq)]
pub struct FormFactor {
    square: Vec<f64>,
    /// ∫₀ F² du up to each node.
    sum: Vec<f64>,
}

impl FormFactor {
    /// From a material's table.
    #[must_use]
    pub fn new(forms: &Forms) -> Self {
        Self::of(|x| interpolate(&forms.x, &forms.coherent, x))
    }

    /// exp(−(x/0.6)²): what `mc_fd` takes instead.
    #[must_use]
    pub(crate) fn gaussian() -> Self {
        Self::of(|x| (-(x / 0.6).powi(2)).exp())
    }

    fn of(f: impl Fn(f64) -> f64) -> Self {
        let square: Vec<f64> = (0..NODES).map(|i| f(STEP * i as f64).max(1e-12)).collect();
        let mut sum = vec![0.0];
        for i in 1..NODES {
            sum.push(sum[i - 1] + 0.5 * (square[i] + square[i - 1]) * (node(i) - node(i - 1)));
        }
        Self { square, sum }
    }

    fn index(x: f64) -> usize {
        ((x / STEP) as usize).min(NODES - 2)
    }

    /// F² at `x`.
    #[inline]
    #[must_use]
    pub fn square(&self, x: f64) -> f64 {
        let i = Self::index(x);
        let t = ((x * x - node(i)) / (node(i + 1) - node(i))).clamp(0.0, 1.0);
        self.square[i] + t * (self.square[i + 1] - self.square[i])
    }

    /// ∫ F² du up to x.
    fn integral(&self, x: f64) -> f64 {
        let i = Self::index(x);
        self.sum[i] + 0.5 * (self.square[i] + self.square(x)) * (x * x - node(i)).max(0.0)
    }

    /// ∫ (1 + c²)/2 F² dΩ for photons of `kev`, by Simpson's rule within the tables' cells.
    #[must_use]
    pub fn total(&self, kev: f64) -> f64 {
        let most = transfer(kev, -1.0);
        // u = (E/hc)²(1 − c)/2, dc = −2 du/u_max: in u the form factor is linear within each cell
        // and Simpson nearly exact.
        let top = most * most;
        let thomson = |u: f64| {
            let c = 1.0 - 2.0 * u / top;
            0.5 * (1.0 + c * c) * self.square(u.sqrt())
        };
        let mut sum = 0.0;
        for i in 0..=Self::index(most) {
            let (a, b) = (node(i), node(i + 1).min(top));
            if b > a {
                sum += (b - a) / 6.0 * (thomson(a) + 4.0 * thomson(0.5 * (a + b)) + thomson(b));
            }
        }
        TAU * 2.0 * sum / top
    }

    /// The cosine after scattering: u by inversion of ∫F² du, Thomson's factor by rejection.
    #[must_use]
    pub fn sample(&self, kev: f64, draw: &mut Draw) -> f64 {
        let most = transfer(kev, -1.0);
        let all = self.integral(most);
        loop {
            let wanted = draw.unit() * all;
            let i = self.sum.partition_point(|&s| s <= wanted).saturating_sub(1).min(NODES - 2);
            let (width, rest) = (node(i + 1) - node(i), wanted - self.sum[i]);
            // f₀ t + (f₁ − f₀) t²/2 = rest/width, t the part of the cell.
            let (f0, slope) = (self.square[i], self.square[i + 1] - self.square[i]);
            let t =
                2.0 * rest / width / (f0 + (f0 * f0 + 2.0 * slope * rest / width).max(0.0).sqrt());
            let u = (node(i) + t.clamp(0.0, 1.0) * width).min(most * most);
            let c = 1.0 - 2.0 * u / (most * most);
            if draw.unit() < 0.5 * (1.0 + c * c) {
                return c;
            }
        }
    }
}

fn node(i: usize) -> f64 {
    (STEP * i as f64).powi(2)
}

/// A table over x as values at x = i·0.02 Å⁻¹.
pub(super) fn uniform(x: &[f64], y: &[f64]) -> Vec<f64> {
    (0..NODES).map(|i| interpolate(x, y, STEP * i as f64)).collect()
}

/// Looks up such values, linear in between.
#[inline]
pub(super) fn look(values: &[f64], x: f64) -> f64 {
    let at = (x / STEP).min((NODES - 1) as f64);
    let i = (at as usize).min(NODES - 2);
    let t = at - i as f64;
    values[i] + t * (values[i + 1] - values[i])
}

/// Linear in log-log; in the first cell, which has no logarithm, by x².
fn interpolate(xs: &[f64], ys: &[f64], x: f64) -> f64 {
    let i = xs.partition_point(|&p| p <= x).clamp(1, xs.len() - 1);
    let ([x0, x1], [y0, y1]) = ([xs[i - 1], xs[i]], [ys[i - 1], ys[i]]);
    if x0 <= 0.0 || y0 <= 0.0 || y1 <= 0.0 {
        return y0 + (y1 - y0) * (x / x1).powi(2).min(1.0);
    }
    (y0.ln() + (y1 / y0).ln() * ((x / x0).ln() / (x1 / x0).ln()).clamp(0.0, 1.0)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::Library;
    use intrados_stage::random::Key;
    use intrados_transport::chi2::{Grid, rectangle};

    #[test]
    fn samples_follow_the_density() {
        let library = Library::builtin().unwrap();
        for (name, kev, low) in
            [("concrete", 30.0, -1.0), ("concrete", 150.0, 0.8), ("steel", 450.0, 0.98)]
        {
            let form = FormFactor::new(&library.material(name).unwrap().forms);
            let draw = |i| {
                let mut draw = Draw::new(Key::new(3, i));
                Some([form.sample(kev, &mut draw), draw.unit()]).filter(|[c, _]| *c >= low)
            };
            let total = form.total(kev);
            let grid = Grid { bounds: [[low, 1.0], [0.0, 1.0]], cells: [300, 4] };
            let chi = rectangle(grid, 1_000_000, draw, |[c, _]| {
                TAU * 0.5 * (1.0 + c * c) * form.square(transfer(kev, c)) / total
            });
            assert!(chi.passes(3), "{name} {kev}: {chi:?}");
        }
    }

    /// With F = 1, Thomson's 8π/3.
    #[test]
    fn total_is_thomsons() {
        let form = FormFactor::of(|_| 1.0);
        for kev in [20.0, 333.0] {
            assert!((form.total(kev) / (TAU * 4.0 / 3.0) - 1.0).abs() < 1e-10);
        }
    }
}
