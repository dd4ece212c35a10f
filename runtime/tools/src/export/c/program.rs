//! Programs as C functions: one line for each instruction.

use std::collections::BTreeMap;

use tpg_runtime::isa::{Destination, Form, Op, Operand};
use tpg_runtime::tables::{Instruction, Section};

use super::super::plan::{Function, Plan};
use super::super::program::{Statement, Value, Variable, WriteProgram};
use super::super::text::{function_name, identifier, letter, target};
use super::super::values::Register;
use tpg_runtime::registers::Location;

/// Writes the programs of a plan in C. Type names begin with `prefix`.
pub(super) struct C<'a, 'p> {
    pub(super) plan: &'a Plan<'p>,
    pub(super) prefix: &'a str,
    /// The registers that last between decisions, by program.
    kept: BTreeMap<u16, Vec<Register>>,
}

impl<'a, 'p> C<'a, 'p> {
    pub(super) fn new(plan: &'a Plan<'p>, prefix: &'a str) -> Self {
        let mut kept = BTreeMap::new();
        for program in plan.stateful_programs() {
            let mut registers = plan.registers(program);
            // A register that is never written is a constant. One that is never read need not be kept.
            registers.retain(|register| register.written && register.read);
            if !registers.is_empty() {
                kept.insert(program, registers);
            }
        }
        C { plan, prefix, kept }
    }

    /// The programs that have registers to keep, with these registers.
    pub(super) fn kept(&self) -> &BTreeMap<u16, Vec<Register>> {
        &self.kept
    }

    fn keeps(&self, program: u16, section: Section, number: usize) -> bool {
        let mut kept = self.kept.get(&program).into_iter().flatten();
        kept.any(|register| register.section == section && register.number == number)
    }

    /// The arguments that a team passes to the function.
    pub(super) fn arguments(&self, function: Function) -> Vec<String> {
        let mut arguments = vec!["x".to_owned()];
        if self.kept.contains_key(&function.program) {
            arguments.push(format!("&self->program_{}", function.program));
        }
        if let Some(team) = function.team {
            arguments.push(format!("&self->team_{team}"));
        }
        if self.plan.uses_cells(function.program) {
            arguments.push("&self->indexed".to_owned());
        }
        if self.plan.acts(function.program) {
            arguments.push(format!("output_{}", function.program));
        }
        arguments
    }

    /// A register of more than one word. A kept register is used in place.
    fn whole(&self, program: u16, section: Section, number: usize) -> String {
        let kept = self.keeps(program, section, number);
        let owner = if kept { "r->" } else { "" };
        format!("{owner}{}{number}", letter(section))
    }

    fn scalar(&self, program: u16, at: Location) -> String {
        match at {
            Location::Window(k) => format!("x[{k}]"),
            Location::Scalar(k) => format!("s{k}"),
            Location::Vector(v, k) => format!("{}[{k}]", self.whole(program, Section::Vector, v)),
            Location::Matrix(m, k) => format!("{}[{k}]", self.whole(program, Section::Matrix, m)),
        }
    }

    fn variable(&self, program: u16, variable: Variable) -> String {
        match variable {
            Variable::Vector(Location::Window(k)) | Variable::Matrix(Location::Window(k)) => {
                format!("x + {k}")
            }
            Variable::Vector(Location::Vector(k, _)) => self.whole(program, Section::Vector, k),
            Variable::Matrix(Location::Matrix(k, _)) => self.whole(program, Section::Matrix, k),
            Variable::Scalar(at) | Variable::Vector(at) | Variable::Matrix(at) => {
                self.scalar(program, at)
            }
        }
    }
}

impl WriteProgram for C<'_, '_> {
    fn head(&self, function: Function) -> String {
        let (plan, prefix, program) = (self.plan, self.prefix, function.program);
        let mut parameters = vec!["const float *TPG_RESTRICT x".to_owned()];
        if self.kept.contains_key(&program) {
            parameters.push(format!("{prefix}_registers_{program} *TPG_RESTRICT r"));
        }
        if let Some(team) = function.team {
            parameters.push(format!("{prefix}_memory_{team} *TPG_RESTRICT memory"));
        }
        if plan.uses_cells(program) {
            parameters.push(format!("{prefix}_indexed *TPG_RESTRICT indexed"));
        }
        if plan.acts(program) {
            parameters.push("float *TPG_RESTRICT output".to_owned());
        }
        format!(
            "/* Program {program} -> {}. */\nstatic float {}({})\n{{\n    (void)x;\n",
            target(plan, program),
            function_name(function),
            parameters.join(", ")
        )
    }

    fn declaration(&self, function: Function, register: &Register) -> String {
        let Register {
            section,
            number,
            values,
            ..
        } = register;
        let kept = self.keeps(function.program, *section, *number);
        let name = format!("{}{number}", letter(*section));
        match (section, kept) {
            (Section::Scalar, true) => format!("    float {name} = r->{name};\n"),
            (_, true) => String::new(),
            (Section::Scalar, false) => {
                let constant = if register.written { "" } else { "const " };
                format!("    {constant}float {name} = {};\n", number_text(values[0]))
            }
            (_, false) => {
                let constant = if register.written {
                    ""
                } else {
                    "static const "
                };
                let (n, values) = (values.len(), list(values));
                format!("    {constant}float {name}[{n}] = {values};\n")
            }
        }
    }

    fn statement(&self, function: Function, i: &Instruction, statement: &Statement) -> String {
        let program = function.program;
        let (register, value) = match statement {
            Statement::WriteSlot(section, value) => {
                let value = self.variable(program, *value);
                let (letter, team) = (letter(*section), function.team.unwrap_or_default());
                return format!("write_{letter}_in_team_{team}(memory, {value});");
            }
            Statement::WriteCells => {
                return "{ const float all[8] = { s0, s1, s2, s3, s4, s5, s6, s7 }; write_cells(indexed, all); }".to_owned();
            }
            Statement::Set(register, value) => (*register, value),
        };
        let d = self.variable(program, register);
        let size = match register {
            Variable::Scalar(_) => None,
            Variable::Vector(_) => Some("W"),
            Variable::Matrix(_) => Some("W * W"),
        };
        match (value, size) {
            (Value::Cell(cell), _) => format!("{d} = indexed->cells[{cell}];"),
            (Value::SlotElement(section, slot, at), _) => {
                let element = match section {
                    Section::Scalar => String::new(),
                    _ => format!("[{at}]"),
                };
                format!("{d} = memory->{}m{slot}{element};", letter(*section))
            }
            (Value::Slot(section, slot), size) => {
                let slot = format!("memory->{}m{slot}", letter(*section));
                format!("copy({d}, {slot}, {});", size.unwrap_or("1"))
            }
            (Value::Constants(values), None) => format!("{d} = {};", number_text(values[0])),
            (Value::Constants(values), Some(size)) => format!(
                "{{ static const float c[{}] = {}; copy({d}, c, {size}); }}",
                values.len(),
                list(values)
            ),
            (Value::Copy(variable), _) => format!("{d} = {};", self.variable(program, *variable)),
            (Value::Result(arguments), size) => {
                let arguments = arguments.iter().map(|x| self.variable(program, *x));
                // An operation that reads its destination has it as its first argument already.
                let writes = size.is_some() && !i.op.destination().is_update();
                let place = writes.then(|| d.clone());
                let arguments: Vec<String> = place.into_iter().chain(arguments).collect();
                let call = format!("op_{}({});", identifier(i.op), arguments.join(", "));
                match size {
                    None => format!("{d} = {call}"),
                    Some(_) => call,
                }
            }
        }
    }

    fn keep(&self, function: Function, registers: &[Register]) -> String {
        let scalars = registers.iter().filter(|r| r.section == Section::Scalar);
        let line = |register: &Register| {
            let number = register.number;
            if self.keeps(function.program, Section::Scalar, number) {
                format!("    r->s{number} = s{number};\n")
            } else if register.read {
                String::new()
            } else {
                format!("    (void)s{number};\n")
            }
        };
        scalars.map(line).collect()
    }

    fn end(&self, function: Function, output: Option<Vec<Location>>) -> String {
        let output = output.into_iter().flatten().enumerate();
        let mut text = String::new();
        for (k, at) in output {
            let value = self.scalar(function.program, at);
            text.push_str(&format!("    output[{k}] = {value};\n"));
        }
        text + "    return s0;\n}\n"
    }
}

/// A float in hexadecimal notation. Every compiler reads it back as the same bits.
pub(in crate::export) fn number_text(x: f32) -> String {
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

/// A function for an operation on vectors or matrices, under its mnemonic.
pub(super) fn helper(op: Op) -> Option<String> {
    let name = identifier(op);
    let [a, b] = op.operands();
    // Functions of whole operands and scalar functions are written by hand elsewhere.
    let size = match (op.destination(), a) {
        (Destination::M | Destination::MUpdate, _) | (Destination::S, Operand::M) => "W * W",
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
        Form::Latch => format!("if (a > 0.0f) {{\n        {}\n    }}", each("b[k]")),
        _ => return None,
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
    Some(format!(
        "static inline {returns} op_{name}({first}{}a{second})\n{{\n    {body}\n}}\n",
        kind(a)
    ))
}
