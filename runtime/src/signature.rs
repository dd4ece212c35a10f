//! Verifies who signed a policy's file, by Ed25519 (RFC 8032); feature `signature`.
//!
//! This is a check of its own, beside loading: a policy that loads may be unsigned or forged. `docs/format-3.md` says which
//! bytes are signed.

use core::fmt;

use ed25519_dalek::{Signature, VerifyingKey};

use crate::blob::Blob;

/// An Ed25519 public key.
pub type PublicKey = [u8; 32];

/// What a public key's text begins with. 64 hexadecimal digits follow, and perhaps a line feed.
pub const PUBLIC_PREFIX: &str = "tpg-ed25519-public ";
/// What a secret key's text begins with.
pub const SECRET_PREFIX: &str = "tpg-ed25519-secret ";

/// Why a file does not count as signed by a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SignatureError {
    /// The public key is no point of the curve.
    Key,
    /// The file has no signature.
    Unsigned,
    /// The file names another key, of which these are the first bytes.
    OtherKey([u8; 8]),
    /// The signature is not that of these bytes by this key.
    Forged,
}

impl fmt::Display for SignatureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Key => write!(f, "public key is no Ed25519 key"),
            Self::Unsigned => write!(f, "file is not signed"),
            Self::OtherKey(key) => {
                write!(
                    f,
                    "file is signed by another key, {:016x}",
                    u64::from_be_bytes(*key)
                )
            }
            Self::Forged => write!(f, "signature does not belong to these bytes and this key"),
        }
    }
}

impl core::error::Error for SignatureError {}

/// Verifies that the owner of a key signed this file. Weak keys and malleable signatures are refused.
///
/// # Errors
/// Any [`SignatureError`].
pub fn verify(blob: &Blob<'_>, key: &PublicKey) -> Result<(), SignatureError> {
    let signature = blob.signature().ok_or(SignatureError::Unsigned)?;
    if !key.starts_with(&signature.key) {
        return Err(SignatureError::OtherKey(signature.key));
    }
    let key = VerifyingKey::from_bytes(key).map_err(|_| SignatureError::Key)?;
    let bytes = Signature::from_bytes(signature.bytes);
    let verified = key.verify_strict(signature.signed, &bytes);
    verified.map_err(|_| SignatureError::Forged)
}

/// Reads a key's text, which begins with `prefix`. It works in constant expressions, as firmware needs.
#[must_use]
pub const fn parse_key(text: &[u8], prefix: &str) -> Option<[u8; 32]> {
    let Some((start, digits)) = text.split_at_checked(prefix.len()) else {
        return None;
    };
    let (mut expected, mut found) = (prefix.as_bytes(), start);
    while let ([a, rest @ ..], [b, others @ ..]) = (expected, found) {
        if *a != *b {
            return None;
        }
        (expected, found) = (rest, others);
    }
    let mut key = [0; 32];
    let (mut digits, mut places): (&[u8], &mut [u8]) = (digits, &mut key);
    while let ([high, low, rest @ ..], [place, others @ ..]) = (digits, places) {
        let (Some(high), Some(low)) = (digit(*high), digit(*low)) else {
            return None;
        };
        *place = high << 4 | low;
        (digits, places) = (rest, others);
    }
    // All places are taken if 64 digits were read.
    match digits {
        [] | [b'\n'] if text.len() >= prefix.len() + 64 => Some(key),
        _ => None,
    }
}

const fn digit(byte: u8) -> Option<u8> {
    match (byte as char).to_digit(16) {
        Some(digit) => Some(digit as u8),
        None => None,
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::format;

    #[test]
    fn keys_are_read_and_nonsense_is_not() {
        let digits = "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a";
        let read = |text: &str| parse_key(text.as_bytes(), PUBLIC_PREFIX);
        let key = read(&format!("{PUBLIC_PREFIX}{digits}\n")).expect("a key");
        assert_eq!((key[0], key[31]), (0xd7, 0x1a));
        assert_eq!(read(&format!("{PUBLIC_PREFIX}{digits}")), Some(key));
        for nonsense in [
            format!("{SECRET_PREFIX}{digits}"),
            format!("{PUBLIC_PREFIX}{digits}00"),
            format!("{PUBLIC_PREFIX}{}", &digits[1..]),
            format!("{PUBLIC_PREFIX}{}g", &digits[1..]),
            format!("{PUBLIC_PREFIX}{}\n", &digits[..62]),
            digits.into(),
            "".into(),
        ] {
            assert_eq!(read(&nonsense), None, "{nonsense}");
        }
    }
}
