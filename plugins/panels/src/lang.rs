//! The language of the window.
//!
//! English stands in the code, where it is drawn: `tr!("{} of {}", done, all)`. What it is called
//! elsewhere stands in `assets/words/*.ron`, all languages beside each other. What a message lacks is said
//! in English. What the engines say is found again by its words ([`term`]); files are English
//! everywhere, so that they can be compared.
//!
//! Three languages that know one and many at most need no grammar: where that differs, the code has
//! two messages.

use std::{
    cell::Cell, collections::HashMap, fmt::Display, ops::RangeInclusive, str::FromStr,
    sync::OnceLock,
};

use egui::{DragValue, Slider, emath::Numeric};
use intrados_assets::WORDS;
use serde::{Deserialize, Serialize};

/// Those that are said by [`term`]: words, and sentences of the engines.
const TERMS: [&str; 2] = ["terms.ron", "told.ron"];

/// A language that the window speaks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Language {
    /// English, in which all is written first.
    #[default]
    English,
    /// German.
    German,
    /// Chinese, in simplified characters.
    Chinese,
}

impl Language {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::English, Self::German, Self::Chinese];

    /// What those who speak it call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::English => "English",
            Self::German => "Deutsch",
            Self::Chinese => "中文",
        }
    }

    /// The language of a tag as systems have it (`de-AT`, `zh_CN.UTF-8`); English where it is none
    /// of ours.
    ///
    /// ```
    /// use intrados_panels::Language;
    /// assert_eq!(Language::of("de-AT"), Language::German);
    /// assert_eq!(Language::of("fr"), Language::English);
    /// ```
    #[must_use]
    pub fn of(tag: &str) -> Self {
        match tag.split(['-', '_', '.']).next() {
            Some("de") => Self::German,
            Some("zh") => Self::Chinese,
            _ => Self::English,
        }
    }
}

thread_local! {
    /// What is drawn is drawn on one thread.
    static SPOKEN: Cell<Language> = const { Cell::new(Language::English) };
}

/// Speaks `language` on this thread, from now on.
pub(crate) fn speak(language: Language) {
    SPOKEN.set(language);
}

/// The language of this thread.
pub(crate) fn spoken() -> Language {
    SPOKEN.get()
}

/// `tr!("{} of {}", done, all)`: a message in the language of the window. `{}` stand for the values
/// in their order, `{0}` and so on by their place. A word that is two in other languages says which
/// after a bar, which nobody sees: `tr!("Light|theme")`.
macro_rules! tr {
    ($text:literal $(, $value:expr)* $(,)?) => {
        $crate::lang::say($text, &[$(&$value as &dyn std::fmt::Display),*])
    };
}

/// See [`tr!`].
pub(crate) fn say(text: &str, values: &[&dyn Display]) -> String {
    filled(translated(text), values)
}

/// A text that is known only when it is said: a state, a kind, a sentence of an engine. One with
/// values in it is found by the term that has `{}` for them, and they are terms again. As it is,
/// where it has no translation.
pub(crate) fn term(text: &str) -> String {
    found(text, str::to_owned)
}

/// A term that says what was measured or computed, with its numbers as the language writes them.
/// Not for what somebody is told to write into a file: there, numbers have a point.
pub(crate) fn measured(text: &str) -> String {
    found(text, numbers)
}

/// See [`term`]; what has no translation is said by `other`.
fn found(text: &str, other: fn(&str) -> String) -> String {
    let Some(column) = column() else { return text.to_owned() };
    if let Some(said) = words().get(text) {
        return said[column].clone();
    }
    let pattern = patterns().iter().find_map(|pattern| Some((pattern, values(pattern, text)?)));
    let Some((pattern, values)) = pattern else { return other(text) };
    // What stands in quotes is a name, or what somebody has typed.
    let is_quoted = pattern.split("{}").map(|before| before.ends_with('“'));
    let value = |(value, is_quoted): (&str, bool)| {
        if is_quoted { value.to_owned() } else { found(value, other) }
    };
    let values: Vec<String> = values.into_iter().zip(is_quoted).map(value).collect();
    let values: Vec<&dyn Display> = values.iter().map(|v| v as &dyn Display).collect();
    filled(translated(pattern), &values)
}

/// A text as code has it, with its numbers as the language writes them: words that are nothing but
/// a number. Dates, versions and names of files are none.
fn numbers(text: &str) -> String {
    let ends = |c: char| c.is_whitespace() || "()[]±×–…,;:%°".contains(c);
    let said = |piece: &str| {
        let word = piece.trim_end_matches(ends);
        let number = word.strip_suffix('.').unwrap_or(word);
        match number.parse::<f64>() {
            Ok(_) => local(number.to_owned()) + &piece[number.len()..],
            Err(_) => piece.to_owned(),
        }
    };
    text.split_inclusive(ends).map(said).collect()
}

/// What an engine says, several lines of it.
pub(crate) fn lines<'a>(texts: impl IntoIterator<Item = &'a String>) -> String {
    texts.into_iter().map(|text| term(text)).collect::<Vec<_>>().join("\n")
}

/// Terms with values in them, those that say most first.
fn patterns() -> &'static [String] {
    static PATTERNS: OnceLock<Vec<String>> = OnceLock::new();
    PATTERNS.get_or_init(|| {
        let terms = WORDS.iter().filter(|(file, _)| TERMS.contains(file));
        let terms = terms.flat_map(|(file, text)| parsed(file, text).into_keys());
        let mut patterns: Vec<String> = terms.filter(|term| term.contains("{}")).collect();
        patterns.sort_by_key(|p| (std::cmp::Reverse(p.len()), p.clone()));
        patterns
    })
}

/// What stands in `text` where `pattern` has `{}`; none: it is another text.
fn values<'a>(pattern: &str, text: &'a str) -> Option<Vec<&'a str>> {
    let (head, tail) = pattern.split_once("{}")?;
    let mut rest = text.strip_prefix(head)?;
    let mut values = Vec::new();
    let mut parts = tail.split("{}").peekable();
    while let Some(part) = parts.next() {
        let end = match parts.peek() {
            Some(_) => rest.find(part)?,
            None => rest.strip_suffix(part)?.len(),
        };
        let value = &rest[..end];
        // Nothing is no value, and the text itself would be sought for ever.
        if value.is_empty() || value.len() == text.len() {
            return None;
        }
        values.push(value);
        rest = &rest[end + part.len()..];
    }
    Some(values)
}

/// Which of the translations is spoken; none: English.
fn column() -> Option<usize> {
    match spoken() {
        Language::English => None,
        Language::German => Some(0),
        Language::Chinese => Some(1),
    }
}

fn translated(text: &str) -> &str {
    let said = column().and_then(|column| Some(words().get(text)?[column].as_str()));
    said.unwrap_or_else(|| text.split_once('|').map_or(text, |(english, _)| english))
}

fn words() -> &'static HashMap<String, [String; 2]> {
    static TABLE: OnceLock<HashMap<String, [String; 2]>> = OnceLock::new();
    TABLE.get_or_init(|| WORDS.iter().flat_map(|(file, text)| parsed(file, text)).collect())
}

fn parsed(file: &str, text: &str) -> HashMap<String, [String; 2]> {
    ron::from_str(text).unwrap_or_else(|error| {
        tracing::error!("assets/words/{file}: {error}");
        HashMap::new()
    })
}

fn filled(text: &str, values: &[&dyn Display]) -> String {
    let (mut said, mut rest, mut next) = (String::with_capacity(text.len() + 16), text, 0);
    while let Some((before, after)) = rest.split_once('{') {
        let Some((place, behind)) = after.split_once('}') else { break };
        let which = place.parse().unwrap_or(next);
        next += 1;
        said += before;
        if let Some(value) = values.get(which) {
            said += &value.to_string();
        }
        rest = behind;
    }
    said + rest
}

/// `x` with so many decimals, as the language writes them.
pub(crate) fn fixed(x: impl Into<f64>, decimals: usize) -> String {
    local(format!("{:.decimals$}", x.into()))
}

/// A number as code has it, as the language writes it.
pub(crate) fn local(number: String) -> String {
    match spoken() {
        Language::German => number.replace('.', ","),
        Language::English | Language::Chinese => number,
    }
}

/// A number as somebody types it, with a point or a comma.
pub(crate) fn typed<T: FromStr>(text: &str) -> Option<T> {
    let text: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    text.replace('−', "-").replace(',', ".").parse().ok()
}

/// A field for a number, shown and read as the language writes it.
pub(crate) fn drag<N: Numeric>(value: &mut N) -> DragValue<'_> {
    let shown = |x, decimals| local(egui::emath::format_with_decimals_in_range(x, decimals));
    DragValue::new(value).custom_formatter(shown).custom_parser(typed::<f64>)
}

/// A slider, shown and read as the language writes numbers.
pub(crate) fn slide<N: Numeric>(value: &mut N, range: RangeInclusive<N>) -> Slider<'_> {
    let shown = |x, decimals| local(egui::emath::format_with_decimals_in_range(x, decimals));
    Slider::new(value, range).custom_formatter(shown).custom_parser(typed::<f64>)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{
        collections::BTreeSet,
        path::{Path, PathBuf},
    };

    /// All sources of this crate.
    fn pages(folder: &Path, into: &mut Vec<PathBuf>) {
        for entry in folder.read_dir().unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                pages(&path, into);
            } else {
                into.push(path);
            }
        }
    }

    /// What a string of Rust says, from after its first quote.
    fn literal(code: &str) -> String {
        let (mut said, mut code) = (String::new(), code.chars().peekable());
        while let Some(c) = code.next() {
            match c {
                '"' => break,
                '\\' => match code.next() {
                    Some('n') => said.push('\n'),
                    Some('\n') => while code.next_if(|c| c.is_whitespace()).is_some() {},
                    Some(other) => said.push(other),
                    None => {}
                },
                _ => said.push(c),
            }
        }
        said
    }

    /// All that this crate says by `tr!`, outside of its tests.
    fn said() -> BTreeSet<String> {
        let mut all = Vec::new();
        pages(Path::new("src"), &mut all);
        let mut said = BTreeSet::new();
        for page in all.iter().filter(|p| !p.ends_with("lang.rs")) {
            let code = std::fs::read_to_string(page).unwrap();
            let code = code.split("#[cfg(test)]\nmod tests {").next().unwrap();
            let is_word = |at: usize| code[..at].ends_with(char::is_alphanumeric);
            for (at, _) in code.match_indices("tr!(").filter(|(at, _)| !is_word(*at)) {
                let call = code[at + 4..].trim_start();
                assert!(call.starts_with('"'), "{}: tr! of no literal: {call:.40}", page.display());
                said.insert(literal(&call[1..]));
            }
        }
        said
    }

    /// Which values a message shows: `{}` by their order.
    fn shown(text: &str) -> Vec<usize> {
        let places = text.split('{').skip(1).map(|rest| rest.split('}').next().unwrap());
        let mut shown: Vec<usize> =
            places.enumerate().map(|(i, place)| place.parse().unwrap_or(i)).collect();
        shown.sort_unstable();
        shown
    }

    #[test]
    fn every_message_is_said_in_every_language_and_none_for_nothing() {
        let said = said();
        let mut known = BTreeSet::new();
        for (file, text) in WORDS {
            let words: HashMap<String, [String; 2]> = ron::from_str(text).unwrap();
            for (english, others) in words {
                let message = english.split('|').next().unwrap();
                for other in others {
                    assert_eq!(shown(message), shown(&other), "{file}: {english:?}: {other:?}");
                    assert!(!other.is_empty(), "{file}: {english:?}");
                }
                let is_said = TERMS.contains(&file) || said.contains(&english);
                assert!(is_said, "{file}: nobody says {english:?}");
                assert!(known.insert(english.clone()), "{file}: {english:?} stands there twice");
            }
        }
        let missing: Vec<&String> = said.difference(&known).collect();
        assert!(missing.is_empty(), "without a translation: {missing:#?}");
    }

    #[test]
    fn what_an_engine_says_is_found_by_its_words() {
        let three = Some(vec!["3", "of ten"]);
        assert_eq!(values("slice {} is {} mm", "slice 3 is of ten mm"), three);
        assert_eq!(values("slice {}", "slices"), None);
        assert_eq!(values("{}", "a text that would be sought for ever"), None);
        speak(Language::German);
        let said = term("reading slice 3 of 10");
        assert_eq!(term("width: “wide” is no number"), "Breite: „wide“ ist keine Zahl");
        speak(Language::English);
        assert_eq!(said, "Schnittbild 3 von 10 wird ausgewertet");
        assert_eq!(term("a name | of another"), "a name | of another");
    }

    #[test]
    fn what_was_measured_has_numbers_as_the_language_writes_them() {
        speak(Language::German);
        assert_eq!(measured("0.4 ± 0.05 mm, along"), "0,4 ± 0,05 mm, längs");
        assert_eq!(measured("0.2 of 1.5 m² hollow"), "0,2 von 1,5 m² hohl");
        assert_eq!(measured("31.5 kN + 2.25 kN/m"), "31,5 kN + 2,25 kN/m");
        assert_eq!(numbers("(-1.5e-3 × 0.5) to 0.2."), "(-1,5e-3 × 0,5) to 0,2.");
        for name in ["wall_0.5.png", "2026-05-03, 7.3.4", "C30/37 and B2.1"] {
            assert_eq!(measured(name), name);
        }
        assert_eq!(term("0.2 m²"), "0.2 m²");
        speak(Language::Chinese);
        assert_eq!(measured("0.4 ± 0.05 mm, along"), "0.4 ± 0.05 mm，纵向");
        speak(Language::English);
        assert_eq!(measured("0.4 ± 0.05 mm, along"), "0.4 ± 0.05 mm, along");
    }

    #[test]
    fn values_go_where_a_language_wants_them() {
        assert_eq!(filled("{} of {}", &[&3, &"x"]), "3 of x");
        assert_eq!(filled("{1} 中的 {0}", &[&3, &"x"]), "x 中的 3");
        assert_eq!(filled("none", &[]), "none");
    }

    #[test]
    fn numbers_have_a_comma_in_german_and_are_read_with_either() {
        speak(Language::German);
        assert_eq!(fixed(0.25, 2), "0,25");
        speak(Language::English);
        assert_eq!(fixed(0.25, 2), "0.25");
        assert_eq!(
            (typed("0,25"), typed("−1.5"), typed::<f64>("x")),
            (Some(0.25), Some(-1.5), None)
        );
    }
}
