//! Bricks: patch test, bending, Lamé, Kirsch, a ring in the ground.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;
use intrados_stage::Job;

use super::{
    Checks, Trouble, check, elastic, growing, hold, model, near, node, order, solve, steps, stress,
    within,
};
use crate::{
    element::{
        hex8::{CORNERS, Kind},
        load::{self, Face},
        spring::Winkler,
    },
    mesh::{Cell, Layer, Mesh, MeshError, Polar, block, divide, hex::FACES},
    model::{Action, Bedding, Ground, Load, Matter, Model, System},
};

/// Inner nodes of a patch of seven bricks in the unit cube, after MacNeal and Harder (1985); their
/// fifth, at y = .186, folds a corner.
const INNER: [[f64; 3]; 8] = [
    [0.249, 0.342, 0.192],
    [0.826, 0.288, 0.288],
    [0.850, 0.649, 0.263],
    [0.273, 0.750, 0.230],
    [0.320, 0.286, 0.643],
    [0.677, 0.305, 0.683],
    [0.788, 0.693, 0.644],
    [0.165, 0.745, 0.702],
];

/// The outer nodes move by a linear field; every point must answer the one stress, and the inner
/// nodes must follow.
pub(super) fn patch(job: &Job) -> Checks {
    let field = |p: DVec3| {
        5e-4 * DVec3::new(2.0 * p.x + p.y + p.z, p.x + 2.0 * p.y + p.z, p.x + p.y + 2.0 * p.z)
    };
    // E = 1e6, ν = ¼: 2000 across, 400 in shear.
    let exact = [2000.0, 2000.0, 2000.0, 400.0, 400.0, 400.0];
    let mut checks = Vec::new();
    for kind in [Kind::Plain, Kind::Incompatible] {
        let mut mesh = Mesh { regions: vec!["patch".into()], ..Mesh::default() };
        mesh.nodes.extend(CORNERS.map(|c| 0.5 * (c + DVec3::ONE)));
        mesh.nodes.extend(INNER.map(DVec3::from_array));
        mesh.hexes.push(Cell { nodes: std::array::from_fn(|c| 8 + c as u32), region: 0 });
        let shell = FACES.map(|face| {
            std::array::from_fn(|c| if c < 4 { 8 + face[c] as u32 } else { face[c - 4] as u32 })
        });
        mesh.hexes.extend(shell.map(|nodes| Cell { nodes, region: 0 }));
        mesh.check()?;
        let mut model = Model { kind, ..model(mesh, Matter::Elastic(elastic(1e6, 0.25))) };
        let outer = (0..8_u32).flat_map(|n| (0..3_u8).map(move |c| (n, c)));
        let moved = outer
            .map(|(n, c)| (n, c, field(model.mesh.nodes[n as usize])[usize::from(c)]))
            .collect();
        model.loads.push(Load {
            name: "skin".into(),
            action: Action::Displacement(moved),
            history: vec![],
        });
        let structure = System::new(&model)?;
        let history = solve(&structure, 1.0, job)?;
        let mut worst = [0.0_f64; 2];
        for hex in 0..7 {
            for point in structure.points(hex, &history)? {
                point
                    .stress
                    .iter()
                    .zip(exact)
                    .for_each(|(s, e)| worst[0] = worst[0].max((s - e).abs() / 2000.0));
            }
        }
        for (n, p) in model.mesh.nodes.iter().enumerate() {
            (0..3).for_each(|c| {
                worst[1] = worst[1].max((history.x[3 * n + c] - field(*p)[c]).abs() / 2e-3)
            });
        }
        checks.push(check(
            "patch",
            format!("7 distorted bricks, {kind:?}: largest error of stress"),
            worst[0],
            0.0,
            1e-12,
        ));
        checks.push(check(
            "patch",
            format!("7 distorted bricks, {kind:?}: largest error of displacement"),
            worst[1],
            0.0,
            1e-12,
        ));
    }
    Ok(checks)
}

/// 10 × 1 × 1, E = 30000, ν = .2, P = 1 at the tip: P L³/(3 E I) + 6 P L/(5 G A) = .13333 + .00096.
pub(super) fn cantilever(job: &Job) -> Checks {
    let (exact, mut checks) =
        (10f64.powi(3) / (3.0 * 30_000.0 / 12.0) + 1.2 * 10.0 / 12_500.0, Vec::new());
    for deep in [1, 2] {
        let lines = |length: f64| divide(0.0, length, &[], 1.0 / f64::from(deep));
        let mut model = model(
            block(&lines(10.0), &lines(1.0), &lines(1.0), "beam")?,
            Matter::Elastic(elastic(30_000.0, 0.2)),
        );
        (0..3).for_each(|c| hold(&mut model, c, |p| near(p.x, 0.0)));
        let tip: Vec<_> = model.mesh.face_sets["x1"].clone();
        let load = traction(&model.mesh, &tip, |_, _| -DVec3::Z)?;
        model.loads.push(Load { name: "tip".into(), action: load, history: vec![] });
        let structure = System::new(&model)?;
        let history = solve(&structure, 1.0, job)?;
        let tip = node(&model.mesh, DVec3::new(10.0, 0.0, 0.0))?;
        let ratio = -history.x[3 * tip as usize + 2] / exact;
        checks.push(check(
            "bending",
            format!("cantilever 10 × 1 × 1, {deep} brick(s) deep, over Timoshenko's deflection"),
            ratio,
            1.0,
            0.01,
        ));
    }
    Ok(checks)
}

/// Nodal forces of a traction of place and outward normal.
pub(super) fn traction(
    mesh: &Mesh,
    faces: &[crate::mesh::HexFace],
    force: impl Fn(DVec3, DVec3) -> DVec3,
) -> Result<Action, Trouble> {
    let mut forces = Vec::new();
    for face in faces {
        let loads = load::traction(
            &mesh.corners(face.hex),
            Face::ALL[usize::from(face.face)],
            |p, inward| force(p, -inward),
        )?;
        let nodes = mesh.hexes[face.hex as usize].nodes;
        forces.extend(
            nodes.into_iter().zip(loads.as_chunks::<3>().0.iter().map(|f| DVec3::from_array(*f))),
        );
    }
    Ok(Action::Nodes(forces))
}

/// A quarter of a tube in plane strain or, free along z, in plane stress: its planes of symmetry
/// held.
pub(super) fn quarter(radii: Vec<f64>, around: usize, length: f64) -> Result<Mesh, MeshError> {
    let layers = vec![Layer { region: "tube".into(), radii, ..Layer::default() }];
    Polar { layers, angles: steps(0.0, FRAC_PI_2, around), z: vec![0.0, length] }.build()
}

pub(super) fn hold_quarter(model: &mut Model, plane_strain: bool) {
    let sets: &[(&str, u8)] = if plane_strain {
        &[("t0", 1), ("t1", 0), ("z0", 2), ("z1", 2)]
    } else {
        &[("t0", 1), ("t1", 0), ("z0", 2)]
    };
    for &(set, component) in sets {
        let nodes = model.mesh.node_sets.get(set).cloned().unwrap_or_default();
        model.holds.extend(nodes.into_iter().map(|n| (n, component)));
    }
}

/// Lamé's tube a = 1, b = 2 under inner pressure 1, E = 30000, ν = .2, plane strain: u(a), σ_θ(a),
/// σ_z.
pub(super) const LAME: [f64; 3] = [6.133_333_333e-5, 1.666_666_667, 0.133_333_333];
pub(super) const LAME_TOLERANCE: f64 = 1e-3;

fn lame_model(around: usize, modulus: f64) -> Result<Model, Trouble> {
    let mesh = quarter(steps(1.0, 2.0, around / 2), around, 0.1)?;
    let mut model = model(mesh, Matter::Elastic(elastic(modulus, 0.2)));
    hold_quarter(&mut model, true);
    let inner = model.mesh.face_sets["inner"].iter().map(|&face| (face, 1.0)).collect();
    model.loads.push(Load {
        name: "pressure".into(),
        action: Action::Faces(inner),
        history: vec![],
    });
    Ok(model)
}

pub(super) fn lame_displacement(around: usize, modulus: f64, job: &Job) -> Result<f64, Trouble> {
    let model = lame_model(around, modulus)?;
    let structure = System::new(&model)?;
    Ok(solve(&structure, 1.0, job)?.x[3 * node(&model.mesh, DVec3::X)? as usize])
}

pub(super) fn lame(job: &Job) -> Checks {
    let coarse = lame_displacement(20, 30_000.0, job)?;
    let model = lame_model(40, 30_000.0)?;
    let structure = System::new(&model)?;
    let history = solve(&structure, 1.0, job)?;
    let fine = history.x[3 * node(&model.mesh, DVec3::X)? as usize];
    let at = |place: DVec3, normal: DVec3| stress(&structure, &history, place, normal);
    // The middle of a brick, where its stress is best.
    let (angle, radius) = (FRAC_PI_2 / 80.0, 1.525 * (FRAC_PI_2 / 80.0).cos());
    let along = DVec3::new(angle.cos(), angle.sin(), 0.0);
    let middle = radius * along + 0.05 * DVec3::Z;
    let [radial, hoop] = [1.0, -1.0].map(|sign| (1.0 - sign * 4.0 / radius.powi(2)) / 3.0);
    Ok(vec![
        within("Lamé", "tube, 20 × 40 bricks: u(a)", fine, LAME[0], LAME_TOLERANCE),
        check(
            "Lamé",
            "tube, order of u(a) from 10 × 20 to 20 × 40",
            order(coarse - LAME[0], fine - LAME[0]),
            2.0,
            0.1,
        ),
        within(
            "Lamé",
            "tube: hoop stress at the inner face",
            at(DVec3::X, DVec3::Y)?,
            LAME[1],
            0.01,
        ),
        within(
            "Lamé",
            format!("tube: radial stress at r = {radius:.3}"),
            at(middle, along)?,
            radial,
            5e-3,
        ),
        within(
            "Lamé",
            format!("tube: hoop stress at r = {radius:.3}"),
            at(middle, DVec3::Z.cross(along))?,
            hoop,
            5e-3,
        ),
        within("Lamé", "tube: axial stress", at(middle, DVec3::Z)?, LAME[2], 5e-3),
    ])
}

/// Kirsch's stresses around a hole of radius 1 under tension 1 along x, as a tensor in x and y.
fn kirsch_stress(p: DVec3) -> [f64; 3] {
    let (q, angle) = (1.0 / (p.x * p.x + p.y * p.y), p.y.atan2(p.x));
    let (c2, s2) = ((2.0 * angle).cos(), (2.0 * angle).sin());
    let radial = 0.5 * (1.0 - q) + 0.5 * (1.0 - 4.0 * q + 3.0 * q * q) * c2;
    let hoop = 0.5 * (1.0 + q) - 0.5 * (1.0 + 3.0 * q * q) * c2;
    let shear = -0.5 * (1.0 + 2.0 * q - 3.0 * q * q) * s2;
    let (mean, half) = (0.5 * (radial + hoop), 0.5 * (radial - hoop));
    [mean + half * c2 - shear * s2, mean - half * c2 + shear * s2, half * s2 + shear * c2]
}

/// A plate with a hole, as far as five radii; the rest of the infinite plate pulls by its exact
/// tractions.
pub(super) fn kirsch(job: &Job) -> Checks {
    let mesh = quarter(growing(1.0, 5.0, 24), 32, 0.1)?;
    let mut model = model(mesh, Matter::Elastic(elastic(30_000.0, 0.2)));
    hold_quarter(&mut model, true);
    let outer = model.mesh.face_sets["outer"].clone();
    let pull = traction(&model.mesh, &outer, |p, n| {
        let [xx, yy, xy] = kirsch_stress(p);
        DVec3::new(xx * n.x + xy * n.y, xy * n.x + yy * n.y, 0.0)
    })?;
    model.loads.push(Load { name: "plate".into(), action: pull, history: vec![] });
    let structure = System::new(&model)?;
    let history = solve(&structure, 1.0, job)?;
    let beside = DVec3::new(0.0, growing(1.0, 5.0, 24)[8], 0.0);
    let at = |place: DVec3, normal: DVec3| stress(&structure, &history, place, normal);
    Ok(vec![
        within(
            "Kirsch",
            "hole in a plate: 3 S across the pull",
            at(DVec3::Y, DVec3::X)?,
            3.0,
            0.02,
        ),
        check("Kirsch", "hole in a plate: −S along the pull", at(DVec3::X, DVec3::Y)?, -1.0, 0.06),
        within(
            "Kirsch",
            format!("hole in a plate: σ_x at r = {:.3} across the pull", beside.y),
            at(beside, DVec3::X)?,
            kirsch_stress(beside)[0],
            0.02,
        ),
    ])
}

/// A ring in the ground under inner pressure: Lamé in plane stress, the outer face on springs.
pub(super) fn ground(job: &Job) -> Checks {
    let (modulus, poisson, pressure, inner, outer, springs) =
        (34.5e9, 0.2, 0.3e6, 2.85, 3.15, 30e6 / (1.3 * 3.0));
    let mesh = quarter(steps(inner, outer, 4), 48, 0.2)?;
    let mut model = model(mesh, Matter::Elastic(elastic(modulus, poisson)));
    hold_quarter(&mut model, false);
    let pressed = model.mesh.face_sets["inner"].iter().map(|&face| (face, pressure)).collect();
    model.loads.push(Load {
        name: "water".into(),
        action: Action::Faces(pressed),
        history: vec![],
    });
    let springs_of = Winkler { radial: springs, tangential: 0.0, pressure: 0.0 };
    model.ground = model.mesh.face_sets["outer"]
        .iter()
        .map(|&face| Ground {
            face,
            bedding: Bedding::Around {
                axis: [DVec3::ZERO, DVec3::Z],
                springs: springs_of,
                comes: [0.0; 2],
            },
        })
        .collect();
    let structure = System::new(&model)?;
    let history = solve(&structure, 1.0, job)?;
    // σ_r = A − B/r², u = ((1 − ν) A r + (1 + ν) B/r)/E; σ_r(inner) = −p, σ_r(outer) = −k u(outer).
    let (la, lb) = ((1.0 - poisson) * outer / modulus, (1.0 + poisson) / (outer * modulus));
    let b = pressure * (1.0 + springs * la)
        / ((1.0 + springs * la) / inner.powi(2) - 1.0 / outer.powi(2) + springs * lb);
    let a = b / inner.powi(2) - pressure;
    let u = |r: f64| ((1.0 - poisson) * a * r + (1.0 + poisson) * b / r) / modulus;
    let found =
        |r: f64| Ok::<f64, Trouble>(history.x[3 * node(&model.mesh, r * DVec3::X)? as usize]);
    let thin = pressure / (modulus * 0.3 / 9.0 + springs);
    Ok(vec![
        within(
            "ground",
            "ring on springs under inner pressure: u(inner) of the thick ring",
            found(inner)?,
            u(inner),
            2e-3,
        ),
        within(
            "ground",
            "ring on springs under inner pressure: u(outer) of the thick ring",
            found(outer)?,
            u(outer),
            2e-3,
        ),
        // The thin ring's formula knows no thickness.
        within(
            "ground",
            "ring on springs under inner pressure: mean u, p/(E t/R² + k)",
            0.5 * (found(inner)? + found(outer)?),
            thin,
            0.06,
        ),
    ])
}
