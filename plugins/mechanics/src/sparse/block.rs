//! Small dense blocks of fixed size.

/// Rows of a block of R × C numbers.
pub(super) type Block<const R: usize, const C: usize> = [[f64; C]; R];

/// The identity.
pub(super) fn identity<const B: usize>() -> Block<B, B> {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }))
}

/// A x
#[inline]
pub(super) fn apply<const R: usize, const C: usize>(a: &Block<R, C>, x: &[f64; C]) -> [f64; R] {
    std::array::from_fn(|i| (0..C).map(|j| a[i][j] * x[j]).sum())
}

/// C ← C + s A B
#[inline]
pub(super) fn add_product<const R: usize, const M: usize, const C: usize>(
    s: f64,
    a: &Block<R, M>,
    b: &Block<M, C>,
    to: &mut Block<R, C>,
) {
    for i in 0..R {
        for m in 0..M {
            let f = s * a[i][m];
            for j in 0..C {
                to[i][j] += f * b[m][j];
            }
        }
    }
}

/// C ← C + Aᵀ B
#[inline]
pub(super) fn add_transposed_product<const R: usize, const M: usize, const C: usize>(
    a: &Block<M, R>,
    b: &Block<M, C>,
    to: &mut Block<R, C>,
) {
    for m in 0..M {
        for i in 0..R {
            for j in 0..C {
                to[i][j] += a[m][i] * b[m][j];
            }
        }
    }
}

/// A B
pub(super) fn product<const R: usize, const M: usize, const C: usize>(
    a: &Block<R, M>,
    b: &Block<M, C>,
) -> Block<R, C> {
    let mut c = [[0.0; C]; R];
    add_product(1.0, a, b, &mut c);
    c
}

/// Σ Aᵢⱼ²
pub(super) fn square<const R: usize, const C: usize>(a: &Block<R, C>) -> f64 {
    a.iter().flatten().map(|v| v * v).sum()
}

/// Mean of the diagonal.
pub(super) fn mean_diagonal<const B: usize>(a: &Block<B, B>) -> f64 {
    (0..B).map(|i| a[i][i]).sum::<f64>() / B as f64
}

/// The inverse of a symmetric positive definite block by Cholesky; `None` where a pivot falls below
/// 1e-13 of its diagonal entry.
pub(super) fn inverse<const B: usize>(a: &Block<B, B>) -> Option<Block<B, B>> {
    let mut l = [[0.0; B]; B];
    for j in 0..B {
        let pivot = a[j][j] - (0..j).map(|k| l[j][k] * l[j][k]).sum::<f64>();
        if pivot.is_nan() || pivot <= 1e-13 * a[j][j] {
            return None;
        }
        l[j][j] = pivot.sqrt();
        for i in j + 1..B {
            l[i][j] = (a[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>()) / l[j][j];
        }
    }
    let mut inverse = [[0.0; B]; B];
    for c in 0..B {
        let mut x = [0.0; B];
        for i in c..B {
            let unit = if i == c { 1.0 } else { 0.0 };
            x[i] = (unit - (c..i).map(|k| l[i][k] * x[k]).sum::<f64>()) / l[i][i];
        }
        for i in (0..B).rev() {
            x[i] = (x[i] - (i + 1..B).map(|k| l[k][i] * x[k]).sum::<f64>()) / l[i][i];
        }
        for (row, v) in inverse.iter_mut().zip(x) {
            row[c] = v;
        }
    }
    Some(inverse)
}
