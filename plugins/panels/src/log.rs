//! What has happened, and what is going on.

use std::{
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
    time::{SystemTime, UNIX_EPOCH},
};

use bevy_ecs::prelude::*;
use egui::{ProgressBar, ScrollArea, Ui};
use intrados_stage::{Job, Jobs, file};

use crate::lang::term;

/// Lines kept.
const LINES: usize = 500;

/// What has happened, for people: oldest first.
#[derive(Resource, Debug, Default)]
pub struct Log {
    lines: Vec<String>,
    /// When each was said, seconds of the day, UTC.
    times: Vec<u64>,
    /// Where they are kept; none: nowhere.
    file: Option<PathBuf>,
    /// Whether the file lacks a line.
    is_behind: bool,
}

impl Log {
    /// Keeps its lines in a file, too. What the session before has left lies beside it then, for
    /// whoever wants to know why that broke off.
    pub(crate) fn kept(file: Option<PathBuf>) -> Self {
        if let Some(file) = file.as_ref().filter(|file| file.exists())
            && let Err(error) = fs::rename(file, file.with_extension("before.txt"))
        {
            tracing::warn!("{} was not put aside: {error}", file.display());
        }
        Self { file, ..Self::default() }
    }

    /// Where its lines are kept, if they are.
    pub(crate) fn file(&self) -> Option<&Path> {
        self.file.as_deref()
    }

    /// Adds a line, here and in the program's log.
    pub fn say(&mut self, line: impl Into<String>) {
        let line = line.into();
        tracing::info!("{line}");
        if self.lines.len() >= LINES {
            self.lines.remove(0);
            self.times.remove(0);
        }
        self.lines.push(line);
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        self.times.push(now.map_or(0, |since| since.as_secs() % 86_400));
        self.is_behind = true;
    }

    /// Writes the file if it lacks a line. Where that cannot be, it is said once, and no line more
    /// is tried.
    fn keep(&mut self) {
        if !std::mem::take(&mut self.is_behind) {
            return;
        }
        let Some(file) = self.file.take() else { return };
        match self.write(&file) {
            Ok(()) => self.file = Some(file),
            Err(error) => tracing::warn!("the log is not kept in {}: {error}", file.display()),
        }
    }

    fn write(&self, path: &Path) -> io::Result<()> {
        fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))?;
        let stamped = |(line, time): (&String, &u64)| {
            let [hours, minutes, seconds] = [time / 3600, time / 60 % 60, time % 60];
            format!("{hours:02}:{minutes:02}:{seconds:02} UTC {line}\n")
        };
        let lines: String = self.lines.iter().zip(&self.times).map(stamped).collect();
        let text = format!("Intrados {}\n{lines}", env!("CARGO_PKG_VERSION"));
        file::put(path, |out| out.write_all(text.as_bytes()))
    }

    /// The lines, oldest first.
    #[must_use]
    pub fn lines(&self) -> &[String] {
        &self.lines
    }
}

/// Once a frame, however many lines were said in it: a disk takes its time.
pub(crate) fn keep(mut log: ResMut<Log>) {
    log.bypass_change_detection().keep();
}

pub(crate) fn log(InMut(ui): InMut<Ui>, log: Res<Log>) {
    if let Some(file) = log.file() {
        ui.weak(tr!("Kept in {}", file.display()));
    }
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

/// The newest of them alone, in a line that has begun: it is what was asked for last.
pub(crate) fn newest(ui: &mut Ui, jobs: &mut Jobs) {
    if let Some(job) = jobs.running().last() {
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
    let bar = ui.add(ProgressBar::new(job.done()).desired_width(160.0).show_percentage());
    let label = ui.label(label);
    bar.labelled_by(label.id);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_kept_in_a_file_and_those_of_the_session_before_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("log.txt");
        let mut before = Log::kept(Some(file.clone()));
        before.say("the session before");
        before.keep();
        let mut log = Log::kept(Some(file.clone()));
        log.say("opened");
        log.say("closed");
        log.keep();
        let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
        let now = read("log.txt");
        assert!(now.contains(" UTC opened\n") && now.ends_with(" UTC closed\n"), "{now}");
        assert!(!now.contains("the session before"), "{now}");
        assert!(read("log.before.txt").contains("the session before"));
        // Where nothing can be written, the lines are in the window nevertheless.
        let mut lost = Log::kept(Some(file.join("log.txt")));
        lost.say("said");
        lost.keep();
        assert_eq!((lost.lines(), lost.file()), (&["said".to_owned()][..], None));
    }
}
