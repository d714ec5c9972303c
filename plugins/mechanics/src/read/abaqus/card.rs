//! Lines to cards: `*NAME, PARAMETER=VALUE` and the data lines under it.

use super::super::{Fault, number, quote};

/// The longest line, bytes.
const MAX_LINE: usize = 64 << 10;
/// Cards of a deck.
const MAX_CARDS: usize = 1 << 20;

/// One card.
pub(crate) struct Card<'a> {
    /// In capitals, words one space apart.
    pub(crate) name: String,
    /// Names in capitals; values as written, without quotes.
    parameters: Vec<(String, &'a str)>,
    pub(crate) line: u32,
    /// The text between this card and the next, and the number of its first line.
    body: &'a str,
    body_line: u32,
}

/// Splits a deck. Data before the first card are refused.
pub(crate) fn cards(text: &str) -> Result<Vec<Card<'_>>, Fault> {
    let mut cards: Vec<Card<'_>> = Vec::new();
    let mut lines = Lines { rest: text, line: 0 };
    // Where the body of the last card begins.
    let mut body_start = 0;
    while let Some((line, row, start)) = lines.next_row(text)? {
        let row = row.trim();
        if !row.starts_with('*') || row.starts_with("**") {
            if cards.is_empty() && !row.is_empty() && !row.starts_with("**") {
                return Err(Fault::at(
                    line,
                    format!("a deck begins with a card like *NODE, not with {}", quote(row)),
                ));
            }
            continue;
        }
        if let Some(last) = cards.last_mut() {
            last.body = &text[body_start..start];
        }
        if cards.len() == MAX_CARDS {
            return Err(Fault::at(line, format!("more than {MAX_CARDS} cards")));
        }
        let mut card = Card {
            name: String::new(),
            parameters: Vec::new(),
            line,
            body: "",
            body_line: line + 1,
        };
        let mut row = row;
        let mut fields = row[1..].split(',');
        card.name = words(fields.next().unwrap_or_default());
        loop {
            for field in fields.map(str::trim).filter(|f| !f.is_empty()) {
                let (name, value) = field.split_once('=').unwrap_or((field, ""));
                card.parameters.push((words(name), value.trim().trim_matches('"')));
            }
            // A card whose line ends in a comma goes on in the next.
            if !row.ends_with(',') {
                break;
            }
            let Some((_, next, _)) = lines.next_row(text)? else { break };
            row = next.trim();
            fields = row.split(',');
        }
        card.body_line = lines.line + 1;
        body_start = text.len() - lines.rest.len();
        cards.push(card);
    }
    if let Some(last) = cards.last_mut() {
        last.body = &text[body_start..];
    }
    Ok(cards)
}

struct Lines<'a> {
    rest: &'a str,
    line: u32,
}

impl<'a> Lines<'a> {
    /// The next line, its number from 1, and where it starts in `text`.
    fn next_row(&mut self, text: &str) -> Result<Option<(u32, &'a str, usize)>, Fault> {
        if self.rest.is_empty() {
            return Ok(None);
        }
        let start = text.len() - self.rest.len();
        let (row, rest) = self.rest.split_once('\n').unwrap_or((self.rest, ""));
        self.rest = rest;
        self.line += 1;
        if row.len() > MAX_LINE {
            return Err(Fault::at(
                self.line,
                format!("a line of {} bytes: at most {MAX_LINE}", row.len()),
            ));
        }
        Ok(Some((self.line, row, start)))
    }
}

/// Whether two names differ in spaces alone, which CalculiX leaves out.
fn alike(a: &str, b: &str) -> bool {
    let letters = |name| str::chars(name).filter(|c| *c != ' ');
    letters(a).eq(letters(b))
}

/// In capitals, words one space apart.
fn words(text: &str) -> String {
    let mut words = String::with_capacity(text.len());
    for word in text.split_whitespace() {
        if !words.is_empty() {
            words.push(' ');
        }
        words.extend(word.chars().map(|c| c.to_ascii_uppercase()));
    }
    words
}

impl<'a> Card<'a> {
    pub(crate) fn fault(&self, reason: impl Into<String>) -> Fault {
        Fault::at(self.line, reason)
    }

    pub(crate) fn is(&self, name: &str) -> bool {
        self.name == name
    }

    /// The value of a parameter (empty for a flag); none where it is not there.
    pub(crate) fn get(&self, name: &str) -> Option<&'a str> {
        self.parameters.iter().find(|p| alike(&p.0, name)).map(|p| p.1)
    }

    /// The value of a parameter in capitals; none where it is not there.
    pub(crate) fn word(&self, name: &str) -> Option<String> {
        self.get(name).map(words)
    }

    /// A name that must be there.
    pub(crate) fn need(&self, name: &str) -> Result<String, Fault> {
        match self.get(name) {
            Some(value) if !value.is_empty() => Ok(value.to_ascii_uppercase()),
            _ => Err(self.fault(format!("*{} needs {name}=…", self.name))),
        }
    }

    /// Refuses parameters other than these, and any of them twice.
    pub(crate) fn only(&self, allowed: &[&str]) -> Result<(), Fault> {
        for (i, (name, _)) in self.parameters.iter().enumerate() {
            if !allowed.iter().any(|a| alike(a, name)) {
                let allowed =
                    if allowed.is_empty() { "none".to_owned() } else { allowed.join(", ") };
                return Err(self.fault(format!(
                    "*{}: parameter {} is not supported; supported: {allowed}",
                    self.name,
                    quote(name)
                )));
            }
            if self.parameters[..i].iter().any(|p| alike(&p.0, name)) {
                return Err(self.fault(format!("*{}: parameter {name} is given twice", self.name)));
            }
        }
        Ok(())
    }

    /// Data lines with their numbers, without comments and empty lines.
    pub(crate) fn rows(&self) -> impl Iterator<Item = Row<'a>> + use<'a> {
        (self.body_line..)
            .zip(self.body.split('\n'))
            .map(|(line, text)| Row { line, text: text.trim() })
            .filter(|r| !r.text.is_empty() && !r.text.starts_with("**"))
    }

    /// The only data line; none where there is none.
    pub(crate) fn one_row(&self) -> Result<Option<Row<'a>>, Fault> {
        let mut rows = self.rows();
        let first = rows.next();
        match rows.next() {
            Some(second) => Err(Fault::at(
                second.line,
                format!(
                    "*{} has one line of data here; tables over temperature or fields are not supported",
                    self.name
                ),
            )),
            None => Ok(first),
        }
    }

    /// Refuses data lines.
    pub(crate) fn no_rows(&self) -> Result<(), Fault> {
        match self.rows().next() {
            Some(row) => Err(row.fault(format!(
                "*{} has no data, but here is {}",
                self.name,
                quote(row.text)
            ))),
            None => Ok(()),
        }
    }
}

/// A data line.
#[derive(Clone, Copy)]
pub(crate) struct Row<'a> {
    pub(crate) line: u32,
    pub(crate) text: &'a str,
}

/// Number of the side that `P3` or `S3` (by `letter`) names.
pub(crate) fn side_number(side: &str, letter: &str) -> Option<u8> {
    side.to_ascii_uppercase().strip_prefix(letter)?.parse().ok()
}

impl<'a> Row<'a> {
    pub(crate) fn fault(&self, reason: impl Into<String>) -> Fault {
        Fault::at(self.line, reason)
    }

    /// Fields between commas; one comma at the end does not count.
    pub(crate) fn fields(&self) -> impl Iterator<Item = &'a str> + Clone + use<'a> {
        self.text.strip_suffix(',').unwrap_or(self.text).split(',').map(str::trim)
    }

    pub(crate) fn number(&self, word: &str) -> Result<f64, Fault> {
        number(word).map_err(|e| self.fault(e))
    }

    /// Exactly `N` fields.
    pub(crate) fn exactly<const N: usize>(&self, what: &str) -> Result<[&'a str; N], Fault> {
        let mut fields = self.fields();
        let mut found = [""; N];
        for slot in &mut found {
            *slot = fields
                .next()
                .ok_or_else(|| self.fault(format!("{N} fields are needed: {what}")))?;
        }
        if fields.next().is_some() {
            return Err(self.fault(format!("more than {N} fields; needed are: {what}")));
        }
        Ok(found)
    }

    /// All fields as numbers.
    pub(crate) fn numbers(
        &self,
        what: &str,
        count: std::ops::RangeInclusive<usize>,
    ) -> Result<Vec<f64>, Fault> {
        let numbers = self.fields().map(|f| self.number(f)).collect::<Result<Vec<_>, _>>()?;
        if count.contains(&numbers.len()) {
            Ok(numbers)
        } else {
            Err(self.fault(format!("{} numbers; needed are: {what}", numbers.len())))
        }
    }
}
