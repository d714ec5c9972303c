//! A small U-Net that tells matrix, pore, crack and steel apart, pixel by pixel.
//!
//! An [`Unet`] of three levels of resolution. It sees two planes: how far grey lies from that of
//! sound concrete, and where the body is. It was trained by [`train`] on the slices of
//! [`simulate`], never on a real one; `assets/ct` holds the weights and how they came to be.

pub mod simulate;
pub mod train;

use std::{ops::Range, sync::LazyLock};

use intrados_assets::ct as assets;
use intrados_stage::{Cancelled, Job};
use serde::{Deserialize, Serialize};

use intrados_raster::{
    grid::{Grid, Mask},
    network::{BLOCK, Planes, Shape, Spare, Unet},
};

/// What a pixel can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Class {
    /// Mortar and aggregate.
    Matrix,
    /// A void with air or water.
    Pore,
    /// A crack.
    Crack,
    /// Reinforcement.
    Steel,
}

/// Number of classes.
pub(crate) const CLASSES: usize = 4;
/// Planes that the network sees.
const CT: usize = 2;
/// Sides must be divisible by this: two levels below the first.
const DIVISOR: usize = 4;
/// Edge of what is looked at in one go, pixels.
const TILE: usize = 768;
/// What is looked at around it: convolutions reach 2 + 4 + 8 + 4 + 2 + 1 = 21 pixels and pooling 3
/// more; a multiple of [`DIVISOR`], so that pixels pool alike.
const MARGIN: usize = 32;

/// The network for scans of members.
static OF_MEMBERS: LazyLock<Option<Network>> =
    LazyLock::new(|| Network::from_bytes(assets::MEMBERS));

/// The network that the program carries.
static BUILTIN: LazyLock<Option<Network>> = LazyLock::new(|| Network::from_bytes(assets::CORES));

/// A trained network.
#[derive(Debug, Clone, PartialEq)]
pub struct Network(Unet);

/// How probable each class is, pixel by pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Opinion {
    /// One picture a class, in the order of [`Class`].
    pub classes: [Grid<f32>; CLASSES],
}

impl Opinion {
    /// How probable `class` is.
    #[must_use]
    pub fn of(&self, class: Class) -> &Grid<f32> {
        &self.classes[class as usize]
    }
}

/// A network whose first level has `base` planes; the second has twice, the third four times as
/// many.
fn shape(base: usize) -> Shape {
    Shape { inputs: CT, levels: vec![base, 2 * base, 4 * base], outputs: CLASSES }
}

impl Network {
    /// The network that the program carries; `None` if its weights are damaged.
    #[must_use]
    pub fn builtin() -> Option<&'static Self> {
        BUILTIN.as_ref()
    }

    /// The network that the program carries for scans of members (`assets/ct/member.ron`);
    /// `None` if its weights are damaged.
    #[must_use]
    pub fn of_members() -> Option<&'static Self> {
        OF_MEMBERS.as_ref()
    }

    /// Reads little-endian floats; how many there are tells the size of the network.
    #[must_use]
    pub(crate) fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let base =
            (1..=16).map(|n| n * BLOCK).find(|&base| 4 * Self::count(base) == bytes.len())?;
        Unet::from_bytes(shape(base), bytes).map(Self)
    }

    /// The weights as little-endian floats.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        self.0.to_bytes()
    }

    /// Number of weights and biases.
    #[must_use]
    pub fn count(base: usize) -> usize {
        shape(base).count()
    }

    /// What the network thinks of a slice: `grey` relative to sound concrete, `seen` what lies
    /// inside the specimen's outline and was measured. Large slices are looked at in tiles that
    /// overlap by more than a pixel's neighbourhood in the network, so that memory does not grow
    /// with them.
    ///
    /// # Errors
    /// The job was cancelled, which is asked after every convolution of a tile.
    pub fn look(&self, grey: &Grid<f32>, seen: &Mask, job: &Job) -> Result<Opinion, Cancelled> {
        let [w, h] = [grey.width, grey.height];
        let mut opinion = Opinion { classes: [(); CLASSES].map(|()| Grid::new(w, h, 0.0_f32)) };
        // What nobody saw is left as matrix.
        opinion.classes[Class::Matrix as usize].data.fill(1.0);
        let mut spare = Spare::default();
        for y0 in (0..h).step_by(TILE) {
            for x0 in (0..w).step_by(TILE) {
                if let Some(part) = of_body(seen, [x0, y0]) {
                    self.look_at(part, grey, seen, &mut opinion, &mut spare, job)?;
                }
            }
        }
        Ok(opinion)
    }

    /// Fills one part of an opinion, columns and rows.
    fn look_at(
        &self,
        [across, down]: [Range<usize>; 2],
        grey: &Grid<f32>,
        seen: &Mask,
        opinion: &mut Opinion,
        spare: &mut Spare,
        job: &Job,
    ) -> Result<(), Cancelled> {
        let w = grey.width;
        let around = |part: &Range<usize>, side: usize| {
            part.start.saturating_sub(MARGIN)..(part.end + MARGIN).min(side)
        };
        let (xs, ys) = (around(&across, w), around(&down, grey.height));
        let (width, height) =
            (xs.len().next_multiple_of(DIVISOR), ys.len().next_multiple_of(DIVISOR));
        let mut shown = Planes::of_spare(CT, width, height, spare);
        for (row, y) in ys.clone().enumerate() {
            let at = y * w + xs.start..y * w + xs.end;
            show(&grey.data[at.clone()], &seen.data[at], |plane, x, v| {
                shown.row_mut(plane, row)[x] = v
            });
        }
        let out = self.0.look(shown, spare, job)?;
        for y in down {
            let rows: [&[f32]; CLASSES] = std::array::from_fn(|c| out.row(c, y - ys.start));
            for x in across.clone() {
                let p = softmax(rows.map(|row| row[x - xs.start]));
                opinion.classes.iter_mut().zip(p).for_each(|(class, p)| class.data[y * w + x] = p);
            }
        }
        spare.give(out);
        Ok(())
    }
}

/// The smallest part of the tile at `x0`, `y0` that holds all pixels of the body in it, from places
/// where pixels pool as they do in the whole; `None` of a tile in the air.
fn of_body(seen: &Mask, [x0, y0]: [usize; 2]) -> Option<[Range<usize>; 2]> {
    let (x1, y1) = ((x0 + TILE).min(seen.width), (y0 + TILE).min(seen.height));
    let row = |y: usize| &seen.data[y * seen.width + x0..y * seen.width + x1];
    let inside = |y: &usize| row(*y).contains(&true);
    let (top, bottom) = ((y0..y1).find(inside)?, (y0..y1).rfind(inside)?);
    let left = (top..=bottom).filter_map(|y| row(y).iter().position(|&v| v)).min()?;
    let right = (top..=bottom).filter_map(|y| row(y).iter().rposition(|&v| v)).max()?;
    let pooled = |at: usize| at - at % DIVISOR;
    Some([pooled(x0 + left)..x0 + right + 1, pooled(top)..bottom + 1])
}

/// What the network sees of a row: (grey − 1)/.15 within −5 and 4, and the body.
fn show(grey: &[f32], solid: &[bool], mut put: impl FnMut(usize, usize, f32)) {
    for (x, (&v, &inside)) in grey.iter().zip(solid).enumerate() {
        if inside {
            put(0, x, ((v - 1.0) / 0.15).clamp(-5.0, 4.0));
            put(1, x, 1.0);
        }
    }
}

/// Probabilities that are proportional to the exponentials of `scores`.
fn softmax(scores: [f32; CLASSES]) -> [f32; CLASSES] {
    let top = scores.into_iter().fold(f32::NEG_INFINITY, f32::max);
    let powers = scores.map(|s| (s - top).exp());
    let sum: f32 = powers.iter().sum();
    powers.map(|p| p / sum)
}
