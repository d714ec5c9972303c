//! What the slot of a crack returns of the light that the concrete beside it does: r of theory §8,
//! by walks in the scene with the crack in it, under the light of its place.

use std::sync::Arc;

use glam::Vec3;
use intrados_light::{LitScene, Render, RenderSettings, Sides, View, luminance, scene_rule};
use intrados_scene::{
    Camera, CrackSurface, Hit, Mouth, Ray, Scene, SurfaceDamage, tracer::Scratch,
};
use intrados_stage::{Cancelled, Job};

/// r of a crack where no walks can tell: a slot of some 20 widths' depth in clean concrete returns
/// .12 to .2 under an even sky, and one with black walls nothing (ours).
pub(super) const USUAL: [f64; 2] = [0.08, 0.05];
/// How deep cracks may be, in widths, but for the finest crazing (ours): what is between is open.
const DEPTHS: [f32; 2] = [12.0, 60.0];
/// Cracks whose r is computed; others have the mean of these.
const MOST: usize = 8;
/// Pixels along a side of a look at a mouth, and walks a pixel.
const SIDE: u32 = 20;
const SAMPLES: u64 = 48;
/// A look is so many widths wide.
const SPAN: f32 = 4.0;
/// Rays along a pixel's side that tell what it shows.
const FINE: u32 = 2;
/// Fewest pixels of mouth, and of concrete beside it.
const FEWEST: usize = 6;

/// A crack where it was found.
#[derive(Debug, Clone)]
pub(super) struct Opened {
    /// The line of its mouth, at least two points.
    pub(super) mouth: Vec<Mouth>,
}

/// r and its standard error, of each crack of a member, seen by a camera at `eye` in a `scene` lit
/// as it was then.
pub(super) fn returned(
    scene: &Scene,
    member: &str,
    eye: Vec3,
    cracks: &[Opened],
    seed: u64,
    job: &Job,
) -> Result<Vec<[f64; 2]>, Cancelled> {
    let mut order: Vec<usize> = (0..cracks.len()).collect();
    order.sort_by_key(|&k| std::cmp::Reverse(cracks[k].mouth.len()));
    order.truncate(MOST);
    let mut found: Vec<Vec<f64>> = vec![Vec::new(); cracks.len()];
    for depth in DEPTHS {
        let surface = |&k: &usize| {
            let mouth = &cracks[k].mouth;
            let widest = mouth.iter().map(|m| m.width).fold(0.0, f32::max);
            CrackSurface { mouth: mouth.clone(), normal: across(mouth), depth: depth * widest }
        };
        let cracks_in = order.iter().map(surface).collect();
        let damage =
            SurfaceDamage { member: member.to_owned(), cracks: cracks_in, spalls: Vec::new() };
        let lit = LitScene::build(Arc::new(scene.marked(&[damage], 1.0)), job)?;
        let settings = RenderSettings {
            sides: Sides::Primal,
            rule: scene_rule(scene),
            seed,
            samples: Some(SAMPLES),
            ..RenderSettings::default()
        };
        let look = Look { settings, lit: Arc::new(lit), eye };
        for &k in &order {
            found[k].extend(look.of(&cracks[k].mouth, job)?);
        }
    }
    let known: Vec<f64> = found.iter().filter_map(|r| mean(r)).collect();
    let others = mean(&known).map_or(USUAL, |r| soiled([r, USUAL[1]]));
    Ok(found.iter().map(|r| mean(r).map_or(others, |m| soiled([m, spread(r, m)]))).collect())
}

/// What walks tell is the most that a slot returns: its walls are as pale as the face in them, while
/// dust, damp and roughness make them darker, nobody knows by how much. Anything from nothing to
/// that is as likely (ours), so that the middle is taken and its error grows by that of a uniform
/// distribution.
fn soiled([r, error]: [f64; 2]) -> [f64; 2] {
    [0.5 * r, (0.5 * error).hypot(r / 12_f64.sqrt())]
}

fn mean(of: &[f64]) -> Option<f64> {
    (!of.is_empty()).then(|| of.iter().sum::<f64>() / of.len() as f64)
}

/// Between depths and places, at least a few hundredths: nobody knows how rough its walls are.
fn spread(of: &[f64], mean: f64) -> f64 {
    let variance = of.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / of.len().max(1) as f64;
    variance.sqrt().hypot(0.02)
}

/// Unit, across a mouth's line on the surface.
fn across(mouth: &[Mouth]) -> Vec3 {
    let (Some(first), Some(last)) = (mouth.first(), mouth.last()) else { return Vec3::X };
    (last.at - first.at).cross(first.outward).normalize_or(Vec3::X)
}

/// Looks at mouths from where the camera stood.
struct Look {
    lit: Arc<LitScene>,
    settings: RenderSettings,
    eye: Vec3,
}

impl Look {
    /// r at a quarter, half and three quarters of a crack, where its mouth is seen.
    fn of(&self, mouth: &[Mouth], job: &Job) -> Result<Vec<f64>, Cancelled> {
        let mut found = Vec::new();
        for part in 1..4 {
            let k = (mouth.len() - 1) * part / 4;
            let way = mouth[(k + 1).min(mouth.len() - 1)].at - mouth[k.saturating_sub(1)].at;
            found.extend(self.at(&mouth[k], way, job)?);
        }
        Ok(found)
    }

    fn at(&self, mouth: &Mouth, way: Vec3, job: &Job) -> Result<Option<f64>, Cancelled> {
        let span = SPAN * mouth.width;
        let camera = Camera {
            name: "mouth".into(),
            position: self.eye,
            target: mouth.at,
            up: way.normalize_or(Vec3::Y),
            fov_deg: 2.0 * (0.5 * span / self.eye.distance(mouth.at)).atan().to_degrees(),
            width: SIDE,
            height: SIDE,
            lens: None,
            exposure: 0.0,
        };
        let mut render = Render::new(Arc::clone(&self.lit), &camera, &self.settings);
        while render.advance(8) {
            if job.is_cancelled() {
                return Err(Cancelled);
            }
        }
        let light = render.image(View::Primal, None).mean;
        let shown = self.shown(&camera);
        let mean = |slot: bool| {
            let of = light.iter().zip(&shown).filter(|(_, s)| **s == Some(slot));
            let all: Vec<f64> = of.map(|(c, _)| f64::from(luminance(*c))).collect();
            (all.len() >= FEWEST).then(|| all.iter().sum::<f64>() / all.len() as f64)
        };
        let (inside, beside) = (mean(true), mean(false).filter(|b| *b > 0.0));
        Ok(inside.zip(beside).map(|(inside, beside)| (inside / beside).clamp(0.0, 0.95)))
    }

    /// Of each pixel whether it shows the slot, the concrete beside, or both (`None`).
    fn shown(&self, camera: &Camera) -> Vec<Option<bool>> {
        let is_slot: Vec<bool> =
            self.lit.scene.objects.iter().map(|o| o.name.starts_with("cracks of")).collect();
        let offset = |k: u32| (k as f32 + 0.5) / FINE as f32;
        let per = (FINE * FINE) as usize;
        let rays: Vec<Ray> = (0..SIDE * SIDE)
            .flat_map(|i| {
                (0..FINE * FINE).map(move |k| {
                    [(i % SIDE) as f32 + offset(k % FINE), (i / SIDE) as f32 + offset(k / FINE)]
                })
            })
            .map(|[x, y]| Ray::new(camera.position, camera.direction(x, y), f32::INFINITY))
            .collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        self.lit.tracer.closest(&rays, &mut hits, &mut Scratch::default());
        let slot =
            |hit: &Hit| hit.is_hit().then(|| is_slot[self.lit.object_index(hit.triangle) as usize]);
        let one = |hits: &[Hit]| {
            let first = slot(&hits[0])?;
            hits.iter().all(|hit| slot(hit) == Some(first)).then_some(first)
        };
        hits.chunks(per).map(one).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use intrados_scene::{Frame, Lamp, LampKind, Material, Member, MemberKind, Mesh, Object, Part};

    /// A square metre of concrete of reflectance .4, and light.
    fn wall(lamp: LampKind) -> Scene {
        let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
        let mesh = Mesh {
            positions: corners.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let bounds = [Vec3::new(-0.5, -0.5, -0.3), Vec3::new(0.5, 0.5, 0.0)];
        let member = Member {
            id: "wall".into(),
            name: String::new(),
            kind: MemberKind::Wall,
            concrete: "C30/37".into(),
            concrete_assumed: true,
            exposure: None,
            frame: Frame::of_box(MemberKind::Wall, bounds),
            bounds,
            volume: 0.0,
            slices: Vec::new(),
            truth: Vec::new(),
        };
        let material = Material { base_colour: Vec3::splat(0.4), ..Material::default() };
        Scene {
            members: vec![member],
            meshes: vec![Arc::new(mesh)],
            materials: vec![material],
            objects: vec![Object {
                name: "wall".into(),
                mesh: 0,
                transform: glam::Mat4::IDENTITY,
                material: 0,
                member: Some(0),
                part: Part::Concrete,
            }],
            lamps: vec![Lamp { name: "lamp".into(), kind: lamp }],
            ..Scene::default()
        }
    }

    fn r(lamp: LampKind) -> [f64; 2] {
        let mouth = (0..60)
            .map(|k| Mouth {
                at: Vec3::new(-0.15 + 5e-3 * k as f32, 0.0, 0.0),
                outward: Vec3::Z,
                width: 5e-4,
            })
            .collect();
        let eye = Vec3::new(0.0, 0.0, 2.0);
        returned(&wall(lamp), "wall", eye, &[Opened { mouth }], 3, &Job::default()).unwrap()[0]
    }

    /// Seen from before it a deep slot is nearly black, under an even sky and in light across it;
    /// light straight into it may reach its floor, so that r is open by as much as its depth is.
    #[test]
    fn a_slot_returns_little_unless_light_falls_into_it() {
        let sky = r(LampKind::Environment { radiance: Vec3::ONE, image: None });
        let beam = |direction: Vec3| LampKind::Directional {
            direction: direction.normalize(),
            irradiance: Vec3::ONE,
        };
        let across = r(beam(Vec3::new(0.0, -1.0, -0.3)));
        let into = r(beam(Vec3::new(0.0, -0.05, -1.0)));
        for [r, error] in [sky, across] {
            assert!((0.0..0.15).contains(&r) && error < 0.1, "{r} ± {error}");
        }
        assert!(into[0] > 2.0 * sky[0] && into[1] > 2.0 * sky[1], "{into:?} and {sky:?}");
    }
}
