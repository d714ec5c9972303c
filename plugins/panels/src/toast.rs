//! Short messages that come and go by themselves. Whoever says one says it in the log, too, where it
//! can be read again.

use std::time::{Duration, Instant};

use bevy_ecs::prelude::*;
use egui::{Align2, Ui, UserAttentionType, ViewportCommand, vec2};

/// How long one stays.
const STAY: Duration = Duration::from_secs(6);
/// So many at once.
const MOST: usize = 4;

/// What has been done lately.
#[derive(Resource, Debug, Default)]
pub(crate) struct Toasts {
    lines: Vec<(String, Instant)>,
    /// Whether one has come since they were last drawn.
    is_new: bool,
}

impl Toasts {
    /// Says that something is done.
    pub(crate) fn say(&mut self, line: impl Into<String>) {
        self.lines.push((line.into(), Instant::now()));
        let surplus = self.lines.len().saturating_sub(MOST);
        self.lines.drain(..surplus);
        self.is_new = true;
    }
}

/// Draws them in the corner, the newest below. A new one is news for somebody who works elsewhere
/// meanwhile: the window asks for attention, as the system shows that.
pub(crate) fn show(ui: &Ui, world: &mut World) {
    let mut toasts = world.resource_mut::<Toasts>();
    let toasts = toasts.bypass_change_detection();
    if std::mem::take(&mut toasts.is_new) && !ui.input(|i| i.focused) {
        let attention = UserAttentionType::Informational;
        ui.ctx().send_viewport_cmd(ViewportCommand::RequestUserAttention(attention));
    }
    toasts.lines.retain(|(_, since)| since.elapsed() < STAY);
    let Some((_, first)) = toasts.lines.first() else { return };
    // They go although nothing else happens.
    ui.ctx().request_repaint_after(STAY.saturating_sub(first.elapsed()));
    let lines: Vec<String> = toasts.lines.iter().map(|(line, _)| line.clone()).collect();
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

#[cfg(test)]
mod tests {
    use super::*;

    /// What a frame asks of the system, in a window that has the focus or has not.
    fn commands(ctx: &egui::Context, world: &mut World, focused: bool) -> Vec<ViewportCommand> {
        let input = egui::RawInput { focused, ..egui::RawInput::default() };
        let output = ctx.run_ui(input, |ui| show(ui, world));
        output.viewport_output.into_values().flat_map(|v| v.commands).collect()
    }

    #[test]
    fn attention_is_asked_for_once_and_only_of_somebody_who_is_elsewhere() {
        let attention = ViewportCommand::RequestUserAttention(UserAttentionType::Informational);
        let (ctx, mut world) = (egui::Context::default(), World::new());
        world.init_resource::<Toasts>();
        let say = |world: &mut World| world.resource_mut::<Toasts>().say("it is done");
        say(&mut world);
        assert!(!commands(&ctx, &mut world, true).contains(&attention));
        assert!(!commands(&ctx, &mut world, false).contains(&attention), "it has been seen");
        say(&mut world);
        assert!(commands(&ctx, &mut world, false).contains(&attention));
        assert!(!commands(&ctx, &mut world, false).contains(&attention), "once is enough");
    }
}
