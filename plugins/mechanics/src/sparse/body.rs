//! Rigid motions: the near-kernel that multigrid is built on, and what a model does that is not
//! held.
//!
//! A body is a connected set of nodes. It floats if some combination of its rigid modes moves no
//! held direction and costs no energy: first the null space of the held directions, then K r on
//! what is left of it.

use nalgebra::{DMatrix, SymmetricEigen};
use rayon::prelude::*;

use super::{
    BlockMatrix, Constraints, Kind, Place, SolveError,
    block::{Block, apply, mean_diagonal, square},
};

/// A mode is held if it moves held directions by more than this share of the largest (lever arms
/// count squared).
const HELD: f64 = 1e-10;
/// A mode costs energy if |K r| exceeds this share of |D r|: far above rounding, far below the
/// softest springs.
const STIFF: f64 = 1e-11;

/// How the unknowns of a node move in the rigid motions of a body about `centre`, lengths in units
/// of `scale`: for B = 3 three translations and three rotations (K = 6), otherwise B constants (K =
/// B).
pub(super) fn rigid_modes<const B: usize, const K: usize>(
    place: &Place,
    centre: [f64; 3],
    scale: f64,
) -> Block<B, K> {
    let mut modes = [[0.0; K]; B];
    let unit = |modes: &mut Block<B, K>, first: usize, value: f64| {
        for i in 0..B.min(K - first) {
            modes[i][first + i] = value;
        }
    };
    match place.kind {
        Kind::Relative => {}
        Kind::Translation => {
            unit(&mut modes, 0, 1.0);
            if B == 3 && K == 6 {
                let [x, y, z]: [f64; 3] =
                    std::array::from_fn(|i| (place.position[i] - centre[i]) / scale);
                // u = ω × x
                let spin = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]];
                for (row, spin) in modes.iter_mut().zip(spin) {
                    row[3..].copy_from_slice(&spin);
                }
            }
        }
        Kind::RotationOf(_) if B == 3 && K == 6 => unit(&mut modes, 3, 1.0 / scale),
        Kind::RotationOf(_) => {}
    }
    modes
}

/// Numbers the connected bodies; nodes without any stiffness have none.
fn bodies<const B: usize>(matrix: &BlockMatrix<B>) -> (Vec<Option<u32>>, Vec<u32>) {
    let (mut body, mut sizes) = (vec![None; matrix.nodes()], Vec::new());
    let mut stack = Vec::new();
    for start in 0..matrix.nodes() {
        if body[start].is_some() || square(matrix.diagonal(start)) == 0.0 {
            continue;
        }
        let number = sizes.len() as u32;
        let mut size = 0;
        body[start] = Some(number);
        stack.push(start);
        while let Some(i) = stack.pop() {
            size += 1;
            for (j, block) in matrix.row_blocks(i) {
                if body[j].is_none() && square(block) != 0.0 {
                    body[j] = Some(number);
                    stack.push(j);
                }
            }
        }
        sizes.push(size);
    }
    (body, sizes)
}

/// One body: where it is, and which motions its constraints leave.
struct Body<const K: usize> {
    first: usize,
    centre: [f64; 3],
    scale: f64,
    held: Block<K, K>,
    /// Orthonormal combinations of the modes that no constraint stops, as columns.
    loose: Vec<[f64; K]>,
}

/// Refuses a model with a body that can move rigidly.
///
/// # Errors
/// [`SolveError::Floating`] with a node of the first such body and its motion.
pub(super) fn check<const B: usize>(
    matrix: &BlockMatrix<B>,
    constraints: &Constraints<B>,
) -> Result<(), SolveError> {
    if B == 3 {
        check_modes::<B, 6>(matrix, constraints)
    } else {
        check_modes::<B, B>(matrix, constraints)
    }
}

fn check_modes<const B: usize, const K: usize>(
    matrix: &BlockMatrix<B>,
    constraints: &Constraints<B>,
) -> Result<(), SolveError> {
    let places = &matrix.pattern().places;
    let (of, sizes) = bodies(matrix);
    let mut bodies: Vec<Body<K>> = frames(places, &of, sizes.len());
    for (node, q) in constraints.directions() {
        if let Some(body) = of[node].map(|b| &mut bodies[b as usize]) {
            let modes = rigid_modes::<B, K>(&places[node], body.centre, body.scale);
            let moved: [f64; K] = std::array::from_fn(|k| (0..B).map(|i| q[i] * modes[i][k]).sum());
            for i in 0..K {
                for j in 0..K {
                    body.held[i][j] += moved[i] * moved[j];
                }
            }
        }
    }
    bodies.iter_mut().for_each(|body| body.loose = null_space(&body.held, HELD));
    if bodies.iter().all(|b| b.loose.is_empty()) {
        return Ok(());
    }
    let costs = costs::<B, K>(matrix, &of, &bodies);
    for (b, body) in bodies.iter().enumerate() {
        if let Some(mode) = free_motion(body, &costs[b]) {
            return Err(SolveError::Floating {
                node: body.first,
                size: sizes[b] as usize,
                motion: describe::<B, K>(&mode),
            });
        }
    }
    Ok(())
}

/// First node, centre and radius of each body.
fn frames<const K: usize>(places: &[Place], of: &[Option<u32>], count: usize) -> Vec<Body<K>> {
    let mut low = vec![([f64::INFINITY; 3], [f64::NEG_INFINITY; 3], usize::MAX); count];
    for (i, (place, body)) in places.iter().zip(of).enumerate() {
        if let Some(body) = body {
            let (low, high, first) = &mut low[*body as usize];
            *first = (*first).min(i);
            for c in 0..3 {
                low[c] = low[c].min(place.position[c]);
                high[c] = high[c].max(place.position[c]);
            }
        }
    }
    let frame = |(low, high, first): ([f64; 3], [f64; 3], usize)| {
        let half: [f64; 3] = std::array::from_fn(|i| 0.5 * (high[i] - low[i]));
        let radius = half.iter().map(|h| h * h).sum::<f64>().sqrt();
        let centre = std::array::from_fn(|i| 0.5 * (high[i] + low[i]));
        Body {
            first,
            centre,
            scale: if radius > 0.0 { radius } else { 1.0 },
            held: [[0.0; K]; K],
            loose: Vec::new(),
        }
    };
    low.into_iter().map(frame).collect()
}

/// Eigenvectors of a symmetric matrix whose eigenvalues are below `share` of the largest (of 1, if
/// all are smaller).
fn null_space<const K: usize>(a: &Block<K, K>, share: f64) -> Vec<[f64; K]> {
    let eigen = SymmetricEigen::new(DMatrix::from_fn(K, K, |i, j| a[i][j]));
    let limit = share * eigen.eigenvalues.iter().fold(1.0, |m: f64, v| m.max(*v));
    let small = (0..K).filter(|&k| eigen.eigenvalues[k] < limit);
    small.map(|k| std::array::from_fn(|i| eigen.eigenvectors[(i, k)])).collect()
}

/// For the loose motions of each body: Σ r rᵀ (how much they move), and Σ (K r / d)(K r / d)ᵀ (how
/// much they strain), d = mean stiffness of the node. The second is nought for a rigid motion in
/// spite of rounding in stiff neighbours, since every row is measured by its own stiffness.
fn costs<const B: usize, const K: usize>(
    matrix: &BlockMatrix<B>,
    of: &[Option<u32>],
    bodies: &[Body<K>],
) -> Vec<(Block<K, K>, Block<K, K>)> {
    let places = &matrix.pattern().places;
    let row = |i: usize| {
        let body = &bodies[of[i]? as usize];
        if body.loose.is_empty() {
            return None;
        }
        let move_of = |j: usize| {
            let modes = rigid_modes::<B, K>(&places[j], body.centre, body.scale);
            let mut moves = [[0.0; K]; B];
            for (k, loose) in body.loose.iter().enumerate() {
                let u = apply(&modes, loose);
                (0..B).for_each(|c| moves[c][k] = u[c]);
            }
            moves
        };
        let mut strain = [[0.0; K]; B];
        for (j, block) in matrix.row_blocks(i) {
            super::block::add_product(
                1.0 / mean_diagonal(matrix.diagonal(i)),
                block,
                &move_of(j),
                &mut strain,
            );
        }
        Some((move_of(i), strain))
    };
    let rows: Vec<_> = (0..matrix.nodes()).into_par_iter().map(row).collect();
    let mut sums = vec![([[0.0; K]; K], [[0.0; K]; K]); bodies.len()];
    for (i, row) in rows.iter().enumerate() {
        if let (Some((moves, strain)), Some(body)) = (row, of[i]) {
            let (motion, energy) = &mut sums[body as usize];
            super::block::add_transposed_product(moves, moves, motion);
            super::block::add_transposed_product(strain, strain, energy);
        }
    }
    sums
}

/// A loose motion that moves the body but strains nothing, in the modes of the body.
fn free_motion<const K: usize>(
    body: &Body<K>,
    (motion, energy): &(Block<K, K>, Block<K, K>),
) -> Option<[f64; K]> {
    let n = body.loose.len();
    if n == 0 {
        return None;
    }
    // Motions that move nothing (a single node does not turn) are none.
    let eigen = SymmetricEigen::new(DMatrix::from_fn(n, n, |i, j| motion[i][j]));
    let most = eigen.eigenvalues.iter().fold(0.0, |m: f64, v| m.max(*v));
    let real: Vec<usize> = (0..n).filter(|&k| eigen.eigenvalues[k] > HELD * most).collect();
    let basis = DMatrix::from_fn(n, real.len(), |i, k| {
        eigen.eigenvectors[(i, real[k])] / eigen.eigenvalues[real[k]].sqrt()
    });
    if real.is_empty() {
        return None;
    }
    let strain = basis.transpose() * DMatrix::from_fn(n, n, |i, j| energy[i][j]) * &basis;
    let eigen = SymmetricEigen::new(strain);
    let (softest, value) =
        eigen.eigenvalues.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1))?;
    if *value > STIFF * STIFF {
        return None;
    }
    let mix = basis * eigen.eigenvectors.column(softest);
    Some(std::array::from_fn(|m| {
        body.loose.iter().zip(mix.iter()).map(|(loose, mix)| loose[m] * mix).sum()
    }))
}

/// A motion in words.
fn describe<const B: usize, const K: usize>(mode: &[f64; K]) -> String {
    let unit = |v: &[f64]| {
        let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        // A direction has no sign: the largest component is shown positive, and no zero negative.
        let sign = v.iter().fold(0.0, |m: f64, x| if x.abs() > m.abs() { *x } else { m }).signum();
        let list: Vec<_> = v
            .iter()
            .map(|x| format!("{:.2}", (sign * x / length * 100.0).round() / 100.0 + 0.0))
            .collect();
        (length, list.join(", "))
    };
    if B != 3 || K != 6 {
        return "take any value".into();
    }
    let ((move_length, along), (turn_length, about)) = (unit(&mode[..3]), unit(&mode[3..]));
    if turn_length > 1e-3 * move_length {
        format!("turn about ({about})")
    } else {
        format!("move along ({along})")
    }
}
