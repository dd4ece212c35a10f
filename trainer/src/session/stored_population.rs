//! How a checkpoint stores a population: blocks of constants once, however many programs and teams share them.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::evolve::{
    Action, Constants, Instruction, Population, Program, ProgramId, Registers, ResetRule, Team,
    TeamId,
};

/// Constants by the number of their block.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct StoredConstants {
    registers: Registers,
    block: u32,
}

#[derive(Serialize, Deserialize)]
struct StoredProgram<'a> {
    id: ProgramId,
    instructions: Cow<'a, [Instruction]>,
    constants: StoredConstants,
    offset: u16,
    action: Action,
}

#[derive(Serialize, Deserialize)]
struct StoredTeam<'a> {
    id: TeamId,
    members: Cow<'a, [ProgramId]>,
    memory: StoredConstants,
    stream_key: u32,
    reset_rule: Option<ResetRule>,
}

#[derive(Serialize, Deserialize)]
struct StoredPopulation<'a> {
    next_team: u64,
    next_program: u64,
    roots: Vec<TeamId>,
    teams: Vec<StoredTeam<'a>>,
    programs: Vec<StoredProgram<'a>>,
    constants: Vec<Arc<[f32]>>,
}

#[derive(Default)]
struct Blocks {
    numbers: BTreeMap<*const f32, u32>,
    blocks: Vec<Arc<[f32]>>,
}

impl Blocks {
    fn store(&mut self, constants: &Constants) -> StoredConstants {
        let values = constants.values();
        let next = self.blocks.len() as u32;
        let block = *self.numbers.entry(values.as_ptr()).or_insert(next);
        if block == next {
            self.blocks.push(values.clone());
        }
        StoredConstants {
            registers: constants.registers(),
            block,
        }
    }
}

pub(super) fn serialize<S: Serializer>(
    population: &Population,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let mut blocks = Blocks::default();
    let teams = population
        .teams
        .iter()
        .map(|(id, team)| StoredTeam {
            id: *id,
            members: Cow::Borrowed(&team.members),
            memory: blocks.store(&team.memory),
            stream_key: team.stream_key,
            reset_rule: team.reset_rule,
        })
        .collect();
    let programs = population
        .programs
        .iter()
        .map(|(id, program)| StoredProgram {
            id: *id,
            instructions: Cow::Borrowed(&program.instructions),
            constants: blocks.store(&program.constants),
            offset: program.offset,
            action: program.action,
        })
        .collect();
    let stored = StoredPopulation {
        next_team: population.next_team,
        next_program: population.next_program,
        roots: population.roots.clone(),
        teams,
        programs,
        constants: blocks.blocks,
    };
    stored.serialize(serializer)
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Population, D::Error> {
    let stored = StoredPopulation::deserialize(deserializer)?;
    let restore = |constants: StoredConstants| {
        let number = constants.block;
        let block = stored.constants.get(number as usize).cloned();
        let values = block
            .ok_or_else(|| D::Error::custom(format!("block {number} of constants is missing")))?;
        Ok(Constants::from_parts(constants.registers, values))
    };
    let mut population = Population {
        roots: stored.roots,
        next_team: stored.next_team,
        next_program: stored.next_program,
        ..Population::default()
    };
    for program in stored.programs {
        let restored = Program {
            instructions: program.instructions.into_owned(),
            constants: restore(program.constants)?,
            offset: program.offset,
            action: program.action,
        };
        population.programs.insert(program.id, Arc::new(restored));
    }
    for team in stored.teams {
        let restored = Team {
            members: team.members.into_owned(),
            memory: restore(team.memory)?,
            stream_key: team.stream_key,
            reset_rule: team.reset_rule,
        };
        population.teams.insert(team.id, Arc::new(restored));
    }
    Ok(population)
}
