//! How series of numbers are scaled and split.

/// A series whose training part lies within 0 and 1, and the variance by which errors are divided.
pub(super) struct Series {
    pub(super) values: Vec<f64>,
    pub(super) variance: f64,
}

impl Series {
    /// Scales the values so that the least of the first `known` ones is 0 and the greatest 1; the variance is theirs.
    ///
    /// `None` if these are all the same, or so far apart that no number says how far.
    pub(super) fn scaled(mut values: Vec<f64>, known: usize) -> Option<Self> {
        let part = values.get(..known)?;
        let low = part.iter().copied().fold(f64::INFINITY, f64::min);
        let high = part.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let range = high - low;
        if !(range > 0.0 && range.is_finite()) {
            return None;
        }
        for x in &mut values {
            *x = (*x - low) / range;
        }
        let part = values.get(..known)?;
        let mean = part.iter().sum::<f64>() / known as f64;
        let squares = part.iter().map(|x| (x - mean) * (x - mean));
        let variance = squares.sum::<f64>() / known as f64;
        Some(Series { values, variance })
    }
}

/// How many of so many values are for training: all but the last quarter.
pub(super) const fn training_part(len: usize) -> usize {
    len - len / 4
}
