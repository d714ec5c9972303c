//! A text of RON as a tree of places, so that one value is written over and all else stays as its
//! author left it.

use std::ops::Range;

use super::edit::token;

/// So deep may brackets lie in each other; a scene needs less than 16.
const DEEPEST: usize = 64;

/// A step towards a value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Step {
    /// The field of this name.
    Field(&'static str),
    /// The entry of this number, of a list or of brackets without names.
    Entry(usize),
    /// What has this name before its brackets: it is written where nothing stands yet.
    Variant(&'static str),
}

/// A value, and what lies in it.
#[derive(Debug)]
struct Node {
    span: Range<usize>,
    inside: Option<Inside>,
}

/// What lies in brackets.
#[derive(Debug)]
struct Inside {
    name: Range<usize>,
    bracket: u8,
    items: Vec<Item>,
    close: usize,
}

/// A value between commas, with its name where it has one.
#[derive(Debug)]
struct Item {
    key: Option<Range<usize>>,
    node: Node,
    comma: Option<usize>,
}

impl Item {
    fn start(&self) -> usize {
        self.key.as_ref().map_or(self.node.span.start, |key| key.start)
    }
}

/// The text with another value at a place, which is made where there is none; none: the place is
/// taken out. None: the text is no RON, or has no such place.
pub(super) fn set(text: &str, path: &[Step], value: Option<&str>) -> Option<String> {
    let mut at = after_attributes(text)?;
    let root = node(text, &mut at, 0)?;
    let mut out = text.to_owned();
    match value {
        Some(value) => put(text, &root, path, value, &mut out)?,
        None => take_out(text, &root, path, &mut out)?,
    }
    Some(out)
}

fn put(text: &str, node: &Node, path: &[Step], value: &str, out: &mut String) -> Option<()> {
    let node = unwrapped(text, node);
    let Some((step, rest)) = path.split_first() else {
        out.replace_range(node.span.clone(), value);
        return Some(());
    };
    let Some(inside) = &node.inside else {
        // `None`, or a name without brackets.
        if text.get(node.span.clone())? != "None" {
            return None;
        }
        out.replace_range(node.span.clone(), &made(path, value)?);
        return Some(());
    };
    match step {
        Step::Variant(name) if text.get(inside.name.clone())? == *name => {
            return put(text, node, rest, value, out);
        }
        Step::Variant(_) => return None,
        Step::Field(_) | Step::Entry(_) => {}
    }
    match inside.item(text, step) {
        Some(item) => put(text, &item.node, rest, value, out),
        None => inside.add(text, step, &made(rest, value)?, out),
    }
}

fn take_out(text: &str, node: &Node, path: &[Step], out: &mut String) -> Option<()> {
    let node = unwrapped(text, node);
    let (step, rest) = path.split_first()?;
    let inside = node.inside.as_ref()?;
    if matches!(step, Step::Variant(_)) {
        return take_out(text, node, rest, out);
    }
    let item = inside.item(text, step)?;
    if rest.is_empty() {
        remove(text, inside, item, out)
    } else {
        take_out(text, &item.node, rest, out)
    }
}

/// What `Some(…)` holds: it may be left out.
fn unwrapped<'a>(text: &str, node: &'a Node) -> &'a Node {
    match &node.inside {
        Some(Inside { name, items, .. }) if text.get(name.clone()) == Some("Some") => {
            items.first().map_or(node, |item| unwrapped(text, &item.node))
        }
        _ => node,
    }
}

/// The text of what is not there yet.
fn made(path: &[Step], value: &str) -> Option<String> {
    let Some((step, rest)) = path.split_first() else { return Some(value.to_owned()) };
    let inner = made(rest, value)?;
    Some(match step {
        Step::Field(name) => format!("({name}: {inner})"),
        Step::Entry(0) => format!("[{inner}]"),
        Step::Entry(_) => return None,
        Step::Variant(name) => format!("{name}{inner}"),
    })
}

impl Inside {
    fn item(&self, text: &str, step: &Step) -> Option<&Item> {
        match step {
            Step::Field(name) => {
                let is = |item: &&Item| {
                    item.key.as_ref().and_then(|key| text.get(key.clone())) == Some(name)
                };
                self.items.iter().find(is)
            }
            Step::Entry(number) => self.items.get(*number),
            Step::Variant(_) => None,
        }
    }

    /// Adds an item before the bracket that closes.
    fn add(&self, text: &str, step: &Step, value: &str, out: &mut String) -> Option<()> {
        let item = match step {
            Step::Field(name) if self.bracket == b'(' => format!("{name}: {value}"),
            Step::Entry(number) if *number == self.items.len() && self.bracket == b'[' => {
                value.to_owned()
            }
            _ => return None,
        };
        let line = text.get(..self.close)?.rfind('\n').map_or(0, |at| at + 1);
        let indent = text.get(line..self.close)?;
        let is_alone = line > 0 && indent.trim().is_empty();
        let last = self.items.last();
        if is_alone {
            out.insert_str(line, &format!("{indent}    {item},\n"));
        } else {
            let gap = if last.is_some() { " " } else { "" };
            out.insert_str(self.close, &format!("{gap}{item}"));
        }
        // After what follows it, so that places before stay.
        if let Some(Item { node, comma: None, .. }) = last {
            out.insert(node.span.end, ',');
        }
        Some(())
    }
}

/// Takes an item out, and its line where nothing else is on it.
fn remove(text: &str, inside: &Inside, item: &Item, out: &mut String) -> Option<()> {
    let (mut from, mut to) = (item.start(), item.comma.map_or(item.node.span.end, |at| at + 1));
    let begin = text.get(..from)?.rfind('\n').map_or(0, |at| at + 1);
    let rest = text.get(to..)?;
    let end = rest.find('\n').map_or(rest.len(), |at| at + 1);
    if text.get(begin..from)?.trim().is_empty() && rest.get(..end)?.trim().is_empty() {
        (from, to) = (begin, to + end);
    } else if item.comma.is_none() {
        // The last of a line: the comma before it goes along.
        let before = inside.items.iter().filter_map(|i| i.comma).rfind(|at| *at < from);
        from = before.unwrap_or(from);
    } else {
        to += rest.len() - rest.trim_start_matches(' ').len();
    }
    out.replace_range(from..to, "");
    Some(())
}

/// Where the value begins: behind `#![enable(…)]`.
fn after_attributes(text: &str) -> Option<usize> {
    let mut at = if text.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
    loop {
        at = after_blank(text, at)?;
        if !text.get(at..)?.starts_with("#!") {
            return Some(at);
        }
        at += 2;
        node(text, &mut at, 0)?;
    }
}

/// Behind white space and comments.
fn after_blank(text: &str, mut at: usize) -> Option<usize> {
    while let Some(first) = text.as_bytes().get(at) {
        let rest = text.get(at..)?;
        if !first.is_ascii_whitespace() && !rest.starts_with("//") && !rest.starts_with("/*") {
            break;
        }
        at = token(text, at)?;
    }
    Some(at)
}

/// Reads a value.
fn node(text: &str, at: &mut usize, depth: usize) -> Option<Node> {
    if depth > DEEPEST {
        return None;
    }
    let start = after_blank(text, *at)?;
    let is_open = |at: usize| matches!(text.as_bytes().get(at), Some(b'(' | b'[' | b'{'));
    let mut name = start..start;
    if !is_open(start) {
        if matches!(text.as_bytes().get(start)?, b')' | b']' | b'}' | b',' | b':') {
            return None;
        }
        *at = token(text, start)?;
        name = start..*at;
        let open = after_blank(text, *at)?;
        if text.as_bytes().get(open) != Some(&b'(') {
            return Some(Node { span: name, inside: None });
        }
        *at = open;
    } else {
        *at = start;
    }
    let inside = inside(text, at, name, depth)?;
    Some(Node { span: start..*at, inside: Some(inside) })
}

/// Reads what lies in brackets, from the one that opens to behind the one that closes.
fn inside(text: &str, at: &mut usize, name: Range<usize>, depth: usize) -> Option<Inside> {
    let bracket = *text.as_bytes().get(*at)?;
    let end = match bracket {
        b'(' => b')',
        b'[' => b']',
        _ => b'}',
    };
    *at += 1;
    let mut items: Vec<Item> = Vec::new();
    loop {
        *at = after_blank(text, *at)?;
        if *text.as_bytes().get(*at)? == end {
            let close = *at;
            *at += 1;
            return Some(Inside { name, bracket, items, close });
        }
        if items.last().is_some_and(|item| item.comma.is_none()) {
            return None;
        }
        let mut value = node(text, at, depth + 1)?;
        let mut next = after_blank(text, *at)?;
        let mut key = None;
        if text.as_bytes().get(next) == Some(&b':') {
            key = Some(value.span);
            *at = next + 1;
            value = node(text, at, depth + 1)?;
            next = after_blank(text, *at)?;
        }
        let comma = (text.as_bytes().get(next) == Some(&b',')).then_some(next);
        if let Some(comma) = comma {
            *at = comma + 1;
        }
        items.push(Item { key, node: value, comma });
    }
}

#[cfg(test)]
mod tests {
    use super::{
        Step::{Entry, Field, Variant},
        *,
    };

    const TEXT: &str = r#"#![enable(implicit_some)]
// "a: [" is no list.
(
    a: [
        // the first
        (id: "x(", body: Column(h: 3, r: Some((c: 35, s: [1, 2]))), /* w: */ w: -1.5), // why
        (id: "y", body: Beam(
            l: 4, // long
            // more: 1,
        )),
    ],
    v: (0, -1600 /* down */, 0)
)"#;

    fn at(path: &[Step], value: Option<&str>) -> String {
        set(TEXT, path, value).unwrap()
    }

    #[test]
    fn one_value_is_another_and_nothing_else() {
        let entry = |n, rest: &[Step]| [&[Field("a"), Entry(n)], rest].concat();
        for (path, before, after) in [
            (entry(0, &[Field("w")]), "/* w: */ w: -1.5", "/* w: */ w: 7"),
            (entry(0, &[Field("body"), Field("h")]), "h: 3", "h: 7"),
            (entry(0, &[Field("body"), Field("r"), Field("c")]), "c: 35", "c: 7"),
            (entry(0, &[Field("body"), Field("r"), Field("s"), Entry(1)]), "[1, 2]", "[1, 7]"),
            (vec![Field("v"), Entry(1)], "-1600 /* down */", "7 /* down */"),
        ] {
            assert_eq!(at(&path, Some("7")), TEXT.replacen(before, after, 1), "{path:?}");
        }
    }

    #[test]
    fn what_is_missing_is_made_where_it_belongs() {
        let made = at(&[Field("a"), Entry(1), Field("e"), Field("class")], Some("\"XC3\""));
        assert_eq!(made, TEXT.replacen("        )),", "        ), e: (class: \"XC3\")),", 1));
        let made = at(&[Field("a"), Entry(1), Field("body"), Field("b"), Entry(0)], Some("2"));
        let lines = "            // more: 1,\n            b: [2],\n        )),";
        assert_eq!(made, TEXT.replacen("            // more: 1,\n        )),", lines, 1));
        let path = [Field("p"), Entry(0), Variant("Around"), Field("n")];
        assert!(at(&path, Some("8")).ends_with("0),\n    p: [Around(n: 8)],\n)"));
        let made = at(&[Field("a"), Entry(2), Field("id")], Some("\"z\""));
        assert_eq!(made, TEXT.replacen("    ],\n    v", "        (id: \"z\"),\n    ],\n    v", 1));
        assert_eq!(
            set("(a: None)", &[Field("a"), Field("b")], Some("1")).as_deref(),
            Some("(a: (b: 1))")
        );
        assert_eq!(set("()", &[Field("a")], Some("1")).as_deref(), Some("(a: 1)"));
    }

    #[test]
    fn what_is_taken_out_leaves_no_trace() {
        let own = |rest: &[Step]| [&[Field("a"), Entry(0)], rest].concat();
        let gone = at(&own(&[Field("w")]), None);
        assert_eq!(gone, TEXT.replacen(", /* w: */ w: -1.5", "", 1));
        let gone = at(&own(&[Field("id")]), None);
        assert_eq!(gone, TEXT.replacen("id: \"x(\", ", "", 1));
        let gone = at(&[Field("v")], None);
        assert_eq!(gone, TEXT.replacen("    v: (0, -1600 /* down */, 0)\n", "", 1));
        assert_eq!(set(TEXT, &[Field("q")], None), None);
    }

    #[test]
    fn what_is_no_ron_or_has_no_such_place_is_left_alone() {
        for text in ["", "(", ")", "(a: [)", "(a: \"", "/*", "(a 1 b)", "(a: 1 b: 2)", "(:)"] {
            assert_eq!(set(text, &[Field("z")], Some("1")), None, "{text}");
        }
        let deep = "(".repeat(1000);
        assert_eq!(set(&deep, &[Field("z")], Some("1")), None);
        assert_eq!(set("(a: 5)", &[Field("a"), Field("b")], Some("1")), None);
        assert_eq!(set("(a: [1])", &[Field("a"), Entry(3)], Some("1")), None);
    }
}
