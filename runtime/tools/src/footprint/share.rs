//! How many bytes each team and each program takes.

use serde::Serialize;
use tpg_runtime::Policy;
use tpg_runtime::blob::InitialValues;
use tpg_runtime::tables::{Instruction, Program, Team};

/// The bytes that a team takes, without its programs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TeamShare {
    /// The team's number.
    pub team: usize,
    /// Bytes in the policy file: its record, its list of members and the initial values of its memory.
    pub flash_bytes: usize,
    /// Bytes of state: its memory, its random streams and the flag that a decision visited it.
    pub ram_bytes: usize,
}

/// The bytes that a program takes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ProgramShare {
    /// The program's number.
    pub program: usize,
    /// The number of its instructions.
    pub instructions: usize,
    /// Bytes in the policy file: its record, its code and the initial values of its registers.
    pub flash_bytes: usize,
    /// Bytes of state: its registers and its bid.
    pub ram_bytes: usize,
}

/// The bytes that each team and each program takes, in the order of their numbers.
#[must_use]
pub fn shares(policy: &Policy<'_>) -> (Vec<TeamShare>, Vec<ProgramShare>) {
    let (header, tables) = (policy.header(), policy.tables());
    let width = usize::from(header.width);
    let evolved = header.initial_values == InitialValues::Evolved;
    let constants = |words: usize| if evolved { 4 * words } else { 0 };
    let teams = tables.teams.iter().enumerate().map(|(team, bytes)| {
        let record = Team::from_bytes(bytes);
        let words = record.memory_words(width);
        TeamShare {
            team,
            flash_bytes: bytes.len() + 2 * usize::from(record.members_len) + constants(words),
            ram_bytes: 4 * words + 16 * record.streams() + 1,
        }
    });
    let programs = tables.programs.iter().enumerate().map(|(program, bytes)| {
        let record = Program::from_bytes(bytes);
        let [scalars, vectors, matrices] = record.registers.map(usize::from);
        let words = scalars + vectors * width + matrices * width * width;
        let instructions = usize::from(record.code_len);
        ProgramShare {
            program,
            instructions,
            flash_bytes: bytes.len() + Instruction::BYTES * instructions + constants(words),
            ram_bytes: 4 * words + 4,
        }
    });
    (teams.collect(), programs.collect())
}
