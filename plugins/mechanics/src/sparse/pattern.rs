//! Which nodes there are, which elements join them, and hence which blocks of the matrix can be
//! different from zero.

use rayon::prelude::*;

use super::SolveError;

/// The nodes of each element, any number of them; a node may appear twice.
#[derive(Debug, Clone)]
pub struct Connectivity {
    starts: Vec<usize>,
    nodes: Vec<u32>,
}

impl Default for Connectivity {
    fn default() -> Self {
        Self { starts: vec![0], nodes: Vec::new() }
    }
}

impl Connectivity {
    /// Appends an element.
    pub(crate) fn push(&mut self, nodes: &[u32]) {
        self.nodes.extend_from_slice(nodes);
        self.starts.push(self.nodes.len());
    }

    /// Number of elements.
    pub(crate) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// The nodes of element `e`.
    ///
    /// # Panics
    /// If there is no such element.
    pub(crate) fn get(&self, e: usize) -> &[u32] {
        &self.nodes[self.starts[e]..self.starts[e + 1]]
    }
}

impl<N: AsRef<[u32]>> FromIterator<N> for Connectivity {
    fn from_iter<I: IntoIterator<Item = N>>(elements: I) -> Self {
        let mut all = Self::default();
        elements.into_iter().for_each(|nodes| all.push(nodes.as_ref()));
        all
    }
}

/// How the unknowns of a node move with the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A displacement (or a scalar, for matrices of one unknown a node).
    Translation,
    /// The rotation of the node with this number, which carries the displacement of the same place.
    RotationOf(u32),
    /// Measured against the body, as the slip of a tendon: nought in every rigid motion.
    Relative,
}

/// Where a node is, and what its unknowns are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Metres.
    pub position: [f64; 3],
    /// What its unknowns are.
    pub kind: Kind,
}

impl Place {
    /// A node with displacements (or one scalar).
    pub fn point(position: [f64; 3]) -> Self {
        Self { position, kind: Kind::Translation }
    }
}

/// The blocks of a matrix: for each node, the nodes it shares an element with, itself included,
/// ascending. Matrices of several physics on one mesh share it.
#[derive(Debug)]
pub struct Pattern {
    pub(super) places: Vec<Place>,
    pub(super) starts: Vec<usize>,
    pub(super) columns: Vec<u32>,
}

/// Rows that are listed at a time.
const ROWS: usize = 1 << 10;

impl Pattern {
    /// The pattern of these elements over these nodes.
    ///
    /// # Errors
    /// [`SolveError::NoSuchNode`] for an element, or the partner of a rotation, that names a node
    /// beyond the last; [`SolveError::NotFinite`] for a position.
    pub fn new(places: Vec<Place>, elements: &Connectivity) -> Result<Self, SolveError> {
        let nodes = places.len();
        let beyond =
            |element, node: u32| SolveError::NoSuchNode { element, node: node as usize, nodes };
        for (i, place) in places.iter().enumerate() {
            if place.position.iter().any(|x| !x.is_finite()) {
                return Err(SolveError::NotFinite { what: "position", node: i });
            }
            if let Kind::RotationOf(partner) = place.kind
                && partner as usize >= nodes
            {
                return Err(beyond(i, partner));
            }
        }
        for e in 0..elements.len() {
            if let Some(&node) = elements.get(e).iter().find(|&&n| n as usize >= nodes) {
                return Err(beyond(e, node));
            }
        }
        let at = elements_at(nodes, elements);
        let lists: Vec<(Vec<u32>, Vec<u32>)> = (0..nodes.div_ceil(ROWS))
            .into_par_iter()
            .map(|c| neighbours(c, &at, elements))
            .collect();
        let (mut starts, mut columns) = (
            Vec::with_capacity(nodes + 1),
            Vec::with_capacity(lists.iter().map(|l| l.1.len()).sum()),
        );
        starts.push(0);
        let mut end = 0;
        for (counts, list) in lists {
            starts.extend(counts.iter().map(|&n| {
                end += n as usize;
                end
            }));
            columns.extend_from_slice(&list);
        }
        Ok(Self { places, starts, columns })
    }

    /// Number of nodes.
    pub(crate) fn nodes(&self) -> usize {
        self.places.len()
    }

    /// Number of blocks.
    pub(crate) fn blocks(&self) -> usize {
        self.columns.len()
    }

    /// The nodes joined to node `i`, ascending.
    pub(super) fn row(&self, i: usize) -> &[u32] {
        &self.columns[self.starts[i]..self.starts[i + 1]]
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.places[..])
            + size_of_val(&self.starts[..])
            + size_of_val(&self.columns[..])
    }
}

/// Elements at each node: the transposed connectivity.
fn elements_at(nodes: usize, elements: &Connectivity) -> Connectivity {
    let mut starts = vec![0_usize; nodes + 1];
    for &n in &elements.nodes {
        starts[n as usize + 1] += 1;
    }
    for i in 0..nodes {
        starts[i + 1] += starts[i];
    }
    let mut next = starts.clone();
    let mut list = vec![0_u32; elements.nodes.len()];
    for e in 0..elements.len() {
        for &n in elements.get(e) {
            list[next[n as usize]] = e as u32;
            next[n as usize] += 1;
        }
    }
    Connectivity { starts, nodes: list }
}

/// How many columns each row of chunk `c` has, and which.
fn neighbours(c: usize, at: &Connectivity, elements: &Connectivity) -> (Vec<u32>, Vec<u32>) {
    let (mut counts, mut all, mut row) = (Vec::with_capacity(ROWS), Vec::new(), Vec::new());
    for i in c * ROWS..((c + 1) * ROWS).min(at.len()) {
        row.clear();
        row.push(i as u32);
        at.get(i).iter().for_each(|&e| row.extend_from_slice(elements.get(e as usize)));
        row.sort_unstable();
        row.dedup();
        counts.push(row.len() as u32);
        all.extend_from_slice(&row);
    }
    (counts, all)
}
