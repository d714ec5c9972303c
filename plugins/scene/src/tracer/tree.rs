//! What the builder makes and the kernels read.

use wide::f32x8;

/// Marks a child as a leaf; the rest of the word is then the index of its block.
pub(super) const LEAF: u32 = 1 << 31;

/// No path from the root is longer (see `build::SAH_DEPTH`), so that the traversal stacks can have
/// a fixed size.
pub(super) const MAX_DEPTH: usize = 96;

/// Entries of a traversal stack: each level leaves at most seven siblings behind. A power of two,
/// so that a mask replaces the bounds check.
pub(super) const STACK: usize = 1024;
const _: () = assert!(7 * MAX_DEPTH + 8 <= STACK && STACK.is_power_of_two());

/// Up to eight boxes and what is in them, four cache lines.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Planes `[axis][0: low, 1: high]`, one lane a child.
    pub(super) planes: [[f32x8; 2]; 3],
    /// Node index, or block index with [`LEAF`].
    pub(super) child: [u32; 8],
    /// How many of the eight are in use; they come first.
    pub(super) children: u32,
}

impl Node {
    /// Boxes that no ray enters.
    pub(super) fn empty() -> Self {
        Self { planes: [[f32x8::splat(1e30), f32x8::splat(-1e30)]; 3], child: [0; 8], children: 0 }
    }
}

/// Up to eight triangles for one ray, five cache lines. Lanes not in use are zero: their
/// determinant is zero, and no ray hits them.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Block {
    /// Coordinates `[axis][corner]`, one lane a triangle.
    pub(super) corner: [[f32x8; 3]; 3],
    /// The caller's indices.
    pub(super) id: [u32; 8],
}

/// The same triangles for eight rays: each corner once, however many of the leaf's triangles share
/// it.
#[derive(Debug, Default)]
pub(super) struct Fans {
    /// One a node: the lanes of its children from front to back, for each octant of directions (bit
    /// a: towards lower coordinates of axis a).
    pub(super) order: Vec<[[u8; 8]; 8]>,
    /// One a block.
    pub(super) leaf: Vec<Fan>,
    pub(super) vertex: Vec<[f32; 3]>,
    pub(super) face: Vec<Face>,
}

/// A leaf of [`Fans`]: ranges of its vertices (at most 24) and faces.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fan {
    pub(super) vertex: [u32; 2],
    pub(super) face: [u32; 2],
}

/// A triangle of a [`Fan`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Face {
    /// Indices among the leaf's vertices.
    pub(super) corner: [u8; 3],
    /// The caller's index.
    pub(super) id: u32,
}

/// Nodes, root first, and leaves.
#[derive(Debug, Default)]
pub(super) struct Tree {
    pub(super) node: Vec<Node>,
    pub(super) block: Vec<Block>,
    /// Only where packets are the kernel of choice.
    pub(super) fans: Fans,
}
