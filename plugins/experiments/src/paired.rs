//! Is one method better than another on the same cases? Wilcoxon's signed ranks (1945), exactly.

/// Two-sided p-value of paired differences: the probability, were all signs left to chance, of a
/// sum of ranks at least as far from its mean. Zeros are left out, ties share their mean rank. 1
/// where nothing differs.
#[must_use]
pub(crate) fn wilcoxon(differences: &[f64]) -> f64 {
    let mut sorted: Vec<f64> =
        differences.iter().copied().filter(|d| *d != 0.0 && d.is_finite()).collect();
    sorted.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let n = sorted.len();
    if n == 0 {
        return 1.0;
    }
    // Twice the ranks, so that shared ones are whole numbers.
    let mut ranks = vec![0_usize; n];
    let mut from = 0;
    while from < n {
        let to = (from..n).find(|&i| sorted[i].abs() != sorted[from].abs()).unwrap_or(n);
        ranks[from..to].fill(from + to + 1);
        from = to;
    }
    let all: usize = ranks.iter().sum();
    let positive: usize =
        ranks.iter().zip(&sorted).filter(|(_, d)| **d > 0.0).map(|(r, _)| *r).sum();
    // Ways to each sum, over 2ⁿ.
    let mut share = vec![0.0_f64; all + 1];
    share[0] = 1.0;
    for rank in &ranks {
        for sum in (0..=all).rev() {
            share[sum] = 0.5 * (share[sum] + if sum >= *rank { share[sum - rank] } else { 0.0 });
        }
    }
    let far = (2 * positive).abs_diff(all);
    (0..=all)
        .filter(|sum| (2 * sum).abs_diff(all) >= far)
        .map(|sum| share[sum])
        .sum::<f64>()
        .min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Known values: all of n differences positive, 2/2ⁿ; Wilcoxon's own table: n = 10, smaller sum
    /// 8, p = .0488 (two-sided); with ties, n = 3 of ranks 1.5, 1.5, 3 and the largest negative:
    /// sums at most 3 or at least 3: all eight.
    #[test]
    fn values_of_the_book() {
        assert!((wilcoxon(&[1.0, 2.0, 3.0, 4.0, 5.0]) - 2.0 / 32.0).abs() < 1e-12);
        let ten: Vec<f64> =
            (1..=10).map(|i| if i == 3 || i == 5 { -f64::from(i) } else { f64::from(i) }).collect();
        assert!((wilcoxon(&ten) - 50.0 / 1024.0).abs() < 1e-12, "{}", wilcoxon(&ten));
        assert_eq!(wilcoxon(&[1.0, 1.0, -2.0]), 1.0);
        assert_eq!(wilcoxon(&[0.0, 0.0]), 1.0);
        assert!((wilcoxon(&[0.0, -1.0, -2.0]) - 0.5).abs() < 1e-12);
    }
}
