//! Lines for people on a terminal.

use std::{borrow::Cow, fmt::Display, io::Write};

/// A line on stderr, if it can be written: a result must not be lost because nobody listens
/// (`eprintln!` panics then).
pub(crate) fn say(line: impl Display) {
    let _ = writeln!(std::io::stderr(), "{}", printable(&line.to_string()));
}

/// Where the log goes: stderr, without what steers a terminal. Its own colours stay; in messages it
/// escapes what begins like them itself.
pub(crate) struct LogWriter;

impl Write for LogWriter {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let text = String::from_utf8_lossy(bytes);
        let shown = |c: char| match c {
            '\u{1b}' => c.to_string(),
            c => printable(c.encode_utf8(&mut [0; 4])).into_owned(),
        };
        let text: String = text.chars().map(shown).collect();
        std::io::stderr().write_all(text.as_bytes())?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        std::io::stderr().flush()
    }
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

/// A text as a terminal may have it: what would steer the terminal, or turn the order of letters,
/// stands as its code, such as `\u{1b}`. Names come from files, and files from others.
pub(crate) fn printable(text: &str) -> Cow<'_, str> {
    escaped(text, |c| format!("\\u{{{:x}}}", c as u32))
}

/// The same for JSON, which escapes some of them itself: it says the same as before.
pub(crate) fn printable_json(text: &str) -> Cow<'_, str> {
    escaped(text, |c| format!("\\u{:04x}", c as u32))
}

fn escaped(text: &str, code: impl Fn(char) -> String) -> Cow<'_, str> {
    if !text.contains(steers) {
        return Cow::Borrowed(text);
    }
    let shown = |c: char| if steers(c) { code(c) } else { c.to_string() };
    text.chars().map(shown).collect::<String>().into()
}

/// Whether a character does something to a terminal: controls but line feed and tab, and marks that
/// turn the direction of writing.
fn steers(c: char) -> bool {
    let turns =
        matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    turns || c.is_control() && c != '\n' && c != '\t'
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_steers_a_terminal_is_printed() {
        let same = ["Stütze 1\n\tµε ± 3 ″ 桥 🌉", "", "شارع"];
        assert!(same.iter().all(|text| printable(text) == *text));
        assert_eq!(printable("a\u{1b}[2Jb\u{9b}1mc\rd\u{7}"), r"a\u{1b}[2Jb\u{9b}1mc\u{d}d\u{7}");
        assert_eq!(printable("a\u{202e}b\u{7f}\0"), r"a\u{202e}b\u{7f}\u{0}");
        let json = serde_json::to_string("a\u{1b}b\u{9b}\u{202e}\u{7f}").unwrap();
        let shown = printable_json(&json);
        assert!(!shown.contains(steers), "{shown}");
        let back: String = serde_json::from_str(&shown).unwrap();
        assert_eq!(back, "a\u{1b}b\u{9b}\u{202e}\u{7f}");
    }
}
