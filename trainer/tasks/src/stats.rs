//! Small statistics over samples.

mod comparison;

pub use comparison::{MannWhitney, holm, mann_whitney, smallest_p};

use crate::task::Rng;

/// Arithmetic mean, summed in order; NaN without samples.
#[must_use]
pub fn mean(samples: &[f64]) -> f64 {
    samples.iter().sum::<f64>() / samples.len() as f64
}

/// Sample standard deviation (n − 1); 0 for fewer than two samples.
#[must_use]
pub fn standard_deviation(samples: &[f64]) -> f64 {
    if samples.len() < 2 {
        return 0.0;
    }
    let m = mean(samples);
    let squares: f64 = samples.iter().map(|x| (x - m) * (x - m)).sum();
    (squares / (samples.len() - 1) as f64).sqrt()
}

/// Median: the mean of the middle two of an even number; NaN without samples.
#[must_use]
pub fn median(samples: &[f64]) -> f64 {
    let mut sorted = samples.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    match (
        sorted.len() % 2,
        sorted.get(middle.wrapping_sub(1)),
        sorted.get(middle),
    ) {
        (0, Some(low), Some(high)) => f64::midpoint(*low, *high),
        (_, _, Some(middle)) => *middle,
        _ => f64::NAN,
    }
}

/// Resamples of a bootstrap: the ends of its interval then vary by less than a hundredth of its width.
const RESAMPLES: usize = 10_000;

/// 95 % percentile bootstrap interval of the mean: its ends, the lower first; NaN without samples.
///
/// The resamples are always the same for the same number of samples.
#[must_use]
pub fn bootstrap_mean_95(samples: &[f64]) -> [f64; 2] {
    if samples.is_empty() {
        return [f64::NAN; 2];
    }
    let mut rng = Rng::new(samples.len() as u64);
    let n = samples.len();
    let mut means: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            let sum: f64 = (0..n).map(|_| samples[rng.below(n as u64) as usize]).sum();
            sum / n as f64
        })
        .collect();
    means.sort_by(f64::total_cmp);
    [0.025, 0.975].map(|share| means[(share * (RESAMPLES - 1) as f64).round() as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textbook_values() {
        let samples = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0];
        assert!((mean(&samples) - 5.0).abs() < 1e-12);
        assert!((standard_deviation(&samples) - (32.0f64 / 7.0).sqrt()).abs() < 1e-12);
        assert!(standard_deviation(&[1.0]).abs() < 1e-12);
        assert!((median(&samples) - 4.5).abs() < 1e-12);
        assert!((median(&[3.0, 1.0, 2.0]) - 2.0).abs() < 1e-12);
        assert!((median(&[3.0]) - 3.0).abs() < 1e-12);
        assert!(median(&[]).is_nan());
    }

    /// For a large normal sample the interval is the mean ± 1.96 standard errors.
    #[test]
    fn the_bootstrap_agrees_with_the_normal_interval() {
        let mut rng = Rng::new(1);
        let samples: Vec<f64> = (0..400).map(|_| 10.0 + 3.0 * rng.normal()).collect();
        let half = 1.96 * standard_deviation(&samples) / 20.0;
        let [low, high] = bootstrap_mean_95(&samples);
        assert!((low - (mean(&samples) - half)).abs() < 0.1 * half, "{low}");
        assert!(
            (high - (mean(&samples) + half)).abs() < 0.1 * half,
            "{high}"
        );
        assert_eq!(
            bootstrap_mean_95(&[2.0]).map(f64::to_bits),
            [2.0f64; 2].map(f64::to_bits)
        );
    }
}
