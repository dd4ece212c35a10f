//! Seeds and random streams, the same on every target.

pub use rand_pcg::Pcg32;

/// SplitMix64's increment: the fraction of the golden ratio in 64 bits.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// SplitMix64's finaliser. It is a bijection of 64-bit words and spreads every input bit.
const fn finalise(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Hashes a list of words into a seed. It chains SplitMix64's finaliser over the words.
///
/// It starts with `h = 0`. Then for each word `x` in order `h = finalise((h + golden) ^ x)` with wrapping addition.
///
/// # Examples
/// ```
/// use tpg_runtime::rng::mix64;
/// assert_ne!(mix64(&[1, 2]), mix64(&[2, 1]));
/// ```
#[must_use]
#[cfg_attr(feature = "small-code", inline(never))]
pub const fn mix64(words: &[u64]) -> u64 {
    let (mut h, mut rest) = (0u64, words);
    while let [x, tail @ ..] = rest {
        h = mix64_next(h, *x);
        rest = tail;
    }
    h
}

/// Adds the word `x` to the hash `h` of a list. Returns the hash of the longer list.
pub(crate) const fn mix64_next(h: u64, x: u64) -> u64 {
    finalise(h.wrapping_add(GOLDEN) ^ x)
}
