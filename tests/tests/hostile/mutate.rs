//! Damage: of any bytes, of the numbers in a text, and of the JSON in a GLB, whose container stays
//! whole so that what is behind its door is met.

use intrados_stage::random::Key;

/// Random choices of one case, one after the other.
pub(crate) struct Dice {
    key: Key,
    next: u32,
}

impl Dice {
    pub(crate) fn new(key: Key) -> Self {
        Self { key, next: 0 }
    }

    /// From 0 to one below `n`; 0 where there is nothing to choose from.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        self.next += 1;
        self.key.bits(self.next) as usize % n.max(1)
    }

    pub(crate) fn of<'a, T: ?Sized>(&mut self, list: &[&'a T]) -> &'a T {
        list[self.below(list.len())]
    }
}

/// What stands instead of a number or a word.
const WORDS: [&str; 40] = [
    "0",
    "-0.0",
    "1",
    "2",
    "3",
    "-1",
    "7",
    "255",
    "65535",
    "65536",
    "2147483647",
    "2147483648",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551615",
    "99999999999999999999",
    "1e-30",
    "1e-12",
    "1e-6",
    "0.001",
    "0.5",
    "1.5",
    "-2.5",
    "1e3",
    "1e6",
    "1e9",
    "1e18",
    "3e38",
    "1e39",
    "-1e30",
    "1e308",
    "1e999",
    "NaN",
    "inf",
    "\"\"",
    "[]",
    "{}",
    "null",
    "true",
];

/// Bytes that mean something in binary files: sizes at their limits, floats that are none.
const QUADS: [[u8; 4]; 14] = [
    [0; 4],
    [255; 4],
    [1, 0, 0, 0],
    [0, 0, 0, 1],
    [255, 255, 255, 127],
    [0, 0, 0, 128],
    [0, 0, 128, 127],
    [0, 0, 192, 127],
    [0, 0, 1, 0],
    [0, 64, 0, 0],
    f32::MAX.to_le_bytes(),
    f32::MIN_POSITIVE.to_le_bytes(),
    1e20_f32.to_le_bytes(),
    (-1e-20_f32).to_le_bytes(),
];

/// One to six hurts.
pub(crate) fn damage(seed: &[u8], dice: &mut Dice) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..=dice.below(6) {
        bytes = match split(&bytes) {
            Some((json, rest)) if dice.below(8) > 0 => joined(&text(json, dice), rest),
            _ if dice.below(3) > 0 && std::str::from_utf8(&bytes).is_ok() => text(&bytes, dice),
            _ if dice.below(2) > 0 && !lengths(&bytes).is_empty() => structured(bytes, dice),
            _ => binary(bytes, dice),
        };
    }
    bytes
}

/// The JSON of a GLB and what follows it.
fn split(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let size = bytes
        .starts_with(b"glTF")
        .then(|| bytes.get(12..16)?.try_into().ok().map(u32::from_le_bytes))??;
    Some((bytes.get(20..20 + size as usize)?, bytes.get(20 + size as usize..)?))
}

fn joined(json: &[u8], rest: &[u8]) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = 20 + json.len() + rest.len();
    let head = [2, length as u32, json.len() as u32, 0x4E4F_534A].map(u32::to_le_bytes);
    [b"glTF", head.as_flattened(), &json, rest].concat()
}

/// A number or word exchanged, a line taken out, doubled or moved, a piece repeated.
fn text(bytes: &[u8], dice: &mut Dice) -> Vec<u8> {
    match dice.below(10) {
        0 => lines(bytes, dice),
        1 => repeated(bytes, dice),
        _ => exchanged(bytes, dice),
    }
}

fn exchanged(bytes: &[u8], dice: &mut Dice) -> Vec<u8> {
    let numeric = |b: &u8| b.is_ascii_digit() || matches!(b, b'-' | b'+' | b'.' | b'e' | b'E');
    let mut tokens = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let length = bytes[at..].iter().take_while(|b| numeric(b)).count();
        if bytes[at..at + length].iter().any(u8::is_ascii_digit) {
            tokens.push(at..at + length);
        }
        at += length.max(1);
    }
    if tokens.is_empty() {
        return binary(bytes.to_vec(), dice);
    }
    let token = tokens[dice.below(tokens.len())].clone();
    // Another number of the same file is what an index is most easily mistaken for.
    let other = tokens[dice.below(tokens.len())].clone();
    let word = if dice.below(4) == 0 { &bytes[other] } else { dice.of(&WORDS).as_bytes() };
    [&bytes[..token.start], word, &bytes[token.end..]].concat()
}

fn lines(bytes: &[u8], dice: &mut Dice) -> Vec<u8> {
    let mut lines: Vec<&[u8]> = bytes.split(|&b| b == b'\n').collect();
    let (a, b) = (dice.below(lines.len()), dice.below(lines.len()));
    match dice.below(3) {
        0 => drop(lines.remove(a)),
        1 => lines.insert(b, lines[a]),
        _ => lines.swap(a, b),
    }
    lines.join(&b'\n')
}

/// A piece some thousand times: deep nesting, long lists.
fn repeated(bytes: &[u8], dice: &mut Dice) -> Vec<u8> {
    let from = dice.below(bytes.len());
    let piece = &bytes[from..(from + 1 + dice.below(12)).min(bytes.len())];
    [&bytes[..from], &piece.repeat(1 << dice.below(13)), &bytes[from..]].concat()
}

/// Where lengths, sizes and counts lie, and how many bytes each takes: in the segments of a JPEG, the
/// chunks of a PNG, the entries of a TIFF (or of EXIF within a JPEG), and the elements of a DICOM
/// file.
fn lengths(bytes: &[u8]) -> Vec<(usize, usize)> {
    let at = |i: usize, n: usize| bytes.get(i..i + n);
    let mut found = Vec::new();
    if bytes.starts_with(&[0xff, 0xd8]) {
        let mut i = 2;
        while let Some([0xff, code, high, low]) = at(i, 4).and_then(|b| b.as_array::<4>()) {
            found.push((i + 2, 2));
            // Sizes in a frame's header.
            if (0xc0..=0xc3).contains(code) {
                found.extend([(i + 5, 2), (i + 7, 2), (i + 9, 1)]);
            }
            i += 2 + (usize::from(*high) << 8 | usize::from(*low)).max(2);
        }
    } else if bytes.starts_with(b"\x89PNG") {
        let mut i = 8;
        while let Some(length) = at(i, 4).and_then(|b| b.as_array::<4>()) {
            found.extend([(i, 4), (i + 8, 4), (i + 12, 4), (i + 16, 1), (i + 17, 1)]);
            i = i.saturating_add(12 + u32::from_be_bytes(*length) as usize);
        }
    }
    let directory = bytes.windows(4).position(|w| w == b"II*\0");
    if let Some(base) = directory {
        let first = at(base + 4, 4).and_then(|b| b.as_array::<4>()).map(|b| u32::from_le_bytes(*b));
        let list = base.saturating_add(first.unwrap_or(0) as usize);
        found.extend([(base + 4, 4), (list, 2)]);
        let count = at(list, 2).map_or(0, |b| usize::from(b[0]) | usize::from(b[1]) << 8);
        for entry in (0..count.min(64)).map(|k| list + 2 + 12 * k) {
            found.extend([(entry, 2), (entry + 2, 2), (entry + 4, 4), (entry + 8, 4)]);
        }
    }
    if at(128, 4) == Some(b"DICM") {
        let kinds: [&[u8]; 6] = [b"OB", b"OW", b"SQ", b"UN", b"US", b"DS"];
        for i in (132..bytes.len().saturating_sub(8)).step_by(2) {
            match at(i, 2) {
                Some(kind) if kinds[..4].contains(&kind) => found.push((i + 4, 4)),
                Some(kind) if kinds[4..].contains(&kind) => {
                    found.extend([(i + 2, 2), (i + 4, 2)]);
                }
                Some([0xfe, 0xff]) => found.push((i + 4, 4)),
                _ => {}
            }
        }
    }
    found.retain(|(i, n)| i + n <= bytes.len());
    found
}

/// A length, a size or a count that lies: at its limits, doubled, halved, one more or less.
fn structured(mut bytes: Vec<u8>, dice: &mut Dice) -> Vec<u8> {
    let places = lengths(&bytes);
    let (at, n) = places[dice.below(places.len())];
    let field = &mut bytes[at..at + n];
    match dice.below(4) {
        0 => field.fill([0, 0xff, 0x7f, 1][dice.below(4)]),
        1 => field.copy_from_slice(&QUADS[dice.below(QUADS.len())][..n]),
        2 => field.rotate_left(1 % n),
        _ => {
            let byte = &mut field[dice.below(n)];
            *byte =
                [byte.wrapping_add(1), byte.wrapping_sub(1), *byte << 1, *byte >> 1][dice.below(4)];
        }
    }
    bytes
}

fn binary(mut bytes: Vec<u8>, dice: &mut Dice) -> Vec<u8> {
    let at = dice.below(bytes.len());
    match dice.below(5) {
        0 => bytes.truncate(at),
        1 => bytes.insert(at, dice.below(256) as u8),
        2 => bytes.iter_mut().skip(at).take(1).for_each(|b| *b ^= 1 << dice.below(8)),
        3 => bytes.iter_mut().skip(at).take(1).for_each(|b| *b = dice.below(256) as u8),
        _ => bytes
            .iter_mut()
            .skip(at / 4 * 4)
            .zip(QUADS[dice.below(QUADS.len())])
            .for_each(|(b, new)| *b = new),
    }
    bytes
}
