//! Values of a scene's file in a form: what is written, what has been typed, and what that changes.

use egui::{ComboBox, Grid, Response, RichText, ScrollArea, TextEdit, Ui};
use intrados_scene::attach::{Field, FieldKind, Setting};
use serde::{Deserialize, Serialize};

use crate::lang::term;

/// Width of a field, points, and of one that holds words.
const WIDTHS: (f32, f32) = (70.0, 120.0);
/// Width of a field's own margins, points.
const INSET: f32 = 8.0;
/// So many changed fields are named in the line that can be undone.
const NAMED: usize = 3;

/// What has been typed into a field and is not written yet.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Typed {
    /// Its place in the form, and what it is called there.
    place: usize,
    group: String,
    name: String,
    /// What was written there.
    written: String,
    text: String,
}

impl Typed {
    fn is_of(&self, field: &Field) -> bool {
        let own = (&self.group, &self.name, &self.written);
        own == (&field.group, &field.name, &field.value)
    }
}

/// Fields, and what has been typed into each.
#[derive(Debug, Default)]
pub(crate) struct Values {
    fields: Vec<Field>,
    texts: Vec<String>,
}

impl Values {
    pub(crate) fn new(fields: Vec<Field>) -> Self {
        let texts = fields.iter().map(|f| f.value.clone()).collect();
        Self { fields, texts }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.fields.is_empty()
    }

    /// The fields as the file has them now. What has been typed is there again where the file still
    /// says what it did.
    pub(crate) fn again(fields: Vec<Field>, typed: &[Typed]) -> Self {
        let mut values = Self::new(fields);
        for typed in typed {
            let all = values.fields.iter().enumerate();
            let own = all.filter(|(_, field)| typed.is_of(field));
            // Others may have come before it since.
            let nearest = own.map(|(place, _)| place).min_by_key(|p| p.abs_diff(typed.place));
            if let Some(text) = nearest.and_then(|place| values.texts.get_mut(place)) {
                text.clone_from(&typed.text);
            }
        }
        values
    }

    /// Back to what is written.
    pub(crate) fn discard(&mut self) {
        *self = Self::new(std::mem::take(&mut self.fields));
    }

    /// How many are not as they are written.
    pub(crate) fn changed(&self) -> usize {
        self.pairs().count()
    }

    /// What has been typed and is not written yet.
    pub(crate) fn typed(&self) -> Vec<Typed> {
        let all = self.fields.iter().zip(&self.texts).enumerate();
        all.filter(|(_, (field, text))| field.value != text.trim())
            .map(|(place, (field, text))| Typed {
                place,
                group: field.group.clone(),
                name: field.name.clone(),
                written: field.value.clone(),
                text: text.clone(),
            })
            .collect()
    }

    fn pairs(&self) -> impl Iterator<Item = (&Field, &String)> {
        self.fields.iter().zip(&self.texts).filter(|(field, text)| field.value != text.trim())
    }

    /// What is to be written, and the names of what changes; or what has to be typed otherwise.
    pub(crate) fn settings(&self) -> Result<(Vec<Setting>, String), String> {
        let changes: Vec<(&Field, &str)> = self.pairs().map(|(f, text)| (f, &**text)).collect();
        let settings = Field::set_all(&changes)?;
        let mut names: Vec<String> = changes.iter().map(|(f, _)| term(&f.name)).collect();
        let more = names.len().saturating_sub(NAMED);
        names.truncate(NAMED);
        let named = names.join(", ");
        Ok((settings, if more > 0 { tr!("{} and {} more", named, more) } else { named }))
    }

    /// Draws them by their groups, names on the left.
    pub(crate) fn show(&mut self, ui: &mut Ui) {
        let mut from = 0;
        while let Some(first) = self.fields.get(from) {
            let group = first.group.clone();
            let own = self.fields[from..].iter().take_while(|f| f.group == group).count();
            let range = from..from + own;
            // What concerns all of a group is said once.
            let is_common = self.fields[range.clone()].iter().all(|f| f.note == first.note);
            let common = term(&first.note);
            ui.horizontal_wrapped(|ui| {
                ui.label(RichText::new(term(&group)).strong());
                if is_common && own > 1 {
                    ui.weak(common);
                }
            });
            let column = (0.5 * ui.available_width() - 6.0).max(60.0);
            let grid = Grid::new(&group).num_columns(2).max_col_width(column);
            grid.spacing([8.0, 3.0]).show(ui, |ui| {
                let fields = &self.fields[range.clone()];
                let mut is_cut = false;
                for (k, (field, text)) in fields.iter().zip(&mut self.texts[range]).enumerate() {
                    is_cut |= row(ui, field, text);
                    // What is said of several is said once, below the last of them.
                    if fields.get(k + 1).is_none_or(|next| next.note != field.note) {
                        if is_cut && !(is_common && own > 1) {
                            note(ui, field);
                        }
                        is_cut = false;
                    }
                }
            });
            from += own;
        }
    }
}

/// What a field is too narrow to say of itself.
fn note(ui: &mut Ui, field: &Field) {
    ui.allocate_exact_size(egui::Vec2::ZERO, egui::Sense::hover());
    ui.weak(term(&field.note));
    ui.end_row();
}

/// A value with its name and its unit; whether it is empty, and too narrow for its note.
fn row(ui: &mut Ui, field: &Field, text: &mut String) -> bool {
    let is_changed = field.value != text.trim();
    let name = RichText::new(term(&field.name));
    let label = ui.label(if is_changed { name.strong() } else { name });
    let note = term(&field.note);
    let label = if note.is_empty() { label } else { label.on_hover_text(&note) };
    let is_cut = ui.horizontal(|ui| {
        let width = match field.kind {
            FieldKind::Text | FieldKind::OneOf(_) | FieldKind::Choice(_) => WIDTHS.1,
            FieldKind::Number | FieldKind::Whole | FieldKind::Day => WIDTHS.0,
        };
        let choice = if matches!(field.kind, FieldKind::OneOf(_)) { 26.0 } else { 0.0 };
        let width = width.min(ui.available_width() - choice).max(40.0);
        let is_day = field.kind == FieldKind::Day;
        let is_cut = !is_day && text.is_empty() && width_of(ui, &note) > width - INSET;
        let hint = match is_day {
            true => "2026-05-03",
            false if is_cut => "",
            false => note.as_str(),
        };
        let response = match &field.kind {
            FieldKind::Choice(names) => pick(ui, field, names, width, text),
            _ => ui.add(TextEdit::singleline(text).desired_width(width).hint_text(hint)),
        };
        let response = response.labelled_by(label.id);
        if !note.is_empty() {
            response.on_hover_text(&note);
        }
        if let FieldKind::OneOf(names) = &field.kind {
            choose(ui, &field.name, names, text);
        }
        if !field.unit.is_empty() {
            ui.label(term(field.unit));
        }
        is_cut
    });
    ui.end_row();
    is_cut.inner
}

/// Width of a text in a line, points.
fn width_of(ui: &Ui, text: &str) -> f32 {
    let text = egui::WidgetText::from(text);
    let mode = Some(egui::TextWrapMode::Extend);
    text.into_galley(ui, mode, f32::INFINITY, egui::TextStyle::Body).size().x
}

/// A list of what there is.
fn pick(ui: &mut Ui, field: &Field, names: &[&str], width: f32, text: &mut String) -> Response {
    let list = ComboBox::from_id_salt((&field.group, &field.name));
    let list = list.width(width).selected_text(term(text));
    let shown = list.show_ui(ui, |ui| {
        for name in names {
            ui.selectable_value(text, (*name).to_owned(), term(name));
        }
    });
    shown.response
}

/// A list of what is usual.
fn choose(ui: &mut Ui, of: &str, names: &[String], text: &mut String) {
    let button = egui::containers::menu::MenuButton::new("⏷");
    let (response, _) = button.ui(ui, |ui| {
        ScrollArea::vertical().max_height(260.0).show(ui, |ui| {
            for name in names {
                if ui.selectable_label(text == name, name).clicked() {
                    text.clone_from(name);
                    ui.close();
                }
            }
        });
    });
    let hint = tr!("Choose {}", term(of));
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &hint));
}

#[cfg(test)]
mod tests {
    use intrados_scene::{Scene, attach::fields};
    use intrados_stage::Job;

    use super::*;

    #[test]
    fn what_was_typed_goes_into_the_same_fields_again_and_into_no_others() {
        let scene = Scene::load_bundled("column", &Job::default()).unwrap();
        let all = fields(&scene, scene.members.first());
        let mut values = Values::new(all.clone());
        values.texts[1].push('7');
        let typed = values.typed();
        assert_eq!(typed.len(), 1);
        let again = Values::again(all.clone(), &typed);
        assert_eq!((again.changed(), &again.texts), (1, &values.texts));
        // Another field has come before it.
        let mut now = all;
        now.insert(0, now[0].clone());
        let again = Values::again(now.clone(), &typed);
        assert_eq!((again.changed(), &again.texts[2]), (1, &values.texts[1]));
        // Somebody has written another value there meanwhile.
        now[2].value.push('9');
        let again = Values::again(now.clone(), &typed);
        assert_eq!((again.changed(), &again.texts[2]), (0, &now[2].value));
        assert_eq!(Values::again(fields(&scene, None), &typed).changed(), 0);
    }
}
