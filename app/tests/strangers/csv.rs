//! Tables that people, spreadsheets and instruments write: what `attach` reads of each, what it
//! doubts, what it refuses.

use std::{fs, path::Path};

use super::{hostile, run, said};

/// What has to come of a table.
enum Outcome {
    /// Attached, and the list of what is known now holds this; nothing is doubted.
    Reads(&'static str),
    /// Attached, and this is said of it.
    Doubts(&'static str),
    /// Refused in a line that says this.
    Refuses(&'static str),
}

use Outcome::{Doubts, Reads, Refuses};

/// Attaches a table to a new column, in a project of its own.
fn attach(bytes: &[u8], name: &str, options: &[&str]) -> std::process::Output {
    attach_to(["column", "C1"], bytes, name, options)
}

fn attach_to(
    [kind, member]: [&str; 2],
    bytes: &[u8],
    name: &str,
    options: &[&str],
) -> std::process::Output {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.ron");
    let made = run(&["new", kind, scene.to_str().unwrap()]);
    assert!(made.status.success(), "{}", said(&made));
    let table = folder.path().join(name);
    fs::write(&table, bytes).unwrap();
    let project = folder.path().to_str().unwrap();
    let args = ["attach", project, member, table.to_str().unwrap()];
    run(&[&args[..], options].concat())
}

fn holds(bytes: &[u8], name: &str, options: &[&str], outcome: &Outcome) {
    came_to(attach(bytes, name, options), bytes, name, outcome);
}

fn came_to(output: std::process::Output, bytes: &[u8], name: &str, outcome: &Outcome) {
    let (ok, table, line) = (
        output.status.success(),
        String::from_utf8_lossy(&output.stdout).into_owned(),
        String::from_utf8_lossy(&output.stderr).into_owned(),
    );
    let right = match outcome {
        Reads(value) => ok && table.contains(value) && !line.contains("confirm"),
        Doubts(word) => ok && line.contains(word),
        Refuses(word) => !ok && line.contains(word),
    };
    assert!(right, "{name}: {}\n{table}\n{}", String::from_utf8_lossy(bytes), said(&output));
}

/// Tables of our own making, with what has to come of them.
#[test]
fn tables_as_they_are_written_are_read_doubted_or_refused() {
    for (text, outcome) in [
        ("along;velocity_m_s\n0,5;4.120\n", Reads("4120")),
        ("along,velocity_m_s\n0.5,\"4,120\"\n", Reads("4120")),
        ("along;velocity_m_s\n0,5;4'120,5\n", Reads("4120.5")),
        ("sep=;\nalong;mV\n0,5;-320\n", Reads("-320")),
        ("along,mV,date\n0.5,-320,03.05.2026\n", Reads("2026-05-03")),
        ("along,mV,date\n0.5,-320,05/03/2026\n0.6,-330,05/23/2026\n", Reads("2026-05-03")),
        ("along,mV,date\n0.5,-320,05/03/2026\n", Refuses("no row decides")),
        ("along,mV,date\n0.5,-320,46145\n", Doubts("46145 was read as 2026-05-03")),
        ("along,mV,date\n0.5,-320,2099-05-03\n", Refuses("a day to come")),
        ("Project;7\n\nalong;mV [CSE]\n0,5;-320\n", Doubts("1 line above the header")),
        ("along,mV\n-,mV\n0.5,-320\n", Reads("-320")),
        ("along,mV\n0.5,-320\n0.6,-9999\n", Doubts("-9999 not used")),
        ("along,mV\n0.5,-320\n0.6,1e30\n", Doubts("1e30 not used")),
        ("along,cover_mm\n0.5,35\n0.6,-99.9\n", Doubts("-99.9 not used")),
        ("along,mV\n0.5,320\n0.6,250\n", Refuses("was the sign lost")),
        ("along,cover_mm\n0.5,3.2\n0.6,2.8\n", Doubts("in cm, 32 mm")),
        ("along,cover [cm]\n0.5,3.2\n", Reads("32")),
        ("along,carbonation_mm\n0.5,2.3\n0.6,1.8\n", Doubts("in cm, 23 mm")),
        (
            "along,depth_mm,chloride_percent_cement\n0.5,5,.011\n0.5,15,.006\n0.5,25,.003\n",
            Doubts("as a fraction, 1.1 %"),
        ),
        (
            "along,depth_mm,chloride_percent_cement\n0.5,.5,1.1\n0.5,1.5,.6\n0.5,2.5,.3\n",
            Doubts("in cm, 25 mm"),
        ),
        ("-320,-310,-300\n-250,-240,-230\n", Refuses("such as height_m,0.25,0.50")),
        ("height_m,mV\n0.45,-320\n", Reads("0.15  ")),
        ("height_m,0.25,0.50\n0.5,35,40\n", Refuses("nothing says what the grid holds")),
        ("height_m,0.25\n0.5,-320\n", Doubts("read as half-cell potentials in mV")),
        ("along,cover_mm\n0.5,35\n,30\n", Refuses("were its cells merged")),
        // One odd reading hides none of the others.
        ("along,cover_mm\n0.5,3.2\n0.6,2.8\n0.7,30\n", Doubts("most covers are no more than 3.2")),
        ("along,mV\n0.5,320\n0.6,250\n0.7,-310\n", Refuses("2 of 3 of the table")),
        ("along,mV\n0.5,-320\n0.6,-250\n0.7,310\n", Doubts("310 mV not used")),
        ("along,mV\n0.5,-320\n0.6,-700\n0.7,-999\n", Doubts("-999 not used")),
        ("along,cover_mm\n0.5,35\n0.6,180\n0.7,40\n0.8,255\n", Doubts("255 not used")),
        ("along,carbonation_mm\n0.5,2.5\n0.6,1.5\n0.7,20\n", Doubts("in cm, 25 mm")),
        (
            "along,depth_mm,chloride_percent_cement\n0.5,.5,1.1\n0.5,1.5,.6\n0.5,6,.3\n",
            Doubts("in inches, 152.4 mm"),
        ),
        ("along,mV\n0.5,-320\n#2,-400\n", Doubts("begins with # is a remark")),
        ("# measured in May, 2 of 3\nalong,mV\n# dry\n0.5,-320\n", Reads("-320")),
        ("height_m,0.25,0.50\n0.5,-320,-310\n1.0,-250,-240\n", Reads("-240")),
    ] {
        holds(text.as_bytes(), "table.csv", &[], &outcome);
    }
}

/// What is usual is not doubted, from its least to its most.
#[test]
fn ordinary_tables_raise_no_doubt() {
    let row = |column: &str, values: &[&str]| -> String {
        let rows = values.iter().enumerate().map(|(n, v)| format!("0.{},{v}\n", n + 1));
        format!("along,{column}\n{}", rows.collect::<String>())
    };
    for text in [
        row("cover_mm", &["6", "8"]),
        row("cover_mm", &["35", "120"]),
        row("cover_mm", &["4", "30", "35"]),
        row("mV", &["-20", "-99.9", "30"]),
        row("mV", &["-150", "-255"]),
        row("velocity_m_s", &["4100", "3999"]),
        row("mV", &["-50", "-120"]),
        row("mV", &["-320", "-600"]),
        row("carbonation_mm", &["0", "2"]),
        row("carbonation_mm", &["12.5", "90"]),
        row("depth_mm,chloride_percent_cement", &["10,.01"]),
        row("depth_mm,chloride_percent_cement", &["10,5"]),
    ] {
        let output = attach(text.as_bytes(), "table.csv", &[]);
        let line = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && !line.contains("confirm"), "{text}{}", said(&output));
    }
}

/// What is confirmed counts.
#[test]
fn what_is_confirmed_is_used() {
    let text = b"along,mV\n0.5,120\n0.6,90\n";
    holds(text, "table.csv", &[], &Refuses("was the sign lost"));
    holds(text, "table.csv", &["--confirmed"], &Reads("120"));
}

#[test]
#[ignore = "with_data: reads INTRADOS_DATA/hostile"]
fn tables_of_strangers_with_data() {
    for (file, outcome) in [
        ("public/csv/plain.csv", Reads("-320")),
        ("public/csv/cr_only.csv", Reads("-320")),
        ("public/csv/ctrlz.csv", Reads("-320")),
        ("public/csv/nul_pad.csv", Reads("-320")),
        ("public/csv/nbsp.csv", Reads("4120")),
        ("public/csv/nbsp_header.csv", Reads("-320")),
        ("public/csv/thousands_de.csv", Reads("4120")),
        ("public/csv/thousands_de2.csv", Reads("4120.5")),
        ("public/csv/thousands_en.csv", Reads("4120")),
        ("public/csv/thousands_space.csv", Reads("4120")),
        ("public/csv/german.csv", Reads("-320.5")),
        ("public/csv/german_isodate.csv", Reads("-320.5")),
        ("public/csv/sep_line.csv", Reads("-320")),
        ("public/csv/units_row.csv", Reads("-320")),
        ("public/csv/utf16.csv", Reads("-320")),
        ("public/csv/hash_comment.csv", Reads("-320")),
        ("public/csv/header_spaces_units.csv", Reads("-320")),
        ("public/csv/quoted_newline.csv", Reads("-320")),
        ("public/csv/tabs.tsv", Reads("-320")),
        ("public/csv/tabs_decimalcomma.txt", Reads("-320.5")),
        ("public/csv/trailing_semicolons.csv", Reads("-320")),
        ("public/csv/unicode_minus.csv", Reads("-320")),
        ("public/csv/latin1.csv", Doubts("Windows-1252")),
        ("public/csv/preamble.csv", Doubts("2 lines above the header")),
        ("public/csv/excel_serial_date.csv", Doubts("2026-05-03")),
        ("public/csv/sentinel999.csv", Doubts("-999 not used")),
        ("public/csv/duplicate_rows.csv", Doubts("repeats line 2")),
        ("public/csv/comma_sep_decimal_comma.csv", Refuses("decimal comma")),
        ("public/csv/dash.csv", Refuses("is no number")),
        ("public/csv/na.csv", Refuses("is no number")),
        ("public/csv/nan.csv", Refuses("is no number")),
        ("public/csv/empty_cell.csv", Refuses("is empty")),
        ("public/csv/percent.csv", Refuses("is no number")),
        ("public/csv/mixed_sep.csv", Refuses("not known here")),
        ("public/csv/german_face.csv", Refuses("is no face")),
        ("public/csv/positive_mv.csv", Refuses("was the sign lost")),
        ("public/csv/us_date.csv", Refuses("no row decides")),
        ("public/csv/yymmdd.csv", Refuses("two digits")),
        ("newcomer/hc_pos.csv", Refuses("was the sign lost")),
        ("newcomer/cover_cm.csv", Doubts("in cm, 35 mm")),
        ("newcomer/chl_frac.csv", Doubts("as a fraction, 1.1 %")),
        ("newcomer/chl_wrong.csv", Doubts("in cm, 25 mm")),
    ] {
        let path = hostile(file);
        let name = Path::new(file).file_name().unwrap().to_str().unwrap();
        holds(&fs::read(&path).unwrap(), name, &[], &outcome);
    }
}

/// What gauges and loggers write, on a beam.
#[test]
#[ignore = "with_data: reads INTRADOS_DATA/hostile"]
fn gauges_of_strangers_with_data() {
    for (file, outcome) in [
        ("e_notation.csv", Reads("120 ± 2.4 µε")),
        ("fahrenheit.csv", Doubts("in °F?")),
        ("gauge_thousands_de.csv", Reads("1250 ± 25 µε")),
        ("monitor_duplicate_times.csv", Doubts("line 4 repeats line 2")),
        ("tz_midnight.csv", Reads("2 readings")),
        // Oldest first, however they stand.
        ("unsorted_dates.csv", Reads("2026-04-29")),
    ] {
        let bytes = fs::read(hostile("public/csv").join(file)).unwrap();
        let output = attach_to(["beam", "B1"], &bytes, file, &[]);
        came_to(output, &bytes, file, &outcome);
    }
}
