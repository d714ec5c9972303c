use glam::Vec3;
use serde::{Deserialize, Serialize};

/// How many orders of the Neumann series (eq. 2.22) a film keeps apart: 0, 1, … and the last takes all beyond.
pub const ORDERS: usize = 8;

/// First and second moments of every pixel, as sums, so that films add.
///
/// A primal walk belongs to one pixel, so each pixel counts its own; a dual walk may reach any, so they share one count.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Film {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Walks per pixel, empty if all pixels share `walks`.
    counts: Vec<u32>,
    /// All walks.
    walks: u64,
    /// Σ x per pixel and channel.
    sum: Vec<[f64; 3]>,
    /// Σ x².
    square: Vec<[f64; 3]>,
    /// Σ x per order and pixel; empty if the orders are not wanted.
    orders: Vec<Vec<[f32; 3]>>,
}

impl Film {
    /// An empty film. `own_counts`: every pixel has walks of its own (primal).
    #[must_use]
    pub fn new(width: u32, height: u32, own_counts: bool, with_orders: bool) -> Self {
        let n = width as usize * height as usize;
        Self {
            width,
            height,
            counts: if own_counts { vec![0; n] } else { Vec::new() },
            walks: 0,
            sum: vec![[0.0; 3]; n],
            square: vec![[0.0; 3]; n],
            // Each asked for as zeros, not copied from the first: the system hands out such memory untouched, and a restart costs nothing.
            orders: if with_orders { (0..ORDERS).map(|_| vec![[0.0; 3]; n]).collect() } else { Vec::new() },
        }
    }

    /// Has the system give the film its memory now, which it else does when pixels are first written: some 50 ms for a large film.
    pub(crate) fn settle(&mut self) {
        std::hint::black_box(&mut self.counts).fill(0);
        [&mut self.sum, &mut self.square].into_iter().for_each(|moment| std::hint::black_box(moment).fill([0.0; 3]));
        self.orders.iter_mut().for_each(|order| std::hint::black_box(order).fill([0.0; 3]));
    }

    /// Number of pixels.
    #[must_use]
    pub fn len(&self) -> usize {
        self.sum.len()
    }

    /// Whether it has no pixels.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.sum.is_empty()
    }

    /// Whether the orders are kept apart.
    #[must_use]
    pub fn has_orders(&self) -> bool {
        !self.orders.is_empty()
    }

    /// All walks that went into it.
    #[must_use]
    pub fn walks(&self) -> u64 {
        self.walks
    }

    /// Mean walks per pixel.
    #[must_use]
    pub fn samples_per_pixel(&self) -> f64 {
        self.walks as f64 / self.len().max(1) as f64
    }

    /// Counts `walks` walks that may reach any pixel.
    pub(crate) fn count(&mut self, walks: u64) {
        self.walks += walks;
    }

    /// One walk of pixel `pixel` (primal), zero or not.
    pub(crate) fn expose(&mut self, pixel: usize, value: Vec3) {
        self.walks += 1;
        self.counts[pixel] += 1;
        self.add(pixel, value);
    }

    /// What one walk brought to `pixel` in all.
    pub(crate) fn add(&mut self, pixel: usize, value: Vec3) {
        for (channel, x) in value.to_array().into_iter().enumerate() {
            let x = f64::from(x);
            self.sum[pixel][channel] += x;
            self.square[pixel][channel] += x * x;
        }
    }

    /// The part of order `order`.
    pub(crate) fn add_order(&mut self, pixel: usize, order: u32, value: Vec3) {
        if let Some(image) = self.orders.get_mut((order as usize).min(ORDERS - 1)) {
            for (channel, x) in value.to_array().into_iter().enumerate() {
                image[pixel][channel] += x;
            }
        }
    }

    /// Walks behind pixel `pixel`; beyond the film no walk has ever been.
    #[must_use]
    pub fn samples(&self, pixel: usize) -> u64 {
        match self.counts.get(pixel) {
            Some(&n) => u64::from(n),
            None if self.counts.is_empty() && pixel < self.len() => self.walks,
            None => 0,
        }
    }

    /// Mean radiance of a pixel, W·m⁻²·sr⁻¹; 0 where no walk has been.
    #[must_use]
    pub fn mean(&self, pixel: usize) -> Vec3 {
        let n = self.samples(pixel).max(1) as f64;
        self.sum.get(pixel).map_or(Vec3::ZERO, |sum| Vec3::from(sum.map(|s| (s / n) as f32)))
    }

    /// Variance of that mean; infinite below two walks.
    #[must_use]
    pub fn variance(&self, pixel: usize) -> Vec3 {
        Vec3::from([0, 1, 2].map(|c| self.variance_of(pixel, c) as f32))
    }

    fn variance_of(&self, pixel: usize, channel: usize) -> f64 {
        let n = self.samples(pixel) as f64;
        if n < 2.0 {
            return f64::INFINITY;
        }
        let mean = self.sum[pixel][channel] / n;
        (self.square[pixel][channel] / n - mean * mean).max(0.0) / (n - 1.0)
    }

    /// Mean of order `order` alone (the last takes all beyond); `None` if the orders were not kept, and beyond the film.
    #[must_use]
    pub fn order_mean(&self, pixel: usize, order: usize) -> Option<Vec3> {
        let n = self.samples(pixel).max(1) as f32;
        self.orders.get(order)?.get(pixel).map(|&sum| Vec3::from(sum) / n)
    }

    /// Adds the walks of `other`. False, and nothing is done, if the two are not of one make.
    #[must_use]
    pub fn merge(&mut self, other: &Self) -> bool {
        if (self.width, self.height, self.counts.len(), self.orders.len())
            != (other.width, other.height, other.counts.len(), other.orders.len())
        {
            return false;
        }
        self.walks += other.walks;
        self.counts.iter_mut().zip(&other.counts).for_each(|(a, b)| *a += b);
        let add = |a: &mut [[f64; 3]], b: &[[f64; 3]]| a.iter_mut().zip(b).for_each(|(a, b)| (0..3).for_each(|c| a[c] += b[c]));
        add(&mut self.sum, &other.sum);
        add(&mut self.square, &other.square);
        for (a, b) in self.orders.iter_mut().zip(&other.orders) {
            a.iter_mut().zip(b).for_each(|(a, b)| (0..3).for_each(|c| a[c] += b[c]));
        }
        true
    }

    /// Whether all parts have the sizes that the width and height ask for: what a film from a file must pass.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        let n = self.width as usize * self.height as usize;
        self.sum.len() == n
            && self.square.len() == n
            && (self.counts.is_empty() || self.counts.len() == n)
            && (self.orders.is_empty() || self.orders.len() == ORDERS && self.orders.iter().all(|o| o.len() == n))
    }

    /// Mean luminance over the pixels and its standard error, each pixel's walks being a stratum of their own:
    /// Var = Σ_p s²_p/n_p / pixels². `None` where a pixel has no walk, no error where one has only one. (The channels of a pixel are
    /// correlated: their errors are added as if fully so, which is exact for grey and never too small.)
    #[must_use]
    pub fn stratified(&self) -> Option<(f64, Option<f64>)> {
        let weights = [0.2126, 0.7152, 0.0722];
        let (mut mean, mut variance) = (0.0, 0.0);
        for pixel in 0..self.len() {
            let n = self.samples(pixel);
            if n == 0 {
                return None;
            }
            // Infinite below two walks.
            let spread: f64 = (0..3).map(|c| weights[c] * self.variance_of(pixel, c).sqrt()).sum();
            mean += (0..3).map(|c| weights[c] * self.sum[pixel][c]).sum::<f64>() / n as f64;
            variance += spread * spread;
        }
        let n = self.len() as f64;
        Some((mean / n, Some(variance.sqrt() / n).filter(|e| e.is_finite())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of every make: what looks at a film may hold a pixel of another one.
    #[test]
    fn beyond_the_film_nothing_is_known() {
        for (own_counts, with_orders) in [(true, true), (true, false), (false, true), (false, false)] {
            let mut film = Film::new(4, 3, own_counts, with_orders);
            film.count(24);
            film.add(11, Vec3::ONE);
            for pixel in [12, 13, usize::MAX] {
                assert_eq!((film.samples(pixel), film.mean(pixel), film.order_mean(pixel, 0)), (0, Vec3::ZERO, None));
                assert_eq!(film.variance(pixel), Vec3::INFINITY);
            }
            assert_eq!(film.order_mean(11, 0).is_some(), with_orders);
        }
    }
}
