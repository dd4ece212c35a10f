//! Checks the ranges of inputs and outputs.

use super::error::VerifyError;
use crate::blob::{Header, default_range};
use crate::parts::Table;
use crate::tables::{Range, Tables};

/// Checks that there is a sound range for each input and each output, that those of the outputs span the header's, and that
/// the section says more than its absence would.
pub(super) fn check_ranges(header: &Header, tables: &Tables<'_>) -> Result<(), VerifyError> {
    if tables.ranges.is_empty() {
        return Ok(());
    }
    let inputs = usize::from(header.observation_len);
    if tables.ranges.len() != inputs + header.outputs() {
        return Err(VerifyError::Ranges);
    }
    let (mut needless, mut span) = (true, None);
    for (k, record) in tables.ranges.iter().enumerate() {
        let range = Range::from_bytes(record);
        if !is_sound(range, k < inputs) {
            return Err(VerifyError::Record {
                table: Table::Ranges,
                index: u32::try_from(k).unwrap_or(u32::MAX),
            });
        }
        needless &= range == default_range(header, k);
        if k >= inputs {
            let Range { low, high } = span.unwrap_or(range);
            span = Some(Range {
                low: low.min(range.low),
                high: high.max(range.high),
            });
        }
    }
    let spanned = span.is_none_or(|span| span == default_range(header, inputs));
    if needless || !spanned {
        return Err(VerifyError::Ranges);
    }
    Ok(())
}

/// Whether low lies below high or equals it, both being numbers. Only an input may be without bounds. There is one zero, +0.
fn is_sound(range: Range, input: bool) -> bool {
    let Range { low, high } = range;
    let negative_zero = |x: f32| x.to_bits() == 1 << 31;
    let bounded = |x: f32, none: f32| x.is_finite() || (input && x.to_bits() == none.to_bits());
    low <= high
        && bounded(low, f32::NEG_INFINITY)
        && bounded(high, f32::INFINITY)
        && !negative_zero(low)
        && !negative_zero(high)
}
