//! What must not be overlooked: it lies above everything until somebody puts it away.

use bevy_ecs::prelude::*;
use egui::{Panel as Side, Ui};
use intrados_scene::LoadError;
use intrados_stage::{Fault, Jobs};

use crate::{
    Action, Actions, Log,
    lang::{local, term},
};

/// So many at once; of more, the oldest go. The log has them all.
const MOST: usize = 3;

/// One thing that went wrong.
#[derive(Debug, Clone, PartialEq)]
struct Banner {
    /// What went wrong, in a word or two.
    title: String,
    text: String,
    /// For whoever mends it.
    details: String,
    /// Whether a world begun anew would help.
    reload: bool,
    /// Metres per unit in which the model that is open would have the size of a structure.
    metres: Option<f64>,
}

/// What has gone wrong lately.
#[derive(Resource, Debug, Default)]
pub struct Banners(Vec<Banner>);

impl Banners {
    /// A file that was not opened.
    pub(crate) fn not_opened(&mut self, error: &LoadError) {
        let problems: Vec<String> = error.problems().iter().map(ToString::to_string).collect();
        self.put(Banner {
            title: tr!("Not opened"),
            text: term(&error.to_string()),
            details: problems.join("\n"),
            reload: false,
            metres: None,
        });
    }

    /// Something that a user asked for and that cannot be done.
    pub(crate) fn cannot(&mut self, title: &str, why: &str) {
        self.put(Banner {
            title: title.into(),
            text: term(why),
            details: format!("{title}: {why}"),
            reload: false,
            metres: None,
        });
    }

    /// A model that is open and has no size that a structure can have, m.
    pub(crate) fn doubtful(&mut self, name: &str, size: f32, metres: f64) {
        let text = tr!("{} is {} m across, as glTF is in metres.", name, local(size.to_string()));
        self.put(Banner {
            title: tr!("mm or m?"),
            details: text.clone(),
            text,
            reload: false,
            metres: Some(metres),
        });
    }

    /// Something of the program's own that broke.
    fn broke(&mut self, what: &str, fault: &Fault) {
        let place = fault.place.as_deref().unwrap_or("unknown place");
        self.put(Banner {
            title: what.into(),
            text: fault.to_string(),
            details: format!("{what}: {fault}\n{place}"),
            reload: true,
            metres: None,
        });
    }

    fn put(&mut self, banner: Banner) {
        self.0.retain(|b| *b != banner);
        self.0.push(banner);
        let surplus = self.0.len().saturating_sub(MOST);
        self.0.drain(..surplus);
    }

    /// Puts the newest away; false if there is none.
    pub(crate) fn dismiss(&mut self) -> bool {
        self.0.pop().is_some()
    }

    /// Puts all away.
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    /// What is shown, one line each, oldest first.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        self.0.iter().map(|b| format!("{}: {}", b.title, b.text)).collect()
    }
}

/// Says that something of the program's own broke, above the window and in the log; what breaks in
/// every frame is said once.
pub(crate) fn tell(banners: &mut Banners, log: &mut Log, what: &str, fault: &Fault) {
    let place = fault.place.clone().unwrap_or_else(|| tr!("unknown place"));
    let line = format!("⚠ {what}: {fault} ({place})");
    if log.lines().last() != Some(&line) {
        tracing::error!("{line}");
        log.say(line);
    }
    banners.broke(what, fault);
}

/// Work off the frame that broke off.
pub(crate) fn gather(mut jobs: ResMut<Jobs>, mut banners: ResMut<Banners>, mut log: ResMut<Log>) {
    for (label, fault) in jobs.bypass_change_detection().take_faults() {
        tell(&mut banners, &mut log, &tr!("“{}” broke off", term(&label)), &fault);
    }
}

/// What whoever mends it wants to know.
fn details(banner: &Banner, log: Option<&str>) -> String {
    let log = log.map_or_else(String::new, |log| format!("\nlog: {log}"));
    format!("Intrados {}\n{}{log}", env!("CARGO_PKG_VERSION"), banner.details)
}

/// Draws them.
pub(crate) fn show(ui: &mut Ui, world: &mut World) {
    let all = world.resource::<Banners>().0.clone();
    let log = world.resource::<Log>().file().map(|file| file.display().to_string());
    let mut asked = Vec::new();
    for (n, banner) in all.iter().enumerate() {
        Side::top(egui::Id::unique(("banner", n))).show(ui, |ui| {
            ui.horizontal_wrapped(|ui| {
                ui.colored_label(ui.visuals().error_fg_color, format!("⚠ {}:", banner.title));
                ui.label(&banner.text);
                if banner.reload
                    && ui
                        .button(tr!("Reload scene"))
                        .on_hover_text(tr!("Begins anew; the log stays"))
                        .clicked()
                {
                    asked.push(Action::Reload);
                }
                if let Some(metres) = banner.metres {
                    let name = match metres < 1.0 {
                        true => tr!("Open it in millimetres"),
                        false => tr!("Open it 1000 times as large"),
                    };
                    let hint = tr!(
                        "Makes its project, in a folder beside it; the model's file stays as it is"
                    );
                    if ui.button(name).on_hover_text(hint).clicked() {
                        asked.push(Action::Rescale(metres));
                    }
                }
                let mut copy = ui.button(tr!("Copy details"));
                if let Some(log) = &log {
                    copy = copy.on_hover_text(tr!("The log is kept in {}", log));
                }
                if copy.clicked() {
                    ui.ctx().copy_text(details(banner, log.as_deref()));
                }
                if ui.button(tr!("Dismiss")).clicked() {
                    world.resource_mut::<Banners>().0.retain(|b| b != banner);
                }
            });
        });
    }
    asked.into_iter().for_each(|action| world.resource_mut::<Actions>().ask(action));
}
