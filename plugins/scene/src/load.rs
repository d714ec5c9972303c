//! Files to [`Scene`]s.

use std::{
    ffi::OsStr,
    fs::File,
    io::Read,
    path::{Path, PathBuf},
};

use intrados_stage::{
    Access, Cancelled, Job,
    access::{self, Denied},
};

use crate::{
    Scene,
    file::{self, SceneFile, evidence},
    gltf,
    problem::{Problem, Severity},
    scene::Written,
    sources::{SourceFile, SourceFiles, hash_of},
};

/// Largest file that is read into memory, bytes.
const MAX_FILE: u64 = 4 << 30;

/// The scenes that the program carries with it, by name.
#[must_use]
pub fn bundled() -> &'static [(&'static str, &'static str)] {
    intrados_scenes::BUNDLED
}

/// What is written of a bundled scene, without loading it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Card {
    /// Its name.
    pub name: &'static str,
    /// Its title, for people.
    pub title: String,
    /// Whether there are structural members in it.
    pub has_members: bool,
}

/// A card of every bundled scene.
#[must_use]
pub fn cards() -> Vec<Card> {
    let card = |(name, text): &(&'static str, &'static str)| {
        let parsed = file::parse(name, text).unwrap_or_default();
        Card {
            name,
            has_members: !parsed.members.is_empty() || !parsed.models.is_empty(),
            title: parsed.title,
        }
    };
    bundled().iter().map(card).collect()
}

/// Why a scene was not loaded. One line each; [`LoadError::problems`] has them all.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LoadError {
    /// A file or folder is not there.
    #[error("{0}")]
    NoInput(Problem),
    /// The input is wrong.
    #[error("{}", first_line(.0))]
    BadInput(Vec<Problem>),
    /// Somebody asked to stop.
    #[error("cancelled")]
    Cancelled,
}

/// What a [`LoadError`] means for the exit code: 66, 65, 130.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorKind {
    /// A file is not there, or `INTRADOS_DATA` is not set.
    NoInput,
    /// The input is wrong.
    BadInput,
    /// Somebody asked to stop.
    Cancelled,
}

impl LoadError {
    /// Which sort of error it is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::NoInput(_) => ErrorKind::NoInput,
            Self::BadInput(_) => ErrorKind::BadInput,
            Self::Cancelled => ErrorKind::Cancelled,
        }
    }

    /// All that is wrong.
    #[must_use]
    pub fn problems(&self) -> &[Problem] {
        match self {
            Self::NoInput(problem) => std::slice::from_ref(problem),
            Self::BadInput(problems) => problems,
            Self::Cancelled => &[],
        }
    }

    /// What the glTF import says.
    pub(crate) fn of_import(path: &Path, error: gltf::ImportError) -> Self {
        let place = path.display().to_string();
        match error {
            gltf::ImportError::Cancelled(_) => Self::Cancelled,
            gltf::ImportError::Read { source, .. } => denied(&place, &source),
            gltf::ImportError::Damaged { problem, others, .. } => {
                let problem = Problem::from(*problem);
                let more = if others > 0 {
                    format!(" (and {others} more: `intrados validate` lists them)")
                } else {
                    String::new()
                };
                Self::bad(
                    format!("{place}: {}", problem.place),
                    problem.code,
                    format!("{}{more}", problem.message),
                )
            }
        }
    }

    pub(crate) fn bad(
        place: impl Into<String>,
        code: &'static str,
        message: impl Into<String>,
    ) -> Self {
        Self::BadInput(vec![Problem::error(place, code, message)])
    }

    /// The same, with the bundled scene that was probably meant.
    fn or_bundled(mut self, name: &Path) -> Self {
        let names: Vec<&str> = bundled().iter().map(|(name, _)| *name).collect();
        if let (Self::NoInput(problem), None, Some(name)) =
            (&mut self, name.extension(), name.to_str())
            && let Some(meant) = file::nearest(name, &names)
        {
            problem.message += &format!("; did you mean the bundled scene {meant}?");
        }
        self
    }

    /// The same, found where `place` of a scene leads to.
    pub(crate) fn under(mut self, place: &str) -> Self {
        let problems = match &mut self {
            Self::NoInput(problem) => std::slice::from_mut(problem),
            Self::BadInput(problems) => problems,
            Self::Cancelled => &mut [],
        };
        problems.iter_mut().for_each(|p| p.place.insert_str(0, &format!("{place}: ")));
        self
    }
}

impl From<Cancelled> for LoadError {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

fn first_line(problems: &[Problem]) -> String {
    let errors = problems.iter().filter(|p| p.severity == Severity::Error).count();
    let first = problems
        .iter()
        .find(|p| p.severity == Severity::Error)
        .map_or_else(String::new, ToString::to_string);
    if errors > 1 {
        format!("{first} (and {} more: `intrados validate` lists them)", errors - 1)
    } else {
        first
    }
}

impl Scene {
    /// Loads a `.ron` scene, or a `.glb` or `.gltf` file, which gets a camera and a sky where it
    /// brings none. What it names must lie beside it, or below the folder in `INTRADOS_DATA`.
    ///
    /// # Errors
    /// [`LoadError`]: something is missing, something is wrong, or the job was cancelled.
    pub fn load(path: &Path, job: &Job) -> Result<Self, LoadError> {
        Self::load_within(path, &Access::default(), job)
    }

    /// [`Scene::load`] where other folders may be read too.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub(crate) fn load_within(path: &Path, access: &Access, job: &Job) -> Result<Self, LoadError> {
        Self::load_from(path, Sources::new(path, access), job)
    }

    /// [`Scene::load_within`] as if this were the text of the evidence beside the scene.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub(crate) fn load_proposed(
        path: &Path,
        evidence: &str,
        access: &Access,
        job: &Job,
    ) -> Result<Self, LoadError> {
        let sources = Sources::new(path, access);
        let proposed = Some((sources.folder.join(evidence::NAME), evidence.to_owned()));
        Self::load_from(path, Sources { proposed, ..sources }, job)
    }

    /// [`Scene::load_within`] as if this were the text of the scene itself.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub(crate) fn load_amended(
        path: &Path,
        text: &str,
        access: &Access,
        job: &Job,
    ) -> Result<Self, LoadError> {
        let proposed = Some((path.to_owned(), text.to_owned()));
        Self::load_from(path, Sources { proposed, ..Sources::new(path, access) }, job)
    }

    fn load_from(path: &Path, mut sources: Sources, job: &Job) -> Result<Self, LoadError> {
        let extension =
            path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        let name = called(path);
        let mut scene = match extension.as_str() {
            "glb" | "gltf" => file::bare_model(path, &mut sources, job)?,
            "ron" => {
                let bytes = sources.read(path, file::MAX_BYTES as u64)?;
                let place = path.display().to_string();
                let text = String::from_utf8(bytes).map_err(|_| {
                    LoadError::bad(&place, "NOT_TEXT", "is not UTF-8 text: save it as UTF-8")
                })?;
                from_text(&place, &text, &mut sources, job)?
            }
            _ => {
                // A missing file is missing whatever its name is.
                sources.open(path)?;
                let message = "is neither .ron, .glb nor .gltf: make a scene of it first (IFC and OBJ: `intrados import`)";
                return Err(LoadError::bad(path.display().to_string(), "UNKNOWN_FORMAT", message));
            }
        };
        scene.name = name;
        scene.path = path.into();
        scene.hash = sources.hash();
        scene.sources = SourceFiles::new(sources.hashed);
        Ok(scene)
    }

    /// Loads one of the [`bundled`] scenes by its name.
    ///
    /// # Errors
    /// [`LoadError::NoInput`] where there is none of this name, and as [`Scene::load`].
    pub fn load_bundled(name: &str, job: &Job) -> Result<Self, LoadError> {
        let Some((name, text)) = bundled().iter().find(|(n, _)| *n == name) else {
            let names: Vec<&str> = bundled().iter().map(|(n, _)| *n).collect();
            let message = format!(
                "no scene of this name comes with the program: there are {}",
                names.join(", ")
            );
            return Err(LoadError::NoInput(Problem::error(
                file::shorten(name),
                "NO_SCENE",
                message,
            )));
        };
        let mut sources = Sources::new(Path::new(""), &Access::default());
        sources.add(text.as_bytes());
        let mut scene = from_text(&format!("{name}.ron"), text, &mut sources, job)?;
        scene.name = (*name).into();
        scene.path = PathBuf::from(format!("scenes/{name}.ron"));
        scene.hash = sources.hash();
        scene.sources = SourceFiles::new(sources.hashed);
        Ok(scene)
    }

    /// What a user means who writes `scene`: a file or a project's folder if there is one, else a
    /// bundled scene by its name or its path in the repository (`scenes/column.ron`).
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn open(scene: &Path, job: &Job) -> Result<Self, LoadError> {
        Self::open_within(scene, &Access::default(), job)
    }

    /// [`Scene::open`] where other folders may be read too.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn open_within(scene: &Path, access: &Access, job: &Job) -> Result<Self, LoadError> {
        let name = match scene.strip_prefix("scenes") {
            Ok(rest) => rest.with_extension(""),
            Err(_) => scene.to_path_buf(),
        };
        // A project is known by its folder, whatever a bundled scene is called.
        let is_project = scene.join(PROJECT).is_file();
        let is_there = is_project || scene.is_file();
        match bundled().iter().find(|(n, _)| !is_there && Path::new(n) == name) {
            Some((name, _)) => Self::load_bundled(name, job),
            None if is_project => Self::load_within(&scene.join(PROJECT), access, job),
            None => Self::load_within(scene, access, job).map_err(|error| error.or_bundled(&name)),
        }
    }
}

/// The scene of a project's folder.
pub(crate) const PROJECT: &str = "scene.ron";

/// What people call a scene: as its file, or as its folder where the file is called as every
/// project's is.
fn called(path: &Path) -> String {
    let said = |part: &OsStr| part.to_string_lossy().into_owned();
    let stem = path.file_stem().unwrap_or_default();
    if Some(stem) != Path::new(PROJECT).file_stem() {
        return said(stem);
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    // “.” and “..” have no name of their own.
    let named = folder.file_name().map(said);
    let found = || folder.canonicalize().ok()?.file_name().map(said);
    named.or_else(found).unwrap_or_else(|| said(stem))
}

/// Everything that is wrong with a scene or a glTF file, errors and warnings. Empty: all is well.
///
/// # Errors
/// [`LoadError::NoInput`] where there is nothing to look at, [`LoadError::Cancelled`].
pub fn validate(path: &Path, job: &Job) -> Result<Vec<Problem>, LoadError> {
    if path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("glb") || e.eq_ignore_ascii_case("gltf"))
    {
        let problems =
            gltf::validate(path, job).map_err(|error| LoadError::of_import(path, error))?;
        return Ok(problems.into_iter().map(Problem::from).collect());
    }
    match Scene::open(path, job) {
        Ok(scene) => {
            Ok(scene.warnings.iter().map(|w| Problem::warning("", "ASSUMED", w)).collect())
        }
        Err(LoadError::BadInput(problems)) => Ok(problems),
        Err(other) => Err(other),
    }
}

/// Text to scene, name and hash apart.
pub(crate) fn from_text(
    name: &str,
    text: &str,
    sources: &mut Sources,
    job: &Job,
) -> Result<Scene, LoadError> {
    job.relabel(format!("reading {name}"));
    let parsed: SceneFile = file::parse(name, text).map_err(|p| LoadError::BadInput(vec![p]))?;
    let mut problems = file::check(&parsed);
    for problem in &mut problems {
        problem.place = format!("{name}: {}", problem.place);
    }
    let evidence = evidence::gather(&parsed, sources, &mut problems, job)?;
    if problems.is_empty() {
        let mut scene = file::resolve(name, &parsed, &evidence, sources, job)?;
        scene.written = Written(text.into());
        Ok(scene)
    } else {
        Err(LoadError::BadInput(problems))
    }
}

/// The files that a scene is made of: finds them, reads them, and hashes what it read.
pub(crate) struct Sources {
    /// The scene itself, which may lie anywhere.
    given: PathBuf,
    /// Where it lies: what it names is relative to this.
    pub(crate) folder: PathBuf,
    pub(crate) access: Access,
    hasher: blake3::Hasher,
    /// Files that somebody else reads.
    hashed: Vec<SourceFile>,
    /// Texels that its images may still have.
    pub(crate) texels: usize,
    /// A file, and what is to be taken for its text.
    proposed: Option<(PathBuf, String)>,
}

impl Sources {
    pub(crate) fn new(scene: &Path, access: &Access) -> Self {
        let folder = scene.parent().unwrap_or(Path::new("")).into();
        Self {
            given: scene.into(),
            folder,
            access: access.clone(),
            hasher: blake3::Hasher::new(),
            hashed: Vec::new(),
            texels: file::MAX_TEXELS,
            proposed: None,
        }
    }

    /// The evidence beside the scene, if there is some: that of all scenes of its folder, and for
    /// `X.ron` `X.evidence.ron`; none beside a bundled scene.
    pub(crate) fn evidence(&self) -> impl Iterator<Item = PathBuf> {
        let is_scene = self.given.extension().is_some_and(|e| e.eq_ignore_ascii_case("ron"));
        let own = is_scene.then(|| self.given.with_extension(evidence::NAME));
        self.of_folder().into_iter().chain(own.filter(|path| path.exists()))
    }

    fn of_folder(&self) -> Option<PathBuf> {
        let path = self.folder.join(evidence::NAME);
        let is_proposed = self.proposed.as_ref().is_some_and(|(of, _)| *of == path);
        let there = is_proposed || path.exists();
        (there && !self.given.as_os_str().is_empty()).then_some(path)
    }

    /// A path as written in a scene: relative to its folder, or below `${INTRADOS_DATA}`.
    pub(crate) fn path(&self, text: &str) -> Result<PathBuf, LoadError> {
        self.path_from(&self.folder, text)
    }

    /// A path as written in a file that lies in `folder`.
    pub(crate) fn path_from(&self, folder: &Path, text: &str) -> Result<PathBuf, LoadError> {
        let Some(rest) = text.strip_prefix("${INTRADOS_DATA}") else {
            if text.contains("${") {
                let message = "only ${INTRADOS_DATA} is known, at the beginning of a path";
                return Err(LoadError::bad(file::shorten(text), "UNKNOWN_VARIABLE", message));
            }
            return Ok(folder.join(text));
        };
        match std::env::var_os("INTRADOS_DATA") {
            Some(data) if !data.is_empty() => {
                Ok(Path::new(&data).join(rest.trim_start_matches(['/', '\\'])))
            }
            _ => {
                let message = "set INTRADOS_DATA to the folder with the data";
                Err(LoadError::NoInput(Problem::error(file::shorten(text), "NO_DATA", message)))
            }
        }
    }

    /// Opens the scene, or a file that it names and may read. Gives its length too.
    pub(crate) fn open(&self, path: &Path) -> Result<(File, u64), LoadError> {
        let opened = if path == self.given {
            access::open(path)
        } else {
            self.access.open(&self.folder, path)
        };
        opened.map_err(|e| denied(&path.display().to_string(), &e))
    }

    /// A folder that the scene names and may look into.
    pub(crate) fn enter(&self, folder: &Path) -> Result<(), LoadError> {
        let place = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        self.access
            .find(&self.folder, place)
            .map(drop)
            .map_err(|e| denied(&place.display().to_string(), &e))
    }

    /// Reads a file and adds it to the hash.
    pub(crate) fn read(&mut self, path: &Path, limit: u64) -> Result<Vec<u8>, LoadError> {
        let proposed = self.proposed.as_ref().filter(|(of, _)| of == path);
        let read = if let Some((_, text)) = proposed {
            Ok(text.clone().into_bytes())
        } else if path == self.given {
            access::read(path, limit)
        } else {
            self.access.read(&self.folder, path, limit)
        };
        let bytes = read.map_err(|e| denied(&path.display().to_string(), &e))?;
        self.add(&bytes);
        Ok(bytes)
    }

    /// Adds a file to the hash that somebody else reads.
    pub(crate) fn hash_file(&mut self, path: &Path, job: &Job) -> Result<(), LoadError> {
        let (file, length) = self.open(path)?;
        let failed = |e: Denied| denied(&path.display().to_string(), &e);
        if length > MAX_FILE {
            return Err(failed(Denied::TooLong(MAX_FILE)));
        }
        let facts = file.metadata().map_err(|e| failed(e.into()))?;
        let hash = hash_of(file.take(MAX_FILE), job)?.map_err(|e| failed(e.into()))?;
        self.hashed.push(SourceFile::new(path, &facts, hash));
        self.hasher.update(hash.as_bytes());
        Ok(())
    }

    fn add(&mut self, bytes: &[u8]) {
        self.hasher.update(blake3::hash(bytes).as_bytes());
    }

    fn hash(&self) -> String {
        self.hasher.finalize().to_hex().to_string()
    }
}

pub(crate) fn denied(place: &str, error: &Denied) -> LoadError {
    let code = match error {
        Denied::System(_) => "NO_INPUT",
        Denied::Folder => "IS_FOLDER",
        Denied::NotPlain => "NOT_PLAIN",
        Denied::TooLong(_) => "TOO_LONG",
        Denied::Outside(_) => "OUTSIDE",
    };
    let problem = Problem::error(place, code, error.to_string());
    if error.is_missing() {
        LoadError::NoInput(problem)
    } else {
        LoadError::BadInput(vec![problem])
    }
}
