//! Evolution: makes a population from a population, its scores and a random stream. Knows no tasks and scores nothing.

mod genome;
mod grow;
mod initial;
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
}
