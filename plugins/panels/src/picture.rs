//! From the film to a texture.

use std::ops::Range;

use bevy_ecs::prelude::*;
use egui::{Color32, ColorImage, TextureHandle, TextureOptions, Vec2};
use glam::Vec3;
use intrados_light::{
    Film, ORDERS, Render, View, luminance,
    tone::{FalseColour, Tone},
};
use intrados_scene::Camera;
use intrados_transport::Side;
use rayon::prelude::*;

use crate::{Colours, Statistics, Viewpoint, colours, lang::local, legend::Legend};

/// A large film is developed in so many bands of rows, one a frame: all of it at once would take
/// half a frame.
pub(crate) const BANDS: usize = 8;

/// Relative standard errors at the ends of the colour map; it is logarithmic between them.
pub(crate) const ERRORS: [f32; 2] = [1e-3, 1.0];

/// What the picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Quantity {
    /// Light, as an eye would see it.
    #[default]
    Radiance,
    /// Relative standard error of every pixel, in false colour.
    Error,
    /// What the field that steers the walks of a side says arrives at the surfaces, in false
    /// colour: of the primal radiance, of the dual importance.
    Field(Side),
}

/// How the film is developed. Changing it does not touch the film.
#[derive(Resource, Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// Which side.
    pub view: View,
    /// One order of the Neumann series alone (the last takes all beyond), or `None` for all light.
    pub order: Option<usize>,
    /// Light or its error.
    pub quantity: Quantity,
    /// Exposure in stops: radiance is multiplied by 2^exposure.
    pub exposure: f32,
    /// Whether the selected member is outlined.
    pub outline: bool,
    /// Of errors and fields, and of numbers in the rest of the window.
    pub colours: Colours,
}

impl Default for Look {
    fn default() -> Self {
        Self {
            view: View::Combined,
            order: None,
            quantity: Quantity::Radiance,
            exposure: 0.0,
            outline: true,
            colours: Colours::default(),
        }
    }
}

/// The film as last developed.
#[derive(Resource, Default)]
pub(crate) struct Picture {
    /// Developed as a whole and not yet uploaded.
    whole: Option<ColorImage>,
    /// Bands developed since, and the rows that they begin at.
    bands: Vec<(usize, ColorImage)>,
    texture: Option<TextureHandle>,
    /// A large film that follows a small one: its rows as far as they are developed, and its size
    /// and look. The small one is shown until then.
    coming: (Vec<Color32>, [usize; 2], Look),
    /// What has been developed.
    size: [usize; 2],
    look: Look,
    walks: u64,
    /// The band that is next, and how many of them are older than the film.
    next: usize,
    behind: usize,
    /// Radiance of the film as last developed, while it is the small one.
    small: Option<Small>,
    /// The small film, under what the large one has not reached yet.
    underlay: Option<Small>,
}

/// Radiance of a small film.
#[derive(Debug, Clone)]
pub(crate) struct Small {
    width: usize,
    height: usize,
    mean: Vec<Vec3>,
}

impl Small {
    /// Bilinear, at a share of the width and height.
    fn at(&self, u: f32, v: f32) -> Vec3 {
        let place = |share: f32, n: usize| {
            let x = (share * n as f32 - 0.5).clamp(0.0, (n - 1) as f32);
            let i = (x as usize).min(n.saturating_sub(2));
            (i, (i + 1).min(n - 1), x - i as f32)
        };
        let ((x0, x1, fx), (y0, y1, fy)) = (place(u, self.width), place(v, self.height));
        let row =
            |y: usize| self.mean[y * self.width + x0].lerp(self.mean[y * self.width + x1], fx);
        row(y0).lerp(row(y1), fy)
    }
}

impl Picture {
    /// Whether there is more to see in the film than in the picture.
    pub(crate) fn is_behind(&self) -> bool {
        self.behind > 0 || !self.coming.0.is_empty()
    }

    /// The film that is shown becomes what is under the next one.
    pub(crate) fn keep_as_underlay(&mut self) {
        self.underlay = self.small.take();
    }

    /// Whether it shows a film of this camera's size.
    pub(crate) fn is_of(&self, camera: &Camera) -> bool {
        self.size == [camera.width as usize, camera.height as usize]
    }

    /// Takes the texture away as it is; what is developed from now on is another one.
    pub(crate) fn lift(&mut self) -> Option<TextureHandle> {
        std::mem::take(self).texture
    }

    /// Another scene: nothing of the old one may be seen.
    pub(crate) fn forget(&mut self) {
        *self = Self::default();
    }

    /// Develops the next band of a film of another size; true once it takes the place of the one
    /// that is shown.
    fn follow(&mut self, render: &Render, look: &Look, share: f64, size: [usize; 2]) -> bool {
        if (self.coming.1, self.coming.2) != (size, *look) {
            self.coming = (Vec::with_capacity(size[0] * size[1]), size, *look);
        }
        let from = self.coming.0.len() / size[0].max(1);
        let to = (from + size[1].div_ceil(BANDS)).min(size[1]);
        self.coming.0.extend(pixels(render, look, share, self.underlay.as_ref(), from..to).pixels);
        if to < size[1] {
            return false;
        }
        self.whole = Some(ColorImage::new(size, std::mem::take(&mut self.coming).0));
        true
    }

    /// The texture, with what was developed since the last frame.
    pub(crate) fn texture(&mut self, ctx: &egui::Context) -> Option<&TextureHandle> {
        if let Some(whole) = self.whole.take() {
            match &mut self.texture {
                Some(texture) => texture.set(whole, TextureOptions::LINEAR),
                None => {
                    self.texture = Some(ctx.load_texture("picture", whole, TextureOptions::LINEAR))
                }
            }
        }
        if let Some(texture) = &mut self.texture {
            self.bands.drain(..).for_each(|(row, band)| {
                texture.set_partial([0, row], band, TextureOptions::LINEAR)
            });
        }
        self.texture.as_ref()
    }
}

/// Develops what is new in the film: all of it where its size or the look has changed or it is
/// small, else the next band.
pub(crate) fn develop(
    render: Option<Res<Render>>,
    look: Res<Look>,
    viewpoint: Res<Viewpoint>,
    statistics: Res<Statistics>,
    mut picture: ResMut<Picture>,
) {
    let Some(render) = render else { return };
    let share = statistics.share(&render);
    let walks = render.exposures().iter().flatten().map(|e| e.walks).sum();
    if walks == 0 {
        return;
    }
    let size = [render.camera().width as usize, render.camera().height as usize];
    let is_new = walks != picture.walks;
    if size != picture.size || *look != picture.look || viewpoint.is_preview() && is_new {
        if picture.size == [0, 0] {
            tracing::debug!("first picture");
        }
        let is_large = !viewpoint.is_preview() && size != picture.size && picture.size != [0, 0];
        if is_large && !picture.follow(&render, &look, share, size) {
            return;
        }
        if !is_large {
            picture.small = viewpoint.is_preview().then(|| small(&render, &look, share));
            picture.whole =
                Some(pixels(&render, &look, share, picture.underlay.as_ref(), 0..size[1]));
            picture.coming.0.clear();
        }
        picture.bands.clear();
        (picture.size, picture.look, picture.walks, picture.behind) = (size, *look, walks, 0);
        return;
    }
    if is_new {
        (picture.walks, picture.behind) = (walks, BANDS);
    }
    if picture.behind > 0 {
        let rows = picture.next * size[1] / BANDS..(picture.next + 1) * size[1] / BANDS;
        if !rows.is_empty() {
            let band = pixels(&render, &look, share, picture.underlay.as_ref(), rows.clone());
            // While another tab is open nobody fetches them.
            picture.bands.retain(|(row, _)| *row != rows.start);
            picture.bands.push((rows.start, band));
        }
        picture.next = (picture.next + 1) % BANDS;
        picture.behind -= 1;
    }
}

/// The films that a view is made of, and their weights; `share`: of the primal one where there are
/// both.
pub(crate) fn parts(render: &Render, view: View, share: f64) -> Vec<(&Film, f32)> {
    let film = |side: Side| render.exposure(side).and_then(|e| e.film.as_ref());
    match (view, film(Side::Primal), film(Side::Dual)) {
        (View::Primal, Some(f), _)
        | (View::Dual, _, Some(f))
        | (View::Combined, Some(f), None)
        | (View::Combined, None, Some(f)) => {
            vec![(f, 1.0)]
        }
        // A film that does not count need not have seen every pixel.
        (View::Combined, Some(p), Some(d)) => [(p, share as f32), (d, 1.0 - share as f32)]
            .into_iter()
            .filter(|part| part.1 > 0.0)
            .collect(),
        _ => Vec::new(),
    }
}

/// Mean radiance of a pixel and its variance, W·m⁻²·sr⁻¹ and its square; `None` where no walk has
/// been.
pub(crate) fn value(
    render: &Render,
    look: &Look,
    share: f64,
    pixel: usize,
) -> Option<(Vec3, Vec3)> {
    blend(&parts(render, look.view, share), look.order, pixel)
}

/// The same of parts that are known.
pub(crate) fn blend(
    parts: &[(&Film, f32)],
    order: Option<usize>,
    pixel: usize,
) -> Option<(Vec3, Vec3)> {
    let mut sum = (Vec3::ZERO, Vec3::ZERO);
    for &(film, share) in parts {
        sum.0 += share * mean(film, order, pixel)?;
        // Of one order alone no second moment is kept.
        sum.1 +=
            if order.is_none() { share * share * film.variance(pixel) } else { Vec3::INFINITY };
    }
    (!parts.is_empty()).then_some(sum)
}

fn mean(film: &Film, order: Option<usize>, pixel: usize) -> Option<Vec3> {
    (film.samples(pixel) > 0).then(|| match order {
        Some(order) => film.order_mean(pixel, order.min(ORDERS - 1)).unwrap_or(Vec3::ZERO),
        None => film.mean(pixel),
    })
}

/// sRGB pixels of some rows of the film, in parallel.
pub(crate) fn pixels(
    render: &Render,
    look: &Look,
    share: f64,
    underlay: Option<&Small>,
    rows: Range<usize>,
) -> ColorImage {
    let (w, h) = (render.camera().width as usize, render.camera().height as usize);
    let parts = parts(render, look.view, share);
    let tone = Tone { exposure: look.exposure, ..Tone::default() };
    let errors = error_scale(look);
    let mut pixels = vec![Color32::BLACK; w * rows.len()];
    pixels.par_chunks_mut(w).zip(rows.clone()).for_each(|(row, y)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let i = y * w + x;
            *pixel = match look.quantity {
                Quantity::Error => error_colour(&errors, blend(&parts, None, i)),
                // A field is no film: it has a picture of its own, and this one waits under it.
                Quantity::Radiance | Quantity::Field(_) => {
                    let mut sum = Some(Vec3::ZERO);
                    for &(film, share) in &parts {
                        sum = sum
                            .zip(mean(film, look.order, i))
                            .map(|(sum, mean)| sum + share * mean);
                    }
                    let below = || {
                        underlay.map_or(Vec3::ZERO, |u| {
                            u.at((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32)
                        })
                    };
                    colours::ink(tone.encode(sum.unwrap_or_else(below)))
                }
            };
        }
    });
    ColorImage::new([w, rows.len()], pixels)
}

/// The scale of relative errors.
pub(crate) fn error_scale(look: &Look) -> FalseColour {
    look.colours.over(ERRORS, true)
}

/// What the legend of relative errors is of.
pub(crate) fn error_caption() -> String {
    tr!("relative standard error of a pixel (logarithmic)")
}

/// A relative error in that legend.
pub(crate) fn error_share(error: f32) -> String {
    local(format!("{} %", 100.0 * error))
}

/// The same legend, for a file.
pub(crate) fn error_legend(look: &Look) -> Legend {
    let scale = error_scale(look);
    Legend::new(&scale, |error| scale.encode(error), error_share, vec![error_caption()])
}

fn error_colour(scale: &FalseColour, value: Option<(Vec3, Vec3)>) -> Color32 {
    let relative = value.map(|(mean, variance)| relative_error(mean, variance));
    colours::ink(scale.encode(relative.filter(|r| r.is_finite()).unwrap_or(f32::NAN)))
}

/// Standard error of the luminance over the luminance, the channels' errors taken as fully
/// correlated (as the film's own error does).
pub(crate) fn relative_error(mean: Vec3, variance: Vec3) -> f32 {
    luminance(variance.map(f32::sqrt)) / luminance(mean)
}

fn small(render: &Render, look: &Look, share: f64) -> Small {
    let (width, height) = (render.camera().width as usize, render.camera().height as usize);
    let parts = parts(render, look.view, share);
    let radiance = |i| blend(&parts, look.order, i).map_or(Vec3::ZERO, |(mean, _)| mean);
    Small { width, height, mean: (0..width * height).map(radiance).collect() }
}

/// What is under the cursor.
#[derive(Resource, Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Cursor(pub(crate) Option<Under>);

/// A place in the picture, and what it shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Under {
    /// Share of the picture's width and height. No pixel: while the camera moves, films of other
    /// sizes take turns.
    pub(crate) at: Vec2,
    /// Index of the object, and the point on it.
    pub(crate) hit: Option<(usize, Vec3)>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use intrados_light::tone::ColourMap;

    #[test]
    fn an_underlay_keeps_its_corners_and_is_linear_between() {
        let small =
            Small { width: 2, height: 2, mean: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE] };
        assert_eq!(small.at(0.25, 0.25), Vec3::ZERO);
        assert_eq!(small.at(1.0, 1.0), Vec3::ONE);
        assert!(small.at(0.5, 0.25).abs_diff_eq(Vec3::new(0.5, 0.0, 0.0), 1e-6));
    }

    #[test]
    fn an_underlay_of_one_pixel_is_that_pixel() {
        let small = Small { width: 1, height: 1, mean: vec![Vec3::X] };
        assert_eq!(small.at(0.9, 0.1), Vec3::X);
    }

    #[test]
    fn errors_are_in_the_colours_of_the_window_and_grey_where_they_are_unknown() {
        let map = ColourMap::Turbo;
        let look = Look { colours: Colours { map, bands: 0 }, ..Look::default() };
        let of = |error: f32| {
            error_colour(&error_scale(&look), Some((Vec3::ONE, Vec3::splat(error * error))))
        };
        assert_eq!(of(1e-5), colours::ink(map.at(0.0)));
        assert_eq!(of(2.0), colours::ink(map.at(1.0)));
        assert_eq!(of(f32::INFINITY), colours::UNKNOWN);
        assert_eq!(error_colour(&error_scale(&look), None), colours::UNKNOWN);
    }
}
