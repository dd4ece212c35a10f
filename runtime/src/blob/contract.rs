//! The contract of plant and policy, and its hash.

use super::{ActionKind, Header};
use crate::hash::{START_64, fnv1a_64};
use crate::tables::{Range, Tables};

/// The hash of a policy's contract, from its header, its labels and its ranges as stored.
///
/// Two policies with equal contracts can take each other's place on one robot. It works for every version of the format,
/// also in constant expressions ([`contract_of`](super::contract_of) reads a whole file).
/// The hash guards against mistakes, not against attackers.
#[must_use]
pub const fn contract(header: &Header, labels: &str, ranges: &[[u8; Range::BYTES]]) -> u64 {
    let mut hash = fnv1a_64(START_64, &head(header));
    let (mut k, mut text, mut ranges) = (0, labels.as_bytes(), ranges);
    while k < channels(header) && !text.is_empty() {
        let (line, rest) = next_line(text);
        hash = fnv1a_64(fnv1a_64(hash, line), b"\n");
        let range = if let [range, others @ ..] = ranges {
            ranges = others;
            *range
        } else {
            default_range(header, k).to_bytes()
        };
        hash = fnv1a_64(hash, &range);
        (k, text) = (k + 1, rest);
    }
    hash
}

/// Passes the contract's bytes to `put`, part by part.
pub fn contract_bytes(header: &Header, tables: &Tables<'_>, mut put: impl FnMut(&[u8])) {
    put(&head(header));
    for (k, line) in lines(tables.labels).take(channels(header)).enumerate() {
        put(line.as_bytes());
        put(b"\n");
        let range = tables.ranges.get(k).copied();
        put(&range.unwrap_or_else(|| default_range(header, k).to_bytes()));
    }
}

const fn channels(header: &Header) -> usize {
    header.observation_len as usize + header.outputs()
}

/// The bytes before those of the channels.
const fn head(header: &Header) -> [u8; 14] {
    let continuous = !matches!(header.action_kind, ActionKind::Discrete);
    let [i0, i1] = header.observation_len.to_le_bytes();
    let [a0, a1] = header.actions.to_le_bytes();
    let [p0, p1, p2, p3] = header.control_period_us.to_le_bytes();
    let [m0, m1, m2, m3] = *b"TPGC";
    [
        m0,
        m1,
        m2,
        m3,
        1,
        continuous as u8,
        i0,
        i1,
        a0,
        a1,
        p0,
        p1,
        p2,
        p3,
    ]
}

/// The range of channel `k` in a file without a section of ranges.
pub(crate) const fn default_range(header: &Header, k: usize) -> Range {
    if k < header.observation_len as usize {
        Range::ALL
    } else {
        Range {
            low: positive_zero(header.action_low),
            high: positive_zero(header.action_high),
        }
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

/// The first line of a text, and what comes after it. It works in constant expressions.
pub(crate) const fn next_line(text: &[u8]) -> (&[u8], &[u8]) {
    split_at_byte(text, b'\n')
}

/// The text before the first byte of this value, and what comes after it. All of the text if there is none.
pub(crate) const fn split_at_byte(text: &[u8], byte: u8) -> (&[u8], &[u8]) {
    let (mut len, mut rest) = (0, text);
    while let [first, tail @ ..] = rest {
        rest = tail;
        if *first == byte {
            // `split_at` contains a panic that the compiler cannot remove.
            if let Some((line, _)) = text.split_at_checked(len) {
                return (line, rest);
            }
        }
        len += 1;
    }
    (text, rest)
}
