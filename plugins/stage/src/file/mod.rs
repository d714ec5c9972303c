//! Files that are there whole or not at all: each is written beside its place and moved there once
//! it is complete; and [`Set`]s of files of which the same is true.

mod aside;
mod inside;
mod lock;
mod names;
mod set;

use std::{
    io::{self, BufWriter, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use tempfile::NamedTempFile;

/// A file could not be written.
#[derive(Debug, thiserror::Error)]
#[error("{path}: cannot write: {source}")]
pub struct WriteError {
    /// The file.
    pub path: PathBuf,
    /// What the system says.
    pub source: io::Error,
}

pub use aside::AsideFolder;
pub use inside::{remove_within, within};
pub use lock::{FileLock, LockState};
use names::hash;
pub use names::{file_name, file_names};
pub use set::Set;

/// A file that is being written. Nothing is to be seen of it before [`Unfinished::finish`], and if
/// that is never called, nothing is left.
#[derive(Debug)]
pub struct Unfinished {
    file: BufWriter<NamedTempFile>,
    path: PathBuf,
}

impl Unfinished {
    /// Begins a file that is to be at `path`; its folder must be there.
    ///
    /// # Errors
    /// `path` is a folder, or its folder cannot be written.
    pub fn begin(path: &Path) -> io::Result<Self> {
        if path.is_dir() {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a folder"));
        }
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let file = tempfile::Builder::new().prefix(".intrados-").tempfile_in(folder)?;
        // Who finds one without its lock knows that its process was killed; some disks have none.
        let _ = file.as_file().try_lock();
        Ok(Self { file: BufWriter::with_capacity(1 << 20, file), path: path.to_owned() })
    }

    /// Puts it in its place, instead of what may be there.
    ///
    /// # Errors
    /// The disk is full, or the place cannot be written.
    pub fn finish(self) -> io::Result<()> {
        let file = self.file.into_inner().map_err(io::IntoInnerError::into_error)?;
        file.as_file().sync_all()?;
        // Temporary files are private; results are as readable as the user's other files.
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            file.as_file().set_permissions(std::fs::Permissions::from_mode(0o644))?;
        }
        file.persist(&self.path).map_err(|e| e.error)?;
        Ok(())
    }
}

impl Write for Unfinished {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for Unfinished {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

/// Puts a whole file into a set.
///
/// # Errors
/// It cannot be written.
pub fn put_into(files: &mut Set, name: &str, bytes: &[u8]) -> Result<(), WriteError> {
    files.put(name, bytes).map_err(|source| WriteError { path: files.folder().join(name), source })
}

/// Writes a whole file.
///
/// # Errors
/// As [`Unfinished::begin`] and [`Unfinished::finish`], and what `write` says; then nothing has
/// changed.
pub fn put(path: &Path, write: impl FnOnce(&mut Unfinished) -> io::Result<()>) -> io::Result<()> {
    let mut file = Unfinished::begin(path)?;
    write(&mut file)?;
    file.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result.txt");
        put(&path, |out| out.write_all(b"first")).unwrap();
        let broken = put(&path, |out| {
            out.write_all(b"half of the sec")?;
            Err(io::Error::other("the power failed"))
        });
        assert_eq!(broken.unwrap_err().to_string(), "the power failed");
        assert_eq!(std::fs::read(&path).unwrap(), b"first");
        put(&path, |out| {
            out.write_all(b"SECOND")?;
            out.seek(SeekFrom::Start(1))?;
            out.write_all(b"econd")
        })
        .unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"Second");
        // Nothing else is left in the folder.
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    /// Fails at a write, as a disk does that is full.
    struct Failing<'a> {
        out: &'a mut Unfinished,
        left: usize,
    }

    impl Write for Failing<'_> {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.left = self.left.checked_sub(1).ok_or(io::ErrorKind::StorageFull)?;
            // One byte a write: callers must go on with what is left.
            self.out.write(bytes.get(..1).unwrap_or_default())
        }

        fn flush(&mut self) -> io::Result<()> {
            self.out.flush()
        }
    }

    #[test]
    fn whichever_write_fails_nothing_has_changed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result.txt");
        put(&path, |out| out.write_all(b"first")).unwrap();
        let text = b"the second";
        for left in 0..text.len() {
            let failed = put(&path, |out| Failing { out, left }.write_all(text)).unwrap_err();
            assert_eq!(failed.kind(), io::ErrorKind::StorageFull);
            assert_eq!(std::fs::read(&path).unwrap(), b"first");
            assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        }
        put(&path, |out| Failing { out, left: text.len() }.write_all(text)).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), text);
    }

    #[test]
    fn a_folder_is_not_overwritten_and_a_missing_one_not_made() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(put(folder.path(), |_| Ok(())).unwrap_err().to_string(), "is a folder");
        let missing = put(&folder.path().join("missing/result.txt"), |_| Ok(())).unwrap_err();
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
    }

    #[cfg(unix)]
    #[test]
    fn others_may_read_it() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result.txt");
        put(&path, |out| out.write_all(b"1")).unwrap();
        assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o644);
    }
}
