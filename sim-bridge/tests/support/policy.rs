//! Small policies made by hand.

use tpg_runtime::blob::{
    ActionKind, Header, InitialValues, MemoryModel, RegisterMode, ResetScope, encode, encoded_bound,
};
use tpg_runtime::isa::{Group, Op};
use tpg_runtime::tables::{Instruction, Program, Tables, Target, Team};

fn code(rows: &[(Op, u16, u16, u16)]) -> Vec<[u8; Instruction::BYTES]> {
    let row = |&(op, d, a, b): &(Op, u16, u16, u16)| Instruction { op, d, a, b }.to_bytes();
    rows.iter().map(row).collect()
}

fn blob(header: &Header, tables: &Tables<'_>) -> Vec<u8> {
    let mut buffer = vec![0; encoded_bound(tables)];
    let len = encode(header, tables, &mut buffer).expect("the bound is enough");
    buffer.truncate(len);
    buffer
}

fn labels(count: u16) -> String {
    (0..count).map(|k| format!("x{k}\t1\n")).collect()
}

const EMPTY: Tables<'static> = Tables {
    teams: &[],
    members: &[],
    programs: &[],
    code: &[],
    constants: &[],
    cells: &[],
    memory: &[],
    front_end: &[],
    labels: "",
    task: "",
    observability: "none",
};

/// Balances the cart-pole for a while: pushes to where the pole falls, misled by a memory that is written at random.
///
/// State: observation 0..4, register of program 0 at 4, registers of program 1 at 5 and 6, the slot at 7.
pub fn cartpole(provenance: u8) -> Vec<u8> {
    let program = |code_start, code_len, action, state_start, scalars| {
        Program {
            code_start,
            code_len,
            target: Target::Atomic(action),
            constants_start: 0,
            state_start,
            output: state_start,
            registers: [scalars, 0, 0],
        }
        .to_bytes()
    };
    let (angle, speed, none) = (2, 3, 0);
    let code = code(&[
        (Op::WriteS, none, speed, none),
        (Op::Sub, 4, angle, angle),
        (Op::ReadS, 6, 0, none),
        (Op::Add, 5, angle, speed),
        (Op::Add, 5, 5, 6),
    ]);
    let team = Team {
        members_len: 2,
        slots: [1, 0, 0],
        stream_key: 7,
        memory_start: 7,
        ..Team::default()
    };
    let header = Header {
        body_bytes: 0,
        words: 8,
        programs: 2,
        teams: 1,
        streams: 1,
        width: 1,
        observation_len: 4,
        window: 4,
        actions: 2,
        action_kind: ActionKind::Discrete,
        register_mode: RegisterMode::Stateful,
        initial_values: InitialValues::Zero,
        reset_scope: ResetScope::PerEpisode,
        memory_model: MemoryModel::Team,
        front_end: None,
        groups: Group::Scalar.bit() | Group::TeamMemory.bit(),
        action_low: 0.0,
        action_high: 0.0,
        control_period_us: 20_000,
        provenance: [provenance; 16],
    };
    let tables = Tables {
        teams: &[team.to_bytes()],
        members: &[0u16.to_le_bytes(), 1u16.to_le_bytes()],
        programs: &[program(0, 2, 0, 4, 1), program(2, 3, 1, 5, 2)],
        code: &code,
        labels: &labels(4),
        task: "cartpole-v1",
        ..EMPTY
    };
    blob(&header, &tables)
}

/// Moves the hopper's joints against their speeds.
///
/// State: observation 0..11, outputs 11..14, scalar register at 14, vector register at 15..18.
pub fn hopper() -> Vec<u8> {
    let (height, joint_speeds, bid, output) = (0, 8, 14, 15);
    let code = code(&[
        (Op::Sub, bid, height, height),
        (Op::Sub, bid, bid, height),
        (Op::VScale, output, bid, joint_speeds),
    ]);
    let program = Program {
        code_start: 0,
        code_len: 3,
        target: Target::Atomic(0),
        constants_start: 0,
        state_start: bid,
        output,
        registers: [1, 1, 0],
    };
    let team = Team {
        members_len: 1,
        memory_start: 18,
        ..Team::default()
    };
    let header = Header {
        body_bytes: 0,
        words: 18,
        programs: 1,
        teams: 1,
        streams: 0,
        width: 3,
        observation_len: 11,
        window: 11,
        actions: 3,
        action_kind: ActionKind::Continuous,
        register_mode: RegisterMode::Stateless,
        initial_values: InitialValues::Zero,
        reset_scope: ResetScope::EveryDecision,
        memory_model: MemoryModel::None,
        front_end: None,
        groups: Group::Scalar.bit() | Group::Vector.bit(),
        action_low: -1.0,
        action_high: 1.0,
        control_period_us: 8_000,
        provenance: [0; 16],
    };
    let tables = Tables {
        teams: &[team.to_bytes()],
        members: &[0u16.to_le_bytes()],
        programs: &[program.to_bytes()],
        code: &code,
        labels: &labels(14),
        task: "hopper-v4",
        ..EMPTY
    };
    blob(&header, &tables)
}
