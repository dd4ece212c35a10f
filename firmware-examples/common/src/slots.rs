//! Two slots for policies in flash memory. A new policy is stored and checked in one slot while the confirmed one stays
//! in the other, until the application has [confirmed](Slots::confirm) the new one. A policy that was not confirmed is
//! reverted at the next start. The power can fail at any point, and the next start still finds a working policy.
//!
//! A slot starts with two marks of 16 bytes. Each mark is written once after an erase. The policy's file follows:
//!
//! | at | mark | written |
//! |---|---|---|
//! | 0 | record: `TPGS`, sequence number, bytes of the policy, CRC-32 of these | when the policy has been checked |
//! | 16 | confirmed | when the application has confirmed the policy |
//! | 32 | the policy's file | first |
//!
//! At start the board uses the newest confirmed policy. If there is none, it uses the policy built into the firmware.
//!
//! A policy is read in place. So every step that erases the policy in use takes a function `change`, which it calls
//! first: the caller has to change over to the given file, or to the built-in policy if there is none.

use core::ops::Range;

pub use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use tpg_runtime::Policy;
use tpg_runtime::wire::{Refusal, SlotState, checksum};

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
    /// Whether each slot holds a policy that was checked and fits.
    checked: [bool; 2],
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
            checked: [false; 2],
            active: None,
            confirmed: true,
            incoming: None,
        };
        slots.checked = [0, 1].map(|slot| slots.works(slot, &fits));
        let confirmed = [0, 1].map(|slot| slots.confirmed(slot));
        slots.active = (confirmed.into_iter().flatten()).max_by_key(|found| found.sequence);
        slots
    }

    /// The file of the policy in use. `None` if the policy is the one built into the firmware.
    #[must_use]
    pub fn active(&self) -> Option<&'static [u8]> {
        self.active.map(|found| self.file(found.slot, found.bytes))
    }

    /// The file that the next start uses if the policy in use is not confirmed by then. `None` is the built-in policy.
    #[must_use]
    pub fn standing(&self) -> Option<&'static [u8]> {
        let found = match self.active {
            Some(active) if !self.confirmed => self.confirmed(1 - active.slot),
            active => active,
        };
        found.map(|found| self.file(found.slot, found.bytes))
    }

    /// The number of the slot in use: 1 or 2. It is 0 if the policy is the one built into the firmware.
    #[must_use]
    pub fn number(&self) -> u8 {
        self.active.map_or(0, |found| found.slot as u8 + 1)
    }

    /// Whether the policy in use is confirmed. The one built into the firmware always is.
    #[must_use]
    pub const fn is_confirmed(&self) -> bool {
        self.confirmed
    }

    /// State and file of slot 1 or 2. The file is empty if the slot holds no whole record.
    #[must_use]
    pub fn list(&self, number: u8) -> (SlotState, &'static [u8]) {
        let slot = match number {
            1 => 0,
            2 => 1,
            _ => return (SlotState::Empty, &[]),
        };
        let Some(found) = self.record(slot) else {
            return (SlotState::Empty, &[]);
        };
        let checked = self.checked.get(slot as usize) == Some(&true);
        let state = match (checked, self.confirmed(slot)) {
            (false, _) => SlotState::Unusable,
            (true, None) => SlotState::Unconfirmed,
            (true, Some(_)) => SlotState::Confirmed,
        };
        (state, self.file(slot, found.bytes))
    }

    /// Confirms the policy in use. Call this when it has controlled the plant well for a number of periods.
    ///
    /// # Errors
    /// [`Refusal::Memory`] with the mark's offset if the mark cannot be written. The policy is then reverted at the next
    /// start, unless a later call succeeds.
    pub fn confirm(&mut self) -> Result<(), Refused> {
        if let (false, Some(found)) = (self.confirmed, self.active) {
            let mark = self.start(found.slot) + CONFIRMED;
            let written = self.flash.write(mark, &SET);
            written.map_err(|_| (Refusal::Memory, mark))?;
            self.confirmed = true;
        }
        Ok(())
    }

    /// Gives up the policy in use and erases its slot. The confirmed policy of the other slot takes its place, or the
    /// built-in one.
    ///
    /// # Errors
    /// - [`Refusal::Oldest`] if the policy in use is the built-in one.
    /// - [`Refusal::Memory`] with the slot's offset if the erase fails. The caller has changed over all the same.
    pub fn revert(&mut self, change: impl FnOnce(Option<&'static [u8]>)) -> Result<(), Refused> {
        let active = self.active.ok_or((Refusal::Oldest, 0))?;
        self.give_up(active, change);
        self.wipe(active.slot)
    }

    /// Erases slot 1 or 2. If it is the one in use, this is a [`revert`](Self::revert).
    ///
    /// # Errors
    /// [`Refusal::Slot`] with the number if there is no such slot, and [`Refusal::Memory`] as for a revert.
    pub fn erase(
        &mut self,
        number: u8,
        change: impl FnOnce(Option<&'static [u8]>),
    ) -> Result<(), Refused> {
        let slot = match number {
            1 => 0,
            2 => 1,
            _ => return Err((Refusal::Slot, u32::from(number))),
        };
        match self.active {
            Some(active) if active.slot == slot => self.give_up(active, change),
            _ => {}
        }
        self.wipe(slot)
    }

    /// Erases the slot that is not in use, to make room for a new policy of `bytes` bytes. A policy in use that is not
    /// confirmed is given up for that, so that the confirmed one stays.
    ///
    /// # Errors
    /// - [`Refusal::Room`] with the room in bytes if the policy is too large.
    /// - [`Refusal::Memory`] with the slot's offset if the erase fails.
    pub fn begin(
        &mut self,
        bytes: u32,
        change: impl FnOnce(Option<&'static [u8]>),
    ) -> Result<(), Refused> {
        let room = self.size() - POLICY;
        if bytes > room {
            return Err((Refusal::Room, room));
        }
        if let (false, Some(active)) = (self.confirmed, self.active) {
            self.give_up(active, change);
        }
        let slot = self.active.map_or(0, |found| 1 - found.slot);
        self.wipe(slot)?;
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

    /// Checks the new policy and puts it into use. The old policy stays in its slot at least until the new one is
    /// [confirmed](Self::confirm).
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
        if let Some(checked) = self.checked.get_mut(found.slot as usize) {
            *checked = true;
        }
        self.active = Some(found);
        self.confirmed = false;
        Ok(())
    }

    /// Puts the confirmed policy of the other slot into use, or the built-in one.
    fn give_up(&mut self, active: Found, change: impl FnOnce(Option<&'static [u8]>)) {
        self.active = self.confirmed(1 - active.slot);
        self.confirmed = true;
        change(self.active());
    }

    /// Erases a slot that nothing reads any more.
    fn wipe(&mut self, slot: u32) -> Result<(), Refused> {
        self.incoming = None;
        if let Some(checked) = self.checked.get_mut(slot as usize) {
            *checked = false;
        }
        let from = self.start(slot);
        let erased = self.flash.erase(from, from + self.size());
        erased.map_err(|_| (Refusal::Memory, from))
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

    /// The policy of a slot. `None` if it was not checked or not confirmed.
    fn confirmed(&self, slot: u32) -> Option<Found> {
        let checked = self.checked.get(slot as usize) == Some(&true);
        let found = self.record(slot)?;
        (checked && self.mark(slot, CONFIRMED) == SET).then_some(found)
    }

    /// Whether a slot holds a valid policy that fits.
    fn works(&self, slot: u32, fits: impl Fn(&Policy<'static>) -> bool) -> bool {
        let file = (self.record(slot)).map(|found| self.file(slot, found.bytes));
        let policy = file.and_then(|file| Policy::load(file).ok());
        policy.is_some_and(|policy| fits(&policy))
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
