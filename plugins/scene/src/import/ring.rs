//! Segments that together close a ring: what bears is the ring, and it becomes one member.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{
    kind::{By, Verdict},
    shape::{Tube, tube},
    source::{Above, Element, Said, Surface},
};
use crate::MemberKind;

/// An element with what it was found to be.
pub(super) struct Piece {
    pub(super) element: Element,
    pub(super) verdict: Verdict,
    /// Its shape, if it is a ring.
    pub(super) tube: Option<Tube>,
    /// Names of the segments that it was joined from.
    pub(super) segments: Vec<String>,
}

/// Widest joint between neighbours, m.
const JOINT: f64 = 0.03;
/// Fewest segments of a ring.
const FEWEST: usize = 3;

/// Joins the segments of every ring that they close, all around, into one piece of lining; all
/// others stay as they are. Rings that lie behind each other are told apart by where they begin and
/// end along their axis; what is staggered so that no plane parts it is one lining.
pub(super) fn joined(pieces: Vec<Piece>) -> Vec<Piece> {
    let mut wholes: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (i, piece) in pieces.iter().enumerate().filter(|(_, p)| is_segment(p)) {
        let whole = piece.element.above.first().map_or("", |above| &above.id);
        wholes.entry(whole).or_default().push(i);
    }
    let linings = wholes.into_values().flat_map(|members| touching(&pieces, &members));
    let mut rings: Vec<(Vec<usize>, Tube)> =
        linings.flat_map(|members| rings(&pieces, members)).collect();
    rings.sort_by(|a, b| a.0.cmp(&b.0));
    let joined: Vec<Piece> =
        rings.iter().map(|(members, tube)| join(&pieces, members, tube)).collect();
    let gone: std::collections::HashSet<usize> = rings.into_iter().flat_map(|r| r.0).collect();
    let left = pieces.into_iter().enumerate().filter(|(i, _)| !gone.contains(i));
    left.map(|(_, piece)| piece).chain(joined).collect()
}

fn is_segment(piece: &Piece) -> bool {
    let kind =
        matches!(piece.verdict, Verdict::Member(MemberKind::Segment | MemberKind::Lining, _));
    kind && piece.tube.is_none() && !piece.element.surface.is_empty()
}

/// Groups of pieces whose boxes lie no further apart than a joint is wide.
fn touching(pieces: &[Piece], members: &[usize]) -> Vec<Vec<usize>> {
    let boxes: Vec<[DVec3; 2]> =
        members.iter().map(|&i| pieces[i].element.surface.bounds()).collect();
    let touch = |a: &[DVec3; 2], b: &[DVec3; 2]| {
        (a[0] - JOINT).cmple(b[1]).all() && (b[0] - JOINT).cmple(a[1]).all()
    };
    let mut group: Vec<usize> = (0..members.len()).collect();
    for i in 0..members.len() {
        for j in 0..i {
            if touch(&boxes[i], &boxes[j]) && group[i] != group[j] {
                let (from, to) = (group[i], group[j]);
                group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
            }
        }
    }
    let mut found: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    group.iter().zip(members).for_each(|(&g, &i)| found.entry(g).or_default().push(i));
    found.into_values().collect()
}

/// The rings that pieces which touch each other close, with their shapes.
fn rings(pieces: &[Piece], members: Vec<usize>) -> Vec<(Vec<usize>, Tube)> {
    let Some(whole) = closed(pieces, &members) else { return Vec::new() };
    let along = whole.axis.normalize_or_zero();
    let mut spans: BTreeMap<[i64; 2], Vec<usize>> = BTreeMap::new();
    for &i in &members {
        let span = pieces[i].element.surface.span(along);
        spans.entry(span.map(|at| (at / JOINT).round() as i64)).or_default().push(i);
    }
    let found: Option<Vec<_>> =
        spans.into_values().map(|ring| closed(pieces, &ring).map(|tube| (ring, tube))).collect();
    found.unwrap_or_else(|| vec![(members, whole)])
}

/// The tube that these pieces are together, if they are one.
fn closed(pieces: &[Piece], members: &[usize]) -> Option<Tube> {
    if members.len() < FEWEST {
        return None;
    }
    tube(&united(pieces, members))
}

fn united(pieces: &[Piece], members: &[usize]) -> Surface {
    let mut all = Surface::default();
    for surface in members.iter().map(|&i| &pieces[i].element.surface) {
        let first = all.points.len() as u32;
        all.points.extend(&surface.points);
        all.triangles.extend(surface.triangles.iter().map(|t| t.map(|i| i + first)));
    }
    all
}

/// One piece of several. It is called after what they are the parts of, where that is this ring
/// alone, else after its first and last segment.
fn join(pieces: &[Piece], members: &[usize], tube: &Tube) -> Piece {
    let of = |i: &usize| &pieces[*i].element;
    let (first, last) = (of(&members[0]), of(&members[members.len() - 1]));
    let own = |above: &&Above| {
        let parts =
            pieces.iter().filter(|p| p.element.above.first().is_some_and(|a| a.id == above.id));
        !above.id.is_empty()
            && above.class == "IfcElementAssembly"
            && parts.count() == members.len()
    };
    let (id, name, above) = match first.above.first().filter(own) {
        Some(whole) => (whole.id.clone(), whole.name.clone(), first.above[1..].to_vec()),
        None => (first.id.clone(), format!("{} to {}", first.name, last.name), first.above.clone()),
    };
    let said =
        first.said.clone().map(|said| Said { kind: MemberKind::Lining, frame: None, ..said });
    let element = Element {
        id,
        name,
        above,
        said,
        surface: united(pieces, members),
        objects: members.iter().flat_map(|i| of(i).objects.clone()).collect(),
        courses: members.iter().flat_map(|i| of(i).courses.clone()).collect(),
        ..first.clone()
    };
    Piece {
        element,
        verdict: Verdict::Member(MemberKind::Lining, By::Shape),
        tube: Some(tube.clone()),
        segments: members.iter().map(|i| of(i).name.clone()).collect(),
    }
}
