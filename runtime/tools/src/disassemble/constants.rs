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
        let gains = used.gains(&constant);
        match gains {
            Some((rows, offset)) => used.write_gains(out, &name, &constant, rows, offset, names)?,
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
        let ends = [Some((0, 0)), self.action()].into_iter().flatten();
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

    /// The register that holds a continuous action.
    fn action(&self) -> Option<Register> {
        let continuous = self.policy.header().action_kind != ActionKind::Discrete;
        let atomic = matches!(self.program.target, Target::Atomic(_));
        let output = (continuous && atomic).then_some(self.program.output);
        output.and_then(|at| self.register(at))
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

    /// For a constant that nothing but products with the observation reads: the rows of it that matter, and the element of the
    /// observation with which its columns begin.
    fn gains(&self, constant: &Constant) -> Option<(usize, usize)> {
        if constant.written || constant.section == Section::Scalar {
            return None;
        }
        let register = (constant.section as u8, constant.number);
        let is_it = |at: u16| self.register(at) == Some(register);
        let reads = |i: &&Instruction| {
            let operands = i.op.operands().into_iter().zip([i.a, i.b]);
            operands
                .into_iter()
                .any(|(kind, at)| kind.is_value() && is_it(at))
        };
        let mut readers = self.code.iter().filter(reads);
        let (reader, None) = (readers.next()?, readers.next()) else {
            return None;
        };
        let observed = match reader.op {
            Op::MatVec | Op::Dot if is_it(reader.a) => reader.b,
            Op::Dot => reader.a,
            _ => return None,
        };
        let window = usize::from(self.policy.header().window);
        let inputs = usize::from(self.policy.header().observation_len);
        let offset = usize::from(observed);
        let rows = match reader.op {
            Op::Dot => 1,
            _ => self.rows_that_matter(reader.d),
        };
        (offset < window && self.action() != Some(register)).then(|| (rows, offset % inputs))
    }

    /// How many elements of a vector anything reads: those of the action, where that is all that it is for.
    fn rows_that_matter(&self, at: u16) -> usize {
        let vector = self.register(at);
        // Sums with other vectors keep each row by itself.
        let by_row = [Op::VAdd, Op::VSub, Op::VMul, Op::VDiv, Op::VMin, Op::VMax];
        let others = self.code.iter().any(|i| {
            let operands = i.op.operands().into_iter().zip([i.a, i.b]);
            let mut read =
                operands.filter(|(kind, at)| kind.is_value() && self.register(*at) == vector);
            read.next().is_some() && !(by_row.contains(&i.op) && self.register(i.d) == vector)
        });
        match vector == self.action() && !others {
            true => self.policy.header().actions.into(),
            false => self.width,
        }
    }

    /// A table: a row for each input, a column for each row of the matrix.
    fn write_gains(
        &self,
        out: &mut String,
        name: &str,
        constant: &Constant,
        rows: usize,
        offset: usize,
        names: &Names<'_>,
    ) -> fmt::Result {
        let heads: Vec<String> = match (constant.section, rows == self.width) {
            (Section::Matrix, false) => (self.policy.outputs().take(rows))
                .map(|(name, _)| name.to_owned())
                .collect(),
            (Section::Matrix, true) => (0..rows).map(|k| format!("row {k}")).collect(),
            _ => vec![String::new()],
        };
        let wide = |row: usize| {
            heads
                .get(row)
                .map_or(0, |head| head.chars().count())
                .max(10)
        };
        let inputs = usize::from(self.policy.header().observation_len);
        let label = |k: usize| names.input((offset + k) % inputs);
        let longest = (0..self.width).map(|k| label(k).chars().count()).max();
        let longest = longest.unwrap_or(0);
        let mut head = format!("  {name:<width$}", width = longest + 2);
        for (row, name) in heads.iter().enumerate() {
            write!(head, "  {name:>width$}", width = wide(row))?;
        }
        writeln!(out, "{}", head.trim_end())?;
        for column in 0..self.width {
            write!(out, "    {:<longest$}", label(column))?;
            for row in 0..rows {
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
            ["0", "0", "1.000", "-0.01235", "1234", "9.999e4", "1.000e-7"]
        );
    }
}
