//! A U-Net of any size: the network that reads slices, and the one that reads photographs.
//!
//! Levels of resolution, two convolutions of 3 × 3 taps and rectifiers a level, the largest of four
//! on the way down, doubled pixels and the finer level's planes on the way up (Ronneberger et al.
//! 2015), and a last convolution without a rectifier. What is shown, what the outputs mean and what
//! they are trained on is the business of whoever uses it.

mod planes;
mod standard;
mod train;

use std::ops::Range;

use intrados_stage::{Cancelled, Job, random::Key};

pub use planes::{BLOCK, Planes, Spare};
pub use standard::Standardised;
pub use train::{Optimiser, Schedule, mean};

use planes::{TAPS, adjoint};

/// How large a network is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shape {
    /// Planes that it sees.
    pub inputs: usize,
    /// Planes of each level, the finest first: multiples of [`BLOCK`].
    pub levels: Vec<usize>,
    /// Planes that it gives, a multiple of [`BLOCK`].
    pub outputs: usize,
}

impl Shape {
    /// Inputs and outputs of each convolution: down, bottom, up, head.
    fn layers(&self) -> Vec<[usize; 2]> {
        let mut layers = Vec::new();
        let mut before = self.inputs;
        for &planes in &self.levels {
            layers.extend([[before, planes], [planes, planes]]);
            before = planes;
        }
        for &planes in self.levels.iter().rev().skip(1) {
            layers.extend([[before + planes, planes], [planes, planes]]);
            before = planes;
        }
        layers.push([before, self.outputs]);
        layers
    }

    /// Number of weights and biases.
    #[must_use]
    pub fn count(&self) -> usize {
        self.layers().into_iter().map(size).sum()
    }

    /// Sides of what is shown must be divisible by this, so that pixels pool alike.
    #[must_use]
    pub fn divisor(&self) -> usize {
        1 << (self.levels.len() - 1)
    }
}

/// Weights and biases of one layer.
const fn size([inputs, outputs]: [usize; 2]) -> usize {
    outputs * (inputs * TAPS + 1)
}

/// A U-Net and its weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Unet {
    shape: Shape,
    /// Inputs and outputs of each layer, and where its weights begin.
    layers: Vec<([usize; 2], usize)>,
    /// Weights `[output][input][tap]` and biases, layer by layer.
    weights: Vec<f32>,
}

/// Everything that passed through a network, which training needs again.
#[derive(Default)]
struct Passage {
    /// What entered each layer.
    inputs: Vec<Planes>,
    /// What left each layer.
    outputs: Vec<Planes>,
}

impl Unet {
    fn of(shape: Shape, weights: Vec<f32>) -> Self {
        let mut from = 0;
        let layers = shape.layers().into_iter().map(|layer| {
            from += size(layer);
            (layer, from - size(layer))
        });
        Self { layers: layers.collect(), shape, weights }
    }

    /// Untrained weights after He et al. (2015), which keep the size of signals through rectifiers.
    #[must_use]
    pub fn untrained(shape: Shape, seed: u64) -> Self {
        let mut weights = Vec::with_capacity(shape.count());
        let layers = shape.layers();
        for (layer, &[inputs, outputs]) in layers.iter().enumerate() {
            let key = Key::new(seed, 2 << 32 | layer as u64);
            let last = if layer + 1 == layers.len() { 0.3 } else { 1.0 };
            let sd = last * (2.0 / (inputs * TAPS) as f64).sqrt();
            weights
                .extend((0..inputs * outputs * TAPS).map(|i| (sd * key.normal(i as u32)) as f32));
            weights.extend(std::iter::repeat_n(0.0, outputs));
        }
        Self::of(shape, weights)
    }

    /// Reads little-endian floats; `None` if they are not as many as the shape needs, or not all
    /// finite.
    #[must_use]
    pub fn from_bytes(shape: Shape, bytes: &[u8]) -> Option<Self> {
        let (floats, rest) = bytes.as_chunks::<4>();
        let weights: Vec<f32> = floats.iter().map(|b| f32::from_le_bytes(*b)).collect();
        let whole = rest.is_empty() && weights.len() == shape.count();
        (whole && weights.iter().all(|w| w.is_finite())).then(|| Self::of(shape, weights))
    }

    /// The weights as little-endian floats.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        self.weights.iter().flat_map(|w| w.to_le_bytes()).collect()
    }

    /// How large it is.
    #[must_use]
    pub const fn shape(&self) -> &Shape {
        &self.shape
    }

    /// All weights and biases.
    #[must_use]
    pub fn weights(&self) -> &[f32] {
        &self.weights
    }

    /// The same, to be changed.
    pub fn weights_mut(&mut self) -> &mut [f32] {
        &mut self.weights
    }

    /// Where the weights and the biases of `layer` are.
    fn places(&self, layer: usize) -> [Range<usize>; 2] {
        let ([inputs, outputs], from) = self.layers[layer];
        let middle = from + inputs * outputs * TAPS;
        [from..middle, middle..middle + outputs]
    }

    /// What it makes of what is shown; the memory of what is no longer needed is spared.
    ///
    /// # Errors
    /// The job was cancelled, which is asked after every convolution.
    pub fn look(&self, seen: Planes, spare: &mut Spare, job: &Job) -> Result<Planes, Cancelled> {
        let mut passage = self.pass(seen, false, spare, job)?;
        Ok(passage.outputs.pop().unwrap_or_else(|| Planes::new(0, 0, 0)))
    }

    /// The loss of what it makes of `seen`, and its gradient by all weights; `loss` tells that of
    /// an output and the gradient by the output.
    pub fn gradient(
        &self,
        seen: Planes,
        loss: impl FnOnce(&Planes) -> (f32, Planes),
    ) -> (f32, Vec<f32>) {
        let job = Job::default();
        let passage = self.pass(seen, true, &mut Spare::default(), &job).unwrap_or_default();
        let Some(out) = passage.outputs.last() else { return (0.0, Vec::new()) };
        let (loss, gradient) = loss(out);
        (loss, self.learn(&passage, gradient))
    }

    /// One passage; all that passes is kept if `keep`.
    fn pass(
        &self,
        seen: Planes,
        keep: bool,
        spare: &mut Spare,
        job: &Job,
    ) -> Result<Passage, Cancelled> {
        let mut passage = Passage::default();
        let mut layer = 0;
        let mut convolve = |input: Planes, spare: &mut Spare| {
            if job.is_cancelled() {
                return Err(Cancelled);
            }
            let [weights, biases] = self.places(layer).map(|range| &self.weights[range]);
            layer += 1;
            let output = input.convolved(weights, biases, layer < self.layers.len(), spare);
            if keep {
                passage.inputs.push(input);
                passage.outputs.push(output.clone());
            } else {
                spare.give(input);
            }
            Ok(output)
        };
        let mut finer = Vec::with_capacity(self.shape.levels.len());
        let mut here = convolve(seen, spare)?;
        here = convolve(here, spare)?;
        for _ in 1..self.shape.levels.len() {
            let pooled = here.pooled(spare);
            finer.push(here);
            here = convolve(pooled, spare)?;
            here = convolve(here, spare)?;
        }
        while let Some(fine) = finer.pop() {
            let up = here.doubled_with(&fine, spare);
            [here, fine].into_iter().for_each(|done| spare.give(done));
            here = convolve(up, spare)?;
            here = convolve(here, spare)?;
        }
        let out = convolve(here, spare)?;
        if !keep {
            passage.outputs.push(out);
        }
        Ok(passage)
    }

    /// The gradient of the weights, given that of the last layer's output.
    fn learn(&self, passage: &Passage, gradient: Planes) -> Vec<f32> {
        let mut learnt = vec![0.0; self.weights.len()];
        let mut layer = self.layers.len();
        let mut back = |gradient: Planes| {
            layer -= 1;
            let [weights, biases] = self.places(layer);
            let gradient = if layer + 1 < self.layers.len() {
                gradient.where_positive(&passage.outputs[layer])
            } else {
                gradient
            };
            let (teach, rest) = learnt[weights.start..].split_at_mut(weights.len());
            passage.inputs[layer].teach(&gradient, teach, &mut rest[..biases.len()]);
            let ([inputs, outputs], _) = self.layers[layer];
            match layer {
                // Nobody asks what the picture should have been.
                0 => gradient,
                _ => gradient.convolved(
                    &adjoint(&self.weights[weights], inputs, outputs),
                    &vec![0.0; inputs],
                    false,
                    &mut Spare::default(),
                ),
            }
        };
        let coarsest = self.shape.levels.len() - 1;
        let mut aside = Vec::with_capacity(coarsest);
        let mut gradient = back(gradient);
        for level in 0..coarsest {
            gradient = back(gradient);
            let (up, to_finer) = back(gradient).parted(self.shape.levels[level + 1]);
            aside.push(to_finer);
            gradient = up.halved();
        }
        for level in (0..coarsest).rev() {
            gradient = back(gradient);
            gradient = back(gradient);
            gradient = passage.outputs[2 * level + 1].unpooled(&gradient);
            if let Some(to_finer) = aside.pop() {
                gradient.add(&to_finer);
            }
        }
        gradient = back(gradient);
        back(gradient);
        learnt
    }
}

#[cfg(test)]
mod tests;
