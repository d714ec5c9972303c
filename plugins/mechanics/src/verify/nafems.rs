//! NAFEMS' standard benchmarks (1990): LE1, LE10, LE11. The targets are stresses at a corner, which
//! bricks of eight nodes approach slowly; meshes are finer towards it.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;
use intrados_stage::Job;

use super::{Checks, Trouble, elastic, hold, model, near, solve, stress, within};
use crate::{
    mesh::{Mesh, mapped},
    model::{Action, Elastic, Load, Matter, System},
};

const STEEL: f64 = 210e9;

/// The quarter of an elliptic ring, x²/2² + y²/1² to x²/3.25² + y²/2.75², finer towards (2, 0): i
/// goes outward, j turns, `levels` are its planes.
fn ellipse([across, around]: [usize; 2], levels: &[f64]) -> Result<Mesh, Trouble> {
    let point = |i: usize, j: usize, k: usize| {
        let (s, t) = (i as f64 / across as f64, j as f64 / around as f64);
        let (s, angle) = (s * (0.25 + 0.75 * s), FRAC_PI_2 * t * (0.2 + 0.8 * t));
        let (inner, outer) = (
            DVec3::new(2.0 * angle.cos(), angle.sin(), 0.0),
            DVec3::new(3.25 * angle.cos(), 2.75 * angle.sin(), 0.0),
        );
        inner.lerp(outer, s) + DVec3::Z * levels[k]
    };
    Ok(mapped([across, around, levels.len() - 1], &["plate"], point, |_, _, _| Some(0))?)
}

/// Elliptic membrane pulled by 10 MPa on its outer edge: σ_y = 92.7 MPa at (2, 0).
pub(super) fn le1(job: &Job) -> Checks {
    let mut model = model(ellipse([20, 40], &[0.0, 0.1])?, Matter::Elastic(elastic(STEEL, 0.3)));
    hold(&mut model, 1, |p| near(p.y, 0.0));
    hold(&mut model, 0, |p| near(p.x, 0.0));
    hold(&mut model, 2, |p| near(p.z, 0.0));
    let edge = model.mesh.face_sets["i1"].iter().map(|&face| (face, -10e6)).collect();
    model.loads.push(Load { name: "pull".into(), action: Action::Faces(edge), history: vec![] });
    let structure = System::new(&model)?;
    let history = solve(&structure, 1.0, job)?;
    let found = stress(&structure, &history, DVec3::new(2.0, 0.0, 0.0), DVec3::Y)? / 1e6;
    Ok(vec![within("NAFEMS", "LE1: σ_y at the inner edge, MPa", found, 92.7, 0.02)])
}

/// The same, .6 m thick, pressed by 1 MPa from above, its outer edge held: σ_y = −5.38 MPa at
/// (2, 0) on top.
pub(super) fn le10(job: &Job) -> Checks {
    let mut model = model(
        ellipse([16, 28], &[0.0, 0.15, 0.3, 0.4, 0.48, 0.54, 0.575, 0.6])?,
        Matter::Elastic(elastic(STEEL, 0.3)),
    );
    let outer = model.mesh.node_sets["i1"].clone();
    for n in outer {
        model.holds.extend([(n, 0), (n, 1)]);
        if near(model.mesh.nodes[n as usize].z, 0.3) {
            model.holds.push((n, 2));
        }
    }
    hold(&mut model, 1, |p| near(p.y, 0.0));
    hold(&mut model, 0, |p| near(p.x, 0.0));
    let top = model.mesh.face_sets["k1"].iter().map(|&face| (face, 1e6)).collect();
    model.loads.push(Load { name: "press".into(), action: Action::Faces(top), history: vec![] });
    let structure = System::new(&model)?;
    let history = solve(&structure, 1.0, job)?;
    let found = stress(&structure, &history, DVec3::new(2.0, 0.0, 0.6), DVec3::Y)? / 1e6;
    Ok(vec![within("NAFEMS", "LE10: σ_y at the inner edge on top, MPa", found, -5.38, 0.03)])
}

/// Inner and outer (r, z) at a share of the way from the equator to the top: two spheres of radii 1
/// and 1.4, a taper, two cylinders.
fn profile(way: f64) -> [DVec3; 2] {
    let arc = |radius: f64, degrees: f64| {
        radius * DVec3::new(degrees.to_radians().cos(), 0.0, degrees.to_radians().sin())
    };
    let line = |a: DVec3, b: DVec3, s: f64| a.lerp(b, s);
    let (corner, taper, neck) = (arc(1.0, 45.0), arc(1.4, 30.0), DVec3::new(1.0, 0.0, 1.39));
    // Shares at which the four parts end: sphere, sphere against taper, cylinder against taper,
    // cylinder.
    let ends = [0.5, 0.7, 0.85, 1.0];
    let part = ends.iter().position(|&e| way <= e).unwrap_or(3);
    let from = if part == 0 { 0.0 } else { ends[part - 1] };
    let s = (way - from) / (ends[part] - from);
    let (middle, top) =
        (DVec3::new(corner.x, 0.0, 0.5 * (corner.z + 1.79)), DVec3::new(corner.x, 0.0, 1.79));
    let half = line(taper, neck, 0.5);
    match part {
        // Finer towards the equator.
        0 => [arc(1.0, 22.5 * s * (0.5 + 0.5 * s)), arc(1.4, 30.0 * s * (0.5 + 0.5 * s))],
        1 => [arc(1.0, 22.5 + 22.5 * s), line(taper, half, s)],
        2 => [line(corner, middle, s), line(half, neck, s)],
        _ => [line(middle, top, s), line(neck, DVec3::new(1.0, 0.0, 1.79), s)],
    }
}

/// Cylinder, taper and sphere with T = r + z: σ_z = −105 MPa at (1, 0, 0).
pub(super) fn le11(job: &Job) -> Checks {
    let [across, around, along] = [8, 12, 30];
    let point = |i: usize, j: usize, k: usize| {
        let [inner, outer] = profile(k as f64 / along as f64);
        let s = i as f64 / across as f64;
        let at = inner.lerp(outer, s * (0.5 + 0.5 * s));
        let (sin, cos) = (FRAC_PI_2 * j as f64 / around as f64).sin_cos();
        DVec3::new(at.x * cos, at.x * sin, at.z)
    };
    let mesh = mapped([across, around, along], &["solid"], point, |_, _, _| Some(0))?;
    let warmth = mesh.nodes.iter().map(|p| p.x.hypot(p.y) + p.z).collect();
    let mut model =
        model(mesh, Matter::Elastic(Elastic { expansion: 2.3e-4, ..elastic(STEEL, 0.3) }));
    for (set, component) in [("j0", 1), ("j1", 0), ("k0", 2), ("k1", 2)] {
        let nodes = model.mesh.node_sets[set].clone();
        model.holds.extend(nodes.into_iter().map(|n| (n, component)));
    }
    model.loads.push(Load {
        name: "heat".into(),
        action: Action::Temperature(warmth),
        history: vec![],
    });
    let structure = System::new(&model)?;
    let history = solve(&structure, 1.0, job)?;
    let found = stress(&structure, &history, DVec3::X, DVec3::Z)? / 1e6;
    Ok(vec![within("NAFEMS", "LE11: σ_z at the inner equator, MPa", found, -105.0, 0.03)])
}
