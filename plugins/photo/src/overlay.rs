//! A photograph with the model's edges and the picks drawn over it.

use glam::{DVec3, Vec3};

use crate::{Photograph, Pick, Pose, picture::srgb, site::Site};

/// Longest side of the picture, pixels.
const LONGEST: u32 = 2400;

const EDGE: [u8; 3] = [0, 230, 255];
const PICKED: [u8; 3] = [255, 60, 200];

/// A picture in sRGB, by rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Overlay {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Red, green, blue.
    pub rgb: Vec<u8>,
}

impl Overlay {
    /// A photograph, made smaller where it is large, with edges that its camera sees (cyan), the
    /// picks as they were picked (magenta crosses), and a ring where each is drawn.
    #[must_use]
    pub fn new(
        photograph: &Photograph,
        pose: &Pose,
        edges: &[[DVec3; 2]],
        picks: &[Pick],
        site: &Site,
    ) -> Self {
        let shrink = shrink(photograph);
        let mut overlay = Self::plain(photograph);
        let to_overlay = |[x, y]: [f64; 2]| [x / f64::from(shrink), y / f64::from(shrink)];
        let thickness = (f64::from(overlay.size[0]) / 900.0).clamp(0.7, 2.0);
        for place in edges.iter().flat_map(|edge| site.seen_along(pose, edge, f64::from(shrink))) {
            if let Some(at) = pose.project(place) {
                overlay.dot(to_overlay(at), thickness, EDGE);
            }
        }
        for pick in picks {
            let at = to_overlay(pick.pixel);
            for k in -8..=8 {
                let d = f64::from(k);
                overlay.dot([at[0] + d, at[1]], 0.7, PICKED);
                overlay.dot([at[0], at[1] + d], 0.7, PICKED);
            }
            if let Some(drawn) = pose.project(pick.place).map(to_overlay) {
                for k in 0..48 {
                    let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 48.0).sin_cos();
                    overlay.dot([drawn[0] + 10.0 * cos, drawn[1] + 10.0 * sin], 0.7, EDGE);
                }
            }
        }
        overlay
    }

    /// The photograph alone, made smaller where it is large.
    #[must_use]
    pub fn plain(photograph: &Photograph) -> Self {
        let shrink = shrink(photograph);
        let size = photograph.size.map(|n| (n / shrink).max(1));
        let mut rgb = Vec::with_capacity(3 * size[0] as usize * size[1] as usize);
        for y in 0..size[1] {
            for x in 0..size[0] {
                let (mut sum, mut count) = (Vec3::ZERO, 0.0);
                for (i, j) in (0..shrink).flat_map(|i| (0..shrink).map(move |j| (i, j))) {
                    if let Some(light) = photograph.light(x * shrink + i, y * shrink + j) {
                        (sum, count) = (sum + light, count + 1.0);
                    }
                }
                rgb.extend((sum / f32::max(count, 1.0)).to_array().map(srgb));
            }
        }
        Self { size, rgb }
    }

    fn dot(&mut self, [x, y]: [f64; 2], radius: f64, colour: [u8; 3]) {
        let [width, height] = self.size.map(i64::from);
        let range = |c: f64| (c - radius - 0.5).floor() as i64..=(c + radius - 0.5).ceil() as i64;
        for (i, j) in range(x).flat_map(|i| range(y).map(move |j| (i, j))) {
            let is_in = (0..width).contains(&i) && (0..height).contains(&j);
            if is_in && (i as f64 + 0.5 - x).hypot(j as f64 + 0.5 - y) <= radius.max(0.7) {
                let first = 3 * (j * width + i) as usize;
                self.rgb[first..first + 3].copy_from_slice(&colour);
            }
        }
    }
}

/// So many pixels of a photograph are one of its overlay.
fn shrink(photograph: &Photograph) -> u32 {
    photograph.size[0].max(photograph.size[1]).div_ceil(LONGEST).max(1)
}
