//! What constant expressions read of a blob beyond its header: labels and ranges, and so the contract.

use super::header::bytes_at;
use super::sections::{ENTRY_BYTES, kind};
use super::{Header, VERSION, contract};
use crate::tables::Range;

/// The labels of a blob of any version that this build reads: a line with name and unit for each input and output.
///
/// It works in constant expressions. It looks only at the header and at the lengths before the labels.
/// [`Policy::load`](crate::Policy::load) checks the rest when the program runs. Returns `None` if there are no labels to
/// be found.
#[must_use]
pub const fn labels_of(bytes: &[u8]) -> Option<&str> {
    let Some(header) = Header::peek(bytes) else {
        return None;
    };
    let Some((_, body)) = bytes.split_at_checked(header.stored_bytes()) else {
        return None;
    };
    let labels = if header.version < VERSION {
        labels_of_old(body)
    } else {
        section_of(body, header.sections, kind::LABELS)
    };
    let Some(labels) = labels else {
        return None;
    };
    match core::str::from_utf8(labels) {
        Ok(labels) => Some(labels),
        Err(_) => None,
    }
}

/// The hash of the contract of a blob of any version that this build reads, computed from header, labels and ranges.
///
/// It works in constant expressions, with the limits of [`labels_of`].
///
/// # Examples
/// ```
/// use tpg_runtime::{Policy, blob};
///
/// # const CHAMPION: &[u8] = include_bytes!("../../examples/team-memory.tpg");
/// const CONTRACT: u64 = blob::contract_of(CHAMPION).unwrap();
/// assert_eq!(Policy::load(CHAMPION)?.contract(), CONTRACT);
/// # Ok::<(), tpg_runtime::VerifyError>(())
/// ```
#[must_use]
pub const fn contract_of(bytes: &[u8]) -> Option<u64> {
    match (Header::peek(bytes), labels_of(bytes)) {
        (Some(header), Some(labels)) => Some(contract(&header, labels, ranges_of(&header, bytes))),
        _ => None,
    }
}

/// The ranges of a blob, empty if it has none.
const fn ranges_of<'a>(header: &Header, bytes: &'a [u8]) -> &'a [[u8; Range::BYTES]] {
    if header.version == VERSION
        && let Some((_, body)) = bytes.split_at_checked(header.stored_bytes())
        && let Some(section) = section_of(body, header.sections, kind::RANGES)
    {
        section.as_chunks().0
    } else {
        &[]
    }
}

/// The section of this type in a body of version 3, found by its directory.
const fn section_of(body: &[u8], sections: u16, kind: u16) -> Option<&[u8]> {
    let Some((mut entries, mut rest)) = body.split_at_checked(ENTRY_BYTES * sections as usize)
    else {
        return None;
    };
    while let Some((entry, others)) = entries.split_at_checked(ENTRY_BYTES)
        && !entry.is_empty()
    {
        let number = u16::from_le_bytes(bytes_at(entry, 0));
        let len = u32::from_le_bytes(bytes_at(entry, 4)) as usize;
        let Some((section, _)) = rest.split_at_checked(len) else {
            return None;
        };
        if number == kind {
            return Some(section);
        }
        let Some((_, behind)) = rest.split_at_checked(len.next_multiple_of(4)) else {
            return None;
        };
        (entries, rest) = (others, behind);
    }
    None
}

/// The labels in a body of versions 1 and 2: the ninth byte string. Each has its length in front, in postcard's varint.
const fn labels_of_old(body: &[u8]) -> Option<&[u8]> {
    const BEFORE: usize = 8;
    let (mut number, mut rest) = (0, body);
    loop {
        let (mut len, mut shift) = (0usize, 0);
        while let [byte, tail @ ..] = rest {
            len |= ((*byte & 0x7f) as usize) << shift;
            (shift, rest) = (shift + 7, tail);
            if *byte < 0x80 || shift > 21 {
                break;
            }
        }
        let Some((string, behind)) = rest.split_at_checked(len) else {
            return None;
        };
        if number == BEFORE {
            return Some(string);
        }
        (number, rest) = (number + 1, behind);
    }
}
