//! Random policies from a seed, for comparing machines: every operation, both register modes, all memory models.

use tpg_board::trial::Generator;
use tpg_runtime::blob::{ActionKind, InitialValues, MemoryModel, RegisterMode, ResetScope};
use tpg_runtime::front_end::Fallback;
use tpg_runtime::isa::{Destination, Group, Op, Operand};
use tpg_runtime::tables::{Instruction, Section, Target, TeamId};

use crate::draft::{Draft, DraftProgram, DraftTeam, header, instruction, make_stateful};
use crate::front_end::front_end;

/// Number of policies that [`all`] makes.
pub const COUNT: u64 = 24;
/// Number of policies with front ends that [`all`] adds to them: every kind of belief, discrete and continuous.
pub const PERCEIVING: u64 = 8;
/// Number of policies whose outputs have programs of their own that [`all`] adds: every register mode and memory model.
pub const APART: u64 = 6;
/// Teams of each policy, each of which leads to the next.
const TEAMS: u16 = 5;
/// Widths in use, which the boards' trial is compiled for.
const WIDTHS: [u16; 8] = [1, 2, 3, 4, 6, 8, 11, 17];
/// Inputs.
const INPUTS: u16 = 7;

/// The policies, encoded.
#[must_use]
pub fn all() -> Vec<Vec<u8>> {
    (0..COUNT + PERCEIVING + APART).map(graph).collect()
}

/// One policy; its number decides modes and width, everything else is drawn.
fn graph(number: u64) -> Vec<u8> {
    let mut draw = Draw(Generator::new(number));
    let memory = [MemoryModel::None, MemoryModel::Team, MemoryModel::Indexed][number as usize % 3];
    // Every third policy is of the classic set, the one with indexed memory.
    let groups: Vec<Group> = match memory {
        MemoryModel::Indexed => vec![Group::Classic],
        _ => Group::ALL
            .iter()
            .copied()
            .filter(|g| fits(*g, memory))
            .collect(),
    };
    let apart = number >= COUNT + PERCEIVING;
    let width = match WIDTHS[(number / 3) as usize % WIDTHS.len()] {
        1 if apart => 2,
        width => width,
    };
    let mut draft = Draft {
        header: header(width, INPUTS),
        teams: Vec::new(),
        programs: Vec::new(),
        cells: Vec::new(),
        image: Vec::new(),
        front_end: Vec::new(),
        ranges: Vec::new(),
    };
    let stateful = number % 2 == 1;
    if stateful || memory != MemoryModel::None {
        make_stateful(&mut draft.header, memory);
    }
    if !stateful {
        draft.header.register_mode = RegisterMode::Stateless;
    }
    if memory != MemoryModel::None {
        draft.header.reset_scope = [ResetScope::PerEpisode, ResetScope::PerAgent][draw.below(2)];
    }
    draft.header.window = INPUTS.max(width * width) + INPUTS;
    draft.header.initial_values = InitialValues::Evolved;
    draft.header.groups = groups.iter().map(|g| g.bit()).sum();
    if apart {
        draft.header.action_kind = ActionKind::Each;
        draft.header.actions = width.min(3);
    } else if (number / 2).is_multiple_of(2) {
        draft.header.action_kind = ActionKind::Continuous;
        // One output, or several.
        draft.header.actions = if (number / 4).is_multiple_of(2) {
            1
        } else {
            width.min(3)
        };
    } else {
        draft.header.actions = 5;
    }
    if memory == MemoryModel::Indexed {
        draft.cells = vec![0, 9, 378, 391, 392, 399, 400, 404, 411, 799];
    }
    if (COUNT..COUNT + PERCEIVING).contains(&number) {
        let (fallback, degree) = [
            (Fallback::Model, 1),
            (Fallback::Model, 2),
            (Fallback::Model, 3),
            (Fallback::Zero, 0),
            (Fallback::Model, 3),
            (Fallback::Model, 1),
            (Fallback::Hold, 0),
            (Fallback::Model, 2),
        ][(number - COUNT) as usize];
        let columns: &[u16] = match fallback {
            Fallback::Model if degree < 3 => &[0, 1, 2, 3, 4, 5, 6],
            Fallback::Model => &[1, 3, 6],
            _ => &[],
        };
        draft.front_end = front_end(&mut draft.header, fallback, degree, columns, || {
            draw.below(2001) as f32 / 4000.0 - 0.25
        });
    }
    add_teams(&mut draft, memory, &mut draw);
    if apart {
        draft.teams.truncate(1);
        draft.teams[0].members = (0..4 * TEAMS).collect();
    }
    let registers = match memory {
        MemoryModel::Indexed => [8, 1, 0],
        _ => [3, 3, 2],
    };
    for program in 0..4 * TEAMS {
        add_program(&mut draft, program, registers, &mut draw);
    }
    fill_code(&mut draft, &groups, &mut draw);
    draft.encode()
}

fn fits(group: Group, memory: MemoryModel) -> bool {
    match group {
        Group::Classic => false,
        Group::TeamMemory | Group::WholeReads => memory == MemoryModel::Team,
        _ => true,
    }
}

/// Numbers for a draft.
struct Draw(Generator);

impl Draw {
    fn below(&mut self, limit: usize) -> usize {
        (self.0.bits() % limit as u64) as usize
    }

    fn constants(&mut self, len: usize) -> Vec<f32> {
        (0..len)
            .map(|_| self.below(4001) as f32 / 1000.0 - 2.0)
            .collect()
    }
}

fn add_teams(draft: &mut Draft, memory: MemoryModel, draw: &mut Draw) {
    let width = usize::from(draft.header.width);
    for number in 0..TEAMS {
        let mut team = DraftTeam {
            // Three of its own, one of the team after next, whose target may have been visited.
            members: vec![4 * number, 4 * number + 1, 4 * number + 2],
            stream_key: 100 + u32::from(number) / 2,
            ..DraftTeam::default()
        };
        team.members.push(4 * ((number + 2) % TEAMS) + 3);
        if memory == MemoryModel::Team {
            team.slots = [0b0011_1001, 0b0001_1010, 0b0001_1000];
            team.constants = draw.constants(4 + 3 * width + 2 * width * width);
        }
        draft.teams.push(team);
    }
}

/// Program 0 of each four leads to the next team, program 3 anywhere, the others act; with outputs apart, all act in turn.
fn add_program(draft: &mut Draft, number: u16, registers: [u8; 3], draw: &mut Draw) {
    let width = usize::from(draft.header.width);
    let [s, v, m] = registers.map(usize::from);
    let discrete = draft.header.action_kind == ActionKind::Discrete;
    let action = |draw: &mut Draw| Target::Atomic(if discrete { draw.below(5) as u16 } else { 0 });
    let apart = draft.header.action_kind == ActionKind::Each;
    let target = match number % 4 {
        _ if apart => Target::Atomic(number % draft.header.actions),
        0 if number / 4 + 1 < TEAMS => Target::Team(TeamId(number / 4 + 1)),
        3 => Target::Team(TeamId(draw.below(usize::from(TEAMS)) as u16)),
        _ => action(draw),
    };
    draft.programs.push(DraftProgram {
        registers,
        constants: draw.constants(s + v * width + m * width * width),
        code: Vec::new(),
        target,
        output: None,
    });
    let last = draft.programs.len() - 1;
    let output = match (discrete, draft.header.actions) {
        (true, _) => None,
        (_, 1) => Some(draft.scalar(last, 1)),
        _ if apart => Some(draft.scalar(last, 1)),
        _ => Some(draft.vector(last, if v > 1 { 1 } else { 0 })),
    };
    draft.programs[last].output = output;
}

/// Deals the operations out to the programs until each has been used, then adds random ones.
fn fill_code(draft: &mut Draft, groups: &[Group], draw: &mut Draw) {
    let ops: Vec<Op> = (Op::ALL.iter().copied())
        .filter(|op| groups.contains(&op.group()))
        .collect();
    let memory: usize = draft.teams.iter().map(|t| t.constants.len()).sum();
    let cells = draft.memory_start() + memory;
    let programs = draft.programs.len();
    for number in 0..programs {
        // The root's members run in every decision: together they have every operation.
        let share = ops.len().div_ceil(3);
        let mut code: Vec<Instruction> = match number {
            0..3 => (ops.iter().skip(number * share).take(share))
                .map(|op| random(draft, number, *op, cells, draw))
                .collect(),
            _ => Vec::new(),
        };
        for _ in 0..draw.below(12) {
            let op = ops[draw.below(ops.len())];
            code.push(random(draft, number, op, cells, draw));
        }
        code.extend(bid(draft, number, groups, draw));
        draft.programs[number].code = code;
    }
}

/// Ends a program with a bid that often, but not always, leads the decision deeper.
fn bid(draft: &Draft, number: usize, groups: &[Group], draw: &mut Draw) -> Vec<Instruction> {
    let (s0, input) = (
        draft.scalar(number, 0),
        draw.below(usize::from(INPUTS)) as u16,
    );
    let leads = matches!(draft.programs[number].target, Target::Team(_));
    let classic = groups.contains(&Group::Classic);
    match (classic, leads) {
        (true, true) => vec![instruction(Op::ClassicExp, s0, input, 0)],
        (true, false) => vec![instruction(Op::ClassicCos, s0, s0, 0)],
        (false, true) => vec![
            instruction(Op::Heaviside, s0, input, 0),
            instruction(Op::Add, s0, s0, s0),
        ],
        (false, false) => vec![instruction(Op::Tanh, s0, s0, 0)],
    }
}

/// A well-formed instruction of the operation with random operands, registers and observation alike.
fn random(draft: &Draft, number: usize, op: Op, cells: usize, draw: &mut Draw) -> Instruction {
    let width = usize::from(draft.header.width);
    let registers = draft.programs[number].registers.map(usize::from);
    let team = &draft.teams[0];
    let window = usize::from(draft.header.window);
    let scalar = |draw: &mut Draw| draft.scalar(number, draw.below(registers[0]));
    let vector = |draw: &mut Draw| draft.vector(number, draw.below(registers[1]));
    let matrix = |draw: &mut Draw| draft.matrix(number, draw.below(registers[2]));
    let slot = |section: Section, draw: &mut Draw| {
        let kept: Vec<u16> = (0..8)
            .filter(|slot| team.slots[section as usize] >> slot & 1 == 1)
            .collect();
        kept[draw.below(kept.len())]
    };
    let operand = |kind: Operand, draw: &mut Draw| -> u16 {
        let seen = draw.below(3) == 0;
        match kind {
            Operand::None => 0,
            Operand::VectorIndex => draw.below(width) as u16,
            Operand::MatrixIndex => draw.below(width * width) as u16,
            Operand::S if seen => draw.below(usize::from(INPUTS)) as u16,
            Operand::S => scalar(draw),
            Operand::V if seen => draw.below(window - width + 1) as u16,
            Operand::V => vector(draw),
            Operand::M if seen => draw.below(window - width * width + 1) as u16,
            Operand::M => matrix(draw),
            Operand::VElement | Operand::SOrVElement if seen => draw.below(window) as u16,
            Operand::VElement => vector(draw) + draw.below(width) as u16,
            Operand::SOrVElement => scalar(draw),
            Operand::MElement if seen => draw.below(window) as u16,
            Operand::MElement => matrix(draw) + draw.below(width * width) as u16,
            Operand::ScalarSlot => slot(Section::Scalar, draw),
            Operand::VectorSlot => slot(Section::Vector, draw),
            Operand::MatrixSlot => slot(Section::Matrix, draw),
            Operand::Cell => (cells + draw.below(draft.cells.len())) as u16,
        }
    };
    let d = match op.destination() {
        Destination::None => 0,
        Destination::S | Destination::SUpdate => scalar(draw),
        Destination::V | Destination::VUpdate => vector(draw),
        Destination::M | Destination::MUpdate => matrix(draw),
    };
    let [a, b] = op.operands().map(|kind| operand(kind, draw));
    instruction(op, d, a, b)
}
