//! Numbers of a `.msh` file, whether they are words of text or bytes.

use super::super::{Fault, label, number, quote};

/// A place in the file.
pub(super) struct Source<'a> {
    bytes: &'a [u8],
    at: usize,
    line: u32,
    /// Sections hold bytes instead of words.
    binary: bool,
    /// The section we are in, for messages about bytes.
    section: String,
}

impl<'a> Source<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, line: 1, binary: false, section: String::new() }
    }

    /// The line, in text.
    pub(super) fn line(&self) -> Option<u32> {
        (!self.binary).then_some(self.line)
    }

    pub(super) fn fault(&self, reason: impl Into<String>) -> Fault {
        let reason = reason.into();
        if self.binary {
            Fault::whole(format!("byte {} in {}: {reason}", self.at, self.section))
        } else {
            Fault::at(self.line, reason)
        }
    }

    /// Bytes that are left.
    pub(super) fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The next word of text; it must be there.
    pub(super) fn word(&mut self) -> Result<&'a str, Fault> {
        while let Some(&b) = self.bytes.get(self.at) {
            if !b.is_ascii_whitespace() {
                break;
            }
            self.at += 1;
            self.line += u32::from(b == b'\n');
        }
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if end == 0 {
            return Err(self.fault("the file ends here: is it cut off?"));
        }
        let word = std::str::from_utf8(&rest[..end.min(4096)])
            .map_err(|_| self.fault("this is no text"))?;
        self.at += end;
        Ok(word)
    }

    /// The rest of the line as text.
    pub(super) fn rest_of_line(&mut self) -> Result<&'a str, Fault> {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
        let text =
            std::str::from_utf8(&rest[..end]).map_err(|_| self.fault("this is no UTF-8 text"))?;
        self.at += end;
        Ok(text.trim())
    }

    /// The next word must be this one.
    pub(super) fn expect(&mut self, wanted: &str) -> Result<(), Fault> {
        let word = self.word()?;
        if word == wanted {
            Ok(())
        } else {
            Err(self.fault(format!("{} stands here, but {wanted} must", quote(word))))
        }
    }

    /// The name of the next section, or none at the end of the file.
    pub(super) fn section(&mut self) -> Result<Option<&'a str>, Fault> {
        if self.bytes[self.at..].iter().all(u8::is_ascii_whitespace) {
            return Ok(None);
        }
        let word = self.word()?;
        if !word.starts_with('$') {
            return Err(
                self.fault(format!("a section like $Nodes must begin here, not {}", quote(word)))
            );
        }
        self.section = word.to_owned();
        Ok(Some(word))
    }

    /// Data of a binary section begin behind the end of the line.
    pub(super) fn begin_data(&mut self) {
        if !self.binary {
            return;
        }
        if self.bytes.get(self.at) == Some(&b'\r') {
            self.at += 1;
        }
        if self.bytes.get(self.at) == Some(&b'\n') {
            self.at += 1;
        }
    }

    /// Passes a section that nobody reads.
    pub(super) fn skip(&mut self, name: &str) -> Result<(), Fault> {
        let end = format!("$End{}", name.trim_start_matches('$'));
        let rest = &self.bytes[self.at..];
        let ends = |at: &usize| rest.get(at + end.len()).is_none_or(u8::is_ascii_whitespace);
        match rest
            .windows(end.len())
            .enumerate()
            .filter(|(_, w)| *w == end.as_bytes())
            .map(|(at, _)| at)
            .find(ends)
        {
            Some(found) => {
                self.line += rest[..found].iter().filter(|&&b| b == b'\n').count() as u32;
                self.at += found + end.len();
                Ok(())
            }
            None => Err(self.fault(format!("{} has no {end}: is the file cut off?", quote(name)))),
        }
    }

    /// From here on sections hold bytes; the format says how they are ordered by the number one.
    pub(super) fn begin_binary(&mut self) -> Result<(), Fault> {
        self.section = "$MeshFormat".into();
        self.binary = true;
        self.begin_data();
        match self.take::<4>()? {
            [1, 0, 0, 0] => Ok(()),
            [0, 0, 0, 1] => {
                Err(self.fault("the bytes are in big-endian order: save the file as text"))
            }
            _ => Err(self.fault("the mark of the byte order is damaged")),
        }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        match self.bytes[self.at..].first_chunk::<N>() {
            Some(&bytes) => {
                self.at += N;
                Ok(bytes)
            }
            None => Err(self.fault("the file ends here: is it cut off?")),
        }
    }

    /// A 4-byte integer.
    pub(super) fn int(&mut self) -> Result<i32, Fault> {
        if self.binary {
            return Ok(i32::from_le_bytes(self.take()?));
        }
        let word = self.word()?;
        word.parse().map_err(|_| self.fault(format!("{} is not a whole number", quote(word))))
    }

    /// A count of things of at least `least` bytes each (in text, two a number are certain).
    pub(super) fn count(&mut self, least: usize, most: usize) -> Result<usize, Fault> {
        let count = if self.binary {
            u64::from_le_bytes(self.take()?)
        } else {
            let word = self.word()?;
            word.parse().map_err(|_| self.fault(format!("{} is not a count", quote(word))))?
        };
        if count > most as u64 {
            return Err(self.fault(format!("{count} are too many: at most {most}")));
        }
        if count.saturating_mul(least as u64) > self.left() as u64 {
            return Err(self.fault(format!(
                "{count} are announced, but the file ends before: is it cut off?"
            )));
        }
        Ok(count as usize)
    }

    /// An 8-byte tag of a node or element.
    pub(super) fn tag(&mut self) -> Result<u32, Fault> {
        if self.binary {
            let tag = u64::from_le_bytes(self.take()?);
            return u32::try_from(tag)
                .ok()
                .filter(|&t| t > 0 && t < u32::MAX)
                .ok_or_else(|| self.fault(format!("{tag} is not a number of a node or element")));
        }
        let word = self.word()?;
        label(word).map_err(|e| self.fault(e))
    }

    /// A whole number of 8 bytes that is not used.
    pub(super) fn pass(&mut self, count: usize) -> Result<(), Fault> {
        for _ in 0..count {
            if self.binary {
                self.take::<8>()?;
            } else {
                self.word()?;
            }
        }
        Ok(())
    }

    /// A finite number.
    pub(super) fn double(&mut self) -> Result<f64, Fault> {
        if self.binary {
            let value = f64::from_le_bytes(self.take()?);
            return if value.is_finite() {
                Ok(value)
            } else {
                Err(self.fault("a number that is not finite"))
            };
        }
        let word = self.word()?;
        number(word).map_err(|e| self.fault(e))
    }
}
