//! Reads several policies from one block of memory and runs the trial of each.
//!
//! ```text
//! "TPGP" | decisions u32 | count u32 | count times: length u32, bytes, padding to a multiple of 4
//! ```

use core::fmt;

use tpg_runtime::{Agent, CapacityError, Fixed, Policy, State, VerifyError};

use crate::trial::{self, Hash, Outcome};

/// The first four bytes of a pack.
pub const MAGIC: [u8; 4] = *b"TPGP";

/// The seed of every trial.
pub const SEED: u64 = 2025;

/// An agent of one width that is large enough for every test policy.
type Roomy<'p, const W: usize> = Agent<'p, Fixed<W>, State<16384, 256, 64, 192>>;

/// Why a policy in a pack could not be run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PackError {
    /// The memory holds no pack, or the pack is truncated.
    NoPack,
    /// A policy file is invalid.
    Policy(VerifyError),
    /// A policy does not fit the agent.
    Capacity(CapacityError),
    /// The trial is not compiled for the policy's width, which is given.
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

/// Runs every policy of a pack. Calls `report` after every [`trial::REPORT_EVERY`] decisions and at the end of each
/// policy.
///
/// `report` receives the policy's number (from 0), the number of decisions so far (`None` at the end) and the hash.
///
/// # Errors
/// [`PackError`] of the first policy that cannot be run.
pub fn try_all(
    memory: &[u8],
    mut report: impl FnMut(u32, Option<u32>, Hash),
) -> Result<(), PackError> {
    for (number, policy) in (0..).zip(policies(memory)?) {
        let (decisions, policy) = policy?;
        let outcome = try_one(policy, decisions, |n, hash| report(number, Some(n), hash))?;
        report(number, None, outcome.hash);
    }
    Ok(())
}

/// The policies of a pack, each with the number of decisions to run. A damaged policy gives an error.
///
/// # Errors
/// The function returns [`PackError::NoPack`]. The iterator gives [`PackError::NoPack`] or [`PackError::Policy`].
pub fn policies(
    memory: &[u8],
) -> Result<impl Iterator<Item = Result<(u32, Policy<'_>), PackError>>, PackError> {
    let (magic, rest) = memory.split_first_chunk::<4>().ok_or(PackError::NoPack)?;
    if *magic != MAGIC {
        return Err(PackError::NoPack);
    }
    let (decisions, rest) = number(rest)?;
    let (count, mut rest) = number(rest)?;
    let mut next = move || {
        let (len, bytes) = number(rest)?;
        let len = len as usize;
        let policy = bytes.get(..len).ok_or(PackError::NoPack)?;
        rest = bytes.get(len.next_multiple_of(4)..).unwrap_or_default();
        Ok((decisions, Policy::load(policy).map_err(PackError::Policy)?))
    };
    Ok((0..count).map(move |_| next()))
}

/// Runs one policy on an agent of exactly the policy's width, as firmware does.
///
/// # Errors
/// [`PackError::Width`] or [`PackError::Capacity`].
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
