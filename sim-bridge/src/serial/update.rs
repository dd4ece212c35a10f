//! Gives a board a new policy over the line, lists what it stores, and takes policies back.

use std::fmt;
use std::time::Duration;

use tpg_runtime::Policy;
use tpg_runtime::blob::VERSION;
use tpg_runtime::isa::{EDITIONS, Edition};
use tpg_runtime::wire::{self, Answer, Identity, Refusal, Request, Signed, SlotState, Stored};

use super::contract::{self, Contract};
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
    /// Whether it is signed.
    pub signed: Signed,
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
        write!(f, ", {}", self.signed.name())?;
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
            if slot.release > 0 {
                write!(f, "release {}, ", slot.release)?;
            }
            write!(f, "{}, ", slot.signed.name())?;
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

    /// Compares the policy with the board and its confirmed policy. Returns what plant and policy would disagree on.
    ///
    /// # Errors
    /// Those of the line, and [`BridgeError::OtherBoard`] if the board's firmware cannot read the file at all.
    pub fn compare(
        &mut self,
        policy: &Policy<'_>,
        file: &[u8],
    ) -> Result<Vec<String>, BridgeError> {
        let version = |bytes: &[u8; 2]| u16::from_le_bytes(*bytes);
        let format = file
            .get(4..)
            .and_then(<[u8]>::first_chunk)
            .map_or(0, version);
        let known = self.before.format;
        if format > known {
            return Err(self.line.other(
                format!("file has format version {format}, the board reads versions up to {known}"),
                "update its firmware",
            ));
        }
        let theirs = self.before.instruction_set;
        let needed = Edition::of_groups(policy.header().groups);
        match Edition::find(theirs) {
            // A later edition has all operations of the ones before.
            Some(known) if known.operations >= needed.operations => {}
            Some(_) => {
                return Err(self.line.other(
                    format!(
                        "file needs instruction set {:08x}, the board has {theirs:08x}",
                        needed.fingerprint
                    ),
                    "update its firmware",
                ));
            }
            None => {
                let [.., newest] = EDITIONS;
                return Err(self.line.other(
                    format!(
                        "instruction set is {:08x} here, {theirs:08x} there",
                        newest.fingerprint
                    ),
                    "build the firmware from the same version as tpg",
                ));
            }
        }
        let (there, here) = (self.contract()?, contract::bytes_of(policy));
        if there == here {
            return Ok(Vec::new());
        }
        let read = |bytes: &[u8]| Contract::read(bytes);
        let (Some(there), Some(here)) = (read(&there), read(&here)) else {
            return Err(self.line.invalid("contract"));
        };
        Ok(there.differences(&here))
    }

    /// Whether the policy tells missing elements from zeros, and the one that the board uses does not. Then the plant must
    /// send NaN for what is missing.
    ///
    /// # Errors
    /// Those of the line, and [`BridgeError::BoardRefused`] if the board has no slots.
    pub fn begins_to_need_nan(&mut self, policy: &Policy<'_>) -> Result<bool, BridgeError> {
        let tells = policy.front_end().is_some() && policy.header().has_missing_values();
        Ok(tells && self.slot(self.before.slot)?.format < VERSION)
    }

    /// Sends a policy, read from the bytes `file`, to the board, which checks and uses it. `force` sends one for another
    /// robot too.
    ///
    /// # Errors
    /// Those of the line and of [`compare`](Self::compare), [`BridgeError::OtherRobot`], and
    /// [`BridgeError::BoardRefused`]; the board then goes on with its last confirmed policy.
    pub fn update(
        mut self,
        policy: &Policy<'_>,
        file: &[u8],
        force: bool,
    ) -> Result<Updated, BridgeError> {
        let differences = self.compare(policy, file)?;
        if !force && !differences.is_empty() {
            return Err(BridgeError::OtherRobot {
                path: self.line.path().to_owned(),
                differences,
            });
        }
        self.step(Request::Begin {
            bytes: u32::try_from(file.len()).unwrap_or(u32::MAX),
            contract: wire::contract_of(file),
            release: policy.header().release,
            forced: force,
        })?;
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

    /// The contract of the board's confirmed policy.
    fn contract(&mut self) -> Result<Vec<u8>, BridgeError> {
        let mut contract = Vec::new();
        loop {
            let at = u32::try_from(contract.len()).unwrap_or(u32::MAX);
            let answer = self
                .line
                .ask(Request::Contract { at }, |answer| match answer {
                    Answer::Contract { total, bytes } => Ok((total, bytes.to_vec())),
                    other => Err(refusal(other)),
                })?;
            let (total, part) = answer.map_err(|refused| self.error(refused))?;
            contract.extend(&part);
            if contract.len() >= total as usize {
                return Ok(contract);
            }
            if part.is_empty() {
                return Err(self.line.invalid("contract"));
            }
        }
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
        let slot = self.slot(after.slot)?;
        Ok(Updated {
            before: self.before,
            after,
            confirmed: slot.state == SlotState::Confirmed,
            signed: slot.signed,
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
