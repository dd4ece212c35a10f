//! FNV-1a, the hash of instruction tables, messages and contracts. It works in constant expressions.
//!
//! It tells versions and mistakes apart. It is no protection against attackers.

/// The 64-bit hash of nothing.
pub const START_64: u64 = 0xcbf2_9ce4_8422_2325;

/// Continues a 64-bit hash with bytes.
#[must_use]
pub const fn fnv1a_64(mut hash: u64, bytes: &[u8]) -> u64 {
    let mut rest = bytes;
    while let [byte, tail @ ..] = rest {
        hash = (hash ^ *byte as u64).wrapping_mul(0x0000_0100_0000_01b3);
        rest = tail;
    }
    hash
}

/// The 32-bit hash of nothing.
pub const START_32: u32 = 0x811c_9dc5;

/// Continues a 32-bit hash with bytes.
#[must_use]
pub const fn fnv1a_32(mut hash: u32, bytes: &[u8]) -> u32 {
    let mut rest = bytes;
    while let [byte, tail @ ..] = rest {
        hash = (hash ^ *byte as u32).wrapping_mul(0x0100_0193);
        rest = tail;
    }
    hash
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_vectors_of_fnv_1a() {
        assert_eq!(fnv1a_64(START_64, b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a_64(START_64, b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(fnv1a_64(START_64, b"foobar"), 0x8594_4171_f739_67e8);
        assert_eq!(fnv1a_32(START_32, b""), 0x811c_9dc5);
        assert_eq!(fnv1a_32(START_32, b"foobar"), 0xbf9c_f968);
    }
}
