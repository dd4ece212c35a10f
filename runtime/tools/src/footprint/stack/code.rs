//! What the decoders of instruction sets find.

use std::collections::BTreeSet;

/// What the code of a function says.
#[derive(Debug, Default)]
pub(super) struct Code {
    /// Bytes that it takes from the stack pointer.
    pub(super) frame: u64,
    /// What it calls.
    pub(super) calls: BTreeSet<u64>,
    /// Where it jumps to, itself mostly.
    pub(super) jumps: BTreeSet<u64>,
    /// Addresses that it forms, some of them of functions.
    pub(super) addresses: BTreeSet<u64>,
    /// Whether it calls or jumps to an address in a register, other than that to return to.
    pub(super) through_pointer: bool,
    /// The first instruction that moves the stack pointer by an unknown amount.
    pub(super) dynamic: Option<u64>,
}
