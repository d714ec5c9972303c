//! Sections of a volume, across and along: one pass through its slices gives all of them.

use std::path::PathBuf;

use intrados_scene::AxisRuns;
use intrados_stage::Job;
use intrados_xray::volume::{Grid as Voxels, Reader, VolumeError, without_padding};

use intrados_raster::Grid;

use crate::slice::Slice;

/// Sections of a volume that are read across its pile of slices, and along it each way.
const ACROSS: usize = 9;
const ALONG: usize = 5;
/// Slices that lie farther apart than so many pixels show nothing along the pile.
const FARTHEST: f64 = 8.0;
/// Most pixels of all sections.
const MOST_PIXELS: usize = 1 << 28;

/// What a plane through a volume stands across.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Normal {
    /// What runs to the right in its slices.
    X,
    /// What runs down in them.
    Y,
    /// The pile of slices: a slice.
    Z,
}

/// A plane through a volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plane {
    /// What it stands across.
    pub normal: Normal,
    /// Where, as a share of the box of what is not air.
    pub share: f64,
}

impl Plane {
    /// The planes that are read of every volume.
    pub(crate) fn all() -> Vec<Self> {
        let of = |normal, count: usize| {
            (0..count).map(move |k| Self { normal, share: (k as f64 + 0.5) / count as f64 })
        };
        of(Normal::Z, ACROSS).chain(of(Normal::X, ALONG)).chain(of(Normal::Y, ALONG)).collect()
    }

    /// Which way the member's axis runs in the picture of this plane, where it runs `axis` in the
    /// pile of slices. Pictures along the pile have it downwards.
    pub(crate) fn axis(self, axis: AxisRuns) -> AxisRuns {
        use AxisRuns::{Down, Right, Through};
        match (self.normal, axis) {
            (Normal::Z, axis) => axis,
            (Normal::Y, Right) | (Normal::X, Down) => Right,
            (_, Through) => Down,
            (Normal::Y, Down) | (Normal::X, Right) => Through,
        }
    }
}

/// A section, and where it lies.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Section {
    /// Its picture.
    pub slice: Slice,
    /// From the middle of the volume to its own, to the right, down and through the pile, mm.
    pub from_middle_mm: [f64; 3],
}

/// A box of voxels, from and to (exclusive).
type Extent = [[usize; 2]; 3];

/// Cuts a volume along planes. Pictures along a pile of slices that lie farther apart than their
/// pixels are as coarse as that; none where they lie too far apart.
///
/// # Errors
/// The files are missing or damaged, or the job was cancelled.
pub(crate) fn sections(
    images: &[PathBuf],
    voxel_mm: Option<[f32; 3]>,
    planes: &[Plane],
    job: &Job,
) -> Result<Vec<Option<Section>>, VolumeError> {
    let voxel = voxel_mm.map(|edges| edges.map(|mm| 1e-3 * f64::from(mm)));
    let mut reader = Reader::pile(images.to_vec(), voxel)?;
    let grid = *reader.grid();
    let extent = extent(&mut reader)?;
    let mut cuts: Vec<Cut> = planes.iter().map(|p| Cut::new(*p, &grid, &extent)).collect();
    if cuts.iter().map(|c| c.picture.data.len()).sum::<usize>() > MOST_PIXELS {
        let why = "has too many voxels to be cut: bin them";
        return Err(VolumeError::bad(reader.path(), why));
    }
    for z in 0..grid.size[2] {
        job.step(z, grid.size[2])?;
        let mut layer = reader.read_slab(z..z + 1, &Job::default())?.data;
        without_padding(&mut layer, grid.size[0]);
        cuts.iter_mut().for_each(|cut| cut.take(z, &layer, grid.size[0]));
    }
    let name = reader.path().file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(cuts.into_iter().map(|cut| cut.section(&name, &grid)).collect())
}

/// A section that is being filled.
struct Cut {
    normal: Normal,
    /// Which layer of voxels.
    at: usize,
    picture: Grid<f32>,
}

impl Cut {
    fn new(plane: Plane, grid: &Voxels, extent: &Extent) -> Self {
        let [from, to] = extent[plane.normal as usize];
        let at = from + (plane.share * (to - from) as f64) as usize;
        let [width, height] = axes(plane.normal).map(|k| grid.size[k]);
        Self { normal: plane.normal, at, picture: Grid::new(width, height, 0.0) }
    }

    /// Takes what lies in it of slice `z`, whose rows are `width` long.
    fn take(&mut self, z: usize, slice: &[f32], width: usize) {
        let rows = self.picture.width;
        let row = self.picture.data.iter_mut().skip(z * rows).take(rows);
        match self.normal {
            Normal::Z if self.at == z => self.picture.data.copy_from_slice(slice),
            Normal::Z => {}
            Normal::Y => row.zip(&slice[self.at * width..]).for_each(|(to, from)| *to = *from),
            Normal::X => {
                let column = slice.iter().skip(self.at).step_by(width);
                row.zip(column).for_each(|(to, from)| *to = *from);
            }
        }
    }

    /// Its picture with square pixels; none where they are too long for that.
    fn section(self, file: &str, grid: &Voxels) -> Option<Section> {
        let mm = grid.voxel.map(|m| 1e3 * m);
        let (grey, pixel_mm) = squared(self.picture, axes(self.normal).map(|k| mm[k]))?;
        let k = self.normal as usize;
        let mut from_middle_mm = [0.0; 3];
        from_middle_mm[k] = (self.at as f64 - 0.5 * (grid.size[k] as f64 - 1.0)) * mm[k];
        let name = format!("{file}#{}{}", ["x", "y", "z"][k], self.at);
        Some(Section { slice: Slice { name, grey, pixel_mm: pixel_mm as f32 }, from_middle_mm })
    }
}

/// What runs to the right and down in a picture across `normal`.
fn axes(normal: Normal) -> [usize; 2] {
    match normal {
        Normal::X => [1, 2],
        Normal::Y => [0, 2],
        Normal::Z => [0, 1],
    }
}

/// The box of what is not air, as the slice in the middle shows it, and all of the pile.
fn extent(reader: &mut Reader) -> Result<Extent, VolumeError> {
    let [width, height, depth] = reader.grid().size;
    let mut layer = reader.read_slab(depth / 2..depth / 2 + 1, &Job::default())?.data;
    without_padding(&mut layer, width);
    // Concrete fills more than a tenth of a picture; half of its grey divides it from air.
    let mut sorted = layer.clone();
    let tenth = sorted.len() - 1 - sorted.len() / 10;
    let (_, bright, _) = sorted.select_nth_unstable_by(tenth, f32::total_cmp);
    let half = 0.5 * *bright;
    let mut count = [vec![0; width], vec![0; height]];
    for (i, _) in layer.iter().enumerate().filter(|(_, v)| **v > half) {
        count[0][i % width] += 1;
        count[1][i / width] += 1;
    }
    // Noise and rings in air are alone: where the body is, a row has many bright pixels.
    let range = |count: &[usize], across: usize| {
        let is_body = |n: &usize| *n > across / 50;
        let from = count.iter().position(is_body).unwrap_or(0);
        [from, count.iter().rposition(is_body).map_or(count.len(), |last| last + 1)]
    };
    Ok([range(&count[0], height), range(&count[1], width), [0, depth]])
}

/// The same picture with square pixels, as large as the longer edge of what they were: means over
/// areas, so that noise stays without correlation. None where the edges differ too much.
fn squared(picture: Grid<f32>, [x, y]: [f64; 2]) -> Option<(Grid<f32>, f64)> {
    let ratio = x / y;
    if (ratio - 1.0).abs() < 0.02 {
        return Some((picture, x));
    }
    if !(1.0 / FARTHEST..=FARTHEST).contains(&ratio) {
        return None;
    }
    Some(match ratio < 1.0 {
        true => (shrunk(&picture, 1.0 / ratio, true), y),
        false => (shrunk(&picture, ratio, false), x),
    })
}

/// Means over `by` pixels, which need not be whole, along rows or columns.
fn shrunk(picture: &Grid<f32>, by: f64, along_rows: bool) -> Grid<f32> {
    let (w, h) = (picture.width, picture.height);
    let shorter = |n: usize| ((n as f64 / by) as usize).max(1);
    let (width, height) = if along_rows { (shorter(w), h) } else { (w, shorter(h)) };
    let mut out = Grid::new(width, height, 0.0_f32);
    for (i, value) in out.data.iter_mut().enumerate() {
        let (u, v) = (i % width, i / width);
        let (at, count) = if along_rows { (u, w) } else { (v, h) };
        let (from, to) = (at as f64 * by, ((at + 1) as f64 * by).min(count as f64));
        let (mut sum, mut weight) = (0.0, 0.0);
        for k in from as usize..(to.ceil() as usize).min(count) {
            let share = (k as f64 + 1.0).min(to) - (k as f64).max(from);
            let pixel = if along_rows { v * w + k } else { k * w + u };
            sum += share * f64::from(picture.data[pixel]);
            weight += share;
        }
        *value = (sum / weight.max(1e-12)) as f32;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_know_which_way_the_axis_runs() {
        use AxisRuns::{Down, Right, Through};
        let of = |normal| [Right, Down, Through].map(|a| Plane { normal, share: 0.5 }.axis(a));
        assert_eq!(of(Normal::Z), [Right, Down, Through]);
        assert_eq!(of(Normal::Y), [Right, Through, Down]);
        assert_eq!(of(Normal::X), [Through, Right, Down]);
    }

    #[test]
    fn pixels_become_squares_by_their_areas() {
        let wide = Grid { width: 5, height: 2, data: (0..10).map(|v| v as f32).collect() };
        let (square, mm) = squared(wide, [0.2, 0.5]).unwrap();
        assert_eq!((square.width, square.height, mm), (2, 2, 0.5));
        // (0 + 1 + 2/2)/2.5, (2/2 + 3 + 4)/2.5 and the next row
        assert_eq!(square.data, [0.8, 3.2, 5.8, 8.2]);
        assert!(squared(Grid::new(2, 2, 0.0), [1.0, 9.0]).is_none());
    }
}
