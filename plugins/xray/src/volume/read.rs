//! Reading volumes slab by slab.

use std::{
    cmp::Ordering,
    ffi::OsStr,
    io::Read,
    ops::Range,
    path::{Path, PathBuf},
};

use intrados_stage::{Access, Job};

use super::{
    Grid, MAX_SIDE, Volume, VolumeError,
    dicom::{self, Series},
    metaimage::{self, Raw},
    picture::{self, Pages, Picture, Resolution},
};

/// A volume in files: its headers have been checked, its voxels are read when asked for.
pub struct Reader {
    source: Source,
    grid: Grid,
    path: PathBuf,
    /// Edges of a pixel by the file itself, m.
    told: Option<[f64; 2]>,
    /// What the user should know of how it is read, one line each.
    doubts: Vec<String>,
}

enum Source {
    /// One picture a slice.
    Files(Vec<PathBuf>),
    /// One TIFF, one page a slice. The decoder is away only while a page is read.
    Pages(Option<Box<Pages>>, u64),
    Raw(Raw),
    Dicom(Box<Series>),
}

impl std::fmt::Debug for Reader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Reader")
            .field("path", &self.path)
            .field("grid", &self.grid)
            .finish_non_exhaustive()
    }
}

impl Reader {
    /// Opens a MetaImage (`.mhd`, `.mha`), a TIFF of one or more pages, a PNG, a DICOM file, or a
    /// folder of TIFF or PNG slices (in the order of the numbers in their names) or of a DICOM
    /// series (in the order of their places). `voxel` (m) overrides what the
    /// file tells; where no file tells it must be given.
    ///
    /// # Errors
    /// The file is missing, damaged, of another kind, of several sizes, or its size is not that of
    /// its data; no voxel size is known.
    pub fn open(path: &Path, voxel: Option<[f64; 3]>) -> Result<Self, VolumeError> {
        Self::open_within(path, voxel, &Access::default())
    }

    /// [`Reader::open`] where the files that a header names may lie in other folders too.
    ///
    /// # Errors
    /// As [`Reader::open`].
    pub fn open_within(
        path: &Path,
        voxel: Option<[f64; 3]>,
        access: &Access,
    ) -> Result<Self, VolumeError> {
        if path.is_dir() {
            return Self::files(slices_in(path)?, voxel);
        }
        if dicom::is_dicom(path) {
            return Self::dicom(&[path.to_owned()], voxel);
        }
        let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default();
        if ["mhd", "mha"].iter().any(|e| extension.eq_ignore_ascii_case(e)) {
            let (raw, mut grid, told) = metaimage::open(path, access)?;
            let pixel = told.then_some([grid.voxel[0], grid.voxel[1]]);
            if voxel.is_some() || !told {
                let told = Grid::centred(grid.size, known_voxel(path, voxel, None)?);
                grid = Grid { voxel: told.voxel, ..grid };
            }
            let doubts = raw.surplus.iter().cloned().collect();
            let (source, path) = (Source::Raw(raw), path.to_owned());
            return Ok(Self { source, grid, path, told: pixel, doubts });
        }
        match picture::open(path)? {
            (Picture::Png, _) => Self::files(vec![path.to_owned()], voxel),
            (Picture::Tiff(pages), size) => Self::pages(path, pages, size, voxel),
        }
    }

    /// Slices in files of their own, in the order of the numbers in their names (of a DICOM
    /// series: of their places); or the one file of all slices.
    ///
    /// # Errors
    /// As [`Reader::open`].
    pub fn pile(mut files: Vec<PathBuf>, voxel: Option<[f64; 3]>) -> Result<Self, VolumeError> {
        match &files[..] {
            [file] => Self::open(file, voxel),
            _ => {
                files.sort_by(|a, b| natural(&a.to_string_lossy(), &b.to_string_lossy()));
                Self::files(files, voxel)
            }
        }
    }

    /// Slices in files of their own, in the order given.
    ///
    /// # Errors
    /// As [`Reader::open`]; a file holds several pages.
    pub fn files(files: Vec<PathBuf>, voxel: Option<[f64; 3]>) -> Result<Self, VolumeError> {
        let first = files
            .first()
            .cloned()
            .ok_or_else(|| VolumeError::bad(Path::new(""), "no slices are given"))?;
        if files.len() > MAX_SIDE {
            return Err(VolumeError::bad(
                &first,
                format!("is one of {} slices; at most {MAX_SIDE} are read", files.len()),
            ));
        }
        if dicom::is_dicom(&first) {
            return Self::dicom(&files, voxel);
        }
        let (mut told, mut pixel) = (None, None);
        let mut size = None;
        let mut doubts = Vec::new();
        for file in &files {
            let (mut picture, found) = picture::open(file)?;
            picture::same_size(file, 0, found, *size.get_or_insert(found))?;
            if let Picture::Tiff(pages) = &mut picture {
                if pages.more_images() && files.len() > 1 {
                    return Err(VolumeError::bad(
                        file,
                        "holds several pages beside other files; save each slice as a file of its own",
                    ));
                }
                let (voxel, edges) = picture::guard(file, || {
                    Ok((picture::voxel(pages), picture::resolution(pages)))
                })?;
                told = told.or(voxel);
                pixel = pixel.or(edges);
            }
        }
        let pixel = believed(&first, pixel.filter(|_| told.is_none()), &mut doubts);
        let [w, h] = size.unwrap_or_default();
        let grid = Grid::centred([w, h, files.len()], known_voxel(&first, voxel, told)?);
        Ok(Self {
            source: Source::Files(files),
            grid,
            path: first,
            told: told.map(|[x, y, _]| [x, y]).or(pixel),
            doubts,
        })
    }

    fn dicom(files: &[PathBuf], voxel: Option<[f64; 3]>) -> Result<Self, VolumeError> {
        let dicom::Opened { series, grid, known: [pixel, all], doubts } = dicom::open(files)?;
        let path = files[0].clone();
        let told = pixel.then_some([grid.voxel[0], grid.voxel[1]]);
        // A single slice needs no distance to the next one.
        let known = (pixel && (all || grid.size[2] == 1)).then_some(grid.voxel);
        let grid = Grid::centred(grid.size, known_voxel(&path, voxel, known)?);
        Ok(Self { source: Source::Dicom(Box::new(series)), grid, path, told, doubts })
    }

    fn pages(
        path: &Path,
        mut pages: Box<Pages>,
        size: [usize; 2],
        voxel: Option<[f64; 3]>,
    ) -> Result<Self, VolumeError> {
        let length = std::fs::metadata(path).map_err(VolumeError::missing(path))?.len();
        let mut doubts = Vec::new();
        let (told, pixel, count, described) = picture::guard(path, || {
            let told = picture::voxel(&mut pages);
            let pixel = picture::resolution(&mut pages).filter(|_| told.is_none());
            let described = picture::following(&mut pages, size, length, is_big(path)?);
            Ok((told, pixel, count_pages(path, &mut pages, size, length)?, described))
        })?;
        let pixel = told.map(|[x, y, _]| [x, y]).or(believed(path, pixel, &mut doubts));
        let (mut source, mut count) = (Source::Pages(Some(pages), length), count);
        if let Some(all) = described.filter(|all| all.count != count) {
            match all.raw.filter(|_| count == 1 && all.count <= MAX_SIDE) {
                Some((from, element, msb)) => {
                    source = Source::Raw(Raw::in_one(path, from, element, msb));
                    count = all.count;
                }
                None => doubts.push(format!(
                    "{}: its description says {} slices and it holds {count}: was it cut short, or is it one of them?",
                    path.display(),
                    all.count
                )),
            }
        }
        let grid = Grid::centred([size[0], size[1], count], known_voxel(path, voxel, told)?);
        Ok(Self { source, grid, path: path.to_owned(), told: pixel, doubts })
    }

    /// What the user should know of how it is read, one line each: what its files do not say and is
    /// assumed, and what they say that cannot be.
    #[must_use]
    pub fn doubts(&self) -> &[String] {
        &self.doubts
    }

    /// Size, voxel and place.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Edges of a pixel by the (first) file itself, m: by its spacing, or by the tags of
    /// resolution, of which a volume takes nothing.
    #[must_use]
    pub fn told_pixel(&self) -> Option<[f64; 2]> {
        self.told
    }

    /// The file, or the first of several.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Reads the slices `z`; needs memory for these alone.
    ///
    /// # Errors
    /// There are no such slices, a file is damaged or holds a value that is not finite, or the job
    /// was cancelled.
    pub fn read_slab(&mut self, z: Range<usize>, job: &Job) -> Result<Volume, VolumeError> {
        let size = self.grid.size;
        if z.start > z.end || z.end > size[2] {
            return Err(VolumeError::bad(
                &self.path,
                format!("has {} slices; {}..{} were asked for", size[2], z.start, z.end),
            ));
        }
        let grid = self.grid.slab(z.clone());
        let mut data = Vec::with_capacity(grid.len());
        for (done, slice) in z.clone().enumerate() {
            job.step(done, z.len())?;
            data.extend(self.slice(slice)?);
        }
        Ok(Volume { grid, data })
    }

    /// Reads all slices.
    ///
    /// # Errors
    /// As [`Reader::read_slab`].
    pub fn read(&mut self, job: &Job) -> Result<Volume, VolumeError> {
        self.read_slab(0..self.grid.size[2], job)
    }

    fn slice(&mut self, z: usize) -> Result<Vec<f32>, VolumeError> {
        let size = [self.grid.size[0], self.grid.size[1]];
        match &mut self.source {
            Source::Raw(raw) => raw.slice(z, self.grid.size),
            Source::Dicom(series) => series.slice(z, size),
            Source::Pages(pages, length) => {
                // A page that could not be read took the decoder with it; the others may be sound.
                let decoder = match pages.take() {
                    Some(decoder) => decoder,
                    None => match picture::open(&self.path)? {
                        (Picture::Tiff(decoder), _) => decoder,
                        (Picture::Png, _) => {
                            return Err(VolumeError::bad(
                                &self.path,
                                "is not the file that it was",
                            ));
                        }
                    },
                };
                let (decoder, data) = picture::read_page(&self.path, *decoder, z, size, *length)?;
                *pages = Some(Box::new(decoder));
                Ok(data)
            }
            Source::Files(files) => {
                let path = files
                    .get(z)
                    .ok_or_else(|| VolumeError::bad(&self.path, format!("has no slice {z}")))?;
                match picture::open(path)? {
                    (Picture::Png, found) => picture::same_size(path, 0, found, size)
                        .and_then(|()| picture::read_png(path, size)),
                    (Picture::Tiff(pages), _) => {
                        let length =
                            std::fs::metadata(path).map_err(VolumeError::missing(path))?.len();
                        Ok(picture::read_page(path, *pages, 0, size, length)?.1)
                    }
                }
            }
        }
    }
}

/// Edges of a pixel by the tags of resolution, m, where they are no device's default.
fn believed(
    path: &Path,
    resolution: Option<Resolution>,
    doubts: &mut Vec<String>,
) -> Option<[f64; 2]> {
    match resolution? {
        Resolution::Edges(edges) => Some(edges),
        Resolution::Default(dots) => {
            // Of screens every program writes them.
            if dots > 96.0 {
                doubts.push(format!(
                    "{}: its tags say {dots} dots an inch, {:.4} mm a pixel: a default of scanners and editors, which is not believed; give the edge of a pixel",
                    path.display(),
                    25.4 / dots
                ));
            }
            None
        }
    }
}

/// Whether a TIFF has the high byte first.
fn is_big(path: &Path) -> Result<bool, VolumeError> {
    let (mut file, _) = picture::open_plain(path)?;
    let mut head = [0; 2];
    file.read_exact(&mut head).map_err(VolumeError::missing(path))?;
    Ok(head == *b"MM")
}

/// Counts the pages of a TIFF, which must be of one size.
fn count_pages(
    path: &Path,
    pages: &mut Pages,
    size: [usize; 2],
    length: u64,
) -> Result<usize, VolumeError> {
    let mut count = 1;
    while pages.more_images() {
        if count == MAX_SIDE {
            return Err(VolumeError::bad(
                path,
                format!("has more than {MAX_SIDE} pages, or its chain of pages is damaged"),
            ));
        }
        pages.next_image().map_err(picture::tiff_error(path, count))?;
        picture::same_size(path, count, picture::page_size(path, pages, count, length)?, size)?;
        count += 1;
    }
    Ok(count)
}

fn known_voxel(
    path: &Path,
    given: Option<[f64; 3]>,
    told: Option<[f64; 3]>,
) -> Result<[f64; 3], VolumeError> {
    let voxel = given
        .or(told)
        .ok_or_else(|| VolumeError::bad(path, "does not tell the size of a voxel; give it"))?;
    match voxel.iter().all(|v| v.is_finite() && (1e-12..1e3).contains(v)) {
        true => Ok(voxel),
        false => Err(VolumeError::bad(
            path,
            format!("the edges of a voxel are {voxel:?} m; they must be finite and above 0"),
        )),
    }
}

/// The pictures of a folder, or where there are none its DICOM files.
fn slices_in(folder: &Path) -> Result<Vec<PathBuf>, VolumeError> {
    let missing = VolumeError::missing(folder);
    let entries = std::fs::read_dir(folder).map_err(&missing)?;
    let mut files = entries
        .map(|entry| entry.map(|e| e.path()))
        .collect::<Result<Vec<_>, _>>()
        .map_err(&missing)?;
    files.sort_by(|a, b| natural(&a.to_string_lossy(), &b.to_string_lossy()));
    let is_picture = |p: &PathBuf| {
        let extension = p.extension().and_then(OsStr::to_str).unwrap_or_default();
        ["tif", "tiff", "png"].iter().any(|e| extension.eq_ignore_ascii_case(e))
    };
    let mut found: Vec<PathBuf> = files.iter().filter(|p| is_picture(p)).cloned().collect();
    if found.is_empty() {
        found.extend(files.into_iter().filter(|p| dicom::is_dicom(p)));
    }
    match found.is_empty() {
        true => Err(VolumeError::bad(
            folder,
            "holds no slices; expected .tif, .tiff or .png files, or a DICOM series",
        )),
        false => Ok(found),
    }
}

/// The order of people: numbers by their value, so that slice 10 follows slice 9.
fn natural(a: &str, b: &str) -> Ordering {
    let (mut a, mut b) = (a.as_bytes(), b.as_bytes());
    loop {
        let digits = |s: &[u8]| s.iter().take_while(|c| c.is_ascii_digit()).count();
        let (m, n) = (digits(a), digits(b));
        let order = if m > 0 && n > 0 {
            let strip =
                |s: &[u8]| s.iter().skip_while(|&&c| c == b'0').copied().collect::<Vec<_>>();
            let (x, y) = (strip(&a[..m]), strip(&b[..n]));
            (a, b) = (&a[m..], &b[n..]);
            x.len().cmp(&y.len()).then(x.cmp(&y)).then(m.cmp(&n))
        } else {
            match (a.split_first(), b.split_first()) {
                (Some((x, rest_a)), Some((y, rest_b))) => {
                    (a, b) = (rest_a, rest_b);
                    x.cmp(y)
                }
                (x, y) => return x.is_some().cmp(&y.is_some()),
            }
        };
        if order != Ordering::Equal {
            return order;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::natural;

    #[test]
    fn numbers_in_names_count_by_value() {
        let mut names = ["s10.tif", "s9.tif", "s009a.tif", "r100.tif", "s.tif"];
        names.sort_by(|a, b| natural(a, b));
        assert_eq!(names, ["r100.tif", "s.tif", "s9.tif", "s009a.tif", "s10.tif"]);
    }
}
