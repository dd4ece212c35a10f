//! Programs as Rust functions: one line for each instruction.

use std::fmt::{self, Write as _};

use tpg_runtime::isa::{Destination, Form, Op, Operand};
use tpg_runtime::registers::Location;
use tpg_runtime::tables::{Instruction, Program, Section, Target};

use super::super::plan::{Function, Plan};
use super::super::text::{identifier, letter, target};

/// Writes the function that runs a program.
pub(super) fn write_function(out: &mut String, plan: &Plan<'_>, function: Function) -> fmt::Result {
    let program = plan.program(function.program);
    let output = output(plan, program);
    let returns = if output.is_some() {
        "(f32, Output)"
    } else {
        "f32"
    };
    writeln!(
        out,
        "\n/// Program {} -> {}.",
        function.program,
        target(plan, function.program)
    )?;
    writeln!(
        out,
        "fn {}({}) -> {returns} {{",
        name(function),
        parameters(plan, function).join(", ")
    )?;
    let registers = plan.mentioned(function.program);
    for (section, number, values) in &registers {
        match (plan.stateful, section) {
            (true, Section::Scalar) => writeln!(out, "    let mut s{number} = r.s{number};")?,
            (true, _) => {}
            (false, _) => writeln!(
                out,
                "    let mut {}{number} = {};",
                letter(*section),
                literal(plan, *section, values)
            )?,
        }
    }
    for instruction in plan.code(function.program) {
        if let Some(line) = statement(plan, function, program, &instruction) {
            writeln!(out, "    {line}")?;
        }
    }
    if plan.stateful {
        for (_, number, _) in registers
            .iter()
            .filter(|(section, ..)| *section == Section::Scalar)
        {
            writeln!(out, "    r.s{number} = s{number};")?;
        }
    }
    match output {
        Some(output) => writeln!(out, "    (s0, [{}])\n}}", output.join(", ")),
        None => writeln!(out, "    s0\n}}"),
    }
}

pub(super) fn name(function: Function) -> String {
    match function.team {
        Some(team) => format!("program_{}_in_team_{team}", function.program),
        None => format!("program_{}", function.program),
    }
}

fn parameters(plan: &Plan<'_>, function: Function) -> Vec<String> {
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
    parameters
}

/// What a team passes to the function.
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

/// The words of a continuous action, if the program has one.
fn output(plan: &Plan<'_>, program: &Program) -> Option<Vec<String>> {
    let acts = matches!(program.target, Target::Atomic(_));
    (acts && plan.outputs > 0).then(|| {
        let place = |k: usize| scalar(plan, program, program.output + k as u16);
        (0..plan.values()).map(place).collect()
    })
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

/// A register of more than one word: those of stateful programs stay where they are.
fn wide(plan: &Plan<'_>, letter: char, number: usize) -> String {
    let owner = if plan.stateful { "r." } else { "" };
    format!("{owner}{letter}{number}")
}

fn scalar(plan: &Plan<'_>, program: &Program, at: u16) -> String {
    match plan.locate(program, at) {
        Location::Window(k) => format!("x[{k}]"),
        Location::Scalar(k) => format!("s{k}"),
        Location::Vector(v, k) => format!("{}[{k}]", wide(plan, 'v', v)),
        Location::Matrix(m, k) => {
            let (row, column) = (k / plan.width, k % plan.width);
            format!("{}[{row}][{column}]", wide(plan, 'm', m))
        }
    }
}

fn operand(plan: &Plan<'_>, program: &Program, kind: Operand, at: u16) -> Option<String> {
    let place = plan.locate(program, at);
    Some(match (kind, place) {
        (Operand::None, _) => return None,
        (Operand::V, Location::Window(k)) => format!("&vector(x, {k})"),
        (Operand::M, Location::Window(k)) => format!("&matrix(x, {k})"),
        (Operand::V, Location::Vector(k, _)) => format!("&{}", wide(plan, 'v', k)),
        (Operand::M, Location::Matrix(k, _)) => format!("&{}", wide(plan, 'm', k)),
        _ => scalar(plan, program, at),
    })
}

fn destination(plan: &Plan<'_>, program: &Program, kind: Destination, at: u16) -> String {
    match (kind, plan.locate(program, at)) {
        (Destination::V, Location::Vector(k, _)) => wide(plan, 'v', k),
        (Destination::M, Location::Matrix(k, _)) => wide(plan, 'm', k),
        _ => scalar(plan, program, at),
    }
}

fn statement(
    plan: &Plan<'_>,
    function: Function,
    program: &Program,
    i: &Instruction,
) -> Option<String> {
    let op = i.op;
    let team = function
        .team
        .map(|team| &plan.teams[usize::from(team)].record);
    let keeps = |section| team.is_some_and(|team| team.kept(section) != 0);
    // What lies in memory has operands that are no state offsets.
    let to_register = |value: String| {
        let d = destination(plan, program, op.destination(), i.d);
        Some(format!("{d} = {value};"))
    };
    match (op.form(), op.section()) {
        (Form::Move, _) if op.operands()[0] == Operand::Cell => {
            return to_register(format!("indexed.cells[{}]", plan.cell(i.a)));
        }
        (Form::Read, Some(section)) => {
            let element = match section {
                Section::Scalar => String::new(),
                Section::Vector => format!("[{}]", i.b),
                Section::Matrix => format!(
                    "[{}][{}]",
                    usize::from(i.b) / plan.width,
                    usize::from(i.b) % plan.width
                ),
            };
            return to_register(format!("memory.{}m{}{element}", letter(section), i.a));
        }
        (Form::ReadWhole, Some(section)) => {
            return to_register(format!("memory.{}m{}", letter(section), i.a));
        }
        (Form::Write, Some(section)) => {
            let value = operand(plan, program, op.operands()[0], i.a)?;
            return keeps(section).then(|| format!("memory.write_{}({value});", letter(section)));
        }
        (Form::WriteCells, _) => {
            let all = "indexed.write([s0, s1, s2, s3, s4, s5, s6, s7]);";
            return (!plan.cells.is_empty()).then(|| all.to_owned());
        }
        (Form::Reload, _) => return to_register(reloaded(plan, program, i)),
        _ => {}
    }
    let operands = op.operands().into_iter().zip([i.a, i.b]);
    let mut arguments: Vec<String> = operands
        .filter_map(|(kind, at)| operand(plan, program, kind, at))
        .collect();
    if op.destination() == Destination::SUpdate {
        arguments.insert(0, scalar(plan, program, i.d));
    }
    let arguments = arguments.join(", ");
    to_register(match op.form() {
        Form::Scalar => format!("math::{}({arguments})", op.function()),
        Form::Classic => format!("math::classic::{}({arguments})", op.function()),
        Form::Move => arguments,
        _ => format!("{}({arguments})", identifier(op)),
    })
}

/// The register's evolved constants.
fn reloaded(plan: &Plan<'_>, program: &Program, i: &Instruction) -> String {
    let (section, number) = match plan.locate(program, i.d) {
        Location::Vector(k, _) => (Section::Vector, k),
        Location::Matrix(k, _) => (Section::Matrix, k),
        Location::Scalar(k) | Location::Window(k) => (Section::Scalar, k),
    };
    let registers = plan.registers(program).into_iter();
    let mut same = registers.filter(|(kind, k, _)| (*kind, *k) == (section, number));
    same.next().map_or_else(String::new, |(_, _, values)| {
        literal(plan, section, &values)
    })
}

/// Writes a function for an operation on vectors or matrices, under its mnemonic.
pub(super) fn write_helper(out: &mut String, op: Op) -> fmt::Result {
    let (f, form) = (op.function(), op.form());
    let [a, b] = op.operands();
    let matrix = op.destination() == Destination::M;
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
    let returns = match op.destination() {
        Destination::V => "Vector",
        Destination::M => "Matrix",
        _ => "f32",
    };
    writeln!(
        out,
        "\nfn {}(x: {}{second}) -> {returns} {{\n    {body}\n}}",
        identifier(op),
        kind(a)
    )
}
