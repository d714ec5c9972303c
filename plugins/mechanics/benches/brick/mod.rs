//! Eight-node bricks of linear elasticity (2 × 2 × 2 Gauss points, no remedy against locking) on
//! structured grids: something to solve, for tests and benches.

use std::sync::Arc;

/// A structured grid of bricks.
pub(crate) struct Bricks {
    /// Metres, x fastest.
    pub(crate) points: Vec<[f64; 3]>,
    /// Corners in VTK's order.
    pub(crate) cells: Vec<[u32; 8]>,
    /// Numbers of cells.
    pub(crate) size: [usize; 3],
}

impl Bricks {
    /// `size` cells, corners placed by `place` from the unit cube.
    pub(crate) fn new(size: [usize; 3], place: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        let [nx, ny, nz] = size;
        let id = |i, j, k| (i + (nx + 1) * (j + (ny + 1) * k)) as u32;
        let mut points = Vec::new();
        for k in 0..=nz {
            for j in 0..=ny {
                points.extend((0..=nx).map(|i| {
                    place([i as f64 / nx as f64, j as f64 / ny as f64, k as f64 / nz as f64])
                }));
            }
        }
        let corners =
            |i, j, k| [id(i, j, k), id(i + 1, j, k), id(i + 1, j + 1, k), id(i, j + 1, k)];
        let mut cells = Vec::new();
        for k in 0..nz {
            for j in 0..ny {
                for i in 0..nx {
                    let ([a, b, c, d], [e, f, g, h]) = (corners(i, j, k), corners(i, j, k + 1));
                    cells.push([a, b, c, d, e, f, g, h]);
                }
            }
        }
        Self { points, cells, size }
    }

    /// The quarter of a thick cylinder a = 1, b = 2, h = 1.
    pub(crate) fn cylinder(size: [usize; 3]) -> Self {
        Self::new(size, |[x, y, z]| {
            let (r, t) = (1.0 + x, y * std::f64::consts::FRAC_PI_2);
            [r * t.cos(), r * t.sin(), z]
        })
    }

    /// The unit cube.
    pub(crate) fn cube(n: usize) -> Self {
        Self::new([n; 3], |x| x)
    }

    /// Number of the node at grid indices.
    pub(crate) fn node(&self, i: usize, j: usize, k: usize) -> usize {
        i + (self.size[0] + 1) * (j + (self.size[1] + 1) * k)
    }

    /// Places and pattern.
    pub(crate) fn pattern(&self) -> (Arc<super::Pattern>, super::Connectivity) {
        let elements: super::Connectivity = self.cells.iter().collect();
        let places = self.points.iter().map(|&p| super::Place::point(p)).collect();
        (Arc::new(super::Pattern::new(places, &elements).expect("sound")), elements)
    }

    /// Stiffness with Young's modulus `e(cell)` (Pa) and ν = 0.2.
    pub(crate) fn stiffness(&self, e: impl Fn(usize) -> f64 + Sync) -> super::BlockMatrix<3> {
        let (pattern, elements) = self.pattern();
        let mut matrix = super::BlockMatrix::zeros(pattern);
        self.add_stiffness(&mut matrix, &elements, e);
        matrix
    }

    fn add_stiffness(
        &self,
        matrix: &mut super::BlockMatrix<3>,
        elements: &super::Connectivity,
        e: impl Fn(usize) -> f64 + Sync,
    ) {
        let fill = |c: usize, k: &mut [f64]| {
            brick(&self.cells[c].map(|n| self.points[n as usize]), e(c), 0.2, k);
            Ok::<_, super::SolveError>(())
        };
        matrix.assemble(elements, &intrados_stage::Job::default(), fill).expect("sound");
    }
}

/// K_ab = ∫ λ ∇a ⊗ ∇b + μ (∇b ⊗ ∇a + ∇a·∇b 1) dV
pub(crate) fn brick(x: &[[f64; 3]; 8], e: f64, nu: f64, k: &mut [f64]) {
    let (lambda, mu) = (e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)));
    let signs: [[f64; 3]; 8] =
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
            .map(|c| c.map(|b: i32| f64::from(2 * b - 1)));
    for point in signs.map(|s| s.map(|v| v / 3.0_f64.sqrt())) {
        let local: [[f64; 3]; 8] = signs.map(|s| {
            let f: [f64; 3] = std::array::from_fn(|i| 1.0 + s[i] * point[i]);
            [s[0] * f[1] * f[2] / 8.0, s[1] * f[0] * f[2] / 8.0, s[2] * f[0] * f[1] / 8.0]
        });
        let j = nalgebra::Matrix3::from_fn(|r, c| (0..8).map(|a| local[a][r] * x[a][c]).sum());
        let (dv, inverse) = (j.determinant(), j.try_inverse().expect("sound"));
        let grad: [[f64; 3]; 8] = local.map(|g| (inverse * nalgebra::Vector3::from(g)).into());
        for a in 0..8 {
            for b in 0..8 {
                let same: f64 = (0..3).map(|i| grad[a][i] * grad[b][i]).sum();
                for r in 0..3 {
                    for c in 0..3 {
                        let shear = mu * grad[b][r] * grad[a][c];
                        k[(3 * a + r) * 24 + 3 * b + c] += dv
                            * (lambda * grad[a][r] * grad[b][c]
                                + shear
                                + if r == c { mu * same } else { 0.0 });
                    }
                }
            }
        }
    }
}

/// The system of a mesh: matrix, right-hand side, constraints.
pub(crate) type Linear = (super::BlockMatrix<3>, Vec<f64>, super::Constraints<3>);

/// The quarter of a thick cylinder in plane strain under a pressure of 1 inside; E = 30 000, ν =
/// 0.2.
pub(crate) fn thick_cylinder(size: [usize; 3]) -> Linear {
    let bricks = Bricks::cylinder(size);
    let matrix = bricks.stiffness(|_| 3e4);
    let [nx, ny, nz] = size;
    let mut constraints = super::Constraints::new(matrix.nodes());
    let mut rhs = vec![0.0; matrix.unknowns()];
    for k in 0..=nz {
        for i in 0..=nx {
            constraints.fix(bricks.node(i, 0, k), 1, 0.0).expect("sound");
            constraints.fix(bricks.node(i, ny, k), 0, 0.0).expect("sound");
        }
    }
    for j in 0..=ny {
        for i in 0..=nx {
            constraints.fix(bricks.node(i, j, 0), 2, 0.0).expect("sound");
            constraints.fix(bricks.node(i, j, nz), 2, 0.0).expect("sound");
        }
    }
    // The face of a cell is flat: its chord times its height, normal to the chord, a quarter to
    // each corner.
    for k in 0..nz {
        for j in 0..ny {
            let corners =
                [(j, k), (j + 1, k), (j + 1, k + 1), (j, k + 1)].map(|(j, k)| bricks.node(0, j, k));
            let [a, b] = [corners[0], corners[1]].map(|n| bricks.points[n]);
            for n in corners {
                rhs[3 * n] += 0.25 * (b[1] - a[1]) / nz as f64;
                rhs[3 * n + 1] -= 0.25 * (b[0] - a[0]) / nz as f64;
            }
        }
    }
    (matrix, rhs, constraints)
}

/// A unit cube on its lower face, pushed down and aside on the upper one; `e` gives Young's modulus
/// of a cell.
pub(crate) fn pushed_cube(n: usize, e: impl Fn(usize) -> f64 + Sync) -> Linear {
    let bricks = Bricks::cube(n);
    let matrix = bricks.stiffness(e);
    let mut constraints = super::Constraints::new(matrix.nodes());
    let mut rhs = vec![0.0; matrix.unknowns()];
    for j in 0..=n {
        for i in 0..=n {
            constraints.fix_all(bricks.node(i, j, 0), [0.0; 3]).expect("sound");
            let top = bricks.node(i, j, n);
            (rhs[3 * top], rhs[3 * top + 2]) = (1e3, -2e3);
        }
    }
    (matrix, rhs, constraints)
}

/// A tendon's piece inside a cell: from the middle of the face y = 0 to that of y = 1, `k` = EA/L
/// (N/m).
fn tendon(x: &[[f64; 3]; 8], stiffness: f64, k: &mut [f64]) {
    let weights = [-0.25, -0.25, 0.25, 0.25, -0.25, -0.25, 0.25, 0.25];
    let along: [f64; 3] = std::array::from_fn(|c| (0..8).map(|a| weights[a] * x[a][c]).sum());
    let length = along.iter().map(|v| v * v).sum::<f64>().sqrt();
    let b: Vec<f64> = weights.iter().flat_map(|w| along.map(|t| w * t / length)).collect();
    for i in 0..24 {
        for j in 0..24 {
            k[24 * i + j] += stiffness * b[i] * b[j];
        }
    }
}

/// A lining in a quarter, 3 m inside: half a metre of concrete (30 GPa) in which zones and single
/// cells are damaged to 1e-5 of that, hoop tendons of eight strands that pass through them, a steel
/// shell of 20 mm (200 GPa) around it, and soft ground (30 MPa) of 3 m.
pub(crate) fn lining(n: usize) -> Linear {
    let (layers, around, along) = (12, n, n / 4);
    let radii = [3.0, 3.1, 3.2, 3.3, 3.4, 3.45, 3.5, 3.52, 3.7, 4.1, 4.7, 5.5, 6.5];
    let bricks = Bricks::new([layers, around, along], |[x, y, z]| {
        let (r, t) = (radii[(x * layers as f64).round() as usize], y * std::f64::consts::FRAC_PI_2);
        [r * t.cos(), r * t.sin(), 6.0 * z]
    });
    let indices = |c: usize| (c % layers, c / layers % around, c / layers / around);
    let modulus = |c: usize| {
        let (i, j, k) = indices(c);
        let chance = |seed, number: usize| {
            f64::from(intrados_stage::random::Key::new(seed, number as u64).unit(0))
        };
        let damaged = chance(3, c) < 0.05 || chance(4, i / 3 + 8 * (j / 5 + 1000 * (k / 5))) < 0.1;
        match i {
            6 => 2e11,
            7.. => 3e7,
            _ if damaged => 3e5,
            _ => 3e10,
        }
    };
    let (pattern, elements) = bricks.pattern();
    let mut matrix = super::BlockMatrix::zeros(pattern);
    bricks.add_stiffness(&mut matrix, &elements, modulus);
    let stressed: Vec<usize> = (0..bricks.cells.len())
        .filter(|&c| matches!(indices(c), (3, _, k) if k % 5 == 2))
        .collect();
    let hosts: super::Connectivity = stressed.iter().map(|&c| bricks.cells[c]).collect();
    let piece = |e: usize, k: &mut [f64]| {
        let x = bricks.cells[stressed[e]].map(|n| bricks.points[n as usize]);
        tendon(
            &x,
            1.95e11 * 8.0 * 140e-6 / (3.35 * std::f64::consts::FRAC_PI_2 / around as f64),
            k,
        );
        Ok::<_, super::SolveError>(())
    };
    matrix.assemble(&hosts, &intrados_stage::Job::default(), piece).expect("sound");
    let mut constraints = super::Constraints::new(matrix.nodes());
    let mut rhs = vec![0.0; matrix.unknowns()];
    for k in 0..=along {
        for i in 0..=layers {
            constraints.fix(bricks.node(i, 0, k), 1, 0.0).expect("sound");
            constraints.fix(bricks.node(i, around, k), 0, 0.0).expect("sound");
        }
        for j in 0..=around {
            constraints.fix_all(bricks.node(layers, j, k), [0.0; 3]).expect("sound");
            let (inner, t) =
                (bricks.node(0, j, k), j as f64 / around as f64 * std::f64::consts::FRAC_PI_2);
            (rhs[3 * inner], rhs[3 * inner + 1]) = (1e4 * t.cos(), 2e4 * t.sin());
        }
    }
    for j in 0..=around {
        (0..=layers).for_each(|i| constraints.fix(bricks.node(i, j, 0), 2, 0.0).expect("sound"));
    }
    (matrix, rhs, constraints)
}
