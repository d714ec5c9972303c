//! A new structure: a template, what a form has changed of it, and the folder that it becomes.

use std::{fs, io, path::Path, path::PathBuf, sync::Arc};

use intrados_stage::{Access, Job, file::AsideFolder};

use super::{AttachError, Field, Setting, amend, fields, write};
use crate::{
    LoadError, Scene,
    file::evidence,
    load::{PROJECT, Sources, from_text},
    parametric::template,
};

/// A structure that is not written yet.
#[derive(Debug, Clone)]
pub struct Draft {
    text: String,
    /// As it would be.
    pub scene: Arc<Scene>,
}

impl Draft {
    /// The kinds of structure that there are templates of, by their names for [`template`].
    pub const KINDS: [&str; 3] = ["column", "beam", "tunnel"];

    /// A template with other values.
    ///
    /// # Errors
    /// There is no such template, or a scene with these values would be refused.
    pub fn new(kind: &str, settings: &[Setting], job: &Job) -> Result<Self, LoadError> {
        let bad = |why: &str| LoadError::bad(PROJECT, "NO_TEMPLATE", why);
        let text = template(kind).ok_or_else(|| bad("there is no template of this kind"))?;
        let text = amend::written(text, settings)
            .ok_or_else(|| bad("has no such place: change it by hand"))?;
        let mut sources = Sources::new(Path::new(""), &Access::default());
        let mut scene = from_text(PROJECT, &text, &mut sources, job)?;
        scene.name = kind.to_owned();
        scene.hash = blake3::hash(text.as_bytes()).to_hex().to_string();
        Ok(Self { text, scene: Arc::new(scene) })
    }

    /// What can be changed of it, each value once.
    #[must_use]
    pub fn fields(&self) -> Vec<Field> {
        let mut all = fields(&self.scene, None);
        for written in fields::said(&self.scene).into_iter().flat_map(|file| file.members) {
            let own = self.scene.members.iter().find(|m| m.id == written.id);
            for field in own.map_or(Vec::new(), |own| fields(&self.scene, Some(own))) {
                if !all.iter().any(|f| f.place() == field.place()) {
                    all.push(field);
                }
            }
        }
        all
    }

    /// Makes its folder, with the scene and the file that evidence goes into; all of it or nothing.
    /// Gives the scene's path.
    ///
    /// # Errors
    /// The folder is there already, or nothing can be written beside it.
    pub fn write(&self, folder: &Path) -> Result<PathBuf, AttachError> {
        let failed = |e: io::Error| AttachError::write(folder, &e);
        if folder.as_os_str().is_empty() || folder.file_name().is_none() {
            let line = "name the folder that is to be made".to_owned();
            return Err(AttachError::BadInput(line));
        }
        if fs::symlink_metadata(folder).is_ok() {
            let why = "is there already: choose another folder";
            return Err(AttachError::CannotWrite(format!("{}: {why}", folder.display())));
        }
        let parent = folder.parent().filter(|p| !p.as_os_str().is_empty());
        let parent = parent.unwrap_or(Path::new("."));
        fs::create_dir_all(parent).map_err(failed)?;
        let aside = AsideFolder::begin(parent, ".new-").map_err(failed)?;
        let first = self.scene.members.first().map_or("", |m| m.id.as_str());
        write(&aside.path().join(PROJECT), &self.text)?;
        write(&aside.path().join(evidence::NAME), &evidence::skeleton(PROJECT, first))?;
        aside.settle(folder).map_err(failed)?;
        Ok(folder.join(PROJECT))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(draft: &Draft, name: &str, value: &str) -> Vec<Setting> {
        let all = draft.fields();
        let field = all.iter().find(|f| f.name == name);
        field.unwrap_or_else(|| panic!("{name}")).set(value).unwrap()
    }

    #[test]
    fn every_template_becomes_a_project_with_its_values() {
        let folder = tempfile::tempdir().unwrap();
        let job = Job::default();
        for (kind, name, value) in [
            ("column", "height", "4.5"),
            ("beam", "length", "8"),
            ("tunnel", "radius inside", "3.25"),
        ] {
            let draft = Draft::new(kind, &[], &job).unwrap();
            let title = set(&draft, "title", "Mine");
            let draft = Draft::new(kind, &[title, set(&draft, name, value)].concat(), &job);
            let draft = draft.unwrap();
            let place = folder.path().join("new").join(kind);
            let path = draft.write(&place).unwrap();
            let scene = Scene::load(&path, &job).unwrap();
            assert_eq!((scene.title.as_str(), !scene.members.is_empty()), ("Mine", true));
            let [low, high] = scene.bounds();
            let [drawn_low, drawn_high] = draft.scene.bounds();
            assert_eq!((low, high), (drawn_low, drawn_high), "{kind}");
            let text = fs::read_to_string(&path).unwrap();
            assert!(text.contains(value) && text.contains("// "), "{text}");
            assert!(place.join("evidence.ron").exists());
            // What is there is never written over.
            assert!(draft.write(&place).unwrap_err().to_string().contains("is there already"));
        }
        assert_eq!(fs::read_dir(folder.path().join("new")).unwrap().count(), 3, "nothing aside");
    }

    #[test]
    fn what_no_scene_may_be_is_refused() {
        let job = Job::default();
        let draft = Draft::new("column", &[], &job).unwrap();
        let why = Draft::new("column", &set(&draft, "width", "-1"), &job).unwrap_err();
        assert!(why.to_string().contains("members[0].body.section"), "{why}");
        assert!(Draft::new("castle", &[], &job).is_err());
    }
}
