//! Lines for people on a terminal.

use std::{fmt::Display, io::Write};

/// A line on stderr, if it can be written: a result must not be lost because nobody listens
/// (`eprintln!` panics then).
pub(crate) fn say(line: impl Display) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// A message without line breaks, whoever wrote it.
pub(crate) fn one_line(message: &str) -> String {
    message
        .split(['\n', '\r'])
        .map(str::trim)
        .filter(|part| !part.is_empty())
        .collect::<Vec<_>>()
        .join(" ")
}
