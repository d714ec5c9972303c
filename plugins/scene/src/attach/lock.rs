//! One writer at a time: commands that change the evidence of a folder wait for each other.

use std::{io, path::Path, time::Duration};

use intrados_stage::{Job, file::FileLock};

use super::AttachError;
use crate::LoadError;

/// How often it is tried again.
const PAUSE: Duration = Duration::from_millis(20);

/// Held, nobody else of this program changes what lies in the folder. Gone with its process.
#[derive(Debug)]
pub(super) struct Lock(#[expect(dead_code, reason = "it is held")] FileLock);

impl Lock {
    /// Waits until nobody else has the folder.
    ///
    /// # Errors
    /// The job was cancelled, or nothing can be written there.
    pub(super) fn take(folder: &Path, job: &Job) -> Result<Self, AttachError> {
        let wait = || {
            std::thread::sleep(PAUSE);
            job.step(0, 0).map_err(|_| io::Error::from(io::ErrorKind::Interrupted))
        };
        FileLock::wait_for_folder(folder, wait).map(Self).map_err(|why| match job.check() {
            Err(cancelled) => LoadError::from(cancelled).into(),
            Ok(()) => AttachError::write(folder, &why),
        })
    }
}
