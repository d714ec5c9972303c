//! Damage that is seen in a photograph: which pixels show a crack, missing cover, bared steel,
//! rust, efflorescence.
//!
//! Two small U-Nets look at the picture, one for cracks first of all and one for all else. They
//! were trained by [`train`] on rendered pictures alone ([`lesson`]): no photograph was shown to
//! them, and only the thresholds of cracks were chosen on some. `assets/photo` holds the
//! weights and how they came to be.

mod camera;
pub mod lesson;
mod outline;
mod sample;
mod scales;
mod sight;
pub mod train;

use std::sync::LazyLock;

use glam::Vec3;
use intrados_assets::photo as assets;
use intrados_raster::{
    Grid, Mask,
    network::{Planes, Shape, Spare, Unet},
};
use intrados_stage::{Cancelled, Job};

use scales::{SCALES, SMALLEST, halved, together};
use sight::{CELL, PIXELS, PLANES, Sight};

/// A kind of damage that is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Mark {
    /// A crack.
    Crack,
    /// Missing cover.
    Spall,
    /// Bared steel.
    Steel,
    /// Rust on the face.
    Rust,
    /// Efflorescence on the face.
    Efflorescence,
}

impl Mark {
    /// All of them, in the order of the network's planes.
    pub const ALL: [Self; MARKS] =
        [Self::Crack, Self::Spall, Self::Steel, Self::Rust, Self::Efflorescence];
}

/// Kinds of damage.
const MARKS: usize = 5;

/// Planes of each level of the carried network.
const LEVELS: [usize; 4] = [16, 32, 48, 64];
/// Edge of what is looked at in one go, pixels.
const TILE: usize = 1024;
/// What is looked at around it, a multiple of what pools alike: convolutions and pooling reach 59
/// cells.
const MARGIN: usize = 128;

static BUILTIN: LazyLock<Option<Reader>> = LazyLock::new(|| {
    let [cracks, areas] =
        [assets::CRACKS, assets::AREAS].map(|bytes| Network::from_bytes(&LEVELS, bytes));
    Some(Reader { cracks: cracks?, areas: areas? })
});

/// A trained network.
#[derive(Debug, Clone, PartialEq)]
pub struct Network(Unet);

/// What reads damage.
#[derive(Debug, Clone, PartialEq)]
pub struct Reader {
    /// What finds cracks, and helps with all else.
    pub cracks: Network,
    /// What was trained for all else.
    pub areas: Network,
}

/// How probable each kind of damage is, pixel by pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Marks {
    grids: [Grid<f32>; MARKS],
}

impl Marks {
    /// How probable a kind of damage is, in [0, 1].
    #[must_use]
    pub fn of(&self, mark: Mark) -> &Grid<f32> {
        &self.grids[mark as usize]
    }

    /// Where there are cracks.
    #[must_use]
    pub fn cracks(&self) -> Mask {
        outline::lines(self.of(Mark::Crack), outline::CRACKS)
    }

    /// Where there is damage of a kind. With the carried weights most of bared steel and of rust is
    /// found, a quarter of missing cover, a tenth of efflorescence.
    #[must_use]
    pub fn areas(&self, mark: Mark) -> Mask {
        match mark {
            Mark::Crack => self.cracks(),
            _ => outline::areas(self.of(mark), outline::sure(mark)),
        }
    }
}

/// Reads damage in linear light of any scale with the network that the program carries; what is
/// not `known` shows none. Pixels should be some tenths to some millimetres on the face.
///
/// # Errors
/// The job was cancelled.
pub fn marks(light: &Grid<Vec3>, known: &Mask, job: &Job) -> Result<Marks, Cancelled> {
    match Reader::builtin() {
        Some(reader) => reader.marks(light, known, job),
        None => Ok(none(light.width, light.height)),
    }
}

fn none(width: usize, height: usize) -> Marks {
    Marks { grids: std::array::from_fn(|_| Grid::new(width, height, 0.0)) }
}

fn shape(levels: &[usize]) -> Shape {
    Shape { inputs: PLANES * PIXELS, levels: levels.to_vec(), outputs: MARKS * PIXELS }
}

impl Network {
    /// Reads weights, little-endian floats, of a network with so many planes a level.
    #[must_use]
    pub fn from_bytes(levels: &[usize], bytes: &[u8]) -> Option<Self> {
        Unet::from_bytes(shape(levels), bytes).map(Self)
    }

    /// The weights as little-endian floats.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        self.0.to_bytes()
    }

    /// How probable some kinds are, pixel by pixel; what is not `known` shows none.
    fn look<const N: usize>(
        &self,
        sight: &Sight,
        known: &Mask,
        wanted: [Mark; N],
        tile: usize,
        job: &Job,
    ) -> Result<[Grid<f32>; N], Cancelled> {
        let [width, height] = sight.size();
        let mut grids = wanted.map(|_| Grid::new(width, height, 0.0));
        let mut spare = Spare::default();
        for y in (0..height).step_by(tile) {
            for x in (0..width).step_by(tile) {
                let (out, first) = self.tile(sight, [x, y], tile, &mut spare, job)?;
                for (mark, grid) in wanted.iter().zip(&mut grids) {
                    for v in y..(y + tile).min(height) {
                        let row = &mut grid.data[v * width..][..width];
                        for (u, value) in row.iter_mut().enumerate().skip(x).take(tile) {
                            let score = score(&out, *mark as usize, [u - first[0], v - first[1]]);
                            *value = 1.0 / (1.0 + (-score).exp());
                        }
                    }
                }
                spare.give(out);
            }
        }
        for grid in &mut grids {
            let unknown = grid.data.iter_mut().zip(&known.data).filter(|(_, known)| !**known);
            unknown.for_each(|(v, _)| *v = 0.0);
        }
        Ok(grids)
    }

    /// What the network says of the tile whose top left is at `from`, and of which pixel first.
    fn tile(
        &self,
        sight: &Sight,
        from: [usize; 2],
        tile: usize,
        spare: &mut Spare,
        job: &Job,
    ) -> Result<(Planes, [usize; 2]), Cancelled> {
        let size = sight.size();
        let first = from.map(|at| at.saturating_sub(MARGIN));
        let cells = [0, 1].map(|k| {
            let last = (from[k] + tile + MARGIN).min(size[k]);
            (last - first[k]).div_ceil(CELL).next_multiple_of(self.0.shape().divisor())
        });
        Ok((self.0.look(sight.cells(first, cells), spare, job)?, first))
    }
}

impl Reader {
    /// The networks that the program carries; `None` if their weights are damaged.
    #[must_use]
    pub fn builtin() -> Option<&'static Self> {
        BUILTIN.as_ref()
    }

    /// Reads damage in linear light of any scale; what is not `known` shows none.
    ///
    /// # Errors
    /// The job was cancelled.
    pub fn marks(&self, light: &Grid<Vec3>, known: &Mask, job: &Job) -> Result<Marks, Cancelled> {
        self.marks_by(TILE, light, known, job)
    }

    /// Cracks from all views; all else, which is broader, as it is and by both networks: they err at
    /// other places.
    fn marks_by(
        &self,
        tile: usize,
        light: &Grid<Vec3>,
        known: &Mask,
        job: &Job,
    ) -> Result<Marks, Cancelled> {
        let sight = Sight::new(light, known, job)?;
        let [_, others @ ..] = Mark::ALL;
        let [near, of_one @ ..] = self.cracks.look(&sight, known, Mark::ALL, tile, job)?;
        let of_other = self.areas.look(&sight, known, others, tile, job)?;
        let (mut looks, mut farther) = (vec![near], halved(light, known));
        while looks.len() < SCALES && farther.0.width.min(farther.0.height) >= SMALLEST {
            let (light, known) = &farther;
            let sight = Sight::new(light, known, job)?;
            looks.extend(self.cracks.look(&sight, known, [Mark::Crack], tile, job)?);
            farther = halved(light, known);
        }
        let areas = of_one.iter().zip(&of_other).map(|(one, other)| agreed(one, other));
        let mut grids = std::iter::once(together(looks, known)).chain(areas);
        let empty = || Grid::new(0, 0, 0.0);
        Ok(Marks { grids: std::array::from_fn(|_| grids.next().unwrap_or_else(empty)) })
    }
}

/// What two networks say together: the mean of their logits.
fn agreed(one: &Grid<f32>, other: &Grid<f32>) -> Grid<f32> {
    let mean = |(a, b): (&f32, &f32)| {
        let [is, is_not] = [a * b, (1.0 - a) * (1.0 - b)].map(f32::sqrt);
        is / (is + is_not).max(1e-12)
    };
    let data = one.data.iter().zip(&other.data).map(mean).collect();
    Grid { width: one.width, height: one.height, data }
}

/// What the network says of a mark at a pixel.
fn score(out: &Planes, mark: usize, [x, y]: [usize; 2]) -> f32 {
    out.row(mark * PIXELS + y % CELL * CELL + x % CELL, y / CELL)[x / CELL]
}

#[cfg(test)]
mod tests;
