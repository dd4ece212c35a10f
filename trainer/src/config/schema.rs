//! The keys of a configuration.

use serde::{Deserialize, Serialize};

use crate::evolve::EvolutionParams;

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
    pub memory_writes: String,
}

/// How teams are scored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct EvaluationConfig {
    /// Training episodes of each new team.
    pub episodes: u32,
}
