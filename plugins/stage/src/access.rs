//! What may be opened. A file that the user names may lie anywhere; a file that another file names
//! (a scene's model, a header's voxels) only where that one lies or where the user allows it: what
//! came by mail must not read what it was not sent with. Both must be plain files, since a pipe or
//! a device could keep us waiting for ever, and their size is known before any memory is asked for.

use std::{
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
};

use bevy_ecs::resource::Resource;

/// Why a file is not opened. Each reads on from the file's name.
#[derive(Debug, thiserror::Error)]
pub enum Denied {
    /// It is not there, or may not be read.
    #[error("{}", said(.0))]
    System(#[from] io::Error),
    /// A folder.
    #[error("is a folder: name the file in it")]
    Folder,
    /// A pipe, a socket or a device.
    #[error("is no plain file: pipes and devices are not read")]
    NotPlain,
    /// Longer than what is read of such files, bytes.
    #[error("is longer than {} MiB: make it smaller", .0 >> 20)]
    TooLong(u64),
    /// Outside the folders that may be read; this is the one that it lies in.
    #[error("lies outside the folder of the file that names it: put it there, or allow its folder with --allow {}", .0.display())]
    Outside(PathBuf),
}

fn said(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file: check the path".into(),
        io::ErrorKind::PermissionDenied => "may not be read: check its permissions".into(),
        _ => format!("cannot be read: {error}"),
    }
}

impl Denied {
    /// Whether it is the system that says so: the file is missing, not wrong.
    #[must_use]
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::System(_))
    }
}

/// Opens a plain file that the user names. Gives its length too, bytes.
///
/// # Errors
/// [`Denied`]: it is missing, or no plain file.
pub fn open(path: &Path) -> Result<(File, u64), Denied> {
    // Asked before it is opened: opening a pipe already waits.
    let facts = std::fs::metadata(path)?;
    if facts.is_dir() {
        return Err(Denied::Folder);
    }
    if !facts.is_file() {
        return Err(Denied::NotPlain);
    }
    Ok((File::open(path)?, facts.len()))
}

/// Reads a plain file of at most `limit` bytes that the user names.
///
/// # Errors
/// [`Denied`].
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>, Denied> {
    whole(open(path)?, limit)
}

/// All bytes of an open file, its length looked at first.
fn whole((file, length): (File, u64), limit: u64) -> Result<Vec<u8>, Denied> {
    if length > limit {
        return Err(Denied::TooLong(limit));
    }
    let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or_default());
    // It may grow while it is read, and some files of the system have no length of their own.
    file.take(limit + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit { Err(Denied::TooLong(limit)) } else { Ok(bytes) }
}

/// Where files may lie that other files name: beside these, below the folder in `INTRADOS_DATA`,
/// and in folders that the user allows.
#[derive(Resource, Debug, Clone, Default, PartialEq, Eq)]
pub struct Access {
    allowed: Vec<PathBuf>,
}

impl Access {
    /// With these folders allowed.
    #[must_use]
    pub fn new(allowed: Vec<PathBuf>) -> Self {
        Self { allowed }
    }

    /// Where a file in `folder` may find another one: its place with all links followed.
    ///
    /// # Errors
    /// [`Denied`]: it is missing, or lies elsewhere.
    pub fn find(&self, folder: &Path, path: &Path) -> Result<PathBuf, Denied> {
        let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let place = path.canonicalize()?;
        let data = std::env::var_os("INTRADOS_DATA").filter(|d| !d.is_empty()).map(PathBuf::from);
        let roots = [here]
            .into_iter()
            .chain(data.as_deref())
            .chain(self.allowed.iter().map(PathBuf::as_path));
        let within = |root: &Path| root.canonicalize().is_ok_and(|root| place.starts_with(root));
        match roots.into_iter().any(within) {
            true => Ok(place),
            false if place.is_dir() => Err(Denied::Outside(place)),
            false => Err(Denied::Outside(place.parent().unwrap_or(&place).to_owned())),
        }
    }

    /// Opens a plain file that a file in `folder` names. Gives its length too, bytes.
    ///
    /// # Errors
    /// [`Denied`].
    pub fn open(&self, folder: &Path, path: &Path) -> Result<(File, u64), Denied> {
        open(&self.find(folder, path)?)
    }

    /// Reads a plain file of at most `limit` bytes that a file in `folder` names.
    ///
    /// # Errors
    /// [`Denied`].
    pub fn read(&self, folder: &Path, path: &Path, limit: u64) -> Result<Vec<u8>, Denied> {
        whole(self.open(folder, path)?, limit)
    }

    /// [`Access::read`], the first `length` bytes alone.
    ///
    /// # Errors
    /// [`Denied`].
    pub fn read_start(
        &self,
        folder: &Path,
        path: &Path,
        limit: u64,
        length: u64,
    ) -> Result<Vec<u8>, Denied> {
        let (file, whole_length) = self.open(folder, path)?;
        let length = length.min(whole_length);
        if length > limit {
            return Err(Denied::TooLong(limit));
        }
        let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or_default());
        file.take(length).read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_beside_and_where_it_is_allowed() {
        let (ours, theirs) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let (near, far) = (ours.path().join("near"), theirs.path().join("far"));
        std::fs::write(&near, "near").unwrap();
        std::fs::write(&far, "far").unwrap();
        let strict = Access::default();
        assert_eq!(strict.read(ours.path(), &near, 4).unwrap(), b"near");
        assert!(matches!(strict.read(ours.path(), &near, 3), Err(Denied::TooLong(3))));
        assert!(matches!(strict.open(ours.path(), ours.path()), Err(Denied::Folder)));
        assert!(strict.open(ours.path(), &ours.path().join("none")).unwrap_err().is_missing());
        let refused = strict.open(ours.path(), &far).unwrap_err().to_string();
        assert!(
            refused.contains("--allow")
                && refused.contains(&*theirs.path().canonicalize().unwrap().to_string_lossy()),
            "{refused}"
        );
        // A way round is the same place.
        let round = ours.path().join("..").join(theirs.path().file_name().unwrap()).join("far");
        assert!(matches!(strict.open(ours.path(), &round), Err(Denied::Outside(_))));
        assert_eq!(
            Access::new(vec![theirs.path().into()]).read(ours.path(), &far, 10).unwrap(),
            b"far"
        );
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_pipes_and_devices_refused() {
        let (ours, theirs) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        std::fs::write(theirs.path().join("far"), "far").unwrap();
        let link = ours.path().join("link");
        std::os::unix::fs::symlink(theirs.path().join("far"), &link).unwrap();
        assert!(matches!(Access::default().open(ours.path(), &link), Err(Denied::Outside(_))));
        // The user may name what he likes, if it is a file.
        assert!(open(&link).is_ok());
        assert!(matches!(open(Path::new("/dev/null")), Err(Denied::NotPlain)));
        let pipe = ours.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        assert!(matches!(Access::default().open(ours.path(), &pipe), Err(Denied::NotPlain)));
    }
}
