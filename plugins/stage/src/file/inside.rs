//! Places within a folder: what somebody sent may hold links that lead out of it, and nothing out of
//! it is ever written or removed.

use std::{
    fs, io,
    path::{Component, Path, PathBuf},
};

/// Where `name` lies in `folder`, so that it may be written or removed: each folder on the way to it
/// lies in `folder` itself, with all links followed. A link in the last place is the entry that is
/// replaced or removed, never what it leads to.
///
/// # Errors
/// The name is absolute, has `..` in it, or leads out of the folder by a link.
pub fn within(folder: &Path, name: impl AsRef<Path>) -> io::Result<PathBuf> {
    let name = name.as_ref();
    let is_plain = |part: Component| matches!(part, Component::Normal(_));
    if name.as_os_str().is_empty() || !name.components().all(is_plain) {
        return Err(leads_out(&folder.join(name)));
    }
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let mut place = folder.to_owned();
    let mut parts = name.components().peekable();
    while let Some(part) = parts.next() {
        place.push(part);
        // Without links nothing leads out, and what is not there yet is made within.
        let is_link = fs::symlink_metadata(&place).is_ok_and(|facts| facts.is_symlink());
        if parts.peek().is_some() && is_link {
            let here = here.canonicalize()?;
            // A link to nothing may lead anywhere.
            if !place.canonicalize().is_ok_and(|place| place.starts_with(&here)) {
                return Err(leads_out(&place));
            }
        }
    }
    Ok(place)
}

fn leads_out(place: &Path) -> io::Error {
    let why = format!(
        "{} leads out of its folder: nothing there is written or removed; put a plain folder in its place",
        place.display()
    );
    io::Error::new(io::ErrorKind::PermissionDenied, why)
}

/// Removes files of a folder, by their names in it, and the folders that are empty then. Of a link
/// the link alone goes.
///
/// # Errors
/// A name leads out of the folder (then nothing is removed), or a file cannot be removed.
pub fn remove_within(folder: &Path, names: &[PathBuf]) -> io::Result<()> {
    let places = names.iter().map(|name| within(folder, name)).collect::<io::Result<Vec<_>>>()?;
    places.iter().try_for_each(fs::remove_file)?;
    for name in names {
        // Folders that hold something else stay.
        for parent in name.ancestors().skip(1).filter(|part| !part.as_os_str().is_empty()) {
            if within(folder, parent).and_then(fs::remove_dir).is_err() {
                break;
            }
        }
    }
    Ok(())
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn nothing_outside_a_folder_is_found_or_removed() {
        let all = tempfile::tempdir().unwrap();
        let (ours, theirs) = (all.path().join("ours"), all.path().join("theirs"));
        fs::create_dir_all(ours.join("real/deep")).unwrap();
        fs::create_dir_all(theirs.join("deep")).unwrap();
        fs::write(theirs.join("deep/file"), "theirs").unwrap();
        symlink(&theirs, ours.join("link")).unwrap();
        symlink(theirs.join("deep/file"), ours.join("real/file")).unwrap();
        symlink(ours.join("real"), ours.join("round")).unwrap();
        symlink("nowhere", ours.join("dangling")).unwrap();
        let out = ["../theirs/deep/file", "/etc/passwd", "link/deep/file", "real/../../x", "", "."];
        for name in out.into_iter().chain(["dangling/file", "link/deep"]) {
            assert!(within(&ours, name).is_err(), "{name}");
            assert!(remove_within(&ours, &[name.into()]).is_err(), "{name}");
        }
        for name in ["new", "new/file", "real/deep/x", "round/deep/x", "link", "dangling"] {
            assert_eq!(within(&ours, name).unwrap(), ours.join(name));
        }
        // One name that leads out keeps the others.
        fs::write(ours.join("real/deep/x"), "ours").unwrap();
        let names = ["real/deep/x".into(), "link/deep/file".into()];
        assert!(remove_within(&ours, &names).is_err() && ours.join("real/deep/x").exists());
        // Of a link the link goes; empty folders go with their last file.
        remove_within(&ours, &["real/file".into(), "real/deep/x".into()]).unwrap();
        assert!(!ours.join("real").exists());
        assert_eq!(fs::read_to_string(theirs.join("deep/file")).unwrap(), "theirs");
    }
}
