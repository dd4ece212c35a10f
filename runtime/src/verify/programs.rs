//! Checks each program's position in the tables, its registers, its target and every field of its instructions.

use super::error::VerifyError;
use super::header::{MAX_WORDS, at_most, count, require};
use crate::blob::{ActionKind, Header, InitialValues, MemoryModel};
use crate::isa::{Destination, Group, Op, Operand, REGISTERS, SLOTS};
use crate::parts::{CodeField, Field, Table};
use crate::registers::{Location, RegisterMap};
use crate::tables::{Instruction, Program, Tables, Target, TeamId, span};

/// Checks every program. Returns the index of the first state word of team memory.
pub(super) fn check_programs(header: &Header, tables: &Tables<'_>) -> Result<usize, VerifyError> {
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
                table: Table::Programs,
                index: u32::from(number),
            });
        }
        if let (ActionKind::Each, Target::Team(_)) = (header.action_kind, program.target) {
            return Err(VerifyError::LeadsToTeam { program: number });
        }
        let target_exists = match program.target {
            Target::Team(TeamId(team)) => team < header.teams,
            Target::Atomic(action) => match header.action_kind {
                ActionKind::Discrete | ActionKind::Each => action < header.actions,
                ActionKind::Continuous => action == 0,
            },
        };
        if !target_exists || !output_in_place(header, &program) {
            return Err(VerifyError::NoSuchTarget { program: number });
        }
        check_code(header, tables, &program, number)?;
        state += words;
        code += u32::from(program.code_len);
        at_most(Field::Words, MAX_WORDS, state as u32)?;
    }
    require(Field::Instructions, code, count(tables.code))?;
    Ok(state)
}

/// Whether the table of constants has `words` constants from `start` on.
///
/// If all initial values are zero, there must be no constants and `start` must be 0.
pub(super) fn has_constants(
    header: &Header,
    tables: &Tables<'_>,
    start: u32,
    words: usize,
) -> bool {
    match header.initial_values {
        InitialValues::Zero => start == 0 && tables.constants.is_empty(),
        InitialValues::Evolved => usize::try_from(start)
            .ok()
            .and_then(|start| tables.constants.get(start..)?.get(..words))
            .is_some(),
    }
}

/// Whether the program's output is a register of the right kind.
///
/// For one output it must be a scalar register of the program. For several outputs of one program it must be the first
/// word of a vector register, and all outputs lie in the program's vectors. A program without a continuous action must name the start of its registers, so that the
/// program has only one encoding.
fn output_in_place(header: &Header, program: &Program) -> bool {
    let operands = Operands::new(header, program);
    let output = usize::from(program.output);
    match (header.action_kind, program.target) {
        (ActionKind::Discrete, _) | (_, Target::Team(_)) => program.output == program.state_start,
        (ActionKind::Each, Target::Atomic(_)) => operands.is_scalar(output),
        (ActionKind::Continuous, Target::Atomic(_)) if header.actions == 1 => {
            operands.is_scalar(output)
        }
        (ActionKind::Continuous, Target::Atomic(_)) => {
            operands.is_vector(output) && operands.is_in_vectors(output, header.outputs())
        }
    }
}

/// Decides what the fields of a program's instructions may refer to.
struct Operands {
    width: usize,
    observation: usize,
    window: usize,
    registers: RegisterMap,
}

impl Operands {
    fn new(header: &Header, program: &Program) -> Self {
        Operands {
            width: usize::from(header.width),
            observation: header.observed(),
            window: usize::from(header.window),
            registers: RegisterMap::of(header, program),
        }
    }

    fn is_scalar(&self, at: usize) -> bool {
        matches!(self.registers.locate(at), Some(Location::Scalar(_)))
    }

    fn is_vector(&self, at: usize) -> bool {
        matches!(self.registers.locate(at), Some(Location::Vector(_, 0)))
    }

    /// Whether this word and the `len` − 1 behind it are vector registers, one or several.
    fn is_in_vectors(&self, at: usize, len: usize) -> bool {
        let last = at + len.saturating_sub(1);
        matches!(self.registers.locate(last), Some(Location::Vector(..)))
    }

    fn is_matrix(&self, at: usize) -> bool {
        matches!(self.registers.locate(at), Some(Location::Matrix(_, 0)))
    }

    fn is_destination(&self, kind: Destination, at: usize) -> bool {
        match kind {
            Destination::None => at == 0,
            Destination::S | Destination::SUpdate => self.is_scalar(at),
            Destination::V | Destination::VUpdate => self.is_vector(at),
            Destination::M | Destination::MUpdate => self.is_matrix(at),
        }
    }

    fn is_source(&self, kind: Operand, at: usize) -> bool {
        let width = self.width;
        match kind {
            Operand::None => at == 0,
            Operand::S => at < self.observation || self.is_scalar(at),
            Operand::V => at + width <= self.window || self.is_vector(at),
            Operand::M => at + width * width <= self.window || self.is_matrix(at),
            Operand::VElement => matches!(
                self.registers.locate(at),
                Some(Location::Window(_) | Location::Vector(..))
            ),
            Operand::MElement => matches!(
                self.registers.locate(at),
                Some(Location::Window(_) | Location::Matrix(..))
            ),
            Operand::SOrVElement => matches!(
                self.registers.locate(at),
                Some(Location::Window(_) | Location::Scalar(_) | Location::Vector(..))
            ),
            Operand::ScalarSlot | Operand::VectorSlot | Operand::MatrixSlot => at < SLOTS,
            Operand::VectorIndex => at < width,
            Operand::MatrixIndex => at < width * width,
            // `check_memory` checks this field. The position of the cells is not known before all programs are checked.
            Operand::Cell => true,
        }
    }
}

pub(super) fn within((start, end): (usize, usize), at: usize) -> bool {
    start <= at && at < end
}

fn check_code(
    header: &Header,
    tables: &Tables<'_>,
    program: &Program,
    number: u16,
) -> Result<(), VerifyError> {
    let operands = Operands::new(header, program);
    for (index, bytes) in tables.code(program).iter().enumerate() {
        let instruction_number = index as u16;
        let Some(instruction) = Instruction::from_bytes(bytes) else {
            return Err(VerifyError::Record {
                table: Table::Code,
                index: program.code_start + u32::from(instruction_number),
            });
        };
        if instruction.to_bytes() != *bytes {
            return Err(VerifyError::Record {
                table: Table::Code,
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
                CodeField::D,
                operands.is_destination(op.destination(), usize::from(instruction.d)),
            ),
            (
                CodeField::A,
                operands.is_source(a, usize::from(instruction.a)),
            ),
            (
                CodeField::B,
                operands.is_source(b, usize::from(instruction.b)),
            ),
            // A write to indexed memory stores scalar register c in column c, so the program must have all of them.
            (
                CodeField::D,
                op != Op::MemWrite || usize::from(scalars) == REGISTERS,
            ),
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
