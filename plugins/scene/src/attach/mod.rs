//! Evidence put beside a scene by command, and taken away again: what `intrados attach` and
//! `intrados detach` do.
//!
//! [`Project::propose`] copies files aside and loads the scene as it would be, so that everything
//! wrong is known before anything changes; [`Proposal::commit`] puts it in place. `evidence.ron` is
//! edited as text: comments and order stay. So is the scene's own file by [`Project::amend`], which
//! writes what a form has changed of its [`fields`].

mod amend;
mod change;
mod draft;
mod edit;
mod fields;
mod listed;
mod load_test;
mod lock;
mod raw;
mod tree;

use std::{
    collections::HashSet,
    fs, io,
    path::{Component, Path, PathBuf},
};

use intrados_stage::{
    Access, Job,
    access::{self, Denied},
    file::{self, AsideFolder, within},
};
use ron::{extensions::Extensions, ser::PrettyConfig};
use serde::Serialize;

pub use crate::file::evidence::{Along, Face, Finding, Kind};
pub use amend::Setting;
pub use change::Change;
pub use draft::Draft;
pub use fields::{Field, FieldKind, fields};
pub use listed::{Listed, listed};
pub use raw::{Raw, VoxelType, VoxelTypeError};

use crate::{
    AxisRuns, LoadError, Member, Scene,
    file::{
        Slices,
        evidence::{self, EvidenceFile, MemberSlices, Photo, Record, Survey, no_member},
        extension, is_image, listing, matches, mhd, nearest, shorten,
    },
    load::PROJECT,
    problem::unwritten,
    structure::{Action, Date, Electrode, Test},
};

/// The folder for copies, beside the scene.
const COPIES: &str = "evidence";

/// Most files that are attached at once.
const MAX_FILES: usize = 100_000;

/// Why nothing was attached or detached. One line each.
#[derive(Debug, thiserror::Error)]
pub enum AttachError {
    /// What the scene or its evidence says of it.
    #[error("{0}")]
    Load(#[from] LoadError),
    /// What was given does not fit.
    #[error("{0}")]
    BadInput(String),
    /// A file is not there.
    #[error("{0}")]
    NoInput(String),
    /// Nothing can be written.
    #[error("{0}")]
    CannotWrite(String),
}

impl AttachError {
    fn write(path: &Path, error: &io::Error) -> Self {
        let why = unwritten(error);
        Self::CannotWrite(format!("{}: {why}", path.display()))
    }

    fn denied(path: &Path, why: &Denied) -> Self {
        let line = format!("{}: {why}", path.display());
        if why.is_missing() { Self::NoInput(line) } else { Self::BadInput(line) }
    }
}

/// Something to attach.
#[derive(Debug, Clone, PartialEq)]
pub struct Attachment {
    /// Id of the member.
    pub member: String,
    /// Name, unique within the member; one is made where there is none.
    pub name: Option<String>,
    /// When.
    pub date: Option<Date>,
    /// Where on the axis, from and to, 0 to 1.
    pub along: Option<[f32; 2]>,
    /// On which face.
    pub face: Option<Face>,
    /// On which side, degrees about the axis.
    pub angle_deg: Option<f32>,
    /// Above the member's lowest point, m.
    pub height_m: Option<f32>,
    /// What it was measured with.
    pub instrument: Option<String>,
    /// A photograph of a finding, JPEG or PNG.
    pub picture: Option<PathBuf>,
    /// A finding or a table is meant as it is written, and counts however much it is doubted.
    pub confirmed: bool,
    /// What it is.
    pub what: What,
}

impl Attachment {
    /// Its files, which are copied.
    fn files(&self) -> &[PathBuf] {
        match &self.what {
            What::Finding(_) => self.picture.as_slice(),
            What::LoadTest { .. } => &[],
            What::Table { file, .. } => std::slice::from_ref(file),
            What::Slices { files, .. } | What::Stack { files, .. } => files,
            What::Photograph { files, .. } => files,
        }
    }

    /// The middle of where it was on the axis.
    fn middle(&self) -> Option<f32> {
        self.along.map(|[from, to]| 0.5 * (from + to))
    }

    /// The side of its member that it was on, degrees.
    fn angle(&self, member: &Member) -> Result<Option<f32>, AttachError> {
        let Some(face) = self.face else { return Ok(self.angle_deg) };
        let angle = face.angle_deg(member.kind, member.frame);
        angle.map(Some).map_err(|why| AttachError::BadInput(format!("face: {why}")))
    }
}

/// What can be attached.
#[derive(Debug, Clone, PartialEq)]
pub enum What {
    /// A single finding.
    Finding(Finding),
    /// A CSV file.
    Table {
        /// The file.
        file: PathBuf,
        /// What its column `value` holds.
        kind: Option<Kind>,
        /// In which unit that is.
        unit: Option<String>,
        /// The load test under which gauges were read.
        test: Option<String>,
        /// What half-cell potentials were measured against.
        electrode: Electrode,
    },
    /// CT slices of one core.
    Slices {
        /// Images, and labels beside them (`STEM_mask-*`).
        files: Vec<PathBuf>,
        /// Edge of a pixel, mm.
        pixel_mm: Option<f32>,
        /// Where they were cut out.
        cut: Cut,
    },
    /// A volume of one core: slices that lie behind each other.
    Stack {
        /// One file of all slices, or one of each.
        files: Vec<PathBuf>,
        /// Edges of a voxel, mm; what the files tell if absent.
        voxel_mm: Option<[f32; 3]>,
        /// How its voxels lie, where the file does not say it.
        raw: Option<Raw>,
        /// Where it was cut out.
        cut: Cut,
    },
    /// A photograph that is read.
    Photograph {
        /// The photograph, and its table of picks.
        files: [PathBuf; 2],
        /// Focal length, pixels, where EXIF does not say it.
        focal_px: Option<f64>,
    },
    /// A weight of a load test; the test has as many as were attached under its name.
    LoadTest {
        /// Downwards, kN.
        force_kn: f64,
    },
}

/// How a core was cut out of its member.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Cut {
    /// Depth below the face, m.
    pub depth_m: Option<f32>,
    /// Diameter, mm; none: it was sawn.
    pub diameter_mm: Option<f32>,
    /// Which way the member's axis runs in the pictures.
    pub axis: Option<AxisRuns>,
}

impl What {
    /// Whether a file is a table by its name, or slices; none: neither.
    #[must_use]
    pub fn is_table(path: &Path) -> Option<bool> {
        let name = path.file_name()?.to_str()?;
        match extension(name).as_deref() {
            Some("csv" | "tsv" | "txt") => Some(true),
            _ => is_image(name).then_some(false),
        }
    }
}

/// A scene and the evidence beside it.
#[derive(Debug)]
pub struct Project {
    scene: PathBuf,
    folder: PathBuf,
    access: Access,
    /// The text of its evidence, where there is some.
    text: Option<String>,
    file: EvidenceFile,
    /// Nobody else edits it meanwhile.
    _lock: Option<lock::Lock>,
}

/// An entry as it is written.
enum Entry {
    Item(Record),
    Table(Survey),
    Slices(MemberSlices),
    Photo(Photo),
    Test(Test),
    /// One more weight of the test of this index.
    Weight(usize, Action),
}

impl Entry {
    fn list(&self) -> &'static str {
        match self {
            Self::Item(_) => "items",
            Self::Table(_) => "tables",
            Self::Slices(_) => "slices",
            Self::Photo(_) => "photographs",
            Self::Test(_) | Self::Weight(..) => "tests",
        }
    }

    fn ron(&self) -> Result<String, AttachError> {
        let written = match self {
            Self::Item(record) => ron_of(record),
            Self::Table(survey) => ron_of(survey),
            Self::Slices(slices) => ron_of(slices),
            Self::Photo(photo) => ron_of(photo),
            Self::Test(test) => ron_of(test),
            Self::Weight(_, action) => ron_of(action),
        };
        written.map_err(|e| AttachError::BadInput(format!("cannot be written as RON: {e}")))
    }

    fn add_to(self, file: &mut EvidenceFile) {
        match self {
            Self::Item(record) => file.items.push(record),
            Self::Table(survey) => file.tables.push(survey),
            Self::Slices(slices) => file.slices.push(slices),
            Self::Photo(photo) => file.photographs.push(photo),
            Self::Test(test) => file.tests.push(test),
            Self::Weight(index, action) => {
                file.tests.get_mut(index).into_iter().for_each(|t| t.actions.push(action.clone()));
            }
        }
    }
}

/// One line of RON without the words that may be left out.
fn ron_of(value: &impl Serialize) -> ron::Result<String> {
    let one_line = PrettyConfig::new().depth_limit(0).separator(" ");
    ron::Options::default()
        .with_default_extension(Extensions::IMPLICIT_SOME)
        .to_string_pretty(value, one_line)
}

impl Project {
    /// Opens a project to look at it: its folder, or the file of its scene. Only its evidence is
    /// read.
    ///
    /// # Errors
    /// There is no scene, or what lies beside it is no evidence.
    pub fn open(path: &Path, access: &Access) -> Result<Self, AttachError> {
        let (scene, folder) = Self::places(path)?;
        Self::read(scene, folder, access, None)
    }

    /// Opens a project to change its evidence: waits until nobody else does, and nobody else can
    /// until this is dropped.
    ///
    /// # Errors
    /// As [`Project::open`], or the job was cancelled while it waited.
    pub fn edit(path: &Path, access: &Access, job: &Job) -> Result<Self, AttachError> {
        let (scene, folder) = Self::places(path)?;
        let lock = lock::Lock::take(&folder, job)?;
        Self::read(scene, folder, access, Some(lock))
    }

    /// The scene of a project, and its folder.
    fn places(path: &Path) -> Result<(PathBuf, PathBuf), AttachError> {
        let is_scene = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ron"));
        let scene = if is_scene { path.to_owned() } else { path.join(PROJECT) };
        if !scene.is_file() {
            let line = format!(
                "{}: there is no scene here: name a folder that holds scene.ron, or a scene file (`intrados import` and `intrados new` make one)",
                path.display()
            );
            return Err(AttachError::NoInput(line));
        }
        let folder = scene.parent().unwrap_or(Path::new("")).to_path_buf();
        Ok((scene, folder))
    }

    fn read(
        scene: PathBuf,
        folder: PathBuf,
        access: &Access,
        lock: Option<lock::Lock>,
    ) -> Result<Self, AttachError> {
        let place = folder.join(evidence::NAME);
        let text = text_of(&place)?;
        let file = match &text {
            Some(text) => evidence::parse(&place.display().to_string(), text)
                .map_err(|p| AttachError::BadInput(p.to_string()))?,
            None => EvidenceFile { schema: evidence::SCHEMA.into(), ..EvidenceFile::default() },
        };
        Ok(Self { scene, folder, access: access.clone(), text, file, _lock: lock })
    }

    /// The file of evidence.
    #[must_use]
    pub fn evidence(&self) -> PathBuf {
        self.folder.join(evidence::NAME)
    }

    /// Loads the scene with its evidence.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn load(&self, job: &Job) -> Result<Scene, AttachError> {
        Ok(Scene::load_within(&self.scene, &self.access, job)?)
    }

    /// Loads the scene as it will be with this attached. Files are copied aside; nothing else
    /// changes before [`Proposal::commit`], and nothing is left where that is not called.
    ///
    /// # Errors
    /// Whatever does not fit, and what keeps the scene from loading.
    pub fn propose(&self, what: &Attachment, job: &Job) -> Result<Proposal<'_>, AttachError> {
        let before = self.load(job)?;
        if !before.members.iter().any(|m| m.id == what.member) {
            return Err(AttachError::BadInput(no_member(&what.member, &before.members)));
        }
        let name = what.name.clone().unwrap_or_else(|| self.free_name(&before, what));
        let is_more = matches!(what.what, What::LoadTest { .. })
            && self.test_of(&what.member, &name).is_some();
        if name.trim().is_empty() {
            let line = "the name is empty: give one that people can call it by, or leave it out and one is made";
            return Err(AttachError::BadInput(line.to_owned()));
        }
        if !is_more && self.is_taken(&before, &what.member, &name) {
            let line = format!(
                "\"{}\" is attached to {} already: choose another --name, or detach it first",
                shorten(&name),
                before.name_of(&what.member)
            );
            return Err(AttachError::BadInput(line));
        }
        let place = format!("{COPIES}/{}", file::file_name(&format!("{}_{name}", what.member)));
        let aside = self.copy_aside(what, &place, job)?;
        // First as if the copies stayed where they are now.
        let here = aside.as_ref().map_or(place.clone(), |dir| {
            dir.path().file_name().unwrap_or_default().to_string_lossy().into_owned()
        });
        let index = before.members.iter().position(|m| m.id == what.member).unwrap_or_default();
        let entry = |at: &str| self.entry(&before, index, what, &name, at);
        let proposed = self.with(entry(&here)?)?;
        let scene = Scene::load_proposed(&self.scene, &proposed, &self.access, job)
            .map_err(|error| self.told_of(error, aside.as_ref(), what))?;
        self.not_before_it_was_built(&before, &scene, what)?;
        let text = self.with(entry(&place)?)?;
        let known: HashSet<String> = listed(&before).iter().map(|l| format!("{l:?}")).collect();
        let mut added = listed(&scene);
        added.retain(|one| !known.contains(&format!("{one:?}")));
        let given = As::given(&self.folder, aside.as_ref(), what);
        let known: HashSet<&String> = before.warnings.iter().collect();
        let fresh = scene.warnings.iter().filter(|w| !known.contains(w));
        let notes = fresh.map(|note| given.say(note)).collect();
        Ok(Proposal { project: self, scene, name, added, notes, text, aside, place })
    }

    /// Refuses what is dated before its member was built, where that is known and not assumed.
    fn not_before_it_was_built(
        &self,
        before: &Scene,
        scene: &Scene,
        what: &Attachment,
    ) -> Result<(), AttachError> {
        let Some(year) = self.built(scene, &what.member) else { return Ok(()) };
        let known = before.structure.observations.len();
        let rows = scene.structure.observations.iter().skip(known).filter_map(|o| o.date);
        let sampled = |scene: &Scene| -> HashSet<(String, Date)> {
            let all = scene.structure.series.iter();
            all.flat_map(|s| s.samples.iter().map(|one| (s.gauge.clone(), one.date))).collect()
        };
        let (old, new) = (sampled(before), sampled(scene));
        let samples = new.difference(&old).map(|(_, date)| *date);
        match what.date.into_iter().chain(rows).chain(samples).find(|d| d.year() < year) {
            Some(date) => Err(AttachError::BadInput(format!(
                "date: {date} is before {} was built, some time in {year} by the years of its exposure: correct one of the two",
                scene.name_of(&what.member)
            ))),
            None => Ok(()),
        }
    }

    /// The earliest year in which a member can have been built, where the scene says how long it
    /// has been exposed.
    fn built(&self, scene: &Scene, member: &str) -> Option<i32> {
        let text = access::read(&self.scene, crate::file::MAX_BYTES as u64).ok()?;
        let file = crate::file::parse("", std::str::from_utf8(&text).ok()?).ok()?;
        let detail = file.details.iter().find(|d| d.member == member);
        if detail.is_some_and(|d| d.assumed.contains(&crate::file::Assumed::Age)) {
            return None;
        }
        let years = scene.structure.assembly_of(member)?.exposure.as_ref()?.years;
        // Whole years, rounded either way.
        (years > 0.0).then(|| Date::today().year() - years.ceil() as i32 - 1)
    }

    /// What the loading of a proposal says, in the words of who proposed it: places in the file
    /// that is not written, and in copies that will not stay, mean nothing to him.
    fn told_of(
        &self,
        error: LoadError,
        aside: Option<&AsideFolder>,
        what: &Attachment,
    ) -> AttachError {
        let own = format!("{}: ", self.evidence().display());
        let given = As::given(&self.folder, aside, what);
        let plain = |mut p: crate::Problem| {
            if let Some(rest) = p.place.strip_prefix(&own) {
                let field = rest.split_once(['.', ':']).map_or("", |(_, field)| field.trim());
                p.place = field.trim_start_matches("slices[0].").replace("shows.", "");
            }
            p.place = given.say(&p.place);
            p.message = given.say(&p.message);
            p
        };
        match error {
            LoadError::NoInput(problem) => AttachError::Load(LoadError::NoInput(plain(problem))),
            LoadError::BadInput(problems) => {
                let problems: Vec<_> = problems.into_iter().map(plain).collect();
                AttachError::BadInput(all_in_one(
                    &problems,
                    matches!(what.what, What::Table { .. }),
                ))
            }
            LoadError::Cancelled => AttachError::Load(LoadError::Cancelled),
        }
    }

    /// The text of the evidence with one more entry.
    fn with(&self, entry: Entry) -> Result<String, AttachError> {
        let fresh = || {
            let scene = self.scene.file_name().unwrap_or_default().to_string_lossy();
            evidence::skeleton(&scene, "C1")
        };
        let text = self.text.clone().unwrap_or_else(fresh);
        let (list, ron) = (entry.list(), entry.ron()?);
        let edited = match entry {
            Entry::Weight(index, _) => edit::insert_within(&text, list, index, "actions", &ron),
            _ => edit::insert(&text, list, &ron),
        };
        let mut right = self.file.clone();
        entry.add_to(&mut right);
        self.sound(edited, &right)
    }

    /// Refuses to write over what somebody else has written since this was read.
    fn unchanged(&self) -> Result<(), AttachError> {
        let place = self.evidence();
        if text_of(&place)? == self.text {
            return Ok(());
        }
        let why = "has been changed meanwhile: give the command again";
        Err(AttachError::CannotWrite(format!("{}: {why}", place.display())))
    }

    /// An edited text, if it says what it should.
    fn sound(&self, edited: Option<String>, right: &EvidenceFile) -> Result<String, AttachError> {
        let place = self.evidence().display().to_string();
        let says = |text: &String| evidence::parse(&place, text).is_ok_and(|file| file == *right);
        edited.filter(says).ok_or_else(|| {
            let why = "is written in a way that cannot be edited by command: change it by hand";
            AttachError::BadInput(format!("{place}: {why}"))
        })
    }

    /// What is to be written; files lie in `at`.
    fn entry(
        &self,
        scene: &Scene,
        member: usize,
        what: &Attachment,
        name: &str,
        at: &str,
    ) -> Result<Entry, AttachError> {
        let along = what.along.map(Along);
        Ok(match &what.what {
            What::Finding(finding) => Entry::Item(Record {
                member: what.member.clone(),
                name: name.to_owned(),
                date: what.date,
                along,
                face: what.face,
                angle_deg: what.angle_deg,
                height_m: what.height_m,
                instrument: what.instrument.clone(),
                picture: match &what.picture {
                    Some(file) => Some(format!("{at}/{}", plain_name(file)?)),
                    None => None,
                },
                confirmed: what.confirmed,
                shows: finding.clone(),
            }),
            What::Table { file, kind, unit, test, electrode } => Entry::Table(Survey {
                file: format!("{at}/{}", plain_name(file)?),
                member: what.member.clone(),
                name: name.to_owned(),
                date: what.date,
                along,
                face: what.face,
                angle_deg: what.angle_deg,
                height_m: what.height_m,
                instrument: what.instrument.clone(),
                electrode: *electrode,
                kind: *kind,
                unit: unit.clone(),
                test: test.clone(),
                confirmed: what.confirmed,
            }),
            What::Slices { files, pixel_mm, cut } => {
                let copies: Vec<PathBuf> = files.iter().map(|f| copied_as(f, None)).collect();
                let slices = Slices::Files {
                    name: name.to_owned(),
                    images: patterns(&copies, at)?,
                    pixel_mm: *pixel_mm,
                    along: what.middle(),
                    angle_deg: what.angle(&scene.members[member])?,
                    depth_m: cut.depth_m,
                    diameter_mm: cut.diameter_mm,
                    axis: cut.axis,
                    date: what.date,
                };
                Entry::Slices(MemberSlices { member: what.member.clone(), slices: vec![slices] })
            }
            What::Stack { files, voxel_mm, raw, cut } => {
                let copies = files.iter().map(|f| copied_as(f, raw.as_ref()));
                let slices = Slices::Stack {
                    name: name.to_owned(),
                    images: patterns(&copies.collect::<Vec<_>>(), at)?,
                    // Of bare voxels the copy says it.
                    voxel_mm: voxel_mm.filter(|_| raw.is_none()),
                    along: what.middle(),
                    angle_deg: what.angle(&scene.members[member])?,
                    depth_m: cut.depth_m,
                    diameter_mm: cut.diameter_mm,
                    axis: cut.axis,
                    date: what.date,
                };
                Entry::Slices(MemberSlices { member: what.member.clone(), slices: vec![slices] })
            }
            What::Photograph { files: [file, picks], focal_px } => Entry::Photo(Photo {
                file: format!("{at}/{}", plain_name(file)?),
                picks: format!("{at}/{}", plain_name(picks)?),
                member: what.member.clone(),
                name: name.to_owned(),
                date: what.date,
                focal_px: *focal_px,
                picking_px: None,
                shadow_error_mm: None,
            }),
            What::LoadTest { force_kn } => {
                let action = load_test::weight(scene, member, *force_kn, what.along)
                    .map_err(AttachError::BadInput)?;
                match self.test_of(&what.member, name) {
                    Some(index) => Entry::Weight(index, action),
                    None => Entry::Test(Test {
                        name: name.to_owned(),
                        member: what.member.clone(),
                        actions: vec![action],
                    }),
                }
            }
        })
    }

    /// Copies files into a folder that goes away by itself.
    fn copy_aside(
        &self,
        what: &Attachment,
        place: &str,
        job: &Job,
    ) -> Result<Option<AsideFolder>, AttachError> {
        let files = what.files();
        if files.is_empty() {
            return Ok(None);
        }
        let bare = match &what.what {
            What::Stack { raw: Some(raw), voxel_mm, .. } => Some((raw, edges(files, *voxel_mm)?)),
            _ => None,
        };
        if files.len() > MAX_FILES {
            let line = format!("{} files are more than {MAX_FILES}: attach fewer", files.len());
            return Err(AttachError::BadInput(line));
        }
        // What cannot be read is told before anything is copied.
        let mut names = HashSet::new();
        for file in files {
            access::open(file).map_err(|why| AttachError::denied(file, &why))?;
            bare.iter().try_for_each(|(raw, _)| raw.check(file))?;
            if bare.is_none() && mhd::is_header(file) {
                let data = mhd::VoxelHeader::read(file).map_err(|why| not_read(file, &why))?.data;
                access::open(&data).map_err(|why| AttachError::denied(&data, &why))?;
            }
            if !names.insert(plain_name(file)?) {
                let why = "another file of this name is attached with it: rename one of them";
                return Err(AttachError::BadInput(format!("{}: {why}", file.display())));
            }
        }
        let place = self.inside(place)?;
        if fs::symlink_metadata(&place).is_ok() {
            let why = "is there already: choose another --name, or move it away";
            return Err(AttachError::CannotWrite(format!("{}: {why}", place.display())));
        }
        let failed = |e: io::Error| AttachError::write(&self.folder, &e);
        let aside = AsideFolder::begin(&self.folder, ".attach-").map_err(failed)?;
        for (i, file) in files.iter().enumerate() {
            job.step(i, files.len()).map_err(LoadError::from)?;
            let (mut from, _) = access::open(file).map_err(|w| AttachError::denied(file, &w))?;
            let to = aside.path().join(plain_name(&copied_as(file, bare.map(|b| b.0)))?);
            file::put(&to, |out| match bare {
                Some((raw, voxel_mm)) => raw.write(file, voxel_mm, out),
                None if mhd::is_header(file) => mhd::VoxelHeader::read(file)
                    .map_err(io::Error::other)?
                    .write(file.parent().unwrap_or(Path::new("")), out),
                None => io::copy(&mut from, out).map(drop),
            })
            .map_err(failed)?;
        }
        Ok(Some(aside))
    }

    /// The index of a member's load test in the evidence.
    fn test_of(&self, member: &str, name: &str) -> Option<usize> {
        self.file.tests.iter().position(|t| t.member == member && t.name == name)
    }

    /// Whether something attached to a member has this name.
    fn is_taken(&self, scene: &Scene, member: &str, name: &str) -> bool {
        let observed = &scene.structure.observations;
        let photographs = &scene.structure.photographs;
        let slices = scene.members.iter().filter(|m| m.id == member).flat_map(|m| &m.slices);
        observed.iter().any(|o| o.member == member && o.name == name)
            || photographs.iter().any(|p| p.member == member && p.name == name)
            || slices.map(crate::Slices::name).any(|n| n == name)
            || self.file.tables.iter().any(|t| t.member == member && t.name == name)
            || self.test_of(member, name).is_some()
    }

    /// A name that nobody gave: its kind and a number, or that of its file.
    fn free_name(&self, scene: &Scene, what: &Attachment) -> String {
        let numbered: Box<dyn Fn(u32) -> String> = match &what.what {
            What::Finding(finding) => Box::new(|n| format!("{} {n}", finding.kind())),
            What::Slices { .. } | What::Stack { .. } => Box::new(|n| format!("core {n}")),
            What::Photograph { .. } => Box::new(|n| format!("photograph {n}")),
            What::LoadTest { .. } => Box::new(|n| format!("load test {n}")),
            // Rows are called after their table, with a number behind it.
            What::Table { file, .. } => {
                let stem = file.file_stem().unwrap_or_default().to_string_lossy();
                Box::new(move |n| if n == 1 { stem.to_string() } else { format!("{stem} ({n})") })
            }
        };
        let mut names = (1..).map(numbered);
        names.find(|name| !self.is_taken(scene, &what.member, name)).unwrap_or_default()
    }

    /// Takes away what was attached to a member under a name, with the copies of its files.
    ///
    /// # Errors
    /// Nothing of that name is there, other evidence names it, or the evidence cannot be written.
    pub fn detach(&self, member: &str, name: &str, job: &Job) -> Result<Detached, AttachError> {
        let (list, index, files) = self.find(member, name)?;
        let mut right = self.file.clone();
        match list {
            "items" => _ = right.items.remove(index),
            "tables" => _ = right.tables.remove(index),
            "tests" => _ = right.tests.remove(index),
            "photographs" => _ = right.photographs.remove(index),
            _ => _ = right.slices.remove(index),
        }
        let text = self.text.as_deref().unwrap_or_default();
        let text = self.sound(edit::remove(text, list, index), &right)?;
        self.spares(name, &text, job)?;
        let copies = self.copies(&files, &right);
        self.unchanged()?;
        write(&self.evidence(), &text)?;
        // The entry is gone: what is left of its files is no evidence any more.
        change::clear(&copies, &self.folder)?;
        Ok(Detached { removed: copies })
    }

    /// Refuses to take away what is named by other evidence: a load test by readings, a gauge by
    /// other tables.
    fn spares(&self, name: &str, left: &str, job: &Job) -> Result<(), AttachError> {
        // What does not load now may be mended so.
        if self.load(job).is_err() {
            return Ok(());
        }
        match Scene::load_proposed(&self.scene, left, &self.access, job) {
            Ok(_) => Ok(()),
            Err(error) => Err(match error.problems().first() {
                Some(problem) => AttachError::BadInput(format!(
                    "\"{}\" is named by {}: detach that first",
                    shorten(name),
                    problem.place
                )),
                None => AttachError::Load(error),
            }),
        }
    }

    /// The list and the index of an entry, and the paths that it names.
    fn find(
        &self,
        member: &str,
        name: &str,
    ) -> Result<(&'static str, usize, Vec<String>), AttachError> {
        let file = &self.file;
        let is = |m: &str, n: &str| m == member && n == name;
        if let Some(i) = file.items.iter().position(|r| is(&r.member, &r.name)) {
            return Ok(("items", i, file.items[i].picture.iter().cloned().collect()));
        }
        if let Some(i) = file.tables.iter().position(|t| is(&t.member, &t.name)) {
            return Ok(("tables", i, vec![file.tables[i].file.clone()]));
        }
        if let Some(i) = self.test_of(member, name) {
            return Ok(("tests", i, Vec::new()));
        }
        if let Some(i) = file.photographs.iter().position(|p| is(&p.member, &p.name)) {
            let Photo { file, picks, .. } = &file.photographs[i];
            return Ok(("photographs", i, vec![file.clone(), picks.clone()]));
        }
        let alone = |s: &MemberSlices| s.slices.len() == 1 && is(&s.member, s.slices[0].name());
        if let Some(i) = file.slices.iter().position(alone) {
            return Ok(("slices", i, images(&file.slices[i]).cloned().collect()));
        }
        Err(AttachError::BadInput(self.not_there(member, name)))
    }

    /// What to say of a name that is not attached.
    fn not_there(&self, member: &str, name: &str) -> String {
        let place = self.evidence().display().to_string();
        let file = &self.file;
        let row_of = |t: &&Survey| {
            let number = name.strip_prefix(t.name.as_str()).and_then(|n| n.strip_prefix(' '));
            t.member == member && number.is_some_and(|n| n.parse::<u32>().is_ok())
        };
        if let Some(table) = file.tables.iter().find(row_of) {
            return format!(
                "\"{}\" is a row of {}: take it out there, or detach \"{}\"",
                shorten(name),
                table.file,
                table.name
            );
        }
        let slices = file.slices.iter().flat_map(|s| s.slices.iter().map(move |one| (s, one)));
        if slices.clone().any(|(s, one)| s.member == member && one.name() == name) {
            let short = shorten(name);
            return format!(
                "{place}: \"{short}\" stands there beside other slices: take it out by hand"
            );
        }
        let items = file.items.iter().map(|r| (&r.member, r.name.as_str()));
        let tables = file.tables.iter().map(|t| (&t.member, t.name.as_str()));
        let tests = file.tests.iter().map(|t| (&t.member, t.name.as_str()));
        let photographs = file.photographs.iter().map(|p| (&p.member, p.name.as_str()));
        let all = items
            .chain(tables)
            .chain(tests)
            .chain(photographs)
            .chain(slices.map(|(s, one)| (&s.member, one.name())));
        let names: Vec<&str> = all.filter(|(m, _)| *m == member).map(|(_, n)| n).collect();
        let hint = match nearest(name, &names) {
            Some(meant) => format!("did you mean \"{}\"?", shorten(meant)),
            None if names.is_empty() => "nothing is: --list shows what is there".into(),
            None => format!("there are {}", shorten(&names.join(", "))),
        };
        let scene = self.load(&Job::default()).ok();
        let member = shorten(scene.as_ref().map_or(member, |scene| scene.name_of(member)));
        let short = shorten(name);
        format!("{place}: \"{short}\" is not attached to \"{member}\": {hint}")
    }

    /// Where copies lie, which is never outside of the project's folder.
    fn inside(&self, place: impl AsRef<Path>) -> Result<PathBuf, AttachError> {
        within(&self.folder, place).map_err(|why| AttachError::CannotWrite(why.to_string()))
    }

    /// Copies of files that nothing else names: those in a folder of their own below `evidence/`.
    /// What links lead to outside of the project are none.
    fn copies(&self, files: &[String], left: &EvidenceFile) -> Vec<PathBuf> {
        let named = |text: &str| {
            let tables = left.tables.iter().map(|t| &t.file);
            let pictures = left.items.iter().filter_map(|r| r.picture.as_ref());
            let photographs = left.photographs.iter().flat_map(|p| [&p.file, &p.picks]);
            let others = pictures.chain(photographs).chain(left.slices.iter().flat_map(images));
            tables.chain(others).any(|f| copy_of(f) == copy_of(text))
        };
        let mut copies = Vec::new();
        for text in files {
            let Some((folder, pattern)) = copy_of(text).filter(|_| !named(text)) else { continue };
            let Ok(place) = self.inside(Path::new(COPIES).join(folder).join(pattern)) else {
                continue;
            };
            let folder = place.parent().unwrap_or(&self.folder).to_owned();
            let stem = Path::new(pattern).file_stem().unwrap_or_default().to_string_lossy();
            let mask = format!("{stem}_mask-*");
            let is_copy = |name: &String| matches(pattern, name) || matches(&mask, name);
            let found = listing(&folder).unwrap_or_default().into_iter().filter(is_copy);
            copies.extend(found.map(|name| folder.join(name)));
        }
        copies.sort();
        copies.dedup();
        copies
    }
}

/// The folder of the copies, and that of the files that they were made of.
struct As {
    copies: Option<String>,
    given: String,
}

impl As {
    fn given(folder: &Path, aside: Option<&AsideFolder>, what: &Attachment) -> Self {
        let name = |dir: &AsideFolder| dir.path().file_name().unwrap_or_default().to_os_string();
        let given = what.files().first().and_then(|f| f.parent());
        Self {
            copies: aside.map(|dir| format!("{}/", folder.join(name(dir)).display())),
            given: given.map_or(String::new(), |folder| match folder.display().to_string() {
                folder if folder.is_empty() => folder,
                folder => format!("{folder}/"),
            }),
        }
    }

    /// A text about copies, about the files that were given.
    fn say(&self, text: &str) -> String {
        match &self.copies {
            Some(copies) => text.replace(copies, &self.given),
            None => text.to_owned(),
        }
    }
}

/// The first of several faults, and how many more there are. Nothing was written that anybody could
/// look at.
fn all_in_one(problems: &[crate::Problem], of_rows: bool) -> String {
    let errors: Vec<_> = problems.iter().filter(|p| p.severity == crate::Severity::Error).collect();
    let Some((first, rest)) = errors.split_first() else { return String::new() };
    let same = rest.iter().filter(|p| p.code == first.code).count();
    let faults = |n: usize| if n == 1 { "fault".to_owned() } else { "faults".to_owned() };
    let more = match (same, rest.len() - same) {
        (0, 0) => String::new(),
        (0, n) => format!(" (and {n} more {})", faults(n)),
        (1, 0) if of_rows => " (and one more row has the same fault)".to_owned(),
        (same, 0) if of_rows => format!(" (and {same} more rows have the same fault)"),
        (same, n) => format!(" (and {same} more of this fault, {n} of others)"),
    };
    format!("{first}{more}")
}

/// The text of a file of evidence, where there is one.
fn text_of(place: &Path) -> Result<Option<String>, AttachError> {
    match access::read(place, crate::file::MAX_BYTES as u64) {
        Ok(bytes) => String::from_utf8(bytes).map(Some).map_err(|_| {
            let why = "is not UTF-8 text: save it as UTF-8";
            AttachError::BadInput(format!("{}: {why}", place.display()))
        }),
        Err(Denied::System(e)) if e.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(why) => Err(AttachError::denied(place, &why)),
    }
}

/// The folder and the name of what a path names in a folder of its own below `evidence/`.
fn copy_of(text: &str) -> Option<(&str, &str)> {
    let (folder, name) = text.strip_prefix(COPIES)?.strip_prefix('/')?.split_once('/')?;
    let plain = |part: &str| {
        let mut parts = Path::new(part).components();
        matches!((parts.next(), parts.next()), (Some(Component::Normal(_)), None))
    };
    (plain(folder) && plain(name)).then_some((folder, name))
}

/// The images that slices name.
fn images(slices: &MemberSlices) -> impl Iterator<Item = &String> {
    slices.slices.iter().flat_map(|one| match one {
        Slices::Files { images, .. } | Slices::Stack { images, .. } => images.as_slice(),
        Slices::Drawn { .. } | Slices::Scanned { .. } => &[],
    })
}

fn not_read(file: &Path, why: &str) -> AttachError {
    AttachError::BadInput(format!("{}: {why}", file.display()))
}

/// What a copy of a file is called: bare voxels get a header, a header its voxels, and its ending.
fn copied_as(file: &Path, raw: Option<&Raw>) -> PathBuf {
    if raw.is_some() || mhd::is_header(file) { file.with_extension("mha") } else { file.to_owned() }
}

/// Edges of bare voxels, mm, which somebody has to say.
fn edges(files: &[PathBuf], voxel_mm: Option<[f32; 3]>) -> Result<[f32; 3], AttachError> {
    let [file] = files else {
        let why = "bare voxels are attached as one file of all slices".to_owned();
        return Err(AttachError::BadInput(why));
    };
    let sound = |mm: &[f32; 3]| mm.iter().all(|mm| mm.is_finite() && *mm > 0.0);
    voxel_mm.filter(sound).ok_or_else(|| {
        let why = "does not say how large its voxels are: add --voxel-mm X,Y,Z";
        AttachError::BadInput(format!("{}: {why}", file.display()))
    })
}

/// A file's name, if a scene can name it.
fn plain_name(file: &Path) -> Result<String, AttachError> {
    let name = file.file_name().and_then(|n| n.to_str());
    let fits = |n: &&str| !n.contains(['*', '?', '$']) && !n.chars().any(char::is_control);
    name.filter(fits).map(str::to_owned).ok_or_else(|| {
        let why = "has a name that a scene cannot hold: rename it to letters and digits";
        AttachError::BadInput(format!("{}: {why}", file.display()))
    })
}

/// The images among files, as a scene names them: one by its name, several by their endings.
fn patterns(files: &[PathBuf], at: &str) -> Result<Vec<String>, AttachError> {
    let names = files.iter().map(|f| plain_name(f)).collect::<Result<Vec<_>, _>>()?;
    if let [name] = &names[..] {
        return Ok(vec![format!("{at}/{name}")]);
    }
    let ending = |name: &String| name.rsplit_once('.').map(|(_, e)| format!("{at}/*.{e}"));
    let mut patterns: Vec<String> = names.iter().filter_map(ending).collect();
    patterns.sort();
    patterns.dedup();
    Ok(patterns)
}

fn write(path: &Path, text: &str) -> Result<(), AttachError> {
    if fs::symlink_metadata(path).is_ok_and(|facts| facts.is_symlink()) {
        let why = "is a link, and writing would put a file in its place: put the file itself there";
        return Err(AttachError::CannotWrite(format!("{}: {why}", path.display())));
    }
    file::put(path, |out| io::Write::write_all(out, text.as_bytes()))
        .map_err(|e| AttachError::write(path, &e))
}

/// What will be attached. Dropped without [`Proposal::commit`], nothing has happened.
#[derive(Debug)]
pub struct Proposal<'a> {
    project: &'a Project,
    /// The scene as it will be; files of slices are read from where they were copied aside.
    pub scene: Scene,
    /// Its name.
    pub name: String,
    /// What will be known then and is not now.
    pub added: Vec<Listed>,
    /// What the user should know of it.
    pub notes: Vec<String>,
    text: String,
    aside: Option<AsideFolder>,
    /// Where the copies go, relative to the scene.
    place: String,
}

impl Proposal<'_> {
    /// Puts copies and evidence in their places. Gives the copies.
    ///
    /// # Errors
    /// Something cannot be written; then nothing has changed.
    pub fn commit(self) -> Result<Vec<PathBuf>, AttachError> {
        let project = self.project;
        project.unchanged()?;
        let mut copies = Vec::new();
        let place = project.inside(&self.place)?;
        if let Some(aside) = self.aside {
            let failed = |e: io::Error| AttachError::write(&place, &e);
            fs::create_dir_all(project.folder.join(COPIES)).map_err(failed)?;
            aside.settle(&place).map_err(failed)?;
            let names = listing(&place).map_err(AttachError::Load)?;
            copies = names.into_iter().map(|name| place.join(name)).collect();
        }
        let written = write(&project.evidence(), &self.text);
        if written.is_err() && !copies.is_empty() {
            // Nobody names them.
            let _ = fs::remove_dir_all(&place);
        }
        written.map(|()| copies)
    }
}

/// What was taken away.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Detached {
    /// Copies of files that were removed.
    pub removed: Vec<PathBuf>,
}
