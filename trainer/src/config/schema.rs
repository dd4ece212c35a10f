//! The keys of a configuration, with the values that each takes.

use serde::{Deserialize, Serialize};
use toml::{Table, Value};
use tpg_runtime::MAX_WIDTH;
use tpg_runtime::blob::{InitialValues, MemoryModel, RegisterMode, ResetScope, WriteDistribution};
use tpg_runtime::isa::Group;
use tpg_runtime::tables::Section;

use super::error::ConfigError;
use crate::evolve::{ActionPrograms, EvolutionParams};
use crate::front_end::FrontEndParams;
use crate::keys::{Key, Named, Values, by_name, by_names, is_default, named};
use crate::tune::TuningParams;
use tpg_tasks::eval::{Disturbance, Shaping};
use tpg_tasks::task::Observability;

/// Most episodes of an agent in a generation, or in a race.
const MOST_EPISODES: u64 = 1_000_000;
/// Most teams that are scored again or race in a generation.
const MOST_TEAMS: u64 = 1_000_000;
/// Largest factor of a reward term, either sign.
const LARGEST_FACTOR: f64 = 1e6;

/// A complete configuration. `presets/defaults.toml` explains every key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Config {
    /// Name of the task, or path of the file that describes it.
    pub task: String,
    /// What the policy sees of it: what hides a part of the observation, in the order in which it is applied.
    #[serde(with = "observabilities")]
    pub observability: Vec<Observability>,
    /// What policies are made of.
    pub policy: PolicyConfig,
    /// How teams are scored.
    pub evaluation: EvaluationConfig,
    /// How one generation is made from the last.
    pub evolution: EvolutionParams,
    /// How evolved constants are tuned.
    #[serde(default, skip_serializing_if = "is_default")]
    pub tuning: TuningParams,
    /// How the champion is chosen.
    #[serde(default, skip_serializing_if = "is_default")]
    pub selection: SelectionParams,
    /// What front ends learn.
    #[serde(default, skip_serializing_if = "is_default")]
    pub front_end: FrontEndParams,
}

impl Config {
    pub(super) const KEYS: &[Key] = &[
        Key::new("task", Values::Text),
        Key::new(
            "observability",
            Values::Texts(|text| parse(text).map(drop).map_err(|e| e.to_string())),
        ),
        Key::table("policy", PolicyConfig::KEYS),
        Key::table("evaluation", EvaluationConfig::KEYS),
        Key::table("evolution", EvolutionParams::KEYS),
        Key::table("tuning", TuningParams::KEYS),
        Key::table("selection", SelectionParams::KEYS),
        Key::table("front-end", FrontEndParams::KEYS),
    ];
}

/// Refuses a table in which a value is of the wrong type or outside of its bounds. Keys may be missing.
pub(super) fn check(table: &Table) -> Result<(), ConfigError> {
    check_keys(table, Config::KEYS, "")
}

fn check_keys(table: &Table, keys: &[Key], prefix: &str) -> Result<(), ConfigError> {
    for key in keys {
        let Some(value) = table.get(key.name) else {
            continue;
        };
        let full = format!("{prefix}{}", key.name);
        if let Some(why) = key.values.refuse(value) {
            return Err(ConfigError::value(&full, value, why));
        }
        if let (Values::Table(keys), Value::Table(inner)) = (key.values, value) {
            check_keys(inner, keys, &format!("{full}."))?;
        }
    }
    Ok(())
}

/// What policies are made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct PolicyConfig {
    /// Vector width W. 0 stands for the length of the observation, all of the history included, or that of the action, whichever is
    /// larger.
    pub width: u16,
    /// How many of the last observations programs see, the newest first; 1 for the newest alone.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub history: u16,
    /// Instruction groups.
    #[serde(with = "by_names")]
    pub groups: Vec<Group>,
    /// Whether registers outlive a decision.
    #[serde(with = "by_name")]
    pub register_mode: RegisterMode,
    /// Where initial values come from.
    #[serde(with = "by_name")]
    pub initial_values: InitialValues,
    /// When registers and memory are reset.
    #[serde(with = "by_name")]
    pub reset_scope: Resets,
    /// What memory programs share.
    #[serde(with = "by_name")]
    pub memory: MemoryModel,
    /// Sections of team memory that programs may write and read.
    #[serde(with = "by_names")]
    pub memory_sections: Vec<Section>,
    /// With what probabilities writes reach the slots or cells of memory.
    #[serde(
        with = "by_name",
        default = "writes_of_the_thesis",
        skip_serializing_if = "are_writes_of_the_thesis"
    )]
    pub memory_writes: WriteDistribution,
    /// Which programs give the values of a continuous action.
    #[serde(with = "by_name", default, skip_serializing_if = "is_default")]
    pub action_programs: ActionPrograms,
}

impl PolicyConfig {
    const KEYS: &[Key] = &[
        Key::whole("width", 0, MAX_WIDTH as u64),
        Key::whole("history", 1, u16::MAX as u64),
        Key::names::<Group>("groups"),
        Key::name::<RegisterMode>("register-mode"),
        Key::name::<InitialValues>("initial-values"),
        Key::name::<Resets>("reset-scope"),
        Key::name::<MemoryModel>("memory"),
        Key::names::<Section>("memory-sections"),
        Key::name::<WriteDistribution>("memory-writes"),
        Key::name::<ActionPrograms>("action-programs"),
    ];
}

fn one() -> u16 {
    1
}

fn is_one(number: &u16) -> bool {
    *number == 1
}

fn writes_of_the_thesis() -> WriteDistribution {
    WriteDistribution::Thesis
}

fn are_writes_of_the_thesis(distribution: &WriteDistribution) -> bool {
    *distribution == WriteDistribution::Thesis
}

/// Who decides when registers and memory are reset.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resets {
    /// The run, once for all policies.
    Fixed(ResetScope),
    /// The run: one memory for the population, wiped when the median score falls (T §2.7).
    OnFall,
    /// Each policy, as it evolved (T §2.7).
    Evolved,
}

impl Resets {
    /// What policies say of themselves, unless they evolved a rule of their own.
    #[must_use]
    pub const fn scope(self) -> ResetScope {
        match self {
            Resets::Fixed(scope) => scope,
            Resets::OnFall => ResetScope::Original,
            Resets::Evolved => ResetScope::PerAgent,
        }
    }
}

impl Named for Resets {
    fn all() -> Vec<Self> {
        let fixed = ResetScope::ALL.iter().copied().map(Resets::Fixed);
        fixed.chain([Resets::OnFall, Resets::Evolved]).collect()
    }

    fn name(self) -> &'static str {
        match self {
            Resets::Fixed(scope) => scope.name(),
            Resets::OnFall => "on-fall",
            Resets::Evolved => "evolved",
        }
    }
}

named!(RegisterMode InitialValues MemoryModel WriteDistribution Group);

impl Named for Section {
    fn all() -> Vec<Self> {
        Section::ALL.to_vec()
    }

    fn name(self) -> &'static str {
        match self {
            Section::Scalar => "scalar",
            Section::Vector => "vector",
            Section::Matrix => "matrix",
        }
    }
}

/// How teams are scored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct EvaluationConfig {
    /// Training episodes of each new team.
    pub episodes: u32,
    /// Best teams that are scored again in each generation. A team's score is the mean over all its episodes of training.
    #[serde(default, skip_serializing_if = "is_default")]
    pub elites: u32,
    /// Episodes after which a new team that lies far behind all survivors plays no more, at least 2. 0: all play all episodes.
    #[serde(default, skip_serializing_if = "is_default")]
    pub drop_after: u32,
    /// What of the reward the fitness of training counts.
    #[serde(default, skip_serializing_if = "is_default")]
    pub shaping: Shaping,
    /// Control steps after which training episodes end. 0 stands for the task's own limit, which holds in any case.
    #[serde(default, skip_serializing_if = "is_default")]
    pub max_steps: u32,
    /// How blackouts become as frequent as the task says.
    #[serde(default, skip_serializing_if = "is_default")]
    pub curriculum: Curriculum,
    /// What happens to observations and actions on their way, in order.
    #[serde(default, skip_serializing_if = "is_default", with = "disturbances")]
    pub disturb: Vec<Disturbance>,
}

impl EvaluationConfig {
    const KEYS: &[Key] = &[
        Key::whole("episodes", 1, MOST_EPISODES),
        Key::whole("elites", 0, MOST_TEAMS),
        Key::whole("drop-after", 0, MOST_EPISODES),
        Key::table(
            "shaping",
            &[
                Key::number("alive", -LARGEST_FACTOR, LARGEST_FACTOR),
                Key::number("control", -LARGEST_FACTOR, LARGEST_FACTOR),
            ],
        ),
        Key::whole("max-steps", 0, 1_000_000_000),
        Key::table("curriculum", Curriculum::KEYS),
        Key::new(
            "disturb",
            Values::Texts(|text| {
                let disturbance = text.parse::<Disturbance>();
                disturbance.map(drop).map_err(|e| e.to_string())
            }),
        ),
    ];
}

/// Training begins with everything visible. Blackouts come in equal stages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Curriculum {
    /// Environment steps of training after which blackouts are as frequent as the task says. 0: from the start.
    pub steps: u64,
    /// Number n of stages before that. In stage k, counted from 0, a blackout is k/n times as probable.
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
    const KEYS: &[Key] = &[
        Key::whole("steps", 0, 1_000_000_000_000_000),
        Key::whole("stages", 1, 1000),
    ];

    /// The stage after this many environment steps. The last one, number `stages`, is the task itself.
    #[must_use]
    pub fn stage(&self, steps: u64) -> u32 {
        let stages = u64::from(self.stages);
        let reached = steps.saturating_mul(stages).checked_div(self.steps);
        reached.map_or(self.stages, |stage| stage.min(stages) as u32)
    }
}

/// How the champion is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct SelectionParams {
    /// Best teams in training that race for champion. 0: the best team in training is champion, without a race.
    pub candidates: u32,
    /// Generations between two races.
    pub every: u32,
    /// Episodes after which a race ends.
    pub episodes: u32,
    /// Episodes after which, again and again, those that can no longer win leave the race.
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
    const KEYS: &[Key] = &[
        Key::whole("candidates", 0, MOST_TEAMS),
        Key::whole("every", 1, 1_000_000_000),
        Key::whole("episodes", 1, MOST_EPISODES),
        Key::whole("batch", 1, MOST_EPISODES),
    ];
}

/// Reads one entry of `observability`, which may join several with `+`.
fn parse(text: &str) -> Result<Vec<Observability>, tpg_tasks::task::ObservabilityError> {
    text.split('+').map(str::parse).collect()
}

/// Writes and reads what hides parts of the observation as a list of texts.
mod observabilities {
    use serde::{Deserialize as _, Deserializer, Serializer, de::Error as _};

    use super::{Observability, parse};

    pub fn serialize<S: Serializer>(
        list: &[Observability],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(list.iter().map(ToString::to_string))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<Observability>, D::Error> {
        let mut list = Vec::new();
        for text in Vec::<String>::deserialize(deserializer)? {
            list.extend(parse(&text).map_err(D::Error::custom)?);
        }
        Ok(list)
    }
}

/// Writes and reads disturbances as a list of texts.
mod disturbances {
    use serde::{Deserialize as _, Deserializer, Serializer, de::Error as _};

    use super::Disturbance;

    pub fn serialize<S: Serializer>(
        list: &[Disturbance],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(list.iter().map(ToString::to_string))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<Disturbance>, D::Error> {
        let texts = Vec::<String>::deserialize(deserializer)?;
        let parsed = texts.iter().map(|text| text.parse());
        parsed.collect::<Result<_, _>>().map_err(D::Error::custom)
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
