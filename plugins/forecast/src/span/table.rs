//! A table of bridges: RFC 4180, one bridge a row.

use csv::{ReaderBuilder, StringRecord, Trim};

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
const SPANS: &[&str] = &["SPAN DETAILS", "SPANS [M]"];

/// Most bridges of a table.
const MOST: usize = 1_000_000;
/// Longest word that is kept.
const LONGEST: usize = 200;

/// Reads a table. Spans are numbers with semicolons between, such as `12;19;21`, or
/// `Total=52 (1)=12;(2)=19;(3)=21;`.
///
/// # Errors
/// A column is missing, or a cell cannot be what its column says: the line says which.
pub fn parse(text: &[u8]) -> Result<Vec<Bridge>, TableError> {
    let mut reader = ReaderBuilder::new().trim(Trim::All).flexible(true).from_reader(text);
    let heads = reader.headers().map_err(|e| TableError(format!("is no table: {e}")))?.clone();
    let column = |names: &[&str]| {
        heads.iter().position(|h| {
            let head = h.trim_start_matches('\u{feff}').to_uppercase();
            names.contains(&head.as_str())
        })
    };
    let needed = |names: &[&str]| {
        column(names).ok_or_else(|| {
            TableError(format!("has no column \"{}\": name one so", names.join("\" or \"")))
        })
    };
    let columns = Columns {
        id: needed(ID)?,
        year: needed(YEAR)?,
        spans: needed(SPANS)?,
        name: column(NAME),
        road: column(ROAD),
        place: [column(LATITUDE), column(LONGITUDE)],
        rehabilitated: column(REHABILITATED),
    };
    let mut bridges: Vec<Bridge> = Vec::new();
    let mut known = std::collections::BTreeMap::<String, u32>::new();
    for (k, record) in reader.records().enumerate() {
        let at = |why: String| TableError(format!("row {}: {why}", k + 2));
        if k >= MOST {
            return Err(at(format!("more than {MOST} bridges: split the table")));
        }
        let record = record.map_err(|e| at(format!("cannot be read: {e}")))?;
        let mut bridge = columns.bridge(&record).map_err(at)?;
        // Two rows of one number are two structures to whoever keeps the table.
        let times = known.entry(bridge.id.clone()).or_default();
        *times += 1;
        if *times > 1 {
            bridge.id = format!("{} #{times}", bridge.id);
        }
        bridges.push(bridge);
    }
    Ok(bridges)
}

struct Columns {
    id: usize,
    year: usize,
    spans: usize,
    name: Option<usize>,
    road: Option<usize>,
    place: [Option<usize>; 2],
    rehabilitated: Option<usize>,
}

impl Columns {
    fn bridge(&self, record: &StringRecord) -> Result<Bridge, String> {
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
        Ok(Bridge {
            id,
            name: word(self.name),
            road: word(self.road),
            place: number("latitude", latitude, 90.0)?
                .zip(number("longitude", longitude, 180.0)?)
                .map(|(latitude, longitude)| [latitude, longitude]),
            year: year("year of building", cell(self.year))?,
            rehabilitated: year("year of rehabilitation", self.rehabilitated.map_or("", cell))?,
            spans: spans(cell(self.spans))?,
        })
    }
}

/// A number of degrees up to `most` either way; none of an empty cell.
fn number(what: &str, text: &str, most: f64) -> Result<Option<f64>, String> {
    if text.is_empty() {
        return Ok(None);
    }
    let value = text.parse::<f64>().ok().filter(|x| x.abs() <= most);
    value.map(Some).ok_or_else(|| {
        format!("{what} is \"{}\": give degrees, -{most} to {most}, or nothing", short(text))
    })
}

fn year(what: &str, text: &str) -> Result<Option<i32>, String> {
    if text.is_empty() {
        return Ok(None);
    }
    let year = text.parse().ok().filter(|y| (1700..=2200).contains(y));
    year.map(Some)
        .ok_or_else(|| format!("{what} is \"{}\": give 1700 to 2200, or nothing", short(text)))
}

/// Lengths of spans: of `(1)=12;` the number after the sign, of `12` itself; a total is left out.
fn spans(text: &str) -> Result<Vec<f64>, String> {
    let mut spans = Vec::new();
    for part in text.split([';', ' ']).map(str::trim) {
        let (key, value) = part.split_once('=').unwrap_or(("", part));
        if part.is_empty() || key.eq_ignore_ascii_case("total") {
            continue;
        }
        match value.parse::<f64>() {
            Ok(length) if (0.1..=3000.0).contains(&length) => spans.push(length),
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
        let bridges = parse(text.as_bytes()).unwrap();
        assert_eq!(bridges[0].spans, [12.0, 19.0, 21.0]);
        assert_eq!((bridges[0].place, bridges[0].year), (Some([43.1, -80.2]), Some(1965)));
        assert_eq!(bridges[0].name, "Over the creek");
        assert_eq!((bridges[1].year, &bridges[1].spans[..]), (None, &[7.5][..]));
        assert_eq!(bridges[2].id, "2 #2");
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
