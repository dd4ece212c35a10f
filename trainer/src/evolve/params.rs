//! The rates and sizes of evolution (T Tab 3.2; the rest as `docs/semantics.md` decides).

use serde::{Deserialize, Serialize};

use crate::defaults::is_default;

/// An inclusive range of sizes, drawn evenly at the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct SizeRange {
    /// Smallest size at the start.
    pub initial_min: u32,
    /// Largest size at the start.
    pub initial_max: u32,
    /// Largest size ever.
    pub max: u32,
}

/// What the first generation is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Initial {
    /// Random teams.
    #[default]
    Random,
    /// A linear policy with all constants zero, and random teams.
    Linear,
    /// The same, linear in this observation and the last one.
    LinearHistory,
}

impl Initial {
    /// Whether it is the default, which configurations leave out.
    #[must_use]
    pub fn is_default(&self) -> bool {
        *self == Initial::default()
    }
}

/// How populations are made from one another.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct EvolutionParams {
    /// What the first generation is made of.
    #[serde(default, skip_serializing_if = "Initial::is_default")]
    pub initial: Initial,
    /// Root teams that survive a generation.
    pub population: u32,
    /// New root teams in a generation.
    pub children: u32,
    /// Contestants of a tournament, drawn with replacement; the best is a parent.
    pub tournament: u32,
    /// How teams vary.
    pub team: TeamParams,
    /// How programs vary.
    pub program: ProgramParams,
    /// How evolved constants vary.
    pub constants: ConstantParams,
}

/// How teams vary; rates are probabilities for each new team.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct TeamParams {
    /// Number of programs.
    pub size: SizeRange,
    /// Two parents instead of one.
    pub crossover: f64,
    /// For each program of both parents: the child inherits it.
    pub inherit: f64,
    /// Losing a program.
    pub delete: f64,
    /// Gaining a program of the population.
    pub add: f64,
    /// Goes on losing and gaining while it succeeds, the probability multiplied by itself each time (PyTPG).
    pub repeat: bool,
    /// Moving a program to another place in the order.
    pub reorder: f64,
    /// For each program: replacing it by a mutated clone; 0 stands for 1/size. At least one is replaced.
    pub mutate: f64,
    /// Drawing a new rule of resets, in a run where agents evolve it.
    #[serde(default, skip_serializing_if = "is_default")]
    pub reset: f64,
    /// Cloning a program inside the team, with a bid of its own.
    #[serde(default, skip_serializing_if = "is_default")]
    pub grow: f64,
    /// Giving a program of the team a memory of what it has observed.
    #[serde(default, skip_serializing_if = "is_default")]
    pub remember: f64,
}

/// How programs vary; rates are probabilities for each program that is mutated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct ProgramParams {
    /// Number of instructions.
    pub size: SizeRange,
    /// Varying the code at all, before the four rates below.
    pub code: f64,
    /// Changing one field of an instruction, or all of it.
    pub change: f64,
    /// Swapping two instructions.
    pub swap: f64,
    /// Losing an instruction.
    pub delete: f64,
    /// Gaining a random instruction.
    pub add: f64,
    /// Drawing a new action pointer.
    pub action: f64,
    /// A new action pointer leads to the plant, not to a team.
    pub atomic: f64,
    /// Drawing a new observation offset.
    pub offset: f64,
}

/// How evolved constants vary (T §3.4.3).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct ConstantParams {
    /// Probability that a mutated program or team changes its constants, then all of them.
    pub mutate: f64,
    /// Smallest factor.
    pub factor_min: f64,
    /// Largest factor.
    pub factor_max: f64,
    /// Probability, for each constant, of a flipped sign.
    pub flip: f64,
}
