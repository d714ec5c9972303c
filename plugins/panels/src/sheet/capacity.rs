//! What a member bears: its widest crack against its limit, its stress and its load at failure,
//! computed when somebody asks.

use bevy_ecs::prelude::*;
use egui::{ProgressBar, RichText, Ui};
use intrados_damage::evidence::called;
use intrados_mechanics::{
    analysis::{MemberOutcome, Outcome},
    member::Meshing,
    plugin::{Analyses, Analysis, Analyze, Stop},
    strength::Strength,
};
use intrados_predict::MemberPrediction;
use intrados_scene::{Member, Scene};
use intrados_stage::Work;

use crate::{Action, Actions, number::copied};

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
        let verdict = if c.exceeded { "⚠ wider than" } else { "✔ within" };
        ui.label(format!(
            "widest crack {:.2} mm ({}), {verdict} the {} mm of {}",
            c.width_mm,
            called(c.source),
            c.limit_mm,
            c.exposure
        ));
    }
    if let Some(c) = told.and_then(|t| t.capacity.as_ref()) {
        ui.label(format!("It {}.", c.told())).on_hover_text(c.because.as_str());
    }
    let Some(assembly) = scene.structure.assembly_of(&member.id) else {
        ui.weak("Its body is known as a surface alone: no load can be put on it.");
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
    let is_done = analysis.is_some_and(|a| matches!(a.work, Work::Done(_)));
    ui.horizontal_wrapped(|ui| {
        let hint = "Loads, pours, creep and damage over its whole life, as `intrados analyze`";
        if !is_done && ui.button("Compute its stress").on_hover_text(hint).clicked() {
            mechanics.begin(model, false);
        }
        let hint = "Then raises its loads until it fails, as `intrados analyze --to-failure`";
        let may = !has_strength && can_be_raised;
        if may && ui.button("Compute what it bears").on_hover_text(hint).clicked() {
            mechanics.begin(model, true);
        }
    });
    if !can_be_raised {
        ui.weak("No load of this scene can be raised to failure.");
    }
}

/// How far it is; true: it is to be stopped.
fn running(ui: &mut Ui, analysis: &Analysis) -> bool {
    let seen = &analysis.seen;
    let last = seen.count().checked_sub(1).and_then(|last| seen.shot(last));
    let done = seen.skin().zip(last).map_or(0.0, |(skin, shot)| skin.progress(shot.time));
    ui.horizontal(|ui| {
        let text = format!("{:.0} % of its life", 100.0 * done);
        ui.add(ProgressBar::new(done).desired_width(140.0).text(text));
        ui.button("Stop computing").on_hover_text("What has been found until then stays").clicked()
    })
    .inner
}

/// What was found; true: what it bears is known, too.
fn result(ui: &mut Ui, analysis: &Analysis, member: &Member, actions: &mut Actions) -> bool {
    let outcome = match &analysis.work {
        Work::Running(_) => return false,
        Work::Cancelled => {
            ui.label("Its stress was stopped before its end.");
            return false;
        }
        Work::Failed(why) => {
            ui.label(format!("⚠ Not computed: {why}"));
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
    if ui.link("See it over its life").clicked() {
        actions.ask(Action::Tab("Stress"));
    }
    outcome.strength.is_some()
}

/// What a user must know before believing any of it.
fn doubts(ui: &mut Ui, outcome: &Outcome) {
    if !outcome.complaint.is_empty() {
        ui.label(format!("⚠ ended early: {}", outcome.complaint));
    }
    outcome.warnings.iter().for_each(|why| drop(ui.label(format!("⚠ {why}"))));
}

/// The extremes of its life.
fn stresses(ui: &mut Ui, own: &MemberOutcome) {
    let mpa = |pa: f64| pa / 1e6;
    egui::Grid::new("capacity").num_columns(2).spacing([8.0, 2.0]).show(ui, |ui| {
        for (what, value) in [
            ("compression", format!("{:.1} MPa", mpa(own.peak_compression_pa))),
            ("tension", format!("{:.2} MPa", mpa(own.peak_tension_pa))),
            ("bars", format!("{:.0} MPa", mpa(own.peak_bar_stress_pa))),
            ("cracks by load", format!("{:.2} mm", 1e3 * own.max_crack_width_m)),
        ] {
            ui.label(what);
            copied(ui, RichText::new(value));
            ui.end_row();
        }
        if let Some(pipe) = own.pipe {
            ui.label("steel pipe");
            let [around, along] = [pipe.around_pa, pipe.along_pa].map(mpa);
            copied(ui, RichText::new(format!("{around:.0} MPa around, {along:.0} along")));
            ui.end_row();
        }
    });
}

/// Its load at failure, and how it fails.
fn bears(ui: &mut Ui, strength: &Strength) {
    let peak = &strength.peak;
    let text = format!(
        "It bears {:.2} × what acts: {:.0} kN at {:.1} mm",
        peak.load_factor,
        1e-3 * peak.load_n,
        1e3 * peak.displacement_m
    );
    copied(ui, RichText::new(text).strong());
    ui.label(format!("and fails by {}: {}", strength.mode.words(), strength.because));
    if let Some(yields) = &strength.yielding {
        ui.label(format!("A bar yields first at {:.2} × what acts.", yields.load_factor));
    }
    ui.weak(format!("Raised: {}. Followed until {}.", strength.loads.join(", "), strength.ended));
}
