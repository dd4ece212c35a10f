//! The contract of plant and policy, and its hash.

use super::{ActionKind, Header};
use crate::hash::{START_64, fnv1a_64};

/// The hash of a policy's contract, from its header and its labels.
///
/// Two policies with equal contracts can take each other's place on one robot. It works for every version of the format.
/// The hash guards against mistakes, not against attackers.
#[must_use]
pub fn contract(header: &Header, labels: &str) -> u64 {
    let mut hash = START_64;
    contract_bytes(header, labels, |part| hash = fnv1a_64(hash, part));
    hash
}

/// Passes the contract's bytes to `put`, part by part.
pub fn contract_bytes(header: &Header, labels: &str, mut put: impl FnMut(&[u8])) {
    put(b"TPGC\x01");
    put(&[u8::from(header.action_kind != ActionKind::Discrete)]);
    put(&header.observation_len.to_le_bytes());
    put(&header.actions.to_le_bytes());
    put(&header.control_period_us.to_le_bytes());
    let inputs = usize::from(header.observation_len);
    for (k, line) in lines(labels).take(inputs + header.outputs()).enumerate() {
        put(line.as_bytes());
        put(b"\n");
        let (low, high) = if k < inputs {
            (f32::NEG_INFINITY, f32::INFINITY)
        } else {
            (header.action_low, header.action_high)
        };
        put(&positive_zero(low).to_le_bytes());
        put(&positive_zero(high).to_le_bytes());
    }
}

/// The number, +0 for −0.
pub(super) const fn positive_zero(x: f32) -> f32 {
    if x == 0.0 { 0.0 } else { x }
}

/// The lines of a text.
///
/// `str::lines` contains a panic that the compiler cannot remove. This function has none.
pub(crate) fn lines(mut text: &str) -> impl Iterator<Item = &str> + Clone {
    core::iter::from_fn(move || {
        let (line, rest) = text.split_once('\n').unwrap_or((text, ""));
        let more = !text.is_empty();
        text = rest;
        more.then_some(line)
    })
}
