//! Goes through a program's instructions and writes its function, independent of the language.

use tpg_runtime::isa::{Destination, Form, Operand};
use tpg_runtime::tables::{Instruction, Section};

use super::plan::{Function, Plan};
use super::values::Register;
use tpg_runtime::registers::Location;

/// A value of a program's state: one word of it, or a whole register.
#[derive(Debug, Clone, Copy)]
pub(super) enum Variable {
    Scalar(Location),
    /// From a location on, as many words as a vector has.
    Vector(Location),
    /// From a location on, as many words as a matrix has.
    Matrix(Location),
}

/// An instruction with its operands resolved.
#[derive(Debug)]
pub(super) enum Statement {
    /// Sets a register, or one word of it.
    Set(Variable, Value),
    /// Writes a value to a random slot of the section.
    WriteSlot(Section, Variable),
    /// Writes the values of the scalar registers to random cells.
    WriteCells,
}

/// The value that a register is set to.
#[derive(Debug)]
pub(super) enum Value {
    /// A kept cell, counted from the first one.
    Cell(usize),
    /// One word of a slot.
    SlotElement(Section, u16, u16),
    /// All of a slot.
    Slot(Section, u16),
    /// The register's evolved constants.
    Constants(Vec<f32>),
    /// The value of another variable.
    Copy(Variable),
    /// The result of the instruction's operation. If the operation reads its destination too, that is the first
    /// argument.
    Result(Vec<Variable>),
}

/// How a language writes the function of a program.
pub(super) trait WriteProgram {
    /// The function's head.
    fn head(&self, function: Function) -> String;
    /// The declaration of a register.
    fn declaration(&self, function: Function, register: &Register) -> String;
    /// An instruction as a statement, without end of line.
    fn statement(&self, function: Function, i: &Instruction, statement: &Statement) -> String;
    /// Lines that come between the instructions and the end, for registers that outlive the function.
    fn keep(&self, function: Function, registers: &[Register]) -> String;
    /// The function's end, with the words of the program's action.
    fn end(&self, function: Function, output: Option<Vec<Location>>) -> String;
}

/// Writes the function that runs a program.
pub(super) fn write_function(
    out: &mut String,
    plan: &Plan<'_>,
    language: &impl WriteProgram,
    function: Function,
) {
    let number = function.program;
    let registers = plan.mentioned(function);
    out.push_str(&language.head(function));
    for register in &registers {
        out.push_str(&language.declaration(function, register));
    }
    for i in plan.code(number) {
        if let Some(statement) = statement(plan, function, &i) {
            let line = language.statement(function, &i, &statement);
            out.push_str(&format!("    {line}\n"));
        }
    }
    out.push_str(&language.keep(function, &registers));
    let program = plan.program(number);
    let output = |k| plan.locate(program, program.output + k as u16);
    let outputs = plan.acts(number).then(|| (0..plan.values()).map(output));
    out.push_str(&language.end(function, outputs.map(Iterator::collect)));
}

/// The instruction with its operands resolved. `None` if it has no effect, such as a write to memory that nothing
/// reads.
fn statement(plan: &Plan<'_>, function: Function, i: &Instruction) -> Option<Statement> {
    if !plan.has_effect(function, i) {
        return None;
    }
    let (op, program) = (i.op, plan.program(function.program));
    let [a, b] = op.operands();
    let locate = |at| plan.locate(program, at);
    let operand = |kind, at| {
        Some(match (kind, locate(at)) {
            (Operand::None, _) => return None,
            (Operand::V, at) => Variable::Vector(at),
            (Operand::M, at) => Variable::Matrix(at),
            (_, at) => Variable::Scalar(at),
        })
    };
    let register = || match op.destination() {
        Destination::V | Destination::VUpdate => Variable::Vector(locate(i.d)),
        Destination::M | Destination::MUpdate => Variable::Matrix(locate(i.d)),
        _ => Variable::Scalar(locate(i.d)),
    };
    // Operands that are slots or cells are not state offsets.
    let value = match (op.form(), op.section()) {
        (Form::Move, _) if a == Operand::Cell => Value::Cell(plan.cell(i.a)),
        (Form::Move, _) => Value::Copy(operand(a, i.a)?),
        (Form::Read, Some(section)) => Value::SlotElement(section, i.a, i.b),
        (Form::ReadWhole, Some(section)) => Value::Slot(section, i.a),
        (Form::Reload, _) => Value::Constants(plan.constants_at(function.program, locate(i.d))),
        (Form::Write, Some(section)) => {
            return Some(Statement::WriteSlot(section, operand(a, i.a)?));
        }
        (Form::WriteCells, _) => return Some(Statement::WriteCells),
        _ => {
            let updated = op.destination().is_update().then(register);
            let operands = [(a, i.a), (b, i.b)].into_iter();
            let operands = operands.filter_map(|(kind, at)| operand(kind, at));
            Value::Result(updated.into_iter().chain(operands).collect())
        }
    };
    Some(Statement::Set(register(), value))
}
