//! Checks the teams' members and memory, and the cells of indexed memory.

use super::error::VerifyError;
use super::header::{MAX_WORDS, at_most, count, require};
use super::programs::{has_constants, within};
use crate::blob::{ActionKind, Header, MemoryModel};
use crate::isa::{Destination, INDEXED_CELLS, Op, Section};
use crate::outputs::OutputSet;
use crate::parts::{CodeField, Field, Table};
use crate::tables::{Instruction, Program, ProgramId, Tables, Target, Team, TeamId, span};

/// Checks team memory and the cells of indexed memory, which follow the programs' registers in the state.
///
/// Returns the number of state words.
pub(super) fn check_memory(
    header: &Header,
    tables: &Tables<'_>,
    memory_start: usize,
) -> Result<u32, VerifyError> {
    let width = usize::from(header.width);
    let (mut state, mut members, mut streams) = (memory_start, 0u32, 0usize);
    for (index, bytes) in tables.teams.iter().enumerate() {
        let team = Team::from_bytes(bytes);
        let words = team.memory_words(width);
        let in_place = team.to_bytes() == *bytes
            && team.members_start == members
            && span(tables.members, team.members_start, team.members_len).is_some()
            && usize::from(team.memory_start) == state
            && usize::from(team.streams_start) == streams
            && (words == 0 || header.memory_model == MemoryModel::Team)
            && has_constants(header, tables, team.constants_start, words);
        if !in_place {
            return Err(VerifyError::Record {
                table: Table::Teams,
                index: index as u32,
            });
        }
        members += u32::from(team.members_len);
        state += words;
        streams += team.streams();
        at_most(Field::Words, MAX_WORDS, state as u32)?;
    }
    require(Field::Members, members, count(tables.members))?;
    require(Field::Streams, streams as u32, u32::from(header.streams))?;
    let mut previous = None;
    for (index, bytes) in tables.cells.iter().enumerate() {
        let cell = u16::from_le_bytes(*bytes);
        let ascending = previous.is_none_or(|p| cell > p);
        if !ascending || usize::from(cell) >= INDEXED_CELLS {
            return Err(VerifyError::Record {
                table: Table::Cells,
                index: index as u32,
            });
        }
        previous = Some(cell);
    }
    let cells = (state, state + tables.cells.len());
    at_most(Field::Words, MAX_WORDS, cells.1 as u32)?;
    for (index, bytes) in tables.code.iter().enumerate() {
        if let Some(i) = Instruction::from_bytes(bytes)
            && i.op == Op::MemRead
            && !within(cells, usize::from(i.a))
        {
            return Err(VerifyError::Record {
                table: Table::Code,
                index: index as u32,
            });
        }
    }
    Ok(cells.1 as u32)
}

/// Programs whose reads of team memory are compared with the teams in one pass. Each takes 3 bytes of stack.
const BLOCK: usize = 128;

/// Checks the programs that each team lists.
///
/// The programs must exist. At least one must have an atomic action. If each output has its own programs, every output
/// needs at least one. The team must keep every memory slot that its programs read.
pub(super) fn check_members(header: &Header, tables: &Tables<'_>) -> Result<(), VerifyError> {
    check_lists(header, tables)?;
    for (index, block) in tables.programs.chunks(BLOCK).enumerate() {
        check_reads(tables, block, index * BLOCK)?;
    }
    Ok(())
}

fn check_lists(header: &Header, tables: &Tables<'_>) -> Result<(), VerifyError> {
    for number in 0..header.teams {
        let team = tables.team(TeamId(number)).unwrap_or_default();
        if team.members_len == 0 {
            return Err(VerifyError::EmptyTeam { team: number });
        }
        let mut exit = false;
        let mut given = OutputSet::default();
        for ProgramId(member) in tables.members(&team) {
            let Some(program) = tables.program(ProgramId(member)) else {
                return Err(VerifyError::NoSuchProgram {
                    team: number,
                    program: member,
                });
            };
            if let Target::Atomic(action) = program.target {
                exit = true;
                given.insert(action);
            }
        }
        if !exit {
            return Err(VerifyError::NoExit { team: number });
        }
        let output = given.first_missing();
        if header.action_kind == ActionKind::Each && output < header.actions {
            return Err(VerifyError::NoProgramFor { output });
        }
    }
    Ok(())
}

/// Checks that the teams keep every slot that the programs of a block read. The block begins with program `first`.
///
/// Reads the block's code once and the members once, however often a team lists a program.
fn check_reads(
    tables: &Tables<'_>,
    block: &[[u8; Program::BYTES]],
    first: usize,
) -> Result<(), VerifyError> {
    let mut read = [[0u8; 3]; BLOCK];
    let mut any = false;
    for (slots, bytes) in read.iter_mut().zip(block) {
        for (_, section, slot) in reads(tables, &Program::from_bytes(bytes)) {
            if let Some(mask) = slots.get_mut(section as usize) {
                *mask |= slot;
            }
            any = true;
        }
    }
    if !any {
        return Ok(());
    }
    for bytes in tables.teams {
        let team = Team::from_bytes(bytes);
        for ProgramId(member) in tables.members(&team) {
            let place = usize::from(member).checked_sub(first);
            let Some(slots) = place.and_then(|place| read.get(place)) else {
                continue;
            };
            if slots
                .iter()
                .zip(team.slots)
                .any(|(read, kept)| read & !kept != 0)
            {
                return Err(slot_not_kept(tables, &team, member));
            }
        }
    }
    Ok(())
}

/// The instructions of a program that read team memory: index, section and the bit of the slot.
///
/// Instructions that write to memory have no destination. They may name a slot that the team does not keep, because such
/// a write has no effect.
fn reads(tables: &Tables<'_>, program: &Program) -> impl Iterator<Item = (u16, Section, u8)> {
    let code = tables.code(program).iter().enumerate();
    code.filter_map(|(index, bytes)| {
        let instruction = Instruction::from_bytes(bytes)?;
        let section = instruction.op.section()?;
        let reads = instruction.op.destination() != Destination::None;
        reads.then_some((index as u16, section, 1u8 << (instruction.a & 7)))
    })
}

/// The error for a program that reads a slot that a team does not keep.
fn slot_not_kept(tables: &Tables<'_>, team: &Team, member: u16) -> VerifyError {
    let program = tables.program(ProgramId(member)).unwrap_or_default();
    let mut reads = reads(tables, &program);
    let instruction = reads.find(|(_, section, slot)| team.kept(*section) & slot == 0);
    VerifyError::Operand {
        program: member,
        instruction: instruction.map_or(0, |(index, ..)| index),
        field: CodeField::A,
    }
}
