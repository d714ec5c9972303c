//! Vecchio and Collins (1982, 1986), series PV: panels of .89 × .89 × .07 m with two layers of a
//! welded mesh, sheared by keys along all four edges. Each chosen before it was computed: steel that
//! yields both ways (PV10), across alone, more and more of it (PV19, PV20, PV21), concrete that
//! crushes before any steel yields (PV27), and the same pressed along both edges by .39 of the shear
//! stress, as a prestressed wall is (PV23). Strengths, diameters and spacings as in the panels of
//! github.com/andrefmello91/Reinforced-Concrete-Membrane (PanelExamples.cs); ultimate shear stresses
//! and what pressed PV23 are **from memory of the paper's table, to be checked**.

use super::{
    record::{FigureCheck, STRESS, recorded_meshes},
    *,
};

const SIDE: f64 = 0.89;
const THICK: f64 = 0.07;
/// Of the layers from one face, m.
const LAYERS: [f64; 2] = [0.02, 0.05];

/// A panel.
struct Panel {
    name: &'static str,
    /// MPa.
    strength: f64,
    /// Along x and y: diameter and spacing of a layer's wires, mm, and where they yield, MPa.
    mesh: [[f64; 3]; 2],
    /// Compression on all edges, over the shear stress.
    pressed: f64,
    mode: &'static str,
}

const PANELS: [Panel; 6] = [
    Panel {
        name: "PV10",
        strength: 14.5,
        mesh: [[6.35, 50.55, 276.0], [4.70, 49.57, 276.0]],
        pressed: 0.0,
        mode: "steel yields both ways, then concrete",
    },
    Panel {
        name: "PV19",
        strength: 19.0,
        mesh: [[6.35, 50.55, 458.0], [4.01, 50.82, 299.0]],
        pressed: 0.0,
        mode: "steel across yields, then concrete",
    },
    Panel {
        name: "PV20",
        strength: 19.6,
        mesh: [[6.35, 50.55, 460.0], [4.47, 50.38, 297.0]],
        pressed: 0.0,
        mode: "steel across yields, then concrete",
    },
    Panel {
        name: "PV27",
        strength: 20.5,
        mesh: [[6.35, 50.55, 442.0], [6.35, 50.55, 442.0]],
        pressed: 0.0,
        mode: "concrete, steel elastic",
    },
    Panel {
        name: "PV21",
        strength: 19.5,
        mesh: [[6.35, 50.55, 458.0], [5.41, 50.52, 302.0]],
        pressed: 0.0,
        mode: "steel across yields, then concrete",
    },
    Panel {
        name: "PV23",
        strength: 20.5,
        mesh: [[6.35, 50.55, 518.0], [6.35, 50.55, 518.0]],
        pressed: 0.39,
        mode: "concrete, steel elastic",
    },
];

/// A panel under 1 MPa of shear and what presses it, and the row that says its distortion.
fn model_of(panel: &Panel, h: f64) -> (Model, Vec<(u32, u8, f64)>) {
    let lines = divide(0.0, SIDE, &[], h);
    let mesh = block(&lines, &lines, &[0.0, THICK], "concrete").unwrap();
    let given = Given { fcm: Some(1e6 * panel.strength), ..Given::default() };
    let mut model = model(mesh, concrete(given));
    for (direction, [diameter, spacing, yields]) in panel.mesh.into_iter().enumerate() {
        let area = 0.25 * PI * (1e-3 * diameter).powi(2);
        let count = (1e3 * SIDE / spacing).round();
        // As much steel as the spacing says, whatever is left at the edges.
        let each = area * 1e3 * SIDE / (spacing * count);
        for (k, z) in (0..count as u32).flat_map(|k| LAYERS.map(|z| (k, z))) {
            let at = SIDE * (f64::from(k) + 0.5) / count;
            let [mut from, mut to] = [DVec3::new(at, at, z); 2];
            (from[direction], to[direction]) = (0.0, SIDE);
            lay(&mut model, ["along", "across"][direction], [from, to], [1.0, each], 1e6 * yields);
        }
    }
    hold(&mut model, 2, |p| near(p.z, 0.0));
    hold(&mut model, 0, |p| near(p.x, 0.0) && near(p.y, 0.0));
    hold(&mut model, 1, |p| near(p.y, 0.0) && (near(p.x, 0.0) || near(p.x, SIDE)));
    // Each edge bears its share along itself, and is pressed inwards: nodes by the length of edge
    // that is theirs.
    let (mut forces, mut row) = (Vec::new(), Vec::new());
    for (across, end, sign) in [(0, 0.0, -1.0), (0, SIDE, 1.0), (1, 0.0, -1.0), (1, SIDE, 1.0)] {
        let along = 1 - across;
        let edge = nodes(&model.mesh, |p| near(p[across], end));
        let own = |at: f64| {
            let k = lines.iter().position(|x| near(*x, at)).unwrap();
            0.5 * (lines[(k + 1).min(lines.len() - 1)] - lines[k.saturating_sub(1)])
        };
        for n in edge {
            // Both faces of the panel have a line of nodes.
            let share = 0.5 * own(model.mesh.nodes[n as usize][along]);
            let mut force = DVec3::ZERO;
            force[along] = sign * 1e6 * share * THICK;
            force[across] = -sign * panel.pressed * 1e6 * share * THICK;
            forces.push((n, force));
            row.push((n, along as u8, sign * share / (SIDE * SIDE)));
        }
    }
    let action = Action::Nodes(forces);
    model.loads.push(Load { name: "shear".into(), action, history: vec![(0.0, 0.0)] });
    (model, row)
}

#[test]
#[ignore = "minutes"]
fn panels_in_shear() {
    let only = std::env::var("EXPERIMENT_ONLY").ok();
    let mut check = FigureCheck::default();
    for panel in PANELS.iter().filter(|p| only.as_deref().is_none_or(|o| o == p.name)) {
        for h in recorded_meshes(panel.name) {
            println!("{}, bricks of {:.0} mm", panel.name, 1e3 * h);
            let (model, row) = model_of(panel, h);
            let found = pushed(&model, 0, row, 1e-4, 0.016);
            let top = peak(&found.curve);
            let yields = found.yields.map_or("steel does not yield".into(), |(at, stress)| {
                format!("steel yields at {stress:.2} MPa, {:.2} ‰", 1e3 * at)
            });
            println!("  peak at {:.2} ‰; {yields}; measured: {}", 1e3 * top.0, panel.mode);
            check.compare(panel.name, STRESS, h, top.1);
        }
    }
    check.finish();
}
