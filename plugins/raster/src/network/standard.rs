//! Standardised weights (Qiao et al. 2019, scaled as by Brock et al. 2021): while it is trained,
//! every output of a convolution has weights without mean and of one spread, times a gain. Signals
//! keep their size through all levels, and deep ones learn, as with normalised batches, but nothing
//! of it is left in the network that comes out.

use super::{Shape, TAPS, Unet};

/// What keeps the spread of signals through rectifiers: √(2 / (1 − 1/π)).
const GAIN: f32 = 1.713;
/// Added to the variance of weights.
const LEAST: f32 = 1e-10;

/// A network in training.
#[derive(Debug, Clone, PartialEq)]
pub struct Standardised {
    /// Its untrained weights tell the shape; the last layer's and all biases are used as they are.
    network: Unet,
    /// Weights and biases as the network has them, then a gain for each output but the last
    /// layer's.
    parameters: Vec<f32>,
}

impl Standardised {
    /// An untrained one.
    #[must_use]
    pub fn new(shape: Shape, seed: u64) -> Self {
        let network = Unet::untrained(shape, seed);
        let gains = network.layers.iter().rev().skip(1).map(|([_, outputs], _)| outputs).sum();
        let mut parameters = network.weights().to_vec();
        parameters.extend(std::iter::repeat_n(GAIN, gains));
        Self { network, parameters }
    }

    /// What is trained.
    #[must_use]
    pub fn parameters(&self) -> &[f32] {
        &self.parameters
    }

    /// The same, to be changed.
    pub fn parameters_mut(&mut self) -> &mut [f32] {
        &mut self.parameters
    }

    /// Where the weights of every standardised output are, and its gain.
    fn outputs(&self) -> impl Iterator<Item = (std::ops::Range<usize>, usize)> {
        let layers = self.network.layers.len() - 1;
        let all = self.network.layers[..layers].iter().flat_map(|&([inputs, outputs], from)| {
            let size = inputs * TAPS;
            (0..outputs).map(move |o| from + o * size..from + (o + 1) * size)
        });
        all.zip(self.network.weights().len()..)
    }

    /// The network as it is now.
    #[must_use]
    pub fn network(&self) -> Unet {
        let mut network = self.network.clone();
        let count = network.weights().len();
        network.weights_mut().copy_from_slice(&self.parameters[..count]);
        for (range, gain) in self.outputs() {
            let raw = &self.parameters[range.clone()];
            let (mean, spread) = moments(raw);
            let scale = self.parameters[gain] / ((raw.len() as f32).sqrt() * spread);
            let weights = &mut network.weights_mut()[range];
            weights.iter_mut().for_each(|w| *w = (*w - mean) * scale);
        }
        network
    }

    /// The gradient by what is trained, of that by the network's weights.
    #[must_use]
    pub fn gradient(&self, by_weights: &[f32]) -> Vec<f32> {
        let mut gradient = by_weights.to_vec();
        gradient.resize(self.parameters.len(), 0.0);
        for (range, gain) in self.outputs() {
            let raw = &self.parameters[range.clone()];
            let n = raw.len() as f32;
            let (mean, spread) = moments(raw);
            let unit = |v: f32| (v - mean) / spread;
            let by = &by_weights[range.clone()];
            let sum: f32 = by.iter().sum();
            let along: f32 = by.iter().zip(raw).map(|(g, &v)| g * unit(v)).sum();
            gradient[gain] = along / n.sqrt();
            let scale = self.parameters[gain] / (n.sqrt() * spread);
            for (g, &v) in gradient[range].iter_mut().zip(raw) {
                *g = scale * (*g - sum / n - unit(v) * along / n);
            }
        }
        gradient
    }
}

/// Mean and standard deviation.
fn moments(values: &[f32]) -> (f32, f32) {
    let n = values.len() as f32;
    let mean = values.iter().sum::<f32>() / n;
    let variance = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f32>() / n;
    (mean, (variance + LEAST).sqrt())
}
