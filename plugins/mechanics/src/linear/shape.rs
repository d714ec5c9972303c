//! Shapes of solid elements: functions, faces and points of integration, numbered as Abaqus and
//! CalculiX number them (Zienkiewicz and Taylor, *The Finite Element Method*, vol. 1, ch. 4).

use std::ops::{Add, Mul, Sub};

/// What a solid element is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    /// C3D8.
    Hex8,
    /// C3D8I: as [`Shape::Hex8`] with bubbles that let it bend.
    Hex8Bubbles,
    /// C3D8R: as [`Shape::Hex8`] with the mean strain of its volume.
    Hex8Mean,
    /// C3D20.
    Hex20,
    /// C3D20R: as [`Shape::Hex20`] with eight points.
    Hex20Reduced,
    /// C3D4.
    Tet4,
    /// C3D10.
    Tet10,
    /// C3D6.
    Wedge6,
    /// C3D15.
    Wedge15,
    /// T3D2: a bar between two nodes.
    Bar,
}

/// A value with its derivatives by the three natural coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Jet {
    pub(super) value: f64,
    pub(super) slope: [f64; 3],
}

/// A point of integration: natural coordinates and weight.
pub(super) type Point = ([f64; 3], f64);

impl Jet {
    fn of(value: f64) -> Self {
        Self { value, slope: [0.0; 3] }
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            slope: std::array::from_fn(|i| self.slope[i] + other.slope[i]),
        }
    }
}

impl Mul for Jet {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        // By the product rule.
        let slope =
            |i: usize| [self.slope[i] * other.value, self.value * other.slope[i]].iter().sum();
        Self { value: self.value * other.value, slope: std::array::from_fn(slope) }
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    fn mul(self, s: f64) -> Self {
        Self { value: self.value * s, slope: self.slope.map(|d| d * s) }
    }
}

impl Add<f64> for Jet {
    type Output = Self;
    fn add(self, s: f64) -> Self {
        Self { value: self.value + s, slope: self.slope }
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + other * -1.0
    }
}

/// ξ, η, ζ as jets.
fn coordinates(at: [f64; 3]) -> [Jet; 3] {
    std::array::from_fn(|i| {
        let mut slope = [0.0; 3];
        slope[i] = 1.0;
        Jet { value: at[i], slope }
    })
}

/// Natural coordinates of the nodes of a brick: corners, then the middles of edges.
const BRICK: [[f64; 3]; 20] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
    [0.0, -1.0, -1.0],
    [1.0, 0.0, -1.0],
    [0.0, 1.0, -1.0],
    [-1.0, 0.0, -1.0],
    [0.0, -1.0, 1.0],
    [1.0, 0.0, 1.0],
    [0.0, 1.0, 1.0],
    [-1.0, 0.0, 1.0],
    [-1.0, -1.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
];

/// Faces of a brick, counterclockwise from outside, corners first.
const BRICK_FACES: [&[usize]; 6] = [
    &[3, 2, 1, 0, 10, 9, 8, 11],
    &[4, 5, 6, 7, 12, 13, 14, 15],
    &[0, 1, 5, 4, 8, 17, 12, 16],
    &[1, 2, 6, 5, 9, 18, 13, 17],
    &[2, 3, 7, 6, 10, 19, 14, 18],
    &[3, 0, 4, 7, 11, 16, 15, 19],
];

/// Faces of a tetrahedron.
const TET_FACES: [&[usize]; 4] =
    [&[0, 2, 1, 6, 5, 4], &[0, 1, 3, 4, 8, 7], &[1, 2, 3, 5, 9, 8], &[0, 3, 2, 7, 9, 6]];

/// Faces of a wedge.
const WEDGE_FACES: [&[usize]; 5] = [
    &[0, 2, 1, 8, 7, 6],
    &[3, 4, 5, 9, 10, 11],
    &[0, 1, 4, 3, 6, 13, 9, 12],
    &[1, 2, 5, 4, 7, 14, 10, 13],
    &[2, 0, 3, 5, 8, 12, 11, 14],
];

/// Edges of a tetrahedron in the order of their middle nodes.
const TET_EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
/// Edges of a triangle in the order of their middle nodes.
const TRIANGLE_EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// Gauss' points and weights on −1 … 1.
pub(super) const GAUSS_2: [(f64, f64); 2] =
    [(-0.577_350_269_189_625_8, 1.0), (0.577_350_269_189_625_8, 1.0)];
const GAUSS_3: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];
/// Three points of a triangle of area ½.
const TRIANGLE_3: [([f64; 2], f64); 3] = [
    ([1.0 / 6.0, 1.0 / 6.0], 1.0 / 6.0),
    ([2.0 / 3.0, 1.0 / 6.0], 1.0 / 6.0),
    ([1.0 / 6.0, 2.0 / 3.0], 1.0 / 6.0),
];
const TRIANGLE_1: [([f64; 2], f64); 1] = [([1.0 / 3.0, 1.0 / 3.0], 0.5)];

impl Shape {
    /// How many nodes it has.
    pub(super) fn nodes(self) -> usize {
        match self {
            Self::Bar => 2,
            Self::Hex8 | Self::Hex8Bubbles | Self::Hex8Mean => 8,
            Self::Hex20 | Self::Hex20Reduced => 20,
            Self::Tet4 => 4,
            Self::Tet10 => 10,
            Self::Wedge6 => 6,
            Self::Wedge15 => 15,
        }
    }

    /// VTK's number for cells of its nodes, which has them in the same order.
    pub(super) fn vtk(self) -> u8 {
        match self {
            Self::Bar => 3,
            Self::Hex8 | Self::Hex8Bubbles | Self::Hex8Mean => 12,
            Self::Hex20 | Self::Hex20Reduced => 25,
            Self::Tet4 => 10,
            Self::Tet10 => 24,
            Self::Wedge6 => 13,
            Self::Wedge15 => 26,
        }
    }

    /// Its functions there, one a node.
    pub(super) fn functions(self, at: [f64; 3]) -> Vec<Jet> {
        let x = coordinates(at);
        match self {
            Self::Bar => vec![(Jet::of(1.0) - x[0]) * 0.5, (x[0] + 1.0) * 0.5],
            Self::Hex8 | Self::Hex8Bubbles | Self::Hex8Mean => {
                BRICK[..8].iter().map(|n| corner(x, *n) * 0.125).collect()
            }
            Self::Hex20 | Self::Hex20Reduced => BRICK.iter().map(|n| serendipity(x, *n)).collect(),
            Self::Tet4 | Self::Tet10 => {
                let l = [Jet::of(1.0) - x[0] - x[1] - x[2], x[0], x[1], x[2]];
                if self == Self::Tet4 { l.to_vec() } else { quadratic(&l, &TET_EDGES) }
            }
            Self::Wedge6 | Self::Wedge15 => wedge(x, self == Self::Wedge15),
        }
    }

    /// Points of integration over its volume, in the order in which stresses are given.
    pub(super) fn points(self) -> Vec<Point> {
        match self {
            Self::Bar => vec![([0.0; 3], 2.0)],
            Self::Hex8Mean => vec![([0.0; 3], 8.0)],
            Self::Hex8 | Self::Hex8Bubbles | Self::Hex20Reduced => cube(&GAUSS_2),
            Self::Hex20 => cube(&GAUSS_3),
            Self::Tet4 => vec![([0.25; 3], 1.0 / 6.0)],
            Self::Tet10 => {
                // (5 ± √5)/20 (Hammer and Stroud 1956).
                let (near, far) = ((5.0 - 5f64.sqrt()) / 20.0, (5.0 + 3.0 * 5f64.sqrt()) / 20.0);
                let place = |k: usize| std::array::from_fn(|i| if i + 1 == k { far } else { near });
                (0..4).map(|k| (place(k), 1.0 / 24.0)).collect()
            }
            Self::Wedge6 => prism(&TRIANGLE_1, &GAUSS_2),
            Self::Wedge15 => prism(&TRIANGLE_3, &GAUSS_3),
        }
    }

    /// Points for masses and stored heat: they integrate the square of its functions where it is
    /// not distorted, but for C3D8R and C3D20R, which CalculiX weighs at the points of their
    /// stiffness.
    pub(super) fn fine_points(self) -> Vec<Point> {
        match self {
            Self::Bar => GAUSS_2.iter().map(|&(a, w)| ([a, 0.0, 0.0], w)).collect(),
            Self::Hex8Mean => self.points(),
            Self::Hex8 | Self::Hex8Bubbles | Self::Hex20Reduced => cube(&GAUSS_2),
            Self::Hex20 => cube(&GAUSS_3),
            Self::Tet4 => Self::Tet10.points(),
            Self::Tet10 => keast(),
            Self::Wedge6 => prism(&TRIANGLE_3, &GAUSS_2),
            Self::Wedge15 => prism(&radon(), &GAUSS_3),
        }
    }

    /// Nodes of each of its faces, counterclockwise from outside, corners first.
    pub(super) fn faces(self) -> impl ExactSizeIterator<Item = &'static [usize]> {
        let (all, quadratic): (&'static [&'static [usize]], bool) = match self {
            Self::Bar => (&[], false),
            Self::Hex8 | Self::Hex8Bubbles | Self::Hex8Mean => (&BRICK_FACES, false),
            Self::Hex20 | Self::Hex20Reduced => (&BRICK_FACES, true),
            Self::Tet4 => (&TET_FACES, false),
            Self::Tet10 => (&TET_FACES, true),
            Self::Wedge6 => (&WEDGE_FACES, false),
            Self::Wedge15 => (&WEDGE_FACES, true),
        };
        all.iter().map(move |f| if quadratic { f } else { &f[..f.len() / 2] })
    }

    /// Points of integration over a face of so many nodes: CalculiX' choice.
    pub(super) fn face_points(self, nodes: usize) -> Vec<([f64; 2], f64)> {
        let square = |g: &[(f64, f64)]| {
            let row = |&(b, v): &(f64, f64)| g.iter().map(move |&(a, w)| ([a, b], w * v));
            g.iter().flat_map(row).collect()
        };
        match (self, nodes) {
            (_, 3) => TRIANGLE_1.to_vec(),
            (_, 6) => TRIANGLE_3.to_vec(),
            (Self::Wedge6 | Self::Hex8Mean, _) => vec![([0.0; 2], 4.0)],
            (Self::Hex20, _) => square(&GAUSS_3),
            _ => square(&GAUSS_2),
        }
    }
}

/// Functions of a face of 3, 4, 6 or 8 nodes.
pub(super) fn face_functions(nodes: usize, at: [f64; 2]) -> Vec<Jet> {
    let x = coordinates([at[0], at[1], 0.0]);
    let l = [Jet::of(1.0) - x[0] - x[1], x[0], x[1]];
    match nodes {
        3 => l.to_vec(),
        6 => quadratic(&l, &TRIANGLE_EDGES),
        4 => BRICK[..4].iter().map(|n| flat_corner(x, *n) * 0.25).collect(),
        _ => BRICK[..4].iter().chain(&BRICK[8..12]).map(|n| flat_serendipity(x, *n)).collect(),
    }
}

/// Natural coordinates of the nodes of a face of 3, 4, 6 or 8 nodes.
pub(super) fn face_places(nodes: usize) -> Vec<[f64; 2]> {
    let corners = if nodes.is_multiple_of(3) {
        vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
    } else {
        BRICK[..4].iter().map(|n| [n[0], n[1]]).collect()
    };
    let n = corners.len();
    let middle = |i: usize| {
        let (a, b) = (corners[i], corners[(i + 1) % n]);
        [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]
    };
    let middles: Vec<[f64; 2]> = (0..n).map(middle).collect();
    corners.into_iter().chain(middles).take(nodes).collect()
}

/// 1 + aξ where the node lies at a; 1 − ξ² in the middle of an edge.
fn along(x: Jet, a: f64) -> Jet {
    if a == 0.0 { Jet::of(1.0) - x * x } else { x * a + 1.0 }
}

fn corner(x: [Jet; 3], n: [f64; 3]) -> Jet {
    along(x[0], n[0]) * along(x[1], n[1]) * along(x[2], n[2])
}

fn serendipity(x: [Jet; 3], n: [f64; 3]) -> Jet {
    if n.contains(&0.0) {
        corner(x, n) * 0.25
    } else {
        corner(x, n) * (x[0] * n[0] + x[1] * n[1] + x[2] * n[2] + -2.0) * 0.125
    }
}

fn flat_corner(x: [Jet; 3], n: [f64; 3]) -> Jet {
    along(x[0], n[0]) * along(x[1], n[1])
}

fn flat_serendipity(x: [Jet; 3], n: [f64; 3]) -> Jet {
    if n[..2].contains(&0.0) {
        flat_corner(x, n) * 0.5
    } else {
        flat_corner(x, n) * (x[0] * n[0] + x[1] * n[1] + -1.0) * 0.25
    }
}

/// Corners L(2L − 1), middles of edges 4 LᵢLⱼ.
fn quadratic(l: &[Jet], edges: &[[usize; 2]]) -> Vec<Jet> {
    let corners = l.iter().map(|&l| l * (l * 2.0 + -1.0));
    corners.chain(edges.iter().map(|&[a, b]| l[a] * l[b] * 4.0)).collect()
}

fn wedge(x: [Jet; 3], middles: bool) -> Vec<Jet> {
    let l = [Jet::of(1.0) - x[0] - x[1], x[0], x[1]];
    let z = x[2];
    let level = |side: f64| z * side + 1.0;
    let mut all = Vec::with_capacity(15);
    for side in [-1.0, 1.0] {
        all.extend(l.iter().map(|&l| {
            let linear = l * level(side) * 0.5;
            if middles { linear * (l * 2.0 + z * side + -2.0) } else { linear }
        }));
    }
    if middles {
        for side in [-1.0, 1.0] {
            let edge = |&[a, b]: &[usize; 2]| l[a] * l[b] * level(side) * 2.0;
            all.extend(TRIANGLE_EDGES.iter().map(edge));
        }
        all.extend(l.iter().map(|&l| l * along(z, 0.0)));
    }
    all
}

/// Points of a brick, ξ fastest.
fn cube(g: &[(f64, f64)]) -> Vec<Point> {
    let mut points = Vec::with_capacity(g.len().pow(3));
    for &(c, w) in g {
        for &(b, v) in g {
            points.extend(g.iter().map(|&(a, u)| ([a, b, c], u * v * w)));
        }
    }
    points
}

/// Fifteen points of a tetrahedron, exact to the fifth degree (Keast 1986).
fn keast() -> Vec<Point> {
    let root = 15f64.sqrt();
    let at = |l: [f64; 4], weight: f64| ([l[1], l[2], l[3]], weight / 6.0);
    let mut points = vec![at([0.25; 4], 16.0 / 135.0)];
    for sign in [-1.0, 1.0] {
        let near = (7.0 + sign * root) / 34.0;
        let weight = (2665.0 - sign * 14.0 * root) / 37800.0;
        let corner = |k| std::array::from_fn(|i| if i == k { 1.0 - 3.0 * near } else { near });
        points.extend((0..4).map(|k| at(corner(k), weight)));
    }
    let (near, far) = ((5.0 - root) / 20.0, (5.0 + root) / 20.0);
    let edge = |e: &[usize; 2]| std::array::from_fn(|i| if e.contains(&i) { far } else { near });
    points.extend(TET_EDGES.iter().map(|e| at(edge(e), 10.0 / 189.0)));
    points
}

/// Seven points of a triangle of area ½, exact to the fifth degree (Radon 1948).
fn radon() -> Vec<([f64; 2], f64)> {
    let root = 15f64.sqrt();
    let mut points = vec![([1.0 / 3.0; 2], 9.0 / 80.0)];
    for sign in [-1.0, 1.0] {
        let near = (6.0 + sign * root) / 21.0;
        let weight = (155.0 + sign * root) / 2400.0;
        let far = 1.0 - 2.0 * near;
        points.extend([[near, near], [far, near], [near, far]].map(|at| (at, weight)));
    }
    points
}

fn prism(triangle: &[([f64; 2], f64)], g: &[(f64, f64)]) -> Vec<Point> {
    let layer = |&(c, w): &(f64, f64)| triangle.iter().map(move |&([a, b], v)| ([a, b, c], v * w));
    g.iter().flat_map(layer).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Shape; 10] = [
        Shape::Bar,
        Shape::Hex8,
        Shape::Hex8Bubbles,
        Shape::Hex8Mean,
        Shape::Hex20,
        Shape::Hex20Reduced,
        Shape::Tet4,
        Shape::Tet10,
        Shape::Wedge6,
        Shape::Wedge15,
    ];

    #[test]
    fn functions_sum_to_one_and_their_slopes_are_those_of_differences() {
        for shape in ALL {
            let at = [0.21, 0.33, 0.17];
            let here = shape.functions(at);
            assert_eq!(here.len(), shape.nodes());
            assert!((here.iter().map(|j| j.value).sum::<f64>() - 1.0).abs() < 1e-14);
            for axis in 0..3 {
                let moved = |d: f64| {
                    let mut at = at;
                    at[axis] += d;
                    shape.functions(at)
                };
                for (j, (up, down)) in here.iter().zip(moved(1e-5).iter().zip(&moved(-1e-5))) {
                    let slope = (up.value - down.value) / 2e-5;
                    assert!((j.slope[axis] - slope).abs() < 1e-9, "{shape:?}");
                }
            }
        }
    }

    #[test]
    fn points_fill_the_volume_and_faces_look_outward() {
        for shape in ALL {
            let volume: f64 = shape.points().iter().map(|p| p.1).sum();
            let expected = match shape {
                Shape::Tet4 | Shape::Tet10 => 1.0 / 6.0,
                Shape::Wedge6 | Shape::Wedge15 => 1.0,
                Shape::Bar => 2.0,
                _ => 8.0,
            };
            assert!((volume - expected).abs() < 1e-14, "{shape:?}");
            // ∫ N Nᵀ of the square of a function, by points of another rule: x⁴ is of its degree.
            let is_fine = shape.nodes() > 8 && shape != Shape::Hex20Reduced;
            let degree = match shape {
                Shape::Hex8Mean => 0,
                _ if is_fine => 4,
                _ => 2,
            };
            let power: f64 = shape.fine_points().iter().map(|p| p.1 * p.0[0].powi(degree)).sum();
            let exact = match (shape, degree) {
                (Shape::Tet4, _) => 2.0 / 120.0,
                (Shape::Tet10, _) => 24.0 / 5040.0,
                (Shape::Wedge6, _) => 4.0 / 24.0,
                (Shape::Wedge15, _) => 48.0 / 720.0,
                (Shape::Bar, _) => 2.0 / 3.0,
                (_, 0) => 8.0,
                (_, 2) => 8.0 / 3.0,
                _ => 8.0 / 5.0,
            };
            assert!((power - exact).abs() < 1e-14, "{shape:?}: {power}");
            for face in shape.faces() {
                let area: f64 = shape.face_points(face.len()).iter().map(|p| p.1).sum();
                let triangle = face.len() % 3 == 0;
                assert!((area - if triangle { 0.5 } else { 4.0 }).abs() < 1e-14);
                for (i, at) in face_places(face.len()).into_iter().enumerate() {
                    let own = face_functions(face.len(), at);
                    assert!((own[i].value - 1.0).abs() < 1e-14);
                }
                let sum: f64 = face_functions(face.len(), [0.2, 0.3]).iter().map(|j| j.value).sum();
                assert!((sum - 1.0).abs() < 1e-14);
            }
        }
    }
}
