//! What operations cost on a board, and a bound on a decision from it.
//!
//! For each operation of a policy, two small policies with many and with more copies of it are run on the emulated board.
//! Their longest decisions differ by what the copies take. The operands are pairs of ordinary and of extreme numbers.

use std::collections::BTreeMap;

use serde::Serialize;
use tpg_runtime::Policy;
use tpg_runtime::blob::{
    EncodeError, Header, InitialValues, MemoryModel, ResetScope, encode, encoded_bound,
};
use tpg_runtime::isa::{Destination, Extent, Form, Op, Operand};
use tpg_runtime::tables::{Instruction, Program, Tables, Target, Team};

use crate::worst_path::{worst_path, worst_path_without_code};

/// What one execution of an operation takes at most, by the operands that were tried.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OperationCost {
    /// The operation's short name.
    pub operation: &'static str,
    /// How many instructions of the policy are of it.
    pub count: usize,
    /// Machine instructions of one execution.
    pub machine_instructions: f64,
}

/// A bound on the machine instructions of one decision, and what it consists of.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Costs {
    /// Each operation that the policy has, in the order of their codes.
    pub operations: Vec<OperationCost>,
    /// Machine instructions of a decision besides its operations: the way through all teams, the front end, the action.
    pub rest: f64,
    /// Machine instructions to go from scalar operations to others and back, or to begin a program.
    pub turn: f64,
    /// How many such turns the policy's programs have together.
    pub turns: usize,
    /// The sum: no decision should take more machine instructions. Measured, not proven.
    pub machine_instructions_bound: u64,
    /// Most machine instructions of a decision that was made to run all programs of the policy.
    pub machine_instructions_worst_path: u64,
    /// Most machine instructions of a decision of the policy, with the same observations.
    pub machine_instructions_seen: u64,
}

/// The policies to run on a board, and what their counts mean.
pub(super) struct Trial {
    /// The policies, in the order in which the board counts them.
    pub policies: Vec<Vec<u8>>,
    operations: BTreeMap<Op, usize>,
    turns: usize,
}

/// An operation that is in every build and one that ends a stretch of scalar ones.
const TURN: [Op; 2] = [Op::Add, Op::VAdd];

impl Trial {
    /// Makes the policies to try for `policy`, whose file is `itself`.
    pub fn new(itself: &[u8], policy: &Policy<'_>) -> Result<Self, EncodeError> {
        let mut operations: BTreeMap<Op, usize> = BTreeMap::new();
        let mut turns = 0;
        for bytes in policy.tables().programs {
            let program = Program::from_bytes(bytes);
            let code = policy.tables().code(&program);
            let ops = code
                .iter()
                .filter_map(Instruction::from_bytes)
                .map(|i| i.op);
            let mut scalar = true;
            // A program that begins with no scalar operation turns at once.
            turns += 1;
            for op in ops {
                *operations.entry(op).or_default() += 1;
                turns += usize::from(scalar && !is_scalar(op));
                scalar = is_scalar(op);
            }
        }
        let header = policy.header();
        let cells = policy.tables().cells.len();
        let mut policies = vec![
            itself.to_vec(),
            worst_path(policy)?,
            worst_path_without_code(policy)?,
        ];
        for mix in Self::mixes(&operations) {
            for copies in copies(&mix) {
                policies.push(straight(&mix, copies, header, cells)?);
            }
        }
        Ok(Trial {
            policies,
            operations,
            turns,
        })
    }

    /// The operations whose copies are counted: the turn, its two halves, then those of the policy.
    fn mixes(operations: &BTreeMap<Op, usize>) -> Vec<Vec<Op>> {
        let mut mixes = vec![TURN.to_vec(), vec![TURN[0]], vec![TURN[1]]];
        mixes.extend(operations.keys().map(|op| vec![*op]));
        mixes
    }

    /// The bound from the most machine instructions that each of the policies took. `None` if there are too few counts.
    pub fn bound(&self, most: &[u64]) -> Option<Costs> {
        let [seen, worst_path, rest, most @ ..] = most else {
            return None;
        };
        let mixes = Self::mixes(&self.operations);
        let (pairs, []) = most.as_chunks::<2>() else {
            return None;
        };
        if pairs.len() != mixes.len() {
            return None;
        }
        let each: Vec<f64> = (mixes.iter().zip(pairs))
            .map(|(mix, [few, many])| {
                let [less, more] = copies(mix);
                many.saturating_sub(*few) as f64 / (more - less) as f64
            })
            .collect();
        let [both, one, other, each @ ..] = each.as_slice() else {
            return None;
        };
        let turn = (both - one - other).max(0.0);
        let operations: Vec<OperationCost> = (self.operations.iter().zip(each))
            .map(|((op, count), cost)| OperationCost {
                operation: op.mnemonic(),
                count: *count,
                machine_instructions: *cost,
            })
            .collect();
        let code: f64 = (operations.iter())
            .map(|o| o.count as f64 * o.machine_instructions)
            .sum();
        let rest = *rest as f64;
        let bound = rest + code + turn * self.turns as f64;
        Some(Costs {
            operations,
            rest,
            turn,
            turns: self.turns,
            machine_instructions_bound: bound.ceil() as u64,
            machine_instructions_worst_path: *worst_path,
            machine_instructions_seen: *seen,
        })
    }
}

/// Whether the operation is executed in the loop over scalar operations.
fn is_scalar(op: Op) -> bool {
    matches!(op.form(), Form::Scalar | Form::Classic | Form::Move)
}

/// Two numbers of copies: enough to tell the cost from the counter's steps, not so many that trying takes long.
fn copies(mix: &[Op]) -> [usize; 2] {
    match mix {
        [op] => match op.cost().extent {
            Extent::One => [8, 24],
            Extent::Width => [4, 8],
            Extent::Cells => [2, 4],
            Extent::Square | Extent::Cube => [1, 2],
        },
        _ => [4, 8],
    }
}

/// A policy with one program: the operations of `mix` in turn, so many times, with operands from the observation. The
/// first half of the observation is the first operand, the second half the other.
fn straight(
    mix: &[Op],
    copies: usize,
    like: &Header,
    cells: usize,
) -> Result<Vec<u8>, EncodeError> {
    let width = usize::from(like.width);
    let half = width * width;
    let section = mix.iter().find_map(|op| op.section());
    let indexed = mix
        .iter()
        .any(|op| matches!(op, Op::MemRead | Op::MemWrite));
    let mut header = Header::default();
    header.width = like.width;
    header.observation_len = 2 * half as u16;
    header.window = header.observation_len;
    header.actions = 2;
    header.initial_values = InitialValues::Evolved;
    header.write_distribution = like.write_distribution;
    header.reset_scope = ResetScope::EveryDecision;
    let mut program = Program::default();
    program.registers = [8, 2, 1];
    program.state_start = header.registers_start() as u16;
    program.output = program.state_start;
    program.target = Target::Atomic(0);
    let registers = program.register_words(width);
    let mut team = Team::default();
    team.members_len = 1;
    team.memory_start = program.state_start + registers as u16;
    team.constants_start = registers as u32;
    if let Some(section) = section {
        header.memory_model = MemoryModel::Team;
        // Every write has an effect.
        team.slots[section as usize] = u8::MAX;
    }
    if indexed {
        header.memory_model = MemoryModel::Indexed;
    }
    if header.memory_model != MemoryModel::None {
        header.reset_scope = ResetScope::PerEpisode;
    }
    let memory = team.memory_words(width);
    let cells = if indexed { cells.max(1) } else { 0 };
    let scalar = program.state_start + 1;
    let vector = program.state_start + 8;
    let matrix = vector + 2 * width as u16;
    let first_cell = team.memory_start + memory as u16;
    let place = |kind: Operand, at: usize| match kind {
        Operand::Cell => first_cell,
        kind if kind.is_value() => at as u16,
        _ => 0,
    };
    let instruction = |op: &Op| {
        let [a, b] = op.operands();
        Instruction {
            op: *op,
            d: match op.destination() {
                Destination::None => 0,
                Destination::S | Destination::SUpdate => scalar,
                Destination::V | Destination::VUpdate => vector,
                Destination::M | Destination::MUpdate => matrix,
            },
            a: place(a, 0),
            b: place(b, half),
        }
        .to_bytes()
    };
    let code: Vec<_> = (0..copies)
        .flat_map(|_| mix.iter().map(instruction))
        .collect();
    program.code_len = code.len() as u16;
    header.words = u32::from(first_cell) + cells as u32;
    (header.programs, header.teams) = (1, 1);
    header.streams = team.streams() as u16;
    header.groups = mix.iter().fold(0, |groups, op| groups | op.group().bit());
    let constants = vec![[0; 4]; registers + memory];
    let cells: Vec<[u8; 2]> = (0..cells as u16).map(u16::to_le_bytes).collect();
    let labels = "x\t1\n".repeat(2 * half);
    let (teams, programs) = ([team.to_bytes()], [program.to_bytes()]);
    let mut tables = Tables::default();
    tables.teams = &teams;
    tables.members = &[[0, 0]];
    tables.programs = &programs;
    tables.code = &code;
    tables.constants = &constants;
    tables.cells = &cells;
    tables.labels = &labels;
    tables.task = "costs-v1";
    tables.observability = "none";
    let mut file = vec![0; encoded_bound(&tables)];
    let len = encode(&header, &tables, &mut file)?;
    file.truncate(len);
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_operation_can_be_tried_at_every_width() {
        for width in [1, 2, 11, 32] {
            let mut like = Header::default();
            like.width = width;
            for op in Op::ALL {
                for copies in copies(&[*op]) {
                    let file = straight(&[*op], copies, &like, 10).expect("encodes");
                    let policy = Policy::load(&file);
                    assert!(policy.is_ok(), "{op:?} of width {width}: {policy:?}");
                }
            }
        }
    }
}
