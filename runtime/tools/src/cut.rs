//! A policy cut to some of its programs, which then act alone.
//!
//! Beside the whole policy it shows what the graph adds.

use tpg_runtime::Policy;
use tpg_runtime::blob::{EncodeError, encode, encoded_bound};
use tpg_runtime::isa::{Destination, Operand, SLOTS};
use tpg_runtime::tables::{Instruction, Program, ProgramId, Section, Tables, Team, TeamId};

/// Why a policy could not be cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CutError {
    /// The policy has no such team or program.
    #[error("the policy has no team {team} with these programs")]
    NoSuchProgram {
        /// The team that was given.
        team: u16,
    },
    /// The result cannot be encoded.
    #[error(transparent)]
    Encode(#[from] EncodeError),
}

/// The file of the policy that has these programs of a team and nothing else.
///
/// Each must lead to an action. Bids decide among several as before, so one program for each output, where outputs have
/// programs of their own, gives that output always. The team's shared memory, the front end and the action's range stay; slots
/// that none of the programs reads go.
///
/// # Errors
/// [`CutError::NoSuchProgram`].
pub fn cut(
    policy: &Policy<'_>,
    team_id: TeamId,
    programs: &[ProgramId],
) -> Result<Vec<u8>, CutError> {
    let missing = CutError::NoSuchProgram { team: team_id.0 };
    let team = policy.tables().team(team_id).ok_or(missing)?;
    let mut parts = Parts::new(policy, team);
    for program_id in programs {
        let program = policy.tables().program(*program_id).ok_or(missing)?;
        parts.add_program(program);
    }
    Ok(parts.finish()?)
}

/// The tables of the policy that is made.
struct Parts<'a, 'p> {
    policy: &'a Policy<'p>,
    /// The team as it was.
    team: Team,
    /// First state word of the next program.
    state: usize,
    programs: Vec<[u8; Program::BYTES]>,
    code: Vec<[u8; Instruction::BYTES]>,
    constants: Vec<[u8; 4]>,
    /// Slots that some program reads, by section.
    slots: [u8; 3],
    groups: u16,
}

impl<'a, 'p> Parts<'a, 'p> {
    fn new(policy: &'a Policy<'p>, team: Team) -> Self {
        Parts {
            policy,
            team,
            state: policy.header().registers_start(),
            programs: Vec::new(),
            code: Vec::new(),
            constants: Vec::new(),
            slots: [0; 3],
            groups: 0,
        }
    }

    fn width(&self) -> usize {
        usize::from(self.policy.header().width)
    }

    /// Takes a span of the constants along and returns where it begins now; without constants that is 0.
    fn take_constants(&mut self, start: usize, len: usize) -> u32 {
        let all = self.policy.tables().constants;
        let place = self.constants.len();
        let span = all.get(start..).and_then(|rest| rest.get(..len));
        match span {
            Some(span) if !all.is_empty() => {
                self.constants.extend_from_slice(span);
                place as u32
            }
            _ => 0,
        }
    }

    fn add_program(&mut self, old: Program) {
        let words = old.register_words(self.width());
        // State words of the program lie elsewhere now. What lies before them is the observation, which stays.
        let first = usize::from(old.state_start);
        let state = self.state;
        let moved = |at: u16| (usize::from(at) + state - first) as u16;
        let mut new = old;
        new.code_start = self.code.len() as u32;
        new.state_start = moved(old.state_start);
        new.output = moved(old.output);
        let code: Vec<_> = (self.policy.tables().code(&old).iter())
            .filter_map(Instruction::from_bytes)
            .collect();
        for mut instruction in code {
            let op = instruction.op;
            let shift = |at: &mut u16, is_offset: bool| {
                if is_offset && *at >= old.state_start {
                    *at = moved(*at);
                }
            };
            shift(&mut instruction.d, op.destination() != Destination::None);
            let [a, b] = op.operands();
            shift(&mut instruction.a, a.is_value());
            shift(&mut instruction.b, b.is_value());
            self.groups |= op.group().bit();
            if let Some(section) = op.section()
                && op.destination() != Destination::None
            {
                self.slots[section as usize] |= 1 << (instruction.a & 7);
            }
            self.code.push(instruction.to_bytes());
        }
        new.constants_start = self.take_constants(old.constants_start as usize, words);
        self.state += words;
        self.programs.push(new.to_bytes());
    }

    /// For each kept slot, its first word within the old team's memory, and its words.
    fn kept_words(&self) -> Vec<(usize, usize)> {
        let width = self.width();
        let mut kept = Vec::new();
        for section in Section::ALL {
            for slot in 0..SLOTS {
                let reads = self.slots[section as usize] & (1 << slot) != 0;
                let place = self.team.slot_start(section, slot, width);
                if let (true, Some(start)) = (reads, place) {
                    let within = start - usize::from(self.team.memory_start);
                    kept.push((within, section.slot_words(width)));
                }
            }
        }
        kept
    }

    fn finish(mut self) -> Result<Vec<u8>, EncodeError> {
        let old = self.policy.tables();
        let kept = self.kept_words();
        let mut team = self.team;
        team.members_start = 0;
        team.members_len = self.programs.len() as u16;
        team.slots = self.slots;
        team.memory_start = self.state as u16;
        team.streams_start = 0;
        // As in the policy, a team without words keeps a valid start.
        let constants_start = self.constants.len() as u32;
        let from = self.team.constants_start as usize;
        for (start, len) in &kept {
            self.take_constants(from + start, *len);
        }
        team.constants_start = if old.constants.is_empty() {
            0
        } else {
            constants_start
        };
        let memory_words: usize = kept.iter().map(|(_, len)| len).sum();
        let cells_start = self.state + memory_words;
        self.move_cells(cells_start);
        let memory = self.image(&kept);
        let members: Vec<[u8; 2]> = (0..team.members_len).map(u16::to_le_bytes).collect();
        let teams = [team.to_bytes()];
        let mut header = *self.policy.header();
        header.teams = 1;
        header.programs = team.members_len;
        header.words = (cells_start + old.cells.len()) as u32;
        header.streams = team.streams() as u16;
        header.groups = self.groups;
        let mut tables = Tables::default();
        tables.teams = &teams;
        tables.members = &members;
        tables.programs = &self.programs;
        tables.code = &self.code;
        tables.constants = &self.constants;
        tables.cells = old.cells;
        tables.memory = &memory;
        tables.front_end = old.front_end;
        tables.labels = old.labels;
        tables.task = old.task;
        tables.observability = old.observability;
        let mut file = vec![0; encoded_bound(&tables)];
        let len = encode(&header, &tables, &mut file)?;
        file.truncate(len);
        Ok(file)
    }

    /// Cells of indexed memory lie behind all registers, which are fewer now.
    fn move_cells(&mut self, cells_start: usize) {
        let old_start = self.policy.header().words as usize - self.policy.tables().cells.len();
        for bytes in &mut self.code {
            let Some(mut instruction) = Instruction::from_bytes(bytes) else {
                continue;
            };
            if instruction.op.operands().first() == Some(&Operand::Cell) {
                let within = usize::from(instruction.a) - old_start;
                instruction.a = (cells_start + within) as u16;
                *bytes = instruction.to_bytes();
            }
        }
    }

    /// What of a carried memory image is kept.
    fn image(&self, kept: &[(usize, usize)]) -> Vec<[u8; 4]> {
        let old = self.policy.tables();
        let Some(cells) = old.memory.len().checked_sub(old.cells.len()) else {
            return Vec::new();
        };
        // The image begins where the memory of the first team does.
        let first = old.team(TeamId(0)).unwrap_or_default().memory_start;
        let before = usize::from(self.team.memory_start - first);
        let slots = kept.iter().filter_map(|(start, len)| {
            old.memory
                .get(before + start..)
                .and_then(|rest| rest.get(..*len))
        });
        let slots = slots.flatten().copied();
        slots.chain(old.memory[cells..].iter().copied()).collect()
    }
}
