//! Small statistics over samples.

/// Arithmetic mean, summed in order; NaN of nothing.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textbook_values() {
        let samples = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0];
        assert!((mean(&samples) - 5.0).abs() < 1e-12);
        assert!((standard_deviation(&samples) - (32.0f64 / 7.0).sqrt()).abs() < 1e-12);
        assert!(standard_deviation(&[1.0]).abs() < 1e-12);
    }
}
