//! Small files of the window's own: what it remembers from one session to the next.

use std::{fs, io::Write, path::Path};

use serde::{Serialize, de::DeserializeOwned};

/// A larger file is none of ours.
const LARGEST: u64 = 1 << 20;

/// What a file has; none where it is missing or broken.
pub(crate) fn read<T: DeserializeOwned>(file: &Path) -> Option<T> {
    let is_ours = file.metadata().is_ok_and(|m| m.len() < LARGEST);
    let text = is_ours.then(|| fs::read_to_string(file).ok()).flatten()?;
    serde_json::from_str(&text).ok()
}

/// Writes it, whole or not at all. Not being able to is no reason to trouble anybody: the log of the
/// program says that `what` ("the layout was") could not be written.
pub(crate) fn write(file: &Path, what: &str, kept: &impl Serialize) {
    if let Err(error) = try_write(file, kept) {
        tracing::warn!("{what} not written to {}: {error}", file.display());
    }
}

fn try_write(file: &Path, kept: &impl Serialize) -> std::io::Result<()> {
    fs::create_dir_all(file.parent().unwrap_or(Path::new(".")))?;
    let text = serde_json::to_string_pretty(kept)?;
    intrados_stage::file::put(file, |out| out.write_all(text.as_bytes()))
}
