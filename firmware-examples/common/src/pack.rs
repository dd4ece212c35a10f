//! Several policies in one piece of memory, and the trial of each of them.
//!
//! ```text
//! "TPGP" | decisions u32 | count u32 | count times: length u32, bytes, padding to a multiple of 4
//! ```

use core::fmt;

use tpg_runtime::{Agent, CapacityError, Fixed, Policy, VerifyError};

use crate::trial::{self, Hash, Outcome};

/// First bytes of a pack.
pub const MAGIC: [u8; 4] = *b"TPGP";

/// Seed of the trials.
pub const SEED: u64 = 2025;

/// Agent of one width with room for every policy of the tests.
type Roomy<'p, const W: usize> = Agent<'p, Fixed<W>, 16384, 256, 64, 192>;

/// Why a policy of a pack could not be tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PackError {
    /// The memory holds no pack, or one that ends early.
    NoPack,
    /// A policy is none.
    Policy(VerifyError),
    /// A policy does not fit.
    Capacity(CapacityError),
    /// A policy has a width for which the trial is not compiled.
    Width(u16),
}

impl fmt::Display for PackError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoPack => write!(f, "memory holds no pack of policies, or a truncated one"),
            Self::Policy(error) => write!(f, "policy refused: {error}"),
            Self::Capacity(error) => write!(f, "policy does not fit: {error}"),
            Self::Width(width) => write!(f, "trial was not compiled for width {width}"),
        }
    }
}

impl core::error::Error for PackError {}

/// Tries every policy of a pack; reports after every [`trial::REPORT_EVERY`] decisions and at the end of each.
///
/// `report` is told the policy's number, the number of decisions so far (`None` at the end) and the hash.
///
/// # Errors
/// [`PackError`] of the first policy that cannot be tried.
pub fn try_all(
    memory: &[u8],
    mut report: impl FnMut(u32, Option<u32>, Hash),
) -> Result<(), PackError> {
    let (magic, rest) = memory.split_first_chunk::<4>().ok_or(PackError::NoPack)?;
    if *magic != MAGIC {
        return Err(PackError::NoPack);
    }
    let (decisions, rest) = number(rest)?;
    let (count, mut rest) = number(rest)?;
    for k in 0..count {
        let (len, bytes) = number(rest)?;
        let len = len as usize;
        let policy = bytes.get(..len).ok_or(PackError::NoPack)?;
        rest = bytes.get(len.next_multiple_of(4)..).unwrap_or_default();
        let policy = Policy::load(policy).map_err(PackError::Policy)?;
        let outcome = try_one(policy, decisions, |n, hash| report(k, Some(n), hash))?;
        report(k, None, outcome.hash);
    }
    Ok(())
}

/// Tries one policy on an agent of just its width, as firmware has it.
///
/// # Errors
/// [`PackError::Width`] and [`PackError::Capacity`].
pub fn try_one(
    policy: Policy<'_>,
    decisions: u32,
    report: impl FnMut(u32, Hash),
) -> Result<Outcome, PackError> {
    macro_rules! dispatch {
        ($($width:literal)*) => {
            match policy.header().width {
                $($width => {
                    let mut agent = Roomy::<$width>::new(policy).map_err(PackError::Capacity)?;
                    Ok(trial::run(&mut agent, SEED, decisions, report))
                })*
                width => Err(PackError::Width(width)),
            }
        };
    }
    dispatch!(1 2 3 4 6 8 11 17)
}

fn number(bytes: &[u8]) -> Result<(u32, &[u8]), PackError> {
    let (first, rest) = bytes.split_first_chunk::<4>().ok_or(PackError::NoPack)?;
    Ok((u32::from_le_bytes(*first), rest))
}
