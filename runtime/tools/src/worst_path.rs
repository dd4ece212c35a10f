//! The worst path through a policy: the same programs, in a policy of which every decision runs all of them.
//!
//! No decision of a policy runs a program twice, so none takes longer than one that runs all. Which observation leads
//! there, if any does, nobody has to know.

use tpg_runtime::blob::{
    ActionKind, EncodeError, InitialValues, MemoryModel, RegisterMode, ResetScope, encode,
    encoded_bound,
};
use tpg_runtime::isa::Operand;
use tpg_runtime::tables::{Instruction, Program, ProgramId, Tables, Target, Team, TeamId};
use tpg_runtime::{Header, Policy};

/// The file of a policy that runs every program of `policy` in each decision: for measuring, not for acting.
///
/// Its teams follow each other, each with a program more that always wins and leads to the next. Only where outputs have
/// programs of their own nothing changes, as all of them run anyway.
///
/// # Errors
/// [`EncodeError::TooLarge`].
pub fn worst_path(policy: &Policy<'_>) -> Result<Vec<u8>, EncodeError> {
    Chain::new(policy).encode()
}

/// As [`worst_path`], with programs that have no instructions: what is left is the way through the graph, the front end
/// and the action.
///
/// # Errors
/// [`EncodeError::TooLarge`].
pub fn worst_path_without_code(policy: &Policy<'_>) -> Result<Vec<u8>, EncodeError> {
    let mut chain = Chain::new(policy);
    chain.strip();
    chain.encode()
}

/// Each output of the action that ends a worst path, before it is clamped: a number with a long mantissa.
const ACTION: f32 = 0.731_058_6;

struct Chain<'a> {
    header: Header,
    old: Tables<'a>,
    programs: Vec<Program>,
    teams: Vec<Team>,
    members: Vec<Vec<u16>>,
    code: Vec<[u8; Instruction::BYTES]>,
    constants: Vec<[u8; 4]>,
    cells: &'a [[u8; 2]],
    memory: &'a [[u8; 4]],
}

impl<'a> Chain<'a> {
    fn new(policy: &Policy<'a>) -> Self {
        let old = *policy.tables();
        let teams: Vec<Team> = old.teams.iter().map(Team::from_bytes).collect();
        let members = teams.iter().map(|team| {
            let mut members: Vec<u16> = Vec::new();
            for ProgramId(program) in old.members(team) {
                // Old versions of the format let a team list a program twice.
                if !members.contains(&program) {
                    members.push(program);
                }
            }
            members
        });
        let mut chain = Chain {
            header: *policy.header(),
            old,
            programs: old.programs.iter().map(Program::from_bytes).collect(),
            members: members.collect(),
            teams,
            code: old.code.to_vec(),
            constants: old.constants.to_vec(),
            cells: old.cells,
            memory: old.memory,
        };
        chain.write_constants_out();
        if chain.header.action_kind != ActionKind::Each {
            chain.link();
        }
        chain
    }

    fn width(&self) -> usize {
        usize::from(self.header.width)
    }

    /// Gives registers and slots that begin at zero constants of zero, as the links need one that is not.
    fn write_constants_out(&mut self) {
        if self.header.initial_values == InitialValues::Evolved {
            return;
        }
        self.header.initial_values = InitialValues::Evolved;
        let (width, mut len) = (self.width(), 0);
        for program in &mut self.programs {
            program.constants_start = len as u32;
            len += program.register_words(width);
        }
        for team in &mut self.teams {
            team.constants_start = len as u32;
            len += team.memory_words(width);
        }
        self.constants = vec![[0; 4]; len];
    }

    /// State words of all programs, behind the observation.
    fn registers_end(&self) -> usize {
        let words = self.programs.iter().map(|p| p.register_words(self.width()));
        self.header.registers_start() + words.sum::<usize>()
    }

    /// Lets each team lead to the next, and the last one to a team that ends the decision.
    fn link(&mut self) {
        let before = self.registers_end();
        let last = TeamId(self.header.teams);
        let model = self.programs.iter().find(|program| is_atomic(program));
        let mut exit = model.copied().unwrap_or_default();
        for program in &mut self.programs {
            if !is_atomic(program) {
                // To the team that is visited last: a program that leads to a visited one would not run.
                program.target = Target::Team(last);
            }
        }
        let highest = self.constants.len() as u32;
        self.constants.push(f32::MAX.to_le_bytes());
        let code_end = self.code.len() as u32;
        for team in 0..self.members.len() {
            let mut link = Program::default();
            link.code_start = code_end;
            link.target = Target::Team(TeamId(team as u16 + 1));
            link.constants_start = highest;
            link.state_start = self.registers_end() as u16;
            link.output = link.state_start;
            link.registers = [1, 0, 0];
            // Of equal bids the first wins.
            self.members[team].insert(0, self.programs.len() as u16);
            self.programs.push(link);
        }
        let state = self.registers_end() as u16;
        exit.output = exit.output - exit.state_start + state;
        exit.state_start = state;
        (exit.code_start, exit.code_len) = (code_end, 0);
        // A front end multiplies with the last action, and software multiplies with zero in no time.
        exit.constants_start = self.constants.len() as u32;
        let action = vec![ACTION.to_le_bytes(); exit.register_words(self.width())];
        self.constants.extend(action);
        self.members.push(vec![self.programs.len() as u16]);
        self.programs.push(exit);
        self.teams.push(Team::default());
        self.move_memory(self.registers_end() - before);
    }

    /// Moves what lies behind the registers by so many words.
    fn move_memory(&mut self, words: usize) {
        for bytes in &mut self.code {
            if let Some(mut instruction) = Instruction::from_bytes(bytes)
                && instruction.op.operands()[0] == Operand::Cell
            {
                instruction.a += words as u16;
                *bytes = instruction.to_bytes();
            }
        }
    }

    /// Takes instructions and memory away.
    fn strip(&mut self) {
        self.code.clear();
        for program in &mut self.programs {
            (program.code_start, program.code_len) = (0, 0);
        }
        for team in &mut self.teams {
            team.slots = [0; 3];
        }
        (self.cells, self.memory) = (&[], &[]);
        self.header.memory_model = MemoryModel::None;
        if self.header.register_mode == RegisterMode::Stateless {
            self.header.reset_scope = ResetScope::EveryDecision;
        }
    }

    fn encode(mut self) -> Result<Vec<u8>, EncodeError> {
        let (mut words, mut streams, mut listed) = (self.registers_end(), 0, 0);
        for (team, members) in self.teams.iter_mut().zip(&self.members) {
            team.members_start = listed as u32;
            team.members_len = members.len() as u16;
            team.memory_start = words as u16;
            team.streams_start = streams as u16;
            words += team.memory_words(usize::from(self.header.width));
            streams += team.streams();
            listed += members.len();
        }
        words += self.cells.len();
        if words > usize::from(u16::MAX) {
            return Err(EncodeError::TooLarge { bytes: 4 * words });
        }
        let groups = (self.code.iter())
            .filter_map(Instruction::from_bytes)
            .fold(0, |groups, i| groups | i.op.group().bit());
        let mut header = self.header;
        header.words = words as u32;
        header.programs = self.programs.len() as u16;
        header.teams = self.teams.len() as u16;
        header.streams = streams as u16;
        header.groups = groups;
        let teams: Vec<_> = self.teams.iter().map(|team| team.to_bytes()).collect();
        let programs: Vec<_> = self.programs.iter().map(|p| p.to_bytes()).collect();
        let members: Vec<_> = (self.members.iter().flatten())
            .map(|member| member.to_le_bytes())
            .collect();
        let mut tables = self.old;
        tables.teams = &teams;
        tables.members = &members;
        tables.programs = &programs;
        tables.code = &self.code;
        tables.constants = &self.constants;
        tables.cells = self.cells;
        tables.memory = self.memory;
        let mut file = vec![0; encoded_bound(&tables)];
        let len = encode(&header, &tables, &mut file)?;
        file.truncate(len);
        Ok(file)
    }
}

const fn is_atomic(program: &Program) -> bool {
    matches!(program.target, Target::Atomic(_))
}
