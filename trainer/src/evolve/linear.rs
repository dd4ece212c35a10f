//! A linear policy as a team, from which tuning can start.

use std::ops::RangeInclusive;

use tpg_runtime::isa::{Op, REGISTERS};
use tpg_runtime::tables::Section;

use super::{
    Action, Constants, Genes, Initial, Instruction, Population, Program, ResetRule, Shape, Source,
    Team, TeamId,
};
use tpg_tasks::task::Rng;

/// Register of the offsets.
const OFFSETS: u8 = 2;
/// Register of the change, and of a part of the output.
const CHANGE: u8 = 5;
/// Register of the factor that makes changes as large as what changes.
const RATE: u8 = 6;
/// Initial value of that factor. Changes from one decision to the next are small.
const INITIAL_RATE: f32 = 10.0;

/// Register of a part of the output where outputs fill several vectors.
const PART: u8 = 0;

/// Registers for each window of the observation, in the order in which windows take them.
struct Layout {
    /// Registers of the outputs.
    outputs: RangeInclusive<u8>,
    /// Gains on the window.
    gains: &'static [u8],
    /// The window as it was observed last; empty without history.
    last: &'static [u8],
    /// Gains on the change since then.
    change_gains: &'static [u8],
}

impl Layout {
    /// Gains lie in matrices where the output is a vector, else in vectors, which then serve all purposes.
    fn new(shape: &Shape, history: bool) -> Self {
        let matrices = shape.output_section() == Some(Section::Vector);
        let outputs = match shape.output_section() {
            Some(_) => shape.output_registers(),
            // The bid chooses among discrete actions.
            None => 0..=0,
        };
        let (gains, last, change_gains): (&[u8], &[u8], &[u8]) = match (history, matrices) {
            (false, _) => (&[1, 0, 2, 3, 4, 5, 6, 7], &[], &[]),
            (true, true) => (&[1, 0, 2, 3], &[3, 0, 4, 6], &[4, 5, 6, 7]),
            (true, false) => (&[1, 0], &[3, 2], &[4, 6]),
        };
        Layout {
            outputs,
            gains,
            last,
            change_gains,
        }
    }

    /// The register of the offsets of some outputs. Where outputs fill more vectors than half of the registers, they have none.
    fn offsets(&self, output: u8) -> Option<u8> {
        let vectors = self.outputs.len() as u8;
        match vectors {
            1 => Some(OFFSETS),
            _ => Some(output + vectors).filter(|_| 2 * vectors < REGISTERS as u8),
        }
    }

    /// Where windows of the observation begin. Together they cover it, as far as registers reach.
    fn windows(&self, shape: &Shape) -> impl Iterator<Item = u16> + use<> {
        let (width, inputs) = (shape.width, shape.observed());
        let needed = inputs.div_ceil(width).max(1);
        let most = (self.gains.len() / self.outputs.len()).max(1);
        let last = inputs.saturating_sub(width);
        // The last one overlaps the one before it, so that no input is seen twice for running over the end.
        (0..needed.min(most as u16)).map(move |k| (k * width).min(last))
    }
}

/// How many elements of the observations a linear policy sees, from the first on: all, unless they need more registers than there
/// are.
#[must_use]
pub fn linear_inputs(shape: &Shape, initial: Initial) -> u16 {
    let layout = Layout::new(shape, initial == Initial::LinearHistory);
    let last = layout.windows(shape).last().unwrap_or(0);
    shape.observed().min(last + shape.width)
}

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
///
/// An observation longer than W is seen in windows of W, whose products are added. Registers limit their number, see
/// [`linear_inputs`]. Outputs that fill several vectors have a product each, and no history.
#[must_use]
pub fn linear_team(
    population: &mut Population,
    genes: &Genes,
    initial: Initial,
    rng: &mut Rng,
) -> TeamId {
    let (shape, history) = (&genes.shape, initial == Initial::LinearHistory);
    let instructions = code(shape, history);
    let mut constants = Constants::default();
    if genes.constants {
        let registers = genes.initial_registers(&instructions);
        constants = Constants::new(registers, shape.width, || 0.0);
        if history {
            constants.set(Section::Scalar, RATE, shape.width, || INITIAL_RATE);
        }
    }
    let members = (0..shape.atomic_actions())
        .map(|action| {
            population.add_program(Program {
                instructions: instructions.clone(),
                constants: constants.clone(),
                offset: 0,
                action: Action::Atomic(action),
            })
        })
        .collect();
    population.add_team(Team {
        members,
        // Its programs read no memory.
        memory: Constants::default(),
        stream_key: rng.word() as u32,
        reset_rule: genes.reset_rules.then(|| ResetRule::random(rng)),
    })
}

fn code(shape: &Shape, history: bool) -> Vec<Instruction> {
    let instruction = |op, destination, a, b| Instruction {
        op,
        destination,
        a,
        b,
    };
    let (window, register) = (Source::observation, Source::register);
    let (product, sum) = match shape.output_section() {
        Some(Section::Vector) => (Op::MatVec, Op::VAdd),
        _ => (Op::Dot, Op::Add),
    };
    let layout = Layout::new(shape, history);
    let vectors = layout.outputs.len();
    let mut code = Vec::new();
    let windows = layout.windows(shape).enumerate();
    let parts = windows.flat_map(|(k, start)| {
        let outputs = layout.outputs.clone().enumerate();
        outputs.map(move |(j, output)| (k, start, k * vectors + j, output))
    });
    for (k, start, gains, output) in parts {
        let add = |part| instruction(sum, output, register(output), register(part));
        let part = if vectors == 1 { CHANGE } else { PART };
        // The first product sets the output, all others are added.
        let destination = if k == 0 { output } else { part };
        let gains = register(layout.gains[gains]);
        code.push(instruction(product, destination, gains, window(start)));
        if k > 0 {
            code.push(add(part));
        }
        if history {
            let (change, last) = (register(CHANGE), layout.last[k]);
            let gains = register(layout.change_gains[k]);
            code.extend([
                instruction(Op::VSub, CHANGE, window(start), register(last)),
                instruction(Op::VScale, CHANGE, register(RATE), change),
                instruction(product, CHANGE, gains, change),
                add(CHANGE),
                instruction(Op::VMax, last, window(start), window(start)),
            ]);
        }
    }
    for output in layout.outputs.clone() {
        if let Some(offsets) = layout.offsets(output) {
            code.push(instruction(
                sum,
                output,
                register(output),
                register(offsets),
            ));
        }
    }
    code
}

#[cfg(test)]
mod tests {
    use tpg_runtime::blob::RegisterMode;
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
                        history: 1,
                        actions,
                        action_programs,
                    },
                    ops: Genes::ops_of(&[Group::Scalar, Group::Vector, Group::Matrix]),
                    constants: true,
                    register_mode: RegisterMode::Stateful,
                    team_memory: false,
                    reset_rules: false,
                    copies: 0.0,
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
                    let some = program.constants.values().iter().filter(|x| **x != 0.0);
                    assert_eq!(some.count(), usize::from(initial == Initial::LinearHistory));
                }
            }
        }
    }

    #[test]
    fn windows_cover_as_many_inputs_as_registers_allow() {
        let mut shape = Shape {
            width: 32,
            inputs: 105,
            history: 1,
            actions: ActionSpace::Continuous {
                len: 8,
                low: -1.0,
                high: 1.0,
            },
            action_programs: ActionPrograms::Winner,
        };
        let windows = |shape: &Shape, history| -> Vec<u16> {
            Layout::new(shape, history).windows(shape).collect()
        };
        assert_eq!(windows(&shape, false), [0, 32, 64, 73]);
        assert_eq!(linear_inputs(&shape, Initial::Linear), 105);
        assert_eq!(linear_inputs(&shape, Initial::LinearHistory), 105);
        shape.action_programs = ActionPrograms::Each;
        assert_eq!(linear_inputs(&shape, Initial::LinearHistory), 64);
        (shape.inputs, shape.action_programs) = (348, ActionPrograms::Winner);
        assert_eq!(linear_inputs(&shape, Initial::Linear), 256);
        assert_eq!(linear_inputs(&shape, Initial::LinearHistory), 128);
        (shape.inputs, shape.width) = (3, 5);
        assert_eq!(windows(&shape, true), [0]);
    }
}
