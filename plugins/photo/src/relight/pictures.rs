//! The pictures L_k: a scene lit by one lamp after the other.

use std::sync::Arc;

use glam::Vec3;
use intrados_light::{LitScene, Render, RenderSettings, Sides, View, scene_rule};
use intrados_scene::{Camera, Scene};
use intrados_stage::{Cancelled, Job};

use super::{
    Light, RelightSettings,
    frame::Frame,
    lamps::{self, Source},
    smooth::{Field, smoothed},
};

/// Orders of the Neumann series that are a lamp itself and its light on what is seen.
const DIRECT: usize = 2;

/// A picture of a scene with one lamp.
#[derive(Debug, Clone)]
pub(super) struct Picture {
    pub(super) field: Field,
    /// The part of it that was reflected more than once, by pixel, unsmoothed.
    pub(super) reflected: Vec<[f64; 3]>,
}

/// The pictures of all `sources`; `stream` tells rounds apart.
pub(super) fn taken(
    even: &Scene,
    sources: &[Source],
    frame: &Frame,
    camera: &Camera,
    settings: &RelightSettings,
    stream: u64,
    job: &Job,
) -> Result<Vec<Picture>, Cancelled> {
    let one = |(k, source): (u64, &Source)| {
        let lit = LitScene::build(Arc::new(lamps::alone(even, source)), job)?;
        // Errors of different pictures must not go together.
        let seed = settings.seed.wrapping_add((stream << 32) + (k << 16));
        let render = RenderSettings {
            sides: Sides::Primal,
            rule: scene_rule(even),
            seed,
            samples: Some(settings.samples),
            ..RenderSettings::default()
        };
        let mut render = Render::new(Arc::new(lit), camera, &render);
        while render.advance(1) {
            if job.is_cancelled() {
                return Err(Cancelled);
            }
        }
        Ok(picture(&render, frame, settings.light))
    };
    (0..).zip(sources).map(one).collect()
}

fn picture(render: &Render, frame: &Frame, light: Light) -> Picture {
    let all = render.plate().image(View::Combined, None);
    let doubles = |v: &[Vec3]| v.iter().map(|v| v.as_dvec3().to_array()).collect::<Vec<_>>();
    let direct = (0..DIRECT)
        .map(|order| render.plate().image(View::Combined, Some(order)).mean)
        .reduce(|a, b| a.iter().zip(&b).map(|(a, b)| *a + *b).collect())
        .unwrap_or_default();
    let reflected: Vec<Vec3> = all.mean.iter().zip(&direct).map(|(a, d)| *a - *d).collect();
    let mean = match light {
        Light::All => doubles(&all.mean),
        Light::Direct => doubles(&direct),
    };
    let variance = doubles(&all.variance);
    let field = smoothed(frame, &Field { mean, variance });
    Picture { field, reflected: doubles(&reflected) }
}
