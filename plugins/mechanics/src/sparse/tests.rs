//! Against dense solutions, against themselves on other numbers of threads, and against what must be refused.

use intrados_stage::{Job, random::Key};
use nalgebra::{DMatrix, DVector};

use super::{brick::Bricks, *};

const METHODS: [Method; 3] = [Method::Jacobi, Method::Multigrid, Method::Direct];

/// A cube whose lower face is held at nought and whose upper face is pushed; E varies from cell to cell.
fn cube(n: usize) -> (BlockMatrix<3>, Vec<f64>, Constraints<3>) {
    let bricks = Bricks::cube(n);
    let matrix = bricks.stiffness(|c| 1e10 * (1.0 + random(c as u64, 0)));
    let mut constraints = Constraints::new(matrix.nodes());
    let mut rhs = vec![0.0; matrix.unknowns()];
    for j in 0..=n {
        for i in 0..=n {
            constraints.fix_all(bricks.node(i, j, 0), [0.0; 3]).unwrap();
            rhs[3 * bricks.node(i, j, n)] = 1e3;
            rhs[3 * bricks.node(i, j, n) + 2] = -2e3;
        }
    }
    (matrix, rhs, constraints)
}

fn random(walk: u64, dimension: u32) -> f64 {
    Key::new(7, walk).unit64(dimension)
}

fn dense<const B: usize>(matrix: &BlockMatrix<B>) -> DMatrix<f64> {
    DMatrix::from_fn(matrix.unknowns(), matrix.unknowns(), |i, j| matrix.block(i / B, j / B).map_or(0.0, |b| b[i % B][j % B]))
}

/// Solves with multipliers for the constraints nᵀu = v, given as (node, n, v).
fn with_multipliers(matrix: &BlockMatrix<3>, rhs: &[f64], held: &[(usize, [f64; 3], f64)]) -> Vec<f64> {
    let (k, n, m) = (dense(matrix), matrix.unknowns(), held.len());
    let mut full = DMatrix::zeros(n + m, n + m);
    // The multipliers are scaled to the stiffness, for the pivots' sake.
    let scale = k.diagonal().max();
    full.view_mut((0, 0), (n, n)).copy_from(&k);
    let mut f = DVector::zeros(n + m);
    f.rows_mut(0, n).copy_from_slice(rhs);
    for (l, (node, direction, value)) in held.iter().enumerate() {
        for c in 0..3 {
            full[(n + l, 3 * node + c)] = scale * direction[c];
            full[(3 * node + c, n + l)] = scale * direction[c];
        }
        f[n + l] = scale * value;
    }
    full.lu().solve(&f).unwrap().rows(0, n).iter().copied().collect()
}

fn difference(a: &[f64], b: &[f64]) -> f64 {
    let largest = b.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    a.iter().zip(b).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs())) / largest
}

#[test]
fn assembly_is_the_sum_over_elements_and_symmetric() {
    let bricks = Bricks::cylinder([2, 3, 2]);
    let matrix = bricks.stiffness(|c| 1.0 + c as f64);
    let mut expected = DMatrix::zeros(matrix.unknowns(), matrix.unknowns());
    for (c, cell) in bricks.cells.iter().enumerate() {
        let mut k = vec![0.0; 24 * 24];
        brick::brick(&cell.map(|n| bricks.points[n as usize]), 1.0 + c as f64, 0.2, &mut k);
        for i in 0..24 {
            for j in 0..24 {
                expected[(3 * cell[i / 3] as usize + i % 3, 3 * cell[j / 3] as usize + j % 3)] += k[24 * i + j];
            }
        }
    }
    let ours = dense(&matrix);
    assert!((&ours - &expected).amax() <= 1e-15 * expected.amax());
    assert!((&ours - ours.transpose()).amax() <= 1e-14 * expected.amax());
}

#[test]
fn elements_of_any_length_and_repeated_nodes_add_up() {
    let elements: Connectivity = [vec![0, 1], vec![1, 2, 3], vec![2, 2]].into_iter().collect();
    let places = vec![Place::point([0.0; 3]); 4];
    let mut matrix = BlockMatrix::<1>::zeros(Pattern::new(places, &elements).unwrap().into());
    let mut forces = vec![0.0; 4];
    let fill = |e: usize, k: &mut [f64], f: &mut [f64]| {
        k.fill(1.0 + e as f64);
        f.fill(10.0);
        Ok::<_, SolveError>(())
    };
    matrix.assemble_with(&elements, &mut forces, &Job::default(), fill).unwrap();
    assert_eq!(forces, [10.0, 20.0, 30.0, 10.0]);
    assert_eq!(matrix.block(1, 1), Some(&[[3.0]]));
    assert_eq!(matrix.block(2, 2), Some(&[[2.0 + 4.0 * 3.0]]));
    assert_eq!(matrix.block(0, 2), None);
    matrix.clear();
    assert_eq!(matrix.block(1, 1), Some(&[[0.0]]));
    let mut again = vec![0.0; 4];
    assemble_vector::<1, SolveError>(&elements, &mut again, &Job::default(), |_, f| Ok(f.fill(10.0))).unwrap();
    assert_eq!(again, forces);
}

#[test]
fn every_method_gives_the_dense_solution() {
    let (matrix, rhs, _) = cube(3);
    // Rollers on a skew plane, a prescribed lift, and a node held twice without contradiction.
    let mut held = Vec::new();
    for node in 0..16 {
        held.push((node, [0.0, 0.0, 1.0], 1e-6 * node as f64));
    }
    held.extend([(0, [1.0, 1.0, 0.0], 2e-6), (0, [1.0, 0.0, 0.0], 0.0), (3, [0.6, 0.8, 0.0], 1e-6), (12, [1.0, 0.2, 0.0], 0.0)]);
    let mut constraints = Constraints::new(matrix.nodes());
    held.iter().for_each(|(node, n, v)| constraints.fix_along(*node, *n, *v).unwrap());
    constraints.fix(0, 2, 0.0).unwrap();
    let expected = with_multipliers(&matrix, &rhs, &held);
    for method in METHODS {
        let solution = solve(&matrix, &rhs, &constraints, method, 1e-12, &Job::default()).unwrap();
        assert!(difference(&solution.x, &expected) < 1e-9, "{method:?}: {:e}", difference(&solution.x, &expected));
        assert!(solution.relative_residual <= 1e-12);
    }
}

#[test]
fn same_bits_for_any_number_of_threads() {
    let run = |threads: usize, method: Method| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            let (matrix, rhs, constraints) = cube(12);
            solve(&matrix, &rhs, &constraints, method, 1e-9, &Job::default()).unwrap().x
        })
    };
    for method in METHODS {
        let one = run(1, method);
        assert_eq!(one, run(2, method), "{method:?}");
        assert_eq!(one, run(3, method), "{method:?}");
    }
}

#[test]
fn floating_bodies_are_refused_with_a_node_and_the_motion() {
    let refused =
        |matrix: &BlockMatrix<3>, constraints: &Constraints<3>| match Solver::new(matrix, constraints, Method::Jacobi, &Job::default()) {
            Err(SolveError::Floating { node, size, motion }) => (node, size, motion),
            Err(other) => panic!("{other}"),
            Ok(_) => panic!("not refused"),
        };
    let bricks = Bricks::cube(3);
    let mut matrix = bricks.stiffness(|_| 3e10);
    let mut constraints = Constraints::new(matrix.nodes());
    assert_eq!(refused(&matrix, &constraints).1, 64);
    // Held along z everywhere below: it slides and turns.
    (0..16).for_each(|node| constraints.fix(node, 2, 0.0).unwrap());
    assert_eq!(refused(&matrix, &constraints).0, 0);
    constraints.fix(0, 0, 0.0).unwrap();
    constraints.fix(0, 1, 0.0).unwrap();
    assert_eq!(refused(&matrix, &constraints).2, "turn about (0.00, 0.00, 1.00)");
    // One weak spring, 1e-7 of the stiffness, is enough.
    matrix.add_spring(3, 1, 3e3);
    assert!(Solver::new(&matrix, &constraints, Method::Jacobi, &Job::default()).is_ok());
}

#[test]
fn a_second_body_that_floats_is_named() {
    // Two bars of two springs each; only the first is held.
    let elements: Connectivity = [[0, 1], [1, 2], [3, 4], [4, 5]].into_iter().collect();
    let places = (0..6).map(|i| Place::point([f64::from(i), 0.0, 0.0])).collect();
    let mut matrix = BlockMatrix::<1>::zeros(Pattern::new(places, &elements).unwrap().into());
    matrix.assemble(&elements, &Job::default(), |_, k| Ok::<_, SolveError>(k.copy_from_slice(&[1.0, -1.0, -1.0, 1.0]))).unwrap();
    let mut constraints = Constraints::new(6);
    constraints.fix(0, 0, 0.0).unwrap();
    let error = solve(&matrix, &[0.0; 6], &constraints, Method::Jacobi, 1e-9, &Job::default()).unwrap_err();
    assert_eq!(error, SolveError::Floating { node: 3, size: 3, motion: "take any value".into() });
    // A node of no element rests; loaded, it is named.
    constraints.fix(5, 0, 1.0).unwrap();
    matrix.clear();
    matrix
        .assemble(&elements, &Job::default(), |e, k| {
            Ok::<_, SolveError>(k.copy_from_slice(if e == 3 { &[0.0; 4] } else { &[1.0, -1.0, -1.0, 1.0] }))
        })
        .unwrap();
    constraints.fix(3, 0, 0.0).unwrap();
    assert!(solve(&matrix, &[0.0, 1.0, 0.0, 0.0, 1.0, 0.0], &constraints, Method::Jacobi, 1e-9, &Job::default()).is_ok());
    let error = solve(&matrix, &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0], &constraints, Method::Jacobi, 1e-9, &Job::default()).unwrap_err();
    assert_eq!(error, SolveError::NoStiffness { node: 5 });
}

#[test]
fn what_is_not_a_number_or_does_not_fit_is_refused_by_name() {
    let (mut matrix, mut rhs, mut constraints) = cube(2);
    let job = Job::default();
    let run = |matrix: &_, rhs: &[f64], constraints: &_| solve(matrix, rhs, constraints, Method::Jacobi, 1e-9, &job).unwrap_err();
    rhs[31] = f64::NAN;
    assert_eq!(run(&matrix, &rhs, &constraints), SolveError::NotFinite { what: "right-hand side", node: 10 });
    matrix.add_spring(4, 1, f64::INFINITY);
    assert_eq!(run(&matrix, &rhs, &constraints), SolveError::NotFinite { what: "matrix", node: 4 });
    assert!(matches!(run(&matrix, &rhs[1..], &Constraints::new(3)), SolveError::Length { what: "set of constraints", .. }));
    assert!(matches!(constraints.fix(99, 0, 0.0), Err(SolveError::NoSuchNode { node: 99, .. })));
    assert!(matches!(constraints.fix(3, 0, f64::NAN), Err(SolveError::NotFinite { .. })));
    assert!(matches!(constraints.fix_along(3, [1.0, 1.0, 0.0], 1e-3), Err(SolveError::Contradiction { node: 3, .. })));
    let elements: Connectivity = [[0_u32, 5]].into_iter().collect();
    assert_eq!(
        Pattern::new(vec![Place::point([0.0; 3]); 2], &elements).unwrap_err(),
        SolveError::NoSuchNode { element: 0, node: 5, nodes: 2 }
    );
}

#[test]
fn cancel_stops_assembly_and_solution() {
    let (matrix, rhs, constraints) = cube(4);
    let job = Job::default();
    job.cancel();
    assert!(matches!(solve(&matrix, &rhs, &constraints, Method::Jacobi, 1e-9, &job), Err(SolveError::Cancelled(_))));
}
