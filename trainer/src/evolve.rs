//! Evolution: makes a population from a population, its scores and a random stream. Knows no tasks and scores nothing.

#[cfg(test)]
mod chances;
mod check;
mod constants;
mod dataflow;
mod fit;
mod genome;
mod grow;
mod initial;
mod linear;
mod params;
mod population;
mod registers;
mod remember;
mod rewrite;
mod select;
mod vary;

pub(crate) use check::LARGEST_COUNT;
pub use check::PopulationError;
pub use constants::Constants;
pub(crate) use constants::members;
pub(crate) use dataflow::{
    Demand, effective, initial_registers, register_read, register_written, slot_read,
};
pub use genome::{
    Action, ActionPrograms, Genes, Instruction, Program, ProgramId, ResetRule, Shape, Source, Team,
    TeamId,
};
pub use grow::grow;
pub use linear::{linear_inputs, linear_ops, linear_team};
pub use params::{ConstantParams, EvolutionParams, Initial, ProgramParams, SizeRange, TeamParams};
pub use population::Population;
pub use registers::Registers;
pub use remember::{memory_ops, remember};
pub use rewrite::{NewConstants, rewrite_constants};
pub use select::{Ties, rank, select};
pub use vary::{Child, Variation};

#[cfg(test)]
pub(crate) mod tests {
    use tpg_runtime::blob::RegisterMode;
    use tpg_runtime::isa::Group;

    use super::*;
    use tpg_tasks::task::ActionSpace;

    pub fn genes() -> Genes {
        Genes {
            shape: Shape {
                width: 4,
                inputs: 3,
                history: 1,
                actions: ActionSpace::Discrete(3),
                action_programs: ActionPrograms::Winner,
            },
            ops: Genes::ops_of(&[Group::Scalar, Group::Vector, Group::TeamMemory]),
            constants: true,
            register_mode: RegisterMode::Stateful,
            team_memory: true,
            reset_rules: true,
            copies: 0.0,
        }
    }

    /// The defaults in small, with operators that they leave off.
    pub fn params() -> EvolutionParams {
        let defaults = include_str!("../presets/defaults.toml");
        let mut table: toml::Table = defaults.parse().expect("well-formed");
        let evolution = table.remove("evolution").expect("a table");
        let mut params: EvolutionParams = evolution.try_into().expect("complete");
        (params.population, params.children) = (40, 20);
        params.team.reset = 0.1;
        (params.program.action, params.program.atomic) = (0.3, 0.5);
        params
    }

    /// Bytes that a random root takes on the heap, without what allocators and maps add.
    #[test]
    fn a_root_takes_little_memory() {
        let mut genes = genes();
        (genes.shape.width, genes.shape.inputs) = (11, 11);
        genes.ops = Genes::ops_of(&[
            Group::Scalar,
            Group::Vector,
            Group::Matrix,
            Group::Constants,
            Group::TeamMemory,
        ]);
        let mut params = params();
        params.population = 50;
        let exactly = |size| SizeRange {
            initial_min: size,
            initial_max: size,
            max: 96,
        };
        (params.team.size, params.program.size) = (exactly(10), exactly(30));
        let population = Population::random(&genes, &params, &mut tpg_tasks::task::Rng::new(1));
        let bytes = |constants: &Constants| 4 * constants.values().len();
        let programs = population.programs.values().map(|program| {
            assert_eq!(program.instructions.capacity(), program.instructions.len());
            size_of::<Program>()
                + program.instructions.len() * size_of::<Instruction>()
                + bytes(&program.constants)
        });
        let teams = population.teams.values().map(|team| {
            size_of::<Team>() + team.members.len() * size_of::<ProgramId>() + bytes(&team.memory)
        });
        let root = programs.chain(teams).sum::<usize>() / population.roots.len();
        assert!(root <= 20 * 1024, "{root} bytes");
    }
}
