//! Accesses to evolved constants and shared memory.

use super::{Shared, fill_initial};
use crate::isa::REGISTERS;
use crate::memory::draw_slot;
use crate::tables::{Instruction, Program, Section, Team};
use crate::trace::{MemoryAddress, Observer};
use crate::verify::Policy;

/// Sets a register to its evolved constant: both lie equally far from their starts.
pub(super) fn reload(
    policy: &Policy<'_>,
    words: &mut [f32],
    program: &Program,
    d: u16,
    len: usize,
) {
    let offset = u32::from(d.saturating_sub(program.state_start));
    fill_initial(policy, words, d, program.constants_start + offset, len);
}

/// Writes a register to a slot drawn at random (thesis Equation 3.4.1); slots that nobody reads are not kept.
pub(super) fn write<O: Observer>(
    policy: &Policy<'_>,
    words: &mut [f32],
    shared: &mut Shared<'_, O>,
    team: &Team,
    section: Section,
    source: usize,
    width: usize,
) {
    let Some(stream) = team.stream(section).and_then(|s| shared.streams.get_mut(s)) else {
        return;
    };
    let slot = draw_slot(stream, policy.header.write_distribution.built());
    let Some(start) = team.slot_start(section, slot, width) else {
        return;
    };
    shared
        .observer
        .write(MemoryAddress::Slot(section, slot as u16));
    copy(words, source, start, section.slot_words(width));
}

/// Copies words within the state, one by one: `copy_within` would bring a panic into the decision.
fn copy(words: &mut [f32], from: usize, to: usize, len: usize) {
    for k in 0..len {
        let value = words.get(from + k).copied();
        if let (Some(value), Some(place)) = (value, words.get_mut(to + k)) {
            *place = value;
        }
    }
}

pub(super) fn read<O: Observer>(
    words: &mut [f32],
    shared: &mut Shared<'_, O>,
    team: &Team,
    section: Section,
    i: Instruction,
    width: usize,
) {
    if let Some(start) = team.slot_start(section, usize::from(i.a), width) {
        shared.observer.read(MemoryAddress::Slot(section, i.a));
        copy(words, start + usize::from(i.b), usize::from(i.d), 1);
    }
}

pub(super) fn read_whole<O: Observer>(
    words: &mut [f32],
    shared: &mut Shared<'_, O>,
    team: &Team,
    section: Section,
    [d, slot]: [usize; 2],
    width: usize,
) {
    if let Some(start) = team.slot_start(section, slot, width) {
        shared
            .observer
            .read(MemoryAddress::Slot(section, slot as u16));
        copy(words, start, d, section.slot_words(width));
    }
}

/// Overwrites each kept cell, with its probability, by the register of its column (thesis Equation 2.4.2).
pub(super) fn write_indexed<O: Observer>(
    policy: &Policy<'_>,
    words: &mut [f32],
    shared: &mut Shared<'_, O>,
    program: &Program,
) {
    let write = shared.indexed.begin_write();
    let first = policy.cells_start();
    let distribution = policy.header.write_distribution.built();
    for (k, cell) in write.reached(policy.tables.cells, distribution) {
        shared.observer.write(MemoryAddress::Cell(cell));
        let column = usize::from(cell) % REGISTERS;
        copy(
            words,
            usize::from(program.state_start) + column,
            first + k,
            1,
        );
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
