//! The first generation.

use super::genome::random_atomic;
use super::linear::linear_team;
use super::{
    Action, Constants, EvolutionParams, Genes, Initial, Instruction, Population, Program,
    ProgramId, ResetRule, SizeRange, Team,
};
use tpg_tasks::task::Rng;

impl Population {
    /// A first generation of random roots. Each has atomic programs of its own. With a linear [`Initial`] the first root is a
    /// linear policy.
    #[must_use]
    pub fn random(genes: &Genes, params: &EvolutionParams, rng: &mut Rng) -> Self {
        let mut population = Population::default();
        if params.initial != Initial::Random {
            let linear = linear_team(&mut population, genes, params.initial, rng);
            population.roots.push(linear);
        }
        while population.roots.len() < params.population as usize {
            let owned = genes.shape.separate_outputs();
            let size = initial_size(params.team.size, rng).max(usize::from(owned));
            // Where outputs have programs of their own, the first programs go to one output each.
            let actions = (0..owned).map(Some).chain(std::iter::repeat(None));
            let members: Vec<ProgramId> = actions
                .take(size)
                .map(|owned| {
                    let len = initial_size(params.program.size, rng);
                    let mut program = Program::random(genes, len, rng);
                    if let Some(output) = owned {
                        program.action = Action::Atomic(output);
                    }
                    population.add_program(program)
                })
                .collect();
            let programs = members.iter().map(|id| &**population.program(*id));
            let mut memory = Constants::default();
            genes.fit_memory(&mut memory, programs, rng);
            let root = population.add_team(Team {
                members,
                memory,
                stream_key: rng.word() as u32,
                reset_rule: genes.reset_rules.then(|| ResetRule::random(rng)),
            });
            population.roots.push(root);
        }
        population
    }
}

impl Program {
    /// A random program with an atomic action.
    #[must_use]
    pub fn random(genes: &Genes, len: usize, rng: &mut Rng) -> Self {
        let instructions: Vec<Instruction> =
            (0..len).map(|_| Instruction::random(genes, rng)).collect();
        Program {
            constants: genes.program_constants(&instructions, rng),
            instructions,
            offset: rng.below(u64::from(genes.shape.observed())) as u16,
            action: random_atomic(&genes.shape, rng),
        }
    }
}

fn initial_size(range: SizeRange, rng: &mut Rng) -> usize {
    let choices = u64::from(range.initial_max.saturating_sub(range.initial_min)) + 1;
    range.initial_min as usize + rng.below(choices) as usize
}
