//! How much of what crushes does so together.
//!
//! The code's curve of compression is of bodies some 200 mm long ([`GAUGE`]). Where all of such a
//! length crushes together, as in bending, each brick of it follows that curve, however small it is.
//! Where a row of small bricks crushes alone, beside the tip of a crack or at a plate's edge, that
//! curve would leave it a small part of the crushing energy, and the less the smaller they are: its
//! strain is then that of the mean over the length along which it is pressed (non-local damage:
//! Pijaudier-Cabot and Bažant 1987, along one direction), as it was at the last equilibrium.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{Memory, System};
use crate::{
    material::softening::GAUGE,
    mesh::{HexFace, Mesh},
    tensor::Principal,
};

/// Bricks that a line may run through.
const MOST: usize = 64;

impl System<'_> {
    /// Of bricks that are crushed past their peak, where they crush more than what lies along their
    /// pressure: the mean of what crushes them over [`GAUGE`], over their own.
    pub(super) fn crushing(&self, points: &[Memory], time: f64) -> BTreeMap<u32, f64> {
        let is_past = |memory: &Memory| match memory {
            Memory::None => false,
            Memory::Concrete(points) => points.iter().any(|point| point.state.bands[1] > 0.0),
        };
        let mut shares = BTreeMap::new();
        for (hex, memory) in (0..).zip(points).filter(|(_, memory)| is_past(memory)) {
            let Some((own, along)) = pressed(memory) else { continue };
            let [mut all, mut reached] = [0.0; 2];
            for direction in [along, -along] {
                line(&self.model.mesh, self.neighbours(), hex, direction, |hex, length| {
                    let there = self.is_alive(hex as usize, time);
                    let Some((by, _)) = pressed(&points[hex as usize]).filter(|_| there) else {
                        return false;
                    };
                    (all, reached) = (all + by * length, reached + length);
                    true
                });
            }
            let share = all / (reached * own);
            if share < 1.0 {
                shares.insert(hex, share);
            }
        }
        shares
    }
}

/// What crushes a brick, the mean of its points, and along what.
fn pressed(memory: &Memory) -> Option<(f64, DVec3)> {
    let Memory::Concrete(points) = memory else { return None };
    let mean = |of: &dyn Fn(usize) -> f64| (0..8).map(of).sum::<f64>() / 8.0;
    let strain = std::array::from_fn(|i| mean(&|point| points[point].state.mechanical[i]));
    let along = Principal::of_strain(&strain).directions[2];
    Some((mean(&|point| points[point].state.pressed), DVec3::from_array(along)))
}

/// From the middle of a brick half of [`GAUGE`] along a direction: which bricks that runs through,
/// and how far, m, until `each` says that it ends.
fn line(
    mesh: &Mesh,
    neighbours: &[[Option<u32>; 6]],
    mut hex: u32,
    along: DVec3,
    mut each: impl FnMut(u32, f64) -> bool,
) {
    let (mut at, mut left) = (mesh.centre(hex), 0.5 * GAUGE);
    for _ in 0..MOST {
        let exits = (0..6).filter_map(|face| {
            let (middle, normal) = mesh.face_middle(HexFace { hex, face });
            let towards = along.dot(normal);
            (towards > 1e-9 * normal.length())
                .then(|| (((middle - at).dot(normal) / towards).max(0.0), face))
        });
        let Some((far, face)) = exits.min_by(|a, b| a.0.total_cmp(&b.0)) else { return };
        if !each(hex, far.min(left)) || far >= left {
            return;
        }
        let Some(next) = neighbours[hex as usize][usize::from(face)] else { return };
        (at, left, hex) = (at + far * along, left - far, next);
    }
}

#[cfg(test)]
mod tests {
    use intrados_stage::Job;

    use super::*;
    use crate::{
        material::{
            concrete::Given,
            law::{Cracks, Setting},
        },
        mesh::{block, divide},
        model::{Action, Body, Control, Drive, Load, March, MarchSettings, Matter, Model},
    };

    /// Size of bricks, m, the share of the crushing energy that one took when it was last run (28
    /// November 2026), and whether that misses the bound.
    const SHARES: [(f64, f64, bool); 3] =
        [(0.03, 0.778, true), (0.06, 0.818, false), (0.1, 0.862, false)];

    /// A prism of .6 m, one brick of which is a little weaker, pressed until that is crushed: it
    /// takes the crushing energy within 20 %, the bound that was written before the test first ran,
    /// since it does not crush alone from the first. **A brick of 30 mm misses it** by 2 %. (By the
    /// curve of 200 mm it would take h/200 mm of that energy, .15 in the smallest.)
    #[test]
    fn a_brick_that_crushes_alone_takes_the_crushing_energy() {
        let given = Given { fcm: Some(38e6), poisson: Some(0.0), ..Given::default() };
        let concrete = given.complete().unwrap();
        let (strength, energy, peak) =
            (concrete.fcm, concrete.crushing_energy, concrete.peak_strain);
        for (h, recorded, misses) in SHARES {
            let mesh = block(&divide(0.0, 0.6, &[], h), &[0.0, h], &[0.0, h], "prism").unwrap();
            let middle = mesh.hexes.len() / 2;
            let setting = Setting { cracks: Cracks::Planes, ..Setting::short_term(h) };
            let matter = Matter::Concrete(Box::new((concrete.clone(), setting)));
            let mut model = Model {
                bodies: vec![Body { matter, birth: f64::NEG_INFINITY }],
                softening: (0..mesh.hexes.len())
                    .map(|hex| if hex == middle { 0.03 } else { 0.0 })
                    .collect(),
                ..Model::default()
            };
            let at = |x: f64| {
                let nodes = (0..).zip(&mesh.nodes);
                nodes.filter(|(_, p)| (p.x - x).abs() < 1e-9).map(|(n, _)| n).collect::<Vec<u32>>()
            };
            let from = h * middle as f64;
            let row = [(from, 0.25), (from + h, -0.25)];
            let row = row.iter().flat_map(|&(x, w)| at(x).into_iter().map(move |n| (n, 0, w)));
            let control = Control::Row(row.collect());
            let nodes = (0..).zip(&mesh.nodes);
            for (n, p) in nodes {
                (0..3).filter(|&c| c > 0 || p.x == 0.0).for_each(|c| model.holds.push((n, c)));
            }
            let push = at(0.6).into_iter().map(|n| (n, -0.25 * strength * h * h * DVec3::X));
            model.loads.push(Load {
                name: "push".into(),
                action: Action::Nodes(push.collect()),
                history: vec![(0.0, 0.0)],
            });
            model.mesh = mesh;
            let system = System::new(&model).unwrap();
            let settings = MarchSettings { iterations: 100, ..MarchSettings::of_life() };
            let drive = Drive::Raised { loads: vec![(0, 1.0)], control };
            let mut march = March::new(&system, system.rest(0.0), drive, settings);
            let (mut shortened, mut factor, mut most, mut work) = (0.0, 0.0, 0.0_f64, 0.0);
            for k in 0..2000 {
                let step = if k < 40 { 0.05 * peak * h } else { 1e-6 };
                let time = march.history.time + 1.0;
                march.advance(time, step, &Job::default(), |_, _| Ok(())).unwrap();
                let now = march.history.factor;
                if now < most {
                    work += 0.5 * (factor + now) * strength * step;
                }
                most = most.max(now);
                (shortened, factor) = (shortened + step, now);
                if now < 0.02 {
                    break;
                }
            }
            let taken = work + 0.5 * most * strength * peak * h;
            println!("{h} m: {most:.3} f_c, {taken:.0} of {energy:.0} N/m, {shortened:.2e} m");
            assert!((most - 0.97).abs() < 0.01, "{h}: {most}");
            let share = taken / energy;
            assert!((share / recorded - 1.0).abs() < 0.02, "{h}: {share}, recorded {recorded}");
            assert_eq!((share - 1.0).abs() >= 0.2, misses, "{h}: {taken} of {energy}");
        }
    }
}
