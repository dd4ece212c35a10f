//! Names for a program's state offsets.

use std::collections::BTreeSet;

use tpg_runtime::Policy;
use tpg_runtime::isa::{CellName, Destination, Operand};
use tpg_runtime::registers::RegisterMap;
use tpg_runtime::tables::{Instruction, Program, Section};

/// Names the operands of one program's instructions.
pub(super) struct Names<'p> {
    policy: &'p Policy<'p>,
    width: usize,
    inputs: usize,
    /// Elements of all observations in the window.
    observed: usize,
    window: usize,
    /// State offsets of the first scalar, vector and matrix.
    starts: [usize; 3],
}

impl<'p> Names<'p> {
    pub(super) fn new(policy: &'p Policy<'p>, program: &Program) -> Self {
        let header = policy.header();
        let width = usize::from(header.width);
        let registers = RegisterMap::of(header, program);
        Names {
            policy,
            width,
            inputs: usize::from(header.observation_len),
            observed: header.observed(),
            window: usize::from(header.window),
            starts: Section::ALL.map(|kind| registers.first_word(kind, 0)),
        }
    }

    pub(super) fn destination(&self, kind: Destination, at: u16) -> String {
        let at = usize::from(at);
        match kind {
            Destination::None => String::new(),
            Destination::S | Destination::SUpdate => self.scalar(at),
            Destination::V | Destination::VUpdate => self.vector(at),
            Destination::M | Destination::MUpdate => self.matrix(at),
        }
    }

    pub(super) fn operand(&self, kind: Operand, field: u16) -> String {
        let at = usize::from(field);
        let [_, vectors, matrices] = self.starts;
        match kind {
            Operand::None => String::new(),
            Operand::VectorIndex | Operand::MatrixIndex => at.to_string(),
            Operand::ScalarSlot => format!("sm{at}"),
            Operand::VectorSlot => format!("vm{at}"),
            Operand::MatrixSlot => format!("mm{at}"),
            Operand::Cell => self.cell(at),
            Operand::V | Operand::M if at < self.window => match at % self.observed {
                0 => "obs".to_owned(),
                first => format!("obs({first})"),
            },
            _ if at < self.window => self.input(at % self.observed),
            Operand::S => self.scalar(at),
            Operand::SOrVElement if at < vectors => self.scalar(at),
            Operand::V => self.vector(at),
            Operand::M => self.matrix(at),
            Operand::VElement | Operand::SOrVElement => element('v', at - vectors, self.width),
            Operand::MElement => element('m', at - matrices, self.width * self.width),
        }
    }

    /// An element of the last observations: the input's name, where that is a word that cannot be taken for anything else, and
    /// how many decisions ago it was seen.
    pub(super) fn input(&self, element: usize) -> String {
        let (ago, number) = (element / self.inputs, element % self.inputs);
        let name = self.newest(number);
        match ago {
            0 => name,
            ago => format!("{name}[-{ago}]"),
        }
    }

    fn newest(&self, number: usize) -> String {
        let (name, _) = self.policy.inputs().nth(number).unwrap_or_default();
        let is_word = name.starts_with(|c: char| c.is_alphabetic())
            && name.chars().all(|c| c.is_alphanumeric() || c == '_');
        let digits = name.trim_start_matches(|c: char| c.is_alphabetic());
        let is_short = digits.chars().all(|c| c.is_ascii_digit()) && name.len() - digits.len() < 3;
        match is_word && !is_short {
            true => name.to_owned(),
            false => format!("obs[{number}]"),
        }
    }

    fn scalar(&self, at: usize) -> String {
        format!("s{}", at - self.starts[0])
    }

    fn vector(&self, at: usize) -> String {
        format!("v{}", (at - self.starts[1]) / self.width)
    }

    fn matrix(&self, at: usize) -> String {
        format!("m{}", (at - self.starts[2]) / (self.width * self.width))
    }

    /// Kept cells lie at the end of the state.
    fn cell(&self, at: usize) -> String {
        let cells = self.policy.tables().cells;
        let start = self.policy.header().words as usize - cells.len();
        CellName(u16::from_le_bytes(cells[at - start])).to_string()
    }
}

fn element(kind: char, offset: usize, len: usize) -> String {
    format!("{kind}{}[{}]", offset / len, offset % len)
}

/// The number and name of an output that has its own programs.
pub(super) fn output_name(policy: &Policy<'_>, output: u16) -> String {
    let label = policy.outputs().nth(output.into());
    let (name, _) = label.unwrap_or_default();
    format!("output {output} ({name})")
}

/// Names of the inputs that an instruction or the front end's model reads, in the order of the observation. Inputs
/// with a scale of 0 are left out, because the policy cannot perceive them.
#[must_use]
pub fn inputs_used(policy: &Policy<'_>, code: &[[u8; Instruction::BYTES]]) -> Vec<String> {
    let header = policy.header();
    let (inputs, window) = (
        usize::from(header.observation_len),
        usize::from(header.window),
    );
    let (width, observed) = (usize::from(header.width), header.observed());
    let mut used = BTreeSet::new();
    for instruction in code.iter().filter_map(Instruction::from_bytes) {
        let operands = instruction.op.operands();
        for (kind, at) in operands.into_iter().zip([instruction.a, instruction.b]) {
            let len = match kind {
                Operand::S | Operand::VElement | Operand::MElement | Operand::SOrVElement => 1,
                Operand::V => width,
                Operand::M => width * width,
                _ => continue,
            };
            let at = usize::from(at);
            if at < window {
                used.extend((at..at + len).map(|k| k % observed % inputs));
            }
        }
    }
    if let Some(front_end) = policy.front_end() {
        let columns = front_end.columns.iter();
        used.extend(columns.map(|c| usize::from(u16::from_le_bytes(*c))));
        used.retain(|k| f32::from_le_bytes(front_end.scales[*k]).abs() > 0.0);
    }
    policy
        .inputs()
        .enumerate()
        .filter(|(k, _)| used.contains(k))
        .map(|(_, (name, _))| name.to_owned())
        .collect()
}
