//! Small policies for tests: described by hand, laid out and encoded through the runtime's public types.

use tpg_runtime::blob::{
    self, ActionKind, InitialValues, MemoryModel, RegisterMode, ResetScope, encoded_bound,
};
use tpg_runtime::isa::{Group, Op};
use tpg_runtime::tables::{Instruction, Program, Range, Section, Tables, Target, Team};
use tpg_runtime::{Agent, AnyWidth, Header, State};

/// An agent with room for every policy that the tests make.
pub type TestAgent<'p> = Agent<'p, AnyWidth, State<4096, 192, 32, 64>>;

/// A policy before its layout.
#[derive(Debug, Clone)]
pub struct Draft {
    /// The header; sizes are filled in by [`Draft::encode`].
    pub header: Header,
    /// The teams, the root first.
    pub teams: Vec<DraftTeam>,
    /// The programs.
    pub programs: Vec<DraftProgram>,
    /// Kept cells of indexed memory.
    pub cells: Vec<u16>,
    /// Memory image, empty if none is carried.
    pub image: Vec<f32>,
    /// Section of the front end, as the file holds it; empty without one.
    pub front_end: Vec<u8>,
    /// Ranges of inputs and outputs; empty if the file says none.
    pub ranges: Vec<Range>,
}

/// A team before its layout.
#[derive(Debug, Clone, Default)]
pub struct DraftTeam {
    /// Its programs, in order.
    pub members: Vec<u16>,
    /// Kept slots of each section.
    pub slots: [u8; 3],
    /// Names its random streams.
    pub stream_key: u32,
    /// Initial values of the kept slots, in state order.
    pub constants: Vec<f32>,
}

/// A program before its layout.
#[derive(Debug, Clone)]
pub struct DraftProgram {
    /// Number of scalar, vector and matrix registers.
    pub registers: [u8; 3],
    /// Initial values of the registers, in state order.
    pub constants: Vec<f32>,
    /// Its instructions; offsets come from [`Draft::scalar`] and its siblings.
    pub code: Vec<Instruction>,
    /// Where it leads.
    pub target: Target,
    /// State offset of its continuous action, if it has one.
    pub output: Option<u16>,
}

impl DraftProgram {
    /// A program without code that always bids `bid` and keeps one more scalar register.
    #[must_use]
    pub fn bidding(bid: f32, target: Target) -> Self {
        DraftProgram {
            registers: [2, 0, 0],
            constants: vec![bid, 0.0],
            code: Vec::new(),
            target,
            output: None,
        }
    }
}

/// A stateless discrete policy of two actions, with every group and evolved constants.
#[must_use]
pub fn header(width: u16, observation_len: u16) -> Header {
    let mut header = Header::default();
    header.width = width;
    header.observation_len = observation_len;
    header.window = observation_len.max(width * width);
    header.actions = 2;
    header.initial_values = InitialValues::Evolved;
    header.reset_scope = ResetScope::EveryDecision;
    header.groups = Group::ALL.iter().map(|g| g.bit()).sum();
    header.action_low = -1.0;
    header.action_high = 1.0;
    header.control_period_us = 20_000;
    header.provenance = [7; 16];
    header
}

/// Makes a header stateful, with registers and memory reset in every episode.
pub fn make_stateful(header: &mut Header, memory_model: MemoryModel) {
    header.register_mode = RegisterMode::Stateful;
    header.reset_scope = ResetScope::PerEpisode;
    header.memory_model = memory_model;
}

/// An instruction.
#[must_use]
pub const fn instruction(op: Op, d: u16, a: u16, b: u16) -> Instruction {
    Instruction { op, d, a, b }
}

impl Draft {
    /// State offset of scalar register `i` of a program.
    #[must_use]
    pub fn scalar(&self, program: usize, i: usize) -> u16 {
        u16::try_from(self.state_start(program) + i).expect("small state")
    }

    /// State offset of vector register `i` of a program.
    #[must_use]
    pub fn vector(&self, program: usize, i: usize) -> u16 {
        let [scalars, ..] = self.programs[program].registers.map(usize::from);
        self.scalar(program, scalars + i * usize::from(self.header.width))
    }

    /// State offset of matrix register `i` of a program.
    #[must_use]
    pub fn matrix(&self, program: usize, i: usize) -> u16 {
        let [_, vectors, _] = self.programs[program].registers.map(usize::from);
        let width = usize::from(self.header.width);
        self.vector(program, vectors + i * width)
    }

    /// First state word of the shared memory.
    #[must_use]
    pub fn memory_start(&self) -> usize {
        self.state_start(self.programs.len())
    }

    fn state_start(&self, program: usize) -> usize {
        let width = usize::from(self.header.width);
        let words = |p: &DraftProgram| {
            let [s, v, m] = p.registers.map(usize::from);
            s + v * width + m * width * width
        };
        let before: usize = self.programs.iter().take(program).map(words).sum();
        self.header.registers_start() + before
    }

    /// Lays the policy out and writes its blob.
    ///
    /// # Panics
    /// If a table outgrows its fields: test policies are small.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        let small = |n: usize| u16::try_from(n).expect("small policy");
        let evolved = self.header.initial_values == InitialValues::Evolved;
        let (mut constants, mut code, mut members) = (Vec::new(), Vec::new(), Vec::new());
        let mut place = |values: &[f32]| {
            let start = constants.len() as u32;
            if evolved {
                constants.extend(values.iter().map(|x| x.to_le_bytes()));
                start
            } else {
                0
            }
        };
        let mut programs = Vec::new();
        for (number, program) in self.programs.iter().enumerate() {
            let state_start = small(self.state_start(number));
            let mut record = Program::default();
            record.code_start = code.len() as u32;
            record.code_len = small(program.code.len());
            record.target = program.target;
            record.constants_start = place(&program.constants);
            record.state_start = state_start;
            record.output = match program.target {
                Target::Atomic(_) => program.output.unwrap_or(state_start),
                Target::Team(_) => state_start,
            };
            record.registers = program.registers;
            code.extend(program.code.iter().map(|i| i.to_bytes()));
            programs.push(record.to_bytes());
        }
        let (mut teams, mut words, mut streams) = (Vec::new(), self.memory_start(), 0);
        for team in &self.teams {
            let mut record = Team::default();
            record.members_start = members.len() as u32;
            record.members_len = small(team.members.len());
            record.slots = team.slots;
            record.stream_key = team.stream_key;
            record.constants_start = place(&team.constants);
            record.memory_start = small(words);
            record.streams_start = small(streams);
            members.extend(team.members.iter().map(|m| m.to_le_bytes()));
            words += record.memory_words(usize::from(self.header.width));
            streams += record.streams();
            teams.push(record.to_bytes());
        }
        words += self.cells.len();
        let all_code = self.programs.iter().flat_map(|program| &program.code);
        let used = all_code.fold(0, |groups, i| groups | i.op.group().bit());
        let range = match self.header.action_kind {
            ActionKind::Discrete => (0.0, 0.0),
            _ => (self.header.action_low, self.header.action_high),
        };
        let mut header = self.header;
        header.words = words as u32;
        header.programs = small(programs.len());
        header.teams = small(teams.len());
        header.streams = small(streams);
        // A header announces what is used; a test may leave a group out, but not announce too many.
        header.groups = self.header.groups & used;
        header.action_low = range.0;
        header.action_high = range.1;
        let cells: Vec<[u8; 2]> = self.cells.iter().map(|c| c.to_le_bytes()).collect();
        let memory: Vec<[u8; 4]> = self.image.iter().map(|x| x.to_le_bytes()).collect();
        let labels = "x\tm\n".repeat(usize::from(header.observation_len) + header.outputs());
        let ranges: Vec<_> = self.ranges.iter().map(|range| range.to_bytes()).collect();
        let mut tables = Tables::default();
        tables.teams = &teams;
        tables.members = &members;
        tables.programs = &programs;
        tables.code = &code;
        tables.constants = &constants;
        tables.cells = &cells;
        tables.memory = &memory;
        tables.front_end = &self.front_end;
        tables.labels = &labels;
        tables.ranges = &ranges;
        tables.task = "test-v1";
        tables.observability = "none";
        let mut bytes = vec![0; encoded_bound(&tables)];
        let len = blob::encode(&header, &tables, &mut bytes).expect("the bound is enough");
        bytes.truncate(len);
        bytes
    }
}

/// First word, counted from the start of a team's memory, of a slot; `None` if it is not kept.
#[must_use]
pub fn slot_offset(kept: [u8; 3], section: Section, slot: usize, width: usize) -> Option<usize> {
    let mut team = Team::default();
    team.slots = kept;
    team.slot_start(section, slot, width)
}
