//! The whole structure in a few lines, while no member is selected.

use egui::{RichText, Ui};
use intrados_scene::Scene;

use crate::{Action, Actions, Latest, colours, lang::term, number::plus_minus};

/// So many of the worst members are named.
const WORST: usize = 8;

pub(super) fn overview(ui: &mut Ui, scene: &Scene, latest: &Latest, actions: &mut Actions) {
    ui.label(RichText::new(&scene.name).heading().strong());
    if scene.members.is_empty() {
        ui.label(tr!("This scene has no structural members."));
        if ui.button(tr!("Look at its light")).clicked() {
            actions.ask(Action::Light);
        }
        return;
    }
    ui.weak(match scene.members.len() {
        1 => tr!("one member"),
        count => tr!("{} members", count),
    });
    ui.add_space(4.0);
    let known: Vec<usize> =
        (0..scene.members.len()).filter(|i| latest.member(*i).is_some()).collect();
    states(ui, scene, latest, known.len());
    worst(ui, scene, latest, known, actions);
    ui.add_space(6.0);
    ui.label(tr!("Click a member, in the picture or in the list, for its sheet."));
}

/// How many members are in which state, by what is most probable of each.
fn states(ui: &mut Ui, scene: &Scene, latest: &Latest, known: usize) {
    let mut counts: Vec<(String, usize)> = Vec::new();
    for index in 0..scene.members.len() {
        let Some((verdict, _)) = latest.state(index) else { continue };
        match counts.iter_mut().find(|(state, _)| *state == verdict.state) {
            Some((_, count)) => *count += 1,
            None => counts.push((verdict.state.clone(), 1)),
        }
    }
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let row = |ui: &mut Ui, count: usize, state: String| {
        ui.horizontal_wrapped(|ui| {
            ui.strong(count.to_string());
            ui.label(state);
        });
    };
    counts.iter().for_each(|(state, count)| row(ui, *count, term(state)));
    let unknown = scene.members.len() - known;
    if unknown > 0 {
        row(ui, unknown, tr!("no evidence so far, which is not the same as sound"));
    }
}

fn worst(
    ui: &mut Ui,
    scene: &Scene,
    latest: &Latest,
    mut known: Vec<usize>,
    actions: &mut Actions,
) {
    let damage = |i: &usize| latest.member(*i).map_or(0.0, |p| p.damage.value);
    // A life that ends by computation comes before any damage.
    let fails = |i: &usize| {
        let end = latest.member(*i).and_then(|p| p.failure.as_ref());
        end.map_or(f64::INFINITY, |end| end.ahead_years)
    };
    known.sort_by(|a, b| fails(a).total_cmp(&fails(b)).then(damage(b).total_cmp(&damage(a))));
    if known.is_empty() {
        return;
    }
    ui.add_space(6.0);
    ui.strong(tr!("The most damaged"));
    for index in known.into_iter().take(WORST) {
        ui.horizontal_wrapped(|ui| {
            if let Some((verdict, steps)) = latest.state(index) {
                colours::severity(ui, verdict, steps);
            }
            // Not the name alone: that is the one in the list of members.
            let d =
                latest.member(index).map(|p| plus_minus(p.damage.value, p.damage.std_error, ""));
            let text =
                format!("{}: d = {}", scene.members[index].name, d.unwrap_or_default().trim());
            if ui.link(text).clicked() {
                actions.ask(Action::Select(Some(index)));
            }
        });
    }
}
