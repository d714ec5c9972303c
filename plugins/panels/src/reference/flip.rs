//! FLIP of the picture against its reference as both are shown: computed off the frame, of what the
//! comparison has read band by band.

use std::sync::Arc;

use egui::{
    Color32, ColorImage, Context, Rect, Sense, TextureHandle, TextureId, TextureOptions, Ui, pos2,
    vec2,
};
use glam::Vec3;
use intrados_light::{
    View,
    tone::{FalseColour, Tone},
};
use intrados_raster::{Grid, flip};
use intrados_stage::{Job, Jobs, Task, aside};

use super::{Kept, Pixel};
use crate::{Colours, Look, colours, picture::BANDS, scale};

/// While the film goes on, FLIP is computed anew once there are so many times the walks.
const GROWTH: f64 = 1.1;
/// Value of the map where it is 1.
const WHOLE: u8 = 254;
/// Value of the map where one of the two has no pixel.
const UNKNOWN: u8 = 255;
/// Width of the legend, points.
const LEGEND: f32 = 64.0;

/// What the colours of a picture depend on: view, order and exposure.
type Sight = (View, Option<usize>, f32);
/// Means of the pixels of a band; none: no walk has been there.
type Band = Arc<Vec<Option<Vec3>>>;

#[derive(Default)]
pub(super) struct Flip {
    sight: Option<Sight>,
    /// The picture as it was compared.
    bands: [Option<Band>; BANDS],
    /// Whether there are bands that nothing was computed of.
    is_new: bool,
    /// Walks of what was computed last, or is being computed.
    last: Option<u64>,
    task: Option<Task<Option<FlipMap>>>,
    found: Option<FlipMap>,
    /// The map in these colours.
    texture: Option<(Colours, TextureHandle)>,
}

/// How different every pixel looks.
#[derive(Debug, PartialEq)]
struct FlipMap {
    /// Over the pixels that both have.
    mean: f64,
    size: [usize; 2],
    /// In steps from 0 to [`WHOLE`], or [`UNKNOWN`].
    values: Vec<u8>,
}

impl FlipMap {
    fn image(&self, scale: &FalseColour) -> ColorImage {
        let ink = |k: u8| colours::ink(scale.encode(f32::from(k) / f32::from(WHOLE)));
        let unknown = colours::ink(scale.map.unknown());
        let inks: Vec<Color32> = (0..=WHOLE).map(ink).chain([unknown]).collect();
        let pixels = self.values.iter().map(|value| inks[usize::from(*value)]).collect();
        ColorImage::new(self.size, pixels)
    }
}

impl Flip {
    pub(super) fn is_busy(&self) -> bool {
        self.task.is_some()
    }

    /// The mean over the picture, once it is known.
    pub(super) fn mean(&self) -> Option<f64> {
        self.found.as_ref().map(|found| found.mean)
    }

    /// Takes what was read of a band. In another sight all begins anew.
    pub(super) fn put(&mut self, look: &Look, index: usize, band: Vec<Option<Vec3>>) {
        let sight = (look.view, look.order, look.exposure);
        if self.sight != Some(sight) {
            *self = Self { sight: Some(sight), ..Self::default() };
        }
        self.bands[index] = Some(Arc::new(band));
        self.is_new = true;
    }

    /// Takes what has been computed, and begins anew where that pays; `rests`: all of the film as
    /// it is has been compared.
    pub(super) fn go_on(&mut self, kept: &Arc<Kept>, walks: u64, rests: bool, jobs: &mut Jobs) {
        if let Some(done) = Task::take(&mut self.task) {
            (self.found, self.texture) = (done.ok().flatten(), None);
        }
        let Some((_, _, exposure)) = self.sight else { return };
        let may = self.is_new && self.task.is_none() && (rests || is_due(self.last, walks));
        let bands: Vec<Band> = self.bands.iter().flatten().cloned().collect();
        if !may || bands.len() < BANDS {
            return;
        }
        (self.is_new, self.last) = (false, Some(walks));
        let kept = Arc::clone(kept);
        // Not in the list of jobs: it takes less than a second, and comes again and again.
        self.task = Some(Task::spawn_unlisted(jobs, "comparing by FLIP", move |job| {
            aside(|| compared(&kept, &bands, exposure, job))
        }));
    }

    /// The map, as it is shown.
    pub(super) fn texture(&mut self, ctx: &Context, wanted: Colours) -> Option<TextureId> {
        let found = self.found.as_ref()?;
        if self.texture.as_ref().is_none_or(|(of, _)| *of != wanted) {
            let image = found.image(&over(wanted));
            let texture = ctx.load_texture("FLIP", image, TextureOptions::LINEAR);
            self.texture = Some((wanted, texture));
        }
        self.texture.as_ref().map(|(_, texture)| texture.id())
    }
}

/// Whether so many walks are so many more than those of what was computed last, or begin anew.
fn is_due(last: Option<u64>, walks: u64) -> bool {
    last.is_none_or(|last| walks < last || walks as f64 >= GROWTH * last as f64)
}

/// The scale of the map.
fn over(colours: Colours) -> FalseColour {
    colours.over([0.0, 1.0], false)
}

/// What the colours of the map mean.
pub(super) fn legend(ui: &mut Ui, wanted: Colours) {
    let scale = over(wanted);
    ui.weak("0");
    let (bar, _) = ui.allocate_exact_size(vec2(LEGEND, 10.0), Sense::hover());
    let count = scale::steps(&scale);
    for k in 0..count {
        let share = |k: f32| k / f32::from(count);
        let x = |k: u8| bar.left() + bar.width() * share(f32::from(k));
        let step = Rect::from_min_max(pos2(x(k), bar.top()), pos2(x(k + 1), bar.bottom()));
        let ink = colours::ink(scale.encode(share(f32::from(k) + 0.5)));
        ui.painter().rect_filled(step, 0.0, ink);
    }
    ui.weak("1");
}

/// The picture against its reference at an exposure; none where they have no pixel in common, or
/// where it was cancelled.
fn compared(kept: &Kept, bands: &[Band], exposure: f32, job: &Job) -> Option<FlipMap> {
    let tone = Tone { exposure, ..Tone::default() };
    let shown = |(own, kept): (Option<Vec3>, &Pixel)| {
        let (own, (kept, _)) = own.zip(*kept)?;
        Some([own, kept].map(|mean| tone.encode(mean)))
    };
    let own = bands.iter().flat_map(|band| band.iter().copied());
    let pairs: Vec<Option<[[u8; 3]; 2]>> = own.zip(&kept.pixels).map(shown).collect();
    let [width, height] = kept.size;
    // What one of them lacks is black in both.
    let side = |k: usize| {
        let data = pairs.iter().map(|pair| pair.map_or([0; 3], |pair| pair[k])).collect();
        Grid { width, height, data }
    };
    let map = flip::difference([&side(0), &side(1)], job)?;
    let (mut sum, mut count) = (0.0, 0.0);
    let mut value = |(value, pair): (&f32, &Option<[[u8; 3]; 2]>)| {
        if pair.is_none() {
            return UNKNOWN;
        }
        (sum, count) = (sum + f64::from(*value), count + 1.0);
        (value * f32::from(WHOLE)).round() as u8
    };
    let values: Vec<u8> = map.data.iter().zip(&pairs).map(&mut value).collect();
    (count > 0.0).then(|| FlipMap { mean: sum / count, size: kept.size, values })
}

#[cfg(test)]
mod tests {
    use intrados_scene::Camera;

    use super::*;

    /// A reference of 16 × 16 pixels, and a picture in bands of two rows.
    fn pair(
        kept: impl Fn(usize) -> Option<Vec3>,
        own: impl Fn(usize) -> Option<Vec3>,
    ) -> (Kept, Vec<Band>) {
        let pixels = (0..256).map(|i| kept(i).map(|mean| (mean, Vec3::ZERO))).collect();
        let camera = Camera::overview([Vec3::ZERO, Vec3::ONE]);
        let kept = Kept { camera, size: [16, 16], pixels, floor: 0.0 };
        let band = |k: usize| Arc::new((32 * k..32 * k + 32).map(&own).collect::<Vec<_>>());
        (kept, (0..BANDS).map(band).collect())
    }

    fn found(pair: &(Kept, Vec<Band>)) -> Option<FlipMap> {
        compared(&pair.0, &pair.1, 0.0, &Job::default())
    }

    #[test]
    fn a_picture_looks_like_itself_and_a_pixel_that_one_lacks_is_unknown() {
        let grey = |i: usize| Some(Vec3::splat(0.01 * i as f32));
        let same = found(&pair(grey, grey)).expect("pixels");
        assert!(same.mean == 0.0 && same.values.iter().all(|v| *v == 0), "{same:?}");
        let some = found(&pair(grey, |i| grey(i).filter(|_| i >= 32))).expect("pixels");
        assert_eq!(some.mean, 0.0);
        assert!(some.values[..32].iter().all(|v| *v == UNKNOWN));
        assert!(some.values[32..].iter().all(|v| *v == 0));
        assert_eq!(found(&pair(grey, |_| None)), None);
    }

    #[test]
    fn black_and_a_light_that_is_shown_white_are_nearly_as_different_as_can_be() {
        let black_and_white = pair(|_| Some(Vec3::ZERO), |_| Some(Vec3::splat(1e3)));
        let found = found(&black_and_white).expect("pixels");
        assert!((found.mean - 0.967).abs() < 2e-3, "{found:?}");
        let scale = over(Colours::default());
        let image = found.image(&scale);
        assert_eq!(image.size, [16, 16]);
        assert_eq!(image.pixels[0], colours::ink(scale.encode(246.0 / 254.0)));
    }

    #[test]
    fn it_is_computed_anew_with_a_tenth_more_walks_or_with_new_ones() {
        assert!(is_due(None, 0) && is_due(Some(1_000), 1_101) && is_due(Some(1_000), 10));
        assert!(!is_due(Some(1_000), 1_000) && !is_due(Some(1_000), 1_099));
    }

    #[test]
    fn bands_of_another_sight_do_not_mix() {
        let mut flip = Flip::default();
        let look = Look::default();
        (0..BANDS).for_each(|k| flip.put(&look, k, Vec::new()));
        assert!(flip.bands.iter().all(Option::is_some));
        flip.put(&Look { exposure: 1.0, ..look }, 3, Vec::new());
        assert_eq!(flip.bands.iter().flatten().count(), 1);
    }
}
