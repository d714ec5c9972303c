//! What is under the cursor, and what is selected.

use bevy_ecs::prelude::*;
use egui::{Grid, Ui};
use intrados_light::{Render, luminance};
use intrados_scene::{Member, Scene, plugin::CurrentScene};
use intrados_transport::Side;

use crate::{
    Latest, Look, Selection, Statistics, colours,
    fields::{self, Fields},
    lang::{fixed, term},
    lengths,
    number::{count, percent, plus_minus, significant},
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
            ui.weak(tr!("Move over the picture to read a value."));
        }
    }
    ui.separator();
    match selection.0.and_then(|i| Some((i, scene.0.members.get(i)?))) {
        Some((index, member)) => selected(ui, index, member, &latest),
        None => {
            ui.weak(tr!("Click on a member to select it."));
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
        ui.weak(tr!("Pixel"));
        ui.label(format!("{x}, {y}"));
        ui.end_row();
        if let Some((mean, variance)) = picture::value(render, look, share, pixel) {
            let error = variance.map(f32::sqrt);
            ui.weak(tr!("Radiance Y"));
            ui.label(plus_minus(f64::from(luminance(mean)), f64::from(luminance(error)), RADIANCE));
            ui.end_row();
            for (name, k) in [(tr!("red"), 0), (tr!("green"), 1), (tr!("blue"), 2)] {
                ui.weak(name);
                ui.label(plus_minus(f64::from(mean[k]), f64::from(error[k]), ""));
                ui.end_row();
            }
            ui.weak(tr!("Relative error"));
            ui.label(percent(f64::from(relative_error(mean, variance))));
            ui.end_row();
            ui.weak(tr!("Samples a pixel"));
            ui.label(count(render.samples_per_pixel()));
            ui.end_row();
        }
        for (side, name) in
            [(Side::Primal, tr!("Light, by field")), (Side::Dual, tr!("Importance, by field"))]
        {
            if let Some(value) = fields.value(side, under.at) {
                ui.weak(name);
                let known =
                    format!("{} {}", significant(f64::from(value), 3), fields::meaning(side)[1]);
                ui.label(if value.is_nan() { tr!("unknown") } else { known });
                ui.end_row();
            }
        }
        if let Some((object, point)) = under.hit {
            ui.weak(tr!("Point"));
            ui.label(lengths::point(point));
            ui.end_row();
            if let Some(object) = scene.objects.get(object) {
                ui.weak(tr!("Object"));
                ui.label(&object.name);
                ui.end_row();
                if let Some(member) = object.member.and_then(|m| scene.members.get(m)) {
                    ui.weak(tr!("Member"));
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
        row(&tr!("Kind"), term(&format!("{:?}", member.kind).to_lowercase()));
        let concrete = if member.concrete_assumed {
            tr!("{}, assumed", member.concrete)
        } else {
            member.concrete.clone()
        };
        row(&tr!("Concrete"), concrete);
        row(&tr!("Size"), lengths::sides(member.bounds[1] - member.bounds[0]));
        if member.volume > 0.0 {
            row(&tr!("Volume"), format!("{} m³", fixed(member.volume, 3)));
        }
        if member.id != member.name {
            row(&tr!("Id"), member.id.clone());
        }
        let damage = latest.member(index).map(|known| known.damage);
        let damage = damage.map(|d| plus_minus(d.value, d.std_error, ""));
        row(&tr!("Damage d"), damage.unwrap_or_else(|| tr!("no evidence")));
        if let Some(truth) =
            latest.result.as_ref().and_then(|r| r.members.get(index)?.truth.as_ref())
        {
            row(&tr!("Truth"), format!("{} ({})", fixed(truth.damage, 3), term(truth.origin)));
        }
    });
    if let Some((verdict, steps)) = latest.state(index) {
        ui.horizontal(|ui| {
            colours::severity(ui, verdict, steps);
            ui.label(term(&verdict.state));
        });
        ui.weak(term(&verdict.advice));
    }
}
