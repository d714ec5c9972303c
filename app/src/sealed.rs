//! Files of our own that must be whole: a mark, format (u32), length of the content (u64), BLAKE3 of
//! the content, content (postcard; the version of the program first); integers little-endian.

use std::{io::Read, path::Path};

use intrados_stage::access;
use serde::{Serialize, de::DeserializeOwned};

use crate::{failure::Failure, output};

pub(crate) const HEADER: usize = 8 + 4 + 8 + 32;

/// What kind of file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mark {
    pub(crate) magic: [u8; 8],
    pub(crate) format: u32,
    /// Longest content that is read, bytes.
    pub(crate) most: u64,
    /// What is said of any other file.
    pub(crate) stranger: &'static str,
}

pub(crate) fn write(path: &Path, mark: Mark, content: &impl Serialize) -> Result<(), Failure> {
    let mut bytes = vec![0; HEADER];
    bytes = postcard::to_extend(content, bytes)
        .map_err(|e| Failure::Internal(format!("cannot store the work: {e}")))?;
    let (header, content) = bytes.split_at_mut(HEADER);
    let sum = blake3::hash(content);
    let fields: [&[u8]; 4] = [
        &mark.magic,
        &mark.format.to_le_bytes(),
        &(content.len() as u64).to_le_bytes(),
        sum.as_bytes(),
    ];
    header.copy_from_slice(&fields.concat());
    output::put(path, &bytes)
}

/// Its first field must be the version of the program that made it.
pub(crate) fn read<T: DeserializeOwned>(path: &Path, mark: Mark) -> Result<T, Failure> {
    let bad = |why: String| Failure::BadInput(format!("{}: {why}", path.display()));
    let (mut file, length) = access::open(path).map_err(|e| Failure::denied(path, &e))?;
    let mut header = Vec::with_capacity(HEADER);
    (&mut file)
        .take(HEADER as u64)
        .read_to_end(&mut header)
        .map_err(|e| Failure::no_input(path, &e))?;
    let expected = check_header(&header, mark).map_err(bad)?;
    if length != HEADER as u64 + expected {
        return Err(bad(format!(
            "has {length} bytes where its header says {}: it was cut or added to",
            HEADER as u64 + expected
        )));
    }
    let mut content = Vec::new();
    file.take(expected).read_to_end(&mut content).map_err(|e| Failure::no_input(path, &e))?;
    if header.get(20..) != Some(blake3::hash(&content).as_bytes()) {
        return Err(bad("is damaged: its checksum does not agree".into()));
    }
    // The version comes first, so that it can be read whatever the rest has become.
    let ours = env!("CARGO_PKG_VERSION");
    match postcard::take_from_bytes::<String>(&content) {
        Ok((theirs, _)) if theirs != ours => {
            return Err(bad(format!(
                "was made by version {theirs}, and this is {ours}: make it again with this version"
            )));
        }
        _ => {}
    }
    postcard::from_bytes(&content).map_err(|_| bad("is damaged: its content cannot be read".into()))
}

/// Length of the content.
fn check_header(header: &[u8], mark: Mark) -> Result<u64, String> {
    let number = |at: std::ops::Range<usize>| {
        header.get(at).map(|b| b.iter().rev().fold(0_u64, |n, &byte| n << 8 | u64::from(byte)))
    };
    if header.get(..8) != Some(&mark.magic) {
        return Err(mark.stranger.into());
    }
    let (Some(format), Some(length), HEADER) = (number(8..12), number(12..20), header.len()) else {
        return Err("is cut within its header".into());
    };
    if format != u64::from(mark.format) {
        return Err(format!(
            "has format {format}, and this version reads {}: make it again with this version",
            mark.format
        ));
    }
    if length > mark.most {
        return Err(format!("says that it has {length} bytes of content, more than any work has"));
    }
    Ok(length)
}
