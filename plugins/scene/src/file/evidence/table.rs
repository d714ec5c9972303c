//! Tables of observations and readings: CSV as spreadsheets and instruments write it.

use std::collections::HashMap;

use csv::{ReaderBuilder, StringRecord};
use glam::Vec3;
use intrados_stage::sheet::{self, DecimalMark, NumberStyle, StyleVerdict};

use super::{
    Along, Face, Finding, Kind, Placed, Record, Survey,
    check::{check_record, check_seat},
    day::{self, DayOrder},
    layout::{Layout, lay_out},
    units::{electrode, scale_of, split_unit},
};
use crate::{
    file::{edit_distance, nearest, shorten},
    problem::Problem,
    structure::{Date, Direction, Electrode, Measures},
};

mod doubt;
mod grid;

pub(super) use doubt::{doubt_covers, doubt_profile};
use grid::is_place_across;

/// Most rows of a table.
const MAX_ROWS: usize = 200_000;
/// How many problems of a table are listed before the list is cut.
const MAX_PROBLEMS: usize = 50;

/// Beyond this no gauge is read, %: steel breaks before.
pub(super) const MOST_STRAIN: f64 = 10.0;
/// What no gauge can tell from nought.
const LEAST_STRAIN: f64 = 0.05e-6;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Column {
    Along,
    Face,
    Angle,
    Height,
    Date,
    StdError,
    Temperature,
    Gauge,
    Test,
    Value,
    Unit,
    Depth,
    OfCement,
    OfConcrete,
    Of(Kind),
}

/// Names of columns. Those of what was measured end in their unit.
const COLUMNS: [(&str, Column); 19] = [
    ("along", Column::Along),
    ("face", Column::Face),
    ("angle_deg", Column::Angle),
    ("height_m", Column::Height),
    ("date", Column::Date),
    ("std_error", Column::StdError),
    ("temperature_c", Column::Temperature),
    ("gauge", Column::Gauge),
    ("test", Column::Test),
    ("value", Column::Value),
    ("unit", Column::Unit),
    ("depth_mm", Column::Depth),
    ("chloride_percent_cement", Column::OfCement),
    ("chloride_percent_concrete", Column::OfConcrete),
    ("mV", Column::Of(Kind::HalfCell)),
    ("cover_mm", Column::Of(Kind::Cover)),
    ("rebound", Column::Of(Kind::Rebound)),
    ("velocity_m_s", Column::Of(Kind::Velocity)),
    ("carbonation_mm", Column::Of(Kind::Carbonation)),
];

/// How a table tells what it holds, for messages.
const KINDS: &str = "one of mV, cover_mm, rebound, velocity_m_s, carbonation_mm, depth_mm with \
                     chloride_percent_cement, or gauge with value";

/// Other names of columns, as loggers write them, and names that say their unit behind them.
const OTHER_NAMES: [(&str, Column); 14] = [
    ("timestamp", Column::Date),
    ("datetime", Column::Date),
    ("date/time", Column::Date),
    ("time stamp", Column::Date),
    ("height", Column::Height),
    ("angle", Column::Angle),
    ("temperature", Column::Temperature),
    ("temp", Column::Temperature),
    ("depth", Column::Depth),
    ("cover", Column::Of(Kind::Cover)),
    ("carbonation", Column::Of(Kind::Carbonation)),
    ("velocity", Column::Of(Kind::Velocity)),
    ("potential", Column::Of(Kind::HalfCell)),
    ("half_cell", Column::Of(Kind::HalfCell)),
];

/// A column by its name, which has its unit in itself or behind it, and that unit.
fn column_named<'a>(name: &'a str, below: &'a str) -> Option<(Column, &'a str)> {
    let (base, unit) = split_unit(name);
    let unit = if unit.is_empty() { below } else { unit };
    let is_it = |(known, _): &&(&str, Column)| known.eq_ignore_ascii_case(base);
    if let Some((_, column)) = COLUMNS.iter().find(is_it) {
        return Some((*column, unit));
    }
    let (_, column) = OTHER_NAMES.iter().find(is_it)?;
    (*column == Column::Date || !unit.trim_matches(['-', ' ']).is_empty())
        .then_some((*column, unit))
}

/// Whether a cell names a column.
pub(super) fn is_known(cell: &str) -> bool {
    column_named(cell, "").is_some()
}

/// Whether a cell names a column of what was measured.
pub(super) fn is_deciding(cell: &str) -> bool {
    let found = column_named(cell, "").map(|(column, _)| column);
    matches!(found, Some(Column::Of(_) | Column::OfCement | Column::OfConcrete | Column::Gauge))
}

/// Whether cells name a place along the axis and places across a face: the head of a grid.
pub(super) fn is_grid_head(cells: &[String]) -> bool {
    let is_along = |cell: &String| {
        let column = column_named(cell, "m").map(|(column, _)| column);
        matches!(column, Some(Column::Height | Column::Along))
    };
    let Some((first, rest)) = cells.split_first() else { return false };
    is_along(first) && !rest.is_empty() && rest.iter().all(|cell| is_place_across(cell))
}

impl Column {
    fn name(self) -> &'static str {
        COLUMNS.iter().find(|(_, column)| *column == self).map_or("", |(name, _)| name)
    }
}

impl Kind {
    const ALL: [Self; 5] =
        [Self::Cover, Self::Rebound, Self::Velocity, Self::HalfCell, Self::Carbonation];

    /// Units of a column `value`, with what makes them those of [`Finding`]; first the one that the
    /// column of its own has.
    fn units(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Cover | Self::Carbonation => &[("mm", 1.0), ("cm", 10.0)],
            Self::Rebound => &[("", 1.0)],
            Self::Velocity => &[("m/s", 1.0), ("km/s", 1000.0)],
            Self::HalfCell => &[("mV", 1.0), ("V", 1000.0)],
        }
    }
}

/// Units of gauges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GaugeUnit {
    MicroStrain,
    Strain,
    Millimetre,
    Metre,
    MegaPascal,
}

impl GaugeUnit {
    const ALL: [(&'static str, Self); 5] = [
        ("ue", Self::MicroStrain),
        ("m/m", Self::Strain),
        ("mm", Self::Millimetre),
        ("m", Self::Metre),
        ("MPa", Self::MegaPascal),
    ];

    pub(super) fn named(name: &str) -> Option<Self> {
        let name = match name {
            // The Greek letter and the sign that looks like it.
            "µε" | "με" | "um/m" | "µm/m" | "μm/m" | "microstrain" => "ue",
            "N/mm2" | "N/mm²" => "MPa",
            name => name,
        };
        Self::ALL.iter().find(|(known, _)| *known == name).map(|(_, unit)| *unit)
    }

    pub(crate) fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, unit)| *unit == self).map_or("", |(name, _)| name)
    }

    /// One of it in SI units.
    fn si(self) -> f64 {
        match self {
            Self::MicroStrain => 1e-6,
            Self::Strain | Self::Metre => 1.0,
            Self::Millimetre => 1e-3,
            Self::MegaPascal => 1e6,
        }
    }

    /// Why a gauge on a structure does not read so much.
    fn absurd(self, shown: f64) -> Option<String> {
        let percent = (1e6 * self.si() * shown.abs()).round() / 1e4;
        match self {
            Self::Strain if percent > MOST_STRAIN => Some(format!(
                "{shown} m/m is a strain of {percent} %, at which nothing is left: in ue? give the unit ue"
            )),
            Self::MicroStrain if percent > MOST_STRAIN => Some(format!(
                "{shown} ue is a strain of {percent} %, at which nothing is left: are these counts of the amplifier? give them in ue"
            )),
            _ => None,
        }
    }

    /// What a gauge measures that is read in it, and of which nothing but its place is said: strain
    /// along the axis, or displacement upwards. None: its direction must be said.
    pub(crate) fn usual(self) -> Option<Measures> {
        match self {
            Self::MicroStrain | Self::Strain => Some(Measures::Strain(Direction::Axial)),
            Self::Millimetre | Self::Metre => Some(Measures::Displacement(Vec3::Y)),
            Self::MegaPascal => None,
        }
    }

    /// Whether a gauge can be read in it.
    pub(crate) fn fits(self, measures: &Measures) -> bool {
        match self {
            Self::MicroStrain | Self::Strain => matches!(measures, Measures::Strain(_)),
            Self::Millimetre | Self::Metre => matches!(measures, Measures::Displacement(_)),
            Self::MegaPascal => matches!(measures, Measures::Stress(_)),
        }
    }

    /// The usual standard error of a reading, SI: 2 % of it (of the gauge's factor, its direction
    /// and its amplifier), and no less than 1 millionth, a hundredth of a millimetre or .1 MPa
    /// (ours).
    fn usual_error(self, value: f64) -> f64 {
        let least = match self {
            Self::MicroStrain | Self::Strain => 1e-6,
            Self::Millimetre | Self::Metre => 1e-5,
            Self::MegaPascal => 1e5,
        };
        f64::max(least, 0.02 * value.abs())
    }
}

/// The unit of gauges that was given.
fn gauge_unit(given: Option<&str>) -> Result<GaugeUnit, String> {
    given.and_then(GaugeUnit::named).ok_or_else(|| {
        let why = match given {
            Some(other) => format!("\"{}\" is no unit of a gauge", shorten(other)),
            None => "nothing says in which unit the gauges were read".into(),
        };
        format!("{why}: give the unit ue, m/m, mm, m or MPa")
    })
}

/// Refuses a unit that does not fit what `value` holds; gives what makes it that of [`Finding`].
pub(super) fn unit(kind: Option<Kind>, unit: Option<&str>) -> Result<f64, String> {
    let Some(kind) = kind else {
        let of_column = |name: &str| Kind::ALL.iter().any(|kind| kind.units()[0].0 == name);
        return match unit.filter(|u| GaugeUnit::named(u).is_none() && !of_column(u)) {
            Some(other) => Err(format!(
                "\"{}\" is no unit of a gauge: give ue, m/m, mm, m or MPa",
                shorten(other)
            )),
            None => Ok(1.0),
        };
    };
    let known = kind.units();
    let factor = known.iter().find(|(name, _)| *name == unit.unwrap_or_default());
    factor.map(|(_, factor)| *factor).ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
        match (unit, &names[..]) {
            (_, [""]) => format!("{kind:?} has no unit: leave it out"),
            (None, _) => format!("is missing: {kind:?} is given in {}", names.join(" or ")),
            (Some(other), _) => {
                let other = shorten(other);
                format!("\"{other}\" does not fit {kind:?}: give it in {}", names.join(" or "))
            }
        }
    })
}

/// A gauge's reading as a table tells it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RawReading {
    pub(crate) member: String,
    pub(crate) of: String,
    /// Where the gauge is, if the row says it.
    pub(crate) seat: Option<Seat>,
    pub(crate) test: Option<String>,
    /// Of monitoring: when, and how warm the concrete was, °C.
    pub(crate) date: Option<Date>,
    pub(crate) temperature_c: Option<f64>,
    /// SI.
    pub(crate) value: f64,
    /// SI.
    pub(crate) std_error: f64,
    pub(crate) unit: GaugeUnit,
}

/// Where a gauge is, as a row of a table tells it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Seat {
    /// On the axis, 0 to 1.
    pub(crate) along: f32,
    /// On which side; neither: nobody says it.
    pub(crate) face: Option<Face>,
    pub(crate) angle_deg: Option<f32>,
    /// Below the surface.
    pub(crate) depth_mm: Option<f32>,
}

/// What the rows of a table say, each with its line.
#[derive(Debug, Default)]
pub(crate) struct Rows {
    pub(crate) records: Vec<Placed<Record>>,
    pub(crate) readings: Vec<Placed<RawReading>>,
    /// What was passed over, assumed or doubted, for people.
    pub(crate) notes: Vec<String>,
}

/// Reads a table. `file` is its name in messages.
///
/// # Errors
/// All that is wrong with it, each with line and column.
pub(crate) fn read(file: &str, bytes: &[u8], survey: &Survey) -> Result<Rows, Vec<Problem>> {
    let one = |p: Problem| vec![p];
    let layout = lay_out(file, bytes).map_err(one)?;
    let mut table = Table::open(file, &layout, survey).map_err(one)?;
    let records = table.records(&layout).map_err(one)?;
    table.learn(&records).map_err(one)?;
    let mut rows: Vec<Row> =
        records.into_iter().map(|(line, cells)| Row { table: &table, line, cells }).collect();
    let mut notes = table.all_notes(&layout);
    notes.extend(doubt::leave_out(&table, &mut rows).map_err(one)?);
    let mut out = Rows { notes, ..Rows::default() };
    let mut problems: Vec<Problem> = doubt::place_lost(&table, &rows).into_iter().collect();
    table.take_rows(&rows, &mut out, &mut problems);
    if problems.is_empty() {
        problems.extend(doubt::sign_lost(&table, &out));
    }
    if !problems.is_empty() {
        problems.truncate(MAX_PROBLEMS);
        return Err(problems);
    }
    let unsigned = doubt::leave_out_unsigned(&table, &mut out);
    out.notes.extend(unsigned);
    for record in &out.records {
        problems.extend(check_record(&record.what).into_iter().map(|problem| Problem {
            place: record.field(table.column_of(&problem.place)),
            ..problem
        }));
    }
    for reading in &out.readings {
        let wrong = reading.what.seat.as_ref().map(check_seat).unwrap_or_default();
        problems.extend(wrong.into_iter().map(|p| Problem { place: reading.field(&p.place), ..p }));
    }
    problems.truncate(MAX_PROBLEMS);
    if !problems.is_empty() {
        return Err(problems);
    }
    if !survey.confirmed {
        out.notes.extend(doubt::doubt_rows(&table, &rows, &out));
    }
    Ok(out)
}

fn take<T>(
    found: Result<Placed<T>, Problem>,
    list: &mut Vec<Placed<T>>,
    problems: &mut Vec<Problem>,
) {
    match found {
        Ok(one) => list.push(one),
        Err(problem) => problems.push(problem),
    }
}

fn finding(kind: Kind, value: f64, error: Option<f64>, survey: &Survey) -> Finding {
    match kind {
        Kind::Cover => Finding::Cover { mm: value, std_error_mm: error },
        Kind::Rebound => Finding::Rebound { number: value, std_error: error },
        Kind::Velocity => Finding::Velocity { m_s: value, std_error_m_s: error },
        Kind::HalfCell => {
            Finding::HalfCell { mv: value, std_error_mv: error, electrode: survey.electrode }
        }
        Kind::Carbonation => Finding::Carbonation { mm: value, std_error_mm: error },
    }
}

/// What the rows of a table are.
#[derive(Debug, Clone, Copy)]
enum Holds {
    One {
        kind: Kind,
        column: Column,
    },
    Profiles {
        column: Column,
    },
    Gauges,
    /// A gauge a column.
    Channels,
    /// A place along the axis a row, and a place across a column.
    Grid {
        kind: Kind,
    },
}

/// A table whose header is sound.
struct Table<'a> {
    file: &'a str,
    survey: &'a Survey,
    /// None: a column that says nothing to us.
    columns: Vec<Option<Column>>,
    /// What makes the numbers of each those of its column.
    scales: Vec<[f64; 2]>,
    /// Decimal marks of each; `None` where each cell says its own.
    marks: Vec<Option<DecimalMark>>,
    /// Names of columns that say nothing to us.
    strange: Vec<String>,
    /// Columns that hold what a gauge, or a place across, showed.
    channels: Vec<Channel>,
    /// The unit that a header gives to `value`.
    value_unit: Option<String>,
    /// The unit that a header gives to `std_error`.
    error_unit: Option<String>,
    days: Option<DayOrder>,
    header: usize,
    separator: u8,
    holds: Holds,
    notes: Vec<String>,
}

/// A column of a gauge, or of a place across a face.
#[derive(Debug, Clone, PartialEq)]
struct Channel {
    index: usize,
    name: String,
    unit: Option<String>,
}

impl<'a> Table<'a> {
    fn open(file: &'a str, layout: &Layout, survey: &'a Survey) -> Result<Self, Problem> {
        if layout.text.trim().is_empty() {
            let message = format!("is empty: its first line names the columns, {KINDS}");
            return Err(Problem::error(file, "EMPTY", message));
        }
        let mut table = Self {
            file,
            survey,
            columns: Vec::new(),
            scales: Vec::new(),
            marks: Vec::new(),
            strange: Vec::new(),
            channels: Vec::new(),
            value_unit: None,
            error_unit: None,
            days: None,
            header: layout.header,
            separator: layout.separator,
            holds: Holds::Profiles { column: Column::OfCement },
            notes: Vec::new(),
        };
        table.header(layout)?;
        table.holds = table.told(layout)?;
        table.check_error_unit()?;
        Ok(table)
    }

    fn reader<'b>(&self, text: &'b str) -> csv::Reader<&'b [u8]> {
        ReaderBuilder::new()
            .delimiter(self.separator)
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes())
    }

    fn broken(&self, error: &csv::Error) -> Problem {
        Problem::error(self.file, "SYNTAX", format!("cannot be read as CSV: {error}"))
    }

    /// The columns by their names, and the names that nobody knows.
    fn header(&mut self, layout: &Layout) -> Result<(), Problem> {
        let mut reader = self.reader(&layout.text);
        let names = reader.headers().map_err(|e| self.broken(&e))?.clone();
        let is_wide = self.is_wide(&names, layout);
        for (index, name) in names.iter().enumerate() {
            let below = layout.units.get(index).map_or("", String::as_str);
            let Some((column, unit)) = column_named(name, below) else {
                let (base, unit) = split_unit(name);
                let unit = if unit.is_empty() { below } else { unit };
                if is_wide {
                    let unit = Some(unit.to_owned()).filter(|u| !u.is_empty());
                    self.channels.push(Channel { index, name: base.to_owned(), unit });
                } else if let Some(why) = mistaken(name) {
                    return Err(self.in_header("UNKNOWN_COLUMN", why));
                }
                self.columns.push(None);
                self.scales.push([1.0, 0.0]);
                self.strange.push(name.to_owned());
                continue;
            };
            if self.has(column) {
                let name = column.name();
                let message = format!("the column {name} is there twice: keep one of them");
                return Err(self.in_header("DUPLICATE", message));
            }
            let scale = self.scale(column, unit)?;
            self.scales.push(scale);
            self.columns.push(Some(column));
        }
        Ok(())
    }

    /// Whether each column is of a gauge, or of a place across: none says what was measured, and
    /// one says when or where.
    fn is_wide(&self, names: &StringRecord, layout: &Layout) -> bool {
        let known = |name: &str| column_named(name, "").map(|(column, _)| column);
        let below = |index: usize| layout.units.get(index).map_or("", String::as_str);
        let is_deciding =
            |name: &str| is_deciding(name) || known(name).is_some_and(|c| c == Column::Value);
        if names.iter().any(is_deciding) {
            return false;
        }
        let has = |column: Column| names.iter().any(|name| known(name) == Some(column));
        let mut others = names.iter().enumerate().filter(|(_, name)| known(name).is_none());
        let of_gauge = |(index, name): (usize, &str)| {
            let unit = split_unit(name).1;
            let unit = if unit.is_empty() { below(index) } else { unit };
            GaugeUnit::named(unit).is_some()
        };
        let is_logged = has(Column::Date) || has(Column::Test) || self.survey.test.is_some();
        if is_logged && (self.survey.kind.is_none() && self.survey.unit.is_some()) {
            return others.next().is_some();
        }
        let is_number = |(_, name): (usize, &str)| is_place_across(name);
        let mut full = others.clone().filter(|(_, name)| !name.is_empty());
        let is_grid = (has(Column::Height) || has(Column::Along))
            && full.clone().next().is_some()
            && full.all(is_number);
        is_grid || is_logged && others.any(of_gauge)
    }

    /// What makes a column's numbers those of its name.
    fn scale(&mut self, column: Column, unit: &str) -> Result<[f64; 2], Problem> {
        let named = || Some(unit.to_owned()).filter(|u| !u.trim_matches('-').is_empty());
        match column {
            Column::Value => self.value_unit = named(),
            Column::StdError => self.error_unit = named(),
            _ => {}
        }
        if matches!(column, Column::Value | Column::StdError) {
            return Ok([1.0, 0.0]);
        }
        let scale = scale_of(column, unit).ok_or_else(|| {
            let (unit, name) = (shorten(unit), column.name());
            let message = format!("{unit} is no unit of {name}: convert the column, or correct it");
            self.in_header("UNIT", message)
        })?;
        let said = electrode(unit).filter(|_| column == Column::Of(Kind::HalfCell));
        if let Some(said) = said.filter(|said| *said != self.survey.electrode) {
            let message = format!(
                "potentials are against {} by their header, and {} is given: correct one of them",
                said.name(),
                self.survey.electrode.name()
            );
            return Err(self.in_header("ELECTRODE", message));
        }
        let is_other = scale.iter().zip([1.0, 0.0]).any(|(a, b)| (a - b).abs() > f64::EPSILON);
        if is_other {
            let file = self.file;
            let (unit, name) = (shorten(unit), column.name());
            self.notes.push(format!("{file}: the column in {unit} was converted to {name}"));
        }
        Ok(scale)
    }

    /// All that was passed over or assumed.
    fn all_notes(&self, layout: &Layout) -> Vec<String> {
        let own = self.notes.iter().cloned();
        layout.notes.iter().cloned().chain(own).chain(self.note()).collect()
    }

    /// Which columns were passed over.
    fn note(&self) -> Option<String> {
        let is_used = |name: &&str| {
            let base = split_unit(name).0;
            self.channels.iter().any(|channel| channel.name == base)
        };
        let names: Vec<&str> =
            self.strange.iter().map(String::as_str).filter(|name| !is_used(name)).collect();
        let named: Vec<&str> = names.iter().copied().filter(|n| !n.is_empty()).collect();
        if named.is_empty() {
            return None;
        }
        let list = shorten(&named.join(", "));
        let (column, is, it) = match named.len() {
            1 => ("column", "is", "its"),
            _ => ("columns", "are", "their"),
        };
        let file = self.file;
        Some(format!("{file}: the {column} {list} {is} not known and {it} cells not read"))
    }

    fn in_header(&self, code: &'static str, message: String) -> Problem {
        Problem::error(format!("{}:{}", self.file, self.header), code, message)
    }

    fn has(&self, column: Column) -> bool {
        self.columns.contains(&Some(column))
    }

    /// What the columns say that the table holds.
    fn told(&mut self, layout: &Layout) -> Result<Holds, Problem> {
        if self.is_grid() {
            return self.of_grid(layout);
        }
        if !self.channels.is_empty() {
            return self.of_channels();
        }
        let mut told = Vec::new();
        for &column in self.columns.iter().flatten() {
            match column {
                Column::Of(kind) => told.push(Holds::One { kind, column }),
                Column::OfCement | Column::OfConcrete => told.push(Holds::Profiles { column }),
                Column::Value if !self.has(Column::Gauge) => told.push(self.of_value()?),
                Column::Gauge => told.push(self.of_gauges()?),
                _ => {}
            }
        }
        let [holds] = told[..] else {
            let message = if told.is_empty() {
                let strange = match &self.strange[..] {
                    [] => String::new(),
                    [one] => format!(", and \"{}\" is not known here", shorten(one)),
                    all => format!(", and {} are not known here", shorten(&all.join(", "))),
                };
                let nearly = self.strange.iter().find_map(|name| {
                    let near = |known: &&str| edit_distance(name, known) <= 1;
                    COLUMNS.iter().map(|(name, _)| *name).find(near)
                });
                let is_grid = !self.strange.is_empty()
                    && self.strange.iter().all(|name| name.trim().parse::<f64>().is_ok());
                match nearly {
                    Some(known) => {
                        format!("no column says what was measured{strange}: did you mean {known}?")
                    }
                    // Somebody's grid of potentials, as some instruments write it.
                    None if is_grid => format!(
                        "no line names columns: a grid's first line says where its columns lie, such as height_m,0.25,0.50, and each row begins with its own height_m or along; of a list name {KINDS}"
                    ),
                    None => format!("no column says what was measured{strange}: name {KINDS}"),
                }
            } else {
                format!("more than one column says what was measured: keep {KINDS}")
            };
            return Err(self.in_header("NO_KIND", message));
        };
        if matches!(holds, Holds::Profiles { .. }) && !self.has(Column::Depth) {
            let message = "the column depth_mm is missing: a chloride content has its depth";
            return Err(self.in_header("NO_DEPTH", message.into()));
        }
        match self.unfit(holds).or_else(|| self.stray(holds)) {
            Some(message) => Err(self.in_header("UNFIT", message)),
            None => Ok(holds),
        }
    }

    /// A column that says nothing beside what the table holds.
    fn stray(&self, holds: Holds) -> Option<String> {
        let profile = matches!(holds, Holds::Profiles { .. });
        let gauges = matches!(holds, Holds::Gauges | Holds::Channels);
        let of_value = matches!(holds, Holds::One { column: Column::Value, .. });
        let is_stray = |column: &&Column| match column {
            Column::Depth => !profile && !gauges,
            Column::Test | Column::Temperature => !gauges,
            Column::Value => !gauges && !of_value,
            Column::Height => gauges,
            _ => false,
        };
        let in_need = |column: &&Column| {
            gauges && matches!(column, Column::Face | Column::Angle | Column::Depth)
        };
        let known = || self.columns.iter().flatten();
        if let Some(column) = known().find(in_need).filter(|_| !self.has(Column::Along)) {
            let message = "is a gauge's together with along: add the column along, or take it out";
            return Some(format!("the column {} {message}", column.name()));
        }
        let why = match gauges {
            true => "is none of a gauge, whose place is along with face or angle_deg",
            false => "says nothing beside the other columns",
        };
        let stray = known().find(is_stray)?;
        Some(format!("the column {} {why}: take it out", stray.name()))
    }

    /// What makes a standard error in a unit that of [`Finding`]; `None`: it is none of what the
    /// table holds.
    fn error_scale(&self, named: &str) -> Option<f64> {
        let kind = match self.holds {
            Holds::One { kind, .. } | Holds::Grid { kind } => kind,
            Holds::Profiles { .. } => return (named == "%").then_some(1.0),
            Holds::Gauges | Holds::Channels => return GaugeUnit::named(named).map(GaugeUnit::si),
        };
        scale_of(Column::Of(kind), named).map(|scale| scale[0])
    }

    fn check_error_unit(&self) -> Result<(), Problem> {
        match self.error_unit.as_deref().filter(|unit| self.error_scale(unit).is_none()) {
            Some(unit) => {
                let message = format!(
                    "{} is no unit of std_error here: give it in that of what was measured",
                    shorten(unit)
                );
                Err(self.in_header("UNIT", message))
            }
            None => Ok(()),
        }
    }

    /// What is said of the table beside its file and does not fit what it holds.
    fn unfit(&self, holds: Holds) -> Option<String> {
        let Survey { along, face, angle_deg, height_m, kind, unit, test, electrode, .. } =
            self.survey;
        let gauges = matches!(holds, Holds::Gauges | Holds::Channels);
        let of_value =
            matches!(holds, Holds::One { column: Column::Value, .. } | Holds::Grid { .. });
        // The side of all gauges may be said once, where each row says how far along it is.
        let has_side = (face.is_some() || angle_deg.is_some()) && !self.has(Column::Along);
        if gauges && (along.is_some() || has_side || height_m.is_some()) {
            let message = "gauges have their place in columns of the table or where they are \
                           defined: leave along, face, angle_deg and height_m out";
            return Some(message.into());
        }
        // What the column itself says may be said again.
        let own = match holds {
            Holds::One { kind, .. } | Holds::Grid { kind } => Some(kind),
            _ => None,
        };
        let own_unit = own.and_then(|k| k.units().first()).map(|(name, _)| *name);
        let stray = [
            ("kind", kind.is_some() && *kind != own),
            ("unit", unit.is_some() && unit.as_deref() != own_unit && !of_value && !gauges),
            ("test", test.is_some() && !gauges),
            ("electrode", *electrode != Electrode::default() && own != Some(Kind::HalfCell)),
        ];
        let (name, _) = stray.into_iter().find(|(_, stray)| *stray)?;
        Some(format!("{name} does not fit what the columns tell: leave it out"))
    }

    /// What a column `value` alone holds.
    fn of_value(&self) -> Result<Holds, Problem> {
        let Some(kind) = self.survey.kind else {
            let message = format!(
                "nothing says what `value` is: give its kind and unit, or name the column {KINDS}"
            );
            return Err(self.in_header("NO_KIND", message));
        };
        if let Some(given) = self.unit_of_all() {
            unit(Some(kind), given)
                .map_err(|why| self.in_header("UNIT", format!("the unit of `value` {why}")))?;
        }
        Ok(Holds::One { kind, column: Column::Value })
    }

    fn of_gauges(&self) -> Result<Holds, Problem> {
        if !self.has(Column::Value) {
            let message = "the column value is missing: what the gauges showed";
            return Err(self.in_header("NO_VALUE", message.into()));
        }
        if let Some(given) = self.unit_of_all() {
            gauge_unit(given).map_err(|why| self.in_header("NO_UNIT", why))?;
        }
        Ok(Holds::Gauges)
    }

    /// What is said, or not, of the unit of all rows; `None` where each row has to say it.
    fn unit_of_all(&self) -> Option<Option<&str>> {
        let given = self.survey.unit.as_deref().or(self.value_unit.as_deref());
        (given.is_some() || !self.has(Column::Unit)).then_some(given)
    }

    /// Cells of all rows, with their lines.
    fn records(&self, layout: &Layout) -> Result<Vec<(usize, StringRecord)>, Problem> {
        let mut rows = Vec::new();
        // What the reader tells of a line is before the empty lines that it passes over.
        let text = layout.text.as_bytes();
        let (mut at, mut line) = (0, 1);
        for record in self.reader(&layout.text).into_records() {
            let cells = record.map_err(|e| self.broken(&e))?;
            let mut begin = cells.position().map_or(0, csv::Position::byte) as usize;
            while text.get(begin) == Some(&b'\n') {
                begin += 1;
            }
            line +=
                text.get(at..begin).map_or(0, |part| part.iter().filter(|b| **b == b'\n').count());
            at = begin;
            if cells.iter().all(str::is_empty) {
                continue;
            }
            if rows.len() >= MAX_ROWS {
                let message = format!("has more than {MAX_ROWS} rows: split it");
                return Err(Problem::error(self.file, "TOO_MANY", message));
            }
            if cells.len() > self.columns.len() {
                return Err(self.too_wide(line, &cells));
            }
            rows.push((line, cells));
        }
        if rows.is_empty() {
            let message = "has a header and no rows: put what was measured below it";
            return Err(Problem::error(self.file, "EMPTY", message));
        }
        Ok(rows)
    }

    fn too_wide(&self, line: usize, cells: &StringRecord) -> Problem {
        let message = format!(
            "has {} cells, and the header {}: was a decimal comma taken for a separator? part \
             columns by ; or write decimal points",
            cells.len(),
            self.columns.len()
        );
        Problem::error(format!("{}:{line}", self.file), "TOO_WIDE", message)
    }

    /// Whether a column holds numbers.
    fn is_numeric(&self, index: usize) -> bool {
        match self.columns.get(index).copied().flatten() {
            Some(Column::Face | Column::Date | Column::Gauge | Column::Test | Column::Unit) => {
                false
            }
            Some(_) => true,
            None => self.channels.iter().any(|channel| channel.index == index),
        }
    }

    /// Learns from all cells how numbers and days are written.
    fn learn(&mut self, records: &[(usize, StringRecord)]) -> Result<(), Problem> {
        let date = self.columns.iter().position(|c| *c == Some(Column::Date));
        if let Some(date) = date {
            self.days = day::order(records.iter().filter_map(|(_, cells)| cells.get(date)));
            let is_serial = |cell: &str| day::read(cell, self.days).is_ok_and(|d| d.is_serial);
            let serial = records.iter().filter_map(|(_, cells)| cells.get(date));
            if let Some(first) = serial.into_iter().find(|cell| is_serial(cell)) {
                let day = day::read(first, self.days).map_or(String::new(), |d| d.date.to_string());
                let file = self.file;
                self.notes.push(format!(
                    "{file}: days are a spreadsheet's numbers: {first} was read as {day}"
                ));
            }
        }
        let styles: Vec<NumberStyle> = (0..self.columns.len())
            .map(|index| {
                let mut style = NumberStyle::default();
                if self.is_numeric(index) {
                    let cells = records.iter().filter_map(|(_, cells)| cells.get(index));
                    cells.for_each(|cell| style.learn(cell));
                }
                style
            })
            .collect();
        let all = styles.iter().fold(NumberStyle::default(), |all, style| all.and(*style));
        for (index, style) in styles.iter().enumerate() {
            let cells: Vec<&str> = match style.is_open() {
                true => records.iter().filter_map(|(_, cells)| cells.get(index)).collect(),
                false => Vec::new(),
            };
            let is_by_cell = style.verdict(all) == StyleVerdict::Mixed && !style.is_open();
            let mark = match is_by_cell {
                true => None,
                false => Some(self.mark(index, *style, all, &cells)?),
            };
            self.marks.push(mark);
        }
        Ok(())
    }

    /// The decimal mark of a column.
    fn mark(
        &mut self,
        index: usize,
        style: NumberStyle,
        all: NumberStyle,
        cells: &[&str],
    ) -> Result<DecimalMark, Problem> {
        let name = self.columns.get(index).copied().flatten().map_or("value", Column::name);
        let place = format!("{}: column {name}", self.file);
        let mut why = "as other cells show";
        let mark = match style.verdict(all) {
            StyleVerdict::Certain(mark) => mark,
            StyleVerdict::Mixed => {
                let message = "has decimal points and decimal commas, and numbers that either may part: write all in one way";
                return Err(Problem::error(place, "NO_NUMBER", message));
            }
            StyleVerdict::Open if !style.is_open() => return Ok(DecimalMark::Point),
            StyleVerdict::Open => match self.likely_mark(index, cells) {
                Some(mark) => {
                    why = "for else no value would be one of its kind";
                    mark
                }
                None => {
                    let first =
                        shorten(cells.iter().find(|c| c.contains(['.', ','])).unwrap_or(&""));
                    let message = format!(
                        "{first} may be thousands or have three decimals, and no cell decides: write it without a mark that parts thousands, or with four decimals"
                    );
                    return Err(Problem::error(place, "AMBIGUOUS", message));
                }
            },
        };
        let parted = cells.iter().find_map(|cell| Some((cell, sheet::number(cell, mark)?)));
        let is_parted = |cell: &&&str| sheet::number(cell, mark).is_some_and(|n| n.is_parted);
        let file = self.file;
        if let Some(cell) = cells.iter().find(is_parted) {
            let value = sheet::number(cell, mark).map_or(0.0, |n| n.value);
            let cell = shorten(cell);
            self.notes.push(format!(
                "{file}: the mark in {cell} of the column {name} parts thousands, {why}: read as {value}"
            ));
        } else if style.seems_parted(mark)
            && let Some((cell, number)) = parted
        {
            let (cell, value) = (shorten(cell), number.value);
            self.notes.push(format!(
                "{file}: {cell} of the column {name} was read as {value}: does its mark part thousands? write it without"
            ));
        }
        Ok(mark)
    }

    /// Of a column that may be read in two ways, the only one that its kind allows; in a table of
    /// commas a point is a decimal point.
    fn likely_mark(&self, index: usize, cells: &[&str]) -> Option<DecimalMark> {
        let range = match (self.columns.get(index).copied().flatten()?, self.holds) {
            (Column::Of(kind), _) | (Column::Value, Holds::One { kind, .. }) => usual_range(kind),
            (Column::Depth, _) => [0.0, 500.0],
            (Column::Along, _) => [0.0, 1.0],
            (Column::Angle, _) => [-360.0, 360.0],
            (Column::Temperature, _) => [-60.0, 90.0],
            (Column::OfCement | Column::OfConcrete, _) => [0.0, 20.0],
            _ => [f64::NEG_INFINITY, f64::INFINITY],
        };
        let fits = |mark: &DecimalMark| {
            let numbers = cells.iter().filter_map(|cell| sheet::number(cell, *mark));
            let [factor, more] = self.scales.get(index).copied().unwrap_or([1.0, 0.0]);
            let mut scaled = numbers.map(|number| number.value * factor + more);
            scaled.all(|value| (range[0]..=range[1]).contains(&value))
        };
        let marks = [DecimalMark::Point, DecimalMark::Comma];
        let fit: Vec<DecimalMark> = marks.into_iter().filter(fits).collect();
        let has_comma = cells.iter().any(|cell| cell.contains(','));
        match fit[..] {
            [one] => Some(one),
            [_, _] if self.separator == b',' && !has_comma => Some(DecimalMark::Point),
            _ => None,
        }
    }

    /// What the rows say.
    fn take_rows(&self, rows: &[Row], out: &mut Rows, problems: &mut Vec<Problem>) {
        let survey = self.survey;
        match self.holds {
            Holds::One { kind, column } => {
                for (n, row) in rows.iter().enumerate() {
                    let found = row.number(column).and_then(|value| {
                        let factor = row.factor(kind, column)?;
                        let error = row.std_error(column, factor)?;
                        let finding = finding(kind, value * factor, error, survey);
                        self.record(row, format!("{} {}", survey.name, n + 1), finding)
                    });
                    take(found, &mut out.records, problems);
                }
            }
            Holds::Profiles { column } => {
                for (n, profile) in by_place(rows).iter().enumerate() {
                    // The table has its own name already, however few profiles there are.
                    let name = format!("{} {}", survey.name, n + 1);
                    take(self.profile(profile, name, column), &mut out.records, problems);
                }
            }
            Holds::Gauges => {
                for row in rows {
                    take(self.reading(row), &mut out.readings, problems);
                }
                problems.extend(self.hardly_strained(&out.readings));
            }
            Holds::Channels => {
                for (row, channel) in every(rows, &self.channels) {
                    let Some(cell) = row.of_channel(channel) else { continue };
                    take(self.channel(row, channel, cell), &mut out.readings, problems);
                }
                problems.extend(self.hardly_strained(&out.readings));
            }
            Holds::Grid { kind } => {
                for (n, (row, channel)) in every(rows, &self.channels).enumerate() {
                    let Some(cell) = row.of_channel(channel) else { continue };
                    let found = row.parse(channel.index, cell, Column::Value).and_then(|value| {
                        let factor = row.factor(kind, Column::Value)?;
                        let error = row.std_error(Column::Value, factor)?;
                        let finding = finding(kind, value * factor, error, survey);
                        self.record(row, format!("{} {}", survey.name, n + 1), finding)
                    });
                    take(found, &mut out.records, problems);
                }
            }
        }
        if out.records.is_empty() && out.readings.is_empty() && problems.is_empty() {
            let message = "no row of it can be used: take out what is none of a measurement";
            problems.push(Problem::error(self.file, "EMPTY", message));
        }
    }

    /// Tables of a gauge a column.
    fn of_channels(&mut self) -> Result<Holds, Problem> {
        let of_all = self.survey.unit.clone();
        let is_gauge = |channel: &Channel| {
            let unit = channel.unit.as_deref().or(of_all.as_deref());
            !channel.name.is_empty() && unit.and_then(GaugeUnit::named).is_some()
        };
        self.channels.retain(is_gauge);
        let mut names: Vec<&str> = self.channels.iter().map(|c| c.name.as_str()).collect();
        names.sort_unstable();
        if let Some([one, _]) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            let message = format!("the column {} is there twice: keep one of them", shorten(one));
            return Err(self.in_header("DUPLICATE", message));
        }
        if self.channels.is_empty() {
            let message = "no column has a unit of a gauge: give the unit ue, m/m, mm, m or MPa";
            return Err(self.in_header("NO_UNIT", message.into()));
        }
        let stray = [Column::Height, Column::Along, Column::Face, Column::Angle, Column::Depth];
        if let Some(column) = stray.into_iter().find(|column| self.has(*column)) {
            let message = format!(
                "the column {} is none of a table with a gauge a column: say where gauges are in evidence.ron",
                column.name()
            );
            return Err(self.in_header("UNFIT", message));
        }
        match self.unfit(Holds::Channels) {
            Some(message) => Err(self.in_header("UNFIT", message)),
            None => Ok(Holds::Channels),
        }
    }

    /// What a gauge that has a column of its own showed in a row.
    fn channel(
        &self,
        row: &Row,
        channel: &Channel,
        cell: &str,
    ) -> Result<Placed<RawReading>, Problem> {
        let shown = row.parse(channel.index, cell, Column::Value)?;
        let said = channel.unit.as_deref().or(self.survey.unit.as_deref());
        let unit = gauge_unit(said).map_err(|why| row.wrong(Column::Value, "NO_UNIT", why))?;
        self.shown(row, channel.name.clone(), None, shown, unit)
    }

    /// A row as a record.
    fn record(&self, row: &Row, name: String, shows: Finding) -> Result<Placed<Record>, Problem> {
        let survey = self.survey;
        let along = row.optional(Column::Along)?.map(|at| Along([at as f32; 2]));
        let (face, angle) = (row.face()?, row.optional(Column::Angle)?.map(|a| a as f32));
        // What a row says of its side holds before what is said of all.
        let own_side = face.is_some() || angle.is_some();
        let what = Record {
            member: survey.member.clone(),
            name,
            date: row.date()?.or(survey.date),
            along: along.or(survey.along),
            face: if own_side { face } else { survey.face },
            angle_deg: if own_side { angle } else { survey.angle_deg },
            height_m: row.optional(Column::Height)?.map(|h| h as f32).or(survey.height_m),
            instrument: survey.instrument.clone(),
            picture: None,
            confirmed: survey.confirmed,
            shows,
        };
        Ok(Placed { place: row.place(), is_row: true, what })
    }

    /// Rows of one place as a profile.
    fn profile(
        &self,
        rows: &[&Row],
        name: String,
        column: Column,
    ) -> Result<Placed<Record>, Problem> {
        let numbers = |column| rows.iter().map(|r| r.number(column)).collect::<Result<Vec<_>, _>>();
        let (depths_mm, percents) = (numbers(Column::Depth)?, numbers(column)?);
        rows.iter().try_for_each(|row| row.is_percent(column))?;
        let errors: Result<Vec<_>, _> = rows.iter().map(|r| r.std_error(column, 1.0)).collect();
        let of_cement = column == Column::OfCement;
        let shows = Finding::Chloride {
            depths_mm,
            percent_of_cement: if of_cement { percents.clone() } else { Vec::new() },
            percent_of_concrete: if of_cement { Vec::new() } else { percents },
            // One error stands for the whole profile: the largest.
            std_error_percent: errors?.into_iter().flatten().reduce(f64::max),
        };
        let Some(first) = rows.first() else {
            return Err(Problem::error(self.file, "EMPTY", "has no rows"));
        };
        self.record(first, name, shows)
    }

    fn reading(&self, row: &Row) -> Result<Placed<RawReading>, Problem> {
        let Some(of) = row.text(Column::Gauge) else {
            return Err(row.wrong(Column::Gauge, "EMPTY", "names no gauge"));
        };
        let shown = row.number(Column::Value)?;
        let unit =
            gauge_unit(row.unit()?).map_err(|why| row.wrong(Column::Unit, "NO_UNIT", why))?;
        let seat = self.seat(row)?;
        self.shown(row, of.to_owned(), seat, shown, unit)
    }

    /// What a gauge showed.
    fn shown(
        &self,
        row: &Row,
        of: String,
        seat: Option<Seat>,
        shown: f64,
        unit: GaugeUnit,
    ) -> Result<Placed<RawReading>, Problem> {
        if let Some(why) = unit.absurd(shown) {
            return Err(row.wrong(Column::Value, "UNIT", why));
        }
        let value = unit.si() * shown;
        let own = self.error_unit.as_deref().and_then(GaugeUnit::named).unwrap_or(unit);
        let std_error = match row.optional(Column::StdError)? {
            Some(error) if error > 0.0 => own.si() * error,
            Some(error) => {
                let message = format!("{error} is not above 0: say how uncertain the reading is");
                return Err(row.wrong(Column::StdError, "RANGE", message));
            }
            None => unit.usual_error(value),
        };
        let test = row.text(Column::Test).map(str::to_owned).or(self.survey.test.clone());
        let member = self.survey.member.clone();
        let date = row.date()?.or(self.survey.date);
        let day_to_come = date.filter(|d| !self.survey.confirmed && d.is_to_come());
        if let Some(date) = day_to_come {
            return Err(row.wrong(Column::Date, "FUTURE", super::check::to_come(date)));
        }
        let temperature_c = row.optional(Column::Temperature)?;
        if let Some(celsius) = temperature_c.filter(|c| !(-60.0..=90.0).contains(c)) {
            let message = format!("{celsius} °C is outside -60 to 90: is it Fahrenheit or kelvin?");
            return Err(row.wrong(Column::Temperature, "RANGE", message));
        }
        let what =
            RawReading { member, of, seat, test, date, temperature_c, value, std_error, unit };
        Ok(Placed { place: row.place(), is_row: true, what })
    }

    /// Refuses millionths none of which is as much as any gauge can tell from nought.
    fn hardly_strained(&self, rows: &[Placed<RawReading>]) -> Option<Problem> {
        let strains = rows.iter().filter(|row| row.what.unit == GaugeUnit::MicroStrain);
        let largest = strains.map(|row| row.what.value.abs()).fold(0.0, f64::max);
        let hardly = largest > 0.0 && largest < LEAST_STRAIN;
        hardly.then(|| {
            let message =
                "none is above 0.05 ue, less than any gauge can tell: in m/m? give the unit m/m";
            let place = format!("{}: column {}", self.file, Column::Value.name());
            Problem::error(place, "UNIT", message)
        })
    }

    /// Where a row says that its gauge is.
    fn seat(&self, row: &Row) -> Result<Option<Seat>, Problem> {
        let number = |column| row.optional(column).map(|x| x.map(|x| x as f32));
        let (face, angle_deg, depth_mm) =
            (row.face()?, number(Column::Angle)?, number(Column::Depth)?);
        let own_side = face.is_some() || angle_deg.is_some();
        let Some(along) = number(Column::Along)? else {
            if !own_side && depth_mm.is_none() {
                return Ok(None);
            }
            let message = "is empty: say how far along the axis the gauge is, 0 to 1";
            return Err(row.wrong(Column::Along, "EMPTY", message));
        };
        let Survey { face: of_all, angle_deg: angle_of_all, .. } = *self.survey;
        Ok(Some(Seat {
            along,
            face: if own_side { face } else { of_all },
            angle_deg: if own_side { angle_deg } else { angle_of_all },
            depth_mm,
        }))
    }

    /// The column that a field of a record comes from.
    fn column_of(&self, field: &str) -> &'static str {
        let column = match (self.holds, field) {
            (_, "along") => Column::Along,
            (_, "angle_deg") => Column::Angle,
            (_, "height_m") => Column::Height,
            (_, "date") => Column::Date,
            (_, field) if field.starts_with("shows.std_error") => Column::StdError,
            (_, field) if field.starts_with("shows.depths") => Column::Depth,
            (Holds::One { column, .. } | Holds::Profiles { column }, _) => column,
            (Holds::Gauges | Holds::Channels | Holds::Grid { .. }, _) => Column::Value,
        };
        column.name()
    }
}

/// What to do about a column whose name is nearly that of one that we know, or that of one without
/// its unit: to pass over it would lose what was measured.
fn mistaken(name: &str) -> Option<String> {
    let lower = name.to_ascii_lowercase();
    let nearly = |known: &&str| {
        known.len() > 3 && !lower.is_empty() && edit_distance(&lower, known) <= 1
            || known.strip_prefix(lower.as_str()).is_some_and(|rest| rest.starts_with('_'))
    };
    let is_known = COLUMNS.iter().map(|(name, _)| *name).any(|known| nearly(&known));
    (is_known || POTENTIALS.contains(&lower.as_str())).then(|| unknown_column(name))
}

/// Every row with every channel.
fn every<'r, 't>(
    rows: &'r [Row<'t>],
    channels: &'r [Channel],
) -> impl Iterator<Item = (&'r Row<'t>, &'r Channel)> {
    rows.iter().flat_map(move |row| channels.iter().map(move |channel| (row, channel)))
}

/// What a kind of measurement shows at least and at most, in the unit of its own column.
fn usual_range(kind: Kind) -> [f64; 2] {
    match kind {
        Kind::Cover | Kind::Carbonation => [0.0, 500.0],
        Kind::Rebound => [10.0, 100.0],
        Kind::Velocity => [300.0, 8000.0],
        Kind::HalfCell => [-1500.0, 1000.0],
    }
}

/// Names of potentials that say no unit.
const POTENTIALS: [&str; 6] = ["potential", "potential_mv", "half_cell", "half-cell", "e", "v"];

/// What to do about a column that [`mistaken`] finds.
fn unknown_column(name: &str) -> String {
    let names: Vec<&str> = COLUMNS.iter().map(|(name, _)| *name).collect();
    let lower = name.to_ascii_lowercase();
    let without_unit =
        |known: &&str| known.strip_prefix(lower.as_str()).is_some_and(|rest| rest.starts_with('_'));
    let short = shorten(name);
    if let Some(known) = names.iter().find(|k| without_unit(k)) {
        return format!(
            "the column \"{short}\" says no unit: give it in that of {known}, and call it so"
        );
    }
    if POTENTIALS.contains(&lower.as_str()) {
        return format!(
            "the column \"{short}\" says no unit: give potentials in mV, and call it so"
        );
    }
    let known = nearest(name, &names).unwrap_or("along");
    format!("there is no column \"{short}\": did you mean {known}?")
}

/// A row of a table.
struct Row<'a> {
    table: &'a Table<'a>,
    line: usize,
    cells: StringRecord,
}

impl Row<'_> {
    fn place(&self) -> String {
        format!("{}:{}", self.table.file, self.line)
    }

    fn wrong(&self, column: Column, code: &'static str, message: impl Into<String>) -> Problem {
        Problem::error(format!("{}: column {}", self.place(), column.name()), code, message)
    }

    /// What a column of a gauge shows; `None`: nothing, as loggers write gaps.
    fn of_channel(&self, channel: &Channel) -> Option<&str> {
        self.cells.get(channel.index).filter(|cell| !doubt::is_gap(cell))
    }

    /// What a cell holds, if it holds anything.
    fn text(&self, column: Column) -> Option<&str> {
        let index = self.table.columns.iter().position(|c| *c == Some(column))?;
        self.cells.get(index).filter(|cell| !cell.is_empty())
    }

    fn optional(&self, column: Column) -> Result<Option<f64>, Problem> {
        let index = self.table.columns.iter().position(|c| *c == Some(column));
        let Some((index, cell)) = index.zip(self.text(column)) else { return Ok(None) };
        let [factor, more] = self.table.scales.get(index).copied().unwrap_or([1.0, 0.0]);
        self.parse(index, cell, column).map(|number| Some(number * factor + more))
    }

    /// A cell's number as it is written.
    fn parse(&self, index: usize, cell: &str, column: Column) -> Result<f64, Problem> {
        let known = self.table.marks.get(index).copied().flatten();
        let mark = known.unwrap_or_else(|| sheet::own_mark(cell));
        sheet::number(cell, mark).map(|number| number.value).ok_or_else(|| {
            let hint = if cell.contains(',') {
                ": write decimals with a point, and no separator of thousands"
            } else {
                ": write a number alone, without its unit"
            };
            let message = format!("\"{}\" is no number{hint}", shorten(cell));
            self.wrong(column, "NO_NUMBER", message)
        })
    }

    /// A standard error in the unit of [`Finding`]; `factor` makes its value that. It has the unit
    /// of its value where its header says none.
    fn std_error(&self, of: Column, factor: f64) -> Result<Option<f64>, Problem> {
        let index = self.table.columns.iter().position(|c| *c == Some(of));
        let of_value = index.and_then(|i| self.table.scales.get(i)).map_or(1.0, |scale| scale[0]);
        let own = self.table.error_unit.as_deref().and_then(|unit| self.table.error_scale(unit));
        let factor = own.unwrap_or(of_value * factor);
        Ok(self.optional(Column::StdError)?.map(|error| error * factor))
    }

    fn number(&self, column: Column) -> Result<f64, Problem> {
        let empty = || self.wrong(column, "EMPTY", "is empty: give a value, or take the row out");
        self.optional(column)?.ok_or_else(empty)
    }

    /// In which unit its value is: as the row says, or as is said of all.
    fn unit(&self) -> Result<Option<&str>, Problem> {
        let of_all = self.table.survey.unit.as_deref().or(self.table.value_unit.as_deref());
        let own = self.text(Column::Unit);
        // Units of gauges may be written in several ways.
        let differ = |a: &str, b: &str| {
            a != b && GaugeUnit::named(a).is_none_or(|unit| GaugeUnit::named(b) != Some(unit))
        };
        match (own, of_all) {
            (Some(own), Some(all)) if differ(own, all) => {
                let (own, all) = (shorten(own), shorten(all));
                let message = format!(
                    "is {own}, and {all} is given for the whole table: leave that out, or correct \
                     the row"
                );
                Err(self.wrong(Column::Unit, "UNIT", message))
            }
            _ => Ok(own.or(of_all)),
        }
    }

    /// Refuses another unit than the column's.
    fn is_percent(&self, column: Column) -> Result<(), Problem> {
        match self.text(Column::Unit).filter(|unit| !unit.contains('%')) {
            Some(unit) => Err(self.not_of(column, unit)),
            None => Ok(()),
        }
    }

    fn not_of(&self, column: Column, unit: &str) -> Problem {
        let message = format!(
            "is {}, and the column {} has its unit in its name: correct one of them",
            shorten(unit),
            column.name()
        );
        self.wrong(Column::Unit, "UNIT", message)
    }

    /// What makes its number in `column` that of [`Finding`].
    fn factor(&self, kind: Kind, column: Column) -> Result<f64, Problem> {
        let said = self.unit()?;
        if column == Column::Value {
            return unit(Some(kind), said).map_err(|why| self.wrong(Column::Unit, "UNIT", why));
        }
        let of_column = kind.units().first().map(|(name, _)| *name);
        match said.filter(|said| Some(*said) != of_column) {
            Some(other) => Err(self.not_of(column, other)),
            None => Ok(1.0),
        }
    }

    fn face(&self) -> Result<Option<Face>, Problem> {
        let Some(cell) = self.text(Column::Face) else { return Ok(None) };
        Face::named(cell).map(Some).ok_or_else(|| {
            let names = Face::ALL.map(Face::name).join(", ");
            let message = format!("\"{}\" is no face: there are {names}", shorten(cell));
            self.wrong(Column::Face, "FACE", message)
        })
    }

    fn date(&self) -> Result<Option<Date>, Problem> {
        let Some(cell) = self.text(Column::Date) else { return Ok(None) };
        let day = day::read(cell, self.table.days).map_err(|why| {
            self.wrong(Column::Date, "DATE", format!("\"{}\" {why}", shorten(cell)))
        })?;
        Ok(Some(day.date))
    }

    /// Where and when a row was measured, comparable: numbers by their value, however written.
    fn place_key(&self) -> [Option<String>; 5] {
        [Column::Along, Column::Angle, Column::Height, Column::Face, Column::Date].map(|column| {
            let cell = self.text(column)?;
            let number = match column {
                Column::Face | Column::Date => None,
                _ => self.optional(column).ok().flatten(),
            };
            Some(number.map_or_else(|| cell.to_ascii_lowercase(), |number| number.to_string()))
        })
    }
}

/// Rows of one place each, in the order in which places come up.
fn by_place<'r, 't>(rows: &'r [Row<'t>]) -> Vec<Vec<&'r Row<'t>>> {
    let mut index = HashMap::with_capacity(rows.len());
    let mut places: Vec<Vec<&Row>> = Vec::new();
    for row in rows {
        let at = *index.entry(row.place_key()).or_insert(places.len());
        match places.get_mut(at) {
            Some(place) => place.push(row),
            None => places.push(vec![row]),
        }
    }
    places
}
