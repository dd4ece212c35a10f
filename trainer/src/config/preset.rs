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

macro_rules! files {
    ($folder:literal: $($name:literal)*) => {
        &[$(($name, include_str!(concat!("../../presets/", $folder, "/", $name, ".toml"))),)*]
    };
}

const TASKS: &[(&str, &str)] = files!("tasks": "inverted-double-pendulum" "hopper" "half-cheetah" "cartpole" "acrobot" "pendulum");
/// Chapter 3's variants (T Tab 3.1) and future work (T §3.8, §2.7), for every task.
const VARIANTS: &[(&str, &str)] = files!("variants": "sl-nc" "sl" "sr" "sr-sm" "sr-mm" "sr-sm-whole" "sr-sm-uniform" "sr-sm-exchanged");
/// Chapter 2's strategies (T Alg 1) and future work (T §2.7), for its own tasks of classic control.
const STRATEGIES: &[(&str, &str)] = files!("variants": "original" "per-generation" "per-agent" "per-episode" "no-memory"
    "on-fall" "evolved-resets" "per-episode-uniform" "per-episode-exchanged");
/// What is measured against beyond the thesis (docs/learning.md), for every task.
const BASELINES: &[(&str, &str)] = files!("variants": "linear");
/// What has paid beyond the thesis (docs/learning.md), a file for each task.
const CHAMPIONS: &[(&str, &str)] = files!("champions": "inverted-double-pendulum" "hopper" "half-cheetah" "cartpole" "acrobot" "pendulum");
const CLASSIC_CONTROL: &[&str] = &["cartpole", "acrobot", "pendulum"];
/// Suffix and observability; without a suffix the task's own holds.
const BLACKOUTS: &[(&str, &str)] = &[("", ""), ("-b23", "blackout:2/3"), ("-b13", "blackout:1/3")];

/// A named configuration, `<task>-<variant>[-b23|-b13]` or `<task>-champion[-b23]`, or `<variant>[-b23|-b13]` for a task that the user names.
#[derive(Debug, Clone, PartialEq)]
pub struct Preset {
    /// Its name.
    pub name: String,
    /// Bare name of the task; empty for one that the user names.
    pub task: &'static str,
    /// Name of the variant (T Tab 3.1), `linear` or `champion`.
    pub variant: &'static str,
    /// What the policy sees, in canonical form.
    pub observability: String,
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
        for (variant, file) in VARIANTS.iter().chain(STRATEGIES).chain(BASELINES) {
            all.extend(blackouts("", None, variant, &parse(file)?)?);
        }
        let names = all.iter().map(|p| p.name.as_str());
        let suggestion = nearest(name, names);
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
    for (task, task_file) in TASKS {
        let strategies = if CLASSIC_CONTROL.contains(task) {
            STRATEGIES
        } else {
            &[]
        };
        for (variant, variant_file) in VARIANTS.iter().chain(strategies).chain(BASELINES) {
            let (task_layer, variant_layer) = (parse(task_file)?, parse(variant_file)?);
            presets.extend(blackouts(task, Some(&task_layer), variant, &variant_layer)?);
        }
        for (_, file) in CHAMPIONS.iter().filter(|(name, _)| name == task) {
            let (task_layer, champion) = (parse(task_file)?, parse(file)?);
            let all = blackouts(task, Some(&task_layer), "champion", &champion)?;
            // Each is tuned for the observability on which its task is judged.
            let judged = if CLASSIC_CONTROL.contains(task) {
                ""
            } else {
                "-b23"
            };
            presets.extend(all.into_iter().filter(|p| {
                let suffix = p.name.rsplit("champion").next();
                suffix == Some(judged)
            }));
        }
    }
    Ok(presets)
}

/// The presets of a task and a variant, one for each observability; without a task, the variant's alone.
fn blackouts(
    task: &'static str,
    task_layer: Option<&Table>,
    variant: &'static str,
    variant_layer: &Table,
) -> Result<Vec<Preset>, ConfigError> {
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
            layers,
        });
    }
    Ok(presets)
}
