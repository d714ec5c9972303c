//! CT slices of the selected member, with what was found in them.

use std::sync::Arc;

use bevy_ecs::prelude::*;
use egui::{Color32, ColorImage, TextureHandle, TextureOptions, Ui, vec2};
use intrados_damage::{
    detect::{Detection, detect},
    drawn,
    predict::Settings,
    slice::Slice,
};
use intrados_scene::{Scene, Slices, plugin::CurrentScene};
use intrados_stage::{Job, Jobs, Task};

use crate::{Action, Actions, Selection, number::percent};

/// Longer side of what is shown, pixels; larger slices are thinned.
const SIDE: usize = 1024;
/// Outlines: vermilion and blue, as in the report.
const PORE: Color32 = Color32::from_rgb(0, 114, 189);
const CRACK: Color32 = Color32::from_rgb(213, 62, 0);

/// The slice that is shown.
#[derive(Resource, Default)]
pub(crate) struct Ct {
    index: usize,
    overlay: Option<bool>,
    /// What `shown` and `task` are of: scene, member, slice.
    of: Option<(String, usize, usize)>,
    task: Option<Task<Result<Read, String>>>,
    shown: Option<Result<Shown, String>>,
}

struct Read {
    images: [ColorImage; 2],
    caption: String,
    pores: usize,
    cracks: usize,
}

struct Shown {
    read: Read,
    textures: [TextureHandle; 2],
}

impl Ct {
    pub(crate) fn is_busy(&self) -> bool {
        self.task.is_some()
    }
}

/// One slice of a member.
#[derive(Debug, Clone)]
enum Source {
    File(std::path::PathBuf, f32),
    Drawn(drawn::Request),
}

fn sources(slices: &[Slices]) -> Vec<(String, Source)> {
    let mut list = Vec::new();
    for s in slices {
        match s {
            Slices::Files { name, images, pixel_mm, .. } => {
                list.extend(images.iter().map(|image| (name.clone(), Source::File(image.clone(), *pixel_mm))));
            }
            &Slices::Drawn { ref name, count, size, pixel_mm, seed } => {
                list.extend((0..count).map(|index| (name.clone(), Source::Drawn(drawn::Request { index, count, size, pixel_mm, seed }))));
            }
        }
    }
    list
}

pub(crate) fn ct(
    InMut(ui): InMut<Ui>,
    scene: Option<Res<CurrentScene>>,
    selection: Res<Selection>,
    mut ct: ResMut<Ct>,
    mut jobs: ResMut<Jobs>,
    mut actions: ResMut<Actions>,
) {
    let Some(scene) = scene else { return };
    let Some((member, of)) = selection.0.and_then(|i| Some((i, scene.0.members.get(i)?))) else {
        return choose(ui, &scene.0, &mut actions);
    };
    let sources = sources(&of.slices);
    if sources.is_empty() {
        ui.label(format!("{} has no CT slices.", of.name));
        return choose(ui, &scene.0, &mut actions);
    }
    ct.index = ct.index.min(sources.len() - 1);
    let (core, source) = &sources[ct.index];
    tools(ui, &mut ct, core, sources.len());
    let wanted = (scene.0.hash.clone(), member, ct.index);
    if ct.of.as_ref() != Some(&wanted) {
        // Of the same member the slice before stays until the new one is there.
        if ct.of.as_ref().is_none_or(|(scene, member, _)| (scene, *member) != (&wanted.0, wanted.1)) {
            ct.shown = None;
        }
        ct.of = Some(wanted);
        let (scene, source) = (Arc::clone(&scene.0), source.clone());
        ct.task = Some(Task::spawn(&mut jobs, "reading a CT slice", move |job| read(&scene, member, &source, job)));
    }
    take(ui, &mut ct);
    show(ui, &mut ct);
}

/// Which members have slices.
fn choose(ui: &mut Ui, scene: &Scene, actions: &mut Actions) {
    let with: Vec<(usize, &str)> =
        scene.members.iter().enumerate().filter(|(_, m)| !m.slices.is_empty()).map(|(i, m)| (i, m.name.as_str())).collect();
    if with.is_empty() {
        ui.label("No member of this scene has CT slices.");
        return;
    }
    ui.label("Select a member that has CT slices:");
    for (index, name) in with {
        if ui.button(name).clicked() {
            actions.ask(Action::Select(Some(index)));
        }
    }
}

fn tools(ui: &mut Ui, ct: &mut Ct, core: &str, count: usize) {
    ui.horizontal_wrapped(|ui| {
        ui.strong(core);
        let label = ui.label("Slice");
        let mut number = ct.index + 1;
        ui.add(egui::Slider::new(&mut number, 1..=count)).labelled_by(label.id);
        ct.index = number.clamp(1, count) - 1;
        ui.separator();
        let mut overlay = ct.overlay.unwrap_or(true);
        ui.checkbox(&mut overlay, "Outline what was found");
        ct.overlay = Some(overlay);
        if let Some(Ok(shown)) = &ct.shown {
            ui.separator();
            ui.label("—").labelled(PORE);
            ui.label(format!("{} pores", shown.read.pores));
            ui.label("—").labelled(CRACK);
            ui.label(format!("{} cracks", shown.read.cracks));
        }
    });
}

trait Swatch {
    fn labelled(self, colour: Color32) -> Self;
}

impl Swatch for egui::Response {
    /// Draws over the label a line of this colour.
    fn labelled(self, colour: Color32) -> Self {
        self.ctx.layer_painter(self.layer_id).hline(self.rect.x_range(), self.rect.center().y, (3.0, colour));
        self
    }
}

fn take(ui: &Ui, ct: &mut Ct) {
    if let Some(done) = ct.task.as_ref().and_then(Task::poll) {
        ct.task = None;
        ct.shown = Some(match done {
            Ok(Ok(read)) => {
                let load = |image: &ColorImage, name: &str| ui.ctx().load_texture(name, image.clone(), TextureOptions::LINEAR);
                let textures = [load(&read.images[0], "slice"), load(&read.images[1], "overlay")];
                Ok(Shown { read, textures })
            }
            Ok(Err(reason)) => Err(reason),
            Err(_) => Err("the reader broke off".into()),
        });
    }
}

fn show(ui: &mut Ui, ct: &mut Ct) {
    match &ct.shown {
        Some(Ok(shown)) => {
            ui.weak(if ct.task.is_some() { "reading…" } else { &shown.read.caption });
            let texture = &shown.textures[usize::from(ct.overlay.unwrap_or(true))];
            let [w, h] = texture.size();
            let area = ui.available_size();
            let scale = (area.x / w as f32).min(area.y / h as f32);
            ui.centered_and_justified(|ui| {
                let picture = egui::Image::new((texture.id(), vec2(w as f32 * scale, h as f32 * scale))).alt_text("CT slice");
                ui.add(picture);
            });
        }
        Some(Err(reason)) => {
            ui.label(format!("⚠ This slice cannot be shown: {reason}"));
        }
        None => {
            ui.spinner();
        }
    }
}

fn read(scene: &Scene, member: usize, source: &Source, job: &Job) -> Result<Read, String> {
    // One thread of its own: the frame's passes must not wait for it.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(|e| e.to_string())?;
    pool.install(|| {
        let slice = match source {
            Source::File(path, pixel_mm) => Slice::read(path, *pixel_mm).map_err(|e| e.to_string())?,
            // Its name says that it was drawn and not scanned.
            Source::Drawn(request) => drawn::draw(scene, member, *request)?.slice,
        };
        let found = detect(&slice, &Settings::default().detect, job).map_err(|e| e.to_string())?;
        let caption = format!(
            "{}: {} × {} pixels of {} mm, porosity {} ± {}",
            slice.name,
            slice.grey.width,
            slice.grey.height,
            slice.pixel_mm,
            percent(found.porosity.value),
            percent(found.porosity.std_error)
        );
        Ok(Read { images: images(&slice, &found), caption, pores: found.pores.len(), cracks: found.cracks.len() })
    })
}

/// The slice as it is, and with the outlines of what was found.
fn images(slice: &Slice, found: &Detection) -> [ColorImage; 2] {
    let (width, height) = (found.grey.width, found.grey.height);
    // Sound concrete is a light grey, and metal white.
    let body = slice.grey.data.iter().zip(&found.body.data).filter(|(_, inside)| **inside).map(|(grey, _)| f64::from(*grey));
    let (sum, count) = body.fold((0.0, 0_usize), |(sum, count), grey| (sum + grey, count + 1));
    let white = 1.3 * (sum / count.max(1) as f64) as f32;
    let step = width.max(height).div_ceil(SIDE).max(1);
    let (w, h) = (width.div_ceil(step), height.div_ceil(step));
    let kind = |x: usize, y: usize| {
        let i = y.min(height - 1) * width + x.min(width - 1);
        match (found.crack_mask.data[i], found.labels.data[i]) {
            (true, _) => 2,
            (false, 0) => 0,
            (false, _) => 1_u8,
        }
    };
    let pixel = |i: usize, outlined: bool| {
        let (x, y) = (i % w * step, i / w * step);
        let here = kind(x, y);
        let rim = outlined
            && here > 0
            && [kind(x + step, y), kind(x, y + step), kind(x.saturating_sub(step), y), kind(x, y.saturating_sub(step))]
                .iter()
                .any(|k| *k != here);
        match (rim, here) {
            (true, 1) => PORE,
            (true, 2) => CRACK,
            _ => {
                let at = y.min(height - 1) * width + x.min(width - 1);
                Color32::from_gray((slice.grey.data[at] / white * 255.0).clamp(0.0, 255.0) as u8)
            }
        }
    };
    [false, true].map(|outlined| ColorImage::new([w, h], (0..w * h).map(|i| pixel(i, outlined)).collect()))
}
