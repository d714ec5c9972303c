//! Soesianawati (1986), unit 1, of the PEER and NIST tables (dimensions, strengths, cover and the
//! 199.6 kN are those of row 129 of the ACI 369 database, see `columns.rs`): a column 400 × 400 mm, cantilever of
//! 1600 mm, twelve 16 mm bars (f_y 446 MPa), hoops of 7 mm at 85 mm (364 MPa) of which 13 mm clear
//! cover; f_c 46.5 MPa, axial load 744 kN. Half of it is computed. The hoops are laid as bars: they
//! confine by what the concrete does, no law of confined concrete is given; all are 85 mm apart
//! (outside of the hinge 170 mm were). The test was cyclic: its peaks were +199.6 and −186.2 kN, on
//! the mean 192.9; here it is pushed one way.
//!
//! The model knows no geometry of second order: the axial load's moment Nδ at the foot is taken off
//! the force, Nδ/L. Bars end in the held foot, no strain penetrates into it.

use intrados_mechanics::prelude::*;

use super::{
    record::{FigureCheck, PEAK, recorded_meshes},
    *,
};

const LONG: f64 = 1.6;
const SIDE: f64 = 0.4;
const AXIAL: f64 = 744.0;
const MEAN_PEAK: f64 = 192.9;

/// x along the push, y up, z across from the plane of symmetry.
fn column(h: f64) -> (Model, Vec<u32>) {
    let up = [divide(0.0, 0.8, &[], h), divide(0.8, LONG, &[], 2.0 * h).split_off(1)].concat();
    let half = 0.5 * SIDE;
    let mesh = block(&divide(0.0, SIDE, &[], h), &up, &[0.0, half], "concrete").unwrap();
    let mut model = model(mesh, concrete(Given { fcm: Some(46.5e6), ..Given::default() }));
    let bar = 0.25 * std::f64::consts::PI * 0.016f64.powi(2);
    let (near_face, inner) = (0.028, 0.028 + (SIDE - 0.056) / 3.0);
    for (x, z) in [
        (near_face, 0.172),
        (near_face, 0.0573),
        (inner, 0.172),
        (SIDE - inner, 0.172),
        (SIDE - near_face, 0.172),
        (SIDE - near_face, 0.0573),
    ] {
        lay(&mut model, "HD16", [DVec3::new(x, 0.0, z), DVec3::new(x, LONG, z)], [1.0, bar], 446e6);
    }
    let (hoop, a) = (0.25 * std::f64::consts::PI * 0.007f64.powi(2), 0.0165);
    for k in 0..18 {
        let y = 0.0425 + 0.085 * f64::from(k);
        lay(
            &mut model,
            "hoop",
            [DVec3::new(a, y, half - a), DVec3::new(SIDE - a, y, half - a)],
            [1.0, hoop],
            364e6,
        );
        for x in [a, SIDE - a] {
            lay(
                &mut model,
                "hoop",
                [DVec3::new(x, y, 0.0), DVec3::new(x, y, half - a)],
                [1.0, hoop],
                364e6,
            );
        }
    }
    (0..2).for_each(|c| hold(&mut model, c, |p| near(p.y, 0.0)));
    hold(&mut model, 2, |p| near(p.z, 0.0) || near(p.y, 0.0));
    let top = nodes(&model.mesh, |p| near(p.y, LONG));
    model.loads.push(kilonewton(&top, DVec3::X));
    let axial =
        Load { history: vec![(0.0, 0.0), (1.0, 0.5 * AXIAL)], ..kilonewton(&top, DVec3::NEG_Y) };
    model.loads.push(Load { name: "axial".into(), ..axial });
    (model, top)
}

#[test]
#[ignore = "minutes"]
fn soesianawati_column() {
    let mut curves = vec![Curve {
        name: "mean peak measured".into(),
        points: vec![(0.0, MEAN_PEAK), (60.0, MEAN_PEAK)],
        marked: true,
    }];
    let mut check = FigureCheck::default();
    for h in recorded_meshes("Soesianawati") {
        println!("Soesianawati's column, bricks of {:.1} mm", 1e3 * h);
        let (model, top) = column(h);
        let whole = |p: &(f64, f64)| (1e3 * p.0, 2.0 * p.1 - AXIAL * p.0 / LONG);
        let found: Vec<(f64, f64)> =
            pushed(&model, 0, mean(&top, 0, 1.0), 0.5e-3, 60e-3).curve.iter().map(whole).collect();
        let highest = peak(&found);
        println!(
            "  peak at {:.1} mm; {:.1}, {:.1} and {:.1} kN at 10, 20 and 40 mm",
            highest.0,
            ordinate(&found, 10.0),
            ordinate(&found, 20.0),
            ordinate(&found, 40.0)
        );
        check.compare("Soesianawati", PEAK, h, highest.1);
        curves.push(Curve {
            name: format!("bricks of {:.0} mm", 1e3 * h),
            points: found,
            marked: false,
        });
        // After each mesh: the finest takes long.
        draw(
            "soesianawati",
            "Column of Soesianawati, unit 1, pushed one way",
            ["deflection at the top, mm", "lateral force, kN"],
            &curves,
        );
    }
    check.finish();
}
