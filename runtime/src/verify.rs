//! View to verified policy: nothing in a blob is trusted before it has passed here.

use core::fmt;

use crate::blob::{
    ActionKind, Blob, DecodeError, Header, InitialValues, MemoryModel, RegisterMode, ResetScope,
};
use crate::frontend;
use crate::isa::{Destination, Group, INDEXED_CELLS, Op, Operand, REGISTERS, SLOTS};
use crate::tables::{Instruction, Program, ProgramId, Section, Tables, Target, Team, TeamId, span};

/// Largest vector width that the interpreter is built for.
pub const MAX_WIDTH: u16 = 32;
/// Largest number of state words: offsets are 16 bits wide.
pub const MAX_WORDS: u32 = 1 << 16;

/// What one decision can cost at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounds {
    /// Instructions executed: every program runs at most once.
    pub instructions: u32,
    /// Single-precision operations, weighted by the [cost classes](crate::isa::Cost).
    pub weighted_operations: u64,
    /// Teams visited.
    pub teams: u16,
}

/// A policy that has passed every check; only this can decide.
#[derive(Debug, Clone, Copy)]
pub struct Policy<'a> {
    pub(crate) header: Header,
    pub(crate) tables: Tables<'a>,
    pub(crate) memory_start: usize,
    bounds: Bounds,
}

/// Why a well-formed blob is no executable policy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum VerifyError {
    /// The bytes are no blob.
    Decode(DecodeError),
    /// A header field contradicts the tables or another field.
    Header {
        /// Which field.
        field: &'static str,
        /// What the rest of the blob asks for.
        needed: u32,
        /// What the header says.
        got: u32,
    },
    /// The action range is empty or not finite.
    ActionRange,
    /// A record differs from the one form in which it may be stored.
    Record {
        /// Which table.
        table: &'static str,
        /// Which record of it.
        index: u32,
    },
    /// A team has no member.
    EmptyTeam {
        /// The team.
        team: u16,
    },
    /// No member of a team has an atomic action.
    NoExit {
        /// The team.
        team: u16,
    },
    /// A team lists a program that does not exist.
    NoSuchProgram {
        /// The team.
        team: u16,
        /// The program.
        program: u16,
    },
    /// A program leads to a team or an action that does not exist.
    NoSuchTarget {
        /// The program.
        program: u16,
    },
    /// An instruction's field refers to something that it must not, or that does not exist.
    Operand {
        /// Program that contains the instruction.
        program: u16,
        /// Its number within the program.
        instruction: u16,
        /// `d`, `a` or `b`.
        field: char,
    },
    /// An instruction belongs to a group or a memory model that the header does not announce.
    Group {
        /// Program that contains the instruction.
        program: u16,
        /// Its number within the program.
        instruction: u16,
    },
    /// A constant or a word of the memory image is not finite.
    NotFinite {
        /// Which table.
        table: &'static str,
        /// Which word of it.
        index: u32,
    },
    /// The labels are not one line with name and unit for each input and output.
    Labels,
    /// The front-end section does not have its layout.
    FrontEndMalformed,
    /// The policy has a front end, which this build does not execute.
    FrontEndUnsupported,
}

impl fmt::Display for VerifyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Decode(error) => error.fmt(f),
            Self::Header { field, needed, got } => {
                write!(f, "header says {field} = {got}, the policy needs {needed}")
            }
            Self::ActionRange => write!(f, "action range in the header is empty or not finite"),
            Self::Record { table, index } => {
                write!(
                    f,
                    "record {index} of table `{table}` is out of place or malformed"
                )
            }
            Self::EmptyTeam { team } => write!(f, "team {team} has no program"),
            Self::NoExit { team } => write!(f, "team {team} has no program with an atomic action"),
            Self::NoSuchProgram { team, program } => {
                write!(
                    f,
                    "team {team} lists program {program}, which does not exist"
                )
            }
            Self::NoSuchTarget { program } => write!(
                f,
                "program {program} leads to a team or action that does not exist"
            ),
            Self::Operand {
                program,
                instruction,
                field,
            } => write!(
                f,
                "instruction {instruction} of program {program}: field `{field}` is out of range"
            ),
            Self::Group {
                program,
                instruction,
            } => write!(
                f,
                "instruction {instruction} of program {program} is of a group or memory model \
                 that the header does not announce"
            ),
            Self::NotFinite { table, index } => {
                write!(f, "word {index} of table `{table}` is not a finite number")
            }
            Self::Labels => write!(
                f,
                "labels are not one `name<TAB>unit` line for each input and output"
            ),
            Self::FrontEndMalformed => write!(f, "front-end section is malformed"),
            Self::FrontEndUnsupported => write!(
                f,
                "policy has a front end (standardisation or belief), which this build does not \
                 execute; use the build that made it"
            ),
        }
    }
}

impl core::error::Error for VerifyError {}

impl From<DecodeError> for VerifyError {
    fn from(error: DecodeError) -> Self {
        Self::Decode(error)
    }
}

impl<'a> Policy<'a> {
    /// Decodes and verifies the bytes of a blob.
    ///
    /// # Errors
    /// Any [`VerifyError`].
    pub fn load(bytes: &'a [u8]) -> Result<Self, VerifyError> {
        Self::verify(&Blob::decode(bytes)?)
    }

    /// Checks every table of a blob, so that deciding needs no check that can fail.
    ///
    /// Takes time linear in the size of the tables and no memory.
    ///
    /// # Errors
    /// Any [`VerifyError`] but [`VerifyError::Decode`].
    pub fn verify(blob: &Blob<'a>) -> Result<Self, VerifyError> {
        let (header, tables) = (*blob.header(), *blob.tables());
        check_header(&header, &tables)?;
        finite(tables.constants, "constants")?;
        finite(tables.memory, "memory")?;
        let memory_start = check_programs(&header, &tables)?;
        let words = check_memory(&header, &tables, memory_start)?;
        require("words", words, header.words)?;
        check_members(&header, &tables)?;
        let bounds = bounds(&header, &tables);
        if !tables.memory.is_empty() {
            let kept = words - (memory_start as u32);
            require("memory image words", kept, count(tables.memory))?;
        }
        let labels = usize::from(header.observation_len) + header.outputs();
        let lines = tables.labels.lines();
        if lines.clone().count() != labels || !lines.into_iter().all(is_label) {
            return Err(VerifyError::Labels);
        }
        if !tables.front_end.is_empty() {
            let fits =
                frontend::well_formed(tables.front_end, header.observation_len, header.outputs());
            return Err(if fits {
                VerifyError::FrontEndUnsupported
            } else {
                VerifyError::FrontEndMalformed
            });
        }
        Ok(Policy {
            header,
            tables,
            memory_start,
            bounds,
        })
    }

    /// What the header says.
    #[must_use]
    pub const fn header(&self) -> &Header {
        &self.header
    }

    /// The tables.
    #[must_use]
    pub const fn tables(&self) -> &Tables<'a> {
        &self.tables
    }

    /// What one decision can cost at most.
    #[must_use]
    pub const fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    /// First state word of the kept cells of indexed memory: behind the teams' memory.
    pub(crate) const fn cells_start(&self) -> usize {
        (self.header.words as usize).saturating_sub(self.tables.cells.len())
    }

    /// Name and unit of every input, in order.
    pub fn inputs(&self) -> impl Iterator<Item = (&'a str, &'a str)> + use<'a> {
        let inputs = usize::from(self.header.observation_len);
        labels(self.tables.labels).take(inputs)
    }

    /// Name and unit of every continuous output, in order.
    pub fn outputs(&self) -> impl Iterator<Item = (&'a str, &'a str)> + use<'a> {
        let inputs = usize::from(self.header.observation_len);
        labels(self.tables.labels).skip(inputs)
    }
}

fn labels(text: &str) -> impl Iterator<Item = (&str, &str)> {
    text.lines()
        .map(|line| line.split_once('\t').unwrap_or_default())
}

fn is_label(line: &str) -> bool {
    line.matches('\t').count() == 1 && !line.starts_with('\t')
}

/// The length of a table, as a number that errors can carry.
fn count<T>(table: &[T]) -> u32 {
    u32::try_from(table.len()).unwrap_or(u32::MAX)
}

fn require(field: &'static str, needed: u32, got: u32) -> Result<(), VerifyError> {
    if needed == got {
        Ok(())
    } else {
        Err(VerifyError::Header { field, needed, got })
    }
}

fn at_most(field: &'static str, limit: u32, got: u32) -> Result<(), VerifyError> {
    if got <= limit {
        Ok(())
    } else {
        Err(VerifyError::Header {
            field,
            needed: limit,
            got,
        })
    }
}

fn finite(words: &[[u8; 4]], table: &'static str) -> Result<(), VerifyError> {
    match words
        .iter()
        .position(|w| !f32::from_le_bytes(*w).is_finite())
    {
        Some(index) => Err(VerifyError::NotFinite {
            table,
            index: u32::try_from(index).unwrap_or(u32::MAX),
        }),
        None => Ok(()),
    }
}

fn check_header(header: &Header, tables: &Tables<'_>) -> Result<(), VerifyError> {
    require(
        "programs",
        count(tables.programs),
        u32::from(header.programs),
    )?;
    require("teams", count(tables.teams), u32::from(header.teams))?;
    at_most("teams", u32::from(Target::MAX), u32::from(header.teams))?;
    at_most("words", MAX_WORDS, header.words)?;
    at_most("width", u32::from(MAX_WIDTH), u32::from(header.width))?;
    if header.width == 0 || header.observation_len == 0 || header.actions == 0 || header.teams == 0
    {
        return Err(VerifyError::Header {
            field: "width, observation length, actions or teams",
            needed: 1,
            got: 0,
        });
    }
    if header.window < header.observation_len {
        return Err(VerifyError::Header {
            field: "window",
            needed: u32::from(header.observation_len),
            got: u32::from(header.window),
        });
    }
    if header.action_kind == ActionKind::Continuous {
        let (low, high) = (header.action_low, header.action_high);
        if !(low.is_finite() && high.is_finite() && low <= high) {
            return Err(VerifyError::ActionRange);
        }
        at_most(
            "actions",
            u32::from(header.width),
            u32::from(header.actions),
        )?;
    } else {
        at_most(
            "actions",
            u32::from(Target::MAX) + 1,
            u32::from(header.actions),
        )?;
    }
    // Nothing outlives a decision exactly where registers and memory both do not.
    let stateless =
        header.register_mode == RegisterMode::Stateless && header.memory_model == MemoryModel::None;
    if stateless != (header.reset_scope == ResetScope::EveryDecision) {
        return Err(VerifyError::Header {
            field: "reset scope for its register mode and memory model",
            needed: if stateless {
                ResetScope::EveryDecision as u32
            } else {
                ResetScope::PerEpisode as u32
            },
            got: header.reset_scope as u32,
        });
    }
    if header.memory_model != MemoryModel::Indexed {
        require("cells", 0, count(tables.cells))?;
    }
    Ok(())
}

/// Checks every program and returns where team memory begins.
fn check_programs(header: &Header, tables: &Tables<'_>) -> Result<usize, VerifyError> {
    let width = usize::from(header.width);
    let (mut state, mut code) = (header.registers_start(), 0u32);
    for (index, bytes) in tables.programs.iter().enumerate() {
        let (program, number) = (Program::from_bytes(bytes), index as u16);
        let words = program.register_words(width);
        let [scalars, ..] = program.registers;
        let in_place = program.to_bytes() == *bytes
            && program.registers_in_range()
            && scalars > 0
            && usize::from(program.state_start) == state
            && program.code_start == code
            && span(tables.code, program.code_start, program.code_len).is_some()
            && has_constants(header, tables, program.constants_start, words);
        if !in_place {
            return Err(VerifyError::Record {
                table: "programs",
                index: u32::from(number),
            });
        }
        let target_exists = match program.target {
            Target::Team(TeamId(team)) => team < header.teams,
            Target::Atomic(action) => match header.action_kind {
                ActionKind::Discrete => action < header.actions,
                ActionKind::Continuous => action == 0 && output_in_place(header, &program),
            },
        };
        if !target_exists {
            return Err(VerifyError::NoSuchTarget { program: number });
        }
        check_code(header, tables, &program, number)?;
        state += words;
        code += u32::from(program.code_len);
        at_most("words", MAX_WORDS, state as u32)?;
    }
    require("instructions", code, count(tables.code))?;
    Ok(state)
}

/// Whether `words` constants lie at `start`; policies that begin at zero have none.
fn has_constants(header: &Header, tables: &Tables<'_>, start: u32, words: usize) -> bool {
    match header.initial_values {
        InitialValues::Zero => start == 0 && tables.constants.is_empty(),
        InitialValues::Evolved => usize::try_from(start)
            .ok()
            .and_then(|start| tables.constants.get(start..)?.get(..words))
            .is_some(),
    }
}

/// Whether a continuous action lies in the program's own registers: a scalar or the head of a vector.
fn output_in_place(header: &Header, program: &Program) -> bool {
    let layout = Layout::new(header, program);
    let output = usize::from(program.output);
    if header.actions == 1 {
        layout.is_scalar(output)
    } else {
        layout.is_vector(output)
    }
}

/// Where a program's registers and the observation lie in the state.
struct Layout {
    width: usize,
    observation: usize,
    window: usize,
    scalars: (usize, usize),
    vectors: (usize, usize),
    matrices: (usize, usize),
}

impl Layout {
    fn new(header: &Header, program: &Program) -> Self {
        let width = usize::from(header.width);
        let [s, v, m] = program.registers.map(usize::from);
        let scalars = usize::from(program.state_start);
        let (vectors, matrices) = (scalars + s, scalars + s + v * width);
        Layout {
            width,
            observation: usize::from(header.observation_len),
            window: usize::from(header.window),
            scalars: (scalars, vectors),
            vectors: (vectors, matrices),
            matrices: (matrices, matrices + m * width * width),
        }
    }

    fn is_scalar(&self, at: usize) -> bool {
        within(self.scalars, at)
    }

    fn is_vector(&self, at: usize) -> bool {
        within(self.vectors, at) && (at - self.vectors.0).is_multiple_of(self.width)
    }

    fn is_matrix(&self, at: usize) -> bool {
        within(self.matrices, at) && (at - self.matrices.0).is_multiple_of(self.width * self.width)
    }

    fn is_destination(&self, kind: Destination, at: usize) -> bool {
        match kind {
            Destination::None => at == 0,
            Destination::S | Destination::SUpdate => self.is_scalar(at),
            Destination::V => self.is_vector(at),
            Destination::M => self.is_matrix(at),
        }
    }

    fn is_source(&self, kind: Operand, at: usize) -> bool {
        let width = self.width;
        match kind {
            Operand::None => at == 0,
            Operand::S => at < self.observation || self.is_scalar(at),
            Operand::V => at + width <= self.window || self.is_vector(at),
            Operand::M => at + width * width <= self.window || self.is_matrix(at),
            Operand::VElement => at < self.window || within(self.vectors, at),
            Operand::MElement => at < self.window || within(self.matrices, at),
            Operand::SOrVElement => {
                at < self.window || self.is_scalar(at) || within(self.vectors, at)
            }
            Operand::ScalarSlot | Operand::VectorSlot | Operand::MatrixSlot => at < SLOTS,
            Operand::VectorIndex => at < width,
            Operand::MatrixIndex => at < width * width,
            // Where cells lie is known once all programs are checked.
            Operand::Cell => true,
        }
    }
}

fn within((start, end): (usize, usize), at: usize) -> bool {
    start <= at && at < end
}

fn check_code(
    header: &Header,
    tables: &Tables<'_>,
    program: &Program,
    number: u16,
) -> Result<(), VerifyError> {
    let layout = Layout::new(header, program);
    for (index, bytes) in tables.code(program).iter().enumerate() {
        let instruction_number = index as u16;
        let Some(instruction) = Instruction::from_bytes(bytes) else {
            return Err(VerifyError::Record {
                table: "code",
                index: program.code_start + u32::from(instruction_number),
            });
        };
        if instruction.to_bytes() != *bytes {
            return Err(VerifyError::Record {
                table: "code",
                index: program.code_start + u32::from(instruction_number),
            });
        }
        let op = instruction.op;
        let memory_fits = match op.group() {
            Group::TeamMemory | Group::WholeReads => header.memory_model == MemoryModel::Team,
            Group::Constants => header.initial_values == InitialValues::Evolved,
            Group::Classic if matches!(op, Op::MemRead | Op::MemWrite) => {
                header.memory_model == MemoryModel::Indexed
            }
            _ => true,
        };
        if header.groups & op.group().bit() == 0 || !memory_fits {
            return Err(VerifyError::Group {
                program: number,
                instruction: instruction_number,
            });
        }
        let [scalars, ..] = program.registers;
        let [a, b] = op.operands();
        let fields = [
            (
                'd',
                layout.is_destination(op.destination(), usize::from(instruction.d)),
            ),
            ('a', layout.is_source(a, usize::from(instruction.a))),
            ('b', layout.is_source(b, usize::from(instruction.b))),
            // A write of indexed memory stores register c in column c: all must be there.
            ('d', op != Op::MemWrite || usize::from(scalars) == REGISTERS),
        ];
        if let Some((field, _)) = fields.iter().find(|(_, right)| !right) {
            return Err(VerifyError::Operand {
                program: number,
                instruction: instruction_number,
                field: *field,
            });
        }
    }
    Ok(())
}

/// Checks team memory and cells, which lie behind the programs, and returns the state's length.
fn check_memory(
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
                table: "teams",
                index: index as u32,
            });
        }
        members += u32::from(team.members_len);
        state += words;
        streams += team.streams();
        // The next start must fit its 16-bit field; a state that ends on the limit has no next.
        at_most("words", MAX_WORDS, state as u32)?;
    }
    require("members", members, count(tables.members))?;
    require("streams", streams as u32, u32::from(header.streams))?;
    let mut previous = None;
    for (index, bytes) in tables.cells.iter().enumerate() {
        let cell = u16::from_le_bytes(*bytes);
        let ascending = previous.is_none_or(|p| cell > p);
        if !ascending || usize::from(cell) >= INDEXED_CELLS {
            return Err(VerifyError::Record {
                table: "cells",
                index: index as u32,
            });
        }
        previous = Some(cell);
    }
    let cells = (state, state + tables.cells.len());
    at_most("words", MAX_WORDS, cells.1 as u32)?;
    for (index, bytes) in tables.code.iter().enumerate() {
        if let Some(i) = Instruction::from_bytes(bytes)
            && i.op == Op::MemRead
            && !within(cells, usize::from(i.a))
        {
            return Err(VerifyError::Record {
                table: "code",
                index: index as u32,
            });
        }
    }
    Ok(cells.1 as u32)
}

/// Checks what each team lists: programs exist, one leads out, slots that they read are kept.
fn check_members(header: &Header, tables: &Tables<'_>) -> Result<(), VerifyError> {
    for number in 0..header.teams {
        let team = tables.team(TeamId(number)).unwrap_or_default();
        if team.members_len == 0 {
            return Err(VerifyError::EmptyTeam { team: number });
        }
        let mut exit = false;
        for ProgramId(member) in tables.members(&team) {
            let Some(program) = tables.program(ProgramId(member)) else {
                return Err(VerifyError::NoSuchProgram {
                    team: number,
                    program: member,
                });
            };
            exit |= matches!(program.target, Target::Atomic(_));
            for (index, bytes) in tables.code(&program).iter().enumerate() {
                let Some(instruction) = Instruction::from_bytes(bytes) else {
                    continue;
                };
                let [source, _] = instruction.op.operands();
                let section = match source {
                    Operand::ScalarSlot => Section::Scalar,
                    Operand::VectorSlot => Section::Vector,
                    Operand::MatrixSlot => Section::Matrix,
                    _ => continue,
                };
                if team.kept(section) & (1u8 << (instruction.a & 7)) == 0 {
                    return Err(VerifyError::Operand {
                        program: member,
                        instruction: index as u16,
                        field: 'a',
                    });
                }
            }
        }
        if !exit {
            return Err(VerifyError::NoExit { team: number });
        }
    }
    Ok(())
}

/// Every program runs at most once in a decision, so the sum over all of them is a bound.
fn bounds(header: &Header, tables: &Tables<'_>) -> Bounds {
    let cells = tables.cells.len() as u16;
    let weight = |bytes: &[u8; Instruction::BYTES]| {
        Instruction::from_bytes(bytes).map_or(0, |i| i.op.cost().weight(header.width, cells))
    };
    Bounds {
        instructions: count(tables.code),
        weighted_operations: tables.code.iter().map(weight).sum(),
        teams: header.teams,
    }
}
