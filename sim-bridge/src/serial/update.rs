//! Gives a board a new policy over the line, while it keeps the old one.

use std::fmt;
use std::time::Duration;

use tpg_runtime::Policy;
use tpg_runtime::wire::{Answer, Identity, Refusal, Request};

use super::line::Line;
use super::port::SerialPath;
use crate::error::BridgeError;

/// Bytes of a part of the policy; a multiple of every memory's write size.
const PART: usize = 256;

/// What an update did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Updated {
    /// The board before.
    pub before: Identity,
    /// The board afterwards.
    pub after: Identity,
}

impl fmt::Display for Updated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (before, after) = (&self.before, &self.after);
        write!(
            f,
            "policy of {} bytes (checksum {:08x}) in slot {} replaced by {} bytes (checksum {:08x}) in slot {}; \
             the old one stays until the new one has decided",
            before.policy_bytes,
            before.policy_crc,
            before.slot,
            after.policy_bytes,
            after.policy_crc,
            after.slot
        )
    }
}

/// Sends a policy, read from the bytes `file`, to the board at the other end of a line, which checks and uses it.
///
/// # Errors
/// Those of the line, and [`BridgeError::BoardRefused`]; the board then goes on with its old policy.
pub fn update(
    policy: &Policy<'_>,
    file: &[u8],
    place: &SerialPath,
    timeout: Duration,
) -> Result<Updated, BridgeError> {
    let mut line = Line::open(place, timeout)?;
    let before = line.greet()?;
    let bytes = u32::try_from(file.len()).unwrap_or(u32::MAX);
    step(&mut line, Request::Begin { bytes })?;
    for (k, bytes) in file.chunks(PART).enumerate() {
        let at = u32::try_from(k * PART).unwrap_or(u32::MAX);
        step(&mut line, Request::Store { at, bytes })?;
    }
    step(&mut line, Request::Commit)?;
    line.greet_for(policy, file)?;
    let after = line.greet()?;
    Ok(Updated { before, after })
}

fn step(line: &mut Line, request: Request<'_>) -> Result<(), BridgeError> {
    let answer = line.ask(request, |answer| match answer {
        Answer::Ready => Ok(()),
        Answer::Refused { refusal, detail } => Err(Some((refusal, detail))),
        _ => Err(None),
    })?;
    answer.map_err(|refused: Option<(Refusal, u32)>| match refused {
        Some((refusal, detail)) => line.refused(refusal, detail),
        None => line.invalid("kind of answer"),
    })
}
