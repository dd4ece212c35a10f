//! Programs as C functions: one line for each instruction.

use std::fmt::{self, Write as _};

use tpg_runtime::isa::{Destination, Form, Op, Operand};
use tpg_runtime::registers::Location;
use tpg_runtime::tables::{Instruction, Program, Section};

use super::super::plan::{Function, Plan};
use super::super::text::{identifier, letter, target};

/// What an operation of this cost or more computes, the runtime's library computes for C too.
const TRANSCENDENTAL: u8 = 24;

/// The name of the library's function for an operation that C does not compute inline.
///
/// The square root is one: C's own may set `errno`, or be missing without an operating system.
pub(super) fn external(op: Op) -> Option<String> {
    let classic = match op.form() {
        Form::Scalar => "",
        Form::Classic => "classic_",
        _ => return None,
    };
    let outside = op.cost().unit >= TRANSCENDENTAL || op == Op::Sqrt;
    outside.then(|| format!("tpg_math_{classic}{}", op.function()))
}

/// How many scalars an operation takes.
pub(super) fn arity(op: Op) -> usize {
    let operands = op
        .operands()
        .iter()
        .filter(|kind| **kind != Operand::None)
        .count();
    operands + usize::from(op.destination() == Destination::SUpdate)
}

/// Writes the function that runs a program; types begin with `prefix`.
pub(super) fn write_function(
    out: &mut String,
    plan: &Plan<'_>,
    prefix: &str,
    function: Function,
) -> fmt::Result {
    let program = plan.program(function.program);
    let parameters = parameters(plan, prefix, function).join(", ");
    writeln!(
        out,
        "\n/* Program {} -> {}. */",
        function.program,
        target(plan, function.program)
    )?;
    writeln!(
        out,
        "static float {}({parameters})\n{{\n    (void)x;",
        name(function)
    )?;
    let registers = plan.mentioned(function.program);
    for (section, number, values) in &registers {
        match (plan.stateful, section) {
            (true, Section::Scalar) => writeln!(out, "    float s{number} = r->s{number};")?,
            (true, _) => {}
            (false, Section::Scalar) => {
                writeln!(out, "    float s{number} = {};", number_text(values[0]))?;
            }
            (false, _) => writeln!(
                out,
                "    float {}{number}[{}] = {};",
                letter(*section),
                values.len(),
                list(values)
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
            writeln!(out, "    r->s{number} = s{number};")?;
        }
    }
    if plan.acts(function.program) {
        for k in 0..plan.values() {
            let value = scalar(plan, program, program.output + k as u16);
            writeln!(out, "    output[{k}] = {value};")?;
        }
    }
    writeln!(out, "    return s0;\n}}")
}

pub(super) fn name(function: Function) -> String {
    match function.team {
        Some(team) => format!("program_{}_in_team_{team}", function.program),
        None => format!("program_{}", function.program),
    }
}

fn parameters(plan: &Plan<'_>, prefix: &str, function: Function) -> Vec<String> {
    let mut parameters = vec!["const float *restrict x".to_owned()];
    if plan.stateful {
        parameters.push(format!(
            "{prefix}_registers_{} *restrict r",
            function.program
        ));
    }
    if let Some(team) = function.team {
        parameters.push(format!("{prefix}_memory_{team} *restrict memory"));
    }
    if plan.uses_cells(function.program) {
        parameters.push(format!("{prefix}_indexed *restrict indexed"));
    }
    if plan.acts(function.program) {
        parameters.push("float *restrict output".to_owned());
    }
    parameters
}

/// What a team passes to the function.
pub(super) fn arguments(plan: &Plan<'_>, function: Function) -> Vec<String> {
    let mut arguments = vec!["x".to_owned()];
    if plan.stateful {
        arguments.push(format!("&self->program_{}", function.program));
    }
    if let Some(team) = function.team {
        arguments.push(format!("&self->team_{team}"));
    }
    if plan.uses_cells(function.program) {
        arguments.push("&self->indexed".to_owned());
    }
    if plan.acts(function.program) {
        arguments.push(format!("output_{}", function.program));
    }
    arguments
}

/// A float in hexadecimal notation, which every compiler reads back as the same bits.
pub(super) fn number_text(x: f32) -> String {
    let bits = x.to_bits();
    let sign = if bits >> 31 == 1 { "-" } else { "" };
    let (exponent, fraction) = (((bits >> 23) & 0xff) as i32, bits & 0x007f_ffff);
    match (exponent, fraction) {
        (0, 0) => format!("{sign}0.0f"),
        (0, _) => format!("{sign}0x0.{:06x}p-126f", fraction << 1),
        _ => format!("{sign}0x1.{:06x}p{}f", fraction << 1, exponent - 127),
    }
}

pub(super) fn list(values: &[f32]) -> String {
    if values.iter().all(|x| x.to_bits() == 0) {
        return "{ 0.0f }".to_owned();
    }
    let values: Vec<String> = values.iter().map(|x| number_text(*x)).collect();
    format!("{{ {} }}", values.join(", "))
}

/// A register of more than one word: those of stateful programs stay where they are.
fn wide(plan: &Plan<'_>, letter: char, number: usize) -> String {
    let owner = if plan.stateful { "r->" } else { "" };
    format!("{owner}{letter}{number}")
}

fn scalar(plan: &Plan<'_>, program: &Program, at: u16) -> String {
    match plan.locate(program, at) {
        Location::Window(k) => format!("x[{k}]"),
        Location::Scalar(k) => format!("s{k}"),
        Location::Vector(v, k) => format!("{}[{k}]", wide(plan, 'v', v)),
        Location::Matrix(m, k) => format!("{}[{k}]", wide(plan, 'm', m)),
    }
}

fn operand(plan: &Plan<'_>, program: &Program, kind: Operand, at: u16) -> Option<String> {
    Some(match (kind, plan.locate(program, at)) {
        (Operand::None, _) => return None,
        (Operand::V | Operand::M, Location::Window(k)) => format!("x + {k}"),
        (Operand::V, Location::Vector(k, _)) => wide(plan, 'v', k),
        (Operand::M, Location::Matrix(k, _)) => wide(plan, 'm', k),
        _ => scalar(plan, program, at),
    })
}

fn words(plan: &Plan<'_>, section: Section) -> &'static str {
    match section.slot_words(plan.width) {
        _ if section == Section::Vector => "W",
        _ => "W * W",
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
    let d = match (op.destination(), plan.locate(program, i.d)) {
        (Destination::V, Location::Vector(k, _)) => wide(plan, 'v', k),
        (Destination::M, Location::Matrix(k, _)) => wide(plan, 'm', k),
        _ => scalar(plan, program, i.d),
    };
    match (op.form(), op.section()) {
        (Form::Move, _) if op.operands()[0] == Operand::Cell => {
            return Some(format!("{d} = indexed->cells[{}];", plan.cell(i.a)));
        }
        (Form::Read, Some(section)) => {
            let element = match section {
                Section::Scalar => String::new(),
                _ => format!("[{}]", i.b),
            };
            return Some(format!(
                "{d} = memory->{}m{}{element};",
                letter(section),
                i.a
            ));
        }
        (Form::ReadWhole, Some(section)) => {
            let slot = format!("memory->{}m{}", letter(section), i.a);
            return Some(format!("copy({d}, {slot}, {});", words(plan, section)));
        }
        (Form::Write, Some(section)) => {
            let value = operand(plan, program, op.operands()[0], i.a)?;
            let (letter, team) = (letter(section), function.team.unwrap_or_default());
            return keeps(section)
                .then(|| format!("write_{letter}_in_team_{team}(memory, {value});"));
        }
        (Form::WriteCells, _) => {
            let all = "write_cells(indexed, (const float[8]){ s0, s1, s2, s3, s4, s5, s6, s7 });";
            return (!plan.cells.is_empty()).then(|| all.to_owned());
        }
        (Form::Reload, _) => return Some(reload(plan, program, i, &d)),
        _ => {}
    }
    let operands = op.operands().into_iter().zip([i.a, i.b]);
    let mut arguments: Vec<String> = operands
        .filter_map(|(kind, at)| operand(plan, program, kind, at))
        .collect();
    let returned = match op.destination() {
        Destination::SUpdate => {
            arguments.insert(0, d.clone());
            true
        }
        Destination::S => true,
        Destination::V | Destination::M | Destination::None => {
            arguments.insert(0, d.clone());
            false
        }
    };
    let arguments = arguments.join(", ");
    let call = match (op.form(), external(op)) {
        (Form::Move, _) => arguments,
        (_, Some(function)) => format!("{function}({arguments})"),
        _ => format!("op_{}({arguments})", identifier(op)),
    };
    Some(if returned {
        format!("{d} = {call};")
    } else {
        format!("{call};")
    })
}

fn reload(plan: &Plan<'_>, program: &Program, i: &Instruction, d: &str) -> String {
    let (section, number) = match plan.locate(program, i.d) {
        Location::Vector(k, _) => (Section::Vector, k),
        Location::Matrix(k, _) => (Section::Matrix, k),
        Location::Scalar(k) | Location::Window(k) => (Section::Scalar, k),
    };
    let registers = plan.registers(program).into_iter();
    let mut same = registers.filter(|(kind, k, _)| (*kind, *k) == (section, number));
    let values = same.next().map(|(_, _, values)| values).unwrap_or_default();
    match section {
        Section::Scalar => format!("{d} = {};", list(&values).trim_matches(['{', '}', ' '])),
        _ => format!(
            "{{ static const float c[{}] = {}; copy({d}, c, {}); }}",
            values.len(),
            list(&values),
            words(plan, section)
        ),
    }
}

/// Writes a function for an operation on vectors or matrices, under its mnemonic.
pub(super) fn write_helper(out: &mut String, op: Op) -> fmt::Result {
    let name = identifier(op);
    let [a, b] = op.operands();
    // Functions of the whole operands are written by hand; scalar ones too.
    let size = match (op.destination(), a) {
        (Destination::M, _) | (Destination::S, Operand::M) => "W * W",
        _ => "W",
    };
    let f = format!("op_{}", op.function());
    let each = |value: &str| format!("for (int k = 0; k < {size}; k++) d[k] = {value};");
    let square = |value: &str| {
        format!(
            "for (int r = 0; r < W; r++) {{\n        for (int c = 0; c < W; c++) d[r * W + c] = {value};\n    }}"
        )
    };
    let body = match op.form() {
        Form::Each if b == Operand::None => each(&format!("{f}(a[k])")),
        Form::Each => each(&format!("{f}(a[k], b[k])")),
        Form::Scale => each(&format!("{f}(a, b[k])")),
        Form::Outer => square(&format!("{f}(a[r], b[c])")),
        Form::Reduce => format!("return {f}(a, {size});"),
        Form::Rows => format!("for (int r = 0; r < W; r++) d[r] = {f}(a + r * W, W);"),
        Form::Fill => each("a"),
        Form::FillRows => square("a[c]"),
        Form::FillColumns => square("a[r]"),
        _ => return Ok(()),
    };
    let kind = |operand| {
        if operand == Operand::S {
            "float "
        } else {
            "const float *"
        }
    };
    let second = if b == Operand::None {
        String::new()
    } else {
        format!(", {}b", kind(b))
    };
    let (returns, first) = if op.form() == Form::Reduce {
        ("float", "")
    } else {
        ("void", "float *d, ")
    };
    writeln!(
        out,
        "\nstatic inline {returns} op_{name}({first}{}a{second})\n{{\n    {body}\n}}",
        kind(a)
    )
}
