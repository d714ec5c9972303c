//! Both fields on the surfaces, in false colours.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use egui::{ColorImage, TextureHandle, TextureOptions, Vec2, vec2};
use glam::Vec3;
use intrados_light::{
    Guide, LitScene,
    plugin::{Learning, Lit},
    spread,
    tone::FalseColour,
};
use intrados_scene::Camera;
use intrados_stage::{Jobs, Task, aside};
use intrados_transport::Side;
use rayon::prelude::*;

use crate::{
    Colours, Look, Quantity, colours, lang::term, legend::Legend, number::significant, orbit,
    scale::Ranges,
};

/// Pixels of a picture of a field, however small the camera's own are.
const PIXELS: u32 = 200_000;

/// Pictures of the fields that are known, and the point that is picked in them.
#[derive(Resource, Default)]
pub(crate) struct Fields {
    /// What `shown` or `task` is of.
    of: Option<Arc<Guide>>,
    task: Option<Task<[Painted; 2]>>,
    shown: Option<[Painted; 2]>,
    textures: [Option<TextureHandle>; 2],
    picked: Option<Vec2>,
    /// Where the camera stood, and what it looked at, when it was picked.
    seen: Option<[Vec3; 2]>,
}

/// A picture of one field.
pub(crate) struct Painted {
    values: Vec<f32>,
    /// Over what they are spread.
    spread: [f32; 2],
    pub(crate) image: ColorImage,
    /// How they became colours.
    pub(crate) scale: FalseColour,
}

impl Painted {
    /// What its colours mean, for a file; `side`: of which field it is.
    pub(crate) fn legend(&self, side: Side) -> Legend {
        let lines = vec![term(name(side)), caption(side)];
        Legend::new(&self.scale, |value| self.scale.encode(value), written, lines)
    }
}

impl Fields {
    pub(crate) fn is_busy(&self) -> bool {
        self.task.is_some()
    }

    /// The picture of the field of a side, once it is there.
    pub(crate) fn painted(&self, side: Side) -> Option<&Painted> {
        self.shown.as_ref().map(|both| &both[side as usize])
    }

    /// Puts on the colours and the range that are wanted now.
    fn colour(&mut self, side: Side, look: &Look, ranges: &Ranges) {
        let Some(both) = &mut self.shown else { return };
        let painted = &mut both[side as usize];
        let wanted = look.colours.locked_or_over(painted.spread, true, name(side), ranges);
        if painted.scale != wanted {
            painted.image = image(&painted.values, painted.image.size[0], &wanted);
            painted.scale = wanted;
            self.textures[side as usize] = None;
        }
    }

    /// What the field says at a share of the picture's width and height.
    pub(crate) fn value(&self, side: Side, at: Vec2) -> Option<f32> {
        let painted = self.painted(side)?;
        let [x, y] = pixel(painted.image.size, at);
        painted.values.get(y * painted.image.size[0] + x).copied()
    }

    pub(crate) fn texture(&mut self, side: Side, ctx: &egui::Context) -> Option<&TextureHandle> {
        let painted = &self.shown.as_ref()?[side as usize];
        let load = || ctx.load_texture(name(side), painted.image.clone(), TextureOptions::LINEAR);
        Some(self.textures[side as usize].get_or_insert_with(load))
    }

    /// The picked point, as a share of the picture's width and height; its middle until one is
    /// picked.
    pub(crate) fn picked(&self) -> Vec2 {
        self.picked.unwrap_or(vec2(0.5, 0.5))
    }

    pub(crate) fn pick(&mut self, at: Vec2) {
        self.picked = Some(at);
    }
}

/// The pixel of a picture of this size at a share of its width and height.
pub(crate) fn pixel([width, height]: [usize; 2], at: Vec2) -> [usize; 2] {
    let of = |share: f32, n: usize| ((share * n as f32) as usize).min(n.saturating_sub(1));
    [of(at.x, width), of(at.y, height)]
}

/// The camera of pictures of fields.
pub(crate) fn camera(of: &Camera) -> Camera {
    orbit::scaled(of, PIXELS)
}

pub(crate) fn name(side: Side) -> &'static str {
    match side {
        Side::Primal => "Radiance field",
        Side::Dual => "Importance field",
    }
}

/// What such a picture shows, and its unit.
pub(crate) fn meaning(side: Side) -> [&'static str; 2] {
    match side {
        Side::Primal => ["light that arrives at the surface by flights", "W/m²"],
        Side::Dual => ["importance for the picture that arrives at the surface by flights", "1/m²"],
    }
}

/// What the legend of such a picture is of.
pub(crate) fn caption(side: Side) -> String {
    let [what, unit] = meaning(side);
    tr!("{}, {} (logarithmic)", term(what), unit)
}

/// A value in that legend.
pub(crate) fn written(value: f32) -> String {
    significant(f64::from(value), 2)
}

/// Paints the fields off the frame as soon as somebody wants to see them.
pub(crate) fn paint(
    learning: Res<Learning>,
    lit: Option<Res<Lit>>,
    look: Res<Look>,
    ranges: Res<Ranges>,
    mut fields: ResMut<Fields>,
    mut jobs: ResMut<Jobs>,
) {
    let seen = learning.camera().map(|camera| [camera.position, camera.target]);
    if fields.seen != seen {
        (fields.seen, fields.picked) = (seen, None);
    }
    let guide = learning.guide();
    if fields.of.as_ref().map(Arc::as_ptr) != guide.map(Arc::as_ptr) {
        let (seen, picked) = (fields.seen, fields.picked);
        *fields = Fields { of: guide.cloned(), seen, picked, ..Fields::default() };
    }
    if let Some(done) = Task::take(&mut fields.task) {
        fields.shown = done.ok();
    }
    if let Quantity::Field(side) = look.quantity {
        fields.colour(side, &look, &ranges);
    }
    let is_wanted = matches!(look.quantity, Quantity::Field(_))
        && fields.task.is_none()
        && fields.shown.is_none();
    let (true, Some(guide), Some(lit), Some(of)) =
        (is_wanted, guide.cloned(), lit, learning.camera())
    else {
        return;
    };
    let (lit, camera, colours) = (Arc::clone(&lit.0), camera(of), look.colours);
    // Not in the list of jobs: it takes less than a second.
    let work =
        move |_: &_| aside(|| Side::BOTH.map(|side| painted(&guide, &lit, &camera, side, colours)));
    fields.task =
        Some(Task::spawn_unlisted(jobs.bypass_change_detection(), "painting the fields", work));
}

fn painted(
    guide: &Guide,
    lit: &LitScene,
    camera: &Camera,
    side: Side,
    colours: Colours,
) -> Painted {
    let values = guide.picture(lit, camera, side);
    let spread = spread(&values);
    let scale = colours.over(spread, true);
    let image = image(&values, camera.width as usize, &scale);
    Painted { values, spread, image, scale }
}

/// Values as an image of so many columns.
pub(crate) fn image(values: &[f32], width: usize, scale: &FalseColour) -> ColorImage {
    let pixels = values.par_iter().map(|&v| colours::ink(scale.encode(v))).collect();
    ColorImage::new([width, values.len() / width.max(1)], pixels)
}
