//! CT slices and label masks from files.

use std::{
    collections::BTreeSet,
    ffi::OsStr,
    fs::File,
    io::{BufReader, Read},
    path::{Path, PathBuf},
};

use tiff::decoder::{Decoder, DecodingResult, Limits};

use crate::grid::{Grid, Mask};

/// The largest slice that is read: 16384 pixels in each direction.
pub const MAX_SIDE: usize = 16_384;

/// One CT slice as it was reconstructed (or drawn): grey values proportional to attenuation, air outside the specimen 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Slice {
    /// Where it came from: a file name, or what drew it.
    pub name: String,
    /// Grey values, any scale.
    pub grey: Grid<f32>,
    /// Edge of a pixel, mm.
    pub pixel_mm: f32,
}

/// Why a slice or a mask could not be used.
#[derive(Debug, thiserror::Error)]
pub enum SliceError {
    /// The file is not there, or may not be read.
    #[error("{path}: {source}")]
    Missing {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is there and is not what it should be.
    #[error("{path}: {reason}")]
    Bad {
        /// Which file.
        path: PathBuf,
        /// What is wrong and what would help.
        reason: String,
    },
}

impl SliceError {
    /// Whether the file was absent or unreadable, rather than damaged.
    #[must_use]
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::Missing { .. })
    }

    pub(crate) fn bad(path: &Path, reason: impl Into<String>) -> Self {
        Self::Bad { path: path.to_owned(), reason: reason.into() }
    }
}

impl Slice {
    /// Reads a TIFF (8, 16, 32 bit, integer or float, one channel) or a PNG.
    ///
    /// # Errors
    /// The file is missing, damaged, of another kind, larger than [`MAX_SIDE`], or holds a value that is not finite.
    pub fn read(path: &Path, pixel_mm: f32) -> Result<Self, SliceError> {
        if !(pixel_mm.is_finite() && pixel_mm > 0.0) {
            return Err(SliceError::bad(path, format!("the edge of a pixel must be above 0 mm, not {pixel_mm}")));
        }
        let grey = read_grey(path)?;
        if let Some(i) = grey.data.iter().position(|v| !v.is_finite()) {
            let (x, y) = grey.place(i);
            return Err(SliceError::bad(path, format!("pixel {x},{y} is not a finite number; write 0 where nothing was measured")));
        }
        Ok(Self { name: file_name(path), grey, pixel_mm })
    }
}

/// Reads label masks (nonzero = set) and unites them.
///
/// # Errors
/// As [`Slice::read`], or a mask has another size than `slice`.
pub fn read_masks(paths: &[PathBuf], slice: &Slice) -> Result<Mask, SliceError> {
    let mut united = Mask::new(slice.grey.width, slice.grey.height, false);
    for path in paths {
        let mask = read_grey(path)?.map(|v| v != 0.0);
        if !mask.fits(&united) {
            let (w, h) = (united.width, united.height);
            return Err(SliceError::bad(path, format!("is {} × {} pixels and its slice {w} × {h}", mask.width, mask.height)));
        }
        united.unite(&mask);
    }
    Ok(united)
}

/// The masks in `candidates` that belong to `slice` by name: `STEM_mask-*.tif` (or `.tiff`, `.png`) for the slice `STEM.*`.
#[must_use]
pub fn masks_of(slice: &Path, candidates: &[PathBuf]) -> Vec<PathBuf> {
    let stem = slice.file_stem().and_then(OsStr::to_str).unwrap_or_default();
    let belongs = |p: &&PathBuf| {
        let name = p.file_stem().and_then(OsStr::to_str).unwrap_or_default();
        is_picture(p) && name.strip_prefix(stem).is_some_and(|rest| rest.starts_with("_mask-"))
    };
    candidates.iter().filter(belongs).cloned().collect()
}

/// Sorts label masks to their slices: by stem ([`masks_of`]) if every mask has one, else one a slice in the same order.
///
/// # Errors
/// Neither fits.
pub fn pair(slices: &[PathBuf], masks: &[PathBuf]) -> Result<Vec<Vec<PathBuf>>, SliceError> {
    let by_stem: Vec<Vec<PathBuf>> = slices.iter().map(|slice| masks_of(slice, masks)).collect();
    if by_stem.iter().flatten().collect::<BTreeSet<_>>().len() == masks.iter().collect::<BTreeSet<_>>().len() {
        return Ok(by_stem);
    }
    if slices.len() == masks.len() {
        return Ok(masks.iter().map(|mask| vec![mask.clone()]).collect());
    }
    let reason = format!(
        "{} masks for {} slices: give one a slice in the same order, or name them STEM_mask-….tif after STEM.tif",
        masks.len(),
        slices.len()
    );
    Err(SliceError::bad(masks.first().or(slices.first()).map(PathBuf::as_path).unwrap_or(Path::new("")), reason))
}

/// Slices of a folder in the order of their names, each with the masks that lie beside it.
///
/// # Errors
/// The folder cannot be read, or has no slices.
pub fn slices_in(folder: &Path) -> Result<Vec<(PathBuf, Vec<PathBuf>)>, SliceError> {
    let missing = |source| SliceError::Missing { path: folder.to_owned(), source };
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder).map_err(missing)?.map(|entry| entry.map(|e| e.path())).collect::<Result<_, _>>().map_err(missing)?;
    files.retain(|p| is_picture(p));
    files.sort();
    let is_mask = |p: &Path| p.file_stem().and_then(OsStr::to_str).is_some_and(|s| s.contains("_mask-"));
    let slices: Vec<_> = files.iter().filter(|p| !is_mask(p)).map(|p| (p.clone(), masks_of(p, &files))).collect();
    if slices.is_empty() {
        return Err(SliceError::bad(folder, "holds no slices; expected .tif, .tiff or .png files"));
    }
    Ok(slices)
}

fn file_name(path: &Path) -> String {
    path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

fn is_picture(path: &Path) -> bool {
    let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default();
    ["tif", "tiff", "png"].iter().any(|e| extension.eq_ignore_ascii_case(e))
}

fn read_grey(path: &Path) -> Result<Grid<f32>, SliceError> {
    let missing = |source| SliceError::Missing { path: path.to_owned(), source };
    let mut magic = [0; 8];
    let mut file = File::open(path).map_err(missing)?;
    let n = file.read(&mut magic).map_err(missing)?;
    let file = BufReader::new(File::open(path).map_err(missing)?);
    match &magic[..n.min(4)] {
        b"II*\0" | b"MM\0*" | b"II+\0" | b"MM\0+" => read_tiff(path, file),
        b"\x89PNG" => read_png(path, file),
        _ => Err(SliceError::bad(path, "is neither TIFF nor PNG")),
    }
}

fn read_tiff(path: &Path, file: BufReader<File>) -> Result<Grid<f32>, SliceError> {
    let bad = |e: tiff::TiffError| SliceError::bad(path, format!("cannot be read as TIFF: {e}"));
    let mut limits = Limits::default();
    limits.decoding_buffer_size = MAX_SIDE * MAX_SIDE * 8;
    limits.intermediate_buffer_size = MAX_SIDE * MAX_SIDE * 8;
    let mut decoder = Decoder::new(file).map_err(bad)?.with_limits(limits);
    let (w, h) = decoder.dimensions().map_err(bad)?;
    let size = checked_size(path, w, h)?;
    let channels = decoder.colortype().map_err(bad)?.num_samples();
    if channels != 1 {
        return Err(SliceError::bad(path, format!("has {channels} channels; a slice or mask has one grey value a pixel")));
    }
    if decoder.more_images() {
        return Err(SliceError::bad(path, "holds several images; save each slice as a file of its own"));
    }
    let data = match decoder.read_image().map_err(bad)? {
        DecodingResult::U8(v) => v.into_iter().map(f32::from).collect(),
        DecodingResult::U16(v) => v.into_iter().map(f32::from).collect(),
        DecodingResult::U32(v) => v.into_iter().map(|x| x as f32).collect(),
        DecodingResult::I8(v) => v.into_iter().map(f32::from).collect(),
        DecodingResult::I16(v) => v.into_iter().map(f32::from).collect(),
        DecodingResult::I32(v) => v.into_iter().map(|x| x as f32).collect(),
        DecodingResult::F32(v) => v,
        DecodingResult::F64(v) => v.into_iter().map(|x| x as f32).collect(),
        _ => return Err(SliceError::bad(path, "has a pixel format that is not read; save it as 8, 16 or 32 bit")),
    };
    sized(path, size, data)
}

fn read_png(path: &Path, file: BufReader<File>) -> Result<Grid<f32>, SliceError> {
    let bad = |e: image::ImageError| SliceError::bad(path, format!("cannot be read as PNG: {e}"));
    let mut reader = image::ImageReader::with_format(file, image::ImageFormat::Png);
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MAX_SIDE as u32);
    limits.max_image_height = Some(MAX_SIDE as u32);
    limits.max_alloc = Some((MAX_SIDE * MAX_SIDE * 8) as u64);
    reader.limits(limits);
    let picture = reader.decode().map_err(bad)?;
    let size = checked_size(path, picture.width(), picture.height())?;
    sized(path, size, picture.to_luma16().into_raw().into_iter().map(f32::from).collect())
}

fn checked_size(path: &Path, w: u32, h: u32) -> Result<[usize; 2], SliceError> {
    let size = [w as usize, h as usize];
    match size.iter().all(|n| (1..=MAX_SIDE).contains(n)) {
        true => Ok(size),
        false => Err(SliceError::bad(path, format!("is {w} × {h} pixels; from 1 to {MAX_SIDE} in each direction are read"))),
    }
}

fn sized(path: &Path, [width, height]: [usize; 2], data: Vec<f32>) -> Result<Grid<f32>, SliceError> {
    match data.len() == width * height {
        true => Ok(Grid { width, height, data }),
        false => Err(SliceError::bad(path, format!("says {width} × {height} pixels and holds {}", data.len()))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tiff::encoder::{TiffEncoder, colortype};

    fn write_f32(path: &Path, w: u32, h: u32, data: &[f32]) {
        TiffEncoder::new(File::create(path).unwrap()).unwrap().write_image::<colortype::Gray32Float>(w, h, data).unwrap();
    }

    #[test]
    fn depths_read_alike() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b, c] = ["a.tif", "b.tif", "c.png"].map(|n| folder.path().join(n));
        write_f32(&a, 3, 1, &[0.0, 1.5, 300.0]);
        TiffEncoder::new(File::create(&b).unwrap()).unwrap().write_image::<colortype::Gray16>(3, 1, &[0, 7, 60_000]).unwrap();
        image::GrayImage::from_raw(3, 1, vec![0, 1, 255]).unwrap().save(&c).unwrap();
        assert_eq!(Slice::read(&a, 0.1).unwrap().grey.data, [0.0, 1.5, 300.0]);
        assert_eq!(Slice::read(&b, 0.1).unwrap().grey.data, [0.0, 7.0, 60_000.0]);
        assert_eq!(Slice::read(&c, 0.1).unwrap().grey.data, [0.0, 257.0, 65_535.0]);
    }

    #[test]
    fn bad_files_are_refused_with_their_name() {
        let folder = tempfile::tempdir().unwrap();
        let at = |n: &str| folder.path().join(n);
        write_f32(&at("nan.tif"), 2, 1, &[0.0, f32::NAN]);
        std::fs::write(at("text.tif"), "not a picture").unwrap();
        write_f32(&at("short.tif"), 20, 20, &[1.0; 400]);
        let bytes = std::fs::read(at("short.tif")).unwrap();
        std::fs::write(at("short.tif"), &bytes[..200]).unwrap();
        for name in ["nan.tif", "text.tif", "short.tif"] {
            let error = Slice::read(&at(name), 1.0).unwrap_err();
            assert!(!error.is_missing() && error.to_string().contains(name), "{error}");
        }
        assert!(Slice::read(&at("nothing.tif"), 1.0).unwrap_err().is_missing());
        assert!(Slice::read(&at("nan.tif"), 0.0).is_err());
    }

    #[test]
    fn masks_are_found_by_stem_and_united() {
        let folder = tempfile::tempdir().unwrap();
        let at = |n: &str| folder.path().join(n);
        write_f32(&at("core_1.tif"), 2, 1, &[1.0, 1.0]);
        write_f32(&at("core_1_mask-void.tif"), 2, 1, &[1.0, 0.0]);
        write_f32(&at("core_1_mask-liquid.tif"), 2, 1, &[0.0, 255.0]);
        write_f32(&at("core_10_mask-void.tif"), 2, 1, &[1.0, 0.0]);
        write_f32(&at("core_10.tif"), 3, 1, &[1.0; 3]);
        let found = slices_in(folder.path()).unwrap();
        assert_eq!(found.iter().map(|(_, m)| m.len()).collect::<Vec<_>>(), [2, 1]);
        let slices = [at("core_1.tif"), at("core_10.tif")];
        let masks = ["core_10_mask-void.tif", "core_1_mask-void.tif", "core_1_mask-liquid.tif"].map(at);
        assert_eq!(pair(&slices, &masks).unwrap().iter().map(Vec::len).collect::<Vec<_>>(), [2, 1]);
        assert_eq!(pair(&slices, &["b.tif", "a.tif"].map(at)).unwrap(), [vec![at("b.tif")], vec![at("a.tif")]]);
        assert!(pair(&slices, &[at("a.tif")]).is_err());
        let slice = Slice::read(&found[0].0, 1.0).unwrap();
        assert_eq!(read_masks(&found[0].1, &slice).unwrap().data, [true, true]);
        let other = Slice::read(&found[1].0, 1.0).unwrap();
        assert!(read_masks(&found[1].1, &other).unwrap_err().to_string().contains("2 × 1"));
    }
}
