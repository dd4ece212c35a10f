//! The directory of version 3 and the sections that it names.

use super::error::{DecodeError, SectionFault, records};
use crate::parts::Table;
use crate::tables::Tables;

/// Bytes of an entry of the directory.
pub(super) const ENTRY_BYTES: usize = 8;
/// The first type that a reader may step over.
const SKIPPABLE: u16 = 0x8000;

/// The types of sections that this build reads.
pub(super) mod kind {
    pub const TEAMS: u16 = 1;
    pub const MEMBERS: u16 = 2;
    pub const PROGRAMS: u16 = 3;
    pub const CODE: u16 = 4;
    pub const CONSTANTS: u16 = 5;
    pub const CELLS: u16 = 6;
    pub const MEMORY: u16 = 7;
    pub const FRONT_END: u16 = 8;
    pub const LABELS: u16 = 9;
    pub const TASK: u16 = 10;
    pub const OBSERVABILITY: u16 = 11;
    pub const RANGES: u16 = 12;
    pub const SIGNATURE: u16 = 65_535;
}

/// Bytes of an Ed25519 signature.
pub const SIGNATURE_BYTES: usize = 64;
/// Bytes of a signature section.
pub const SIGNATURE_SECTION_BYTES: usize = 80;
/// Bytes of the section before the signature: the algorithm, zeros and the start of the key.
const HEAD: usize = SIGNATURE_SECTION_BYTES - SIGNATURE_BYTES;

/// The signature section of a file, and what it signs. Nothing of it is verified.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Signature<'a> {
    /// The first 8 bytes of the public key.
    pub key: [u8; 8],
    /// The bytes that are signed: every byte of the file before [`Self::bytes`].
    pub signed: &'a [u8],
    /// The Ed25519 signature.
    pub bytes: &'a [u8; SIGNATURE_BYTES],
}

impl<'a> Signature<'a> {
    /// The section's bytes with this key and signature.
    #[must_use]
    pub fn section(
        key: [u8; 8],
        signature: &[u8; SIGNATURE_BYTES],
    ) -> [u8; SIGNATURE_SECTION_BYTES] {
        let mut section = [0; SIGNATURE_SECTION_BYTES];
        let parts: [&[u8]; 4] = [&[1], &[0; 7], &key, signature];
        let bytes = parts.into_iter().flatten();
        for (place, byte) in section.iter_mut().zip(bytes) {
            *place = *byte;
        }
        section
    }

    /// The signature at the end of what the checksum covers, `None` if the section has no known form.
    pub(super) fn of(covered: &'a [u8]) -> Option<Self> {
        let (signed, bytes) = covered.split_last_chunk::<{ SIGNATURE_BYTES }>()?;
        let (_, head) = signed.split_last_chunk::<{ HEAD }>()?;
        let ([1, 0, 0, 0, 0, 0, 0, 0], key) = head.split_first_chunk::<8>()? else {
            return None;
        };
        let key = *key.first_chunk()?;
        Some(Signature { key, signed, bytes })
    }
}

/// Reads the directory and the sections of a body, which begins at a file offset that is a multiple of 4.
///
/// The second value says whether the last section is a signature.
pub(super) fn read(body: &[u8], sections: u16) -> Result<(Tables<'_>, bool), DecodeError> {
    let (entries, mut rest) = body
        .split_at_checked(ENTRY_BYTES * usize::from(sections))
        .ok_or(DecodeError::Body)?;
    let (mut tables, mut previous) = (Tables::default(), 0);
    for entry in entries.as_chunks::<ENTRY_BYTES>().0 {
        let [t0, t1, z0, z1, l0, l1, l2, l3] = *entry;
        let kind = u16::from_le_bytes([t0, t1]);
        let len = u32::from_le_bytes([l0, l1, l2, l3]) as usize;
        let refused = |fault| DecodeError::Section { kind, fault };
        if kind <= previous {
            return Err(refused(SectionFault::Order));
        }
        if [z0, z1] != [0, 0] {
            return Err(refused(SectionFault::Reserved));
        }
        if len == 0 {
            return Err(refused(SectionFault::Empty));
        }
        previous = kind;
        let (section, behind) = rest
            .split_at_checked(len)
            .ok_or(refused(SectionFault::Beyond))?;
        let (gap, behind) = behind
            .split_at_checked(len.wrapping_neg() % 4)
            .ok_or(refused(SectionFault::Beyond))?;
        if gap.iter().any(|byte| *byte != 0) {
            return Err(refused(SectionFault::Padding));
        }
        rest = behind;
        let text = || core::str::from_utf8(section).map_err(|_| refused(SectionFault::Text));
        match kind {
            kind::TEAMS => tables.teams = records(section, Table::Teams)?,
            kind::MEMBERS => tables.members = records(section, Table::Members)?,
            kind::PROGRAMS => tables.programs = records(section, Table::Programs)?,
            kind::CODE => tables.code = records(section, Table::Code)?,
            kind::CONSTANTS => tables.constants = records(section, Table::Constants)?,
            kind::CELLS => tables.cells = records(section, Table::Cells)?,
            kind::MEMORY => tables.memory = records(section, Table::Memory)?,
            kind::FRONT_END => tables.front_end = section,
            kind::LABELS => tables.labels = text()?,
            kind::TASK => tables.task = text()?,
            kind::OBSERVABILITY => tables.observability = text()?,
            kind::RANGES => tables.ranges = records(section, Table::Ranges)?,
            kind::SIGNATURE if len != SIGNATURE_SECTION_BYTES => {
                return Err(refused(SectionFault::Form));
            }
            SKIPPABLE.. => {}
            _ => return Err(refused(SectionFault::Critical)),
        }
    }
    if !rest.is_empty() {
        return Err(DecodeError::Body);
    }
    Ok((tables, previous == kind::SIGNATURE))
}
