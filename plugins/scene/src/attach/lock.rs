//! One writer at a time: commands that change the evidence of a folder wait for each other.

use std::{
    fs::{self, File, TryLockError},
    io,
    path::{Path, PathBuf},
    time::Duration,
};

use intrados_stage::Job;

use super::AttachError;
use crate::LoadError;

/// How often it is tried again.
const PAUSE: Duration = Duration::from_millis(20);
/// Stands in the folder where its handle cannot be locked.
const NAME: &str = ".evidence.lock";

/// Held, nobody else of this program changes what lies in the folder. Gone with its process.
#[derive(Debug)]
pub(super) struct Lock {
    _file: Option<File>,
    /// The file that was made for it.
    made: Option<PathBuf>,
}

impl Lock {
    /// Waits until nobody else has the folder.
    ///
    /// # Errors
    /// The job was cancelled, or nothing can be written there.
    pub(super) fn take(folder: &Path, job: &Job) -> Result<Self, AttachError> {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let (file, made) = match File::open(folder) {
            Ok(file) => (file, None),
            // Some systems open no folders.
            Err(_) => {
                let path = folder.join(NAME);
                let file = File::options().create(true).append(true).open(&path);
                (file.map_err(|e| AttachError::write(folder, &e))?, Some(path))
            }
        };
        loop {
            match file.try_lock() {
                Ok(()) => return Ok(Self { _file: Some(file), made }),
                Err(TryLockError::WouldBlock) => {
                    job.step(0, 0).map_err(LoadError::from)?;
                    std::thread::sleep(PAUSE);
                }
                // Some file systems know no locks: what has changed meanwhile is seen at the end.
                Err(TryLockError::Error(e)) if is_unknown(&e) => {
                    return Ok(Self { _file: None, made });
                }
                Err(TryLockError::Error(e)) => return Err(AttachError::write(folder, &e)),
            }
        }
    }
}

fn is_unknown(error: &io::Error) -> bool {
    use io::ErrorKind as K;
    matches!(error.kind(), K::Unsupported | K::InvalidInput | K::PermissionDenied)
        // ENOLCK and EBADF of shares that are mounted over a network.
        || matches!(error.raw_os_error(), Some(37 | 9))
}

impl Drop for Lock {
    fn drop(&mut self) {
        if let Some(made) = &self.made {
            let _ = fs::remove_file(made);
        }
    }
}
