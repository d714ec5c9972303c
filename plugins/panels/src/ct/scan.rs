//! The simulated scan: what is asked for, how far it is, its sinogram while it forms.

use bevy_ecs::prelude::*;
use egui::{Color32, DragValue, ProgressBar, Rect, TextureHandle, TextureOptions, Ui, pos2, vec2};
use intrados_scene::Scene;
use intrados_stage::Work;
use intrados_xray::{
    plugin::{RestoreScan, Scan, StopScan, TakeScan},
    scan::Corrections,
};

use super::draw;
use crate::{
    lang::{drag, fixed, term},
    number::{percent, significant},
};

/// What to ask for.
pub(super) struct Wish {
    /// None: the scanner's first place.
    along: Option<f32>,
    views: usize,
    width: usize,
    slices: usize,
    seed: u64,
    corrections: Corrections,
}

impl Default for Wish {
    fn default() -> Self {
        Self {
            along: None,
            views: 180,
            width: 192,
            slices: 4,
            seed: 1,
            corrections: Corrections::ALL,
        }
    }
}

/// The sinogram's texture, and how many values it was made of.
#[derive(Default)]
pub(super) struct Picture(Option<(usize, TextureHandle)>);

/// What the tab asks of the scanner.
#[derive(bevy_ecs::system::SystemParam)]
pub(crate) struct Asks<'w> {
    take: MessageWriter<'w, TakeScan>,
    restore: MessageWriter<'w, RestoreScan>,
    stop: MessageWriter<'w, StopScan>,
}

/// What to scan, begin and stop, and what is corrected.
pub(super) fn controls(
    ui: &mut Ui,
    wish: &mut Wish,
    scene: &Scene,
    member: &str,
    scan: Option<&Scan>,
    asks: &mut Asks<'_>,
) {
    let first = || {
        scene.structure.scanners.first().and_then(|s| s.orbit.along.first().copied()).unwrap_or(0.5)
    };
    let running = scan.is_some_and(|s| s.work.is_running());
    ui.horizontal_wrapped(|ui| {
        let mut along = wish.along.unwrap_or_else(first);
        ui.add_enabled_ui(!running, |ui| {
            let place = drag(&mut along).range(0.0..=1.0).speed(0.005).max_decimals(3);
            number(ui, tr!("At"), place, tr!("Place on the member's axis, 0 to 1"));
            let views = drag(&mut wish.views).range(24..=1440);
            number(ui, tr!("views"), views, tr!("Projections of the orbit"));
            let width = drag(&mut wish.width).range(32..=1024);
            let what = tr!("Across the panel; the field of view stays");
            number(ui, tr!("pixels"), width, what);
            let slices = drag(&mut wish.slices).range(1..=32);
            number(ui, tr!("slices|of a scan"), slices, tr!("Slices round the place"));
            number(ui, tr!("seed"), drag(&mut wish.seed), tr!("Of concrete and noise"));
        });
        wish.along = Some(along);
        if let Some(Work::Running(task)) = scan.map(|s| &s.work) {
            if ui.button(tr!("⏹ Stop scan")).clicked() {
                asks.stop.write(StopScan(member.to_owned()));
            }
            let job = task.job();
            let done = format!("{} %", fixed(100.0 * job.done(), 0));
            ui.add(ProgressBar::new(job.done()).desired_width(150.0).text(done));
            ui.weak(job.label());
            ui.ctx().request_repaint_after(std::time::Duration::from_millis(50));
            return;
        }
        let name = if scan.is_some() { tr!("⟲ Scan again") } else { tr!("▶ Scan") };
        let hint = tr!("Photons from the scene's scanner through this member, \
             as `intrados scan` computes them");
        if ui.button(name).on_hover_text(hint).clicked() {
            let member = member.to_owned();
            let Wish { views, width, slices, seed, corrections, .. } = *wish;
            asks.take.write(TakeScan { member, along, views, width, slices, seed, corrections });
        }
    });
    ui.horizontal_wrapped(|ui| {
        ui.label(tr!("Corrections:"));
        let before = wish.corrections;
        let c = &mut wish.corrections;
        ui.add_enabled_ui(!running, |ui| {
            for (name, on, what) in [
                (
                    tr!("scatter"),
                    &mut c.scatter,
                    tr!("Scattered photons, as walks of their own estimate them, are taken off"),
                ),
                (
                    tr!("hardening"),
                    &mut c.hardening,
                    tr!("Line integrals are made straight: soft photons do not get far"),
                ),
                (
                    tr!("rings"),
                    &mut c.rings,
                    tr!("Gains that have drifted are found as stripes of the sinogram"),
                ),
                (tr!("metal"), &mut c.metal, tr!("The same for steel (with hardening)")),
            ] {
                ui.checkbox(on, name).on_hover_text(what);
            }
        });
        if *c != before && scan.is_some_and(|s| s.done().is_some()) {
            asks.restore.write(RestoreScan { member: member.to_owned(), corrections: *c });
        }
        if let Some(done) = scan.and_then(Scan::done) {
            let scatter_map = &done.acquisition.scatter_map;
            ui.separator();
            ui.weak(tr!(
                "scatter over primary {} ± {}",
                significant(scatter_map.to_primary, 3),
                percent(scatter_map.rel_error)
            ));
            if done.restored.starved > 1e-4 {
                ui.label(tr!("⚠ {} of the rays starved", percent(done.restored.starved)))
                    .on_hover_text(tr!("Behind them less was left than its own error"));
            }
        }
        match scan.map(|s| &s.work) {
            Some(Work::Failed(why)) => drop(ui.colored_label(
                ui.visuals().error_fg_color,
                tr!("⚠ Not scanned: {}", term(&why.to_string())),
            )),
            Some(Work::Cancelled) => drop(ui.label(tr!("⏹ Stopped"))),
            _ => {}
        }
    });
}

fn number(ui: &mut Ui, name: String, value: DragValue<'_>, what: String) {
    let label = ui.label(name);
    ui.add(value).labelled_by(label.id).on_hover_text(what);
}

/// There are no slices yet: the sinogram as it forms, or nothing.
pub(super) fn waiting(ui: &mut Ui, picture: &mut Picture, scan: Option<&Scan>, name: &str) {
    match scan {
        Some(scan) if !scan.sinogram.is_empty() => {
            sinogram(ui, picture, scan, ui.available_rect_before_wrap())
        }
        Some(scan) if scan.work.is_running() => {
            ui.add_space(24.0);
            ui.vertical_centered(|ui| {
                ui.spinner();
                ui.label(tr!(
                    "Concrete grows, and scatter is walked, before the first projection is taken…"
                ));
            });
        }
        Some(_) => {}
        None => {
            ui.add_space(24.0);
            ui.vertical_centered(|ui| {
                ui.heading(tr!("Not scanned yet"));
                ui.label(tr!(
                    "Scan takes projections of {} with the scene's scanner and reconstructs \
                     slices from them.",
                    name
                ));
                ui.weak(tr!("Pores, grains, bars and planted damage are those of the scene. \
                     Some tens of seconds."));
            });
        }
    }
}

/// The sinogram of the panel's middle row: views from the top, bins across.
pub(super) fn sinogram(ui: &mut Ui, picture: &mut Picture, scan: &Scan, area: Rect) {
    let count = scan.sinogram.len();
    let running = scan.work.is_running();
    if picture.0.as_ref().is_none_or(|p| p.0 != count) {
        let image = draw::sinogram(&scan.sinogram.row());
        match &mut picture.0 {
            Some((made, texture)) => {
                texture.set(image, TextureOptions::LINEAR);
                *made = count;
            }
            None => {
                picture.0 =
                    Some((count, ui.ctx().load_texture("sinogram", image, TextureOptions::LINEAR)))
            }
        }
    }
    let Some((_, texture)) = &picture.0 else { return };
    let response = ui.allocate_rect(area, egui::Sense::hover());
    response.widget_info(|| {
        egui::WidgetInfo::labeled(egui::Role::Image, true, tr!("Sinogram of {}", scan.wish.member))
    });
    let painter = ui.painter().with_clip_rect(area);
    painter.rect_filled(area, 2.0, ui.visuals().extreme_bg_color);
    let [bins, views] = texture.size();
    // Not so wide that views look like bands.
    let width = (area.width() - 60.0).min(1.6 * (area.height() - 50.0)).max(40.0);
    let rect = Rect::from_center_size(
        area.center() + vec2(14.0, 4.0),
        vec2(width, (area.height() - 50.0).max(40.0)),
    );
    painter.image(
        texture.id(),
        rect,
        Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0)),
        Color32::WHITE,
    );
    painter.rect_stroke(
        rect,
        0.0,
        (1.0, ui.visuals().weak_text_color()),
        egui::StrokeKind::Outside,
    );
    let (font, colour) = (egui::TextStyle::Small.resolve(ui.style()), ui.visuals().text_color());
    let text = |at, align, text: String| painter.text(at, align, text, font.clone(), colour);
    let done = count / bins.max(1);
    let so_far = if running && done < views {
        tr!("view {} of {}", done, views)
    } else {
        tr!("{} views", views)
    };
    text(
        pos2(rect.left(), rect.top() - 6.0),
        egui::Align2::LEFT_BOTTOM,
        tr!("−ln(I/I₀) of the middle row: {} bins, {}", bins, so_far),
    );
    text(pos2(rect.left() - 6.0, rect.top()), egui::Align2::RIGHT_TOP, "0°".into());
    let arc = scan
        .done()
        .and_then(|d| d.acquisition.exposure.orbit.angles.last().copied())
        .unwrap_or(std::f64::consts::TAU);
    text(
        pos2(rect.left() - 6.0, rect.bottom()),
        egui::Align2::RIGHT_BOTTOM,
        format!("{}°", fixed(arc.to_degrees(), 0)),
    );
}
