//! MetaImage: a text header (`.mhd`, or at the head of `.mha`) and raw voxels.
//!
//! Read as ITK documents it (<https://itk.org/Wiki/MetaIO/Documentation>): lengths in mm unless
//! `DistanceUnits` says otherwise, `ElementDataFile` is `LOCAL`, one file, or `LIST` and a file for
//! each slice in the lines that follow.

use std::{
    io::{Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

use intrados_stage::Access;

use super::{
    Grid, MAX_SIDE, VolumeError, by,
    picture::{not_empty, open_plain},
};

/// Longest header: some lines, or one for each slice of a list.
const MAX_HEADER: u64 = 4 << 20;

/// Bytes behind the voxels that say nothing: what fills a word, or ends a line.
const PADDING: u64 = 16;

/// Types of a voxel value, as MetaIO calls and sizes them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Element {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
}

impl Element {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "MET_UCHAR" => Self::U8,
            "MET_CHAR" => Self::I8,
            "MET_USHORT" => Self::U16,
            "MET_SHORT" => Self::I16,
            "MET_UINT" | "MET_ULONG" => Self::U32,
            "MET_INT" | "MET_LONG" => Self::I32,
            "MET_ULONG_LONG" => Self::U64,
            "MET_LONG_LONG" => Self::I64,
            "MET_FLOAT" => Self::F32,
            "MET_DOUBLE" => Self::F64,
            _ => return None,
        })
    }

    pub(super) fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }

    /// Values of a run of bytes, appended to `out`.
    fn decode(self, bytes: &[u8], msb: bool, out: &mut Vec<f32>) {
        fn each<const N: usize>(
            bytes: &[u8],
            msb: bool,
            out: &mut Vec<f32>,
            value: impl Fn([u8; N]) -> f32,
        ) {
            let (words, _) = bytes.as_chunks::<N>();
            out.extend(words.iter().map(|&word| {
                let mut word = word;
                if msb {
                    word.reverse();
                }
                value(word)
            }));
        }
        match self {
            Self::U8 => each(bytes, msb, out, |b: [u8; 1]| f32::from(b[0])),
            Self::I8 => each(bytes, msb, out, |b| f32::from(i8::from_le_bytes(b))),
            Self::U16 => each(bytes, msb, out, |b| f32::from(u16::from_le_bytes(b))),
            Self::I16 => each(bytes, msb, out, |b| f32::from(i16::from_le_bytes(b))),
            Self::U32 => each(bytes, msb, out, |b| u32::from_le_bytes(b) as f32),
            Self::I32 => each(bytes, msb, out, |b| i32::from_le_bytes(b) as f32),
            Self::U64 => each(bytes, msb, out, |b| u64::from_le_bytes(b) as f32),
            Self::I64 => each(bytes, msb, out, |b| i64::from_le_bytes(b) as f32),
            Self::F32 => each(bytes, msb, out, f32::from_le_bytes),
            Self::F64 => each(bytes, msb, out, |b| f64::from_le_bytes(b) as f32),
        }
    }
}

/// Where the voxels of a MetaImage lie.
#[derive(Debug)]
pub(super) struct Raw {
    /// One file of all slices, or one for each.
    files: Vec<PathBuf>,
    /// Bytes before the first voxel of a file.
    skip: Vec<u64>,
    element: Element,
    msb: bool,
    /// What a value stands for: slope and offset of its stored one.
    intensity: [f32; 2],
    /// Bytes that the header does not account for, for people.
    pub(super) surplus: Option<String>,
}

/// What the lines of a header say.
#[derive(Default)]
struct Header {
    dims: Vec<usize>,
    spacing: Vec<f64>,
    offset: Vec<f64>,
    unit: f64,
    element: Option<Element>,
    intensity: [f32; 2],
    msb: bool,
    skip: i64,
    data: String,
    /// Lines after `ElementDataFile`.
    list: Vec<String>,
    /// Bytes up to the end of the line `ElementDataFile`.
    end: u64,
}

/// Reads the header and checks that the files it names are there, may be read, and are as long as
/// it says. `false` where it does not tell the size of a voxel.
pub(super) fn open(path: &Path, access: &Access) -> Result<(Raw, Grid, bool), VolumeError> {
    let bad = |reason: String| VolumeError::bad(path, reason);
    let (file, _) = open_plain(path)?;
    let mut text = Vec::new();
    file.take(MAX_HEADER).read_to_end(&mut text).map_err(VolumeError::missing(path))?;
    let header = parse(&text).map_err(bad)?;
    let size = match header.dims[..] {
        [x, y] => [x, y, 1],
        [x, y, z] => [x, y, z],
        _ => {
            return Err(bad(format!(
                "DimSize has {} numbers; volumes of two or three dimensions are read",
                header.dims.len()
            )));
        }
    };
    if !size.iter().all(|n| (1..=MAX_SIDE).contains(n)) {
        return Err(bad(format!(
            "DimSize is {}; from 1 to {MAX_SIDE} voxels in each direction are read",
            by(size)
        )));
    }
    let element = header.element.ok_or_else(|| {
        bad("has no ElementType; add a line such as \"ElementType = MET_USHORT\"".to_owned())
    })?;
    let told = !header.spacing.is_empty();
    let triple = |v: &[f64], rest: f64| {
        std::array::from_fn(|k| v.get(k).copied().unwrap_or(rest) * header.unit)
    };
    let flat = header.spacing.first().copied().unwrap_or(1.0);
    let grid =
        Grid { size, voxel: triple(&header.spacing, flat), origin: triple(&header.offset, 0.0) };
    if grid.voxel.iter().any(|v| !(v.is_finite() && *v > 0.0))
        || grid.origin.iter().any(|v| !v.is_finite())
    {
        return Err(bad("ElementSpacing must be above 0 and Offset finite".to_owned()));
    }
    let raw = locate(path, access, &header, element, size)?;
    Ok((raw, grid, told))
}

/// The files of the voxels, each as long as it must be.
fn locate(
    path: &Path,
    access: &Access,
    header: &Header,
    element: Element,
    size: [usize; 3],
) -> Result<Raw, VolumeError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let files = match header.data.as_str() {
        "LOCAL" | "Local" | "local" => vec![path.to_owned()],
        list if list == "LIST" || list.starts_with("LIST ") => {
            if header.list.len() < size[2] {
                let reason = format!(
                    "ElementDataFile lists {} files and DimSize says {} slices",
                    header.list.len(),
                    size[2]
                );
                return Err(VolumeError::bad(path, reason));
            }
            header.list.iter().take(size[2]).map(|name| folder.join(name)).collect()
        }
        name if name.contains('%') => {
            return Err(VolumeError::bad(
                path,
                "ElementDataFile is a pattern; write LIST and the file of each slice in a line of its own",
            ));
        }
        name => vec![folder.join(name)],
    };
    let local = files.first().is_some_and(|file| file == path);
    let slices = if files.len() > 1 { 1 } else { size[2] };
    let need = (size[0] * size[1] * slices) as u64 * element.bytes() as u64;
    let mut skip = Vec::with_capacity(files.len());
    let mut surplus = None;
    for file in &files {
        let length =
            if local { open_plain(file)?.1 } else { not_empty(file, access.open(folder, file))?.1 };
        let start = match header.skip {
            _ if local => header.end,
            -1 => length.saturating_sub(need),
            n => n.unsigned_abs(),
        };
        if length < start.saturating_add(need) {
            let reason = format!(
                "is {length} bytes long; {} voxels of {} bytes need {need} after {start}: DimSize or ElementType of {} is wrong, or the file is cut short",
                by([size[0], size[1], slices]),
                element.bytes(),
                path.display()
            );
            return Err(VolumeError::bad(file, reason));
        }
        let more = length - start - need;
        if more > PADDING {
            surplus.get_or_insert(format!(
                "{} has {more} bytes more than {} voxels of {} bytes after {start}: DimSize or ElementType may be wrong, or HeaderSize missing, where others stand before the voxels",
                file.display(),
                by([size[0], size[1], slices]),
                element.bytes()
            ));
        }
        skip.push(start);
    }
    Ok(Raw { files, skip, element, msb: header.msb, intensity: header.intensity, surplus })
}

fn parse(bytes: &[u8]) -> Result<Header, String> {
    let mut header = Header { unit: 1e-3, intensity: [1.0, 0.0], ..Header::default() };
    let mut rest = bytes;
    for line in 1.. {
        let Some(end) = rest
            .iter()
            .position(|&b| b == b'\n')
            .or((!rest.is_empty() && !header_done(&header)).then_some(rest.len()))
        else {
            break;
        };
        let text = std::str::from_utf8(&rest[..end])
            .map_err(|_| format!("line {line} is not text; is this a MetaImage header?"))?
            .trim();
        rest = rest.get(end + 1..).unwrap_or_default();
        if text.is_empty() {
            continue;
        }
        let (key, value) = text.split_once('=').ok_or_else(|| {
            format!("line {line} is not \"Key = Value\"; is this a MetaImage header?")
        })?;
        entry(&mut header, key.trim(), value.trim())
            .map_err(|reason| format!("line {line}: {reason}"))?;
        if header_done(&header) {
            header.end = (bytes.len() - rest.len()) as u64;
            break;
        }
    }
    if !header_done(&header) {
        return Err("has no ElementDataFile; is this a MetaImage header?".to_owned());
    }
    if header.data.starts_with("LIST") {
        let names =
            std::str::from_utf8(rest).map_err(|_| "the list of files is not text".to_owned())?;
        header.list = names
            .lines()
            .map(str::trim)
            .filter(|l| !l.is_empty())
            .take(MAX_SIDE)
            .map(str::to_owned)
            .collect();
    }
    Ok(header)
}

fn header_done(header: &Header) -> bool {
    !header.data.is_empty()
}

fn entry(header: &mut Header, key: &str, value: &str) -> Result<(), String> {
    let yes = |v: &str| v.eq_ignore_ascii_case("true") || v == "1";
    match key {
        "ObjectType" if !value.eq_ignore_ascii_case("image") => {
            return Err(format!("ObjectType is {value}; only Image is read"));
        }
        "DimSize" => header.dims = numbers(value, 4)?,
        "ElementSpacing" | "ElementSize"
            if header.spacing.is_empty() || key == "ElementSpacing" =>
        {
            header.spacing = numbers(value, 4)?
        }
        "Offset" | "Position" | "Origin" => header.offset = numbers(value, 4)?,
        "DistanceUnits" => {
            header.unit = match value {
                "mm" => 1e-3,
                "um" => 1e-6,
                "cm" => 1e-2,
                "m" => 1.0,
                _ => return Err(format!("DistanceUnits is {value}; um, mm, cm and m are known")),
            }
        }
        "ElementType" => {
            let known = "MET_(U)CHAR, MET_(U)SHORT, MET_(U)INT, MET_(U)LONG, MET_(U)LONG_LONG, MET_FLOAT and MET_DOUBLE";
            header.element = Some(
                Element::parse(value)
                    .ok_or_else(|| format!("ElementType is {value}; {known} are read"))?,
            );
        }
        "ElementToIntensityFunctionSlope" => header.intensity[0] = finite(key, value)?,
        "ElementToIntensityFunctionOffset" => header.intensity[1] = finite(key, value)?,
        "ElementByteOrderMSB" | "BinaryDataByteOrderMSB" => header.msb = yes(value),
        "ElementNumberOfChannels" if value != "1" => {
            return Err(format!("voxels have {value} channels; one is read"));
        }
        "CompressedData" if yes(value) => {
            return Err(
                "the voxels are compressed; write them with CompressedData = False".to_owned()
            );
        }
        "BinaryData" if !yes(value) => {
            return Err("the voxels are text; write them with BinaryData = True".to_owned());
        }
        "HeaderSize" => {
            header.skip =
                value.parse().ok().filter(|n| *n >= -1).ok_or_else(|| {
                    format!("HeaderSize is {value}; it is a count of bytes, or -1")
                })?;
        }
        "ElementDataFile" if value.is_empty() => return Err("ElementDataFile is empty".to_owned()),
        "ElementDataFile" => header.data = value.to_owned(),
        _ => {}
    }
    Ok(())
}

fn finite(key: &str, value: &str) -> Result<f32, String> {
    let number = value
        .parse()
        .ok()
        .filter(|v: &f32| v.is_finite() && (key.ends_with("Offset") || *v != 0.0));
    number.ok_or_else(|| format!("{key} is {value}; it is a number, and a slope is not 0"))
}

fn numbers<T: std::str::FromStr>(value: &str, most: usize) -> Result<Vec<T>, String> {
    let words: Vec<&str> = value.split_whitespace().collect();
    if words.len() > most {
        return Err(format!("has {} numbers; at most {most} make sense", words.len()));
    }
    words
        .iter()
        .map(|w| w.parse().map_err(|_| format!("{w} is not a number that fits here")))
        .collect()
}

impl Raw {
    /// Slices that follow each other in one file, from the byte `skip` on.
    pub(super) fn in_one(path: &Path, skip: u64, element: Element, msb: bool) -> Self {
        let (files, intensity) = (vec![path.to_owned()], [1.0, 0.0]);
        Self { files, skip: vec![skip], element, msb, intensity, surplus: None }
    }

    /// Values of slice `z`.
    pub(super) fn slice(&self, z: usize, size: [usize; 3]) -> Result<Vec<f32>, VolumeError> {
        let (file, within) = if self.files.len() > 1 { (z, 0) } else { (0, z) };
        let (Some(path), Some(&skip)) = (self.files.get(file), self.skip.get(file)) else {
            return Err(VolumeError::bad(Path::new(""), format!("has no slice {z}")));
        };
        let pixels = size[0] * size[1];
        let bytes = pixels * self.element.bytes();
        let mut raw = vec![0; bytes];
        let (mut file, _) = open_plain(path)?;
        file.seek(SeekFrom::Start(skip + (within * bytes) as u64))
            .map_err(VolumeError::missing(path))?;
        file.read_exact(&mut raw).map_err(VolumeError::missing(path))?;
        let mut out = Vec::with_capacity(pixels);
        self.element.decode(&raw, self.msb, &mut out);
        let [slope, offset] = self.intensity;
        out.iter_mut().for_each(|v| *v = slope.mul_add(*v, offset));
        match out.iter().position(|v| !v.is_finite()) {
            None => Ok(out),
            Some(i) => {
                let (x, y) = (i % size[0], i / size[0]);
                Err(VolumeError::bad(
                    path,
                    format!(
                        "voxel {x},{y},{z} is not a finite number; write 0 where nothing was measured"
                    ),
                ))
            }
        }
    }
}
