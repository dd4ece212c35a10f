//! Rewrites a policy of an older format version in the newest one.

use std::fmt;

use tpg_runtime::blob::{EncodeError, VERSION, encode, encoded_bound};
use tpg_runtime::{Policy, VerifyError};

/// Why a policy cannot be rewritten. Its file stays usable as it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ConvertError {
    /// It is larger than a file may be.
    Encode(EncodeError),
    /// The newest version refuses what the older one allowed, such as a team that lists a program twice.
    Verify(VerifyError),
}

impl fmt::Display for ConvertError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Encode(error) => error.fmt(f),
            Self::Verify(error) => write!(f, "format version {VERSION} refuses it: {error}"),
        }
    }
}

impl std::error::Error for ConvertError {}

/// The file of a policy in the newest format version, with its contract and without a signature.
///
/// It decides the same bits. The exception are policies of version 2 and observations of which a part is missing or all
/// is zero: version 3 fills in each missing element by itself, and zero is a value.
///
/// # Errors
/// [`ConvertError`] if the newest version does not allow the policy.
pub fn convert(policy: &Policy<'_>) -> Result<Vec<u8>, ConvertError> {
    let mut file = vec![0; encoded_bound(policy.tables())];
    let len = encode(policy.header(), policy.tables(), &mut file).map_err(ConvertError::Encode)?;
    file.truncate(len);
    Policy::load(&file).map_err(ConvertError::Verify)?;
    Ok(file)
}
