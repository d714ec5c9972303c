//! What leaves the program: data on stdout, files through a temporary file beside their place.

use std::{
    fmt::Debug,
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use intrados_stage::file::{self, Set};
use serde::Serialize;

use crate::{
    args::Format,
    console::{printable, printable_json},
    failure::Failure,
    session::{Listener, Session},
};

impl Session {
    /// Gives the result of a command to whoever listens: JSON as it is, or the table made of it.
    pub(crate) fn print(
        &self,
        result: &impl Serialize,
        table: impl FnOnce() -> String,
    ) -> Result<(), Failure> {
        match (&self.listener, self.format) {
            (Listener::Files, _) => Ok(()),
            (Listener::Caller(answer), _) => {
                *answer.lock().unwrap_or_else(PoisonError::into_inner) = json(result)?;
                Ok(())
            }
            (Listener::User, Format::Table) => say(&printable(&table())),
            (Listener::User, Format::Json) => say(&printable_json(&json(result)?)),
        }
    }
}

/// Prints a text as it is.
pub(crate) fn say(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out
        .write_all(text.as_bytes())
        .and_then(|()| if text.ends_with('\n') { Ok(()) } else { out.write_all(b"\n") })
        .and_then(|()| out.flush())
    {
        // `intrados … | head` is no error.
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::CannotWrite(format!("cannot write to standard output: {e}")))
        }
        _ => Ok(()),
    }
}

/// Indented JSON.
pub(crate) fn json(result: &impl Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(result)
        .map_err(|e| Failure::Internal(format!("cannot make JSON: {e}")))
}

/// Makes a folder, and those above it.
pub(crate) fn folder(path: &Path) -> Result<(), Failure> {
    fs::create_dir_all(path).map_err(|e| Failure::cannot_write(path, e))
}

/// Finds out before the work whether files can be written into a folder. What is made of it for
/// that goes again where it is empty.
pub(crate) fn may_begin(folder: &Path) -> Result<(), Failure> {
    begin(folder).map(drop)
}

/// A folder within another one, in which files may be written: what a link leads to elsewhere is
/// another's.
pub(crate) fn inner(folder: &Path, name: impl AsRef<Path>) -> Result<PathBuf, Failure> {
    let refused = |e: io::Error| Failure::cannot_write(&folder.join(name.as_ref()), e);
    let place = file::within(folder, name.as_ref()).map_err(refused)?;
    file::within(folder, name.as_ref().join("any")).map_err(refused)?;
    Ok(place)
}

/// Writes a file beside its place and moves it there, so that nobody ever sees half of it.
pub(crate) fn put(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    file::put(path, |out| out.write_all(bytes)).map_err(|e| Failure::cannot_write(path, e))
}

/// Begins the files that a command writes into a folder, which gets all of them at once.
pub(crate) fn begin(folder: &Path) -> Result<Set, Failure> {
    Set::begin(folder).map_err(|e| Failure::cannot_write(folder, e))
}

/// Does work whose finished parts are kept where it is broken off, and begins with those that an
/// earlier run with the same `key` has left. The key names all that the parts depend on. Where the
/// input is refused, nothing is left.
pub(crate) fn in_parts<T>(
    session: &Session,
    folder: &Path,
    key: &impl Debug,
    work: impl FnOnce(&mut Set) -> Result<T, Failure>,
) -> Result<(Set, T), Failure> {
    let (shared, value) =
        in_shared_parts(session, folder, key, |shared| work(&mut locked(shared)))?;
    let set =
        Arc::into_inner(shared).map(|set| set.into_inner().unwrap_or_else(PoisonError::into_inner));
    Ok((set.ok_or_else(|| Failure::Internal("somebody still works on the files".into()))?, value))
}

/// A set of files that work in other threads keeps its parts in.
pub(crate) type Shared = Arc<Mutex<Set>>;

pub(crate) fn locked(shared: &Shared) -> MutexGuard<'_, Set> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// [`in_parts`] for work in other threads.
pub(crate) fn in_shared_parts<T>(
    session: &Session,
    folder: &Path,
    key: &impl Debug,
    work: impl FnOnce(&Shared) -> Result<T, Failure>,
) -> Result<(Shared, T), Failure> {
    // Not the version alone: what another build has made is no part of this one's work.
    let build = std::env::current_exe()
        .and_then(fs::metadata)
        .and_then(|m| Ok((m.len(), m.modified()?)))
        .ok();
    let key = format!("{} {build:?} {key:?}", env!("CARGO_PKG_VERSION"));
    let set = Set::resume(folder, &key).map_err(|e| Failure::cannot_write(folder, e))?;
    let known = set.parts();
    if known > 0 {
        session.note(format_args!(
            "goes on from {known} finished parts that a run left in {}",
            folder.display()
        ));
    }
    let shared = Arc::new(Mutex::new(set));
    match work(&shared) {
        Ok(value) => Ok((shared, value)),
        Err(refused @ (Failure::Usage(_) | Failure::BadInput(_) | Failure::NoInput(_))) => {
            locked(&shared).forget();
            Err(refused)
        }
        // Another program's file does not tell which build of ours is in it.
        Err(broken_off) if session.is_embedded() => {
            locked(&shared).forget();
            Err(broken_off)
        }
        Err(broken_off) => {
            let parts = locked(&shared).parts();
            if parts > 0 {
                session.note(format_args!(
                    "{parts} finished parts are kept in {}: the same command goes on from them",
                    folder.display()
                ));
            } else if matches!(broken_off, Failure::Interrupted) {
                session
                    .note("no part was finished that could be kept: the same command begins anew");
            }
            Err(broken_off)
        }
    }
}

/// What commands do with a set of files.
pub(crate) trait Files: Sized {
    /// Writes a file.
    fn write(&mut self, name: impl Into<String>, bytes: &[u8]) -> Result<(), Failure>;
    /// Paths of all files, the one that lists them last, as the user reads them.
    fn listed(&mut self, list: &str) -> Vec<String>;
    /// Writes the list and gives all files their places.
    fn finish(self, list: &str, content: &impl Serialize) -> Result<(), Failure>;
}

impl Files for Set {
    fn write(&mut self, name: impl Into<String>, bytes: &[u8]) -> Result<(), Failure> {
        let name = name.into();
        let path = self.folder().join(&name);
        self.put(name, bytes).map_err(|e| Failure::cannot_write(&path, e))
    }

    fn listed(&mut self, list: &str) -> Vec<String> {
        self.place(list);
        names(&self.files())
    }

    fn finish(mut self, list: &str, content: &impl Serialize) -> Result<(), Failure> {
        self.write(list, json(content)?.as_bytes())?;
        let folder = self.folder().to_owned();
        self.publish(list).map(drop).map_err(|e| Failure::cannot_write(&folder, e))
    }
}

/// Finds out before the work whether its result can be written.
pub(crate) fn may_write(path: &Path) -> Result<(), Failure> {
    file::Unfinished::begin(path).map(drop).map_err(|e| Failure::cannot_write(path, e))
}

/// Paths as the user reads them.
pub(crate) fn names(files: &[PathBuf]) -> Vec<String> {
    files.iter().map(|f| f.display().to_string()).collect()
}

/// Rows in columns, the first row being the heads. Numbers to the right, words to the left.
pub(crate) fn table(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| {
        rows.iter().filter_map(|r| r.get(c)).map(|s| s.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let is_number = |s: &str| {
        s.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+') && !s.contains(' ')
    };
    let right: Vec<bool> = (0..columns)
        .map(|c| rows.iter().skip(1).filter_map(|r| r.get(c)).all(|s| s.is_empty() || is_number(s)))
        .collect();
    let mut text = String::new();
    for row in rows {
        let mut line = String::new();
        for (c, cell) in row.iter().enumerate() {
            let (width, fill) =
                (widths.get(c).copied().unwrap_or(0), if c == 0 { "" } else { "  " });
            line += fill;
            let pad = " ".repeat(width.saturating_sub(cell.chars().count()));
            line += &if right.get(c) == Some(&true) { pad + cell } else { cell.clone() + &pad };
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}
