//! A small U-Net that tells matrix, pore, crack and steel apart, pixel by pixel.
//!
//! Three levels of resolution, two convolutions of 3 × 3 taps and rectifiers a level, the largest
//! of four on the way down, doubled pixels and the finer level's planes on the way up (Ronneberger
//! et al. 2015). It sees two planes: how far grey lies from that of sound concrete, and where the
//! body is. It was trained by [`train`] on the slices of [`simulate`], never on a real one;
//! `assets/network` holds the weights and how they came to be.

mod planes;
pub mod simulate;
pub mod train;

use std::{ops::Range, sync::LazyLock};

use intrados_stage::{Cancelled, Job};
use serde::{Deserialize, Serialize};

use intrados_raster::grid::{Grid, Mask};
use planes::{BLOCK, Planes, Spare, TAPS};

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
pub const CLASSES: usize = 4;
/// Planes that the network sees.
const CT: usize = 2;
/// Convolutions.
const LAYERS: usize = 11;
/// Sides must be divisible by this: two levels below the first.
const DIVISOR: usize = 4;
/// Edge of what is looked at in one go, pixels.
const TILE: usize = 768;
/// What is looked at around it: convolutions reach 2 + 4 + 8 + 4 + 2 + 1 = 21 pixels and pooling 3
/// more; a multiple of [`DIVISOR`], so that pixels pool alike.
const MARGIN: usize = 32;

/// The weights that the program carries, as little-endian floats, and how many planes the first
/// level has.
static CARRIED: &[u8] = include_bytes!("../../../../assets/network/unet.f32");

/// Weights of another network of this kind, for scans of members.
static MEMBER: &[u8] = include_bytes!("../../../../assets/network/member.f32");

/// The network for scans of members.
static OF_MEMBERS: LazyLock<Option<Network>> = LazyLock::new(|| Network::from_bytes(MEMBER));

/// The network that the program carries.
static BUILTIN: LazyLock<Option<Network>> = LazyLock::new(|| Network::from_bytes(CARRIED));

/// A trained network.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Planes of the first level; the second has twice, the third four times as many.
    base: usize,
    /// Weights `[output][input][tap]` and biases, layer by layer.
    weights: Vec<f32>,
}

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

/// Everything that passed through the network, which training needs again.
#[derive(Default)]
struct Passage {
    /// What entered each layer.
    inputs: Vec<Planes>,
    /// What left each layer.
    outputs: Vec<Planes>,
}

/// Inputs and outputs of the layers of a network whose first level has `base` planes: down, bottom,
/// up, head.
const fn shapes(base: usize) -> [[usize; 2]; LAYERS] {
    let [a, b, c] = [base, 2 * base, 4 * base];
    [
        [CT, a],
        [a, a],
        [a, b],
        [b, b],
        [b, c],
        [c, c],
        [c + b, b],
        [b, b],
        [b + a, a],
        [a, a],
        [a, CLASSES],
    ]
}

impl Network {
    /// The network that the program carries; `None` if its weights are damaged.
    #[must_use]
    pub fn builtin() -> Option<&'static Self> {
        BUILTIN.as_ref()
    }

    /// The network that the program carries for scans of members (`assets/network/member.ron`);
    /// `None` if its weights are damaged.
    #[must_use]
    pub fn of_members() -> Option<&'static Self> {
        OF_MEMBERS.as_ref()
    }

    /// Reads little-endian floats; how many there are tells the size of the network.
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let weights: Vec<f32> =
            bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        let base =
            (1..=16).map(|n| n * BLOCK).find(|&base| 4 * Self::count(base) == bytes.len())?;
        weights.iter().all(|w| w.is_finite()).then_some(Self { base, weights })
    }

    /// The weights as little-endian floats.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        self.weights.iter().flat_map(|w| w.to_le_bytes()).collect()
    }

    /// Number of weights and biases.
    #[must_use]
    pub const fn count(base: usize) -> usize {
        let (mut sum, mut i) = (0, 0);
        while i < LAYERS {
            let [inputs, outputs] = shapes(base)[i];
            sum += outputs * (inputs * TAPS + 1);
            i += 1;
        }
        sum
    }

    /// Where the weights and the biases of `layer` are.
    fn places(&self, layer: usize) -> [std::ops::Range<usize>; 2] {
        let shapes = shapes(self.base);
        let size = |[inputs, outputs]: [usize; 2]| outputs * (inputs * TAPS + 1);
        let from: usize = shapes[..layer].iter().map(|&s| size(s)).sum();
        let [inputs, outputs] = shapes[layer];
        let middle = from + inputs * outputs * TAPS;
        [from..middle, middle..middle + outputs]
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
        let Some(out) = self.pass_while(shown, false, spare, job)?.outputs.pop() else {
            return Ok(());
        };
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

    /// One passage that nobody waits for.
    fn pass(&self, seen: Planes, keep: bool) -> Passage {
        self.pass_while(seen, keep, &mut Spare::default(), &Job::default()).unwrap_or_default()
    }

    /// One passage; the memory of what is no longer needed is spared unless `keep`.
    fn pass_while(
        &self,
        seen: Planes,
        keep: bool,
        spare: &mut Spare,
        job: &Job,
    ) -> Result<Passage, Cancelled> {
        let mut passage = Passage { inputs: Vec::new(), outputs: Vec::new() };
        let mut layer = 0;
        let mut convolve = |input: Planes, spare: &mut Spare| {
            if job.is_cancelled() {
                return Err(Cancelled);
            }
            let [weights, biases] = self.places(layer).map(|range| &self.weights[range]);
            layer += 1;
            let output = input.convolved(weights, biases, layer < LAYERS, spare);
            if keep {
                passage.inputs.push(input);
                passage.outputs.push(output.clone());
            } else {
                spare.give(input);
            }
            Ok(output)
        };
        let fine = convolve(seen, spare)?;
        let fine = convolve(fine, spare)?;
        let middle = convolve(fine.pooled(spare), spare)?;
        let middle = convolve(middle, spare)?;
        let coarse = convolve(middle.pooled(spare), spare)?;
        let coarse = convolve(coarse, spare)?;
        let up = coarse.doubled_with(&middle, spare);
        [coarse, middle].into_iter().for_each(|done| spare.give(done));
        let up = convolve(up, spare)?;
        let half = convolve(up, spare)?;
        let up = half.doubled_with(&fine, spare);
        [half, fine].into_iter().for_each(|done| spare.give(done));
        let up = convolve(up, spare)?;
        let up = convolve(up, spare)?;
        let out = convolve(up, spare)?;
        if !keep {
            passage.outputs.push(out);
        }
        Ok(passage)
    }

    /// The gradient of the weights, given that of the last layer's output.
    fn learn(&self, passage: &Passage, gradient: Planes) -> Vec<f32> {
        let mut learnt = vec![0.0; self.weights.len()];
        let mut back = |layer: usize, gradient: Planes| {
            let [weights, biases] = self.places(layer);
            let gradient = if layer + 1 < LAYERS {
                gradient.where_positive(&passage.outputs[layer])
            } else {
                gradient
            };
            let (teach, rest) = learnt[weights.start..].split_at_mut(weights.len());
            passage.inputs[layer].teach(&gradient, teach, &mut rest[..biases.len()]);
            let [inputs, outputs] = shapes(self.base)[layer];
            match layer {
                // Nobody asks what the picture should have been.
                0 => gradient,
                _ => gradient.convolved(
                    &planes::adjoint(&self.weights[weights], inputs, outputs),
                    &vec![0.0; inputs],
                    false,
                    &mut Spare::default(),
                ),
            }
        };
        let [fine, middle, coarse] =
            [&passage.outputs[1], &passage.outputs[3], &passage.outputs[5]].map(Planes::planes);
        let gradient = back(10, gradient);
        let gradient = back(9, gradient);
        let (gradient, to_fine) = back(8, gradient).parted(2 * fine);
        let gradient = back(7, gradient.halved());
        let (gradient, to_middle) = back(6, gradient).parted(coarse);
        debug_assert_eq!(middle, 2 * fine, "a level has twice the planes of the one above");
        let gradient = back(5, gradient.halved());
        let gradient = back(4, gradient);
        let mut gradient = passage.outputs[3].unpooled(&gradient);
        gradient.add(&to_middle);
        let gradient = back(3, gradient);
        let gradient = back(2, gradient);
        let mut gradient = passage.outputs[1].unpooled(&gradient);
        gradient.add(&to_fine);
        let gradient = back(1, gradient);
        back(0, gradient);
        learnt
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
