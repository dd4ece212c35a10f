//! Two slots for policies in flash memory. A new policy is stored and checked in one slot while the old one stays in
//! the other. The old one stays until the new one has made a decision. The power can fail at any point, and the next
//! start still finds a working policy.
//!
//! A slot starts with two marks of 16 bytes. Each mark is written once after an erase. The policy's file follows:
//!
//! | at | mark | written |
//! |---|---|---|
//! | 0 | record: `TPGS`, sequence number, bytes of the policy, CRC-32 of these | when the policy has been checked |
//! | 16 | confirmed | when the policy has made a decision |
//! | 32 | the policy's file | first |
//!
//! At start the board uses the newest confirmed policy. If there is none, it uses the policy built into the firmware.

use core::ops::Range;

pub use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use tpg_runtime::Policy;
use tpg_runtime::wire::{Refusal, checksum};

/// Flash memory that holds the two slots. Each slot takes one half. A program can read the memory in place.
pub trait Flash: NorFlash {
    /// The bytes in a range of addresses, counted from the start of the flash.
    ///
    /// They may change only when that range is erased or written.
    fn mapped(&self, part: Range<u32>) -> &'static [u8];
}

const MAGIC: [u8; 4] = *b"TPGS";
const MARK: usize = 16;
const CONFIRMED: u32 = 16;
const POLICY: u32 = 32;
const SET: [u8; MARK] = [0x5a; MARK];

/// A policy in a slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Found {
    slot: u32,
    sequence: u32,
    bytes: u32,
}

/// A policy that is being written into a slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Incoming {
    slot: u32,
    bytes: u32,
    stored: u32,
}

/// The two slots.
#[derive(Debug)]
pub struct Slots<F> {
    flash: F,
    active: Option<Found>,
    confirmed: bool,
    incoming: Option<Incoming>,
}

/// Why a step of an update was refused, and the number that explains it, such as the room in bytes.
pub type Refused = (Refusal, u32);

impl<F: Flash> Slots<F> {
    /// Opens the slots and chooses the policy to use. `fits` tells whether the firmware's agent can hold a policy.
    pub fn open(flash: F, fits: impl Fn(&Policy<'static>) -> bool) -> Self {
        const { assert!(MARK.is_multiple_of(F::WRITE_SIZE), "marks are 16 bytes") };
        let mut slots = Slots {
            flash,
            active: None,
            confirmed: true,
            incoming: None,
        };
        let confirmed = [0, 1].map(|slot| slots.found(slot, &fits));
        slots.active = (confirmed.into_iter().flatten()).max_by_key(|found| found.sequence);
        slots
    }

    /// The file of the policy in use. `None` if the policy is the one built into the firmware.
    #[must_use]
    pub fn active(&self) -> Option<&'static [u8]> {
        let found = self.active?;
        Some(self.file(found.slot, found.bytes))
    }

    /// The number of the slot in use: 1 or 2. It is 0 if the policy is the one built into the firmware.
    #[must_use]
    pub fn number(&self) -> u8 {
        self.active.map_or(0, |found| found.slot as u8 + 1)
    }

    /// Confirms a new policy. Call this after the policy in use has made a decision.
    pub fn decided(&mut self) {
        if let (false, Some(found)) = (self.confirmed, self.active) {
            // If the write fails, the next decision tries again.
            let mark = self.start(found.slot) + CONFIRMED;
            self.confirmed = self.flash.write(mark, &SET).is_ok();
        }
    }

    /// Erases the slot that is not in use, to make room for a new policy of `bytes` bytes.
    ///
    /// # Errors
    /// - [`Refusal::Untried`] if the policy in use is not confirmed yet.
    /// - [`Refusal::Room`] with the room in bytes if the policy is too large.
    /// - [`Refusal::Memory`] with the slot's offset if the erase fails.
    pub fn begin(&mut self, bytes: u32) -> Result<(), Refused> {
        if !self.confirmed {
            return Err((Refusal::Untried, 0));
        }
        let room = self.size() - POLICY;
        if bytes > room {
            return Err((Refusal::Room, room));
        }
        let slot = match self.active {
            Some(found) => 1 - found.slot,
            None => 0,
        };
        self.incoming = None;
        let from = self.start(slot);
        let erased = self.flash.erase(from, from + self.size());
        erased.map_err(|_| (Refusal::Memory, from))?;
        self.incoming = Some(Incoming {
            slot,
            bytes,
            stored: 0,
        });
        Ok(())
    }

    /// Stores the next part of the new policy at offset `at` of its file. The length of every part except the last
    /// must be a multiple of the memory's write size.
    ///
    /// # Errors
    /// - [`Refusal::Order`] with the bytes stored so far if the part is not the next one or has a bad length. The
    ///   number is 0 if no update has begun.
    /// - [`Refusal::Room`] with the bytes still expected if the part is too long.
    /// - [`Refusal::Memory`] with the offset if the write fails.
    pub fn store(&mut self, at: u32, bytes: &[u8]) -> Result<(), Refused> {
        let mut incoming = self.incoming.ok_or((Refusal::Order, 0))?;
        let len = bytes.len() as u32;
        let last = incoming.stored + len == incoming.bytes;
        let whole = bytes.len().is_multiple_of(F::WRITE_SIZE);
        if at != incoming.stored || !(whole || last) {
            return Err((Refusal::Order, incoming.stored));
        }
        if len > incoming.bytes - incoming.stored {
            return Err((Refusal::Room, incoming.bytes - incoming.stored));
        }
        let place = self.start(incoming.slot) + POLICY + at;
        let (head, tail) = bytes.split_at(bytes.len() - bytes.len() % F::WRITE_SIZE);
        let mut padded = [0xff; MARK];
        for (place, byte) in padded.iter_mut().zip(tail) {
            *place = *byte;
        }
        let padding = padded.get(..F::WRITE_SIZE).unwrap_or_default();
        let mut written = self.flash.write(place, head);
        if written.is_ok() && !tail.is_empty() {
            written = self.flash.write(place + head.len() as u32, padding);
        }
        // A failed write may have stored some bytes, so the host has to begin again.
        if written.is_err() {
            self.incoming = None;
            return Err((Refusal::Memory, place));
        }
        incoming.stored += len;
        self.incoming = Some(incoming);
        Ok(())
    }

    /// Checks the new policy and puts it into use. The old policy stays in its slot until the new one has
    /// [made a decision](Self::decided).
    ///
    /// # Errors
    /// - [`Refusal::Order`] with the bytes stored so far if parts are missing, or 0 if no update has begun.
    /// - [`Refusal::Policy`] with the file's length if the file is invalid.
    /// - The error of `fits`.
    /// - [`Refusal::Memory`] with the slot's offset if the record cannot be written.
    pub fn commit(
        &mut self,
        fits: impl Fn(&Policy<'static>) -> Result<(), Refused>,
    ) -> Result<(), Refused> {
        let incoming = self.incoming.ok_or((Refusal::Order, 0))?;
        if incoming.stored != incoming.bytes {
            return Err((Refusal::Order, incoming.stored));
        }
        let file = self.file(incoming.slot, incoming.bytes);
        let policy = Policy::load(file).map_err(|_| (Refusal::Policy, incoming.bytes))?;
        fits(&policy)?;
        self.incoming = None;
        let newest = [0, 1].map(|slot| self.record(slot).map_or(0, |found| found.sequence));
        let found = Found {
            slot: incoming.slot,
            sequence: newest.into_iter().max().unwrap_or(0).wrapping_add(1),
            bytes: incoming.bytes,
        };
        let start = self.start(found.slot);
        let written = self.flash.write(start, &encode(&found));
        written.map_err(|_| (Refusal::Memory, start))?;
        self.active = Some(found);
        self.confirmed = false;
        Ok(())
    }

    /// The size of a slot in bytes. It is a multiple of the erase size.
    fn size(&self) -> u32 {
        let half = self.flash.capacity() as u32 / 2;
        half - half % F::ERASE_SIZE as u32
    }

    fn start(&self, slot: u32) -> u32 {
        slot * self.size()
    }

    fn file(&self, slot: u32, bytes: u32) -> &'static [u8] {
        let from = self.start(slot) + POLICY;
        self.flash.mapped(from..from + bytes)
    }

    fn mark(&self, slot: u32, at: u32) -> &'static [u8] {
        let from = self.start(slot) + at;
        self.flash.mapped(from..from + MARK as u32)
    }

    /// The record of a slot. `None` if the record is missing or incomplete.
    fn record(&self, slot: u32) -> Option<Found> {
        let (fields, _) = self.mark(slot, 0).as_chunks::<4>();
        let [magic, sequence, bytes, _] = fields else {
            return None;
        };
        let found = Found {
            slot,
            sequence: u32::from_le_bytes(*sequence),
            bytes: u32::from_le_bytes(*bytes),
        };
        let whole = *magic == MAGIC && self.mark(slot, 0) == encode(&found);
        (whole && found.bytes <= self.size() - POLICY).then_some(found)
    }

    /// The policy of a slot. `None` if it is not confirmed, is invalid or does not fit.
    fn found(&self, slot: u32, fits: impl Fn(&Policy<'static>) -> bool) -> Option<Found> {
        let found = self.record(slot)?;
        if self.mark(slot, CONFIRMED) != SET {
            return None;
        }
        let policy = Policy::load(self.file(slot, found.bytes)).ok()?;
        fits(&policy).then_some(found)
    }
}

fn encode(found: &Found) -> [u8; MARK] {
    let mut mark = [0; MARK];
    let fields = [
        MAGIC,
        found.sequence.to_le_bytes(),
        found.bytes.to_le_bytes(),
    ];
    let [place @ .., last] = mark.as_chunks_mut::<4>().0 else {
        return mark;
    };
    for (place, field) in place.iter_mut().zip(&fields) {
        *place = *field;
    }
    *last = checksum(fields.as_flattened()).to_le_bytes();
    mark
}
