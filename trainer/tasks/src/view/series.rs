//! Numbers in two bytes each.

use serde::Serialize;

use crate::page::base64;

/// What stands for a number that is missing or not finite.
const MISSING: u16 = u16::MAX;
/// The greatest number of the others.
const TOP: f64 = 65_534.0;

/// Values over time: of each step those of all channels, as shares of the channel's range.
///
/// A channel's value is `low + (high - low) · share / 65534`; the share 65535 says that there is none.
#[derive(Debug, Serialize)]
pub(super) struct Series {
    low: Vec<f64>,
    high: Vec<f64>,
    /// Two bytes each, the lower one first, as Base64.
    shares: String,
}

impl Series {
    /// Values of steps that each have so many channels; an incomplete step at the end is left out.
    pub(super) fn new(values: &[f64], channels: usize) -> Self {
        let steps = values.chunks_exact(channels.max(1));
        let (mut low, mut high) = (
            vec![f64::INFINITY; channels],
            vec![f64::NEG_INFINITY; channels],
        );
        for step in steps.clone() {
            for (channel, value) in step
                .iter()
                .enumerate()
                .filter(|(_, value)| value.is_finite())
            {
                low[channel] = low[channel].min(*value);
                high[channel] = high[channel].max(*value);
            }
        }
        for (low, high) in low.iter_mut().zip(&mut high) {
            if *low > *high {
                (*low, *high) = (0.0, 0.0);
            }
        }
        let mut bytes = Vec::with_capacity(2 * values.len());
        for step in steps {
            for ((value, low), high) in step.iter().zip(&low).zip(&high) {
                bytes.extend(share(*value, *low, *high).to_le_bytes());
            }
        }
        Series {
            low,
            high,
            shares: base64(&bytes),
        }
    }
}

/// A value as a share of its range.
fn share(value: f64, low: f64, high: f64) -> u16 {
    if !value.is_finite() {
        return MISSING;
    }
    // Halves, since the width of a range of huge numbers is none.
    let width = high / 2.0 - low / 2.0;
    let share = if width > 0.0 {
        (value / 2.0 - low / 2.0) / width
    } else {
        0.0
    };
    (share * TOP).round() as u16
}

/// A part of a unit vector or quaternion, -1 to 1, in two bytes.
pub(super) fn unit(value: f32) -> [u8; 2] {
    let scaled = (value.clamp(-1.0, 1.0) * 32_767.0).round();
    (scaled as i16).to_le_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_fill_the_range_of_their_channel() {
        let series = Series::new(&[1.0, -5.0, 3.0, f64::NAN, 2.0, 5.0], 2);
        assert_eq!(series.low, [1.0, -5.0]);
        assert_eq!(series.high, [3.0, 5.0]);
        let shares = [0, 0, 65_534, 65_535, 32_767, 65_534u16];
        let bytes: Vec<u8> = shares.iter().flat_map(|x| x.to_le_bytes()).collect();
        assert_eq!(series.shares, base64(&bytes));
    }

    #[test]
    fn constant_missing_and_huge_channels_have_finite_ranges() {
        let series = Series::new(&[2.0, f64::NAN, f64::MAX, 2.0, f64::INFINITY, f64::MIN], 3);
        assert_eq!(series.low, [2.0, 0.0, f64::MIN]);
        assert_eq!(series.high, [2.0, 0.0, f64::MAX]);
        let shares = [0, 65_535, 65_534, 0, 65_535, 0u16];
        let bytes: Vec<u8> = shares.iter().flat_map(|x| x.to_le_bytes()).collect();
        assert_eq!(series.shares, base64(&bytes));
    }
}
