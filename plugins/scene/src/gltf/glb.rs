//! The GLB container: a 12-byte header, a JSON chunk, perhaps a binary chunk (glTF 2.0 §4).

use std::ops::Range;

use super::problem::{GltfProblem, Place, Severity, remedy::EXPORT};

const MAGIC: u32 = 0x4654_6C67;
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;

/// Where the chunks lie in the file.
#[derive(Debug, Default)]
pub(super) struct Chunks {
    /// The JSON text.
    pub json: Option<Range<usize>>,
    /// The binary chunk.
    pub bin: Option<Range<usize>>,
}

/// Whether the file claims to be a GLB: by its name or by its first bytes.
pub(super) fn is_glb(bytes: &[u8], name: &std::path::Path) -> bool {
    name.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb")) || bytes.starts_with(b"glTF")
}

/// Takes a GLB apart and notes every problem of the container.
pub(super) fn read(bytes: &[u8], problems: &mut Vec<GltfProblem>) -> Chunks {
    let mut chunks = Chunks::default();
    let mut note = |severity, offset: usize, code, message: String| {
        problems.push(GltfProblem {
            severity,
            place: Place::Byte(offset as u64),
            code,
            message,
            remedy: EXPORT,
        });
    };
    let mut error = |offset, code, message| note(Severity::Error, offset, code, message);
    let word = |offset: usize| {
        let bytes = bytes.get(offset..offset.checked_add(4)?)?;
        bytes.try_into().ok().map(u32::from_le_bytes)
    };
    let (Some(magic), Some(version), Some(length)) = (word(0), word(4), word(8)) else {
        error(bytes.len(), "GLB_HEADER", "the file ends within the 12-byte header of a GLB".into());
        return chunks;
    };
    if magic != MAGIC {
        error(0, "GLB_MAGIC", "this is no GLB: it does not begin with \"glTF\"".into());
        return chunks;
    }
    if version != 2 {
        error(
            4,
            "GLB_VERSION",
            format!("the GLB version is {version}, only version 2 is supported"),
        );
        return chunks;
    }
    let length = length as usize;
    if length <= 12 {
        error(
            8,
            "GLB_LENGTH",
            format!("the declared length, {length} bytes, leaves no room for a chunk"),
        );
    }
    let mut offset = 12;
    let mut chunk = 0;
    // Bytes behind the declared length are no part of the GLB; a declared length behind the end is
    // a mismatch, reported below.
    let end = length.min(bytes.len());
    while offset < end {
        let (Some(size), Some(kind)) = (word(offset), word(offset + 4)) else {
            error(
                bytes.len(),
                "GLB_CHUNK_HEADER",
                format!("the file ends within the header of chunk {chunk}"),
            );
            return chunks;
        };
        let (size, start) = (size as usize, offset + 8);
        let stop = start.saturating_add(size);
        if size % 4 != 0 {
            error(
                offset,
                "GLB_CHUNK_ALIGNMENT",
                format!("the length of chunk {chunk}, {size} bytes, is no multiple of 4"),
            );
        }
        if stop > length {
            error(
                offset,
                "GLB_CHUNK_TOO_LONG",
                format!(
                    "chunk {chunk} of {size} bytes does not fit the declared length of {length} bytes"
                ),
            );
        }
        if stop > bytes.len() {
            error(bytes.len(), "GLB_TRUNCATED", format!("the file ends within chunk {chunk}"));
            return chunks;
        }
        if chunk == 0 && kind != JSON {
            error(
                offset,
                "GLB_FIRST_CHUNK",
                format!("the first chunk has type {kind:#010x} where JSON must stand"),
            );
        }
        let taken = match kind {
            JSON if size == 0 => {
                error(offset, "GLB_EMPTY_JSON", "the JSON chunk is empty".into());
                &mut chunks.json
            }
            JSON => &mut chunks.json,
            BIN => {
                if chunk > 1 && chunks.bin.is_none() {
                    error(
                        offset,
                        "GLB_BIN_PLACE",
                        "the binary chunk must be the second chunk".into(),
                    );
                }
                &mut chunks.bin
            }
            _ => &mut None,
        };
        if taken.is_some() {
            error(
                offset,
                "GLB_DUPLICATE_CHUNK",
                format!("chunk {chunk} is a second one of type {kind:#010x}"),
            );
        } else {
            *taken = Some(start..stop);
        }
        offset = stop;
        chunk += 1;
    }
    if bytes.len() < length {
        error(
            bytes.len(),
            "GLB_LENGTH",
            format!("the file has {} bytes, its header declares {length}", bytes.len()),
        );
    } else if bytes.len() > length {
        note(
            Severity::Warning,
            length,
            "GLB_EXTRA_DATA",
            format!("{} bytes follow the declared end", bytes.len() - length),
        );
    }
    chunks
}
