//! The results of an experiment's folder, checked.

use std::fs;
use std::path::Path;

use super::ReportError;
use crate::file::Experiment;
use crate::folder::{FORMAT, Manifest};
use crate::row::{
    Ablation, Access, AccessKind, CellFiles, CurvePoint, Row, cell_name, read_row, read_table,
};
use tpg_tasks::stats;

/// A finished run.
#[derive(Debug, Clone)]
pub(super) struct Run {
    pub(super) row: Row,
    pub(super) curve: Vec<CurvePoint>,
    /// Nothing where programs share no memory.
    pub(super) accesses: Option<Vec<Access>>,
    /// Empty where nothing outlives a decision, and in results that older versions made.
    pub(super) ablations: Vec<Ablation>,
}

/// The runs of one variant on one task, by repeat; some may be missing.
#[derive(Debug, Clone)]
pub(super) struct Group {
    pub(super) task: String,
    pub(super) variant: String,
    /// Number of the variant in the experiment.
    pub(super) series: usize,
    pub(super) runs: Vec<Run>,
}

/// What an experiment's folder holds.
#[derive(Debug, Clone)]
pub(super) struct Results {
    pub(super) experiment: Experiment,
    /// Every variant of every task, in the experiment's order.
    pub(super) groups: Vec<Group>,
    /// Runs that the experiment asks for and the folder has not.
    pub(super) missing: Vec<String>,
}

impl Group {
    /// The champions' mean test returns.
    pub(super) fn test_means(&self) -> Vec<f64> {
        self.runs.iter().map(|run| run.row.test_mean).collect()
    }

    /// The run of the best training score, the first of several, as the thesis picks its champions.
    pub(super) fn best_trained(&self) -> Option<&Run> {
        self.runs.iter().reduce(|best, run| {
            if run.row.train_best > best.row.train_best {
                run
            } else {
                best
            }
        })
    }

    /// Mean of one column over the runs that have it.
    pub(super) fn mean(&self, column: impl Fn(&Row) -> f64) -> f64 {
        let values = self.runs.iter().map(|run| column(&run.row));
        let values: Vec<f64> = values.filter(|value| !value.is_nan()).collect();
        stats::mean(&values)
    }
}

impl Results {
    /// Runs that are there.
    pub(super) fn found(&self) -> usize {
        self.groups.iter().map(|group| group.runs.len()).sum()
    }

    /// The groups of a task that have runs.
    pub(super) fn of_task<'a>(&'a self, task: &'a str) -> impl Iterator<Item = &'a Group> {
        let groups = self.groups.iter();
        groups.filter(move |group| group.task == task && !group.runs.is_empty())
    }

    /// Tasks that have runs, in the experiment's order.
    pub(super) fn tasks(&self) -> Vec<&str> {
        let groups = self.groups.iter().filter(|group| !group.runs.is_empty());
        let mut tasks: Vec<&str> = groups.map(|group| &*group.task).collect();
        tasks.dedup();
        tasks
    }
}

/// Reads all finished runs of an experiment's folder.
pub(super) fn read(folder: &Path) -> Result<Results, ReportError> {
    let manifest = read_manifest(folder)?;
    let experiment = &manifest.experiment;
    let mut groups = Vec::new();
    let mut missing = Vec::new();
    let mut known = Vec::new();
    for task in experiment.labels() {
        for (series, variant) in experiment.variants.iter().enumerate() {
            let mut runs = Vec::new();
            for repeat in 1..=experiment.repeats {
                let cell = cell_name(&task, variant, repeat);
                let files = CellFiles::new(folder, &cell);
                if files.row.exists() {
                    runs.push(read_run(&files, &manifest)?);
                } else {
                    missing.push(cell.clone());
                }
                known.push(cell);
            }
            whole_accesses(folder, &runs)?;
            groups.push(Group {
                task: task.clone(),
                variant: variant.clone(),
                series,
                runs,
            });
        }
    }
    refuse_strangers(folder, &known)?;
    let results = Results {
        experiment: manifest.experiment,
        groups,
        missing,
    };
    if results.found() == 0 {
        return Err(ReportError::Empty {
            folder: folder.to_owned(),
        });
    }
    Ok(results)
}

fn read_run(files: &CellFiles, manifest: &Manifest) -> Result<Run, ReportError> {
    let damaged = |source| ReportError::Damaged { source };
    let row = read_row(&files.row).map_err(damaged)?;
    check_origin(files, manifest, &row)?;
    let curve: Vec<CurvePoint> = read_table(&files.curve).map_err(damaged)?;
    let accesses = if files.accesses.exists() {
        Some(read_table(&files.accesses).map_err(damaged)?)
    } else {
        None
    };
    let ablations: Vec<Ablation> = if files.ablations.exists() {
        read_table(&files.ablations).map_err(damaged)?
    } else {
        Vec::new()
    };
    Ok(Run {
        row,
        curve,
        accesses,
        ablations,
    })
}

/// Either every run of a variant has accesses or none, since either the variant has memory or not.
fn whole_accesses(folder: &Path, runs: &[Run]) -> Result<(), ReportError> {
    let Some(without) = runs.iter().find(|run| run.accesses.is_none()) else {
        return Ok(());
    };
    if runs.iter().any(|run| run.accesses.is_some()) {
        let files = CellFiles::new(folder, &without.row.cell());
        read_table::<Access>(&files.accesses).map_err(|source| ReportError::Damaged { source })?;
    }
    Ok(())
}

/// A row that the experiment does not ask for is a mistake that silence would hide.
fn refuse_strangers(folder: &Path, known: &[String]) -> Result<(), ReportError> {
    let rows = folder.join("rows");
    let Ok(entries) = fs::read_dir(&rows) else {
        return Ok(());
    };
    let mut strangers: Vec<_> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "csv"))
        .filter(|path| {
            let stem = path.file_stem().and_then(|stem| stem.to_str());
            !stem.is_some_and(|stem| known.iter().any(|cell| cell == stem))
        })
        .collect();
    strangers.sort();
    match strangers.into_iter().next() {
        Some(path) => Err(ReportError::Stranger { path }),
        None => Ok(()),
    }
}

/// A row of another configuration or version is no run of this experiment.
fn check_origin(files: &CellFiles, manifest: &Manifest, row: &Row) -> Result<(), ReportError> {
    let experiment = &manifest.experiment;
    let preset = format!("{}-{}", row.task, row.variant);
    let config = manifest.configurations.get(&preset);
    let budget = experiment.budgets.get(&row.task);
    let seed = experiment.seed + u64::from(row.repeat) - 1;
    for (column, value, expected) in [
        ("config", &row.config, config.cloned().unwrap_or_default()),
        (
            "fingerprint",
            &row.fingerprint,
            manifest.made_with.fingerprint.clone(),
        ),
        ("tpg", &row.tpg, manifest.made_with.tpg.clone()),
        (
            "budget",
            &row.budget,
            budget.unwrap_or(&experiment.budget).to_string(),
        ),
        ("seed", &row.seed.to_string(), seed.to_string()),
        (
            "test_episodes",
            &row.test_episodes.to_string(),
            experiment.test_episodes.to_string(),
        ),
    ] {
        if *value != expected {
            return Err(ReportError::Differs {
                path: files.row.clone(),
                column,
                value: value.clone(),
                expected,
            });
        }
    }
    Ok(())
}

/// Accesses of one kind, whatever their place.
pub(super) fn of_kind(accesses: &[Access], kind: AccessKind) -> impl Iterator<Item = &Access> {
    accesses.iter().filter(move |access| access.access == kind)
}

/// What the folder was made for, and with.
fn read_manifest(folder: &Path) -> Result<Manifest, ReportError> {
    let none = |why: String| ReportError::NoExperiment {
        folder: folder.to_owned(),
        why,
    };
    let manifest = Manifest::read(folder).map_err(|e| none(e.to_string()))?;
    let format = manifest.made_with.format;
    if format != FORMAT {
        return Err(none(format!(
            "its form is {format}, this program reads {FORMAT}"
        )));
    }
    Ok(manifest)
}
