//! Ties: nodes of one surface move with the faces of another that they lie on.

use glam::DVec3;

use super::{
    constraint::Equation,
    model::Deck,
    shape::{Jet, face_functions},
};

/// A face of an element, and how far it reaches.
pub(super) struct Face {
    nodes: Vec<u32>,
    middle: DVec3,
    reach: f64,
}

/// A node's place on a face.
struct Foot {
    nodes: Vec<u32>,
    shares: Vec<f64>,
    place: DVec3,
    /// How far off the face, and how far beside it.
    off: f64,
    beside: f64,
}

/// How far beside a face a node may lie, and off it unless the deck says so, over the face's reach.
const BEYOND: f64 = 0.025;
/// Newton's steps to the nearest point of a curved face.
const STEPS: usize = 20;

impl Face {
    pub(super) fn new(deck: &Deck, cell: u32, face: u8) -> Option<Self> {
        let cell = deck.cells.get(cell as usize)?;
        let own = cell.shape.faces().nth(usize::from(face))?;
        let nodes: Vec<u32> = own.iter().map(|&i| cell.nodes[i]).collect();
        let places = || nodes.iter().map(|&n| deck.nodes[n as usize]);
        let middle = places().sum::<DVec3>() / nodes.len() as f64;
        let reach = places().map(|p| p.distance(middle)).fold(0.0, f64::max);
        Some(Self { nodes, middle, reach })
    }

    pub(super) fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Its point nearest to a place.
    fn foot(&self, deck: &Deck, place: DVec3) -> Foot {
        let triangle = self.nodes.len().is_multiple_of(3);
        let mut at = if triangle { [1.0 / 3.0; 2] } else { [0.0; 2] };
        for _ in 0..STEPS {
            let (point, [a, b]) = self.tangents(deck, at);
            // The step that takes the rest of the way along both tangents.
            let rest = place - point;
            let (aa, ab, bb) = (a.dot(a), a.dot(b), b.dot(b));
            let (ra, rb) = (a.dot(rest), b.dot(rest));
            let determinant = aa * bb - ab * ab;
            let step = [(bb * ra - ab * rb) / determinant, (aa * rb - ab * ra) / determinant];
            let next = within(triangle, [at[0] + step[0], at[1] + step[1]]);
            let moved = (next[0] - at[0]).abs() + (next[1] - at[1]).abs();
            at = next;
            if moved.is_nan() || moved <= 1e-14 {
                break;
            }
        }
        let jets = face_functions(self.nodes.len(), at);
        let (point, [a, b]) = self.tangents(deck, at);
        let rest = place - point;
        let off = rest.dot(a.cross(b).normalize_or_zero());
        Foot {
            nodes: self.nodes.clone(),
            shares: jets.iter().map(|j| j.value).collect(),
            place: point,
            off: off.abs(),
            beside: (rest.length_squared() - off * off).max(0.0).sqrt(),
        }
    }

    fn point(&self, deck: &Deck, jets: &[Jet], of: impl Fn(&Jet) -> f64) -> DVec3 {
        jets.iter().zip(&self.nodes).map(|(j, &n)| of(j) * deck.nodes[n as usize]).sum()
    }

    fn tangents(&self, deck: &Deck, at: [f64; 2]) -> (DVec3, [DVec3; 2]) {
        let jets = face_functions(self.nodes.len(), at);
        let along = [0, 1].map(|i| self.point(deck, &jets, |j| j.slope[i]));
        (self.point(deck, &jets, |j| j.value), along)
    }
}

/// The nearest natural coordinates of a face.
fn within(triangle: bool, [a, b]: [f64; 2]) -> [f64; 2] {
    if !triangle {
        return [a.clamp(-1.0, 1.0), b.clamp(-1.0, 1.0)];
    }
    let (a, b) = (a.max(0.0), b.max(0.0));
    let over = (a + b - 1.0).max(0.0);
    let (a, b) = (a - 0.5 * over, b - 0.5 * over);
    [a.clamp(0.0, 1.0), b.clamp(0.0, 1.0)]
}

/// Ties nodes to faces: what is bound already stays as it is. Nodes that lie on no face (2.5 % of its
/// reach beside it, `tolerance` or as much off it) are given back; `adjust` moves the others onto it.
///
/// # Errors
/// The first node that stays farther off its face than 2.5 % of its reach, and how far, m: a tie
/// across a gap bears a moment that nothing has given it.
pub(super) fn tie(
    deck: &mut Deck,
    nodes: &[u32],
    masters: &[Face],
    tolerance: Option<f64>,
    adjust: bool,
    is_bound: impl Fn(u32) -> bool,
    line: u32,
) -> Result<Vec<u32>, (u32, f64)> {
    let mut loose = Vec::new();
    for &node in nodes {
        let place = deck.nodes[node as usize];
        let allowed = |f: &Face| tolerance.unwrap_or(BEYOND * f.reach);
        let near =
            masters.iter().filter(|f| f.middle.distance(place) <= 1.5 * f.reach + allowed(f));
        let feet = near.filter_map(|f| {
            let foot = f.foot(deck, place);
            (foot.off <= allowed(f) && foot.beside <= BEYOND * f.reach).then_some((foot, f.reach))
        });
        let away = |foot: &Foot| foot.off + foot.beside;
        let Some((foot, reach)) = feet.min_by(|a, b| away(&a.0).total_cmp(&away(&b.0))) else {
            loose.push(node);
            continue;
        };
        if !adjust && foot.off > BEYOND * reach {
            return Err((node, foot.off));
        }
        if adjust {
            deck.nodes[node as usize] = foot.place;
        }
        for i in (0..3).filter(|&i| !is_bound(3 * node + i)) {
            let shares = foot.nodes.iter().zip(&foot.shares).map(|(&n, &s)| (3 * n + i, -s));
            let terms = std::iter::once((3 * node + i, 1.0)).chain(shares).collect();
            deck.equations.push(Equation { terms, value: 0.0, line });
        }
    }
    Ok(loose)
}
