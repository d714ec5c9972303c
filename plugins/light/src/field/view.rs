//! Fields to look at.

use glam::Vec3;
use intrados_scene::{Camera, Hit, Ray, tracer::Scratch};
use intrados_transport::{Field, Side};
use rayon::prelude::*;

use super::{Guide, NONE, lobe::Spot};
use crate::{
    LitScene,
    bsdf::warp,
    sensor::Pinhole,
    tone::{ColourMap, FalseColour},
};

/// Where one looks, and what a field knows there.
struct Look {
    spot: Spot,
    cell: u32,
}

impl Guide {
    /// What a field says arrives at the surfaces that `camera` looks at, by pixel, row-major from
    /// the top left: of radiance (what steers the primal walks) the irradiance in W/m² (light that
    /// comes straight from a lamp counts in part, as links find most of it), of importance what W_e
    /// arrives, per m². NaN where nothing is known.
    #[must_use]
    pub fn picture(&self, lit: &LitScene, camera: &Camera, side: Side) -> Vec<f32> {
        let eye = Pinhole::new(camera);
        let of = |pixel: u32| {
            let Some(Look { spot, cell }) = self.look(lit, &eye, pixel, side) else {
                return f32::NAN;
            };
            if cell == NONE { f32::NAN } else { self.fields[side as usize].look(cell, &spot).total }
        };
        (0..camera.width * camera.height).into_par_iter().map(of).collect()
    }

    /// From where it arrives at the surface behind a pixel: density times π/cosθ on the square of
    /// the cosine law about the normal, `n` × `n`, so that a surface that is lit evenly from
    /// everywhere has 1 all over.
    #[must_use]
    pub fn directions(
        &self,
        lit: &LitScene,
        camera: &Camera,
        pixel: [u32; 2],
        side: Side,
        n: u32,
    ) -> Option<Vec<f32>> {
        let look =
            self.look(lit, &Pinhole::new(camera), pixel[1] * camera.width + pixel[0], side)?;
        if look.cell == NONE {
            return None;
        }
        let (field, frame) =
            (&self.fields[side as usize], crate::bsdf::Frame::new(look.spot.normal));
        let view = field.look(look.cell, &look.spot);
        let of = |k: u32| {
            let at = [k % n, k / n].map(|i| (i as f32 + 0.5) / n as f32);
            let local = warp::cosine_hemisphere(at);
            let density = field.density(&(look.cell, view), view.total, frame.to_world(local));
            density * std::f32::consts::PI / local.z.max(1e-6)
        };
        Some((0..n * n).map(of).collect())
    }

    fn look(&self, lit: &LitScene, eye: &Pinhole, pixel: u32, side: Side) -> Option<Look> {
        let direction = eye.direction(pixel, [0.5; 2]);
        let ray = Ray::new(eye.position, direction, f32::INFINITY);
        let mut hits = [Hit::MISS];
        lit.tracer.closest(&[ray], &mut hits, &mut Scratch::default());
        let [Hit { t, triangle }] = hits;
        if triangle == Hit::NONE {
            return None;
        }
        let normal = lit.normal(triangle);
        let front = normal.dot(direction) < 0.0;
        let (position, normal): (Vec3, Vec3) =
            (eye.position + t * direction, if front { normal } else { -normal });
        let key = 2 * self.charts.of(triangle) + u32::from(!front);
        Some(Look {
            spot: Spot { position, normal },
            cell: self.fields[side as usize].cell(key, position),
        })
    }
}

/// Values as colours (viridis) on a logarithmic scale over their [`spread`]; grey where there is
/// none. Returns the colours and the range.
#[must_use]
pub fn false_colours(values: &[f32]) -> (Vec<[u8; 3]>, [f32; 2]) {
    let range = spread(values);
    let scale = FalseColour {
        map: ColourMap::Viridis,
        range,
        is_logarithmic: true,
        bands: 0,
        is_clipped: false,
    };
    (values.iter().map(|&v| scale.encode(v)).collect(), range)
}

/// The 1st and the 99th of a hundred of those values that are above 0; 1 where there is none.
#[must_use]
pub fn spread(values: &[f32]) -> [f32; 2] {
    let mut known: Vec<f32> =
        values.iter().copied().filter(|v| v.is_normal() && *v > 0.0).collect();
    known.sort_by(f32::total_cmp);
    let rank = |share: f32| {
        known.get(((known.len().max(1) - 1) as f32 * share) as usize).copied().unwrap_or(1.0)
    };
    [rank(0.01), rank(0.99)]
}
