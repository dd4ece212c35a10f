//! Hashes of the layout of messages, with which both sides tell each other's builds apart.

use tpg_runtime::hash::fnv1a_64;
pub(crate) use tpg_runtime::hash::{START_64 as START, fnv1a_64 as bytes};

/// Continues a hash with a text and its end.
pub(crate) const fn text(hash: u64, text: &str) -> u64 {
    fnv1a_64(fnv1a_64(hash, text.as_bytes()), &[0xff])
}

/// Continues a hash with a number.
pub(crate) const fn number(hash: u64, number: usize) -> u64 {
    fnv1a_64(hash, &(number as u64).to_le_bytes())
}
