//! Writing volumes slab by slab, through a temporary file that is renamed when it is complete.

use std::{
    io::{Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use intrados_stage::file::{Unfinished, put};
use tiff::{
    encoder::{Rational, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard, colortype},
    tags::{ResolutionUnit, Tag},
};

use super::{Grid, VolumeError};

/// From this many bytes on a TIFF needs 64-bit offsets.
const BIG: u64 = 0xf000_0000;

/// How values are stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Depth {
    /// As they are.
    Float,
    /// As 16 bit, `low` as 0 and `high` as 65 535, values beyond at the ends.
    Sixteen {
        /// What becomes 0.
        low: f32,
        /// What becomes 65 535.
        high: f32,
    },
}

impl Depth {
    fn code(low: f32, high: f32, v: f32) -> u16 {
        (((v - low) / (high - low)).clamp(0.0, 1.0) * 65_535.0).round() as u16
    }

    fn bytes(self) -> u64 {
        if self == Self::Float { 4 } else { 2 }
    }
}

/// A file shared with an encoder, which does not give back what it was given.
#[derive(Clone)]
struct Lent(Arc<Mutex<Option<Unfinished>>>);

impl Lent {
    fn new(file: Unfinished) -> Self {
        Self(Arc::new(Mutex::new(Some(file))))
    }

    fn with<T>(
        &self,
        act: impl FnOnce(&mut Unfinished) -> std::io::Result<T>,
    ) -> std::io::Result<T> {
        act(self
            .0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .as_mut()
            .ok_or(std::io::ErrorKind::BrokenPipe)?)
    }

    fn take(self) -> Option<Unfinished> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl Write for Lent {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.with(|file| file.write(bytes))
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.with(Write::flush)
    }
}

impl Seek for Lent {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.with(|file| file.seek(to))
    }
}

enum Sink {
    Tiff(TiffEncoder<Lent, TiffKindStandard>, Lent),
    BigTiff(TiffEncoder<Lent, TiffKindBig>, Lent),
    /// Voxels and the name of their file.
    Raw(Unfinished, PathBuf),
}

/// A volume on its way into a file: `.tif`, `.tiff` (one page a slice, readable by ImageJ), `.mhd`
/// (header, and voxels beside it in `.raw`). Nothing appears under its name before
/// [`Writer::finish`].
pub struct Writer {
    sink: Sink,
    path: PathBuf,
    grid: Grid,
    depth: Depth,
    written: usize,
    note: String,
}

impl std::fmt::Debug for Writer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Writer")
            .field("path", &self.path)
            .field("grid", &self.grid)
            .finish_non_exhaustive()
    }
}

impl Writer {
    /// Begins a file for a volume on `grid`.
    ///
    /// # Errors
    /// The folder cannot be written, the extension is not known, or the depth has no range.
    pub fn create(path: &Path, grid: Grid, depth: Depth) -> Result<Self, VolumeError> {
        if let Depth::Sixteen { low, high } = depth
            && !(low.is_finite() && high.is_finite() && low < high)
        {
            return Err(VolumeError::bad(path, format!("16 bit from {low} to {high} is no range")));
        }
        let file = |path: &Path| Unfinished::begin(path).map_err(VolumeError::missing(path));
        let bad = tiff_error(path);
        let big = grid.len() as u64 * depth.bytes() + grid.size[2] as u64 * 1024 > BIG;
        let sink = match path
            .extension()
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase)
            .as_deref()
        {
            Some("tif" | "tiff") => {
                let lent = Lent::new(file(path)?);
                match big {
                    true => Sink::BigTiff(TiffEncoder::new_big(lent.clone()).map_err(bad)?, lent),
                    false => Sink::Tiff(TiffEncoder::new(lent.clone()).map_err(bad)?, lent),
                }
            }
            Some("mhd") => {
                let raw = path.with_extension("raw");
                Sink::Raw(file(&raw)?, raw)
            }
            _ => return Err(VolumeError::bad(path, "volumes are written as .tif, .tiff or .mhd")),
        };
        Ok(Self { sink, path: path.to_owned(), grid, depth, written: 0, note: String::new() })
    }

    /// The same with a note on where the values come from in every page of a TIFF: lines
    /// `key=value`.
    #[must_use]
    pub fn noted(self, note: impl Into<String>) -> Self {
        Self { note: note.into(), ..self }
    }

    /// Appends whole slices.
    ///
    /// # Errors
    /// `data` is not whole slices or more than the grid has, or the disk is full.
    pub fn write_slab(&mut self, data: &[f32]) -> Result<(), VolumeError> {
        let n = self.grid.slice_len();
        if n == 0
            || !data.len().is_multiple_of(n)
            || self.written + data.len() / n > self.grid.size[2]
        {
            let reason = format!(
                "{} values after {} slices are no slices of {}",
                data.len(),
                self.written,
                super::by(self.grid.size)
            );
            return Err(VolumeError::bad(&self.path, reason));
        }
        for slice in data.chunks_exact(n) {
            match &mut self.sink {
                Sink::Tiff(encoder, _) => page(encoder, slice, &self.grid, self.depth, &self.note)
                    .map_err(tiff_error(&self.path))?,
                Sink::BigTiff(encoder, _) => {
                    page(encoder, slice, &self.grid, self.depth, &self.note)
                        .map_err(tiff_error(&self.path))?
                }
                Sink::Raw(file, _) => file
                    .write_all(&bytes(slice, self.depth))
                    .map_err(VolumeError::missing(&self.path))?,
            }
            self.written += 1;
        }
        Ok(())
    }

    /// Completes the file and gives it its name.
    ///
    /// # Errors
    /// Slices are missing, or the disk is full.
    pub fn finish(self) -> Result<(), VolumeError> {
        if self.written != self.grid.size[2] {
            return Err(VolumeError::bad(
                &self.path,
                format!("{} of {} slices were written", self.written, self.grid.size[2]),
            ));
        }
        match self.sink {
            Sink::Tiff(_, lent) | Sink::BigTiff(_, lent) => match lent.take() {
                Some(file) => file.finish().map_err(VolumeError::missing(&self.path)),
                None => Ok(()),
            },
            Sink::Raw(file, raw) => {
                file.finish().map_err(VolumeError::missing(&raw))?;
                let header = metaimage(&self.grid, self.depth, &raw);
                put(&self.path, |out| out.write_all(header.as_bytes()))
                    .map_err(VolumeError::missing(&self.path))
            }
        }
    }
}

/// One page: a slice and, as ImageJ writes them, its voxel.
fn page<K: TiffKind>(
    encoder: &mut TiffEncoder<Lent, K>,
    slice: &[f32],
    grid: &Grid,
    depth: Depth,
    note: &str,
) -> tiff::TiffResult<()> {
    let (w, h) = (grid.size[0] as u32, grid.size[1] as u32);
    let description = format!(
        "ImageJ=1.54\nimages={0}\nslices={0}\nunit=mm\nspacing={1}\n{2}",
        grid.size[2],
        grid.voxel[2] * 1e3,
        ascii(note)
    );
    macro_rules! write {
        ($kind:ty, $data:expr) => {{
            let mut image = encoder.new_image::<$kind>(w, h)?;
            image.encoder().write_tag(Tag::ImageDescription, description.as_str())?;
            image.resolution_unit(ResolutionUnit::None);
            image.x_resolution(per_mm(grid.voxel[0]));
            image.y_resolution(per_mm(grid.voxel[1]));
            image.write_data($data)
        }};
    }
    match depth {
        Depth::Float => write!(colortype::Gray32Float, slice),
        Depth::Sixteen { low, high } => {
            let codes: Vec<u16> = slice.iter().map(|&v| Depth::code(low, high, v)).collect();
            write!(colortype::Gray16, &codes)
        }
    }
}

/// Text as a TIFF may hold it, which is ASCII (TIFF 6.0, section 2): other letters as ImageJ
/// escapes them, `St\u00FCtze`.
fn ascii(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\n' | ' '..='~' => plain.push(c),
            _ => c
                .encode_utf16(&mut [0; 2])
                .iter()
                .for_each(|unit| plain += &format!("\\u{unit:04X}")),
        }
    }
    plain
}

/// Voxels in a millimetre as the fraction that a TIFF can hold.
fn per_mm(edge: f64) -> Rational {
    let most = f64::from(u32::MAX);
    let d = (1e6_f64).min(most * edge * 1e3).max(1.0).floor();
    Rational { n: (d / (edge * 1e3)).round().clamp(1.0, most) as u32, d: d as u32 }
}

fn bytes(slice: &[f32], depth: Depth) -> Vec<u8> {
    match depth {
        Depth::Float => slice.iter().flat_map(|v| v.to_le_bytes()).collect(),
        Depth::Sixteen { low, high } => {
            slice.iter().flat_map(|&v| Depth::code(low, high, v).to_le_bytes()).collect()
        }
    }
}

fn metaimage(grid: &Grid, depth: Depth, raw: &Path) -> String {
    let words = |v: [f64; 3]| v.map(|x| (x * 1e3).to_string()).join(" ");
    let kind = if depth == Depth::Float { "MET_FLOAT" } else { "MET_USHORT" };
    format!(
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\nDimSize = {}\n\
         ElementSpacing = {}\nOffset = {}\nElementType = {kind}\nElementDataFile = {}\n",
        grid.size.map(|n| n.to_string()).join(" "),
        words(grid.voxel),
        words(grid.origin),
        raw.file_name().unwrap_or_default().to_string_lossy()
    )
}

fn tiff_error(path: &Path) -> impl Fn(tiff::TiffError) -> VolumeError {
    move |e| VolumeError::bad(path, format!("cannot be written as TIFF: {e}"))
}

#[cfg(test)]
mod tests {
    #[test]
    fn notes_are_ascii() {
        assert_eq!(
            super::ascii("a=Stütze\nb=桥🌉\t\0"),
            "a=St\\u00FCtze\nb=\\u6865\\uD83C\\uDF09\\u0009\\u0000"
        );
    }
}
