//! Text tables as spreadsheets and instruments write them: their encoding, their separator, their
//! numbers. What a cell means alone, as `4.120` does not, its column decides.

use std::borrow::Cow;

/// The text of a table, and what of it was assumed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SheetText {
    /// UTF-8 without a byte order mark, without what pads its end.
    pub text: String,
    /// In which encoding it was read where it does not say so itself.
    pub assumed: Option<&'static str>,
}

/// Why bytes are no text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SheetError {
    /// A workbook or a document, compressed.
    #[error("is a workbook or a document, not text: save it as CSV in UTF-8")]
    Workbook,
    /// Half a character of UTF-16, or zero bytes among the text.
    #[error("is not UTF-8 text: save it as CSV in UTF-8 (a workbook is no CSV)")]
    NotText,
}

/// Decodes a table: UTF-8 and UTF-16 by their marks, UTF-16 without a mark by its zero bytes, else
/// UTF-8, else Windows-1252, of which Latin-1 is a part.
///
/// # Errors
/// [`SheetError`].
pub fn decode(bytes: &[u8]) -> Result<SheetText, SheetError> {
    if bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(&[0xd0, 0xcf, 0x11, 0xe0]) {
        return Err(SheetError::Workbook);
    }
    let (text, assumed) = match utf16(bytes) {
        Some((text, assumed)) => (text.ok_or(SheetError::NotText)?, assumed),
        None => match std::str::from_utf8(bytes) {
            Ok(text) => (text.to_owned(), None),
            Err(_) => {
                (bytes.iter().map(|b| windows_1252(*b)).collect(), Some("Windows-1252 (Latin-1)"))
            }
        },
    };
    // DOS ends a text with Ctrl-Z, loggers fill their blocks with zeros.
    let text = text.trim_start_matches('\u{feff}').trim_end_matches(['\0', '\u{1a}', '\n', '\r']);
    let is_control = |c: char| c.is_control() && !matches!(c, '\t' | '\n' | '\r' | '\u{c}');
    // The controls of Latin-1 are letters of nobody; those below are of machines.
    if text.contains(|c: char| is_control(c) && c < '\u{80}') {
        return Err(SheetError::NotText);
    }
    Ok(SheetText { text: format!("{text}\n"), assumed })
}

/// Text of UTF-16; `None` within: half a character. `None`: it is none.
fn utf16(bytes: &[u8]) -> Option<(Option<String>, Option<&'static str>)> {
    let zeros = |from: usize| bytes.iter().skip(from).step_by(2).filter(|b| **b == 0).count();
    let half = bytes.len() / 2;
    let (is_little, assumed) = match bytes {
        [0xff, 0xfe, ..] => (true, None),
        [0xfe, 0xff, ..] => (false, None),
        _ if half > 1 && 10 * zeros(1) > 7 * half && zeros(0) == 0 => (true, Some("UTF-16")),
        _ if half > 1 && 10 * zeros(0) > 7 * half && zeros(1) == 0 => (false, Some("UTF-16")),
        _ => return None,
    };
    let units = bytes.chunks_exact(2).filter_map(|pair| {
        let pair: [u8; 2] = pair.try_into().ok()?;
        Some(if is_little { u16::from_le_bytes(pair) } else { u16::from_be_bytes(pair) })
    });
    Some((char::decode_utf16(units).collect::<Result<String, _>>().ok(), assumed))
}

/// A character of Windows-1252.
fn windows_1252(byte: u8) -> char {
    const UPPER: [char; 32] = [
        '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž',
        '\u{8f}', '\u{90}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}',
        'ž', 'Ÿ',
    ];
    match byte {
        0x80..=0x9f => UPPER.get(usize::from(byte - 0x80)).copied().unwrap_or('\u{fffd}'),
        byte => char::from(byte),
    }
}

/// The separator that a line `sep=;` names, as spreadsheets put it first.
#[must_use]
pub fn named_separator(line: &str) -> Option<u8> {
    let line = line.trim_matches(['"', '\r', '\n', ' ']).to_ascii_lowercase();
    // Spreadsheets fill all lines up to as many cells as the widest has.
    match line.strip_prefix("sep=")?.as_bytes() {
        [] => Some(b'\t'),
        [one, rest @ ..] if rest.iter().all(|b| b == one) => Some(*one),
        _ => None,
    }
}

/// What parts the cells of a line: a semicolon or a tab where there is one outside quotes, else
/// commas.
#[must_use]
pub fn separator(line: &str) -> u8 {
    let outside: Vec<&str> = line.split('"').step_by(2).collect();
    let has = |b: &u8| outside.iter().any(|part| part.as_bytes().contains(b));
    [b';', b'\t'].into_iter().find(|b| has(b)).unwrap_or(b',')
}

/// The mark before a number's decimals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DecimalMark {
    /// `1.5`.
    Point,
    /// `1,5`.
    Comma,
}

/// What the cells of a column, or of a table, tell of how numbers are written in it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct NumberStyle {
    /// A cell has a decimal point for certain.
    point: bool,
    /// A cell has a decimal comma for certain.
    comma: bool,
    /// A cell has four digits or more and no mark among them: thousands are not parted here.
    plain_thousands: bool,
    /// A cell has no mark and fewer digits.
    plain: bool,
    /// A cell's only mark is this one, with three digits behind it.
    open_point: bool,
    open_comma: bool,
}

/// What a column's numbers are read with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StyleVerdict {
    /// So.
    Certain(DecimalMark),
    /// A point or a comma with three digits behind it may part thousands, and nothing decides.
    Open,
    /// Some cells have decimal points and others decimal commas.
    Mixed,
}

impl NumberStyle {
    /// Learns from a cell; one that holds no number tells nothing.
    pub fn learn(&mut self, cell: &str) {
        let cell = plain_number(cell);
        let mantissa = cell.split(['e', 'E']).next().unwrap_or_default();
        let digits = mantissa.trim_start_matches(['-', '+']);
        let is_number = digits.bytes().all(|b| b.is_ascii_digit() || b == b'.' || b == b',');
        if !is_number || !digits.bytes().any(|b| b.is_ascii_digit()) {
            return;
        }
        let marks: Vec<(usize, char)> = digits.match_indices(['.', ',']).map(at).collect();
        let count = |mark: char| marks.iter().filter(|(_, m)| *m == mark).count();
        let (last, is_open) = match marks[..] {
            [] if digits.len() > 3 => return self.plain_thousands = true,
            [] => return self.plain = true,
            [(place, mark)] => {
                let head = digits.get(..place).unwrap_or_default();
                let three = digits.len() - place - 1 == 3;
                (mark, three && matches!(head.len(), 1..=3) && !head.starts_with('0'))
            }
            [.., (_, mark)] if count(mark) == 1 => (mark, false),
            // Several of one mark part thousands: the other one is for decimals.
            [.., (_, '.')] => (',', false),
            [..] => ('.', false),
        };
        match (last, is_open) {
            ('.', true) => self.open_point = true,
            (_, true) => self.open_comma = true,
            ('.', false) => self.point = true,
            (_, false) => self.comma = true,
        }
    }

    /// Joins what two columns tell.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            point: self.point || other.point,
            comma: self.comma || other.comma,
            plain_thousands: self.plain_thousands || other.plain_thousands,
            plain: self.plain || other.plain,
            open_point: self.open_point || other.open_point,
            open_comma: self.open_comma || other.open_comma,
        }
    }

    /// How a column is read: by its own cells; where they do not decide, by those of the whole
    /// table; where these do not either, only a number that cannot be read in two ways is read.
    #[must_use]
    pub fn verdict(self, table: Self) -> StyleVerdict {
        use DecimalMark::{Comma, Point};
        let own = |style: Self| match (style.point, style.comma) {
            (true, false) => Some(Point),
            (false, true) => Some(Comma),
            _ => None,
        };
        match (own(self), own(table)) {
            _ if self.point && self.comma => StyleVerdict::Mixed,
            (Some(mark), _) => StyleVerdict::Certain(mark),
            // Thousands that are not parted in one cell are not in another.
            (None, _) if self.plain_thousands && self.open_point != self.open_comma => {
                StyleVerdict::Certain(if self.open_point { Point } else { Comma })
            }
            (None, Some(mark)) => StyleVerdict::Certain(mark),
            (None, None) => StyleVerdict::Open,
        }
    }

    /// Whether a cell may be read in two ways where nothing else decides.
    #[must_use]
    pub fn is_open(self) -> bool {
        self.open_point || self.open_comma
    }

    /// Whether cells look like thousands that are parted by the mark that is read as a decimal
    /// mark: three digits behind it in some, and none at all in others.
    #[must_use]
    pub fn seems_parted(self, mark: DecimalMark) -> bool {
        let (open, certain) = match mark {
            DecimalMark::Point => (self.open_point, self.point),
            DecimalMark::Comma => (self.open_comma, self.comma),
        };
        open && !certain && self.plain && !self.plain_thousands
    }
}

/// The decimal mark that a cell has by itself; a point where it has none.
#[must_use]
pub fn own_mark(cell: &str) -> DecimalMark {
    let mut style = NumberStyle::default();
    style.learn(cell);
    match style.verdict(style) {
        StyleVerdict::Certain(mark) => mark,
        StyleVerdict::Open | StyleVerdict::Mixed => DecimalMark::Point,
    }
}

fn at((place, mark): (usize, &str)) -> (usize, char) {
    (place, if mark == "." { '.' } else { ',' })
}

/// A number with a plain minus sign, and without the spaces and apostrophes that part thousands.
fn plain_number(cell: &str) -> Cow<'_, str> {
    if cell.is_ascii() && !cell.contains([' ', '\'']) {
        return Cow::Borrowed(cell);
    }
    let minus = |c: char| match c {
        '\u{2212}' | '\u{2013}' | '\u{fe63}' | '\u{ff0d}' => '-',
        // Spaces that do not break, thin ones, and the apostrophe of a Swiss thousand.
        '\u{a0}' | '\u{2009}' | '\u{202f}' | '\u{2007}' | '\u{2019}' | '\'' => ' ',
        other => other,
    };
    let text: String = cell.trim().chars().map(minus).collect();
    let text = text.replace("- ", "-");
    let parts: Vec<&str> = text.split(' ').collect();
    let is_group = |part: &&str| {
        let whole = part.split(['.', ',']).next().unwrap_or_default();
        whole.len() == 3 && whole.bytes().all(|b| b.is_ascii_digit())
    };
    let first = parts.first().map_or("", |part| part.trim_start_matches(['-', '+']));
    let is_first = matches!(first.len(), 1..=3) && first.bytes().all(|b| b.is_ascii_digit());
    if parts.len() > 1 && is_first && parts.iter().skip(1).all(is_group) {
        return Cow::Owned(parts.concat());
    }
    Cow::Owned(text)
}

/// A number as it was read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SheetNumber {
    /// Finite.
    pub value: f64,
    /// A single point or comma was taken for one that parts thousands.
    pub is_parted: bool,
}

/// Reads a cell with the decimal mark of its column; `None`: it holds no number.
#[must_use]
pub fn number(cell: &str, mark: DecimalMark) -> Option<SheetNumber> {
    let cell = plain_number(cell.trim());
    // What Rust takes for numbers, and no instrument means.
    if !cell.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '.' | ',')) {
        return None;
    }
    let (decimal, group) = match mark {
        DecimalMark::Point => ('.', ','),
        DecimalMark::Comma => (',', '.'),
    };
    let (mantissa, exponent) = cell.split_at(cell.find(['e', 'E']).unwrap_or(cell.len()));
    let (whole, decimals) = mantissa.split_at(mantissa.find(decimal).unwrap_or(mantissa.len()));
    if decimals.contains(group) {
        return None;
    }
    let groups: Vec<&str> = whole.trim_start_matches(['-', '+']).split(group).collect();
    let is_parted = groups.len() > 1;
    let first = groups.first().map_or(0, |group| group.len());
    let sound = groups.iter().skip(1).all(|group| group.len() == 3) && matches!(first, 1..=3);
    if is_parted && (!sound || groups.first().is_some_and(|group| group.starts_with('0'))) {
        return None;
    }
    let text = format!("{}{}{exponent}", whole.replace(group, ""), decimals.replace(decimal, "."));
    let value = text.parse::<f64>().ok().filter(|value| value.is_finite())?;
    Some(SheetNumber { value, is_parted: is_parted && decimals.is_empty() && groups.len() == 2 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn style(cells: &[&str]) -> NumberStyle {
        let mut style = NumberStyle::default();
        cells.iter().for_each(|cell| style.learn(cell));
        style
    }

    #[test]
    fn a_columns_own_cells_decide_what_its_marks_mean() {
        use DecimalMark::{Comma, Point};
        use StyleVerdict::{Certain, Mixed, Open};
        let nothing = NumberStyle::default();
        for (cells, verdict) in [
            (&["4.120", "3.980"][..], Open),
            (&["4,120"], Open),
            (&["4.120", "3.98"], Certain(Point)),
            (&["4.120", "0.980"], Certain(Point)),
            (&["4.120,5", "3.980"], Certain(Comma)),
            (&["1.234.567", "3.980"], Certain(Comma)),
            (&["1,234,567", "3,980"], Certain(Point)),
            (&["1.250", "1250"], Certain(Point)),
            (&["1.25", "1,25"], Mixed),
            (&["12", "front", ""], Open),
            (&["1,2E-04"], Certain(Comma)),
        ] {
            assert_eq!(style(cells).verdict(nothing), verdict, "{cells:?}");
        }
        // Where they do not, the table's other columns do.
        assert_eq!(style(&["4.120"]).verdict(style(&["0,2"])), Certain(Comma));
        assert_eq!(style(&["4.120"]).verdict(style(&["0.2"])), Certain(Point));
        assert!(style(&["1.250", "980"]).seems_parted(Point));
        assert!(!style(&["1.250", "9.81"]).seems_parted(Point));
    }

    #[test]
    fn numbers_are_read_as_they_are_written() {
        use DecimalMark::{Comma, Point};
        for (cell, mark, value) in [
            ("4.120", Comma, Some(4120.0)),
            ("4.120", Point, Some(4.12)),
            ("4,120", Point, Some(4120.0)),
            ("4.120,5", Comma, Some(4120.5)),
            ("4\u{a0}120", Comma, Some(4120.0)),
            ("4 120", Point, Some(4120.0)),
            ("4\u{202f}120,5", Comma, Some(4120.5)),
            ("4'120.5", Point, Some(4120.5)),
            ("\u{2212}320", Point, Some(-320.0)),
            ("\u{2013}320", Point, Some(-320.0)),
            ("- 320", Point, Some(-320.0)),
            ("1,2E-04", Comma, Some(1.2e-4)),
            (".5", Point, Some(0.5)),
            ("+7", Point, Some(7.0)),
            ("4.12", Comma, None),
            ("0.120", Comma, None),
            ("4,12", Point, None),
            ("1 2", Point, None),
            ("35 mm", Point, None),
            ("inf", Point, None),
            ("NaN", Point, None),
            ("1e999", Point, None),
            ("-", Point, None),
            ("2026-05-03", Point, None),
            ("1,2,3", Point, None),
            ("1.2.3", Point, None),
        ] {
            assert_eq!(number(cell, mark).map(|n| n.value), value, "{cell:?} {mark:?}");
        }
    }

    #[test]
    fn bytes_are_decoded_by_their_marks() {
        let both = |text: &str| -> [Vec<u8>; 2] {
            let units = || text.encode_utf16();
            [
                units().flat_map(u16::to_le_bytes).collect(),
                units().flat_map(u16::to_be_bytes).collect(),
            ]
        };
        let [little, big] = both("\u{feff}a;ü\r\n1;2\r\n");
        for bytes in
            [&little[..], &big, "\u{feff}a;ü\r\n1;2\r\n".as_bytes(), b"a;\xfc\r\n1;2\r\n\x1a\0"]
        {
            assert_eq!(decode(bytes).unwrap().text, "a;ü\r\n1;2\n");
        }
        let [little, big] = both("a;b\n1;2\n");
        assert_eq!([little, big].map(|b| decode(&b).unwrap().assumed), [Some("UTF-16"); 2]);
        assert_eq!(decode(b"PK\x03\x04xl"), Err(SheetError::Workbook));
        assert_eq!(decode(b"a,\0b\n"), Err(SheetError::NotText));
        assert_eq!(
            [";", "\t", "|", ""].map(|s| named_separator(&format!("sep={s}\r"))),
            [Some(b';'), Some(b'\t'), Some(b'|'), Some(b'\t')]
        );
        assert_eq!(["a,\"b;c\"", "a;b,c", "a\tb", "a"].map(separator), [b',', b';', b'\t', b',']);
    }
}
