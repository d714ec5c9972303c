//! The dual: what softening of an element does to a reading, by one primal and one dual solution
//! against two full ones.

use glam::DVec3;
use intrados_stage::Job;

use super::{Checks, Trouble, check, hold, host, model, near, order, solve};
use crate::{
    mesh::{block, divide},
    model::{Action, Elastic, Gauge, Load, Matter, Model, System},
};

/// A clamped beam under a slanting weight.
fn beam() -> Result<Model, Trouble> {
    let mesh = block(
        &divide(0.0, 2.0, &[], 0.25),
        &divide(0.0, 0.3, &[], 0.15),
        &divide(0.0, 0.2, &[], 0.1),
        "beam",
    )?;
    let mut model = model(
        mesh,
        Matter::Elastic(Elastic { modulus: 30e9, poisson: 0.2, expansion: 1e-5, density: 2500.0 }),
    );
    (0..3).for_each(|c| hold(&mut model, c, |p| near(p.x, 0.0)));
    model.loads.push(Load {
        name: "weight".into(),
        action: Action::Weight(DVec3::new(20.0, -9.81, 3.0)),
        history: vec![],
    });
    Ok(model)
}

/// Its error must fall as δ².
pub(super) fn softening(job: &Job) -> Checks {
    let model = beam()?;
    let (skin, tip) = (
        host(&model.mesh, DVec3::new(0.32, 0.28, 0.04))?,
        host(&model.mesh, DVec3::new(1.9, 0.1, 0.1))?,
    );
    let slope = DVec3::new(0.8, 0.6, 0.0);
    let gauges = [
        Gauge::Strain(skin, slope),
        Gauge::Stress(skin, slope),
        Gauge::Displacement(tip, DVec3::Y),
    ];
    let structure = System::new(&model)?;
    let influences = structure.influences(&gauges, &solve(&structure, 1.0, job)?, job)?;
    let read = |hex: usize, softening: f64| -> Result<Vec<f64>, Trouble> {
        let mut softer = model.clone();
        softer.softening = vec![0.0; model.mesh.hexes.len()];
        softer.softening[hex] = softening;
        let structure = System::new(&softer)?;
        let history = solve(&structure, 1.0, job)?;
        Ok(structure.read(&gauges, &history)?)
    };
    let mut checks = Vec::new();
    for (place, hex) in
        [("its own brick", skin.hex as usize), ("the next brick", skin.hex as usize + 1)]
    {
        let [large, small] = [read(hex, 0.02)?, read(hex, 0.01)?];
        for (i, gauge) in ["strain", "stress", "displacement"].into_iter().enumerate() {
            let error = |after: &[f64], d: f64| {
                after[i] - influences[i].reading - d * influences[i].by_softening[hex]
            };
            let found = order(error(&large, 0.02), error(&small, 0.01));
            checks.push(check(
                "dual",
                format!("{gauge} by softening of {place}: order of the error in δ"),
                found,
                2.0,
                0.1,
            ));
        }
        let change = small[0] - influences[0].reading;
        let told = 0.01 * influences[0].by_softening[hex];
        checks.push(check(
            "dual",
            format!("strain by softening {place} by 1 %: told over found"),
            told / change,
            1.0,
            0.02,
        ));
    }
    Ok(checks)
}
