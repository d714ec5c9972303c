//! Cracks and joints.

use glam::DVec3;
use intrados_stage::Job;

use super::solids::traction;
use super::{Checks, Trouble, always, check, elastic, hold, near, node, steps, within};
use crate::{
    element::interface::Friction,
    material::{
        concrete::Given,
        law::{Cracks, Setting},
    },
    mesh::block,
    model::{Action, Control, Drive, Load, March, MarchSettings, Matter, Model, System},
};

const LENGTH: f64 = 0.1;
const FRACTURE: f64 = 100.0;

/// Largest stress (Pa) and work over G_f A of a bar of `n` cubes that is torn apart by controlling
/// the opening of its weakest one, which cracks as `cracks` says with the fracture energy `energy`,
/// N/m.
fn torn(n: usize, cracks: Cracks, energy: f64, job: &Job) -> Result<[f64; 2], Trouble> {
    let h = LENGTH / n as f64;
    let mut mesh = block(&steps(0.0, LENGTH, n), &[0.0, h], &[0.0, h], "bar")?;
    let weak = (n / 2) as f64 * h;
    mesh.assign("weak", |c| c.x > weak && c.x < weak + h);
    let concrete = |strength: f64| -> Result<Matter, Trouble> {
        let given = Given {
            fcm: Some(30e6),
            fctm: Some(strength),
            modulus: Some(30e9),
            poisson: Some(0.0),
            fracture_energy: Some(energy),
            ..Given::default()
        };
        Ok(Matter::Concrete(Box::new((
            given.complete()?,
            Setting { cracks, ..Setting::short_term(h) },
        ))))
    };
    let mut model = Model {
        bodies: vec![always(concrete(3.0e6)?), always(concrete(2.97e6)?)],
        mesh,
        ..Model::default()
    };
    hold(&mut model, 0, |p| near(p.x, 0.0));
    hold(&mut model, 1, |p| near(p.y, 0.0));
    hold(&mut model, 2, |p| near(p.z, 0.0));
    let end = model.mesh.node_sets["x1"].clone();
    let pull = end.iter().map(|&n| (n, 0.25 * DVec3::X)).collect();
    model.loads.push(Load {
        name: "pull".into(),
        action: Action::Nodes(pull),
        history: vec![(0.0, 0.0)],
    });
    let sides = [
        node(&model.mesh, DVec3::new(weak + h, 0.0, 0.0))?,
        node(&model.mesh, DVec3::new(weak, 0.0, 0.0))?,
    ];
    let structure = System::new(&model)?;
    let drive = Drive::Raised {
        loads: vec![(0, 1.0)],
        control: Control::Row(vec![(sides[0], 0, 1.0), (sides[1], 0, -1.0)]),
    };
    let settings = MarchSettings { tolerance: 1e-5, ..MarchSettings::default() };
    let mut march = March::new(&structure, structure.rest(0.0), drive, settings);
    // To five times G_f/f_t: MC2010's curve, that of planes, ends there; of the exponential one
    // e^(−5) of the strength is left, and as much of the work.
    let (first, last, count) = (1e-7, 5.0 * FRACTURE / 2.97e6, 100);
    let (mut work, mut peak, mut opened, mut before) = (0.0, 0.0_f64, 0.0, [0.0; 2]);
    for k in 0..=count {
        let opening = first * f64::powf(last / first, f64::from(k) / f64::from(count));
        march.advance(f64::from(k + 1), opening - opened, job, |history, _| {
            let now = [history.factor, history.x[3 * end[0] as usize]];
            work += 0.5 * (now[0] + before[0]) * (now[1] - before[1]);
            (peak, before) = (peak.max(now[0]), now);
            Ok(())
        })?;
        opened = opening;
    }
    Ok([peak / (h * h), work / (FRACTURE * h * h)])
}

/// One crack, whatever the mesh: work G_f A. By the law that members use, in planes; and once by
/// one damage for all directions, which `--crack-law diffuse` takes.
pub(super) fn localisation(job: &Job) -> Checks {
    let mut checks = Vec::new();
    for (n, cracks) in
        [(4, Cracks::Planes), (10, Cracks::Planes), (20, Cracks::Planes), (10, Cracks::Diffuse)]
    {
        let [peak, work] = torn(n, cracks, FRACTURE, job)?;
        let whole = if cracks == Cracks::Planes { 1.0 } else { 1.0 - (-5f64).exp() };
        checks.push(check(
            "crack",
            format!("bar of {n} cubes torn open to 5 G_f/f_t, {cracks:?}: work/(G_f A)"),
            work,
            whole,
            0.01,
        ));
        checks.push(within(
            "crack",
            format!("bar of {n} cubes torn apart, {cracks:?}: strength, Pa"),
            peak,
            2.97e6,
            0.01,
        ));
    }
    Ok(checks)
}

/// A dry joint of height a between two stiff blocks, with the stiffness E/a that Janssen gives it
/// (1983): k_r = E b a²/12 while it is closed (M ≤ N a/6), then (9/8) E b a² m (2m − 1)² with m =
/// M/(N a).
pub(super) fn janssen(job: &Job) -> Checks {
    let (height, width, modulus, normal) = (0.3, 0.5, 30e9, 1e6);
    let mut checks = Vec::new();
    for m in [0.1, 0.25, 0.35] {
        let mut mesh = block(&[0.0, 0.1, 0.2], &steps(0.0, height, 40), &[0.0, width], "block")?;
        let region = mesh.region("joint");
        mesh.separate(|mesh, [face, _]| near(mesh.face_middle(face).0.x, 0.1).then_some(region));
        let stiff = Matter::Elastic(elastic(1e3 * modulus, 0.0));
        let joint = Matter::Joint(Friction {
            normal: modulus / height,
            shear: modulus / height,
            friction: 0.5,
            cohesion: 0.0,
        });
        let mut model =
            Model { bodies: vec![always(stiff), always(joint)], mesh, ..Model::default() };
        (0..3).for_each(|c| hold(&mut model, c, |p| near(p.x, 0.0)));
        let moment = m * normal * height;
        let end = model.mesh.face_sets["x1"].clone();
        let thrust = traction(&model.mesh, &end, |_, _| -normal / (width * height) * DVec3::X)?;
        let bending = traction(&model.mesh, &end, |p, _| {
            -moment * (p.y - 0.5 * height) * 12.0 / (width * height.powi(3)) * DVec3::X
        })?;
        model.loads.push(Load {
            name: "thrust".into(),
            action: thrust,
            history: vec![(0.0, 0.0), (1.0, 1.0)],
        });
        model.loads.push(Load {
            name: "bending".into(),
            action: bending,
            history: vec![(1.0, 0.0), (2.0, 1.0)],
        });
        let structure = System::new(&model)?;
        let mut march =
            March::new(&structure, structure.rest(0.0), Drive::Loads, MarchSettings::default());
        for part in 0..=8 {
            march.advance(1.0 + f64::from(part) / 8.0, 0.0, job, |_, _| Ok(()))?;
        }
        let history = march.history;
        let along = |y: f64| {
            Ok::<f64, Trouble>(history.x[3 * node(&model.mesh, DVec3::new(0.2, y, 0.0))? as usize])
        };
        let found = moment / ((along(0.0)? - along(height)?) / height);
        let share =
            if m <= 1.0 / 6.0 { 1.0 / 12.0 } else { 9.0 / 8.0 * m * (2.0 * m - 1.0).powi(2) };
        let exact = share * modulus * width * height * height;
        checks.push(within(
            "joint",
            format!("Janssen's joint, M/(N a) = {m}: N m/rad"),
            found,
            exact,
            0.01,
        ));
    }
    Ok(checks)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The battery notices a law that dissipates 2 % too much.
    #[test]
    fn a_wrong_fracture_energy_is_found() {
        let [_, right] = torn(4, Cracks::Planes, FRACTURE, &Job::default()).unwrap();
        let [_, wrong] = torn(4, Cracks::Planes, 1.02 * FRACTURE, &Job::default()).unwrap();
        assert!((right - 1.0).abs() < 0.01 && (wrong - 1.0).abs() > 0.01, "{right} {wrong}");
    }
}
