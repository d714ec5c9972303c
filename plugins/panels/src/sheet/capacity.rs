//! What a member bears: its widest crack against its limit, its stress and its load at failure,
//! computed when somebody asks.

use bevy_ecs::prelude::*;
use egui::{ProgressBar, RichText, Ui};
use intrados_damage::evidence::called;
use intrados_mechanics::{
    analysis::{MemberOutcome, Outcome},
    member::Meshing,
    plugin::{Analyses, Analysis, Analyze, Stop},
    strength::{Mode, Strength},
};
use intrados_predict::{CrackCheck, MemberPrediction};
use intrados_scene::{Member, Scene};
use intrados_stage::Work;

use crate::{
    Action, Actions,
    lang::{fixed, local, measured, term},
    number::copied,
};

/// Asks for analyses, and for their end.
#[derive(bevy_ecs::system::SystemParam)]
pub(crate) struct Mechanics<'w> {
    analyses: Res<'w, Analyses>,
    begin: MessageWriter<'w, Analyze>,
    stop: MessageWriter<'w, Stop>,
}

impl Mechanics<'_> {
    fn begin(&mut self, model: &str, to_failure: bool) {
        let meshing = Meshing { element: None };
        self.begin.write(Analyze { model: model.to_owned(), meshing, to_failure });
    }
}

pub(super) fn capacity(
    ui: &mut Ui,
    scene: &Scene,
    member: &Member,
    told: Option<&MemberPrediction>,
    mechanics: &mut Mechanics,
    actions: &mut Actions,
) {
    if let Some(c) = told.and_then(|t| t.crack_check.as_ref()) {
        ui.label(checked(c));
    }
    if let Some(c) = told.and_then(|t| t.capacity.as_ref()) {
        let factor = c.load_factor;
        let times = format!("{} ± {}", fixed(factor.value, 2), fixed(factor.std_error, 2));
        let loads = c.loads.join(", ");
        let bears = match c.mode {
            Mode::None => tr!("It bears at least {} times {}.", times, loads),
            mode => tr!("It bears {} times {} (fails by {}).", times, loads, term(mode.words())),
        };
        ui.label(bears).on_hover_text(measured(&c.because));
        let [cost, error] = [c.cost.value, c.cost.std_error].map(|share| 100.0 * share);
        if cost > 0.0 || error > 0.0 {
            let [cost, error] = [cost, error].map(|percent| fixed(percent, 0));
            ui.label(tr!("Damage costs {} ± {} % of its strength.", cost, error));
        }
    }
    let Some(assembly) = scene.structure.assembly_of(&member.id) else {
        ui.weak(tr!("Its body is known as a surface alone: no load can be put on it."));
        return;
    };
    let can_be_raised = scene.structure.loads.iter().any(|l| l.action.can_be_raised());
    let model = assembly.id.as_str();
    let has_strength = match mechanics.analyses.get(model) {
        None => false,
        Some(analysis) => {
            if analysis.work.is_running() {
                if running(ui, analysis) {
                    mechanics.stop.write(Stop(model.to_owned()));
                }
                return;
            }
            result(ui, analysis, member, actions)
        }
    };
    let analysis = mechanics.analyses.get(model);
    let is_done =
        analysis.is_some_and(|a| matches!(&a.work, Work::Done(life) if !life.outcome.stopped));
    ui.horizontal_wrapped(|ui| {
        let hint = tr!("Loads, pours, creep and damage over its whole life, as `intrados analyze`");
        if !is_done && ui.button(tr!("Compute its stress")).on_hover_text(hint).clicked() {
            mechanics.begin(model, false);
        }
        let hint = tr!("Then raises its loads until it fails, as `intrados analyze --to-failure`");
        let may = !has_strength && can_be_raised;
        if may && ui.button(tr!("Compute what it bears")).on_hover_text(hint).clicked() {
            mechanics.begin(model, true);
        }
    });
    if !can_be_raised {
        ui.weak(tr!("No load of this scene can be raised to failure."));
    }
}

/// The widest crack beside what is admitted.
fn checked(c: &CrackCheck) -> String {
    let (width, source) = (fixed(c.width_mm, 2), term(called(c.source)));
    let limit = local(c.limit_mm.to_string());
    if c.exceeded {
        tr!(
            "widest crack {} mm ({}), ⚠ wider than the {} mm of {}",
            width,
            source,
            limit,
            c.exposure
        )
    } else {
        tr!("widest crack {} mm ({}), ✔ within the {} mm of {}", width, source, limit, c.exposure)
    }
}

/// How far it is; true: it is to be stopped.
fn running(ui: &mut Ui, analysis: &Analysis) -> bool {
    let seen = &analysis.seen;
    let last = seen.count().checked_sub(1).and_then(|last| seen.shot(last));
    let done = seen.skin().zip(last).map_or(0.0, |(skin, shot)| skin.progress(shot.time));
    ui.horizontal(|ui| {
        let text = tr!("{} % of its life", fixed(100.0 * done, 0));
        ui.add(ProgressBar::new(done).desired_width(140.0).text(text));
        let hint = tr!("What has been found until then stays");
        ui.button(tr!("Stop computing")).on_hover_text(hint).clicked()
    })
    .inner
}

/// What was found; true: what it bears is known, too.
fn result(ui: &mut Ui, analysis: &Analysis, member: &Member, actions: &mut Actions) -> bool {
    let outcome = match &analysis.work {
        Work::Running(_) => return false,
        Work::Cancelled => {
            ui.label(tr!("Its stress was stopped before its end."));
            return false;
        }
        Work::Failed(why) => {
            ui.label(tr!("⚠ Not computed: {}", term(why)));
            return false;
        }
        Work::Done(life) => &life.outcome,
    };
    doubts(ui, outcome);
    if let Some(own) = outcome.members.iter().find(|m| m.name == member.id) {
        stresses(ui, own);
    }
    if let Some(strength) = &outcome.strength {
        bears(ui, strength);
    }
    if ui.link(tr!("See it over its life")).clicked() {
        actions.ask(Action::Tab("Stress"));
    }
    outcome.strength.as_ref().is_some_and(|s| !s.stopped)
}

/// What a user must know before believing any of it.
fn doubts(ui: &mut Ui, outcome: &Outcome) {
    if outcome.stopped {
        ui.label(tr!("Its stress was stopped before its end: this is what had been found."));
    } else if !outcome.complaint.is_empty() {
        ui.label(tr!("⚠ ended early: {}", term(&outcome.complaint)));
    }
    outcome.warnings.iter().for_each(|why| drop(ui.label(format!("⚠ {}", term(why)))));
}

/// The extremes of its life.
fn stresses(ui: &mut Ui, own: &MemberOutcome) {
    let mpa = |pa: f64| pa / 1e6;
    egui::Grid::new("capacity").num_columns(2).spacing([8.0, 2.0]).show(ui, |ui| {
        for (what, value) in [
            (tr!("compression"), format!("{} MPa", fixed(mpa(own.peak_compression_pa), 1))),
            (tr!("tension"), format!("{} MPa", fixed(mpa(own.peak_tension_pa), 2))),
            (tr!("bars"), format!("{} MPa", fixed(mpa(own.peak_bar_stress_pa), 0))),
            (tr!("cracks by load"), format!("{} mm", fixed(1e3 * own.max_crack_width_m, 2))),
        ] {
            ui.label(what);
            copied(ui, RichText::new(value));
            ui.end_row();
        }
        if let Some(pipe) = own.pipe {
            ui.label(tr!("steel pipe"));
            let [around, along] = [pipe.around_pa, pipe.along_pa].map(|pa| fixed(mpa(pa), 0));
            copied(ui, RichText::new(tr!("{} MPa around, {} along", around, along)));
            ui.end_row();
        }
    });
}

/// Its load at failure, and how it fails.
fn bears(ui: &mut Ui, strength: &Strength) {
    let peak = &strength.peak;
    let [times, load, moved] = [
        fixed(peak.load_factor, 2),
        fixed(1e-3 * peak.load_n, 0),
        fixed(1e3 * peak.displacement_m, 1),
    ];
    let (text, why) = match strength.mode {
        Mode::None => (
            tr!("It bears at least {} × what acts: {} kN at {} mm", times, load, moved),
            measured(&strength.because),
        ),
        mode => (
            tr!("It bears {} × what acts: {} kN at {} mm", times, load, moved),
            tr!("and fails by {}: {}", term(mode.words()), measured(&strength.because)),
        ),
    };
    copied(ui, RichText::new(text).strong());
    ui.label(why);
    if let Some(yields) = &strength.yielding {
        ui.label(tr!("A bar yields first at {} × what acts.", fixed(yields.load_factor, 2)));
    }
    ui.weak(tr!(
        "Raised: {}. Followed until {}.",
        strength.loads.join(", "),
        measured(&strength.ended)
    ));
}
