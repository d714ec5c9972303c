//! Tables of bridges as registers and spreadsheets write them.

use std::{fs, path::Path};

use super::{hostile, run, said};

/// Plans a campaign over a table; whether it is planned, and what is said.
fn plan(table: &Path) -> (bool, String) {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("campaign");
    let output = run(&[
        "campaign",
        "new",
        dir.to_str().unwrap(),
        "--command",
        "predict",
        "--over",
        table.to_str().unwrap(),
    ]);
    (output.status.success(), said(&output))
}

fn holds(table: &Path, is_read: bool, word: &str) {
    let (ok, line) = plan(table);
    assert!(ok == is_read && line.contains(word), "{}: {line}", table.display());
}

#[test]
fn tables_of_bridges_are_read_doubted_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("bridges.csv");
    for (text, is_read, word) in [
        ("ID;YEAR;SPANS [m]\n1;1965;12,5\n2;1970;\"12,5;19\"\n", true, ""),
        ("ID,YEAR,SPANS [m]\n1,1965,\"12,5\"\n", false, "a span is"),
        ("ID,YEAR,SPANS [m]\n1,2190,12\n", true, "a year to come"),
        ("ID,YEAR,SPANS [m]\n1,9999,12\n", true, "know no year"),
        ("ID,YEAR,REHABILITATED,SPANS [m]\n1,1965,1964,12\n", true, "before the year of building"),
        ("ID,YEAR,YEAR BUILT,SPANS [m]\n1,1965,1964,12\n", false, "are for the same"),
    ] {
        fs::write(&table, text).unwrap();
        holds(&table, is_read, word);
    }
}

#[test]
#[ignore = "with_data: reads INTRADOS_DATA/hostile"]
fn tables_of_bridges_of_strangers_with_data() {
    for (file, is_read, word) in [
        ("plain.csv", true, ""),
        ("bom.csv", true, ""),
        ("decimal_comma_spans.csv", true, ""),
        ("empty_spans.csv", true, "nothing is computed"),
        ("excel_year_float.csv", true, ""),
        ("feet.csv", true, "in feet?"),
        ("german.csv", true, ""),
        ("id_leading_zero.csv", true, ""),
        ("latin1.csv", true, "Windows-1252"),
        ("nbi_latlon.csv", true, "degrees, minutes and seconds"),
        ("rehab_before.csv", true, "before the year of building"),
        // It may well lie there.
        ("swapped_latlon.csv", true, ""),
        ("twice_column.csv", false, "are for the same"),
        ("year_1900.csv", true, "know no year"),
        ("year_future.csv", true, "a year to come"),
        ("zero_latlon.csv", true, "no place of a bridge"),
    ] {
        holds(&hostile("public/campaign").join(file), is_read, word);
    }
}
