//! What is said in one line however narrow the panel is, so that nothing below it moves.

use std::{iter, sync::Arc};

use egui::{Galley, Label, RichText, TextStyle, TextWrapMode, Ui, WidgetText};

/// Width that is left for “…” where more is to come, points.
const ELLIPSIS: f32 = 32.0;
/// Width of a bar, points.
const BAR: f32 = 6.0;

/// A part of what is said.
pub(crate) struct Piece {
    text: RichText,
    hint: String,
    /// Whether a bar stands before it.
    is_apart: bool,
}

impl Piece {
    pub(crate) fn new(text: impl Into<RichText>) -> Self {
        Self { text: text.into(), hint: String::new(), is_apart: false }
    }

    /// With a tooltip.
    pub(crate) fn hint(self, hint: impl Into<String>) -> Self {
        Self { hint: hint.into(), ..self }
    }

    /// Behind a bar.
    pub(crate) fn apart(self) -> Self {
        Self { is_apart: true, ..self }
    }

    fn laid(&self, ui: &Ui, mode: TextWrapMode, width: f32) -> Arc<Galley> {
        WidgetText::from(self.text.clone()).into_galley(ui, Some(mode), width, TextStyle::Body)
    }

    /// Shows it where it leaves so much of the row; whether it did.
    fn show(&self, ui: &mut Ui, behind: f32) -> bool {
        let text = self.laid(ui, TextWrapMode::Extend, f32::INFINITY);
        let bar = if self.is_apart { BAR + ui.spacing().item_spacing.x } else { 0.0 };
        if bar + text.size().x + behind > ui.available_size_before_wrap().x {
            return false;
        }
        if self.is_apart {
            ui.add(egui::Separator::default().spacing(BAR));
        }
        let shown = ui.label(text);
        if !self.hint.is_empty() {
            shown.on_hover_text(&self.hint);
        }
        true
    }

    /// Shows what there is room for, with a tooltip of all.
    fn elide(&self, ui: &mut Ui, all: String) {
        let text = self.laid(ui, TextWrapMode::Truncate, ui.available_size_before_wrap().x);
        ui.add(Label::new(text).show_tooltip_when_elided(false)).on_hover_text(all);
    }
}

/// Says all in a line of its own; where it is too narrow, the tooltip at its end has the rest.
pub(crate) fn say(ui: &mut Ui, pieces: Vec<Piece>) {
    ui.horizontal(|ui| put(ui, pieces));
}

/// The same in what is left of a row.
pub(crate) fn put(ui: &mut Ui, pieces: Vec<Piece>) {
    let mut coming = pieces.into_iter();
    while let Some(piece) = coming.next() {
        let behind = if coming.as_slice().is_empty() { 0.0 } else { ELLIPSIS };
        if !piece.show(ui, behind) {
            let rest = iter::once(&piece).chain(coming.as_slice());
            let rest: Vec<&str> = rest.map(|piece| piece.text.text()).collect();
            return piece.elide(ui, rest.join("\n"));
        }
    }
}
