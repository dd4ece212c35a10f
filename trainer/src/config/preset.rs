//! Presets: a task, a variant of the thesis, and how often the observation is blank.

use toml::Table;

use super::error::ConfigError;
use crate::keys::nearest;

/// The defaults that every preset starts from.
pub(super) const DEFAULTS: &str = include_str!("../../presets/defaults.toml");

/// A TOML file's table.
pub(super) fn parse(text: &str) -> Result<Table, ConfigError> {
    Ok(text.parse::<Table>()?)
}

macro_rules! file {
    ($folder:literal, $name:literal) => {
        include_str!(concat!("../../presets/", $folder, "/", $name, ".toml"))
    };
}

macro_rules! variants {
    ($($name:literal)*) => {
        &[$(($name, file!("variants", $name)),)*]
    };
}

/// A part of presets' names, and the text of the settings that it stands for.
type Part = (&'static str, &'static str);

/// The thesis's variants of chapter 3 (T Tab 3.1).
const VARIANTS: &[Part] = variants!("sl-nc" "sl" "sr" "sr-sm");
/// Chapter 3's future work (T §3.8, §2.7).
const FURTHER: &[Part] = variants!("sr-mm" "sr-sm-whole" "sr-sm-uniform" "sr-sm-exchanged");
/// Chapter 2's strategies (T Alg 1) and future work (T §2.7).
const STRATEGIES: &[Part] = variants!("original" "per-generation" "per-agent" "per-episode" "no-memory"
    "on-fall" "evolved-resets" "per-episode-uniform" "per-episode-exchanged");
/// What is measured against beyond the thesis (docs/learning.md).
const BASELINES: &[Part] = variants!("linear");
/// What pays on tasks that cannot be solved without memory (docs/memory.md).
const MEMORY: &[Part] = variants!("memory");
/// What pays on robots that no preset knows (docs/learning.md).
const CHAMPION: Part = ("champion", file!("variants", "champion"));
/// What it has besides where observations are blank.
const CHAMPION_BLACKOUT: &str = file!("variants", "champion-blackout");
/// Suffix and observability; without a suffix the task's own holds.
const BLACKOUTS: &[Part] = &[("", ""), ("-b23", "blackout:2/3"), ("-b13", "blackout:1/3")];

/// A task that has presets.
struct TaskRow {
    /// Its full name; presets have it without the version.
    task: &'static str,
    /// Which of the defaults it overrides.
    settings: &'static str,
    variants: &'static [&'static [Part]],
    /// Variants that have no presets with blackouts.
    plain: &'static [Part],
    /// Settings of its champion (docs/learning.md), by the suffix of the observability for which it is tuned.
    champions: &'static [Part],
}

/// One of chapter 2's tasks, whose champions are tuned for hidden velocities.
macro_rules! classic {
    ($name:literal) => {
        TaskRow {
            task: concat!($name, "-v1"),
            settings: file!("tasks", $name),
            variants: &[VARIANTS, FURTHER, STRATEGIES, BASELINES],
            plain: &[],
            champions: &[("", file!("champions", $name))],
        }
    };
}

/// A robot with settings for its champion with full sight, and perhaps for that under blackouts.
macro_rules! robot {
    ($task:literal, $settings:expr, $variants:expr, $champion:literal $(, $blackout:literal)?) => {
        TaskRow {
            task: $task,
            settings: $settings,
            variants: $variants,
            plain: &[],
            champions: &[
                ("", file!("champions", $champion)),
                $(("-b23", file!("champions", $blackout)),)?
            ],
        }
    };
}

/// A task that cannot be solved without memory.
macro_rules! memory {
    ($name:literal) => {
        TaskRow {
            task: concat!($name, "-v1"),
            settings: "",
            variants: &[],
            plain: MEMORY,
            champions: &[],
        }
    };
}

/// The double pendulum has its own sizes of populations (T Tab 3.2).
const DOUBLE_PENDULUM: &str = file!("tasks", "inverted-double-pendulum");
/// Robots of chapter 3.
const CHAPTER_3: &[&[Part]] = &[VARIANTS, FURTHER, BASELINES];
/// The variants of all other robots.
const OTHERS: &[&[Part]] = &[VARIANTS, BASELINES];

#[rustfmt::skip] // A row a task.
const TASKS: &[TaskRow] = &[
    robot!("inverted-double-pendulum-v4", DOUBLE_PENDULUM, CHAPTER_3, "inverted-double-pendulum", "inverted-double-pendulum-b23"),
    robot!("hopper-v4", "", CHAPTER_3, "hopper", "hopper-b23"),
    robot!("half-cheetah-v4", "", CHAPTER_3, "half-cheetah", "half-cheetah-b23"),
    classic!("cartpole"),
    classic!("acrobot"),
    classic!("pendulum"),
    robot!("inverted-double-pendulum-skip1-v1", DOUBLE_PENDULUM, OTHERS, "inverted-double-pendulum", "inverted-double-pendulum-skip1-b23"),
    robot!("hopper-skip1-v1", "", OTHERS, "hopper", "hopper-b23"),
    robot!("half-cheetah-skip1-v1", "", OTHERS, "half-cheetah", "half-cheetah-b23"),
    robot!("inverted-pendulum-v5", "", OTHERS, "inverted-pendulum"),
    robot!("walker2d-v5", "", OTHERS, "walker2d"),
    robot!("swimmer-v5", "", OTHERS, "swimmer"),
    robot!("reacher-v5", "", OTHERS, "reacher"),
    robot!("pusher-v5", "", OTHERS, "pusher"),
    robot!("ant-v5", "", OTHERS, "ant"),
    robot!("humanoid-v5", "", OTHERS, "humanoid"),
    robot!("humanoid-standup-v5", "", OTHERS, "humanoid"),
    memory!("tmaze"),
    memory!("noisy-tmaze"),
    memory!("memory-len"),
    memory!("memory-size"),
    memory!("repeat-first"),
    memory!("repeat-previous"),
    memory!("autoencode"),
    memory!("count-recall"),
    memory!("position-only-cartpole"),
    memory!("position-only-pendulum"),
    memory!("noisy-position-only-cartpole"),
    memory!("noisy-position-only-pendulum"),
    memory!("mackey-glass"),
    memory!("lorenz"),
];

/// A named configuration, `<task>-<variant>[-b23|-b13]`, `<task>-champion[-b23]` or `<task>-memory`, or `<variant>[-b23|-b13]` and
/// `champion[-b23|-b13]` for a task that the user names.
#[derive(Debug, Clone, PartialEq)]
pub struct Preset {
    /// Its name.
    pub name: String,
    /// Bare name of the task; empty for one that the user names.
    pub task: &'static str,
    /// Name of the variant (T Tab 3.1), `linear`, `memory` or `champion`.
    pub variant: &'static str,
    /// What the policy sees, in canonical form.
    pub observability: String,
    /// What it is, in a sentence without a full stop: how the file of its variant or champion begins.
    pub about: String,
    /// Overrides of the defaults, in order.
    pub(super) layers: Vec<Table>,
}

impl Preset {
    /// The preset of this name, those without a task included.
    ///
    /// # Errors
    /// [`ConfigError::UnknownPreset`] with the nearest name.
    pub fn find(name: &str) -> Result<Self, ConfigError> {
        let mut all = presets()?;
        for (variant, file) in [VARIANTS, FURTHER, STRATEGIES, BASELINES, MEMORY].concat() {
            all.extend(blackouts("", None, variant, file)?);
        }
        for mut preset in blackouts("", None, CHAMPION.0, CHAMPION.1)? {
            if preset.name != CHAMPION.0 {
                preset.layers.push(parse(CHAMPION_BLACKOUT)?);
            }
            all.push(preset);
        }
        let names = || all.iter().map(|p| p.name.as_str());
        // Who names a task wants what works best on it.
        let champion = format!("{name}-{}", CHAMPION.0);
        let suggestion = match names().any(|known| known == champion) {
            true => champion,
            false => nearest(name, names()),
        };
        all.into_iter()
            .find(|p| p.name == name)
            .ok_or_else(|| ConfigError::UnknownPreset {
                name: name.into(),
                suggestion,
            })
    }
}

/// Every preset, tasks in the order of the thesis's tables.
///
/// # Errors
/// [`ConfigError`] if a file of presets is malformed, which a test excludes.
pub fn presets() -> Result<Vec<Preset>, ConfigError> {
    let mut presets = Vec::new();
    for row in TASKS {
        let name = row
            .task
            .rsplit_once("-v")
            .map_or(row.task, |(bare, _)| bare);
        let mut task_layer = parse(row.settings)?;
        task_layer.insert("task".into(), row.task.into());
        for (variant, file) in row.variants.concat() {
            presets.extend(blackouts(name, Some(&task_layer), variant, file)?);
        }
        for (variant, file) in row.plain {
            let all = blackouts(name, Some(&task_layer), variant, file)?;
            presets.extend(all.into_iter().take(1));
        }
        for (suffix, file) in row.champions {
            let all = blackouts(name, Some(&task_layer), CHAMPION.0, file)?;
            let wanted = format!("{name}-{}{suffix}", CHAMPION.0);
            presets.extend(all.into_iter().filter(|preset| preset.name == wanted));
        }
    }
    Ok(presets)
}

/// The first sentence of the comment at the head of a file.
fn about(file: &str) -> String {
    let comment = file.lines().map_while(|line| line.strip_prefix('#'));
    let comment = comment.map(str::trim).collect::<Vec<_>>().join(" ");
    let sentence = comment.split(". ").next().unwrap_or_default();
    sentence.trim_end_matches('.').to_owned()
}

/// The presets of a task and a variant, one for each observability; without a task, the variant's alone.
fn blackouts(
    task: &'static str,
    task_layer: Option<&Table>,
    variant: &'static str,
    file: &str,
) -> Result<Vec<Preset>, ConfigError> {
    let variant_layer = &parse(file)?;
    let mut presets = Vec::new();
    for (suffix, blackout) in BLACKOUTS {
        let own = task_layer.and_then(|t| t.get("observability")?.as_array());
        let mut observability: Vec<String> = own
            .into_iter()
            .flatten()
            .filter_map(|o| Some(o.as_str()?.to_owned()))
            .collect();
        let mut layers: Vec<Table> = task_layer
            .into_iter()
            .chain([variant_layer])
            .cloned()
            .collect();
        if !blackout.is_empty() {
            observability = vec![(*blackout).to_owned()];
            layers.push(parse(&format!("observability = [\"{blackout}\"]"))?);
        }
        if observability.is_empty() {
            observability.push("none".into());
        }
        let hyphen = if task.is_empty() { "" } else { "-" };
        presets.push(Preset {
            name: format!("{task}{hyphen}{variant}{suffix}"),
            task,
            variant,
            observability: observability.join("+"),
            about: about(file),
            layers,
        });
    }
    Ok(presets)
}
