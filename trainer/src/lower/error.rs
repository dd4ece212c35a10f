//! Why a graph cannot be lowered: the format has limits.

use tpg_runtime::blob::EncodeError;

/// Why a graph cannot be lowered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LowerError {
    /// Something of it is too large for its field.
    #[error("the policy needs {needed} {what}, the format allows {limit}")]
    TooLarge {
        /// What there is too much of.
        what: &'static str,
        /// How much the policy needs.
        needed: usize,
        /// How much the format allows.
        limit: usize,
    },
    /// The blob did not fit the buffer sized for it.
    #[error("blob could not be encoded")]
    Encode(#[from] EncodeError),
}

/// Refuses a number of things that is above the format's limit.
pub(super) fn limit(what: &'static str, needed: usize, limit: usize) -> Result<(), LowerError> {
    if needed > limit {
        return Err(LowerError::TooLarge {
            what,
            needed,
            limit,
        });
    }
    Ok(())
}

/// A number as a 16-bit field, refused if it is larger.
pub(super) fn small(what: &'static str, value: usize) -> Result<u16, LowerError> {
    limit(what, value, usize::from(u16::MAX))?;
    Ok(value as u16)
}
