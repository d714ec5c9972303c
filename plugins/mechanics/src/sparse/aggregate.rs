//! Which nodes move together on the next coarser level: neighbours that are strongly joined (Vaněk,
//! Mandel and Brezina 1996).

use rayon::prelude::*;

use super::{BlockMatrix, Kind, Place, block::square, constraint::Mask};

/// No aggregate.
pub(super) const NONE: u32 = u32::MAX;

/// Nodes in groups.
pub(super) struct Aggregates {
    /// The group of each node, or [`NONE`] for what does not move with its neighbours (held nodes,
    /// slips).
    pub(super) of: Vec<u32>,
    /// How many groups.
    pub(super) count: usize,
}

impl Aggregates {
    /// The first node of each group.
    pub(super) fn first(&self) -> Vec<u32> {
        let mut first = vec![NONE; self.count];
        for (i, &g) in self.of.iter().enumerate().filter(|(_, g)| **g != NONE) {
            first[g as usize] = first[g as usize].min(i as u32);
        }
        first
    }
}

/// The strong neighbours of each node.
struct Strong {
    starts: Vec<usize>,
    nodes: Vec<u32>,
    /// Frobenius norms of the diagonal blocks, squared.
    diagonal: Vec<f64>,
}

/// Rows at a time.
const ROWS: usize = 1 << 11;

impl Strong {
    /// i and j are strongly joined if ‖A_ij‖ > θ √(‖A_ii‖ ‖A_jj‖), which does not depend on units
    /// nor on how stiff the region is; two regions of very different stiffness are not strongly
    /// joined.
    fn new<const B: usize>(matrix: &BlockMatrix<B>, threshold: f64) -> Self {
        let diagonal: Vec<f64> =
            (0..matrix.nodes()).into_par_iter().map(|i| square(matrix.diagonal(i))).collect();
        let limit = threshold.powi(4);
        let strong = |i: usize, j: usize, square: f64| {
            i != j && square * square > limit * diagonal[i] * diagonal[j]
        };
        let chunk = |c: usize| {
            let (mut counts, mut list) = (Vec::with_capacity(ROWS), Vec::new());
            for i in c * ROWS..((c + 1) * ROWS).min(matrix.nodes()) {
                let before = list.len();
                list.extend(
                    matrix
                        .row_blocks(i)
                        .filter(|(j, b)| strong(i, *j, square(b)))
                        .map(|(j, _)| j as u32),
                );
                counts.push(list.len() - before);
            }
            (counts, list)
        };
        let lists: Vec<(Vec<usize>, Vec<u32>)> =
            (0..matrix.nodes().div_ceil(ROWS)).into_par_iter().map(chunk).collect();
        let (mut starts, mut nodes, mut end) = (vec![0], Vec::new(), 0);
        for (counts, list) in lists {
            starts.extend(counts.iter().map(|n| {
                end += n;
                end
            }));
            nodes.extend_from_slice(&list);
        }
        Self { starts, nodes, diagonal }
    }

    fn of(&self, i: usize) -> &[u32] {
        &self.nodes[self.starts[i]..self.starts[i + 1]]
    }
}

/// Groups the nodes: first every node whose neighbours are all free founds a group with them, then
/// the rest joins its most strongly joined neighbour's group, then what is still alone makes groups
/// of its own. The rotation of a shell's node goes where its displacement goes.
pub(super) fn aggregate<const B: usize>(
    matrix: &BlockMatrix<B>,
    mask: &Mask<B>,
    threshold: f64,
) -> Aggregates {
    let strong = Strong::new(matrix, threshold);
    let points = Points::new(&matrix.pattern().places);
    let nodes = matrix.nodes();
    let neighbours =
        |p: usize| points.nodes(p).flat_map(|i| strong.of(i)).map(|&j| points.of(j as usize));
    let moves = |p: usize| {
        points
            .nodes(p)
            .any(|i| !mask.is_fixed(i) && matrix.pattern().places[i].kind != Kind::Relative)
    };
    let member: Vec<bool> = (0..nodes).map(|p| points.of(p) == p && moves(p)).collect();
    let mut of = vec![NONE; nodes];
    let mut count = 0;
    let mut found = |of: &mut [u32], p: usize| {
        of[p] = count;
        neighbours(p).filter(|&q| member[q]).for_each(|q| {
            if of[q] == NONE {
                of[q] = count
            }
        });
        count += 1;
    };
    for p in 0..nodes {
        if member[p]
            && of[p] == NONE
            && neighbours(p).all(|q| of[q] == NONE)
            && neighbours(p).any(|q| q != p && member[q])
        {
            found(&mut of, p);
        }
    }
    let founded = of.clone();
    for p in (0..nodes).filter(|&p| member[p] && founded[p] == NONE) {
        let mut best = (0.0, NONE);
        for i in points.nodes(p) {
            for (j, block) in matrix.row_blocks(i) {
                let (q, weight) = (
                    points.of(j),
                    square(block) / (strong.diagonal[i] * strong.diagonal[j]).sqrt(),
                );
                if founded[q] != NONE
                    && weight > best.0
                    && strong.of(i).binary_search(&(j as u32)).is_ok()
                {
                    best = (weight, founded[q]);
                }
            }
        }
        of[p] = best.1;
    }
    for p in 0..nodes {
        if member[p] && of[p] == NONE {
            found(&mut of, p);
        }
    }
    for i in 0..nodes {
        of[i] = if mask.is_fixed(i) || matrix.pattern().places[i].kind == Kind::Relative {
            NONE
        } else {
            of[points.of(i)]
        };
    }
    Aggregates { of, count: count as usize }
}

/// Displacement and rotation at one place.
struct Points<'a> {
    places: &'a [Place],
    /// The rotation that belongs to a displacement, or [`NONE`]; empty if there are none.
    rotation: Vec<u32>,
}

impl<'a> Points<'a> {
    fn new(places: &'a [Place]) -> Self {
        let mut rotation = Vec::new();
        for (i, place) in places.iter().enumerate() {
            if let Kind::RotationOf(partner) = place.kind {
                rotation.resize(places.len(), NONE);
                rotation[partner as usize] = i as u32;
            }
        }
        Self { places, rotation }
    }

    /// The node that stands for this one's place.
    fn of(&self, i: usize) -> usize {
        match self.places[i].kind {
            Kind::RotationOf(partner) => partner as usize,
            _ => i,
        }
    }

    /// The nodes at this place.
    fn nodes(&self, p: usize) -> impl Iterator<Item = usize> {
        let rotation = self.rotation.get(p).filter(|&&r| r != NONE);
        std::iter::once(p).chain(rotation.map(|&r| r as usize))
    }
}
