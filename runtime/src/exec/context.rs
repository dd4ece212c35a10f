//! What instructions reach beyond the registers: evolved constants and shared memory.

use crate::blob::InitialValues;
use crate::isa::{REGISTERS, Section};
use crate::math::{Mask, Word};
use crate::memory::{IndexedStream, draw_slot};
use crate::rng::Pcg32;
use crate::tables::{Instruction, Program, ProgramRecord, Team, TeamRecord};
use crate::trace::{MemoryAddress, Observer};
use crate::verify::Policy;

/// The program that runs, the team that runs it, and the memory that they share with others.
pub struct Context<'m, V: Word, O> {
    pub policy: &'m Policy<'m>,
    /// As stored, since most programs read nothing of either.
    pub team: &'m TeamRecord,
    pub program: &'m ProgramRecord,
    /// The lanes that run the program.
    pub running: V::Mask,
    /// Those of the first stream, one for each lane, and so on.
    pub streams: &'m mut [Pcg32],
    /// One for each lane.
    pub indexed: &'m mut [IndexedStream],
    pub observer: &'m mut O,
}

impl<V: Word, O: Observer> Context<'_, V, O> {
    /// Sets the register at `d` to its evolved constants: both lie equally far from their starts.
    pub(super) fn reload(&self, words: &mut [V], d: u16, len: usize) {
        let program = Program::from_bytes(self.program);
        let offset = u32::from(d.saturating_sub(program.state_start));
        let constants_start = program.constants_start + offset;
        fill_initial(self.policy, words, d, constants_start, len, self.running);
    }

    /// Writes the register at `source` to a random slot (thesis Equation 3.4.1). Slots that nobody reads are not kept.
    pub(super) fn write(&mut self, words: &mut [V], section: Section, source: usize, width: usize) {
        let team = Team::from_bytes(self.team);
        let Some(stream) = team.stream(section) else {
            return;
        };
        let distribution = self.policy.header.write_distribution.built();
        for lane in lanes::<V>(self.running) {
            let Some(stream) = self.streams.get_mut(stream * V::LANES + lane) else {
                return;
            };
            let slot = draw_slot(stream, distribution);
            if let Some(start) = team.slot_start(section, slot, width) {
                self.observer
                    .write(MemoryAddress::Slot(section, slot as u16));
                copy(
                    words,
                    source,
                    start,
                    section.slot_words(width),
                    only::<V>(lane),
                );
            }
        }
    }

    /// Reads one scalar: element `b` of slot `a`.
    pub(super) fn read(
        &mut self,
        words: &mut [V],
        section: Section,
        Instruction { d, a, b, .. }: Instruction,
        width: usize,
    ) {
        if let Some(start) = Team::from_bytes(self.team).slot_start(section, usize::from(a), width)
        {
            self.observer.read(MemoryAddress::Slot(section, a));
            copy(
                words,
                start + usize::from(b),
                usize::from(d),
                1,
                self.running,
            );
        }
    }

    /// Reads all that a slot holds into the register at `d`.
    pub(super) fn read_whole(
        &mut self,
        words: &mut [V],
        section: Section,
        [d, slot]: [usize; 2],
        width: usize,
    ) {
        if let Some(start) = Team::from_bytes(self.team).slot_start(section, slot, width) {
            self.observer
                .read(MemoryAddress::Slot(section, slot as u16));
            copy(words, start, d, section.slot_words(width), self.running);
        }
    }

    /// Overwrites each kept cell, with its probability, by the register of its column (thesis Equation 2.4.2).
    pub(super) fn write_cells(&mut self, words: &mut [V]) {
        // Where no cell is kept, the number of the write matters to nobody.
        if self.policy.tables.cells.is_empty() {
            return;
        }
        let first = self.policy.cells_start();
        let registers = usize::from(Program::from_bytes(self.program).state_start);
        let distribution = self.policy.header.write_distribution.built();
        for lane in lanes::<V>(self.running) {
            let Some(stream) = self.indexed.get_mut(lane) else {
                return;
            };
            let write = stream.begin_write();
            for (k, cell) in write.reached(self.policy.tables.cells, distribution) {
                self.observer.write(MemoryAddress::Cell(cell));
                let column = usize::from(cell) % REGISTERS;
                copy(words, registers + column, first + k, 1, only::<V>(lane));
            }
        }
    }
}

/// The lanes of a mask, in order.
#[inline(always)]
pub(crate) fn lanes<V: Word>(mask: V::Mask) -> impl Iterator<Item = usize> {
    (0..V::LANES).filter(move |lane| mask.has(*lane))
}

/// The mask of one lane.
#[inline(always)]
pub(crate) fn only<V: Word>(lane: usize) -> V::Mask {
    V::Mask::of(|k| k == lane)
}

/// Copies words within the state, one by one: `copy_within` would bring a panic into the decision.
fn copy<V: Word>(words: &mut [V], from: usize, to: usize, len: usize, running: V::Mask) {
    for k in 0..len {
        let value = words.get(from + k).copied();
        if let (Some(value), Some(place)) = (value, words.get_mut(to + k)) {
            *place = value.over(*place, running);
        }
    }
}

/// Tells the observer which cell lies at a state offset.
#[inline(always)]
pub(super) fn read_cell(policy: &Policy<'_>, observer: &mut impl Observer, at: u16) {
    let k = usize::from(at).checked_sub(policy.cells_start());
    if let Some(bytes) = k.and_then(|k| policy.tables.cells.get(k)) {
        observer.read(MemoryAddress::Cell(u16::from_le_bytes(*bytes)));
    }
}

/// Sets a program's registers to their initial values in the lanes that run it.
#[inline(always)]
pub(crate) fn reset_registers<V: Word>(
    policy: &Policy<'_>,
    words: &mut [V],
    program: &Program,
    running: V::Mask,
) {
    let len = program.register_words(usize::from(policy.header.width));
    fill_initial(
        policy,
        words,
        program.state_start,
        program.constants_start,
        len,
        running,
    );
}

/// Sets `len` words at `start` to the constants from `constants_start` on, or to zero if there are none.
pub(crate) fn fill_initial<V: Word>(
    policy: &Policy<'_>,
    words: &mut [V],
    start: u16,
    constants_start: u32,
    len: usize,
    running: V::Mask,
) {
    let Some(place) = words
        .get_mut(usize::from(start)..)
        .and_then(|rest| rest.get_mut(..len))
    else {
        return;
    };
    match policy.header.initial_values {
        InitialValues::Zero => {
            for word in place {
                *word = V::ZERO.over(*word, running);
            }
        }
        InitialValues::Evolved => {
            let constants = policy.tables.constants.get(constants_start as usize..);
            for (word, bytes) in place.iter_mut().zip(constants.unwrap_or_default()) {
                *word = V::splat(f32::from_le_bytes(*bytes)).over(*word, running);
            }
        }
    }
}
