//! Small policies made by hand.

use tpg_runtime::blob::{
    ActionKind, Header, MemoryModel, RegisterMode, ResetScope, encode, encoded_bound,
};
use tpg_runtime::isa::{Group, Op};
use tpg_runtime::tables::{Instruction, Program, Tables, Target, Team};

/// The file of a policy of one team, whose members are all programs. Its task has `channels` inputs and outputs.
fn file(
    header: &Header,
    team: Team,
    programs: &[Program],
    code: &[(Op, u16, u16, u16)],
    (task, channels): (&str, u16),
) -> Vec<u8> {
    let teams = [team.to_bytes()];
    let members: Vec<[u8; 2]> = (0..team.members_len).map(u16::to_le_bytes).collect();
    let programs: Vec<_> = programs.iter().map(|program| program.to_bytes()).collect();
    let row = |&(op, d, a, b): &(Op, u16, u16, u16)| Instruction { op, d, a, b }.to_bytes();
    let code: Vec<_> = code.iter().map(row).collect();
    let labels: String = (0..channels).map(|k| format!("x{k}\t1\n")).collect();
    let mut tables = Tables::default();
    tables.teams = &teams;
    tables.members = &members;
    tables.programs = &programs;
    tables.code = &code;
    tables.labels = &labels;
    tables.task = task;
    tables.observability = "none";
    let mut buffer = vec![0; encoded_bound(&tables)];
    let len = encode(header, &tables, &mut buffer).expect("the bound is enough");
    buffer.truncate(len);
    buffer
}

/// Balances the cart-pole for a while: pushes to where the pole falls, misled by a memory that is written at random.
///
/// State: observation 0..4, register of program 0 at 4, registers of program 1 at 5 and 6, the slot at 7.
pub fn cartpole(provenance: u8) -> Vec<u8> {
    cartpole_every(provenance, 20_000)
}

/// The same with another control period, in microseconds.
pub fn cartpole_every(provenance: u8, period_us: u32) -> Vec<u8> {
    let program = |code_start, code_len, action, state_start, scalars| {
        let mut program = Program::default();
        program.code_start = code_start;
        program.code_len = code_len;
        program.target = Target::Atomic(action);
        program.state_start = state_start;
        program.output = state_start;
        program.registers = [scalars, 0, 0];
        program
    };
    let (angle, speed, none) = (2, 3, 0);
    let code = [
        (Op::WriteS, none, speed, none),
        (Op::Sub, 4, angle, angle),
        (Op::ReadS, 6, 0, none),
        (Op::Add, 5, angle, speed),
        (Op::Add, 5, 5, 6),
    ];
    let mut team = Team::default();
    team.members_len = 2;
    team.slots = [1, 0, 0];
    team.stream_key = 7;
    team.memory_start = 7;
    let mut header = Header::default();
    header.words = 8;
    header.programs = 2;
    header.teams = 1;
    header.streams = 1;
    header.width = 1;
    header.observation_len = 4;
    header.window = 4;
    header.actions = 2;
    header.register_mode = RegisterMode::Stateful;
    header.reset_scope = ResetScope::PerEpisode;
    header.memory_model = MemoryModel::Team;
    header.groups = Group::Scalar.bit() | Group::TeamMemory.bit();
    header.control_period_us = period_us;
    header.provenance = [provenance; 16];
    let programs = [program(0, 2, 0, 4, 1), program(2, 3, 1, 5, 2)];
    file(&header, team, &programs, &code, ("cartpole-v1", 4))
}

/// Moves the hopper's joints against their speeds.
///
/// State: observation 0..11, outputs 11..14, scalar register at 14, vector register at 15..18.
pub fn hopper() -> Vec<u8> {
    let (height, joint_speeds, bid, output) = (0, 8, 14, 15);
    let code = [
        (Op::Sub, bid, height, height),
        (Op::Sub, bid, bid, height),
        (Op::VScale, output, bid, joint_speeds),
    ];
    let mut program = Program::default();
    program.code_len = 3;
    program.state_start = bid;
    program.output = output;
    program.registers = [1, 1, 0];
    let mut team = Team::default();
    team.members_len = 1;
    team.memory_start = 18;
    let mut header = Header::default();
    header.words = 18;
    header.programs = 1;
    header.teams = 1;
    header.width = 3;
    header.observation_len = 11;
    header.window = 11;
    header.actions = 3;
    header.action_kind = ActionKind::Continuous;
    header.reset_scope = ResetScope::EveryDecision;
    header.groups = Group::Scalar.bit() | Group::Vector.bit();
    header.action_low = -1.0;
    header.action_high = 1.0;
    header.control_period_us = 8_000;
    file(&header, team, &[program], &code, ("hopper-v4", 14))
}
