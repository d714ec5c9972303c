//! CT slices and label masks from files.

use std::{
    collections::BTreeSet,
    ffi::OsStr,
    path::{Path, PathBuf},
};

use intrados_stage::Job;
use intrados_xray::volume::{Reader, VolumeError, without_padding};
use serde::{Deserialize, Serialize};

use intrados_raster::grid::{Grid, Mask};

/// One CT slice as it was reconstructed (or drawn): grey values proportional to attenuation, air
/// outside the specimen 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Slice {
    /// Where it came from: a file name, or what drew it.
    pub name: String,
    /// Grey values, any scale.
    pub grey: Grid<f32>,
    /// Edge of a pixel, mm.
    pub pixel_mm: f32,
}

/// Who says how large a pixel is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PixelFrom {
    /// Whoever named the file.
    Given,
    /// The file: its spacing, or its tags of resolution.
    File,
    /// Nobody: it counts as 1 mm, and what is told in mm is pixels.
    Nobody,
}

/// The slices of a file, read one by one: one of a picture, one a page of a TIFF, one a layer of a
/// MetaImage.
#[derive(Debug)]
pub struct Slices {
    reader: Reader,
    path: PathBuf,
    pixel_mm: f32,
    pixel_from: PixelFrom,
}

impl Slices {
    /// Opens a TIFF (8, 16, 32, 64 bit, integer or float, grey), a PNG (8, 16 bit, grey) or a
    /// MetaImage. What is given of the edge of a pixel counts before what the file tells.
    ///
    /// # Errors
    /// The file is missing, damaged, of another kind or too large; its pixels are no squares.
    pub fn open(path: &Path, pixel_mm: impl Into<Option<f32>>) -> Result<Self, VolumeError> {
        let given = pixel_mm.into();
        if let Some(mm) = given.filter(|mm| !(mm.is_finite() && *mm > 0.0)) {
            return Err(VolumeError::bad(
                path,
                format!("the edge of a pixel must be above 0 mm, not {mm}"),
            ));
        }
        if path.is_dir() {
            return Err(VolumeError::bad(path, "is a folder; give its slices (FOLDER/*.tif)"));
        }
        let reader = Reader::open(path, Some([1e-3 * f64::from(given.unwrap_or(1.0)); 3]))?;
        let (pixel_mm, pixel_from) = match (given, told_mm(&reader)) {
            (Some(mm), _) => (mm, PixelFrom::Given),
            (None, Some([x, y])) if (x / y - 1.0).abs() > SAME => {
                return Err(VolumeError::bad(
                    path,
                    format!("says that its pixels are {x} × {y} mm; resample it to squares"),
                ));
            }
            (None, Some([x, _])) => (x, PixelFrom::File),
            (None, None) => (1.0, PixelFrom::Nobody),
        };
        Ok(Self { reader, path: path.to_owned(), pixel_mm, pixel_from })
    }

    /// Edge of a pixel, mm.
    #[must_use]
    pub fn pixel_mm(&self) -> f32 {
        self.pixel_mm
    }

    /// Who says so.
    #[must_use]
    pub fn pixel_from(&self) -> PixelFrom {
        self.pixel_from
    }

    /// Width and height of a slice, mm.
    #[must_use]
    pub(crate) fn sides_mm(&self) -> [f64; 2] {
        [0, 1].map(|k| self.reader.grid().size[k] as f64 * f64::from(self.pixel_mm))
    }

    /// What the user should know before the file counts, in words: what it says of its pixels where
    /// that contradicts what was given, and what is assumed of it.
    #[must_use]
    pub(crate) fn doubt(&self) -> Option<String> {
        let mut all = self.reader.doubts().to_vec();
        let given = |_: &[f32; 2]| self.pixel_from == PixelFrom::Given;
        if let Some([x, _]) = told_mm(&self.reader).filter(given)
            && (x / self.pixel_mm - 1.0).abs() > SAME
        {
            all.push(format!(
                "{}: its own tags say {x} mm a pixel, not the {} mm that were given and count",
                self.path.display(),
                self.pixel_mm
            ));
        }
        // What a given edge answers is no question any more.
        if self.pixel_from == PixelFrom::Given {
            all.retain(|doubt| !doubt.ends_with("give the edge of a pixel"));
        }
        (!all.is_empty()).then(|| all.join("; "))
    }

    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.reader.grid().size[2]
    }

    /// Reads the slice of a file that holds one.
    ///
    /// # Errors
    /// As [`Slices::read`], or the file holds several.
    pub fn only(&mut self) -> Result<Slice, VolumeError> {
        match self.count() {
            1 => self.read(0),
            n => Err(VolumeError::bad(
                &self.path,
                format!(
                    "holds {n} slices: they are a volume, a Stack of the scene (attach it with --stack)"
                ),
            )),
        }
    }

    /// Reads slice `z`, which is called after the file, and its number where there are several.
    /// Padding around a round field of view becomes air.
    ///
    /// # Errors
    /// There is no such slice, or it is damaged or holds a value that is not finite.
    pub fn read(&mut self, z: usize) -> Result<Slice, VolumeError> {
        let mut slice = self.read_as_it_is(z)?;
        without_padding(&mut slice.grey.data, slice.grey.width);
        Ok(slice)
    }

    /// Reads slice `z` with what lies outside the field of view of its scanner.
    fn read_as_it_is(&mut self, z: usize) -> Result<Slice, VolumeError> {
        let volume = self.reader.read_slab(z..z + 1, &Job::default())?;
        let [width, height, _] = volume.grid.size;
        let name =
            self.path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let name = if self.count() > 1 { format!("{name}#{z}") } else { name };
        Ok(Slice { name, grey: Grid { width, height, data: volume.data }, pixel_mm: self.pixel_mm })
    }
}

/// Edges of a pixel by the file, mm.
fn told_mm(reader: &Reader) -> Option<[f32; 2]> {
    reader.told_pixel().map(|edges| edges.map(|m| (1e3 * m) as f32))
}

/// Edges that differ by no more than this share are the same, rounded.
const SAME: f32 = 0.02;

impl Slice {
    /// Reads a file that holds one slice.
    ///
    /// # Errors
    /// As [`Slices::open`] and [`Slices::read`], or the file holds several.
    pub fn read(path: &Path, pixel_mm: impl Into<Option<f32>>) -> Result<Self, VolumeError> {
        Slices::open(path, pixel_mm)?.only()
    }
}

/// Reads slice `z` of label masks (nonzero = set) and unites them.
///
/// # Errors
/// As [`Slices::read`], or a mask has another size than `slice`.
pub(crate) fn read_masks_at(
    z: usize,
    paths: &[PathBuf],
    slice: &Slice,
) -> Result<Mask, VolumeError> {
    let mut united = Mask::new(slice.grey.width, slice.grey.height, false);
    for path in paths {
        let mask = Slices::open(path, slice.pixel_mm)?.read_as_it_is(z)?.grey.map(|v| v != 0.0);
        if !mask.fits(&united) {
            let (w, h) = (united.width, united.height);
            return Err(VolumeError::bad(
                path,
                format!("is {} × {} pixels and its slice {w} × {h}", mask.width, mask.height),
            ));
        }
        united.unite(&mask);
    }
    Ok(united)
}

/// Reads label masks of one slice (nonzero = set) and unites them.
///
/// # Errors
/// As [`read_masks_at`].
pub fn read_masks(paths: &[PathBuf], slice: &Slice) -> Result<Mask, VolumeError> {
    read_masks_at(0, paths, slice)
}

/// The masks in `candidates` that belong to `slice` by name: `STEM_mask-*.tif` (or `.tiff`, `.png`)
/// for the slice `STEM.*`.
#[must_use]
pub(crate) fn masks_of(slice: &Path, candidates: &[PathBuf]) -> Vec<PathBuf> {
    let stem = slice.file_stem().and_then(OsStr::to_str).unwrap_or_default();
    let belongs = |p: &&PathBuf| {
        let name = p.file_stem().and_then(OsStr::to_str).unwrap_or_default();
        is_picture(p) && name.strip_prefix(stem).is_some_and(|rest| rest.starts_with("_mask-"))
    };
    candidates.iter().filter(belongs).cloned().collect()
}

/// Sorts label masks to their slices: by stem ([`masks_of`]) if every mask has one, else one a
/// slice in the same order.
///
/// # Errors
/// Neither fits.
pub fn pair(slices: &[PathBuf], masks: &[PathBuf]) -> Result<Vec<Vec<PathBuf>>, VolumeError> {
    let by_stem: Vec<Vec<PathBuf>> = slices.iter().map(|slice| masks_of(slice, masks)).collect();
    if by_stem.iter().flatten().collect::<BTreeSet<_>>().len()
        == masks.iter().collect::<BTreeSet<_>>().len()
    {
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
    Err(VolumeError::bad(
        masks.first().or(slices.first()).map(PathBuf::as_path).unwrap_or(Path::new("")),
        reason,
    ))
}

/// Slices of a folder in the order of their names, each with the masks that lie beside it.
///
/// # Errors
/// The folder cannot be read, or has no slices.
pub fn slices_in(folder: &Path) -> Result<Vec<(PathBuf, Vec<PathBuf>)>, VolumeError> {
    let missing = |source| VolumeError::Missing { path: folder.to_owned(), source };
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .map_err(missing)?
        .map(|entry| entry.map(|e| e.path()))
        .collect::<Result<_, _>>()
        .map_err(missing)?;
    files.retain(|p| is_picture(p));
    files.sort();
    let is_mask =
        |p: &Path| p.file_stem().and_then(OsStr::to_str).is_some_and(|s| s.contains("_mask-"));
    let slices: Vec<_> =
        files.iter().filter(|p| !is_mask(p)).map(|p| (p.clone(), masks_of(p, &files))).collect();
    if slices.is_empty() {
        return Err(VolumeError::bad(
            folder,
            "holds no slices; expected .tif, .tiff or .png files",
        ));
    }
    Ok(slices)
}

fn is_picture(path: &Path) -> bool {
    let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default();
    ["tif", "tiff", "png"].iter().any(|e| extension.eq_ignore_ascii_case(e))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::File;
    use tiff::encoder::{TiffEncoder, colortype};

    fn write_f32(path: &Path, w: u32, h: u32, data: &[f32]) {
        TiffEncoder::new(File::create(path).unwrap())
            .unwrap()
            .write_image::<colortype::Gray32Float>(w, h, data)
            .unwrap();
    }

    #[test]
    fn depths_read_alike() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b, c] = ["a.tif", "b.tif", "c.png"].map(|n| folder.path().join(n));
        write_f32(&a, 3, 1, &[0.0, 1.5, 300.0]);
        TiffEncoder::new(File::create(&b).unwrap())
            .unwrap()
            .write_image::<colortype::Gray16>(3, 1, &[0, 7, 60_000])
            .unwrap();
        image::GrayImage::from_raw(3, 1, vec![0, 1, 255]).unwrap().save(&c).unwrap();
        assert_eq!(Slice::read(&a, 0.1).unwrap().grey.data, [0.0, 1.5, 300.0]);
        assert_eq!(Slice::read(&b, 0.1).unwrap().grey.data, [0.0, 7.0, 60_000.0]);
        assert_eq!(Slice::read(&c, 0.1).unwrap().grey.data, [0.0, 1.0, 255.0]);
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
        std::fs::write(at("empty.tif"), "").unwrap();
        let mut bytes = bytes;
        // Its width (tag 256) lies.
        let tag = bytes.windows(4).position(|b| b == [0, 1, 4, 0] || b == [0, 1, 3, 0]).unwrap();
        bytes[tag + 8..tag + 10].copy_from_slice(&[200, 0]);
        std::fs::write(at("lies.tif"), bytes).unwrap();
        for name in ["nan.tif", "text.tif", "short.tif", "empty.tif", "lies.tif"] {
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
        let masks =
            ["core_10_mask-void.tif", "core_1_mask-void.tif", "core_1_mask-liquid.tif"].map(at);
        assert_eq!(pair(&slices, &masks).unwrap().iter().map(Vec::len).collect::<Vec<_>>(), [2, 1]);
        assert_eq!(
            pair(&slices, &["b.tif", "a.tif"].map(at)).unwrap(),
            [vec![at("b.tif")], vec![at("a.tif")]]
        );
        assert!(pair(&slices, &[at("a.tif")]).is_err());
        let slice = Slice::read(&found[0].0, 1.0).unwrap();
        assert_eq!(read_masks(&found[0].1, &slice).unwrap().data, [true, true]);
        let other = Slice::read(&found[1].0, 1.0).unwrap();
        assert!(read_masks(&found[1].1, &other).unwrap_err().to_string().contains("2 × 1"));
    }
}
