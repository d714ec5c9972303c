//! Comma-separated tables as RFC 4180 asks, whose cells no spreadsheet runs.

use std::borrow::Cow;

use ::csv::{Terminator, Writer, WriterBuilder};

/// A cell's text. What a spreadsheet would take for a formula (`=`, `+`, `-`, `@`, tab or carriage
/// return first, and no number) gets an apostrophe before it (OWASP, *CSV injection*): a name in a
/// scene is never run.
///
/// ```
/// use intrados_stage::csv::text;
/// assert_eq!(text("Pier 1"), "Pier 1");
/// assert_eq!(text("=2+3"), "'=2+3");
/// assert_eq!(text("-1.5e-3"), "-1.5e-3");
/// ```
#[must_use]
pub fn text(cell: &str) -> Cow<'_, str> {
    let is_formula =
        cell.starts_with(['=', '+', '-', '@', '\t', '\r']) && cell.parse::<f64>().is_err();
    if is_formula { Cow::Owned(format!("'{cell}")) } else { Cow::Borrowed(cell) }
}

/// A table in memory that grows by rows.
#[derive(Debug)]
pub struct Table(Writer<Vec<u8>>);

impl Table {
    /// With the names of its columns.
    #[must_use]
    pub fn new(header: &[&str]) -> Self {
        let mut table = Self(
            WriterBuilder::new()
                .terminator(Terminator::CRLF)
                .flexible(true)
                .from_writer(Vec::new()),
        );
        table.row(header);
        table
    }

    /// One row more.
    pub fn row<S: AsRef<str>>(&mut self, cells: &[S]) {
        // Memory takes every row, of whatever length.
        let _ = self.0.write_record(cells.iter().map(|cell| text(cell.as_ref()).into_owned()));
    }

    /// All of it.
    #[must_use]
    pub fn text(self) -> String {
        String::from_utf8(self.0.into_inner().unwrap_or_default()).unwrap_or_default()
    }
}

/// Six digits, nothing where there is no number.
#[must_use]
pub fn number(value: Option<f64>) -> String {
    match value {
        Some(v) if v != 0.0 && v.abs() < 1e-3 => format!("{v:.5e}"),
        Some(v) => {
            let digits = (5 - v.abs().max(1.0).log10().floor() as i32).max(0) as usize;
            let text = format!("{v:.digits$}");
            if text.contains('.') {
                text.trim_end_matches('0').trim_end_matches('.').to_owned()
            } else {
                text
            }
        }
        None => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_are_text_and_numbers_stay_numbers() {
        for formula in
            ["=cmd|' /C calc'!A0", "+1+1", "-2+3", "@SUM(A1)", "\t=1", "\r=1", "-inf cover"]
        {
            assert!(text(formula).starts_with('\''), "{formula:?}: {:?}", text(formula));
        }
        for plain in ["-1", "+2.5", "-1e-5", "Pier = 1", "", "–"] {
            assert_eq!(text(plain), plain);
        }
    }

    #[test]
    fn cells_and_numbers() {
        let mut table = Table::new(&["member", "d"]);
        table.row(&["=HYPERLINK(\"x\")".into(), number(Some(-0.5))]);
        table.row(&["=1,2", "a"]);
        assert_eq!(table.text(), "member,d\r\n\"'=HYPERLINK(\"\"x\"\")\",-0.5\r\n\"'=1,2\",a\r\n");
        let numbers =
            [Some(0.0), Some(0.125), Some(1234.5678), Some(1e-5), Some(2e6), None].map(number);
        assert_eq!(numbers, ["0", "0.125", "1234.57", "1.00000e-5", "2000000", ""]);
    }
}
