//! Results to files: VTU and PVD for ParaView ([`Grid`], [`Series`]), CSV for histories ([`csv`]), SVG
//! for curves ([`plot()`]).
//!
//! Every file is written beside its place and renamed, so that nobody ever sees half of it. Columns
//! and fields carry their unit in their name: `displacement_m`, `stress_pa`.

mod plot;
mod vtu;

use std::{
    io::{self, Write},
    path::Path,
};

use intrados_stage::{
    csv::text,
    file::{self, WriteError},
};
pub use plot::{Curve, plot};
pub use vtu::{Field, Grid, Series};

/// Writes a table: one column a name, one row a line, numbers as short as they can be without
/// losing a bit.
///
/// # Errors
/// The file cannot be written, or a row has another length than the head.
pub fn csv<R: AsRef<[f64]>>(path: &Path, columns: &[&str], rows: &[R]) -> Result<(), WriteError> {
    noted_csv(path, columns, rows, "")
}

/// The same with a last line `# …` of what its reader must know; empty: there is none.
pub(crate) fn noted_csv<R: AsRef<[f64]>>(
    path: &Path,
    columns: &[&str],
    rows: &[R],
    note: &str,
) -> Result<(), WriteError> {
    put(path, |out| {
        let mut table = csv::Writer::from_writer(&mut *out);
        table.write_record(columns.iter().map(|name| text(name).into_owned()))?;
        for (r, row) in rows.iter().map(AsRef::as_ref).enumerate() {
            if row.len() != columns.len() {
                return Err(invalid(format!(
                    "row {} has {} values, the head {}",
                    r + 1,
                    row.len(),
                    columns.len()
                )));
            }
            table.write_record(row.iter().map(|value| format!("{value:?}")))?;
        }
        table.flush()?;
        drop(table);
        if note.is_empty() { Ok(()) } else { writeln!(out, "# {note}") }
    })
}

fn invalid(what: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, what.into())
}

/// Writes a file, and makes its folder.
fn put(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), WriteError> {
    let failed = |source| WriteError { path: path.to_owned(), source };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(failed)?;
    file::put(path, |out| write(out)).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_come_back_to_the_last_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new/history.csv");
        let rows = [[0.1 + 0.2, -1e-300], [f64::NAN, 1.0 / 3.0]];
        noted_csv(&path, &["time_s", "force \"z\", N"], &rows, "it was stopped").unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("time_s,\"force \"\"z\"\", N\""));
        for row in rows {
            let back: Vec<f64> =
                lines.next().unwrap().split(',').map(|w| w.parse().unwrap()).collect();
            assert!(back.iter().zip(row).all(|(a, b)| a.to_bits() == b.to_bits()), "{back:?}");
        }
        assert_eq!((lines.next(), lines.next()), (Some("# it was stopped"), None));
    }

    #[test]
    fn a_table_that_is_none_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("history.csv");
        let error = csv(&path, &["a", "b"], &[vec![1.0, 2.0], vec![1.0]]).unwrap_err();
        assert!(
            error
                .to_string()
                .ends_with("history.csv: cannot write: row 2 has 1 values, the head 2"),
            "{error}"
        );
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
