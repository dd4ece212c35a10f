//! FNV-1a, 64 bits: tells layouts, policies and runs apart, in constant expressions too.

/// The hash of nothing.
pub(crate) const START: u64 = 0xcbf2_9ce4_8422_2325;

/// Continues a hash with bytes.
pub(crate) const fn bytes(mut hash: u64, mut rest: &[u8]) -> u64 {
    while let [byte, tail @ ..] = rest {
        hash = (hash ^ *byte as u64).wrapping_mul(0x0000_0100_0000_01b3);
        rest = tail;
    }
    hash
}

/// Continues a hash with a text and its end.
pub(crate) const fn text(hash: u64, text: &str) -> u64 {
    bytes(bytes(hash, text.as_bytes()), &[0xff])
}

/// Continues a hash with a number.
pub(crate) const fn number(hash: u64, number: usize) -> u64 {
    bytes(hash, &(number as u64).to_le_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_vectors_of_fnv_1a() {
        assert_eq!(bytes(START, b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(bytes(START, b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(bytes(START, b"foobar"), 0x8594_4171_f739_67e8);
    }
}
