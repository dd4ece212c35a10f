//! Valid policies that make a loader or a decision work for as little promise as possible.
//!
//! They are files of version 1: version 3 has no duplicate members.

use tpg_runtime::blob::{ActionKind, InitialValues, MemoryModel};
use tpg_runtime::isa::Op;
use tpg_runtime::tables::{Target, TeamId};

use crate::draft::{Draft, DraftProgram, DraftTeam, header, instruction, make_stateful};
use crate::old_format::old_format;

/// The file of a hostile policy.
#[must_use]
pub fn encode(draft: &Draft) -> Vec<u8> {
    old_format(&draft.encode())
}

/// What makes a decision work besides its instructions: name and policy.
#[must_use]
pub fn decisions() -> Vec<(&'static str, Draft)> {
    vec![
        ("hostile_members", members(65_535)),
        ("hostile_each", each(65_000)),
        ("hostile_registers", registers()),
        ("hostile_window", window()),
        ("hostile_marks", marks()),
        ("hostile_writes", writes()),
    ]
}

/// One program that a team lists `times` times.
#[must_use]
pub fn members(times: usize) -> Draft {
    let mut draft = blank(1, 1);
    draft.programs = vec![DraftProgram::bidding(1.0, Target::Atomic(0))];
    draft.teams[0].members = vec![0; times];
    draft
}

/// One program of `reads` reads of team memory that a team lists `times` times.
#[must_use]
pub fn reads(reads: usize, times: usize) -> Draft {
    let mut draft = members(times);
    make_stateful(&mut draft.header, MemoryModel::Team);
    let read = instruction(Op::ReadS, draft.scalar(0, 0), 7, 0);
    draft.programs[0].code = vec![read; reads];
    draft.teams[0].slots = [0x80, 0, 0];
    draft.teams[0].constants = vec![0.0];
    draft
}

/// `programs` programs that each read team memory, and a team that lists the first one `times` times.
#[must_use]
pub fn readers(programs: usize, times: usize) -> Draft {
    let mut draft = reads(0, times);
    draft.programs = vec![draft.programs[0].clone(); programs];
    for number in 0..programs {
        let read = instruction(Op::ReadS, draft.scalar(number, 0), 7, 0);
        draft.programs[number].code = vec![read];
    }
    draft
}

/// Two outputs, one of which has a program that is listed `times` times.
fn each(times: usize) -> Draft {
    let mut draft = blank(2, 1);
    draft.header.action_kind = ActionKind::Each;
    draft.programs = (0..2)
        .map(|output| DraftProgram::bidding(1.0, Target::Atomic(output)))
        .collect();
    for number in 0..2 {
        draft.programs[number].output = Some(draft.scalar(number, 1));
    }
    draft.teams[0].members = vec![0; times];
    draft.teams[0].members.push(1);
    draft
}

/// Programs without code that have all registers, which each decision resets.
fn registers() -> Draft {
    let mut draft = Draft {
        header: header(32, 1),
        ..blank(1, 1)
    };
    draft.header.initial_values = InitialValues::Zero;
    draft.programs = vec![
        DraftProgram {
            registers: [8, 8, 8],
            constants: Vec::new(),
            code: Vec::new(),
            target: Target::Atomic(0),
            output: None,
        };
        7
    ];
    draft.teams[0].members = (0..7).collect();
    draft
}

/// An observation of one element, repeated over a long window.
fn window() -> Draft {
    let mut draft = members(1);
    draft.header.window = 65_000;
    draft
}

/// As many teams and programs as an agent on a host has room for. The decision visits every team.
fn marks() -> Draft {
    let mut draft = blank(1, 1);
    let chain = |team| DraftProgram::bidding(1.0, Target::Team(TeamId(team)));
    draft.programs = (1..512).map(chain).collect();
    let end = DraftProgram::bidding(0.0, Target::Atomic(0));
    draft.programs.resize(2048, end);
    draft.teams = (0..512)
        .map(|team| DraftTeam {
            members: vec![team, 511],
            ..DraftTeam::default()
        })
        .collect();
    draft
}

/// Writes to indexed memory of which no cell is kept.
fn writes() -> Draft {
    let mut draft = members(1);
    make_stateful(&mut draft.header, MemoryModel::Indexed);
    draft.programs[0].registers = [8, 0, 0];
    draft.programs[0].constants = vec![0.0; 8];
    draft.programs[0].code = vec![instruction(Op::MemWrite, 0, 0, 0); 60_000];
    draft
}

/// A stateful discrete policy of one team.
fn blank(width: u16, observation_len: u16) -> Draft {
    let mut draft = Draft {
        header: header(width, observation_len),
        teams: vec![DraftTeam::default()],
        programs: Vec::new(),
        cells: Vec::new(),
        image: Vec::new(),
        front_end: Vec::new(),
        ranges: Vec::new(),
    };
    make_stateful(&mut draft.header, MemoryModel::None);
    draft
}
