//! Janney, Hognestad and McHenry (1956), by Xu and Lu (2016): a beam 152.4 × 304.8 mm, span 2743
//! mm, loaded at its thirds, three No. 5 bars (600 mm²) at 210.8 mm from the top, no stirrups; f_c
//! 36.2 MPa, f_y 333 MPa. Half of it is computed, on plates of 76 mm that the source does not give.

use intrados_mechanics::prelude::*;

use super::{
    record::{AT_12_MM, FigureCheck, PEAK_MOMENT, YIELD, recorded_meshes},
    *,
};

const SPAN: f64 = 2.7432;
const THIRD: f64 = SPAN / 3.0;
const PLATE: f64 = 0.0762;

/// x from midspan, y from the bottom; the load's nodes and those whose deflection is controlled.
fn beam(h: f64) -> (Model, Vec<u32>, Vec<u32>) {
    let (long, deep, wide) = (1.524, 0.3048, 0.1524);
    let load = 0.5 * THIRD;
    let x = divide(0.0, long, &[load - 0.5 * PLATE, load + 0.5 * PLATE, 0.5 * SPAN], h);
    let mesh = block(&x, &divide(0.0, deep, &[], h), &[0.0, wide], "concrete").unwrap();
    let mut model = model(mesh, concrete(Given { fcm: Some(36.2e6), ..Given::default() }));
    lay(
        &mut model,
        "3 No. 5",
        [DVec3::new(0.0, deep - 0.2108, 0.5 * wide), DVec3::new(long, deep - 0.2108, 0.5 * wide)],
        [3.0, 600e-6],
        333e6,
    );
    hold(&mut model, 0, |p| near(p.x, 0.0));
    hold(&mut model, 1, |p| near(p.x, 0.5 * SPAN) && near(p.y, 0.0));
    hold(&mut model, 2, |p| near(p.y, 0.0) && near(p.z, 0.0));
    let plate = nodes(&model.mesh, |p| near(p.y, deep) && (p.x - load).abs() < 0.5 * PLATE + 1e-6);
    model.loads.push(kilonewton(&plate, DVec3::NEG_Y));
    let middle = nodes(&model.mesh, |p| near(p.x, 0.0) && near(p.y, 0.0));
    (model, plate, middle)
}

#[test]
#[ignore = "minutes"]
fn janney_beam() {
    let data = measured("janney1956_beam.csv");
    let expected = peak(&data);
    let mut curves =
        vec![Curve { name: "Janney et al. (1956)".into(), points: data.clone(), marked: true }];
    let mut check = FigureCheck::default();
    for h in recorded_meshes("Janney") {
        println!("Janney's beam, bricks of {:.1} mm", 1e3 * h);
        let (model, _, middle) = beam(h);
        // Each half bears P; the moment between the loads is P·span/3.
        let pushed = pushed(&model, 0, mean(&middle, 1, -1.0), 0.5e-3, 45e-3);
        let moment = |p: &(f64, f64)| (1e3 * p.0, THIRD * p.1);
        let found: Vec<(f64, f64)> = pushed.curve.iter().map(moment).collect();
        let yields = pushed.yields.as_ref().map_or((f64::NAN, f64::NAN), moment);
        let top = peak(&found);
        println!(
            "  at 5, 10 and 20 mm {:.1}, {:.1} and {:.1} kNm, measured 19.0, 34.0 and 38.8",
            ordinate(&found, 5.0),
            ordinate(&found, 10.0),
            ordinate(&found, 20.0)
        );
        check.compare("Janney", YIELD, h, yields.1);
        check.compare("Janney", AT_12_MM, h, ordinate(&found, 12.0));
        check.compare("Janney", PEAK_MOMENT, h, top.1);
        println!(
            "  bars yield at {:.1} mm, measured some 11; peak at {:.1} mm, measured at {:.1}",
            yields.0, top.0, expected.0
        );
        curves.push(Curve {
            name: format!("bricks of {:.1} mm", 1e3 * h),
            points: found,
            marked: false,
        });
        // After each mesh: the finest takes long.
        draw(
            "janney",
            "Beam of Janney, Hognestad and McHenry: bars that yield",
            ["deflection at midspan, mm", "moment, kNm"],
            &curves,
        );
    }
    check.finish();
}
