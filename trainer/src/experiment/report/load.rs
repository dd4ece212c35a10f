//! The results of an experiment's folder, checked.

use std::fs;
use std::path::Path;

use super::ReportError;
use crate::experiment::file::Experiment;
use crate::experiment::row::{
    Access, AccessKind, CellFiles, CurvePoint, Row, cell_name, read_row, read_table,
};
use crate::stats;

/// A finished run.
#[derive(Debug, Clone)]
pub(super) struct Run {
    pub(super) row: Row,
    pub(super) curve: Vec<CurvePoint>,
    /// Nothing where programs share no memory.
    pub(super) accesses: Option<Vec<Access>>,
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

    /// Mean of one column.
    pub(super) fn mean(&self, column: impl Fn(&Row) -> f64) -> f64 {
        let values: Vec<f64> = self.runs.iter().map(|run| column(&run.row)).collect();
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
        let tasks = self.experiment.tasks.iter().map(String::as_str);
        tasks
            .filter(|task| self.of_task(task).next().is_some())
            .collect()
    }
}

/// Reads all finished runs of an experiment's folder.
pub(super) fn read(folder: &Path) -> Result<Results, ReportError> {
    let experiment = read_experiment(folder)?;
    let mut groups = Vec::new();
    let mut missing = Vec::new();
    let mut known = Vec::new();
    for task in &experiment.tasks {
        for (series, variant) in experiment.variants.iter().enumerate() {
            let mut runs = Vec::new();
            for repeat in 1..=experiment.repeats {
                let cell = cell_name(task, variant, repeat);
                let files = CellFiles::new(folder, &cell);
                if files.row.exists() {
                    runs.push(read_run(&files)?);
                } else {
                    missing.push(cell.clone());
                }
                known.push(cell);
            }
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
        experiment,
        groups,
        missing,
    };
    if results.found() == 0 {
        return Err(ReportError::Empty {
            folder: folder.to_owned(),
        });
    }
    same_programs(folder, &results)?;
    Ok(results)
}

fn read_run(files: &CellFiles) -> Result<Run, ReportError> {
    let damaged = |source| ReportError::Damaged { source };
    let row = read_row(&files.row).map_err(damaged)?;
    let curve: Vec<CurvePoint> = read_table(&files.curve).map_err(damaged)?;
    let accesses = if files.accesses.exists() {
        Some(read_table(&files.accesses).map_err(damaged)?)
    } else {
        None
    };
    Ok(Run {
        row,
        curve,
        accesses,
    })
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

/// Runs of one variant on one task are repeats only under one configuration and one instruction set.
fn same_programs(folder: &Path, results: &Results) -> Result<(), ReportError> {
    for group in &results.groups {
        let Some((first, rest)) = group.runs.split_first() else {
            continue;
        };
        for run in rest {
            for (column, a, b) in [
                ("config", &first.row.config, &run.row.config),
                ("fingerprint", &first.row.fingerprint, &run.row.fingerprint),
                ("budget", &first.row.budget, &run.row.budget),
            ] {
                if a != b {
                    return Err(ReportError::Unlike {
                        folder: folder.to_owned(),
                        first: first.row.cell(),
                        second: run.row.cell(),
                        column,
                        values: [a.clone(), b.clone()],
                    });
                }
            }
        }
    }
    Ok(())
}

/// Accesses of one kind, whatever their place.
pub(super) fn of_kind(accesses: &[Access], kind: AccessKind) -> impl Iterator<Item = &Access> {
    accesses.iter().filter(move |access| access.access == kind)
}

/// The experiment that the folder was made for.
fn read_experiment(folder: &Path) -> Result<Experiment, ReportError> {
    let none = |why: String| ReportError::NoExperiment {
        folder: folder.to_owned(),
        why,
    };
    let path = folder.join("experiment.toml");
    let text =
        fs::read_to_string(&path).map_err(|e| none(format!("cannot read experiment.toml: {e}")))?;
    Experiment::parse(&text).map_err(|e| none(format!("{:#}", anyhow::Error::new(e))))
}
