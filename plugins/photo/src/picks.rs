//! Tables of picks: which place is where in which photograph, and which tag is where on a member.

use std::path::{Path, PathBuf};

use glam::DVec3;
use intrados_scene::Scene;
use intrados_stage::{
    access::{self, Denied},
    sheet::{self, DecimalMark, NumberStyle, StyleVerdict},
};

use crate::{
    Photograph, Pick,
    face::Surface,
    site::Site,
    tags::{self, TagAt},
};

/// Longest table, bytes.
const LONGEST: u64 = 1 << 20;
const COLUMNS: [&str; 14] = [
    "photo",
    "u",
    "v",
    "x",
    "y",
    "z",
    "member",
    "corner",
    "tag",
    "size_mm",
    "face",
    "along",
    "across_mm",
    "turn_deg",
];
/// Tags of the family 36h11.
const TAGS: usize = 587;

/// A row of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct PickedIn {
    /// Name of the photograph's file; `None`: of the only one.
    pub photo: Option<String>,
    /// The pick.
    pub pick: Pick,
}

/// A table.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picks {
    /// What somebody picked.
    pub picked: Vec<PickedIn>,
    /// Tags that photographs may show.
    pub tags: Vec<TagAt>,
}

impl Picks {
    /// The picks of a photograph: those in it, by its file's name, those that name none where
    /// `is_only` one is read, and the corners of its tags.
    #[must_use]
    pub fn of(&self, name: &str, is_only: bool, photograph: &Photograph) -> Vec<Pick> {
        let is_of = |photo: &Option<String>, unnamed: bool| {
            photo.as_ref().map_or(unnamed, |photo| is_same_photo(photo, name))
        };
        let picked = self.picked.iter().filter(|p| is_of(&p.photo, is_only)).map(|p| p.pick);
        let tags = self.tags.iter().filter(|tag| is_of(&tag.photo, true));
        picked.chain(tags::picks(photograph, tags)).collect()
    }

    /// Names of the photographs that it speaks of.
    pub fn photos(&self) -> impl Iterator<Item = &String> {
        let tags = self.tags.iter().filter_map(|tag| tag.photo.as_ref());
        self.picked.iter().filter_map(|p| p.photo.as_ref()).chain(tags)
    }
}

/// Whether a table that says `named` means the photograph `file`: folders do not count, nor does
/// case, in which tables and cameras differ.
///
/// ```
/// use intrados_photo::picks::is_same_photo;
/// assert!(is_same_photo("images/IMG_1.JPG", "img_1.jpg"));
/// assert!(is_same_photo("C:\\photos\\a.jpg", "a.jpg"));
/// assert!(!is_same_photo("b.jpg", "bb.jpg"));
/// ```
#[must_use]
pub fn is_same_photo(named: &str, file: &str) -> bool {
    let [named, file] = [named, file].map(|name| name.rsplit(['/', '\\']).next().unwrap_or(name));
    named.to_lowercase() == file.to_lowercase()
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
/// A row of a tag has `tag` (its number in the family 36h11), `size_mm` (the edge of its black
/// square), `member`, `face`, `along` (its middle, 0 to 1 of the axis), `across_mm` (to the right
/// of the axis as one stands before the face; 0 where absent), and `turn_deg` where it does not
/// stand upright along the axis (anticlockwise). Cells are divided by commas, semicolons or tabs;
/// with the latter two, numbers may have a decimal comma.
///
/// # Errors
/// [`PicksError`]: file, line and remedy.
pub fn read(path: &Path, scene: &Scene, site: &Site) -> Result<Picks, PicksError> {
    let denied = |source| PicksError::Denied { path: path.to_owned(), source };
    let bytes = access::read(path, LONGEST).map_err(denied)?;
    parse(&bytes, scene, site).map_err(|(line, what)| PicksError::Bad {
        path: path.to_owned(),
        line,
        what,
    })
}

type Fault = (Option<u64>, String);

fn parse(bytes: &[u8], scene: &Scene, site: &Site) -> Result<Picks, Fault> {
    let sheet = sheet::decode(bytes).map_err(|why| (None, why.to_string()))?;
    let (text, separator) = parted(&sheet.text);
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(separator)
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let said = |error: csv::Error| {
        (
            error.position().map(csv::Position::line),
            format!("is no table of commas or semicolons: {error}"),
        )
    };
    let head = reader.headers().map_err(said)?.iter().map(str::to_lowercase).collect();
    let head: csv::StringRecord = head;
    if let Some(name) = head.iter().find(|name| !COLUMNS.contains(name)) {
        let all = COLUMNS.join(", ");
        return Err((Some(1), format!("column {name:?} is not known: the columns are {all}")));
    }
    if let Some(twice) = COLUMNS.iter().find(|c| head.iter().filter(|h| h == *c).count() > 1) {
        return Err((Some(1), format!("column {twice:?} is there twice: leave out one")));
    }
    let mut picks = Picks::default();
    let records: Vec<csv::StringRecord> =
        reader.records().collect::<Result<_, _>>().map_err(said)?;
    let mark = mark(&head, &records, separator)?;
    for cells in &records {
        let line = cells.position().map(csv::Position::line);
        let row = Row { head: &head, cells, mark };
        let put = match row.cell("tag") {
            Some(tag) => row.tag(tag, scene, site).and_then(|tag| picks.place(tag)),
            None => row.pick(scene, site).map(|pick| picks.picked.push(pick)),
        };
        put.map_err(|what| (line, what))?;
    }
    match far(&picks, scene) {
        Some(what) => Err((None, what)),
        None => Ok(picks),
    }
}

/// Why the places are not those of this scene: most lie farther from it than it is large. A camera
/// fits places in millimetres as well, a thousand times as far away.
fn far(picks: &Picks, scene: &Scene) -> Option<String> {
    let [low, high] = scene.bounds().map(glam::Vec3::as_dvec3);
    let size = (high - low).length();
    let off = |place: &DVec3| place.distance(place.clamp(low, high));
    let is_far = |place: &&DVec3| off(place) > 1.0 + size;
    let places: Vec<DVec3> = picks.picked.iter().map(|picked| picked.pick.place).collect();
    let first = places.iter().find(is_far)?;
    if 2 * places.iter().filter(is_far).count() <= places.len() {
        return None;
    }
    let [x, y, z] = first.to_array();
    Some(format!(
        "a place at ({x}, {y}, {z}) m lies {:.0} m from the scene, which is {size:.1} m large: are its coordinates in mm or cm, or another frame's? Give them in the scene's m",
        off(first)
    ))
}

/// The text below a line `sep=;`, which is blanked, and what parts its cells.
fn parted(text: &str) -> (String, u8) {
    let full = |line: &&str| !line.trim().is_empty() && !line.starts_with('#');
    let first = text.lines().find(full).unwrap_or_default();
    match sheet::named_separator(first) {
        Some(separator) => (text.replacen(first, "", 1), separator),
        None => (text.to_owned(), sheet::separator(first)),
    }
}

/// The decimal mark of a table: all its numbers have the same one.
fn mark(
    head: &csv::StringRecord,
    records: &[csv::StringRecord],
    separator: u8,
) -> Result<DecimalMark, Fault> {
    let mut style = NumberStyle::default();
    let words = ["photo", "member", "face", "corner", "tag"];
    for cells in records {
        let named = head.iter().zip(cells).filter(|(name, _)| !words.contains(name));
        named.for_each(|(_, cell)| style.learn(cell));
    }
    match style.verdict(NumberStyle::default()) {
        StyleVerdict::Certain(mark) => Ok(mark),
        StyleVerdict::Open if !style.is_open() => Ok(DecimalMark::Point),
        // A point is a decimal point where no cell speaks against it.
        StyleVerdict::Open if !records.iter().flatten().any(|cell| cell.contains(',')) => {
            Ok(DecimalMark::Point)
        }
        // Where commas part no cells they are of decimals: no site is thousands of metres wide.
        StyleVerdict::Open if separator != b',' => Ok(DecimalMark::Comma),
        StyleVerdict::Open | StyleVerdict::Mixed => {
            Err((None, "has commas and points in its numbers: write decimals in one way".into()))
        }
    }
}

impl Picks {
    fn place(&mut self, tag: TagAt) -> Result<(), String> {
        let of_one = |a: &Option<String>, b: &Option<String>| a == b || a.is_none() || b.is_none();
        let is_it = |t: &TagAt| t.number == tag.number && of_one(&t.photo, &tag.photo);
        if self.tags.iter().any(is_it) {
            return Err(format!("tag {} is placed twice: print every one once", tag.number));
        }
        self.tags.push(tag);
        Ok(())
    }
}

/// A row of a table.
struct Row<'a> {
    head: &'a csv::StringRecord,
    cells: &'a csv::StringRecord,
    mark: DecimalMark,
}

impl Row<'_> {
    fn cell(&self, name: &str) -> Option<&str> {
        let column = self.head.iter().position(|h| h == name)?;
        self.cells.get(column).filter(|cell| !cell.is_empty())
    }

    fn number(&self, name: &str) -> Result<f64, String> {
        let text = self.cell(name).ok_or_else(|| format!("{name} is missing"))?;
        let value = sheet::number(text, self.mark).map(|number| number.value);
        value.ok_or_else(|| format!("{name} {text:?} is no number"))
    }

    fn photo(&self) -> Option<String> {
        self.cell("photo").map(str::to_owned)
    }

    fn pick(&self, scene: &Scene, site: &Site) -> Result<PickedIn, String> {
        let place = match (self.cell("member"), self.cell("corner")) {
            (Some(member), Some(corner)) if self.cell("x").is_none() => {
                named(member, corner, scene, site)?
            }
            (None, None) => DVec3::new(self.number("x")?, self.number("y")?, self.number("z")?),
            _ => return Err("give either x, y, z or member, corner".into()),
        };
        let pixel = [self.number("u")?, self.number("v")?];
        Ok(PickedIn { photo: self.photo(), pick: Pick { pixel, place } })
    }

    fn tag(&self, tag: &str, scene: &Scene, site: &Site) -> Result<TagAt, String> {
        let others = ["u", "v", "x", "y", "z", "corner"];
        if let Some(name) = others.into_iter().find(|name| self.cell(name).is_some()) {
            return Err(format!(
                "a tag has no {name}: the photograph says where it is, and member, face, along, across_mm where it was stuck"
            ));
        }
        let number = tag.parse().ok().filter(|number| *number < TAGS).ok_or_else(|| {
            format!("tag {tag:?} is none of the family 36h11: give its number, 0 to {}", TAGS - 1)
        })?;
        let or_0 = |name: &str| self.cell(name).map_or(Ok(0.0), |_| self.number(name));
        let stuck = Stuck {
            member: self.cell("member").unwrap_or_default(),
            face: self.cell("face").unwrap_or_default(),
            along: self.number("along")?,
            across_mm: or_0("across_mm")?,
            turn_deg: or_0("turn_deg")?,
            size_mm: self.number("size_mm")?,
        };
        Ok(TagAt { photo: self.photo(), number, corners: stuck.corners(scene, site)? })
    }
}

/// A member's surface by its id or name.
fn surface<'a>(
    member: &str,
    scene: &Scene,
    site: &'a Site,
) -> Result<(String, Option<&'a Surface>), String> {
    let id = scene.id_of(member).map_err(|found| match found {
        0 => format!("there is no member {member:?}: `intrados info` lists them"),
        _ => format!("{found} members are called {member:?}: give the id"),
    })?;
    let index = scene.members.iter().position(|m| m.id == id);
    Ok((id.to_owned(), index.and_then(|index| site.surface(index))))
}

/// Where a tag was stuck.
struct Stuck<'a> {
    member: &'a str,
    face: &'a str,
    along: f64,
    across_mm: f64,
    turn_deg: f64,
    size_mm: f64,
}

impl Stuck<'_> {
    /// Corners of its black square, as [`TagAt`] has them.
    fn corners(&self, scene: &Scene, site: &Site) -> Result<[DVec3; 4], String> {
        let (id, surface) = surface(self.member, scene, site)?;
        let surface = surface.ok_or_else(|| format!("{id} has no surface of its own"))?;
        let face = surface.faces.iter().find(|face| face.name.eq_ignore_ascii_case(self.face));
        let face = face.ok_or_else(|| {
            let names: Vec<&str> = surface.faces.iter().map(|face| face.name.as_str()).collect();
            format!("{id} has no face {:?}: it has {}", self.face, names.join(", "))
        })?;
        for (name, value, [low, high]) in [
            ("along", self.along, [0.0, 1.0]),
            ("size_mm", self.size_mm, [1.0, 2000.0]),
            ("across_mm", self.across_mm, [-1e5, 1e5]),
            ("turn_deg", self.turn_deg, [-360.0, 360.0]),
        ] {
            if !(low..=high).contains(&value) {
                return Err(format!("{name} {value} is not between {low} and {high}"));
            }
        }
        let middle = [1e-3 * self.across_mm, self.along * surface.length()];
        let (sin, cos) = self.turn_deg.to_radians().sin_cos();
        let half = 0.5e-3 * self.size_mm;
        let at = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| {
            [middle[0] + half * (cos * x - sin * y), middle[1] + half * (sin * x + cos * y)]
        });
        let places: Vec<DVec3> =
            surface.places(face, &at).into_iter().flatten().map(|[place, _]| place).collect();
        let off = || {
            format!("it does not lie on the face {} of {id}: see along and across_mm", face.name)
        };
        places.try_into().map_err(|_| off())
    }
}

/// A corner of a member by its number.
fn named(member: &str, corner: &str, scene: &Scene, site: &Site) -> Result<DVec3, String> {
    let (id, surface) = surface(member, scene, site)?;
    let corners = surface.map_or(Vec::new(), |surface| surface.outline().corners);
    let number: Option<usize> = corner.parse().ok();
    let found = number.and_then(|number| corners.get(number.checked_sub(1)?));
    found.copied().ok_or_else(|| {
        format!(
            "{id} has no corner {corner:?}: it has {}, which --corners {id} prints",
            corners.len()
        )
    })
}
