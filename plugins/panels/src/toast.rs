//! Short messages that come and go by themselves. The log has them all.

use std::time::{Duration, Instant};

use bevy_ecs::prelude::*;
use egui::{Align2, Ui, vec2};

/// How long one stays.
const STAY: Duration = Duration::from_secs(6);
/// So many at once.
const MOST: usize = 4;

/// What has been done lately.
#[derive(Resource, Debug, Default)]
pub(crate) struct Toasts(Vec<(String, Instant)>);

impl Toasts {
    /// Says that something is done.
    pub(crate) fn say(&mut self, line: impl Into<String>) {
        self.0.push((line.into(), Instant::now()));
        let surplus = self.0.len().saturating_sub(MOST);
        self.0.drain(..surplus);
    }
}

/// Draws them in the corner, the newest below.
pub(crate) fn show(ui: &Ui, world: &mut World) {
    let mut toasts = world.resource_mut::<Toasts>();
    let toasts = toasts.bypass_change_detection();
    toasts.0.retain(|(_, since)| since.elapsed() < STAY);
    let Some((_, first)) = toasts.0.first() else { return };
    // They go although nothing else happens.
    ui.ctx().request_repaint_after(STAY.saturating_sub(first.elapsed()));
    let lines: Vec<String> = toasts.0.iter().map(|(line, _)| line.clone()).collect();
    egui::Area::new(egui::Id::unique("toasts"))
        .anchor(Align2::LEFT_BOTTOM, vec2(12.0, -38.0))
        .interactable(false)
        .order(egui::Order::Foreground)
        .show(ui.ctx(), |ui| {
            for line in lines {
                egui::Frame::popup(ui.style()).show(ui, |ui| {
                    ui.set_max_width(420.0);
                    ui.label(format!("✔ {line}"));
                });
            }
        });
}
