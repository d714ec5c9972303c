//! Readings of all meters from both sides.

use bevy_ecs::prelude::*;
use egui::{Grid, ScrollArea, Ui};
use intrados_light::{MeterReading, SideReading};

use crate::{
    Statistics,
    lang::{local, term},
    number::{percent, plus_minus},
    steering::side_name,
};

pub(crate) fn meters(InMut(ui): InMut<Ui>, statistics: Res<Statistics>) {
    if statistics.meters.is_empty() {
        ui.weak(tr!("No meter has been read."));
        return;
    }
    ScrollArea::vertical().auto_shrink([false, true]).show(ui, |ui| {
        for (i, reading) in statistics.meters.iter().enumerate() {
            ui.strong(&reading.name);
            Grid::new(i).num_columns(2).show(ui, |ui| rows(ui, reading));
            ui.add_space(6.0);
        }
    });
}

fn rows(ui: &mut Ui, reading: &MeterReading) {
    let unit = reading.unit.replace("m2", "m²");
    let mut side = |name: &str, side: &Option<SideReading>| {
        let Some(side) = side else { return };
        ui.weak(name);
        let text = if side.converged {
            String::new()
        } else {
            tr!("The error bar may not be trusted yet: {}", term(&side.complaint))
        };
        let mark = if side.converged { "" } else { " ⚠" };
        let label = ui.label(format!("{}{mark}", plus_minus(side.mean, side.std_error, &unit)));
        if !text.is_empty() {
            label.on_hover_text(text);
        }
        ui.end_row();
    };
    side(&tr!("primal"), &reading.primal);
    side(&tr!("dual"), &reading.dual);
    let combined = &reading.combined;
    ui.weak(tr!("combined"));
    let mark = if combined.converged { "" } else { " ⚠" };
    let trust = if combined.converged {
        String::new()
    } else {
        tr!("; the error bar may not be trusted yet: {}", term(&combined.complaint))
    };
    ui.label(format!("{}{mark}", plus_minus(combined.mean, combined.std_error, &unit)))
        .on_hover_text(tr!(
            "relative error {}; the {} side carries more weight{}",
            percent(combined.std_error / combined.mean),
            side_name(combined.side),
            trust
        ));
    ui.end_row();
    if let Some(z) = reading.duality_z {
        ui.weak(tr!("duality gap"));
        let trusted = [&reading.primal, &reading.dual]
            .into_iter()
            .flatten()
            .all(|side| side.evidence.holds());
        let (gap, what) = gap(z, trusted);
        ui.label(gap).on_hover_text(what);
        ui.end_row();
    }
}

/// A duality gap, (primal − dual) in standard errors, as it is said, and what to think of it; both
/// hang on whether both error bars are `trusted`.
pub(crate) fn gap(z: f64, trusted: bool) -> (String, String) {
    let (mark, what) = match z.abs() {
        _ if !trusted => (
            tr!("(too early)"),
            tr!(
                "one side has not converged: its error bar is too small, and the gap says nothing \
                 yet"
            ),
        ),
        z if z < 2.0 => ("✔".into(), tr!("the two sides agree")),
        z if z < 3.0 => (String::new(), tr!("one pair in 22 is this far apart by chance")),
        _ => ("⚠".into(), tr!("the two sides contradict each other, or an error bar is too small")),
    };
    (format!("{} σ {mark}", local(format!("{z:+.1}"))), what)
}
