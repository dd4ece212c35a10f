//! Encodes tables as a blob. Programs that export policies need this.

use core::fmt;

use super::{Body, CRC, Header};
use crate::tables::Tables;

/// Why tables could not be encoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum EncodeError {
    /// The buffer is too small. [`encoded_bound`] gives a sufficient size.
    BufferTooSmall {
        /// A sufficient number of bytes.
        needed: usize,
        /// Length of the buffer in bytes.
        available: usize,
    },
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BufferTooSmall { needed, available } => {
                write!(
                    f,
                    "blob needs up to {needed} bytes, the buffer has {available}"
                )
            }
        }
    }
}

impl core::error::Error for EncodeError {}

/// An upper bound of the length of a blob with these tables, in bytes. The encoded blob may be shorter.
#[must_use]
pub fn encoded_bound(tables: &Tables<'_>) -> usize {
    const LONGEST_VARINT: usize = 10;
    const TABLES: usize = 11;
    Header::BYTES
        + 4
        + TABLES * LONGEST_VARINT
        + tables.teams.as_flattened().len()
        + tables.members.as_flattened().len()
        + tables.programs.as_flattened().len()
        + tables.code.as_flattened().len()
        + tables.constants.as_flattened().len()
        + tables.cells.as_flattened().len()
        + tables.memory.as_flattened().len()
        + tables.front_end.len()
        + tables.labels.len()
        + tables.task.len()
        + tables.observability.len()
}

/// Writes a blob into `buffer` and returns its length in bytes.
///
/// The function ignores `header.body_bytes` and writes the actual length of the body instead.
///
/// The function does not check the policy. Decode and verify the blob before you use it.
///
/// # Errors
/// [`EncodeError::BufferTooSmall`] if the blob does not fit.
pub fn encode(
    header: &Header,
    tables: &Tables<'_>,
    buffer: &mut [u8],
) -> Result<usize, EncodeError> {
    let available = buffer.len();
    let too_small = EncodeError::BufferTooSmall {
        needed: encoded_bound(tables),
        available,
    };
    let body = Body {
        teams: tables.teams.as_flattened(),
        members: tables.members.as_flattened(),
        programs: tables.programs.as_flattened(),
        code: tables.code.as_flattened(),
        constants: tables.constants.as_flattened(),
        cells: tables.cells.as_flattened(),
        memory: tables.memory.as_flattened(),
        front_end: tables.front_end,
        labels: tables.labels,
        task: tables.task,
        observability: tables.observability,
    };
    let place = buffer.get_mut(Header::BYTES..).ok_or(too_small)?;
    let body_bytes = postcard::to_slice(&body, place)
        .map_err(|_| too_small)?
        .len();
    let header = Header {
        body_bytes: u32::try_from(body_bytes).map_err(|_| too_small)?,
        ..*header
    };
    let covered_len = Header::BYTES + body_bytes;
    let (covered, rest) = buffer.split_at_mut_checked(covered_len).ok_or(too_small)?;
    if let Some(place) = covered.first_chunk_mut::<{ Header::BYTES }>() {
        *place = header.to_bytes();
    }
    let crc = CRC.checksum(covered).to_le_bytes();
    *rest.first_chunk_mut::<4>().ok_or(too_small)? = crc;
    Ok(covered_len + crc.len())
}
