//! Evidence in files of its own, so that nobody need touch the scene: `evidence.ron`,
//! `schema: "intrados.evidence/1"`, beside the scene or named by it, and the tables (CSV) that it
//! names.
//!
//! [`parse`] turns text into an [`EvidenceFile`], [`check`] lists what is wrong in it by itself,
//! [`gather`] reads all that a scene has, and [`place`] puts it on the scene's members.

mod along;
mod check;
mod day;
mod face;
mod layout;
mod place;
mod table;
mod units;

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
};

use intrados_stage::Job;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use along::Along;
pub use check::check;
pub(crate) use face::Sort;
pub use face::{Face, FaceError};
pub(crate) use place::{no_member, place};
pub(crate) use table::{RawReading, read as read_table};

use super::{PAGE, SceneFile, Slices, known_schema, read};
use crate::{
    LoadError,
    load::Sources,
    problem::Problem,
    structure::{Course, Date, Electrode, Gauge, Reading, Test},
};

/// The schema of evidence that this version reads.
pub const SCHEMA: &str = "intrados.evidence/1";

/// The name under which evidence is found beside a scene.
pub(crate) const NAME: &str = "evidence.ron";

/// Most rows of all tables of a file.
const MAX_ROWS: usize = 200_000;

/// Longest table that is read, bytes.
pub(crate) const MAX_TABLE: u64 = 16 << 20;

/// Evidence as written. Every section may be left out.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EvidenceFile {
    /// [`SCHEMA`].
    pub schema: String,
    /// What was measured or seen, one by one.
    #[serde(default)]
    pub items: Vec<Record>,
    /// Files of many observations or readings.
    #[serde(default)]
    pub tables: Vec<Survey>,
    /// CT slices of members.
    #[serde(default)]
    pub slices: Vec<MemberSlices>,
    /// Photographs that are read: what they show of their members is evidence.
    #[serde(default)]
    pub photographs: Vec<Photo>,
    /// Load tests, as those of the scene.
    #[serde(default)]
    pub tests: Vec<Test>,
    /// Gauges, as those of the scene.
    #[serde(default)]
    pub gauges: Vec<Gauge>,
    /// What gauges and meters were read to show, those of the scene too.
    #[serde(default)]
    pub readings: Vec<Reading>,
}

/// One thing that was measured or seen on a member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// Id of the member.
    pub member: String,
    /// Name, unique within the member.
    pub name: String,
    /// When, as `"2026-05-03"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub date: Option<Date>,
    /// Where on the axis, 0 to 1, or from and to: `(0.3, 0.5)`. Anywhere where it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub along: Option<Along>,
    /// On which face.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub face: Option<Face>,
    /// On which side, degrees about the axis, instead of a face.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f32>,
    /// Above the member's lowest point, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f32>,
    /// What it was measured with, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instrument: Option<String>,
    /// A photograph of it for the report, JPEG or PNG, relative to this file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub picture: Option<String>,
    /// It is meant as it is written, and counts however much it is doubted.
    #[serde(default, skip_serializing_if = "is_usual")]
    pub confirmed: bool,
    /// What was found.
    pub shows: Finding,
}

/// What was found. A standard error that is left out is the usual one of the instrument.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Finding {
    /// Concrete over the nearest steel, by a cover meter.
    Cover {
        /// The cover.
        mm: f64,
        /// 2 mm or 10 %, whichever is more, where it is left out.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        std_error_mm: Option<f64>,
    },
    /// Rebound number of EN 12504-2: the median of a place's readings.
    Rebound {
        /// The number, without a unit.
        number: f64,
        /// 2 where it is left out.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        std_error: Option<f64>,
    },
    /// Velocity of an ultrasonic pulse by EN 12504-4.
    Velocity {
        /// The velocity.
        m_s: f64,
        /// 2 % where it is left out.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        std_error_m_s: Option<f64>,
    },
    /// Compressive strength of a core as it was tested (EN 12504-1).
    CoreStrength {
        /// The strength.
        mpa: f64,
        /// 5 % where it is left out.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        std_error_mpa: Option<f64>,
        /// Of the core.
        diameter_mm: f64,
        /// Of the core as tested.
        length_mm: f64,
    },
    /// Potential of the steel by ASTM C876.
    HalfCell {
        /// As the instrument showed it, mostly negative.
        mv: f64,
        /// 10 mV where it is left out.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        std_error_mv: Option<f64>,
        /// What it was measured against; copper/copper sulphate where it is left out.
        #[serde(default, skip_serializing_if = "is_usual")]
        electrode: Electrode,
    },
    /// Chlorides by depth (EN 14629), as % of the mass of cement or of concrete.
    Chloride {
        /// Below the surface, the middle of each sample, rising.
        depths_mm: Vec<f64>,
        /// Of each sample, % of the mass of cement.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        percent_of_cement: Vec<f64>,
        /// Instead, % of the mass of concrete: counted with the cement that the scene's concrete
        /// has by its `hydration`, else with 350 kg in 2400 kg.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        percent_of_concrete: Vec<f64>,
        /// Of each of these; .03 % of cement or 10 % of their mean, whichever is more, where it is
        /// left out.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        std_error_percent: Option<f64>,
    },
    /// Depth of carbonation by phenolphthalein (EN 14630).
    Carbonation {
        /// The depth.
        mm: f64,
        /// 1 mm or 10 %, whichever is more, where it is left out.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        std_error_mm: Option<f64>,
    },
    /// Area that sounds hollow under the hammer.
    Sounding {
        /// Area that sounds hollow; 0 where none does.
        hollow_m2: f64,
        /// Area that was tapped.
        tapped_m2: f64,
    },
    /// A crack.
    Crack {
        /// On the surface.
        width_mm: f64,
        /// .05 mm or 10 %, whichever is more, where it is left out.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        std_error_mm: Option<f64>,
        /// How it runs.
        course: Course,
        /// How long it is.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        length_m: Option<f64>,
    },
    /// Concrete that has come off.
    Spall {
        /// Its area.
        area_m2: f64,
        /// Its depth.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        depth_mm: Option<f64>,
        /// Whether steel lies bare in it; no where it is left out.
        #[serde(default, skip_serializing_if = "is_usual")]
        bars_bare: bool,
    },
    /// Stains of rust.
    Rust {
        /// Their area.
        area_m2: f64,
    },
    /// Lime and salts brought out by water.
    Efflorescence {
        /// Their area.
        area_m2: f64,
    },
    /// A wet spot.
    WetSpot {
        /// Its area.
        area_m2: f64,
    },
    /// It was looked at there, and nothing was found.
    Intact,
}

impl Finding {
    /// Its kind, as [`Shows::kind`](crate::structure::Shows::kind) has it.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Cover { .. } => "cover",
            Self::Rebound { .. } => "rebound",
            Self::Velocity { .. } => "velocity",
            Self::CoreStrength { .. } => "core strength",
            Self::HalfCell { .. } => "half-cell",
            Self::Chloride { .. } => "chloride",
            Self::Carbonation { .. } => "carbonation",
            Self::Sounding { .. } => "sounding",
            Self::Crack { .. } => "crack",
            Self::Spall { .. } => "spall",
            Self::Rust { .. } => "rust",
            Self::Efflorescence { .. } => "efflorescence",
            Self::WetSpot { .. } => "wet spot",
            Self::Intact => "intact",
        }
    }
}

/// A table (CSV) of many observations of one kind on a member, one a row, or of readings of gauges.
/// Its columns tell which: `mV`, `cover_mm`, `rebound`, `velocity_m_s`, `carbonation_mm`,
/// `depth_mm` with `chloride_percent_cement` or `chloride_percent_concrete`, or `gauge` with
/// `value`. Beside these: `along`, `face`, `angle_deg`, `height_m`, `date`, `std_error` (in the
/// value's unit, or in its own, `std_error [mm]`), beside `value` its `unit` and, of gauges,
/// `test`. A grid has places across a face as its columns (`height_m,0.25,0.50`), and its kind is
/// given. Of gauges, `along` with `face` or `angle_deg`, and `depth_mm`, are where a gauge is: one
/// that is not known yet is defined by them, to measure strain along the axis (`ue`, `m/m`) or
/// displacement upwards (`mm`, `m`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Survey {
    /// Path, relative to this file. Columns are parted by `,`, `;` or tabs; with `;` and tabs a
    /// number may have a decimal comma.
    pub file: String,
    /// Id of the member.
    pub member: String,
    /// Name, unique within the member; its rows are called after it: `NAME 1`, `NAME 2` …
    pub name: String,
    /// When, of rows that do not say it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub date: Option<Date>,
    /// Where on the axis, 0 to 1 or from and to, of rows that do not say it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub along: Option<Along>,
    /// On which face, of rows that do not say it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub face: Option<Face>,
    /// On which side, degrees about the axis, of rows that do not say it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f32>,
    /// Above the member's lowest point, of rows that do not say it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f32>,
    /// What it was measured with, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instrument: Option<String>,
    /// Of half-cell potentials: what they were measured against; copper/copper sulphate where it is
    /// left out.
    #[serde(default, skip_serializing_if = "is_usual")]
    pub electrode: Electrode,
    /// What the column `value` holds where the table names no gauges.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<Kind>,
    /// In which unit the column `value` is, unless a column `unit` says it row by row: of gauges
    /// `"ue"` (millionths), `"m/m"`, `"mm"`, `"m"` or `"MPa"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Of gauges: the load test, of rows that do not name one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub test: Option<String>,
    /// All rows are meant as they are written, and count however much they are doubted.
    #[serde(default, skip_serializing_if = "is_usual")]
    pub confirmed: bool,
}

/// What a column `value` holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Kind {
    /// Cover, in mm or cm.
    Cover,
    /// Rebound numbers, without a unit.
    Rebound,
    /// Pulse velocity, in m/s or km/s.
    Velocity,
    /// Half-cell potential, in mV or V.
    HalfCell,
    /// Depth of carbonation, in mm or cm.
    Carbonation,
}

/// A photograph of a member, whose light is taken off and whose damage is read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Photo {
    /// Path, relative to this file: JPEG, PNG or TIFF.
    pub file: String,
    /// Table of picks (CSV), relative to this file: `u`, `v` in pixels of the upright photograph
    /// and `x`, `y`, `z` in m, or `member`, `corner`; of a tag that is stuck on (AprilTag 36h11)
    /// `tag`, `size_mm`, `member`, `face`, `along`, `across_mm`, `turn_deg`.
    pub picks: String,
    /// Id of the member.
    pub member: String,
    /// Name, unique within the member.
    pub name: String,
    /// When, as `"2026-05-03"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub date: Option<Date>,
    /// Focal length in pixels; what EXIF says where it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focal_px: Option<f64>,
    /// Standard error of a pick; 2 where it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub picking_px: Option<f64>,
    /// Standard error of where shadows lie on the faces; 20 where it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shadow_error_mm: Option<f64>,
}

/// CT slices of a member.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MemberSlices {
    /// Its id.
    pub member: String,
    /// Slices of files, as the scene takes them; paths are relative to this file.
    pub slices: Vec<Slices>,
}

/// Whether a value need not be written.
fn is_usual<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// Something with the place in a file that it comes from, for messages.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Placed<T> {
    /// `evidence.ron: items[3]`, or `table.csv:7`.
    pub(crate) place: String,
    /// Whether it is a row of a table.
    pub(crate) is_row: bool,
    pub(crate) what: T,
}

impl<T> Placed<T> {
    /// The place of one of its fields.
    pub(crate) fn field(&self, name: &str) -> String {
        let joint = if self.is_row { ": column " } else { "." };
        format!("{}{joint}{name}", self.place)
    }
}

/// The evidence of one file with its tables, each read and checked by itself.
#[derive(Debug, Clone, Default)]
pub(crate) struct Evidence {
    /// The file's name in messages.
    pub(crate) name: String,
    /// Where it lies: what it names is relative to this.
    pub(crate) folder: PathBuf,
    pub(crate) file: EvidenceFile,
    /// Items of the file and rows of its tables.
    pub(crate) records: Vec<Placed<Record>>,
    /// Rows of its tables of gauges.
    pub(crate) readings: Vec<Placed<RawReading>>,
    /// Photographs and their picks that it names, and where they are.
    pub(crate) pictures: HashMap<String, PathBuf>,
    /// What of its tables was passed over.
    pub(crate) notes: Vec<String>,
}

/// A file of evidence in which nothing is said yet: of what (`name`), with examples for the member
/// `id` as comments. Both in the form that RON takes within quotes. Sides are angles, since no face
/// has the same name on all members.
pub(crate) fn skeleton(name: &str, id: &str) -> String {
    let sides = [("face: Front,", "angle_deg: 0,"), ("face: Right,", "angle_deg: 90,")];
    let any = sides.iter().fold(SKELETON.to_owned(), |text, (face, side)| text.replace(face, side));
    any.replace("NAME", name).replace("C1", id)
}

/// The same for a scene `NAME.ron` alone, which no command writes.
pub(crate) fn beside(name: &str, id: &str) -> String {
    skeleton(name, id).replace(
        "Every command that reads the scene beside this file reads it, too.\n// `intrados attach` and `intrados detach` write here; `intrados schema --page`",
        "Every command that reads that scene reads this file, too.\n// `intrados attach` writes evidence.ron beside it; `intrados schema --page`",
    )
}

const SKELETON: &str = include_str!("skeleton.ron");

/// The examples of the skeleton as evidence.
pub(crate) fn examples() -> String {
    SKELETON.replace("// (", "(")
}

/// Reads evidence. `name` is the file's name in messages.
///
/// # Errors
/// A problem whose place is `name:line:column`.
pub fn parse(name: &str, text: &str) -> Result<EvidenceFile, Problem> {
    let file: EvidenceFile = read(name, text, PAGE)?;
    known_schema(name, text, &file.schema, SCHEMA)?;
    Ok(file)
}

/// Reads the evidence that a scene names, and what lies beside it. What is wrong in it goes to
/// `problems`; the hash covers it all.
///
/// # Errors
/// A file is missing or may not be read.
pub(crate) fn gather(
    scene: &SceneFile,
    sources: &mut Sources,
    problems: &mut Vec<Problem>,
    job: &Job,
) -> Result<Vec<Evidence>, LoadError> {
    let mut paths = Vec::new();
    for text in &scene.evidence {
        paths.push(sources.path(text)?);
    }
    let beside: Vec<PathBuf> = sources.evidence().filter(|path| !paths.contains(path)).collect();
    paths.extend(beside);
    let mut all = Vec::new();
    for path in paths {
        job.step(0, 0)?;
        let bytes = sources.read(&path, super::MAX_BYTES as u64)?;
        let name = path.display().to_string();
        let Ok(text) = String::from_utf8(bytes) else {
            let message = "is not UTF-8 text: save it as UTF-8";
            problems.push(Problem::error(name, "NOT_TEXT", message));
            continue;
        };
        match parse(&name, &text) {
            Ok(file) => {
                let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
                let mut one = Evidence::of(name, folder, file, problems, |folder, text| {
                    let path = sources.path_from(folder, text)?;
                    Ok((path.display().to_string(), sources.read(&path, MAX_TABLE)?))
                })?;
                one.find_pictures(sources, job)?;
                all.push(one);
            }
            Err(problem) => problems.push(problem),
        }
    }
    Ok(all)
}

impl Evidence {
    /// Finds the photographs that it names, which go into the hash.
    fn find_pictures(&mut self, sources: &mut Sources, job: &Job) -> Result<(), LoadError> {
        let items = self.file.items.iter().enumerate();
        let pictures = items.filter_map(|(i, record)| {
            Some((format!("items[{i}].picture"), record.picture.as_ref()?))
        });
        let photographs = self.file.photographs.iter().enumerate().flat_map(|(i, photo)| {
            let at = |field: &str| format!("photographs[{i}].{field}");
            [(at("file"), &photo.file), (at("picks"), &photo.picks)]
        });
        for (field, text) in pictures.chain(photographs) {
            let place = format!("{}: {field}", self.name);
            let path = sources.path_from(&self.folder, text).map_err(|e| e.under(&place))?;
            sources.hash_file(&path, job).map_err(|e| e.under(&place))?;
            self.pictures.insert(text.clone(), path);
        }
        Ok(())
    }

    /// Checks a file, and reads its tables by `open`, which gives a table's name in messages and its
    /// bytes for the folder of the file and the path in it.
    ///
    /// # Errors
    /// What `open` says.
    pub(crate) fn of(
        name: String,
        folder: PathBuf,
        file: EvidenceFile,
        problems: &mut Vec<Problem>,
        mut open: impl FnMut(&Path, &str) -> Result<(String, Vec<u8>), LoadError>,
    ) -> Result<Self, LoadError> {
        let wrong = check(&file);
        let sound = wrong.is_empty();
        problems.extend(wrong.into_iter().map(|mut p| {
            p.place = format!("{name}: {}", p.place);
            p
        }));
        let item = |(i, record): (usize, &Record)| Placed {
            place: format!("{name}: items[{i}]"),
            is_row: false,
            what: record.clone(),
        };
        let records = file.items.iter().enumerate().map(item).collect();
        let mut evidence = Self { records, name, folder, file, ..Self::default() };
        for (i, survey) in evidence.file.tables.iter().enumerate().filter(|_| sound) {
            let place = format!("{}: tables[{i}].file", evidence.name);
            let (name, bytes) =
                open(&evidence.folder, &survey.file).map_err(|e| e.under(&place))?;
            match read_table(&name, &bytes, survey) {
                Ok(rows) => {
                    evidence.notes.extend(rows.notes);
                    evidence.records.extend(rows.records);
                    evidence.readings.extend(rows.readings);
                    if evidence.records.len() + evidence.readings.len() > MAX_ROWS {
                        let message = format!(
                            "has more than {MAX_ROWS} rows with the tables before it: split the evidence"
                        );
                        problems.push(Problem::error(place, "TOO_MANY", message));
                        break;
                    }
                }
                Err(wrong) => problems.extend(wrong),
            }
        }
        Ok(evidence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a user takes the comment signs from is sound.
    #[test]
    fn the_examples_of_the_skeleton_are_evidence() {
        let empty = EvidenceFile { schema: SCHEMA.into(), ..EvidenceFile::default() };
        assert_eq!(parse("e.ron", &skeleton("bridge.ifc", "P/1")).unwrap(), empty);
        let file = parse("e.ron", &examples()).unwrap();
        assert_eq!(check(&file), []);
        assert_eq!([file.items.len(), file.tables.len(), file.slices.len()], [15, 4, 2]);
        let kinds: std::collections::BTreeSet<_> =
            file.items.iter().map(|item| item.shows.kind()).collect();
        assert_eq!(kinds.len(), 14, "one of every kind: {kinds:?}");
        assert_eq!(file.photographs.len(), 1);
        let any = parse("e.ron", &skeleton("bridge.ifc", "P/1").replace("// (", "(")).unwrap();
        assert_eq!([any.items.len(), any.tables.len()], [15, 4]);
        assert!(any.items.iter().all(|item| item.face.is_none()), "a face that some have not");
        assert!(any.tables.iter().all(|table| table.face.is_none()), "a face that some have not");
        assert_eq!([file.tests.len(), file.gauges.len(), file.readings.len()], [1, 1, 1]);
    }
}
