//! Shells and bars of the mesh.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;
use intrados_stage::Job;

use super::{Checks, Trouble, always, check, elastic, solve, within};
use crate::{
    material::steel::Bar,
    mesh::{Cell, Mesh},
    model::{Action, Elastic, Load, Matter, Model, Rotations, System},
};

/// n × n quadrilaterals; node (i, j) is i + (n + 1) j.
fn sheet(n: usize, at: impl Fn(f64, f64) -> DVec3) -> Mesh {
    let side = n + 1;
    let nodes = (0..side * side)
        .map(|k| at((k % side) as f64 / n as f64, (k / side) as f64 / n as f64))
        .collect();
    let first = (0..n * n).map(|k| (k % n + side * (k / n)) as u32);
    let s = side as u32;
    let shells = first.map(|a| Cell { nodes: [a, a + 1, a + s + 1, a + s], region: 0 }).collect();
    Mesh { nodes, shells, regions: vec!["sheet".into()], ..Mesh::default() }
}

/// Holds components 0–2 (displacements) and 3–5 (rotations) of a node.
fn hold(model: &mut Model, rotations: &Rotations, node: u32, components: &[u8]) {
    for &c in components {
        let node = if c < 3 { node } else { rotations.of(node).unwrap_or(node) };
        model.holds.push((node, c % 3));
    }
}

/// An eighth or quarter of a cylinder about y: diaphragm at y = 0, symmetry at the other end and at
/// x = 0, `last` held along the other straight side.
fn cylinder(
    n: usize,
    [radius, length, angle]: [f64; 3],
    sheet_of: (Elastic, f64),
    last: &[u8],
) -> Model {
    let mesh = sheet(n, |a, b| {
        DVec3::new(radius * (a * angle).sin(), b * length, radius * (a * angle).cos())
    });
    let rotations = Rotations::new(&mesh);
    let bodies = vec![always(Matter::Shell { elastic: sheet_of.0, thickness: sheet_of.1 })];
    let mut model = Model { mesh, bodies, ..Model::default() };
    for node in 0..model.mesh.nodes.len() {
        let (i, j) = (node % (n + 1), node / (n + 1));
        for (at, components) in
            [(j == 0, &[0, 2][..]), (j == n, &[1, 3, 5]), (i == 0, &[0, 4, 5]), (i == n, last)]
        {
            if at {
                hold(&mut model, &rotations, node as u32, components);
            }
        }
    }
    model
}

/// Roof under its weight (90 a unit of area): .3024 at the middle of the free edge.
pub(super) fn scordelis_lo(job: &Job) -> Checks {
    let deflection = |n: usize| -> Result<f64, Trouble> {
        let elastic = Elastic { density: 90.0 / 0.25, ..elastic(4.32e8, 0.0) };
        let mut model = cylinder(n, [25.0, 25.0, 40f64.to_radians()], (elastic, 0.25), &[]);
        model.loads.push(Load {
            name: "weight".into(),
            action: Action::Weight(-DVec3::Z),
            history: vec![],
        });
        let structure = System::new(&model)?;
        Ok(-solve(&structure, 1.0, job)?.x[3 * ((n + 1) * (n + 1) - 1) + 2])
    };
    Ok(vec![
        // OOFEM's MITC4 on the same four elements a side finds 3.77799 in.
        within(
            "shell",
            "Scordelis-Lo roof, 4 × 4: deflection of the free edge",
            deflection(4)?,
            3.777_99 / 12.0,
            5e-3,
        ),
        within(
            "shell",
            "Scordelis-Lo roof, 16 × 16: deflection of the free edge",
            deflection(16)?,
            0.3024,
            0.02,
        ),
    ])
}

/// An eighth of a cylinder on diaphragms, pinched by 1: 1.8248e-5 under the load.
pub(super) fn pinched(job: &Job) -> Checks {
    let deflection = |n: usize| -> Result<f64, Trouble> {
        let mut model =
            cylinder(n, [300.0, 300.0, FRAC_PI_2], (elastic(3e6, 0.3), 3.0), &[2, 3, 4]);
        let top = (n * (n + 1)) as u32;
        model.loads.push(Load {
            name: "pinch".into(),
            action: Action::Nodes(vec![(top, -0.25 * DVec3::Z)]),
            history: vec![],
        });
        let structure = System::new(&model)?;
        Ok(-solve(&structure, 1.0, job)?.x[3 * top as usize + 2])
    };
    let [coarse, fine] = [deflection(8)?, deflection(24)?];
    Ok(vec![
        within(
            "shell",
            "pinched cylinder, 24 × 24: deflection under the load",
            fine,
            1.8248e-5,
            0.04,
        ),
        // From below, as a conforming shell must.
        check("shell", "pinched cylinder: 8 × 8 over 24 × 24, below 1", coarse / fine, 0.85, 0.15),
    ])
}

/// Two bars in a V and their elastic limit: N = P/(2 sin α), w = P L/(2 E A sin² α); then heat,
/// held.
pub(super) fn truss(job: &Job) -> Checks {
    let (area, modulus, half) = (4e-4, 200e9, 1.5);
    let nodes = vec![DVec3::new(-2.0, 0.0, half), DVec3::new(2.0, 0.0, half), DVec3::ZERO];
    let rods = vec![Cell { nodes: [0, 2], region: 0 }, Cell { nodes: [1, 2], region: 0 }];
    let mesh = Mesh { nodes, rods, regions: vec!["bars".into()], ..Mesh::default() };
    let steel = Bar { modulus, ..Bar::new(400e6)? };
    let bodies = vec![always(Matter::Bar { steel, area, expansion: 1.2e-5, density: 7850.0 })];
    let mut model = Model { mesh, bodies, ..Model::default() };
    (0..3).for_each(|c| model.holds.extend([(0, c), (1, c)]));
    model.holds.push((2, 1));
    let (force, sine) = (120e3, 0.6);
    model.loads.push(Load {
        name: "pull".into(),
        action: Action::Nodes(vec![(2, -force * DVec3::Z)]),
        history: vec![(0.0, 0.0), (1.0, 1.0), (2.0, 3.0)],
    });
    let structure = System::new(&model)?;
    let history = solve(&structure, 1.0, job)?;
    let (stress, sag) =
        (force / (2.0 * sine * area), force * 2.5 / (2.0 * modulus * area * sine * sine));
    // Thrice the load is past yield, on the hardening line: ε = f_y/E + (σ − f_y)/E_h.
    let later = solve(&structure, 2.0, job)?;
    let strain = 400e6 / modulus + (3.0 * stress - 400e6) / 2e9;
    Ok(vec![
        within("bar", "two bars in a V: stress", structure.bar_stress(0, &history)?, stress, 1e-9),
        within("bar", "two bars in a V: sag", -history.x[8], sag, 1e-9),
        within("bar", "two bars in a V past yield: sag", -later.x[8], strain * 2.5 / sine, 1e-6),
    ])
}
