//! The result of decoding a function, for every instruction set.

use std::collections::BTreeSet;

/// What the decoder found in a function's code.
#[derive(Debug, Default)]
pub(super) struct Code {
    /// The number of bytes that it takes from the stack pointer.
    pub(super) frame: u64,
    /// The addresses that it calls.
    pub(super) calls: BTreeSet<u64>,
    /// The addresses that it jumps to. Most are its own.
    pub(super) jumps: BTreeSet<u64>,
    /// The addresses that it forms. Some are addresses of functions.
    pub(super) addresses: BTreeSet<u64>,
    /// Whether it calls or jumps to an address in a register. The return address does not count.
    pub(super) through_pointer: bool,
    /// The address of the first instruction that moves the stack pointer by an unknown amount.
    pub(super) dynamic: Option<u64>,
}
