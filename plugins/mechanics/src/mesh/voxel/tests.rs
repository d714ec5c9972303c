use std::f64::consts::{PI, TAU};

use super::*;

type Shape = (Vec<DVec3>, Vec<[u32; 3]>);

fn brick(low: DVec3, high: DVec3) -> Shape {
    let points = (0..8)
        .map(|c| {
            DVec3::new([low.x, high.x][c & 1], [low.y, high.y][c >> 1 & 1], [low.z, high.z][c >> 2])
        })
        .collect();
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]];
    (points, quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

/// Every triangle with vertices of its own, as shaded models come.
fn split((points, triangles): &Shape) -> Shape {
    let own = triangles.iter().flatten().map(|&v| points[v as usize]).collect::<Vec<_>>();
    let count = own.len() as u32;
    (own, (0..count / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect())
}

fn both(a: &Shape, b: &Shape) -> Shape {
    let shift = a.0.len() as u32;
    (
        a.0.iter().chain(&b.0).copied().collect(),
        a.1.iter().copied().chain(b.1.iter().map(|t| t.map(|v| v + shift))).collect(),
    )
}

fn sphere(radius: f64, n: u32) -> Shape {
    let mut points = vec![DVec3::Z * radius];
    for i in 1..n {
        let (s, c) = (PI * f64::from(i) / f64::from(n)).sin_cos();
        for j in 0..2 * n {
            let (sj, cj) = (TAU * f64::from(j) / f64::from(2 * n)).sin_cos();
            points.push(radius * DVec3::new(s * cj, s * sj, c));
        }
    }
    points.push(-DVec3::Z * radius);
    let (m, south) = (2 * n, points.len() as u32 - 1);
    let at = |i: u32, j: u32| 1 + (i - 1) * m + j % m;
    let mut triangles = Vec::new();
    for j in 0..m {
        triangles.push([0, at(1, j), at(1, j + 1)]);
        triangles.push([south, at(n - 1, j + 1), at(n - 1, j)]);
        for i in 1..n - 1 {
            triangles.extend([
                [at(i, j), at(i + 1, j), at(i + 1, j + 1)],
                [at(i, j), at(i + 1, j + 1), at(i, j + 1)],
            ]);
        }
    }
    (points, triangles)
}

fn run(shape: &Shape, edge: f64) -> Result<Voxels, VoxelError> {
    voxelise(&shape.0, &shape.1, edge, "c", &Job::default())
}

#[test]
fn a_brick_is_exact_whatever_the_edge() {
    let shape = brick(DVec3::new(-0.1, 0.0, 0.3), DVec3::new(0.3, 0.5, 3.3));
    for (shape, edge) in [(shape.clone(), 0.1), (split(&shape), 0.13), (shape, 5.0)] {
        let voxels = run(&shape, edge).unwrap();
        assert!((voxels.mesh.volume() - 0.6).abs() < 1e-12);
        assert!(
            voxels.error.largest_distance < 1e-12 && voxels.error.relative_volume().abs() < 1e-12
        );
        assert_eq!(
            (voxels.error.undecided, voxels.error.missed_area, voxels.notes.len()),
            (0, 0.0, 0)
        );
        assert!(voxels.spacing.max_element() <= edge);
        assert_eq!(voxels.mesh.check(), Ok(vec![]));
        let area: f64 = voxels.mesh.face_sets["z1"]
            .iter()
            .map(|&f| voxels.mesh.face_middle(f).1.length())
            .sum();
        assert!((area - 0.2).abs() < 1e-12);
    }
}

#[test]
fn a_sphere_converges_and_says_how_far_it_is() {
    let shape = sphere(1.0, 24);
    let mut last = f64::INFINITY;
    for edge in [0.4, 0.2, 0.1] {
        let voxels = run(&shape, edge).unwrap();
        let error = voxels.error;
        assert_eq!((error.undecided, error.dropped_volume), (0, 0.0));
        assert!((voxels.mesh.volume() - error.voxel_volume).abs() < 1e-12);
        assert!((error.surface_volume - 4.0 / 3.0 * PI).abs() < 0.05);
        // A cube whose middle is inside has its corners at most half a diagonal out.
        assert!(
            error.largest_distance < 0.5 * 3f64.sqrt() * edge
                && error.mean_distance < 0.5 * edge
                && error.mean_distance > 0.1 * edge
        );
        // 81 cubes of edge 0.4 have their middle inside: 24 % too much, about the most there is at
        // this edge.
        assert!(
            error.mean_distance < last && error.relative_volume().abs() < 0.65 * edge,
            "{error:?}"
        );
        last = error.mean_distance;
        // Exactly the cubes whose middles are inside the polyhedron: judged by the sphere, but for
        // a shell as thick as its facets.
        for h in 0..voxels.mesh.hexes.len() as u32 {
            assert!(voxels.mesh.centre(h).length() < 1.0);
        }
    }
}

#[test]
fn overlapping_solids_are_their_union_and_inside_out_does_not_matter() {
    let (a, b) = (
        brick(DVec3::ZERO, DVec3::new(2.0, 1.0, 1.0)),
        brick(DVec3::new(1.0, 0.0, 0.0), DVec3::new(2.0, 1.0, 3.0)),
    );
    let voxels = run(&both(&a, &b), 0.25).unwrap();
    assert!((voxels.error.voxel_volume - 4.0).abs() < 1e-12);
    let inside_out = (a.0.clone(), a.1.iter().map(|&[x, y, z]| [x, z, y]).collect());
    assert!((run(&inside_out, 0.25).unwrap().error.voxel_volume - 2.0).abs() < 1e-12);
    // One triangle turned: parity decides, and the user is told.
    let mut turned = a;
    turned.1[3].swap(0, 1);
    let voxels = run(&turned, 0.25).unwrap();
    assert!((voxels.error.voxel_volume - 2.0).abs() < 1e-12);
    assert!(voxels.notes[0].starts_with("triangles are not oriented alike"));
}

#[test]
fn only_the_largest_body_is_kept_and_the_user_told() {
    let shape =
        both(&brick(DVec3::ZERO, DVec3::ONE), &brick(DVec3::splat(2.0), DVec3::new(4.0, 3.0, 3.0)));
    let voxels = run(&shape, 0.5).unwrap();
    assert_eq!((voxels.error.voxel_volume, voxels.error.dropped_volume), (2.0, 1.0));
    assert!(voxels.notes[0].starts_with("2 separate bodies"));
    assert!((voxels.error.missed_area - 6.0 / 16.0).abs() < 0.02);
    // A plate much thinner than the edge is lost, and is missed.
    let plate = both(
        &brick(DVec3::ZERO, DVec3::ONE),
        &brick(DVec3::new(1.0, 0.48, 0.0), DVec3::new(5.0, 0.52, 1.0)),
    );
    let voxels = run(&plate, 0.5).unwrap();
    assert!(voxels.notes.iter().any(|n| n.contains("no cube nearby")), "{:?}", voxels.notes);
}

#[test]
fn open_surfaces_and_nonsense_are_refused() {
    let reason = |shape: &Shape, edge: f64| run(shape, edge).unwrap_err().to_string();
    let mut open = brick(DVec3::ZERO, DVec3::ONE);
    open.1.pop();
    assert!(reason(&open, 0.1).starts_with(
        "the surface is open: 3 of 18 edges have a triangle on one side only, the first from ("
    ));
    let good = brick(DVec3::ZERO, DVec3::ONE);
    assert!(reason(&good, 0.0).contains("above 0"));
    assert!(reason(&good, 1e-5).contains("would do"));
    assert!(reason(&(vec![], vec![]), 0.1).contains("without triangles"));
    assert!(reason(&(good.0.clone(), vec![[0, 1, 99]]), 0.1).contains("triangle 1 names a vertex"));
    let mut nan = good.clone();
    nan.0[2].y = f64::NAN;
    assert!(reason(&nan, 0.1).contains("not finite"));
    let flat = (good.0.clone(), vec![[0, 1, 2], [0, 2, 1]]);
    assert!(reason(&flat, 0.1).contains("smaller edge"));
    let job = Job::default();
    job.cancel();
    assert_eq!(
        voxelise(&good.0, &good.1, 0.1, "c", &job).unwrap_err(),
        VoxelError::Cancelled(Cancelled)
    );
}

/// A T whose flange and web are no multiples of the edge: its planes are the grid's, and no volume
/// is missed.
#[test]
fn steps_are_met_exactly() {
    let web = brick(DVec3::new(0.41, 0.0, 0.0), DVec3::new(0.58, 0.73, 3.0));
    let flange = brick(DVec3::new(0.0, 0.73, 0.0), DVec3::new(1.0, 0.92, 3.0));
    let found = run(&both(&web, &flange), 0.1).unwrap();
    let volume = 0.17 * 0.73 * 3.0 + 0.19 * 3.0;
    assert!((found.error.voxel_volume / volume - 1.0).abs() < 1e-9, "{:?}", found.error);
    assert!((found.mesh.volume() / volume - 1.0).abs() < 1e-9);
    assert!(found.error.largest_distance < 1e-9, "{:?}", found.error);
    // Half a cube's width apart they are no longer worth a plane each.
    let thin = brick(DVec3::new(0.0, 0.73, 0.0), DVec3::new(1.0, 0.735, 3.0));
    assert!(run(&both(&web, &thin), 0.1).unwrap().mesh.hexes.len() < found.mesh.hexes.len());
}
