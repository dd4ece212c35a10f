//! The keys of a configuration.

use serde::{Deserialize, Serialize};
use tpg_runtime::blob::WriteDistribution;

use crate::defaults::is_default;
use crate::evolve::{ActionPrograms, EvolutionParams};
use crate::front_end::FrontEndParams;
use crate::tune::TuningParams;
use tpg_tasks::eval::Shaping;

/// A complete configuration; `presets/defaults.toml` explains every key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Config {
    /// Name of the task, or path of the file that describes it.
    pub task: String,
    /// What the policy sees of it.
    pub observability: Vec<String>,
    /// What policies are made of.
    pub policy: PolicyConfig,
    /// How teams are scored.
    pub evaluation: EvaluationConfig,
    /// How populations are made from one another.
    pub evolution: EvolutionParams,
    /// How evolved constants are tuned.
    #[serde(default, skip_serializing_if = "TuningParams::is_default")]
    pub tuning: TuningParams,
    /// How the champion is chosen.
    #[serde(default, skip_serializing_if = "SelectionParams::is_default")]
    pub selection: SelectionParams,
    /// What policies learn to perceive.
    #[serde(default, skip_serializing_if = "FrontEndParams::is_default")]
    pub front_end: FrontEndParams,
}

/// What policies are made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct PolicyConfig {
    /// Vector width; 0 stands for the length of the observation, at least that of the action.
    pub width: u16,
    /// Instruction groups.
    pub groups: Vec<String>,
    /// Whether registers outlive a decision.
    pub register_mode: String,
    /// Where initial values come from.
    pub initial_values: String,
    /// When registers and memory are reset.
    pub reset_scope: String,
    /// What memory programs share.
    pub memory: String,
    /// Sections of team memory that programs may write and read.
    pub memory_sections: Vec<String>,
    /// With what probabilities writes reach the slots or cells of memory.
    #[serde(
        default = "as_in_the_thesis",
        skip_serializing_if = "is_as_in_the_thesis"
    )]
    pub memory_writes: String,
    /// Who gives the values of a continuous action.
    #[serde(default = "by_the_winner", skip_serializing_if = "is_by_the_winner")]
    pub action_programs: String,
}

/// How teams are scored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct EvaluationConfig {
    /// Training episodes of each new team.
    pub episodes: u32,
    /// Best teams that are scored again in each generation, all their scores of training averaged.
    #[serde(default, skip_serializing_if = "is_default")]
    pub elites: u32,
    /// What of the reward the fitness of training counts.
    #[serde(default, skip_serializing_if = "Shaping::is_default")]
    pub shaping: Shaping,
    /// Control steps after which training episodes end; 0 stands for the task's own limit.
    #[serde(default, skip_serializing_if = "is_default")]
    pub max_steps: u32,
    /// How blackouts become as frequent as the task says.
    #[serde(default, skip_serializing_if = "Curriculum::is_default")]
    pub curriculum: Curriculum,
}

/// Training begins with everything visible; blackouts come in equal stages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Curriculum {
    /// Environment steps of training after which blackouts are as frequent as the task says; 0: from the start.
    pub steps: u64,
    /// Stages before that; in stage k of n a blackout is k/n times as probable, k from 0.
    pub stages: u32,
}

impl Default for Curriculum {
    fn default() -> Self {
        Curriculum {
            steps: 0,
            stages: 4,
        }
    }
}

impl Curriculum {
    /// Whether nothing differs from the defaults, which configurations leave out.
    #[must_use]
    pub fn is_default(&self) -> bool {
        *self == Curriculum::default()
    }

    /// The stage that begins after so many steps; the last is that of the task itself.
    #[must_use]
    pub fn stage(&self, steps: u64) -> u32 {
        let stages = u64::from(self.stages);
        let reached = steps.saturating_mul(stages).checked_div(self.steps);
        reached.map_or(self.stages, |stage| stage.min(stages) as u32)
    }
}

/// The write distribution of the thesis, which configurations leave out.
const THESIS: &str = WriteDistribution::Thesis.name();

fn as_in_the_thesis() -> String {
    THESIS.to_owned()
}

fn is_as_in_the_thesis(distribution: &str) -> bool {
    distribution == THESIS
}

/// The action of the thesis, which configurations leave out.
const WINNER: &str = ActionPrograms::Winner.name();

fn by_the_winner() -> String {
    WINNER.to_owned()
}

fn is_by_the_winner(programs: &str) -> bool {
    programs == WINNER
}

/// How the champion is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct SelectionParams {
    /// Best teams in training that race for champion; 0 makes the best of them champion without a race.
    pub candidates: u32,
    /// Generations between two races.
    pub every: u32,
    /// Episodes after which a race ends.
    pub episodes: u32,
    /// Episodes between two looks at who can still win.
    pub batch: u32,
}

impl Default for SelectionParams {
    fn default() -> Self {
        SelectionParams {
            candidates: 0,
            every: 2,
            episodes: 40,
            batch: 5,
        }
    }
}

impl SelectionParams {
    /// Whether nothing differs from the defaults, which configurations leave out.
    #[must_use]
    pub fn is_default(&self) -> bool {
        *self == SelectionParams::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_are_equal_parts_of_the_steps_and_the_last_one_lasts() {
        let curriculum = Curriculum {
            steps: 1000,
            stages: 4,
        };
        let stages = [0, 249, 250, 999, 1000, u64::MAX].map(|steps| curriculum.stage(steps));
        assert_eq!(stages, [0, 0, 1, 3, 4, 4]);
        assert_eq!(Curriculum::default().stage(0), 4, "off");
    }
}
