//! The layout of a DICOM file (PS3.5, chapter 7): every element with its length, before a reader
//! asks for memory by what a header says. Nothing is deeper, longer or more than its file can hold.

use std::io::{self, Read, Seek, SeekFrom};

use intrados_stage::decode::jpeg;

/// Deepest sequence within a sequence. Enhanced images have three.
const DEEPEST: usize = 32;
/// Most bytes beside the pixels: headers of 16 384 frames have some ten megabytes.
const MOST_HEADER: u64 = 64 << 20;
/// Most segments of a frame that is packed by runs (PS3.5, G.5).
const MOST_SEGMENTS: u32 = 15;
/// Bytes of a packed frame in which its own header must lie.
const MOST_HEAD: u64 = 1 << 20;
/// What stands for an unknown length.
const UNDEFINED: u32 = u32::MAX;

/// How elements are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Syntax {
    is_implicit: bool,
    is_big: bool,
}

/// Where the pixels of a file lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PixelLayout {
    /// As they are: their first byte, how many there are, and whether the high byte comes first.
    Plain { from: u64, bytes: u64, is_big: bool },
    /// Frame by frame in a packing.
    Packed,
}

/// Something that ends, and where, if that is known.
struct Open {
    end: Option<u64>,
    is_implicit: bool,
}

/// Walks over a file of `length` bytes.
struct Walk<'a, F> {
    file: &'a mut F,
    at: u64,
    length: u64,
}

/// Checks all lengths of a file, and says where its pixels lie; `None` where it has none.
pub(super) fn check(
    file: &mut (impl Read + Seek),
    length: u64,
) -> Result<Option<PixelLayout>, String> {
    let mut walk = Walk { file, at: 132, length };
    let name = walk.transfer_syntax()?;
    let syntax = match name.as_str() {
        "1.2.840.10008.1.2" => Syntax { is_implicit: true, is_big: false },
        "1.2.840.10008.1.2.2" => Syntax { is_implicit: false, is_big: true },
        "1.2.840.10008.1.2.1.99" => return Err("is deflated: export it uncompressed".into()),
        _ => Syntax { is_implicit: false, is_big: false },
    };
    walk.elements(syntax, name == "1.2.840.10008.1.2.5")
}

impl<F: Read + Seek> Walk<'_, F> {
    fn go(&mut self, at: u64) -> Result<(), String> {
        let by = at as i64 - self.at as i64;
        self.at = at;
        // Within what is buffered this costs nothing.
        self.file.seek_relative(by).map_err(said)
    }

    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut bytes = [0; N];
        self.file.read_exact(&mut bytes).map_err(said)?;
        self.at += N as u64;
        Ok(bytes)
    }

    fn number(&mut self, is_big: bool) -> Result<u32, String> {
        let bytes = self.bytes()?;
        Ok(if is_big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    fn short(&mut self, is_big: bool) -> Result<u16, String> {
        let bytes = self.bytes()?;
        Ok(if is_big { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) })
    }

    /// The group of facts about the file, which is always explicit and has the low byte first.
    fn transfer_syntax(&mut self) -> Result<String, String> {
        self.file.seek(SeekFrom::Start(self.at)).map_err(said)?;
        let (plain, mut name) = (Syntax { is_implicit: false, is_big: false }, String::new());
        while self.at + 8 <= self.length {
            let start = self.at;
            let tag = [self.short(false)?, self.short(false)?];
            if tag[0] != 2 {
                self.go(start)?;
                break;
            }
            let (_, length) = self.head(plain)?;
            let left = self.length.saturating_sub(self.at);
            if u64::from(length) > left.min(1 << 20) {
                return Err(too_long(tag, length, left));
            }
            let next = self.at + u64::from(length);
            if tag == [0x0002, 0x0010] {
                let mut text = vec![0; length as usize];
                self.file.read_exact(&mut text).map_err(said)?;
                self.at = next;
                let text = String::from_utf8_lossy(&text).into_owned();
                name = text.trim_matches(|c: char| c == '\0' || c.is_whitespace()).to_owned();
            }
            self.go(next)?;
        }
        Ok(name)
    }

    /// Kind and length of an element whose tag was read.
    fn head(&mut self, syntax: Syntax) -> Result<([u8; 2], u32), String> {
        if syntax.is_implicit {
            return Ok((*b"--", self.number(syntax.is_big)?));
        }
        let kind: [u8; 2] = self.bytes()?;
        if !kind.iter().all(u8::is_ascii_uppercase) {
            return Err(format!("is damaged DICOM: no element begins at byte {}", self.at - 6));
        }
        // All others, also those that nobody knows yet, have long ones (PS3.5, 6.2.2).
        let short: [&[u8; 2]; 21] = [
            b"AE", b"AS", b"AT", b"CS", b"DA", b"DS", b"DT", b"FD", b"FL", b"IS", b"LO", b"LT",
            b"PN", b"SH", b"SL", b"SS", b"ST", b"TM", b"UI", b"UL", b"US",
        ];
        if !short.contains(&&kind) {
            self.short(syntax.is_big)?;
            return Ok((kind, self.number(syntax.is_big)?));
        }
        Ok((kind, u32::from(self.short(syntax.is_big)?)))
    }

    fn elements(&mut self, syntax: Syntax, is_runs: bool) -> Result<Option<PixelLayout>, String> {
        let mut open: Vec<Open> = Vec::new();
        let (mut pixels, mut pixel_bytes) = (None, 0);
        loop {
            while open.last().is_some_and(|o| o.end == Some(self.at)) {
                open.pop();
            }
            if open.last().and_then(|o| o.end).is_some_and(|end| self.at > end) {
                return Err("is damaged DICOM: an element reaches beyond its sequence".into());
            }
            if self.at.saturating_sub(pixel_bytes) > MOST_HEADER {
                return Err("has more than 64 MiB beside its pixels: export it anew".into());
            }
            let left = self.length.saturating_sub(self.at);
            if left < 8 {
                return match open.is_empty() {
                    true => Ok(pixels),
                    false => Err("is cut short: a sequence has no end; copy it again".into()),
                };
            }
            let is_implicit = open.last().map_or(syntax.is_implicit, |o| o.is_implicit);
            let tag = [self.short(syntax.is_big)?, self.short(syntax.is_big)?];
            if tag[0] == 0xfffe {
                let length = self.number(syntax.is_big)?;
                self.item(tag, length, &mut open)?;
                continue;
            }
            let (kind, length) = self.head(Syntax { is_implicit, ..syntax })?;
            let left = self.length.saturating_sub(self.at);
            if length != UNDEFINED && u64::from(length) > left {
                return Err(too_long(tag, length, left));
            }
            let (is_pixels, from) = (tag == [0x7fe0, 0x0010], self.at);
            let end = (length != UNDEFINED).then(|| from + u64::from(length));
            if is_pixels && end.is_none() {
                let is_ours = open.is_empty();
                self.fragments(is_runs && is_ours)?;
                if is_ours {
                    (pixels, pixel_bytes) = (Some(PixelLayout::Packed), self.at - from);
                }
            } else if let Some(end) = end.filter(|_| is_pixels) {
                if open.is_empty() {
                    let is_big = syntax.is_big;
                    pixel_bytes = u64::from(length);
                    pixels = Some(PixelLayout::Plain { from, bytes: pixel_bytes, is_big });
                }
                self.go(end)?;
            } else if end.is_none() || &kind == b"SQ" || is_implicit && self.begins_item(length)? {
                // What is unknown and without length is a sequence of implicit elements.
                opened(&mut open, Open { end, is_implicit: is_implicit || &kind == b"UN" })?;
            } else if let Some(end) = end {
                self.go(end)?;
            }
        }
    }

    /// An item of a sequence, or the end of one of them.
    fn item(&mut self, tag: [u16; 2], length: u32, open: &mut Vec<Open>) -> Result<(), String> {
        let Some(is_implicit) = open.last().map(|o| o.is_implicit) else {
            return Err("is damaged DICOM: an item lies outside of all sequences".into());
        };
        if tag[1] != 0xe000 {
            open.pop();
            return Ok(());
        }
        let left = self.length.saturating_sub(self.at);
        if length != UNDEFINED && u64::from(length) > left {
            return Err(too_long(tag, length, left));
        }
        let end = (length != UNDEFINED).then(|| self.at + u64::from(length));
        opened(open, Open { end, is_implicit })
    }

    /// Whether an item begins here: only a sequence holds one.
    fn begins_item(&mut self, length: u32) -> Result<bool, String> {
        if length < 8 {
            return Ok(false);
        }
        let from = self.at;
        let bytes: [u8; 4] = self.bytes()?;
        self.go(from)?;
        Ok(bytes == [0xfe, 0xff, 0x00, 0xe0])
    }

    /// Fragments of packed pixels, the first of which is a table of offsets.
    fn fragments(&mut self, is_runs: bool) -> Result<(), String> {
        let cut = || "is cut short: its packed pixels have no end; copy it again".to_owned();
        for number in 0.. {
            if self.length.saturating_sub(self.at) < 8 {
                return Err(cut());
            }
            let tag = [self.short(false)?, self.short(false)?];
            let length = self.number(false)?;
            if tag == [0xfffe, 0xe0dd] {
                break;
            }
            let left = self.length.saturating_sub(self.at);
            if tag != [0xfffe, 0xe000] || u64::from(length) > left {
                return Err(too_long(tag, length, left));
            }
            let end = self.at + u64::from(length);
            if is_runs && number > 0 && length > 0 {
                self.runs(length)?;
            }
            self.go(end)?;
        }
        Ok(())
    }

    /// The header of a frame that is packed by runs: how many segments, and where they begin.
    fn runs(&mut self, length: u32) -> Result<(), String> {
        let why = || "is damaged DICOM: a frame's table of runs does not fit it".to_owned();
        if length < 64 {
            return Err(why());
        }
        let count = self.number(false)?;
        if !(1..=MOST_SEGMENTS).contains(&count) {
            return Err(format!(
                "is damaged DICOM: a frame says that it has {count} segments; runs have 1 to {MOST_SEGMENTS}"
            ));
        }
        let mut before = 63;
        for _ in 0..count {
            let offset = self.number(false)?;
            if offset <= before || offset >= length {
                return Err(why());
            }
            before = offset;
        }
        Ok(())
    }
}

/// Refuses a packed JPEG frame that says another size than its file.
pub(super) fn check_jpeg(fragment: &[u8], size: [usize; 2]) -> Result<(), String> {
    let head = &fragment[..fragment.len().min(MOST_HEAD as usize)];
    let markers = if fragment.starts_with(&[0xff, 0xd8]) { jpeg::markers(head) } else { None };
    match markers {
        Some(m) if m.size.map(usize::from) != size => Err(format!(
            "its packed picture says {} × {} pixels and its header {} × {}",
            m.size[0], m.size[1], size[0], size[1]
        )),
        Some(_) if jpeg::markers(fragment).is_some_and(|m| !m.is_whole) => {
            Err("is cut short: the end of a packed picture is missing".into())
        }
        _ => Ok(()),
    }
}

fn opened(open: &mut Vec<Open>, one: Open) -> Result<(), String> {
    // A sequence and its item are a level together.
    if open.len() >= 2 * DEEPEST {
        return Err(format!("has sequences nested deeper than {DEEPEST}: export it anew"));
    }
    open.push(one);
    Ok(())
}

fn too_long([group, element]: [u16; 2], length: u32, left: u64) -> String {
    format!(
        "says that element ({group:04X},{element:04X}) is {length} bytes long and ends after {left}: it is damaged or cut short; copy it again"
    )
}

fn said(error: io::Error) -> String {
    format!("cannot be read: {error}")
}
