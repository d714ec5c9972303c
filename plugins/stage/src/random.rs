//! Random numbers without a state: each is a hash of (seed, walk, dimension).
//!
//! The hash is `lowbias32` (Chris Wellons, "Prospecting for hash functions", 2018) applied twice
//! with two keys, which keeps the streams of different walks apart where one 32-bit Weyl stream
//! would overlap. It costs a nanosecond, and any single walk can be replayed alone.

/// Two 32-bit keys: the identity of one walk under one seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Key(pub u32, pub u32);

/// `splitmix64` finaliser (Steele, Lea, Flood 2014).
#[inline]
const fn mix64(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[inline]
const fn lowbias32(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

impl Key {
    /// The key of walk `walk` under `seed`.
    ///
    /// ```
    /// use intrados_stage::random::Key;
    /// let u = Key::new(7, 12_345).unit(3);
    /// assert_eq!(u, Key::new(7, 12_345).unit(3)); // no state: any number can be asked for again
    /// assert!((0.0..1.0).contains(&u));
    /// ```
    #[inline]
    #[must_use]
    pub const fn new(seed: u64, walk: u64) -> Self {
        let k = mix64(mix64(seed) ^ walk);
        Self((k >> 32) as u32, k as u32)
    }

    /// The key of copy `copy` of this walk at event `event`, where a walk splits.
    #[inline]
    #[must_use]
    pub const fn split(self, event: u32, copy: u32) -> Self {
        Self::new(
            (self.0 as u64) << 32 | self.1 as u64,
            (event as u64) << 32 | copy as u64 | 1 << 63,
        )
    }

    /// 32 random bits.
    #[inline]
    #[must_use]
    pub const fn bits(self, dimension: u32) -> u32 {
        lowbias32(lowbias32(dimension.wrapping_mul(0x9e37_79b9).wrapping_add(self.0)) ^ self.1)
    }

    /// Uniform in [0, 1), on 24 bits.
    #[inline]
    #[must_use]
    pub const fn unit(self, dimension: u32) -> f32 {
        (self.bits(dimension) >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// Two uniform numbers, dimensions `dimension` and `dimension + 1`.
    #[inline]
    #[must_use]
    pub const fn pair(self, dimension: u32) -> [f32; 2] {
        [self.unit(dimension), self.unit(dimension.wrapping_add(1))]
    }

    /// Uniform in [0, 1), on 53 bits, from dimensions `dimension` and `!dimension`.
    #[inline]
    #[must_use]
    pub const fn unit64(self, dimension: u32) -> f64 {
        let bits = (self.bits(dimension) as u64) << 32 | self.bits(!dimension) as u64;
        (bits >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
    }

    /// N(0, 1), from dimensions `dimension`, `dimension + 1` and their complements.
    #[inline]
    #[must_use]
    pub fn normal(self, dimension: u32) -> f64 {
        gauss([self.unit64(dimension), self.unit64(dimension + 1)])
    }
}

/// Numbers of one key, drawn one after the other.
#[derive(Debug, Clone, Copy)]
pub struct Draw {
    key: Key,
    next: u32,
    coarse: bool,
}

impl Draw {
    /// The numbers of `key`.
    #[must_use]
    pub const fn new(key: Key) -> Self {
        Self { key, next: 0, coarse: false }
    }

    /// The numbers of `key` on 24 bits, as [`Key::unit`] has them: half the work where nobody sees
    /// more.
    #[must_use]
    pub const fn coarse(key: Key) -> Self {
        Self { key, next: 0, coarse: true }
    }

    /// The next one, uniform in [0, 1).
    #[must_use]
    pub const fn unit(&mut self) -> f64 {
        self.next += 1;
        if self.coarse { self.key.unit(self.next) as f64 } else { self.key.unit64(self.next) }
    }

    /// Uniform between two bounds.
    #[must_use]
    pub const fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform in the logarithm, between two positive bounds.
    #[must_use]
    pub fn log_between(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    /// A whole number from `low` to `high`, either included.
    #[must_use]
    pub const fn count(&mut self, low: usize, high: usize) -> usize {
        low + ((high + 1 - low) as f64 * self.unit()) as usize
    }

    /// True with probability `share`.
    #[must_use]
    pub const fn chance(&mut self, share: f64) -> bool {
        self.unit() < share
    }

    /// N(0, 1).
    #[must_use]
    pub fn normal(&mut self) -> f64 {
        let [u, v] = [self.unit(), self.unit()];
        gauss([u, v])
    }
}

/// N(0, 1) of two uniform numbers (Box and Muller 1958).
fn gauss([u, v]: [f64; 2]) -> f64 {
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// χ² over 16×16 cells of pairs from neighbouring walks, dimensions and seeds. 255 degrees of
    /// freedom: mean 255, sd 22.6; 4.5 sd for each of the three tests, false alarm below 1e-4 (the
    /// keys are fixed, so it either passes always or never).
    #[test]
    fn pairs_are_uniform_and_uncorrelated() {
        let n = 1 << 20;
        let draws: [fn(u64) -> [f32; 2]; 3] = [
            |i| Key::new(1, i).pair(0),
            |i| [Key::new(1, i).unit(5), Key::new(1, i + 1).unit(5)],
            |i| [Key::new(1, i).unit(9), Key::new(2, i).unit(9)],
        ];
        for draw in draws {
            let mut count = [0_u32; 256];
            for i in 0..n {
                let [a, b] = draw(i);
                count[(a * 16.0) as usize * 16 + (b * 16.0) as usize] += 1;
            }
            let expected = n as f64 / 256.0;
            let chi2: f64 =
                count.iter().map(|&c| (f64::from(c) - expected).powi(2) / expected).sum();
            assert!((chi2 - 255.0).abs() < 4.5 * 22.6, "chi2 = {chi2}");
        }
    }

    #[test]
    fn sixty_four_bit_numbers_fill_the_unit_interval() {
        let n = 1 << 18;
        let mean = (0..n).map(|i| Key::new(3, i).unit64(2)).sum::<f64>() / n as f64;
        assert!((mean - 0.5).abs() < 4.0 * (1.0 / 12.0_f64).sqrt() / (n as f64).sqrt());
    }
}
