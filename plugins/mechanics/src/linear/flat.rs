//! Flat elements made solid as CalculiX makes them: a layer of bricks or wedges whose two sides do
//! what the plane does. Plane strain and axial symmetry bind the sides whole; plane stress lets
//! them thicken.

use std::collections::HashMap;

use glam::DVec3;

use super::{constraint::Equation, model::Deck, shape::Shape};

/// How a flat element is closed to the third direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Plane {
    /// CPS: no stress.
    Stress,
    /// CPE: no strain.
    Strain,
    /// CAX: about the y axis.
    Around,
}

/// An element of a plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Flat {
    pub(super) plane: Plane,
    /// Corners, 3 or 4.
    pub(super) corners: usize,
    /// What it becomes.
    pub(super) shape: Shape,
}

/// Degrees of a slice of what is axially symmetric.
pub(super) const SLICE: f64 = 2.0;

impl Flat {
    /// Its nodes.
    pub(super) fn nodes(self) -> usize {
        if self.is_quadratic() { 2 * self.corners } else { self.corners }
    }

    fn is_quadratic(self) -> bool {
        self.shape.nodes() > 8
    }
}

/// Both sides of each node at each thickness.
pub(super) type Sides = HashMap<(u32, u64), [u32; 2]>;

/// Nodes of the solid that a flat element becomes.
pub(super) fn thicken(
    deck: &mut Deck,
    flat: Flat,
    nodes: &[u32],
    thickness: f64,
    known: &mut Sides,
) -> Vec<u32> {
    let sides: Vec<[u32; 2]> = nodes
        .iter()
        .map(|&n| {
            *known
                .entry((n, thickness.to_bits()))
                .or_insert_with(|| make_sides(deck, flat.plane, n, thickness))
        })
        .collect();
    let (corners, middles) = sides.split_at(flat.corners);
    let mut all = Vec::with_capacity(flat.shape.nodes());
    for part in [corners, middles] {
        (0..2).for_each(|side| all.extend(part.iter().map(|s| s[side])));
    }
    if flat.is_quadratic() {
        all.extend(&nodes[..flat.corners]);
    }
    all
}

/// The nodes on both sides of one, and what binds them.
fn make_sides(deck: &mut Deck, plane: Plane, node: u32, thickness: f64) -> [u32; 2] {
    let middle = deck.nodes[node as usize];
    let own = |i: u32| 3 * node + i;
    deck.equations.push(Equation { terms: vec![(own(2), 1.0)], value: 0.0, line: 0 });
    let (sin, cos) = (0.5 * SLICE).to_radians().sin_cos();
    let sides = [-1.0, 1.0].map(|side| {
        let number = deck.nodes.len() as u32;
        let its = |i: u32| 3 * number + i;
        let (place, turned) = if plane == Plane::Around {
            (DVec3::new(middle.x * cos, middle.y, side * middle.x * sin), [cos, side * sin])
        } else {
            (middle + 0.5 * side * thickness * DVec3::Z, [1.0, 0.0])
        };
        deck.nodes.push(place);
        deck.twins.insert(number, node);
        let mut bind = |terms: Vec<(u32, f64)>| {
            deck.equations.push(Equation { terms, value: 0.0, line: 0 });
        };
        bind(vec![(its(0), 1.0), (own(0), -turned[0])]);
        bind(vec![(its(1), 1.0), (own(1), -1.0)]);
        if plane != Plane::Stress {
            bind(vec![(its(2), 1.0), (own(0), -turned[1])]);
        }
        number
    });
    if plane == Plane::Stress {
        let [low, high] = sides.map(|n| 3 * n + 2);
        let terms = vec![(low, 1.0), (high, 1.0)];
        deck.equations.push(Equation { terms, value: 0.0, line: 0 });
    }
    sides
}
