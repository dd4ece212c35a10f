//! Tests of whether one sample tends to be greater than another.

/// Samples up to this size without ties are compared exactly; the counts of arrangements are then exact in an `f64`.
const EXACT_UP_TO: usize = 25;

/// What a two-sided Mann-Whitney U test says of two samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MannWhitney {
    /// Pairs in which the first sample is greater; a tie counts one half.
    pub u: f64,
    /// Probability of a `u` at least this far from its mean if both samples come from one distribution.
    pub p: f64,
    /// Cliff's delta, −1 to 1: share of pairs in which the first is greater, less the share in which it is smaller.
    pub delta: f64,
    /// Whether `p` counts arrangements; otherwise it is the normal approximation, with correction for ties and continuity.
    pub exact: bool,
}

/// Two-sided Mann-Whitney U test: exact for up to 25 samples a side without ties, else the normal approximation.
///
/// Nothing if a sample is empty or holds a NaN.
///
/// # Examples
/// ```
/// let test = tpg_tasks::stats::mann_whitney(&[6.0, 7.0, 8.0], &[1.0, 2.0, 3.0]).unwrap();
/// assert!(test.exact && (test.p - 0.1).abs() < 1e-12);
/// ```
#[must_use]
pub fn mann_whitney(a: &[f64], b: &[f64]) -> Option<MannWhitney> {
    if a.is_empty() || b.is_empty() || a.iter().chain(b).any(|x| x.is_nan()) {
        return None;
    }
    let pairs = a.len() as f64 * b.len() as f64;
    let u = wins(a, b);
    let u_greater = u.max(pairs - u);
    let ties = tie_sizes(a, b);
    let exact = a.len().max(b.len()) <= EXACT_UP_TO && ties.is_empty();
    let p = if exact {
        exact_p(u_greater, a.len(), b.len())
    } else {
        asymptotic_p(u_greater, a.len(), b.len(), &ties)
    };
    Some(MannWhitney {
        u,
        p,
        delta: 2.0 * u / pairs - 1.0,
        exact,
    })
}

/// Smallest p-value that a two-sided Mann-Whitney U test of `n` and `m` samples without ties can reach: `2 / C(n + m, n)`.
#[must_use]
pub fn smallest_p(n: usize, m: usize) -> f64 {
    let arrangements: f64 = (1..=n).map(|i| (m + i) as f64 / i as f64).product();
    (2.0 / arrangements).min(1.0)
}

/// Holm's correction for several tests: p-values, in the order given, which hold against 0.05 all together.
#[must_use]
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&i, &j| p[i].total_cmp(&p[j]));
    let mut corrected = vec![0.0; p.len()];
    let mut least = 0.0f64;
    for (rank, &i) in order.iter().enumerate() {
        least = least.max(p[i] * (p.len() - rank) as f64).min(1.0);
        corrected[i] = least;
    }
    corrected
}

/// Pairs in which `a` is greater, ties one half each.
fn wins(a: &[f64], b: &[f64]) -> f64 {
    let halves: u64 = a
        .iter()
        .flat_map(|x| b.iter().map(move |y| u64::from(x > y) + u64::from(x >= y)))
        .sum();
    halves as f64 / 2.0
}

/// Sizes of the groups of equal numbers, those of one number left out.
fn tie_sizes(a: &[f64], b: &[f64]) -> Vec<usize> {
    let mut all = [a, b].concat();
    all.sort_by(f64::total_cmp);
    // Zeros of both signs are equal, and total order keeps them side by side.
    all.chunk_by(|x, y| x >= y)
        .map(<[f64]>::len)
        .filter(|&size| size > 1)
        .collect()
}

/// Twice the share of arrangements whose statistic is at least `u`.
fn exact_p(u: f64, n: usize, m: usize) -> f64 {
    let counts = arrangements(n, m);
    let total: f64 = counts.iter().sum();
    let tail: f64 = counts[u as usize..].iter().sum();
    (2.0 * tail / total).min(1.0)
}

/// Number of arrangements of `n` and `m` samples for each value of the statistic: the Gaussian binomial coefficient,
/// the product of (1 − qᵐ⁺ⁱ) / (1 − qⁱ) for i = 1 to n.
fn arrangements(n: usize, m: usize) -> Vec<f64> {
    let mut counts = vec![0.0; n * m + 1];
    counts[0] = 1.0;
    for i in 1..=n {
        for u in (m + i..counts.len()).rev() {
            counts[u] -= counts[u - m - i];
        }
        for u in i..counts.len() {
            counts[u] += counts[u - i];
        }
    }
    counts
}

/// The normal approximation with SciPy's corrections for ties and continuity.
fn asymptotic_p(u: f64, n: usize, m: usize, ties: &[usize]) -> f64 {
    let (n, m) = (n as f64, m as f64);
    let all = n + m;
    let tied: f64 = ties.iter().map(|&t| (t as f64).powi(3) - t as f64).sum();
    let variance = n * m / 12.0 * (all + 1.0 - tied / (all * (all - 1.0)));
    // All samples are equal: rounding may leave a little more than nothing.
    if variance < 1e-9 {
        return 1.0;
    }
    let z = (u - n * m / 2.0 - 0.5) / variance.sqrt();
    libm::erfc(z / std::f64::consts::SQRT_2).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_repeats_reach_eight_in_a_thousand() {
        assert!((smallest_p(5, 5) - 2.0 / 252.0).abs() < 1e-15);
        assert!((smallest_p(1, 1) - 1.0).abs() < 1e-15);
        let apart = mann_whitney(&[6.0, 7.0, 8.0, 9.0, 10.0], &[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        assert!((apart.p - smallest_p(5, 5)).abs() < 1e-15);
        assert!((apart.delta - 1.0).abs() < 1e-15);
    }

    #[test]
    fn equal_samples_do_not_differ() {
        let same = mann_whitney(&[500.0; 10], &[500.0; 10]).unwrap();
        assert!((same.p - 1.0).abs() < 1e-15 && same.delta.abs() < 1e-15 && !same.exact);
        let zeros = mann_whitney(&[0.0, 1.0], &[-0.0, 2.0]).unwrap();
        assert!(!zeros.exact, "zeros of both signs are a tie");
    }

    #[test]
    fn what_cannot_be_compared_is_not() {
        assert!(mann_whitney(&[], &[1.0]).is_none());
        assert!(mann_whitney(&[f64::NAN], &[1.0]).is_none());
    }

    #[test]
    fn every_arrangement_is_counted_once() {
        let counts = arrangements(3, 2);
        assert_eq!(
            counts.iter().map(|&c| c as u32).collect::<Vec<_>>(),
            [1, 1, 2, 2, 2, 1, 1]
        );
    }
}
