//! The window in the languages that are not English.

use std::collections::BTreeSet;

use egui::epaint::text::MissingGlyphPolicy;
use egui_kittest::kittest::{NodeT, Queryable};
use intrados_panels::{Action, Language, Taken, Workspace};

use super::{Window, pictures::at_rest};

/// What is the same word in German, or a name, or said so everywhere. *Close* are egui's own buttons
/// of a window.
const SAME: [&str; 11] = [
    "Close",
    "Close window",
    "Column 1",
    "Dual",
    "Language: Chinese",
    "Language: English",
    "Name",
    "Parallel",
    "Primal",
    "Sprache: Deutsch",
    "⏸ Pause",
];

/// All that a screen reader would read.
fn read(window: &Window) -> BTreeSet<String> {
    let nodes = window.harness.root().children_recursive();
    nodes.filter_map(|n| Some(n.accesskit_node().label()?.trim().to_owned())).collect()
}

/// Whether somebody who knows no English would stumble over it: it has a word.
fn has_word(text: &&String) -> bool {
    let is_name =
        |t: &str| t.contains(['/', '\\', '_']) || t.ends_with(".ron") || t.ends_with(".csv");
    !is_name(text) && text.split(|c: char| !c.is_alphabetic()).any(|word| word.chars().count() > 3)
}

/// What every tab and dialog says.
fn all_said(language: Language) -> BTreeSet<String> {
    let mut start = Window::new(|_| {});
    // What it says is read, not seen: no font of another language is needed.
    start.harness.ctx.set_missing_glyph_policy(MissingGlyphPolicy::Tofu);
    start.ask(Action::Speak(language));
    start.frames(4);
    let mut said = read(&start);
    let (mut window, _folder) = at_rest();
    window.harness.ctx.set_missing_glyph_policy(MissingGlyphPolicy::Tofu);
    window.ask(Action::Speak(language));
    window.frames(4);
    for workspace in [Workspace::Inspector, Workspace::Expert] {
        window.ask(Action::Arrange(workspace));
        let tabs = ["Structure", "Photos", "CT", "Stress", "Report"];
        for tab in tabs.iter().chain(&["Render", "Steering", "Jobs"][..workspace as usize * 3]) {
            window.ask(Action::Tab(tab));
            window.frames(6);
            said.append(&mut read(&window));
        }
    }
    for action in [
        Action::Keys,
        Action::Palette,
        Action::New,
        Action::Save(Taken::Report),
        Action::Save(Taken::Views),
        Action::Fill(Vec::new(), None),
        Action::Export,
    ] {
        window.ask(action.clone());
        window.frames(4);
        said.append(&mut read(&window));
        window.ask(if action == Action::Palette { action } else { Action::Dismiss });
        window.frames(2);
    }
    said
}

/// Text of every tab and dialog differs from the English one, where it is neither a name nor the
/// same word.
#[test]
fn nothing_is_left_in_english() {
    let english = all_said(Language::English);
    for language in [Language::German, Language::Chinese] {
        let said = all_said(language);
        assert!(said.len() > 150, "only {} texts were seen", said.len());
        let left: Vec<&String> = said
            .intersection(&english)
            .filter(has_word)
            .filter(|text| !SAME.contains(&text.as_str()))
            .collect();
        assert!(left.is_empty(), "{}: {left:#?}", language.name());
    }
}

/// Values of evidence have the comma of the language.
#[test]
fn values_of_evidence_are_written_as_the_language_writes_numbers() {
    let (mut window, _folder) = at_rest();
    let says = |window: &Window, text: &str| {
        window.harness.query_all_by_label_contains(text).next().is_some()
    };
    assert!(says(&window, "0.4 ± ") && !says(&window, "0,4 ± "));
    window.ask(Action::Speak(Language::German));
    window.frames(4);
    assert!(says(&window, "0,4 ± ") && !says(&window, "0.4 ± "));
}
