//! A preview of the picture of light that is smoothed by its own error bars. It is shown and marked,
//! never written to a file and never read: all that says numbers reads the film.

mod filter;

use bevy_ecs::prelude::*;
use egui::{
    Align2, Color32, ColorImage, Rect, Role, Sense, TextStyle, TextureHandle, TextureId,
    TextureOptions, Ui, WidgetInfo, vec2,
};
use filter::Pixel;
use glam::Vec3;
use intrados_light::{Render, tone::Tone};
use intrados_scene::Camera;
use intrados_stage::{Cancelled, Job, Jobs, Task, aside};
use rayon::prelude::*;

use crate::{Look, Quantity, Statistics, Viewpoint, colours, picture};

/// The next picture is made once the film has grown by a share of one in so many, or rests.
const GROWN: u64 = 8;
/// The film is read in so many bands of rows, one a frame: with its variances, all of it at once
/// would take longer than a frame.
const BANDS: usize = 16;

/// The preview, and what of the film is read for the next one.
#[derive(Resource, Default)]
pub(crate) struct Smoothed {
    pub(crate) is_on: bool,
    /// The film that it is of.
    of: Option<Of>,
    /// Its pixels as far as they are read, from the first row on: a band a frame.
    read: Vec<Pixel>,
    /// Its walks in the last frame: where they stay, it rests.
    walks: u64,
    task: Option<Task<Result<ColorImage, Cancelled>>>,
    /// What is not uploaded yet.
    image: Option<ColorImage>,
    texture: Option<TextureHandle>,
}

/// A film, and how it is developed.
struct Of {
    camera: Camera,
    look: Look,
    /// Walks that it had when the last picture was made of it.
    walks: u64,
}

impl Smoothed {
    /// Whether there will be another one although nobody touches anything.
    pub(crate) fn is_busy(&self) -> bool {
        self.task.is_some() || !self.read.is_empty()
    }

    /// What is shown is of another film, or shown no more.
    fn forget(&mut self) {
        *self = Self { is_on: self.is_on, ..Self::default() };
    }

    /// Goes on with the next picture: reads a band of the film, hands the whole of it to the filter,
    /// or takes what has come of that.
    fn advance(&mut self, render: &Render, look: &Look, share: f64, jobs: &mut Jobs) {
        let walks: u64 = render.exposures().iter().flatten().map(|e| e.walks).sum();
        let camera = render.camera();
        let is_same = |of: &Of| of.camera == *camera && of.look == *look && of.walks <= walks;
        if !self.of.as_ref().is_some_and(is_same) {
            self.forget();
            self.of = Some(Of { camera: camera.clone(), look: *look, walks: 0 });
        }
        if let Some(Ok(Ok(image))) = Task::take(&mut self.task) {
            self.image = Some(image);
        }
        let rests = std::mem::replace(&mut self.walks, walks) == walks;
        let before = self.of.as_ref().map_or(0, |of| of.walks);
        let is_due = walks > before + before / GROWN || rests && walks > before;
        if self.task.is_some() || self.read.is_empty() && !is_due {
            return;
        }
        let size = [camera.width as usize, camera.height as usize];
        if self.read_band(render, look, share, size) {
            self.of.iter_mut().for_each(|of| of.walks = walks);
            let (pixels, exposure) = (std::mem::take(&mut self.read), look.exposure);
            // Not in the list of jobs: there is one every few seconds.
            let work = move |job: &Job| aside(|| developed(&pixels, size, exposure, job));
            self.task = Some(Task::spawn_unlisted(jobs, "smoothing", work));
        }
    }

    /// Reads the next rows of the film; whether they are the last.
    fn read_band(
        &mut self,
        render: &Render,
        look: &Look,
        share: f64,
        [width, height]: [usize; 2],
    ) -> bool {
        let from = self.read.len() / width.max(1);
        let to = (from + height.div_ceil(BANDS)).min(height);
        let parts = picture::parts(render, look.view, share);
        let band = (from * width..to * width).into_par_iter();
        self.read.par_extend(band.map(|pixel| picture::blend(&parts, None, pixel)));
        to == height
    }

    /// The texture, once there is one of the film that is shown. It is clear where no walk has been.
    pub(crate) fn texture(&mut self, ctx: &egui::Context) -> Option<TextureId> {
        if let Some(image) = self.image.take() {
            match &mut self.texture {
                Some(texture) => texture.set(image, TextureOptions::LINEAR),
                None => {
                    self.texture =
                        Some(ctx.load_texture("smoothed", image, TextureOptions::LINEAR));
                }
            }
        }
        self.texture.as_ref().map(TextureHandle::id)
    }
}

/// The smoothed picture in the colours of a screen.
fn developed(
    pixels: &[Pixel],
    size: [usize; 2],
    exposure: f32,
    job: &Job,
) -> Result<ColorImage, Cancelled> {
    let tone = Tone { exposure, ..Tone::default() };
    let means = filter::smoothed(pixels, size, job)?;
    let ink = |mean: Option<Vec3>| {
        mean.map_or(Color32::TRANSPARENT, |mean| colours::ink(tone.encode(mean)))
    };
    Ok(ColorImage::new(size, means.into_iter().map(ink).collect()))
}

/// Keeps the preview in step with the film while it is wanted. Of one order alone no errors are
/// known, and of the small film of a moving camera nothing is worth the while.
pub(crate) fn smooth(
    render: Option<Res<Render>>,
    look: Res<Look>,
    viewpoint: Res<Viewpoint>,
    statistics: Res<Statistics>,
    mut smoothed: ResMut<Smoothed>,
    mut jobs: ResMut<Jobs>,
) {
    let smoothed = smoothed.bypass_change_detection();
    let is_light = look.quantity == Quantity::Radiance && look.order.is_none();
    let is_wanted = smoothed.is_on && is_light && !viewpoint.is_preview();
    match render.filter(|_| is_wanted) {
        Some(render) => {
            let share = statistics.share(&render);
            smoothed.advance(&render, &look, share, jobs.bypass_change_detection());
        }
        None => smoothed.forget(),
    }
}

/// The switch.
pub(crate) fn switch(ui: &mut Ui, smoothed: &mut Smoothed) {
    let hint = tr!(
        "Averages pixels that differ by no more than their standard errors; for the eye alone: what \
         is measured, compared or exported stays as it is"
    );
    ui.toggle_value(&mut smoothed.is_on, tr!("Smoothed preview")).on_hover_text(hint);
}

/// Says on the picture in `rect` that it is smoothed.
pub(crate) fn mark(ui: &Ui, rect: Rect) {
    let text = tr!("smoothed: not for measuring");
    let painter = ui.painter().with_clip_rect(rect);
    let font = TextStyle::Small.resolve(ui.style());
    let galley = painter.layout_no_wrap(text.clone(), font, Color32::WHITE);
    let at = rect.center_bottom() - vec2(0.0, 8.0);
    let back = Align2::CENTER_BOTTOM.anchor_size(at, galley.size() + vec2(8.0, 4.0));
    painter.rect_filled(back, 3.0, Color32::from_black_alpha(190));
    painter.galley(back.min + vec2(4.0, 2.0), galley, Color32::WHITE);
    let response = ui.interact(back, ui.scope_id().with("smoothed"), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &text));
}
