//! Against dense solutions, against themselves on other numbers of threads, and against what must
//! be refused.

use intrados_stage::{Job, random::Key};
use nalgebra::{DMatrix, DVector};

use super::{
    brick::{Bricks, lining, pushed_cube},
    constraint::Mask,
    direct::Factor,
    order::{nested_dissection, work},
    *,
};

const METHODS: [Method; 3] = [Method::Jacobi, Method::Multigrid, Method::Direct];

/// A cube whose lower face is held at nought and whose upper face is pushed; E varies from cell to
/// cell.
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
    DMatrix::from_fn(matrix.unknowns(), matrix.unknowns(), |i, j| {
        matrix.block(i / B, j / B).map_or(0.0, |b| b[i % B][j % B])
    })
}

/// Solves with multipliers for the constraints nᵀu = v, given as (node, n, v).
fn with_multipliers(
    matrix: &BlockMatrix<3>,
    rhs: &[f64],
    held: &[(usize, [f64; 3], f64)],
) -> Vec<f64> {
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
                expected[(3 * cell[i / 3] as usize + i % 3, 3 * cell[j / 3] as usize + j % 3)] +=
                    k[24 * i + j];
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
    assemble_vector::<1, SolveError>(&elements, &mut again, &Job::default(), |_, f| {
        f.fill(10.0);
        Ok(())
    })
    .unwrap();
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
    held.extend([
        (0, [1.0, 1.0, 0.0], 2e-6),
        (0, [1.0, 0.0, 0.0], 0.0),
        (3, [0.6, 0.8, 0.0], 1e-6),
        (12, [1.0, 0.2, 0.0], 0.0),
    ]);
    let mut constraints = Constraints::new(matrix.nodes());
    held.iter().for_each(|(node, n, v)| constraints.fix_along(*node, *n, *v).unwrap());
    constraints.fix(0, 2, 0.0).unwrap();
    let expected = with_multipliers(&matrix, &rhs, &held);
    for method in METHODS {
        let solution = solve(&matrix, &rhs, &constraints, method, 1e-12, &Job::default()).unwrap();
        assert!(
            difference(&solution.x, &expected) < 1e-9,
            "{method:?}: {:e}",
            difference(&solution.x, &expected)
        );
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
    let refused = |matrix: &BlockMatrix<3>, constraints: &Constraints<3>| match Solver::new(
        matrix,
        constraints,
        Method::Jacobi,
        &Job::default(),
    ) {
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

/// Springs of stiffness 1 between pairs of nodes on a line; those for which `broken` holds have
/// none.
fn springs(
    nodes: u32,
    pairs: &[[u32; 2]],
    broken: impl Fn(usize) -> bool + Sync,
) -> BlockMatrix<1> {
    let elements: Connectivity = pairs.iter().collect();
    let places = (0..nodes).map(|i| Place::point([f64::from(i), 0.0, 0.0])).collect();
    let mut matrix = BlockMatrix::zeros(Pattern::new(places, &elements).unwrap().into());
    let spring = |e: usize, k: &mut [f64]| {
        k.copy_from_slice(if broken(e) { &[0.0; 4] } else { &[1.0, -1.0, -1.0, 1.0] });
        Ok::<_, SolveError>(())
    };
    matrix.assemble(&elements, &Job::default(), spring).unwrap();
    matrix
}

#[test]
fn a_second_body_that_floats_is_named() {
    // Two bars of two springs each; only the first is held.
    let pairs = [[0, 1], [1, 2], [3, 4], [4, 5]];
    let mut constraints = Constraints::new(6);
    constraints.fix(0, 0, 0.0).unwrap();
    let run = |matrix: &BlockMatrix<1>, rhs: [f64; 6], constraints: &_| {
        solve(matrix, &rhs, constraints, Method::Auto, 1e-9, &Job::default())
    };
    let error = run(&springs(6, &pairs, |_| false), [0.0; 6], &constraints).unwrap_err();
    assert_eq!(error, SolveError::Floating { node: 3, size: 3, motion: "take any value".into() });
    // A node of no living element rests; loaded, it is named.
    constraints.fix(3, 0, 0.0).unwrap();
    let broken = springs(6, &pairs, |e| e == 3);
    assert!(run(&broken, [0.0, 1.0, 0.0, 0.0, 1.0, 0.0], &constraints).is_ok());
    let error = run(&broken, [0.0, 0.0, 0.0, 0.0, 0.0, 1.0], &constraints).unwrap_err();
    assert_eq!(error, SolveError::NoStiffness { node: 5 });
}

#[test]
fn what_is_not_a_number_or_does_not_fit_is_refused_by_name() {
    let (mut matrix, mut rhs, mut constraints) = cube(2);
    let job = Job::default();
    let run = |matrix: &_, rhs: &[f64], constraints: &_| {
        solve(matrix, rhs, constraints, Method::Jacobi, 1e-9, &job).unwrap_err()
    };
    rhs[31] = f64::NAN;
    assert_eq!(
        run(&matrix, &rhs, &constraints),
        SolveError::NotFinite { what: "right-hand side", node: 10 }
    );
    matrix.add_spring(4, 1, f64::INFINITY);
    assert_eq!(run(&matrix, &rhs, &constraints), SolveError::NotFinite { what: "matrix", node: 4 });
    assert!(matches!(
        run(&matrix, &rhs[1..], &Constraints::new(3)),
        SolveError::Length { what: "set of constraints", .. }
    ));
    assert!(matches!(constraints.fix(99, 0, 0.0), Err(SolveError::NoSuchNode { node: 99, .. })));
    assert!(matches!(constraints.fix(3, 0, f64::NAN), Err(SolveError::NotFinite { .. })));
    assert!(matches!(
        constraints.fix_along(3, [1.0, 1.0, 0.0], 1e-3),
        Err(SolveError::Contradiction { node: 3, .. })
    ));
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
    assert!(matches!(
        solve(&matrix, &rhs, &constraints, Method::Jacobi, 1e-9, &job),
        Err(SolveError::Cancelled(_))
    ));
}

#[test]
fn iterations_of_multigrid_do_not_grow_with_the_mesh() {
    let run = |n: usize| {
        let (matrix, rhs, constraints) = pushed_cube(n, |_| 3e10);
        solve(&matrix, &rhs, &constraints, Method::Multigrid, 1e-8, &Job::default())
            .unwrap()
            .iterations
    };
    let counts = [6, 12, 24].map(run);
    assert!(counts[2] <= 16 && counts[2] <= counts[0] + 5, "{counts:?}");
}

#[test]
fn a_lining_of_contrast_1e5_takes_less_than_a_hundred_iterations() {
    let (matrix, rhs, constraints) = lining(40);
    let run = |method, tolerance| {
        solve(&matrix, &rhs, &constraints, method, tolerance, &Job::default()).unwrap()
    };
    let (grid, direct) = (run(Method::Multigrid, 1e-8), run(Method::Direct, 1e-10));
    assert!(grid.iterations < 100, "{}", grid.iterations);
    assert!(difference(&grid.x, &direct.x) < 1e-4, "{:e}", difference(&grid.x, &direct.x));
}

/// A square grid of beams in the plane z = 0, displacements at nodes 0 … m − 1, rotations at m … 2m
/// − 1: what a shell asks of a solver.
fn grillage(n: u32) -> (BlockMatrix<3>, Connectivity) {
    let m = (n + 1) * (n + 1);
    let at = |i: u32| [f64::from(i % (n + 1)), f64::from(i / (n + 1)), 0.0];
    let mut places: Vec<Place> = (0..m).map(|i| Place::point(at(i))).collect();
    places.extend((0..m).map(|i| Place { position: at(i), kind: Kind::RotationOf(i) }));
    let right = (0..m).filter(|i| i % (n + 1) < n).map(|i| [i, i + 1, m + i, m + i + 1]);
    let up = (0..m - n - 1).map(|i| [i, i + n + 1, m + i, m + i + n + 1]);
    let beams: Connectivity = right.chain(up).collect();
    let mut matrix = BlockMatrix::zeros(Pattern::new(places, &beams).unwrap().into());
    let fill = |e: usize, k: &mut [f64]| {
        let nodes = beams.get(e);
        beam(if nodes[1] == nodes[0] + 1 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] }, k);
        Ok::<_, SolveError>(())
    };
    matrix.assemble(&beams, &Job::default(), fill).unwrap();
    (matrix, beams)
}

/// A beam of length 1 along `t` with EA = 1e3, bending and twisting stiffness 1 (Euler and
/// Bernoulli): unknowns u₁ u₂ θ₁ θ₂.
fn beam(t: [f64; 3], k: &mut [f64]) {
    // Energy = ½ Σ s (b·u)²: axial strain, twist, and in each bending plane mean curvature and (12
    // EI) the shear of the chord.
    let mut add = |s: f64, b: [[f64; 3]; 4]| {
        let b: Vec<f64> = b.concat();
        (0..144).for_each(|i| k[i] += s * b[i / 12] * b[i % 12]);
    };
    let scaled = |v: [f64; 3], f: f64| v.map(|x| f * x);
    add(1e3, [scaled(t, -1.0), t, [0.0; 3], [0.0; 3]]);
    add(1.0, [[0.0; 3], [0.0; 3], scaled(t, -1.0), t]);
    for n in [[0.0, 0.0, 1.0], [t[1], t[0], 0.0]] {
        // t × n: the rotation about m lifts the far end along n.
        let m = [n[1] * t[2] - n[2] * t[1], n[2] * t[0] - n[0] * t[2], n[0] * t[1] - n[1] * t[0]];
        add(1.0, [[0.0; 3], [0.0; 3], scaled(m, -1.0), m]);
        add(12.0, [scaled(n, -1.0), n, scaled(m, -0.5), scaled(m, -0.5)]);
    }
}

#[test]
fn rotations_take_part_in_rigid_motions() {
    let n = 24;
    let (matrix, _) = grillage(n);
    let m = matrix.nodes() / 2;
    let free =
        Solver::new(&matrix, &Constraints::new(2 * m), Method::Multigrid, &Job::default()).err();
    assert!(
        matches!(free, Some(SolveError::Floating { node: 0, size, .. }) if size == 2 * m),
        "{free:?}"
    );
    // Clamped along one edge, loaded across at the far corner.
    let mut constraints = Constraints::new(2 * m);
    for node in 0..=n as usize {
        constraints.fix_all(node, [0.0; 3]).unwrap();
        constraints.fix_all(m + node, [0.0; 3]).unwrap();
    }
    let mut rhs = vec![0.0; matrix.unknowns()];
    rhs[3 * (m - 1) + 2] = 1.0;
    let run = |method| solve(&matrix, &rhs, &constraints, method, 1e-9, &Job::default()).unwrap();
    let (grid, jacobi, direct) = (run(Method::Multigrid), run(Method::Jacobi), run(Method::Direct));
    assert!(difference(&grid.x, &direct.x) < 1e-5, "{:e}", difference(&grid.x, &direct.x));
    assert!(
        grid.iterations < 150 && 8 * grid.iterations < jacobi.iterations,
        "{} {}",
        grid.iterations,
        jacobi.iterations
    );
}

#[test]
fn unknowns_relative_to_the_body_and_scalars_solve_as_well() {
    // A slip at the end of a bar of 4000 springs (B = 1), and the bar itself.
    let pairs: Vec<[u32; 2]> = (0..4000).map(|i| [i, i + 1]).collect();
    let matrix = springs(4001, &pairs, |_| false);
    let mut constraints = Constraints::new(4001);
    constraints.fix(0, 0, 2.0).unwrap();
    let mut rhs = vec![0.0; 4001];
    rhs[4000] = 1.0;
    let run = |method| solve(&matrix, &rhs, &constraints, method, 1e-10, &Job::default()).unwrap();
    let (grid, auto) = (run(Method::Multigrid), run(Method::Auto));
    assert!((auto.x[4000] - 4002.0).abs() < 1e-5 && auto.method == "direct", "{}", auto.x[4000]);
    assert!(difference(&grid.x, &auto.x) < 1e-6 && grid.iterations < 60, "{}", grid.iterations);

    let bricks = Bricks::cube(6);
    let mut elements: Connectivity = bricks.cells.iter().collect();
    let slip = bricks.points.len();
    elements.push(&[slip as u32, 200]);
    let mut places: Vec<Place> = bricks.points.iter().map(|&p| Place::point(p)).collect();
    places.push(Place { position: bricks.points[200], kind: Kind::Relative });
    let mut matrix = BlockMatrix::<3>::zeros(Pattern::new(places, &elements).unwrap().into());
    let fill = |e: usize, k: &mut [f64]| {
        match bricks.cells.get(e) {
            Some(cell) => brick::brick(&cell.map(|n| bricks.points[n as usize]), 1.0, 0.2, k),
            None => (0..6).for_each(|i| k[7 * i] = 0.3),
        }
        Ok::<_, SolveError>(())
    };
    matrix.assemble(&elements, &Job::default(), fill).unwrap();
    let mut constraints = Constraints::new(slip + 1);
    (0..49).for_each(|node| constraints.fix_all(node, [0.0; 3]).unwrap());
    let mut rhs = vec![1.0; matrix.unknowns()];
    rhs[3 * slip] = 0.6;
    let run = |method| solve(&matrix, &rhs, &constraints, method, 1e-10, &Job::default()).unwrap();
    let (grid, direct) = (run(Method::Multigrid), run(Method::Direct));
    assert!(difference(&grid.x, &direct.x) < 1e-8);
    assert!((grid.x[3 * slip] - 2.0).abs() < 1e-8);
}

#[test]
fn negative_eigenvalues_are_counted() {
    let (mut matrix, rhs, constraints) = pushed_cube(4, |_| 1.0);
    for (node, component) in [(60, 0), (77, 2), (101, 1)] {
        matrix.add_spring(node, component, -3.0);
    }
    let mut free = dense(&matrix);
    for i in 0..75 {
        free.row_mut(i).fill(0.0);
        free.column_mut(i).fill(0.0);
        free[(i, i)] = 1.0;
    }
    let expected = free.clone().symmetric_eigenvalues().iter().filter(|v| **v < 0.0).count();
    let auto = solve(&matrix, &rhs, &constraints, Method::Auto, 1e-9, &Job::default()).unwrap();
    assert_eq!((auto.method, auto.negative_eigenvalues), ("direct LBLt", expected));
    assert!(expected > 0);
    let f = DVector::from_iterator(
        375,
        rhs.iter().enumerate().map(|(i, f)| if i < 75 { 0.0 } else { *f }),
    );
    assert!(difference(&auto.x, free.lu().solve(&f).unwrap().as_slice()) < 1e-8);
    let grid = solve(&matrix, &rhs, &constraints, Method::Multigrid, 1e-9, &Job::default());
    assert!(matches!(grid, Err(SolveError::Indefinite { .. })), "{grid:?}");
}

#[test]
fn a_solver_serves_more_loads_and_later_matrices() {
    for method in METHODS {
        let (mut matrix, mut rhs, constraints) = pushed_cube(10, |_| 3e10);
        let mut solver = Solver::new(&matrix, &constraints, method, &Job::default()).unwrap();
        let check = |solver: &mut Solver<3>, matrix: &BlockMatrix<3>, rhs: &[f64]| {
            let solution = solver.solve(matrix, rhs, &constraints, 1e-8, &Job::default()).unwrap();
            let mut product = vec![0.0; rhs.len()];
            matrix.multiply(&solution.x, &mut product);
            // All but the nodes that are held.
            let free = 3 * 121;
            assert!(difference(&product[free..], &rhs[free..]) < 1e-6, "{method:?}");
        };
        check(&mut solver, &matrix, &rhs);
        rhs[2000] = 5e3;
        check(&mut solver, &matrix, &rhs);
        // A tenth of the cells loses 99 % of its stiffness, again and again.
        for seed in 0..3 {
            let damaged =
                |c: usize| if Key::new(seed, c as u64).unit(0) < 0.1 { 3e8 } else { 3e10 };
            matrix = Bricks::cube(10).stiffness(damaged);
            solver.update(&matrix, &constraints, &Job::default()).unwrap();
            check(&mut solver, &matrix, &rhs);
        }
    }
}

#[test]
fn nested_dissection_is_an_order_that_keeps_the_factor_small() {
    let (matrix, _, constraints) = pushed_cube(12, |_| 1.0);
    let mut order = nested_dissection(matrix.pattern());
    order.sort_unstable();
    assert!(order.iter().enumerate().all(|(i, &n)| i as u32 == n));
    // In the natural order the factor fills its band of a layer of nodes.
    let band = matrix.unknowns() * 3 * 13 * 13;
    let factor =
        Factor::new(&matrix, &Mask::new(&constraints, &matrix), true, &Job::default()).unwrap();
    assert!(3 * factor.entries() < 2 * band, "{} {band}", factor.entries());
}

/// Bricks that are a hundred times as long as wide are cut as cubes are, and what the order says of
/// the work is what the factor has.
#[test]
fn needles_are_ordered_by_their_layers() {
    let grid = |length: f64| Bricks::new([12, 12, 12], |[x, y, z]| [length * x, y, z]).pattern().0;
    let [cube, needle] = [1.0, 100.0].map(|length| {
        let pattern = grid(length);
        work(&pattern, &nested_dissection(&pattern))
    });
    assert!(needle < 1.05 * cube, "{needle} {cube}");
    // A row of n nodes: two entries in each column but the last.
    let row = Bricks::new([1, 1, 50], |x| x).pattern().0;
    let natural: Vec<u32> = (0..row.nodes() as u32).collect();
    // Layers of four nodes, each joined to the next: 8, 7, 6, 5 entries, and 4, 3, 2, 1 at the end.
    let expected = 50.0 * (64.0 + 49.0 + 36.0 + 25.0) + 30.0;
    assert!((work(&row, &natural) - expected).abs() < 1e-9, "{}", work(&row, &natural));
}

/// A needle of bricks 100:1 and a sheet are factorised where multigrid would cost more, a cube is
/// not; all of them are solved.
#[test]
fn what_costs_less_solves() {
    let solved = |size: [usize; 3], by: [f64; 3]| {
        let bricks = Bricks::new(size, |x| std::array::from_fn(|c| by[c] * x[c]));
        let matrix = bricks.stiffness(|_| 3e10);
        let mut constraints = Constraints::new(matrix.nodes());
        let mut rhs = vec![0.0; matrix.unknowns()];
        for (node, point) in bricks.points.iter().enumerate() {
            if point[0] == 0.0 {
                constraints.fix_all(node, [0.0; 3]).unwrap();
            } else if point[0] == by[0] {
                rhs[3 * node + 2] = 1.0;
            }
        }
        let [once, direct] = [Method::Once, Method::Direct].map(|method| {
            solve(&matrix, &rhs, &constraints, method, 1e-5, &Job::default()).unwrap()
        });
        (once.method, difference(&once.x, &direct.x))
    };
    for (size, by, method) in [
        ([14, 14, 14], [1.0; 3], "multigrid"),
        ([14, 14, 14], [14.0, 0.14, 0.14], "direct"),
        ([60, 60, 1], [1.0, 1.0, 5e-4], "direct"),
    ] {
        let (found, off) = solved(size, by);
        assert!(found == method && off < 1e-3, "{by:?}: {found} {off:e}");
    }
}

#[test]
fn nothing_to_solve_is_solved() {
    let (matrix, rhs, mut constraints) = cube(2);
    let run = |rhs: &[f64], constraints: &_, method| {
        solve(&matrix, rhs, constraints, method, 1e-9, &Job::default()).unwrap()
    };
    for method in METHODS {
        let still = run(&vec![0.0; rhs.len()], &constraints, method);
        assert!(still.x.iter().all(|&v| v == 0.0) && still.iterations == 0);
    }
    (0..27).for_each(|node| constraints.fix_all(node, [0.0; 3]).unwrap());
    for method in METHODS {
        assert!(run(&rhs, &constraints, method).x.iter().all(|&v| v == 0.0));
    }
}

/// What multigrid cannot reach a factorisation is asked for, and it stays: here no method could,
/// but the next system is solved by it.
#[test]
fn where_multigrid_gives_up_systems_are_factorised() {
    let (matrix, rhs, constraints) = cube(13);
    let job = Job::default();
    let mut solver = Solver::new(&matrix, &constraints, Method::Auto, &job).unwrap();
    let first = solver.solve(&matrix, &rhs, &constraints, 1e-8, &job).unwrap();
    assert!(first.method == "multigrid" && !solver.fell_back());
    assert!(solver.solve(&matrix, &rhs, &constraints, 1e-19, &job).is_err() && solver.fell_back());
    solver.update(&matrix, &constraints, &job).unwrap();
    let then = solver.solve(&matrix, &rhs, &constraints, 1e-8, &job).unwrap();
    assert!(then.method == "direct" && difference(&then.x, &first.x) < 1e-6, "{}", then.method);
}
