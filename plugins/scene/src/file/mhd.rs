//! Headers of MetaImages (`.mhd`) whose voxels lie in another file: which one, and both as one file.

use std::{
    io::{self, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use intrados_stage::access::{self, Access};

use super::slices::extension;

/// Longest header, bytes.
const LONGEST: u64 = 4 << 20;

/// A header, and the file of its voxels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct VoxelHeader {
    /// The lines before the last, without the size of a header.
    lines: Vec<String>,
    /// Bytes before the first voxel; `None`: all that is not voxels.
    skip: Option<u64>,
    /// Where the voxels are.
    pub(crate) data: PathBuf,
}

/// Whether a file is a header alone, by its name.
pub(crate) fn is_header(file: &Path) -> bool {
    extension(&file.to_string_lossy()).as_deref() == Some("mhd")
}

impl VoxelHeader {
    /// Reads a header whose voxels lie in one other file, beside it.
    pub(crate) fn read(file: &Path) -> Result<Self, String> {
        let bytes = access::read(file, LONGEST).map_err(|why| why.to_string())?;
        let text = String::from_utf8(bytes)
            .map_err(|_| "is no text: is it the header of a MetaImage?".to_owned())?;
        let (mut lines, mut skip) = (Vec::new(), Some(0));
        for line in text.lines() {
            let (key, value) = line.split_once('=').map_or(("", ""), |(k, v)| (k.trim(), v.trim()));
            match key {
                "HeaderSize" => skip = value.parse().ok(),
                "ElementDataFile" if value.starts_with("LIST") || value.contains('%') => {
                    return Err(
                        "has a file for each slice: attach those, or write them as one .mha".into(),
                    );
                }
                "ElementDataFile" if value.eq_ignore_ascii_case("LOCAL") => {
                    return Err("holds its voxels itself: call it .mha".into());
                }
                "ElementDataFile" => {
                    let data = file.parent().unwrap_or(Path::new("")).join(value);
                    return Ok(Self { lines, skip, data });
                }
                _ => lines.push(line.to_owned()),
            }
        }
        Err("has no ElementDataFile: is it the header of a MetaImage?".into())
    }

    /// Writes header and voxels as one file (`.mha`).
    pub(crate) fn write(&self, folder: &Path, out: &mut dyn Write) -> io::Result<()> {
        let denied =
            |why: access::Denied| io::Error::other(format!("{}: {why}", self.data.display()));
        let (mut from, length) = Access::default().open(folder, &self.data).map_err(denied)?;
        for line in &self.lines {
            writeln!(out, "{line}")?;
        }
        writeln!(out, "ElementDataFile = LOCAL")?;
        let skip = self.skip.unwrap_or_else(|| length.saturating_sub(self.bytes()));
        from.seek(SeekFrom::Start(skip))?;
        io::copy(&mut from.take(length), out).map(drop)
    }

    /// Bytes of all voxels.
    fn bytes(&self) -> u64 {
        let value = |name: &str| {
            let mut lines = self.lines.iter().filter_map(|line| line.split_once('='));
            lines.find(|(key, _)| key.trim() == name).map_or("", |(_, value)| value.trim())
        };
        let each = match value("ElementType").trim_start_matches("MET_").trim_start_matches('U') {
            "CHAR" => 1,
            "SHORT" => 2,
            "LONG_LONG" | "DOUBLE" => 8,
            _ => 4,
        };
        let sides = value("DimSize").split_whitespace().filter_map(|n| n.parse::<u64>().ok());
        sides.fold(each, u64::saturating_mul)
    }
}
