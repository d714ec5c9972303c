use glam::Vec3;
use intrados_transport::power_of_two;
use serde::{Deserialize, Serialize};

/// How many orders of the Neumann series (eq. 2.22) a film keeps apart: 0, 1, … and the last takes
/// all beyond.
pub const ORDERS: usize = 8;

/// The largest [`scale`](crate::LitScene::scale), either way: units of all moments are normal
/// numbers.
pub(crate) const LARGEST_SCALE: i32 = 120;
/// Bits below the scene's typical radiance that the first moments keep,
const FINE: i32 = 64;
/// those of the second moments below its square (a lamp of a millimetre in a hall is 2^35 times as
/// bright as its light on the walls),
const FINE_SQUARE: i32 = 50;
/// and those of the single orders.
const FINE_ORDER: i32 = 30;

/// First and second moments of every pixel, as sums, so that films add: as whole numbers of a small
/// unit, so that they add to the same bits in any order.
///
/// A primal walk belongs to one pixel, so each pixel counts its own; a dual walk may reach any, so
/// they share one count.
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
    /// Exponent of two of the scene's typical radiance: what the units below are set by.
    scale: i32,
    /// Per pixel and channel Σ x, in 2^([`scale`](Self::scale) − [`FINE`]), and Σ x², in 2^(2 scale
    /// − [`FINE_SQUARE`]).
    moments: Vec<[[i128; 3]; 2]>,
    /// Σ x per pixel and order; empty if the orders are not wanted. Of parts that are multiples of
    /// 2^(scale − [`FINE_ORDER`]): exact up to 2^23 of the scale.
    orders: Vec<[[f64; 3]; ORDERS]>,
}

/// `x` as a whole number of 2^`unit`; what is beyond all bounds is at the bound.
#[inline]
fn whole(x: f64, unit: i32) -> i128 {
    let bits = x.to_bits();
    let exponent = (bits >> 52 & 0x7ff) as i32;
    if exponent == 0 {
        return 0;
    }
    let mantissa = i128::from(bits & ((1 << 52) - 1) | 1 << 52);
    let shift = exponent - 1075 - unit;
    let size = match shift {
        74.. => i128::MAX,
        0..74 => mantissa << shift,
        -63..0 => mantissa >> -shift,
        _ => 0,
    };
    if x < 0.0 { -size } else { size }
}

impl Film {
    /// An empty film. `scale`: exponent of two of the scene's
    /// [typical radiance](crate::LitScene::scale). `own_counts`: every pixel has walks of its own
    /// (primal).
    #[must_use]
    pub fn new([width, height]: [u32; 2], scale: i32, own_counts: bool, with_orders: bool) -> Self {
        let n = width as usize * height as usize;
        Self {
            width,
            height,
            counts: if own_counts { vec![0; n] } else { Vec::new() },
            walks: 0,
            scale,
            // Asked for as zeros: the system hands out such memory untouched, and a restart costs
            // nothing.
            moments: vec![[[0; 3]; 2]; n],
            orders: if with_orders { vec![[[0.0; 3]; ORDERS]; n] } else { Vec::new() },
        }
    }

    /// Has the system give the film its memory now, which it else does when pixels are first
    /// written: some 50 ms for a large film.
    pub(crate) fn settle(&mut self) {
        std::hint::black_box(&mut self.counts).fill(0);
        std::hint::black_box(&mut self.moments).fill([[0; 3]; 2]);
        std::hint::black_box(&mut self.orders).fill([[0.0; 3]; ORDERS]);
    }

    /// Number of pixels.
    #[must_use]
    pub fn len(&self) -> usize {
        self.moments.len()
    }

    /// Whether it has no pixels.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.moments.is_empty()
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
        let units = [self.scale - FINE, 2 * self.scale - FINE_SQUARE];
        let [sums, squares] = &mut self.moments[pixel];
        for ((sum, square), x) in sums.iter_mut().zip(squares).zip(value.to_array()) {
            let x = f64::from(x);
            *sum = sum.saturating_add(whole(x, units[0]));
            *square = square.saturating_add(whole(x * x, units[1]));
        }
    }

    /// The part of order `order`.
    pub(crate) fn add_order(&mut self, pixel: usize, order: u32, value: Vec3) {
        if let Some(orders) = self.orders.get_mut(pixel) {
            // What is added to a number of 52 bits and taken away again is rounded to its last one.
            let coarse = 1.5 * power_of_two(52 + self.scale - FINE_ORDER);
            for (sum, x) in
                orders[(order as usize).min(ORDERS - 1)].iter_mut().zip(value.to_array())
            {
                *sum += (f64::from(x) + coarse) - coarse;
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

    /// Walks behind the pixel that has fewest.
    #[must_use]
    pub(crate) fn fewest_samples(&self) -> u64 {
        self.counts.iter().min().map_or(self.walks, |&n| u64::from(n))
    }

    /// Mean radiance of a pixel, W·m⁻²·sr⁻¹; 0 where no walk has been.
    #[must_use]
    pub fn mean(&self, pixel: usize) -> Vec3 {
        let n = self.samples(pixel).max(1) as f64;
        self.moments
            .get(pixel)
            .map_or(Vec3::ZERO, |[sum, _]| Vec3::from(sum.map(|s| (self.first(s) / n) as f32)))
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
        let [sum, square] = self.moments[pixel];
        let mean = self.first(sum[channel]) / n;
        let square = square[channel] as f64 * power_of_two(2 * self.scale - FINE_SQUARE);
        (square / n - mean * mean).max(0.0) / (n - 1.0)
    }

    /// A first moment as radiance.
    fn first(&self, sum: i128) -> f64 {
        sum as f64 * power_of_two(self.scale - FINE)
    }

    /// Mean of order `order` alone (the last takes all beyond); `None` if the orders were not kept,
    /// and beyond the film.
    #[must_use]
    pub fn order_mean(&self, pixel: usize, order: usize) -> Option<Vec3> {
        let n = self.samples(pixel).max(1) as f64;
        self.orders.get(pixel)?.get(order).map(|sum| Vec3::from(sum.map(|s| (s / n) as f32)))
    }

    /// Adds the walks of `other`. False, and nothing is done, if the two are not of one make.
    #[must_use]
    pub fn merge(&mut self, other: &Self) -> bool {
        let make = |film: &Self| {
            (film.width, film.height, film.scale, film.counts.len(), film.orders.len())
        };
        if make(self) != make(other) {
            return false;
        }
        self.walks += other.walks;
        self.counts.iter_mut().zip(&other.counts).for_each(|(a, b)| *a += b);
        for (a, b) in self.moments.as_flattened_mut().iter_mut().zip(other.moments.as_flattened()) {
            (0..3).for_each(|c| a[c] = a[c].saturating_add(b[c]));
        }
        for (a, b) in self.orders.as_flattened_mut().iter_mut().zip(other.orders.as_flattened()) {
            (0..3).for_each(|c| a[c] += b[c]);
        }
        true
    }

    /// Whether all parts have the sizes that the width and height ask for: what a film from a file
    /// must pass.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        let n = self.width as usize * self.height as usize;
        self.scale.abs() <= LARGEST_SCALE
            && self.moments.len() == n
            && (self.counts.is_empty() || self.counts.len() == n)
            && (self.orders.is_empty() || self.orders.len() == n)
    }

    /// Mean luminance over the pixels and its standard error, each pixel's walks being a stratum of
    /// their own: Var = Σ_p s²_p/n_p / pixels². `None` where a pixel has no walk, no error where
    /// one has only one. (The channels of a pixel are correlated: their errors are added as if
    /// fully so, which is exact for grey and never too small.)
    #[must_use]
    pub(crate) fn stratified(&self) -> Option<(f64, Option<f64>)> {
        let weights = [0.2126, 0.7152, 0.0722];
        let (mut mean, mut variance) = (0.0, 0.0);
        for pixel in 0..self.len() {
            let n = self.samples(pixel);
            if n == 0 {
                return None;
            }
            // Infinite below two walks.
            let spread: f64 = (0..3).map(|c| weights[c] * self.variance_of(pixel, c).sqrt()).sum();
            mean += (0..3).map(|c| weights[c] * self.first(self.moments[pixel][0][c])).sum::<f64>()
                / n as f64;
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
        for (own_counts, with_orders) in
            [(true, true), (true, false), (false, true), (false, false)]
        {
            let mut film = Film::new([4, 3], 0, own_counts, with_orders);
            film.count(24);
            film.add(11, Vec3::ONE);
            for pixel in [12, 13, usize::MAX] {
                assert_eq!(
                    (film.samples(pixel), film.mean(pixel), film.order_mean(pixel, 0)),
                    (0, Vec3::ZERO, None)
                );
                assert_eq!(film.variance(pixel), Vec3::INFINITY);
            }
            assert_eq!(film.order_mean(11, 0).is_some(), with_orders);
        }
    }
    /// Of walks that bring from 1e-9 to 1e9 of the scale: any split of them, in any order.
    #[test]
    fn films_add_to_the_same_bits() {
        use intrados_stage::random::Key;
        let walks: Vec<(usize, Vec3)> = (0..3000)
            .map(|i| {
                let key = Key::new(4, i);
                let size = 10_f32.powf(18.0 * key.unit64(1) as f32 - 9.0 - 12.0);
                (
                    (key.unit64(0) * 6.0) as usize,
                    Vec3::new(size, 0.3 * size, 1e-12 * key.unit64(2) as f32),
                )
            })
            .collect();
        let film = |walks: &mut dyn Iterator<Item = &(usize, Vec3)>| {
            let mut film = Film::new([3, 2], -40, true, false);
            walks.for_each(|&(pixel, value)| film.expose(pixel, value));
            film
        };
        let whole = film(&mut walks.iter());
        let mut merged = film(&mut walks.iter().skip(1).step_by(3));
        assert!(
            merged.merge(&film(&mut walks.iter().skip(2).step_by(3)))
                && merged.merge(&film(&mut walks.iter().step_by(3)))
        );
        assert_eq!(whole, merged);
        // And they are right: against sums in f64.
        for pixel in 0..6 {
            let of: Vec<f64> =
                walks.iter().filter(|w| w.0 == pixel).map(|w| f64::from(w.1.x)).collect();
            let n = of.len() as f64;
            let mean = of.iter().sum::<f64>() / n;
            let variance = of.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0) / n;
            assert!((f64::from(whole.mean(pixel).x) / mean - 1.0).abs() < 1e-6, "{pixel}");
            assert!((f64::from(whole.variance(pixel).x) / variance - 1.0).abs() < 1e-5, "{pixel}");
        }
    }

    #[test]
    fn a_number_is_whole_numbers_of_the_unit() {
        assert_eq!(
            [whole(1.0, 0), whole(-1.5, -1), whole(1.0, 1), whole(1e-300, -64), whole(0.0, -64)],
            [1, -3, 0, 0, 0]
        );
        assert_eq!([whole(1e300, 0), whole(-1e300, 0)], [i128::MAX, -i128::MAX]);
    }
}
