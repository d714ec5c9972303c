//! Where something is written: the field that asks for it.

use std::path::{Path, PathBuf};

use egui::{
    Key, TextEdit, Ui,
    text::{CCursor, CCursorRange},
};

/// A path as it was proposed, typed or chosen.
#[derive(Debug, Default)]
pub(crate) struct Destination {
    pub(crate) path: String,
    /// The field has yet to take the keyboard.
    is_new: bool,
}

impl Destination {
    /// Proposes a path.
    pub(crate) fn propose(&mut self, path: String) {
        self.path = path;
        self.take_keyboard();
    }

    /// Lets the field have the keyboard, with the name selected that is to be typed over.
    pub(crate) fn take_keyboard(&mut self) {
        self.is_new = true;
    }

    /// Proposes the folder that a dialog has brought, or one in it.
    pub(crate) fn put_folder(&mut self, folder: PathBuf) {
        let folder = inside(folder, &self.path);
        self.propose(folder.display().to_string());
    }

    /// Draws the field, so many points wide; whether Enter was pressed in it.
    pub(crate) fn field(&mut self, ui: &mut Ui, name: String, width: f32) -> bool {
        let label = ui.label(name);
        let field = TextEdit::singleline(&mut self.path).desired_width(width);
        let field = ui.add(field).labelled_by(label.id);
        // A window is drawn once for its size alone, before anybody sees it.
        if self.is_new && !ui.is_sizing_pass() {
            self.is_new = false;
            field.request_focus();
            if let Some(mut state) = TextEdit::load_state(ui.ctx(), field.id) {
                let [from, to] = stem(&self.path).map(CCursor::new);
                state.cursor.set_char_range(Some(CCursorRange::two(from, to)));
                TextEdit::store_state(ui.ctx(), field.id, state);
            }
        }
        field.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter))
    }
}

/// The folder that is written where somebody has chosen one: itself where it is empty or of the
/// proposal's name, or else one of that name in it, so that files of others are not mixed with ours.
fn inside(folder: PathBuf, proposal: &str) -> PathBuf {
    let name = Path::new(proposal.trim()).file_name();
    let is_empty = folder.read_dir().is_ok_and(|mut files| files.next().is_none());
    match name {
        Some(name) if !is_empty && folder.file_name() != Some(name) => folder.join(name),
        _ => folder,
    }
}

/// Where the name lies in a path, without its folder and its ending, characters.
fn stem(path: &str) -> [usize; 2] {
    let from = path.rfind(std::path::is_separator).map_or(0, |at| at + 1);
    let end = path[from..].rfind('.').filter(|at| *at > 0).map_or(path.len(), |at| from + at);
    [from, end].map(|at| path[..at].chars().count())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_selected_without_its_folder_and_its_ending() {
        assert_eq!(stem("brücke.csv"), [0, 6]);
        assert_eq!(stem("/tmp/a.b/pier-7.v2.csv"), [9, 18]);
        assert_eq!(stem("bridge-damage"), [0, 13]);
        assert_eq!(stem("out/.csv"), [4, 8]);
        assert_eq!(stem(""), [0, 0]);
    }

    #[test]
    fn a_folder_with_files_of_others_gets_one_of_its_own() {
        let folder = tempfile::tempdir().unwrap();
        let chosen = folder.path().to_owned();
        assert_eq!(inside(chosen.clone(), "bridge-damage"), chosen);
        std::fs::write(chosen.join("letter.txt"), "").unwrap();
        let own = chosen.join("bridge-damage");
        assert_eq!(inside(chosen.clone(), "elsewhere/bridge-damage "), own);
        std::fs::create_dir(&own).unwrap();
        std::fs::write(own.join("report.html"), "").unwrap();
        assert_eq!(inside(own.clone(), "bridge-damage"), own);
        assert_eq!(inside(chosen.clone(), ""), chosen);
    }
}
