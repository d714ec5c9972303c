//! Values of a scene's file in a form: what is written, what has been typed, and what that changes.

use egui::{ComboBox, Grid, Response, RichText, ScrollArea, TextEdit, Ui};
use intrados_scene::attach::{Field, FieldKind, Setting};
use serde::{Deserialize, Serialize};

use crate::lang::term;

/// Width of a field, points, and of one that holds words.
const WIDTHS: (f32, f32) = (70.0, 120.0);
/// So many changed fields are named in the line that can be undone.
const NAMED: usize = 3;

/// What has been typed into a field and is not written yet.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Typed {
    /// Its place in the form, and what it is called there.
    place: usize,
    group: String,
    name: String,
    text: String,
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

    /// Takes the fields as the file has them now. What has been typed stays where the file still
    /// says what it did.
    pub(crate) fn renew(&mut self, fields: Vec<Field>) {
        let before = std::mem::replace(self, Self::new(fields));
        let typed = before.fields.iter().zip(before.texts);
        for ((old, text), (new, own)) in typed.zip(self.fields.iter().zip(&mut self.texts)) {
            let is_same =
                (&old.group, &old.name, &old.value) == (&new.group, &new.name, &new.value);
            if is_same {
                *own = text;
            }
        }
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
                text: text.clone(),
            })
            .collect()
    }

    /// Types it again, into the same fields as far as they are still there.
    pub(crate) fn type_again(&mut self, typed: &[Typed]) {
        for Typed { place, group, name, text } in typed {
            let field = self.fields.get(*place);
            let is_same = field.is_some_and(|f| (&f.group, &f.name) == (group, name));
            if let Some(own) = self.texts.get_mut(*place).filter(|_| is_same) {
                own.clone_from(text);
            }
        }
    }

    fn pairs(&self) -> impl Iterator<Item = (&Field, &String)> {
        self.fields.iter().zip(&self.texts).filter(|(field, text)| field.value != text.trim())
    }

    /// What is to be written, and the names of what changes; or what has to be typed otherwise.
    pub(crate) fn settings(&self) -> Result<(Vec<Setting>, String), String> {
        let mut settings = Vec::new();
        let mut names = Vec::new();
        for (field, text) in self.pairs() {
            settings.extend(field.set(text)?);
            names.push(term(&field.name));
        }
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
                let rows = self.fields[range.clone()].iter().zip(&mut self.texts[range]);
                rows.for_each(|(field, text)| row(ui, field, text));
            });
            from += own;
        }
    }
}

/// A value with its name and its unit.
fn row(ui: &mut Ui, field: &Field, text: &mut String) {
    let is_changed = field.value != text.trim();
    let name = RichText::new(term(&field.name));
    let label = ui.label(if is_changed { name.strong() } else { name });
    let note = term(&field.note);
    let label = if note.is_empty() { label } else { label.on_hover_text(&note) };
    ui.horizontal(|ui| {
        let width = match field.kind {
            FieldKind::Text | FieldKind::OneOf(_) | FieldKind::Choice(_) => WIDTHS.1,
            FieldKind::Number | FieldKind::Whole | FieldKind::Day => WIDTHS.0,
        };
        let choice = if matches!(field.kind, FieldKind::OneOf(_)) { 26.0 } else { 0.0 };
        let width = width.min(ui.available_width() - choice).max(40.0);
        let hint = if field.kind == FieldKind::Day { "2026-05-03" } else { note.as_str() };
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
    });
    ui.end_row();
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
        let mut again = Values::new(all.clone());
        again.type_again(&typed);
        assert_eq!((again.changed(), &again.texts), (1, &values.texts));
        let mut now = all;
        again.renew(now.clone());
        assert_eq!((again.changed(), &again.texts), (1, &values.texts));
        // Somebody has written another value there meanwhile.
        now[1].value.push('9');
        again.renew(now.clone());
        assert_eq!((again.changed(), &again.texts[1]), (0, &now[1].value));
        let mut other = Values::new(fields(&scene, None));
        other.type_again(&typed);
        assert_eq!(other.changed(), 0);
    }
}
