//! A linear policy as a team, from which tuning can start.

use std::sync::Arc;

use tpg_runtime::isa::Op;
use tpg_runtime::tables::Section;

use super::{
    Action, Genes, Initial, Instruction, Population, Program, ResetRule, Shape, Source, Team,
    TeamId,
};
use tpg_tasks::task::Rng;

/// Register of the gains on the observation; also that of the outputs.
const GAINS: u8 = 1;
/// Register of the offsets.
const OFFSETS: u8 = 2;
/// Register that remembers the last observation.
const LAST: u8 = 3;
/// Register of the gains on the change since then.
const CHANGE_GAINS: u8 = 4;
/// Register of the change, and of its part in the output.
const CHANGE: u8 = 5;
/// Register of the factor that makes changes as large as what changes.
const RATE: u8 = 6;
/// Initial value of that factor. Changes from one decision to the next are small.
const INITIAL_RATE: f32 = 10.0;

/// The operations that a linear policy needs.
#[must_use]
pub fn linear_ops(shape: &Shape, initial: Initial) -> Vec<Op> {
    let mut ops = match shape.output_section() {
        Some(Section::Vector) => vec![Op::MatVec, Op::VAdd],
        _ => vec![Op::Dot, Op::Add],
    };
    if initial == Initial::LinearHistory {
        ops.extend([Op::VSub, Op::VScale, Op::VMax]);
    }
    ops
}

/// Adds a team whose action is linear in the observation o, with all gains zero. It is not yet a root.
///
/// For continuous actions it has one program, action = G·o + c. Where outputs have programs of their own it has one for each
/// output, gᵀo + c. For discrete actions it has a program for each action, with the bid gᵀo + c. With [`Initial::LinearHistory`]
/// the same is added for r·(o − o′). o′ is the observation of the decision before, which stateful programs remember. r is 10 at
/// first.
#[must_use]
pub fn linear_team(
    population: &mut Population,
    genes: &Genes,
    initial: Initial,
    rng: &mut Rng,
) -> TeamId {
    let instructions = code(genes, initial == Initial::LinearHistory);
    let zeros = |len| vec![0.0; if genes.constants { len } else { 0 }];
    let mut constants = zeros(genes.shape.program_constants());
    if let (Initial::LinearHistory, Some(rate)) = (initial, constants.get_mut(usize::from(RATE))) {
        *rate = INITIAL_RATE;
    }
    let constants: Arc<[f32]> = constants.into();
    let members = (0..genes.shape.atomic_actions())
        .map(|action| {
            population.add_program(Program {
                instructions: instructions.clone(),
                constants: Arc::clone(&constants),
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
        memory: memory.into(),
        stream_key: rng.word() as u32,
        reset_rule: genes.reset_rules.then(|| ResetRule::random(rng)),
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
    let (product, sum, output) = match genes.shape.output_section() {
        Some(Section::Scalar) => (Op::Dot, Op::Add, 1),
        Some(_) => (Op::MatVec, Op::VAdd, 1),
        // The bid chooses among discrete actions.
        None => (Op::Dot, Op::Add, 0),
    };
    let mut code = vec![instruction(product, output, register(GAINS), observation)];
    if history {
        let (change, last) = (register(CHANGE), register(LAST));
        code.extend([
            instruction(Op::VSub, CHANGE, observation, last),
            instruction(Op::VScale, CHANGE, register(RATE), change),
            instruction(product, CHANGE, register(CHANGE_GAINS), change),
            instruction(sum, output, register(output), change),
            instruction(Op::VMax, LAST, observation, observation),
        ]);
    }
    code.push(instruction(
        sum,
        output,
        register(output),
        register(OFFSETS),
    ));
    code
}

#[cfg(test)]
mod tests {
    use tpg_runtime::isa::Group;

    use super::*;
    use crate::evolve::ActionPrograms;
    use tpg_tasks::task::ActionSpace;

    #[test]
    fn it_uses_none_but_the_operations_that_it_says_it_needs() {
        let continuous = |len| ActionSpace::Continuous {
            len,
            low: -1.0,
            high: 1.0,
        };
        for (actions, action_programs) in [
            (ActionSpace::Discrete(3), ActionPrograms::Winner),
            (continuous(1), ActionPrograms::Winner),
            (continuous(4), ActionPrograms::Winner),
            (continuous(4), ActionPrograms::Each),
        ] {
            for initial in [Initial::Linear, Initial::LinearHistory] {
                let genes = Genes {
                    shape: Shape {
                        width: 5,
                        inputs: 5,
                        actions,
                        action_programs,
                    },
                    ops: Genes::ops_of(&[Group::Scalar, Group::Vector, Group::Matrix]),
                    constants: true,
                    team_memory: false,
                    reset_rules: false,
                };
                let mut population = Population::default();
                let root = linear_team(&mut population, &genes, initial, &mut Rng::new(1));
                let needed = linear_ops(&genes.shape, initial);
                let members = &population.team(root).members;
                assert!(population.is_team(members, &genes.shape));
                for member in members {
                    let program = population.program(*member);
                    for op in program.instructions.iter().map(|i| i.op) {
                        assert!(needed.contains(&op), "{op:?}");
                    }
                    let some = program.constants.iter().filter(|x| **x != 0.0);
                    assert_eq!(some.count(), usize::from(initial == Initial::LinearHistory));
                }
            }
        }
    }
}
