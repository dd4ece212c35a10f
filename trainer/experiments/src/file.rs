//! The file that describes an experiment, checked, and the runs that it asks for.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use toml::{Table, Value};
use tpg_runtime::blob::MemoryModel;

pub use super::error::ExperimentError;
use super::error::{unknown_key, value};
use super::locate::line_of;
use super::row::cell_name;
use tpg_tasks::task::{description_file, is_from_file, names};
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
    /// The thesis's chapter that it repeats: 2 or 3. It decides which figures are drawn and which test is the thesis's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chapter: Option<u8>,
    /// Tasks: bare names of those that have presets, full names of others, or paths of the TOML files that describe them, from
    /// the working directory.
    pub tasks: Vec<String>,
    /// Variants, `-b23` or `-b13` included; the preset is called `TASK-VARIANT`, or `VARIANT` where the task has no presets. Or
    /// names of `changed` ones.
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
    /// Other budgets, by task as [`label`] calls it.
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
    /// What its task is called, see [`label`].
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

impl Experiment {
    /// Reads and checks an experiment's file.
    ///
    /// # Errors
    /// [`ExperimentError`] names the line, the key or the value, and the nearest one that would be right.
    pub fn parse(text: &str) -> Result<Self, ExperimentError> {
        Self::read(text).map_err(|error| match line_of(text, &error) {
            Some(line) => ExperimentError::At {
                line,
                source: error.into(),
            },
            None => error,
        })
    }

    fn read(text: &str) -> Result<Self, ExperimentError> {
        check_keys(&text.parse::<Table>().map_err(ConfigError::from)?)?;
        // From the text, so that messages show the line.
        let experiment: Experiment = toml::from_str(text).map_err(ConfigError::from)?;
        experiment.check_values()?;
        experiment.cells()?;
        Ok(experiment)
    }

    fn check_values(&self) -> Result<(), ExperimentError> {
        if let Some(chapter) = self.chapter
            && ![2, 3].contains(&chapter)
        {
            let why = "must be 2 or 3, or left out";
            return Err(value("chapter", chapter, why));
        }
        for (key, names) in [("tasks", &self.tasks), ("variants", &self.variants)] {
            let distinct: BTreeSet<&String> = names.iter().collect();
            if names.is_empty() || distinct.len() < names.len() {
                return Err(value(key, names, "must name at least one, and each once"));
            }
        }
        let labels = self.labels();
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if let Some(name) = labels.iter().find(|name| !name.chars().all(plain)) {
            let why = "a file of a task is named with letters, digits, hyphens and underscores: results are called by it";
            return Err(value("tasks", name, why));
        }
        if let Some(name) = twice(labels.iter().map(String::as_str)) {
            return Err(value(
                "tasks",
                name,
                "two tasks have this name, and results are called by it",
            ));
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
        let by_task = self.budgets.keys().map(|task| ("budgets", task));
        for (key, task) in by_task.chain(self.sets.keys().map(|task| ("sets", task))) {
            if !labels.contains(task) {
                let candidates: Vec<String> = labels.iter().map(|t| format!("{key}.{t}")).collect();
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

    /// What its tasks are called, in order.
    #[must_use]
    pub fn labels(&self) -> Vec<String> {
        self.tasks.iter().map(|task| label(task)).collect()
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
        let (preset, own) = find_preset(task, changed.map_or(variant, |changed| &changed.from))?;
        let label = label(task);
        let name = preset.name.clone();
        let wrong = |source| ExperimentError::Preset {
            preset: name.clone(),
            source,
        };
        let mut sets = Vec::new();
        for (key, table) in [
            ("set", Some(&self.set)),
            ("sets", self.sets.get(&label)),
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
        if own {
            sets.push(format!("task={}", Value::String(task.to_owned())));
        }
        let config = resolve(&preset, None, &sets).map_err(wrong)?;
        let settings = Settings::new(&config).map_err(wrong)?;
        Ok(Cell {
            name: cell_name(&label, variant, 1),
            variant: variant.to_owned(),
            preset: name,
            repeat: 1,
            seed: self.seed,
            config_hash: hash(&config, &settings.task_identity),
            config,
            budget: *self.budgets.get(&label).unwrap_or(&self.budget),
            task: label,
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

/// What a task of an experiment is called: its name, or the name of its file without `.toml`; of a series what follows the folder.
/// Colons and points become hyphens.
#[must_use]
pub fn label(task: &str) -> String {
    let stem = description_file(task).and_then(|path| path.file_stem()?.to_str());
    let series = is_from_file(task).then(|| task.rsplit('/').next());
    let name = stem.or(series.flatten()).unwrap_or(task);
    name.replace([':', '.'], "-")
}

/// The first name that occurs twice.
fn twice<'a>(names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let mut seen = BTreeSet::new();
    names.into_iter().find(|name| !seen.insert(*name))
}

/// The preset of a task and a variant, or whichever of them is unknown; and whether the task is not the preset's own.
fn find_preset(task: &str, variant: &str) -> Result<(Preset, bool), ExperimentError> {
    let all = presets()?;
    let tasks: BTreeSet<&str> = all.iter().map(|preset| preset.task).collect();
    // Of a family every task is one of its own; whether there is such a one its making tells.
    if is_from_file(task) || names().contains(&task) || task.contains(':') {
        return Ok((Preset::find(variant)?, true));
    }
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
    Ok((Preset::find(&format!("{prefix}{variant}"))?, false))
}

/// First 16 hexadecimal digits of SHA-256 over a configuration as TOML, with what fixes the task in place of its path.
fn hash(config: &Config, task_identity: &str) -> String {
    let mut config = config.clone();
    config.task = task_identity.to_owned();
    // Writing a configuration as TOML cannot fail: it holds tables, numbers and text alone.
    let digest = Sha256::digest(toml::to_string(&config).unwrap_or_default());
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
            ("\"acrobot\"]", "\"a b.toml\"]", "letters"),
            ("\"acrobot\"]", "\"cartpole\"]", "each once"),
            ("repeats = 2", "repeats = \"two\"", "repeats"),
            ("seed = 7", "seed = 7\nthreads = 0", "threads"),
        ] {
            let error = Experiment::parse(&TEXT.replacen(old, new, 1)).expect_err(new);
            let message = format!("{:#}", anyhow::Error::new(error));
            assert!(message.contains(expected), "{new}: {message}");
            let line = TEXT.lines().position(|line| line.contains(old)).expect(old) + 1;
            let named = message.contains(&format!("line {line}"));
            // A key that is added stands a line below.
            assert!(
                named || message.contains(&format!("line {}", line + 1)),
                "{new}: {message}"
            );
        }
    }

    #[test]
    fn any_task_can_be_named_and_no_chapter_need_be() {
        let text = TEXT
            .replace("chapter = 2", "")
            .replace("\"acrobot\"]", "\"cartpole-v1\"]")
            .replace("\"per-agent\"", "\"sl\"")
            .replace("acrobot", "cartpole-v1");
        let experiment = Experiment::parse(&text).expect("valid");
        assert_eq!(experiment.chapter, None);
        let cells = experiment.cells().expect("valid");
        assert_eq!(cells[2].name, "cartpole-v1.sl.1");
        assert_eq!(
            (&*cells[2].preset, &*cells[2].config.task),
            ("sl", "cartpole-v1")
        );
        assert_eq!(cells[2].config.evolution.children, 30, "sets of its label");
        assert_eq!(label("some/where/crane.toml"), "crane");
        assert_eq!(label("series:where/tide.csv:LEVEL:25"), "tide-csv-LEVEL-25");
    }

    #[test]
    fn a_task_of_a_family_is_named_with_its_parameter() {
        let text = TEXT
            .replace("\"acrobot\"]", "\"tmaze:100\"]")
            .replace("\"cartpole\", ", "\"tmaze:10\", ")
            .replace("\"per-agent\"", "\"memory\"")
            .replace("acrobot", "tmaze-100");
        let experiment = Experiment::parse(&text).expect("valid");
        let cells = experiment.cells().expect("valid");
        assert_eq!(cells[2].name, "tmaze-100.memory.1");
        assert_eq!(cells[2].config.task, "tmaze:100");
        assert_eq!(cells[2].config.evolution.children, 30, "sets of its label");
        let wrong = text.replace("tmaze:100", "tmaze:0");
        let error =
            Experiment::parse(&wrong.replace("tmaze-100", "tmaze-0")).expect_err("no corridor");
        let message = format!("{:#}", anyhow::Error::new(error));
        assert!(message.contains("tmaze:0"), "{message}");
    }
}
