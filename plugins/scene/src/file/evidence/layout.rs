//! Where the parts of a table's text are: what stands above its header, the header, rows of units
//! below it. What is no row is blanked, so that lines keep their numbers.

use intrados_stage::sheet;

use super::table::{is_deciding, is_grid_head, is_known};
use crate::problem::Problem;

/// How far down a header is looked for, lines.
const DEEPEST: usize = 100;
/// Words that loggers write below a header, beside units.
const BELOW: [&str; 9] = ["smp", "avg", "max", "min", "std", "tot", "-", "--", "rn"];

/// A table's text, laid out.
#[derive(Debug)]
pub(super) struct Layout {
    /// Lines that end in `\n`; the first that is not empty is the header.
    pub(super) text: String,
    /// Line of the header, from 1.
    pub(super) header: usize,
    pub(super) separator: u8,
    /// What the cells of the row of units say, where there is one.
    pub(super) units: Vec<String>,
    /// What was assumed, for people.
    pub(super) notes: Vec<String>,
}

/// Decodes a table and finds its header.
pub(super) fn lay_out(file: &str, bytes: &[u8]) -> Result<Layout, Problem> {
    let sheet =
        sheet::decode(bytes).map_err(|why| Problem::error(file, "NOT_TEXT", why.to_string()))?;
    let mut notes = Vec::new();
    if let Some(encoding) = sheet.assumed {
        notes.push(format!("{file}: is not UTF-8, and was read as {encoding}"));
    }
    let text = sheet.text.replace("\r\n", "\n").replace('\r', "\n");
    let mut lines: Vec<&str> = text.lines().collect();
    let mut named = None;
    if let Some(first) = lines.iter_mut().find(|line| !line.trim().is_empty()) {
        named = sheet::named_separator(first);
        if named.is_some() {
            *first = "";
        }
    }
    let comments: Vec<(usize, &str)> =
        lines.iter().copied().enumerate().filter(|(_, line)| line.starts_with('#')).collect();
    lines.iter_mut().filter(|line| line.starts_with('#')).for_each(|line| *line = "");
    let (header, separator) = find_header(&lines, named);
    notes.extend(rows_behind_marks(file, &comments, header, separator));
    let above = lines.iter().take(header).filter(|line| !line.trim().is_empty()).count();
    if above > 0 {
        let of =
            if above == 1 { "line above the header was" } else { "lines above the header were" };
        notes.push(format!("{file}: {above} {of} not read"));
    }
    lines.iter_mut().take(header).for_each(|line| *line = "");
    let units = take_units(&mut lines, header, separator);
    let mut text = lines.join("\n");
    text.push('\n');
    Ok(Layout { text, header: header + 1, separator, units, notes })
}

/// Says how many lines below the header are no rows since they begin with #, and could be some:
/// they have numbers behind what parts cells.
fn rows_behind_marks(
    file: &str,
    comments: &[(usize, &str)],
    header: usize,
    separator: u8,
) -> Option<String> {
    let has_numbers = |line: &str| {
        let is_number = |cell: &String| sheet::number(cell, sheet::own_mark(cell)).is_some();
        cells(line, separator).iter().skip(1).any(is_number)
    };
    let below = comments.iter().filter(|(line, text)| *line > header && has_numbers(text));
    let found: Vec<&(usize, &str)> = below.collect();
    let (line, text) = found.first()?;
    let text = crate::file::shorten(text);
    Some(match found.len() {
        1 => format!(
            "{file}:{}: {text} was not read: a line that begins with # is a remark",
            line + 1
        ),
        n => format!(
            "{file}: {n} lines were not read, the first line {}, {text}: what begins with # is a remark",
            line + 1
        ),
    })
}

/// Cells of one line.
fn cells(line: &str, separator: u8) -> Vec<String> {
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(separator)
        .has_headers(false)
        .trim(csv::Trim::All)
        .from_reader(line.as_bytes());
    let first = reader.records().next().and_then(Result::ok).unwrap_or_default();
    first.iter().map(|cell| cell.trim().to_owned()).collect()
}

/// Index of the header's line, and what parts its cells: the first line that names what was
/// measured, or two columns; else the first that begins with a date's or a place's name and goes
/// on with others; else the first that is not empty.
fn find_header(lines: &[&str], named: Option<u8>) -> (usize, u8) {
    let full = || {
        let numbered = lines.iter().enumerate();
        numbered.filter(|(_, line)| !line.trim().is_empty()).take(DEEPEST)
    };
    let of_line = |line: &str| named.unwrap_or_else(|| sheet::separator(line));
    let with = |fits: &dyn Fn(&[String]) -> bool| {
        full().find_map(|(i, line)| {
            let separator = of_line(line);
            fits(&cells(line, separator)).then_some((i, separator))
        })
    };
    let by_name = |cells: &[String]| {
        let known = cells.iter().filter(|cell| is_known(cell)).count();
        cells.iter().any(|cell| is_deciding(cell)) || known > 1 || is_grid_head(cells)
    };
    let by_first = |cells: &[String]| {
        cells.len() > 1
            && cells.iter().any(|cell| is_known(cell))
            && !cells.iter().any(|cell| super::day::is_day(cell))
    };
    with(&by_name)
        .or_else(|| with(&by_first))
        .or_else(|| full().next().map(|(i, line)| (i, of_line(line))))
        .unwrap_or((0, named.unwrap_or(b',')))
}

/// Blanks the rows of units below a header, and gives the cells of the first.
fn take_units(lines: &mut [&str], header: usize, separator: u8) -> Vec<String> {
    let mut units = Vec::new();
    for line in lines.iter_mut().skip(header + 1).take(3) {
        let row = cells(line, separator);
        let is_unit = |cell: &String| {
            let lower = cell.to_lowercase();
            cell.is_empty() || BELOW.contains(&lower.as_str()) || super::units::is_unit(cell)
        };
        if row.is_empty() || !row.iter().all(is_unit) || row.iter().all(String::is_empty) {
            break;
        }
        *line = "";
        let is_first = units.is_empty();
        if is_first {
            units = row;
        }
    }
    units
}
