//! The folder of an experiment: it explains itself, and what is in it was made with one version and one configuration.
//!
//! | entry | what it holds |
//! |---|---|
//! | `experiment.toml` | a [`Manifest`]: the experiment and what it was made with |
//! | `rows/` | a [`Row`] for each finished run |
//! | `curves/` | its learning curve |
//! | `accesses/` | its champion's memory accesses, where there is memory |
//! | `ablations/` | what its champion scores if it forgets, where something outlives a decision |
//! | `work/` | run folders of runs that are not finished, and which process does them |

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::file::{Cell, Experiment};
use super::row::{
    Access, CellFiles, CurvePoint, Row, TableError, read_row, read_table, write_synced,
};
use tpg_tasks::console::one_line;
use tpg_trainer::config::leaves;
use tpg_trainer::made_with::MadeWith;

/// The form of the folder; raised when its files change their meaning.
pub const FORMAT: u32 = 1;

/// What an experiment is and what its results were made with: `experiment.toml`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Manifest {
    /// The experiment, with every default filled in.
    pub experiment: Experiment,
    /// What its results were made with.
    pub made_with: MadeWith,
    /// For each `TASK-VARIANT`, the hash of its resolved configuration.
    pub configurations: BTreeMap<String, String>,
}

impl Manifest {
    /// Describes an experiment that this build runs.
    #[must_use]
    pub fn new(experiment: &Experiment, cells: &[Cell]) -> Self {
        let hashes = cells.iter();
        Manifest {
            experiment: experiment.clone(),
            made_with: MadeWith::this_build(FORMAT),
            configurations: hashes
                .map(|cell| {
                    (
                        format!("{}-{}", cell.task, cell.variant),
                        cell.config_hash.clone(),
                    )
                })
                .collect(),
        }
    }

    /// Reads the `experiment.toml` of a folder.
    ///
    /// # Errors
    /// [`FolderError::Unreadable`].
    pub fn read(folder: &Path) -> Result<Self, FolderError> {
        let path = folder.join(MANIFEST);
        let text = fs::read_to_string(&path).map_err(|e| unreadable(&path, &e))?;
        toml::from_str(&text).map_err(|e| unreadable(&path, &one_line(&e)))
    }
}

const MANIFEST: &str = "experiment.toml";

/// Why a folder of results cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FolderError {
    /// It was made with another version or another configuration.
    #[error(
        "{folder} was made with another version or configuration; choose another folder by --out, or delete it to \
         begin anew: {}",
        differences.join("; ")
    )]
    Differs {
        /// The folder or the file.
        folder: PathBuf,
        /// Every key that differs, with both values.
        differences: Vec<String>,
    },
    /// A file in it cannot be read or is no such file.
    #[error("cannot use {path}: {why}")]
    Unreadable {
        /// Which file.
        path: PathBuf,
        /// What came of it.
        why: String,
    },
    /// It could not be written.
    #[error(transparent)]
    Write(#[from] TableError),
}

fn unreadable(path: &Path, why: &impl ToString) -> FolderError {
    FolderError::Unreadable {
        path: path.to_owned(),
        why: why.to_string(),
    }
}

/// The state of a run in the folder.
#[derive(Debug)]
pub enum Found {
    /// It is finished.
    Finished,
    /// There is no row of it.
    Nothing,
    /// It is half-written or damaged.
    Damaged(TableError),
}

/// The folder of an experiment whose manifest is known to fit.
#[derive(Debug, Clone)]
pub struct Folder {
    path: PathBuf,
}

impl Folder {
    /// Makes the folder of an experiment, or opens it if it is of this experiment and version.
    ///
    /// An experiment may have grown: more repeats, tasks and variants only add to what is there.
    ///
    /// # Errors
    /// [`FolderError`].
    pub fn open(path: &Path, manifest: &Manifest) -> Result<Self, FolderError> {
        let file = path.join(MANIFEST);
        let text = match fs::read_to_string(&file) {
            Ok(text) => Some(text),
            Err(e) if e.kind() == ErrorKind::NotFound => None,
            Err(e) => return Err(unreadable(&file, &e)),
        };
        let new = Table::try_from(manifest).map_err(|e| unreadable(&file, &one_line(&e)))?;
        let mut is_current = false;
        if let Some(text) = &text {
            let old: Table = text.parse().map_err(|e| unreadable(&file, &one_line(&e)))?;
            is_current = old == new;
            let differences = differences(&grown(old, &new), &new);
            if !differences.is_empty() {
                return Err(FolderError::Differs {
                    folder: path.to_owned(),
                    differences,
                });
            }
        }
        for kind in ["rows", "curves", "accesses", "ablations", "work"] {
            fs::create_dir_all(path.join(kind)).map_err(|e| unreadable(path, &e))?;
        }
        if !is_current {
            let text = format!(
                "# What the results in this folder were made with; `tpg experiment run` adds no others.\n\n{new}"
            );
            write_synced(&file, text.as_bytes())?;
        }
        Ok(Folder {
            path: path.to_owned(),
        })
    }

    /// The folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The files of a run.
    #[must_use]
    pub fn files(&self, cell: &Cell) -> CellFiles {
        CellFiles::new(&self.path, &cell.name)
    }

    /// The folder of an unfinished run.
    #[must_use]
    pub fn work(&self, cell: &Cell) -> PathBuf {
        self.path.join("work").join(&cell.name)
    }

    /// The file by which one process claims a run.
    #[must_use]
    pub fn claim(&self, cell: &Cell) -> PathBuf {
        self.path.join("work").join(format!("{}.claim", cell.name))
    }

    /// What there is of a run.
    ///
    /// # Errors
    /// [`FolderError::Differs`] if its row is of another configuration or version than the manifest says.
    pub fn find(&self, manifest: &Manifest, cell: &Cell) -> Result<Found, FolderError> {
        let files = self.files(cell);
        if !files.row.exists() {
            return Ok(Found::Nothing);
        }
        let whole = || {
            let row = read_row(&files.row)?;
            read_table::<CurvePoint>(&files.curve)?;
            if cell.has_memory {
                read_table::<Access>(&files.accesses)?;
            }
            Ok(row)
        };
        let row = match whole() {
            Ok(row) => row,
            Err(damage) => return Ok(Found::Damaged(damage)),
        };
        let differences = row_differences(manifest, cell, &row);
        if !differences.is_empty() {
            return Err(FolderError::Differs {
                folder: files.row,
                differences,
            });
        }
        Ok(Found::Finished)
    }

    /// Removes the row of a run with its other tables.
    ///
    /// # Errors
    /// [`FolderError::Unreadable`] if one of them stays.
    pub fn remove(&self, cell: &Cell) -> Result<(), FolderError> {
        let files = self.files(cell);
        for path in [files.row, files.curve, files.accesses, files.ablations] {
            match fs::remove_file(&path) {
                Err(e) if e.kind() != ErrorKind::NotFound => return Err(unreadable(&path, &e)),
                _ => {}
            }
        }
        Ok(())
    }
}

/// An old manifest as it would be if its experiment had grown as the new one has.
fn grown(mut old: Table, new: &Table) -> Table {
    let part = |key: &str| new.get(key).and_then(Value::as_table);
    if let (Some(Value::Table(experiment)), Some(to)) =
        (old.get_mut("experiment"), part("experiment"))
    {
        experiment.remove("title");
        for key in ["title", "repeats", "tasks", "variants", "changed"] {
            let has_grown = match (experiment.get(key), to.get(key)) {
                (None, _) => true,
                (Some(Value::Integer(few)), Some(Value::Integer(more))) => few < more,
                (Some(Value::Array(few)), Some(Value::Array(more))) => {
                    few.iter().all(|x| more.contains(x))
                }
                (Some(Value::Table(few)), Some(Value::Table(more))) => {
                    few.iter().all(|(name, x)| more.get(name) == Some(x))
                }
                _ => false,
            };
            if let (true, Some(value)) = (has_grown, to.get(key)) {
                experiment.insert(key.to_owned(), value.clone());
            }
        }
    }
    if let (Some(Value::Table(configurations)), Some(to)) =
        (old.get_mut("configurations"), part("configurations"))
    {
        for (preset, hash) in to {
            configurations
                .entry(preset.clone())
                .or_insert_with(|| hash.clone());
        }
    }
    old
}

/// Every key that is not the same in both tables, with both values.
fn differences(old: &Table, new: &Table) -> Vec<String> {
    let [old, new] = [old, new].map(|table| {
        let all = leaves(table, "").into_iter();
        all.map(|(key, value)| (key, value.to_string()))
            .collect::<BTreeMap<String, String>>()
    });
    let keys: std::collections::BTreeSet<&String> = old.keys().chain(new.keys()).collect();
    let differs = keys
        .into_iter()
        .filter(|key| old.get(*key) != new.get(*key));
    let shown = |value: Option<&String>| value.map_or("nothing", String::as_str).to_owned();
    differs
        .map(|key| difference(key, &shown(old.get(key)), &shown(new.get(key))))
        .collect()
}

fn difference(key: &str, old: &str, new: &str) -> String {
    format!("{key} is {old} there and {new} here")
}

/// What a row has otherwise than a run of this experiment would.
fn row_differences(manifest: &Manifest, cell: &Cell, row: &Row) -> Vec<String> {
    let (experiment, made_with) = (&manifest.experiment, &manifest.made_with);
    let pairs: [(&str, &dyn ToString, &dyn ToString); 7] = [
        ("seed", &row.seed, &cell.seed),
        ("config", &row.config, &cell.config_hash),
        ("tpg", &row.tpg, &made_with.tpg),
        ("fingerprint", &row.fingerprint, &made_with.fingerprint),
        ("budget", &row.budget, &cell.budget),
        ("threads", &row.threads, &experiment.threads),
        (
            "test_episodes",
            &row.test_episodes,
            &experiment.test_episodes,
        ),
    ];
    let pairs = pairs.map(|(key, old, new)| (key, old.to_string(), new.to_string()));
    let differing = pairs.into_iter().filter(|(_, old, new)| old != new);
    differing
        .map(|(key, old, new)| difference(key, &old, &new))
        .collect()
}

/// The folder that belongs to an experiment's file: its path without `.toml`.
#[must_use]
pub fn default_folder(file: &Path) -> PathBuf {
    file.with_extension("")
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"
        name = "small"
        chapter = 2
        tasks = ["cartpole"]
        variants = ["per-agent"]
        repeats = 1
        budget = { generations = 2 }
    "#;

    fn manifest(text: &str) -> Manifest {
        let experiment = Experiment::parse(text).expect("valid");
        let cells = experiment.cells().expect("valid");
        Manifest::new(&experiment, &cells)
    }

    #[test]
    fn a_folder_takes_its_own_experiment_and_no_other() {
        let parent = tempfile::tempdir().expect("a temporary folder");
        let path = parent.path().join("small");
        let first = manifest(TEXT);
        Folder::open(&path, &first).expect("made");
        assert_eq!(Manifest::read(&path).expect("it reads back"), first);
        Folder::open(&path, &first).expect("the same");
        let more = TEXT.replace("repeats = 1", "repeats = 3");
        let more = more.replace("\"per-agent\"", "\"per-agent\", \"original\", \"few\"");
        let few = "[changed.few]\nfrom = \"per-agent\"\nset = { evolution.children = 3 }";
        let more = manifest(&format!("{more}\n{few}"));
        Folder::open(&path, &more).expect("grown");
        assert_eq!(Manifest::read(&path).expect("it reads back"), more);
        let message = Folder::open(&path, &first)
            .expect_err("smaller")
            .to_string();
        assert!(
            message.contains("experiment.repeats is 3 there and 1 here"),
            "{message}"
        );
        let path = parent.path().join("another");
        Folder::open(&path, &first).expect("made");
        let text = TEXT.replace("generations = 2", "steps = 30");
        let changed = format!("{text}\n[set]\nevolution.population = 7");
        let error = Folder::open(&path, &manifest(&changed)).expect_err("another");
        let message = error.to_string();
        for part in [
            "experiment.budget.generations is 2 there and nothing here",
            "experiment.budget.steps is nothing there and 30 here",
            "experiment.set.evolution.population is nothing there and 7 here",
            "configurations.cartpole-per-agent",
        ] {
            assert!(message.contains(part), "{message}");
        }
        let mut other = first;
        other.made_with.tpg = "9.9.9".into();
        let error = Folder::open(&path, &other).expect_err("another version");
        assert!(error.to_string().contains("9.9.9"), "{error}");
    }
}
