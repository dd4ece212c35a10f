//! Replays a policy's golden run, which the host recorded.

use core::fmt;

use tpg_runtime::{Agent, Storage, Width};

use crate::pack::SEED;
use crate::trial::{self, Hash};

/// Why a self-test failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SelftestError {
    /// This line of the golden run is missing or unreadable. Lines count from 1.
    Golden(usize),
    /// This machine's result differs from the host's.
    Differs {
        /// The number of decisions at the comparison that failed. The last comparison also covers the final state. If
        /// decisions differ, the first different one is among the last hundred.
        decisions: u32,
        /// The host's hash.
        expected: Hash,
        /// This machine's hash.
        got: Hash,
    },
}

impl fmt::Display for SelftestError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Golden(line) => write!(
                f,
                "line {line} of the golden run is missing or unreadable: make it again, see README.md"
            ),
            Self::Differs {
                decisions,
                expected,
                got,
            } => write!(
                f,
                "after {decisions} decisions the hash is {:016x}, on the host it was {:016x}",
                got.0, expected.0
            ),
        }
    }
}

impl core::error::Error for SelftestError {}

/// Replays a golden run and returns the number of decisions, all of which agreed.
///
/// Each line of `golden` holds a number of decisions, a space and a hash in hexadecimal. The last line's hash also
/// covers the final state.
///
/// # Errors
/// [`SelftestError`] of the first line that does not agree.
pub fn check<W: Width, S: Storage>(
    agent: &mut Agent<'_, W, S>,
    golden: &str,
) -> Result<u32, SelftestError> {
    let count = golden.lines().count();
    let mut lines = golden.lines().enumerate();
    let mut next = move || {
        let (at, line) = lines.next().ok_or(SelftestError::Golden(count + 1))?;
        parse(line).ok_or(SelftestError::Golden(at + 1))
    };
    let decisions = match golden.lines().last().and_then(parse) {
        Some((decisions, _)) => decisions,
        None => return Err(SelftestError::Golden(count.max(1))),
    };
    let mut agreed = Ok(());
    let mut compare = |number, got| {
        if agreed.is_ok() {
            agreed = match next() {
                Ok((due, expected)) if (due, expected) == (number, got) => Ok(()),
                Ok((_, expected)) => Err(SelftestError::Differs {
                    decisions: number,
                    expected,
                    got,
                }),
                Err(error) => Err(error),
            };
        }
    };
    let outcome = trial::run(agent, SEED, decisions, &mut compare);
    compare(decisions, outcome.hash);
    agreed.map(|()| decisions)
}

fn parse(line: &str) -> Option<(u32, Hash)> {
    let (decisions, hash) = line.split_once(' ')?;
    let hash = u64::from_str_radix(hash, 16).ok()?;
    Some((decisions.parse().ok()?, Hash(hash)))
}
