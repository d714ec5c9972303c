//! Noise of a counting or integrating detector, every pixel from its own key.

use intrados_stage::random::Key;

/// Below this mean a Poisson number is drawn exactly.
const EXACT: f64 = 64.0;

/// A Poisson number of mean `mean`: by inversion below 64, else rounded from the Cornish–Fisher
/// expansion λ + √λ z + (z² − 1)/6, whose mean, variance and skewness are right to order 1/λ.
#[must_use]
pub(crate) fn poisson(mean: f64, key: Key, dimension: u32) -> f64 {
    if mean.is_nan() || mean <= 0.0 {
        return 0.0;
    }
    if mean >= EXACT {
        let z = key.normal(dimension);
        return (mean + mean.sqrt() * z + (z * z - 1.0) / 6.0).round().max(0.0);
    }
    let u = key.unit64(dimension);
    let (mut n, mut term) = (0.0, (-mean).exp());
    let mut sum = term;
    // 64 + 17 standard deviations: beyond, u cannot reach.
    while u > sum && n < 200.0 {
        n += 1.0;
        term *= mean / n;
        sum += term;
    }
    n
}

/// What a detector reads where `mean` photons are expected: Poisson counts and electronic noise of
/// `electronic` counts.
#[must_use]
pub fn counts(mean: f64, electronic: f64, key: Key) -> f64 {
    poisson(mean, key, 0) + electronic * key.normal(2)
}
