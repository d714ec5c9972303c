//! Sums that are never rounded: the same bits in whatever order, and in whatever parts, the numbers
//! are added.
//!
//! A shard of a work, a resumed work and the whole must agree to the last bit, and floating-point
//! addition does not know (a + b) + c from a + (b + c). So a sum is kept as one long whole number
//! that spans all of `f64` (Kulisch and Miranker 1981, the long accumulator), in limbs of 32 bits
//! whose carries are settled now and then (Neal 2015).

use serde::{Deserialize, Serialize};

/// Enough for 2^64 of the largest numbers.
const LIMBS: usize = 68;
/// Exponent of the first bit: the smallest number that there is.
const LOWEST: i32 = -1074;
/// A limb takes so many numbers of 32 bits before its carry must be settled.
const SETTLE: u32 = 1 << 30;

/// A sum of `f64` without any rounding.
///
/// ```
/// use intrados_transport::Exact;
/// let mut sum = Exact::default();
/// [1e300, 1.0, -1e300].into_iter().for_each(|x| sum.add(x));
/// assert_eq!(sum.value(), 1.0);
/// ```
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Exact {
    /// Of base 2^32, the least first. Settled: all but the last are in 0..2^32.
    limbs: Vec<i64>,
    /// Numbers taken since the carries were settled.
    pending: u32,
}

impl Default for Exact {
    fn default() -> Self {
        Self { limbs: vec![0; LIMBS], pending: 0 }
    }
}

impl PartialEq for Exact {
    fn eq(&self, other: &Self) -> bool {
        self.settled().limbs == other.settled().limbs
    }
}

impl Exact {
    /// Takes one number, which must be finite.
    pub fn add(&mut self, x: f64) {
        debug_assert!(x.is_finite());
        let bits = x.to_bits();
        let exponent = (bits >> 52 & 0x7ff) as i32;
        let fraction = bits & ((1 << 52) - 1);
        // Without the leading one below the normal numbers.
        let (mantissa, lowest) =
            if exponent == 0 { (fraction, -1074) } else { (fraction | 1 << 52, exponent - 1075) };
        let place = (lowest - LOWEST) as usize;
        let wide = u128::from(mantissa) << (place % 32);
        let sign = if x < 0.0 { -1 } else { 1 };
        for (k, limb) in self.limbs[place / 32..].iter_mut().take(3).enumerate() {
            *limb += sign * i64::from((wide >> (32 * k)) as u32);
        }
        self.pending += 1;
        if self.pending == SETTLE {
            self.settle();
        }
    }

    /// Takes all numbers of `other`.
    pub fn merge(&mut self, other: &Self) {
        self.settle();
        for (mine, theirs) in self.limbs.iter_mut().zip(&other.settled().limbs) {
            *mine += theirs;
        }
        self.settle();
    }

    /// The sum, rounded to a number; infinite beyond the largest.
    #[must_use]
    pub fn value(&self) -> f64 {
        let settled = self.settled();
        if settled.limbs.last().is_some_and(|&limb| limb < 0) {
            return -settled.negated().value();
        }
        // From the top: only the last additions round.
        let limbs = settled.limbs.iter().enumerate().rev().filter(|(_, limb)| **limb != 0);
        limbs.fold(0.0, |sum, (k, &limb)| sum + limb as f64 * power_of_two(LOWEST + 32 * k as i32))
    }

    /// The sum as a number and what is left beside it: some hundred bits.
    #[must_use]
    pub(crate) fn double(&self) -> [f64; 2] {
        let high = self.value();
        if !high.is_finite() {
            return [high, 0.0];
        }
        let mut rest = self.clone();
        rest.add(-high);
        [high, rest.value()]
    }

    /// Whether it can be: what comes from a file must pass.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        self.limbs.len() == LIMBS
            && self.pending < SETTLE
            && self.limbs.iter().all(|limb| limb.unsigned_abs() < 1 << 62)
            && self.value().is_finite()
    }

    fn settle(&mut self) {
        let mut carry = 0;
        let (last, lower) = self.limbs.split_last_mut().expect("a sum has limbs");
        for limb in lower {
            let all = *limb + carry;
            carry = all >> 32;
            *limb = all & 0xffff_ffff;
        }
        *last += carry;
        self.pending = 0;
    }

    fn settled(&self) -> Self {
        let mut settled = self.clone();
        settled.settle();
        settled
    }

    fn negated(mut self) -> Self {
        self.limbs.iter_mut().for_each(|limb| *limb = -*limb);
        self.settle();
        self
    }
}

/// 2^`exponent`, without rounding; infinite where no number is as large.
#[inline]
#[must_use]
pub fn power_of_two(exponent: i32) -> f64 {
    match exponent {
        1024.. => f64::INFINITY,
        -1022..1024 => f64::from_bits(((exponent + 1023) as u64) << 52),
        _ => f64::from_bits(1 << (exponent - LOWEST).max(0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use intrados_stage::random::Key;

    fn sum(xs: &[f64]) -> Exact {
        let mut sum = Exact::default();
        xs.iter().for_each(|&x| sum.add(x));
        sum
    }

    #[test]
    fn one_number_is_itself() {
        for x in [
            0.0,
            1.0,
            -1.0,
            1.5e-7,
            f64::MAX,
            -f64::MAX,
            f64::MIN_POSITIVE,
            5e-324,
            -5e-324,
            1e-310,
            -0.1,
        ] {
            assert_eq!(sum(&[x]).value(), x);
            assert_eq!(sum(&[x]).double(), [x, 0.0]);
            assert!(sum(&[x]).is_consistent());
        }
        assert_eq!(sum(&[f64::MAX, f64::MAX]).value(), f64::INFINITY);
        assert_eq!(sum(&[f64::MAX, f64::MAX, -f64::MAX]).value(), f64::MAX);
    }

    /// Of sizes from 1e-150 to 1e150 and both signs: any order, any parts, and taken away again
    /// nothing is left.
    #[test]
    fn order_and_parts_do_not_matter() {
        let xs: Vec<f64> = (0..2000)
            .map(|i| {
                let key = Key::new(8, i);
                (key.unit64(0) - 0.5) * 10_f64.powf(300.0 * key.unit64(1) - 150.0)
            })
            .collect();
        let forth = sum(&xs);
        let back = sum(&xs.iter().rev().copied().collect::<Vec<_>>());
        let mut parts = sum(&xs[..700]);
        parts.merge(&sum(&xs[700..701]));
        parts.merge(&sum(&xs[701..]));
        assert_eq!(forth, back);
        assert_eq!(forth, parts);
        let mut nothing = forth.clone();
        xs.iter().for_each(|x| nothing.add(-x));
        assert_eq!(nothing, Exact::default());
        assert_eq!(nothing.value(), 0.0);
    }

    #[test]
    fn what_rounding_leaves_is_kept_beside() {
        assert_eq!(sum(&[1.0, 2_f64.powi(-80)]).double(), [1.0, 2_f64.powi(-80)]);
        assert_eq!(sum(&[-1.0, 2_f64.powi(-80)]).double(), [-1.0, 2_f64.powi(-80)]);
    }
}
