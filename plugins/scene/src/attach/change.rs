//! Changes of evidence, and of a scene's file, that can be taken back and made again: the text before and after, and the
//! copies that lay beside the scene in one of the two.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use intrados_stage::{
    Job, access,
    file::{self, remove_within, within},
};
use tempfile::TempDir;

use super::{AttachError, Detached, Project, lock::Lock, text_of, write};

/// A change that was made.
#[derive(Debug)]
pub struct Change {
    folder: PathBuf,
    /// What was written: the evidence, or the scene.
    file: PathBuf,
    /// The text without it and with it; none: there is no file.
    texts: [Option<String>; 2],
    copies: Vec<PathBuf>,
    /// Whether the copies are there with it, or without it.
    adds: bool,
    /// Where the copies lie while they are not there, by their number.
    kept: TempDir,
    is_made: bool,
}

impl Change {
    /// What [`Proposal::commit`](super::Proposal::commit) has made of a project; `copies` are those
    /// that it gave.
    ///
    /// # Errors
    /// The evidence cannot be read again, or nothing can be kept aside.
    pub fn attached(project: &Project, copies: Vec<PathBuf>) -> Result<Self, AttachError> {
        Self::of(project, copies, true, kept(&project.folder)?)
    }

    fn of(
        project: &Project,
        copies: Vec<PathBuf>,
        adds: bool,
        kept: TempDir,
    ) -> Result<Self, AttachError> {
        let file = project.evidence();
        let texts = [project.text.clone(), text_of(&file)?];
        let folder = project.folder.clone();
        Ok(Self { folder, file, texts, copies, adds, kept, is_made: true })
    }

    /// The scene's file was written over: its texts before and after.
    pub(super) fn written(project: &Project, texts: [String; 2]) -> Result<Self, AttachError> {
        let (folder, file) = (project.folder.clone(), project.scene.clone());
        let kept = kept(&folder)?;
        let (texts, copies) = (texts.map(Some), Vec::new());
        Ok(Self { folder, file, texts, copies, adds: true, kept, is_made: true })
    }

    /// Whether it is made now, or taken back.
    #[must_use]
    pub fn is_made(&self) -> bool {
        self.is_made
    }

    /// Takes it back, or makes it again: the file is the same to the byte as it was then.
    ///
    /// # Errors
    /// Somebody has changed the file since, or it cannot be written; then nothing has changed.
    pub fn turn(&mut self, job: &Job) -> Result<(), AttachError> {
        let _lock = Lock::take(&self.folder, job)?;
        let [without, with] = &self.texts;
        let (from, to) = if self.is_made { (with, without) } else { (without, with) };
        if text_of(&self.file)? != *from {
            let why = "has been changed since: what came before that cannot be taken back";
            return Err(AttachError::CannotWrite(format!("{}: {why}", self.file.display())));
        }
        let are_there = self.is_made == self.adds;
        for (number, copy) in self.copies.iter().enumerate() {
            let aside = self.kept.path().join(number.to_string());
            let copy = &inside(copy, &self.folder)?;
            let (from, to) = if are_there { (copy, &aside) } else { (&aside, copy) };
            bring(from, to)?;
        }
        match to {
            Some(text) => write(&self.file, text)?,
            None => fs::remove_file(&self.file).map_err(|e| AttachError::write(&self.file, &e))?,
        }
        self.is_made = !self.is_made;
        if are_there {
            clear(&self.copies, &self.folder)?;
        }
        Ok(())
    }
}

impl Project {
    /// The same as [`Project::detach`], so that it can be taken back.
    ///
    /// # Errors
    /// As of [`Project::detach`], or what is taken away cannot be kept aside.
    pub fn detach_for_now(
        &self,
        member: &str,
        name: &str,
        job: &Job,
    ) -> Result<(Detached, Change), AttachError> {
        let (.., files) = self.find(member, name)?;
        let copies = self.copies(&files, &super::EvidenceFile::default());
        let kept = kept(&self.folder)?;
        for (number, copy) in copies.iter().enumerate() {
            job.step(number, copies.len()).map_err(crate::LoadError::from)?;
            bring(copy, &kept.path().join(number.to_string()))?;
        }
        let detached = self.detach(member, name, job)?;
        let change = Change::of(self, copies, false, kept)?;
        Ok((detached, change))
    }
}

fn kept(folder: &Path) -> Result<TempDir, AttachError> {
    tempfile::tempdir().map_err(|e| AttachError::write(folder, &e))
}

/// A copy's place, which is never outside of the project's folder.
fn inside(copy: &Path, folder: &Path) -> Result<PathBuf, AttachError> {
    let name = copy.strip_prefix(folder).unwrap_or(copy);
    within(folder, name).map_err(|why| AttachError::CannotWrite(why.to_string()))
}

/// Copies a file, its folder with it.
fn bring(from: &Path, to: &Path) -> Result<(), AttachError> {
    let failed = |e: io::Error| AttachError::write(to, &e);
    to.parent().map_or(Ok(()), fs::create_dir_all).map_err(failed)?;
    let (mut file, _) = access::open(from).map_err(|why| AttachError::denied(from, &why))?;
    file::put(to, |out| io::copy(&mut file, out).map(drop)).map_err(failed)
}

/// Removes copies, and the folders that are empty then, below `top`.
pub(super) fn clear(files: &[PathBuf], top: &Path) -> Result<(), AttachError> {
    let name = |file: &PathBuf| file.strip_prefix(top).unwrap_or(file).to_owned();
    let names: Vec<PathBuf> = files.iter().map(name).collect();
    remove_within(top, &names).map_err(|e| AttachError::write(top, &e))
}

#[cfg(test)]
mod tests {
    use intrados_stage::Access;

    use super::*;
    use crate::attach::{Attachment, Finding, What};

    const SCENE: &str = r#"(
    schema: "intrados.scene/1",
    materials: [(name: "concrete", colour: (0.5, 0.5, 0.5))],
    members: [(
        id: "C1", name: "Column 1", at: (0, 0, 0), concrete: "C30/37", material: "concrete",
        body: Column(section: Rectangle(width_m: 0.4, depth_m: 0.4), height_m: 3),
    )],
    lamps: [Environment(name: "sky", radiance: (1, 1, 1))],
    cameras: [(name: "front", position: (2, 2, 5), target: (0, 1, 0), fov_deg: 40, width: 9, height: 9)],
)"#;

    /// All files of a folder with their bytes.
    fn all(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
        let mut files = Vec::new();
        let mut todo = vec![folder.to_owned()];
        while let Some(folder) = todo.pop() {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                match path.is_dir() {
                    true => todo.push(path),
                    false => files.push((path.clone(), fs::read(path).unwrap())),
                }
            }
        }
        files.sort();
        files
    }

    fn spall(picture: PathBuf) -> Attachment {
        let what = What::Finding(Finding::Rust { area_m2: 0.02 });
        Attachment {
            member: "C1".into(),
            name: Some("stain".into()),
            date: None,
            along: Some([0.4, 0.5]),
            face: None,
            angle_deg: None,
            height_m: None,
            instrument: None,
            picture: Some(picture),
            confirmed: false,
            what,
        }
    }

    #[test]
    fn what_is_taken_back_was_never_there_and_comes_again() {
        let folder = tempfile::tempdir().unwrap();
        let project = folder.path().join("bridge");
        fs::create_dir(&project).unwrap();
        fs::write(project.join("scene.ron"), SCENE).unwrap();
        let picture = folder.path().join("stain.png");
        image::GrayImage::new(4, 4).save(&picture).unwrap();
        let (access, job) = (Access::default(), Job::default());
        let untouched = all(&project);
        let open = || Project::edit(&project, &access, &job).unwrap();
        let mut attached = {
            let project = open();
            let copies = project.propose(&spall(picture), &job).unwrap().commit().unwrap();
            assert_eq!(copies.len(), 1);
            Change::attached(&project, copies).unwrap()
        };
        let with = all(&project);
        assert_eq!(with.len(), 3);
        attached.turn(&job).unwrap();
        assert_eq!(all(&project), untouched);
        assert!(!project.join("evidence").exists());
        attached.turn(&job).unwrap();
        assert_eq!(all(&project), with);
        let (_, mut detached) = open().detach_for_now("C1", "stain", &job).unwrap();
        let without = all(&project);
        assert_eq!(without.len(), 2, "the evidence without an item, and no copy");
        detached.turn(&job).unwrap();
        assert_eq!(all(&project), with);
        detached.turn(&job).unwrap();
        assert_eq!(all(&project), without);
        // What somebody else has written is not thrown away.
        let evidence = project.join("evidence.ron");
        let text = fs::read_to_string(&evidence).unwrap() + "// mine\n";
        fs::write(&evidence, &text).unwrap();
        let why = detached.turn(&job).unwrap_err().to_string();
        assert!(why.contains("has been changed since"), "{why}");
        assert_eq!(fs::read_to_string(&evidence).unwrap(), text);
    }
}
