//! What is taken out: the report as files and as PDF, a table alone, a panel as it is seen.

use std::{
    io::Write,
    path::PathBuf,
    sync::{Arc, Mutex, PoisonError, mpsc},
    time::{Duration, Instant},
};

use bevy_ecs::prelude::*;
use egui::{Button, ColorImage, Rect, Ui};
use intrados_predict::Prediction;
use intrados_report::{pdf, tables};
use intrados_scene::plugin::CurrentScene;
use intrados_stage::{
    Jobs, Task,
    file::{self, file_name},
};

use crate::{
    Action, Actions, Banners, Latest, Log, album, destination::Destination, export::write_png,
    lang::term, machine::MachineSetup, report, toast::Toasts,
};

/// So long tools are put away for a picture: where the system gives none, they come back.
const AWAY: Duration = Duration::from_secs(2);

/// What can be saved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Taken {
    /// The report, with tables and models, in a folder.
    Report,
    /// One table of the prediction, by its name.
    Table(&'static str),
    /// Values that a panel shows: what they are called, and themselves as CSV.
    Values(&'static str, String),
    /// A panel as it is seen, with its legend; none: the whole window.
    Picture(Option<String>),
    /// All pictures that can be made of the scene, in a folder.
    Views,
}

impl Taken {
    /// Whether it is a folder of files.
    fn is_folder(&self) -> bool {
        matches!(self, Self::Report | Self::Views)
    }
}

/// What was written, and where to; of a report, how many files.
pub(crate) struct Written {
    pub(crate) files: Option<usize>,
    pub(crate) path: PathBuf,
}

/// The sheet that asks where to, and what is being written.
#[derive(Resource, Default)]
pub(crate) struct Saving {
    shown: Option<Taken>,
    to: Destination,
    with_pdf: bool,
    /// None: somebody cancelled it.
    task: Option<Task<Result<Option<Written>, String>>>,
    /// A picture that is to be taken of the window, once it is drawn; without a file for the
    /// clipboard.
    wanted: Option<(Option<PathBuf>, Option<Rect>)>,
    /// The folder that all pictures of the scene are to be written into, once the frame is drawn.
    album: Option<PathBuf>,
    /// Since when a picture is wanted.
    since: Option<Instant>,
    /// Where it comes, once it was asked for.
    coming: Option<Mutex<mpsc::Receiver<Arc<ColorImage>>>>,
}

impl Saving {
    /// Asks where to.
    pub(crate) fn ask(&mut self, what: Taken, scene: &str) {
        let name = file_name(scene);
        self.to.propose(match &what {
            Taken::Report => format!("{name}-damage"),
            Taken::Table(table) | Taken::Values(table, _) => format!("{name}-{table}.csv"),
            Taken::Picture(_) => format!("{name}.png"),
            Taken::Views => format!("{name}-views"),
        });
        self.shown = Some(what);
    }

    pub(crate) fn is_shown(&self) -> bool {
        self.shown.is_some()
    }

    /// Puts the sheet away; false if there was none.
    pub(crate) fn dismiss(&mut self) -> bool {
        self.shown.take().is_some()
    }

    pub(crate) fn is_busy(&self) -> bool {
        self.task.is_some()
    }

    /// Where it would go.
    pub(crate) fn proposal(&self) -> String {
        self.to.path.clone()
    }

    /// Whether that is a folder.
    pub(crate) fn is_folder(&self) -> bool {
        self.shown.as_ref().is_some_and(Taken::is_folder)
    }

    /// Where a dialog says.
    pub(crate) fn put(&mut self, path: PathBuf) {
        match self.is_folder() {
            true => self.to.put_folder(path),
            false => self.to.propose(path.display().to_string()),
        }
    }

    /// Takes a picture of the window, or of what is at a place in it, in the next frame, for a file
    /// or for the clipboard.
    pub(crate) fn take_picture(&mut self, path: Option<PathBuf>, of: Option<Rect>) {
        (self.wanted, self.since) = (Some((path, of)), Some(Instant::now()));
    }

    /// Writes all pictures of the scene into a folder.
    pub(crate) fn take_views(&mut self, folder: PathBuf) {
        self.album = Some(folder);
    }

    /// Whether a picture of a panel is being taken: its tools are not of it.
    pub(crate) fn takes_panel(&self) -> bool {
        self.wanted.as_ref().is_some_and(|(_, of)| of.is_some())
            && self.since.is_some_and(|since| since.elapsed() < AWAY)
    }
}

/// Entries of the menu.
pub(crate) fn menu(ui: &mut Ui, has_prediction: bool, asked: &mut Vec<Action>) {
    let hint = tr!(
        "report.html, BCF for the model's authors, tables as CSV, the members coloured by damage \
         as GLB and VTU"
    );
    let report = Button::new(tr!("Report…")).shortcut_text("Ctrl+S");
    let report = ui.add_enabled(has_prediction, report);
    if report.on_hover_text(hint).clicked() {
        asked.push(Action::Save(Taken::Report));
    }
    ui.menu_button(tr!("Table as CSV"), |ui| {
        for (name, title) in [
            ("members", tr!("Members…")),
            ("zones", tr!("Zones of members…")),
            ("defects", tr!("Defects…")),
            ("slices", tr!("CT slices…")),
            ("evidence", tr!("Evidence, used or not…")),
        ] {
            if ui.add_enabled(has_prediction, Button::new(title)).clicked() {
                asked.push(Action::Save(Taken::Table(name)));
            }
        }
    });
    ui.separator();
    if ui.button(tr!("Picture of the structure, with legend…")).clicked() {
        asked.push(Action::Save(Taken::Picture(Some("Structure".into()))));
    }
    let window = Button::new(tr!("Picture of the window…")).shortcut_text("F12");
    if ui.add(window).clicked() {
        asked.push(Action::Save(Taken::Picture(None)));
    }
    let light = Button::new(tr!("Picture of light, PNG or EXR…")).shortcut_text("Ctrl+E");
    if ui.add(light).clicked() {
        asked.push(Action::Export);
    }
    if ui.button(tr!("All views…")).on_hover_text(of_views()).clicked() {
        asked.push(Action::Save(Taken::Views));
    }
    if !has_prediction {
        ui.weak(tr!("Report and tables come with the prediction."));
    }
}

/// What is in a folder of all views.
fn of_views() -> String {
    tr!("PNG, each with its legend: the structure from where it is looked at, its sides, the \
         scene's cameras and the views that are kept; light, its error and its fields; the slice, \
         the stress and the photograph that were shown last.")
}

/// The sheet.
pub(crate) fn sheet(
    InMut(ui): InMut<Ui>,
    mut saving: ResMut<Saving>,
    scene: Option<Res<CurrentScene>>,
    latest: Res<Latest>,
    machine: Res<MachineSetup>,
    mut jobs: ResMut<Jobs>,
    mut actions: ResMut<Actions>,
) {
    let saving = saving.bypass_change_detection();
    let (Some(what), Some(scene)) = (saving.shown.clone(), scene) else { return };
    let is_report = what == Taken::Report;
    ui.label(match &what {
        Taken::Report => {
            tr!("HTML, BCF, tables and models, as `intrados predict --out` writes them.")
        }
        Taken::Table(name) | Taken::Values(name, _) => {
            tr!("The table of {}: UTF-8, units in the header.", term(name))
        }
        Taken::Picture(_) => tr!("PNG, as it is seen now."),
        Taken::Views => of_views(),
    });
    let name = if what.is_folder() { tr!("Folder to write") } else { tr!("File to write") };
    let is_entered = ui.horizontal(|ui| {
        let is_entered = saving.to.field(ui, name, 280.0);
        if ui.button(tr!("Browse…")).clicked() {
            actions.ask(Action::ChooseSave);
        }
        is_entered
    });
    let is_entered = is_entered.inner;
    if is_report {
        let can = machine.pdf_printer.is_some();
        ui.add_enabled_ui(can, |ui| ui.checkbox(&mut saving.with_pdf, tr!("and report.pdf")));
        if !can {
            ui.weak(term(pdf::BY_HAND));
        }
    }
    let result = latest.result_for(&scene.0).cloned();
    let needs = matches!(what, Taken::Report | Taken::Table(_));
    let why_not = if saving.to.path.trim().is_empty() {
        Some(tr!("It needs a name."))
    } else if needs && result.is_none() {
        Some(tr!("The prediction is not done yet."))
    } else if saving.task.is_some() {
        Some(tr!("Another file is being written."))
    } else {
        None
    };
    if is_entered && why_not.is_some() {
        saving.to.take_keyboard();
    }
    ui.horizontal(|ui| {
        let save = ui.add_enabled(why_not.is_none(), Button::new(tr!("Save")));
        if save.clicked() || is_entered && why_not.is_none() {
            let path = PathBuf::from(saving.to.path.trim());
            match (what, result) {
                (Taken::Picture(panel), _) => actions.ask(Action::TakePicture(path, panel)),
                (Taken::Views, _) => actions.ask(Action::TakeViews(path)),
                (Taken::Table(name), Some(result)) => {
                    saving.task = Some(table(path, move || named(&result, name), &mut jobs));
                }
                (Taken::Values(_, csv), _) => {
                    saving.task = Some(table(path, move || csv, &mut jobs));
                }
                (Taken::Report, Some(result)) => {
                    let with_pdf = saving.with_pdf && machine.pdf_printer.is_some();
                    saving.task = Some(report::save_report(
                        path,
                        Arc::clone(&scene.0),
                        result,
                        with_pdf,
                        &mut jobs,
                    ));
                }
                _ => {}
            }
            saving.shown = None;
        }
        if ui.button(tr!("Cancel")).clicked() {
            saving.shown = None;
        }
        if let Some(why) = why_not {
            ui.weak(why);
        }
    });
}

/// The table of this name of a prediction.
fn named(result: &Prediction, name: &str) -> String {
    tables(result).into_iter().find(|t| t.0 == name).map(|t| t.1).unwrap_or_default()
}

fn table(
    path: PathBuf,
    make: impl FnOnce() -> String + Send + 'static,
    jobs: &mut Jobs,
) -> Task<Result<Option<Written>, String>> {
    Task::spawn(jobs, tr!("writing {}", path.display()), move |_| {
        let text = make();
        let written = file::put(&path, |out| out.write_all(text.as_bytes()));
        written.map_err(|e| format!("{}: {e}", path.display()))?;
        Ok(Some(Written { files: None, path }))
    })
}

/// Asks the window for its picture, and takes it when it comes.
pub(crate) fn picture(ui: &Ui, world: &mut World) {
    let mut saving = std::mem::take(&mut *world.resource_mut::<Saving>());
    if saving.wanted.is_some() && saving.coming.is_none() {
        let (mine, theirs) = mpsc::channel();
        let ctx = ui.ctx().clone();
        ui.ctx().request_screenshot(move |image| {
            // Whoever asked may be gone when it comes.
            let _ = mine.send(image);
            ctx.request_repaint();
        });
        saving.coming = Some(Mutex::new(theirs));
    }
    let image = saving
        .coming
        .as_ref()
        .and_then(|coming| coming.lock().unwrap_or_else(PoisonError::into_inner).try_recv().ok());
    if let Some(image) = image
        && let Some((path, of)) = saving.wanted.take()
    {
        saving.coming = None;
        let density = ui.ctx().pixels_per_point();
        let part = match of {
            Some(rect) => cut(&image, rect, density),
            None => ColorImage::clone(&image),
        };
        match path {
            Some(path) => {
                let what = described(world);
                let mut jobs = world.resource_mut::<Jobs>();
                saving.task = Some(write_picture(&mut jobs, part, path, what));
            }
            None => {
                ui.ctx().copy_image(part);
                world.resource_mut::<Toasts>().say(tr!("The picture is on the clipboard"));
                world.resource_mut::<Log>().say(tr!("copied a picture"));
            }
        }
    }
    if let Some(folder) = saving.album.take_if(|_| saving.task.is_none()) {
        saving.task = album::begin(ui, world, folder);
        if saving.task.is_none() {
            let why = tr!("There is no picture yet.");
            world.resource_mut::<Banners>().cannot(&tr!("Not saved"), &why);
        }
    }
    *world.resource_mut::<Saving>() = saving;
}

/// What a picture of the window is of.
fn described(world: &World) -> String {
    world.get_resource::<CurrentScene>().map_or_else(String::new, |scene| {
        let (name, hash) = (&scene.0.name, &scene.0.hash);
        tr!("{}; scene hash {}; Intrados {}", name, hash, env!("CARGO_PKG_VERSION"))
    })
}

fn write_picture(
    jobs: &mut Jobs,
    picture: ColorImage,
    path: PathBuf,
    what: String,
) -> Task<Result<Option<Written>, String>> {
    Task::spawn(jobs, tr!("writing {}", path.display()), move |_| {
        write_png(&picture, &path, &what).map_err(|e| format!("{}: {e}", path.display()))?;
        Ok(Some(Written { files: None, path }))
    })
}

/// What of a picture lies in a rectangle of so many points.
fn cut(image: &ColorImage, rect: Rect, density: f32) -> ColorImage {
    let [w, h] = image.size;
    let at = |x: f32, most: usize| ((x * density).round().max(0.0) as usize).min(most);
    let [left, right] = [at(rect.left(), w), at(rect.right(), w)];
    let [top, bottom] = [at(rect.top(), h), at(rect.bottom(), h)];
    let rows = (top..bottom).flat_map(|y| &image.pixels[y * w + left..y * w + right]);
    ColorImage::new([right - left, bottom - top], rows.copied().collect())
}

/// Says how a write ended.
pub(crate) fn take(
    mut saving: ResMut<Saving>,
    mut banners: ResMut<Banners>,
    mut toasts: ResMut<Toasts>,
    mut log: ResMut<Log>,
) {
    let Some(done) = Task::take(&mut saving.bypass_change_detection().task) else { return };
    match done {
        Ok(Ok(None)) => log.say(tr!("saving was cancelled")),
        Ok(Ok(Some(Written { files, path }))) => {
            let path = path.display();
            let what = files.map_or_else(|| path.to_string(), |n| tr!("{} files into {}", n, path));
            toasts.say(tr!("Saved {}", what));
            log.say(tr!("saved {}", what));
        }
        Ok(Err(why)) => {
            log.say(tr!("⚠ not saved: {}", term(&why.to_string())));
            banners.cannot(&tr!("Not saved"), &why);
        }
        // What a panic said is told with all others.
        Err(_) => {}
    }
}

#[cfg(test)]
mod tests {
    use egui::{Color32, pos2};

    use super::*;

    #[test]
    fn a_picture_is_cut_in_pixels_and_never_beyond_its_rim() {
        let pixels = (0..12).map(|k| Color32::from_gray(k as u8)).collect();
        let image = ColorImage::new([4, 3], pixels);
        let part = cut(&image, Rect::from_min_max(pos2(0.5, 0.5), pos2(9.0, 1.0)), 2.0);
        assert_eq!(part.size, [3, 1]);
        let grey: Vec<u8> = part.pixels.iter().map(|p| p.r()).collect();
        assert_eq!(grey, [5, 6, 7]);
    }
}
