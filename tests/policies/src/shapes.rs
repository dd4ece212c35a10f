//! Policies of a given shape, for benchmarks: seeded, so that a shape is the same policy everywhere.

use std::ops::RangeInclusive;

use rand_core::Rng as _;
use tpg_runtime::blob::MemoryModel;
use tpg_runtime::isa::{Destination, Op, Operand};
use tpg_runtime::rng::{Pcg32, mix64};
use tpg_runtime::tables::{Instruction, Target, TeamId};
use tpg_runtime::{Action, Agent, AnyWidth, Header, Policy, Reset, State};

use crate::draft::{Draft, DraftProgram, DraftTeam, header, instruction, make_stateful};

/// Scalar arithmetic without calls into libm.
pub const ARITHMETIC: &[Op] = &[Op::Add, Op::Sub, Op::Mul, Op::Div, Op::Min, Op::Max];
/// Three transcendental functions among eight operations, as in the instruction sets that scalar TPG systems use.
pub const TRANSCENDENTAL: &[Op] = &[
    Op::Add,
    Op::Sub,
    Op::Mul,
    Op::Div,
    Op::Cond,
    Op::Cos,
    Op::Log,
    Op::Exp,
];
/// Six operations on vectors element by element, and two that sum.
pub const VECTORS: &[Op] = &[
    Op::VAdd,
    Op::VSub,
    Op::VMul,
    Op::VMin,
    Op::VMax,
    Op::VScale,
    Op::Dot,
    Op::VNorm,
];

/// Length of the observation of [`scalar_graph`].
pub const GRAPH_INPUTS: usize = 4;

/// The stream of a task's seed, as the trainer draws it.
struct Rng(Pcg32);

impl Rng {
    fn new(seed: u64) -> Self {
        Self(Pcg32::new(mix64(&[seed, 0]), mix64(&[seed, 1])))
    }

    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        let unit = (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        low + (high - low) * unit
    }

    fn below(&mut self, n: u64) -> u64 {
        ((u128::from(self.0.next_u64()) * u128::from(n)) >> 64) as u64
    }
}

/// Lengths of long programs.
pub const LONG: RangeInclusive<u64> = 17..=23;
/// Lengths of the programs of GEGELATI's shipped pendulum champion, once converted: 98 instructions in 34 programs.
pub const SHORT: RangeInclusive<u64> = 2..=4;

/// A scalar policy of `teams` teams. Each has four programs of these lengths, the last team three. All instructions are effective.
///
/// Nine teams have 34 programs, as the pendulum champion that GEGELATI ships.
#[must_use]
pub fn scalar_graph(
    mix: &[Op],
    teams: u16,
    lengths: RangeInclusive<u64>,
    seed: u64,
    stateful: bool,
) -> Draft {
    let mut random = Rng::new(seed);
    let mut head = header(GRAPH_INPUTS as u16, GRAPH_INPUTS as u16);
    if stateful {
        make_stateful(&mut head, MemoryModel::None);
    }
    let mut draft = blank(head);
    for team in 0..teams {
        let size = if team + 1 < teams { 4 } else { 3 };
        let mut members = Vec::new();
        for member in 0..size {
            let leaves = member + 1 == size || random.below(10) < 3 || teams == 1;
            let target = if leaves {
                Target::Atomic(random.below(2) as u16)
            } else {
                let other = 1 + random.below(u64::from(teams) - 1) as u16;
                Target::Team(TeamId((team + other) % teams))
            };
            members.push(draft.programs.len() as u16);
            draft.programs.push(DraftProgram {
                registers: [8, 0, 0],
                constants: (0..8).map(|_| random.uniform(-1.0, 1.0) as f32).collect(),
                code: Vec::new(),
                target,
                output: None,
            });
            let (shortest, longest) = lengths.clone().into_inner();
            let len = shortest + random.below(longest - shortest + 1);
            let number = draft.programs.len() - 1;
            draft.programs[number].code = effective(&draft, number, mix, len, &mut random);
        }
        draft.teams.push(DraftTeam {
            members,
            ..DraftTeam::default()
        });
    }
    draft
}

/// Observations that change a little from one to the next.
#[must_use]
pub fn drifting_observations() -> Vec<[f32; GRAPH_INPUTS]> {
    let mut random = Rng::new(4242);
    let mut x = [0.0f32; GRAPH_INPUTS];
    let mut next = || {
        for value in &mut x {
            *value = (*value + random.uniform(-0.1, 0.1) as f32) * 0.99;
        }
        x
    };
    (0..1024).map(|_| next()).collect()
}

/// The first seed whose decisions visit as many teams as typical decisions do, if there are nine: about three of long
/// programs, and 2.2 of short ones, as in GEGELATI's champion. Both actions are used. Returns the policy and the mean of its
/// executed instructions.
///
/// # Panics
/// If the runtime refuses the policy: a fault of this function.
#[must_use]
pub fn typical_graph(
    mix: &[Op],
    teams: u16,
    lengths: &RangeInclusive<u64>,
    stateful: bool,
    observations: &[[f32; GRAPH_INPUTS]],
) -> (Vec<u8>, f64) {
    for seed in 1.. {
        let bytes = scalar_graph(mix, teams, lengths.clone(), seed, stateful).encode();
        let policy = Policy::load(&bytes).expect("a well-formed policy");
        let mut agent: Agent<'_, AnyWidth, State<2048, 256, 64, 4>> =
            Agent::new(policy).expect("room");
        agent.reset(Reset::Agent, 1);
        let (mut visited, mut instructions, mut second) = (0.0, 0.0, 0);
        for observation in observations {
            let decision = agent.decide(observation).expect("the right length");
            visited += f64::from(decision.teams);
            instructions += f64::from(decision.instructions);
            second += usize::from(decision.action == Action::Discrete(1));
        }
        let n = observations.len() as f64;
        let as_usual = if *lengths == LONG {
            (2.8..3.3).contains(&(visited / n)) && (215.0..245.0).contains(&(instructions / n))
        } else {
            (2.1..2.3).contains(&(visited / n))
        };
        if (as_usual && (100..924).contains(&second)) || teams != 9 {
            return (bytes, instructions / n);
        }
    }
    unreachable!("some seed fits")
}

/// One program of `len` instructions that take the operations of `mix` in turn, over all its registers.
#[must_use]
pub fn straight(mix: &[Op], width: u16, len: usize) -> Draft {
    let mut random = Rng::new(7);
    let mut draft = blank(header(width, width));
    let words = 8 + 8 * usize::from(width) + 8 * usize::from(width).pow(2);
    draft.programs.push(DraftProgram {
        registers: [8, 8, 8],
        constants: (0..words)
            .map(|_| random.uniform(-1.0, 1.0) as f32)
            .collect(),
        code: Vec::new(),
        target: Target::Atomic(0),
        output: None,
    });
    draft.teams.push(DraftTeam {
        members: vec![0],
        ..DraftTeam::default()
    });
    let code = (0..len).map(|k| {
        let op = mix[k % mix.len()];
        let [a, b] = op.operands();
        let d = place(&draft, destination(op), random.below(4) as usize);
        // Sources are not destinations: what is measured is throughput, not one chain.
        let mut source = |kind| place(&draft, kind, 4 + random.below(4) as usize);
        instruction(op, d, source(a), source(b))
    });
    draft.programs[0].code = code.collect();
    draft
}

fn blank(header: Header) -> Draft {
    Draft {
        header,
        teams: Vec::new(),
        programs: Vec::new(),
        cells: Vec::new(),
        image: Vec::new(),
        front_end: Vec::new(),
        ranges: Vec::new(),
    }
}

fn destination(op: Op) -> Operand {
    match op.destination() {
        Destination::None => Operand::None,
        Destination::S | Destination::SUpdate => Operand::S,
        Destination::V | Destination::VUpdate => Operand::V,
        Destination::M | Destination::MUpdate => Operand::M,
    }
}

fn place(draft: &Draft, kind: Operand, register: usize) -> u16 {
    match kind {
        Operand::S | Operand::SOrVElement => draft.scalar(0, register),
        Operand::V | Operand::VElement => draft.vector(0, register),
        Operand::M | Operand::MElement => draft.matrix(0, register),
        _ => 0,
    }
}

/// Draws code backwards from the bid, so that every instruction matters to it.
fn effective(
    draft: &Draft,
    program: usize,
    mix: &[Op],
    len: u64,
    random: &mut Rng,
) -> Vec<Instruction> {
    let mut live = 1u32;
    let mut code = Vec::new();
    while code.len() < len as usize {
        let d = random.below(8);
        let op = mix[random.below(mix.len() as u64) as usize];
        if live >> d & 1 == 0 {
            continue;
        }
        let mut needed = if op == Op::Cond {
            live
        } else {
            live & !(1 << d)
        };
        let mut source = |kind| match kind {
            Operand::None => 0,
            _ if random.below(10) < 3 => random.below(GRAPH_INPUTS as u64) as u16,
            _ => {
                let register = random.below(8);
                needed |= 1 << register;
                draft.scalar(program, register as usize)
            }
        };
        let [a, b] = op.operands().map(&mut source);
        if needed != 0 {
            live = needed;
            code.push(instruction(op, draft.scalar(program, d as usize), a, b));
        }
    }
    code.reverse();
    code
}
