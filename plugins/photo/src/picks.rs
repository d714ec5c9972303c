//! Tables of picks: which place is where in which photograph.

use std::path::{Path, PathBuf};

use glam::DVec3;
use intrados_scene::Scene;
use intrados_stage::access::{self, Denied};

use crate::{Pick, site::Site};

/// Longest table, bytes.
const LONGEST: u64 = 1 << 20;
const COLUMNS: [&str; 8] = ["photo", "u", "v", "x", "y", "z", "member", "corner"];

/// A row of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct PickedIn {
    /// Name of the photograph's file; `None`: of the only one.
    pub photo: Option<String>,
    /// The pick.
    pub pick: Pick,
}

/// Why a table of picks is not read.
#[derive(Debug, thiserror::Error)]
pub enum PicksError {
    /// It is not there, or no file.
    #[error("{}: {source}", path.display())]
    Denied {
        /// The table.
        path: PathBuf,
        /// Why.
        source: Denied,
    },
    /// What is wrong, where, and what to do.
    #[error("{}{}: {what}", path.display(), line.map_or(String::new(), |line| format!(":{line}")))]
    Bad {
        /// The table.
        path: PathBuf,
        /// Line of the table, from 1.
        line: Option<u64>,
        /// What is wrong, and what to do.
        what: String,
    },
}

/// Reads a table with a head: `u`, `v` (pixels of the upright photograph from its top left), and
/// either `x`, `y`, `z` (m) or `member`, `corner` (id or name, and the number that `intrados photo
/// SCENE --corners MEMBER` prints); `photo` (a file's name) where it is of several photographs.
///
/// # Errors
/// [`PicksError`]: file, line and remedy.
pub fn read(path: &Path, scene: &Scene, site: &Site) -> Result<Vec<PickedIn>, PicksError> {
    let denied = |source| PicksError::Denied { path: path.to_owned(), source };
    let bytes = access::read(path, LONGEST).map_err(denied)?;
    parse(&bytes, scene, site).map_err(|(line, what)| PicksError::Bad {
        path: path.to_owned(),
        line,
        what,
    })
}

type Fault = (Option<u64>, String);

fn parse(bytes: &[u8], scene: &Scene, site: &Site) -> Result<Vec<PickedIn>, Fault> {
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(bytes);
    let said = |error: csv::Error| {
        (error.position().map(csv::Position::line), format!("is no table of commas: {error}"))
    };
    let head = reader.headers().map_err(said)?.clone();
    let known = |name: &str| COLUMNS.contains(&name.trim_start_matches('\u{feff}'));
    if let Some(name) = head.iter().find(|name| !known(name)) {
        let all = COLUMNS.join(", ");
        return Err((Some(1), format!("column {name:?} is not known: the columns are {all}")));
    }
    let column = |name: &str| head.iter().position(|h| h.trim_start_matches('\u{feff}') == name);
    let mut picks = Vec::new();
    for row in reader.records() {
        let row = row.map_err(said)?;
        let line = row.position().map(csv::Position::line);
        let cell = |name: &str| column(name).and_then(|k| row.get(k)).filter(|c| !c.is_empty());
        let number = |name: &str| -> Result<f64, Fault> {
            let text = cell(name).ok_or((line, format!("{name} is missing")))?;
            let value = text.parse::<f64>().ok().filter(|x| x.is_finite());
            value.ok_or((line, format!("{name} {text:?} is no number")))
        };
        let place = match (cell("member"), cell("corner")) {
            (Some(member), Some(corner)) if cell("x").is_none() => {
                named(member, corner, scene, site).map_err(|what| (line, what))?
            }
            (None, None) => DVec3::new(number("x")?, number("y")?, number("z")?),
            _ => {
                let what = "give either x, y, z or member, corner";
                return Err((line, what.into()));
            }
        };
        let pick = Pick { pixel: [number("u")?, number("v")?], place };
        picks.push(PickedIn { photo: cell("photo").map(str::to_owned), pick });
    }
    Ok(picks)
}

/// A corner of a member by its number.
fn named(member: &str, corner: &str, scene: &Scene, site: &Site) -> Result<DVec3, String> {
    let id = scene.id_of(member).map_err(|found| match found {
        0 => format!("there is no member {member:?}: `intrados info` lists them"),
        _ => format!("{found} members are called {member:?}: give the id"),
    })?;
    let index = scene.members.iter().position(|m| m.id == id);
    let outline = index.and_then(|index| Some(site.surface(index)?.outline()));
    let corners = outline.map_or(Vec::new(), |outline| outline.corners);
    let number: Option<usize> = corner.parse().ok();
    let found = number.and_then(|number| corners.get(number.checked_sub(1)?));
    found.copied().ok_or_else(|| {
        format!(
            "{id} has no corner {corner:?}: it has {}, which --corners {id} prints",
            corners.len()
        )
    })
}
