//! Beams and shells made solid as CalculiX makes them (user's manual, "Expansion of the
//! one-dimensional and two-dimensional elements"). Every node of the deck becomes a ring of nodes:
//! two or three along the normal of a shell, four or eight around the section of a beam. It moves
//! as the mean of the outer ones, and turns as their mean rotation. Nodes between outer ones stay
//! there where it is supported: of beams its angles, of shells its place. Where elements meet at an
//! angle or with other sections, their rings there are one stiff knot. Sections that are no rectangle
//! are one by where they are integrated.

use std::{
    collections::{BTreeMap, HashMap},
    f64::consts::{FRAC_1_SQRT_2, FRAC_PI_4, PI},
    mem::discriminant,
};

use glam::{DMat3, DVec3};
use nalgebra::{Matrix3, Vector3};

use super::{
    constraint::Equation,
    model::{Cell, Deck},
    read::{Kind, Reader, Section},
    shape::{GAUSS_2, Point, Shape, face_functions, face_places},
    turn::{body, terms, turn},
};
use crate::read::{
    Fault,
    abaqus::card::{Card, Row},
};

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
    /// How far the middle lies off the nodes along the normal, over the thickness.
    Shell { offset: f64 },
    /// Its 1-direction; its sizes along both, and how far the nodes lie off its middle over these.
    Beam { first: DVec3, size: [f64; 2], offset: [f64; 2], form: Form },
}

/// What is within the sizes of a section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Form {
    /// All of them.
    Full,
    /// An ellipse.
    Round,
    /// A tube of this thickness, m.
    Pipe(f64),
    /// Walls of these thicknesses, m: beyond the 1-direction, beyond the 2-direction, and the two
    /// opposite to them.
    Box([f64; 4]),
}

/// Nodes that a node of a beam or a shell becomes.
#[derive(Debug, Clone, Default)]
struct Ring {
    /// Those whose mean the node is.
    outer: Vec<u32>,
    /// Others, and the two that each lies between.
    between: Vec<(u32, [u32; 2])>,
    /// Components by which nodes between the outer ones are kept there.
    stiff: [bool; 3],
}

/// Rings of all nodes of beams and shells.
#[derive(Debug, Default)]
pub(super) struct Rings {
    all: Vec<Ring>,
    /// By element and place of the node in it.
    of: HashMap<(u32, usize), usize>,
    /// By node, where it has one alone.
    alone: HashMap<u32, usize>,
}

/// Axes of a node: normal of a shell; tangent and 1-direction of a beam; and sizes.
#[derive(Debug, Clone, Copy)]
struct Axes {
    /// None: of a shell.
    form: Option<Form>,
    first: DVec3,
    second: DVec3,
    sizes: [f64; 2],
    offset: [f64; 2],
    /// Whether the normal is that of a `*NORMAL`.
    given: bool,
    /// Whether there are nodes between the outer ones.
    ends: bool,
}

/// A node of an element, by its place there, and its axes.
#[derive(Debug, Clone, Copy)]
struct Corner {
    element: u32,
    place: usize,
    axes: Axes,
}

/// Angles up to which axes of neighbours are one, degrees: computed ones, and those that are given.
const ALIKE: [f64; 2] = [20.0, 0.5];
/// Spread of the nodes of a knot along an axis that counts as none, over the largest.
const NO_SPREAD: f64 = 1e-9;

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

    /// Whether there are nodes between the outer ones around this of its nodes.
    fn ends(self, place: usize) -> bool {
        let is_end = match self {
            Self::Beam { .. } => place != 1,
            Self::Shell { corners, .. } => place < corners,
        };
        is_end && self.shape().nodes() > 8
    }

    /// Axes at each of its nodes.
    fn axes(self, places: &[DVec3], section: &Section) -> Option<Vec<Axes>> {
        match (self, &section.profile) {
            (Self::Shell { .. }, Profile::Shell { offset }) => {
                let normal = |at: &[f64; 2]| {
                    let jets = face_functions(places.len(), *at);
                    let along = |i: usize| -> DVec3 {
                        jets.iter().zip(places).map(|(j, &p)| j.slope[i] * p).sum()
                    };
                    Some(Axes {
                        form: None,
                        first: along(0).cross(along(1)).try_normalize()?,
                        second: DVec3::ZERO,
                        sizes: [section.thickness, 0.0],
                        offset: [*offset, 0.0],
                        given: false,
                        ends: false,
                    })
                };
                face_places(places.len()).iter().map(normal).collect()
            }
            (Self::Beam { .. }, &Profile::Beam { first, size, offset, form }) => {
                let axes = |tangent: DVec3| {
                    let tangent = tangent.try_normalize()?;
                    Some(Axes {
                        form: Some(form),
                        first: first.reject_from_normalized(tangent).try_normalize()?,
                        second: tangent,
                        sizes: size,
                        offset,
                        given: false,
                        ends: false,
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
        let near =
            |a: DVec3, b: DVec3| a.dot(b) >= ALIKE[usize::from(self.given)].to_radians().cos();
        let kind = |axes: &Self| axes.form.as_ref().map(discriminant);
        kind(self) == kind(other)
            && self.sizes == other.sizes
            && self.offset == other.offset
            && near(self.first, other.first)
            && (self.form.is_none() || near(self.second, other.second))
    }

    /// The mean of such axes, whose first are those that others were compared with.
    fn mean(self, others: &[Corner]) -> Self {
        others.iter().map(|corner| corner.axes).fold(self, |sum, other| Self {
            first: if sum.given { sum.first } else { sum.first + other.first },
            second: sum.second + other.second,
            ends: sum.ends || other.ends,
            ..sum
        })
    }
}

impl Reader {
    /// `*NORMAL`: element, node, and the normal of the shell or the 2-direction of the beam there.
    pub(super) fn normal(&mut self, card: &Card<'_>) -> Result<(), Fault> {
        card.only(&[])?;
        for row in card.rows() {
            let [element, node, along @ ..] = row.exactly::<5>("element, node, x, y, z")?;
            let mut normal = DVec3::ZERO;
            for (i, word) in along.iter().enumerate() {
                normal[i] = row.number(word)?;
            }
            let normal =
                normal.try_normalize().ok_or_else(|| row.fault("a normal has a length"))?;
            let node = self.node(node, row)?;
            for element in self.some_elements(element, row)? {
                self.normals.insert((element, node), normal);
            }
        }
        Ok(())
    }

    /// Rings of all nodes of beams and shells: one where these go on smoothly with one section,
    /// several that are bound to each other where they do not.
    ///
    /// # Errors
    /// What has no axes.
    pub(super) fn ring(&mut self) -> Result<(), Fault> {
        for (node, mut corners) in self.corners()? {
            // As CalculiX goes: normals that are given first, then by the number of the element.
            corners.sort_by_key(|c| (!c.axes.given, self.raw[c.element as usize].label));
            let before = self.rings.all.len();
            let of_beams = corners.iter().any(|c| c.axes.form.is_some());
            let (mut means, each) = (Vec::new(), 1.0 / corners.len() as f64);
            while let Some(first) = corners.first().map(|c| c.axes) {
                let (own, others): (Vec<Corner>, Vec<Corner>) =
                    corners.into_iter().partition(|c| first.meets(&c.axes));
                let ring = make_ring(&mut self.deck, node, &first.mean(&own[1..]));
                let weight = each * own.len() as f64;
                means.extend(ring.mean().into_iter().map(|(n, share)| (n, weight * share)));
                let number = self.rings.all.len();
                self.rings.of.extend(own.iter().map(|c| ((c.element, c.place), number)));
                self.rings.all.push(ring);
                corners = others;
            }
            if self.rings.all.len() == before + 1 {
                hang(&mut self.deck, node, &self.rings.all[before]);
                self.rings.alone.insert(node, before);
            } else {
                // What CalculiX prints of a node is the mean over its elements.
                self.deck.means.insert(node, means);
                self.knot(node, before, of_beams);
            }
        }
        Ok(())
    }

    /// Nodes of beams and shells as their elements have them.
    fn corners(&self) -> Result<BTreeMap<u32, Vec<Corner>>, Fault> {
        let mut all: BTreeMap<u32, Vec<Corner>> = BTreeMap::new();
        for (element, raw) in (0..).zip(&self.raw) {
            let (Kind::Thin(thin), Some(section)) = (raw.kind, &raw.section) else { continue };
            let places: Vec<DVec3> =
                raw.nodes.iter().map(|&n| self.deck.nodes[n as usize]).collect();
            let why = "has no length, no normal, or a section of another kind of element";
            let axes = thin.axes(&places, section);
            let axes =
                axes.ok_or_else(|| Fault::at(raw.line, format!("element {} {why}", raw.label)))?;
            for (place, (&node, mut axes)) in raw.nodes.iter().zip(axes).enumerate() {
                axes.ends = thin.ends(place);
                if let Some(&normal) = self.normals.get(&(element, node)) {
                    axes.given = true;
                    let across = normal.cross(axes.second).try_normalize().unwrap_or(axes.first);
                    axes.first = if axes.form.is_some() { across } else { normal };
                }
                all.entry(node).or_default().push(Corner { element, place, axes });
            }
        }
        Ok(all)
    }

    /// Binds the rings from a number on to their node: they turn with it as one, and widen alike
    /// along all axes; where all lie in a plane and some are of beams, as they like in that plane
    /// (user's manual of CalculiX, "Arbitrary knot").
    fn knot(&mut self, node: u32, first: usize, of_beams: bool) {
        let around = |ring: &Ring| {
            let between: Vec<u32> = ring.between.iter().map(|b| b.0).collect();
            [ring.outer.as_slice(), &between].concat()
        };
        let nodes: Vec<u32> = self.rings.all[first..].iter().flat_map(around).collect();
        let places: Vec<DVec3> = nodes.iter().map(|&n| self.deck.nodes[n as usize]).collect();
        let (turning, stretch) = (self.hidden_node(node), self.hidden_node(node));
        let (axes, extent) = spread(&places);
        let widens = match extent {
            2 if of_beams => {
                let [a, b] = [axes[0], axes[1]];
                vec![dyad(a, a), dyad(b, b), dyad(a, b) + dyad(b, a)]
            }
            _ => vec![DMat3::IDENTITY],
        };
        let widens: Vec<(u32, DMat3)> = (3 * stretch..).zip(widens).collect();
        self.turning.insert(node, turning);
        let equations = body(&self.deck.nodes, [node, turning], &nodes, &widens);
        self.deck.equations.extend(equations);
        if extent == 1 {
            // What lies on a line says nothing of turning about it.
            let terms = terms(&[(turning, axes[0])]);
            self.deck.equations.push(Equation { terms, value: 0.0, line: 0 });
        }
    }

    /// The hidden node whose components are the angles of a node of a beam or a shell.
    pub(super) fn angles(
        &mut self,
        node: u32,
        supported: Option<u32>,
        row: Row<'_>,
    ) -> Option<u32> {
        let number = *self.rings.alone.get(&node)?;
        let ring = self.rings.all[number].clone();
        if let (Some(step), [false, ..], 4) = (supported, ring.stiff, ring.outer.len()) {
            for (middle, [a, b]) in &ring.between {
                for i in 0..3 {
                    let terms = vec![(3 * middle + i, 1.0), (3 * a + i, -0.5), (3 * b + i, -0.5)];
                    self.deck.later.push((step, Equation { terms, value: 0.0, line: row.line }));
                }
            }
            self.rings.all[number].stiff = [true; 3];
        }
        if let Some(&turning) = self.turning.get(&node) {
            return Some(turning);
        }
        let turning = self.hidden_node(node);
        // About the node's own axes: mean angles are not a vector.
        let own = self.deck.turned.get(&node).map(|frame| frame.map(DVec3::from_array));
        for (i, axis) in (0..).zip(own.unwrap_or(DVec3::AXES)) {
            // Two nodes along an axis say nothing of a turn about it.
            let equation = turn(&self.deck.nodes, &ring.outer, axis, 3 * turning + i, row.line);
            self.deck.equations.extend(equation);
        }
        self.turning.insert(node, turning);
        Some(turning)
    }

    /// What supports the corner of a quadratic shell supports its middle as well.
    pub(super) fn supported(&mut self, (node, component): (u32, u8), step: u32, line: u32) {
        let Some(&number) = self.rings.alone.get(&node) else { return };
        let ring = &mut self.rings.all[number];
        let &[(middle, _)] = ring.between.as_slice() else { return };
        if std::mem::replace(&mut ring.stiff[usize::from(component)], true) {
            return;
        }
        let own = self.deck.component(node, component);
        let both = |&(u, f): &(u32, f64)| [(3 * middle + u % 3, f), (u, -f)];
        let terms = own.iter().flat_map(both).collect();
        self.deck.later.push((step, Equation { terms, value: 0.0, line }));
    }

    /// The solid that a beam or a shell becomes.
    pub(super) fn thickened(&self, element: u32, thin: Thin, section: &Section) -> Cell {
        let raw = &self.raw[element as usize];
        let ring = |place| self.rings.of.get(&(element, place)).map(|&n| &self.rings.all[n]);
        let rings: Vec<&Ring> = (0..raw.nodes.len()).filter_map(ring).collect();
        Cell {
            label: raw.label,
            shape: thin.shape(),
            nodes: thin.solid(&rings),
            material: section.material,
            orientation: section.orientation,
            across: 0.0,
            points: integration(section),
        }
    }
}

/// The nodes around a node.
fn make_ring(deck: &mut Deck, node: u32, axes: &Axes) -> Ring {
    let middle = deck.nodes[node as usize];
    let mut add = |place: DVec3| {
        let number = deck.nodes.len() as u32;
        deck.nodes.push(place);
        deck.twins.insert(number, node);
        number
    };
    let mut ring = Ring::default();
    let (sizes, offset) = (axes.sizes, axes.offset);
    let Some(form) = axes.form else {
        let normal = axes.first.normalize_or_zero();
        let at = |side: f64| middle + sizes[0] * (offset[0] + side) * normal;
        ring.outer = [-0.5, 0.5].map(|s| add(at(s))).to_vec();
        if axes.ends {
            ring.between.push((add(at(0.0)), [ring.outer[0], ring.outer[1]]));
        }
        return ring;
    };
    let tangent = axes.second.normalize_or_zero();
    let first = axes.first.reject_from_normalized(tangent).normalize_or_zero();
    let second = tangent.cross(first);
    let at = |[a, b]: [f64; 2]| {
        middle + (a - offset[0]) * sizes[0] * first + (b - offset[1]) * sizes[1] * second
    };
    // Corners of an ellipse lie on it.
    let half = if form == Form::Round { 0.5 * FRAC_1_SQRT_2 } else { 0.5 };
    let corners = [[-half, half], [-half, -half], [half, -half], [half, half]];
    ring.outer = corners.map(|c| add(at(c))).to_vec();
    if axes.ends {
        let edges = [[-0.5, 0.0], [0.0, -0.5], [0.5, 0.0], [0.0, 0.5]];
        for (i, edge) in edges.into_iter().enumerate() {
            ring.between.push((add(at(edge)), [ring.outer[i], ring.outer[(i + 1) % 4]]));
        }
    }
    ring
}

/// Makes a node the mean of those around it.
fn hang(deck: &mut Deck, node: u32, ring: &Ring) {
    let share = -1.0 / ring.outer.len() as f64;
    for i in 0..3 {
        let mut terms = vec![(3 * node + i, 1.0)];
        terms.extend(ring.outer.iter().map(|n| (3 * n + i, share)));
        deck.equations.push(Equation { terms, value: 0.0, line: 0 });
    }
    if let [(between, [a, b])] = ring.between.as_slice() {
        deck.means.insert(node, ring.mean());
        // Forces are shared as those of an even traction over the face of a C3D20 are.
        deck.shares.insert(node, vec![(*a, -0.5), (*between, 2.0), (*b, -0.5)]);
    }
}

impl Ring {
    /// What CalculiX prints: the mean of the outer nodes; of the corner of a quadratic shell, that
    /// over its thickness.
    fn mean(&self) -> Vec<(u32, f64)> {
        match self.between.as_slice() {
            [(between, [a, b])] => vec![(*a, 1.0 / 6.0), (*between, 4.0 / 6.0), (*b, 1.0 / 6.0)],
            _ => self.outer.iter().map(|&n| (n, 1.0 / self.outer.len() as f64)).collect(),
        }
    }
}

/// Main axes of a cloud of places, the widest first, and along how many of them it has an extent.
fn spread(places: &[DVec3]) -> ([DVec3; 3], usize) {
    let middle = places.iter().sum::<DVec3>() / places.len() as f64;
    let mut moments = Matrix3::zeros();
    for &place in places {
        let arm = Vector3::from((place - middle).to_array());
        moments += arm * arm.transpose();
    }
    let eigen = moments.symmetric_eigen();
    let mut order = [0usize, 1, 2];
    order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
    let least = NO_SPREAD * eigen.eigenvalues[order[0]];
    let extent = order.iter().filter(|&&i| eigen.eigenvalues[i] > least).count();
    let axis = |i: usize| DVec3::from_array(eigen.eigenvectors.column(i).into_owned().into());
    (order.map(axis), extent)
}

/// a bᵀ
fn dyad(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(b.x * a, b.y * a, b.z * a)
}

/// Points of integration, where they are not those of the shape.
fn integration(section: &Section) -> Vec<Point> {
    let Profile::Beam { size, form, .. } = section.profile else { return Vec::new() };
    let around = match form {
        Form::Box(thick) => walls(size, thick),
        Form::Pipe(wall) => pipe(size[0], wall),
        Form::Full | Form::Round => return Vec::new(),
    };
    let row = |&(x, w): &(f64, f64)| {
        around.iter().map(move |&([y, z], v)| ([x, y, z], w * v)).collect::<Vec<_>>()
    };
    GAUSS_2.iter().flat_map(row).collect()
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
fn walls([a, b]: [f64; 2], thick: [f64; 4]) -> Vec<([f64; 2], f64)> {
    let across = [a, b, a, b];
    let [up, left, down, right]: [f64; 4] = std::array::from_fn(|k| 1.0 - thick[k] / across[k]);
    let corners = [[right, up], [-left, up], [-left, -down], [right, -down]];
    // Natural area of a wall's share.
    let weight = |k: usize, share: f64| {
        let (from, to) = (corners[k % 4], corners[(k + 1) % 4]);
        let length = (to[0] - from[0]).abs() + (to[1] - from[1]).abs();
        length * 2.0 * thick[k % 4] / across[k % 4] * share / 12.0
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
