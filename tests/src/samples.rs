//! Varied policies in which every operation occurs, for tests of the format.

use tpg_runtime::blob::{ActionKind, InitialValues, MemoryModel, RegisterMode};
use tpg_runtime::front_end::Fallback;
use tpg_runtime::isa::{Destination, Group, Op, Operand};
use tpg_runtime::tables::{Instruction, Range, Section, Target, TeamId};

use crate::draft::{Draft, DraftProgram, DraftTeam, header, instruction, make_stateful};
use crate::front_end::front_end;

/// The samples: name and policy.
#[must_use]
pub fn all() -> Vec<(&'static str, Draft)> {
    vec![
        ("reactive", reactive()),
        ("zero", zero()),
        ("team-memory", team_memory()),
        ("classic", classic()),
        ("each", each()),
        ("copies", copies()),
    ]
}

/// Samples that files of version 3 alone can hold, of large robots and with ranges: name and policy. 256 is the most outputs
/// that there are.
#[must_use]
pub fn large() -> Vec<(&'static str, Draft)> {
    vec![
        ("outputs-78", outputs(78, [2, 4, 0], 1)),
        ("outputs-256", outputs(256, [2, 8, 0], 0)),
        ("each-78", each_of(78)),
        ("long-observation", long_observation()),
        ("ranges", ranged(reactive())),
        ("each-ranges", ranged(each_of(2))),
    ]
}

/// The names of the samples that files of version 1 can hold, which know no moves and latches.
pub fn old_names() -> impl Iterator<Item = &'static str> {
    let has_copies = |draft: &Draft| {
        let mut code = draft.programs.iter().flat_map(|program| &program.code);
        code.any(|i| i.op.group() == Group::Copies)
    };
    let samples = all().into_iter();
    samples
        .filter(move |(_, draft)| !has_copies(draft))
        .map(|(name, _)| name)
}

/// The samples with front ends: name and policy.
#[must_use]
pub fn perceiving() -> Vec<(&'static str, Draft)> {
    let (groups, stateless) = ([Group::Scalar, Group::Vector], RegisterMode::Stateless);
    let sample = |fallback: Fallback, degree: u8, columns: &[u16], continuous: bool| {
        let mut draft = blank(3, 4, &groups);
        draft.header.register_mode = stateless;
        if continuous {
            draft.header.action_kind = ActionKind::Continuous;
        }
        let mut values = constants(200).into_iter().map(|x| x / 8.0).cycle();
        let mut next = || values.next().unwrap_or(0.0);
        draft.front_end = front_end(&mut draft.header, fallback, degree, columns, &mut next);
        add_programs(&mut draft, [3, 3, 0], &groups);
        for number in 0..draft.programs.len() {
            if continuous {
                draft.programs[number].output = Some(draft.vector(number, 1));
                if let Target::Atomic(action) = &mut draft.programs[number].target {
                    *action = 0;
                }
            }
        }
        draft
    };
    vec![
        ("standardised", sample(Fallback::Zero, 0, &[], false)),
        ("held", sample(Fallback::Hold, 0, &[], true)),
        ("believed", sample(Fallback::Model, 1, &[0, 1, 2, 3], true)),
        ("believed-cubic", sample(Fallback::Model, 3, &[0, 2], false)),
    ]
}

/// Samples whose windows hold four observations of three elements and repeat the first two, without and with a front end.
#[must_use]
pub fn remembering() -> Vec<(&'static str, Draft)> {
    vec![
        ("history", history(false)),
        ("history-perceiving", history(true)),
    ]
}

/// Continuous, two outputs. Bids are changes since the decision before. Actions are made of the oldest observations, and of words
/// behind them.
fn history(perceives: bool) -> Draft {
    let groups = [Group::Scalar, Group::Vector];
    let mut draft = blank(2, 3, &groups);
    draft.header.history = 4;
    draft.header.window = 14;
    draft.header.action_kind = ActionKind::Continuous;
    if perceives {
        let mut values = constants(200).into_iter().map(|x| x / 8.0).cycle();
        let mut next = || values.next().unwrap_or(0.0);
        draft.front_end = front_end(&mut draft.header, Fallback::Model, 2, &[0, 2], &mut next);
    }
    add_programs(&mut draft, [2, 2, 0], &[]);
    for number in 0..draft.programs.len() {
        let (bid, scalar) = (draft.scalar(number, 0), draft.scalar(number, 1));
        let (vector, output) = (draft.vector(number, 0), draft.vector(number, 1));
        let k = number as u16 % 3;
        draft.programs[number].code = vec![
            instruction(Op::Sub, bid, k, 3 + k),
            instruction(Op::Add, scalar, 11, 8 - k),
            instruction(Op::VSub, vector, 10, 12),
            instruction(Op::VScale, vector, scalar, vector),
            instruction(Op::VAdd, output, vector, 4 + k),
        ];
        draft.programs[number].output = Some(output);
        if let Target::Atomic(action) = &mut draft.programs[number].target {
            *action = 0;
        }
    }
    draft
}

/// Stateless, continuous, three outputs, two teams that share a program.
fn reactive() -> Draft {
    let groups = [
        Group::Scalar,
        Group::Vector,
        Group::Matrix,
        Group::Constants,
    ];
    let mut draft = blank(3, 4, &groups);
    draft.header.action_kind = ActionKind::Continuous;
    draft.header.actions = 3;
    add_programs(&mut draft, [3, 3, 3], &groups);
    for number in 0..draft.programs.len() {
        draft.programs[number].output = Some(draft.vector(number, 1));
        if let Target::Atomic(action) = &mut draft.programs[number].target {
            *action = 0;
        }
    }
    draft
}

/// Stateless without constants (SL-NC), continuous, one output.
fn zero() -> Draft {
    let groups = [Group::Scalar, Group::Vector];
    let mut draft = blank(4, 5, &groups);
    draft.header.initial_values = InitialValues::Zero;
    draft.header.action_kind = ActionKind::Continuous;
    draft.header.actions = 1;
    add_programs(&mut draft, [8, 2, 0], &groups);
    for number in 0..draft.programs.len() {
        draft.programs[number].output = Some(draft.scalar(number, 1));
        if let Target::Atomic(action) = &mut draft.programs[number].target {
            *action = 0;
        }
    }
    draft
}

/// Stateful with team memory (SR-SM) and an image of it.
fn team_memory() -> Draft {
    let groups = [
        Group::Scalar,
        Group::Constants,
        Group::TeamMemory,
        Group::WholeReads,
    ];
    let mut draft = blank(2, 3, &groups);
    make_stateful(&mut draft.header, MemoryModel::Team);
    for (key, team) in draft.teams.iter_mut().enumerate() {
        team.slots = [0b0010_1001, 0b0001_1000, 0b1000_0001];
        team.stream_key = 40 + key as u32;
        team.constants = constants(3 + 2 * 2 + 2 * 4);
    }
    add_programs(&mut draft, [2, 2, 2], &groups);
    draft.image = constants(2 * (3 + 2 * 2 + 2 * 4));
    draft
}

/// Stateful, three outputs, each from programs of its own; two bid for the first.
fn each() -> Draft {
    let groups = [Group::Scalar, Group::Vector];
    let mut draft = blank(3, 4, &groups);
    make_stateful(&mut draft.header, MemoryModel::None);
    draft.header.action_kind = ActionKind::Each;
    draft.header.actions = 3;
    draft.teams.truncate(1);
    draft.teams[0].members = vec![0, 1, 2, 3];
    add_programs(&mut draft, [2, 2, 0], &groups);
    for (number, output) in [0, 1, 2, 0].into_iter().enumerate() {
        draft.programs[number].target = Target::Atomic(output);
        draft.programs[number].output = Some(draft.scalar(number, 1));
    }
    draft
}

/// Stateless, continuous, with outputs that begin at a vector register and run through those behind it.
#[must_use]
pub fn outputs(outputs: u16, registers: [u8; 3], first: usize) -> Draft {
    let groups = [Group::Scalar, Group::Vector];
    let mut draft = blank(32, 5, &groups);
    draft.header.action_kind = ActionKind::Continuous;
    draft.header.actions = outputs;
    add_programs(&mut draft, registers, &groups);
    for number in 0..draft.programs.len() {
        draft.programs[number].output = Some(draft.vector(number, first));
        if let Target::Atomic(action) = &mut draft.programs[number].target {
            *action = 0;
        }
    }
    draft
}

/// Stateless, with two programs for each output; the second outbids the first for every fifth one.
fn each_of(outputs: u16) -> Draft {
    let mut draft = blank(32, 5, &[Group::Scalar]);
    draft.header.action_kind = ActionKind::Each;
    draft.header.actions = outputs;
    draft.teams.truncate(1);
    draft.teams[0].members = (0..2 * outputs).collect();
    for number in 0..2 * outputs {
        let bid = f32::from(u16::from(number % 5 == 0));
        let mut program = DraftProgram::bidding(bid, Target::Atomic(number % outputs));
        program.constants[1] = f32::from(number) / 256.0;
        draft.programs.push(program);
    }
    for number in 0..draft.programs.len() {
        let output = draft.scalar(number, 1);
        // s1 = s1 + obs(number modulo the inputs)
        let input = number as u16 % draft.header.observation_len;
        draft.programs[number].code = vec![instruction(Op::Add, output, output, input)];
        draft.programs[number].output = Some(output);
    }
    draft
}

/// The policy with ranges: of its inputs, and of outputs between -1 and 1.
fn ranged(mut draft: Draft) -> Draft {
    const SIDES: [[f32; 2]; 4] = [
        [f32::NEG_INFINITY, f32::INFINITY],
        [0.0, f32::INFINITY],
        [-2.5, 3.0],
        [f32::NEG_INFINITY, 7.0],
    ];
    let inputs = usize::from(draft.header.observation_len);
    let outputs = [[-1.0, 0.25], [-0.125, 1.0], [0.5, 0.5]];
    let sides = SIDES.into_iter().cycle().take(inputs).chain(outputs);
    let channels = inputs + draft.header.outputs();
    draft.ranges = sides
        .take(channels)
        .map(|[low, high]| Range { low, high })
        .collect();
    draft
}

/// Stateless, with 105 inputs, of which vectors see 32 at a time, the last ones too.
fn long_observation() -> Draft {
    let mut draft = blank(32, 105, &[Group::Vector]);
    draft.header.action_kind = ActionKind::Continuous;
    draft.header.actions = 1;
    add_programs(&mut draft, [2, 2, 0], &[]);
    for number in 0..draft.programs.len() {
        let (output, vector) = (draft.scalar(number, 1), draft.vector(number, 0));
        let windows = [0, 32, 73].map(|start| instruction(Op::Dot, output, vector, start));
        draft.programs[number].code = windows.to_vec();
        draft.programs[number].output = Some(output);
        if let Target::Atomic(action) = &mut draft.programs[number].target {
            *action = 0;
        }
    }
    draft
}

/// Stateful, with moves and latches alone.
fn copies() -> Draft {
    let groups = [Group::Copies];
    let mut draft = blank(2, 4, &groups);
    make_stateful(&mut draft.header, MemoryModel::None);
    add_programs(&mut draft, [2, 2, 2], &groups);
    draft
}

/// The classic set with indexed memory.
fn classic() -> Draft {
    let groups = [Group::Classic];
    let mut draft = blank(1, 2, &groups);
    make_stateful(&mut draft.header, MemoryModel::Indexed);
    draft.cells = vec![0, 7, 391, 392, 399, 400, 401, 799];
    add_programs(&mut draft, [8, 0, 0], &groups);
    draft
}

fn blank(width: u16, observation_len: u16, groups: &[Group]) -> Draft {
    let mut header = header(width, observation_len);
    header.groups = groups.iter().map(|group| group.bit()).sum();
    let team = |members: &[u16]| DraftTeam {
        members: members.to_vec(),
        ..DraftTeam::default()
    };
    Draft {
        header,
        teams: vec![team(&[0, 1, 2]), team(&[2, 3, 0])],
        programs: Vec::new(),
        cells: Vec::new(),
        image: Vec::new(),
        front_end: Vec::new(),
        ranges: Vec::new(),
    }
}

fn constants(len: usize) -> Vec<f32> {
    (0..len)
        .map(|k| (k * 37 % 23) as f32 / 8.0 - 1.25)
        .collect()
}

/// Four programs, one of which leads to the second team; each executes every operation of the groups.
fn add_programs(draft: &mut Draft, registers: [u8; 3], groups: &[Group]) {
    let width = usize::from(draft.header.width);
    let [s, v, m] = registers.map(usize::from);
    let targets = [
        Target::Atomic(0),
        Target::Team(TeamId(1)),
        Target::Atomic(1),
        Target::Atomic(0),
    ];
    for (number, target) in targets.into_iter().enumerate() {
        let mut constants = constants(s + v * width + m * width * width);
        constants[0] = number as f32;
        draft.programs.push(DraftProgram {
            registers,
            constants,
            code: Vec::new(),
            target,
            output: None,
        });
    }
    let start = draft.memory_start() + draft.teams.iter().map(|t| t.constants.len()).sum::<usize>();
    for number in 0..draft.programs.len() {
        let code = Op::ALL
            .iter()
            .filter(|op| groups.contains(&op.group()))
            .map(|op| example(draft, number, *op, start))
            .collect();
        draft.programs[number].code = code;
    }
}

/// One well-formed instruction of the operation; never to `s0`, so that bids stay as they are.
fn example(draft: &Draft, number: usize, op: Op, cells_start: usize) -> Instruction {
    let team = &draft.teams[0];
    let slot = |section: Section| team.slots[section as usize].trailing_zeros() as u16;
    let operand = |kind: Operand| match kind {
        Operand::None | Operand::VectorIndex => 0,
        Operand::MatrixIndex => 1,
        Operand::S => draft.scalar(number, 1),
        Operand::V => draft.vector(number, 0),
        Operand::M | Operand::MElement => draft.matrix(number, 0),
        Operand::VElement => draft.vector(number, 1),
        Operand::SOrVElement => 1,
        Operand::ScalarSlot => slot(Section::Scalar),
        Operand::VectorSlot => slot(Section::Vector),
        Operand::MatrixSlot => slot(Section::Matrix),
        Operand::Cell => cells_start as u16 + 3,
    };
    let d = match op.destination() {
        Destination::None => 0,
        Destination::S | Destination::SUpdate => draft.scalar(number, 1),
        Destination::V | Destination::VUpdate => draft.vector(number, 1),
        Destination::M | Destination::MUpdate => draft.matrix(number, 1),
    };
    let [a, b] = op.operands().map(operand);
    instruction(op, d, a, b)
}
