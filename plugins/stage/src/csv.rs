//! Cells of comma-separated tables, for every writer of such.

use std::borrow::Cow;

/// A cell as RFC 4180 asks, quoted where it must be. What a spreadsheet would take for a formula (`=`, `+`, `-`, `@`, tab or carriage return first, and no
/// number) gets an apostrophe before it (OWASP, *CSV injection*): a name in a scene is never run.
///
/// ```
/// use intrados_stage::csv::cell;
/// assert_eq!(cell("Pier 1"), "Pier 1");
/// assert_eq!(cell("beam \"A\", left"), "\"beam \"\"A\"\", left\"");
/// assert_eq!(cell("=2+3"), "'=2+3");
/// assert_eq!(cell("-1.5e-3"), "-1.5e-3");
/// ```
#[must_use]
pub fn cell(text: &str) -> Cow<'_, str> {
    let is_formula = text.starts_with(['=', '+', '-', '@', '\t', '\r']) && text.parse::<f64>().is_err();
    let said = if is_formula { Cow::Owned(format!("'{text}")) } else { Cow::Borrowed(text) };
    if said.contains([',', '"', '\r', '\n']) { Cow::Owned(format!("\"{}\"", said.replace('"', "\"\""))) } else { said }
}

/// A row: its cells with commas between.
#[must_use]
pub fn row<S: AsRef<str>>(cells: &[S]) -> String {
    cells.iter().map(|c| cell(c.as_ref())).collect::<Vec<_>>().join(",")
}

/// A table that grows by rows.
#[derive(Debug, Clone)]
pub struct Table(String);

impl Table {
    /// With the names of its columns.
    #[must_use]
    pub fn new(header: &[&str]) -> Self {
        let mut table = Self(String::new());
        table.row(&header.iter().map(|h| (*h).to_owned()).collect::<Vec<_>>());
        table
    }

    /// One row more.
    pub fn row(&mut self, cells: &[String]) {
        self.0.push_str(&row(cells));
        self.0.push_str("\r\n");
    }

    /// All of it.
    #[must_use]
    pub fn text(self) -> String {
        self.0
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
            if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
        }
        None => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_are_text_and_numbers_stay_numbers() {
        for formula in ["=cmd|' /C calc'!A0", "+1+1", "-2+3", "@SUM(A1)", "\t=1", "\r=1", "-inf cover"] {
            let read = cell(formula).trim_start_matches('"').to_owned();
            assert!(read.starts_with('\''), "{formula:?}: {read:?}");
        }
        for plain in ["-1", "+2.5", "-1e-5", "Pier = 1", "", "–"] {
            assert_eq!(cell(plain), plain);
        }
        assert_eq!(row(&["=1,2", "a"]), "\"'=1,2\",a");
    }

    #[test]
    fn cells_and_numbers() {
        let mut table = Table::new(&["member", "d"]);
        table.row(&["=HYPERLINK(\"x\")".into(), number(Some(-0.5))]);
        assert_eq!(table.text(), "member,d\r\n\"'=HYPERLINK(\"\"x\"\")\",-0.5\r\n");
        let numbers = [Some(0.0), Some(0.125), Some(1234.5678), Some(1e-5), Some(2e6), None].map(number);
        assert_eq!(numbers, ["0", "0.125", "1234.57", "1.00000e-5", "2000000", ""]);
    }
}
