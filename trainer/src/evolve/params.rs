//! The rates and sizes of evolution: T Tab 3.2, and `docs/semantics.md` where the thesis is silent.

use serde::{Deserialize, Serialize};

use super::Ties;
use crate::keys::{Key, by_name, is_default, named};

/// Most roots, and most children, of a generation.
pub(crate) const MOST_TEAMS: u64 = 1_000_000;
/// Most programs of a team.
pub(crate) const MOST_MEMBERS: u64 = 1000;
/// Most instructions of a program: a blob counts them in 16 bits.
const MOST_INSTRUCTIONS: u64 = 60_000;
/// Largest factor of a mutated constant.
const LARGEST_FACTOR: f64 = 1e6;

/// A range of sizes. The first generation draws its sizes evenly from `initial_min..=initial_max`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct SizeRange {
    /// Smallest size at the start.
    pub initial_min: u32,
    /// Largest size at the start.
    pub initial_max: u32,
    /// Largest size that variation makes. Linear policies, and what tuning adds, may be larger.
    pub max: u32,
}

impl SizeRange {
    /// The keys of a range of at most `max`.
    const fn keys(max: u64) -> [Key; 3] {
        [
            Key::whole("initial-min", 1, max),
            Key::whole("initial-max", 1, max),
            Key::whole("max", 1, max),
        ]
    }
}

/// What the first generation is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Initial {
    /// Random teams.
    #[default]
    Random,
    /// A linear policy with all constants zero, and random teams.
    Linear,
    /// The same. The policy is linear in the last observation too.
    LinearHistory,
}

impl Initial {
    /// Every value.
    pub const ALL: &'static [Self] = &[Self::Random, Self::Linear, Self::LinearHistory];

    /// The name used in configurations.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Linear => "linear",
            Self::LinearHistory => "linear-history",
        }
    }
}

named!(Initial);

/// How one generation is made from the last.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct EvolutionParams {
    /// What the first generation is made of.
    #[serde(with = "by_name", default, skip_serializing_if = "is_default")]
    pub initial: Initial,
    /// Root teams that survive a generation.
    pub population: u32,
    /// New root teams in a generation.
    pub children: u32,
    /// Teams drawn with replacement for a tournament. The best of them is a parent.
    pub tournament: u32,
    /// Who is preferred among teams of equal scores, in tournaments and for survival.
    #[serde(with = "by_name", default, skip_serializing_if = "is_default")]
    pub ties: Ties,
    /// How teams vary.
    pub team: TeamParams,
    /// How programs vary.
    pub program: ProgramParams,
    /// How evolved constants vary.
    pub constants: ConstantParams,
}

impl EvolutionParams {
    pub(crate) const KEYS: &[Key] = &[
        Key::name::<Initial>("initial"),
        Key::whole("population", 1, MOST_TEAMS),
        Key::whole("children", 0, MOST_TEAMS),
        Key::whole("tournament", 1, MOST_TEAMS),
        Key::name::<Ties>("ties"),
        Key::table("team", TeamParams::KEYS),
        Key::table("program", ProgramParams::KEYS),
        Key::table("constants", ConstantParams::KEYS),
    ];
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
    /// Whether a team that lost or gained a program may lose or gain another one. Each time the probability is multiplied by
    /// the rate (PyTPG).
    pub repeat: bool,
    /// Moving a program to another place in the order.
    pub reorder: f64,
    /// For each program: replacing it by a mutated clone. 0 stands for 1/size. At least one program is replaced.
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

impl TeamParams {
    const KEYS: &[Key] = &[
        Key::table("size", &SizeRange::keys(MOST_MEMBERS)),
        Key::rate("crossover"),
        Key::rate("inherit"),
        Key::rate("delete"),
        Key::rate("add"),
        Key::flag("repeat"),
        Key::rate("reorder"),
        Key::rate("mutate"),
        Key::rate("reset"),
        Key::rate("grow"),
        Key::rate("remember"),
    ];
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
    /// Whether a program that mutates is mutated again until something about it is different that can matter.
    #[serde(default, skip_serializing_if = "is_default")]
    pub insist: bool,
    /// A random instruction is a move or a latch, where the group of these is on. 0: they are drawn like all others.
    #[serde(default, skip_serializing_if = "is_default")]
    pub copies: f64,
}

impl ProgramParams {
    const KEYS: &[Key] = &[
        Key::table("size", &SizeRange::keys(MOST_INSTRUCTIONS)),
        Key::rate("code"),
        Key::rate("change"),
        Key::rate("swap"),
        Key::rate("delete"),
        Key::rate("add"),
        Key::rate("action"),
        Key::rate("atomic"),
        Key::rate("offset"),
        Key::flag("insist"),
        Key::rate("copies"),
    ];
}

/// How evolved constants vary (T §3.4.3).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct ConstantParams {
    /// Probability that a mutated program or team changes its constants. It then changes all of them.
    pub mutate: f64,
    /// Smallest factor.
    pub factor_min: f64,
    /// Largest factor.
    pub factor_max: f64,
    /// Probability, for each constant, of a flipped sign.
    pub flip: f64,
}

impl ConstantParams {
    const KEYS: &[Key] = &[
        Key::rate("mutate"),
        Key::number("factor-min", 0.0, LARGEST_FACTOR),
        Key::number("factor-max", 0.0, LARGEST_FACTOR),
        Key::rate("flip"),
    ];
}
