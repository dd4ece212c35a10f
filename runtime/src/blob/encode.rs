//! Encodes tables as a blob. Programs that export policies need this.

use core::fmt;

use super::contract::positive_zero;
use super::sections::{ENTRY_BYTES, kind};
use super::{CRC, CRC_BYTES, Header, MAX_FILE_BYTES, Missing, SIGNATURE_SECTION_BYTES, contract};
use crate::tables::Tables;

/// Why tables could not be encoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum EncodeError {
    /// The buffer is too small. [`encoded_bound`] gives a sufficient size.
    BufferTooSmall {
        /// A sufficient number of bytes.
        needed: usize,
        /// Length of the buffer in bytes.
        available: usize,
    },
    /// The blob would be larger than [`MAX_FILE_BYTES`].
    TooLarge {
        /// Its length in bytes.
        bytes: usize,
    },
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BufferTooSmall { needed, available } => {
                write!(f, "blob needs {needed} bytes, the buffer has {available}")
            }
            Self::TooLarge { bytes } => write!(
                f,
                "blob needs {bytes} bytes, the format allows {MAX_FILE_BYTES}"
            ),
        }
    }
}

impl core::error::Error for EncodeError {}

/// The sections with their types: contents, and what the encoder adds at the end.
fn sections<'s>(
    tables: &Tables<'s>,
    signature: Option<&'s [u8; SIGNATURE_SECTION_BYTES]>,
) -> [(u16, &'s [u8], &'static [u8]); 13] {
    // Readers of older versions take a last line without its line feed.
    let line_end: &[u8] = match tables.labels.as_bytes() {
        [] | [.., b'\n'] => b"",
        _ => b"\n",
    };
    [
        (kind::TEAMS, tables.teams.as_flattened(), b""),
        (kind::MEMBERS, tables.members.as_flattened(), b""),
        (kind::PROGRAMS, tables.programs.as_flattened(), b""),
        (kind::CODE, tables.code.as_flattened(), b""),
        (kind::CONSTANTS, tables.constants.as_flattened(), b""),
        (kind::CELLS, tables.cells.as_flattened(), b""),
        (kind::MEMORY, tables.memory.as_flattened(), b""),
        (kind::FRONT_END, tables.front_end, b""),
        (kind::LABELS, tables.labels.as_bytes(), line_end),
        (kind::TASK, tables.task.as_bytes(), b""),
        (kind::OBSERVABILITY, tables.observability.as_bytes(), b""),
        (kind::RANGES, tables.ranges.as_flattened(), b""),
        (kind::SIGNATURE, signature.map_or(&[], |s| s), b""),
    ]
}

/// The length of a blob with these tables and without a signature, in bytes.
#[must_use]
pub fn encoded_bound(tables: &Tables<'_>) -> usize {
    let len = |(_, contents, end): (u16, &[u8], &[u8])| match contents.len() + end.len() {
        0 => 0,
        len => ENTRY_BYTES + len.next_multiple_of(4),
    };
    let sections: usize = sections(tables, None).into_iter().map(len).sum();
    Header::BYTES + sections + CRC_BYTES
}

/// Writes a blob of version 3 into `buffer` and returns its length in bytes.
///
/// Of the header the function ignores the version, `body_bytes`, `sections`, `missing` and `contract`, and writes what the
/// tables say. So a decoded policy of version 1 or 2 becomes one of version 3.
///
/// The function does not check the policy. Decode and verify the blob before you use it.
///
/// # Errors
/// [`EncodeError::BufferTooSmall`] if the blob does not fit, [`EncodeError::TooLarge`] if no file may be so large.
pub fn encode(
    header: &Header,
    tables: &Tables<'_>,
    buffer: &mut [u8],
) -> Result<usize, EncodeError> {
    write(header, tables, None, buffer)
}

/// As [`encode`], with a signature section, of which [`Signature::section`](super::Signature::section) gives the bytes.
///
/// To sign: encode with a signature of zeros, sign what [`Signature::signed`](super::Signature::signed) of the result is, and encode again. The blob
/// has 88 bytes more than [`encoded_bound`].
///
/// # Errors
/// As for [`encode`].
pub fn encode_signed(
    header: &Header,
    tables: &Tables<'_>,
    signature: &[u8; SIGNATURE_SECTION_BYTES],
    buffer: &mut [u8],
) -> Result<usize, EncodeError> {
    write(header, tables, Some(signature), buffer)
}

fn write(
    header: &Header,
    tables: &Tables<'_>,
    signature: Option<&[u8; SIGNATURE_SECTION_BYTES]>,
    buffer: &mut [u8],
) -> Result<usize, EncodeError> {
    let needed = encoded_bound(tables) + signature.map_or(0, |s| ENTRY_BYTES + s.len());
    let too_large = EncodeError::TooLarge { bytes: needed };
    if needed > MAX_FILE_BYTES as usize {
        return Err(too_large);
    }
    let available = buffer.len();
    let file = buffer
        .get_mut(..needed)
        .ok_or(EncodeError::BufferTooSmall { needed, available })?;
    file.fill(0);
    let (covered, checksum) = file
        .split_last_chunk_mut::<CRC_BYTES>()
        .map_or((&mut [][..], None), |(covered, crc)| (covered, Some(crc)));
    let sections = sections(tables, signature);
    let present = sections
        .iter()
        .filter(|(_, contents, end)| contents.len() + end.len() > 0);
    let count = present.clone().count();
    let front_end = match tables.front_end {
        _ if header.front_end.is_none() => Missing::Zero,
        [kind, ..] => Missing::of_section(*kind).unwrap_or(Missing::Mean),
        [] => Missing::Mean,
    };
    let mut header = Header {
        body_bytes: (needed - Header::BYTES - CRC_BYTES) as u32,
        sections: count as u16,
        missing: front_end,
        action_low: positive_zero(header.action_low),
        action_high: positive_zero(header.action_high),
        ..*header
    };
    header.contract = contract(&header, tables.labels, tables.ranges);
    let mut at = 0;
    let mut put = |bytes: &[u8]| {
        if let Some(place) = covered.get_mut(at..at + bytes.len()) {
            place.copy_from_slice(bytes);
        }
        at += bytes.len();
    };
    put(&header.to_bytes());
    for (kind, contents, end) in present.clone() {
        put(&kind.to_le_bytes());
        put(&[0, 0]);
        put(&((contents.len() + end.len()) as u32).to_le_bytes());
    }
    for (_, contents, end) in present {
        put(contents);
        put(end);
        let gap = [0; 3];
        let len = (contents.len() + end.len()).wrapping_neg() % 4;
        put(gap.get(..len).unwrap_or_default());
    }
    if let Some(checksum) = checksum {
        *checksum = CRC.checksum(covered).to_le_bytes();
    }
    Ok(needed)
}
