//! Finds the instructions and the memory that can influence an action.

use std::collections::{BTreeMap, BTreeSet};

use tpg_runtime::isa::{Destination, Group, Op, Operand, REGISTERS};
use tpg_runtime::tables::Section;

use crate::evolve::{Instruction, Program, ProgramId, Source, Team, TeamId};

/// A set of registers: a bit for each scalar, vector and matrix register.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Registers(pub [u8; 3]);

impl Registers {
    pub(super) const ALL: Registers = Registers([u8::MAX; 3]);

    pub(super) fn insert(&mut self, section: Section, register: u8) {
        self.0[section as usize] |= 1 << register;
    }

    fn remove(&mut self, section: Section, register: u8) {
        self.0[section as usize] &= !(1 << register);
    }

    pub(super) fn contains(self, section: Section, register: u8) -> bool {
        self.0[section as usize] & (1 << register) != 0
    }

    fn union(self, other: Registers) -> Registers {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Registers([a | x, b | y, c | z])
    }

    pub(super) fn of(self, section: Section) -> u8 {
        self.0[section as usize]
    }
}

/// The register that a source of this kind reads, if it reads one.
pub(super) fn register_read(kind: Operand, source: &Source) -> Option<(Section, u8)> {
    if source.observed {
        return None;
    }
    let section = match kind {
        Operand::S => Section::Scalar,
        Operand::SOrVElement if !source.of_vector => Section::Scalar,
        Operand::V | Operand::VElement | Operand::SOrVElement => Section::Vector,
        Operand::M | Operand::MElement => Section::Matrix,
        _ => return None,
    };
    Some((section, source.register))
}

/// The kind of register that an instruction writes, if it writes one.
pub(super) fn register_written(op: Op) -> Option<Section> {
    match op.destination() {
        Destination::None => None,
        Destination::S | Destination::SUpdate => Some(Section::Scalar),
        Destination::V => Some(Section::Vector),
        Destination::M => Some(Section::Matrix),
    }
}

/// The section of team memory that an instruction reads, with its slot.
pub(super) fn slot_read(instruction: &Instruction) -> Option<(Section, u8)> {
    register_written(instruction.op)?;
    Some((instruction.op.section()?, instruction.a.register))
}

/// What outside a program depends on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Demand {
    /// Registers read after a run: bid and action.
    pub results: Registers,
    /// Whether registers are kept from run to run.
    pub stateful: bool,
    /// Sections of team memory that a team of this program reads.
    pub sections: [bool; 3],
    /// Columns of indexed memory that some program reads.
    pub columns: u8,
}

/// Which of the instructions can influence what is demanded.
pub(super) fn effective(instructions: &[Instruction], demand: &Demand) -> Vec<bool> {
    analyse(instructions, demand).0
}

/// The registers whose evolved constants code reads. They are live when the code first runs, or the code reloads them.
///
/// All of the code must be effective, as [`compact`] leaves it.
pub(super) fn constants_read(code: &[Instruction], demand: &Demand) -> Registers {
    let (_, mut read) = analyse(code, demand);
    for instruction in code.iter().filter(|i| i.op.group() == Group::Constants) {
        if let Some(section) = register_written(instruction.op) {
            read.insert(section, instruction.destination);
        }
    }
    read
}

/// The effective instructions, and the registers that are live before the first of them.
///
/// Makes a backward pass over the code. With stateful registers it repeats the pass until all that is live at the start is live at
/// the end.
fn analyse(instructions: &[Instruction], demand: &Demand) -> (Vec<bool>, Registers) {
    let mut live_at_end = demand.results;
    loop {
        let mut live = live_at_end;
        let mut keep = vec![false; instructions.len()];
        for (keep, instruction) in keep.iter_mut().zip(instructions).rev() {
            *keep = pass(instruction, demand, &mut live);
        }
        let next = live_at_end.union(live);
        if !demand.stateful || next == live_at_end {
            return (keep, live);
        }
        live_at_end = next;
    }
}

/// Updates the live registers backwards across one instruction. Returns whether the instruction is effective.
fn pass(instruction: &Instruction, demand: &Demand, live: &mut Registers) -> bool {
    let op = instruction.op;
    let written = register_written(op).map(|section| (section, instruction.destination));
    let needed = match written {
        Some((section, register)) => live.contains(section, register),
        None if op == Op::MemWrite => demand.columns != 0,
        None => op.section().is_some_and(|s| demand.sections[s as usize]),
    };
    if !needed {
        return false;
    }
    if let Some((section, register)) = written
        && op.destination() != Destination::SUpdate
    {
        live.remove(section, register);
    }
    if op == Op::MemWrite {
        live.0[Section::Scalar as usize] |= demand.columns;
    }
    let kinds = op.operands();
    for (kind, source) in kinds.into_iter().zip([&instruction.a, &instruction.b]) {
        if let Some((section, register)) = register_read(kind, source) {
            live.insert(section, register);
        }
    }
    true
}

/// The teams and programs of an agent, in the order of the tables.
pub(super) struct Graph<'a> {
    pub teams: Vec<(TeamId, &'a Team)>,
    pub programs: Vec<(ProgramId, &'a Program)>,
}

/// What of a graph is kept.
pub(super) struct Kept {
    /// For each program, its kept instructions in order.
    pub code: Vec<Vec<Instruction>>,
    /// For each team and section, the slots that are read.
    pub slots: Vec<[u8; 3]>,
    /// Cells of indexed memory that are read, ascending.
    pub cells: Vec<u16>,
}

/// Finds what can influence an action. Drops code and memory in turn until nothing more can be dropped.
///
/// `results` are, for each program, the registers that matter after a run. `all_cells` keeps all of indexed memory, for scopes in
/// which other agents read it.
pub(super) fn compact(
    graph: &Graph<'_>,
    results: &[Registers],
    stateful: bool,
    all_cells: bool,
) -> Kept {
    let mut slots = vec![[u8::MAX; 3]; graph.teams.len()];
    let mut columns = u8::MAX;
    loop {
        let sections = sections_of_programs(graph, &slots);
        let code: Vec<Vec<Instruction>> = graph
            .programs
            .iter()
            .zip(results)
            .map(|((id, program), results)| {
                let demand = Demand {
                    results: *results,
                    stateful,
                    sections: sections[id],
                    columns,
                };
                let keep = effective(&program.instructions, &demand);
                let kept = program.instructions.iter().zip(keep);
                kept.filter(|(_, keep)| *keep).map(|(i, _)| *i).collect()
            })
            .collect();
        let kept = Kept {
            slots: slots_read(graph, &code),
            cells: cells_read(&code),
            code,
        };
        let next = if all_cells {
            u8::MAX
        } else {
            columns_of(&kept.cells)
        };
        if kept.slots == slots && next == columns {
            return kept;
        }
        slots = kept.slots;
        columns = next;
    }
}

/// For each program, the sections that at least one of its teams reads.
fn sections_of_programs(graph: &Graph<'_>, slots: &[[u8; 3]]) -> BTreeMap<ProgramId, [bool; 3]> {
    let mut sections = BTreeMap::new();
    for ((_, team), slots) in graph.teams.iter().zip(slots) {
        for member in &team.members {
            let entry = sections.entry(*member).or_insert([false; 3]);
            for (read, slots) in entry.iter_mut().zip(slots) {
                *read |= *slots != 0;
            }
        }
    }
    sections
}

fn slots_read(graph: &Graph<'_>, code: &[Vec<Instruction>]) -> Vec<[u8; 3]> {
    let index: BTreeMap<ProgramId, usize> = graph
        .programs
        .iter()
        .enumerate()
        .map(|(k, (id, _))| (*id, k))
        .collect();
    let read_by_team = |team: &Team| {
        let mut slots = [0u8; 3];
        for member in &team.members {
            for (section, slot) in code[index[member]].iter().filter_map(slot_read) {
                slots[section as usize] |= 1 << slot;
            }
        }
        slots
    };
    graph
        .teams
        .iter()
        .map(|(_, team)| read_by_team(team))
        .collect()
}

fn cells_read(code: &[Vec<Instruction>]) -> Vec<u16> {
    let reads = code.iter().flatten().filter(|i| i.op == Op::MemRead);
    let cells: BTreeSet<u16> = reads.map(|i| i.a.element).collect();
    cells.into_iter().collect()
}

fn columns_of(cells: &[u16]) -> u8 {
    cells.iter().fold(0, |columns, cell| {
        columns | 1 << (usize::from(*cell) % REGISTERS)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scalar(op: Op, destination: u8, a: u8, b: u8) -> Instruction {
        Instruction {
            op,
            destination,
            a: Source::register(a),
            b: Source::register(b),
        }
    }

    fn demand(stateful: bool) -> Demand {
        Demand {
            results: Registers([1, 0, 0]),
            stateful,
            sections: [false; 3],
            columns: 0,
        }
    }

    #[test]
    fn overwritten_and_unread_results_are_dropped() {
        let code = [
            scalar(Op::Add, 0, 1, 2),
            scalar(Op::Sub, 3, 1, 1),
            scalar(Op::Mul, 0, 4, 4),
        ];
        assert_eq!(effective(&code, &demand(false)), [false, false, true]);
    }

    #[test]
    fn stateful_registers_carry_liveness_into_the_next_run() {
        // s0 reads s3 before s3 is written: only a later run sees the write.
        let code = [scalar(Op::Add, 0, 3, 3), scalar(Op::Sub, 3, 1, 1)];
        assert_eq!(effective(&code, &demand(false)), [true, false]);
        assert_eq!(effective(&code, &demand(true)), [true, true]);
    }

    #[test]
    fn a_constant_is_read_before_it_is_overwritten_or_when_it_is_reloaded() {
        // s0 = s3 + s4; s3 = s1 - s1: the constants of s1, s3, s4 are read, that of s3 by the first run alone.
        let mut code = vec![scalar(Op::Add, 0, 3, 4), scalar(Op::Sub, 3, 1, 1)];
        assert_eq!(constants_read(&code, &demand(true)).0, [0b1_1010, 0, 0]);
        code.insert(0, scalar(Op::Sub, 4, 5, 5));
        assert_eq!(constants_read(&code, &demand(true)).0, [0b10_1010, 0, 0]);
        code.insert(1, scalar(Op::ReloadS, 4, 0, 0));
        assert_eq!(
            constants_read(&code[1..], &demand(true)).0,
            [0b1_1010, 0, 0]
        );
    }

    #[test]
    fn the_conditional_reads_what_it_may_leave() {
        let code = [scalar(Op::Add, 0, 1, 2), scalar(Op::Cond, 0, 3, 4)];
        assert_eq!(effective(&code, &demand(false)), [true, true]);
    }

    #[test]
    fn a_write_matters_where_its_section_is_read() {
        let code = [scalar(Op::Add, 5, 1, 2), scalar(Op::WriteS, 0, 5, 0)];
        assert_eq!(effective(&code, &demand(false)), [false, false]);
        let mut read = demand(false);
        read.sections[0] = true;
        assert_eq!(effective(&code, &read), [true, true]);
    }
}
