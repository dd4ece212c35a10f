//! How a checkpoint stores a population: blocks of constants once, however many programs and teams share them.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::evolve::{Action, Instruction, Population, Program, ProgramId, ResetRule, Team, TeamId};

#[derive(Serialize, Deserialize)]
struct StoredProgram {
    id: ProgramId,
    instructions: Vec<Instruction>,
    constants: u32,
    offset: u16,
    action: Action,
}

#[derive(Serialize, Deserialize)]
struct StoredTeam {
    id: TeamId,
    members: Vec<ProgramId>,
    memory: u32,
    stream_key: u32,
    reset_rule: Option<ResetRule>,
}

#[derive(Serialize, Deserialize)]
struct StoredPopulation {
    next_team: u64,
    next_program: u64,
    roots: Vec<TeamId>,
    teams: Vec<StoredTeam>,
    programs: Vec<StoredProgram>,
    constants: Vec<Arc<[f32]>>,
}

#[derive(Default)]
struct Blocks {
    numbers: BTreeMap<*const f32, u32>,
    blocks: Vec<Arc<[f32]>>,
}

impl Blocks {
    fn number(&mut self, block: &Arc<[f32]>) -> u32 {
        let next = self.blocks.len() as u32;
        let number = *self.numbers.entry(block.as_ptr()).or_insert(next);
        if number == next {
            self.blocks.push(block.clone());
        }
        number
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
            members: team.members.clone(),
            memory: blocks.number(&team.memory),
            stream_key: team.stream_key,
            reset_rule: team.reset_rule,
        })
        .collect();
    let programs = population
        .programs
        .iter()
        .map(|(id, program)| StoredProgram {
            id: *id,
            instructions: program.instructions.clone(),
            constants: blocks.number(&program.constants),
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
    let block = |number: u32| {
        let block = stored.constants.get(number as usize).cloned();
        block.ok_or_else(|| D::Error::custom(format!("block {number} of constants is missing")))
    };
    let mut population = Population {
        roots: stored.roots,
        next_team: stored.next_team,
        next_program: stored.next_program,
        ..Population::default()
    };
    for program in stored.programs {
        let restored = Program {
            instructions: program.instructions,
            constants: block(program.constants)?,
            offset: program.offset,
            action: program.action,
        };
        population.programs.insert(program.id, Arc::new(restored));
    }
    for team in stored.teams {
        let restored = Team {
            members: team.members,
            memory: block(team.memory)?,
            stream_key: team.stream_key,
            reset_rule: team.reset_rule,
        };
        population.teams.insert(team.id, Arc::new(restored));
    }
    Ok(population)
}
