//! Files that belong together, and the finished parts of the work that makes them.

use std::{
    fs,
    io::{self, Write},
    path::{Component, Path, PathBuf},
    time::{Duration, Instant},
};

use serde::{Serialize, de::DeserializeOwned};

use super::{FileLock, LockState, hash, put, within};
use crate::access;

/// Files that belong together, on their way into a folder; one of them is the *list*, which names
/// the others.
///
/// All are written aside, in a hidden folder within the folder (the same disk), and nothing is to
/// be seen of them before [`Set::publish`]. That withdraws the list of an older set, moves the new
/// files to their places and the new list last. So at every moment, however the program ends, **a
/// list that is there names files of one and the same run**. What else lies in the folder is left
/// alone.
///
/// A set with a key also keeps the finished parts of the work ([`Set::part`]): where it ends before
/// it is published, the next one of the same key takes them up.
#[derive(Debug)]
pub struct Set {
    folder: PathBuf,
    aside: PathBuf,
    /// Held while somebody works aside.
    lock: Option<FileLock>,
    /// Folders that were made for it, the outermost first.
    made: Vec<PathBuf>,
    names: Vec<String>,
}

/// A finished part on disk, as RON: it keeps every bit of a float, those that are no numbers too.
#[derive(Serialize, serde::Deserialize)]
struct Part<T> {
    name: String,
    files: Vec<String>,
    value: T,
}

/// Beginning of the names of hidden folders without a key.
const NAMELESS: &str = ".intrados-set-";
const LOCK: &str = ".lock";
const PARTS: &str = ".parts";
/// Beginning of the names of all hidden folders.
const HIDDEN: &str = ".intrados-";
/// Publishing is a few renames: a run that takes longer has stopped.
const PATIENCE: Duration = Duration::from_secs(60);
/// Between two looks at whether another run has published.
const PAUSE: Duration = Duration::from_millis(10);
/// Longest record of a finished part, bytes.
const LONGEST: u64 = 4 << 30;

impl Set {
    /// Begins a set in `folder`, which need not be there yet.
    ///
    /// # Errors
    /// Nothing can be written there.
    pub fn begin(folder: &Path) -> io::Result<Self> {
        let made = make(folder)?;
        sweep(folder);
        let begin = || {
            Self::lock(
                folder,
                tempfile::Builder::new().prefix(NAMELESS).tempdir_in(folder)?.keep(),
                made.clone(),
            )
        };
        // Another run may have swept it away while it was empty.
        begin().or_else(|_| begin())
    }

    /// Begins a set that goes on from an earlier one of the same key, if that ended before it was
    /// published. The key says all that its files depend on.
    ///
    /// # Errors
    /// Nothing can be written there, or another run whose parts are kept there is at work.
    pub fn resume(folder: &Path, key: &str) -> io::Result<Self> {
        let made = make(folder)?;
        sweep(folder);
        let name = format!("{HIDDEN}{:016x}", hash(key));
        if is_taken(folder, &name) {
            let why = "another run is at work there: wait for it, or name another folder";
            return Err(io::Error::new(io::ErrorKind::ResourceBusy, why));
        }
        let aside = folder.join(&name);
        // A link would have the parts written elsewhere.
        if fs::symlink_metadata(&aside).is_ok_and(|facts| !facts.is_dir()) {
            fs::remove_file(&aside)?;
        }
        fs::create_dir_all(within(folder, Path::new(&name).join(PARTS))?)?;
        within(&aside, Path::new(PARTS).join("any"))?;
        Self::lock(folder, aside, made)
    }

    fn lock(folder: &Path, aside: PathBuf, made: Vec<PathBuf>) -> io::Result<Self> {
        match FileLock::take(&aside.join(LOCK))? {
            LockState::Held(lock) => {
                let folder = folder.to_owned();
                Ok(Self { folder, aside, lock: Some(lock), made, names: Vec::new() })
            }
            LockState::Elsewhere => {
                let why = "another run is writing the same there";
                Err(io::Error::new(io::ErrorKind::ResourceBusy, why))
            }
        }
    }

    /// Where its files will be.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Where to write the file `name` now.
    pub fn place(&mut self, name: impl Into<String>) -> PathBuf {
        let name = name.into();
        let place = self.aside.join(&name);
        if !self.names.contains(&name) {
            self.names.push(name);
        }
        place
    }

    /// Writes the file `name`.
    ///
    /// # Errors
    /// As [`put`].
    pub fn put(&mut self, name: impl Into<String>, bytes: &[u8]) -> io::Result<()> {
        put(&self.place(name), |out| out.write_all(bytes))
    }

    /// Where the files will be, in the order in which they were begun.
    #[must_use]
    pub fn files(&self) -> Vec<PathBuf> {
        self.names.iter().map(|name| self.folder.join(name)).collect()
    }

    /// Puts what is written of its files into another set, too.
    ///
    /// # Errors
    /// They cannot be read, or the other's cannot be written.
    pub fn copy_into(&self, other: &mut Self) -> io::Result<()> {
        for name in self.names.iter().filter(|name| self.aside.join(name).is_file()) {
            let (from, to) = (self.aside.join(name), other.place(name.as_str()));
            // Files are replaced and never written into: a link is as good as a copy, and at once.
            fs::hard_link(&from, &to).or_else(|_| fs::copy(&from, &to).map(drop))?;
        }
        Ok(())
    }

    /// How many finished parts of the work are kept.
    #[must_use]
    pub fn parts(&self) -> usize {
        fs::read_dir(self.aside.join(PARTS)).map_or(0, |parts| {
            parts.flatten().filter(|p| p.path().extension().is_some_and(|e| e == "ron")).count()
        })
    }

    /// The value of the part `name` of the work and its files: what an earlier run has finished, or
    /// what `work` makes now.
    ///
    /// # Errors
    /// What `work` says. That a finished part cannot be kept is none: it would be done again.
    pub fn part<T: Serialize + DeserializeOwned, E>(
        &mut self,
        name: &str,
        work: impl FnOnce(&mut Self) -> Result<T, E>,
    ) -> Result<T, E> {
        if let Some(value) = self.recall(name) {
            return Ok(value);
        }
        let before = self.names.len();
        let value = work(self)?;
        let files = self.names[before..].to_vec();
        self.keep(name, files, &value);
        Ok(value)
    }

    /// The value of a part that is finished, and its files.
    pub fn recall<T: DeserializeOwned>(&mut self, name: &str) -> Option<T> {
        let bytes = access::read(&self.record(name), LONGEST).ok()?;
        let text = std::str::from_utf8(&bytes).ok()?;
        // What is damaged is done again: its value need not be one that the work could have made.
        let (sum, text) = text.split_once('\n')?;
        if sum != format!("{:016x}", hash(text)) {
            return None;
        }
        let part = ron::from_str::<Part<T>>(text).ok()?;
        let is_own = |file: &String| {
            let place = within(&self.aside, file);
            is_plain(file) && place.is_ok_and(|place| is_regular(&place))
        };
        if part.name != name || !part.files.iter().all(is_own) {
            return None;
        }
        part.files.into_iter().for_each(|file| _ = self.place(file));
        Some(part.value)
    }

    /// Keeps the value of a finished part, instead of an older one, and says which files are its
    /// own. Where it cannot be kept it is done again.
    pub fn keep(&self, name: &str, files: Vec<String>, value: &impl Serialize) {
        let part = Part { name: name.to_owned(), files, value };
        let text = ron::to_string(&part).map_err(io::Error::other);
        let sealed = text.map(|text| format!("{:016x}\n{text}", hash(&text)));
        let _ = sealed.and_then(|all| put(&self.record(name), |out| out.write_all(all.as_bytes())));
    }

    fn record(&self, name: &str) -> PathBuf {
        self.aside.join(PARTS).join(format!("{:016x}.ron", hash(name)))
    }

    /// Gives the files their places; `list` is the one that names the others. Runs that publish
    /// into one folder do so one after the other, each whole.
    ///
    /// # Errors
    /// A place is taken by a folder, leads out of the folder by a link, or cannot be written.
    pub fn publish(mut self, list: &str) -> io::Result<Vec<PathBuf>> {
        for name in &self.names {
            within(&self.folder, name)?;
        }
        let since = Instant::now();
        let lock = FileLock::wait_for_folder(&self.folder, || {
            if since.elapsed() > PATIENCE {
                let why = "another run has been writing there for a minute: end it, or name another folder";
                return Err(io::Error::new(io::ErrorKind::ResourceBusy, why));
            }
            std::thread::sleep(PAUSE);
            Ok(())
        })?;
        if let Some(taken) = self.files().into_iter().find(|path| path.is_dir()) {
            return Err(io::Error::new(
                io::ErrorKind::IsADirectory,
                format!("{} is a folder", taken.display()),
            ));
        }
        for [from, to] in self.moves(list) {
            fs::rename(from, to)?;
        }
        let files = self.files();
        self.forget();
        drop(lock);
        Ok(files)
    }

    /// Takes back what was made, so that nothing is left of it.
    pub fn forget(&mut self) {
        self.lock = None;
        let _ = fs::remove_dir_all(&self.aside);
    }

    /// What publishing moves, one after the other.
    fn moves(&self, list: &str) -> Vec<[PathBuf; 2]> {
        let place = |name: &str| self.folder.join(name);
        let withdrawn = place(list).is_file().then(|| [place(list), self.aside.join(".withdrawn")]);
        let others = self.names.iter().filter(|name| *name != list);
        let moved = others
            .map(String::as_str)
            .chain([list])
            .map(|name| [self.aside.join(name), place(name)]);
        withdrawn.into_iter().chain(moved).collect()
    }
}

impl Drop for Set {
    fn drop(&mut self) {
        // Parts may be those of an earlier run that this one did not come to.
        if self.parts() == 0 {
            self.forget();
            // Only those that are empty go.
            self.made.iter().rev().for_each(|folder| _ = fs::remove_dir(folder));
        }
    }
}

/// Whether a name is that of a file in the folder itself, and leads nowhere else.
fn is_plain(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    matches!((parts.next(), parts.next()), (Some(Component::Normal(_)), None))
}

/// Makes a folder and those above it; names those that were not there.
fn make(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let missing = |path: &&Path| !path.as_os_str().is_empty() && !path.exists();
    let mut made: Vec<PathBuf> =
        folder.ancestors().take_while(missing).map(Path::to_owned).collect();
    made.reverse();
    fs::create_dir_all(folder)?;
    Ok(made)
}

/// A file, and no link to one.
fn is_regular(place: &Path) -> bool {
    fs::symlink_metadata(place).is_ok_and(|facts| facts.is_file())
}

/// Whether another run keeps its parts in the folder now, under another name than this.
fn is_taken(folder: &Path, name: &str) -> bool {
    let Ok(entries) = fs::read_dir(folder) else { return false };
    let others = entries.flatten().filter(|entry| {
        let theirs = entry.file_name();
        let theirs = theirs.to_string_lossy();
        theirs.starts_with(HIDDEN) && !theirs.starts_with(NAMELESS) && theirs != name
    });
    let mut locks = others.map(|entry| entry.path().join(LOCK));
    locks.any(|lock| matches!(FileLock::take_existing(&lock), Ok(LockState::Elsewhere)))
}

/// Removes a file that was being written when its process was killed. What is younger than a minute
/// may not have its lock yet.
fn sweep_file(entry: &fs::DirEntry) {
    let is_old = || entry.metadata().ok()?.modified().ok()?.elapsed().ok();
    let is_ours = entry.file_name().to_string_lossy().starts_with(HIDDEN)
        && entry.file_type().is_ok_and(|kind| kind.is_file());
    if is_ours
        && is_old().is_some_and(|age| age > PATIENCE)
        && matches!(FileLock::take_existing(&entry.path()), Ok(LockState::Held(_)))
    {
        let _ = fs::remove_file(entry.path());
    }
}

/// Removes what runs without a key left that were killed, and files that never came to their place.
fn sweep(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let entries = entries.inspect(|entry| entry.as_ref().map_or((), sweep_file));
    for entry in
        entries.flatten().filter(|entry| entry.file_name().to_string_lossy().starts_with(NAMELESS))
    {
        // Without a lock it is just being begun, or was killed then.
        let _ = fs::remove_dir(entry.path());
        // Whoever begins makes the lock before all else: what has files and no lock was killed while
        // it was being removed.
        let is_dead = match FileLock::take_existing(&entry.path().join(LOCK)) {
            Ok(state) => matches!(state, LockState::Held(_)),
            Err(why) => why.kind() == io::ErrorKind::NotFound,
        };
        if is_dead {
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> = fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    fn write(set: &mut Set, run: &str) {
        set.put("a.txt", run.as_bytes()).unwrap();
        set.put("b.txt", run.as_bytes()).unwrap();
        set.put("list.json", run.as_bytes()).unwrap();
    }

    /// However far a second run comes, a list that is there names files of one run, and what else
    /// lies there is untouched; the next run makes it whole.
    #[test]
    fn a_list_names_files_of_one_run() {
        for steps in 0..=4 {
            let folder = tempfile::tempdir().unwrap();
            let read = |name: &str| fs::read_to_string(folder.path().join(name)).ok();
            fs::write(folder.path().join("mine.txt"), "mine").unwrap();
            let mut first = Set::begin(folder.path()).unwrap();
            write(&mut first, "first");
            first.publish("list.json").unwrap();
            assert_eq!(names(folder.path()), ["a.txt", "b.txt", "list.json", "mine.txt"]);

            let mut second = Set::resume(folder.path(), "key").unwrap();
            write(&mut second, "second");
            let moves = second.moves("list.json");
            assert_eq!(moves.len(), 4);
            for [from, to] in moves.into_iter().take(steps) {
                fs::rename(from, to).unwrap();
            }
            if let Some(list) = read("list.json") {
                assert_eq!(
                    [read("a.txt"), read("b.txt")],
                    [Some(list.clone()), Some(list)],
                    "after {steps}"
                );
            }
            // As if killed: nothing is tidied up.
            second.lock = None;
            std::mem::forget(second);

            let mut third = Set::resume(folder.path(), "key").unwrap();
            write(&mut third, "third");
            third.publish("list.json").unwrap();
            assert_eq!(
                ["a.txt", "b.txt", "list.json", "mine.txt"].map(read),
                ["third", "third", "third", "mine"].map(|t| Some(t.to_owned()))
            );
            assert_eq!(names(folder.path()), ["a.txt", "b.txt", "list.json", "mine.txt"]);
        }
    }

    #[test]
    fn what_is_not_published_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let deep = folder.path().join("new/deep");
        let mut set = Set::begin(&deep).unwrap();
        write(&mut set, "run");
        drop(set);
        assert_eq!(names(folder.path()), [""; 0]);
        // A run that was killed is swept up by the next one; one that is alive is not.
        let alive = Set::begin(folder.path()).unwrap();
        let mut killed = Set::begin(folder.path()).unwrap();
        killed.lock = None;
        std::mem::forget(killed);
        fs::create_dir(folder.path().join(format!("{NAMELESS}at-its-beginning"))).unwrap();
        let at_its_end = folder.path().join(format!("{NAMELESS}at-its-end"));
        fs::create_dir(&at_its_end).unwrap();
        fs::write(at_its_end.join(".withdrawn"), "{}").unwrap();
        let mut next = Set::begin(folder.path()).unwrap();
        assert_eq!(names(folder.path()).len(), 2);
        write(&mut next, "next");
        fs::create_dir(folder.path().join("b.txt")).unwrap();
        assert!(next.publish("list.json").unwrap_err().to_string().ends_with("b.txt is a folder"));
        assert!(!folder.path().join("a.txt").exists());
        drop(alive);
        assert_eq!(names(folder.path()), ["b.txt"]);
    }

    /// What is written so far can be published apart, and the set goes on.
    #[test]
    fn what_is_written_so_far_can_be_published_apart() {
        let folder = tempfile::tempdir().unwrap();
        let mut set = Set::begin(folder.path()).unwrap();
        set.put("a.txt", b"first").unwrap();
        set.place("b.txt");
        let mut apart = Set::begin(&folder.path().join("apart")).unwrap();
        set.copy_into(&mut apart).unwrap();
        apart.put("list.json", b"{}").unwrap();
        apart.publish("list.json").unwrap();
        assert_eq!(names(&folder.path().join("apart")), ["a.txt", "list.json"]);
        write(&mut set, "second");
        set.publish("list.json").unwrap();
        let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
        assert_eq!([read("a.txt"), read("apart/a.txt")], ["second", "first"]);
    }

    /// Parts of an unpublished set are there for the next one of the same key, bit by bit; those
    /// whose files are gone are done again.
    #[test]
    fn finished_parts_are_taken_up() {
        let folder = tempfile::tempdir().unwrap();
        let values = [0.1 + 0.2, f64::NAN, f64::INFINITY, -0.0];
        let work = |set: &mut Set, name: &str| -> ([f64; 4], bool) {
            let mut done = false;
            let value = set.part(name, |set| {
                done = true;
                set.put(format!("{name}.txt"), b"1").map(|()| values)
            });
            (value.unwrap(), done)
        };
        let mut set = Set::resume(folder.path(), "key").unwrap();
        assert!(Set::resume(folder.path(), "key").is_err(), "two at once");
        assert!(work(&mut set, "one").1 && work(&mut set, "two").1 && !work(&mut set, "one").1);
        drop(set);
        // A run that ends before it comes to any of them takes nothing away.
        drop(Set::resume(folder.path(), "key").unwrap());
        let mut other = Set::resume(folder.path(), "another key").unwrap();
        assert!(work(&mut other, "one").1);
        other.forget();
        drop(other);

        let mut set = Set::resume(folder.path(), "key").unwrap();
        let (value, done) = work(&mut set, "one");
        assert!(!done && value.map(f64::to_bits) == values.map(f64::to_bits));
        fs::remove_file(set.place("two.txt")).unwrap();
        assert!(work(&mut set, "two").1);
        assert_eq!(set.parts(), 2);
        set.put("list.json", b"{}").unwrap();
        set.publish("list.json").unwrap();
        assert_eq!(names(folder.path()), ["list.json", "one.txt", "two.txt"]);
    }
}
