//! Gives a board a new policy over the line, lists what it stores, and takes policies back.

use std::fmt;
use std::time::Duration;

use tpg_runtime::Policy;
use tpg_runtime::wire::{Answer, Identity, Refusal, Request, SlotState, Stored};

use super::line::Line;
use super::port::SerialPath;
use crate::error::BridgeError;

/// Bytes of a part of the policy; a multiple of every memory's write size.
const PART: usize = 256;
/// Slots of a board, with the policy that its firmware was built with.
const SLOTS: u8 = 3;

/// What changed on a board.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Updated {
    /// The board before.
    pub before: Identity,
    /// The board afterwards.
    pub after: Identity,
    /// Whether the policy in use is confirmed.
    pub confirmed: bool,
}

impl fmt::Display for Updated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (before, after) = (&self.before, &self.after);
        write!(
            f,
            "policy of {} bytes (checksum {:08x}) in slot {} replaced by {} bytes (checksum {:08x}) in slot {}",
            before.policy_bytes,
            before.policy_crc,
            before.slot,
            after.policy_bytes,
            after.policy_crc,
            after.slot
        )?;
        if self.confirmed {
            return Ok(());
        }
        write!(
            f,
            "; the board reverts it at its next start, unless it is confirmed by then"
        )
    }
}

/// The slots of a board. Slot 0 is the policy that its firmware was built with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Listed(pub Vec<Stored>);

impl fmt::Display for Listed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, slot) in self.0.iter().enumerate() {
            if k > 0 {
                writeln!(f)?;
            }
            write!(f, "slot {}: ", slot.number)?;
            if slot.state == SlotState::Empty {
                write!(f, "empty")?;
                continue;
            }
            write!(f, "{} bytes, checksum {:08x}, ", slot.bytes, slot.crc)?;
            let state = match (slot.state, slot.in_use) {
                _ if slot.number == 0 => "built into the firmware",
                (SlotState::Unconfirmed, true) => "not confirmed yet",
                (SlotState::Unconfirmed, false) => "reverted, since it was not confirmed",
                (SlotState::Unusable, _) => "of no use for this firmware",
                (state, _) => state.name(),
            };
            write!(f, "{state}{}", if slot.in_use { ", in use" } else { "" })?;
        }
        Ok(())
    }
}

/// The way to a board whose policies are to be seen to.
#[derive(Debug)]
pub struct Updater {
    line: Line,
    before: Identity,
}

impl Updater {
    /// Opens the line and greets the board.
    ///
    /// # Errors
    /// Those of [`Line::open`] and [`Line::greet`].
    pub fn connect(place: &SerialPath, timeout: Duration) -> Result<Self, BridgeError> {
        let mut line = Line::open(place, timeout)?;
        let before = line.greet()?;
        Ok(Updater { line, before })
    }

    /// Sends a policy, read from the bytes `file`, to the board, which checks and uses it.
    ///
    /// # Errors
    /// Those of the line, and [`BridgeError::BoardRefused`]; the board then goes on with its last confirmed policy.
    pub fn update(mut self, policy: &Policy<'_>, file: &[u8]) -> Result<Updated, BridgeError> {
        let bytes = u32::try_from(file.len()).unwrap_or(u32::MAX);
        self.step(Request::Begin { bytes })?;
        for (k, bytes) in file.chunks(PART).enumerate() {
            let at = u32::try_from(k * PART).unwrap_or(u32::MAX);
            self.step(Request::Store { at, bytes })?;
        }
        self.step(Request::Commit)?;
        self.line.greet_for(policy, file)?;
        self.changed()
    }

    /// Asks for what the slots hold.
    ///
    /// # Errors
    /// Those of the line, and [`BridgeError::BoardRefused`] if the board has no slots.
    pub fn list(&mut self) -> Result<Listed, BridgeError> {
        (0..SLOTS)
            .map(|number| self.slot(number))
            .collect::<Result<_, _>>()
            .map(Listed)
    }

    /// Gives up the policy in use for the one before it.
    ///
    /// # Errors
    /// Those of the line, and [`BridgeError::BoardRefused`] if the board uses the policy that it was built with.
    pub fn revert(mut self) -> Result<Updated, BridgeError> {
        self.step(Request::Revert)?;
        self.changed()
    }

    /// Erases both slots, that in use last, so that the policy that the firmware was built with is used.
    ///
    /// # Errors
    /// Those of the line, and [`BridgeError::BoardRefused`].
    pub fn erase(mut self) -> Result<Updated, BridgeError> {
        let in_use = self.before.slot;
        let order = if in_use == 1 { [2, 1] } else { [1, 2] };
        for number in order {
            self.step(Request::Erase { number })?;
        }
        self.changed()
    }

    fn slot(&mut self, number: u8) -> Result<Stored, BridgeError> {
        let answer = self
            .line
            .ask(Request::Slot { number }, |answer| match answer {
                Answer::Slot(stored) => Ok(stored),
                other => Err(refusal(other)),
            })?;
        answer.map_err(|refused| self.error(refused))
    }

    fn step(&mut self, request: Request<'_>) -> Result<(), BridgeError> {
        let answer = self.line.ask(request, |answer| match answer {
            Answer::Ready => Ok(()),
            other => Err(refusal(other)),
        })?;
        answer.map_err(|refused| self.error(refused))
    }

    fn changed(mut self) -> Result<Updated, BridgeError> {
        let after = self.line.greet()?;
        let confirmed = self.slot(after.slot)?.state == SlotState::Confirmed;
        Ok(Updated {
            before: self.before,
            after,
            confirmed,
        })
    }

    fn error(&self, refused: Option<(Refusal, u32)>) -> BridgeError {
        match refused {
            Some((refusal, detail)) => self.line.refused(refusal, detail),
            None => self.line.invalid("kind of answer"),
        }
    }
}

fn refusal(answer: Answer<'_>) -> Option<(Refusal, u32)> {
    match answer {
        Answer::Refused { refusal, detail } => Some((refusal, detail)),
        _ => None,
    }
}
