//! Keys for policies, and signed files.

use ed25519_dalek::{Signer as _, SigningKey};
use tpg_runtime::Policy;
use tpg_runtime::blob::{
    Blob, EncodeError, SIGNATURE_BYTES, Signature, encode_signed, encoded_bound,
};
use tpg_runtime::signature::{PUBLIC_PREFIX, PublicKey, SECRET_PREFIX, parse_key};

/// Bytes that a signature adds: section and entry of the directory.
const ADDED: usize = 88;

/// A secret key. Whoever has it can sign policies.
pub struct SecretKey(SigningKey);

impl SecretKey {
    /// A new key, from the system's random numbers.
    ///
    /// # Errors
    /// If the system has none.
    pub fn generate() -> Result<Self, getrandom::Error> {
        let mut bytes = [0; 32];
        getrandom::fill(&mut bytes)?;
        Ok(SecretKey(SigningKey::from_bytes(&bytes)))
    }

    /// Reads the text of a secret key. `None` if it is none.
    #[must_use]
    pub fn parse(text: &[u8]) -> Option<Self> {
        let bytes = parse_key(text, SECRET_PREFIX)?;
        Some(SecretKey(SigningKey::from_bytes(&bytes)))
    }

    /// The text that [`parse`](Self::parse) reads.
    #[must_use]
    pub fn text(&self) -> String {
        line(SECRET_PREFIX, &self.0.to_bytes())
    }

    /// The public key.
    #[must_use]
    pub fn public(&self) -> PublicKey {
        self.0.verifying_key().to_bytes()
    }

    /// The text of the public key, for `tpg_runtime::signature::parse_key`.
    #[must_use]
    pub fn public_text(&self) -> String {
        line(PUBLIC_PREFIX, &self.public())
    }
}

/// The file of a policy with a signature, in format version 3. `release` sets its release number.
///
/// # Errors
/// [`EncodeError`] if the policy is too large for that version.
pub fn sign(
    policy: &Policy<'_>,
    key: &SecretKey,
    release: Option<u32>,
) -> Result<Vec<u8>, EncodeError> {
    let (mut header, tables) = (*policy.header(), policy.tables());
    if let Some(release) = release {
        header.release = release;
    }
    let [k0, k1, k2, k3, k4, k5, k6, k7, ..] = key.public();
    let begin = [k0, k1, k2, k3, k4, k5, k6, k7];
    let mut file = vec![0; encoded_bound(tables) + ADDED];
    let mut encode = |signature: &[u8; SIGNATURE_BYTES]| {
        let section = Signature::section(begin, signature);
        let len = encode_signed(&header, tables, &section, &mut file)?;
        file.truncate(len);
        Ok::<_, EncodeError>(file.clone())
    };
    let unsigned = encode(&[0; SIGNATURE_BYTES])?;
    let blob = Blob::decode(&unsigned).ok();
    let signed = blob.and_then(|blob| blob.signature());
    // A file that was just encoded with a signature decodes with one.
    let signature = key.0.sign(signed.map_or(&[], |signature| signature.signed));
    encode(&signature.to_bytes())
}

fn line(prefix: &str, key: &[u8; 32]) -> String {
    let digits: String = key.iter().map(|byte| format!("{byte:02x}")).collect();
    format!("{prefix}{digits}\n")
}
