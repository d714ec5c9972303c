//! The scene file: RON, `schema: "intrados.scene/1"`, design in the README of this crate.
//!
//! [`parse`] turns text into a [`SceneFile`], [`check`] lists everything that is wrong in it. Both
//! are total: any text ends in a value or in problems with their places. Lengths are metres unless
//! the field's name says otherwise, angles degrees, times days.
//!
//! A member has a frame of its own, (r-θ-z for round ones): its axis, and two directions across.
//! Which directions of the world these are goes round x → y → z → x:
//!
//! | member | axis | `angle_deg: 0` | `angle_deg: 90` |
//! |---|---|---|---|
//! | column | +y, from the foot | +z, front | +x |
//! | beam, box girder | +x | +y, top (180 is the soffit) | +z, front |
//! | tunnel | +z | +x | +y, crown |

mod buried;
mod check;
mod doubt;
pub mod evidence;
mod image;
mod member;
pub(crate) mod mhd;
mod obj;
pub mod reference;
mod resolve;
mod scenery;
mod slices;

use std::ops::Range;

use ron::{error::SpannedError, extensions::Extensions};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::{problem::Problem, scene::Transport, structure::*};

pub use check::check;
pub(crate) use check::concrete_class;
pub(crate) use check::unknown_members;
pub(crate) use doubt::{CLASSES, doubts, unloaded};
pub(crate) use image::MAX_TEXELS;
pub use member::{Assumed, Detail, Grading, Member, Slices};
pub(crate) use obj::{ObjPart, read_parts as read_obj_parts};
pub(crate) use resolve::{bare_model, resolve};
pub use scenery::*;
pub(crate) use slices::{extension, is_image, listing, matches};

/// The schema that this version reads.
pub const SCHEMA: &str = "intrados.scene/1";

/// Where all fields of scenes and evidence are listed.
const PAGE: &str = "`intrados schema --page`";

/// Longest scene text that is read, bytes. Geometry beyond that belongs into a glTF file.
pub const MAX_BYTES: usize = 64 << 20;

/// Deepest nesting of brackets that is followed. The schema itself needs less than 16.
const MAX_DEPTH: usize = 64;

/// A whole scene as written. Every section may be left out.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    /// [`SCHEMA`].
    pub schema: String,
    /// Title, for people.
    #[serde(default)]
    pub title: String,
    /// Whose structure it is, and why it is looked at: the cover of its report.
    #[serde(default)]
    pub project: Project,
    /// Where it stands on earth.
    #[serde(default)]
    pub georeference: Georeference,
    /// What surfaces do with light.
    #[serde(default)]
    pub materials: Vec<Material>,
    /// Simple shapes that are no members: walls, floors, lamps.
    #[serde(default)]
    pub shapes: Vec<Shape>,
    /// glTF files.
    #[serde(default)]
    pub models: Vec<Model>,
    /// Concretes that are no class of Eurocode 2.
    #[serde(default)]
    pub concretes: Vec<Concrete>,
    /// Parametric members.
    #[serde(default)]
    pub members: Vec<Member>,
    /// More about members of glTF files and about the segments of a lining.
    #[serde(default)]
    pub details: Vec<Detail>,
    /// Lamps that are no surfaces.
    #[serde(default)]
    pub lamps: Vec<Lamp>,
    /// Cameras; the first is the one to look through.
    #[serde(default)]
    pub cameras: Vec<Camera>,
    /// Light meters.
    #[serde(default)]
    pub meters: Vec<Meter>,
    /// X-ray scanners.
    #[serde(default)]
    pub scanners: Vec<Scanner>,
    /// What holds the members.
    #[serde(default)]
    pub supports: Vec<Support>,
    /// How members are joined to the whole where touching does not tell.
    #[serde(default)]
    pub joints: Vec<MemberJoint>,
    /// What they carry.
    #[serde(default)]
    pub loads: Vec<Load>,
    /// Load tests.
    #[serde(default)]
    pub tests: Vec<Test>,
    /// Gauges of strain, displacement and stress.
    #[serde(default)]
    pub gauges: Vec<Gauge>,
    /// What gauges and meters were read to show on site.
    #[serde(default)]
    pub readings: Vec<Reading>,
    /// How far light is followed, where that matters: a scene that others measure at a certain
    /// depth.
    #[serde(default)]
    pub transport: Transport,
    /// Air about the members.
    #[serde(default)]
    pub climate: Climate,
    /// By which profile damage becomes a state.
    #[serde(default)]
    pub grading: Option<Grading>,
    /// Files of evidence, relative to the scene file; `evidence.ron` beside the scene is read
    /// without being named.
    #[serde(default)]
    pub evidence: Vec<String>,
}

/// Reads scene text. `name` is the file's name in messages.
///
/// # Errors
/// A problem whose place is `name:line:column`.
pub fn parse(name: &str, text: &str) -> Result<SceneFile, Problem> {
    // Evidence has fields of its own, of which the first would be all that is said.
    let head = text.split_once(evidence::SCHEMA).map_or("", |(head, _)| head);
    if head.trim_end().ends_with("schema: \"") {
        let message = "is evidence and no scene: open the scene that it belongs to, which reads it";
        return Err(Problem::error(name, "SCHEMA", message));
    }
    let scene: SceneFile = read(name, text, PAGE)?;
    known_schema(name, text, &scene.schema, SCHEMA)?;
    Ok(scene)
}

/// Reads RON of a schema of somebody else's, as scenes are read: `schema` is the one that is known,
/// `found` the one that is written, and `page` says where its fields are listed.
///
/// # Errors
/// A problem whose place is `name:line:column`.
pub fn parse_ron<T: DeserializeOwned>(
    name: &str,
    text: &str,
    schema: &str,
    found: impl FnOnce(&T) -> &str,
    page: &str,
) -> Result<T, Problem> {
    let value = read(name, text, page)?;
    known_schema(name, text, found(&value), schema)?;
    Ok(value)
}

/// Reads RON of any schema, whose fields are listed on a page.
fn read<T: DeserializeOwned>(name: &str, text: &str, page: &str) -> Result<T, Problem> {
    if text.len() > MAX_BYTES {
        let message = format!(
            "the text has {} MiB, more than {}: move geometry into a glTF file",
            text.len() >> 20,
            MAX_BYTES >> 20
        );
        return Err(Problem::error(name, "TOO_LONG", message));
    }
    // What some editors put before a text says nothing.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let options = ron::Options::default()
        .with_default_extension(Extensions::IMPLICIT_SOME)
        .with_recursion_limit(MAX_DEPTH);
    options.from_str(text).map_err(|e| syntax_problem(name, text, &e, page))
}

/// Refuses a schema of another version.
fn known_schema(name: &str, text: &str, found: &str, known: &str) -> Result<(), Problem> {
    if found == known {
        return Ok(());
    }
    let at = text.find("schema").map_or(0..0, |i| i..i);
    let (line, column) = line_and_column(text, at);
    let message =
        format!("schema \"{}\" is not known here: this version reads \"{known}\"", shorten(found));
    Err(Problem::error(format!("{name}:{line}:{column}"), "SCHEMA", message))
}

fn line_and_column(text: &str, at: Range<usize>) -> (usize, usize) {
    let before = text.get(..at.start).unwrap_or("");
    let line_begin = before.rfind('\n').map_or(0, |i| i + 1);
    (before.matches('\n').count() + 1, before.get(line_begin..).unwrap_or("").chars().count() + 1)
}

/// The first words of a text that somebody else wrote, without line breaks.
pub(crate) fn shorten(text: &str) -> String {
    let short: String =
        text.chars().take(60).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if short.len() < text.len() { short + "…" } else { short }
}

/// One line that says what, where and what to do.
fn syntax_problem(name: &str, text: &str, error: &SpannedError, page: &str) -> Problem {
    use ron::Error as E;
    let (line, column) = (error.span.start.line, error.span.start.col);
    let decimal = decimal_comma(text, line, column);
    let curly = curly_quote(text, line, column);
    let meant = |word: &str| format!("did you mean `{word}`?");
    let remedy = match &error.code {
        _ if curly.is_some() => curly.unwrap_or_default(),
        _ if decimal.is_some() => decimal.unwrap_or_default(),
        E::NoSuchStructField { expected, found, .. } => nearest(found, expected)
            .map_or_else(|| format!("take it out; {page} lists every field"), meant),
        // Which there are, `what` says.
        E::NoSuchEnumVariant { expected, found, .. } => nearest(found, expected)
            .map_or_else(|| format!("{page} shows each of them with its fields"), meant),
        E::MissingStructField { field, .. } => format!("add `{field}: …`"),
        E::DuplicateStructField { .. } => "keep one of them".into(),
        E::ExpectedComma => "put a comma between the fields, or close the bracket".into(),
        E::Eof => "a bracket or a quote is not closed".into(),
        E::ExceededRecursionLimit => format!("brackets may be nested {MAX_DEPTH} deep"),
        E::UnclosedBlockComment => "close it with `*/`".into(),
        E::TrailingCharacters => "the scene ended before this; look for a bracket too many".into(),
        _ => format!("{page} lists every field with an example"),
    };
    let what: String = error
        .code
        .to_string()
        .chars()
        .take(300)
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect();
    Problem::error(format!("{name}:{line}:{column}"), "SYNTAX", format!("{what}; {remedy}"))
}

/// What to do about a quote that a word processor has bent, where the reader stumbled over it: no
/// text that is quoted as it should be ends there.
fn curly_quote(text: &str, line: usize, column: usize) -> Option<String> {
    const BENT: [char; 7] = ['“', '”', '„', '«', '»', '‘', '’'];
    let line: Vec<char> = text.lines().nth(line.checked_sub(1)?)?.chars().take(10_000).collect();
    let near = column.saturating_sub(2)..(column + 1).min(line.len());
    let bent = line.get(near)?.iter().find(|c| BENT.contains(c))?;
    Some(format!("{bent} is a bent quote of a word processor: write straight ones, \""))
}

/// What to do about a decimal comma, where the reader stumbled behind one: digits, a comma, digits.
fn decimal_comma(text: &str, line: usize, column: usize) -> Option<String> {
    let line: Vec<char> = text.lines().nth(line.checked_sub(1)?)?.chars().take(10_000).collect();
    let digits = |part: &[char]| part.iter().take_while(|c| c.is_ascii_digit()).collect::<String>();
    let comma = (column.checked_sub(3)?..column).find(|&i| line.get(i) == Some(&','))?;
    let whole: String =
        digits(&line[..comma].iter().rev().copied().collect::<Vec<_>>()).chars().rev().collect();
    let part = digits(line.get(comma + 1..)?);
    let is_number = !whole.is_empty() && !part.is_empty();
    is_number.then(|| format!("is that a decimal comma? write {whole}.{part}, not {whole},{part}"))
}

/// The word that `found` was probably meant to be.
pub(crate) fn nearest<'a>(found: &str, words: &[&'a str]) -> Option<&'a str> {
    let found: String = found.chars().take(64).collect();
    let (distance, word) = words.iter().map(|w| (edit_distance(&found, w), *w)).min()?;
    (distance <= 1 + found.len() / 3).then_some(word)
}

/// Levenshtein's distance.
pub(crate) fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.to_lowercase().chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.to_lowercase().chars().enumerate() {
        let mut left = i + 1;
        let mut above_left = i;
        for (cell, &y) in row.iter_mut().skip(1).zip(&b) {
            let best = (above_left + usize::from(x != y)).min(left + 1).min(*cell + 1);
            above_left = std::mem::replace(cell, best);
            left = best;
        }
        if let Some(first) = row.first_mut() {
            *first = i + 1;
        }
    }
    row.last().copied().unwrap_or(0)
}
