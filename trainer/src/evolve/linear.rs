//! A linear policy as a team: what tuning alone starts from.

use tpg_runtime::isa::Op;

use super::{Action, Genes, Initial, Instruction, Population, Program, Source, Team, TeamId};
use crate::task::{ActionSpace, Rng};

/// Register of the gains on the observation; also that of the outputs.
const GAINS: u8 = 1;
/// Register of the offsets.
const OFFSETS: u8 = 2;
/// Register that remembers the last observation.
const LAST: u8 = 3;
/// Register of the gains on the last observation.
const LAST_GAINS: u8 = 4;

/// The operations that a linear policy needs.
#[must_use]
pub fn linear_ops(actions: ActionSpace, initial: Initial) -> Vec<Op> {
    let mut ops = match actions {
        ActionSpace::Continuous { len, .. } if len > 1 => vec![Op::MatVec, Op::VAdd],
        _ => vec![Op::Dot, Op::Add],
    };
    if initial == Initial::LinearHistory {
        ops.push(Op::VMax);
    }
    ops
}

/// Adds a team whose action is linear in the observation, with all constants zero; it is not a root yet.
///
/// Continuous actions: one program, action = G·o + c. Discrete ones: a program for each, whose bid is gᵀo + c. With
/// [`Initial::LinearHistory`] also in the observation of the decision before, which stateful programs remember.
#[must_use]
pub fn linear_team(
    population: &mut Population,
    genes: &Genes,
    initial: Initial,
    rng: &mut Rng,
) -> TeamId {
    let actions = match genes.shape.actions {
        ActionSpace::Discrete(actions) => actions,
        ActionSpace::Continuous { .. } => 1,
    };
    let instructions = code(genes, initial == Initial::LinearHistory);
    let zeros = |len| vec![0.0; if genes.constants { len } else { 0 }].into();
    let members = (0..actions)
        .map(|action| {
            population.add_program(Program {
                instructions: instructions.clone(),
                constants: zeros(genes.shape.program_constants()),
                offset: 0,
                action: Action::Atomic(action),
            })
        })
        .collect();
    let memory = if genes.team_memory {
        zeros(genes.shape.team_constants())
    } else {
        zeros(0)
    };
    population.add_team(Team {
        members,
        memory,
        stream_key: rng.word() as u32,
    })
}

fn code(genes: &Genes, history: bool) -> Vec<Instruction> {
    let instruction = |op, destination, a, b| Instruction {
        op,
        destination,
        a,
        b,
    };
    let (observation, register) = (Source::observation(0), Source::register);
    let (product, sum, output) = match genes.shape.actions {
        ActionSpace::Continuous { len, .. } if len > 1 => (Op::MatVec, Op::VAdd, 1),
        ActionSpace::Continuous { .. } => (Op::Dot, Op::Add, 1),
        // The bid chooses among discrete actions.
        ActionSpace::Discrete(_) => (Op::Dot, Op::Add, 0),
    };
    let mut code = vec![instruction(product, output, register(GAINS), observation)];
    if history {
        // A register of the outputs' kind that nothing else uses.
        let part = LAST_GAINS + 1;
        code.push(instruction(
            product,
            part,
            register(LAST_GAINS),
            register(LAST),
        ));
        code.push(instruction(sum, output, register(output), register(part)));
    }
    code.push(instruction(
        sum,
        output,
        register(output),
        register(OFFSETS),
    ));
    if history {
        code.push(instruction(Op::VMax, LAST, observation, observation));
    }
    code
}
