//! Lays out what is kept in tables and encodes them.

use std::collections::BTreeMap;

use tpg_runtime::Header;
use tpg_runtime::blob::{self, InitialValues, MemoryModel, RegisterMode};
use tpg_runtime::isa::{INDEXED_CELLS, Operand};
use tpg_runtime::registers::RegisterMap;
use tpg_runtime::tables::{self, Section, Tables, Target};

use super::error::{LowerError, limit, small};
use super::liveness::{Graph, Kept, compact};
use super::mode::Mode;
use super::policy_spec::{PolicySpec, header};
use crate::evolve::{
    Action, Constants, Instruction, Population, Program, ProgramId, Registers, Shape, Source, Team,
    TeamId, members, register_read, register_written,
};

/// Lowers an agent to the bytes of a blob.
///
/// `memory` is the indexed memory that the policy starts with, one value for each cell; `None` for zeros.
///
/// # Errors
/// [`LowerError::TooLarge`] if the graph exceeds what the format's fields can say.
pub fn lower(
    population: &Population,
    root: TeamId,
    policy_spec: &PolicySpec,
    provenance: [u8; 16],
    memory: Option<&[f32]>,
    mode: Mode,
) -> Result<Vec<u8>, LowerError> {
    let Selected {
        graph,
        kept,
        registers,
        ..
    } = selected(population, root, policy_spec, mode);
    Emitter::new(policy_spec, &graph, &kept, &registers)?.encode(provenance, memory)
}

/// The part of an agent's graph that reaches the tables.
pub(super) struct Selected<'a> {
    pub graph: Graph<'a>,
    /// For each program, the registers that matter after a run.
    pub results: Vec<Registers>,
    pub kept: Kept,
    /// For each program, the registers that have words.
    pub registers: Vec<Registers>,
}

/// Finds the part of an agent's graph that reaches the tables.
pub(super) fn selected<'a>(
    population: &'a Population,
    root: TeamId,
    policy_spec: &PolicySpec,
    mode: Mode,
) -> Selected<'a> {
    let graph = graph(population, root);
    let results: Vec<Registers> = graph
        .programs
        .iter()
        .map(|(_, program)| results(&policy_spec.shape, program))
        .collect();
    let shared = policy_spec.shares_memory();
    let indexed = policy_spec.memory_model == MemoryModel::Indexed;
    let mut kept = match mode {
        Mode::Whole | Mode::Counting => whole(&graph, policy_spec),
        Mode::Compact => {
            let stateful = policy_spec.register_mode == RegisterMode::Stateful;
            compact(&graph, &results, stateful, shared)
        }
    };
    if indexed && (shared || mode != Mode::Compact) {
        kept.cells = (0..INDEXED_CELLS as u16).collect();
    }
    let registers = registers(&kept, &results, mode);
    Selected {
        graph,
        results,
        kept,
        registers,
    }
}

/// Teams and programs in order of discovery from the root.
fn graph(population: &Population, root: TeamId) -> Graph<'_> {
    let teams: Vec<(TeamId, &Team)> = population
        .reachable(root)
        .into_iter()
        .map(|id| (id, &**population.team(id)))
        .collect();
    let mut programs: Vec<(ProgramId, &Program)> = Vec::new();
    let mut seen = std::collections::BTreeSet::new();
    for member in teams.iter().flat_map(|(_, team)| &team.members) {
        if seen.insert(*member) {
            programs.push((*member, &**population.program(*member)));
        }
    }
    Graph { teams, programs }
}

/// The registers that matter after a run: that of the bid, and that of the output if the program is atomic.
fn results(shape: &Shape, program: &Program) -> Registers {
    if program.is_atomic() {
        shape.results()
    } else {
        Registers([1, 0, 0])
    }
}

fn whole(graph: &Graph<'_>, policy_spec: &PolicySpec) -> Kept {
    let slots = if policy_spec.memory_model == MemoryModel::Team {
        [u8::MAX; 3]
    } else {
        [0; 3]
    };
    Kept {
        code: graph
            .programs
            .iter()
            .map(|(_, program)| program.instructions.clone())
            .collect(),
        slots: vec![slots; graph.teams.len()],
        cells: Vec::new(),
    }
}

/// For each program, the registers that its kept code or its results name.
fn registers(kept: &Kept, results: &[Registers], mode: Mode) -> Vec<Registers> {
    let of_program = |code: &Vec<Instruction>, results: &Registers| {
        if mode == Mode::Whole {
            return Registers::ALL;
        }
        results.union(Registers::named(code))
    };
    kept.code
        .iter()
        .zip(results)
        .map(|(code, results)| of_program(code, results))
        .collect()
}

/// Collects the tables, then encodes them.
struct Emitter<'a> {
    policy_spec: &'a PolicySpec,
    kept: &'a Kept,
    header: Header,
    front_end: Vec<u8>,
    teams: Vec<[u8; tables::Team::BYTES]>,
    members: Vec<[u8; 2]>,
    programs: Vec<[u8; tables::Program::BYTES]>,
    code: Vec<[u8; tables::Instruction::BYTES]>,
    constants: Vec<[u8; 4]>,
    /// First state word that is not laid out yet.
    words: usize,
}

impl<'a> Emitter<'a> {
    fn new(
        policy_spec: &'a PolicySpec,
        graph: &Graph<'_>,
        kept: &'a Kept,
        registers: &[Registers],
    ) -> Result<Self, LowerError> {
        let mut header = header(policy_spec, graph, kept)?;
        let front_end = match &policy_spec.front_end {
            Some(front_end) => front_end.section(&mut header),
            None => Vec::new(),
        };
        let mut emitter = Emitter {
            policy_spec,
            kept,
            header,
            front_end,
            teams: Vec::new(),
            members: Vec::new(),
            programs: Vec::new(),
            code: Vec::new(),
            constants: Vec::new(),
            words: header.registers_start(),
        };
        let team_index: BTreeMap<TeamId, u16> = number(graph.teams.iter().map(|(id, _)| *id));
        let cells_start = emitter.cells_start(registers);
        for (k, (_, program)) in graph.programs.iter().enumerate() {
            let target = match program.action {
                Action::Atomic(action) => Target::Atomic(action),
                Action::Team(team) => Target::Team(tables::TeamId(team_index[&team])),
            };
            emitter.program(program, target, &kept.code[k], registers[k], cells_start)?;
        }
        let program_index = number(graph.programs.iter().map(|(id, _)| *id));
        for ((_, team), slots) in graph.teams.iter().zip(&kept.slots) {
            emitter.team(team, *slots, &program_index)?;
        }
        emitter.words += kept.cells.len();
        limit(
            "state words",
            emitter.words,
            tpg_runtime::MAX_WORDS as usize,
        )?;
        emitter.header.words = emitter.words as u32;
        Ok(emitter)
    }

    fn width(&self) -> usize {
        usize::from(self.policy_spec.shape.width)
    }

    /// State offset of the first cell. Cells lie behind all registers. Policies with cells have no team memory.
    fn cells_start(&self, registers: &[Registers]) -> usize {
        let width = self.policy_spec.shape.width;
        self.words + registers.iter().map(|r| r.words(width)).sum::<usize>()
    }

    fn program(
        &mut self,
        program: &Program,
        target: Target,
        code: &[Instruction],
        registers: Registers,
        cells_start: usize,
    ) -> Result<(), LowerError> {
        let counts = Section::ALL.map(|s| registers.count(s) as u8);
        let layout = Layout {
            map: RegisterMap::new(&self.header, self.words, counts),
            registers,
            offset: usize::from(program.offset),
            cells_start,
            cells: &self.kept.cells,
        };
        let output = match self.policy_spec.shape.output_section() {
            Some(section) if program.is_atomic() => layout.register(section, 1),
            _ => self.words,
        };
        let constants_start = self.constants(&program.constants, registers);
        let mut record = tables::Program::default();
        record.code_start = self.code.len() as u32;
        record.code_len = small("instructions of a program", code.len())?;
        record.target = target;
        record.constants_start = constants_start;
        record.state_start = small("state words", self.words)?;
        record.output = small("state words", output)?;
        record.registers = counts;
        for instruction in code {
            let record = layout.instruction(instruction)?;
            self.header.groups |= instruction.op.group().bit();
            self.code.push(record.to_bytes());
        }
        self.words += record.register_words(self.width());
        self.programs.push(record.to_bytes());
        Ok(())
    }

    fn team(
        &mut self,
        team: &Team,
        slots: [u8; 3],
        program_index: &BTreeMap<ProgramId, u16>,
    ) -> Result<(), LowerError> {
        let constants_start = self.constants(&team.memory, Registers(slots));
        let mut record = tables::Team::default();
        record.members_start = self.members.len() as u32;
        record.members_len = small("members of a team", team.members.len())?;
        record.slots = slots;
        record.stream_key = team.stream_key;
        record.constants_start = constants_start;
        record.memory_start = small("state words", self.words)?;
        record.streams_start = self.header.streams;
        for member in &team.members {
            self.members.push(program_index[member].to_le_bytes());
        }
        self.words += record.memory_words(self.width());
        self.header.streams += record.streams() as u16;
        self.teams.push(record.to_bytes());
        Ok(())
    }

    /// Appends the constants of the kept registers or slots and returns where they begin. Those whose initial values cannot
    /// matter have none, and begin as zeros.
    fn constants(&mut self, constants: &Constants, kept: Registers) -> u32 {
        if self.policy_spec.initial_values == InitialValues::Zero {
            return 0;
        }
        let (start, width) = (self.constants.len() as u32, self.policy_spec.shape.width);
        for section in Section::ALL {
            for k in members(kept, section) {
                match constants.get(section, k, width) {
                    Some(values) => self
                        .constants
                        .extend(values.iter().map(|x| x.to_le_bytes())),
                    None => {
                        let words = section.slot_words(usize::from(width));
                        self.constants.resize(self.constants.len() + words, [0; 4]);
                    }
                }
            }
        }
        start
    }

    fn encode(
        mut self,
        provenance: [u8; 16],
        memory: Option<&[f32]>,
    ) -> Result<Vec<u8>, LowerError> {
        self.header.provenance = provenance;
        let cells: Vec<[u8; 2]> = self.kept.cells.iter().map(|c| c.to_le_bytes()).collect();
        let image: Vec<[u8; 4]> = memory
            .into_iter()
            .flatten()
            .map(|x| x.to_le_bytes())
            .collect();
        let mut tables = Tables::default();
        tables.teams = &self.teams;
        tables.members = &self.members;
        tables.programs = &self.programs;
        tables.code = &self.code;
        tables.constants = &self.constants;
        tables.cells = &cells;
        tables.memory = &image;
        tables.front_end = &self.front_end;
        tables.labels = &self.policy_spec.labels;
        tables.ranges = &self.policy_spec.ranges;
        tables.task = &self.policy_spec.task;
        tables.observability = &self.policy_spec.observability;
        let mut buffer = vec![0; blob::encoded_bound(&tables)];
        let len = blob::encode(&self.header, &tables, &mut buffer)?;
        buffer.truncate(len);
        Ok(buffer)
    }
}

/// State offsets of what a program reads and writes.
struct Layout<'a> {
    map: RegisterMap,
    registers: Registers,
    offset: usize,
    cells_start: usize,
    cells: &'a [u16],
}

impl Layout<'_> {
    /// State offset of a kept register.
    fn register(&self, section: Section, register: u8) -> usize {
        let lower = self.registers.of(section) & ((1u8 << register) - 1);
        self.map.first_word(section, lower.count_ones() as usize)
    }

    fn source(&self, kind: Operand, source: &Source) -> usize {
        let element = usize::from(source.element);
        if let Some((section, register)) = register_read(kind, source) {
            let start = self.register(section, register);
            return match kind {
                Operand::VElement | Operand::MElement => start + element,
                Operand::SOrVElement if source.of_vector => start + element,
                _ => start,
            };
        }
        match kind {
            Operand::None => 0,
            Operand::S => element,
            Operand::SOrVElement if !source.of_vector => element,
            Operand::V
            | Operand::M
            | Operand::VElement
            | Operand::MElement
            | Operand::SOrVElement => self.offset + element,
            Operand::ScalarSlot | Operand::VectorSlot | Operand::MatrixSlot => {
                usize::from(source.register)
            }
            Operand::VectorIndex | Operand::MatrixIndex => element,
            Operand::Cell => {
                let rank = self.cells.partition_point(|cell| *cell < source.element);
                self.cells_start + rank
            }
        }
    }

    fn instruction(&self, instruction: &Instruction) -> Result<tables::Instruction, LowerError> {
        let op = instruction.op;
        let destination = register_written(op)
            .map_or(0, |section| self.register(section, instruction.destination));
        let [a, b] = op.operands();
        Ok(tables::Instruction {
            op,
            d: small("state words", destination)?,
            a: small("state words", self.source(a, &instruction.a))?,
            b: small("state words", self.source(b, &instruction.b))?,
        })
    }
}

fn number<K: Ord>(ids: impl Iterator<Item = K>) -> BTreeMap<K, u16> {
    ids.enumerate().map(|(k, id)| (id, k as u16)).collect()
}
