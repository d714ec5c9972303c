//! What has happened, and what is going on.

use bevy_ecs::prelude::*;
use egui::{ProgressBar, ScrollArea, Ui};
use intrados_stage::{Job, Jobs};

use crate::lang::term;

/// Lines kept.
const LINES: usize = 500;

/// What has happened, for people: oldest first.
#[derive(Resource, Debug, Default)]
pub struct Log {
    lines: Vec<String>,
}

impl Log {
    /// Adds a line, here and in the program's log.
    pub fn say(&mut self, line: impl Into<String>) {
        let line = line.into();
        tracing::info!("{line}");
        if self.lines.len() >= LINES {
            self.lines.remove(0);
        }
        self.lines.push(line);
    }

    /// The lines, oldest first.
    #[must_use]
    pub fn lines(&self) -> &[String] {
        &self.lines
    }
}

pub(crate) fn log(InMut(ui): InMut<Ui>, log: Res<Log>) {
    ScrollArea::vertical().auto_shrink(false).stick_to_bottom(true).show(ui, |ui| {
        for line in log.lines() {
            ui.label(line);
        }
        if log.lines().is_empty() {
            ui.weak(tr!("Nothing has happened yet."));
        }
    });
}

pub(crate) fn jobs(InMut(ui): InMut<Ui>, mut jobs: ResMut<Jobs>) {
    if !list(ui, jobs.bypass_change_detection()) {
        ui.weak(tr!("No job is running."));
    }
}

/// Running jobs, each with its progress and a button to cancel it. False if there are none.
pub(crate) fn list(ui: &mut Ui, jobs: &mut Jobs) -> bool {
    let running = jobs.running();
    for (i, job) in running.iter().enumerate() {
        ui.push_id(i, |ui| ui.horizontal(|ui| row(ui, job)));
    }
    !running.is_empty()
}

/// The first of them alone, in a line that has begun.
pub(crate) fn first(ui: &mut Ui, jobs: &mut Jobs) {
    if let Some(job) = jobs.running().first() {
        row(ui, job);
    }
}

fn row(ui: &mut Ui, job: &Job) {
    let label = term(&job.label());
    if job.is_cancelled() {
        ui.add(egui::Spinner::new());
        ui.weak(tr!("{}: stopping", label));
        return;
    }
    let hint = tr!("Stops the work; nothing half done is left");
    if ui.button(tr!("Cancel")).on_hover_text(hint).clicked() {
        job.cancel();
    }
    ui.add(ProgressBar::new(job.done()).desired_width(160.0).show_percentage());
    ui.label(label);
}
