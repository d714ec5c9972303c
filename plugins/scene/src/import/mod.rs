//! A user's own structure: IFC, glTF or OBJ to a project folder that the other commands take as it
//! is: `scene.ron`, the geometry, `evidence.ron`, and a README that says what was read and what was
//! assumed by which rule.
//!
//! A file goes through four rooms. `convert` (IFC, by IfcOpenShell in a process of its own) and
//! `model` (glTF, OBJ) read it into a [`source`]: elements with what is said of them. `build` makes
//! a model of members and steel of that: what each is (`kind`), where its axis lies (`shape`),
//! where bars run (`course`), what it is made of (`grade`). `assume` fills in what nobody stated,
//! and `project` writes. The folder is made beside its place, opened as any scene would be, and
//! put there whole.

mod ask;
mod assume;
mod bars;
mod build;
mod close;
mod convert;
mod count;
mod course;
mod cover;
mod doubt;
mod georeference;
mod grade;
mod ground;
mod kind;
mod matter;
mod model;
mod project;
mod quantity;
mod ring;
mod shape;
mod source;
mod stray;
mod strength;

pub use assume::concrete as concrete_of;
pub use convert::ifcopenshell;

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
};

use intrados_stage::{Access, Cancelled, Job, access::Denied};
use serde::Serialize;

use crate::{LoadError, MemberKind, Scene, problem::unwritten};

/// What a user may say of a model beside its file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Told {
    /// Metres per unit of the file, where its format says none (glTF says metres).
    pub metres: Option<f64>,
    /// Which axis of the file points up, where its format says none (glTF says y).
    pub up: Option<UpAxis>,
    /// When it was built.
    pub year: Option<i32>,
    /// Classes of EN 206 that attack all of it.
    pub exposure: Option<String>,
    /// What people, goods and traffic weigh on its slabs, kN/m².
    pub imposed_kpa: Option<f32>,
    /// What elements are, where the model does not say it or says it wrong.
    pub kinds: Vec<KindByName>,
}

/// What elements of a name are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KindByName {
    /// Name or id of elements.
    pub name: String,
    /// `None` where they are no members.
    pub kind: Option<MemberKind>,
}

impl KindByName {
    fn is_of(&self, element: &source::Element) -> bool {
        let is = |own: &str| own.trim().eq_ignore_ascii_case(self.name.trim());
        is(&element.name) || is(&element.id)
    }
}

/// Which axis of a file points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum UpAxis {
    /// As in glTF and in this program.
    #[default]
    Y,
    /// As in most programs for structures; x, y and z become x, z and −y.
    Z,
}

/// What came of an import.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Imported {
    /// The folder.
    #[serde(skip)]
    pub folder: PathBuf,
    /// What was read, and by what.
    pub format: String,
    /// Members by kind.
    pub members: BTreeMap<MemberKind, usize>,
    /// Their volume by kind, m³.
    pub volume_m3: BTreeMap<MemberKind, f64>,
    /// Bars, stirrups and tendons that lie in members.
    pub steel_lines: usize,
    /// Those that lie in none.
    pub loose_steel: usize,
    /// Elements that bear nothing, or of which nobody knows, by class.
    pub scenery: BTreeMap<String, usize>,
    /// Members whose concrete was assumed.
    pub concrete_assumed: usize,
    /// Members whose reinforcement was assumed.
    pub reinforcement_assumed: usize,
    /// Each material of members and bars that the file names, with what was made of it.
    pub materials: Vec<MaterialUse>,
    /// What was taken off all coordinates, m.
    pub offset_m: [f64; 3],
    /// What a user should know.
    pub notes: Vec<String>,
}

/// A material that a file names.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MaterialUse {
    /// Its name in the file.
    pub name: String,
    /// How many members, or elements of bars, are of it.
    pub elements: usize,
    /// What it was taken for.
    pub taken_for: String,
}

/// Why a model was not imported. One line each.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ImportError {
    /// A glTF or OBJ file cannot be read, or what was written cannot be opened.
    #[error("{0}")]
    Load(LoadError),
    /// The file is wrong.
    #[error("{0}")]
    BadInput(String),
    /// The file is not there.
    #[error("{0}")]
    NoInput(String),
    /// There is no Python, or no IfcOpenShell that will do.
    #[error("{0}")]
    NoConverter(String),
    /// The folder cannot be written.
    #[error("{0}")]
    CannotWrite(String),
    /// Somebody asked to stop.
    #[error("cancelled")]
    Cancelled,
}

impl ImportError {
    fn bad(path: &Path, what: impl AsRef<str>) -> Self {
        Self::BadInput(format!("{}: {}", path.display(), what.as_ref()))
    }

    /// A file that cannot be opened.
    #[must_use]
    pub fn denied(path: &Path, why: &Denied) -> Self {
        let line = format!("{}: {why}", path.display());
        if why.is_missing() { Self::NoInput(line) } else { Self::BadInput(line) }
    }

    /// A file or folder that cannot be written.
    #[must_use]
    pub fn write(path: &Path, error: &io::Error) -> Self {
        Self::CannotWrite(format!("{}: {}", path.display(), unwritten(error)))
    }
}

impl From<ImportError> for LoadError {
    fn from(error: ImportError) -> Self {
        use crate::Problem;
        match error {
            ImportError::Load(error) => error,
            ImportError::Cancelled => Self::Cancelled,
            ImportError::BadInput(text) => Self::bad("", "IMPORT", text),
            ImportError::NoInput(text) => Self::NoInput(Problem::error("", "NO_INPUT", text)),
            ImportError::NoConverter(text) => {
                Self::NoInput(Problem::error("", "NO_CONVERTER", text))
            }
            ImportError::CannotWrite(text) => Self::bad("", "CANNOT_WRITE", text),
        }
    }
}

impl From<Cancelled> for ImportError {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

/// Sizes outside are doubted, m.
const SIZES: std::ops::RangeInclusive<f64> = 1e-3..=2e3;

/// No member is longer than this, m.
const LONGEST: f32 = 2e3;

/// Metres per unit that a glTF file most likely is in, where it is opened as it is and no structure
/// is as large: it was written in millimetres, or scaled down once too often. None: its size is one
/// that a structure can have, or no such unit makes it one.
#[must_use]
pub fn likely_unit(scene: &Scene) -> Option<f64> {
    let is_gltf = |e: &std::ffi::OsStr| ["glb", "gltf"].iter().any(|g| e.eq_ignore_ascii_case(g));
    if !scene.path.extension().is_some_and(is_gltf) || scene.objects.is_empty() {
        return None;
    }
    let [low, high] = scene.bounds();
    let size = f64::from((high - low).max_element());
    let metres = if size > *SIZES.end() { 1e-3 } else { 1e3 };
    (!SIZES.contains(&size) && SIZES.contains(&(metres * size))).then_some(metres)
}

/// Imports a model into `folder`, which must be empty or not there yet.
///
/// # Errors
/// [`ImportError`]; nothing is written then.
pub fn import(
    path: &Path,
    folder: &Path,
    told: &Told,
    access: &Access,
    job: &Job,
) -> Result<Imported, ImportError> {
    vacant(folder)?;
    writable(folder)?;
    let extension =
        path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    if extension == "ifc" && told.up.is_some() {
        return Err(ImportError::bad(path, "IFC says which way is up: leave --up out"));
    }
    if extension == "ifc" && told.metres.is_some() {
        let what = "IFC says in which unit it is: leave --unit out, and export the model again where its unit is wrong or missing";
        return Err(ImportError::bad(path, what));
    }
    let (source, model) = match extension.as_str() {
        "ifc" => (convert::ifc(path, &job.part(0.0, 0.8))?, crate::gltf::Model::default()),
        "glb" | "gltf" => model::gltf(path, told, access, job)?,
        "obj" => model::obj(path, told)?,
        _ => {
            // A missing file is missing whatever its name is.
            intrados_stage::access::open(path).map_err(|e| ImportError::denied(path, &e))?;
            return Err(ImportError::bad(
                path,
                "is neither .ifc, .glb, .gltf nor .obj: export it as one of these",
            ));
        }
    };
    job.relabel(format!("looking at {}", path.display()));
    unknown_names(path, &source, &told.kinds)?;
    let mut built = build::build(&source, model, &told.kinds, &job.part(0.8, 0.95))?;
    measure(path, &mut built, told, extension == "ifc")?;
    built.notes.extend(doubt::doubts(&source, &built, told));
    project::write(path, folder, &source, &built, told, &job.part(0.95, 1.0))
}

/// Refuses what is said of an element that the model does not have.
fn unknown_names(
    path: &Path,
    source: &source::Source,
    kinds: &[KindByName],
) -> Result<(), ImportError> {
    let has = |kind: &KindByName| source.elements.iter().any(|e| kind.is_of(e));
    let Some(unknown) = kinds.iter().find(|kind| !has(kind)) else { return Ok(()) };
    let names = || source.elements.iter().map(|e| e.name.as_str());
    let wanted = unknown.name.to_lowercase();
    let near = names().find(|name| name.to_lowercase().contains(&wanted));
    let meant = near.map_or_else(String::new, |near| format!("; did you mean \"{near}\"?"));
    let what = format!("--kind: has no element that is called \"{}\"{meant}", unknown.name);
    Err(ImportError::bad(path, what))
}

/// Refuses a place where no folder can be made, before a model is read for minutes.
fn writable(folder: &Path) -> Result<(), ImportError> {
    let above = folder.ancestors().skip(1).find(|above| above.is_dir());
    let above = above.filter(|above| !above.as_os_str().is_empty()).unwrap_or(Path::new("."));
    tempfile::tempfile_in(above).map(drop).map_err(|e| ImportError::write(folder, &e))
}

/// Refuses a folder that holds something, and a link in its place.
fn vacant(folder: &Path) -> Result<(), ImportError> {
    if fs::symlink_metadata(folder).is_ok_and(|facts| facts.is_symlink()) {
        return Err(ImportError::CannotWrite(format!(
            "{}: is a link: name the folder itself (--out)",
            folder.display()
        )));
    }
    let taken = match fs::read_dir(folder) {
        Ok(mut entries) => entries.next().is_some(),
        Err(e) if e.kind() == io::ErrorKind::NotFound => false,
        Err(e) => return Err(ImportError::write(folder, &e)),
    };
    if taken {
        return Err(ImportError::CannotWrite(format!(
            "{}: the folder is not empty, and what lies there may have been edited: give another one (--out), or remove it",
            folder.display()
        )));
    }
    Ok(())
}

/// Refuses what has no members and no size that a structure can have.
fn measure(
    path: &Path,
    built: &mut build::Built,
    told: &Told,
    has_units: bool,
) -> Result<(), ImportError> {
    if built.model.objects.is_empty() {
        return Err(ImportError::bad(path, "has no surfaces: export the model with its geometry"));
    }
    if let Some(long) = built.found.iter().find(|f| f.frame.axis.length() > LONGEST) {
        let remedy = match (has_units, told.metres) {
            (true, _) => "export it again in the right one",
            (false, Some(_)) => "say another one with --unit",
            (false, None) => "say it, --unit mm",
        };
        let name = crate::file::shorten(&long.name);
        let length = long.frame.axis.length();
        return Err(ImportError::bad(
            path,
            format!("\"{name}\" is {:.1} km long; is the unit wrong? {remedy}", 1e-3 * length),
        ));
    }
    let scene = Scene {
        meshes: built.model.meshes.clone(),
        objects: built.model.objects.clone(),
        ..Scene::default()
    };
    let [low, high] = scene.bounds();
    let size = f64::from((high - low).max_element());
    if SIZES.contains(&size) {
        return Ok(());
    }
    if has_units || told.metres.is_some() {
        built.notes.push(format!("the model is {size:.4} m across: is its unit right?"));
        return Ok(());
    }
    Err(ImportError::bad(
        path,
        format!("the model is {size:.4} m across: mm or m? say it, with --unit mm or --unit m"),
    ))
}
