//! Sections of a volume, across and along: one pass through its slices gives all of them.

use std::path::PathBuf;

use intrados_scene::AxisRuns;
use intrados_stage::Job;
use intrados_xray::volume::{Grid as Voxels, Reader, VolumeError};

use crate::{grid::Grid, slice::Slice};

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
    let cuts: Vec<(Normal, usize)> = planes
        .iter()
        .map(|p| {
            let [from, to] = extent[p.normal as usize];
            (p.normal, from + (p.share * (to - from) as f64) as usize)
        })
        .collect();
    let mut pictures: Vec<Grid<f32>> =
        cuts.iter().map(|(normal, _)| blank(&grid, *normal)).collect();
    if pictures.iter().map(|p| p.data.len()).sum::<usize>() > MOST_PIXELS {
        let why = "has too many voxels to be cut: bin them";
        return Err(VolumeError::bad(reader.path(), why));
    }
    let [width, _, depth] = grid.size;
    for z in 0..depth {
        job.step(z, depth)?;
        let layer = reader.read_slab(z..z + 1, &Job::default())?.data;
        for ((normal, at), picture) in cuts.iter().zip(&mut pictures) {
            let row = |picture: &mut Grid<f32>, values: &mut dyn Iterator<Item = f32>| {
                let row = picture.data.iter_mut().skip(z * picture.width);
                row.zip(values).for_each(|(to, from)| *to = from);
            };
            match normal {
                Normal::Z if *at == z => picture.data.copy_from_slice(&layer),
                Normal::Z => {}
                Normal::Y => row(picture, &mut layer[at * width..(at + 1) * width].iter().copied()),
                Normal::X => row(picture, &mut layer.iter().skip(*at).step_by(width).copied()),
            }
        }
    }
    let name = reader.path().file_name().unwrap_or_default().to_string_lossy().into_owned();
    let cut = |((normal, at), picture): ((Normal, usize), Grid<f32>)| {
        let mm = grid.voxel.map(|m| 1e3 * m);
        let [x, y] = axes(normal).map(|k| mm[k]);
        let (grey, pixel_mm) = squared(picture, [x, y])?;
        let label = ["x", "y", "z"][normal as usize];
        let mut from_middle_mm = [0.0; 3];
        let k = normal as usize;
        from_middle_mm[k] = (at as f64 - 0.5 * (grid.size[k] as f64 - 1.0)) * mm[k];
        let slice = Slice { name: format!("{name}#{label}{at}"), grey, pixel_mm: pixel_mm as f32 };
        Some(Section { slice, from_middle_mm })
    };
    Ok(cuts.into_iter().zip(pictures).map(cut).collect())
}

/// What runs to the right and down in a picture across `normal`.
fn axes(normal: Normal) -> [usize; 2] {
    match normal {
        Normal::X => [1, 2],
        Normal::Y => [0, 2],
        Normal::Z => [0, 1],
    }
}

fn blank(grid: &Voxels, normal: Normal) -> Grid<f32> {
    let [width, height] = axes(normal).map(|k| grid.size[k]);
    Grid::new(width, height, 0.0)
}

/// The box of what is not air, as the slice in the middle shows it, and all of the pile.
fn extent(reader: &mut Reader) -> Result<Extent, VolumeError> {
    let [width, height, depth] = reader.grid().size;
    let layer = reader.read_slab(depth / 2..depth / 2 + 1, &Job::default())?.data;
    // Concrete fills more than a tenth of a picture; half of its grey divides it from air.
    let mut sorted = layer.clone();
    let tenth = sorted.len() - 1 - sorted.len() / 10;
    let (_, bright, _) = sorted.select_nth_unstable_by(tenth, f32::total_cmp);
    let (half, mut range) = (0.5 * *bright, [[usize::MAX, 0]; 2]);
    // Noise and rings in air are alone: a column or row of the body has many bright pixels.
    let mut count = [vec![0; width], vec![0; height]];
    for (i, _) in layer.iter().enumerate().filter(|(_, v)| **v > half) {
        count[0][i % width] += 1;
        count[1][i / width] += 1;
    }
    for (range, (count, across)) in range.iter_mut().zip(count.iter().zip([height, width])) {
        let inside = |n: &&(usize, &usize)| *n.1 > across / 50;
        count.iter().enumerate().collect::<Vec<_>>().iter().filter(inside).for_each(|(i, _)| {
            *range = [range[0].min(*i), range[1].max(i + 1)];
        });
    }
    let whole = |[from, to]: [usize; 2], all| if from < to { [from, to] } else { [0, all] };
    Ok([whole(range[0], width), whole(range[1], height), [0, depth]])
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
