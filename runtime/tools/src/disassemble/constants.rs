//! A program's constants, and what each of them is multiplied with.

use std::collections::BTreeSet;
use std::fmt::{self, Write as _};

use tpg_runtime::Policy;
use tpg_runtime::blob::{ActionKind, InitialValues};
use tpg_runtime::isa::{Op, Section};
use tpg_runtime::registers::{Location, RegisterMap};
use tpg_runtime::tables::{Instruction, Program, Target};

use super::names::Names;

/// A register, by its kind and number.
type Register = (u8, usize);

/// A register whose value after a reset can matter.
struct Constant {
    section: Section,
    number: usize,
    values: Vec<f32>,
    /// Whether the program overwrites it at some time.
    written: bool,
}

/// How a constant is multiplied with the observation.
struct Gains {
    rows: Rows,
    /// Number of the input with which its columns begin.
    offset: usize,
}

/// Which rows of a matrix matter.
enum Rows {
    /// It is a vector.
    One,
    /// Those that give the outputs from this one on.
    Outputs(usize),
    All,
}

/// What a program does with its registers.
struct Use<'p> {
    policy: &'p Policy<'p>,
    program: Program,
    map: RegisterMap,
    code: Vec<Instruction>,
    width: usize,
}

/// Writes each constant of a program on a line, or as a table of gains where it is multiplied with the observation.
pub(super) fn write(
    out: &mut String,
    policy: &Policy<'_>,
    program: &Program,
    names: &Names<'_>,
) -> fmt::Result {
    let code = policy.tables().code(program).iter();
    let used = Use {
        policy,
        program: *program,
        map: RegisterMap::of(policy.header(), program),
        code: code.filter_map(Instruction::from_bytes).collect(),
        width: usize::from(policy.header().width),
    };
    for constant in used.constants() {
        let letter = ["s", "v", "m"][constant.section as usize];
        let name = format!("{letter}{}", constant.number);
        match used.gains(&constant) {
            Some(gains) => used.write_gains(out, &name, &constant, &gains, names)?,
            None => used.write_values(out, &name, &constant)?,
        }
    }
    Ok(())
}

impl Use<'_> {
    /// Registers that an instruction, the bid or the action may read before the program has written all of them.
    fn constants(&self) -> Vec<Constant> {
        let (mut written, mut open): (BTreeSet<Register>, BTreeSet<Register>) = Default::default();
        let mut kept: BTreeSet<Register> = BTreeSet::new();
        for instruction in &self.code {
            let op = instruction.op;
            if op == Op::MemWrite {
                // It writes every scalar register to memory.
                open.extend((0..self.program.registers[0].into()).map(|k| (0, k)));
            }
            for (kind, at) in op
                .operands()
                .into_iter()
                .zip([instruction.a, instruction.b])
            {
                if kind.is_value() {
                    open.extend(self.register(at).filter(|r| !written.contains(r)));
                }
            }
            if op.destination().section().is_some()
                && let Some(register) = self.register(instruction.d)
            {
                if op.destination().is_update() && !written.contains(&register) {
                    open.insert(register);
                } else {
                    written.insert(register);
                }
                kept.insert(register);
            }
        }
        let ends = self.action().into_iter().chain([(0, 0)]);
        open.extend(ends.filter(|register| !written.contains(register)));
        let constants = open.into_iter().filter_map(|(section, number)| {
            let section = Section::ALL[usize::from(section)];
            let count = self.program.registers[section as usize];
            (number < count.into()).then(|| Constant {
                section,
                number,
                values: self.values(section, number),
                written: kept.contains(&(section as u8, number)),
            })
        });
        constants.collect()
    }

    /// The registers that hold a continuous action: several, where it has more values than a vector has elements.
    fn action(&self) -> Vec<Register> {
        let header = self.policy.header();
        let atomic = matches!(self.program.target, Target::Atomic(_));
        let registers = match header.action_kind {
            _ if !atomic => 0,
            ActionKind::Discrete => 0,
            ActionKind::Continuous => usize::from(header.actions).div_ceil(self.width),
            _ => 1,
        };
        let places = (0..registers).map(|k| usize::from(self.program.output) + k * self.width);
        places
            .filter_map(|at| self.register(u16::try_from(at).ok()?))
            .collect()
    }

    fn register(&self, at: u16) -> Option<Register> {
        match self.map.locate(at.into())? {
            Location::Window(_) => None,
            Location::Scalar(number) => Some((Section::Scalar as u8, number)),
            Location::Vector(number, _) => Some((Section::Vector as u8, number)),
            Location::Matrix(number, _) => Some((Section::Matrix as u8, number)),
        }
    }

    /// What a register holds after a reset.
    fn values(&self, section: Section, number: usize) -> Vec<f32> {
        let len = section.slot_words(self.width);
        if self.policy.header().initial_values == InitialValues::Zero {
            return vec![0.0; len];
        }
        let first = self.map.first_word(section, number) - usize::from(self.program.state_start);
        let table = self.policy.tables().constants.iter();
        let own = table.skip(self.program.constants_start as usize + first);
        own.take(len).map(|x| f32::from_le_bytes(*x)).collect()
    }

    /// What to write of a constant that nothing but a product with the observation reads.
    fn gains(&self, constant: &Constant) -> Option<Gains> {
        if constant.written || constant.section == Section::Scalar {
            return None;
        }
        let register = (constant.section as u8, constant.number);
        let is_it = |at: u16| self.register(at) == Some(register);
        let mut readers = self.code.iter().filter(|i| self.reads(i, Some(register)));
        let (reader, None) = (readers.next()?, readers.next()) else {
            return None;
        };
        let operand = match reader.op {
            Op::MatVec | Op::Dot if is_it(reader.a) => reader.b,
            Op::Dot => reader.a,
            _ => return None,
        };
        let header = self.policy.header();
        let (window, observed) = (usize::from(header.window), header.observed());
        let offset = usize::from(operand);
        if offset >= window || self.action().contains(&register) {
            return None;
        }
        let rows = match reader.op {
            Op::Dot => Rows::One,
            _ => self.rows(reader.d),
        };
        Some(Gains {
            rows,
            offset: offset % observed,
        })
    }

    fn reads(&self, instruction: &Instruction, register: Option<Register>) -> bool {
        let operands = instruction.op.operands().into_iter();
        let mut fields = operands.zip([instruction.a, instruction.b]);
        fields.any(|(kind, at)| kind.is_value() && self.register(at) == register)
    }

    /// Which elements of a vector anything reads: those of the action, where that is all that it is for.
    fn rows(&self, at: u16) -> Rows {
        let vector = self.register(at);
        // Sums with other vectors keep each row by itself.
        let by_row = [Op::VAdd, Op::VSub, Op::VMul, Op::VDiv, Op::VMin, Op::VMax];
        let mixes = |i: &Instruction| {
            self.reads(i, vector) && !(by_row.contains(&i.op) && self.register(i.d) == vector)
        };
        let place = (self.action().iter()).position(|register| Some(*register) == vector);
        match place {
            Some(place) if !self.code.iter().any(mixes) => Rows::Outputs(place * self.width),
            _ => Rows::All,
        }
    }

    /// A table: a row for each input, a column for each row of the matrix.
    fn write_gains(
        &self,
        out: &mut String,
        name: &str,
        constant: &Constant,
        gains: &Gains,
        names: &Names<'_>,
    ) -> fmt::Result {
        let heads: Vec<String> = match gains.rows {
            Rows::One => vec![String::new()],
            Rows::Outputs(first) => (self.policy.outputs().skip(first).take(self.width))
                .map(|(name, _)| name.to_owned())
                .collect(),
            Rows::All => (0..self.width).map(|k| format!("row {k}")).collect(),
        };
        let wide = |row: usize| {
            heads
                .get(row)
                .map_or(0, |head| head.chars().count())
                .max(10)
        };
        let observed = self.policy.header().observed();
        let label = |k: usize| names.input((gains.offset + k) % observed);
        let longest = (0..self.width).map(|k| label(k).chars().count()).max();
        let longest = longest.unwrap_or(0);
        let mut head = format!("  {name:<width$}", width = longest + 2);
        for (row, name) in heads.iter().enumerate() {
            write!(head, "  {name:>width$}", width = wide(row))?;
        }
        writeln!(out, "{}", head.trim_end())?;
        for column in 0..self.width {
            write!(out, "    {:<longest$}", label(column))?;
            for row in 0..heads.len() {
                let value = constant.values.get(row * self.width + column);
                let value = number(value.copied().unwrap_or(0.0));
                write!(out, "  {value:>width$}", width = wide(row))?;
            }
            writeln!(out)?;
        }
        Ok(())
    }

    fn write_values(&self, out: &mut String, name: &str, constant: &Constant) -> fmt::Result {
        let begins = if constant.written { " at reset" } else { "" };
        let values = &constant.values;
        match constant.section {
            _ if values.iter().all(|x| x.to_bits() == 0) => writeln!(out, "  {name} = 0{begins}"),
            Section::Scalar => writeln!(out, "  {name} = {}{begins}", list(values)),
            Section::Vector => writeln!(out, "  {name} = ({}){begins}", list(values)),
            Section::Matrix => {
                writeln!(out, "  {name} ={begins}")?;
                let rows = values.chunks(self.width);
                rows.map(list)
                    .try_for_each(|row| writeln!(out, "    ({row})"))
            }
        }
    }
}

/// Numbers in a row.
pub(super) fn list(values: &[f32]) -> String {
    let texts: Vec<String> = values.iter().copied().map(number).collect();
    texts.join(", ")
}

/// Four digits, which is enough to read; exported source code has all of them.
fn number(value: f32) -> String {
    let size = value.abs();
    match size {
        _ if value.to_bits() << 1 == 0 => "0".into(),
        _ if (1e-3..1e4).contains(&size) => {
            let digits = (3.0 - size.log10().floor()).max(0.0) as usize;
            format!("{value:.digits$}")
        }
        _ => format!("{value:.3e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn numbers_have_four_digits() {
        let texts = [0.0, -0.0, 1.0, -0.012_345_6, 1234.5, 99_999.0, 1e-7].map(number);
        assert_eq!(
            texts,
            ["0", "0", "1.000", "-0.01235", "1234", "1.000e5", "1.000e-7"]
        );
    }
}
