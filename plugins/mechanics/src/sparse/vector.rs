//! Vectors of any length, summed in fixed chunks: the result does not know how many threads worked.

use rayon::prelude::*;

/// Entries of a chunk: 64 kB of each vector.
pub(super) const CHUNK: usize = 1 << 13;

/// Σ aᵢ bᵢ.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    total(a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).map(|(a, b)| partial(a, b)))
}

/// ‖a‖₂
pub(super) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// y ← y + α x
pub(super) fn axpy(alpha: f64, x: &[f64], y: &mut [f64]) {
    let add = |(y, x): (&mut [f64], &[f64])| y.iter_mut().zip(x).for_each(|(y, x)| *y += alpha * x);
    y.par_chunks_mut(CHUNK).zip(x.par_chunks(CHUNK)).for_each(add);
}

/// y ← x + β y
pub(super) fn xpby(x: &[f64], beta: f64, y: &mut [f64]) {
    let add =
        |(y, x): (&mut [f64], &[f64])| y.iter_mut().zip(x).for_each(|(y, x)| *y = x + beta * *y);
    y.par_chunks_mut(CHUNK).zip(x.par_chunks(CHUNK)).for_each(add);
}

/// One step of conjugate gradients: x ← x + α p, r ← r − α q; returns r·r.
pub(super) fn advance(alpha: f64, p: &[f64], q: &[f64], x: &mut [f64], r: &mut [f64]) -> f64 {
    let parts = x
        .par_chunks_mut(CHUNK)
        .zip(r.par_chunks_mut(CHUNK))
        .zip(p.par_chunks(CHUNK).zip(q.par_chunks(CHUNK)));
    total(parts.map(|((x, r), (p, q))| {
        for ((x, r), (p, q)) in x.iter_mut().zip(r.iter_mut()).zip(p.iter().zip(q)) {
            *x += alpha * p;
            *r -= alpha * q;
        }
        partial(r, r)
    }))
}

/// Index of the first entry that is not a finite number.
pub(super) fn not_finite(a: &[f64]) -> Option<usize> {
    a.par_chunks(CHUNK)
        .enumerate()
        .find_map_first(|(c, a)| a.iter().position(|v| !v.is_finite()).map(|i| c * CHUNK + i))
}

/// Index of the largest magnitude.
pub(super) fn largest(a: &[f64]) -> usize {
    let best = a
        .iter()
        .enumerate()
        .fold((0, -1.0), |best, (i, v)| if v.abs() > best.1 { (i, v.abs()) } else { best });
    best.0
}

/// Sums of the chunks, added in their order.
fn total(parts: impl IndexedParallelIterator<Item = f64>) -> f64 {
    parts.collect::<Vec<_>>().iter().sum()
}

/// The scalar product of one chunk in eight interleaved sums, which the compiler keeps in vector
/// registers.
fn partial(a: &[f64], b: &[f64]) -> f64 {
    let ((a, tail_a), (b, tail_b)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for l in 0..8 {
            sums[l] += a[l] * b[l];
        }
    }
    sums.iter().sum::<f64>() + tail_a.iter().zip(tail_b).map(|(a, b)| a * b).sum::<f64>()
}
