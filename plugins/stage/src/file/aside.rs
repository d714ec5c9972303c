//! Folders that are made aside and then put in their place.

use std::{fs, io, path::Path};

use tempfile::TempDir;

use super::{FileLock, LockState};

/// Says that a process is at work in a folder that is made aside.
const LOCK: &str = ".lock";

/// A hidden folder beside the place that it is for. Dropped before it is [put there](Self::settle),
/// it is gone; where its process was killed, the next one that begins one beside it removes it.
#[derive(Debug)]
pub struct AsideFolder {
    folder: TempDir,
    lock: FileLock,
}

impl AsideFolder {
    /// Begins one in `folder` whose name begins with `prefix`, and removes those of the same prefix
    /// whose processes are gone.
    ///
    /// # Errors
    /// Nothing can be written there.
    pub fn begin(folder: &Path, prefix: &str) -> io::Result<Self> {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        sweep(folder, prefix);
        let made = tempfile::Builder::new().prefix(prefix).tempdir_in(folder)?;
        match FileLock::take(&made.path().join(LOCK))? {
            LockState::Held(lock) => Ok(Self { folder: made, lock }),
            LockState::Elsewhere => Err(io::Error::from(io::ErrorKind::ResourceBusy)),
        }
    }

    /// Where it is now.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Puts it in its place, as readable as the user's other folders.
    ///
    /// # Errors
    /// The place is taken, or cannot be written.
    pub fn settle(self, place: &Path) -> io::Result<()> {
        let Self { folder, lock } = self;
        drop(lock);
        fs::remove_file(folder.path().join(LOCK))?;
        open_up(folder.path())?;
        fs::rename(folder.path(), place)?;
        // It is where it belongs.
        let _ = folder.keep();
        Ok(())
    }
}

/// Removes folders whose process was killed. A link of such a name is none of ours.
fn sweep(folder: &Path, prefix: &str) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let ours = entries.flatten().filter(|entry| {
        entry.file_name().to_string_lossy().starts_with(prefix)
            && entry.file_type().is_ok_and(|kind| kind.is_dir())
    });
    for entry in ours {
        let place = entry.path();
        match FileLock::take_existing(&place.join(LOCK)) {
            Ok(LockState::Held(_)) => _ = fs::remove_dir_all(&place),
            // Just begun, or killed before it had its lock: then it is empty.
            Err(why) if why.kind() == io::ErrorKind::NotFound => _ = fs::remove_dir(&place),
            Ok(LockState::Elsewhere) | Err(_) => {}
        }
    }
}

/// A temporary folder is its owner's alone.
#[cfg(unix)]
fn open_up(folder: &Path) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(folder, fs::Permissions::from_mode(0o755))
}

#[cfg(not(unix))]
fn open_up(_: &Path) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_process_left_is_removed_and_what_lives_stays() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        // As they are left: empty, and with its lock and files.
        fs::create_dir(at(".x-empty")).unwrap();
        fs::create_dir(at(".x-killed")).unwrap();
        fs::write(at(".x-killed").join(LOCK), "").unwrap();
        fs::write(at(".x-killed/file"), "half").unwrap();
        // What is somebody's own.
        fs::create_dir(at(".x-mine")).unwrap();
        fs::write(at(".x-mine/file"), "mine").unwrap();
        let alive = AsideFolder::begin(folder.path(), ".x-").unwrap();
        fs::write(alive.path().join("file"), "1").unwrap();
        let next = AsideFolder::begin(folder.path(), ".x-").unwrap();
        assert!(!at(".x-empty").exists() && !at(".x-killed").exists());
        assert!(at(".x-mine/file").exists());
        drop(next);
        alive.settle(&at("place")).unwrap();
        let names: Vec<_> = fs::read_dir(at("place")).unwrap().flatten().collect();
        assert_eq!(names.len(), 1);
        assert_eq!(fs::read_to_string(at("place/file")).unwrap(), "1");
    }
}
