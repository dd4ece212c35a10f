//! Several policies in one block of memory, for the boards' programs that run them all.

/// The first four bytes of a pack.
const MAGIC: [u8; 4] = *b"TPGP";

/// A pack of policies. The firmware's program `bits` tries each with so many decisions.
///
/// ```text
/// "TPGP" | decisions u32 | count u32 | count times: length u32, bytes, padding to a multiple of 4
/// ```
#[must_use]
pub fn pack(policies: &[Vec<u8>], decisions: u32) -> Vec<u8> {
    let number = |n: usize| u32::try_from(n).unwrap_or(u32::MAX).to_le_bytes();
    let mut bytes = MAGIC.to_vec();
    bytes.extend(decisions.to_le_bytes());
    bytes.extend(number(policies.len()));
    for policy in policies {
        bytes.extend(number(policy.len()));
        bytes.extend(policy);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    bytes
}
