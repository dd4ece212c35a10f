//! Programs as Rust functions: one line for each instruction.

use std::fmt::{self, Write as _};

use tpg_runtime::isa::{Form, Op, Operand};
use tpg_runtime::tables::{Instruction, Section};

use super::super::plan::{Function, Plan};
use super::super::program::{Statement, Value, Variable, WriteProgram};
use super::super::text::{function_name, identifier, letter, target};
use super::super::values::Register;
use tpg_runtime::registers::Location;

/// Writes the programs of a plan in Rust.
pub(super) struct Rust<'a, 'p>(pub(super) &'a Plan<'p>);

impl WriteProgram for Rust<'_, '_> {
    fn head(&self, function: Function) -> String {
        let plan = self.0;
        let mut parameters = vec!["x: &Window".to_owned()];
        if plan.stateful {
            parameters.push(format!("r: &mut Registers{}", function.program));
        }
        if let Some(team) = function.team {
            parameters.push(format!("memory: &mut Memory{team}"));
        }
        if plan.uses_cells(function.program) {
            parameters.push("indexed: &mut Indexed".to_owned());
        }
        let acts = plan.acts(function.program);
        format!(
            "\n/// Program {} -> {}.\nfn {}({}) -> {} {{\n",
            function.program,
            target(plan, function.program),
            function_name(function),
            parameters.join(", "),
            if acts { "(f32, Output)" } else { "f32" }
        )
    }

    fn declaration(&self, _: Function, register: &Register) -> String {
        let (section, number) = (register.section, register.number);
        match (self.0.stateful, section) {
            (true, Section::Scalar) => format!("    let mut s{number} = r.s{number};\n"),
            (true, _) => String::new(),
            (false, _) => format!(
                "    let mut {}{number} = {};\n",
                letter(section),
                literal(self.0, section, &register.values)
            ),
        }
    }

    fn statement(&self, _: Function, i: &Instruction, statement: &Statement) -> String {
        let plan = self.0;
        let (register, value) = match statement {
            Statement::WriteSlot(section, value) => {
                let value = argument(plan, *value);
                return format!("memory.write_{}({value});", letter(*section));
            }
            Statement::WriteCells => {
                return "indexed.write([s0, s1, s2, s3, s4, s5, s6, s7]);".to_owned();
            }
            Statement::Set(register, value) => (register, value),
        };
        let value = match value {
            Value::Cell(cell) => format!("indexed.cells[{cell}]"),
            Value::SlotElement(section, slot, at) => {
                let (row, column) = (usize::from(*at) / plan.width, usize::from(*at) % plan.width);
                let element = match section {
                    Section::Scalar => String::new(),
                    Section::Vector => format!("[{at}]"),
                    Section::Matrix => format!("[{row}][{column}]"),
                };
                format!("memory.{}m{slot}{element}", letter(*section))
            }
            Value::Slot(section, slot) => format!("memory.{}m{slot}", letter(*section)),
            Value::Constants(values) => {
                let section = match register {
                    Variable::Scalar(_) => Section::Scalar,
                    Variable::Vector(_) => Section::Vector,
                    Variable::Matrix(_) => Section::Matrix,
                };
                literal(plan, section, values)
            }
            Value::Copy(variable) => argument(plan, *variable),
            Value::Result(arguments) => {
                let arguments: Vec<String> = arguments.iter().map(|x| argument(plan, *x)).collect();
                let function = match i.op.form() {
                    Form::Scalar => format!("math::{}", i.op.function()),
                    Form::Classic => format!("math::classic::{}", i.op.function()),
                    _ => identifier(i.op),
                };
                format!("{function}({})", arguments.join(", "))
            }
        };
        let register = match register {
            Variable::Vector(Location::Vector(k, _)) => whole(plan, 'v', *k),
            Variable::Matrix(Location::Matrix(k, _)) => whole(plan, 'm', *k),
            Variable::Scalar(at) | Variable::Vector(at) | Variable::Matrix(at) => scalar(plan, *at),
        };
        format!("{register} = {value};")
    }

    fn keep(&self, _: Function, registers: &[Register]) -> String {
        let scalars = registers.iter().filter(|r| r.section == Section::Scalar);
        let kept = scalars.filter(|_| self.0.stateful);
        kept.map(|r| format!("    r.s{0} = s{0};\n", r.number))
            .collect()
    }

    fn end(&self, _: Function, output: Option<Vec<Location>>) -> String {
        let Some(output) = output else {
            return "    s0\n}\n".to_owned();
        };
        let output: Vec<String> = output.into_iter().map(|at| scalar(self.0, at)).collect();
        format!("    (s0, [{}])\n}}\n", output.join(", "))
    }
}

/// The arguments that a team passes to the function.
pub(super) fn arguments(plan: &Plan<'_>, function: Function) -> Vec<String> {
    let mut arguments = vec!["x".to_owned()];
    if plan.stateful {
        arguments.push(format!("&mut self.program_{}", function.program));
    }
    if let Some(team) = function.team {
        arguments.push(format!("&mut self.team_{team}"));
    }
    if plan.uses_cells(function.program) {
        arguments.push("&mut self.indexed".to_owned());
    }
    arguments
}

/// A float that the compiler reads back as the same bits.
pub(super) fn number(x: f32) -> String {
    format!("{x:?}")
}

pub(super) fn list(values: &[f32]) -> String {
    if values.len() > 1 && values.iter().all(|x| x.to_bits() == values[0].to_bits()) {
        return format!("[{}; {}]", number(values[0]), values.len());
    }
    let values: Vec<String> = values.iter().map(|x| number(*x)).collect();
    format!("[{}]", values.join(", "))
}

/// A scalar, vector or matrix as an expression.
pub(super) fn literal(plan: &Plan<'_>, section: Section, values: &[f32]) -> String {
    match section {
        Section::Scalar => number(values[0]),
        Section::Vector => list(values),
        Section::Matrix => {
            let rows: Vec<String> = values.chunks(plan.width).map(list).collect();
            format!("[{}]", rows.join(", "))
        }
    }
}

/// A register of more than one word. A stateful program's register is used in place.
fn whole(plan: &Plan<'_>, letter: char, number: usize) -> String {
    let owner = if plan.stateful { "r." } else { "" };
    format!("{owner}{letter}{number}")
}

fn scalar(plan: &Plan<'_>, at: Location) -> String {
    match at {
        Location::Window(k) => format!("x[{k}]"),
        Location::Scalar(k) => format!("s{k}"),
        Location::Vector(v, k) => format!("{}[{k}]", whole(plan, 'v', v)),
        Location::Matrix(m, k) => {
            let (row, column) = (k / plan.width, k % plan.width);
            format!("{}[{row}][{column}]", whole(plan, 'm', m))
        }
    }
}

fn argument(plan: &Plan<'_>, variable: Variable) -> String {
    match variable {
        Variable::Vector(Location::Window(k)) => format!("&vector(x, {k})"),
        Variable::Matrix(Location::Window(k)) => format!("&matrix(x, {k})"),
        Variable::Vector(Location::Vector(k, _)) => format!("&{}", whole(plan, 'v', k)),
        Variable::Matrix(Location::Matrix(k, _)) => format!("&{}", whole(plan, 'm', k)),
        Variable::Scalar(at) | Variable::Vector(at) | Variable::Matrix(at) => scalar(plan, at),
    }
}

/// Writes a function for an operation on vectors or matrices, under its mnemonic.
pub(super) fn write_helper(out: &mut String, op: Op) -> fmt::Result {
    let (f, form) = (op.function(), op.form());
    let [a, b] = op.operands();
    let matrix = op.destination().section() == Some(Section::Matrix);
    let body = match form {
        Form::Each if matrix && b == Operand::None => {
            format!("each_row(x, |x| math::map(x, math::lanes::{f}))")
        }
        Form::Each if matrix => format!(
            "let mut out = *x;\n    for (out, y) in out.iter_mut().zip(y) {{\n        *out = math::zip(out, y, math::lanes::{f});\n    }}\n    out"
        ),
        Form::Each if b == Operand::None => format!("math::map(x, math::lanes::{f})"),
        Form::Each => format!("math::zip(x, y, math::lanes::{f})"),
        Form::Scale if matrix => {
            format!("each_row(y, |y| math::map(y, |y| math::lanes::{f}(x, y)))")
        }
        Form::Scale => format!("math::map(y, |y| math::lanes::{f}(x, y))"),
        Form::Outer => format!("fill_rows(x, |x| math::map(y, |y| math::lanes::{f}(x, y)))"),
        Form::Reduce if a == Operand::M => format!("math::{f}(x.as_flattened())"),
        Form::Reduce => format!("math::{f}(x)"),
        Form::Rows => format!(
            "let mut out = [0.0; W];\n    for (out, row) in out.iter_mut().zip(x) {{\n        *out = math::{f}(row);\n    }}\n    out"
        ),
        Form::Whole if b == Operand::None => format!("math::{f}(x)"),
        Form::Whole => format!("math::{f}(x, y)"),
        Form::Fill => "[x; W]".to_owned(),
        Form::FillRows => "[*x; W]".to_owned(),
        Form::FillColumns => "fill_rows(x, |x| [x; W])".to_owned(),
        Form::Latch => "if math::opens(x) { *y } else { *old }".to_owned(),
        _ => return Ok(()),
    };
    let kind = |operand| match operand {
        Operand::V => "&Vector",
        Operand::M => "&Matrix",
        _ => "f32",
    };
    let second = if b == Operand::None {
        String::new()
    } else {
        format!(", y: {}", kind(b))
    };
    let returns = match op.destination().section() {
        Some(Section::Vector) => "Vector",
        Some(Section::Matrix) => "Matrix",
        _ => "f32",
    };
    let old = if op.destination().is_update() {
        format!("old: &{returns}, ")
    } else {
        String::new()
    };
    writeln!(
        out,
        "\nfn {}({old}x: {}{second}) -> {returns} {{\n    {body}\n}}",
        identifier(op),
        kind(a)
    )
}
