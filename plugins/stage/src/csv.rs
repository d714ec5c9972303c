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
}
