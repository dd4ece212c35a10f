//! The file that describes an experiment, checked, and the runs that it asks for.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use toml::{Table, Value};
use tpg_runtime::blob::MemoryModel;

use super::row::cell_name;
use tpg_trainer::config::{
    Config, ConfigError, Preset, Settings, leaves, nearest, presets, resolve,
};
use tpg_trainer::session::Budget;

/// An experiment: every variant on every task, each so many times with another seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Experiment {
    /// Its name.
    pub name: String,
    /// What reports call it; by default its name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub title: Option<String>,
    /// The thesis's chapter that it repeats: 2 or 3.
    pub chapter: u8,
    /// Bare names of tasks.
    pub tasks: Vec<String>,
    /// Variants, `-b23` or `-b13` included; the preset is called `TASK-VARIANT`. Or names of `changed` ones.
    pub variants: Vec<String>,
    /// Runs of each variant on each task.
    pub repeats: u32,
    /// Seed of the first repeat; each further one has the next.
    #[serde(default = "first_seed")]
    pub seed: u64,
    /// Fresh episodes that a run's champion is scored on.
    #[serde(default = "hundred")]
    pub test_episodes: u32,
    /// Threads that score in each run.
    #[serde(default = "one_thread")]
    pub threads: usize,
    /// When each run ends.
    pub budget: Budget,
    /// Other budgets, by task.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub budgets: BTreeMap<String, Budget>,
    /// Keys of the configuration that differ from the presets.
    #[serde(default, skip_serializing_if = "Table::is_empty")]
    pub set: Table,
    /// The same by task; stronger than `set`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub sets: BTreeMap<String, Table>,
    /// Variants of the experiment's own.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub changed: BTreeMap<String, Changed>,
}

/// A variant with other settings, as ablations need them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Changed {
    /// The variant that it comes from.
    pub from: String,
    /// Its settings; stronger than `set` and `sets` of the experiment.
    pub set: Table,
}

/// Every key of an experiment's file, for suggestions.
const KEYS: [&str; 14] = [
    "name",
    "title",
    "chapter",
    "tasks",
    "variants",
    "repeats",
    "seed",
    "test-episodes",
    "threads",
    "budget",
    "budgets",
    "set",
    "sets",
    "changed",
];

/// The largest number of threads, as for `tpg train`.
const MAX_THREADS: usize = 1024;

const fn first_seed() -> u64 {
    1
}

const fn hundred() -> u32 {
    100
}

const fn one_thread() -> usize {
    1
}

/// One run that an experiment asks for.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Name of its files: `TASK.VARIANT.REPEAT`.
    pub name: String,
    /// Bare name of its task.
    pub task: String,
    /// Its variant.
    pub variant: String,
    /// Name of its preset.
    pub preset: String,
    /// Number of the repeat, from 1.
    pub repeat: u32,
    /// The run's seed.
    pub seed: u64,
    /// Its resolved configuration.
    pub config: Config,
    /// 16 hexadecimal digits: hash of that configuration.
    pub config_hash: String,
    /// When it ends.
    pub budget: Budget,
    /// Whether its programs share memory.
    pub has_memory: bool,
}

/// What is wrong with an experiment's file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExperimentError {
    /// An unknown key, a value of the wrong type, or a configuration that makes no sense.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A run's configuration makes no sense.
    #[error("{preset} with the experiment's settings")]
    Preset {
        /// The run's preset.
        preset: String,
        /// What is wrong.
        source: ConfigError,
    },
    /// No preset is for this task.
    #[error("no task of the presets is called {name:?}; did you mean {suggestion:?}?")]
    UnknownTask {
        /// The name that was given.
        name: String,
        /// The nearest task.
        suggestion: String,
    },
    /// The task has no preset of this variant.
    #[error("{task} has no variant {name:?}; did you mean {suggestion:?}? `tpg presets` lists all")]
    UnknownVariant {
        /// The task.
        task: String,
        /// The name that was given.
        name: String,
        /// The task's variant that is spelled most like it.
        suggestion: String,
    },
    /// A value makes no sense.
    #[error("{key} = {value}: {why}")]
    Value {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// What would be right.
        why: &'static str,
    },
}

fn value(key: impl Into<String>, value: impl fmt::Debug, why: &'static str) -> ExperimentError {
    ExperimentError::Value {
        key: key.into(),
        value: format!("{value:?}"),
        why,
    }
}

fn unknown_key(key: String, candidates: &[&str]) -> ExperimentError {
    let suggestion = nearest(&key, candidates.iter().copied());
    ConfigError::UnknownKey { key, suggestion }.into()
}

impl Experiment {
    /// Reads and checks an experiment's file.
    ///
    /// # Errors
    /// [`ExperimentError`] names the key or the value, and the nearest one that would be right.
    pub fn parse(text: &str) -> Result<Self, ExperimentError> {
        let table = text.parse::<Table>().map_err(ConfigError::from)?;
        check_keys(&table)?;
        let experiment: Experiment = Value::Table(table).try_into().map_err(ConfigError::from)?;
        experiment.check_values()?;
        experiment.cells()?;
        Ok(experiment)
    }

    fn check_values(&self) -> Result<(), ExperimentError> {
        if ![2, 3].contains(&self.chapter) {
            return Err(value("chapter", self.chapter, "must be 2 or 3"));
        }
        for (key, names) in [("tasks", &self.tasks), ("variants", &self.variants)] {
            let distinct: BTreeSet<&String> = names.iter().collect();
            if names.is_empty() || distinct.len() < names.len() {
                return Err(value(key, names, "must name at least one, and each once"));
            }
        }
        for (key, n) in [
            ("repeats", self.repeats),
            ("test-episodes", self.test_episodes),
        ] {
            if n == 0 {
                return Err(value(key, n, "must be at least 1"));
            }
        }
        // TOML's integers are signed, so a seed beyond them could not be written down.
        if i64::try_from(self.seed).is_err() || self.seed.checked_add(self.repeats.into()).is_none()
        {
            return Err(value("seed", self.seed, "must be below 2^63"));
        }
        if !(1..=MAX_THREADS).contains(&self.threads) {
            return Err(value("threads", self.threads, "must be 1 to 1024"));
        }
        let own = self.budgets.iter();
        let own = own.map(|(task, budget)| (format!("budgets.{task}"), budget));
        for (key, budget) in own.chain([("budget".to_owned(), &self.budget)]) {
            if !budget.is_positive() {
                return Err(value(key, budget, "must be positive"));
            }
        }
        let tasks: Vec<&str> = self.tasks.iter().map(String::as_str).collect();
        let by_task = self.budgets.keys().map(|task| ("budgets", task));
        for (key, task) in by_task.chain(self.sets.keys().map(|task| ("sets", task))) {
            if !self.tasks.contains(task) {
                let candidates: Vec<String> = tasks.iter().map(|t| format!("{key}.{t}")).collect();
                let candidates: Vec<&str> = candidates.iter().map(String::as_str).collect();
                return Err(unknown_key(format!("{key}.{task}"), &candidates));
            }
        }
        for name in self.changed.keys() {
            let plain = |c: char| c.is_ascii_alphanumeric() || c == '-';
            if name.is_empty() || !name.chars().all(plain) {
                let why = "a name has letters, digits and hyphens: files are called by it";
                return Err(value("changed", name, why));
            }
            if !self.variants.contains(name) {
                return Err(value("changed", name, "is not among variants"));
            }
        }
        Ok(())
    }

    /// The runs that it asks for: repeat after repeat, so that an unfinished experiment has a little of everything.
    ///
    /// # Errors
    /// [`ExperimentError`] if there is no such preset, or if the settings do not fit it.
    pub fn cells(&self) -> Result<Vec<Cell>, ExperimentError> {
        let mut first = Vec::new();
        for task in &self.tasks {
            for variant in &self.variants {
                first.push(self.first_cell(task, variant)?);
            }
        }
        let repeat = |n: u32| {
            first.iter().map(move |cell| Cell {
                name: cell_name(&cell.task, &cell.variant, n),
                repeat: n,
                seed: self.seed + u64::from(n) - 1,
                ..cell.clone()
            })
        };
        Ok((1..=self.repeats).flat_map(repeat).collect())
    }

    fn first_cell(&self, task: &str, variant: &str) -> Result<Cell, ExperimentError> {
        let changed = self.changed.get(variant);
        let preset = find_preset(task, changed.map_or(variant, |changed| &changed.from))?;
        let name = preset.name.clone();
        let wrong = |source| ExperimentError::Preset {
            preset: name.clone(),
            source,
        };
        let mut sets = Vec::new();
        for (key, table) in [
            ("set", Some(&self.set)),
            ("sets", self.sets.get(task)),
            ("changed", changed.map(|changed| &changed.set)),
        ] {
            for (path, new) in leaves(table.into_iter().flatten(), "") {
                if path == "task" {
                    let why = "the task is named by tasks";
                    return Err(value(format!("{key}.task"), new, why));
                }
                sets.push(format!("{path}={new}"));
            }
        }
        let config = resolve(&preset, None, &sets).map_err(wrong)?;
        let settings = Settings::new(&config).map_err(wrong)?;
        Ok(Cell {
            name: cell_name(task, variant, 1),
            task: task.to_owned(),
            variant: variant.to_owned(),
            preset: name,
            repeat: 1,
            seed: self.seed,
            config_hash: hash(&config),
            config,
            budget: *self.budgets.get(task).unwrap_or(&self.budget),
            has_memory: settings.policy_spec.memory_model != MemoryModel::None,
        })
    }
}

/// Refuses keys that do not exist, with the nearest that does.
fn check_keys(table: &Table) -> Result<(), ExperimentError> {
    for (key, inner) in table {
        if !KEYS.contains(&key.as_str()) {
            return Err(unknown_key(key.clone(), &KEYS));
        }
        let budgets: Vec<&Table> = match (key.as_str(), inner) {
            ("budget", Value::Table(budget)) => vec![budget],
            ("budgets", Value::Table(tasks)) => {
                tasks.values().filter_map(Value::as_table).collect()
            }
            _ => continue,
        };
        for name in budgets.into_iter().flat_map(Table::keys) {
            if !Budget::KEYS.contains(&name.as_str()) {
                return Err(unknown_key(name.clone(), &Budget::KEYS));
            }
        }
    }
    Ok(())
}

/// The preset of a task and a variant, or whichever of them is unknown.
fn find_preset(task: &str, variant: &str) -> Result<Preset, ExperimentError> {
    let all = presets()?;
    let tasks: BTreeSet<&str> = all.iter().map(|preset| preset.task).collect();
    if !tasks.contains(task) {
        return Err(ExperimentError::UnknownTask {
            name: task.to_owned(),
            suggestion: nearest(task, tasks.into_iter()),
        });
    }
    let prefix = format!("{task}-");
    let own = all.iter().filter(|preset| preset.task == task);
    let variants: Vec<&str> = own
        .filter_map(|preset| preset.name.strip_prefix(&prefix))
        .collect();
    if !variants.contains(&variant) {
        return Err(ExperimentError::UnknownVariant {
            task: task.to_owned(),
            name: variant.to_owned(),
            suggestion: nearest(variant, variants.into_iter()),
        });
    }
    Ok(Preset::find(&format!("{prefix}{variant}"))?)
}

/// First 16 hexadecimal digits of SHA-256 over a configuration as TOML.
fn hash(config: &Config) -> String {
    // Writing a configuration as TOML cannot fail: it holds tables, numbers and text alone.
    let digest = Sha256::digest(toml::to_string(config).unwrap_or_default());
    let digits = digest.iter().map(|byte| format!("{byte:02x}"));
    digits.take(8).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"
        name = "small"
        chapter = 2
        tasks = ["cartpole", "acrobot"]
        variants = ["per-agent", "sr-sm-b23"]
        repeats = 2
        seed = 7
        budget = { generations = 2 }
        [budgets.acrobot]
        steps = 1000
        [set]
        "evolution.population" = 20
        evolution.children = 10
        [sets.acrobot]
        evolution.children = 30
    "#;

    #[test]
    fn cells_are_the_product_of_everything() {
        let experiment = Experiment::parse(TEXT).expect("valid");
        let cells = experiment.cells().expect("valid");
        let names: Vec<&str> = cells.iter().map(|cell| cell.name.as_str()).collect();
        assert_eq!(names.len(), 8);
        assert_eq!(
            names[..5],
            [
                "cartpole.per-agent.1",
                "cartpole.sr-sm-b23.1",
                "acrobot.per-agent.1",
                "acrobot.sr-sm-b23.1",
                "cartpole.per-agent.2"
            ]
        );
        assert_eq!((cells[0].seed, cells[4].seed), (7, 8));
        assert_eq!(cells[0].budget.to_string(), "generations:2");
        assert_eq!(cells[2].budget.to_string(), "steps:1000");
        assert_eq!(cells[0].config.evolution.population, 20);
        assert_eq!(cells[0].config.evolution.children, 10);
        assert_eq!(cells[2].config.evolution.children, 30);
        assert_eq!(cells[0].config_hash, cells[4].config_hash);
        assert_ne!(cells[0].config_hash, cells[2].config_hash);
        assert_eq!(cells[0].config_hash.len(), 16);
        assert!(cells.iter().all(|cell| cell.has_memory));
    }

    #[test]
    fn a_changed_variant_is_its_origin_with_other_settings() {
        let text = TEXT.replace("\"sr-sm-b23\"", "\"small\"")
            + "\n[changed.small]\nfrom = \"sr-sm-b23\"\nset = { evolution.children = 3 }\n";
        let experiment = Experiment::parse(&text).expect("valid");
        let cells = experiment.cells().expect("valid");
        assert_eq!(cells[1].name, "cartpole.small.1");
        assert_eq!(cells[1].preset, "cartpole-sr-sm-b23");
        let [evolution, origin] = [&cells[1].config.evolution, &cells[0].config.evolution];
        assert_eq!((evolution.children, evolution.population), (3, 20));
        assert_eq!(origin.children, 10);
        // Stronger than what holds for the task.
        assert_eq!(cells[3].config.evolution.children, 3);
        for (old, new, expected) in [
            ("changed.small", "changed.smaller", "\"smaller\""),
            ("changed.small", "changed.\"a/b\"", "letters"),
            ("from = \"sr-sm-b23\"", "from = \"sr-sm-b32\"", "sr-sm-b23"),
            ("from =", "form =", "from"),
        ] {
            let error = Experiment::parse(&text.replacen(old, new, 1)).expect_err(new);
            let message = format!("{:#}", anyhow::Error::new(error));
            assert!(message.contains(expected), "{new}: {message}");
        }
        let survivor = toml::to_string(&experiment).expect("it can be written");
        assert_eq!(Experiment::parse(&survivor).expect("valid"), experiment);
    }

    #[test]
    fn an_experiment_survives_its_own_text() {
        let experiment = Experiment::parse(TEXT).expect("valid");
        let text = toml::to_string(&experiment).expect("it can be written");
        assert_eq!(Experiment::parse(&text).expect("valid"), experiment);
    }

    #[test]
    fn mistakes_are_named_with_what_would_be_right() {
        for (old, new, expected) in [
            ("repeats = 2", "repeat = 2", "\"repeats\""),
            ("\"cartpole\"", "\"cartpol\"", "\"cartpole\""),
            ("\"per-agent\"", "\"per-agnet\"", "\"per-agent\""),
            ("generations = 2", "generation = 2", "\"generations\""),
            ("generations = 2", "generations = 0", "positive"),
            ("budgets.acrobot", "budgets.acrobat", "budgets.acrobot"),
            (
                "evolution.children",
                "evolution.child",
                "evolution.children",
            ),
            (
                "evolution.children = 10",
                "evolution.children = 0",
                "at least 1",
            ),
            ("evolution.children", "task", "tasks"),
            ("chapter = 2", "chapter = 4", "2 or 3"),
            ("\"acrobot\"]", "\"cartpole\"]", "each once"),
            ("repeats = 2", "repeats = \"two\"", "repeats"),
            ("seed = 7", "seed = 7\nthreads = 0", "threads"),
        ] {
            let error = Experiment::parse(&TEXT.replacen(old, new, 1)).expect_err(new);
            let message = format!("{:#}", anyhow::Error::new(error));
            assert!(message.contains(expected), "{new}: {message}");
        }
    }
}
