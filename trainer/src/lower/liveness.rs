//! Finds the instructions and the memory that can influence an action.

use std::collections::{BTreeMap, BTreeSet};

use tpg_runtime::isa::{Op, REGISTERS};

use crate::evolve::{
    Demand, Instruction, Program, ProgramId, Registers, Team, TeamId, effective, slot_read,
};

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
