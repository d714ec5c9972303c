//! What is under the cursor, and what is selected.

use bevy_ecs::prelude::*;
use egui::{Grid, Ui};
use intrados_light::{Render, luminance};
use intrados_scene::{Member, Scene, plugin::CurrentScene};
use intrados_transport::Side;

use crate::{
    Latest, Look, Selection, Statistics, colours,
    fields::{self, Fields},
    number::{percent, plus_minus, significant},
    picture::{self, Cursor, Under, relative_error},
};

/// Unit of radiance.
const RADIANCE: &str = "W/(m² sr)";

pub(crate) fn inspector(
    InMut(ui): InMut<Ui>,
    scene: Option<Res<CurrentScene>>,
    render: Option<Res<Render>>,
    look: Res<Look>,
    fields: Res<Fields>,
    cursor: Res<Cursor>,
    selection: Res<Selection>,
    latest: Res<Latest>,
    statistics: Res<Statistics>,
) {
    let Some(scene) = scene else { return };
    match (&cursor.0, &render) {
        (Some(under), Some(render)) => {
            under_cursor(ui, &scene.0, render, statistics.share(render), &look, &fields, under)
        }
        _ => {
            ui.weak("Move over the picture to read a value.");
        }
    }
    ui.separator();
    match selection.0.and_then(|i| Some((i, scene.0.members.get(i)?))) {
        Some((index, member)) => selected(ui, index, member, &latest),
        None => {
            ui.weak("Click on a member to select it.");
        }
    }
}

fn under_cursor(
    ui: &mut Ui,
    scene: &Scene,
    render: &Render,
    share: f64,
    look: &Look,
    fields: &Fields,
    under: &Under,
) {
    let size = [render.camera().width as usize, render.camera().height as usize];
    let [x, y] = fields::pixel(size, under.at);
    let pixel = y * size[0] + x;
    Grid::new("cursor").num_columns(2).show(ui, |ui| {
        ui.weak("Pixel");
        ui.label(format!("{x}, {y}"));
        ui.end_row();
        if let Some((mean, variance)) = picture::value(render, look, share, pixel) {
            let error = variance.map(f32::sqrt);
            ui.weak("Radiance Y");
            ui.label(plus_minus(f64::from(luminance(mean)), f64::from(luminance(error)), RADIANCE));
            ui.end_row();
            for (name, k) in [("red", 0), ("green", 1), ("blue", 2)] {
                ui.weak(name);
                ui.label(plus_minus(f64::from(mean[k]), f64::from(error[k]), ""));
                ui.end_row();
            }
            ui.weak("Relative error");
            ui.label(percent(f64::from(relative_error(mean, variance))));
            ui.end_row();
        }
        for (side, name) in
            [(Side::Primal, "Light, by field"), (Side::Dual, "Importance, by field")]
        {
            if let Some(value) = fields.value(side, under.at) {
                ui.weak(name);
                let known =
                    format!("{} {}", significant(f64::from(value), 3), fields::meaning(side)[1]);
                ui.label(if value.is_nan() { "unknown".into() } else { known });
                ui.end_row();
            }
        }
        if let Some((object, point)) = under.hit {
            ui.weak("Point");
            ui.label(format!("{:.3}, {:.3}, {:.3} m", point.x, point.y, point.z));
            ui.end_row();
            if let Some(object) = scene.objects.get(object) {
                ui.weak("Object");
                ui.label(&object.name);
                ui.end_row();
                if let Some(member) = object.member.and_then(|m| scene.members.get(m)) {
                    ui.weak("Member");
                    ui.label(&member.name);
                    ui.end_row();
                }
            }
        }
    });
}

fn selected(ui: &mut Ui, index: usize, member: &Member, latest: &Latest) {
    ui.strong(&member.name);
    Grid::new("selected").num_columns(2).show(ui, |ui| {
        let mut row = |name: &str, value: String| {
            ui.weak(name);
            ui.label(value);
            ui.end_row();
        };
        row("Kind", format!("{:?}", member.kind).to_lowercase());
        row(
            "Concrete",
            format!(
                "{}{}",
                member.concrete,
                if member.concrete_assumed { ", assumed" } else { "" }
            ),
        );
        let size = member.bounds[1] - member.bounds[0];
        row("Size", format!("{:.2} × {:.2} × {:.2} m", size.x, size.y, size.z));
        if member.volume > 0.0 {
            row("Volume", format!("{:.3} m³", member.volume));
        }
        if member.id != member.name {
            row("Id", member.id.clone());
        }
        match latest.member(index) {
            Some(known) => {
                row("Damage d", plus_minus(known.damage.value, known.damage.std_error, ""))
            }
            None => row("Damage d", "no evidence".into()),
        }
        if let Some(truth) =
            latest.result.as_ref().and_then(|r| r.members.get(index)?.truth.as_ref())
        {
            row("Truth", format!("{:.3} ({})", truth.damage, truth.origin));
        }
    });
    if let Some((verdict, steps)) = latest.state(index) {
        ui.horizontal(|ui| {
            colours::severity(ui, verdict, steps);
            ui.label(&verdict.state);
        });
        ui.weak(&verdict.advice);
    }
}
