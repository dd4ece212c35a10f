//! Evolution, pure: population, scores and a random stream in, population out.

mod genome;
mod grow;
mod linear;
mod params;
mod population;
mod remember;
mod rewrite;
mod select;
mod vary;

pub use genome::{
    Action, ActionPrograms, Genes, Instruction, Program, ProgramId, ResetRule, Shape, Source, Team,
    TeamId,
};
pub use grow::grow;
pub use linear::{linear_ops, linear_team};
pub use params::{ConstantParams, EvolutionParams, Initial, ProgramParams, SizeRange, TeamParams};
pub use population::Population;
pub use remember::{memory_ops, remember};
pub use rewrite::{Constants, rewrite_constants};
pub use select::{rank, select};
pub use vary::{Child, Variation};

#[cfg(test)]
pub(crate) mod tests {
    use tpg_runtime::isa::Group;

    use super::*;
    use tpg_tasks::task::ActionSpace;

    pub fn genes() -> Genes {
        Genes {
            shape: Shape {
                width: 4,
                inputs: 3,
                actions: ActionSpace::Discrete(3),
                action_programs: ActionPrograms::Winner,
            },
            ops: Genes::ops_of(&[Group::Scalar, Group::Vector, Group::TeamMemory]),
            constants: true,
            team_memory: true,
            reset_rules: true,
        }
    }

    pub fn params() -> EvolutionParams {
        EvolutionParams {
            initial: Initial::Random,
            population: 40,
            children: 20,
            tournament: 3,
            team: TeamParams {
                size: SizeRange {
                    initial_min: 1,
                    initial_max: 5,
                    max: 10,
                },
                crossover: 0.5,
                inherit: 0.5,
                delete: 0.1,
                add: 0.075,
                repeat: false,
                reorder: 0.1,
                mutate: 0.0,
                reset: 0.1,
                grow: 0.0,
                remember: 0.0,
            },
            program: ProgramParams {
                size: SizeRange {
                    initial_min: 1,
                    initial_max: 10,
                    max: 96,
                },
                code: 1.0,
                change: 0.1,
                swap: 0.1,
                delete: 0.1,
                add: 0.075,
                action: 0.3,
                atomic: 0.5,
                offset: 0.1,
            },
            constants: ConstantParams {
                mutate: 0.5,
                factor_min: 0.5,
                factor_max: 2.0,
                flip: 0.1,
            },
        }
    }
}
