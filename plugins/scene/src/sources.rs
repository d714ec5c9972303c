//! The files that a scene is made of and that are read again later: whether they still say what was
//! hashed.

use std::{
    fs::Metadata,
    io::Read,
    path::{Path, PathBuf},
    sync::Arc,
    time::SystemTime,
};

use intrados_stage::{Cancelled, Job, access};

/// Files that a scene names, as they were when it was loaded.
#[derive(Debug, Clone, Default)]
pub struct SourceFiles(Arc<Vec<SourceFile>>);

/// A file as it was.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SourceFile {
    pub(crate) path: PathBuf,
    stamp: FileStamp,
    pub(crate) hash: blake3::Hash,
}

/// What tells, without reading it, that a file is the same.
#[derive(Debug, Clone, PartialEq)]
struct FileStamp {
    length: u64,
    modified: Option<SystemTime>,
    /// Another file in its place has another number.
    number: u64,
}

impl FileStamp {
    fn of(facts: &Metadata) -> Self {
        #[cfg(unix)]
        let number = std::os::unix::fs::MetadataExt::ino(facts);
        #[cfg(not(unix))]
        let number = 0;
        Self { length: facts.len(), modified: facts.modified().ok(), number }
    }
}

impl SourceFile {
    pub(crate) fn new(path: &Path, facts: &Metadata, hash: blake3::Hash) -> Self {
        Self { path: path.to_owned(), stamp: FileStamp::of(facts), hash }
    }

    fn is_same(&self, job: &Job) -> Result<bool, Cancelled> {
        if std::fs::metadata(&self.path).is_ok_and(|facts| FileStamp::of(&facts) == self.stamp) {
            return Ok(true);
        }
        // It may have been copied back, or only touched.
        let Ok((file, _)) = access::open(&self.path) else { return Ok(false) };
        hash_of(file, job).map(|hash| hash.is_ok_and(|hash| hash == self.hash))
    }
}

impl SourceFiles {
    pub(crate) fn new(files: Vec<SourceFile>) -> Self {
        Self(Arc::new(files))
    }

    /// The first file that is gone, or says something else than when the scene was loaded.
    ///
    /// # Errors
    /// The job was cancelled.
    pub fn first_changed(&self, job: &Job) -> Result<Option<&Path>, Cancelled> {
        for file in self.0.iter() {
            if !file.is_same(job)? {
                return Ok(Some(&file.path));
            }
        }
        Ok(None)
    }
}

/// BLAKE3 of what is read to the end.
pub(crate) fn hash_of(
    mut file: impl Read,
    job: &Job,
) -> Result<std::io::Result<blake3::Hash>, Cancelled> {
    let mut hasher = blake3::Hasher::new();
    let mut buffer = vec![0; 1 << 20];
    loop {
        job.check()?;
        match file.read(&mut buffer) {
            Err(why) => return Ok(Err(why)),
            Ok(0) => return Ok(Ok(hasher.finalize())),
            Ok(n) => hasher.update(buffer.get(..n).unwrap_or_default()),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_was_changed_or_is_gone_is_told_and_one_that_was_touched_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("slice.tif");
        std::fs::write(&path, "as it was").unwrap();
        let facts = std::fs::metadata(&path).unwrap();
        let files =
            SourceFiles::new(vec![SourceFile::new(&path, &facts, blake3::hash(b"as it was"))]);
        let job = Job::default();
        let changed = || files.first_changed(&job).unwrap().map(Path::to_owned);
        assert_eq!(changed(), None);
        std::fs::write(&path, "as it is!").unwrap();
        assert_eq!(changed(), Some(path.clone()));
        std::fs::remove_file(&path).unwrap();
        assert_eq!(changed(), Some(path.clone()));
        std::fs::write(&path, "as it was").unwrap();
        assert_eq!(changed(), None);
        std::fs::remove_file(&path).unwrap();
        std::fs::create_dir(&path).unwrap();
        assert_eq!(changed(), Some(path));
    }
}
