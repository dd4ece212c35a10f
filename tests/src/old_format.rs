//! Files of versions 1 and 2, which no program writes any more.

use tpg_runtime::Blob;

const OLD_HEADER: usize = 72;

/// A policy of version 3 as a file of version 2 if it has a front end, else of version 1, as `docs/format.md` lays it out.
///
/// # Panics
/// If the bytes are no blob.
#[must_use]
pub fn old_format(file: &[u8]) -> Vec<u8> {
    let blob = Blob::decode(file).expect("a blob");
    let tables = blob.tables();
    let mut old = file[..OLD_HEADER].to_vec();
    let version: u16 = if blob.header().front_end.is_some() {
        2
    } else {
        1
    };
    old[4..6].copy_from_slice(&version.to_le_bytes());
    old[6..8].copy_from_slice(&(OLD_HEADER as u16).to_le_bytes());
    for field in [
        tables.teams.as_flattened(),
        tables.members.as_flattened(),
        tables.programs.as_flattened(),
        tables.code.as_flattened(),
        tables.constants.as_flattened(),
        tables.cells.as_flattened(),
        tables.memory.as_flattened(),
        tables.front_end,
        tables.labels.as_bytes(),
        tables.task.as_bytes(),
        tables.observability.as_bytes(),
    ] {
        let mut len = field.len();
        while len >= 0x80 {
            old.push(len as u8 | 0x80);
            len >>= 7;
        }
        old.push(len as u8);
        old.extend_from_slice(field);
    }
    let body = (old.len() - OLD_HEADER) as u32;
    old[12..16].copy_from_slice(&body.to_le_bytes());
    let crc = crc32(&old).to_le_bytes();
    old.extend_from_slice(&crc);
    old
}

/// CRC-32 (IEEE), bit by bit from its definition.
#[must_use]
pub fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
            (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg())
        })
    })
}

/// Makes the checksum of a file right again.
pub fn mend(file: &mut [u8]) {
    let covered = file.len() - 4;
    let crc = crc32(&file[..covered]);
    file[covered..].copy_from_slice(&crc.to_le_bytes());
}
