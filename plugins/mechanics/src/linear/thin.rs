//! Beams and shells made solid as CalculiX makes them (user's manual, "Expansion of the
//! one-dimensional and two-dimensional elements"). Every node of the deck becomes a ring of nodes:
//! two or three along the normal of a shell, four or eight around the section of a beam. It moves
//! as the mean of the outer ones, and turns as their mean rotation; where its angles are supported,
//! nodes between outer ones stay between them. Sections that are no rectangle are one by where
//! they are integrated.

use std::{
    collections::{BTreeMap, HashMap},
    f64::consts::{FRAC_PI_4, PI},
};

use glam::DVec3;

use super::{
    constraint::Equation,
    curve::Curve,
    model::{Cell, Deck},
    read::{Kind, Raw, Reader, Section},
    shape::{GAUSS_2, Point, Shape, face_functions, face_places},
};
use crate::read::{Fault, abaqus::card::Row};

/// An element of a line or of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Thin {
    /// Of 2 or 3 nodes, and the solid that it becomes.
    Beam { nodes: usize, shape: Shape },
    /// Of 3 or 4 corners.
    Shell { corners: usize, shape: Shape },
}

/// What a section says beside its material.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) enum Profile {
    /// Of solids and planes.
    #[default]
    Whole,
    /// How far the middle lies off the nodes along the normal, over the thickness; thickness,
    /// material and axes of every layer from below, where it has some.
    Shell { offset: f64, layers: Vec<(f64, u32, Option<u32>)> },
    /// Its 1-direction, and its sizes along both.
    Beam { first: DVec3, size: [f64; 2], hollow: Option<Hollow> },
}

/// A hollow section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Hollow {
    /// A tube of this thickness, m.
    Pipe(f64),
    /// Walls of this thickness, m.
    Box(f64),
}

/// Nodes that a node of a beam or a shell becomes.
#[derive(Debug, Clone, Default)]
pub(super) struct Ring {
    /// Those whose mean the node is.
    outer: Vec<u32>,
    /// Others, and the two that each lies between.
    between: Vec<(u32, [u32; 2])>,
    /// Whether nodes between the outer ones are kept there.
    stiff: bool,
}

/// Axes of a node: normal of a shell; tangent and 1-direction of a beam; and sizes.
#[derive(Debug, Clone, Copy)]
struct Axes {
    of_beam: bool,
    first: DVec3,
    second: DVec3,
    sizes: [f64; 2],
    quadratic: bool,
}

/// Angles up to which axes of neighbours are one, degrees: of beams and of shells.
const ALIKE: [f64; 2] = [0.5, 20.0];

impl Thin {
    pub(super) fn of(name: &str) -> Option<Self> {
        Some(match name {
            "B31" => Self::Beam { nodes: 2, shape: Shape::Hex8Bubbles },
            "B32" => Self::Beam { nodes: 3, shape: Shape::Hex20 },
            "B32R" => Self::Beam { nodes: 3, shape: Shape::Hex20Reduced },
            "S3" => Self::Shell { corners: 3, shape: Shape::Wedge6 },
            "S4" => Self::Shell { corners: 4, shape: Shape::Hex8Bubbles },
            "S6" => Self::Shell { corners: 3, shape: Shape::Wedge15 },
            "S8" => Self::Shell { corners: 4, shape: Shape::Hex20 },
            "S8R" => Self::Shell { corners: 4, shape: Shape::Hex20Reduced },
            _ => return None,
        })
    }

    pub(super) fn nodes(self) -> usize {
        match self {
            Self::Beam { nodes, .. } => nodes,
            Self::Shell { corners, shape } if shape.nodes() > 8 => 2 * corners,
            Self::Shell { corners, .. } => corners,
        }
    }

    fn shape(self) -> Shape {
        match self {
            Self::Beam { shape, .. } | Self::Shell { shape, .. } => shape,
        }
    }

    /// Axes at each of its nodes.
    fn axes(self, places: &[DVec3], section: &Section) -> Option<Vec<Axes>> {
        match (self, &section.profile) {
            (Self::Shell { .. }, Profile::Shell { offset, .. }) => {
                let normal = |at: &[f64; 2]| {
                    let jets = face_functions(places.len(), *at);
                    let along = |i: usize| -> DVec3 {
                        jets.iter().zip(places).map(|(j, &p)| j.slope[i] * p).sum()
                    };
                    Some(Axes {
                        of_beam: false,
                        first: along(0).cross(along(1)).try_normalize()?,
                        second: DVec3::ZERO,
                        sizes: [section.thickness, *offset],
                        quadratic: self.shape().nodes() > 8,
                    })
                };
                face_places(places.len()).iter().map(normal).collect()
            }
            (Self::Beam { .. }, Profile::Beam { first, size, .. }) => {
                let axes = |tangent: DVec3| {
                    let tangent = tangent.try_normalize()?;
                    Some(Axes {
                        of_beam: true,
                        first: first.reject_from_normalized(tangent).try_normalize()?,
                        second: tangent,
                        sizes: *size,
                        quadratic: self.shape().nodes() > 8,
                    })
                };
                let tangents = match *places {
                    [a, b] => vec![b - a; 2],
                    [a, b, c] => vec![4.0 * b - 3.0 * a - c, c - a, a + 3.0 * c - 4.0 * b],
                    _ => return None,
                };
                tangents.into_iter().map(axes).collect()
            }
            _ => None,
        }
    }

    /// The nodes of the solid, from the rings of its own.
    fn solid(self, rings: &[&Ring]) -> Vec<u32> {
        match (self, rings) {
            (Self::Shell { corners, .. }, _) => {
                let (corner, middle) = rings.split_at(corners);
                let mut all = Vec::new();
                for part in [corner, middle] {
                    (0..2).for_each(|side| all.extend(part.iter().map(|r| r.outer[side])));
                }
                if !middle.is_empty() {
                    all.extend(corner.iter().filter_map(|r| r.between.first()).map(|b| b.0));
                }
                all
            }
            // ξ runs along the beam, ζ along its 1-direction.
            (Self::Beam { .. }, [a, b]) => {
                let ([a, b, c, d], [e, f, g, h]) = (four(a), four(b));
                vec![a, e, f, b, d, h, g, c]
            }
            (Self::Beam { .. }, [start, middle, end]) => {
                let (s, m, e) = (four(start), four(middle), four(end));
                let edge = |r: &Ring, i: usize| r.between.get(i).map_or(0, |b| b.0);
                let corners = [s[0], e[0], e[1], s[1], s[3], e[3], e[2], s[2]];
                let low = [m[0], edge(end, 0), m[1], edge(start, 0)];
                let high = [m[3], edge(end, 2), m[2], edge(start, 2)];
                let across = [edge(start, 3), edge(end, 3), edge(end, 1), edge(start, 1)];
                [&corners[..], &low, &high, &across].concat()
            }
            _ => Vec::new(),
        }
    }
}

fn four(ring: &Ring) -> [u32; 4] {
    std::array::from_fn(|i| ring.outer.get(i).copied().unwrap_or(0))
}

impl Axes {
    /// Whether both are of one smooth line or surface, of one section.
    fn meets(&self, other: &Self) -> bool {
        // Sums of several axes stand for their mean.
        let near = |a: DVec3, b: DVec3| {
            a.dot(b)
                >= a.length() * b.length() * ALIKE[usize::from(!self.of_beam)].to_radians().cos()
        };
        let alike = self.of_beam == other.of_beam && self.quadratic == other.quadratic;
        let along = !self.of_beam || near(self.second, other.second);
        alike && self.sizes == other.sizes && near(self.first, other.first) && along
    }
}

impl Reader {
    /// Rings of all nodes of beams and shells.
    ///
    /// # Errors
    /// Where lines or surfaces meet at an angle or with other sections.
    pub(super) fn ring(&mut self) -> Result<(), Fault> {
        let mut found: BTreeMap<u32, (Axes, bool)> = BTreeMap::new();
        for raw in &self.raw {
            let (Kind::Thin(thin), Some(section)) = (raw.kind, &raw.section) else { continue };
            let places: Vec<DVec3> =
                raw.nodes.iter().map(|&n| self.deck.nodes[n as usize]).collect();
            let why = "has no length, no normal, or a section of another kind of element";
            let axes = thin.axes(&places, section);
            let axes =
                axes.ok_or_else(|| Fault::at(raw.line, format!("element {} {why}", raw.label)))?;
            for (i, (&node, own)) in raw.nodes.iter().zip(axes).enumerate() {
                let is_end =
                    if own.of_beam { i != 1 || places.len() == 2 } else { 2 * i < places.len() };
                let ends = own.quadratic && is_end;
                let Some(known) = found.get_mut(&node) else {
                    found.insert(node, (own, ends));
                    continue;
                };
                if !known.0.meets(&own) || known.1 != ends {
                    return Err(Fault::at(
                        raw.line,
                        format!(
                            "at node {} beams or shells meet at an angle or with other sections, which is not computed",
                            self.deck.labels[node as usize]
                        ),
                    ));
                }
                known.0.first += own.first;
                known.0.second += own.second;
            }
        }
        for (node, (axes, ends)) in found {
            let ring = make_ring(&mut self.deck, node, &axes, ends);
            self.rings.insert(node, ring);
        }
        Ok(())
    }

    /// The hidden node whose components are the angles of a node of a beam or a shell.
    pub(super) fn angles(
        &mut self,
        node: u32,
        supported: Option<u32>,
        row: Row<'_>,
    ) -> Option<u32> {
        let ring = self.rings.get(&node)?.clone();
        if let (Some(step), false) = (supported, ring.stiff) {
            for (middle, [a, b]) in &ring.between {
                for i in 0..3 {
                    let terms = vec![(3 * middle + i, 1.0), (3 * a + i, -0.5), (3 * b + i, -0.5)];
                    self.deck.later.push((step, Equation { terms, value: 0.0, line: row.line }));
                }
            }
            self.rings.entry(node).and_modify(|r| r.stiff = true);
        }
        if let Some(&turning) = self.turning.get(&node) {
            return Some(turning);
        }
        let turning = self.hidden_node(node);
        for (i, axis) in (0..).zip(DVec3::AXES) {
            let (nodes, angle) = (ring.outer.clone(), 3 * turning + i);
            // Two nodes along an axis say nothing of a turn about it.
            self.bound(Curve::Turn { nodes, axis, angle, unit: 1.0 }, row.line);
        }
        self.turning.insert(node, turning);
        Some(turning)
    }

    /// The solid that a beam or a shell becomes.
    pub(super) fn thickened(&self, raw: &Raw, thin: Thin, section: &Section) -> Cell {
        let rings: Vec<&Ring> = raw.nodes.iter().filter_map(|n| self.rings.get(n)).collect();
        let (points, materials) = integration(thin, section);
        Cell {
            label: raw.label,
            shape: thin.shape(),
            nodes: thin.solid(&rings),
            material: section.material,
            orientation: section.orientation,
            points,
            layers: materials,
        }
    }
}

/// The nodes around a node, and what makes it their mean.
fn make_ring(deck: &mut Deck, node: u32, axes: &Axes, ends: bool) -> Ring {
    let middle = deck.nodes[node as usize];
    let mut add = |place: DVec3| {
        let number = deck.nodes.len() as u32;
        deck.nodes.push(place);
        deck.twins.insert(number, node);
        number
    };
    let mut ring = Ring::default();
    if axes.of_beam {
        let tangent = axes.second.normalize_or_zero();
        let first = axes.first.reject_from_normalized(tangent).normalize_or_zero();
        let second = tangent.cross(first);
        let at = |[a, b]: [f64; 2]| {
            middle + 0.5 * (a * axes.sizes[0] * first + b * axes.sizes[1] * second)
        };
        let corners = [[-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [1.0, 1.0]];
        ring.outer = corners.map(|c| add(at(c))).to_vec();
        if ends {
            let edges = [[-1.0, 0.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0]];
            for (i, edge) in edges.into_iter().enumerate() {
                ring.between.push((add(at(edge)), [ring.outer[i], ring.outer[(i + 1) % 4]]));
            }
        }
    } else {
        let normal = axes.first.normalize_or_zero();
        let [thickness, offset] = axes.sizes;
        let at = |side: f64| middle + thickness * (offset + side) * normal;
        ring.outer = [-0.5, 0.5].map(|s| add(at(s))).to_vec();
        if ends {
            ring.between.push((add(at(0.0)), [ring.outer[0], ring.outer[1]]));
        }
    }
    let share = -1.0 / ring.outer.len() as f64;
    for i in 0..3 {
        let mut terms = vec![(3 * node + i, 1.0)];
        terms.extend(ring.outer.iter().map(|n| (3 * n + i, share)));
        deck.equations.push(Equation { terms, value: 0.0, line: 0 });
    }
    // What CalculiX prints of a corner of a quadratic shell is the mean over its thickness.
    if let (false, [(between, [a, b])]) = (axes.of_beam, ring.between.as_slice()) {
        let mean = vec![(*a, 1.0 / 6.0), (*between, 4.0 / 6.0), (*b, 1.0 / 6.0)];
        deck.means.insert(node, mean);
        // Forces are shared as those of an even traction over the face of a C3D20 are.
        deck.shares.insert(node, vec![(*a, -0.5), (*between, 2.0), (*b, -0.5)]);
    }
    ring
}

/// Points of integration and the material and axes at each, where they are not those of the shape.
type Integration = (Vec<Point>, Vec<(u32, Option<u32>)>);

fn integration(thin: Thin, section: &Section) -> Integration {
    match &section.profile {
        Profile::Shell { layers, .. } if !layers.is_empty() => layered(thin.shape(), layers),
        Profile::Beam { size, hollow: Some(hollow), .. } => {
            let around = match *hollow {
                Hollow::Pipe(wall) => pipe(size[0], wall),
                Hollow::Box(wall) => walls(*size, wall),
            };
            let row = |&(x, w): &(f64, f64)| {
                around.iter().map(move |&([y, z], v)| ([x, y, z], w * v)).collect::<Vec<_>>()
            };
            (GAUSS_2.iter().flat_map(row).collect(), Vec::new())
        }
        _ => (Vec::new(), Vec::new()),
    }
}

/// The points of the shape, once in every layer.
fn layered(shape: Shape, layers: &[(f64, u32, Option<u32>)]) -> Integration {
    let whole: f64 = layers.iter().map(|l| l.0).sum();
    let (mut points, mut materials, mut below) = (Vec::new(), Vec::new(), 0.0);
    for &(thickness, material, axes) in layers {
        let share = thickness / whole;
        for ([x, y, z], weight) in shape.points() {
            let height = 2.0 * (below + 0.5 * (z + 1.0) * thickness) / whole - 1.0;
            points.push(([x, y, height], weight * share));
            materials.push((material, axes));
        }
        below += thickness;
    }
    (points, materials)
}

/// Eight points on the circle that has the tube's moment of inertia, in natural coordinates of the
/// square around it: ρ² = (R² + r²)/2.
fn pipe(diameter: f64, wall: f64) -> Vec<([f64; 2], f64)> {
    let inner = 1.0 - 2.0 * wall / diameter;
    let radius = (0.5 * (1.0 + inner * inner)).sqrt();
    let weight = PI * (1.0 - inner * inner) / 8.0;
    let point = |k: u32| {
        let (sin, cos) = (f64::from(k) * FRAC_PI_4).sin_cos();
        ([radius * cos, radius * sin], weight)
    };
    (0..8).map(point).collect()
}

/// Simpson's rule of five points along the middle of each of four walls.
fn walls([a, b]: [f64; 2], wall: f64) -> Vec<([f64; 2], f64)> {
    let (z, y) = (1.0 - wall / a, 1.0 - wall / b);
    let corners = [[y, z], [-y, z], [-y, -z], [y, -z]];
    // Natural area of a unit of length of a wall, by the wall that it is.
    let width = [2.0 * wall / a, 2.0 * wall / b];
    let weight = |k: usize, share: f64| {
        let (from, to) = (corners[k % 4], corners[(k + 1) % 4]);
        let length = (to[0] - from[0]).abs() + (to[1] - from[1]).abs();
        length * width[k % 2] * share / 12.0
    };
    let mut points = Vec::with_capacity(16);
    for k in 0..4 {
        let (from, to) = (corners[k], corners[(k + 1) % 4]);
        for (j, share) in [1.0, 4.0, 2.0, 4.0].into_iter().enumerate() {
            let at = |i: usize| from[i] + (to[i] - from[i]) * j as f64 / 4.0;
            // A corner belongs to two walls.
            let shared = if j == 0 { weight(k + 3, 1.0) } else { 0.0 };
            points.push(([at(0), at(1)], weight(k, share) + shared));
        }
    }
    points
}

/// Rings by node.
pub(super) type Rings = HashMap<u32, Ring>;
