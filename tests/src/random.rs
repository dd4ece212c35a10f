//! Random policies of every kind, wilder than evolution makes them: cycles, shared programs, every operation.

use std::collections::BTreeSet;

use tpg_runtime::blob::{
    ActionKind, InitialValues, MemoryModel, RegisterMode, ResetScope, WriteDistribution,
};
use tpg_runtime::front_end::Fallback;
use tpg_runtime::isa::{Destination, Group, INDEXED_CELLS, Op, Operand};
use tpg_runtime::rng::mix64;
use tpg_runtime::tables::{Instruction, Section, Target, Team, TeamId};

use tpg_runtime::Header;

use crate::draft::{Draft, DraftProgram, DraftTeam, header, instruction};
use crate::front_end::front_end;

/// Draws from a seed, the same everywhere.
#[derive(Debug, Clone)]
pub struct Dice {
    seed: u64,
    draws: u64,
}

impl Dice {
    /// Begins a sequence of draws.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Dice { seed, draws: 0 }
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.draws += 1;
        mix64(&[self.seed, self.draws])
    }

    /// A number below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() >> 32) as usize % n
    }

    /// A number of a range, both ends included.
    pub fn within(&mut self, low: usize, high: usize) -> usize {
        low + self.below(high - low + 1)
    }

    /// One of several things.
    pub fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }

    /// Mostly a number of ordinary size; now and then zero of either sign, subnormal, tiny or huge.
    pub fn number(&mut self) -> f32 {
        match self.below(16) {
            0 => 0.0,
            1 => -0.0,
            2 => f32::from_bits(self.below(0x0080_0000) as u32),
            3 => f32::from_bits(0x7e00_0000 + self.below(0x0180_0000) as u32),
            4 => -f32::MAX,
            5 => 1.0,
            _ => {
                let unit = self.below(1 << 24) as f32 * (1.0 / 8_388_608.0) - 1.0;
                unit * self.pick(&[0.1, 1.0, 1.0, 2.0, 3.0, 30.0])
            }
        }
    }

    /// As [`Dice::number`], or not finite.
    pub fn measurement(&mut self) -> f32 {
        match self.below(12) {
            0 => self.pick(&[f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -f32::NAN]),
            _ => self.number(),
        }
    }
}

/// A random policy.
#[must_use]
pub fn policy(seed: u64) -> Draft {
    finish(seed, 1, |_, _| Vec::new())
}

/// A random policy whose window holds two to five observations, every other one with a random front end.
#[must_use]
pub fn remembering_policy(seed: u64) -> Draft {
    let history = 2 + (seed / 2 % 4) as u16;
    match seed % 2 {
        0 => finish(seed, history, |_, _| Vec::new()),
        _ => finish(seed, history, random_front_end),
    }
}

/// A random policy with a random front end.
#[must_use]
pub fn perceiving_policy(seed: u64) -> Draft {
    finish(seed, 1, random_front_end)
}

/// The section of a random front end, which the header announces.
fn random_front_end(dice: &mut Dice, header: &mut Header) -> Vec<u8> {
    let mut columns: Vec<u16> = (0..header.observation_len)
        .filter(|_| dice.below(3) > 0)
        .collect();
    let fallback = dice.pick(&[
        Fallback::Zero,
        Fallback::Hold,
        Fallback::Model,
        Fallback::Model,
    ]);
    if fallback != Fallback::Model {
        columns.clear();
    } else if columns.is_empty() {
        columns.push(0);
    }
    let degree = columns.first().map_or(0, |_| dice.within(1, 3) as u8);
    front_end(header, fallback, degree, &columns, || dice.number())
}

/// A random policy with the front end that a function makes for its header.
fn finish(
    seed: u64,
    history: u16,
    perceive: impl FnOnce(&mut Dice, &mut Header) -> Vec<u8>,
) -> Draft {
    let mut dice = Dice::new(seed);
    let mut draft = blank(&mut dice, history, perceive);
    for number in 0..draft.programs.len() {
        let allowed: Vec<Op> = Op::ALL
            .iter()
            .copied()
            .filter(|op| is_allowed(&draft, *op))
            // The other three can be written in older versions of the format.
            .filter(|op| op.group() != Group::Copies || seed % 4 == 3)
            .collect();
        let length = dice.within(3, 30);
        draft.programs[number].code = (0..length)
            .map(|_| {
                let op = dice.pick(&allowed);
                random_instruction(&mut dice, &draft, number, op)
            })
            .collect();
    }
    fill_memory(&mut dice, &mut draft);
    draft
}

/// Graph, registers and header; programs without code.
fn blank(
    dice: &mut Dice,
    history: u16,
    perceive: impl FnOnce(&mut Dice, &mut Header) -> Vec<u8>,
) -> Draft {
    let (width, inputs) = (dice.within(1, 5) as u16, dice.within(1, 6) as u16);
    let mut header = header(width, inputs);
    header.history = history;
    header.window = header.window.max(inputs * history) + dice.below(4) as u16;
    header.register_mode = dice.pick(RegisterMode::ALL);
    header.memory_model = dice.pick(MemoryModel::ALL);
    header.initial_values = dice.pick(InitialValues::ALL);
    let reactive =
        header.register_mode == RegisterMode::Stateless && header.memory_model == MemoryModel::None;
    header.reset_scope = if reactive {
        ResetScope::EveryDecision
    } else {
        dice.pick(&[
            ResetScope::Original,
            ResetScope::PerGeneration,
            ResetScope::PerAgent,
            ResetScope::PerEpisode,
            ResetScope::MemoryPerAgent,
            ResetScope::MemoryPerEpisode,
        ])
    };
    header.write_distribution = dice.pick(WriteDistribution::ALL);
    header.action_kind = match dice.pick(ActionKind::ALL) {
        ActionKind::Each if width == 1 => ActionKind::Continuous,
        kind => kind,
    };
    let each = header.action_kind == ActionKind::Each;
    header.actions = match header.action_kind {
        ActionKind::Discrete => dice.within(1, 4) as u16,
        ActionKind::Continuous => dice.within(1, usize::from(width)) as u16,
        _ => dice.within(2, usize::from(width)) as u16,
    };
    header.action_low = -1.5;
    let front_end = perceive(dice, &mut header);
    let indexed = header.memory_model == MemoryModel::Indexed;
    let teams = if each { 1 } else { dice.within(1, 5) };
    let mut programs = teams + dice.within(1, 6);
    if each {
        programs = programs.max(usize::from(header.actions));
    }
    let mut draft = Draft {
        header,
        teams: Vec::new(),
        programs: Vec::new(),
        cells: Vec::new(),
        image: Vec::new(),
        front_end,
        ranges: Vec::new(),
    };
    for number in 0..programs {
        let registers = [
            if indexed { 8 } else { dice.within(2, 8) as u8 },
            dice.within(1, 3) as u8,
            dice.within(1, 3) as u8,
        ];
        // The first programs are their teams' own exits, the others are shared and lead anywhere.
        let target = match (header.action_kind, number < teams || dice.below(4) == 0) {
            (ActionKind::Discrete, true) => {
                Target::Atomic(dice.below(usize::from(header.actions)) as u16)
            }
            // The first programs see to it that every output has one.
            (ActionKind::Each, _) if number < usize::from(header.actions) => {
                Target::Atomic(number as u16)
            }
            (ActionKind::Each, _) => Target::Atomic(dice.below(usize::from(header.actions)) as u16),
            (_, false) => Target::Team(TeamId(dice.below(teams) as u16)),
            (_, true) => Target::Atomic(0),
        };
        let [s, v, m] = registers.map(usize::from);
        let width = usize::from(width);
        draft.programs.push(DraftProgram {
            registers,
            constants: (0..s + (v + m * width) * width)
                .map(|_| dice.number())
                .collect(),
            code: Vec::new(),
            target,
            output: None,
        });
    }
    for number in 0..programs {
        draft.programs[number].output = Some(match header.actions {
            1 => draft.scalar(number, 1),
            _ if each => draft.scalar(number, dice.below(2)),
            _ => draft.vector(number, 0),
        });
    }
    if header.action_kind == ActionKind::Discrete {
        draft
            .programs
            .iter_mut()
            .for_each(|program| program.output = None);
    }
    for number in 0..teams {
        let mut members: Vec<u16> = (0..dice.within(2, 5))
            .map(|_| dice.within(teams, programs - 1) as u16)
            .collect();
        let own = if each {
            0..usize::from(header.actions)
        } else {
            number..number + 1
        };
        for program in own {
            members.insert(dice.below(members.len() + 1), program as u16);
        }
        // A team lists no program twice.
        let mut listed = BTreeSet::new();
        members.retain(|program| listed.insert(*program));
        draft.teams.push(DraftTeam {
            members,
            stream_key: dice.within(0, 3) as u32,
            ..DraftTeam::default()
        });
    }
    if indexed {
        let count = dice.below(20);
        let mut cells: Vec<u16> = (0..count)
            .map(|_| dice.pick(&[380, 392, 400, 0]) + dice.below(16) as u16)
            .collect();
        cells.sort_unstable();
        cells.dedup();
        draft.cells = cells;
    }
    draft
}

fn is_allowed(draft: &Draft, op: Op) -> bool {
    let header = &draft.header;
    match op.group() {
        Group::Constants => header.initial_values == InitialValues::Evolved,
        Group::TeamMemory | Group::WholeReads => header.memory_model == MemoryModel::Team,
        Group::Classic if op == Op::MemWrite => header.memory_model == MemoryModel::Indexed,
        Group::Classic if op == Op::MemRead => !draft.cells.is_empty(),
        _ => true,
    }
}

fn random_instruction(dice: &mut Dice, draft: &Draft, program: usize, op: Op) -> Instruction {
    let width = usize::from(draft.header.width);
    let [s, v, m] = draft.programs[program].registers.map(usize::from);
    let d = match op.destination() {
        Destination::None => 0,
        Destination::S | Destination::SUpdate => draft.scalar(program, dice.below(s)),
        Destination::V | Destination::VUpdate => draft.vector(program, dice.below(v)),
        Destination::M | Destination::MUpdate => draft.matrix(program, dice.below(m)),
    };
    let [a, b] = op.operands().map(|kind| {
        let observed = dice.below(3) == 0;
        let window = usize::from(draft.header.window);
        match kind {
            Operand::None => 0,
            Operand::S if observed => dice.below(draft.header.observed()) as u16,
            Operand::V if observed => dice.below(window - width + 1) as u16,
            Operand::M if observed => dice.below(window - width * width + 1) as u16,
            Operand::VElement | Operand::MElement | Operand::SOrVElement if observed => {
                dice.below(window) as u16
            }
            Operand::S => draft.scalar(program, dice.below(s)),
            Operand::SOrVElement if dice.below(2) == 0 => draft.scalar(program, dice.below(s)),
            Operand::V => draft.vector(program, dice.below(v)),
            Operand::M => draft.matrix(program, dice.below(m)),
            Operand::VElement | Operand::SOrVElement => {
                draft.vector(program, dice.below(v)) + dice.below(width) as u16
            }
            Operand::MElement => {
                draft.matrix(program, dice.below(m)) + dice.below(width * width) as u16
            }
            Operand::ScalarSlot | Operand::VectorSlot | Operand::MatrixSlot => dice.below(8) as u16,
            Operand::VectorIndex => dice.below(width) as u16,
            Operand::MatrixIndex => dice.below(width * width) as u16,
            Operand::Cell => (draft.memory_start() + dice.below(draft.cells.len())) as u16,
        }
    });
    instruction(op, d, a, b)
}

/// Keeps the slots that members read and some more; gives them values, and now and then an image.
fn fill_memory(dice: &mut Dice, draft: &mut Draft) {
    let width = usize::from(draft.header.width);
    let mut words = draft.cells.len();
    if draft.header.memory_model == MemoryModel::Team {
        for team in &mut draft.teams {
            for member in &team.members {
                for i in &draft.programs[usize::from(*member)].code {
                    if let (Some(section), true) =
                        (i.op.section(), i.op.destination() != Destination::None)
                    {
                        team.slots[section as usize] |= 1 << i.a;
                    }
                }
            }
            let section = dice.pick(&Section::ALL);
            team.slots[section as usize] |= 1 << dice.below(8);
            let mut record = Team::default();
            record.slots = team.slots;
            team.constants = (0..record.memory_words(width))
                .map(|_| dice.number())
                .collect();
            words += team.constants.len();
        }
    }
    debug_assert!(
        draft
            .cells
            .iter()
            .all(|cell| usize::from(*cell) < INDEXED_CELLS)
    );
    if dice.below(3) == 0 {
        draft.image = (0..words).map(|_| dice.number()).collect();
    }
}
