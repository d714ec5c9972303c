//! Files that were opened lately.

use std::path::{Path, PathBuf};

use bevy_ecs::resource::Resource;

use crate::kept;

/// How many are remembered.
const MOST: usize = 10;

/// Files that were opened lately, newest first.
#[derive(Resource, Debug, Default)]
pub(crate) struct Recent {
    list: Vec<PathBuf>,
    file: Option<PathBuf>,
}

impl Recent {
    /// Reads the list; a file that is missing or broken is an empty list.
    pub(crate) fn read(file: Option<PathBuf>) -> Self {
        let mut list: Vec<PathBuf> = file.as_deref().and_then(kept::read).unwrap_or_default();
        list.truncate(MOST);
        Self { list, file }
    }

    pub(crate) fn list(&self) -> &[PathBuf] {
        &self.list
    }

    /// Puts `path` first.
    pub(crate) fn remember(&mut self, path: &Path) {
        // Relative paths mean something else tomorrow.
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        self.list.retain(|p| *p != path);
        self.list.insert(0, path);
        self.list.truncate(MOST);
        self.write();
    }

    pub(crate) fn forget(&mut self, path: &Path) {
        self.list.retain(|p| p != path);
        self.write();
    }

    fn write(&self) {
        if let Some(file) = &self.file {
            kept::write(file, "the list of recent files was", &self.list);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_comes_back_newest_first() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("deep/recent.json");
        let mut recent = Recent::read(Some(file.clone()));
        for k in 0..12 {
            recent.remember(Path::new(&format!("/a/{k}.ron")));
        }
        recent.remember(Path::new("/a/5.ron"));
        recent.forget(Path::new("/a/11.ron"));
        let again = Recent::read(Some(file));
        assert_eq!(again.list.len(), 9);
        assert_eq!(again.list[0], Path::new("/a/5.ron"));
        assert_eq!(again.list[1], Path::new("/a/10.ron"));
    }

    #[test]
    fn a_broken_list_is_an_empty_one() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("recent.json");
        std::fs::write(&file, "[1, {").unwrap();
        assert!(Recent::read(Some(file)).list().is_empty());
        assert!(Recent::read(Some(folder.path().join("none.json"))).list().is_empty());
    }
}
