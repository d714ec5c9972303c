//! Edits of evidence as text, so that comments and order stay as their author left them.

use std::ops::Range;

/// Where an entry of the lists is written.
#[derive(Debug, Clone, PartialEq)]
struct Entry {
    span: Range<usize>,
    /// The comma behind it.
    comma: Option<usize>,
}

/// A list of the whole file: `name: [entries]`.
#[derive(Debug, Clone, PartialEq)]
struct List {
    name: String,
    entries: Vec<Entry>,
    /// Where its bracket closes.
    close: usize,
}

/// What is found in the text of `(field: […], …)`.
#[derive(Debug, Default, PartialEq)]
struct Layout {
    lists: Vec<List>,
    /// Where the bracket about the whole closes.
    close: usize,
    /// End of the last word before that, and whether it is a comma.
    last: (usize, bool),
}

/// Adds an entry at the end of a list, which is made where there is none. None: the text is no RON.
pub(super) fn insert(text: &str, list: &str, entry: &str) -> Option<String> {
    insert_at(text, list, entry, 1)
}

/// [`insert`] where the list is so deep in the file.
fn insert_at(text: &str, list: &str, entry: &str, depth: usize) -> Option<String> {
    let layout = layout(text)?;
    let mut out = text.to_owned();
    if let Some(list) = layout.lists.iter().find(|l| l.name == list) {
        put_before(&mut out, list.close, depth, entry);
        if let Some(Entry { span, comma: None }) = list.entries.last() {
            out.insert(span.end, ',');
        }
    } else {
        let whole = format!("{list}: [\n        {entry},\n    ]");
        put_before(&mut out, layout.close, 0, &whole);
        if let (end, false) = layout.last {
            out.insert(end, ',');
        }
    }
    Some(out)
}

/// Adds an entry at the end of a list that is a field of an entry of another. None: the text is no
/// RON, or has no such entry.
pub(super) fn insert_within(
    text: &str,
    list: &str,
    index: usize,
    field: &str,
    entry: &str,
) -> Option<String> {
    let layout = layout(text)?;
    let span = layout.lists.iter().find(|l| l.name == list)?.entries.get(index)?.span.clone();
    let edited = insert_at(text.get(span.clone())?, field, entry, 2)?;
    let mut out = text.to_owned();
    out.replace_range(span, &edited);
    Some(out)
}

/// Takes out an entry of a list, and its line where nothing else is on it. None: the text is no
/// RON, or has no such entry.
pub(super) fn remove(text: &str, list: &str, index: usize) -> Option<String> {
    let layout = layout(text)?;
    let list = layout.lists.iter().find(|l| l.name == list)?;
    let Entry { span, comma } = list.entries.get(index)?;
    let (mut from, mut to) = (span.start, comma.map_or(span.end, |at| at + 1));
    let begin = text.get(..from)?.rfind('\n').map_or(0, |at| at + 1);
    let rest = text.get(to..)?;
    let end = rest.find('\n').map_or(rest.len(), |at| at + 1);
    if text.get(begin..from)?.trim().is_empty() && rest.get(..end)?.trim().is_empty() {
        (from, to) = (begin, to + end);
    }
    let mut out = text.to_owned();
    out.replace_range(from..to, "");
    Some(out)
}

/// Puts an entry, so deep in the file, on a line of its own before the bracket at `close`.
fn put_before(out: &mut String, close: usize, depth: usize, entry: &str) {
    let begin = out.get(..close).and_then(|t| t.rfind('\n')).map_or(0, |at| at + 1);
    let (indent, of_bracket) = ("    ".repeat(depth + 1), "    ".repeat(depth));
    // Where the bracket is the first on its line, the entry gets the line before.
    if begin > 0 && out.get(begin..close).is_some_and(|t| t.trim().is_empty()) {
        out.insert_str(begin, &format!("{indent}{entry},\n"));
    } else {
        out.insert_str(close, &format!("\n{indent}{entry},\n{of_bracket}"));
    }
}

/// Finds lists and their entries; comments and strings are passed over.
fn layout(text: &str) -> Option<Layout> {
    let bytes = text.as_bytes();
    let mut found = Layout::default();
    let (mut depth, mut at) = (0_usize, 0);
    let (mut word, mut list): (&str, Option<List>) = ("", None);
    // Where the entry that is being read begins and, so far, ends.
    let mut entry: Option<Range<usize>> = None;
    while at < bytes.len() {
        let end = token(text, at)?;
        let piece = text.get(at..end)?;
        let first = bytes[at];
        if first.is_ascii_whitespace() || piece.starts_with("//") || piece.starts_with("/*") {
            at = end;
            continue;
        }
        match first {
            b'(' | b'[' | b'{' => {
                if first == b'[' && depth == 1 {
                    list = Some(List { name: word.into(), entries: Vec::new(), close: 0 });
                } else if depth == 2 && list.is_some() {
                    entry.get_or_insert(at..end).end = end;
                }
                depth += 1;
            }
            b')' | b']' | b'}' => {
                depth = depth.checked_sub(1)?;
                match depth {
                    0 => found.close = at,
                    1 => {
                        if let Some(mut list) = list.take() {
                            list.entries
                                .extend(entry.take().map(|span| Entry { span, comma: None }));
                            found.lists.push(List { close: at, ..list });
                        }
                    }
                    _ => entry = entry.map(|span| span.start..end),
                }
            }
            b',' if depth == 2 => {
                if let (Some(list), Some(span)) = (&mut list, entry.take()) {
                    list.entries.push(Entry { span, comma: Some(at) });
                }
            }
            _ if depth == 1 && first != b':' => word = piece,
            _ if depth >= 2 && list.is_some() => entry.get_or_insert(at..end).end = end,
            _ => {}
        }
        if depth > 0 {
            found.last = (end, first == b',');
        }
        at = end;
    }
    (depth == 0 && found.close > 0).then_some(found)
}

/// The end of what begins at `at`: a comment, a string, a word, white space, or one character.
pub(super) fn token(text: &str, at: usize) -> Option<usize> {
    let rest = text.get(at..)?;
    let length = match rest.as_bytes() {
        [b'/', b'/', ..] => rest.find('\n').unwrap_or(rest.len()),
        [b'/', b'*', ..] => block_comment(rest)?,
        [b'"', ..] => quoted(rest, '"')?,
        [b'\'', ..] => quoted(rest, '\'')?,
        [b'r', b'"' | b'#', ..] => raw_string(rest)?,
        [b, ..] if b.is_ascii_whitespace() => {
            rest.find(|c: char| !c.is_ascii_whitespace()).unwrap_or(rest.len())
        }
        [b, ..] if is_of_word(char::from(*b)) => {
            rest.find(|c: char| !is_of_word(c)).unwrap_or(rest.len())
        }
        _ => rest.chars().next()?.len_utf8(),
    };
    Some(at + length)
}

fn is_of_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || "_.+-".contains(c)
}

/// Comments of blocks lie within each other in RON.
fn block_comment(text: &str) -> Option<usize> {
    let (mut depth, mut at) = (0, 0);
    loop {
        let rest = text.get(at..)?;
        let (open, close) = (rest.find("/*"), rest.find("*/")?);
        if open.is_some_and(|open| open < close) {
            depth += 1;
            at += open? + 2;
        } else {
            depth -= 1;
            at += close + 2;
        }
        if depth == 0 {
            return Some(at);
        }
    }
}

fn quoted(text: &str, quote: char) -> Option<usize> {
    let mut chars = text.char_indices().skip(1);
    while let Some((at, c)) = chars.next() {
        match c {
            '\\' => _ = chars.next(),
            _ if c == quote => return Some(at + 1),
            _ => {}
        }
    }
    None
}

fn raw_string(text: &str) -> Option<usize> {
    let hashes = text.get(1..)?.bytes().take_while(|b| *b == b'#').count();
    let begin = 2 + hashes;
    let end = format!("\"{}", "#".repeat(hashes));
    Some(begin + text.get(begin..)?.find(&end)? + end.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_is_added_and_taken_out_and_all_else_stays() {
        for (before, after) in [
            ("(a: [])", "(a: [\n        X(1),\n    ])"),
            ("(\n    a: [\n    ],\n)", "(\n    a: [\n        X(1),\n    ],\n)"),
            (
                "(\n    a: [\n        // \"]\n        B(\"]\"), // why\n    ], // end\n)",
                "(\n    a: [\n        // \"]\n        B(\"]\"), // why\n        X(1),\n    ], // end\n)",
            ),
            ("(a: [B /* ] /* */ */\n], b: 1)", "(a: [B, /* ] /* */ */\n        X(1),\n], b: 1)"),
        ] {
            assert_eq!(insert(before, "a", "X(1)").as_deref(), Some(after), "{before}");
        }
        // A list that is not there yet, with and without a comma before it.
        let made = "(\n    b: r#\"\"]\"#,\n    a: [\n        X(1),\n    ],\n)";
        assert_eq!(insert("(\n    b: r#\"\"]\"#,\n)", "a", "X(1)").as_deref(), Some(made));
        assert_eq!(insert("(\n    b: r#\"\"]\"#\n)", "a", "X(1)").as_deref(), Some(made));
        assert_eq!(
            insert("(b: 1)", "a", "X").as_deref(),
            Some("(b: 1,\n    a: [\n        X,\n    ],\n)")
        );

        let text = "(\n    a: [\n        // one\n        B(1, [2]),\n        C(\"\\\"]\"), // two\n        D\n    ],\n)";
        let without = |i| remove(text, "a", i).unwrap();
        assert!(!without(0).contains("B(1") && without(0).contains("// one\n        C("));
        assert!(!without(1).contains("C(") && without(1).contains("// two"));
        assert_eq!(without(2).lines().count(), text.lines().count() - 1);
        assert_eq!(remove(text, "a", 3), None);
        assert_eq!(remove(text, "b", 0), None);
    }

    #[test]
    fn an_entry_is_added_within_another() {
        let nested = insert_within("(a: [(b: [1])])", "a", 0, "b", "2");
        assert_eq!(nested.as_deref(), Some("(a: [(b: [1,\n            2,\n        ])])"));
        let text = "(a: [B, C(n: \"]\", d: [1 /* ] */])], // end\n)";
        let after = insert_within(text, "a", 1, "d", "2").unwrap();
        let plain: String = after.split_whitespace().collect();
        assert_eq!(plain, "(a:[B,C(n:\"]\",d:[1,/*]*/2,])],//end)");
        assert_eq!(insert_within(text, "a", 2, "d", "2"), None);
        assert_eq!(insert_within(text, "b", 0, "d", "2"), None);
    }

    #[test]
    fn what_is_no_ron_is_left_alone() {
        for text in ["", "(", ")", "(a: [)", "(a: \"", "/*", "(a: 'x", "(a: r#\"x\")"] {
            assert_eq!(insert(text, "a", "X"), None, "{text}");
        }
    }
}
