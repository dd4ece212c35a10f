//! The page of an experiment: `report.html` in its folder.

use std::path::{Path, PathBuf};
use std::process;
use std::{fs, io};

use toml::Table as Toml;

use super::load::{self, Group, Results};
use super::{ReportError, completeness};
use crate::row::{CurvePoint, TableError};
use tpg_tasks::stats::{bootstrap_mean_95, mean};
use tpg_trainer::config::leaves;
use tpg_trainer::report_page::{Chart, Link, Page, Run, Series, Setting, Table, rounded};

/// Points of a run's curve above which only every second, third, ... is drawn.
const POINTS: usize = 400;

/// Writes the page of an experiment's finished runs, in place of the one before. Several processes may do so.
///
/// # Errors
/// [`ReportError`] if the folder is no experiment's, if a finished run is damaged, or if the page cannot be written.
pub fn write_page(folder: &Path) -> Result<PathBuf, ReportError> {
    let results = load::read(folder)?;
    let path = folder.join("report.html");
    let written = page(folder, &results)
        .html()
        .and_then(|html| replace(&path, &html));
    written.map_err(|source| ReportError::Write {
        source: TableError::Io {
            action: "write",
            path: path.clone(),
            source,
        },
    })?;
    Ok(path)
}

/// Replaces the page. Processes that share an experiment have a file each until it is whole.
fn replace(path: &Path, html: &str) -> io::Result<()> {
    let whole = path.with_extension(format!("html.{}", process::id()));
    let replaced = fs::write(&whole, html).and_then(|()| fs::rename(&whole, path));
    if replaced.is_err() {
        let _ = fs::remove_file(&whole);
    }
    replaced
}

fn page(folder: &Path, results: &Results) -> Page {
    let experiment = &results.experiment;
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let group_name = |task: &str, variant: &str| format!("{task}.{variant}");
    let charts = results.tasks().into_iter().map(|task| Chart {
        title: format!("{task}: training score"),
        note: "mean over seeds, from the least to the greatest".into(),
        series: (results.of_task(task))
            .map(|group| Series {
                label: group.variant.clone(),
                group: group_name(task, &group.variant),
                column: "best",
            })
            .collect(),
    });
    let runs = results.groups.iter().flat_map(|group| {
        let name = group_name(&group.task, &group.variant);
        (group.runs.iter()).map(move |run| curve(name.clone(), &run.curve))
    });
    let settings = Toml::try_from(experiment).unwrap_or_default();
    let settings = leaves(&settings, "")
        .into_iter()
        .map(|(key, value)| Setting {
            key,
            value: value.to_string(),
            default: None,
        });
    let files = [
        ("tables and figures", "report/scores.md"),
        ("experiment.toml", "experiment.toml"),
    ];
    let there = files
        .into_iter()
        .filter(|(_, path)| folder.join(path).exists());
    Page {
        title: name.into_owned(),
        facts: [
            ("finished", completeness(results)),
            ("test episodes", experiment.test_episodes.to_string()),
            ("budget", experiment.budget.to_string()),
        ]
        .map(|(name, value)| [name.to_owned(), value])
        .into(),
        runs: runs.collect(),
        charts: charts.collect(),
        tables: vec![scores(results)],
        settings: settings.collect(),
        links: there
            .map(|(label, path)| Link {
                label: label.into(),
                path: path.into(),
            })
            .collect(),
    }
}

/// A run's curve, of few points; the last one is among them.
fn curve(group: String, curve: &[CurvePoint]) -> Run {
    let stride = curve.len().div_ceil(POINTS).max(1);
    let last = curve.len().saturating_sub(1);
    let kept = curve.iter().enumerate();
    let kept = kept.filter(|(k, _)| k % stride == 0 || *k == last);
    let points: Vec<&CurvePoint> = kept.map(|(_, point)| point).collect();
    Run {
        group,
        generations: points.iter().map(|point| point.generation).collect(),
        steps: points.iter().map(|point| point.steps).collect(),
        minutes: (points.iter())
            .map(|point| rounded(point.seconds / 60.0).unwrap_or(0.0))
            .collect(),
        columns: vec![(
            "best",
            points.iter().map(|point| rounded(point.best)).collect(),
        )],
    }
}

/// Means over fresh episodes, as in the table of scores.
fn scores(results: &Results) -> Table {
    let row = |group: &Group| {
        let means = group.test_means();
        let [low, high] = bootstrap_mean_95(&means);
        let interval = match means.len() {
            0 | 1 => String::new(),
            _ => format!("[{low:.2}, {high:.2}]"),
        };
        let best = means.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        vec![
            group.task.clone(),
            group.variant.clone(),
            group.runs.len().to_string(),
            format!("{:.2}", mean(&means)),
            interval,
            format!("{best:.2}"),
            format!("{:.1}", group.mean(|row| row.instructions_mean)),
        ]
    };
    let head = [
        "task",
        "variant",
        "runs",
        "mean over fresh episodes",
        "95 %",
        "best run",
        "instructions a decision",
    ];
    let groups = results.groups.iter().filter(|group| !group.runs.is_empty());
    Table {
        title: "scores".into(),
        head: head.map(str::to_owned).into(),
        rows: groups.map(row).collect(),
    }
}
