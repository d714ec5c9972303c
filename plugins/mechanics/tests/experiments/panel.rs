//! Winkler (2001), series A: an L of plain concrete, 500 mm, legs 250 mm, 100 mm thick; the foot
//! held, pushed up 30 mm from the tip.
//!
//! E 25.85 GPa, ν .18, f_t 2.7 MPa, f_c 31 MPa. The fracture energy was not measured: the 65 N/m
//! that is often quoted is what MC1990 gives for 16 mm aggregate (.03 (31/10)^.7 = .066 N/mm). As
//! everywhere here MC2010's is taken; the other is shown beside it.
//!
//! The measured stiffness is 40 kN/mm. Timoshenko's beam with the foot clamped gives 52 to 61 with
//! this E, depending on where the legs are taken to meet, this model 61, and those of others 44 to
//! 56 (phase field, embedded cracks, gradient plasticity; PSAAPGroupLinder/lShapedPanelBenchmark),
//! with the load at the very tip or on a steel block: so neither support nor place of the load
//! explains it, and the displacement measured holds some of the rig's. The load is what is
//! compared.

use intrados_mechanics::{material::concrete::fracture_energy, prelude::*};

use super::{
    record::{FigureCheck, OTHER_ENERGY, PEAK, recorded_meshes},
    *,
};

const THICK: f64 = 0.1;

fn panel(h: f64, gf: f64) -> (Model, Vec<u32>) {
    let lines = divide(0.0, 0.5, &[0.25, 0.47], h);
    let mut mesh = block(&lines, &lines, &[0.0, THICK], "concrete").unwrap();
    let centres: Vec<DVec3> = (0..mesh.hexes.len() as u32).map(|e| mesh.centre(e)).collect();
    let mut places = centres.iter();
    mesh.hexes.retain(|_| places.next().is_some_and(|c| c.x < 0.25 || c.y > 0.25));
    let given = Given {
        fcm: Some(31e6),
        fctm: Some(2.7e6),
        modulus: Some(25.85e9),
        poisson: Some(0.18),
        fracture_energy: Some(gf),
        ..Given::default()
    };
    let mut model = model(without_orphans(mesh), concrete(given));
    hold(&mut model, 0, |p| near(p.y, 0.0));
    hold(&mut model, 1, |p| near(p.y, 0.0));
    hold(&mut model, 2, |p| near(p.y, 0.0) && near(p.z, 0.0));
    let loaded = nodes(&model.mesh, |p| near(p.x, 0.47) && near(p.y, 0.25));
    model.loads.push(kilonewton(&loaded, DVec3::Y));
    (model, loaded)
}

fn without_orphans(mut mesh: Mesh) -> Mesh {
    let unused = mesh.unused_nodes();
    let mut number = vec![0; mesh.nodes.len()];
    let (mut next, mut old) = (0, 0);
    for (n, number) in number.iter_mut().enumerate() {
        *number = next;
        next += u32::from(!unused.contains(&(n as u32)));
    }
    mesh.nodes.retain(|_| {
        old += 1;
        !unused.contains(&(old - 1))
    });
    mesh.hexes.iter_mut().for_each(|h| h.nodes = h.nodes.map(|n| number[n as usize]));
    mesh.node_sets.clear();
    mesh.face_sets.clear();
    mesh
}

#[test]
#[ignore = "minutes"]
fn winkler_l_panel() {
    let data = measured("winkler_lpanel_series_A.csv");
    let data: Vec<(f64, f64)> = data.into_iter().map(|(mm, newton)| (mm, newton / 1e3)).collect();
    let expected = peak(&data);
    let code = fracture_energy(31e6);
    let mut curves =
        vec![Curve { name: "Winkler (2001), series A".into(), points: data.clone(), marked: true }];
    let mut check = FigureCheck::default();
    let chosen = ["EXPERIMENT_SIZES", "EXPERIMENT_COARSE"];
    let all = chosen.iter().all(|name| std::env::var_os(name).is_none());
    for (h, gf, quantity) in recorded_meshes("Winkler")
        .into_iter()
        .map(|h| (h, code, PEAK))
        .chain(all.then_some((0.0125, 65.0, OTHER_ENERGY)))
    {
        println!("Winkler's panel, bricks of {:.1} mm, G_f {gf:.0} N/m", 1e3 * h);
        let (model, loaded) = panel(h, gf);
        let found: Vec<(f64, f64)> = pushed(&model, 0, mean(&loaded, 1, 1.0), 0.0125e-3, 0.5e-3)
            .curve
            .iter()
            .map(|p| (1e3 * p.0, p.1))
            .collect();
        let top = peak(&found);
        println!(
            "  {:.1} kN/mm at first, measured {:.1}; peak at {:.3} mm, measured {:.3}; {:.2} and {:.2} kN at .3 and .5 mm, measured {:.2} and {:.2}",
            found[1].1 / found[1].0,
            ordinate(&data, 0.05) / 0.05,
            top.0,
            expected.0,
            ordinate(&found, 0.3),
            ordinate(&found, 0.5),
            ordinate(&data, 0.3),
            ordinate(&data, 0.5)
        );
        check.compare("Winkler", quantity, h, top.1);
        curves.push(Curve {
            name: format!("{:.2} mm, G_f {gf:.0} N/m", 1e3 * h),
            points: found,
            marked: false,
        });
        // After each mesh: the finest takes long.
        draw(
            "winkler",
            "L-shaped panel of plain concrete",
            ["displacement of the load, mm", "load, kN"],
            &curves,
        );
    }
    check.finish();
}
