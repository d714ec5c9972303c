//! Volumes and sinograms: what they are, and how they come from files and go to them.
//!
//! A [`Volume`] is a box of voxels `[z][y][x]`, a [`Sinogram`] a stack of projections
//! `[view][row][bin]`. Both are large, so files are read and written by slabs of slices
//! ([`Reader::read_slab`], [`Writer::write_slab`]): 1024³ voxels never need to be in memory at
//! once.

mod dicom;
mod metaimage;
mod padding;
mod picture;
mod read;
mod write;

use std::{
    ops::Range,
    path::{Path, PathBuf},
};

use intrados_stage::Job;
pub use padding::without_padding;
pub use read::Reader;
pub use write::{Depth, Writer};

/// The largest volume in each direction, in voxels.
pub(crate) const MAX_SIDE: usize = 16_384;

/// Where the voxels of a volume are. x is fastest, then y, then z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Number of voxels in x, y and z.
    pub size: [usize; 3],
    /// Edges of a voxel, m.
    pub voxel: [f64; 3],
    /// Centre of the first voxel, m. The axis of rotation of a scanner is the z axis.
    pub origin: [f64; 3],
}

impl Grid {
    /// A grid whose middle is the origin of space.
    #[must_use]
    pub fn centred(size: [usize; 3], voxel: [f64; 3]) -> Self {
        Self {
            size,
            voxel,
            origin: std::array::from_fn(|k| -0.5 * (size[k] as f64 - 1.0) * voxel[k]),
        }
    }

    /// Number of voxels.
    #[must_use]
    pub fn len(&self) -> usize {
        self.size.iter().product()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Voxels of a slice.
    #[must_use]
    pub fn slice_len(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// The slices `z` alone.
    #[must_use]
    pub fn slab(&self, z: Range<usize>) -> Self {
        let mut slab = *self;
        slab.size[2] = z.len();
        slab.origin[2] += z.start as f64 * self.voxel[2];
        slab
    }

    /// Coordinate of the centre of voxel `i` along `axis`, m.
    #[must_use]
    pub fn at(&self, axis: usize, i: usize) -> f64 {
        self.origin[axis] + i as f64 * self.voxel[axis]
    }
}

/// Voxel values on a grid: attenuation per metre where nothing else is said.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume {
    /// Where the voxels are.
    pub grid: Grid,
    /// One value a voxel, `[z][y][x]`.
    pub data: Vec<f32>,
}

impl Volume {
    /// All voxels zero.
    #[must_use]
    pub fn zeros(grid: Grid) -> Self {
        Self { grid, data: vec![0.0; grid.len()] }
    }

    /// Slice `z`, `[y][x]`; empty where there is none.
    #[must_use]
    pub fn slice(&self, z: usize) -> &[f32] {
        let n = self.grid.slice_len();
        self.data.get(z * n..(z + 1) * n).unwrap_or_default()
    }
}

/// How rays run from the tube to the detector. Lengths in metres.
///
/// At angle θ the detector's u axis is (cos θ, sin θ, 0), its v axis is z, and the central ray runs
/// along (−sin θ, cos θ, 0).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Beam {
    /// All rays of a view are parallel; detector rows are slices.
    Parallel,
    /// A fan in each slice, from a source line parallel to the axis.
    Fan {
        /// From the source to the axis.
        source_axis: f64,
        /// From the axis to the detector.
        axis_detector: f64,
        /// Bins of equal angle on an arc around the source (pixel size measured along the arc)
        /// instead of equal width on a line.
        curved: bool,
    },
    /// A cone from a point source on a circle to a flat panel.
    Cone {
        /// From the source to the axis.
        source_axis: f64,
        /// From the axis to the panel.
        axis_detector: f64,
    },
}

impl Beam {
    /// How much larger things on the axis look on the detector.
    #[must_use]
    pub fn magnification(&self) -> f64 {
        match *self {
            Self::Parallel => 1.0,
            Self::Fan { source_axis, axis_detector, .. }
            | Self::Cone { source_axis, axis_detector } => {
                (source_axis + axis_detector) / source_axis
            }
        }
    }
}

/// Where the rays of a scan ran.
#[derive(Debug, Clone, PartialEq)]
pub struct Orbit {
    /// How rays run.
    pub beam: Beam,
    /// Angle of each view, rad.
    pub angles: Vec<f64>,
    /// Detector rows (v) and bins in a row (u).
    pub detector: [usize; 2],
    /// Edges of a detector pixel, along u and along v, m.
    pub pixel: [f64; 2],
    /// The bin and the row, counted in fractions from the centre of the first, that the axis and
    /// the plane of the source fall on.
    pub centre: [f64; 2],
}

impl Orbit {
    /// `views` equally spaced angles over `arc` (rad, its end left out) with the axis in the middle
    /// of the detector.
    #[must_use]
    pub fn circle(
        beam: Beam,
        views: usize,
        arc: f64,
        [rows, bins]: [usize; 2],
        pixel: [f64; 2],
    ) -> Self {
        let angles = (0..views).map(|i| arc * i as f64 / views as f64).collect();
        Self {
            beam,
            angles,
            detector: [rows, bins],
            pixel,
            centre: [0.5 * (bins as f64 - 1.0), 0.5 * (rows as f64 - 1.0)],
        }
    }

    /// Number of views.
    #[must_use]
    pub fn views(&self) -> usize {
        self.angles.len()
    }

    /// Number of detector rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.detector[0]
    }

    /// Number of bins in a row.
    #[must_use]
    pub fn bins(&self) -> usize {
        self.detector[1]
    }

    /// The same with the detector rows `rows` alone.
    #[must_use]
    pub(crate) fn rows_only(&self, rows: Range<usize>) -> Self {
        let centre = [self.centre[0], self.centre[1] - rows.start as f64];
        Self { detector: [rows.len(), self.bins()], centre, ..self.clone() }
    }

    /// Number of rays.
    #[must_use]
    pub fn len(&self) -> usize {
        self.views() * self.rows() * self.bins()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Line integrals of attenuation (no unit), `[view][row][bin]`, with the rays they belong to.
#[derive(Debug, Clone, PartialEq)]
pub struct Sinogram {
    /// Where the rays ran.
    pub orbit: Orbit,
    /// One value a ray.
    pub data: Vec<f32>,
}

impl Sinogram {
    /// All rays zero.
    #[must_use]
    pub fn zeros(orbit: Orbit) -> Self {
        let data = vec![0.0; orbit.len()];
        Self { orbit, data }
    }

    /// The detector rows `rows` of a scan along `orbit`, from a file whose pages are views (x =
    /// bin, y = row), or with `by_row` sinograms of one row each (x = bin, y = view). Needs memory
    /// for these rows alone.
    ///
    /// # Errors
    /// The file does not have the size of the orbit or is damaged, or the job was cancelled.
    pub fn read(
        reader: &mut Reader,
        orbit: &Orbit,
        by_row: bool,
        rows: Range<usize>,
        job: &Job,
    ) -> Result<Self, VolumeError> {
        let (views, bins, all) = (orbit.views(), orbit.bins(), orbit.rows());
        let (expected, order) = if by_row {
            ([bins, views, all], "bins × views × rows")
        } else {
            ([bins, all, views], "bins × rows × views")
        };
        if reader.grid().size != expected || rows.end > all || rows.is_empty() {
            let found = by(reader.grid().size);
            return Err(VolumeError::bad(
                reader.path(),
                format!("holds {found}; the scan has {} ({order})", by(expected)),
            ));
        }
        let mut sinogram = Self::zeros(orbit.rows_only(rows.clone()));
        if by_row {
            for (k, row) in rows.clone().enumerate() {
                job.step(k, rows.len())?;
                let page = reader.read_slab(row..row + 1, &Job::default())?;
                let lines = sinogram.data.chunks_mut(bins).skip(k).step_by(rows.len());
                lines.zip(page.data.chunks(bins)).for_each(|(to, from)| to.copy_from_slice(from));
            }
        } else {
            for (view, to) in sinogram.data.chunks_mut(rows.len() * bins).enumerate() {
                job.step(view, views)?;
                let page = reader.read_slab(view..view + 1, &Job::default())?;
                to.copy_from_slice(&page.data[rows.start * bins..rows.end * bins]);
            }
        }
        Ok(sinogram)
    }

    /// All rows of a view.
    #[must_use]
    pub fn view(&self, view: usize) -> &[f32] {
        let n = self.orbit.rows() * self.orbit.bins();
        self.data.get(view * n..(view + 1) * n).unwrap_or_default()
    }

    /// The sinogram of detector row `row`, `[view][bin]`.
    #[must_use]
    pub fn row(&self, row: usize) -> Vec<f32> {
        let (rows, bins) = (self.orbit.rows(), self.orbit.bins());
        let line = |view: usize| {
            self.data
                .get((view * rows + row) * bins..(view * rows + row + 1) * bins)
                .unwrap_or_default()
        };
        (0..self.orbit.views()).flat_map(line).copied().collect()
    }
}

/// Why a volume could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum VolumeError {
    /// The file is not there, or the system does not let us.
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
    /// Somebody asked the work to stop.
    #[error(transparent)]
    Cancelled(#[from] intrados_stage::Cancelled),
}

impl VolumeError {
    /// Whether the file was absent or unreadable, rather than damaged.
    #[must_use]
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::Missing { .. })
    }

    /// `path` is not what it should be.
    #[must_use]
    pub fn bad(path: &Path, reason: impl Into<String>) -> Self {
        Self::Bad { path: path.to_owned(), reason: reason.into() }
    }

    pub(crate) fn missing(path: &Path) -> impl Fn(std::io::Error) -> Self {
        move |source| Self::Missing { path: path.to_owned(), source }
    }
}

/// "3 × 4 × 5".
fn by<const N: usize>(size: [usize; N]) -> String {
    size.map(|n| n.to_string()).join(" × ")
}

#[cfg(test)]
mod tests;
