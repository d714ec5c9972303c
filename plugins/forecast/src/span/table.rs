//! A table of bridges: RFC 4180, one bridge a row.

use csv::{ReaderBuilder, StringRecord, Trim};
use intrados_scene::structure::Date;
use intrados_stage::sheet::{self, DecimalMark, NumberStyle, StyleVerdict};

/// What a table says of a bridge.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Bridge {
    /// Unlike all others of the table.
    pub id: String,
    /// What it is called.
    pub name: String,
    /// The road that it carries or crosses.
    pub road: String,
    /// Latitude and longitude, degrees.
    pub place: Option<[f64; 2]>,
    /// When it was built.
    pub year: Option<i32>,
    /// When it was last rehabilitated as a whole.
    pub rehabilitated: Option<i32>,
    /// Lengths of its spans, m, one after the other.
    pub spans: Vec<f64>,
}

/// A table of bridges.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BridgeTable {
    /// In the order of the table.
    pub bridges: Vec<Bridge>,
    /// What of it was not believed, assumed or doubted, for people: a line each.
    pub doubts: Vec<String>,
}

/// Why a table is not read: one line that names the place.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct TableError(String);

/// Heads by which a column is known, in capitals.
const ID: &[&str] = &["ID", "BRIDGE_ID", "STRUCTURE NUMBER"];
const NAME: &[&str] = &["STRUCTURE", "NAME"];
const ROAD: &[&str] = &["HWY NAME", "ROAD"];
const LATITUDE: &[&str] = &["LATITUDE", "LATITUDE [DEG]"];
const LONGITUDE: &[&str] = &["LONGITUDE", "LONGITUDE [DEG]"];
const YEAR: &[&str] = &["YEAR BUILT", "YEAR"];
const REHABILITATED: &[&str] = &["LAST MAJOR REHAB", "REHABILITATED"];
const SPANS: &[&str] = &["SPAN DETAILS", "SPANS [M]", "SPANS [FT]"];
/// Words that stand in place of a number where a spreadsheet adds up.
const TOTALS: [&str; 9] =
    ["total", "totals", "sum", "sum:", "total:", "summe", "gesamt", "mean", "average"];
/// Spans of one bridge beyond which they are doubted.
const MANY_SPANS: usize = 200;
/// One foot, m.
const FOOT: f64 = 0.3048;
/// Years that registers write where they know none.
const NO_YEARS: [i64; 6] = [0, 1, 99, 999, 9998, 9999];
/// Year that registers write for all that is old.
const OLD: i32 = 1900;
/// Spans whose middle one is longer are doubted, m: as a table without a unit lies in the United
/// States, whose registers are in feet; and anywhere.
const LONG: [f64; 2] = [40.0, 90.0];
/// The box around the contiguous United States, degrees.
const STATES: [[f64; 2]; 2] = [[24.0, 50.0], [-125.0, -66.0]];
/// How far from the others of its table a bridge is doubted, degrees.
const FAR: f64 = 15.0;

/// Most bridges of a table.
const MOST: usize = 1_000_000;
/// Longest word that is kept.
const LONGEST: usize = 200;

/// Reads a table: cells parted by commas, semicolons or tabs, in any encoding that
/// [`sheet::decode`] knows. Spans are numbers with semicolons between, such as `12;19;21`, or
/// `Total=52 (1)=12;(2)=19;(3)=21;`.
///
/// # Errors
/// A column is missing, or a cell cannot be what its column says: the line says which.
pub fn parse(bytes: &[u8]) -> Result<BridgeTable, TableError> {
    let sheet = sheet::decode(bytes).map_err(|why| TableError(why.to_string()))?;
    let mut doubts = Doubts::default();
    if let Some(encoding) = sheet.assumed {
        doubts.of_all.push(format!("is not UTF-8, and was read as {encoding}"));
    }
    let first = sheet.text.lines().next().unwrap_or_default();
    let named = sheet::named_separator(first);
    let text = match named {
        Some(_) => sheet.text.split_once('\n').map_or("", |(_, rest)| rest),
        None => sheet.text.as_str(),
    };
    let header = text.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
    // Spans have semicolons within: a header has none of them.
    let separator = named.unwrap_or_else(|| sheet::separator(header));
    let mut reader = ReaderBuilder::new()
        .delimiter(separator)
        .trim(Trim::All)
        .flexible(true)
        .from_reader(text.as_bytes());
    let heads = reader.headers().map_err(|e| TableError(format!("is no table: {e}")))?.clone();
    let columns = Columns::named(&heads)?;
    doubts.of_all.extend(columns.not_read(&heads));
    let mut records = Vec::new();
    for (k, record) in reader.records().enumerate() {
        let at = |why: String| TableError(format!("row {}: {why}", k + 2));
        if k >= MOST {
            return Err(at(format!("more than {MOST} bridges: split the table")));
        }
        let record = record.map_err(|e| at(format!("cannot be read: {e}")))?;
        if record.iter().skip(heads.len()).any(|cell| !cell.is_empty()) {
            return Err(at(format!(
                "has {} cells, and the header {}: was a decimal comma taken for a separator? part columns by ;",
                record.len(),
                heads.len()
            )));
        }
        if record.iter().any(|cell| !cell.is_empty()) {
            records.push((k + 2, record));
        }
    }
    let mark = columns.mark(&records);
    let mut bridges: Vec<Bridge> = Vec::new();
    let mut known = std::collections::BTreeMap::<String, u32>::new();
    for (row, record) in &records {
        let at = |why: String| TableError(format!("row {row}: {why}"));
        let mut bridge = columns.bridge(record, mark, &mut doubts).map_err(at)?;
        if TOTALS.contains(&bridge.id.to_lowercase().as_str()) {
            doubts.add(
                &bridge.id,
                "is the name of a sum, no bridge: its row was not used",
                &bridge.id,
            );
            continue;
        }
        // Two rows of one number are two structures to whoever keeps the table.
        let times = known.entry(bridge.id.clone()).or_default();
        *times += 1;
        if *times > 1 {
            let shown = format!("row {row}");
            doubts.add(&bridge.id, "has its number again: it was taken for another bridge", &shown);
            bridge.id = format!("{} #{times}", bridge.id);
        }
        bridges.push(bridge);
    }
    let doubts = doubts.lines(&bridges, columns.in_feet.is_none());
    Ok(BridgeTable { bridges, doubts })
}

/// What of a table is not believed: of each kind the first bridge, and how many.
#[derive(Debug, Default)]
struct Doubts {
    of_all: Vec<String>,
    of_bridges: std::collections::BTreeMap<&'static str, (String, usize)>,
}

impl Doubts {
    fn add(&mut self, id: &str, what: &'static str, shown: &str) {
        let shown = format!("bridge {}: {} {what}", short(id), short(shown));
        self.of_bridges.entry(what).or_insert((shown, 0)).1 += 1;
    }

    fn lines(mut self, bridges: &[Bridge], without_unit: bool) -> Vec<String> {
        for bridge in bridges.iter().filter(|bridge| bridge.year == Some(OLD)) {
            self.add(
                &bridge.id,
                "is what registers write for all that is old: it was used as the year",
                "1900",
            );
        }
        self.far(bridges);
        self.of_all.extend(long_spans(bridges, without_unit));
        let more = |n: usize| if n > 1 { format!(" (and {} more)", n - 1) } else { String::new() };
        let of_bridges = self.of_bridges.into_values().map(|(line, n)| line + &more(n));
        self.of_all.into_iter().chain(of_bridges).collect()
    }

    /// Bridges far from the middle one, and those that lie there once their numbers are swapped.
    fn far(&mut self, bridges: &[Bridge]) {
        let middle = [0, 1].map(|k| median(bridges.iter().filter_map(|b| Some(b.place?[k]))));
        let [Some(north), Some(east)] = middle else { return };
        let off = |[a, b]: [f64; 2]| (a - north).abs().max((b - east).abs());
        for bridge in bridges {
            let Some(place) = bridge.place.filter(|place| off(*place) > FAR) else { continue };
            let [latitude, longitude] = place;
            let is_swapped = off([longitude, latitude]) < FAR;
            let what = match is_swapped {
                true => "is far from the others, and not with latitude and longitude swapped",
                false => "is far from the others: is its place right?",
            };
            self.add(&bridge.id, what, &format!("{latitude}, {longitude}"));
        }
    }
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Spans that are probably in feet.
fn long_spans(bridges: &[Bridge], without_unit: bool) -> Option<String> {
    let middle = median(bridges.iter().flat_map(|b| b.spans.iter().copied()))?;
    let within = |value: f64, [low, high]: [f64; 2]| (low..=high).contains(&value);
    let in_states = |[north, east]: [f64; 2]| within(north, STATES[0]) && within(east, STATES[1]);
    let is_there = bridges.iter().filter_map(|b| b.place).any(in_states);
    let most = if without_unit && is_there { LONG[0] } else { LONG[1] };
    (middle > most).then(|| {
        format!(
            "half of the spans are longer than {middle} m: in feet? name the column \"SPANS [FT]\"; they were used as metres"
        )
    })
}

struct Columns {
    id: usize,
    year: usize,
    spans: usize,
    name: Option<usize>,
    road: Option<usize>,
    place: [Option<usize>; 2],
    rehabilitated: Option<usize>,
    /// Whether spans are in feet; none: their header does not say it.
    in_feet: Option<bool>,
}

impl Columns {
    fn named(heads: &StringRecord) -> Result<Self, TableError> {
        let column = |names: &[&str]| {
            let is_it = |(_, head): &(usize, &str)| names.contains(&head.to_uppercase().as_str());
            let all: Vec<(usize, &str)> = heads.iter().enumerate().filter(is_it).collect();
            match all[..] {
                [] => Ok(None),
                [(at, _)] => Ok(Some(at)),
                [(_, one), (_, other), ..] => Err(TableError(format!(
                    "the columns \"{one}\" and \"{other}\" are for the same: take one out, or call it otherwise"
                ))),
            }
        };
        let needed = |names: &[&str]| {
            column(names)?.ok_or_else(|| {
                TableError(format!("has no column \"{}\": name one so", names.join("\" or \"")))
            })
        };
        let spans = needed(SPANS)?;
        let head = heads.get(spans).unwrap_or_default().to_uppercase();
        Ok(Self {
            id: needed(ID)?,
            year: needed(YEAR)?,
            spans,
            name: column(NAME)?,
            road: column(ROAD)?,
            place: [column(LATITUDE)?, column(LONGITUDE)?],
            rehabilitated: column(REHABILITATED)?,
            in_feet: head.contains('[').then(|| head.contains("[FT]")),
        })
    }

    /// Which columns say nothing to us.
    fn not_read(&self, heads: &StringRecord) -> Option<String> {
        let known = [
            [Some(self.id), Some(self.year), Some(self.spans), self.name],
            [self.road, self.place[0], self.place[1], self.rehabilitated],
        ];
        let is_known = |at: usize| known.iter().flatten().any(|column| *column == Some(at));
        let strange: Vec<&str> = heads
            .iter()
            .enumerate()
            .filter(|(at, head)| !head.is_empty() && !is_known(*at))
            .map(|(_, head)| head)
            .collect();
        let (first, n) = (strange.first()?, strange.len());
        let more = if n > 1 { format!(" and {} more", n - 1) } else { String::new() };
        Some(format!(
            "the column \"{}\"{more} is not known here: its cells are not read",
            short(first)
        ))
    }

    /// The decimal mark of the table: as its places and its spans show; a point where nothing does.
    fn mark(&self, records: &[(usize, StringRecord)]) -> DecimalMark {
        let mut style = NumberStyle::default();
        for (_, record) in records {
            for at in self.place.into_iter().flatten() {
                style.learn(record.get(at).unwrap_or_default());
            }
            let spans = record.get(self.spans).unwrap_or_default();
            // A lone comma may part two spans.
            spans.split(';').filter(|_| spans.contains(';')).for_each(|part| {
                style.learn(part.rsplit('=').next().unwrap_or_default().trim());
            });
        }
        match style.verdict(NumberStyle::default()) {
            StyleVerdict::Certain(mark) => mark,
            StyleVerdict::Open | StyleVerdict::Mixed => DecimalMark::Point,
        }
    }

    fn bridge(
        &self,
        record: &StringRecord,
        mark: DecimalMark,
        doubts: &mut Doubts,
    ) -> Result<Bridge, String> {
        let cell = |at: usize| record.get(at).unwrap_or_default().trim();
        let word = |at: Option<usize>| -> String {
            let words: Vec<&str> = at.map_or("", cell).split_whitespace().collect();
            words.join(" ").chars().take(LONGEST).collect()
        };
        let [latitude, longitude] = self.place.map(|at| at.map_or("", cell));
        let id = word(Some(self.id));
        if id.is_empty() {
            return Err("has no number of the structure: give one".into());
        }
        let place = place([latitude, longitude], &id, mark, doubts)?;
        let built = year("year of building", cell(self.year), &id, doubts)?;
        let rehabilitated =
            year("year of rehabilitation", self.rehabilitated.map_or("", cell), &id, doubts)?;
        let is_before = built.zip(rehabilitated).is_some_and(|(built, again)| again < built);
        if is_before {
            let what = "is a rehabilitation before the year of building: it was not used";
            doubts.add(&id, what, &rehabilitated.unwrap_or_default().to_string());
        }
        let spans = spans(cell(self.spans), mark)?;
        if spans.is_empty() {
            doubts.add(&id, "spans: nothing is computed of it", "no");
        }
        if spans.len() > MANY_SPANS {
            let shown = spans.len().to_string();
            doubts.add(&id, "spans are more than any but a few bridges have: is it one?", &shown);
        }
        let metres = if self.in_feet == Some(true) { FOOT } else { 1.0 };
        Ok(Bridge {
            name: word(self.name),
            road: word(self.road),
            place,
            year: built,
            rehabilitated: rehabilitated.filter(|_| !is_before),
            spans: spans.into_iter().map(|span| span * metres).collect(),
            id,
        })
    }
}

/// A place, degrees. That of the National Bridge Inventory is in degrees, minutes and hundredths of
/// seconds in one number, the longitude to the west.
fn place(
    [latitude, longitude]: [&str; 2],
    id: &str,
    mark: DecimalMark,
    doubts: &mut Doubts,
) -> Result<Option<[f64; 2]>, String> {
    if let (Some(north), Some(west)) = (sexagesimal(latitude, 8), sexagesimal(longitude, 9)) {
        let what = "was read as degrees, minutes and seconds, the longitude to the west";
        doubts.add(id, what, &format!("{latitude}, {longitude}"));
        return Ok(Some([north, -west]));
    }
    let north = number("latitude", latitude, 90.0, mark)?;
    let east = number("longitude", longitude, 180.0, mark)?;
    let found = north.zip(east).map(|(north, east)| [north, east]);
    let is_nowhere = found.is_some_and(|[north, east]| north.abs() < 1e-6 && east.abs() < 1e-6);
    if is_nowhere {
        doubts.add(id, "is no place of a bridge: it was not used", "0, 0");
    }
    Ok(found.filter(|_| !is_nowhere))
}

/// Degrees of so many digits: `40061234` is 40° 6′ 12.34″.
fn sexagesimal(text: &str, digits: usize) -> Option<f64> {
    let is_whole = text.len() == digits && text.bytes().all(|b| b.is_ascii_digit());
    let number: u32 = text.parse().ok().filter(|_| is_whole)?;
    let [degrees, minutes, hundredths] =
        [number / 1_000_000, number / 10_000 % 100, number % 10_000];
    let found = f64::from(degrees) + f64::from(minutes) / 60.0 + f64::from(hundredths) / 360_000.0;
    (minutes < 60 && hundredths < 6000 && found <= 180.0).then_some(found)
}

/// A number of degrees up to `most` either way; none of an empty cell.
fn number(what: &str, text: &str, most: f64, mark: DecimalMark) -> Result<Option<f64>, String> {
    if text.is_empty() {
        return Ok(None);
    }
    let value = sheet::number(text, mark).map(|n| n.value).filter(|x| x.abs() <= most);
    value.map(Some).ok_or_else(|| {
        format!("{what} is \"{}\": give degrees, -{most} to {most}, or nothing", short(text))
    })
}

/// A year; none of an empty cell, of what registers write where they know none, and of a year to
/// come.
fn year(what: &str, text: &str, id: &str, doubts: &mut Doubts) -> Result<Option<i32>, String> {
    if text.is_empty() {
        return Ok(None);
    }
    // Spreadsheets make decimals of whole numbers.
    let whole = text.split_once(['.', ',']).map_or(text, |(whole, decimals)| {
        if decimals.bytes().all(|b| b == b'0') { whole } else { text }
    });
    let wrong = || format!("{what} is \"{}\": give 1700 to today, or nothing", short(text));
    let year: i64 = whole.parse().map_err(|_| wrong())?;
    if NO_YEARS.contains(&year) {
        if year != 0 {
            doubts.add(
                id,
                "is what registers write where they know no year: it was not used",
                text,
            );
        }
        return Ok(None);
    }
    let year = i32::try_from(year).ok().filter(|y| (1700..=2200).contains(y)).ok_or_else(wrong)?;
    if year > Date::today().year() {
        doubts.add(id, "is a year to come: it was not used", text);
        return Ok(None);
    }
    Ok(Some(year))
}

/// Lengths of spans: of `(1)=12;` the number after the sign, of `12` itself; a total is left out.
fn spans(text: &str, mark: DecimalMark) -> Result<Vec<f64>, String> {
    let mut spans = Vec::new();
    // Where semicolons part the spans, a comma is of decimals.
    let is_comma = text.contains(';') && text.contains(',') && !text.contains('.');
    let mark = if is_comma { DecimalMark::Comma } else { mark };
    for part in text.split([';', ' ']).map(str::trim) {
        let (key, value) = part.split_once('=').unwrap_or(("", part));
        if part.is_empty() || key.eq_ignore_ascii_case("total") {
            continue;
        }
        // One comma may part two spans, or be of decimals.
        let is_open = value.contains(',') && mark == DecimalMark::Point;
        match sheet::number(value, mark).map(|number| number.value).filter(|_| !is_open) {
            Some(length) if (0.1..=3000.0).contains(&length) => spans.push(length),
            _ => {
                return Err(format!(
                    "a span is \"{}\": give metres, .1 to 3000, with semicolons between",
                    short(part)
                ));
            }
        }
    }
    Ok(spans)
}

fn short(text: &str) -> String {
    text.chars().take(30).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_of_writing_spans_are_read() {
        let text = "ID,STRUCTURE,LATITUDE,LONGITUDE,YEAR BUILT,SPAN DETAILS\n\
                    1,Over  the creek,43.1,-80.2,1965,Total=52 (1)=12;(2)=19;(3)=21;\n\
                    2,,,,,7.5\n\
                    2,,,,,8\n";
        let decimals = |text: &str| spans(text, DecimalMark::Point).unwrap();
        assert_eq!(decimals("12,5;19,0"), [12.5, 19.0]);
        assert_eq!(decimals("12.5;19.25"), [12.5, 19.25]);
        assert!(spans("12,19", DecimalMark::Point).is_err(), "one span or two");
        let bridges = parse(text.as_bytes()).unwrap().bridges;
        assert_eq!(bridges[0].spans, [12.0, 19.0, 21.0]);
        assert_eq!((bridges[0].place, bridges[0].year), (Some([43.1, -80.2]), Some(1965)));
        assert_eq!(bridges[0].name, "Over the creek");
        assert_eq!((bridges[1].year, &bridges[1].spans[..]), (None, &[7.5][..]));
        assert_eq!(bridges[2].id, "2 #2");
        let table = "ID,OWNER,YEAR,SPANS [m]\n1,we,1965,12\nTotal,,,12\n1,we,1970,14\n";
        let read = parse(table.as_bytes()).unwrap();
        assert_eq!(read.bridges.iter().map(|b| b.id.as_str()).collect::<Vec<_>>(), ["1", "1 #2"]);
        for said in ["\"OWNER\" is not known", "name of a sum", "row 4 has its number again"] {
            assert!(read.doubts.iter().any(|d| d.contains(said)), "{said} {:?}", read.doubts);
        }
    }

    /// What no bridge has is refused, and the line says in which row and what to do.
    #[test]
    fn impossible_cells_are_refused() {
        for (row, word) in [
            ("1,95,0,1965,12", "latitude"),
            ("1,43,NaN,1965,12", "longitude"),
            ("1,43,0,12,12", "year"),
            ("1,43,0,1965,-3", "span"),
            ("1,43,0,1965,inf", "span"),
            (",43,0,1965,12", "number"),
        ] {
            let text = format!("ID,LATITUDE,LONGITUDE,YEAR,SPANS [m]\n{row}\n");
            let why = parse(text.as_bytes()).unwrap_err().to_string();
            assert!(why.starts_with("row 2: ") && why.contains(word), "{row}: {why}");
        }
        assert!(parse(b"ID,YEAR\n").unwrap_err().to_string().contains("SPAN DETAILS"));
    }
}
