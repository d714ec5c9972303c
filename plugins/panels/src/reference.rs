//! A picture of light that is kept, to hold the present one of the same camera against it: side by
//! side under a divider that is dragged, by their difference, and by figures.

use std::ops::{AddAssign, Range};

use bevy_ecs::prelude::*;
use egui::{
    Button, Color32, ColorImage, CursorIcon, Pos2, Rect, Response, Sense, TextureHandle, TextureId,
    TextureOptions, Ui, UiBuilder, pos2,
};
use glam::Vec3;
use intrados_light::{Film, Render, luminance, tone::Tone};
use intrados_scene::Camera;
use rayon::prelude::*;

use crate::{
    Log, Look, Statistics, Viewpoint, colours,
    number::{plus_minus, significant},
    picture::{self, BANDS},
    toast::Toasts,
    zoom::Zoom,
};

/// Half of what is taken hold of about the divider, points.
const GRIP: f32 = 5.0;
/// Height of the figures below the picture, points.
pub(crate) const FIGURES: f32 = 28.0;
/// Share of the squared mean of the reference below which relative errors do not go on growing.
const FLOOR: f64 = 1e-2;

/// Mean and variance of the mean of a pixel; none: no walk has been there.
type Pixel = Option<(Vec3, Vec3)>;

/// What is shown.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
enum Shown {
    #[default]
    Picture,
    Reference,
    Difference,
    /// The reference on the left of the divider, the picture on its right.
    Wipe,
}

/// A picture that was kept.
struct Kept {
    /// Where it was taken from, at its full size.
    camera: Camera,
    size: [usize; 2],
    pixels: Vec<Pixel>,
    /// Is added to the squares by which squared errors are divided.
    floor: f64,
}

/// The reference, and what the picture is against it.
#[derive(Resource, Default)]
pub(crate) struct Reference {
    kept: Option<Kept>,
    shown: Shown,
    /// Where the divider is: share of the width.
    wipe: f32,
    /// Which part of both pictures is seen.
    zoom: Zoom,
    /// The walks and the look that are compared.
    of: Option<(u64, Look)>,
    /// What was found, band by band; as the picture, one is done a frame.
    sums: [Option<Sums>; BANDS],
    next: usize,
    behind: usize,
    /// Bands of the difference that are not uploaded yet, and the rows that they begin at.
    bands: Vec<(usize, ColorImage)>,
    difference: Option<TextureHandle>,
    /// The reference, developed at an exposure.
    texture: Option<(f32, TextureHandle)>,
}

/// Sums over pixels of what a picture is against its reference.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Sums {
    pixels: f64,
    /// Σ (Y − Y₀), and its variance.
    error: f64,
    variance: f64,
    /// Over the channels, Σ (x − x₀)²/(x₀² + ε), and Σ (σ² + σ₀²)/(x₀² + ε).
    relative: f64,
    noise: f64,
}

/// What those are of the mean pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Figures {
    /// Mean error of the luminance and its standard error, W·m⁻²·sr⁻¹.
    error: [f64; 2],
    /// relMSE, and what of it standard errors explain.
    relative: f64,
    noise: f64,
}

impl AddAssign for Sums {
    fn add_assign(&mut self, other: Self) {
        self.pixels += other.pixels;
        self.error += other.error;
        self.variance += other.variance;
        self.relative += other.relative;
        self.noise += other.noise;
    }
}

impl Sums {
    /// Those of one pixel, picture and reference.
    fn of((mean, variance): (Vec3, Vec3), (mean0, variance0): (Vec3, Vec3), floor: f64) -> Self {
        let both = variance + variance0;
        // The channels' errors are taken as fully correlated, as everywhere.
        let error = f64::from(luminance(both.map(f32::sqrt)));
        let mut sums = Self {
            pixels: 1.0,
            error: f64::from(luminance(mean - mean0)),
            variance: error * error,
            ..Self::default()
        };
        for k in 0..3 {
            // Of a reference that is black everywhere ε is 0, too.
            let scale = (f64::from(mean0[k]).powi(2) + floor).max(f64::MIN_POSITIVE);
            sums.relative += f64::from(mean[k] - mean0[k]).powi(2) / scale;
            sums.noise += f64::from(both[k]) / scale;
        }
        sums
    }

    /// None: there is no pixel that both have.
    fn figures(self) -> Option<Figures> {
        let n = self.pixels;
        (n > 0.0).then(|| Figures {
            error: [self.error / n, self.variance.sqrt() / n],
            relative: self.relative / (3.0 * n),
            noise: self.noise / (3.0 * n),
        })
    }
}

/// ε of a reference: a hundredth of the square of its mean over pixels and channels.
fn floor(means: impl Iterator<Item = Vec3>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for mean in means {
        sum += f64::from(mean.x) + f64::from(mean.y) + f64::from(mean.z);
        count += 3.0;
    }
    FLOOR * (sum / f64::max(count, 1.0)).powi(2)
}

impl Kept {
    fn of(parts: &[(&Film, f32)], order: Option<usize>, film: &Camera, camera: Camera) -> Self {
        let size = size(film);
        let pixel = |i| picture::blend(parts, order, i);
        let pixels: Vec<Pixel> = (0..size[0] * size[1]).into_par_iter().map(pixel).collect();
        let floor = floor(pixels.iter().flatten().map(|(mean, _)| *mean));
        Self { camera, size, pixels, floor }
    }

    /// As it is seen at this exposure.
    fn image(&self, exposure: f32) -> ColorImage {
        let tone = Tone { exposure, ..Tone::default() };
        let colour = |pixel: &Pixel| match pixel {
            Some((mean, _)) => colour(&tone, *mean),
            None => Color32::BLACK,
        };
        ColorImage::new(self.size, self.pixels.par_iter().map(colour).collect())
    }

    /// What some rows of the picture are against it, and their difference.
    fn compare(
        &self,
        parts: &[(&Film, f32)],
        look: &Look,
        rows: Range<usize>,
    ) -> (Sums, ColorImage) {
        let tone = Tone { exposure: look.exposure, ..Tone::default() };
        let width = self.size[0];
        let mut pixels = vec![colours::UNKNOWN; width * rows.len()];
        let row = |(row, y): (&mut [Color32], usize)| {
            let mut sums = Sums::default();
            for (x, pixel) in row.iter_mut().enumerate() {
                let i = y * width + x;
                let own = picture::blend(parts, look.order, i);
                let Some((own, reference)) = own.zip(self.pixels[i]) else { continue };
                sums += Sums::of(own, reference, self.floor);
                *pixel = colour(&tone, (own.0 - reference.0).abs());
            }
            sums
        };
        let found: Vec<Sums> = pixels.par_chunks_mut(width).zip(rows.clone()).map(row).collect();
        // One after another: the same bits for any number of threads.
        let mut sums = Sums::default();
        found.into_iter().for_each(|row| sums += row);
        (sums, ColorImage::new([width, rows.len()], pixels))
    }
}

fn size(camera: &Camera) -> [usize; 2] {
    [camera.width as usize, camera.height as usize]
}

fn colour(tone: &Tone, radiance: Vec3) -> Color32 {
    colours::ink(tone.encode(radiance))
}

/// Keeps the picture as it is now.
pub(crate) fn keep(world: &mut World) {
    let Some(render) = world.get_resource::<Render>() else { return };
    let viewpoint = world.resource::<Viewpoint>();
    // Of a part there is no picture that a later one could be held against.
    let may = !viewpoint.is_preview() && !viewpoint.is_part();
    let Some(camera) = viewpoint.camera().filter(|_| may) else { return };
    let look = world.resource::<Look>();
    let share = world.resource::<Statistics>().share(render);
    let parts = picture::parts(render, look.view, share);
    let kept = Kept::of(&parts, look.order, render.camera(), camera.clone());
    *world.resource_mut::<Reference>() =
        Reference { kept: Some(kept), wipe: 0.5, ..Reference::default() };
}

/// Goes on comparing, and lets the reference go once the camera is another one.
pub(crate) fn compare(
    render: Option<Res<Render>>,
    look: Res<Look>,
    viewpoint: Res<Viewpoint>,
    statistics: Res<Statistics>,
    mut reference: ResMut<Reference>,
    mut toasts: ResMut<Toasts>,
    mut log: ResMut<Log>,
) {
    let reference = reference.bypass_change_detection();
    let Some(kept) = &reference.kept else { return };
    if viewpoint.camera() != Some(&kept.camera) {
        *reference = Reference::default();
        let said = tr!("The reference is let go: camera or size have changed");
        toasts.say(said.clone());
        log.say(said);
        return;
    }
    let size_kept = kept.size;
    // While the film is being made anew it has other pixels.
    let is_comparable = |r: &Res<Render>| size(r.camera()) == size_kept && !viewpoint.is_preview();
    if let Some(render) = render.filter(is_comparable) {
        reference.advance(&render, &look, statistics.share(&render));
    }
}

impl Reference {
    pub(crate) fn is_kept(&self) -> bool {
        self.kept.is_some()
    }

    /// Whether something of the film is not compared yet.
    pub(crate) fn is_behind(&self) -> bool {
        self.kept.is_some() && self.behind > 0
    }

    /// Goes on with what is new in the film: the next band.
    fn advance(&mut self, render: &Render, look: &Look, share: f64) {
        let walks: u64 = render.exposures().iter().flatten().map(|e| e.walks).sum();
        if self.of != Some((walks, *look)) {
            let is_same = |of: (u64, Look)| (of.1.view, of.1.order) == (look.view, look.order);
            if !self.of.is_some_and(is_same) {
                self.sums = [None; BANDS];
            }
            (self.of, self.behind) = (Some((walks, *look)), BANDS);
        }
        if self.behind > 0 {
            self.compare_band(render, look, share);
        }
    }

    /// Compares the next band.
    fn compare_band(&mut self, render: &Render, look: &Look, share: f64) {
        let Some(kept) = &self.kept else { return };
        let height = kept.size[1];
        let rows = self.next * height / BANDS..(self.next + 1) * height / BANDS;
        let parts = picture::parts(render, look.view, share);
        let (sums, image) = kept.compare(&parts, look, rows.clone());
        self.sums[self.next] = Some(sums);
        if !rows.is_empty() {
            self.bands.retain(|(row, _)| *row != rows.start);
            self.bands.push((rows.start, image));
        }
        self.next = (self.next + 1) % BANDS;
        self.behind -= 1;
    }

    /// What is known once all bands are compared.
    fn found(&self) -> Option<Figures> {
        let mut all = Sums::default();
        for sums in self.sums {
            all += sums?;
        }
        all.figures()
    }

    /// What to show, where there is a reference; whether it is to be let go.
    pub(crate) fn choice(&mut self, ui: &mut Ui) -> bool {
        if !self.is_kept() {
            return false;
        }
        let row = ui.horizontal_wrapped(|ui| {
            let hint = tr!(
                "The reference on the left of a line that is dragged, the picture on its right"
            );
            for (shown, name, hint) in [
                (Shown::Picture, tr!("This picture"), tr!("As it is without a reference")),
                (Shown::Reference, tr!("Reference"), tr!("As it was when it was kept")),
                (
                    Shown::Difference,
                    tr!("Difference"),
                    tr!("How far the channels are apart, at the same exposure"),
                ),
                (Shown::Wipe, tr!("Wipe"), hint),
            ] {
                ui.selectable_value(&mut self.shown, shown, name).on_hover_text(hint);
            }
            ui.separator();
            ui.button(tr!("Let the reference go")).clicked()
        });
        row.inner
    }

    /// Where all of both pictures would be drawn, of which a rectangle is seen.
    pub(crate) fn place(&self, rect: Rect) -> Rect {
        if self.is_kept() { self.zoom.place(rect, rect.size()) } else { rect }
    }

    /// The wheel enlarges both pictures alike, and what is enlarged is pulled about by `drag`;
    /// whether the pointer means that and not the camera, with which the reference would go.
    pub(crate) fn hand(&mut self, ui: &Ui, response: &Response, rect: Rect, drag: bool) -> bool {
        if !self.is_kept() || drag && !self.zoom.is_near() {
            return false;
        }
        if drag {
            self.zoom.pull(response.drag_delta(), rect, rect.size());
        }
        self.zoom.hand(ui, response, rect, rect.size());
        true
    }

    /// Draws what was chosen over the picture, whose place is `rect`, as far as `view` shows it.
    pub(crate) fn draw(&mut self, ui: &Ui, [rect, view]: [Rect; 2], look: &Look) {
        let part = match self.shown {
            Shown::Picture => return,
            Shown::Reference | Shown::Difference => view,
            Shown::Wipe => view.with_max_x(self.x(rect).min(view.right())),
        };
        let texture = match self.shown {
            Shown::Difference => self.difference(ui.ctx()),
            _ => self.texture(ui.ctx(), look.exposure),
        };
        if let Some(texture) = texture {
            let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
            ui.painter().with_clip_rect(part).image(texture, rect, whole, Color32::WHITE);
        }
    }

    /// Where the divider is.
    fn x(&self, rect: Rect) -> f32 {
        rect.left() + self.wipe * rect.width()
    }

    fn texture(&mut self, ctx: &egui::Context, exposure: f32) -> Option<TextureId> {
        let kept = self.kept.as_ref()?;
        let is_there = self.texture.as_ref().is_some_and(|(of, _)| *of == exposure);
        if !is_there {
            let image = kept.image(exposure);
            let texture = ctx.load_texture("reference", image, TextureOptions::LINEAR);
            self.texture = Some((exposure, texture));
        }
        self.texture.as_ref().map(|(_, texture)| texture.id())
    }

    fn difference(&mut self, ctx: &egui::Context) -> Option<TextureId> {
        let size = self.kept.as_ref()?.size;
        let texture = self.difference.get_or_insert_with(|| {
            let image = ColorImage::filled(size, Color32::BLACK);
            ctx.load_texture("difference", image, TextureOptions::LINEAR)
        });
        for (row, band) in self.bands.drain(..) {
            texture.set_partial([0, row], band, TextureOptions::LINEAR);
        }
        Some(texture.id())
    }

    /// The divider, which lies above the picture and is dragged instead of it.
    pub(crate) fn divider(&mut self, ui: &Ui, [rect, view]: [Rect; 2]) {
        if !self.is_kept() || self.shown != Shown::Wipe {
            return;
        }
        // Where it lies out of sight, it is taken hold of at the rim.
        let x = |wipe: f32| view.x_range().clamp(rect.left() + wipe * rect.width());
        let now = x(self.wipe);
        let line = Rect::from_x_y_ranges(now - GRIP..=now + GRIP, view.y_range());
        let response = ui.interact(line, ui.scope_id().with("divider"), Sense::drag());
        let response = response.on_hover_and_drag_cursor(CursorIcon::ResizeHorizontal);
        let (name, wipe) = (tr!("Divider of reference and picture"), f64::from(self.wipe));
        response.widget_info(|| egui::WidgetInfo::slider(true, wipe, &name));
        if response.dragged()
            && let Some(at) = response.interact_pointer_pos()
        {
            self.wipe = ((at.x - rect.left()) / rect.width().max(1.0)).clamp(0.0, 1.0);
        }
        for (width, ink) in [(3.0, Color32::BLACK), (1.0, Color32::WHITE)] {
            ui.painter().vline(x(self.wipe), view.y_range(), (width, ink));
        }
    }

    /// How far the picture is from the reference, below it.
    pub(crate) fn figures(&self, ui: &mut Ui, rect: Rect) {
        if !self.is_kept() {
            return;
        }
        ui.scope_builder(UiBuilder::new().max_rect(rect), |ui| {
            ui.horizontal(|ui| {
                let Some(found) = self.found() else {
                    ui.weak("…");
                    return;
                };
                told(ui, &found);
            })
        });
    }
}

/// The figures, each with its formula.
fn told(ui: &mut Ui, found: &Figures) {
    let [error, std_error] = found.error;
    ui.label(tr!("Mean error {}", plus_minus(error, std_error, "W/(m² sr)"))).on_hover_text(tr!(
        "Mean of Y − Y₀ over all pixels, picture less reference, ± √Σ(σ² + σ₀²)/n by the standard errors of both"
    ));
    ui.separator();
    ui.label(tr!("relMSE {}", significant(found.relative, 3))).on_hover_text(tr!(
        "Mean of (x − x₀)²/(x₀² + ε) over pixels and channels; ε is 0.01 of the squared mean of the reference"
    ));
    if found.noise.is_finite() {
        ui.weak(tr!("noise alone: {}", significant(found.noise, 3))).on_hover_text(tr!(
            "Mean of (σ² + σ₀²)/(x₀² + ε): so far are two pictures of the same light from each other. One that goes on from its own reference shares its walks, and is nearer."
        ));
    }
}

/// Whether the button is pressed that keeps the picture.
pub(crate) fn button(ui: &mut Ui, may: bool) -> bool {
    let hint =
        tr!("Keeps the picture as it is now, to hold later ones of the same camera against it");
    let button = ui.add_enabled(may, Button::new(tr!("Keep as reference")));
    button.on_hover_text(hint).clicked()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures(picture: &[(Vec3, Vec3)], reference: &[(Vec3, Vec3)]) -> Figures {
        let floor = floor(reference.iter().map(|(mean, _)| *mean));
        let mut sums = Sums::default();
        picture.iter().zip(reference).for_each(|(p, r)| sums += Sums::of(*p, *r, floor));
        sums.figures().expect("pixels")
    }

    fn grey(mean: f32, variance: f32) -> (Vec3, Vec3) {
        (Vec3::splat(mean), Vec3::splat(variance))
    }

    fn is_near(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-6 * b.abs().max(1.0)
    }

    #[test]
    fn a_picture_that_is_its_reference_has_no_error() {
        let picture = [grey(1.0, 0.0), grey(3.0, 0.0)];
        let found = figures(&picture, &picture);
        assert_eq!(found, Figures { error: [0.0; 2], relative: 0.0, noise: 0.0 });
        let black = [grey(0.0, 0.0)];
        assert_eq!(figures(&black, &black).relative, 0.0);
        assert_eq!(Sums::default().figures(), None);
    }

    #[test]
    fn known_pictures_have_the_figures_of_their_formulas() {
        // ε is 0.01: the mean is 1.
        let found = figures(&[grey(1.1, 4e-3); 2], &[grey(1.0, 5e-3); 2]);
        assert!(is_near(found.relative, 0.01 / 1.01), "{found:?}");
        assert!(is_near(found.noise, 9e-3 / 1.01), "{found:?}");
        assert!(is_near(found.error[0], 0.1), "{found:?}");
        assert!(is_near(found.error[1], (9e-3 / 2.0_f64).sqrt()), "{found:?}");
        // On black, ε alone is what an error is relative to.
        let found = figures(&[grey(0.1, 0.0), grey(2.0, 0.0)], &[grey(0.0, 0.0), grey(2.0, 0.0)]);
        assert!(is_near(found.relative, 0.5), "{found:?}");
        assert!(is_near(found.error[0], 0.05), "{found:?}");
    }

    #[test]
    fn errors_of_one_standard_error_are_noise() {
        let picture = [grey(1.3, 0.05), grey(0.7, 0.05), grey(4.3, 0.05), grey(0.3, 0.05)];
        let reference = [grey(1.0, 0.04), grey(1.0, 0.04), grey(4.0, 0.04), grey(0.0, 0.04)];
        let found = figures(&picture, &reference);
        assert!((found.relative / found.noise - 1.0).abs() < 1e-5, "{found:?}");
        let unknown = figures(&[grey(1.0, f32::INFINITY)], &[grey(1.0, 0.0)]);
        assert!(unknown.noise.is_infinite() && unknown.relative == 0.0, "{unknown:?}");
    }
}
