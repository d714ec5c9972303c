//! A stretch of a beam in fine bricks, driven by all of it in coarse ones, against all of it in
//! fine ones.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use intrados_mechanics::{
    analysis::{Observer, analyze},
    member::{Axes, Meshing, Prepared, prepare},
    model::{Failure, History, MarchSettings, Point, Step, System},
    stretch::Stretch,
};
use intrados_scene::Scene;
use intrados_stage::Job;

/// A beam of .3 × .5 × 6 m with four bars below, under its weight and `line` kN/m.
fn beam(line: f64) -> Scene {
    let text = format!(
        "(schema: \"intrados.scene/1\", members: [(id: \"B\", at: (0, 1, 0), concrete: \"C30/37\", body: Beam(section: Rectangle(width_m: 0.3, depth_m: 0.5), length_m: 6, \
         reinforcement: (cover_mm: 30, bars: [Row(side_deg: 180, count: 4, diameter_mm: 20)])))], \
         supports: [(member: \"B\", place: Surface(from: 0, to: 0, side_deg: 180), hold: Fixed), \
         (member: \"B\", place: Surface(from: 1, to: 1, side_deg: 180), hold: Directions(x: false, y: true, z: true))], \
         loads: [(name: \"weight\", action: SelfWeight), (name: \"line\", action: Line(force_kn_m: (0, -{line}, 0)), history: [(4, 0), (5, 1)])])"
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("beam.ron");
    std::fs::write(&path, text).unwrap();
    Scene::load(&path, &Job::default()).unwrap()
}

fn of(scene: &Scene, edge: f64) -> (Prepared, Axes) {
    let beam = scene.structure.assembly("B").unwrap();
    let prepared = prepare(scene, beam, Meshing { element: Some(edge) }, &Job::default()).unwrap();
    (prepared, Axes::of(&beam.frame))
}

/// Extremes at the end near the middle of the beam: least and largest stress along it (Pa), and the
/// largest of a bar.
#[derive(Default)]
struct Middle {
    axes: Option<Axes>,
    stress: [f64; 2],
    bar: f64,
    sag: f64,
}

impl Observer for Middle {
    fn see(
        &mut self,
        system: &System,
        history: &History,
        _: &Step,
        points: &[[Point; 8]],
    ) -> Result<(), Failure> {
        let mesh = &system.model.mesh;
        let axes = self.axes.unwrap();
        let near = |at| (axes.local(at).z / axes.length - 0.5).abs() < 0.05;
        (self.stress, self.bar, self.sag) = ([0.0; 2], 0.0, 0.0);
        for (hex, points) in (0u32..).zip(points).filter(|(hex, _)| near(mesh.centre(*hex))) {
            for along in points.iter().map(|p| p.stress[0]) {
                self.stress = [self.stress[0].min(along), self.stress[1].max(along)];
            }
            for &node in &mesh.hexes[hex as usize].nodes {
                self.sag = self.sag.min(history.x[3 * node as usize + 1]);
            }
        }
        for (steel, works) in system.model.steel.iter().zip(&history.steel) {
            for (piece, work) in steel.pieces.iter().zip(works) {
                if near(0.5 * (piece.ends[0] + piece.ends[1])) {
                    self.bar = self.bar.max(work.stress);
                }
            }
        }
        Ok(())
    }
}

fn middle(prepared: &Prepared, axes: Axes) -> Middle {
    let mut middle = Middle { axes: Some(axes), ..Middle::default() };
    let (outcome, _) =
        analyze(prepared, MarchSettings::of_life(), &Job::default(), &mut middle).unwrap();
    assert!(outcome.complaint.is_empty(), "{}", outcome.complaint);
    middle
}

fn driven(scene: &Scene) -> Prepared {
    let ((coarse, axes), (fine, _)) = (of(scene, 0.25), of(scene, 0.125));
    let mut driven = Stretch::of(&coarse, &fine, &axes, [0.25, 0.75]).unwrap().driven();
    analyze(&coarse, MarchSettings::of_life(), &Job::default(), &mut driven).unwrap();
    driven.prepared()
}

#[test]
fn a_stretch_answers_as_in_the_fine_whole() {
    let scene = beam(2.0);
    let (fine, axes) = of(&scene, 0.125);
    let [whole, part] = [&fine, &driven(&scene)].map(|prepared| middle(prepared, axes));
    for (what, whole, part) in [
        ("compression", whole.stress[0], part.stress[0]),
        ("tension", whole.stress[1], part.stress[1]),
        ("bars", whole.bar, part.bar),
        ("sag", whole.sag, part.sag),
    ] {
        println!("{what}: {part:.4e} in the stretch, {whole:.4e} in the fine whole");
        assert!((part / whole - 1.0).abs() < 0.02, "{what}: {part} and not {whole}");
    }
}

/// It is the stretch alone that is computed, with its own bricks and what lies in them.
#[test]
fn a_stretch_is_cut_where_it_is_asked_for_and_nothing_else_is() {
    let scene = beam(2.0);
    let ((coarse, axes), (fine, _)) = (of(&scene, 0.25), of(&scene, 0.125));
    let part = Stretch::of(&coarse, &fine, &axes, [0.25, 0.75]).unwrap().driven().prepared();
    let [cut, all] = [&part, &fine].map(|p| {
        let volume: f64 =
            (0..p.model.mesh.hexes.len() as u32).map(|h| p.model.mesh.hex_volume(h)).sum();
        let steel: f64 = p.model.steel.iter().flat_map(|s| &s.pieces).map(|p| p.length()).sum();
        [volume, steel]
    });
    assert!((cut[0] / all[0] - 0.5).abs() < 1e-9, "{cut:?} of {all:?}");
    assert!((cut[1] / all[1] - 0.5).abs() < 0.02, "{cut:?} of {all:?}");
    let why = Stretch::of(&coarse, &fine, &axes, [0.0, 1.0]).unwrap_err().to_string();
    assert!(why.contains("member B") && why.contains("another stretch"), "{why}");
}
