//! What a table holds that is probably not meant. What cannot be believed is not used until it is
//! confirmed: what instruments write where they measured nothing, potentials that have lost their
//! sign. What is only odd is used, and said.

use std::collections::{HashMap, HashSet};

use super::{Column, Finding, Holds, Kind, Placed, Problem, Record, Row, Rows, Table};

/// What instruments and loggers write where they measured nothing, whatever the sign.
const SENTINELS: [f64; 20] = [
    999.0,
    9999.0,
    99_999.0,
    999_999.0,
    9_999_999.0,
    99_999_999.0,
    999.9,
    9999.9,
    999.99,
    9999.99,
    99.9,
    99.99,
    888.0,
    8888.0,
    6999.0,
    7999.0,
    32_767.0,
    32_768.0,
    65_535.0,
    2_147_483_647.0,
];
/// Of this size nothing was measured.
const HUGE: f64 = 1e9;
/// How far beyond all others a value is that is taken for one of these.
const BEYOND: f64 = 1.5;

/// Remedy of all that is doubted.
const CONFIRM: &str = "confirm the table (confirmed: true, attach --confirmed)";

/// Whether a cell of a logger holds nothing.
pub(super) fn is_gap(cell: &str) -> bool {
    let cell = cell.trim();
    let words =
        ["nan", "na", "n/a", "#n/a", "null", "none", "inf", "-inf", "ovl", "ol", "overflow"];
    cell.chars().all(|c| matches!(c, '-' | '*' | '\u{2014}' | '\u{2013}'))
        || words.contains(&cell.to_ascii_lowercase().as_str())
}

/// Leaves out rows, and cells of loggers, that hold what instruments write where they measured
/// nothing; says which.
pub(super) fn leave_out(table: &Table, rows: &mut Vec<Row>) -> Result<Option<String>, Problem> {
    if table.survey.confirmed {
        return Ok(None);
    }
    let mut found: Vec<(usize, String)> = Vec::new();
    let kind = kind_of(table);
    for index in value_columns(table) {
        let raw = |row: &Row| {
            let cell = row.cells.get(index).filter(|cell| !cell.is_empty())?;
            row.parse(index, cell, Column::Value).ok()
        };
        let values: Vec<Option<f64>> = rows.iter().map(raw).collect();
        let is_positive = is_positive(table);
        let mut others: Vec<f64> =
            values.iter().flatten().filter(|v| !is_listed(**v, kind)).map(|v| v.abs()).collect();
        // What a gauge shows may be anything; of one kind most are near the middle, and one that is
        // odd does not make another usual.
        let usual = match kind {
            Some(_) => median(&mut others),
            None => others.iter().copied().reduce(f64::max),
        };
        let is_far = |value: f64| {
            usual.is_none_or(|usual| {
                value > BEYOND * usual || kind.is_some() && value < usual / BEYOND
            })
        };
        let is_one = |value: f64| {
            is_listed(value, kind) && (is_positive && value < 0.0 || is_far(value.abs()))
        };
        let ones: Vec<usize> = values
            .iter()
            .enumerate()
            .filter_map(|(n, value)| value.filter(|v| is_one(*v)).map(|_| n))
            .collect();
        for n in ones {
            if let Some(row) = rows.get_mut(n) {
                let cell = row.cells.get(index).unwrap_or_default().to_owned();
                found.push((row.line, cell));
                row.cells = row
                    .cells
                    .iter()
                    .enumerate()
                    .map(|(i, c)| if i == index { "" } else { c })
                    .collect();
            }
        }
    }
    if !matches!(table.holds, Holds::Channels | Holds::Grid { .. }) {
        let lines: HashSet<usize> = found.iter().map(|(line, _)| *line).collect();
        rows.retain(|row| !lines.contains(&row.line));
    }
    let Some((line, cell)) = found.first() else { return Ok(None) };
    let more = more_like_it(found.len());
    let message = format!(
        "{}:{line}: {cell}{more} not used: instruments write it where they measured nothing; take it out, or {CONFIRM}",
        table.file
    );
    match rows.is_empty() {
        true => Err(Problem::error(table.file, "NOTHING_MEASURED", message)),
        false => Ok(Some(message)),
    }
}

/// Behind the first of `count`.
fn more_like_it(count: usize) -> String {
    match count {
        1 => String::new(),
        n => format!(" and {} more like it", n - 1),
    }
}

/// Columns of what was measured.
fn value_columns(table: &Table) -> Vec<usize> {
    let column = match table.holds {
        Holds::One { column, .. } | Holds::Profiles { column } => column,
        Holds::Gauges => Column::Value,
        Holds::Channels | Holds::Grid { .. } => {
            return table.channels.iter().map(|channel| channel.index).collect();
        }
    };
    table.columns.iter().position(|c| *c == Some(column)).into_iter().collect()
}

/// What a table of one kind holds.
fn kind_of(table: &Table) -> Option<Kind> {
    match table.holds {
        Holds::One { kind, .. } | Holds::Grid { kind } => Some(kind),
        Holds::Profiles { .. } | Holds::Gauges | Holds::Channels => None,
    }
}

/// Whether what a table holds is never below 0.
fn is_positive(table: &Table) -> bool {
    match kind_of(table) {
        Some(kind) => kind != Kind::HalfCell,
        None => matches!(table.holds, Holds::Profiles { .. }),
    }
}

fn is_listed(value: f64, kind: Option<Kind>) -> bool {
    let size = value.abs();
    let is_it = |one: &f64| (one - size).abs() < 1e-9 * size;
    let least = match kind {
        // Potentials and velocities have as much as -99.9 and 255 by themselves.
        Some(Kind::HalfCell | Kind::Velocity) => 888.0,
        _ => 0.0,
    };
    // What one byte holds at most is no cover, but a number like others to a gauge.
    let is_byte = matches!(kind, Some(Kind::Cover | Kind::Carbonation)) && is_it(&255.0);
    size >= HUGE || is_byte || size >= least && SENTINELS.iter().any(is_it)
}

/// The middle of values, between two of them.
fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let upper = values.get(values.len() / 2)?;
    let lower = values.get((values.len() - 1) / 2)?;
    Some(0.5 * (upper + lower))
}

/// Potential below which its sign is doubted, mV: steel in dry concrete shows little more.
const POSITIVE: f64 = 50.0;

/// A potential, mV.
fn potential(record: &Placed<Record>) -> Option<f64> {
    match record.what.shows {
        Finding::HalfCell { mv, .. } => Some(mv),
        _ => None,
    }
}

/// Whether a record is a potential that seems to have lost its sign.
fn is_unsigned(record: &Placed<Record>) -> bool {
    potential(record).is_some_and(|mv| mv > POSITIVE)
}

/// Refuses potentials of which as many seem to have lost their sign as have one.
pub(super) fn sign_lost(table: &Table, out: &Rows) -> Option<Problem> {
    let first = out.records.iter().find(|record| is_unsigned(record))?;
    let lost = out.records.iter().filter(|record| is_unsigned(record)).count();
    let negative = out.records.iter().filter_map(potential).filter(|mv| *mv < 0.0).count();
    let mv = potential(first).filter(|_| !table.survey.confirmed && lost >= negative)?;
    let of = match negative {
        0 => "none of the table is negative".to_owned(),
        _ => format!("{lost} of {} of the table are above {POSITIVE} mV", out.records.len()),
    };
    let message = format!("{mv} mV, and {of}: was the sign lost? write -{mv}, or {CONFIRM}");
    Some(Problem::error(first.field("mV"), "SIGN", message))
}

/// Takes out the few potentials of a table that seem to have lost their sign; says which.
pub(super) fn leave_out_unsigned(table: &Table, out: &mut Rows) -> Option<String> {
    let first = out.records.iter().find(|record| is_unsigned(record));
    let first = first.filter(|_| !table.survey.confirmed)?;
    let (place, mv, before) = (first.place.clone(), potential(first)?, out.records.len());
    out.records.retain(|record| !is_unsigned(record));
    let more = more_like_it(before - out.records.len());
    Some(format!(
        "{place}: {mv} mV{more} not used among potentials below 0: was the sign lost? write -{mv}, or {CONFIRM}"
    ))
}

/// Refuses rows that do not say where they were measured while others of the table do: where cells
/// were merged, the first alone keeps what is written in them.
pub(super) fn place_lost(table: &Table, rows: &[Row]) -> Option<Problem> {
    if table.survey.confirmed || matches!(table.holds, Holds::Gauges | Holds::Channels) {
        return None;
    }
    let places = [Column::Along, Column::Height, Column::Angle, Column::Face];
    let given: Vec<Column> = places.into_iter().filter(|column| table.has(*column)).collect();
    let is_placed = |row: &&Row| given.iter().any(|column| row.text(*column).is_some());
    let first = rows.iter().find(|row| !is_placed(row))?;
    let column = given.iter().find(|column| rows.iter().any(|row| row.text(**column).is_some()))?;
    let message = format!(
        "is empty, and other rows have it: were its cells merged? write where it was measured in every row, or {CONFIRM}: then it counts for the whole member"
    );
    Some(first.wrong(*column, "NO_PLACE", message))
}

/// What of a table is odd, and used.
pub(super) fn doubt_rows(table: &Table, rows: &[Row], out: &Rows) -> Vec<String> {
    let values = |kind: &str| -> Vec<f64> {
        let of_kind = out.records.iter().filter(|record| record.what.shows.kind() == kind);
        of_kind
            .filter_map(|record| match record.what.shows {
                Finding::Cover { mm, .. } | Finding::Carbonation { mm, .. } => Some(mm),
                _ => None,
            })
            .collect()
    };
    let profiles = out.records.iter().filter_map(|record| match &record.what.shows {
        Finding::Chloride { depths_mm, percent_of_cement, percent_of_concrete, .. } => {
            doubt_profile(depths_mm, percent_of_cement, percent_of_concrete)
        }
        _ => None,
    });
    let warm = out.readings.iter().filter_map(|r| r.what.temperature_c).reduce(f64::max);
    let said = [
        doubt_covers(&values("cover")),
        doubt_carbonation(&values("carbonation")),
        profiles.into_iter().next(),
        warm.filter(|celsius| *celsius > WARM).map(|celsius| {
            format!(
                "temperature_c reaches {celsius} °C: in °F? name the column \"temperature [°F]\", or confirm it"
            )
        }),
        doubt_repeats(table, rows),
    ];
    said.into_iter().flatten().map(|doubt| format!("{}: {doubt}", table.file)).collect()
}

/// Concrete of a bridge is not warmer, °C.
const WARM: f64 = 55.0;
/// Covers of which none is more are doubted, mm: less than any code asks for.
const THIN: f64 = 6.0;

/// Covers in cm or inch.
pub(crate) fn doubt_covers(covers: &[f64]) -> Option<String> {
    let (sizes, mm) = smaller_than(THIN, "cover is", "covers are", covers)?;
    Some(format!(
        "{sizes}: in cm, {} mm, or in inches, {} mm? name the unit, \"cover [cm]\", or {CONFIRM}",
        short(10.0 * mm),
        short(25.4 * mm)
    ))
}

/// Depths in cm: most are below 10, and some have decimals that are not read on a ruler.
fn doubt_carbonation(depths: &[f64]) -> Option<String> {
    let (sizes, mm) =
        smaller_than(10.0, "depth of carbonation is", "depths of carbonation are", depths)?;
    let is_fine = |mm: &&f64| (mm.round() - **mm).abs() > 1e-9;
    (depths.iter().filter(is_fine).count() > 1).then(|| {
        format!(
            "{sizes}, and they have decimals: in cm, {} mm? name the unit, \"carbonation [cm]\", or {CONFIRM}",
            short(10.0 * mm)
        )
    })
}

/// What is said of lengths of which the middle one is smaller than a limit, mm, and the length to
/// show: the largest, or the middle one where the largest is no smaller than the limit.
fn smaller_than(limit: f64, one: &str, many: &str, lengths: &[f64]) -> Option<(String, f64)> {
    let middle = median(&mut lengths.to_vec()).filter(|middle| *middle < limit)?;
    let most = lengths.iter().copied().fold(middle, f64::max);
    Some(match most < limit {
        true => (format!("no {one} above {most} mm"), most),
        false => (format!("most {many} no more than {middle} mm"), middle),
    })
}

/// Least content at the surface of what chlorides have entered, % of cement; the usual analysis
/// finds no less than .01 % of concrete.
const LITTLE: f64 = 0.03;
/// Content that no analysis finds, % of cement.
const NOTHING: f64 = 0.005;
/// Samples above this depth alone are doubted, mm: dust of one or two drill steps.
const SHALLOW: f64 = 8.0;

/// A content as a fraction, or depths in cm.
pub(crate) fn doubt_profile(depths: &[f64], cement: &[f64], concrete: &[f64]) -> Option<String> {
    let percents = if cement.is_empty() { concrete } else { cement };
    // Of concrete it is a seventh of what it is of cement.
    let share = if cement.is_empty() { 1.0 / 7.0 } else { 1.0 };
    let most = percents.iter().copied().reduce(f64::max).filter(|most| *most > 0.0)?;
    let least = percents.iter().copied().reduce(f64::min).unwrap_or(most);
    let falls = percents.windows(2).all(|pair| pair[1] <= pair[0]) && most > 2.0 * least;
    if most < NOTHING * share || most < LITTLE * share && falls && percents.len() > 1 {
        return Some(format!(
            "no chloride is above {most} %: as a fraction, {} %? give per cent, or {CONFIRM}",
            short(100.0 * most)
        ));
    }
    let deepest = depths.iter().copied().reduce(f64::max)?;
    (depths.len() > 1 && deepest < SHALLOW).then(|| {
        format!(
            "no sample is deeper than {deepest} mm: in cm, {} mm, or in inches, {} mm? name the unit, \"depth [cm]\", or {CONFIRM}",
            short(10.0 * deepest),
            short(25.4 * deepest)
        )
    })
}

fn short(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

/// Rows that repeat others in every cell, and say where.
fn doubt_repeats(table: &Table, rows: &[Row]) -> Option<String> {
    let is_placed = table.has(Column::Along) || table.has(Column::Height);
    let is_profile = matches!(table.holds, Holds::Profiles { .. } | Holds::Grid { .. });
    if !is_placed && !table.has(Column::Date) || is_profile {
        return None;
    }
    let mut first: HashMap<Vec<&str>, usize> = HashMap::with_capacity(rows.len());
    let (mut count, mut example) = (0, None);
    for row in rows {
        let line = *first.entry(row.cells.iter().collect()).or_insert(row.line);
        if line != row.line {
            count += 1;
            example = example.or(Some((row.line, line)));
        }
    }
    // Numbers without decimals are often alike at one place; nothing is read twice in one minute.
    let has_time = |line: usize| {
        let row = rows.iter().find(|row| row.line == line);
        row.is_some_and(|row| row.cells.iter().any(|cell| cell.contains(':')))
    };
    let often = 3 * count >= rows.len();
    let (line, before) = example.filter(|(line, _)| often || has_time(*line))?;
    Some(format!(
        "line {line} repeats line {before} in every cell, {count} rows in all: each counts; take out what was measured once, or {CONFIRM}"
    ))
}
