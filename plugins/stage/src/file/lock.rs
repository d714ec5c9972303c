//! Locks between processes: a plain file that one of them has at a time.

use std::{
    fs::{self, File, OpenOptions, TryLockError},
    io,
    path::Path,
};

/// Stands for a folder whose handle cannot be locked.
const FOLDER: &str = ".intrados-lock";

/// A lock that this process holds, until it is dropped.
#[derive(Debug)]
pub struct FileLock {
    /// `None` where the disk knows no locks, as some in networks do.
    _file: Option<File>,
}

/// What became of an attempt to take a lock.
#[derive(Debug)]
pub enum LockState {
    /// This process holds it now.
    Held(FileLock),
    /// Another process holds it.
    Elsewhere,
}

impl FileLock {
    /// Takes the lock in the file `path`, which is made where there is none, unless another process
    /// has it. What lies there is neither read nor changed.
    ///
    /// # Errors
    /// The file is no plain one (a link, a pipe, a device), or cannot be opened.
    pub fn take(path: &Path) -> io::Result<LockState> {
        let mut options = OpenOptions::new();
        options.write(true).create(true).truncate(false);
        Self::of(open_plain(path, &mut options)?)
    }

    /// The same where the file is there already.
    ///
    /// # Errors
    /// As of [`Self::take`], or it is not there.
    pub fn take_existing(path: &Path) -> io::Result<LockState> {
        Self::of(open_plain(path, OpenOptions::new().read(true))?)
    }

    /// Waits for the lock of a folder, which leaves nothing in it; `pause` is called while another
    /// process has it, and may give up.
    ///
    /// # Errors
    /// The folder cannot be opened, or what `pause` says.
    pub fn wait_for_folder(
        folder: &Path,
        mut pause: impl FnMut() -> io::Result<()>,
    ) -> io::Result<Self> {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        loop {
            let state = match File::open(folder) {
                Ok(handle) => Self::of(handle)?,
                // Some systems open no folders.
                Err(_) => Self::take(&folder.join(FOLDER))?,
            };
            match state {
                LockState::Held(lock) => return Ok(lock),
                LockState::Elsewhere => pause()?,
            }
        }
    }

    fn of(file: File) -> io::Result<LockState> {
        Ok(match file.try_lock() {
            Ok(()) => LockState::Held(Self { _file: Some(file) }),
            Err(TryLockError::WouldBlock) => LockState::Elsewhere,
            Err(TryLockError::Error(_)) => LockState::Held(Self { _file: None }),
        })
    }
}

/// Opens a plain file and no link: opening a pipe waits, and what is behind a link is another's.
fn open_plain(path: &Path, options: &mut OpenOptions) -> io::Result<File> {
    let refused = || {
        let why = format!("{} is no plain file: remove it", path.display());
        io::Error::new(io::ErrorKind::InvalidInput, why)
    };
    if fs::symlink_metadata(path).is_ok_and(|facts| !facts.is_file()) {
        return Err(refused());
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        let flags = rustix::fs::OFlags::NOFOLLOW | rustix::fs::OFlags::NONBLOCK;
        options.custom_flags(flags.bits().cast_signed());
    }
    let file = options.open(path)?;
    if file.metadata()?.is_file() { Ok(file) } else { Err(refused()) }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_lock_is_a_plain_file_and_changes_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("theirs"), "kept").unwrap();
        std::os::unix::fs::symlink(at("theirs"), at("link")).unwrap();
        std::os::unix::fs::symlink(at("nowhere"), at("dangling")).unwrap();
        fs::create_dir(at("folder")).unwrap();
        assert!(std::process::Command::new("mkfifo").arg(at("pipe")).status().unwrap().success());
        for name in ["link", "dangling", "folder", "pipe"] {
            let why = FileLock::take(&at(name)).unwrap_err().to_string();
            assert!(why.contains("is no plain file: remove it"), "{name}: {why}");
            assert!(FileLock::take_existing(&at(name)).is_err(), "{name}");
        }
        assert!(!at("nowhere").exists());
        let held = FileLock::take(&at("theirs")).unwrap();
        assert!(matches!(FileLock::take(&at("theirs")).unwrap(), LockState::Elsewhere));
        drop(held);
        assert!(matches!(FileLock::take_existing(&at("theirs")).unwrap(), LockState::Held(_)));
        assert_eq!(fs::read_to_string(at("theirs")).unwrap(), "kept");
    }
}
