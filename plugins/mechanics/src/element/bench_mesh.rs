//! A test bench: small meshes, a direct solver, laws with closed forms.

use super::hex8;
use crate::tensor::{Tangent, Voigt};
use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};
use glam::DVec3;

/// K u = f with prescribed unknowns.
pub(crate) struct Bench {
    entries: Vec<(usize, usize, f64)>,
    pub(crate) load: Vec<f64>,
    pub(crate) fixed: Vec<Option<f64>>,
}

impl Bench {
    pub(crate) fn new(unknowns: usize) -> Self {
        Self { entries: Vec::new(), load: vec![0.0; unknowns], fixed: vec![None; unknowns] }
    }

    pub(crate) fn add<const N: usize>(&mut self, unknowns: &[usize; N], stiffness: &[[f64; N]; N]) {
        for (&r, row) in unknowns.iter().zip(stiffness) {
            self.entries.extend(unknowns.iter().zip(row).map(|(&c, &k)| (r, c, k)));
        }
    }

    pub(crate) fn push<const N: usize>(&mut self, unknowns: &[usize; N], load: &[f64; N]) {
        unknowns.iter().zip(load).for_each(|(&r, f)| self.load[r] += f);
    }

    pub(crate) fn solve(&self) -> Vec<f64> {
        let free: Vec<usize> = (0..self.load.len()).filter(|&i| self.fixed[i].is_none()).collect();
        let mut place = vec![usize::MAX; self.load.len()];
        free.iter().enumerate().for_each(|(k, &i)| place[i] = k);
        let mut right = faer::Mat::<f64>::from_fn(free.len(), 1, |i, _| self.load[free[i]]);
        let mut triplets = Vec::new();
        for &(r, c, k) in &self.entries {
            match (self.fixed[r], self.fixed[c]) {
                (None, None) => triplets.push(Triplet::new(place[r], place[c], k)),
                (None, Some(u)) => right[(place[r], 0)] -= k * u,
                _ => {}
            }
        }
        let matrix =
            SparseColMat::<usize, f64>::try_new_from_triplets(free.len(), free.len(), &triplets)
                .unwrap();
        let solution = matrix.sp_cholesky(faer::Side::Lower).unwrap().solve(&right);
        (0..self.load.len())
            .map(|i| self.fixed[i].unwrap_or_else(|| solution[(place[i], 0)]))
            .collect()
    }
}

/// Unknowns of nodes with three displacements each.
pub(crate) fn unknowns<const A: usize, const N: usize>(nodes: &[usize; A]) -> [usize; N] {
    std::array::from_fn(|c| 3 * nodes[c / 3] + c % 3)
}

pub(crate) fn pick<const N: usize>(values: &[f64], unknowns: &[usize; N]) -> [f64; N] {
    unknowns.map(|i| values[i])
}

/// Hooke's law.
pub(crate) fn hooke(e: f64, nu: f64) -> Tangent {
    let (lambda, g) = (e * nu / (1.0 + nu) / (1.0 - 2.0 * nu), e / 2.0 / (1.0 + nu));
    std::array::from_fn(|i| {
        std::array::from_fn(|j| if i < 3 && j < 3 { lambda } else { 0.0 } + if i != j { 0.0 } else if i < 3 { 2.0 * g } else { g })
    })
}

pub(crate) fn times(tangent: &Tangent, strain: &Voigt) -> Voigt {
    tangent.map(|row| row.iter().zip(strain).map(|(d, e)| d * e).sum())
}

/// W = q/2 + β q²/4 with q = ε·C ε: stiffening, smooth, symmetric.
pub(crate) fn stiffening(c: &Tangent, beta: f64, strain: &Voigt) -> (Voigt, Tangent) {
    let s = times(c, strain);
    let q: f64 = s.iter().zip(strain).map(|(s, e)| s * e).sum();
    let f = 1.0 + beta * q;
    (
        s.map(|s| f * s),
        std::array::from_fn(|i| std::array::from_fn(|j| f * c[i][j] + 2.0 * beta * s[i] * s[j])),
    )
}

/// A brick with no parallel edges.
pub(crate) fn crooked() -> [DVec3; 8] {
    let shifts = [
        (0.1, -0.2, 0.05),
        (0.2, 0.1, -0.1),
        (-0.15, 0.1, 0.2),
        (0.0, -0.1, 0.1),
        (-0.1, 0.15, -0.2),
        (0.25, -0.05, 0.1),
        (0.1, 0.2, -0.1),
        (-0.2, -0.1, 0.15),
    ];
    std::array::from_fn(|a| hex8::CORNERS[a] + DVec3::from(shifts[a]))
}

/// nx × ny × nz bricks of a box; node (i, j, k) is i + (nx+1)(j + (ny+1) k).
pub(crate) fn bricks(n: [usize; 3], size: DVec3) -> (Vec<DVec3>, Vec<[usize; 8]>) {
    let id = |i, j, k| i + (n[0] + 1) * (j + (n[1] + 1) * k);
    let (mut nodes, mut elements) = (Vec::new(), Vec::new());
    for k in 0..=n[2] {
        for j in 0..=n[1] {
            nodes.extend((0..=n[0]).map(|i| {
                size * DVec3::new(
                    i as f64 / n[0] as f64,
                    j as f64 / n[1] as f64,
                    k as f64 / n[2] as f64,
                )
            }));
        }
    }
    for k in 0..n[2] {
        for j in 0..n[1] {
            for i in 0..n[0] {
                let floor =
                    |k| [id(i, j, k), id(i + 1, j, k), id(i + 1, j + 1, k), id(i, j + 1, k)];
                let ([a, b, c, d], [e, f, g, h]) = (floor(k), floor(k + 1));
                elements.push([a, b, c, d, e, f, g, h]);
            }
        }
    }
    (nodes, elements)
}

/// Numbers without pattern in −1…1, the same every time.
pub(crate) fn noise<const N: usize>(seed: u64) -> [f64; N] {
    std::array::from_fn(|i| {
        let mut x = (seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15)
            ^ (i as u64 + 1).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 29)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 32)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    })
}

/// Largest |a − b| over largest |b|.
pub(crate) fn off(a: &[f64], b: &[f64]) -> f64 {
    let largest = b.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    a.iter().zip(b).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs())) / largest
}

/// ∂force/∂unknown by central differences.
pub(crate) fn differences<const N: usize>(
    u: &[f64; N],
    step: f64,
    mut force: impl FnMut(&[f64; N]) -> [f64; N],
) -> [[f64; N]; N] {
    let mut slope = [[0.0; N]; N];
    for c in 0..N {
        let mut at = |sign: f64| {
            let mut moved = *u;
            moved[c] += sign * step;
            force(&moved)
        };
        let (up, down) = (at(1.0), at(-1.0));
        (0..N).for_each(|r| slope[r][c] = (up[r] - down[r]) / (2.0 * step));
    }
    slope
}
