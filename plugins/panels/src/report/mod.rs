//! The Report tab: all members in one table, every item of evidence and what became of it, and how
//! good the prediction is where the truth is known.

mod save;

use std::path::PathBuf;

use bevy_ecs::prelude::*;
use egui::{Grid, ScrollArea, Ui};
use intrados_ct::score::Figure;
use intrados_damage::{evidence::called, ledger::Group};
use intrados_predict::{MemberPrediction, Prediction};
use intrados_scene::plugin::CurrentScene;
use intrados_stage::Jobs;

use crate::{
    Action, Actions, Latest, Selection, colours,
    lang::{fixed, measured, term},
    members::progress,
    number::{percent, plus_minus},
};

pub(crate) use save::{save_report, take};

/// What the tab remembers.
#[derive(Resource, Default)]
pub(crate) struct Report {
    save: save::Save,
}

impl Report {
    pub(crate) fn is_busy(&self) -> bool {
        self.save.is_busy()
    }

    /// Where its files would go.
    pub(crate) fn proposal(&self) -> String {
        self.save.proposal()
    }

    /// Where a dialog says.
    pub(crate) fn put(&mut self, folder: PathBuf) {
        self.save.put(folder);
    }
}

pub(crate) fn report(
    InMut(ui): InMut<Ui>,
    scene: Option<Res<CurrentScene>>,
    latest: Res<Latest>,
    selection: Res<Selection>,
    mut report: ResMut<Report>,
    mut jobs: ResMut<Jobs>,
    mut actions: ResMut<Actions>,
) {
    let Some(scene) = scene else { return };
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        progress(ui, &latest, &mut actions);
        for failure in &latest.failures {
            ui.label(format!("⚠ {}", term(failure)));
        }
        let Some(result) = &latest.result else {
            ui.label(tr!(
                "The table comes when all CT slices have been read, all lives computed and all \
                 gauges heard."
            ));
            return;
        };
        if scene.0.hash != result.scene_hash {
            ui.label(tr!("⚠ Outdated: the scene has changed since."));
        } else {
            let save = &mut report.bypass_change_detection().save;
            save.row(ui, &scene.0, result, jobs.bypass_change_detection(), &mut actions);
        }
        let wide = || ScrollArea::horizontal().auto_shrink([false, true]);
        wide().show(ui, |ui| table(ui, result, *selection, &latest, &mut actions));
        ui.add_space(12.0);
        wide().id_salt("ledger").show(ui, |ui| ledger(ui, result));
        ui.add_space(12.0);
        score(ui, result);
        ui.add_space(12.0);
        ui.strong(tr!("What this does not say"));
        for limit in &result.limits {
            ui.label(format!("• {}", term(limit)));
        }
        let profile = &result.profile;
        let source = term(&profile.source);
        ui.weak(tr!("Graded by {} ({}, {})", profile.name, source, profile.edition));
    });
}

fn table(
    ui: &mut Ui,
    result: &Prediction,
    selection: Selection,
    latest: &Latest,
    actions: &mut Actions,
) {
    Grid::new("damage").num_columns(6).striped(true).spacing([18.0, 6.0]).show(ui, |ui| {
        for heading in [
            tr!("Member"),
            tr!("Kind"),
            tr!("Damage d"),
            tr!("State"),
            tr!("Truth"),
            tr!("Rests on"),
        ] {
            ui.strong(heading);
        }
        ui.end_row();
        for (index, member) in result.members.iter().enumerate() {
            row(ui, index, member, selection, latest, actions);
            ui.end_row();
        }
    });
}

/// Every item of evidence and what became of it.
fn ledger(ui: &mut Ui, result: &Prediction) {
    let unused = result.items.iter().filter(|i| !i.used).count();
    ui.strong(tr!("Evidence: {} items, {} not used", result.items.len(), unused));
    Grid::new("evidence").num_columns(4).striped(true).spacing([18.0, 4.0]).show(ui, |ui| {
        for group in Group::all(&result.items) {
            let first = group.first();
            ui.label(result.name_of(&first.member));
            ui.label(term(called(first.source)));
            ui.label(term(&group.name()));
            ui.label(match &first.why {
                None => tr!("used"),
                Some(why) => tr!("⚠ not used, because {}", measured(why)),
            });
            ui.end_row();
        }
    });
}

fn row(
    ui: &mut Ui,
    index: usize,
    member: &MemberPrediction,
    selection: Selection,
    latest: &Latest,
    actions: &mut Actions,
) {
    if ui.selectable_label(selection.0 == Some(index), &member.name).clicked() {
        actions.ask(Action::Select(Some(index)));
    }
    ui.label(term(&format!("{:?}", member.kind).to_lowercase()));
    match member.damage.zip(member.damage_std_error) {
        Some((damage, error)) => ui.label(plus_minus(damage, error, "")),
        None => ui.weak("–"),
    };
    ui.horizontal(|ui| {
        if let Some((verdict, steps)) = latest.state(index) {
            colours::severity(ui, verdict, steps);
        }
        ui.label(term(&member.state)).on_hover_text(term(&member.advice));
    });
    match &member.truth {
        Some(truth) => ui.label(format!("{}, {}", fixed(truth.damage, 3), term(truth.origin))),
        None => ui.weak(tr!("unknown")),
    };
    let said: Vec<String> = member
        .evidence
        .values()
        .map(|e| format!("{} {}", term(called(e.source)), plus_minus(e.damage, e.std_error, "")))
        .collect();
    let basis: Vec<String> = member.evidence.values().map(|e| measured(&e.basis)).collect();
    let conflict = if member.conflict { "⚠ " } else { "" };
    ui.add(egui::Label::new(format!("{conflict}{}", said.join(", "))).extend())
        .on_hover_text(basis.join("\n"));
}

fn score(ui: &mut Ui, result: &Prediction) {
    let score = &result.score;
    ui.strong(tr!("Score where the truth is known"));
    if score.members == 0 {
        ui.weak(tr!("The truth is known of no member."));
        return;
    }
    Grid::new("score").num_columns(2).show(ui, |ui| {
        let mut row = |name: String, figure: &Option<Figure>| {
            let Some(f) = figure else { return };
            ui.label(name);
            ui.label(tr!(
                "{} (95 %: {} to {}, n = {})",
                percent(f.value),
                percent(f.ci95[0]),
                percent(f.ci95[1]),
                f.n
            ));
            ui.end_row();
        };
        row(tr!("Precision, severe members"), &score.precision);
        row(tr!("Recall, severe members"), &score.recall);
        row(tr!("Truth within the 95 % interval"), &score.coverage_95);
        row(tr!("Mean absolute error of d"), &score.mean_absolute_error);
        row(tr!("Damaged zones, IoU"), &score.zone_iou);
        row(tr!("Zones whose truth is within the 95 % interval"), &score.zone_coverage_95);
        if let Some(dice) = score.slices.dice {
            ui.label(tr!("Dice of the slices' pixels"));
            ui.label(fixed(dice, 3));
            ui.end_row();
        }
    });
}
